//! Trials of a recording: what is laid out anew, what is planted, and how it is judged. The recording is drawn, so that its
//! motion is known; the equations of what is planted are written once more.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rlg_challenge::acceptance::judge::{Judgement, Score, judge};
use rlg_challenge::acceptance::record::{Answer, Declares, record};
use rlg_challenge::acceptance::run::Outcome;
use rlg_challenge::acceptance::trial::{Source, Trial};
use rlg_challenge::acceptance::under_test::{DiagnosisSummary, Estimate, FoundEffect};
use rlg_challenge::marks::family::Family;
use rlg_challenge::marks::setting::Limits;
use rlg_challenge::recorded::base::{Base, Stamp};
use rlg_challenge::recorded::planted::{COUNT, Planted};
use rlg_recording::{Clock, Quantity, Recording};

const AXES: [&str; 3] = ["x", "y", "z"];

/// A recording beside attitudes that conceals a bias, so that something aligns it.
fn base() -> Arc<Base> {
    let limits = Limits {
        length_s: [20.0, 100.0],
        most_rows: 20_000.0,
        declared_within: 1.5,
    };
    let trial = Trial::draw(11, (1, Family::Attitude), &limits).expect("drawn");
    let (recording, model) = record(&trial, Declares::AsDrawn).expect("recorded");
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("recording");
    let mut out = Recording::create_folder(at.clone()).expect("created");
    recording.write_into(&mut out).expect("written");
    out.write("model.toml", model.to_toml().as_bytes())
        .expect("written");
    out.commit().expect("committed");
    Arc::new(Base::read(&at).expect("aligned"))
}

fn trial(base: &Arc<Base>, planted: &str) -> Trial {
    let is_of = |number: &u64| Planted::of(*number).name() == planted;
    let number = (0..COUNT).find(is_of).expect("planted by some number");
    Trial::of_recording(3, number, base).expect("drawn")
}

/// Increments of the gyros of a recording \[rad by row\].
fn sensed_rad(recording: &Recording, period_s: f64) -> Vec<Vector3<f64>> {
    let channels = AXES.map(|axis| {
        let rate = recording.channel(&Quantity::GyroRate, axis);
        let (unit, found) = match rate {
            Some(rate) => (period_s, rate),
            None => (
                1.0,
                recording
                    .channel(&Quantity::GyroIncrement, axis)
                    .expect("a gyro"),
            ),
        };
        let values = found.1.values.iter();
        values.map(|value| value * unit).collect::<Vec<f64>>()
    });
    let rows = channels[0].len();
    (0..rows)
        .map(|row| Vector3::from_fn(|axis, _| channels[axis][row]))
        .collect()
}

fn stamps(recording: &Recording) -> Vec<Stamp> {
    let parts = ["w", "x", "y", "z"].map(|axis| {
        recording
            .channel(&Quantity::ReferenceAttitude, axis)
            .expect("attitudes")
    });
    let Clock::Stamped { stamps_s, .. } = &parts[0].0.clock else {
        panic!("attitudes have stamps");
    };
    let attitude = |row: usize| {
        let [w, i, j, k] = parts.map(|(_, channel)| channel.values[row]);
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k))
    };
    stamps_s
        .iter()
        .enumerate()
        .map(|(row, time_s)| (*time_s, attitude(row)))
        .collect()
}

#[test]
fn a_null_keeps_the_gyros_and_the_errors_and_loses_their_order() {
    let base = base();
    let (recording, _) = record(&trial(&base, "none"), Declares::AsDrawn).expect("recorded");
    assert_eq!(
        sensed_rad(&recording, base.period_s).len(),
        base.sensed_rad.len()
    );
    for (now, before) in sensed_rad(&recording, base.period_s)
        .iter()
        .zip(&base.sensed_rad)
    {
        assert!((now - before).norm() < 1e-15, "{now} {before}");
    }
    let anew = stamps(&recording);
    assert_eq!(anew.len(), base.by_gyros.len());
    let errors: Vec<Vector3<f64>> = anew
        .iter()
        .zip(&base.by_gyros)
        .map(|((_, attitude), (_, by_gyros))| (attitude * by_gyros.inverse()).scaled_axis())
        .collect();
    // A turn keeps how far errors grow from stamp to stamp, but where blocks meet.
    let grown = |errors: &[Vector3<f64>]| {
        let mut all: Vec<f64> = errors
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).norm())
            .collect();
        let placed = all.clone();
        all.sort_by(f64::total_cmp);
        (all, placed)
    };
    let ((before, placed), (after, placed_anew)) = (grown(&base.errors_rad), grown(&errors));
    let is_kept = |one: &&f64| {
        let at = before.partition_point(|other| other < *one);
        let near = before[at.saturating_sub(1)..(at + 1).min(before.len())].iter();
        near.map(|other| (other - **one).abs())
            .fold(f64::INFINITY, f64::min)
            < 1e-9
    };
    let kept = after.iter().filter(is_kept).count();
    let joints = (anew.len() as f64 * base.stamp_s() / 6.0).ceil() as usize;
    assert!(kept + joints >= after.len(), "{kept} of {}", after.len());
    let in_place = placed
        .iter()
        .zip(&placed_anew)
        .filter(|(a, b)| (*a - *b).abs() < 1e-9);
    assert!(in_place.count() < placed.len() / 2);
}

