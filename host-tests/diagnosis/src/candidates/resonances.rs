//! Soft mounts and resonant suspensions, by score tests on a basis of responses.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::families::ExactMount;
use rlg_catalogue::resonance::{CRITICAL, Resonance, grid};
use rlg_catalogue::resonance_basis::{Basis, MOUNT, MountColumns, SUSPENSION, SuspensionColumns};
use rlg_catalogue::{Pool, Signals};
use rlg_inference::score_test::{Gain, Projected, ScoreTest, spectra};
use rlg_inference::{Columns, NoiseLevels};
use rlg_plan::FamilyPlan;
use rlg_signal::streams::each_axis;

use super::scores::{Found, follow, most_at, worth};

/// Grid of resonances.
fn resonances(signals: &Signals, plan: &FamilyPlan) -> Vec<Resonance> {
    grid(
        plan.resonance_from_hz,
        plan.resonance_of_rate * signals.rate_hz,
        &signals.plan.grids,
    )
}

/// Selects the mount about each axis with the largest gain in log-likelihood at its full response.
pub(crate) fn mount(
    tests: &[ScoreTest],
    signals: &Signals,
    is_moving: [bool; 3],
    levels: &[NoiseLevels],
    plan: &FamilyPlan,
) -> Option<Found> {
    let grid = resonances(signals, plan);
    if grid.is_empty() {
        return None;
    }
    // Price of the grid and of two parameters, frequency and damping.
    let price = (grid.len() as f64).ln() + 1.0;
    let about = |axis: usize| -> Option<(Resonance, f64)> {
        if !is_moving[axis] {
            return None;
        }
        let basis = Basis::new(MOUNT, &grid, signals, &[axis], |hz| {
            levels[axis].of_share(hz / signals.rate_hz)
        });
        let columns = MountColumns {
            basis: &basis,
            signals,
            axis,
        };
        let hypothesis = columns.hypothesis();
        let spectra = spectra(tests, std::slice::from_ref(&hypothesis), &columns);
        let projected: Vec<_> = tests
            .iter()
            .map(|test| test.project(&hypothesis, &spectra))
            .collect();
        drop(spectra);
        let one = DVector::from_element(1, 1.0);
        let tops = basis.best(&grid, |sizes| {
            let sizes = DMatrix::from_column_slice(sizes.len(), 1, sizes.as_slice());
            let gains = projected.iter().map(|each| each.along(&sizes).at(&one));
            gains.fold(f64::NEG_INFINITY, f64::max)
        });
        let worthy = tops
            .into_iter()
            .take(plan.refined)
            .filter(|(_, gain)| *gain > price);
        worthy
            .map(|(resonance, _)| polish(tests, resonance, axis, signals))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, gain)| *gain > price)
    };
    let found = each_axis(about);
    let best = found.map(|one| one.map(|(resonance, _)| resonance));
    let sum = found.iter().flatten().map(|(_, gain)| gain - price).sum();
    if best == [None; 3] {
        return None;
    }
    let mut pool = Pool::default();
    let candidate = pool.mount(best, grid.len() as f64, signals);
    Some(Found {
        candidate,
        columns: pool.columns,
        surplus: sum,
    })
}

/// Refines a mount about an axis to its maximum likelihood (Gauss–Newton), given the best of the tests, with exact columns.
fn polish(
    tests: &[ScoreTest],
    begin: Resonance,
    axis: usize,
    signals: &Signals,
) -> (Resonance, f64) {
    let full = DVector::from_vec(vec![1.0, 0.0, 0.0]);
    let of = |resonance: Resonance| {
        let columns = ExactMount {
            resonance,
            signals,
            axis,
        };
        let same = DMatrix::identity(3, 3);
        most_at(tests, &columns.hypothesis(), &columns, &same, &full)
    };
    follow(begin, of, |resonance, step| Resonance {
        hz: (resonance.hz + step[0]).clamp(0.8 * resonance.hz, 1.25 * resonance.hz),
        damping: (resonance.damping + step[1])
            .clamp(0.4 * resonance.damping, 2.5 * resonance.damping)
            .min(CRITICAL),
    })
}

/// Selects the resonance of the suspensions with the largest gain, six flexures fitted with it.
pub(crate) fn suspension(
    tests: &[ScoreTest],
    signals: &Signals,
    levels: &[NoiseLevels],
    plan: &FamilyPlan,
) -> Option<Found> {
    let grid = resonances(signals, plan);
    if grid.is_empty() {
        return None;
    }
    let basis = Basis::new(SUSPENSION, &grid, signals, &[0, 1, 2], |hz| {
        levels
            .iter()
            .map(|levels| levels.of_share(hz / signals.rate_hz))
            .sum()
    });
    let directions = basis.directions();
    let by_gyro: [Vec<Projected>; 3] = each_axis(|gyro| {
        let columns = SuspensionColumns {
            basis: &basis,
            signals,
            gyro,
        };
        let hypothesis = columns.hypothesis();
        debug_assert_eq!(columns.count(), 2 * directions);
        let spectra = spectra(tests, std::slice::from_ref(&hypothesis), &columns);
        let each = tests.iter().map(|test| test.project(&hypothesis, &spectra));
        each.collect()
    });
    let of_point = |test: usize, sizes: &DVector<f64>| -> (f64, [f64; 6]) {
        let of_tilts = DMatrix::from_fn(2 * directions, 2, |row, tilt| {
            if row / directions == tilt {
                sizes[row % directions]
            } else {
                0.0
            }
        });
        let mut sum = 0.0;
        let mut k_s2 = [0.0; 6];
        for (gyro, projected) in by_gyro.iter().enumerate() {
            let gain = projected[test].along(&of_tilts).gain();
            sum += gain.log_likelihood;
            k_s2[2 * gyro..2 * gyro + 2].copy_from_slice(&gain.estimate);
        }
        (sum, k_s2)
    };
    let (test, (resonance, gain)) = (0..tests.len())
        .filter_map(|test| {
            let tops = basis.best(&grid, |sizes| of_point(test, sizes).0);
            Some((test, *tops.first()?))
        })
        .max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let (_, k_s2) = of_point(test, &basis.sizes(resonance));
    let mut pool = Pool::default();
    let candidate = pool.suspension(resonance, k_s2, grid.len() as f64, signals);
    let gain = Gain {
        log_likelihood: gain,
        estimate: Vec::new(),
    };
    let surplus = worth(&gain, &candidate.hypothesis);
    Some(Found {
        candidate,
        columns: pool.columns,
        surplus,
    })
}
