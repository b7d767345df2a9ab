//! A model is read back as it was written, every f64 bit for bit, and the same bytes twice.

use std::collections::BTreeMap;

use proptest::prelude::*;
use rlg::model::catalogue::{CATALOGUE, Kind, Value};
use rlg::model::{
    Accelerometer, Dither, EffectValue, Gyro, Installation, Model, ModelEffect, MotionSource,
    Reference, Response,
};

fn model(numbers: [f64; 3], effects: Vec<ModelEffect>) -> Model {
    Model {
        motion: MotionSource::Static,
        earth_rate_in_reference: true,
        gyro: Gyro {
            pulse_weight_rad: numbers.map(|v| v.abs() * 1e-6 + 1e-7),
            bias_rad_s: numbers.map(|v| v * 1e-5),
            scale_error: numbers.map(|v| v * 1e-5),
            angle_random_walk_rad_sqrt_s: Some(numbers.map(|v| v.abs() * 1e-7)),
            rate_random_walk_rad_s_sqrt_s: Some(numbers.map(|v| v.abs() * 1e-10)),
            flicker_rad_s: Some(numbers.map(|v| v.abs() * 1e-8)),
            installation_rad: Installation {
                xy: numbers[0] * 1e-3,
                zy: numbers[1] * 1e-3,
                ..Installation::default()
            },
        },
        dither: Some(Dither {
            pickoff_gain: numbers.map(|v| 1.0 + v * 1e-2),
            pickoff_noise_rad: [2e-7; 3],
        }),
        reference: Some(Reference {
            angle_noise_rad: Some(2e-7),
            angle_random_walk_rad_sqrt_s: None,
        }),
        accelerometer: Some(Accelerometer {
            bias_m_s2: numbers.map(|v| v * 1e-3),
            scale_error: [0.0; 3],
            noise_m_s2_sqrt_hz: [4e-5, 4e-5, 6e-5],
        }),
        effects,
    }
}

/// Makes an effect of every kind of the catalogue with all its parameters.
fn every_kind(number: f64) -> Vec<ModelEffect> {
    let effect = |kind: &rlg::model::catalogue::Kind| {
        let mut parameters = BTreeMap::new();
        for group in kind.groups.iter().chain(kind.compensation) {
            for name in group.names {
                let value = match group.value {
                    Value::Axis => EffectValue::Text("y".to_owned()),
                    Value::Channel => EffectValue::Text("gyro_x".to_owned()),
                    Value::Recording => EffectValue::Text("bench-17".to_owned()),
                    Value::Number => EffectValue::Number(number),
                    Value::Positive | Value::NotNegative => EffectValue::Number(number.abs() + 1.0),
                    Value::OneOf(words) => EffectValue::Text(words[words.len() - 1].to_owned()),
                    Value::Between([low, high], _) => {
                        EffectValue::Number(low + (high - low) * number.abs().min(1.0))
                    }
                    Value::Remark => EffectValue::Text("xy - xz = 0".to_owned()),
                };
                parameters.insert((*name).to_owned(), value);
            }
        }
        ModelEffect {
            kind: kind.name.to_owned(),
            parameters,
        }
    };
    CATALOGUE.iter().map(effect).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_number_comes_back_bit_for_bit(x in -1.0..1.0_f64, y in -1.0..1.0_f64, tiny in -1e-12..1e-12_f64) {
        let original = model([x, y, tiny], every_kind(x * 1e-7));
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("model.toml");
        original.write(&path).unwrap_or_else(|error| panic!("{error}"));
        let (back, warnings) =
            Model::read_with_warnings(&path).unwrap_or_else(|error| panic!("{error}"));
        prop_assert!(warnings.is_empty());
        prop_assert_eq!(back.to_toml(), original.to_toml());
        prop_assert_eq!(back, original);
    }
}

#[test]
fn drift_that_is_declared_as_zero_is_not_drift_that_is_not_declared() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    let walk = "rate_random_walk_rad_s_sqrt_s = [0.0, 0.0, 1e-10]\n";
    let flicker = "flicker_rad_s = [2e-9, 0.0, 0.0]\n";
    for (walks, flickers) in [(true, true), (true, false), (false, true), (false, false)] {
        let lines = [
            if walks { walk } else { "" },
            if flickers { flicker } else { "" },
        ];
        let text = format!("format = 1\n[gyro]\n{}", lines.concat());
        std::fs::write(&path, text).expect("a file");
        let (model, warnings) =
            Model::read_with_warnings(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(warnings.is_empty(), "{warnings:?}");
        let gyro = &model.gyro;
        let declared = walks.then_some([0.0, 0.0, 1e-10]);
        assert_eq!(gyro.rate_random_walk_rad_s_sqrt_s, declared);
        assert_eq!(gyro.flicker_rad_s, flickers.then_some([2e-9, 0.0, 0.0]));
        model.write(&path).unwrap_or_else(|error| panic!("{error}"));
        let back = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back, model);
    }
}

