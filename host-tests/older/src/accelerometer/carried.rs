//! How the case carried its accelerometers: its attitude against the start and the forces at its lever arms.
//!
//! Enters: the case's increments on the gyros' rows \[rad\], with what the model knows to be wrong with their
//! reference undone. Leaves: [`Carried`] on the accelerometers' rows: the mean rotation matrix body-from-start,
//! ∫α dt and ∫ω_i ω_j dt.
//!
//! Attitude: from row to row by rotation vectors with the coning of a row taken from its neighbours (Savage 1998,
//! sec. 3, three points); its mean over a row by Simpson's rule. Both are good to (ΩT)⁴, so rows that are long against
//! the fastest motion are cut into parts by band-limited interpolation first: at a quarter of the row rate Simpson's
//! rule alone would leave what an arm of some micrometres looks like.
//!
//! Assumes that a reference's gap was bridged well enough: a row or two. Beyond a longer one the attitude is wrong, and
//! its rows are out of use (rows.rs). Not here: the Earth (vertical.rs).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use realfft::num_complex::Complex64;

use super::rows::Rows;
use crate::hypotheses::reference_harmonic;
use crate::motion::{Reading, Spectrum, sinc};
use crate::scene::Scene;
use crate::streams::{AXES, Triad, each_axis};
use rlg_model::ModelEffect;

/// See the page above; everything by row of the accelerometers.
pub struct Carried {
    /// Mean of body-from-start, `[body axis][start axis]`.
    pub body_from_start: [Triad; 3],
    /// ∫ω dt \[rad\].
    pub angle_rad: Triad,
    /// ∫α dt \[rad/s\].
    pub turned_rad_s: Triad,
    /// ∫ω_i ω_j dt \[rad²/s\].
    pub squared_rad2_s: [Triad; 3],
}

