//! `rlg completions` and `rlg man`: completions for a shell, and pages for a packager, of the command line.

use clap::{Args, Command};
use clap_complete::Shell;

use crate::error::InputError;
use crate::terminal::to_standard_output;

/// Print the completions of a shell
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg completions bash > ~/.local/share/bash-completion/completions/rlg"
)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    /// Writes the script for `line` to standard output.
    pub fn run(&self, mut line: Command) -> Result<(), InputError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut line, "rlg", &mut script);
        print(&script)
    }
}

/// Print a manual page
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg man diagnose > rlg-diagnose.1")]
pub struct Man {
    /// Sub-command to describe [default: rlg itself]
    command: Option<String>,
}

impl Man {
    /// Writes the page of `line`, or of one of its sub-commands, to standard output.
    pub fn run(&self, mut line: Command) -> Result<(), InputError> {
        line.build();
        let wanted = match &self.command {
            None => line,
            Some(name) => {
                let found = line.find_subcommand(name).cloned();
                found.ok_or_else(|| {
                    InputError::new("rlg", "has no such command")
                        .value(name)
                        .expected("one that rlg --help lists")
                })?
            }
        };
        let mut page = Vec::new();
        // Writing to memory cannot fail, so the result is dropped.
        let _ = clap_mangen::Man::new(wanted).render(&mut page);
        print(&page)
    }
}

fn print(text: &[u8]) -> Result<(), InputError> {
    let text = String::from_utf8_lossy(text);
    to_standard_output(&text.trim_end())
        .map_err(|error| InputError::new("standard output", format!("cannot be written ({error})")))
}
