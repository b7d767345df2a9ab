//! A name that fits the rows it was fitted to, and not the others, is no name.

use super::case::{Case, sensing_besides, slew, still, text, vibration};
use rlg::diagnose::result::Verdict;
use rlg::diagnose::split::{Part, split};
use rlg::diagnose::streams::Streams;

/// A scale error that is there only while nobody validates: what drives it is not in the recording.
#[test]
fn a_name_that_the_held_out_rows_contradict_is_taken_back() {
    let motion = [
        still(4.0),
        vibration("swell", [0.5, 4.0], 0.3, 16.0),
        slew("y", 1.0),
        vibration("swell again", [0.5, 4.0], 0.2, 12.0),
        still(3.0),
    ];
    let (recording, model) = Case::of_increments(&motion, 71);
    let streams = Streams::align(&recording, &model).expect("it aligns");
    let held_out = split(&streams, Part::End).held_out;
    let made = sensing_besides((recording, model), |rates_rad_s, _| {
        let mut rates = rates_rad_s[1].clone();
        held_out
            .iter()
            .for_each(|rows| rates[rows.clone()].fill(0.0));
        rates.iter().map(|rate| 2e-5 * rate).collect()
    });
    let case = Case::diagnosed(made);
    assert_eq!(case.said.verdict, Verdict::PartlyExplained);
    let taken_back = |line: &String| {
        let mut names = ["gyro_scale", "reference_scale"].iter();
        names.any(|name| line.starts_with(&format!("Not named: {name}")))
            && line.contains("on held-out time")
    };
    let summary = &case.said.summary;
    assert!(summary.iter().any(taken_back), "{summary:#?}");
    // What it looked like is still said, and modelled.
    let kinds = case.kinds();
    assert!(kinds.iter().all(|kind| *kind == "unlisted"), "{kinds:?}");
    let mut expressions = case.said.effects.iter().map(|one| text(one, "expression"));
    assert!(expressions.any(|expression| expression == Some("omega_y")));
}
