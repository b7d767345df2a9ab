//! Events in time are settled on every usable row, held-out ones included: a slip cannot be estimated where
//! it did not happen, and a step in a gap of the fit has no time.
//!
//! Enters: the residual after everything else, and the noise. Leaves: steps and slips with time, size and
//! chance. Only events pass here; no name or size of any other effect is touched.

use super::declare::FAMILY_SIGNIFICANCE;
use super::empirical::{Form, Term};
use super::events;
use super::hunt::FoundTerm;
use super::hypotheses::no_effects;
use super::noise::Noise;
use super::portion::Portion;
use super::scene::Scene;
use super::split::usable_runs;
use super::streams::Triad;
use super::workbench::{Parameters, Workbench};

/// Events in one recording, at most; each is significant by itself.
const MOST_EVENTS: usize = 6;

/// Whether a term is an event.
pub fn is_event(form: &Form) -> bool {
    matches!(form, Form::Step { .. } | Form::Slip { .. })
}

/// Finds the events in `left_rad`, from which no event has been taken.
pub fn settle(
    scene: &Scene,
    left_rad: &Triad,
    noise: [Noise; 3],
    parameters: &Parameters,
) -> Vec<FoundTerm> {
    let Some(mut bench) = bench_of_all_rows(scene, left_rad, noise, parameters) else {
        return Vec::new();
    };
    let mut entered = Vec::new();
    loop {
        let (values, stds) = bench.term_sizes();
        let first = parameters.count();
        let numbered: Vec<(usize, f64)> = values
            .iter()
            .enumerate()
            .map(|(place, value)| (first + place, *value))
            .collect();
        let left = bench.left_over(&numbered);
        let best = events::steps(&bench, &left)
            .into_iter()
            .chain(events::slips(&bench, &left))
            .filter(|event| {
                event.p_value < FAMILY_SIGNIFICANCE && !bench.terms().contains(&event.term)
            })
            .max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        match best.filter(|_| entered.len() < MOST_EVENTS) {
            Some(event) => {
                entered.push((event.ratio, event.p_value));
                if bench.add_term(event.term).is_err() {
                    return Vec::new();
                }
            }
            None => {
                return bench
                    .terms()
                    .iter()
                    .zip(values.iter().zip(&stds))
                    .zip(entered)
                    .map(|((term, (size, std)), (ratio, p_value))| FoundTerm {
                        term: term.clone(),
                        size: *size,
                        std: *std,
                        with_next: 0.0,
                        ratio,
                        p_value,
                    })
                    .collect();
            }
        }
    }
}

/// Sizes of constants over stretches of time in `left_rad`; those that say nothing are dropped.
pub fn describe(
    scene: &Scene,
    left_rad: &Triad,
    noise: [Noise; 3],
    parameters: &Parameters,
    stretches: Vec<Term>,
) -> Vec<FoundTerm> {
    /// A located stretch stands out by more; one whose size came down to this is described by the others.
    const LEAST_SIZE: f64 = 3.0;
    let Some(mut bench) = bench_of_all_rows(scene, left_rad, noise, parameters) else {
        return Vec::new();
    };
    for term in stretches {
        if bench.add_term(term).is_err() {
            return Vec::new();
        }
    }
    let (sizes, stds) = bench.term_sizes();
    bench
        .terms()
        .iter()
        .zip(sizes.iter().zip(&stds))
        .filter(|(_, (size, std))| size.abs() > LEAST_SIZE * **std)
        .map(|(term, (size, std))| {
            let ratio = (size / std).powi(2);
            FoundTerm {
                term: term.clone(),
                size: *size,
                std: *std,
                with_next: 0.0,
                ratio,
                p_value: (-0.5 * ratio).exp(),
            }
        })
        .collect()
}

fn bench_of_all_rows<'a>(
    scene: &'a Scene,
    left_rad: &'a Triad,
    noise: [Noise; 3],
    parameters: &'a Parameters,
) -> Option<Workbench<'a>> {
    let streams = &scene.streams;
    let runs = usable_runs(&streams.usable, 0..streams.rows);
    let portion = Portion::new(runs, streams.rate_hz)?.within(streams.band_hz());
    Some(Workbench::new(
        scene,
        left_rad,
        parameters,
        portion,
        noise,
        &[],
        &no_effects(),
    ))
}
