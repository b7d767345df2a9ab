//! What is found must hold in all blocks of the fitted rows, and where the recording is re-enacted without it; then it is
//! fitted again with drift chosen anew.

use std::ops::Range;

use rlg_catalogue::candidates::{PoolColumns, Variant, is_delay};
use rlg_catalogue::entries::{STEP, UNLISTED};
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::block_validation::BlockSums;
use rlg_inference::events::{Instant, largest_impulse};
use rlg_inference::normal_equations::Transform;
use rlg_inference::search::Judged;
use rlg_inference::{Bound, Fit, Hypothesis, NoiseBasis, NoiseLevels, NormalEquations, Search};
use rlg_signal::partition::Use;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::data::Data;
use super::goodness::{Misfit, misfits};
use super::lock_in::Stops;
use super::noise_levels::drift_prior;
use super::pass::{left_on, subtract};
use super::plan::AnalysisPlan;
use super::reenact::{Named, Reenactment, reenact};
use super::search::{Found, effect_rad};
use super::told::told;
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

impl Prediction {
    /// Whether a member keeps its name: blocks that disagree say that its likelihood ratio is that much too large.
    pub(super) fn keeps(&self, found: &Found, place: usize, plan: &AnalysisPlan) -> bool {
        let ratio = found.fit.log_likelihood - found.without[place].log_likelihood;
        let lost = ratio * (1.0 - 1.0 / self.design_effect);
        self.holds && found.judged[place].cost_without - lost > plan.naming
    }
}

/// Whitened rows of the fitted blocks, and what they were whitened with.
pub(super) struct Whitened {
    pub(super) sums: BlockSums,
    whitener: Whitener,
}

/// Whitens rows and members' columns, and sums them over blocks; `None` where too few rows are fitted.
///
/// # Inputs
/// `set`: parameters of each member of the found set, on the recording's own records.
pub(super) fn whiten(
    data: &Data,
    found: &Found,
    set: &[Hypothesis],
    plan: &AnalysisPlan,
) -> Option<Whitened> {
    let whitener = Whitener::new(data, &found.fit.levels)?;
    let whitened = |gyro: usize, rows: &[f64]| whitener.rows(gyro, rows);
    let signals = &found.motion.signals;
    let values = |column: usize| found.pool.columns[column].values(signals);
    let columns = columns_of(set, signals.rows, &values, &whitened);
    let records: Vec<Vec<f64>> = (0..3)
        .map(|gyro| whitened(gyro, &found.residual_rad[gyro]))
        .collect();
    let blocks = plan.blocks.of(&whitener.seen, data.streams.rate_hz);
    let sums = BlockSums::new(&records, &columns, &blocks);
    Some(Whitened { sums, whitener })
}

/// Parameters of a set, what members do without one as one more of each.
pub(super) struct Parameters {
    /// Of each member.
    pub(super) own: Vec<Range<usize>>,
    /// Those that stand for what a member does without one.
    pub(super) fixed: Vec<usize>,
}

impl Parameters {
    pub(super) fn of<'a>(set: impl Iterator<Item = &'a Hypothesis>) -> Self {
        let (mut own, mut fixed) = (Vec::new(), Vec::new());
        let mut first = 0;
        for one in set {
            let whole = one.parameters + usize::from(!one.fixed.is_empty());
            if whole > one.parameters {
                fixed.push(first + one.parameters);
            }
            own.push(first..first + whole);
            first += whole;
        }
        Self { own, fixed }
    }
}

/// What blocks of the fitted rows say of each member of the found set. A step, a slip or a window happens in few blocks, and no
/// other can predict it; slip and window hold where the rows have no more like them.
///
/// # Returns
/// In the order of the set; `None` where too few rows are fitted.
fn predictions(data: &Data, found: &Found, plan: &AnalysisPlan) -> Option<Vec<Prediction>> {
    let members = &found.fit.members;
    let members = members
        .iter()
        .map(|&place| &found.candidates[place].hypothesis);
    let set: Vec<Hypothesis> = members
        .clone()
        .map(Hypothesis::with_fixed_as_parameter)
        .collect();
    let parameters = Parameters::of(members);
    let whitened = whiten(data, found, &set, plan)?;
    let left_rad = left_by(found, &found.fit);
    let of_member = |place: usize| {
        let candidate = &found.candidates[found.fit.members[place]];
        match gyro_of_event(candidate) {
            Some(axis) => of_event(found, (place, axis), &left_rad, &whitened, plan),
            None => of_blocks(found, place, &parameters, &whitened.sums, plan),
        }
    };
    Some((0..found.fit.members.len()).map(of_member).collect())
}

