//! `trueaxis`: the chain that keeps each ring-laser gyro's sensing axis true.
//!
//! The name is the purpose: a dithered block lags its case under angular acceleration, the
//! sensing axis tilts by δ = −K α, and the chain turns the tilted reading back to the true body axis.
//!
//! # Input and output
//! Every period T (250 µs at 4 kHz) one [`Sample`] enters: the pulses each gyro counted over the period
//! (block dither included), the pickoff's reading of each block's angle at the period's end, and the codes of
//! accelerometers, where there are any. Every `samples_per_output` periods one [`OutputFrame`] leaves: the
//! rotation vector of the case over those periods and the velocity increment by specific force, both in the
//! body frame at their start, in codes of [`OUTPUT_RAD_PER_CODE`] and [`OUTPUT_M_S_PER_CODE`].
//!
//! # The data flow
//! [`Chain::process`] in `chain.rs` is this list, line by line; each stage is a file of `chain/stages/`, a
//! configuration that was checked once and (where it remembers) a state, joined by a pure `process`.
//!
//! ```text
//!  pulse counts ─ counts ─▶ Δθ sensed ─ dither, adaptation ─▶ − h Δpickoff
//!                                                                 │
//!          ┌──────────────────────────────────────────────────────┤
//!          ▼                                                      ▼
//!  Σ Δθ − Σ N(−K α) Δθ ◀─ flexure ◀──────────────── case Δθ ◀─ compensation(ε0)
//!          │                                           │
//!          ▼                                           ├────────────────────────────┐
//!  M (Σ Δθ − …) + β ◀───────────── coning ◀────────────┘                             │
//!          │                                                                         │
//!          └─ frame ─▶ OutputFrame ◀─ frame ─ C (Σ Δv + S) − [C L ω]                 │
//!                                                      ▲                             │
//!  accelerometer codes ─ velocity ─▶ Δv ─ sculling, size_effect, turning ◀───────────┘
//! ```
//! Equation numbers are those of Cheng et al. 2023, with the signs of its Eq. (6) settled as in
//! [`stages::flexure`].
//!
//! # Two number systems, one text
//! The stages are written once over [`NumberSystem`]; [`F32`] and [`Fixed`] define increment, coefficient and product
//! (`chain/numbers/`: formats, ranges, rounding). In both, increments are factors of products alone; sums over an
//! output period are exact, in whole numbers ([`numbers::exact`]), and any part beyond a frame's range or resolution
//! follows in the next ones. So nothing drifts: at most 1e-4 °/h against the equations in f64
//! (`host-tests/firmware/tests/core_chain`).
//!
//! # From twenty samples to a frame
//! ```
//! use trueaxis::{Chain, ChainState, F32, OUTPUT_RAD_PER_CODE, Parameters, Sample, Status};
//!
//! let parameters = Parameters::default().with(|p| {
//!     p.pulse_weight_rad = [2.0e-6; 3];
//!     p.samples_per_output = 20;
//! });
//! let chain = Chain::<F32>::new(&parameters)?;
//! let mut state = ChainState::new();
//!
//! // 100 pulses a period of 250 µs about x: 0.8 rad/s.
//! let sample = Sample {
//!     pulse_counts: [100, 0, 0],
//!     ..Sample::default()
//! };
//! let mut frames = (0..20).filter_map(|_| chain.process(&mut state, &sample));
//! let frame = frames.next().expect("a frame at the output period's end");
//! assert!(frame.status.contains(Status::PRIMED));
//!
//! // The stream's first sample only primes the dither strip: 19 periods of rotation.
//! let [x, y, z] = frame.dtheta_codes.map(|code| f64::from(code) * OUTPUT_RAD_PER_CODE);
//! assert!((x - 19.0 * 100.0 * 2.0e-6).abs() < OUTPUT_RAD_PER_CODE);
//! assert_eq!((y, z), (0.0, 0.0));
//! # Ok::<(), trueaxis::ParameterError>(())
//! ```
//! `examples/` has whole firmware for RTIC and for Embassy. There [`processor::Processor`] runs the chain: it also
//! counts faults and reports them with each frame.
//!
//! # Guarantees
//! [`Chain::process`] allocates nothing, returns no `Result`, cannot panic whatever bits enter, and costs
//! the same for every sample but the output period's last (no branch depends on data). A value beyond its
//! stage's range is held at the range's end and counted in [`Faults`]; the first one stays latched.
//! The same sample stream gives the same bits on every machine: only + − × and integer operations, and
//! for rounding one library (`libm`).
//!
//! # Sizes
//! In memory \[bytes\], the same on the target and on a host of 64 bits; `host-tests/firmware/tests/sizes.rs` holds this
//! table.
//!
//! | type | bytes | how many |
//! |---|---|---|
//! | `Processor<F32>` | 2000 | one: chain, state and health |
//! | `Processor<Fixed>` | 2160 | |
//! | `Chain<F32>` | 824 | in the processor |
//! | `Chain<Fixed>` | 856 | |
//! | `ChainState<F32>` | 840 | in the processor |
//! | `ChainState<Fixed>` | 968 | |
//! | `Parameters` | 1760 | at boot; 664 in a build without terms |
//! | `BankDecoder` | 40 | one |
//! | `DitherMonitor` | 56 | one |
//! | `TraceRing<256>` | 13332 | one, of as many entries as are wanted |
//! | `Sample` | 36 | a period |
//! | `Reading` | 56 | a period |
//! | `OutputFrame` | 32 | an output period |
//! | `TelemetryFrame` | 52 | an output period, and each place of its queue |
//!
//! # Health, time and identity
//! The bank's frames bring slow channels and the time since a pulse per second beside each sample: [`slow_channels`] has
//! their limits and status bits, [`pulse_clock`] the time of each frame, and [`SlowTerms`] prepares in the main loop what
//! terms make of temperatures. The parameter block may name its unit ([`Identity`]); another unit refuses it. A built-in test puts
//! its results ([`SelfTest`]) into frames; `store/flash_check.rs` compares the running image with its check sum.
//!
//! # Stability
//! [`Term`] is open: firmware may add terms of its own. Its methods have defaults but for `new`, and new ones will have
//! some. [`NumberSystem`] and [`counter_bank::WireBytes`] are sealed. Structs and errors that may grow are
//! `non_exhaustive`: they are made by `new`, `default` and `with`.
//!
//! # libm or micromath
//! `libm` where accuracy decides: rounding in the frame stage and the conversion of parameters at boot are
//! exact operations and must stay so. `micromath` has the square root of `DitherMonitor` alone, whose amplitude is a
//! health figure: it is off by 6 %. It is kept for one root because that runs in the main loop of images without terms, where
//! `libm`'s root of an f32 would be the only code that uses it; without the feature `monitor` the crate is not compiled. Two other figures of the dither would need functions whose errors are too large in it:
//!
//! | health item | function | off by | asked |
//! |---|---|---|---|
//! | dither frequency from its cosine | `acos` | 6 % | 0.1 %: the suspension's resonance moves by parts of a per cent |
//! | pickoff phase from tracked gain and quadrature | `atan2` | 2.8 mrad | 2.5 mrad: 1 µs at 400 Hz |
//!
//! `cargo test --release -p firmware-tests --test core_chain monitor -- --nocapture` prints these errors, and those of `libm`.
//!
//! # Around the chain
//! [`processor::Processor`] runs in the sampling interrupt: it takes a reading of the counter bank and its own timing,
//! advances the chain over samples that did not come, counts every fault and makes the telemetry frame.
//!
//! # Outside its scope
//! The navigation itself; effects other than bias, scale, installation, pickoff gain and delay and axis flexure, of
//! accelerometers bias, scale, misalignment and size effect, and those of the optional [`terms`].
#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "proof")]
extern crate std;

