//! What a gyro's rate wanders by where no physics moves it: nothing, a random walk from wherever it was or from
//! nothing, or flicker, of any strength.
//!
//! Enters: the bench, for its rows; a gyro's noise. Leaves: rows summed over [`Blocks`], and the covariance of such
//! sums under each [`Wander`], as it is in time: periodograms of a walk leak, stretches of it do not fit together at
//! their joints, and its mean depends on where it began, so that a Whittle likelihood of a few modes is no judge.
//!
//! A block's edges are soft: white noise of angle, which counters have much of, is in a single reading whole, and in the
//! mean of some dozens next to none; a block turns from the mean of those about its beginning to that about its end.
//!
//! Left out: what gyros share, walks and flicker at once (one of them is nearly always the better), and what is
//! faster than half the blocks' rate.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::ops::Range;

use super::noise::Noise;
use super::workbench::Workbench;

/// Blocks of a portion, in their gyros' noise: the work grows with the cube of their number.
const MOST_BLOCKS: f64 = 160.0;

/// Fewer have no room for a dozen columns and a walk.
const FEWEST_BLOCKS: usize = 24;

/// No block is shorter \[s\]: white noise of angle would fill it.
const SHORTEST_BLOCK_S: f64 = 0.25;

/// Variance that the rate gathers over the recording, over that of a block's white noise: from nothing to a thousand,
/// or to what the blocks differ by.
const WEAKEST: f64 = 1e-4;
const STRONGEST: f64 = 1e3;

/// Strengths of each kind between the two.
const STRENGTHS: usize = 20;

/// Sums of a portion's rows over blocks, none of which crosses a joint.
pub struct Blocks {
    /// The scene's rows in each.
    pub scene_rows: Vec<Range<usize>>,
    /// Which recording each is of.
    pub recordings: Vec<usize>,
    /// Rows in a block.
    pub rows: usize,
    /// Highest frequency that blocks show \[Hz\].
    pub edge_hz: f64,
    /// Places in the portion's rows, end to end.
    places: Vec<Range<usize>>,
    /// Unit variance over the span, of each kind that is asked about.
    kinds: Vec<(Drift, DMatrix<f64>)>,
}

/// Kinds of drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drift {
    /// A random walk that went on before the recording began.
    Walk,
    /// A random walk that began with the recording, as one in a simulation does.
    FromNothing,
    /// Power as 1/f.
    Flicker,
}

impl Drift {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Walk, Self::FromNothing, Self::Flicker];
}

/// One way for the rate to wander.
pub struct Wander {
    /// Which; `None` where it does not.
    pub kind: Option<Drift>,
    /// ln of the determinant of the sums' covariance.
    pub log_volume: f64,
    root: DMatrix<f64>,
}

impl Wander {
    /// Turns columns of sums into such as white noise of unit variance stands in.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        self.root.solve_lower_triangular_mut(columns);
    }
}

impl Blocks {
    /// Of the bench's portion, for some kinds of drift; `None` where there are too few to tell a walk from anything.
    pub fn of(bench: &Workbench, kinds: &[Drift]) -> Option<Self> {
        let portion = &bench.portion;
        let streams = &bench.scene().streams;
        let block_s = (portion.seconds() / MOST_BLOCKS).max(SHORTEST_BLOCK_S);
        let rows = ((block_s * streams.rate_hz).round() as usize).max(1);
        let (mut places, mut scene_rows) = (Vec::new(), Vec::new());
        let mut before = 0;
        let soft_rows = soft(rows);
        for range in &portion.ranges {
            let inside = range.len().saturating_sub(2 * soft_rows);
            for block in 0..inside / rows {
                let first = soft_rows + block * rows;
                places.push(before + first..before + first + rows);
                scene_rows.push(range.start + first..range.start + first + rows);
            }
            before += range.len();
        }
        if places.len() < FEWEST_BLOCKS {
            return None;
        }
        let recording = |own: &Range<usize>| {
            let mut pieces = streams.pieces.iter();
            pieces.position(|one| one.rows.contains(&(own.start + rows / 2)))
        };
        let recordings: Vec<usize> = scene_rows
            .iter()
            .map(|own| recording(own).unwrap_or(0))
            .collect();
        let rate_hz = streams.rate_hz;
        let blocks = Self::over(scene_rows, places, recordings, rate_hz, kinds);
        Some(blocks)
    }

