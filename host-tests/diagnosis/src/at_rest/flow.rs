//! From the aligned channels of a unit at rest to its slow effects and its noise.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{CATALOGUE, STEP};
use rlg_catalogue::signals;
use rlg_findings::result::{
    ChannelEntry, EffectEntry, LocationEntry, NoiseEntry, NoiseTermsEntry, ParameterEntry,
};
use rlg_inference::Observations;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_signal::partition::Use;
use rlg_signal::still::AtRest;
use rlg_signal::streams::{AXES, Streams, Triad, add_triad};

use super::{alike, earth, steady, terms};
use crate::case_motion::estimate;
use crate::data::{self, Data};
use crate::findings;
use crate::goodness::{Misfit, misfits};
use crate::pass::left_on;
use crate::plan::AnalysisPlan;
use crate::search::{self, Found, effect_rad};
use crate::settings::Settings;

/// Kinds that this observation model decides on.
pub const KINDS: [&str; 5] = [
    BIAS,
    "gyro_bias_temperature",
    "gyro_bias_temperature_rate",
    "gyro_bias_magnetic",
    STEP,
];

const BIAS: &str = "gyro_bias";

/// What a unit at rest shows slowly, and its noise.
pub struct SlowEffects {
    /// Effects of [`KINDS`].
    pub effects: Vec<EffectEntry>,
    /// The model with them.
    pub model: Model,
    /// Noise of each gyro beside them.
    pub noise: Vec<NoiseEntry>,
    /// The same in sentences.
    pub noise_lines: Vec<String>,
    /// Where the model without them differs.
    pub locations: Vec<LocationEntry>,
    /// Figures on rows that were not fitted.
    pub channels: Vec<ChannelEntry>,
    /// What would tell apart what is confused.
    pub next_experiment: String,
    /// Pulse weight of each gyro as declared, less where its noise is less than such pulses make \[rad\].
    pub quieter_pulses_rad: [f64; 3],
}

/// Whether a recording is served: one record of a unit at rest, and a model whose effects can be predicted.
pub fn serves(streams: &Streams, model: &Model) -> bool {
    streams.at_rest.is_some()
        && streams.pieces.len() == 1
        && !streams.pieces[0].held_out
        && streams.pieces[0].origin.is_none()
        && data::can_predict(model)
}

/// Finds what acts slowly, using up the sensed increments; `None` where too few rows can be fitted.
///
/// Where what is left is not like noise of the terms that are fitted, rows are summed until it is: what is fast then has
/// no say in what is slow.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    of: (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<SlowEffects>, InputError> {
    /// Rows that become one at a time.
    const SUMMED: usize = 4;
    /// Rows that are left at least: six octaves of noise.
    const LEAST_ROWS: usize = 512;
    let mut first: Option<SlowEffects> = None;
    loop {
        let sensed_rad = streams.sensed_rad.clone();
        let Some((slow, is_noise)) = look(settings, streams, of, progress)? else {
            return Ok(first);
        };
        first = Some(match first {
            None => slow,
            Some(first) => SlowEffects {
                effects: slow.effects,
                model: slow.model,
                next_experiment: slow.next_experiment,
                ..first
            },
        });
        if is_noise || streams.rows / SUMMED < LEAST_ROWS {
            return Ok(first);
        }
        streams.sensed_rad = sensed_rad;
        streams.sum_rows(SUMMED);
    }
}

