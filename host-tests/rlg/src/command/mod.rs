//! Runs the command `rlg`: one sub-command a file.
//!
//! Exit code 0: the work was done. Exit code 1: it was, and the verdict is one that `--fail-on` names, or a unit's built-in test
//! has failed. Exit code 2: the
//! input cannot be used (one sentence on standard error), or the command line is wrong. Results go to standard output,
//! progress and warnings to standard error. A process that is signalled to end leaves no half-written output.
//!
//! A new sub-command is a file with a struct of arguments and `fn run(&self, terminal: &Terminal)`, a
//! variant of `Command` and its line in `Command::run`.

use std::ffi::OsString;
use std::iter;
use std::process::ExitCode;

use clap::{Args, CommandFactory as _, Parser, Subcommand};

use crate::error::InputError;
use crate::import::files::columns::Column;
use crate::import::mapping::questions::line;
use crate::terminal::Terminal;

mod align;
mod block;
mod calibrate;
mod challenge;
mod challenge_marks;
mod close_loop;
mod companions;
mod demo;
mod diagnose;
mod doctor;
mod export;
mod fail_on;
mod firmware;
mod given;
mod golden;
mod import;
mod import_answers;
mod import_bank;

mod import_columns;
mod import_counts;
mod import_format;
mod import_raw;
mod import_said;
mod inputs;
mod inspect;
mod interrupt;
mod model_new;
mod navigate;
mod on_target;
mod page_beside;
mod paper;
mod params;
mod plan;
mod replay;
mod schema;
mod self_test;
mod simulate;
mod steps;
mod summarize;
mod timings;
mod upload;
mod upload_firmware;

pub use diagnose::Diagnosed;
pub use inputs::ideal;

/// Simulate, replay and diagnose recordings of dithered ring-laser gyros
#[derive(Debug, Parser)]
#[command(name = "rlg", version, max_term_width = 100)]
struct CommandLine {
    #[command(flatten)]
    output: OutputOptions,
    #[command(subcommand)]
    command: Command,
}

/// Options of every sub-command.
#[derive(Debug, Args)]
struct OutputOptions {
    /// Print the result as JSON instead of words
    #[arg(long, global = true)]
    json: bool,
    /// Print no progress and no warnings: nothing on standard error but errors
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Align(align::Align),
    Calibrate(calibrate::Calibrate),
    Challenge(Box<challenge::ChallengeCommand>),
    CloseLoop(close_loop::CloseLoop),
    Completions(companions::Completions),
    Demo(demo::DemoCommand),
    Diagnose(diagnose::Diagnose),
    Doctor(doctor::Doctor),
    Export(export::Export),
    Firmware(firmware::Firmware),
    Import(Box<import::Import>),
    Inspect(inspect::Inspect),
    Man(companions::Man),
    Model(model_new::ModelCommand),
    Navigate(navigate::NavigateCommand),
    OnTarget(on_target::OnTargetCommand),
    Paper(paper::PaperCommand),
    Plan(plan::PlanCommand),
    Replay(replay::ReplayCommand),
    Schema(schema::SchemaCommand),
    SelfTest(self_test::SelfTestCommand),
    Simulate(simulate::Simulate),
    Summarize(summarize::Summarize),
    Params(params::Params),
    Upload(upload::Upload),
}

