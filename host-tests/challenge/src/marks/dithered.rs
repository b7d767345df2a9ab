//! Dithered counts at 4 kHz, by the simulator: one effect or none.
//!
//! An effect's shape is the difference of two noise-free simulations; its strength is in the added noise, as for
//! increments.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::Model;
use rlg_model::catalogue::SIX;
use rlg_recording::error::InputError;
use rlg_recording::{Quantity, Recording};
use rlg_simulator::scenario::Scenario;
use rlg_simulator::{Seeds, simulate};

use super::effects::{AXES, Effect, Strong};
use super::noise::{Levels, Weighting, dct};
use super::setting::{draw_strength, log_uniform, one_of, sign};

/// Row rate \[Hz\].
const RATE_HZ: f64 = 4000.0;

/// Negligible pulse weight, resolution or noise \[rad\].
const NOTHING_RAD: f64 = 1e-14;

/// Kinds with a small size and the largest credible one \[the kind's unit\].
const KINDS: [(&str, f64, f64); 8] = [
    ("gyro_bias", 1e-7, 1e-3),
    ("gyro_scale", 1e-5, 0.02),
    ("gyro_delay", 1e-5, 1e-3),
    ("reference_delay", 1e-5, 1e-3),
    ("reference_scale", 1e-5, 0.02),
    ("dither_gain", 1e-5, 0.1),
    ("axis_flexure", 1e-8, 1e-6),
    ("gyro_bias_step", 1e-7, 1e-3),
];

/// Number of kinds drawn before a bias is taken, which any motion shows.
const ATTEMPTS: usize = 6;

/// Drawn recording of dithered counts.
#[derive(Debug, Clone)]
pub struct Dithered {
    /// Concealed effects.
    pub effects: Vec<Strong>,
    pulse_rad: [f64; 3],
    walk_rad_sqrt_s: [f64; 3],
    pickoff_rad: f64,
    reference_angle_rad: f64,
    reference_walk_rad_sqrt_s: f64,
    /// Ratio of the model's declared reference noise to the true one.
    pub declared_over_true: f64,
    motion: String,
    motion_seed: u64,
}

fn list(values: [f64; 3]) -> String {
    format!("[{:e}, {:e}, {:e}]", values[0], values[1], values[2])
}

impl Dithered {
    /// Draws a recording, with an effect or without.
    pub fn draw(rng: &mut ChaCha8Rng, conceals: bool) -> Result<Self, InputError> {
        let mut drawn = Self {
            effects: Vec::new(),
            pulse_rad: std::array::from_fn(|_| log_uniform(rng, 1e-6, 3e-6)),
            walk_rad_sqrt_s: std::array::from_fn(|_| log_uniform(rng, 3e-7, 1.2e-6)),
            pickoff_rad: 2.4e-7,
            reference_angle_rad: log_uniform(rng, 1e-7, 4e-7),
            reference_walk_rad_sqrt_s: 8.7e-8,
            declared_over_true: log_uniform(rng, 1.0 / 1.5, 1.5),
            motion: motion(rng),
            motion_seed: rng.random(),
        };
        if !conceals {
            return Ok(drawn);
        }
        let before = drawn.residual_rad(None)?;
        let mut attempts = 0;
        while drawn.effects.is_empty() {
            attempts += 1;
            let kind = if attempts > ATTEMPTS {
                KINDS[0]
            } else {
                one_of(rng, &KINDS)
            };
            let pattern = pattern(kind.0, rng).scaled(kind.1);
            let rho = draw_strength(rng);
            let now = drawn.strength(&pattern, &before)?;
            let effect = pattern.scaled(rho / now);
            if now > 0.0 && effect.largest() < kind.2 {
                let rho = drawn.strength(&effect, &before)?;
                drawn.effects.push(Strong { effect, rho });
            }
        }
        Ok(drawn)
    }

    /// Returns the scenario with its effects.
    pub fn text(&self) -> String {
        let effects = self.effects.iter().map(|strong| toml(&strong.effect));
        self.scenario_text(true) + &effects.collect::<String>()
    }

