//! Accelerometer effects on velocity increments: the contract's equations on closed-form motion.

use nalgebra::Vector3;

use super::felt::{Felt, at_arm_m_s};
use crate::marks::effects::{AXES, Effect};
use crate::marks::motion::Motion;

/// Returns an effect's contribution to the accelerometer increments, before 1/(1 − s_i) \[m/s by row\], x y z.
pub fn added_m_s(
    effect: &Effect,
    (motion, felt): (&Motion, &Felt),
    span: (usize, f64),
) -> [Vec<f64>; 3] {
    let (rows, period_s) = span;
    let felt_m_s = |axis: usize| felt.increments_m_s(axis, 0.0, span);
    std::array::from_fn(|axis| {
        let own = effect.value(AXES[axis]);
        let scaled = |values: Vec<f64>| values.into_iter().map(|value| own * value).collect();
        match effect.kind {
            "accel_bias" => vec![own * period_s; rows],
            "accel_scale" => scaled(felt_m_s(axis)),
            "accel_quadratic" => scaled(felt.of_force(axis, span, |f| f * f)),
            "accel_delay" => {
                let late = felt.increments_m_s(axis, own, span);
                let pairs = late.iter().zip(felt_m_s(axis));
                pairs.map(|(late, now)| late - now).collect()
            }
            "accel_misalignment" => {
                // i, j, k cyclic: + δ_ik f_j − δ_ij f_k
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                let tilt = |about: usize| effect.value(&[AXES[axis], AXES[about]].concat());
                let pairs = felt_m_s(j).into_iter().zip(felt_m_s(k));
                pairs
                    .map(|(along_j, along_k)| tilt(k) * along_j - tilt(j) * along_k)
                    .collect()
            }
            "size_effect" => {
                let along = |j: usize| effect.value(&[AXES[axis], AXES[j]].concat());
                let arm_m = Vector3::from_fn(|j, _| along(j));
                at_arm_m_s(motion, axis, &arm_m, span)
            }
            _ => vec![0.0; rows],
        }
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::force::felt::Level;
    use crate::marks::motion::Term;

    /// At the pole, a rotation about the vertical leaves gravity fixed: z down, so that f = (0, 0, −10).
    #[test]
    fn tilts_scale_and_square_have_the_signs_of_the_contract() {
        let span = (200, 0.01);
        let mut motion = Motion::default();
        motion.terms[2].push(Term::Spin { rate_rad_s: 0.5 });
        let level = Level {
            up: -Vector3::z(),
            north: Vector3::x(),
            latitude_rad: std::f64::consts::FRAC_PI_2,
            gravity_m_s2: 10.0,
        };
        let felt = Felt::new(&motion, &level, span);
        let added = |kind: &'static str, name: &str| {
            let effect = Effect {
                kind,
                axis: None,
                values: BTreeMap::from([(name.to_owned(), 1e-2)]),
            };
            let rows = added_m_s(&effect, (&motion, &felt), span);
            rows.map(|values| values[100] / span.1)
        };
        let expected = [
            // x: + δ_xz f_y − δ_xy f_z; y: + δ_yx f_z − δ_yz f_x
            ("accel_misalignment", "xy", [0.1, 0.0, 0.0]),
            ("accel_misalignment", "yx", [0.0, -0.1, 0.0]),
            ("accel_misalignment", "zx", [0.0; 3]),
            ("accel_bias", "y", [0.0, 1e-2, 0.0]),
            ("accel_scale", "z", [0.0, 0.0, -0.1]),
            ("accel_quadratic", "z", [0.0, 0.0, 1.0]),
            ("accel_delay", "z", [0.0; 3]),
            // ω × (ω × r) = −ω² r across the axis
            ("size_effect", "xx", [-2.5e-3, 0.0, 0.0]),
            ("size_effect", "zz", [0.0; 3]),
        ];
        for (kind, name, values) in expected {
            for (axis, value) in added(kind, name).into_iter().enumerate() {
                let off = value - values[axis];
                assert!(off.abs() < 1e-9, "{kind} {name} on {axis}: {value}");
            }
        }
    }
}
