//! Page `navigation.html`: attitude and velocity of a navigator, before and after, on the same axes.
//!
//! From [`Navigation`], trajectories in rad and m/s, one HTML file without scripts or external content, in degrees, arcsec
//! and m/s: the paper's Fig. 6 to 9.
//!
//! Curves are smoothed by a window of a second or more, so that a vibration does not hide the remaining drift.

use maud::{Markup, html};
use plotters::prelude::*;

use super::plot::{AFTER, Axes, BEFORE, Drawn, FINE, builder, frame, plot, range, swatch};
use super::words::{ARCSEC_PER_RAD, number};
use rlg_replay::navigate::figures::TrajectoryFigures;
use rlg_replay::navigate::{Readings, Trajectory};

/// Height of a curve \[page pixels\].
const HEIGHT: u32 = 250;

/// Largest number of points of a curve: a plot has no more pixels across.
const POINTS: usize = 460;

/// Least width of the window \[s\]: a Hann window attenuates the paper's vibration of 15 Hz to 3e-4.
const WINDOW_S: f64 = 1.0;

/// Content of the page.
pub struct Navigation<'a> {
    /// Name of the recording.
    pub recording: &'a str,
    /// Increments of the navigation.
    pub readings: &'a Readings,
    /// Navigation without the dynamic terms, if the model has any.
    pub before: Option<(&'a Trajectory, &'a TrajectoryFigures)>,
    /// Navigation with the dynamic terms.
    pub after: (&'a Trajectory, &'a TrajectoryFigures),
    /// `navigation.json` verbatim.
    pub json: &'a str,
}

/// The whole page.
pub fn page(navigation: &Navigation) -> String {
    let title = format!("{}: navigation", navigation.recording);
    let with_reference = navigation.after.0.attitude_error_rad.is_some();
    let main = html! {
            header {
                p.kicker { "Effect on navigation" }
                h1 { (navigation.recording) }
                p.lead { (sentence(navigation)) }
            }
            (legend(navigation.before.is_some()))
            section {
                h2 { "Attitude" }
                p.note { "Change since the alignment, smoothed over "
                    (number(navigation.window_s())) " s, as all curves are." }
                div.pair {
                    (attitude(navigation, "Pitch", 1))
                    (attitude(navigation, "Roll", 0))
                    (attitude(navigation, "Heading", 2))
                }
            }
            @if with_reference {
                section {
                    h2 { "Attitude against the reference" }
                    p.note { "Motion removed: error added by the gyros." }
                    div.pair {
                        (attitude_error(navigation, "north", 0))
                        (attitude_error(navigation, "east", 1))
                        (attitude_error(navigation, "down", 2))
                    }
                }
            }
            section {
                h2 { "Velocity" }
                p.note { "The unit did not travel: all velocity is error." }
                div.pair {
                    (velocity(navigation, "East", 1))
                    (velocity(navigation, "North", 0))
                }
            }
            section.data {
                details {
                    summary { "All numbers (navigation.json)" }
                    pre { (navigation.json) }
                }
            }
    };
    super::document(&title, &main)
}

fn sentence(navigation: &Navigation) -> String {
    let largest = |figures: &TrajectoryFigures| {
        let [north, east] = figures.max_velocity_m_s;
        format!("{} m/s north and {} m/s east", number(north), number(east))
    };
    let after = largest(navigation.after.1);
    match navigation.before {
        Some((_, before)) => format!(
            "Velocity error up to {} without the dynamic terms, up to {after} with them.",
            largest(before)
        ),
        None => format!("Velocity error up to {after}."),
    }
}

fn legend(both: bool) -> Markup {
    html! {
        p.legend {
            @if both {
                span.key { (swatch("#D55E00", "none", "1.5")) "before: static installation alone" }
                span.key { (swatch("#0072B2", "none", "2.5")) "after: with the dynamic terms" }
            } @else {
                span.key { (swatch("#0072B2", "none", "2.5")) "as compensated: the model has no dynamic term" }
            }
        }
    }
}

