//! Commitment to the answers: their hashes are on disk before any diagnosis.
//!
//! Each answer is a line of JSON with its salt; `commitments.txt` has a line `TRIAL SHA256` for each. Afterwards
//! `answers.jsonl` reveals the lines; to check one: `sed -n 1p answers.jsonl | tr -d '\n' | sha256sum`.

use std::fmt::Write as _;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use rlg_recording::error::InputError;

/// File of the commitments.
pub const COMMITMENTS: &str = "commitments.txt";

/// File of the answers.
pub const ANSWERS: &str = "answers.jsonl";

/// File of the diagnoses' outcomes.
pub const OUTCOMES: &str = "outcomes.jsonl";

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in Sha256::digest(bytes) {
        let _ = write!(text, "{byte:02x}");
    }
    text
}

/// Text of `commitments.txt` for answers by trial.
pub fn commitments(lines: &[(u64, String)]) -> String {
    let mut text = String::new();
    for (trial, line) in lines {
        let _ = writeln!(text, "{trial} {}", sha256(line.as_bytes()));
    }
    text
}

/// Checks that the revealed answers are the committed ones; returns their number.
pub fn check(committed: &str, answers: &str, folder: &Path) -> Result<usize, InputError> {
    let hashes: Vec<(&str, &str)> = committed
        .lines()
        .filter_map(|line| line.split_once(' '))
        .collect();
    let lines: Vec<&str> = answers.lines().collect();
    if hashes.len() != lines.len() {
        return Err(
            InputError::new(folder.join(ANSWERS), "does not match the commitments")
                .value(format!("{} answers", lines.len()))
                .expected(format!("{} of {COMMITMENTS}", hashes.len())),
        );
    }
    for (row, ((trial, hash), line)) in hashes.into_iter().zip(&lines).enumerate() {
        let found = sha256(line.as_bytes());
        if found != hash {
            return Err(InputError::new(
                folder.join(ANSWERS),
                format!(
                    "line {}: is not what was committed to for trial {trial}",
                    row + 1
                ),
            )
            .value(found)
            .expected(hash));
        }
    }
    Ok(lines.len())
}
