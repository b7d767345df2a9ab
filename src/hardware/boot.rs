//! From flash to a processor that is ready: what both images do before the first sample.
//!
//! Enters: the parameter slots, and whether the clock is the one that was asked for. Leaves: the parameters
//! and, when it is asked for, the [`Processor`], which says in every frame what was wrong at boot.

use trueaxis::parameter_slots::ParameterSlots;
use trueaxis::processor::{BootReport, Processor};
use trueaxis::{NumberSystem, Parameters};

use super::flash::{SECTOR_BYTES, SlotFlash};
use crate::Core;

/// What the boot leaves.
pub struct Booted {
    /// In force.
    pub parameters: Parameters,
    report: BootReport,
}

impl Booted {
    /// The chain with its health. Not made before it has a place: it is large, and would lie on the stack
    /// below all that the boot calls.
    #[inline]
    pub fn processor(&self) -> Processor<Core> {
        // Parameters from a slot were checked, and the default ones pass (host-tests); a panic here would be
        // latched and seen.
        let Ok(processor) = Processor::new(&self.parameters, self.report) else {
            panic!("the parameters in force are refused");
        };
        processor
    }
}

/// Loads the parameters and mends a slot that is bad.
#[inline(never)]
pub fn boot(flash: SlotFlash, clock_fallback: bool) -> Booted {
    let mut slots = ParameterSlots::new(flash, [0, SECTOR_BYTES]);
    let loaded = slots.load();
    defmt::info!(
        "boot: core {=str}, parameter generation {=u32}, default values {=bool}, clock fallback {=bool}",
        <Core as NumberSystem>::NAME,
        loaded.generation,
        loaded.parameters_default(),
        clock_fallback
    );
    if loaded.slot_bad {
        match slots.mend() {
            Ok(_) => defmt::warn!("a parameter slot was bad and is mended"),
            Err(fault) => defmt::error!("a parameter slot is bad and cannot be mended: {}", fault),
        }
    }
    let report = BootReport {
        clock_fallback,
        parameters_default: loaded.parameters_default(),
        slot_bad: loaded.slot_bad,
        generation: loaded.generation,
    };
    Booted {
        parameters: loaded.parameters,
        report,
    }
}