#[test]
fn what_is_planted_adds_what_the_contract_says() {
    let base = base();
    let of = |planted: &str| {
        let trial = trial(&base, planted);
        let (recording, _) = record(&trial, Declares::AsDrawn).expect("recorded");
        let Source::Recorded(drawn) = trial.source else {
            panic!("made of the recording");
        };
        let effect = drawn.effect.expect("an effect");
        let sensed = sensed_rad(&recording, base.period_s).into_iter();
        let added: Vec<Vector3<f64>> = sensed
            .zip(&base.sensed_rad)
            .map(|(now, before)| now - before)
            .collect();
        (effect, added, stamps(&recording))
    };
    let near = |a: &Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() < 1e-12, "{a} {b}");
    let motion = &base.sensed_motion_rad;

    let (scale, added, unmoved) = of("gyro_scale_double");
    assert!((scale.largest() - 0.02).abs() < 1e-15);
    for (added, row) in added.iter().zip(motion) {
        near(added, row.component_mul(&scale.by_axis()));
    }
    assert_eq!(unmoved.len(), base.stamps.len());

    let (delay, added, moved) = of("reference_delay_half");
    assert!(added.iter().all(|added| added.norm() < 1e-15));
    for (moved, stamp) in moved.iter().zip(&base.stamps) {
        assert!((moved.0 - stamp.0 - delay.value("all")).abs() < 1e-12);
        assert!(moved.1.angle_to(&stamp.1) < 1e-7);
    }
    assert!((delay.largest() - 1.5e-3).abs() < 1e-15);

    // Axes that are not square: a symmetric share of the other's rate.
    let (_, added, _) = of("installation");
    let square: f64 = added
        .iter()
        .zip(motion)
        .map(|(added, row)| added.cross(row).norm())
        .sum();
    assert!(square > 0.0);
    let pairs = [(0, 1), (1, 2), (2, 0)];
    let is_pair = |&&(a, b): &&(usize, usize)| {
        let mut rows = added.iter().zip(motion);
        rows.all(|(added, row)| {
            let share = 5e-3 * (added[a] * row[b]).signum();
            let expected = |gyro: usize| match gyro {
                _ if gyro == a => share * row[b],
                _ if gyro == b => share * row[a],
                _ => 0.0,
            };
            (added - Vector3::from_fn(|gyro, _| expected(gyro))).norm() < 1e-12
        })
    };
    assert_eq!(pairs.iter().filter(is_pair).count(), 1);
}

fn found(kind: &str, numbers: &[(&str, f64, f64)]) -> FoundEffect {
    let numbers: BTreeMap<String, Estimate> = numbers
        .iter()
        .map(|&(name, value, std)| (name.to_owned(), Estimate { value, std }))
        .collect();
    FoundEffect {
        kind: kind.to_owned(),
        indistinguishable_from: Vec::new(),
        label: None,
        numbers,
        combinations: Vec::new(),
        texts: BTreeMap::new(),
        expression: None,
        gain: 10.0,
    }
}

#[test]
fn what_a_recording_holds_itself_is_no_false_name_and_sizes_are_beside_it() {
    let base = base();
    let judged = |planted: &str, effects: Vec<FoundEffect>, registration: Vec<FoundEffect>| {
        let answer = Answer::of(3, &trial(&base, planted));
        let said = DiagnosisSummary {
            verdict: "explained".to_owned(),
            effects,
            registration,
            again: None,
        };
        let outcome = Outcome {
            trial: answer.trial,
            said: Some(said),
            failure: None,
        };
        (answer.clone(), judge(&answer, &outcome))
    };
    let score = |judged: (Answer, Judgement)| judged.1.score;
    let bias = || found("gyro_bias", &[]);
    assert_eq!(
        score(judged("none", vec![bias()], Vec::new())),
        Score::Right
    );
    let physics = vec![bias(), found("gyro_g_bias", &[])];
    assert_eq!(score(judged("none", physics, Vec::new())), Score::Wrong);
    let physics = vec![bias(), found("axis_flexure_cubic", &[])];
    assert_eq!(
        score(judged("gyro_g_bias", physics, Vec::new())),
        Score::Wrong
    );
    assert_eq!(
        score(judged("gyro_g_bias", vec![bias()], Vec::new())),
        Score::Missed
    );

    // A delay stands beside the one that the recording had.
    let (answer, _) = judged("reference_delay", Vec::new(), Vec::new());
    let of = |list: &[rlg_challenge::acceptance::record::Concealed]| {
        let own = list.iter().find(|one| one.kind == "reference_delay");
        own.and_then(|one| one.parameters["all"].as_f64())
            .expect("a delay")
    };
    let whole_s = of(&answer.effects) + of(&answer.beside);
    assert!((of(&answer.effects).abs() - 3e-3).abs() < 1e-12);
    let entry = vec![found("reference_delay", &[("all", whole_s + 2e-5, 1e-5)])];
    let claim = vec![bias(), found("reference_delay", &[("all", whole_s, 1e-5)])];
    let (_, judgement) = judged("reference_delay", claim, entry);
    assert_eq!(judgement.score, Score::Right);
    assert_eq!(judgement.pulls.len(), 1);
    assert!(
        (judgement.pulls[0] - 2.0).abs() < 1e-6,
        "{}",
        judgement.pulls[0]
    );
}
