//! Rests and turns of the gyros: mean rates at the positions, rows between them.

use std::ops::Range;

use nalgebra::Vector3;
use rlg_model::Model;
use rlg_plan::Plan;
use rlg_recording::Recording;
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::qualify;
use rlg_signal::still::shown_rad;
use rlg_signal::streams::Streams;

use super::super::still::{Position, squares_about_mean};

/// Rest at one position.
#[derive(Debug, Clone)]
pub struct Rest {
    /// Mean rate \[rad/s\], x y z.
    pub mean_rad_s: Vector3<f64>,
    /// Measured duration \[s\].
    pub length_s: f64,
}

/// Turn from one position to the next.
#[derive(Debug, Clone)]
pub struct Turn {
    /// Place of the position before; that behind is the next.
    pub from: usize,
    /// Increments of its rows \[rad\].
    pub rows_rad: Vec<Vector3<f64>>,
    /// Begin and end \[s\].
    pub span_s: [f64; 2],
}

/// Gyros at the positions and between them.
#[derive(Debug, Clone)]
pub struct Gyros {
    /// Period of a row \[s\].
    pub period_s: f64,
    /// Rests, by position; `None` where a gyro was not measured.
    pub rests: Vec<Option<Rest>>,
    /// Turns with every row measured.
    pub turns: Vec<Turn>,
    /// Begin and end of turns with a row that is not measured, or that is a fault of the data \[s\].
    pub lost_s: Vec<[f64; 2]>,
    /// Angle random walk from the scatter within rests \[rad/√s\], x y z.
    pub walk_rad_sqrt_s: Vector3<f64>,
}

impl Gyros {
    /// Collects the gyros of a recording of still positions.
    ///
    /// # Errors
    /// The reason why the gyros are not compared: channels missing, no clock of even rows, no rest measured.
    pub fn new(
        recording: &Recording,
        model: &Model,
        (rows, positions): (&Rows, &[Position]),
        plan: &Plan,
    ) -> Result<Self, String> {
        let streams = Streams::align(recording, model, &plan.signal.align);
        let mut streams = streams.map_err(|error| error.to_string())?;
        qualify::qualify(&mut streams, &plan.signal.faults);
        let pickoff_rad = streams.pickoff_rad.as_ref();
        let body_rad = shown_rad(&streams.sensed_rad, pickoff_rad, model, streams.rate_hz);
        let of_row = |row: usize| Vector3::from_fn(|axis, _| body_rad[axis][row]);
        let span_of = |own: &Range<usize>| {
            let at = |row: usize| streams.row_at(rows.start_s + row as f64 / rows.rate_hz);
            at(own.start)..at(own.end)
        };
        let spans: Vec<Range<usize>> = positions.iter().map(|one| span_of(&one.rows)).collect();
        let block_rows = (plan.positions.block_s * streams.rate_hz).round() as usize;
        let measured_share = plan.positions.measured_share;
        let mut scatter = Scatter::default();
        let mut rest = |span: &Range<usize>| {
            let seen: Vec<usize> = span.clone().filter(|&row| streams.usable[row]).collect();
            let sum: Vector3<f64> = seen.iter().map(|&row| of_row(row)).sum();
            let blocks = seen.chunks_exact(block_rows.max(1));
            scatter.add(blocks.map(|block| block.iter().map(|&row| of_row(row)).sum()));
            (seen.len() as f64 > measured_share * span.len() as f64).then(|| Rest {
                mean_rad_s: sum * streams.rate_hz / seen.len() as f64,
                length_s: seen.len() as f64 / streams.rate_hz,
            })
        };
        let rests: Vec<Option<Rest>> = spans.iter().map(&mut rest).collect();
        let (mut turns, mut lost_s) = (Vec::new(), Vec::new());
        for (from, pair) in spans.windows(2).enumerate() {
            let between = pair[0].end..pair[1].start.max(pair[0].end);
            let span_s = [between.start, between.end].map(|row| streams.begin_s(row));
            match streams.usable[between.clone()].iter().all(|seen| *seen) {
                true => turns.push(Turn {
                    from,
                    rows_rad: between.map(of_row).collect(),
                    span_s,
                }),
                false => lost_s.push(span_s),
            }
        }
        if rests.iter().flatten().count() == 0 {
            return Err("no gyro is measured while the unit stands still".to_string());
        }
        Ok(Self {
            period_s: 1.0 / streams.rate_hz,
            rests,
            turns,
            lost_s,
            walk_rad_sqrt_s: scatter.walk_rad_sqrt_s(block_rows.max(1) as f64 / streams.rate_hz),
        })
    }
}

/// Scatter of sums over blocks about the mean of their rest, pooled.
#[derive(Default)]
struct Scatter {
    squares_rad2: Vector3<f64>,
    freedom: f64,
}

impl Scatter {
    fn add(&mut self, blocks: impl Iterator<Item = Vector3<f64>>) {
        let blocks: Vec<Vector3<f64>> = blocks.collect();
        if blocks.len() < 2 {
            return;
        }
        self.squares_rad2 += squares_about_mean(&blocks);
        self.freedom += blocks.len() as f64 - 1.0;
    }

    fn walk_rad_sqrt_s(&self, block_s: f64) -> Vector3<f64> {
        let variance = self.squares_rad2 / self.freedom.max(1.0) / block_s;
        variance.map(f64::sqrt)
    }
}
