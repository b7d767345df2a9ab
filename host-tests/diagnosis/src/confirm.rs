//! What is found must hold in all blocks of the fitted rows, and where the recording is re-enacted without it; then it is
//! fitted again with drift chosen anew.

use std::ops::Range;

use rlg_catalogue::candidates::{PoolColumns, Variant};
use rlg_catalogue::entries::{STEP, UNLISTED};
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::block_validation::BlockSums;
use rlg_inference::events::{Instant, largest_impulse};
use rlg_inference::normal_equations::Transform;
use rlg_inference::{Bound, Fit, Hypothesis, NoiseBasis, NormalEquations, Observations, Search};
use rlg_signal::partition::Use;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::data::Data;
use super::goodness::{Misfit, misfits};
use super::lock_in::Stops;
use super::noise_levels::{drift_prior, mean};
use super::pass::left_on;
use super::plan::AnalysisPlan;
use super::reenact::{Named, Reenactment, reenact};
use super::search::{Found, effect_rad, subtract};
use super::whitened::Whitener;
use rlg_signal::streams::{Triad, add};

/// What blocks of the fitted rows say of a member, each predicted by the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Log score that the member gains there.
    pub gain: f64,
    /// By how much blocks that disagree say that its likelihood ratio is too large; 1 where chance may make them disagree.
    pub design_effect: f64,
    /// Whether it holds there, whatever its size.
    pub holds: bool,
}

/// What blocks of the fitted rows say of each member of the found set. A step, a slip or a window happens in few blocks, and no
/// other can predict it; slip and window hold where the rows have no more like them.
///
/// # Returns
/// In the order of the set; `None` where too few rows are fitted.
fn predictions(data: &Data, found: &Found, plan: &AnalysisPlan) -> Option<Vec<Prediction>> {
    let fit = &found.fit;
    let whitener = Whitener::new(data, &fit.levels)?;
    let whitened = |gyro: usize, rows: &[f64]| whitener.rows(gyro, rows);
    let MemberColumns {
        columns,
        own,
        fixed,
    } = columns_of(found, &whitened);
    let records: Vec<Vec<f64>> = (0..3)
        .map(|gyro| whitened(gyro, &found.residual_rad[gyro]))
        .collect();
    let sums = BlockSums::new(
        &records,
        &columns,
        &plan.blocks.of(&whitener.seen, data.streams.rate_hz),
    );
    let (transform, basis) = (&whitener.transform, &whitener.basis);
    let left_rad = left_by(found, fit);
    let of_member = |place: usize| {
        let candidate = &found.candidates[fit.members[place]];
        let Some(axis) = gyro_of_event(candidate) else {
            // What is made behind it goes with it.
            let member = fit.members[place];
            let with_it = (0..own.len()).filter(|&other| {
                let hypothesis = &found.candidates[fit.members[other]].hypothesis;
                other == place || hypothesis.requires == Some(member)
            });
            let parameters: Vec<usize> = with_it.flat_map(|other| own[other].clone()).collect();
            let said = sums.validate(&parameters, &fixed);
            let law = ChiSquared::new(said.freedom).ok();
            let is_chance = law.is_none_or(|law| {
                law.sf(said.design_effect * said.freedom) > plan.reenactment_chance
            });
            return Prediction {
                gain: said.gain,
                design_effect: if is_chance { 1.0 } else { said.design_effect },
                holds: said.gain > 0.0,
            };
        };
        let without = &found.without[place];
        let spectrum = transform.spectrum(&left_rad[axis]);
        let largest = largest_impulse(transform, basis, &spectrum, fit.levels[axis]);
        let rows = transform.observations().rows() as f64;
        Prediction {
            gain: fit.log_likelihood - without.log_likelihood,
            design_effect: 1.0,
            holds: candidate.kind == STEP
                || 2.0 * rows * Normal::standard().sf(largest) > plan.unexplained,
        }
    };
    Some((0..fit.members.len()).map(of_member).collect())
}

