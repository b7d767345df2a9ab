//! Hands a value over to the sampling interrupt while that is unmasked, and back to the main loop.
//!
//! Nothing is shared, so nothing is locked: all exchange while both run goes through queues and atomics.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{Ordering, compiler_fence};

use stm32f4::stm32f405::{NVIC, interrupt};

/// A place whose content belongs to the sampling interrupt while that is unmasked, and to the main loop otherwise.
///
/// It is not written before it is lent for the first time: an empty `Option` is some number inside the value, and a
/// static would take all of the value from flash.
#[repr(C)]
pub struct Handover<T> {
    value: UnsafeCell<MaybeUninit<Option<T>>>,
    /// True once it was lent.
    written: UnsafeCell<bool>,
}

// SAFETY: one core; `lend` and `take_back` change the owner only while the interrupt is masked.
unsafe impl<T: Send> Sync for Handover<T> {}

impl<T> Handover<T> {
    /// An empty place.
    pub const fn empty() -> Self {
        Self {
            value: UnsafeCell::new(MaybeUninit::uninit()),
            written: UnsafeCell::new(false),
        }
    }

    /// Stores the value of `make` and unmasks the interrupt, to which the value belongs from here on. `make` runs inside,
    /// so that its stack frame is free again when this returns.
    #[inline(never)]
    pub fn lend(&self, make: impl FnOnce() -> T) {
        NVIC::mask(interrupt::TIM2);
        wait_for_mask();
        // SAFETY: the interrupt, the only other user, is masked.
        unsafe {
            (*self.value.get()).write(Some(make()));
            *self.written.get() = true;
        }
        // The value must be in its place before the interrupt may come: for the compiler, which may move
        // the plain store past a register's volatile one, and for the processor.
        compiler_fence(Ordering::SeqCst);
        cortex_m::asm::dmb();
        // SAFETY: nothing holds a critical section that relies on this interrupt being masked.
        unsafe { NVIC::unmask(interrupt::TIM2) };
    }

    /// Masks the interrupt and takes the value out.
    #[cfg_attr(
        feature = "board",
        expect(dead_code, reason = "the board samples until it is switched off")
    )]
    pub fn take_back(&self) -> Option<T> {
        NVIC::mask(interrupt::TIM2);
        wait_for_mask();
        // SAFETY: the interrupt, the only other user, is masked, and the lent value is written.
        unsafe {
            if *self.written.get() {
                (*self.place()).take()
            } else {
                None
            }
        }
    }

    /// The place itself, for the interrupt: while that runs it is unmasked, so the value is written and belongs to it, and
    /// it does not nest. Anybody else has no right to read or write through the pointer.
    #[inline(always)]
    pub fn place(&self) -> *mut Option<T> {
        self.value.get().cast()
    }
}

/// The barriers of the architecture's reference manual (B3.5.3): no TIM2 entry after this point, and no later access,
/// nor the compiler's move of one, before it.
fn wait_for_mask() {
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    compiler_fence(Ordering::SeqCst);
}
