//! Which rows are fitted, which are held out, and where the motion is of one kind.
//!
//! Enters: segments of the recording and the mask of usable rows. Leaves: [`Split`]. Time is always cut in
//! contiguous stretches: neighbouring rows share their noise, so random folds would leak.

use std::ops::Range;

use rlg_signal::pieces::Piece;
use rlg_signal::streams::Streams;

/// Share of each stretch of like motion that is kept for validation, at its end.
pub const HELD_OUT_SHARE: f64 = 0.3;

/// Shorter stretches than this are fitted whole: they would leave nothing to validate on.
pub const SHORTEST_SPLIT_S: f64 = 2.0;

/// Where a recording names no segments, stretches of this length stand in for them.
pub const UNNAMED_STRETCH_S: f64 = 5.0;

/// A stretch of like motion.
#[derive(Debug, Clone)]
pub struct Regime {
    /// Its name in the recording, or its time.
    pub name: String,
    /// Its rows.
    pub rows: Range<usize>,
}

/// The recording, cut.
pub struct Split {
    /// Stretches of like motion that cover the recording.
    pub regimes: Vec<Regime>,
    /// Rows to locate, select and estimate on.
    pub fitted: Vec<Range<usize>>,
    /// Rows to validate on, never seen before.
    pub held_out: Vec<Range<usize>>,
}

/// Of what is fitted of a stretch that is held out inside, this fraction lies behind what is held out.
const BEHIND: usize = 3;

/// Which part of a stretch is held out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Its last.
    End,
    /// As much inside, so that both ends are fitted and what acts at one of them is held out as well.
    Inside,
}

/// Whether the rows can be cut elsewhere in their stretches: not those of a unit at rest, nor where a recording is held out
/// as a whole.
pub fn can_be_cut_otherwise(streams: &Streams) -> bool {
    let is_cut = |piece: &Piece| piece.origin.is_none() && !piece.held_out;
    streams.at_rest.is_none() && streams.pieces.iter().all(is_cut)
}

/// Cuts the recordings. One that is held out as a whole is not fitted anywhere; where a stretch of a longer one ends is
/// said before.
pub fn split(streams: &Streams, part: Part) -> Split {
    if streams.at_rest.is_some() {
        return in_halves(streams);
    }
    let mut regimes = Vec::new();
    let (mut fitted, mut held_out) = (Vec::new(), Vec::new());
    for piece in &streams.pieces {
        for regime in regimes_of(streams, piece) {
            let rows = regime.rows.clone();
            let shortest = (SHORTEST_SPLIT_S * streams.rate_hz) as usize;
            let cut = if let Some(origin) = &piece.origin {
                // A stretch of a longer recording is cut where all of it is.
                let since_s = origin.held_out_from_s - piece.start_s;
                let row = (since_s * streams.rate_hz).round().max(0.0);
                (piece.rows.start + row as usize).clamp(rows.start, rows.end)
            } else if piece.held_out {
                rows.start
            } else if rows.len() < shortest {
                rows.end
            } else {
                rows.end - (rows.len() as f64 * HELD_OUT_SHARE) as usize
            };
            let mut unseen = cut..rows.end;
            if part == Part::Inside && can_be_cut_otherwise(streams) {
                // Less than half of the stretch: what is behind it is fitted, too.
                let behind = (rows.len() - unseen.len()) / BEHIND;
                unseen = cut - behind..rows.end - behind;
            }
            for own in [rows.start..unseen.start, unseen.end..rows.end] {
                fitted.extend(usable_runs(&streams.usable, own));
            }
            held_out.extend(usable_runs(&streams.usable, unseen));
            regimes.push(regime);
        }
    }
    Split {
        regimes,
        fitted: join_touching(fitted, &streams.pieces),
        held_out: join_touching(held_out, &streams.pieces),
    }
}

