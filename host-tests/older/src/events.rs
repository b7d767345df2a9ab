//! Patterns in time: a slip of a gyro's counter, a steady line. (Steps of its bias: steps.rs.)
//!
//! Enters: what is left of each gyro's residual after the chosen effects, in bins. Leaves: the best slip and the best
//! line with their likelihood ratio and chance, every instant and frequency counted as a trial.
//!
//! A slip is one impulse in the increments, so its matched filter is the residual divided by S, brought
//! back to time.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

use super::bursts::Matched;
use super::empirical::{Form, Term};
use super::information::stable_inverse;
use super::portion::{Bins, Portion};
use super::qualify;
use super::scene::Scene;
use super::streams::Streams;
use super::tone::Tone;
use super::workbench::Workbench;

/// Rows next to a joint in which a slip cannot be told from the joint's own free jump.
const JOINT_GUARD_ROWS: usize = 40;

/// Pulses of the smallest slip: they are counted whole, and one alone may be a counter's quantisation.
const LEAST_PULSES: f64 = 1.5;

/// The same where a dither carries each reading over many pulses: what is left of quantisation there is noise.
const LEAST_PULSES_DITHERED: f64 = 0.6;

/// One that comes in with a clearer one is beyond chance by this (2 Δ ln L): a million rows reach thirty.
const FURTHER: f64 = 60.0;

/// More at once are no slips.
const MOST_AT_ONCE: usize = 32;

/// A ratio that no recording takes for a slip: such ones are not worth a look at the channel's values.
const UNLIKELY: f64 = 20.0;

/// The pulse of a gyro \[rad\], as the model says it behind a dither and as its values show it without one.
pub(super) fn coarsest_rad(streams: &Streams, axis: usize) -> f64 {
    match streams.pickoff_rad {
        Some(_) => streams.pulse_rad[axis],
        None => qualify::pulse(&streams.sensed_rad[axis]),
    }
}

/// Pulses of a gyro's smallest event.
pub(super) fn least_pulses(streams: &Streams, axis: usize) -> f64 {
    /// Pulses that a dither goes through in a row, at least.
    const MANY: f64 = 4.0;
    let pickoff = streams.pickoff_rad.as_ref().map(|pickoff| &pickoff[axis]);
    let is_dithered = pickoff.is_some_and(|pickoff| {
        let turns = pickoff.windows(2).map(|two| (two[1] - two[0]).abs());
        let rows = streams.rows as f64;
        turns.filter(|turn| turn.is_finite()).sum::<f64>() > MANY * streams.pulse_rad[axis] * rows
    });
    match is_dithered {
        true => LEAST_PULSES_DITHERED,
        false => LEAST_PULSES,
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

impl Event {
    /// Whether a slip is so clear that it may come in with a clearer one.
    fn is_further(&self) -> bool {
        self.ratio > FURTHER
    }
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

/// Those of `slips` that are news and so clear that they may come in with a clearer one.
pub fn further(slips: &[Event], is_news: impl Fn(&Event) -> bool) -> Vec<Event> {
    let clear = slips.iter().filter(|slip| slip.is_further());
    clear.filter(|slip| is_news(slip)).cloned().collect()
}

/// The best slip on each gyro, and behind it those that stand out of what is left beside the ones before.
pub fn slips(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let each = (0..3_usize).into_par_iter();
    each.flat_map_iter(|axis| slips_of(bench, &left[axis], axis))
        .collect()
}

fn slips_of(bench: &Workbench, left: &Bins, axis: usize) -> Vec<Event> {
    let portion = &bench.portion;
    let streams = &bench.scene().streams;
    let Some(matched) = Matched::new(bench, axis, left) else {
        return Vec::new();
    };
    let guarded = guarded(portion).flat_map(|(places, offset)| {
        places.map(move |place| (place, (place as i64 + offset) as usize))
    });
    let guarded: Vec<(usize, usize)> = guarded.collect();
    let least_pulses = least_pulses(streams, axis);
    let mut events = Vec::new();
    let mut found = Impulses::default();
    while events.len() < MOST_AT_ONCE {
        let seen = |place: usize| matched.row(place) - found.seen_at(&matched, place);
        let Some((place, row, seen)) = guarded
            .iter()
            .map(|&(place, row)| (place, row, seen(place)))
            .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
        else {
            break;
        };
        // A counter that loses or gains anything loses or gains pulses.
        let size_rad = seen / matched.own(1);
        let alone = size_rad * seen;
        // A rate that lasts for a while is no slip, though the filter is large wherever it lasts.
        let ratio = match alone < UNLIKELY {
            true => alone,
            false => alone.min(matched.beside_a_burst(place)),
        };
        let pulse_rad = match ratio < UNLIKELY {
            true => streams.pulse_rad[axis],
            false => coarsest_rad(streams, axis),
        };
        let time_s = streams.middle_s(row);
        let form = Form::Slip { time_s };
        let slip = event(Term { axis, form }, ratio, 3.0 * portion.rows() as f64);
        let stands_out = events.is_empty() || slip.is_further();
        if size_rad.abs() < least_pulses * pulse_rad || !stands_out {
            break;
        }
        events.push(slip);
        found.add(&matched, place);
    }
    events
}

/// Slips of one gyro, fitted together.
#[derive(Default)]
struct Impulses {
    places: Vec<usize>,
    sizes_rad: DVector<f64>,
}

impl Impulses {
    /// What the matched filter shows of them at a place.
    fn seen_at(&self, matched: &Matched, place: usize) -> f64 {
        let shared = self
            .places
            .iter()
            .map(|one| matched.shared(one.abs_diff(place)));
        shared
            .zip(self.sizes_rad.iter())
            .map(|(shared, size)| shared * size)
            .sum()
    }

    fn add(&mut self, matched: &Matched, place: usize) {
        self.places.push(place);
        let (places, count) = (&self.places, self.places.len());
        let gram = DMatrix::from_fn(count, count, |a, b| {
            matched.shared(places[a].abs_diff(places[b]))
        });
        let seen = DVector::from_fn(count, |one, _| matched.row(places[one]));
        self.sizes_rad = stable_inverse(&gram) * seen;
    }
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
