//! Simulation of one scenario, row after row.
//!
//! A scenario and a seed give blocks of rows, so that an hour is written to disk in the memory of a second.

use super::attitude::Quadrature;
use super::case::Case;
use super::instrument::{Seeds, Stream, stream};
use super::layout::{self, TableLayout};
use super::motion::{BaseMotion, SegmentMotion};
use super::recording_of;
use super::scenario::Scenario;
use super::triad::Triad;
use super::window::Window;
use rand_chacha::ChaCha8Rng;
use rlg_recording::Recording;
use std::sync::OnceLock;

/// Rows in a block: some progress reports a second, a megabyte of columns.
const ROWS_PER_BLOCK: usize = 8192;

/// Largest lead of a pickoff \[s\]: the longest delay of an effect, and some rows.
const EARLIEST_PICKOFF_S: f64 = 0.15;

/// Quadrature rule, common to all simulations.
fn quadrature() -> &'static Quadrature {
    static RULE: OnceLock<Quadrature> = OnceLock::new();
    RULE.get_or_init(Quadrature::new)
}

/// Rows of every table, made together.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Number of gyro rows made so far.
    pub end_row: usize,
    /// Values, \[table\]\[column\]\[row\].
    pub tables: Vec<Vec<Vec<f64>>>,
    /// Exact increments of the case over each gyro row, x y z \[rad\].
    pub case_increments_rad: Vec<[f64; 3]>,
}

/// Running simulation.
pub struct Simulator<'a> {
    scenario: &'a Scenario,
    tables: Vec<TableLayout>,
    case: Case<'a>,
    triad: Triad<'a>,
    window: Window,
    motion: Motion<'a>,
    /// Number of rows made so far.
    row: usize,
    /// Number of periods of the case computed: ahead of the rows if an instrument is early.
    periods: usize,
}

impl<'a> Simulator<'a> {
    /// Simulation before its first row.
    pub fn new(scenario: &'a Scenario, seeds: impl Into<Seeds>) -> Self {
        let seeds = seeds.into();
        let tables = layout::tables(scenario);
        let triad = Triad::new(scenario, &tables, seeds, quadrature());
        let (behind, ahead) = triad.reach();
        Self {
            scenario,
            case: Case::new(scenario, quadrature()),
            triad,
            window: Window::new(behind, ahead),
            motion: Motion::new(scenario, seeds),
            tables,
            row: 0,
            periods: 0,
        }
    }

    /// Tables of the recording.
    pub fn tables(&self) -> &[TableLayout] {
        &self.tables
    }

    /// Recording with its channels still empty.
    pub fn recording(&self) -> Recording {
        recording_of(self.scenario, &self.tables)
    }

    /// Returns the next rows; `None` once the recording is complete.
    pub fn next_block(&mut self) -> Option<Block> {
        let end = (self.row + ROWS_PER_BLOCK).min(self.scenario.rows());
        if self.row == end {
            return None;
        }
        let mut block = Block {
            end_row: end,
            tables: self
                .tables
                .iter()
                .map(|table| vec![Vec::with_capacity(end - self.row); table.columns.len()])
                .collect(),
            case_increments_rad: Vec::with_capacity(end - self.row),
        };
        let period_s = 1.0 / self.scenario.rate_hz;
        let mut rows = vec![Vec::new(); self.tables.len()];
        while self.row < end {
            self.periods += 1;
            let end_s = self.scenario.start_s + self.periods as f64 * period_s;
            for dither in &mut self.triad.dithers {
                dither.reach(end_s + EARLIEST_PICKOFF_S);
            }
            let base = self.motion.next_period();
            let period = self.case.advance(quadrature(), &base, &self.triad.dithers);
            if !self.window.push(period) {
                continue;
            }
            self.triad.read(self.row, &self.window, &mut rows);
            for (columns, values) in block.tables.iter_mut().zip(&rows) {
                for (column, value) in columns.iter_mut().zip(values) {
                    column.push(*value);
                }
            }
            let turned = quadrature().integrate(&self.window.now().case_rad_s, period_s);
            block.case_increments_rad.push(turned.into());
            self.row += 1;
        }
        Some(block)
    }
}

/// Motion of the base, segment after segment, and at rest after the last.
struct Motion<'a> {
    scenario: &'a Scenario,
    rng: ChaCha8Rng,
    segment: usize,
    rows_left: usize,
    motion: Option<SegmentMotion>,
}

impl<'a> Motion<'a> {
    fn new(scenario: &'a Scenario, seeds: Seeds) -> Self {
        Self {
            scenario,
            rng: stream(seeds, Stream::Motion, 0),
            segment: 0,
            rows_left: 0,
            motion: None,
        }
    }

    fn next_period(&mut self) -> [BaseMotion; 4] {
        while self.rows_left == 0 {
            let Some(segment) = self.scenario.segments.get(self.segment) else {
                return [BaseMotion::STILL; 4];
            };
            self.segment += 1;
            self.rows_left = segment.rows;
            self.motion = Some(SegmentMotion::new(
                &segment.profile,
                segment.rows,
                1.0 / self.scenario.rate_hz,
                quadrature().nodes,
                &mut self.rng,
            ));
        }
        self.rows_left -= 1;
        self.motion
            .as_mut()
            .map_or([BaseMotion::STILL; 4], SegmentMotion::next_period)
    }
}
