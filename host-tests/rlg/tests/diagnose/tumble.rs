//! Gyros of a unit that is turned by hand from one still position to the next.
//!
//! Truth: each turn is about one axis of the body, so that the rate is that axis times the derivative of the angle and the
//! attitude is known in closed form; the gyros' increments are differences of that angle.

use std::path::Path;

use nalgebra::{Rotation3, Unit, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::support::{holds, kinds, names_nothing};
use rlg::diagnose::result::{Diagnosis, EffectEntry, Verdict};
use rlg::diagnose::{Settings, diagnose, diagnose_without_reference};
use rlg::model::Model;
use rlg::recording::{AXES, Channel, Clock, Quantity, Recording, Site, Table};

const GRAVITY_M_S2: f64 = 9.81;
const LATITUDE_RAD: f64 = 0.84;
const EARTH_RAD_S: f64 = 7.292_115e-5;
const RATE_HZ: f64 = 50.0;
const TURN_ROWS: usize = 100;
const HELD_ROWS: usize = 400;

/// Concealed errors, and noise of the gyros.
#[derive(Clone, Copy)]
struct Hidden {
    bias_rad_s: Vector3<f64>,
    scale: Vector3<f64>,
    /// δ_xy and δ_zx.
    tilts_rad: [f64; 2],
    force_bias_m_s2: Vector3<f64>,
    walk_rad_sqrt_s: f64,
    /// Highest rate that the gyros read.
    stops_rad_s: f64,
    /// Turns about x alone.
    about_x: bool,
    site: bool,
}

const NONE: Hidden = Hidden {
    bias_rad_s: Vector3::new(0.0, 0.0, 0.0),
    scale: Vector3::new(0.0, 0.0, 0.0),
    tilts_rad: [0.0; 2],
    force_bias_m_s2: Vector3::new(0.0, 0.0, 0.0),
    walk_rad_sqrt_s: 1e-4,
    stops_rad_s: f64::INFINITY,
    about_x: false,
    site: true,
};

const UNIT: Hidden = Hidden {
    bias_rad_s: Vector3::new(0.01, -0.006, 0.004),
    scale: Vector3::new(0.004, 0.0, -0.003),
    tilts_rad: [3e-3, -2e-3],
    force_bias_m_s2: Vector3::new(0.02, -0.03, 0.01),
    ..NONE
};

/// Angle of a turn as a share of its whole: a smooth start and a smooth end.
fn smooth(share: f64) -> f64 {
    share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
}

/// Reads gyros with errors: each sensing axis is tilted, then scaled, then biased.
fn read(rate: &Vector3<f64>, hidden: &Hidden) -> Vector3<f64> {
    let tilts = [
        Vector3::new(0.0, hidden.tilts_rad[0], 0.0),
        Vector3::zeros(),
        Vector3::new(hidden.tilts_rad[1], 0.0, 0.0),
    ];
    Vector3::from_fn(|axis, _| {
        let own = Vector3::ith(axis, 1.0);
        let along = tilts[axis].cross(&own).dot(rate);
        rate[axis] * (1.0 + hidden.scale[axis]) + along + hidden.bias_rad_s[axis]
    })
}

/// Records `count` positions.
fn recorded(count: usize, hidden: &Hidden, seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let period_s = RATE_HZ.recip();
    let earth = EARTH_RAD_S * Vector3::new(LATITUDE_RAD.cos(), 0.0, LATITUDE_RAD.sin());
    let up = Vector3::z();
    let mut attitude = Rotation3::identity();
    let mut columns: [Vec<f64>; 6] = Default::default();
    for _ in 0..count {
        let axis = match hidden.about_x {
            true => Vector3::x_axis(),
            false => Unit::new_normalize(Vector3::from_fn(|_, _| normal())),
        };
        let whole_rad = 1.6 + 0.3 * normal();
        let seat = Vector3::from_fn(|_, _| 2e-4 * normal());
        for row in 0..TURN_ROWS + HELD_ROWS {
            let angle = |row: f64| whole_rad * smooth((row / TURN_ROWS as f64).min(1.0));
            let [begin, middle, end] = [0.0, 0.5, 1.0].map(|part| angle(row as f64 + part));
            let here = attitude * Rotation3::from_axis_angle(&axis, middle);
            let rate = axis.into_inner() * (end - begin) / period_s + here.inverse() * earth;
            let shake = if row < TURN_ROWS { 0.5 } else { 2e-3 };
            let force = here.inverse() * up * GRAVITY_M_S2 + hidden.force_bias_m_s2 + seat;
            let gyros = read(&rate, hidden);
            for axis in 0..3 {
                let noise = hidden.walk_rad_sqrt_s / period_s.sqrt() * normal();
                let read = gyros[axis] + noise;
                columns[axis].push(read.clamp(-hidden.stops_rad_s, hidden.stops_rad_s));
                columns[3 + axis].push(force[axis] + shake * normal());
            }
        }
        attitude *= Rotation3::from_axis_angle(&axis, whole_rad);
    }
    let rows = columns[0].len();
    let channels = columns.into_iter().enumerate().map(|(at, values)| Channel {
        column: format!("{}{}", if at < 3 { "g" } else { "a" }, AXES[at % 3]),
        quantity: if at < 3 {
            Quantity::GyroRate
        } else {
            Quantity::SpecificForce
        },
        axis: Some(AXES[at % 3].to_string()),
        scale: 1.0,
        offset: 0.0,
        values,
    });
    let site = Site {
        latitude_rad: LATITUDE_RAD,
        gravity_m_s2: GRAVITY_M_S2,
    };
    Recording {
        name: "tumble".to_string(),
        folder: "tumble".into(),
        site: hidden.site.then_some(site),
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

fn diagnosed(recording: &Recording, model: &Model) -> (Diagnosis, Model) {
    let outcome = diagnose(recording, model, Path::new("model.toml"), 0, &|_| {});
    let outcome = outcome.unwrap_or_else(|error| panic!("{error}"));
    (outcome.diagnosis, outcome.model)
}

fn ideal() -> Model {
    let quantities = [Quantity::GyroRate, Quantity::SpecificForce];
    rlg::import::still::ideal([0.0; 3], &quantities)
}

fn found<'a>(diagnosis: &'a Diagnosis, kind: &str) -> &'a EffectEntry {
    let own = diagnosis.effects.iter().find(|one| one.kind == kind);
    own.unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary))
}