    /// Makes the recording and its model.
    pub fn record(&self, noise_seed: u64) -> Result<(Recording, Model), InputError> {
        let scenario = Scenario::parse(&self.text(), Path::new("challenge.toml"))?;
        let seeds = Seeds {
            motion: self.motion_seed,
            noise: noise_seed,
        };
        let simulation = simulate(&scenario, seeds, |_| {});
        let mut model = simulation.model;
        if let Some(reference) = &mut model.reference {
            let scaled = |noise: Option<f64>| noise.map(|noise| noise * self.declared_over_true);
            reference.angle_noise_rad = scaled(reference.angle_noise_rad);
            reference.angle_random_walk_rad_sqrt_s = scaled(reference.angle_random_walk_rad_sqrt_s);
        }
        Ok((simulation.recording, model))
    }

    /// Returns an effect's matched-filter SNR.
    fn strength(&self, effect: &Effect, before: &[Vec<f64>; 3]) -> Result<f64, InputError> {
        let with = self.residual_rad(Some(effect))?;
        let mut power = 0.0;
        for axis in 0..3 {
            let difference: Vec<f64> = with[axis]
                .iter()
                .zip(&before[axis])
                .map(|(with, without)| with - without)
                .collect();
            let weighting = Weighting::new(&self.levels(axis), difference.len(), 1.0 / RATE_HZ);
            let shape = dct(&difference);
            power += weighting.product(&shape, &shape);
        }
        Ok(power.sqrt())
    }

    /// Noise of counts less pickoff less reference.
    fn levels(&self, axis: usize) -> Levels {
        Levels::white(
            self.walk_rad_sqrt_s[axis],
            self.pulse_rad[axis] / 12_f64.sqrt(),
        )
        .beside(Levels::white(0.0, self.pickoff_rad))
        .beside(Levels::white(
            self.reference_walk_rad_sqrt_s,
            self.reference_angle_rad,
        ))
    }

    /// Counts less pickoff less reference of a simulation without noise \[rad\].
    fn residual_rad(&self, effect: Option<&Effect>) -> Result<[Vec<f64>; 3], InputError> {
        let text = self.scenario_text(false) + &effect.map(toml).unwrap_or_default();
        let scenario = Scenario::parse(&text, Path::new("challenge.toml"))?;
        let seeds = Seeds {
            motion: self.motion_seed,
            noise: 0,
        };
        let recording = simulate(&scenario, seeds, |_| {}).recording;
        let values = |quantity: Quantity, axis: &str| {
            recording
                .channel(&quantity, axis)
                .map(|(_, channel)| channel.values.as_slice())
                .unwrap_or_default()
        };
        Ok(AXES.map(|axis| {
            let counts = values(Quantity::GyroCount, axis);
            let pickoff = values(Quantity::DitherAngle, axis);
            let reference = values(Quantity::ReferenceIncrement, axis);
            let mut before = pickoff.first().copied().unwrap_or(0.0);
            counts
                .iter()
                .zip(pickoff)
                .zip(reference)
                .enumerate()
                .map(|(row, ((count, &pickoff), reference))| {
                    let turned = pickoff - before;
                    before = pickoff;
                    // The first row lacks the previous pickoff sample.
                    if row == 0 {
                        0.0
                    } else {
                        count * NOTHING_RAD - turned - reference
                    }
                })
                .collect()
        }))
    }

    fn scenario_text(&self, noisy: bool) -> String {
        let share = if noisy { 1.0 } else { 0.0 };
        let weight = |rad: f64| if noisy { rad } else { NOTHING_RAD };
        format!(
            "format = 1\nname = \"dithered\"\nrate_hz = {RATE_HZ:e}\n\
             [gyro]\npulse_weight_rad = {}\nbias_rad_s = [2.4e-8, -3.9e-8, 1.5e-8]\n\
             scale_error = [8e-6, -5e-6, 3e-6]\nangle_random_walk_rad_sqrt_s = {}\n\
             installation_rad = {{ xy = -1.7e-4, xz = 1.8e-4, yx = 1.1e-4, yz = -2e-5, zx = -2.8e-4, zy = 2.4e-4 }}\n\
             output = \"count\"\n\
             [reference]\nangle_noise_rad = {:e}\nangle_random_walk_rad_sqrt_s = {:e}\nweight_rad = {:e}\n\
             [dither]\nfrequency_hz = [392.6, 430.1, 474.8]\namplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]\n\
             amplitude_spread = 0.15\npickoff_gain = [1.0, 1.0, 1.0]\npickoff_noise_rad = {}\n\
             pickoff_weight_rad = {:e}\n{}",
            list(self.pulse_rad.map(weight)),
            list(self.walk_rad_sqrt_s.map(|walk| share * walk)),
            share * self.reference_angle_rad,
            share * self.reference_walk_rad_sqrt_s,
            weight(4.8e-9),
            list([share * self.pickoff_rad; 3]),
            weight(9.7e-9),
            self.motion,
        )
    }
}

