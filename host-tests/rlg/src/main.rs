//! The command `rlg`; everything is in the library's `command`.

use std::process::ExitCode;

fn main() -> ExitCode {
    keep_freed_rows();
    rlg::command::run()
}

/// Columns of a minute at 4 kHz come and go by the hundred: left to itself glibc gives each back to the system, and the
/// pages are cleared again for the next, a tenth of all work.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_freed_rows() {
    /// A column is 2 MB; what is larger goes back, so that a long recording leaves no holes.
    const LARGEST_KEPT: libc::c_int = 4 << 20;
    const MOST_KEPT: libc::c_int = 256 << 20;
    // SAFETY: mallopt has no other condition than its own numbers, and no other thread runs yet.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGEST_KEPT);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MOST_KEPT);
        // Threads pass columns on to each other: kept by each for itself, freed ones take a fifth more memory.
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_freed_rows() {}
