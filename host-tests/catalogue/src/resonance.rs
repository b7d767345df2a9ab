//! Second-order modes: how a block on its suspension follows angular acceleration.

use realfft::num_complex::Complex64;

/// δ'' + 2ζΩ0 δ' + Ω0² δ = Ω0² u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Ω0/2π \[Hz\].
    pub frequency_hz: f64,
    /// ζ \[1\].
    pub damping: f64,
}

impl Mode {
    /// δ/u at a frequency \[Hz\].
    pub fn response(self, hz: f64) -> Complex64 {
        let square = self.frequency_hz * self.frequency_hz;
        square
            / Complex64::new(
                square - hz * hz,
                2.0 * self.damping * self.frequency_hz * hz,
            )
    }

    /// Modes on a grid of frequency and damping, up to `highest_hz`.
    pub fn grid(highest_hz: f64) -> Vec<Self> {
        const LOWEST_HZ: f64 = 25.0;
        const FREQUENCIES: usize = 16;
        const DAMPINGS: [f64; 2] = [0.03, 0.12];
        let ratio = (highest_hz / LOWEST_HZ).ln() / (FREQUENCIES - 1) as f64;
        (0..FREQUENCIES)
            .flat_map(|place| {
                let frequency_hz = LOWEST_HZ * (ratio * place as f64).exp();
                DAMPINGS.map(|damping| Self {
                    frequency_hz,
                    damping,
                })
            })
            .collect()
    }
}
