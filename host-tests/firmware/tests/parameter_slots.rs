//! The parameter slots over a NOR flash that loses power at every step.
//!
//! The flash is [`firmware_tests::nor`].

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use firmware_tests::nor::{LEFTOVERS, Leftover, Nor, PowerLost, SECTOR, SLOTS};
use proptest::prelude::*;
use trueaxis::Parameters;
use trueaxis::parameter_slots::{
    Loaded, MEND_ATTEMPTS, MEND_MARKS_OFFSET, Mending, ParameterSlots, Slot, SlotError,
};

fn slots<const UNIT: usize>(flash: Nor<UNIT>) -> ParameterSlots<Nor<UNIT>> {
    ParameterSlots::new(flash, [0, SECTOR as u32])
}

fn load<const UNIT: usize>(flash: &Nor<UNIT>) -> Loaded {
    slots(flash.rebooted()).load()
}

/// Distinguishable parameters.
fn parameters(number: u32) -> Parameters {
    Parameters::default().with(|p| p.bias_rad_s = [1e-6 * f64::from(number + 1), -2e-6, 3e-6])
}

/// A flash that has been given `parameters(0)` up to `parameters(stores - 1)`.
fn after_stores<const UNIT: usize>(stores: u32) -> Nor<UNIT> {
    let mut flash = Nor::erased();
    for number in 0..stores {
        let mut slots = slots(flash);
        slots.store(&parameters(number)).expect("power holds");
        flash = slots.release().rebooted();
    }
    flash
}

/// Steps of one store on this flash with power.
fn steps_of_a_store<const UNIT: usize>(flash: &Nor<UNIT>) -> usize {
    let mut slots = slots(flash.rebooted());
    slots.store(&parameters(99)).expect("power holds");
    slots.release().steps
}

/// Loses power at every step of a store, with every kind of leftover; the next boot finds the old or the new block.
/// Returns the number of times of each.
fn cuts_of_a_store<const UNIT: usize>(flash: &Nor<UNIT>, old: Option<u32>) -> (usize, usize) {
    let expected_old = old.map_or_else(Parameters::default, parameters);
    let new = parameters(99);
    let (mut kept, mut replaced) = (0, 0);
    for leftover in LEFTOVERS {
        for cut in 0..steps_of_a_store(flash) {
            let mut store = slots(flash.failing_after(cut, leftover, cut as u64));
            assert_eq!(store.store(&new), Err(SlotError::Flash(PowerLost)));
            let mut left = store.release().rebooted();

            let found = load(&left);
            if found.parameters == new {
                replaced += 1;
            } else {
                assert_eq!(found.parameters, expected_old, "cut at {cut}, {leftover:?}");
                assert_eq!(found.parameters_default(), old.is_none());
                kept += 1;
            }

            // Mending changes no parameter and leaves two good slots; a store then succeeds as ever.
            let mut mended = slots(left);
            let expected = if found.slot_bad {
                Mending::Done
            } else {
                Mending::NotNeeded
            };
            assert_eq!(mended.mend(true), Ok(expected));
            let after = mended.load();
            assert_eq!(after.parameters, found.parameters);
            assert!(!after.slot_bad);
            mended.store(&new).expect("power holds");
            assert_eq!(mended.load().parameters, new);
            left = mended.release();
            assert!(!load(&left).parameters_default());
        }
    }
    (kept, replaced)
}

#[test]
fn power_lost_at_any_step_of_a_store_leaves_the_old_or_the_new_block() {
    fn with_units_of<const UNIT: usize>() {
        for stores in [1, 2, 3] {
            let flash = after_stores::<UNIT>(stores);
            let (kept, replaced) = cuts_of_a_store(&flash, Some(stores - 1));
            println!(
                "units of {UNIT}, after {stores} stores: {kept} cuts found the old block, {replaced} the new"
            );
            assert!(kept > 3 * SECTOR);
        }
    }
    with_units_of::<1>();
    with_units_of::<4>();
    with_units_of::<8>();
    with_units_of::<32>();
}

#[test]
fn power_lost_in_the_very_first_store_leaves_the_nominal_values_and_the_flag() {
    let (kept, _) = cuts_of_a_store(&Nor::<4>::erased(), None);
    assert!(kept > 3 * SECTOR);
}

