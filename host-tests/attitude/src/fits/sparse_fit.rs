//! Registration and physics of attitudes too few to estimate their noise, under a prior of it.

use nalgebra::Vector3;
use rlg_catalogue::Pool;
use rlg_diagnosis::Settings;
use rlg_recording::error::InputError;
use rlg_signal::axes::Triad;

use crate::fits::report_inputs::{Few, Fitted};
use crate::fits::sparse_attitudes::{AtRest, FewRows, NoiseBelief};
use crate::fits::sparse_search::{self, FewFound};
use crate::gyros::physics::{self, Gyro};
use crate::gyros::still_intervals::{self, Rest};
use crate::likelihood::equations::ParameterColumn;
use crate::registration::gauss_newton::Registration;
use crate::registration::observed::Observed;
use crate::rows::alignment::{Alignment, Free, places};
use crate::rows::fitting::priced;
use crate::rows::linearised_rows::About;
use crate::selection::group_selection::Candidates;

/// Most passes.
const PASSES: usize = 8;

/// Fits few attitudes; `None` if fewer than two lie within the gyros' record.
pub(crate) fn fit(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    let Some(about) = observed.about(of_model) else {
        return Ok(None);
    };
    let known_rad = observed.gyro(&about)?.known_rad(observed.model);
    observed.take_out(&known_rad);
    let fit = FewFit {
        belief: NoiseBelief::new(observed.model, &observed.gyros, &settings.plan),
        rest: still_intervals::find(&observed.gyros),
        observed,
        of_model,
        settings,
    };
    let settled = settings.plan.attitude.registration.settled;
    let mut alignment = of_model.clone();
    let mut free: Free = Vec::new();
    let mut pass = 0;
    // Physics after convergence of the registration, its linearisation point.
    let mut is_registered = false;
    loop {
        progress("evidence of effects with few attitudes");
        let Some(linearised) = fit.linearised(&alignment, is_registered)? else {
            return Ok(None);
        };
        let searched = fit.searched(&alignment, &linearised);
        let now = searched.found.groups();
        let step = searched.found.step_from(&alignment.beyond(of_model));
        pass += 1;
        let is_settled = pass % PASSES == 0 || (now == free && step.largest() < settled);
        if is_settled && is_registered {
            return Ok(Some(fit.fitted(alignment, linearised, searched)));
        }
        is_registered |= is_settled;
        alignment = alignment.with(&now, of_model).moved(&step.estimate);
        free = now;
    }
}

/// Few attitudes, with the prior of their noise.
struct FewFit<'a> {
    settings: &'a Settings<'a>,
    observed: &'a Observed<'a>,
    of_model: &'a Alignment,
    belief: NoiseBelief,
    rest: Option<Rest>,
}

/// Rows about an alignment, and the candidates of physics.
struct Linearised {
    about: About,
    gyro: Gyro,
    pool: Pool,
    candidates: Candidates,
}

impl FewFit<'_> {
    /// Forms rows about an alignment; `None` if fewer than two stamps lie within the gyros' record.
    fn linearised(
        &self,
        alignment: &Alignment,
        has_physics: bool,
    ) -> Result<Option<Linearised>, InputError> {
        let Some(about) = self.observed.about(alignment) else {
            return Ok(None);
        };
        let gyro = self.observed.gyro(&about)?;
        let (pool, effects) = match has_physics {
            true => gyro.candidates(self.settings.left_out),
            false => Default::default(),
        };
        Ok(Some(Linearised {
            about,
            gyro,
            pool,
            candidates: Candidates::new(effects),
        }))
    }

    /// Searches for groups of the registration and for physics.
    fn searched(&self, alignment: &Alignment, linearised: &Linearised) -> FewFound {
        let (columns, at_rest) = self.columns(alignment, linearised);
        let plan = &self.settings.plan;
        let rows = FewRows::new(
            &linearised.about.increments,
            &columns,
            at_rest.as_ref(),
            &self.belief,
            &plan.attitude.few,
        );
        sparse_search::search(&rows, &linearised.candidates, plan)
    }

    /// Columns of registration and physics about an alignment, and the gyros' mean rates at rest.
    fn columns(
        &self,
        alignment: &Alignment,
        Linearised {
            about,
            gyro,
            pool,
            candidates,
        }: &Linearised,
    ) -> (Vec<ParameterColumn>, Option<AtRest>) {
        let rate_hz = self.observed.gyros.rate_hz;
        let mut columns = priced(
            about.columns(rate_hz),
            alignment,
            self.of_model,
            &self.settings.plan.attitude.registration,
        );
        // At rest only the bias of the registration is sensed.
        let bias = places("gyro_bias");
        let mut sensed: Vec<Vector3<f64>> = (0..columns.len())
            .map(|k| match bias.contains(&k) {
                true => Vector3::ith(k - bias.start, 1.0),
                false => Vector3::zeros(),
            })
            .collect();
        for (candidate, _) in &candidates.effects {
            let in_case_rad: Vec<Triad> = gyro.in_case_rad(pool, candidate).collect();
            sensed.extend(self.rest.iter().flat_map(|rest| {
                let each = in_case_rad.iter();
                each.map(|case| {
                    rate_hz * rest.mean(|row| Vector3::from_fn(|axis, _| case[axis][row]))
                })
            }));
            let values = physics::carried(candidate, in_case_rad.into_iter(), about);
            columns.extend(
                values
                    .into_iter()
                    .enumerate()
                    .map(|(k, values)| ParameterColumn {
                        values,
                        prior_std: candidate.hypothesis.bound(k).std,
                        prior_mean: 0.0,
                    }),
            );
        }
        let at_rest = self.rest.as_ref().map(|rest| AtRest {
            lasts_s: rest.lasts_s,
            reading_rad_s: rate_hz * rest.mean(|row| self.observed.gyros.sensed_rad[row])
                - alignment.bias_rad_s,
            columns: sensed,
        });
        (columns, at_rest)
    }

    fn fitted(self, alignment: Alignment, of: Linearised, searched: FewFound) -> Fitted {
        let FewFound {
            found,
            noise: (walk_rad_sqrt_s, angle_rad),
            is_turning,
        } = searched;
        let rest = self.rest.filter(|_| !is_turning);
        Fitted {
            registered: Registration::of_few(
                alignment,
                of.about,
                walk_rad_sqrt_s,
                angle_rad,
                self.observed.stamps.clone(),
            ),
            gyro: of.gyro,
            pool: of.pool,
            candidates: of.candidates,
            found,
            few: Some(Few {
                rest_s: rest.map_or(0.0, |rest| rest.lasts_s),
            }),
        }
    }
}
