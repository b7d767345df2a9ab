//! Common parts of all plots: size, colours, frame.
//!
//! From ranges and axis titles, inline SVG without a fixed width, transparent, its colours the tokens below; `style.css`
//! changes the same tokens for a dark page.
//!
//! The backend's coordinates are integers, so everything is drawn [`FINE`] times too large and scaled back by the
//! `viewBox`. Out of scope: text from recordings; plots contain only our own words.

use std::error::Error;
use std::ops::Range;

use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Units of the drawing in one pixel of the page.
pub const FINE: u32 = 4;

/// Width of a plot \[page pixels\]: two fit side by side on a desktop, one fills a phone, and the labels are readable on
/// both.
const WIDTH: u32 = 460;

/// Height of tick labels and axis titles \[page pixels\].
const LABEL: u32 = 17;

/// Colour of text and frame.
pub const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);

/// Colour of the grid's lines.
const GRID: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

/// Colour behind held-out time.
pub const HELD_OUT: RGBColor = RGBColor(0xE6, 0xEC, 0xF2);

/// Colour of curves without the found effects (Okabe–Ito vermilion).
pub const BEFORE: RGBColor = RGBColor(0xD5, 0x5E, 0x00);

/// Colour of curves with the found effects (Okabe–Ito blue).
pub const AFTER: RGBColor = RGBColor(0x00, 0x72, 0xB2);

/// Drawing surface.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Result of drawing; it does not fail on a string in memory.
pub type Drawn = Result<(), Box<dyn Error>>;

/// Plot of `height` page pixels; `label` describes it in words.
pub fn plot(label: &str, height: u32, draw: impl FnOnce(&Area) -> Drawn) -> Markup {
    let size = (WIDTH * FINE, height * FINE);
    match drawing(size, draw) {
        Ok(inner) => html! {
            svg.plot viewBox=(format!("0 0 {} {}", size.0, size.1)) role="img" aria-label=(label) {
                (PreEscaped(inner))
            }
        },
        Err(problem) => html! { p { "This plot could not be drawn: " (problem) "." } },
    }
}

/// Draws on a surface of `size` units and returns the SVG elements without the outer tag, whose size in pixels the backend
/// fixes.
///
/// # Errors
/// Any error of the drawing.
pub fn drawing(
    size: (u32, u32),
    draw: impl FnOnce(&Area) -> Drawn,
) -> Result<String, Box<dyn Error>> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&area)?;
        area.present()?;
    }
    let inner = svg.find('>').zip(svg.rfind("</svg>"));
    Ok(inner.map_or(String::new(), |(begin, end)| {
        svg[begin + 1..end].replace(" opacity=\"1\"", "")
    }))
}

/// Line sample for a legend.
pub fn swatch(colour: &str, dash: &str, width: &str) -> Markup {
    html! {
        svg.swatch viewBox="0 0 22 14" aria-hidden="true" {
            line x1="0" x2="22" y1="7" y2="7" stroke=(colour) stroke-width=(width) stroke-dasharray=(dash) {}
        }
    }
}

/// Titles and tick labels of the axes.
pub struct Axes<'a> {
    /// Title of the x axis.
    pub x_title: &'a str,
    /// Title of the y axis.
    pub y_title: &'a str,
    /// Format of a tick label on x.
    pub x_number: &'a dyn Fn(&f64) -> String,
    /// Format of a tick label on y.
    pub y_number: &'a dyn Fn(&f64) -> String,
    /// Approximate number of tick labels along y.
    pub y_count: usize,
}

/// Draws frame, grid and titles into a chart built by [`builder`].
pub fn frame<'a, X, Y>(
    chart: &mut ChartContext<'a, SVGBackend<'_>, Cartesian2d<X, Y>>,
    axes: &Axes,
) -> Drawn
where
    X: Ranged<ValueType = f64> + plotters::coord::ranged1d::ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + plotters::coord::ranged1d::ValueFormatter<f64>,
{
    let text = ("sans-serif", LABEL * FINE).into_font().color(&INK);
    chart
        .configure_mesh()
        .x_labels(6)
        .y_labels(axes.y_count)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(FINE / 2))
        .axis_style(INK.stroke_width(FINE))
        .label_style(text.clone())
        .axis_desc_style(text)
        .x_desc(axes.x_title)
        .y_desc(axes.y_title)
        .x_label_formatter(axes.x_number)
        .y_label_formatter(axes.y_number)
        .draw()?;
    Ok(())
}

/// Chart builder with room for the labels.
pub fn builder<'a, 'b>(area: &'a Area<'b>) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut builder = ChartBuilder::on(area);
    builder
        .margin_top(8 * FINE)
        .margin_right(14 * FINE)
        .x_label_area_size(46 * FINE)
        .y_label_area_size(66 * FINE);
    builder
}

/// Smallest range of the finite `values` with a margin; never empty.
pub fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = ends(values).unwrap_or((0.0, 1.0));
    let air = 0.05 * (high - low);
    if air > 0.0 {
        low - air..high + air
    } else {
        let air = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
        low - air..high + air
    }
}

/// Whole decades around the finite positive `values`; never empty.
pub fn decades(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = ends(values.filter(|value| *value > 0.0)).unwrap_or((1.0, 10.0));
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    10f64.powf(low)..10f64.powf(high.max(low + 1.0))
}

/// Smallest and largest finite value.
pub fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |ends, value| {
            let (low, high) = ends.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        })
}