/// The first slot holds `parameters(0)`; the second was written halfway when power failed.
fn with_one_slot_bad<const UNIT: usize>() -> Nor<UNIT> {
    let whole = after_stores::<UNIT>(1);
    let mut interrupted = slots(whole.failing_after(SECTOR + 100, Leftover::Old, 3));
    interrupted.store(&parameters(5)).expect_err("power fails");
    let mut flash = interrupted.release().rebooted();
    flash.erasures = [0; SLOTS];
    assert!(load(&flash).slot_bad);
    flash
}

/// Attempts that the first slot's marks show.
fn attempts<const UNIT: usize>(flash: &Nor<UNIT>) -> usize {
    let marks = &flash.content[MEND_MARKS_OFFSET as usize..][..32 * MEND_ATTEMPTS];
    let (marks, _) = marks.as_chunks::<32>();
    let made = |mark: &&[u8; 32]| mark.iter().any(|byte| *byte != 0xFF);
    marks.iter().filter(made).count()
}

#[test]
fn power_lost_at_any_step_of_mending_changes_no_parameter() {
    fn with_units_of<const UNIT: usize>() {
        let flash = with_one_slot_bad::<UNIT>();
        let mut mended = slots(flash.rebooted());
        assert_eq!(mended.mend(true), Ok(Mending::Done));
        assert!(!mended.load().slot_bad);
        let steps = mended.release().steps;
        for leftover in LEFTOVERS {
            for cut in 0..steps {
                let mut mend = slots(flash.failing_after(cut, leftover, cut as u64));
                assert_eq!(mend.mend(true), Err(SlotError::Flash(PowerLost)));
                let left = mend.release().rebooted();
                let found = load(&left);
                assert_eq!(found.parameters, parameters(0), "cut at {cut}");
                assert_eq!(found.slot, Some(Slot::First));
                // Every erasure was counted before.
                assert!(left.erasures[1] <= attempts(&left), "cut at {cut}");
                assert_eq!(left.erasures[0], 0);
            }
        }
    }
    with_units_of::<1>();
    with_units_of::<4>();
    with_units_of::<8>();
    with_units_of::<32>();
}

#[test]
fn a_worn_out_slot_is_erased_three_times_in_all() {
    let mut flash = with_one_slot_bad::<4>();
    flash.worn = Some(1);
    for boot in 0..20 {
        let mut slots = slots(flash.rebooted());
        let expected = if boot < MEND_ATTEMPTS {
            Err(SlotError::Verify)
        } else {
            Ok(Mending::Exhausted)
        };
        assert_eq!(slots.mend(true), expected, "boot {boot}");
        let found = slots.load();
        assert_eq!(found.parameters, parameters(0));
        assert!(found.slot_bad, "the flag stays");
        flash = slots.release();
    }
    assert_eq!(flash.erasures, [0, 3]);
}

#[test]
fn a_board_that_browns_out_in_every_mend_erases_three_times_in_all() {
    for cut in [
        0,
        1,
        31,
        32,
        33,
        500,
        SECTOR + 31,
        SECTOR + 32,
        SECTOR + 300,
    ] {
        for leftover in LEFTOVERS {
            let mut flash = with_one_slot_bad::<4>();
            for boot in 0..20 {
                let mut slots = slots(flash.failing_after(cut, leftover, boot));
                slots.mend(true).ok();
                flash = slots.release();
                assert_eq!(load(&flash).parameters, parameters(0));
            }
            assert!(flash.erasures[1] <= MEND_ATTEMPTS, "cut at {cut}");
            assert_eq!(flash.erasures[0], 0);
        }
    }
}

#[test]
fn a_low_supply_erases_and_writes_nothing() {
    let flash = with_one_slot_bad::<4>();
    let mut slots = slots(flash.rebooted());
    for _ in 0..20 {
        assert_eq!(slots.mend(false), Ok(Mending::SupplyLow));
        assert!(slots.load().slot_bad, "the flag stays");
    }
    // Nothing is counted either: when the supply is back, the first attempt mends.
    let mut left = slots.release();
    assert_eq!(left.content, flash.content);
    left.erasures = [0; SLOTS];
    let mut slots = self::slots(left);
    assert_eq!(slots.mend(true), Ok(Mending::Done));
    assert_eq!(slots.mend(true), Ok(Mending::NotNeeded));
    let left = slots.release();
    assert_eq!(left.erasures, [0, 1]);
    assert_eq!(attempts(&left), 1);
}

