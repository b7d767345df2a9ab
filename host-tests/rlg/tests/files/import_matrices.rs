//! `rlg import` of MATLAB's and HDF5's files. The MAT-files are made here byte by byte, by the format's description.
//!
//! If `RLG_RECORDINGS` names a folder with recordings of others, two of those are read, too.

use std::io::Write as _;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rlg::recording::{Clock, Quantity};

use super::import_columns::{Bench, values};

/// One element of a little-endian MAT-file.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// An array's head: class, sides and name.
fn head(class: u8, sides: &[u32], name: &str) -> Vec<u8> {
    let flags = element(6, &[[class, 0, 0, 0], [0; 4]].concat());
    let sides: Vec<u8> = sides.iter().flat_map(|side| side.to_le_bytes()).collect();
    [flags, element(5, &sides), element(1, name.as_bytes())].concat()
}

/// A variable of doubles, column by column.
pub(super) fn matrix(name: &str, sides: &[u32], values: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    element(14, &[head(6, sides, name), element(9, &data)].concat())
}

/// A file of these variables, each compressed as `save -v7` does or plain as `save -v6` does.
pub(super) fn mat(variables: &[Vec<u8>], compressed: bool) -> Vec<u8> {
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M']);
    for variable in variables {
        if compressed {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(variable).expect("memory");
            let packed = encoder.finish().expect("memory");
            file.extend([15_u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
            file.extend(packed);
        } else {
            file.extend(variable);
        }
    }
    file
}

fn variables() -> Vec<Vec<u8>> {
    vec![
        matrix(
            "gyro",
            &[4, 3],
            &[
                1.0,
                2.0,
                3.0,
                4.0,
                5.0,
                6.0,
                7.0,
                8.0,
                9.0,
                10.0,
                f64::NAN,
                12.0,
            ],
        ),
        matrix(
            "quat",
            &[4, 4],
            &[[1.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]].concat(),
        ),
        matrix("fs", &[1, 1], &[200.0]),
    ]
}

/// A file of gyros with their unit in the name, and quaternions x y z w.
pub(super) fn run() -> Vec<u8> {
    let quaternions = [[0.0; 4], [0.0; 4], [0.0; 4], [1.0; 4]].concat();
    mat(
        &[
            matrix("gyro_rad_s", &[4, 3], &[0.5; 12]),
            matrix("quat", &[4, 4], &quaternions),
        ],
        true,
    )
}

const UNIT: [&str; 2] = ["--unit", "gyro_rate:rad/s"];

#[test]
fn variables_of_version_5_and_7_become_columns() {
    for compressed in [false, true] {
        let bench = Bench::new("run.mat", mat(&variables(), compressed));
        let (_, recording) = bench.imported(&UNIT);
        let table = &recording.tables[0];
        let clock = Clock::Uniform {
            rate_hz: 200.0,
            start_s: 0.0,
        };
        assert_eq!((table.rows, &table.clock), (4, &clock));
        assert_eq!(
            values(table, &Quantity::GyroRate, "y"),
            [5.0, 6.0, 7.0, 8.0]
        );
        assert!(values(table, &Quantity::GyroRate, "z")[2].is_nan());
        assert_eq!(values(table, &Quantity::ReferenceAttitude, "w"), [1.0; 4]);
    }
}

#[test]
fn a_matrix_is_mapped_by_the_letters_of_its_axes_whichever_side_is_time() {
    let attitude = matrix("ref", &[4, 5], &[0.0, 0.0, 0.0, 1.0].repeat(5));
    let gyro = matrix("w", &[5, 3], &[0.5; 15]);
    let bench = Bench::new("run.mat", mat(&[gyro, attitude], true));
    let more = [
        "--rate",
        "50",
        "--map",
        "w=gyro_rate:xyz:rad/s",
        "ref=reference_attitude:xyzw",
    ];
    let (_, recording) = bench.imported(&more);
    let table = &recording.tables[0];
    assert_eq!(values(table, &Quantity::ReferenceAttitude, "w"), [1.0; 5]);
    assert_eq!(values(table, &Quantity::ReferenceAttitude, "x"), [0.0; 5]);
}

#[test]
fn fields_of_a_structure_are_named_after_it_and_single_precision_is_read() {
    let floats: Vec<u8> = (0..12_u8)
        .flat_map(|value| f32::from(value).to_le_bytes())
        .collect();
    let gyro = element(14, &[head(7, &[4, 3], ""), element(7, &floats)].concat());
    let text = element(
        14,
        &[head(4, &[1, 2], ""), element(4, &[b'o', 0, b'k', 0])].concat(),
    );
    let names = [b"gyr\0\0\0\0\0".as_slice(), b"note\0\0\0\0"].concat();
    // A small element: up to four bytes in the tag.
    let length = [5_u16.to_le_bytes(), 4_u16.to_le_bytes()].concat();
    let length = [length, 8_u32.to_le_bytes().to_vec()].concat();
    let structure = [
        head(2, &[1, 1], "imu"),
        length,
        element(1, &names),
        gyro,
        text,
    ]
    .concat();
    let bench = Bench::new("run.mat", mat(&[element(14, &structure)], true));
    let (result, recording) = bench.imported(&["--rate", "100", "--unit", "gyro_rate:deg/s"]);
    assert_eq!(result["channels"][0]["origin"], "imu.gyr[0] [deg/s]");
    let z = values(&recording.tables[0], &Quantity::GyroRate, "z");
    assert!((z[3] - 11_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn a_damaged_mat_file_is_refused() {
    let whole = mat(&variables(), true);
    for length in [140, 180, whole.len() - 3] {
        Bench::new("run.mat", &whole[..length])
            .is_refused(&UNIT, &["run.mat", "truncated or damaged"]);
    }
    let mut changed = whole.clone();
    for byte in &mut changed[150..170] {
        *byte ^= 0x5A;
    }
    Bench::new("run.mat", &changed).is_refused(&UNIT, &["truncated or damaged"]);
    let plain = mat(&variables(), false);
    // The sides state more rows than there are values.
    let mut changed = plain.clone();
    changed[128 + 8 + 16 + 8] = 9;
    Bench::new("run.mat", &changed).is_refused(&UNIT, &["truncated or damaged"]);
    Bench::new("run.mat", &whole[..100]).is_refused(&UNIT, &["no MAT-file of version"]);
    Bench::new("run.mat", mat(&[], true)).is_refused(&UNIT, &["no column of numbers"]);
}

#[test]
fn variables_of_different_length_need_stamps() {
    let gyro = matrix("gyro", &[4, 3], &[0.5; 12]);
    let attitude = matrix(
        "quat",
        &[5, 4],
        &[[1.0; 5], [0.0; 5], [0.0; 5], [0.0; 5]].concat(),
    );
    let stamps = matrix("t_quat", &[5, 1], &[0.01, 0.021, 0.033, 0.04, 0.052]);
    let bench = Bench::new("run.mat", mat(&[gyro.clone(), attitude.clone()], true));
    bench.is_refused(
        &[&UNIT[..], &["--rate", "100"]].concat(),
        &["two lengths and no stamps", "4 rows", "--time"],
    );
    let bench = Bench::new("run.mat", mat(&[gyro, attitude, stamps], true));
    let more = [&UNIT[..], &["--rate", "100", "--time", "t_quat:s"]].concat();
    let (_, recording) = bench.imported(&more);
    assert!(matches!(recording.tables[1].clock, Clock::Stamped { .. }));
    assert_eq!(
        values(&recording.tables[1], &Quantity::ReferenceAttitude, "w"),
        [1.0; 5]
    );
}

#[test]
fn hdf5_is_read_as_matlab_and_as_others_write_it() {
    let rows: Vec<f64> = (0..12).map(f64::from).collect();
    let mut builder = hdf5_pure::FileBuilder::new();
    // As of MATLAB 7.3: three contiguous columns; as of h5py: four rows.
    builder
        .create_dataset("gyro")
        .with_f64_data(&rows)
        .with_shape(&[3, 4]);
    builder
        .create_dataset("fs")
        .with_f64_data(&[250.0])
        .with_shape(&[1, 1]);
    let mut group = builder.create_group("imu");
    group
        .create_dataset("acc")
        .with_f64_data(&rows)
        .with_shape(&[4, 3]);
    builder.add_group(group.finish());
    let bytes = builder.finish().expect("a file");
    let bench = Bench::new("run.h5", &bytes);
    let more = [&UNIT[..], &["--unit", "specific_force:g"]].concat();
    let (_, recording) = bench.imported(&more);
    let table = &recording.tables[0];
    assert_eq!(
        values(table, &Quantity::GyroRate, "y"),
        [4.0, 5.0, 6.0, 7.0]
    );
    let y = values(table, &Quantity::SpecificForce, "y");
    assert!((y[3] / 9.806_65 - 10.0).abs() < 1e-12);
    assert!((table.clock.period_s(4) - 0.004).abs() < 1e-15);
    Bench::new("run.h5", &bytes[..bytes.len() / 2]).is_refused(&more, &["run.h5", "damaged"]);
}

#[test]
fn two_real_files_come_in_without_a_word() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("RLG_RECORDINGS names no folder: the real files were not read");
        return;
    };
    let cases = [
        ("repoimu-11/TStick_Test11_Trial1.csv", 8995, 100.0, 0.05, 10),
        (
            "broad-24/24_disturbed_tapping_A.mat",
            57_746,
            285.714_285_714_285_7,
            0.0,
            13,
        ),
    ];
    for (name, rows, hz, beginning_s, channels) in cases {
        let content = std::fs::read(folder.join(name)).expect("the file");
        let bench = Bench::new(name.rsplit('/').next().expect("a name"), content);
        let (result, recording) = bench.imported(&[]);
        let table = &recording.tables[0];
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            panic!("a uniform clock");
        };
        assert_eq!(
            (table.rows, result["channels"].as_array().map(Vec::len)),
            (rows, Some(channels))
        );
        assert!((rate_hz - hz).abs() < 1e-9 && (start_s - beginning_s).abs() < 1e-9);
        let share = agreement(table);
        assert!(
            share < 0.15,
            "{name}: attitudes turn otherwise than the gyros: {share}"
        );
    }
}

/// Computes the rms difference of the attitudes' rotation about body x from the gyro's, relative to the gyro's rms.
fn agreement(table: &rlg::recording::Table) -> f64 {
    let quaternion =
        ["w", "x", "y", "z"].map(|axis| values(table, &Quantity::ReferenceAttitude, axis));
    let gyro = values(table, &Quantity::GyroRate, "x");
    let period_s = table.clock.period_s(table.rows);
    let (mut off, mut all) = (0.0, 0.0);
    for (row, gyro) in gyro.iter().enumerate().skip(1) {
        let [a, b] = [row - 1, row].map(|row| quaternion.map(|component| component[row]));
        // Vector part of conj(a) b, x.
        let x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2];
        let real: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let rate = 2.0 * x * real.signum() / period_s;
        if rate.is_finite() {
            off += (rate - gyro).powi(2);
            all += gyro.powi(2);
        }
    }
    (off / all).sqrt()
}

/// Returns a number of the registration: value and standard deviation.
fn registered(diagnosis: &serde_json::Value, kind: &str, name: &str) -> (f64, f64) {
    let find = |list: &serde_json::Value, key: &str, wanted: &str| {
        let mut entries = list.as_array().expect("a list").iter();
        let found = entries.find(|one| one[key] == wanted);
        found.cloned().unwrap_or_else(|| panic!("no {wanted}"))
    };
    let entry = find(&diagnosis["registration"], "kind", kind);
    let number = find(&entry["parameters"], "name", name);
    let of = |key: &str| number[key].as_f64().expect("a number");
    (of("value"), of("std"))
}

/// Findings of an outside analysis of the same files: a unit mounted 47 mrad askew about x, and one delay of −2.40 ms with a
/// bias; no physics in either, and glitches of the cameras.
#[test]
fn two_real_files_are_aligned_as_an_outside_analysis_has_it() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("RLG_RECORDINGS names no folder: the real files were not read");
        return;
    };
    let diagnosed = |name: &str| {
        let content = std::fs::read(folder.join(name)).expect("the file");
        let bench = Bench::new(name.rsplit('/').next().expect("a name"), content);
        bench.imported(&[]);
        bench.diagnosis()
    };
    let registration = [
        "gyro_bias",
        "gyro_scale",
        "installation",
        "gyro_bandwidth",
        "reference_bandwidth",
        "reference_misalignment",
        "reference_delay",
        "reference_clock_rate",
        "reference_spike",
        "reference_dropout",
        "reference_jump",
    ];
    let near = |(value, std): (f64, f64), expected: f64, within: f64| {
        assert!(
            (value - expected).abs() < within && std < within,
            "{value} ± {std}, not {expected}"
        );
    };
    let is_registration = |diagnosis: &serde_json::Value| {
        for effect in diagnosis["effects"].as_array().expect("effects") {
            let kind = effect["kind"].as_str().expect("a kind");
            assert!(registration.contains(&kind), "{kind}");
        }
    };
    let stick = diagnosed("repoimu-11/TStick_Test11_Trial1.csv");
    is_registration(&stick);
    near(
        registered(&stick, "reference_misalignment", "x"),
        -0.047,
        1e-3,
    );
    let tapped = diagnosed("broad-24/24_disturbed_tapping_A.mat");
    is_registration(&tapped);
    near(
        registered(&tapped, "reference_delay", "all"),
        -2.40e-3,
        5e-5,
    );
    for (axis, deg_s) in [("x", 0.49), ("y", -0.21), ("z", -0.28)] {
        let bias = registered(&tapped, "gyro_bias", axis);
        near(bias, f64::to_radians(deg_s), f64::to_radians(0.02));
    }
}
