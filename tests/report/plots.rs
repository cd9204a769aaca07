//! The residual plots: drawn for every fit, readable, and saying what they leave out.

use std::collections::HashSet;

use caromfit::measurement::dataset::Measurement;
use caromfit::report;

use super::{exact, fitted, lab, normal, restricted, robust};

use crate::prelude::*;

/// A file of the report of a fit.
fn written(fit: &Fit, name: &str) -> Vec<u8> {
    let out = tempfile::tempdir().unwrap();
    report::write(std::slice::from_ref(fit), out.path()).unwrap();
    let label = part(fit, "/group/label").as_str().map_or(String::new(), report::folder_name);
    let folder = out.path().join(part(fit, "/dataset").as_str().unwrap());
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
    let mut odd = lab("natural-roll", 0.05, 6);
    for (shot, by) in odd.shots.iter_mut().zip([1e20, 1e-6, 1e6]) {
        shot.after[0].measured.sd = shot.after[0].measured.sd.map(|sd| by * sd);
    }
    odd.shots[3].after[2].measured.value = 1e6;
    // all residuals are 0, all cuts and speeds the same
    let keys = format!("shots = {{ cut_deg = [30, 30], speed_m_s = [2, 2] }}\n{EXACT}");
    let equal = made(&with(&spec("angles", &["natural-roll"], 20, 7), &keys));
    for fit in [normal(), restricted(), exact(), robust(), fitted(&odd), fitted(&equal)] {
        svg(&fit);
        let (width, height, colors) = decoded(&written(&fit, "residuals.png"));
        // as many rows as there are panels with data
        assert!(width == 1200 && (90..1400).contains(&height), "{width} × {height}");
        // Text alone has some dozen shades of grey.
        assert!(colors.len() > 20, "{} has {} colours", part(&fit, "/dataset"), colors.len());
    }
}

/// Quantities of different units have their own axes.
#[test]
fn axes_carry_names_and_units() {
    let mut spins = made(&spec("impacts", &["natural-roll"], 20, 1));
    for shot in &mut spins.shots {
        for observable in [Observable::CueVelocity(Axis::Z), Observable::ObjectSpin(Axis::X)] {
            shot.after.push(Measurement { observable, measured: Measured::new(0.0, 1e3) });
        }
    }
    for (fit, texts) in [
        (
            normal(),
            &[
                "cut angle φ (°)",
                "cue-ball speed before impact (m/s)",
                "(measured − predicted) / sd",
                "quantile of the normal distribution",
                "throw (10)",
                "μ = 0.0",
                ",   e = 0.9",
                "model full",
                ",   10 shots,   χ²/dof of the angles and speeds = ",
                "font-family=\"DejaVu Sans, Verdana, Arial, sans-serif\"",
            ][..],
        ),
        (fitted(&spins), &["cue-ball vz (20)", "object-ball ωx (20)"]),
    ] {
        let svg = svg(&fit);
        for text in texts {
            assert!(svg.contains(text), "{text}");
        }
    }
}
