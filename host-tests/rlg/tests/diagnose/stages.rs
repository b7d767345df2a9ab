//! Single stages of the diagnosis compared with results computed by hand.

use rlg::diagnose::streams::Streams;
use rlg::model::Model;
use rlg::simulate::coning_demo;
use rlg_diagnosis::rows::data::Data;
use rlg_diagnosis::tiles::portion::{Portion, inner};
use rlg_plan::{AlignPlan, HeldOutPlan, Plan};
use std::path::Path;

const RATE_HZ: f64 = 4000.0;

#[test]
fn a_portion_keeps_sums_of_products() {
    let rows: Vec<f64> = (0..8000).map(|row| (row as f64 * 0.37).sin()).collect();
    let portion =
        Portion::new(vec![0..3000, 5000..8000], RATE_HZ, &HeldOutPlan::default()).expect("rows");
    let bins = portion.transform(&rows);
    let ones = vec![1.0; portion.bins()];
    let in_time: f64 = portion
        .ranges
        .iter()
        .flat_map(|range| &rows[range.clone()])
        .map(|value| value * value)
        .sum();
    // Double precision over 6000 rows.
    assert!((inner(&bins, &bins, &ones) / in_time - 1.0).abs() < 1e-12);
}

#[test]
fn a_dither_that_the_model_does_not_speak_of_is_taken_at_its_pickoffs_word() {
    let simulation = coning_demo(5).expect("a scenario");
    let file = Path::new("model.toml");
    let residual = |model: &Model| {
        let mut streams =
            Streams::align(&simulation.recording, model, &AlignPlan::default()).expect("channels");
        let plan = Plan::default();
        let data = Data::new(&mut streams, model, &plan, file).expect("an installation");
        data.residual_rad
    };
    let mut silent = simulation.model.clone();
    let told = silent.dither.take().expect("a dithered unit");
    assert_eq!(told.pickoff_gain, [1.0; 3]);
    assert_eq!(residual(&silent), residual(&simulation.model));
    // An oscillation of 1e-4 rad at 400 Hz would exceed the pulses.
    let most = residual(&silent)
        .iter()
        .flatten()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    assert!(most < 3e-5, "{most:e}");
}
