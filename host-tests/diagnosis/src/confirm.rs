//! Validates each effect of the found set by cross-validation over blocks of the fitted rows and by a parametric bootstrap
//! without it; then refits the set, drift selected anew.

use rlg_plan::Plan;
use std::ops::Range;

use rlg_catalogue::candidates::{PoolColumns, Variant, is_delay};
use rlg_catalogue::entries::{STEP, UNLISTED};
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::block_validation::BlockSums;
use rlg_inference::events::{Instant, largest_impulse};
use rlg_inference::normal_equations::Transform;
use rlg_inference::search::Judged;
use rlg_inference::{Bound, Fit, Hypothesis, NoiseBasis, NoiseLevels, NormalEquations, Search};
use rlg_signal::partition::{Use, blocks};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::data::Data;
use super::goodness::{Misfit, misfits};
use super::lock_in::Stops;
use super::noise_levels::drift_prior;
use super::pass::{left_on, subtract};
use super::reenact::{Named, Reenactment, reenact};
use super::search::{Found, effect_rad};
use super::told::told;
use super::whitened::Whitener;
use rlg_signal::streams::{Triad, add};

/// Cross-validation of a member over blocks of the fitted rows, each block predicted from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Gain in predictive log score by the member, summed over the blocks; of an event its log-likelihood ratio.
    pub gain: f64,
    /// Design effect: variance of the parameters between blocks over that of their likelihood, the factor that the
    /// likelihood ratio is too large by; 1 if not significant \[1\].
    pub design_effect: f64,
    /// The member is confirmed there, whatever its size: the gain is positive; a step always is, a slip or a window if no
    /// impulse remains significant.
    pub holds: bool,
}

impl Prediction {
    /// True if a member keeps its name: its cost of omission exceeds the plan's after its likelihood ratio is divided by the
    /// design effect.
    pub(super) fn keeps(&self, found: &Found, place: usize, plan: &Plan) -> bool {
        let ratio = found.fit.log_likelihood - found.without[place].log_likelihood;
        let lost = ratio * (1.0 - 1.0 / self.design_effect);
        self.holds && found.judged[place].cost_without - lost > plan.judgement.naming
    }
}

/// Sums of whitened rows over the fitted blocks, and their whitening filter.
pub(super) struct Whitened {
    pub(super) sums: BlockSums,
    whitener: Whitener,
}

/// Whitens rows and members' columns, and sums them over blocks; `None` where too few rows are fitted.
///
/// # Inputs
/// `set`: hypotheses of the members of the found set, on the recording's own records.
pub(super) fn whiten(
    data: &Data,
    found: &Found,
    set: &[Hypothesis],
    plan: &Plan,
) -> Option<Whitened> {
    let whitener = Whitener::new(data, &found.fit.levels)?;
    let whitened = |gyro: usize, rows: &[f64]| whitener.rows(gyro, rows);
    let signals = &found.motion.signals;
    let values = |column: usize| found.pool.columns[column].values(signals);
    let columns = columns_of(set, signals.rows, &values, &whitened);
    let records: Vec<Vec<f64>> = (0..3)
        .map(|gyro| whitened(gyro, &found.residual_rad[gyro]))
        .collect();
    let blocks = blocks(&whitener.seen, data.streams.rate_hz, &plan.rates.blocks);
    let sums = BlockSums::new(&records, &columns, &blocks);
    Some(Whitened { sums, whitener })
}