    /// Blocks of as many rows each, at places end to end, of recordings by number.
    pub(super) fn over(
        scene_rows: Vec<Range<usize>>,
        places: Vec<Range<usize>>,
        recordings: Vec<usize>,
        rate_hz: f64,
        kinds: &[Drift],
    ) -> Self {
        let rows = places[0].len();
        let middle = |own: &Range<usize>| (own.start + rows / 2) as f64 / rate_hz;
        let middles_s: Vec<f64> = scene_rows.iter().map(middle).collect();
        let block_s = rows as f64 / rate_hz;
        let of = |kind: &Drift| match kind {
            Drift::Walk => walk(&middles_s).add_scalar(1.0),
            Drift::FromNothing => walk(&middles_s),
            Drift::Flicker => flicker(&middles_s, block_s),
        };
        let mut kinds: Vec<(Drift, DMatrix<f64>)> =
            kinds.iter().map(|kind| (*kind, of(kind))).collect();
        for (_, kind) in &mut kinds {
            // Another recording began elsewhere.
            for (a, of_a) in recordings.iter().enumerate() {
                for (b, of_b) in recordings.iter().enumerate() {
                    if of_a != of_b {
                        kind[(a, b)] = 0.0;
                    }
                }
            }
        }
        Self {
            scene_rows,
            recordings,
            rows,
            edge_hz: 0.5 * rate_hz / rows as f64,
            places,
            kinds,
        }
    }

