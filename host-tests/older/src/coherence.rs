//! Which measured channel a located mismatch goes with, before anything is fitted.
//!
//! Enters: the scene, the model's residual \[rad per row\], its noise, the locations. Leaves: for each location
//! up to three [`Companion`]s: a channel, or a product of two, whose past the residual repeats.
//!
//! * Lagged coherence: C(τ) = Σ Re(conj X · R e^{iωτ})/S ÷ √(Σ|X|²/S · Σ|R|²/S) over the bins of the location's
//!   band on all fitted rows, lags within 50 ms; positive lags: the residual is late.
//! * X of a product motion_a × motion_b makes it the cross-bispectrum, summed over the pairs of frequencies that
//!   meet in the band.
//!
//! Chance: with the residual's phases drawn at random C has variance 1/ν, 1/ν = Σ|X|²|R|²/S² ÷ 2(Σ|X|²/S · Σ|R|²/S),
//! and C² follows the Beta law of ν dimensions: a few strong bins agree with many channels by chance, and ν says
//! how few. Every expression and lag tried on the location counts. A hint for people: no name rests on it.
//!
//! Not here: coherence within single tiles, where there are too few bins to mean anything.

use rayon::prelude::*;
use realfft::num_complex::Complex64;
use statrs::distribution::{Beta, ContinuousCDF};
use std::ops::Range;

pub use super::locate::Companion;
use super::locate::Location;
use super::noise::Noise;
use super::portion::{Bins, Portion};
use super::products::Products;
use super::scene::Scene;
use super::signals::signal;
use super::streams::{AXES, Triad};

/// Longest lag \[s\]: filters, transports and structures of such units answer within it.
const LONGEST_LAG_S: f64 = 0.05;

/// Lags are this share of the band's fastest period apart: the peak is met to a few per cent.
const LAG_STEP: f64 = 0.25;

/// Chance below which a companion is told: of a hundred locations one has a false one.
const TOLD: f64 = 0.01;

/// Companions of one location.
const MOST: usize = 3;

/// Products whose lags are searched: the most coherent without a lag. All are counted.
const LAGGED_PRODUCTS: usize = 8;

/// Products of motions end at twice the motion's edge, and that is looked at within these bounds \[Hz\]: slow
/// channels need ten hertz; beyond a hundred the spectra of all products would need the memory of the search.
const PRODUCTS_HZ: [f64; 2] = [10.0, 100.0];

/// The slowest rate \[Hz\] to which series are averaged down; slower costs no less.
const SLOWEST_HZ: f64 = 40.0;

/// Fills in the companions of every location.
pub fn accompany(
    scene: &Scene,
    residual_rad: &Triad,
    noise: &[Noise; 3],
    fitted: &[Range<usize>],
    products: &Products,
    locations: &mut [Location],
) {
    if locations.is_empty() {
        return;
    }
    let motion_hz = (2.0 * scene.motion_edge_hz).clamp(PRODUCTS_HZ[0], PRODUCTS_HZ[1]);
    let fast = |name: &str| name.starts_with("dither_");
    // Time itself is no channel, a lag is looked for here anyway, and what only changes its sign has no spectrum to speak of.
    let made = ["decay(", "lag(", "integral(", "sign(", "rising("];
    let measured = |name: &str| name != "time" && !made.iter().any(|made| name.contains(made));
    let slow: Vec<usize> = (0..products.names.len())
        .filter(|&product| measured(&products.names[product]) && !fast(&products.names[product]))
        .collect();
    let slow_values = |place: usize| {
        let mut values = Vec::new();
        products.evaluate(slow[place], &mut values);
        (products.names[slow[place]].clone(), values)
    };
    let rest = scene.streams.at_rest.as_ref().map(|_| "force");
    let others: Vec<String> = ["dither_angle", "dither_rate"]
        .into_iter()
        .chain(rest)
        .flat_map(|stem| AXES.map(|axis| format!("{stem}_{axis}")))
        .filter(|name| signal(scene, name).is_some())
        .collect();
    let other_values = |place: usize| {
        let values = signal(scene, &others[place]).unwrap_or_default();
        (others[place].clone(), values)
    };
    let over = Over {
        rate_hz: scene.streams.rate_hz,
        residual_rad,
        fitted,
        locations,
    };
    let spectra = [
        over.spectra(slow.len(), &slow_values, motion_hz),
        over.spectra(others.len(), &other_values, f64::INFINITY),
    ];
    let searches: Vec<(Place, Vec<Companion>)> = bands(locations)
        .into_par_iter()
        .map(|(axis, band_hz)| {
            let tried: Vec<(usize, Vec<Companion>)> = spectra
                .iter()
                .flatten()
                .map(|spectra| spectra.search(axis, band_hz, &noise[axis]))
                .collect();
            let trials: usize = tried.iter().map(|(trials, _)| trials).sum();
            let mut found: Vec<Companion> =
                tried.into_iter().flat_map(|(_, found)| found).collect();
            for one in &mut found {
                one.p_value = -(trials as f64 * (-one.p_value).ln_1p()).exp_m1();
            }
            found.retain(|one| one.p_value < TOLD);
            found.sort_by(|a, b| {
                let by_chance = a.p_value.total_cmp(&b.p_value);
                by_chance.then(b.coherence.abs().total_cmp(&a.coherence.abs()))
            });
            found.truncate(MOST);
            ((axis, band_hz), found)
        })
        .collect();
    for location in locations {
        let key = (location.axis, location.band_hz);
        if let Some((_, found)) = searches.iter().find(|(known, _)| *known == key) {
            location.companions.clone_from(found);
        }
        if let (true, Some(best)) = (location.regime.is_empty(), location.companions.first()) {
            location.regime = words(best);
        }
    }
}

