//! A recording longer than memory: stretches of it at the full rate, and all of it in sums over blocks of rows.
//!
//! extent → regimes → stretches (rows) → chunks (sums over blocks) → blocks.rs
//!
//! Enters: the folder of a recording and how many rows may be held at once. Leaves: the stretches, evenly over the
//! recording, as pieces of one [`Streams`], and [`Blocks`]: residual and catalogue columns of every row, formed at the
//! full rate chunk by chunk and summed. The stretches answer for the frequencies above [`LONG_SPLIT_HZ`], the blocks
//! for those below, both held out from the same instants on.
//!
//! Held at once: the stretches, one chunk, and the blocks (20 a second, 0.6 kB each); nothing grows faster with the
//! recording's length than the blocks do. Deliberately not here: events and unlisted physics between the stretches, which
//! show in the held-out figures but are not searched for; resonances ([`NOT_TRIED`]), whose columns would have to be
//! formed from all rows for every frequency; units at rest, slower references, CSV and several recordings, which are held
//! whole.

use std::ops::Range;
use std::path::Path;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;

use super::blocks::{Blocks, Column, Sums};
use super::declare::{HELD_OUT_SHARE, LONG_BLOCK_HZ, LONG_CHUNK_S, LONG_SPLIT_HZ, LONG_STRETCHES};
use super::hypotheses::{CATALOGUE, no_effects};
use super::pieces::Origin;
use super::qualify;
use super::residual::residual_rad;
use super::scene::Scene;
use super::split::{Regime, runs_of};
use super::streams::{Streams, Triad};
use super::workbench::Parameters;
use rlg_model::{Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Extent, Recording, Segment};

/// Kinds that are not tried on such a recording, each with those that look like it where they are not.
pub const NOT_TRIED: [(&str, &[&str]); 2] = [
    ("axis_flexure_mode", &["axis_flexure", "axis_flexure_cubic"]),
    (
        "isolator_mode",
        &["elastic_rate_by_jerk", "gyro_delay", "reference_delay"],
    ),
];

/// Seconds read on either side of a chunk, so that its columns' spectra do not end where it does: temperature, the
/// slowest of them, is smoothed over two.
const AROUND_S: f64 = 4.0;

/// Seconds at either end of a stretch that only feed its spectra: a motion that is cut off leaves its filtered rate
/// and acceleration wrong for a few periods of the lowest band edge, 10 Hz, and that would pass for physics.
const STRETCH_ENDS_S: f64 = 0.5;

/// A stretch must have this many times the length of its two ends.
const LEAST_OF_ENDS: f64 = 4.0;

/// Blocks between which a joint is worth its free jump.
const SHORTEST_RUN: usize = 8;

/// The recording and how it is cut.
pub struct Long<'a> {
    folder: &'a Path,
    model: &'a Model,
    model_file: &'a Path,
    extent: Extent,
    /// Rows of the stretches, of the recording, each with its regime.
    stretches: Vec<(Range<usize>, usize)>,
    /// Stretches of like motion, of the recording, each with the row from which on it is held out.
    regimes: Vec<(Range<usize>, usize)>,
}

impl<'a> Long<'a> {
    /// Cuts a recording of which `most_rows` may be held at once; `None` where all of it may, or must.
    pub fn new(
        folder: &'a Path,
        model: &'a Model,
        model_file: &'a Path,
        most_rows: usize,
    ) -> Result<Option<Self>, InputError> {
        if model.motion != MotionSource::Reference {
            return Ok(None);
        }
        let Some(extent) = Recording::extent(folder)?.filter(|extent| extent.rows > most_rows)
        else {
            return Ok(None);
        };
        let share = most_rows as f64 / extent.rows as f64;
        let least = LEAST_OF_ENDS * 2.0 * STRETCH_ENDS_S * extent.rate_hz;
        let regimes = regimes(&extent, least / share);
        let stretches = stretches(&regimes, most_rows);
        Ok(Some(Self {
            folder,
            model,
            model_file,
            extent,
            stretches,
            regimes,
        }))
    }

    /// Seconds of the recording.
    pub fn seconds(&self) -> f64 {
        self.extent.rows as f64 / self.extent.rate_hz
    }

