//! Drift and power of attitude errors, gyro by gyro: where they differ from noise, and what held-out time says.
//!
//! Enters: errors by stamp \[rad, start frame\], the noise, runs of stamps. Leaves: [`Location`]s, [`Validation`]s and
//! amplitudes by regime, in the types of the diagnosis on rows. A gyro's drift is the constant rate of that gyro which
//! the errors of a stretch show, by generalised least squares; its power is that of the innovations in its axis.

use nalgebra::{DMatrix, DVector, Vector3};
use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use std::ops::Range;

use super::cut::Cut;
use super::record::Record;
use super::whiten::{Levels, Whitener};
use crate::information::stable_inverse;
use crate::invariance::{self, Amplitude, Verdict};
use crate::locate::{Location, Tile, is_significant};
use crate::validate::{Figures, Validation, white_chance};

/// What a stretch says of one gyro.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// Constant rate \[rad/s\].
    pub drift_rad_s: f64,
    /// Its standard deviation.
    pub drift_std_rad_s: f64,
    /// Power of the innovations over the noise's.
    pub power: f64,
    /// Steps.
    pub steps: usize,
}

/// What rates of one unit on each gyro make of the errors.
pub fn unit_rates(record: &Record) -> [Vec<Vector3<f64>>; 3] {
    [0, 1, 2].map(|axis: usize| {
        let mut sum = Vector3::zeros();
        record
            .steps
            .iter()
            .map(|step| {
                sum += step.angle_from_rate_s.column(axis);
                sum
            })
            .collect()
    })
}

/// Judges the three gyros over some runs.
pub fn stretch(
    record: &Record,
    rates: &[Vec<Vector3<f64>>; 3],
    runs: &[Range<usize>],
    levels: &Levels,
    error_rad: &[Vector3<f64>],
) -> Option<[Stretch; 3]> {
    let whitener = Whitener::new(&record.steps, runs, levels);
    let error = whitener.whiten(error_rad);
    let steps = error.len() / 3;
    if steps == 0 {
        return None;
    }
    let columns: Vec<Vec<f64>> = rates.iter().map(|rate| whitener.whiten(rate)).collect();
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let fisher = DMatrix::from_fn(3, 3, |a, b| dot(&columns[a], &columns[b]));
    let right = DVector::from_fn(3, |a, _| dot(&columns[a], &error));
    let covariance = stable_inverse(&fisher);
    let drift = &covariance * right;
    Some([0, 1, 2].map(|axis: usize| {
        Stretch {
            drift_rad_s: drift[axis],
            drift_std_rad_s: covariance[(axis, axis)].max(0.0).sqrt(),
            power: error
                .iter()
                .skip(axis)
                .step_by(3)
                .map(|v| v * v)
                .sum::<f64>()
                / steps as f64,
            steps,
        }
    }))
}

/// A tile for each regime and gyro: its drift and its power against the noise.
pub fn tiles(record: &Record, cut: &Cut, levels: &Levels, error_rad: &[Vector3<f64>]) -> Vec<Tile> {
    let rates = unit_rates(record);
    let seconds = median_step_s(record);
    let mut tiles = Vec::new();
    for (place, regime) in cut.regimes.iter().enumerate() {
        let runs = cut.runs(|of, _| of == place);
        let Some(gyros) = stretch(record, &rates, &runs, levels, error_rad) else {
            continue;
        };
        for (axis, gyro) in gyros.iter().enumerate() {
            let z = gyro.drift_rad_s / gyro.drift_std_rad_s.max(f64::MIN_POSITIVE);
            let by_drift = 2.0 * Normal::standard().sf(z.abs());
            let by_power = ChiSquared::new(gyro.steps as f64)
                .map_or(1.0, |law| law.sf(gyro.power * gyro.steps as f64));
            let step_rad = (levels.walk_rad2_s[axis] * seconds
                + 2.0 * (levels.gyro_white_rad2[axis] + levels.reference_white_rad2))
                .sqrt();
            tiles.push(Tile {
                axis,
                rows: regime.rows.clone(),
                band_hz: (0.0, 0.5 / seconds),
                power: gyro.power,
                mean_rad_s: gyro.drift_rad_s,
                mean_std_rad_s: gyro.drift_std_rad_s,
                excess_rad_s: (gyro.power - 1.0).max(0.0).sqrt() * step_rad / seconds,
                // Two tests of one tile.
                chance: (2.0 * by_drift.min(by_power)).min(1.0),
            });
        }
    }
    tiles
}

