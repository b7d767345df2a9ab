//! Effects on anything but the gyros' case part, and on the other instruments, compared with formulas.

use super::support::*;
use nalgebra::{Complex, Vector3};
use rlg::recording::Quantity;
use rlg::simulate::attitude::Quadrature;
use rlg::simulate::isolator::{Isolator, IsolatorEntry};
use rlg::simulate::motion::BaseMotion;
use std::f64::consts::TAU;

/// An oscillation of `amplitude_rad` about x, whole cycles of full amplitude from 1 s to 3 s.
fn rocking(frequency_hz: f64, amplitude_rad: f64) -> String {
    format!(
        "[[motion]]\nkind = \"spin\"\naxis = \"z\"\nrate_rad_s = 0.0\nramp_s = 0.5\n\
         oscillation_axis = \"x\"\noscillation_frequency_hz = {frequency_hz}\n\
         oscillation_angle_rad = {amplitude_rad}\noscillation_phase_rad = 0.0\nduration_s = 4.0\n"
    )
}

#[test]
fn turned_stretched_reference_reads_what_the_catalogue_says() {
    let text = PERFECT.to_owned()
        + REFERENCE
        + TUMBLE
        + &effect("reference_misalignment", "x = 0.1, y = -0.2, z = 0.3")
        + &effect("reference_scale", "x = 1e-4, y = 2e-4, z = -3e-4");
    let simulation = run(&text, 1);
    let reads = triad(&simulation.recording, Quantity::ReferenceIncrement);
    let turn_rad: Vector3<f64> = Vector3::new(0.1, -0.2, 0.3);
    let (angle, axis) = (turn_rad.norm(), turn_rad.normalize());
    for row in 0..12_000 {
        let case = Vector3::from(simulation.case_increments_rad[row]);
        // Rodrigues' formula, rotated the other way.
        let turned = case * angle.cos() - axis.cross(&case) * angle.sin()
            + axis * axis.dot(&case) * (1.0 - angle.cos());
        let expected = turned.component_mul(&Vector3::new(1.0001, 1.0002, 0.9997));
        // two codes of 1e-13 rad
        assert!((reads(row) - expected).amax() < 2e-13, "row {row}");
    }
}

#[test]
fn late_reference_shows_the_case_of_a_while_ago() {
    // delays of a whole number of rows, a part of one, many, and a negative one
    for delay_rows in [3.0, 0.4, 11.7, -2.3] {
        let text = PERFECT.to_owned()
            + REFERENCE
            + &rocking(5.0, 0.1)
            + &effect("reference_delay", &format!("all = {}", delay_rows * T));
        let simulation = run(&text, 1);
        let reads = channel(&simulation.recording, Quantity::ReferenceIncrement, 0);
        for (row, read) in reads.iter().enumerate().take(13_000).skip(3000) {
            // the angle is 0.1 sin ψ for a taper of 1
            let angle = |rows: f64| 0.1 * (TAU * 5.0 * (rows - delay_rows) * T).sin();
            let expected = angle(row as f64 + 1.0) - angle(row as f64);
            assert!(
                (read - expected).abs() < 3e-13,
                "{delay_rows} rows late, row {row}: {read} {expected}"
            );
        }
    }
}

#[test]
fn encoder_errs_at_its_harmonic_knows_no_earth_and_the_model_says_so() {
    let encoder = "[encoder]\nangle_noise_rad = 0.0\nweight_rad = 1e-13\n";
    let text = PERFECT.to_owned()
        + SITE
        + encoder
        + "[[motion]]\nkind = \"slew\"\naxis = \"z\"\nangle_rad = 6.0\nduration_s = 3.0\n"
        + &effect(
            "reference_harmonic",
            "axis = \"z\", order = 3.0, cos = 2e-5, sin = -1e-5",
        );
    let simulation = run(&text, 1);
    assert_eq!(simulation.recording.tables[1].file, "encoder.parquet");
    let error = |angle: f64| 2e-5 * (3.0 * angle).cos() - 1e-5 * (3.0 * angle).sin();
    let (mut table, mut read) = (0.0, 0.0);
    for row in 0..12_000 {
        let x = (row as f64 + 1.0) / 12_000.0;
        let angle = 6.0 * x.powi(4) * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x.powi(3));
        read += simulation.recording.tables[1].channels[2].values[row];
        table += angle - table;
        // a code, and rounding of 12 000 sums
        assert!(
            (read - table - error(table) + error(0.0)).abs() < 1e-11,
            "row {row}"
        );
    }
    // the gyros rotate with the Earth, the encoder does not, and the model states it
    assert!(!simulation.model.earth_rate_in_reference);
    let known = &simulation.model.effects[0];
    assert_eq!(known.kind, "earth_rate");
    assert!((known.number("x") - 7.292115e-5 * 0.6_f64.cos()).abs() < 1e-15);
    assert!((known.number("z") - 7.292115e-5 * 0.6_f64.sin()).abs() < 1e-15);
    let x = sensed_rad(&simulation, 0);
    assert!((x[0] / T - known.number("x")).abs() < 3e-9);
    assert!(simulation.recording.tables[1].channels[0].values[0].abs() < 1e-12);
}

