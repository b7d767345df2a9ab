//! `rlg challenge --marks`: ordinary recordings, and the table of marks.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::challenge::acceptance::curve::{FACTORS, curve};
use crate::challenge::acceptance::groups::Counts;
use crate::challenge::acceptance::read_as::ReadAs;
use crate::challenge::acceptance::record::Declares;
use crate::challenge::acceptance::run::{Cost, Keep, Outcome, Plan, Prepared, prepare};
use crate::challenge::acceptance::table::{Scores, score};
use crate::challenge::acceptance::under_test::UnderTest;
use crate::challenge::commit::{ANSWERS, COMMITMENTS, OUTCOMES, commitments};
use crate::challenge::marks::family::Family;
use crate::challenge::{attitude, force, positions, recorded, rest};
use crate::error::InputError;
use crate::output::OutputFolder;
use crate::terminal::Terminal;

/// File of the scores.
const SCORES: &str = "challenge.json";

/// File of the run times, which differ from run to run.
const COSTS: &str = "costs.json";

/// File of the scores for other values of a number of the plan.
const CURVE: &str = "curve.json";

/// Largest number of failures listed on the terminal.
const SHOWN: usize = 120;

/// Options of `rlg challenge --marks`.
#[derive(Debug, Args)]
pub struct MarksOptions {
    /// Examine ordinary recordings instead: motions × references × rates × lengths × declared noise, and print the
    /// table of marks
    #[arg(long, conflicts_with_all = ["families", "shard", "leave_one_out", "merge", "truth", "check"])]
    pub marks: bool,
    /// Families of the marks, others' trial numbers are passed over; attitude, rest, force and positions have trials of their own,
    /// each diagnosed again with the model that was written; recorded makes its trials of --recording: nulls whose noise is
    /// the recording's own in turned blocks, and effects planted into its gyros [default: rates]
    #[arg(long, value_enum, num_args = 1.., value_delimiter = ',', requires = "marks")]
    family: Vec<Family>,
    /// Of the families attitude, rest, force, positions and recorded only trials that plant this
    #[arg(long, num_args = 1.., value_delimiter = ',', value_name = "NAME", requires = "family")]
    planted: Vec<String>,
    /// Keep every trial's recording, with its model, and its truth beside it
    #[arg(long, value_name = "DIR", requires = "marks")]
    keep: Option<PathBuf>,
    /// Diagnose nothing: the recordings alone, to be kept
    #[arg(long, requires_all = ["marks", "keep"])]
    undiagnosed: bool,
    /// Write the recordings alone, one folder a trial, for others to diagnose; the answers stay in OUT
    #[arg(long, value_name = "DIR", requires = "marks", conflicts_with_all = ["keep", "vary"])]
    export: Option<PathBuf>,
    /// Score answers that somebody gave to exported trials instead: DIR/TRIAL/diagnosis.json; the other options as at the
    /// export
    #[arg(long, value_name = "DIR", requires = "marks", conflicts_with_all = ["keep", "vary", "export"])]
    judge: Option<PathBuf>,
    /// Read each recording as one longer than memory, or cut in two recordings of one unit
    #[arg(long, value_enum, default_value_t = ReadAs::Whole, value_name = "HOW", requires = "marks")]
    read_as: ReadAs,
    /// The declared noise of the reference is wrong by at most this factor, either way
    #[arg(long, default_value_t = 1.5, value_name = "FACTOR", requires = "marks")]
    declared_within: f64,
    /// Models say nothing of any noise ("nothing"), or the reference's noise times this factor
    #[arg(long, value_name = "nothing|FACTOR", requires = "marks", conflicts_with = "declared_within",
        value_parser = declares)]
    declares: Option<Declares>,
    /// Rows of a recording at most
    #[arg(long, default_value_t = 240_000, value_name = "N", requires = "marks",
        value_parser = clap::value_parser!(u32).range(2_000..=20_000_000))]
    most_rows: u32,
    /// Diagnose the same trials with this number of the plan (rlg plan prints them; judgement.naming) halved, times 0.7,
    /// as it is, times 1.4 and doubled, and print what each gives
    #[arg(long, value_name = "NUMBER", requires = "marks", conflicts_with = "keep",
        value_parser = number_of_plan)]
    vary: Option<String>,
}

/// Options shared with the challenge's own.
#[derive(Debug, Clone, Copy)]
pub struct Common<'a> {
    /// Recordings from which trials are made.
    pub recording: &'a [PathBuf],
    /// Folder for the results.
    pub out: &'a Path,
    /// Seed of every random draw.
    pub seed: u64,
    /// Number of trials.
    pub trials: u64,
    /// Number of the only trial to run.
    pub only: Option<u64>,
}

