//! Motion of the case on the accelerometers' rows: attitude since the start, and centripetal and Euler terms of lever arms.
//!
//! The attitude is integrated row by row from rotation vectors with the coning correction of three neighbouring rows
//! (Savage 1998, sec. 3); its mean over a row is Simpson's rule. Both are accurate to (ΩT)⁴, so rows that are long against
//! the fastest motion are first divided into parts by band-limited interpolation.
//!
//! Assumes gaps of the reference of one or two rows, which are interpolated; rows beyond a longer gap are not used.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use realfft::num_complex::Complex64;
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::axes::{Triad, each_axis};
use rlg_signal::derivatives::Spectrum;

use crate::readings::{Piece, Readings};
use crate::reference::Reference;

/// Motion of the case on the accelerometers' rows.
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

/// The six products of two axes, and the place of each pair in them.
const PRODUCTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
const PAIRS: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];

impl Carried {
    /// Computes the motion on the accelerometers' rows.
    pub fn new(reference: &Reference, rows: &Rows) -> Self {
        let rate_hz = reference.rate_hz;
        let parts = parts(reference.edge_hz, rate_hz);
        let means = mean_rotation(&increments_in_parts(reference, parts), parts);
        let share = rows.rate_hz / rate_hz;
        let body_from_start = [0, 1, 2].map(|body: usize| {
            each_axis(|start| {
                let mut mean = rows.gather(&means[body][start]);
                mean.iter_mut().for_each(|value| *value *= share);
                mean
            })
        });
        drop(means);
        let spectra = each_spectrum(&reference.moving_rad, rate_hz);
        let squares: Vec<Vec<f64>> = products(&spectra, parts, rate_hz)
            .iter()
            .map(|product| rows.gather(product))
            .collect();
        Self {
            body_from_start,
            angle_rad: each_axis(|axis| rows.gather(&reference.case_rad[axis])),
            // The derivative of increments over a row is the rate's: ∫α dt.
            turned_rad_s: each_axis(|axis| rows.gather(&spectra[axis].mean_derivative(1))),
            squared_rad2_s: [0, 1, 2].map(|i| [0, 1, 2].map(|j| squares[PAIRS[i][j]].clone())),
        }
    }