#[test]
fn a_slot_whose_attempt_cannot_be_counted_is_not_erased() {
    // As in the emulator, where flash takes no write.
    struct ReadOnly(Nor<4>);
    impl ErrorType for ReadOnly {
        type Error = PowerLost;
    }
    impl ReadNorFlash for ReadOnly {
        const READ_SIZE: usize = 1;
        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
            self.0.read(offset, bytes)
        }
        fn capacity(&self) -> usize {
            self.0.capacity()
        }
    }
    impl NorFlash for ReadOnly {
        const WRITE_SIZE: usize = 4;
        const ERASE_SIZE: usize = SECTOR;
        fn erase(&mut self, _: u32, _: u32) -> Result<(), PowerLost> {
            panic!("erased")
        }
        fn write(&mut self, _: u32, _: &[u8]) -> Result<(), PowerLost> {
            Ok(())
        }
    }
    let flash = ReadOnly(with_one_slot_bad::<4>());
    let mut slots = ParameterSlots::new(flash, [0, SECTOR as u32]);
    assert_eq!(slots.mend(true), Err(SlotError::Verify));
}

#[test]
fn attempts_come_back_when_the_good_slots_sector_is_erased() {
    let mut flash = with_one_slot_bad::<4>();
    flash.worn = Some(1);
    for _ in 0..MEND_ATTEMPTS {
        let mut slots = slots(flash.rebooted());
        slots.mend(true).expect_err("worn out");
        flash = slots.release();
    }
    // The first store goes to the second slot, the next one to the first, whose marks it erases.
    flash.worn = None;
    let mut stored = slots(flash.rebooted());
    stored.store(&parameters(1)).expect("power holds");
    let flash = stored.release();
    assert_eq!(attempts(&flash), MEND_ATTEMPTS);
    let mut stored = slots(flash);
    stored.store(&parameters(2)).expect("power holds");
    let mut flash = stored.release();
    assert_eq!(attempts(&flash), 0);
    flash.content[SECTOR + 20] ^= 1;
    let mut mended = slots(flash);
    assert_eq!(mended.mend(true), Ok(Mending::Done));
}

#[test]
fn a_tool_that_writes_only_the_block_leaves_every_attempt() {
    let mut flash = Nor::<4>::erased();
    let block = parameters(3).to_block(9);
    flash.content[SECTOR..][..block.len()].copy_from_slice(&block);
    let mut slots = slots(flash);
    assert_eq!(slots.mend(true), Ok(Mending::Done));
    let found = slots.load();
    assert_eq!((found.parameters, found.slot_bad), (parameters(3), false));
}

#[test]
fn the_newer_generation_is_loaded_also_where_the_number_wraps() {
    let mut flash = Nor::<4>::erased();
    let last = u32::MAX;
    let block = parameters(1).to_block(last);
    flash.content[..block.len()].copy_from_slice(&block);
    let mut slots = slots(flash);
    assert_eq!(slots.load().generation, last);
    assert_eq!(slots.store(&parameters(2)), Ok(0));
    let found = slots.load();
    assert_eq!((found.generation, found.slot), (0, Some(Slot::Second)));
    assert_eq!(found.parameters, parameters(2));
}

/// A build that lacks a term takes the slot with its record for one that is not good.
#[test]
fn a_slot_that_asks_for_an_absent_term_is_not_used() {
    use trueaxis::terms::AllTerms;
    use trueaxis::{Chain, F32, ParameterError, TermKind, TermRecords};
    let with_terms = |flash| slots(flash).accepting::<Chain<F32, AllTerms<F32>>>();
    let mut terms = TermRecords::NONE;
    terms.push(TermKind::GyroDelay, &[2e-5; 3]).expect("room");
    let asking = parameters(1).with(|p| p.terms = terms);
    let mut bare = slots(after_stores::<4>(1));
    assert!(matches!(
        bare.store(&asking),
        Err(SlotError::Parameter(ParameterError::TermAbsent(
            TermKind::GyroDelay
        )))
    ));
    let mut full = with_terms(bare.release());
    full.store(&asking).expect("power holds");
    let flash = full.release().rebooted();
    let found = with_terms(flash.clone()).load();
    assert_eq!((found.parameters, found.slot_bad), (asking, false));
    let found = load(&flash);
    assert_eq!((found.parameters, found.slot_bad), (parameters(0), true));
}

