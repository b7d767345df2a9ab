//! Page `report.html` of a challenge: the marks and their curves.
//!
//! One HTML file without scripts or external content.
//!
//! marks → detection against theory → intervals → false alarms → by kind → confusion → trials to repeat → all numbers.
//!
//! Out of scope: any judgement not contained in `challenge.json`.

use std::collections::BTreeMap;

use maud::{Markup, html};
use plotters::prelude::*;

use super::plot::{AFTER, Axes, BEFORE, FINE, INK, builder, frame, plot, swatch};
use super::words::number;
use rlg_challenge::case::NAMEABLE;
use rlg_challenge::catalogue_marks::Mark;
use rlg_challenge::chance::upper_limit;
use rlg_challenge::score::{Counts, Scores, Strength};

/// Height of a plot \[page pixels\].
const HEIGHT: u32 = 290;

/// Complete page; `json` is `challenge.json` verbatim.
pub fn page(scores: &Scores, json: &str) -> String {
    let judged: Vec<&Mark> = scores
        .marks
        .iter()
        .filter(|mark| mark.met.is_some())
        .collect();
    let met = judged.iter().filter(|mark| mark.met == Some(true)).count();
    let main = html! {
        header {
            p.kicker { "Blind test of the diagnosis" }
            h1 { "Blind challenge, seed " (scores.plan.seed) }
            p.verdict { (met) " of " (judged.len()) " marks met" }
            p.lead {
                (scores.scored) " trials. What each conceals was drawn by the seed, simulated, hashed and committed to "
                "before it was diagnosed; afterwards the answers were revealed."
            }
            @if scores.plan.leave_one_out {
                p.caution { "The concealed kind was taken out of the tool's catalogue in every trial." }
            }
        }
        section {
            h2 { "Marks" }
            (marks(&scores.marks))
            p.note { "So far: the limits leave it open, more trials may turn it. None is taken for none in a thousand." }
        }
        section {
            h2 { "Detection against theory" }
            p { "Strength is the matched-filter SNR ρ over the rows that the tool fits. Theory: a noncentral chi-squared "
                "beyond the tool's own threshold, its kinds counted. Bars: 95 % of a binomial." }
            div.pair {
                figure { figcaption { "Six-parameter effects at fixed strengths" } (curve(&scores.ladder)) }
                figure { figcaption { "All single effects" } (curve(&scores.by_strength)) }
            }
            p.legend {
                span.key { (swatch("#0072B2", "none", "2.5")) "measured" }
                span.key { (swatch("#222222", "6 4", "2")) "theory" }
            }
        }
        section {
            h2 { "Intervals" }
            p { "One parameter of each named trial: where the truth lies in the tool's own distribution. On the diagonal "
                "the intervals are right; above it on the left and beneath it on the right they are too narrow. Dashes: where a "
                "right law stays 19 times in 20." }
            div.pair { figure { figcaption { "P–P plot, " (scores.chances.len()) " parameters" } (agreement(&scores.chances)) } }
        }
        section { h2 { "Effect-free records" } (nulls(&scores.nulls)) }
        section { h2 { "By kind, ρ ≥ " (NAMEABLE) } (kinds(&scores.by_kind)) }
        section { h2 { "Concealed and reported effects" } (confusion(&scores.confusion)) }
        @if !scores.to_repeat.is_empty() {
            section {
                h2 { "Wrong, to repeat" }
                div.scroll { table {
                    thead { tr { th { "trial" } th { "record" } th { "ρ" } th { "concealed" } th { "claimed" } } }
                    tbody { @for one in &scores.to_repeat {
                        tr {
                            td.number { (one.trial) }
                            td { (one.setting) }
                            td.number { (number(one.rho)) }
                            td { @if one.concealed.is_empty() { "nothing" } @else { (one.concealed.join(" + ")) } }
                            td { (one.claimed.join(", ")) }
                        }
                    } }
                } }
                p.note { "rlg challenge --seed " (scores.plan.seed) " --trials " (scores.plan.trials) " --trial N --out DIR" }
            }
        }
        section.data { details { summary { "All numbers (challenge.json)" } pre { (json) } } }
    };
    super::document("Blind challenge", &main)
}

fn marks(marks: &[Mark]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "mark" } th { "needed" } th { "measured" } th { "95 %" } th { "trials" } th {} } }
            tbody { @for mark in marks {
                tr {
                    td { (mark.mark) }
                    td.number { (mark.needed) }
                    td.number { @if let Some(measured) = mark.measured { (number(measured)) } @else { "–" } }
                    td.number { @if mark.measured.is_some() { (number(mark.limits[0])) " to " (number(mark.limits[1])) } }
                    td.number { (mark.trials) }
                    td {
                        @match mark.met { Some(true) => "met", Some(false) => { b { "missed" } }, None => "no trials" }
                        @if mark.met.is_some() && !mark.sure { " so far" }
                    }
                }
            } }
        } }
    }
}

