//! The command `rlg`; everything is in the library's `command`.

use std::process::ExitCode;

fn main() -> ExitCode {
    rlg::command::run()
}