/// "goes with omega_x, 3.2 ms later".
fn words(companion: &Companion) -> String {
    /// A lag that is no news \[s\].
    const AT_ONCE_S: f64 = 1e-4;
    let lag_ms = 1e3 * companion.lag_s;
    match lag_ms {
        lag if lag.abs() < 1e3 * AT_ONCE_S => format!("goes with {}", companion.with),
        lag if lag > 0.0 => format!("goes with {}, {lag:.1} ms later", companion.with),
        lag => format!("goes with {}, {:.1} ms earlier", companion.with, -lag),
    }
}

/// Gyro and band \[Hz\].
type Place = (usize, (f64, f64));

/// Gyro and band of every location, each once.
fn bands(locations: &[Location]) -> Vec<Place> {
    let mut bands: Vec<Place> = Vec::new();
    for location in locations {
        let key = (location.axis, location.band_hz);
        if !bands.contains(&key) {
            bands.push(key);
        }
    }
    bands
}

/// Spectra of the residual and of expressions, averaged down to the located bands.
struct Spectra {
    portion: Portion,
    residual: [Bins; 3],
    expressions: Vec<(String, Bins)>,
    most_hz: f64,
}

/// What is looked at.
struct Over<'a> {
    rate_hz: f64,
    residual_rad: &'a Triad,
    fitted: &'a [Range<usize>],
    locations: &'a [Location],
}

impl Over<'_> {
    /// Spectra of `count` expressions, whose rows are formed one after the other: all at once they would be as
    /// large as a hundred recordings. `None` where no location lies below `most_hz`.
    fn spectra(
        &self,
        count: usize,
        expression: &(dyn Fn(usize) -> (String, Vec<f64>) + Sync),
        most_hz: f64,
    ) -> Option<Spectra> {
        let reached = self
            .locations
            .iter()
            .filter(|place| place.band_hz.0 < most_hz);
        let top_hz = reached
            .map(|place| place.band_hz.1)
            .fold(0.0, f64::max)
            .min(most_hz);
        if top_hz == 0.0 || count == 0 {
            return None;
        }
        let block = (self.rate_hz / (4.0 * top_hz).max(SLOWEST_HZ))
            .floor()
            .max(1.0) as usize;
        let average = |values: &[f64]| -> Vec<f64> {
            let rows: Vec<f64> = self
                .fitted
                .iter()
                .flat_map(|rows| &values[rows.clone()])
                .copied()
                .collect();
            let sums = rows
                .chunks_exact(block)
                .map(|rows| rows.iter().sum::<f64>());
            sums.collect()
        };
        let averaged = [0, 1, 2].map(|axis: usize| average(&self.residual_rad[axis]));
        let rows = averaged[0].len();
        let rate_hz = self.rate_hz / block as f64;
        let portion = Portion::new(std::iter::once(0..rows).collect(), rate_hz)?;
        let residual = averaged.map(|values| portion.transform(&values));
        let expressions = (0..count)
            .into_par_iter()
            .map(|place| {
                let (name, values) = expression(place);
                let mut bins = portion.transform(&average(&values));
                bins.truncate((top_hz / portion.frequency_hz(1)).ceil() as usize);
                bins.shrink_to_fit();
                (name, bins)
            })
            .collect();
        Some(Spectra {
            portion,
            residual,
            expressions,
            most_hz,
        })
    }
}

