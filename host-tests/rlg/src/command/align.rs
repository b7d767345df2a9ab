//! `rlg align`: estimates the alignment of two instruments, and searches for no physics.

use std::path::{Path, PathBuf};

use clap::Args;
use rlg_attitude::serves as is_slow;
use rlg_diagnosis::rows::channel_correction;
use rlg_diagnosis::{Outcome, Unfit};
use rlg_findings::result::{Diagnosis, EffectEntry, FitEntry, RegistrationEntry};
use rlg_flow::Aligned;
use rlg_signal::qualify;
use serde::Serialize;

use super::diagnose::{rows, work};
use super::inputs::{check_plausible, given_or_ideal, results_folder};
use super::steps::Steps;
use crate::error::InputError;
use crate::json;
use crate::model::{DeclaredModel, Model, MotionSource};
use crate::output::OutputFolder;
use crate::recording::{Quantity, Recording};
use crate::report::terminal::alignment;
use crate::terminal::Terminal;

/// File of the numbers.
const REGISTRATION: &str = "registration.json";

/// Model with the supported alignment switched on.
const MODEL: &str = "model.toml";

/// Align gyros with a second instrument, and search for no physics
///
/// Prints how the gyros stand to a reference of attitude or of rate: time offset, clock rate, rotation, bias, scale,
/// non-orthogonality and bandwidths, each value with its standard deviation and whether the recording supports it. The
/// likelihood is that of rlg diagnose. With --out it writes OUT/registration.json (every number) and OUT/model.toml (the
/// model with what is supported switched on).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg align recordings/stick -o out/stick\n\nExit code 0: done, whatever is supported; 2: an input that cannot be used, as a recording of one instrument alone."
)]
pub struct Align {
    /// Folder with recording.toml
    recording: PathBuf,
    /// The model: what is known of the two instruments already [default: an ideal unit]
    #[arg(short, long)]
    model: Option<PathBuf>,
    /// Folder for the results [default: none is written]
    #[arg(short, long)]
    out: Option<PathBuf>,
    /// Put channels right that are reversed, exchanged or of another unit than the reference, and report it, instead of
    /// refusing the recording
    #[arg(long)]
    anyway: bool,
}

/// `registration.json`.
#[derive(Debug, Serialize)]
struct Registration<'a> {
    format: u32,
    recording: &'a str,
    version: &'a str,
    /// Every group of numbers, supported or not.
    registration: &'a [RegistrationEntry],
    /// Supported groups, fitted without the others, with their covariance and the groups not distinguishable from them; and
    /// faults of the data.
    effects: &'a [EffectEntry],
    /// Fit before and after, on rows not fitted.
    fit: &'a FitEntry,
    /// Quantities not observable on these channels, with the reason.
    not_excluded: Vec<&'a String>,
}

impl<'a> Registration<'a> {
    fn of(diagnosis: &'a Diagnosis) -> Self {
        let is_own = |said: &&String| {
            let kind = said.split(':').next().unwrap_or_default();
            rlg_diagnosis::registration::KINDS.contains(&kind)
        };
        Self {
            format: 1,
            recording: &diagnosis.recording,
            version: &diagnosis.version,
            registration: &diagnosis.registration,
            effects: &diagnosis.effects,
            fit: &diagnosis.fit,
            not_excluded: diagnosis.not_excluded.iter().filter(is_own).collect(),
        }
    }
}

