//! Whether drifting noise could stand in an effect's place.
//!
//! Enters: the bench with what was chosen, the effects and terms in doubt. Leaves: the first without which the data
//! are nearly as likely once the noise is fitted anew. A slow regressor resembles the first mode of a random walk,
//! which holds four fifths of its power; a likelihood ratio under a noise level known from the half dozen modes
//! that are left has the long tails of Fisher's law, not those of chi-squared (diagnosis.md, "how to be fooled":
//! white-noise statistics on drifting data). So both explanations are compared with the noise each of them needs, and
//! with a free trend: a random walk ends elsewhere than it began, that jump of the circle fills all low bins in phase,
//! and whatever resembles a ramp would take them all at once.

use std::ops::Range;

use super::bench::Bench as _;
use super::empirical::{Form, Term};
use super::hypotheses::CATALOGUE;
use super::information::Information;
use super::noise::{Declared, Noise};
use super::shapes::{AHEAD_DECAY, AHEAD_JUMP, AHEAD_WINDOW, HELD_AGAINST};
use super::signals;
use super::slow::Slow;
use super::wander::Drift;
use super::weigh::prior_width;
use super::workbench::{Parameters, Workbench};

/// Noise that rises less than this at the lowest frequencies holds no drift to speak of.
pub(super) const DRIFTS: f64 = 1.3;

/// ln of the likelihood by which an effect must beat drift that could stand in its place: for one to three numbers,
/// picked among a hundred slow shapes, against levels known from half a dozen modes a gyro, Fisher's law gives
/// 15 to 18 for a chance in 1e6.
const AHEAD: f64 = 18.0;

/// The same for a constant where wandering cannot be asked exactly (below): it is not picked among many and lies in one
/// bin; drift of the worst strength comes this far in one of 1000 simulated records.
const AHEAD_CONSTANT: f64 = 7.0;

/// The same for a term, which was picked among some hundred instants or expressions more.
const AHEAD_PICKED: f64 = 22.0;

/// ln of the likelihood by which a slow effect of one number must be ahead of an exactly wandering rate (slow.rs
/// prints what chance comes to, `cargo test --release -p rlg --lib slow -- --ignored --nocapture`: of walks less than one
/// in 500 lets an exponential approach or a regime come this far).
pub(super) const AHEAD_OF_WALK: f64 = 7.0;

/// The same for each further number, on whichever gyro.
pub(super) const AHEAD_OF_WALK_FURTHER: f64 = 1.5;

/// The same where no drift is left beside everything. With both, at most three of 1000 records of walks or flicker leave
/// any of the shapes in slow.rs its name.
pub(super) const AHEAD_STEADILY: f64 = 6.8;
pub(super) const AHEAD_STEADILY_FURTHER: f64 = 0.7;

/// The same for constants, which a walk that began before the recording has anyway: on the gyro where one is ahead most,
/// and this share of what they are ahead by on others. Of three walks one often looks a little like a constant, and a sum
/// counts them all; how far a single true one comes is limited, to five or six. At the worst strength, the same on three
/// gyros, three of 2000 walks come this far.
pub(super) const AHEAD_OF_WALK_CONSTANT: f64 = 4.4;
const OF_OTHER_CONSTANTS: f64 = 0.4;

/// The same for a term, which was picked among hundreds (shapes.rs has what depends on its form).
const AHEAD_OF_WALK_PICKED: f64 = 12.0;

/// A weak effect is its own where refitted noise takes up less than two fifths of what it explains; not where drift
/// shows even beside it, and most of it lies there.
const STILL_ITS_OWN: f64 = 0.6;

/// Whoever has a smaller share of its power where drift is, is not asked about.
const FAST: f64 = 0.1;

/// Whoever has a larger one is slow.
const SLOW: f64 = 0.5;

/// What is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suspect {
    /// An effect, by its index into the catalogue.
    Effect(usize),
    /// An effect that came back as better than what had taken its place: asked about as a term is.
    Returned(usize),
    /// Found terms that stand and fall together, by their places on the bench.
    Terms {
        /// Place of the first.
        first: usize,
        /// How many there are.
        count: usize,
    },
}

impl Suspect {
    /// Whether it was weighed among the effects, not picked among hundreds.
    fn is_weighed(self) -> bool {
        matches!(self, Self::Effect(_))
    }

    /// Whether it is a rate that stays as it is on every gyro.
    fn is_constant(self) -> bool {
        matches!(self, Self::Effect(effect) if CATALOGUE[effect].card().kind == "gyro_bias")
    }

