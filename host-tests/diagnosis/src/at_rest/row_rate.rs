//! Row rate by the recorder's own stamps: slope of a straight line through the fitted ones. Gaps between stamps and rows are
//! not sought: rows are taken as complete.

use std::ops::Range;

use rlg_plan::RestPlan;
use rlg_signal::streams::Streams;

/// Comparison of stamps with rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RowRate {
    /// Rows a second by the stamps \[Hz\].
    pub rate_hz: f64,
    /// Its standard deviation \[Hz\], the stamps' scatter taken as white.
    pub rate_std_hz: f64,
    /// Root mean square of held-out stamps about the nominal clock, carried on from the fitted rows' end \[s\].
    pub held_out_before_s: f64,
    /// The same about the fitted line \[s\].
    pub held_out_after_s: f64,
    /// p-value of the difference from the nominal rate.
    pub p_value: f64,
}

/// Compares the stamps with the nominal clock; `None` without stamps, or where they agree.
pub(super) fn row_rate(
    streams: &Streams,
    fitted: &[Range<usize>],
    held_out: &[Range<usize>],
    plan: &RestPlan,
) -> Option<RowRate> {
    let stamps_s = streams.stamps_s.as_ref()?;
    let rows = |ranges: &[Range<usize>]| -> Vec<usize> {
        ranges
            .iter()
            .flat_map(Clone::clone)
            .filter(|&row| stamps_s[row].is_finite())
            .collect()
    };
    let (fitted, held_out) = (rows(fitted), rows(held_out));
    if fitted.len() < 3 || held_out.is_empty() {
        return None;
    }
    let count = fitted.len() as f64;
    let middle = fitted.iter().map(|&row| row as f64).sum::<f64>() / count;
    let mean_s = fitted.iter().map(|&row| stamps_s[row]).sum::<f64>() / count;
    let spread: f64 = fitted
        .iter()
        .map(|&row| (row as f64 - middle).powi(2))
        .sum();
    let cross: f64 = fitted
        .iter()
        .map(|&row| (row as f64 - middle) * (stamps_s[row] - mean_s))
        .sum();
    let period_s = cross / spread;
    let nominal_s = 1.0 / streams.rate_hz;
    let off = |row: usize, period_s: f64| stamps_s[row] - mean_s - (row as f64 - middle) * period_s;
    let mean_square = |rows: &[usize], period_s: f64| {
        rows.iter()
            .map(|&row| off(row, period_s).powi(2))
            .sum::<f64>()
            / rows.len() as f64
    };
    let std_s = (mean_square(&fitted, period_s) * count / (count - 2.0) / spread).sqrt();
    let z = (period_s - nominal_s).abs() / std_s.max(f64::MIN_POSITIVE);
    let p_value = statrs::function::erf::erfc(z / std::f64::consts::SQRT_2);
    (p_value < plan.row_rate_chance).then(|| RowRate {
        rate_hz: 1.0 / period_s,
        rate_std_hz: std_s / (period_s * period_s),
        held_out_before_s: mean_square(&held_out, nominal_s).sqrt(),
        held_out_after_s: mean_square(&held_out, period_s).sqrt(),
        p_value,
    })
}
