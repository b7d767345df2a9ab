//! Faults of the unit itself: `[[fault]]` of a scenario.
//!
//! They act on the slow channels (`slow_channels`), on a block's dither (`dither`), on a counter and on a thermometer
//! (`effects::faults`). Times are those of the recording in s; a fault of a stretch acts in \[start, end).

use super::effects::faults::{Failure, FaultEntry};
use serde_json::{Map, Value, json};

const LETTERS: [&str; 3] = ["x", "y", "z"];

/// One fault.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitFault {
    /// Kind, of [`KINDS`].
    pub kind: &'static str,
    /// Axis; 0 for a fault of the whole unit.
    pub axis: usize,
    /// Begin \[s\].
    pub start_s: f64,
    /// End \[s\]; infinite for a fault that stays.
    pub end_s: f64,
    /// Number of the kind, in its unit; 0 for a kind without one.
    pub size: f64,
}

/// Keys of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Name.
    pub name: &'static str,
    /// True if it is of one axis.
    pub has_axis: bool,
    /// True if it has an end; else it begins at `time_s` and stays.
    pub has_end: bool,
    /// Number with its range and unit.
    pub size: Option<(&'static str, [f64; 2], &'static str)>,
    /// Section that it needs.
    pub needs: &'static str,
}

const fn kind(
    name: &'static str,
    has_end: bool,
    size: Option<(&'static str, [f64; 2], &'static str)>,
    needs: &'static str,
) -> Kind {
    Kind {
        name,
        has_axis: true,
        has_end,
        size,
        needs,
    }
}

/// Laser that goes out with a time constant.
pub const DYING_LASER: &str = "dying_laser";
/// Path-length control that jumps to another mode without a reset.
pub const MODE_HOP: &str = "mode_hop";
/// Reset of a path-length control.
pub const PATH_LENGTH_RESET: &str = "path_length_reset";
/// Dither drive at another level.
pub const DITHER_DRIVE: &str = "dither_drive";
/// Dither of another amplitude.
pub const DITHER_AMPLITUDE: &str = "dither_amplitude";
/// Thermometer without readings.
pub const SILENT_THERMOMETER: &str = "silent_thermometer";
/// Counter that stands still.
pub const STUCK_COUNTER: &str = "stuck_counter";
/// No pulse per second.
pub const PULSE_LOST: &str = "pulse_lost";

/// All kinds.
pub const KINDS: [Kind; 8] = [
    kind(
        DYING_LASER,
        false,
        Some(("time_constant_s", [1e-6, 1e6], "s")),
        "slow_channels",
    ),
    // A whole range of the control is the largest step of a drive that stays within it.
    kind(
        MODE_HOP,
        false,
        Some(("size", [-2.0, 2.0], "")),
        "slow_channels",
    ),
    kind(PATH_LENGTH_RESET, false, None, "slow_channels"),
    kind(
        DITHER_DRIVE,
        true,
        Some(("level", [0.0, 2.0], "")),
        "slow_channels",
    ),
    kind(
        DITHER_AMPLITUDE,
        true,
        Some(("factor", [0.0, 2.0], "")),
        "dither",
    ),
    kind(SILENT_THERMOMETER, true, None, "thermal"),
    kind(STUCK_COUNTER, true, None, "gyro"),
    Kind {
        has_axis: false,
        ..kind(PULSE_LOST, true, None, "slow_channels")
    },
];

/// Faults of a scenario.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UnitFaults(pub Vec<UnitFault>);

impl UnitFaults {
    /// Serialises to JSON, each fault with the keys of its entry.
    pub fn to_json(&self) -> Value {
        let keys = |fault: &UnitFault| {
            let kind = KINDS.iter().find(|kind| kind.name == fault.kind);
            let mut keys = Map::from_iter([("kind".to_owned(), json!(fault.kind))]);
            if kind.is_some_and(|kind| kind.has_axis) {
                keys.insert("axis".to_owned(), json!(LETTERS[fault.axis]));
            }
            if fault.end_s.is_finite() {
                keys.insert("start_s".to_owned(), json!(fault.start_s));
                keys.insert("end_s".to_owned(), json!(fault.end_s));
            } else {
                keys.insert("time_s".to_owned(), json!(fault.start_s));
            }
            if let Some((name, ..)) = kind.and_then(|kind| kind.size) {
                keys.insert(name.to_owned(), json!(fault.size));
            }
            Value::Object(keys)
        };
        self.0.iter().map(keys).collect()
    }

    fn begun(
        &self,
        kind: &'static str,
        axis: usize,
        time_s: f64,
    ) -> impl Iterator<Item = &UnitFault> {
        self.0.iter().filter(move |fault| {
            fault.kind == kind
                && fault.axis == axis
                && (fault.start_s..fault.end_s).contains(&time_s)
        })
    }

    /// Share of a laser's intensity that is left.
    pub fn intensity_left(&self, axis: usize, time_s: f64) -> f64 {
        self.begun(DYING_LASER, axis, time_s)
            .map(|fault| (-(time_s - fault.start_s) / fault.size).exp())
            .product()
    }

    /// Sum of the steps of a path-length control's drive.
    pub fn hopped(&self, axis: usize, time_s: f64) -> f64 {
        self.begun(MODE_HOP, axis, time_s)
            .map(|fault| fault.size)
            .sum()
    }

    /// Resets of a path-length control.
    pub fn resets(&self, axis: usize, time_s: f64) -> usize {
        self.begun(PATH_LENGTH_RESET, axis, time_s).count()
    }

    /// Level of a dither drive, if a fault holds it.
    pub fn dither_drive(&self, axis: usize, time_s: f64) -> Option<f64> {
        self.begun(DITHER_DRIVE, axis, time_s)
            .next()
            .map(|fault| fault.size)
    }

    /// True if the pulse that is due at this time does not come.
    pub fn is_pulse_lost(&self, time_s: f64) -> bool {
        self.begun(PULSE_LOST, 0, time_s).next().is_some()
    }

    /// Stretches with another amplitude of a block's dither: begin, end \[s\], factor.
    pub fn dither_factors(&self, axis: usize) -> Vec<[f64; 3]> {
        self.0
            .iter()
            .filter(|fault| fault.kind == DITHER_AMPLITUDE && fault.axis == axis)
            .map(|fault| [fault.start_s, fault.end_s, fault.size])
            .collect()
    }

    /// Largest factor of a block's dither.
    pub fn largest_dither_factor(&self, axis: usize) -> f64 {
        let factors = self.dither_factors(axis).into_iter();
        factors.fold(1.0, |largest, [.., factor]| largest.max(factor))
    }

    /// Faults of single channels: counters that stand still, thermometers that are silent.
    pub fn of_channels(&self) -> Vec<FaultEntry> {
        let channel = |fault: &UnitFault| {
            let (stem, failure) = match fault.kind {
                STUCK_COUNTER => ("gyro", Failure::Still),
                SILENT_THERMOMETER => ("temperature", Failure::Lost),
                _ => return None,
            };
            Some(FaultEntry {
                channel: format!("{stem}_{}", LETTERS[fault.axis]),
                start_s: fault.start_s,
                end_s: fault.end_s,
                failure,
            })
        };
        self.0.iter().filter_map(channel).collect()
    }
}