/// What rows of one rate show, and whether all that is left is like noise.
fn look(
    settings: &Settings,
    streams: &mut Streams,
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<(SlowEffects, bool)>, InputError> {
    let Some(mut rest) = streams.at_rest.clone() else {
        return Ok(None);
    };
    let plan = &settings.plan;
    let mut data = Data::new(streams, model, plan, model_file)?;
    let Some(observations) = Observations::bridged(&data.streams.usable) else {
        return Ok(None);
    };
    data.residual_rad = steady::without_lines(&data.residual_rad, &observations);
    let Some(mut found) = settle(&mut data, &mut rest, settings, progress) else {
        return Ok(None);
    };
    let mut unlike = unlike_noise(&found, settings);
    if has_step_on(&found, &unlike) {
        // Where what is left is not the noise that was fitted, its wiggles are no steps.
        let mut without_steps = *settings;
        without_steps.plan.event = f64::INFINITY;
        match settle(&mut data, &mut rest, &without_steps, progress) {
            Some(again) => found = again,
            None => return Ok(None),
        }
        unlike = unlike_noise(&found, settings);
    }
    let noise = noise_terms(&data, &found);
    let quieter_pulses_rad = quieter_pulses_rad(model, &noise, &unlike);
    found.equations.truncate(0);
    let Some(outcome) = findings::outcome(&data, &mut found, &[], settings.seed, plan) else {
        return Ok(None);
    };
    let mut diagnosis = outcome.diagnosis;
    diagnosis
        .effects
        .retain(|effect| KINDS.contains(&&*effect.kind));
    diagnosis.effects.retain(|effect| stands(effect, plan));
    let mut with_effects = outcome.model;
    with_effects.effects.retain(|one| {
        let is_found = diagnosis.effects.iter().any(|entry| is_of(one, entry));
        model.effects.contains(one) || is_found
    });
    for one in &model.effects {
        if with_effects
            .effects
            .iter()
            .all(|other| other.kind != one.kind)
        {
            with_effects.effects.push(one.clone());
        }
    }
    for effect in diagnosis.effects.iter_mut().filter(|one| one.kind == BIAS) {
        open_to_the_earth(effect, &data, &rest);
    }
    let noise_lines = noise_lines(&noise, &unlike, data.streams);
    for (gyro, terms) in noise.into_iter().enumerate() {
        diagnosis.noise[gyro].terms = Some(terms).filter(|_| is_noise(gyro, &unlike));
    }
    let slow = SlowEffects {
        effects: diagnosis.effects,
        model: with_effects,
        noise: diagnosis.noise,
        noise_lines,
        locations: diagnosis.locations,
        channels: diagnosis.fit.channels,
        next_experiment: diagnosis.next_experiment,
        quieter_pulses_rad,
    };
    Ok(Some((slow, unlike.is_empty())))
}

/// Whether what is left of a gyro is like its noise.
fn is_noise(gyro: usize, unlike: &[Misfit]) -> bool {
    unlike.iter().all(|one| one.gyro != gyro)
}

/// The noise of each gyro, or where it is none, in sentences.
fn noise_lines(noise: &[NoiseTermsEntry], unlike: &[Misfit], streams: &Streams) -> Vec<String> {
    let of_gyro = |(gyro, terms): (usize, &NoiseTermsEntry)| match is_noise(gyro, unlike) {
        true => Some(terms::sentence(AXES[gyro], terms)),
        false => findings::unlike_noise(gyro, unlike, streams),
    };
    noise.iter().enumerate().filter_map(of_gyro).collect()
}

/// Octaves in which what is left of a gyro is not the noise that was fitted.
fn unlike_noise(found: &Found, settings: &Settings) -> Vec<Misfit> {
    let of_gyro = |gyro: usize| {
        let levels = found.fit.levels[gyro];
        let basis = found.equations.basis_beside_gaps(levels);
        let left = left_on(&found.equations, &found.fit, &found.candidates, gyro);
        misfits(&basis, &left, levels, gyro, &settings.plan)
    };
    (0..3).flat_map(of_gyro).collect()
}

fn has_step_on(found: &Found, unlike: &[Misfit]) -> bool {
    let mut members = found.fit.members.iter();
    members.any(|&member| match found.candidates[member].variant {
        Variant::Event { axis, .. } => unlike.iter().any(|one| one.gyro == axis),
        _ => false,
    })
}

/// Whether an effect of a model is a finding: of steps there may be several.
fn is_of(effect: &ModelEffect, entry: &EffectEntry) -> bool {
    let time_s = entry.parameters.iter().find_map(|one| match one {
        ParameterEntry::Number { name, value, .. } if name == "time_s" => Some(*value),
        _ => None,
    });
    let same_time = time_s
        .is_none_or(|time_s| effect.parameters.get("time_s") == Some(&EffectValue::Number(time_s)));
    effect.kind == entry.kind && same_time
}

/// Whether an effect still costs more to do without than a name must, once drift has been fitted anew beside it.
fn stands(effect: &EffectEntry, plan: &AnalysisPlan) -> bool {
    let values: Vec<f64> = effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { name, value, .. } if name != "time_s" => Some(*value),
            _ => None,
        })
        .collect();
    let values = DVector::from_vec(values);
    let count = values.len();
    let covariance = DMatrix::from_fn(count, count, |a, b| effect.covariance[a][b]);
    let Some(cholesky) = covariance.cholesky() else {
        return true;
    };
    0.5 * values.dot(&cholesky.solve(&values)) > plan.naming
}

