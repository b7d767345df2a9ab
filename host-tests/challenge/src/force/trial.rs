//! Recording of a rotated unit with accelerometers, drawn.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_recording::error::InputError;
use rlg_simulator::instrument::normal;

use super::effects::added_m_s;
use super::felt::{Felt, Level};
use super::planted::Planted;
use crate::bounds::beside;
use crate::marks::case::GRAVITY_M_S2;
use crate::marks::effects::{Concealed, Effect, Strong};
use crate::marks::family::Family;
use crate::marks::kinds::find;
use crate::marks::noise::{Drift, Levels, Weighting, dct, product};
use crate::marks::rows::Rows;
use crate::marks::setting::{Limits, log_uniform, one_of, shown, sign};

/// Range of the matched-filter SNR of an accelerometer effect: from hardly visible to gross.
const STRENGTHS: [f64; 2] = [10.0, 3000.0];

/// Drawn recording.
#[derive(Debug, Clone)]
pub struct Turned {
    /// Injected kind.
    pub planted: Planted,
    /// Gyros, reference and motion, with the effects injected into them.
    pub rows: Rows,
    /// Attitude of the unit at the start, and its site.
    pub level: Level,
    /// Noise of the accelerometers, of velocity instead of angle \[m/s/√s, m/s, m/s²/√s, m/s²\].
    pub noise: Levels,
    /// Velocity of a pulse, if the accelerometers count \[m/s\].
    pub pulse_m_s: Option<f64>,
    /// Gyro rows per accelerometer row; above one, the accelerometers have a separate table.
    pub together: usize,
    /// Biases known to the model \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// Scale errors known to the model.
    pub scale_error: [f64; 3],
    /// The model declares the accelerometers' white noise.
    pub declares_noise: bool,
    /// Effect injected into the accelerometers.
    pub effect: Option<Strong>,
}

impl Turned {
    /// Draws the recording of a trial's number.
    ///
    /// # Errors No drawn unit shows the injected effect.
    pub fn draw(number: u64, limits: &Limits, rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::of(number);
        shown(&planted.name(), || Self::attempt(planted, limits, rng))
    }

    fn attempt(planted: Planted, limits: &Limits, rng: &mut ChaCha8Rng) -> Option<Self> {
        let kinds: Vec<_> = planted
            .beside()
            .and_then(find)
            .into_iter()
            .copied()
            .collect();
        let mut rows = Rows::attempt(Family::Force, limits, &kinds, rng)?;
        // The force is recorded below, on a unit of any attitude.
        rows.setting.has_force = false;
        let density_m_s2_sqrt_hz = log_uniform(rng, 3e-5, 1e-3);
        // One-sided density n²: a velocity random walk of n²/2 a second.
        let walk = density_m_s2_sqrt_hz / 2_f64.sqrt();
        let corner_hz = log_uniform(rng, 3.0 / rows.setting.length_s(), 0.3);
        let drift = match rng.random_range(0..4) {
            0 => Drift::RateWalk(corner_hz),
            1 => Drift::Flicker(corner_hz),
            _ => Drift::None,
        };
        let together = one_of(rng, &[1, 1, 2, 4]);
        let period_s = together as f64 / rows.setting.rate_hz;
        let is_counted = rng.random_bool(0.4);
        let is_known = rng.random_bool(0.6);
        let mut known = |size: f64| -> [f64; 3] {
            let size = if is_known { size } else { 0.0 };
            std::array::from_fn(|_| size * (2.0 * rng.random::<f64>() - 1.0))
        };
        let (bias_m_s2, scale_error) = (known(2e-3), known(3e-4));
        let mut drawn = Self {
            planted,
            level: draw_level(rng),
            noise: Levels::white(walk, 0.0).drifting(drift),
            pulse_m_s: is_counted.then(|| walk * period_s.sqrt() * log_uniform(rng, 0.1, 2.0)),
            together,
            bias_m_s2,
            scale_error,
            declares_noise: is_known && rng.random_bool(0.7),
            effect: None,
            rows,
        };
        if let Some(pattern) = planted.pattern(rng) {
            let rho = log_uniform(rng, STRENGTHS[0], STRENGTHS[1]);
            drawn.effect = Some(drawn.scaled(&pattern, rho)?);
        }
        Some(drawn)
    }

    /// Returns number and period of the accelerometers' rows \[s\].
    pub fn span(&self) -> (usize, f64) {
        let setting = &self.rows.setting;
        (
            setting.rows / self.together,
            self.together as f64 / setting.rate_hz,
        )
    }

    /// Returns the specific force of the body.
    pub fn felt(&self) -> Felt {
        Felt::new(&self.rows.motion, &self.level, self.span())
    }

