//! The folder and its recording.toml.

use std::fs;

use super::bench::{Bench, inspect, manifest};

#[test]
fn a_recording_that_is_not_there() {
    let bench = Bench::new();
    fs::remove_dir_all(bench.recording()).expect("removed");
    bench.recording_is_refused(&["recording", "does not exist", "recording.toml"]);
}

#[test]
fn a_recording_that_is_a_file() {
    let bench = Bench::new();
    fs::remove_dir_all(bench.recording()).expect("removed");
    fs::write(bench.recording(), "x").expect("a file");
    bench.recording_is_refused(&["recording", "is not a folder"]);
}

#[test]
fn a_folder_without_recording_toml() {
    let bench = Bench::new();
    fs::remove_file(bench.recording().join("recording.toml")).expect("removed");
    bench.recording_is_refused(&["recording.toml", "does not exist"]);
}

#[test]
fn an_empty_recording_toml() {
    let bench = Bench::new();
    bench.write("recording.toml", "");
    bench.recording_is_refused(&["recording.toml", "is empty"]);
}

#[test]
fn a_recording_of_another_format() {
    manifest("format = 1", "format = 2").recording_is_refused(&[
        "recording.toml, format",
        "found 2",
        "format = 1",
    ]);
}

#[test]
fn a_recording_without_a_format() {
    manifest("format = 1\n", "")
        .recording_is_refused(&["recording.toml, format", "no format number"]);
}

#[test]
fn a_line_that_is_not_toml() {
    manifest("rate_hz = 4000.0", "rate_hz 4000.0")
        .recording_is_refused(&["recording.toml, line 5", "rate_hz 4000.0"]);
}

#[test]
fn text_where_a_rate_belongs() {
    manifest("rate_hz = 4000.0", "rate_hz = \"fast\"").recording_is_refused(&[
        "recording.toml, line 5",
        "fast",
        "expected a number",
    ]);
}

#[test]
fn a_rate_of_zero_negative_or_nan() {
    for rate in ["0", "0.0", "-4000.0", "nan", "inf"] {
        manifest("rate_hz = 4000.0", &format!("rate_hz = {rate}"))
            .recording_is_refused(&["recording.toml, table t.csv, rate_hz", "positive"]);
    }
}

#[test]
fn neither_a_rate_nor_a_time() {
    manifest("rate_hz = 4000.0\n", "").recording_is_refused(&[
        "table t.csv",
        "neither",
        "rate_hz",
        "time",
    ]);
}

#[test]
fn both_a_rate_and_a_time() {
    manifest("rate_hz = 4000.0\n", "rate_hz = 4000.0\ntime = \"dx\"\n").recording_is_refused(&[
        "table t.csv",
        "both",
        "rate_hz",
        "time",
    ]);
}

#[test]
fn a_table_outside_the_folder() {
    for name in ["../t.csv", "/etc/passwd", "", "a/../../t.csv"] {
        manifest("\"t.csv\"", &format!("{name:?}"))
            .recording_is_refused(&["recording.toml, table.file", "outside"]);
    }
}

#[test]
fn a_table_of_an_unknown_kind() {
    manifest("\"t.csv\"", "\"t.mat\"").recording_is_refused(&["t.mat", ".parquet or .csv"]);
}

#[test]
fn a_recording_without_tables_or_channels() {
    let bench = Bench::new();
    bench.write("recording.toml", "format = 1\nname = \"x\"\n");
    bench.recording_is_refused(&["lists no table"]);
    bench.write(
        "recording.toml",
        "format = 1\n[[table]]\nfile = \"t.csv\"\nrate_hz = 1.0\n",
    );
    bench.recording_is_refused(&["table t.csv", "no channel"]);
}

#[test]
fn an_axis_that_the_quantity_does_not_have() {
    manifest("axis = \"x\"", "axis = \"w\"").recording_is_refused(&[
        "channel gx",
        "gyro_count",
        "found \"w\"",
        "\"x\", \"y\" or \"z\"",
    ]);
    manifest("axis = \"x\"", "").recording_is_refused(&["channel gx", "gyro_count", "found none"]);
}

#[test]
fn a_unit_that_disagrees_with_the_quantity() {
    manifest("scale = 1e-8", "scale = 1e-8\nunit = \"deg/s\"").recording_is_refused(&[
        "channel dx",
        "dither_angle",
        "found \"deg/s\"",
        "\"rad\" after scale and offset, or one of deg, rad, arcsec",
    ]);
}

#[test]
fn a_unit_that_agrees_is_accepted() {
    let bench = manifest("scale = 1e-8", "scale = 1e-8\nunit = \"rad\"");
    assert_eq!(bench.run(inspect).status.code(), Some(0));
}

#[test]
fn a_scale_that_is_zero_or_not_finite() {
    for scale in ["0.0", "nan", "inf"] {
        manifest("scale = 1e-8", &format!("scale = {scale}"))
            .recording_is_refused(&["channel dx, scale", "other than 0"]);
    }
}

#[test]
fn the_same_column_or_the_same_quantity_twice() {
    manifest("\"dx\"", "\"gx\"").recording_is_refused(&["channel gx", "listed twice"]);
    manifest("dither_angle", "gyro_count")
        .recording_is_refused(&["channel dx", "gyro_count x in column gx"]);
}

#[test]
fn a_segment_that_ends_before_it_starts() {
    manifest("end_s = 1.0", "end_s = -1.0").recording_is_refused(&[
        "segment still",
        "ends before it starts",
        "end_s = -1",
    ]);
}

#[test]
fn a_latitude_in_degrees() {
    manifest(
        "[[table]]",
        "[site]\nlatitude_rad = 34.0\ngravity_m_s2 = 9.8\n[[table]]",
    )
    .recording_is_refused(&["site.latitude_rad", "found 34", "rad"]);
}
