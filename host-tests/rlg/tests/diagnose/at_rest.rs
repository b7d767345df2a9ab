//! A unit at rest, diagnosed without a reference: existing effects are found, and no others.
//!
//! The recordings are made here from random numbers, not by the simulator. If `RLG_RECORDINGS` names the folder of the real
//! ones, those are imported and diagnosed, too.

use std::f64::consts::TAU;
use std::ops::Range;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;
use tempfile::TempDir;

const RATE_HZ: f64 = 64.0;
const EARTH_RAD_S: f64 = 7.292_115e-5;

/// Effects put into a recording of records of seven.
#[derive(Default)]
struct Made {
    /// Amplitude of a line at 9.2 Hz on gyro y [rad/s].
    line_rad_s: f64,
    /// Amplitude on all gyros of a line at 29.9 Hz with a phase that wanders by 0.6 rad, together with a third of it on gyro
    /// x at its product with the line at 9.2 Hz \[rad/s\].
    wandering_rad_s: f64,
    /// Amplitude of a line of twelve cycles on gyro z [rad/s].
    slow_line_rad_s: f64,
    /// Relative error of the nominal rate.
    clock: f64,
    /// Bias of gyro x, which points up [rad/s].
    bias_rad_s: f64,
    /// Root mean square of a resonance at 17.3 Hz, 0.3 Hz wide, on gyro z, and half of it on gyro y \[rad/s\].
    resonance_rad_s: f64,
    /// No white noise of angle.
    is_of_rate_alone: bool,
}

/// 400 s at rest at 45 degrees north, x up, y north: white angle noise of 2e-7 rad, random walk 3e-7 rad/sqrt(s).
fn records(made: &Made, seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let earth = EARTH_RAD_S * std::f64::consts::FRAC_1_SQRT_2;
    let mut before = [0.0; 3];
    // A resonance driven by noise, sampled: its rms is 1.
    let pole = (-std::f64::consts::PI * 0.3 / RATE_HZ).exp();
    let cosine = (TAU * 17.3 / RATE_HZ).cos();
    let [one, two] = [2.0 * pole * cosine, -pole * pole];
    let gain = ((1.0 + two) * ((1.0 - two).powi(2) - one * one) / (1.0 - two)).sqrt();
    let mut rings = [[0.0; 2]; 2];
    let mut bytes = Vec::new();
    for row in 0..25_600_u32 {
        let time_s = (f64::from(row) + 1.0) / (RATE_HZ * (1.0 + made.clock));
        let line = made.line_rad_s * (TAU * 9.2 * (f64::from(row) + 0.5) / RATE_HZ).sin();
        let slow = made.slow_line_rad_s * (TAU * 12.0 * f64::from(row) / 25_600.0).sin();
        let at_s = (f64::from(row) + 0.5) / RATE_HZ;
        let wandering = TAU * 29.9 * at_s + 0.6 * (TAU * at_s / 170.0).sin();
        let image = made.wandering_rad_s * wandering.sin();
        let product = made.wandering_rad_s / 3.0 * (wandering + TAU * 9.2 * at_s).cos();
        if made.resonance_rad_s > 0.0 {
            for ring in &mut rings {
                *ring = [one * ring[0] + two * ring[1] + gain * normal(), ring[0]];
            }
        }
        let rings = rings.map(|ring| made.resonance_rad_s * ring[0]);
        let mean = [
            earth + made.bias_rad_s + image + product,
            earth + line + image + 0.5 * rings[0],
            slow + image + rings[1],
        ];
        let mut record = vec![time_s + 2e-5 * normal()];
        for axis in 0..3 {
            let angle_rad = if made.is_of_rate_alone {
                0.0
            } else {
                2e-7 * normal()
            };
            let walk_rad = 3e-7 * normal() / RATE_HZ.sqrt();
            let noise_rad_s = (walk_rad + angle_rad - before[axis]) * RATE_HZ;
            before[axis] = angle_rad;
            record.push((mean[axis] + noise_rad_s).to_degrees());
        }
        record.extend([9.806 + 1e-3 * normal(), 1e-3 * normal(), 1e-3 * normal()]);
        bytes.extend(record.into_iter().flat_map(f64::to_le_bytes));
    }
    bytes
}

