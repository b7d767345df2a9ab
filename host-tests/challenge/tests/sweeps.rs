//! Trials beside attitudes, at rest and with accelerometers: the generator against closed forms, and the diagnosis on a few of them.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_challenge::acceptance::read_as::ReadAs;
use rlg_challenge::acceptance::run::{Plan, prepare};
use rlg_challenge::acceptance::table::{Scores, score};
use rlg_challenge::acceptance::under_test::UnderTest;
use rlg_challenge::attitude::courses::COURSES;
use rlg_challenge::attitude::path::Path;
use rlg_challenge::attitude::planted::Planted;
use rlg_challenge::attitude::trial::Attitudes;
use rlg_challenge::attitude::{low_pass, record};
use rlg_challenge::force;
use rlg_challenge::force::trial::Turned;
use rlg_challenge::marks::case::Case;
use rlg_challenge::marks::effects::Effect;
use rlg_challenge::marks::family::Family;
use rlg_challenge::marks::motion::{Motion, Term};
use rlg_challenge::marks::setting::Limits;
use rlg_challenge::rest;
use rlg_challenge::rest::trial::Still;
use rlg_recording::{Clock, Quantity, Recording};

fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A cone: the rate turns about z in the body, and has a constant part along z.
fn cone(rate_rad_s: f64, turning_rad_s: f64, spin_rad_s: f64) -> Motion {
    let sine = |phase_rad: f64| Term::Sine {
        amplitude_rad: rate_rad_s / turning_rad_s,
        angular_frequency_rad_s: turning_rad_s,
        phase_rad,
    };
    let spin = Term::Spin {
        rate_rad_s: spin_rad_s,
    };
    Motion {
        // rates a cos Ωt and a sin Ωt
        terms: [vec![sine(0.0)], vec![sine(-PI / 2.0)], vec![spin]],
    }
}

#[test]
fn a_cone_is_integrated_as_its_closed_form_says() {
    let (rate, turning, spin) = (2.5, 2.0 * PI * 6.0, 0.3);
    let motion = cone(rate, turning, spin);
    let path = Path::new(&motion, 0.0, 0.01, 6000);
    // In a frame that turns with the rate this is constant: q = exp(w t) exp(−Ω t z), w = (a, 0, s + Ω).
    for time_s in [0.0137, 1.0, 17.301, 59.999] {
        let constant = Vector3::new(rate, 0.0, spin + turning);
        let exact = UnitQuaternion::from_scaled_axis(constant * time_s)
            * UnitQuaternion::from_scaled_axis(-Vector3::z() * (turning * time_s));
        let off = path.at(time_s).angle_to(&exact);
        // A step's error is below h⁵ Ω⁴ a / 720 = 2e-13 rad, there are 96 000.
        assert!(off < 2e-8, "{time_s} s: {off} rad");
    }
}

/// A case with a sine about each axis.
fn case_of(motion: &Motion, period_s: f64, rows: usize) -> Case {
    Case {
        motion: motion.clone(),
        rows,
        period_s,
        increments_rad: std::array::from_fn(|axis| {
            motion.increments_rad(axis, 0.0, period_s, rows)
        }),
        warming_k: None,
        force_m_s2: None,
    }
}

#[test]
fn a_pole_makes_sines_late_and_small_as_its_closed_form_says() {
    let (frequency_hz, pole_s) = (3.0, 0.02);
    let turning = 2.0 * PI * frequency_hz;
    let of = |amplitude_rad: f64, phase_rad: f64| Motion {
        terms: std::array::from_fn(|axis| {
            vec![Term::Sine {
                amplitude_rad,
                angular_frequency_rad_s: turning,
                phase_rad: phase_rad + axis as f64,
            }]
        }),
    };
    let case = case_of(&of(0.2, 0.4), 0.01, 500);
    let late_rad = (turning * pole_s).atan();
    let exact = case_of(&of(0.2 * late_rad.cos(), 0.4 - late_rad), 0.01, 500);
    let added = low_pass::added_rad(&case, pole_s);
    for (axis, added) in added.iter().enumerate() {
        let pairs = case.increments_rad[axis]
            .iter()
            .zip(&exact.increments_rad[axis]);
        for (row, ((whole, exact), added)) in pairs.zip(added).enumerate() {
            let off = whole + added - exact;
            assert!(off.abs() < 1e-9, "row {row}: {off} rad");
        }
    }
}

