//! Gyros without a dither that follow the reference in other axes, with another sign or in another unit: corrections
//! applied, refusals, and reports of `--anyway`.

use std::path::Path;

use rlg::diagnose::result::{Diagnosis, EffectEntry, Verdict};
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::{Quantity, Recording};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::{Simulation, simulate};

use super::support::{kinds, number};

const TABLE: &str = include_str!("table_programme.toml");

const REFERENCE: [Quantity; 1] = [Quantity::ReferenceIncrement];

/// Simulates rotations about three axes at once of a unit without a dither.
fn turns() -> Simulation {
    let instrument = TABLE.split("[accelerometer]").next().expect("it has one");
    let motion = "[[motion]]\nkind = \"tumble\"\nrate_rad_s = [0.3, 0.2, 0.4]\nduration_s = 40.0\n\
                  frequency_hz = [0.41, 0.57, 0.73]\nphase_rad = [0.0, 1.0, 2.0]\nramp_s = 1.0\n";
    let text = format!("{instrument}{motion}");
    let scenario = Scenario::parse(&text, Path::new("turns.toml")).expect("a scenario");
    simulate(&scenario, 5, |_| {})
}

/// Replaces channel i of the gyros, or of the reference, by channel `from[i].0` of the simulation, times `from[i].1`.
fn wired(simulation: &Simulation, of: &[Quantity], from: [(usize, f64); 3]) -> Recording {
    let mut recording = simulation.recording.clone();
    let is_wired = |quantity: &Quantity| of.contains(quantity);
    let channels = || recording.tables.iter().flat_map(|table| &table.channels);
    let values_of = |axis: usize| {
        let name = ["x", "y", "z"][axis];
        let mut all = channels();
        let found = all.find(|one| is_wired(&one.quantity) && one.axis.as_deref() == Some(name));
        found.expect("a channel").values.clone()
    };
    let sources = from.map(|(axis, times)| {
        let values = values_of(axis);
        values
            .into_iter()
            .map(|value| value * times)
            .collect::<Vec<f64>>()
    });
    for channel in recording
        .tables
        .iter_mut()
        .flat_map(|table| &mut table.channels)
    {
        if !is_wired(&channel.quantity) {
            continue;
        }
        let axis = ["x", "y", "z"]
            .iter()
            .position(|name| channel.axis.as_deref() == Some(name));
        if let Some(axis) = axis {
            channel.values.clone_from(&sources[axis]);
        }
    }
    recording
}

fn diagnosed(recording: &Recording, model: &Model, anyway: bool) -> Result<Outcome, InputError> {
    let settings = Settings {
        anyway,
        ..Settings::default()
    };
    diagnose_under(
        &settings,
        recording,
        model,
        Path::new("model.toml"),
        &|_| {},
    )
}

fn effect<'a>(diagnosis: &'a Diagnosis, kind: &str) -> &'a EffectEntry {
    let mut effects = diagnosis.effects.iter();
    effects
        .find(|effect| effect.kind == kind)
        .unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary))
}

fn is_refused(recording: &Recording, model: &Model, words: &str) {
    match diagnosed(recording, model, false) {
        Ok(outcome) => panic!("not refused: {:#?}", outcome.diagnosis.summary),
        Err(error) => assert!(error.to_string().contains(words), "{error}"),
    }
}

#[test]
fn a_cyclic_exchange_is_applied_and_the_model_written_predicts_it() {
    let simulation = turns();
    let recording = wired(&simulation, &REFERENCE, [(1, 1.0), (2, 1.0), (0, 1.0)]);
    let found = diagnosed(&recording, &simulation.model, false).expect("applied");
    let diagnosis = &found.diagnosis;
    assert_eq!(
        diagnosis.verdict,
        Verdict::Explained,
        "{:#?}",
        diagnosis.summary
    );
    assert_eq!(kinds(diagnosis), ["channel_order"]);
    let order = effect(diagnosis, "channel_order");
    for (name, value) in [("xz", 1.0), ("yx", 1.0), ("zy", 1.0), ("xx", 0.0)] {
        assert_eq!(number(order, name).0, value, "{name}");
    }
    assert!(
        diagnosis.summary[1].contains("follow the reference's z, x, y"),
        "{:#?}",
        diagnosis.summary
    );
    // The written model reads back and predicts.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    found
        .model
        .write(&path)
        .unwrap_or_else(|error| panic!("{error}"));
    let model = Model::read(&path).unwrap_or_else(|error| panic!("{error}"));
    let again = diagnosed(&recording, &model, false).expect("nothing to refuse");
    assert_eq!(
        again.diagnosis.verdict,
        Verdict::Matches,
        "{:#?}",
        again.diagnosis.summary
    );
}

#[test]
fn a_reversed_gyro_is_refused_or_reported_anyway() {
    let simulation = turns();
    let recording = wired(&simulation, &REFERENCE, [(0, 1.0), (1, -1.0), (2, 1.0)]);
    is_refused(
        &recording,
        &simulation.model,
        "gyro y reads -1.00 times the reference",
    );
    let found = diagnosed(&recording, &simulation.model, true).expect("put right");
    let sign = effect(&found.diagnosis, "channel_sign");
    assert_eq!(number(sign, "yy").0, -1.0);
    assert_eq!(kinds(&found.diagnosis), ["channel_sign"]);
}

#[test]
fn a_gross_factor_is_refused_with_its_cause_or_reported_anyway() {
    let simulation = turns();
    let degrees = 180.0 / std::f64::consts::PI;
    let recording = wired(
        &simulation,
        &Quantity::GYROS,
        [(0, degrees), (1, degrees), (2, degrees)],
    );
    is_refused(
        &recording,
        &simulation.model,
        "all three read 57.296 times the reference: degrees where radians are meant?",
    );
    let doubled = wired(
        &simulation,
        &Quantity::GYROS,
        [(0, 2.0), (1, 2.0), (2, 2.0)],
    );
    is_refused(
        &doubled,
        &simulation.model,
        "all three read 2.000 times the reference",
    );
    let found = diagnosed(&doubled, &simulation.model, true).expect("put right");
    let scale = effect(&found.diagnosis, "gyro_scale");
    for axis in ["x", "y", "z"] {
        assert!((number(scale, axis).0 - 1.0).abs() < 1e-9);
    }
}
