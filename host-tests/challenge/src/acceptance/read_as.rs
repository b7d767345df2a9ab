//! Alternative reading of the same trial: as a recording longer than memory, or as two recordings of one unit.

use rlg_flow::{
    Aligned, LongRecording, Outcome, Settings, align, diagnose_together, diagnose_under,
};
use rlg_model::DeclaredModel;
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Recording, Table};
use serde::{Deserialize, Serialize};

/// Reading of a trial's recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
pub enum ReadAs {
    /// Unchanged.
    #[default]
    Whole,
    /// In stretches, with memory for a third of the rows only.
    Long,
    /// Cut in the middle: two recordings of one unit.
    Several,
}

impl ReadAs {
    /// Diagnoses a recording in this reading, or whole if that is impossible.
    pub fn diagnose(
        self,
        settings: &Settings,
        recording: &Recording,
        of: DeclaredModel<'_>,
    ) -> Result<Outcome, InputError> {
        let DeclaredModel { model, file } = of;
        match self {
            Self::Whole => diagnose_under(settings, recording, model, file, &|_| {}),
            Self::Long => {
                let folder = tempfile::tempdir()
                    .map_err(|error| InputError::unwritable("a temporary folder", &error))?;
                let mut stored = recording.clone();
                for (place, table) in stored.tables.iter_mut().enumerate() {
                    table.file = format!("table-{place}.parquet");
                }
                let path = folder.path().join("recording");
                stored.write_to(&path)?;
                let rows = recording.tables.first().map_or(0, |table| table.rows);
                match LongRecording::of(&path, model, rows / 3)? {
                    Some(long) => long.diagnose(settings, of, &|_| {}),
                    None => diagnose_under(settings, recording, model, file, &|_| {}),
                }
            }
            Self::Several => {
                let [first, second] = halves(recording);
                let aligned = [first, second]
                    .iter()
                    .map(|half| align(settings, half, model))
                    .collect::<Result<Vec<Aligned>, InputError>>()?;
                diagnose_together(settings, aligned, of, &|_| {})
            }
        }
    }
}

/// Cuts a recording in the middle of its first table.
fn halves(recording: &Recording) -> [Recording; 2] {
    let middle_s = recording.tables.first().map_or(0.0, |table| {
        let half = table.rows / 2;
        match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + half as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[half],
        }
    });
    [true, false].map(|is_first| {
        let tables = recording.tables.iter();
        let mut half = Recording {
            name: format!("{}-{}", recording.name, if is_first { 1 } else { 2 }),
            tables: tables
                .map(|table| half_of(table, middle_s, is_first))
                .collect(),
            ..recording.clone()
        };
        for segment in &mut half.segments {
            match is_first {
                true => segment.end_s = segment.end_s.min(middle_s),
                false => segment.start_s = segment.start_s.max(middle_s),
            }
        }
        half.segments
            .retain(|segment| segment.start_s < segment.end_s);
        half
    })
}

fn half_of(table: &Table, middle_s: f64, is_first: bool) -> Table {
    let row = match &table.clock {
        Clock::Uniform { rate_hz, start_s } => {
            let row = ((middle_s - start_s) * rate_hz).round().max(0.0) as usize;
            row.min(table.rows)
        }
        Clock::Stamped { stamps_s, .. } => stamps_s.partition_point(|stamp| *stamp < middle_s),
    };
    let mut half = table.clone();
    half.keep(if is_first { 0..row } else { row..table.rows });
    half
}