fn curve(strengths: &[Strength]) -> Markup {
    let points: Vec<(f64, f64, [f64; 2], f64)> = strengths
        .iter()
        .filter(|one| one.counts.trials > 0)
        .map(|one| {
            let share = one.counts.detected as f64 / one.counts.trials as f64;
            (
                (one.from * one.to).sqrt(),
                share,
                one.detected_limits,
                one.theory,
            )
        })
        .collect();
    plot(
        "Detected share against matched-filter SNR",
        HEIGHT,
        |area| {
            let low = points.first().map_or(3.0, |point| 0.9 * point.0);
            let high = points
                .last()
                .map_or(100.0, |point| 1.1 * point.0)
                .max(1.5 * low);
            let mut chart = builder(area).build_cartesian_2d((low..high).log_scale(), 0.0..1.02)?;
            frame(
                &mut chart,
                &Axes {
                    x_title: "matched-filter SNR ρ",
                    y_title: "detected",
                    x_number: &|rho| number(*rho),
                    y_number: &|share| number(*share),
                    y_count: 6,
                },
            )?;
            for (rho, share, [below, above], _) in &points {
                chart.draw_series(LineSeries::new(
                    [(*rho, *below), (*rho, *above)],
                    AFTER.stroke_width(FINE),
                ))?;
                chart.draw_series([Circle::new((*rho, *share), 3 * FINE, AFTER.filled())])?;
            }
            let theory: Vec<(f64, f64)> = points.iter().map(|point| (point.0, point.3)).collect();
            let dashes =
                DashedLineSeries::new(theory, 6 * FINE, 4 * FINE, INK.stroke_width(FINE * 3 / 2));
            chart.draw_series(dashes)?;
            Ok(())
        },
    )
}

fn agreement(chances: &[f64]) -> Markup {
    plot(
        "Share of parameters below a chance, against the chance",
        HEIGHT,
        |area| {
            let mut chart = builder(area).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
            frame(
                &mut chart,
                &Axes {
                    x_title: "chance",
                    y_title: "share of parameters",
                    x_number: &|chance| number(*chance),
                    y_number: &|share| number(*share),
                    y_count: 6,
                },
            )?;
            chart.draw_series(LineSeries::new(
                [(0.0, 0.0), (1.0, 1.0)],
                INK.stroke_width(FINE),
            ))?;
            let count = chances.len().max(1) as f64;
            let steps = chances
                .iter()
                .enumerate()
                .map(|(rank, chance)| (*chance, (rank as f64 + 0.5) / count));
            chart.draw_series(LineSeries::new(steps, AFTER.stroke_width(2 * FINE)))?;
            // Kolmogorov–Smirnov band, 95 %: a correct distribution leaves it once in twenty times.
            for side in [-1.0, 1.0] {
                let band = side * 1.358 / count.sqrt();
                let line = [(0.0, band), (1.0, 1.0 + band)];
                let inside = line.map(|(x, y): (f64, f64)| (x, y));
                chart.draw_series(DashedLineSeries::new(
                    inside,
                    4 * FINE,
                    4 * FINE,
                    BEFORE.stroke_width(FINE),
                ))?;
            }
            Ok(())
        },
    )
}

fn nulls(nulls: &BTreeMap<String, Counts>) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "record" } th { "trials" } th { "false names" } th { "at most (95 %)" } th { "anything said" } } }
            tbody { @for (setting, counts) in nulls {
                tr {
                    td { (setting.replace('_', " ")) }
                    td.number { (counts.trials) }
                    td.number { (counts.misnamed) }
                    td.number { (number(upper_limit(counts.misnamed, counts.trials))) }
                    td.number { (counts.detected) }
                }
            } }
        } }
    }
}

fn kinds(kinds: &BTreeMap<String, Counts>) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "concealed" } th { "trials" } th { "detected" } th { "named" } th { "wrong name" } } }
            tbody { @for (kind, counts) in kinds {
                tr {
                    td { (kind) }
                    td.number { (counts.trials) } td.number { (counts.detected) }
                    td.number { (counts.named) } td.number { (counts.misnamed) }
                }
            } }
        } }
    }
}

fn confusion(confusion: &BTreeMap<String, BTreeMap<String, usize>>) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "concealed alone" } th { "said" } } }
            tbody { @for (kind, said) in confusion {
                tr {
                    td { (kind) }
                    td { @for (place, (name, count)) in said.iter().enumerate() {
                        @if place > 0 { ", " }
                        (name) " × " (count)
                    } }
                }
            } }
        } }
        p.note { "“a or b”: reported as a class that this recording cannot separate." }
    }
}