impl Command {
    fn run(&self, terminal: &Terminal) -> Result<ExitCode, InputError> {
        match self {
            Self::Align(command) => command.run(terminal)?,
            Self::Calibrate(command) => command.run(terminal)?,
            Self::Challenge(command) => command.run(terminal)?,
            Self::CloseLoop(command) => command.run(terminal)?,
            Self::Completions(command) => command.run(CommandLine::command())?,
            Self::Demo(command) => command.run(terminal)?,
            Self::Diagnose(command) => return command.run(terminal),
            Self::Doctor(command) => command.run(terminal)?,
            Self::Export(command) => command.run(terminal)?,
            Self::Firmware(command) => command.run(terminal)?,
            Self::Import(command) => command.run(terminal)?,
            Self::Inspect(command) => command.run(terminal)?,
            Self::Man(command) => command.run(CommandLine::command())?,
            Self::Model(command) => command.run(terminal)?,
            Self::Navigate(command) => command.run(terminal)?,
            Self::OnTarget(command) => command.run(terminal)?,
            Self::Paper(command) => command.run(terminal)?,
            Self::Plan(command) => command.run(terminal)?,
            Self::Replay(command) => command.run(terminal)?,
            Self::Schema(command) => command.run()?,
            Self::SelfTest(command) => return command.run(terminal),
            Self::Simulate(command) => command.run(terminal)?,
            Self::Summarize(command) => command.run(terminal)?,
            Self::Params(command) => command.run(terminal)?,
            Self::Upload(command) => command.run(terminal)?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Exit code of an input that cannot be used; clap ends with the same for a wrong command line.
const UNUSABLE: u8 = 2;

/// Parses the same line of arguments, without the program's name, for a program that runs the command in its own process.
fn parsed(arguments: impl IntoIterator<Item = OsString>) -> Result<Command, InputError> {
    let line = iter::once(OsString::from("rlg")).chain(arguments);
    let parsed = CommandLine::try_parse_from(line).map_err(|error| {
        let text = error.render().to_string();
        let text = text.trim_start_matches("error: ");
        let text = text.split("\n\n").next().unwrap_or(text);
        InputError::new("rlg", "cannot be called so").value(text.trim_end())
    })?;
    Ok(parsed.command)
}

/// Runs `rlg ARGUMENTS` in this process; its output goes to `terminal`.
pub fn run_in_process(
    arguments: impl IntoIterator<Item = OsString>,
    terminal: &Terminal,
) -> Result<(), InputError> {
    parsed(arguments)?.run(terminal).map(drop)
}

/// Runs `rlg import ARGUMENTS` on columns in memory: name and values, as a file would hold them.
pub fn import_in_process(
    columns: Vec<Column>,
    arguments: impl IntoIterator<Item = OsString>,
    terminal: &Terminal,
) -> Result<(), InputError> {
    match parsed(iter::once("import".into()).chain(arguments))? {
        Command::Import(command) => command.run_on(columns, terminal),
        _ => unreachable!("the line begins with import"),
    }
}

/// Runs `rlg diagnose ARGUMENTS` in this process, and writes nothing yet.
pub fn diagnose_in_process(
    arguments: impl IntoIterator<Item = OsString>,
    terminal: &Terminal,
) -> Result<Diagnosed, InputError> {
    match parsed(iter::once("diagnose".into()).chain(arguments))? {
        Command::Diagnose(command) => command.diagnosed(terminal),
        _ => unreachable!("the line begins with diagnose"),
    }
}

/// Command line with `--anyway` appended, to paste.
fn anyway(arguments: impl Iterator<Item = OsString>) -> String {
    let given = arguments
        .skip(1)
        .map(|word| word.to_string_lossy().into_owned());
    let words = iter::once("rlg".to_owned()).chain(given);
    let words: Vec<String> = words.chain(iter::once("--anyway".to_owned())).collect();
    format!("    {}", line(&words))
}

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    let line = CommandLine::parse();
    let terminal = Terminal::new(line.output.json, line.output.quiet);
    interrupt::leave_nothing_behind();
    let done = line.command.run(&terminal);
    match done.and_then(|code| terminal.whole().map(|()| code)) {
        Ok(code) => code,
        Err(error) => {
            terminal.error(&error);
            if error.anyway.is_some() {
                terminal.hint(&anyway(std::env::args_os()));
            }
            ExitCode::from(UNUSABLE)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_that_goes_on_anyway_ends_with_the_command() {
        let given = ["/usr/bin/rlg", "diagnose", "a run", "--quiet"].map(OsString::from);
        assert_eq!(
            anyway(given.into_iter()),
            "    rlg diagnose 'a run' --quiet --anyway"
        );
    }

    #[test]
    fn the_command_line_is_consistent_and_every_sub_command_shows_an_example() {
        let mut line = CommandLine::command();
        line.build();
        line.clone().debug_assert();
        for sub in line
            .get_subcommands_mut()
            .filter(|sub| sub.get_name() != "help")
        {
            let name = sub.get_name().to_owned();
            let help = sub.render_long_help().to_string();
            assert!(
                help.contains(&format!("  rlg {name} ")),
                "{name}: no example in\n{help}"
            );
        }
    }
}
