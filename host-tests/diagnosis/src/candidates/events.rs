//! Events in the residuals of fits as candidates of a pass.

use rlg_catalogue::Candidate;
use rlg_catalogue::entries::{SLIP, STEP, UNLISTED};
use rlg_catalogue::expression::Expression;
use rlg_inference::events::{Event, EventKind, impulses, scan};
use rlg_inference::{Drift, Fit, NoiseLevels};
use rlg_plan::{Plan, WindowPlan};

use super::windows::Edges;
use crate::iteration::pass::{Begin, Pass, left_on};

/// An event in the residual of a gyro.
#[derive(Clone, Copy)]
struct Scanned {
    gyro: usize,
    /// Noise under which it was scanned.
    noise: NoiseLevels,
    event: Event,
}

impl Pass {
    /// Scans the residuals of `fits` for events; returns the places of the new candidates.
    pub(crate) fn add_events(&mut self, fits: &[&Fit], begin: &Begin) -> Vec<usize> {
        let mut new: Vec<Candidate> = Vec::new();
        for fit in fits {
            let mut events: Vec<Scanned> = Vec::new();
            for gyro in 0..3 {
                let residual = left_on(&self.equations, fit, &self.candidates, gyro);
                let mut noises = vec![fit.levels[gyro]];
                if fit.drift[gyro] != Drift::None {
                    noises.push(fit.levels[gyro].stationary());
                }
                for noise in noises {
                    let found = scan(
                        &self.equations.transform,
                        &self.equations.basis,
                        &residual,
                        noise,
                        &begin.plan.inference.events,
                    );
                    events.extend(
                        found
                            .into_iter()
                            .map(|event| Scanned { gyro, noise, event }),
                    );
                }
            }
            events.retain(|one| begin.seeks(kind_of(&one.event)));
            // At rest a slip and a nudge of the case are not distinguishable without a reference.
            events.retain(|one| !self.is_at_rest || one.event.kind == EventKind::Step);
            events.retain(|one| {
                one.event.size.abs() > begin.plan.judgement.event
                    && !self.lattice.hides_event(one.gyro, &one.event)
            });
            events.sort_by(|a, b| b.event.size.abs().total_cmp(&a.event.size.abs()));
            for scanned in events.into_iter().take(begin.plan.judgement.events_tried) {
                let together = match scanned.event.kind {
                    EventKind::Impulse => self.swarm(fit, scanned, begin.plan),
                    EventKind::Step | EventKind::Window => vec![scanned.event],
                };
                for event in together {
                    let one = self.candidate_of(scanned.gyro, &event, &begin.plan.rates.window);
                    let mut known = self.candidates.iter().chain(&new);
                    if !known.any(|other| other.kind == one.kind && other.variant == one.variant) {
                        new.push(one);
                    }
                }
            }
        }
        self.extend(new)
    }

    /// Returns a slip with all other significant slips of its gyro: a counter that slips does so repeatedly.
    fn swarm(&self, fit: &Fit, strongest: Scanned, plan: &Plan) -> Vec<Event> {
        let Scanned { gyro, noise, event } = strongest;
        let most = plan.judgement.most_slips;
        let rows = self.motion.signals.rows as f64;
        let least = (2.0 * (3.0 * rows).ln()).sqrt();
        let residual = left_on(&self.equations, fit, &self.candidates, gyro);
        let (transform, basis) = (&self.equations.transform, &self.equations.basis);
        let mut all = impulses(
            transform,
            basis,
            &residual,
            noise,
            (least, most),
            &plan.inference.events,
        );
        all.retain(|event| !self.lattice.hides_event(gyro, event));
        if all.is_empty() || all.len() == most {
            return vec![event];
        }
        all
    }

    /// Converts an event of a gyro to a candidate.
    fn candidate_of(&mut self, gyro: usize, event: &Event, plan: &WindowPlan) -> Candidate {
        let signals = &self.motion.signals;
        let rows = signals.rows as f64;
        // The row of a step of z standard deviations is uncertain by n/(z²/2) rows.
        let places_of_edge = (0.5 * event.size * event.size).max(4.0);
        let pool = &mut self.pool;
        match event.kind {
            EventKind::Impulse => pool.event(SLIP, gyro, event.row, 3.0 * rows, signals),
            EventKind::Step => pool.event(STEP, gyro, event.row, 3.0 * places_of_edge, signals),
            EventKind::Window => {
                let window = event.row..event.row + event.rows;
                let edges = Edges::of(window, event.size * event.size, signals.rows, plan);
                let ([start, end], places) = edges.placed(&self.cuts);
                let window = Expression::window(start..end, signals);
                pool.expression(gyro, window, 3.0 * places, signals)
            }
        }
    }
}

/// Contract kind of an event.
fn kind_of(event: &Event) -> &'static str {
    match event.kind {
        EventKind::Impulse => SLIP,
        EventKind::Step => STEP,
        EventKind::Window => UNLISTED,
    }
}
