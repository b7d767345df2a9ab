//! Entries of the unexplained residual: located, and no more.

use rlg_findings::entries::unlisted;
use rlg_findings::result::EffectEntry;
use rlg_signal::streams::{AXES, Streams};

use crate::tiles::locate::Location;

/// Entries of stretches and bands that no effect explains. At rest one entry per gyro: without motion they are not
/// distinguishable.
pub fn unexplained(left: &[Location], streams: &Streams) -> Vec<EffectEntry> {
    match streams.at_rest {
        Some(_) => (0..3)
            .filter_map(|axis| at_rest(left, axis, streams))
            .collect(),
        None => left.iter().map(|one| stretch(one, streams)).collect(),
    }
}

fn stretch(location: &Location, streams: &Streams) -> EffectEntry {
    let [start_s, end_s] = streams.span_of(&location.rows);
    let axis = AXES[location.axis];
    unlisted(
        String::new(),
        format!(
            "Residual of gyro {axis} between {start_s:.1} and {end_s:.1} s at {:.1} to {:.1} Hz: not explained by any effect of the catalogue.",
            location.band_hz.0,
            location.band_hz.1.min(0.5 * streams.rate_hz),
        ),
    )
}

fn at_rest(left: &[Location], axis: usize, streams: &Streams) -> Option<EffectEntry> {
    let here: Vec<&Location> = left.iter().filter(|place| place.axis == axis).collect();
    let first = here.iter().map(|place| place.rows.start).min()?;
    let end = here.iter().map(|place| place.rows.end).max()?;
    let low_hz = here
        .iter()
        .map(|p| p.band_hz.0)
        .fold(f64::INFINITY, f64::min);
    let high_hz = here.iter().map(|p| p.band_hz.1).fold(0.0, f64::max);
    Some(EffectEntry {
        p_value: here.iter().map(|place| place.p_value).fold(1.0, f64::min),
        ..unlisted(
            String::new(),
            format!(
                "Residual of gyro {} exceeds its noise in {} places between {:.1} and {:.1} s, {low_hz:.0} to {:.0} Hz: not explained by any measured channel, located only.",
                AXES[axis],
                here.len(),
                streams.begin_s(first),
                streams.begin_s(end),
                high_hz.min(0.5 * streams.rate_hz),
            ),
        )
    })
}
