//! Hypotheses that an experiment is to separate: a finding, its rivals and nuisance effects.

use std::ops::Range;

use rlg_catalogue::entries;
use rlg_catalogue::{Candidate, Pool, Signals};
use rlg_inference::{Hypothesis, Term};

use crate::confirm::ConfirmedSet;
use crate::report::entries_of_findings::DRIFT;
use crate::report::finding::Finding;
use crate::search::structure::Found;

/// Errors of any gyro, nuisance parameters of a separation.
const PLAIN: [&str; 3] = ["gyro_bias", "gyro_scale", "installation"];

/// Finding for which an experiment is sought.
#[derive(Clone, Copy)]
pub(crate) struct Subject<'a> {
    pub(crate) found: &'a Found,
    pub(crate) confirmed: &'a ConfirmedSet,
    /// Its place among the named members.
    pub(crate) place: usize,
    pub(crate) one: &'a Finding<'a>,
}

/// Role of a hypothesis in the question.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Role {
    /// The finding.
    Own,
    /// A rival of the finding.
    Rival,
    /// Another finding.
    Other,
    /// An everyday error.
    Plain,
    /// Initial level of a drift.
    Level,
}

/// A hypothesis of the question.
pub(crate) struct Asked {
    pub(crate) kind: &'static str,
    pub(crate) role: Role,
    pub(crate) hypothesis: Hypothesis,
    /// Indices of its parameters in the information.
    pub(crate) block: Range<usize>,
}

/// Collects the finding first, then other findings, its rivals, everyday errors and the level of a drift; `None` for an
/// event, which no table repeats on command.
pub(crate) fn asked(
    Subject {
        found,
        confirmed,
        place,
        one,
    }: Subject,
) -> Option<(Pool, Vec<Asked>)> {
    let happens_again = |one: &Candidate| one.event_gyro().is_none();
    if !happens_again(one.candidate) {
        return None;
    }
    let mut pool = Pool::default();
    let mut asked: Vec<Asked> = Vec::new();
    let mut ask = |kind, role, hypothesis: Hypothesis| {
        let first = asked.last().map_or(0, |one: &Asked| one.block.end);
        let block = first..first + hypothesis.parameters;
        asked.push(Asked {
            kind,
            role,
            hypothesis,
            block,
        });
    };
    let own = pool.adopt(one.candidate, &found.pool.columns);
    let whole = own.hypothesis.with_fixed_as_parameter();
    ask(own.kind, Role::Own, whole);
    let mut kinds = vec![own.kind];
    let members = &confirmed.fit.members;
    let others = members.iter().filter(|other| **other != members[place]);
    for other in others.map(|&other| &found.candidates[other]) {
        if happens_again(other) {
            let mut other = pool.adopt(other, &found.pool.columns);
            other.hypothesis.fixed.clear();
            kinds.push(other.kind);
            ask(other.kind, Role::Other, other.hypothesis);
        }
    }
    let member = confirmed.named[place];
    let judged = &found.judged[member];
    let nearest = judged.rivals.iter().map(|(rival, _)| *rival);
    let all = nearest
        .chain(found.spanned_by[member].iter().copied())
        .chain([judged.hypothesis]);
    for rival in all.map(|rival| &found.candidates[rival]) {
        if happens_again(rival) && !kinds.contains(&rival.kind) {
            kinds.push(rival.kind);
            let rival = pool.adopt(rival, &found.pool.columns);
            let whole = rival.hypothesis.with_fixed_as_parameter();
            ask(rival.kind, Role::Rival, whole);
        }
    }
    let signals = &found.motion.signals;
    for kind in PLAIN.into_iter().filter(|kind| !kinds.contains(kind)) {
        ask(kind, Role::Plain, everyday(&mut pool, kind, signals)?);
    }
    let level = everyday(&mut pool, "gyro_bias", signals)?;
    ask(DRIFT, Role::Level, level);
    Some((pool, asked))
}

/// Hypothesis with all parameters of an everyday error.
fn everyday(pool: &mut Pool, kind: &str, signals: &Signals) -> Option<Hypothesis> {
    let entry = entries::find(kind)?;
    let whole = pool.whole(entry, signals);
    let count = whole.len();
    let terms = whole
        .into_iter()
        .enumerate()
        .flat_map(|(parameter, (_, terms))| {
            let own = move |term: Term| Term { parameter, ..term };
            terms.into_iter().map(own)
        });
    let mut hypothesis = Hypothesis::of_terms(count, terms.collect());
    hypothesis.bounds = vec![entry.size.bound(); count];
    Some(hypothesis)
}
