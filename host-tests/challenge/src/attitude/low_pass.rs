//! Gyros with a single-pole low-pass filter: τ ẏ + y = θ, integrated at three Gauss–Legendre nodes a row.

use crate::marks::case::Case;
use crate::marks::effects::GAUSS;
use crate::marks::motion::Derivative;

/// Number of time constants of the filter's run-in before the first row: e⁻⁴⁰ is below the rounding of the angle.
const BEFORE: f64 = 40.0;

/// Returns the change of a case's increments by a filter with the time constant `pole_s`, x y z \[rad by row\].
pub fn added_rad(case: &Case, pole_s: f64) -> [Vec<f64>; 3] {
    let period_s = case.period_s;
    let before = (BEFORE * pole_s / period_s).ceil() as usize;
    let start_s = -(before as f64) * period_s;
    let rows = before + case.rows;
    let keep = (-period_s / pole_s).exp();
    std::array::from_fn(|axis| {
        let angle = |from_s, count| {
            let motion = &case.motion;
            motion.series(Derivative::Angle, axis, from_s, period_s, count)
        };
        let at_nodes = GAUSS.map(|(node, _)| angle(start_s + node * period_s, rows));
        let mut read = angle(start_s, 1)[0];
        let mut filtered = vec![read];
        for row in 0..rows {
            read *= keep;
            for ((node, weight), angles) in GAUSS.iter().zip(&at_nodes) {
                let fades = (-(1.0 - node) * period_s / pole_s).exp();
                read += weight * period_s / pole_s * fades * angles[row];
            }
            filtered.push(read);
        }
        let increments = filtered[before..].windows(2).map(|pair| pair[1] - pair[0]);
        increments
            .zip(&case.increments_rad[axis])
            .map(|(filtered, whole)| filtered - whole)
            .collect()
    })
}
