//! The simulator against formulas written here, not against itself.

mod basics;
mod beside;
mod command;
mod effects;
mod errors;
mod gyro_effects;
mod lock_in;
mod motion;
mod statistics;
mod support;

use std::path::Path;

#[test]
fn simulator_imports_neither_the_core_nor_the_reference() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/simulate");
    let mut files = 0;
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(path).unwrap();
            files += 1;
            for foreign in [
                "trueaxis",
                "crate::reference",
                "crate::replay",
                "crate::diagnose",
            ] {
                assert!(!text.contains(foreign), "{foreign}");
            }
        }
    }
    assert!(files >= 20);
}
