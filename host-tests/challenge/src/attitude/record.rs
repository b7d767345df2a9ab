//! Recording of a trial with an attitude reference, and its model, which declares no noise.

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Model, MotionSource};
use rlg_recording::{Recording, Table};

use super::faults::Wrong;
use super::path::Path;
use super::trial::Attitudes;
use crate::marks::effects::Effect;
use crate::marks::instruments::{self, graded, recording, sensed_rad, table};
use crate::marks::noise::Levels;

/// Makes the recording of a trial and its model.
pub fn record(drawn: &Attitudes, noise_seed: u64) -> (Recording, Model) {
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let path = drawn.path();
    let case = drawn.case(&path);
    let added_rad = match &drawn.effect {
        Some(strong) => drawn.added_rad(&strong.effect, &case),
        None => std::array::from_fn(|_| vec![0.0; case.rows]),
    };
    let levels = drawn.walk_rad_sqrt_s.map(|walk| Levels::white(walk, 0.0));
    let noise = (&levels, drawn.pulse_rad);
    let sensed = sensed_rad(&case, &drawn.unit, &added_rad, noise, &mut rng);
    let read = (sensed, case.force_m_s2.as_ref());
    let channels = graded(drawn.grade, drawn.rate_hz, read, &mut rng);
    let other = drawn.other_path();
    let tables = vec![
        table("samples.parquet", drawn.rate_hz, channels),
        attitudes(drawn, other.as_ref().unwrap_or(&path), &mut rng),
    ];
    let model = Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: drawn.unit.gyro(drawn.pulse_rad),
        dither: None,
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    };
    (recording(tables, None), model)
}

/// Table of the reference.
fn attitudes(drawn: &Attitudes, path: &Path, rng: &mut ChaCha8Rng) -> Table {
    let of_kind = |kind: &str| {
        let effect = drawn.effect.as_ref().map(|strong| &strong.effect);
        effect.filter(|effect| effect.kind == kind)
    };
    let delay_s = of_kind("reference_delay").map_or(0.0, |effect| effect.value("all"));
    let turned_rad = of_kind("reference_misalignment").map_or(Vector3::zeros(), Effect::by_axis);
    let turned = UnitQuaternion::from_scaled_axis(turned_rad);
    let stamps_s = &drawn.stamps_s;
    let mut errors = drawn.reference.errors_rad(stamps_s, rng);
    let mut jumped = UnitQuaternion::identity();
    let mut shown = Vec::with_capacity(stamps_s.len());
    for (stamp, time_s) in stamps_s.iter().enumerate() {
        let attitude = path.at(time_s - delay_s);
        for fault in &drawn.faults {
            match &fault.wrong {
                Wrong::Off(wrong) if (fault.first..=fault.last).contains(&stamp) => {
                    errors[stamp] += wrong[stamp - fault.first];
                }
                Wrong::Jumped(axis, size_rad) if stamp == fault.first => {
                    let about = attitude * Vector3::ith(*axis, *size_rad);
                    jumped = UnitQuaternion::from_scaled_axis(about);
                }
                _ => {}
            }
        }
        let wrong = jumped * UnitQuaternion::from_scaled_axis(errors[stamp]);
        shown.push(drawn.frame * wrong * attitude * turned);
    }
    let mut is_missing = vec![false; shown.len()];
    for fault in &drawn.faults {
        match fault.wrong {
            Wrong::Missing => is_missing[fault.first..=fault.last].fill(true),
            Wrong::Held => {
                let held = shown[fault.first];
                shown[fault.first..=fault.last].fill(held);
            }
            _ => {}
        }
    }
    let pairs = stamps_s.iter().copied().zip(shown).zip(is_missing);
    let kept: Vec<(f64, UnitQuaternion<f64>)> = pairs
        .filter(|(_, is_missing)| !is_missing)
        .map(|(stamp, _)| stamp)
        .collect();
    instruments::attitudes(&kept)
}