/// The stretches of like motion of one recording.
fn regimes_of(streams: &Streams, piece: &Piece) -> Vec<Regime> {
    let (segments, rate_hz) = (&piece.segments, streams.rate_hz);
    let own_s = |row: f64| piece.start_s + (row - piece.rows.start as f64) / rate_hz;
    let row_at = |time_s: f64| {
        let row = ((time_s - piece.start_s) * rate_hz).round().max(0.0) as usize;
        piece.rows.start + row.min(piece.rows.len())
    };
    let mut cuts: Vec<usize> = segments
        .iter()
        .flat_map(|segment| [segment.start_s, segment.end_s])
        .map(row_at)
        .chain([piece.rows.start, piece.rows.end])
        .collect();
    if segments.is_empty() {
        let stretch = (UNNAMED_STRETCH_S * rate_hz) as usize;
        cuts.extend(piece.rows.clone().step_by(stretch.max(1)));
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
            let name = match streams.is_joined() {
                true => format!("{}: {name}", piece.recording),
                false => name,
            };
            Regime { name, rows }
        })
        .collect()
}

/// A unit at rest has one motion: the first half is fitted, the second held out, so that what is found must
/// go on as it was.
fn in_halves(streams: &Streams) -> Split {
    /// Stretches to locate in; few enough that each holds many periods of what drifts.
    const STRETCHES: usize = 16;
    let stretch = (UNNAMED_STRETCH_S * streams.rate_hz) as usize;
    let stretch = stretch.max(streams.rows.div_ceil(STRETCHES)).max(1);
    let regimes = (0..streams.rows)
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
        .collect();
    let half = streams.rows / 2;
    Split {
        regimes,
        fitted: usable_runs(&streams.usable, 0..half),
        held_out: usable_runs(&streams.usable, half..streams.rows),
    }
}

/// Runs of usable rows inside `rows`, those too short to carry information left out.
pub fn usable_runs(usable: &[bool], rows: Range<usize>) -> Vec<Range<usize>> {
    /// A joint costs about this many rows of information at its free jump.
    const SHORTEST_RUN: usize = 64;
    runs_of(usable, rows, SHORTEST_RUN)
}

/// Runs of at least `shortest` usable rows.
pub fn runs_of(usable: &[bool], rows: Range<usize>, shortest: usize) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut row = rows.start;
    while row < rows.end {
        if !usable[row] {
            row += 1;
            continue;
        }
        let begin = row;
        while row < rows.end && usable[row] {
            row += 1;
        }
        if row - begin >= shortest {
            runs.push(begin..row);
        }
    }
    runs
}

/// Ranges that touch become one, except across the break between two recordings.
fn join_touching(ranges: Vec<Range<usize>>, pieces: &[Piece]) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last)
                if last.end == range.start
                    && !pieces.iter().any(|piece| piece.rows.start == range.start) =>
            {
                last.end = range.end;
            }
            _ => joined.push(range),
        }
    }
    joined
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

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_signal::streams::Triad;

    #[test]
    fn either_cut_holds_out_as_much_and_sees_every_row_once() {
        let rows = 60_000;
        let still: Triad = [0, 1, 2].map(|_| vec![0.0; rows]);
        let streams = Streams::of_motion(1000.0, still);
        let length =
            |ranges: &[Range<usize>]| ranges.iter().map(ExactSizeIterator::len).sum::<usize>();
        let [end, inside] = [Part::End, Part::Inside].map(|part| split(&streams, part));
        for cut in [&end, &inside] {
            assert!(intersect(&cut.fitted, &cut.held_out).is_empty());
            assert_eq!(length(&cut.fitted) + length(&cut.held_out), rows);
        }
        assert_eq!(length(&end.held_out), length(&inside.held_out));
        for (regime, held_out) in inside.regimes.iter().zip(&inside.held_out) {
            assert!(regime.rows.start < held_out.start && held_out.end < regime.rows.end);
        }
    }
}
