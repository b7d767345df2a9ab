//! Takes samples through the stages in the order of the data, and keeps the chain's configuration and state.

pub mod design_parameters;

pub mod triad;

pub(crate) mod dither_phase;

pub mod parameters;

pub mod parameter_error;

pub mod health_limits;

pub mod identity;

pub mod sample;

pub mod faults;

pub mod numbers;

pub mod output_format;

pub(crate) mod code_sum;

pub mod stages;

pub mod terms;

mod discontinuity;

#[cfg(feature = "proof")]
mod proof;

#[cfg(feature = "monitor")]
pub mod dither_monitor;

use crate::chain::code_sum::CodeSum;
use crate::chain::faults::{Faults, FirstFault, Status};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{FINE_PER_M_S_LOG2, FINE_PER_RAD_LOG2};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::sample::{OutputFrame, Sample, SampleIncrement};
use crate::chain::stages::adaptation::{Adaptation, AdaptationState};
use crate::chain::stages::compensation;
use crate::chain::stages::coning::{self, ConingState};
use crate::chain::stages::counts::Counts;
use crate::chain::stages::dither::{Dither, DitherState};
use crate::chain::stages::flexure::{Flexure, FlexureState};
use crate::chain::stages::frame::{self, FrameState};
use crate::chain::stages::gap::{GapState, Motion};
use crate::chain::stages::installation::Installation;
use crate::chain::stages::limits::Limits;
use crate::chain::stages::sculling::{self, ScullingState};
use crate::chain::stages::size_effect::{self, SizeEffect, SizeEffectState};
use crate::chain::stages::turning;
use crate::chain::stages::velocity::Velocity;
use crate::chain::terms::{PeriodSums, SlowReadings, SlowTerms, SlowUpdate, Term};
use crate::chain::triad::Triad;

/// The configuration of every stage: checked once when built, constant afterwards.
///
/// The order of fields in memory (`repr(C)`) saves 20 instructions a sample. A Cortex-M4 loads a float from at most 1020
/// bytes above a base register, and the processor holds state and chain side by side so that both share one base:
/// factors that every sample needs come first in the chain, fields for accelerometers alone come last in the state, and
/// behind them those of optional [`terms`].
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Chain<N: NumberSystem, T: Term<N> = ()> {
    installation: Installation<N>,
    flexure: Flexure<N>,
    counts: Counts<N>,
    dither: Dither<N>,
    limits: Limits,
    adaptation: Adaptation,
    samples_per_output: u32,
    /// Exponent of the increment unit.
    unit_log2: u32,
    accelerometers: Option<Accelerometers<N, T>>,
    terms: T,
}

/// Configuration of the stages of the velocity.
#[derive(Debug, Clone, Copy)]
struct Accelerometers<N: NumberSystem, T: Term<N>> {
    velocity: Velocity<N>,
    size_effect: SizeEffect,
    /// A copy, so that without terms nothing is handed on.
    terms: T,
}

/// State of the chain between samples. One state belongs to one stream of samples.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ChainState<N: NumberSystem, T: Term<N> = ()> {
    counts: CodeSum,
    dither: DitherState<N>,
    adaptation: AdaptationState<N>,
    flexure: FlexureState<N>,
    coning: ConingState<N>,
    frame: FrameState,
    phase: StreamPhase,
    /// True if the next sample's products are corrected for flexure.
    follows_flexure: bool,
    periods_in_output: u32,
    /// Periods before the present output period.
    periods_before: u32,
    /// Periods of the present output period whose bias is not subtracted at its end: the stream's first, which has no
    /// rotation and velocity, and those of a long outage, whose bias is accounted for already.
    periods_without_bias: u32,
    status: Status,
    /// Health by the last adaptation window.
    health: Status,
    faults: Faults,
    velocity: CodeSum,
    sculling: ScullingState<N>,
    size_effect: SizeEffectState<N>,
    /// Readings of the present output period that cover several sampling periods.
    gap: GapState,
    terms: T::State,
}

/// Place of the next sample in the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum StreamPhase {
    /// The stream's first sample: there is no earlier pickoff reading to difference with.
    #[default]
    First,
    /// The sample of the first increment, or of the first after a gap: there is no earlier increment to difference with.
    Second,
    /// The first sample after this many lost periods.
    AfterLost(u32),
    /// Any other sample.
    Ordinary,
    /// The first sample of a source that restarted, after this many lost periods; its counts cover none of them.
    Restarted(u32),
}

impl StreamPhase {
    /// True if the next sample's readings are the increments of one period, so that it goes through the stages.
    #[inline(always)]
    fn has_increment(self) -> bool {
        matches!(self, Self::Second | Self::Ordinary)
    }
}

