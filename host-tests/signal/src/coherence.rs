//! Coherence of a gyro's reading and its prediction, by octave: the absolute measure of a fit. It needs no noise level, since a
//! residual that is small beside the motion leaves it at 1 and two unrelated motions leave it near 0.

use std::f64::consts::TAU;

use rlg_plan::CoherencePlan;

use crate::axes::Triad;
use crate::transforms::{even_smooth_length, forward};

/// Coherence in one octave.
#[derive(Debug, Clone, Copy)]
pub struct Octave {
    /// Lower and upper edge \[Hz\].
    pub band_hz: [f64; 2],
    /// Magnitude-squared coherence of each gyro with its prediction \[1\].
    pub coherence: [f64; 3],
}

/// Magnitude-squared coherence |Σ X\* Y|² / (Σ |X|² Σ |Y|²) of prediction X and reading Y = X + residual, summed over the
/// bins of an octave and over Hann-windowed, half-overlapping pieces (Welch; Carter, Proc. IEEE 75, 1987).
///
/// # Inputs
/// `residual_rad`, `predicted_rad`: by row of `period_s`; `is_used`: rows with a
/// measured residual; in others it is taken as zero, since a motion cut out would spread over all frequencies.
///
/// # Returns
/// Octaves from the lowest resolved by the pieces to half the row rate; none for too few rows.
pub fn by_octave(
    residual_rad: &Triad,
    predicted_rad: &Triad,
    is_used: impl Fn(usize) -> bool,
    period_s: f64,
    plan: &CoherencePlan,
) -> Vec<Octave> {
    let rows = predicted_rad[0].len();
    if rows < plan.pieces * plan.least_rows {
        return Vec::new();
    }
    let piece = even_smooth_length((rows / plan.pieces).min(plan.most_rows));
    let sums = [0, 1, 2].map(|axis| {
        let of = (&residual_rad[axis][..], &predicted_rad[axis][..]);
        cross_sums(of, &is_used, piece)
    });
    let hz = |bin: usize| bin as f64 / (piece as f64 * period_s);
    let mut octaves = Vec::new();
    let mut low = plan.first;
    while low < piece / 2 {
        let high = (2 * low).min(piece / 2 + 1);
        let coherence = sums.each_ref().map(|sums| {
            let of = |k: usize| sums[low..high].iter().map(|bin| bin[k]).sum::<f64>();
            let powers = of(2) * of(3);
            match powers > 0.0 {
                true => (of(0).powi(2) + of(1).powi(2)) / powers,
                false => 0.0,
            }
        });
        octaves.push(Octave {
            band_hz: [hz(low), hz(high.min(piece / 2))],
            coherence,
        });
        low = high;
    }
    octaves
}

/// Sums over pieces, by bin: real and imaginary part of the cross spectrum, power of prediction and of reading.
fn cross_sums(
    (residual, predicted): (&[f64], &[f64]),
    is_used: &impl Fn(usize) -> bool,
    piece: usize,
) -> Vec<[f64; 4]> {
    let forward = forward(piece);
    let (mut input, mut prediction) = (forward.make_input_vec(), forward.make_output_vec());
    let mut reading = forward.make_output_vec();
    let mut sums = vec![[0.0; 4]; piece / 2 + 1];
    let mut begin = 0;
    while begin + piece <= predicted.len() {
        let mut transform = |output: &mut [_], value: &dyn Fn(usize) -> f64| {
            for (k, slot) in input.iter_mut().enumerate() {
                let window = 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / piece as f64).cos();
                *slot = window * value(begin + k);
            }
            forward
                .process(&mut input, output)
                .expect("lengths come from the plan");
        };
        let left = |row: usize| if is_used(row) { residual[row] } else { 0.0 };
        transform(&mut prediction, &|row| predicted[row]);
        transform(&mut reading, &|row| predicted[row] + left(row));
        for (sum, (x, y)) in sums.iter_mut().zip(prediction.iter().zip(&reading)) {
            let cross = x.conj() * y;
            for (sum, value) in sum
                .iter_mut()
                .zip([cross.re, cross.im, x.norm_sqr(), y.norm_sqr()])
            {
                *sum += value;
            }
        }
        begin += piece / 2;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::by_octave;
    use crate::axes::Triad;
    use crate::test_noise::noise;
    use rlg_plan::CoherencePlan;

    const ROWS: usize = 8192;

    fn rows(seed: u64) -> Vec<f64> {
        std::iter::repeat_with(noise(seed)).take(ROWS).collect()
    }

    #[test]
    fn coherence_is_that_of_the_ratio_of_powers() {
        let motion: Triad = [1, 2, 3].map(rows);
        let left: Triad = [4, 5, 6].map(rows);
        let scaled = |by: [f64; 3]| -> Triad {
            std::array::from_fn(|axis| left[axis].iter().map(|value| by[axis] * value).collect())
        };
        // Independent noise of r times the motion's power: 1/(1 + r).
        let found = by_octave(
            &scaled([0.0, 1.0, 3.0]),
            &motion,
            |_| true,
            0.01,
            &CoherencePlan::default(),
        );
        assert!(found.len() > 6, "{found:?}");
        let [x, y, z] = found[found.len() - 2].coherence;
        assert!((x - 1.0).abs() < 1e-12);
        assert!((y - 0.5).abs() < 0.05, "{y}");
        assert!((z - 0.1).abs() < 0.04, "{z}");
        assert!((found[found.len() - 1].band_hz[1] - 50.0).abs() < 1e-9);
    }

    #[test]
    fn a_prediction_of_another_motion_is_not_coherent() {
        let motion: Triad = [1, 2, 3].map(rows);
        let other: Triad = [7, 8, 9].map(rows);
        let left: Triad = std::array::from_fn(|axis| {
            let pairs = other[axis].iter().zip(&motion[axis]);
            pairs.map(|(read, predicted)| read - predicted).collect()
        });
        for octave in &by_octave(&left, &motion, |_| true, 0.01, &CoherencePlan::default())[3..] {
            assert!(octave.coherence.iter().all(|one| *one < 0.1), "{octave:?}");
        }
    }
}
