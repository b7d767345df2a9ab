//! The noise of a residual, in Allan terms.
//!
//! Enters: a residual's bins on a [`Portion`], columns it was or will be fitted with, and the noise the
//! model declares. Leaves: [`Noise`], S(f) per row \[rad²\] = Σ θ_b B_b(f) with B = 1 (random walk of angle),
//! 4 sin²(πf/fs) (white angle: quantisation, pickoff, reference), 1/f (flicker) and 1/(4 sin²(πf/fs))
//! (rate random walk).
//!
//! Fitted by multiplicative steps on the Whittle likelihood with the leverage of the fitted columns taken
//! out; without that the level comes out low and everything looks significant. A declared level stands
//! unless the data contradict it, because a minute of data knows it worse than the instrument's maker.
//!
//! Deliberately not here: lines, and noise that changes with time; both show as located tiles.

use super::levels::Levels;
use super::portion::{Bins, Portion, differenced};
use super::regressor::{Regressor, gram, leverage};
use nalgebra::{DMatrix, DVector};
use realfft::num_complex::Complex64;
use rlg_diagnosis::noise_spectrum::level_of;
pub use rlg_diagnosis::noise_spectrum::{Declared, LOWEST_SHARE, Noise, TERM_NAMES, TERMS};

/// Share of a first guess below which no term starts: it takes few steps from there to nothing or to its place.
const RESEED: f64 = 1e-2;

/// A declared level is kept unless the fitted one is further away than this many of its standard errors.
const CONTRADICTED: f64 = 4.0;

/// The share of the drifting terms in S, from the lowest bin to where they are next to nothing.
pub fn drift_shares(noise: &Noise, portion: &Portion) -> Vec<f64> {
    /// A level that is known to a tenth moves S by 1e-4 there.
    const NOTHING: f64 = 1e-3;
    let floor_hz = portion.frequency_hz(1) * LOWEST_SHARE;
    let steady = noise.steady();
    (0..portion.bins())
        .map(|bin| {
            let frequency_hz = portion.frequency_hz(bin);
            1.0 - steady.at(frequency_hz, floor_hz) / noise.at(frequency_hz, floor_hz)
        })
        .take_while(|share| *share > NOTHING)
        .collect()
}

/// What one term contributes to S in every bin \[rad²\].
pub fn of_one_term(noise: &Noise, portion: &Portion, term: usize) -> Vec<f64> {
    shapes_of(portion, noise.rate_hz)
        .iter()
        .map(|shape| shape[term] * noise.theta[term])
        .collect()
}

/// Relative standard error of one level where all others are known: Whittle information on ln θ.
pub fn level_error(noise: &Noise, portion: &Portion, term: usize) -> f64 {
    relative_error(
        noise,
        portion,
        &shapes_of(portion, noise.rate_hz),
        term,
        noise.theta[term],
    )
}

/// 2 Δ ln L of the noise as fitted over the best with one level held at `level`.
pub fn ratio_over_level(
    portion: &Portion,
    left: &Bins,
    noise: &Noise,
    term: usize,
    level: f64,
) -> f64 {
    let shapes = shapes_of(portion, noise.rate_hz);
    let power = power_of(portion, left);
    let degrees: Vec<f64> = (0..portion.bins())
        .map(|bin| portion.degrees(bin))
        .collect();
    let levels = Levels::new(&power, &degrees, &shapes);
    let (mut start, mut held) = (noise.theta, [false; TERMS]);
    (start[term], held[term]) = (level, true);
    let fitted = levels.most_likely(&noise.theta, [false; TERMS]).1;
    2.0 * (fitted - levels.most_likely(&start, held).1).max(0.0)
}

/// A series of one gyro's residual.
pub struct Series<'a> {
    /// Which rows, or blocks of rows.
    pub portion: &'a Portion,
    /// The residual's bins.
    pub residual: &'a Bins,
    /// What is fitted away, joints included.
    pub columns: Vec<&'a Regressor>,
    /// Rows in a block; 1 at the full rate.
    pub block_rows: usize,
}