impl Carried {
    /// Carries the accelerometers through the motion.
    pub fn new(scene: &Scene, rows: &Rows, effects: &[ModelEffect]) -> Self {
        let case_rad = case_rad(scene, effects);
        let angle_rad = [0, 1, 2].map(|axis: usize| rows.gather(&case_rad[axis]));
        let parts = parts(scene.motion_edge_hz, scene.streams.rate_hz);
        let fine = Fine::new(case_rad, scene, parts);
        let means = mean_rotation(&fine.increments_rad, parts);
        let period_s = scene.period_s();
        let omega = &fine.rate_rad_s;
        let product = |i: usize, j: usize| -> Vec<f64> {
            let products = omega[i].iter().zip(&omega[j]);
            let products: Vec<f64> = products.map(|(a, b)| a * b * period_s).collect();
            let whole: Vec<f64> = mean_over_rows(&products)
                .chunks(parts)
                .map(|row| row.iter().sum::<f64>() / parts as f64)
                .collect();
            rows.gather(&whole)
        };
        /// Six products of two axes, and which of them is whose.
        const OF: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        const PAIRS: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];
        let squares: Vec<Vec<f64>> = OF.into_par_iter().map(|(i, j)| product(i, j)).collect();
        let share = rows.rate_hz / scene.streams.rate_hz;
        Self {
            body_from_start: [0, 1, 2].map(|body| {
                [0, 1, 2].map(|start| {
                    let mut mean = rows.gather(&means[body][start]);
                    mean.iter_mut().for_each(|value| *value *= share);
                    mean
                })
            }),
            angle_rad,
            turned_rad_s: each_axis(|axis| rows.gather(&scene.case_ahead_rad(axis, 1, 0.0))),
            squared_rad2_s: [0, 1, 2].map(|i| [0, 1, 2].map(|j| squares[PAIRS[i][j]].clone())),
        }
    }

    /// ∫(α × e_j + ω × (ω × e_j))_i dt: the velocity that accelerometer i gains a metre of arm along j.
    pub fn lever_m_s(&self, i: usize, j: usize) -> Vec<f64> {
        let squares = &self.squared_rad2_s;
        if i == j {
            // −(ω² − ω_i²): towards the axis.
            let (k, l) = ((i + 1) % 3, (i + 2) % 3);
            let across = squares[k][k].iter().zip(&squares[l][l]);
            return across.map(|(a, b)| -(a + b)).collect();
        }
        // (α × e_j)_i = ± α_k.
        let k = 3 - i - j;
        let sign = if (k + 1) % 3 == j { 1.0 } else { -1.0 };
        squares[i][j]
            .iter()
            .zip(&self.turned_rad_s[k])
            .map(|(square, turned)| square + sign * turned)
            .collect()
    }

    /// How far the body is turned at the middle of each row \[rad, body axes\] where it turns by `more` over a row beyond
    /// what it reads: ∫ start-from-body δω dt, to the first order of δω. `more` is given a row's ∫ω dt and ∫α dt.
    pub fn turned_beyond_rad(
        &self,
        more: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<Vector3<f64>> {
        let of = |triad: &Triad, row: usize| Vector3::from_fn(|axis, _| triad[axis][row]);
        let mut at_start = Vector3::zeros();
        (0..self.angle_rad[0].len())
            .map(|row| {
                let means = &self.body_from_start;
                let body_from_start = Matrix3::from_fn(|body, start| means[body][start][row]);
                let own = more(&of(&self.angle_rad, row), &of(&self.turned_rad_s, row));
                let own = body_from_start.transpose() * own;
                let middle = at_start + 0.5 * own;
                at_start += own;
                body_from_start * middle
            })
            .collect()
    }

    /// A vector that is `at_start` in the start's axes and turns there with `turning_rad_s`, in the body's.
    pub fn in_body(
        &self,
        rows: &Rows,
        at_start: Vector3<f64>,
        turning_rad_s: Vector3<f64>,
    ) -> Triad {
        let at = |row: usize| {
            let since_s = rows.middle_s(row) - rows.start_s;
            UnitQuaternion::from_scaled_axis(turning_rad_s * since_s) * at_start
        };
        let turned: Vec<Vector3<f64>> = (0..rows.count).into_par_iter().map(at).collect();
        each_axis(|axis| {
            let means = &self.body_from_start[axis];
            let rows = turned.iter().enumerate();
            rows.map(|(row, now)| {
                means[0][row] * now.x + means[1][row] * now.y + means[2][row] * now.z
            })
            .collect()
        })
    }
}

/// Parts that a row is cut into, so that the fastest motion turns by at most a sixteenth of its period in one:
/// Simpson's rule then leaves 1e-5 of it.
fn parts(motion_edge_hz: f64, rate_hz: f64) -> usize {
    const PARTS_A_PERIOD: f64 = 16.0;
    ((PARTS_A_PERIOD * motion_edge_hz / rate_hz).ceil() as usize).max(1)
}

/// The case's motion in parts of rows.
struct Fine {
    /// Turned in each part \[rad\].
    increments_rad: Triad,
    /// At each part's middle \[rad/s\].
    rate_rad_s: Triad,
}

