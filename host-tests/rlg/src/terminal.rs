//! Prints the output of a command: results on standard output, progress and warnings on standard error.
//!
//! A result is words, or JSON with `--json`; then the words go to standard error. Colour and progress appear on a terminal
//! only; `--quiet` silences standard error but for errors. A closed reader (`rlg ... | head`) is no error.

use std::fmt::{Display, Write};
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use console::{Term, style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;

use crate::error::InputError;

/// Redraws of a progress bar a second: enough for a live display, at no cost.
const REDRAW_HZ: u8 = 10;

/// Width of a page of text without a terminal \[characters\].
const WIDTH: usize = 80;

/// Time between the steps of a spinner.
const SPIN: Duration = Duration::from_millis(100);

/// Time after which the spinner warns that the work may take minutes.
const LONG: Duration = Duration::from_secs(15);

/// The two streams and their settings; or a program that listens instead.
#[derive(Debug, Clone)]
pub struct Terminal {
    results: Results,
    quiet: bool,
    /// Reason for which a line of the result could not be printed.
    lost: Arc<OnceLock<String>>,
}

/// Destination of results.
#[derive(Debug, Clone)]
enum Results {
    Words,
    Json,
    None,
    Listener(Arc<Listener>),
}

/// Collects the output of a command for the program that runs it in its own process.
pub struct Listener {
    step: Box<dyn Fn(&str) + Send + Sync>,
    heard: Mutex<Heard>,
}

/// Output of a command.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    /// Result as JSON, as printed with `--json`.
    pub json: Option<String>,
    /// Warnings, in order.
    pub warnings: Vec<String>,
}

impl std::fmt::Debug for Listener {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.heard.fmt(f)
    }
}

impl Listener {
    /// `step` is called at every step of the work, on the thread of the work; it may unwind to stop it.
    pub fn new(step: impl Fn(&str) + Send + Sync + 'static) -> Arc<Self> {
        Arc::new(Self {
            step: Box::new(step),
            heard: Mutex::default(),
        })
    }

    /// Takes the output so far.
    pub fn take(&self) -> Heard {
        std::mem::take(&mut *self.hear())
    }

