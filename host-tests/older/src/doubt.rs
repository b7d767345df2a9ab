//! Names beside which much on the same gyro is only described.
//!
//! Enters: what was found. Leaves: which names may be those of a part only. What has no name in the catalogue shows in
//! the listed effect that comes nearest, and in constants over stretches of time where that one fails; who reads the name
//! must be told that both may have one cause.

use super::empirical::Form;
use super::hunt::{Catch, FoundTerm};
use super::hypotheses::CATALOGUE;
use super::result::{EffectEntry, UNLISTED};
use super::scene::Scene;
use super::select::Chosen;
use super::signals;

/// Share of a name's own likelihood ratio that is much: a third of its amplitude.
const MUCH: f64 = 0.1;

/// A gyro on which an effect adds less than this share of what it adds to the one it moves most is none of its own.
const MOVED: f64 = 0.1;

/// See the page above.
pub(super) struct Doubt {
    /// Likelihood ratio (2 Δ ln L) of what only describes, by gyro.
    described: [f64; 3],
}

impl Doubt {
    pub fn of(catch: &Catch) -> Self {
        let mut described = [0.0; 3];
        for found in catch.terms.iter().filter(|found| describes(found)) {
            described[found.term.axis] += found.ratio;
        }
        Self { described }
    }

    /// Says so in the entry of a listed effect.
    pub fn of_effect(&self, scene: &Scene, one: &Chosen, mut entry: EffectEntry) -> EffectEntry {
        if self.described == [0.0; 3] {
            return entry;
        }
        let added = CATALOGUE[one.effect].prediction(scene, one.values.as_slice());
        let power = added.map(|added| added.iter().map(|angle| angle * angle).sum::<f64>());
        let most = power.iter().copied().fold(0.0, f64::max);
        let own = (0..3).filter(|&axis| power[axis] > MOVED * MOVED * most);
        self.say(own.map(|axis| self.described[axis]).sum(), &mut entry);
        entry
    }

    /// Says so in the entry of a jump or a harmonic.
    pub fn of_term(&self, found: &FoundTerm, mut entry: EffectEntry) -> EffectEntry {
        if entry.kind != UNLISTED {
            self.say(self.described[found.term.axis], &mut entry);
        }
        entry
    }

    fn say(&self, described: f64, entry: &mut EffectEntry) {
        if !entry.may_be_unlisted() && described > MUCH * 2.0 * entry.log_evidence_gain {
            entry.indistinguishable_from.push(UNLISTED.to_string());
        }
    }
}

/// Whether a term is a constant over a stretch of time.
fn describes(found: &FoundTerm) -> bool {
    match &found.term.form {
        Form::Product { expression } => signals::is_window(expression),
        _ => false,
    }
}
