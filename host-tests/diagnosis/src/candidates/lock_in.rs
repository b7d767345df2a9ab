//! Lock-in of undithered gyros, as a candidate for the search.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::lock_in::{Part, Threshold};
use rlg_catalogue::{Candidate, Column, Pool, Signals};
use rlg_inference::events::impulse_scores;
use rlg_inference::score_test::ScoreTest;
use rlg_inference::{Fit, Hypothesis, NormalEquations, Term};
use rlg_plan::Plan;

use super::scores::{Coarse, Found, follow, most_at, tests};
use crate::iteration::pass::Pass;
use crate::rows::data::Data;
use rlg_findings::sentences::DEG_H;
use rlg_signal::streams::AXES;

/// Selects the threshold of each gyro with the largest gain, given the fits; none on dithered gyros, where lock-in is a
/// random walk.
///
/// # Inputs
/// `over_sums`: score tests of the fits over `coarse`.
pub(crate) fn lock_in(
    pass: &Pass,
    fits: &[&Fit],
    over_sums: &[ScoreTest],
    coarse: &Coarse,
    plan: &Plan,
) -> Option<Found> {
    let signals = &pass.motion.signals;
    if signals.dither_rad.is_some() {
        return None;
    }
    let counted = plan.judgement.lattice.counted_share;
    let [smallest, largest] = plan.rates.lock_in.range_rad_s;
    let mut thresholds = [None; 3];
    let mut surplus = 0.0;
    let mut places: f64 = 1.0;
    let mut exact = None;
    for gyro in (0..3).filter(|&axis| pass.motion.is_moving[axis]) {
        // A dead band within the noise of the rate would consist of noise alone.
        let clear = plan.signal.gate.ratio.sqrt() * pass.motion.rate_noise_rad_s[gyro];
        // Rounding of single increments alone makes a dead band of half a unit.
        let unit_rad = pass.lattice.counted_rad[gyro];
        let is_rounded = fits[0].levels[gyro].angle < counted * unit_rad * unit_rad / 12.0;
        let unit_rad = if is_rounded { unit_rad } else { 0.0 };
        let rounded = plan.rates.lock_in.rounded_units * unit_rad * signals.rate_hz;
        let least = smallest.max(clear).max(rounded);
        let grid = Threshold::grid(least, largest, &plan.catalogue.grids);
        if grid.is_empty() {
            continue;
        }
        places = places.max(grid.len() as f64);
        // Price of the grid and of one parameter, the threshold.
        let price = (grid.len() as f64).ln() + 0.5;
        let Some(begin) = strongest(over_sums, coarse, gyro, &grid, signals) else {
            continue;
        };
        let exact = exact.get_or_insert_with(|| tests(pass, fits, &|_| true));
        let (threshold, gain) = follow(
            begin,
            |threshold| {
                let mut pool = Pool::default();
                let mut of_gyro = [None; 3];
                of_gyro[gyro] = Some(threshold);
                let candidate = pool.lock_in(of_gyro, 1.0, signals);
                let columns = PoolColumns {
                    columns: &pool.columns,
                    signals,
                };
                // The dead band first, its derivative after it.
                let swapped = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]);
                let full = DVector::from_vec(vec![1.0, 0.0]);
                let whole = candidate.hypothesis.with_fixed_as_parameter();
                most_at(exact, &whole, &columns, &swapped, &full)
            },
            |threshold, step| Threshold {
                rad_s: (threshold.rad_s + step[0])
                    .clamp(threshold.rad_s / 1.25, threshold.rad_s * 1.25)
                    .clamp(least, largest),
            },
        );
        // A threshold at the lower bound is not identifiable.
        if gain > price && threshold.rad_s > least {
            thresholds[gyro] = Some(threshold);
            surplus += gain - price;
        }
    }
    if thresholds == [None; 3] {
        return None;
    }
    let mut pool = Pool::default();
    let candidate = pool.lock_in(thresholds, places, signals);
    Some(Found {
        candidate,
        columns: pool.columns,
        surplus,
    })
}

