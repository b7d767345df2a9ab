//! Lines of the gyros that no other channel has: set aside before the search, as entries of `diagnosis.json` and as effects of a model.

use rlg_findings::result::EffectEntry;
use rlg_model::{Model, ModelEffect};
use rlg_plan::OwnLinesPlan;
use rlg_signal::own_lines::{OwnLine, find};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, add_triad};

use crate::lines_at_rest::line::{Clock, Line, Origin, Phase};
use crate::lines_at_rest::line_words;
use crate::rows::data::Data;
use crate::rows::entries_of_rows::model_effect_of;

impl Data<'_> {
    /// Takes lines of the gyros that no other channel has out of the residual, in the rows that are fitted.
    pub(crate) fn take_own_lines(&mut self, plan: &OwnLinesPlan) {
        if self.streams.at_rest.is_some() {
            return;
        }
        let streams = self.streams;
        let others: Vec<&Triad> = std::iter::once(&streams.case_rad)
            .chain(&self.dither_rad)
            .chain(&streams.force_m_s2)
            .collect();
        let seen = self.rows_of(&[Use::Fit]);
        let clocks = (streams.rate_hz, streams.rate_hz);
        let mut lines = find(&self.residual_rad, &others, &seen, clocks, plan);
        let resolution_hz = streams.rate_hz / streams.rows as f64;
        let predicted_hz: Vec<f64> = self.model.effects.iter().filter_map(predicted_hz).collect();
        lines.retain(|line| {
            let mut each = predicted_hz.iter();
            each.all(|hz| (hz - line.hz[0]).abs() > resolution_hz)
        });
        for line in &lines {
            let rows_rad = line.rows_rad(streams.rows, streams.rate_hz);
            add_triad(&mut self.residual_rad, &rows_rad, -1.0);
            match self.aside.explained_rad[0].is_empty() {
                true => self.aside.explained_rad = rows_rad,
                false => add_triad(&mut self.aside.explained_rad, &rows_rad, 1.0),
            }
        }
        self.own_lines = lines;
    }
}

/// Frequency of a line that a model predicts with its phase \[Hz\].
fn predicted_hz(effect: &ModelEffect) -> Option<f64> {
    effect.text("axis")?;
    let expression = effect.text("expression")?;
    let inside = ["sine(", "cosine("]
        .iter()
        .find_map(|stem| expression.strip_prefix(stem))?;
    inside.strip_suffix(')')?.parse().ok()
}

/// Entries of lines that the model does not hold, each with its effect.
///
/// # Inputs
/// `rows`, `rate_hz`: of the record that the lines were found in.
pub fn entries(
    lines: &[OwnLine],
    rows: usize,
    rate_hz: f64,
    model: &Model,
) -> Vec<(EffectEntry, ModelEffect)> {
    let clock = Clock { rows, rate_hz };
    let with_effect = lines.iter().flat_map(|line| {
        let entry = line_words::entries(&[of(line, rows)], clock, model).pop()?;
        let side = match line.is_hidden {
            true => "Gyro and reference not distinguishable below the motion.",
            false => "Absent from the reference.",
        };
        let entry = EffectEntry {
            what_was_left_out: format!("{} {side}", entry.what_was_left_out),
            ..entry
        };
        let effect = model_effect_of(&entry);
        Some((entry, effect))
    });
    with_effect.collect()
}

/// One sentence of a summary for each line.
pub fn sentence(entry: &EffectEntry) -> String {
    format!("Found: {}", entry.what_was_left_out)
}

fn of(line: &OwnLine, rows: usize) -> Line {
    let [hz, hz_std] = line.hz;
    // The power of three channels in one of so many bins, all of noise alone, has Γ(3)'s law.
    let half = 0.5 * line.gain;
    let ln_chance = (1.0 + half + 0.5 * half * half).ln() - half + (0.5 * rows as f64).ln();
    Line {
        origin: Origin::Own(Phase {
            hz,
            hz_std,
            course_rad: Vec::new(),
            wander_hz: [0.0; 2],
        }),
        shown_hz: hz,
        amplitude_rad: line.amplitude_rad,
        measured_rad: line.amplitude_rad,
        std_rad: [line.std_rad; 3],
        gain: line.gain,
        ln_chance,
    }
}
