//! Motion, sites, counts, seeds: the basis of every scenario.

use super::support::*;
use rlg::recording::Quantity;
use rlg::simulate::coning_demo;
use rlg::simulate::scenario::Scenario;
use std::f64::consts::{PI, TAU};
use std::path::Path;

#[test]
fn flexure_under_coning_drifts_by_the_sum_of_the_coefficients() {
    // 15 Hz at 0.367° is the paper's 0.5 °/h, 1 Hz at 5° its "still consistent"
    for (frequency_hz, angle_deg, printed_deg_h) in [(15.0, 0.367, 0.495), (1.0, 5.0, 0.027)] {
        let angle_rad = f64::to_radians(angle_deg);
        let text = PERFECT.to_owned() + &coning(frequency_hz, angle_rad, 8.0) + TABLE_3;
        let simulation = run(&text, 1);
        let omega = TAU * frequency_hz;
        // the body rate's amplitude is Ω sin φ, exactly
        let predicted =
            -(6.9e-8 + 7.1e-8) * omega.powi(3) * angle_rad.sin().powi(2) / 2.0 * DEG_H_PER_RAD_S;
        // residual: the counter's granularity, one pulse of 1e-13 rad over 4 s
        const COUNTER_DEG_H: f64 = 2.0 * 1e-13 / 4.0 * DEG_H_PER_RAD_S;
        let drift = drift_deg_h(&simulation, 0);
        assert!(
            (drift - predicted).abs() < COUNTER_DEG_H + 1e-9 * predicted.abs(),
            "{drift} against {predicted} °/h"
        );
        // the printed figure has three digits
        assert!((drift.abs() - printed_deg_h).abs() < 0.0005 + 0.01 * printed_deg_h);
        for across in [1, 2] {
            assert!(drift_deg_h(&simulation, across).abs() < 1e-3 * predicted.abs());
        }
    }
}

#[test]
fn coning_turns_the_body_backwards_by_the_cone_and_returns_it() {
    let angle_rad = 0.05;
    let simulation = run(&(PERFECT.to_owned() + &coning(15.0, angle_rad, 8.0)), 1);
    let along: f64 = simulation.case_increments_rad[8000..24000]
        .iter()
        .map(|increment| increment[0])
        .sum();
    // Goodman and Robinson: the rate along the cone's axis is −Ω(1 − cos φ)
    let expected = -TAU * 15.0 * (1.0 - angle_rad.cos()) * 4.0;
    // rounding of 16 000 sums of numbers below 5e-6 rad
    assert!((along - expected).abs() < 1e-13, "{along} {expected}");

    // gravity returns to the z axis only if the attitude does
    let site = "[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 10.0\nearth_rate = false\n\
        [accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
        noise_m_s2_sqrt_hz = 0.0\nweight_m_s2 = 1e-12\n";
    let text = PERFECT.to_owned()
        + site
        + &coning(15.0, angle_rad, 8.0)
        + "[[motion]]\nkind = \"still\"\nduration_s = 0.25\n";
    let recording = run(&text, 1).recording;
    for axis in [0, 1] {
        let force = channel(&recording, Quantity::SpecificForce, axis);
        let swing = force.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        // the tilt about y carries gravity to x; the tilt about z carries it to y in second order only
        assert!(axis == 1 || swing > 0.9 * 10.0 * angle_rad);
        // third-order Bortz terms of 32 000 periods of 1.2e-3 rad, if all were of one sign
        let left_rad = force.last().unwrap().abs() / 10.0;
        assert!(left_rad < 1e-7, "axis {axis}: {left_rad} rad left");
    }
}

#[test]
fn counts_sum_to_the_angle_within_one_pulse() {
    let text = PERFECT.replace("1e-13, 1e-13, 1e-13", "2e-6, 3e-6, 4e-6")
        + DITHER
        + "[[motion]]\nkind = \"slew\"\naxis = \"y\"\nangle_rad = 1.5\nduration_s = 2.0\n";
    let simulation = run(&text, 3);
    for (axis, weight_rad) in [2e-6, 3e-6, 4e-6].into_iter().enumerate() {
        let gain = [1.0, 1.01, 0.99][axis];
        let pickoff = channel(&simulation.recording, Quantity::DitherAngle, axis);
        let sensed = sensed_rad(&simulation, axis);
        let mut counted = 0.0;
        let mut angle = 0.0;
        for row in 1..sensed.len() {
            counted += sensed[row];
            angle += simulation.case_increments_rad[row][axis];
            let block = gain * (pickoff[row] - pickoff[0]);
            assert!(
                (counted - angle - block).abs() < weight_rad,
                "axis {axis}, row {row}"
            );
        }
    }
}

