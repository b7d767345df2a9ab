//! Damaged recordings into reading and diagnosing.
//!
//! Holds: no panic and no huge allocation (the fuzzer's own limits); an error is one line. The fuzzer's bytes
//! choose a small recording and what is done to its files, in `tests/damaged_recordings/damage.rs`.
#![no_main]

#[path = "../../tests/damaged_recordings/damage.rs"]
mod damage;

use libfuzzer_sys::fuzz_target;
use rlg::diagnose::diagnose;
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::Recording;
use rlg::report::page;

fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    damage::write(&damage::damaged(data), folder.path());
    if let Err(error) = outcome(folder.path()) {
        assert_eq!(error.to_string().lines().count(), 1, "{error}");
    }
});

fn outcome(folder: &std::path::Path) -> Result<(), InputError> {
    let recording = Recording::read(folder)?;
    let file = folder.join("model.toml");
    let model = Model::read(&file)?;
    let outcome = diagnose(&recording, &model, &file, 0, &|_| {})?;
    assert!(page(&outcome.diagnosis, outcome.pictures.as_ref()).ends_with("</html>"));
    Ok(())
}
