//! Errors of an attitude reference, put into `outside/bias-0.0076` (attitudes at 25 Hz, 1.99e-4 rad of noise): refusals,
//! rows left out, reports, and an unchanged bias.

use std::path::PathBuf;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rlg::diagnose::result::{Diagnosis, ParameterEntry, Verdict};
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::{Quantity, Recording};

const AXES: [&str; 4] = ["w", "x", "y", "z"];

/// Bias put in \[rad/s\].
const BIAS: [f64; 3] = [2e-4, 2e-3, 7.6e-3];

/// Returns the recording, and its model with its file; `None` if they are not available.
fn recorded() -> Option<(Recording, Model, PathBuf)> {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
        return None;
    };
    let folder = folder.join("outside/bias-0.0076");
    let file = folder.join("model.toml");
    let model = Model::read(&file).unwrap_or_else(|error| panic!("{error}"));
    let recording = Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"));
    Some((recording, model, file))
}

/// Changes every attitude by its row.
fn change(
    recording: &mut Recording,
    changed: impl Fn(usize, Quaternion<f64>, &[Quaternion<f64>]) -> Quaternion<f64>,
) {
    let is_attitude = |table: &rlg::recording::Table| {
        let mut channels = table.channels.iter();
        channels.any(|channel| channel.quantity == Quantity::ReferenceAttitude)
    };
    let tables = recording.tables.iter_mut();
    for table in tables.filter(|table| is_attitude(table)) {
        let column = |axis: &str| {
            let own = table.channels.iter().position(|channel| {
                channel.quantity == Quantity::ReferenceAttitude
                    && channel.axis.as_deref() == Some(axis)
            });
            own.expect("four components")
        };
        let columns = AXES.map(column);
        let all: Vec<Quaternion<f64>> = (0..table.rows)
            .map(|row| {
                let [w, x, y, z] = columns.map(|column| table.channels[column].values[row]);
                Quaternion::new(w, x, y, z)
            })
            .collect();
        for row in 0..table.rows {
            let new = changed(row, all[row], &all);
            for (column, value) in columns.into_iter().zip([new.w, new.i, new.j, new.k]) {
                table.channels[column].values[row] = value;
            }
        }
    }
}

fn diagnosed(
    (recording, model, file): &(Recording, Model, PathBuf),
    anyway: bool,
) -> Result<Outcome, InputError> {
    let settings = Settings {
        anyway,
        ..Settings::default()
    };
    diagnose_under(&settings, recording, model, file, &|_| {})
}

fn number(parameters: &[ParameterEntry], wanted: &str) -> (f64, f64) {
    let found = parameters.iter().find_map(|parameter| match parameter {
        ParameterEntry::Number {
            name, value, std, ..
        } if name == wanted => Some((*value, *std)),
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no {wanted} in {parameters:?}"))
}

/// Checks the bias within three of its standard deviations, and the other kinds in this order.
fn has_its_bias_and(diagnosis: &Diagnosis, others: &[&str]) {
    let mut kinds: Vec<&str> = diagnosis
        .effects
        .iter()
        .map(|one| one.kind.as_str())
        .collect();
    assert_eq!(kinds.remove(0), "gyro_bias", "{:#?}", diagnosis.summary);
    assert_eq!(kinds, others, "{:#?}", diagnosis.summary);
    for (axis, bias) in ["x", "y", "z"].into_iter().zip(BIAS) {
        let (value, std) = number(&diagnosis.effects[0].parameters, axis);
        assert!(
            (value - bias).abs() < 3.0 * std && std < 1e-4,
            "{axis}: {value} ± {std}, not {bias}"
        );
    }
}

#[test]
fn a_jump_that_stays_is_one_of_the_reference_with_its_time_and_size() {
    const SIZE_RAD: f64 = 0.01;
    let Some(mut all) = recorded() else { return };
    let jump = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, SIZE_RAD)).into_inner();
    change(&mut all.0, |row, was, _| match row >= 300 {
        true => jump * was,
        false => was,
    });
    let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
    has_its_bias_and(&outcome.diagnosis, &["reference_jump"]);
    let entry = &outcome.diagnosis.effects[1];
    let (time_s, _) = number(&entry.parameters, "time_s");
    let before_s = 300.0 * 0.04;
    assert!((time_s - before_s).abs() < 0.1, "{time_s} s");
    // About one axis of the body; the whole jump is in the sentence and in the updated model.
    let (size_rad, std_rad) = number(&entry.parameters, "size");
    assert!(
        size_rad.abs() <= SIZE_RAD + 3.0 * std_rad && size_rad.abs() > SIZE_RAD / 2.0,
        "{size_rad}"
    );
    let jumps = outcome
        .model
        .effects
        .iter()
        .filter(|one| one.kind == "reference_jump");
    let square: f64 = jumps.map(|one| one.number("size").powi(2)).sum();
    assert!((square.sqrt() - SIZE_RAD).abs() < 3.0 * std_rad, "{square}");
    let again = diagnosed(&(all.0, outcome.model, all.2), false);
    let again = again.unwrap_or_else(|error| panic!("{error}")).diagnosis;
    assert_eq!(again.verdict, Verdict::Matches, "{:#?}", again.summary);
}

