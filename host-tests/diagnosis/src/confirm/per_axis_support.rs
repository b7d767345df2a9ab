//! Gyros whose own data determine a parameter that a member shares between all of them.

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::{Fit, Hypothesis, Likelihood};
use rlg_plan::Plan;

/// Selects them for each member: a gyro that hardly moves would be reported with another's parameter and its uncertainty.
///
/// # Inputs
/// `set`: each member's hypothesis over records that are three to a recording, with its candidate; `fit`: of that set.
pub(crate) fn supported(
    data: &impl Likelihood,
    set: &[(&Hypothesis, &Candidate)],
    fit: &Fit,
    plan: &Plan,
) -> Vec<[bool; 3]> {
    // Difference in log likelihood that is not significant.
    let within = plan.judgement.class_within;
    let of_member = |place: usize| {
        let (shared, candidate) = set[place];
        if candidate.variant != Variant::Common {
            return [true; 3];
        }
        let apart = apart(shared);
        let hypotheses: Vec<&Hypothesis> = (0..set.len())
            .map(|other| if other == place { &apart } else { set[other].0 })
            .collect();
        let (levels, drift) = (&fit.levels, &fit.drift);
        let each = evaluate(
            data,
            &hypotheses,
            levels,
            drift,
            Effort::QUICK,
            &plan.inference.search,
        );
        let value = candidate.base[0] + fit.estimate[fit.blocks[place].start];
        let first = each.blocks[place].start;
        let supported = [0, 1, 2].map(|gyro: usize| {
            let acts = apart.terms.iter().any(|term| term.parameter == gyro);
            let at = first + gyro;
            acts && 0.5 * value * value > within * each.covariance[(at, at)]
        });
        if supported == [false; 3] {
            [true; 3]
        } else {
            supported
        }
    };
    (0..set.len()).map(of_member).collect()
}

/// The same with a parameter for each gyro.
fn apart(shared: &Hypothesis) -> Hypothesis {
    let mut apart = shared.clone();
    apart.parameters = 3;
    apart.bounds.clear();
    for term in &mut apart.terms {
        term.parameter = term.record % 3;
    }
    apart
}
