//! Series of the report's pictures: thinned, ready to plot.
//!
//! Enters: residual before and after, noise, tiles. Leaves: [`Pictures`], SI units, a few thousand points.

use std::ops::Range;

use super::locate::Tile;
use super::noise_spectrum::Noise;
use rlg_plan::TilePlan;
use rlg_signal::streams::{Streams, Triad};
use rlg_signal::transforms::{even_smooth_length, mean_periodogram};

/// Number of points of an integrated angle.
const ANGLE_POINTS: usize = 1500;

/// Frequencies per decade of a spectrum.
const PER_DECADE: f64 = 24.0;

/// Pieces of the averaged spectrum \[s\]: resolves a tenth of a hertz.
const PIECE_S: f64 = 10.0;

/// All pictures of one diagnosis, `[gyro]`.
pub struct Pictures {
    /// Time \[s\] of the angle points.
    pub time_s: Vec<f64>,
    /// Integrated residual \[rad\] without the found effects.
    pub angle_before_rad: Triad,
    /// Integrated residual \[rad\] with them.
    pub angle_after_rad: Triad,
    /// Frequencies \[Hz\] of the spectra.
    pub frequency_hz: Vec<f64>,
    /// Residual power \[(rad/s)²/Hz\] without the found effects.
    pub power_before: Triad,
    /// Residual power with them.
    pub power_after: Triad,
    /// Power of the noise model.
    pub power_noise: Triad,
    /// Tiles before.
    pub tiles_before: Vec<Tile>,
    /// Tiles after.
    pub tiles_after: Vec<Tile>,
    /// p-value, tiles counted, below which a tile is significant.
    pub significance: f64,
    /// Begin and end of held-out stretches \[s\].
    pub held_out_s: Vec<[f64; 2]>,
    /// Rows per second \[Hz\] and begin \[s\], to place tiles in time.
    pub rate_hz: f64,
    /// See `rate_hz`.
    pub start_s: f64,
}

/// Returns a residual without that of unmeasured and faulty rows, which have none.
fn measured(residual_rad: &Triad, streams: &Streams) -> Triad {
    let of_row = |(value, is_usable): (&f64, &bool)| if *is_usable { *value } else { 0.0 };
    let of_axis = |values: &Vec<f64>| values.iter().zip(&streams.usable).map(of_row).collect();
    residual_rad.each_ref().map(of_axis)
}

/// Thins all series.
pub fn draw(
    streams: &Streams,
    before_rad: &Triad,
    after_rad: &Triad,
    noise: &[Noise; 3],
    (tiles, plan): ((Vec<Tile>, Vec<Tile>), &TilePlan),
    held_out: &[Range<usize>],
) -> Pictures {
    let [before_rad, after_rad] = [before_rad, after_rad].map(|triad| measured(triad, streams));
    let step = streams.rows.div_ceil(ANGLE_POINTS);
    let angle = |values: &Vec<f64>| {
        let mut sum = 0.0;
        values
            .iter()
            .map(|value| {
                sum += value;
                sum
            })
            .step_by(step)
            .collect::<Vec<f64>>()
    };
    let rate_hz = streams.rate_hz;
    let piece = even_smooth_length(((PIECE_S * rate_hz) as usize).min(streams.rows / 2).max(2))
        .min(streams.rows & !1);
    let bin_hz = rate_hz / piece as f64;
    // One-sided density of a rate: increments' power per row × 2 / fs × fs².
    let density = 2.0 * rate_hz;
    let edges: Vec<f64> = {
        let decades = (rate_hz / 2.0 / bin_hz).log10();
        let count = (decades * PER_DECADE).ceil() as usize;
        (0..=count)
            .map(|k| bin_hz * 10f64.powf(decades * k as f64 / count as f64))
            .collect()
    };
    let groups: Vec<Range<usize>> = edges
        .windows(2)
        .map(|pair| (pair[0] / bin_hz).round() as usize..(pair[1] / bin_hz).round() as usize)
        .filter(|range| !range.is_empty())
        .collect();
    let spectrum = |values: &Vec<f64>| {
        let power = mean_periodogram(values, piece);
        groups
            .iter()
            .map(|bins| density * power[bins.clone()].iter().sum::<f64>() / bins.len() as f64)
            .collect::<Vec<f64>>()
    };
    let frequency_hz: Vec<f64> = groups
        .iter()
        .map(|bins| 0.5 * (bins.start + bins.end - 1) as f64 * bin_hz)
        .collect();
    let all = |triad: &Triad, of: &dyn Fn(&Vec<f64>) -> Vec<f64>| {
        [0, 1, 2].map(|axis: usize| of(&triad[axis]))
    };
    Pictures {
        time_s: (0..streams.rows)
            .step_by(step)
            .map(|row| streams.middle_s(row))
            .collect(),
        angle_before_rad: all(&before_rad, &angle),
        angle_after_rad: all(&after_rad, &angle),
        power_before: all(&before_rad, &spectrum),
        power_after: all(&after_rad, &spectrum),
        power_noise: [0, 1, 2].map(|axis: usize| {
            frequency_hz
                .iter()
                .map(|f| density * noise[axis].at(*f, bin_hz))
                .collect()
        }),
        frequency_hz,
        tiles_before: tiles.0,
        tiles_after: tiles.1,
        significance: plan.significance,
        held_out_s: held_out
            .iter()
            .map(|rows| [rows.start, rows.end].map(|row| streams.start_s + row as f64 / rate_hz))
            .collect(),
        rate_hz,
        start_s: streams.start_s,
    }
}
