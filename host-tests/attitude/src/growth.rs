//! How a registration grows: from nothing, groups join beside those that stand.
//!
//! Where a motion hardly tells two groups apart (a cone of one tone: a delay and a turn about its axis), rows that are linear about
//! the one say little of the other: each is grown from by itself, and the simplest that explains as much stands.

use nalgebra::Vector3;

use crate::alignment::{Alignment, Free, GROUPS, in_order, places};
use crate::coarse::Start;
use crate::registration::{Records, Registration, Steps, fitted, places_of, settle};

/// What a record calls for about an alignment.
pub(crate) struct Called {
    /// Groups, in the order of their columns.
    pub(crate) free: Free,
    /// The step to their numbers.
    pub(crate) step: Steps,
    /// Sets that would have done nearly as well so far.
    pub(crate) nearly: Vec<Free>,
}

/// Grows registrations of one record.
pub(crate) struct Growth<'a> {
    /// The record.
    pub(crate) of: Records<'a>,
    /// What the model says.
    pub(crate) model: &'a Alignment,
    /// Delay and rotation far off.
    pub(crate) start: &'a Start,
    /// What is called for beside a registration.
    pub(crate) called_for: &'a dyn Fn(&Registration) -> Called,
    /// Log likelihood within which two explain as much.
    pub(crate) alike_within: f64,
    /// Told of each step.
    pub(crate) progress: &'a dyn Fn(&str),
}

/// A registration and its groups.
type Grown = (Registration, Free);

impl Growth<'_> {
    /// Aligns the reference with the gyros: groups that are called for join until those no longer change. What is not called for
    /// stays as the model has it: two numbers that the motion cannot tell apart would cancel each other far from where any of
    /// this is linear.
    pub(crate) fn grow(&self) -> Option<Grown> {
        let Self { of, model, .. } = *self;
        let (gyros, samples, _) = of;
        // Far off, an error of the gyros looks like one of the reference, but beside all numbers.
        let all: Free = GROUPS.iter().map(|group| group.kind).collect();
        let far = self.start.of(&all, model);
        let known = settle(of, (model, far.clone(), &all), true, self.progress)?.known;
        // What is far off is seen from where the model stands, too; noise alone may be most alike anywhere.
        let of_known = (gyros, samples, &known);
        let none = Free::new();
        let at_model = settle(
            of_known,
            (model, model.clone(), &none),
            false,
            self.progress,
        )?;
        let called = (self.called_for)(&at_model.weighed(gyros, model));
        let is_off = !called.free.is_empty();
        let start = if is_off { far } else { model.clone() };
        let mut grown = vec![self.from(of_known, start, none, &[])?];
        for free in called.nearly {
            let start = self.start.of(&free, model);
            let again = self.from(of_known, start, free, &grown);
            grown.extend(again.filter(|again| grown.iter().all(|one| !is_same(one, again))));
        }
        let grown = grown.into_iter();
        let contenders: Vec<Grown> = grown.flat_map(|one| self.as_low_pass(one)).collect();
        let (chosen, free) = simplest(contenders, self.alike_within)?;
        Some(match chosen.alignment.low_pass_s {
            Some(_) => (chosen.weighed(gyros, model), free),
            None => (chosen, free),
        })
    }

    /// Grows from some groups; `None` where that leads to one of `others` again.
    fn from(
        &self,
        of_known: Records,
        mut start: Alignment,
        mut free: Free,
        others: &[Grown],
    ) -> Option<Grown> {
        /// Most rounds.
        const ROUNDS: usize = 8;
        let Self { of, model, .. } = *self;
        let mut round = 0;
        loop {
            let has_faults = round > 0;
            let of_round = if has_faults { of } else { of_known };
            let about = (model, start, &free);
            let registered = settle(of_round, about, has_faults, self.progress)?;
            let registered = registered.weighed(of.0, model);
            let Called {
                free: now, step, ..
            } = (self.called_for)(&registered);
            round += 1;
            if round == ROUNDS || (has_faults && now == free) {
                return Some((registered, free));
            }
            let moved = registered.alignment.with(&now, model);
            (start, free) = (moved.moved(&step.estimate), now);
            let is_there =
                |(other, of): &Grown| *of == free && step.lead_to(&start, &other.alignment);
            if others.iter().any(is_there) {
                return None;
            }
        }
    }

    /// The same, and as a filter that is too long for its second order: a low pass, with a delay beside it or without.
    fn as_low_pass(&self, grown: Grown) -> Vec<Grown> {
        let (found, free) = &grown;
        if !found.may_be_low_pass(self.model) {
            return vec![grown];
        }
        let settled = |delay: bool| {
            let others = free.iter().copied();
            let others = others.filter(|kind| delay || *kind != "reference_delay");
            let free = in_order(others.chain(std::iter::once("gyro_bandwidth")));
            let start = self.low_pass_start(found, &free)?;
            let about = (self.model, start, &free);
            Some((settle(self.of, about, true, self.progress)?, free))
        };
        let low_passes = [settled(false), settled(true)];
        std::iter::once(grown)
            .chain(low_passes.into_iter().flatten())
            .collect()
    }

    /// Where a low pass is linear about: its likeliest time constant, found globally, for far from it what vibration rectifies to
    /// is not linear. Beside a delay both together are as late as `found`.
    fn low_pass_start(&self, found: &Registration, free: &Free) -> Option<Alignment> {
        /// Time constants that are tried, as shares of how late the gyros are.
        const SHARES: [f64; 11] = [0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0];
        let Self { of, model, .. } = *self;
        let of_known = (of.0, of.1, &found.known);
        let found = &found.alignment;
        let late_s = model.delay_s - found.delay_s;
        let has_delay = free.contains(&"reference_delay");
        // Smoothing that is too long for its second order leaves scale and axes wrong.
        let begun = found.with(&vec!["gyro_bias", "reference_misalignment"], model);
        let kept = places_of(free);
        let tried = SHARES.iter().filter_map(|share| {
            let time_s = share * late_s;
            let alignment = Alignment {
                low_pass_s: Some(Vector3::repeat(time_s)),
                delay_s: if has_delay {
                    found.delay_s + time_s
                } else {
                    model.delay_s
                },
                ..begun.clone()
            };
            let (_, fitting) = fitted(of_known, (model, &alignment), (&kept, true, None))?;
            Some((fitting.fit.log_likelihood, alignment))
        });
        let best = tried.max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, alignment)| alignment)
    }
}

