//! Every effect on the gyros, switched on alone: its increment compared with the catalogue's formula.
//!
//! The case tumbles slowly, ω_i = R_i cos(2πf_i t + φ_i), so that a row's mean of any product equals its value at the row's
//! middle within (2πfT)²/12 = 2e-8. Forces are those of a perfect accelerometer.

use super::support::*;
use nalgebra::Vector3;
use rlg::recording::Quantity;
use std::f64::consts::TAU;

const RATE_RAD_S: [f64; 3] = [1.0, -0.8, 0.6];
const FREQUENCY_HZ: [f64; 3] = [0.31, 0.23, 0.17];
const PHASE_RAD: [f64; 3] = [0.2, 1.1, 2.3];

/// Arguments of an effect, at a row's middle.
struct Middle {
    t: f64,
    w: Vector3<f64>,
    a: Vector3<f64>,
    j: Vector3<f64>,
    f: Vector3<f64>,
}

fn scenario(effect: &str, extra: &str) -> String {
    PERFECT.to_owned()
        + "[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\nearth_rate = false\n\
           [accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
           noise_m_s2_sqrt_hz = 0.0\nweight_m_s2 = 1e-11\n"
        + extra
        + &format!(
            "[[motion]]\nkind = \"tumble\"\nrate_rad_s = {RATE_RAD_S:?}\n\
             frequency_hz = {FREQUENCY_HZ:?}\nphase_rad = {PHASE_RAD:?}\nramp_s = 0.5\nduration_s = 3.0\n"
        )
        + effect
}

/// Checks that the effect adds `expected` to the gyros' rates; NaN if not compared.
fn adds(effect: &str, extra: &str, expected: impl Fn(&Middle) -> [f64; 3]) {
    let with = run(&scenario(effect, extra), 1);
    let without = run(&scenario("", extra), 1);
    let force: Vec<_> = (0..3)
        .map(|axis| channel(&without.recording, Quantity::SpecificForce, axis))
        .collect();
    let sensed = |simulation, axis| -> Vec<f64> { sensed_rad(simulation, axis) };
    let added: Vec<Vec<f64>> = (0..3)
        .map(|axis| {
            let (with, without) = (sensed(&with, axis), sensed(&without, axis));
            with.iter().zip(without).map(|(a, b)| a - b).collect()
        })
        .collect();
    let rows = 2400..9600;
    let predicted: Vec<[f64; 3]> = rows
        .clone()
        .map(|row| {
            let t = (row as f64 + 0.5) * T;
            let jet = |order: i32| {
                Vector3::from_fn(|i, _| {
                    let omega = TAU * FREQUENCY_HZ[i];
                    let shift = f64::from(order) * TAU / 4.0;
                    RATE_RAD_S[i] * omega.powi(order) * (omega * t + PHASE_RAD[i] + shift).cos()
                })
            };
            expected(&Middle {
                t,
                w: jet(0),
                a: jet(1),
                j: jet(2),
                f: Vector3::new(force[0][row], force[1][row], force[2][row]),
            })
        })
        .collect();
    let largest = predicted
        .iter()
        .flatten()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    // far above the resolution: two counters of 1e-13 rad a row
    assert!(largest * T > 1e-10, "{effect} is too small to be tested");
    for (row, predicted) in rows.zip(predicted) {
        for axis in (0..3).filter(|&axis| !predicted[axis].is_nan()) {
            let error = added[axis][row] - predicted[axis] * T;
            // (2πfT)²/12 of a product of three, the accelerometer's code of 1e-11 in 10, and the counters
            assert!(
                error.abs() < 2e-7 * largest * T + 3e-13,
                "{effect}gyro {axis}, row {row}: {:e} instead of {:e}",
                added[axis][row],
                predicted[axis] * T
            );
        }
    }
}

const C: [f64; 3] = [1.0, -2.0, 3.0];

fn kind(kind: &str, parameters: &str) -> String {
    format!("[[effect]]\nkind = \"{kind}\"\n{parameters}")
}

/// Formats x, y, z in units of `unit`.
fn xyz(name: &str, unit: f64) -> String {
    let values = ["x", "y", "z"]
        .iter()
        .zip(C)
        .map(|(axis, c)| format!("{axis} = {:e}\n", c * unit));
    kind(name, &values.collect::<String>())
}