fn axes(values: Vector3<f64>) -> [(&'static str, f64); 3] {
    [0, 1, 2].map(|axis| (AXES[axis], values[axis]))
}

#[test]
fn rests_and_turns_tell_bias_scale_and_misalignment_of_the_gyros() {
    let (diagnosis, model) = diagnosed(&recorded(20, &UNIT, 1), &ideal());
    assert_eq!(
        diagnosis.verdict,
        Verdict::Explained,
        "{:#?}",
        diagnosis.summary
    );
    let mut named = kinds(&diagnosis);
    named.sort_unstable();
    let all = ["accel_bias", "gyro_bias", "gyro_scale", "installation"];
    assert_eq!(named, all, "{:#?}", diagnosis.summary);
    holds(found(&diagnosis, "gyro_bias"), &axes(UNIT.bias_rad_s));
    holds(found(&diagnosis, "gyro_scale"), &axes(UNIT.scale));
    let [xy, zx] = UNIT.tilts_rad;
    let tilts = [
        ("xy", xy),
        ("zx", zx),
        ("xz", 0.0),
        ("yx", 0.0),
        ("yz", 0.0),
        ("zy", 0.0),
    ];
    holds(found(&diagnosis, "installation"), &tilts);
    for kind in ["gyro_scale", "installation"] {
        let widest = found(&diagnosis, kind)
            .identifiable
            .iter()
            .map(|one| one.std);
        assert!(widest.clone().fold(0.0, f64::max) < 4e-4, "{kind}");
    }
    let (again, _) = diagnosed(&recorded(20, &UNIT, 1), &model);
    names_nothing(&again, "the model that was written");
}

#[test]
fn no_error_of_the_gyros_is_named_where_there_is_none() {
    for seed in 0..8 {
        let hidden = Hidden {
            site: seed % 2 == 0,
            // From tactical grade to a phone's.
            walk_rad_sqrt_s: [3e-6, 1e-4, 1e-3][seed as usize % 3],
            ..NONE
        };
        let count = [6, 12, 20][seed as usize % 3];
        let (diagnosis, _) = diagnosed(&recorded(count, &hidden, seed), &ideal());
        names_nothing(&diagnosis, format!("seed {seed}, {count} positions"));
    }
}

/// Share of 3 σ intervals of unnamed and named parameters alike that hold the truth, over many units.
#[test]
fn intervals_of_biases_and_scale_errors_hold_the_truth() {
    let (mut held, mut all) = (0, 0);
    for seed in 10..22 {
        let (diagnosis, _) = diagnosed(&recorded(9, &UNIT, seed), &ideal());
        for (kind, truth) in [("gyro_bias", UNIT.bias_rad_s), ("gyro_scale", UNIT.scale)] {
            let Some(own) = diagnosis.effects.iter().find(|one| one.kind == kind) else {
                continue;
            };
            for (name, truth) in axes(truth) {
                let (value, std) = own.number(name).expect("listed");
                held += usize::from((value - truth).abs() < 3.0 * std);
                all += 1;
            }
        }
    }
    // Biases of twelve units at least; one interval in 370 misses its truth by chance.
    assert!(all >= 36 && held + 1 >= all, "{held} of {all}");
}

#[test]
fn turns_about_one_axis_tell_its_scale_and_say_what_they_do_not_tell() {
    let hidden = Hidden {
        about_x: true,
        scale: Vector3::new(0.02, 0.0, 0.0),
        ..NONE
    };
    let (diagnosis, _) = diagnosed(&recorded(12, &hidden, 2), &ideal());
    let scale = found(&diagnosis, "gyro_scale");
    let (value, std) = scale.number("x").expect("listed");
    assert!(
        (value - 0.02).abs() < 3.0 * std && std < 1e-3,
        "{value} ± {std}"
    );
    let (_, unseen) = scale.number("y").expect("listed");
    assert!(unseen > 0.05, "nothing turns about y: {unseen}");
    let tilts = diagnosis
        .not_excluded
        .iter()
        .find(|one| one.starts_with("installation:"));
    assert!(tilts.is_some(), "{:#?}", diagnosis.not_excluded);
}

#[test]
fn a_turn_with_lost_rows_is_left_out_and_turns_beyond_the_range_have_no_name() {
    let mut recording = recorded(16, &UNIT, 3);
    // In the fourth turn, from 30 to 32 s.
    for channel in &mut recording.tables[0].channels[..3] {
        channel.values[1530..1540].fill(f64::NAN);
    }
    let (diagnosis, _) = diagnosed(&recording, &ideal());
    let says = |words: &str| diagnosis.summary.iter().any(|line| line.contains(words));
    assert!(
        says("Left out: the turn between 29.5 and 32.5 s"),
        "{:#?}",
        diagnosis.summary
    );
    holds(found(&diagnosis, "gyro_scale"), &axes(UNIT.scale));
    let hidden = Hidden {
        stops_rad_s: 1.2,
        ..NONE
    };
    let (clipped, _) = diagnosed(&recorded(16, &hidden, 4), &ideal());
    // No scale error: the turns are not explained, and the verdict is that.
    assert!(kinds(&clipped).is_empty(), "{:#?}", clipped.summary);
    assert_eq!(clipped.verdict, Verdict::Unexplained);
    let left = |line: &String| line.starts_with("Left: the gyros miss the direction of gravity");
    assert!(clipped.summary.iter().any(left), "{:#?}", clipped.summary);
}

/// Bounds of the noise, and one sentence on all errors.
#[test]
fn gyros_without_any_reference_have_a_bound_of_their_noise_and_no_error() {
    for count in [3, 4] {
        let recording = recorded(count, &UNIT, 5);
        let settings = Settings::default();
        let told = diagnose_without_reference(&settings, &recording, &ideal(), &|_| {});
        let told = told.unwrap_or_else(|error| panic!("{error}")).diagnosis;
        assert_eq!(told.verdict, Verdict::Unusable);
        assert!(kinds(&told).is_empty(), "{:#?}", told.summary);
        assert!(
            told.summary[0].starts_with("Errors of the gyros"),
            "{:#?}",
            told.summary
        );
        let noise = told
            .summary
            .iter()
            .find(|line| line.starts_with("Noise: N at most"));
        let noise = noise.unwrap_or_else(|| panic!("{:#?}", told.summary));
        let true_walk = UNIT.walk_rad_sqrt_s.to_degrees() * 60.0;
        let bound = number_behind(noise, "at most x ");
        assert!((0.8..1.5).contains(&(bound / true_walk)), "{noise}");
    }
}

fn number_behind(line: &str, words: &str) -> f64 {
    let (_, rest) = line.split_once(words).unwrap_or_else(|| panic!("{line}"));
    let end = rest.find([' ', ',']).expect("more words");
    rest[..end].parse().unwrap_or_else(|_| panic!("{line}"))
}
