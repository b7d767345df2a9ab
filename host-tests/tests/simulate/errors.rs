//! Scenarios and instruments that cannot be used: errors that name the line.

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
