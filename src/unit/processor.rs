//! Runs the chain once a sampling period and accounts for time and faults around it, the same code on the board, in the
//! emulator and on the host.
//!
//! It takes, once a period, a [`Reading`] of the counter bank and the interrupt's own [`Timing`]. It gives a
//! [`TelemetryFrame`] at the end of each output period, health counters and the first fault. Increments are in the body
//! frame; units are those of [`OutputFrame`].
//!
//! # Time
//! A period passes whether its sample came or not. The chain is advanced over each without a sample
//! ([`Chain::process_lost`]), so output periods keep their length and number. The bank counts on meanwhile, so the next
//! sample holds the angle of all of them: a fault delays the angle and costs the flexure term of that one sample, never
//! the angle.
//!
//! # Faults: handling and end
//!
//! | fault | status bit | meanwhile | ends |
//! |---|---|---|---|
//! | interrupt missed | 16 | its period passes as lost | next sample: whole angle, no dynamic term, flagged GAP |
//! | interrupt late | 17 | nothing: the sample is whole, the bank latched it in time | at once |
//! | frame repeated | 18 | period lost | as above |
//! | source not ready | 19 | period lost | as above |
//! | check sum | 20 | period lost | as above |
//! | bus error, stuck line | 21 | period lost | as above |
//! | no room for a frame | 22 | the frame is dropped with its angle; the next ones report it and the sequence shows it | with the next frame that finds room |
//! | dither drive, intensity, temperature beyond its limit, mode hop | 14 27 28 29 | nothing is switched off: the gyro may be wrong, not the chain | with the next good reading |
//! | temperature needed and absent | 30 | the terms keep their last temperature | with the next reading |
//! | pulse per second lost | 31 | times count on from the last pulse | with the next regular pulse |
//! | bank restarted | 26 | its counts since its last frame are unknown and left out; the strip begins at its pickoffs | at once |
//! | count, pickoff step, acceleration, velocity beyond range | 0 1 2 9 | held at the range's end; the excess is lost | with the next sample in range |
//! | output beyond a frame's range | 3 | the frame shows as much as it can, the next ones the rest ([`Status::CARRIED_OVER`]) | when all is shown |
//! | pickoff failed, counter stuck | 5 8 | no dynamic term ([`Status::DYNAMIC_TERM_OFF`]) and no size effect, that axis's strip is not adapted | after one whole good window |
//! | dither stopped, out of band | 6 7 | nothing is switched off: lock-in spoils the gyro, not the chain | with the next good window |
//! | clock fallback | 23 | runs on the internal oscillator, 1 % off: angles right, times not | reset |
//! | parameters of another unit | 15 | nominal parameters, nothing compensated | reset with a slot of this unit |
//! | no parameter slot good | 24 | nominal parameters, nothing compensated | reset with a good slot |
//! | one slot bad | 25 | the other slot | reset after mending |
//!
//! # Start-up
//! Until the bank has given a sample and every dither has had a window without a finding, at most [`START_UP_LIMIT_S`],
//! faults raise their bits and counters but are not latched as the first fault: a bank or a dither that is still
//! starting would take the place of the fault in service that the latch and the trace are for. Faults still present
//! after that time are latched.
//!
//! A status bit stands in the frame of the output period in which the fault was seen; of the boot, in every
//! frame. After a gap of several output periods there is one frame for all of them, and the sequence jumps.
//!
//! # In the interrupt
//! No panic, no allocation, no wait, no loop over data. A period without a fault and without a frame costs
//! the chain and some twenty instructions.
//!
//! Bus, queue and clock are outside. A gap's angle is not spread over the periods that it covers: that would be a
//! guess, and navigation sees the flag.