#[test]
fn equation_7_applied_to_the_stripped_increments_gives_the_case_back() {
    let text = PERFECT
        .replace(
            "bias_rad_s = [0.0, 0.0, 0.0]",
            "bias_rad_s = [2e-5, -3e-5, 1e-5]",
        )
        .replace(
            "scale_error = [0.0, 0.0, 0.0]",
            "scale_error = [1e-4, -2e-4, 5e-5]",
        )
        .replace(
            "installation_rad = {}",
            "installation_rad = { xy = 1e-3, xz = -2e-3, yx = 3e-3, yz = 4e-3, zx = -5e-3, zy = 6e-3 }",
        )
        + DITHER
        + "[[motion]]\nkind = \"spin\"\naxis = \"z\"\nrate_rad_s = 3.0\nramp_s = 0.5\n\
           oscillation_axis = \"x\"\noscillation_frequency_hz = 2.0\noscillation_angle_rad = 0.1\n\
           oscillation_phase_rad = 0.3\nduration_s = 2.0\n";
    let simulation = run(&text, 5);
    let gain = [1.0, 1.01, 0.99];
    let (bias, scale) = ([2e-5, -3e-5, 1e-5], [1e-4, -2e-4, 5e-5]);
    let sensed: Vec<_> = (0..3).map(|axis| sensed_rad(&simulation, axis)).collect();
    for row in 1..sensed[0].len() {
        let v: [f64; 3] = std::array::from_fn(|axis| {
            let pickoff = channel(&simulation.recording, Quantity::DitherAngle, axis);
            let stripped = sensed[axis][row] - gain[axis] * (pickoff[row] - pickoff[row - 1]);
            (1.0 - scale[axis]) * stripped - bias[axis] / 4000.0
        });
        let case = [
            v[0] - 2e-3 * v[1] + 1e-3 * v[2],
            4e-3 * v[0] + v[1] + 3e-3 * v[2],
            6e-3 * v[0] - 5e-3 * v[1] + v[2],
        ];
        for axis in 0..3 {
            let error = case[axis] - simulation.case_increments_rad[row][axis];
            // a count and two pickoff codes of 1e-13 rad, each floored or rounded, and the difference of the contract's b
            // T/(1 − s) from Eq. (7)'s b T: second order, 2e-5 °/h for 2 °/h at 10 ppm
            let second_order = (bias[axis] * scale[axis] / 4000.0).abs();
            assert!(
                error.abs() < 3e-13 + 1.01 * second_order,
                "axis {axis}, row {row}: {error}"
            );
        }
    }
}

#[test]
fn sensed_angle_walks_at_the_rate_the_scenario_states() {
    const WALK_RAD_SQRT_S: f64 = 5.8e-7;
    let text = PERFECT.replace(
        "angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]",
        "angle_random_walk_rad_sqrt_s = [5.8e-7, 5.8e-7, 5.8e-7]",
    ) + "[[motion]]\nkind = \"still\"\nduration_s = 60.0\n";
    let simulation = run(&text, 7);
    // angles over 0.05 s: 1200 a gyro
    let squares: Vec<f64> = (0..3)
        .flat_map(|axis| {
            let sensed = sensed_rad(&simulation, axis);
            let sums = sensed.chunks(200).map(|rows| rows.iter().sum::<f64>());
            sums.map(|sum| sum * sum).collect::<Vec<_>>()
        })
        .collect();
    let variance = squares.iter().sum::<f64>() / squares.len() as f64;
    let ratio = variance / (WALK_RAD_SQRT_S.powi(2) * 0.05);
    // 4 deviations of a variance from 3600 independent angles: 4·√(2/3600)
    assert!((ratio - 1.0).abs() < 0.0943, "{ratio}");
}

