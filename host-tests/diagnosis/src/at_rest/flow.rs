//! From the aligned channels of a unit at rest to its slow effects and its noise.

use std::path::Path;

use nalgebra::{DMatrix, DVector, Vector3};
use rlg_catalogue::candidates::Variant;
use rlg_findings::result::{
    ChannelEntry, EffectEntry, ForceNoiseEntry, LocationEntry, NoiseEntry, ParameterEntry,
};
use rlg_inference::Observations;
use rlg_inference::observations::runs;
use rlg_model::kinds::NOISE_KINDS;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_signal::partition::Use;
use rlg_signal::still::AtRest;
use rlg_signal::streams::{AXES, Streams, Triad};

use super::kinds::{BIAS, KINDS};
use super::noise::{is_noise, noise_lines, noise_terms, quieter_pulses_rad, unlike_noise};
use super::rows::{self, Parted, RowsFound};
use super::settle::{body_from_sensing, settle, without_effects};
use super::{alike, earth, steady, terms};
use crate::data::{self, Data};
use crate::findings;
use crate::goodness::Misfit;
use crate::plan::AnalysisPlan;
use crate::search::Found;
use crate::settings::Settings;

/// What a unit at rest shows slowly, and its noise.
pub struct SlowEffects {
    /// Effects of [`KINDS`].
    pub effects: Vec<EffectEntry>,
    /// The model with them.
    pub model: Model,
    /// Noise of each gyro beside them.
    pub noise: Vec<NoiseEntry>,
    /// Noise of each accelerometer, where there are any.
    pub accelerometer_noise: Vec<ForceNoiseEntry>,
    /// The same in sentences.
    pub noise_lines: Vec<String>,
    /// What the rows show of the recorder: among the effects, and in the model.
    pub rows: RowsFound,
    /// Where the model without them differs.
    pub locations: Vec<LocationEntry>,
    /// Figures on rows that were not fitted.
    pub channels: Vec<ChannelEntry>,
    /// What would tell apart what is confused.
    pub next_experiment: String,
    /// Whether all that is left is like noise of those terms: whatever is more of it than the model declares is then
    /// among the effects.
    pub is_noise: bool,
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
    let forces = streams.accelerometers.as_ref().ok();
    let forces = forces
        .and_then(|rows| terms::of_accelerometers(rows, &settings.plan))
        .unwrap_or_default();
    let of_force = |(axis, one): (usize, &ForceNoiseEntry)| {
        let terms = one.terms.as_ref()?;
        Some(terms::sentence_of_force(AXES[axis], terms))
    };
    let force_lines: Vec<String> = forces.iter().enumerate().filter_map(of_force).collect();
    let mut first: Option<SlowEffects> = None;
    loop {
        let sensed_rad = streams.sensed_rad.clone();
        let Some(Looked {
            slow,
            left_rad,
            parted,
        }) = look(settings, streams, (of, first.is_none()), progress)?
        else {
            return Ok(first.map(with_rows));
        };
        let is_noise = slow.is_noise;
        first = Some(match first {
            None => SlowEffects {
                rows: rows::search(streams, of.0, (&left_rad, &parted), settings.seed),
                accelerometer_noise: forces.clone(),
                noise_lines: slow
                    .noise_lines
                    .iter()
                    .chain(&force_lines)
                    .cloned()
                    .collect(),
                ..slow
            },
            Some(first) => SlowEffects {
                effects: slow.effects,
                model: slow.model,
                next_experiment: slow.next_experiment,
                ..first
            },
        });
        if is_noise || streams.rows / SUMMED < LEAST_ROWS {
            return Ok(first.map(with_rows));
        }
        streams.sensed_rad = sensed_rad;
        streams.sum_rows(SUMMED);
    }
}

/// Counts what the rows show among the effects.
fn with_rows(mut slow: SlowEffects) -> SlowEffects {
    slow.noise_lines.push(format!(
        "Control: noise of the same rows shuffled shows {} cycles; {} were dropped for it.",
        slow.rows.cycles_of_shuffled, slow.rows.dropped
    ));
    let of_model = slow.rows.effects.iter().map(rows::of_model);
    slow.model.effects.extend(of_model);
    slow.effects.extend(slow.rows.effects.iter().cloned());
    slow
}