    /// Reads the stretches, then everything once, chunk by chunk. `progress` is told the share that is done.
    pub fn read(&self, progress: &dyn Fn(f64)) -> Result<(Vec<Streams>, Blocks), InputError> {
        let mut pieces = self
            .stretches
            .iter()
            .map(|(rows, _)| self.streams(rows))
            .collect::<Result<Vec<Streams>, InputError>>()?;
        let ends = (STRETCH_ENDS_S * self.extent.rate_hz) as usize;
        for streams in &mut pieces {
            let last = streams.rows.saturating_sub(ends);
            streams.usable[..ends.min(last)].fill(false);
            streams.usable[last..].fill(false);
        }
        let firsts: Vec<usize> = pieces.iter().map(|one| self.first_row(one)).collect();
        let (sums, origins) = self.sums(&firsts, progress)?;
        for ((streams, origin), (_, regime)) in pieces.iter_mut().zip(origins).zip(&self.stretches)
        {
            let (rows, cut) = &self.regimes[*regime];
            let piece = &mut streams.pieces[0];
            piece.origin = Some(Origin {
                held_out_from_s: self.at_s(*cut),
                ..origin
            });
            // One stretch, one motion, by the name it has in blocks.
            piece.segments = vec![Segment {
                name: self.name_of(rows),
                kind: String::new(),
                start_s: self.at_s(rows.start),
                end_s: self.at_s(rows.end),
            }];
        }
        let too_few = || {
            InputError::new(self.folder, "has too few rows with all channels measured")
                .expected("a few seconds in a row of gyros, pickoffs and reference")
        };
        Ok((pieces, self.blocks(sums).ok_or_else(too_few)?))
    }

    fn at_s(&self, row: usize) -> f64 {
        self.extent.start_s + row as f64 / self.extent.rate_hz
    }

    /// The recording's own name of some rows, and their time.
    fn name_of(&self, rows: &Range<usize>) -> String {
        let (start_s, end_s) = (self.at_s(rows.start), self.at_s(rows.end));
        let middle_s = 0.5 * (start_s + end_s);
        let mut segments = self.extent.segments.iter();
        let named = segments.find(|one| one.start_s <= middle_s && middle_s < one.end_s);
        let name = named.map_or(String::new(), |one| format!("{}, ", one.name));
        format!("{name}{start_s:.0} to {end_s:.0} s")
    }

    /// Some rows, aligned.
    fn streams(&self, rows: &Range<usize>) -> Result<Streams, InputError> {
        let (from_s, to_s) = (self.at_s(rows.start), self.at_s(rows.end));
        let recording = Recording::read_between(self.folder, from_s, to_s)?;
        Streams::align(&recording, self.model)
    }

    /// Which row of the recording the first of some streams is.
    fn first_row(&self, streams: &Streams) -> usize {
        let since_s = streams.pieces[0].start_s - self.extent.start_s;
        (since_s * self.extent.rate_hz).round() as usize
    }

    /// Forms residual and columns chunk by chunk and sums them over blocks; and where the rows `firsts` stand.
    fn sums(
        &self,
        firsts: &[usize],
        progress: &dyn Fn(f64),
    ) -> Result<(Formed, Vec<Origin>), InputError> {
        let rate_hz = self.extent.rate_hz;
        let block_rows = ((rate_hz / LONG_BLOCK_HZ).round() as usize).max(1);
        let blocks = self.extent.rows / block_rows;
        let chunk = ((LONG_CHUNK_S * rate_hz) as usize / block_rows).max(1);
        let around = (AROUND_S * rate_hz) as usize;
        let mut formed = Formed::new(block_rows, blocks);
        let mut origin = Origin {
            start_s: self.extent.start_s,
            temperature_k: None,
            start_from_body: UnitQuaternion::identity(),
            seconds: self.seconds(),
            held_out_from_s: f64::INFINITY,
        };
        let mut origins: Vec<Option<Origin>> = vec![None; firsts.len()];
        for first in (0..blocks).step_by(chunk) {
            let core = first..(first + chunk).min(blocks);
            let from = (core.start * block_rows).saturating_sub(around);
            let to = (core.end * block_rows + around).min(self.extent.rows);
            let mut streams = self.streams(&(from..to))?;
            qualify::qualify(&mut streams);
            streams.pieces[0].origin = Some(origin.clone());
            let scene = super::derive(streams, self.model);
            if first == 0 {
                origin.temperature_k = scene.start_temperature_k();
            }
            let offset = self.first_row(&scene.streams);
            let origin_at = |row: usize| Origin {
                start_from_body: scene.start_from_body(row - offset),
                ..origin.clone()
            };
            for (known, row) in origins.iter_mut().zip(firsts) {
                if known.is_none() && (offset..offset + scene.streams.rows).contains(row) {
                    *known = Some(origin_at(*row));
                }
            }
            let residual_rad = residual_rad(&scene, self.model, self.model_file)?;
            formed.add(&scene, &residual_rad, offset, &core);
            // The next chunk's first row, the one that needs the pickoff before it left out, lies in this chunk.
            let next = (core.end * block_rows).saturating_sub(around) + (offset - from);
            if core.end < blocks {
                origin = origin_at(next);
            }
            progress(core.end as f64 / blocks as f64);
        }
        let lost = || InputError::new(self.folder, "changed while it was read");
        let origins = origins.into_iter().map(|one| one.ok_or_else(lost));
        Ok((formed, origins.collect::<Result<_, _>>()?))
    }

