//! `rlg diagnose --timings`: seconds, columns, transforms and fits of each stage of a diagnosis.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rlg_diagnosis::Work;

/// Stages of one diagnosis, in order.
#[derive(Debug)]
pub(super) struct Timings {
    stages: Mutex<Vec<Stage>>,
}

/// A stage, or a run of stages that differ by a number alone (`pass 1`, `pass 2`).
#[derive(Debug, Clone)]
struct Stage {
    name: String,
    times: usize,
    begun: At,
}

/// A moment of the process.
#[derive(Debug, Clone, Copy)]
struct At {
    moment: Instant,
    usage: Option<Usage>,
    work: Work,
}

/// Resources used by the process.
#[derive(Debug, Clone, Copy)]
struct Usage {
    /// Processor time of all threads \[s\].
    processor_s: f64,
    /// Largest memory so far \[bytes\].
    memory: f64,
}

impl At {
    fn now() -> Self {
        Self {
            moment: Instant::now(),
            usage: usage(),
            work: Work::done(),
        }
    }
}

impl Timings {
    /// Begins with a stage.
    pub(super) fn new(first: &str) -> Self {
        Self {
            stages: Mutex::new(vec![Stage {
                name: first.to_owned(),
                times: 1,
                begun: At::now(),
            }]),
        }
    }

    /// Begins a stage, which ends the one before.
    pub(super) fn begin(&self, stage: &str) {
        // Numbers of passes and of seconds read.
        let name = stage.split(" of ").next().unwrap_or(stage);
        let name = name.trim_end_matches(|one: char| one.is_ascii_digit() || one == ' ');
        let mut stages = self.lock();
        match stages.last_mut() {
            Some(last) if last.name == name => last.times += 1,
            _ => stages.push(Stage {
                name: name.to_owned(),
                times: 1,
                begun: At::now(),
            }),
        }
    }

    /// Lines of the table up to now.
    pub(super) fn lines(&self) -> Vec<String> {
        let stages = self.lock().clone();
        let end = At::now();
        let begins = stages.iter().map(|one| one.begun).chain([end]);
        let begins: Vec<At> = begins.collect();
        let mut lines = vec![format!(
            "{:38} {:>8} {:>9} {:>8} {:>10} {:>8}",
            "Timings", "seconds", "processor", "columns", "transforms", "fits"
        )];
        lines.extend(
            stages
                .iter()
                .zip(begins.windows(2))
                .map(|(stage, between)| {
                    let name = match stage.times {
                        1 => stage.name.clone(),
                        times => format!("{} ({times} times)", stage.name),
                    };
                    line(&name, (between[0], between[1]))
                }),
        );
        lines.push(line("together", (begins[0], end)));
        if let Some(Usage { memory, .. }) = end.usage {
            lines.push(format!("largest memory {:.0} MB", memory / 1e6));
        }
        lines
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Stage>> {
        // Consistent between any two stages, whoever panicked.
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn line(name: &str, (from, to): (At, At)) -> String {
    let seconds = (to.moment - from.moment).as_secs_f64();
    let processor = match (from.usage, to.usage) {
        (Some(from), Some(to)) => format!("{:.2}", to.processor_s - from.processor_s),
        _ => "-".to_owned(),
    };
    let work = to.work.since(from.work);
    format!(
        "{:38} {seconds:8.2} {processor:>9} {:8} {:10} {:8}",
        format!("  {name}"),
        work.columns,
        work.transforms,
        work.evaluations
    )
}

/// Returns the resources used up to now; `None` where the system has no such call.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn usage() -> Option<Usage> {
    let mut used = std::mem::MaybeUninit::<libc::rusage>::uninit();
    // SAFETY: getrusage fills the structure that it is given where it returns 0.
    let used = unsafe {
        if libc::getrusage(libc::RUSAGE_SELF, used.as_mut_ptr()) != 0 {
            return None;
        }
        used.assume_init()
    };
    let seconds = |time: libc::timeval| time.tv_sec as f64 + 1e-6 * time.tv_usec as f64;
    Some(Usage {
        processor_s: seconds(used.ru_utime) + seconds(used.ru_stime),
        memory: 1024.0 * used.ru_maxrss as f64,
    })
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn usage() -> Option<Usage> {
    None
}

#[cfg(test)]
mod tests {
    use super::Timings;

    #[test]
    fn stages_that_differ_by_a_number_are_one_line() {
        let timings = Timings::new("reading");
        for stage in [
            "pass 1",
            "pass 2",
            "reading 10 of 60 s",
            "reading 60 of 60 s",
            "end",
        ] {
            timings.begin(stage);
        }
        let lines = timings.lines();
        let begins = lines[..6].iter().map(|line| line[..24].trim());
        let begins: Vec<&str> = begins.collect();
        let expected = [
            "Timings",
            "reading",
            "pass (2 times)",
            "reading (2 times)",
            "end",
            "together",
        ];
        assert_eq!(begins, expected);
    }
}
