//! `rlg params` writes limits and identity; the firmware's decoder reads them, and its processor raises the bits.

use std::fs;

use trueaxis::{HealthLimits, Identity, Parameters, Status, UnitNumber};

use super::bench::{Bench, Firmware, MODEL_SHA256};

const PARAMS: [&str; 4] = ["params", "model.toml", "--out", "params.bin"];

fn with_all() -> [&'static str; 10] {
    let [a, b, c, d] = PARAMS;
    let more = [
        "--unit-number",
        "RLG-0042",
        "--calibrated",
        "2026-02-28",
        "--limits",
        "limits.toml",
    ];
    let [e, f, g, h, i, j] = more;
    [a, b, c, d, e, f, g, h, i, j]
}

/// Bytes of the model's hash.
fn hash() -> Vec<u8> {
    let digits = MODEL_SHA256.as_bytes().chunks(2);
    let bytes = digits.map(|two| u8::from_str_radix(str::from_utf8(two).expect("ASCII"), 16));
    bytes.map(|byte| byte.expect("two digits")).collect()
}

#[test]
fn a_block_has_limits_and_identity_where_the_table_of_its_bytes_has_them() {
    let bench = Bench::new();
    let (result, words) = bench.json(&with_all());
    let block = fs::read(bench.at("params.bin")).expect("the block");
    assert_eq!(block.len(), 632);
    assert_eq!(block[..8], [b'R', b'L', b'G', b'P', 5, 0, 120, 2]);
    let numbers: Vec<f64> = block[510..598]
        .chunks(8)
        .map(|eight| f64::from_le_bytes(eight.try_into().expect("eight")))
        .collect();
    let due = [233.0, 358.0, 0.7, 0.6, 0.5, 0.1, 0.5, 1.5, 0.6, 1.4, 1.02];
    assert_eq!(numbers, due);
    assert_eq!(block[604..616], *b"RLG-0042\0\0\0\0");
    assert_eq!(block[616..620], 20_260_228_u32.to_le_bytes());
    assert_eq!(block[620..628], hash()[..8]);

    let read = bench.block("params.bin");
    let identity = Identity::new(UnitNumber::of_text("RLG-0042").expect("a number"));
    let identity = identity.with(|known| {
        known.calibrated = 20_260_228;
        known.model.copy_from_slice(&hash()[..8]);
    });
    assert_eq!(read.identity, Some(identity));
    let limits = HealthLimits::default().with(|limits| {
        limits.temperature_k = Some([233.0, 358.0]);
        limits.intensity_least = Some([0.7, 0.6, 0.5]);
        limits.path_length_step = Some(0.1);
        limits.dither_drive = Some([0.5, 1.5]);
        limits.dither_amplitude = [0.6, 1.4];
        limits.pulse_silence_s = Some(1.02);
    });
    assert_eq!(read.limits, Some(limits));

    assert_eq!(result["identity"]["unit"], "RLG-0042");
    assert_eq!(result["identity"]["calibrated"], "2026-02-28");
    assert_eq!(
        result["identity"]["model_sha256_begins"],
        MODEL_SHA256[..16]
    );
    assert_eq!(result["model_sha256"], MODEL_SHA256);
    assert_eq!(result["limits"]["intensity_least"][1], 0.6);
    for part in [
        "RLG-0042",
        "2026-02-28",
        &MODEL_SHA256[..16],
        "233 to 358 K",
        "1.02 s",
    ] {
        assert!(words.contains(part), "no {part} in {words}");
    }
}

#[test]
fn a_block_without_the_options_is_of_any_unit_and_has_no_date_of_its_own() {
    let bench = Bench::new();
    let (result, _) = bench.json(&PARAMS);
    let plain = fs::read(bench.at("params.bin")).expect("the block");
    assert_eq!(
        (plain.len(), plain[4]),
        (508, 4),
        "firmware before items reads it"
    );
    assert!(result["identity"].is_null() && result["limits"].is_null());
    // A number alone: no date is assumed.
    let (result, words) = bench.json(&[&PARAMS[..], &["--unit-number", "RLG-0042"]].concat());
    assert!(result["identity"]["calibrated"].is_null());
    assert!(words.contains("at an unknown date"), "{words}");
    let identity = bench.block("params.bin").identity.expect("an identity");
    assert_eq!(identity.calibrated, 0);
    assert_eq!(identity.model, hash()[..8]);
}