    /// Cuts the blocks where the rows are cut.
    fn blocks(&self, formed: Formed) -> Option<Blocks> {
        let rows_per = formed.block_rows;
        let usable = formed.usable();
        let inside = |rows: &Range<usize>| {
            let first = rows.start.div_ceil(rows_per);
            first..(rows.end / rows_per).max(first)
        };
        let (mut fitted, mut held_out, mut regimes) = (Vec::new(), Vec::new(), Vec::new());
        for (rows, cut) in &self.regimes {
            fitted.extend(runs_of(&usable, inside(&(rows.start..*cut)), SHORTEST_RUN));
            held_out.extend(runs_of(&usable, inside(&(*cut..rows.end)), SHORTEST_RUN));
            regimes.push(Regime {
                name: self.name_of(rows),
                rows: inside(rows),
            });
        }
        let rate_hz = self.extent.rate_hz / rows_per as f64;
        let unusable = usable.iter().filter(|usable| !**usable).count();
        let stretches = self.stretches.iter();
        let stretches_s = stretches
            .map(|(rows, _)| [self.at_s(rows.start), self.at_s(rows.end)])
            .collect();
        let sums = Sums {
            rate_hz,
            block_rows: rows_per,
            start_s: self.extent.start_s,
            residual_rad: formed.residual_rad,
            columns: formed.columns,
            regimes,
            fitted,
            held_out,
            stretches_s,
            unusable_s: unusable as f64 / rate_hz,
        };
        Blocks::new(sums, [0.0, LONG_SPLIT_HZ])
    }
}

/// Blocks under way.
struct Formed {
    block_rows: usize,
    measured: Vec<bool>,
    residual_rad: Triad,
    columns: Vec<Column>,
    /// Blocks of each chunk with the number of columns that it has.
    chunks: Vec<(Range<usize>, usize)>,
}

impl Formed {
    fn new(block_rows: usize, blocks: usize) -> Self {
        Self {
            block_rows,
            measured: vec![false; blocks],
            residual_rad: [0, 1, 2].map(|_| vec![0.0; blocks]),
            columns: Vec::new(),
            chunks: Vec::new(),
        }
    }

