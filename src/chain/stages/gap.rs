//! Composes readings that cover several periods with the rest of their output period: coning and sculling.
//!
//! It takes the angle and the velocity of one such reading, of any size \[fine units\], and the angle and velocity that
//! the output period had before it and has at its end. It tests whether one frame can show the reading; if so, it gives
//! the coning and sculling of the reading with the rest of the period \[fine units\].
//!
//! The motion within a reading is not known, so it is taken to be steady. Coning is ½ Σ_{i<j} a_i × a_j over all angles
//! of the period in order of time, those of ordinary samples and of gaps. Among ordinary samples it is computed in
//! `coning.rs`. With B, U the period's angle and velocity before a reading g, w, with G, W the sums of the readings
//! before it, and with B, U, G, W at the period's end, the rest is
//!
//! ```text
//! coning      Σ (B × g − ½ G × g)                          + ½ G × B at the end
//! sculling    Σ (B × w + U × g − ½ (G × w + W × g))        + ½ (G × U + W × B) at the end
//! ```
//!
//! in integers: no angle of a gap enters the products of the number system, whose ranges are those of samples.
//!
//! Readings whose sum over the period is beyond [`GAP_IN_FRAME_RAD`] or [`VELOCITY_GAP_IN_FRAME_M_S`] are not composed:
//! later frames show their angle as it is (`frame.rs`).

use crate::chain::design_parameters::{GAP_IN_FRAME_RAD, VELOCITY_GAP_IN_FRAME_M_S};
use crate::chain::numbers::exact::{FINE_PER_M_S_LOG2, FINE_PER_RAD_LOG2};
use crate::chain::stages::turning::{add, crossed, words};
use crate::chain::triad::are_zero;

/// Largest angle of a period's readings that is composed \[fine units\].
const LARGEST_ANGLE: i128 = (GAP_IN_FRAME_RAD * (1u128 << FINE_PER_RAD_LOG2) as f64) as i128;

/// Largest velocity of a period's readings that is composed \[fine units\].
const LARGEST_VELOCITY: i128 =
    (VELOCITY_GAP_IN_FRAME_M_S * (1u128 << FINE_PER_M_S_LOG2) as f64) as i128;

/// A rotation and a velocity \[fine units\]; no velocity without accelerometers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    /// Rotation.
    pub angle: [i64; 3],
    /// Velocity.
    pub velocity: [i64; 3],
}

/// Sums over those readings of the present output period that cover several periods, as upper words of fine units: they
/// are used in products alone.
#[derive(Debug, Clone, Copy, Default)]
pub struct GapState {
    angle: [i32; 3],
    velocity: [i32; 3],
    /// Coning and sculling with the motion before each reading.
    coning: [i32; 3],
    sculling: [i32; 3],
}

impl GapState {
    /// True if the reading \[fine units\] is small enough to be composed with the rest of its output period.
    pub fn fits(&self, angle: [i128; 3], velocity: [i128; 3]) -> bool {
        let within = |value: [i128; 3], before: [i32; 3], largest: i128| {
            let mut pairs = value.iter().zip(fine(before));
            pairs.all(|(value, before)| {
                let sum = value.wrapping_add(i128::from(before));
                sum.unsigned_abs() <= largest.unsigned_abs()
            })
        };
        within(angle, self.angle, LARGEST_ANGLE)
            && within(velocity, self.velocity, LARGEST_VELOCITY)
    }

    /// True if no reading of this period has covered several periods.
    #[inline(always)]
    pub fn is_none(&self) -> bool {
        are_zero(self.angle) & are_zero(self.velocity)
    }

    /// Adds a reading that fits, which follows the motion `before` of its output period.
    pub fn take(&mut self, before: &Motion, reading: &Motion) {
        let (g, w) = (reading.angle, reading.velocity);
        let (all_g, all_w) = (fine(self.angle), fine(self.velocity));
        // V × g = −g × V.
        let across = subtract(crossed(before.angle, w), crossed(g, before.velocity));
        let among = subtract(crossed(all_g, w), crossed(g, all_w));
        self.angle = words(add(all_g, g));
        self.velocity = words(add(all_w, w));
        let coning = subtract(crossed(before.angle, g), halved(crossed(all_g, g)));
        let sculling = subtract(across, halved(among));
        self.coning = words(add(fine(self.coning), coning));
        self.sculling = words(add(fine(self.sculling), sculling));
    }

    /// Coning of the readings with the rest of the period \[fine units\], given the whole period's rotation `angle`.
    #[cold]
    pub fn coning(&self, angle: [i64; 3]) -> [i64; 3] {
        let with_later = halved(crossed(fine(self.angle), angle));
        add(fine(self.coning), with_later)
    }

    /// Sculling of the readings with the rest of the period \[fine units\], given the `whole` period's motion.
    #[cold]
    pub fn sculling(&self, whole: &Motion) -> [i64; 3] {
        let (all_g, all_w) = (fine(self.angle), fine(self.velocity));
        let with_later = halved(subtract(
            crossed(all_g, whole.velocity),
            crossed(whole.angle, all_w),
        ));
        add(fine(self.sculling), with_later)
    }
}

fn fine(words: [i32; 3]) -> [i64; 3] {
    words.map(|word| i64::from(word) << 32)
}

fn halved(value: [i64; 3]) -> [i64; 3] {
    value.map(|value| value >> 1)
}

fn subtract([ax, ay, az]: [i64; 3], [bx, by, bz]: [i64; 3]) -> [i64; 3] {
    [
        ax.wrapping_sub(bx),
        ay.wrapping_sub(by),
        az.wrapping_sub(bz),
    ]
}