/// Whether two stand at the same place.
fn is_same(one: &Grown, other: &Grown) -> bool {
    /// Log likelihood that rounding leaves apart.
    const ROUNDED: f64 = 0.1;
    one.1 == other.1 && (one.0.log_likelihood - other.0.log_likelihood).abs() < ROUNDED
}

/// Numbers of some groups.
fn numbers(free: &Free) -> usize {
    free.iter().map(|kind| places(kind).len()).sum()
}

/// Of registrations that explain as much as the best the one of the fewest numbers; the others are its rivals.
fn simplest(contenders: Vec<Grown>, alike_within: f64) -> Option<Grown> {
    let each = contenders.iter().map(|(one, _)| one.log_likelihood);
    let best = each.fold(f64::NEG_INFINITY, f64::max);
    let suffices = |one: &Grown| best - one.0.log_likelihood < alike_within;
    let mut sufficient: Vec<Grown> = contenders.into_iter().filter(suffices).collect();
    sufficient.sort_by(|a, b| {
        let by_numbers = numbers(&a.1).cmp(&numbers(&b.1));
        by_numbers.then(b.0.log_likelihood.total_cmp(&a.0.log_likelihood))
    });
    let mut sufficient = sufficient.into_iter();
    let (mut chosen, free) = sufficient.next()?;
    for (_, other) in sufficient {
        let lacks = |of: &Free, kind: &&'static str| !of.contains(kind);
        let own = free.iter().filter(|kind| lacks(&other, kind));
        let pairs = own.flat_map(|kind| {
            let theirs = other.iter().filter(|kind| lacks(&free, kind));
            theirs.map(move |rival| (*kind, *rival))
        });
        chosen.rivals.extend(pairs);
    }
    Some((chosen, free))
}