/// Sentence on the thresholds whose lock-in would cause a random walk of dithered gyros; `None` without one.
///
/// # Inputs
/// `walk_rad_sqrt_s`: excess random walk of each gyro; 0 for none.
pub(crate) fn behind_walk(walk_rad_sqrt_s: [f64; 3], data: &Data) -> Option<String> {
    let dither_rad = data.dither_rad.as_ref()?;
    let of_gyro = |axis: usize| {
        let walk = walk_rad_sqrt_s[axis];
        let pulse_rad = data.streams.pulse_rad[axis];
        if walk <= 0.0 || pulse_rad <= 0.0 {
            return None;
        }
        let rows = dither_rad[axis].len().max(1) as f64;
        let square: f64 = dither_rad[axis].iter().map(|step| step * step).sum();
        let peak_rad_s = (2.0 * square / rows).sqrt() * data.streams.rate_hz;
        let threshold = threshold_rad_s(walk, pulse_rad, peak_rad_s) * DEG_H;
        Some(format!("{} {threshold:.0} °/h", AXES[axis]))
    };
    let all: Vec<String> = (0..3).filter_map(of_gyro).collect();
    (!all.is_empty()).then(|| {
        format!(
            " If caused by lock-in, N = Omega_L / sqrt(S Omega_D) with the dithers' peak rates gives thresholds of {}.",
            all.join(", ")
        )
    })
}

/// Threshold \[rad/s\] whose lock-in causes a random walk N under a dither of a peak rate Ω_D: Ω_L = N √(S Ω_D), S = 2π a
/// pulse (physics, what lock-in leaves).
fn threshold_rad_s(walk_rad_sqrt_s: f64, pulse_rad: f64, dither_peak_rad_s: f64) -> f64 {
    walk_rad_sqrt_s * (std::f64::consts::TAU / pulse_rad * dither_peak_rad_s).sqrt()
}

/// Random angles of the stops in a dead band, up to half a pulse either way, not covered by the noise of the likelihood.
pub(crate) struct Stops<'a> {
    pub(crate) data: &'a Data<'a>,
    pub(crate) signals: &'a Signals,
    /// Normal equations of the fitted thresholds.
    pub(crate) equations: &'a NormalEquations,
}

impl Stops<'_> {
    /// Adds the variance by the stops to the thresholds of `candidate`, whose parameters begin at `first` in `fit`, in the
    /// covariance.
    ///
    /// # Inputs
    /// `pool`: columns of the candidate.
    pub(crate) fn widen(&self, candidate: &Candidate, pool: &Pool, fit: &mut Fit, first: usize) {
        for term in &candidate.hypothesis.terms {
            let Column::LockIn(gyro, threshold, _) = pool.columns[term.column].column else {
                continue;
            };
            let at = first + term.parameter;
            let beat_rad = self.data.model.gyro.pulse_weight_rad[gyro];
            let pulse_rad = beat_rad.max(self.data.lattice.counted_rad[gyro]);
            let transform = &self.equations.transform;
            let spectrum = transform.spectrum(&pool.columns[term.column].values(self.signals));
            let basis = &self.equations.basis;
            let (influence, _) = impulse_scores(transform, basis, &spectrum, fit.levels[gyro]);
            let of_stop = |row: usize| {
                let moved = term.coefficient * influence[row] * fit.covariance[(at, at)];
                moved * moved * pulse_rad * pulse_rad / 12.0
            };
            let stops = threshold.stops(gyro, self.signals);
            let variance: f64 = stops.into_iter().map(of_stop).sum();
            fit.covariance[(at, at)] += variance;
        }
    }
}

/// Selects the threshold of a grid whose dead band has the largest gain, with free depth.
fn strongest(
    tests: &[ScoreTest],
    coarse: &Coarse,
    gyro: usize,
    grid: &[Threshold],
    signals: &Signals,
) -> Option<Threshold> {
    let mut pool = Pool::default();
    let groups: Vec<Vec<Hypothesis>> = grid
        .iter()
        .map(|&threshold| {
            let term = Term {
                parameter: 0,
                record: gyro,
                column: pool.tried(
                    Column::LockIn(gyro, threshold, Part::Missing),
                    gyro,
                    signals,
                ),
                coefficient: 1.0,
            };
            vec![Hypothesis::of_terms(1, vec![term])]
        })
        .collect();
    let worths = coarse.worths(tests, &groups, &pool, signals);
    let best = (0..grid.len()).max_by(|&a, &b| worths[a][0].total_cmp(&worths[b][0]))?;
    (worths[best][0] > 0.0).then_some(grid[best])
}
