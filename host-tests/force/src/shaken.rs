//! Detection of stretches with linear acceleration of the case, which neither gravity nor rotation predicts.
//!
//! A stretch counts as shaken if some band holds more power than in the quietest stretch (F test), after a fit of the whole
//! catalogue to that stretch alone. So effects of the catalogue are never mistaken for shaking, and unexplained power is
//! excluded rather than named.

use std::ops::Range;

use rlg_diagnosis::rows::noise_levels::first_levels;
use rlg_diagnosis::tiles::locate::band_edges_hz;
use rlg_diagnosis::tiles::regimes::{Regime, intersect};
use rlg_findings::result::UNLISTED;
use rlg_inference::evaluate::{Effort, evaluate, residual_power};
use rlg_inference::{Drift, Fit, Hypothesis, NoiseLevels};
use rlg_signal::axes::Triad;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::candidates::{Candidate, Pool, Scope, Variant};
use crate::prediction::Prediction;
use crate::search::{delays_in, equations, linearised_at};

/// Mean power and number of observations of a band; `None` for too few observations.
type Level = Option<(f64, f64)>;

/// Tests each regime for linear acceleration.
///
/// # Inputs
/// `fitted`: rows that may be used.
pub fn shaken(
    made_of: &Prediction,
    residual_m_s: &Triad,
    regimes: &[Regime],
    fitted: &[Range<usize>],
    scope: Scope,
) -> Vec<bool> {
    let plan = scope.plan;
    let measured: Vec<Option<[Vec<Level>; 3]>> = regimes
        .iter()
        .map(|regime| {
            let rows = intersect(std::slice::from_ref(&regime.rows), fitted);
            of_regime(made_of, residual_m_s, &rows, scope)
        })
        .collect();
    let quietest = |axis: usize, band: usize| {
        let levels = measured.iter().flatten().filter_map(|of| of[axis][band]);
        levels.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let all = measured.iter().flatten().flatten().flatten();
    let judged = all.flatten().count().max(1) as f64;
    let stands_out = |axis: usize, band: usize, level: Level| {
        let (Some((power, count)), Some((least, least_count))) = (level, quietest(axis, band))
        else {
            return false;
        };
        let ratio = power / least;
        let law = FisherSnedecor::new(count, least_count);
        // The quietest is one of all: Bonferroni factor.
        let chance = law.map_or(1.0, |law| judged * law.sf(ratio));
        ratio > plan.force.shaken_ratio && chance < plan.judgement.unexplained
    };
    let is_shaken = |of: &Option<[Vec<Level>; 3]>| {
        of.as_ref().is_some_and(|of| {
            (0..3).any(|axis| {
                let mut bands = of[axis].iter().enumerate();
                bands.any(|(band, level)| stands_out(axis, band, *level))
            })
        })
    };
    measured.iter().map(is_shaken).collect()
}

/// Residual power by axis and band in some rows, after a fit of all kinds.
fn of_regime(
    made_of: &Prediction,
    residual_m_s: &Triad,
    rows: &[Range<usize>],
    scope: Scope,
) -> Option<[Vec<Level>; 3]> {
    /// A delay is nonlinear: steps until its remainder is below the noise.
    const STEPS: usize = 3;
    let plan = scope.plan;
    let mut seen = vec![false; made_of.rows.count];
    for rows in rows {
        seen[rows.clone()].fill(true);
    }
    let observations = made_of.rows.bridged(&seen).ok()?;
    let levels = first_levels(residual_m_s, &observations);
    let mut delay_s = [0.0; 3];
    let mut step = 0;
    loop {
        step += 1;
        let mut pool = Pool::default();
        let without_expressions = Scope {
            left_out: &[scope.left_out, &[UNLISTED]].concat(),
            ..scope
        };
        let mut all = pool.candidates(made_of, delay_s, without_expressions);
        all.retain(|one| one.variant == Variant::Whole);
        let sums = equations(
            made_of,
            residual_m_s,
            &observations,
            &pool,
            NoiseLevels::mean(&levels),
        );
        let set: Vec<&Hypothesis> = all.iter().map(|one| &one.hypothesis).collect();
        let fit = evaluate(
            &sums,
            &set,
            &levels,
            &[Drift::None; 3],
            Effort::FULL,
            &plan.inference.search,
        );
        delay_s = delays_of(&all, &fit, plan.force.settled);
        if step < STEPS {
            continue;
        }
        let power = residual_power(&sums, &set, &fit);
        let bins = sums.basis.frequency.iter().zip(&sums.basis.counts);
        let in_band: Vec<Vec<usize>> = band_edges_hz(&plan.judgement.tiles)
            .windows(2)
            .map(|edges| {
                let bins = bins.clone().enumerate().filter(|(_, (share, _))| {
                    (edges[0]..edges[1]).contains(&(**share * made_of.rows.rate_hz))
                });
                bins.map(|(bin, _)| bin).collect()
            })
            .collect();
        let level = |axis: usize, of_band: &Vec<usize>| -> Level {
            let count: f64 = of_band.iter().map(|&bin| sums.basis.counts[bin]).sum();
            let sum: f64 = of_band.iter().map(|&bin| power[axis][bin]).sum();
            (count >= plan.force.fewest_in_band).then(|| (sum / count, count))
        };
        return Some([0, 1, 2].map(|axis: usize| {
            let bands = in_band.iter();
            bands.map(|of_band| level(axis, of_band)).collect()
        }));
    }
}

/// Delay of each accelerometer \[s\] in a fit of all kinds.
fn delays_of(all: &[Candidate], fit: &Fit, settled: f64) -> [f64; 3] {
    let mut delay_s = [0.0; 3];
    for (one, block) in all.iter().zip(&fit.blocks) {
        for (axis, estimate_s, std_s) in delays_in(one, block.start, fit) {
            delay_s[axis] = linearised_at(estimate_s, std_s, settled);
        }
    }
    delay_s
}
