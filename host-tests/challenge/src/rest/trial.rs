//! A recording of a unit at rest, drawn.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_recording::Site;
use rlg_recording::error::InputError;
use rlg_simulator::instrument::normal;
use serde_json::Value;

use super::planted::Planted;
use crate::marks::case::{Case, GRAVITY_M_S2, Unit, Warming};
use crate::marks::effects::{AXES, Concealed, Effect, Strong};
use crate::marks::grade::Grade;
use crate::marks::motion::{Motion, Term};
use crate::marks::noise::{Drift, Levels, Weighting, dct, product};
use crate::marks::setting::{Limits, draw_strength, log_uniform, one_of, sign};

/// Rows a second \[Hz\].
const RATES_HZ: [f64; 4] = [10.0, 50.0, 100.0, 200.0];

/// Shortest and longest \[s\].
const LENGTH_S: [f64; 2] = [60.0, 1200.0];

/// The Earth's rotation \[rad/s\], WGS-84.
const EARTH_RAD_S: f64 = 7.292_115e-5;

/// Standard deviations of a bias.
const BIASES: [f64; 2] = [5.0, 1e4];

/// Matched-filter SNR of lines.
const LINES: [f64; 2] = [12.0, 300.0];

/// Sizes that are drawn until a unit of the grade can have one.
const ATTEMPTS: usize = 200;

/// A steady line: amplitudes of the rows' means \[rad/s\] and phases \[rad\], x y z.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
    /// Amplitudes \[rad/s\].
    pub amplitude_rad_s: [f64; 3],
    /// Phases \[rad\].
    pub phase_rad: [f64; 3],
    /// Matched-filter SNR.
    pub rho: f64,
}

/// A recording, drawn.
#[derive(Debug, Clone)]
pub struct Still {
    /// What is planted.
    pub planted: Planted,
    /// How good the gyros are.
    pub grade: Grade,
    /// Rows a second \[Hz\].
    pub rate_hz: f64,
    /// Rows.
    pub rows: usize,
    /// Where it stands.
    pub site: Site,
    /// How it lies: body from north, west, up.
    pub body_from_level: UnitQuaternion<f64>,
    /// Noise of each gyro.
    pub levels: [Levels; 3],
    /// The gyros' angle random walk that the model declares \[rad/√s\].
    pub declared_walk_rad_sqrt_s: Option<[f64; 3]>,
    /// The pulse weight \[rad\].
    pub pulse_rad: f64,
    /// That of the model \[rad\].
    pub declared_pulse_rad: f64,
    /// Constants that the model knows.
    pub unit: Unit,
    /// Warming of the blocks, where thermometers are recorded.
    pub warming: Option<[Warming; 3]>,
    /// Effects.
    pub effects: Vec<Strong>,
    /// Lines.
    pub lines: Vec<Line>,
}

impl Still {
    /// Draws what the trial of a number records.
    ///
    /// # Errors
    /// No unit has what is planted.
    pub fn draw(number: u64, limits: &Limits, rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::of(number);
        for _ in 0..ATTEMPTS {
            if let Some(drawn) = Self::attempt(planted, limits, rng) {
                return Ok(drawn);
            }
        }
        let name = planted.name();
        Err(InputError::new("challenge", "no setting shows what is planted").value(name))
    }

