//! `residual.svg`: the integrated residual of the three gyros as one picture for a document.
//!
//! # Inputs
//! [`Diagnosis`] and, if there is a residual, [`Pictures`]; rad, s.
//!
//! # Returns
//! One SVG file with its own white background, readable on a light and on a dark page; arcsec over s, mean residual rates
//! in °/h.
//!
//! Its only words from a diagnosis are names of catalogue kinds and of the axes: it contains no text of a recording.

use maud::{PreEscaped, html};
use plotters::prelude::*;

use super::corrected;
use super::curves::{arcsec, time_range};
use super::plot::{
    AFTER, Area, Axes, BEFORE, Drawn, FINE, HELD_OUT, INK, builder, drawing, frame, range,
};
use super::words::{display_unit, number, plain, spaced, with_spread};
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::result::Diagnosis;
use rlg_recording::AXES;

/// Width of the picture \[page pixels\]: a README's column.
const WIDTH: u32 = 860;

/// Height of title and legend \[page pixels\].
const HEAD: u32 = 64;

/// Height of one gyro's panel with its heading and tick labels \[page pixels\].
const PANEL: u32 = 206;

/// Height of the title of the time axis, under the last panel \[page pixels\].
const FOOT: u32 = 26;

/// Height of the title \[page pixels\].
const TITLE: u32 = 19;

/// Height of the legend's words and the panels' headings \[page pixels\].
const WORDS: u32 = 16;

/// Margin on the left of the panels \[page pixels\].
const LEFT: i32 = 8;

/// Largest number of points of one line: more than the panel's pixels would only make the file larger.
const MOST_POINTS: usize = 500;

/// Number of kinds named in the legend; more are counted.
const NAMED: usize = 3;

/// Draws the picture; without a residual, it states so.
pub fn residuals(diagnosis: &Diagnosis, pictures: Option<&Pictures>) -> String {
    let height = if pictures.is_some() {
        HEAD + 3 * PANEL + FOOT
    } else {
        HEAD
    };
    let size = (WIDTH * FINE, height * FINE);
    let drawn = drawing(size, |area| match pictures {
        Some(pictures) => panels(area, diagnosis, pictures),
        None => write(
            area,
            (16, 22),
            TITLE,
            "No residual to draw: the recording cannot be used.",
        ),
    });
    let inner = drawn.unwrap_or_else(|problem| {
        html! { text x="64" y="128" font-size="64" { "This picture could not be drawn: " (problem) } }.into_string()
    });
    let label = "Integrated residual angle of the three gyros against time";
    html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(WIDTH) height=(height)
            viewBox=(format!("0 0 {} {}", size.0, size.1)) role="img" aria-label=(label) {
            rect width=(size.0) height=(size.1) fill="#FFFFFF" {}
            (PreEscaped(inner))
        }
    }
    .into_string()
}

fn panels(area: &Area, diagnosis: &Diagnosis, pictures: &Pictures) -> Drawn {
    let both = corrected(diagnosis);
    head(area, diagnosis, both)?;
    let (_, below) = area.split_vertically(HEAD * FINE);
    let (gyros, _) = below.split_vertically(3 * PANEL * FINE);
    for (axis, panel) in gyros.split_evenly((3, 1)).iter().enumerate() {
        write(
            panel,
            (LEFT + 66, 4),
            WORDS,
            &heading(diagnosis, axis, both),
        )?;
        let (_, plot) = panel.split_vertically(26 * FINE);
        residual(&plot, pictures, axis, both)?;
    }
    let end = i32::try_from(HEAD + 3 * PANEL)?;
    write(area, (LEFT + 428, end + 2), WORDS, "time [s]")
}

