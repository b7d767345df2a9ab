//! The command `rlg`; everything is in the library's `command`.

use std::process::ExitCode;

fn main() -> ExitCode {
    keep_freed_rows();
    rlg::command::run()
}

/// Keeps freed columns in the process: columns of a minute at 4 kHz are allocated and freed by the hundred, and by default
/// glibc returns each to the system, which clears the pages again for the next, a tenth of all work.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_freed_rows() {
    /// Largest kept allocation: a column is 2 MB; larger blocks are returned, so that a long recording leaves no holes.
    const LARGEST_KEPT: libc::c_int = 4 << 20;
    const MOST_KEPT: libc::c_int = 256 << 20;
    // SAFETY: mallopt only requires valid numbers, and no other thread runs yet.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGEST_KEPT);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MOST_KEPT);
        // Threads pass columns on to each other: freed ones kept in an arena each take a fifth more memory.
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_freed_rows() {}
