//! The whole chain: the stages in the order of the data.

use crate::faults::{Faults, Status};
use crate::numbers::NumberSystem;
use crate::parameters::{ParameterError, Parameters};
use crate::sample::{OutputFrame, Sample};
use crate::stages::acceleration::{Acceleration, AccelerationState};
use crate::stages::adaptation::{Adaptation, AdaptationState};
use crate::stages::compensation;
use crate::stages::coning::{self, ConingState};
use crate::stages::counts::{Counts, CountsState};
use crate::stages::dither::{Dither, DitherState};
use crate::stages::frame::{self, FrameState};
use crate::stages::installation::{self, Installation, SignedFlexure};
use crate::stages::limits::Limits;
use crate::stages::sculling::{self, ScullingState};
use crate::stages::size_effect::{self, SizeEffect, SizeEffectState};
use crate::stages::turning;
use crate::stages::velocity::{Velocity, VelocityState};

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
    next: Next,
    periods_in_output: u32,
    /// Periods before the present output period.
    periods_before: u32,
    /// Periods of the present output period without rotation and velocity, nor bias: the stream's first.
    periods_without: u32,
    status: Status,
    /// What the last adaptation window found; stands until the next one.
    health: Status,
    faults: Faults,
    velocity: VelocityState,
    sculling: ScullingState<N>,
    size_effect: SizeEffectState<N>,
}