impl<N: NumberSystem, T: Term<N>> Default for ChainState<N, T> {
    fn default() -> Self {
        Self {
            counts: CodeSum::default(),
            dither: DitherState::default(),
            adaptation: AdaptationState::default(),
            flexure: FlexureState::default(),
            coning: ConingState::default(),
            frame: FrameState::default(),
            phase: StreamPhase::default(),
            follows_flexure: false,
            periods_in_output: 0,
            periods_before: 0,
            periods_without_bias: 0,
            status: Status::default(),
            health: Status::default(),
            faults: Faults::default(),
            velocity: CodeSum::default(),
            sculling: ScullingState::default(),
            size_effect: SizeEffectState::default(),
            gap: GapState::default(),
            terms: T::State::default(),
        }
    }
}

impl<N: NumberSystem, T: Term<N>> ChainState<N, T> {
    /// The state before the first sample.
    pub fn new() -> Self {
        Self::default()
    }

    /// Faults since start, up to the end of the last output period. Faults of later samples are not counted yet: no
    /// frame contains those samples.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// Sample periods since start, lost ones included, wrapping.
    pub fn samples(&self) -> u32 {
        self.periods_before.wrapping_add(self.periods_in_output)
    }

    /// Sampling periods of the present output period so far.
    #[inline(always)]
    pub(crate) fn periods_in_output(&self) -> u32 {
        self.periods_in_output
    }

    /// True if the next sample follows a start or a gap.
    pub fn is_beginning(&self) -> bool {
        self.phase != StreamPhase::Ordinary
    }

    /// Health of gyros x, y, z by the last adaptation window.
    pub fn health(&self) -> [Status; 3] {
        self.adaptation.health()
    }

    /// Tracked pickoff gain and quadrature of gyros x, y, z, over and above nominal \[1\].
    pub fn tracked(&self) -> [[f32; 2]; 3] {
        self.adaptation.tracked()
    }

    /// Clears the first fault, so that the next one is latched.
    pub(crate) fn forget_first_fault(&mut self) {
        self.faults.first = FirstFault::default();
    }

    /// Counts `periods` sampling periods.
    #[inline(always)]
    fn count(&mut self, periods: u32) {
        self.periods_in_output = self.periods_in_output.wrapping_add(periods);
    }

    /// Raises status bits for the present output period.
    fn raise(&mut self, status: Status) {
        self.faults.watch(self.status, status, self.samples());
        self.status = self.status.union(status);
    }
}

impl<N: NumberSystem> Chain<N> {
    /// Checks the parameters and turns them into this number system's coefficients, of a chain without terms. Runs at
    /// boot.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        Self::with_terms(parameters)
    }
}

impl<N: NumberSystem, T: Term<N>> Chain<N, T> {
    /// [`Chain::new`] of a chain with the terms `T`.
    ///
    /// # Errors
    /// A parameter is out of its range, or there is a record of a kind that `T` lacks.
    pub fn with_terms(parameters: &Parameters) -> Result<Self, ParameterError> {
        Ok(Self::build(parameters, &Self::checked_terms(parameters)?))
    }

    /// The chain of parameters that [`checked_terms`](Self::checked_terms) has found in range. Inlined, so that it is built
    /// where it stays: it is large.
    #[inline(always)]
    pub(crate) fn build(parameters: &Parameters, terms: &T) -> Self {
        let terms = *terms;
        let limits = Limits::new(parameters);
        let dither = Dither::new(parameters, &limits);
        Self {
            counts: Counts::new(parameters, &limits),
            adaptation: Adaptation::new(parameters, &dither),
            flexure: Flexure::new(parameters),
            installation: Installation::new(parameters),
            accelerometers: parameters.accelerometers.as_ref().map(|accelerometers| {
                Accelerometers {
                    velocity: Velocity::new(parameters, accelerometers),
                    size_effect: SizeEffect::new(parameters, accelerometers),
                    terms,
                }
            }),
            samples_per_output: u32::from(parameters.samples_per_output),
            unit_log2: parameters.increment_unit_log2(),
            limits,
            dither,
            terms,
        }
    }

    /// Checks that this chain can use the parameters.
    ///
    /// # Errors
    /// Those of [`with_terms`](Self::with_terms).
    pub fn check(parameters: &Parameters) -> Result<(), ParameterError> {
        Self::checked_terms(parameters).map(|_| ())
    }

