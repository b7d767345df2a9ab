//! `rlg import` of files with columns: CSV, MATLAB, HDF5, Parquet.

use std::fs;
use std::path::Path;

use clap::{Args, ValueEnum as _};
use serde_json::json;
use sha2::{Digest as _, Sha256};

use super::import_answers::{self, Answer};
use super::import_format::Format;
use super::import_said::{Request, result, say};
use super::inputs::check_plausible;
use crate::diagnose::stands_in_positions;
use crate::error::InputError;
use crate::import::files::columns::{Block, Column, Dates, blocks};
use crate::import::files::date_times::{is_rfc3339, rfc3339};
use crate::import::files::{beside, fill_values, hdf5_file, mat_file, split_stamps, text_table};
use crate::import::forming::assemble::{Assembled, Values, assemble};
use crate::import::forming::attitudes::EulerOrder;
use crate::import::forming::clocks::{Said, TimeOption, check_times};
use crate::import::forming::described;
use crate::import::forming::settle::Settled;
use crate::import::known;
use crate::import::mapping::own_rows;
use crate::import::mapping::questions;
use crate::import::mapping::time_names::{time_in, time_unit};
use crate::model::{Model, MotionSource};
use crate::output::OutputFolder;
use crate::plausibility::{self, Bounds};
use crate::recording::{ForeignColumn, Head, Quantity, Recording, parquet_columns};
use crate::terminal::Terminal;

/// What the columns of a file are, where their names do not say it.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct ColumnOptions {
    /// What a column is: gx=gyro_rate:x:deg/s; AXIS may be several letters for a matrix (quat=reference_attitude:xyzw);
    /// the quantity none leaves a column out
    #[arg(long, value_name = "COLUMN=QUANTITY:AXIS:UNIT", num_args = 1..)]
    map: Vec<String>,
    /// The unit of all columns of a quantity: gyro_rate:deg/s
    #[arg(long, value_name = "QUANTITY:UNIT", num_args = 1..)]
    unit: Vec<String>,
    /// The column of stamps and its unit: t:ms; with a quantity (t_ref:s:reference_attitude) for that quantity alone; none
    /// where stamps are not to be used
    #[arg(long, value_name = "COLUMN:UNIT", num_args = 1..)]
    time: Vec<String>,
    /// Order of the rotations of Euler angles: zyx is yaw, pitch, roll
    #[arg(long, value_name = "AXES")]
    euler: Option<String>,
    /// How rates and forces were sampled: mean over the row, or instant, the value at its end, as a logger has it that asks a
    /// sensor; with a quantity (gyro_rate:instant) for that quantity alone [default: mean]
    #[arg(long, value_name = "mean|instant", num_args = 1..)]
    sampling: Vec<String>,
    /// Name of the instrument, for recording.toml and rlg summarize
    #[arg(long, value_name = "NAME")]
    instrument: Option<String>,
    /// Date, time and zone of the recording's time 0: 2026-03-01T12:00:00Z [default: by the file's own date-times]
    #[arg(long, value_name = "DATE-TIME")]
    start: Option<String>,
    /// Take what cannot be plausible as it is, with a warning
    #[arg(long)]
    anyway: bool,
    /// Take the guesses of all questions
    #[arg(long)]
    yes: bool,
}

impl ColumnOptions {
    /// True if no option is given.
    pub(super) fn is_empty(&self) -> bool {
        let lists = [&self.map, &self.unit, &self.time, &self.sampling];
        let texts = [&self.euler, &self.instrument, &self.start];
        let is_said = lists.iter().any(|list| !list.is_empty());
        !is_said && !self.anyway && !self.yes && texts.iter().all(|text| text.is_none())
    }

