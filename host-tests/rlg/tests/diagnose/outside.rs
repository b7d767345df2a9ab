//! Small recordings made by others, from `outside/` in the folder of `RLG_RECORDINGS`: refusals, corrections, rows left out,
//! and findings. None of their models declares the reference's noise.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};

use rlg::diagnose::result::{Diagnosis, ParameterEntry, Verdict};
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::model::Model;
use rlg::recording::Recording;

/// Diagnosis of one of them, or the reason of its refusal.
type Said = Arc<OnceLock<Result<Outcome, String>>>;

/// Diagnoses by recording and `anyway`: tests of the same share one diagnosis.
static SAID: Mutex<BTreeMap<(String, bool), Said>> = Mutex::new(BTreeMap::new());

/// Returns the diagnosis of one of them; `None` if they are not available.
fn diagnosed(name: &str, anyway: bool) -> Option<Said> {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
        return None;
    };
    let folder = folder.join("outside").join(name);
    if !folder.exists() {
        eprintln!("skipped: no {}", folder.display());
        return None;
    }
    let mut all = SAID.lock().expect("nothing panics while it is held");
    let said = Arc::clone(all.entry((name.to_owned(), anyway)).or_default());
    drop(all);
    said.get_or_init(|| {
        let file = folder.join("model.toml");
        let model = Model::read(&file).unwrap_or_else(|error| panic!("{error}"));
        let recording = Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"));
        let settings = Settings {
            anyway,
            ..Settings::default()
        };
        diagnose_under(&settings, &recording, &model, &file, &|_| {})
            .map_err(|error| error.to_string())
    });
    Some(said)
}

/// Returns the outcome or the refusal, which exists.
fn of(said: &Said) -> Result<&Outcome, &String> {
    said.get().expect("it was diagnosed").as_ref()
}

fn refused(name: &str, words: &str) {
    match diagnosed(name, false).as_ref().map(of) {
        None => {}
        Some(Ok(outcome)) => panic!("{name}: not refused: {:#?}", outcome.diagnosis.summary),
        Some(Err(error)) => assert!(error.contains(words), "{error}"),
    }
}

/// Passes the diagnosis to `judge`.
fn accepted(name: &str, anyway: bool, judge: impl Fn(&Diagnosis)) {
    match diagnosed(name, anyway).as_ref().map(of) {
        None => {}
        Some(Err(error)) => panic!("{name}: {error}"),
        Some(Ok(outcome)) => judge(&outcome.diagnosis),
    }
}

fn count(diagnosis: &Diagnosis, kind: &str) -> usize {
    let effects = diagnosis.effects.iter();
    effects.filter(|effect| effect.kind == kind).count()
}

fn says(diagnosis: &Diagnosis, words: &str) -> bool {
    diagnosis.summary.iter().any(|line| line.contains(words))
}

/// Checks that no kind is found that predicts nothing: no fault of the data, no corrected channel.
fn is_sound(diagnosis: &Diagnosis) {
    for kind in rlg::model::kinds::FAULT_KINDS {
        assert_eq!(
            count(diagnosis, kind),
            0,
            "{kind}: {:#?}",
            diagnosis.summary
        );
    }
}

#[test]
fn a_reversed_encoder_is_refused_and_put_right_anyway() {
    refused(
        "encoder-yaw-reversed",
        "gyro z reads -1.00 times the reference",
    );
    accepted("encoder-yaw-reversed", true, |diagnosis| {
        assert_eq!(count(diagnosis, "channel_sign"), 1);
        assert!(says(diagnosis, "yro z reads -1.00 times the reference"));
    });
}

#[test]
#[ignore = "a quarter of a minute: --test diagnose -- --ignored in_full"]
fn an_encoder_about_another_axis_is_sound_and_shows_its_delay_in_full() {
    is_sound_and_shows_its_delay("encoder-roll", "x");
}

#[test]
fn a_doubled_rate_is_refused_and_a_scale_error_anyway() {
    refused(
        "doubled-rate",
        "all three read 2.000 times the reference: counts or degrees?",
    );
    accepted("doubled-rate", true, |diagnosis| {
        assert!(count(diagnosis, "gyro_scale") >= 1);
        assert!(says(diagnosis, "All three read 2.000 times the reference"));
    });
}

/// Returns value and standard deviation of a number among parameters.
fn parameter(parameters: &[ParameterEntry], wanted: &str) -> Option<(f64, f64)> {
    parameters.iter().find_map(|parameter| match parameter {
        ParameterEntry::Number {
            name, value, std, ..
        } if name == wanted => Some((*value, *std)),
        _ => None,
    })
}