fn rlg(arguments: &[&str], paths: &[&Path]) -> (Option<i32>, String) {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let output = command.args(arguments).args(paths).output().expect("runs");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), words)
}

struct Bench(TempDir);

impl Bench {
    fn imported(file: &Path, arguments: &[&str]) -> Self {
        let bench = Self(tempfile::tempdir().expect("a folder"));
        let out = bench.recording();
        let (code, words) = rlg(
            &[&["import"], arguments, &["--out"]].concat(),
            &[&out, file],
        );
        assert_eq!(code, Some(0), "{words}");
        bench
    }
    fn made(made: &Made, seed: u64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("made.ins");
        std::fs::write(&file, records(made, seed)).expect("a file");
        let site = ["--latitude-deg", "45", "--gravity", "9.806"];
        Self::imported(&file, &[&["--format", "f64x7"], &site[..]].concat())
    }
    fn without_site(made: &Made, seed: u64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("made.ins");
        std::fs::write(&file, records(made, seed)).expect("a file");
        Self::imported(&file, &["--format", "f64x7"])
    }
    fn recording(&self) -> PathBuf {
        self.0.path().join("recording")
    }
    fn diagnosed_with(&self, model: &Path, out: &str) -> Value {
        let out = self.0.path().join(out);
        let recording = self.recording();
        let (code, words) = rlg(
            &["diagnose", "--model"],
            &[model, Path::new("--out"), &out, &recording],
        );
        assert_eq!(code, Some(0), "{words}");
        let text = std::fs::read_to_string(out.join("diagnosis.json")).expect("a result");
        serde_json::from_str(&text).expect("JSON")
    }
    fn diagnosed(&self) -> Value {
        self.diagnosed_with(&self.recording().join("model.toml"), "out")
    }
}

/// Returns the effects with an expression that begins with `stem`.
fn expressions<'a>(diagnosis: &'a Value, stem: &str) -> Vec<&'a Value> {
    let effects = diagnosis["effects"].as_array().expect("effects");
    let begins = |effect: &&Value| {
        let text = effect["expression"].as_str();
        text.is_some_and(|text| text.starts_with(stem))
    };
    effects.iter().filter(begins).collect()
}

#[test]
fn at_rest_a_line_and_a_clock_are_found_and_go_on_in_the_other_half() {
    let made = Made {
        line_rad_s: 1e-5,
        clock: 1e-3,
        ..Made::default()
    };
    let bench = Bench::made(&made, 1);
    let diagnosis = bench.diagnosed();
    let lines = expressions(&diagnosis, "sine(");
    assert_eq!(lines.len(), 1, "{lines:?}");
    let amplitude = lines[0]["parameters"][1]["value"].as_f64().expect("y");
    let std = lines[0]["parameters"][1]["std"].as_f64().expect("y");
    // Five standard deviations, including the bias of the amplitude for a frequency off by one standard deviation.
    assert!((amplitude - 1e-5).abs() < 5.0 * std, "{amplitude} ± {std}");
    let clock = expressions(&diagnosis, "row_rate(");
    let rate = clock[0]["parameters"][0]["value"].as_f64().expect("a rate");
    let std = clock[0]["parameters"][0]["std"].as_f64().expect("its std");
    assert!((rate - 1e-3).abs() < 5.0 * std, "{rate} ± {std}");
    assert_eq!(diagnosis["control"]["lines"], 0);
    let again = bench.diagnosed_with(&bench.0.path().join("out/model.toml"), "again");
    assert_eq!(expressions(&again, "sine(").len(), 0);
    assert_eq!(expressions(&again, "row_rate(").len(), 0);
}