/// The tiles that are more than noise, every one counted.
pub fn locate(tiles: &[Tile]) -> Vec<Location> {
    tiles
        .iter()
        .filter(|tile| is_significant(tile, tiles.len()))
        .map(|tile| Location {
            axis: tile.axis,
            rows: tile.rows.clone(),
            band_hz: tile.band_hz,
            size_rad_s: tile.mean_rad_s.abs().max(tile.excess_rad_s),
            p_value: (tile.chance * tiles.len() as f64).min(1.0),
            regime: String::new(),
            companions: Vec::new(),
        })
        .collect()
}

/// The middle one of the steps' lengths \[s\].
pub fn median_step_s(record: &Record) -> f64 {
    let mut seconds: Vec<f64> = record
        .steps
        .iter()
        .skip(1)
        .map(|step| step.seconds)
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds.get(seconds.len() / 2).copied().unwrap_or(1.0)
}

/// Before and after on held-out steps; the located regimes by themselves where there are any.
pub fn validate(
    record: &Record,
    cut: &Cut,
    levels: &Levels,
    errors_rad: [&[Vector3<f64>]; 2],
    locations: &[Location],
) -> Vec<Validation> {
    let rates = unit_rates(record);
    let located = |axis: usize, regime: usize| {
        locations
            .iter()
            .any(|one| one.axis == axis && one.rows == cut.regimes[regime].rows)
    };
    let high_hz = 0.5 / median_step_s(record);
    (0..3)
        .filter_map(|axis| {
            let all = &cut.held_out;
            let here = cut.runs(|regime, held| held && located(axis, regime));
            let judged = if here.is_empty() { all } else { &here };
            let figures = |error_rad: &[Vector3<f64>]| -> Option<Figures> {
                let part = stretch(record, &rates, judged, levels, error_rad)?[axis];
                let everywhere = stretch(record, &rates, all, levels, error_rad)?[axis];
                let whitener = Whitener::new(&record.steps, judged, levels);
                let series: Vec<f64> = whitener
                    .whiten(error_rad)
                    .into_iter()
                    .skip(axis)
                    .step_by(3)
                    .collect();
                Some(Figures {
                    drift_rad_s: part.drift_rad_s,
                    drift_std_rad_s: part.drift_std_rad_s,
                    normalised_power: part.power,
                    normalised_power_all: everywhere.power,
                    white_p_value: white(series),
                })
            };
            Some(Validation {
                axis,
                band_hz: (0.0, high_hz),
                before: figures(errors_rad[0])?,
                after: figures(errors_rad[1])?,
            })
        })
        .collect()
}

/// Chance that innovations are white.
fn white(mut series: Vec<f64>) -> f64 {
    /// Fewer have no spectrum to speak of.
    const LEAST: usize = 8;
    if series.len() < LEAST {
        return 1.0;
    }
    let forward = RealFftPlanner::<f64>::new().plan_fft_forward(series.len());
    let mut bins = forward.make_output_vec();
    forward
        .process(&mut series, &mut bins)
        .expect("lengths come from the plan");
    let last = if series.len().is_multiple_of(2) {
        bins.len() - 1
    } else {
        bins.len()
    };
    let ratios: Vec<f64> = bins[1..last].iter().map(|bin| bin.norm_sqr()).collect();
    white_chance(&ratios)
}

/// The amplitude of a prediction in each regime's fitted steps (1 = as fitted on all).
pub fn amplitudes(
    record: &Record,
    cut: &Cut,
    levels: &Levels,
    prediction: &[Vector3<f64>],
    left: &[Vector3<f64>],
) -> Verdict {
    let measured = cut
        .regimes
        .iter()
        .enumerate()
        .filter_map(|(regime, of)| {
            let runs = cut.runs(|one, held| one == regime && !held);
            let seconds: f64 = runs
                .iter()
                .map(|run| record.times_s[run.end - 1] - record.times_s[run.start])
                .sum();
            let whitener = Whitener::new(&record.steps, &runs, levels);
            let (effect, rest) = (whitener.whiten(prediction), whitener.whiten(left));
            let own: f64 = effect.iter().map(|v| v * v).sum();
            let found: f64 = effect.iter().zip(&rest).map(|(a, b)| a * b).sum();
            (own > invariance::LEAST_SNR.powi(2)).then(|| {
                let amplitude = Amplitude {
                    regime: of.name.clone(),
                    value: 1.0 + found / own,
                    std: own.sqrt().recip(),
                };
                (own / seconds, amplitude)
            })
        })
        .collect();
    invariance::verdict(measured)
}
