//! Reference instruments: a reference gyro, a fibre-optic triad, the encoders of a table.
//!
//! From the window of periods each gives its increment over the row, in rad, a multiple of its resolution.
//!
//! Input of each: gyros measure the case relative to space, or the base if the case follows the reference through an
//! isolator; encoders the base relative to the ground. Effects on the reference act on the first one.

use super::attitude::Quadrature;
use super::instrument::{AngleEncoder, Seeds, Stream, normal, stream};
use super::layout::{self, ReferenceKind};
use super::scenario::Scenario;
use super::window::{Shift, Window};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;

/// Triad of reference channels.
pub struct ReferenceTriad<'a> {
    scenario: &'a Scenario,
    /// Kind of reference.
    pub kind: ReferenceKind,
    /// True for the reference that the model describes.
    first: bool,
    shift: Option<Shift>,
    encoders: Vec<AngleEncoder>,
    weight_rad: f64,
    scale_error: Vector3<f64>,
    bias_rad_s: Vector3<f64>,
    rate_walk_rad_s: f64,
    rate_rngs: Vec<ChaCha8Rng>,
    table_rad: Vector3<f64>,
    attitude_rng: Option<(ChaCha8Rng, f64)>,
}

impl<'a> ReferenceTriad<'a> {
    /// All references of the scenario.
    pub fn all(scenario: &'a Scenario, seeds: Seeds, quadrature: &Quadrature) -> Vec<Self> {
        layout::references(scenario)
            .enumerate()
            .map(|(index, kind)| Self::new(scenario, kind, index == 0, seeds, quadrature))
            .collect()
    }

    fn new(
        scenario: &'a Scenario,
        kind: ReferenceKind,
        first: bool,
        seeds: Seeds,
        quadrature: &Quadrature,
    ) -> Self {
        let period_s = 1.0 / scenario.rate_hz;
        let mut triad = Self {
            scenario,
            kind,
            first,
            shift: None,
            encoders: Vec::new(),
            weight_rad: 0.0,
            scale_error: Vector3::zeros(),
            bias_rad_s: Vector3::zeros(),
            rate_walk_rad_s: 0.0,
            rate_rngs: Vec::new(),
            table_rad: Vector3::zeros(),
            attitude_rng: None,
        };
        let delay_s = scenario.effects.reference_delay_s();
        if first && delay_s != 0.0 {
            triad.shift = Some(Shift::new(delay_s, quadrature, period_s));
        }
        let (from, weight_rad, noise_rad, walk) = match kind {
            ReferenceKind::Gyro => {
                let entry = scenario.reference.expect("this kind is there");
                if entry.attitude {
                    let rng = stream(seeds, Stream::Reference, 3);
                    triad.attitude_rng = Some((rng, entry.angle_noise_rad));
                }
                (
                    Stream::Reference,
                    entry.weight_rad,
                    entry.angle_noise_rad,
                    entry.angle_random_walk_rad_sqrt_s,
                )
            }
            ReferenceKind::FibreOptic => {
                let entry = scenario.fibre_optic.expect("this kind is there");
                triad.scale_error = Vector3::from(entry.scale_error);
                triad.bias_rad_s = Vector3::from(entry.bias_rad_s);
                triad.rate_walk_rad_s = entry.rate_random_walk_rad_s_sqrt_s * period_s.sqrt();
                triad.rate_rngs = (3..6)
                    .map(|number| stream(seeds, Stream::FibreOptic, number))
                    .collect();
                (
                    Stream::FibreOptic,
                    entry.weight_rad,
                    entry.angle_noise_rad,
                    entry.angle_random_walk_rad_sqrt_s,
                )
            }
            ReferenceKind::Encoder => {
                let entry = scenario.encoder.expect("this kind is there");
                (
                    Stream::Encoder,
                    entry.weight_rad,
                    entry.angle_noise_rad,
                    0.0,
                )
            }
        };
        triad.weight_rad = weight_rad;
        triad.encoders = (0..3)
            .map(|axis| {
                let rng = stream(seeds, from, axis);
                AngleEncoder::new(weight_rad, noise_rad, walk * period_s.sqrt(), rng)
            })
            .collect();
        triad
    }

    /// Number of rows needed before the recorded one, and after it.
    pub fn reach(&self) -> (usize, usize) {
        self.shift.map_or((0, 0), |shift| shift.reach())
    }

    fn exposed(&self, window: &Window, quadrature: &Quadrature, period_s: f64) -> Vector3<f64> {
        let on_base = self.first && self.scenario.reference_on_base();
        let nodes = match self.kind {
            ReferenceKind::Encoder => |period: &super::case::Period| period.table_rad_s,
            _ if on_base => |period: &super::case::Period| period.base_rad_s,
            _ => |period: &super::case::Period| period.case_rad_s,
        };
        match &self.shift {
            None => quadrature.integrate(&nodes(window.now()), period_s),
            Some(shift) => window.shifted(shift, nodes),
        }
    }

    /// Measures the increments of the row \[rad\].
    pub fn read(&mut self, window: &Window, quadrature: &Quadrature, period_s: f64) -> [f64; 3] {
        let mut exposed = self.exposed(window, quadrature, period_s);
        let table_before = self.table_rad;
        self.table_rad += quadrature.integrate(&window.now().table_rad_s, period_s);
        if self.kind == ReferenceKind::FibreOptic {
            for axis in 0..3 {
                self.bias_rad_s[axis] += self.rate_walk_rad_s * normal(&mut self.rate_rngs[axis]);
            }
            exposed += self.scale_error.component_mul(&exposed) + self.bias_rad_s * period_s;
        }
        if self.first {
            let effects = &self.scenario.effects;
            exposed = effects.reference_reads(&exposed);
            for axis in 0..3 {
                exposed[axis] += effects.encoder_error_rad(axis, self.table_rad[axis])
                    - effects.encoder_error_rad(axis, table_before[axis]);
            }
        }
        std::array::from_fn(|axis| self.encoders[axis].step(exposed[axis]) * self.weight_rad)
    }

    /// Measures the attitude at the row's end, w x y z, with small rotations of white noise; `None` if not recorded.
    pub fn attitude(&mut self, window: &Window) -> Option<[f64; 4]> {
        let on_base = self.scenario.reference_on_base();
        let (rng, noise_rad) = self.attitude_rng.as_mut()?;
        let noise = Vector3::from_fn(|_, _| *noise_rad * normal(rng));
        let now = window.now();
        let truth = if on_base {
            now.base_attitude
        } else {
            now.case_attitude
        };
        let q = truth * UnitQuaternion::from_scaled_axis(noise);
        Some([q.w, q.i, q.j, q.k])
    }
}
