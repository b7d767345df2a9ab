//! Plot as data: lines over a common x, drawn as SVG here and redrawn by the page's script if scripts run.
//!
//! A [`Chart`] contains our own words and numbers, no text of a recording.

use maud::{Markup, html};
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use serde_json::{Value, json};

use super::plot::{
    AFTER, Axes, BEFORE, Drawn, FINE, HELD_OUT, INK, builder, decades, ends, frame, plot, range,
    swatch,
};
use super::words::{number, superscript};

/// Height of a drawn chart \[page pixels\].
const HEIGHT: u32 = 290;

/// Largest number of points of a drawn line: more are not visible on paper; the script draws all.
const MOST_DRAWN: usize = 700;

/// Number of digits after the first of a number in the page's data.
const DIGITS: usize = 6;

/// Role of a line, which determines its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// Before: the model as it was.
    Before,
    /// After, or the only one.
    After,
    /// A model, dashed.
    Model,
}

impl Ink {
    fn colour(self) -> RGBColor {
        match self {
            Self::Before => BEFORE,
            Self::After => AFTER,
            Self::Model => INK,
        }
    }

    /// Name of its colour in `style.css`.
    fn variable(self) -> &'static str {
        match self {
            Self::Before => "--before",
            Self::After => "--after",
            Self::Model => "--ink",
        }
    }
}

/// Line of a chart.
pub struct Line {
    /// Name in the legend and in the CSV's header.
    pub name: &'static str,
    /// Role of the line.
    pub ink: Ink,
    /// A value for each x; NaN if missing.
    pub values: Vec<f64>,
}

/// Lines over a common x.
pub struct Chart {
    /// Name of the plot and of its CSV file.
    pub id: String,
    /// Plots of one group zoom together and share the cursor.
    pub group: &'static str,
    /// Heading.
    pub title: String,
    /// Title of the x axis with its unit.
    pub x_title: &'static str,
    /// Title of the y axis with its unit.
    pub y_title: &'static str,
    /// Both axes are logarithmic.
    pub logarithmic: bool,
    /// Values of x, ascending.
    pub x: Vec<f64>,
    /// Lines.
    pub lines: Vec<Line>,
    /// Stretches of x with a separate background: held-out time.
    pub stretches: Vec<[f64; 2]>,
    /// The two lines are the minimum and the maximum of an envelope.
    pub envelope: bool,
}

impl Chart {
    /// Figure: heading, button for the data, and the drawing for paper and for pages without scripts.
    pub fn figure(&self) -> Markup {
        html! {
            figure.chart data-chart=(self.id) {
                figcaption {
                    span { (self.title) } output {} button.csv type="button" title="Save the numbers of this plot" { "CSV" }
                }
                div.static { (self.drawing()) }
            }
        }
    }

    /// Data for the script.
    pub fn data(&self) -> Value {
        let lines = self.lines.iter();
        json!({
            "id": self.id,
            "group": self.group,
            "x": self.x_title,
            "y": self.y_title,
            "log": self.logarithmic,
            "envelope": self.envelope,
            "stretches": self.stretches,
            "lines": lines.map(|line| json!({
                "name": line.name,
                "ink": line.ink.variable(),
                "dashed": line.ink == Ink::Model,
            })).collect::<Vec<_>>(),
            "data": rounded(std::iter::once(&self.x).chain(self.lines.iter().map(|line| &line.values))),
        })
    }

    fn drawing(&self) -> Markup {
        let label = format!("{}: {} against {}", self.title, self.y_title, self.x_title);
        plot(&label, HEIGHT, |area| {
            let mut builder = builder(area);
            let values = || {
                self.lines
                    .iter()
                    .flat_map(|line| line.values.iter().copied())
            };
            let x = ends(
                self.x
                    .iter()
                    .copied()
                    .filter(|x| !self.logarithmic || *x > 0.0),
            );
            let (low, high) = x.filter(|(low, high)| high > low).unwrap_or((1.0, 10.0));
            if self.logarithmic {
                let y = decades(values());
                let mut chart =
                    builder.build_cartesian_2d((low..high).log_scale(), y.log_scale())?;
                self.draw(&mut chart, &power_of_ten)
            } else {
                let y = range(values());
                // An excluded first row should not remove the axis' first tick label.
                let near = (low - low.round()).abs() < 0.01 * (high - low);
                let first = if near { low.round() } else { low };
                let mut chart = builder.build_cartesian_2d(first..high, y.clone())?;
                chart.draw_series(self.stretches.iter().map(|[begin, end]| {
                    Rectangle::new([(*begin, y.start), (*end, y.end)], HELD_OUT.filled())
                }))?;
                self.draw(&mut chart, &|value| number(*value))
            }
        })
    }

