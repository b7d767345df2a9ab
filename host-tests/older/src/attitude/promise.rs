//! What the proposed experiment will be worth: the separation that it promises, in standard deviations.
//!
//! Enters: two effects that a recording cannot tell apart, each with the values it would have, the noise, the spacing
//! of the attitudes. Leaves: |(I − P) effect|, P the projection on the rival and on plain gyro errors, by the Fisher
//! information of spin-synchronous oscillation under the same reference.
//!
//! The programme (physics §3): spin at one turn a second about one axis, both senses, oscillation at the same
//! frequency about another, phases 0 and 90°, all six pairs. Rates in closed form, ramps of a C³ step.
//!
//! The attitude must be read during the motion. Between two rests ∫ C W dα/dt dt = −∫ C (ω × W α) dt by parts, and
//! that is a flexure with K_ij = K_kj = W_jj: attitudes before and after cannot tell the two apart, whatever the
//! motion. Between, the elastic rate stands in the attitude as W α, which a flexure never shows.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::f64::consts::TAU;

use super::bench::AttitudeBench;
use super::path::{Axes, Path};
use super::record::{Lie, Record};
use super::samples::{Shown, SlowSample};
use super::whiten::Levels;
use crate::bench::Bench;
use crate::hypotheses;
use crate::result::PromiseEntry;
use crate::scene::Scene;
use crate::streams::{Streams, Triad};
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// One turn a second, which rate tables reach.
pub const SPIN_RAD_S: f64 = TAU;

/// 10°.
pub const OSCILLATION_RAD: f64 = 0.175;

/// Of each of the 24 moves, ramps of a second at either end included \[s\].
pub const MOVE_S: f64 = 10.0;
const RAMP_S: f64 = 1.0;

/// Rows a second: a hundred for each turn, so that the columns are flat over a row to parts in a thousand.
const RATE_HZ: f64 = 100.0;

/// The attitude is read at least ten times a turn \[s\].
const READ_EVERY_S: f64 = 0.1;

/// Errors of any gyro, free beside the two.
const PLAIN: [&str; 3] = ["gyro_bias", "gyro_scale", "installation"];

struct Move {
    axis: usize,
    across: usize,
    spin_rad_s: f64,
    phase_rad: f64,
}

fn moves() -> Vec<Move> {
    let mut moves = Vec::new();
    for axis in 0..3 {
        for across in [(axis + 1) % 3, (axis + 2) % 3] {
            for spin_rad_s in [SPIN_RAD_S, -SPIN_RAD_S] {
                for phase_rad in [0.0, TAU / 4.0] {
                    moves.push(Move {
                        axis,
                        across,
                        spin_rad_s,
                        phase_rad,
                    });
                }
            }
        }
    }
    moves
}

impl Move {
    fn rate_rad_s(&self, time_s: f64) -> Vector3<f64> {
        let x = (time_s.min(MOVE_S - time_s) / RAMP_S).clamp(0.0, 1.0);
        let taper = x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
        let omega = SPIN_RAD_S;
        let mut rate = Vector3::zeros();
        rate[self.axis] = taper * self.spin_rad_s;
        rate[self.across] =
            taper * omega * OSCILLATION_RAD * (omega * time_s + self.phase_rad).cos();
        rate
    }
}

