//! Writes an assembled recording with comments, and the model of an ideal unit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::assemble::Assembled;
use crate::error::InputError;
use crate::import::still::{self, name_of};
use crate::model::{Model, MotionSource};
use crate::output::OutputFolder;
use crate::recording::{Head, Quantity, Recording, Site};

/// File name of the model in the recording's folder.
const MODEL: &str = "model.toml";

/// Makes a recording of these tables, which move into it, named after its source.
pub fn recording(file: &Path, site: Option<Site>, assembled: &mut Assembled) -> Recording {
    Recording {
        name: name_of(file),
        folder: PathBuf::new(),
        site,
        tables: std::mem::take(&mut assembled.tables),
        segments: Vec::new(),
    }
}

/// Makes the model of an ideal unit: nothing is corrected, no noise is declared.
pub fn ideal(recording: &Recording, assembled: &Assembled) -> Model {
    let channels = recording.channels();
    let quantities: Vec<Quantity> = channels.map(|channel| channel.quantity.clone()).collect();
    still::ideal(assembled.pulse_weight_rad, &quantities)
}

/// Adds the recording and its model to `out`; `labels` are instrument and start, its comment is written here.
pub fn write(
    files: &[PathBuf],
    recording: &Recording,
    assembled: &Assembled,
    left_out: &[(String, String)],
    labels: &Head,
    out: &mut OutputFolder,
) -> Result<(), InputError> {
    let head = Head {
        comment: recording_comment(files, assembled, left_out),
        ..labels.clone()
    };
    recording.write_headed_into(out, &head)?;
    let model = ideal(recording, assembled);
    model.check(&out.target().join(MODEL))?;
    let text = format!("{}{}", model_comment(&model), model.to_toml());
    out.write(MODEL, text.as_bytes())
}

fn recording_comment(
    files: &[PathBuf],
    assembled: &Assembled,
    left_out: &[(String, String)],
) -> String {
    let name = |file: &PathBuf| {
        file.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let names: Vec<String> = files.iter().map(name).collect();
    let mut text = format!(
        "# Made by `rlg import` of {}.\n",
        one_line(&names.join(", "))
    );
    text.push_str("# value = stored * scale + offset, in SI; row k covers start_s + k/rate_hz to start_s + (k+1)/rate_hz,\n");
    text.push_str("# attitudes (body to navigation) and temperatures are at a row's end; null was not measured.\n");
    // Writing to a String cannot fail, so the results of write! are dropped.
    for taken in &assembled.taken {
        let axis = taken.axis.as_deref().unwrap_or("-");
        let origin = one_line(&taken.origin);
        let _ = writeln!(
            text,
            "#   {}: {} {axis} <- {origin}",
            one_line(&taken.column),
            taken.quantity
        );
    }
    for (column, reason) in left_out {
        let _ = writeln!(
            text,
            "#   left out: {}: {}",
            one_line(column),
            one_line(reason)
        );
    }
    for note in &assembled.notes {
        let _ = writeln!(text, "#   {}", one_line(note));
    }
    text
}

/// Replaces control characters: a foreign text must not end a comment.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .collect()
}

fn model_comment(model: &Model) -> String {
    let motion = match model.motion {
        MotionSource::Reference => {
            "# The motion is the reference's, taken relative to the Earth (a turntable, cameras); where the reference is\n\
             # itself a gyro, write earth_rate = true.\n"
        }
        MotionSource::Static => {
            "# No reference: the unit is taken to lie still on the turning Earth. A [site] in recording.toml tells how much of\n\
             # the Earth's rate is vertical; without one its direction is open, and a bias of its size is not distinguishable from it.\n"
        }
    };
    format!(
        "# An ideal unit: what `rlg diagnose` finds is what this model leaves out. Put in what you know of the unit\n\
         # (bias, scale, installation); noise that no key declares is measured.\n{motion}"
    )
}
