//! Narrowband noise of a unit at rest: lines that keep no phase, such as a resonance of the mount that noise excites.
//!
//! Sliding windows of each width find a band that exceeds the fitted noise and its own neighbourhood. The Whittle likelihood
//! of a local noise level and a Lorentzian, the response of a lightly damped resonance to white noise, then gives its
//! frequency, width and power. Coefficients in a band are reduced to the level beside it, so that the noise terms and the
//! locations hold only the other noise.

use rlg_inference::transform::Transform;
use rlg_inference::{NoiseLevels, Observations};
use rlg_plan::BandPlan;
use rlg_signal::streams::{Triad, each_axis};

use super::line::Clock;
use crate::rows::pulse_resolution::Lattice;

/// A band of noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Band {
    /// Centre and its standard deviation \[Hz\].
    pub(crate) hz: [f64; 2],
    /// Full width at half the maximum power, and its standard deviation \[Hz\].
    pub(crate) width_hz: [f64; 2],
    /// Root mean square rate on each gyro, and its standard deviation \[rad/s\]; 0 on a gyro where it is not significant.
    pub(crate) rms_rad_s: [[f64; 2]; 3],
    /// Maximum power on each gyro over that of the noise beside the band \[1\]; 0 likewise.
    over_beside: [f64; 3],
    /// 2 Δ ln L of its powers, summed over the gyros that show it.
    pub(crate) gain: f64,
    /// ln of its false-alarm probability, trials counted.
    pub(crate) ln_chance: f64,
}

/// Bands of all gyros.
pub(crate) struct Bands {
    pub(crate) bands: Vec<Band>,
    /// Difference of the residual and its rows reduced to the level beside the bands \[rad\].
    pub(crate) rows_rad: Triad,
}

/// Rows of a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a> {
    /// Residual of the gyros without lines \[rad\].
    pub(crate) left_rad: &'a Triad,
    /// Rows on which bands are sought.
    pub(crate) seen: &'a [bool],
    /// Rows with a measurement, held-out ones included.
    pub(crate) usable: &'a [bool],
    pub(crate) clock: Clock,
}

/// Finds bands.
///
/// # Inputs
/// `levels`: noise of the residual; `lattice`: pulse quantisation, which hides bands.
pub(crate) fn search(
    rows: &Rows,
    levels: &[NoiseLevels],
    lattice: &Lattice,
    plan: &BandPlan,
) -> Option<Bands> {
    let observations = Observations::bridged(rows.seen).ok()?;
    let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(levels));
    let noise = each_axis(|gyro| basis.by_coefficient(levels[gyro]));
    let mut spectra = each_axis(|gyro| transform.spectrum(&rows.left_rad[gyro]));
    let coefficients = noise[0].len();
    let seen = rows.seen.iter().filter(|&&seen| seen).count();
    let grid = Grid {
        coefficient_hz: 0.5 * rows.clock.rate_hz / coefficients as f64,
        seen_share: seen as f64 / coefficients as f64,
        rate_hz: rows.clock.rate_hz,
    };
    let mut bands: Vec<Band> = Vec::new();
    while bands.len() < plan.most {
        let powers: Triad = each_axis(|gyro| {
            let pairs = spectra[gyro].iter().zip(&noise[gyro]);
            pairs.map(|(value, noise)| value * value / noise).collect()
        });
        let peaks = powers.iter().filter_map(|power| strongest(power, plan));
        let Some(peak) = peaks.min_by(|a, b| a.ln_chance.total_cmp(&b.ln_chance)) else {
            break;
        };
        let shape = Shape::fitted(&powers, &peak, plan);
        let band = Band {
            ln_chance: peak.ln_chance,
            ..measured((&powers, &noise), &shape, grid, lattice, plan)
        };
        if band.over_beside == [0.0; 3] {
            break;
        }
        quiet(&mut spectra, &band, grid.coefficient_hz);
        bands.push(band);
    }
    Some(Bands {
        rows_rad: beyond_beside(rows, &bands, levels)?,
        bands,
    })
}

