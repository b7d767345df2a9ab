//! Which steps between attitudes are fitted and which are held out.
//!
//! Enters: the record and the regimes of split.rs. Leaves: [`Cut`]: runs of stamps. Time is cut in contiguous
//! stretches, at the end of every regime, as on rows; short regimes are cut together, since of what is slow an attitude
//! tells by its whole run, which noise of two stamps bounds. Where regimes hold too few steps for that (attitude before
//! and after only), whole steps are held out that can be spared (spare.rs), and of a handful of steps nothing.

use std::ops::Range;

use super::record::Record;
use crate::declare::HELD_OUT_SHARE;
use crate::split::Regime;

/// Steps in a regime of which a part can be held out.
const ENOUGH_OF_REGIME: usize = 10;

/// Shorter regimes are cut with those that follow \[s\].
const SHORT_S: f64 = 3.5;

/// Steps in sparse regimes together of which a part can be held out.
const ENOUGH_IN_ALL: usize = 8;

/// The steps, cut.
#[derive(Clone)]
pub struct Cut {
    /// Stretches of like motion.
    pub regimes: Vec<Regime>,
    /// Runs of stamps to select and estimate on.
    pub fitted: Vec<Range<usize>>,
    /// Runs of stamps never seen before.
    pub held_out: Vec<Range<usize>>,
    of_step: Vec<Option<(usize, bool)>>,
}

/// The last part of some steps.
pub fn last_part(steps: &[usize]) -> Vec<usize> {
    let held = (steps.len() as f64 * HELD_OUT_SHARE) as usize;
    steps[steps.len() - held..].to_vec()
}

/// Cuts. `spare` says which of the steps in sparse regimes to hold out.
pub fn cut(record: &Record, regimes: Vec<Regime>, spare: &dyn Fn(&[usize]) -> Vec<usize>) -> Cut {
    let mut of_regime: Vec<Vec<usize>> = vec![Vec::new(); regimes.len()];
    for step in 1..record.stamps() {
        if record.broken[step] {
            continue;
        }
        let middle = 0.5 * (record.places[step - 1] + record.places[step]);
        let regime = regimes
            .iter()
            .position(|regime| regime.rows.contains(&(middle as usize)));
        if let Some(regime) = regime {
            of_regime[regime].push(step);
        }
    }
    let mut of_step = vec![None; record.stamps()];
    let mut sparse: Vec<(usize, usize)> = Vec::new();
    let mut together: Vec<(usize, usize)> = Vec::new();
    for (regime, steps) in of_regime.iter().enumerate() {
        let own = steps.iter().map(|step| (*step, regime));
        if steps.len() < ENOUGH_OF_REGIME {
            sparse.extend(own);
        } else {
            together.extend(own);
        }
        let spans_s = |steps: &[(usize, usize)]| match steps {
            [(first, _), .., (last, _)] => record.times_s[*last] - record.times_s[*first],
            _ => 0.0,
        };
        if spans_s(&together) < SHORT_S && regime + 1 < of_regime.len() {
            continue;
        }
        let kept = together.len() - (together.len() as f64 * HELD_OUT_SHARE) as usize;
        for (place, (step, regime)) in together.drain(..).enumerate() {
            of_step[step] = Some((regime, place >= kept));
        }
    }
    let steps: Vec<usize> = sparse.iter().map(|(step, _)| *step).collect();
    let spared = if steps.len() < ENOUGH_IN_ALL {
        Vec::new()
    } else {
        spare(&steps)
    };
    for (step, regime) in sparse {
        of_step[step] = Some((regime, spared.contains(&step)));
    }
    let mut cut = Cut {
        regimes,
        fitted: Vec::new(),
        held_out: Vec::new(),
        of_step,
    };
    cut.fitted = cut.runs(|_, held| !held);
    cut.held_out = cut.runs(|_, held| held);
    cut
}

impl Cut {
    /// Runs of stamps whose steps answer (regime, whether held out).
    pub fn runs(&self, wanted: impl Fn(usize, bool) -> bool) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (step, of) in self.of_step.iter().enumerate() {
            if !of.is_some_and(|(regime, held)| wanted(regime, held)) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.end == step => run.end = step + 1,
                _ => runs.push(step - 1..step + 1),
            }
        }
        runs
    }

    /// The rows that runs of stamps cover.
    pub fn rows(record: &Record, runs: &[Range<usize>]) -> Vec<Range<usize>> {
        runs.iter()
            .map(|run| {
                record.places[run.start].floor() as usize
                    ..(record.places[run.end - 1].ceil() as usize).min(record.path.rows())
            })
            .collect()
    }
}