    /// Reads the files, or takes columns in memory, and writes the recording.
    pub(super) fn run(
        &self,
        request: &Request<'_>,
        in_memory: Option<Vec<Column>>,
        mut out: OutputFolder,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let first = &request.files[0];
        let (mut blocks, sums) = all_blocks(request, in_memory)?;
        blocks.retain(|block| block.rows > 1);
        blocks.iter_mut().for_each(split_stamps::join);
        blocks.iter_mut().for_each(fill_values::take_out);
        if blocks.is_empty() {
            return Err(InputError::new(first, "holds no column of numbers")
                .expected("columns of equal length, a row a sample"));
        }
        let said = self.said(first, request.rate_hz)?;
        let mut labels = self.labels(first)?;
        labels.instants.clone_from(&said.instants);
        let times: Vec<String> = said
            .times
            .iter()
            .map(|option| option.column.clone())
            .collect();
        check_times(&blocks, &said)?;
        let has_stamps = |block: &Block| {
            let mut columns = block.columns.iter();
            let is_stamps = |column: &Column| {
                let is_number =
                    column.bad_cell.is_none() && column.values.iter().any(|value| !value.is_nan());
                column.dates.is_some()
                    || times.contains(&column.name)
                    || (is_number && time_in(block, column).is_some())
            };
            columns.any(is_stamps)
        };
        let mut blocks = beside::join(blocks, has_stamps);
        let mut settled = Settled {
            maps: self.map.clone(),
            units: self.unit.clone(),
            times,
            said,
            notes: Vec::new(),
            questions: Vec::new(),
        };
        let mut plan = settled.settle(&mut blocks)?;
        if let Some(answers) = self.answer(request, &settled, terminal)? {
            // Read again: the answers may leave other questions open.
            drop((blocks, plan, settled));
            let (options, rate_hz) = self.answered(first, answers, request.rate_hz)?;
            let request = Request {
                rate_hz,
                ..*request
            };
            options.run(&request, None, out, terminal)?;
            let command = questions::line(&options.command(&request));
            terminal.note(format!("The same without questions: {command}"));
            return Ok(());
        }
        let said = settled.said;
        own_rows::separate(&mut blocks, &mut plan, said.rate_hz);
        let mut assembled = assemble(&mut blocks, &plan, &said, Values::Moved)?;
        for (column, reason) in &mut plan.left_out {
            if time_unit(column).is_some() {
                *reason = "a time that is not used".to_owned();
            }
        }
        plan.left_out
            .retain(|(column, _)| !assembled.stamps.contains(column));
        let notes = blocks.iter().flat_map(|block| block.notes.iter().cloned());
        assembled.notes.splice(0..0, notes.chain(settled.notes));
        if let (None, Some(origin)) = (&labels.start, assembled.origin) {
            labels.start = rfc3339(origin.since_1970_s);
            if !origin.has_zone {
                let note = "the date-times state no zone and are read as UTC; --start says when time 0 was";
                assembled.notes.push(note.to_owned());
            }
        }
        drop(blocks);
        let recording = described::recording(first, request.site, &mut assembled);
        recording.check_values(first)?;
        self.check(first, &recording, &mut assembled, terminal)?;
        described::write(
            request.files,
            &recording,
            &assembled,
            &plan.left_out,
            &labels,
            &mut out,
        )?;
        out.commit()?;
        say(request, (&recording, &assembled), &plan.left_out, terminal);
        let mut result = result(request, (&recording, &assembled), &plan.left_out, &sums);
        result["instrument"] = json!(labels.instrument);
        result["start"] = json!(labels.start);
        terminal.result(&result)
    }

    /// Refuses what cannot be plausible, and notes a motion that no reference shows.
    fn check(
        &self,
        file: &Path,
        recording: &Recording,
        assembled: &mut Assembled,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let ideal = described::ideal(recording, assembled);
        let moving = Model {
            motion: MotionSource::Reference,
            ..ideal.clone()
        };
        check_plausible(file, recording, &moving, self.anyway, terminal)?;
        let bounds = Bounds::default();
        let is_sound = plausibility::check(file, recording, &moving, &bounds).is_ok();
        if ideal.motion == MotionSource::Static && is_sound {
            // A moving unit without a reference may serve another purpose than a diagnosis.
            match plausibility::is_unreferenced_motion(recording, &ideal, &bounds) {
                true => assembled.notes.push(unreferenced(recording)),
                false => check_plausible(file, recording, &ideal, true, terminal)?,
            }
        }
        Ok(())
    }

