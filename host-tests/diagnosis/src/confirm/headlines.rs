//! Candidate that names a member of a found set, and the instants of steps.

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{STEP, UNLISTED};
use rlg_inference::change_point::Instant;
use rlg_inference::judgement::Judged;
use rlg_inference::transform::Transform;
use rlg_inference::{Bound, Fit, Hypothesis, NoiseBasis, NoiseLevels};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, add};

use crate::confirm::sharing::{RECORDS, Shared, in_recording, with_noise_of};
use crate::confirm::together::Together;
use crate::rows::data::Data;
use crate::search::structure::{Found, effect_rad, left_by};

/// Candidate with the fewest free parameters among a member and its rivals; of an expression, also among the rivals with
/// more parameters that explain as much.
pub(super) fn headline(judged: &Judged, reached_by: &[usize], all: &[Candidate]) -> usize {
    let own = judged.hypothesis;
    let rivals = || judged.rivals.iter().map(|(rival, _)| *rival);
    // Equal sizes of three gyros are a coincidence, unless one gyro alone explains as much.
    let is_coincidence = |one: &Candidate| {
        let of_one_gyro = |other: usize| {
            all[other].kind == one.kind && matches!(all[other].variant, Variant::Axis(_))
        };
        one.variant == Variant::Common && !rivals().chain([own]).any(of_one_gyro)
    };
    // A listed effect has precedence over an expression, and an effect of one parameter over a coincidence.
    let rank = |candidate: usize| {
        let one = &all[candidate];
        let parameters = one.hypothesis.parameters;
        (one.kind == UNLISTED, parameters, is_coincidence(one))
    };
    let spanning = reached_by.iter().filter(|_| all[own].kind == UNLISTED);
    let simplest = rivals().chain(spanning.copied()).fold(own, |best, rival| {
        if rank(rival) < rank(best) {
            rival
        } else {
            best
        }
    });
    // Of two candidates on the same columns the gyro's has precedence, as in the catalogue.
    let is_as_simple = |&other: &usize| {
        rank(other) <= rank(simplest)
            && is_same_column(&all[other].hypothesis, &all[simplest].hypothesis)
    };
    (0..simplest).find(is_as_simple).unwrap_or(simplest)
}

/// True if two hypotheses with parameters of any sign scale the same columns into the same records, about the same point.
fn is_same_column(a: &Hypothesis, b: &Hypothesis) -> bool {
    let is_free = |one: &Hypothesis| {
        let mut ranges = (0..one.parameters).map(|k| one.bound(k).range);
        ranges.all(|range| range == Bound::NONE.range)
    };
    let places = |one: &Hypothesis| -> Vec<(usize, usize, usize)> {
        let terms = one.terms.iter();
        let mut places: Vec<_> = terms
            .map(|term| (term.parameter, term.record, term.column))
            .collect();
        places.sort_unstable();
        places
    };
    is_free(a) && is_free(b) && a.fixed == b.fixed && places(a) == places(b)
}

/// Moves every step among the headlines to its mean instant.
///
/// # Returns
/// Standard deviation of each headline's instant \[rows\], where it has one.
pub(super) fn settle_instants(
    each: &[Data],
    together: &mut Together,
    headlines: &mut [usize],
    fit: &Fit,
) -> Vec<Option<f64>> {
    let mut std_rows = vec![None; headlines.len()];
    for (recording, data) in each.iter().enumerate() {
        let is_here = |one: &Shared| one.candidate.kind == STEP && one.own[recording].is_some();
        let mut steps = headlines.iter().map(|&place| &together.shared[place]);
        if !steps.any(is_here) {
            continue;
        }
        let fit = with_noise_of(fit, recording);
        let mut own = headlines.to_vec();
        let of_own = settle_in_recording(data, &mut together.found[recording], &mut own, &fit);
        for (place, (headline, std)) in own.into_iter().zip(of_own).enumerate() {
            if std.is_none() || !is_here(&together.shared[headlines[place]]) {
                continue;
            }
            let mut moved = together.shared[headlines[place]].clone();
            let step = together.found[recording].candidates[headline].clone();
            let mut hypothesis = step.hypothesis.clone();
            hypothesis
                .terms
                .iter_mut()
                .for_each(|term| term.record += recording * RECORDS);
            moved.candidate = Candidate { hypothesis, ..step };
            headlines[place] = together.shared.len();
            together.shared.push(moved);
            std_rows[place] = std;
        }
        for (other, own) in together.found.iter_mut().enumerate() {
            own.candidates = in_recording(&together.shared, other);
        }
    }
    std_rows
}

/// Moves every step of one recording among the `headlines` to the posterior mean of its instant on the rows to fit.
///
/// # Returns
/// Standard deviation of each headline's instant \[rows\], where it has one.
fn settle_in_recording(
    data: &Data,
    found: &mut Found,
    headlines: &mut [usize],
    fit: &Fit,
) -> Vec<Option<f64>> {
    let Ok(observations) = data.observed(&data.rows_of(&[Use::Fit])) else {
        return vec![None; headlines.len()];
    };
    let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(&fit.levels));
    let left_rad = left_by(found, fit);
    let mut std_rows = Vec::with_capacity(headlines.len());
    for (place, headline) in headlines.iter_mut().enumerate() {
        let known = instant(found, fit, place, &left_rad, (&transform, &basis));
        std_rows.push(known.map(|(axis, _, instant)| {
            let places = found.candidates[*headline].hypothesis.price.exp();
            let signals = &found.motion.signals;
            let step = found.pool.event(STEP, axis, instant.row(), places, signals);
            *headline = found.candidates.len();
            found.candidates.push(step);
            instant.std_rows()
        }));
    }
    std_rows
}

/// Estimates the instant of a member of a fit if it is a step: its gyro, the residual of the other members there \[rad\] and
/// the instant (change point) on the rows of a transform.
fn instant(
    found: &Found,
    fit: &Fit,
    place: usize,
    left_rad: &Triad,
    (transform, basis): (&Transform, &NoiseBasis),
) -> Option<(usize, Vec<f64>, Instant)> {
    let candidate = &found.candidates[fit.members[place]];
    let Variant::Event { axis, row } = candidate.variant else {
        return None;
    };
    if candidate.kind != STEP {
        return None;
    }
    let mut with_rad = left_rad[axis].clone();
    add(&mut with_rad, &effect_rad(found, fit, place)[axis], 1.0);
    let around = (row, fit.squared_sizes[place].sqrt());
    let levels = fit.levels[axis];
    let instant = Instant::around(transform, basis, levels, &with_rad, around);
    Some((axis, with_rad, instant))
}
