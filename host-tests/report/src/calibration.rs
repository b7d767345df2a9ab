//! Page `report.html` of a calibration: estimates of each gyro's two coefficients, drawn as ellipses.
//!
//! One HTML file without scripts, with K in 1e-8 s².
//!
//! Each ellipse is a 95 % confidence region of a pair K_ij, K_ik: thin for each recording, thick for all together. Coning
//! alone gives a band along which the difference is free; a spin-synchronous run closes it.

use maud::{Markup, html};
use plotters::prelude::*;

use super::plot::{AFTER, Axes, BEFORE, FINE, builder, frame, plot};
use super::words::number;
use rlg_calibration::result::{Calibration, NAMES};
use rlg_findings::result::ParameterEntry;
use rlg_recording::AXES;

/// Height of a plot \[page pixels\].
const HEIGHT: u32 = 320;

/// √χ²: radius of the 95 % region of a two-dimensional normal distribution.
const WITHIN_95: f64 = 2.448;

/// Half the width of a plot in K \[1e-8 s²\]: real blocks are well inside.
const SHOWN_E8: f64 = 15.0;

/// Complete page.
pub fn page(calibration: &Calibration) -> String {
    let main = html! {
            header {
                p.kicker { "Flexure of the dither suspensions" }
                h1 { "Calibration of K" }
            }
            section {
                h2 { "Result" }
                @for line in &calibration.summary { p { (line) } }
            }
            section {
                h2 { "Estimates of each gyro" }
                p {
                    "95 % ellipses of its two coefficients, in 10" sup { "−8" } " s²: blue for all
                    recordings together, orange for each alone. A band means that only the sum is known."
                }
                @for gyro in 0..3 { (ellipses(calibration, gyro)) }
            }
            section {
                h2 { "Everything" }
                pre { (serde_json::to_string_pretty(calibration).unwrap_or_default()) }
            }
    };
    super::document("Calibration of flexure", &main)
}

fn ellipses(calibration: &Calibration, gyro: usize) -> Markup {
    let (a, b) = (2 * gyro, 2 * gyro + 1);
    let Some(effect) = calibration.effects.first() else {
        return html! {};
    };
    let value = |k: usize| match effect.parameters.get(k) {
        Some(ParameterEntry::Number { value, .. }) => value * 1e8,
        _ => 0.0,
    };
    let centre = (value(a), value(b));
    let label = format!("Ellipses of the two coefficients of gyro {}", AXES[gyro]);
    plot(&label, HEIGHT, |area| {
        let x = centre.0 - SHOWN_E8..centre.0 + SHOWN_E8;
        let y = centre.1 - SHOWN_E8..centre.1 + SHOWN_E8;
        let mut chart = builder(area).build_cartesian_2d(x.clone(), y.clone())?;
        let (x_title, y_title) = (
            format!("K_{} [1e-8 s²]", NAMES[a]),
            format!("K_{} [1e-8 s²]", NAMES[b]),
        );
        let axes = Axes {
            x_title: &x_title,
            y_title: &y_title,
            x_number: &|k| number(*k),
            y_number: &|k| number(*k),
            y_count: 6,
        };
        frame(&mut chart, &axes)?;
        let block = |covariance: &[Vec<f64>]| {
            [covariance[a][a], covariance[a][b], covariance[b][b]].map(|v| v * 1e16)
        };
        let inside = |points: Vec<(f64, f64)>| {
            // Outside the frame the line is clamped to its edge.
            points
                .into_iter()
                .map(|(px, py)| (px.clamp(x.start, x.end), py.clamp(y.start, y.end)))
        };
        for recording in &calibration.recordings {
            let line = inside(ellipse(centre, block(&recording.covariance)));
            chart.draw_series(LineSeries::new(line, BEFORE.stroke_width(FINE)))?;
        }
        let line = inside(ellipse(centre, block(&effect.covariance)));
        chart.draw_series(LineSeries::new(line, AFTER.stroke_width(2 * FINE)))?;
        Ok(())
    })
}

/// Points on the 95 % ellipse of a covariance (aa, ab, bb).
fn ellipse(centre: (f64, f64), [aa, ab, bb]: [f64; 3]) -> Vec<(f64, f64)> {
    // The lower Cholesky factor of the covariance maps a circle to the ellipse.
    let l11 = aa.max(0.0).sqrt();
    let l21 = if l11 > 0.0 { ab / l11 } else { 0.0 };
    let l22 = (bb - l21 * l21).max(0.0).sqrt();
    (0..=180)
        .map(|step| {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 180.0).sin_cos();
            (
                centre.0 + WITHIN_95 * l11 * cos,
                centre.1 + WITHIN_95 * (l21 * cos + l22 * sin),
            )
        })
        .collect()
}
