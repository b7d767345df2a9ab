//! Lists which combinations of the six K the recordings fix, and which they do not.
//!
//! From an [`Estimate`] it gives for each gyro either its two coefficients, or their sum, or less. What is not fixed is
//! named with the motion that would fix it (physics §3: a stationary oscillation shows only sums).

use std::collections::BTreeMap;

use super::estimate::Estimate;
use super::unknowns::PAIRS;
use rlg_findings::result::Identifiable;
use rlg_model::catalogue::SIX;
use rlg_signal::streams::AXES;

/// A combination is fixed when its spread is below this share of a typical K (or of its own value): seven
/// standard deviations from nothing, so that neither its sign nor its size is in doubt.
const FIXED_SHARE: f64 = 0.15;

/// K of real blocks \[s²\] (Tables 1 to 3: 0.67 to 1.5e-7).
pub const TYPICAL_S2: f64 = 1e-7;

/// What is known of one gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// Both coefficients.
    Both,
    /// Only one: 0 or 1 of the pair.
    One(usize),
    /// Only the sum.
    Sum,
    /// Nothing.
    Nothing,
}

/// What is known of one gyro's pair of coefficients.
pub struct Pair {
    /// The gyro: 0, 1, 2 for x, y, z.
    pub gyro: usize,
    /// What is known.
    pub known: Known,
}

/// A combination that is not fixed.
pub struct Unfixed {
    /// Index of K → weight.
    pub weights: Vec<(usize, f64)>,
    /// Its spread \[s²\].
    pub std: f64,
    /// The motion that would fix it.
    pub motion: String,
}

/// Decides for each gyro what is known.
pub fn pairs(estimate: &Estimate) -> [Pair; 3] {
    [0, 1, 2].map(|gyro| {
        let fixed = |weights: &[(usize, f64)]| {
            let (value, std) = estimate.combination(weights);
            std < FIXED_SHARE * TYPICAL_S2.max(value.abs())
        };
        let (a, b) = (2 * gyro, 2 * gyro + 1);
        let known = match (fixed(&[(a, 1.0)]), fixed(&[(b, 1.0)])) {
            (true, true) => Known::Both,
            (true, false) => Known::One(0),
            (false, true) => Known::One(1),
            (false, false) if fixed(&[(a, 1.0), (b, 1.0)]) => Known::Sum,
            (false, false) => Known::Nothing,
        };
        Pair { gyro, known }
    })
}

/// The fixed combinations; the sums, which vibration needs, stand beside single values.
pub fn identifiable(estimate: &Estimate, pairs: &[Pair; 3]) -> Vec<Identifiable> {
    let entry = |weights: Vec<(usize, f64)>| {
        let (value, std) = estimate.combination(&weights);
        Identifiable {
            combination: names(&weights),
            value,
            std,
        }
    };
    pairs
        .iter()
        .flat_map(|pair| {
            let (a, b) = (2 * pair.gyro, 2 * pair.gyro + 1);
            let sum = vec![(a, 1.0), (b, 1.0)];
            match pair.known {
                Known::Both => vec![vec![(a, 1.0)], vec![(b, 1.0)], sum],
                Known::One(which) => vec![vec![(a + which, 1.0)]],
                Known::Sum => vec![sum],
                Known::Nothing => vec![],
            }
        })
        .map(entry)
        .collect()
}

/// What is not fixed, and what would fix it.
pub fn unfixed(estimate: &Estimate, pairs: &[Pair; 3]) -> Vec<Unfixed> {
    pairs
        .iter()
        .flat_map(|pair| {
            let (a, b) = (2 * pair.gyro, 2 * pair.gyro + 1);
            let difference = (vec![(a, 1.0), (b, -1.0)], spins(pair.gyro));
            let sum = (vec![(a, 1.0), (b, 1.0)], coning(pair.gyro));
            match pair.known {
                Known::Both => vec![],
                Known::One(which) => vec![(vec![(a + 1 - which, 1.0)], spin(a + 1 - which))],
                Known::Sum => vec![difference],
                Known::Nothing => vec![sum, difference],
            }
        })
        .map(|(weights, motion)| Unfixed {
            std: estimate.combination(&weights).1,
            weights,
            motion,
        })
        .collect()
}

/// The six K as the model takes them: single values where known, else half the sum each (K = J/k of one block
/// about two axes across it: nearly equal), the known one twice, or nothing.
pub fn for_model(estimate: &Estimate, pairs: &[Pair; 3]) -> [Option<f64>; 6] {
    let mut chosen = [None; 6];
    for pair in pairs {
        let (a, b) = (2 * pair.gyro, 2 * pair.gyro + 1);
        let (first, second) = (estimate.values[a], estimate.values[b]);
        let values = match pair.known {
            Known::Both => Some((first, second)),
            Known::One(0) => Some((first, first)),
            Known::One(_) => Some((second, second)),
            Known::Sum => Some((0.5 * (first + second), 0.5 * (first + second))),
            Known::Nothing => None,
        };
        if let Some((first, second)) = values {
            (chosen[a], chosen[b]) = (Some(first), Some(second));
        }
    }
    chosen
}

/// Which of the six K in the model are a choice, for `model.toml`; `None` where all are known.
pub fn choice(pairs: &[Pair; 3]) -> Option<String> {
    let said = pairs.iter().filter_map(|pair| {
        let [first, second] = [2 * pair.gyro, 2 * pair.gyro + 1].map(|k| SIX[k]);
        match pair.known {
            Known::Both => None,
            Known::One(0) => Some(format!(
                "{second}: not fixed by the data, written as {first}"
            )),
            Known::One(_) => Some(format!(
                "{first}: not fixed by the data, written as {second}"
            )),
            Known::Sum => Some(format!(
                "{first} - {second}: not fixed by the data, written even"
            )),
            Known::Nothing => Some(format!(
                "{first}, {second}: not fixed by the data, left out"
            )),
        }
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| said.join("; "))
}

/// The contract's names of the six K.
pub fn names(weights: &[(usize, f64)]) -> BTreeMap<String, f64> {
    weights
        .iter()
        .map(|(k, weight)| (SIX[*k].to_owned(), *weight))
        .collect()
}

/// The combination as text: `K_xy + K_xz`.
pub fn symbol(weights: &[(usize, f64)]) -> String {
    weights
        .iter()
        .enumerate()
        .map(|(place, (k, weight))| {
            let sign = match (place, *weight < 0.0) {
                (0, _) => "",
                (_, true) => " - ",
                (_, false) => " + ",
            };
            format!("{sign}K_{}", SIX[*k])
        })
        .collect()
}

/// The spin-synchronous oscillation that shows one K: about j, while spinning about the third axis.
fn spin(k: usize) -> String {
    let (gyro, axis) = PAIRS[k];
    let third = 3 - gyro - axis;
    format!(
        "spin about {} while oscillating about {}, both senses",
        AXES[third], AXES[axis]
    )
}

fn spins(gyro: usize) -> String {
    format!("{}; or the axes exchanged", spin(2 * gyro))
}

fn coning(gyro: usize) -> String {
    format!("coning about {}", AXES[gyro])
}