    /// The blocks `core` from a scene whose first row is row `offset` of the recording.
    fn add(&mut self, scene: &Scene, residual_rad: &Triad, offset: usize, core: &Range<usize>) {
        // The recording's first block may lack the row that only starts the dither.
        let rows = |block: usize| {
            let begin = (block * self.block_rows).max(offset) - offset;
            let end = ((block + 1) * self.block_rows - offset).min(scene.streams.rows);
            begin.min(end)..end
        };
        let spans: Vec<Range<usize>> = core.clone().map(rows).collect();
        for (block, span) in core.clone().zip(&spans) {
            let whole = span.len() == self.block_rows;
            self.measured[block] =
                whole && scene.streams.usable[span.clone()].iter().all(|one| *one);
            for (sums, values) in self.residual_rad.iter_mut().zip(residual_rad) {
                sums[block] = values[span.clone()].iter().sum();
            }
        }
        let parameters = Parameters::of_catalogue();
        let at = no_effects();
        let wanted: Vec<(usize, usize)> = (0..parameters.count())
            .flat_map(|index| (0..3).map(move |axis| (index, axis)))
            .collect();
        let found: Vec<(usize, usize, Vec<f32>)> = wanted
            .into_par_iter()
            .filter_map(|(index, axis)| {
                let id = parameters.id(index)?;
                let entry = CATALOGUE[id.effect];
                let resonance = !entry.stands_behind().is_empty();
                if resonance || entry.missing(scene).is_some() {
                    return None;
                }
                let column = entry.column(scene, &at[id.effect], id.parameter, axis)?;
                let sum = |span: &Range<usize>| column[span.clone()].iter().sum::<f64>() as f32;
                Some((index, axis, spans.iter().map(sum).collect()))
            })
            .collect();
        self.chunks.push((core.clone(), found.len()));
        for (index, axis, sums) in found {
            let mut known = self.columns.iter();
            let known = known.position(|c| (c.index, c.axis) == (index, axis));
            let place = known.unwrap_or_else(|| {
                self.columns.push(Column {
                    index,
                    axis,
                    sums: vec![0.0; self.measured.len()],
                });
                self.columns.len() - 1
            });
            self.columns[place].sums[core.clone()].copy_from_slice(&sums);
        }
    }

    /// The blocks that count: a chunk in which a channel was mostly gap lacks columns that others have.
    fn usable(&self) -> Vec<bool> {
        let mut usable = self.measured.clone();
        for (core, columns) in &self.chunks {
            if *columns < self.columns.len() {
                usable[core.clone()].fill(false);
            }
        }
        usable
    }
}

/// Rows of the longest regimes, as many as may be held, around where the held-out share of each begins; each with its
/// regime.
fn stretches(regimes: &[(Range<usize>, usize)], most_rows: usize) -> Vec<(Range<usize>, usize)> {
    let mut longest: Vec<usize> = (0..regimes.len()).collect();
    longest.sort_by_key(|&regime| std::cmp::Reverse(regimes[regime].0.len()));
    // As many of the recording's own short segments as there would be of even ones.
    longest.truncate(LONG_STRETCHES);
    let rows: usize = longest.iter().map(|&regime| regimes[regime].0.len()).sum();
    let share = (most_rows as f64 / rows as f64).min(1.0);
    longest.sort_unstable();
    let stretch = |regime: usize| {
        let (rows, cut) = &regimes[regime];
        let before = ((cut - rows.start) as f64 * share) as usize;
        let after = ((rows.end - cut) as f64 * share) as usize;
        (cut - before..cut + after, regime)
    };
    longest.into_iter().map(stretch).collect()
}

/// Stretches of like motion, each with the row from which on it is held out: the named ones, or even ones.
/// None is cut to less than `least` rows.
fn regimes(extent: &Extent, least: f64) -> Vec<(Range<usize>, usize)> {
    let row = |time_s: f64| {
        let row = (time_s - extent.start_s) * extent.rate_hz;
        (row.round().max(0.0) as usize).min(extent.rows)
    };
    let of_segment = |segment: &Segment| [row(segment.start_s), row(segment.end_s)];
    let mut cuts: Vec<usize> = extent.segments.iter().flat_map(of_segment).collect();
    cuts.extend([0, extent.rows]);
    cuts.sort_unstable();
    // Long ones in several, so that what is looked at closely is spread over them.
    let even = (extent.rows.div_ceil(LONG_STRETCHES) as f64).max(least);
    let between: Vec<usize> = cuts
        .windows(2)
        .flat_map(|pair| {
            let (start, rows) = (pair[0], pair[1] - pair[0]);
            let parts = (rows as f64 / even).round() as usize;
            (1..parts.max(1)).map(move |part| start + rows * part / parts)
        })
        .collect();
    cuts.extend(between);
    cuts.sort_unstable();
    cuts.dedup();
    cuts.windows(2)
        .map(|pair| {
            let held_out = ((pair[1] - pair[0]) as f64 * HELD_OUT_SHARE) as usize;
            (pair[0]..pair[1], pair[1] - held_out)
        })
        .collect()
}
