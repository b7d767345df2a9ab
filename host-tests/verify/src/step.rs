//! Runs one step and counts its results.
//!
//! Each command's output goes to this program's, and [`Tally`] keeps count and time.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Steps and tests so far, and their time.
#[derive(Debug, Default)]
pub struct Tally {
    /// Number passed.
    passed: u64,
    /// Number failed.
    failed: u64,
    /// Headings with their start times.
    headings: Vec<(&'static str, Instant)>,
    /// Headings of steps run in parallel, with their seconds.
    beside: Vec<(&'static str, f64)>,
    /// Test programs with their own seconds.
    programs: Vec<(String, f64)>,
}

/// Number of test programs whose seconds are printed.
const LONGEST: usize = 10;

/// Work that may run in parallel, under a heading.
pub struct Beside {
    heading: &'static str,
    does: Box<dyn FnOnce() -> Came + Send>,
}

/// Result of such work.
enum Came {
    /// Results of steps that print for themselves.
    Steps(Vec<Result<(), String>>),
    /// Result of a test command, with its lines.
    Tests(Ran, Vec<String>),
}

impl Beside {
    /// Creates steps that print for themselves.
    pub fn steps(
        heading: &'static str,
        does: impl FnOnce() -> Vec<Result<(), String>> + Send + 'static,
    ) -> Self {
        Self {
            heading,
            does: Box::new(|| Came::Steps(does())),
        }
    }

    /// Creates `cargo ARGUMENTS`, a test command. Its output is printed after that of the others.
    pub fn tests(heading: &'static str, arguments: &[&str]) -> Self {
        let command = cargo_command(arguments);
        let does = move || {
            let mut lines = Vec::new();
            let ran = Ran::of(command, |line| lines.push(line.to_owned()));
            Came::Tests(ran, lines)
        };
        Self {
            heading,
            does: Box::new(does),
        }
    }
}

/// Result of a test command.
struct Ran {
    passed: u64,
    failed: u64,
    programs: Vec<(String, f64)>,
    outcome: Result<(), String>,
}

impl Ran {
    /// Runs a test command of cargo; each line is passed to `print`.
    fn of(command: Command, mut print: impl FnMut(&str)) -> Self {
        let (mut passed, mut failed) = (0, 0);
        let (mut programs, mut running) = (Vec::new(), None);
        let outcome = watch(command, |line| {
            print(line);
            if let Some(name) = test_program(line) {
                running = Some(name.to_owned());
            }
            if let Some((good, bad)) = test_counts(line) {
                passed += good;
                failed += bad;
                programs.extend(running.take().zip(test_seconds(line)));
            }
        });
        Self {
            passed,
            failed,
            programs,
            outcome,
        }
    }
}

impl Tally {
    /// Begins a step, or several under one heading.
    pub fn heading(&mut self, words: &'static str) {
        println!("\n== {words}");
        self.headings.push((words, Instant::now()));
    }

    /// Prints the time of each heading and of the longest test programs, then the counts.
    ///
    /// # Returns
    /// Number of failures.
    pub fn end(mut self) -> u64 {
        let now = Instant::now();
        let ends = self.headings.iter().skip(1).map(|(_, begin)| *begin);
        println!("\n== seconds");
        for ((words, begin), end) in self.headings.iter().zip(ends.chain([now])) {
            println!("{:7.1}  {words}", (end - *begin).as_secs_f64());
        }
        for (words, seconds) in &self.beside {
            println!("{seconds:7.1}  beside: {words}");
        }
        self.programs
            .sort_by(|(_, one), (_, other)| other.total_cmp(one));
        for (program, seconds) in self.programs.iter().take(LONGEST) {
            println!("{seconds:7.1}  of these: {program}");
        }
        if let Some((_, begin)) = self.headings.first() {
            println!("{:7.1}  in all", (now - *begin).as_secs_f64());
        }
        println!("\n{} passed, {} failed", self.passed, self.failed);
        self.failed
    }

    /// Counts one step, and prints the reason of its failure.
    pub fn step(&mut self, outcome: Result<(), String>) {
        match outcome {
            Ok(()) => self.passed += 1,
            Err(reason) => {
                println!("FAILED: {reason}");
                self.failed += 1;
            }
        }
    }

    /// Runs `cargo ARGUMENTS`, a test command, and counts its tests.
    pub fn tests(&mut self, arguments: &[&str]) {
        let ran = Ran::of(cargo_command(arguments), |line| println!("{line}"));
        self.count(ran);
    }

    /// Runs `long`, and in parallel `others` one after the other: few steps need both processors all the time.
    pub fn beside(&mut self, others: Vec<Beside>, long: impl FnOnce(&mut Self)) {
        let beside = std::thread::scope(|scope| {
            let beside = scope.spawn(|| {
                let each = others.into_iter().map(|Beside { heading, does }| {
                    let begin = Instant::now();
                    let came = does();
                    (heading, came, begin.elapsed().as_secs_f64())
                });
                each.collect::<Vec<_>>()
            });
            long(self);
            beside.join()
        });
        let Ok(beside) = beside else {
            return self.step(Err("what ran beside other steps panicked".to_owned()));
        };
        for (heading, came, seconds) in beside {
            println!("\n== {heading}");
            match came {
                Came::Steps(outcomes) => outcomes.into_iter().for_each(|one| self.step(one)),
                Came::Tests(ran, lines) => {
                    lines.iter().for_each(|line| println!("{line}"));
                    self.count(ran);
                }
            }
            self.beside.push((heading, seconds));
        }
    }

    /// Counts the tests of a command. One that fails without a failed test (it does not compile, or a test ended the process)
    /// counts as one failure.
    fn count(&mut self, ran: Ran) {
        self.passed += ran.passed;
        self.failed += ran.failed;
        self.programs.extend(ran.programs);
        match ran.outcome {
            Ok(()) if ran.passed + ran.failed == 0 => self.step(Err("no test ran".to_owned())),
            Err(reason) if ran.failed == 0 => self.step(Err(reason)),
            _ => {}
        }
    }
}

/// Returns the folder of the workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package)
}

/// Variable with the folder of recordings made by others.
const RECORDINGS: &str = "RLG_RECORDINGS";

/// Returns that folder from the file system's root, since cargo runs tests in another folder than this program; unchanged if
/// it does not exist, for the steps to report it.
pub fn recordings() -> Option<PathBuf> {
    std::env::var_os(RECORDINGS).map(|given| whole(Path::new(&given)))
}

fn whole(given: &Path) -> PathBuf {
    given.canonicalize().unwrap_or_else(|_| given.to_path_buf())
}

/// Returns the folder of the Python environment made by the set-up.
pub fn environment() -> PathBuf {
    root().join("target").join("verify-tools")
}

/// Returns a program of that environment.
pub fn environment_program(name: &str) -> PathBuf {
    environment().join("bin").join(name)
}

/// Runs cargo in the workspace.
pub fn cargo(arguments: &[&str]) -> Result<(), String> {
    run(cargo_command(arguments))
}

/// Prepares the cargo that runs this program, in the workspace.
pub fn cargo_command(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root()).args(arguments);
    command.env("RLG_PYTHON", environment_program("python"));
    if let Some(folder) = recordings() {
        command.env(RECORDINGS, folder);
    }
    command
}

