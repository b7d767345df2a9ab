//! `rlg demo`: the whole sequence in one run, without any input.

use std::path::PathBuf;

use clap::Args;
use console::style;
use indicatif::ProgressBar;
use rlg_findings::sentences::combination;

use super::page_beside::declared;
use crate::demo::{Demo, SegmentDrift, tell};
use crate::error::InputError;
use crate::json;
use crate::output::OutputFolder;
use crate::recording::Recording;
use crate::report::beside::{Beside, rates};
use crate::report::{page_beside, word, words};
use crate::terminal::Terminal;

/// Simulate, diagnose and correct a gyro triad: the whole sequence, without any input
///
/// Simulates a dithered ring-laser triad that cones, with the flexure of its blocks concealed; shows the
/// drift that the chain leaves, finds the cause, puts it into the firmware's parameters and replays.
#[derive(Debug, Args)]
#[command(
    name = "demo",
    after_help = "Example:\n  rlg demo --out out/demo --seed 7"
)]
pub struct DemoCommand {
    /// Folder for the results
    #[arg(short, long, default_value = "out/demo")]
    out: PathBuf,
    /// Seed of the simulation
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of the recording [s]; a shorter one is quicker and shows less
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(20..=600))]
    seconds: u32,
}

impl DemoCommand {
    /// Runs the demonstration and writes its results.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let mut out = OutputFolder::create(&self.out)?;
        let folder = self.out.join("recording");
        let mut stored = Recording::create_folder(&folder)?;
        let model_file = folder.join("model.toml");

        let bar = terminal.bar(0, "simulating");
        // Only one of the two may draw at a time.
        let mut spinner: Option<ProgressBar> = None;
        let demo = tell(
            self.seed,
            f64::from(self.seconds),
            &model_file,
            &mut |stage, share| match share {
                Some((done, all)) => {
                    bar.set_length(all as u64);
                    bar.set_position(done as u64);
                }
                None => {
                    bar.finish_and_clear();
                    spinner
                        .get_or_insert_with(|| terminal.spinner(""))
                        .set_message(stage.to_owned());
                }
            },
        )?;
        let diagnosis = &demo.outcome.diagnosis;
        let json = json::text(diagnosis, &self.out)?;
        out.write("diagnosis.json", json.as_bytes())?;
        let simulation = &demo.simulation;
        let weight_rad = simulation.model.gyro.pulse_weight_rad;
        let beside = Beside {
            declared: declared(&simulation.model),
            rates: rates(&simulation.recording, weight_rad),
            ..Beside::default()
        };
        let report = page_beside(diagnosis, demo.outcome.pictures.as_ref(), &beside);
        out.write("report.html", report.as_bytes())?;
        out.write("model.toml", demo.outcome.model.to_toml().as_bytes())?;
        out.write("params.bin", &demo.parameters.to_block(0))?;
        demo.simulation.recording.write_into(&mut stored)?;
        stored.write("model.toml", demo.simulation.model.to_toml().as_bytes())?;
        out.commit()?;
        stored.commit()?;
        if let Some(spinner) = spinner {
            spinner.finish_and_clear();
        }
        self.say(&demo, terminal);
        terminal.result(&demo.figures)
    }

    fn say(&self, demo: &Demo, terminal: &Terminal) {
        let figures = &demo.figures;
        let step = |number: u8, verb: &str, words: String| {
            let head = format!("{number} {verb:<9}");
            terminal.say(format!("{} {words}", style(head).bold()));
        };
        let largest = figures
            .segments
            .iter()
            .map(|s| s.before_deg_h.abs())
            .fold(0.0, f64::max);
        step(
            1,
            "Simulate",
            format!(
                "{:.0} s of a dithered ring-laser triad coning at 15 Hz; how its blocks bend is concealed",
                figures.seconds
            ),
        );
        step(
            2,
            "Replay",
            format!(
                "the chain knows bias, scale and installation, and drifts by up to {largest:.2} °/h"
            ),
        );
        let diagnosis = &demo.outcome.diagnosis;
        step(
            3,
            "Diagnose",
            format!("{}: {}", word(diagnosis.verdict), listed(&figures.found)),
        );
        for fixed in &figures.fixed {
            let scale = words::Scale::of("", &fixed.unit, fixed.found.value);
            let found = scale.pair(fixed.found.value, fixed.found.std);
            terminal.say(format!(
                "{:12}{} {}   (concealed: {})",
                "",
                combination(&fixed.found.combination),
                scale.with_unit(&found),
                words::number(fixed.concealed * scale.factor)
            ));
        }
        step(
            4,
            "Correct",
            "the same counts through the firmware's chain, with what was found in its parameters"
                .to_owned(),
        );
        terminal.say(format!(
            "{:12}{:<12} {:<6}{:>14} {:>10} {:>10} {:>9}",
            "", "drift [°/h]", "gyro", "Eq. (7) alone", "f32", "fixed", "± noise"
        ));
        for SegmentDrift {
            segment,
            axis,
            before_deg_h,
            after_deg_h,
            noise_deg_h,
        } in &figures.segments
        {
            terminal.say(format!(
                "{:12}{segment:<12} {axis:<6}{before_deg_h:>14.4} {:>10.4} {:>10.4} {noise_deg_h:>9.4}",
                "", after_deg_h.f32, after_deg_h.fixed
            ));
        }
        for kind in &figures.uncompensated {
            terminal.warn(format!(
                "the chain has no term for {kind}: it stays in the output"
            ));
        }
        let against = figures.against_reference_deg_h;
        terminal.say(format!(
            "{:12}{:.0} times less; f32 within {:.1e} °/h and fixed within {:.1e} °/h of the f64 reference",
            "", figures.times_less, against.f32, against.fixed
        ));
        step(
            5,
            "Read",
            format!("{}", self.out.join("report.html").display()),
        );
        for (file, words) in [
            ("diagnosis.json", "every number"),
            ("params.bin", "the block to flash"),
            (
                "recording",
                "what was simulated, with its model: try rlg diagnose on it",
            ),
        ] {
            terminal.say(format!(
                "{:12}{}  {words}",
                "",
                self.out.join(file).display()
            ));
        }
    }
}

fn listed(kinds: &[String]) -> String {
    if kinds.is_empty() {
        "nothing was left out".to_owned()
    } else {
        let words: Vec<String> = kinds.iter().map(|kind| words::plain(kind)).collect();
        words.join(", ")
    }
}