    /// Returns the terms if the parameters are in range: nothing else of the chain can fail.
    ///
    /// # Errors
    /// Those of [`with_terms`](Self::with_terms).
    #[inline(never)]
    pub fn checked_terms(parameters: &Parameters) -> Result<T, ParameterError> {
        parameters.check()?;
        if let Some(kind) = parameters.terms.kinds().first_beyond(T::KINDS) {
            return Err(ParameterError::TermAbsent(kind));
        }
        let terms = T::new(parameters)?;
        parameters.check_addition(terms.largest_addition())?;
        Ok(terms)
    }

    /// True once the stream has its first sample and the dithers, if any is watched, have had one window without a finding.
    pub fn has_started(&self, state: &ChainState<N, T>) -> bool {
        state.phase != StreamPhase::First && self.adaptation.has_started(&state.adaptation)
    }

    /// The terms as the main loop needs them to prepare updates of the slow readings.
    pub fn slow_terms(&self) -> SlowTerms<N, T> {
        SlowTerms::new(self.terms)
    }

    /// Takes an update that [`SlowTerms`] prepared: a copy.
    #[inline]
    pub fn take_slow(&self, state: &mut ChainState<N, T>, update: &SlowUpdate<N, T>) {
        self.terms.take_slow(&mut state.terms, &update.prepared);
    }

    /// Hands readings that change slowly to the terms; they hold until the next ones.
    pub fn slow(&self, state: &mut ChainState<N, T>, readings: &SlowReadings) {
        self.terms.slow(&mut state.terms, readings);
    }

    /// Takes one sample through the chain; every `samples_per_output`-th sample gives a frame.
    ///
    /// The stream's first sample only primes the dither strip: it counts as a sample of its output period, adds neither
    /// rotation nor velocity, and its frame has [`Status::PRIMED`].
    ///
    /// # Deadline
    /// The sampling interrupt calls this or [`process_lost`](Self::process_lost) once per period T. There is no
    /// allocation, no panic and no loop over data. The cost of a sample does not depend on its readings while they are
    /// in range. The output period's last sample costs more; so do samples that follow a start or a gap or are held at a
    /// limit, at most half as much again.
    #[inline]
    pub fn process(&self, state: &mut ChainState<N, T>, sample: &Sample) -> Option<OutputFrame> {
        self.process_in_place(state, &mut { *sample })
    }

    /// [`Chain::process`] of a sample that the caller no longer needs: a reading beyond its limit is held in it. No copy
    /// is made.
    #[inline]
    pub fn process_in_place(
        &self,
        state: &mut ChainState<N, T>,
        sample: &mut Sample,
    ) -> Option<OutputFrame> {
        self.take(state, sample);
        self.is_due(state).then(|| self.finish(state))
    }

    /// The increments of the sample that the chain took last, without waiting for a frame: free of dither, less the bias,
    /// through scale, installation and the terms of increments; zeros after a start or lost samples, when there is none.
    ///
    /// For control loops at the sample rate. Navigation takes frames: rounded increments of samples, summed, lose what the
    /// exact sums of a frame keep, and they hold neither the flexure term nor coning, sculling, size effect and the
    /// angle by which the strip's taps move.
    pub fn increment(&self, state: &ChainState<N, T>) -> SampleIncrement {
        if !state.phase.has_increment() || state.phase == StreamPhase::Second {
            return SampleIncrement::default();
        }
        let fine = |increment: Triad<N::Increment>| {
            let fine = |value| N::ahead(value, N::Increment::default()) << self.unit_log2;
            [fine(increment.x), fine(increment.y), fine(increment.z)]
        };
        let bias = self.counts.bias_wide(1, self.terms.bias(&state.terms));
        let bias = compensation::at_rest_wide(self.installation.exact_at_rest(), bias);
        let mut rotation = fine(state.coning.latest());
        for (rotation, bias) in rotation.iter_mut().zip(bias) {
            *rotation = rotation.wrapping_sub(bias as i64);
        }
        let scaled = |fine: [i64; 3], log2: i32| {
            // A power of two: the quotient is as exact as an f32 can be.
            fine.map(|fine| (fine as f64 / libm::exp2(f64::from(log2))) as f32)
        };
        SampleIncrement {
            dtheta_rad: scaled(rotation, FINE_PER_RAD_LOG2),
            dvel_m_s: scaled(fine(state.sculling.latest()), FINE_PER_M_S_LOG2),
        }
    }

