//! The marks' generator against closed forms, its noise against its spectra, and the scoring of hand-made answers.

use std::collections::BTreeMap;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_challenge::acceptance::judge::{Score, judge};
use rlg_challenge::acceptance::record::{Answer, Concealed, Declares, record};
use rlg_challenge::acceptance::run::{Outcome, Plan, prepare};
use rlg_challenge::acceptance::table::{Status, score};
use rlg_challenge::acceptance::trial::{Source, Trial};
use rlg_challenge::acceptance::under_test::{DiagnosisSummary, Estimate, FoundEffect};
use rlg_challenge::marks::courses;
use rlg_challenge::marks::family::Family;
use rlg_challenge::marks::motion::{Derivative, Motion};
use rlg_challenge::marks::noise::{Drift, Levels, Weighting, dct, product, quantised_rad};
use rlg_challenge::marks::rows::Rows;
use rlg_challenge::marks::setting::{Limits, MOTIONS, Setting};
use rlg_recording::Quantity;
use serde_json::json;

const LIMITS: Limits = Limits {
    length_s: [20.0, 100.0],
    most_rows: 20_000.0,
    declared_within: 1.5,
};

fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Every motion, drawn once.
fn motions() -> Vec<(Setting, Motion)> {
    let mut rng = generator(5);
    MOTIONS
        .iter()
        .map(|motion| {
            let setting = Setting::draw(&mut rng, &LIMITS, Drift::None, &[*motion]);
            let course = courses::draw(&setting, &mut rng);
            (setting, course)
        })
        .collect()
}

#[test]
fn increments_of_every_motion_sum_to_the_angle() {
    for (setting, motion) in motions() {
        for axis in 0..3 {
            let sum: f64 = motion
                .increments_rad(axis, 0.0, setting.period_s(), setting.rows)
                .iter()
                .sum();
            let angle = |time_s| motion.at(Derivative::Angle, axis, time_s);
            let exact = angle(setting.length_s()) - angle(0.0);
            assert!(
                (sum - exact).abs() < 1e-10,
                "{:?}: {sum} {exact}",
                setting.motion
            );
        }
    }
}

#[test]
fn rate_and_acceleration_are_derivatives_of_the_angle() {
    const STEP_S: f64 = 1e-4;
    for (setting, motion) in motions() {
        for (axis, place) in [(0, 0.31), (1, 0.52), (2, 0.77)] {
            let time_s = place * setting.length_s();
            for (of, derivative) in [
                (Derivative::Angle, Derivative::Rate),
                (Derivative::Rate, Derivative::Acceleration),
            ] {
                let [before, after] =
                    [-STEP_S, STEP_S].map(|step| motion.at(of, axis, time_s + step));
                let slope = (after - before) / (2.0 * STEP_S);
                let exact = motion.at(derivative, axis, time_s);
                // Third derivatives at 40 Hz: (2π 40)² STEP²/6 of the slope.
                let most = 1e-3 * exact.abs() + 1e-6;
                assert!(
                    (slope - exact).abs() < most,
                    "{:?}: {slope} {exact}",
                    setting.motion
                );
                let series = motion.series(derivative, axis, time_s, STEP_S, 600);
                let at_last = motion.at(derivative, axis, time_s + 599.0 * STEP_S);
                assert!((series[599] - at_last).abs() < 1e-9 * (1.0 + at_last.abs()));
            }
        }
    }
}

#[test]
fn noise_has_the_spectrum_that_strengths_are_counted_in() {
    const ROWS: usize = 4096;
    const PERIOD_S: f64 = 0.01;
    let white = Levels::white(1e-6, 3e-7);
    let cases = [
        white,
        white.drifting(Drift::RateWalk(0.3)),
        white.drifting(Drift::Flicker(0.5)),
    ];
    for (seed, levels) in cases.into_iter().enumerate() {
        let spectrum = levels.spectrum_rad2(ROWS, PERIOD_S);
        let mut rng = generator(seed as u64);
        let mut power = vec![0.0; ROWS];
        const DRAWS: usize = 40;
        for _ in 0..DRAWS {
            let bins = dct(&levels.series_rad(ROWS, PERIOD_S, &mut rng));
            for (sum, bin) in power.iter_mut().zip(bins) {
                *sum += bin * bin / DRAWS as f64;
            }
        }
        // 40 draws of 8 bins or more: a spread of 8 % or less; flicker is a sum of octaves besides.
        for band in [1..9, 9..65, 65..513, 513..ROWS] {
            let count = band.len() as f64;
            let over: f64 = band.clone().map(|bin| power[bin] / spectrum[bin]).sum();
            let over = over / count;
            assert!((over - 1.0).abs() < 0.3, "{levels:?} {band:?}: {over}");
        }
        let all: f64 = power.iter().zip(&spectrum).map(|(p, s)| p / s).sum();
        assert!((all / ROWS as f64 - 1.0).abs() < 0.02, "{levels:?}: {all}");
    }
}

