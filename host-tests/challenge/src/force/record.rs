//! Recording of a rotated unit with accelerometers, and its model.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Accelerometer, Model};
use rlg_recording::{Quantity, Recording, Site};

use super::effects::added_m_s;
use super::trial::Turned;
use crate::marks::instruments::{channel, table};
use crate::marks::noise::quantised_rad;
use crate::marks::rows_record::record_rows;

/// Stream of the accelerometers' noise, separate from that of gyros and reference.
const STREAM: u64 = 1;

/// Makes the recording of a trial and its model.
pub fn record(drawn: &Turned, noise_seed: u64) -> (Recording, Model) {
    let (mut recording, mut model) = record_rows(&drawn.rows, noise_seed);
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    rng.set_stream(STREAM);
    let (count, period_s) = drawn.span();
    let felt = drawn.felt();
    let added = drawn
        .effect
        .as_ref()
        .map(|strong| added_m_s(&strong.effect, (&drawn.rows.motion, &felt), drawn.span()));
    let channels = [0, 1, 2].map(|axis| {
        let keeps = 1.0 - drawn.scale_error[axis];
        let mut read = drawn.noise.series_rad(count, period_s, &mut rng);
        let force = felt.increments_m_s(axis, 0.0, drawn.span());
        for (row, value) in read.iter_mut().enumerate() {
            let more = added.as_ref().map_or(0.0, |added| added[axis][row]);
            *value += (force[row] + drawn.bias_m_s2[axis] * period_s + more) / keeps;
        }
        match drawn.pulse_m_s {
            Some(pulse_m_s) => {
                let counted = quantised_rad(&read, pulse_m_s, &mut rng);
                channel("v", axis, Quantity::VelocityIncrement, counted)
            }
            None => {
                read.iter_mut().for_each(|value| *value /= period_s);
                channel("a", axis, Quantity::SpecificForce, read)
            }
        }
    });
    match drawn.together {
        1 => recording.tables[0].channels.extend(channels),
        _ => recording
            .tables
            .push(table("force.parquet", 1.0 / period_s, channels.to_vec())),
    }
    recording.site = Some(Site {
        latitude_rad: drawn.level.latitude_rad,
        gravity_m_s2: drawn.level.gravity_m_s2,
    });
    let density = drawn.noise.walk_rad_sqrt_s * 2_f64.sqrt();
    let is_known = drawn.scale_error != [0.0; 3];
    model.accelerometer = is_known.then_some(Accelerometer {
        bias_m_s2: drawn.bias_m_s2,
        scale_error: drawn.scale_error,
        noise_m_s2_sqrt_hz: [if drawn.declares_noise { density } else { 0.0 }; 3],
    });
    (recording, model)
}
