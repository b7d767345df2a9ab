//! The planner: its programme stays within the limits, its predictions hold, and it identifies all six.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use rayon::prelude::*;
use rlg::calibrate::programme::limits::Limits;
use rlg::calibrate::programme::{Programme, propose};
use rlg::model::{DeclaredModel, Model, ModelEffect};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use rlg_plan::Plan;

use crate::closed_form::TABLE_3;
use crate::table_three::{self, calibration, ignorant};

/// Issue: "all six within 5 % by the planned programme".
const SIX_WITHIN: f64 = 0.05;

const NAMES: [&str; 6] = ["xy", "xz", "yx", "yz", "zx", "zy"];

/// Returns the instrument of the Table 3 test.
pub fn instrument() -> Model {
    let scenario = table_three::scenario("[[motion]]\nkind = \"still\"\nduration_s = 0.25\n");
    simulate(&scenario, 0, |_| {}).model
}

/// 400 °/s and 600 °/s², with a time and a sample rate.
pub fn limits_text(table_time_s: f64, rate_hz: f64) -> String {
    format!(
        "format = 1\ngreatest_rate_rad_s = {:?}\ngreatest_acceleration_rad_s2 = {:?}\n\
         table_time_s = {table_time_s:?}\nrate_hz = {rate_hz:?}\n",
        400f64.to_radians(),
        600f64.to_radians()
    )
}

fn planned(text: &str) -> (Limits, Programme) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("limits.toml");
    fs::write(&file, text).expect("a file");
    let limits = Limits::read(&file).expect("limits");
    let instrument = instrument();
    let model = DeclaredModel::new(&instrument, Path::new("model.toml"));
    let programme = propose(&limits, &file, model, &Plan::default()).expect("a programme");
    (limits, programme)
}

/// Returns the planned scenario with the flexure of Table 3 concealed in it.
fn with_table_3(programme: &Programme) -> Scenario {
    let values: String = NAMES
        .iter()
        .zip(TABLE_3)
        .map(|(name, k)| format!("{name} = {k:e}\n"))
        .collect();
    let text = format!(
        "{}\n[[effect]]\nkind = \"axis_flexure\"\nconcealed = true\n{values}",
        programme.scenario
    );
    Scenario::parse(&text, Path::new("scenario.toml"))
        .expect("a scenario that rlg simulate accepts")
}

#[test]
fn a_programme_stays_within_its_limits_and_its_time() {
    for (rate, acceleration, seconds) in
        [(7.0, 10.5, 300.0), (2.0, 20.0, 200.0), (0.5, 100.0, 200.0)]
    {
        let text = format!(
            "format = 1\ngreatest_rate_rad_s = {rate:?}\ngreatest_acceleration_rad_s2 = {acceleration:?}\n\
             table_time_s = {seconds:?}\ngreatest_frequency_hz = 20.0\n"
        );
        let (limits, programme) = planned(&text);
        for line in &programme.entry.summary {
            println!("{line}");
        }
        assert!(programme.entry.table_time_s <= limits.table_time_s);
        assert!(programme.entry.greatest_rate_rad_s <= limits.greatest_rate_rad_s);
        assert!(
            programme.entry.greatest_acceleration_rad_s2 <= limits.greatest_acceleration_rad_s2
        );
        // A programme that leaves half of either limit unused is not the most informative.
        assert!(
            programme.entry.greatest_acceleration_rad_s2
                > 0.5 * limits.greatest_acceleration_rad_s2
        );
        assert!(programme.entry.summary.len() <= 20);
    }
}