#[test]
fn a_converter_loses_less_than_a_pulse() {
    let mut rng = generator(3);
    let increments: Vec<f64> = (0..500).map(|row| 1e-6 * f64::from(row).sin()).collect();
    let read = quantised_rad(&increments, 7e-7, &mut rng);
    let mut lost = 0.0_f64;
    for (exact, read) in increments.iter().zip(read) {
        lost += exact - read;
        assert!(lost.abs() < 7e-7 * (1.0 + 1e-9));
    }
}

#[test]
fn the_strength_of_a_bias_in_white_noise_is_b_sqrt_t_over_n() {
    const ROWS: usize = 5000;
    const PERIOD_S: f64 = 0.005;
    let (bias_rad_s, walk) = (4e-7, 1.3e-6);
    let shape = dct(&vec![bias_rad_s * PERIOD_S; ROWS]);
    let strength = |levels: Levels| {
        let weighting = Weighting::new(&levels, ROWS, PERIOD_S);
        weighting.product(&shape, &shape).sqrt()
    };
    let rho = strength(Levels::white(walk, 0.0));
    let exact = bias_rad_s * (ROWS as f64 * PERIOD_S).sqrt() / walk;
    assert!((rho / exact - 1.0).abs() < 1e-9, "{rho} {exact}");
    // In white noise of angle it is the slope of a line through n + 1 angles: variance 12σ²/(n(n + 1)(n + 2)).
    let angle_rad = 1e-3;
    let rho = strength(Levels::white(1e-7, angle_rad));
    let count = ROWS as f64;
    let slope = bias_rad_s * PERIOD_S;
    let exact = slope / angle_rad * (count * (count + 1.0) * (count + 2.0) / 12.0).sqrt();
    assert!((rho / exact - 1.0).abs() < 1e-2, "{rho} {exact}");
}

/// Residual of a recording under the contract's model, with the reference as motion.
fn residuals(trial: &Trial, rows: &Rows) -> [Vec<f64>; 3] {
    let (recording, model) = record(trial, Declares::AsDrawn).expect("a recording");
    let values = |quantity: Quantity, axis: &str| {
        let (_, channel) = recording.channel(&quantity, axis).expect("recorded");
        channel.values.clone()
    };
    let reference = ["x", "y", "z"].map(|axis| values(Quantity::ReferenceIncrement, axis));
    let sensing_from_body = rows.unit.sensing_from_body();
    let period_s = rows.setting.period_s();
    std::array::from_fn(|axis| {
        let scale = 1.0 / (1.0 - model.gyro.scale_error[axis]);
        values(Quantity::GyroIncrement, ["x", "y", "z"][axis])
            .iter()
            .enumerate()
            .map(|(row, read)| {
                let case: f64 = (0..3)
                    .map(|body| sensing_from_body[(axis, body)] * reference[body][row])
                    .sum();
                read - scale * (case + model.gyro.bias_rad_s[axis] * period_s * scale)
            })
            .collect()
    })
}

