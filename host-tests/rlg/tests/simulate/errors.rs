//! Unusable scenarios and instruments: errors that name the line.

use super::support::*;
use rlg::simulate::scenario::Scenario;
use std::path::Path;

#[test]
fn misspelt_keys_and_absent_physics_are_errors_that_name_the_line() {
    let still = "[[motion]]\nkind = \"still\"\nduration_s = 1.0\n";
    let top = PERFECT.lines().count();
    for (added, line, part) in [
        (
            "[reference]\nangle_nose_rad = 1e-7\n",
            top + 2,
            "angle_nose_rad",
        ),
        (
            "[[motion]]\nkind = \"coning\"\naxis = \"x\"\nfrequency = 3.0\n",
            top + 1,
            "duration_s",
        ),
        (
            "[[motion]]\nduration_s = 1.0\nkind = \"still\"\ndepth = 3.0\n",
            top + 4,
            "depth",
        ),
        (
            "[[effect]]\nkind = \"lock_on\"\nx = 1e-4\n",
            top + 2,
            "lock_in",
        ),
        (
            "[[effect]]\nkind = \"axis_flexure\"\nxx = 1e-7\n",
            top + 3,
            "xx",
        ),
        (
            "[[effect]]\nkind = \"gyro_bias\"\nx = \"much\"\n",
            top + 3,
            "much",
        ),
        (
            "[[effect]]\nkind = \"gyro_delay\"\nx = 1.0\n",
            top + 3,
            "too long",
        ),
    ] {
        let text = PERFECT.to_owned() + added + still;
        let error = Scenario::parse(&text, Path::new("test.toml")).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("test.toml")
                && message.contains(&format!("line {line}:"))
                && message.contains(part),
            "{added} gave: {message}"
        );
    }
    let wrong = PERFECT.replace("1e-13, 1e-13, 1e-13", "1e-6, -1e-6, 1e-6") + still;
    let error = Scenario::parse(&wrong, Path::new("test.toml")).unwrap_err();
    assert!(
        error.to_string().contains("pulse_weight_rad: line 6:"),
        "{error}"
    );
}

/// Returns the line of `text`, from 1.
fn line_of(text: &str, part: &str) -> usize {
    1 + text[..text.find(part).unwrap()].matches('\n').count()
}

