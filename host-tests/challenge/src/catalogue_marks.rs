//! Marks of the diagnosis, each with its measured value and number of trials.
//!
//! A [`Mark`] without any trial states so and neither passes nor fails.

use serde::Serialize;

use super::answer::LADDER;
use super::case::{Case, NAMEABLE, Plan, STRONG, one_deviation, unread};
use super::chance::{limits, upper_limit};
use super::trial::Family;

/// One mark.
#[derive(Debug, Clone, Serialize)]
pub struct Mark {
    /// Name of the measured quantity.
    pub mark: String,
    /// Requirement.
    pub needed: String,
    /// Measured value.
    pub measured: Option<f64>,
    /// 95 % limits of the measured value.
    pub limits: [f64; 2],
    /// Number of trials behind the value.
    pub trials: usize,
    /// The requirement is met.
    pub met: Option<bool>,
    /// The limits confirm that; if not, more trials may change it.
    pub sure: bool,
}

/// Limit for the requirement "none": zero of a thousand trials bounds the share by this.
const NONE: f64 = 3e-3;

/// Comparison of a value with its requirement.
enum Need {
    AtLeast(f64),
    AtMost(f64),
    Within(f64, f64),
}

fn mark(name: &str, need: Need, measured: f64, limits: [f64; 2], trials: usize) -> Mark {
    let some = trials > 0 && measured.is_finite();
    let [low, high] = limits;
    let (needed, met, sure) = match need {
        Need::AtLeast(least) => (
            format!("≥ {least}"),
            measured >= least,
            low >= least || high < least,
        ),
        Need::AtMost(most) => (
            format!("≤ {most}"),
            measured <= most,
            high <= most.max(NONE) || low > most,
        ),
        Need::Within(at, by) => (
            format!("{at} ± {by}"),
            (measured - at).abs() <= by,
            (low >= at - by && high <= at + by) || low > at + by || high < at - by,
        ),
    };
    Mark {
        mark: name.to_owned(),
        needed,
        measured: some.then_some(measured),
        limits,
        trials,
        met: some.then_some(met),
        sure: some && sure,
    }
}

fn share(name: &str, need: Need, of: &[&Case], hit: impl Fn(&Case) -> bool) -> Mark {
    let hits = of.iter().filter(|case| hit(case)).count();
    let measured = hits as f64 / of.len().max(1) as f64;
    mark(name, need, measured, limits(hits, of.len()), of.len())
}

/// Root mean square, with limits from the scatter of the squares.
fn rms(name: &str, need: Need, values: &[f64]) -> Mark {
    let count = values.len().max(1) as f64;
    let squares: Vec<f64> = values.iter().map(|value| value * value).collect();
    let mean = squares.iter().sum::<f64>() / count;
    let scatter = squares
        .iter()
        .map(|square| (square - mean).powi(2))
        .sum::<f64>()
        / count;
    let error = 1.96 * (scatter / count).sqrt();
    let ends = [mean - error, mean + error].map(|end| end.max(0.0).sqrt());
    mark(name, need, mean.sqrt(), ends, values.len())
}

