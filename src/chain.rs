//! The whole chain: the stages in the order of the data.

use crate::faults::{Faults, Status};
use crate::numbers::{NumberSystem, Unrounded};
use crate::parameters::{ParameterError, Parameters};
use crate::sample::{OutputFrame, Sample};
use crate::stages::acceleration::{Acceleration, AccelerationState};
use crate::stages::compensation;
use crate::stages::coning::{self, ConingState};
use crate::stages::counts::Counts;
use crate::stages::dither::{Dither, DitherState};
use crate::stages::frame::{self, FrameState};
use crate::stages::installation::Installation;
use crate::stages::rate_correction::RateCorrection;
use crate::triad::Triad;

/// The configuration of every stage: checked once when built, constant afterwards.
#[derive(Debug, Clone, Copy)]
pub struct Chain<N: NumberSystem> {
    counts: Counts<N>,
    dither: Dither<N>,
    rate_correction: RateCorrection<N>,
    acceleration: Acceleration<N>,
    installation: Installation<N>,
    samples_per_output: u32,
}

/// What the chain remembers between samples. One state belongs to one stream of samples.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChainState<N: NumberSystem> {
    dither: DitherState,
    acceleration: AccelerationState<N>,
    coning: ConingState<N>,
    frame: FrameState<N>,
    start: Start,
    samples_in_period: u32,
    samples: u32,
    status: Status,
    faults: Faults,
}

/// How much of the stream's beginning is behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Start {
    /// No sample yet: no pickoff reading to difference with.
    #[default]
    Unprimed,
    /// One sample: no increment yet to difference with.
    Primed,
    /// Samples were lost: the next increment covers several periods, so it tells no acceleration.
    Gap,
    Running,
}

impl Start {
    /// Lets an increment pass unless it is the stream's first.
    #[inline(always)]
    fn admit<N: NumberSystem>(
        &mut self,
        case: Triad<Unrounded<N>>,
    ) -> (Triad<Unrounded<N>>, Status) {
        let unprimed = *self == Self::Unprimed;
        *self = match self {
            Self::Unprimed | Self::Gap => Self::Primed,
            Self::Primed | Self::Running => Self::Running,
        };
        let admitted = case.map(|d| if unprimed { Unrounded::default() } else { d });
        (admitted, Status::PRIMED.when(unprimed))
    }
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

    /// Samples taken since start, wrapping.
    pub fn samples(&self) -> u32 {
        self.samples
    }
}

impl<N: NumberSystem> Chain<N> {
    /// Checks the parameters and turns them into this number system's coefficients. Runs at boot.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        Ok(Self {
            counts: Counts::new(parameters),
            dither: Dither::new(parameters),
            rate_correction: RateCorrection::new(parameters),
            acceleration: Acceleration::new(parameters),
            installation: Installation::new(parameters),
            samples_per_output: u32::from(parameters.samples_per_output),
        })
    }

    /// Takes one sample through the chain; every `samples_per_output`-th gives a frame.
    ///
    /// Deadline contract: called once per period T from the sampling interrupt. No allocation, no panic,
    /// no branch on data; besides the output period's last sample only the stream's first two differ (they
    /// fill the memory of the dither and acceleration stages, some 20 instructions). The stream's first
    /// sample only primes the dither strip: it counts as a sample of its period, adds no rotation, and its
    /// frame says [`Status::PRIMED`].
    #[inline]
    pub fn process(&self, state: &mut ChainState<N>, sample: &Sample) -> Option<OutputFrame> {
        let (sensed, counts_status) = self.counts.process(sample.pulse_counts);

        if state.start == Start::Unprimed {
            self.dither.prime(&mut state.dither, sample.pickoff_codes);
        }
        let (stripped, pickoff_status) =
            self.dither
                .process(&mut state.dither, sensed, sample.pickoff_codes);

        let corrected = self.rate_correction.process(stripped);

        let nearly_case = compensation::process(self.installation.at_rest(), corrected);
        let nearly_case = nearly_case.map(N::rounded);
        if state.start != Start::Running {
            self.acceleration
                .start(&mut state.acceleration, nearly_case);
        }
        let (acceleration, acceleration_status) = self
            .acceleration
            .process(&mut state.acceleration, nearly_case);

        let installation = self.installation.process(acceleration);

        let case = compensation::process(&installation, corrected);

        let gap_status = Status::GAP.when(state.start == Start::Gap);
        let (case, priming_status) = state.start.admit::<N>(case);
        coning::process(&mut state.coning, case);

        state.status = state
            .status
            .and(counts_status)
            .and(pickoff_status)
            .and(acceleration_status)
            .and(priming_status)
            .and(gap_status);
        state.faults.watch(state.status);
        state.samples = state.samples.wrapping_add(1);
        state.samples_in_period = state.samples_in_period.wrapping_add(1);
        if state.samples_in_period < self.samples_per_output {
            return None;
        }

        state.samples_in_period = 0;
        Some(self.end_period(state))
    }

    /// Lets `periods` sampling periods pass whose samples did not come; a frame where they end an output
    /// period, one for all that they end, so that its sequence may jump.
    ///
    /// The next sample's counts cover these periods too, because the counters run freely: its angle is kept.
    /// It and the one after it form no angular acceleration, so the flexure term is left out of them.
    pub fn process_lost(&self, state: &mut ChainState<N>, periods: u32) -> Option<OutputFrame> {
        if periods == 0 {
            return None;
        }
        if state.start != Start::Unprimed {
            state.start = Start::Gap;
        }
        state.status = state.status.and(Status::GAP);
        state.faults.watch(state.status);
        state.samples = state.samples.wrapping_add(periods);
        let passed = state.samples_in_period.saturating_add(periods);
        // Checked to be at least 1; said here so that the division needs no panic.
        let samples_per_output = self.samples_per_output.max(1);
        let ended = passed / samples_per_output;
        state.samples_in_period = passed % samples_per_output;
        if ended == 0 {
            return None;
        }
        frame::skip(&mut state.frame, ended - 1);
        let frame = self.end_period(state);
        state.status = Status::GAP.when(state.samples_in_period > 0);
        Some(frame)
    }

    /// Completes the output period.
    #[inline(always)]
    fn end_period(&self, state: &mut ChainState<N>) -> OutputFrame {
        let rotation = coning::finish(&mut state.coning);
        let status = core::mem::take(&mut state.status);
        let frame = frame::process(&mut state.frame, rotation, status);
        state.faults.record(frame.status);
        frame
    }
}
