//! Sections of the unit's health: `[slow_channels]`, and its faults, `[[fault]]`.
//!
//! Each is an [`Entry`]; its numbers must be finite and in range, and the first that is not is reported with its line.

use super::environment::slow_rate;
use super::instrument::TINY;
use crate::entry::Entry;
use crate::slow_channels::{PulseEntry, SlowChannelsEntry};
use crate::unit_faults::{KINDS, UnitFault};
use rlg_recording::error::InputError;
use rlg_recording::nearest;

/// Shares of nominal that the bank's codes hold.
const OF_NOMINAL: [f64; 2] = [0.0, 1.9999];

/// Shares of a control's range.
const OF_RANGE: [f64; 2] = [-1.0, 1.0];

/// Reads `[slow_channels]`.
pub fn slow_channels(mut entry: Entry, rate_hz: f64) -> Result<SlowChannelsEntry, InputError> {
    let pulse = entry.flag("pulse_per_second", false)?;
    let channels = SlowChannelsEntry {
        rate_hz: slow_rate(&mut entry, rate_hz)?,
        intensity: entry.triple_within_or("intensity", OF_NOMINAL, "of nominal", [1.0; 3])?,
        intensity_noise: entry.within_or("intensity_noise", [0.0, 1.0], "of nominal", 0.0)?,
        path_length_drive: entry.triple_within_or(
            "path_length_drive",
            OF_RANGE,
            "of the range",
            [0.0; 3],
        )?,
        path_length_drive_k: entry.triple_within_or(
            "path_length_drive_k",
            OF_RANGE,
            "1/K",
            [0.0; 3],
        )?,
        path_length_noise: entry.within_or("path_length_noise", [0.0, 0.1], "of the range", 0.0)?,
        path_length_mode: entry.within_or("path_length_mode", [0.01, 1.0], "of the range", 0.3)?,
        path_length_end: entry.within_or("path_length_end", [0.1, 0.999], "of the range", 0.9)?,
        dither_drive: entry.triple_within_or("dither_drive", OF_NOMINAL, "of nominal", [1.0; 3])?,
        dither_drive_noise: entry.within_or("dither_drive_noise", [0.0, 1.0], "of nominal", 0.0)?,
        pulse: if pulse {
            Some(PulseEntry {
                first_s: entry.within_or("first_pulse_s", [0.0, 1.0], "s", 0.0)?,
                // ten times the worst crystal
                clock_error: entry.within_or("clock_error", [-5e-4, 5e-4], "", 0.0)?,
            })
        } else {
            None
        },
    };
    // half the span between the ends, so that a move by a mode from beyond one end stays within the other
    if channels.path_length_mode > channels.path_length_end {
        return Err(entry
            .error(
                "path_length_mode",
                "does not fit between the control's ends",
            )
            .value(channels.path_length_mode)
            .expected(format!(
                "at most path_length_end = {}",
                channels.path_length_end
            )));
    }
    entry.finish()?;
    Ok(channels)
}

/// Facts of the scenario that a fault depends on.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// Begin and end of the recording \[s\].
    pub span_s: [f64; 2],
    /// Names of the sections that the scenario has.
    pub sections: &'a [&'static str],
    /// A pulse per second is connected.
    pub has_pulse: bool,
}

/// Reads one `[[fault]]`.
pub fn fault(mut entry: Entry, setting: &Setting) -> Result<UnitFault, InputError> {
    let name = entry.text("kind")?;
    let Some(kind) = KINDS.iter().find(|kind| kind.name == name) else {
        let names = KINDS.map(|kind| kind.name);
        let refused = entry.error("kind", "is no fault of a unit").value(&name);
        return Err(refused.expected(match nearest(&name, names) {
            Some(near) => format!("{near:?}"),
            None => names.join(", "),
        }));
    };
    if !setting.sections.contains(&kind.needs) {
        return Err(entry
            .error("kind", "has nothing to act on")
            .value(&name)
            .expected(format!("a section [{}]", kind.needs)));
    }
    if !kind.has_axis && !setting.has_pulse {
        return Err(entry
            .error("kind", "has nothing to act on")
            .value(&name)
            .expected("pulse_per_second = true in [slow_channels]"));
    }
    let axis = match kind.has_axis {
        true => entry.axis("axis")?.0,
        false => 0,
    };
    let begin = if kind.has_end { "start_s" } else { "time_s" };
    let start_s = entry.within(begin, setting.span_s, "s, within the recording")?;
    let end_s = match kind.has_end {
        true => entry.number("end_s")?,
        false => f64::INFINITY,
    };
    if end_s <= start_s {
        return Err(entry
            .error("end_s", "is not after start_s")
            .value(end_s)
            .expected(format!("more than {start_s} s")));
    }
    let size = match kind.size {
        Some((key, range, unit)) => entry.within(key, range, unit)?,
        None => 0.0,
    };
    if kind.name == crate::unit_faults::MODE_HOP && size.abs() < TINY {
        return Err(entry
            .error("size", "is no step")
            .value(size)
            .expected("another number than 0"));
    }
    entry.finish()?;
    Ok(UnitFault {
        kind: kind.name,
        axis,
        start_s,
        end_s,
        size,
    })
}
