//! Section on the comparison of before and after on held-out time.
//!
//! A table (drift \[°/h\], of accelerometers \[µg\], power over noise, p-value of whiteness) and, for each gyro, the
//! spectrum of its residual.

use maud::{Markup, html};

use super::chart::{self, Chart};
use super::corrected;
use super::terminal::{QUIET, quieter};
use super::words::{Scale, chance, number, rounded, spaced};
use rlg_findings::absolute::share_percent;
use rlg_findings::result::{ChannelEntry, Diagnosis, FiguresEntry};
use rlg_recording::AXES;

/// Powers over noise written with three decimals; others have three digits.
const WRITTEN_OUT: std::ops::Range<f64> = 0.1..100.0;

/// Section: table, with the section on locations next to it, and spectra.
pub fn held_out(diagnosis: &Diagnosis, spectra: &[Chart], places: &Markup) -> Markup {
    let both = corrected(diagnosis);
    let channels = &diagnosis.fit.channels;
    html! {
        div.tables {
            @if !channels.is_empty() {
                section {
                    h2 { @if both { "Held-out time, before and after" } @else { "The residual" } }
                    (table(channels, both))
                    (coherence(diagnosis))
                }
            }
            (places)
        }
        (chart::row(spectra))
    }
}

/// Residual relative to the motion, and coherence of readings and prediction by octave.
fn coherence(diagnosis: &Diagnosis) -> Markup {
    let Some(residual) = &diagnosis.residual else {
        return html! {};
    };
    html! {
        p { "Residual: " (share_percent(residual.share_of_motion)) " % of the motion." }
        div.scroll { table.coherence {
            thead { tr {
                th { "coherence of" }
                @for octave in &residual.coherence {
                    th { (number(rounded(octave.low_hz))) "–" (number(rounded(octave.high_hz))) " Hz" }
                }
            } }
            tbody {
                @for (axis, name) in AXES.iter().enumerate() {
                    tr {
                        td.number.name { "gyro " (name) }
                        @for octave in &residual.coherence {
                            td.number { (format!("{:.4}", octave.gyros[axis])) }
                        }
                    }
                }
            }
        } }
        p.note { "Coherence of reading and prediction: 1 = all explained; near 0 where the motion is below the noise, or is another." }
    }
}

fn table(channels: &[ChannelEntry], both: bool) -> Markup {
    // Channels of one unit are displayed in the unit suitable for the largest of them.
    let scale = |channel: &ChannelEntry| {
        let alike = channels.iter().filter(|one| one.unit == channel.unit);
        let drifts = alike.flat_map(|one| {
            [&one.held_out_before, &one.held_out_after].map(|figures| figures.drift_rad_s.abs())
        });
        let unit = channel.unit.unwrap_or("rad/s");
        Scale::of("drift", unit, drifts.fold(0.0, f64::max))
    };
    let drift = |channel: &ChannelEntry, figures: &FiguresEntry| {
        scale(channel).pair(figures.drift_rad_s, figures.drift_std_rad_s)
    };
    let pair = |of: &str, before: String, after: String| {
        html! {
            @if both {
                td.number.was data-of={ (of) " before" } { (before) }
                td.number data-of={ (of) " after" } { (after) }
            } @else {
                td.number data-of=(of) { (after) }
            }
        }
    };
    let power = |value: f64| match WRITTEN_OUT.contains(&value) {
        true => format!("{value:.3}"),
        false => number(rounded(value)),
    };
    html! {
        div.scroll { table.held {
            thead {
                @let span = if both { "2" } else { "1" };
                tr {
                    th {} th colspan=(span) { "drift" } th colspan=(span) { "power, located" }
                    th colspan=(span) { "everywhere" } th colspan=(span) { "white" }
                }
                @if both { tr.second { th {} @for _ in 0..4 { th { "before" } th { "after" } } } }
            }
            tbody {
                @for channel in channels {
                    @let (before, after) = (&channel.held_out_before, &channel.held_out_after);
                    tr {
                        td.number.name { (spaced(&channel.channel)) " [" (scale(channel).unit) "]" }
                        (pair("drift", drift(channel, before), drift(channel, after)))
                        (pair("power", power(before.normalised_power), power(after.normalised_power)))
                        (pair("everywhere", power(before.normalised_power_all), power(after.normalised_power_all)))
                        (pair("white", chance(before.white_p_value), chance(after.white_p_value)))
                    }
                }
            }
        } }
        p.note {
            "Power: over noise, 1 = the noise model's own, in the located stretches"
            @if let Some(first) = channels.first() {
                " (judged up to " (number(first.band_hz[1].round())) " Hz)"
            }
            ", then over everything held out."
            @if let Some(said) = quieter(channels) { " Below " (QUIET) ": " (said) "." }
            " White: p-value of the residual as white noise."
        }
    }
}
