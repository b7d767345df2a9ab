//! Gives the proof by interval arithmetic the chain's stored words and the range of its taps.
//!
//! Built with the feature `proof` alone, for the host.

use crate::chain::numbers::Interval;
use crate::chain::terms::Term;
use crate::chain::{Chain, ChainState};

impl<T: Term<Interval>> Chain<Interval, T> {
    /// Lowest and highest value of both taps of gyros x, y, z that adaptation can reach \[fine units per code\].
    pub fn tap_ranges(&self) -> [[(i64, i64); 2]; 3] {
        self.adaptation.tap_ranges(self.dither.nominal())
    }

    /// Uses the whole ranges of the taps for the next sample.
    pub fn widen_taps(&self, state: &mut ChainState<Interval, T>) {
        self.dither
            .widen_taps(&mut state.dither, &self.tap_ranges());
    }

    /// Samples of one adaptation window; of an output period where no gyro is dithered.
    pub fn samples_per_window(&self) -> u32 {
        self.adaptation.frames_per_window() * self.samples_per_output
    }
}

impl<T: Term<Interval>> ChainState<Interval, T> {
    /// All fixed-point words of the state.
    pub fn words(&self) -> impl core::fmt::Debug + '_ {
        (
            (
                self.dither.step(),
                self.dither.taps(),
                self.adaptation.sums(),
            ),
            (&self.flexure, &self.coning),
            (&self.sculling, &self.size_effect, &self.terms),
        )
    }
}