/// Computes all marks.
pub fn marks(plan: &Plan, cases: &[Case]) -> Vec<Mark> {
    let of = |families: &[Family]| -> Vec<&Case> {
        cases
            .iter()
            .filter(|case| families.contains(&case.answer.family))
            .collect()
    };
    let strong = |case: &&&Case| case.is_nameable();
    let listed = of(&[Family::Single, Family::Detection]);
    let answered = share(
        "recordings that got no verdict",
        Need::AtMost(0.0),
        &cases.iter().collect::<Vec<_>>(),
        |case| unread(case.outcome),
    );
    if plan.leave_one_out {
        let out: Vec<&Case> = listed.iter().filter(strong).copied().collect();
        let wrong = share(
            "true entry left out, ρ ≥ 8, separation ≥ 6: wrong confident name",
            Need::AtMost(0.0),
            &out,
            |case| case.wrong().next().is_some(),
        );
        return vec![wrong, answered];
    }
    let nulls = of(&[Family::Null]);
    let false_names = nulls.iter().filter(|case| case.is_false()).count();
    let mut list = vec![mark(
        "false name on effect-free records",
        Need::AtMost(0.0),
        false_names as f64 / nulls.len().max(1) as f64,
        [
            limits(false_names, nulls.len())[0],
            upper_limit(false_names, nulls.len()),
        ],
        nulls.len(),
    )];
    for (rho, least) in [(6.0, 0.85), (7.0, 0.97), (10.0, 0.995)] {
        debug_assert!(LADDER.contains(&rho));
        let rung: Vec<&Case> = of(&[Family::Detection])
            .into_iter()
            .filter(|case| (case.answer.rho - rho).abs() < 1e-6)
            .collect();
        let name = format!("six-parameter effect detected at ρ = {rho}");
        list.push(share(&name, Need::AtLeast(least), &rung, |case| {
            case.is_detected()
        }));
    }
    let nameable: Vec<&Case> = listed
        .iter()
        .filter(strong)
        .filter(|case| case.is_detected())
        .copied()
        .collect();
    list.push(share(
        "right name given detection, ρ ≥ 8 and separation ≥ 6",
        Need::AtLeast(0.98),
        &nameable,
        |case| case.is_named(),
    ));
    let pairs: Vec<&Case> = of(&[Family::Pair])
        .into_iter()
        .filter(|case| case.is_nameable())
        .collect();
    list.push(share(
        "two effects, each as above: both named",
        Need::AtLeast(0.98),
        &pairs,
        |case| case.is_named(),
    ));
    let errors: Vec<f64> = listed
        .iter()
        .filter(|case| case.answer.rho >= STRONG && case.is_named())
        .flat_map(|case| case.deviations())
        .map(|[_, over_bound]| over_bound)
        .collect();
    list.push(rms(
        "parameter rms error over the Cramér–Rao bound, ρ ≥ 10",
        Need::AtMost(1.05),
        &errors,
    ));
    list.extend(coverage(cases));
    list.extend(outside(&of(&[Family::Unlisted])));
    list.extend(confounded(&of(&[Family::Confounded])));
    list.push(held_out(&of(&[
        Family::Single,
        Family::Detection,
        Family::Pair,
    ])));
    let noisy: Vec<&Case> = of(&[Family::Noise])
        .into_iter()
        .filter(|case| case.answer.rho >= NAMEABLE)
        .collect();
    list.push(share(
        "more noise, deflection ≥ 8: named",
        Need::AtLeast(0.98),
        &noisy,
        |case| case.is_named(),
    ));
    list.push(answered);
    list
}

/// Coverage of the intervals: of one parameter a trial (independent), and of all parameters, with limits from the scatter
/// between trials.
fn coverage(cases: &[Case]) -> Vec<Mark> {
    let deviations = one_deviation(cases);
    let all: Vec<Vec<[f64; 2]>> = cases
        .iter()
        .filter(|case| case.is_named())
        .map(Case::deviations)
        .collect();
    const NOMINAL: [(f64, f64); 2] = [(1.0, 0.683), (2.0, 0.954)];
    let of_all = NOMINAL.map(|(sigmas, nominal)| share_of_all(&all, sigmas, nominal));
    let of_one = NOMINAL.into_iter().map(|(sigmas, nominal)| {
        let hits = deviations
            .iter()
            .filter(|[own, _]| own.abs() <= sigmas)
            .count();
        let count = deviations.len();
        let measured = hits as f64 / count.max(1) as f64;
        let name = format!("{:.1} % intervals cover", 100.0 * nominal);
        mark(
            &name,
            Need::Within(nominal, 0.02),
            measured,
            limits(hits, count),
            count,
        )
    });
    of_one.chain(of_all).collect()
}

/// Share of all trials' parameters within so many standard deviations.
fn share_of_all(trials: &[Vec<[f64; 2]>], sigmas: f64, nominal: f64) -> Mark {
    let count: usize = trials.iter().map(Vec::len).sum();
    let hits = |trial: &Vec<[f64; 2]>| {
        let within = trial.iter().filter(|[own, _]| own.abs() <= sigmas);
        within.count() as f64
    };
    let share = trials.iter().map(hits).sum::<f64>() / count.max(1) as f64;
    let scatter = trials
        .iter()
        .map(|trial| (hits(trial) - share * trial.len() as f64).powi(2));
    let error = 1.96 * scatter.sum::<f64>().sqrt() / count.max(1) as f64;
    mark(
        &format!("the same {:.1} %, every parameter", 100.0 * nominal),
        Need::Within(nominal, 0.02),
        share,
        [(share - error).max(0.0), (share + error).min(1.0)],
        count,
    )
}