impl MarksOptions {
    /// Draws, commits, diagnoses and scores.
    pub fn run(&self, common: Common, terminal: &Terminal) -> Result<(), InputError> {
        let is_alone = |family: &Family| family.is_alone();
        if self.family.len() > 1 && self.family.iter().any(is_alone) {
            return Err(InputError::new(
                "--family",
                "names families whose trials have other numbers",
            )
            .expected("attitude, rest, force, positions or recorded alone, or any of the others"));
        }
        let is_recorded = self.family.contains(&Family::Recorded);
        let recording = match (is_recorded, common.recording) {
            (true, [one]) => Some(one.clone()),
            (false, []) => None,
            (_, given) => {
                return Err(
                    InputError::new("--recording", "does not go with the family")
                        .value(given.len())
                        .expected("one recording with --family recorded, none with others"),
                );
            }
        };
        let names = planted_names();
        if let Some(unknown) = self.planted.iter().find(|name| !names.contains(name)) {
            return Err(InputError::new("--planted", "is nothing that is planted")
                .value(unknown)
                .expected(names.join(", ")));
        }
        // The model of a recording of others also explains effects that were there before.
        let is_twice = self.family.iter().any(is_alone) && !is_recorded;
        let is_undiagnosed = self.undiagnosed || self.export.is_some();
        let under_test = match &self.judge {
            Some(answers) => UnderTest::Answers(answers.clone()),
            None => UnderTest::new(rlg_plan::Plan::default(), is_twice, self.read_as),
        };
        let under_test = (!is_undiagnosed).then_some(&under_test);
        let keep = match (&self.keep, &self.export) {
            (Some(folder), _) => Some((folder, true)),
            (None, Some(folder)) => Some((folder, false)),
            (None, None) => None,
        };
        let keep = keep.map(|(folder, with_truth)| Keep { folder, with_truth });
        if !(1.0..=10.0).contains(&self.declared_within) {
            return Err(
                InputError::new("--declared-within", "is no factor of a noise level")
                    .value(self.declared_within)
                    .expected("1 to 10"),
            );
        }
        let plan = Plan {
            only: common.only,
            declared_within: self.declared_within,
            declares: self.declares.unwrap_or_default(),
            most_rows: f64::from(self.most_rows),
            planted: self.planted.clone(),
            recording,
            ..Plan::new(common.seed, common.trials, &self.family)
        };
        let mut first = OutputFolder::create(common.out)?;
        let count = plan.numbers().len() as u64;
        let bar = terminal.bar(count, "drawing");
        let prepared = prepare(&plan, &|| bar.inc(1))?;
        bar.finish_and_clear();
        // On disk before the first diagnosis begins.
        first.write(COMMITMENTS, commitments(&prepared.lines).as_bytes())?;
        first.commit()?;
        if let Some(number) = &self.vary {
            return vary(number, common.out, (&plan, &prepared), terminal);
        }
        let bar = terminal.bar(count, "diagnosing");
        let before_s = processor_s();
        let told = (plan.seed, plan.declares);
        let done = prepared.diagnose(told, under_test, keep, &|| bar.inc(1))?;
        bar.finish_and_clear();
        let spent_s = before_s
            .zip(processor_s())
            .map(|(before, after)| after - before);
        let (outcomes, costs): (Vec<Outcome>, Vec<Cost>) = done.into_iter().unzip();
        let scores = score(&plan, &prepared.answers, &outcomes);
        write(common.out, &prepared.lines, &outcomes, &costs, &scores)?;
        if under_test.is_some() {
            say(&scores, &costs, spent_s, terminal);
        }
        terminal.result(&scores)
    }
}

/// Returns the names of the effects planted by the families attitude, rest, force, positions and recorded.
fn planted_names() -> Vec<String> {
    let mut names: Vec<String> = attitude::planted::CYCLE.map(|one| one.name()).to_vec();
    names.extend(rest::planted::CYCLE.map(|one| one.name()));
    names.extend(force::planted::CYCLE.map(|one| one.name()));
    names.extend(positions::planted::CYCLE.map(|one| one.name()));
    let recorded = (0..recorded::planted::COUNT).map(recorded::planted::Planted::of);
    names.extend(recorded.map(recorded::planted::Planted::name));
    names.sort();
    names.dedup();
    names
}

/// Parses the declaration of the models.
fn declares(text: &str) -> Result<Declares, String> {
    if text == "nothing" {
        return Ok(Declares::Nothing);
    }
    match text.parse::<f64>() {
        Ok(factor) if (0.01..=100.0).contains(&factor) => Ok(Declares::Times(factor)),
        _ => Err("expected \"nothing\" or a factor from 0.01 to 100".to_owned()),
    }
}

/// Reads the name of a number of the plan.
fn number_of_plan(name: &str) -> Result<String, String> {
    match rlg_plan::Plan::default().number(name) {
        Some(number) => Ok(number.name),
        None => Err("expected a number of the plan, with its section, as rlg plan prints them: judgement.naming".to_owned()),
    }
}