    /// Scales a pattern to a strength given an unknown level and ground rotation; `None` if the size is not credible for an
    /// accelerometer, or the effect is in their span.
    fn scaled(&self, pattern: &Effect, rho: f64) -> Option<Strong> {
        // Delays are nonlinear in their size: a small one first.
        const SMALL: f64 = 1e-3;
        let largest = self.planted.largest();
        let felt = self.felt();
        let hidden = self.level_columns();
        let weightings = self.weightings();
        let gram = DMatrix::from_fn(hidden.len(), hidden.len(), |a, b| {
            product(&weightings, &hidden[a], &hidden[b])
        });
        let shown: Vec<usize> = (0..hidden.len()).filter(|&a| gram[(a, a)] > 0.0).collect();
        let strength = |effect: &Effect| {
            let added = added_m_s(effect, (&self.rows.motion, &felt), self.span());
            let shape = added.map(|values| dct(&values));
            let own = product(&weightings, &shape, &shape);
            let along = |a: usize, _| product(&weightings, &shape, &hidden[a]);
            let against = DVector::from_fn(hidden.len(), along);
            beside(&gram, own, &against, &shown).sqrt()
        };
        let mut effect = pattern.scaled(SMALL * largest);
        for _ in 0..2 {
            let now = strength(&effect);
            if now <= 0.0 {
                return None;
            }
            effect = effect.scaled(rho / now);
            if effect.largest() > largest {
                return None;
            }
        }
        let rho = strength(&effect);
        Some(Strong { effect, rho })
    }

    /// Returns the inverse covariances of the accelerometers' noise; the reference's random walk tilts the vertical, so the
    /// force has a random walk too.
    fn weightings(&self) -> [Weighting; 3] {
        let (count, period_s) = self.span();
        let pulses = self.pulse_m_s.unwrap_or(0.0) / 12_f64.sqrt();
        let tilting = Levels {
            rate_walk_rad_s_sqrt_s: self.level.gravity_m_s2
                * self.rows.setting.reference_walk_rad_sqrt_s,
            ..Levels::white(0.0, pulses)
        };
        let weighting = Weighting::new(&self.noise.beside(tilting), count, period_s);
        std::array::from_fn(|_| weighting.clone())
    }

    /// Returns DCTs of the columns of an initial tilt and of a ground rotation about two level axes.
    fn level_columns(&self) -> Vec<[Vec<f64>; 3]> {
        let (count, period_s) = self.span();
        let level = &self.level;
        let mut columns = Vec::new();
        for up in [level.north, level.up.cross(&level.north)] {
            let tilted = Level { up, ..*level };
            let felt = Felt::new(&self.rows.motion, &tilted, (count, period_s));
            let tilt: [Vec<f64>; 3] =
                std::array::from_fn(|axis| felt.increments_m_s(axis, 0.0, (count, period_s)));
            let turning = tilt.each_ref().map(|values| {
                let rows = values.iter().enumerate();
                let turned = rows.map(|(row, value)| value * (row as f64 + 0.5) * period_s);
                dct(&turned.collect::<Vec<f64>>())
            });
            columns.push(tilt.map(|values| dct(&values)));
            columns.push(turning);
        }
        columns
    }

    /// Returns the concealed effects.
    pub fn concealed(&self) -> Vec<Concealed> {
        let beside = self.rows.effects.iter();
        beside.chain(&self.effect).map(Strong::concealed).collect()
    }

    /// Returns the setting in words.
    pub fn conditions(&self) -> Vec<String> {
        let of =
            |has: bool, with: &str, without: &str| (if has { with } else { without }).to_owned();
        let setting = &self.rows.setting;
        let is_drifting = self.noise.rate_walk_rad_s_sqrt_s + self.noise.flicker_rad_s > 0.0;
        let mut words = setting.groups();
        words.retain(|name| !name.starts_with("drift"));
        words.push(format!("length {:.0} s", setting.length_s()));
        words.push(format!("accelerometers every {} rows", self.together));
        words.push(of(
            is_drifting,
            "accelerometers drift",
            "accelerometers do not drift",
        ));
        words.push(of(self.pulse_m_s.is_some(), "counted", "not counted"));
        words.push(of(
            self.declares_noise,
            "noise declared",
            "no noise declared",
        ));
        words
    }
}

/// Draws the attitude of a unit: level within some degrees, either side up, or random.
fn draw_level(rng: &mut ChaCha8Rng) -> Level {
    let mut vector = || Vector3::from_fn(|_, _| normal(rng));
    let (tilt, any, other) = (vector(), vector(), vector());
    let up = match rng.random_bool(0.6) {
        true => UnitQuaternion::from_scaled_axis(0.03 * tilt) * (sign(rng) * Vector3::z()),
        false => any.normalize(),
    };
    Level {
        up,
        north: up.cross(&other).normalize(),
        latitude_rad: sign(rng) * (0.1 + 1.2 * rng.random::<f64>()),
        gravity_m_s2: GRAVITY_M_S2,
    }
}
