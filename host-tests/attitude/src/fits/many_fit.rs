//! Registration and physics of attitudes whose noise is estimated from their own residuals.

use rlg_catalogue::entries::{PULL, UNLISTED};
use rlg_diagnosis::Settings;
use rlg_plan::Plan;
use rlg_recording::error::InputError;
use rlg_signal::axes::Triad;

use crate::fits::late_gyros;
use crate::fits::report_inputs::Fitted;
use crate::gyros::channels;
use crate::gyros::physics::Gyro;
use crate::likelihood::block_sums::log_chance;
use crate::likelihood::equations::ParameterColumn;
use crate::likelihood::noise::Levels;
use crate::reference::coarse::Start;
use crate::registration::gauss_newton::{self, Registration};
use crate::registration::observed::Observed;
use crate::registration::registration_search::{Grown, Growth};
use crate::rows::alignment::Alignment;
use crate::selection::group_selection::{Candidates, Named};
use crate::selection::search::{
    Found, Physics, Registered, Scans, called_for, search, strongest_step,
};

/// Fits attitudes whose noise is estimated from their own residuals; once more where single gyros are late, after their rows are
/// moved.
pub(crate) fn fit(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    /// Most moves: each leaves the square of what it is wrong by.
    const MOVES: usize = 3;
    let Some(mut fitted) = fit_many(settings, observed, of_model, progress)? else {
        return Ok(None);
    };
    for _ in 0..MOVES {
        let shown = settings.plan.attitude.late_gyro;
        let followed = channels::followed(&observed.recorded_from_case);
        let Some(late) = late_gyros::of(&fitted.found, &fitted.registered, followed, shown) else {
            break;
        };
        progress("second pass with the rows of late gyros shifted");
        let before = (observed.gyros.clone(), observed.late);
        observed.advance(late.values_s);
        observed.late.add(&late);
        let moved = fit_many(settings, observed, of_model, progress)?;
        // By row: what looked like faults of the reference has fewer.
        let by_row = |one: &Fitted| {
            let registered = &one.registered;
            registered.log_likelihood / registered.about.increments.rows() as f64
        };
        let least = by_row(&fitted);
        match moved.filter(|moved| by_row(moved) > least) {
            Some(moved) => fitted = moved,
            // A filter, and no delay.
            None => {
                (observed.gyros, observed.late) = before;
                break;
            }
        }
    }
    Ok(Some(fitted))
}

/// One fit of them.
fn fit_many(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    let start = Start::new(
        &observed.gyros,
        &observed.samples,
        &observed.stamps.left_out,
        of_model,
    );
    let grown = |observed: &Observed| grown(settings, observed, of_model, &start, progress);
    let Some((mut registered, mut free)) = grown(observed) else {
        return Ok(None);
    };
    let mut gyro = observed.gyro(&registered.about)?;
    if !observed.is_without_known && observed.take_out(&gyro.known_rad(observed.model)) {
        progress("second pass without the effects known");
        drop((registered, gyro));
        let Some(again) = grown(observed) else {
            return Ok(None);
        };
        (registered, free) = again;
        gyro = observed.gyro(&registered.about)?;
    }
    observed.is_without_known = true;
    let (pool, effects) = gyro.candidates(settings.left_out);
    let candidates = Candidates::new(effects);
    let mut plan = settings.plan;
    let mut known = observed.model.effects.iter();
    if known.any(|effect| effect.kind == PULL) {
        // Computed from these gyros, the reference is no independent evidence of further effects.
        plan.attitude.most_effects = 0;
    }
    let searched = |registered: Registration, gyro: &Gyro, observed: &Observed| {
        progress("searching for physics");
        let physics = Physics {
            gyro,
            pool: &pool,
            candidates: &candidates,
            scans: match settings.left_out.contains(&UNLISTED) {
                true => Scans::None,
                false => observed.scans(),
            },
        };
        let searches = Searches {
            observed,
            of_model,
            physics,
            plan: &plan,
            seed: settings.seed,
        };
        searches.searched(registered)
    };
    let mut found;
    (registered, found) = searched(registered, &gyro, observed);
    // Relinearise about the groups selected given physics: the remaining error is then within the linear range.
    let now = found.groups();
    if now != free {
        gyro.signals.release();
        let start = registered.alignment.with(&now, of_model);
        let again = gauss_newton::settle(observed.records(), of_model, start, &now, true, progress);
        if let Some(again) = again {
            let rivals = std::mem::take(&mut registered.rivals);
            registered = again.weighed(&observed.gyros, of_model);
            registered.rivals = rivals;
            gyro = observed.gyro(&registered.about)?;
            (registered, found) = searched(registered, &gyro, observed);
        }
    }
    // Derivatives are formed again for the effects found alone.
    gyro.signals.release();
    Ok(Some(Fitted {
        registered,
        gyro,
        pool,
        candidates,
        found,
        few: None,
    }))
}

