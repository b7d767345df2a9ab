//! Faults of the data itself, found before any physical explanation (diagnosis road, step 1).
//!
//! Enters: the aligned channels and the model's known effects. Leaves: [`Fault`]s, and a mask of their rows. A channel that
//! repeats one value improbably long is stuck (at zero: its samples may be lost); one that accumulates at its own extreme is
//! saturated (channel_faults.rs); rows without a value are lost, as are single outliers (outliers.rs).

use std::cell::OnceCell;
use std::collections::HashMap;

use super::channel_faults::of_channel;
use super::data_faults;
use super::extremes;
use super::fault::is_between_pulses;
pub use super::fault::{Detail, Fault, pulse};
use super::outliers;
use super::read_once::read_once;
use super::streams::{AXES, Streams};
use rlg_model::{EffectValue, ModelEffect};
use rlg_plan::FaultPlan;

/// Finds faults and masks their rows.
pub fn qualify(streams: &mut Streams, plan: &FaultPlan) -> Vec<Fault> {
    // At rest the case's motion is computed, and constant; without a reference on the rows it is the gyros' own.
    let has_reference = streams.at_rest.is_none() && !streams.own_motion;
    let at_stops = data_faults::stops(streams, plan);
    out_of_use(streams, &at_stops, plan);
    let repeated = data_faults::repeated(streams, plan);
    out_of_use(streams, &repeated, plan);
    let mut faults = Vec::new();
    let together = ((plan.clipping.together_s * streams.rate_hz) as usize).max(2);
    for axis in 0..3 {
        let measured = (&streams.measured[..], together);
        let name = |stem: &str| format!("{stem}_{}", AXES[axis]);
        let gyro = &streams.sensed_rad[axis];
        let counts_freely = streams.pickoff_rad.is_none();
        let case_rad = &streams.case_rad[axis];
        let is_fault = |fault: &Fault| {
            !counts_freely
                || !(is_between_pulses(fault, gyro, &plan.pulses)
                    || has_reference
                        && (is_dead_band(fault, gyro, case_rad, plan)
                            || outliers::agrees(fault, gyro, case_rad, &plan.pulses)))
        };
        let mut of_gyro = of_channel(&name("gyro"), gyro, measured, &is_fault, plan);
        let is_cut = |fault: &Fault| match has_reference {
            true => extremes::falls_short(streams, axis, &fault.rows, &plan.extremes),
            false => extremes::dips(streams, axis, &fault.rows, &plan.extremes),
        };
        of_gyro.retain(|fault| fault.kind != "saturation" || is_cut(fault));
        // Samples at the ends of the range are reported with all their rows.
        if at_stops.iter().all(|fault| fault.channel != name("gyro")) {
            faults.extend(of_gyro);
        }
        if has_reference {
            let witness = OnceCell::new();
            let is_fault = |fault: &Fault| {
                let new = || outliers::Witness::new(case_rad, gyro, streams.rate_hz, plan);
                !witness.get_or_init(new).confirms(fault, plan.confirmed)
            };
            let name = name("reference");
            faults.extend(of_channel(&name, case_rad, measured, &is_fault, plan));
        }
        if let Some(pickoff) = &streams.pickoff_rad {
            faults.extend(of_channel(
                &name("dither"),
                &pickoff[axis][1..],
                measured,
                &|_| true,
                plan,
            ));
        }
    }
    if streams.at_rest.is_some() && streams.pickoff_rad.is_none() {
        faults = stopped_together(faults);
    }
    out_of_use(streams, &faults, plan);
    let held = outliers::held(streams, plan);
    out_of_use(streams, &held, plan);
    faults.extend(held);
    let spikes = outliers::spikes(streams, plan);
    for spike in &spikes {
        streams.usable[spike.rows.clone()].fill(false);
    }
    faults.extend(gathered(spikes, plan));
    let of_rates = data_faults::spikes(streams, &plan.spikes);
    for spike in &of_rates {
        streams.usable[spike.rows.clone()].fill(false);
    }
    faults.extend(gathered(of_rates, plan));
    faults.extend(gathered(at_stops, plan));
    faults.extend(gathered(repeated, plan));
    faults.extend(lost(streams, plan));
    faults
}

