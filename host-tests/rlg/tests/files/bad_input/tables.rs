//! Tables and their values.

use std::fs;

use super::bench::{Bench, inspect, manifest, table};

#[test]
fn a_table_that_is_not_there() {
    let bench = Bench::new();
    fs::remove_file(bench.recording().join("t.csv")).expect("removed");
    bench.recording_is_refused(&["t.csv", "does not exist"]);
}

#[test]
fn an_empty_table() {
    table("").recording_is_refused(&["t.csv", "is empty"]);
    table("gx,dx,rx\n").recording_is_refused(&["t.csv", "no rows"]);
}

#[test]
fn a_missing_column() {
    table("gx,rx\n1,2\n").recording_is_refused(&["t.csv, dx", "no such column", "gx, rx"]);
}

#[test]
fn a_column_twice_in_the_header() {
    table("gx,dx,rx,dx\n1,2,3,4\n").recording_is_refused(&["t.csv, dx", "twice"]);
}

#[test]
fn text_in_a_number_column() {
    table("gx,dx,rx\n1,2,3\n1,broken,3\n").recording_is_refused(&[
        "t.csv, dx, row 1",
        "\"broken\"",
        "is text, not a number",
    ]);
}

#[test]
fn rows_of_unequal_length() {
    table("gx,dx,rx\n1,2,3\n1,2,3\n1,2\n").recording_is_refused(&[
        "t.csv, row 2",
        "2 cells",
        "3 cells",
    ]);
    table("gx,dx,rx\n1,2,3\n1,2,3,4\n").recording_is_refused(&[
        "t.csv, row 1",
        "4 cells",
        "3 cells",
    ]);
}

#[test]
fn a_count_that_is_not_whole() {
    table("gx,dx,rx\n1,2,3\n1.5,2,3\n").recording_is_refused(&[
        "t.csv, gx (gyro_count), row 1",
        "found 1.5",
        "whole number of pulses",
    ]);
}

#[test]
fn an_infinite_value() {
    table("gx,dx,rx\n1,2,3\n1,2,-inf\n").recording_is_refused(&["t.csv, rx", "row 1", "infinite"]);
}

#[test]
fn a_value_that_no_instrument_shows() {
    table("gx,dx,rx\n1,2,3\n1,2,1e300\n").recording_is_refused(&["t.csv, rx", "row 1", "beyond"]);
}

#[test]
fn a_gyro_without_a_single_value() {
    table("gx,dx,rx\n,2,3\nnan,2,3\n")
        .recording_is_refused(&["t.csv, gx (gyro_count)", "no value"]);
}

#[test]
fn a_dither_angle_in_arcseconds() {
    manifest("scale = 1e-8", "scale = 1.0")
        .recording_is_refused(&["dx (dither_angle)", "cannot be in rad"]);
}

#[test]
fn time_stamps_that_do_not_increase() {
    let stamped = |stamps: &str| {
        let bench = manifest("rate_hz = 4000.0\nstart_s = 0.0\n", "time = \"t\"\n");
        let rows: String = stamps.split(' ').map(|t| format!("{t},1,2,3\n")).collect();
        bench.write("t.csv", format!("t,gx,dx,rx\n{rows}"));
        bench
    };
    assert_eq!(stamped("0 0.001 0.003").run(inspect).status.code(), Some(0));
    stamped("0 0.002 0.001").recording_is_refused(&["t.csv, t, row 2", "0.001", "after 0.002 s"]);
    stamped("0 0 1").recording_is_refused(&["t.csv, t, row 1", "do not increase"]);
    stamped("0 nan 1").recording_is_refused(&["t.csv, t, row 1", "NaN"]);
}

#[test]
fn a_blank_line_between_rows() {
    // It would move every later row by one period.
    for text in [
        "gx,dx,rx\n1,2,3\n\n1,2,3\n1,2,3\n",
        "gx,dx,rx\r\n1,2,3\r\n\r\n1,2,3\r\n",
    ] {
        table(text).recording_is_refused(&["t.csv, row 1", "blank line"]);
    }
    table("gx,dx,rx\n\n1,2,3\n").recording_is_refused(&["t.csv, row 0", "blank line"]);
    for text in [
        "gx,dx,rx\n1,100,3\n2,100,3\n\n\n",
        "gx,dx,rx\r\n1,100,3\r\n2,100,3\r\n\r\n",
        "gx,dx,rx,note\n1,100,3,\"two\n\nlines\"\n2,100,3,none\n",
    ] {
        assert_eq!(table(text).run(inspect).status.code(), Some(0), "{text:?}");
    }
}
