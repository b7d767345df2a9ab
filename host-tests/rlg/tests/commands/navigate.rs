//! `rlg navigate`: the effect of coning on attitude and velocity compared with formulas written here, and its refusals. The
//! recordings are simulated; no code of the navigation is used to check it.

use std::f64::consts::{PI, TAU};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{UnitQuaternion, Vector3};
use rlg::model::{EffectValue, Model, ModelEffect};
use rlg::navigate::trajectory::NotAtRest;
use rlg::navigate::{Place, Start, navigate};
use rlg::recording::Recording;
use rlg::simulate::coning_demo;
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use serde_json::Value;
use strapdown::{AlignmentError, Increment};
use tempfile::TempDir;

const ARCSEC_PER_RAD: f64 = 180.0 / PI * 3600.0;

/// Angle random walk of the scenario's gyros \[rad/√s\].
const ANGLE_RANDOM_WALK: f64 = 5.8e-7;

/// Gravity at the scenario's site \[m/s²\].
const GRAVITY_M_S2: f64 = 9.80665;

/// Table 3 of the paper, which the scenario conceals \[s²\].
const TABLE_3: [(&str, f64); 6] = [
    ("xy", 6.9e-8),
    ("xz", 7.1e-8),
    ("yx", 7.5e-8),
    ("yz", 7.3e-8),
    ("zx", 6.7e-8),
    ("zy", 7.6e-8),
];

/// The coning scenario, its model with the flexure switched on, and a folder for results.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let simulation = coning_demo(3).expect("the scenario is good");
        Self::of(&simulation.recording, simulation.model)
    }

    fn of(recording: &Recording, mut model: Model) -> Self {
        let bench = Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        recording
            .write_to(bench.path("recording"))
            .expect("written");
        let parameters = TABLE_3.map(|(name, k)| (name.to_owned(), EffectValue::Number(k)));
        model.effects = vec![ModelEffect {
            kind: "axis_flexure".to_owned(),
            parameters: parameters.into(),
        }];
        fs::write(bench.path("model.toml"), model.to_toml()).expect("written");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run<const N: usize>(&self, arguments: [&OsStr; N]) -> std::process::Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(arguments).output().expect("the command runs")
    }

    /// Runs `rlg navigate` on the recording with its model.
    fn navigate(&self, extra: &[&str]) -> std::process::Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command
            .arg("--json")
            .arg("navigate")
            .arg(self.path("recording"));
        command.arg("--out").arg(self.path("out")).args(extra);
        if !extra.contains(&"--compensated") {
            command.arg("--model").arg(self.path("model.toml"));
        }
        command.output().expect("the command runs")
    }

    /// Checks for a refusal in one line with all of `parts`, nothing written.
    fn is_refused(&self, extra: &[&str], parts: &[&str]) {
        let output = self.navigate(extra);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert_eq!(words.lines().count(), 1, "{words}");
        for part in parts {
            assert!(words.contains(part), "no {part:?} in: {words}");
        }
        assert!(!self.path("out").exists());
    }
}

fn json(output: &std::process::Output) -> Value {
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().expect("a list");
    std::array::from_fn(|index| list[index].as_f64().expect("a number"))
}