/// Finds single rows of the gyros' rates that stand out of their neighbours and in which the case did not turn, masks them, and
/// bridges them by their neighbours.
///
/// # Inputs
/// `is_motion`: true for the gyro and the row of a candidate if a slower reference turned as well; its excess in rad.
pub fn spikes_beside(
    streams: &mut Streams,
    plan: &FaultPlan,
    is_motion: impl Fn(&Streams, usize, usize, f64) -> bool,
) -> Vec<Fault> {
    let spikes = data_faults::own_spikes(streams, &plan.spikes);
    let refuted = spikes.into_iter().filter_map(|spike| {
        let axis = AXES.iter().position(|axis| spike.channel.ends_with(axis))?;
        match spike.detail {
            Detail::Spike { size_rad } if !is_motion(streams, axis, spike.rows.start, size_rad) => {
                Some((axis, size_rad, spike))
            }
            _ => None,
        }
    });
    let refuted: Vec<(usize, f64, Fault)> = refuted.collect();
    let mut kept = Vec::new();
    for (axis, size_rad, spike) in &refuted {
        // One of a channel whose others are motion may be motion, too.
        if refuted.iter().filter(|(other, ..)| other == axis).count() >= plan.spikes.least {
            streams.usable[spike.rows.start] = false;
            streams.sensed_rad[*axis][spike.rows.start] -= size_rad;
            kept.push(spike.clone());
        }
    }
    gathered(kept, plan)
}

/// Masks the rows of faults, and their edges.
fn out_of_use(streams: &mut Streams, faults: &[Fault], plan: &FaultPlan) {
    for fault in faults {
        let end = (fault.rows.end + plan.guard_rows).min(streams.rows);
        streams.usable[fault.rows.start.saturating_sub(plan.guard_rows)..end].fill(false);
    }
}

/// Keeps saturation, and stops common to all three gyros. At rest, the zero runs of a coarse gyro without dither exceed
/// those of chance in quiet times; samples are missing only where all three stop at once.
fn stopped_together(faults: Vec<Fault>) -> Vec<Fault> {
    let at_once = |fault: &Fault, stem: &str| {
        AXES.iter().all(|axis| {
            faults.iter().any(|other| {
                other.channel == format!("{stem}_{axis}")
                    && other.rows.start < fault.rows.end
                    && fault.rows.start < other.rows.end
            })
        })
    };
    let kept: Vec<Fault> = faults
        .iter()
        .filter(|fault| fault.kind == "saturation" || at_once(fault, "gyro"))
        .cloned()
        .collect();
    kept
}

/// Stretches without a value, inside the record.
fn lost(streams: &Streams, plan: &FaultPlan) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut row = 0;
    while row < streams.rows {
        if streams.measured[row] {
            row += 1;
            continue;
        }
        let begin = row;
        while row < streams.rows && !streams.measured[row] {
            row += 1;
        }
        if begin == 0 || row == streams.rows {
            continue;
        }
        let mut at = begin;
        while at < row {
            let is_of_all = streams.is_row_lost(at);
            let alike = (at..row).take_while(|&row| streams.is_row_lost(row) == is_of_all);
            let end = at + alike.count();
            let channel = streams.unmeasured_channel(at);
            // An increment of the reference that spans lost rows is no further one.
            let spans = at > begin && end == at + 1 && channel.starts_with("reference");
            if !spans {
                faults.push(Fault {
                    kind: "lost_samples",
                    indistinguishable_from: &[],
                    channel,
                    rows: at..end,
                    detail: Detail::None,
                });
            }
            at = end;
        }
    }
    gathered(faults, plan)
}