/// Pulse weights as declared, or what the noise leaves of them where it holds less than they would make.
fn quieter_pulses_rad(model: &Model, noise: &[NoiseTermsEntry], unlike: &[Misfit]) -> [f64; 3] {
    /// Standard deviations by which a declaration must be missed.
    const CONTRADICTED: f64 = 3.0;
    std::array::from_fn(|gyro| {
        let declared = model.gyro.pulse_weight_rad[gyro];
        let is_noise = is_noise(gyro, unlike);
        let most = noise[gyro]
            .quantisation_rad
            .filter(|_| is_noise)
            .map(|level| {
                // The square has the spread, see `LevelEntry`.
                let of_square = match level.value > level.std {
                    true => 2.0 * level.value * level.std,
                    false => level.std * level.std,
                };
                (12.0 * (level.value * level.value + CONTRADICTED * of_square)).sqrt()
            });
        declared.min(most.unwrap_or(f64::INFINITY))
    })
}

/// Searches, and lays the Earth's rotation to what is constant in the result, until it stays there: what follows the
/// temperature must not turn it.
fn settle(
    data: &mut Data,
    rest: &mut AtRest,
    settings: &Settings,
    progress: &dyn Fn(&str),
) -> Option<Found> {
    /// Changes below this share of a mean's noise change nothing.
    const SETTLED: f64 = 0.1;
    const MOST_TURNS: usize = 5;
    let others = CATALOGUE.iter().map(|entry| entry.kind);
    let others = others.filter(|kind| !KINDS.contains(kind));
    let left_out: Vec<&str> = settings.left_out.iter().copied().chain(others).collect();
    let plan = &settings.plan;
    let motion = estimate(
        data,
        &Triad::default(),
        &[],
        &[],
        signals::Path::default(),
        plan,
    );
    data.set_known(&motion.signals);
    let mut left_rad = data.residual_rad.clone();
    add_triad(&mut left_rad, &data.known_rad(&motion.signals), -1.0);
    let constant = constant_rad_s(data, rest, &left_rad);
    lay(data, rest, constant);
    let mut turn = 1;
    loop {
        let found = search::find(data, &left_out, plan, progress)?;
        let mut left_rad = found.residual_rad.clone();
        for (place, &member) in found.fit.members.iter().enumerate() {
            if found.candidates[member].kind != BIAS {
                add_triad(&mut left_rad, &effect_rad(&found, &found.fit, place), -1.0);
            }
        }
        let constant = constant_rad_s(data, rest, &left_rad);
        let change = rest.nearest_earth_rad_s(constant) - rest.earth_rad_s;
        let seconds = data.streams.rows as f64 / data.streams.rate_hz;
        let white = found.fit.levels.iter().map(|levels| levels.white);
        let white_rad2 = white.fold(f64::INFINITY, f64::min) * data.streams.rate_hz;
        if change.norm() < SETTLED * (white_rad2 / seconds).sqrt() || turn == MOST_TURNS {
            return Some(found);
        }
        lay(data, rest, constant);
        turn += 1;
    }
}

/// Mean rate in the body that a residual leaves, the Earth's rotation included \[rad/s\].
fn constant_rad_s(data: &Data, rest: &AtRest, left_rad: &Triad) -> Vector3<f64> {
    let seen = data.rows_of(&[Use::Train, Use::Confirm]);
    let count = seen.iter().filter(|&&seen| seen).count().max(1) as f64;
    let sensed = Vector3::from_fn(|gyro, _| {
        let pairs = left_rad[gyro].iter().zip(&seen);
        let sum: f64 = pairs
            .filter(|(_, seen)| **seen)
            .map(|(value, _)| value)
            .sum();
        sum / count * data.streams.rate_hz * (1.0 - data.model.gyro.scale_error[gyro])
    });
    body_from_sensing(data) * sensed + rest.earth_rad_s
}

