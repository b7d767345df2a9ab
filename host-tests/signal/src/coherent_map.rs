//! Estimates one 3 × 3 map from the reference's axes to the gyros, at one common delay.
//!
//! Both sides have noise of unknown size (errors in variables). Frequencies are weighted by the inverse of the fit's
//! residual power, so those of coherent motion dominate; the attenuation of a coefficient by the reference's noise is
//! estimated, and an axis of the reference is judged only where it moves. Increments are regressed about their mean, so a
//! constant rate (a bias) has no influence.

use nalgebra::Matrix3;
use rlg_plan::MapPlan;

use crate::cross_spectra::Spectra;

/// Map of the reference to the gyros.
#[derive(Debug, Clone)]
pub struct CoherentMap {
    /// Increment of gyro i: Σ `map[(i, j)]` times the reference's increment about j.
    pub map: Matrix3<f64>,
    /// Standard deviations; infinite where an axis does not move.
    pub std: Matrix3<f64>,
    /// Axes of the reference with enough motion for a judgement.
    pub moves: [bool; 3],
    /// Delay of the gyros behind the reference \[s\].
    pub delay_s: f64,
    /// Variation over frequency of each gyro's gain about the map, as a share of its power \[1\]: a factor is constant over
    /// frequency, a soft mount or a filter is not.
    pub uneven: [f64; 3],
    /// Maps at all likely delays with an equivalent fit, where gyros do not follow their own axes.
    pub others: Vec<Matrix3<f64>>,
}

/// Passes of iterative reweighting: the weights of the last two differ by less than their own scatter.
const PASSES: usize = 4;

/// Estimates the map on the rows that are `seen`; `None` where they are too few or nothing moves.
pub fn measure(
    gyros_rad: [&[f64]; 3],
    reference_rad: [&[f64]; 3],
    seen: &[bool],
    rate_hz: f64,
    plan: &MapPlan,
) -> Option<CoherentMap> {
    let most = ((plan.most_delay_s * rate_hz).ceil() as usize).min(seen.len() / 4);
    let first = Spectra::new(gyros_rad, reference_rad, seen, (0, most), plan)?;
    let start = first.best_lag(&first.even_weights(), most)?;
    // The same rows on both sides: rows unseen on one side are excluded on the other.
    let shift = start.lag.round() as isize;
    let spectra = match shift {
        0 => first,
        _ => Spectra::new(gyros_rad, reference_rad, seen, (shift, most), plan)?,
    };
    let mut lag = start.lag - shift as f64;
    let mut fit = spectra.fit(&spectra.even_weights(), lag);
    let mut weights = spectra.weights(&fit);
    for _ in 1..PASSES {
        // The first fit alone searched for a delay, which noise at high frequencies may hide.
        lag = spectra.best_lag(&weights, most)?.lag;
        fit = spectra.fit(&weights, lag);
        weights = spectra.weights(&fit);
    }
    let std = spectra.std(&weights);
    let kept = spectra.kept(&fit, &weights);
    let unseen = spectra.unseen(&fit, &weights, plan.kept);
    let moves = [0, 1, 2].map(|axis| {
        let size = fit.map.column(axis).norm();
        let strongest = fit.map.column(axis).iamax();
        size > 0.0
            && (0..3).all(|gyro| std[(gyro, axis)] < plan.known * size)
            && kept[(strongest, axis)] > plan.kept
            && unseen[axis] < plan.known
    });
    let map = Matrix3::from_fn(|gyro, axis| {
        // The true value lies between the coefficient and its value corrected for attenuation by noise of the reference
        // alone.
        fit.map[(gyro, axis)] / kept[(gyro, axis)].max(plan.kept).sqrt()
    });
    let is_led_otherwise = |axis: usize| {
        let column = fit.map.column(axis);
        moves[axis] && column[axis] < plan.own * column.norm()
    };
    let others = if (0..3).any(is_led_otherwise) {
        let likely = (plan.likely_delay_s * rate_hz).ceil() as isize;
        spectra.as_well(&weights, (-likely - shift, likely - shift), plan.as_well)
    } else {
        Vec::new()
    };
    Some(CoherentMap {
        map,
        std,
        moves,
        delay_s: (lag + shift as f64) / rate_hz,
        uneven: [0, 1, 2].map(|gyro| spectra.uneven(&fit, gyro, lag, plan.coherent)),
        others,
    })
}
