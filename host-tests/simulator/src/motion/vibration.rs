//! Random vibration as a sum of tones: band-limited, or from a table of power spectral density.
//!
//! From a band with an rms, or a table of (Hz, unit²/Hz), and a seeded generator: one signal with its first two derivatives
//! at the quadrature nodes of successive periods.
//!
//! Equations: u(t) = Σ a_n cos(2πf_n t + φ_n), a_n²/2 the power of cell n of the band, f_n drawn inside its cell. Between
//! two points of a table the density is a straight line in log–log, as in vibration standards. Phasors step by one period
//! with one complex product each.
//!
//! Out of scope: the axis of a signal, and its taper.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Number of tones of a continuous band: enough for a sum that is Gaussian to 1 % in its fourth moment (excess kurtosis
/// −3/(2·64)), few enough that a minute costs well under a second.
pub const BAND_TONES: usize = 64;

/// Number of tones of a table: some ten to the octave over the decades of vibration standards.
pub const TABLE_TONES: usize = 128;

/// Tone with amplitude, frequency and phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Amplitude in the signal's unit.
    pub amplitude: f64,
    /// Angular frequency ω \[rad/s\].
    pub omega_rad_s: f64,
    /// Phase at the segment's start \[rad\].
    pub phase_rad: f64,
}

/// A table of one-sided power spectral density: (Hz, unit²/Hz), frequencies rising, both above 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum(pub Vec<[f64; 2]>);

impl Spectrum {
    /// Power between two frequencies of one log–log segment: ∫ S₁ (f/f₁)^m df.
    fn piece(from: [f64; 2], to: [f64; 2], low_hz: f64, high_hz: f64) -> f64 {
        let slope = (to[1] / from[1]).ln() / (to[0] / from[0]).ln();
        let at = |hz: f64| from[1] * (hz / from[0]).powf(slope);
        // f^−1 integrates to a logarithm
        if (slope + 1.0).abs() < 1e-9 {
            return from[1] * from[0] * (high_hz / low_hz).ln();
        }
        (at(high_hz) * high_hz - at(low_hz) * low_hz) / (slope + 1.0)
    }

    /// Power between two frequencies \[unit²\].
    pub fn power(&self, low_hz: f64, high_hz: f64) -> f64 {
        self.0
            .windows(2)
            .map(|pair| {
                let (low, high) = (low_hz.max(pair[0][0]), high_hz.min(pair[1][0]));
                if high > low {
                    Self::piece(pair[0], pair[1], low, high)
                } else {
                    0.0
                }
            })
            .sum()
    }

    /// Draws the tones of the table. Cells have equal shares of the mean of bandwidth and power, so that a peak is finely
    /// divided and the floor is covered too.
    pub fn tones(&self, rng: &mut ChaCha8Rng) -> Vec<Tone> {
        let (Some(first), Some(last)) = (self.0.first(), self.0.last()) else {
            return Vec::new();
        };
        let (begin, end) = (first[0], last[0]);
        let whole = self.power(begin, end);
        let share = |hz: f64| 0.5 * ((hz - begin) / (end - begin) + self.power(begin, hz) / whole);
        let edge = |cell: usize| {
            let wanted = cell as f64 / TABLE_TONES as f64;
            let (mut low, mut high) = (begin, end);
            // the share is increasing; 50 bisections leave 1e-15 of the band
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if share(middle) < wanted {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            high
        };
        let mut low = begin;
        (1..=TABLE_TONES)
            .map(|cell| {
                let high = if cell == TABLE_TONES { end } else { edge(cell) };
                let frequency_hz = low + (high - low) * rng.random::<f64>();
                let amplitude = (2.0 * self.power(low, high)).sqrt();
                low = high;
                Tone {
                    amplitude,
                    omega_rad_s: TAU * frequency_hz,
                    phase_rad: TAU * rng.random::<f64>(),
                }
            })
            .collect()
    }
}

/// Draws the tones of a flat band for the three axes: equal frequencies; phases independent, or relative to a common one.
pub fn band_tones(
    low_hz: f64,
    high_hz: f64,
    rms: [f64; 3],
    axis_phase_rad: Option<[f64; 3]>,
    rng: &mut ChaCha8Rng,
) -> [Vec<Tone>; 3] {
    let width_hz = (high_hz - low_hz) / BAND_TONES as f64;
    let mut tones: [Vec<Tone>; 3] = Default::default();
    for tone in 0..BAND_TONES {
        // one tone in each cell of the band: the spectrum is covered evenly, the tones stay irregular
        let frequency_hz = low_hz + width_hz * (tone as f64 + rng.random::<f64>());
        let common: f64 = rng.random::<f64>() * TAU;
        let free: [f64; 3] = [rng.random(), rng.random(), rng.random()];
        let phases = match axis_phase_rad {
            Some(offset) => offset.map(|phase| common + phase),
            None => free.map(|turns| turns * TAU),
        };
        for axis in 0..3 {
            tones[axis].push(Tone {
                amplitude: rms[axis] * (2.0 / BAND_TONES as f64).sqrt(),
                omega_rad_s: TAU * frequency_hz,
                phase_rad: phases[axis],
            });
        }
    }
    tones
}

/// Phasors of one signal at one node.
#[derive(Debug, Clone, Default)]
struct Phasors {
    real: Vec<f64>,
    imaginary: Vec<f64>,
}

/// One signal, evaluated at fixed fractions of each period.
#[derive(Debug, Clone, Default)]
pub struct ToneBank {
    nodes: Vec<Phasors>,
    rotation: Vec<(f64, f64)>,
    omega_rad_s: Vec<f64>,
}

impl ToneBank {
    /// Bank of tones from the segment's start, at these fractions of periods of `period_s`.
    pub fn new(tones: &[Tone], node_fractions: [f64; 4], period_s: f64) -> Self {
        // an empty bank needs no computation
        if tones.iter().all(|tone| tone.amplitude == 0.0) {
            return Self::default();
        }
        let omega_rad_s: Vec<f64> = tones.iter().map(|tone| tone.omega_rad_s).collect();
        let rotation = omega_rad_s
            .iter()
            .map(|omega| (omega * period_s).sin_cos())
            .map(|(sin, cos)| (cos, sin))
            .collect();
        let nodes = node_fractions.map(|fraction| {
            let (imaginary, real) = tones
                .iter()
                .map(|tone| {
                    let (sin, cos) =
                        (tone.phase_rad + tone.omega_rad_s * fraction * period_s).sin_cos();
                    (tone.amplitude * sin, tone.amplitude * cos)
                })
                .unzip();
            Phasors { real, imaginary }
        });
        Self {
            nodes: nodes.into(),
            rotation,
            omega_rad_s,
        }
    }

    /// Returns value and two derivatives at `node` of the current period, and advances that node by a period.
    pub fn next(&mut self, node: usize) -> [f64; 3] {
        let mut sums = [0.0; 3];
        let Some(phasors) = self.nodes.get_mut(node) else {
            return sums;
        };
        for (((real, imaginary), (cos, sin)), omega) in phasors
            .real
            .iter_mut()
            .zip(phasors.imaginary.iter_mut())
            .zip(&self.rotation)
            .zip(&self.omega_rad_s)
        {
            sums[0] += *real;
            sums[1] -= omega * *imaginary;
            sums[2] -= omega * omega * *real;
            (*real, *imaginary) = (
                *real * cos - *imaginary * sin,
                *real * sin + *imaginary * cos,
            );
        }
        sums
    }
}
