//! Ten hours on perfect data: errors of the mechanisation itself.
//!
//! The project asks for 0.01 nmile/h, a fiftieth of a good navigator's 0.5; the mechanisation is held to a hundredth of
//! that, because terms that are easily lost (the level frame's half turn in a period, gravity's lean to the south with
//! height) would hide below 0.01. The height is aided by the true one: a free vertical channel diverges within hours.

mod truth;

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};
use strapdown::{EulerAngles, Navigator, VerticalChannel};
use truth::Trajectory;

const NAUTICAL_MILE_M: f64 = 1852.0;

/// A hundredth of the project's goal \[nmile/h\].
const BOUND_NMILE_H: f64 = 1e-4;

const HOURS: f64 = 10.0;

/// Sum of sines: amplitude, period \[s\], phase \[rad\].
fn sway(time_s: f64, waves: &[(f64, f64, f64)]) -> f64 {
    waves
        .iter()
        .map(|(amplitude, period_s, phase)| amplitude * (TAU * time_s / period_s + phase).sin())
        .sum()
}

/// Its derivative \[1/s\].
fn sway_rate(time_s: f64, waves: &[(f64, f64, f64)]) -> f64 {
    let rate = |(amplitude, period_s, phase): &(f64, f64, f64)| {
        amplitude * TAU / period_s * (TAU * time_s / period_s + phase).cos()
    };
    waves.iter().map(rate).sum()
}

/// At rest in a laboratory, tilted.
struct Bench;

impl Trajectory for Bench {
    fn normal(&self, _: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (sin, cos) = 0.6_f64.sin_cos();
        (Vector3::new(cos, 0.0, sin), Vector3::zeros())
    }
    fn height_m(&self, _: f64) -> (f64, f64) {
        (120.0, 0.0)
    }
    fn euler(&self, _: f64) -> EulerAngles {
        EulerAngles {
            roll_rad: 0.4,
            pitch_rad: -0.3,
            heading_rad: 2.0,
        }
    }
}

/// An aircraft at 250 m/s along a great circle of the sphere of normals, from 9° south over the equator to 46° north,
/// swinging to both sides with turns, at 10 km with climbs. Its attitude is independent of its path.
struct Aircraft;

impl Aircraft {
    /// 220 km to both sides in an hour and 1.3 km in 400 s: turns of 0.1 g.
    const SIDE: [(f64, f64, f64); 2] = [(0.035, 3600.0, 0.0), (2e-4, 400.0, 0.7)];
    /// 2 km in 30 minutes.
    const CLIMB: [(f64, f64, f64); 1] = [(1000.0, 1800.0, 0.0)];
    const BANK: [(f64, f64, f64); 3] = [(0.3, 400.0, 0.2), (0.05, 7.0, 0.0), (0.02, 1.3, 0.4)];
    const PITCH: [(f64, f64, f64); 2] = [(0.05, 1800.0, 1.5), (0.02, 5.0, 0.9)];
    const YAW: [(f64, f64, f64); 2] = [(0.3, 3600.0, 0.0), (0.01, 3.0, 0.1)];
}

impl Trajectory for Aircraft {
    fn normal(&self, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        // the path's plane: along x and "ahead", inclined by 50°
        let plane = Rotation3::from_axis_angle(&Vector3::x_axis(), 50_f64.to_radians());
        let ahead_rad_s = 250.0 / 6.38e6;
        let ahead = ahead_rad_s * time_s - 0.2;
        let side = sway(time_s, &Self::SIDE);
        let side_rate = sway_rate(time_s, &Self::SIDE);
        let along = Vector3::new(ahead.cos(), ahead.sin(), 0.0);
        let along_rate = Vector3::new(-ahead.sin(), ahead.cos(), 0.0) * ahead_rad_s;
        let normal = along * side.cos() + Vector3::z() * side.sin();
        let rate = along_rate * side.cos() - along * (side.sin() * side_rate)
            + Vector3::z() * (side.cos() * side_rate);
        (plane * normal, plane * rate)
    }
    fn height_m(&self, time_s: f64) -> (f64, f64) {
        (
            10_000.0 + sway(time_s, &Self::CLIMB),
            sway_rate(time_s, &Self::CLIMB),
        )
    }
    fn euler(&self, time_s: f64) -> EulerAngles {
        EulerAngles {
            roll_rad: sway(time_s, &Self::BANK),
            pitch_rad: sway(time_s, &Self::PITCH),
            heading_rad: 0.9 + sway(time_s, &Self::YAW),
        }
    }
}

/// A ship hove to at 60° north: rolling 15°, pitching, yawing, heaving and surging with the sea.
struct Ship;

