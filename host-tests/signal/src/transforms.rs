//! Plans of real Fourier transforms.
//!
//! A plan's twiddles cost as much as several transforms: a length is planned once and shared while in use, and released
//! after, so that a campaign over recordings of many lengths does not keep them all.

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError, Weak};

type Shared<T> = Mutex<Vec<(usize, Weak<T>)>>;

static FORWARD: Shared<dyn RealToComplex<f64>> = Mutex::new(Vec::new());
static INVERSE: Shared<dyn ComplexToReal<f64>> = Mutex::new(Vec::new());

/// Plan of the transform of `length` rows.
pub fn forward(length: usize) -> Arc<dyn RealToComplex<f64>> {
    shared(&FORWARD, length, |planner| planner.plan_fft_forward(length))
}

/// Plan of the inverse transform to `length` rows.
pub fn inverse(length: usize) -> Arc<dyn ComplexToReal<f64>> {
    shared(&INVERSE, length, |planner| planner.plan_fft_inverse(length))
}

fn shared<T: ?Sized>(
    plans: &Shared<T>,
    length: usize,
    plan: impl FnOnce(&mut RealFftPlanner<f64>) -> Arc<T>,
) -> Arc<T> {
    // A plan is whole or absent: a panic leaves no partial one.
    let mut plans = plans.lock().unwrap_or_else(PoisonError::into_inner);
    plans.retain(|(_, held)| held.strong_count() > 0);
    let known = plans.iter().find(|(known, _)| *known == length);
    if let Some(known) = known.and_then(|(_, held)| held.upgrade()) {
        return known;
    }
    let fresh = plan(&mut RealFftPlanner::new());
    plans.push((length, Arc::downgrade(&fresh)));
    fresh
}

/// Smallest length of factors 2, 3 and 5 that holds `least` rows.
pub fn smooth_length(least: usize) -> usize {
    let is_smooth = |length: &usize| {
        let mut rest = *length;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        rest == 1
    };
    (least.max(1)..).find(is_smooth).unwrap_or(least)
}

/// Smallest even length of factors 2, 3 and 5 that holds `least` rows.
pub fn even_smooth_length(least: usize) -> usize {
    2 * smooth_length(least.max(2).div_ceil(2))
}

/// Welch periodogram: mean over Hann-windowed, half-overlapping pieces of `piece` rows, as the power per row in each of
/// `piece/2 + 1` bins (white noise of variance v gives v in every bin).
pub fn mean_periodogram(values: &[f64], piece: usize) -> Vec<f64> {
    let piece = piece.min(values.len() & !1).max(2);
    let window: Vec<f64> = (0..piece)
        .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / piece as f64).cos())
        .collect();
    let norm: f64 = window.iter().map(|w| w * w).sum();
    let forward = forward(piece);
    let (mut input, mut output) = (forward.make_input_vec(), forward.make_output_vec());
    let mut power = vec![0.0; piece / 2 + 1];
    let mut pieces = 0.0;
    let mut begin = 0;
    while begin + piece <= values.len() {
        for (slot, (value, weight)) in input
            .iter_mut()
            .zip(values[begin..begin + piece].iter().zip(&window))
        {
            *slot = value * weight;
        }
        forward
            .process(&mut input, &mut output)
            .expect("lengths come from the plan");
        for (sum, bin) in power.iter_mut().zip(&output) {
            *sum += bin.norm_sqr() / norm;
        }
        pieces += 1.0;
        begin += piece / 2;
    }
    power.iter().map(|sum| sum / pieces).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_lengths_have_small_factors() {
        assert_eq!(
            [7, 97, 4097, 180_001].map(smooth_length),
            [8, 100, 4320, 182_250]
        );
    }

    #[test]
    fn a_plan_is_shared_while_it_is_held() {
        const ROWS: usize = 2 * 3 * 5 * 7 * 11;
        let first = forward(ROWS);
        assert!(Arc::ptr_eq(&first, &forward(ROWS)));
        let mut values = first.make_input_vec();
        values[1] = 1.0;
        let mut bins = first.make_output_vec();
        first
            .process(&mut values, &mut bins)
            .expect("lengths of the plan");
        let back = inverse(ROWS);
        let mut again = back.make_output_vec();
        back.process(&mut bins, &mut again)
            .expect("lengths of the plan");
        assert!((again[1] / ROWS as f64 - 1.0).abs() < 1e-12 && again[0].abs() < 1e-9);
    }
}