/// Returns value and standard deviation of a parameter of the one effect of a kind.
fn number(diagnosis: &Diagnosis, kind: &str, name: &str) -> (f64, f64) {
    let mut of_kind = diagnosis.effects.iter().filter(|one| one.kind == kind);
    let effect = of_kind
        .next()
        .unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary));
    assert!(
        of_kind.next().is_none(),
        "{kind} twice: {:#?}",
        diagnosis.summary
    );
    let found = parameter(&effect.parameters, name);
    found.unwrap_or_else(|| panic!("{kind} without {name}: {:#?}", diagnosis.summary))
}

/// Lists the named kinds among all known ones.
fn kinds(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut kinds: Vec<&str> = diagnosis
        .effects
        .iter()
        .map(|one| one.kind.as_str())
        .collect();
    kinds.sort_unstable();
    kinds
}

#[test]
fn nothing_is_named_where_gyros_and_reference_differ_by_noise() {
    for name in ["null-10s", "null-slow", "null-refnoise-2"] {
        accepted(name, false, |diagnosis| {
            assert!(
                diagnosis.effects.is_empty(),
                "{name}: {:#?}",
                diagnosis.summary
            );
        });
    }
}

#[test]
fn a_delay_of_three_rows_is_one_delay_of_all_gyros() {
    accepted("delay-rate-0.032", false, |diagnosis| {
        assert_eq!(kinds(diagnosis), ["reference_delay"]);
        // Late gyros are equivalent to an early reference.
        let (late_s, std_s) = number(diagnosis, "reference_delay", "all");
        assert!(
            (late_s + 0.032).abs() < 3.0 * std_s && std_s < 1e-5,
            "{late_s} {std_s}"
        );
        let class = &diagnosis.effects[0].indistinguishable_from;
        assert!(class.iter().any(|one| one == "gyro_delay"), "{class:?}");
    });
}

#[test]
fn a_scale_error_of_an_eighth_is_one_of_the_gyros() {
    accepted("scale-0.872", false, |diagnosis| {
        is_sound(diagnosis);
        for axis in ["x", "y", "z"] {
            // Whole counts of 61.035 instead of 70 mdps.
            let (scale, std) = number(diagnosis, "gyro_scale", axis);
            let expected = 61.035 / 70.0 - 1.0;
            assert!(
                (scale - expected).abs() < 3.0 * std && std < 1e-4,
                "{scale} {std}"
            );
        }
    });
}

#[test]
fn one_tone_an_axis_shows_a_scale_error_of_60_ppm_and_nothing_that_cancels_it() {
    accepted("one-tone", false, |diagnosis| {
        assert_eq!(kinds(diagnosis), ["gyro_scale"]);
        let (scale, std) = number(diagnosis, "gyro_scale", "y");
        assert!(
            (scale - 6e-5).abs() < 3.0 * std && std < 1e-6,
            "{scale} {std}"
        );
    });
}

/// The filter's deviation from a continuous low pass, a quarter of a millisecond, is found, too.
#[test]
fn a_low_pass_of_33_ms_is_a_low_pass() {
    accepted("low-pass-rate", false, |diagnosis| {
        is_sound(diagnosis);
        let low_passes = || {
            let effects = diagnosis.effects.iter();
            effects.filter(|effect| effect.kind == "gyro_bandwidth")
        };
        for axis in ["x", "y", "z"] {
            let pole = format!("{axis}_pole_s");
            let found = low_passes().find_map(|effect| parameter(&effect.parameters, &pole));
            let (pole_s, _) = found.unwrap_or_else(|| panic!("{:#?}", diagnosis.summary));
            assert!((pole_s - 0.033).abs() < 1e-4, "{pole_s}");
        }
        for kind in [
            "isolator_mode",
            "gyro_scale",
            "reference_scale",
            "axis_flexure",
            "elastic_rate_by_jerk",
        ] {
            assert_eq!(count(diagnosis, kind), 0, "{:#?}", diagnosis.summary);
        }
        assert!(says(
            diagnosis,
            "Rejected: elastic_rate_by_jerk: fitted again"
        ));
    });
}

/// The ripple of a motor beyond the gyros' band looked like flexure, which came back from its own model with the other sign.
#[test]
fn the_second_pass_takes_the_flexure_off_a_motor() {
    accepted("encoder-yaw", false, |diagnosis| {
        assert_eq!(count(diagnosis, "elastic_rate_by_jerk"), 0);
        assert!(says(
            diagnosis,
            "Rejected: elastic_rate_by_jerk: fitted again"
        ));
    });
}

