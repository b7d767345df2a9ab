//! The whole chain: the stages in the order of the data.

pub mod design_parameters;

pub mod triad;

pub(crate) mod dither_phase;

pub mod sample;

pub mod faults;

pub mod numbers;

pub mod stages;

pub mod dither_monitor;

use crate::chain::design_parameters::BIAS_PERIODS;
use crate::chain::faults::{Faults, FirstFault, Status};
use crate::chain::numbers::NumberSystem;
use crate::chain::sample::{OutputFrame, Sample};
use crate::chain::stages::acceleration::{Acceleration, AccelerationState};
use crate::chain::stages::adaptation::{Adaptation, AdaptationState};
use crate::chain::stages::compensation;
use crate::chain::stages::coning::{self, ConingState};
use crate::chain::stages::counts::{Counts, CountsState};
use crate::chain::stages::dither::{Dither, DitherState};
use crate::chain::stages::frame::{self, FrameState};
use crate::chain::stages::gap::{GapState, Motion};
use crate::chain::stages::installation::{self, Installation, SignedFlexure};
use crate::chain::stages::limits::Limits;
use crate::chain::stages::sculling::{self, ScullingState};
use crate::chain::stages::size_effect::{self, SizeEffect, SizeEffectState};
use crate::chain::stages::turning;
use crate::chain::stages::velocity::{Velocity, VelocityState};
use crate::store::parameters::{ParameterError, Parameters};

/// The configuration of every stage: checked once when built, constant afterwards.
///
/// In memory as declared, here, in the state and in the processor, which holds the state before the chain:
/// a float is loaded from at most 1020 bytes above a base, and the two share one. What is multiplied at every
/// sample stands first here, what only accelerometers need last there: 20 instructions a sample.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Chain<N: NumberSystem> {
    acceleration: Acceleration<N>,
    counts: Counts<N>,
    installation: Installation<N>,
    dither: Dither<N>,
    limits: Limits,
    adaptation: Adaptation,
    samples_per_output: u32,
    /// Exponent of the increment unit.
    unit_log2: u32,
    accelerometers: Option<Accelerometers<N>>,
}

/// The stages of the velocity.
#[derive(Debug, Clone, Copy)]
struct Accelerometers<N: NumberSystem> {
    velocity: Velocity<N>,
    size_effect: SizeEffect,
}

/// What the chain remembers between samples. One state belongs to one stream of samples.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct ChainState<N: NumberSystem> {
    counts: CountsState,
    dither: DitherState<N>,
    adaptation: AdaptationState<N>,
    acceleration: AccelerationState<N>,
    /// The flexure at work: none while a fault has it switched off.
    flexure: SignedFlexure<N>,
    coning: ConingState<N>,
    frame: FrameState,
    phase: StreamPhase,
    periods_in_output: u32,
    /// Periods before the present output period.
    periods_before: u32,
    /// Periods of the present output period whose bias is not taken off at its end: the stream's first, which has no
    /// rotation and velocity, and those of a long outage, whose bias is settled already.
    periods_without: u32,
    status: Status,
    /// What the last adaptation window found; stands until the next one.
    health: Status,
    faults: Faults,
    velocity: VelocityState,
    sculling: ScullingState<N>,
    size_effect: SizeEffectState<N>,
    /// Readings of the present output period that cover several sampling periods.
    gap: GapState,
}

/// What the next sample is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum StreamPhase {
    /// The stream's first: no pickoff reading to difference with.
    #[default]
    First,
    /// The first increment, or the first after a gap: none to difference with.
    Second,
    /// The first after this many lost ones.
    AfterLost(u32),
    Ordinary,
    /// The first of a source that started anew, after this many lost ones: its counts tell nothing.
    Restarted(u32),
}

impl<N: NumberSystem> ChainState<N> {
    /// Before the first sample.
    pub fn new() -> Self {
        Self::default()
    }

    /// What went beyond its range since start, up to the last output period's end: faults of samples after
    /// the last frame are not in it, for there is no frame that they could spoil. A stream whose length is
    /// no multiple of `samples_per_output` ends with up to that many less one such samples.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// Sample periods since start, lost ones included, wrapping.
    pub fn samples(&self) -> u32 {
        self.periods_before.wrapping_add(self.periods_in_output)
    }

    /// Whether the next sample is one of those that follow a start or a gap.
    pub fn is_beginning(&self) -> bool {
        self.phase != StreamPhase::Ordinary
    }

