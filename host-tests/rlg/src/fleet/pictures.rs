//! Pictures of a fleet: each number with its standard deviation against date and temperature, by instrument.

use std::collections::BTreeMap;

use chrono::DateTime;
use maud::{Markup, html};
use plotters::prelude::*;
use plotters::style::RGBColor;
use rlg_findings::names::plain;
use rlg_findings::numbers::{Scale, number};
use rlg_report::plot::{AFTER, Axes, BEFORE, FINE, builder, ends, frame, plot, range};

use super::statistics::Measured;
use super::summary::{Found, Summary};

/// Height of a picture \[page pixels\].
const HEIGHT: u32 = 250;

/// Largest number of numbers that are drawn unfolded.
const MOST_OPEN: usize = 4;

/// Largest number of numbers that are drawn at all.
const MOST: usize = 40;

/// Colours of instruments (Okabe and Ito); the first two are the page's own.
const COLOURS: [RGBColor; 5] = [
    AFTER,
    BEFORE,
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
];

/// Colour of all other instruments.
const OTHERS: RGBColor = RGBColor(0x99, 0x99, 0x99);

/// Number of points that make a picture.
const LEAST_POINTS: usize = 3;

/// Seconds in a day.
const DAY_S: f64 = 86_400.0;

/// A value of one recording.
#[derive(Debug, Clone, Copy)]
struct Point<'a> {
    instrument: &'a str,
    measured: Measured,
    /// Seconds since 1970, and K.
    at: [Option<f64>; 2],
}

/// A number with its values in all recordings that show it.
struct Number<'a> {
    of: &'a Found,
    points: Vec<Point<'a>>,
    /// Instruments that stand out in it, or have a trend of it.
    notable: Vec<&'a str>,
}

/// Section with a pair of pictures for each number, the notable ones first and unfolded.
pub(super) fn section(summary: &Summary) -> Markup {
    let numbers = numbers(summary);
    if numbers.is_empty() {
        return html! {};
    }
    let left = numbers.len().saturating_sub(MOST);
    let (open, folded) = numbers.split_at(numbers.len().min(MOST_OPEN));
    html! {
        section {
            h2 { "Pictures" }
            p { "Each number against date and temperature, a point a recording, with ± 1 σ. Recordings that do not show the effect "
                "have no point." }
            @for one in open { (pictures(one)) }
            @if !folded.is_empty() { details {
                summary { (folded.len().min(MOST - open.len())) " more" }
                @for one in folded.iter().take(MOST - open.len()) { (pictures(one)) }
            } }
            @if left > 0 { p.note { (left) " more numbers are in the table alone." } }
        }
    }
}

/// Collects the numbers of enough recordings with a date or a temperature.
fn numbers(summary: &Summary) -> Vec<Number<'_>> {
    let mut all: BTreeMap<(&str, &str, &str), Number<'_>> = BTreeMap::new();
    for line in &summary.lines {
        let about = &line.run.about;
        for one in &line.found {
            let key = (&*one.kind, &*one.texts, &*one.parameter);
            let number = all.entry(key).or_insert_with(|| Number {
                of: one,
                points: Vec::new(),
                notable: Vec::new(),
            });
            number.points.push(Point {
                instrument: line.run.instrument(),
                measured: one.measured,
                at: [about.start_s, about.temperature_k],
            });
        }
    }
    let trends = summary.trends();
    let trends = trends.iter().map(|trend| (trend.instrument, trend.of));
    for (instrument, one) in summary.outliers().into_iter().chain(trends) {
        let number = all.get_mut(&(&*one.kind, &*one.texts, &*one.parameter));
        if let Some(number) = number.filter(|number| !number.notable.contains(&instrument)) {
            number.notable.push(instrument);
        }
    }
    let is_drawn = |number: &Number<'_>| (0..2).any(|axis| number.is_spread(axis));
    let mut drawn: Vec<Number<'_>> = all.into_values().filter(is_drawn).collect();
    drawn.sort_by_key(|number| std::cmp::Reverse(number.notable.len()));
    drawn
}

impl<'a> Number<'a> {
    /// True if enough points have different places on an axis.
    fn is_spread(&self, axis: usize) -> bool {
        let places = || self.points.iter().filter_map(|point| point.at[axis]);
        let is_wide = ends(places()).is_some_and(|(low, high)| high > low);
        is_wide && places().count() >= LEAST_POINTS
    }

    /// Instruments with a colour of their own: all if they are few, else the notable ones.
    fn coloured(&self) -> Vec<&'a str> {
        let mut names: Vec<&str> = self.points.iter().map(|point| point.instrument).collect();
        names.sort_unstable();
        names.dedup();
        if names.len() > COLOURS.len() {
            names.clone_from(&self.notable);
        }
        names.truncate(COLOURS.len());
        names
    }
}

