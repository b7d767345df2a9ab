//! Stretches in which the case was shaken along a line: no gravity and no rotation predicts that force.
//!
//! Enters: regimes and their fitted rows. Leaves: which of them show more power in some band than the quietest
//! regime does there, after everything that the catalogue could explain in that regime alone is fitted away.
//! What the catalogue explains is therefore never mistaken for shaking, and what it does not explain is left
//! out rather than named.

use super::bench::ForceBench;
use std::ops::Range;

use crate::bench::Bench as _;
use crate::declare::BAND_EDGES_HZ;
use crate::hypotheses::{CATALOGUE, no_effects};
use crate::noise::Noise;
use crate::portion::Portion;
use crate::scene::Scene;
use crate::split::{Regime, Split, intersect};
use crate::streams::Triad;
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// Twice the power of the quiet stretches is shaking (or physics that belongs to no entry).
const SHAKEN: f64 = 2.0;

/// Standard deviations by which it must stand clear: of some hundred bands none does by chance.
const CLEAR: f64 = 6.0;

/// A band is judged where it holds this many bins.
const FEWEST_BINS: usize = 20;

/// A delay is no straight line: steps until what is left of it is below the noise.
const NEWTON_STEPS: usize = 3;

/// Mean power and number of bins of a band, where there are enough.
type Level = Option<(f64, f64)>;

/// For each regime whether it was shaken. `None` for a regime without rows to judge by.
pub fn shaken(
    scene: &Scene,
    residual_m_s: &Triad,
    parameters: &Parameters,
    candidates: &[usize],
    split: &Split,
    noise: [Noise; 3],
) -> Vec<Option<bool>> {
    let rate_hz = noise[0].rate_hz;
    let bands = |regime: &Regime| -> Option<[Vec<Level>; 3]> {
        let rows = intersect(std::slice::from_ref(&regime.rows), &split.fitted);
        let portion = Portion::new(rows, rate_hz)?;
        let at = no_effects();
        let mut bench = ForceBench::new(
            scene,
            residual_m_s,
            parameters,
            portion,
            noise,
            candidates,
            &at,
        );
        for _ in 0..NEWTON_STEPS {
            straighten(&mut bench, parameters, candidates);
        }
        Some([0, 1, 2].map(|axis| {
            let left = bench.left_power(axis);
            BAND_EDGES_HZ
                .windows(2)
                .map(|edges| {
                    let bin = |hz: f64| (hz * bench.portion.seconds()).ceil() as usize;
                    let (first, last) = (bin(edges[0]), bin(edges[1].min(rate_hz)));
                    let bins = first.min(left.len())..last.min(left.len());
                    let count = bins.len() as f64;
                    (bins.len() >= FEWEST_BINS)
                        .then(|| (left[bins].iter().sum::<f64>() / (2.0 * count), count))
                })
                .collect()
        }))
    };
    let measured: Vec<_> = split.regimes.iter().map(bands).collect();
    let quietest = |axis: usize, band: usize| {
        let levels = measured.iter().flatten().filter_map(|of| of[axis][band]);
        levels.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    measured
        .iter()
        .map(|of| {
            let of = of.as_ref()?;
            Some((0..3).any(|axis| {
                of[axis].iter().enumerate().any(|(band, level)| {
                    let (Some((power, bins)), Some((least, least_bins))) =
                        (level, quietest(axis, band))
                    else {
                        return false;
                    };
                    let spread = (1.0 / bins + 1.0 / least_bins).sqrt();
                    *power > SHAKEN.max(1.0 + CLEAR * spread) * least
                })
            }))
        })
        .collect()
}

/// One Gauss–Newton step of the effects that are not linear, with everything else free.
fn straighten(bench: &mut ForceBench, parameters: &Parameters, candidates: &[usize]) {
    let information = bench.information();
    let mut indices = parameters.of_all(candidates);
    indices.extend(bench.unknowns());
    let solution = information.solve(&indices, &|index| {
        prior_width(parameters, &information, index)
    });
    for &effect in candidates
        .iter()
        .filter(|&&effect| !CATALOGUE[effect].is_linear())
    {
        let at: Vec<f64> = parameters
            .of(effect)
            .filter_map(|index| indices.iter().position(|&known| known == index))
            .map(|place| solution.values[place])
            .collect();
        bench.relinearise(effect, &at);
    }
}

/// Names of the regimes that were shaken.
pub fn name_shaken(split: &Split, shaken: &[Option<bool>]) -> Vec<String> {
    split
        .regimes
        .iter()
        .zip(shaken)
        .filter(|(_, shaken)| **shaken == Some(true))
        .map(|(regime, _)| regime.name.clone())
        .collect()
}

/// The split without regimes that were shaken.
pub fn without_shaken(split: Split, shaken: &[Option<bool>]) -> Split {
    let kept: Vec<Range<usize>> = split
        .regimes
        .iter()
        .zip(shaken)
        .filter(|(_, shaken)| **shaken != Some(true))
        .map(|(regime, _)| regime.rows.clone())
        .collect();
    Split {
        fitted: intersect(&split.fitted, &kept),
        held_out: intersect(&split.held_out, &kept),
        regimes: split
            .regimes
            .into_iter()
            .filter(|regime| kept.contains(&regime.rows))
            .collect(),
    }
}
