//! The registers of the clocks by the maker's names.

use super::*;
use crate::Named;

/// Registers and bits by the maker's names, for a comparison with the maker's data.
pub const NAMED: Named = &[
    (
        "CR",
        CR,
        &[
            ("HSION", HSION),
            ("HSIRDY", HSIRDY),
            ("HSEON", HSEON),
            ("HSERDY", HSERDY),
            ("CSSON", CSSON),
            ("PLLON", PLLON),
            ("PLLRDY", PLLRDY),
        ],
    ),
    (
        "PLLCFGR",
        PLLCFGR,
        &[
            ("PLLM", PLLM),
            ("PLLN", PLLN),
            ("PLLP", PLLP),
            ("PLLSRC", PLLSRC),
        ],
    ),
    (
        "CFGR",
        CFGR,
        &[
            ("SW", SWITCH),
            ("SWS", SWS),
            ("PPRE1", PPRE1),
            ("PPRE2", PPRE2),
        ],
    ),
    ("CIR", CIR, &[("CSSF", CSSF), ("CSSC", CSSC)]),
    ("AHB1ENR", ENABLES, &[]),
    ("APB1ENR", ENABLES + 0x10, &[]),
    ("APB2ENR", ENABLES_END, &[]),
    (
        "CSR",
        CSR,
        &[
            ("LSION", LSION),
            ("LSIRDY", LSIRDY),
            ("RMVF", RMVF),
            ("BORRSTF", reset_flag::POWER_ON & !(1 << 27)),
            ("PADRSTF", reset_flag::PIN),
            ("PORRSTF", reset_flag::POWER_ON & !(1 << 25)),
            ("SFTRSTF", reset_flag::SOFTWARE),
            ("WDGRSTF", reset_flag::WATCHDOG),
        ],
    ),
];
