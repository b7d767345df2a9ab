//! Search for physical effects given the registration, and selection of the registration's groups.

use std::cell::OnceCell;

use rlg_catalogue::Pool;
use rlg_catalogue::entries::{CATALOGUE, PULL};
use rlg_diagnosis::self_test::Trials;
use rlg_findings::result::Tested;
use rlg_inference::{Stepwise, stepwise};
use rlg_plan::{AttitudeNoisePlan, Plan};
use rlg_signal::axes::{Triad, add_triad};

use crate::gyros::physics::Gyro;
use crate::likelihood::block_sums::Estimates;
use crate::likelihood::equations::{Band, BandNoise};
use crate::likelihood::noise::NoiseTerms;
use crate::registration::gauss_newton::{Registration, Steps};
use crate::registration::registration_search::Called;
use crate::rows::alignment::{Alignment, COUNT, Free, in_order, places};
use crate::rows::blocks::{Blocks, Prior};
use crate::rows::earth;
use crate::rows::fitting::priors;
use crate::rows::linearised_rows::About;
use crate::selection::expression_scan::Vocabulary;
use crate::selection::group_selection::{Candidates, Choice, Named, chance, without};
use crate::selection::line_scan;
use crate::selection::residual_scan::{Given, Sought};
use crate::selection::self_test::OnBlocks;
use crate::selection::step_scan;

/// Result of the search.
pub struct Found {
    /// Accepted physical effects, in the order of acceptance.
    pub physics: Vec<Named>,
    /// Supported groups of the registration.
    pub registration: Vec<Named>,
    /// Column indices of all registration parameters and of the accepted effects.
    pub set: Vec<usize>,
    /// Joint estimates of these, relative to the model.
    pub estimates: Estimates,
    /// Column indices of the named parameters.
    pub named_set: Vec<usize>,
    /// Estimates of the named parameters, with the unnamed registration at the model's values.
    pub of_named: Estimates,
    /// Number of sets tried.
    pub tried: usize,
    /// Response of the search to simulated noise and to known effects; `None` if it was not tested.
    pub tested: Option<Tested>,
}

impl Found {
    /// Supported groups of the registration, in the order of their columns.
    pub(crate) fn groups(&self) -> Free {
        in_order(self.registration.iter().map(Named::group))
    }

    /// Step of the named registration from the linearisation point.
    pub(crate) fn step_from(&self, beyond: &[f64; COUNT]) -> Steps {
        step_from(&self.named_set, &self.of_named, beyond)
    }
}

/// Step of a set's registration parameters from the linearisation point.
fn step_from(set: &[usize], estimates: &Estimates, beyond: &[f64; COUNT]) -> Steps {
    let own: Vec<usize> = (0..set.len()).filter(|at| set[*at] < COUNT).collect();
    let kept: Vec<usize> = own.iter().map(|at| set[*at]).collect();
    let each = own.iter().zip(&kept);
    let estimate: Vec<f64> = each
        .map(|(at, k)| estimates.values[*at] - beyond[*k])
        .collect();
    let variances = own.iter().map(|at| estimates.covariance[(*at, *at)]);
    let std: Vec<f64> = variances.map(f64::sqrt).collect();
    Steps::new(&kept, &estimate, &std)
}

/// Physical effects sought beside a registration.
#[derive(Clone, Copy)]
pub struct Physics<'a> {
    /// Signals of the gyros.
    pub gyro: &'a Gyro,
    /// Columns of the candidates.
    pub pool: &'a Pool,
    /// Effects, with the indices of their parameters.
    pub candidates: &'a Candidates,
    /// Scans for effects outside the catalogue.
    pub scans: Scans<'a>,
}

