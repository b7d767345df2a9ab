//! Patterns in time: a step of a gyro's bias, a slip of its counter, a steady line.
//!
//! Enters: what is left of each gyro's residual after the chosen effects, in bins. Leaves: the best step and
//! the best slip with their likelihood ratio and chance, every instant counted as a trial.
//!
//! A slip is one impulse in the increments, so its matched filter is the residual divided by S, brought
//! back to time. A step has its power at low frequency, where it is scanned on a grid and then refined.

use nalgebra::{DMatrix, DVector};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{SQRT_2, TAU};

use super::empirical::{Form, Term};
use super::information::stable_inverse;
use super::portion::Bins;
use super::qualify;
use super::tone::Tone;
use super::workbench::Workbench;

/// A step's power above this frequency is lost in white angle noise.
const STEP_BAND_HZ: f64 = 40.0;

/// Spacing of the first scan for steps \[s\]; the statistic is smooth over a few tenths of a second.
const STEP_GRID_S: f64 = 0.25;

/// Spacing after refinement \[s\].
const STEP_FINE_S: f64 = 0.01;

/// Rows next to a joint in which a slip cannot be told from the joint's own free jump.
const JOINT_GUARD_ROWS: usize = 40;

/// Pulses of the smallest slip.
const LEAST_PULSES: f64 = 1.5;

/// A ratio that no recording takes for a slip: such ones are not worth a look at the channel's values.
const UNLIKELY: f64 = 20.0;

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

