//! Patterns in time: a slip of a gyro's counter, a steady line. (Steps of its bias: steps.rs.)
//!
//! Enters: what is left of each gyro's residual after the chosen effects, in bins. Leaves: the best slip and the best
//! line with their likelihood ratio and chance, every instant and frequency counted as a trial.
//!
//! A slip is one impulse in the increments, so its matched filter is the residual divided by S, brought
//! back to time.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

use super::bursts::Matched;
use super::empirical::{Form, Term};
use super::portion::{Bins, Portion};
use super::qualify;
use super::scene::Scene;
use super::streams::Streams;
use super::tone::Tone;
use super::workbench::Workbench;

/// Rows next to a joint in which a slip cannot be told from the joint's own free jump.
const JOINT_GUARD_ROWS: usize = 40;

/// Pulses of the smallest slip.
pub(super) const LEAST_PULSES: f64 = 1.5;

/// A ratio that no recording takes for a slip: such ones are not worth a look at the channel's values.
const UNLIKELY: f64 = 20.0;

/// The pulse of a gyro \[rad\], as the model says it behind a dither and as its values show it without one.
pub(super) fn coarsest_rad(streams: &Streams, axis: usize) -> f64 {
    match streams.pickoff_rad {
        Some(_) => streams.pulse_rad[axis],
        None => qualify::pulse(&streams.sensed_rad[axis]),
    }
}

/// A found event.
#[derive(Debug, Clone)]
pub struct Event {
    /// The term.
    pub term: Term,
    /// 2 Δ ln L.
    pub ratio: f64,
    /// Chance, trials counted.
    pub p_value: f64,
}

/// Places in each stretch of a portion that are clear of its joints, and how far on in the recording's rows they are.
pub(super) fn guarded(portion: &Portion) -> impl Iterator<Item = (Range<usize>, i64)> {
    let mut first = 0;
    portion.ranges.iter().map(move |range| {
        let places =
            first + JOINT_GUARD_ROWS..(first + range.len()).saturating_sub(JOINT_GUARD_ROWS);
        let offset = range.start as i64 - first as i64;
        first += range.len();
        (places, offset)
    })
}

/// The best slip on each gyro.
pub fn slips(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let portion = &bench.portion;
    let rows = portion.rows();
    let streams = &bench.scene().streams;
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| {
            let matched = Matched::new(bench, axis, &left[axis])?;
            let guarded = guarded(portion).flat_map(|(places, offset)| {
                places.map(move |place| (place, (place as i64 + offset) as usize))
            });
            let (place, row) =
                guarded.max_by(|a, b| matched.row(a.0).abs().total_cmp(&matched.row(b.0).abs()))?;
            // A counter that loses or gains anything loses or gains pulses; one alone is its quantisation.
            let size_rad = matched.row(place) / matched.own(1);
            let alone = matched.explained(place, 1);
            // A rate that lasts for a while is no slip, though the filter is large wherever it lasts.
            let ratio = match alone < UNLIKELY {
                true => alone,
                false => matched.beside_a_burst(place),
            };
            let pulse_rad = match ratio < UNLIKELY {
                true => streams.pulse_rad[axis],
                false => coarsest_rad(streams, axis),
            };
            if size_rad.abs() < LEAST_PULSES * pulse_rad {
                return None;
            }
            let time_s = streams.middle_s(row);
            Some(event(
                Term {
                    axis,
                    form: Form::Slip { time_s },
                },
                ratio,
                3.0 * rows as f64,
            ))
        })
        .collect()
}

/// Highest frequency \[Hz\] at which a steady line is looked for in gyros without a dither: above it a counter at a
/// steady rate makes tones of its own.
const LINE_BAND_HZ: f64 = 150.0;

/// Highest frequency with a dither, as a share of the rows' rate.
const DITHERED_BAND: f64 = 0.45;

/// Around a dither and its harmonics \[Hz\] lives its residue, which is no line because its amplitude is randomised; a line
/// there stands out of it, but not where the residue is strongest.
const DITHER_GUARD_HZ: f64 = 20.0;
const DITHER_ITSELF_HZ: f64 = 3.0;
const DITHER_HARMONICS: u32 = 5;

/// Where a steady line may lie: the highest frequency \[Hz\], and how far one below it is from the nearest residue.
fn line_band(scene: &Scene) -> (f64, impl Fn(f64) -> f64 + Sync) {
    let rate_hz = scene.streams.rate_hz;
    let residues_hz: Vec<f64> = scene
        .dither_hz
        .iter()
        .flatten()
        .flat_map(|dither_hz| (1..=DITHER_HARMONICS).map(move |k| f64::from(k) * dither_hz))
        .map(|harmonic_hz| (harmonic_hz - (harmonic_hz / rate_hz).round() * rate_hz).abs())
        .collect();
    let to_hz = match scene.dither_hz {
        Some(_) => DITHERED_BAND * rate_hz,
        None => LINE_BAND_HZ,
    };
    let away_hz = move |frequency_hz: f64| {
        let each = residues_hz.iter();
        let each = each.map(|residue_hz| (frequency_hz - residue_hz).abs());
        each.fold(f64::INFINITY, f64::min)
    };
    (to_hz, away_hz)
}