use crate::chain::design_parameters::START_UP_LIMIT_S;
use crate::chain::faults::{Faults, FirstFault, Status};
use crate::chain::identity::Identity;
use crate::chain::numbers::NumberSystem;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::sample::{OutputFrame, Sample, SampleIncrement};
use crate::chain::terms::{SlowReadings, SlowTerms, SlowUpdate, Term};
use crate::chain::{Chain, ChainState};
use crate::unit::health::{HEALTH_ITEMS, Health, HealthItem, item};
use crate::unit::pulse_clock::PulseClock;
use crate::unit::sample_source::{Reading, SourceFault};
use crate::unit::slow_channels::{BankService, SlowWatch};
use crate::unit::telemetry_frame::TelemetryFrame;

/// Findings of the boot that frames report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[must_use = "a boot may have found a fault"]
pub struct BootReport {
    /// The external oscillator did not answer.
    pub clock_fallback: bool,
    /// No parameter slot was good: nominal values.
    pub parameters_default: bool,
    /// One slot was bad, the other is used.
    pub slot_bad: bool,
    /// Generation of the parameters in use; 0 for the nominal ones.
    pub generation: u32,
    /// Cause of the last reset: bits of [`reset_cause`](crate::unit::health::reset_cause).
    pub reset_cause: u32,
    /// Failure of the previous run and its place, as health items 43 and 44; 0 without one.
    pub last_failure_kind: u32,
    /// Source line or instruction address.
    pub last_failure_place: u32,
    /// A slot holds the parameters of another unit: nominal values.
    pub parameters_foreign: bool,
    /// Revision of the firmware, as health item 50: [`crate::REVISION`] of this library, or the firmware's own.
    pub revision: u32,
    /// Running firmware image, as health item 66; 0 without a boot selector.
    pub image: u32,
}

impl BootReport {
    /// Returns this report after `change`.
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

/// Timing of this period's interrupt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Timing {
    /// Sampling periods since the previous interrupt that had no interrupt.
    pub missed: u32,
    /// True if this interrupt came later than allowed.
    pub late: bool,
}

/// Measures the cost of the chain. The functions are inlined, so an implementation that does nothing costs nothing.
pub trait CostProbe {
    /// Called before the chain takes a sample.
    fn begin(&mut self);
    /// Called when the chain has taken the sample.
    fn end(&mut self, class: SampleClass);
}

/// Classes of samples by their cost in the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleClass {
    /// The sample completed no output frame.
    BetweenOutputs,
    /// The sample completed an output frame.
    WithOutput,
    /// The sample completed none and followed a start or a gap: it is one of the two in which the chain begins anew.
    Beginning,
}

/// A probe that measures nothing.
struct NoProbe;

impl CostProbe for NoProbe {
    #[inline(always)]
    fn begin(&mut self) {}
    #[inline(always)]
    fn end(&mut self, _: SampleClass) {}
}

/// The chain, its state, and the health around them.
///
/// In memory in the order of declaration, for the reason that [`Chain`] states.
#[derive(Debug, Clone)]
#[repr(C)]
pub struct Processor<N: NumberSystem, T: Term<N> = ()> {
    state: ChainState<N, T>,
    chain: Chain<N, T>,
    slow: SlowWatch,
    pulses: PulseClock,
    health: Health,
    settings: Settings,
    /// Status bits of the boot, which are in every frame.
    boot: Status,
    /// Bits of the output period so far.
    pending: Status,
    /// Bits of this sampling period.
    of_period: Status,
    /// Sampling periods since start, wrapping.
    periods: u32,
    /// The start-up is over: faults are latched.
    in_service: bool,
    /// True if the first fault was latched in this output period, so that the chain may yet report an earlier one.
    first_is_of_this_output: bool,
    /// Place in [`HEALTH_ITEMS`] of the item that the next frame carries.
    next_item: u8,
}

/// Health items that do not change in service.
#[derive(Debug, Clone, Copy)]
struct Settings {
    sample_rate_hz: f32,
    samples_per_output: u32,
    generation: u32,
    configuration: u32,
    start_up_periods: u32,
    reset_cause: u32,
    last_failure_kind: u32,
    last_failure_place: u32,
    /// Unit, calibration date and model of the parameters, a word each; zeros without an identity.
    identity: [u32; 3],
    revision: u32,
    image: u32,
}

