//! Axes, signs and unit of the gyros against the reference, and of the gyros against their pickoffs.
//!
//! Enters: the aligned channels. Leaves: errors beyond ordinary ones, as [`Crossing`]s. The usable rows are selected here;
//! the measurement and the test are in [`super::coherent_map`] and [`super::channel_check`].

use rlg_model::Model;
use rlg_plan::{ChannelPlan, FaultPlan, MapPlan, PartitionPlan, SignalPlan};

use super::axes::{AXES, Triad, add};
use super::channel_check::{Crossing, check};
use super::partition::{Partition, Use};
use super::qualify;
use super::same_motion::{Apart, Clocks, apart};
use super::streams::Streams;

/// Signal followed by the gyros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lead {
    /// The reference.
    Reference,
    /// The pickoffs of the dither.
    Pickoff,
}

/// Finds relations of the gyros to the reference, and to their pickoffs, beyond ordinary errors; none without a reference on
/// their rows.
///
/// # Inputs
/// `anyway`: skips the test for a common motion. The partition's test rows enter that test only.
///
/// # Errors
/// Gyros and reference do not show the same motion.
pub fn crossings(
    streams: &mut Streams,
    model: &Model,
    plan: &SignalPlan,
    anyway: bool,
) -> Result<Vec<(Lead, Crossing)>, Apart> {
    let has_reference = !streams.own_motion && streams.at_rest.is_none() && !streams.piece.held_out;
    if !has_reference {
        return Ok(Vec::new());
    }
    let sound = sound(streams, &plan.faults);
    if !anyway {
        let gyros = without_dither(streams, model);
        let clocks = Clocks {
            rate_hz: streams.rate_hz,
            reference_hz: streams.reference_hz.unwrap_or(streams.rate_hz),
        };
        let sides = (&gyros, &streams.case_rad);
        if let Some(apart) = apart(sides, &sound, clocks, &plan.same_motion) {
            return Err(apart);
        }
    }
    let seen = seen(streams, &plan.partition, &sound);
    Ok(of_rows(streams, model, &seen, &plan.channels))
}

/// Rows without a fault.
fn sound(streams: &mut Streams, plan: &FaultPlan) -> Vec<bool> {
    let usable = streams.usable.clone();
    qualify::qualify(streams, plan);
    std::mem::replace(&mut streams.usable, usable)
}

/// Rows without a fault, test rows of the partition excluded.
fn seen(streams: &Streams, partition: &PartitionPlan, sound: &[bool]) -> Vec<bool> {
    let segments: Vec<_> = streams
        .piece
        .segments
        .iter()
        .map(|segment| streams.row_at(segment.start_s)..streams.row_at(segment.end_s))
        .collect();
    Partition::new(streams.rows, streams.rate_hz, &segments, partition).rows_of(&[Use::Fit], sound)
}

/// Gyro increments less the dither from the pickoffs times the pickoff gain \[rad\].
pub fn without_dither(streams: &Streams, model: &Model) -> Triad {
    let mut gyros = streams.sensed_rad.clone();
    for (axis, dither) in streams.dither_rad().iter().flatten().enumerate() {
        add(&mut gyros[axis], dither, -model.pickoff_gain(axis));
    }
    gyros
}

/// Finds relations of the gyros to the reference, and to their pickoffs, beyond ordinary errors.
fn of_rows(
    streams: &Streams,
    model: &Model,
    seen: &[bool],
    plan: &ChannelPlan,
) -> Vec<(Lead, Crossing)> {
    let mut found = Vec::new();
    let rows = (seen, streams.rate_hz);
    if let Some(dither_rad) = streams.dither_rad() {
        let gains = [0, 1, 2].map(|axis| model.pickoff_gain(axis));
        let crossing = check(
            each(&streams.sensed_rad),
            each(&dither_rad),
            gains,
            rows,
            &of_pickoffs(plan),
        );
        found.extend(crossing.map(|crossing| (Lead::Pickoff, crossing)));
    }
    let gyros = without_dither(streams, model);
    let known = |axis: usize| {
        let scales = model.effects.iter().filter(|one| one.kind == "gyro_scale");
        let sum: f64 = scales.map(|one| one.number(AXES[axis])).sum();
        1.0 + sum
    };
    let expected = [0, 1, 2].map(known);
    let crossing = check(each(&gyros), each(&streams.case_rad), expected, rows, plan);
    found.extend(crossing.map(|crossing| (Lead::Reference, crossing)));
    found
}

fn each(channels: &Triad) -> [&[f64]; 3] {
    [0, 1, 2].map(|axis| &channels[axis][..])
}

/// Settings for pickoffs.
fn of_pickoffs(plan: &ChannelPlan) -> ChannelPlan {
    ChannelPlan {
        map: MapPlan {
            most_delay_s: plan.pickoff_delay_s,
            likely_delay_s: plan.pickoff_delay_s,
            ..plan.map
        },
        ..*plan
    }
}