#[test]
fn each_error_names_the_line_and_what_was_expected() {
    let counter = PERFECT
        .replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6")
        .replace("[gyro]", "[gyro]\ncounter_bits = 9");
    let narrow = counter.replace("counter_bits = 9", "counter_bits = 11") + DITHER;
    let still = "[[motion]]\nkind = \"still\"\nduration_s = 1.0\n";
    let cone = |frequency_hz: f64, extra: &str| {
        format!(
            "[[motion]]\nkind = \"coning\"\naxis = \"x\"\nfrequency_hz = {frequency_hz}\n\
             angle_rad = 0.01\nramp_s = 0.1\nduration_s = 1.0\n{extra}"
        )
    };
    let psd = |table: &str| {
        format!(
            "[[motion]]\nkind = \"random_vibration\"\nramp_s = 0.1\nduration_s = 1.0\n\
             linear_psd_m2_s4_hz = {{ x = {table} }}\n"
        )
    };
    let slew = "[[motion]]\nkind = \"slew\"\naxis = \"z\"\nangle_rad = 40.0\nduration_s = 10.0\n";
    for (text, at, words) in [
        // amplitude beyond the counter: 485 pulses a row, and a counter of 9 bits
        (
            counter + DITHER + still,
            "amplitude_rad",
            "is beyond the counter",
        ),
        // 11 bits hold the dither but not an additional 8.75 rad/s
        (
            narrow + slew,
            "kind = \"slew\"",
            "is a motion beyond the counter",
        ),
        // Nyquist
        (
            PERFECT.to_owned() + &DITHER.replace("430.1", "2000.0") + still,
            "frequency_hz",
            "less than 2000 Hz",
        ),
        (
            PERFECT.to_owned() + &cone(2500.0, ""),
            "frequency_hz",
            "less than 2000 Hz",
        ),
        (
            PERFECT.to_owned() + &psd("[[20.0, 0.1], [2200.0, 0.1]]"),
            "linear_psd_m2_s4_hz",
            "less than 2000 Hz",
        ),
        // a wrong unit, by its key and by its size
        (
            PERFECT.to_owned() + &cone(15.0, "").replace("angle_rad = 0.01", "angle_deg = 0.6"),
            "angle_deg",
            "expected `angle_rad`",
        ),
        (
            PERFECT.to_owned() + &DITHER.replace("7.3e-4", "150.0") + still,
            "amplitude_rad",
            "0 to 0.1 rad",
        ),
        (
            PERFECT.to_owned() + "[site]\nlatitude_rad = 34.0\ngravity_m_s2 = 9.8\n" + still,
            "latitude_rad",
            "-1.571 to 1.571 rad",
        ),
        // unknown keys
        (
            PERFECT.to_owned() + &DITHER.replace("amplitude_spread", "amplitude_sprad") + still,
            "amplitude_sprad",
            "expected `amplitude_spread`",
        ),
        (
            PERFECT.to_owned() + &cone(15.0, "depth = 1.0\n"),
            "depth",
            "is an unknown key here",
        ),
        // invalid tables
        (
            PERFECT.to_owned() + &psd("[[20.0, 0.1]]"),
            "linear_psd_m2_s4_hz",
            "at least two points",
        ),
        (
            PERFECT.to_owned() + &psd("[[20.0, 0.1], [10.0, 0.1]]"),
            "linear_psd_m2_s4_hz",
            "do not rise",
        ),
        // effects without anything to act on
        (
            PERFECT.to_owned() + still + "[[effect]]\nkind = \"dither_gain\"\nx = 1e-3\n",
            "kind = \"dither_gain\"",
            "a scenario with [dither]",
        ),
        (
            PERFECT.to_owned() + still + "[[effect]]\nkind = \"gyro_bias_temperature\"\nx = 1e-6\n",
            "kind = \"gyro_bias_temperature\"",
            "a scenario with [thermal]",
        ),
        (
            PERFECT.to_owned()
                + still
                + "[[effect]]\nkind = \"stuck_channel\"\nchannel = \"gyro_w\"\nstart_s = 0.1\nend_s = 0.2\n",
            "channel = ",
            "gyro_x, gyro_y, gyro_z",
        ),
        (
            PERFECT.to_owned()
                + still
                + "[[effect]]\nkind = \"unlisted\"\naxis = \"x\"\ncoefficient = 1.0\nexpression = \"omega_x*speed\"\n",
            "expression = ",
            "found speed",
        ),
        (
            PERFECT.replace("[gyro]", "[gyro]\noutput = \"increment\"") + DITHER + still,
            "output",
            "or no [dither]",
        ),
    ] {
        let error = Scenario::parse(&text, Path::new("test.toml"))
            .unwrap_err()
            .to_string();
        let line = format!("line {}:", line_of(&text, at));
        assert!(
            error.starts_with("test.toml") && error.contains(&line) && error.contains(words),
            "expected {line} and {words}, got: {error}"
        );
    }
}

#[test]
fn instrument_in_a_file_of_its_own_serves_several_scenarios_and_errors_name_that_file() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let gyro = PERFECT.lines().skip_while(|line| *line != "[gyro]");
    let gyro = gyro.collect::<Vec<_>>().join("\n") + "\n";
    let effect = "[[effect]]\nkind = \"gyro_bias\"\nconcealed = false\nx = 1e-6\n";
    let instrument = format!("format = 1\n{gyro}{DITHER}{effect}");
    write("triad.toml", &instrument);
    let scenario = "format = 1\nname = \"short\"\nrate_hz = 4000.0\ninstrument = \"triad.toml\"\n\
                    [[motion]]\nkind = \"still\"\nduration_s = 0.5\n";
    let read = |text: &str| Scenario::read(write("scenario.toml", text));
    let good = read(scenario).unwrap();
    assert!(good.dither.is_some() && good.known_effects.len() == 1);

    // the error is in the instrument's file
    write("triad.toml", &instrument.replace("392.6", "3000.0"));
    let error = read(scenario).unwrap_err();
    assert!(error.file.ends_with("triad.toml"), "{error}");
    let line = format!("line {}:", line_of(&instrument, "frequency_hz"));
    assert!(error.to_string().contains(&line), "{error}");

    // keys of the scenario are refused in the instrument, and no key occurs twice
    write(
        "triad.toml",
        &(instrument.clone() + "[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\n"),
    );
    let error = read(scenario).unwrap_err().to_string();
    assert!(
        error.contains("site") && error.contains("belongs to a scenario"),
        "{error}"
    );
    write("triad.toml", &instrument);
    let error = read(&(scenario.to_owned() + DITHER))
        .unwrap_err()
        .to_string();
    assert!(error.contains("stands in the instrument too"), "{error}");
    let error = read(&scenario.replace("triad", "none"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("none.toml: does not exist"), "{error}");
}
