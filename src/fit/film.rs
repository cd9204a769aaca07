//! Films of balls with their fit: what it says of each shot.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::problem::{Impact, Solution};

/// The shots of a film with the fit of their frames.
#[derive(Clone, Debug)]
pub(crate) struct FittedFilm {
    pub(crate) solution: Arc<Solution>,
    /// The sources of the shots of the fit, in its order.
    pub(crate) tracks: Arc<Vec<TrackShot>>,
    /// The impacts of all shots that show one, independently of the law of the impact.
    pub(crate) impacts: Arc<Vec<Impact>>,
    /// Relative standard deviation of the stated scale.
    pub(crate) scale_sd: f64,
}

impl FittedFilm {
    /// Returns the shots of a fit with what they were read from.
    pub(crate) fn new(solution: impl Into<Arc<Solution>>, dataset: &Dataset) -> Self {
        let (solution, read) = (solution.into(), dataset.tracks.as_ref());
        let shots = read.into_iter().flat_map(|tracks| &tracks.shots);
        let shots: HashMap<&str, &TrackShot> = shots.map(|shot| (shot.name.as_str(), shot)).collect();
        // without the positions: those of large films do not fit in memory twice
        let source = |name: &String| {
            let shot = *shots.get(name.as_str())?;
            let (name, file, labels) = (shot.name.clone(), shot.file.clone(), shot.labels.clone());
            let (cue, object, markers) = (Vec::new(), Vec::new(), shot.markers.clone());
            Some(TrackShot { name, file, labels, cue, object, markers, ..*shot })
        };
        let tracks: Vec<TrackShot> = solution.names().iter().filter_map(source).collect();
        let impacts = tracks.par_iter().enumerate().filter_map(|(i, track)| solution.impact(i, track));
        let impacts = Arc::new(impacts.collect());
        let scale_sd = read.and_then(|tracks| tracks.scale_sd).unwrap_or(0.0);
        Self { solution, tracks: Arc::new(tracks), impacts, scale_sd }
    }

    /// Returns the impact of the shot of this name.
    pub fn impact(&self, name: &str) -> Option<&Impact> {
        self.impacts.iter().find(|impact| impact.shot.name == name)
    }
}