/// What blocks say of a member that acts all along.
pub(super) fn of_blocks(
    found: &Found,
    place: usize,
    parameters: &Parameters,
    sums: &BlockSums,
    plan: &AnalysisPlan,
) -> Prediction {
    // What is made behind it goes with it.
    let members = &found.fit.members;
    let with_it = (0..members.len()).filter(|&other| {
        let hypothesis = &found.candidates[members[other]].hypothesis;
        other == place || hypothesis.requires == Some(members[place])
    });
    let own: Vec<usize> = with_it
        .flat_map(|other| parameters.own[other].clone())
        .collect();
    let said = sums.validate(&own, &parameters.fixed);
    let law = ChiSquared::new(said.freedom).ok();
    let is_chance =
        law.is_none_or(|law| law.sf(said.design_effect * said.freedom) > plan.reenactment_chance);
    Prediction {
        gain: said.gain,
        design_effect: if is_chance { 1.0 } else { said.design_effect },
        holds: said.gain > 0.0,
    }
}

/// What the rows say of a member that happens once to a gyro.
pub(super) fn of_event(
    found: &Found,
    (place, axis): (usize, usize),
    left_rad: &Triad,
    Whitened { whitener, .. }: &Whitened,
    plan: &AnalysisPlan,
) -> Prediction {
    let fit = &found.fit;
    let (transform, basis) = (&whitener.transform, &whitener.basis);
    let spectrum = transform.spectrum(&left_rad[axis]);
    let largest = largest_impulse(transform, basis, &spectrum, fit.levels[axis]);
    let rows = transform.observations().rows() as f64;
    let is_step = found.candidates[fit.members[place]].kind == STEP;
    Prediction {
        gain: fit.log_likelihood - found.without[place].log_likelihood,
        design_effect: 1.0,
        holds: is_step || 2.0 * rows * Normal::standard().sf(largest) > plan.unexplained,
    }
}

/// The gyro to which a candidate happens once; `None` where it acts all along.
pub(super) fn gyro_of_event(candidate: &Candidate) -> Option<usize> {
    match candidate.variant {
        Variant::Event { axis, .. } => Some(axis),
        Variant::Expression { axis, expression } => expression.is_window().then_some(axis),
        _ => None,
    }
}

/// Forms the whitened columns of a set's parameters, by gyro and parameter; empty where a parameter does nothing.
///
/// # Inputs
/// `values`: of a column by row.
pub(super) fn columns_of(
    set: &[Hypothesis],
    rows: usize,
    values: &impl Fn(usize) -> Vec<f64>,
    whitened: &impl Fn(usize, &[f64]) -> Vec<f64>,
) -> Vec<Vec<Vec<f64>>> {
    let mut columns: Vec<Vec<Vec<f64>>> = vec![Vec::new(); 3];
    for whole in set {
        for (gyro, columns) in columns.iter_mut().enumerate() {
            for parameter in 0..whole.parameters {
                let mut sum: Vec<f64> = Vec::new();
                let mut terms = whole.terms.iter();
                let acts = terms.any(|term| term.record == gyro && term.parameter == parameter);
                if acts {
                    sum = vec![0.0; rows];
                    let terms = whole.terms.iter();
                    for term in terms.filter(|one| one.record == gyro && one.parameter == parameter)
                    {
                        add(&mut sum, &values(term.column), term.coefficient);
                    }
                    sum = whitened(gyro, &sum);
                }
                columns.push(sum);
            }
        }
    }
    columns
}

