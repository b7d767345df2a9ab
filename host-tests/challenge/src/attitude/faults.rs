//! Faults of an attitude reference: wrong stamps, a jump, a gap, a held attitude.

use nalgebra::Vector3;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_simulator::instrument::normal;
use serde_json::{Map, Value};

use super::path::Path;
use super::planted::Planted;
use super::reference::Reference;
use crate::marks::effects::{AXES, Concealed};
use crate::marks::setting::{log_uniform, sign};

/// Range of the faults' sizes over the reference's own error.
const SIZES: [f64; 2] = [20.0, 200.0];

/// Number of faultless stamps at either end.
const SOUND: usize = 5;

/// Type of a fault.
#[derive(Debug, Clone, PartialEq)]
pub enum Wrong {
    /// Each stamp has an independent error, navigation frame \[rad\].
    Off(Vec<Vector3<f64>>),
    /// From the first stamp on, all are rotated about a body axis by this angle \[rad\].
    Jumped(usize, f64),
    /// The stamps are missing.
    Missing,
    /// The stamps hold the attitude of the first.
    Held,
}

/// Fault of a span of stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// First stamp.
    pub first: usize,
    /// Last stamp; for a jump equal to the first.
    pub last: usize,
    /// Type of the fault.
    pub wrong: Wrong,
    /// Size over the reference's own error; 0 for missing stamps.
    pub over_error: f64,
}

/// Draws the injected faults; `None` if not observable in the motion.
pub fn draw(
    planted: Planted,
    reference: &Reference,
    (path, stamps_s): (&Path, &[f64]),
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Fault>> {
    let stamps = stamps_s.len();
    let error_rad = reference.error_rad();
    let in_seconds = |length_s: f64| ((length_s * reference.rate_hz) as usize).max(2);
    let mut faults: Vec<Fault> = match planted {
        Planted::Glitches => {
            let count = rng.random_range(1..=4);
            let one = |place| off((place, 1), stamps, error_rad, rng);
            (0..count).map(one).collect()
        }
        Planted::GlitchSpans => {
            let count = rng.random_range(1..=2);
            let one = |place| {
                let length = in_seconds(log_uniform(rng, 0.1, 0.6));
                off((place, length), stamps, error_rad, rng)
            };
            (0..count).map(one).collect()
        }
        Planted::Jump => {
            let first = rng.random_range(stamps * 3 / 20..stamps * 7 / 10);
            let axis = rng.random_range(0..3);
            let over_error = log_uniform(rng, SIZES[0], SIZES[1]);
            vec![Fault {
                first,
                last: first,
                wrong: Wrong::Jumped(axis, sign(rng) * over_error * error_rad),
                over_error,
            }]
        }
        Planted::Gap => {
            let length = (stamps as f64 * log_uniform(rng, 0.03, 0.15)) as usize;
            vec![within(length, Wrong::Missing, stamps, rng)]
        }
        Planted::Held => {
            let length = in_seconds(log_uniform(rng, 0.3, 3.0)).max(4);
            let mut fault = within(length, Wrong::Held, stamps, rng);
            let [first, last] = [fault.first, fault.last].map(|stamp| path.at(stamps_s[stamp]));
            fault.over_error = first.angle_to(&last) / error_rad;
            vec![fault]
        }
        _ => Vec::new(),
    };
    faults.sort_by_key(|fault| fault.first);
    let are_apart = faults
        .windows(2)
        .all(|pair| pair[1].first > pair[0].last + 1);
    let is_shown = |fault: &Fault| fault.wrong == Wrong::Missing || fault.over_error >= SIZES[0];
    (are_apart && faults.iter().all(is_shown)).then_some(faults)
}

/// Draws a span of wrong stamps with independent errors: the first of several before the last third, the others anywhere.
fn off(
    (place, length): (usize, usize),
    stamps: usize,
    error_rad: f64,
    rng: &mut ChaCha8Rng,
) -> Fault {
    let last = if place == 0 { stamps * 2 / 3 } else { stamps };
    let first = rng.random_range(SOUND..last - SOUND - length);
    let over: Vec<f64> = (0..length)
        .map(|_| log_uniform(rng, SIZES[0], SIZES[1]))
        .collect();
    let over_error = over.iter().copied().fold(0.0, f64::max);
    let errors = over
        .into_iter()
        .map(|over| over * error_rad * direction(rng));
    Fault {
        first,
        last: first + length - 1,
        wrong: Wrong::Off(errors.collect()),
        over_error,
    }
}

fn direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(rng)).normalize()
}

fn within(length: usize, wrong: Wrong, stamps: usize, rng: &mut ChaCha8Rng) -> Fault {
    let first = rng.random_range(SOUND..stamps * 7 / 10 - length);
    Fault {
        first,
        last: first + length - 1,
        wrong,
        over_error: 0.0,
    }
}

impl Fault {
    /// Converts the fault to its form in the commitment: the contract's kind, and the span from the last correct stamp to
    /// the last wrong one \[s\].
    pub fn concealed(&self, stamps_s: &[f64]) -> Concealed {
        let mut parameters = Map::new();
        let mut put = |name: &str, value: Value| parameters.insert(name.to_owned(), value);
        let kind = match &self.wrong {
            Wrong::Off(errors) if errors.len() == 1 => "reference_spike",
            Wrong::Off(_) | Wrong::Held => "reference_dropout",
            Wrong::Missing => "lost_samples",
            Wrong::Jumped(axis, size_rad) => {
                put("axis", Value::from(AXES[*axis]));
                put("time_s", Value::from(stamps_s[self.first]));
                put("size", Value::from(*size_rad));
                "reference_jump"
            }
        };
        put("start_s", Value::from(stamps_s[self.first - 1]));
        put("end_s", Value::from(stamps_s[self.last]));
        Concealed {
            kind: kind.to_owned(),
            parameters,
            rho: self.over_error,
        }
    }
}
