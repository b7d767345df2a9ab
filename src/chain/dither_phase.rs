//! The dither's phase over one sample, and the strip's two taps that follow from it.

/// The phase over one sample at the nominal frequency.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DitherPhase {
    /// Ω \[rad\].
    pub omega: f64,
}

impl DitherPhase {
    /// Forms the phase from the frequency \[cycles per sample\].
    pub fn of(cycles_per_sample: f64) -> Self {
        Self {
            omega: core::f64::consts::TAU * cycles_per_sample,
        }
    }

    /// 1 / sin Ω; 0 where the parameters cannot use the frequency.
    pub fn cosec(self) -> f64 {
        let sin = libm::sin(self.omega);
        if sin.abs() < 1e-3 { 0.0 } else { 1.0 / sin }
    }

    /// cot Ω; 0 where the parameters cannot use the frequency.
    pub fn cot(self) -> f64 {
        libm::cos(self.omega) * self.cosec()
    }

    /// h₀/G and h₁/G of `stages/dither.rs` for a pickoff that shows the block so many samples late.
    pub fn relative_taps(self, delay_samples: f64) -> [f64; 2] {
        let lag = self.omega * delay_samples;
        let (a, b) = (libm::cos(lag), libm::sin(lag));
        [a + b * self.cot(), -b * self.cosec()]
    }
}