impl Ship {
    const ROLL: [(f64, f64, f64); 2] = [(0.26, 8.0, 0.0), (0.05, 11.3, 1.0)];
    const PITCH: [(f64, f64, f64); 2] = [(0.09, 6.0, 0.5), (0.02, 9.1, 0.2)];
    const YAW: [(f64, f64, f64); 2] = [(0.07, 12.0, 0.3), (0.4, 1200.0, 0.0)];
    const HEAVE: [(f64, f64, f64); 1] = [(2.0, 7.0, 0.1)];
    /// 2 m with the waves, \[rad\] of the ellipsoid's normal, and 4 knots of tide either way.
    const NORTH: [(f64, f64, f64); 2] = [(3e-7, 7.5, 0.2), (2.3e-3, 44_700.0, 0.0)];
    const EAST: [(f64, f64, f64); 1] = [(4e-7, 6.5, 1.2)];
}

impl Trajectory for Ship {
    fn normal(&self, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let latitude = 60_f64.to_radians() + sway(time_s, &Self::NORTH);
        let longitude = 3.1 + sway(time_s, &Self::EAST);
        let (latitude_rate, longitude_rate) = (
            sway_rate(time_s, &Self::NORTH),
            sway_rate(time_s, &Self::EAST),
        );
        let ((sin, cos), (sin_long, cos_long)) = (latitude.sin_cos(), longitude.sin_cos());
        let north = Vector3::new(-sin * cos_long, -sin * sin_long, cos);
        let east = Vector3::new(-sin_long, cos_long, 0.0);
        (
            Vector3::new(cos * cos_long, cos * sin_long, sin),
            north * latitude_rate + east * (cos * longitude_rate),
        )
    }
    fn height_m(&self, time_s: f64) -> (f64, f64) {
        (sway(time_s, &Self::HEAVE), sway_rate(time_s, &Self::HEAVE))
    }
    fn euler(&self, time_s: f64) -> EulerAngles {
        EulerAngles {
            roll_rad: sway(time_s, &Self::ROLL),
            pitch_rad: sway(time_s, &Self::PITCH),
            heading_rad: 0.3 + sway(time_s, &Self::YAW),
        }
    }
}

/// The worst rate at which the position leaves the truth \[nmile/h\], sampled every six minutes, from the first hour
/// on: before it one metre would count for miles an hour.
fn worst_nmile_h(path: &impl Trajectory, name: &str, rate_hz: f64) -> f64 {
    let period_s = 1.0 / rate_hz;
    let mut navigator = Navigator::new(truth::solution(path, 0.0));
    let steps = (HOURS * 3600.0 * rate_hz) as u64;
    let every = (360.0 * rate_hz) as u64;
    let mut worst = 0.0_f64;
    let mut last = [0.0; 4];
    for (step, increment) in (1..=steps).zip(truth::increments(path, period_s)) {
        let time_s = step as f64 * period_s;
        let middle_s = time_s - 0.5 * period_s;
        let aid = VerticalChannel::Aided(path.height_m(middle_s).0);
        let found = *navigator.advance(&increment, aid);
        if step % every == 0 {
            let truth = truth::solution(path, time_s);
            let [north_m, east_m] = found.offset_m(truth.latitude_rad, truth.longitude_rad);
            let hours = time_s / 3600.0;
            if hours >= 1.0 {
                worst = worst.max(north_m.hypot(east_m) / NAUTICAL_MILE_M / hours);
            }
            last = [
                north_m.hypot(east_m),
                (found.velocity_m_s - truth.velocity_m_s).xy().norm(),
                found.ned_from_body.angle_to(&truth.ned_from_body),
                found.height_m - truth.height_m,
            ];
        }
    }
    println!(
        "{name:<9} {rate_hz:>3} Hz: worst {worst:.2e} nmile/h; after {HOURS} h {:.2e} m, {:.1e} m/s, {:.1e} rad; height {:.1e} m",
        last[0], last[1], last[2], last[3]
    );
    worst
}

#[test]
fn at_rest_on_the_turning_earth_it_keeps_its_place_for_ten_hours() {
    assert!(worst_nmile_h(&Bench, "bench", 50.0) < BOUND_NMILE_H);
}

#[test]
fn along_a_great_circle_with_turns_and_climbs_it_keeps_its_place_for_ten_hours() {
    assert!(worst_nmile_h(&Aircraft, "aircraft", 100.0) < BOUND_NMILE_H);
}

#[test]
fn on_a_rolling_ship_it_keeps_its_place_for_ten_hours() {
    assert!(worst_nmile_h(&Ship, "ship", 100.0) < BOUND_NMILE_H);
}