/// Whether a bin holds this many times the mean of those up to `around` bins away, its next neighbours aside.
fn stands_out(power: &[f64], bin: usize, around: usize) -> bool {
    /// Of as many bins as lie around a residue, the strongest of a randomised one holds seven times the mean.
    const TIMES: f64 = 20.0;
    /// Where the line itself leaks to.
    const NEXT: usize = 3;
    let others = (bin.saturating_sub(around)..(bin + around + 1).min(power.len()))
        .filter(|other| other.abs_diff(bin) > NEXT);
    let (sum, count) = others.fold((0.0, 0.0), |(sum, count), other| {
        (sum + power[other], count + 1.0)
    });
    power[bin] * count > TIMES * sum
}

/// The best steady line on each gyro: its sine, and its cosine with the same statistic.
pub fn lines(bench: &Workbench, left: &[Bins; 3]) -> Vec<[Event; 2]> {
    let portion = &bench.portion;
    let streams = &bench.scene().streams;
    let from_hz = 2.0 / portion.seconds();
    let (to_hz, away_hz) = line_band(bench.scene());
    let around = (DITHER_GUARD_HZ * portion.seconds()) as usize;
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| {
            let weights = bench.noise[axis].weights(portion);
            let bins = left[axis].iter().zip(&weights);
            let power: Vec<f64> = bins.map(|(bin, weight)| bin.norm_sqr() * weight).collect();
            let may_hold_one = |bin: usize| match away_hz(portion.frequency_hz(bin)) {
                away_hz if away_hz >= DITHER_GUARD_HZ => true,
                away_hz => away_hz > DITHER_ITSELF_HZ && stands_out(&power, bin, around),
            };
            let bin = (1..portion.bins())
                .take_while(|&bin| portion.frequency_hz(bin) < to_hz)
                .filter(|&bin| portion.frequency_hz(bin) > from_hz)
                .fold(None, |best: Option<usize>, bin| {
                    let is_more = best.is_none_or(|best| power[bin] > power[best]);
                    if is_more && may_hold_one(bin) {
                        Some(bin)
                    } else {
                        best
                    }
                })?;
            // Between the bins, over the true times of the rows: the stretches are not on one clock.
            let whitened = bench.whitened_in_time(axis, &left[axis], bin);
            let span_s = match &streams.pieces[0].origin {
                Some(origin) => origin.seconds,
                None => streams.end_s() - streams.start_s,
            };
            let around = portion.frequency_hz(bin);
            let since_start_s = |row: usize| streams.clock_s(row);
            // A line jumps in phase from stretch to stretch: its strongest bin lies as far away as one stretch
            // alone would tell it.
            let stretch_s = portion.seconds() / portion.ranges.len() as f64;
            let width = 2.0 / stretch_s;
            let tone = Tone::new(&whitened, around, width, since_start_s);
            let best = |around: f64, steps: usize, spacing: f64| {
                let first_hz = around - steps as f64 * spacing;
                let ratios = tone.ratios(first_hz, spacing, 2 * steps + 1).into_iter();
                ratios
                    .enumerate()
                    .map(|(k, ratio)| (first_hz + k as f64 * spacing, ratio))
                    .filter(|(frequency_hz, _)| *frequency_hz > from_hz)
                    .max_by(|a, b| a.1.total_cmp(&b.1))
            };
            // A tenth of the resolution, then a tenth of that: so well is a line of a thousand deviations known.
            let spacing = 0.1 / span_s;
            let (coarse_hz, _) = best(around, (width / spacing) as usize, spacing)?;
            let (frequency_hz, ratio) = best(coarse_hz, 10, 0.1 * spacing)?;
            let chance = (-0.5 * ratio).exp();
            // About three independent frequencies a bin once gaps are inside.
            let trials = 3.0 * 3.0 * to_hz * span_s;
            let p_value = -(trials * (-chance).ln_1p()).exp_m1();
            Some(["sine", "cosine"].map(|shape| Event {
                term: Term {
                    axis,
                    form: Form::Product {
                        expression: format!("{shape}({frequency_hz:.5})"),
                    },
                },
                ratio,
                p_value,
            }))
        })
        .collect()
}

pub(super) fn event(term: Term, ratio: f64, trials: f64) -> Event {
    let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
    Event {
        term,
        ratio,
        p_value: -(trials * (-chance).ln_1p()).exp_m1(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stands_out_of_a_residue_and_its_own_peaks_do_not() {
        // What is left of a randomised dither: as strong everywhere, up to seven times here and there.
        let mut power: Vec<f64> = (0..400).map(|bin| 50.0 * f64::from(1 + bin % 7)).collect();
        assert!((0..400).all(|bin| !stands_out(&power, bin, 100)));
        power[200] = 5000.0;
        power[201] = 2000.0;
        assert!(stands_out(&power, 200, 100) && !stands_out(&power, 150, 100));
    }
}
