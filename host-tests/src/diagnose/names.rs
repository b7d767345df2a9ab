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
    /// Effects that came back.
    returned: Vec<usize>,
}

impl Names {
    pub fn new(candidates: &[usize]) -> Self {
        Self {
            allowed: candidates.to_vec(),
            vetoed: Vec::new(),
            doubted: Vec::new(),
            returned: Vec::new(),
        }
    }

    /// An effect loses its name.
    pub fn lose(&mut self, effect: usize, reason: String) {
        self.allowed.retain(|&kept| kept != effect);
        self.vetoed.push((effect, reason));
    }

    /// An effect loses its name to drift.
    pub fn lose_to_drift(&mut self, effect: usize) {
        self.lose(effect, "drifting noise explains nearly as much".to_string());
        self.doubted.push(effect);
    }

    /// An effect comes back.
    pub fn give_back(&mut self, effect: usize) {
        self.doubted.retain(|&other| other != effect);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_comes_back_once() {
        let mut names = Names::new(&[2, 4, 6]);
        names.lose_to_drift(4);
        assert_eq!(names.allowed, [2, 6]);
        assert!(names.may_come_back(4) && !names.is_weighed(4));
        names.give_back(4);
        assert_eq!(names.allowed, [2, 4, 6]);
        assert!(names.vetoed.is_empty() && names.doubted.is_empty());
        names.lose_to_drift(4);
        assert!(!names.may_come_back(4) && names.is_weighed(4));
    }

    #[test]
    fn what_differs_between_regimes_after_it_came_back_stays_an_expression() {
        let mut names = Names::new(&[2, 4]);
        names.lose(4, "it differs".to_string());
        names.give_back(4);
        names.lose(4, "it differs still".to_string());
        assert!(!names.may_come_back(4) && !names.is_weighed(4));
    }
}
