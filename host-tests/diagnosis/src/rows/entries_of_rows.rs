//! Faults of the data and figures on held-out time as entries of `diagnosis.json`.

use std::collections::BTreeMap;

use rlg_findings::entries::unlisted;
use rlg_findings::result::{ChannelEntry, EffectEntry, FiguresEntry, ParameterEntry};
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::fault::{Detail, Fault};
use rlg_signal::streams::{AXES, Streams};

use super::data_words;
use crate::tiles::held_out_figures::{Figures, Validation};

/// Entry of a fault of the data.
pub fn fault_entry(streams: &Streams, fault: &Fault) -> EffectEntry {
    let [start_s, end_s] = streams.span_of(&fault.rows);
    // A fault is located to the row.
    let std = 1.0 / streams.rate_hz;
    let number = |name: &str, value: f64| ParameterEntry::number(name, value, std, "s");
    // Counts are exact: places and rows, or rows per sample.
    let counted = match fault.detail {
        Detail::Places { places, rows } => {
            vec![("count", places as f64), ("row_count", rows as f64)]
        }
        Detail::Hold { rows_per_reading } => vec![("rows", rows_per_reading)],
        Detail::None | Detail::Wrapped | Detail::Spike { .. } => Vec::new(),
    };
    let count = 2 + counted.len();
    let mut covariance = vec![vec![0.0; count]; count];
    covariance[0][0] = std * std;
    covariance[1][1] = std * std;
    let counted = counted
        .into_iter()
        .map(|(name, value)| ParameterEntry::number(name, value, 0.0, "1"));
    let rows_of = data_words::rows_of(streams, fault);
    let said = match fault.detail {
        Detail::None => format!(
            "Data of {} not usable between {start_s:.4} and {end_s:.4} s; those rows were excluded.",
            rows_of.unwrap_or(&fault.channel)
        ),
        _ => data_words::sentence(streams, &[fault]),
    };
    EffectEntry {
        kind: fault.kind.to_string(),
        indistinguishable_from: fault
            .indistinguishable_from
            .iter()
            .map(|kind| (*kind).to_string())
            .collect(),
        parameters: [
            ParameterEntry::text("channel", &fault.channel),
            number("start_s", start_s),
            number("end_s", end_s),
        ]
        .into_iter()
        .chain(counted)
        .chain(rows_of.map(|owner| ParameterEntry::text("rows_of", owner)))
        .collect(),
        covariance,
        ..unlisted(String::new(), said)
    }
}

/// Effect of a fault in the updated model.
pub fn fault_effect(fault: &Fault, streams: &Streams) -> ModelEffect {
    let [start_s, end_s] = streams.span_of(&fault.rows);
    ModelEffect {
        kind: fault.kind.to_string(),
        parameters: BTreeMap::from([
            (
                "channel".to_string(),
                EffectValue::Text(fault.channel.clone()),
            ),
            ("start_s".to_string(), EffectValue::Number(start_s)),
            ("end_s".to_string(), EffectValue::Number(end_s)),
        ]),
    }
}

/// Entry of a channel: figures on held-out time, before and after.
pub fn channel(validation: &Validation) -> ChannelEntry {
    let figures = |figures: &Figures| FiguresEntry {
        drift_rad_s: figures.drift_rad_s,
        drift_std_rad_s: figures.drift_std_rad_s,
        normalised_power: figures.normalised_power,
        normalised_power_all: figures.normalised_power_all,
        white_p_value: figures.white_p_value,
    };
    ChannelEntry {
        channel: format!("gyro_{}", AXES[validation.axis]),
        unit: None,
        band_hz: [validation.band_hz.0, validation.band_hz.1],
        held_out_before: figures(&validation.before),
        held_out_after: figures(&validation.after),
    }
}

/// Returns the entry as an effect of a model: it predicts nothing, but is no finding when diagnosed again.
pub(crate) fn model_effect_of(entry: &EffectEntry) -> ModelEffect {
    let expression = entry.expression.clone().unwrap_or_default();
    let mut parameters =
        BTreeMap::from([("expression".to_string(), EffectValue::Text(expression))]);
    for parameter in &entry.parameters {
        if let ParameterEntry::Number { name, value, .. } = parameter {
            parameters.insert(name.clone(), EffectValue::Number(*value));
        }
    }
    ModelEffect {
        kind: entry.kind.clone(),
        parameters,
    }
}