/// Frequencies of the coefficients of a span.
#[derive(Debug, Clone, Copy)]
struct Grid {
    coefficient_hz: f64,
    /// Share of its rows that are seen: bridged rows hold no band.
    seen_share: f64,
    rate_hz: f64,
}

/// Reduces the coefficients of a band to the level beside it.
fn quiet(spectra: &mut Triad, band: &Band, coefficient_hz: f64) {
    for (spectrum, share) in spectra.iter_mut().zip(band.over_beside) {
        for (k, value) in spectrum.iter_mut().enumerate() {
            let away = 2.0 * (k as f64 * coefficient_hz - band.hz[0]) / band.width_hz[0];
            *value /= (1.0 + share / (1.0 + away * away)).sqrt();
        }
    }
}

/// Difference of all usable rows and the same reduced to the level beside the bands \[rad\].
fn beyond_beside(rows: &Rows, bands: &[Band], levels: &[NoiseLevels]) -> Option<Triad> {
    if bands.is_empty() {
        return Some(each_axis(|gyro| vec![0.0; rows.left_rad[gyro].len()]));
    }
    let observations = Observations::bridged(rows.usable).ok()?;
    let (transform, _) = Transform::with_basis(observations, NoiseLevels::mean(levels));
    let before = each_axis(|gyro| transform.spectrum(&rows.left_rad[gyro]));
    let mut after = before.clone();
    let coefficient_hz = 0.5 * rows.clock.rate_hz / before[0].len() as f64;
    for band in bands {
        quiet(&mut after, band, coefficient_hz);
    }
    Some(each_axis(|gyro| {
        let pairs = before[gyro].iter().zip(&after[gyro]);
        let beyond: Vec<f64> = pairs.map(|(before, after)| before - after).collect();
        transform.rows_of(&beyond)
    }))
}

/// Window of coefficients with excess power.
struct Peak {
    centre: usize,
    half_width: usize,
    ln_chance: f64,
}

/// Most significant window over all widths and places, if it is significant.
fn strongest(power: &[f64], plan: &BandPlan) -> Option<Peak> {
    let BandPlan { around, guard, .. } = *plan;
    let mut sums = vec![0.0; power.len() + 1];
    for (k, value) in power.iter().enumerate() {
        sums[k + 1] = sums[k] + value;
    }
    let sum = |from: usize, to: usize| sums[to] - sums[from];
    let mut best: Option<Peak> = None;
    let mut trials = 0_usize;
    let mut half = plan.least_half_width;
    // A band narrower than its frequency by less than this is broad noise, which the noise terms hold.
    let narrow =
        |centre: usize, half: usize| centre as f64 > plan.least_quality * 2.0 * half as f64;
    while around * half * 2 < power.len() {
        for centre in (around * half..power.len() - around * half).step_by(half / 2) {
            if !narrow(centre, half) {
                continue;
            }
            trials += 1;
            let inside = sum(centre - half, centre + half);
            let guarded = sum(centre - guard * half, centre + guard * half);
            let beside = sum(centre - around * half, centre + around * half) - guarded;
            let counts = [2 * half, 2 * (around - guard) * half].map(|count| count as f64);
            let gain = excess_gain([inside, beside], counts);
            let ln_chance = -0.5 * gain;
            if best.as_ref().is_none_or(|best| ln_chance < best.ln_chance) {
                best = Some(Peak {
                    centre,
                    half_width: half,
                    ln_chance,
                });
            }
        }
        half *= 2;
    }
    let best = best?;
    let ln_chance = best.ln_chance + (3.0 * trials.max(1) as f64).ln();
    (ln_chance < plan.chance.ln()).then_some(Peak { ln_chance, ..best })
}

