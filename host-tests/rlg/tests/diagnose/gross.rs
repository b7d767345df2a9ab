//! Gross and small errors with undeclared noise: a foreign recording.

use std::path::Path;

use super::support::{concealed, kinds, number};
use rlg::diagnose::result::{Diagnosis, Verdict};
use rlg::diagnose::{Settings, diagnose_under};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;

/// White noise of the reference's rate \[rad/√s\]: a hundred times the gyros'.
const REFERENCE_RAD_SQRT_S: f64 = 1e-3;

/// A minute of three oscillations, the third of which is replaced by rest for a zero of `axes`.
fn scenario(axes: [f64; 3], effect: &str) -> String {
    let rates = axes.map(|axis| 0.5 * axis);
    format!(
        "format = 1\nname = \"stranger\"\nrate_hz = 200.0\n\
         [site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\nearth_rate = false\n\
         [gyro]\noutput = \"increment\"\npulse_weight_rad = [1e-9, 1e-9, 1e-9]\n\
         bias_rad_s = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
         angle_random_walk_rad_sqrt_s = [1e-5, 1e-5, 1e-5]\n\
         installation_rad = {{ xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }}\n\
         [reference]\nangle_noise_rad = 0.0\nangle_random_walk_rad_sqrt_s = {REFERENCE_RAD_SQRT_S}\n\
         weight_rad = 1e-9\n\
         [[motion]]\nkind = \"tumble\"\nrate_rad_s = {rates:?}\nduration_s = 40.0\n\
         frequency_hz = [0.7, 1.3, 1.9]\nphase_rad = [0.0, 1.0, 2.0]\nramp_s = 1.0\n\
         [[motion]]\nkind = \"tumble\"\nrate_rad_s = {rates:?}\nduration_s = 30.0\n\
         frequency_hz = [3.1, 0.3, 4.3]\nphase_rad = [0.5, 0.0, 1.0]\nramp_s = 1.0\n{effect}"
    )
}

/// Diagnoses it with a model that declares no noise.
fn diagnosed(axes: [f64; 3], effect: &str) -> Diagnosis {
    let scenario = Scenario::parse(&scenario(axes, effect), Path::new("stranger.toml"));
    let simulation = simulate(&scenario.expect("a scenario"), 11, |_| {});
    let mut model = simulation.model;
    model.reference = None;
    model.gyro.angle_random_walk_rad_sqrt_s = None;
    let file = Path::new("model.toml");
    let settings = Settings::default();
    let outcome = diagnose_under(&settings, &simulation.recording, &model, file, &|_| {});
    outcome.expect("a recording").diagnosis
}

/// Checks for one effect of the class of `kind` with `truth` within its standard deviations, and nothing else.
fn is_alone(diagnosis: &Diagnosis, kind: &str, truth: &[(&str, f64)]) {
    assert_eq!(diagnosis.effects.len(), 1, "{:#?}", diagnosis.summary);
    let effect = &diagnosis.effects[0];
    let in_class =
        effect.kind == kind || effect.indistinguishable_from.iter().any(|one| one == kind);
    assert!(in_class, "{:#?}", diagnosis.summary);
    // Of many numbers one exceeds three deviations by chance; their mean square is within three of its own.
    let pull = |(name, value): &(&str, f64)| {
        let (estimate, std) = number(effect, name);
        (estimate - value) / std
    };
    let count = truth.len() as f64;
    let mean_square = truth.iter().map(|one| pull(one).powi(2)).sum::<f64>() / count;
    let most = 1.0 + 3.0 * (2.0 / count).sqrt();
    assert!(
        mean_square < most,
        "{mean_square} of {truth:?}: {:#?}",
        effect.parameters
    );
}

#[test]
fn nothing_is_found_where_nothing_is() {
    for axes in [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0]] {
        let diagnosis = diagnosed(axes, "");
        assert_eq!(
            diagnosis.verdict,
            Verdict::Matches,
            "{axes:?} {:#?}",
            kinds(&diagnosis)
        );
    }
}

#[test]
fn a_short_and_a_long_delay_are_found_alone() {
    // Of the class, the early reference stands for three gyros that are late by the same time.
    for delay_s in [3e-3, 0.08] {
        let delays = ["x", "y", "z"].map(|axis| (axis, delay_s));
        let diagnosis = diagnosed([1.0; 3], &concealed("gyro_delay", &delays));
        is_alone(&diagnosis, "gyro_delay", &[("all", -delay_s)]);
    }
}

#[test]
fn a_gross_scale_tilts_and_a_bias_are_found_alone() {
    let scales = [("x", 0.3), ("y", 0.3), ("z", 0.3)];
    let diagnosis = diagnosed([1.0; 3], &concealed("gyro_scale", &scales));
    is_alone(&diagnosis, "gyro_scale", &scales);
    let tilts = [
        ("xy", 0.02),
        ("xz", 0.0),
        ("yx", 0.0),
        ("yz", 0.0),
        ("zx", 0.0),
        ("zy", -0.01),
    ];
    let diagnosis = diagnosed([1.0; 3], &concealed("installation", &tilts));
    is_alone(&diagnosis, "installation", &tilts);
    let biases = [("x", 0.05), ("y", -0.02), ("z", 0.01)];
    let diagnosis = diagnosed([1.0; 3], &concealed("gyro_bias", &biases));
    is_alone(&diagnosis, "gyro_bias", &biases);
}

#[test]
fn a_reference_turned_by_degrees_is_found_alone_and_beside_a_scale_error() {
    let turned = [("x", 0.1), ("y", -0.08), ("z", 0.12)];
    let diagnosis = diagnosed([1.0; 3], &concealed("reference_misalignment", &turned));
    is_alone(&diagnosis, "reference_misalignment", &turned);
    let scale = [("x", 0.01)];
    let both = concealed("reference_misalignment", &turned) + &concealed("gyro_scale", &scale);
    let diagnosis = diagnosed([1.0; 3], &both);
    let mut found = kinds(&diagnosis);
    found.sort_unstable();
    assert_eq!(found, ["gyro_scale", "reference_misalignment"]);
    for effect in &diagnosis.effects {
        let truth = if effect.kind == "gyro_scale" {
            &scale[..]
        } else {
            &turned
        };
        for (name, value) in truth {
            let (estimate, std) = number(effect, name);
            assert!(
                (estimate - value).abs() < 4.0 * std,
                "{} {name}",
                effect.kind
            );
        }
    }
}

#[test]
fn a_gross_tilt_of_one_gyro_is_no_turned_reference() {
    let tilts = [
        ("xy", 0.1),
        ("xz", 0.0),
        ("yx", 0.0),
        ("yz", 0.0),
        ("zx", 0.0),
        ("zy", 0.0),
    ];
    let diagnosis = diagnosed([1.0; 3], &concealed("installation", &tilts));
    is_alone(&diagnosis, "installation", &tilts);
}
