//! Levels of a gyro's noise in the terms of IEEE 952, each with its standard deviation.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;
use rlg_findings::result::{LevelEntry, NoiseTermsEntry};
use rlg_inference::{Drift, NoiseBasis, NoiseLevels};

/// The terms of one gyro.
///
/// # Inputs
/// `drift`: which of flicker and rate random walk was fitted; the other is absent.
pub(super) fn terms(
    basis: &NoiseBasis,
    levels: NoiseLevels,
    drift: Drift,
    (rows, rate_hz): (usize, f64),
) -> NoiseTermsEntry {
    let record = rows as f64;
    // White increments of variance S have a two-sided density of rate S · rate; flicker's is B²/(2π f), and a walk's
    // increments are K²/rate³.
    let in_unit = [
        rate_hz,
        1.0,
        TAU * rate_hz * rate_hz / record,
        (PI / record).powi(2) * rate_hz.powi(3),
    ];
    let stds = stds(basis, levels, drift);
    let level = |term: usize| {
        let (value, std) = (levels.as_array()[term], stds[term]?);
        let value_in_unit = (value * in_unit[term]).sqrt();
        // d√x = dx/(2√x); where nothing is there the square alone has a spread.
        let of_square = (std * in_unit[term]).sqrt();
        let std = if value > std {
            0.5 * value_in_unit * std / value
        } else {
            of_square
        };
        Some(LevelEntry {
            value: value_in_unit,
            std,
        })
    };
    NoiseTermsEntry {
        angle_random_walk_rad_sqrt_s: level(0),
        quantisation_rad: level(1),
        bias_instability_rad_s: level(2),
        rate_random_walk_rad_s_sqrt_s: level(3),
    }
}

/// Standard deviations of the fitted levels, from their Fisher information; `None` of a term that was not fitted.
fn stds(basis: &NoiseBasis, levels: NoiseLevels, drift: Drift) -> [Option<f64>; 4] {
    let power = basis.binned(levels);
    let fitted: Vec<usize> = (0..4).filter(|&term| drift.active()[term]).collect();
    let information = DMatrix::from_fn(fitted.len(), fitted.len(), |a, b| {
        let (a, b) = (&basis.power[fitted[a]], &basis.power[fitted[b]]);
        let bins = power.iter().zip(&basis.counts).enumerate();
        bins.map(|(bin, (s, count))| 0.5 * count * a[bin] * b[bin] / (s * s))
            .sum::<f64>()
    });
    // Scaled, for the levels differ by many powers of ten.
    let scale = DMatrix::from_diagonal(&information.diagonal().map(|one| one.sqrt().recip()));
    let covariance = (&scale * information * &scale)
        .try_inverse()
        .map(|inverse| &scale * inverse * &scale);
    let mut stds = [None; 4];
    if let Some(covariance) = covariance {
        for (place, term) in fitted.into_iter().enumerate() {
            stds[term] = Some(covariance[(place, place)].max(0.0).sqrt());
        }
    }
    stds
}

/// The terms in a sentence, in the units of data sheets.
pub(super) fn sentence(axis: &str, terms: &NoiseTermsEntry) -> String {
    let per_hour = 3600.0_f64.to_degrees();
    let each = [
        (
            "N",
            &terms.angle_random_walk_rad_sqrt_s,
            per_hour / 60.0,
            "°/√h",
        ),
        ("Q", &terms.quantisation_rad, per_hour, "″"),
        ("B", &terms.bias_instability_rad_s, per_hour, "°/h"),
        (
            "K",
            &terms.rate_random_walk_rad_s_sqrt_s,
            per_hour * 60.0,
            "°/h/√h",
        ),
    ];
    let each = each.into_iter().filter_map(|(name, level, factor, unit)| {
        let level = level.as_ref()?;
        let (value, std) = (level.value * factor, level.std * factor);
        Some(if value > std {
            format!("{name} = {value:.3e} ± {std:.1e} {unit}")
        } else {
            format!("{name} < {:.1e} {unit}", 3.0_f64.sqrt() * std)
        })
    });
    let each: Vec<String> = each.collect();
    format!("Noise: gyro {axis}: {}.", each.join(", "))
}