impl Fine {
    /// Cuts rows into `parts`.
    fn new(case_rad: Triad, scene: &Scene, parts: usize) -> Self {
        if parts == 1 {
            return Self {
                increments_rad: case_rad,
                rate_rad_s: scene.rate_rad_s.clone(),
            };
        }
        let rate_hz = scene.streams.rate_hz;
        // The whole band: nothing may be lost of what the parts add up to.
        let spectra = each_axis(|axis| Spectrum::new(&case_rad[axis], rate_hz, rate_hz));
        let part_hz = rate_hz * parts as f64;
        let mean_over_part = |frequency_hz: f64| Complex64::from(sinc(frequency_hz / part_hz));
        let at_once = |_: f64| Complex64::from(1.0);
        let through =
            |spectrum: &Spectrum, response: &(dyn Fn(f64) -> Complex64 + Sync), scale: f64| {
                let each: Vec<Vec<f64>> = (0..parts)
                    .into_par_iter()
                    .map(|part| {
                        spectrum.read_through(
                            Reading {
                                derivative: 0,
                                ahead_s: (part as f64 + 0.5) / part_hz - 0.5 / rate_hz,
                                undo_row_mean: true,
                            },
                            response,
                        )
                    })
                    .collect();
                let rows = 0..each[0].len();
                rows.flat_map(|row| each.iter().map(move |part| part[row] * scale))
                    .collect::<Vec<f64>>()
            };
        let of = |response: &(dyn Fn(f64) -> Complex64 + Sync), scale: f64| {
            each_axis(|axis| through(&spectra[axis], response, scale))
        };
        Self {
            increments_rad: of(&mean_over_part, 1.0 / parts as f64),
            rate_rad_s: of(&at_once, rate_hz),
        }
    }
}

/// Means over rows of what is known at their middles, to the fourth order of the row: the mean of a curve is
/// more than its middle by a 24th of its second difference.
fn mean_over_rows(middles: &[f64]) -> Vec<f64> {
    let last = middles.len() - 1;
    (0..middles.len())
        .map(|row| {
            let (before, here) = (middles[row.saturating_sub(1)], middles[row]);
            let after = middles[(row + 1).min(last)];
            here + (before - 2.0 * here + after) / 24.0
        })
        .collect()
}

/// The case's increments: what the reference read less what the model says is wrong with it (contract:
/// `reference_scale` reads (1 + r_i) times, `reference_misalignment` reads ω − r × ω, `reference_delay` d late,
/// `reference_harmonic` waves of its own angle more).
fn case_rad(scene: &Scene, effects: &[ModelEffect]) -> Triad {
    let mut case: Triad = scene.streams.case_rad.clone();
    let xyz = |effect: &ModelEffect| Vector3::from_fn(|axis, _| effect.number(AXES[axis]));
    for effect in effects {
        match effect.kind.as_str() {
            "reference_delay" => {
                let delay_s = effect.number("all");
                for (axis, values) in case.iter_mut().enumerate() {
                    let ahead = scene.case_ahead_rad(axis, 0, delay_s);
                    let now = scene.case_ahead_rad(axis, 0, 0.0);
                    for (value, (ahead, now)) in values.iter_mut().zip(ahead.iter().zip(now)) {
                        *value += ahead - now;
                    }
                }
            }
            "reference_scale" => {
                let scale = xyz(effect);
                for (axis, values) in case.iter_mut().enumerate() {
                    values
                        .iter_mut()
                        .for_each(|value| *value /= 1.0 + scale[axis]);
                }
            }
            "reference_misalignment" => {
                let turn = xyz(effect);
                let read = case.clone();
                for (axis, values) in case.iter_mut().enumerate() {
                    // (r × ω)_i = r_j ω_k − r_k ω_j.
                    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                    for (value, (at_j, at_k)) in values.iter_mut().zip(read[j].iter().zip(&read[k]))
                    {
                        *value += turn[j] * at_k - turn[k] * at_j;
                    }
                }
            }
            reference_harmonic::KIND => {
                let order = effect.number("order") as u32;
                let axis = AXES
                    .iter()
                    .position(|axis| effect.text("axis") == Some(axis));
                for (name, cosine) in [("cos", true), ("sin", false)] {
                    let (Some(axis), size) = (axis, effect.number(name)) else {
                        continue;
                    };
                    let wave = reference_harmonic::wave(scene, axis, order, cosine);
                    let values = case[axis].iter_mut().zip(wave);
                    values.for_each(|(value, wave)| *value -= size * wave);
                }
            }
            _ => {}
        }
    }
    case
}

