//! Films of balls with their fit: what it says of each shot.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::problem::{FittedFrame, Impact, OwnEstimate, Solution};

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

    /// Returns the frames of both balls in shot `i`, m in the film at its stated scale.
    pub(crate) fn frames(&self, i: usize) -> impl Iterator<Item = FittedFrame> {
        let [x, y] = self.solution.origin();
        let moved = move |place: [f64; 2]| [place[0] + x, place[1] + y];
        self.solution.fitted_frames(i).into_iter().map(move |frame| FittedFrame {
            seen: moved(frame.seen),
            predicted: moved(frame.predicted),
            ..frame
        })
    }

    /// Returns the unknowns of each shot, with its name: impact, velocity, spins.
    pub fn estimates(&self) -> Vec<(&str, Vec<OwnEstimate>)> {
        let names = self.solution.names().iter().map(String::as_str);
        names.zip(self.solution.own_estimates(self.solution.origin())).collect()
    }

    /// Writes the text of each shot, some shots at a time: not all frames may fit in memory.
    #[cfg(feature = "report")]
    pub(crate) fn write(
        &self,
        to: &mut (dyn std::io::Write + Send),
        text: impl Fn(usize) -> String + Sync,
    ) -> std::io::Result<()> {
        const AT_A_TIME: usize = 512;
        let shots: Vec<usize> = (0..self.tracks.len()).collect();
        for some in shots.chunks(AT_A_TIME) {
            let texts: Vec<String> = some.par_iter().map(|i| text(*i)).collect();
            to.write_all(texts.concat().as_bytes())?;
        }
        Ok(())
    }
}
