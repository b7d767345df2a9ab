//! Ends the process on Ctrl-C and SIGTERM without half-written outputs.

use crate::output;

/// Handles SIGINT and SIGTERM from now on: removes outputs that are not in their place, then runs the signal's default
/// action, so that the shell sees which signal ended the process.
#[cfg(unix)]
pub(super) fn leave_nothing_behind() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else {
        // Without a handler a signal ends the process as by default.
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

/// On other systems the process ends at once.
#[cfg(not(unix))]
pub(super) fn leave_nothing_behind() {}
