//! Carries the chain over discontinuities of the sample stream: its start, lost samples, a source that restarts, and
//! readings beyond their range.
//!
//! Nothing here runs for an ordinary sample.

use crate::chain::design_parameters::{ACCELEROMETER_SUM_CODES, BIAS_PERIODS};
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::sample::{OutputFrame, Sample};
use crate::chain::stages::gap::Motion;
use crate::chain::stages::{compensation, coning, flexure, sculling, size_effect};
use crate::chain::terms::Term;
use crate::chain::{Chain, ChainState, StreamPhase};

impl<N: NumberSystem, T: Term<N>> Chain<N, T> {
    /// Advances the chain by `periods` sampling periods whose samples did not come.
    ///
    /// # Returns
    /// If these periods end one or more output periods, the frame of the last of those; its sequence number skips the
    /// others. The next sample does not go through the stages.
    ///
    /// # Assumptions
    /// The next sample's counts and accelerometer codes cover the lost periods (free-running counters), so no angle and
    /// no velocity is lost, however long the outage: any part beyond one frame's range follows in the next ones.
    /// Flexure, coning and sculling within samples, the size effect's squares and tap adaptation start anew afterwards.
    #[inline(never)]
    pub fn process_lost(&self, state: &mut ChainState<N, T>, periods: u32) -> Option<OutputFrame> {
        if periods == 0 {
            return None;
        }
        state.raise(Status::GAP);
        self.discontinue(state);
        if state.phase == StreamPhase::First {
            return self.wait_for_first(state, periods);
        }
        if let far @ 1.. = periods.saturating_sub(BIAS_PERIODS) {
            // The exact sums of one output period do not hold more bias than that.
            self.give_back_bias(state, i64::from(far).wrapping_neg());
            state.periods_without_bias = state.periods_without_bias.wrapping_add(far);
        }
        state.phase = match state.phase {
            StreamPhase::First => StreamPhase::First,
            StreamPhase::AfterLost(before) => {
                StreamPhase::AfterLost(before.saturating_add(periods))
            }
            StreamPhase::Restarted(before) => {
                StreamPhase::Restarted(before.saturating_add(periods))
            }
            StreamPhase::Second | StreamPhase::Ordinary => StreamPhase::AfterLost(periods),
        };
        self.advance_time(state, periods)
    }

    /// Advances by periods before the stream's first sample. Nothing is counted yet, so no bias is subtracted.
    fn wait_for_first(&self, state: &mut ChainState<N, T>, periods: u32) -> Option<OutputFrame> {
        let waited = state.periods_in_output.wrapping_add(periods);
        let left = waited.checked_rem(self.samples_per_output).unwrap_or(0);
        // Neither the output periods that end now nor the present one have bias to subtract for these periods.
        state.periods_without_bias = match waited.wrapping_sub(left) {
            0 => left,
            ended => ended,
        };
        let frame = self.advance_time(state, periods);
        state.periods_without_bias = left;
        frame
    }

    /// Records a restart of the source of samples: the next sample's counts and accelerometer codes do not
    /// do not cover the time since the last one. They are ignored, whatever they are: rotation, velocity and bias of
    /// that time
    /// are left out, and the dither strip starts from that sample's pickoff readings.
    #[inline(never)]
    pub fn restart(&self, state: &mut ChainState<N, T>) {
        state.phase = match state.phase {
            StreamPhase::First => StreamPhase::First,
            StreamPhase::AfterLost(lost) | StreamPhase::Restarted(lost) => {
                StreamPhase::Restarted(lost)
            }
            StreamPhase::Second | StreamPhase::Ordinary => StreamPhase::Restarted(0),
        };
    }

    /// Begins with the stream's first sample, or resumes with the first after a gap or a restart, and leaves the output
    /// period open as [`take`](Self::take) does. Such a sample does not go through the stages.
    #[cold]
    #[inline(never)]
    pub(crate) fn begin_or_resume(&self, state: &mut ChainState<N, T>, sample: &Sample) {
        match state.phase {
            StreamPhase::First => {
                let held = self.limits.hold(&sample.pickoff_codes, sample, 1);
                state.raise(held.status.union(Status::PRIMED));
                self.dither.start(&mut state.dither, sample.pickoff_codes);
                state.periods_without_bias = state.periods_without_bias.wrapping_add(1);
                self.adaptation.start(&mut state.adaptation);
                state.phase = StreamPhase::Second;
            }
            StreamPhase::Restarted(lost) => {
                self.resume_without(state, sample, lost.saturating_add(1));
            }
            StreamPhase::AfterLost(lost) => self.resume(state, sample, lost.saturating_add(1)),
            // These go through the stages.
            StreamPhase::Second | StreamPhase::Ordinary => {}
        }
        state.count(1);
    }

    /// Brings a sample of one period within its limits.
    #[cold]
    #[inline(never)]
    pub(super) fn hold_one(&self, state: &mut ChainState<N, T>, sample: &mut Sample) {
        *sample = self.hold(state, sample, 1);
    }

    /// Brings a sample that covers `periods` periods within its limits.
    fn hold(&self, state: &mut ChainState<N, T>, sample: &Sample, periods: u32) -> Sample {
        let held = self.limits.hold(&state.dither.previous(), sample, periods);
        if held.status != Status::default() {
            state.raise(held.status);
            state.adaptation.disturb();
            state.dither.shift(held.pickoff_excess);
        }
        held.sample
    }