/// Makes the nine or the six, every one different, in units of `unit`.
fn matrix(name: &str, unit: f64, diagonal: bool) -> (String, [[f64; 3]; 3]) {
    let mut values = [[0.0; 3]; 3];
    let mut text = String::new();
    for i in 0..3 {
        for j in 0..3 {
            if diagonal || i != j {
                values[i][j] = unit * (1.0 + 3.0 * i as f64 - 2.0 * j as f64);
                let letters = ["x", "y", "z"];
                text += &format!("{}{} = {:e}\n", letters[i], letters[j], values[i][j]);
            }
        }
    }
    (kind(name, &text), values)
}

/// x: +δ_xz ω_y − δ_xy ω_z, y: +δ_yx ω_z − δ_yz ω_x, z: +δ_zy ω_x − δ_zx ω_y, as derived in physics.
fn tilt_adds(d: [[f64; 3]; 3], w: &Vector3<f64>) -> [f64; 3] {
    [
        d[0][2] * w[1] - d[0][1] * w[2],
        d[1][0] * w[2] - d[1][2] * w[0],
        d[2][1] * w[0] - d[2][0] * w[1],
    ]
}

fn times(m: [[f64; 3]; 3], v: &Vector3<f64>) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[test]
fn biases_add_as_the_catalogue_says() {
    adds(&xyz("gyro_bias", 1e-6), "", |_| C.map(|c| 1e-6 * c));
    let step = "axis = \"y\"\ntime_s = 1.3\nsize = 1e-5\n";
    adds(&kind("gyro_bias_step", step), "", |at| {
        [0.0, if at.t > 1.3 { 1e-5 } else { 0.0 }, 0.0]
    });
    adds(&xyz("gyro_g2_bias", 1e-7), "", |at| {
        [0, 1, 2].map(|i| 1e-7 * C[i] * at.f[i].powi(2))
    });
    let (effect, g) = matrix("gyro_g_bias", 1e-6, true);
    adds(&effect, "", |at| times(g, &at.f));
}

#[test]
fn scale_errors_add_as_the_catalogue_says() {
    adds(&xyz("gyro_scale", 1e-4), "", |at| {
        [0, 1, 2].map(|i| 1e-4 * C[i] * at.w[i])
    });
    adds(&xyz("gyro_scale_quadratic", 1e-4), "", |at| {
        [0, 1, 2].map(|i| 1e-4 * C[i] * at.w[i].powi(2))
    });
    adds(&xyz("gyro_scale_cubic", 1e-4), "", |at| {
        [0, 1, 2].map(|i| 1e-4 * C[i] * at.w[i].powi(3))
    });
}

#[test]
fn scale_asymmetry_adds_the_absolute_rate() {
    // the one row in which the rate changes its sign has a kink inside: not compared
    adds(&xyz("gyro_scale_asymmetry", 1e-3), "", |at| {
        [0, 1, 2].map(|i| {
            let kink = at.w[i].abs() < at.a[i].abs() * T;
            if kink {
                f64::NAN
            } else {
                1e-3 * C[i] * at.w[i].abs()
            }
        })
    });
}

#[test]
fn tilts_of_the_sensing_axes_add_as_the_catalogue_says() {
    let (effect, d) = matrix("installation", 1e-5, false);
    adds(&effect, "", |at| tilt_adds(d, &at.w));
    let by = |d: [[f64; 3]; 3], factor: &dyn Fn(usize, usize) -> f64| {
        let mut tilt = d;
        for (i, row) in tilt.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value *= factor(i, j);
            }
        }
        tilt
    };
    let (effect, k) = matrix("axis_flexure", 1e-6, false);
    adds(&effect, "", |at| tilt_adds(by(k, &|_, j| -at.a[j]), &at.w));
    let (effect, q) = matrix("axis_flexure_cubic", 1e-6, false);
    adds(&effect, "", |at| {
        tilt_adds(by(q, &|_, j| -at.a[j].powi(3)), &at.w)
    });
    let (effect, tau) = matrix("axis_tilt_by_force", 1e-6, false);
    adds(&effect, "", |at| {
        // k is the third axis
        tilt_adds(
            by(tau, &|i, j| if i == j { 0.0 } else { at.f[3 - i - j] }),
            &at.w,
        )
    });
}

#[test]
fn elastic_rates_follow_the_derivatives_of_force_and_rate() {
    let (effect, u) = matrix("elastic_rate_by_force", 1e-6, true);
    // gravity is fixed in space: in the body frame it changes by −ω × f
    adds(&effect, "", |at| times(u, &-at.w.cross(&at.f)));
    let (effect, w) = matrix("elastic_rate_by_jerk", 1e-5, true);
    adds(&effect, "", |at| times(w, &at.j));
    let smoothed = kind("gyro_bandwidth", "x = 1e-5\nz = 3e-5\n");
    adds(&smoothed, "", |at| {
        [0.5e-5 * at.j[0], 0.0, 1.5e-5 * at.j[2]]
    });
}