/// Mean of body-from-start over each row of `parts` increments, `[body axis][start axis]`.
///
/// Within a part ω is taken to be linear, α T² = (θ_{k+1} − θ_{k−1})/2: the part's middle is then reached by
/// θ_k/2 − α T²/8, and the part's rotation vector is θ_k + (θ_{k−1} × θ_k + θ_k × θ_{k+1})/24.
fn mean_rotation(case_rad: &Triad, parts: usize) -> [Triad; 3] {
    let [x, y, z] = case_rad;
    let increments: Vec<Vector3<f64>> = x
        .iter()
        .zip(y)
        .zip(z)
        .map(|((x, y), z)| Vector3::new(*x, *y, *z))
        .collect();
    let count = increments.len();
    let mut means: [Triad; 3] =
        [0, 1, 2].map(|_| [0, 1, 2].map(|_| Vec::with_capacity(count / parts)));
    let mut start_from_body = UnitQuaternion::identity();
    let matrix = |start_from_body: &UnitQuaternion<f64>| -> Matrix3<f64> {
        start_from_body.to_rotation_matrix().matrix().transpose()
    };
    let mut begin = matrix(&start_from_body);
    let mut sum = Matrix3::zeros();
    for (part, here) in increments.iter().enumerate() {
        let before = &increments[part.saturating_sub(1)];
        let after = &increments[(part + 1).min(count - 1)];
        let turn = here + (before.cross(here) + here.cross(after)) / 24.0;
        let half = 0.5 * here - (after - before) / 16.0;
        let middle = matrix(&(start_from_body * UnitQuaternion::from_scaled_axis(half)));
        start_from_body *= UnitQuaternion::from_scaled_axis(turn);
        let end = matrix(&start_from_body);
        sum += (begin + 4.0 * middle + end) / 6.0;
        begin = end;
        if (part + 1) % parts != 0 {
            continue;
        }
        let mean = std::mem::take(&mut sum) / parts as f64;
        for (body, triad) in means.iter_mut().enumerate() {
            for (start, values) in triad.iter_mut().enumerate() {
                values.push(mean[(body, start)]);
            }
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_attitude_follows_coning_to_the_fourth_order_of_a_row() {
        // Attitude of coning: about a level axis that turns at Ω, by the angle A; ω from its closed form.
        let (rate_hz, angle, turning) = (4000.0, 6.4e-3_f64, TAU * 15.0);
        let attitude = |time_s: f64| {
            let (sin, cos) = (turning * time_s).sin_cos();
            UnitQuaternion::from_scaled_axis(angle * Vector3::new(0.0, cos, sin))
        };
        let rows = 8000;
        // Increments are ∫ω dt in the body, summed from fine steps.
        const FINE: usize = 16;
        let mut case: Triad = Default::default();
        for row in 0..rows {
            let mut sum = Vector3::zeros();
            for step in 0..FINE {
                let at = |step: usize| (row as f64 + step as f64 / FINE as f64) / rate_hz;
                sum += (attitude(at(step)).inverse() * attitude(at(step + 1))).scaled_axis();
            }
            (0..3).for_each(|axis| case[axis].push(sum[axis]));
        }
        let means = mean_rotation(&case, 1);
        // The last row but one: the last has no neighbour after it.
        let row = rows - 2;
        let mut expected = Matrix3::zeros();
        for step in 0..FINE {
            let time_s = (row as f64 + (step as f64 + 0.5) / FINE as f64) / rate_hz;
            let now = attitude(time_s).inverse() * attitude(0.0);
            expected += now.to_rotation_matrix().matrix() / FINE as f64;
        }
        // Of A²Ω t (ΩT)²/12, what no correction would leave, 7e-8 of drift; and of the (ΩT)²A/12 = 3e-7 by which the
        // chord misses the mean: a twentieth at most. The fine steps themselves leave 1e-9.
        for (body, triad) in means.iter().enumerate() {
            for (start, values) in triad.iter().enumerate() {
                let off = values[row] - expected[(body, start)];
                assert!(off.abs() < 5e-9, "[{body}][{start}] {off:e}");
            }
        }
    }
}
