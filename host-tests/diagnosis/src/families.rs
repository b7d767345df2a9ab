//! Scans the families of the catalogue by score tests, and selects the strongest members of each for the search.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{HARMONIC, HIGH_PASS, LOCK_IN, MODE, UNLISTED};
use rlg_catalogue::families::{
    ExactHighPass, ExactLowPass, ExactMount, Family, OfOneGyro, expressions, harmonics,
    lines_about, time_constants_about,
};
use rlg_catalogue::high_pass::{self, HighPass};
use rlg_catalogue::low_pass::{self, LowPass};
use rlg_catalogue::resonance::{CRITICAL, Resonance, grid};
use rlg_catalogue::resonance_basis::{Basis, MOUNT, MountColumns, SUSPENSION, SuspensionColumns};
use rlg_catalogue::{Candidate, Pool, Sensed, Signals};
use rlg_inference::lines::strongest as strongest_line;
use rlg_inference::score_test::{Gain, Projected, ScoreTest, spectra};
use rlg_inference::{Columns, Fit, Hypothesis, NoiseLevels, Term};
use rlg_plan::{FamilyPlan, OddsPlan};
use rlg_signal::streams::each_axis;

use super::lock_in::lock_in;
use super::pass::{Begin, Pass, left_on};
use super::scores::{Coarse, Found, follow, most_at, size_price, tests, worth};
use super::windows;

/// Kinds similar to a resonant suspension well below its resonance.
const LIKE_A_MODE: [&str; 4] = [
    "axis_flexure",
    "axis_flexure_cubic",
    "elastic_rate_by_jerk",
    MODE,
];

/// Candidate with columns of its own.
pub(super) type Alone = (Candidate, Vec<Sensed>);

/// Selects the strongest members of every family, given each of `fits`.
pub(super) fn strongest(pass: &Pass, fits: &[&Fit], begin: &Begin) -> Vec<Alone> {
    let signals = &pass.motion.signals;
    let is_moving = pass.motion.is_moving;
    let mut found = Vec::new();
    let levels = &fits[0].levels;
    let all = tests(pass, fits, &|_| true);
    let plan = &begin.plan.rates.families;
    found.extend(mount(&all, signals, is_moving, levels, plan));
    let longest_s = begin.plan.rates.coarse.longest_low_pass_s;
    found.extend(low_pass(&all, signals, is_moving, longest_s));
    if begin.seeks(HIGH_PASS) {
        found.extend(high_pass(&all, signals, is_moving));
    }
    drop(all);
    let unbent = |kind: &str| !LIKE_A_MODE.contains(&kind);
    if begin.seeks(MODE) {
        found.extend(suspension(
            &tests(pass, fits, &unbent),
            signals,
            levels,
            plan,
        ));
    }
    if ![HARMONIC, LOCK_IN, UNLISTED]
        .iter()
        .any(|kind| begin.seeks(kind))
    {
        return likely(pass, found, begin);
    }
    let coarse = Coarse::new(pass, plan);
    let tests = coarse.tests(pass, fits);
    for family in [
        harmonics(signals, is_moving),
        expressions(signals, is_moving, &pass.candidates, &pass.pool),
    ] {
        found.extend(ranked(&tests, family, &coarse, signals, plan));
    }
    found.extend(windows::strongest(
        pass,
        fits,
        &coarse,
        &begin.plan.rates.window,
    ));
    found.extend(lock_in(pass, fits, &tests, &coarse, begin.plan));
    let mut lines = Vec::new();
    for gyro in (0..3).filter(|_| begin.seeks(UNLISTED)) {
        lines.extend(line(pass, fits[0], gyro, &tests, &coarse, begin));
    }
    likely(pass, found, begin)
        .into_iter()
        .chain(lines)
        .collect()
}

/// Selects the strongest soft mount and the strongest low passes, given a fit.
pub(super) fn strongest_filters(pass: &Pass, fit: &Fit, begin: &Begin) -> Vec<Alone> {
    let tests = tests(pass, &[fit], &|_| true);
    let motion = &pass.motion;
    let (signals, is_moving) = (&motion.signals, motion.is_moving);
    let plan = &begin.plan.rates;
    let found = mount(&tests, signals, is_moving, &fit.levels, &plan.families).into_iter();
    let longest_s = plan.coarse.longest_low_pass_s;
    let found = found.chain(low_pass(&tests, signals, is_moving, longest_s));
    likely(pass, found.collect(), begin)
}

