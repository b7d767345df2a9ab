//! Tests whether all recordings can be of one moving instrument.
//!
//! Compares each recording's own estimate with the joint one; the error names the recording at fault.

use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::path::Path;

use super::estimate::{Estimate, directions, quadratic};
use super::unknowns::{COEFFICIENTS, FLEXURE, Unknowns};
use rlg_plan::{AgreementPlan, CalibrationPlan};
use rlg_recording::error::InputError;
use rlg_recording::{Clock, MANIFEST, Quantity, Recording};

/// Checks that the gyros of all recordings report the same quantity at the same rate.
pub fn gyros_report_alike(recordings: &[Recording]) -> Result<(), InputError> {
    let mut first: Option<(String, f64)> = None;
    for recording in recordings {
        let Some((table, channel)) = Quantity::GYROS
            .iter()
            .find_map(|quantity| recording.channel(quantity, "x"))
        else {
            continue;
        };
        let Clock::Uniform { rate_hz, .. } = table.clock else {
            continue;
        };
        let own = (channel.quantity.name().to_owned(), rate_hz);
        match &first {
            None => first = Some(own),
            Some(first) if *first == own => {}
            Some((quantity, rate_hz)) => {
                return Err(InputError::new(
                    recording.folder.join(MANIFEST),
                    "is not of the same instrument as the recordings before it",
                )
                .channel(channel.column.clone())
                .value(format!("{} at {} Hz", own.0, own.1))
                .expected(format!("{quantity} at {rate_hz} Hz")));
            }
        }
    }
    Ok(())
}

/// Kinds whose size is credible only if gyros and reference measure one motion, the most direct first.
const OF_THE_MOTION: [&str; 3] = ["gyro_scale", "installation", FLEXURE];

/// Checks that fitted scale, installation and flexure are credible for a gyro that moves as its reference, in the declared
/// units of both.
pub fn is_credible(
    recording: &Recording,
    own: &Estimate,
    unknowns: &Unknowns,
    plan: &AgreementPlan,
) -> Result<(), InputError> {
    let of = |kind: &'static str| {
        let fitted = unknowns.fitted();
        fitted.filter(move |&index| unknowns.get(index).kind == kind)
    };
    for index in OF_THE_MOTION.into_iter().flat_map(of) {
        let unknown = unknowns.get(index);
        let largest = unknown.largest();
        if own.values[index].abs() - plan.deviations * own.stds[index] > largest {
            return Err(InputError::new(
                recording.folder.join(MANIFEST),
                "has gyros and a reference that measure different motions",
            )
            .channel(format!("{} {}", unknown.kind, unknown.name))
            .value(format!("{:.3e}", own.values[index]))
            .expected(format!(
                "at most {largest} {}: are both in rad, on the same axes, with the model's pulse weight?",
                unknown.unit()
            )));
        }
    }
    Ok(())
}

/// Checks that the recordings agree on installation, scale and K (χ² test).
pub fn agree(
    recordings: &[Recording],
    own: &[(Unknowns, Estimate)],
    joint: &Estimate,
    plan: &AgreementPlan,
) -> Result<(), InputError> {
    for (place, (unknowns, estimate)) in own.iter().enumerate().skip(1) {
        let fault = |what: String, value: String, expected: String| {
            Err(InputError::new(
                recordings[place].folder.join(MANIFEST),
                format!("does not agree with {} on {what}", recordings[0].name),
            )
            .value(value)
            .expected(expected))
        };
        let first = &own[0].1;
        for index in unknowns.fitted().skip(COEFFICIENTS) {
            let unknown = unknowns.get(index);
            let stable = match unknown.kind {
                "installation" => plan.installation_rad,
                "gyro_scale" => plan.gyro_scale,
                _ => continue,
            };
            let apart = (estimate.values[index] - first.values[index]).abs();
            let std = estimate.stds[index].hypot(first.stds[index]);
            if apart - plan.deviations * std > stable {
                return fault(
                    format!("{} {}", unknown.kind, unknown.name),
                    format!("{apart:.3e} apart"),
                    format!("recordings of one instrument, the same to {stable}"),
                );
            }
        }
    }
    if own.len() < 2 {
        return Ok(());
    }
    // Σ over recordings of (K_r − K)ᵀ C_r⁻¹ (K_r − K): six degrees of freedom for each recording beyond the first.
    let apart: Vec<f64> = own
        .iter()
        .map(|(_, estimate)| {
            let difference =
                DVector::from_fn(COEFFICIENTS, |k, _| estimate.values[k] - joint.values[k]);
            quadratic(&estimate.covariance, &difference)
        })
        .collect();
    let degrees = (COEFFICIENTS * (own.len() - 1)) as f64;
    let chance = ChiSquared::new(degrees).map_or(1.0, |law| law.sf(apart.iter().sum()));
    if chance < plan.chance {
        let worst = (0..apart.len())
            .max_by(|&a, &b| apart[a].total_cmp(&apart[b]))
            .unwrap_or(0);
        return Err(InputError::new(
            recordings[worst].folder.join(MANIFEST),
            "has other flexure coefficients than the recordings together",
        )
        .channel("axis_flexure")
        .value(format!("chi-squared {:.1}", apart[worst]))
        .expected(format!(
            "about {COEFFICIENTS}: recordings of one instrument"
        )));
    }
    Ok(())
}

/// Checks that the recordings contain information on at least one K.
pub fn moved(
    model_file: &Path,
    recordings: &[Recording],
    joint: &Estimate,
    acceleration_rad_s2: f64,
    plan: &CalibrationPlan,
) -> Result<(), InputError> {
    let best = directions(&joint.covariance)[0].std;
    if best <= plan.typical_s2 {
        return Ok(());
    }
    let file = match recordings {
        [only] => only.folder.join(MANIFEST),
        _ => model_file.to_path_buf(),
    };
    Err(
        InputError::new(file, "no recording moves enough to bend an axis")
            .channel("axis_flexure")
            .value(format!(
                "at most {acceleration_rad_s2:.3} rad/s^2, best combination known to {best:.1e} s^2"
            ))
            .expected(
                "coning, or spin with an oscillation across it, of some rad/s^2; before attitude samples also \
                 turns about all three axes, because an unknown scale error cones like flexure",
            ),
    )
}
