//! Stamps at which the reference was wrong, found before any physics: single ones that stand out, and rough stretches.
//!
//! (inference.md, B5.)

use rlg_signal::axes::Triad;

use crate::equations::Band;
use crate::gyro_motion::GyroMotion;
use crate::increments::Increments;
use crate::noise::NoiseTerms;

/// Time of the running median that a spike stands out of \[s\].
const MEDIAN_S: f64 = 0.6;

/// A stamp this many times further from the running median than its neighbours is a spike.
const SPIKE: f64 = 12.0;

/// A stretch of this time \[s\] that is this many times rougher than the median one is no reference.
const STRETCH_S: f64 = 4.0;
const ROUGH: f64 = 6.0;

/// Stamps slower than this \[s\] have no running median.
const SLOW_S: f64 = 0.11;

/// Least stretches that have a median.
const LEAST_STRETCHES: usize = 8;

/// Whether each used stamp is faulty.
///
/// # Inputs
/// `left_rad`: rows less all that is fitted.
pub fn find(increments: &Increments, left_rad: &Triad, motion: &GyroMotion) -> Vec<bool> {
    let error_rad: Triad = std::array::from_fn(|axis| {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for (row, grown) in left_rad[axis].iter().enumerate() {
            if increments.free.binary_search(&row).is_err() {
                sum += grown;
            }
            sums.push(sum);
        }
        sums
    });
    let mut faulty = vec![false; error_rad[0].len()];
    if increments.period_s < SLOW_S {
        spikes(&error_rad, increments.period_s, &mut faulty);
    }
    let rate_rad_s: Vec<f64> = increments
        .places()
        .iter()
        .map(|place| motion.rate_rad_s(*place).norm())
        .collect();
    rough(&error_rad, &rate_rad_s, increments.period_s, &mut faulty);
    faulty
}

fn spikes(error_rad: &Triad, period_s: f64, faulty: &mut [bool]) {
    let width = ((MEDIAN_S / period_s).round() as usize).max(5) | 1;
    let medians = error_rad
        .each_ref()
        .map(|values| running_median(values, width));
    let away: Vec<f64> = (0..faulty.len())
        .map(|stamp| {
            let squares =
                (0..3).map(|axis| (error_rad[axis][stamp] - medians[axis][stamp]).powi(2));
            squares.sum::<f64>().sqrt()
        })
        .collect();
    let whole = median(away.clone());
    // The scale changes with the motion: that of each stretch of four widths, of which a fifth may be faulty.
    for (stretch, flags) in away.chunks(4 * width).zip(faulty.chunks_mut(4 * width)) {
        let scale = quantile(stretch.to_vec(), 0.8) + 0.25 * whole;
        for (away, is_faulty) in stretch.iter().zip(flags) {
            *is_faulty |= *away > SPIKE * scale;
        }
    }
}

/// Stretches rougher than others both by themselves and by their motion: what grows with the rate is no fault.
fn rough(error_rad: &Triad, rate_rad_s: &[f64], period_s: f64, faulty: &mut [bool]) {
    let length = ((STRETCH_S / period_s) as usize).max(8);
    let stamps = faulty.len();
    let count = stamps / length;
    if count < LEAST_STRETCHES {
        return;
    }
    let range = |stretch: usize| match stretch + 1 == count {
        true => stretch * length..stamps,
        false => stretch * length..(stretch + 1) * length,
    };
    let sizes: Vec<(f64, f64)> = (0..count)
        .map(|stretch| {
            let used: Vec<usize> = range(stretch).filter(|stamp| !faulty[*stamp]).collect();
            let square: f64 = error_rad.iter().map(|values| scatter(values, &used)).sum();
            let rates = used.iter().map(|stamp| rate_rad_s[*stamp].powi(2));
            let rate = rates.sum::<f64>() / used.len().max(1) as f64;
            (square.sqrt(), rate.sqrt())
        })
        .collect();
    let typical = median(sizes.iter().map(|(size, _)| *size).collect());
    for (stretch, (size, rate)) in sizes.iter().enumerate() {
        // Against those that move at least half as much.
        let alike = sizes.iter().filter(|(_, other)| *other >= 0.5 * rate);
        let of_alike = median(alike.map(|(size, _)| *size).collect());
        if *size > ROUGH * typical && *size > ROUGH * of_alike {
            faulty[range(stretch)].fill(true);
        }
    }
}

/// Mean square about the median.
fn scatter(values: &[f64], used: &[usize]) -> f64 {
    let own: Vec<f64> = used.iter().map(|stamp| values[*stamp]).collect();
    let middle = median(own.clone());
    let squares = own.iter().map(|value| (value - middle).powi(2));
    squares.sum::<f64>() / own.len().max(1) as f64
}

fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let place = (share * values.len() as f64) as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

fn running_median(values: &[f64], width: usize) -> Vec<f64> {
    let half = width / 2;
    (0..values.len())
        .map(|place| {
            let from = place.saturating_sub(half);
            median(values[from..(place + half + 1).min(values.len())].to_vec())
        })
        .collect()
}

/// Errors of single stamps beyond four standard deviations, by how much they exceed those \[rad\]; one more than rows.
///
/// The best estimate of an error e of one stamp (+e in the row before it, −e in the row after) from rows of noise S is
/// (w_{k−1} − w_k) / mean(λ/S), w = S⁻¹ times the rows.
pub fn outliers(band: &Band, terms: &NoiseTerms, left_rad: &Triad, powers: &[f64]) -> Triad {
    /// Beyond this many standard deviations a stamp is no longer noise.
    const BEYOND: f64 = 4.0;
    let pairs = terms.lambda.iter().zip(powers);
    let information =
        pairs.map(|(lambda, power)| lambda / power).sum::<f64>() / powers.len() as f64;
    let weighted = left_rad
        .each_ref()
        .map(|values| band.divided(values, powers));
    let rows = left_rad[0].len();
    let mut errors: Triad = std::array::from_fn(|_| vec![0.0; rows + 1]);
    for stamp in 1..rows {
        let error: [f64; 3] = std::array::from_fn(|axis| {
            (weighted[axis][stamp - 1] - weighted[axis][stamp]) / information
        });
        let square: f64 = error.iter().map(|value| value * value).sum();
        let size = (square * information / 3.0).sqrt();
        if size > BEYOND {
            for axis in 0..3 {
                errors[axis][stamp] = error[axis] * (1.0 - BEYOND / size);
            }
        }
    }
    errors
}
