//! Sections of the gyros' surroundings: `[thermal]`, `[magnetic]`, `[isolator]`.
//!
//! Each section is an [`Entry`]; its numbers must be finite and in range, and the first that is not is reported with its
//! line. SI units; x, y, z for triples.

use super::instrument::TINY;
use crate::entry::Entry;
use crate::isolator::IsolatorEntry;
use crate::surroundings::{MagneticEntry, ThermalEntry};
use rlg_recording::error::InputError;

/// Sample rate of a slow channel, which must divide the gyros' rate.
pub(super) fn slow_rate(entry: &mut Entry, rate_hz: f64) -> Result<f64, InputError> {
    let slow_hz = entry.positive("rate_hz")?;
    let rows = rate_hz / slow_hz;
    if rows >= 1.0 && (rows - rows.round()).abs() < 1e-9 * rows {
        return Ok(slow_hz);
    }
    Err(entry
        .error("rate_hz", "does not divide the sample rate")
        .value(slow_hz)
        .expected(format!("{rate_hz} Hz over a whole number")))
}

/// Reads `[thermal]`.
pub fn thermal(mut entry: Entry, rate_hz: f64) -> Result<ThermalEntry, InputError> {
    let swing = entry.has("ambient_swing_k");
    let thermal = ThermalEntry {
        // electronics operate between −73 and 127 °C
        start_k: entry.within("start_k", [200.0, 400.0], "K")?,
        self_heating_k: entry.triple_within("self_heating_k", [-100.0, 100.0], "K")?,
        time_constant_s: entry.triple_within("time_constant_s", [TINY, 1e6], "s")?,
        ambient_rate_k_s: entry.within_or("ambient_rate_k_s", [-10.0, 10.0], "K/s", 0.0)?,
        ambient_swing_k: entry.within_or("ambient_swing_k", [-100.0, 100.0], "K", 0.0)?,
        ambient_period_s: if swing {
            entry.within("ambient_period_s", [TINY, 1e6], "s")?
        } else {
            1.0
        },
        scale_error_k: entry.triple_within_or("scale_error_k", [-1e-2, 1e-2], "1/K", [0.0; 3])?,
        sensor_noise_k: entry.within("sensor_noise_k", [0.0, 10.0], "K")?,
        sensor_weight_k: entry.within("sensor_weight_k", [TINY, 10.0], "K")?,
        rate_hz: slow_rate(&mut entry, rate_hz)?,
    };
    entry.finish()?;
    Ok(thermal)
}

/// Reads `[magnetic]`.
pub fn magnetic(mut entry: Entry, rate_hz: f64) -> Result<MagneticEntry, InputError> {
    // 0.1 T is a strong magnet; the Earth has 5e-5 T
    let field = [-0.1, 0.1];
    let coil = entry.has("coil_field_t");
    let magnetic = MagneticEntry {
        navigation_field_t: entry.triple_within("navigation_field_t", field, "T")?,
        coil_field_t: entry.triple_within_or("coil_field_t", field, "T", [0.0; 3])?,
        coil_frequency_hz: if coil {
            entry.within("coil_frequency_hz", [TINY, 0.5 * rate_hz], "Hz")?
        } else {
            0.0
        },
        sensor_noise_t: entry.within("sensor_noise_t", [0.0, 1.0], "T")?,
        sensor_weight_t: entry.within("sensor_weight_t", [TINY, 1.0], "T")?,
        rate_hz: slow_rate(&mut entry, rate_hz)?,
    };
    entry.finish()?;
    Ok(magnetic)
}

/// Reads `[isolator]`: `angular_frequency_hz`, `angular_damping`, `linear_frequency_hz`, `linear_damping`, and for
/// rocking `offset_m`, `gyration_radius_m`.
pub fn isolator(mut entry: Entry) -> Result<IsolatorEntry, InputError> {
    let mut modes = |frequency: &str, damping: &str| -> Result<_, InputError> {
        if !entry.has(frequency) {
            return Ok([None; 3]);
        }
        let frequency_hz = entry.triple_within(frequency, [TINY, 1e5], "Hz")?;
        // above 10 a mount is a dashpot; an undamped mode is no mount
        let damping = entry.triple_within(damping, [TINY, 10.0], "")?;
        Ok([0, 1, 2].map(|axis| Some((frequency_hz[axis], damping[axis]))))
    };
    let angular = modes("angular_frequency_hz", "angular_damping")?;
    let linear = modes("linear_frequency_hz", "linear_damping")?;
    let offset_m = entry.triple_within_or("offset_m", [-1.0, 1.0], "m", [0.0; 3])?;
    let rocks = offset_m != [0.0; 3];
    if rocks && angular[0].is_none() {
        return Err(entry
            .error("angular_frequency_hz", "is missing")
            .expected("the modes in which an offset rocks the case"));
    }
    let isolator = IsolatorEntry {
        angular,
        linear,
        offset_m,
        gyration_radius_m: if rocks {
            entry.triple_within("gyration_radius_m", [1e-3, 10.0], "m")?
        } else {
            [1.0; 3]
        },
    };
    entry.finish()?;
    Ok(isolator)
}
