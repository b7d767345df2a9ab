//! Prints the settings that the firmware was built with, when its binary is run on the host.
//!
//! The lines on standard output give rates, formats and versions, each from the constant that the image itself uses.

use trueaxis::design_parameters::DESIGN_SAMPLE_RATE_HZ;
use trueaxis::parameter_block::LARGEST_BLOCK_BYTES;
use trueaxis::terms::TermKinds;
use trueaxis::{
    Chain, ChainState, NumberSystem, OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE, OutputFrame,
    PARAMETER_BLOCK_BYTES, Parameters, Sample, Term, TermKind, counter_bank, run_report, telemetry,
};

/// Prints the settings of the image `binary` with number system `N`.
pub fn print<N: NumberSystem, T: Term<N>>(binary: &str) {
    let defaults = Parameters::default();
    println!("trueaxis {} {binary}", env!("CARGO_PKG_VERSION"));
    println!("number system        {}", N::NAME);
    println!(
        "sample rate          {DESIGN_SAMPLE_RATE_HZ} Hz by design; the parameter block decides"
    );
    println!(
        "output rate          {} Hz by default (every {} samples)",
        defaults.sample_rate_hz / f64::from(defaults.samples_per_output),
        defaults.samples_per_output
    );
    println!("output codes         {OUTPUT_RAD_PER_CODE:e} rad, {OUTPUT_M_S_PER_CODE:e} m/s");
    println!(
        "sample layout        version {}, {} bytes",
        Sample::LAYOUT_VERSION,
        Sample::BYTES
    );
    println!(
        "output frame layout  version {}, {} bytes",
        OutputFrame::LAYOUT_VERSION,
        OutputFrame::BYTES
    );
    println!("parameter block      {PARAMETER_BLOCK_BYTES} to {LARGEST_BLOCK_BYTES} bytes");
    let names = names(T::KINDS);
    println!(
        "optional terms       {}",
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    );
    println!(
        "counter bank frame   version {}, {} bytes",
        counter_bank::BANK_FRAME_VERSION,
        counter_bank::FRAME_BYTES
    );
    println!(
        "telemetry frame      version {}, {} bytes",
        telemetry::TELEMETRY_VERSION,
        telemetry::TELEMETRY_BYTES
    );
    println!(
        "run report           version {}, {} bytes",
        run_report::RUN_REPORT_VERSION,
        run_report::RunReport::BYTES
    );
    println!(
        "chain                {} bytes of configuration, {} of state",
        size_of::<Chain<N, T>>(),
        size_of::<ChainState<N, T>>()
    );
}

/// Names of the kinds. Not inlined: over the loop unrolled for known kinds, LLVM 22's constraint elimination takes minutes.
#[inline(never)]
fn names(kinds: TermKinds) -> Vec<&'static str> {
    let all = TermKind::ALL.iter();
    all.filter(|kind| kinds.contains(**kind))
        .map(|kind| kind.name())
        .collect()
}
