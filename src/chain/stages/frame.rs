//! Rounds the output period's rotation and velocity to an output frame, and carries the part that a frame cannot show.
//!
//! It takes the rotation vector and, with accelerometers, the velocity increment \[fine units\], both in the body frame
//! at the period's start, and the period's status. It gives an [`OutputFrame`] in codes of
//! [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE) and [`OUTPUT_M_S_PER_CODE`](crate::OUTPUT_M_S_PER_CODE).
//!
//! The part that does not fit a frame is carried into the next ones, so that no angle and no velocity is lost: the
//! fraction of a code, which keeps the sum of all frames within half a code of the sum of all increments; and whole
//! codes beyond an `i32`, after an outage or at a rate that a frame cannot hold. Frames that leave whole codes for
//! later have [`Status::OUTPUT_SATURATED`], frames that show a part of earlier periods [`Status::CARRIED_OVER`].
//!
//! The carried part is added without turning it to the later frame's axes: the angle about each axis is kept, the
//! order in which the case turned about several of them is not.

use crate::chain::design_parameters::FINE_PER_CODE_LOG2;
use crate::chain::faults::Status;
use crate::chain::sample::OutputFrame;
use crate::chain::triad::are_zero;

/// A value fits an `i32` of codes if the upper word of its fine units lies from −`FITS` to `FITS` − 1.
const FITS: i32 = 1 << (FINE_PER_CODE_LOG2 - 1);

/// Half a code \[fine units\].
const HALF: u32 = 1 << (FINE_PER_CODE_LOG2 - 1);

/// Mask of the fine units below a whole code.
const BELOW: u32 = (1 << FINE_PER_CODE_LOG2) - 1;

/// Bits of `defers`: whole codes of earlier frames are still to be shown; whole codes of this frame are.
const DEFERS_EARLIER: u32 = 1;
const DEFERS_THIS: u32 = 2;

/// Number of the next frame, and the part that the frames so far could not show.
#[derive(Debug, Clone, Copy)]
pub struct FrameState {
    sequence: u32,
    /// [`DEFERS_EARLIER`] while whole codes of earlier frames are still to be shown, else 0.
    defers: u32,
    rotation: Remainder,
    velocity: Remainder,
}

/// Part of three values that the frames so far could not show.
#[derive(Debug, Clone, Copy)]
struct Remainder {
    /// The part of a code and a half of one, so that the next code is rounded to nearest \[fine units\].
    carry: [u32; 3],
    /// Whole codes still to be shown.
    deferred: [i64; 3],
}

impl Default for FrameState {
    fn default() -> Self {
        let empty = Remainder {
            carry: [HALF; 3],
            deferred: [0; 3],
        };
        Self {
            sequence: 0,
            defers: 0,
            rotation: empty,
            velocity: empty,
        }
    }
}

impl FrameState {
    /// Adds a rotation and a velocity of any size to the next frames \[fine units\].
    pub fn defer(&mut self, rotation: [i128; 3], velocity: [i128; 3]) {
        self.rotation.add(rotation);
        self.velocity.add(velocity);
        self.update_defers();
    }

    fn update_defers(&mut self) {
        let shown = are_zero(self.rotation.deferred) & are_zero(self.velocity.deferred);
        self.defers = if shown { 0 } else { DEFERS_EARLIER };
    }

    /// Adds to the frame as many deferred codes as it has room for, with their status bits.
    #[cold]
    #[inline(never)]
    fn show_deferred(&mut self, mut frame: OutputFrame) -> OutputFrame {
        let carried_over = Status::CARRIED_OVER.when(self.defers != 0);
        self.rotation.settle(&mut frame.dtheta_codes);
        self.velocity.settle(&mut frame.dvel_codes);
        self.update_defers();
        let saturated = Status::OUTPUT_SATURATED.when(self.defers != 0);
        frame.status = frame.status.union(carried_over).union(saturated);
        frame
    }
}

impl Remainder {
    /// Adds a value of any size \[fine units\].
    fn add(&mut self, value: [i128; 3]) {
        for (axis, value) in value.into_iter().enumerate() {
            let whole = value.wrapping_add(i128::from(self.carry[axis]));
            self.carry[axis] = whole as u32 & BELOW;
            let codes = (whole >> FINE_PER_CODE_LOG2) as i64;
            self.deferred[axis] = self.deferred[axis].saturating_add(codes);
        }
    }

    /// Converts three values \[fine units\] to codes; a code beyond a frame's range is deferred instead.
    #[inline(always)]
    fn codes(&mut self, value: [i64; 3], defers: &mut u32) -> [i32; 3] {
        let mut codes = [0; 3];
        for axis in 0..3 {
            let whole = value[axis].wrapping_add(i64::from(self.carry[axis]));
            self.carry[axis] = whole as u32 & BELOW;
            let code = whole >> FINE_PER_CODE_LOG2;
            codes[axis] = code as i32;
            // The upper word alone decides if the code fits: one comparison.
            let upper = (whole >> 32) as i32;
            if upper.wrapping_add(FITS) as u32 >= 2 * FITS as u32 {
                core::hint::cold_path();
                *defers |= DEFERS_THIS;
                codes[axis] = 0;
                self.deferred[axis] = self.deferred[axis].saturating_add(code);
            }
        }
        codes
    }

    /// Adds deferred codes to a frame's codes, as many as it has room for.
    fn settle(&mut self, codes: &mut [i32; 3]) {
        let limit = i64::from(i32::MAX);
        for (deferred, code) in self.deferred.iter_mut().zip(codes) {
            let all = deferred.saturating_add(i64::from(*code));
            let within = all.max(-limit).min(limit);
            *code = within as i32;
            *deferred = all.wrapping_sub(within);
        }
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
    let mut defers = state.defers;
    let frame = OutputFrame {
        sequence,
        dtheta_codes: state.rotation.codes(rotation, &mut defers),
        dvel_codes: match velocity {
            Some(velocity) => state.velocity.codes(velocity, &mut defers),
            None => [0; 3],
        },
        status,
    };
    if defers != 0 {
        core::hint::cold_path();
        return state.show_deferred(frame);
    }
    frame
}