impl Spectra {
    /// Trials made, and each expression's best lag with its chance for itself.
    fn search(&self, axis: usize, band_hz: (f64, f64), noise: &Noise) -> (usize, Vec<Companion>) {
        let bin_hz = self.portion.frequency_hz(1);
        let high_hz = band_hz.1.min(self.most_hz);
        // The mean goes with anything that has one.
        let first = ((band_hz.0 / bin_hz).ceil() as usize).max(1);
        let kept = self.expressions.first().map_or(0, |(_, bins)| bins.len());
        let last = ((high_hz / bin_hz).ceil() as usize).min(kept);
        if first >= last {
            return (0, Vec::new());
        }
        let weights: Vec<f64> = (first..last)
            .map(|bin| 1.0 / noise.at(self.portion.frequency_hz(bin), bin_hz))
            .collect();
        let rate_hz = bin_hz * self.portion.rows() as f64;
        let lags = 2 * (LONGEST_LAG_S * high_hz / LAG_STEP).floor() as usize + 1;
        let residual = &self.residual[axis][first..last];
        let crosses: Vec<Cross> = self
            .expressions
            .iter()
            .map(|(_, bins)| Cross::new(&bins[first..last], residual, &weights))
            .collect();
        let mut order: Vec<usize> = (0..crosses.len())
            .filter(|&place| crosses[place].dimensions.is_finite())
            .collect();
        order.sort_by(|&a, &b| {
            crosses[b]
                .at_once()
                .abs()
                .total_cmp(&crosses[a].at_once().abs())
        });
        let mut products = 0;
        let found = order
            .into_iter()
            .map(|place| {
                let (name, cross) = (&self.expressions[place].0, &crosses[place]);
                products += usize::from(name.contains('*'));
                let lagged = !name.contains('*') || products <= LAGGED_PRODUCTS;
                let (lag_s, coherence) = if lagged && lags > 1 {
                    best_lag(&self.portion, cross, first, rate_hz)
                } else {
                    (0.0, cross.at_once())
                };
                Companion {
                    with: name.clone(),
                    lag_s,
                    coherence,
                    p_value: chance(coherence, cross.dimensions),
                }
            })
            .collect();
        (crosses.len() * lags, found)
    }
}

/// One expression against one residual in one band.
struct Cross {
    /// conj X · R / S by bin, over √(Σ|X|²/S · Σ|R|²/S).
    bins: Vec<Complex64>,
    /// ν.
    dimensions: f64,
}

impl Cross {
    fn new(expression: &[Complex64], residual: &[Complex64], weights: &[f64]) -> Self {
        let power = |bins: &[Complex64]| -> f64 {
            bins.iter()
                .zip(weights)
                .map(|(bin, weight)| bin.norm_sqr() * weight)
                .sum()
        };
        let scale = (power(expression) * power(residual)).sqrt().recip();
        let bins: Vec<Complex64> = expression
            .iter()
            .zip(residual)
            .zip(weights)
            .map(|((x, r), weight)| x.conj() * r * (weight * scale))
            .collect();
        let spread: f64 = bins.iter().map(Complex64::norm_sqr).sum();
        Self {
            bins,
            dimensions: 2.0 / spread,
        }
    }

    /// Coherence without a lag.
    fn at_once(&self) -> f64 {
        self.bins.iter().map(|bin| bin.re).sum()
    }
}

/// The lag \[s\] within [`LONGEST_LAG_S`] of the largest coherence, and that: all lags by one inverse transform.
fn best_lag(portion: &Portion, cross: &Cross, first: usize, rate_hz: f64) -> (f64, f64) {
    let inverse = portion.inverse();
    let mut input = inverse.make_input_vec();
    for (bin, value) in input[first..].iter_mut().zip(&cross.bins) {
        *bin = value * 0.5;
    }
    let mut at_lag = inverse.make_output_vec();
    inverse
        .process(&mut input, &mut at_lag)
        .expect("the ends are zero");
    let most = (LONGEST_LAG_S * rate_hz).floor() as i64;
    let rows = at_lag.len() as i64;
    (-most..=most)
        .map(|lag| (lag, at_lag[lag.rem_euclid(rows) as usize]))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        .map_or((0.0, 0.0), |(lag, value)| (lag as f64 / rate_hz, value))
}

/// Chance that |C| is as large in ν dimensions without a connection: C² ~ Beta(1/2, (ν − 1)/2).
fn chance(coherence: f64, dimensions: f64) -> f64 {
    /// Two dimensions and fewer (one bin) agree with anything.
    const LEAST: f64 = 3.0;
    if dimensions < LEAST {
        return 1.0;
    }
    Beta::new(0.5, 0.5 * (dimensions - 1.0))
        .map_or(1.0, |law| law.sf((coherence * coherence).min(1.0)))
}