/// The best slip on each gyro.
pub fn slips(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let portion = &bench.portion;
    let rows = portion.rows();
    let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(rows);
    let streams = &bench.scene().streams;
    (0..3)
        .filter_map(|axis| {
            let weights = bench.noise[axis].weights(portion);
            let last = weights.len() - 1;
            let mut bins: Vec<Complex64> = left[axis]
                .iter()
                .zip(&weights)
                .enumerate()
                .map(|(bin, (value, weight))| {
                    value * *weight / if bin == 0 || bin == last { 1.0 } else { SQRT_2 }
                })
                .collect();
            bins[0].im = 0.0;
            bins[last].im = 0.0;
            let mut filtered = inverse.make_output_vec();
            inverse.process(&mut bins, &mut filtered).ok()?;
            let scale = 1.0 / (rows as f64).sqrt();
            let own: f64 = weights
                .iter()
                .enumerate()
                .map(|(bin, w)| w * portion.degrees(bin))
                .sum::<f64>()
                / rows as f64;
            let guarded = portion.ranges.iter().flat_map({
                let mut first = 0;
                move |range| {
                    let places = first + JOINT_GUARD_ROWS
                        ..(first + range.len()).saturating_sub(JOINT_GUARD_ROWS);
                    let offset = range.start as i64 - first as i64;
                    first += range.len();
                    places.map(move |place| (place, (place as i64 + offset) as usize))
                }
            });
            let (place, row) =
                guarded.max_by(|a, b| filtered[a.0].abs().total_cmp(&filtered[b.0].abs()))?;
            // A counter that loses or gains anything loses or gains pulses; one alone is its quantisation.
            let size_rad = filtered[place] * scale / own;
            let ratio = (filtered[place] * scale).powi(2) / own;
            let dithered = streams.pickoff_rad.is_some();
            let pulse_rad = if dithered || ratio < UNLIKELY {
                streams.pulse_rad[axis]
            } else {
                qualify::pulse(&streams.sensed_rad[axis])
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

/// The best step on each gyro, beside a free constant.
pub fn steps(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let portion = &bench.portion;
    let streams = &bench.scene().streams;
    let bins = (1..portion.bins())
        .take_while(|&bin| portion.frequency_hz(bin) < STEP_BAND_HZ)
        .count()
        + 1;
    // Where each stretch begins in the joined series, to turn times into places.
    let mut first = 0;
    let begins: Vec<(usize, std::ops::Range<usize>)> = portion
        .ranges
        .iter()
        .map(|range| {
            let begin = first;
            first += range.len();
            (begin, range.clone())
        })
        .collect();
    let place = |row: usize| {
        begins
            .iter()
            .find(|(_, range)| row < range.end)
            .map_or(portion.rows(), |(begin, range)| {
                begin + row.saturating_sub(range.start)
            })
    };
    let shape = StepShape::new(portion.rows(), bins);
    // A step lasts until its recording ends.
    let step_at = |time_s: f64| {
        let row = streams.row_at(time_s);
        let mut step = shape.bins(place(row));
        let end = place(streams.end_of_recording(row));
        if end < portion.rows() {
            let beyond = shape.bins(end);
            step.iter_mut()
                .zip(beyond)
                .for_each(|(step, beyond)| *step -= beyond);
        }
        step
    };
    let nuisance: Vec<Bins> = std::iter::once(shape.bins(0))
        .chain(
            begins
                .iter()
                .map(|(begin, _)| impulse_bins(portion.rows(), *begin, bins)),
        )
        .collect();
    (0..3)
        .filter_map(|axis| {
            let weights = &bench.noise[axis].weights(portion)[..bins];
            let product = |a: &[Complex64], b: &[Complex64]| super::portion::inner(a, b, weights);
            let scale: Vec<f64> = nuisance
                .iter()
                .map(|column| product(column, column).sqrt().recip())
                .collect();
            let gram = DMatrix::from_fn(nuisance.len(), nuisance.len(), |a, b| {
                product(&nuisance[a], &nuisance[b]) * scale[a] * scale[b]
            });
            let inverse = stable_inverse(&gram);
            let residual = &left[axis][..bins];
            let against = DVector::from_fn(nuisance.len(), |a, _| {
                product(&nuisance[a], residual) * scale[a]
            });
            let fitted = &inverse * against;
            let ratio_at = |time_s: f64| {
                let column = step_at(time_s);
                let cross = DVector::from_fn(nuisance.len(), |a, _| {
                    product(&nuisance[a], &column) * scale[a]
                });
                let own = product(&column, &column);
                let free = own - cross.dot(&(&inverse * &cross));
                if free <= 1e-3 * own {
                    return 0.0;
                }
                (product(&column, residual) - cross.dot(&fitted)).powi(2) / free
            };
            let scan = |from_s: f64, to_s: f64, spacing_s: f64| {
                let count = ((to_s - from_s) / spacing_s).floor().max(0.0) as usize;
                (0..=count)
                    .map(|k| from_s + k as f64 * spacing_s)
                    .map(|time_s| (time_s, ratio_at(time_s)))
                    .max_by(|a, b| a.1.total_cmp(&b.1))
            };
            let (coarse_s, _) = scan(streams.start_s + 1.0, streams.end_s() - 1.0, STEP_GRID_S)?;
            let (time_s, ratio) =
                scan(coarse_s - STEP_GRID_S, coarse_s + STEP_GRID_S, STEP_FINE_S)?;
            let trials = 3.0 * portion.seconds() / STEP_GRID_S;
            Some(event(
                Term {
                    axis,
                    form: Form::Step { time_s },
                },
                ratio,
                trials,
            ))
        })
        .collect()
}

/// Highest frequency at which a steady line is looked for \[Hz\]: above it the dither and its residue live,
/// which are no lines because the dither's amplitude is randomised.
const LINE_BAND_HZ: f64 = 150.0;

/// The best steady line on each gyro: its sine, and its cosine with the same statistic.
pub fn lines(bench: &Workbench, left: &[Bins; 3]) -> Vec<[Event; 2]> {
    let portion = &bench.portion;
    let streams = &bench.scene().streams;
    let (from_hz, to_hz) = (2.0 / portion.seconds(), LINE_BAND_HZ);
    (0..3)
        .filter_map(|axis| {
            let weights = bench.noise[axis].weights(portion);
            let (bin, _) = (1..portion.bins())
                .take_while(|&bin| portion.frequency_hz(bin) < to_hz)
                .filter(|&bin| portion.frequency_hz(bin) > from_hz)
                .map(|bin| (bin, left[axis][bin].norm_sqr() * weights[bin]))
                .max_by(|a, b| a.1.total_cmp(&b.1))?;
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
            let best = |around: f64, steps: i32, spacing: f64| {
                (-steps..=steps)
                    .map(|k| around + f64::from(k) * spacing)
                    .filter(|frequency_hz| *frequency_hz > from_hz)
                    .map(|frequency_hz| (frequency_hz, tone.ratio(frequency_hz)))
                    .max_by(|a, b| a.1.total_cmp(&b.1))
            };
            // A tenth of the resolution, then a tenth of that: so well is a line of a thousand deviations known.
            let spacing = 0.1 / span_s;
            let (coarse_hz, _) = best(around, (width / spacing) as i32, spacing)?;
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

fn event(term: Term, ratio: f64, trials: f64) -> Event {
    let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
    Event {
        term,
        ratio,
        p_value: -(trials * (-chance).ln_1p()).exp_m1(),
    }
}

/// Low bins of a series that is 1 from a place on, in closed form.
struct StepShape {
    rows: usize,
    /// √2/((1 − e^(−2πi bin/rows)) √rows) of each bin but the lowest.
    sums: Bins,
}

impl StepShape {
    fn new(rows: usize, bins: usize) -> Self {
        let scale = (2.0 / rows as f64).sqrt();
        let sum = |bin: usize| {
            let turn = Complex64::cis(-TAU * bin as f64 / rows as f64);
            scale / (Complex64::new(1.0, 0.0) - turn)
        };
        Self {
            rows,
            sums: (1..bins).map(sum).collect(),
        }
    }

    fn bins(&self, place: usize) -> Bins {
        let mean = (self.rows - place) as f64 / (self.rows as f64).sqrt();
        // One turn a bin; over a few thousand bins the product stays exact to 1e-12.
        let turn = Complex64::cis(-TAU * place as f64 / self.rows as f64);
        let mut from = Complex64::new(1.0, 0.0);
        let rest = self.sums.iter().map(|sum| {
            from *= turn;
            (from - 1.0) * sum
        });
        std::iter::once(Complex64::new(mean, 0.0))
            .chain(rest)
            .collect()
    }
}

/// Low bins of a series that is 1 at `place` alone.
fn impulse_bins(rows: usize, place: usize, bins: usize) -> Bins {
    let scale = 1.0 / (rows as f64).sqrt();
    (0..bins)
        .map(|bin| {
            let weight = if bin == 0 { scale } else { scale * SQRT_2 };
            Complex64::from_polar(weight, -TAU * (bin * place) as f64 / rows as f64)
        })
        .collect()
}
