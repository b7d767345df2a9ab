//! Added noise: its spectrum in the DCT-II of increments, and series of it.
//!
//! IEEE 952's N, Q (as white angle noise), B and K. Spectra are two-sided densities of increments \[rad²\] over the bins of
//! an orthonormal DCT-II: white increments of variance σ² have σ² in every bin, so the strength of a known signal is ρ² = Σ
//! Y_k²/S_k, except for the rows at the ends ([`Weighting`]).

use std::f64::consts::{LN_2, PI};

use nalgebra::{Matrix2, Vector2};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use realfft::RealFftPlanner;
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};

/// Effective first bin of a random walk from zero: its mean has the variance of bin √3/π (n/3 steps squared).
const WALK_FIRST_BIN: f64 = 0.551_328_895_421_792_1;

/// Effective first bin of flicker with components slower than the record.
const FLICKER_FIRST_BIN: f64 = 0.5;

/// Slowest component of flicker, over the inverse of the record's length.
const SLOWEST_OVER_RECORD: f64 = 0.25;

/// Drift of the gyros' rates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drift {
    /// None.
    None,
    /// Rate random walk that equals the angle random walk at this frequency \[Hz\].
    RateWalk(f64),
    /// Rate flicker that equals the angle random walk at this frequency \[Hz\].
    Flicker(f64),
}

impl Drift {
    /// Returns the name in tables.
    pub fn name(self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::RateWalk(corner_hz) => format!("rate walk {corner_hz} Hz"),
            Self::Flicker(corner_hz) => format!("flicker {corner_hz} Hz"),
        }
    }
}

/// Noise of one instrument about one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Angle random walk, N \[rad/√s\].
    pub walk_rad_sqrt_s: f64,
    /// White angle noise \[rad\].
    pub angle_rad: f64,
    /// Rate random walk, K \[rad/s/√s\].
    pub rate_walk_rad_s_sqrt_s: f64,
    /// Flicker, B \[rad/s\], with S(f) = B²/(2πf).
    pub flicker_rad_s: f64,
}

impl Levels {
    /// Returns the levels of white noise of rate and of angle.
    pub fn white(walk_rad_sqrt_s: f64, angle_rad: f64) -> Self {
        Self {
            walk_rad_sqrt_s,
            angle_rad,
            rate_walk_rad_s_sqrt_s: 0.0,
            flicker_rad_s: 0.0,
        }
    }

    /// Adds a drift given by its corner frequency with the angle random walk.
    pub fn drifting(mut self, drift: Drift) -> Self {
        match drift {
            Drift::None => {}
            Drift::RateWalk(corner_hz) => {
                self.rate_walk_rad_s_sqrt_s = self.walk_rad_sqrt_s * 2.0 * PI * corner_hz;
            }
            Drift::Flicker(corner_hz) => {
                self.flicker_rad_s = self.walk_rad_sqrt_s * (2.0 * PI * corner_hz).sqrt();
            }
        }
        self
    }

    /// Returns the noise of the difference of two instruments.
    pub fn beside(self, other: Self) -> Self {
        Self {
            walk_rad_sqrt_s: self.walk_rad_sqrt_s.hypot(other.walk_rad_sqrt_s),
            angle_rad: self.angle_rad.hypot(other.angle_rad),
            rate_walk_rad_s_sqrt_s: self
                .rate_walk_rad_s_sqrt_s
                .hypot(other.rate_walk_rad_s_sqrt_s),
            flicker_rad_s: self.flicker_rad_s.hypot(other.flicker_rad_s),
        }
    }

    /// Returns the density \[rad²\] in each of `rows` DCT-II bins of increments over `period_s`.
    pub fn spectrum_rad2(&self, rows: usize, period_s: f64) -> Vec<f64> {
        let white = self.walk_rad_sqrt_s.powi(2) * period_s;
        let angle = self.angle_rad.powi(2);
        let rate_step = self.rate_walk_rad_s_sqrt_s.powi(2) * period_s.powi(3);
        // T B²/(2πf) with f = k/(2nT)
        let flicker = self.flicker_rad_s.powi(2) * period_s.powi(2) * rows as f64 / PI;
        let lambda = |bin: f64| 4.0 * (PI * bin / (2.0 * rows as f64)).sin().powi(2);
        (0..rows)
            .map(|bin| {
                let or = |first: f64| if bin == 0 { first } else { bin as f64 };
                white
                    + angle * lambda(bin as f64)
                    + rate_step / lambda(or(WALK_FIRST_BIN))
                    + flicker / or(FLICKER_FIRST_BIN)
            })
            .collect()
    }

    /// Returns `rows` increments \[rad\] of noise.
    pub fn series_rad(&self, rows: usize, period_s: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let white = self.walk_rad_sqrt_s * period_s.sqrt();
        let mut series: Vec<f64> = (0..rows).map(|_| white * normal(rng)).collect();
        if self.angle_rad > 0.0 {
            let mut before = self.angle_rad * normal(rng);
            for value in &mut series {
                let now = self.angle_rad * normal(rng);
                *value += now - before;
                before = now;
            }
        }
        if self.rate_walk_rad_s_sqrt_s > 0.0 {
            let step = self.rate_walk_rad_s_sqrt_s * period_s.sqrt();
            let mut rate_rad_s = 0.0;
            for value in &mut series {
                rate_rad_s += step * normal(rng);
                *value += rate_rad_s * period_s;
            }
        }
        if self.flicker_rad_s > 0.0 {
            self.add_flicker(period_s, rng, &mut series);
        }
        series
    }

