//! Planner of a turntable programme that determines all six K, with the predicted accuracy.
//!
//! limits → candidates (moves) → design → predict → scenario
//!
//! From the table's limits and the instrument's model, a [`Programme`]: moves within the limits, their predicted covariance
//! against a rate reference (Cramér–Rao bound, physics §6), and a scenario for `rlg simulate`.
//!
//! Out of scope: the gimbals of a particular table, and moves that excite several pairs at once.

pub mod candidates;

pub mod design;

pub mod limits;

pub mod predict;

mod scenario;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::estimate::{condition_number, directions};
use super::noise::{DeclaredNoise, declared};
use super::result::NAMES;
use super::unknowns::COEFFICIENTS;
use super::words::E8;
use rlg_findings::entries::rows;
use rlg_findings::result::PlanEntry;
use rlg_model::{DeclaredModel, Model};
use rlg_plan::{Plan, ProgrammePlan};
use rlg_recording::error::InputError;
use rlg_signal::streams::AXES;

use candidates::{Candidate, candidates, rounded_up};
use limits::Limits;
use rlg_catalogue::moves::{Kind, Move};

/// Proposed programme.
pub struct Programme {
    /// The moves, in order.
    pub moves: Vec<Move>,
    /// `plan.json`.
    pub entry: ProgrammeEntry,
    /// `scenario.toml`.
    pub scenario: String,
}

/// `plan.json`.
#[derive(Debug, Clone, Serialize)]
pub struct ProgrammeEntry {
    /// Format of this file.
    pub format: u32,
    /// Moves in words.
    pub programme: Vec<String>,
    /// Total time, rest and ramps included \[s\].
    pub table_time_s: f64,
    /// Largest body rate \[rad/s\].
    pub greatest_rate_rad_s: f64,
    /// Largest angular acceleration \[rad/s²\].
    pub greatest_acceleration_rad_s2: f64,
    /// Predicted standard deviation of each K \[s²\].
    pub std: BTreeMap<String, f64>,
    /// Predicted standard deviation of each gyro's sum \[s²\].
    pub sum_std: BTreeMap<String, f64>,
    /// Predicted covariance, xy, xz, yx, yz, zx, zy \[s⁴\].
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the worst direction over that of the best; null: a direction stays unknown.
    pub condition_number: Option<f64>,
    /// Summary, a line each.
    pub summary: Vec<String>,
    /// Thresholds other than the defaults, from `--plan FILE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<PlanEntry>,
}

/// Proposes a programme within the limits of `limits_file` for the instrument of a model.
pub fn propose(
    limits: &Limits,
    limits_file: &Path,
    DeclaredModel { model, file }: DeclaredModel<'_>,
    plan: &Plan,
) -> Result<Programme, InputError> {
    let noise = noise_of(model, file)?;
    let own = &plan.calibration;
    let candidates = candidates(limits, &noise, &own.programme);
    let moves = programme(limits, limits_file, &candidates, &own.programme)?;
    let covariance = predict::covariance(&moves, limits, &noise, plan).ok_or_else(|| {
        InputError::new(limits_file, "leaves no time to measure")
            .channel("table_time_s")
            .value(limits.table_time_s)
    })?;
    let entry = entry(&moves, &covariance, plan);
    Ok(Programme {
        scenario: scenario::text("calibration-programme", &moves, limits, model),
        moves,
        entry,
    })
}

/// The declared noise of each gyro against its reference.
fn noise_of(model: &Model, file: &Path) -> Result<[DeclaredNoise; 3], InputError> {
    let noise = declared(model).ok_or_else(|| {
        InputError::new(file, "does not state the noise to plan with")
            .channel("gyro.angle_random_walk_rad_sqrt_s")
            .expected("three positive numbers in rad/sqrt(s)")
    })?;
    if model.reference.is_none() {
        return Err(
            InputError::new(file, "does not state the reference's noise")
                .channel("reference")
                .expected("[reference] with angle_noise_rad"),
        );
    }
    Ok(noise)
}

