//! Motion of the case from its reference, with the reference's known errors corrected.

use nalgebra::Vector3;
use rlg_catalogue::signals::AXES;
use rlg_diagnosis::alignment::case_motion::Motion;
use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_model::{Model, ModelEffect};
use rlg_plan::{ForcePlan, GatePlan};
use rlg_signal::axes::{Triad, each_axis};
use rlg_signal::derivatives::Spectrum;
use rlg_signal::shrinkage::{Powers, shrink};

/// Noise of the reference's increments about each axis \[rad² per row\].
pub type ReferenceNoise = [NoiseLevels; 3];

/// Noise of the reference as estimated in the gyros' search.
pub fn measured_noise(motion: &Motion) -> ReferenceNoise {
    each_axis(|axis| NoiseLevels {
        white: motion.reference_walk[axis].value,
        angle: motion.reference_angle[axis].value,
        ..NoiseLevels::default()
    })
}

/// Noise from an angle random walk and white angle noise about each axis \[rad² per row\].
pub fn noise_of(levels_rad2: [[f64; 2]; 3]) -> ReferenceNoise {
    levels_rad2.map(|[white, angle]| NoiseLevels {
        white,
        angle,
        ..NoiseLevels::default()
    })
}

/// Noise of a motion measured by the gyros themselves: angle random walk `walk_rad_sqrt_s`, and pulse quantisation.
pub fn gyro_noise(model: &Model, walk_rad_sqrt_s: [f64; 3], rate_hz: f64) -> ReferenceNoise {
    each_axis(|axis| NoiseLevels {
        white: walk_rad_sqrt_s[axis].powi(2) / rate_hz,
        angle: model.gyro_white_rad2(axis),
        ..NoiseLevels::default()
    })
}

/// Motion of the case on the gyros' rows.
pub struct Reference {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Increments including noise \[rad\], for the attitude.
    pub case_rad: Triad,
    /// Increments where they exceed their noise \[rad\], for the lever-arm terms.
    pub moving_rad: Triad,
    /// Highest frequency of the case's motion \[Hz\].
    pub edge_hz: f64,
}

impl Reference {
    /// Corrects the reference errors among `effects`, and separates motion from noise.
    ///
    /// # Inputs
    /// `read_rad`: increments of the reference, plus the correction of its noise from the gyros.
    pub fn new(
        read_rad: &Triad,
        rate_hz: f64,
        effects: &[ModelEffect],
        noise: &ReferenceNoise,
        (gate, plan): (&GatePlan, &ForcePlan),
    ) -> Self {
        let mut case_rad = read_rad.clone();
        for effect in effects {
            undo(&mut case_rad, effect, rate_hz);
        }
        let rows = case_rad[0].len();
        let seen = vec![true; rows];
        let basis = NoiseBasis::new(&Observations::separate(&seen, 1));
        let moving_rad: Triad = each_axis(|axis| {
            let power = basis.by_coefficient(noise[axis]);
            let (none, all) = (vec![0.0; rows], vec![1.0; rows]);
            let powers = Powers {
                left: &power,
                expected: &power,
                before: &none,
                uncertain: &none,
                residual: &all,
            };
            shrink(&case_rad[axis], &powers, &seen, rate_hz, gate).values
        });
        Self {
            edge_hz: edge_hz(&moving_rad, rate_hz, plan),
            rate_hz,
            case_rad,
            moving_rad,
        }
    }
}

/// Frequency above which the motion has a negligible share of its power \[Hz\].
fn edge_hz(moving_rad: &Triad, rate_hz: f64, plan: &ForcePlan) -> f64 {
    let rows = moving_rad[0].len();
    let dct = Dct::new(rows);
    let mut power = vec![0.0; rows];
    for values in moving_rad {
        let mut spectrum = values.clone();
        dct.forward(&mut spectrum);
        for (sum, value) in power.iter_mut().zip(&spectrum) {
            *sum += value * value;
        }
    }
    let total: f64 = power.iter().sum();
    let mut beyond = 0.0;
    let last = (0..rows).rev().find(|&k| {
        beyond += power[k];
        beyond > plan.beyond_edge * total
    });
    0.5 * rate_hz * last.unwrap_or(0) as f64 / rows as f64
}

