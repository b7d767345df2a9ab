//! The proposed next experiment achieves its predicted separation: it is simulated as written, and diagnosed together with
//! the recording for which it was proposed.

use std::path::Path;

use super::attitude::instrument;
use super::support::{concealed, moves};
use rlg::diagnose::result::{Diagnosis, EffectEntry, ParameterEntry};
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Settings, diagnose_streams, diagnose_together};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use rlg_plan::AlignPlan;

const STILL: &str = "[[motion]]\nkind = \"still\"\nduration_s = 10.0\n";

/// A motion on each axis in turn.
fn on_each_axis(motion: &str) -> String {
    let one = |axis: &str| format!("[[motion]]\naxis = \"{axis}\"\n{motion}{STILL}");
    STILL.to_string() + &["x", "y", "z"].map(one).concat()
}

/// One motion that detects an effect without identifying it.
struct Case<'a> {
    motion: &'a str,
    truth: (&'a str, &'a [(&'a str, f64)]),
    /// Rows a second.
    rate_hz: f64,
    /// Kinds not distinguishable from it now, to be distinguished by the experiment.
    rivals: &'a [&'a str],
}

impl Case<'_> {
    fn streams(&self, motion: &str, seed: u64) -> (Streams, rlg::model::Model) {
        let effect = concealed(self.truth.0, self.truth.1);
        let instrument = instrument(self.rate_hz).replace("attitude = true\n", "");
        let text = format!("{instrument}{motion}{effect}");
        let scenario = Scenario::parse(&text, Path::new("next.toml")).expect("a scenario");
        let mut simulation = simulate(&scenario, seed, |_| {});
        simulation.recording.name = format!("recording {seed}");
        let streams = Streams::align(
            &simulation.recording,
            &simulation.model,
            &AlignPlan::default(),
        );
        (streams.expect("it aligns"), simulation.model)
    }

    /// Returns the diagnosis before, and that of both recordings.
    fn before_and_after(&self) -> (Diagnosis, Diagnosis) {
        let motion = on_each_axis(self.motion);
        let settings = Settings::default();
        let file = Path::new("model.toml");
        let (streams, model) = self.streams(&motion, 11);
        let before = diagnose_streams(
            &settings,
            streams,
            rlg::model::DeclaredModel::new(&model, file),
            &|_| {},
        );
        let before = before.expect("a diagnosis").diagnosis;
        let proposed = before.experiment.as_ref();
        let proposed = proposed.unwrap_or_else(|| panic!("{}", before.next_experiment));
        let (again, _) = self.streams(&motion, 11);
        let (experiment, _) = self.streams(&format!("{STILL}{}{STILL}", moves(proposed)), 12);
        let both = vec![again.into(), experiment.into()];
        let after = diagnose_together(
            &settings,
            both,
            rlg::model::DeclaredModel::new(&model, file),
            &|_| {},
        );
        (before, after.expect("a diagnosis").diagnosis)
    }
}

fn class(effect: &EffectEntry) -> Vec<&str> {
    let others = effect.indistinguishable_from.iter();
    others.map(String::as_str).chain([&*effect.kind]).collect()
}

fn std_of(effect: &EffectEntry, wanted: &str) -> f64 {
    let is_it = |one: &ParameterEntry| match one {
        ParameterEntry::Number { name, std, .. } if name == wanted => Some(*std),
        _ => None,
    };
    let found = effect.parameters.iter().find_map(is_it);
    found.unwrap_or_else(|| panic!("no {wanted}"))
}

/// Checks that the predicted separation is decisive, that its kinds are then distinguished, and that the numbers have their
/// predicted standard deviations.
fn keeps_its_promise(case: &Case) {
    let (before, after) = case.before_and_after();
    let confused = class(&before.effects[0]);
    let (truth, proposed) = (case.truth.0, before.experiment.as_ref().expect("proposed"));
    assert!(confused.contains(&truth), "{confused:?}");
    let found = &after.effects[0];
    let left = class(found);
    assert!(left.contains(&truth), "{:#?}", after.summary);
    for rival in case.rivals {
        assert!(confused.contains(rival), "{rival}: {confused:?}");
        assert!(!left.contains(rival), "{rival}: {left:?}");
        let is_promised = proposed
            .separations
            .iter()
            .any(|one| one.promised_sigma > 5.0 && (one.truth == *rival || one.rival == *rival));
        assert!(is_promised, "{}", before.next_experiment);
    }
    if found.kind == before.effects[0].kind {
        for one in &proposed.precisions {
            let ratio = std_of(found, &one.name) / one.promised_std;
            assert!((0.7..1.4).contains(&ratio), "{}: {ratio}", one.name);
        }
    }
}

/// Cones of one amplitude: a tilt proportional to acceleration, or to its cube.
#[test]
fn stronger_coning_tells_a_linear_flexure_from_a_cubic_one() {
    keeps_its_promise(&Case {
        motion: "kind = \"coning\"\nfrequency_hz = 2.0\nangle_rad = 0.06\nduration_s = 20.0\nramp_s = 1.0\n",
        truth: (
            "axis_flexure",
            &["xy", "xz", "yx", "yz", "zx", "zy"].map(|name| (name, 3e-7)),
        ),
        rate_hz: 200.0,
        rivals: &["axis_flexure_cubic"],
    });
}

/// Slews of one rate and one sense: a scale error of any power of the rate.
#[test]
#[ignore = "a minute: --test diagnose -- --ignored in_full"]
fn faster_motion_of_both_senses_tells_a_scale_error_from_one_that_grows_with_the_rate_in_full() {
    keeps_its_promise(&Case {
        motion: "kind = \"slew\"\nangle_rad = 3.0\nduration_s = 20.0\n",
        truth: ("gyro_scale_quadratic", &[("x", 3e-5)]),
        rate_hz: 400.0,
        rivals: &["gyro_scale", "gyro_scale_asymmetry"],
    });
}
