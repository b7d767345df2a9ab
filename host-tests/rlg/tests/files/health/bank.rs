//! Frames of a counter bank: their bytes after the documented table, read by `rlg import` and written by `rlg export`.

use rlg::recording::{Quantity, Recording, Table};

use super::bench::{Bench, Frame};

/// Code of a channel in a round of 16 frames: of temperatures about 300 K.
fn code(turn: u32, round: u32) -> i16 {
    let warm = if turn < 3 { 300 * 64 } else { 0 };
    (warm + 100 * turn + round) as i16
}

/// A frame of a bank at rest.
fn frame(row: u32) -> Frame {
    let (round, turn) = (row / 16, row % 16);
    let sign = row as i32;
    Frame {
        // It wraps within the stream.
        sequence: (65_500 + row) as u16,
        counters: [i32::MAX.wrapping_add(3 * sign), -2 * sign, 7],
        pickoffs: [1000 - sign, sign % 13, -5],
        accelerometers: [400 * sign, sign / 2, -sign],
        channel: if turn == 15 { 255 } else { turn as u8 },
        value: code(turn, round),
        since_pulse: 4000 * row,
    }
}

fn stream(rows: impl Iterator<Item = u32>) -> Vec<u8> {
    rows.flat_map(|row| frame(row).bytes()).collect()
}

fn params(bench: &Bench) {
    bench.json(&[
        "params",
        "model.toml",
        "--rate-hz",
        "2000",
        "--pickoff-weight-rad",
        "1e-8",
        "--out",
        "params.bin",
        "--accelerometer-weight-m-s",
        "1e-5",
        "2e-5",
        "3e-5",
    ]);
}

const IMPORT: [&str; 6] = [
    "import",
    "spi.bin",
    "--params",
    "params.bin",
    "--out",
    "run",
];

fn table<'a>(recording: &'a Recording, file: &str) -> &'a Table {
    let mut tables = recording.tables.iter();
    tables.find(|table| table.file == file).expect("the table")
}

fn near(found: f64, due: f64) -> bool {
    (found - due).abs() <= 1e-12 * due.abs()
}

#[test]
fn every_code_of_the_frames_comes_back() {
    let bench = Bench::new();
    params(&bench);
    bench.write("spi.bin", stream(0..320));
    let (result, words) = bench.json(&IMPORT);
    assert_eq!(result["rows"], 320, "{words}");
    assert_eq!(
        (&result["frames"], &result["bytes_skipped"]),
        (&320.into(), &0.into())
    );
    assert_eq!(result["rate_hz"], 2000.0);
    let recording = Recording::read(bench.at("run")).expect("a recording");
    let value = |quantity: &Quantity, axis: &str, row: usize| {
        recording
            .channel(quantity, axis)
            .expect("a channel")
            .1
            .values[row]
    };
    assert!(value(&Quantity::GyroCount, "x", 0).is_nan());
    for row in 1..320 {
        assert_eq!(value(&Quantity::GyroCount, "x", row), 3.0);
        assert_eq!(value(&Quantity::GyroCount, "y", row), -2.0);
        assert_eq!(value(&Quantity::GyroCount, "z", row), 0.0);
        assert!(near(
            value(&Quantity::DitherAngle, "x", row),
            1e-8 * (1000.0 - row as f64)
        ));
        assert!(near(
            value(&Quantity::VelocityIncrement, "x", row),
            400.0 * 1e-5
        ));
        assert!(near(value(&Quantity::VelocityIncrement, "z", row), -3e-5));
    }
    // Each kind by its documented unit; a round is over with the channel after which numbers begin anew.
    let slow = table(&recording, "slow.parquet");
    assert_eq!((slow.rows, slow.channels.len()), (20, 15));
    for (quantity, first, codes_per_unit) in [
        (Quantity::Temperature, 0, 64.0),
        (Quantity::LaserIntensity, 3, 16384.0),
        (Quantity::PathLengthDrive, 6, 32768.0),
        (Quantity::PathLengthResets, 9, 1.0),
        (Quantity::DitherDrive, 12, 16384.0),
    ] {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            for round in 0..20 {
                let code = f64::from(code((first + axis) as u32, round as u32));
                assert_eq!(value(&quantity, letter, round), code / codes_per_unit);
            }
        }
    }
    // 4000/16 µs a row, at the row's end.
    let stamps = &recording.tables[0].channels[9];
    assert_eq!(stamps.quantity, Quantity::TimeSincePulse);
    for (row, stamp_s) in stamps.values.iter().enumerate() {
        assert!((stamp_s - row as f64 * 250e-6).abs() < 1e-12, "row {row}");
    }
    let model = rlg::model::Model::read(bench.at("run").join("model.toml")).expect("a model");
    assert_eq!(model.gyro.pulse_weight_rad, [3.9e-6; 3]);
}