#[test]
fn late_gyro_shows_the_rate_of_a_while_ago() {
    for delay_s in [3e-5, 2.6e-3, -1.1e-3] {
        adds(&kind("gyro_delay", &format!("y = {delay_s}\n")), "", |at| {
            let omega = TAU * FREQUENCY_HZ[1];
            let phase = omega * at.t + PHASE_RAD[1];
            let then = (phase - omega * delay_s).cos();
            [0.0, RATE_RAD_S[1] * (then - phase.cos()), 0.0]
        });
    }
}

const THERMAL: &str = "[thermal]\nstart_k = 293.0\nself_heating_k = [10.0, 8.0, 12.0]\n\
    time_constant_s = [2.0, 3.0, 4.0]\nambient_rate_k_s = 0.1\nambient_swing_k = 0.5\n\
    ambient_period_s = 7.0\nsensor_noise_k = 0.0\nsensor_weight_k = 1e-9\nrate_hz = 100.0\n";

fn warming(i: usize, t: f64) -> (f64, f64) {
    let (rise, constant) = ([10.0, 8.0, 12.0][i], [2.0, 3.0, 4.0][i]);
    let omega = TAU / 7.0;
    (
        rise * (1.0 - f64::exp(-t / constant)) + 0.1 * t + 0.5 * (omega * t).sin(),
        rise / constant * f64::exp(-t / constant) + 0.1 + 0.5 * omega * (omega * t).cos(),
    )
}

#[test]
fn warming_moves_bias_scale_and_axes_and_the_thermometers_show_it() {
    adds(&xyz("gyro_bias_temperature", 1e-6), THERMAL, |at| {
        [0, 1, 2].map(|i| 1e-6 * C[i] * warming(i, at.t).0)
    });
    adds(&xyz("gyro_bias_temperature_rate", 1e-6), THERMAL, |at| {
        [0, 1, 2].map(|i| 1e-6 * C[i] * warming(i, at.t).1)
    });
    let (effect, c) = matrix("installation_temperature", 1e-6, false);
    adds(&effect, THERMAL, |at| {
        let mut tilt = c;
        for (i, row) in tilt.iter_mut().enumerate() {
            row.iter_mut()
                .for_each(|value| *value *= warming(i, at.t).0);
        }
        tilt_adds(tilt, &at.w)
    });
    let scenario = scenario("", THERMAL);
    let simulation = run(&scenario, 1);
    let table = &simulation.recording.tables[1];
    assert_eq!(
        (table.file.as_str(), table.rows),
        ("temperature.parquet", 300)
    );
    for (i, channel) in table.channels.iter().enumerate() {
        for (row, reading) in channel.values.iter().enumerate() {
            let expected = 293.0 + warming(i, (row + 1) as f64 / 100.0).0;
            // half a code of 1e-9 K
            assert!((reading - expected).abs() < 1e-9);
        }
    }
}

#[test]
fn scale_that_follows_temperature_acts_on_case_and_dither() {
    let warm = THERMAL.to_owned() + "scale_error_k = [1e-6, 0.0, 0.0]\n" + DITHER;
    let plain = THERMAL.to_owned() + DITHER;
    let still = "[[motion]]\nkind = \"still\"\nduration_s = 2.0\n";
    let (with, without) = (
        run(&(PERFECT.to_owned() + &warm + still), 1),
        run(&(PERFECT.to_owned() + &plain + still), 1),
    );
    let (a, b) = (sensed_rad(&with, 0), sensed_rad(&without, 0));
    for row in 0..a.len() {
        let t = (row as f64 + 1.0) * T;
        let expected = 1e-6 * warming(0, t).0 * b[row];
        // the scale is that of the row's end: dT/dt T/2 of 4 K/s is 5e-4 K of some K
        assert!((a[row] - b[row] - expected).abs() < 1e-6 * 2e-3 * b[row].abs() + 3e-13);
    }
    let truth = with.truth.to_json();
    assert!(truth.contains("unlisted") && truth.contains("temperature_x*omega_x"));
}

