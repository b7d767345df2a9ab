//! `rlg import` of date-times: they are a clock, and they give the start of the recording.

use parquet::file::properties::WriterProperties;
use rlg::recording::{About, Clock};

use super::import_columns::Bench;
use super::parquet_file::{Cells, write};

/// Makes twenty rows at 100 Hz with stamps written by `stamp` from milliseconds since 2026-03-01T12:00:00Z.
fn csv(header: &str, stamp: impl Fn(u32) -> String) -> String {
    let mut text = format!("{header},gx_dps,gy_dps,gz_dps\n");
    for row in 1..=20 {
        text.push_str(&format!("{},{row},2,3\n", stamp(10 * row)));
    }
    text
}

/// Returns rate, beginning and date of an imported file.
fn clock(bench: &Bench, more: &[&str]) -> (f64, f64, Option<String>) {
    let (_, recording) = bench.imported(more);
    let Clock::Uniform { rate_hz, start_s } = recording.tables[0].clock else {
        panic!("a uniform clock");
    };
    let about = About::read(bench.out()).expect("a manifest");
    (rate_hz, start_s, about.start)
}

fn is_noon(bench: &Bench, more: &[&str]) {
    let (rate_hz, start_s, start) = clock(bench, more);
    assert_eq!(rate_hz, 100.0);
    assert!(start_s.abs() < 1e-6, "{start_s}");
    assert_eq!(start.as_deref(), Some("2026-03-01T12:00:00Z"));
}

#[test]
fn date_times_of_text_are_a_clock_and_a_start() {
    let forms: [fn(u32) -> String; 5] = [
        |ms| format!("2026-03-01T12:00:00.{ms:03}Z"),
        |ms| format!("2026-03-01 14:00:00.{ms:03}+02:00"),
        |ms| format!("2026-03-01 12:00:00.{ms:03}"),
        |ms| format!("2026/03/01 12:00:00.{ms:03}"),
        |ms| format!("01.03.2026 12:00:00.{ms:03}"),
    ];
    for form in forms {
        is_noon(&Bench::new("log.csv", csv("logged", form)), &[]);
    }
    let no_zone = Bench::new("log.csv", csv("time", forms[2]));
    let (result, _) = no_zone.imported(&[]);
    assert!(
        result["notes"].to_string().contains("read as UTC; --start"),
        "{result}"
    );
    // A time of day has no date.
    let of_day = Bench::new("log.csv", csv("time", |ms| format!("12:00:00.{ms:03}")));
    let (rate_hz, start_s, start) = clock(&of_day, &[]);
    assert_eq!((rate_hz, start), (100.0, None));
    assert!((start_s - 43_200.0).abs() < 1e-6, "{start_s}");
}

#[test]
fn seconds_since_1970_are_dates_in_any_unit() {
    let since_ms = 1_772_366_400_000_u64;
    is_noon(
        &Bench::new(
            "log.csv",
            csv("t (ms)", |ms| (since_ms + u64::from(ms)).to_string()),
        ),
        &[],
    );
    is_noon(
        &Bench::new(
            "log.csv",
            csv("t (us)", |ms| {
                ((since_ms + u64::from(ms)) * 1000).to_string()
            }),
        ),
        &[],
    );
}

#[test]
fn timestamps_of_parquet_are_dates() {
    let bench = Bench::new("log.parquet", "");
    let since_us = (1..=20).map(|row| 1_772_366_400_000_000 + 10_000 * row);
    let stamps = Cells::Int64(since_us.map(Some).collect());
    let rates = Cells::Double((1..=20).map(|row| Some(f64::from(row))).collect());
    let columns = [
        ("int64 when (TIMESTAMP(MICROS,true))", &stamps),
        ("double gx_dps", &rates),
        ("double gy_dps", &rates),
        ("double gz_dps", &rates),
    ];
    write(&bench.file(), 20, &columns, WriterProperties::default());
    is_noon(&bench, &[]);
}

#[test]
fn instrument_and_start_may_be_said() {
    let bench = Bench::new("log.csv", csv("t (ms)", |ms| ms.to_string()));
    let said = [
        "--instrument",
        "SN 17",
        "--start",
        "2026-03-01T13:00:00+01:00",
    ];
    let (result, _) = bench.imported(&said);
    let about = About::read(bench.out()).expect("a manifest");
    assert_eq!(about.instrument.as_deref(), Some("SN 17"));
    assert_eq!(about.start_s, Some(1_772_366_400.0));
    assert_eq!(result["instrument"], "SN 17");
    for start in ["2026-03-01", "noon", "2026-03-01T13:00:00"] {
        let bench = Bench::new("log.csv", csv("t (ms)", |ms| ms.to_string()));
        bench.is_refused(
            &["--start", start],
            &["--start", start, "date, time and zone"],
        );
    }
}

#[test]
fn a_date_beside_text_or_numbers_is_damage_with_its_row() {
    let one = |ms: u32| match ms {
        50 => "soon".to_owned(),
        ms => format!("2026-03-01T12:00:00.{ms:03}Z"),
    };
    Bench::new("log.csv", csv("time", one)).is_refused(&[], &["time, row 4", "\"soon\""]);
}
