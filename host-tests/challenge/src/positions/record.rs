//! Recording of accelerometers in positions, and its model.

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Accelerometer, Gyro, Model, MotionSource};
use rlg_recording::{Quantity, Recording, Site};
use rlg_simulator::instrument::normal;

use super::trial::{Disturbed, Position, Stood, added_m_s2};
use crate::marks::instruments::{channel, recording, table};

/// Acceleration of a hand's tremor \[m/s²\].
const HAND_M_S2: f64 = 0.8;

/// Knock \[m/s²\], and its decay time \[s\].
const KNOCK: (f64, f64) = (3.0, 0.1);

/// Frequency of a bench motor \[Hz\].
const MOTOR_HZ: f64 = 7.3;

/// Attitude and disturbance of one row.
struct Row {
    body_from_level: UnitQuaternion<f64>,
    /// Specific force in addition to gravity \[m/s²\].
    more_m_s2: Vector3<f64>,
}

/// Makes the recording of a trial and its model.
pub fn record(drawn: &Stood, noise_seed: u64) -> (Recording, Model) {
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let rows = rows(drawn, &mut rng);
    let gravity = drawn.gravity_m_s2 * Vector3::z();
    let white_m_s2 = drawn.density_m_s2_sqrt_hz * (0.5 * drawn.rate_hz).sqrt();
    let step_m_s2 = drawn.walk_m_s2_sqrt_s / drawn.rate_hz.sqrt();
    let mut walked = Vector3::<f64>::zeros();
    let mut read: [Vec<f64>; 3] = Default::default();
    for row in &rows {
        let force = row.body_from_level * gravity + row.more_m_s2;
        let effects = drawn.effects.iter();
        let added: Vector3<f64> = effects.map(|one| added_m_s2(&one.effect, &force)).sum();
        for (axis, read) in read.iter_mut().enumerate() {
            walked[axis] += step_m_s2 * normal(&mut rng);
            let sensed = force[axis] + added[axis] + walked[axis] + drawn.bias_m_s2[axis];
            read.push(sensed / (1.0 - drawn.scale_error[axis]) + white_m_s2 * normal(&mut rng));
        }
    }
    let mut channels: Vec<_> = read
        .into_iter()
        .enumerate()
        .map(|(axis, values)| channel("a", axis, Quantity::SpecificForce, values))
        .collect();
    if drawn.has_gyros {
        let turned: Vec<Vector3<f64>> = rows
            .windows(2)
            .map(|pair| (pair[1].body_from_level * pair[0].body_from_level.inverse()).inverse())
            .map(|turn| turn.scaled_axis() * drawn.rate_hz)
            .chain([Vector3::zeros()])
            .collect();
        for axis in 0..3 {
            let rates = turned
                .iter()
                .map(|rate| rate[axis] + 1e-3 * normal(&mut rng));
            channels.push(channel("g", axis, Quantity::GyroRate, rates.collect()));
        }
    }
    let tables = vec![table("samples.parquet", drawn.rate_hz, channels)];
    let site = drawn.has_site.then_some(Site {
        latitude_rad: 0.8,
        gravity_m_s2: drawn.gravity_m_s2,
    });
    let is_known = drawn.scale_error != [0.0; 3];
    let model = Model {
        motion: MotionSource::Static,
        earth_rate_in_reference: false,
        gyro: Gyro::default(),
        dither: None,
        reference: None,
        accelerometer: is_known.then_some(Accelerometer {
            bias_m_s2: drawn.bias_m_s2,
            scale_error: drawn.scale_error,
            noise_m_s2_sqrt_hz: [0.0; 3],
        }),
        effects: Vec::new(),
    };
    (recording(tables, site), model)
}

/// Attitude and disturbance of the unit by row: alternating moves by hand and positions.
fn rows(drawn: &Stood, rng: &mut ChaCha8Rng) -> Vec<Row> {
    let count = drawn.rows();
    let mut all = Vec::with_capacity(count);
    let (mut begin_s, mut before) = (0.0, drawn.positions[0].body_from_level);
    for one in &drawn.positions {
        let held_s = begin_s + one.way_s;
        let end_s = held_s + one.dwell_s;
        while all.len() < count && (all.len() as f64 + 0.5) / drawn.rate_hz < end_s {
            let time_s = (all.len() as f64 + 0.5) / drawn.rate_hz;
            all.push(match time_s < held_s {
                true => on_the_way((&before, one), (time_s - begin_s) / one.way_s, rng),
                false => held(one, time_s - held_s),
            });
        }
        begin_s = end_s;
        before = one.body_from_level;
    }
    all
}

fn on_the_way(
    (from, to): (&UnitQuaternion<f64>, &Position),
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Row {
    let smooth = share * share * (3.0 - 2.0 * share);
    let turn = (to.body_from_level * from.inverse()).scaled_axis();
    Row {
        body_from_level: UnitQuaternion::from_scaled_axis(turn * smooth) * from,
        more_m_s2: Vector3::from_fn(|_, _| HAND_M_S2 * normal(rng)),
    }
}

fn held(one: &Position, since_s: f64) -> Row {
    let mut row = Row {
        body_from_level: one.body_from_level,
        more_m_s2: one.scatter_m_s2,
    };
    match one.disturbed {
        Some(Disturbed::Shaken(size)) => {
            row.more_m_s2 += size * (TAU * MOTOR_HZ * since_s).sin() * Vector3::new(1.0, 0.6, -0.8);
        }
        Some(Disturbed::Turning(rate_rad_s)) => {
            let about_level = UnitQuaternion::from_scaled_axis(rate_rad_s * since_s * Vector3::x());
            row.body_from_level = one.body_from_level * about_level;
        }
        Some(Disturbed::Knocked(at_s)) if (0.0..KNOCK.1).contains(&(since_s - at_s)) => {
            row.more_m_s2 += Vector3::repeat(KNOCK.0);
        }
        Some(Disturbed::LeanedOn(size)) => {
            let up = one.body_from_level * Vector3::z();
            row.more_m_s2 += size * up;
        }
        _ => {}
    }
    row
}