/// Parameters of a set, the fixed part of a member counted as one more of its parameters.
pub(super) struct Parameters {
    /// Parameters of each member.
    pub(super) own: Vec<Range<usize>>,
    /// Parameters that stand for the fixed part of a member.
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

/// Cross-validates each member of the found set over blocks of the fitted rows. A step, a slip or a window lies in few
/// blocks, and the others cannot predict it; slip and window are confirmed if no impulse remains significant.
///
/// # Returns
/// Predictions in the order of the set; `None` where too few rows are fitted.
fn predictions(data: &Data, found: &Found, plan: &Plan) -> Option<Vec<Prediction>> {
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

/// Cross-validates a member that acts throughout the record.
pub(super) fn of_blocks(
    found: &Found,
    place: usize,
    parameters: &Parameters,
    sums: &BlockSums,
    plan: &Plan,
) -> Prediction {
    // Members that require it are left out with it.
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
    let is_chance = law.is_none_or(|law| {
        law.sf(said.design_effect * said.freedom) > plan.judgement.reenactment_chance
    });
    Prediction {
        gain: said.gain,
        design_effect: if is_chance { 1.0 } else { said.design_effect },
        holds: said.gain > 0.0,
    }
}

/// Tests a member that acts once on a gyro by the largest impulse in the residual.
pub(super) fn of_event(
    found: &Found,
    (place, axis): (usize, usize),
    left_rad: &Triad,
    Whitened { whitener, .. }: &Whitened,
    plan: &Plan,
) -> Prediction {
    let fit = &found.fit;
    let (transform, basis) = (&whitener.transform, &whitener.basis);
    let spectrum = transform.spectrum(&left_rad[axis]);
    let largest = largest_impulse(
        transform,
        basis,
        &spectrum,
        fit.levels[axis],
        &plan.inference.events,
    );
    let rows = transform.observations().rows() as f64;
    let is_step = found.candidates[fit.members[place]].kind == STEP;
    Prediction {
        gain: fit.log_likelihood - found.without[place].log_likelihood,
        design_effect: 1.0,
        holds: is_step || 2.0 * rows * Normal::standard().sf(largest) > plan.judgement.unexplained,
    }
}

/// Gyro on which a candidate acts once; `None` if it acts throughout the record.
pub(super) fn gyro_of_event(candidate: &Candidate) -> Option<usize> {
    match candidate.variant {
        Variant::Event { axis, .. } => Some(axis),
        Variant::Expression { axis, expression } => expression.is_window().then_some(axis),
        _ => None,
    }
}

/// Forms the whitened columns of a set's parameters, by gyro and parameter; empty where a parameter has no effect.
///
/// # Inputs
/// `values`: values of a column by row.
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

/// Returns the residual of a fit over the found candidates \[rad\].
pub(super) fn left_by(found: &Found, fit: &Fit) -> Triad {
    let mut left_rad = found.residual_rad.clone();
    let signals = &found.motion.signals;
    subtract(&mut left_rad, fit, &found.candidates, &found.pool, signals);
    left_rad
}

/// Estimates the instant of a member of a fit if it is a step: its gyro, the residual of the other members there \[rad\] and
/// the instant (change point) on the rows of a transform.
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

/// Members of the found set by the outcome of their validation.
pub struct Confirmed {
    /// Named members, as places in [`Found::judged`].
    pub named: Vec<usize>,
    /// Candidate that names each named member, as places in [`Found::candidates`].
    pub headlines: Vec<usize>,
    /// Cross-validation of every member of the found set.
    pub predictions: Vec<Prediction>,
    /// Places in [`Found::judged`] rejected by the cross-validation.
    pub unconfirmed: Vec<usize>,
    /// Places in [`Found::judged`] rejected by the parametric bootstrap: the recording simulated without them shows them as
    /// well.
    pub reenacted_away: Vec<usize>,
    /// Kinds of an earlier search that the bootstrap rejected, left out of this one.
    pub shown_anyway: Vec<&'static str>,
    /// Places in [`Found::judged`] whose estimate on all fitted rows no unit can have.
    pub impossible: Vec<usize>,
    /// Parametric bootstrap without each named member.
    pub reenactments: Vec<Reenactment>,
    /// Standard deviation of the instant of each named step \[rows\].
    pub instant_std_rows: Vec<Option<f64>>,
    /// Recording in which each named member acts, of several; `None` if in all.
    pub recordings: Vec<Option<String>>,
    /// Final fit of `headlines`.
    pub last: Final,
}

/// Kinds rejected by the parametric bootstrap, without which another effect may explain the recording. Delays and low passes
/// are excepted: the motion was estimated along that path.
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

/// Repeats a search without the kinds that the parametric bootstrap rejects, until it rejects none: such a kind explains
/// nothing, as the recording simulated without it shows it as well.
///
/// # Inputs
/// `search`: searches without the given kinds; returns its result and the kinds that [`fallen`] returns of it.
///
/// # Returns
/// Result of the last search, and the kinds left out of it besides `left_out`.
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

/// Removes members rejected by the cross-validation over blocks, by the parametric bootstrap or as impossible; `None` where
/// too few rows are left.
pub fn confirmed(data: &Data, found: &mut Found, plan: &Plan) -> Option<Confirmed> {
    let predictions = predictions(data, found, plan)?;
    let is_costly = |place: &usize| found.judged[*place].cost_without > plan.judgement.naming;
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

/// Place of the rejected name with the largest inflation in the bootstrap; `None` if no name is rejected.
pub(super) fn weakest(
    ratios: &[Named],
    reenactments: &[Reenactment],
    plan: &Plan,
) -> Option<usize> {
    let inflation = |place: usize| reenactments[place].inflation();
    (0..ratios.len())
        .filter(|&place| ratios[place].falls(&reenactments[place], plan))
        .max_by(|&a, &b| inflation(a).total_cmp(&inflation(b)))
}

/// Log-likelihood ratio of a member, and the part of it that may be lost before its name is.
pub(super) fn in_doubt(found: &Found, place: usize, plan: &Plan) -> Named {
    Named {
        log_likelihood_ratio: found.fit.log_likelihood - found.without[place].log_likelihood,
        to_spare: found.judged[place].cost_without - plan.judgement.naming,
    }
}

/// Moves every step among the `headlines` to the posterior mean of its instant on the rows to fit.
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
    let Some(observations) = data.observed(&data.rows_of(&[Use::Fit])) else {
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

/// Candidate with the fewest free parameters among a member and its rivals; of an expression, also among the rivals with
/// more parameters that explain as much.
pub(super) fn headline((judged, reached_by): (&Judged, &[usize]), all: &[Candidate]) -> usize {
    // A listed effect has precedence over an expression.
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
    // Of two candidates on the same columns the gyro's has precedence, as in the catalogue.
    (0..simplest)
        .find(|&other| is_same_column(&all[other].hypothesis, &all[simplest].hypothesis))
        .unwrap_or(simplest)
}

/// True if two hypotheses with parameters of any sign scale the same columns into the same records.
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

/// Final fit of the set, on all rows to fit.
pub struct Final {
    /// The fit, its blocks in the order of the members.
    pub fit: Fit,
    /// Residual of the fit \[rad\].
    pub left_rad: Triad,
    /// Octaves in which the residual departs from the fitted noise.
    pub misfits: Vec<Misfit>,
    /// Gyros whose own data determine the parameter of each member.
    pub told: Vec<[bool; 3]>,
}

/// Octaves in which the residual of a fit over `candidates` departs from the fitted noise.
pub(super) fn misfits_of(
    data: &Data,
    equations: &NormalEquations,
    fitted: (&Fit, &[Candidate]),
    plan: &Plan,
) -> Vec<Misfit> {
    let mut misfits = misfits_left(equations, fitted, plan);
    // Quantisation error is not white angle noise where pulses are rare, and never exceeds a pulse.
    misfits.retain(|one| !data.lattice.hides_angle(one.gyro, one.angle_rms_rad));
    misfits
}

/// The same on any rows, quantisation error included.
pub(super) fn misfits_left(
    equations: &NormalEquations,
    (fit, candidates): (&Fit, &[Candidate]),
    plan: &Plan,
) -> Vec<Misfit> {
    let of_gyro = |gyro: usize| {
        let residual = left_on(equations, fit, candidates, gyro);
        let basis = equations.basis_beside_gaps(fit.levels[gyro]);
        misfits(&basis, &residual, fit.levels[gyro], gyro, plan)
    };
    (0..3).flat_map(of_gyro).collect()
}

/// Fits `members`, places in `found.candidates`; `None` where too few rows are left.
fn refit(data: &Data, found: &Found, members: &[usize], plan: &Plan) -> Option<Final> {
    let fitted = data.rows_of(&[Use::Fit]);
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
    // Drift is selected anew: it may have been fitted as a member without a name.
    let mut search = Search::new(
        &equations,
        &hypotheses,
        kinds,
        &plan.inference.search,
        &drift,
        levels.clone(),
    );
    let all: Vec<usize> = (0..hypotheses.len()).collect();
    let mut fit = search.fit(&all, None);
    let misfits = misfits_of(data, &equations, (&fit, &candidates), plan);
    let set: Vec<_> = hypotheses.iter().zip(&candidates).collect();
    let told = told(&equations, &set, &fit, plan);
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
