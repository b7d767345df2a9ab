//! Compares results of the floating-point unit with those that the compiler has computed: sums, products, quotients, roots and
//! conversions, with ties, cancellation, a subnormal result and a conversion beyond range among them.

use core::arch::asm;

/// The bits in which the result of an instruction with two operands differs from the compiler's.
macro_rules! of_two {
    ($instruction:literal, $a:literal $operator:tt $b:literal) => {{
        let result: u32;
        // SAFETY: computes in registers; the unit is enabled in front of `main`.
        unsafe {
            asm!(
                "vmov s0, {a}",
                "vmov s1, {b}",
                concat!($instruction, " s2, s0, s1"),
                "vmov {result}, s2",
                result = lateout(reg) result,
                a = in(reg) const { ($a as f32).to_bits() },
                b = in(reg) const { ($b as f32).to_bits() },
                out("s0") _, out("s1") _, out("s2") _,
                options(nomem, nostack),
            );
        }
        result ^ const { ($a as f32 $operator $b as f32).to_bits() }
    }};
}

/// The same of an instruction with one operand and these bits as its result.
macro_rules! of_one {
    ($instruction:literal, $bits:expr, $expected:expr) => {{
        let result: u32;
        // SAFETY: as above.
        unsafe {
            asm!(
                "vmov s0, {a}",
                concat!($instruction, " s2, s0"),
                "vmov {result}, s2",
                result = lateout(reg) result,
                a = in(reg) $bits,
                out("s0") _, out("s2") _,
                options(nomem, nostack),
            );
        }
        result ^ const { $expected }
    }};
}

/// True if every result is as it must be.
#[inline(never)]
pub fn float_unit_is_right() -> bool {
    let wrong = of_two!("vadd.f32", 1.1 + 2.2)
        | of_two!("vadd.f32", 16_777_216.0 + 1.0)
        | of_two!("vadd.f32", 16_777_216.0 + 3.0)
        | of_two!("vsub.f32", 1.000_000_1 - 1.0)
        | of_two!("vsub.f32", 2.5 - 1.0e9)
        | of_two!("vmul.f32", 3.333_333_3 * 7.7)
        | of_two!("vmul.f32", 1.0e-38 * 0.1)
        | of_two!("vdiv.f32", 1.0 / 3.0)
        | of_two!("vdiv.f32", 2.0 / 3.0)
        | of_two!("vdiv.f32", 10.0 / -7.0)
        // √2 and √0.1 to the nearest.
        | of_one!("vsqrt.f32", 2.0_f32.to_bits(), 0x3FB5_04F3)
        | of_one!("vsqrt.f32", 0.1_f32.to_bits(), 0x3EA1_E89B)
        | of_one!("vcvt.s32.f32", (-3.9_f32).to_bits(), (-3.9_f32 as i32) as u32)
        | of_one!("vcvt.s32.f32", 3.0e9_f32.to_bits(), i32::MAX as u32)
        | of_one!("vcvt.f32.s32", 16_777_217, (16_777_217_i32 as f32).to_bits())
        | of_one!("vcvt.f32.s32", -16_777_219_i32 as u32, (-16_777_219_i32 as f32).to_bits());
    wrong == 0
}