/// The gyro to which a candidate happens once; `None` where it acts all along.
fn gyro_of_event(candidate: &Candidate) -> Option<usize> {
    match candidate.variant {
        Variant::Event { axis, .. } => Some(axis),
        Variant::Expression { axis, expression } => expression.is_window().then_some(axis),
        _ => None,
    }
}

/// Whitened columns of a set's parameters.
struct MemberColumns {
    /// By gyro and parameter.
    columns: Vec<Vec<Vec<f64>>>,
    /// Parameters of each member.
    own: Vec<Range<usize>>,
    /// Parameters that stand for what a member does without one.
    fixed: Vec<usize>,
}

/// Forms the whitened columns of the members' parameters.
fn columns_of(found: &Found, whitened: &impl Fn(usize, &[f64]) -> Vec<f64>) -> MemberColumns {
    let signals = &found.motion.signals;
    let mut columns: Vec<Vec<Vec<f64>>> = vec![Vec::new(); 3];
    let (mut own, mut fixed) = (Vec::new(), Vec::new());
    for &member in &found.fit.members {
        let candidate = &found.candidates[member];
        let parameters = candidate.hypothesis.parameters;
        let whole = candidate.hypothesis.with_fixed_as_parameter();
        let first = columns[0].len();
        for (gyro, columns) in columns.iter_mut().enumerate() {
            for parameter in 0..whole.parameters {
                let mut sum: Vec<f64> = Vec::new();
                let mut terms = whole.terms.iter();
                let acts = terms.any(|term| term.record == gyro && term.parameter == parameter);
                if acts {
                    sum = vec![0.0; signals.rows];
                    let terms = whole.terms.iter();
                    for term in terms.filter(|one| one.record == gyro && one.parameter == parameter)
                    {
                        let values = found.pool.columns[term.column].values(signals);
                        add(&mut sum, &values, term.coefficient);
                    }
                    sum = whitened(gyro, &sum);
                }
                columns.push(sum);
            }
        }
        if whole.parameters > parameters {
            fixed.push(first + parameters);
        }
        own.push(first..first + whole.parameters);
    }
    MemberColumns {
        columns,
        own,
        fixed,
    }
}

/// What a fit over the found candidates leaves \[rad\].
fn left_by(found: &Found, fit: &Fit) -> Triad {
    let mut left_rad = found.residual_rad.clone();
    let signals = &found.motion.signals;
    subtract(&mut left_rad, fit, &found.candidates, &found.pool, signals);
    left_rad
}

/// When a member of a fit happened, if it is a step: its gyro, what the others leave there \[rad\] and the instant by the rows
/// of a transform.
fn instant(
    found: &Found,
    fit: &Fit,
    place: usize,
    left_rad: &Triad,
    (transform, basis): (&Transform, &NoiseBasis),
) -> Option<(usize, Vec<f64>, Instant)> {
    let candidate = &found.candidates[fit.members[place]];
    let Variant::Event { axis, row } = candidate.variant else {
        return None;
    };
    if candidate.kind != STEP {
        return None;
    }
    let mut with_rad = left_rad[axis].clone();
    add(&mut with_rad, &effect_rad(found, fit, place)[axis], 1.0);
    let around = (row, fit.squared_sizes[place].sqrt());
    let levels = fit.levels[axis];
    let instant = Instant::around(transform, basis, levels, &with_rad, around);
    Some((axis, with_rad, instant))
}

/// Members of the found set by what becomes of them.
pub struct Confirmed {
    /// Those with a name, as places in [`Found::judged`].
    pub named: Vec<usize>,
    /// What a named member is called, as places in [`Found::candidates`].
    pub headlines: Vec<usize>,
    /// What blocks of the fitted rows say of every member of the found set.
    pub predictions: Vec<Prediction>,
    /// Places in [`Found::judged`] that do not hold there.
    pub unconfirmed: Vec<usize>,
    /// Places in [`Found::judged`] that the recording re-enacted without them shows as well.
    pub reenacted_away: Vec<usize>,
    /// Places in [`Found::judged`] whose value no unit can have where all rows are fitted.
    pub impossible: Vec<usize>,
    /// Re-enactments without each named member.
    pub reenactments: Vec<Reenactment>,
    /// Standard deviation of the instant of each named step \[rows\].
    pub instant_std_rows: Vec<Option<f64>>,
    /// The fit of the headlines.
    pub last: Final,
}

