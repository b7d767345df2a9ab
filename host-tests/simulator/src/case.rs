//! Motion of the case, and the input of its instruments.
//!
//! From the base's motion at the nodes of one period it forms a [`Period`]: body-frame rates, specific forces and the rates
//! sensed by the gyros, at the same nodes.
//!
//! Data flow: base → isolator → reaction of the dithers → attitude (Earth, gravity, field) → modes of the
//! suspensions → effects.
//!
//! Reaction: a block and its case exchange angular momentum, so the case rotates by −r_j times the block's angle relative
//! to it, r_j = J_block/(J_block + J_case): three axes, three frequencies.

use super::attitude::{Attitude, Ground, Quadrature};
use super::dither::BlockDither;
use super::effects::{Effects, Exposure};
use super::isolator::{self, Isolator};
use super::mode::Mode;
use super::motion::{BaseMotion, BodyMotion};
use super::scenario::Scenario;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Input of all instruments over one period, at its nodes, body frame.
#[derive(Debug, Clone)]
pub struct Period {
    /// Rate of the case relative to space, with the Earth's rotation at the site \[rad/s\].
    pub case_rad_s: [Vector3<f64>; 4],
    /// Rate of the base relative to space \[rad/s\].
    pub base_rad_s: [Vector3<f64>; 4],
    /// Rate of the base relative to the ground \[rad/s\].
    pub table_rad_s: [Vector3<f64>; 4],
    /// Rate sensed by the gyros: M⁻¹ω + effects \[rad/s\].
    pub sensed_rad_s: [Vector3<f64>; 4],
    /// Specific force at the place of each accelerometer, before its own errors \[m/s²\].
    pub force_m_s2: [Vector3<f64>; 4],
    /// Attitude of the case at the period's end, body to navigation frame.
    pub case_attitude: UnitQuaternion<f64>,
    /// Attitude of the base at the period's end.
    pub base_attitude: UnitQuaternion<f64>,
    /// Warming since the start, at the period's end \[K\].
    pub warming_k: Vector3<f64>,
    /// Magnetic field at the last node \[T\], 0.07 of a row before the end.
    pub field_t: Vector3<f64>,
}

impl Period {
    /// Period in which all quantities keep their values at this one's start.
    pub fn held_at_begin(&self) -> Self {
        let held = |nodes: &[Vector3<f64>; 4]| [nodes[0]; 4];
        Self {
            case_rad_s: held(&self.case_rad_s),
            base_rad_s: held(&self.base_rad_s),
            table_rad_s: held(&self.table_rad_s),
            sensed_rad_s: held(&self.sensed_rad_s),
            force_m_s2: held(&self.force_m_s2),
            ..self.clone()
        }
    }
}

/// Case and its state.
pub struct Case<'a> {
    scenario: &'a Scenario,
    effects: &'a Effects,
    ground: Ground,
    isolator: Option<Isolator>,
    base_attitude: Attitude,
    attitude: Attitude,
    modes: Vec<[Mode; 3]>,
    gyro_from_body: Matrix3<f64>,
    period_s: f64,
    period: usize,
}

impl<'a> Case<'a> {
    /// Case at rest at the scenario's start.
    pub fn new(scenario: &'a Scenario, quadrature: &Quadrature) -> Self {
        let eps = &scenario.gyro.installation_rad;
        let body_from_gyro = Matrix3::new(
            1.0, eps.xz, eps.xy, //
            eps.yz, 1.0, eps.yx, //
            eps.zy, eps.zx, 1.0,
        );
        let period_s = 1.0 / scenario.rate_hz;
        let effects = &scenario.effects;
        let mut ground = scenario.site.map_or_else(Ground::default, |site| {
            Ground::at(site.latitude_rad, site.gravity_m_s2, site.earth_rate)
        });
        if let Some(magnetic) = &scenario.magnetic {
            ground.field_t = Vector3::from(magnetic.navigation_field_t);
        }
        let attitude = Attitude::new(scenario.attitude_wxyz);
        ground.unreferenced_rate_rad_s = attitude.navigation_from_body * effects.earth_rate_rad_s();
        Self {
            scenario,
            effects,
            ground,
            isolator: scenario
                .isolator()
                .map(|entry| Isolator::new(&entry, quadrature, period_s)),
            base_attitude: attitude.clone(),
            attitude,
            modes: effects
                .flexure_modes()
                .map(|(frequency_hz, damping)| {
                    [0, 1, 2].map(|_| Mode::new(frequency_hz, damping, quadrature, period_s))
                })
                .collect(),
            // the scenario accepts only |ε| ≤ 0.1, where the matrix is diagonally dominant
            gyro_from_body: body_from_gyro
                .try_inverse()
                .expect("a diagonally dominant matrix has an inverse"),
            period_s,
            period: 0,
        }
    }