#[test]
fn a_unit_has_twelve_bytes_as_text_or_hexadecimal() {
    let bench = Bench::new();
    for (given, due) in [
        ("A", *b"A\0\0\0\0\0\0\0\0\0\0\0"),
        ("twelve-bytes", *b"twelve-bytes"),
        (
            "00112233445566778899aAbB",
            [0, 17, 34, 51, 68, 85, 102, 119, 136, 153, 170, 187],
        ),
    ] {
        bench.json(&[&PARAMS[..], &["--unit-number", given]].concat());
        let identity = bench.block("params.bin").identity.expect("an identity");
        assert_eq!(identity.unit.0, due, "{given}");
    }
    fs::remove_file(bench.at("params.bin")).expect("the block");
    for given in [
        "",
        "thirteen-long",
        "with blank",
        "0011223344556677889900xx",
        "000000000000000000000000",
        "+1+1+1+1+1+1+1+1+1+1+1+1",
        "Ångström",
    ] {
        let words = bench.refused(&[&PARAMS[..], &["--unit-number", given]].concat());
        assert!(
            words.contains("--unit-number") && words.contains("24 hexadecimal"),
            "{words}"
        );
    }
    for given in [
        "2026-02-29",
        "2026-13-01",
        "26-02-28",
        "28.02.2026",
        "2026-2-28",
        "today",
        "",
    ] {
        let words =
            bench.refused(&[&PARAMS[..], &["--unit-number", "A", "--calibrated", given]].concat());
        assert!(
            words.contains("--calibrated") && words.contains("YYYY-MM-DD"),
            "{words}"
        );
    }
    // A date without a unit: of whose calibration?
    let output = bench.run(&[&PARAMS[..], &["--calibrated", "2026-02-28"]].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--unit-number"));
}

#[test]
fn inspect_prints_a_block_and_refuses_a_damaged_one() {
    let bench = Bench::new();
    let (written, _) = bench.json(&[&with_all()[..], &["--generation", "7"]].concat());
    let (read, words) = bench.json(&["inspect", "params.bin"]);
    for (key, value) in read.as_object().expect("an object") {
        assert_eq!(*value, written[key], "{key}");
    }
    assert_eq!(read["generation"], 7);
    for part in [
        "632 bytes, generation 7",
        "3.9e-6, 3.9e-6, 3.9e-6",
        "RLG-0042",
        "2026-02-28",
        "233 to 358 K",
    ] {
        assert!(words.contains(part), "no {part} in {words}");
    }
    let words = bench.refused(&["inspect", "params.bin", "--limits", "limits.toml"]);
    assert!(
        words.contains("--limits") && words.contains("a recording"),
        "{words}"
    );
    let mut block = fs::read(bench.at("params.bin")).expect("the block");
    block[520] ^= 1;
    bench.write("params.bin", &block);
    let words = bench.refused(&["inspect", "params.bin"]);
    assert!(
        words.contains("params.bin") && words.contains("CRC-32"),
        "{words}"
    );
}

/// Each limit on either side of its value, through the bytes of the bank's frames.
#[test]
fn the_processor_with_such_a_block_raises_each_bit_at_its_limit() {
    let bench = Bench::new();
    bench.json(&with_all());
    let parameters = bench.block("params.bin");
    let of_nominal = |share: f64| (share * 16384.0) as i16;
    let kelvin = |kelvin: f64| (kelvin * 64.0) as i16;
    let of_range = |share: f64| (share * 32768.0) as i16;
    let none = Status::default();
    for (channel, code, due) in [
        (0, kelvin(232.9), Status::TEMPERATURE_RANGE),
        (1, kelvin(233.1), none),
        (1, kelvin(357.9), none),
        (2, kelvin(358.1), Status::TEMPERATURE_RANGE),
        (3, of_nominal(0.69), Status::INTENSITY_LOW),
        (3, of_nominal(0.71), none),
        (4, of_nominal(0.61), none),
        (4, of_nominal(0.59), Status::INTENSITY_LOW),
        (5, of_nominal(0.51), none),
        (5, of_nominal(0.49), Status::INTENSITY_LOW),
        (6, of_range(0.11), Status::MODE_HOP),
        (7, of_range(0.09), none),
        (10, 1, Status::MODE_HOP),
        (12, of_nominal(0.49), Status::DITHER_DRIVE),
        (13, of_nominal(0.51), none),
        (13, of_nominal(1.49), none),
        (14, of_nominal(1.51), Status::DITHER_DRIVE),
    ] {
        let mut firmware = Firmware::new(&parameters);
        assert_eq!(firmware.run(400), none, "sound");
        firmware.codes[channel] = Some(code);
        assert_eq!(firmware.run(40), due, "channel {channel}, code {code}");
    }
    let mut firmware = Firmware::new(&parameters);
    assert_eq!(firmware.run(400), none);
    firmware.codes[1] = None;
    assert_eq!(firmware.run(250), Status::TEMPERATURE_ABSENT);
    // Pulse 0.1 s before: due at 1 s, lost at 1.02 s.
    let mut firmware = Firmware::new(&parameters);
    assert_eq!(firmware.run(4070), none);
    assert_eq!(firmware.run(40), Status::PULSE_LOST);
    // Without a block nothing of it is watched.
    let mut firmware = Firmware::new(&Parameters::default());
    firmware.codes = [None; 15];
    assert_eq!(firmware.run(4400), none);
}