#[test]
fn attitudes_that_are_held_while_the_gyros_turn_are_left_out() {
    let Some(mut all) = recorded() else { return };
    change(&mut all.0, |row, was, given| match row {
        200..230 => given[200],
        _ => was,
    });
    let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
    has_its_bias_and(&outcome.diagnosis, &["reference_dropout"]);
    let entry = &outcome.diagnosis.effects[1];
    let (start_s, _) = number(&entry.parameters, "start_s");
    let (end_s, _) = number(&entry.parameters, "end_s");
    assert!((start_s - 201.0 * 0.04).abs() < 0.1, "{start_s} s");
    assert!((end_s - 229.0 * 0.04).abs() < 0.1, "{end_s} s");
}

#[test]
fn an_attitude_of_the_other_sign_is_the_same() {
    let Some(mut all) = recorded() else { return };
    change(&mut all.0, |row, was, _| match row % 3 {
        0 => -was,
        _ => was,
    });
    let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
    has_its_bias_and(&outcome.diagnosis, &[]);
}

#[test]
fn attitudes_that_are_written_another_way_are_read_so_and_reported() {
    type Way = fn(Quaternion<f64>) -> Quaternion<f64>;
    let ways: [(&str, Way); 2] = [
        ("from navigation frame to body", |q| q.conjugate()),
        ("in the order x, y, z, w", |q| {
            Quaternion::new(q.i, q.j, q.k, q.w)
        }),
    ];
    for (words, way) in ways {
        let Some(mut all) = recorded() else { return };
        change(&mut all.0, |_, was, _| way(was));
        let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
        has_its_bias_and(&outcome.diagnosis, &[]);
        let said = &outcome.diagnosis.summary[1];
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn a_reversed_gyro_is_no_other_convention_and_both_are_found_together() {
    for is_inverse in [false, true] {
        let Some(mut all) = recorded() else { return };
        let channels = all
            .0
            .tables
            .iter_mut()
            .flat_map(|table| &mut table.channels);
        for gyro in channels.filter(|one| {
            Quantity::GYROS.contains(&one.quantity) && one.axis.as_deref() == Some("x")
        }) {
            gyro.values.iter_mut().for_each(|value| *value = -*value);
        }
        if is_inverse {
            change(&mut all.0, |_, was, _| was.conjugate());
        }
        let refused = diagnosed(&all, false).err().expect("a refusal").to_string();
        let outcome = diagnosed(&all, true).unwrap_or_else(|error| panic!("{error}"));
        let diagnosis = &outcome.diagnosis;
        let said = diagnosis.summary.join("\n");
        let inverse = "from navigation frame to body";
        assert_eq!(said.contains(inverse), is_inverse, "{said}");
        assert!(!said.contains("x, y, z, w"), "{said}");
        assert_eq!(refused.contains(inverse), is_inverse, "{refused}");
        let mut kinds: Vec<&str> = diagnosis
            .effects
            .iter()
            .map(|one| one.kind.as_str())
            .collect();
        kinds.sort_unstable();
        assert_eq!(kinds, ["channel_sign", "gyro_bias"], "{said}");
        let bias = diagnosis.effects.iter().find(|one| one.kind == "gyro_bias");
        // Of the gyro as recorded.
        let parameters = &bias.expect("named").parameters;
        for (axis, bias) in ["x", "y", "z"]
            .into_iter()
            .zip([-BIAS[0], BIAS[1], BIAS[2]])
        {
            let (value, std) = number(parameters, axis);
            assert!(
                (value - bias).abs() < 3.0 * std && std < 1e-4,
                "{axis}: {value} ± {std}"
            );
        }
    }
}

#[test]
fn inverse_attitudes_with_a_filters_error_on_top_are_read_so() {
    let Some(mut all) = recorded() else { return };
    // A slow wander of 0.1 rad: the inverse fits better, but not twenty times.
    change(&mut all.0, |row, was, _| {
        let turn = 0.1 * (0.003 * (row * row % 1000) as f64).sin();
        let error = UnitQuaternion::from_scaled_axis(Vector3::new(turn, 0.4 * turn, -turn));
        (error.into_inner() * was).conjugate()
    });
    let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
    let diagnosis = &outcome.diagnosis;
    assert!(
        diagnosis.summary[1].contains("from navigation frame to body"),
        "{:#?}",
        diagnosis.summary
    );
    let mut kinds = diagnosis.effects.iter().map(|one| one.kind.as_str());
    assert!(
        kinds.all(|kind| kind != "channel_sign" && kind != "reference_misalignment"),
        "{:#?}",
        diagnosis.summary
    );
    assert_ne!(diagnosis.verdict, Verdict::Matches);
}

#[test]
fn an_attitude_filter_that_settles_is_one_decay_and_the_bias_stays() {
    let axis = Vector3::new(0.6, -0.7, 0.39).normalize();
    for (size_rad, time_s) in [(0.5, 3.0), (0.05, 3.0), (0.05, 0.5), (1.5, 1.2)] {
        let Some(mut all) = recorded() else { return };
        change(&mut all.0, |row, was, _| {
            let left_rad = size_rad * (-0.04 * row as f64 / time_s).exp();
            UnitQuaternion::from_scaled_axis(axis * left_rad).into_inner() * was
        });
        let outcome = diagnosed(&all, false).unwrap_or_else(|error| panic!("{error}"));
        let mut diagnosis = outcome.diagnosis.clone();
        let place = diagnosis
            .effects
            .iter()
            .position(|one| one.kind == "reference_settling");
        let place = place.unwrap_or_else(|| panic!("{:#?}", diagnosis.summary));
        let found = diagnosis.effects.remove(place);
        has_its_bias_and(&diagnosis, &[]);
        let near = |name: &str, truth: f64| {
            let (value, std) = number(&found.parameters, name);
            assert!(
                (value - truth).abs() < 4.0 * std,
                "{name}: {value} ± {std}, not {truth}"
            );
            assert!(std < 0.1 * size_rad.max(truth), "{name}: {value} ± {std}");
        };
        near("time_constant_s", time_s);
        near("x", size_rad * axis.x);
        near("y", size_rad * axis.y);
        near("z", size_rad * axis.z);
        let again = diagnosed(&(all.0, outcome.model, all.2), false);
        let again = again.unwrap_or_else(|error| panic!("{error}")).diagnosis;
        assert_eq!(again.verdict, Verdict::Matches, "{:#?}", again.summary);
    }
}