    fn attempt(planted: Planted, limits: &Limits, rng: &mut ChaCha8Rng) -> Option<Self> {
        let grade = Grade::draw(rng);
        let walk = grade.draw_walk_rad_sqrt_s(rng);
        let rate_hz = one_of(rng, &RATES_HZ);
        let longest_s = LENGTH_S[1].min(limits.most_rows / rate_hz).max(LENGTH_S[0]);
        let length_s = log_uniform(rng, LENGTH_S[0], longest_s);
        let fine_rad = walk[0] / rate_hz.sqrt() * log_uniform(rng, 0.1, 1.0);
        let is_warm = planted == Planted::GyroBiasTemperature || rng.random_bool(0.4);
        let declares = planted == Planted::AngleRandomWalk || rng.random_bool(0.5);
        let corner_hz = log_uniform(rng, 3.0 / length_s, 0.3);
        let drift = match planted {
            Planted::Flicker => Drift::Flicker(corner_hz),
            Planted::RateRandomWalk => Drift::RateWalk(corner_hz),
            _ => Drift::None,
        };
        let more = match planted {
            Planted::AngleRandomWalk => log_uniform(rng, 1.5, 5.0),
            _ => 1.0,
        };
        let coarser = match planted {
            Planted::PulseQuantisation => {
                log_uniform(rng, 3.0, 30.0) * walk[0] / rate_hz.sqrt() / fine_rad
            }
            _ => 1.0,
        };
        let mut drawn = Self {
            planted,
            grade,
            rate_hz,
            rows: (length_s * rate_hz).round() as usize,
            site: Site {
                latitude_rad: sign(rng) * (0.1 + 1.2 * rng.random::<f64>()),
                gravity_m_s2: GRAVITY_M_S2,
            },
            body_from_level: UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| normal(rng))),
            levels: walk.map(|walk| Levels::white(more * walk, 0.0).drifting(drift)),
            declared_walk_rad_sqrt_s: declares.then_some(walk),
            pulse_rad: coarser * fine_rad,
            declared_pulse_rad: fine_rad,
            unit: Unit::draw(rng),
            warming: is_warm.then(|| std::array::from_fn(|_| Warming::draw(length_s, rng))),
            effects: Vec::new(),
            lines: Vec::new(),
        };
        drawn.plant(rng)?;
        Some(drawn)
    }

    /// Draws effects and lines; `None` where no unit of the grade has them.
    fn plant(&mut self, rng: &mut ChaCha8Rng) -> Option<()> {
        let length_s = self.rows as f64 / self.rate_hz;
        match self.planted {
            Planted::GyroBias => {
                let direction = Vector3::from_fn(|_, _| normal(rng)).normalize();
                // What lies to the east turns the Earth's rotation and shows only to second order.
                let east = self.body_from_level * -Vector3::y();
                let pattern = by_axis("gyro_bias", direction);
                let shown = by_axis("gyro_bias", direction - east * east.dot(&direction));
                let sigmas = log_uniform(rng, BIASES[0], BIASES[1]);
                let strong = self.scaled(&pattern, &shown, sigmas)?;
                self.effects.push(strong);
            }
            Planted::GyroBiasStep => {
                let count = rng.random_range(1..=2);
                for _ in 0..count {
                    let time_s = length_s * (0.15 + 0.7 * rng.random::<f64>());
                    let pattern = Effect {
                        kind: "gyro_bias_step",
                        axis: Some(rng.random_range(0..3)),
                        values: BTreeMap::from([
                            ("time_s".to_owned(), time_s),
                            ("size".to_owned(), sign(rng)),
                        ]),
                    };
                    let rho = draw_strength(rng);
                    let strong = self.scaled(&pattern, &pattern, rho)?;
                    self.effects.push(strong);
                }
            }
            Planted::GyroBiasTemperature => {
                let pattern = by_axis(
                    "gyro_bias_temperature",
                    Vector3::from_fn(|_, _| normal(rng)).normalize(),
                );
                let rho = draw_strength(rng);
                let strong = self.scaled(&pattern, &pattern, rho)?;
                self.effects.push(strong);
            }
            Planted::Line => self.lines = vec![self.line(None, true, rng)],
            Planted::Lines => {
                let count = rng.random_range(2..=3);
                for _ in 0..count {
                    let on_one = rng.random_bool(0.5);
                    self.lines.push(self.line(None, on_one, rng));
                }
            }
            Planted::ProductOfLines => {
                let first = self.line(None, false, rng);
                let second = self.line(None, false, rng);
                let [low_hz, high_hz] = self.band_hz();
                let beats =
                    [1.0, -1.0].map(|side| (first.frequency_hz + side * second.frequency_hz).abs());
                if beats.iter().any(|beat| !(low_hz..high_hz).contains(beat)) {
                    return None;
                }
                // c sin a sin b = c/2 (sin(a − b + π/2) + sin(a + b − π/2)), on one gyro
                let mut sum = self.line(Some(beats[0]), true, rng);
                let mut difference = sum.clone();
                difference.frequency_hz = beats[1];
                let side = (first.frequency_hz - second.frequency_hz).signum();
                for axis in 0..3 {
                    let (a, b) = (first.phase_rad[axis], second.phase_rad[axis]);
                    sum.phase_rad[axis] = a + b - FRAC_PI_2;
                    difference.phase_rad[axis] = side * (a - b) + FRAC_PI_2;
                }
                self.lines = vec![first, second, sum, difference];
            }
            _ => {}
        }
        let spacing_hz = 10.0 / length_s;
        let mut frequencies: Vec<f64> = self.lines.iter().map(|line| line.frequency_hz).collect();
        frequencies.sort_by(f64::total_cmp);
        let apart = frequencies
            .windows(2)
            .all(|pair| pair[1] - pair[0] > spacing_hz);
        apart.then_some(())
    }

    /// Returns the frequencies that rows show \[Hz\].
    fn band_hz(&self) -> [f64; 2] {
        [10.0 * self.rate_hz / self.rows as f64, 0.45 * self.rate_hz]
    }

    /// Draws a line of one gyro, or of all.
    fn line(&self, frequency_hz: Option<f64>, on_one: bool, rng: &mut ChaCha8Rng) -> Line {
        let [low_hz, high_hz] = self.band_hz();
        let frequency_hz = frequency_hz.unwrap_or_else(|| log_uniform(rng, low_hz, high_hz));
        let only = rng.random_range(0..3);
        let rho = log_uniform(rng, LINES[0], LINES[1]);
        // ρ² = A² t/2N² of each gyro
        let length_s = self.rows as f64 / self.rate_hz;
        let amplitude_rad_s = std::array::from_fn(|axis| {
            let is_quiet = on_one && axis != only;
            let share = if on_one { 1.0 } else { 3_f64.sqrt().recip() };
            let walk = self.levels[axis].walk_rad_sqrt_s;
            if is_quiet {
                0.0
            } else {
                share * rho * walk * (2.0 / length_s).sqrt()
            }
        });
        Line {
            frequency_hz,
            amplitude_rad_s,
            phase_rad: std::array::from_fn(|_| 2.0 * PI * rng.random::<f64>()),
            rho,
        }
    }

    /// Scales `pattern` so that `shown` of it has a strength; `None` where no unit of the grade is so.
    fn scaled(&self, pattern: &Effect, shown: &Effect, rho: f64) -> Option<Strong> {
        let case = self.case();
        let sensing_from_body = self.unit.sensing_from_body();
        let added = shown.perturbation(&case, &sensing_from_body);
        let bins = added.gyro_rad.map(|values| dct(&values));
        let weightings = self
            .levels
            .map(|levels| Weighting::new(&levels, case.rows, case.period_s));
        let size = rho / product(&weightings, &bins, &bins).sqrt();
        let effect = pattern.scaled(size);
        // A bias may be gross: the recorder's, not the gyro's.
        let is_credible = self.planted == Planted::GyroBias
            || effect.largest() <= self.grade.largest(effect.kind);
        is_credible.then_some(Strong { effect, rho })
    }

    /// Returns what the instruments are exposed to: the Earth's rotation, gravity, warming.
    pub fn case(&self) -> Case {
        let period_s = 1.0 / self.rate_hz;
        let (sin, cos) = self.site.latitude_rad.sin_cos();
        let earth_rad_s = self.body_from_level * (EARTH_RAD_S * Vector3::new(cos, 0.0, sin));
        let force = self.body_from_level * (self.site.gravity_m_s2 * Vector3::z());
        let motion = Motion {
            terms: std::array::from_fn(|axis| {
                let rate_rad_s = earth_rad_s[axis];
                vec![Term::Spin { rate_rad_s }]
            }),
        };
        let warm = |block: Warming| {
            let ends = (1..=self.rows).map(|row| row as f64 * period_s);
            ends.map(|time_s| block.at_k(time_s)).collect()
        };
        Case {
            motion,
            rows: self.rows,
            period_s,
            increments_rad: std::array::from_fn(|axis| {
                vec![earth_rad_s[axis] * period_s; self.rows]
            }),
            warming_k: self.warming.map(|blocks| blocks.map(warm)),
            force_m_s2: Some(std::array::from_fn(|axis| vec![force[axis]; self.rows])),
        }
    }

    /// Returns what is concealed.
    pub fn concealed(&self) -> Vec<Concealed> {
        let mut all: Vec<Concealed> = self.effects.iter().map(Strong::concealed).collect();
        let length_s = self.rows as f64 / self.rate_hz;
        all.extend(self.lines.iter().map(|line| line.concealed(length_s)));
        let noise = match self.planted {
            Planted::PulseQuantisation => Some([self.pulse_rad; 3]),
            Planted::AngleRandomWalk => self.declared_walk_rad_sqrt_s.map(|declared| {
                std::array::from_fn(|axis| {
                    let walk = self.levels[axis].walk_rad_sqrt_s;
                    (walk * walk - declared[axis] * declared[axis]).sqrt()
                })
            }),
            _ => None,
        };
        all.extend(noise.map(|sizes| Concealed {
            kind: self.planted.name(),
            parameters: numbers(sizes).collect(),
            rho: f64::from(u32::try_from(self.rows).unwrap_or(u32::MAX)).sqrt(),
        }));
        all
    }

    /// Returns grade, rate, length and what is declared in words.
    pub fn conditions(&self) -> Vec<String> {
        let of =
            |has: bool, with: &str, without: &str| (if has { with } else { without }).to_owned();
        let declares = self.declared_walk_rad_sqrt_s.is_some();
        vec![
            format!("grade {}", self.grade.name()),
            format!("rate {} Hz", self.rate_hz),
            format!("length {:.0} s", self.rows as f64 / self.rate_hz),
            of(declares, "declared walk", "no declared noise"),
            of(self.warming.is_some(), "thermometers", "no thermometers"),
        ]
    }
}

impl Line {
    fn concealed(&self, length_s: f64) -> Concealed {
        let resolution = ("resolution_hz".to_owned(), Value::from(1.0 / length_s));
        let frequency = ("frequency_hz".to_owned(), Value::from(self.frequency_hz));
        let expression = format!("sine({:.7})", self.frequency_hz);
        let expression = ("expression".to_owned(), Value::from(expression));
        Concealed {
            kind: "unlisted".to_owned(),
            parameters: numbers(self.amplitude_rad_s)
                .chain([frequency, resolution, expression])
                .collect(),
            rho: self.rho,
        }
    }
}

fn numbers(values: [f64; 3]) -> impl Iterator<Item = (String, Value)> {
    (0..3).map(move |axis| (AXES[axis].to_owned(), Value::from(values[axis])))
}

fn by_axis(kind: &'static str, values: Vector3<f64>) -> Effect {
    let values = (0..3).map(|axis| (AXES[axis].to_owned(), values[axis]));
    Effect {
        kind,
        axis: None,
        values: values.collect(),
    }
}