/// Runs a command with this program's output.
pub fn run(mut command: Command) -> Result<(), String> {
    let status = command
        .status()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{command:?}: {status}"))
    }
}

/// Runs a command and passes each of its lines, of either stream, to `look`.
fn watch(mut command: Command, mut look: impl FnMut(&str)) -> Result<(), String> {
    let failed =
        |words: &str, error: std::io::Error| format!("{words} cannot be started ({error})");
    let words = format!("{command:?}");
    let (output, input) = std::io::pipe().map_err(|error| failed(&words, error))?;
    let other = input.try_clone().map_err(|error| failed(&words, error))?;
    command.stdout(input).stderr(other);
    let mut child = command.spawn().map_err(|error| failed(&words, error))?;
    // It holds ends of the pipe, which would never close.
    drop(command);
    for line in BufReader::new(output).split(b'\n') {
        let line = line.map_err(|error| format!("{words}: {error}"))?;
        look(&String::from_utf8_lossy(&line));
    }
    let status = child.wait().map_err(|error| format!("{words}: {error}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{words}: {status}"))
    }
}

/// Returns the test program of a line such as `     Running tests/diagnose/main.rs
/// (target/release/deps/diagnose-0123456789abcdef)`.
fn test_program(line: &str) -> Option<&str> {
    let line = line.trim_start();
    if line.starts_with("Doc-tests ") {
        return Some(line);
    }
    let (_, path) = line.strip_prefix("Running ")?.split_once(" (")?;
    let file = Path::new(path.strip_suffix(')')?).file_stem()?.to_str()?;
    Some(file.rsplit_once('-').map_or(file, |(name, _)| name))
}

