//! Analysis of rows of one rate: slow effects, lines, and the noise beside them.

use rlg_catalogue::candidates::Variant;
use rlg_findings::result::{EffectEntry, NoiseTermsEntry, UNLISTED};
use rlg_inference::observations::runs;
use rlg_inference::{Observations, TooFewRows};
use rlg_model::kinds::FAULT_KINDS;
use rlg_model::{DeclaredModel, Model};
use rlg_plan::Plan;
use rlg_signal::fault::Fault;
use rlg_signal::partition::Use;
use rlg_signal::still::AtRest;
use rlg_signal::streams::{Streams, Triad, add_triad};

use super::noise::{noise_lines, noise_terms, unlike_noise};
use super::rows::Parted;
use super::settle::{settle, without_effects};
use super::slow_words::{slow_effects, with_found};
use super::{narrowband, noise};
use crate::confirm::confirmed;
use crate::confirm::goodness::Misfit;
use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::lines_at_rest::band_words;
use crate::lines_at_rest::bands::{self, Bands, Rows};
use crate::lines_at_rest::line::{Clock, Line};
use crate::lines_at_rest::lines::{self, Lines};
use crate::outcome::Outcome;
use crate::report::findings;
use crate::rows::data::Data;
use crate::search::structure::Found;
use crate::settings::Settings;
use crate::unfit::Unfit;

/// Narrowband features of all gyros.
pub(super) struct Narrow {
    pub(super) lines: Lines,
    pub(super) bands: Bands,
}

impl Narrow {
    /// Increments of all lines, and of bands beyond the noise beside them \[rad\].
    pub(super) fn rows_rad(&self) -> Triad {
        let mut rows_rad = self.lines.rows_rad.clone();
        add_triad(&mut rows_rad, &self.bands.rows_rad, 1.0);
        rows_rad
    }

    fn is_any(&self) -> bool {
        self.lines.lines.iter().any(Line::is_any) || !self.bands.bands.is_empty()
    }

    /// Increments that a model does not hold \[rad\].
    fn news_rad(&self, clock: Clock, model: &Model) -> Triad {
        let mut news_rad = self.lines.news_rad(clock, model);
        let mut bands = self.bands.bands.iter();
        if bands.any(|band| !band_words::is_known(band, model)) {
            add_triad(&mut news_rad, &self.bands.rows_rad, 1.0);
        }
        news_rad
    }
}

/// Result of the analysis of rows of one rate.
pub(super) struct Looked {
    /// Findings except lines; its effects are only unnamed locations and faults of the data.
    pub(super) outcome: Outcome,
    /// Slow effects, and noise.
    pub(super) slow: Vec<EffectEntry>,
    /// Noise terms of each gyro whose residual agrees with them.
    pub(super) terms: [Option<NoiseTermsEntry>; 3],
    /// The same in sentences.
    pub(super) noise_lines: Vec<String>,
    /// True if the residual agrees with noise of those terms.
    pub(super) is_noise: bool,
    /// Lines and bands of the rows as they were recorded.
    pub(super) narrow: Option<Narrow>,
    /// Residual after all found effects \[rad\], and before.
    pub(super) left_rad: Triad,
    pub(super) before_rad: Triad,
    pub(super) parted: Parted,
    /// Mean rates, and the direction of the Earth's rotation.
    pub(super) rest: AtRest,
}

/// Analyses rows of one rate of a unit at rest.
///
/// # Inputs
/// `is_as_recorded`: true for the rows of the recording, in which lines are sought; false for sums of them.
pub(super) fn look(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: DeclaredModel<'_>,
    is_as_recorded: bool,
    progress: &dyn Fn(&str),
) -> Result<Looked, Unfit> {
    let DeclaredModel { model, file } = of;
    let mut rest = streams.at_rest.clone().expect("a unit at rest");
    let plan = &settings.plan;
    let mut data = Data::new(streams, model, plan, file)?;
    let observations = Observations::bridged(&data.streams.usable)?;
    set_aside(&mut data, &observations, plan);
    let (mut found, mut unlike) = steadily(&mut data, &mut rest, settings, progress)?;
    let mut narrow = None;
    if is_as_recorded {
        let of = (&mut data, &mut rest, &observations);
        (narrow, found, unlike) = beside_lines(of, (found, unlike), settings, progress)?;
    }
    let terms = noise_terms(&data, &found);
    let clean_rad = without_effects(&found, |_| true);
    let left_rad = data.aside.with_unexplained(&clean_rad);
    let before_rad = data.aside.with_all(&found.residual_rad);
    let runs_of = |uses: &[Use]| runs(&data.rows_of(uses), true);
    let parted = Parted {
        fitted: runs_of(&[Use::Fit]),
        held_out: runs_of(&[Use::Test]),
    };
    let mut together = Together::of_one(found);
    let tested = together.self_test(None, plan, settings.seed);
    together.release();
    progress("writing the findings");
    let confirmed = confirmed(Recordings::of_one(&data), &mut together, plan)?;
    let share = confirmed.share(&mut together, &data, 0);
    let of = together.of(&data, 0);
    let mut outcome = findings::outcome(of, &share, faults, settings.seed, plan);
    outcome.diagnosis.add_self_test(tested);
    // Sums of rows determine the noise less well than the recorded rows.
    let diagnosis = &mut outcome.diagnosis;
    let (others, effects) = std::mem::take(&mut diagnosis.effects)
        .into_iter()
        .partition(is_located_or_fault);
    diagnosis.effects = others;
    let slow = slow_effects(effects, &data, &rest, is_as_recorded, plan);
    outcome.model = with_found(model, outcome.model, &slow);
    Ok(Looked {
        outcome,
        slow,
        noise_lines: noise_lines(&terms, &unlike, data.streams, &settings.plan.findings),
        terms: std::array::from_fn(|gyro| terms[gyro].filter(|_| noise::is_noise(gyro, &unlike))),
        is_noise: unlike.is_empty(),
        narrow,
        left_rad,
        before_rad,
        parted,
        rest,
    })
}

