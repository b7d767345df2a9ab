//! Recording of a trial: others' recording with its reference's errors permuted, or with an additional effect.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::Model;
use rlg_recording::{Channel, Quantity, Recording, Table};

use super::base::{Base, Stamp};
use super::inject::{added_rad, shuffled};
use super::planted::Planted;
use crate::marks::effects::{AXES, Effect};
use crate::marks::instruments::attitudes;

/// Drawn trial of others' recording.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Base recording.
    pub base: Arc<Base>,
    /// Injected kind.
    pub planted: Planted,
    /// Injected effect.
    pub effect: Option<Effect>,
}

impl Recorded {
    /// Draws the recording of a trial's number.
    pub fn draw(number: u64, base: &Arc<Base>, rng: &mut ChaCha8Rng) -> Self {
        let planted = Planted::of(number);
        Self {
            base: Arc::clone(base),
            planted,
            effect: planted.effect(rng),
        }
    }

    /// Returns name and length of the recording in words.
    pub fn conditions(&self) -> Vec<String> {
        let base = &self.base;
        let length_s = base.sensed_rad.len() as f64 * base.period_s;
        vec![
            format!("recording {}", base.recording.name),
            format!("length {length_s:.0} s"),
        ]
    }
}

/// Makes the recording of a trial and its model.
pub fn record(drawn: &Recorded, noise_seed: u64) -> (Recording, Model) {
    let base = &*drawn.base;
    let mut recording = base.recording.clone();
    let stamps: Vec<Stamp> = match &drawn.effect {
        Some(effect) => {
            let pairs = base.sensed_rad.iter().zip(added_rad(effect, base));
            let sensed_rad: Vec<Vector3<f64>> =
                pairs.map(|(sensed, added)| sensed + added).collect();
            read(
                &mut recording.tables[base.gyro_table],
                &sensed_rad,
                base.period_s,
            );
            // A reference delay shifts the stamps.
            let late_s = match effect.kind {
                "reference_delay" => effect.value("all"),
                _ => 0.0,
            };
            let late = |(time_s, attitude): &Stamp| (time_s + late_s, *attitude);
            base.stamps.iter().map(late).collect()
        }
        // Motion of the gyros, with the reference's own errors decorrelated from it.
        None => {
            let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
            let errors_rad = shuffled(&base.errors_rad, base.stamp_s(), &mut rng);
            let pairs = base.by_gyros.iter().zip(errors_rad);
            pairs
                .map(|((time_s, attitude), error)| {
                    (*time_s, UnitQuaternion::from_scaled_axis(error) * attitude)
                })
                .collect()
        }
    };
    for table in &mut recording.tables {
        let is_other = |channel: &Channel| channel.quantity != Quantity::ReferenceAttitude;
        table.channels.retain(is_other);
    }
    recording.tables.retain(|table| !table.channels.is_empty());
    recording.tables.push(attitudes(&stamps));
    (recording, base.model.clone())
}

/// Writes gyro increments into their channels; missing values stay missing.
fn read(table: &mut Table, sensed_rad: &[Vector3<f64>], period_s: f64) {
    for channel in &mut table.channels {
        let unit = match channel.quantity {
            Quantity::GyroRate => 1.0 / period_s,
            Quantity::GyroIncrement => 1.0,
            _ => continue,
        };
        let name = channel.axis.as_deref();
        let Some(axis) = AXES.iter().position(|axis| Some(*axis) == name) else {
            continue;
        };
        for (value, sensed) in channel.values.iter_mut().zip(sensed_rad) {
            if value.is_finite() {
                *value = sensed[axis] * unit;
            }
        }
    }
}
