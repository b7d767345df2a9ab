//! Diagnosis of accelerometers in still positions, with gravity as the only reference.

use rlg_plan::{AccelerometerRowsPlan, Plan, PositionPlan};
use std::ops::Range;

use nalgebra::Vector3;
use rlg_diagnosis::{Outcome, Settings};
use rlg_model::Model;
use rlg_recording::error::InputError;
use rlg_recording::units::STANDARD_GRAVITY_M_S2;
use rlg_recording::{Clock, Quantity, Recording, Table};
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::axes::AXES;

use super::errors::Errors;
use super::lengths::Readings;
use super::search::{Found, Observed, find};
use super::still::{self, Position};
use super::too_few;

/// Result of the diagnosis of still positions.
pub struct Diagnosed {
    /// Name of the recording.
    pub recording: String,
    /// The model that was diagnosed.
    pub model: Model,
    /// The recording has gyros, too.
    pub has_gyros: bool,
    /// Rows of the accelerometers.
    pub rows: Rows,
    /// Rows of a block.
    pub block_rows: usize,
    /// All positions.
    pub positions: Vec<Position>,
    /// Number of distinct directions of gravity.
    pub attitudes: usize,
    /// Stretches that were held but not still.
    pub restless: Vec<Range<usize>>,
    /// Places of the fitted positions, and of the held-out ones.
    pub fitted: Vec<usize>,
    /// See `fitted`.
    pub tested: Vec<usize>,
    /// Measurements of all positions.
    pub observed: Observed,
    /// Result of the search on the fitted positions.
    pub found: Found,
    /// Settings of the analysis.
    pub plan: Plan,
    /// Kinds taken out of the catalogue.
    pub left_out: Vec<String>,
    /// Seed of the self-test.
    pub seed: u64,
}

/// True for a recording of still positions: accelerometers without a reference and, if there are gyros, at least as many
/// attitudes as distinguish a moved unit from one at rest.
pub fn serves(recording: &Recording, plan: &Plan) -> bool {
    let references = [Quantity::ReferenceIncrement, Quantity::ReferenceAttitude];
    if recording.holds(&references) || !recording.holds(&Quantity::FORCES) {
        return false;
    }
    if !recording.holds(&Quantity::GYROS) {
        return true;
    }
    let Ok(rows) = rows_of(recording, &plan.signal.align.accelerometers) else {
        return false;
    };
    let own = &plan.positions;
    let positions = still::find(&rows, own).positions;
    attitudes(&positions, own) >= own.least_attitudes
}

/// Rows of the accelerometers on their own clock.
fn rows_of(recording: &Recording, plan: &AccelerometerRowsPlan) -> Result<Rows, String> {
    let is_force = |table: &&Table| {
        let mut channels = table.channels.iter();
        channels.any(|channel| Quantity::FORCES.contains(&channel.quantity))
    };
    let table = recording.tables.iter().find(is_force);
    let clock = table.and_then(|table| match table.clock {
        Clock::Uniform { rate_hz, start_s } => Some((rate_hz, start_s, table.rows)),
        Clock::Stamped { .. } => None,
    });
    Rows::new(recording, clock.unwrap_or((1.0, 0.0, 0)), plan)
}

/// Number of distinct attitudes among positions.
fn attitudes(positions: &[Position], plan: &PositionPlan) -> usize {
    let mut all: Vec<Vector3<f64>> = Vec::new();
    for one in positions {
        let mean = one.mean_m_s2();
        if all
            .iter()
            .all(|other| other.angle(&mean) > plan.other_attitude_rad)
        {
            all.push(mean);
        }
    }
    all.len()
}

