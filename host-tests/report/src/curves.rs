//! Charts of a page: residual against time and frequency, Allan deviation, rates as recorded.
//!
//! [`Pictures`] hold the integrated residual \[rad\] and the one-sided power of the residual rate \[(rad/s)²/Hz\];
//! plots show arcsec over s, and °/h/√Hz over Hz.

use super::allan;
use super::beside::Beside;
use super::chart::{Chart, Ink, Line};
use super::words::{ARCSEC_PER_RAD, DEG_H_PER_RAD_S};
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::result::Diagnosis;
use rlg_recording::AXES;

/// Largest number of points of a line on the page: two per pixel of the widest plot.
const MOST_POINTS: usize = 1500;

/// Name of the line after the correction, with or without one before it.
fn after(both: bool) -> &'static str {
    if both {
        "after: with the effects found"
    } else {
        "residual"
    }
}

/// Lines before (if `both`) and after.
fn before_and_after(before: Vec<f64>, values: Vec<f64>, both: bool) -> Vec<Line> {
    let before = Line {
        name: "before: the model as given",
        ink: Ink::Before,
        values: before,
    };
    let after = Line {
        name: after(both),
        ink: Ink::After,
        values,
    };
    both.then_some(before).into_iter().chain([after]).collect()
}

/// Integrated residual of each gyro \[″\]; `both` also shows it without the found effects.
pub fn angles(pictures: &Pictures, both: bool) -> Vec<Chart> {
    let step = pictures.time_s.len().div_ceil(MOST_POINTS).max(1);
    let thinned = |values: &[f64]| values.iter().step_by(step).copied().collect::<Vec<f64>>();
    let each = AXES.iter().enumerate().map(|(axis, name)| Chart {
        id: format!("residual-angle-{name}"),
        group: "time",
        title: format!("Gyro {name}: measured less predicted angle"),
        x_title: "time [s]",
        y_title: "residual angle [″]",
        logarithmic: false,
        x: thinned(&pictures.time_s),
        lines: before_and_after(
            arcsec(&thinned(&pictures.angle_before_rad[axis])),
            arcsec(&thinned(&pictures.angle_after_rad[axis])),
            both,
        ),
        stretches: pictures.held_out_s.clone(),
        envelope: false,
    });
    each.collect()
}

/// Spectrum of each gyro's residual \[°/h/√Hz\] against its noise model.
pub fn spectra(pictures: &Pictures, both: bool) -> Vec<Chart> {
    let first = pictures.frequency_hz.iter().position(|f| *f > 0.0);
    let first = first.unwrap_or(pictures.frequency_hz.len());
    let of = |power: &[f64]| deg_h_sqrt_hz(power.get(first..).unwrap_or_default());
    let each = AXES.iter().enumerate().map(|(axis, name)| {
        let mut lines = before_and_after(
            of(&pictures.power_before[axis]),
            of(&pictures.power_after[axis]),
            both,
        );
        lines.push(Line {
            name: "noise model",
            ink: Ink::Model,
            values: of(&pictures.power_noise[axis]),
        });
        Chart {
            id: format!("residual-spectrum-{name}"),
            group: "frequency",
            title: format!("Gyro {name}: spectrum of the residual"),
            x_title: "frequency [Hz]",
            y_title: "residual [°/h/√Hz]",
            logarithmic: true,
            x: pictures.frequency_hz[first..].to_vec(),
            lines,
            stretches: Vec::new(),
            envelope: false,
        }
    });
    each.collect()
}

/// Allan deviation of each gyro \[°/h\]: of the recorded rate, of the residual, and of the estimated noise.
pub fn allan_deviations(
    diagnosis: &Diagnosis,
    pictures: Option<&Pictures>,
    beside: &Beside,
) -> Vec<Chart> {
    let each = AXES.iter().enumerate().filter_map(|(axis, name)| {
        let data = beside.rates.get(axis).map(|rate| rate.allan.clone());
        let residual = pictures.and_then(|pictures| {
            let angle = pictures.angle_after_rad[axis].clone();
            Some(allan::deviation(
                &[angle],
                allan::period_s(&pictures.time_s)?,
            ))
        });
        let channel = format!("gyro_{name}");
        let noise = diagnosis.noise.iter().find(|one| one.channel == channel);
        let known = [
            (data, "as recorded", Ink::Before),
            (residual, "residual", Ink::After),
        ];
        let known: Vec<_> = known
            .into_iter()
            .filter_map(|(curve, name, ink)| Some((curve?, name, ink)))
            .collect();
        let mut x: Vec<f64> = known
            .iter()
            .flat_map(|(curve, ..)| curve.iter().map(|p| p.0))
            .collect();
        x.sort_by(f64::total_cmp);
        x.dedup();
        if x.is_empty() {
            return None;
        }
        let mut lines: Vec<Line> = known
            .iter()
            .map(|(curve, name, ink)| Line {
                name,
                ink: *ink,
                values: at(curve, &x),
            })
            .collect();
        lines.extend(noise.map(|noise| {
            Line {
                name: "noise model",
                ink: Ink::Model,
                values: x
                    .iter()
                    .map(|tau_s| allan::of_model(noise, *tau_s) * DEG_H_PER_RAD_S)
                    .collect(),
            }
        }));
        Some(Chart {
            id: format!("allan-deviation-{name}"),
            group: "averaging",
            title: format!("Gyro {name}: Allan deviation"),
            x_title: "averaging time [s]",
            y_title: "Allan deviation [°/h]",
            logarithmic: true,
            x,
            lines,
            stretches: Vec::new(),
            envelope: false,
        })
    });
    each.collect()
}

/// Values of a curve \[°/h\] at `x`, NaN without a point.
fn at(curve: &[(f64, f64)], x: &[f64]) -> Vec<f64> {
    let value = |x: &f64| {
        let place = curve.binary_search_by(|point| point.0.total_cmp(x)).ok();
        place.map_or(f64::NAN, |place| curve[place].1 * DEG_H_PER_RAD_S)
    };
    x.iter().map(value).collect()
}

/// Recorded rates \[°/s\], smallest and largest in each pixel column.
pub fn rates(pictures: Option<&Pictures>, beside: &Beside) -> Vec<Chart> {
    let each = beside.rates.iter().map(|rate| {
        let line = |name, values: &[f64]| Line {
            name,
            ink: Ink::After,
            values: values.iter().map(|rate| rate.to_degrees()).collect(),
        };
        Chart {
            id: format!("rate-{}", rate.axis),
            group: "time",
            title: format!("Gyro {}: rate as recorded", rate.axis),
            x_title: "time [s]",
            y_title: "rate [°/s]",
            logarithmic: false,
            x: rate.time_s.clone(),
            lines: vec![
                line("least", &rate.least_rad_s),
                line("most", &rate.most_rad_s),
            ],
            stretches: pictures.map_or_else(Vec::new, |pictures| pictures.held_out_s.clone()),
            envelope: true,
        }
    });
    each.collect()
}

/// Range of the drawn time \[s\].
pub fn time_range(pictures: &Pictures) -> std::ops::Range<f64> {
    match (pictures.time_s.first(), pictures.time_s.last()) {
        (Some(first), Some(last)) if last > first => {
            // An excluded first row should not remove the axis' first tick label.
            let near = (first - first.round()).abs() < 0.01 * (last - first);
            (if near { first.round() } else { *first })..*last
        }
        _ => 0.0..1.0,
    }
}

/// Converts angles to arcseconds.
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
