//! `rlg completions` and `rlg man`: completions for a shell, and pages for a packager, of the command line.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::error::InputError;
use crate::output::OutputFolder;
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

/// Print a manual page, or write all of them
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rlg man diagnose > rlg-diagnose.1\n  rlg man --out ~/.local/share/man/man1"
)]
pub struct Man {
    /// Sub-command to describe [default: rlg itself]
    command: Option<String>,

    /// Folder for the pages of rlg and of each of its commands
    #[arg(long, value_name = "FOLDER", conflicts_with = "command")]
    out: Option<PathBuf>,
}

impl Man {
    /// Writes the page of `line`, or of one of its sub-commands, to standard output; with `out` every page to its folder.
    pub fn run(&self, mut line: Command) -> Result<(), InputError> {
        line.build();
        if let Some(folder) = &self.out {
            let mut out = OutputFolder::create(folder)?;
            write_pages(&line, &mut out)?;
            return out.commit();
        }
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
        print(&page(&clap_mangen::Man::new(wanted)))
    }
}

/// Adds the page of a command and those of its sub-commands.
fn write_pages(line: &Command, out: &mut OutputFolder) -> Result<(), InputError> {
    let man = clap_mangen::Man::new(line.clone());
    out.write(man.get_filename(), &page(&man))?;
    let mut others = line
        .get_subcommands()
        .filter(|one| one.get_name() != "help");
    others.try_for_each(|one| write_pages(one, out))
}

fn page(man: &clap_mangen::Man) -> Vec<u8> {
    let mut page = Vec::new();
    // Writing to memory cannot fail, so the result is dropped.
    let _ = man.render(&mut page);
    page
}

fn print(text: &[u8]) -> Result<(), InputError> {
    let text = String::from_utf8_lossy(text);
    to_standard_output(&text.trim_end())
        .map_err(|error| InputError::new("standard output", format!("cannot be written ({error})")))
}
