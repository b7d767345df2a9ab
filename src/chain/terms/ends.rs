//! Follows an angle (or velocity) that three sensors lack at the end of every sample, E \[increment units\].
//!
//! Increments become D_k + E_k − E_{k−1}, and an output period's sum grows by E_end − E_start \[fine units\]: it
//! telescopes, so no error of E drifts. The correction of one increment is held; the exact sums are not.
//!
//! Over lost samples E keeps its last value. While increments contain dither (a failed pickoff) E is unknown and left
//! out of the period's sum.

use crate::chain::numbers::NumberSystem;

/// Largest E \[increment units\]: the format of an increment holds 1/64.
pub(super) const LARGEST_AHEAD: f64 = 0.0155;

/// E of the latest sample and of the output period's start.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ends<N: NumberSystem> {
    /// E_k.
    ahead: [N::Increment; 3],
    /// E at the output period's start \[fine units\].
    start: [i64; 3],
    begun: bool,
    /// True if the last increments are those of the last periods.
    pub(super) current: bool,
    /// True if increments contain dither.
    pub(super) unknown: bool,
}

impl<N: NumberSystem> Ends<N> {
    /// Starts from E of the first sample, or of the first after a gap.
    pub(super) fn begin(&mut self, ahead: [N::Increment; 3]) {
        self.ahead = ahead;
        self.current = true;
        if !self.begun {
            self.begun = true;
            // The unit's exponent is applied where differences are shown.
            self.start = ahead.map(|ahead| N::at_end(ahead, ahead));
        }
    }

    /// Takes E of the next sample.
    ///
    /// # Returns
    /// The correction of the sample's increment, within ±`limit`.
    #[inline(always)]
    pub(super) fn gain(
        &mut self,
        axis: usize,
        ahead: N::Increment,
        limit: N::Increment,
    ) -> N::Increment {
        let gained = N::difference_within(ahead, self.ahead[axis], limit);
        self.ahead[axis] = ahead;
        gained
    }

    /// Corrects the sum by the difference of E between its period's ends \[fine units\].
    #[inline(always)]
    pub(super) fn sum(&mut self, unit_log2: u32, mut sum: [i64; 3]) -> [i64; 3] {
        if self.unknown {
            return sum;
        }
        for (axis, sum) in sum.iter_mut().enumerate() {
            let ahead = N::at_end(self.ahead[axis], self.ahead[axis]);
            let gained = ahead.wrapping_sub(self.start[axis]) << unit_log2;
            *sum = sum.wrapping_add(gained);
            self.start[axis] = ahead;
        }
        sum
    }
}
