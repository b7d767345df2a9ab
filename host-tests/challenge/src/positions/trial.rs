//! Accelerometers in successive positions, drawn.

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_recording::error::InputError;
use rlg_simulator::instrument::normal;

use super::planted::Planted;
use crate::marks::case::GRAVITY_M_S2;
use crate::marks::effects::{AXES, Concealed, Effect, Strong};
use crate::marks::setting::{Limits, log_uniform, one_of, shown};

/// Row rates \[Hz\].
const RATES_HZ: [f64; 4] = [20.0, 50.0, 100.0, 200.0];

/// Range of the strengths \[σ\]: from clear to gross.
const STRENGTHS: [f64; 2] = [30.0, 3000.0];

/// Range of the strengths for six positions alone \[σ\]: six lengths determine at most six parameters.
const STRENGTHS_OF_SIX: [f64; 2] = [1000.0, 10_000.0];

/// Programme of positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Programme {
    /// Each axis up and down.
    Faces,
    /// Faces, and six of the edges.
    FacesAndEdges,
    /// 24 of the 26 faces, edges and corners.
    Tumble,
    /// Random attitudes.
    Random(usize),
}

/// Disturbance of a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbed {
    /// Continuous shaking by a motor \[m/s²\].
    Shaken(f64),
    /// Slow rotation \[rad/s\].
    Turning(f64),
    /// Knock \[s after its start\].
    Knocked(f64),
    /// Constant force on the bench \[m/s²\].
    LeanedOn(f64),
}

/// Position of the unit.
#[derive(Debug, Clone, Copy)]
pub struct Position {
    /// Body from local level, z up.
    pub body_from_level: UnitQuaternion<f64>,
    /// Duration of the move to it \[s\].
    pub way_s: f64,
    /// Duration of the hold \[s\].
    pub dwell_s: f64,
    /// Random error of each accelerometer in this position, not declared \[m/s²\].
    pub scatter_m_s2: Vector3<f64>,
    /// Disturbance.
    pub disturbed: Option<Disturbed>,
}

/// Drawn recording.
#[derive(Debug, Clone)]
pub struct Stood {
    /// Injected kind.
    pub planted: Planted,
    /// Programme of positions.
    pub programme: Programme,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Positions.
    pub positions: Vec<Position>,
    /// White noise of the accelerometers, one-sided \[m/s²/√Hz\].
    pub density_m_s2_sqrt_hz: f64,
    /// Standard deviation of the scatter between positions \[m/s²\].
    pub scatter_m_s2: f64,
    /// Random walk of each bias \[m/s²/√s\].
    pub walk_m_s2_sqrt_s: f64,
    /// Gravity \[m/s²\].
    pub gravity_m_s2: f64,
    /// The recording states its site.
    pub has_site: bool,
    /// Gyros are recorded, without any reference.
    pub has_gyros: bool,
    /// Biases known to the model \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// Scale errors known to the model.
    pub scale_error: [f64; 3],
    /// Injected effects.
    pub effects: Vec<Strong>,
}

impl Stood {
    /// Draws the recording of a trial's number.
    ///
    /// # Errors No drawn unit shows the injected effect.
    pub fn draw(number: u64, limits: &Limits, rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::of(number);
        shown(&planted.name(), || Self::attempt(planted, limits, rng))
    }