    /// ∫(α × e_j + ω × (ω × e_j))_i dt: velocity of accelerometer i per metre of lever arm along j \[1/s\].
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
        let rows = squares[i][j].iter().zip(&self.turned_rad_s[k]);
        rows.map(|(square, turned)| square + sign * turned)
            .collect()
    }

    /// Concatenates the motion of several recordings.
    pub fn joined(each: Vec<Self>) -> Self {
        let one_of = |of: &dyn Fn(&Self) -> &Vec<f64>| each.iter().flat_map(of).copied().collect();
        let by_pairs = |of: fn(&Self) -> &[Triad; 3]| -> [Triad; 3] {
            [0, 1, 2].map(|i: usize| each_axis(|j| one_of(&|one| &of(one)[i][j])))
        };
        Self {
            body_from_start: by_pairs(|one| &one.body_from_start),
            angle_rad: each_axis(|axis| one_of(&|one| &one.angle_rad[axis])),
            turned_rad_s: each_axis(|axis| one_of(&|one| &one.turned_rad_s[axis])),
            squared_rad2_s: by_pairs(|one| &one.squared_rad2_s),
        }
    }

    /// Resolves in body axes, on a recording's rows, a vector that is `at_start` in the axes of its start and rotates there
    /// at `turning_rad_s`.
    pub fn in_body(
        &self,
        readings: &Readings,
        piece: &Piece,
        at_start: Vector3<f64>,
        turning_rad_s: Vector3<f64>,
    ) -> Triad {
        let at = |row: usize| {
            let since_s = readings.since_start_s(piece, row);
            UnitQuaternion::from_scaled_axis(turning_rad_s * since_s) * at_start
        };
        let rows = piece.rows.clone().into_par_iter();
        let turned: Vec<Vector3<f64>> = rows.map(at).collect();
        each_axis(|axis| {
            let means = &self.body_from_start[axis];
            let rows = piece.rows.clone().zip(&turned);
            rows.map(|(row, now)| {
                means[0][row] * now.x + means[1][row] * now.y + means[2][row] * now.z
            })
            .collect()
        })
    }

    /// Attitude error at the middle of each row since its recording's start \[rad, body axes\], for a rotation error of
    /// `more` per row: ∫ start-from-body δω dt, to the first order of δω. `more` takes a row's ∫ω dt and ∫α dt.
    pub fn turned_beyond_rad(
        &self,
        pieces: &[Piece],
        more: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<Vector3<f64>> {
        let of = |triad: &Triad, row: usize| Vector3::from_fn(|axis, _| triad[axis][row]);
        let mut at_start = Vector3::zeros();
        let mut starts = pieces.iter().map(|piece| piece.rows.start).peekable();
        (0..self.angle_rad[0].len())
            .map(|row| {
                if starts.next_if_eq(&row).is_some() {
                    at_start = Vector3::zeros();
                }
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
}

fn each_spectrum(increments: &Triad, rate_hz: f64) -> [Spectrum; 3] {
    [0, 1, 2].map(|axis: usize| Spectrum::new(&increments[axis], rate_hz))
}

/// Number of parts of a row so that one part is at most a sixteenth of the period of the fastest motion: the error of
/// Simpson's rule is then 1e-5.
fn parts(edge_hz: f64, rate_hz: f64) -> usize {
    const PARTS_A_PERIOD: f64 = 16.0;
    ((PARTS_A_PERIOD * edge_hz / rate_hz).ceil() as usize).max(1)
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// Transfer function from increments of rows to values at the middle of part `part` of `parts`, times `of_part` of the
/// frequency.
fn within(
    (part, parts): (usize, usize),
    rate_hz: f64,
    of_part: impl Fn(f64) -> f64,
) -> impl Fn(f64) -> Complex64 {
    let ahead_s = ((part as f64 + 0.5) / parts as f64 - 0.5) / rate_hz;
    move |hz| Complex64::from_polar(of_part(hz) / sinc(hz / rate_hz), TAU * hz * ahead_s)
}

/// Increments of the case over the parts of rows \[rad\].
fn increments_in_parts(reference: &Reference, parts: usize) -> Triad {
    if parts == 1 {
        return reference.case_rad.clone();
    }
    let rate_hz = reference.rate_hz;
    let part_hz = rate_hz * parts as f64;
    each_axis(|axis| {
        let spectrum = Spectrum::new(&reference.case_rad[axis], rate_hz);
        let of_part = |hz: f64| sinc(hz / part_hz) / parts as f64;
        interleaved(parts, |part| {
            spectrum.through(within((part, parts), rate_hz, of_part))
        })
    })
}

/// ∫ω_i ω_j dt over rows \[rad²/s\], in the order of [`PRODUCTS`].
fn products(spectra: &[Spectrum; 3], parts: usize, rate_hz: f64) -> Vec<Vec<f64>> {
    let rate: [Vec<f64>; 3] = each_axis(|axis| {
        interleaved(parts, |part| {
            spectra[axis].through(within((part, parts), rate_hz, |_| rate_hz))
        })
    });
    let part_s = 1.0 / (rate_hz * parts as f64);
    PRODUCTS
        .into_par_iter()
        .map(|(i, j)| {
            let pairs = rate[i].iter().zip(&rate[j]);
            let products: Vec<f64> = pairs.map(|(a, b)| a * b * part_s).collect();
            mean_over_rows(&products)
                .chunks(parts)
                .map(|row| row.iter().sum())
                .collect()
        })
        .collect()
}

/// Interleaves the values of the parts; `of` computes those of one part.
fn interleaved(parts: usize, of: impl Fn(usize) -> Vec<f64> + Sync) -> Vec<f64> {
    let each: Vec<Vec<f64>> = (0..parts).into_par_iter().map(&of).collect();
    let rows = 0..each[0].len();
    rows.flat_map(|row| each.iter().map(move |part| part[row]))
        .collect()
}

/// Means over parts from values at their middles, to the fourth order: mean = middle + second difference / 24.
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

/// Mean of body-from-start over each row of `parts` increments, `[body axis][start axis]`.
///
/// With ω linear within a part, α T² = (θ_{k+1} − θ_{k−1})/2: the rotation to the part's middle is θ_k/2 − α T²/8, and the
/// part's rotation vector is θ_k + (θ_{k−1} × θ_k + θ_k × θ_{k+1})/24.
fn mean_rotation(case_rad: &Triad, parts: usize) -> [Triad; 3] {
    let count = case_rad[0].len();
    let increment =
        |part: usize| Vector3::new(case_rad[0][part], case_rad[1][part], case_rad[2][part]);
    let mut means: [Triad; 3] =
        [0, 1, 2].map(|_| [0, 1, 2].map(|_| Vec::with_capacity(count / parts)));
    let mut start_from_body = UnitQuaternion::identity();
    let matrix = |start_from_body: &UnitQuaternion<f64>| -> Matrix3<f64> {
        start_from_body.to_rotation_matrix().matrix().transpose()
    };
    let mut begin = matrix(&start_from_body);
    let mut sum = Matrix3::zeros();
    for part in 0..count {
        let here = increment(part);
        let before = increment(part.saturating_sub(1));
        let after = increment((part + 1).min(count - 1));
        let turn = here + (before.cross(&here) + here.cross(&after)) / 24.0;
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
        // Coning: a rotation by the angle A about a level axis that rotates at Ω; ω from the closed form.
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
        // The last row has no neighbour after it, so the last but one is tested.
        let row = rows - 2;
        let mut expected = Matrix3::zeros();
        for step in 0..FINE {
            let time_s = (row as f64 + (step as f64 + 0.5) / FINE as f64) / rate_hz;
            let now = attitude(time_s).inverse() * attitude(0.0);
            expected += now.to_rotation_matrix().matrix() / FINE as f64;
        }
        // At most a twentieth of A²Ω t (ΩT)²/12, the drift without a coning correction (7e-8), and of (ΩT)²A/12 = 3e-7, the
        // difference between chord and mean. The error of the fine steps is 1e-9.
        for (body, triad) in means.iter().enumerate() {
            for (start, values) in triad.iter().enumerate() {
                let off = values[row] - expected[(body, start)];
                assert!(off.abs() < 5e-9, "[{body}][{start}] {off:e}");
            }
        }
    }
}
