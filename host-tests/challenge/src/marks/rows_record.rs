//! Recording and model of gyros with a reference of increments.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Accelerometer, Gyro, Model, MotionSource, Reference};
use rlg_recording::{Quantity, Recording};

use super::effects::Perturbation;
use super::instruments::{
    accelerometers, channel, gyros, recording, sensed_rad, table, thermometers,
};
use super::rows::Rows;

/// White noise of the accelerometers \[m/s²/√Hz\].
const ACCELEROMETER_M_S2_SQRT_HZ: f64 = 5e-5;

/// Makes the recording and the model of gyros and their reference.
pub fn record_rows(rows: &Rows, noise_seed: u64) -> (Recording, Model) {
    let setting = &rows.setting;
    let case = rows.case();
    let (count, period_s) = (case.rows, case.period_s);
    let sensing_from_body = rows.unit.sensing_from_body();
    let mut added = Perturbation::none(count);
    for strong in &rows.effects {
        added.add(&strong.effect.perturbation(&case, &sensing_from_body));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let levels = std::array::from_fn(|axis| setting.gyro_levels(axis));
    let noise = (&levels, setting.pulse_rad);
    let sensed = sensed_rad(&case, &rows.unit, &added.gyro_rad, noise, &mut rng);
    let mut channels = gyros(sensed, None);
    let other = rows.other_case();
    let of_reference = other.as_ref().unwrap_or(&case);
    for (axis, turned_rad) in of_reference.increments_rad.iter().enumerate() {
        let mut read = setting
            .reference_levels()
            .series_rad(count, period_s, &mut rng);
        for (row, value) in read.iter_mut().enumerate() {
            *value += turned_rad[row] + added.reference_rad[axis][row];
        }
        channels.push(channel("r", axis, Quantity::ReferenceIncrement, read));
    }
    if let Some(warming) = &case.warming_k {
        channels.extend(thermometers(warming, &mut rng));
    }
    if let Some(force) = &case.force_m_s2 {
        let noise = ACCELEROMETER_M_S2_SQRT_HZ * setting.rate_hz.sqrt();
        channels.extend(accelerometers(force, noise, &mut rng));
    }
    let recording = recording(
        vec![table("samples.parquet", setting.rate_hz, channels)],
        None,
    );
    (recording, model_of(rows))
}

fn model_of(rows: &Rows) -> Model {
    let setting = &rows.setting;
    let declared = setting.declared_over_true;
    Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro {
            angle_random_walk_rad_sqrt_s: setting
                .declares_gyro_walk
                .then_some(setting.gyro_walk_rad_sqrt_s),
            ..rows.unit.gyro(setting.pulse_rad)
        },
        dither: None,
        reference: Some(Reference {
            angle_noise_rad: Some(declared * setting.reference_angle_rad),
            angle_random_walk_rad_sqrt_s: Some(declared * setting.reference_walk_rad_sqrt_s),
        }),
        accelerometer: setting.has_force.then_some(Accelerometer {
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            noise_m_s2_sqrt_hz: [ACCELEROMETER_M_S2_SQRT_HZ; 3],
        }),
        effects: Vec::new(),
    }
}