/// Returns the equivalent seconds of full coning of one of the scenario's stretches: 17 s, of which 1 s at each end is ramp,
/// by the square of the ramp's shape (Simpson's rule).
fn full_coning_s() -> f64 {
    let ramp = |x: f64| x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
    let steps = 1000;
    let square = |step: usize| ramp(step as f64 / steps as f64).powi(2);
    let inner: f64 = (1..steps)
        .map(|step| square(step) * if step % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    15.0 + 2.0 * (square(0) + inner + square(steps)) / (3.0 * steps as f64)
}

#[test]
fn coning_turns_the_attitude_by_the_sums_of_k_and_the_dynamic_terms_take_that_out() {
    let bench = Bench::new();
    let results = json(&bench.navigate(&[]));
    let before: [f64; 3] = numbers(&results["before"]["final_attitude_error_arcsec"]);
    let after: [f64; 3] = numbers(&results["after"]["final_attitude_error_arcsec"]);
    // −(K_ij + K_ik) Ω³ φ²/2 about body axis i; x stands north, y west, z up
    let omega = TAU * 15.0;
    let angle_rad = 0.011_f64;
    let each = omega.powi(3) * angle_rad.sin().powi(2) / 2.0 * full_coning_s() * ARCSEC_PER_RAD;
    let sum = |gyro: usize| TABLE_3[2 * gyro].1 + TABLE_3[2 * gyro + 1].1;
    let law = [-sum(0) * each, sum(1) * each, sum(2) * each];
    // random walk of a gyro and of the reference, 8.7e-8 rad/√s, over 60 s; four standard deviations
    let noise = 4.0 * ANGLE_RANDOM_WALK.hypot(8.7e-8) * 60_f64.sqrt() * ARCSEC_PER_RAD;
    for axis in 0..3 {
        let taken_out = before[axis] - after[axis];
        println!(
            "axis {axis}: before {:.3}, after {:.3}, taken out {taken_out:.3}, law {:.3} arcsec",
            before[axis], after[axis], law[axis]
        );
        // the level frame differs from the body's axes by the gyrocompass' 0.3°, 0.5 % of the other axes' rotations
        assert!((taken_out / law[axis] - 1.0).abs() < 0.01);
        assert!(after[axis].abs() < noise, "{} {noise}", after[axis]);
    }
}

#[test]
fn a_tilt_diverges_the_velocity_and_the_dynamic_terms_halve_that_at_least() {
    let bench = Bench::new();
    let results = json(&bench.navigate(&[]));
    let table = Recording::read(bench.path("out")).expect("a recording");
    let column = |name: &str| {
        let mut channels = table.tables[0].channels.iter();
        let found = channels.find(|channel| channel.column == name);
        &found.unwrap_or_else(|| panic!("{name}")).values
    };
    // δv̇ = e × f with f = (0, 0, −g): east +g e_N, north −g e_E
    for (velocity, error, sign) in [("east", "north", 1.0), ("north", "east", -1.0)] {
        let change = |stem: &str| -> Vec<f64> {
            let before = column(&format!("before_{stem}"));
            let after = column(&format!("after_{stem}"));
            before.iter().zip(after).map(|(b, a)| b - a).collect()
        };
        let tilts = change(&format!("attitude_error_{error}_rad"));
        let expected_m_s = sign * GRAVITY_M_S2 * tilts.iter().sum::<f64>() * 0.0025;
        let velocities = change(&format!("velocity_{velocity}_m_s"));
        let found_m_s = velocities[velocities.len() - 1];
        println!("{velocity}: taken out {found_m_s:.5} m/s, law {expected_m_s:.5}");
        // the Earth's rotation carries 60 s · 7e-5 rad/s of one tilt into the other
        assert!((found_m_s / expected_m_s - 1.0).abs() < 0.01);
    }
    let reduction: [f64; 2] = numbers(&results["velocity_reduction"]);
    println!(
        "velocity reduction: north {:.3}, east {:.3}",
        reduction[0], reduction[1]
    );
    // Table 5's best row is 50.53 %
    assert!(reduction.iter().all(|share| *share > 0.5053));
    let rest = &results["after"]["attitude_change_at_rest"][0];
    assert_eq!(rest["segment"], "still");
    assert_eq!(rest["start_s"], 55.0);
}

#[test]
fn the_page_shows_both_on_the_same_axes_and_needs_nothing_from_outside() {
    let bench = Bench::new();
    json(&bench.navigate(&[]));
    let page = fs::read_to_string(bench.path("out/navigation.html")).expect("a page");
    let text = fs::read_to_string(bench.path("out/navigation.json")).expect("results");
    assert!(serde_json::from_str::<Value>(&text).is_ok());
    // pitch, roll, heading, three errors, two velocities; each with both colours
    let figures: Vec<_> = page.split("<figure>").skip(1).collect();
    assert_eq!(figures.len(), 8);
    for figure in figures {
        assert!(figure.contains("stroke=\"#D55E00\"") && figure.contains("stroke=\"#0072B2\""));
    }
    assert!(!page.contains("NaN") && !page.contains("<script") && !page.contains("http"));
}

#[test]
fn what_a_replay_wrote_navigates_as_the_recording_does() {
    let bench = Bench::new();
    let whole = json(&bench.navigate(&[]));
    let replayed = bench.path("replayed");
    let (recording, model) = (bench.path("recording"), bench.path("model.toml"));
    let output = bench.run([
        "replay".as_ref(),
        recording.as_ref(),
        "--model".as_ref(),
        model.as_ref(),
        "--core".as_ref(),
        "reference".as_ref(),
        "--out".as_ref(),
        replayed.as_ref(),
    ]);
    assert_eq!(output.status.code(), Some(0));
    let out = bench.path("again");
    let again = json(&bench.run([
        "--json".as_ref(),
        "navigate".as_ref(),
        replayed.as_ref(),
        "--compensated".as_ref(),
        "--out".as_ref(),
        out.as_ref(),
    ]));
    assert!(again["before"].is_null());
    for key in ["max_velocity_m_s", "final_offset_m"] {
        let [first, second]: [[f64; 2]; 2] = [&whole, &again].map(|r| numbers(&r["after"][key]));
        // 1/(1/T) is T but for the last bit
        for (one, other) in first.iter().zip(second) {
            assert!(
                (one - other).abs() < 1e-9 * one.abs(),
                "{key}: {one} {other}"
            );
        }
    }
}

/// Makes a bench of a short still scenario, modified by `change`.
fn short(change: impl Fn(&str) -> String) -> Bench {
    let text = r#"
format = 1
name = "short"
rate_hz = 4000.0
start_s = 0.0
[site]
latitude_rad = 0.6
gravity_m_s2 = 9.80665
earth_rate = true
[gyro]
pulse_weight_rad = [1e-10, 1e-10, 1e-10]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]
installation_rad = {}
[accelerometer]
bias_m_s2 = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
noise_m_s2_sqrt_hz = 0.0
weight_m_s2 = 1e-9
[[motion]]
kind = "still"
duration_s = 0.5
[[motion]]
kind = "coning"
axis = "x"
frequency_hz = 15.0
angle_rad = 0.01
ramp_s = 0.1
duration_s = 0.5
"#;
    let scenario =
        Scenario::parse(&change(text), Path::new("short.toml")).expect("a good scenario");
    let simulation = simulate(&scenario, 1, |_| {});
    Bench::of(&simulation.recording, simulation.model)
}