/// Corrects one error of the reference in its increments (contract: `reference_scale` measures (1 + r_i) times,
/// `reference_misalignment` measures ω − r × ω, `reference_delay` is d late, `reference_harmonic` adds waves of its own
/// angle).
fn undo(case_rad: &mut Triad, effect: &ModelEffect, rate_hz: f64) {
    let sizes = Vector3::from_fn(|axis, _| effect.number(AXES[axis]));
    match effect.kind.as_str() {
        "reference_delay" => {
            for values in case_rad {
                *values = Spectrum::new(values, rate_hz).delayed(-effect.number("all"));
            }
        }
        "reference_scale" => {
            for (values, scale) in case_rad.iter_mut().zip(sizes.iter()) {
                values.iter_mut().for_each(|value| *value /= 1.0 + scale);
            }
        }
        "reference_misalignment" => {
            for row in 0..case_rad[0].len() {
                let read = Vector3::from_fn(|axis, _| case_rad[axis][row]);
                let case = read + sizes.cross(&read);
                (0..3).for_each(|axis| case_rad[axis][row] = case[axis]);
            }
        }
        "reference_harmonic" => {
            let about = effect.text("axis");
            if let Some(axis) = AXES.iter().position(|axis| about == Some(axis)) {
                undo_wave(&mut case_rad[axis], effect);
            }
        }
        _ => {}
    }
}

/// Subtracts a harmonic of the reference's own angle from its increments.
fn undo_wave(values: &mut [f64], effect: &ModelEffect) {
    let order = effect.number("order");
    let wave = |angle_rad: f64| {
        let (sin, cos) = (order * angle_rad).sin_cos();
        effect.number("cos") * cos + effect.number("sin") * sin
    };
    let mut angle_rad = 0.0;
    for value in values {
        let before = wave(angle_rad);
        angle_rad += *value;
        *value -= wave(angle_rad) - before;
    }
}

#[cfg(test)]
mod tests {
    use rlg_plan::{ForcePlan, GatePlan};
    use std::collections::BTreeMap;

    use rlg_inference::NoiseLevels;
    use rlg_model::{EffectValue, ModelEffect};
    use rlg_signal::axes::{Triad, each_axis};

    use super::Reference;

    #[test]
    fn a_turned_reference_is_turned_back_to_the_second_order() {
        let rows = 600;
        let case: Triad = each_axis(|axis| {
            let phase = axis as f64;
            (0..rows)
                .map(|row| 1e-3 * (0.05 * row as f64 + phase).sin())
                .collect()
        });
        let turn = nalgebra::Vector3::new(1e-3, -2e-3, 3e-3);
        let mut read = case.clone();
        for row in 0..rows {
            let now = nalgebra::Vector3::from_fn(|axis, _| case[axis][row]);
            let turned = now - turn.cross(&now);
            (0..3).for_each(|axis| read[axis][row] = turned[axis]);
        }
        let number = |name: &str, value: f64| (name.to_string(), EffectValue::Number(value));
        let effect = ModelEffect {
            kind: "reference_misalignment".to_string(),
            parameters: BTreeMap::from([
                number("x", turn.x),
                number("y", turn.y),
                number("z", turn.z),
            ]),
        };
        let noise = [NoiseLevels {
            white: 1e-20,
            ..NoiseLevels::default()
        }; 3];
        let plan = (&GatePlan::default(), &ForcePlan::default());
        let reference = Reference::new(&read, 100.0, &[effect], &noise, plan);
        for (found, case) in reference.case_rad.iter().zip(&case) {
            for (found, case) in found.iter().zip(case) {
                let off = found - case;
                assert!(off.abs() < 2.0 * turn.norm_squared() * 1e-3, "{off:e}");
            }
        }
    }
}
