//! Accelerometers in too few attitudes for a search: their noise, lines and the one length of gravity.

use rlg_diagnosis::{Outcome, Settings, at_rest};
use rlg_findings::result::Diagnosis;
use rlg_model::Model;
use rlg_plan::PositionPlan;
use rlg_recording::Recording;
use rlg_recording::units::MICRO_G_PER_M_S2 as MICRO_G;
use rlg_signal::accelerometer_rows::Rows;

use super::lengths::Readings;
use super::still::Position;

/// Next experiment if nothing is confounded: as many positions as hold some out.
pub(super) fn next_experiment(plan: &PositionPlan) -> String {
    format!(
        "Hold the unit still in {} positions or more, ten seconds each: every axis up and down, and between two axes by 45 degrees.",
        plan.least_to_hold_out
    )
}

/// Outcome of a recording with the unit in too few attitudes.
///
/// # Inputs
/// `attitudes`: their number; `gravity_m_s2`: gravity and its standard deviation.
pub(super) fn outcome(
    (recording, model, settings): (&Recording, &Model, &Settings),
    (rows, positions): (&Rows, &[Position]),
    attitudes: usize,
    gravity_m_s2: [f64; 2],
) -> Outcome {
    let plan = &settings.plan;
    let stood = match attitudes {
        0 => "nowhere".to_string(),
        1 => "in 1 attitude".to_string(),
        more => format!("in {more} attitudes"),
    };
    let why = format!(
        "the accelerometers stood still {stood}, and {} at least are needed: with gravity alone as the reference, one attitude shows one number",
        plan.positions.least_attitudes
    );
    let mut diagnosis = Diagnosis {
        next_experiment: next_experiment(&plan.positions),
        ..Diagnosis::unusable(&recording.name, settings.seed, &why)
    };
    diagnosis.summary = vec![format!(
        "Errors of the accelerometers are not observable: {why}."
    )];
    let longest = positions.iter().max_by_key(|one| one.rows.len());
    if let Some(longest) = longest {
        // Noise of the longest rest alone: motion is no noise.
        let mut still = rows.clone();
        let own = &longest.rows;
        let seen = still.usable.iter_mut().enumerate();
        seen.for_each(|(row, usable)| *usable &= own.contains(&row));
        let (noise, said) = at_rest::still_forces(&still, plan);
        diagnosis
            .summary
            .push(length(rows, longest, gravity_m_s2, settings));
        diagnosis.summary.extend(said);
        diagnosis.accelerometer_noise = noise;
    } else {
        diagnosis.summary.push(
            "Their noise is not distinguishable from the motion of a unit that is never at rest."
                .to_string(),
        );
    }
    Outcome {
        diagnosis,
        model: model.clone(),
        pictures: None,
    }
}

/// Sentence on the length of the force at a rest.
fn length(rows: &Rows, rest: &Position, [gravity, gravity_std]: [f64; 2], of: &Settings) -> String {
    let own = &of.plan.positions;
    let readings = Readings::new(std::slice::from_ref(rest), &[0], rows.rate_hz, own);
    let mean = rest.mean_m_s2();
    let along = mean.normalize();
    let variance = along.map(|one| one * one).dot(&readings.variance_m2_s4[0]);
    let std = (variance + gravity_std * gravity_std).sqrt();
    let [from_s, to_s] =
        [rest.rows.start, rest.rows.end].map(|row| rows.start_s + row as f64 / rows.rate_hz);
    let of_what = match gravity_std > 0.0 {
        true => "standard gravity",
        false => "the site's gravity",
    };
    let off = format!("{:+.0}", (mean.norm() - gravity) * MICRO_G).replace('-', "−");
    format!(
        "At rest from {from_s:.1} to {to_s:.1} s the force is {:.5} m/s² long, {off} ± {:.0} µg off {of_what}: a bias along it, or a scale error.",
        mean.norm(),
        std * MICRO_G
    )
}
