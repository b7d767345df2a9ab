//! Files of others are unchanged: each has its sum, and its folder the licence, from `vendor/README.md`.

use std::fs;
use std::path::Path;

use sha2::{Digest as _, Sha256};

#[test]
fn foreign_files_are_those_that_their_table_names() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../report/vendor");
    let table = fs::read_to_string(folder.join("README.md")).expect("a table");
    let mut listed = Vec::new();
    for row in table.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row
            .split('|')
            .map(|cell| cell.trim().trim_matches('`'))
            .collect();
        let [_, file, _, _, _, _, expected, _] = cells[..] else {
            panic!("six cells: {row}");
        };
        let bytes = fs::read(folder.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        let sum: String = Sha256::digest(&bytes)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        assert_eq!(sum, expected, "{file} is not what the table names");
        listed.push(file.to_owned());
    }
    let mut there: Vec<String> = Vec::new();
    for package in fs::read_dir(&folder)
        .expect("a folder")
        .flatten()
        .filter(|entry| entry.path().is_dir())
    {
        let package = package.file_name().to_string_lossy().into_owned();
        let files = fs::read_dir(folder.join(&package))
            .expect("a folder")
            .flatten();
        there.extend(files.map(|file| format!("{package}/{}", file.file_name().to_string_lossy())));
    }
    listed.sort();
    there.sort();
    assert_eq!(there, listed, "each file has a row, and each row a file");
    assert!(listed.iter().any(|file| file.ends_with("/LICENSE")));
}