#[test]
fn recordings_hold_the_effects_and_the_noise_that_their_answers_state() {
    let mut tested = 0;
    for number in 0..40 {
        let trial = Trial::draw(11, (number, Family::of(number)), &LIMITS).expect("drawn");
        let Source::Rows(rows) = &trial.source else {
            continue;
        };
        if trial.family == Family::Hour {
            continue;
        }
        tested += 1;
        let case = rows.case();
        let weightings = rows.weightings();
        let left = residuals(&trial, rows).map(|series| dct(&series));
        let mut without = left.clone();
        for strong in &rows.effects {
            let shape = rows.shape(&strong.effect, &case);
            for axis in 0..3 {
                for (value, part) in without[axis].iter_mut().zip(&shape[axis]) {
                    *value -= part;
                }
            }
        }
        for strong in &rows.effects {
            let shape = rows.shape(&strong.effect, &case);
            assert!(strong.rho > 9.9 && strong.rho < 30.1, "{strong:?}");
            // The matched filter of what remains is a standard normal number.
            let filtered = product(&weightings, &without, &shape) / strong.rho;
            let word = format!("trial {number}: {strong:?}");
            assert!(filtered.abs() < 4.5, "{word}: {filtered}");
        }
        let degrees = 3.0 * rows.setting.rows as f64;
        let power = product(&weightings, &without, &without) / degrees;
        // Pulses as coarse as the noise are not quite white.
        let most = 5.0 * (2.0 / degrees).sqrt() + 0.02;
        assert!(
            (power - 1.0).abs() < most,
            "trial {number} {:?}: {power}",
            rows.setting
        );
    }
    assert!(tested > 30);
}

#[test]
fn two_effects_are_never_two_names_of_one() {
    for number in (7..7 + 17 * 6).step_by(17) {
        let trial = Trial::draw(3, (number, Family::of(number)), &LIMITS).expect("drawn");
        let Source::Rows(rows) = &trial.source else {
            panic!("trial {number} has rows");
        };
        let kinds: Vec<&str> = rows.effects.iter().map(|one| one.effect.kind).collect();
        let both = |a: &str, b: &str| kinds.contains(&a) && kinds.contains(&b);
        assert_eq!((trial.family, kinds.len()), (Family::Pair, 2));
        assert!(!both("gyro_scale", "reference_scale"), "trial {number}");
        assert!(!both("gyro_delay", "reference_delay"), "trial {number}");
    }
}

#[test]
fn a_trial_alone_is_the_trial_of_a_run() {
    let mut plan = Plan::new(4, 5, &[Family::Basic, Family::Null]);
    plan.most_rows = 5000.0;
    let whole = prepare(&plan, &|| {}).expect("drawn");
    assert_eq!(whole.trials.len(), 5);
    let number = whole.trials[3].number;
    plan.only = Some(number);
    plan.families = vec![Family::Pair];
    let alone = prepare(&plan, &|| {}).expect("drawn");
    assert_eq!(alone.lines, vec![whole.lines[3].clone()]);
    let both = [&whole.trials[3], &alone.trials[0]]
        .map(|trial| record(trial, Declares::AsDrawn).expect("made"));
    assert_eq!(both[0], both[1]);
    let read: Answer = serde_json::from_str(&alone.lines[0].1).expect("JSON");
    assert_eq!((read.trial, read.family), (number, Family::Basic));
}

fn answer(effects: &[(&str, serde_json::Value)]) -> Answer {
    let concealed = effects.iter().map(|(kind, parameters)| Concealed {
        kind: (*kind).to_owned(),
        parameters: parameters.as_object().expect("an object").clone(),
        rho: 12.0,
    });
    Answer {
        trial: 0,
        seed: 1,
        family: if effects.is_empty() {
            Family::Null
        } else {
            Family::Basic
        },
        effects: concealed.collect(),
        setting: None,
        scenario: None,
        planted: None,
        conditions: Vec::new(),
        beside: Vec::new(),
        noise_seed: 0,
        salt: String::new(),
    }
}

fn found(kind: &str, alike: &[&str], numbers: &[(&str, f64, f64)]) -> FoundEffect {
    let numbers: BTreeMap<String, Estimate> = numbers
        .iter()
        .map(|(name, value, std)| {
            let (value, std) = (*value, *std);
            ((*name).to_owned(), Estimate { value, std })
        })
        .collect();
    FoundEffect {
        kind: kind.to_owned(),
        indistinguishable_from: alike.iter().map(|kind| (*kind).to_owned()).collect(),
        label: None,
        numbers,
        combinations: Vec::new(),
        texts: BTreeMap::new(),
        expression: None,
        gain: 10.0,
    }
}