fn outside(cases: &[&Case]) -> [Mark; 3] {
    let strong: Vec<&Case> = cases
        .iter()
        .filter(|case| case.answer.rho >= NAMEABLE)
        .copied()
        .collect();
    let separate: Vec<&Case> = strong
        .iter()
        .filter(|case| case.is_nameable())
        .copied()
        .collect();
    let wrong = |case: &Case| case.wrong().next().is_some();
    [
        share(
            "outside the catalogue, ρ ≥ 8 and separation ≥ 6: wrong confident name",
            Need::AtMost(0.01),
            &separate,
            wrong,
        ),
        share(
            "the same, ρ ≥ 8, however near a rival is",
            Need::AtMost(0.01),
            &strong,
            wrong,
        ),
        share(
            "outside the catalogue, ρ ≥ 8 and separation ≥ 6: unknown or unlisted",
            Need::AtLeast(0.9),
            &separate,
            |case| {
                case.outcome
                    .findings
                    .iter()
                    .any(|one| one.kind == "unlisted")
            },
        ),
    ]
}

fn confounded(cases: &[&Case]) -> [Mark; 2] {
    let found: Vec<&Case> = cases
        .iter()
        .filter(|case| case.answer.rho >= NAMEABLE && case.is_detected())
        .copied()
        .collect();
    let class = |case: &Case| {
        let [only] = case.answer.effects.as_slice() else {
            return false;
        };
        case.claims().any(|one| {
            one.covers(&only.kind)
                && case
                    .answer
                    .partner
                    .as_deref()
                    .is_some_and(|kind| one.covers(kind))
        })
    };
    // |s − ŝ|² has the number of the effect's identifiable directions as degrees of freedom.
    let errors: Vec<f64> = found
        .iter()
        .filter(|case| case.answer.rho >= STRONG && class(case))
        .filter_map(|case| {
            let degrees: usize = case
                .answer
                .effects
                .iter()
                .map(|effect| effect.degrees)
                .sum();
            Some((case.outcome.leaves?[0] / degrees.max(1) as f64).sqrt())
        })
        .collect();
    [
        share(
            "confounded by design: reported as a class",
            Need::AtLeast(1.0),
            &found,
            class,
        ),
        rms(
            "confounded: error of the combination over its bound, ρ ≥ 10",
            Need::AtMost(1.1),
            &errors,
        ),
    ]
}

/// Mean of (power removed from the held-out rows)/(power removed by the oracle).
fn held_out(cases: &[&Case]) -> Mark {
    let shares: Vec<f64> = cases
        .iter()
        .filter(|case| case.answer.rho >= STRONG)
        .filter_map(|case| {
            let oracle = case.answer.held_out - case.answer.oracle_leaves;
            // If the held-out rows hardly show the effect, there is nothing to gain.
            let shows = case.answer.held_out > 2.0 * case.answer.oracle_leaves;
            let known = case.answer.oracle_leaves > 0.0;
            // An expression is not scored here, and counts as no gain.
            let left = case
                .outcome
                .leaves
                .map_or(case.answer.held_out, |[_, left]| left);
            (shows && known).then(|| (case.answer.held_out - left) / oracle)
        })
        .collect();
    let count = shares.len().max(1) as f64;
    let mean = shares.iter().sum::<f64>() / count;
    let scatter = shares
        .iter()
        .map(|share| (share - mean).powi(2))
        .sum::<f64>()
        / count;
    let error = 1.96 * (scatter / count).sqrt();
    mark(
        "fit on held-out rows over an oracle's, ρ ≥ 10",
        Need::AtLeast(0.95),
        mean,
        [mean - error, mean + error],
        shares.len(),
    )
}

#[cfg(test)]
mod tests {
    use super::share_of_all;

    #[test]
    fn limits_of_all_parameters_know_that_those_of_a_trial_go_together() {
        // Ten trials of four parameters, within one deviation all together or not at all.
        let trial = |own: f64| vec![[own, 1.0]; 4];
        let trials: Vec<_> = [0.5, 2.0].into_iter().cycle().take(10).map(trial).collect();
        let mark = share_of_all(&trials, 1.0, 0.683);
        assert_eq!((mark.measured, mark.trials), (Some(0.5), 40));
        // 1.96 sqrt(10 * 2^2) / 40; forty independent parameters would give half of it.
        assert!((mark.limits[1] - 0.5 - 0.30990).abs() < 1e-4, "{mark:?}");
    }
}
