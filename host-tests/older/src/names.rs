//! Which effects may still be named, and why others may not.
//!
//! Enters: the candidates. Changes as the hunt objects to one effect after another. An effect that lost its name comes
//! back once if its own expression turns out to be what explains the data best: what had spoken against it, or stood in
//! its place, was the absence of something else.

use super::hypotheses::CATALOGUE;

/// See the page above.
pub(super) struct Names {
    /// Effects to weigh, in the order of the catalogue.
    pub allowed: Vec<usize>,
    /// Effects that fitted but lost their name, with the reason.
    pub vetoed: Vec<(usize, String)>,
    /// Those of them that drift took the place of.
    pub doubted: Vec<usize>,
    /// Those of them whose size differs between the regimes, with what everything fitted explained then (2 Δ ln L).
    uneven: Vec<(usize, f64)>,
    /// Effects that came back.
    returned: Vec<usize>,
}

impl Names {
    pub fn new(candidates: &[usize]) -> Self {
        Self {
            allowed: candidates.to_vec(),
            vetoed: Vec::new(),
            doubted: Vec::new(),
            uneven: Vec::new(),
            returned: Vec::new(),
        }
    }

    /// An effect loses its name.
    pub fn lose(&mut self, effect: usize, reason: String) {
        self.allowed.retain(|&kept| kept != effect);
        self.vetoed.push((effect, reason));
    }

    /// An effect loses its name because its size differs between the regimes, with this chance; with it everything
    /// fitted explains so much (2 Δ ln L).
    pub fn lose_uneven(&mut self, effect: usize, chance: f64, explained: f64) {
        self.lose(effect, differs(chance));
        self.uneven.push((effect, explained));
    }

    /// Effects whose size differs between the regimes and in whose place nothing came: in part though they fit, all that
    /// was found in the end explains less.
    pub fn unreplaced(&self, explained: f64) -> Vec<usize> {
        /// Of what was explained then: the noise was fitted anew since.
        const AS_MUCH: f64 = 0.9;
        let mut left = self.uneven.clone();
        left.retain(|(_, then)| explained < AS_MUCH * then);
        left.into_iter().map(|(effect, _)| effect).collect()
    }

    /// An effect loses its name to drift.
    pub fn lose_to_drift(&mut self, effect: usize) {
        self.lose(effect, "drifting noise explains nearly as much".to_string());
        self.doubted.push(effect);
    }

    /// An effect comes back.
    pub fn give_back(&mut self, effect: usize) {
        self.doubted.retain(|&other| other != effect);
        self.uneven.retain(|(other, _)| *other != effect);
        self.vetoed.retain(|(other, _)| *other != effect);
        self.allowed.push(effect);
        self.allowed.sort_unstable();
        self.returned.push(effect);
    }

    /// Whether an effect came back.
    pub fn is_back(&self, effect: usize) -> bool {
        self.returned.contains(&effect)
    }

    /// Whether an effect has had its say: it is weighed now, or it came back and drift took its place again. What is
    /// nothing but its own expression is no news.
    pub fn is_weighed(&self, effect: usize) -> bool {
        self.allowed.contains(&effect) || (self.is_back(effect) && self.doubted.contains(&effect))
    }

    /// Whether an effect lost its name and may come back.
    pub fn may_come_back(&self, effect: usize) -> bool {
        let lost = self.vetoed.iter().any(|(other, _)| *other == effect);
        lost && !self.is_back(effect) && CATALOGUE[effect].is_linear()
    }
}

/// Why an effect that is not the same in every regime has no name.
pub(super) fn differs(chance: f64) -> String {
    format!("its size differs between the regimes (chance {chance:.1e})")
}
