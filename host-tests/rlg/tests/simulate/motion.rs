//! Motions compared with closed forms.

use super::support::*;
use nalgebra::Vector3;
use realfft::RealFftPlanner;
use rlg::recording::Quantity;
use rlg::simulate::attitude::Quadrature;
use rlg::simulate::instrument::{Stream, stream};
use rlg::simulate::motion::rotation_vector::ConingTone;
use rlg::simulate::motion::vibration::Spectrum;
use rlg::simulate::motion::{BaseMotion, Profile, SegmentMotion};
use std::f64::consts::{PI, TAU};

fn periods(profile: &Profile, rows: usize) -> Vec<[BaseMotion; 4]> {
    let nodes = Quadrature::new().nodes;
    let mut rng = stream(3, Stream::Motion, 0);
    let mut motion = SegmentMotion::new(profile, rows, T, nodes, &mut rng);
    (0..rows).map(|_| motion.next_period()).collect()
}

fn tone(frequency_hz: f64, angle_rad: f64, across_angle_rad: f64, phase_rad: f64) -> ConingTone {
    ConingTone {
        frequency_hz,
        angle_rad,
        across_angle_rad,
        phase_rad,
    }
}

#[test]
fn every_motion_starts_and_ends_at_rest_and_its_derivatives_integrate_to_it() {
    let table = |level: f64| Spectrum(vec![[10.0, level], [50.0, 4.0 * level], [300.0, level]]);
    let profiles = [
        Profile::Coning {
            axis: 1,
            frequency_hz: 15.0,
            angle_rad: 0.1,
            ramp_s: 0.3,
        },
        Profile::EllipticConing {
            axis: 2,
            tones: vec![tone(15.0, 0.3, 0.1, 0.4), tone(-22.0, 0.05, 0.2, 1.0)],
            ramp_s: 0.3,
        },
        Profile::Slew {
            axis: 0,
            angle_rad: 2.0,
        },
        Profile::Spin {
            axis: 2,
            rate_rad_s: 3.0,
            ramp_s: 0.3,
            oscillation_axis: 0,
            oscillation_frequency_hz: 5.0,
            oscillation_angle_rad: 0.2,
            oscillation_phase_rad: 0.7,
        },
        Profile::Tumble {
            rate_rad_s: [2.0, -1.0, 3.0],
            frequency_hz: [0.5, 0.0, 1.3],
            phase_rad: [0.1, 0.2, 0.3],
            ramp_s: 0.3,
        },
        Profile::Vibration {
            low_hz: 20.0,
            high_hz: 300.0,
            rate_rms_rad_s: [0.1, 0.2, 0.3],
            axis_phase_rad: None,
            ramp_s: 0.3,
        },
        Profile::RandomVibration {
            angular: [table(1e-4), Spectrum(vec![]), table(1e-5)],
            linear: [Spectrum(vec![]), table(0.1), table(0.01)],
            ramp_s: 0.3,
        },
    ];
    let quadrature = Quadrature::new();
    for profile in profiles {
        let periods = periods(&profile, 4000);
        let pick = [
            |n: &BaseMotion| (n.angular.rate_rad_s, n.angular.acceleration_rad_s2),
            |n: &BaseMotion| (n.angular.acceleration_rad_s2, n.angular.jerk_rad_s3),
            |n: &BaseMotion| (n.linear_m_s2, n.linear_rate_m_s3),
        ];
        let largest = pick.map(|pick| {
            let values = periods.iter().flatten().map(|node| pick(node).0.amax());
            values.fold(0.0, f64::max)
        });
        let mut sums = [Vector3::zeros(); 3];
        for nodes in periods {
            // up to each node: the integral so far, and the part of this period
            for node in 0..4 {
                let weights = quadrature.weights_until(quadrature.nodes[node]);
                for (place, pick) in pick.into_iter().enumerate() {
                    let part: Vector3<f64> =
                        (0..4).map(|j| pick(&nodes[j]).1 * (weights[j] * T)).sum();
                    let value = pick(&nodes[node]).0;
                    let error = (sums[place] + part - value).amax();
                    // inside a period the rule is of order five only: (ωT)⁵ = 0.023 at 300 Hz times max ∫∏(x − c_j)/4! <
                    // 5e-5
                    assert!(
                        error <= 1e-6 * largest[place],
                        "{profile:?}: {error:e} of derivative {place}"
                    );
                }
            }
            sums[0] += quadrature.integrate(&nodes.map(|n| n.angular.acceleration_rad_s2), T);
            sums[1] += quadrature.integrate(&nodes.map(|n| n.angular.jerk_rad_s3), T);
            sums[2] += quadrature.integrate(&nodes.map(|n| n.linear_rate_m_s3), T);
        }
        // over whole periods it is of order eight
        for place in 0..3 {
            assert!(sums[place].amax() <= 1e-8 * largest[place], "{profile:?}");
        }
    }
}

