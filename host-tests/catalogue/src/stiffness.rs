//! Largest flexure of a block that follows the motion quasi-statically, as a spring without inertia.
//!
//! K = J/k is 1/Ω0²: a block of flexure K resonates at f0 = 1/(2π√K). The static law holds only below f0. If half the
//! power of the angular acceleration lies at or above the f0 implied by an estimate of K, most of the motion would
//! excite the resonance, and the estimate is due to another effect: mostly a low pass, which with an attitude reference
//! is like K = v/2.

use std::f64::consts::TAU;

use rlg_inference::Bound;

use crate::resonance::Resonance;
use crate::signals::Signals;

/// Kinds of static flexure: linear and cubic in the angular acceleration.
const STATIC: &str = "axis_flexure";
const CUBIC: &str = "axis_flexure_cubic";

/// Largest K about each axis \[s²\]; infinite without motion.
fn largest_s2(signals: &Signals) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let median_hz = signals.independent.spectrum(axis).median_hz(1);
        (TAU * median_hz).powi(-2)
    })
}

/// Largest values of a kind about each axis; `None` for kinds other than static flexure.
pub(crate) fn largest(kind: &str, signals: &Signals) -> Option<[f64; 3]> {
    match kind {
        STATIC => Some(largest_s2(signals)),
        // A sine of amplitude A, mean square A²/2, makes a spring of Q α³ equivalent to one of K = (3/4) Q A².
        CUBIC => Some(std::array::from_fn(|axis| {
            let acceleration = signals.independent.acceleration_rad_s2(axis);
            let squares: f64 = acceleration.iter().map(|one| one * one).sum();
            let mean_square = squares / acceleration.len() as f64;
            largest_s2(signals)[axis] / (1.5 * mean_square)
        })),
        _ => None,
    }
}

/// Restricts the bound of a parameter ij of a kind to the largest value about axis j, if there is one.
pub(crate) fn within(bound: Bound, name: &str, largest: Option<[f64; 3]>) -> Bound {
    let about = name.chars().nth(1).and_then(|axis| "xyz".find(axis));
    let most = largest.zip(about).map(|(largest, about)| largest[about]);
    match most {
        Some(most) if most.is_finite() => Bound {
            range: [bound.range[0].max(-most), bound.range[1].min(most)],
            ..bound
        },
        _ => bound,
    }
}

/// Largest flexures of a suspension whose resonance is known: those of a block that resonates there, or of a stiffer
/// block that the motion cannot distinguish from a static one.
pub(crate) fn largest_of_mode(resonance: Resonance, signals: &Signals) -> [f64; 3] {
    let own = (TAU * resonance.hz).powi(-2);
    largest_s2(signals).map(|most| most.max(own))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Matrix3;
    use rlg_inference::Bound;
    use rlg_plan::CataloguePlan;

    use super::{largest, within};
    use crate::signals::{Inputs, Signals};

    /// Signals of a case that oscillates about x at a frequency and about y and z at half of it.
    fn signals(hz: f64) -> Signals {
        const RATE_HZ: f64 = 1000.0;
        let sine = |hz: f64| -> Vec<f64> {
            let rows = 0..8000;
            rows.map(|row| 1e-4 * (TAU * hz * f64::from(row) / RATE_HZ).sin())
                .collect()
        };
        let case = [sine(hz), sine(0.5 * hz), sine(0.5 * hz)];
        let inputs = Inputs::default();
        let (still, plan) = ((case, None), CataloguePlan::default());
        let axes = Matrix3::identity();
        Signals::of_known(still, inputs, RATE_HZ, [0.0; 3], axes, &plan)
    }

    #[test]
    fn a_flexure_may_not_ring_within_the_motion() {
        let signals = signals(20.0);
        let most = largest("axis_flexure", &signals).expect("of a flexure");
        for (most, hz) in most.into_iter().zip([20.0, 10.0, 10.0]) {
            let rings_hz = 1.0 / (TAU * most.sqrt());
            assert!((rings_hz / hz - 1.0).abs() < 0.05, "{rings_hz}, {hz}");
        }
        let of_yx = within(Bound::NONE, "yx", Some(most));
        assert!(of_yx.excludes(1.1 * most[0], 0.0, 3.0));
        assert!(!of_yx.excludes(0.9 * most[0], 0.0, 3.0));
        assert_eq!(within(Bound::NONE, "yx", None), Bound::NONE);
        assert!(largest("elastic_rate_by_jerk", &signals).is_none());
    }

    #[test]
    fn of_the_cube_the_spring_that_a_sine_finds_counts() {
        let signals = signals(20.0);
        let linear = largest("axis_flexure", &signals).expect("of a flexure");
        let cubic = largest("axis_flexure_cubic", &signals).expect("of a flexure");
        // 1e-4 rad a row at 1 kHz is 0.1 rad/s.
        let amplitude = 0.1 * TAU * 20.0;
        let as_linear = 0.75 * cubic[0] * amplitude.powi(2);
        assert!((as_linear / linear[0] - 1.0).abs() < 0.02);
    }
}
