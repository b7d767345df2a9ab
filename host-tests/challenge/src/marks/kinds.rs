//! Kinds concealed in the marks' trials: largest credible size, required input, and pattern over the gyros.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::catalogue::{NINE, SIX};
use rlg_simulator::instrument::normal;

use super::effects::{AXES, Effect};
use super::motion::Motion;
use super::setting::{MOTIONS, MotionKind, Setting, one_of, sign};

/// Input required for an effect to be observable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Needs {
    Nothing,
    /// Motion above the reference's noise.
    Motion,
    /// Angular acceleration and rate about two axes.
    FastMotion,
    Temperature,
    Force,
}

/// Parameters of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Numbers {
    /// One per axis.
    Three,
    /// One for all axes.
    One,
    /// Gyro and another axis.
    Six,
    /// Gyro and axis.
    Nine,
    /// Gyro, instant, size.
    Event,
}

/// Kind with its limits.
#[derive(Debug, Clone, Copy)]
pub struct KindRow {
    /// The contract's kind.
    pub kind: &'static str,
    /// Largest credible size for an instrument \[the kind's unit\].
    pub largest: f64,
    needs: Needs,
    numbers: Numbers,
}

const fn row(kind: &'static str, largest: f64, needs: Needs, numbers: Numbers) -> KindRow {
    KindRow {
        kind,
        largest,
        needs,
        numbers,
    }
}

/// Bias, scale errors and delays: the kinds of the ordinary mark.
pub static BASIC: [KindRow; 5] = [
    row("gyro_bias", 1e-3, Needs::Nothing, Numbers::Three),
    row("gyro_scale", 0.02, Needs::Motion, Numbers::Three),
    row("gyro_delay", 5e-3, Needs::Motion, Numbers::Three),
    row("reference_delay", 5e-3, Needs::Motion, Numbers::One),
    row("reference_scale", 0.02, Needs::Motion, Numbers::Three),
];

/// The other kinds.
pub static OTHERS: [KindRow; 9] = [
    row("installation", 0.01, Needs::Motion, Numbers::Six),
    row(
        "reference_misalignment",
        0.02,
        Needs::Motion,
        Numbers::Three,
    ),
    row("gyro_bias_step", 1e-3, Needs::Nothing, Numbers::Event),
    row("counter_slip", 1e-2, Needs::Nothing, Numbers::Event),
    row("gyro_scale_asymmetry", 0.02, Needs::Motion, Numbers::Three),
    row("gyro_scale_quadratic", 0.05, Needs::Motion, Numbers::Three),
    row(
        "gyro_bias_temperature",
        1e-3,
        Needs::Temperature,
        Numbers::Three,
    ),
    row("gyro_g_bias", 1e-4, Needs::Force, Numbers::Nine),
    row("axis_flexure", 1e-6, Needs::FastMotion, Numbers::Six),
];

impl KindRow {
    /// Returns motions in which the kind is observable.
    pub fn motions(&self) -> Vec<MotionKind> {
        match self.needs {
            Needs::FastMotion => vec![MotionKind::Sweep, MotionKind::Vehicle],
            Needs::Motion => MOTIONS
                .into_iter()
                .filter(|motion| *motion != MotionKind::Weak)
                .collect(),
            _ => MOTIONS.to_vec(),
        }
    }

    /// Adds the channels that the kind requires.
    pub fn equip(&self, setting: &mut Setting) {
        setting.has_temperature |= self.needs == Needs::Temperature;
        setting.has_force |= self.needs == Needs::Force;
    }

    /// Draws the pattern of an effect, of size 1 in its largest parameter: on one gyro or on all. `None` if it is not
    /// observable in the motion.
    pub fn draw(&self, setting: &Setting, motion: &Motion, rng: &mut ChaCha8Rng) -> Option<Effect> {
        let on_all = rng.random_bool(0.5);
        let mut effect = Effect {
            kind: self.kind,
            axis: None,
            values: BTreeMap::new(),
        };
        let names: Vec<&str> = match self.numbers {
            Numbers::One => vec!["all"],
            Numbers::Event => {
                let time_s = setting.length_s() * (0.1 + 0.8 * rng.random::<f64>());
                effect.axis = Some(rng.random_range(0..3));
                effect.values.insert("time_s".to_owned(), time_s);
                vec!["size"]
            }
            Numbers::Three => AXES.to_vec(),
            Numbers::Six => SIX.to_vec(),
            Numbers::Nine => NINE.to_vec(),
        };
        let acts: Vec<&str> = names
            .into_iter()
            .filter(|name| self.acts(name, motion))
            .collect();
        if acts.is_empty() {
            return None;
        }
        let chosen = if on_all {
            acts
        } else {
            vec![one_of(rng, &acts)]
        };
        let several = chosen.len() > 1;
        for name in chosen {
            let size = match (self.needs, several) {
                // A suspension's compliance J/k has one sign.
                (Needs::FastMotion, _) => 0.5 + 0.5 * rng.random::<f64>(),
                (_, false) => sign(rng),
                (_, true) => normal(rng),
            };
            effect.values.insert(name.to_owned(), size);
        }
        let largest = effect.largest();
        Some(effect.scaled(1.0 / largest))
    }

    /// Returns one effect of a small size for each parameter of the kind; for a step or slip the drawn one.
    pub fn columns(&self, drawn: &Effect) -> Vec<Effect> {
        const SMALL: f64 = 1e-3;
        let names = match self.numbers {
            Numbers::Event => return vec![drawn.clone()],
            Numbers::One => &["all"],
            Numbers::Three => AXES.as_slice(),
            Numbers::Six => SIX,
            Numbers::Nine => NINE,
        };
        names
            .iter()
            .map(|name| Effect {
                kind: self.kind,
                axis: None,
                values: BTreeMap::from([((*name).to_owned(), SMALL * self.largest)]),
            })
            .collect()
    }

    /// True if a parameter of that name is observable in a motion.
    fn acts(&self, name: &str, motion: &Motion) -> bool {
        let letters: Vec<usize> = name
            .chars()
            .filter_map(|letter| AXES.iter().position(|axis| axis.starts_with(letter)))
            .collect();
        match (self.kind, self.numbers, letters.as_slice()) {
            // about x it mixes the rates about y and z
            ("reference_misalignment", _, [axis]) => {
                motion.moves((axis + 1) % 3) || motion.moves((axis + 2) % 3)
            }
            (_, Numbers::Six, [gyro, about]) => {
                motion.moves(3 - gyro - about)
                    && (self.needs != Needs::FastMotion || motion.moves(*about))
            }
            (_, Numbers::Three, [axis]) if self.needs == Needs::Motion => motion.moves(*axis),
            _ => true,
        }
    }
}

/// Returns the row of a kind listed here.
pub fn find(kind: &str) -> Option<&'static KindRow> {
    BASIC.iter().chain(&OTHERS).find(|row| row.kind == kind)
}

/// Returns the largest credible size of a kind; infinite for kinds not listed here.
pub fn largest(kind: &str) -> f64 {
    find(kind).map_or(f64::INFINITY, |row| row.largest)
}
