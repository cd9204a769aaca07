//! The cloth's bounce as an unknown of a joint fit, on request.

use caromfit::fit;
use caromfit::fit::{Depth, FilmUnknowns, Options, SharedKind};
use caromfit::simulate;
use caromfit::simulate::{ClothSpec, Kind, Played, Spec};

use crate::extraction::dataset;
use crate::options;
use crate::synthetic::spec;

/// Standard errors by which a value may be off.
const ERRORS: f64 = 3.5;

/// The prior, 0.5 ± 0.2, does not tell it as surely.
const TOLD: f64 = 0.15;

/// By how much such an interval may be wider or narrower.
const PARABOLA: f64 = 0.15;

#[test]
fn the_bounce_is_estimated_where_it_is_asked_for() {
    const BOUNCE: f64 = 0.25;
    let usual = spec(Kind::Tracks, &[Played::Stun, Played::NaturalRoll], 40, 61);
    let spec = Spec { cloth: ClothSpec { bounce: BOUNCE, ..usual.cloth }, ..usual };
    let film = || simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect();
    let with = |bounce| {
        let film_unknowns = FilmUnknowns { bounce, ..FilmUnknowns::default() };
        let options = Options { film: film_unknowns, depth: Depth::Intervals, ..options::of_fit() };
        fit::analyse(&dataset(film()), &options).fits.unwrap().remove(0)
    };
    let fit = with(true);
    let found = *fit.diagnostics.joint.as_ref().unwrap().get(SharedKind::Bounce).unwrap();
    assert!((found.value - BOUNCE).abs() < ERRORS * found.std_error, "{found:?}");
    assert!(found.std_error < TOLD, "{found:?}");
    // an interval of 1.96 errors to either side, as far as χ² is a parabola
    for kind in [SharedKind::Sliding, SharedKind::Rolling] {
        let of = *fit.diagnostics.joint.as_ref().unwrap().get(kind).unwrap();
        let [low, high] = of.interval_95.unwrap();
        let half = 0.5 * (high - low) / (1.96 * of.std_error);
        assert!(low < of.value && of.value < high && (half - 1.0).abs() < PARABOLA, "{of:?}");
    }
    // that of the bounce ends at none, and bends
    let [low, high] = found.interval_95.unwrap();
    assert!(low < BOUNCE && BOUNCE < high, "{found:?}");
    let json = serde_json::to_value(&fit).unwrap();
    assert!(json["joint"]["bounce"]["std_error"].as_f64().unwrap() > 0.0);
    assert!(fit.notes.iter().any(|note| note.contains("its bounce e_t = 0.")), "{:?}", fit.notes);
    let without = with(false);
    assert!(without.diagnostics.joint.unwrap().get(SharedKind::Bounce).is_none());
}