/// 2 Δ ln L of excess power in a window: over its neighbourhood, or over the fitted noise, the smaller; 0 for a lack.
///
/// # Inputs
/// Sums of squares over noise and their numbers, in the window and around it.
fn excess_gain([inside, around]: [f64; 2], [count, many]: [f64; 2]) -> f64 {
    let (mean, level) = (inside / count, around / many);
    if mean <= level.max(1.0) || level <= 0.0 {
        return 0.0;
    }
    let pooled = (inside + around) / (count + many);
    let over_around = count * (pooled / mean).ln() + many * (pooled / level).ln();
    let over_noise = count * (mean - 1.0 - mean.ln());
    over_around.min(over_noise)
}

/// Lorentzian in units of coefficients, 1 at its centre.
#[derive(Debug, Clone, Copy)]
struct Shape {
    centre: f64,
    /// Half-width at half the maximum.
    half_width: f64,
    /// Centre and half-width of the region of the fit, fixed so that likelihoods compare.
    about: [usize; 2],
}

impl Shape {
    fn at(&self, k: usize) -> f64 {
        let away = (k as f64 - self.centre) / self.half_width;
        1.0 / (1.0 + away * away)
    }

    fn region(&self, coefficients: usize) -> std::ops::Range<usize> {
        let [centre, reach] = self.about;
        centre.saturating_sub(reach).max(1)..(centre + reach).min(coefficients)
    }

    /// Fits place and width of a band common to all gyros.
    fn fitted(powers: &Triad, peak: &Peak, plan: &BandPlan) -> Self {
        /// Steps of the compass search as shares of the half-width, and their number of halvings.
        const STEP: f64 = 0.5;
        const HALVINGS: usize = 8;
        let mut best = Self {
            centre: peak.centre as f64,
            half_width: 0.5 * peak.half_width as f64,
            about: [peak.centre, plan.reach * peak.half_width],
        };
        let ln_likelihood = |shape: &Self| -> f64 {
            let each = powers.iter().map(|power| Levels::fitted(power, shape));
            each.map(|levels| levels.ln_likelihood).sum()
        };
        let mut highest = ln_likelihood(&best);
        let mut step = STEP;
        for _ in 0..HALVINGS {
            loop {
                let tried = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)];
                let moved = tried.map(|(along, wider)| Self {
                    centre: best.centre + along * best.half_width,
                    half_width: (best.half_width * f64::exp(wider))
                        .clamp(1.0, 0.25 * best.about[1] as f64),
                    ..best
                });
                let found = moved
                    .into_iter()
                    .map(|shape| (ln_likelihood(&shape), shape));
                let Some((value, shape)) = found.max_by(|a, b| a.0.total_cmp(&b.0)) else {
                    break;
                };
                if value <= highest + 1e-6 {
                    break;
                }
                (highest, best) = (value, shape);
            }
            step *= 0.5;
        }
        best
    }

    /// Standard deviations of centre and half-width, by the curvature of the likelihood.
    fn stds(&self, powers: &Triad) -> [f64; 2] {
        /// Step as a share of the half-width.
        const STEP: f64 = 0.25;
        let ln_likelihood = |along: f64, wider: f64| -> f64 {
            let shape = Self {
                centre: self.centre + along * self.half_width,
                half_width: self.half_width * (1.0 + wider),
                ..*self
            };
            let each = powers.iter().map(|power| Levels::fitted(power, &shape));
            each.map(|levels| levels.ln_likelihood).sum()
        };
        let here = ln_likelihood(0.0, 0.0);
        let std = |[a, b]: [f64; 2]| {
            let curvature = (2.0 * here - a - b) / (STEP * STEP);
            self.half_width / curvature.max(f64::MIN_POSITIVE).sqrt()
        };
        [
            std([ln_likelihood(STEP, 0.0), ln_likelihood(-STEP, 0.0)]),
            std([ln_likelihood(0.0, STEP), ln_likelihood(0.0, -STEP)]),
        ]
    }
}

