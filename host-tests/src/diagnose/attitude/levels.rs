//! The levels of the noise of attitude errors: declared ones, checked, and re-estimated where there are enough stamps.
//!
//! Enters: error angles and the columns to be fitted beside. Leaves: [`Levels`] of largest restricted likelihood,
//! ln L = −½ ln det − ½ |whitened|² + ln evidence of the columns, so that what the columns eat is not missed.
//!
//! A declared level stands unless freeing it gains more than chance gives (four standard deviations): a minute of
//! attitudes knows it worse than the instrument's maker. Drift (random walk of rate) is declared by nobody and comes
//! in when it helps at all clearly, because a drift overlooked becomes physics.

use super::bench::AttitudeBench;
use super::whiten::Levels;

/// What the model declares.
#[derive(Debug, Clone, Copy)]
pub struct DeclaredLevels {
    /// Random walk of each gyro and the reference \[rad²/s\], where stated.
    pub walk_rad2_s: [Option<f64>; 3],
    /// White noise of angle of each gyro \[rad²\]: pulses and pickoff.
    pub gyro_white_rad2: [f64; 3],
    /// White noise of angle of the reference \[rad²\], where stated.
    pub reference_white_rad2: Option<f64>,
}

/// A reference where nothing is declared \[rad²\]: an arc second.
const USUAL_WHITE_RAD2: f64 = 2.4e-11;

impl DeclaredLevels {
    /// The declared levels, usual ones where none is; without a look at the data.
    pub fn plain(&self) -> Levels {
        Levels {
            walk_rad2_s: self
                .walk_rad2_s
                .map(|walk| walk.filter(|walk| *walk > 0.0).unwrap_or(USUAL_WALK_RAD2_S)),
            gyro_white_rad2: self.gyro_white_rad2,
            reference_white_rad2: self.reference_white_rad2.unwrap_or(USUAL_WHITE_RAD2),
            drift_rad2_s3: 0.0,
        }
    }
}

/// Gain of ln L for which a declared level gives way.
const CONTRADICTED: f64 = 8.0;

/// Gain of ln L for which drift comes in: two standard deviations.
const DRIFTS: f64 = 2.0;

/// Fewer free numbers than this among the steps, and levels cannot be known better than declared.
pub const ENOUGH: usize = 60;

/// A ring laser's walk where nothing is declared \[rad²/s\]: 0.002 °/√h.
const USUAL_WALK_RAD2_S: f64 = 3.4e-13;

/// Index of the levels that may move: walks of x, y, z, white of the reference, drift.
const DRIFT: usize = 4;

fn get(levels: &Levels, level: usize) -> f64 {
    match level {
        3 => levels.reference_white_rad2,
        DRIFT => levels.drift_rad2_s3,
        axis => levels.walk_rad2_s[axis],
    }
}

fn with(levels: &Levels, level: usize, value: f64) -> Levels {
    let mut changed = *levels;
    match level {
        3 => changed.reference_white_rad2 = value,
        DRIFT => changed.drift_rad2_s3 = value,
        axis => changed.walk_rad2_s[axis] = value,
    }
    changed
}

/// Where the search starts: the declared levels, and guesses from the data for those that nobody declares.
pub fn first(declared: &DeclaredLevels, bench: &AttitudeBench) -> Levels {
    let plain = declared.plain();
    Levels {
        reference_white_rad2: declared
            .reference_white_rad2
            .unwrap_or_else(|| bench.rough_white_rad2()),
        ..plain
    }
}

/// Fits. `effects` are fitted beside.
pub fn fit(bench: &AttitudeBench, effects: &[usize], declared: &DeclaredLevels) -> Levels {
    let mut levels = first(declared, bench);
    if bench.degrees() < ENOUGH {
        return levels;
    }
    let undeclared = (0..3)
        .filter(|axis| declared.walk_rad2_s[*axis].is_none())
        .chain(declared.reference_white_rad2.is_none().then_some(3));
    let mut free: Vec<usize> = undeclared.collect();
    let scored = bench.scorer(effects, &levels);
    let score = |levels: &Levels| bench.score(levels, &scored);
    let mut best = score(&levels);
    settle(&mut levels, &mut best, &free, &score);
    loop {
        let gained = (0..=DRIFT)
            .filter(|level| !free.contains(level))
            .map(|level| {
                let (tried, value) = alone(&levels, level, bench, &score);
                let needed = if level == DRIFT { DRIFTS } else { CONTRADICTED };
                (level, tried, value, value - best - needed)
            })
            .filter(|(_, _, _, beyond)| *beyond > 0.0)
            .max_by(|a, b| a.3.total_cmp(&b.3));
        let Some((level, tried, value, _)) = gained else {
            return levels;
        };
        (levels, best) = (tried, value);
        free.push(level);
        settle(&mut levels, &mut best, &free, &score);
    }
}

/// One level moved by itself to its best.
fn alone(
    levels: &Levels,
    level: usize,
    bench: &AttitudeBench,
    score: &dyn Fn(&Levels) -> f64,
) -> (Levels, f64) {
    let mut start = *levels;
    if level == DRIFT && levels.drift_rad2_s3 == 0.0 {
        // Drift that over the record walks a hundredth as far as the random walk of angle.
        let walk = levels.walk_rad2_s.iter().sum::<f64>() / 3.0;
        start = with(
            levels,
            DRIFT,
            0.03 * walk / bench.seconds().powi(2).max(1.0),
        );
    }
    if get(&start, level) <= 0.0 {
        start = with(&start, level, 1e-16);
    }
    let mut best = score(&start);
    settle(&mut start, &mut best, &[level], score);
    (start, best)
}

/// Pattern search in the logarithms of the free levels.
fn settle(levels: &mut Levels, best: &mut f64, free: &[usize], score: &dyn Fn(&Levels) -> f64) {
    for factor in [8.0, 2.5, 1.5, 1.15] {
        loop {
            let mut moved = false;
            for &level in free {
                for factor in [factor, 1.0 / factor] {
                    loop {
                        let tried = with(levels, level, get(levels, level) * factor);
                        let value = score(&tried);
                        /// Less is no progress.
                        const PROGRESS: f64 = 1e-3;
                        if value.is_nan() || value < *best + PROGRESS {
                            break;
                        }
                        (*levels, *best) = (tried, value);
                        moved = true;
                    }
                }
            }
            if !moved || free.len() < 2 {
                break;
            }
        }
    }
}
