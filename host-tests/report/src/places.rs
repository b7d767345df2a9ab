//! Section on the differences between recording and model: grouped stretches as rows, and maps of time and band.

use maud::{Markup, html};

use super::chart::{self, Numbers};
use super::corrected;
use super::map;
use super::words::{band, chance, display_unit, number, rounded, seconds, spaced, symbols};
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::result::{Diagnosis, LocationEntry, Verdict};
use rlg_recording::AXES;

/// Largest number of table rows; all stretches are in the data at the end of the page.
const MOST_ROWS: usize = 12;

/// Stretches of one channel with the same coherence.
struct Place<'a> {
    channel: &'a str,
    recording: Option<&'a str>,
    /// Channel or product with the strongest coherence, else the relation to the motion.
    with: &'a str,
    members: Vec<&'a LocationEntry>,
}

/// Groups the stretches by channel and coherence, in the order of the first of each.
fn places(locations: &[LocationEntry]) -> Vec<Place<'_>> {
    let mut places: Vec<Place<'_>> = Vec::new();
    for location in locations {
        let strongest = location
            .coherent_with
            .iter()
            .max_by(|a, b| a.coherence.abs().total_cmp(&b.coherence.abs()));
        let with = strongest.map_or(location.regime.as_str(), |one| one.with.as_str());
        let recording = location.recording.as_deref();
        let own = places.iter_mut().find(|place| {
            place.channel == location.channel && place.with == with && place.recording == recording
        });
        match own {
            Some(place) => place.members.push(location),
            None => places.push(Place {
                channel: &location.channel,
                recording,
                with,
                members: vec![location],
            }),
        }
    }
    places
}

/// Section: table of stretches, and maps of the gyros with significant tiles.
pub fn section(diagnosis: &Diagnosis, pictures: Option<&Pictures>) -> Markup {
    if diagnosis.verdict == Verdict::Unusable || diagnosis.locations.is_empty() {
        return html! {};
    }
    let places = places(&diagnosis.locations);
    html! {
        section {
            h2 { "Where it differs" }
            div.scroll { table {
                thead { tr { th { "channel" } th { "time [s]" } th { "band" } th { "largest" } th { "goes with" } th { "chance" } } }
                tbody { @for place in places.iter().take(MOST_ROWS) { (row(place)) } }
            } }
            @if places.len() > MOST_ROWS {
                p.note { "And " (places.len() - MOST_ROWS) " more, in the data at the end of this page." }
            }
            p.note { "Largest: mean or excess in a stretch. Goes with: before anything was fitted. Chance: of noise alone, anywhere in the recording." }
            @if let Some(pictures) = pictures { (maps(diagnosis, pictures)) }
        }
    }
}

fn row(place: &Place<'_>) -> Markup {
    let of = |get: fn(&LocationEntry) -> f64| place.members.iter().map(move |one| get(one));
    let from_s = of(|one| one.start_s).fold(f64::INFINITY, f64::min);
    let to_s = of(|one| one.end_s).fold(f64::NEG_INFINITY, f64::max);
    let low_hz = of(|one| one.low_hz).fold(f64::INFINITY, f64::min);
    let high_hz = of(|one| one.high_hz).fold(0.0, f64::max);
    let largest = of(|one| one.size).max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let least = of(|one| one.p_value).fold(1.0, f64::min);
    let first = place.members[0];
    let (factor, unit) = display_unit(&first.unit);
    let strongest = place
        .members
        .iter()
        .flat_map(|one| &one.coherent_with)
        .filter(|with| with.with == place.with)
        .max_by(|a, b| a.coherence.abs().total_cmp(&b.coherence.abs()));
    html! {
        tr {
            td.number { (spaced(place.channel)) @if let Some(recording) = place.recording { ", " (recording) } }
            td.number {
                @if place.members.len() > 1 { (place.members.len()) " stretches in " }
                (seconds(from_s)) "–" (seconds(to_s))
            }
            td.number { (band(low_hz, high_hz)) }
            td.number { (number(rounded(largest.unwrap_or(f64::NAN) * factor))) " " (unit) }
            td {
                (symbols(place.with))
                @if let Some(with) = strongest {
                    " (coherence " (number(rounded(with.coherence)))
                    @if with.lag_s != 0.0 { ", " (number(rounded(1e3 * with.lag_s))) " ms late" }
                    ", chance " (chance(with.p_value)) ")"
                }
            }
            td.number { (chance(least)) }
        }
    }
}

/// Maps to draw, by gyro and before or after the correction of the found effects: of each gyro with significant tiles.
fn drawn(diagnosis: &Diagnosis, pictures: &Pictures) -> Vec<(usize, bool)> {
    if diagnosis.verdict == Verdict::Unusable || diagnosis.locations.is_empty() {
        return Vec::new();
    }
    let axes = (0..AXES.len()).filter(|axis| map::stands_out(pictures, *axis));
    let when: &[bool] = if corrected(diagnosis) {
        &[false, true]
    } else {
        &[false]
    };
    axes.flat_map(|axis| when.iter().map(move |after| (axis, *after)))
        .collect()
}

/// Data of all maps.
pub fn numbers(diagnosis: &Diagnosis, pictures: &Pictures) -> Vec<Numbers> {
    let maps = drawn(diagnosis, pictures).into_iter();
    maps.map(|(axis, after)| map::numbers(pictures, axis, after))
        .collect()
}

fn maps(diagnosis: &Diagnosis, pictures: &Pictures) -> Markup {
    let shown = drawn(diagnosis, pictures);
    html! {
        @if !shown.is_empty() {
            details {
                summary { "Maps of time and band" }
                (map::legend(pictures))
                div.pair {
                    @for (axis, after) in shown {
                        @let what = if after { "effects found removed" } else { "as recorded" };
                        @let title = format!("Gyro {}, {what}", AXES[axis]);
                        (chart::drawn(&map::id(axis, after), &title, &map::map(pictures, axis, after)))
                    }
                }
            }
        }
    }
}