    fn hear(&self) -> std::sync::MutexGuard<'_, Heard> {
        // Consistent between any two sentences, whoever panicked.
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Terminal {
    /// `json`: results are JSON, not words; `quiet`: only errors go to standard error.
    pub fn new(json: bool, quiet: bool) -> Self {
        let results = if json { Results::Json } else { Results::Words };
        Self::of(results, quiet)
    }

    /// Prints nothing but errors: for a command run by another one.
    pub fn silent() -> Self {
        Self::of(Results::None, true)
    }

    /// Sends everything to `listener`, nothing to the process's own streams.
    pub fn heard_by(listener: Arc<Listener>) -> Self {
        Self::of(Results::Listener(listener), true)
    }

    fn of(results: Results, quiet: bool) -> Self {
        Self {
            results,
            quiet,
            lost: Arc::default(),
        }
    }

    /// Returns an error if a line of the result could not be printed, as on a full device.
    pub fn whole(&self) -> Result<(), InputError> {
        self.lost.get().map_or(Ok(()), |reason| {
            Err(InputError::new("standard output", reason.clone()))
        })
    }

    /// Returns the terminal to ask on: where standard input and standard error are one, and neither `--quiet` nor a program
    /// in this process listens.
    pub fn to_ask_on(&self) -> Option<Term> {
        let is_own = matches!(self.results, Results::Words | Results::Json);
        let is_seen = is_own && !self.quiet;
        let is_one = || io::stdin().is_terminal() && io::stderr().is_terminal();
        (is_seen && is_one()).then(Term::stderr)
    }

    /// Shows a step of the work on `bar`, and to a listening program.
    pub fn step(&self, bar: &ProgressBar, text: impl Into<String>) {
        let text = text.into();
        if let Results::Listener(listener) = &self.results {
            (listener.step)(&text);
        }
        bar.set_message(text);
    }

    /// Prints a line of a result in words; on standard error if `--json` puts the result on standard output.
    pub fn say(&self, text: impl Display) {
        match self.results {
            Results::Json | Results::None | Results::Listener(_) => self.note(text),
            Results::Words => {
                if let Err(error) = to_standard_output(&text) {
                    // The first reason is kept; the caller asks for it at the end.
                    let _ = self.lost.set(format!("cannot be written ({error})"));
                }
            }
        }
    }

    /// Prints a line on standard error, such as the progress of the work.
    pub fn note(&self, text: impl Display) {
        if !self.quiet {
            to_standard_error(&text);
        }
    }

    /// Prints a line on standard error that needs the reader's action.
    pub fn warn(&self, text: impl Display) {
        if let Results::Listener(listener) = &self.results {
            listener.hear().warnings.push(text.to_string());
        }
        if !self.quiet {
            to_standard_error(&format!(
                "{}: {text}",
                style("warning").for_stderr().yellow().bold()
            ));
        }
    }

    /// Prints the one line that ends a command with an unusable input; `--quiet` does not hide it.
    pub fn error(&self, error: &InputError) {
        to_standard_error(&format!(
            "{}: {error}",
            style("error").for_stderr().red().bold()
        ));
    }

    /// Prints a line that belongs to an error.
    pub fn hint(&self, line: &str) {
        to_standard_error(&line);
    }

    /// Prints a result as JSON on standard output if `--json` is given.
    pub fn result(&self, result: &impl Serialize) -> Result<(), InputError> {
        let fault = |error: &dyn Display| {
            InputError::new("standard output", format!("cannot be written ({error})"))
        };
        let text = || serde_json::to_string_pretty(result).map_err(|error| fault(&error));
        match &self.results {
            Results::Words | Results::None => {}
            Results::Json => to_standard_output(&text()?).map_err(|error| fault(&error))?,
            Results::Listener(listener) => listener.hear().json = Some(text()?),
        }
        Ok(())
    }

    /// Creates a bar over `steps` steps of one kind; draws nothing if standard error is no terminal.
    pub fn bar(&self, steps: u64, label: &'static str) -> ProgressBar {
        let bar = ProgressBar::with_draw_target(Some(steps), self.target());
        let template = "{msg:24} {wide_bar} {human_pos}/{human_len} {eta:>5}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.with_message(label)
    }

    /// Creates a spinner for work of unknown length.
    pub fn spinner(&self, label: &'static str) -> ProgressBar {
        // Without a style of its own a bar of unknown length shows "0/0" and no words.
        let style = ProgressStyle::default_spinner();
        let style = style
            .template("{spinner} {msg} {elapsed}{patience}")
            .unwrap_or_else(|_| ProgressStyle::default_spinner())
            .with_key("patience", |state: &ProgressState, to: &mut dyn Write| {
                if state.elapsed() > LONG {
                    // Failing to draw is ignored.
                    let _ = to.write_str("; a long or lively recording takes minutes");
                }
            });
        let spinner = ProgressBar::with_draw_target(None, self.target())
            .with_style(style)
            .with_message(label);
        if !spinner.is_hidden() {
            spinner.enable_steady_tick(SPIN);
        }
        spinner
    }

    /// Returns the width of the stream of words \[characters\]: 80 if it is no terminal.
    pub fn width(&self) -> usize {
        let stream = match self.results {
            Results::Words => Term::stdout(),
            _ => Term::stderr(),
        };
        let size = stream.is_term().then(|| stream.size_checked()).flatten();
        size.map_or(WIDTH, |(_, columns)| columns.into())
    }

    fn target(&self) -> ProgressDrawTarget {
        // indicatif itself draws nothing if standard error is no terminal.
        if self.quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(REDRAW_HZ)
        }
    }
}

fn to_standard_error(text: &dyn Display) {
    // eprintln! panics if standard error is closed; the message is then dropped.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Writes a line; a closed reader is no error.
pub(crate) fn to_standard_output(text: &dyn Display) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}
