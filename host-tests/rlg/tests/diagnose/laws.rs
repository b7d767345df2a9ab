//! Laws of the diagnosis (metamorphic relations; Chen, Cheung & Yiu 1998): a recording changed in a known way has findings
//! changed in a known way.
//!
//! One recording of installation errors and a late reference, and each law of it alone. Laws tested elsewhere: any number of
//! threads writes the same bytes (`independence`), and formats of others come back bit for bit (`files/export`).

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use assert_cmd::Command;
use rlg::diagnose::result::{Diagnosis, ParameterEntry, Verdict};
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::model::Model;
use rlg::recording::{AXES, Channel, Clock, Quantity, Recording};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;

use super::support::{WITHIN, concealed};

const RATE_HZ: f64 = 200.0;

/// Delay of the reference: a fifth of a row.
const LATE_S: f64 = 1e-3;

const TILTS: [(&str, f64); 6] = [
    ("xy", 1.1e-3),
    ("xz", -0.7e-3),
    ("yx", 0.9e-3),
    ("yz", 1.6e-3),
    ("zx", -1.3e-3),
    ("zy", 0.5e-3),
];

/// Name and value of each parameter with its standard deviation.
type Numbers = BTreeMap<String, (f64, f64)>;

/// Verdict, and the numbers and class of each finding by its kind.
#[derive(Debug, Clone, PartialEq)]
struct Answer {
    verdict: Verdict,
    findings: BTreeMap<String, (Numbers, Vec<String>)>,
}