#[test]
fn at_rest_a_line_whose_phase_wanders_is_followed_and_its_product_with_it() {
    let made = Made {
        line_rad_s: 2e-5,
        wandering_rad_s: 6e-5,
        ..Made::default()
    };
    let bench = Bench::made(&made, 9);
    let diagnosis = bench.diagnosed();
    assert_eq!(expressions(&diagnosis, "sine(").len(), 2);
    let products = expressions(&diagnosis, "line(");
    assert_eq!(products.len(), 1, "{products:?}");
    let number = |name: &str, key: &str| {
        let parameters = products[0]["parameters"].as_array().expect("numbers");
        let one = parameters.iter().find(|one| one["name"] == name);
        one.expect("a number")[key].as_f64().expect("a number")
    };
    // 9.2 + 29.9 Hz, aliased to 64 less that.
    let off = number("frequency_hz", "value") - 24.9;
    assert!(off.abs() < 4.0 * number("frequency_hz", "std"), "{off}");
    let off = number("x", "value") - 2e-5;
    assert!(off.abs() < 4.0 * number("x", "std"), "{off}");
    for channel in diagnosis["fit"]["channels"].as_array().expect("gyros") {
        let power = |key: &str| channel[key]["normalised_power_all"].as_f64();
        let (before, after) = (power("held_out_before"), power("held_out_after"));
        assert!(after < before, "{channel}");
        // Four standard deviations of the power of 5120 rows.
        assert!(after.is_some_and(|after| after < 1.08), "{channel}");
    }
    let again = bench.diagnosed_with(&bench.0.path().join("out/model.toml"), "again");
    assert_eq!(again["verdict"], "matches");
}

#[test]
fn at_rest_a_resonance_that_noise_drives_is_a_band_with_its_width_and_size() {
    let made = Made {
        resonance_rad_s: 1e-5,
        ..Made::default()
    };
    let bench = Bench::made(&made, 91);
    let diagnosis = bench.diagnosed();
    let bands = expressions(&diagnosis, "band(");
    assert_eq!(bands.len(), 1, "{:#?}", diagnosis["summary"]);
    assert_eq!(
        diagnosis["verdict"], "explained",
        "{:#?}",
        diagnosis["summary"]
    );
    let parameters = bands[0]["parameters"].as_array().expect("numbers");
    let near = |name: &str, truth: f64| {
        let own = parameters
            .iter()
            .find(|one| one["name"] == name)
            .expect(name);
        let [value, std] = ["value", "std"].map(|key| own[key].as_f64().expect("a number"));
        assert!(
            (value - truth).abs() < 4.0 * std,
            "{name}: {value} ± {std}, not {truth}"
        );
        assert!(std < 0.15 * truth, "{name}: {value} ± {std}");
    };
    near("frequency_hz", 17.3);
    near("width_hz", 0.3);
    near("y", 0.5e-5);
    near("z", 1e-5);
    assert!(
        parameters
            .iter()
            .all(|one| one["name"] != "x" || one["value"] == 0.0)
    );
    let again = bench.diagnosed_with(&bench.0.path().join("out/model.toml"), "again");
    assert_eq!(again["verdict"], "matches", "{:#?}", again["summary"]);
}

#[test]
fn at_rest_a_line_of_few_turns_is_a_line_and_no_drift() {
    // Its SNR is 1e-6 sqrt(200)/3e-7 = 47.
    let made = Made {
        slow_line_rad_s: 1e-6,
        ..Made::default()
    };
    let diagnosis = Bench::made(&made, 8).diagnosed();
    let lines = expressions(&diagnosis, "sine(");
    assert_eq!(lines.len(), 1, "{lines:?}");
    let text = lines[0]["expression"].as_str().expect("an expression");
    let hz = text.trim_start_matches("sine(").trim_end_matches(')');
    let hz: f64 = hz.parse().expect("a frequency");
    // Half a resolution of the whole record.
    assert!((hz - 12.0 / 400.0).abs() < 0.5 / 400.0, "{hz}");
}

#[test]
fn at_rest_noise_alone_gives_no_line_no_clock_no_cycle_and_no_bias() {
    noise_alone_gives_nothing(2..3);
}

#[test]
#[ignore = "many seeds: --test diagnose -- --ignored in_full"]
fn at_rest_noise_alone_gives_nothing_in_full() {
    noise_alone_gives_nothing(2..22);
}