/// Pictures of one number against date and temperature, with the legend of both.
fn pictures(one: &Number<'_>) -> Markup {
    let coloured = one.coloured();
    let is_other = |point: &Point<'_>| !coloured.contains(&point.instrument);
    let has_others = one.points.iter().any(is_other);
    let texts = match one.of.texts.as_str() {
        "" => String::new(),
        texts => format!(" ({texts})"),
    };
    let name = format!("{} {}{texts}", plain(&one.of.kind), one.of.parameter);
    html! {
        h3 { (name) }
        div.legend {
            @for (instrument, colour) in coloured.iter().zip(COLOURS) { (key(instrument, colour)) }
            @if has_others { (key("others", OTHERS)) }
        }
        div.pair {
            @for (axis, title) in ["date", "temperature"].into_iter().enumerate() {
                @if one.is_spread(axis) { figure { (picture(one, axis, title, &coloured)) } }
            }
        }
    }
}

fn key(name: &str, RGBColor(red, green, blue): RGBColor) -> Markup {
    let colour = format!("#{red:02X}{green:02X}{blue:02X}");
    html! {
        span.key {
            svg.swatch viewBox="0 0 14 14" aria-hidden="true" { circle cx="7" cy="7" r="5" stroke=(colour) fill="none" stroke-width="3" {} }
            (name)
        }
    }
}

/// Picture of one number against date (0) or temperature (1).
fn picture(one: &Number<'_>, axis: usize, title: &str, coloured: &[&str]) -> Markup {
    let sizes = one.points.iter().map(|point| point.measured.value.abs());
    let largest = sizes.fold(0.0, f64::max);
    let scale = Scale::of(&one.of.parameter, &one.of.unit, largest);
    let placed = one.points.iter().filter_map(|point| {
        let place = match axis {
            0 => point.at[0]?,
            _ => point.at[1]? - 273.15,
        };
        let Measured { value, std } = point.measured;
        let size = [value * scale.factor, std * scale.factor.abs()];
        Some((place, size[0], size[1], point.instrument))
    });
    let points: Vec<(f64, f64, f64, &str)> = placed.collect();
    let y_title = match scale.unit.as_str() {
        "" => "value",
        unit => unit,
    };
    let x = range(points.iter().map(|point| point.0));
    let edges = points.iter().flat_map(|(_, y, std, _)| [y - std, y + std]);
    let y = range(edges);
    let span_s = x.end - x.start;
    let x_number = |value: &f64| match axis {
        0 => date(*value, span_s),
        _ => number(*value),
    };
    let axes = Axes {
        x_title: if axis == 0 {
            "date (UTC)"
        } else {
            "temperature [°C]"
        },
        y_title,
        x_number: &x_number,
        y_number: &|value| number(*value),
        y_count: 5,
    };
    let label = format!(
        "{} {} against {title}",
        plain(&one.of.kind),
        one.of.parameter
    );
    plot(&label, HEIGHT, |area| {
        let mut builder = builder(area);
        let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
        frame(&mut chart, &axes)?;
        // Instruments without a colour lie beneath.
        let place_of = |name: &str| coloured.iter().position(|known| *known == name);
        let mut drawn = points.clone();
        drawn.sort_by_key(|point| place_of(point.3).is_some());
        for (at, value, std, instrument) in drawn {
            let colour = place_of(instrument).map_or(OTHERS, |place| COLOURS[place]);
            let bar = vec![(at, value - std), (at, value + std)];
            chart.draw_series([PathElement::new(bar, colour.stroke_width(FINE))])?;
            let mark = colour.stroke_width(2 * FINE);
            chart.draw_series([Circle::new((at, value), 3 * FINE, mark)])?;
        }
        Ok(())
    })
}

/// Formats seconds since 1970 as a date, or a time where the axis spans a few days.
fn date(since_1970_s: f64, span_s: f64) -> String {
    let form = match span_s / DAY_S {
        days if days < 3.0 => "%d. %H:%M",
        days if days < 300.0 => "%m-%d",
        _ => "%Y-%m",
    };
    let date = DateTime::from_timestamp(since_1970_s as i64, 0);
    date.map_or_else(String::new, |date| date.format(form).to_string())
}

#[cfg(test)]
mod tests {
    use super::date;

    #[test]
    fn dates_have_the_parts_that_the_axis_distinguishes() {
        let at_s = 1_772_366_400.0;
        assert_eq!(date(at_s, 40.0 * 86_400.0), "03-01");
        assert_eq!(date(at_s, 900.0 * 86_400.0), "2026-03");
        assert_eq!(date(at_s + 3600.0, 86_400.0), "01. 13:00");
    }
}
