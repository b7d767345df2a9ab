//! The findings of a unit at rest, in the words of the contract and of people.
//!
//! Enters: [`Findings`]. Leaves: entries of effects for lines (one a frequency, all gyros); sentences for the terminal.

use strapdown::earth::ROTATION_RAD_S;

use super::empirical::Form;
use super::entries::{by_axis, unlisted};
use super::explain::{DEG_H, Findings};
use super::hunt::FoundTerm;
use super::lattice::Lattice;
use super::lines::relation;
use super::result::EffectEntry;
use super::scene::Scene;
use super::still::AtRest;
use super::streams::AXES;

/// The frequency of a term that is one half of a line \[Hz\].
pub(super) fn line_of(found: &FoundTerm) -> Option<f64> {
    let Form::Product { expression } = &found.term.form else {
        return None;
    };
    let rest = expression
        .strip_prefix("sine(")
        .or_else(|| expression.strip_prefix("cosine("))?;
    rest.strip_suffix(')')?.parse().ok()
}

/// Leaves out lines that turn a gyro by less than its pulses hide: counting makes tones.
pub(super) fn without_hidden_lines(
    mut terms: Vec<FoundTerm>,
    lattice: &Lattice,
    scene: &Scene,
) -> Vec<FoundTerm> {
    let line = |found: &FoundTerm| line_of(found).map(|hz| (found.term.axis, hz));
    let shown = terms.iter().filter(|one| !one.is_hidden(lattice, scene));
    let shown: Vec<(usize, f64)> = shown.filter_map(line).collect();
    terms.retain(|one| line(one).is_none_or(|line| shown.contains(&line)));
    terms
}

/// One frequency on all gyros.
struct Group {
    frequency_hz: f64,
    /// Sum of squares and its variance by gyro \[rad²/s²\].
    power: [f64; 3],
    std: [f64; 3],
    ratio: f64,
    p_value: f64,
}

