//! What the documentation says of columns of data: signs of angles.

use crate::prelude::*;

const COEFFICIENTS: Coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };

/// Two roundings of angles.
const ROUNDING: f64 = 1e-12;

/// The only shot of a data set of kind `angles` with one row of zeros as observations.
fn predicted(cut_deg: f64) -> Vec<(Observable, f64)> {
    let folder = tempfile::tempdir().unwrap();
    let manifest =
        "name = \"signs\"\nkind = \"angles\"\nfiles = [\"a.csv\"]\n[cue_spin]\nassume = \"natural-roll\"\n";
    fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    let columns = "cut_deg,speed_m_s,throw_deg,cue_turn_deg,cue_turn_rolling_deg,object_angle_rolling_deg";
    fs::write(folder.path().join("a.csv"), format!("{columns}\n{cut_deg},2,0,0,0,0\n")).unwrap();
    let dataset = io::load(folder.path()).unwrap();
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let predicted = predict(&dataset.shots[0], &model, &COEFFICIENTS).unwrap();
    predicted.observables.into_iter().zip(predicted.values).collect()
}

/// The cut angle is measured from the cue ball's path to the line of centres. `object_angle_rolling_deg` is counted like it:
/// from the cue ball's incoming path to the object ball's path once it rolls, positive on the side of the line of centres,
/// so that throw makes it smaller. `throw_deg` is counted from the line of centres, `cue_turn_deg` from the incoming path,
/// positive away from the line of centres.
#[test]
fn angles_have_the_signs_that_the_readme_says() {
    let cut = 40_f64;
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let cue = BallState::natural_roll(cue_velocity(2.0, cut.to_radians()), model.ball.radius);
    let outcome = model.collide(&cue, &COEFFICIENTS).unwrap();
    // in the collision frame the line of centres is at 0 and the cue ball comes at +40°
    let direction = |ball: &BallState| ball.velocity.y.atan2(ball.velocity.x).to_degrees();
    let rolling = |ball: &BallState| {
        let velocity = ball.velocity - 2.0 / 7.0 * cloth_slip(ball, model.ball.radius);
        velocity.y.atan2(velocity.x).to_degrees()
    };
    let expected = [
        (Observable::Throw, direction(&outcome.object)),
        (Observable::CueTurn, direction(&outcome.cue) - cut),
        (Observable::CueTurnRolling, rolling(&outcome.cue) - cut),
        (Observable::ObjectAngleRolling, cut - rolling(&outcome.object)),
    ];
    for cut in [cut, -cut] {
        for (observable, value) in predicted(cut) {
            let expected = expected.iter().find(|(known, _)| *known == observable).unwrap().1;
            assert!(
                (value.to_degrees() - expected).abs() < ROUNDING.to_degrees(),
                "{observable:?} {value} {expected}"
            );
            assert!(value > 0.0, "{observable:?} at {cut}°");
        }
    }
    // thrown towards where the cue ball goes, the object ball leaves at less than the cut angle
    let found = predicted(cut);
    let of = |observable| found.iter().find(|(known, _)| *known == observable).unwrap().1.to_degrees();
    assert!(of(Observable::ObjectAngleRolling) < cut && of(Observable::ObjectAngleRolling) > cut - 5.0);
}