    /// Takes a reading that covers several periods: adds its angle and velocity to the output period, with their coning
    /// and sculling. It is not the increment of one period, so the stages that form products of samples do not see it.
    fn resume(&self, state: &mut ChainState<N, T>, sample: &Sample, periods: u32) {
        let sample = self.hold(state, sample, periods);
        let (counts, pickoffs) = (sample.pulse_counts, sample.pickoff_codes);
        let stripped = self.dither.exact(&state.dither, pickoffs);
        let mut sensed = self.counts.exact_wide(counts);
        for (sensed, stripped) in sensed.iter_mut().zip(stripped) {
            *sensed = sensed.wrapping_sub(i128::from(stripped));
        }
        // The terms do not correct angles deferred to later frames; the part in this output period they correct at its end.
        let corrected = self.terms.angles_wide(&state.terms, sensed);
        let wide = |angle| compensation::at_rest_wide(self.installation.exact_at_rest(), angle);
        let angle = wide(sensed);
        let (codes, velocity_status) = match &self.accelerometers {
            Some(known) => known.velocity.hold(sample.accelerometer_codes, periods),
            None => ([0; 3], Status::default()),
        };
        let velocity = match &self.accelerometers {
            Some(known) => known.velocity.exact_wide(codes),
            None => [0; 3],
        };
        let of_samples = |limit: i32| limit.saturating_mul(self.samples_per_output as i32);
        let fits = state.gap.fits(angle, velocity)
            && (state.counts).has_room(counts, self.limits.counts().map(of_samples))
            && (state.velocity).has_room(codes, [ACCELEROMETER_SUM_CODES; 3]);
        if fits {
            let before = Motion {
                angle: self.exact_case(
                    self.counts.since_start(&state.counts),
                    self.dither.since_start(&state.dither),
                ),
                velocity: self.velocity_since_start(state),
            };
            let reading = Motion {
                angle: angle.map(|angle| angle as i64),
                velocity: velocity.map(|velocity| velocity as i64),
            };
            state.gap.take(&before, &reading);
            state.counts.add(counts);
            state.velocity.add(codes);
        } else {
            state.frame.defer(wide(corrected), velocity);
            self.dither.leave_out(&mut state.dither, pickoffs);
        }
        self.dither.resume(&mut state.dither, pickoffs);
        // An output period may end here, and then shows where the blocks are.
        self.terms.pickoffs(&mut state.terms, &pickoffs, &pickoffs);
        self.begin_products(state, velocity_status);
    }

    /// The velocity that the accelerometers have sensed since the output period's start \[fine units\]; their bias is
    /// still in it.
    fn velocity_since_start(&self, state: &ChainState<N, T>) -> [i64; 3] {
        match &self.accelerometers {
            Some(known) => known.velocity.since_start(&state.velocity),
            None => [0; 3],
        }
    }

    /// Resumes with a sample whose counts do not cover the last `periods` periods: only its pickoff readings are used.
    fn resume_without(&self, state: &mut ChainState<N, T>, sample: &Sample, periods: u32) {
        // The gyros did not count the blocks' motion in these periods either.
        self.dither.restart(&mut state.dither, sample.pickoff_codes);
        // No bias was counted: give back the bias subtracted for them, now or later, in output periods that have ended
        // and in the present one.
        let of_this = periods.min(state.periods_in_output.wrapping_add(1));
        state.periods_without_bias = state.periods_without_bias.wrapping_add(of_this);
        self.give_back_bias(state, i64::from(periods.wrapping_sub(of_this)));
        self.discontinue(state);
        self.begin_products(state, Status::default());
    }

    /// Records that the next increments do not follow the last, for every difference of increments.
    fn discontinue(&self, state: &mut ChainState<N, T>) {
        size_effect::discontinue(&mut state.size_effect);
        flexure::discontinue(&mut state.flexure);
        self.terms.discontinue(&mut state.terms);
    }

    /// Starts the products of neighbouring samples anew after a gap.
    fn begin_products(&self, state: &mut ChainState<N, T>, raised: Status) {
        state.raise(raised.union(Status::GAP));
        state.adaptation.disturb();
        coning::resume(&mut state.coning);
        sculling::resume(&mut state.sculling);
        state.phase = StreamPhase::Second;
        state.follows_flexure = false;
    }

    /// The case's angle \[fine units\] by the installation matrix at rest, from sensed and stripped angles.
    fn exact_case(&self, mut sensed: [i64; 3], stripped: [i64; 3]) -> [i64; 3] {
        for (sensed, stripped) in sensed.iter_mut().zip(stripped) {
            *sensed = sensed.wrapping_sub(stripped);
        }
        compensation::at_rest_exactly(self.installation.exact_at_rest(), sensed)
    }

    /// Adds the bias of `periods` sampling periods to the next frames; subtracts it for a negative number.
    #[cold]
    #[inline(never)]
    fn give_back_bias(&self, state: &mut ChainState<N, T>, periods: i64) {
        let of_terms = self.terms.bias(&state.terms);
        let sensed = self.counts.bias_wide(periods, of_terms);
        let rotation = compensation::at_rest_wide(self.installation.exact_at_rest(), sensed);
        let velocity = match &self.accelerometers {
            Some(known) => known.velocity.bias_wide(periods),
            None => [0; 3],
        };
        state.frame.defer(rotation, velocity);
    }
}