    fn draw<'a, X, Y>(
        &self,
        chart: &mut ChartContext<'a, SVGBackend<'_>, Cartesian2d<X, Y>>,
        numbers: &dyn Fn(&f64) -> String,
    ) -> Drawn
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let axes = Axes {
            x_title: self.x_title,
            y_title: self.y_title,
            x_number: numbers,
            y_number: numbers,
            y_count: 6,
        };
        frame(chart, &axes)?;
        let step = self.x.len().div_ceil(MOST_DRAWN).max(1);
        let points = |line: &Line| -> Vec<(f64, f64)> {
            let points = self.x.iter().zip(&line.values).step_by(step);
            let shown = |(x, y): &(f64, f64)| {
                y.is_finite() && (!self.logarithmic || (*x > 0.0 && *y > 0.0))
            };
            points.map(|(x, y)| (*x, *y)).filter(shown).collect()
        };
        if let (true, [low, high]) = (self.envelope, &self.lines[..]) {
            let mut around = points(low);
            around.extend(points(high).into_iter().rev());
            chart.draw_series([Polygon::new(around, low.ink.colour().filled())])?;
        }
        for line in &self.lines {
            let width = if line.ink == Ink::Before {
                FINE
            } else {
                FINE * 3 / 2
            };
            let style = line.ink.colour().stroke_width(width);
            let points = points(line);
            if line.ink == Ink::Model {
                let dashes = DashedLineSeries::new(points, 6 * FINE, 4 * FINE, style);
                chart.draw_series(dashes)?;
            } else {
                chart.draw_series(LineSeries::new(points, style))?;
            }
        }
        Ok(())
    }
}

/// Data of a drawing that the script does not redraw, for saving.
pub struct Numbers {
    /// Name of the drawing and of its CSV file.
    pub id: String,
    /// Heading of each column, with its unit.
    pub columns: &'static [&'static str],
    /// Columns.
    pub data: Vec<Vec<f64>>,
}

impl Numbers {
    /// Data for the script.
    pub fn data(&self) -> Value {
        json!({ "id": self.id, "columns": self.columns, "data": rounded(self.data.iter()) })
    }
}

/// Figure with a drawing and a button for its data.
pub fn drawn(id: &str, title: &str, drawing: &Markup) -> Markup {
    html! {
        figure.chart data-chart=(id) {
            figcaption {
                span { (title) } button.csv type="button" title="Save the numbers of this plot" { "CSV" }
            }
            (drawing)
        }
    }
}

/// Charts side by side with their common legend; empty without a chart.
pub fn row(charts: &[Chart]) -> Markup {
    let Some(first) = charts.first() else {
        return html! {};
    };
    html! {
        p.legend {
            @for line in first.lines.iter().take(if first.envelope { 0 } else { first.lines.len() }) {
                @let RGBColor(red, green, blue) = line.ink.colour();
                span.key {
                    (swatch(
                        &format!("#{red:02X}{green:02X}{blue:02X}"),
                        if line.ink == Ink::Model { "6 4" } else { "none" },
                        "2",
                    ))
                    (line.name)
                }
            }
            @if !first.stretches.is_empty() {
                span.key {
                    svg.swatch viewBox="0 0 22 14" aria-hidden="true" { rect width="22" height="14" fill="#E6ECF2" {} }
                    "held-out time"
                }
            }
            span.tools data-group=(first.group) {}
        }
        div.charts { @for chart in charts { (chart.figure()) } }
    }
}

/// Rounds columns of numbers to the digits needed in a plot and a table.
fn rounded<'a>(columns: impl Iterator<Item = &'a Vec<f64>>) -> Vec<Vec<Option<f64>>> {
    let column = |column: &Vec<f64>| column.iter().map(|value| short(*value)).collect();
    columns.map(column).collect()
}

/// Rounds a number to the digits needed in a plot and a table; `None` if not finite.
fn short(value: f64) -> Option<f64> {
    let text = format!("{value:.DIGITS$e}");
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

fn power_of_ten(value: &f64) -> String {
    let power = value.log10().round() as i32;
    match power {
        -1..=3 => number(*value),
        other => format!("10{}", superscript(other)),
    }
}
