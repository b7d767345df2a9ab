//! Progress of a diagnosis: step, number of steps, share done, time left.
//!
//! A diagnosis is one of five kinds of work, each a list of steps with its usual share of the time. The time left is
//! computed from the time taken so far and the shares done; before a tenth is done, from the number of rows, for an idle
//! machine of two cores. Both were measured on single runs of this display and affect only the display.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::terminal::Terminal;

/// Predicted time above which it is printed at the start \[s\].
const LONG_S: f64 = 60.0;

/// Share of the work after which the time left is extrapolated from the speed so far.
const TELLING: f64 = 0.1;

/// Largest share of a step displayed before the next one begins.
const MOST_OF_A_STEP: f64 = 0.95;

/// Kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    /// A unit at rest.
    AtRest,
    /// Gyros with a reference of rates.
    Rates,
    /// Gyros with attitudes, or with a reference of fewer rows.
    Attitudes,
    /// Dithered gyros with a reference.
    DitheredInMemory,
    /// Dithered gyros with a reference, longer than memory.
    Dithered,
}

/// Step: beginning of its name, and its share of the time.
type Step = (&'static str, f64);

/// Steps of a kind of work, and their time on an idle machine of two cores.
struct Profile {
    steps: &'static [Step],
    fixed_s: f64,
    s_per_row: f64,
}

impl Work {
    fn profile(self) -> Profile {
        let (steps, fixed_s, s_per_row): (&[Step], _, _) = match self {
            Self::AtRest => (&AT_REST, 0.5, 5e-5),
            Self::Rates => (&RATES, 0.5, 1e-4),
            Self::Attitudes => (&ATTITUDES, 0.5, 1e-4),
            Self::DitheredInMemory => (&DITHERED_IN_MEMORY, 0.5, 2e-5),
            Self::Dithered => (&DITHERED, 0.5, 2e-5),
        };
        Profile {
            steps,
            fixed_s,
            s_per_row,
        }
    }
}

/// Passes come before and after lines, which take up to four fifths of the time if there are many.
const AT_REST: [Step; 5] = [
    ("aligning the channels", 0.10),
    ("pass", 0.10),
    ("taking out lines", 0.40),
    ("writing the findings", 0.05),
    ("permutation control", 0.35),
];

const RATES: [Step; 7] = [
    ("aligning the channels", 0.36),
    ("pass 1", 0.17),
    ("pass 2", 0.25),
    ("pass 3", 0.13),
    ("self-test on this recording", 0.01),
    ("writing the findings", 0.07),
    ("predicting the accelerometers", 0.01),
];

const ATTITUDES: [Step; 4] = [
    ("aligning the channels", 0.05),
    ("aligning the reference", 0.88),
    ("searching for physics", 0.05),
    ("writing the findings", 0.02),
];

const DITHERED_IN_MEMORY: [Step; 8] = [
    ("aligning the channels", 0.07),
    ("pass 1", 0.25),
    ("pass 2", 0.30),
    ("pass 3", 0.15),
    ("self-test on this recording", 0.01),
    ("writing the findings", 0.12),
    ("predicting the accelerometers", 0.08),
    ("searching the accelerometers' effects", 0.02),
];

const DITHERED: [Step; 14] = [
    ("aligning the channels", 0.06),
    ("qualifying the data", 0.02),
    ("deriving the motion", 0.02),
    ("forming the regressors", 0.04),
    ("fitting the noise", 0.06),
    ("weighing the listed effects", 0.19),
    ("searching for unlisted physics", 0.15),
    ("weighing drifting noise", 0.05),
    ("sliding and injecting", 0.05),
    ("settling events", 0.08),
    ("locating", 0.04),
    ("validating on what was held out", 0.02),
    ("predicting the accelerometers", 0.13),
    ("searching the accelerometers' effects", 0.09),
];

/// Progress of the work.
struct Reached {
    steps: &'static [Step],
    /// Predicted time of the whole, from the rows \[s\].
    predicted_s: f64,
    /// Index of the current step, from 0; none before the first.
    place: Option<usize>,
    /// Share of the time of the steps before it.
    done: f64,
    begun: Instant,
    /// Start of the current step.
    since: Instant,
}

impl Reached {
    /// Returns the share done and the time left \[s\] at `now`.
    fn at(&self, now: Instant) -> (f64, f64) {
        let taken_s = (self.since - self.begun).as_secs_f64();
        let share = self.place.map_or(0.0, |place| self.steps[place].1);
        let here_s = (now - self.since).as_secs_f64();
        let by_speed_s = match self.done > TELLING {
            true => taken_s / self.done,
            false => self.predicted_s,
        };
        // A step that exceeds its share implies that the whole does.
        let by_step_s = (taken_s + here_s) / (self.done + share).max(f64::MIN_POSITIVE);
        let total_s = match share > 0.0 {
            true => by_speed_s.max(by_step_s),
            false => by_speed_s,
        };
        let of_step = (here_s / (share * total_s).max(f64::MIN_POSITIVE)).min(MOST_OF_A_STEP);
        let done = (self.done + share * of_step).min(1.0);
        (done, total_s * (1.0 - done))
    }

    /// Moves on to a step; a stage of another name, or an earlier one, belongs to the current step.
    fn go_on(&mut self, stage: &str, now: Instant) {
        let mut steps = self.steps.iter();
        let found = steps.position(|(begins, _)| stage.starts_with(begins));
        if let Some(place) = found.filter(|place| self.place.is_none_or(|at| *place > at)) {
            self.done = self.steps[..place].iter().map(|(_, share)| share).sum();
            self.place = Some(place);
            self.since = now;
        }
    }
}

/// Formats a time: `20 s`, `3 min`.
fn time(seconds: f64) -> String {
    match seconds {
        seconds if seconds < 10.0 => format!("{:.0} s", seconds.max(1.0)),
        seconds if seconds < 90.0 => format!("{:.0} s", (seconds / 5.0).round() * 5.0),
        seconds => format!("{:.0} min", seconds / 60.0),
    }
}

/// Steps of one diagnosis on a spinner.
pub(super) struct Steps<'a> {
    terminal: &'a Terminal,
    spinner: &'a ProgressBar,
    reached: Arc<Mutex<Option<Reached>>>,
}

