//! Models.

use std::fs;

use super::bench::{Bench, READERS_OF_MODELS, model, model_with, params};

#[test]
fn a_model_that_is_not_there() {
    let bench = Bench::new();
    fs::remove_file(bench.model()).expect("removed");
    bench.is_refused(READERS_OF_MODELS, &["model.toml", "does not exist"]);
}

#[test]
fn an_empty_model() {
    let bench = Bench::new();
    fs::write(bench.model(), "\n").expect("a file");
    bench.is_refused(READERS_OF_MODELS, &["model.toml", "is empty"]);
}

#[test]
fn a_model_of_another_format() {
    model(
        "format = 1",
        "format = 7",
        &["model.toml, format", "found 7", "format = 1"],
    );
}

#[test]
fn a_pulse_weight_that_is_negative_zero_or_nan() {
    for weight in ["-2e-6", "0.0", "nan", "1.0"] {
        let parts = [
            "model.toml, gyro.pulse_weight_rad.y",
            "positive number",
            "rad",
        ];
        model(
            "[2e-6, 2e-6, 2e-6]",
            &format!("[2e-6, {weight}, 2e-6]"),
            &parts,
        );
    }
}

#[test]
fn no_pulse_weight_for_gyros_that_count() {
    let bench = model_with("pulse_weight_rad = [2e-6, 2e-6, 2e-6]\n", "");
    bench.is_refused(&[params], &["model.toml", "pulse_weight_rad"]);
}

#[test]
fn two_or_four_entries_where_three_belong() {
    model(
        "[2e-6, 2e-6, 2e-6]",
        "[2e-6, 2e-6]",
        &["line 6", "2 numbers", "three"],
    );
    model(
        "[2e-6, 2e-6, 2e-6]",
        "[2e-6, 2e-6, 2e-6, 2e-6]",
        &["line 6", "4 numbers", "three"],
    );
}

#[test]
fn values_no_gyro_has() {
    model(
        "scale_error = [1e-5",
        "scale_error = [0.5",
        &["gyro.scale_error.x", "found 0.5"],
    );
    model(
        "bias_rad_s = [1e-6",
        "bias_rad_s = [-3.0",
        &["gyro.bias_rad_s.x", "found -3"],
    );
    model(
        "xy = 1e-4",
        "xy = 0.2",
        &["gyro.installation_rad.xy", "found 0.2"],
    );
    model(
        "[2e-7, 2e-7, 2e-7]",
        "[2e-7, -2e-7, 2e-7]",
        &["dither.pickoff_noise_rad.y", "at least 0"],
    );
}

#[test]
fn a_drift_that_is_negative_infinite_or_not_for_three_gyros() {
    for (key, unit) in [
        ("rate_random_walk_rad_s_sqrt_s", "rad/s/sqrt(s)"),
        ("flicker_rad_s", "rad/s"),
    ] {
        let declared = |values: &str, parts: &[&str]| {
            let lines = format!("[gyro]\n{key} = {values}\n");
            model("[gyro]\n", &lines, parts);
        };
        let at = format!("model.toml, gyro.{key}.y");
        declared("[0.0, -1e-9, 0.0]", &[&at, "found -", "at least 0", unit]);
        declared("[0.0, inf, 0.0]", &[&at, "found inf", unit]);
        declared("[0.0, nan, 0.0]", &[&at, "found NaN", unit]);
        declared("[0.0, 0.0]", &["line 6", "2 numbers", "three"]);
        declared("0.0", &["line 6"]);
    }
}

#[test]
fn an_installation_angle_of_no_pair() {
    model(
        "xy = 1e-4",
        "xx = 1e-4",
        &["gyro.installation_rad.xx", "xy, xz"],
    );
}

#[test]
fn a_kind_the_catalogue_does_not_have() {
    model(
        "\"axis_flexure\"",
        "\"axis_flexture\"",
        &["effect 0, kind", "\"axis_flexture\"", "\"axis_flexure\""],
    );
}

#[test]
fn a_parameter_of_another_kind() {
    model(
        "xy = 7e-8",
        "xx = 7e-8",
        &["effect 0 (axis_flexure), xx", "xy, xz, yx"],
    );
    model(
        "xy = 7e-8",
        "xy = \"much\"",
        &["effect 0 (axis_flexure), xy", "\"much\"", "s^2"],
    );
    model(
        "xy = 7e-8",
        "xy = inf",
        &["effect 0 (axis_flexure), xy", "finite"],
    );
}

#[test]
fn a_compensation_of_flexure_that_is_none() {
    let effect = "effect 0 (axis_flexure)";
    for (line, key, expected) in [
        ("response = \"stiff\"", "response", "\"mode\" or \"static\""),
        ("response = 1", "response", "\"mode\" or \"static\""),
        ("damping = 0.001", "damping", "0.002 to 0.99"),
        ("damping = 1.0", "damping", "0.002 to 0.99"),
        ("damping = \"low\"", "damping", "0.002 to 0.99"),
    ] {
        let (_, value) = line.split_once(" = ").expect("a value");
        model(
            "xy = 7e-8",
            &format!("xy = 7e-8\n{line}"),
            &[&format!("{effect}, {key}"), value, expected],
        );
    }
}

#[test]
fn a_parameter_that_is_missing() {
    let step = "kind = \"gyro_bias_step\"\naxis = \"x\"\nsize = 1e-6\n";
    model(
        "kind = \"axis_flexure\"\nxy = 7e-8\n",
        step,
        &["effect 0 (gyro_bias_step), time_s", "missing"],
    );
}

#[test]
fn a_model_beyond_the_chains_formats() {
    let bench = model_with("xy = 7e-8", "xy = 7e-5");
    bench.is_refused(&[params], &["model.toml", "flexure_s2"]);
}
