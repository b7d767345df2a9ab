//! Forward selection of registration groups, from none.
//!
//! If the motion hardly distinguishes two groups (a cone of one tone: a delay and a turn about its axis), rows linearised
//! about the one carry little information on the other: each is a separate start, and the simplest of equally good results
//! is selected.

use nalgebra::Vector3;

use crate::reference::coarse::Start;
use crate::registration::gauss_newton::{
    FitOptions, Point, Records, Registration, Steps, fitted, places_of, settle,
};
use crate::rows::alignment::{Alignment, Free, GROUPS, in_order, places};

/// Groups selected about an alignment.
pub(crate) struct Called {
    /// Groups, in the order of their columns.
    pub(crate) free: Free,
    /// Step to their estimates.
    pub(crate) step: Steps,
    /// Alternative sets of nearly equal gain.
    pub(crate) nearly: Vec<Free>,
}

/// Forward selection of the registration of one record.
pub(crate) struct Growth<'a> {
    /// Data of the record.
    pub(crate) of: Records<'a>,
    /// Alignment of the model.
    pub(crate) model: &'a Alignment,
    /// Initial delay and rotation.
    pub(crate) start: &'a Start,
    /// Selects groups given a registration.
    pub(crate) called_for: &'a dyn Fn(&Registration) -> Called,
    /// Largest difference in log likelihood of indistinguishable registrations.
    pub(crate) alike_within: f64,
    /// Reports each step.
    pub(crate) progress: &'a dyn Fn(&str),
}

/// A registration and its groups.
pub(crate) type Grown = (Registration, Free);

impl Growth<'_> {
    /// Aligns the reference with the gyros: selected groups are added until the selection no longer changes. The others stay
    /// at the model's values: two parameters not distinguishable by the motion would cancel each other far outside the
    /// linear range.
    pub(crate) fn grow(&self) -> Option<Grown> {
        let Self { of, model, .. } = *self;
        let gyros = of.gyros;
        // Far from convergence a gyro error resembles a fault of the reference, except in a fit of all parameters.
        let all: Free = GROUPS.iter().map(|group| group.kind).collect();
        let far = self.start.of(&all, model);
        let known = settle(of, model, far.clone(), &all, true, self.progress)?.known;
        // A large misalignment is also significant at the model's alignment; the correlation of noise alone may peak
        // anywhere.
        let of_known = Records {
            stamps: &known,
            ..of
        };
        let none = Free::new();
        let at_model = settle(of_known, model, model.clone(), &none, false, self.progress)?;
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

    /// Iterates from some groups; `None` if that leads to one of `others` again.
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
            let registered = settle(of_round, model, start, &free, has_faults, self.progress)?;
            let registered = registered.weighed(of.gyros, model);
            let Called {
                free: now, step, ..
            } = (self.called_for)(&registered);
            round += 1;
            if round == ROUNDS || (has_faults && now == free) {
                return Some((registered, free));
            }
            let moved = registered.alignment.with(&now, model);
            (start, free) = (moved.moved(&step.estimate), now);
            let within = of.gyros.plan.registration.same_alignment;
            let is_there =
                |(other, of): &Grown| *of == free && step.lead_to(&start, &other.alignment, within);
            if others.iter().any(is_there) {
                return None;
            }
        }
    }

    /// Adds, for a filter too long for its second order, the alternatives of a first-order low pass with and without a
    /// delay.
    fn as_low_pass(&self, grown: Grown) -> Vec<Grown> {
        let (found, free) = &grown;
        let plan = &self.of.gyros.plan.registration;
        if !found.may_be_low_pass(self.model, plan) {
            return vec![grown];
        }
        let settled = |delay: bool| {
            let others = free.iter().copied();
            let others = others.filter(|kind| delay || *kind != "reference_delay");
            let free = in_order(others.chain(std::iter::once("gyro_bandwidth")));
            let start = self.low_pass_start(found, &free)?;
            let settled = settle(self.of, self.model, start, &free, true, self.progress)?;
            Some((settled, free))
        };
        let low_passes = [settled(false), settled(true)].into_iter().flatten();
        let possible = low_passes.filter(|(one, _)| one.is_possible(plan));
        std::iter::once(grown).chain(possible).collect()
    }

    /// Linearisation point of a low pass: its maximum-likelihood time constant by grid search, as the rectification of
    /// vibration is not linear far from it. With a delay, the sum of both lags is that of `found`.
    fn low_pass_start(&self, found: &Registration, free: &Free) -> Option<Alignment> {
        let Self { of, model, .. } = *self;
        let of_known = Records {
            stamps: &found.known,
            ..of
        };
        let found = &found.alignment;
        let late_s = model.delay_s - found.delay_s;
        let has_delay = free.contains(&"reference_delay");
        // Smoothing too long for its second order biases scale and axes.
        let begun = found.with(&vec!["gyro_bias", "reference_misalignment"], model);
        let kept = places_of(free);
        let tried = of
            .gyros
            .plan
            .registration
            .low_pass_shares
            .iter()
            .filter_map(|share| {
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
                let point = Point {
                    of_model: model,
                    alignment: &alignment,
                };
                let options = FitOptions {
                    kept: &kept,
                    is_plain: true,
                    levels: None,
                };
                let (_, fitting) = fitted(of_known, point, options)?;
                Some((fitting.fit.log_likelihood, alignment))
            });
        let best = tried.max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, alignment)| alignment)
    }
}

/// True if two registrations coincide.
fn is_same(one: &Grown, other: &Grown) -> bool {
    /// Difference in log likelihood by rounding.
    const ROUNDED: f64 = 0.1;
    one.1 == other.1 && (one.0.log_likelihood - other.0.log_likelihood).abs() < ROUNDED
}

/// Number of parameters of some groups.
fn numbers(free: &Free) -> usize {
    free.iter().map(|kind| places(kind).len()).sum()
}

/// Selects, of registrations not distinguishable from the best, the one of fewest parameters; the others are its rivals.
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
