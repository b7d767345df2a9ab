//! Recordings this project did not make, from the folder that `RLG_RECORDINGS` names.

use std::path::PathBuf;

use rlg::model::Model;
use rlg::recording::{Quantity, Recording};

/// The bench recordings, or `None` with a printed reason.
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