    /// Computes the next period.
    pub fn advance(
        &mut self,
        quadrature: &Quadrature,
        base: &[BaseMotion; 4],
        dithers: &[BlockDither],
    ) -> Period {
        let since_start_s =
            |node: usize, period: usize| (period as f64 + quadrature.nodes[node]) * self.period_s;
        let begin = self.period;
        self.period += 1;
        let blocks: [[[f64; 4]; 3]; 4] = std::array::from_fn(|node| {
            let time_s = self.scenario.start_s + since_start_s(node, begin);
            std::array::from_fn(|axis| {
                let needed = self.needs_blocks();
                let block = dithers.get(axis).filter(|_| needed);
                block.map_or([0.0; 4], |block| block.jet_rad(time_s))
            })
        });
        let mut case = match &mut self.isolator {
            Some(isolator) => isolator.advance(base),
            None => *base,
        };
        if let Some(dither) = &self.scenario.dither {
            for (axis, ratio) in dither.reaction_ratio.into_iter().enumerate() {
                if ratio == 0.0 {
                    continue;
                }
                for (node, block) in case.iter_mut().zip(&blocks) {
                    let [_, rate, acceleration, jerk] = block[axis];
                    let turned = [rate, acceleration, jerk].map(|value| -ratio * value);
                    isolator::add(&mut node.angular, axis, turned);
                }
            }
        }
        let table_rad_s = base.map(|node| node.angular.rate_rad_s);
        let relative = case.map(|node| node.angular.rate_rad_s);
        let before = self.attitude.navigation_from_body;
        let seen = self
            .attitude
            .advance(quadrature, &relative, self.period_s, &self.ground);
        let base_seen =
            if relative == table_rad_s && before == self.base_attitude.navigation_from_body {
                self.base_attitude = self.attitude.clone();
                seen
            } else {
                self.base_attitude
                    .advance(quadrature, &table_rad_s, self.period_s, &self.ground)
            };
        let mut period = Period {
            case_rad_s: [Vector3::zeros(); 4],
            base_rad_s: [Vector3::zeros(); 4],
            table_rad_s,
            sensed_rad_s: [Vector3::zeros(); 4],
            force_m_s2: [Vector3::zeros(); 4],
            case_attitude: self.attitude.navigation_from_body,
            base_attitude: self.base_attitude.navigation_from_body,
            warming_k: Vector3::zeros(),
            field_t: Vector3::zeros(),
        };
        let exposures: [Exposure; 4] = std::array::from_fn(|node| {
            let turning = case[node].angular.rate_rad_s;
            let referenced = seen[node].earth_rate_rad_s;
            period.case_rad_s[node] = turning + referenced;
            period.base_rad_s[node] = table_rad_s[node] + base_seen[node].earth_rate_rad_s;
            let earth = referenced + seen[node].unreferenced_rate_rad_s;
            let at_rest = seen[node].specific_force_m_s2;
            let mut exposure = Exposure {
                since_start_s: since_start_s(node, begin),
                motion: BodyMotion {
                    rate_rad_s: turning + earth,
                    // the Earth's rotation is fixed in space: in body axes it rotates the opposite way
                    acceleration_rad_s2: case[node].angular.acceleration_rad_s2
                        - turning.cross(&earth),
                    jerk_rad_s3: case[node].angular.jerk_rad_s3
                        - case[node].angular.acceleration_rad_s2.cross(&earth)
                        + turning.cross(&turning.cross(&earth)),
                },
                force_m_s2: at_rest + case[node].linear_m_s2,
                force_rate_m_s3: -turning.cross(&at_rest) + case[node].linear_rate_m_s3,
                warming_k: Vector3::zeros(),
                warming_rate_k_s: Vector3::zeros(),
                field_t: seen[node].field_t,
                block_rad: blocks[node].map(|jet| [jet[0], jet[1]]),
                bent_rad: Matrix3::zeros(),
            };
            if let Some(thermal) = &self.scenario.thermal {
                (exposure.warming_k, exposure.warming_rate_k_s) =
                    thermal.warming(exposure.since_start_s);
            }
            if let Some(magnetic) = &self.scenario.magnetic {
                exposure.field_t += magnetic.coil_t(exposure.since_start_s);
            }
            exposure
        });
        let exposures = self.bend(exposures);
        for (node, exposure) in exposures.iter().enumerate() {
            period.sensed_rad_s[node] = self.gyro_from_body * exposure.motion.rate_rad_s
                + self.effects.sensed_rate(exposure);
            period.force_m_s2[node] = self.effects.felt_force(exposure);
        }
        if let Some(thermal) = &self.scenario.thermal {
            period.warming_k = thermal.warming(self.period as f64 * self.period_s).0;
        }
        period.field_t = exposures[3].field_t;
        period
    }

    /// Adds the tilts of the suspensions' modes, driven by the inertial angular acceleration.
    fn bend(&mut self, mut exposures: [Exposure; 4]) -> [Exposure; 4] {
        for (index, modes) in self.modes.iter_mut().enumerate() {
            for (axis, mode) in modes.iter_mut().enumerate() {
                let stiffness = mode.omega_rad_s.powi(2);
                let drive = [0, 1, 2, 3]
                    .map(|node| stiffness * exposures[node].motion.acceleration_rad_s2[axis]);
                for (exposure, [bend, _]) in exposures.iter_mut().zip(mode.advance(drive)) {
                    self.effects
                        .add_mode_tilt(index, axis, bend, &mut exposure.bent_rad);
                }
            }
        }
        exposures
    }

    fn needs_blocks(&self) -> bool {
        let reacts = |dither: &super::scenario::DitherEntry| dither.reaction_ratio != [0.0; 3];
        self.scenario.dither.as_ref().is_some_and(reacts) || self.effects.has_expressions()
    }
}