#[test]
fn ellipse_with_equal_axes_is_the_circular_cone() {
    let circle = Profile::Coning {
        axis: 1,
        frequency_hz: 15.0,
        angle_rad: 0.4,
        ramp_s: 0.3,
    };
    let ellipse = Profile::EllipticConing {
        axis: 1,
        tones: vec![tone(15.0, 0.4, 0.4, 0.0)],
        ramp_s: 0.3,
    };
    for (one, other) in periods(&circle, 4000).iter().zip(periods(&ellipse, 4000)) {
        for node in 0..4 {
            let (a, b) = (&one[node].angular, &other[node].angular);
            // rounding, larger by Ω with each derivative
            assert!((a.rate_rad_s - b.rate_rad_s).amax() < 1e-12);
            assert!((a.acceleration_rad_s2 - b.acceleration_rad_s2).amax() < 1e-10);
            assert!((a.jerk_rad_s3 - b.jerk_rad_s3).amax() < 1e-8);
        }
    }
}

/// Mean over \[2 s, 6 s) of gyro `axis` less the case, and of the case \[rad/s\].
fn means(simulation: &rlg::simulate::Simulation, axis: usize) -> (f64, f64) {
    let sensed = sensed_rad(simulation, axis);
    let rows = 8000..24_000;
    let case: f64 = rows
        .clone()
        .map(|row| simulation.case_increments_rad[row][axis])
        .sum();
    (
        ((sensed[rows].iter().sum::<f64>()) - case) / 4.0,
        case / 4.0,
    )
}

#[test]
fn elliptic_and_several_cones_drift_by_the_areas_of_their_ellipses() {
    const K: &str = "[[effect]]\nkind = \"axis_flexure\"\nxy = 6.9e-8\nxz = 7.1e-8\n";
    let ends = "duration_s = 8.0\nramp_s = 1.0\n";
    let one = format!(
        "[[motion]]\nkind = \"coning\"\naxis = \"x\"\nfrequency_hz = 15.0\nangle_rad = 0.02\nacross_angle_rad = 0.008\n{ends}"
    );
    let many = format!(
        "[[motion]]\nkind = \"multi_coning\"\naxis = \"x\"\nfrequency_hz = [15.0, 40.0, -25.0]\n\
         angle_rad = [0.02, 0.003, 0.006]\nacross_angle_rad = [0.008, 0.004, 0.005]\nphase_rad = [0.0, 1.0, 2.0]\n{ends}"
    );
    for (motion, tones) in [
        (one, vec![(15.0, 0.02, 0.008)]),
        (
            many,
            vec![
                (15.0, 0.02, 0.008),
                (40.0, 0.003, 0.004),
                (-25.0, 0.006, 0.005),
            ],
        ),
    ] {
        let (drift, along) = means(&run(&(PERFECT.to_owned() + &motion + K), 1), 0);
        let sum = |power: i32| -> f64 {
            let one = |(hz, a, b): &(f64, f64, f64)| 0.5 * (TAU * hz).powi(power) * a * b;
            tones.iter().map(one).sum()
        };
        // both of second order in the angles; the fourth is φ²/12 or less of it, 4e-5 at 0.02 rad and of the sum
        let expected = -(6.9e-8 + 7.1e-8) * sum(3);
        assert!(
            (drift / expected - 1.0).abs() < 1e-3,
            "{drift:e} {expected:e}"
        );
        assert!(
            (along / -sum(1) - 1.0).abs() < 1e-3,
            "{along:e} {:e}",
            -sum(1)
        );
        println!(
            "{} cones: {:.4} deg/h",
            tones.len(),
            drift * DEG_H_PER_RAD_S
        );
    }
}