    fn attempt(planted: Planted, limits: &Limits, rng: &mut ChaCha8Rng) -> Option<Self> {
        let count = rng.random_range(12..=36);
        let programme = one_of(
            rng,
            &[
                Programme::Faces,
                Programme::FacesAndEdges,
                Programme::Tumble,
                Programme::Random(count),
            ],
        );
        if programme == Programme::Faces && !planted.is_shown_by_faces() {
            return None;
        }
        let rate_hz = one_of(rng, &RATES_HZ);
        let density = log_uniform(rng, 3e-5, 1e-3);
        // Between a third of the noise of a mean and thirty times it.
        let scatter_m_s2 = density / (2.0 * 10.0_f64).sqrt() * log_uniform(rng, 0.3, 30.0);
        let is_walking = rng.random_bool(0.4);
        let walk = if is_walking {
            scatter_m_s2 * log_uniform(rng, 0.03, 0.3)
        } else {
            0.0
        };
        let is_known = rng.random_bool(0.4);
        let mut known = |size: f64| -> [f64; 3] {
            let size = if is_known { size } else { 0.0 };
            std::array::from_fn(|_| size * (2.0 * rng.random::<f64>() - 1.0))
        };
        let (bias_m_s2, scale_error) = (known(0.05), known(0.01));
        let has_site = rng.random_bool(0.7);
        let gravity_m_s2 = match has_site {
            true => GRAVITY_M_S2 + 0.01 * normal(rng),
            false => 9.780 + 0.052 * rng.random::<f64>(),
        };
        let mut drawn = Self {
            planted,
            programme,
            rate_hz,
            positions: positions(programme, scatter_m_s2, rng),
            density_m_s2_sqrt_hz: density,
            scatter_m_s2,
            walk_m_s2_sqrt_s: walk,
            gravity_m_s2,
            has_site,
            has_gyros: rng.random_bool(0.3),
            bias_m_s2,
            scale_error,
            effects: Vec::new(),
        };
        if drawn.rows() as f64 > limits.most_rows {
            return None;
        }
        let strengths = match programme {
            Programme::Faces => STRENGTHS_OF_SIX,
            _ => STRENGTHS,
        };
        for (pattern, largest) in planted.patterns(rng) {
            let rho = log_uniform(rng, strengths[0], strengths[1]);
            let size = rho / drawn.strength(&pattern);
            let effect = pattern.scaled(size);
            if !(size.is_finite() && effect.largest() <= largest) {
                return None;
            }
            drawn.effects.push(Strong { effect, rho });
        }
        Some(drawn)
    }

    /// Returns the total duration \[s\].
    fn length_s(&self) -> f64 {
        self.positions
            .iter()
            .map(|one| one.way_s + one.dwell_s)
            .sum()
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        (self.length_s() * self.rate_hz).floor() as usize
    }

    /// Returns the specific force of the body in a position \[m/s²\].
    pub fn force_m_s2(&self, one: &Position) -> Vector3<f64> {
        one.body_from_level * (self.gravity_m_s2 * Vector3::z())
    }

