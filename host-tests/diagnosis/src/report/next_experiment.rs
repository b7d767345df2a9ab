//! Next experiment: it separates effects that this recording confuses, or else has the smallest standard deviations of the
//! finding's parameters, with the predicted figures.
//!
//! Finding, rivals and everyday errors → their Fisher information in this recording → joint information with each of the
//! catalogue's experiments, under this recording's noise → selects the experiment that decides most, at the least trouble.

use rlg_plan::{CataloguePlan, ExperimentPlan, Plan};

use nalgebra::Matrix3;
use rlg_catalogue::Pool;
use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::entries;
use rlg_catalogue::experiment::{Experiment, information};
use rlg_findings::result::{ExperimentEntry, PrecisionEntry, SeparationEntry};
use rlg_inference::{Fit, Hypothesis, Information, NoiseLevels, NormalEquations};
use rlg_signal::partition::Use;

use super::experiment_question::{Asked, Role, Subject, asked};
use super::experiment_words::{in_words, move_entry};
use crate::confirm::ConfirmedSet;
use crate::report::entries_of_findings::DRIFT;
use crate::report::finding::{Finding, card, unit_of};
use crate::rows::data::Data;
use crate::search::structure::{Found, Searched};

/// Sentence for a recording without findings.
pub const NONE_NEEDED: &str =
    "None needed for this recording; motion that excites the effects not excluded would test them.";

/// Next experiment.
pub(crate) struct Next {
    /// Sentence.
    pub(crate) sentence: String,
    /// Figures, where a motion or temperature makes the experiment.
    pub(crate) entry: Option<ExperimentEntry>,
}

impl Next {
    /// Returns the experiment on the catalogue's card of a kind.
    fn of_card(kind: &str) -> Self {
        Self {
            sentence: card(kind).experiment.to_string(),
            entry: None,
        }
    }
}

/// Separation \[σ\] from which a rival loses more than `within` in log posterior, chance included: the log ratio is half the
/// squared separation, with the separation as standard deviation.
fn deciding_sigma(within: f64, plan: &ExperimentPlan) -> f64 {
    plan.chance + (plan.chance * plan.chance + 2.0 * within).sqrt()
}

/// Returns the next experiment for the first finding that the recording confuses with a rival or drift, else for the first.
pub(crate) fn next_experiment(
    Searched { data, found }: Searched,
    confirmed: &ConfirmedSet,
    findings: &[Finding],
    plan: &Plan,
) -> Next {
    let is_confused = |one: &Finding| !one.alike.is_empty() || one.or_drift;
    let place = findings.iter().position(is_confused).unwrap_or(0);
    let Some(one) = findings.get(place) else {
        return Next {
            sentence: NONE_NEEDED.to_string(),
            entry: None,
        };
    };
    let kind = one.candidate.kind;
    let subject = Subject {
        found,
        confirmed,
        place,
        one,
    };
    let next = Question::new(data, subject).and_then(|question| {
        if is_confused(one) {
            question.separated(plan)
        } else {
            question.known_better(plan)
        }
    });
    next.unwrap_or_else(|| Next::of_card(kind))
}

/// A finding with its rivals and nuisance hypotheses.
struct Question<'a> {
    one: &'a Finding<'a>,
    fit: &'a Fit,
    pool: Pool,
    asked: Vec<Asked>,
    /// Noise levels with the drift nearest to the finding.
    drift_levels: &'a [NoiseLevels],
    /// Row rate \[Hz\] and length \[s\] of this recording.
    rows: (f64, f64),
    /// Scale error and installation matrix of the model.
    gyros: ([f64; 3], Matrix3<f64>),
    /// Thresholds of the effects.
    plan: CataloguePlan,
    /// Information of this recording, zero for the everyday errors.
    here: Information,
}

/// Experiment with the information of a single run.
struct Said {
    experiment: Experiment,
    information: Information,
    /// Information where gyros drift.
    of_drift: Option<Information>,
}

impl Said {
    fn most_repeats(&self, plan: &ExperimentPlan) -> u32 {
        (plan.longest_s / self.experiment.duration_s()).max(1.0) as u32
    }
}

impl<'a> Question<'a> {
    fn new(data: &Data, subject: Subject<'a>) -> Option<Self> {
        let Subject {
            found,
            confirmed,
            place,
            one,
        } = subject;
        let fit = &confirmed.fit;
        let (pool, asked) = asked(subject)?;
        let mut here = of_recording(data, found, &pool, &asked, &fit.levels)?;
        // Everyday errors are nuisance parameters of the experiment only: here the search has weighed them.
        let is_new = |one: &&Asked| matches!(one.role, Role::Plain | Role::Level);
        for place in asked
            .iter()
            .filter(is_new)
            .flat_map(|one| one.block.clone())
        {
            here.fisher.row_mut(place).fill(0.0);
            here.fisher.column_mut(place).fill(0.0);
        }
        Some(Self {
            one,
            fit,
            pool,
            asked,
            drift_levels: &found.judged[confirmed.named[place]].drift_levels,
            rows: (data.streams.rate_hz, data.streams.span_s()),
            gyros: (data.model.gyro.scale_error, data.sensing_from_body),
            plan: found.motion.signals.plan,
            here,
        })
    }