/// Levels of the noise beside a band and of the band's maximum, both over the fitted noise.
struct Levels {
    beside: f64,
    band: f64,
    band_std: f64,
    /// Whittle likelihood, and 2 Δ ln L over noise of one level.
    ln_likelihood: f64,
    gain: f64,
}

impl Levels {
    /// Maximises the Whittle likelihood of squares with the expectation `beside + band × shape`, both positive, by Fisher's
    /// scoring.
    fn fitted(power: &[f64], shape: &Shape) -> Self {
        const STEPS: usize = 12;
        let region = shape.region(power.len());
        let rows = || region.clone().map(|k| (power[k], shape.at(k)));
        let mean = power[region.clone()].iter().sum::<f64>() / region.len().max(1) as f64;
        let ln_likelihood = |beside: f64, band: f64| -> f64 {
            let each = rows().map(|(power, shape)| {
                let expected = beside + band * shape;
                -0.5 * (expected.ln() + power / expected)
            });
            each.sum()
        };
        let (mut beside, mut band) = (mean, mean);
        let mut information = [0.0; 3];
        for _ in 0..STEPS {
            information = [0.0; 3];
            let mut moments = [0.0; 2];
            for (power, shape) in rows() {
                let expected = beside + band * shape;
                let weight = 1.0 / (expected * expected);
                information[0] += weight;
                information[1] += weight * shape;
                information[2] += weight * shape * shape;
                moments[0] += weight * power;
                moments[1] += weight * power * shape;
            }
            let [bb, bs, ss] = information;
            let determinant = bb * ss - bs * bs;
            if determinant <= 0.0 {
                break;
            }
            let next = [
                (ss * moments[0] - bs * moments[1]) / determinant,
                (bb * moments[1] - bs * moments[0]) / determinant,
            ];
            // Half the way at most to the edge of what is positive.
            beside = next[0].max(0.5 * beside);
            band = next[1].max(0.5 * band);
        }
        let [bb, bs, ss] = information;
        let of_band = 0.5 * (ss - bs * bs / bb.max(f64::MIN_POSITIVE));
        let reached = ln_likelihood(beside, band);
        Self {
            beside,
            band,
            band_std: 1.0 / of_band.max(f64::MIN_POSITIVE).sqrt(),
            ln_likelihood: reached,
            gain: 2.0 * (reached - ln_likelihood(mean, 0.0)),
        }
    }
}

/// Measures a band on every gyro.
fn measured(
    (powers, noise): (&Triad, &Triad),
    shape: &Shape,
    grid: Grid,
    lattice: &Lattice,
    plan: &BandPlan,
) -> Band {
    let coefficients = noise[0].len();
    let hz = shape.centre * grid.coefficient_hz;
    let [centre_std, half_std] = shape.stds(powers);
    let mut band = Band {
        hz: [hz, centre_std * grid.coefficient_hz],
        width_hz: [shape.half_width, half_std].map(|half| 2.0 * half * grid.coefficient_hz),
        rms_rad_s: [[0.0; 2]; 3],
        over_beside: [0.0; 3],
        gain: 0.0,
        ln_chance: 0.0,
    };
    for gyro in 0..3 {
        let levels = Levels::fitted(&powers[gyro], shape);
        let maximum = levels.band * noise[gyro][(shape.centre as usize).min(coefficients - 1)];
        // The integral of a Lorentzian is π times its half-width.
        let sum_rad2 = maximum * std::f64::consts::PI * shape.half_width / grid.seen_share;
        let rms_rad_s = (sum_rad2 / coefficients as f64).sqrt() * grid.rate_hz;
        let angle_rad = rms_rad_s / (std::f64::consts::TAU * hz);
        if levels.gain < 2.0 * plan.naming || lattice.hides_angle(gyro, angle_rad) {
            continue;
        }
        let relative_std = 0.5 * levels.band_std / levels.band;
        band.rms_rad_s[gyro] = [rms_rad_s, rms_rad_s * relative_std];
        band.over_beside[gyro] = levels.band / levels.beside;
        band.gain += levels.gain;
    }
    band
}

