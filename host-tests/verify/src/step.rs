//! Running one step and counting what came of it.
//!
//! Each command's output goes to this program's, and [`Tally`] keeps count and time.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// Steps and tests so far, and the time that they took.
#[derive(Debug, Default)]
pub struct Tally {
    /// That did what they should.
    passed: u64,
    /// That did not.
    failed: u64,
    /// Headings with the moments of their beginnings.
    headings: Vec<(&'static str, Instant)>,
    /// Headings of what ran beside others, with its seconds.
    beside: Vec<(&'static str, f64)>,
}

/// A test command under a heading.
pub struct Tests<'a> {
    /// The heading.
    pub heading: &'static str,
    /// What cargo is given.
    pub arguments: Vec<&'a str>,
}

/// What came of a test command.
struct Ran {
    passed: u64,
    failed: u64,
    outcome: Result<(), String>,
}

impl Ran {
    /// Runs `cargo ARGUMENTS`; each line goes to `print`.
    fn of(arguments: &[&str], mut print: impl FnMut(&str)) -> Self {
        let (mut passed, mut failed) = (0, 0);
        let outcome = watch(cargo_command(arguments), |line| {
            print(line);
            if let Some((good, bad)) = test_counts(line) {
                passed += good;
                failed += bad;
            }
        });
        Self {
            passed,
            failed,
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

    /// Prints the time of each heading, then the counts.
    ///
    /// # Returns
    /// How many failed.
    pub fn end(self) -> u64 {
        let now = Instant::now();
        let ends = self.headings.iter().skip(1).map(|(_, begin)| *begin);
        println!("\n== seconds");
        for ((words, begin), end) in self.headings.iter().zip(ends.chain([now])) {
            println!("{:7.1}  {words}", (end - *begin).as_secs_f64());
        }
        for (words, seconds) in &self.beside {
            println!("{seconds:7.1}  beside the tests: {words}");
        }
        if let Some((_, begin)) = self.headings.first() {
            println!("{:7.1}  in all", (now - *begin).as_secs_f64());
        }
        println!("\n{} passed, {} failed", self.passed, self.failed);
        self.failed
    }

    /// Counts one step, and prints why it failed.
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
        let ran = Ran::of(arguments, |line| println!("{line}"));
        self.count(ran);
    }

    /// Runs a long test command, and `others` one after the other beside it: few of them need a whole processor. The output of
    /// these comes behind the first's.
    pub fn tests_beside(&mut self, arguments: &[&str], others: &[Tests]) {
        let (ran, beside) = std::thread::scope(|scope| {
            let beside = scope.spawn(|| {
                let each = others.iter().map(|tests| {
                    let begin = Instant::now();
                    let mut lines = Vec::new();
                    let ran = Ran::of(&tests.arguments, |line| lines.push(line.to_owned()));
                    (ran, lines, begin.elapsed().as_secs_f64())
                });
                each.collect::<Vec<_>>()
            });
            let ran = Ran::of(arguments, |line| println!("{line}"));
            (ran, beside.join())
        });
        self.count(ran);
        let Ok(beside) = beside else {
            return self.step(Err("what ran beside the tests panicked".to_owned()));
        };
        for (tests, (ran, lines, seconds)) in others.iter().zip(beside) {
            println!("\n== {}", tests.heading);
            lines.iter().for_each(|line| println!("{line}"));
            self.count(ran);
            self.beside.push((tests.heading, seconds));
        }
    }

    /// Counts the tests of a command. One that fails without a failed test (it does not compile, or a test ended the process)
    /// counts as one failure.
    fn count(&mut self, ran: Ran) {
        self.passed += ran.passed;
        self.failed += ran.failed;
        match ran.outcome {
            Ok(()) if ran.passed + ran.failed == 0 => self.step(Err("no test ran".to_owned())),
            Err(reason) if ran.failed == 0 => self.step(Err(reason)),
            _ => {}
        }
    }
}

/// The workspace.
pub fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).unwrap_or(package)
}

/// Names the folder with recordings that others made.
const RECORDINGS: &str = "RLG_RECORDINGS";

/// That folder from the file system's root, since cargo runs tests in another folder than this program;
/// as given where it does not exist, for the steps to say so.
pub fn recordings() -> Option<PathBuf> {
    std::env::var_os(RECORDINGS).map(|given| whole(Path::new(&given)))
}

fn whole(given: &Path) -> PathBuf {
    given.canonicalize().unwrap_or_else(|_| given.to_path_buf())
}

/// The folder of the Python environment that the set-up makes.
pub fn environment() -> PathBuf {
    root().join("target").join("verify-tools")
}

/// A program of that environment.
pub fn environment_program(name: &str) -> PathBuf {
    environment().join("bin").join(name)
}

/// Runs cargo in the workspace.
pub fn cargo(arguments: &[&str]) -> Result<(), String> {
    run(cargo_command(arguments))
}

/// The cargo that runs this program, in the workspace.
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

/// Runs a command and shows each of its lines to `look`.
fn watch(mut command: Command, mut look: impl FnMut(&str)) -> Result<(), String> {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    let output = child.stdout.take().expect("the output is piped");
    for line in BufReader::new(output).split(b'\n') {
        let line = line.map_err(|error| format!("{command:?}: {error}"))?;
        let line = String::from_utf8_lossy(&line);
        look(&line);
    }
    let status = child
        .wait()
        .map_err(|error| format!("{command:?}: {error}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{command:?}: {status}"))
    }
}

/// Passed and failed in a line such as `test result: ok. 12 passed; 0 failed; 1 ignored; ...`.
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
    use super::{Path, test_counts, whole};

    #[test]
    fn a_relative_folder_reaches_the_steps_from_the_root() {
        assert!(whole(Path::new("src")).is_absolute());
        assert_eq!(whole(Path::new("not/there")), Path::new("not/there"));
    }

    #[test]
    fn the_summary_of_a_test_run_is_read() {
        let line =
            "test result: FAILED. 12 passed; 3 failed; 1 ignored; 0 measured; 0 filtered out";
        assert_eq!(test_counts(line), Some((12, 3)));
        assert_eq!(test_counts("test a_name ... ok"), None);
    }
}