/// What a fit over the found candidates leaves \[rad\].
pub(super) fn left_by(found: &Found, fit: &Fit) -> Triad {
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
    /// Kinds of such that an earlier search found, without which this one was made.
    pub shown_anyway: Vec<&'static str>,
    /// Places in [`Found::judged`] whose value no unit can have where all rows are fitted.
    pub impossible: Vec<usize>,
    /// Re-enactments without each named member.
    pub reenactments: Vec<Reenactment>,
    /// Standard deviation of the instant of each named step \[rows\].
    pub instant_std_rows: Vec<Option<f64>>,
    /// The one of several recordings that each named member is of; `None` where it is of all.
    pub recordings: Vec<Option<String>>,
    /// The fit of the headlines.
    pub last: Final,
}

/// Kinds that re-enactments show as well, without which something else may explain the recording. Not those of the path that
/// the motion was seen along.
///
/// # Inputs
/// `reenacted_away`: places in [`Found::judged`].
pub(crate) fn fallen(reenacted_away: &[usize], found: &Found) -> Vec<&'static str> {
    let members = reenacted_away.iter();
    let members = members.map(|&place| &found.candidates[found.judged[place].hypothesis]);
    members
        .filter(|one| !is_delay(one.kind) && one.variant != Variant::LowPass)
        .map(|one| one.kind)
        .collect()
}