/// The same table time as the paper's coning programme in `table_three`.
#[test]
fn the_planned_programme_gives_all_six_of_table_three_in_the_time_of_the_coning_programme() {
    let coning_s = 3.0 * (table_three::CONING_S + 20.0);
    let (_, programme) = planned(&limits_text(coning_s, 4000.0));
    for line in &programme.entry.summary {
        println!("{line}");
    }
    let simulation = simulate(&with_table_3(&programme), 1, |_| {});
    let model = ignorant(&simulation.model);
    let outcome = calibration(&[simulation.recording], &model);
    let effect: &ModelEffect = outcome
        .model
        .effects
        .iter()
        .find(|effect| effect.kind == "axis_flexure")
        .expect("flexure in the model");
    for (name, truth) in NAMES.iter().zip(TABLE_3) {
        let value = effect.number(name);
        println!(
            "K_{name}: {value:.3e}, Table 3 {truth:.1e}, off by {:.2} %, predicted spread {:.2} %",
            100.0 * (value / truth - 1.0),
            100.0 * programme.entry.std[*name] / truth
        );
        assert!((value / truth - 1.0).abs() < SIX_WITHIN);
    }
    assert_eq!(outcome.calibration.effects[0].identifiable.len(), 9);
}

/// Twelve seeds of 90 s at 1 kHz: 72 normalised errors, with an rms of 1 ± 0.08 if the prediction holds.
#[test]
fn simulated_scatter_is_what_the_programme_predicts() {
    const SEEDS: u64 = 12;
    /// Four standard deviations of the rms of 72 standard normal errors.
    const WITHIN: f64 = 0.33;
    let (_, programme) = planned(&limits_text(90.0, 1000.0));
    let scenario = with_table_3(&programme);
    let found: Vec<(f64, f64)> = (0..SEEDS)
        .into_par_iter()
        .flat_map_iter(|seed| {
            let simulation = simulate(&scenario, seed, |_| {});
            let model = ignorant(&simulation.model);
            let outcome = rlg::calibrate::calibrate(
                &[simulation.recording],
                DeclaredModel::new(&model, Path::new("model.toml")),
                &Plan::default(),
                &|_| {},
            )
            .expect("a calibration");
            let effect = outcome.calibration.effects[0].clone();
            let predicted = programme.entry.std.clone();
            effect
                .parameters
                .into_iter()
                .zip(TABLE_3)
                .map(move |(parameter, truth)| {
                    let rlg::diagnose::result::ParameterEntry::Number {
                        name, value, std, ..
                    } = parameter
                    else {
                        panic!("K is a number");
                    };
                    ((value - truth) / predicted[&name], std / predicted[&name])
                })
        })
        .collect();
    let count = found.len() as f64;
    let rms = (found.iter().map(|(d, _)| d * d).sum::<f64>() / count).sqrt();
    let stated = found.iter().map(|(_, ratio)| ratio).sum::<f64>() / count;
    println!(
        "scatter over prediction {rms:.3}, stated over predicted spread {stated:.3} ({count} values)"
    );
    assert!((rms - 1.0).abs() < WITHIN, "{rms}");
    // The fitted noise differs from the declared noise: 10 % of a standard deviation.
    assert!((stated - 1.0).abs() < 0.1, "{stated}");
}

#[test]
fn limits_that_no_programme_meets_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.toml");
    instrument().write(&model).expect("a model");
    let limits = folder.path().join("limits.toml");
    let good = limits_text(300.0, 4000.0);
    for (from, to, part) in [
        (
            "table_time_s = 300.0",
            "table_time_s = 30.0",
            "table_time_s",
        ),
        ("table_time_s = 300.0", "", "table_time_s"),
        ("table_time_s", "table_time", "table_time"),
        ("rate_hz = 4000.0", "rate_hz = -1.0", "rate_hz"),
        ("format = 1", "format = 2", "format"),
    ] {
        assert!(good.contains(from));
        fs::write(&limits, good.replace(from, to)).expect("a file");
        let output = Command::cargo_bin("rlg")
            .expect("the command is built")
            .args([
                "calibrate".as_ref(),
                "--propose".as_ref(),
                limits.as_os_str(),
            ])
            .args(["--model".as_ref(), model.as_os_str()])
            .arg("--out")
            .arg(folder.path().join("out"))
            .output()
            .expect("the command runs");
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            words.contains("limits.toml") && words.contains(part),
            "{words}"
        );
        assert!(!folder.path().join("out").exists());
    }
}