/// Removes lines and bands from the residual, and searches anew given them.
///
/// # Returns
/// Lines and bands, slow effects given them, and octaves in which the residual deviates from noise.
fn beside_lines(
    (data, rest, observations): (&mut Data, &mut AtRest, &Observations),
    (mut found, mut unlike): (Found, Vec<Misfit>),
    settings: &Settings,
    progress: &dyn Fn(&str),
) -> Result<(Option<Narrow>, Found, Vec<Misfit>), TooFewRows> {
    /// Number of searches for lines. A slow line passes for drift: under the noise without it its own size shows.
    const TURNS: usize = 2;
    let clock = Clock {
        rows: data.streams.rows,
        rate_hz: data.streams.rate_hz,
    };
    let mut narrow: Option<Narrow> = None;
    for _ in 0..TURNS {
        progress("taking out lines");
        let mut whole_rad = data
            .aside
            .with_unexplained(&without_effects(&found, |_| true));
        let aside = std::mem::take(&mut data.aside);
        data.residual_rad = aside.with_unexplained(&data.residual_rad);
        if let Some(known) = &narrow {
            let rows_rad = known.rows_rad();
            add_triad(&mut whole_rad, &rows_rad, 1.0);
            add_triad(&mut data.residual_rad, &rows_rad, 1.0);
        }
        let seen = data.rows_of(&[Use::Fit]);
        let levels = &found.fit.levels;
        let lines = lines::search(&whole_rad, &seen, levels, clock.rate_hz, &settings.plan);
        narrow = lines.and_then(|lines| {
            let lines = lines.shown(&data.lattice, clock);
            add_triad(&mut whole_rad, &lines.rows_rad, -1.0);
            let rows = Rows {
                left_rad: &whole_rad,
                seen: &seen,
                usable: &data.streams.usable,
                clock,
            };
            let bands = bands::search(&rows, levels, &data.lattice, &settings.plan.rest.bands)?;
            Some(Narrow { lines, bands })
        });
        if let Some(narrow) = &narrow {
            add_triad(&mut data.residual_rad, &narrow.rows_rad(), -1.0);
            data.aside.explained_rad = narrow.news_rad(clock, data.model);
        }
        set_aside(data, observations, &settings.plan);
        if !narrow.as_ref().is_some_and(Narrow::is_any) {
            break;
        }
        (found, unlike) = steadily(data, rest, settings, progress)?;
    }
    Ok((narrow, found, unlike))
}

/// Sets aside the part of the residual that is too narrow for the noise terms.
fn set_aside(data: &mut Data, observations: &Observations, plan: &Plan) {
    let quiet_rad = narrowband::without_lines(&data.residual_rad, observations, &plan.rest.steady);
    let mut narrow_rad = std::mem::replace(&mut data.residual_rad, quiet_rad);
    add_triad(&mut narrow_rad, &data.residual_rad, -1.0);
    data.aside.unexplained_rad = narrow_rad;
}

/// Searches slow effects; without steps if one is on a gyro whose residual deviates from noise.
fn steadily(
    data: &mut Data,
    rest: &mut AtRest,
    settings: &Settings,
    progress: &dyn Fn(&str),
) -> Result<(Found, Vec<Misfit>), TooFewRows> {
    let found = settle(data, rest, settings, progress)?;
    let unlike = unlike_noise(data, &found, settings);
    if !has_step_on(&found, &unlike) {
        return Ok((found, unlike));
    }
    // Excursions of a residual that deviates from the fitted noise are no steps.
    let mut without_steps = *settings;
    without_steps.plan.judgement.event = f64::INFINITY;
    let found = settle(data, rest, &without_steps, progress)?;
    let unlike = unlike_noise(data, &found, settings);
    Ok((found, unlike))
}

fn has_step_on(found: &Found, unlike: &[Misfit]) -> bool {
    let mut members = found.fit.members.iter();
    members.any(|&member| match found.candidates[member].variant {
        Variant::Event { axis, .. } => unlike.iter().any(|one| one.gyro == axis),
        _ => false,
    })
}

/// True if an entry is an unnamed location or a fault of the data.
fn is_located_or_fault(effect: &EffectEntry) -> bool {
    let is_located = effect.kind == UNLISTED && effect.expression.is_none();
    is_located || FAULT_KINDS.contains(&&*effect.kind)
}
