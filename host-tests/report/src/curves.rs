//! Plots the residual against time and against frequency, before and after.
//!
//! [`Pictures`] hold the integrated residual \[rad\] and the one-sided power of the residual rate \[(rad/s)²/Hz\];
//! plots show arcsec over s, and °/h/√Hz over Hz.

use maud::Markup;
use plotters::prelude::*;

use super::plot::{AFTER, Axes, BEFORE, Drawn, FINE, HELD_OUT, INK, builder, decades, frame};
use super::plot::{ends, plot, range};
use super::words::{ARCSEC_PER_RAD, DEG_H_PER_RAD_S, number, superscript};
use rlg_diagnosis::pictures::Pictures;
use rlg_recording::AXES;

/// Height of a curve \[page pixels\].
const HEIGHT: u32 = 290;

/// The integrated residual of a gyro; `both` also draws it without the found effects.
pub fn angle(pictures: &Pictures, axis: usize, both: bool) -> Markup {
    let label = format!(
        "Integrated residual angle of gyro {} against time",
        AXES[axis]
    );
    plot(&label, HEIGHT, |area| {
        let before = arcsec(&pictures.angle_before_rad[axis]);
        let after = arcsec(&pictures.angle_after_rad[axis]);
        let shown = after.iter().chain(before.iter().filter(|_| both));
        let y = range(shown.copied());
        let x = time_range(pictures);
        let mut chart = builder(area).build_cartesian_2d(x, y.clone())?;
        chart.draw_series(pictures.held_out_s.iter().map(|[begin, end]| {
            Rectangle::new([(*begin, y.start), (*end, y.end)], HELD_OUT.filled())
        }))?;
        let axes = Axes {
            x_title: "time [s]",
            y_title: "residual angle [″]",
            x_number: &|time_s| number(*time_s),
            y_number: &|angle| number(*angle),
            y_count: 6,
        };
        frame(&mut chart, &axes)?;
        let mut line = |values: &[f64], colour: RGBColor, width: u32| -> Drawn {
            let points = pictures.time_s.iter().zip(values);
            let points = points.map(|(x, y)| (*x, *y)).filter(|(_, y)| y.is_finite());
            chart.draw_series(LineSeries::new(points, colour.stroke_width(width)))?;
            Ok(())
        };
        if both {
            line(&before, BEFORE, FINE)?;
        }
        line(&after, AFTER, FINE * 3 / 2)
    })
}

/// The spectrum of a gyro's residual against its noise model.
pub fn spectrum(pictures: &Pictures, axis: usize, both: bool) -> Markup {
    let label = format!(
        "Spectrum of the residual rate of gyro {} against the noise model",
        AXES[axis]
    );
    plot(&label, HEIGHT, |area| {
        let before = deg_h_sqrt_hz(&pictures.power_before[axis]);
        let after = deg_h_sqrt_hz(&pictures.power_after[axis]);
        let noise = deg_h_sqrt_hz(&pictures.power_noise[axis]);
        let shown = after
            .iter()
            .chain(&noise)
            .chain(before.iter().filter(|_| both));
        let y = decades(shown.copied());
        let frequencies = pictures.frequency_hz.iter().copied();
        let (low, high) = ends(frequencies.filter(|f| *f > 0.0)).unwrap_or((1.0, 10.0));
        let x = low..high.max(2.0 * low);
        let mut chart = builder(area).build_cartesian_2d(x.log_scale(), y.log_scale())?;
        let axes = Axes {
            x_title: "frequency [Hz]",
            y_title: "residual [°/h/√Hz]",
            x_number: &power_of_ten,
            y_number: &power_of_ten,
            y_count: 6,
        };
        frame(&mut chart, &axes)?;
        let points = |values: &[f64]| -> Vec<(f64, f64)> {
            let points = pictures.frequency_hz.iter().zip(values);
            points
                .map(|(x, y)| (*x, *y))
                .filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite())
                .collect()
        };
        if both {
            let style = BEFORE.stroke_width(FINE);
            chart.draw_series(LineSeries::new(points(&before), style))?;
        }
        let style = AFTER.stroke_width(FINE * 3 / 2);
        chart.draw_series(LineSeries::new(points(&after), style))?;
        let (dash, gap) = (6 * FINE, 4 * FINE);
        let style = INK.stroke_width(FINE * 3 / 2);
        let dashes = DashedLineSeries::new(points(&noise), dash, gap, style);
        chart.draw_series(dashes)?;
        Ok(())
    })
}

/// From the first to the last moment drawn \[s\].
pub fn time_range(pictures: &Pictures) -> std::ops::Range<f64> {
    match (pictures.time_s.first(), pictures.time_s.last()) {
        (Some(first), Some(last)) if last > first => {
            // A row dropped before the first must not cost the axis its first number.
            let near = (first - first.round()).abs() < 0.01 * (last - first);
            (if near { first.round() } else { *first })..*last
        }
        _ => 0.0..1.0,
    }
}

/// Angles in arcseconds.
pub fn arcsec(angle_rad: &[f64]) -> Vec<f64> {
    angle_rad
        .iter()
        .map(|angle| angle * ARCSEC_PER_RAD)
        .collect()
}

fn deg_h_sqrt_hz(power: &[f64]) -> Vec<f64> {
    power
        .iter()
        .map(|power| power.sqrt() * DEG_H_PER_RAD_S)
        .collect()
}

fn power_of_ten(value: &f64) -> String {
    let power = value.log10().round() as i32;
    match power {
        -1..=3 => number(*value),
        other => format!("10{}", superscript(other)),
    }
}