/// Moves: rest, all variants of every useful candidate, rest.
fn programme(
    limits: &Limits,
    file: &Path,
    candidates: &[Candidate],
    plan: &ProgrammePlan,
) -> Result<Vec<Move>, InputError> {
    let too_little = |least_s: f64| {
        InputError::new(file, "leaves no time at full motion beside rest and ramps")
            .channel("table_time_s")
            .value(limits.table_time_s)
            .expected(format!("at least {least_s:.0} s within these limits"))
    };
    if candidates.is_empty() {
        return Err(
            InputError::new(file, "leaves no spin and no cone that a table could make")
                .channel("greatest_frequency_hz")
                .value(limits.greatest_frequency_hz)
                .expected("a frequency at which the greatest rate and acceleration can be reached"),
        );
    }
    let shares = design::shares(candidates, limits.table_time_s, plan.least_share);
    let used: Vec<(&Candidate, f64)> = candidates
        .iter()
        .zip(shares)
        .filter(|(_, share)| *share > 0.0)
        .collect();
    let ramps_s: f64 = used
        .iter()
        .map(|(candidate, _)| 2.0 * candidate.ramp_s * candidate.variants.len() as f64)
        .sum();
    let left_s = limits.table_time_s - 2.0 * plan.rest_s - ramps_s;
    let least_s = 2.0 * plan.rest_s
        + ramps_s
        + used
            .iter()
            .map(|(candidate, share)| {
                plan.least_plateau_s * candidate.variants.len() as f64 / share
            })
            .fold(0.0, f64::max);
    let rest = Move {
        kind: Kind::Still,
        duration_s: plan.rest_s,
        ramp_s: 0.0,
    };
    let mut moves = vec![rest];
    for (candidate, share) in used {
        let count = candidate.variants.len();
        // Rounded down, so that the total stays within the time.
        let plateau_s = rounded_up(left_s * share / count as f64 - plan.grid_s, plan);
        if plateau_s < plan.least_plateau_s {
            return Err(too_little(least_s));
        }
        moves.extend((0..count).map(|variant| candidate.moved(variant, plateau_s)));
    }
    moves.push(rest);
    Ok(moves)
}

fn entry(moves: &[Move], covariance: &nalgebra::DMatrix<f64>, plan: &Plan) -> ProgrammeEntry {
    let name = |k: usize| NAMES[k].to_owned();
    let std: BTreeMap<String, f64> = (0..COEFFICIENTS)
        .map(|k| (name(k), covariance[(k, k)].sqrt()))
        .collect();
    let sum_std: BTreeMap<String, f64> = (0..3)
        .map(|gyro| {
            let (a, b) = (2 * gyro, 2 * gyro + 1);
            let variance = covariance[(a, a)] + covariance[(b, b)] + 2.0 * covariance[(a, b)];
            (format!("{}+{}", name(a), name(b)), variance.sqrt())
        })
        .collect();
    let greatest = moves
        .iter()
        .map(Move::greatest)
        .fold((0.0, 0.0), |most: (f64, f64), one| {
            (most.0.max(one.0), most.1.max(one.1))
        });
    let table_time_s: f64 = moves.iter().map(|one| one.duration_s).sum();
    let programme: Vec<String> = moves.iter().map(words).collect();
    let condition_number = condition_number(covariance, &plan.calibration);
    let worst = directions(covariance).last().map_or(0.0, |d| d.std);
    let changed = PlanEntry::changed(plan);
    let mut summary: Vec<String> = PlanEntry::sentence(&changed).into_iter().collect();
    summary.push(format!(
        "{} moves in {table_time_s:.1} s, up to {:.2} rad/s and {:.2} rad/s^2; each spin also in the other sense",
        moves.len(),
        greatest.0,
        greatest.1
    ));
    summary.extend(moves.iter().filter(|one| one.leads()).map(words));
    for (gyro, axis) in AXES.iter().enumerate() {
        let (a, b) = (name(2 * gyro), name(2 * gyro + 1));
        summary.push(format!(
            "predicted for gyro {axis}: K_{a} ± {:.3}, K_{b} ± {:.3}, sum ± {:.3} e-8 s^2",
            std[&a] * E8,
            std[&b] * E8,
            sum_std[&format!("{a}+{b}")] * E8
        ));
    }
    summary.push(format!(
        "worst direction ± {:.3} e-8 s^2, condition number {}",
        worst * E8,
        condition_number.map_or("infinite".to_owned(), |number| format!("{number:.2}"))
    ));
    ProgrammeEntry {
        format: 1,
        table_time_s,
        greatest_rate_rad_s: greatest.0,
        greatest_acceleration_rad_s2: greatest.1,
        std,
        sum_std,
        covariance: rows(covariance),
        condition_number,
        summary,
        programme,
        plan: changed,
    }
}

/// Move in words.
fn words(one: &Move) -> String {
    match one.kind {
        Kind::Still => format!("{:.2} s still", one.duration_s),
        Kind::Coning {
            axis,
            frequency_hz,
            angle_rad,
        } => format!(
            "{:.2} s coning about {} at {frequency_hz:.3} Hz, half-angle {:.3} deg",
            one.duration_s,
            AXES[axis],
            angle_rad.to_degrees()
        ),
        Kind::Spin {
            axis,
            rate_rad_s,
            across,
            frequency_hz,
            angle_rad,
            ..
        } => format!(
            "{:.2} s spin about {} at {:.1} deg/s, oscillating about {} at {frequency_hz:.3} Hz, {:.2} deg",
            one.duration_s,
            AXES[axis],
            rate_rad_s.to_degrees(),
            AXES[across],
            angle_rad.to_degrees()
        ),
    }
}