#[test]
fn an_earth_that_does_not_turn_is_refused() {
    let bench = short(|text| text.replace("earth_rate = true", "earth_rate = false"));
    bench.is_refused(&[], &["no rotation of the Earth", "gyros", "°/h across"]);
    bench.is_refused(
        &["--heading-deg", "0"],
        &["does not turn as the Earth", "15.041 °/h"],
    );
}

#[test]
fn a_recording_without_accelerometers_is_refused() {
    let bench = short(|text| {
        let begin = text.find("[accelerometer]").expect("there");
        let end = text.find("[[motion]]").expect("there");
        format!("{}{}", &text[..begin], &text[end..])
    });
    bench.is_refused(&[], &["no accelerometer channel", "velocity_increment"]);
    bench.is_refused(&["--compensated"], &["gyro_increment or gyro_rate"]);
}

#[test]
fn a_recording_without_a_site_takes_a_latitude_and_refuses_a_pole() {
    let bench = short(|text| {
        let begin = text.find("[site]").expect("there");
        let end = text.find("[gyro]").expect("there");
        format!("{}{}", &text[..begin], &text[end..])
    });
    bench.is_refused(
        &[],
        &["recording.toml", "site.latitude_rad", "--latitude-deg"],
    );
    bench.is_refused(
        &["--latitude-deg", "-89.5"],
        &["--latitude-deg", "-89.5°", "pole"],
    );
    bench.is_refused(&["--latitude-deg", "nan"], &["--latitude-deg", "pole"]);
    // without a site the simulator has no gravity either
    bench.is_refused(&["--latitude-deg", "34"], &["specific force", "no gravity"]);
}

#[test]
fn a_time_of_rest_that_is_not_there_is_refused() {
    let bench = short(str::to_owned);
    bench.is_refused(
        &["--align-s", "0.001"],
        &["--align-s", "no complete output period"],
    );
    bench.is_refused(
        &["--align-s", "7"],
        &["--align-s", "nothing after the alignment"],
    );
    bench.is_refused(
        &["--align-s", "nan"],
        &["--align-s", "no complete output period"],
    );
    bench.is_refused(&["--heading-deg", "inf"], &["--heading-deg", "inf"]);
    let moving = short(|text| {
        text.replacen(
            "\"still\"\n",
            "\"coning\"\naxis = \"y\"\nfrequency_hz = 15.0\nangle_rad = 0.01\nramp_s = 0.1\n",
            1,
        )
    });
    moving.is_refused(&[], &["names no time of rest", "--align-s"]);
}

