//! A proposed experiment in words, and its moves as scenario entries.

use rlg_catalogue::moves::{Kind, Move};
use rlg_catalogue::signals::AXES;
use rlg_findings::names::{capital, plain};
use rlg_findings::result::{ExperimentEntry, MoveEntry, PrecisionEntry, SeparationEntry};

use crate::report::entries_of_findings::DRIFT;
use crate::report::finding::card;

/// Describes the experiment in words.
///
/// # Inputs
/// `own`: the kind in question; `open`: kinds not distinguishable from it afterwards.
pub(crate) fn in_words(own: &str, entry: &ExperimentEntry, open: &[&str]) -> String {
    let mut sentence = capital(&entry.programme);
    if entry.repeats > 1 {
        sentence += &format!(", {} times in all", entry.repeats);
    }
    sentence += &if entry.separations.is_empty() {
        known_in_words(&entry.precisions)
    } else {
        apart_in_words(own, &entry.separations)
    };
    if let Some(first) = open.first() {
        let experiment = match *first {
            DRIFT => card(own).experiment,
            first => card(first).experiment,
        };
        let others: Vec<String> = open.iter().map(|kind| plain(kind)).collect();
        sentence += &format!(
            " It does not distinguish {} from {}: {experiment}",
            plain(own),
            others.join(", ")
        );
    }
    sentence
}

/// Describes the predicted standard deviation of the least precise parameter, of those in the first one's unit.
fn known_in_words(precisions: &[PrecisionEntry]) -> String {
    let by_promise =
        |a: &&PrecisionEntry, b: &&PrecisionEntry| a.promised_std.total_cmp(&b.promised_std);
    let unit = precisions.first().map(|first| &first.unit);
    let alike = precisions.iter().filter(|one| Some(&one.unit) == unit);
    let worst = alike.max_by(by_promise);
    worst.map_or_else(String::new, |worst| {
        format!(
            ". Predicted with this recording: σ of every parameter at most {:.1e} {} (here {:.1e}).",
            worst.promised_std, worst.unit, worst.here_std
        )
    })
}

/// Describes the predicted separation \[σ\] between the found kind and each rival, the smaller of both hypotheses.
fn apart_in_words(own: &str, separations: &[SeparationEntry]) -> String {
    let mut rivals: Vec<&str> = Vec::new();
    for one in separations {
        let rival = one.other_than(own);
        if !rivals.contains(&rival) {
            rivals.push(rival);
        }
    }
    let least = |rival: &str, of: fn(&SeparationEntry) -> Option<f64>| {
        let both = separations
            .iter()
            .filter(|one| one.other_than(own) == rival);
        both.filter_map(of).reduce(f64::min)
    };
    let told = rivals.into_iter().map(|rival| {
        let promised = least(rival, |one| Some(one.promised_sigma)).unwrap_or_default();
        let here = least(rival, |one| one.here_sigma);
        let here = here.map_or_else(String::new, |here| format!(" (here {here:.1})"));
        format!(
            "{} by {promised:.0} standard deviations{here}",
            plain(rival)
        )
    });
    let told: Vec<String> = told.collect();
    format!(
        ". Predicted with this recording: separates {} from {}, under either hypothesis.",
        plain(own),
        told.join(", ")
    )
}

/// Converts a move to a scenario entry.
pub fn move_entry(one: &Move) -> MoveEntry {
    let still = MoveEntry {
        kind: "still",
        axis: AXES[0],
        rate_rad_s: 0.0,
        oscillation_axis: AXES[0],
        frequency_hz: 0.0,
        angle_rad: 0.0,
        phase_rad: 0.0,
        ramp_s: one.ramp_s,
        duration_s: one.duration_s,
    };
    match one.kind {
        Kind::Still => still,
        Kind::Coning {
            axis,
            frequency_hz,
            angle_rad,
        } => MoveEntry {
            kind: "coning",
            axis: AXES[axis],
            frequency_hz,
            angle_rad,
            ..still
        },
        Kind::Spin {
            axis,
            rate_rad_s,
            across,
            frequency_hz,
            angle_rad,
            phase_rad,
        } => MoveEntry {
            kind: "spin",
            axis: AXES[axis],
            rate_rad_s,
            oscillation_axis: AXES[across],
            frequency_hz,
            angle_rad,
            phase_rad,
            ..still
        },
    }
}