/// Scans of the residual for effects outside the catalogue.
#[derive(Clone, Copy)]
pub enum Scans<'a> {
    /// None: the kind is left out.
    None,
    /// Lines and expressions.
    All {
        /// Lowest frequency of a line: those of the motion are not known below \[Hz\].
        least_hz: f64,
        /// Lines of the motion and lines taken out, about which no line is sought \[Hz\].
        occupied_hz: &'a [f64],
        /// Half width \[Hz\].
        about_hz: f64,
    },
}

/// A registration, and its linearisation point relative to the model.
#[derive(Clone, Copy)]
pub(crate) struct Registered<'a> {
    pub(crate) registration: &'a Registration,
    pub(crate) of_model: &'a Alignment,
    /// Parameters at the linearisation point, relative to the model.
    pub(crate) beyond: &'a [f64; COUNT],
}

impl<'a> Registered<'a> {
    /// About the alignment of a registration; `beyond`: of it relative to the model.
    pub(crate) fn new(
        registration: &'a Registration,
        of_model: &'a Alignment,
        beyond: &'a [f64; COUNT],
    ) -> Self {
        Self {
            registration,
            of_model,
            beyond,
        }
    }
}

/// Selects registration groups without any physical effect.
pub(crate) fn called_for(of: Registered, plan: &Plan) -> Called {
    let none = Candidates::new(Vec::new());
    let basis = basis(of.registration, &plan.attitude.noise);
    let search = Search::new(of, &basis, &none, std::iter::empty(), plan);
    let (chosen, nearly) = search.choice().chosen(&[]);
    let named_set: Vec<usize> = chosen.iter().flat_map(|group| places(group.kind)).collect();
    let step = step_from(
        &named_set,
        &search.blocks.sums.estimates(&named_set),
        of.beyond,
    );
    Called {
        free: in_order(chosen.iter().map(|group| group.kind)),
        step,
        nearly,
    }
}

/// Band and noise terms of a registration's rows.
fn basis(registered: &Registration, plan: &AttitudeNoisePlan) -> BandNoise {
    let increments = &registered.about.increments;
    let (rows, period_s) = (increments.rows(), increments.period_s);
    let band = Band::new(rows, period_s, &plan.band);
    let terms = NoiseTerms::new(rows, period_s, band.cut, false, plan).with_alike(increments.alike);
    BandNoise { band, terms }
}

/// Searches for physical effects and bias steps by forward selection.
pub(crate) fn search(of: Registered, physics: Physics, plan: &Plan, seed: u64) -> Found {
    let Physics {
        gyro,
        pool,
        candidates,
        scans,
    } = physics;
    let (registered, beyond) = (of.registration, of.beyond);
    let about = &registered.about;
    let effects = candidates.effects.iter();
    let columns = effects.flat_map(|(candidate, _)| gyro.columns(pool, candidate, about));
    let basis = basis(registered, &plan.attitude.noise);
    let mut search = Search::new(of, &basis, candidates, columns, plan);
    let residual = Residual {
        about,
        gyro,
        beyond,
        scans,
        vocabulary: OnceCell::new(),
        pool,
    };
    let (mut physics, set) = search.selected(&residual);
    let kinds: Vec<&'static str> = physics.iter().map(|one| one.kind).collect();
    for named in physics.iter_mut().filter(|one| !one.is_step()) {
        let beside = without(&set, &named.places);
        let statistic = search.blocks.sums.statistic(&beside, &named.places);
        let choice = search.choice();
        named.alike = choice.rivals(&beside, &statistic, &kinds);
        named.behind = choice.behind(&beside, &statistic);
    }
    let beside: Vec<usize> = set.iter().copied().filter(|k| *k >= COUNT).collect();
    let mut registration = search.choice().registration(&beside, &kinds);
    let mut named_set = beside;
    named_set.extend(registration.iter().flat_map(|named| named.places.clone()));
    let estimates = search.blocks.sums.estimates(&set);
    let mut of_named = search.blocks.sums.estimates(&named_set);
    earth::on_its_length(&named_set, &mut of_named, &plan.attitude.earth);
    for named in &mut registration {
        named.of_reference(&estimates, &registered.alignment);
        let rivals = registered.rivals.iter();
        for (_, rival) in rivals.filter(|(kind, _)| *kind == named.kind) {
            if !named.alike.contains(rival) {
                named.alike.push(rival);
            }
        }
    }
    let in_catalogue = |kind: &str| CATALOGUE.iter().position(|entry| entry.kind == kind);
    registration.sort_by_key(|named| in_catalogue(named.kind));
    let trials = OnBlocks::new(&search.blocks, search.choice(), &physics, &registration);
    let tested = Some(trials.tested(seed, plan));
    Found {
        registration,
        named_set,
        of_named,
        estimates,
        tried: search.tried,
        tested,
        physics,
        set,
    }
}

