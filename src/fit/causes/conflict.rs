//! The conflict between what is stated of the balls' masses and what the shots show.
//!
//! Linearly, no fit is repeated: with the prior m ± s, the estimate x ± √C of the fit and w = s²/(s² − C), the shots alone give
//! m + w(x − m) ± √(wC), which differs from m by (x − m)/√(s² − C) standard deviations.

use super::{Cause, Explanation};
use crate::fit::{Estimate, Fit, Status};
use crate::measurement::dataset::ObjectBall;
use crate::measurement::number::{plain, with_error};
use crate::measurement::parameter::{Parameter, Prior};

/// Standard deviations between the shots and a prior from which on they contradict each other: one in 400 by chance.
const CONFLICT: f64 = 3.0;

impl Fit {
    /// What was known of m_cue/m_object before the fit; `None` of exact masses and of discs.
    pub(in crate::fit) fn stated_mass_ratio(&self) -> Option<Prior> {
        let object = self.object.unwrap_or(ObjectBall::unweighed(self.ball));
        let sd = object.mass_ratio_sd(self.ball).filter(|_| self.discs.is_none())?;
        Some(Prior { mean: self.ball.mass / object.ball.mass, sd })
    }

    /// Masses that the shots contradict, with what the parameters would be if nothing were stated of them.
    pub(in crate::fit) fn conflict_of_masses(&self) -> Option<Explanation> {
        let Prior { mean, sd } = self.stated_mass_ratio()?;
        let place = self.estimates.iter().position(|e| e.parameter == Parameter::MassRatio)?;
        let Estimate { value, std_error: Some(std_error), status: Status::Free, .. } = self.estimates[place]
        else {
            return None;
        };
        let left = sd.powi(2) - std_error.powi(2);
        let deviation = (value - mean) / left.sqrt();
        if left <= 0.0 || deviation.abs() < CONFLICT {
            return None;
        }
        let wider = sd.powi(2) / left;
        let (estimate, error) = (mean + wider * (value - mean), wider.sqrt() * std_error);
        let covariance = self.covariance();
        let moved = |(i, other): (usize, &Estimate)| {
            let slope = covariance[(i, place)] / std_error.powi(2);
            let variance = other.std_error?.powi(2) + slope.powi(2) * (error.powi(2) - std_error.powi(2));
            Some((other.parameter, other.value + slope * (estimate - value), variance.sqrt()))
        };
        let others = self.estimates.iter().enumerate().filter(|(i, _)| *i != place);
        let with_it: Vec<(Parameter, f64, f64)> = others.filter_map(moved).collect();
        let symbols = with_it.iter().map(|(parameter, value, error)| {
            format!("{} = {}", parameter.symbol(), with_error(*value, *error))
        });
        let percent = |part: f64, error: f64| with_error(100.0 * part, 100.0 * error);
        let stated = if self.object.is_some_and(|object| object.mass_sd.is_some()) {
            format!("the stated masses ({} ± {})", plain(mean, 4), plain(sd, 2))
        } else {
            format!(
                "the equal masses (± {} %) that are assumed where they are not stated",
                plain(100.0 * sd, 2)
            )
        };
        let sentence = format!(
            "The shots show a cue ball {} % {} than the object ball, {:.1} standard deviations from {stated}. With the shots alone {}. \
             Weigh both; mass_kg under [ball] and [object] takes it.",
            percent((estimate - 1.0).abs(), error),
            if estimate > 1.0 { "heavier" } else { "lighter" },
            deviation.abs(),
            symbols.collect::<Vec<_>>().join(", ")
        );
        Some(Explanation {
            cause: Cause::MassRatio,
            estimate,
            std_error: error,
            delta_2logl: -deviation.powi(2),
            adopted: false,
            with_it,
            reduced_chi2: None,
            sentence,
        })
    }
}