/// Forms the promise for `truth` against `rival`, if `truth` has `values`.
pub fn promise(
    truth: (usize, &[f64]),
    rival: usize,
    levels: &Levels,
    step_s: f64,
) -> Option<PromiseEntry> {
    let moves = moves();
    let rows = (MOVE_S * RATE_HZ) as usize;
    let mut case_rad: Triad = Default::default();
    for one in &moves {
        for row in 0..rows {
            let at = |share: f64| one.rate_rad_s((row as f64 + share) / RATE_HZ);
            // Simpson's rule: (ΩT)⁴/2880 of the increment.
            let increment = (at(0.0) + at(0.5) * 4.0 + at(1.0)) / (6.0 * RATE_HZ);
            for axis in 0..3 {
                case_rad[axis].push(increment[axis]);
            }
        }
    }
    let scene = Scene::new(
        Streams::of_motion(RATE_HZ, case_rad.clone()),
        None,
        [0.0; 3],
    );
    let spacing_s = step_s.clamp(1.0 / RATE_HZ, READ_EVERY_S);
    let lie = Lie {
        delay_s: 0.0,
        turn_rad: Vector3::zeros(),
    };
    let seconds = MOVE_S * moves.len() as f64;
    // Where the attitude lies does not matter to the information, only that it is the path's own.
    let silent = Path::new(
        0.0,
        RATE_HZ,
        case_rad.clone(),
        Default::default(),
        Axes::Start,
    );
    let samples: Vec<SlowSample> = (0..=(seconds / spacing_s) as usize)
        .map(|k| k as f64 * spacing_s)
        .map(|time_s| SlowSample {
            time_s,
            shown: Shown::Attitude(silent.boundary((time_s * RATE_HZ) as usize)),
            after_gap: false,
        })
        .collect();
    let record = Record::new(
        &scene,
        case_rad,
        &Matrix3::identity(),
        &samples,
        &lie,
        levels.gyro_white_rad2,
    );
    let parameters = Parameters::of_catalogue();
    let plain = PLAIN
        .iter()
        .filter_map(|kind| hypotheses::find(kind).map(|(effect, _)| effect));
    let mut effects: Vec<usize> = plain.chain([truth.0, rival]).collect();
    effects.sort_unstable();
    let whole = std::iter::once(0..record.stamps()).collect();
    let bench = AttitudeBench::new(&scene, &record, &parameters, whole, *levels, &effects);
    let information = bench.information();
    let own: Vec<usize> = parameters.of(truth.0).collect();
    let others: Vec<usize> = parameters
        .of_all(&effects)
        .into_iter()
        .filter(|index| !own.contains(index))
        .collect();
    let value = DVector::from_column_slice(truth.1);
    let of = |a: &[usize], b: &[usize]| {
        DMatrix::from_fn(a.len(), b.len(), |k, l| information.fisher[(a[k], b[l])])
    };
    let mut nuisance = of(&others, &others);
    for (k, index) in others.iter().enumerate() {
        nuisance[(k, k)] += prior_width(&parameters, &information, *index).powi(-2);
    }
    let cross = of(&others, &own) * &value;
    let whole = value.dot(&(of(&own, &own) * &value));
    let hidden = cross.dot(&(nuisance.try_inverse()? * &cross));
    let kind = |effect: usize| hypotheses::CATALOGUE[effect].card().kind.to_string();
    Some(PromiseEntry {
        truth: kind(truth.0),
        rival: kind(rival),
        separation_sigma: (whole - hidden).max(0.0).sqrt(),
        spin_rad_s: SPIN_RAD_S,
        oscillation_rad: OSCILLATION_RAD,
        move_s: MOVE_S,
        moves: moves.len(),
        attitude_every_s: spacing_s,
    })
}

/// The promises in words.
pub fn sentence(promises: &[PromiseEntry]) -> Option<String> {
    let first = promises.first()?;
    let each: Vec<String> = promises
        .iter()
        .map(|promise| {
            format!(
                "if it is {}, by {:.0} standard deviations from {}",
                promise.truth, promise.separation_sigma, promise.rival
            )
        })
        .collect();
    Some(format!(
        "Promised: spin-synchronous oscillation, {} moves of {:.0} s (spin {:.2} rad/s about one axis in both senses, {:.3} rad at {:.2} Hz about another, phases 0 and 90°, all six pairs), with attitudes as good as here read every {:.2} s during the motion (those before and after it cannot tell), separates them {}.",
        first.moves,
        first.move_s,
        first.spin_rad_s,
        first.oscillation_rad,
        first.spin_rad_s / TAU,
        first.attitude_every_s,
        each.join("; ")
    ))
}