/// Attitudes of a recording with their stamps [s].
fn attitudes(recording: &Recording) -> Vec<(f64, UnitQuaternion<f64>)> {
    let of = |axis: &str| {
        recording
            .channel(&Quantity::ReferenceAttitude, axis)
            .expect("recorded")
    };
    let (table, w) = of("w");
    let Clock::Stamped { stamps_s, .. } = &table.clock else {
        panic!("attitudes are stamped");
    };
    let [x, y, z] = ["x", "y", "z"].map(|axis| &of(axis).1.values);
    let quaternion = |row: usize| nalgebra::Quaternion::new(w.values[row], x[row], y[row], z[row]);
    let stamps = stamps_s.iter().enumerate();
    stamps
        .map(|(row, time_s)| (*time_s, UnitQuaternion::from_quaternion(quaternion(row))))
        .collect()
}

/// Increments of the gyros by the model of a trial [rad by row].
fn turned_rad(recording: &Recording, drawn: &Attitudes) -> Vec<Vector3<f64>> {
    let gyro = |axis: &str| {
        let counted = recording.channel(&Quantity::GyroIncrement, axis);
        let period_s = drawn.period_s();
        match counted.or_else(|| recording.channel(&Quantity::GyroRate, axis)) {
            Some((_, channel)) if channel.quantity == Quantity::GyroRate => {
                channel.values.iter().map(|rate| rate * period_s).collect()
            }
            Some((_, channel)) => channel.values.clone(),
            None => panic!("gyros are recorded"),
        }
    };
    let sensed: [Vec<f64>; 3] = ["x", "y", "z"].map(gyro);
    let body_from_sensing = drawn
        .unit
        .sensing_from_body()
        .try_inverse()
        .expect("small angles");
    (0..drawn.rows)
        .map(|row| {
            body_from_sensing
                * Vector3::from_fn(|axis, _| {
                    let scale = 1.0 - drawn.unit.scale_error[axis];
                    let bias = drawn.unit.bias_rad_s[axis] * drawn.period_s() / scale;
                    sensed[axis][row] * scale - bias
                })
        })
        .collect()
}

