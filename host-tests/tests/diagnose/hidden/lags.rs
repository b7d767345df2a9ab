//! Physics that follows what it goes with only after a while: no product of channels, row by row, is like it. It is put
//! into a recording's increments here, because the simulator knows no such effect.

use super::case::{Case, WITHIN, slew, still, text, vibration};
use rlg::diagnose::result::{EffectEntry, ParameterEntry};
use rlg::model::Model;
use rlg::recording::{Quantity, Recording};

fn slews_and_a_swell() -> Vec<String> {
    vec![
        still(4.0),
        slew("x", 1.0),
        slew("y", -1.0),
        slew("z", 1.0),
        vibration("swell", [0.3, 2.0], 0.3, 16.0),
        still(3.0),
        vibration("swell again", [0.3, 2.0], 0.3, 8.0),
    ]
}

/// An instrument of fine increments at 400 Hz: what is added behind a coarse pulse would not be rounded with the rest.
fn made(seed: u64) -> (Recording, Model) {
    let table = include_str!("../table_programme.toml");
    let instrument = table.split("[[motion]]").next().expect("an instrument");
    Case::simulated(
        &format!("{instrument}{}", slews_and_a_swell().concat()),
        seed,
    )
}

/// Gyro y senses `coefficient` times the product of the case's rates about `of` behind a lag of `constant_s` as well.
fn with_lag(
    (mut recording, model): (Recording, Model),
    coefficient: f64,
    of: &[&str],
    constant_s: f64,
) -> (Recording, Model) {
    let rate_hz = 400.0;
    let rates = of.iter().map(|axis| -> Vec<f64> {
        let turned = recording.channel(&Quantity::ReferenceIncrement, axis);
        let (_, turned) = turned.expect("a reference");
        turned.values.iter().map(|angle| angle * rate_hz).collect()
    });
    let product = rates
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a * b).collect())
        .expect("at least one axis");
    let nearer = 1.0 - (-1.0 / (rate_hz * constant_s)).exp();
    let mut behind = 0.0;
    let added = product.iter().map(|value| {
        behind += (value - behind) * nearer;
        coefficient * behind / rate_hz
    });
    let gyro_y = recording
        .tables
        .iter_mut()
        .flat_map(|table| &mut table.channels)
        .find(|channel| {
            channel.quantity == Quantity::GyroIncrement && channel.axis.as_deref() == Some("y")
        })
        .expect("gyro y");
    let values = gyro_y.values.iter_mut().zip(added);
    values.for_each(|(value, more)| *value += more);
    (recording, model)
}

/// The product, the time constant and the coefficient of the only finding, which is a lag on gyro y.
fn lag_of(found: &EffectEntry) -> (String, f64, f64, f64) {
    assert_eq!(text(found, "axis"), Some("y"));
    let expression = text(found, "expression").expect("an expression");
    let inside = expression
        .strip_prefix("lag(")
        .and_then(|rest| rest.strip_suffix(')'));
    let (product, constant) = inside
        .and_then(|inside| inside.rsplit_once(','))
        .expect(expression);
    let coefficient = found
        .parameters
        .iter()
        .find_map(|parameter| match parameter {
            ParameterEntry::Number {
                name, value, std, ..
            } if name == "coefficient" => Some((*value, *std)),
            _ => None,
        });
    let (value, std) = coefficient.expect("a coefficient");
    (
        product.to_string(),
        constant.parse().expect("a time"),
        value,
        std,
    )
}

fn is_found(case: &Case, product: &str, constant_s: f64, coefficient: f64) {
    let kinds = case.kinds();
    assert_eq!(kinds, ["unlisted"], "{:#?}", case.said.summary);
    let (found, found_s, value, std) = lag_of(case.found("unlisted"));
    assert_eq!(found, product);
    // At this strength a time constant is known to a tenth, and the size goes with it.
    assert!((found_s / constant_s).ln().abs() < 0.2, "{found_s} s");
    let off = (value - coefficient).abs();
    assert!(
        off < WITHIN * std + 0.1 * coefficient.abs(),
        "{value:e} ± {std:e}"
    );
    assert!(case.held_out_gain() > 0.0);
}

#[test]
fn a_gyro_that_follows_another_axis_behind_a_lag_is_found_with_its_time_constant() {
    let made = made(61);
    let case = Case::diagnosed(with_lag(made, 6e-5, &["x"], 0.5));
    is_found(&case, "omega_x", 0.5, 6e-5);
}

#[test]
fn a_product_of_rates_behind_a_lag_is_found_with_its_time_constant() {
    let made = made(62);
    let case = Case::diagnosed(with_lag(made, 3e-4, &["x", "z"], 0.25));
    is_found(&case, "omega_x*omega_z", 0.25, 3e-4);
}
