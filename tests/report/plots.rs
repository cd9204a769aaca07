//! The residual plots: drawn for every fit, readable, and saying what they leave out.

use std::collections::HashSet;

use caromfit::report;

use super::fits::{NAN, empty, exact, normal, restricted, synthetic};

use crate::prelude::*;

/// The SVG of a fit, whose tags were seen to be well-formed.
fn svg(fit: &Fit) -> String {
    let svg = report::residuals(fit).svg().unwrap();
    let mut open = Vec::new();
    for part in svg.split('<').skip(1) {
        let (tag, text) = part.split_once('>').expect("a tag ends");
        assert_eq!(tag.matches('"').count() % 2, 0, "quotes of <{tag}>");
        let name = tag.split_whitespace().next().unwrap();
        if let Some(closed) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "<{tag}> closes what was opened last");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        for entity in text.split('&').skip(1) {
            assert!(
                ["lt;", "gt;", "amp;", "quot;", "apos;"].iter().any(|e| entity.starts_with(e)),
                "&{entity}"
            );
        }
        assert!(!text.chars().any(|c| c.is_control() && c != '\n'), "control character in {text:?}");
    }
    assert!(open.is_empty() && svg.starts_with("<svg "));
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
        let (width, height, colors) = decoded(&report::residuals(&fit).png().unwrap());
        // as many rows as there are panels with data
        assert!(width == report::WIDTH && (90..1400).contains(&height), "{width} × {height}");
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
                "model full,   10 shots,   χ²/dof = 1.00 (χ² = 7, 7 dof)",
                "font-family=\"DejaVu Sans, Verdana, Arial, sans-serif\"",
            ][..],
        ),
        (synthetic("impacts", &velocities, 20, 1), &["cue-ball vz (20)", "object-ball ωx (20)"]),
    ] {
        let svg = svg(&fit);
        assert!(texts.iter().all(|text| svg.contains(text)), "{texts:?}");
    }
}

#[test]
fn what_is_left_out_is_said() {
    let mut fit = synthetic("gaps", &[Observable::Throw], 30, 2);
    for residual in &mut fit.residuals[..3] {
        (residual.sd, residual.standardized) = (NAN, NAN);
    }
    fit.residuals[3].speed = None;
    let text = svg(&fit);
    assert!(text.contains("band: ±2 sd; 3 points left out: no sd; 1 point left out: no speed"));
    for residual in &mut fit.residuals {
        residual.speed = None;
    }
    assert!(svg(&fit).contains("The speed is not known for any observation."));
    assert!(svg(&exact()).contains("No standard deviations:"));
    assert!(svg(&restricted()).contains("μ_s is not identified: no shot has follow or draw."));
}

#[test]
fn many_points_are_thinned_out() {
    let mut fit = synthetic("many", &[Observable::Throw, Observable::Separation], 5000, 3);
    // An outlier is drawn wherever it stands.
    fit.residuals[7777].standardized = 50.0;
    let text = svg(&fit);
    assert!(text.contains("2100 of 10000 points drawn, outliers kept"), "outliers");
    assert!(text.len() < 2_000_000, "{} bytes", text.len());
    assert!(report::residuals(&fit).png().unwrap().len() < 1_000_000);
}

#[test]
fn names_are_shortened_and_escaped() {
    let mut fit = normal();
    fit.dataset = format!("a<b & \"c\"\u{1} {}", "very long ".repeat(1000));
    let svg = svg(&fit);
    assert!(svg.contains("a&lt;b &amp; &quot;c&quot;  very long"));
    assert!(svg.contains("long…") || svg.contains("…\n"));
    assert!(svg.len() < 100_000);
}
