//! Unusable input: one sentence with its place, exit code 2, nothing written.
//!
//! Every case runs every command that reads such an input; a new command joins by one line in
//! `READERS_OF_RECORDINGS` or `READERS_OF_MODELS` of `bench.rs`.

mod bench;
mod manifests;
mod models;
mod outputs;
mod tables;

use bench::{Bench, CONTENT_WITH_ONE_GYRO};

#[test]
fn the_good_recording_and_model_are_accepted_with_their_gaps() {
    let bench = Bench::new();
    for arguments in CONTENT_WITH_ONE_GYRO {
        let output = bench.run(*arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
