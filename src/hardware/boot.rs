//! Makes a ready processor from the parameters in flash: the boot of both images, before the first sample.
//!
//! It takes the parameter slots and the findings on clock, reset and previous run. It loads the parameters and makes of
//! them, on request, the [`Processor`], whose frames report the faults of the boot.

use core::sync::atomic::{AtomicU32, Ordering};

use trueaxis::parameter_slots::{Loaded, MEND_ATTEMPTS, Mending, ParameterSlots};
use trueaxis::processor::{BootReport, Processor};
use trueaxis::{Chain, NumberSystem, Term};

use super::flash::{SECTOR_BYTES, SlotFlash};
use crate::{Core, Terms};

/// The kinds of optional terms that this image has, as [`TermKinds::bits`](trueaxis::terms::TermKinds::bits), for tools
/// that read the image's file. The name stands in the image as it is.
#[unsafe(no_mangle)]
static TERM_KINDS: AtomicU32 = AtomicU32::new(<Terms as Term<Core>>::KINDS.bits());

/// Parameters that were checked, as the terms that they make.
pub struct Checked(pub(super) Terms);

/// Checks parameters that were loaded. Called before [`processor`], not within: the checks' part of the stack is free
/// again when the processor is built.
#[inline(never)]
pub fn checked(loaded: &Loaded) -> Checked {
    // Parameters from a slot were checked, and the default ones pass (host-tests); a panic here would be
    // latched and seen.
    let Ok(terms) = Chain::<Core, Terms>::checked_terms(&loaded.parameters) else {
        panic!("the parameters in force are refused");
    };
    Checked(terms)
}

/// Builds the chain with its health from parameters that were loaded. Called where the result has its final place: it is
/// large, and built earlier it would lie on the stack during all of the boot.
#[inline]
pub fn processor(loaded: &Loaded, checked: &Checked, report: BootReport) -> Processor<Core, Terms> {
    Processor::of_terms(&loaded.parameters, &checked.0, report)
}

/// Loads the parameters and mends a slot that is bad.
///
/// # Inputs
/// `supply_suffices`: the supply is known to be high enough for erasing and programming flash. `before`: findings so
/// far, on clock, reset and previous run. `loaded`: place for the parameters; they are large, and copies of them would
/// lie on the stack.
///
/// # Returns
/// Findings so far, with those of this step.
#[inline(never)]
pub fn boot(
    loaded: &mut Loaded,
    flash: SlotFlash,
    supply_suffices: bool,
    before: BootReport,
) -> BootReport {
    let mut slots = ParameterSlots::new(flash, [0, SECTOR_BYTES]).accepting::<Chain<Core, Terms>>();
    slots.load_into(loaded);
    defmt::info!(
        "boot: core {=str}, terms {=u32:x}, parameter generation {=u32}, default values {=bool}, clock fallback {=bool}",
        <Core as NumberSystem>::NAME,
        TERM_KINDS.load(Ordering::Relaxed),
        loaded.generation,
        loaded.parameters_default(),
        before.clock_fallback
    );
    if loaded.slot_bad {
        match slots.mend(supply_suffices) {
            Ok(Mending::Done) => defmt::warn!("a parameter slot was bad and is mended"),
            Ok(Mending::SupplyLow) => {
                defmt::warn!("a parameter slot is bad; the supply is too low to mend it");
            }
            Ok(Mending::Exhausted) => defmt::error!(
                "a parameter slot is bad; {=usize} attempts did not mend it",
                MEND_ATTEMPTS
            ),
            // A second reading found both good, or none.
            Ok(Mending::NotNeeded) => {
                defmt::warn!("a parameter slot read as bad once and not again")
            }
            Err(fault) => defmt::error!("a parameter slot is bad and cannot be mended: {}", fault),
        }
    }
    before.with(|report| {
        report.parameters_default = loaded.parameters_default();
        report.slot_bad = loaded.slot_bad;
        report.generation = loaded.generation;
        report.parameters_foreign = loaded.foreign.is_some();
    })
}