    /// Its parameters.
    fn indices(self, parameters: &Parameters) -> Range<usize> {
        match self {
            Self::Effect(effect) | Self::Returned(effect) => parameters.of(effect),
            Self::Terms { first, count } => {
                let first = parameters.count() + first;
                first..first + count
            }
        }
    }
}

/// S at the lowest frequencies over what it would be without drift.
pub fn inflation(noise: &Noise, seconds: f64) -> f64 {
    let steady = noise.steady();
    let lowest_hz = 2.0 / seconds;
    noise.at(lowest_hz, lowest_hz) / steady.at(lowest_hz, lowest_hz)
}

/// The first of `suspects`, effects of `set` or the bench's terms, in whose place drifting noise does nearly as well.
/// The bench is left as it was.
pub fn first_that_could_be_drift(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    set: &[usize],
    suspects: Vec<Suspect>,
) -> Result<Option<Suspect>, String> {
    if suspects.is_empty() {
        return Ok(None);
    }
    let kept = bench.noise;
    let trends = with_trend(bench)?;
    // Fitted beside everything: the same for every suspect.
    let beside = Beside::new(bench, parameters, declared, set, trends);
    let share = |bench: &Workbench, suspect: Suspect| {
        let slow = beside.slow.as_ref();
        slow.map_or(1.0, |slow| {
            slow.share(bench, &beside.pattern(parameters, suspect))
        })
    };
    let shares: Vec<(Suspect, f64)> = suspects
        .into_iter()
        .map(|suspect| (suspect, share(bench, suspect)))
        .filter(|(_, share)| *share >= FAST)
        .collect();
    let mut found = beside.could_be_a_walk(bench, parameters, &shares);
    let mut with_all: Option<f64> = None;
    for (suspect, share) in shares {
        if found.is_some() {
            break;
        }
        // What was picked as a shape has been asked exactly, too, and a constant.
        let exactly = !suspect.is_weighed()
            || suspect.is_constant()
            || beside.is_asked_exactly(parameters, suspect);
        if exactly && share > SLOW && beside.slow.is_some() {
            continue;
        }
        let Some(without) = best_without(bench, parameters, declared, set, suspect)? else {
            bench.noise = beside.noise;
            continue;
        };
        bench.noise = beside.noise;
        let with = *with_all.get_or_insert_with(|| beside.likelihood(bench, parameters, None));
        let needed = if beside.is_within_drift(parameters, suspect) {
            ahead(suspect).max(AHEAD)
        } else {
            let unchanged = with - beside.likelihood(bench, parameters, Some(suspect));
            ahead(suspect).min(STILL_ITS_OWN * unchanged)
        };
        if with - without < needed {
            found = Some(suspect);
        }
    }
    for _ in 0..trends {
        bench.remove_term(bench.terms().len() - 1);
    }
    bench.noise = kept;
    Ok(found)
}

fn ahead(suspect: Suspect) -> f64 {
    match suspect {
        _ if suspect.is_constant() => AHEAD_CONSTANT,
        Suspect::Effect(_) => AHEAD,
        Suspect::Returned(_) | Suspect::Terms { .. } => AHEAD_PICKED,
    }
}

/// Whether effects are far enough ahead of any drift, with drift left beside them or with none; `above` is what they are
/// ahead by where nothing drifts.
pub(super) fn is_ahead_of_drift(slow: &Slow, own: &[Range<usize>], above: f64) -> bool {
    let further = further(slow.columns(own));
    let ahead = slow.ahead(own, &Drift::ALL) + above;
    let steadily = slow.ahead_steadily(own, &Drift::ALL) + above;
    ahead > AHEAD_OF_WALK + AHEAD_OF_WALK_FURTHER * further
        || steadily > AHEAD_STEADILY + AHEAD_STEADILY_FURTHER * further
}

/// Numbers after the first.
fn further(columns: usize) -> f64 {
    columns.max(1) as f64 - 1.0
}

/// How far constants, one a gyro, are ahead of walks.
pub(super) fn constants_ahead(slow: &Slow, own: &[Range<usize>]) -> f64 {
    let each = slow.ahead_by_gyro(own, &[Drift::Walk]);
    let most = each.iter().fold(0.0, |most: f64, one| most.max(*one));
    let all: f64 = each.iter().map(|one| one.max(0.0)).sum();
    most + OF_OTHER_CONSTANTS * (all - most)
}