impl<N: NumberSystem> Processor<N> {
    /// Checks the parameters and builds a chain without terms. Runs at boot.
    pub fn new(parameters: &Parameters, boot: BootReport) -> Result<Self, ParameterError> {
        Self::with_terms(parameters, boot)
    }
}

impl<N: NumberSystem, T: Term<N>> Processor<N, T> {
    /// Checks the parameters and builds the chain with the terms `T`. Runs at boot.
    pub fn with_terms(parameters: &Parameters, boot: BootReport) -> Result<Self, ParameterError> {
        let terms = Chain::<N, T>::checked_terms(parameters)?;
        Ok(Self::of_terms(parameters, &terms, boot))
    }

    /// The processor of parameters that [`Chain::checked_terms`] has found in range. Nothing of it can fail, and it is
    /// inlined, so that it is built where it stays: it is large.
    #[inline(always)]
    pub fn of_terms(parameters: &Parameters, terms: &T, boot: BootReport) -> Self {
        let with = |bit: u32, set: bool| if set { bit } else { 0 };
        Self {
            chain: Chain::build(parameters, terms),
            state: ChainState::new(),
            slow: SlowWatch::new(parameters),
            pulses: PulseClock::new(parameters),
            health: Health::NONE,
            settings: Settings {
                sample_rate_hz: parameters.sample_rate_hz as f32,
                samples_per_output: u32::from(parameters.samples_per_output),
                generation: boot.generation,
                configuration: with(
                    item::WITH_ACCELEROMETERS,
                    parameters.accelerometers.is_some(),
                ) | with(item::ADAPTIVE, parameters.adaptation_time_s > 0.0)
                    | item::terms(T::KINDS),
                start_up_periods: (START_UP_LIMIT_S * parameters.sample_rate_hz) as u32,
                reset_cause: boot.reset_cause,
                last_failure_kind: boot.last_failure_kind,
                last_failure_place: boot.last_failure_place,
                identity: parameters.identity.as_ref().map_or([0; 3], Identity::words),
                revision: boot.revision,
                image: boot.image,
            },
            boot: Status::CLOCK_FALLBACK
                .when(boot.clock_fallback)
                .union(Status::PARAMETERS_DEFAULT.when(boot.parameters_default))
                .union(Status::PARAMETER_SLOT_BAD.when(boot.slot_bad))
                .union(Status::PARAMETERS_FOREIGN.when(boot.parameters_foreign)),
            pending: Status::default(),
            of_period: Status::default(),
            periods: 0,
            in_service: false,
            first_is_of_this_output: false,
            next_item: 0,
        }
    }

    /// Processes one sampling period, and the `timing.missed` periods before it.
    ///
    /// # Returns
    /// At most one frame. A gap can end one output period and the sample after it another: the second frame is then
    /// made with the next call, before that call's sample. If that call has a gap which ends one more (only with one or
    /// two samples an output, or after successive gaps longer than an output period), one frame reports both.
    #[inline]
    pub fn period(&mut self, reading: Reading, timing: Timing) -> Option<TelemetryFrame> {
        self.period_probed(reading, timing, &mut NoProbe)
    }