/// Title and legend.
fn head(area: &Area, diagnosis: &Diagnosis, both: bool) -> Drawn {
    let title = "Residual angle: gyro minus prediction, integrated over time";
    write(area, (16, 10), TITLE, title)?;
    let mut left = 16;
    let mut key = |words: &str, colour: Option<RGBColor>| -> Drawn {
        let fine = FINE as i32;
        match colour {
            Some(colour) => area.draw(&PathElement::new(
                [(left * fine, 48 * fine), ((left + 24) * fine, 48 * fine)],
                colour.stroke_width(3 * FINE),
            ))?,
            None => area.draw(&Rectangle::new(
                [(left * fine, 40 * fine), ((left + 24) * fine, 56 * fine)],
                HELD_OUT.filled(),
            ))?,
        }
        write(area, (left + 30, 40), WORDS, words)?;
        // A letter of this size is about 7 pixels wide.
        left += 30 + 7 * i32::try_from(words.chars().count())? + 22;
        Ok(())
    };
    if both {
        key("before: model as given", Some(BEFORE))?;
        key(&format!("after: with {}", found(diagnosis)), Some(AFTER))?;
    } else {
        key("model as given", Some(AFTER))?;
    }
    key("held out of the fit", None)
}

/// Names of the kinds found, each once, or their number.
fn found(diagnosis: &Diagnosis) -> String {
    let mut kinds: Vec<String> = Vec::new();
    for effect in &diagnosis.effects {
        let kind = plain(&effect.kind);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    if kinds.len() > NAMED {
        format!("{} kinds of effects found", kinds.len())
    } else {
        kinds.join(" + ")
    }
}

/// "gyro x: mean residual rate on held-out time 1.436 ± 0.055 before, 0.030 ± 0.055 °/h after".
fn heading(diagnosis: &Diagnosis, axis: usize, both: bool) -> String {
    let name = format!("gyro_{}", AXES[axis]);
    let channel = diagnosis.fit.channels.iter().find(|c| c.channel == name);
    let Some(channel) = channel else {
        return spaced(&name);
    };
    let (factor, unit) = display_unit("rad/s");
    let rate = |drift: f64, std: f64| with_spread(drift * factor, std * factor);
    let (before, after) = (&channel.held_out_before, &channel.held_out_after);
    let after = rate(after.drift_rad_s, after.drift_std_rad_s);
    let what = format!("{}: mean residual rate on held-out time", spaced(&name));
    if both {
        let before = rate(before.drift_rad_s, before.drift_std_rad_s);
        format!("{what} {before} {unit} before, {after} {unit} after")
    } else {
        format!("{what} {after} {unit}")
    }
}

/// Draws the integrated residual of one gyro; `both` also draws it without the found effects.
fn residual(area: &Area, pictures: &Pictures, axis: usize, both: bool) -> Drawn {
    let before = arcsec(&pictures.angle_before_rad[axis]);
    let after = arcsec(&pictures.angle_after_rad[axis]);
    let shown = after.iter().chain(before.iter().filter(|_| both));
    let y = range(shown.copied());
    let mut builder = builder(area);
    builder
        .margin_top(2 * FINE)
        .margin_left(LEFT as u32 * FINE)
        .x_label_area_size(26 * FINE);
    let mut chart = builder.build_cartesian_2d(time_range(pictures), y.clone())?;
    chart.draw_series(pictures.held_out_s.iter().map(|[begin, end]| {
        Rectangle::new([(*begin, y.start), (*end, y.end)], HELD_OUT.filled())
    }))?;
    let axes = Axes {
        x_title: "",
        y_title: "residual [″]",
        x_number: &|time_s| number(*time_s),
        y_number: &|angle| number(*angle),
        y_count: 5,
    };
    frame(&mut chart, &axes)?;
    let step = pictures.time_s.len().div_ceil(MOST_POINTS).max(1);
    let lines = [(&before, BEFORE, both), (&after, AFTER, true)];
    for (values, colour, drawn) in lines {
        let points = pictures.time_s.iter().zip(values).step_by(step);
        let points = points.map(|(x, y)| (*x, *y));
        let points = points.filter(|(_, y)| drawn && y.is_finite());
        chart.draw_series(LineSeries::new(points, colour.stroke_width(2 * FINE)))?;
    }
    Ok(())
}

/// Writes `words` of `height` page pixels with their upper left corner at `place`.
fn write(area: &Area, place: (i32, i32), height: u32, words: &str) -> Drawn {
    let style = ("sans-serif", height * FINE).into_font().color(&INK);
    let place = (place.0 * FINE as i32, place.1 * FINE as i32);
    area.draw(&Text::new(words.to_owned(), place, style))?;
    Ok(())
}
