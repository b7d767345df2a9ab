//! Extrapolation of a record beyond its ends by linear prediction (autoregression by Burg's method: J. P. Burg, Maximum
//! entropy spectral analysis, 1967).
//!
//! Reflection or truncation breaks a tone at the ends and makes filters ring. Predicted values continue tones and decay as
//! noise does.

/// Largest number of values in the fit at an end.
const MOST: usize = 8192;

/// Returns `record` with `count` predicted values before it and behind it, faded to 0.
///
/// # Inputs
/// `order`: order of the autoregression; less where the record is short.
pub fn extended(record: &[f64], count: usize, order: usize) -> Vec<f64> {
    let end = record.len() - record.len().min(MOST);
    let last: Vec<f64> = record[end..].to_vec();
    let mut first: Vec<f64> = record[..record.len().min(MOST)].to_vec();
    first.reverse();
    let mut values = continued(&first, count, order);
    values.reverse();
    values.extend_from_slice(record);
    values.extend(continued(&last, count, order));
    values
}

/// Predicts the `count` values after the given ones, faded to 0.
fn continued(values: &[f64], count: usize, order: usize) -> Vec<f64> {
    let weights = burg(values, order.min(values.len() / 4));
    let mut known = values.to_vec();
    for _ in 0..count {
        let latest = known.iter().rev();
        known.push(weights.iter().zip(latest).map(|(w, v)| w * v).sum());
    }
    let fade = |row: usize| 0.5 + 0.5 * (std::f64::consts::PI * row as f64 / count as f64).cos();
    let new = known[values.len()..].iter().enumerate();
    new.map(|(row, value)| fade(row) * value).collect()
}

/// Autoregressive coefficients, that of the latest value first.
fn burg(values: &[f64], order: usize) -> Vec<f64> {
    let (mut forward, mut backward) = (values.to_vec(), values.to_vec());
    let mut weights: Vec<f64> = Vec::with_capacity(order);
    for step in 0..order {
        // The backward errors are not moved: their last ones have no partner any more.
        let ahead = &mut forward[step + 1..];
        let behind = &mut backward[..values.len() - 1 - step];
        let [product, energy] = product_and_energy(ahead, behind);
        if energy <= 0.0 {
            break;
        }
        let reflection = 2.0 * product / energy;
        let turned: Vec<f64> = weights.iter().rev().copied().collect();
        for (weight, other) in weights.iter_mut().zip(turned) {
            *weight -= reflection * other;
        }
        weights.push(reflection);
        for (a, b) in ahead.iter_mut().zip(behind) {
            (*a, *b) = (*a - reflection * *b, *b - reflection * *a);
        }
    }
    weights
}

/// Σ a b and Σ (a² + b²), in parallel sums.
fn product_and_energy(a: &[f64], b: &[f64]) -> [f64; 2] {
    const LANES: usize = 8;
    let mut sums = [[0.0; LANES]; 2];
    let mut add = |lane: usize, a: f64, b: f64| {
        sums[0][lane] += a * b;
        sums[1][lane] += a * a + b * b;
    };
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a.remainder().iter().zip(b.remainder());
    rest.enumerate()
        .for_each(|(lane, (a, b))| add(lane, *a, *b));
    for (a, b) in a.zip(b) {
        (0..LANES).for_each(|lane| add(lane, a[lane], b[lane]));
    }
    sums.map(|lanes| lanes.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_goes_on_beyond_both_ends() {
        let tone = |row: i32| 2.0 * (0.13 * f64::from(row) + 0.4).cos();
        // Noise of a thousandth, the same on every machine.
        let mut state = 1u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            2e-3 * (f64::from(state) / f64::from(u32::MAX) - 0.5)
        };
        let record: Vec<f64> = (0..4000).map(|row| tone(row) + noise()).collect();
        let values = extended(&record, 400, 64);
        assert_eq!(values.len(), 4800);
        assert_eq!(values[400..4400], record);
        for away in 0..40 {
            let (before, behind) = (values[399 - away], values[4400 + away]);
            let row = away as i32;
            assert!((before - tone(-1 - row)).abs() < 0.1, "{row} before");
            assert!((behind - tone(4000 + row)).abs() < 0.1, "{row} behind");
        }
    }

    #[test]
    fn nothing_is_predicted_of_nothing() {
        assert_eq!(extended(&[0.0; 100], 10, 8), vec![0.0; 120]);
    }
}
