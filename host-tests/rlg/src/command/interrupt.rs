//! Ends the process on Ctrl-C and SIGTERM without half-written outputs.

use crate::output;

/// Watches for SIGINT and SIGTERM from now on: outputs that are not in their place are removed, then the signal does what
/// it always does, so that the shell sees which one ended the process.
#[cfg(unix)]
pub(super) fn leave_nothing_behind() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else {
        // Then a signal ends the process as it would have without this.
        return;
    };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            let _held = output::abandon();
            // It does not return: both signals end a process.
            let _ = emulate_default_handler(signal);
        }
    });
}

/// Elsewhere the system ends the process at once.
#[cfg(not(unix))]
pub(super) fn leave_nothing_behind() {}