#[test]
fn dither_has_the_amplitude_and_the_spread_asked_for() {
    let text = PERFECT.to_owned() + DITHER + "[[motion]]\nkind = \"still\"\nduration_s = 30.0\n";
    let recording = run(&text, 9).recording;
    for (axis, amplitude_rad) in [7.3e-4_f64, 6.0e-4, 8.0e-4].into_iter().enumerate() {
        let angle = channel(&recording, Quantity::DitherAngle, axis);
        let mean_square = angle.iter().map(|p| p * p).sum::<f64>() / angle.len() as f64;
        let expected = 0.5 * amplitude_rad.powi(2) * (1.0 + 0.15_f64.powi(2));
        // a² has a relative deviation of 2·0.15; 30 s hold 2·390·30/(2·20) = 585 independent amplitudes: 4·0.3/√585
        assert!((mean_square / expected - 1.0).abs() < 0.05, "axis {axis}");
        let peak = angle.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        // no amplitude exceeds three standard deviations, and 585 draws reach at least one
        assert!(peak <= 1.45 * amplitude_rad && peak > 1.15 * amplitude_rad);
    }
}

#[test]
fn stationary_body_shows_the_earth_and_gravity_at_its_latitude() {
    let text = PERFECT.to_owned()
        + "[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\n\
           [accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
           noise_m_s2_sqrt_hz = 0.0\nweight_m_s2 = 1e-9\n\
           [[motion]]\nkind = \"still\"\nduration_s = 1.0\n\
           [[motion]]\nkind = \"slew\"\naxis = \"x\"\nangle_rad = 3.141592653589793\nduration_s = 2.0\n\
           [[motion]]\nkind = \"still\"\nduration_s = 1.0\n";
    let simulation = run(&text, 1);
    let total = |rows: std::ops::Range<usize>, axis: usize| -> f64 {
        let increments = &simulation.case_increments_rad[rows];
        increments.iter().map(|increment| increment[axis]).sum()
    };
    let (north, up) = (7.292115e-5 * 0.6_f64.cos(), 7.292115e-5 * 0.6_f64.sin());
    // body axes north, west, up; after half a revolution about x: north, east, down
    let after = 12000..16000;
    for (rows, expected) in [
        (0..4000, [north, 0.0, up]),
        (after.clone(), [north, 0.0, -up]),
    ] {
        for (axis, expected) in expected.into_iter().enumerate() {
            let error = total(rows.clone(), axis) - expected;
            // attitude kept to 1e-7 rad times the Earth's 7.3e-5 rad
            assert!(error.abs() < 1e-11, "axis {axis}: {error}");
        }
    }
    let force = channel(&simulation.recording, Quantity::SpecificForce, 2);
    assert!((force[0] - 9.8).abs() < 1e-8 && (force[15999] + 9.8).abs() < 1e-8);
}

#[test]
fn vibration_has_the_rms_rate_and_the_band_asked_for() {
    let text = PERFECT.to_owned()
        + "[[motion]]\nkind = \"vibration\"\nlow_hz = 20.0\nhigh_hz = 80.0\n\
           rate_rms_rad_s = [0.2, 0.1, 0.0]\nramp_s = 0.5\nduration_s = 21.0\n";
    let simulation = run(&text, 11);
    for (axis, rms) in [0.2_f64, 0.1, 0.0].into_iter().enumerate() {
        let rows = &simulation.case_increments_rad[2000..82000];
        let mean_square = rows
            .iter()
            .map(|row| (row[axis] * 4000.0).powi(2))
            .sum::<f64>()
            / rows.len() as f64;
        // 60 Hz for 20 s: 2400 independent values of a square; and increments of 80 Hz are low by 0.07 %
        let allowed = (4.0 * (2.0 / 2400.0_f64).sqrt() + 1e-3) * rms * rms;
        assert!(
            (mean_square - rms * rms).abs() <= allowed,
            "axis {axis}: {mean_square}"
        );
        let angle: f64 = rows.iter().map(|row| row[axis]).sum();
        // no tone below 20 Hz: the angle stays within a few amplitudes of rate/Ω
        assert!(angle.abs() <= 8.0 * rms / (TAU * 20.0));
    }
}