fn outcome(effects: Vec<FoundEffect>) -> Outcome {
    Outcome {
        trial: 0,
        said: Some(DiagnosisSummary {
            verdict: "explained".to_owned(),
            effects,
            registration: Vec::new(),
            again: None,
        }),
        failure: None,
    }
}

#[test]
fn claims_are_judged_by_kind_class_and_number() {
    let null = answer(&[]);
    let of = |answer: &Answer, effects: Vec<FoundEffect>| judge(answer, &outcome(effects)).score;
    assert_eq!(of(&null, Vec::new()), Score::Right);
    assert_eq!(of(&null, vec![found("gyro_bias", &[], &[])]), Score::Wrong);
    assert_eq!(
        of(&null, vec![found("gyro_bias", &["drift"], &[])]),
        Score::OrDrift
    );
    let mut measured = found("gyro_bias", &[], &[]);
    measured.label = Some("measured".to_owned());
    assert_eq!(of(&null, vec![measured]), Score::Right);
    let silent = [
        found("angle_random_walk", &[], &[]),
        found("unlisted", &[], &[]),
    ];
    assert_eq!(of(&null, silent.to_vec()), Score::Right);

    let delay = answer(&[("gyro_delay", json!({"x": 1e-5}))]);
    let class = found("reference_delay", &["gyro_delay"], &[("all", 1e-5, 1e-6)]);
    assert_eq!(of(&delay, Vec::new()), Score::Missed);
    assert_eq!(of(&delay, vec![class.clone()]), Score::Right);
    assert!(
        judge(&delay, &outcome(vec![class.clone()]))
            .pulls
            .is_empty()
    );
    let own = found("gyro_delay", &[], &[("x", 1.3e-5, 1e-6), ("y", 0.0, 1e-2)]);
    // The delay of y is not known better than any instrument's: it has no pull.
    let pulls = judge(&delay, &outcome(vec![own.clone()])).pulls;
    assert!(
        pulls.len() == 1 && (pulls[0] - 3.0).abs() < 1e-9,
        "{pulls:?}"
    );
    assert_eq!(of(&delay, vec![own.clone(), class]), Score::Wrong);
    assert_eq!(
        of(&delay, vec![found("gyro_scale", &[], &[])]),
        Score::Wrong
    );

    let pair = answer(&[
        ("gyro_delay", json!({"x": 1e-5})),
        ("gyro_bias", json!({"z": 1e-6})),
    ]);
    assert_eq!(of(&pair, vec![own.clone()]), Score::Missed);
    assert_eq!(
        of(&pair, vec![found("gyro_bias", &[], &[]), own]),
        Score::Right
    );

    let slip = answer(&[(
        "counter_slip",
        json!({"axis": "x", "time_s": 3.0, "size": 1e-5}),
    )]);
    let mut other = found("counter_slip", &[], &[]);
    other.texts.insert("axis".to_owned(), "y".to_owned());
    assert_eq!(of(&slip, vec![other]), Score::Wrong);
}