/// Candidates that are new and worth a fit.
fn likely(pass: &Pass, found: Vec<Found>, begin: &Begin) -> Vec<Alone> {
    let is_new = |one: &Found| {
        let mut known = pass.candidates.iter();
        !known
            .any(|other| other.kind == one.candidate.kind && other.variant == one.candidate.variant)
    };
    found
        .into_iter()
        .filter(|one| begin.seeks(one.candidate.kind))
        .filter(|one| one.surplus > begin.least() && is_new(one))
        .map(|one| (one.candidate, one.columns))
        .collect()
}

/// Members of a family, the strongest first, their time constants refined.
fn ranked(
    tests: &[ScoreTest],
    family: Family,
    coarse: &Coarse,
    signals: &Signals,
    plan: &FamilyPlan,
) -> Vec<Found> {
    let mut all = measured(tests, &family, coarse, signals);
    all.sort_by(|a, b| b.surplus.total_cmp(&a.surplus));
    all.truncate(plan.strongest);
    for one in &mut all {
        let Variant::Expression { axis, expression } = one.candidate.variant else {
            continue;
        };
        let finer = time_constants_about(expression, axis, signals);
        let best = measured(tests, &finer, coarse, signals)
            .into_iter()
            .max_by(|a, b| a.surplus.total_cmp(&b.surplus));
        if let Some(mut best) = best {
            best.candidate.hypothesis.price = one.candidate.hypothesis.price;
            best.surplus -= best.candidate.hypothesis.price;
            if best.surplus > one.surplus {
                *one = best;
            }
        }
    }
    all
}

fn measured(
    tests: &[ScoreTest],
    family: &Family,
    coarse: &Coarse,
    signals: &Signals,
) -> Vec<Found> {
    let groups: Vec<Vec<Hypothesis>> = family
        .groups
        .iter()
        .map(|group| group.iter().map(|one| one.hypothesis.clone()).collect())
        .collect();
    let all = coarse.worths(tests, &groups, &family.pool, signals);
    let each = family
        .groups
        .iter()
        .flatten()
        .zip(all.into_iter().flatten());
    each.filter(|(_, surplus)| *surplus > f64::NEG_INFINITY)
        .map(|(candidate, surplus)| {
            // A pool of the candidate's own columns only.
            let mut pool = Pool::default();
            Found {
                candidate: pool.adopt(candidate, &family.pool.columns),
                columns: pool.columns,
                surplus,
            }
        })
        .collect()
}

/// Grid of resonances.
fn resonances(signals: &Signals, plan: &FamilyPlan) -> Vec<Resonance> {
    grid(
        plan.resonance_from_hz,
        plan.resonance_of_rate * signals.rate_hz,
    )
}

