//! Step control of the nonlinear parameters: a step after which a set fits worse than before is halved.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::is_delay;
use rlg_inference::Fit;

/// Largest number of halvings of a step; then the previous values stay.
const HALVINGS: usize = 3;

/// Gauss–Newton step of the parameters about which columns are linearised.
///
/// The log odds before it include its whole gain by the linear columns. If the next pass has less than those odds without
/// the gain, the step is worse than none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Log odds of the set before the step, against noise alone.
    odds: f64,
    /// Gain of the step in log likelihood for linear columns.
    gain: f64,
    /// Number of halvings.
    halvings: usize,
}

impl Step {
    /// Full step of a fit; `None` without such parameters.
    pub(crate) fn of(odds: f64, fit: &Fit, candidates: &[Candidate]) -> Option<Self> {
        let moved = moved(fit, candidates);
        (!moved.is_empty()).then(|| Self {
            odds,
            gain: gain(fit, &moved),
            halvings: 0,
        })
    }

    /// True if a set with these odds is worse than before the step and the step can be halved again.
    pub(crate) fn is_worse(&self, odds: f64) -> bool {
        !self.is_none() && odds < self.odds - self.gain
    }

    /// Halves the step; zero after the last halving.
    pub(crate) fn halved(self, fit: &mut Fit, candidates: &[Candidate]) -> Self {
        let halved = Self {
            halvings: self.halvings + 1,
            ..self
        };
        let share = if halved.is_none() { 0.0 } else { 0.5 };
        for place in moved(fit, candidates) {
            fit.estimate[place] *= share;
        }
        halved
    }

    /// True if the previous values stay.
    pub(crate) fn is_none(&self) -> bool {
        self.halvings > HALVINGS
    }
}

/// Indices, among the estimates, of the parameters about which columns are linearised.
fn moved(fit: &Fit, candidates: &[Candidate]) -> Vec<usize> {
    let members = fit.members.iter().zip(&fit.blocks);
    let moved_of = |(&place, block): (&usize, &std::ops::Range<usize>)| {
        let one = &candidates[place];
        let all = block.clone().zip(&one.base);
        let moved = all.filter(|(_, base)| is_delay(one.kind) || **base != 0.0);
        moved.map(|(at, _)| at).collect::<Vec<usize>>()
    };
    members.flat_map(moved_of).collect()
}

/// Half the squared size of a step in standard deviations: its gain in log likelihood.
fn gain(fit: &Fit, moved: &[usize]) -> f64 {
    let std = |place: usize| fit.covariance[(place, place)].sqrt();
    let size = moved.len();
    let step = DVector::from_fn(size, |k, _| fit.estimate[moved[k]] / std(moved[k]));
    let correlation = DMatrix::from_fn(size, size, |row, column| {
        let (a, b) = (moved[row], moved[column]);
        fit.covariance[(a, b)] / (std(a) * std(b))
    });
    let solved = correlation.cholesky().map(|root| root.solve(&step));
    solved.map_or(0.0, |solved| 0.5 * step.dot(&solved))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rlg_catalogue::Candidate;
    use rlg_catalogue::candidates::Variant;
    use rlg_inference::{Fit, Hypothesis};

    use super::Step;

    const STD: f64 = 0.1;

    fn candidate(kind: &'static str, base: &[f64]) -> Candidate {
        Candidate {
            kind,
            variant: Variant::Whole,
            names: base.iter().map(f64::to_string).collect(),
            base: base.to_vec(),
            hypothesis: Hypothesis::of_terms(base.len(), Vec::new()),
        }
    }

    /// Fit of all `candidates`, two parameters each, estimates with the same standard deviation and no correlation.
    fn fit(estimate: &[f64]) -> Fit {
        let members: Vec<usize> = (0..estimate.len() / 2).collect();
        Fit {
            blocks: members.iter().map(|k| 2 * k..2 * k + 2).collect(),
            log_likelihood: 0.0,
            score: 0.0,
            levels: Vec::new(),
            drift: Vec::new(),
            gaps: Vec::new(),
            covariance: DMatrix::identity(estimate.len(), estimate.len()) * (STD * STD),
            estimate: DVector::from_row_slice(estimate),
            ranks: vec![2; members.len()],
            squared_sizes: vec![1.0; members.len()],
            is_redundant: false,
            impossible: Vec::new(),
            members,
        }
    }

    #[test]
    fn a_step_is_halved_three_times_and_then_not_taken() {
        let candidates = [
            candidate("gyro_scale", &[0.0, 0.0]),
            candidate("isolator_mode", &[59.0, 0.02]),
            candidate("gyro_delay", &[0.0, 1e-3]),
        ];
        let mut fit = fit(&[8.0, 8.0, 8.0, -8.0, 8.0, 8.0]);
        let mut step =
            Step::of(0.0, &fit, &candidates).expect("two members have numbers in columns");
        for left in [4.0, 2.0, 1.0, 0.0] {
            assert!(!step.is_none());
            step = step.halved(&mut fit, &candidates);
            let expected = [8.0, 8.0, left, -left, left, left];
            assert_eq!(fit.estimate.as_slice(), expected);
        }
        assert!(step.is_none());
        assert!(!step.is_worse(f64::NEG_INFINITY));
        let linear = &candidates[..1];
        assert!(Step::of(0.0, &self::fit(&[8.0, 8.0]), linear).is_none());
    }

    #[test]
    fn a_pass_is_worse_that_has_less_than_no_step_would() {
        let candidates = [candidate("isolator_mode", &[59.0, 0.02])];
        // Steps of 3 and 4 standard deviations gain 12.5.
        let long = Step::of(100.0, &fit(&[3.0 * STD, -4.0 * STD]), &candidates)
            .expect("a mount has numbers in columns");
        assert!(!long.is_worse(87.6));
        assert!(long.is_worse(87.4));
    }

    /// Resonance whose full step overshoots the maximum.
    #[test]
    fn an_overshooting_step_ends_nearer_to_the_top_than_it_began() {
        const TOP_HZ: f64 = 60.0;
        const BEGUN_HZ: f64 = 58.5;
        let odds_at = |hz: f64| -100.0 * ((hz - TOP_HZ) / 2.0).powi(2).min(4.0);
        let candidates = [candidate("isolator_mode", &[BEGUN_HZ, 0.02])];
        let mut fit = fit(&[14.0, 0.0]);
        let mut step = Step {
            odds: odds_at(BEGUN_HZ),
            gain: 0.0,
            halvings: 0,
        };
        while step.is_worse(odds_at(BEGUN_HZ + fit.estimate[0])) {
            step = step.halved(&mut fit, &candidates);
        }
        let end_hz = BEGUN_HZ + fit.estimate[0];
        assert!(end_hz > BEGUN_HZ, "{end_hz} Hz");
        assert!((end_hz - TOP_HZ).abs() < TOP_HZ - BEGUN_HZ, "{end_hz} Hz");
    }
}