    /// What the last adaptation window found of gyros x, y, z.
    pub fn health(&self) -> [Status; 3] {
        self.adaptation.health()
    }

    /// Tracked pickoff gain and quadrature of gyros x, y, z, over and above nominal \[1\].
    pub fn tracked(&self) -> [[f32; 2]; 3] {
        self.adaptation.tracked()
    }

    /// Lets the next fault be the first.
    pub(crate) fn forget_first_fault(&mut self) {
        self.faults.first = FirstFault::default();
    }

    /// Adds bits to the present output period.
    fn raise(&mut self, status: Status) {
        self.faults.watch(self.status, status, self.samples());
        self.status = self.status.union(status);
    }
}

impl<N: NumberSystem> Chain<N> {
    /// Checks the parameters and turns them into this number system's coefficients. Runs at boot.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        let limits = Limits::new(parameters);
        let dither = Dither::new(parameters, &limits);
        Ok(Self {
            counts: Counts::new(parameters, &limits),
            adaptation: Adaptation::new(parameters, &dither),
            acceleration: Acceleration::new(parameters),
            installation: Installation::new(parameters),
            accelerometers: parameters.accelerometers.as_ref().map(|accelerometers| {
                Accelerometers {
                    velocity: Velocity::new(parameters, accelerometers),
                    size_effect: SizeEffect::new(parameters, accelerometers),
                }
            }),
            samples_per_output: u32::from(parameters.samples_per_output),
            unit_log2: parameters.increment_unit_log2(),
            limits,
            dither,
        })
    }

    /// Whether the stream has its first sample, and its dithers, where they are watched, have had a window in which
    /// nothing was wrong.
    pub fn has_started(&self, state: &ChainState<N>) -> bool {
        state.phase != StreamPhase::First && self.adaptation.has_started(&state.adaptation)
    }

    /// Takes one sample through the chain; every `samples_per_output`-th gives a frame.
    ///
    /// Deadline contract: called once per period T from the sampling interrupt, or
    /// [`process_lost`](Self::process_lost) is. No allocation, no panic, no loop over data. The cost of a
    /// sample does not depend on its readings while they are in range; besides the output period's last
    /// sample, those cost more that follow a start or a gap, or are held at a limit (at most half as much
    /// again). The stream's first sample only primes the dither strip: it counts as a sample of its period,
    /// adds neither rotation nor velocity, and its frame says [`Status::PRIMED`].
    #[inline]
    pub fn process(&self, state: &mut ChainState<N>, sample: &Sample) -> Option<OutputFrame> {
        let brought_into_range;
        let ordinary = matches!(state.phase, StreamPhase::Second | StreamPhase::Ordinary)
            && self.limits.fit(state.dither.previous(), sample);
        let sample = if ordinary {
            sample
        } else {
            core::hint::cold_path();
            match self.begin_or_resume(state, sample) {
                Some(held) => {
                    brought_into_range = held;
                    &brought_into_range
                }
                None => return self.advance_time(state, 1),
            }
        };

        self.adaptation.observe(
            &mut state.adaptation,
            (&self.dither, &state.dither),
            &state.acceleration,
            sample,
        );

        let sensed = self.counts.process(&mut state.counts, sample.pulse_counts);

        let stripped = self
            .dither
            .process(&mut state.dither, sensed, sample.pickoff_codes);

        let at_rest = compensation::at_rest::<N>(self.installation.at_rest(), stripped);

        if state.phase == StreamPhase::Second {
            core::hint::cold_path();
            self.acceleration.start(&mut state.acceleration, at_rest);
            if let Some(accelerometers) = &self.accelerometers {
                let size_effect = &accelerometers.size_effect;
                size_effect.start(&mut state.size_effect, at_rest);
            }
            state.phase = StreamPhase::Ordinary;
        }
        let (acceleration, saturated) = self.acceleration.process(&mut state.acceleration, at_rest);
        if saturated != Status::default() {
            core::hint::cold_path();
            state.raise(saturated);
        }

        let tilts = installation::process::<N>(&state.flexure, acceleration);

        let tilted = compensation::tilted::<N>(&tilts, stripped);

        coning::process(&mut state.coning, at_rest, tilted);

        if let Some(accelerometers) = &self.accelerometers {
            accelerometers.process(state, sample.accelerometer_codes);
        }

        self.advance_time(state, 1)
    }

    /// Lets `periods` periods pass whose sample did not come. If they end output periods, the frame is the
    /// last of those, and its sequence number says so.
    ///
    /// The next sample's counts and accelerometer codes are taken to cover them (free-running counters), so
    /// that no angle and no velocity is lost, however long they span: what one frame cannot show follows in the next
    /// ones. Acceleration, coning and sculling within samples, the size effect's squares and tap adaptation begin anew
    /// after it.
    #[inline(never)]
    pub fn process_lost(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
        if periods == 0 {
            return None;
        }
        state.raise(Status::GAP);
        size_effect::discontinue(&mut state.size_effect);
        if state.phase == StreamPhase::First {
            return self.wait_for_first(state, periods);
        }
        if let far @ 1.. = periods.saturating_sub(BIAS_PERIODS) {
            // More bias than the sums of one output period take.
            self.give_back_bias(state, i64::from(far).wrapping_neg());
            state.periods_without = state.periods_without.wrapping_add(far);
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

    /// Lets periods pass before the stream's first sample: nobody counts, so there is no bias to take off.
    fn wait_for_first(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
        let waited = state.periods_in_output.wrapping_add(periods);
        let left = waited.checked_rem(self.samples_per_output).unwrap_or(0);
        // Of those that end now none is to be taken off, and so of those that are left.
        state.periods_without = match waited.wrapping_sub(left) {
            0 => left,
            ended => ended,
        };
        let frame = self.advance_time(state, periods);
        state.periods_without = left;
        frame
    }

    /// Tells that the source of samples has started anew, so that the next sample's counts and accelerometer codes say
    /// nothing of the time since the last one. They are ignored, whatever they are: the rotation, the velocity and the
    /// bias of that time are left out, and the pickoffs begin at that sample's readings.
    #[inline(never)]
    pub fn restart(&self, state: &mut ChainState<N>) {
        state.phase = match state.phase {
            StreamPhase::First => StreamPhase::First,
            StreamPhase::AfterLost(lost) | StreamPhase::Restarted(lost) => {
                StreamPhase::Restarted(lost)
            }
            StreamPhase::Second | StreamPhase::Ordinary => StreamPhase::Restarted(0),
        };
    }

    /// What a sample needs that is not an ordinary one; it goes on as the sample returned, if any.
    #[cold]
    #[inline(never)]
    fn begin_or_resume(&self, state: &mut ChainState<N>, sample: &Sample) -> Option<Sample> {
        match state.phase {
            StreamPhase::First => {
                let held = self.limits.hold(&sample.pickoff_codes, sample, 1);
                state.raise(held.status.union(Status::PRIMED));
                self.dither.start(&mut state.dither, sample.pickoff_codes);
                state.flexure = *self.installation.flexure();
                state.periods_without = state.periods_without.wrapping_add(1);
                state.phase = StreamPhase::Second;
                None
            }
            StreamPhase::Restarted(lost) => {
                self.resume_without(state, sample, lost.saturating_add(1));
                None
            }
            StreamPhase::AfterLost(lost) => {
                self.resume(state, sample, lost.saturating_add(1));
                None
            }
            StreamPhase::Second | StreamPhase::Ordinary => Some(self.hold(state, sample, 1)),
        }
    }

    /// The sample within its limits.
    fn hold(&self, state: &mut ChainState<N>, sample: &Sample, periods: u32) -> Sample {
        let held = self.limits.hold(state.dither.previous(), sample, periods);
        if held.status != Status::default() {
            state.raise(held.status);
            state.adaptation.disturb();
            state.dither.shift(held.pickoff_excess);
        }
        held.sample
    }

    /// Takes a reading that covers several periods: its angle and velocity, and what they are worth across the rest of
    /// the output period. It is no increment of one period, and serves no other product.
    fn resume(&self, state: &mut ChainState<N>, sample: &Sample, periods: u32) {
        let sample = self.hold(state, sample, periods);
        let (counts, pickoffs) = (sample.pulse_counts, sample.pickoff_codes);
        let stripped = self.dither.exact(&state.dither, pickoffs);
        let mut sensed = self.counts.exact_wide(counts);
        for (sensed, stripped) in sensed.iter_mut().zip(stripped) {
            *sensed = sensed.wrapping_sub(i128::from(stripped));
        }
        let angle = compensation::at_rest_wide(self.installation.exact_at_rest(), sensed);
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
            && state.velocity.has_room(codes);
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
            state.frame.owe(angle, velocity);
            self.dither.leave_out(&mut state.dither, pickoffs);
        }
        self.dither.resume(&mut state.dither, pickoffs);
        self.begin_products(state, velocity_status);
    }

    /// The velocity felt since the output period's start, without its bias \[fine units\].
    fn velocity_since_start(&self, state: &ChainState<N>) -> [i64; 3] {
        match &self.accelerometers {
            Some(known) => known.velocity.since_start(&state.velocity),
            None => [0; 3],
        }
    }

    /// Takes the pickoffs of a sample whose counts tell nothing of the last `periods` periods.
    fn resume_without(&self, state: &mut ChainState<N>, sample: &Sample, periods: u32) {
        // What the blocks moved was not counted either.
        self.dither.restart(&mut state.dither, sample.pickoff_codes);
        // Nor is there a bias to take off, of this output period or of those that have ended.
        let of_this = periods.min(state.periods_in_output.wrapping_add(1));
        state.periods_without = state.periods_without.wrapping_add(of_this);
        self.give_back_bias(state, i64::from(periods.wrapping_sub(of_this)));
        size_effect::discontinue(&mut state.size_effect);
        self.begin_products(state, Status::default());
    }

    /// Begins the products of neighbouring samples anew after a gap.
    fn begin_products(&self, state: &mut ChainState<N>, raised: Status) {
        state.raise(raised.union(Status::GAP));
        state.adaptation.disturb();
        coning::resume(&mut state.coning);
        sculling::resume(&mut state.sculling);
        state.phase = StreamPhase::Second;
    }

    /// The case's angle at rest \[fine units\].
    fn exact_case(&self, mut sensed: [i64; 3], stripped: [i64; 3]) -> [i64; 3] {
        for (sensed, stripped) in sensed.iter_mut().zip(stripped) {
            *sensed = sensed.wrapping_sub(stripped);
        }
        compensation::at_rest_exactly(self.installation.exact_at_rest(), sensed)
    }

    /// Lets time pass; the frame, if an output period ends.
    #[inline(always)]
    fn advance_time(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
        state.periods_in_output = state.periods_in_output.wrapping_add(periods);
        if state.periods_in_output < self.samples_per_output {
            return None;
        }
        Some(self.finish(state))
    }

    /// Ends the output period, or several that passed without a sample.
    #[inline(never)]
    fn finish(&self, state: &mut ChainState<N>) -> OutputFrame {
        // An ordinary period needs no division.
        let outputs = if state.periods_in_output == self.samples_per_output {
            1
        } else {
            state
                .periods_in_output
                .checked_div(self.samples_per_output)
                .unwrap_or(1)
        };
        let periods = outputs.wrapping_mul(self.samples_per_output);
        let without = core::mem::take(&mut state.periods_without);
        let with_rotation = periods.wrapping_sub(without);

        let sensed = self.counts.finish(&mut state.counts, with_rotation);
        let stripped = self.dither.finish(&mut state.dither);
        let verdict = self.adaptation.finish(
            &mut state.adaptation,
            &self.dither,
            &mut state.dither,
            outputs,
        );
        let moved = match verdict {
            Some(verdict) => {
                self.degrade(state, verdict.status);
                verdict.angle
            }
            None => [0; 3],
        };
        let mut sensing_axes = moved;
        for axis in 0..3 {
            sensing_axes[axis] = sensing_axes[axis]
                .wrapping_add(sensed[axis])
                .wrapping_sub(stripped[axis]);
        }
        let case = compensation::at_rest_exactly(self.installation.exact_at_rest(), sensing_axes);
        let beside = coning::finish(&mut state.coning, self.unit_log2);
        let mut rotation = case;
        for (rotation, beside) in rotation.iter_mut().zip(beside) {
            *rotation = rotation.wrapping_add(beside);
        }
        let before = core::mem::take(&mut state.status);
        if before.contains(Status::GAP) {
            core::hint::cold_path();
            rotation = turning::add(rotation, state.gap.coning(rotation));
        }
        let velocity = self.accelerometers.as_ref().map(|accelerometers| {
            accelerometers.finish(state, self.unit_log2, rotation, with_rotation)
        });

        let status = before.union(state.health);
        let frame = frame::process(&mut state.frame, rotation, velocity, status, outputs);
        let last = state.periods_before.wrapping_add(periods).wrapping_sub(1);
        state.faults.watch(before, frame.status, last);
        state.faults.record(frame.status);

        state.periods_before = state.periods_before.wrapping_add(periods);
        state.periods_in_output = state.periods_in_output.wrapping_sub(periods);
        if before.contains(Status::GAP) {
            core::hint::cold_path();
            state.gap = GapState::default();
        }
        if let StreamPhase::AfterLost(_) | StreamPhase::Restarted(_) = state.phase
            && state.periods_in_output > 0
        {
            state.status = Status::GAP;
        }
        frame
    }

    /// Gives back, or takes off for a negative number, the bias of so many sampling periods.
    #[cold]
    #[inline(never)]
    fn give_back_bias(&self, state: &mut ChainState<N>, periods: i64) {
        let sensed = self.counts.bias_wide(periods);
        let rotation = compensation::at_rest_wide(self.installation.exact_at_rest(), sensed);
        let velocity = match &self.accelerometers {
            Some(known) => known.velocity.bias_wide(periods),
            None => [0; 3],
        };
        state.frame.owe(rotation, velocity);
    }

    /// Switches the flexure term off while a gyro's increments hold its dither, and on again.
    fn degrade(&self, state: &mut ChainState<N>, health: Status) {
        let unusable = Status::PICKOFF_FAILED.union(Status::COUNTER_STUCK);
        let off = health.bits() & unusable.bits() != 0;
        state.flexure = if off {
            SignedFlexure::<N>::default()
        } else {
            *self.installation.flexure()
        };
        state.health = health.union(Status::DYNAMIC_TERM_OFF.when(off));
    }
}

