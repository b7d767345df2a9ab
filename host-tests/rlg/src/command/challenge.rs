//! `rlg challenge`: blind diagnoses of concealed effects and of null trials, and their scores.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use super::challenge_marks::{Common, MarksOptions};
use super::golden::{GoldenArguments, Trials};
use crate::challenge::answer::Answer;
use crate::challenge::commit::{ANSWERS, COMMITMENTS, OUTCOMES, check, commitments};
use crate::challenge::examine::Outcome;
use crate::challenge::given::{MODEL, Pair};
use crate::challenge::score::{Scores, score};
use crate::challenge::trial::{Family, MIX};
use crate::challenge::{Plan, Share, lines_of, prepare};
use crate::error::InputError;
use crate::json;
use crate::output::OutputFolder;
use crate::recording::Recording;
use crate::report::challenge::page;
use crate::terminal::Terminal;

/// File of the scores.
const SCORES: &str = "challenge.json";

/// File of the page.
const PAGE: &str = "report.html";

/// Folder of a single trial's recording.
const RECORDING: &str = "recording";

/// Conceal effects drawn from a seed, diagnose the recordings blind, and score the findings
///
/// Draws trials (effect-free records of every noise family, effects of the catalogue alone and in pairs, confounded,
/// outside the catalogue, columns of no meaning), commits to the answers (OUT/commitments.txt, SHA-256) before
/// anything is diagnosed, and writes the answers (answers.jsonl), the findings (outcomes.jsonl), the scores
/// against the marks (challenge.json) and one page (report.html).
///
/// The same seed gives the same bytes for any number of threads. A campaign may be split: --shard 0/4 ... 3/4 in any
/// order or on several machines, then --merge with the four folders.
///
/// With --golden it scores nothing: it writes what the diagnosis says of the trials and of the shared recordings as a
/// table, a row each (verdict, kinds, expressions, values ± σ, log evidence, p, SHA-256 of diagnosis.json without its
/// version). With --compare it makes each row again and prints every field that differs.
#[derive(Debug, Args)]
#[command(
    name = "challenge",
    after_help = "Examples:\n  rlg challenge --out out/challenge --trials 200\n  rlg challenge --out out/one --trials 200 --trial 17\n  rlg challenge --out out/s3 --trials 2000 --shard 3/8\n  rlg challenge --out out/all --merge out/s0 out/s1 out/s2\n  rlg challenge --check out/all\n  rlg challenge --recording R/bench-17 --truth truth/bench-17.json --out out/bench-17\n  rlg challenge --marks --trials 600 --family null drift --out out/nulls\n  rlg challenge --marks --family attitude --trials 340 --out out/attitudes\n  rlg challenge --marks --family rest --planted none,line --trials 50 --out out/rest\n  rlg challenge --marks --family force --planted none --trials 200 --out out/force\n  rlg challenge --marks --family recorded --recording R/stick --planted none --trials 200 --out out/nulls\n  rlg challenge --marks --trial 17 --keep out/kept --out out/one\n  rlg challenge --marks --vary judgement.naming --trials 200 --seed 7 --out out/curve\n  rlg challenge --golden golden.tsv --trials 100 --recordings R\n  rlg challenge --golden golden.tsv --trials 100 --rows 0..40\n  rlg challenge --golden golden.tsv --compare --rows 0..20"
)]
pub struct ChallengeCommand {
    /// Folder for the results
    #[arg(long, required_unless_present_any = ["check", "golden"])]
    out: Option<PathBuf>,
    /// Trials in all, over all shards
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    trials: u64,
    /// Families of trials, each in turn [default: all, as often as the marks need them]
    #[arg(long, value_enum, value_delimiter = ',')]
    families: Vec<Family>,
    /// Seed of every random draw
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Run only trials whose number leaves remainder I by N
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(u64, u64)>,
    /// Run one trial of the same challenge alone, and keep its recording and model in OUT/recording
    #[arg(long, conflicts_with = "shard")]
    trial: Option<u64>,
    /// Remove the concealed kind from the diagnosis' catalogue: it must never name another one
    #[arg(long)]
    leave_one_out: bool,
    /// Merge folders of shards instead of running anything
    #[arg(long, num_args = 1.., value_name = "DIR", conflicts_with_all = ["shard", "trial", "families"])]
    merge: Vec<PathBuf>,
    /// Diagnose this recording instead, with its model.toml beside it and a --truth; may be given several times. With
    /// --marks --family recorded: the recording that trials are made of
    #[arg(long, value_name = "DIR", conflicts_with_all = ["merge", "shard", "families"])]
    recording: Vec<PathBuf>,
    /// Truth file of that recording: committed to before the diagnosis, opened after it; one for each --recording, in
    /// order
    #[arg(long, value_name = "FILE", requires = "recording")]
    truth: Vec<PathBuf>,
    /// Only check a folder's answers against its commitments
    #[arg(long, value_name = "DIR", conflicts_with = "merge")]
    check: Option<PathBuf>,
    /// Threads to use; results are the same for any number [default: all]
    #[arg(long)]
    threads: Option<std::num::NonZeroUsize>,
    #[command(flatten)]
    ordinary: MarksOptions,
    #[command(flatten)]
    golden: GoldenArguments,
}