/// What the next sample is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Next {
    /// The stream's first: no pickoff reading to difference with.
    #[default]
    First,
    /// The first increment, or the first after a gap: none to difference with.
    Second,
    /// The first after this many lost ones.
    AfterLost(u32),
    Ordinary,
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
        self.next != Next::Ordinary
    }

    /// What the last adaptation window found of gyros x, y, z.
    pub fn health(&self) -> [Status; 3] {
        self.adaptation.health()
    }

    /// Tracked pickoff gain and quadrature of gyros x, y, z, over and above nominal \[1\].
    pub fn tracked(&self) -> [[f32; 2]; 3] {
        self.adaptation.tracked()
    }

    /// Adds bits to the present output period.
    fn raise(&mut self, status: Status) {
        self.faults.watch(self.status, status, self.samples());
        self.status = self.status.and(status);
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
            limits,
            dither,
        })
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
        let ordinary = matches!(state.next, Next::Second | Next::Ordinary)
            && self.limits.fit(state.dither.previous(), sample);
        let sample = if ordinary {
            sample
        } else {
            core::hint::cold_path();
            match self.prepare(state, sample) {
                Some(held) => {
                    brought_into_range = held;
                    &brought_into_range
                }
                None => return self.pass(state, 1),
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

        if state.next == Next::Second {
            core::hint::cold_path();
            self.acceleration.start(&mut state.acceleration, at_rest);
            if let Some(accelerometers) = &self.accelerometers {
                let size_effect = &accelerometers.size_effect;
                size_effect.start(&mut state.size_effect, at_rest);
            }
            state.next = Next::Ordinary;
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

        self.pass(state, 1)
    }

    /// Lets `periods` periods pass whose sample did not come. If they end output periods, the frame is the
    /// last of those, and its sequence number says so.
    ///
    /// The next sample's counts and accelerometer codes are taken to cover them (free-running counters), so
    /// that no angle and no velocity is lost; acceleration, coning and sculling within samples, the size
    /// effect's squares and tap adaptation begin anew after it.
    #[inline(never)]
    pub fn process_lost(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
        if periods == 0 {
            return None;
        }
        state.raise(Status::GAP);
        size_effect::interrupt(&mut state.size_effect);
        state.next = match state.next {
            Next::First => Next::First,
            Next::AfterLost(before) => Next::AfterLost(before.saturating_add(periods)),
            Next::Second | Next::Ordinary => Next::AfterLost(periods),
        };
        self.pass(state, periods)
    }

    /// What a sample needs that is not an ordinary one; it goes on as the sample returned, if any.
    #[cold]
    #[inline(never)]
    fn prepare(&self, state: &mut ChainState<N>, sample: &Sample) -> Option<Sample> {
        if state.next == Next::First {
            let held = self.limits.hold(&sample.pickoff_codes, sample, 1);
            state.raise(held.status.and(Status::PRIMED));
            self.dither.start(&mut state.dither, sample.pickoff_codes);
            state.flexure = *self.installation.flexure();
            state.periods_without = 1;
            state.next = Next::Second;
            return None;
        }
        let periods = match state.next {
            Next::AfterLost(lost) => lost.saturating_add(1),
            _ => 1,
        };
        let held = self.limits.hold(state.dither.previous(), sample, periods);
        if held.status != Status::default() {
            state.raise(held.status);
            state.adaptation.disturb();
            state.dither.shift(held.pickoff_excess);
        }
        let sample = held.sample;
        if periods > 1 {
            // Sums and the coning across: this increment is none of one period, and serves no other product.
            state.raise(Status::GAP);
            state.adaptation.disturb();
            let before = self.exact_case(
                self.counts.since_start(&state.counts),
                self.dither.since_start(&state.dither),
            );
            let angle = self.exact_case(
                self.counts.exact(sample.pulse_counts),
                self.dither.exact(&state.dither, sample.pickoff_codes),
            );
            state.counts.add(sample.pulse_counts);
            self.dither.resume(&mut state.dither, sample.pickoff_codes);
            let beside = coning::resume(&mut state.coning, before, angle);
            frame::carry(&mut state.frame, beside);
            if let Some(accelerometers) = &self.accelerometers {
                let velocity = &accelerometers.velocity;
                let codes = sample.accelerometer_codes;
                let gained_before = velocity.since_start(&state.velocity);
                let (gained, saturated) = velocity.resume(&mut state.velocity, codes, periods);
                state.raise(saturated);
                sculling::resume(
                    &mut state.sculling,
                    &state.coning,
                    (before, angle),
                    (gained_before, gained),
                );
            }
            state.next = Next::Second;
            return None;
        }
        Some(sample)
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
    fn pass(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
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
        let with_rotation = periods.wrapping_sub(core::mem::take(&mut state.periods_without));

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
        let beside = coning::finish(&mut state.coning);
        let mut rotation = case;
        for (rotation, beside) in rotation.iter_mut().zip(beside) {
            *rotation = rotation.wrapping_add(beside);
        }
        let velocity = self
            .accelerometers
            .as_ref()
            .map(|accelerometers| accelerometers.finish(state, rotation, with_rotation));

        let before = core::mem::take(&mut state.status);
        let status = before.and(state.health);
        let frame = frame::process(&mut state.frame, rotation, velocity, status, outputs);
        let last = state.periods_before.wrapping_add(periods).wrapping_sub(1);
        state.faults.watch(before, frame.status, last);
        state.faults.record(frame.status);

        state.periods_before = state.periods_before.wrapping_add(periods);
        state.periods_in_output = state.periods_in_output.wrapping_sub(periods);
        if let Next::AfterLost(_) = state.next
            && state.periods_in_output > 0
        {
            state.status = Status::GAP;
        }
        frame
    }

    /// Switches the flexure term off while a gyro's increments hold its dither, and on again.
    fn degrade(&self, state: &mut ChainState<N>, health: Status) {
        let unusable = Status::PICKOFF_FAILED.and(Status::COUNTER_STUCK);
        let off = health.bits() & unusable.bits() != 0;
        state.flexure = if off {
            SignedFlexure::<N>::default()
        } else {
            *self.installation.flexure()
        };
        state.health = health.and(Status::DYNAMIC_TERM_OFF.when(off));
    }
}

#[cfg(feature = "proof")]
impl Chain<crate::numbers::Interval> {
    /// Lowest and highest of both taps of gyros x, y, z that adaptation can put to work \[fine units per code\].
    pub fn tap_ranges(&self) -> [[(i64, i64); 2]; 3] {
        self.adaptation.tap_ranges(self.dither.nominal())
    }

    /// Puts all those taps to work for the next sample.
    pub fn widen_taps(&self, state: &mut ChainState<crate::numbers::Interval>) {
        self.dither
            .widen_taps(&mut state.dither, &self.tap_ranges());
    }

    /// Samples of one adaptation window; of an output period where no gyro is dithered.
    pub fn samples_per_window(&self) -> u32 {
        self.adaptation.frames_per_window() * self.samples_per_output
    }
}

#[cfg(feature = "proof")]
impl ChainState<crate::numbers::Interval> {
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
    fn finish(&self, state: &mut ChainState<N>, rotation: [i64; 3], periods: u32) -> [i64; 3] {
        let felt = self.velocity.finish(&mut state.velocity, periods);
        // Without the dynamic term the increments are not the case's.
        let known = !state.health.contains(Status::DYNAMIC_TERM_OFF);
        let owed = self.size_effect.finish(&mut state.size_effect, known);
        let rectified = sculling::finish(&mut state.sculling);

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