    /// [`Processor::period`], with `probe` called before and after the chain takes the sample.
    #[inline]
    pub fn period_probed(
        &mut self,
        reading: Reading,
        timing: Timing,
        probe: &mut impl CostProbe,
    ) -> Option<TelemetryFrame> {
        self.of_period = Status::default();
        let lost = (timing.missed).saturating_add(u32::from(reading.sample.is_none()));
        // In a call one frame is made at most: here, where the lost periods, if any, end no output period (none of it has
        // passed: the last sample ended one); or over lost periods that do; or with a sample where neither has made one.
        // The bound of the interrupt (docs/board.md) rests on that.
        let mut frame = None;
        if self.chain.is_due(&self.state) && !self.chain.end_one(lost) {
            core::hint::cold_path();
            let ended = self.chain.finish(&mut self.state);
            frame = Some(self.complete(ended));
        }
        if timing.missed > 0 || timing.late || reading.fault.is_some() {
            self.count_faults(&reading, timing);
        }
        // Two ways that do not meet: a call costs lost periods or the stages, not both.
        if lost > 0 {
            core::hint::cold_path();
            return self.resume(frame, lost, &reading, probe);
        }
        if let Some(mut sample) = reading.sample {
            self.serve(reading.service, reading.periods);
            // `black_box`: if the compiler shared this decision with the chain, the chain would have fewer registers.
            let beginning = core::hint::black_box(self.state.is_beginning());
            probe.begin();
            self.chain.take(&mut self.state, &mut sample);
            if self.chain.is_due(&self.state) && frame.is_none() {
                let ended = self.chain.finish(&mut self.state);
                probe.end(SampleClass::WithOutput);
                self.periods = self.periods.wrapping_add(1);
                frame = Some(self.complete(ended));
            } else {
                probe.end(if beginning {
                    SampleClass::Beginning
                } else {
                    SampleClass::BetweenOutputs
                });
                self.periods = self.periods.wrapping_add(1);
            }
        }
        frame
    }

    /// Processes `lost` periods, and then the sample that resumes, if there is one. `frame`: of this call, if it is made
    /// already.
    #[inline(never)]
    fn resume(
        &mut self,
        mut frame: Option<TelemetryFrame>,
        lost: u32,
        reading: &Reading,
        probe: &mut impl CostProbe,
    ) -> Option<TelemetryFrame> {
        if let Some(ended) = self.chain.process_lost(&mut self.state, lost) {
            frame = Some(self.complete(ended));
        }
        self.periods = self.periods.wrapping_add(lost);
        let Some(sample) = reading.sample else {
            return frame;
        };
        self.serve(reading.service, reading.periods);
        probe.begin();
        self.chain.begin_or_resume(&mut self.state, &sample);
        self.periods = self.periods.wrapping_add(1);
        if self.chain.is_due(&self.state) && frame.is_none() {
            let ended = self.chain.finish(&mut self.state);
            probe.end(SampleClass::WithOutput);
            frame = Some(self.complete(ended));
        } else {
            probe.end(SampleClass::Beginning);
        }
        frame
    }

    /// Hands readings that change slowly to the terms at once; they hold until the next ones. It costs as much as some
    /// samples: firmware whose interrupt runs prepares an update in its main loop ([`SlowTerms`]) and hands that over
    /// ([`take_slow`](Self::take_slow)).
    pub fn slow(&mut self, readings: &SlowReadings) {
        self.chain.slow(&mut self.state, readings);
        if readings.are_temperatures() {
            self.slow.own_thermometer(self.periods);
        }
    }

    /// The terms as the main loop needs them to prepare updates.
    pub fn slow_terms(&self) -> SlowTerms<N, T> {
        self.chain.slow_terms()
    }

    /// Takes an update that the main loop prepared: a copy, in the interrupt, from a queue of any kind.
    #[inline]
    pub fn take_slow(&mut self, update: &SlowUpdate<N, T>) {
        self.chain.take_slow(&mut self.state, update);
        if update.own_thermometer {
            self.slow.own_thermometer(self.periods);
        }
    }

    /// The increments of the sample of the last period, without waiting for a frame: [`Chain::increment`].
    pub fn increment(&self) -> SampleIncrement {
        self.chain.increment(&self.state)
    }

    /// The bank's slow channels.
    pub fn slow_channels(&self) -> &SlowWatch {
        &self.slow
    }

    /// The clock of the pulse per second.
    pub fn pulse_clock(&self) -> &PulseClock {
        &self.pulses
    }

    /// Takes slow channel and time of a frame, before its sample.
    #[inline(always)]
    fn serve(&mut self, service: BankService, periods: u32) {
        self.slow.take(service);
        let before = self.state.periods_in_output();
        self.pulses.take(service.since_pulse, periods, before);
    }