/// What rows of one rate show.
struct Looked {
    slow: SlowEffects,
    /// Residual beside what was found \[rad\].
    left_rad: Triad,
    parted: Parted,
}

/// Looks at rows of one rate.
fn look(
    settings: &Settings,
    streams: &mut Streams,
    ((model, model_file), is_as_recorded): ((&Model, &Path), bool),
    progress: &dyn Fn(&str),
) -> Result<Option<Looked>, InputError> {
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
    let mut unlike = unlike_noise(&data, &found, settings);
    if has_step_on(&found, &unlike) {
        // Where what is left is not the noise that was fitted, its wiggles are no steps.
        let mut without_steps = *settings;
        without_steps.plan.event = f64::INFINITY;
        match settle(&mut data, &mut rest, &without_steps, progress) {
            Some(again) => found = again,
            None => return Ok(None),
        }
        unlike = unlike_noise(&data, &found, settings);
    }
    let noise = noise_terms(&data, &found);
    let quieter_pulses_rad = quieter_pulses_rad(model, &noise, &unlike);
    let left_rad = without_effects(&found, |_| true);
    let runs_of = |uses: &[Use]| runs(&data.rows_of(uses), true);
    let parted = Parted {
        fitted: runs_of(&[Use::Train, Use::Confirm]),
        held_out: runs_of(&[Use::Test]),
    };
    found.equations.truncate(0);
    let Some(outcome) = findings::outcome(&data, &mut found, &[], settings.seed, plan) else {
        return Ok(None);
    };
    let mut diagnosis = outcome.diagnosis;
    // Of summed rows the noise says less than of those that were recorded.
    let is_judged = unlike.is_empty() && is_as_recorded;
    diagnosis.effects.retain(|effect| {
        let is_excess = NOISE_KINDS.contains(&&*effect.kind);
        is_excess && is_judged || KINDS.contains(&&*effect.kind) && stands(effect, plan)
    });
    let with_effects = with_found(model, outcome.model, &diagnosis.effects);
    for effect in &mut diagnosis.effects {
        match &*effect.kind {
            BIAS => open_to_the_earth(effect, &data, &rest),
            // Where the values are multiples of the pulse nothing else can be meant.
            "pulse_quantisation" if !data.lattice.is_any() => coarse(effect),
            _ => {}
        }
    }
    let noise_lines = noise_lines(&noise, &unlike, data.streams);
    for (gyro, terms) in noise.into_iter().enumerate() {
        diagnosis.noise[gyro].terms = terms.filter(|_| is_noise(gyro, &unlike));
    }
    let slow = SlowEffects {
        effects: diagnosis.effects,
        model: with_effects,
        noise: diagnosis.noise,
        accelerometer_noise: Vec::new(),
        rows: RowsFound::default(),
        noise_lines,
        locations: diagnosis.locations,
        channels: diagnosis.fit.channels,
        next_experiment: diagnosis.next_experiment,
        is_noise: unlike.is_empty(),
        quieter_pulses_rad,
    };
    Ok(Some(Looked {
        slow,
        left_rad,
        parted,
    }))
}

/// The model with those effects that stand, and everything that it had before.
fn with_found(before: &Model, mut model: Model, found: &[EffectEntry]) -> Model {
    model
        .effects
        .retain(|one| before.effects.contains(one) || found.iter().any(|entry| is_of(one, entry)));
    for one in &before.effects {
        if model.effects.iter().all(|other| other.kind != one.kind) {
            model.effects.push(one.clone());
        }
    }
    model
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

/// Says what white noise of angle at rest can be besides coarse pulses.
pub fn coarse(effect: &mut EffectEntry) {
    effect.indistinguishable_from = ["dither_gain", "dither_delay"].map(str::to_string).to_vec();
    effect.what_was_left_out = "White noise of angle beyond the resolution in which the file is written: a converter with larger pulses, or dither that was not stripped and folds over the whole band; without the pickoff these look the same.".to_string();
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