fn ahead_of_walk(bench: &Workbench, suspect: Suspect, columns: usize) -> f64 {
    let further = further(columns);
    match suspect {
        Suspect::Effect(_) => AHEAD_OF_WALK + AHEAD_OF_WALK_FURTHER * further,
        Suspect::Returned(_) => AHEAD_OF_WALK_PICKED + AHEAD_OF_WALK_FURTHER * further,
        Suspect::Terms { first, .. } => match &bench.terms()[first].form {
            Form::Step { .. } => AHEAD_JUMP,
            Form::Product { expression } if signals::is_window(expression) => AHEAD_WINDOW,
            Form::Product { expression } if expression.starts_with("decay(") => AHEAD_DECAY,
            _ => AHEAD_OF_WALK_PICKED,
        },
    }
}

/// A fit of everything, with the noise beside it.
struct Beside {
    noise: [Noise; 3],
    information: Information,
    slow: Option<Slow>,
    indices: Vec<usize>,
    /// What `indices` are fitted to be.
    values: Vec<(usize, f64)>,
}

impl Beside {
    /// Fits the noise beside everything, and leaves it on the bench; the last `trends` terms are free trends.
    fn new(
        bench: &mut Workbench,
        parameters: &Parameters,
        declared: &[Declared; 3],
        set: &[usize],
        trends: usize,
    ) -> Self {
        bench.refit_noise(set, declared, true);
        let indices = indices(bench, parameters, set);
        // Of a longer recording than memory these rows are stretches, and what is slow is in its blocks.
        let whole = bench.beside().is_none();
        // A walk in time ends where it will, and needs no trend.
        let without_trends = &indices[..indices.len() - trends];
        let slow = whole.then(|| Slow::new(bench, without_trends, &Drift::ALL));
        let information = bench.information_about(&indices);
        Self {
            noise: bench.noise,
            values: fitted(parameters, &information, &indices),
            information,
            slow: slow.flatten(),
            indices,
        }
    }

    /// Whittle log-likelihood of the best fit, of all or without a suspect, under this noise.
    fn likelihood(
        &self,
        bench: &Workbench,
        parameters: &Parameters,
        without: Option<Suspect>,
    ) -> f64 {
        let gone = without.map_or(0..0, |suspect| suspect.indices(parameters));
        let indices = self.indices.iter().copied();
        let rest: Vec<usize> = indices.filter(|index| !gone.contains(index)).collect();
        likelihood(bench, parameters, &self.information, &rest)
    }

    /// The first of some suspects, each with the share of it that is slow, that is not far enough ahead of a walking rate:
    /// alone, or with another, as of two shapes that cancel in the slow band each needs the other.
    fn could_be_a_walk(
        &self,
        bench: &Workbench,
        parameters: &Parameters,
        suspects: &[(Suspect, f64)],
    ) -> Option<Suspect> {
        let slow = self.slow.as_ref()?;
        let is_slow = |suspect: &(Suspect, f64)| suspect.1 > SLOW;
        let own = |suspect: Suspect| suspect.indices(parameters);
        let lacks = |together: &[Suspect]| {
            let own: Vec<Range<usize>> = together.iter().map(|one| own(*one)).collect();
            let above = || slow.ahead_above(bench, &own, &self.values);
            let exactly = |one: &Suspect| self.is_asked_exactly(parameters, *one);
            if together.iter().all(exactly) {
                let ahead = |above| is_ahead_of_drift(slow, &own, above);
                return !ahead(0.0) && !ahead(above());
            }
            if let [constant] = together
                && constant.is_constant()
            {
                return constants_ahead(slow, &own) < AHEAD_OF_WALK_CONSTANT;
            }
            // Of other effects, whose numbers are few, the Whittle likelihood is asked about flicker.
            let drifts: &[Drift] = match together.iter().any(|one| !one.is_weighed()) {
                true => &HELD_AGAINST,
                false => &[Drift::Walk],
            };
            let columns = slow.columns(&own);
            let needed = together
                .iter()
                .map(|one| ahead_of_walk(bench, *one, columns));
            let needed = needed.fold(0.0, f64::max);
            let ahead = slow.ahead(&own, drifts);
            ahead < needed && ahead + above() < needed
        };
        let alone = suspects.iter().find(|one| is_slow(one) && lacks(&[one.0]));
        let pairs = suspects.iter().enumerate().flat_map(|(place, one)| {
            let others = suspects[place + 1..].iter();
            let others = others.filter(|other| is_slow(one) || is_slow(other));
            others.map(|other| [one.0, other.0])
        });
        let mut pairs = pairs.filter(|pair| lacks(pair));
        alone.map(|one| one.0).or_else(|| {
            let pair = pairs.next()?;
            let ahead = pair.map(|one| slow.ahead(&[own(one)], &[Drift::Walk]));
            Some(pair[usize::from(ahead[1] < ahead[0])])
        })
    }