impl<'a> Steps<'a> {
    /// Creates the display, before the work is known.
    pub(super) fn new(terminal: &'a Terminal, spinner: &'a ProgressBar) -> Self {
        let reached: Arc<Mutex<Option<Reached>>> = Arc::default();
        let shown = Arc::clone(&reached);
        let style = ProgressStyle::default_spinner().template("{spinner} {msg}{left} {elapsed}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_spinner());
        let left = move |_: &ProgressState, to: &mut dyn std::fmt::Write| {
            if let Some(reached) = &*whole(&shown) {
                let (done, left_s) = reached.at(Instant::now());
                // Failing to draw is ignored.
                let _ = write!(to, ", {:.0} %, about {} left;", 100.0 * done, time(left_s));
            }
        };
        spinner.set_style(style.with_key("left", left));
        Self {
            terminal,
            spinner,
            reached,
        }
    }

    /// Prints the predicted time of `work` on so many rows at once if it exceeds a minute.
    pub(super) fn expect(&self, work: Work, rows: usize) {
        let profile = work.profile();
        let predicted_s = profile.fixed_s + profile.s_per_row * rows as f64;
        if predicted_s > LONG_S {
            let time = time(predicted_s);
            self.terminal
                .note(format!("{rows} rows: this takes about {time}"));
        }
        let now = Instant::now();
        *whole(&self.reached) = Some(Reached {
            steps: profile.steps,
            predicted_s,
            place: None,
            done: 0.0,
            begun: now,
            since: now,
        });
    }

    /// Displays a stage.
    pub(super) fn show(&self, stage: &str) {
        let text = match &mut *whole(&self.reached) {
            Some(reached) => {
                reached.go_on(stage, Instant::now());
                let step = reached.place.map_or(1, |place| place + 1);
                format!("step {step} of {}: {stage}", reached.steps.len())
            }
            None => stage.to_owned(),
        };
        self.terminal.step(self.spinner, text);
    }
}

/// Locks the progress, after a panic in another thread too: it is consistent between any two stages.
fn whole(reached: &Mutex<Option<Reached>>) -> MutexGuard<'_, Option<Reached>> {
    reached.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn shares_of_each_kind_of_work_are_one_and_time_left_follows_the_work() {
        let all = [
            Work::AtRest,
            Work::Rates,
            Work::Attitudes,
            Work::DitheredInMemory,
            Work::Dithered,
        ];
        for work in all {
            let steps = work.profile().steps;
            let sum: f64 = steps.iter().map(|(_, share)| share).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{work:?}: {sum}");
        }
        let begun = Instant::now();
        let at = |seconds: f64| begun + Duration::from_secs_f64(seconds);
        let mut reached = Reached {
            steps: &[("one", 0.25), ("two", 0.75)],
            predicted_s: 40.0,
            place: None,
            done: 0.0,
            begun,
            since: begun,
        };
        reached.go_on("one of many", at(0.0));
        let (done, left_s) = reached.at(at(5.0));
        assert!((done - 0.125).abs() < 1e-9 && (left_s - 35.0).abs() < 1e-9);
        // The machine is twice as slow as predicted.
        reached.go_on("two", at(20.0));
        reached.go_on("one", at(21.0));
        let (done, left_s) = reached.at(at(50.0));
        assert!(
            (done - 0.625).abs() < 1e-9 && (left_s - 30.0).abs() < 1e-9,
            "{done} {left_s}"
        );
        // A step that takes ten times its share is not predicted to end at once.
        let (done, left_s) = reached.at(at(500.0));
        assert!(done < 1.0 && left_s > 15.0, "{done} {left_s}");
    }
}