#[test]
fn case_follows_the_reference_through_the_isolator() {
    let (frequency_hz, amplitude) = (25.0, 0.01);
    let text = PERFECT.to_owned()
        + REFERENCE
        + &rocking(frequency_hz, amplitude)
        + &effect("isolator_mode", "x_frequency_hz = 40.0, x_damping = 0.2");
    let simulation = run(&text, 1);
    let reads = channel(&simulation.recording, Quantity::ReferenceIncrement, 0);
    let (natural, s) = (TAU * 40.0, Complex::new(0.0, TAU * frequency_hz));
    let friction = s * (2.0 * 0.2 * natural);
    let follows = (friction + natural * natural) / (s * s + friction + natural * natural);
    for (row, read) in reads.iter().enumerate().take(13_000).skip(8000) {
        let phase = |rows: f64| Complex::from_polar(1.0, TAU * frequency_hz * rows * T);
        let step = phase(row as f64 + 1.0) - phase(row as f64);
        assert!((read - amplitude * step.im).abs() < 3e-13);
        // the transient of the ramp has decayed by e^{−0.2·2π·40·1} = 1e-22 at 2 s
        let case = amplitude * (follows * step).im;
        let error = simulation.case_increments_rad[row][0] - case;
        assert!(error.abs() < 1e-12, "row {row}: {error:e}");
    }
}