/// Twenty seconds of oscillations about three axes; no noise is declared.
static BASE: LazyLock<(Recording, Model)> = LazyLock::new(|| {
    let text = format!(
        "format = 1\nname = \"laws\"\nrate_hz = {RATE_HZ:.1}\n\
         [site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\nearth_rate = false\n\
         [gyro]\noutput = \"increment\"\npulse_weight_rad = [1e-9, 1e-9, 1e-9]\n\
         bias_rad_s = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
         angle_random_walk_rad_sqrt_s = [1e-5, 1e-5, 1e-5]\n\
         installation_rad = {{ xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }}\n\
         [reference]\nangle_noise_rad = 0.0\nangle_random_walk_rad_sqrt_s = 1e-5\nweight_rad = 1e-9\n\
         [[motion]]\nkind = \"tumble\"\nrate_rad_s = [0.5, 0.5, 0.5]\nduration_s = 20.0\n\
         frequency_hz = [0.7, 1.3, 1.9]\nphase_rad = [0.0, 1.0, 2.0]\nramp_s = 1.0\n{}{}",
        concealed("installation", &TILTS),
        concealed("reference_delay", &[("all", LATE_S)])
    );
    let scenario = Scenario::parse(&text, Path::new("laws.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 3, |_| {});
    let mut model = simulation.model;
    model.reference = None;
    model.gyro.angle_random_walk_rad_sqrt_s = None;
    (simulation.recording, model)
});

/// Findings of the recording itself: those that were concealed.
static OF_BASE: LazyLock<Answer> = LazyLock::new(|| {
    let answer = answer(&outcome(&BASE.0, &BASE.1).diagnosis);
    let kinds: Vec<&String> = answer.findings.keys().collect();
    assert_eq!(kinds, ["installation", "reference_delay"], "{answer:#?}");
    assert_eq!(answer.verdict, Verdict::Explained, "{answer:#?}");
    let truth = TILTS.into_iter().chain([("all", LATE_S)]);
    for (name, truth) in truth {
        let mut numbers = answer.findings.values().map(|(numbers, _)| numbers);
        let (value, std) = numbers.find_map(|all| all.get(name)).expect("a number");
        assert!((value - truth).abs() < WITHIN * std, "{name} {value} {std}");
    }
    answer
});

fn outcome(recording: &Recording, model: &Model) -> Outcome {
    let file = Path::new("model.toml");
    let outcome = diagnose_under(&Settings::default(), recording, model, file, &|_| {});
    outcome.unwrap_or_else(|error| panic!("{error}"))
}

fn answer(diagnosis: &Diagnosis) -> Answer {
    let findings = diagnosis.effects.iter().map(|effect| {
        let numbers = effect.parameters.iter().filter_map(|one| match one {
            ParameterEntry::Number {
                name, value, std, ..
            } => Some((name.clone(), (*value, *std))),
            ParameterEntry::Text { .. } => None,
        });
        let mut class = effect.indistinguishable_from.clone();
        class.sort();
        (effect.kind.clone(), (numbers.collect(), class))
    });
    Answer {
        verdict: diagnosis.verdict,
        findings: findings.collect(),
    }
}

/// Findings of the recording after a change.
fn changed(change: impl Fn(&mut Recording)) -> Answer {
    let mut recording = BASE.0.clone();
    change(&mut recording);
    answer(&outcome(&recording, &BASE.1).diagnosis)
}

impl Answer {
    /// Answer with other names or values of its parameters.
    fn with(&self, map: impl Fn(&str, &str, f64) -> (String, f64)) -> Self {
        let mut mapped = self.clone();
        for (kind, (numbers, _)) in &mut mapped.findings {
            let each = std::mem::take(numbers).into_iter();
            *numbers = each
                .map(|(name, (value, std))| {
                    let (name, value) = map(kind, &name, value);
                    (name, (value, std))
                })
                .collect();
        }
        mapped
    }

    /// Answer with its headlines alone.
    fn headlines(mut self) -> Self {
        self.findings
            .values_mut()
            .for_each(|(_, class)| class.clear());
        self
    }

    /// Checks for the verdict, kinds, classes and parameters of `expected`, each value within `deviations` of its
    /// standard deviations.
    fn agrees(&self, expected: &Self, deviations: f64) {
        let shape = |one: &Self| -> Vec<(String, Vec<String>, Vec<String>)> {
            let findings = one.findings.iter();
            let each = findings.map(|(kind, (numbers, class))| {
                let names = numbers.keys().cloned().collect();
                (kind.clone(), names, class.clone())
            });
            each.collect()
        };
        assert_eq!(shape(self), shape(expected), "{self:#?}\n{expected:#?}");
        assert_eq!(self.verdict, expected.verdict, "{self:#?}");
        for (kind, (numbers, _)) in &self.findings {
            for (name, (value, std)) in numbers {
                let (expected, _) = expected.findings[kind].0[name];
                let apart = (value - expected).abs() / std;
                assert!(apart < deviations, "{kind} {name}: {value} {expected}");
            }
        }
    }
}

/// Applies a change to the values of each channel, given its axis.
fn each_channel(recording: &mut Recording, change: impl Fn(usize, &mut Vec<f64>)) {
    for table in &mut recording.tables {
        for channel in &mut table.channels {
            let axis = AXES
                .iter()
                .position(|name| channel.axis.as_deref() == Some(name));
            change(axis.expect("an axis"), &mut channel.values);
        }
        table.rows = table.channels[0].values.len();
    }
}

fn is_of_gyro(channel: &Channel) -> bool {
    Quantity::GYROS.contains(&channel.quantity)
}

/// Writes the recording with its table in a file of that name, and reads it again.
fn stored(file: &str) -> Recording {
    let folder = tempfile::tempdir().expect("a folder");
    let mut recording = BASE.0.clone();
    recording.tables[0].file = file.to_owned();
    let folder = folder.path().join("laws");
    recording.write_to(&folder).expect("a recording");
    Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"))
}

fn rates_hz(recording: &mut Recording, factor: f64) {
    for table in &mut recording.tables {
        if let Clock::Uniform { rate_hz, .. } = &mut table.clock {
            *rate_hz *= factor;
        }
    }
}

#[test]
fn units_of_the_file_do_not_matter() {
    let (recording, _) = &*BASE;
    let mut text = "gx,gy,gz,rx,ry,rz\n".to_owned();
    let value = |quantity: &Quantity, axis: &str, row: usize| {
        let (_, channel) = recording.channel(quantity, axis).expect("a channel");
        channel.values[row]
    };
    for row in 0..recording.tables[0].rows {
        let rate = AXES.map(|axis| value(&Quantity::GyroIncrement, axis, row) * RATE_HZ);
        let [gx, gy, gz] = rate.map(f64::to_degrees);
        let turned = AXES.map(|axis| value(&Quantity::ReferenceIncrement, axis, row));
        let [rx, ry, rz] = turned.map(|angle| angle.to_degrees() * 3600.0);
        let _ = writeln!(text, "{gx:e},{gy:e},{gz:e},{rx:e},{ry:e},{rz:e}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("log.csv");
    fs::write(&log, text).expect("a log");
    let out = folder.path().join("out");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command
        .args(["import", "--quiet", "--rate", "200"])
        .arg(&log);
    for (axis, name) in AXES.iter().enumerate() {
        let (gyro, turned) = (["gx", "gy", "gz"][axis], ["rx", "ry", "rz"][axis]);
        command.args(["--map", &format!("{gyro}=gyro_rate:{name}:deg/s")]);
        command.args([
            "--map",
            &format!("{turned}=reference_increment:{name}:arcsec"),
        ]);
    }
    command.arg("--out").arg(&out).assert().success();
    let mut imported = Recording::read(&out).unwrap_or_else(|error| panic!("{error}"));
    // Segments and site stand in no log.
    imported.segments.clone_from(&recording.segments);
    imported.site = recording.site;
    let found = answer(&outcome(&imported, &BASE.1).diagnosis);
    found.agrees(&OF_BASE, 1e-3);
}

#[test]
fn the_order_of_columns_does_not_matter() {
    let found = changed(|recording| recording.tables[0].channels.reverse());
    assert_eq!(found, *OF_BASE);
}

#[test]
fn the_format_of_the_table_does_not_matter() {
    for file in ["rows.csv", "rows.parquet"] {
        let found = answer(&outcome(&stored(file), &BASE.1).diagnosis);
        assert_eq!(found, *OF_BASE, "{file}");
    }
}

#[test]
fn a_column_of_another_quantity_does_not_matter() {
    let found = changed(|recording| {
        let table = &mut recording.tables[0];
        let rows = 0..table.rows;
        table.channels.push(Channel {
            column: "supply_voltage".to_owned(),
            quantity: Quantity::Other("supply_voltage".to_owned()),
            axis: None,
            scale: 1.0,
            offset: 0.0,
            values: rows.map(|row| 5.0 + 0.1 * (row as f64).sin()).collect(),
        });
    });
    assert_eq!(found, *OF_BASE);
}

#[test]
fn a_constant_offset_of_the_clock_does_not_matter() {
    let found = changed(|recording| {
        for table in &mut recording.tables {
            if let Clock::Uniform { start_s, .. } = &mut table.clock {
                *start_s += 4096.0;
            }
        }
    });
    found.agrees(&OF_BASE, 1e-3);
}

#[test]
fn a_cyclic_permutation_of_the_axes_permutes_the_findings() {
    let next =
        |name: &str| AXES[(AXES.iter().position(|one| *one == name).expect("an axis") + 1) % 3];
    let found = changed(|recording| {
        for channel in &mut recording.tables[0].channels {
            channel.axis = channel.axis.as_deref().map(|axis| next(axis).to_owned());
        }
    });
    let expected = OF_BASE.with(|kind, name, value| match kind {
        "installation" => (
            name.split("")
                .filter(|one| !one.is_empty())
                .map(next)
                .collect(),
            value,
        ),
        _ => (name.to_owned(), value),
    });
    found.agrees(&expected, 0.1);
}

/// Rates about x and y are reversed: tilt ij of gyro i senses the rate about k, and their product has the sign of axis j.
#[test]
fn a_half_turn_about_z_reverses_the_tilts_about_x_and_y() {
    let found = changed(|recording| {
        each_channel(recording, |axis, values| {
            if axis != 2 {
                values.iter_mut().for_each(|value| *value = -*value);
            }
        });
    });
    let expected = OF_BASE.with(|kind, name, value| {
        let is_reversed = kind == "installation" && !name.ends_with('z');
        (name.to_owned(), if is_reversed { -value } else { value })
    });
    found.agrees(&expected, 0.1);
}

/// A reversed record turns back: its rates are reversed in order and sign. A late reference is then early, with late gyros in
/// its class, and so low passes, which are never early. The headline stays.
#[test]
fn reversed_time_reverses_the_delay_and_no_name() {
    let found = changed(|recording| {
        each_channel(recording, |_, values| {
            values.reverse();
            values.iter_mut().for_each(|value| *value = -*value);
        });
    });
    for late in [&found, &*OF_BASE] {
        let (_, class) = &late.findings["reference_delay"];
        assert!(class.iter().any(|one| one == "gyro_delay"), "{late:#?}");
    }
    let expected = OF_BASE.with(|kind, name, value| {
        let sign = if kind == "reference_delay" { -1.0 } else { 1.0 };
        (name.to_owned(), sign * value)
    });
    // Rows that test and rows that fit are others.
    found.headlines().agrees(&expected.headlines(), WITHIN);
}

#[test]
fn half_the_rate_has_the_same_findings() {
    let found = changed(|recording| {
        each_channel(recording, |_, values| {
            *values = values.chunks_exact(2).map(|two| two[0] + two[1]).collect();
        });
        rates_hz(recording, 0.5);
    });
    found.agrees(&OF_BASE, WITHIN);
}

#[test]
fn the_halves_agree_with_each_other() {
    let [first, second] = [0, 1].map(|half| {
        changed(|recording| {
            let rows = recording.tables[0].rows / 2;
            recording.tables[0].keep(half * rows..(half + 1) * rows);
        })
    });
    // The difference of two has √2 deviations of each.
    first.agrees(&second, 2_f64.sqrt() * WITHIN);
}

#[test]
fn an_added_bias_is_found_beside_the_rest() {
    let added_rad_s = [2e-3, -1e-3, 3e-3];
    let mut found = changed(|recording| {
        let mut channels = recording.tables[0].channels.iter_mut();
        for (axis, name) in AXES.iter().enumerate() {
            let is_it = |one: &&mut Channel| is_of_gyro(one) && one.axis.as_deref() == Some(name);
            let channel = channels.find(is_it).expect("a gyro");
            let values = channel.values.iter_mut();
            values.for_each(|value| *value += added_rad_s[axis] / RATE_HZ);
        }
    });
    let (bias, _) = found.findings.remove("gyro_bias").expect("a bias");
    for (axis, name) in AXES.iter().enumerate() {
        let (value, std) = bias[*name];
        let apart = (value - added_rad_s[axis]).abs() / std;
        assert!(apart < WITHIN, "{name} {value} {std}");
    }
    found.agrees(&OF_BASE, 1.0);
}

/// Equal angles in half the time: delays are half of themselves, tilts and angles as before.
#[test]
fn a_faster_clock_of_both_scales_the_delay_alone() {
    let found = changed(|recording| rates_hz(recording, 2.0));
    let expected = OF_BASE.with(|kind, name, value| {
        let factor = if kind == "reference_delay" { 0.5 } else { 1.0 };
        (name.to_owned(), factor * value)
    });
    found.agrees(&expected, WITHIN);
}

#[test]
fn rows_that_the_gyros_repeat_are_left_out_and_the_rest_is_found() {
    let mut found = changed(|recording| {
        let channels = recording.tables[0].channels.iter_mut();
        for channel in channels.filter(|one| is_of_gyro(one)) {
            channel.values.copy_within(1500..1628, 1628);
        }
    });
    assert!(
        found.findings.remove("repeated_rows").is_some(),
        "{found:#?}"
    );
    found.agrees(&OF_BASE, WITHIN);
}

#[test]
fn the_written_model_explains_the_recording() {
    let first = outcome(&BASE.0, &BASE.1);
    let again = answer(&outcome(&BASE.0, &first.model).diagnosis);
    assert_eq!(again.verdict, Verdict::Matches, "{again:#?}");
    assert!(again.findings.is_empty(), "{again:#?}");
}
