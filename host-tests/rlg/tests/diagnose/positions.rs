//! Accelerometers in still positions without a reference, with concealed errors identified by the length of gravity alone.

use std::path::Path;

use nalgebra::Vector3;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::support::{holds, kinds, names_nothing, number};
use rlg::challenge::acceptance::read_as::ReadAs;
use rlg::challenge::acceptance::run::{Plan, prepare};
use rlg::challenge::acceptance::table::{Scores, score};
use rlg::challenge::acceptance::under_test::UnderTest;
use rlg::challenge::marks::family::Family;
use rlg::diagnose::result::{Diagnosis, Verdict};
use rlg::diagnose::{Outcome, diagnose};
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::{AXES, Channel, Clock, Quantity, Recording, Site, Table};

const GRAVITY_M_S2: f64 = 9.81;
const RATE_HZ: f64 = 50.0;
const MOVED_S: f64 = 2.0;
const HELD_S: f64 = 8.0;

/// Concealed errors of a bench: by axis, and one angle between x and y.
#[derive(Clone, Copy, Default)]
struct Hidden {
    bias_m_s2: [f64; 3],
    scale: [f64; 3],
    skew_rad: f64,
}

/// Returns directions of up: faces, edges and corners of a cube, hand-held to half a degree.
fn ups(count: usize) -> Vec<Vector3<f64>> {
    let step = [-1.0, 0.0, 1.0];
    let mut all: Vec<Vector3<f64>> = step
        .iter()
        .flat_map(|x| step.map(move |y| (*x, y)))
        .flat_map(|(x, y)| step.map(move |z| Vector3::new(x, y, z)))
        .filter(|up| up.norm() > 0.5)
        .collect();
    all.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    all.into_iter()
        .take(count)
        .map(|up| up.normalize())
        .collect()
}

/// Makes a recording of so many positions; `more` adds to a sample in position and row.
fn recorded(
    count: usize,
    hidden: Hidden,
    more: impl Fn(usize, f64) -> Vector3<f64>,
    seed: u64,
) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut values: [Vec<f64>; 3] = Default::default();
    for (place, up) in ups(count).into_iter().enumerate() {
        let by_hand = Vector3::from_fn(|_, _| 0.01 * normal());
        let f = GRAVITY_M_S2 * (up + by_hand).normalize();
        let seat = Vector3::from_fn(|_, _| 2e-4 * normal());
        for row in 0..((MOVED_S + HELD_S) * RATE_HZ) as usize {
            let held_s = (f64::from(u32::try_from(row).expect("few")) + 0.5) / RATE_HZ - MOVED_S;
            let noise = if held_s < 0.0 { 2.0 } else { 2e-3 };
            let more = more(place, held_s);
            for axis in 0..3 {
                let skew = if axis == 0 {
                    hidden.skew_rad * f[1]
                } else {
                    0.0
                };
                let read = f[axis] * (1.0 + hidden.scale[axis]) + hidden.bias_m_s2[axis] + skew;
                values[axis].push(read + seat[axis] + more[axis] + noise * normal());
            }
        }
    }
    let rows = values[0].len();
    let channels = AXES.iter().zip(values).map(|(axis, values)| Channel {
        column: format!("a{axis}"),
        quantity: Quantity::SpecificForce,
        axis: Some((*axis).to_string()),
        scale: 1.0,
        offset: 0.0,
        values,
    });
    Recording {
        name: "tumble".to_string(),
        folder: "tumble".into(),
        site: Some(Site {
            latitude_rad: 0.8,
            gravity_m_s2: GRAVITY_M_S2,
        }),
        tables: vec![Table {
            file: "samples.csv".to_string(),
            clock: Clock::Uniform {
                rate_hz: RATE_HZ,
                start_s: 0.0,
            },
            rows,
            channels: channels.collect(),
        }],
        segments: Vec::new(),
    }
}

/// Records one position for two minutes.
fn recorded_at_rest(more: impl Fn(usize, f64) -> Vector3<f64>) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut recording = recorded(1, Hidden::default(), none, 12);
    let rows = (120.0 * RATE_HZ) as usize;
    for (axis, channel) in recording.tables[0].channels.iter_mut().enumerate() {
        let still = if axis == 0 { GRAVITY_M_S2 } else { 0.0 };
        let read = (0..rows).map(|row| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let held_s = (row as f64 + 0.5) / RATE_HZ;
            still + 2e-3 * noise + more(0, held_s)[axis]
        });
        channel.values = read.collect();
    }
    recording.tables[0].rows = rows;
    recording
}

fn none(_: usize, _: f64) -> Vector3<f64> {
    Vector3::zeros()
}

fn ideal() -> Model {
    rlg::import::still::ideal([0.0; 3], &[Quantity::SpecificForce])
}

fn tried(recording: &Recording, model: &Model) -> Result<Outcome, InputError> {
    diagnose(recording, model, Path::new("model.toml"), 0, &|_| {})
}