/// Selects the mount about each axis with the largest gain in log-likelihood at its full response.
fn mount(
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
            .take(TOPS)
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

/// Selects the low pass on each gyro with the largest gain at its full response, of time constants up to `longest_s`.
fn low_pass(
    tests: &[ScoreTest],
    signals: &Signals,
    is_moving: [bool; 3],
    longest_s: f64,
) -> Option<Found> {
    let grid = low_pass::grid(signals.period_s(), longest_s);
    let grid: Vec<f64> = grid.iter().map(|one| one.time_s).collect();
    let exact = |gyro: usize, time_s: f64| ExactLowPass {
        low_pass: LowPass { time_s },
        signals,
        gyro,
    };
    let odds = &signals.plan.odds;
    let (best, of) = filters(tests, &grid, is_moving, exact, odds)?;
    let mut pool = Pool::default();
    let best = best.map(|one| one.map(|time_s| LowPass { time_s }));
    let candidate = pool.low_pass(best, of.price.exp(), signals);
    Some(of.found(candidate, pool))
}

/// Selects the high pass on each gyro with the largest gain at its full response.
fn high_pass(tests: &[ScoreTest], signals: &Signals, is_moving: [bool; 3]) -> Option<Found> {
    let grid = high_pass::grid(signals.period_s(), signals.rows);
    let grid: Vec<f64> = grid.iter().map(|one| one.time_s).collect();
    let exact = |gyro: usize, time_s: f64| ExactHighPass {
        high_pass: HighPass { time_s },
        signals,
        gyro,
    };
    let odds = &signals.plan.odds;
    let (best, of) = filters(tests, &grid, is_moving, exact, odds)?;
    let mut pool = Pool::default();
    let best = best.map(|one| one.map(|time_s| HighPass { time_s }));
    let candidate = pool.high_pass(best, of.price.exp(), signals);
    Some(of.found(candidate, pool))
}

/// Gain of filters on some gyros, and the price of their sizes and grid.
struct Priced {
    gain: f64,
    price: f64,
}

impl Priced {
    fn found(self, candidate: Candidate, pool: Pool) -> Found {
        Found {
            surplus: self.gain - candidate.hypothesis.price,
            candidate,
            columns: pool.columns,
        }
    }
}

/// Selects the time constant of a filter on each gyro with the largest gain at its full response, from a grid.
fn filters<T: OfOneGyro>(
    tests: &[ScoreTest],
    grid: &[f64],
    is_moving: [bool; 3],
    exact: impl Fn(usize, f64) -> T + Sync,
    odds: &OddsPlan,
) -> Option<([Option<f64>; 3], Priced)> {
    let places = (grid.len() as f64).ln();
    let on = |gyro: usize| -> Option<(f64, f64)> {
        if !is_moving[gyro] {
            return None;
        }
        let full = DVector::from_vec(vec![1.0, 0.0]);
        let both = DMatrix::identity(2, 2);
        let of = |time_s: f64| {
            let columns = exact(gyro, time_s);
            most_at(tests, &columns.hypothesis(), &columns, &both, &full)
        };
        let (one, response) = (DVector::from_element(1, 1.0), DMatrix::identity(1, 1));
        let gain = |time_s: f64| {
            let columns = exact(gyro, time_s);
            let found = most_at(tests, &columns.of_response(), &columns, &response, &one);
            found.map_or(f64::NEG_INFINITY, |(gain, _)| gain)
        };
        let begin = grid
            .iter()
            .map(|time_s| (*time_s, gain(*time_s)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        // Even with free size and time constant the gain is below the price of the grid.
        let (_, about) = of(begin.0)?;
        if about.gain().log_likelihood < places {
            return None;
        }
        Some(follow(begin.0, of, |time_s, step| {
            (time_s + step[0]).clamp(0.6 * time_s, 1.7 * time_s)
        }))
    };
    let mut of_all = Priced {
        gain: 0.0,
        price: places,
    };
    let mut best: [Option<f64>; 3] = [None; 3];
    for (gyro, found) in each_axis(on).into_iter().enumerate() {
        let Some((time_s, gain)) = found else {
            continue;
        };
        // Its columns are linearised about its estimate, so its size is priced here.
        let of_size = size_price(2.0 * gain);
        if gain > places + of_size {
            best[gyro] = Some(time_s);
            of_all.gain += gain - of_size;
            of_all.price += of_size;
        }
    }
    of_all.price += match best.iter().flatten().count() {
        0 => return None,
        3 => odds.shared.ln(),
        _ => odds.one_axis.ln(),
    };
    Some((best, of_all))
}

/// Sine and cosine of the strongest line in the residual of a gyro, if both together are worth a fit.
fn line(
    pass: &Pass,
    fit: &Fit,
    gyro: usize,
    tests: &[ScoreTest],
    coarse: &Coarse,
    begin: &Begin,
) -> Vec<Alone> {
    let signals = &pass.motion.signals;
    let residual = left_on(&pass.equations, fit, &pass.candidates, gyro);
    let rows = pass.equations.transform.observations().spans[0].rows.len();
    let Some(line) = strongest_line(&residual, rows, &begin.plan.inference.lines) else {
        return Vec::new();
    };
    // Relative to the neighbouring power, not the fitted noise: coloured noise is no line. The median of a pair is 2 ln 2.
    let local = line.ratio * std::f64::consts::LN_2 - (3.0 * rows as f64).ln();
    if local < begin.least() {
        return Vec::new();
    }
    let about = lines_about(line.share * signals.rate_hz, gyro, signals);
    // Sine and cosine share one frequency, that of the largest joint gain, whatever the phase.
    let both = |pair: &[Candidate]| -> Hypothesis {
        let parts = pair.iter().enumerate().flat_map(|(parameter, one)| {
            let terms = one.hypothesis.terms.iter();
            terms.map(move |term| Term { parameter, ..*term })
        });
        Hypothesis {
            price: pair[0].hypothesis.price,
            ..Hypothesis::of_terms(pair.len(), parts.collect())
        }
    };
    let waves: Vec<Vec<Hypothesis>> = about.groups.iter().map(|pair| vec![both(pair)]).collect();
    let worths = coarse.worths(tests, &waves, &about.pool, signals);
    let best = (0..waves.len()).max_by(|&a, &b| worths[a][0].total_cmp(&worths[b][0]));
    match best {
        Some(best) if worths[best][0] > begin.least() => {
            let pair = about.groups[best].iter();
            pair.map(|one| {
                let mut pool = Pool::default();
                (pool.adopt(one, &about.pool.columns), pool.columns)
            })
            .collect()
        }
        _ => Vec::new(),
    }
}

/// Number of maxima of a grid refined with exact columns.
const TOPS: usize = 3;

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
fn suspension(
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