/// Returns the seconds in the line of [`test_counts`].
fn test_seconds(line: &str) -> Option<f64> {
    let (_, seconds) = line.split_once("finished in ")?;
    seconds.trim().strip_suffix('s')?.parse().ok()
}

/// Returns passed and failed in a line such as `test result: ok. 12 passed; 0 failed; 1 ignored; ...`.
fn test_counts(line: &str) -> Option<(u64, u64)> {
    let (_, counts) = line.strip_prefix("test result: ")?.split_once(". ")?;
    let count = |word: &str| {
        counts
            .split("; ")
            .find_map(|part| part.strip_suffix(word)?.trim().parse().ok())
    };
    Some((count("passed")?, count("failed")?))
}

#[cfg(test)]
mod tests {
    use super::{Beside, Path, Tally, test_counts, test_program, test_seconds, watch, whole};
    use std::process::Command;

    #[test]
    fn a_relative_folder_reaches_the_steps_from_the_root() {
        assert!(whole(Path::new("src")).is_absolute());
        assert_eq!(whole(Path::new("not/there")), Path::new("not/there"));
    }

    #[test]
    fn the_summary_of_a_test_run_is_read() {
        let line = "test result: FAILED. 12 passed; 3 failed; 1 ignored; 0 measured; 0 filtered out; \
            finished in 12.25s";
        assert_eq!(test_counts(line), Some((12, 3)));
        assert_eq!(test_seconds(line), Some(12.25));
        assert_eq!(test_counts("test a_name ... ok"), None);
    }

    #[test]
    fn the_name_of_a_test_program_is_read() {
        for (line, name) in [
            (
                "     Running tests/a_b/main.rs (target/release/deps/a_b-b266b321012fd9a2)",
                Some("a_b"),
            ),
            (
                "     Running unittests src/main.rs (/t/deps/verify-6f83e5fd07b49a2b)",
                Some("verify"),
            ),
            ("   Doc-tests trueaxis", Some("Doc-tests trueaxis")),
            ("   Compiling verify v0.1.0 (/a/b)", None),
        ] {
            assert_eq!(test_program(line), name, "{line}");
        }
    }

    #[test]
    fn lines_of_both_streams_come_in_their_order_and_a_failure_is_told() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo one; echo two >&2; echo three; exit 3"]);
        let mut lines = Vec::new();
        let outcome = watch(command, |line| lines.push(line.to_owned()));
        assert_eq!(lines, ["one", "two", "three"]);
        assert!(outcome.is_err_and(|problem| problem.contains('3')));
    }

    #[test]
    fn steps_side_by_side_are_all_counted() {
        let (told, heard) = std::sync::mpsc::channel();
        let waits = move || vec![heard.recv().map_err(|_| "alone".to_owned())];
        let fails = || vec![Ok(()), Err("as it should".to_owned())];
        let others = vec![Beside::steps("waits", waits), Beside::steps("fails", fails)];
        let mut tally = Tally::default();
        tally.beside(others, |tally| {
            tally.heading("long");
            // The other step ends only if it runs in parallel.
            tally.step(told.send(()).map_err(|error| error.to_string()));
        });
        assert_eq!(tally.beside.len(), 2);
        assert_eq!((tally.passed, tally.end()), (3, 1));
    }
}