impl Findings<'_> {
    /// One entry a frequency, the strongest first.
    pub(super) fn line_entries(&self, lines: &[&FoundTerm]) -> Vec<EffectEntry> {
        let fitted_s: f64 = self
            .split
            .fitted
            .iter()
            .map(|rows| rows.len() as f64 / self.scene.streams.rate_hz)
            .sum();
        // Half a bin: what two gyros show closer than that is one line.
        let same_hz = 0.5 / fitted_s;
        let mut groups: Vec<Group> = Vec::new();
        for found in lines {
            let Some(frequency_hz) = line_of(found) else {
                continue;
            };
            let axis = found.term.axis;
            let place = groups
                .iter()
                .position(|group| (group.frequency_hz - frequency_hz).abs() < same_hz)
                .unwrap_or_else(|| {
                    groups.push(Group {
                        frequency_hz,
                        power: [0.0; 3],
                        std: [0.0; 3],
                        ratio: 0.0,
                        p_value: 1.0,
                    });
                    groups.len() - 1
                });
            let group = &mut groups[place];
            group.power[axis] += found.size * found.size;
            group.std[axis] = group.std[axis].max(found.std);
            // Both halves of a line carry its ratio.
            group.ratio += 0.5 * found.ratio;
            group.p_value = group.p_value.min(found.p_value);
        }
        groups.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
        let frequencies: Vec<f64> = groups.iter().map(|group| group.frequency_hz).collect();
        groups
            .iter()
            .enumerate()
            .map(|(place, group)| {
                let from = relation(
                    group.frequency_hz,
                    &frequencies[..place.min(FUNDAMENTALS)],
                    self.scene.streams.rate_hz,
                    2.0 * same_hz,
                );
                line_entry(group, from)
            })
            .collect()
    }

    /// White angle noise of increments at rest has two names.
    pub(super) fn coarse_at_rest(&self, mut entry: EffectEntry) -> EffectEntry {
        if self.scene.streams.at_rest.is_some() && entry.kind == "pulse_quantisation" {
            rlg_diagnosis::at_rest::coarse(&mut entry);
        }
        entry
    }

    /// A constant rate at rest has many names.
    pub(super) fn confused_at_rest(&self, mut entry: EffectEntry) -> EffectEntry {
        if entry.kind == "gyro_bias" {
            for kind in ["earth_rate", "gyro_scale", "gyro_g_bias", "installation"] {
                if !entry
                    .indistinguishable_from
                    .iter()
                    .any(|known| known == kind)
                {
                    entry.indistinguishable_from.push(kind.to_string());
                }
            }
            entry.what_was_left_out = "The mean rates are not the Earth's at this site: a bias, a wrong scale or pulse weight, or another site; at rest in one attitude these look the same.".to_string();
        }
        entry
    }

    /// What is left on each gyro, as one entry: at rest its places have no motion to tell them apart.
    pub(super) fn unexplained_at_rest(&self) -> Vec<EffectEntry> {
        (0..3)
            .filter_map(|axis| {
                let here: Vec<_> = self.left.iter().filter(|place| place.axis == axis).collect();
                let first = here.first()?;
                let low_hz = here.iter().map(|p| p.band_hz.0).fold(f64::INFINITY, f64::min);
                let high_hz = here.iter().map(|p| p.band_hz.1).fold(0.0, f64::max);
                let end = here.iter().map(|place| place.rows.end).max()?;
                Some(EffectEntry {
                    p_value: here.iter().map(|place| place.p_value).fold(1.0, f64::min),
                    ..unlisted(
                        String::new(),
                        format!(
                            "Gyro {} shows more than its noise in {} places between {:.1} and {:.1} s, {low_hz:.0} to {high_hz:.0} Hz, and nothing measured explains it: located only.",
                            AXES[axis],
                            here.len(),
                            self.scene.streams.begin_s(first.rows.start),
                            self.scene.streams.begin_s(end),
                        ),
                    )
                })
            })
            .collect()
    }

    /// The Earth, the control and the held-out power in sentences.
    pub(super) fn still_summary(&self, rest: &AtRest) -> Vec<String> {
        let mut lines = vec![match &rest.up {
            Some(up) => format!(
                "At rest: the mean rate is {:.3} °/h, {:.4} of the Earth's; its vertical part {:.4} of what latitude {:.4}° gives. The mean force is {:.5} of the site's gravity. The azimuth was fitted.",
                rest.mean_rad_s.norm() * DEG_H,
                rest.mean_rad_s.norm() / ROTATION_RAD_S,
                rest.mean_rad_s.dot(up) / (ROTATION_RAD_S * rest.latitude_rad.sin()),
                rest.latitude_rad.to_degrees(),
                rest.force_over_gravity.unwrap_or(f64::NAN),
            ),
            None => format!(
                "At rest: the mean rate is {:.3} °/h, {:.4} of the Earth's; without accelerometers its direction was fitted.",
                rest.mean_rad_s.norm() * DEG_H,
                rest.mean_rad_s.norm() / ROTATION_RAD_S,
            ),
        }];
        let [before, after] = self.rows_found.held_out_rad_s;
        for axis in (0..3).filter(|&axis| after[axis] != before[axis]) {
            lines.push(format!(
                "Proof: on the held-out second half the rate of gyro {} scatters by {:.2} °/h before and {:.2} °/h after.",
                AXES[axis],
                before[axis] * DEG_H,
                after[axis] * DEG_H
            ));
        }
        if let Some(control) = &self.rows_found.control {
            lines.push(format!(
                "Control: in the same rows shuffled the same search finds {} lines; {} findings were dropped for it.",
                control.lines, self.rows_found.dropped
            ));
        }
        lines
    }
}

/// Lines from which others may be made: each dither and a converter or two.
const FUNDAMENTALS: usize = 5;

fn line_entry(group: &Group, from: Option<String>) -> EffectEntry {
    let hz = group.frequency_hz;
    let origin = match from {
        Some(from) => format!("It stands at {from}, folded at the row rate: a product or harmonic of those lines."),
        None => "A vibration, a converter's tone, or the image of something faster than half the row rate, such as a dither: one row rate does not tell which.".to_string(),
    };
    let amplitudes = group.power.map(f64::sqrt);
    let (parameters, covariance) = by_axis(amplitudes, group.std, "rad/s");
    let [x, y, z] = amplitudes.map(|amplitude| amplitude * DEG_H);
    EffectEntry {
        parameters,
        covariance,
        log_evidence_gain: 0.5 * group.ratio,
        p_value: group.p_value,
        expression: Some(format!("sine({hz:.5})")),
        ..unlisted(
            format!("omega_i += A_i sin(2 pi {hz:.5} t + phase_i)"),
            format!("A steady line at {hz:.4} Hz, {x:.2}, {y:.2}, {z:.2} °/h on x, y, z. {origin}"),
        )
    }
}