/// Searches, and again without the kinds that fell, until none falls: they explain nothing of a recording that shows them even
/// where it is re-enacted without them.
///
/// # Inputs
/// `search`: without some kinds; what it leaves, and the kinds that [`fallen`] tells of it.
///
/// # Returns
/// What the last search leaves, and the kinds without which it was made besides `left_out`.
pub(crate) fn until_none_falls<T>(
    left_out: &[&str],
    progress: &dyn Fn(&str),
    mut search: impl FnMut(&[&str]) -> Option<(T, Vec<&'static str>)>,
) -> Option<(T, Vec<&'static str>)> {
    let mut shown_anyway: Vec<&'static str> = Vec::new();
    loop {
        let (left, fallen) = search(&[left_out, &shown_anyway[..]].concat())?;
        if fallen.is_empty() {
            return Some((left, shown_anyway));
        }
        progress("searching without what re-enactments show as well");
        shown_anyway.extend(fallen);
    }
}

/// Takes away what does not hold in blocks of the rows, and what the recording shows even where it is re-enacted without it; `None`
/// where too few rows are left.
pub fn confirmed(data: &Data, found: &mut Found, plan: &AnalysisPlan) -> Option<Confirmed> {
    let predictions = predictions(data, found, plan)?;
    let is_costly = |place: &usize| found.judged[*place].cost_without > plan.naming;
    let holds = |place: &usize| predictions[*place].keeps(found, *place, plan);
    let (mut named, unconfirmed): (Vec<usize>, Vec<usize>) =
        (0..found.judged.len()).filter(is_costly).partition(holds);
    let (mut reenacted_away, mut impossible) = (Vec::new(), Vec::new());
    loop {
        let mut headlines: Vec<usize> = named
            .iter()
            .map(|&place| {
                let reached_by = &found.reached_by[place];
                headline((&found.judged[place], reached_by), &found.candidates)
            })
            .collect();
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
            .map(|&place| in_doubt(found, place, plan))
            .collect();
        let reenactments = reenact(data, found, (&last.fit, &ratios), plan);
        let Some(weakest) = weakest(&ratios, &reenactments, plan) else {
            return Some(Confirmed {
                recordings: vec![None; named.len()],
                named,
                headlines,
                predictions,
                unconfirmed,
                reenacted_away,
                shown_anyway: Vec::new(),
                impossible,
                reenactments,
                instant_std_rows,
                last,
            });
        };
        reenacted_away.push(named.remove(weakest));
    }
}

/// The place of the name that falls and that re-enactments show most of; `None` where all stand.
pub(super) fn weakest(
    ratios: &[Named],
    reenactments: &[Reenactment],
    plan: &AnalysisPlan,
) -> Option<usize> {
    let inflation = |place: usize| reenactments[place].inflation();
    (0..ratios.len())
        .filter(|&place| ratios[place].falls(&reenactments[place], plan))
        .max_by(|&a, &b| inflation(a).total_cmp(&inflation(b)))
}

/// What of a member's log-likelihood ratio may go before its name does.
pub(super) fn in_doubt(found: &Found, place: usize, plan: &AnalysisPlan) -> Named {
    Named {
        log_likelihood_ratio: found.fit.log_likelihood - found.without[place].log_likelihood,
        to_spare: found.judged[place].cost_without - plan.naming,
    }
}

/// Puts every step among the `headlines` at its mean instant by the rows to fit and to confirm.
///
/// # Returns
/// Standard deviation of each headline's instant \[rows\], where it has one.
pub(super) fn settle_instants(
    data: &Data,
    found: &mut Found,
    headlines: &mut [usize],
    last: &Final,
) -> Vec<Option<f64>> {
    let is_step = |place: &usize| found.candidates[*place].kind == STEP;
    if !headlines.iter().any(is_step) {
        return vec![None; headlines.len()];
    }
    let Some(observations) = data.observed(&data.rows_of(&[Use::Train, Use::Confirm])) else {
        return vec![None; headlines.len()];
    };
    let (transform, basis) =
        Transform::with_basis(observations, NoiseLevels::mean(&last.fit.levels));
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

/// The candidate with the fewest free numbers among a member and the rivals that reach it; of an expression, those that explain
/// as much with more numbers among them.
pub(super) fn headline((judged, reached_by): (&Judged, &[usize]), all: &[Candidate]) -> usize {
    // An expression is no name where a listed effect reaches it.
    let numbers = |candidate: usize| {
        let one = &all[candidate];
        (one.kind == UNLISTED, one.hypothesis.parameters)
    };
    let own = judged.hypothesis;
    let spanning = reached_by.iter().filter(|_| all[own].kind == UNLISTED);
    let rivals = judged.rivals.iter().map(|(rival, _)| rival);
    let simplest = rivals.chain(spanning).fold(own, |best, &rival| {
        if numbers(rival) < numbers(best) {
            rival
        } else {
            best
        }
    });
    // Of two names for the same columns that of the gyro comes first, as in the catalogue.
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
    /// Gyros of which the number of each member is told.
    pub told: Vec<[bool; 3]>,
}

/// Octaves in which what a fit over `candidates` leaves of a recording is not its noise.
pub(super) fn misfits_of(
    data: &Data,
    equations: &NormalEquations,
    fitted: (&Fit, &[Candidate]),
    plan: &AnalysisPlan,
) -> Vec<Misfit> {
    let mut misfits = misfits_left(equations, fitted, plan);
    // What counting makes is no white noise of angle where pulses come rarely, and never more than a pulse.
    misfits.retain(|one| !data.lattice.hides_angle(one.gyro, one.angle_rms_rad));
    misfits
}

/// The same of any rows.
pub(super) fn misfits_left(
    equations: &NormalEquations,
    (fit, candidates): (&Fit, &[Candidate]),
    plan: &AnalysisPlan,
) -> Vec<Misfit> {
    let of_gyro = |gyro: usize| {
        let residual = left_on(equations, fit, candidates, gyro);
        let basis = equations.basis_beside_gaps(fit.levels[gyro]);
        misfits(&basis, &residual, fit.levels[gyro], gyro, plan)
    };
    (0..3).flat_map(of_gyro).collect()
}

/// Fits `members`, places in `found.candidates`; `None` where too few rows are left.
fn refit(data: &Data, found: &Found, members: &[usize], plan: &AnalysisPlan) -> Option<Final> {
    let fitted = data.rows_of(&[Use::Train, Use::Confirm]);
    let observations = data.observed(&fitted)?.to_fast_length();
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
    let equations = NormalEquations::new(
        observations,
        &found.residual_rad,
        &made,
        NoiseLevels::mean(levels),
    );
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
    let misfits = misfits_of(data, &equations, (&fit, &candidates), plan);
    let set: Vec<_> = hypotheses.iter().zip(&candidates).collect();
    let told = told(&equations, &set, &fit, plan.class_within);
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
        told,
    })
}
