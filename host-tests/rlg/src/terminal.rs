//! What a command says, and where: words and progress on standard error, a result on standard output.
//!
//! Colour and progress appear on a terminal only; `--quiet` silences everything but errors. A reader
//! that goes away (`rlg ... | head`) is no error.

use std::fmt::Display;
use std::io::{self, Write as _};
use std::time::Duration;

use console::style;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::error::InputError;

/// Redraws of a progress bar a second: enough to look alive, too few to cost anything.
const REDRAW_HZ: u8 = 10;

/// Between the steps of a spinner.
const SPIN: Duration = Duration::from_millis(100);

/// The two streams and what may be said on them.
#[derive(Debug, Clone, Copy)]
pub struct Terminal {
    json: bool,
    quiet: bool,
}

impl Terminal {
    /// `json`: results go to standard output; `quiet`: only errors go to standard error.
    pub fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet }
    }

    /// Says that nothing but errors will be said: for tests and library use.
    pub fn silent() -> Self {
        Self::new(false, true)
    }

    /// A line of words on standard error.
    pub fn say(&self, text: impl Display) {
        if !self.quiet {
            to_standard_error(&text);
        }
    }

    /// A line on standard error that the reader should act on.
    pub fn warn(&self, text: impl Display) {
        if !self.quiet {
            to_standard_error(&format!(
                "{}: {text}",
                style("warning").for_stderr().yellow().bold()
            ));
        }
    }

    /// The one line that ends a command whose input cannot be used; `--quiet` does not hide it.
    pub fn error(&self, error: &InputError) {
        to_standard_error(&format!(
            "{}: {error}",
            style("error").for_stderr().red().bold()
        ));
    }

    /// A result, as JSON on standard output where `--json` asks for it.
    pub fn result(&self, result: &impl Serialize) -> Result<(), InputError> {
        if !self.json {
            return Ok(());
        }
        let fault = |error: &dyn Display| {
            InputError::new("standard output", format!("cannot be written ({error})"))
        };
        let mut text = serde_json::to_string_pretty(result).map_err(|error| fault(&error))?;
        text.push('\n');
        let mut stdout = io::stdout().lock();
        match stdout
            .write_all(text.as_bytes())
            .and_then(|()| stdout.flush())
        {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(fault(&error)),
            _ => Ok(()),
        }
    }

    /// A bar over `steps` steps of one kind; draws nothing where standard error is no terminal.
    pub fn bar(&self, steps: u64, label: &'static str) -> ProgressBar {
        let bar = ProgressBar::with_draw_target(Some(steps), self.target());
        let template = "{msg:24} {wide_bar} {human_pos}/{human_len} {eta:>5}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.with_message(label)
    }

    /// A sign of life for work whose length is not known.
    pub fn spinner(&self, label: &'static str) -> ProgressBar {
        // Without a style of its own a bar of unknown length shows "0/0" and no words.
        let spinner = ProgressBar::with_draw_target(None, self.target())
            .with_style(ProgressStyle::default_spinner())
            .with_message(label);
        if !spinner.is_hidden() {
            spinner.enable_steady_tick(SPIN);
        }
        spinner
    }

    fn target(&self) -> ProgressDrawTarget {
        // indicatif itself draws nothing where standard error is no terminal.
        if self.quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(REDRAW_HZ)
        }
    }
}

fn to_standard_error(text: &dyn Display) {
    // eprintln! panics where standard error is closed; the message is then dropped.
    let _ = writeln!(io::stderr().lock(), "{text}");
}
