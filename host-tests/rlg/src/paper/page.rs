//! Writes `paper.html`: the paper's tables and figures compared with ours, as one page.
//!
//! It is one HTML file without scripts and external resources, in °, °/h and m/s.
//!
//! verdicts → effect of the signs → figure by figure, each with the choice that the paper left open → all numbers.
//!
//! Out of scope: any judgement that `paper.json` does not contain, and the paper's own plots.

use maud::{Markup, html};
use plotters::prelude::*;

use crate::paper::Paper;
use crate::paper::entry::Entry;
use crate::paper::gyros::Figure;
use crate::paper::rows::Compared;
use crate::paper::run::Curve;
use crate::paper::sins::Sins;
use crate::paper::vibration::Vibration;
use rlg_report::plot::{
    AFTER, Axes, BEFORE, Drawn, FINE, INK, builder, frame, plot, range, swatch,
};
use rlg_report::words::number;

/// Height of a plot \[page pixels\].
const HEIGHT: u32 = 250;

/// Pitch, roll, yaw; east, north.
const ANGLES: [&str; 3] = ["Pitch", "Roll", "Yaw"];
const VELOCITIES: [&str; 2] = ["East", "North"];

/// A curve of a plot.
struct Line<'a> {
    points: &'a [(f64, f64)],
    colour: RGBColor,
    width: u32,
    dashed: bool,
}

fn line(points: &[(f64, f64)], colour: RGBColor, width: u32) -> Line<'_> {
    Line {
        points,
        colour,
        width,
        dashed: false,
    }
}

/// Formats the whole page; `json` is the text of `paper.json`.
pub fn page(paper: &Paper, json: &str) -> String {
    let results = &paper.results;
    let [done, could] = results.score();
    let entries = &results.entries;
    let main = html! {
            header {
                p.kicker { "Cheng et al., Dynamic Coning Error Modeling Analysis of Laser Strapdown Inertial Navigation System, 2023" }
                h1 { "The paper's experiments, run again" }
                p.verdict { (done) " of " (could) " reproduced" }
                p.lead { "A simulated dithered triad whose blocks bend, the firmware's chain in f32, a strapdown navigator: "
                    "each table and figure beside what is printed. Fig. 1 to 3 are drawings." }
            }
            (overview(entries))
            section {
                h2 { "Eq. (6) with its signs as printed" }
                p.caution { (results.literal_signs) }
            }
            section {
                h2 { "Tables 1 to 3: the coefficient" }
                (why(entries, "Table 1")) (why(entries, "Table 3"))
            }
            @for (figure, item) in paper.gyros.iter().zip(["Fig. 4", "Fig. 5"]) { (gyros(figure, item, entries)) }
            (systems(paper, entries))
            @for (vibration, place) in paper.vibration.iter().zip([0, 1]) { (shaken(vibration, place, entries)) }
            (table("Table 4: attitude errors after vibration", &paper.tables[0], why(entries, "Table 4")))
            (table("Table 5: largest velocity errors during vibration", &paper.tables[1], why(entries, "Table 5")))
            section.data {
                details {
                    summary { "All numbers (paper.json)" }
                    pre { (json) }
                }
            }
    };
    rlg_report::document("The paper's experiments, run again", &main)
}

fn overview(entries: &[Entry]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "item" } th { "reproduced" } th { "by whose mark" } th { "ours" } } }
            tbody {
                @for entry in entries.iter().filter(|entry| !entry.drawing) {
                    tr {
                        td.number { (entry.item) }
                        td { @if entry.reproduced { "yes" } @else { b { "no" } } }
                        td { @if let Some(criterion) = &entry.criterion { (criterion.by.word()) ": " (criterion.mark) } }
                        td { (entry.short) }
                    }
                }
            }
        } }
    }
}

/// Returns the sentence of `paper.json` on an item.
fn why(entries: &[Entry], item: &str) -> Markup {
    let entry = entries.iter().find(|entry| entry.item == item);
    html! { @if let Some(entry) = entry { p { (entry.why) } } }
}

fn gyros(figure: &Figure, item: &str, entries: &[Entry]) -> Markup {
    let level = middle_mean(&figure.fibre_optic);
    let closer = |curve: &Curve| -> Curve {
        middle(curve)
            .iter()
            .map(|(time_s, rate)| (*time_s, rate - level))
            .collect()
    };
    let close = [closer(&figure.laser), closer(&figure.fibre_optic)];
    let pair = |laser, fibre_optic| {
        [
            line(laser, BEFORE, 2 * FINE),
            line(fibre_optic, AFTER, FINE),
        ]
    };
    let rates = [
        curves(
            "Means over 1 s, less the mean at rest",
            "rate [°/h]",
            &pair(&figure.laser, &figure.fibre_optic),
        ),
        curves(
            "While coning, less the fibre-optic gyro's mean",
            "rate [°/h]",
            &pair(&close[0], &close[1]),
        ),
    ];
    html! {
        section {
            h2 { (item) ": gyros side by side, coning at " (number(figure.frequency_hz)) " Hz" }
            (why(entries, item))
            (legend(&[("#D55E00", "none", "laser gyro, Eq. (7) alone"), ("#0072B2", "none", "fibre-optic gyro")]))
            div.pair { @for rate in &rates { (rate) } }
        }
    }
}

/// Returns the middle half of a curve: full amplitude, no taper.
fn middle(curve: &Curve) -> &[(f64, f64)] {
    &curve[curve.len() / 4..3 * curve.len() / 4]
}

fn middle_mean(curve: &Curve) -> f64 {
    let middle = middle(curve);
    middle.iter().map(|(_, rate)| rate).sum::<f64>() / middle.len() as f64
}