    /// Takes one sample through the chain and leaves its output period open. If the period is complete,
    /// [`is_due`](Self::is_due) is true and [`finish`](Self::finish) comes before the next sample. A reading beyond its
    /// limit is held in `sample`.
    #[inline(always)]
    pub(crate) fn take(&self, state: &mut ChainState<N, T>, sample: &mut Sample) {
        let ordinary = state.phase == StreamPhase::Ordinary
            && self.limits.fit(&state.dither.previous(), sample);
        if !ordinary {
            core::hint::cold_path();
            // No way leads from here to the stages: such a sample costs either, not both.
            if !state.phase.has_increment() {
                return self.begin_or_resume(state, sample);
            }
            self.hold_one(state, sample);
        }

        let felt = match &self.accelerometers {
            Some(accelerometers) if T::FOLLOWS_FORCE => {
                let felt = accelerometers.feel(state, sample.accelerometer_codes);
                self.terms.force(&mut state.terms, felt);
                felt
            }
            _ => Triad::default(),
        };

        self.adaptation.observe(
            &mut state.adaptation,
            (&self.dither, &state.dither),
            &state.flexure,
            sample,
        );

        let previous = state.dither.previous();
        self.terms
            .pickoffs(&mut state.terms, &previous, &sample.pickoff_codes);

        let sensed = self.counts.process(&mut state.counts, sample.pulse_counts);

        let stripped = self
            .dither
            .process(&mut state.dither, sensed, sample.pickoff_codes);

        if state.phase == StreamPhase::Second {
            core::hint::cold_path();
            self.terms.begin(&mut state.terms, stripped);
        }
        let stripped = self.terms.increments(&mut state.terms, stripped);

        let at_rest = compensation::at_rest::<N>(self.installation.at_rest(), stripped);

        let case = if state.follows_flexure {
            let previous = state.coning.latest();
            (self.flexure).process(&mut state.flexure, previous, at_rest)
        } else {
            core::hint::cold_path();
            self.without_flexure(state, at_rest);
            at_rest
        };
        let held = self.terms.case(&mut state.terms, at_rest);
        if held != Status::default() {
            core::hint::cold_path();
            state.raise(held);
        }

        coning::process(&mut state.coning, at_rest, case);

        if let Some(accelerometers) = &self.accelerometers {
            if T::FOLLOWS_FORCE {
                accelerometers.sum(state, felt);
            } else {
                accelerometers.process(state, sample.accelerometer_codes);
            }
        }

        state.count(1);
    }

    /// True if an output period is complete and its frame is due.
    #[inline(always)]
    pub(crate) fn is_due(&self, state: &ChainState<N, T>) -> bool {
        state.periods_in_output >= self.samples_per_output
    }

    /// True if `periods` sampling periods end an output period that has none yet.
    #[inline(always)]
    pub(crate) fn end_one(&self, periods: u32) -> bool {
        periods >= self.samples_per_output
    }

    /// Takes increments without flexure correction: the first after a start or gap, from which every difference of
    /// increments starts, and those with a block's dither in them.
    #[cold]
    #[inline(never)]
    fn without_flexure(&self, state: &mut ChainState<N, T>, increment: Triad<N::Increment>) {
        if state.phase != StreamPhase::Second {
            let previous = state.coning.latest();
            (self.flexure).process(&mut state.flexure, previous, increment);
            return;
        }
        self.flexure
            .start(&mut state.flexure, increment, self.unit_log2);
        if let Some(accelerometers) = &self.accelerometers {
            let size_effect = &accelerometers.size_effect;
            size_effect.start(&mut state.size_effect, increment);
        }
        state.phase = StreamPhase::Ordinary;
        state.follows_flexure = !state.health.contains(Status::DYNAMIC_TERM_OFF);
    }

    /// Computes the flexure correction of the output period's angles about the sensing axes \[fine units\].
    #[inline(always)]
    fn bent(&self, state: &mut ChainState<N, T>) -> [i64; 3] {
        let known = !state.health.contains(Status::DYNAMIC_TERM_OFF);
        let latest = state.coning.latest();
        let (bent, held) = (self.flexure).finish(&mut state.flexure, latest, self.unit_log2, known);
        if held {
            core::hint::cold_path();
            state.raise(Status::ACCELERATION_SATURATED);
        }
        bent
    }

    /// Counts `periods` sampling periods; gives the frame if an output period ends.
    #[inline(always)]
    fn advance_time(&self, state: &mut ChainState<N, T>, periods: u32) -> Option<OutputFrame> {
        state.count(periods);
        self.is_due(state).then(|| self.finish(state))
    }