#[test]
fn faults_are_judged_by_their_time_and_lines_by_their_frequency() {
    let of = |answer: &Answer, effects: Vec<FoundEffect>| judge(answer, &outcome(effects)).score;
    let spike = answer(&[("reference_spike", json!({"start_s": 4.9, "end_s": 5.0}))]);
    let during = |begin_s: f64, end_s: f64| {
        let times = [("start_s", begin_s, 0.0), ("end_s", end_s, 0.0)];
        found("reference_dropout", &[], &times)
    };
    assert_eq!(of(&spike, vec![during(5.0, 5.0)]), Score::Right);
    assert_eq!(
        of(&spike, vec![during(4.0, 8.0), during(5.0, 5.0)]),
        Score::Right
    );
    assert_eq!(of(&spike, vec![during(7.0, 8.0)]), Score::Wrong);
    assert_eq!(of(&spike, Vec::new()), Score::Missed);
    let with_name = vec![during(5.0, 5.0), found("gyro_scale", &[], &[])];
    assert_eq!(of(&spike, with_name), Score::Wrong);
    assert_eq!(of(&answer(&[]), vec![during(5.0, 5.0)]), Score::Wrong);

    let jump = answer(&[(
        "reference_jump",
        json!({"axis": "x", "start_s": 4.9, "end_s": 5.0}),
    )]);
    assert_eq!(
        of(&jump, vec![found("counter_slip", &["reference_jump"], &[])]),
        Score::Right
    );
    assert_eq!(
        of(&jump, vec![found("counter_slip", &[], &[])]),
        Score::Wrong
    );
    // Rows that are missing need no name, and may have one.
    let gap = answer(&[("lost_samples", json!({"start_s": 4.9, "end_s": 5.0}))]);
    assert_eq!(of(&gap, Vec::new()), Score::Right);
    assert_eq!(of(&gap, vec![during(5.0, 5.0)]), Score::Right);
    assert_eq!(of(&gap, vec![found("gyro_bias", &[], &[])]), Score::Wrong);

    let truth = json!({"frequency_hz": 9.2, "resolution_hz": 0.01, "x": 1e-5, "y": 0.0, "z": 0.0});
    let line = answer(&[("unlisted", truth)]);
    let at = |frequency_hz: f64| FoundEffect {
        expression: Some(format!("sine({frequency_hz:.5})")),
        ..found("unlisted", &[], &[("x", 1.2e-5, 1e-6), ("y", 0.0, 0.0)])
    };
    assert_eq!(of(&line, vec![at(9.204)]), Score::Right);
    assert_eq!(of(&line, vec![at(9.206)]), Score::Wrong);
    let pulls = judge(&line, &outcome(vec![at(9.2)])).pulls;
    assert!(
        pulls.len() == 1 && (pulls[0] - 2.0).abs() < 1e-9,
        "{pulls:?}"
    );
}

#[test]
fn the_table_by_effect_counts_names_pulls_and_second_passes() {
    let plan = Plan::new(1, 3, &[Family::Attitude]);
    let mut biased = answer(&[("gyro_bias", json!({"x": 1e-4}))]);
    biased.family = Family::Attitude;
    biased.planted = Some("gyro_bias".to_owned());
    let said = |x: f64, verdict: &str| {
        let mut outcome = outcome(vec![found("gyro_bias", &[], &[("x", x, 1e-6)])]);
        let again = Box::new(DiagnosisSummary {
            verdict: verdict.to_owned(),
            effects: Vec::new(),
            registration: Vec::new(),
            again: None,
        });
        outcome.said.as_mut().expect("said").again = Some(again);
        outcome
    };
    let outcomes = [
        said(1e-4, "matches"),
        said(1.04e-4, "matches"),
        said(1e-4, "unexplained"),
    ];
    let scores = score(&plan, &vec![biased; 3], &outcomes);
    let [row] = scores.effects.as_slice() else {
        panic!("{:?}", scores.effects);
    };
    assert_eq!(
        (row.effect.as_str(), row.counts.right, row.counts.all()),
        ("gyro_bias", 3, 3)
    );
    assert_eq!((row.numbers, row.beyond_3), (3, 1));
    assert!((row.pull_rms - (16.0_f64 / 3.0).sqrt()).abs() < 1e-9);
    assert_eq!((row.match_again, row.again), (2, 3));
    // One number is far off, one second pass does not match.
    assert_eq!(scores.failures.len(), 2);
}

#[test]
fn marks_are_open_until_enough_trials_settle_them() {
    let plan = Plan::new(1, 1, &[]);
    let of = |trials: usize, wrong: usize| {
        let answers = vec![answer(&[]); trials];
        let outcomes: Vec<Outcome> = (0..trials)
            .map(|trial| {
                let false_name = found("gyro_scale", &[], &[]);
                outcome(if trial < wrong {
                    vec![false_name]
                } else {
                    Vec::new()
                })
            })
            .collect();
        score(&plan, &answers, &outcomes).marks[0].clone()
    };
    assert_eq!(of(60, 0).status, Status::Open);
    let enough = of(600, 0);
    assert_eq!(enough.status, Status::Met);
    assert!(enough.limits_95[1] < 5e-3);
    let missed = of(60, 2);
    assert_eq!((missed.status, missed.against.len()), (Status::Missed, 2));
}