/// Diagnoses all trials with several values of a number of the plan, and prints the scores of each.
fn vary(
    number: &str,
    out: &Path,
    (plan, prepared): (&Plan, &Prepared),
    terminal: &Terminal,
) -> Result<(), InputError> {
    let count = (prepared.trials.len() * FACTORS.len()) as u64;
    let bar = terminal.bar(count, "diagnosing");
    let points = curve(plan, prepared, number, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let result = json!({
        "format": 1,
        "version": env!("CARGO_PKG_VERSION"),
        "plan": plan,
        "number": number,
        "points": points,
    });
    let mut folder = OutputFolder::create(out)?;
    folder.write(CURVE, format!("{result:#}\n").as_bytes())?;
    folder.commit()?;
    let all = |of: &Counts| of.right + of.or_drift + of.missed + of.wrong;
    for point in &points {
        let (nulls, positives) = (&point.nulls, &point.positives);
        terminal.say(format!(
            "{number} × {:<3} = {:<8.3e} false names {:>3} of {:<4} right {:>3}, or drift {:>3}, missed {:>3}, wrong {:>3} of {}",
            point.factor,
            point.value,
            nulls.wrong,
            all(nulls),
            positives.right,
            positives.or_drift,
            positives.missed,
            positives.wrong,
            all(positives),
        ));
    }
    terminal.result(&result)
}

fn write(
    out: &Path,
    answers: &[(u64, String)],
    outcomes: &[Outcome],
    costs: &[Cost],
    scores: &Scores,
) -> Result<(), InputError> {
    let fault = |error: serde_json::Error| InputError::new(out, format!("no JSON form ({error})"));
    let mut folder = OutputFolder::create(out)?;
    let answers: String = answers
        .iter()
        .map(|(_, line)| format!("{line}\n"))
        .collect();
    folder.write(ANSWERS, answers.as_bytes())?;
    let mut lines = String::new();
    for outcome in outcomes {
        lines += &serde_json::to_string(outcome).map_err(fault)?;
        lines.push('\n');
    }
    folder.write(OUTCOMES, lines.as_bytes())?;
    let json = serde_json::to_string_pretty(scores).map_err(fault)?;
    folder.write(SCORES, format!("{json}\n").as_bytes())?;
    let costs = json!({"format": 1, "trials": costs});
    folder.write(COSTS, format!("{costs:#}\n").as_bytes())?;
    folder.commit()
}

fn say(scores: &Scores, costs: &[Cost], spent_s: Option<f64>, terminal: &Terminal) {
    terminal.say(scores.table().trim_end());
    for (name, counts) in &scores.groups {
        terminal.say(format!(
            "  {name:<44} {:>4} right {:>4} or drift {:>4} missed {:>4} wrong {:>4} unanswered",
            counts.right, counts.or_drift, counts.missed, counts.wrong, counts.unanswered
        ));
    }
    for failure in scores.failures.iter().take(SHOWN) {
        let list = |words: &[String]| {
            if words.is_empty() {
                "nothing".to_owned()
            } else {
                words.join(" + ")
            }
        };
        let far: String = failure
            .far
            .iter()
            .map(|pull| format!(", {pull:+.1} σ"))
            .collect();
        terminal.say(format!(
            "  {} {:?} ({}): {} → {}{far}",
            failure.trial,
            failure.score,
            failure.setting,
            list(&failure.concealed),
            list(&failure.claimed)
        ));
    }
    if scores.failures.len() > SHOWN {
        terminal.say(format!(
            "  {} more in {SCORES}: failures",
            scores.failures.len() - SHOWN
        ));
    }
    let elapsed_s: f64 = costs.iter().map(|cost| cost.seconds).sum();
    let longest = costs.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds));
    if let Some(longest) = longest {
        terminal.say(format!(
            "{elapsed_s:.1} s of diagnosis for {} trials, the longest {:.1} s for {} rows (trial {})",
            costs.len(),
            longest.seconds,
            longest.rows,
            longest.trial
        ));
    }
    if let Some(spent_s) = spent_s {
        terminal.say(format!(
            "{:.2} s of processor time a trial, recordings included",
            spent_s / costs.len().max(1) as f64
        ));
    }
    if let Some(peak_mb) = peak_memory_mb() {
        terminal.say(format!("{peak_mb:.0} MB at most, all threads together"));
    }
}

/// Returns the processor time of this process so far \[s\], if the system states it.
fn processor_s() -> Option<f64> {
    /// Linux counts these in hundredths on every architecture.
    const TICKS_PER_S: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name before ") " may hold spaces; utime and stime are fields 12 and 13 after it.
    let (_, fields) = text.rsplit_once(") ")?;
    let ticks: f64 = fields
        .split(' ')
        .skip(11)
        .take(2)
        .filter_map(|field| field.parse::<f64>().ok())
        .sum();
    Some(ticks / TICKS_PER_S)
}

/// Returns the peak resident memory of this process so far \[MB\], if the system states it.
fn peak_memory_mb() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kilobytes / 1024.0)
}