#[test]
fn linear_vibration_rocks_a_case_that_hangs_off_its_mounts_centre() {
    let quadrature = Quadrature::new();
    let entry = IsolatorEntry {
        angular: [Some((30.0, 0.15)); 3],
        linear: [Some((45.0, 0.1)); 3],
        offset_m: [0.01, 0.02, -0.015],
        gyration_radius_m: [0.08, 0.09, 0.1],
    };
    let mut isolator = Isolator::new(&entry, &quadrature, T);
    let (omega, amplitude) = (TAU * 20.0, 5.0);
    let s = Complex::new(0.0, omega);
    let over = |hz: f64, damping: f64| {
        let natural = TAU * hz;
        let friction = s * (2.0 * damping * natural);
        (
            s * s + friction + natural * natural,
            friction + natural * natural,
        )
    };
    let (linear, passes) = over(45.0, 0.1);
    let (angular, _) = over(30.0, 0.15);
    // along y: the moment about x is −(e × a)_x = e_z a, about z −e_x a
    let force = Complex::new(amplitude, 0.0) * passes / linear;
    let about = |arm: f64, radius: f64| force * (arm / (radius * radius)) / angular;
    let (x, z) = (about(-0.015, 0.08), about(-0.01, 0.1));
    for row in 0..8000 {
        let time = |node: usize| (row as f64 + quadrature.nodes[node]) * T;
        let base: [BaseMotion; 4] = std::array::from_fn(|node| {
            let mut motion = BaseMotion::STILL;
            motion.linear_m_s2.y = amplitude * (omega * time(node)).cos();
            motion.linear_rate_m_s3.y = -amplitude * omega * (omega * time(node)).sin();
            motion
        });
        let case = isolator.advance(&base);
        // by then the transients have decayed by e^{−0.15·2π·30·1.5} = 4e-19
        if row < 6000 {
            continue;
        }
        for (node, moved) in case.iter().enumerate() {
            let turn = Complex::from_polar(1.0, omega * time(node));
            let motion = &moved.angular;
            for (axis, phasor) in [(0, x), (1, Complex::new(0.0, 0.0)), (2, z)] {
                let expected = [s, s * s, s * s * s].map(|power| (phasor * power * turn).re);
                let got = [
                    motion.rate_rad_s[axis],
                    motion.acceleration_rad_s2[axis],
                    motion.jerk_rad_s3[axis],
                ];
                for (got, expected) in got.into_iter().zip(expected) {
                    // order-eight collocation of 45 Hz at 4 kHz, and rounding of the jerk's large terms
                    assert!(
                        (got - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                        "{axis}"
                    );
                }
            }
            assert!((moved.linear_m_s2.y - (force * turn).re).abs() < 1e-10);
        }
    }
}

#[test]
fn flexure_as_a_mode_drifts_by_its_response_and_statically_by_k() {
    const SIX: &str =
        "xy = 6.9e-8, xz = 7.1e-8, yx = 7.5e-8, yz = 7.3e-8, zx = 6.7e-8, zy = 7.6e-8";
    let angle_rad = f64::to_radians(0.367);
    let statically = -(6.9e-8 + 7.1e-8) * (TAU * 15.0).powi(3) * angle_rad.sin().powi(2) / 2.0;
    for (frequency_hz, damping) in [(40.0, 0.3), (300.0, 0.05), (9000.0, 0.01)] {
        let mode = format!("{SIX}, frequency_hz = {frequency_hz}, damping = {damping}");
        let text = PERFECT.to_owned()
            + &coning(15.0, angle_rad, 8.0)
            + &effect("axis_flexure_mode", &mode);
        let ratio = 15.0 / frequency_hz;
        let response =
            Complex::new(1.0, 0.0) / Complex::new(1.0 - ratio * ratio, 2.0 * damping * ratio);
        // only the part of the tilt in phase with α rectifies
        let expected = statically * response.re * DEG_H_PER_RAD_S;
        let drift = drift_deg_h(&run(&text, 1), 0);
        // the counter, 1e-8 °/h; e^{−0.01·2π·9000·2 s} and faster have decayed
        assert!(
            (drift - expected).abs() < 1e-8 + 1e-6 * expected.abs(),
            "{frequency_hz} Hz: {drift} for {expected} °/h"
        );
        println!(
            "mode at {frequency_hz} Hz: {drift:.4} deg/h, statically {:.4}",
            statically * DEG_H_PER_RAD_S
        );
    }
}

#[test]
fn pickoff_and_block_differ_by_cubic_error_and_crosstalk() {
    let base = PERFECT.to_owned() + DITHER + STILL;
    let without = run(&base, 13);
    let cubic = run(&(base.clone() + &effect("dither_cubic", "y = 300.0")), 13);
    let crosstalk = run(
        &(base + &effect("dither_crosstalk", "zx = 1e-4, zy = -2e-4")),
        13,
    );
    let pickoff = triad(&without.recording, Quantity::DitherAngle);
    let gain = [1.0, 1.01, 0.99];
    let (plain, bent, mixed) = (
        [sensed_rad(&without, 1), sensed_rad(&without, 2)],
        sensed_rad(&cubic, 1),
        sensed_rad(&crosstalk, 2),
    );
    for row in 1..8000 {
        let (before, now) = (pickoff(row - 1), pickoff(row));
        let expected = 300.0 * (now[1].powi(3) - before[1].powi(3));
        // two counters; the pickoff's codes of 1e-13 rad are 1e-15 in the cube
        assert!((bent[row] - plain[0][row] - expected).abs() < 3e-13);
        let step = now - before;
        let expected = 1e-4 * gain[0] * step[0] - 2e-4 * gain[1] * step[1];
        assert!((mixed[row] - plain[1][row] - expected).abs() < 3e-13);
    }
}

#[test]
fn dithers_rock_the_case_at_three_frequencies() {
    let dither = DITHER.to_owned() + "reaction_ratio = [1e-3, 2e-3, 3e-3]\n";
    let simulation = run(&(PERFECT.to_owned() + &dither + STILL), 13);
    let pickoff = triad(&simulation.recording, Quantity::DitherAngle);
    let mut worst = 0.0_f64;
    for row in 1..8000 {
        let block = pickoff(row) - pickoff(row - 1);
        for axis in 0..3 {
            let expected = -[1e-3, 2e-3, 3e-3][axis] * block[axis];
            let error = simulation.case_increments_rad[row][axis] - expected;
            worst = worst.max(error.abs());
            // if the amplitude steps by 5 % the rate, 2 rad/s, steps with it, and quadrature of four nodes misplaces that by
            // up to a seventh of a row: 3e-3 · 0.1 · 2 rad/s · T/7 twice
            assert!(error.abs() < 4.5e-8, "axis {axis}, row {row}: {error:e}");
        }
    }
    // and exact while the amplitude is constant
    assert!(worst > 0.0);
    // gyros sense the rocking of the case: their sum of block and case
    let sensed = sensed_rad(&simulation, 2);
    for (row, sensed) in sensed.iter().enumerate().skip(1) {
        let block = 0.99 * (pickoff(row)[2] - pickoff(row - 1)[2]);
        let error = sensed - block - simulation.case_increments_rad[row][2];
        assert!(error.abs() < 4e-13, "row {row}: {error:e}");
    }
}

#[test]
fn coarse_converter_gives_angles_in_whole_pulses_of_its_own() {
    let undithered = PERFECT.replace("[gyro]", "[gyro]\noutput = \"increment\"");
    let text = undithered + TUMBLE + &effect("pulse_quantisation", "x = 1e-6, z = 3e-6");
    let simulation = run(&text, 1);
    for (axis, weight) in [(0, 1e-6), (2, 3e-6)] {
        let increments = channel(&simulation.recording, Quantity::GyroIncrement, axis);
        let (mut read, mut turned) = (0.0, 0.0);
        for (row, increment) in increments.iter().enumerate() {
            let pulses = increment / weight;
            // stored in codes of 1e-13 rad
            assert!((pulses - pulses.round()).abs() < 2e-13 / weight);
            read += increment;
            turned += simulation.case_increments_rad[row][axis];
            assert!((read - turned).abs() < weight, "axis {axis}, row {row}");
        }
    }
}

#[test]
fn slip_of_a_counter_is_one_jump_in_angle() {
    let text = PERFECT.to_owned() + STILL;
    let slip = effect(
        "counter_slip",
        "axis = \"y\", time_s = 1.00001, size = 4e-5",
    );
    let simulation = run(&(text + &slip), 1);
    let sensed = sensed_rad(&simulation, 1);
    for (row, increment) in sensed.iter().enumerate() {
        let expected = if row == 4000 { 4e-5 } else { 0.0 };
        assert!((increment - expected).abs() < 1.1e-13, "row {row}");
    }
}

#[test]
fn more_random_walk_adds_in_square() {
    let text = PERFECT.replace(
        "angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]",
        "angle_random_walk_rad_sqrt_s = [3e-7, 3e-7, 3e-7]",
    ) + &effect("angle_random_walk", "x = 4e-7, y = 4e-7, z = 4e-7")
        + "[[motion]]\nkind = \"still\"\nduration_s = 30.0\n";
    let simulation = run(&text, 7);
    let squares = (0..3)
        .flat_map(|axis| sensed_rad(&simulation, axis))
        .map(|v| v * v);
    let ratio = squares.sum::<f64>() / (360_000.0 * 25e-14 * T);
    // 4 deviations of a variance from 360 000 values, and the counter's 1e-13 of 8e-9 rad
    assert!((ratio - 1.0).abs() < 0.0095, "{ratio}");
}

#[test]
fn faults_of_the_data_take_hold_of_their_channel_for_their_time() {
    let text =
        PERFECT.replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6") + DITHER + REFERENCE + STILL;
    let fault = |kind: &str, channel: &str| {
        effect(
            kind,
            &format!("channel = \"{channel}\", start_s = 0.5, end_s = 0.75"),
        )
    };
    let faulty = text.clone()
        + &fault("lost_samples", "reference_y")
        + &fault("stuck_channel", "dither_x")
        + &fault("saturation", "gyro_z");
    let (good, bad) = (run(&text, 3), run(&faulty, 3));
    assert_eq!(bad.truth.effects.len(), 3);
    let mut changed = 0;
    for (one, other) in good.recording.tables[0]
        .channels
        .iter()
        .zip(&bad.recording.tables[0].channels)
    {
        let name = one.column.as_str();
        let before = one.values[1999];
        let largest = one.values[..2000]
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs()));
        let limit = (2.0 / 3.0 * largest).floor();
        for (row, (a, b)) in one.values.iter().zip(&other.values).enumerate() {
            let inside = (2000..3000).contains(&row);
            match name {
                "ry" if inside => assert!(b.is_nan()),
                "dx" if inside => assert_eq!(*b, before),
                "gz" if inside => assert_eq!(*b, a.clamp(-limit, limit)),
                _ => assert_eq!(a, b, "{name}, row {row}"),
            }
            changed += usize::from(name == "gz" && a != b);
        }
    }
    // 48 % of a sine of constant amplitude is beyond two thirds of its peak; the amplitude varies by 15 %
    assert!((200..600).contains(&changed), "{changed}");
}