    /// Whether the exact likelihood knows all that an effect could be: what a walk itself mostly looks like it cannot tell
    /// from the first of a walk's modes, of whatever strength.
    fn is_asked_exactly(&self, parameters: &Parameters, suspect: Suspect) -> bool {
        let own = suspect.indices(parameters);
        let slow = self.slow.as_ref();
        let holds_a_walk = slow.is_none_or(|slow| slow.holds_a_walk(std::slice::from_ref(&own)));
        suspect.is_weighed() && !holds_a_walk
    }

    /// Whether the noise drifts beside the suspect, too, and more than half of the suspect lies in that drift.
    fn is_within_drift(&self, parameters: &Parameters, suspect: Suspect) -> bool {
        let pattern = self.pattern(parameters, suspect);
        self.information.share_in_drift(&pattern) > 0.5
    }

    /// The suspect's parameters as they are fitted beside everything.
    fn pattern(&self, parameters: &Parameters, suspect: Suspect) -> Vec<(usize, f64)> {
        let own = suspect.indices(parameters);
        let values = self.values.iter().copied();
        values.filter(|(index, _)| own.contains(index)).collect()
    }
}

/// Likelihood without the suspect once the noise is fitted anew; `None` where that noise holds no drift.
fn best_without(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    set: &[usize],
    suspect: Suspect,
) -> Result<Option<f64>, String> {
    let rest: Vec<usize> = set
        .iter()
        .copied()
        .filter(|&effect| !matches!(suspect, Suspect::Effect(gone) | Suspect::Returned(gone) if gone == effect))
        .collect();
    let places = match suspect {
        Suspect::Effect(_) | Suspect::Returned(_) => 0..0,
        Suspect::Terms { first, count } => first..first + count,
    };
    let gone = bench.terms()[places.clone()].to_vec();
    for _ in &gone {
        bench.remove_term(places.start);
    }
    bench.refit_noise(&rest, declared, true);
    let seconds = bench.seconds();
    let drifts = (0..3).any(|axis| inflation(&bench.noise[axis], seconds) > DRIFTS);
    let without = drifts.then(|| best_likelihood(bench, parameters, &rest));
    for (place, term) in places.zip(gone) {
        bench.insert_term(place, term)?;
    }
    Ok(without)
}

/// The parameters of a set and the sizes of all terms on the bench.
pub(super) fn indices(bench: &Workbench, parameters: &Parameters, set: &[usize]) -> Vec<usize> {
    let mut indices = parameters.of_all(set);
    indices.extend(parameters.count()..parameters.count() + bench.terms().len());
    indices
}

/// Puts a free trend on every gyro, behind all other terms; how many there are now that were not.
fn with_trend(bench: &mut Workbench) -> Result<usize, String> {
    let before = bench.terms().len();
    for axis in 0..3 {
        if !bench.terms().contains(&trend(axis)) {
            bench.add_term(trend(axis))?;
        }
    }
    Ok(bench.terms().len() - before)
}

/// A free trend of one gyro.
fn trend(axis: usize) -> Term {
    Term {
        axis,
        form: Form::Product {
            expression: "time".to_string(),
        },
    }
}

/// Whittle log-likelihood of the best fit of a set and all terms under the bench's noise.
fn best_likelihood(bench: &Workbench, parameters: &Parameters, set: &[usize]) -> f64 {
    let indices = indices(bench, parameters, set);
    let information = bench.information_about(&indices);
    likelihood(bench, parameters, &information, &indices)
}

/// Whittle log-likelihood of the best fit of some parameters under the bench's noise.
fn likelihood(
    bench: &Workbench,
    parameters: &Parameters,
    information: &Information,
    indices: &[usize],
) -> f64 {
    bench.whittle(&fitted(parameters, information, indices))
}

/// The best fit of some parameters.
fn fitted(
    parameters: &Parameters,
    information: &Information,
    indices: &[usize],
) -> Vec<(usize, f64)> {
    let solution = information.solve(indices, &|index| {
        prior_width(parameters, information, index)
    });
    let values = solution.values.iter().copied();
    indices.iter().copied().zip(values).collect()
}