fn systems(paper: &Paper, entries: &[Entry]) -> Markup {
    let coning = &paper.coning;
    let [before, after, fibre] = [&coning.before, &coning.after, &coning.fibre_optic];
    html! {
        section {
            h2 { "Fig. 6 and 7: two systems, coning at 15 Hz about the pitch axis" }
            (why(entries, "Fig. 6")) (why(entries, "Fig. 7"))
            (legend(&[("#D55E00", "none", "laser system, Eq. (7) alone"), ("#0072B2", "none", "fibre-optic system")]))
            (errors(before, fibre, None))
        }
        section {
            h2 { "Fig. 8 and 9: the laser system before and after compensation" }
            (why(entries, "Fig. 8")) (why(entries, "Fig. 9"))
            (before_after())
            (errors(before, after, Some(&coning.literal)))
        }
    }
}

fn shaken(vibration: &Vibration, place: usize, entries: &[Entry]) -> Markup {
    let items = [["Fig. 10", "Fig. 12"], ["Fig. 11", "Fig. 13"]][place];
    html! {
        section {
            h2 { (items[0]) " and " (items[1]) ": vibration along " (["x", "y"][place]) }
            (why(entries, items[0]))
            (before_after())
            (errors(&vibration.before, &vibration.after, Some(&vibration.literal)))
        }
    }
}

fn before_after() -> Markup {
    legend(&[
        ("#D55E00", "none", "before: Eq. (7) alone"),
        ("#0072B2", "none", "after: with the dynamic terms"),
        ("#222222", "4 4", "Eq. (6) as printed"),
    ])
}

/// Formats the legend: colour, dashes and words of each kind of curve.
fn legend(keys: &[(&str, &str, &str)]) -> Markup {
    html! {
        p.legend {
            @for (colour, dash, words) in keys { span.key { (swatch(colour, dash, "2")) (words) } }
        }
    }
}

/// Draws five plots: attitude and velocity, the systems on the same axes.
fn errors(before: &Sins, beside: &Sins, literal: Option<&Sins>) -> Markup {
    let drawn = |name: &str, title: &str, of: &dyn Fn(&Sins) -> &Curve| {
        let mut lines = vec![
            line(of(before), BEFORE, 3 * FINE),
            line(of(beside), AFTER, 2 * FINE),
        ];
        // dashed and last: it coincides with "before" and must not hide it
        lines.extend(literal.map(|literal| Line {
            dashed: true,
            ..line(of(literal), INK, FINE)
        }));
        curves(name, title, &lines)
    };
    html! {
        div.pair {
            @for (axis, name) in ANGLES.iter().enumerate() {
                (drawn(name, "error [°]", &|sins| &sins.attitude_deg[axis]))
            }
            @for (axis, name) in VELOCITIES.iter().enumerate() {
                (drawn(name, "velocity error [m/s]", &|sins| &sins.velocity_m_s[axis]))
            }
        }
    }
}

fn table(title: &str, rows: &[Compared], why: Markup) -> Markup {
    html! {
        section {
            h2 { (title) }
            (why)
            div.scroll { table {
                thead {
                    tr {
                        th { "row" } th { "paper: before, after" } th { "reduction" }
                        th { "ours: before, after" } th { "reduction" }
                        th { "flexure alone" } th { "left by the printed signs" }
                    }
                }
                tbody {
                    @for row in rows {
                        @let [before, after] = row.printed_pair();
                        tr {
                            td { (row.name) ", " (row.along) " vibration" }
                            td.number { (number(before)) ", " (number(after)) " " (row.unit) }
                            td.number { (format!("{:.2} %", row.paper_reduction_percent)) }
                            td.number { (format!("{:.5}, {:.5} {}", row.before, row.after, row.unit)) }
                            td.number { (format!("{:.2} %", row.reduction_percent)) }
                            td.number { (format!("{:.2} %", row.alone_percent)) }
                            td.number { (format!("{:.0} %", row.left_by_literal_signs_percent)) }
                        }
                    }
                }
            } }
        }
    }
}

/// Draws curves over time \[s\] on common axes.
fn curves(name: &str, y_title: &str, lines: &[Line]) -> Markup {
    let label = format!("{name}: {y_title} against time");
    let drawn = plot(&label, HEIGHT, |area| {
        let all = || lines.iter().flat_map(|line| line.points.iter());
        let x = range(all().map(|(x, _)| *x));
        let y = range(all().map(|(_, y)| *y));
        // all numbers of an axis with the same decimals, to a tenth of its length; with a fifth they would run into the
        // title
        let decimals = (1.0 - (y.end - y.start).log10().floor()).clamp(0.0, 4.0) as usize;
        let nothing = 1e-9 * (y.end - y.start);
        let mut chart = builder(area).build_cartesian_2d(x, y)?;
        let axes = Axes {
            x_title: "time [s]",
            y_title,
            x_number: &|time_s| number(*time_s),
            y_number: &|value| {
                // a tick at zero is 1e-17 in the plotter's arithmetic
                let value = if value.abs() < nothing { 0.0 } else { *value };
                format!("{value:.decimals$}").replace('-', "−")
            },
            y_count: 6,
        };
        frame(&mut chart, &axes)?;
        lines.iter().try_for_each(|line| -> Drawn {
            let points = line.points.iter().copied();
            let style = line.colour.stroke_width(line.width);
            if line.dashed {
                let (dash, gap) = (4 * FINE, 8 * FINE);
                chart.draw_series(DashedLineSeries::new(points, dash, gap, style))?;
            } else {
                chart.draw_series(LineSeries::new(points, style))?;
            }
            Ok(())
        })
    });
    html! { figure { figcaption { (name) } (drawn) } }
}