    /// Adds flicker as Ornstein–Uhlenbeck processes of equal variance, an octave apart: Σ 2va/(a² + ω²) = πv/(ω ln 2).
    fn add_flicker(&self, period_s: f64, rng: &mut ChaCha8Rng, series: &mut [f64]) {
        let record_s = series.len() as f64 * period_s;
        let spread = self.flicker_rad_s * (LN_2 / PI).sqrt();
        let mut decay_1_s = 2.0 * PI * SLOWEST_OVER_RECORD / record_s;
        while decay_1_s * period_s < 1.0 {
            let keep = (-decay_1_s * period_s).exp();
            let fresh = spread * (1.0 - keep * keep).sqrt();
            let mut rate_rad_s = spread * normal(rng);
            for value in series.iter_mut() {
                *value += rate_rad_s * period_s;
                rate_rad_s = keep * rate_rad_s + fresh * normal(rng);
            }
            decay_1_s *= 2.0;
        }
    }
}

/// Returns the output of an integrating pulse converter for increments \[rad\]: the floor of the running angle over the
/// pulse weight, differenced.
pub fn quantised_rad(increments_rad: &[f64], weight_rad: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut pulses: f64 = rng.random();
    increments_rad
        .iter()
        .map(|increment| {
            pulses += increment / weight_rad;
            let whole = pulses.floor();
            pulses -= whole;
            whole * weight_rad
        })
        .collect()
}

/// Returns the orthonormal DCT-II of a series, by the real Fourier transform of the series and its mirror image.
pub fn dct(series: &[f64]) -> Vec<f64> {
    let rows = series.len();
    let mut mirrored: Vec<f64> = series.iter().chain(series.iter().rev()).copied().collect();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(2 * rows);
    let mut bins = transform.make_output_vec();
    // The buffers have the plan's lengths.
    let done = transform.process(&mut mirrored, &mut bins);
    debug_assert!(done.is_ok());
    (0..rows)
        .map(|bin| {
            let (sin, cos) = (PI * bin as f64 / (2.0 * rows as f64)).sin_cos();
            let first = if bin == 0 { 0.5_f64.sqrt() } else { 1.0 };
            // X_k = ½ Re(e^{−iπk/2n} F_k)
            0.5 * first * (2.0 / rows as f64).sqrt() * (cos * bins[bin].re + sin * bins[bin].im)
        })
        .collect()
}

/// Inverse noise covariance, for DCTs of series.
///
/// Differenced white angle noise is diagonal in the DCT-II except for the first and the last row, whose outer angles have
/// no neighbour: C = diag(S) + σ²(e₁e₁ᵀ + eₙeₙᵀ), inverted by Woodbury's identity. Without that correction a coarse encoder
/// would appear to measure the mean rate as well as its angle random walk allows.
#[derive(Debug, Clone)]
pub struct Weighting {
    spectrum_rad2: Vec<f64>,
    ends: [Vec<f64>; 2],
    /// (σ⁻² + Σ c cᵀ/S)⁻¹.
    inside: Matrix2<f64>,
}

impl Weighting {
    /// Computes the inverse covariance of noise over some rows.
    pub fn new(levels: &Levels, rows: usize, period_s: f64) -> Self {
        let spectrum_rad2 = levels.spectrum_rad2(rows, period_s);
        let ends = [0, rows - 1].map(|row| {
            let mut impulse = vec![0.0; rows];
            impulse[row] = 1.0;
            dct(&impulse)
        });
        let inner = Matrix2::from_fn(|a, b| weighted_product(&ends[a], &ends[b], &spectrum_rad2));
        let angle = levels.angle_rad.powi(2);
        // (1/σ² + G)⁻¹ = σ² (1 + σ² G)⁻¹, which has an inverse for any noise.
        let inside = (Matrix2::identity() + inner * angle)
            .try_inverse()
            .unwrap_or_else(Matrix2::zeros)
            * angle;
        Self {
            spectrum_rad2,
            ends,
            inside,
        }
    }

    /// Returns aᵀ C⁻¹ b of the DCTs of two series \[rad\].
    pub fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let at_ends = |series: &[f64]| {
            Vector2::from_fn(|end, _| {
                weighted_product(series, &self.ends[end], &self.spectrum_rad2)
            })
        };
        weighted_product(a, b, &self.spectrum_rad2)
            - (at_ends(a).transpose() * self.inside * at_ends(b))[0]
    }
}

/// Returns Σ a_k b_k / S_k.
fn weighted_product(a: &[f64], b: &[f64], spectrum_rad2: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .zip(spectrum_rad2)
        .map(|((a, b), density)| a * b / density)
        .sum()
}

/// Returns aᵀ C⁻¹ b summed over the gyros.
pub fn product(weightings: &[Weighting; 3], a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]) -> f64 {
    (0..3)
        .map(|axis| weightings[axis].product(&a[axis], &b[axis]))
        .sum()
}