#[test]
fn without_a_site_noise_gives_nothing_and_a_bias_stands_beyond_the_earths_rate() {
    nothing_is_found(&Bench::without_site(&Made::default(), 5).diagnosed(), 5);
    let bias_rad_s = 30.0 * EARTH_RAD_S;
    let made = Made {
        bias_rad_s,
        ..Made::default()
    };
    let diagnosis = Bench::without_site(&made, 6).diagnosed();
    let effects = diagnosis["effects"].as_array().expect("effects");
    let bias = effects.iter().find(|effect| effect["kind"] == "gyro_bias");
    let bias = bias.expect("a bias");
    let number = |key: &str| bias["parameters"][0][key].as_f64().expect("a number");
    let (value, std) = (number("value"), number("std"));
    // The direction of the Earth's rotation is unknown: it dominates the uncertainty of the bias.
    assert!((value - bias_rad_s).abs() < 3.0 * std, "{value} ± {std}");
    assert!(std > 0.3 * EARTH_RAD_S && std < 2.0 * EARTH_RAD_S, "{std}");
}

fn noise_alone_gives_nothing(seeds: Range<u64>) {
    for seed in seeds {
        nothing_is_found(&Bench::made(&Made::default(), seed).diagnosed(), seed);
    }
}

fn nothing_is_found(diagnosis: &Value, seed: u64) {
    for stem in ["sine(", "row_rate(", "noise_cycle("] {
        assert_eq!(expressions(diagnosis, stem).len(), 0, "seed {seed}, {stem}");
    }
    let effects = diagnosis["effects"].as_array().expect("effects");
    // The model of an import states the resolution of the numbers only: the noise itself is new.
    let news: Vec<_> = effects
        .iter()
        .map(|effect| effect["kind"].as_str().expect("a kind"))
        .filter(|kind| *kind != "pulse_quantisation")
        .collect();
    assert!(news.is_empty(), "seed {seed}: {news:?}");
    assert_eq!(diagnosis["locations"].as_array().expect("places").len(), 0);
}

#[test]
fn at_rest_noise_is_measured_in_its_terms_and_that_of_rate_is_no_pulses() {
    let is_at = |level: &Value, expected: f64| {
        let number = |key: &str| level[key].as_f64().expect("a number");
        let (value, std) = (number("value"), number("std"));
        // Squares are fitted, and for a level of zero only they have a standard deviation.
        let of_square = match value > std {
            true => 2.0 * value * std,
            false => std * std,
        };
        let off = value * value - expected * expected;
        assert!(
            off.abs() < 4.0 * of_square,
            "{value} ± {std} for {expected}"
        );
    };
    for (seed, is_of_rate_alone) in [(31, true), (32, false)] {
        let made = Made {
            is_of_rate_alone,
            ..Made::default()
        };
        let diagnosis = Bench::made(&made, seed).diagnosed();
        let of_angle = if is_of_rate_alone { 0.0 } else { 2e-7 };
        for gyro in diagnosis["noise"].as_array().expect("gyros") {
            is_at(&gyro["terms"]["angle_random_walk_rad_sqrt_s"], 3e-7);
            is_at(&gyro["terms"]["quantisation_rad"], of_angle);
            is_at(&gyro["terms"]["bias_instability_rad_s"], 0.0);
            is_at(&gyro["terms"]["rate_random_walk_rad_s_sqrt_s"], 0.0);
        }
        let accelerometers = diagnosis["accelerometer_noise"].as_array();
        let accelerometers = accelerometers.expect("accelerometers");
        assert_eq!(accelerometers.len(), 3);
        for one in accelerometers {
            // 1e-3 m/s² in rows of 1/64 s.
            is_at(&one["terms"]["velocity_random_walk_m_s_sqrt_s"], 1e-3 / 8.0);
            is_at(&one["terms"]["quantisation_m_s"], 0.0);
        }
        let verdict = if is_of_rate_alone {
            "matches"
        } else {
            "explained"
        };
        assert_eq!(diagnosis["verdict"], verdict);
    }
}