#[test]
fn damage_costs_the_frames_that_it_touches_and_is_said() {
    let bench = Bench::new();
    params(&bench);
    let mut bytes = stream(0..400);
    // Row 300: a flipped bit. Rows 100 to 102: a cut within the first and the last of them. A frame twice; 7 bytes at the end.
    bytes[300 * 48 + 30] ^= 8;
    let again = bytes[200 * 48..201 * 48].to_vec();
    bytes.splice(201 * 48..201 * 48, again);
    bytes.drain(100 * 48 + 5..102 * 48 + 20);
    bytes.extend([1; 7]);
    bench.write("spi.bin", bytes);
    let (result, words) = bench.json(&IMPORT);
    assert_eq!(result["rows"], 400, "{words}");
    assert_eq!(result["frames"], 396);
    assert_eq!(result["repeated"], 1);
    assert_eq!(result["bytes_skipped"], 5 + 28 + 48 + 7);
    let gap = |row: u64, rows: u64| {
        let counted = rows as i64 + 1;
        serde_json::json!({ "row": row, "rows": rows, "counts": [3 * counted, -2 * counted, 0] })
    };
    assert_eq!(
        result["gaps"],
        serde_json::json!([gap(100, 3), gap(300, 1)])
    );
    assert!(
        words.contains("3 rows from row 100 ") && words.contains("1 row from row 300 "),
        "{words}"
    );
    let recording = Recording::read(bench.at("run")).expect("a recording");
    let counts = &recording
        .channel(&Quantity::GyroCount, "x")
        .expect("x")
        .1
        .values;
    let pickoffs = &recording
        .channel(&Quantity::DitherAngle, "x")
        .expect("x")
        .1
        .values;
    for row in 1..400 {
        let is_lost = (100..103).contains(&row) || row == 300;
        let is_in_gap = is_lost || row == 103 || row == 301;
        assert_eq!(pickoffs[row].is_nan(), is_lost, "row {row}");
        assert_eq!(counts[row].is_nan(), is_in_gap, "row {row}");
    }
}

/// Channels 0 to 3 of round 3 and the rest of round 5 are two rows, and not one.
#[test]
fn rounds_on_either_side_of_a_gap_stay_apart() {
    let bench = Bench::new();
    params(&bench);
    bench.write("spi.bin", stream((0..52).chain(84..320)));
    bench.json(&IMPORT);
    let recording = Recording::read(bench.at("run")).expect("a recording");
    let slow = table(&recording, "slow.parquet");
    let code_of = |channel: usize, row: usize| slow.channels[channel].values[row];
    // Rounds 0 to 3, 5 to 19.
    assert_eq!(slow.rows, 19);
    assert_eq!(code_of(3, 3) * 16384.0, f64::from(code(3, 3)));
    assert!(code_of(4, 3).is_nan() && code_of(3, 4).is_nan());
    assert_eq!(code_of(4, 4) * 16384.0, f64::from(code(4, 5)));
    assert_eq!(code_of(9, 5), f64::from(code(9, 6)));
    let rlg::recording::Clock::Stamped { stamps_s, .. } = &slow.clock else {
        panic!("stamps");
    };
    assert_eq!(stamps_s[3..5], [52.0 / 2000.0, 96.0 / 2000.0]);
}