#[test]
fn a_motor_with_an_encoder_is_sound_and_shows_its_delay() {
    is_sound_and_shows_its_delay("encoder-yaw", "z");
}

/// An outside analysis found 6.5 to 7.1 ms.
fn is_sound_and_shows_its_delay(name: &str, axis: &str) {
    accepted(name, false, |diagnosis| {
        is_sound(diagnosis);
        let (late_s, std_s) = number(diagnosis, "gyro_delay", axis);
        assert!(
            (late_s - 6.8e-3).abs() < 1e-3 && std_s < 1e-3,
            "{late_s} {std_s}"
        );
    });
}

#[test]
fn readings_that_stand_for_seven_rows_are_read_once() {
    accepted("held-7-rows", false, |diagnosis| {
        assert_eq!(count(diagnosis, "held_values"), 3);
        assert!(says(
            diagnosis,
            "held for 7 rows (mean age 3 rows, 15.0 ms)"
        ));
        for kind in [
            "stuck_channel",
            "gyro_scale",
            "reference_scale",
            "gyro_bandwidth",
            "reference_bandwidth",
        ] {
            assert_eq!(
                count(diagnosis, kind),
                0,
                "{kind}: {:#?}",
                diagnosis.summary
            );
        }
    });
}

#[test]
fn wrapped_and_saturated_rates_are_left_out_and_said() {
    accepted("wrapped-rate", false, |diagnosis| {
        assert!(count(diagnosis, "saturation") > 20);
        assert_eq!(count(diagnosis, "stuck_channel"), 0);
        for axis in ["x", "y", "z"] {
            assert!(says(diagnosis, &format!("rows of gyro_{axis}")));
        }
        assert!(says(diagnosis, "wrapped"));
    });
}

#[test]
fn spikes_at_rest_are_listed() {
    accepted("spikes-at-rest", false, |diagnosis| {
        assert_eq!(count(diagnosis, "spikes"), 25);
    });
}

/// Checks that values of the three axes are within three of their standard deviations, and those no larger than `largest`.
fn within(diagnosis: &Diagnosis, kind: &str, expected: [f64; 3], largest: f64) {
    for (axis, expected) in ["x", "y", "z"].iter().zip(expected) {
        let (value, std) = number(diagnosis, kind, axis);
        assert!(
            (value - expected).abs() < 3.0 * std && std < largest,
            "{kind} {axis}: {value} ± {std}, not {expected}"
        );
    }
}

fn is_explained(diagnosis: &Diagnosis) {
    let verdict = diagnosis.verdict;
    assert_eq!(verdict, Verdict::Explained, "{:#?}", diagnosis.summary);
}

#[test]
fn a_mean_rate_of_63_times_the_earths_is_a_bias_and_no_drift() {
    accepted("rest-bias", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["gyro_bias"]);
        within(diagnosis, "gyro_bias", [3.67e-3, -2.33e-3, 0.98e-3], 1e-4);
        // The Earth's rotation is not as large.
        let alike = &diagnosis.effects[0].indistinguishable_from;
        assert!(!alike.iter().any(|kind| kind == "earth_rate"), "{alike:?}");
        for noise in &diagnosis.noise {
            let terms = noise.terms.as_ref().expect("noise in its terms");
            let walk = terms.angle_random_walk_rad_sqrt_s;
            assert!((walk.value - 6e-4).abs() < 3.0 * walk.std, "{walk:?}");
        }
    });
}

#[test]
fn a_bias_beside_declared_noise_is_one_as_far_as_the_earths_azimuth_is_open() {
    accepted("rest-bias-250", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["gyro_bias"]);
        within(diagnosis, "gyro_bias", [1.2e-3, 0.0, 0.0], 1.3e-4);
    });
}

#[test]
fn a_unit_that_warms_up_follows_its_thermometer_and_not_time() {
    accepted("warm-up", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["gyro_bias", "gyro_bias_temperature"]);
        within(
            diagnosis,
            "gyro_bias_temperature",
            [2e-5, -1e-5, 1.5e-5],
            1e-6,
        );
    });
}

