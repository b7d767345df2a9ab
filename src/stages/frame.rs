//! Rotation and velocity increment of the output period → output frame.
//!
//! Enters: the rotation vector and, with accelerometers, the velocity increment \[fine units\], body frame at
//! the period's start; the period's status. Leaves: [`OutputFrame`], in codes of
//! [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE) and
//! [`OUTPUT_M_S_PER_CODE`](crate::OUTPUT_M_S_PER_CODE).
//!
//! What a frame cannot show is carried into the next one: the part of a code, so that the sum of all frames
//! is never more than half a code from the sum of all increments; and beyond an `i32` of codes, flagged, up to
//! as much again ([`LARGEST_CARRY_CODES`]). More than that is lost.

use crate::design_parameters::{FINE_PER_CODE_LOG2, LARGEST_CARRY_CODES};
use crate::faults::Status;
use crate::sample::OutputFrame;

/// Upper words of fine units whose codes fit an `i32`: −`FITS` to `FITS` − 1.
const FITS: i32 = 1 << (FINE_PER_CODE_LOG2 - 1);

/// Number of the next frame, and what the last one could not show \[fine units\].
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameState {
    sequence: u32,
    rotation_carry: [i64; 3],
    velocity_carry: [i64; 3],
}

/// Adds to the rotation that the next frame shows \[fine units\].
pub fn carry(state: &mut FrameState, rotation: [i64; 3]) {
    for (carry, rotation) in state.rotation_carry.iter_mut().zip(rotation) {
        *carry = carry.wrapping_add(rotation);
    }
}

/// Makes the frame of the last of `periods` output periods.
#[inline(always)]
pub fn process(
    state: &mut FrameState,
    rotation: [i64; 3],
    velocity: Option<[i64; 3]>,
    status: Status,
    periods: u32,
) -> OutputFrame {
    let sequence = state.sequence.wrapping_add(periods.wrapping_sub(1));
    state.sequence = sequence.wrapping_add(1);
    let (dtheta_codes, rotation_held) = codes(&mut state.rotation_carry, rotation);
    let (dvel_codes, velocity_held) = match velocity {
        Some(velocity) => codes(&mut state.velocity_carry, velocity),
        None => ([0; 3], false),
    };
    OutputFrame {
        sequence,
        dtheta_codes,
        dvel_codes,
        status: status.union(Status::OUTPUT_SATURATED.when(rotation_held | velocity_held)),
    }
}

/// Three values as codes; whether one was held.
#[inline(always)]
fn codes(carry: &mut [i64; 3], value: [i64; 3]) -> ([i32; 3], bool) {
    let mut any_held = false;
    let mut codes = [0; 3];
    for axis in 0..3 {
        let whole = value[axis].wrapping_add(carry[axis]);
        let rounded = whole.wrapping_add(1 << (FINE_PER_CODE_LOG2 - 1));
        codes[axis] = (rounded >> FINE_PER_CODE_LOG2) as i32;
        carry[axis] = whole.wrapping_sub(i64::from(codes[axis]) << FINE_PER_CODE_LOG2);
        // The upper word alone tells whether the code fits: one comparison.
        let upper = (rounded >> 32) as i32;
        if upper.wrapping_add(FITS) as u32 >= 2 * FITS as u32 {
            core::hint::cold_path();
            any_held = true;
            let limit = i64::from(i32::MAX);
            let held = (rounded >> FINE_PER_CODE_LOG2).max(-limit).min(limit);
            let largest = LARGEST_CARRY_CODES << FINE_PER_CODE_LOG2;
            codes[axis] = held as i32;
            carry[axis] = whole
                .wrapping_sub(held << FINE_PER_CODE_LOG2)
                .max(-largest)
                .min(largest);
        }
    }
    (codes, any_held)
}
