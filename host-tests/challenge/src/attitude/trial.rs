//! Recording with an attitude reference, drawn.

use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rlg_recording::error::InputError;
use rlg_simulator::instrument::normal;

use super::courses::{COURSES, Course};
use super::faults::{self, Fault};
use super::low_pass;
use super::path::Path;
use super::planted::{POLES_S, Planted};
use super::reference::Reference;
use super::strength::Stamped;
use crate::marks::case::{Case, GRAVITY_M_S2, Unit};
use crate::marks::effects::{Concealed, Effect, Strong};
use crate::marks::grade::Grade;
use crate::marks::motion::{Derivative, Motion};
use crate::marks::noise::Levels;
use crate::marks::setting::{log_uniform, one_of, shown};

/// Row rates \[Hz\].
const RATES_HZ: [f64; 4] = [100.0, 200.0, 250.0, 500.0];

/// Range of the length \[s\].
const LENGTH_S: [f64; 2] = [30.0, 90.0];

/// Least matched-filter SNR of an effect.
const LEAST_RHO: f64 = 10.0;

/// Time before the first row with known motion, longer than any delay \[s\].
const BEFORE_S: f64 = 1.0;

/// Initial size for the scaling, as a share of the largest; every effect is linear there.
const SMALL: f64 = 1e-3;

/// Drawn recording.
#[derive(Debug, Clone)]
pub struct Attitudes {
    /// Injected kind.
    pub planted: Planted,
    /// Motion of the case.
    pub course: Course,
    /// Rotation of the case.
    pub motion: Motion,
    /// Rotation of the reference's case, if unrelated.
    pub of_another_case: Option<Motion>,
    /// Acceleration along body axes, as rates \[m/s²\].
    pub acceleration: Motion,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Grade of the gyros.
    pub grade: Grade,
    /// Angle random walk of the gyros \[rad/√s\].
    pub walk_rad_sqrt_s: [f64; 3],
    /// Pulse weight of the gyros \[rad\].
    pub pulse_rad: f64,
    /// Constants known to the model.
    pub unit: Unit,
    /// Attitude reference.
    pub reference: Reference,
    /// Stamps of the reference \[s\].
    pub stamps_s: Vec<f64>,
    /// Rotation of the reference's frame against the initial axes of the case.
    pub frame: UnitQuaternion<f64>,
    /// Injected effect.
    pub effect: Option<Strong>,
    /// Faults of the reference.
    pub faults: Vec<Fault>,
}

impl Attitudes {
    /// Draws the recording of a trial's number.
    ///
    /// # Errors No setting shows the injected effect.
    pub fn draw(number: u64, rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::of(number);
        shown(&planted.name(), || Self::attempt(planted, rng))
    }

    /// Draws gyros with one motion and attitudes of another, unrelated motion of the same type.
    ///
    /// # Errors
    /// As [`Attitudes::draw`].
    pub fn of_two_motions(rng: &mut ChaCha8Rng) -> Result<Self, InputError> {
        let planted = Planted::None;
        let mut drawn = shown(&planted.name(), || Self::attempt(planted, rng))?;
        let length_s = drawn.rows as f64 * drawn.period_s();
        let another = drawn.course.draw((drawn.rate_hz, length_s), rng);
        drawn.of_another_case = Some(another);
        Ok(drawn)
    }