/// Takes away what does not hold in blocks of the rows, and what the recording shows even where it is re-enacted without it; `None`
/// where too few rows are left.
pub fn confirmed(data: &Data, found: &mut Found, plan: &AnalysisPlan) -> Option<Confirmed> {
    let predictions = predictions(data, found, plan)?;
    let is_costly = |place: &usize| found.judged[*place].cost_without > plan.naming;
    // Blocks that disagree say that the likelihood ratio is that much too large.
    let holds = |place: &usize| {
        let said = &predictions[*place];
        let ratio = found.fit.log_likelihood - found.without[*place].log_likelihood;
        let lost = ratio * (1.0 - 1.0 / said.design_effect);
        said.holds && found.judged[*place].cost_without - lost > plan.naming
    };
    let (mut named, unconfirmed): (Vec<usize>, Vec<usize>) =
        (0..found.judged.len()).filter(is_costly).partition(holds);
    let (mut reenacted_away, mut impossible) = (Vec::new(), Vec::new());
    loop {
        let mut headlines: Vec<usize> = named.iter().map(|&place| headline(found, place)).collect();
        let mut last = refit(data, found, &headlines, plan)?;
        let instant_std_rows = settle_instants(data, found, &mut headlines, &last);
        if instant_std_rows.iter().any(Option::is_some) {
            last = refit(data, found, &headlines, plan)?;
        }
        if let Some(&place) = last.fit.impossible.first() {
            impossible.push(named.remove(place));
            continue;
        }
        let ratios: Vec<Named> = named
            .iter()
            .map(|&place| Named {
                log_likelihood_ratio: found.fit.log_likelihood
                    - found.without[place].log_likelihood,
                to_spare: found.judged[place].cost_without - plan.naming,
            })
            .collect();
        let reenactments = reenact(data, found, (&last.fit, &ratios), plan);
        let Some(weakest) = (0..named.len())
            .filter(|&place| ratios[place].falls(&reenactments[place], plan))
            .max_by(|&a, &b| {
                reenactments[a]
                    .inflation()
                    .total_cmp(&reenactments[b].inflation())
            })
        else {
            return Some(Confirmed {
                named,
                headlines,
                predictions,
                unconfirmed,
                reenacted_away,
                impossible,
                reenactments,
                instant_std_rows,
                last,
            });
        };
        reenacted_away.push(named.remove(weakest));
    }
}

/// Puts every step among the `headlines` at its mean instant by the rows to fit and to confirm.
///
/// # Returns
/// Standard deviation of each headline's instant \[rows\], where it has one.
fn settle_instants(
    data: &Data,
    found: &mut Found,
    headlines: &mut [usize],
    last: &Final,
) -> Vec<Option<f64>> {
    let is_step = |place: &usize| found.candidates[*place].kind == STEP;
    if !headlines.iter().any(is_step) {
        return vec![None; headlines.len()];
    }
    let Some(observations) = Observations::bridged(&data.rows_of(&[Use::Train, Use::Confirm]))
    else {
        return vec![None; headlines.len()];
    };
    let (transform, basis) = Transform::with_basis(observations, mean(&last.fit.levels));
    let mut std_rows = Vec::with_capacity(headlines.len());
    for (place, headline) in headlines.iter_mut().enumerate() {
        let known = instant(
            found,
            &last.fit,
            place,
            &last.left_rad,
            (&transform, &basis),
        );
        std_rows.push(known.map(|(axis, _, instant)| {
            let places = found.candidates[*headline].hypothesis.price.exp();
            let signals = &found.motion.signals;
            let step = found.pool.event(STEP, axis, instant.row(), places, signals);
            *headline = found.candidates.len();
            found.candidates.push(step);
            instant.std_rows()
        }));
    }
    std_rows
}