fn body_from_sensing(data: &Data) -> Matrix3<f64> {
    data.sensing_from_body
        .try_inverse()
        .unwrap_or_else(Matrix3::identity)
}

/// Lays the Earth's rotation to a constant rate of the gyros.
fn lay(data: &mut Data, rest: &mut AtRest, constant_rad_s: Vector3<f64>) {
    let nearest = rest.nearest_earth_rad_s(constant_rad_s);
    let change = data.sensing_from_body * (nearest - rest.earth_rad_s);
    let (rows, rate_hz) = (data.streams.rows, data.streams.rate_hz);
    for gyro in 0..3 {
        let scale = 1.0 - data.model.gyro.scale_error[gyro];
        let change_rad = change[gyro] / scale / rate_hz;
        let values = data.residual_rad[gyro].iter_mut();
        values.for_each(|value| *value -= change_rad);
    }
    rest.earth_rad_s = nearest;
    let turns = |axis: usize| vec![nearest[axis] / rate_hz; rows];
    data.reference_rad = Arc::new([0, 1, 2].map(turns));
}

/// Noise of each gyro beside what was found.
fn noise_terms(data: &Data, found: &Found) -> Vec<NoiseTermsEntry> {
    let record = (data.streams.rows, data.streams.rate_hz);
    let of_gyro = |gyro: usize| {
        let levels = found.fit.levels[gyro];
        let basis = found.equations.basis_beside_gaps(levels);
        terms::terms(&basis, levels, found.fit.drift[gyro], record)
    };
    (0..3).map(of_gyro).collect()
}

/// Adds to a bias what the Earth's rotation leaves open of it, and what else it can be.
fn open_to_the_earth(effect: &mut EffectEntry, data: &Data, rest: &AtRest) {
    let mut bias_rad_s = Vector3::zeros();
    let mut gyros = Vec::new();
    for parameter in &effect.parameters {
        let ParameterEntry::Number { name, value, .. } = parameter else {
            continue;
        };
        let Some(gyro) = AXES.iter().position(|axis| axis == name) else {
            continue;
        };
        bias_rad_s[gyro] = *value;
        gyros.push(gyro);
    }
    let variance: f64 = (0..gyros.len()).map(|k| effect.covariance[k][k]).sum();
    let mean_rad_s = rest.earth_rad_s + body_from_sensing(data) * bias_rad_s;
    let sensing = data.sensing_from_body;
    let open = sensing * earth::spread(rest, mean_rad_s, variance) * sensing.transpose();
    for (a, &gyro) in gyros.iter().enumerate() {
        for (b, &other) in gyros.iter().enumerate() {
            effect.covariance[a][b] += open[(gyro, other)];
        }
    }
    let std_of = |name: &str| {
        let of = |gyro: &&usize| AXES[**gyro] == name;
        let place = gyros.iter().position(|gyro| of(&gyro))?;
        Some(effect.covariance[place][place].max(0.0).sqrt())
    };
    for parameter in &mut effect.parameters {
        if let ParameterEntry::Number { name, std, .. } = parameter {
            *std = std_of(name).unwrap_or(*std);
        }
    }
    for one in &mut effect.identifiable {
        let mut names = one.combination.keys();
        if let (Some(name), None) = (names.next(), names.next()) {
            one.std = std_of(name).unwrap_or(one.std);
        }
    }
    let gravity_m_s2 = data.streams.site.map_or(0.0, |site| site.gravity_m_s2);
    for kind in alike::alike(bias_rad_s, gravity_m_s2) {
        if !effect.indistinguishable_from.contains(&kind) {
            effect.indistinguishable_from.push(kind);
        }
    }
    if let Some(evidence) = effect.evidence.as_mut()
        && !effect.indistinguishable_from.is_empty()
    {
        evidence.label = "class";
    }
    let open_is = match rest.up {
        Some(_) => "its azimuth",
        None => "its direction: no accelerometer says what is up",
    };
    effect.what_was_left_out = format!(
        "The mean rates are not the Earth's at this site: of its rotation all is known but {open_is}, and the intervals hold that."
    );
}
