//! Measures the amplitude of each block's dither \[arcsec\], a health figure of the dither drive.
//!
//! It takes pickoff codes, every sample or every n-th, and on request, once per window, gives √2 × their rms about the
//! mean \[arcsec\] for each axis.
//!
//! It is no part of [`Chain`](crate::Chain): it runs in the background loop. The sums are integers, so that a long
//! window loses nothing. The square root is `micromath`'s, which needs no table and no products of 64 bits as `libm`'s
//! does, and is wrong by at most [`AMPLITUDE_ERROR_LIMIT`] (measured over 1″ to 1000″ in
//! `host-tests/firmware/tests/core_chain/monitor.rs`): a drive is watched to tens of per cent.
//!
//! It does not find the dither's frequency or phase.

use micromath::F32Ext;

/// Largest relative error of the amplitude \[1\].
pub const AMPLITUDE_ERROR_LIMIT: f32 = 0.07;

const ARCSEC_PER_RAD: f32 = 206_264.8;
const SQRT_2: f32 = core::f32::consts::SQRT_2;

/// Codes are held within ±2²³ (2e-3 rad at 2⁻³² rad per code), so that 2¹⁶ squares fit 64 bits.
const CODE_LIMIT: i32 = 1 << 23;

/// Sums of pickoff codes and of their squares over the present window.
#[derive(Debug, Clone, Copy, Default)]
pub struct DitherMonitor {
    samples: u16,
    sum: [i64; 3],
    sum_of_squares: [i64; 3],
}

impl DitherMonitor {
    /// Starts with an empty window.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one reading of the three pickoffs; ignored once the window holds 65 535.
    pub fn observe(&mut self, pickoff_codes: [i32; 3]) {
        let Some(samples) = self.samples.checked_add(1) else {
            return;
        };
        self.samples = samples;
        let sums = self.sum.iter_mut().zip(&mut self.sum_of_squares);
        for ((sum, sum_of_squares), code) in sums.zip(pickoff_codes) {
            let code = i64::from(code.clamp(-CODE_LIMIT, CODE_LIMIT));
            *sum += code;
            *sum_of_squares += code * code;
        }
    }

    /// Amplitudes \[arcsec\] of the window, x, y, z, and a new window; `None` where it is empty.
    pub fn amplitude_arcsec(&mut self, pickoff_weight_rad: f32) -> Option<[f32; 3]> {
        let window = core::mem::take(self);
        let samples = i64::from(window.samples);
        if samples == 0 {
            return None;
        }
        let mut amplitudes = [0.0; 3];
        let sums = window.sum.iter().zip(window.sum_of_squares);
        for (amplitude, (sum, sum_of_squares)) in amplitudes.iter_mut().zip(sums) {
            let mean = sum / samples;
            let variance = (sum_of_squares / samples - mean * mean).max(0);
            let rms_codes = F32Ext::sqrt(variance as f32);
            *amplitude = SQRT_2 * rms_codes * pickoff_weight_rad * ARCSEC_PER_RAD;
        }
        Some(amplitudes)
    }
}
