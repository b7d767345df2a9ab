//! Checks raw readings against the chain's range, and holds those beyond it.
//!
//! It takes one [`Sample`] and the previous pickoff codes, and tests whether every reading is in range. If one is not,
//! it gives the sample with its counts held, the excess of the pickoff steps \[codes\], and a status.
//!
//! Counts may reach ±[`SENSED_LIMIT_RAD`], pickoff steps ±[`DITHER_LIMIT_RAD`], both times the increment unit, which
//! follows the sample rate. A pickoff that steps further is taken to have moved its origin by the excess: the strip
//! goes on from there, and a step back brings the origin back.
//!
//! After lost samples one reading covers several periods. Its counts may be as many times larger, and its pickoff
//! step four times.
//!
//! The check alone is on the ordinary path: its cost does not depend on the readings. It does not detect stuck or
//! implausible readings, which takes a window (`adaptation.rs`).

use crate::chain::design_parameters::{DITHER_LIMIT_RAD, SENSED_LIMIT_RAD};
use crate::chain::faults::Status;
use crate::chain::parameters::Parameters;
use crate::chain::sample::Sample;

/// A dither's largest step between any two instants over its largest step in one sample: 2 against 2 sin ½Ω. At the
/// lowest dither frequency allowed that is more than 4, but the limit of a step has a margin of its own.
const PHASES: i32 = 4;

/// Configuration: the largest magnitudes.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    counts: [i32; 3],
    codes: [i32; 3],
}

/// Readings that were brought into range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// With counts in range; pickoff codes as they came.
    pub sample: Sample,
    /// The distance by which each pickoff's origin is taken to have moved \[codes\].
    pub pickoff_excess: [i32; 3],
    /// Status bits of the readings that were held.
    pub status: Status,
}

impl Limits {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let unit_rad = parameters.increment_unit_rad();
        Self {
            // A float's conversion holds at the end of the range.
            counts: parameters
                .pulse_weight_rad
                .map(|weight| (SENSED_LIMIT_RAD * unit_rad / weight) as i32),
            codes: [0, 1, 2].map(|axis| Self::codes_limit(parameters, axis)),
        }
    }

    /// Largest pulse counts of one sample.
    pub(crate) fn counts(&self) -> [i32; 3] {
        self.counts
    }

    /// Largest pickoff step \[codes\]; a zero gain divides to infinity, which converts to the largest there is.
    fn codes_limit(parameters: &Parameters, axis: usize) -> i32 {
        let limit_rad = DITHER_LIMIT_RAD * parameters.increment_unit_rad();
        // An output period's steps must fit the words in which readings are differenced, with a gap's in every other.
        let fits = i32::MAX / (2 * i32::from(parameters.samples_per_output) + PHASES);
        ((limit_rad / parameters.strip_rad_per_code(axis)) as i32).min(fits)
    }

    /// Largest pickoff steps of one sample \[codes\].
    pub(crate) fn codes(&self) -> [i32; 3] {
        self.codes
    }

    /// True if every count and every pickoff step is in range.
    #[inline(always)]
    pub fn fit(&self, previous_codes: &[i32; 3], sample: &Sample) -> bool {
        let within = |value: i32, limit: i32| {
            // One comparison for both ends.
            value.wrapping_add(limit) as u32 <= (limit as u32) << 1
        };
        let [cx, cy, cz] = self.counts;
        let [nx, ny, nz] = sample.pulse_counts;
        let [lx, ly, lz] = self.codes;
        let [px, py, pz] = sample.pickoff_codes;
        let [bx, by, bz] = *previous_codes;
        within(nx, cx)
            && within(ny, cy)
            && within(nz, cz)
            && within(px.saturating_sub(bx), lx)
            && within(py.saturating_sub(by), ly)
            && within(pz.saturating_sub(bz), lz)
    }

    /// Brings a sample that covers `periods` of them into range.
    #[inline(never)]
    pub fn hold(&self, previous_codes: &[i32; 3], sample: &Sample, periods: u32) -> Held {
        let mut held = Held {
            sample: *sample,
            ..Held::default()
        };
        let several = i32::try_from(periods).unwrap_or(i32::MAX);
        for (axis, &previous) in previous_codes.iter().enumerate() {
            let limit = self.counts[axis].saturating_mul(several);
            let counts = sample.pulse_counts[axis];
            held.sample.pulse_counts[axis] = counts.max(limit.wrapping_neg()).min(limit);
            let counts_held = held.sample.pulse_counts[axis] != counts;

            let limit = self.codes[axis].saturating_mul(several.min(PHASES));
            let codes = sample.pickoff_codes[axis];
            let step = codes.saturating_sub(previous);
            let step_held = step.max(limit.wrapping_neg()).min(limit);
            // Modulo 2³², as the codes themselves.
            held.pickoff_excess[axis] = codes.wrapping_sub(previous).wrapping_sub(step_held);
            held.status = held
                .status
                .union(Status::COUNTS_SATURATED.when(counts_held))
                .union(Status::PICKOFF_SATURATED.when(step_held != step));
        }
        held
    }
}