struct Search<'a> {
    blocks: Blocks<'a>,
    candidates: &'a Candidates,
    plan: &'a Plan,
    tried: usize,
}

impl<'a> Search<'a> {
    /// # Inputs
    /// `of_effects`: columns of the candidates.
    fn new(
        Registered {
            registration: registered,
            of_model,
            beyond,
        }: Registered<'a>,
        noise: &'a BandNoise,
        candidates: &'a Candidates,
        of_effects: impl Iterator<Item = Triad>,
        plan: &'a Plan,
    ) -> Self {
        let about = &registered.about;
        let priors = priors(&registered.alignment, of_model, &plan.attitude.registration);
        let mut precisions: Vec<f64> = priors.iter().map(|(std, _)| std.powi(-2)).collect();
        precisions.extend(candidates.effects.iter().flat_map(|(candidate, own)| {
            (0..own.len()).map(|k| candidate.hypothesis.bound(k).std.powi(-2))
        }));
        let increments = &about.increments;
        let mut rows_rad = increments.rows_rad.clone();
        add_triad(&mut rows_rad, &registered.corrected_rad, -1.0);
        let mut moved = beyond.to_vec();
        moved.resize(precisions.len(), 0.0);
        let blocks = Blocks::new(
            noise,
            &registered.levels,
            increments,
            &rows_rad,
            &mut about.columns().chain(of_effects),
            Prior {
                precisions: &precisions,
                moved: &moved,
            },
            &plan.attitude.blocks,
        );
        Self {
            blocks,
            candidates,
            plan,
            tried: 0,
        }
    }

    fn choice(&self) -> Choice<'_> {
        Choice {
            sums: &self.blocks.sums,
            candidates: self.candidates,
            plan: self.plan,
        }
    }

    /// Accepted effects, and the columns of these and of the whole registration.
    fn selected(&mut self, residual: &Residual) -> (Vec<Named>, Vec<usize>) {
        let mut steps = EffectSteps {
            of: self,
            residual,
            removed: Vec::new(),
        };
        stepwise(&mut steps, (Vec::new(), (0..COUNT).collect()))
    }

    /// Accepts an effect of a scan given a set, and appends its columns to the blocks.
    fn accepted(
        &mut self,
        sought: Option<Sought>,
        set: &[usize],
        known: &[&Named],
        beyond: &[f64; COUNT],
    ) -> Option<Named> {
        let sought = sought?;
        let plan = &self.plan.attitude;
        let gain = sought.statistic.gain(sought.places, true, &plan.blocks);
        self.tried += sought.places;
        let mut known = known.iter();
        if gain <= plan.least_gain || known.any(|one| one.scanned == Some(sought.scanned)) {
            return None;
        }
        let first = self.blocks.sums.parameters();
        let places: Vec<usize> = (first..first + sought.columns.len()).collect();
        let blocks = self.blocks.with(&sought.columns, beyond);
        let predicted = blocks.sums.predicted(set, &places);
        if predicted.log_likelihood <= plan.least_predicted {
            return None;
        }
        self.blocks = blocks;
        Some(Named {
            kind: sought.scanned.kind(),
            places,
            scanned: Some(sought.scanned),
            among: sought.places,
            statistic: sought.statistic,
            gain,
            share: predicted.share,
            p_value: chance(&sought.statistic, sought.places),
            alike: Vec::new(),
            behind: Vec::new(),
        })
    }
}

