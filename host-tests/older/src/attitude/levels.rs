//! The levels of the noise of attitude errors: declared ones, checked, and re-estimated where there are enough stamps.
//!
//! Enters: error angles and the columns to be fitted beside. Leaves: [`Levels`] of largest restricted likelihood,
//! ln L = −½ ln det − ½ |whitened|² + ln evidence of the columns, so that what the columns eat is not missed.
//!
//! A declared level stands unless freeing it gains more than chance gives (four standard deviations): a minute of
//! attitudes knows it worse than the instrument's maker. Drift (random walk of rate) is declared by nobody and comes
//! in when it helps at all clearly, because a drift overlooked becomes physics. Where a walk above the declared one
//! is asked for, drifts that relax, as those of which flicker is made, may ask for the same and then leave it alone.

use super::bench::AttitudeBench;
use super::whiten::Levels;
use crate::excess::LEAST_EXCESS;

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
            drift_rad2_s3: [0.0; 3],
            drift_relaxes_s: f64::INFINITY,
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

/// A walk that no data are needed to rule out \[rad²/s\]: 0.2 °/√h.
const LARGEST_WALK_RAD2_S: f64 = 3.4e-9;

/// Index of the levels that may move: walks of x, y, z, white of the reference, drifts of x, y, z, all drifts, white of the
/// gyros.
const DRIFT: usize = 4;
const ALL_DRIFTS: usize = 7;
const GYRO_WHITE: usize = 8;

/// Seconds in which drifts may relax: their spectra bend at 0.5 to 0.005 Hz.
const RELAXES_S: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];

/// What the time in which they relax costs in ln L.
const RELAXATION: f64 = 1.0;

/// Steps that a drift must outlast: a shorter one is a random walk of angle.
const OUTLASTED: f64 = 4.0;

fn get(levels: &Levels, level: usize) -> f64 {
    match level {
        3 => levels.reference_white_rad2,
        ALL_DRIFTS => levels.drift_rad2_s3.into_iter().fold(0.0, f64::max),
        GYRO_WHITE => levels.gyro_white_rad2.into_iter().fold(0.0, f64::max),
        axis if axis < 3 => levels.walk_rad2_s[axis],
        drift => levels.drift_rad2_s3[drift - DRIFT],
    }
}

fn with(levels: &Levels, level: usize, value: f64) -> Levels {
    let mut changed = *levels;
    match level {
        3 => changed.reference_white_rad2 = value,
        ALL_DRIFTS => changed.drift_rad2_s3 = [value; 3],
        GYRO_WHITE => {
            let times = value / get(levels, GYRO_WHITE).max(f64::MIN_POSITIVE);
            changed.gyro_white_rad2 = levels.gyro_white_rad2.map(|white| times * white);
        }
        axis if axis < 3 => changed.walk_rad2_s[axis] = value,
        drift => changed.drift_rad2_s3[drift - DRIFT] = value,
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
        let gained = (0..=GYRO_WHITE)
            .filter(|level| !free.contains(level))
            .filter(|level| *level != GYRO_WHITE || get(&levels, GYRO_WHITE) > 0.0)
            .filter(|level| *level != ALL_DRIFTS || levels.drifting() == 0)
            .map(|level| {
                let (tried, value) = alone(&levels, level, bench, &score);
                let needed = match level {
                    DRIFT..=ALL_DRIFTS => DRIFTS,
                    _ => CONTRADICTED,
                };
                (level, tried, value, value - best - needed)
            })
            .filter(|(_, _, _, beyond)| *beyond > 0.0)
            .max_by(|a, b| a.3.total_cmp(&b.3));
        let Some((level, tried, value, _)) = gained else {
            break;
        };
        (levels, best) = (tried, value);
        match level {
            ALL_DRIFTS => free.extend(DRIFT..ALL_DRIFTS),
            one => free.push(one),
        }
        settle(&mut levels, &mut best, &free, &score);
    }
    allowed(&mut levels, declared, &score);
    relaxing(levels, declared, bench, &score)
}

/// Raises walks that nobody declares to the most that the data allow: from a few seconds of white noise a walk is not known
/// to be there, and one long step without it would show anything.
fn allowed(levels: &mut Levels, declared: &DeclaredLevels, score: &dyn Fn(&Levels) -> f64) {
    /// Loss of ln L: two standard deviations.
    const ALLOWED: f64 = 2.0;
    const FACTOR: f64 = 1.3;
    for axis in (0..3).filter(|axis| declared.walk_rad2_s[*axis].is_none()) {
        let best = score(levels);
        loop {
            let more = with(levels, axis, FACTOR * levels.walk_rad2_s[axis]);
            // Beyond any gyro that is worth a diagnosis.
            let is_credible = more.walk_rad2_s[axis] < LARGEST_WALK_RAD2_S;
            if !is_credible || score(&more) < best - ALLOWED {
                break;
            }
            *levels = more;
        }
    }
}

/// Whether walks above the declared ones are.
fn walks_more(levels: &Levels, declared: &DeclaredLevels) -> bool {
    let pairs = levels.walk_rad2_s.iter().zip(declared.walk_rad2_s);
    pairs
        .filter_map(|(walk, declared)| Some((walk, declared?)))
        .any(|(walk, declared)| *walk > LEAST_EXCESS * declared)
}

/// What was found, or where walks above the declared ones are in it, declared walks with drifts that relax if those
/// are as likely.
fn relaxing(
    levels: Levels,
    declared: &DeclaredLevels,
    bench: &AttitudeBench,
    score: &dyn Fn(&Levels) -> f64,
) -> Levels {
    if !walks_more(&levels, declared) {
        return levels;
    }
    let outlasted_s = OUTLASTED * bench.seconds() / (bench.degrees() as f64 / 3.0);
    // As many free numbers for the walks as for the drifts, and one more.
    let mut walking = (levels, score(&levels));
    settle(&mut walking.0, &mut walking.1, &[0, 1, 2], score);
    let mut likeliest = (levels, walking.1 + RELAXATION);
    let mut walks = levels.walk_rad2_s;
    for (walk, declared) in walks.iter_mut().zip(declared.walk_rad2_s) {
        *walk = declared.unwrap_or(*walk);
    }
    for relaxes_s in RELAXES_S.into_iter().filter(|time_s| *time_s > outlasted_s) {
        // As much angle in that time as the walks were asked to make.
        let drifts = [0, 1, 2].map(|axis: usize| {
            let more = (levels.walk_rad2_s[axis] - walks[axis]).max(0.01 * walks[axis]);
            more / relaxes_s.powi(2)
        });
        let mut tried = Levels {
            walk_rad2_s: walks,
            drift_rad2_s3: drifts,
            drift_relaxes_s: relaxes_s,
            ..levels
        };
        let mut value = score(&tried);
        settle(
            &mut tried,
            &mut value,
            &[DRIFT, DRIFT + 1, DRIFT + 2],
            score,
        );
        if value > likeliest.1 {
            likeliest = (tried, value);
        }
    }
    likeliest.0
}

/// One level moved by itself to its best.
fn alone(
    levels: &Levels,
    level: usize,
    bench: &AttitudeBench,
    score: &dyn Fn(&Levels) -> f64,
) -> (Levels, f64) {
    let mut start = *levels;
    if (DRIFT..=ALL_DRIFTS).contains(&level) && get(levels, level) == 0.0 {
        // Drift that over the record walks a hundredth as far as the random walk of angle.
        let walk = levels.walk_rad2_s.iter().sum::<f64>() / 3.0;
        start = with(
            levels,
            level,
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