fn diagnosed(recording: &Recording, model: &Model) -> Outcome {
    tried(recording, model).unwrap_or_else(|error| panic!("{error}"))
}

const UNIT: Hidden = Hidden {
    bias_m_s2: [0.02, -0.03, 0.01],
    scale: [1e-3, -2e-3, 5e-4],
    skew_rad: 1e-3,
};

fn bias_and_scale(diagnosis: &Diagnosis) {
    for (kind, truth) in [("accel_bias", UNIT.bias_m_s2), ("accel_scale", UNIT.scale)] {
        let own = diagnosis.effects.iter().find(|one| one.kind == kind);
        let own = own.unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary));
        let named: Vec<(&str, f64)> = AXES.into_iter().zip(truth).collect();
        holds(own, &named);
    }
}

#[test]
fn a_tumble_tells_bias_scale_and_the_angles_between_the_axes() {
    let recording = recorded(24, UNIT, none, 3);
    let outcome = diagnosed(&recording, &ideal());
    let diagnosis = &outcome.diagnosis;
    let mut named = kinds(diagnosis);
    named.sort_unstable();
    let all = ["accel_bias", "accel_misalignment", "accel_scale"];
    assert_eq!(named, all, "{:#?}", diagnosis.summary);
    assert_eq!(diagnosis.verdict, Verdict::Explained);
    bias_and_scale(diagnosis);
    // f_x += 1e-3 f_y is δ_xz; δ_xz − δ_yz is the combination identifiable from gravity.
    let tilts = diagnosis.effects.iter().find(|one| one.kind == all[1]);
    let mut combinations = tilts.expect("named").identifiable.iter();
    let xz = combinations.find(|one| one.combination.contains_key("xz"));
    let xz = xz.expect("the angle between x and y");
    assert_eq!(xz.combination["yz"], -1.0);
    assert!((xz.value - UNIT.skew_rad).abs() < 4.0 * xz.std, "{xz:?}");
    assert!(xz.std < 1e-4, "{xz:?}");
    let figures = &diagnosis.fit.channels[0];
    assert!(figures.held_out_before.normalised_power > 100.0);
    assert!(figures.held_out_after.normalised_power < 4.0, "{figures:?}");
    let again = diagnosed(&recording, &outcome.model).diagnosis;
    names_nothing(&again, "the model that was written");
}

#[test]
fn nothing_concealed_in_positions_is_nothing_found() {
    for seed in 0..6 {
        let count = [6, 12, 24][seed as usize % 3];
        let recording = recorded(count, Hidden::default(), none, seed);
        let diagnosis = diagnosed(&recording, &ideal()).diagnosis;
        names_nothing(&diagnosis, format!("seed {seed}, {count} positions"));
    }
}

#[test]
fn six_faces_tell_bias_and_scale_and_say_that_they_tell_no_angles() {
    let hidden = Hidden {
        skew_rad: 0.0,
        ..UNIT
    };
    let outcome = diagnosed(&recorded(6, hidden, none, 4), &ideal());
    let diagnosis = &outcome.diagnosis;
    bias_and_scale(diagnosis);
    let says = |kind: &str| {
        diagnosis
            .not_excluded
            .iter()
            .any(|one| one.starts_with(kind))
    };
    assert!(says("accel_misalignment:"), "{:#?}", diagnosis.not_excluded);
    assert!(says("accel_delay:") && says("size_effect:"));
}

#[test]
fn what_is_knocked_or_shaken_is_left_out_and_changes_nothing() {
    let disturbed = |place: usize, held_s: f64| match place {
        // A knock, of a moment, and a motor, of the whole position.
        4 if (3.0..3.1).contains(&held_s) => Vector3::repeat(5.0),
        9 if held_s > 0.0 => Vector3::x() * 0.3 * (45.0 * held_s).sin(),
        _ => Vector3::zeros(),
    };
    let diagnosis = diagnosed(&recorded(24, UNIT, disturbed, 5), &ideal()).diagnosis;
    bias_and_scale(&diagnosis);
    let says = |words: &str| diagnosis.summary.iter().any(|line| line.contains(words));
    assert!(says("Still positions: 23 in"), "{:#?}", diagnosis.summary);
    assert!(says("was held, but not still"), "{:#?}", diagnosis.summary);
}

#[test]
fn a_position_that_does_not_fit_is_no_error_of_the_accelerometers() {
    let leaned_on = |place: usize, held_s: f64| match place {
        7 if held_s > 0.0 => Vector3::repeat(0.05),
        _ => Vector3::zeros(),
    };
    let recording = recorded(18, Hidden::default(), leaned_on, 6);
    let diagnosis = diagnosed(&recording, &ideal()).diagnosis;
    assert_eq!(kinds(&diagnosis), ["unlisted"], "{:#?}", diagnosis.summary);
    assert_eq!(diagnosis.verdict, Verdict::Unexplained);
    let place = diagnosis
        .locations
        .iter()
        .find(|one| one.regime == "position 8");
    let place = place.unwrap_or_else(|| panic!("{:#?}", diagnosis.locations));
    assert!((place.start_s - 72.0).abs() < 2.0, "{place:?}");
}