    /// Asks all questions, on a terminal one by one, elsewhere in one message; or warns of the guesses that `--yes` takes.
    ///
    /// # Returns
    /// Answers that are to be added to the options.
    fn answer(
        &self,
        request: &Request<'_>,
        settled: &Settled,
        terminal: &Terminal,
    ) -> Result<Option<Vec<Answer>>, InputError> {
        let questions = &settled.questions;
        let is_answered = self.yes && questions.iter().all(|question| question.is_guess);
        if questions.is_empty() {
            return Ok(None);
        }
        let file = &request.files[0];
        if !is_answered {
            return match terminal.to_ask_on() {
                Some(term) if !self.yes => import_answers::ask(&term, file, questions).map(Some),
                _ => Err(questions::ask(file, questions, &self.command(request))),
            };
        }
        for question in questions {
            terminal.warn(format!(
                "{}: {} is a guess that --yes takes: {}",
                question.asks,
                question.guess(),
                question.evidence
            ));
        }
        Ok(None)
    }

    /// Returns the options with answers, and the rate.
    fn answered(
        &self,
        file: &Path,
        answers: Vec<Answer>,
        mut rate_hz: Option<f64>,
    ) -> Result<(Self, Option<f64>), InputError> {
        let mut options = self.clone();
        for (option, value) in answers {
            match option {
                "--map" => options.map.push(value),
                "--unit" => options.unit.push(value),
                "--time" => options.time.push(value),
                "--euler" => options.euler = Some(value),
                _ => {
                    let given = value.parse().ok();
                    let given = given.filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
                    rate_hz = Some(given.ok_or_else(|| {
                        InputError::new(file, "cannot be read at this rate")
                            .channel(option)
                            .value(&value)
                            .expected("a positive number of rows a second")
                    })?);
                }
            }
        }
        Ok((options, rate_hz))
    }

    /// Returns the command line so far.
    fn command(&self, request: &Request<'_>) -> Vec<String> {
        let mut words = vec!["rlg".to_owned(), "import".to_owned()];
        let path = |path: &Path| path.display().to_string();
        words.extend(request.files.iter().map(|file| path(file)));
        let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
        if let Some(format) = request.format.and_then(|format| format.to_possible_value()) {
            add("--format", format.get_name().to_owned());
        }
        for (option, values) in [
            ("--map", &self.map),
            ("--unit", &self.unit),
            ("--time", &self.time),
            ("--sampling", &self.sampling),
        ] {
            values.iter().for_each(|value| add(option, value.clone()));
        }
        for (option, value) in [
            ("--euler", &self.euler),
            ("--instrument", &self.instrument),
            ("--start", &self.start),
        ] {
            value.iter().for_each(|value| add(option, value.clone()));
        }
        if let Some(rate_hz) = request.rate_hz {
            add("--rate", rate_hz.to_string());
        }
        if let Some(site) = request.site {
            add("--latitude-deg", site.latitude_rad.to_degrees().to_string());
            add("--gravity", site.gravity_m_s2.to_string());
        }
        if let Some(sum) = request.sha256 {
            add("--sha256", sum.to_owned());
        }
        add("--out", path(request.target));
        if self.anyway {
            words.push("--anyway".to_owned());
        }
        words
    }

    /// Returns instrument and start as stated by the caller.
    fn labels(&self, file: &Path) -> Result<Head, InputError> {
        if let Some(start) = self.start.as_ref().filter(|start| !is_rfc3339(start)) {
            return Err(InputError::new(file, "cannot start at this time")
                .channel("--start")
                .value(start)
                .expected("date, time and zone, such as 2026-03-01T12:00:00Z"));
        }
        Ok(Head {
            comment: String::new(),
            instrument: self.instrument.clone(),
            start: self.start.clone(),
            instants: Vec::new(),
        })
    }

    fn said(&self, file: &Path, rate_hz: Option<f64>) -> Result<Said, InputError> {
        let euler = self.euler.as_deref().map(|text| {
            EulerOrder::parse(text).ok_or_else(|| {
                InputError::new(file, "cannot have Euler angles in this order")
                    .channel("--euler")
                    .value(text)
                    .expected("x, y and z once each, such as zyx")
            })
        });
        Ok(Said {
            times: self
                .time
                .iter()
                .map(|text| TimeOption::parse(text))
                .collect(),
            rate_hz,
            euler: euler.transpose()?,
            instants: sampled_at_an_instant(file, &self.sampling)?,
            anyway: self.anyway,
        })
    }
}

