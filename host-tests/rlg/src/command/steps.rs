//! How far a diagnosis is, as "step 3 of 22".

use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::ProgressBar;

use crate::terminal::Terminal;

/// What the engines report, in the order in which it comes; none of them does all of it.
const STEPS: [&str; 22] = [
    "reading",
    "aligning the channels",
    "qualifying the data",
    "comparing attitudes",
    "looking for the reference's clock",
    "deriving the motion",
    "aligning the reference",
    "forming the regressors",
    "fitting the noise",
    "weighing the listed effects",
    "searching for physics",
    "searching for unlisted physics",
    "weighing drifting noise",
    "looking for slow shapes",
    "looking where the unlisted acts",
    "sliding and injecting",
    "settling events",
    "predicting the accelerometers",
    "weighing the accelerometers' effects",
    "locating",
    "validating on what was held out",
    "writing the findings",
];

/// The steps of one diagnosis on a spinner.
pub(super) struct Steps<'a> {
    terminal: &'a Terminal,
    spinner: &'a ProgressBar,
    reached: AtomicUsize,
}

impl<'a> Steps<'a> {
    /// Before the first step.
    pub(super) fn new(terminal: &'a Terminal, spinner: &'a ProgressBar) -> Self {
        Self {
            terminal,
            spinner,
            reached: AtomicUsize::new(0),
        }
    }

    /// Shows a stage. One that is not in the list, or that comes again, leaves the number as it is.
    pub(super) fn show(&self, stage: &str) {
        let place = STEPS.iter().position(|step| *step == stage);
        let place = place.map_or(0, |place| place + 1);
        let reached = self.reached.fetch_max(place, Ordering::Relaxed).max(place);
        let count = STEPS.len();
        let text = format!("step {reached} of {count}: {stage}");
        self.terminal.step(self.spinner, text);
    }
}