#[test]
fn no_single_changed_bit_is_believed() {
    let flash = after_stores::<4>(2);
    let in_use = SECTOR..SECTOR + trueaxis::PARAMETER_BLOCK_BYTES;
    assert_eq!(load(&flash).slot, Some(Slot::Second));
    for at in in_use {
        for bit in 0..8 {
            let mut damaged = flash.clone();
            damaged.content[at] ^= 1 << bit;
            let found = load(&damaged);
            assert_eq!(found.parameters, parameters(0), "bit {bit} of byte {at}");
            assert!(found.slot_bad);
        }
    }
}

#[test]
fn parameters_out_of_range_are_not_stored() {
    let flash = after_stores::<4>(1);
    let mut slots = slots(flash.clone());
    let wrong = parameters(1).with(|p| p.bias_rad_s = [f64::NAN, 0.0, 0.0]);
    assert!(matches!(
        slots.store(&wrong),
        Err(SlotError::Parameter(trueaxis::ParameterError::Bias))
    ));
    assert_eq!(slots.release().content, flash.content);
}

#[test]
fn slots_that_do_not_fit_the_sectors_are_not_written() {
    for offsets in [[0, 4], [0, 0], [0, (2 * SECTOR) as u32], [0, u32::MAX - 3]] {
        let mut slots = ParameterSlots::new(Nor::<4>::erased(), offsets);
        assert_eq!(slots.store(&parameters(0)), Err(SlotError::Layout));
        assert!(slots.release().content.iter().all(|byte| *byte == 0xFF));
    }
}

proptest! {
    /// A life of stores and mends, power failing now and then: at every boot the parameters are those of
    /// the last store that succeeded, or of a later one that failed on its last step.
    #[test]
    fn repeated_power_failures_never_lose_the_parameters(
        life in prop::collection::vec(
            (any::<bool>(), prop::option::of(0..SECTOR + 400), 0..3usize, any::<u64>()),
            1..30,
        ),
    ) {
        let mut flash = after_stores::<4>(1);
        let mut held = parameters(0);
        for (number, (store, cut, leftover, seed)) in (1..).zip(life) {
            let mut powered = flash.rebooted();
            if let Some(cut) = cut {
                powered = flash.failing_after(cut, LEFTOVERS[leftover], seed);
            }
            let mut slots = slots(powered);
            let new = parameters(number);
            let succeeded = if store {
                slots.store(&new).is_ok()
            } else {
                slots.mend(true).is_ok()
            };
            flash = slots.release().rebooted();
            let found = load(&flash).parameters;
            if store && (succeeded || found == new) {
                prop_assert_eq!(found, new);
                held = new;
            } else {
                prop_assert_eq!(found, held);
            }
        }
    }
}

/// A flash of which one read fails, as it does where a line is disturbed once.
struct Flaky {
    flash: Nor<4>,
    fails: usize,
    reads: usize,
}

impl ErrorType for Flaky {
    type Error = PowerLost;
}

impl ReadNorFlash for Flaky {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
        self.reads += 1;
        if self.reads == self.fails {
            return Err(PowerLost);
        }
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

#[test]
fn whichever_single_read_fails_at_boot_a_good_slot_is_used() {
    for stores in [2, 3] {
        let flash = after_stores::<4>(stores);
        let (newer, older) = (parameters(stores - 1), parameters(stores - 2));
        let read = |fails: usize| {
            let flaky = Flaky {
                flash: flash.rebooted(),
                fails,
                reads: 0,
            };
            let mut slots = ParameterSlots::new(flaky, [0, SECTOR as u32]);
            (slots.load(), slots.release().reads)
        };
        let (undisturbed, reads) = read(usize::MAX);
        assert_eq!(undisturbed.parameters, newer);
        for fails in 1..=reads {
            let (loaded, _) = read(fails);
            assert!(!loaded.parameters_default(), "read {fails} of {reads}");
            assert!(loaded.slot_bad, "read {fails}");
            let used = [(&newer, stores), (&older, stores - 1)];
            let found = used.iter().find(|(used, _)| **used == loaded.parameters);
            assert_eq!(loaded.generation, found.expect("one of the two").1);
        }
        // The read that decides is the last: the newer slot's second. The older one stands in for it.
        assert_eq!(read(reads).0.parameters, older);
    }
}