/// True if a gyro without dither is locked in: it is silent at every rate as low as in the run; a failed one is silent there
/// alone.
///
/// # Inputs
/// `case_rad`: increments of the reference about its axis \[rad\].
fn is_dead_band(fault: &Fault, values: &[f64], case_rad: &[f64], plan: &FaultPlan) -> bool {
    if fault.kind == "saturation" || values[fault.rows.start] != 0.0 {
        return false;
    }
    // Smoothed as far as the run allows, against the reference's noise.
    let reach = (fault.rows.len() / 4).max(1);
    let mut angle_rad = vec![0.0];
    angle_rad.extend(case_rad.iter().scan(0.0, |sum, increment| {
        *sum += increment;
        Some(*sum)
    }));
    let turn_rad = |row: usize| {
        let (first, end) = (row.saturating_sub(reach), (row + reach).min(values.len()));
        ((angle_rad[end] - angle_rad[first]) / (end - first) as f64).abs()
    };
    let fastest = fault.rows.clone().map(turn_rad).fold(0.0, f64::max);
    let is_other =
        |row: &usize| !fault.rows.contains(row) && turn_rad(*row) < plan.slower * fastest;
    let (silent, all) = (0..values.len()).filter(is_other).fold((0, 0), |sum, row| {
        (sum.0 + usize::from(values[row] == 0.0), sum.1 + 1)
    });
    all >= fault.rows.len() && silent as f64 > plan.silent * all as f64
}

/// Merges the faults of one kind and channel, where they exceed [`FaultPlan::many`], into one with their count, from the
/// first to the last.
fn gathered(faults: Vec<Fault>, plan: &FaultPlan) -> Vec<Fault> {
    let mut counts: HashMap<(&str, String), (usize, usize)> = HashMap::new();
    for fault in &faults {
        let count = counts.entry((fault.kind, fault.channel.clone()));
        let (places, rows) = count.or_default();
        *places += 1;
        *rows += fault.rows.len();
    }
    let mut kept: Vec<Fault> = Vec::new();
    for fault in faults {
        let (places, rows) = counts[&(fault.kind, fault.channel.clone())];
        let is_same =
            |known: &&mut Fault| known.kind == fault.kind && known.channel == fault.channel;
        match kept.iter_mut().find(is_same) {
            Some(known) if places > plan.many => {
                known.rows.end = fault.rows.end;
                known.detail = Detail::Places { places, rows };
            }
            _ => kept.push(fault),
        }
    }
    kept
}

/// Removes repeated samples (read_once.rs), qualifies all channels, and returns the faults absent from the model.
pub fn unknown_faults(
    streams: &mut Streams,
    effects: &[ModelEffect],
    plan: &FaultPlan,
) -> Vec<Fault> {
    let mut faults = read_once(streams, plan);
    faults.extend(qualify(streams, plan));
    faults.retain(|fault| !is_known(fault, streams, effects));
    faults
}