#[test]
fn spikes_at_rest_are_one_line_of_the_summary_and_change_neither_bias_nor_noise() {
    accepted("spikes-at-rest", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(count(diagnosis, "spikes"), 25);
        assert_eq!(kinds(diagnosis).len(), 26);
        assert!(says(diagnosis, "25 single readings of gyro_y"));
        // From the rows without the spikes: the means, and the scatter over the root of the row rate.
        let of_mean = [3.509e-4, -2.011e-4, 1.645e-4];
        let mut square = 0.0;
        for (axis, mean) in ["x", "y", "z"].iter().zip(of_mean) {
            let (value, _) = number(diagnosis, "gyro_bias", axis);
            square += (mean - value).powi(2);
        }
        // The part that is no bias is the Earth's rotation, within the uncertainty of 60 s of this noise.
        assert!((square.sqrt() - 7.292e-5).abs() < 4e-5, "{}", square.sqrt());
        for noise in &diagnosis.noise {
            let terms = noise.terms.as_ref().expect("noise in its terms");
            let walk = terms.angle_random_walk_rad_sqrt_s;
            assert!((walk.value - 1.02e-4).abs() < 4.0 * walk.std, "{walk:?}");
        }
    });
}

/// Returns a number of the registration, and true if it is supported.
fn registered(diagnosis: &Diagnosis, kind: &str, name: &str) -> (f64, f64, bool) {
    let entry = diagnosis
        .registration
        .iter()
        .find(|one| one.kind == kind)
        .unwrap_or_else(|| panic!("no {kind} in the registration"));
    let (value, std) =
        parameter(&entry.parameters, name).unwrap_or_else(|| panic!("{kind} without {name}"));
    (value, std, entry.supported)
}

/// Diagnoses it again with the written model: nothing remains.
fn matches_again(name: &str, anyway: bool) {
    let said = diagnosed(name, anyway);
    let Some(Ok(outcome)) = said.as_ref().map(of) else {
        return;
    };
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        return;
    };
    let folder = folder.join("outside").join(name);
    let recording = Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings::default();
    let file = folder.join("model.toml");
    let again = diagnose_under(&settings, &recording, &outcome.model, &file, &|_| {})
        .unwrap_or_else(|error| panic!("{error}"));
    let summary = &again.diagnosis.summary;
    assert_eq!(again.diagnosis.verdict, Verdict::Matches, "{summary:#?}");
}

#[test]
fn a_delay_against_attitudes_is_one_delay_and_nothing_else() {
    accepted("delay-att-0.008", false, |diagnosis| {
        assert_eq!(kinds(diagnosis), ["reference_delay"]);
        // Late gyros are equivalent to an early reference.
        let (late_s, std_s) = number(diagnosis, "reference_delay", "all");
        assert!(
            (late_s + 0.008).abs() < 3.0 * std_s && std_s < 1e-4,
            "{late_s} {std_s}"
        );
        let (_, _, is_supported) = registered(diagnosis, "gyro_scale", "x");
        assert!(!is_supported);
    });
    matches_again("delay-att-0.008", false);
}

#[test]
fn a_bias_against_attitudes_is_one_at_any_size() {
    for (name, bias) in [
        ("bias-0.0076", [2e-4, 2e-3, 7.6e-3]),
        ("bias-0.076", [2e-3, 2e-2, 7.6e-2]),
    ] {
        accepted(name, false, |diagnosis| {
            is_explained(diagnosis);
            assert_eq!(kinds(diagnosis), ["gyro_bias"]);
            within(diagnosis, "gyro_bias", bias, 1e-4);
        });
        matches_again(name, false);
    }
}

/// The filter's deviation from a continuous low pass, a quarter of a millisecond, is found, too.
#[test]
fn a_low_pass_against_attitudes_is_a_low_pass() {
    accepted("low-pass-attitude", false, |diagnosis| {
        assert_eq!(kinds(diagnosis), ["gyro_bandwidth", "reference_delay"]);
        for axis in ["x", "y", "z"] {
            let (pole_s, _) = number(diagnosis, "gyro_bandwidth", &format!("{axis}_pole_s"));
            assert!((pole_s - 0.033).abs() < 1e-4, "{pole_s}");
        }
        let (late_s, _) = number(diagnosis, "reference_delay", "all");
        assert!(late_s.abs() < 5e-4, "{late_s}");
    });
    matches_again("low-pass-attitude", false);
}

#[test]
fn a_doubled_rate_against_attitudes_is_refused() {
    refused("doubled-attitude", "all three read 2.00");
    accepted("doubled-attitude", true, |diagnosis| {
        assert!(count(diagnosis, "gyro_scale") >= 1);
    });
    // Its own model, without `anyway`.
    matches_again("doubled-attitude", true);
}

