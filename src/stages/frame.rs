//! Rotation of the output period → output frame.
//!
//! Enters: θ and β \[rad\], body frame; the period's status. Leaves: [`OutputFrame`], θ + β in codes of
//! [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE).
//!
//! The part of a code that a frame cannot show is carried into the next one, so the sum of all frames is
//! never more than one code from the sum of all rotations. Beyond ±(2³¹ − 1) codes it is held, flagged, and
//! the excess is lost.

use crate::faults::Status;
use crate::numbers::NumberSystem;
use crate::sample::OutputFrame;
use crate::stages::coning::Rotation;
use crate::triad::Triad;

/// Number of the next frame, and what the last one could not show.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameState<N: NumberSystem> {
    sequence: u32,
    carry: Triad<N::OutputCarry>,
}

/// Makes one frame.
#[inline(always)]
pub fn process<N: NumberSystem>(
    state: &mut FrameState<N>,
    rotation: Rotation<N>,
    status: Status,
) -> OutputFrame {
    let Rotation { angle, coning } = rotation;
    let (x, x_held) = N::output_code(angle.x, coning.x, &mut state.carry.x);
    let (y, y_held) = N::output_code(angle.y, coning.y, &mut state.carry.y);
    let (z, z_held) = N::output_code(angle.z, coning.z, &mut state.carry.z);
    let held = x_held | y_held | z_held;
    let sequence = state.sequence;
    state.sequence = sequence.wrapping_add(1);
    OutputFrame {
        sequence,
        dtheta_codes: [x, y, z],
        dvel_codes: [0; 3],
        status: status.and(Status::OUTPUT_SATURATED.when(held)),
    }
}

/// Passes over the numbers of output periods that have no frame of their own.
pub fn skip<N: NumberSystem>(state: &mut FrameState<N>, frames: u32) {
    state.sequence = state.sequence.wrapping_add(frames);
}