/// Parses "3/8".
fn shard(text: &str) -> Result<(u64, u64), String> {
    let parsed = text
        .split_once('/')
        .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parsed {
        Some((i, n)) if i < n => Ok((i, n)),
        _ => Err("expected I/N with I below N, such as 3/8".to_owned()),
    }
}

impl ChallengeCommand {
    /// Runs, merges or checks.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        if let Some(folder) = &self.check {
            let count = checked(folder)?;
            terminal.say(format!("{count} answers are those that were committed to"));
            return Ok(());
        }
        if let Some(file) = &self.golden.golden {
            let trials = Trials {
                seed: self.seed,
                count: self.trials,
                share: self.share(),
            };
            return self.on_threads(|| self.golden.run(file, trials, terminal));
        }
        // clap requires it unless --check or --golden is given
        let out = self.out.as_deref().unwrap_or(Path::new(""));
        if !self.recording.is_empty() && !self.ordinary.marks {
            return self.others(out, terminal);
        }
        if self.ordinary.marks {
            let common = Common {
                recording: &self.recording,
                out,
                seed: self.seed,
                trials: self.trials,
                only: self.trial,
            };
            return self.on_threads(|| self.ordinary.run(common, terminal));
        }
        let scores = self.on_threads(|| {
            if self.merge.is_empty() {
                self.challenge(out, terminal)
            } else {
                merge(&self.merge, out)
            }
        })?;
        say(&scores, terminal);
        terminal.say(format!("To read: {}", out.join(PAGE).display()));
        terminal.result(&scores)
    }

    /// Returns the trials to run here.
    fn share(&self) -> Share {
        match (self.trial, self.shard) {
            (Some(one), _) => Share::One(one),
            (None, Some((shard, of))) => Share::Shard(shard, of),
            (None, None) => Share::Shard(0, 1),
        }
    }

    /// Runs `work` on the requested number of threads.
    fn on_threads<T: Send>(
        &self,
        work: impl FnOnce() -> Result<T, InputError> + Send,
    ) -> Result<T, InputError> {
        let Some(threads) = self.threads else {
            return work();
        };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build()
            .map_err(|error| InputError::new("--threads", format!("cannot be started ({error})")))?
            .install(work)
    }

    /// Diagnoses recordings of others.
    fn others(&self, out: &Path, terminal: &Terminal) -> Result<(), InputError> {
        if self.trial.is_some() {
            return Err(
                InputError::new("--trial", "goes with no recording that is given")
                    .expected("it without --recording, or --marks --family recorded"),
            );
        }
        if self.recording.len() != self.truth.len() {
            return Err(InputError::new("--truth", "does not match the recordings")
                .value(self.truth.len())
                .expected(format!("{}, one a --recording", self.recording.len())));
        }
        let pairs = self.recording.iter().zip(&self.truth);
        let pairs: Vec<Pair> = pairs
            .map(|(recording, truth)| Pair::new(recording, truth))
            .collect::<Result<_, _>>()?;
        let mut first = OutputFolder::create(out)?;
        let lines: String = pairs
            .iter()
            .map(Pair::commitment)
            .map(|(name, hash)| format!("{name} {hash}\n"))
            .collect();
        first.write(COMMITMENTS, lines.as_bytes())?;
        first.commit()?;
        let bar = terminal.bar(pairs.len() as u64, "diagnosing");
        let mut scores = Vec::new();
        for pair in &pairs {
            scores.push(pair.score(self.leave_one_out)?);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let result = serde_json::json!({
            "format": 1,
            "version": env!("CARGO_PKG_VERSION"),
            "given": scores,
        });
        let mut folder = OutputFolder::create(out)?;
        folder.write(SCORES, format!("{result:#}\n").as_bytes())?;
        folder.commit()?;
        for one in &scores {
            let word = if one.right { "right" } else { "WRONG" };
            let kinds = |kinds: &[String]| {
                if kinds.is_empty() {
                    "nothing".to_owned()
                } else {
                    kinds.join(", ")
                }
            };
            let found: Vec<String> = one.found.iter().map(|one| one.kind.clone()).collect();
            terminal.say(format!(
                "{word} {}: concealed {}, found {} ({})",
                one.recording,
                kinds(&one.concealed),
                kinds(&found),
                one.verdict
            ));
            for known in &one.known {
                terminal.say(format!(
                    "      {} {} = {:.4e} ± {:.1e}, concealed {:.4e}",
                    known.kind, known.combination, known.value, known.std, known.truth
                ));
            }
        }
        terminal.result(&result)
    }

    fn challenge(&self, out: &Path, terminal: &Terminal) -> Result<Scores, InputError> {
        let plan = Plan {
            seed: self.seed,
            trials: self.trials,
            families: if self.families.is_empty() {
                MIX.to_vec()
            } else {
                self.families.clone()
            },
            leave_one_out: self.leave_one_out,
        };
        let share = self.share();
        if let Share::One(one) = share
            && one >= self.trials
        {
            return Err(InputError::new("--trial", "is beyond the challenge")
                .value(one)
                .expected(format!("a number below --trials {}", self.trials)));
        }
        let mut first = OutputFolder::create(out)?;
        let bar = terminal.bar(0, "simulating the catalogue");
        let prepared = prepare(&plan, &share.trials(plan.trials), &|done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        // On disk before the first diagnosis begins.
        first.write(COMMITMENTS, commitments(&prepared.lines).as_bytes())?;
        first.commit()?;
        let bar = terminal.bar(prepared.lines.len() as u64, "diagnosing");
        let begun = std::time::Instant::now();
        let outcomes = prepared.examine(&|| bar.inc(1))?;
        bar.finish_and_clear();
        if let (Share::One(_), Some(recorded)) = (share, prepared.first_recording()) {
            let (recording, model) = recorded?;
            let mut folder = Recording::create_folder(out.join(RECORDING))?;
            recording.write_into(&mut folder)?;
            folder.write(MODEL, model.to_toml().as_bytes())?;
            folder.commit()?;
        }
        let seconds = begun.elapsed().as_secs_f64();
        terminal.say(format!(
            "{} trials in {seconds:.1} s: {:.2} a second",
            outcomes.len(),
            outcomes.len() as f64 / seconds
        ));
        let answers: Vec<String> = prepared.lines.into_iter().map(|(_, line)| line).collect();
        write(out, &plan, &answers, &outcomes, None)
    }
}

/// Writes everything but the commitments, which as a rule are written before.
fn write(
    out: &Path,
    plan: &Plan,
    answers: &[String],
    outcomes: &[String],
    commitments: Option<&str>,
) -> Result<Scores, InputError> {
    let text = |lines: &[String]| {
        lines
            .iter()
            .map(|line| format!("{line}\n"))
            .collect::<String>()
    };
    let [answers, outcomes] = [text(answers), text(outcomes)];
    // Scores are computed from the files on disk, so that a merge of shards is no different.
    let read_answers: Vec<Answer> = lines_of(&answers, &out.join(ANSWERS))?;
    let read_outcomes: Vec<Outcome> = lines_of(&outcomes, &out.join(OUTCOMES))?;
    let scores = score(plan, &read_answers, &read_outcomes);
    let json = json::text(&scores, out)?;
    let mut folder = OutputFolder::create(out)?;
    if let Some(commitments) = commitments {
        folder.write(COMMITMENTS, commitments.as_bytes())?;
    }
    folder.write(ANSWERS, answers.as_bytes())?;
    folder.write(OUTCOMES, outcomes.as_bytes())?;
    folder.write(SCORES, json.as_bytes())?;
    folder.write(PAGE, page(&scores, &json).as_bytes())?;
    folder.commit()?;
    Ok(scores)
}

fn read(file: &Path) -> Result<String, InputError> {
    fs::read_to_string(file).map_err(|error| InputError::unreadable(file, &error))
}

/// Counts the answers of a folder; an error unless all equal their commitments.
fn checked(folder: &Path) -> Result<usize, InputError> {
    check(
        &read(&folder.join(COMMITMENTS))?,
        &read(&folder.join(ANSWERS))?,
        folder,
    )
}

/// Reads the plan of a folder.
fn plan_of(folder: &Path) -> Result<Plan, InputError> {
    let file = folder.join(SCORES);
    let fault = |problem: String| {
        InputError::new(&file, problem).expected("what rlg challenge wrote there")
    };
    let value: serde_json::Value =
        serde_json::from_str(&read(&file)?).map_err(|error| fault(error.to_string()))?;
    serde_json::from_value(value["plan"].clone()).map_err(|error| fault(format!("plan: {error}")))
}

/// A trial of a shard.
struct Part {
    trial: u64,
    committed: String,
    answer: String,
    outcome: String,
}

/// Merges shards, each checked against its commitments.
fn merge(folders: &[PathBuf], out: &Path) -> Result<Scores, InputError> {
    let mut plan: Option<Plan> = None;
    let mut parts: Vec<Part> = Vec::new();
    for folder in folders {
        let its = plan_of(folder)?;
        if plan.as_ref().is_some_and(|plan| *plan != its) {
            return Err(
                InputError::new(folder.join(SCORES), "belongs to another challenge")
                    .channel("plan")
                    .expected("the seed, trials and families of the first folder"),
            );
        }
        plan = Some(its);
        checked(folder)?;
        let [committed, answers, outcomes] =
            [COMMITMENTS, ANSWERS, OUTCOMES].map(|name| read(&folder.join(name)));
        let (committed, answers, outcomes) = (committed?, answers?, outcomes?);
        let read: Vec<Answer> = lines_of(&answers, &folder.join(ANSWERS))?;
        if outcomes.lines().count() != read.len() {
            return Err(
                InputError::new(folder.join(OUTCOMES), "is not as long as the answers")
                    .value(outcomes.lines().count())
                    .expected(read.len().to_string()),
            );
        }
        let lines = committed.lines().zip(answers.lines()).zip(outcomes.lines());
        for (answer, ((committed, line), outcome)) in read.iter().zip(lines) {
            parts.push(Part {
                trial: answer.trial,
                committed: committed.to_owned(),
                answer: line.to_owned(),
                outcome: outcome.to_owned(),
            });
        }
    }
    parts.sort_by_key(|part| part.trial);
    if let Some(twice) = parts.windows(2).find(|pair| pair[0].trial == pair[1].trial) {
        return Err(InputError::new(out, "would contain a trial twice")
            .channel("--merge")
            .value(twice[0].trial)
            .expected("shards of one challenge, each once"));
    }
    let committed: String = parts
        .iter()
        .map(|part| format!("{}\n", part.committed))
        .collect();
    let (answers, outcomes): (Vec<String>, Vec<String>) = parts
        .into_iter()
        .map(|part| (part.answer, part.outcome))
        .unzip();
    let plan = plan.ok_or_else(|| InputError::new(out, "nothing to merge"))?;
    write(out, &plan, &answers, &outcomes, Some(&committed))
}

fn say(scores: &Scores, terminal: &Terminal) {
    terminal.say(format!("{} trials scored", scores.scored));
    for mark in &scores.marks {
        let word = match (mark.met, mark.sure) {
            (Some(true), true) => "met",
            (Some(true), false) => "met?",
            (Some(false), true) => "MISSED",
            (Some(false), false) => "missed?",
            (None, _) => "",
        };
        let measured = mark.measured.map_or("not measured".to_owned(), |measured| {
            format!(
                "{measured:.4} ({:.4} to {:.4})",
                mark.limits[0], mark.limits[1]
            )
        });
        terminal.say(format!(
            "{word:<7} {:<72} {:<14} {measured}, {} trials",
            mark.mark, mark.needed, mark.trials
        ));
    }
    let listed = scores.to_repeat.iter().take(SHOWN);
    for repeat in listed {
        terminal.say(format!(
            "  --trial {:<6} {} ({:?}, ρ {:.1}): {} → {}",
            repeat.trial,
            repeat.setting,
            repeat.family,
            repeat.rho,
            if repeat.concealed.is_empty() {
                "nothing".to_owned()
            } else {
                repeat.concealed.join(" + ")
            },
            repeat.claimed.join(", ")
        ));
    }
    if scores.to_repeat.len() > SHOWN {
        terminal.say(format!(
            "  {} more in {SCORES}: to_repeat",
            scores.to_repeat.len() - SHOWN
        ));
    }
}

/// Largest number of wrong trials listed on the terminal.
const SHOWN: usize = 12;