/// An outside analysis found a delay of 7.6 ms and a bias of (−1.3, −2.6, −3.4)e-3 rad/s.
#[test]
fn an_autopilots_own_attitude_shows_its_delay_and_a_bias() {
    accepted("autopilot-attitude", false, |diagnosis| {
        // Its filter has larger errors while it is moved by hand.
        assert_eq!(diagnosis.verdict, Verdict::PartlyExplained);
        assert!(says(diagnosis, "Residual correlates with the motion"));
        let mut named = kinds(diagnosis);
        named.retain(|kind| *kind != "lost_samples");
        assert_eq!(named, ["gyro_bias", "reference_delay"]);
        let (late_s, std_s) = number(diagnosis, "reference_delay", "all");
        assert!(
            (late_s - 7.6e-3).abs() < 5e-4 && std_s < 5e-4,
            "{late_s} {std_s}"
        );
        within(diagnosis, "gyro_bias", [-1.3e-3, -2.6e-3, -3.4e-3], 5e-4);
    });
}

/// One rotation of 360° by hand, attitudes before and after: three numbers, and the gyros' rates at rest.
#[test]
fn one_turn_between_two_attitudes_shows_a_bias_and_no_more() {
    const DEG: f64 = std::f64::consts::PI / 180.0;
    for name in ["two-attitudes-bias", "turn-before-after"] {
        accepted(name, false, |diagnosis| {
            assert_eq!(kinds(diagnosis), ["gyro_bias"], "{:?}", diagnosis.summary);
            within(
                diagnosis,
                "gyro_bias",
                [-0.600 * DEG, -0.370 * DEG, 0.059 * DEG],
                2e-4,
            );
            assert!(says(
                diagnosis,
                "as many parameters as the attitudes have numbers"
            ));
        });
        matches_again(name, false);
    }
}

#[test]
fn gyros_and_a_reference_of_two_motions_are_unusable_and_nothing_is_named() {
    accepted("unrelated", false, |diagnosis| {
        assert_eq!(diagnosis.verdict, Verdict::Unusable);
        assert!(says(diagnosis, "measure different motions"));
        assert!(diagnosis.effects.is_empty());
    });
}

/// The command writes no model, and removes that of an earlier run.
#[test]
fn of_two_motions_no_model_is_written() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        return;
    };
    let folder = folder.join("outside").join("unrelated");
    let out = tempfile::tempdir().expect("a folder");
    std::fs::write(out.path().join("model.toml"), "of an earlier run").expect("written");
    std::fs::write(out.path().join("diagnosis.json"), "{}").expect("written");
    let mut command = assert_cmd::Command::cargo_bin("rlg").expect("the command is built");
    command
        .args(["diagnose", "--quiet", "--model"])
        .arg(folder.join("model.toml"))
        .arg("--out")
        .arg(out.path())
        .arg(&folder)
        .assert()
        .success();
    assert!(!out.path().join("model.toml").exists());
    let written = std::fs::read_to_string(out.path().join("diagnosis.json")).expect("read");
    assert!(written.contains("measure different motions"), "{written}");
}

#[test]
fn rates_sampled_at_instants_are_one_cause() {
    accepted("instant-25hz", false, |diagnosis| {
        is_explained(diagnosis);
        assert!(says(diagnosis, "Common cause"));
        assert!(says(diagnosis, "--sampling instant"));
    });
}

#[test]
fn half_a_second_that_a_recorder_lost_is_put_back() {
    accepted("lost-block", false, |diagnosis| {
        is_explained(diagnosis);
        assert!(
            says(
                diagnosis,
                "50 rows of 100.000000 Hz (0.5000 s) of the gyros are missing before row 1500 (15.0000 s)"
            ),
            "{:#?}",
            diagnosis.summary
        );
        assert_eq!(kinds(diagnosis), ["lost_samples"]);
        // As simulated: 0.3 °/√h, and 0.3 mrad in every attitude.
        for noise in &diagnosis.noise {
            let walk = noise.angle_random_walk_rad_sqrt_s / 8.73e-5;
            assert!((0.8..1.25).contains(&walk), "{walk}");
            let angle = noise.angle_noise_rad / 3e-4;
            assert!((0.9..1.1).contains(&angle), "{angle}");
        }
    });
    matches_again("lost-block", false);
}

