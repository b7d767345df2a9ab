//! Recordings not made by this project, from the folder of `RLG_RECORDINGS`.

use std::path::PathBuf;

use rlg::model::Model;
use rlg::recording::{Quantity, Recording};

/// Returns the bench recordings, or `None` with a printed reason.
fn bench() -> Option<PathBuf> {
    let folder = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
    }
    folder
}

#[test]
fn every_bench_recording_reads_with_three_gyros_a_dither_and_a_reference() {
    let Some(folder) = bench() else { return };
    for name in ["bench-null", "bench-coning", "bench-shake"] {
        let recording =
            Recording::read(folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(recording.name, name);
        for quantity in [
            Quantity::GyroCount,
            Quantity::DitherAngle,
            Quantity::ReferenceIncrement,
        ] {
            for axis in ["x", "y", "z"] {
                let (table, channel) = recording.channel(&quantity, axis).expect("bench channel");
                assert_eq!(channel.values.len(), table.rows);
                assert!(channel.values.iter().all(|value| value.is_finite()));
            }
        }
    }
}

#[test]
fn every_bench_model_reads_without_a_warning() {
    let Some(folder) = bench() else { return };
    for name in ["bench-null", "bench-coning", "bench-shake"] {
        let path = folder.join(name).join("model.toml");
        let (model, warnings) =
            Model::read_with_warnings(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(warnings.is_empty(), "{warnings:?}");
        assert!(model.effects.is_empty());
        assert!(model.dither.is_some() && model.reference.is_some());
    }
}

#[test]
fn a_bench_recording_written_again_is_the_same_to_the_bit_and_no_larger() {
    let Some(folder) = bench() else { return };
    let original =
        Recording::read(folder.join("bench-coning")).unwrap_or_else(|error| panic!("{error}"));
    let copy = tempfile::tempdir().expect("a temporary folder");
    original
        .write_to(copy.path())
        .unwrap_or_else(|error| panic!("{error}"));
    let back = Recording::read(copy.path()).unwrap_or_else(|error| panic!("{error}"));
    // No value is missing in it, so equality is equality of bits but for the sign of a zero.
    assert_eq!(back.tables, original.tables);
    assert_eq!(
        (&back.name, back.site, &back.segments),
        (&original.name, original.site, &original.segments)
    );
    // The original stores integers under zstd; stored as floats it would take twice as much or more.
    let size = |folder: &std::path::Path| {
        folder
            .join("samples.parquet")
            .metadata()
            .expect("there")
            .len()
    };
    assert!(size(copy.path()) < size(&folder.join("bench-coning")) * 11 / 10);
}