/// The candidate with the fewest free numbers among a member and the rivals that reach it.
fn headline(found: &Found, place: usize) -> usize {
    let judged = &found.judged[place];
    // An expression is no name where a listed effect reaches it.
    let numbers = |candidate: usize| {
        let one = &found.candidates[candidate];
        (one.kind == UNLISTED, one.hypothesis.parameters)
    };
    let own = judged.hypothesis;
    let simplest = judged.rivals.iter().fold(own, |best, &(rival, _)| {
        if numbers(rival) < numbers(best) {
            rival
        } else {
            best
        }
    });
    // Of two names for the same columns that of the gyro comes first, as in the catalogue.
    let all = &found.candidates;
    (0..simplest)
        .find(|&other| is_same_column(&all[other].hypothesis, &all[simplest].hypothesis))
        .unwrap_or(simplest)
}

/// Whether two hypotheses of parameters of any sign scale the same columns into the same records.
fn is_same_column(a: &Hypothesis, b: &Hypothesis) -> bool {
    let is_free = |one: &Hypothesis| {
        let mut ranges = (0..one.parameters).map(|k| one.bound(k).range);
        one.fixed.is_empty() && ranges.all(|range| range == Bound::NONE.range)
    };
    let places = |one: &Hypothesis| -> Vec<(usize, usize, usize)> {
        let terms = one.terms.iter();
        let mut places: Vec<_> = terms
            .map(|term| (term.parameter, term.record, term.column))
            .collect();
        places.sort_unstable();
        places
    };
    is_free(a) && is_free(b) && places(a) == places(b)
}

/// What is found, fitted on rows to fit and rows to confirm together.
pub struct Final {
    /// The fit, its blocks in the order of the members.
    pub fit: Fit,
    /// What it leaves \[rad\].
    pub left_rad: Triad,
    /// Where what it leaves is not the noise that was fitted.
    pub misfits: Vec<Misfit>,
}

/// Fits `members`, places in `found.candidates`; `None` where too few rows are left.
fn refit(data: &Data, found: &Found, members: &[usize], plan: &AnalysisPlan) -> Option<Final> {
    let fitted = data.rows_of(&[Use::Train, Use::Confirm]);
    let observations = Observations::bridged(&fitted)?.to_fast_length();
    let mut pool = Pool::default();
    let candidates: Vec<Candidate> = members
        .iter()
        .map(|&member| pool.adopt(&found.candidates[member], &found.pool.columns))
        .collect();
    let hypotheses: Vec<Hypothesis> = candidates
        .iter()
        .map(|one| one.hypothesis.clone())
        .collect();
    let made = PoolColumns {
        columns: &pool.columns,
        signals: &found.motion.signals,
    };
    let levels = &found.fit.levels;
    let equations = NormalEquations::new(observations, &found.residual_rad, &made, mean(levels));
    let drift = drift_prior(&data.model.gyro);
    let kinds = hypotheses.len().max(1);
    // Drift is chosen anew: what had no name may have stood for it.
    let mut search = Search::new(
        &equations,
        &hypotheses,
        kinds,
        &plan.search,
        &drift,
        levels.clone(),
    );
    let all: Vec<usize> = (0..hypotheses.len()).collect();
    let mut fit = search.fit(&all, None);
    let misfits = (0..3)
        .flat_map(|gyro| {
            let residual = left_on(&equations, &fit, &candidates, gyro);
            let basis = equations.basis_beside_gaps(fit.levels[gyro]);
            misfits(&basis, &residual, fit.levels[gyro], gyro, plan)
        })
        // What counting makes is no white noise of angle where pulses come rarely, and never more than a pulse.
        .filter(|one| !data.lattice.hides_angle(one.gyro, one.angle_rms_rad))
        .collect();
    let stops = Stops {
        data,
        signals: &found.motion.signals,
        equations: &equations,
    };
    for (candidate, block) in candidates.iter().zip(fit.blocks.clone()) {
        stops.widen(candidate, &pool, &mut fit, block.start);
    }
    fit.members = members.to_vec();
    Some(Final {
        left_rad: left_by(found, &fit),
        fit,
        misfits,
    })
}
