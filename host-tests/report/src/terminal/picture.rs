//! Residual of each gyro with a finding as a picture of braille characters: integrated angle, before and after.
//!
//! Two dots by four a character. A library of terminal plots draws one function over a frame of its own and puts two curves
//! into the same dots, indistinguishable without colour; the grid of dots itself is a dozen lines.

use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::numbers::{Scale, seconds};
use rlg_findings::result::{Diagnosis, ParameterEntry};
use rlg_recording::AXES;

use super::sizes::to_two_digits;
use crate::corrected;

/// Height of one panel \[characters\]: 16 dots.
const HEIGHT: usize = 4;

/// Smallest width of a panel \[characters\], on however narrow a terminal.
const LEAST_WIDTH: usize = 20;

/// Dots of a character by row and column, as bits above U+2800 (Unicode, chapter 21.1).
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// Code point of the braille character without dots.
const BLANK: u32 = 0x2800;

/// Draws the integrated residual of the gyros with findings, or of all if there are none.
///
/// # Inputs
/// `width`: of the terminal \[characters\].
///
/// # Returns
/// Lines of at most `width` characters; one that states the reason where there is no residual.
pub fn picture(diagnosis: &Diagnosis, pictures: Option<&Pictures>, width: usize) -> Vec<String> {
    let Some(pictures) = pictures else {
        return vec![
            "No residual to draw: nothing of this recording could be compared.".to_owned(),
        ];
    };
    let found: Vec<usize> = (0..AXES.len())
        .filter(|axis| has_finding(diagnosis, AXES[*axis]))
        .collect();
    let axes = match found.is_empty() {
        true => (0..AXES.len()).collect(),
        false => found,
    };
    let drawn = axes
        .iter()
        .map(|axis| one(pictures, *axis, corrected(diagnosis), width));
    drawn.flatten().collect()
}

/// True if an effect or a located difference is of this gyro; faults of the data move no residual.
fn has_finding(diagnosis: &Diagnosis, axis: &str) -> bool {
    let channel = format!("gyro_{axis}");
    let is_located = diagnosis.locations.iter().any(|one| one.channel == channel);
    let is_of = |name: &str| name == "all" || name.starts_with(axis);
    let deviations = diagnosis.thresholds().findings.significant_deviations;
    let is_sized = |one: &ParameterEntry| match one {
        ParameterEntry::Number {
            name, value, std, ..
        } => is_of(name) && value.abs() > deviations * std,
        ParameterEntry::Text { .. } => false,
    };
    is_located
        || diagnosis.effects.iter().any(|effect| {
            effect.text("axis") == Some(axis) || effect.parameters.iter().any(is_sized)
        })
}

/// Panels of one gyro under their headline; both of one scale.
fn one(pictures: &Pictures, axis: usize, both: bool, width: usize) -> Vec<String> {
    let after = &pictures.angle_after_rad[axis];
    let before = &pictures.angle_before_rad[axis];
    let panels = match both && before != after {
        true => vec![("before", before), ("after", after)],
        false => vec![("", after)],
    };
    let all = panels.iter().flat_map(|(_, values)| values.iter().copied());
    let [least, most] = ends(all);
    if !(least.is_finite() && most.is_finite()) {
        return vec![format!("gyro {}: no residual to draw.", AXES[axis])];
    }
    let scale = Scale::of("angle", "rad", least.abs().max(most.abs()));
    let written = |value: f64| to_two_digits(value * scale.factor);
    let labels = [written(most), written(least)];
    let names = panels.iter().map(|(name, _)| *name);
    let margin = labels.iter().map(String::as_str).chain(names);
    let margin = margin.map(|label| label.chars().count()).max().unwrap_or(0);
    let columns = width.saturating_sub(margin + 2).max(LEAST_WIDTH);
    let mut lines = vec![format!(
        "gyro {}: integrated residual [{}], {}–{} s",
        AXES[axis],
        scale.unit,
        seconds(pictures.time_s.first().copied().unwrap_or(0.0)),
        seconds(pictures.time_s.last().copied().unwrap_or(0.0)),
    )];
    for (name, values) in panels {
        let rows = panel(values, [least, most], columns);
        for (row, dots) in rows.iter().enumerate() {
            let label = match row {
                0 => labels[0].as_str(),
                1 => name,
                row if row + 1 == HEIGHT => labels[1].as_str(),
                _ => "",
            };
            lines.push(format!("{label:>margin$} ┤{dots}"));
        }
    }
    lines
}

/// Least and largest value.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.filter(|value| value.is_finite()).fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], value| [least.min(value), most.max(value)],
    )
}

/// Draws the range of the values in each column of dots.
///
/// # Returns
/// [`HEIGHT`] lines of `columns` characters, without blanks at their ends.
fn panel(values: &[f64], [least, most]: [f64; 2], columns: usize) -> Vec<String> {
    let (across, down) = (2 * columns, 4 * HEIGHT);
    let mut cells = vec![vec![BLANK; columns]; HEIGHT];
    let extent = (most - least).max(f64::MIN_POSITIVE);
    let place = |value: f64| ((most - value) / extent * (down - 1) as f64).round() as usize;
    let mut last: Option<f64> = None;
    for dot in 0..across {
        let begin = dot * values.len() / across;
        let end = ((dot + 1) * values.len() / across).max(begin + 1);
        let here = values.get(begin..end.min(values.len())).unwrap_or(&[]);
        // The column begins where the last one ended, so that a steep line stays a line.
        let [low, high] = ends(here.iter().copied().chain(last));
        last = here.iter().rev().copied().find(|value| value.is_finite());
        if last.is_none() {
            continue;
        }
        for row in place(high)..=place(low) {
            cells[row / 4][dot / 2] |= DOTS[row % 4][dot % 2];
        }
    }
    let line = |cells: &Vec<u32>| -> String {
        let dots = cells.iter().filter_map(|cell| char::from_u32(*cell));
        let dots: String = dots.collect();
        dots.trim_end_matches('\u{2800}').to_owned()
    };
    cells.iter().map(line).collect()
}
