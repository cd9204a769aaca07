//! The fit of all that the data tell: what they do not is held, and the rest fitted again.

use super::identify;
use super::noise::Group;
use super::plateau::Plateau;
use super::search::Search;
use super::uncertainty::{self, Minimum};
use super::{FitError, Identifiability};
use crate::parameters::{Parameter, Settings};
use crate::residuals::Fitted;

/// A minimum at which everything that is still free is determined.
pub(super) struct Settled<'a> {
    /// With what the data do not tell held.
    pub search: Search<'a>,
    pub free: Vec<Parameter>,
    pub minimum: Minimum,
    pub estimated: Vec<Group>,
    pub plateaus: Vec<Plateau>,
    pub identifiability: Option<Identifiability>,
}

impl<'a> Settled<'a> {
    /// Fits all that is free and that the data tell.
    pub(super) fn new(search: &Search<'a>) -> Result<Self, FitError> {
        let mut search = search.clone();
        let settings = search.settings;
        let silent = search.silent(&search.initial);
        search.untold = silent.iter().copied().filter(|p| !settings[*p].fixed).collect();
        let silent = search.untold.clone();
        let mut free: Vec<Parameter> = settings
            .parameters()
            .iter()
            .copied()
            .filter(|p| !settings[*p].fixed && !silent.contains(p))
            .collect();
        let observations = observations(search.fitted);
        if observations + priors(settings, &free) < free.len() {
            return Err(FitError::TooFewObservations {
                dataset: String::new(),
                observations,
                parameters: free.iter().map(|p| p.name()).collect::<Vec<_>>().join(", "),
            });
        }
        let mut identifiability = None;
        let mut plateaus: Vec<Plateau> = Vec::new();
        loop {
            let (minimum, estimated) = search.converge(&free)?;
            let ties = minimum.ties(false);
            let identify = || identify::identify(&minimum.jacobian, &ties, &free, &minimum.x, silent.clone());
            let null = uncertainty::null_direction(&identify::with_ties(&minimum.jacobian, &ties));
            let Some(null) = null else {
                identifiability = identifiability.or_else(identify);
                for plateau in &mut plateaus {
                    *plateau = search.plateau(plateau.parameter, &minimum.values);
                }
                return Ok(Self { search, free, minimum, estimated, plateaus, identifiability });
            };
            // what the data cannot tell is left where it started, or at the edge from which on they no
            // longer tell it, and the rest fitted again
            let lost: Vec<Parameter> =
                null.iter().filter_map(|(column, _)| free.get(*column).copied()).collect();
            if let [parameter] = lost[..] {
                let plateau = search.plateau(parameter, &minimum.values);
                // well inside: at its edge the weights would be those of either side, by the last digit
                search.initial[parameter] = 0.5 * (plateau.edge + plateau.bound);
                plateaus.push(plateau);
            } else {
                identifiability = identify();
            }
            search.untold.extend(&lost);
            free.retain(|p| !lost.contains(p));
        }
    }
}

/// Numbers that are fitted, less the unknowns of each shot where its frames are.
pub(super) fn observations(fitted: &[Fitted]) -> usize {
    let of = |shot: &Fitted| match &shot.film {
        Some(film) => film.observations().saturating_sub(film.unknowns()),
        None => shot.plan.rows().len(),
    };
    fitted.iter().map(of).sum()
}

/// How many of the free parameters have a prior.
pub(super) fn priors(settings: &Settings, free: &[Parameter]) -> usize {
    free.iter().filter(|p| settings[**p].prior.is_some()).count()
}
