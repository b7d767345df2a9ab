//! Recording of a trial at rest, and its model.

use std::f64::consts::PI;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Gyro, Model, MotionSource};
use rlg_recording::Recording;

use super::trial::Still;
use crate::marks::effects::Perturbation;
use crate::marks::instruments::{graded, recording, sensed_rad, table, thermometers};

/// Makes the recording of a trial and its model.
pub fn record(drawn: &Still, noise_seed: u64) -> (Recording, Model) {
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let case = drawn.case();
    let sensing_from_body = drawn.unit.sensing_from_body();
    let mut added = Perturbation::none(case.rows);
    for strong in &drawn.effects {
        added.add(&strong.effect.perturbation(&case, &sensing_from_body));
    }
    for line in &drawn.lines {
        let turn_rad_s = 2.0 * PI * line.frequency_hz;
        for (axis, values) in added.gyro_rad.iter_mut().enumerate() {
            let amplitude_rad = line.amplitude_rad_s[axis] * case.period_s;
            for (row, value) in values.iter_mut().enumerate() {
                let middle_s = (row as f64 + 0.5) * case.period_s;
                *value += amplitude_rad * (turn_rad_s * middle_s + line.phase_rad[axis]).sin();
            }
        }
    }
    let noise = (&drawn.levels, drawn.pulse_rad);
    let sensed = sensed_rad(&case, &drawn.unit, &added.gyro_rad, noise, &mut rng);
    let read = (sensed, case.force_m_s2.as_ref());
    let mut channels = graded(drawn.grade, drawn.rate_hz, read, &mut rng);
    if let Some(warming) = &case.warming_k {
        channels.extend(thermometers(warming, &mut rng));
    }
    let tables = vec![table("samples.parquet", drawn.rate_hz, channels)];
    let model = Model {
        motion: MotionSource::Static,
        earth_rate_in_reference: false,
        gyro: Gyro {
            angle_random_walk_rad_sqrt_s: drawn.declared_walk_rad_sqrt_s,
            ..drawn.unit.gyro(drawn.declared_pulse_rad)
        },
        dither: None,
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    };
    (recording(tables, Some(drawn.site)), model)
}