#[cfg(feature = "proof")]
impl Chain<crate::chain::numbers::Interval> {
    /// Lowest and highest of both taps of gyros x, y, z that adaptation can put to work \[fine units per code\].
    pub fn tap_ranges(&self) -> [[(i64, i64); 2]; 3] {
        self.adaptation.tap_ranges(self.dither.nominal())
    }

    /// Puts all those taps to work for the next sample.
    pub fn widen_taps(&self, state: &mut ChainState<crate::chain::numbers::Interval>) {
        self.dither
            .widen_taps(&mut state.dither, &self.tap_ranges());
    }

    /// Samples of one adaptation window; of an output period where no gyro is dithered.
    pub fn samples_per_window(&self) -> u32 {
        self.adaptation.frames_per_window() * self.samples_per_output
    }
}

#[cfg(feature = "proof")]
impl ChainState<crate::chain::numbers::Interval> {
    /// Everything that the state keeps in fixed-point words.
    pub fn words(&self) -> impl core::fmt::Debug + '_ {
        (
            (
                self.dither.step(),
                self.dither.taps(),
                self.adaptation.sums(),
            ),
            (&self.acceleration, &self.flexure, &self.coning),
            (&self.sculling, &self.size_effect),
        )
    }
}

impl<N: NumberSystem> Accelerometers<N> {
    /// One sample, after its rotation. A function of its own, so that the chain without accelerometers pays for
    /// a branch alone: inlined, it costs 26 instructions more where it is not taken.
    #[inline(never)]
    fn process(&self, state: &mut ChainState<N>, codes: [i32; 3]) {
        let (increment, saturated) = self.velocity.process(&mut state.velocity, codes);
        if saturated != Status::default() {
            core::hint::cold_path();
            state.raise(saturated);
        }

        sculling::process(&mut state.sculling, &state.coning, increment);

        size_effect::process(&mut state.size_effect, state.coning.latest());
    }

    /// The velocity increment of the output period that turned by `rotation`, in the body frame at its start
    /// \[fine units\].
    #[inline(never)]
    fn finish(
        &self,
        state: &mut ChainState<N>,
        unit_log2: u32,
        rotation: [i64; 3],
        periods: u32,
    ) -> [i64; 3] {
        let felt = self.velocity.finish(&mut state.velocity, periods);
        // Without the dynamic term the increments are not the case's.
        let known = !state.health.contains(Status::DYNAMIC_TERM_OFF);
        let owed = self.size_effect.finish(&mut state.size_effect, known);
        let mut rectified = sculling::finish(&mut state.sculling, unit_log2);
        if !state.gap.is_none() {
            core::hint::cold_path();
            let whole = Motion {
                angle: rotation,
                velocity: felt,
            };
            rectified = turning::add(rectified, state.gap.sculling(&whole));
        }

        let evenly = turning::add(turning::add(felt, rectified), owed.gathered);
        let mut velocity = turning::gathered(rotation, evenly);
        let swung = turning::at_end(rotation, owed.end);
        for axis in 0..3 {
            let swing = swung[axis].wrapping_sub(owed.start[axis]);
            velocity[axis] = velocity[axis].wrapping_sub(swing);
        }
        velocity
    }
}