#[test]
fn magnetic_field_of_earth_and_coil_moves_the_bias_and_the_magnetometers_show_it() {
    let magnetic = "[magnetic]\nnavigation_field_t = [2e-5, 0.0, -4e-5]\ncoil_field_t = [1e-4, 2e-4, -1e-4]\n\
        coil_frequency_hz = 0.4\nsensor_noise_t = 0.0\nsensor_weight_t = 1e-15\nrate_hz = 4000.0\n";
    let (effect, c) = matrix("gyro_bias_magnetic", 1e-2, true);
    let simulation = run(&scenario("", magnetic), 1);
    let field = &simulation.recording.tables[1].channels;
    // initially at rest: the Earth's field, and the coil's
    for (i, earth) in [2e-5, 0.0, -4e-5].into_iter().enumerate() {
        let t = 9.93 * T;
        let coil = [1e-4, 2e-4, -1e-4][i] * (TAU * 0.4 * t).sin();
        // the sample is that of the last node, 0.07 of a row before its end
        assert!(
            (field[i].values[9] - earth - coil).abs() < 1e-3 * 2e-4 * TAU * 0.4 * T + 1e-9 * 4e-5
        );
    }
    // the length of the Earth's part is constant under rotation of the case
    let at = |row: usize| {
        let t = (row as f64 + 0.930_568) * T;
        Vector3::from_fn(|i, _| {
            field[i].values[row] - [1e-4, 2e-4, -1e-4][i] * (TAU * 0.4 * t).sin()
        })
    };
    for row in (0..12_000).step_by(500) {
        assert!(
            (at(row).norm() - 20.0_f64.sqrt() * 1e-5).abs() < 1e-11,
            "{row}"
        );
    }
    adds(&effect, magnetic, |at| {
        let row = (at.t / T) as usize;
        // between two samples, 0.43 of a row after the middle of each row
        let b = Vector3::from_fn(|i, _| {
            let (before, now) = (field[i].values[row - 1], field[i].values[row]);
            before + (now - before) * (1.0 - 0.430_568)
        });
        times(c, &b)
    });
}

#[test]
fn unlisted_physics_is_the_product_that_is_written() {
    let of = |expression: &str| {
        kind(
            "unlisted",
            &format!("axis = \"z\"\ncoefficient = 1e-5\nexpression = \"{expression}\"\n"),
        )
    };
    adds(&of("omega_x*force_z"), "", |at| {
        [0.0, 0.0, 1e-5 * at.w[0] * at.f[2]]
    });
    adds(&of("alpha_y * omega_z * cosine(0.4)"), "", |at| {
        [
            0.0,
            0.0,
            1e-5 * at.a[1] * at.w[2] * (TAU * 0.4 * at.t).cos(),
        ]
    });
    adds(&of("decay(1.5)*time"), "", |at| {
        [0.0, 0.0, 1e-5 * at.t * (-at.t / 1.5).exp()]
    });
    adds(&of("temperature_x*omega_y"), THERMAL, |at| {
        [0.0, 0.0, 1e-5 * warming(0, at.t).0 * at.w[1]]
    });
}

#[test]
fn earths_rotation_beside_the_reference_is_carried_by_the_attitude() {
    let effect = kind("earth_rate", "x = 3e-5\ny = -4e-5\nz = 5e-5\n");
    // a vector fixed in space, along gravity's change: its angle to the specific force is constant
    let gravity = Vector3::new(0.0, 0.0, 9.8);
    let earth: Vector3<f64> = Vector3::new(3e-5, -4e-5, 5e-5);
    let with = run(&scenario(&effect, ""), 1);
    let without = run(&scenario("", ""), 1);
    let rate = |row: usize| -> Vector3<f64> {
        Vector3::from_fn(|i, _| (sensed_rad(&with, i)[row] - sensed_rad(&without, i)[row]) / T)
    };
    for row in [0, 3000, 6000, 11_999] {
        let f: Vector3<f64> =
            Vector3::from_fn(|i, _| channel(&without.recording, Quantity::SpecificForce, i)[row]);
        let rate: Vector3<f64> = rate(row);
        // counters of 1e-13 rad in 1.25e-8; the mean over a row is shorter by (ωT)²/24
        assert!(
            (rate.norm() / earth.norm() - 1.0).abs() < 4e-5,
            "row {row}: {rate}"
        );
        assert!((rate.dot(&f) - earth.dot(&gravity)).abs() < 4e-5 * earth.norm() * 9.8);
    }
    // the reference does not contain it
    assert_eq!(with.case_increments_rad, without.case_increments_rad);
}
