//! A recording longer than memory, from its folder.

use std::ops::Range;
use std::path::Path;

use rlg_diagnosis::long::{self, Long};
use rlg_diagnosis::rows::model_effects::is_predictable;
use rlg_diagnosis::search::structure::Found;
use rlg_force::Part;
use rlg_force::reference::measured_noise;
use rlg_model::{DeclaredModel, Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Extent, Quantity, Recording};
use rlg_signal::streams::Streams;

use crate::{Outcome, Settings, accelerometers, or_unusable, too_few_rows};

/// Default number of rows in memory, 0.9 kB each: two and a half minutes at 4 kHz.
pub const MOST_ROWS: usize = 600_000;

/// Recording of which only a part is in memory at once.
pub struct LongRecording<'a> {
    folder: &'a Path,
    extent: Extent,
    most_rows: usize,
}

impl<'a> LongRecording<'a> {
    /// Opens a folder with at most `most_rows` rows in memory; `None` if all rows fit, or if the recording must be read
    /// whole: units at rest, accelerometers alone, slower references, and tables other than Parquet.
    ///
    /// # Errors
    /// The folder's recording.toml cannot be read.
    pub fn of(
        folder: &'a Path,
        model: &Model,
        most_rows: usize,
    ) -> Result<Option<Self>, InputError> {
        let has_gyros = |one: &Quantity| Quantity::GYROS.contains(one);
        let is_beside = model.motion == MotionSource::Reference;
        if !is_beside || !Recording::quantities(folder)?.iter().any(has_gyros) {
            return Ok(None);
        }
        let extent = Recording::extent(folder)?.filter(|extent| extent.rows > most_rows);
        Ok(extent.map(|extent| Self {
            folder,
            extent,
            most_rows,
        }))
    }

    /// Reads the first seconds.
    ///
    /// # Errors
    /// They cannot be read.
    pub fn first(&self, seconds: f64) -> Result<Recording, InputError> {
        let start_s = self.extent.start_s;
        Recording::read_between(self.folder, start_s, start_s + seconds)
    }

    /// Diagnoses the recording.
    ///
    /// # Errors
    /// As of [`crate::diagnose_under`].
    pub fn diagnose(
        &self,
        settings: &Settings,
        of: DeclaredModel<'_>,
        progress: &dyn Fn(&str),
    ) -> Result<Outcome, InputError> {
        let DeclaredModel { model, file } = of;
        is_predictable(model, file)?;
        let Extent {
            ref name,
            ref segments,
            rate_hz,
            start_s,
            rows,
        } = self.extent;
        let at_s = |row: usize| start_s + row as f64 / rate_hz;
        let read = |rows: Range<usize>| {
            let recording = Recording::read_between(self.folder, at_s(rows.start), at_s(rows.end))?;
            Streams::align(&recording, model, &settings.plan.signal.align)
        };
        let long = Long {
            name: name.clone(),
            rows,
            rate_hz,
            start_s,
            segments: segments.clone(),
            read: &read,
        };
        let rows = (&long, self.most_rows);
        let noise = |found: &Found| measured_noise(&found.motion);
        let found = long::diagnose_also(settings, rows, of, progress, noise);
        let found = found.map(|(mut outcome, stretches)| {
            let parts = stretches.iter().map(|(streams, reference_noise)| Part {
                streams,
                reference_noise: *reference_noise,
                read_by_gyros: None,
            });
            accelerometers(settings, parts.collect(), (model, &mut outcome), progress);
            outcome
                .diagnosis
                .judge_noise(&settings.plan.findings.instruments);
            outcome
        });
        or_unusable(found, name, settings, model, too_few_rows)
    }
}