/// Fits the noise of `residual` after the columns (already including joints) are fitted away.
pub fn fit(
    portion: &Portion,
    residual: &Bins,
    columns: &[&Regressor],
    declared: Declared,
    start: Option<Noise>,
) -> Noise {
    let rows = Series {
        portion,
        residual,
        columns: columns.to_vec(),
        block_rows: 1,
    };
    fit_all(&rows, None, declared, start)
}

/// The same of rows at the full rate and of sums over blocks of rows, each in a band of its own: one S per row.
pub fn fit_all(
    rows: &Series,
    blocks: Option<&Series>,
    declared: Declared,
    start: Option<Noise>,
) -> Noise {
    let (portion, residual) = (rows.portion, rows.residual);
    let rate_hz = portion.seconds().recip() * portion.rows() as f64;
    let shapes = shapes_of(portion, rate_hz);
    let mut noise = first_guess(portion, residual, &shapes, declared, rate_hz);
    if let Some(start) = start {
        // A term that an earlier, larger library had eaten can grow again: multiplying never leaves zero.
        for (seed, theta) in noise.theta.iter_mut().zip(start.theta) {
            *seed = theta.max(*seed * RESEED);
        }
    }
    /// The fit of the columns depends weakly on S: alternate this often.
    const ALTERNATIONS: usize = 2;
    for alternation in 1..=ALTERNATIONS {
        // The lowest frequencies first, where drift is looked for.
        let mut levels = blocks.map_or_else(Levels::none, |blocks| {
            levels_of(blocks, &noise, &shapes_of_blocks(blocks, rate_hz))
        });
        levels.append(levels_of(rows, &noise, &shapes));
        let fitted = levels.most_likely(&noise.theta, [false; TERMS]);
        noise.theta = if alternation == ALTERNATIONS {
            with_declared(&levels, fitted, declared)
        } else {
            fitted.0
        };
    }
    /// Share of the declared level below which no fitted level goes.
    const QUIETEST: f64 = 1e-6;
    let least = declared
        .white_angle
        .unwrap_or(0.0)
        .max(f64::MIN_POSITIVE.sqrt())
        * QUIETEST;
    // A channel without any noise would make every weight infinite; one that only walks has no white noise of angle, whatever
    // is declared.
    let is_silent = noise.theta[1] < least && noise.theta[0] < least;
    if !noise.theta.iter().all(|theta| theta.is_finite()) || is_silent {
        noise = first_guess(portion, residual, &shapes, declared, rate_hz);
    }
    noise.theta[1] = noise.theta[1].max(least);
    noise
}

/// What one series says of the levels once its columns are fitted away.
fn levels_of(series: &Series, noise: &Noise, shapes: &[[f64; TERMS]]) -> Levels {
    let portion = series.portion;
    let weights = noise.of_blocks(series.block_rows).weights(portion);
    let (left, leverage) = project_out(portion, series.residual, &series.columns, &weights);
    let free: Vec<f64> = leverage
        .iter()
        .enumerate()
        .map(|(bin, taken)| (portion.degrees(bin) - taken).max(0.0))
        .collect();
    Levels::new(&left, &free, shapes)
}

/// The shapes in sums over blocks, for levels per row ([`Noise::of_blocks`]).
fn shapes_of_blocks(series: &Series, rate_hz: f64) -> Vec<[f64; TERMS]> {
    let unit = Noise {
        theta: [1.0; TERMS],
        rate_hz,
    };
    let of_block = unit.of_blocks(series.block_rows);
    let mut shapes = shapes_of(series.portion, of_block.rate_hz);
    for shape in &mut shapes {
        for (shape, factor) in shape.iter_mut().zip(of_block.theta) {
            *shape *= factor;
        }
    }
    shapes
}

fn shapes_of(portion: &Portion, rate_hz: f64) -> Vec<[f64; TERMS]> {
    let floor_hz = portion.frequency_hz(1) * LOWEST_SHARE;
    (0..portion.bins())
        .map(|bin| Noise::terms_in(portion, bin, rate_hz, floor_hz))
        .collect()
}

