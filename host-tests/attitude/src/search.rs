//! Search for physical effects given the registration, and selection of the registration's groups.

use rlg_catalogue::Pool;
use rlg_catalogue::entries::{CATALOGUE, PULL, STEP};
use rlg_diagnosis::self_test::Trials;
use rlg_findings::result::Tested;
use rlg_plan::{AttitudeNoisePlan, Plan};
use rlg_signal::axes::{Triad, add_triad};

use crate::about::{About, Gyros};
use crate::alignment::{Alignment, COUNT, Free, in_order, places};
use crate::block_sums::Estimates;
use crate::blocks::{Blocks, Prior};
use crate::choice::{Candidates, Choice, Named, chance, without};
use crate::earth;
use crate::equations::{Band, BandNoise};
use crate::fitting::priced;
use crate::growth::Called;
use crate::noise::NoiseTerms;
use crate::physics::Gyro;
use crate::registration::{Registration, Steps};
use crate::self_test::OnBlocks;
use crate::steps::{self, Step};

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
}

/// Gyros with a registration, and its linearisation point relative to the model.
#[derive(Clone, Copy)]
pub(crate) struct Registered<'a> {
    pub(crate) gyros: &'a Gyros,
    pub(crate) registration: &'a Registration,
    pub(crate) of_model: &'a Alignment,
    /// Parameters at the linearisation point, relative to the model.
    pub(crate) beyond: &'a [f64; COUNT],
}

impl<'a> Registered<'a> {
    /// About the alignment of a registration; `beyond`: of it relative to the model.
    pub(crate) fn new(
        gyros: &'a Gyros,
        registration: &'a Registration,
        of_model: &'a Alignment,
        beyond: &'a [f64; COUNT],
    ) -> Self {
        Self {
            gyros,
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
    } = physics;
    let (registered, beyond) = (of.registration, of.beyond);
    let about = &registered.about;
    let effects = candidates.effects.iter();
    let columns = effects.flat_map(|(candidate, _)| gyro.columns(pool, candidate, about));
    let basis = basis(registered, &plan.attitude.noise);
    let mut search = Search::new(of, &basis, candidates, columns, plan);
    let mut set: Vec<usize> = (0..COUNT).collect();
    let mut physics: Vec<Named> = Vec::new();
    while physics.len() < plan.attitude.most_effects {
        let (next, tried) = search.choice().next(&set, &physics);
        search.tried += tried;
        let next = next.or_else(|| {
            let known: Vec<Step> = physics.iter().filter_map(|one| one.step).collect();
            search.step(about, gyro, beyond, &set, &known)
        });
        let Some(named) = next else {
            break;
        };
        set.extend(&named.places);
        let is_filter = named.kind == PULL;
        physics.push(named);
        // An attitude computed from these gyros shares their errors: it is no independent evidence of further effects.
        if is_filter {
            break;
        }
    }
    let kinds: Vec<&'static str> = physics.iter().map(|one| one.kind).collect();
    for named in physics.iter_mut().filter(|one| one.step.is_none()) {
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
    let tested = Some(trials.tested(seed, &plan.judgement.self_test));
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
            gyros,
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
        let columns = priced(
            about.columns(gyros.rate_hz),
            &registered.alignment,
            of_model,
        );
        let mut precisions: Vec<f64> = columns.iter().map(|one| one.prior_std.powi(-2)).collect();
        precisions.extend(candidates.effects.iter().flat_map(|(candidate, own)| {
            (0..own.len()).map(|k| candidate.hypothesis.bound(k).std.powi(-2))
        }));
        let increments = &about.increments;
        let mut rows_rad = increments.rows_rad.clone();
        add_triad(&mut rows_rad, &registered.corrected_rad, -1.0);
        let mut moved = beyond.to_vec();
        moved.resize(precisions.len(), 0.0);
        let of_registration = columns.into_iter().map(|column| column.values);
        let blocks = Blocks::new(
            noise,
            &registered.levels,
            increments,
            &rows_rad,
            &mut of_registration.chain(of_effects),
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

    /// Tests a step of a bias given a set, and appends its column to the blocks if it is accepted.
    fn step(
        &mut self,
        about: &About,
        gyro: &Gyro,
        beyond: &[f64; COUNT],
        set: &[usize],
        known: &[Step],
    ) -> Option<Named> {
        let plan = &self.plan.attitude;
        let sought = steps::seek(&self.blocks, about, gyro, beyond, set, &plan.blocks)?;
        let gain = sought.statistic.gain(sought.places, true, &plan.blocks);
        self.tried += sought.places;
        if gain <= plan.least_gain || known.contains(&sought.step) {
            return None;
        }
        let place = self.blocks.sums.parameters();
        let blocks = self.blocks.with(std::iter::once(sought.column), beyond);
        let predicted = blocks.sums.predicted(set, &[place]);
        if predicted.log_likelihood <= plan.least_predicted {
            return None;
        }
        self.blocks = blocks;
        Some(Named {
            kind: STEP,
            places: vec![place],
            step: Some(sought.step),
            statistic: sought.statistic,
            gain,
            share: predicted.share,
            p_value: chance(&sought.statistic, sought.places),
            alike: Vec::new(),
            behind: Vec::new(),
        })
    }
}