/// Growth of the error of the gyros' attitude between the stamps of an effect-free recording, over what its noise makes.
fn power_of_a_null(drawn: &Attitudes, recording: &Recording) -> f64 {
    let turned = turned_rad(recording, drawn);
    let mut by_gyros = vec![UnitQuaternion::identity()];
    let mut before = Vector3::zeros();
    for turn in turned {
        // Savage 1998, Eq. (38): the cone within a row by that row and the one before.
        let rotation = turn + before.cross(&turn) / 12.0;
        let last = by_gyros[by_gyros.len() - 1];
        by_gyros.push(last * UnitQuaternion::from_scaled_axis(rotation));
        before = turn;
    }
    let errors: Vec<(f64, Vector3<f64>)> = attitudes(recording)
        .into_iter()
        .map(|(time_s, shown)| {
            let place = time_s * drawn.rate_hz;
            let row = place.round() as usize;
            let own = by_gyros[row];
            (
                time_s,
                (shown * own.inverse() * drawn.frame.inverse()).scaled_axis(),
            )
        })
        .collect();
    let walk = drawn.walk_rad_sqrt_s.iter().copied().fold(0.0, f64::max);
    let pairs = errors.windows(2);
    let squares: Vec<f64> = pairs
        .map(|pair| {
            let stamps = 2.0 * drawn.reference.white_rad.powi(2);
            let gyros = walk * walk * (pair[1].0 - pair[0].0);
            (pair[1].1 - pair[0].1).norm_squared() / (3.0 * (stamps + gyros))
        })
        .collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

#[test]
fn gyros_and_attitudes_of_a_null_agree_within_their_noise() {
    let mut tested = 0;
    for seed in 0..24 {
        let drawn = Attitudes::draw(0, &mut generator(seed)).expect("drawn");
        assert_eq!(drawn.planted, Planted::None);
        // Stamps between rows would ask for an interpolation, and the wandering error has no white growth.
        if drawn.reference.jitter_s > 0.0 || drawn.reference.wander_rad > 0.0 {
            continue;
        }
        let is_on_rows = (drawn.rate_hz / drawn.reference.rate_hz).fract() == 0.0;
        if !is_on_rows {
            continue;
        }
        tested += 1;
        let (recording, _) = record::record(&drawn, seed);
        let power = power_of_a_null(&drawn, &recording);
        let stamps = drawn.stamps_s.len() as f64;
        // Gyros quieter than the noisiest make it less by a little, where their walk matters.
        let most = 5.0 * (2.0 / stamps).sqrt();
        assert!(
            power < 1.0 + most && power > 0.75 - most,
            "seed {seed}, {:?}: {power}",
            drawn.conditions()
        );
    }
    assert!(tested > 4, "{tested}");
}

#[test]
fn every_motion_turns_the_case_and_every_effect_is_as_strong_as_asked() {
    let mut rng = generator(2);
    for course in COURSES {
        let motion = course.draw((100.0, 60.0), &mut rng);
        assert!((0..3).any(|axis| motion.moves(axis)), "{course:?}");
    }
    for number in 0..17 {
        let drawn = Attitudes::draw(number, &mut generator(100 + number)).expect("drawn");
        let concealed = drawn.concealed();
        let is_null = drawn.planted == Planted::None;
        assert_eq!(concealed.is_empty(), is_null, "{:?}", drawn.planted);
        for one in concealed.iter().filter(|one| one.kind != "lost_samples") {
            assert!(one.rho >= 10.0, "{one:?}");
        }
        if let Some(strong) = &drawn.effect {
            let largest: f64 = Effect::largest(&strong.effect);
            assert!(
                largest <= drawn.grade.largest(strong.effect.kind),
                "{strong:?}"
            );
        }
    }
}

/// At-rest trials of the first numbers, 60 to some 100 s.
fn still(number: u64, seed: u64) -> Still {
    let limits = Limits {
        length_s: [60.0, 1200.0],
        most_rows: 10_000.0,
        declared_within: 1.0,
    };
    Still::draw(number, &limits, &mut generator(seed)).expect("drawn")
}

#[test]
fn a_unit_at_rest_reads_the_earth_its_bias_and_its_lines() {
    for number in 0..15 {
        let drawn = still(number, 40 + number);
        let (recording, model) = rest::record::record(&drawn, number);
        assert_eq!(recording.site, Some(drawn.site));
        let case = drawn.case();
        let earth_rad_s = Vector3::from_fn(|axis, _| case.increments_rad[axis][0] * drawn.rate_hz);
        // WGS-84, and its part along the vertical, up in the body.
        assert!((earth_rad_s.norm() / 7.292_115e-5 - 1.0).abs() < 1e-9);
        let up = drawn.body_from_level * Vector3::z();
        let vertical = earth_rad_s.dot(&up) / 7.292_115e-5;
        assert!((vertical - drawn.site.latitude_rad.sin()).abs() < 1e-9);
        let is_declared = model.gyro.angle_random_walk_rad_sqrt_s.is_some();
        assert!(is_declared || drawn.planted != rest::planted::Planted::AngleRandomWalk);
        for line in &drawn.lines {
            let concealed = line.concealed();
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                let shown = amplitude(&recording, name, line.frequency_hz, drawn.rate_hz);
                let truth = concealed.parameters[name].as_f64().expect("a number");
                let length_s = drawn.rows as f64 / drawn.rate_hz;
                let spread = drawn.levels[axis].walk_rad_sqrt_s * (2.0 / length_s).sqrt();
                // Other lines and the Earth's rate reach in by a tenth of a resolution's distance.
                let others: f64 = drawn
                    .lines
                    .iter()
                    .map(|one| one.amplitude_rad_s[axis])
                    .sum();
                let most = 4.5 * spread + 0.06 * (others + earth_rad_s.norm());
                assert!(
                    (shown - truth).abs() < most,
                    "{number} {name}: {shown} {truth}"
                );
            }
        }
    }
}

/// Amplitude of a gyro's rate at a frequency [rad/s].
fn amplitude(recording: &Recording, axis: &str, frequency_hz: f64, rate_hz: f64) -> f64 {
    let counted = recording.channel(&Quantity::GyroIncrement, axis);
    let (factor, values) = match counted {
        Some((_, channel)) => (rate_hz, &channel.values),
        None => match recording.channel(&Quantity::GyroRate, axis) {
            Some((_, channel)) => (1.0, &channel.values),
            None => panic!("gyros are recorded"),
        },
    };
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let turn = 2.0 * PI * frequency_hz / rate_hz;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (row, value) in values.iter().enumerate() {
        let (sin, cos) = (turn * row as f64).sin_cos();
        sine += (value - mean) * sin;
        cosine += (value - mean) * cos;
    }
    factor * 2.0 / values.len() as f64 * f64::hypot(sine, cosine)
}