    /// Counts a frame of [`Processor::period`] that found no room.
    #[inline]
    pub fn output_overrun(&mut self) {
        self.health.output_overruns = self.health.output_overruns.saturating_add(1);
        self.raise(Status::OUTPUT_OVERRUN, self.periods.wrapping_sub(1));
    }

    /// Faults around the chain, and the first of all.
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// True once a fault in service has been seen.
    #[inline]
    pub fn has_latched_fault(&self) -> bool {
        self.health.first.stages != Status::default()
    }

    /// The chain's own counters.
    pub fn faults(&self) -> &Faults {
        self.state.faults()
    }

    /// The chain's state.
    pub fn state(&self) -> &ChainState<N, T> {
        &self.state
    }

    /// Status bits of the last period: the processor's own, and those of the frame of an output period that ended in
    /// it.
    pub fn period_status(&self) -> Status {
        self.of_period
    }

    /// Sampling periods since start, wrapping.
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// Every health item now, in the order of [`HEALTH_ITEMS`].
    pub fn health_items(&self) -> [u32; HEALTH_ITEMS.len()] {
        HEALTH_ITEMS.map(|index| self.value(index))
    }

    /// Counts the faults of this period's reading and interrupt.
    #[inline(never)]
    fn count_faults(&mut self, reading: &Reading, timing: Timing) {
        let health = &mut self.health;
        let add = |counter: &mut u32, events: u32| *counter = counter.saturating_add(events);
        let mut raised = Status::INTERRUPT_MISSED
            .when(timing.missed > 0)
            .union(Status::INTERRUPT_LATE.when(timing.late));
        add(&mut health.interrupts_missed, timing.missed);
        add(&mut health.interrupts_late, u32::from(timing.late));
        match reading.fault {
            None => {}
            Some(SourceFault::Bus) => {
                add(&mut health.bus_faults, 1);
                raised = raised.union(Status::BUS_FAULT);
            }
            Some(SourceFault::StuckLine) => {
                add(&mut health.bus_faults, 1);
                add(&mut health.stuck_lines, 1);
                raised = raised.union(Status::BUS_FAULT);
            }
            Some(SourceFault::Checksum) => {
                add(&mut health.frame_checksums, 1);
                raised = raised.union(Status::FRAME_CHECKSUM);
            }
            Some(SourceFault::Repeated) => {
                add(&mut health.samples_repeated, 1);
                raised = raised.union(Status::SAMPLE_REPEATED);
            }
            Some(SourceFault::Starved) => {
                add(&mut health.samples_starved, 1);
                raised = raised.union(Status::SAMPLE_LOST);
            }
            Some(SourceFault::Restarted) => {
                add(&mut health.bank_restarts, 1);
                raised = raised.union(Status::BANK_RESTARTED);
                self.chain.restart(&mut self.state);
            }
        }
        // The first period that the fault concerns, as the chain counts it.
        self.raise(raised, self.periods);
    }

    /// Raises status bits for this period and its output period, and latches the first fault.
    fn raise(&mut self, raised: Status, period: u32) {
        self.of_period = self.of_period.union(raised);
        self.pending = self.pending.union(raised);
        if self.in_service && !self.has_latched_fault() && raised != Status::default() {
            self.health.first = FirstFault {
                stages: raised,
                sample: period,
            };
            self.first_is_of_this_output = true;
        }
    }