    /// Ends the output period, or several of them that passed without a sample, and makes the frame of the last.
    #[inline(never)]
    pub(crate) fn finish(&self, state: &mut ChainState<N, T>) -> OutputFrame {
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
        let without = core::mem::take(&mut state.periods_without_bias);
        let with_rotation = periods.wrapping_sub(without);

        let bias = self.terms.bias(&state.terms);
        let mut sensing_axes = [0; 3];
        // Axis by axis: the values of all three do not fit the registers.
        for axis in 0..3 {
            let sensed = (self.counts).finish(&mut state.counts, axis, with_rotation, bias[axis]);
            let stripped = self.dither.finish(&mut state.dither, axis);
            sensing_axes[axis] = sensed.wrapping_sub(stripped);
        }
        let bent = self.bent(state);
        let window = self.adaptation.finish(
            &mut state.adaptation,
            &self.dither,
            &mut state.dither,
            outputs,
        );
        if let Some(window) = window {
            self.degrade(state, window.status);
            sensing_axes = turning::add(sensing_axes, window.angle);
        }
        let sums = self.period_sums(state, with_rotation);
        let sensing_axes = self.terms.angles(&mut state.terms, &sums, sensing_axes);
        let sensing_axes = turning::add(sensing_axes, bent);
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

    /// Returns the sums of the ending output period that the terms may use.
    #[inline(always)]
    fn period_sums(&self, state: &ChainState<N, T>, periods: u32) -> PeriodSums {
        let velocity = match &self.accelerometers {
            Some(known) if T::NEEDS_FORCE => known.velocity.over(&state.velocity, periods),
            _ => [0; 3],
        };
        PeriodSums {
            periods,
            unit_log2: self.unit_log2,
            velocity,
        }
    }

    /// Switches the flexure term off while a gyro's increments hold its dither, and on again.
    fn degrade(&self, state: &mut ChainState<N, T>, health: Status) {
        let unusable = Status::PICKOFF_FAILED.union(Status::COUNTER_STUCK);
        let off = health.bits() & unusable.bits() != 0;
        state.follows_flexure = !off && state.phase == StreamPhase::Ordinary;
        self.terms.degrade(&mut state.terms, !off);
        state.health = health.union(Status::DYNAMIC_TERM_OFF.when(off));
    }
}

impl<N: NumberSystem, T: Term<N>> Accelerometers<N, T> {
    /// Takes one sample's accelerometer codes through velocity, sculling and size effect, after its rotation. It is not
    /// inlined, so that the chain without accelerometers pays for a branch alone: inlined, it would cost 26
    /// instructions more where the branch is not taken.
    #[inline(never)]
    fn process(&self, state: &mut ChainState<N, T>, codes: [i32; 3]) {
        let increment = self.feel(state, codes);
        self.sum(state, increment);
    }

    /// Computes one sample's velocity increments.
    #[inline(always)]
    fn feel(&self, state: &mut ChainState<N, T>, codes: [i32; 3]) -> Triad<N::Increment> {
        let (increment, saturated) = self.velocity.process(&mut state.velocity, codes);
        if saturated != Status::default() {
            core::hint::cold_path();
            state.raise(saturated);
        }
        self.terms.velocities(&mut state.terms, increment)
    }

    /// Takes velocity increments through sculling and size effect.
    #[inline(always)]
    fn sum(&self, state: &mut ChainState<N, T>, increment: Triad<N::Increment>) {
        sculling::process(&mut state.sculling, &state.coning, increment);

        size_effect::process(&mut state.size_effect, state.coning.latest());
    }

    /// The velocity increment of the output period that turned by `rotation`, in the body frame at its start
    /// \[fine units\].
    #[inline(never)]
    fn finish(
        &self,
        state: &mut ChainState<N, T>,
        unit_log2: u32,
        rotation: [i64; 3],
        periods: u32,
    ) -> [i64; 3] {
        let felt = self.velocity.finish(&mut state.velocity, periods);
        let felt = self.terms.felt(&mut state.terms, unit_log2, felt);
        // While the dynamic term is off, the increments contain a block's dither.
        let known = !state.health.contains(Status::DYNAMIC_TERM_OFF);
        let size_effect = self.size_effect.finish(&mut state.size_effect, known);
        let mut rectified = sculling::finish(&mut state.sculling, unit_log2);
        if !state.gap.is_none() {
            core::hint::cold_path();
            let whole = Motion {
                angle: rotation,
                velocity: felt,
            };
            rectified = turning::add(rectified, state.gap.sculling(&whole));
        }

        let evenly = turning::add(turning::add(felt, rectified), size_effect.gathered);
        let mut velocity = turning::gathered(rotation, evenly);
        let swung = turning::at_end(rotation, size_effect.end);
        for axis in 0..3 {
            let swing = swung[axis].wrapping_sub(size_effect.start[axis]);
            velocity[axis] = velocity[axis].wrapping_sub(swing);
        }
        velocity
    }
}