fn attitude(navigation: &Navigation, name: &str, angle: usize) -> Markup {
    let values = |trajectory: &Trajectory| -> Vec<f64> {
        let changes = trajectory.attitude_change_rad();
        changes.map(|change| change[angle].to_degrees()).collect()
    };
    curve(navigation, name, "change [°]", &values)
}

fn attitude_error(navigation: &Navigation, name: &str, axis: usize) -> Markup {
    let values = |trajectory: &Trajectory| -> Vec<f64> {
        let errors = trajectory.attitude_error_rad.iter().flatten();
        errors.map(|error| error[axis] * ARCSEC_PER_RAD).collect()
    };
    curve(navigation, &format!("About {name}"), "error [″]", &values)
}

fn velocity(navigation: &Navigation, name: &str, axis: usize) -> Markup {
    let values = |trajectory: &Trajectory| -> Vec<f64> {
        trajectory
            .solutions
            .iter()
            .map(|s| s.velocity_m_s[axis])
            .collect()
    };
    curve(navigation, name, "velocity [m/s]", &values)
}

impl Navigation<'_> {
    /// Number of periods between two points.
    fn interval(&self) -> usize {
        self.after.0.solutions.len().div_ceil(POINTS).max(1)
    }

    /// Width of the window: at least two intervals, so that every sample contributes.
    fn window_s(&self) -> f64 {
        WINDOW_S.max(2.0 * self.interval() as f64 * self.readings.period_s)
    }

    /// Times \[s\] and smoothed values; no point if a value in the window is not finite.
    fn smoothed(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let period_s = self.readings.period_s;
        let begin_s = self.readings.start_s + self.after.0.first_period as f64 * period_s;
        let half = ((0.5 * self.window_s() / period_s).round() as usize).max(1);
        let points = (0..values.len()).step_by(self.interval());
        points
            .map(|middle| {
                let window = middle.saturating_sub(half)..(middle + half + 1).min(values.len());
                let (mut sum, mut weights) = (0.0, 0.0);
                for row in window {
                    let place = (row as f64 - middle as f64) / (half + 1) as f64;
                    let weight = 0.5 + 0.5 * (std::f64::consts::PI * place).cos();
                    sum += weight * values[row];
                    weights += weight;
                }
                (begin_s + (middle + 1) as f64 * period_s, sum / weights)
            })
            .filter(|(_, value)| value.is_finite())
            .collect()
    }
}

fn curve(
    navigation: &Navigation,
    name: &str,
    y_title: &str,
    values: &dyn Fn(&Trajectory) -> Vec<f64>,
) -> Markup {
    let before = navigation
        .before
        .map(|(trajectory, _)| navigation.smoothed(&values(trajectory)));
    let before = before.unwrap_or_default();
    let after = navigation.smoothed(&values(navigation.after.0));
    let label = format!("{name} {y_title} against time");
    let drawn = plot(&label, HEIGHT, |area| {
        let both = || before.iter().chain(&after);
        let y = range(both().map(|(_, value)| *value));
        let x = range(both().map(|(time_s, _)| *time_s));
        // the plotter computes a tick at zero as 1e-17
        let nothing = 1e-9 * (y.end - y.start);
        let mut chart = builder(area).build_cartesian_2d(x, y)?;
        let axes = Axes {
            x_title: "time [s]",
            y_title,
            x_number: &|time_s| number(*time_s),
            y_number: &|value| number(if value.abs() < nothing { 0.0 } else { *value }),
            y_count: 6,
        };
        frame(&mut chart, &axes)?;
        let mut line = |points: &[(f64, f64)], colour: RGBColor, width: u32| -> Drawn {
            let points = points.iter().copied();
            chart.draw_series(LineSeries::new(points, colour.stroke_width(width)))?;
            Ok(())
        };
        line(&before, BEFORE, FINE)?;
        line(&after, AFTER, FINE * 3 / 2)
    });
    html! { figure { figcaption { (name) } (drawn) } }
}