/// Diagnoses accelerometers by the still positions of a recording.
///
/// # Errors
/// There are no three accelerometers on one clock, or their mean force is not gravity.
pub fn diagnose(
    settings: &Settings,
    recording: &Recording,
    model: &Model,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    progress("finding still positions");
    let of_rows = &settings.plan.signal.align.accelerometers;
    let rows = rows_of(recording, of_rows).map_err(|reason| {
        InputError::new(recording.folder.join("recording.toml"), reason)
            .channel("specific_force")
            .expected("specific_force or velocity_increment on x, y and z at one rate, where there are neither gyros nor a reference")
    })?;
    let plan = settings.plan;
    let own = &plan.positions;
    let still::Found {
        mut positions,
        restless,
        block_rows,
    } = still::find(&rows, own);
    let site = recording.site;
    let gravity_m_s2 = match site {
        Some(site) => [site.gravity_m_s2, 0.0],
        None => [STANDARD_GRAVITY_M_S2, own.gravity_std_m_s2],
    };
    let known = Errors::of_model(model);
    let scale_error = model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.scale_error);
    // Stretches without gravity's force are no positions: a unit held by a crane, or in free fall.
    let [gravity, _] = gravity_m_s2;
    let force_m_s2 = |one: &Position| known.undone_m_s2(&one.mean_m_s2(), scale_error).norm();
    let first_m_s2 = positions.first().map(force_m_s2);
    positions.retain(|one| (force_m_s2(one) / gravity - 1.0).abs() < own.far_from_gravity);
    if let (Some(first_m_s2), true) = (first_m_s2, positions.is_empty()) {
        let what = "shows another gravity than the Earth's in every still position";
        return Err(InputError::new(&recording.folder, what)
            .channel("specific_force")
            .value(format!("{first_m_s2:.4} m/s^2"))
            .expected(format!("about {gravity:.3} m/s^2: in which unit is it?")));
    }
    let attitudes = attitudes(&positions, own);
    if attitudes < own.least_attitudes {
        let of = (recording, model, settings);
        let read = (&rows, positions.as_slice());
        return Ok(too_few::outcome(of, read, attitudes, gravity_m_s2));
    }
    let is_last_of_some = |place: usize| place % own.held_out_every == own.held_out_every - 1;
    let (tested, fitted): (Vec<usize>, Vec<usize>) = (0..positions.len())
        .partition(|&place| positions.len() >= own.least_to_hold_out && is_last_of_some(place));
    let observed = Observed {
        readings: Readings::new(&positions, &fitted, rows.rate_hz, own),
        warming_k: warming_k(recording, &rows, &positions),
        gravity_m_s2,
        known,
        scale_error,
    };
    progress("searching the accelerometers' effects");
    let found = find(&observed.of(&fitted), (&plan, settings.left_out));
    let diagnosed = Diagnosed {
        recording: recording.name.clone(),
        model: model.clone(),
        has_gyros: recording.holds(&Quantity::GYROS),
        rows,
        block_rows,
        positions,
        attitudes,
        restless,
        fitted,
        tested,
        observed,
        found,
        plan,
        left_out: settings.left_out.iter().map(ToString::to_string).collect(),
        seed: settings.seed,
    };
    Ok(diagnosed.with_gyros(recording, progress))
}

impl Diagnosed {
    /// Outcome of the accelerometers and, if there are any, of the gyros.
    fn with_gyros(&self, recording: &Recording, progress: &dyn Fn(&str)) -> Outcome {
        let mut outcome = self.outcome();
        if !self.has_gyros {
            return outcome;
        }
        progress("carrying gravity by the gyros");
        match self.turned(recording) {
            Ok(found) => found.add_to(&mut outcome),
            Err(reason) => {
                let diagnosis = &mut outcome.diagnosis;
                let said = format!("The gyros are not compared: {reason}.");
                diagnosis.summary.push(said);
                let why = format!("every kind of the gyros: {reason}");
                diagnosis.not_excluded.push(why);
            }
        }
        outcome
    }
}

/// Warming of each block at each position since the first \[K\]; `None` if a thermometer has no sample there.
fn warming_k(
    recording: &Recording,
    rows: &Rows,
    positions: &[Position],
) -> Option<Vec<Vector3<f64>>> {
    let of_axis = |axis: usize| -> Option<Vec<f64>> {
        let mut all = recording
            .tables
            .iter()
            .flat_map(|table| table.channels.iter().map(move |channel| (table, channel)));
        let (table, channel) = all.find(|(_, channel)| {
            let own = channel.axis.as_deref();
            channel.quantity == Quantity::Temperature && own.is_none_or(|own| own == AXES[axis])
        })?;
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return None;
        };
        let row_at = |at: usize| {
            let time_s = rows.start_s + at as f64 / rows.rate_hz;
            ((time_s - start_s) * rate_hz).round().max(0.0) as usize
        };
        let each = positions.iter().map(|one| {
            let until = row_at(one.rows.end).max(row_at(one.rows.start) + 1);
            let values = channel.values.get(row_at(one.rows.start)..until)?;
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            mean.is_finite().then_some(mean)
        });
        each.collect()
    };
    let [x, y, z] = [of_axis(0)?, of_axis(1)?, of_axis(2)?];
    let at = |place: usize| Vector3::new(x[place] - x[0], y[place] - y[0], z[place] - z[0]);
    Some((0..positions.len()).map(at).collect())
}
