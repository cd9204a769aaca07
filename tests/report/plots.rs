//! The residual plots: drawn for every fit, readable, and saying what they leave out.

use std::collections::HashSet;

use caromfit::report;

use super::fits::{NAN, empty, exact, normal, restricted, synthetic};

use crate::prelude::*;

/// A file of the report of a fit.
fn written(fit: &Fit, name: &str) -> Vec<u8> {
    let out = tempfile::tempdir().unwrap();
    report::write(std::slice::from_ref(fit), out.path()).unwrap();
    let folder = out.path().join(&fit.dataset);
    let label = fit.group.as_ref().map_or(String::new(), |(_, label)| report::folder_name(label));
    fs::read(folder.join(label).join(name)).unwrap()
}

/// The SVG of a fit, all of whose texts end.
fn svg(fit: &Fit) -> String {
    let svg = String::from_utf8(written(fit, "residuals.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
    svg
}

/// Width, height and the colours of the pixels.
fn decoded(png: &[u8]) -> (u32, u32, HashSet<[u8; 3]>) {
    let mut reader = png::Decoder::new(png).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width, info.height, pixels.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect())
}

#[test]
fn every_kind_of_fit_is_drawn() {
    let mut odd = synthetic("odd", &[Observable::Throw, Observable::ObjectSpeed], 30, 6);
    odd.residuals[0].measured = 1e300;
    odd.residuals[1].standardized = -3e6;
    odd.residuals[2].predicted = f64::INFINITY;
    odd.residuals[3].sd = 1e20;
    odd.residuals[4].cut = NAN;
    let mut equal = synthetic("equal", &[Observable::Throw], 20, 7);
    for residual in &mut equal.residuals {
        residual.measured = residual.predicted;
        residual.standardized = 0.0;
        (residual.cut, residual.speed) = (0.5, Some(2.0));
    }
    for fit in [normal(), restricted(), exact(), empty(), odd, equal] {
        svg(&fit);
        let (width, height, colors) = decoded(&written(&fit, "residuals.png"));
        // as many rows as there are panels with data
        assert!(width == 1200 && (90..1400).contains(&height), "{width} × {height}");
        // Text alone has some dozen shades of grey.
        assert!(colors.len() > 20, "{} has {} colours", fit.dataset, colors.len());
    }
}

/// Quantities of different units have their own axes.
#[test]
fn axes_carry_names_and_units() {
    let velocities =
        Axis::ALL.map(|axis| [Observable::CueVelocity(axis), Observable::ObjectSpin(axis)]).concat();
    for (fit, texts) in [
        (
            normal(),
            &[
                "cut angle φ (°)",
                "cue-ball speed before impact (m/s)",
                "(measured − predicted) / sd",
                "quantile of the normal distribution",
                "throw (10)",
                "μ = 0.1014 ± 0.0027,   μ_s = 0.310 ± 0.046,   e = 0.9412 ± 0.0039",
                "model full,   10 shots,   χ²/dof of the angles and speeds = 1.00 (χ² = 7, 7 dof)",
                "font-family=\"DejaVu Sans, Verdana, Arial, sans-serif\"",
            ][..],
        ),
        (synthetic("impacts", &velocities, 20, 1), &["cue-ball vz (20)", "object-ball ωx (20)"]),
    ] {
        let svg = svg(&fit);
        assert!(texts.iter().all(|text| svg.contains(text)), "{texts:?}");
    }
}