/// Returns the quantities sampled at an instant according to `--sampling`.
fn sampled_at_an_instant(file: &Path, said: &[String]) -> Result<Vec<Quantity>, InputError> {
    // By the names of `--map`; a reference's rate is stored as its angle over the row.
    let known = [
        ("gyro_rate", Quantity::GyroRate),
        ("reference_rate", Quantity::ReferenceIncrement),
        ("specific_force", Quantity::SpecificForce),
    ];
    let mut instants = Vec::new();
    for text in said {
        let (of, how) = text.rsplit_once(':').unwrap_or(("", text));
        let named = known
            .iter()
            .filter(|(name, _)| of.is_empty() || *name == of);
        let named: Vec<Quantity> = named.map(|(_, quantity)| quantity.clone()).collect();
        match how {
            "instant" | "mean" if !named.is_empty() => {
                instants.retain(|one| !named.contains(one));
                if how == "instant" {
                    instants.extend(named);
                }
            }
            _ => {
                return Err(InputError::new(file, "cannot be sampled so")
                    .channel("--sampling")
                    .value(text)
                    .expected(
                        "mean or instant, or one of gyro_rate, reference_rate, specific_force before it: \
                         gyro_rate:instant",
                    ));
            }
        }
    }
    Ok(instants)
}

/// Reads the columns of all files with their SHA-256, or takes those in memory.
fn all_blocks(
    request: &Request<'_>,
    in_memory: Option<Vec<Column>>,
) -> Result<(Vec<Block>, Vec<String>), InputError> {
    if let Some(columns) = in_memory {
        return Ok((blocks(&request.files[0], columns, None), Vec::new()));
    }
    let (mut all, mut sums) = (Vec::new(), Vec::new());
    for file in request.files {
        let (read, sum) = read(file, request)?;
        all.extend(read);
        sums.push(sum);
    }
    Ok((all, sums))
}

/// Reads the columns of a file and its SHA-256.
fn read(file: &Path, request: &Request<'_>) -> Result<(Vec<Block>, String), InputError> {
    let format = match request.format {
        Some(format) => format,
        None => Format::of_file(file)?,
    };
    let check = |sum: &str| match request.sha256 {
        Some(given) => known::check(file, sum, Some(&known::expected_sum(file, given)?)),
        None => Ok(()),
    };
    if !matches!(format, Format::Mat | Format::Hdf5 | Format::Parquet) {
        // Row by row: a text is several times as long as its numbers.
        let (block, sum) = text_table::read(file, check)?;
        return Ok((vec![block], sum));
    }
    let bytes = fs::read(file).map_err(|error| InputError::unreadable(file, &error))?;
    let sum: String = Sha256::digest(&bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    check(&sum)?;
    let read = match format {
        Format::Mat if !hdf5_file::is_hdf5(&bytes) => mat_file::read(file, &bytes)?,
        Format::Mat | Format::Hdf5 => hdf5_file::read(file, bytes)?,
        _ => {
            let columns = parquet_columns(file)?;
            let column = |foreign: ForeignColumn| Column {
                dates: foreign.origin_s.map(|origin_s| Dates {
                    origin_s,
                    has_zone: foreign.has_zone,
                    has_day: true,
                }),
                ..Column::new(foreign.name, foreign.values)
            };
            blocks(file, columns.into_iter().map(column).collect(), None)
        }
    };
    Ok((read, sum))
}

/// Note on a unit that moves without a reference: what a diagnosis can compare it with.
fn unreferenced(recording: &Recording) -> String {
    let told = match stands_in_positions(recording, &rlg_plan::Plan::default()) {
        true => "its still positions and the turns between them are compared with gravity",
        false => {
            "rlg diagnose can tell a bound of its noise and faults of the data, and no error of the gyros"
        }
    };
    format!("the unit turns, and no reference shows how: {told}")
}