    /// Computes the information of an experiment; `None` if it is too short to transform.
    fn said(&self, experiment: Experiment) -> Option<Said> {
        let (scale_error, sensing_from_body) = self.gyros;
        let signals = experiment.signals(scale_error, sensing_from_body, &self.plan);
        let set: Vec<&Hypothesis> = self.asked.iter().map(|one| &one.hypothesis).collect();
        let rows = (experiment.rows_hz, experiment.duration_s());
        let under = |levels: &[NoiseLevels]| {
            let levels: Vec<NoiseLevels> = levels
                .iter()
                .map(|levels| levels.of_other_rows(self.rows, rows))
                .collect();
            information(&signals, &self.pool.columns, &set, &levels)
        };
        let drifts = self.one.or_drift && self.drift_levels.len() == self.fit.levels.len();
        Some(Said {
            information: under(&self.fit.levels)?,
            of_drift: drifts.then(|| under(self.drift_levels)).flatten(),
            experiment,
        })
    }

    /// The finding.
    fn own(&self) -> &Asked {
        &self.asked[0]
    }

    fn rivals(&self) -> impl Iterator<Item = &Asked> {
        self.asked.iter().filter(|one| one.role == Role::Rival)
    }

    /// Indices of the parameters with the standard deviation of their prior.
    fn free<'b>(&self, those: impl Iterator<Item = &'b Asked>) -> Vec<(usize, f64)> {
        let of = |one: &'b Asked| {
            let bound = |k: usize| one.hypothesis.bound(k).std;
            let places = one.block.clone().enumerate();
            places.map(move |(k, place)| (place, bound(k)))
        };
        those.flat_map(of).collect()
    }

    /// Hypotheses with the nuisance parameters of a separation.
    fn beside(&self) -> impl Iterator<Item = &Asked> {
        let is_free = |one: &&Asked| matches!(one.role, Role::Other | Role::Plain);
        self.asked.iter().filter(is_free)
    }

    /// Joint information of this recording and `repeats` runs of an experiment.
    fn together(&self, experiment: &Information, repeats: u32) -> Information {
        let mut all = self.here.clone();
        all.fisher += &experiment.fisher * f64::from(repeats);
        all
    }

    /// Estimated parameters of the finding, and 1 for its fixed terms.
    fn values(&self) -> Vec<f64> {
        let own = self.own().block.len();
        let mut values: Vec<f64> = self.fit.estimate.as_slice()[self.one.block.clone()].to_vec();
        values.resize(own, 1.0);
        values
    }

    /// Parameters of a rival in the place of the finding.
    fn values_of(&self, rival: &Asked) -> Vec<f64> {
        let free = self.free([rival].into_iter().chain(self.beside()));
        let own = self.own().block.clone();
        let mut values = self.here.stand_in(own, &self.values(), &free);
        values.truncate(rival.block.len());
        values
    }

    /// Separation of every pair of kinds, either taken as true, with `repeats` runs of an experiment.
    fn apart(&self, said: &Said, repeats: u32) -> Vec<SeparationEntry> {
        let own = self.own();
        let together = self.together(&said.information, repeats);
        let pair = |truth: &Asked, values: &[f64], rival: &Asked| {
            let free = self.free([rival].into_iter().chain(self.beside()));
            let sigma = |known: &Information| known.separation(truth.block.clone(), values, &free);
            SeparationEntry {
                truth: truth.kind.to_string(),
                rival: rival.kind.to_string(),
                here_sigma: Some(sigma(&self.here)),
                promised_sigma: sigma(&together),
            }
        };
        let values = self.values();
        let mut all = Vec::new();
        for rival in self.rivals() {
            all.push(pair(own, &values, rival));
            all.push(pair(rival, &self.values_of(rival), own));
        }
        if let Some(of_drift) = &said.of_drift {
            let level = self.asked.iter().filter(|one| one.role == Role::Level);
            let free = self.free(self.beside().chain(level));
            let once = of_drift.separation(own.block.clone(), &values, &free);
            all.push(SeparationEntry {
                truth: own.kind.to_string(),
                rival: DRIFT.to_string(),
                here_sigma: None,
                promised_sigma: once * f64::from(repeats).sqrt(),
            });
        }
        all
    }

    /// Divides the rivals into those separated by `needed` \[σ\], whichever is true, and the others.
    fn told<'b>(&self, apart: &'b [SeparationEntry], needed: f64) -> (Vec<&'b str>, Vec<&'b str>) {
        let own = self.own().kind;
        let mut rivals: Vec<&str> = apart.iter().map(|one| one.other_than(own)).collect();
        rivals.dedup();
        rivals.into_iter().partition(|rival| {
            let mut pairs = apart.iter().filter(|one| one.other_than(own) == *rival);
            pairs.all(|one| one.promised_sigma >= needed)
        })
    }

    /// Selects the experiment that separates the finding from most rivals, with the fewest repeats.
    fn separated(&self, plan: &Plan) -> Option<Next> {
        let own_plan = &plan.judgement.experiment;
        let needed = deciding_sigma(plan.judgement.class_within, own_plan);
        let mut best: Option<(usize, u32, Said)> = None;
        for experiment in Experiment::all(&plan.catalogue.table) {
            let Some(said) = self.said(experiment) else {
                continue;
            };
            let count = |repeats: u32| self.told(&self.apart(&said, repeats), needed).0.len();
            let most = said.most_repeats(own_plan);
            let at_most = count(most);
            let doubled = (0..u32::BITS).map(|k| 1_u32 << k);
            let mut doubled = doubled.take_while(|repeats| *repeats < most);
            let repeats = doubled
                .find(|repeats| count(*repeats) == at_most)
                .unwrap_or(most);
            let is_better = match &best {
                None => at_most > 0,
                Some((told, least, _)) => at_most > *told || at_most == *told && repeats < *least,
            };
            if is_better {
                best = Some((at_most, repeats, said));
            }
        }
        let (_, repeats, said) = best?;
        let apart = self.apart(&said, repeats);
        let (told, open) = self.told(&apart, needed);
        let own = self.own().kind;
        let separations = apart
            .iter()
            .filter(|one| told.contains(&one.other_than(own)));
        let entry = self.entry(&said, repeats, separations.cloned().collect());
        Some(Next {
            sentence: in_words(own, &entry, &open),
            entry: Some(entry),
        })
    }

    /// Selects the experiment with the smallest standard deviations of the finding's parameters; `None` if none is
    /// worthwhile.
    fn known_better(&self, plan: &Plan) -> Option<Next> {
        let here = self.deviations(&self.here);
        let worst = |said: &Said| {
            let there = self.deviations(&self.together(&said.information, 1));
            let ratios = here.iter().zip(&there).map(|(here, there)| there / here);
            ratios.fold(0.0, f64::max)
        };
        let all = Experiment::all(&plan.catalogue.table).into_iter();
        let said = all.filter_map(|experiment| self.said(experiment));
        let rated = said.map(|said| (worst(&said), said));
        let (ratio, said) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if ratio.is_nan() || ratio > plan.judgement.experiment.worthwhile {
            return None;
        }
        let entry = self.entry(&said, 1, Vec::new());
        Some(Next {
            sentence: in_words(self.own().kind, &entry, &[]),
            entry: Some(entry),
        })
    }

    /// Standard deviations of the finding's parameters.
    fn deviations(&self, information: &Information) -> Vec<f64> {
        let own = self.free([self.own()].into_iter());
        let free = self.free(self.beside());
        information.deviations(&own[..self.one.candidate.names.len()], &free)
    }

    fn entry(
        &self,
        said: &Said,
        repeats: u32,
        separations: Vec<SeparationEntry>,
    ) -> ExperimentEntry {
        let one = self.one.candidate;
        let here = self.deviations(&self.here);
        let there = self.deviations(&self.together(&said.information, repeats));
        let precision = |k: usize| {
            let value = one.base[k] + self.fit.estimate[self.one.block.start + k];
            let by = entries::value_of(one.kind, value).1;
            PrecisionEntry {
                name: one.names[k].clone(),
                here_std: here[k] * by,
                promised_std: there[k] * by,
                unit: unit_of(one.kind, &one.names[k]).to_string(),
            }
        };
        ExperimentEntry {
            programme: said.experiment.text.clone(),
            moves: said.experiment.moves.iter().map(move_entry).collect(),
            repeats,
            attitude_every_s: None,
            separations,
            precisions: (0..one.names.len())
                .map(precision)
                .filter(|one| one.promised_std.is_finite() && one.here_std.is_finite())
                .collect(),
        }
    }
}

/// Computes the information of this recording; `None` where too few rows can be fitted.
fn of_recording(
    data: &Data,
    found: &Found,
    pool: &Pool,
    asked: &[Asked],
    levels: &[NoiseLevels],
) -> Option<Information> {
    let rows = data.rows_of(&[Use::Fit]);
    let observations = data.observed(&rows).ok()?.to_fast_length();
    let columns = PoolColumns {
        columns: &pool.columns,
        signals: &found.motion.signals,
    };
    let mean = NoiseLevels::mean(levels);
    let equations = NormalEquations::new(observations, &found.residual_rad, &columns, mean);
    let set: Vec<&Hypothesis> = asked.iter().map(|one| &one.hypothesis).collect();
    Some(Information::of(&equations, &set, levels))
}