#[cfg(test)]
mod tests {
    use super::{Band, Clock, Lattice, Rows, search};
    use rlg_inference::NoiseLevels;
    use rlg_plan::BandPlan;
    use rlg_signal::streams::Triad;
    use std::f64::consts::TAU;

    const ROWS: usize = 30_000;
    const CLOCK: Clock = Clock {
        rows: ROWS,
        rate_hz: 100.0,
    };

    /// Independent numbers of mean 0 and variance 1 (Knuth's MMIX congruence).
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 12.0_f64.sqrt()
        }
    }

    /// White rows of `white_rad` and the response of a resonance to noise, `rms_rad`.
    fn rows(white_rad: f64, (hz, width_hz, rms_rad): (f64, f64, f64), seed: u64) -> Vec<f64> {
        let (mut white, mut driven) = (noise(seed), noise(seed + 1000));
        let pole = (-TAU / 2.0 * width_hz / CLOCK.rate_hz).exp();
        let turn = TAU * hz / CLOCK.rate_hz;
        let [one, two] = [2.0 * pole * turn.cos(), -pole * pole];
        let mut last = [0.0; 2];
        let response: Vec<f64> = (0..ROWS)
            .map(|_| {
                let now = one * last[0] + two * last[1] + driven();
                last = [now, last[0]];
                now
            })
            .collect();
        let square = response.iter().map(|value| value * value).sum::<f64>() / ROWS as f64;
        let each = response.iter();
        each.map(|value| white_rad * white() + rms_rad * value / square.sqrt())
            .collect()
    }

    fn levels(white_rad: f64) -> [NoiseLevels; 3] {
        [NoiseLevels {
            white: white_rad * white_rad,
            angle: 0.0,
            flicker: 0.0,
            walk: 0.0,
        }; 3]
    }

    /// Bands beside white noise of 1e-6 rad a row.
    fn found(left_rad: &Triad) -> Vec<Band> {
        // Six of every thirty seconds are held out.
        let seen: Vec<bool> = (0..ROWS).map(|row| (row / 600) % 5 != 4).collect();
        let rows = Rows {
            left_rad,
            seen: &seen,
            usable: &[true; ROWS],
            clock: CLOCK,
        };
        let (lattice, plan) = (Lattice::default(), BandPlan::default());
        let found = search(&rows, &levels(1e-6), &lattice, &plan);
        found.expect("rows").bands
    }

    #[test]
    fn a_driven_resonance_is_measured() {
        for seed in 1..6 {
            let left: Triad = [
                rows(1e-6, (31.4, 0.2, 6e-6), seed),
                rows(1e-6, (31.4, 0.2, 0.0), seed + 10),
                rows(1e-6, (31.4, 0.2, 3e-6), seed + 20),
            ];
            let found = found(&left);
            let [band] = &found[..] else {
                panic!("{found:?}");
            };
            let near = |[value, std]: [f64; 2], truth: f64| {
                assert!(
                    (value - truth).abs() < 5.0 * std,
                    "{value} ± {std}: {truth}"
                );
                assert!(std < 0.2 * truth, "{value} ± {std}: {truth}");
            };
            near(band.hz, 31.4);
            near(band.width_hz, 0.2);
            near(band.rms_rad_s[0], 6e-4);
            assert_eq!(band.rms_rad_s[1], [0.0; 2]);
            near(band.rms_rad_s[2], 3e-4);
        }
    }

    #[test]
    fn white_noise_has_no_band() {
        for seed in 1..40 {
            let left: Triad = [0, 1, 2].map(|gyro| rows(1e-6, (20.0, 1.0, 0.0), seed + 100 * gyro));
            let found = found(&left);
            assert!(found.is_empty(), "{seed}: {found:?}");
        }
    }
}
