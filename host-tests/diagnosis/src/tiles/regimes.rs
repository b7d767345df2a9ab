//! Stretches of like motion.

use std::ops::Range;

use rlg_plan::RegimePlan;
use rlg_signal::streams::Streams;

/// A stretch of like motion.
#[derive(Debug, Clone)]
pub struct Regime {
    /// Its name in the recording, or its time.
    pub name: String,
    /// Its rows.
    pub rows: Range<usize>,
}

/// Returns stretches of like motion that cover the rows: the named ones, or even ones.
pub fn regimes_of(streams: &Streams, plan: &RegimePlan) -> Vec<Regime> {
    let (segments, rate_hz) = (&streams.piece.segments, streams.rate_hz);
    if streams.at_rest.is_some() {
        return at_rest(streams, plan);
    }
    let own_s = |row: f64| streams.start_s + row / rate_hz;
    let row_at = |time_s: f64| {
        let row = ((time_s - streams.start_s) * rate_hz).round().max(0.0) as usize;
        row.min(streams.rows)
    };
    let mut cuts: Vec<usize> = segments
        .iter()
        .flat_map(|segment| [segment.start_s, segment.end_s])
        .map(row_at)
        .chain([0, streams.rows])
        .collect();
    if segments.is_empty() {
        let stretch = (plan.unnamed_s * rate_hz) as usize;
        cuts.extend((0..streams.rows).step_by(stretch.max(1)));
    }
    cuts.sort_unstable();
    cuts.dedup();
    cuts.windows(2)
        .map(|pair| {
            let rows = pair[0]..pair[1];
            let middle_s = own_s(((rows.start + rows.end) / 2) as f64 + 0.5);
            let name = segments
                .iter()
                .find(|segment| segment.start_s <= middle_s && middle_s < segment.end_s)
                .map(|segment| segment.name.clone());
            let name = name.unwrap_or_else(|| {
                format!(
                    "{:.0} to {:.0} s",
                    own_s(rows.start as f64 + 0.5),
                    own_s(rows.end as f64 - 0.5)
                )
            });
            Regime { name, rows }
        })
        .collect()
}

/// Returns stretches for localisation only: a unit at rest has one motion.
fn at_rest(streams: &Streams, plan: &RegimePlan) -> Vec<Regime> {
    let stretch = (plan.unnamed_s * streams.rate_hz) as usize;
    let stretch = stretch.max(streams.rows.div_ceil(plan.most_at_rest)).max(1);
    (0..streams.rows)
        .step_by(stretch)
        .map(|start| {
            let rows = start..(start + stretch).min(streams.rows);
            let name = format!(
                "{:.0} to {:.0} s",
                streams.middle_s(rows.start),
                streams.middle_s(rows.end - 1)
            );
            Regime { name, rows }
        })
        .collect()
}

/// The rows common to both lists.
pub fn intersect(ranges: &[Range<usize>], others: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut common = Vec::new();
    for range in ranges {
        for other in others {
            let rows = range.start.max(other.start)..range.end.min(other.end);
            if !rows.is_empty() {
                common.push(rows);
            }
        }
    }
    common.sort_by_key(|rows: &Range<usize>| rows.start);
    common
}
