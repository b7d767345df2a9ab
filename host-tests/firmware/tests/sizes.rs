//! The library's table of sizes against the compiler, and that every error is an error.

use std::collections::BTreeMap;
use std::error::Error;

use trueaxis::counter_bank::BusFault;
use trueaxis::parameter_slots::SlotError;
use trueaxis::sample_source::{Reading, SourceFault};
use trueaxis::trace::TraceRing;
use trueaxis::{
    BankDecoder, BlockError, Chain, ChainState, Decoder, DitherMonitor, F32, Fixed, FrameError,
    OutputFrame, ParameterError, Parameters, Processor, Sample, TelemetryError, TelemetryFrame,
};

/// The rows of the table in the library's first page: type, and bytes.
fn documented() -> BTreeMap<String, usize> {
    let page = include_str!("../../../src/lib.rs");
    let (_, from_heading) = page.split_once("//! # Sizes\n").expect("the heading");
    let rows = from_heading
        .lines()
        .skip_while(|line| !line.starts_with("//! |"));
    let rows = rows.take_while(|line| line.starts_with("//! |")).skip(2);
    rows.map(|row| {
        let mut cells = row.split('|').skip(1).map(str::trim);
        let (name, bytes) = (cells.next(), cells.next());
        let name = name.expect("a type").replace(['`', '[', ']'], "");
        let bytes = bytes.expect("bytes").replace(' ', "");
        (name, bytes.parse().expect("a number"))
    })
    .collect()
}

#[test]
fn types_have_the_sizes_that_the_library_documents() {
    let measured = [
        ("Processor<F32>", size_of::<Processor<F32>>()),
        ("Processor<Fixed>", size_of::<Processor<Fixed>>()),
        ("Chain<F32>", size_of::<Chain<F32>>()),
        ("Chain<Fixed>", size_of::<Chain<Fixed>>()),
        ("ChainState<F32>", size_of::<ChainState<F32>>()),
        ("ChainState<Fixed>", size_of::<ChainState<Fixed>>()),
        ("Parameters", size_of::<Parameters>()),
        ("BankDecoder", size_of::<BankDecoder>()),
        ("DitherMonitor", size_of::<DitherMonitor>()),
        ("TraceRing<256>", size_of::<TraceRing<256>>()),
        ("Sample", size_of::<Sample>()),
        ("Reading", size_of::<Reading>()),
        ("OutputFrame", size_of::<OutputFrame>()),
        ("TelemetryFrame", size_of::<TelemetryFrame>()),
    ];
    for (name, bytes) in measured {
        println!("//! | `{name}` | {bytes} |");
    }
    let measured: BTreeMap<String, usize> = measured
        .into_iter()
        .map(|(name, bytes)| (name.to_owned(), bytes))
        .collect();
    assert_eq!(documented(), measured);
    // The telemetry decoder, which runs on the listener's side, counts in `usize`.
    assert!(size_of::<Decoder>() <= 128);
}

#[test]
fn every_error_says_what_is_wrong_in_words_of_its_own() {
    let errors: [Box<dyn Error>; 18] = [
        Box::new(ParameterError::Bias),
        Box::new(BlockError::Magic),
        Box::new(BlockError::Version(9)),
        Box::new(BlockError::Parameter(ParameterError::LeverArm)),
        Box::new(SlotError::<BusFault>::Layout),
        Box::new(SlotError::Flash(BusFault)),
        Box::new(SlotError::<BusFault>::Parameter(ParameterError::Flexure)),
        Box::new(FrameError::Version(9)),
        Box::new(TelemetryError::Header),
        Box::new(TelemetryError::Checksum),
        Box::new(BusFault),
        Box::new(SourceFault::Bus),
        Box::new(SourceFault::StuckLine),
        Box::new(SourceFault::Checksum),
        Box::new(SourceFault::Repeated),
        Box::new(SourceFault::Restarted),
        Box::new(SourceFault::Starved),
        Box::new(SlotError::<BusFault>::Verify),
    ];
    let mut said: Vec<String> = errors.iter().map(ToString::to_string).collect();
    let words = |said: &String| said.split_whitespace().count();
    assert!(said.iter().all(|said| words(said) >= 3), "{said:#?}");
    assert!(
        said.iter()
            .any(|words| words.contains("version 9, expected"))
    );
    said.sort();
    said.dedup();
    assert_eq!(said.len(), errors.len());
}