/// True if the model holds a fault of the same kind and channel, overlapping in time.
pub fn is_known(fault: &Fault, streams: &Streams, effects: &[ModelEffect]) -> bool {
    let (start_s, end_s) = (
        streams.begin_s(fault.rows.start),
        streams.begin_s(fault.rows.end),
    );
    effects.iter().any(|effect| {
        let number = |name: &str| match effect.parameters.get(name) {
            Some(EffectValue::Number(value)) => Some(*value),
            _ => None,
        };
        let channel = matches!(
            effect.parameters.get("channel"),
            Some(EffectValue::Text(channel)) if *channel == fault.channel
        );
        let here = effect
            .text("recording")
            .is_none_or(|name| name == streams.piece.recording);
        effect.kind == fault.kind
            && channel
            && here
            && number("start_s").is_some_and(|start| start < end_s)
            && number("end_s").is_some_and(|end| end > start_s)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::still::AtRest;
    use rlg_plan::ChannelPulsePlan;
    use rlg_recording::Site;

    #[test]
    fn a_coarse_channel_written_in_a_finer_unit_shows_its_pulse() {
        let written = |row: usize| [0.0, 1.378e-6, 0.0, -1.379e-6, 2.756e-6, 0.0][row % 6];
        let values: Vec<f64> = (0..600).map(written).collect();
        assert_eq!(pulse(&values, &ChannelPulsePlan::default()), 1.378e-6);
        let fine: Vec<f64> = (0..600).map(|row| (row as f64).sin()).collect();
        assert_eq!(pulse(&fine, &ChannelPulsePlan::default()), 0.0);
    }

    #[test]
    fn at_rest_one_counter_that_stops_is_stuck_where_a_dither_drives_it_and_silent_where_none_does()
    {
        let rows = 8_000;
        let still = [0, 1, 2].map(|_| vec![0.0; rows]);
        let site = Site {
            latitude_rad: 0.6,
            gravity_m_s2: 9.8,
        };
        let found = |dithered: bool| {
            let mut streams = Streams::of_motion(1000.0, still.clone());
            streams.own_motion = false;
            let usable = streams.usable.clone();
            let rest = AtRest::new(&still, None, &usable, 0..rows, 1000.0, Some(site));
            streams.at_rest = Some(rest);
            // 400 rad/s², in pulses of 2e-6 rad.
            let angle = |row: usize| (7e-4 * (row as f64 * 2.4).sin() / 2e-6).round() * 2e-6;
            let counts = (0..rows).map(|row| angle(row + 1) - angle(row));
            streams.sensed_rad = [0, 1, 2].map(|_| counts.clone().collect());
            streams.sensed_rad[0][3_000..3_700].fill(0.0);
            let pickoff = [0, 1, 2].map(|_| (0..=rows).map(angle).collect());
            streams.pickoff_rad = dithered.then_some(pickoff);
            let faults = qualify(&mut streams, &FaultPlan::default()).into_iter();
            let faults = faults.filter(|fault| fault.channel == "gyro_x");
            faults.map(|fault| fault.rows).collect::<Vec<_>>()
        };
        let [rows] = <[_; 1]>::try_from(found(true)).expect("one fault");
        assert!(
            rows.start.abs_diff(3_000) < 3 && rows.end.abs_diff(3_700) < 3,
            "{rows:?}"
        );
        assert!(found(false).is_empty());
    }

    #[test]
    fn a_gyro_that_is_silent_wherever_it_turns_slowly_is_in_its_dead_band() {
        let rows = 8_000;
        let pulse_rad = 1e-6;
        // 1 rad/s through rest every two seconds, in steps of three pulses near it; it locks below 1e-2 rad/s.
        let rate = |row: usize| (row as f64 * 1e-3 * std::f64::consts::PI).sin();
        let case_rad: Vec<f64> = (0..rows).map(|row| rate(row) * 1e-3).collect();
        let shown = |row: usize| {
            let is_free = rate(row).abs() > 1e-2;
            if is_free {
                (rate(row) * 1e-3 / pulse_rad).round() * pulse_rad
            } else {
                0.0
            }
        };
        let values: Vec<f64> = (0..rows).map(shown).collect();
        let fault = |rows: std::ops::Range<usize>| Fault {
            kind: "lost_samples",
            indistinguishable_from: &[],
            channel: "gyro_x".to_string(),
            rows,
            detail: Detail::None,
        };
        assert!(is_dead_band(
            &fault(1_997..2_003),
            &values,
            &case_rad,
            &FaultPlan::default()
        ));
        let mut lost = values.clone();
        lost[2_400..2_410].fill(0.0);
        assert!(!is_dead_band(
            &fault(2_400..2_410),
            &lost,
            &case_rad,
            &FaultPlan::default()
        ));
        let mut free = values;
        for (row, value) in free.iter_mut().enumerate() {
            *value = (rate(row) * 1e-3 / pulse_rad).round() * pulse_rad;
        }
        free[1_990..2_010].fill(0.0);
        assert!(!is_dead_band(
            &fault(1_990..2_010),
            &free,
            &case_rad,
            &FaultPlan::default()
        ));
    }

    #[test]
    fn silence_between_single_pulses_is_no_fault_and_silence_between_jumps_is() {
        let pulse = 1.378e-6;
        let fault = Fault {
            kind: "lost_samples",
            indistinguishable_from: &[],
            channel: "gyro_x".to_string(),
            rows: 100..200,
            detail: Detail::None,
        };
        let with_edges = |edge: f64| -> Vec<f64> {
            let moving = (0..300).map(|row| pulse * (row % 5) as f64);
            let mut values: Vec<f64> = moving.collect();
            values[100..200].fill(0.0);
            (values[99], values[200]) = (edge, edge);
            values
        };
        let plan = ChannelPulsePlan::default();
        assert!(is_between_pulses(&fault, &with_edges(pulse), &plan));
        assert!(!is_between_pulses(&fault, &with_edges(4.0 * pulse), &plan));
    }
}