/// Registers a record by forward selection of groups.
fn grown(
    settings: &Settings,
    observed: &Observed,
    of_model: &Alignment,
    start: &Start,
    progress: &dyn Fn(&str),
) -> Option<Grown> {
    let called_for = |registered: &Registration| {
        let beyond = registered.alignment.beyond(of_model);
        let of = Registered::new(registered, of_model, &beyond);
        called_for(of, &settings.plan)
    };
    let growth = Growth {
        of: observed.records(),
        model: of_model,
        start,
        called_for: &called_for,
        alike_within: settings.plan.attitude.alike_within,
        progress,
    };
    growth.grow()
}

/// A search, and the noise estimated given what it found.
struct Given {
    found: Found,
    levels: Levels,
    /// Profile log likelihood less the prices of the effects' parameters.
    log_evidence: f64,
}

/// Searches under several estimates of the noise.
struct Searches<'a> {
    observed: &'a Observed<'a>,
    of_model: &'a Alignment,
    physics: Physics<'a>,
    plan: &'a Plan,
    seed: u64,
}

impl Searches<'_> {
    /// Searches for physical effects and, if any is found, again with the noise re-estimated given them, as it contained them.
    /// A step of a bias is a slow effect that the noise's lowest octaves may contain altogether: a second search begins with
    /// the noise given the strongest step, and the likelier of both findings is selected.
    fn searched(&self, mut registered: Registration) -> (Registration, Found) {
        let null = registered.levels.clone();
        let first = self.search(&mut registered);
        let is_step = |given: &Given| given.found.physics.iter().any(Named::is_step);
        registered.levels = null;
        let best = match is_step(&first) {
            true => first,
            false => {
                let second = self.levels_beside_step(&registered).and_then(|levels| {
                    registered.levels = levels;
                    let second = self.search(&mut registered);
                    (is_step(&second) && second.log_evidence > first.log_evidence).then_some(second)
                });
                second.unwrap_or(first)
            }
        };
        registered.levels = best.levels;
        (registered, best.found)
    }

    /// Searches, and once more with the noise given what was found.
    fn search(&self, registered: &mut Registration) -> Given {
        let beyond = registered.alignment.beyond(self.of_model);
        let search = |registered: &Registration| {
            let of = Registered::new(registered, self.of_model, &beyond);
            search(of, self.physics, self.plan, self.seed)
        };
        let mut found = search(registered);
        if !found.physics.is_empty() {
            (registered.levels, _) = self.noise_beside(registered, &found.physics);
            found = search(registered);
        }
        let (_, log_likelihood) = self.noise_beside(registered, &found.physics);
        let price = |named: &Named| self.price(registered, named.places.len(), named.among);
        Given {
            log_evidence: log_likelihood - found.physics.iter().map(price).sum::<f64>(),
            levels: registered.levels.clone(),
            found,
        }
    }

    fn noise_beside(&self, registered: &Registration, physics: &[Named]) -> (Levels, f64) {
        let own = physics.iter();
        let columns = own.flat_map(|named| named_columns(named, self.physics, registered));
        let columns: Vec<ParameterColumn> = columns.collect();
        registered.noise_beside(&self.observed.gyros, self.of_model, columns)
    }

    /// Levels of the noise given the strongest step of a bias; `None` if it gains less than the price of its search.
    fn levels_beside_step(&self, registered: &Registration) -> Option<Levels> {
        let beyond = registered.alignment.beyond(self.of_model);
        let of = Registered::new(registered, self.of_model, &beyond);
        let sought = strongest_step(of, self.physics.gyro, self.plan)?;
        let columns = sought.columns.into_iter().map(unpriced);
        let gyros = &self.observed.gyros;
        let (_, without) = registered.noise_beside(gyros, self.of_model, Vec::new());
        let (levels, with) = registered.noise_beside(gyros, self.of_model, columns);
        (with - without > self.price(registered, 1, sought.places)).then_some(levels)
    }

    /// Price of parameters selected from `among` alternatives (Schwarz, Annals of Statistics 6, 1978).
    fn price(&self, registered: &Registration, parameters: usize, among: usize) -> f64 {
        let rows = 3 * registered.about.increments.rows();
        let of_size = 0.5 * parameters as f64 * (rows as f64).ln();
        of_size - log_chance(among, &self.plan.attitude.blocks)
    }
}

fn unpriced(values: Triad) -> ParameterColumn {
    ParameterColumn {
        values,
        prior_std: f64::INFINITY,
        prior_mean: 0.0,
    }
}

/// Columns of an accepted effect.
fn named_columns(
    named: &Named,
    Physics {
        gyro,
        pool,
        candidates,
        ..
    }: Physics,
    registered: &Registration,
) -> Vec<ParameterColumn> {
    let about = &registered.about;
    if let Some(scanned) = named.scanned {
        let columns = scanned.columns(about, gyro).into_iter();
        return columns.map(unpriced).collect();
    }
    let mut effects = candidates.effects.iter();
    let Some((candidate, _)) = effects.find(|(_, places)| *places == named.places) else {
        return Vec::new();
    };
    let values = gyro.columns(pool, candidate, about).into_iter().enumerate();
    let std = |k: usize| candidate.hypothesis.bound(k).std;
    let priced = |(k, values)| ParameterColumn {
        prior_std: std(k),
        ..unpriced(values)
    };
    values.map(priced).collect()
}