#[test]
fn positions_that_only_test_change_no_finding() {
    let before = diagnosed(&recorded(24, UNIT, none, 7), &ideal()).diagnosis;
    // Every fifth position is for testing only.
    let poisoned = |place: usize, held_s: f64| match place % 5 == 4 && held_s > 0.0 {
        true => Vector3::repeat(0.3),
        false => Vector3::zeros(),
    };
    let after = diagnosed(&recorded(24, UNIT, poisoned, 7), &ideal()).diagnosis;
    let text = |one: &Diagnosis| serde_json::to_string(&one.effects).expect("JSON");
    assert_eq!(text(&before), text(&after));
    let power = |one: &Diagnosis| one.fit.channels[0].held_out_after.normalised_power;
    assert!(power(&after) > 100.0 * power(&before), "they test");
}

#[test]
fn too_few_attitudes_say_nothing_and_too_few_channels_are_refused() {
    let diagnosis = diagnosed(&recorded(2, UNIT, none, 8), &ideal()).diagnosis;
    assert_eq!(diagnosis.verdict, Verdict::Unusable);
    let words = &diagnosis.summary[0];
    assert!(words.contains("in 2 attitudes, and 3 at least"), "{words}");
    // Noise and a line of one rest are found all the same: 2e-3 m/s² a row at 50 Hz, 0.05 m/s² at 7.3 Hz on y.
    let hums = |_: usize, held_s: f64| match held_s > 0.0 {
        true => Vector3::y() * 0.05 * (std::f64::consts::TAU * 7.3 * held_s).sin(),
        false => Vector3::zeros(),
    };
    let one = diagnosed(&recorded_at_rest(hums), &ideal()).diagnosis;
    assert_eq!(one.verdict, Verdict::Unusable);
    let says = |words: &str| one.summary.iter().any(|line| line.contains(words));
    assert!(says("in 1 attitude"), "{:#?}", one.summary);
    let line = one.summary.iter().find(|line| line.starts_with("Lines: "));
    let line = line.unwrap_or_else(|| panic!("{:#?}", one.summary));
    let size = line.strip_prefix("Lines: accelerometer y: 7.30 Hz of ");
    let size = size.and_then(|size| size.split(' ').next()?.parse::<f64>().ok());
    // Between two coefficients some per cent of a line's amplitude lie farther off.
    assert!(
        (size.expect("one line") / 0.05 - 1.0).abs() < 0.05,
        "{line}"
    );
    let noise = one.accelerometer_noise[0].noise_m_s2_sqrt_hz;
    let truth = 2e-3 * (2.0 / RATE_HZ).sqrt();
    assert!((noise / truth - 1.0).abs() < 0.1, "{noise} {truth}");
    let mut recording = recorded(6, UNIT, none, 8);
    recording.tables[0].channels.pop();
    let Err(error) = tried(&recording, &ideal()) else {
        panic!("two accelerometers are diagnosed");
    };
    let words = error.to_string();
    assert!(
        words.contains("no accelerometer channels on all three axes"),
        "{words}"
    );
    assert!(
        words.contains("specific_force or velocity_increment"),
        "{words}"
    );
}

#[test]
fn without_a_site_a_scale_error_of_all_three_is_known_as_well_as_gravity() {
    let hidden = Hidden {
        scale: [0.02; 3],
        ..Hidden::default()
    };
    let mut recording = recorded(24, hidden, none, 9);
    recording.site = None;
    let diagnosis = diagnosed(&recording, &ideal()).diagnosis;
    assert_eq!(
        kinds(&diagnosis),
        ["accel_scale"],
        "{:#?}",
        diagnosis.summary
    );
    let (_, std) = number(&diagnosis.effects[0], "x");
    // 0.02 m/s² of gravity.
    assert!((1e-3..4e-3).contains(&std), "{std}");
    holds(&diagnosis.effects[0], &AXES.map(|axis| (axis, 0.02)));
}

fn scores(trials: u64, planted: &[&str]) -> Scores {
    let mut plan = Plan::new(71, trials, &[Family::Positions]);
    plan.planted = planted.iter().map(ToString::to_string).collect();
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

/// A few trials of the hundreds in docs/measured.md.
#[test]
fn drawn_positions_get_no_false_name_and_most_units_their_right_ones() {
    let nulls = scores(20, &["none"]);
    assert!(nulls.marks[0].hits == 0, "{}", nulls.table());
    let new = scores(10, &["new_unit"]);
    let counts = new.effects.iter().fold([0, 0], |[right, wrong], row| {
        [right + row.counts.right, wrong + row.counts.wrong]
    });
    assert!(counts[0] >= 8 && counts[1] == 0, "{}", new.table());
}
