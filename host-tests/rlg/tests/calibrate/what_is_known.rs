//! Identifiable and unidentifiable combinations of a calibration.

use std::path::Path;

use rlg::calibrate::{Outcome, calibrate};
use rlg::error::InputError;
use rlg::model::{DeclaredModel, Model, ModelEffect};
use rlg::recording::Recording;
use rlg_plan::Plan;

use crate::closed_form::{Against, Made, TABLE_3, coning, make, spins};

fn of(made: &[&Made]) -> Result<Outcome, InputError> {
    let recordings: Vec<_> = made.iter().map(|made| made.recording.clone()).collect();
    under(&made[0].model, &recordings)
}

fn under(model: &Model, recordings: &[Recording]) -> Result<Outcome, InputError> {
    let model = DeclaredModel::new(model, Path::new("model.toml"));
    calibrate(recordings, model, &Plan::default(), &|_| {})
}

fn flexure(outcome: &Outcome) -> &ModelEffect {
    outcome
        .model
        .effects
        .iter()
        .find(|effect| effect.kind == "axis_flexure")
        .expect("flexure in the model")
}

/// Attitudes determine the mean drift only; with rates, 34 s resolve nothing at twice the coning frequency.
#[test]
fn coning_gives_three_sums_and_says_that_the_differences_are_not_known() {
    for against in [Against::Rates, Against::Attitude(0.5, 5e-7)] {
        let made = make(&coning(), &TABLE_3, &against, 1);
        let outcome = of(&[&made]).expect("a calibration");
        let calibration = &outcome.calibration;
        let effect = &calibration.effects[0];
        assert_eq!(effect.identifiable.len(), 3, "{:#?}", calibration.summary);
        assert!(
            effect
                .identifiable
                .iter()
                .all(|fixed| fixed.combination.len() == 2)
        );
        assert_eq!(calibration.not_identifiable.len(), 3);
        for unfixed in &calibration.not_identifiable {
            assert!(unfixed.combination.values().any(|weight| *weight < 0.0));
            assert!(unfixed.motion.contains("spin about"), "{}", unfixed.motion);
        }
        assert!(calibration.next_experiment.contains("--propose"));
        let model = flexure(&outcome);
        assert_eq!(model.number("xy"), model.number("xz"));
        let choice = model.choice().expect("differences are a choice");
        assert!(choice.starts_with("xy - xz: not identifiable"), "{choice}");
        assert!(
            calibration.summary.len() <= 20,
            "{:#?}",
            calibration.summary
        );
    }
}

#[test]
fn spins_give_all_six_and_nothing_is_left_to_separate() {
    let made = make(&spins(), &TABLE_3, &Against::Rates, 2);
    let outcome = of(&[&made]).expect("a calibration");
    let calibration = &outcome.calibration;
    assert_eq!(calibration.effects[0].identifiable.len(), 9);
    assert!(calibration.not_identifiable.is_empty());
    assert!(flexure(&outcome).choice().is_none());
    // Physics §3: spin-synchronous oscillation of all pairs has condition number 1; still segments and tapers add a little.
    let condition = calibration.condition_number.expect("all directions known");
    assert!(condition < 1.5, "{condition}");
}

/// Coning with attitudes determines sums only: its condition number is some hundreds or more (physics §3: about 1000).
#[test]
fn attitude_from_coning_alone_is_badly_conditioned_and_confuses_an_elastic_rate_with_flexure() {
    let mut made = make(&coning(), &TABLE_3, &Against::Attitude(0.5, 5e-7), 3);
    // Only before and after: samples within the cone would identify an elastic rate.
    let cones_s = [4.0..14.0, 16.0..26.0, 28.0..38.0];
    for channel in &mut made.recording.tables[1].channels {
        for (row, value) in channel.values.iter_mut().enumerate() {
            let time_s = 2.0 * (row + 1) as f64;
            if cones_s
                .iter()
                .any(|cone| cone.start < time_s && time_s < cone.end)
            {
                *value = f64::NAN;
            }
        }
    }
    let calibration = of(&[&made]).expect("a calibration").calibration;
    assert_eq!(
        calibration.effects[0].identifiable.len(),
        3,
        "{:#?}",
        calibration.summary
    );
    assert!(
        calibration
            .condition_number
            .is_none_or(|number| number > 30.0)
    );
    assert_eq!(
        calibration.effects[0].indistinguishable_from,
        ["elastic_rate_by_jerk"]
    );
    // With rates a reversed spin separates the two; attitudes would have to be sampled many times a revolution.
    let spun = make(&spins(), &TABLE_3, &Against::Rates, 3);
    let calibration = of(&[&spun]).expect("a calibration").calibration;
    assert!(calibration.effects[0].indistinguishable_from.is_empty());
}

#[test]
fn two_recordings_know_more_than_either_and_their_information_adds() {
    let first = make(&coning(), &TABLE_3, &Against::Rates, 4);
    let second = make(&spins(), &TABLE_3, &Against::Attitude(2.0, 2e-7), 5);
    let covariance = |made: &[&Made]| {
        let entry = of(made).expect("a calibration").calibration;
        let rows = entry.effects[0].covariance.clone();
        nalgebra::DMatrix::from_fn(6, 6, |a, b| rows[a][b] * 1e16)
    };
    let inverse = |matrix: nalgebra::DMatrix<f64>| matrix.try_inverse().expect("positive definite");
    let alone = inverse(covariance(&[&first])) + inverse(covariance(&[&second]));
    let together = inverse(covariance(&[&first, &second]));
    // The prior (1e-6 s²) is counted twice on the left; otherwise the sum is exact but for the linearisation point of the
    // attitudes, parts in 1e4.
    let apart = (&alone - &together).norm() / together.norm();
    assert!(apart < 2e-3, "{apart}");
}

#[test]
fn flexure_that_the_model_already_has_is_replaced_and_not_added_to() {
    let made = make(&spins(), &TABLE_3, &Against::Rates, 6);
    let mut half = made.model.clone();
    half.effects.push(ModelEffect {
        kind: "axis_flexure".to_owned(),
        parameters: [("xy".to_owned(), rlg::model::EffectValue::Number(3e-8))].into(),
    });
    let recordings = [made.recording.clone()];
    let fresh = under(&made.model, &recordings).expect("a calibration");
    let again = under(&half, &recordings).expect("a calibration");
    assert_eq!(flexure(&fresh), flexure(&again));
    assert_eq!(again.model.effects.len(), 1);
}

/// An effect of the model is predicted: the fit estimates the remainder.
#[test]
fn an_effect_that_the_model_has_is_no_part_of_what_is_fitted() {
    for against in [Against::Rates, Against::Attitude(2.0, 2e-7)] {
        let made = make(&spins(), &TABLE_3, &against, 7);
        let mut known = made.model.clone();
        known.effects.push(ModelEffect {
            kind: "gyro_scale".to_owned(),
            parameters: [("x".to_owned(), rlg::model::EffectValue::Number(2e-4))].into(),
        });
        let fitted = |model| {
            let recordings = [made.recording.clone()];
            let outcome = under(model, &recordings);
            let calibration = outcome.expect("a calibration").calibration;
            let mut nuisances = calibration.nuisances.into_iter();
            let scale = nuisances.find(|one| one.kind == "gyro_scale" && one.name == "x");
            scale.expect("a scale error").value
        };
        let (without, with) = (fitted(&made.model), fitted(&known));
        // The prior about the model shifts by as much: a ten-thousandth of it here.
        assert!((without - with - 2e-4).abs() < 2e-7, "{without:e} {with:e}");
    }
}