fn toml(effect: &Effect) -> String {
    let mut text = format!("[[effect]]\nkind = \"{}\"\nconcealed = true\n", effect.kind);
    if let Some(axis) = effect.axis {
        let _ = writeln!(text, "axis = \"{}\"", AXES[axis]);
    }
    for (name, value) in &effect.values {
        let _ = writeln!(text, "{name} = {value:e}");
    }
    text
}

/// Effect of size 1 on one gyro or on all.
fn pattern(kind: &'static str, rng: &mut ChaCha8Rng) -> Effect {
    let mut effect = Effect {
        kind,
        axis: None,
        values: BTreeMap::new(),
    };
    let on_all = rng.random_bool(0.5);
    let names: &[&str] = match kind {
        "reference_delay" => &["all"],
        "gyro_bias_step" => {
            effect.axis = Some(rng.random_range(0..3));
            let time_s = log_uniform(rng, 4.0, 16.0);
            effect.values.insert("time_s".to_owned(), time_s);
            &["size"]
        }
        "axis_flexure" => SIX,
        _ => &AXES,
    };
    let chosen = if on_all {
        names.to_vec()
    } else {
        vec![one_of(rng, names)]
    };
    for name in chosen {
        let share = 0.5 + 0.5 * rng.random::<f64>();
        // A suspension's compliance J/k has one sign.
        let size = if kind == "axis_flexure" {
            share
        } else {
            share * sign(rng)
        };
        effect.values.insert(name.to_owned(), size);
    }
    effect
}

/// Twenty seconds: rest, four moves, rest.
fn motion(rng: &mut ChaCha8Rng) -> String {
    let mut text = "[[motion]]\nkind = \"still\"\nduration_s = 2.0\n".to_owned();
    for _ in 0..4 {
        let axis = one_of(rng, &AXES);
        let lines = match rng.random_range(0..4) {
            0 => format!(
                "kind = \"coning\"\naxis = \"{axis}\"\nfrequency_hz = {:e}\nangle_rad = {:e}\nramp_s = 0.5\n",
                log_uniform(rng, 1.0, 14.0),
                log_uniform(rng, 0.003, 0.012)
            ),
            1 => format!(
                "kind = \"spin\"\naxis = \"{axis}\"\nrate_rad_s = {:e}\nramp_s = 0.5\n",
                log_uniform(rng, 0.3, 1.5)
            ),
            2 => format!(
                "kind = \"tumble\"\nrate_rad_s = {}\nfrequency_hz = {}\nramp_s = 0.5\n",
                list(std::array::from_fn(|_| log_uniform(rng, 0.1, 0.6))),
                list(std::array::from_fn(|_| log_uniform(rng, 0.1, 1.0)))
            ),
            _ => format!(
                "kind = \"vibration\"\nlow_hz = 5.0\nhigh_hz = 120.0\nrate_rms_rad_s = {}\nramp_s = 0.5\n",
                list(std::array::from_fn(|_| log_uniform(rng, 0.05, 0.2)))
            ),
        };
        let _ = write!(text, "[[motion]]\n{lines}duration_s = 4.0\n");
    }
    text + "[[motion]]\nkind = \"still\"\nduration_s = 2.0\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;

    #[test]
    fn a_bias_of_dithered_counts_is_as_strong_as_in_increments() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let drawn = Dithered::draw(&mut rng, false).expect("drawn");
        let before = drawn.residual_rad(None).expect("simulated");
        let bias = Effect {
            kind: "gyro_bias",
            axis: None,
            values: BTreeMap::from([("y".to_owned(), 3e-6)]),
        };
        let rho = drawn.strength(&bias, &before).expect("simulated");
        let walk = drawn.walk_rad_sqrt_s[1].hypot(drawn.reference_walk_rad_sqrt_s);
        let exact = 3e-6 * 20_f64.sqrt() / walk;
        // Pulses, pickoff and reference add noise to the angle at either end.
        assert!(rho < exact && rho > 0.9 * exact, "{rho} {exact}");
    }
}
