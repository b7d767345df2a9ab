//! Slow shapes similar to a random walk of the rate, absent from the listed effects.

use super::case::{Case, holds, text, unlisted};
use super::three_alike;
use rlg::diagnose::result::Verdict;

/// Returns both edges of a window \[s\].
pub fn edges_of(expression: &str) -> [f64; 2] {
    let inside = expression.strip_prefix("window(");
    let inside = inside.and_then(|rest| rest.strip_suffix(')'));
    let (from, to) = inside
        .and_then(|edges| edges.split_once(','))
        .expect("a window");
    [from, to].map(|edge| edge.parse().expect("a time"))
}

/// A window that opens in held-out rows and closes in the next regime: 5e-6 rad/s, 1 °/h, 24 standard deviations.
#[test]
fn a_window_that_opens_where_nothing_is_fitted_has_its_edges_there() {
    let (size_rad_s, edges_s) = (5e-6, [30.0, 38.0]);
    let drift = unlisted("y", size_rad_s, "window(30,38)");
    let case = Case::diagnosed(Case::made(&three_alike(), &[drift], 41));
    let kinds = case.kinds();
    assert_eq!(kinds, ["unlisted"], "{:#?}", case.said.summary);
    let found = case.found("unlisted");
    assert_eq!(text(found, "axis"), Some("y"));
    holds(found, &[("coefficient", size_rad_s)]);
    let expression = text(found, "expression").expect("an expression");
    let [opens_s, shuts_s] = edges_of(expression);
    // The last fifth of twelve seconds is for testing only: fitted rows do not determine the opening within it. White noise
    // of the angle gives an edge of this size a standard deviation of a tenth of a second.
    assert!((29.3..=32.3).contains(&opens_s), "{expression}");
    assert!((shuts_s - edges_s[1]).abs() < 0.3, "{expression}");
}

/// 1.5e-5 rad/s that decays with 6 s: 44 standard deviations.
#[test]
fn a_rate_that_settles_is_a_decay_and_no_step() {
    let size_rad_s = 1.5e-5;
    let settling = unlisted("x", size_rad_s, "decay(6)");
    let case = Case::diagnosed(Case::made(&three_alike(), &[settling], 42));
    let kinds = case.kinds();
    assert_eq!(kinds, ["unlisted"], "{:#?}", case.said.summary);
    let found = case.found("unlisted");
    let expression = text(found, "expression").expect("an expression");
    let constant = expression.strip_prefix("decay(");
    let constant = constant.and_then(|rest| rest.strip_suffix(')'));
    let constant_s: f64 = constant
        .and_then(|text| text.parse().ok())
        .expect("a decay");
    // The scan is in half octaves.
    assert!(
        (constant_s / 6.0).ln().abs() < 0.5 * 2_f64.ln(),
        "{expression}"
    );
    assert_eq!(text(found, "axis"), Some("x"));
    assert!(case.held_out_gain() > 0.0);
}

/// 1e-4 rad/s for a quarter of a second in test rows: they name nothing, and the model does not explain them.
#[test]
fn a_burst_that_nothing_fitted_saw_gets_no_name_and_leaves_the_recording_unexplained() {
    let burst = unlisted("z", 1e-4, "window(30,30.25)");
    let case = Case::diagnosed(Case::made(&three_alike(), &[burst], 43));
    let summary = &case.said.summary;
    assert!(case.kinds().is_empty(), "{summary:#?}");
    assert_eq!(case.said.verdict, Verdict::Unexplained, "{summary:#?}");
}

/// The same in fitted rows: 25 µrad, 80 standard deviations of a slip, and no slip.
#[test]
#[ignore = "its edges lie some rows inside, and what they leave is named as one slip of 1.6 µrad"]
fn a_burst_is_a_window_and_no_swarm_of_slips() {
    let edges_s = [24.0, 24.25];
    let burst = unlisted("z", 1e-4, "window(24,24.25)");
    let case = Case::diagnosed(Case::made(&three_alike(), &[burst], 43));
    let kinds = case.kinds();
    assert_eq!(kinds, ["unlisted"], "{:#?}", case.said.summary);
    let found = case.found("unlisted");
    assert_eq!(text(found, "axis"), Some("z"));
    let expression = text(found, "expression").expect("an expression");
    for (edge_s, truth_s) in edges_of(expression).into_iter().zip(edges_s) {
        assert!((edge_s - truth_s).abs() < 0.05, "{expression}");
    }
}