#[test]
fn at_rest_a_rate_that_is_not_the_earths_is_a_bias_with_all_its_other_names() {
    // Fifty standard deviations for 200 s of this noise, 3e-7/sqrt(200) = 2.1e-8 rad/s.
    let made = Made {
        bias_rad_s: 50.0 * 2.1e-8,
        ..Made::default()
    };
    let diagnosis = Bench::made(&made, 6).diagnosed();
    let effects = diagnosis["effects"].as_array().expect("effects");
    let bias = effects.iter().find(|effect| effect["kind"] == "gyro_bias");
    let bias = bias.expect("a bias");
    let rivals = bias["indistinguishable_from"].as_array().expect("rivals");
    for rival in ["earth_rate", "gyro_scale", "gyro_g_bias"] {
        assert!(rivals.iter().any(|known| known == rival), "no {rival}");
    }
}

#[test]
fn at_rest_biases_of_any_size_are_named_with_their_values() {
    // In standard deviations of a mean over the fitted rows, 3e-7/sqrt(320) rad/s.
    for (seed, deviations) in [(10, 30.0), (11, 1e3), (12, 1e5)] {
        let bias_rad_s = deviations * 1.7e-8;
        let made = Made {
            bias_rad_s,
            ..Made::default()
        };
        let bench = Bench::made(&made, seed);
        let diagnosis = bench.diagnosed();
        let effects = diagnosis["effects"].as_array().expect("effects");
        let news = effects
            .iter()
            .filter(|one| one["kind"] != "pulse_quantisation");
        let news: Vec<&Value> = news.collect();
        assert_eq!(news.len(), 1, "{deviations}: {news:?}");
        assert_eq!(news[0]["kind"], "gyro_bias");
        let parameters = news[0]["parameters"].as_array().expect("parameters");
        for parameter in parameters.iter().filter(|one| one["name"] != "z") {
            let expected = if parameter["name"] == "x" {
                bias_rad_s
            } else {
                0.0
            };
            let number = |key: &str| parameter[key].as_f64().expect("a number");
            let off = number("value") - expected;
            // Two level gyros may absorb one azimuth of the Earth's rotation.
            assert!(off.abs() < 4.0 * number("std"), "{deviations}: {parameter}");
        }
        let again = bench.diagnosed_with(&bench.0.path().join("out/model.toml"), "again");
        assert_eq!(again["verdict"], "matches", "{deviations}");
    }
}

#[test]
fn a_real_recording_shows_what_its_model_leaves_out_and_a_shuffled_one_nothing() {
    let Some(folder) = recordings() else {
        return;
    };
    let ln100 = Bench::imported(&folder.join("x_LN100_up.ins"), &["--format", "f64x7"]).diagnosed();
    let rate = expressions(&ln100, "row_rate(")[0]["parameters"][0]["value"].as_f64();
    // The stamps of the whole file, first to last, give 64.0549 Hz; either half differs from it by parts in 1e6.
    assert!(
        (rate.expect("a rate") - (64.0549 / 64.0 - 1.0)).abs() < 1e-5,
        "{rate:?}"
    );
    assert!(!expressions(&ln100, "sine(").is_empty());
    assert!(!expressions(&ln100, "line(").is_empty());
    for channel in ln100["fit"]["channels"].as_array().expect("gyros") {
        let power = |key: &str| channel[key]["normalised_power_all"].as_f64();
        assert!(
            power("held_out_after") < power("held_out_before"),
            "{channel}"
        );
    }
    shuffled_ones_show_nothing(&ln100);
}

#[test]
#[ignore = "minutes: --test diagnose -- --ignored in_full"]
fn a_real_recording_of_half_an_hour_shows_the_cycle_of_its_noise_in_full() {
    let Some(folder) = recordings() else {
        return;
    };
    let laser =
        Bench::imported(&folder.join("lasergyro.imu"), &["--format", "psins-imu"]).diagnosed();
    assert_eq!(expressions(&laser, "noise_cycle(1/4)").len(), 1);
    shuffled_ones_show_nothing(&laser);
}

fn recordings() -> Option<PathBuf> {
    let folder = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("RLG_RECORDINGS names no folder: the real files were not diagnosed");
    }
    folder
}

/// The same rows in random order give no finding.
fn shuffled_ones_show_nothing(diagnosis: &Value) {
    assert_eq!(diagnosis["control"]["lines"], 0);
    assert_eq!(diagnosis["control"]["cycles"], 0);
}