impl Align {
    /// Aligns, prints the alignment, and writes the results.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        has_two_instruments(&self.recording)?;
        let (mut model, model_file, assumed) =
            given_or_ideal(self.model.as_deref(), &self.recording, terminal)?;
        if model.motion == MotionSource::Static {
            return Err(InputError::new(
                &model_file,
                "says that the unit is at rest: nothing to align with",
            )
            .channel("motion.source")
            .expected("\"reference\", where the recording has one"));
        }
        let out = match &self.out {
            Some(out) => Some(results_folder(
                out,
                &self.recording,
                &model_file,
                &[REGISTRATION, MODEL],
            )?),
            None => None,
        };
        // Errors of the accelerometers are not estimated; they stay in the written model.
        let accelerometer = model.accelerometer.take();
        let spinner = terminal.spinner("reading");
        let steps = Steps::new(terminal, &spinner);
        let mut outcome =
            self.outcome(DeclaredModel::new(&model, &model_file), terminal, &steps)?;
        spinner.finish_and_clear();
        outcome.model.accelerometer = accelerometer;
        let registration = Registration::of(&outcome.diagnosis);
        if let Some(out) = out {
            write(&registration, &outcome.model, out)?;
        }
        for line in alignment(&outcome.diagnosis, assumed.as_deref()) {
            terminal.say(line);
        }
        terminal.result(&registration)
    }

    fn outcome(
        &self,
        of: DeclaredModel<'_>,
        terminal: &Terminal,
        steps: &Steps<'_>,
    ) -> Result<Outcome, InputError> {
        let model = of.model;
        let recording = Recording::read(&self.recording)?;
        check_plausible(&self.recording, &recording, model, self.anyway, terminal)?;
        steps.expect(work(&recording, model), rows(&recording));
        let progress: &dyn Fn(&str) = &|stage| steps.show(stage);
        let outcome = match is_slow(&recording, model) {
            true => self.beside_attitudes(&recording, of, progress)?,
            false => self.beside_rates(&recording, of, progress)?,
        };
        outcome.ok_or_else(|| {
            InputError::new(&self.recording, "is too short to align by")
                .expected("two seconds of rows, or two attitudes")
        })
    }

    fn settings(&self) -> rlg_diagnosis::Settings<'static> {
        rlg_diagnosis::Settings {
            anyway: self.anyway,
            ..Default::default()
        }
    }

    fn beside_attitudes(
        &self,
        recording: &Recording,
        of: DeclaredModel<'_>,
        progress: &dyn Fn(&str),
    ) -> Result<Option<Outcome>, InputError> {
        rlg_attitude::align(&self.settings(), recording, of, progress)
    }

    fn beside_rates(
        &self,
        recording: &Recording,
        of: DeclaredModel<'_>,
        progress: &dyn Fn(&str),
    ) -> Result<Option<Outcome>, InputError> {
        let DeclaredModel { model, file } = of;
        progress("aligning the channels");
        let settings = self.settings();
        let Aligned {
            mut streams,
            restored,
        } = rlg_flow::align(&settings, recording, model)?;
        let correction =
            channel_correction::correct_channels(&settings, &mut streams, model, file)?;
        rlg_diagnosis::rows::model_effects::is_predictable(model, file)?;
        let faults =
            qualify::unknown_faults(&mut streams, &model.effects, &settings.plan.signal.faults);
        let outcome = rlg_diagnosis::align(&settings, &mut streams, &faults, of, progress);
        let mut outcome = match outcome {
            Err(Unfit::TooFewRows(_)) => return Ok(None),
            Err(Unfit::Input(error)) => return Err(error),
            Ok(outcome) => outcome,
        };
        if let Some(correction) = correction {
            correction.report(&mut outcome);
        }
        outcome.diagnosis.prepend(restored);
        Ok(Some(outcome))
    }
}

/// Refuses a recording of one instrument.
fn has_two_instruments(recording: &Path) -> Result<(), InputError> {
    let references = [Quantity::ReferenceIncrement, Quantity::ReferenceAttitude];
    let quantities = Recording::quantities(recording)?;
    if references.iter().any(|one| quantities.contains(one)) {
        return Ok(());
    }
    Err(InputError::new(
        recording,
        "has gyros and no reference: nothing to align with",
    )
    .expected("reference_attitude, or reference_rate or reference_increment"))
}

/// Writes all results at once.
fn write(
    registration: &Registration,
    model: &Model,
    mut out: OutputFolder,
) -> Result<(), InputError> {
    let json = json::text(registration, out.target())?;
    out.write(REGISTRATION, json.as_bytes())?;
    out.write(MODEL, model.to_toml().as_bytes())?;
    out.commit()
}