#[test]
fn an_attitude_computed_from_the_gyros_shows_its_pull_and_nothing_else() {
    accepted("ahrs-reference", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["reference_pull"]);
        let (pull, std) = number(diagnosis, "reference_pull", "all");
        assert!((pull - 1.0).abs() < 3.0 * std && std < 1e-3, "{pull} {std}");
        let question = "An attitude computed from these gyros cannot";
        assert!(diagnosis.effects[0].what_was_left_out.contains(question));
    });
    matches_again("ahrs-reference", false);
}

/// Without the pull in the catalogue it has no name, and is still not noise.
#[test]
fn a_pull_that_no_kind_explains_is_in_step_with_the_motion() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        return;
    };
    let folder = folder.join("outside").join("ahrs-reference");
    let file = folder.join("model.toml");
    let model = Model::read(&file).unwrap_or_else(|error| panic!("{error}"));
    let recording = Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings {
        left_out: &["reference_pull"],
        ..Settings::default()
    };
    let said = diagnose_under(&settings, &recording, &model, &file, &|_| {})
        .unwrap_or_else(|error| panic!("{error}"));
    assert_ne!(said.diagnosis.verdict, Verdict::Matches);
    assert_ne!(said.diagnosis.verdict, Verdict::Explained);
    assert!(says(&said.diagnosis, "Residual correlates with the motion"));
}

#[test]
fn gyros_at_their_stops_are_no_fault_of_the_reference() {
    accepted("clip250", false, |diagnosis| {
        is_explained(diagnosis);
        assert!(says(diagnosis, "gyro_x is stuck in 300 rows (5 places)"));
        assert!(says(diagnosis, "244 rows of gyro_y (6 places)"));
        assert_eq!(count(diagnosis, "reference_dropout"), 0);
    });
    matches_again("clip250", false);
}

#[test]
fn a_gyro_that_forgets_a_constant_rate_is_a_high_pass_and_nothing_else() {
    accepted("auto-zero-3s", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["gyro_high_pass"]);
        let (time_s, std_s) = number(diagnosis, "gyro_high_pass", "z");
        assert!(
            (time_s - 3.0).abs() < 3.0 * std_s && std_s < 0.01,
            "{time_s} {std_s}"
        );
    });
    matches_again("auto-zero-3s", false);
}

#[test]
fn a_vibration_of_the_gyros_alone_is_a_line_with_its_amplitudes_and_nothing_else() {
    accepted("line-on-gyros", false, |diagnosis| {
        is_explained(diagnosis);
        assert_eq!(kinds(diagnosis), ["unlisted"]);
        assert!(says(diagnosis, "Absent from the reference."));
        let (hz, std_hz) = number(diagnosis, "unlisted", "frequency_hz");
        assert!(
            (hz - 6.7).abs() < 4.0 * std_hz && std_hz < 1e-3,
            "{hz} {std_hz}"
        );
        for (axis, truth) in [("x", 0.30), ("y", 0.12), ("z", 0.05)] {
            let (size, std) = number(diagnosis, "unlisted", axis);
            assert!(
                (size - truth).abs() < 4.0 * std && std < 2e-3,
                "{axis} {size} {std}"
            );
        }
    });
    matches_again("line-on-gyros", false);
}

/// Made with the Earth's rate at latitude 48° in the body at the start, 12 °/h on gyro x and 300 ppm on gyro z.
#[test]
fn on_axes_that_do_not_turn_the_earths_rate_is_no_scale_and_no_turn() {
    accepted("table-earth-attitude", false, |diagnosis| {
        const DEG_H: f64 = 4.848e-6;
        is_explained(diagnosis);
        assert_eq!(
            kinds(diagnosis),
            ["earth_rate", "gyro_bias", "gyro_scale"],
            "{:#?}",
            diagnosis.summary
        );
        let near = |kind: &str, axis: &str, truth: f64, least: f64| {
            let (value, std) = number(diagnosis, kind, axis);
            assert!(
                (value - truth).abs() < (4.0 * std).max(least),
                "{kind} {axis} {value:e} {std:e}"
            );
        };
        // The folder's page gives them to 0.1 °/h.
        for (axis, deg_h) in [("x", 8.7), ("y", -5.0), ("z", 11.2)] {
            near("earth_rate", axis, deg_h * DEG_H, 0.1 * DEG_H);
        }
        near("gyro_bias", "x", 12.0 * DEG_H, 0.1 * DEG_H);
        near("gyro_bias", "z", 0.0, 0.1 * DEG_H);
        near("gyro_scale", "z", 3e-4, 0.0);
        for axis in ["x", "y"] {
            assert_eq!(number(diagnosis, "gyro_scale", axis).0, 0.0);
        }
    });
    matches_again("table-earth-attitude", false);
}