/// Scores of the first trials of a family that plant something, diagnosed twice.
fn scores(family: Family, planted: &str, trials: u64) -> Scores {
    let mut plan = Plan::new(61, trials, &[family]);
    plan.planted = vec![planted.to_owned()];
    plan.most_rows = 6000.0;
    let prepared = prepare(&plan, &|| {}).expect("drawn");
    let under_test = UnderTest::new(rlg_plan::Plan::default(), true, ReadAs::Whole);
    let told = (plan.seed, plan.declares);
    let done = prepared.diagnose(told, Some(&under_test), None, &|| {});
    let outcomes: Vec<_> = done
        .expect("recorded")
        .into_iter()
        .map(|(one, _)| one)
        .collect();
    score(&plan, &prepared.answers, &outcomes)
}

/// The assertions on a few trials here hold for hundreds (docs/measured.md, "Beside attitudes and at rest").
#[test]
fn biases_beside_attitudes_are_named_and_few_recordings_without_effects_are() {
    let biased = scores(Family::Attitude, "gyro_bias", 4);
    let [row] = biased.effects.as_slice() else {
        panic!("{:?}", biased.effects);
    };
    // One of ρ 11 in half a minute is in too few blocks to be named (docs/limits.md).
    assert!(row.counts.right >= 3, "{}", biased.table());
    assert_eq!(
        (row.counts.wrong, row.match_again),
        (0, 4),
        "{}",
        biased.table()
    );
    let nulls = scores(Family::Attitude, "none", 5);
    // Four of a hundred have a false name.
    assert!(nulls.effects[0].counts.wrong <= 1, "{}", nulls.table());
}

#[test]
fn at_rest_nothing_is_named_where_nothing_is() {
    let nulls = scores(Family::Rest, "none", 3);
    let counts = nulls.effects[0].counts;
    assert_eq!((counts.right, counts.all()), (3, 3), "{}", nulls.table());
}

/// The first row of the accelerometers is gravity in length and direction where nothing is planted into them, but for
/// noise, pulses and what the unit turns meanwhile.
#[test]
fn a_turned_unit_feels_gravity() {
    let limits = Limits {
        length_s: [20.0, 40.0],
        most_rows: 4000.0,
        declared_within: 1.0,
    };
    for number in 0..18 {
        let drawn = Turned::draw(number, &limits, &mut generator(60 + number)).expect("drawn");
        assert!(drawn.concealed().iter().all(|one| one.rho >= 9.0));
        let is_null = drawn.planted == force::planted::Planted::None;
        assert_eq!(drawn.concealed().is_empty(), is_null);
        let (recording, model) = force::record::record(&drawn, number);
        let (count, period_s) = drawn.span();
        let read = Vector3::from_fn(|axis, _| {
            let name = ["x", "y", "z"][axis];
            let force = recording.channel(&Quantity::SpecificForce, name);
            let counted = recording.channel(&Quantity::VelocityIncrement, name);
            let (values, per_row) = match (force, counted) {
                (Some((_, channel)), _) => (&channel.values, 1.0),
                (_, Some((_, channel))) => (&channel.values, 1.0 / period_s),
                _ => panic!("accelerometers are recorded"),
            };
            assert_eq!(values.len(), count);
            let known = model.accelerometer.as_ref();
            let keeps = known.map_or(1.0, |known| 1.0 - known.scale_error[axis]);
            let bias = known.map_or(0.0, |known| known.bias_m_s2[axis]);
            values[0] * per_row * keeps - bias
        });
        if drawn.effect.is_some() {
            continue;
        }
        let noise = 6.0 * drawn.noise.walk_rad_sqrt_s / period_s.sqrt()
            + drawn.noise.flicker_rad_s * 6.0
            + drawn.pulse_m_s.unwrap_or(0.0) / period_s;
        let motion = &drawn.rows.motion;
        let turned_rad: f64 = (0..3)
            .map(|axis| motion.increments_rad(axis, 0.0, period_s, 1)[0].abs())
            .sum();
        let gravity = drawn.level.gravity_m_s2;
        let longer = read.norm() - gravity;
        let most = 2.0 * noise + gravity * turned_rad * turned_rad;
        assert!(longer.abs() < most, "{number}: {longer} {most}");
        let off = (read - gravity * drawn.level.up).norm();
        let most = 2.0 * noise + 2.0 * gravity * turned_rad;
        assert!(off < most, "{number}: {off} {most}");
    }
}
