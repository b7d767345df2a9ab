//! Scans the families of the catalogue by score tests, and selects the strongest members of each for the search.

use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{HARMONIC, HIGH_PASS, LOCK_IN, MODE, UNLISTED};
use rlg_catalogue::families::{Family, expressions, harmonics, lines_about, time_constants_about};
use rlg_catalogue::{Candidate, Pool, Sensed, Signals};
use rlg_inference::lines::strongest as strongest_line;
use rlg_inference::score_test::ScoreTest;
use rlg_inference::{Fit, Hypothesis, Term};
use rlg_plan::FamilyPlan;

use super::filters::{high_pass, low_pass};
use super::lock_in::lock_in;
use super::resonances::{mount, suspension};
use super::scores::{Coarse, Found, tests};
use super::windows;
use crate::iteration::pass::{Begin, Pass, left_on};

/// Kinds similar to a resonant suspension well below its resonance.
const LIKE_A_MODE: [&str; 4] = [
    "axis_flexure",
    "axis_flexure_cubic",
    "elastic_rate_by_jerk",
    MODE,
];

/// Candidate with columns of its own.
pub(crate) type Alone = (Candidate, Vec<Sensed>);

/// Selects the strongest members of every family, given each of `fits`.
pub(crate) fn strongest(pass: &Pass, fits: &[&Fit], begin: &Begin) -> Vec<Alone> {
    let signals = &pass.motion.signals;
    let is_moving = pass.motion.is_moving;
    let mut found = Vec::new();
    let levels = &fits[0].levels;
    let all = tests(pass, fits, &|_| true);
    let plan = &begin.plan.rates.families;
    if !tried_filters(pass, fits) {
        found.extend(mount(&all, signals, is_moving, levels, plan));
        let longest_s = begin.plan.rates.coarse.longest_low_pass_s;
        found.extend(low_pass(&all, signals, is_moving, longest_s));
    }
    if begin.seeks(HIGH_PASS) {
        found.extend(high_pass(&all, signals, is_moving));
    }
    let unbent = |kind: &str| !LIKE_A_MODE.contains(&kind);
    let mut members = fits.iter().flat_map(|fit| &fit.members);
    let of_unbent = if members.all(|&place| unbent(pass.candidates[place].kind)) {
        all
    } else {
        drop(all);
        tests(pass, fits, &unbent)
    };
    if begin.seeks(MODE) {
        found.extend(suspension(&of_unbent, signals, levels, plan));
    }
    drop(of_unbent);
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

/// True if [`strongest_filters`] of this pass has tried mounts and low passes given the same fit: it would try the same again.
fn tried_filters(pass: &Pass, fits: &[&Fit]) -> bool {
    let is_the_same = |fit: &Fit| {
        let tried = pass.tried_filters.as_ref();
        fit.members.is_empty() && tried.is_some_and(|levels| *levels == fit.levels)
    };
    fits.iter().all(|fit| is_the_same(fit))
}

/// Selects the strongest soft mount and the strongest low passes, given a fit.
pub(crate) fn strongest_filters(pass: &Pass, fit: &Fit, begin: &Begin) -> Vec<Alone> {
    let motion = &pass.motion;
    let (signals, is_moving) = (&motion.signals, motion.is_moving);
    if is_moving == [false; 3] {
        return Vec::new();
    }
    let tests = tests(pass, &[fit], &|_| true);
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
    if line.surplus(3.0 * rows as f64) < begin.least() {
        return Vec::new();
    }
    let finer = coarse.for_line(pass, line.share);
    let tests_of_finer = finer.as_ref().map(|finer| finer.tests(pass, &[fit]));
    let (coarse, tests) = match (&finer, &tests_of_finer) {
        (Some(finer), Some(tests)) => (finer, &tests[..]),
        _ => (coarse, tests),
    };
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
    let mut hz = line.share * signals.rate_hz;
    let mut found = Vec::new();
    // A strong line defines its frequency far within the inverse record length: what a coarse one leaves would be another line.
    for step in [0.1, 0.01, 0.001] {
        let about = lines_about(hz, step, gyro, signals);
        let waves: Vec<Vec<Hypothesis>> =
            about.groups.iter().map(|pair| vec![both(pair)]).collect();
        let worths = coarse.worths(tests, &waves, &about.pool, signals);
        let best = (0..waves.len()).max_by(|&a, &b| worths[a][0].total_cmp(&worths[b][0]));
        let Some(best) = best.filter(|best| worths[*best][0] > begin.least()) else {
            break;
        };
        let pair = &about.groups[best];
        if let Variant::Expression { expression, .. } = pair[0].variant {
            hz = expression.wave_hz().unwrap_or(hz);
        }
        let alone = pair.iter().map(|one| {
            let mut pool = Pool::default();
            (pool.adopt(one, &about.pool.columns), pool.columns)
        });
        found = alone.collect();
    }
    found
}