    fn attempt(planted: Planted, rng: &mut ChaCha8Rng) -> Option<Self> {
        let course = one_of(rng, &COURSES);
        let rate_hz = one_of(rng, &RATES_HZ);
        let rows = (log_uniform(rng, LENGTH_S[0], LENGTH_S[1]) * rate_hz).round() as usize;
        let length_s = rows as f64 / rate_hz;
        let grade = Grade::draw(rng);
        let walk_rad_sqrt_s = grade.draw_walk_rad_sqrt_s(rng);
        let reference = Reference::draw(rate_hz, rng);
        let mut drawn = Self {
            planted,
            course,
            motion: course.draw((rate_hz, length_s), rng),
            of_another_case: None,
            acceleration: course.acceleration(rng),
            rate_hz,
            rows,
            grade,
            walk_rad_sqrt_s,
            pulse_rad: walk_rad_sqrt_s[0] / rate_hz.sqrt() * log_uniform(rng, 0.1, 1.0),
            unit: Unit::draw(rng),
            reference,
            stamps_s: reference.stamps_s(length_s, rng),
            frame: UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| normal(rng))),
            effect: None,
            faults: Vec::new(),
        };
        let pattern = planted.pattern(rng);
        let motion = drawn.motion.clone();
        let path = integrated(&motion, rate_hz, rows);
        if let Some(pattern) = pattern {
            let case = drawn.case(&path);
            drawn.effect = Some(drawn.scaled(&pattern, (&path, &case), rng)?);
        }
        let of = (&path, drawn.stamps_s.as_slice());
        let faults = faults::draw(planted, &drawn.reference, of, rng)?;
        drawn.faults = faults;
        Some(drawn)
    }

    /// Draws a size between that of the least SNR and the largest of the gyros' grade.
    fn scaled(
        &self,
        pattern: &Effect,
        (path, case): (&Path, &Case),
        rng: &mut ChaCha8Rng,
    ) -> Option<Strong> {
        let stamped = Stamped::new((path, case), &self.stamps_s, &self.levels());
        let rho = |effect: &Effect| stamped.rho(effect, &|one| self.added_rad(one, case));
        if self.planted == Planted::GyroBandwidth {
            let effect = pattern.scaled(log_uniform(rng, POLES_S[0], POLES_S[1]));
            let rho = rho(&effect);
            return (rho > LEAST_RHO).then_some(Strong { effect, rho });
        }
        let largest = self.grade.largest(pattern.kind);
        let by_size = rho(&pattern.scaled(SMALL * largest)) / (SMALL * largest);
        let least = LEAST_RHO / by_size;
        (least < largest).then(|| {
            let size = log_uniform(rng, least, largest);
            Strong {
                effect: pattern.scaled(size),
                rho: by_size * size,
            }
        })
    }

    /// Returns the period of a row \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Integrates the attitude, from before the first row on.
    pub fn path(&self) -> Path<'_> {
        integrated(&self.motion, self.rate_hz, self.rows)
    }

    /// Integrates the attitude of the reference's case, if unrelated.
    pub fn other_path(&self) -> Option<Path<'_>> {
        let motion = self.of_another_case.as_ref()?;
        Some(integrated(motion, self.rate_hz, self.rows))
    }

    /// Returns the input of the instruments.
    pub fn case(&self, path: &Path) -> Case {
        let (rows, period_s) = (self.rows, self.period_s());
        let attitudes = path.at_ends(0.0, rows);
        let up = Vector3::z() * GRAVITY_M_S2;
        let gravity: Vec<Vector3<f64>> = attitudes
            .windows(2)
            .map(|pair| 0.5 * (pair[0].inverse() * up + pair[1].inverse() * up))
            .collect();
        let force = std::array::from_fn(|axis| {
            let middle_s = 0.5 * period_s;
            let moved = self
                .acceleration
                .series(Derivative::Rate, axis, middle_s, period_s, rows);
            moved
                .iter()
                .zip(&gravity)
                .map(|(own, gravity)| own + gravity[axis])
                .collect()
        });
        Case {
            motion: self.motion.clone(),
            rows,
            period_s,
            increments_rad: std::array::from_fn(|axis| {
                self.motion.increments_rad(axis, 0.0, period_s, rows)
            }),
            warming_k: None,
            force_m_s2: Some(force),
        }
    }

    /// Returns an effect's contribution to the gyros' increments in a case \[rad by row\].
    pub fn added_rad(&self, effect: &Effect, case: &Case) -> [Vec<f64>; 3] {
        let sensing_from_body = self.unit.sensing_from_body();
        let pole_s = effect.value("x_pole_s");
        if pole_s == 0.0 {
            return effect.perturbation(case, &sensing_from_body).gyro_rad;
        }
        let [x, y, z] = low_pass::added_rad(case, pole_s);
        let sensed =
            (0..case.rows).map(|row| sensing_from_body * Vector3::new(x[row], y[row], z[row]));
        let mut added: [Vec<f64>; 3] = Default::default();
        for value in sensed {
            for (axis, values) in added.iter_mut().enumerate() {
                values.push(value[axis]);
            }
        }
        added
    }

    /// Returns the noise of the difference between the attitude growth of the gyros and of the reference.
    fn levels(&self) -> Levels {
        let walk = self.walk_rad_sqrt_s.iter().copied().fold(0.0, f64::max);
        Levels::white(walk, 0.0).beside(self.reference.levels())
    }

    /// Returns the concealed effects.
    pub fn concealed(&self) -> Vec<Concealed> {
        let faults = self
            .faults
            .iter()
            .map(|fault| fault.concealed(&self.stamps_s));
        let mut all: Vec<Concealed> = self.effect.iter().map(Strong::concealed).collect();
        if let Some(filter) = all.iter_mut().find(|one| one.kind == "gyro_bandwidth") {
            // Equivalent parameter by the contract's other name: the variance of a pole is τ².
            let poles = filter.parameters.clone();
            for (name, pole_s) in poles {
                let axis = name.trim_end_matches("_pole_s").to_owned();
                let variance_s2 = pole_s.as_f64().unwrap_or(0.0).powi(2);
                filter.parameters.insert(axis, variance_s2.into());
            }
        }
        all.extend(faults);
        all
    }

    /// Returns motion, reference, grade, rate and length in words.
    pub fn conditions(&self) -> Vec<String> {
        vec![
            format!("motion {}", self.course.name()),
            format!("reference {}", self.reference.name()),
            format!("grade {}", self.grade.name()),
            format!("rate {} Hz", self.rate_hz),
            format!("length {:.0} s", self.rows as f64 / self.rate_hz),
        ]
    }
}

fn integrated(motion: &Motion, rate_hz: f64, rows: usize) -> Path<'_> {
    let before = (BEFORE_S * rate_hz).ceil();
    Path::new(
        motion,
        -before / rate_hz,
        1.0 / rate_hz,
        before as usize + rows,
    )
}