#[test]
fn delayed_gyro_lags_and_jerk_and_acceleration_are_the_derivatives_of_the_rate() {
    let delay_s = 4e-5;
    let text = PERFECT.to_owned()
        + &coning(40.0, 0.01, 3.0)
        + &format!("[[effect]]\nkind = \"gyro_delay\"\ny = {delay_s}\n")
        + "[[effect]]\nkind = \"elastic_rate_by_jerk\"\nzz = 1e-7\n";
    let simulation = run(&text, 1);
    let omega = TAU * 40.0;
    let amplitude = omega * 0.01_f64.sin();
    let (lagging, jerked) = (sensed_rad(&simulation, 1), sensed_rad(&simulation, 2));
    for row in 5000..5100 {
        let (begin, end) = (row as f64 / 4000.0, (row + 1) as f64 / 4000.0);
        // ω_y = −Ω sin φ sin Ωt, ω_z = Ω sin φ cos Ωt for a cone about x
        let y = amplitude / omega
            * ((omega * (end - delay_s)).cos() - (omega * (begin - delay_s)).cos());
        let z = amplitude / omega
            * (1.0 - 1e-7 * omega.powi(2))
            * ((omega * end).sin() - (omega * begin).sin());
        let most = amplitude / 4000.0;
        // the delay's Taylor series ends at the square: (Ωd)³/6 of the rate
        assert!((lagging[row] - y).abs() < (omega * delay_s).powi(3) / 6.0 * most + 1e-12);
        // counter: one pulse of 1e-13 rad
        assert!((jerked[row] - z).abs() < 3e-13);
    }
}

#[test]
fn late_pickoff_with_a_wrong_gain_leaves_that_much_dither() {
    let text = PERFECT.to_owned()
        + DITHER
        + "[[motion]]\nkind = \"still\"\nduration_s = 2.0\n\
           [[effect]]\nkind = \"dither_gain\"\nx = 1e-3\n\
           [[effect]]\nkind = \"dither_delay\"\ny = 2e-5\n";
    let simulation = run(&text, 13);
    let rms = |axis: usize, gain: f64| {
        let pickoff = channel(&simulation.recording, Quantity::DitherAngle, axis);
        let sensed = sensed_rad(&simulation, axis);
        let left = (1..sensed.len())
            .map(|row| sensed[row] - gain * (pickoff[row] - pickoff[row - 1]))
            .map(|left| left * left);
        (left.sum::<f64>() / (sensed.len() - 1) as f64).sqrt()
    };
    // with the right gain the residual is codes of 1e-13 rad
    assert!(rms(0, 1.001) < 3e-13);
    assert!(rms(2, 0.99) < 3e-13);
    // an increment of a sine of amplitude A at f is 2A sin(πfT); a delay d leaves 2 sin(πfd) of it
    let increment = 2.0 * 6.0e-4 * (PI * 430.1 / 4000.0).sin() / 2.0_f64.sqrt();
    let expected = 1.01 * increment * 2.0 * (PI * 430.1 * 2e-5).sin();
    // the standard deviation of the amplitude over 2 s: 4·0.15/√(2·430·2/40), and its square on top
    assert!((rms(1, 1.01) / expected - 1.0).abs() < 0.11);
}

#[test]
fn same_seed_gives_the_same_values_and_another_seed_others() {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/coning.toml"),
    )
    .unwrap()
    .replace("duration_s = 17.0", "duration_s = 2.0");
    assert_eq!(run(&text, 1), run(&text, 1));
    let counts = |seed| channel(&run(&text, seed).recording, Quantity::GyroCount, 0).to_vec();
    assert_ne!(counts(1), counts(2));
}

#[test]
fn concealed_effects_stand_in_the_truth_and_not_in_the_model() {
    let simulation = coning_demo(1).unwrap();
    assert!(simulation.model.effects.is_empty());
    assert_eq!(simulation.truth.effects.len(), 1);
    assert_eq!(simulation.truth.effects[0].kind, "axis_flexure");
    assert!(simulation.truth.to_json().contains("\"xy\": 6.9e-8"));
    assert_eq!(simulation.recording.tables[0].rows, 240_000);
    assert_eq!(simulation.recording.segments.len(), 5);
}

#[test]
fn scenarios_that_come_with_the_tool_are_read() {
    for name in [
        "coning",
        "vibration",
        "null",
        "spin",
        "shaker",
        "beside-fibre-optic",
        "accelerometers",
        "attitudes",
        "health",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/{name}.toml"));
        assert_eq!(Scenario::read(path).unwrap().name, name);
    }
}