#[test]
fn perfect_instruments_find_north_and_stay_where_they_are() {
    let results = json(&short(str::to_owned).navigate(&[]));
    let heading_deg = results["after"]["alignment"]["heading_deg"].as_f64();
    let heading_deg = heading_deg.expect("a number");
    // pulses of 1e-10 rad over 0.5 s against 7.3e-5 cos L rad/s: 3e-6 rad
    let off_north_deg = (heading_deg + 180.0).rem_euclid(360.0) - 180.0;
    assert!(off_north_deg.abs() < 1e-3, "{off_north_deg}");
    let [north, east]: [f64; 2] = numbers(&results["after"]["max_velocity_m_s"]);
    // 1e-9 m/s² codes, and the flexure of the model that the unit lacks: 1 °/h for half a second, 2e-6 rad, times g times
    // half a second
    assert!(north < 2e-5 && east < 2e-5, "{north} {east}");
}

#[test]
fn a_reference_that_moves_with_the_unit_shows_no_error_with_and_without_the_earth_in_it() {
    let latitude_rad = 0.6_f64;
    let earth_rate = strapdown::earth::earth_rate_rad_s(latitude_rad);
    let place = Place {
        latitude_rad,
        gravity_m_s2: None,
    };
    let period_s = 0.0025;
    // rest for 2 s, then 3° about the body's y axis at 1 Hz; gravity at each period's middle
    let rock = |row: usize| {
        let time_s = (row as f64 * period_s - 2.0).max(0.0);
        let angle_rad = 0.05 * (TAU * time_s).sin().powi(2);
        UnitQuaternion::from_scaled_axis(Vector3::y() * angle_rad)
    };
    let earth = |rows: f64| UnitQuaternion::from_scaled_axis(earth_rate * period_s * rows);
    let up = Vector3::z() * -place.gravity_m_s2();
    let rows = 4000;
    let inertial = |row: usize| earth(row as f64) * rock(row);
    let increments: Vec<Increment> = (0..rows)
        .map(|row| Increment {
            rotation_rad: (inertial(row).inverse() * inertial(row + 1)).scaled_axis(),
            velocity_m_s: inertial(row).inverse() * (earth(row as f64 + 0.5) * up) * period_s,
            period_s,
        })
        .collect();
    let over_ground: Vec<[f64; 3]> = (0..rows)
        .map(|row| (rock(row).inverse() * rock(row + 1)).scaled_axis().into())
        .collect();
    let against_stars: Vec<[f64; 3]> = increments.iter().map(|i| i.rotation_rad.into()).collect();
    let start = Start {
        periods: 0..800,
        heading_rad: None,
    };
    for (reference, earth_in_it) in [(&over_ground, false), (&against_stars, true)] {
        let trajectory = navigate(&increments, &place, &start, Some((reference, earth_in_it)));
        let trajectory = trajectory.expect("a unit at rest");
        let errors = trajectory.attitude_error_rad.expect("a reference");
        let worst = errors.iter().map(Vector3::norm).fold(0.0, f64::max);
        println!("earth in the reference {earth_in_it}: {worst:.1e} rad");
        // the transport rate of the small velocity due to rounding
        assert!(worst < 1e-9);
    }
    let weightless: Vec<_> = increments
        .iter()
        .map(|i| Increment {
            velocity_m_s: i.velocity_m_s * 0.98,
            ..*i
        })
        .collect();
    assert!(matches!(
        navigate(&weightless, &place, &start, None),
        Err(NotAtRest::Force(_))
    ));
    let still: Vec<_> = over_ground
        .iter()
        .zip(&increments)
        .map(|(turn, i)| Increment {
            rotation_rad: Vector3::from(*turn),
            ..*i
        })
        .collect();
    assert!(matches!(
        navigate(&still, &place, &start, None),
        Err(NotAtRest::Alignment(AlignmentError::NoNorth(_)))
    ));
}
