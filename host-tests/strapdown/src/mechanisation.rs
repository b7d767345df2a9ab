//! Advances attitude, velocity and position by one step a period.
//!
//! A step takes an [`Increment`]: the body's rotation vector \[rad\] and velocity increment \[m/s\], both in the body
//! frame at the period's beginning, with coning, sculling and rotation already included. It gives the [`Solution`] in
//! north, east, down.
//!
//! ```text
//! q ← turn(−ζ) q turn(φ)                 ζ = (ω_ie + ω_en) T
//! v ← v + (1 − ζ×/2) C_nb Δv + (g − (2 ω_ie + ω_en) × v) T
//! L̇ = v_N/(R_M + h)    λ̇ = v_E/((R_T + h) cos L)    ḣ = −v_D
//! ```
//! Groves 2013, section 5.4 and 5.5, with the level frame's rates, gravity and the Coriolis term at the period's
//! middle: the step is done twice, first with the values at its beginning. So the error of a step is third order in the
//! period; `tests/perfect_data.rs` shows the residual after ten hours.
//!
//! Assumed: increments without gaps, latitude within ±89°.

use nalgebra::{UnitQuaternion, Vector3};

use crate::attitude::{EulerAngles, difference_rad};
use crate::earth;
use crate::vertical::{HeightLoop, VerticalChannel};

/// Increments of one period, in the body frame at its beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Increment {
    /// Rotation vector against inertial space \[rad\].
    pub rotation_rad: Vector3<f64>,
    /// Integral of the specific force \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// The period \[s\].
    pub period_s: f64,
}

/// Position, velocity and attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Attitude: rotation of body components into north, east, down.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Velocity over the Earth, north, east, down \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Longitude \[rad\], −π to π.
    pub longitude_rad: f64,
    /// Height over the ellipsoid \[m\].
    pub height_m: f64,
}

impl Solution {
    /// Heading, pitch and roll \[rad\].
    pub fn euler(&self) -> EulerAngles {
        EulerAngles::of(&self.ned_from_body)
    }

    /// Distance north and east of a place on the ellipsoid \[m\]; for distances small against the Earth's radius.
    pub fn offset_m(&self, latitude_rad: f64, longitude_rad: f64) -> [f64; 2] {
        let north = (self.latitude_rad - latitude_rad) * earth::meridian_radius_m(latitude_rad);
        let radius_m = earth::transverse_radius_m(latitude_rad) * latitude_rad.cos();
        [
            north,
            difference_rad(self.longitude_rad, longitude_rad) * radius_m,
        ]
    }
}

/// A strapdown navigator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Navigator {
    solution: Solution,
    height_loop: HeightLoop,
    gravity_disturbance_m_s2: Vector3<f64>,
}

impl Navigator {
    /// Starts from `solution`.
    pub fn new(solution: Solution) -> Self {
        Self {
            solution,
            height_loop: HeightLoop::default(),
            gravity_disturbance_m_s2: Vector3::zeros(),
        }
    }

    /// Sets the unit's local gravity less normal gravity, north, east, down \[m/s²\].
    pub fn with_gravity_disturbance(mut self, disturbance_m_s2: Vector3<f64>) -> Self {
        self.gravity_disturbance_m_s2 = disturbance_m_s2;
        self
    }

    /// The present solution.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Advances the solution by one period.
    pub fn advance(&mut self, increment: &Increment, channel: VerticalChannel) -> &Solution {
        let begin = self.solution;
        let mut height_loop = self.height_loop;
        let mut end = begin;
        for _ in 0..2 {
            height_loop = self.height_loop;
            end = self.step(&begin, &end, increment, channel, &mut height_loop);
        }
        self.height_loop = height_loop;
        self.solution = end;
        &self.solution
    }

    /// The solution after `increment`, with the rates at the middle between `begin` and a guess of the end.
    fn step(
        &self,
        begin: &Solution,
        guess: &Solution,
        increment: &Increment,
        channel: VerticalChannel,
        height_loop: &mut HeightLoop,
    ) -> Solution {
        let period_s = increment.period_s;
        let latitude_rad = 0.5 * (begin.latitude_rad + guess.latitude_rad);
        let height_m = 0.5 * (begin.height_m + guess.height_m);
        let velocity_m_s = 0.5 * (begin.velocity_m_s + guess.velocity_m_s);

        let earth_rate = earth::earth_rate_rad_s(latitude_rad);
        let transport_rate = earth::transport_rate_rad_s(latitude_rad, height_m, &velocity_m_s);
        let level_turn_rad = (earth_rate + transport_rate) * period_s;
        let correction = height_loop.correct(channel, height_m, period_s);
        let mut acceleration_m_s2 = earth::gravity_m_s2(latitude_rad, height_m)
            + self.gravity_disturbance_m_s2
            - (2.0 * earth_rate + transport_rate).cross(&velocity_m_s);
        acceleration_m_s2.z += correction.down_m_s2;

        let felt_m_s = begin.ned_from_body * increment.velocity_m_s;
        let end_velocity_m_s = begin.velocity_m_s + felt_m_s
            - 0.5 * level_turn_rad.cross(&felt_m_s)
            + acceleration_m_s2 * period_s;

        let mean_m_s = 0.5 * (begin.velocity_m_s + end_velocity_m_s);
        let along_m = earth::meridian_radius_m(latitude_rad) + height_m;
        let around_m = (earth::transverse_radius_m(latitude_rad) + height_m) * latitude_rad.cos();
        let mut attitude = UnitQuaternion::from_scaled_axis(-level_turn_rad)
            * begin.ned_from_body
            * UnitQuaternion::from_scaled_axis(increment.rotation_rad);
        // exact to first order and free of a root: rounding is all there is to take out
        attitude.renormalize_fast();
        Solution {
            ned_from_body: attitude,
            velocity_m_s: end_velocity_m_s,
            latitude_rad: begin.latitude_rad + mean_m_s.x / along_m * period_s,
            longitude_rad: difference_rad(
                begin.longitude_rad + mean_m_s.y / around_m * period_s,
                0.0,
            ),
            height_m: begin.height_m + (correction.climb_m_s - mean_m_s.z) * period_s,
        }
    }
}