    /// The shape that most of a walk from nothing has: a quarter of a sine over each recording.
    pub fn first_mode(&self) -> DVector<f64> {
        let span = |block: usize| {
            let others = self.scene_rows.iter().zip(&self.recordings);
            let own = others.filter(|(_, other)| **other == self.recordings[block]);
            own.fold((usize::MAX, 0), |(first, last), (rows, _)| {
                (first.min(rows.start), last.max(rows.end))
            })
        };
        DVector::from_fn(self.count(), |block, _| {
            let (first, last) = span(block);
            let middle = self.scene_rows[block].start + self.rows / 2 - first;
            (0.25 * TAU * middle as f64 / (last - first) as f64).sin()
        })
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// What the portion's rows turn by over each block.
    pub fn sums(&self, rows: &[f64]) -> DVector<f64> {
        let places = self.places.iter().cloned();
        DVector::from_vec(sums_between_soft_edges(rows, soft(self.rows), places))
    }

    /// Of what begins at a block's start, the share of a block that the block before it shows.
    pub fn spilt(&self) -> f64 {
        0.25 * soft(self.rows) as f64 / self.rows as f64
    }

    /// Every way to wander beside a gyro's white noise; `residual` says how strong the strongest is to be.
    pub fn wanders(&self, noise: &Noise, residual: &DVector<f64>) -> Vec<Wander> {
        let [angle_walk, white, ..] = noise.theta;
        let steady = self.steady(angle_walk, white);
        let level = steady.diagonal().mean();
        let neighbours = residual.as_slice().windows(2);
        let steps: f64 = neighbours.map(|pair| (pair[1] - pair[0]).powi(2)).sum();
        let strongest = STRONGEST.max(steps / level);
        let ratio = (strongest / WEAKEST).powf(1.0 / (STRENGTHS - 1) as f64);
        let of = |(kind, covariance): (Option<Drift>, DMatrix<f64>)| {
            let root = covariance.cholesky()?.unpack();
            let log_volume = root.diagonal().iter().map(|d| 2.0 * d.ln()).sum();
            Some(Wander {
                kind,
                log_volume,
                root,
            })
        };
        let each = self.kinds.iter().flat_map(|(kind, shape)| {
            let strengths = (0..STRENGTHS).map(|k| WEAKEST * ratio.powi(k as i32));
            let steady = &steady;
            strengths.map(move |strength| (Some(*kind), steady + shape * (strength * level)))
        });
        std::iter::once((None, steady.clone()))
            .chain(each)
            .filter_map(of)
            .collect()
    }

    /// Covariance of the noise without drift: a walk of the angle, and white noise of it; neighbours share an edge.
    fn steady(&self, walk: f64, white: f64) -> DMatrix<f64> {
        // Σ r (1 − r) over the rows of an edge, r rising evenly from one block's to the other's.
        let soft = soft(self.rows) as f64;
        let shared = match soft {
            0.0 => 0.0,
            _ => (4.0 * soft * soft - 1.0) / (12.0 * soft),
        };
        let white = white / (2.0 * soft).max(1.0);
        DMatrix::from_fn(self.places.len(), self.places.len(), |a, b| {
            let adjoin = self.places[a].end == self.places[b].start
                || self.places[b].end == self.places[a].start;
            match (a == b, adjoin) {
                (true, _) => (self.rows as f64 - 2.0 * shared) * walk + 2.0 * white,
                (_, true) => shared * walk - white,
                _ => 0.0,
            }
        })
    }
}

/// Rows on either side of a block's edge that are taken together: half of them are the edge's, half the block's own.
pub fn soft(rows: usize) -> usize {
    rows / 4
}

/// What rows turn by over each of some places, the angle at an edge being the mean of `soft` readings on either side.
pub fn sums_between_soft_edges(
    rows: &[f64],
    soft: usize,
    places: impl Iterator<Item = Range<usize>>,
) -> Vec<f64> {
    let mut turned = vec![0.0];
    turned.extend(rows.iter().scan(0.0, |sum, row| {
        *sum += row;
        Some(*sum)
    }));
    let angle = |edge: usize| match soft {
        0 => turned[edge],
        _ => turned[edge - soft..edge + soft].iter().sum::<f64>() / (2 * soft) as f64,
    };
    places
        .map(|place| angle(place.end) - angle(place.start))
        .collect()
}

/// Covariance of a walk that gathers unit variance over the span.
fn walk(middles_s: &[f64]) -> DMatrix<f64> {
    let first_s = middles_s[0];
    let span_s = middles_s[middles_s.len() - 1] - first_s;
    DMatrix::from_fn(middles_s.len(), middles_s.len(), |a, b| {
        (middles_s[a].min(middles_s[b]) - first_s) / span_s
    })
}

/// Covariance of flicker of unit variance, from a sixteenth of the span's frequency to the blocks' band.
fn flicker(middles_s: &[f64], block_s: f64) -> DMatrix<f64> {
    const BELOW: f64 = 16.0;
    const LINES: i32 = 240;
    let span_s = middles_s[middles_s.len() - 1] - middles_s[0];
    let (least_hz, most_hz) = (1.0 / (BELOW * span_s), 0.5 / block_s);
    let ratio = (most_hz / least_hz).powf(1.0 / f64::from(LINES - 1));
    // As many lines in each octave, all alike: power falls as 1/f.
    let lines: Vec<f64> = (0..LINES).map(|k| TAU * least_hz * ratio.powi(k)).collect();
    let power = f64::from(LINES).recip();
    let mut covariance = DMatrix::zeros(middles_s.len(), middles_s.len());
    for a in 0..middles_s.len() {
        for b in 0..=a {
            let apart_s = middles_s[a] - middles_s[b];
            let sum: f64 = lines.iter().map(|line| (line * apart_s).cos()).sum();
            covariance[(a, b)] = power * sum;
            covariance[(b, a)] = power * sum;
        }
    }
    covariance
}
