//! Section on the self-test: response of the search on this recording to injected effects, compared with theory.
//!
//! From [`SelfTestEntry`]s, a plot of the detected share against strength (matched-filter SNR), with the binomial standard
//! deviation, and a sentence on the false alarms in noise alone.

use maud::{Markup, html};
use plotters::prelude::*;

use super::chart::{self, Numbers};
use super::plot::{AFTER, Axes, FINE, INK, builder, frame, plot, swatch};
use super::words::{number, plain};
use rlg_findings::result::{SelfTestEntry, SelfTestPoint};

/// Height of the plot \[page pixels\].
const HEIGHT: u32 = 250;

/// Margin below the first and above the last strength: half a step.
const MARGIN: f64 = 1.0;

/// Name of the plot.
const ID: &str = "self-test";

/// Data of the plot, if there is one.
pub fn numbers(test: &SelfTestEntry) -> Option<Numbers> {
    test.curve.iter().find(|point| point.injections > 0)?;
    let column =
        |of: &dyn Fn(&SelfTestPoint) -> f64| test.curve.iter().map(of).collect::<Vec<f64>>();
    Some(Numbers {
        id: ID.to_owned(),
        columns: &[
            "signal to noise",
            "injected",
            "found",
            "rightly named",
            "share found in theory",
        ],
        data: vec![
            column(&|point| point.rho),
            column(&|point| point.injections as f64),
            column(&|point| point.detected as f64),
            column(&|point| point.named as f64),
            column(&|point| point.theory),
        ],
    })
}

/// Plot and sentence.
pub fn self_test(test: &SelfTestEntry) -> Markup {
    let shown: Vec<&SelfTestPoint> = test.curve.iter().filter(|p| p.injections > 0).collect();
    let named_falsely: Vec<String> = test
        .kinds
        .iter()
        .filter(|kind| kind.false_names > 0)
        .map(|kind| format!("{} in {}", plain(&kind.kind), kind.false_names))
        .collect();
    html! {
        details {
        summary { "Self-test on this recording: " (test.false_names) " false names in " (test.slides) " trials" }
        p {
            "The search was run on simulated noise of this recording without effects, " (test.slides)
            " times: every name is then false. It named an effect in " (test.false_names)
            @if !named_falsely.is_empty() { " (" (named_falsely.join(", ")) ")" }
            "; the false-alarm rate is below " (number((1000.0 * test.upper_limit_95).round() / 10.0))
            " % with 95 % confidence."
        }
        @if !shown.is_empty() {
            p {
                "Effects of every kind were added to the same noise, at known strength. Of those with a signal-to-noise ratio of "
                @for (place, point) in shown.iter().enumerate() {
                    @if place > 0 { ", " }
                    (number(point.rho)) " it found " (percent(point.detected, point.injections))
                    " and named correctly " (percent(point.named, point.injections))
                }
                "."
            }
            p.legend {
                span.key { (swatch("#0072B2", "none", "2.5")) "found in this recording ± standard deviation" }
                span.key { (swatch("#222222", "6 4", "2")) "theory, noise as modelled" }
            }
            (chart::drawn(ID, "Share of injected patterns found", &curve(&shown)))
        }
        }
    }
}

fn percent(count: usize, of: usize) -> String {
    format!("{:.0} %", 100.0 * count as f64 / of as f64)
}

fn curve(points: &[&SelfTestPoint]) -> Markup {
    plot(
        "Share of injected patterns found against their strength",
        HEIGHT,
        |area| {
            let (Some(first), Some(last)) = (points.first(), points.last()) else {
                return Ok(());
            };
            let x = first.rho - MARGIN..last.rho + MARGIN;
            let mut chart = builder(area).build_cartesian_2d(x, -0.03..1.05)?;
            let axes = Axes {
                x_title: "signal to noise",
                y_title: "share found",
                x_number: &|rho| number(*rho),
                y_number: &|share| number((share * 100.0).round() / 100.0),
                y_count: 6,
            };
            frame(&mut chart, &axes)?;
            let theory: Vec<(f64, f64)> = points.iter().map(|p| (p.rho, p.theory)).collect();
            let style = INK.stroke_width(FINE * 3 / 2);
            chart.draw_series(DashedLineSeries::new(theory, 6 * FINE, 4 * FINE, style))?;
            let found: Vec<(f64, f64, f64)> = points
                .iter()
                .map(|p| {
                    let count = p.injections as f64;
                    // Laplace's rule of succession, so that zero of forty has a nonzero standard deviation.
                    let likely = (p.detected as f64 + 1.0) / (count + 2.0);
                    let std = (likely * (1.0 - likely) / count).sqrt();
                    (p.rho, p.detected as f64 / count, std)
                })
                .collect();
            let style = AFTER.stroke_width(FINE * 3 / 2);
            chart.draw_series(found.iter().map(|&(rho, share, std)| {
                let ends = [(rho, (share - std).max(0.0)), (rho, (share + std).min(1.0))];
                PathElement::new(ends, style)
            }))?;
            chart.draw_series(
                found
                    .iter()
                    .map(|&(rho, share, _)| Circle::new((rho, share), 4 * FINE, AFTER.filled())),
            )?;
            Ok(())
        },
    )
}