/// Steps of a selection of physical effects: of the catalogue first, of the scans if that holds none.
struct EffectSteps<'s, 'a> {
    of: &'s mut Search<'a>,
    residual: &'s Residual<'s>,
    removed: Vec<Named>,
}

impl Stepwise for EffectSteps<'_, '_> {
    /// Effects in the order of acceptance, and the columns of these and of the whole registration.
    type Set = (Vec<Named>, Vec<usize>);

    fn extend(&mut self, (physics, set): &mut Self::Set) -> bool {
        let (of, residual) = (&mut *self.of, self.residual);
        // An attitude computed from these gyros shares their errors: it is no independent evidence of further effects.
        let is_filter = physics.iter().any(|named| named.kind == PULL);
        if is_filter || physics.len() == of.plan.attitude.most_effects {
            return false;
        }
        let known: Vec<&Named> = physics.iter().chain(&self.removed).collect();
        let kinds: Vec<&'static str> = known.iter().map(|named| named.kind).collect();
        let (next, tried) = of.choice().next(set, &kinds);
        of.tried += tried;
        let next = next
            .or_else(|| {
                let sought = step_scan::seek(residual.given(&of.blocks, set, of.plan));
                of.accepted(sought, set, &known, residual.beyond)
            })
            .or_else(|| {
                let sought = residual.seek(&of.blocks, set, of.candidates, of.plan);
                of.accepted(sought, set, &known, residual.beyond)
            });
        let Some(named) = next else {
            return false;
        };
        set.extend(&named.places);
        physics.push(named);
        true
    }

    fn reduce(&mut self, (physics, set): &mut Self::Set) -> bool {
        let choice = self.of.choice();
        let is_redundant = |one: &Named| !choice.stays(one, &without(set, &one.places));
        let Some(place) = physics.iter().position(is_redundant) else {
            return false;
        };
        let named = physics.remove(place);
        *set = without(set, &named.places);
        self.removed.push(named);
        true
    }
}

/// Rows and signals that scans search in.
struct Residual<'a> {
    about: &'a About,
    gyro: &'a Gyro,
    beyond: &'a [f64; COUNT],
    scans: Scans<'a>,
    pool: &'a Pool,
    vocabulary: OnceCell<Vocabulary>,
}

impl Residual<'_> {
    fn given<'b>(&'b self, blocks: &'b Blocks<'b>, set: &'b [usize], plan: &'b Plan) -> Given<'b> {
        Given {
            blocks,
            about: self.about,
            gyro: self.gyro,
            beyond: self.beyond,
            set,
            plan,
        }
    }

    /// Finds the line or expression of larger gain in the residual of a set.
    fn seek(
        &self,
        blocks: &Blocks,
        set: &[usize],
        listed: &Candidates,
        plan: &Plan,
    ) -> Option<Sought> {
        let Scans::All {
            least_hz,
            occupied_hz,
            about_hz,
        } = self.scans
        else {
            return None;
        };
        let given = self.given(blocks, set, plan);
        let null = blocks.null(set, self.beyond);
        let is_occupied = |hz: f64| occupied_hz.iter().any(|of| (hz - of).abs() <= about_hz);
        let is_free = |hz: f64| hz >= least_hz && !is_occupied(hz);
        let line = line_scan::seek(given, &null, &is_free);
        let vocabulary = self
            .vocabulary
            .get_or_init(|| Vocabulary::new(&given, self.pool, listed));
        let expression = vocabulary.seek(given, &null);
        let gain = |one: &Sought| one.statistic.gain(one.places, true, &plan.attitude.blocks);
        let both = line.into_iter().chain(expression);
        both.max_by(|a, b| gain(a).total_cmp(&gain(b)))
    }
}
