//! The Earth against published values and against the potential it stands for.

mod truth;

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use strapdown::earth;

#[test]
fn gravity_on_the_ellipsoid_is_the_published_one() {
    // TR8350.2 table 3.4: equator and pole, to its last digit
    assert!((earth::gravity_m_s2(0.0, 0.0).z - 9.780_325_335_9).abs() < 1e-10);
    assert!((earth::gravity_m_s2(FRAC_PI_2, 0.0).z - 9.832_184_937_8).abs() < 1e-9);
}

#[test]
fn gravity_with_height_is_the_gradient_of_the_normal_potential() {
    // 1e-7 m/s² (0.01 µg) is 0.06 m of Schuler swing. Downward the second derivative is the sphere's: J2 and
    // the centrifugal part make 2.2 f of it at the equator; the third order, 4 γ (h/a)³, is left out
    for latitude_rad in [-1.2, -0.7, 0.0, 0.3, 0.6, 0.785, 1.1, 1.5_f64] {
        for height_m in [0.0, 1000.0, 10_000.0] {
            let normal = Vector3::new(latitude_rad.cos(), 0.0, latitude_rad.sin());
            let position_m = truth::position_m(&normal, height_m);
            let outward_m = Vector3::new(position_m.x, position_m.y, 0.0);
            let pull =
                truth::attraction_m_s2(&position_m) + outward_m * earth::ROTATION_RAD_S.powi(2);
            let expected = truth::earth_from_ned(&normal).inverse() * pull;
            let found = earth::gravity_m_s2(latitude_rad, height_m);
            let share = height_m / earth::SEMI_MAJOR_AXIS_M;
            let left_out = 9.8 * share.powi(2) * (3.0 * 2.2 * earth::FLATTENING + 4.0 * share);
            let error = found - expected;
            println!("L {latitude_rad:>5} h {height_m:>6}: {error:?}");
            assert!(
                error.xy().norm() < 1e-7,
                "{latitude_rad} {height_m} {error}"
            );
            assert!(
                error.z.abs() < 1e-9 + left_out,
                "{latitude_rad} {height_m} {error}"
            );
        }
    }
}

#[test]
fn a_metre_north_and_a_metre_east_are_the_radii_times_the_angles() {
    for latitude_rad in [-1.3, -0.4, 0.2, 0.9, 1.4_f64] {
        let height_m = 2000.0;
        let at = |latitude_rad: f64, longitude_rad: f64| {
            let (sin, cos) = latitude_rad.sin_cos();
            let normal = Vector3::new(cos * longitude_rad.cos(), cos * longitude_rad.sin(), sin);
            truth::position_m(&normal, height_m)
        };
        // central differences: their own error is the third derivative, 1e-10 of the radius
        let angle = 1e-5;
        let north_m = (at(latitude_rad + angle, 0.0) - at(latitude_rad - angle, 0.0)).norm();
        let east_m = (at(latitude_rad, angle) - at(latitude_rad, -angle)).norm();
        let along_m = earth::meridian_radius_m(latitude_rad) + height_m;
        let around_m = (earth::transverse_radius_m(latitude_rad) + height_m) * latitude_rad.cos();
        assert!((north_m / (2.0 * angle) / along_m - 1.0).abs() < 1e-9);
        assert!((east_m / (2.0 * angle) / around_m - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_level_frame_turns_with_the_velocity_as_it_turns_in_inertial_space() {
    let (latitude_rad, height_m) = (0.8_f64, 5000.0);
    let velocity_m_s = Vector3::new(120.0, -200.0, 3.0);
    let frame = |time_s: f64| {
        let north_rad_s = velocity_m_s.x / (earth::meridian_radius_m(latitude_rad) + height_m);
        let around_m = (earth::transverse_radius_m(latitude_rad) + height_m) * latitude_rad.cos();
        let longitude_rad = (velocity_m_s.y / around_m + earth::ROTATION_RAD_S) * time_s;
        let (sin, cos) = (latitude_rad + north_rad_s * time_s).sin_cos();
        truth::earth_from_ned(&Vector3::new(
            cos * longitude_rad.cos(),
            cos * longitude_rad.sin(),
            sin,
        ))
    };
    // over ±1 s: the third-order term is (1e-4 rad)², 1e-8 of the rate
    let turned_rad = (frame(-1.0).inverse() * frame(1.0)).scaled_axis();
    let rate = earth::earth_rate_rad_s(latitude_rad)
        + earth::transport_rate_rad_s(latitude_rad, height_m, &velocity_m_s);
    assert!((turned_rad / 2.0 - rate).norm() / rate.norm() < 1e-4);
}