#[test]
fn files_that_are_no_stream_of_a_bank_are_refused() {
    let bench = Bench::new();
    params(&bench);
    bench.write("spi.bin", stream(0..50));
    let words = bench.refused(&["import", "spi.bin", "--out", "run"]);
    assert!(
        words.contains("--params") && words.contains("parameter block"),
        "{words}"
    );
    let words = bench.refused(&[&IMPORT[..], &["--rate-hz", "4000"]].concat());
    assert!(words.contains("--rate-hz"), "{words}");
    bench.write("log.csv", "t,x\n0,1\n");
    let words = bench.refused(&[
        "import",
        "log.csv",
        "--params",
        "params.bin",
        "--out",
        "run",
    ]);
    assert!(
        words.contains("--params") && words.contains("--format bank"),
        "{words}"
    );
    bench.write("spi.bin", [stream(0..50), stream(20..50)].concat());
    let words = bench.refused(&IMPORT);
    assert!(
        words.contains("more than one run") && words.contains("byte 2400"),
        "{words}"
    );
    bench.write("spi.bin", [0x55; 4800]);
    let words = bench.refused(&[&IMPORT[..], &["--format", "bank"]].concat());
    assert!(words.contains("no frame of a counter bank"), "{words}");
    bench.write("params.bin", "RLGP");
    bench.write("spi.bin", stream(0..50));
    let words = bench.refused(&IMPORT);
    assert!(
        words.contains("params.bin") && words.contains("no block"),
        "{words}"
    );
}

#[test]
fn export_gives_the_frames_back_byte_for_byte() {
    let bench = Bench::new();
    params(&bench);
    let first = stream(0..320);
    bench.write("spi.bin", &first);
    bench.json(&IMPORT);
    let (result, words) = bench.json(&["export", "run", "--out", "again.bank"]);
    assert_eq!(result["files"][0]["frames"], 320, "{words}");
    let again = std::fs::read(bench.at("again.bank")).expect("frames");
    assert_eq!(again.len(), first.len());
    for row in 16..320_u32 {
        let at = row as usize * 48;
        let [due, found] = [&first, &again].map(|bytes| &bytes[at..at + 48]);
        // Pickoffs, stamps: as they were. Sequence and counters begin anew; a round is known at its end.
        assert_eq!(found[14..26], due[14..26], "pickoffs of row {row}");
        assert_eq!(found[41..46], due[41..46], "stamp of row {row}");
        let counts = |bytes: &[u8], row: usize| {
            i32::from_le_bytes(bytes[row * 48 + 2..row * 48 + 6].try_into().expect("four"))
        };
        let grown = |bytes| counts(bytes, row as usize).wrapping_sub(counts(bytes, 16));
        assert_eq!(grown(&again), grown(&first));
        let (round, turn) = (row / 16, row % 16);
        let shown = i16::from_le_bytes([found[39], found[40]]);
        match turn {
            15 => assert_eq!(found[38], 255),
            _ => assert_eq!((u32::from(found[38]), shown), (turn, code(turn, round - 1))),
        }
        let crc = super::bench::crc(&found[..46]).to_le_bytes();
        assert_eq!(found[46..48], crc);
    }
}

#[test]
fn what_a_frame_cannot_hold_is_refused_with_its_row() {
    let bench = Bench::new();
    let manifest = |scale: &str| {
        let channel = |column: &str, quantity: &str, axis: &str, more: &str| {
            format!(
                "[[table.channel]]\ncolumn = \"{column}\"\nquantity = \"{quantity}\"\naxis = \"{axis}\"\n{more}"
            )
        };
        let gyros: String = ["x", "y", "z"]
            .map(|axis| channel(&format!("g{axis}"), "gyro_count", axis, ""))
            .concat();
        let pickoffs: String = ["x", "y", "z"]
            .map(|axis| channel(&format!("d{axis}"), "dither_angle", axis, scale))
            .concat();
        format!("format = 1\n[[table]]\nfile = \"t.csv\"\nrate_hz = 4000.0\n{gyros}{pickoffs}")
    };
    std::fs::create_dir(bench.at("run")).expect("a folder");
    let refused = |scale: &str, rows: &str, parts: &[&str]| {
        bench.write("run/recording.toml", manifest(scale));
        bench.write("run/t.csv", format!("gx,gy,gz,dx,dy,dz\n{rows}"));
        let words = bench.refused(&["export", "run", "--out", "x.bank"]);
        for part in parts {
            assert!(words.contains(part), "no {part} in {words}");
        }
    };
    refused(
        "scale = 1e-8\n",
        "1,2,3,4,5,6\n1,2,,4,5,6\n",
        &["t.csv, gz, row 1", "is not measured"],
    );
    refused(
        "scale = 1e-8\n",
        "1,2,3,4,5,6\n1,2,3,4,5.5,6\n",
        &["t.csv, dy, row 1", "no code", "whole multiple"],
    );
    refused(
        "",
        "1,2,3,1e-5,0,0\n1,2,3,2e-5,0,0\n",
        &["t.csv, dx, row 0", "no code"],
    );
}
