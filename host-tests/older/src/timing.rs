//! Events in time are settled on every usable row, held-out ones included: a slip cannot be estimated where
//! it did not happen, and a step in a gap of the fit has no time.
//!
//! Enters: the residual after everything else, and the noise. Leaves: steps, slips, bursts and windows with times, size and
//! chance. Only these pass here; no name or size of any other effect is touched.

use super::bursts;
use super::declare::FAMILY_SIGNIFICANCE;
use super::empirical::{Form, Term};
use super::events::{self, Event};
use super::hunt::{Alike, FoundTerm, PLAINER};
use super::hypotheses::no_effects;
use super::local;
use super::noise::Noise;
use super::portion::Portion;
use super::scene::Scene;
use super::shapes::{AHEAD_JUMP, HELD_AGAINST};
use super::signals::argument;
use super::slow::Slow;
use super::split::{Split, usable_runs};
use super::steps;
use super::streams::Triad;
use super::workbench::{Parameters, Workbench};

/// Events in one recording, at most; each is significant by itself.
const MOST_EVENTS: usize = 6;

/// An edge of a window is known to this \[s\] where it was fitted.
const EDGE_S: f64 = 0.6;

/// Whether a term has its times settled here.
pub fn is_settled(term: &Term) -> bool {
    matches!(term.form, Form::Step { .. } | Form::Slip { .. }) || edges_s(term).is_some()
}

/// Finds the events in `left_rad`, from which no event has been taken, beside the `known` windows. A step is none where
/// a wandering rate does nearly as well.
pub fn settle(
    scene: &Scene,
    left_rad: &Triad,
    noise: [Noise; 3],
    parameters: &Parameters,
    (known, split): (Vec<FoundTerm>, &Split),
) -> Result<Vec<FoundTerm>, String> {
    let Some(mut bench) = bench_of_all_rows(scene, left_rad, noise, parameters) else {
        return Ok(Vec::new());
    };
    let (mut entered, mut drift) = (Vec::new(), Vec::new());
    let unseen = split.held_out.iter().map(ExactSizeIterator::len).max();
    let edge_rows = (EDGE_S * scene.streams.rate_hz) as usize + unseen.unwrap_or(0);
    for window in known.into_iter().filter(|one| edges_s(&one.term).is_some()) {
        add_window(&mut bench, parameters, &window.term, edge_rows)?;
        entered.push((window.ratio, window.p_value));
    }
    let windows = entered.len();
    loop {
        let (values, stds) = bench.term_sizes();
        let left = bench.left_over(&numbered(parameters, &values));
        // Without a reference a jump of the angle is not told from a nudge of the case; a bias that stays is.
        let of_angle = || match scene.streams.at_rest {
            Some(_) => Default::default(),
            None => rayon::join(
                || events::slips(&bench, &left),
                || bursts::bursts(&bench, &left),
            ),
        };
        let (steps, (slips, bursts)) = rayon::join(|| steps::steps(&bench, &left), of_angle);
        let is_news = |event: &Event| {
            let known = bench.terms().iter().chain(&drift);
            event.p_value < FAMILY_SIGNIFICANCE && !known.clone().any(|one| *one == event.term)
        };
        let further = events::further(&slips, is_news);
        let events = steps.into_iter().chain(slips).chain(bursts);
        // As in the search: a burst has two times to choose, of which a slip has one.
        let worth = |event: &Event| match edges_s(&event.term) {
            Some(_) => event.ratio,
            None => event.ratio + PLAINER,
        };
        let best = events
            .filter(is_news)
            .max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let slips = bench.terms().iter().filter(|term| term.is_slip()).count();
        let room = entered.len() - slips < MOST_EVENTS + windows && drift.len() < MOST_EVENTS;
        match best.filter(|_| room) {
            // All that stand out come in together, as in the search.
            Some(event) if event.term.is_slip() && !further.is_empty() => {
                for slip in further {
                    bench.add_term(slip.term)?;
                    entered.push((slip.ratio, slip.p_value));
                }
            }
            Some(event) => {
                bench.add_term(event.term.clone())?;
                if is_drift(&bench, parameters, &event.term) {
                    bench.remove_term(bench.terms().len() - 1);
                    drift.push(event.term);
                } else {
                    entered.push((event.ratio, event.p_value));
                }
            }
            None => {
                return Ok(bench
                    .terms()
                    .iter()
                    .zip(values.iter().zip(&stds))
                    .zip(entered)
                    .map(|((term, (size, std)), (ratio, p_value))| FoundTerm {
                        term: term.clone(),
                        size: *size,
                        std: *std,
                        with_next: 0.0,
                        alike: Alike::default(),
                        ratio,
                        p_value,
                    })
                    .collect());
            }
        }
    }
}

/// Whether the last term on a bench is a step that a wandering rate nearly explains.
fn is_drift(bench: &Workbench, parameters: &Parameters, term: &Term) -> bool {
    // Of a recording longer than memory these rows are stretches without their slow part.
    let stretches = bench.scene().streams.pieces[0].origin.is_some();
    if stretches || !matches!(term.form, Form::Step { .. }) {
        return false;
    }
    let all = parameters.count()..parameters.count() + bench.terms().len();
    let own = all.end - 1..all.end;
    let slow = Slow::new(bench, &all.collect::<Vec<_>>(), &HELD_AGAINST);
    slow.is_some_and(|slow| slow.ahead(&[own], &HELD_AGAINST) < AHEAD_JUMP)
}

/// Puts a window on the bench with its edges where all rows have them: one that opened where nothing was fitted opens
/// there.
fn add_window(
    bench: &mut Workbench,
    parameters: &Parameters,
    known: &Term,
    within_rows: usize,
) -> Result<(), String> {
    let streams = &bench.scene().streams;
    let Some([from, to]) = edges_s(known).map(|edges_s| edges_s.map(|edge| streams.row_at(edge)))
    else {
        return bench.add_term(known.clone());
    };
    let (values, _) = bench.term_sizes();
    let left = bench.left_over(&numbered(parameters, &values));
    let rows = steps::refined(bench, known.axis, &left[known.axis], from..to, within_rows);
    let expression = local::window(bench.scene(), &rows);
    bench.add_term(Term {
        axis: known.axis,
        form: Form::Product { expression },
    })
}

/// Sizes of the terms on a bench with the numbers that they have there.
fn numbered(parameters: &Parameters, sizes: &[f64]) -> Vec<(usize, f64)> {
    (parameters.count()..).zip(sizes.iter().copied()).collect()
}

/// Edges \[s\] of a window of a recording that stands alone.
fn edges_s(term: &Term) -> Option<[f64; 2]> {
    let Form::Product { expression } = &term.form else {
        return None;
    };
    let inside = argument(expression, "window")?;
    let (from, to) = inside.split_once(',')?;
    Some([from.parse().ok()?, to.parse().ok()?])
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
                alike: Alike::default(),
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
    // The angle jumps from one recording to the next.
    let pieces = streams.pieces.iter();
    let runs = pieces.flat_map(|piece| usable_runs(&streams.usable, piece.rows.clone()));
    let runs = runs.collect();
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