    /// Completes an output frame with status and health item.
    #[inline(never)]
    fn complete(&mut self, mut output: OutputFrame) -> TelemetryFrame {
        let found = self.slow.conclude(self.periods);
        let found = found.union(Status::PULSE_LOST.when(self.pulses.has_lost()));
        if found != Status::default() {
            core::hint::cold_path();
            self.health.count_service(found);
            self.raise(found, self.periods.wrapping_sub(1));
        }
        let pending = core::mem::take(&mut self.pending);
        output.status = output.status.union(pending).union(self.boot);
        self.of_period = self.of_period.union(output.status);
        if self.in_service {
            self.adopt_earlier_fault_of_chain();
        } else {
            self.state.forget_first_fault();
            self.in_service = self.chain.has_started(&self.state)
                || self.periods >= self.settings.start_up_periods;
        }

        let index = *HEALTH_ITEMS.get(usize::from(self.next_item)).unwrap_or(&0);
        self.next_item = match usize::from(self.next_item) + 1 {
            next if next < HEALTH_ITEMS.len() => next as u8,
            _ => 0,
        };
        let value = self.value(index);
        TelemetryFrame {
            time: self.pulses.conclude(),
            ..TelemetryFrame::new(output, HealthItem { index, value })
        }
    }

    /// Takes over the chain's first fault if it is earlier. The chain reports faults only at the end of an output
    /// period, with the sample of the first: that may be before the one that the processor latched in the same period.
    fn adopt_earlier_fault_of_chain(&mut self) {
        let chain = self.state.faults().first;
        let first = &mut self.health.first;
        if chain.stages != Status::default() {
            if first.stages == Status::default() {
                *first = chain;
            } else if self.first_is_of_this_output {
                let lead = first.sample.wrapping_sub(chain.sample) as i32;
                if lead > 0 {
                    *first = chain;
                } else if lead == 0 {
                    first.stages = first.stages.union(chain.stages);
                }
            }
        }
        self.first_is_of_this_output = false;
    }

    /// The value of health item `index`, table in [`health`](crate::unit::health).
    fn value(&self, index: u8) -> u32 {
        match index {
            item::FIRST_FAULT_STATUS => self.health.first.stages.bits(),
            item::FIRST_FAULT_PERIOD => self.health.first.sample,
            item::VERSION => const { version_word::<N>() },
            item::SAMPLE_RATE => self.settings.sample_rate_hz.to_bits(),
            item::SAMPLES_PER_OUTPUT => self.settings.samples_per_output,
            item::GENERATION => self.settings.generation,
            item::CONFIGURATION => self.settings.configuration,
            item::PERIODS => self.periods,
            item::STUCK_LINES => self.health.stuck_lines,
            item::RESET_CAUSE => self.settings.reset_cause,
            item::LAST_FAILURE_KIND => self.settings.last_failure_kind,
            item::LAST_FAILURE_PLACE => self.settings.last_failure_place,
            item::PULSES => self.pulses.pulses(),
            item::SECOND => self.pulses.second(),
            item::UNIT => self.settings.identity[0],
            item::CALIBRATED => self.settings.identity[1],
            item::MODEL => self.settings.identity[2],
            item::REVISION => self.settings.revision,
            item::IMAGE => self.settings.image,
            // Its holder is the main loop (`SelfTest::show_in`).
            item::SELF_TEST => 0,
            channel if channel >= item::SLOW_CHANNEL => {
                i32::from(self.slow.code(channel - item::SLOW_CHANNEL)).cast_unsigned()
            }
            bit => self.health.counter(self.state.faults(), bit),
        }
    }
}

/// Version of this library with the number system `N`, as health item 34.
pub const fn version_word<N: NumberSystem>() -> u32 {
    VERSION | matches!(N::NAME.as_bytes(), b"fixed") as u32
}

/// Major, minor and patch of the package, a byte each above the lowest.
const VERSION: u32 = u32::from_be_bytes([
    decimal(env!("CARGO_PKG_VERSION_MAJOR")),
    decimal(env!("CARGO_PKG_VERSION_MINOR")),
    decimal(env!("CARGO_PKG_VERSION_PATCH")),
    0,
]);

/// A number of decimal digits, at compile time.
const fn decimal(digits: &str) -> u8 {
    match u8::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a version number beyond 255"),
    }
}

/// A sample is copied, not referenced, into a [`Reading`]; it must stay small.
const _: () = assert!(size_of::<Sample>() <= 40);