pub mod chain;

pub mod unit;

#[cfg(feature = "wire")]
pub mod wire;

#[cfg(feature = "slots")]
pub mod store;

#[cfg(feature = "wire")]
pub mod board_state;

#[cfg(all(feature = "slots", feature = "wire"))]
pub mod service;

#[cfg(feature = "monitor")]
pub use chain::dither_monitor::{self, DitherMonitor};
pub use chain::{
    Chain, ChainState, design_parameters, faults, health_limits, identity, numbers, output_format,
    parameters, sample, stages, terms, triad,
};
#[cfg(feature = "slots")]
pub use store::{
    flash_check, image, image_journal, image_layout, image_slots, image_state, image_upload,
    parameter_block, parameter_slots, upload,
};
#[cfg(feature = "bank")]
pub use unit::{bank_bus, counter_bank};
pub use unit::{
    clock_start, health, processor, pulse_clock, raw_period, sample_source, self_test,
    slow_channels, telemetry_frame, trace,
};
#[cfg(all(feature = "wire", feature = "bank"))]
pub use wire::bank_record;
#[cfg(feature = "wire")]
pub use wire::{frame_finder, inertial_message, raw_frame, run_report, service_frame, telemetry};

#[cfg(feature = "bank")]
pub use bank_bus::CounterBank;
#[cfg(feature = "bank")]
pub use counter_bank::BankDecoder;
pub use design_parameters::{OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE};
pub use faults::{Faults, FirstFault, Status};
pub use health::{Health, HealthItem};
pub use health_limits::HealthLimits;
pub use identity::{Identity, UnitNumber};
pub use numbers::{F32, Fixed, NumberSystem};
pub use output_format::OutputFormat;
#[cfg(feature = "slots")]
pub use parameter_block::{BlockError, PARAMETER_BLOCK_BYTES};
pub use parameters::{AccelerometerParameters, FlexureResponse, ParameterError, Parameters};
pub use processor::{BootReport, Processor, Timing};
pub use pulse_clock::FrameTime;
pub use sample::{FrameError, OutputFrame, Sample, SampleIncrement};
pub use self_test::SelfTest;
pub use slow_channels::{BankService, SlowFilter, SlowMailbox};
#[cfg(feature = "wire")]
pub use telemetry::{Decoder, TELEMETRY_BYTES, TelemetryError};
pub use telemetry_frame::TelemetryFrame;
pub use terms::{SlowReadings, SlowTerms, SlowUpdate, Term, TermKind, TermRecords};
pub use triad::{CrossAxis, Triad};

/// Revision of this library that the build was made of: the first 28 bits of git's hash, and bit 0 for a tree with changes;
/// 0 in a build without the feature `board`, or outside a git tree.
pub const REVISION: u32 = match option_env!("TRUEAXIS_REVISION") {
    Some(hexadecimal) => match u32::from_str_radix(hexadecimal, 16) {
        Ok(revision) => revision,
        Err(_) => panic!("the build script gave no number"),
    },
    None => 0,
};