#[test]
fn spin_synchronous_flexure_stands_at_the_spins_frequency_and_turns_with_its_sense() {
    for sense in [1.0, -1.0] {
        let omega = TAU * sense;
        let text = PERFECT.to_owned()
            + &format!(
                "[[motion]]\nkind = \"spin_synchronous\"\naxis = \"z\"\nrate_rad_s = {omega}\nramp_s = 1.0\n\
                 oscillation_axis = \"x\"\noscillation_angle_rad = 0.2\noscillation_phase_rad = 0.3\nduration_s = 6.0\n"
            );
        let flexure = "[[effect]]\nkind = \"axis_flexure\"\nyx = 7.5e-8\n";
        let (with, without) = (run(&(text.clone() + flexure), 1), run(&text, 1));
        let (with_y, without_y) = (sensed_rad(&with, 1), sensed_rad(&without, 1));
        for row in 6000..18_000 {
            let psi = TAU * (row as f64 + 0.5) * T + 0.3;
            // δ_yx ω_z with δ_yx = −K α_x, α_x = −A Ω² sin ψ
            let expected = 7.5e-8 * 0.2 * TAU * TAU * psi.sin() * omega * T;
            let error = with_y[row] - without_y[row] - expected;
            assert!(error.abs() < 3e-13, "row {row}: {error:e}");
        }
    }
}

#[test]
fn random_vibration_has_the_power_of_its_table_band_by_band() {
    let angular = [[20.0, 1e-5], [80.0, 4e-5], [200.0, 4e-5], [400.0, 5e-6]];
    let linear = [[20.0, 0.01], [80.0, 0.04], [350.0, 0.04], [400.0, 0.03]];
    let text = PERFECT.to_owned()
        + "[accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
           noise_m_s2_sqrt_hz = 0.0\nweight_m_s2 = 1e-9\n"
        + &format!(
            "[[motion]]\nkind = \"random_vibration\"\nramp_s = 0.5\nduration_s = 42.0\n\
             angular_psd_rad2_s2_hz = {{ y = {angular:?} }}\nlinear_psd_m2_s4_hz = {{ x = {linear:?} }}\n"
        );
    let simulation = run(&text, 11);
    let rows = 4000..164_000;
    let rates: Vec<f64> = rows
        .clone()
        .map(|row| simulation.case_increments_rad[row][1] / T)
        .collect();
    let force = &channel(&simulation.recording, Quantity::SpecificForce, 0)[rows];
    for (values, table) in [(&rates[..], &angular), (force, &linear)] {
        let bins = spectrum(values);
        let width_hz = 4000.0 / values.len() as f64;
        let spectrum = Spectrum(table.to_vec());
        for pair in table.windows(2) {
            let (low, high) = (pair[0][0], pair[1][0]);
            let measured: f64 = bins
                .iter()
                .enumerate()
                .map(|(bin, power)| (bin as f64 * width_hz, power))
                .filter(|(hz, _)| (low..high).contains(hz))
                // a row's mean attenuates a tone
                .map(|(hz, power)| power * (PI * hz * T / (PI * hz * T).sin()).powi(2))
                .sum();
            let expected = spectrum.power(low, high);
            let ratio = measured / expected;
            println!("{low} to {high} Hz: {ratio:.3} of the table");
            // cells at the two edges, of at least 12 in a band, put their tone on either side
            assert!((ratio - 1.0).abs() < 0.15, "{low} to {high} Hz: {ratio}");
        }
        let outside: f64 = bins[..(19.0 / width_hz) as usize].iter().sum();
        assert!(outside < 1e-3 * spectrum.power(20.0, 400.0));
    }
    // an axis without a table does not move
    let still = channel(&simulation.recording, Quantity::SpecificForce, 1);
    assert!(still.iter().all(|f| *f == 0.0));
}

/// Computes the power of each bin \[unit²\] with a Hann window, so that a tone between bins leaks little.
fn spectrum(values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(count);
    let mut input: Vec<f64> = values
        .iter()
        .enumerate()
        .map(|(row, value)| value * (1.0 - (TAU * row as f64 / count as f64).cos()))
        .collect();
    let mut output = fft.make_output_vec();
    fft.process(&mut input, &mut output).unwrap();
    // the window's mean square is 3/2
    let scale = 2.0 / (1.5 * (count as f64).powi(2));
    output.iter().map(|bin| scale * bin.norm_sqr()).collect()
}

#[test]
fn straight_line_in_log_log_has_the_power_of_its_integral() {
    // white, f^-1, f^-2: 5·(90), ln 10, 1/10 − 1/100 times 10·(density · f^m) each
    for (table, expected) in [
        (vec![[10.0, 5.0], [100.0, 5.0]], 450.0),
        (vec![[10.0, 1.0], [100.0, 0.1]], 10.0 * 10.0_f64.ln()),
        (vec![[10.0, 1.0], [100.0, 0.01]], 100.0 * (0.1 - 0.01)),
    ] {
        let power = Spectrum(table).power(0.0, f64::INFINITY);
        assert!((power / expected - 1.0).abs() < 1e-12, "{power} {expected}");
    }
}
