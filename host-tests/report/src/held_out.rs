//! Writes the section that compares before and after on time that was not fitted.
//!
//! It has a table (drift \[°/h\], of accelerometers \[µg\], power over noise, probability of being white) and, for each
//! gyro, its integrated residual and its spectrum.

use maud::{Markup, html};

use super::plot::swatch;
use super::words::{chance, display_unit, number, spaced, with_spread};
use super::{corrected, curves};
use rlg_diagnosis::pictures::Pictures;
use rlg_findings::result::{ChannelEntry, Diagnosis, FiguresEntry};
use rlg_recording::AXES;

/// Writes the section: table and curves.
pub fn held_out(diagnosis: &Diagnosis, pictures: Option<&Pictures>) -> Markup {
    if diagnosis.fit.channels.is_empty() && pictures.is_none() {
        return html! {};
    }
    let both = corrected(diagnosis);
    html! {
        section {
            h2 { @if both { "The proof: before and after, on time that was not fitted" } @else { "The residual" } }
            @if !diagnosis.fit.channels.is_empty() { (table(&diagnosis.fit.channels, both)) }
            @if let Some(pictures) = pictures {
                (legend(both))
                @for (axis, name) in AXES.iter().enumerate() {
                    div.pair {
                        figure {
                            figcaption { "Gyro " (name) ": measured less predicted angle, summed up" }
                            (curves::angle(pictures, axis, both))
                        }
                        figure {
                            figcaption { "Gyro " (name) ": spectrum against the noise model" }
                            (curves::spectrum(pictures, axis, both))
                        }
                    }
                }
            }
        }
    }
}

fn table(channels: &[ChannelEntry], both: bool) -> Markup {
    let row = |channel: &ChannelEntry, when: Option<&str>, figures: &FiguresEntry| {
        let (factor, unit) = display_unit(channel.unit.unwrap_or("rad/s"));
        html! {
            tr.paired[when == Some("before")] {
                td.number { @if when != Some("after") { (spaced(&channel.channel)) } }
                @if let Some(when) = when { td { (when) } }
                td.number {
                    (with_spread(figures.drift_rad_s * factor, figures.drift_std_rad_s * factor))
                    @if channel.unit.is_some() { " " (unit) }
                }
                td.number { (format!("{:.3}", figures.normalised_power)) }
                td.number { (format!("{:.3}", figures.normalised_power_all)) }
                td.number { (chance(figures.white_p_value)) }
            }
        }
    };
    html! {
        div.scroll { table {
            thead { tr {
                th { "channel" }
                @if both { th {} }
                th { "drift [°/h]" } th { "power over noise" } th { "all held-out" } th { "chance of white" }
            } }
            tbody {
                @for channel in channels {
                    @if both {
                        (row(channel, Some("before"), &channel.held_out_before))
                        (row(channel, Some("after"), &channel.held_out_after))
                    } @else {
                        (row(channel, None, &channel.held_out_after))
                    }
                }
            }
        } }
        p.note {
            "Power over noise: 1 = the noise model's own, in the located stretches"
            @if let Some(first) = channels.first() {
                " (judged up to " (number(first.band_hz[1].round())) " Hz)"
            }
            ", then over everything held out. Chance of white: that a residual without structure looks like this."
        }
    }
}

fn legend(both: bool) -> Markup {
    html! {
        p.legend {
            @if both {
                span.key { (swatch("#D55E00", "none", "1.5")) "before: the model as it was" }
                span.key { (swatch("#0072B2", "none", "2.5")) "after: with what was found" }
            } @else {
                span.key { (swatch("#0072B2", "none", "2.5")) "residual" }
            }
            span.key { (swatch("#222222", "6 4", "2")) "noise model" }
            span.key {
                svg.swatch viewBox="0 0 22 14" aria-hidden="true" { rect width="22" height="14" fill="#E6ECF2" {} }
                "held-out time"
            }
        }
    }
}
