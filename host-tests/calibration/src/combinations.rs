//! Linear combinations of the six K that are identifiable from the recordings, and those that are not.
//!
//! Each gyro has either its two coefficients, or their sum, or less. An unidentifiable combination is listed with the
//! motion that would determine it (physics §3: a stationary oscillation shows only sums).

use std::collections::BTreeMap;

use super::estimate::Estimate;
use super::unknowns::PAIRS;
use rlg_findings::result::Identifiable;
use rlg_model::catalogue::SIX;
use rlg_plan::CalibrationPlan;
use rlg_signal::streams::AXES;

/// Identifiable part of one gyro's pair of coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// Both coefficients.
    Both,
    /// One of the pair: 0 or 1.
    One(usize),
    /// The sum alone.
    Sum,
    /// None.
    Nothing,
}

/// Pair of coefficients of one gyro.
pub struct Pair {
    /// The gyro: 0, 1, 2 for x, y, z.
    pub gyro: usize,
    /// Identifiable part.
    pub known: Known,
}

/// Combination that is not identifiable.
pub struct Unfixed {
    /// Index of K → weight.
    pub weights: Vec<(usize, f64)>,
    /// Standard deviation \[s²\].
    pub std: f64,
    /// Motion that would determine it.
    pub motion: String,
}

/// Decides the identifiable part for each gyro.
pub fn pairs(estimate: &Estimate, plan: &CalibrationPlan) -> [Pair; 3] {
    [0, 1, 2].map(|gyro| {
        let fixed = |weights: &[(usize, f64)]| {
            let (value, std) = estimate.combination(weights);
            std < plan.identifiable_share * plan.typical_s2.max(value.abs())
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

/// Identifiable combinations; the sums, needed for vibration, are listed in addition to single values.
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

/// Combinations that are not identifiable, with the motion that would determine each.
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

/// The six K for the model: single values if identifiable, else half the sum for each (K = J/k of one block about two
/// transverse axes: nearly equal), the identifiable one for both, or `None`.
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

/// Values among the six K of the model that are set by choice, for `model.toml`; `None` if all are identifiable.
pub fn choice(pairs: &[Pair; 3]) -> Option<String> {
    let said = pairs.iter().filter_map(|pair| {
        let [first, second] = [2 * pair.gyro, 2 * pair.gyro + 1].map(|k| SIX[k]);
        match pair.known {
            Known::Both => None,
            Known::One(0) => Some(format!("{second}: not identifiable, set to {first}")),
            Known::One(_) => Some(format!("{first}: not identifiable, set to {second}")),
            Known::Sum => Some(format!("{first} - {second}: not identifiable, set to 0")),
            Known::Nothing => Some(format!("{first}, {second}: not identifiable, left out")),
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

/// Spin-synchronous oscillation that shows one K: about j, while spinning about the third axis.
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