    /// Strength of an effect in the positions' lengths of the force, given an unknown gravity \[σ\].
    fn strength(&self, effect: &Effect) -> f64 {
        let walked = self.walk_m_s2_sqrt_s * (0.5 * self.length_s()).sqrt();
        let mut shown = Vec::new();
        for one in &self.positions {
            let force = self.force_m_s2(one);
            let white = self.density_m_s2_sqrt_hz / (2.0 * one.dwell_s).sqrt();
            let variance = white.powi(2) + self.scatter_m_s2.powi(2) + walked.powi(2);
            let longer = added_m_s2(effect, &force).dot(&force.normalize());
            shown.push(longer / variance.sqrt());
        }
        let mean = shown.iter().sum::<f64>() / shown.len() as f64;
        let common = if self.has_site { 0.0 } else { mean };
        shown
            .iter()
            .map(|one| (one - common).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Returns the concealed effects.
    pub fn concealed(&self) -> Vec<Concealed> {
        self.effects.iter().map(Strong::concealed).collect()
    }

    /// Returns programme, rate and disturbances in words.
    pub fn conditions(&self) -> Vec<String> {
        let of =
            |has: bool, with: &str, without: &str| (if has { with } else { without }).to_owned();
        let programme = match self.programme {
            Programme::Faces => "programme 6 faces",
            Programme::FacesAndEdges => "programme 12 faces and edges",
            Programme::Tumble => "programme 24 tumble",
            Programme::Random(_) => "programme random attitudes",
        };
        let disturbed = self.positions.iter().any(|one| one.disturbed.is_some());
        vec![
            programme.to_owned(),
            format!("rate {} Hz", self.rate_hz),
            format!("length {:.0} s", self.length_s()),
            of(self.walk_m_s2_sqrt_s > 0.0, "walking biases", "no drift"),
            of(disturbed, "disturbed positions", "undisturbed"),
            of(self.has_site, "site", "no site"),
            of(self.has_gyros, "gyros", "no gyros"),
        ]
    }
}

/// Error of accelerometers at rest for an effect \[m/s²\] (contract).
pub fn added_m_s2(effect: &Effect, f: &Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| {
        let own = effect.value(AXES[i]);
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let tilt = |about: usize| effect.value(&[AXES[i], AXES[about]].concat());
        match effect.kind {
            "accel_bias" => own,
            "accel_scale" => own * f[i],
            "accel_quadratic" => own * f[i] * f[i],
            "accel_misalignment" => tilt(k) * f[j] - tilt(j) * f[k],
            _ => 0.0,
        }
    })
}

/// Directions of up in the body by programme.
fn ups(programme: Programme, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let unit = |axis: usize, sign: f64| Vector3::ith(axis, sign);
    let faces = || (0..3).flat_map(|axis| [unit(axis, 1.0), unit(axis, -1.0)]);
    let edges = || {
        (0..3).flat_map(|i| {
            let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
            signs.map(|(a, b)| (unit(i, a) + unit((i + 1) % 3, b)).normalize())
        })
    };
    match programme {
        Programme::Faces => faces().collect(),
        Programme::FacesAndEdges => faces().chain(edges().step_by(2)).collect(),
        Programme::Tumble => {
            let corners = (0..6).map(|corner| {
                let sign = |bit: usize| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                Vector3::new(sign(0), sign(1), sign(2)).normalize()
            });
            faces().chain(edges()).chain(corners).collect()
        }
        Programme::Random(count) => (0..count)
            .map(|_| Vector3::from_fn(|_, _| normal(rng)).normalize())
            .collect(),
    }
}

fn positions(programme: Programme, scatter_m_s2: f64, rng: &mut ChaCha8Rng) -> Vec<Position> {
    let shortest_s = log_uniform(rng, 4.0, 15.0);
    let is_alike = rng.random_bool(0.5);
    let ups = ups(programme, rng);
    let count = ups.len();
    let mut all = Vec::with_capacity(count);
    for up in ups {
        // Placed by hand, to a degree or two.
        let by_hand = Vector3::from_fn(|_, _| 0.02 * normal(rng));
        let about_up = UnitQuaternion::from_scaled_axis(up * (6.0 * rng.random::<f64>()));
        let lies = UnitQuaternion::rotation_between(&Vector3::z(), &up).unwrap_or_else(|| {
            UnitQuaternion::from_scaled_axis(std::f64::consts::PI * Vector3::x())
        });
        all.push(Position {
            body_from_level: UnitQuaternion::from_scaled_axis(by_hand) * about_up * lies,
            way_s: log_uniform(rng, 1.0, 5.0),
            dwell_s: shortest_s
                * if is_alike {
                    1.0
                } else {
                    log_uniform(rng, 1.0, 3.0)
                },
            scatter_m_s2: Vector3::from_fn(|_, _| scatter_m_s2 * normal(rng)),
            disturbed: None,
        });
    }
    let last = all.len();
    for _ in 0..rng.random_range(0..=2) {
        let place = rng.random_range(0..last);
        let dwell_s = all[place].dwell_s;
        // All of six positions are needed.
        let disturbed = match rng.random_range(0..4) {
            0 if count > 6 => Disturbed::Shaken(log_uniform(rng, 0.05, 0.5)),
            1 if count > 6 => Disturbed::Turning(log_uniform(rng, 0.03, 0.2) / dwell_s),
            2 if count > 6 => Disturbed::LeanedOn(scatter_m_s2 * log_uniform(rng, 3.0, 100.0)),
            _ => Disturbed::Knocked(dwell_s * (0.2 + 0.6 * rng.random::<f64>())),
        };
        all[place].disturbed = Some(disturbed);
    }
    all
}