/// Whittle information on ln θ: half the degrees of freedom, weighted by the term's share squared.
fn relative_error(
    noise: &Noise,
    portion: &Portion,
    shapes: &[[f64; TERMS]],
    term: usize,
    level: f64,
) -> f64 {
    let information: f64 = shapes
        .iter()
        .enumerate()
        .map(|(bin, shape)| {
            0.5 * portion.degrees(bin) * (shape[term] * level / level_of(shape, noise)).powi(2)
        })
        .sum();
    information.max(1e-12).sqrt().recip()
}

/// Power left in each bin after the columns, and how much of each bin's freedom they took.
fn project_out(
    portion: &Portion,
    residual: &Bins,
    columns: &[&Regressor],
    weights: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let count = columns.len();
    let gram = gram(columns, residual, weights);
    let scales: Vec<f64> = (0..count)
        .map(|a| gram[(a, a)].sqrt().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(count, count, |a, b| gram[(a, b)] / (scales[a] * scales[b]));
    let right = DVector::from_fn(count, |a, _| gram[(count, a)] / scales[a]);
    let inverse = super::information::stable_inverse(&scaled);
    let solution = &inverse * right;
    let root = inverse.symmetric_eigen();
    let half = DMatrix::from_fn(count, count, |a, direction| {
        root.eigenvectors[(a, direction)] * root.eigenvalues[direction].max(0.0).sqrt() / scales[a]
    });
    let mut left = residual.clone();
    for (column, (size, scale)) in columns.iter().zip(solution.iter().zip(&scales)) {
        column.add_to(&mut left, -size / scale);
    }
    let left = power_of(portion, &left);
    let mut leverage = leverage(columns, &half, weights);
    for (bin, taken) in leverage.iter_mut().enumerate() {
        *taken = taken.min(portion.degrees(bin));
    }
    (left, leverage)
}

/// Power in the bins that count.
fn power_of(portion: &Portion, bins: &Bins) -> Vec<f64> {
    let power = |(bin, value): (usize, &Complex64)| {
        if portion.counts(bin) {
            value.norm_sqr()
        } else {
            0.0
        }
    };
    bins.iter().enumerate().map(power).collect()
}

fn first_guess(
    portion: &Portion,
    residual: &Bins,
    shapes: &[[f64; TERMS]],
    declared: Declared,
    rate_hz: f64,
) -> Noise {
    let bins = portion.bins();
    let top = bins - bins / 4;
    let white_angle = declared.white_angle.unwrap_or_else(|| {
        let mean: f64 = (top..bins)
            .map(|bin| residual[bin].norm_sqr() / (portion.degrees(bin) * shapes[bin][1]))
            .sum();
        mean / (bins - top) as f64
    });
    // Without a declared random walk, start where it meets the white noise at a hundredth of the band.
    let corner = differenced(0.005, 1.0);
    let random_walk = declared.random_walk.unwrap_or(white_angle * corner);
    // The drifting terms start below everything and grow only if the data pull them.
    /// Share of the random walk at one hertz with which the drifting terms start.
    const SEED: f64 = 1e-3;
    let at_one_hz = shapes[1][3] * portion.frequency_hz(1).powi(2);
    Noise {
        theta: [
            random_walk,
            white_angle,
            SEED * random_walk,
            SEED * random_walk / at_one_hz,
        ],
        rate_hz,
    }
}

/// The declared levels where the fit does not contradict them, all others fitted beside them: a level put back
/// alone would leave too much or too little of those that share its band.
fn with_declared(
    levels: &Levels,
    (theta, likelihood): ([f64; TERMS], f64),
    declared: Declared,
) -> [f64; TERMS] {
    let known = [declared.random_walk, declared.white_angle];
    let known = known.map(|level| level.filter(|level| *level > 0.0));
    for kept in [[true, true], [false, true], [true, false]] {
        let (mut start, mut held) = (theta, [false; TERMS]);
        for term in 0..2 {
            if let (true, Some(level)) = (kept[term], known[term]) {
                (start[term], held[term]) = (level, true);
            }
        }
        let (theta, as_declared) = levels.most_likely(&start, held);
        if 2.0 * (likelihood - as_declared) < CONTRADICTED * CONTRADICTED {
            return theta;
        }
    }
    theta
}