#[test]
fn a_catalogue_kind_names_each_parameter_once() {
    for (index, kind) in CATALOGUE.iter().enumerate() {
        let names: Vec<_> = kind.parameter_names().collect();
        for (position, name) in names.iter().enumerate() {
            assert!(!names[..position].contains(name), "{}: {name}", kind.name);
        }
        assert!(
            CATALOGUE[..index]
                .iter()
                .all(|earlier| earlier.name != kind.name),
            "{}",
            kind.name
        );
    }
}

#[test]
fn a_key_that_is_not_known_is_passed_over_with_a_warning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    let text =
        "format = 1\nauthor = \"me\"\n[gyro]\npulse_weight_rad = [1e-6, 1e-6, 1e-6]\ncolour = 3\n";
    std::fs::write(&path, text).expect("a file");
    let (model, warnings) =
        Model::read_with_warnings(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(model.gyro.bias_rad_s, [0.0; 3]);
    assert_eq!(warnings.len(), 2);
    assert!(
        warnings[0].contains("`author`") && warnings[1].contains("`gyro.colour`"),
        "{warnings:?}"
    );
}

#[test]
fn accelerometer_noise_is_one_number_or_three_and_only_counts_need_a_pulse_weight() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    for (written, expected) in [
        ("noise_m_s2_sqrt_hz = 2e-4", [2e-4; 3]),
        (
            "noise_m_s2_sqrt_hz = [1e-4, 2e-4, 3e-4]",
            [1e-4, 2e-4, 3e-4],
        ),
        ("", [0.0; 3]),
    ] {
        let text = format!("format = 1\n[gyro]\n[accelerometer]\n{written}\n");
        std::fs::write(&path, text).expect("a file");
        let model = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let noise = model
            .accelerometer
            .as_ref()
            .map(|one| one.noise_m_s2_sqrt_hz);
        assert_eq!(noise, Some(expected));
        assert!(!model.gyro.names_pulse_weights());
        model.write(&path).unwrap_or_else(|error| panic!("{error}"));
        let back = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back, model);
    }
}

/// All kinds named by the engine of one likelihood can be written and read: kinds, parameters and units are defined once.
#[test]
fn every_kind_that_is_sought_is_a_kind_of_the_model() {
    let entries = rlg_catalogue::CATALOGUE.iter();
    let sought = entries.map(|entry| (entry.kind, entry.unit));
    let scanned = rlg_catalogue::entries::SCANNED
        .iter()
        .map(|card| (card.kind, card.unit));
    for (name, unit) in sought.chain(scanned) {
        let kind = Kind::named(name).unwrap_or_else(|| panic!("{name} is no kind of the model"));
        let is_event = matches!(name, "gyro_bias_step" | "counter_slip");
        let has_unit = kind.groups.iter().any(|group| group.unit == unit);
        assert!(
            has_unit || kind.is_free() || name == "isolator_mode" || is_event,
            "{name}: {unit}"
        );
        let every = every_kind(0.25);
        let effect = every.into_iter().find(|effect| effect.kind == name);
        let original = model([0.1, 0.2, 0.3], effect.into_iter().collect());
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("model.toml");
        original
            .write(&path)
            .unwrap_or_else(|error| panic!("{error}"));
        let back = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back, original, "{name}");
    }
}

#[test]
fn a_low_pass_has_a_time_constant_of_at_least_0() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    for (time_s, is_read) in [(0.033, true), (0.0, true), (-0.033, false)] {
        for name in ["x_pole_s", "y_pole_s", "z_pole_s"] {
            let effect = format!("[[effect]]\nkind = \"gyro_bandwidth\"\n{name} = {time_s:?}\n");
            std::fs::write(&path, format!("format = 1\n[gyro]\n{effect}")).expect("a file");
            let read = Model::read(&path);
            assert_eq!(read.is_ok(), is_read, "{name} = {time_s}");
            let Ok(model) = read else { continue };
            assert_eq!(model.effects[0].number(name), time_s);
            model.write(&path).unwrap_or_else(|error| panic!("{error}"));
            let back = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(back, model);
        }
    }
}

#[test]
fn flexure_says_how_it_is_compensated_and_what_of_it_is_a_choice() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    for (beside, response, damping, choice) in [
        ("", Response::Mode, None, None),
        ("response = \"mode\"", Response::Mode, None, None),
        ("response = \"static\"", Response::Static, None, None),
        ("damping = 0.002", Response::Mode, Some(0.002), None),
        ("damping = 0.99", Response::Mode, Some(0.99), None),
        (
            "choice = \"xy - xz\"",
            Response::Mode,
            None,
            Some("xy - xz"),
        ),
    ] {
        let effect = format!("[[effect]]\nkind = \"axis_flexure\"\nxy = 7e-8\n{beside}\n");
        std::fs::write(&path, format!("format = 1\n[gyro]\n{effect}")).expect("a file");
        let model = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let one = &model.effects[0];
        assert_eq!(one.response(), response, "{beside}");
        assert_eq!(one.damping(), damping, "{beside}");
        assert_eq!(one.choice(), choice, "{beside}");
        assert_eq!(one.number("xy"), 7e-8);
        model.write(&path).unwrap_or_else(|error| panic!("{error}"));
        let back = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back, model);
    }
}
