//! Recording of a unit at rest, drawn.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_recording::Site;
use rlg_recording::error::InputError;
use rlg_simulator::attitude::EARTH_RATE_RAD_S;
use rlg_simulator::instrument::normal;

use super::lines::{Line, Room, numbers};
use super::planted::Planted;
use crate::marks::case::{Case, GRAVITY_M_S2, Unit, Warming};
use crate::marks::effects::{AXES, Concealed, Effect, Strong};
use crate::marks::grade::Grade;
use crate::marks::motion::{Motion, Term};
use crate::marks::noise::{Drift, Levels, Weighting, dct};
use crate::marks::setting::{Limits, draw_strength, log_uniform, one_of, shown, sign};

/// Row rates \[Hz\].
const RATES_HZ: [f64; 4] = [10.0, 50.0, 100.0, 200.0];

/// Shortest and longest recording \[s\].
const LENGTH_S: [f64; 2] = [60.0, 1200.0];

/// Range of an injected bias \[σ\].
const BIASES: [f64; 2] = [5.0, 1e4];

/// Drawn recording.
#[derive(Debug, Clone)]
pub struct Still {
    /// Injected kind.
    pub planted: Planted,
    /// Grade of the gyros.
    pub grade: Grade,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Site of the unit.
    pub site: Site,
    /// Attitude: body from north, west, up.
    pub body_from_level: UnitQuaternion<f64>,
    /// Noise of each gyro.
    pub levels: [Levels; 3],
    /// Angle random walk declared by the model \[rad/√s\].
    pub declared_walk_rad_sqrt_s: Option<[f64; 3]>,
    /// Pulse weight \[rad\].
    pub pulse_rad: f64,
    /// Pulse weight in the model \[rad\].
    pub declared_pulse_rad: f64,
    /// Constants known to the model.
    pub unit: Unit,
    /// Warming of the blocks, if thermometers are recorded.
    pub warming: Option<[Warming; 3]>,
    /// Effects.
    pub effects: Vec<Strong>,
    /// Lines.
    pub lines: Vec<Line>,
}

impl Still {
    /// Draws the recording of a trial's number.
    ///
    /// # Errors No drawn unit shows the injected effect.
    pub fn draw(number: u64, limits: &Limits, rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::of(number);
        shown(&planted.name(), || Self::attempt(planted, limits, rng))
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

    /// Draws effects and lines; `None` if not credible for the grade.
    fn plant(&mut self, rng: &mut ChaCha8Rng) -> Option<()> {
        let length_s = self.rows as f64 / self.rate_hz;
        match self.planted {
            Planted::GyroBias => {
                let direction = Vector3::from_fn(|_, _| normal(rng)).normalize();
                // An east component acts like a rotation of the Earth rate, and is observable only to second order.
                let east = self.body_from_level * -Vector3::y();
                let pattern = by_axis("gyro_bias", direction);
                let shown = by_axis("gyro_bias", direction - east * east.dot(&direction));
                let sigmas = log_uniform(rng, BIASES[0], BIASES[1]);
                let strong = self.scaled(&pattern, &shown, sigmas)?;
                self.effects.push(strong);
            }
            Planted::GyroBiasStep => {
                let count = rng.random_range(1..=2);
                let first = rng.random_range(0..3);
                for axis in [first, (first + 1) % 3].into_iter().take(count) {
                    let time_s = length_s * (0.15 + 0.7 * rng.random::<f64>());
                    let pattern = Effect {
                        kind: "gyro_bias_step",
                        axis: Some(axis),
                        values: BTreeMap::from([
                            ("time_s".to_owned(), time_s),
                            ("size".to_owned(), sign(rng)),
                        ]),
                    };
                    let rho = draw_strength(rng);
                    self.effects.push(self.scaled(&pattern, &pattern, rho)?);
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
            _ => {}
        }
        let room = Room {
            rate_hz: self.rate_hz,
            rows: self.rows,
            walk_rad_sqrt_s: self.levels.map(|levels| levels.walk_rad_sqrt_s),
        };
        self.lines = room.lines(self.planted, rng)?;
        Some(())
    }

    /// Scales `pattern` so that its part `shown` has a strength, given a bias unless it is one itself; `None` if the size
    /// is not credible for the grade.
    fn scaled(&self, pattern: &Effect, shown: &Effect, rho: f64) -> Option<Strong> {
        let case = self.case();
        let sensing_from_body = self.unit.sensing_from_body();
        let added = shown.perturbation(&case, &sensing_from_body);
        let constant = dct(&vec![case.period_s; case.rows]);
        let power: f64 = (0..3)
            .map(|axis| {
                let weighting = Weighting::new(&self.levels[axis], case.rows, case.period_s);
                let bins = dct(&added.gyro_rad[axis]);
                let own = weighting.product(&bins, &bins);
                if pattern.kind == "gyro_bias" {
                    return own;
                }
                let along = weighting.product(&bins, &constant);
                own - along * along / weighting.product(&constant, &constant)
            })
            .sum();
        let effect = pattern.scaled(rho / power.sqrt());
        // A bias may be gross: an error of the recorder, not of the gyro.
        let is_credible = self.planted == Planted::GyroBias
            || effect.largest() <= self.grade.largest(effect.kind);
        is_credible.then_some(Strong { effect, rho })
    }

    /// Returns the input of the instruments: the Earth's rotation, gravity, warming.
    pub fn case(&self) -> Case {
        let period_s = 1.0 / self.rate_hz;
        let (sin, cos) = self.site.latitude_rad.sin_cos();
        let earth_rad_s = self.body_from_level * (EARTH_RATE_RAD_S * Vector3::new(cos, 0.0, sin));
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

    /// Returns the concealed effects.
    pub fn concealed(&self) -> Vec<Concealed> {
        let mut all: Vec<Concealed> = self.effects.iter().map(Strong::concealed).collect();
        all.extend(self.lines.iter().map(Line::concealed));
        all.extend(self.concealed_noise());
        all
    }

    /// Returns undeclared noise of a kind in the contract; its strength is the increase of the rows' power over the
    /// standard deviation of that power.
    fn concealed_noise(&self) -> Option<Concealed> {
        let declared = self.declared_walk_rad_sqrt_s.unwrap_or_default();
        let excess = |axis: usize| {
            let walk = self.levels[axis].walk_rad_sqrt_s;
            (walk * walk - declared[axis] * declared[axis]).sqrt()
        };
        let row_rad2 = self.levels[0].walk_rad_sqrt_s.powi(2) / self.rate_hz;
        let (sizes, more) = match self.planted {
            Planted::PulseQuantisation => {
                ([self.pulse_rad; 3], self.pulse_rad.powi(2) / 6.0 / row_rad2)
            }
            Planted::AngleRandomWalk => {
                let sizes = [0, 1, 2].map(excess);
                (sizes, (sizes[0] / declared[0]).powi(2))
            }
            _ => return None,
        };
        Some(Concealed {
            kind: self.planted.name(),
            parameters: numbers(sizes).collect(),
            rho: more * (1.5 * self.rows as f64).sqrt(),
        })
    }

    /// Returns grade, rate, length and declarations in words.
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

fn by_axis(kind: &'static str, values: Vector3<f64>) -> Effect {
    let values = (0..3).map(|axis| (AXES[axis].to_owned(), values[axis]));
    Effect {
        kind,
        axis: None,
        values: values.collect(),
    }
}
