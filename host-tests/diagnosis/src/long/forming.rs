//! Residual and columns of every row, formed at the full rate chunk by chunk and summed over blocks.

use rlg_plan::Plan;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use rlg_catalogue::signals::Motions;
use rlg_catalogue::{Candidate, Column, Pool, Signals};
use rlg_inference::Observations;
use rlg_inference::observations::runs;
use rlg_model::DeclaredModel;
use rlg_recording::error::InputError;
use rlg_signal::partition::Use;
use rlg_signal::piece::Origin;
use rlg_signal::qualify;
use rlg_signal::streams::{Triad, add};

use super::cut::{Cut, Long};
use crate::alignment::case_motion::{Motion, estimate, signals};
use crate::confirm::sums::Summed;
use crate::iteration::state::{left_behind_known, take_out_hidden, without_known};
use crate::rows::channel_correction::ChannelCorrection;
use crate::rows::data::{Data, bridged};
use crate::rows::noise_levels::first_levels;
use crate::several::search::Shown;

/// Inputs known before all rows are read.
pub(super) struct About<'a> {
    pub(super) long: &'a Long<'a>,
    pub(super) cut: &'a Cut,
    pub(super) model: DeclaredModel<'a>,
    pub(super) left_out: &'a [&'a str],
    pub(super) plan: &'a Plan,
    /// Position of each chunk; its attitude is carried on here.
    pub(super) origin: Origin,
    /// Corrections of axes and units.
    pub(super) turned: Option<&'a ChannelCorrection>,
    /// Rows of the stretches.
    pub(super) stretches: &'a [Range<usize>],
}

/// Sums in progress.
struct Forming<'a> {
    about: About<'a>,
    shown: Shown,
    residual_rad: Triad,
    measured: Vec<bool>,
    columns: Vec<Vec<f32>>,
    pool: Pool,
    candidates: Vec<Candidate>,
}

/// Reads all rows once.
///
/// # Inputs
/// `progress`: receives the completed share.
pub(super) fn form(
    about: About,
    shown: Shown,
    progress: &dyn Fn(f64),
) -> Result<Summed, InputError> {
    let count = about.cut.uses.len();
    let mut forming = Forming {
        shown,
        residual_rad: std::array::from_fn(|_| vec![0.0; count]),
        measured: vec![false; count],
        columns: Vec::new(),
        pool: Pool::default(),
        candidates: Vec::new(),
        about,
    };
    let (rate_hz, plan) = (forming.about.cut.rate_hz, forming.about.plan);
    let chunk = ((plan.long.chunk_s * rate_hz) as usize).max(1);
    for first in (0..count).step_by(chunk) {
        let core = first..(first + chunk).min(count);
        forming.add(&core)?;
        progress(core.end as f64 / count as f64);
    }
    Ok(forming.summed())
}

impl Forming<'_> {
    /// Adds the blocks `core`.
    fn add(&mut self, core: &Range<usize>) -> Result<(), InputError> {
        let About {
            long, cut, plan, ..
        } = self.about;
        let DeclaredModel { model, file } = self.about.model;
        let around = (plan.long.around_s * long.rate_hz) as usize;
        let rows = core.start * cut.rows_each..core.end * cut.rows_each;
        let from = rows.start.saturating_sub(around);
        let mut streams = (long.read)(from..(rows.end + around).min(long.rows))?;
        if let Some(turned) = self.about.turned {
            turned.apply(&mut streams);
        }
        qualify::qualify(&mut streams, &plan.signal.faults);
        let offset = long.first_row(&streams);
        let skipped = offset - from;
        streams.piece.origin = Some(self.about.origin.clone());
        let mut data = Data::new(&mut streams, model, plan, file)?;
        let motion = self.motion(&mut data, offset);
        let signals = &motion.signals;
        let mut left_rad = left_behind_known(&mut data, signals);
        take_out_hidden(&mut left_rad, &self.shown.parts, signals);
        if self.columns.is_empty() {
            self.spell(signals);
        }
        let spans: Vec<Range<usize>> = core
            .clone()
            .map(|block| {
                let [begin, end] = [block, block + 1].map(|block| block * cut.rows_each);
                let end = end.saturating_sub(offset).min(signals.rows);
                begin.saturating_sub(offset).min(end)..end
            })
            .collect();
        let usable = &data.streams.usable;
        for (block, span) in core.clone().zip(&spans) {
            let is_whole = span.len() == cut.rows_each;
            self.measured[block] = is_whole && usable[span.clone()].iter().all(|&usable| usable);
            for (sums, values) in self.residual_rad.iter_mut().zip(&left_rad) {
                sums[block] = values[span.clone()].iter().sum();
            }
        }
        let columns = self.columns.par_iter_mut().zip(&self.pool.columns);
        columns.for_each(|(sums, column)| {
            let values = column.values(signals);
            for (sum, span) in sums[core.clone()].iter_mut().zip(&spans) {
                *sum = values[span.clone()].iter().sum::<f64>() as f32;
            }
        });
        self.carry_on(&data, offset, skipped, rows.end);
        Ok(())
    }

    /// Estimates the chunk's motion: with the residual of its seen rows, or from the reference alone if there are none.
    fn motion(&self, data: &mut Data, offset: usize) -> Motion {
        let About {
            cut,
            plan,
            stretches,
            ..
        } = self.about;
        let is_tested = |row: usize| cut.uses.get(row / cut.rows_each) == Some(&Use::Test);
        let is_of_stretch = |row: usize| stretches.iter().any(|rows| rows.contains(&row));
        let seen: Vec<bool> = data
            .streams
            .usable
            .iter()
            .enumerate()
            .map(|(row, usable)| {
                let row = row + offset;
                *usable && !is_tested(row) && !is_of_stretch(row)
            })
            .collect();
        data.found_share = Matrix3::zeros();
        for (gyro, sensed, size) in &self.shown.parts {
            if let Column::Increment(axis) = sensed.column {
                data.found_share[(*gyro, axis)] += size;
            }
        }
        let plain = self.plain(data);
        if !data.model.effects.is_empty() {
            data.set_known(&plain);
        }
        let mut left_rad = without_known(data, &plain);
        for (gyro, column, size) in &self.shown.parts {
            add(&mut left_rad[*gyro], &column.values(&plain), -size);
        }
        drop(plain);
        match Observations::bridged(&seen) {
            Ok(observed) => {
                let levels = first_levels(&left_rad, &observed.clone().to_fast_length());
                let clean_rad = bridged(&left_rad, &observed);
                estimate(data, &clean_rad, &levels, &seen, self.shown.path, plan)
            }
            Err(_) => {
                // Held-out rows: the noise is that of the stretches, the residual is not used.
                let usable = data.streams.usable.clone();
                let nothing: Triad = std::array::from_fn(|_| vec![0.0; usable.len()]);
                let levels = &self.shown.levels;
                estimate(data, &nothing, levels, &usable, self.shown.path, plan)
            }
        }
    }

    /// Signals of the chunk along the measured reference.
    fn plain(&self, data: &Data) -> Signals {
        let reference_rad = Arc::clone(&data.reference_rad);
        let along: Triad = std::array::from_fn(|axis| {
            let path = self.shown.path;
            path.along(axis, &reference_rad[axis], data.streams.rate_hz)
                .into_owned()
        });
        let motions = Motions::of_one(
            Arc::new(along),
            data.dither_rad.clone(),
            data.streams.rate_hz,
        );
        let motions = Motions {
            measured_rad: reference_rad,
            ..motions
        };
        signals(data, motions, self.shown.path, &self.about.plan.catalogue)
    }

    /// Forms the candidates of the sums: the catalogue's, and the stretches' besides.
    fn spell(&mut self, signals: &Signals) {
        let left_out = self.about.left_out;
        self.candidates = self
            .pool
            .candidates(signals, self.shown.is_moving, left_out);
        for one in &self.shown.candidates {
            if !self.candidates.iter().any(|known| known.is_made_as(one)) {
                let adopted = self.pool.adopt(one, &self.shown.pool.columns);
                self.candidates.push(adopted);
            }
        }
        let count = self.measured.len();
        self.columns = vec![vec![0.0; count]; self.pool.columns.len()];
    }

    /// Carries the origin on to the first row of the next chunk, whose blocks begin at a row.
    fn carry_on(&mut self, data: &Data, offset: usize, skipped: usize, next: usize) {
        let around = (self.about.plan.long.around_s * self.about.long.rate_hz) as usize;
        let first = next.saturating_sub(around) + skipped;
        let rows = first.saturating_sub(offset).min(data.streams.rows);
        let [x, y, z] = &*data.reference_rad;
        let start_from_body = &mut self.about.origin.start_from_body;
        for row in 0..rows {
            let turn = Vector3::new(x[row], y[row], z[row]);
            *start_from_body *= UnitQuaternion::from_scaled_axis(turn);
        }
        start_from_body.renormalize();
    }

    /// Sums, with the blocks to fit and to test: none that holds rows of a stretch.
    fn summed(self) -> Summed {
        let About { cut, stretches, .. } = self.about;
        let is_free = |block: usize| {
            let rows = block * cut.rows_each..(block + 1) * cut.rows_each;
            let mut stretches = stretches.iter();
            self.measured[block]
                && stretches.all(|one| one.end <= rows.start || rows.end <= one.start)
        };
        let of = |is_tested: bool| -> Vec<bool> {
            let uses = cut.uses.iter().enumerate();
            uses.map(|(block, of)| is_free(block) && (*of == Use::Test) == is_tested)
                .collect()
        };
        Summed {
            rate_hz: cut.rate_hz,
            seen: of(false),
            tested: runs(&of(true), true),
            measured: self.measured,
            residual_rad: self.residual_rad,
            pool: self.pool,
            columns: self.columns,
            candidates: self.candidates,
        }
    }
}

#[cfg(test)]
mod tests {
    use rlg_plan::Plan;
    use std::ops::Range;
    use std::path::Path;

    use nalgebra::UnitQuaternion;
    use rlg_catalogue::Pool;
    use rlg_catalogue::signals::Path as SignalPath;
    use rlg_inference::NoiseLevels;
    use rlg_model::{DeclaredModel, Gyro, Model, MotionSource};
    use rlg_signal::piece::Origin;
    use rlg_signal::streams::{Streams, Triad};

    use super::{About, form};
    use crate::confirm::sums::Summed;
    use crate::long::Long;
    use crate::several::search::Shown;

    const RATE_HZ: f64 = 200.0;
    const ROWS: usize = 24_000;

    /// Slow and fast motion about each axis, and the increments sensed by gyros of another scale \[rad\].
    fn rows(rows: Range<usize>) -> Streams {
        let turn = |axis: usize, row: usize| {
            let time_s = row as f64 / RATE_HZ;
            let phase = axis as f64;
            0.2 * (0.3 * time_s + phase).sin() + 1e-2 * (90.0 * time_s + 2.0 * phase).sin()
        };
        let case_rad: Triad = [0, 1, 2].map(|axis| {
            let rows = rows.clone();
            rows.map(|row| turn(axis, row + 1) - turn(axis, row))
                .collect()
        });
        let mut streams = Streams::of_motion(RATE_HZ, case_rad);
        streams.own_motion = false;
        streams.start_s = rows.start as f64 / RATE_HZ;
        for values in &mut streams.sensed_rad {
            values.iter_mut().for_each(|value| *value *= 1.0 + 1e-4);
        }
        streams
    }

    fn formed(chunk_s: f64) -> Summed {
        let mut plan = Plan::default();
        plan.long.chunk_s = chunk_s;
        let long = Long {
            name: "long".to_string(),
            rows: ROWS,
            rate_hz: RATE_HZ,
            start_s: 0.0,
            segments: Vec::new(),
            read: &|wanted| Ok(rows(wanted)),
        };
        let cut = long.blocks(&plan);
        let model = Model {
            motion: MotionSource::Reference,
            earth_rate_in_reference: true,
            gyro: Gyro::default(),
            dither: None,
            accelerometer: None,
            reference: None,
            effects: Vec::new(),
        };
        let about = About {
            long: &long,
            cut: &cut,
            model: DeclaredModel::new(&model, Path::new("model.toml")),
            left_out: &[],
            plan: &plan,
            origin: Origin {
                start_s: 0.0,
                temperature_k: None,
                start_from_body: UnitQuaternion::identity(),
                seconds: long.seconds(),
            },
            turned: None,
            stretches: std::slice::from_ref(&(4000..6000)),
        };
        let quiet = NoiseLevels {
            white: 1e-16,
            ..NoiseLevels::default()
        };
        let shown = Shown {
            parts: Vec::new(),
            path: SignalPath::default(),
            is_moving: [true; 3],
            candidates: Vec::new(),
            pool: Pool::default(),
            levels: vec![quiet; 3],
        };
        form(about, shown, &|_| {}).expect("rows are read")
    }

    #[test]
    fn blocks_are_the_sums_of_the_rows_wherever_chunks_begin() {
        let [whole, cut] = [120.0, 17.0].map(formed);
        let all = rows(0..ROWS);
        let each = ROWS / whole.seen.len();
        for axis in 0..3 {
            for (block, sum) in cut.residual_rad[axis].iter().enumerate() {
                let rows = block * each..(block + 1) * each;
                let expected: f64 = rows
                    .map(|row| all.sensed_rad[axis][row] - all.case_rad[axis][row])
                    .sum();
                assert!((sum - expected).abs() < 1e-15, "{axis} {block}");
            }
        }
        // Columns behind filters and attitudes depend on the rows around them; single precision is that of the sums.
        assert_eq!(whole.columns.len(), cut.columns.len());
        for (place, (one, other)) in whole.columns.iter().zip(&cut.columns).enumerate() {
            let largest = one
                .iter()
                .fold(0.0_f32, |most, value| most.max(value.abs()));
            let inside = one.iter().zip(other).skip(40).take(one.len() - 80);
            let apart = inside.fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
            assert!(
                apart <= 2e-3 * largest,
                "column {place}: {apart} of {largest}"
            );
        }
        // Neither a block of the stretch nor a tested one is fitted.
        assert!(
            whole.seen[4000 / each..6000 / each]
                .iter()
                .all(|&seen| !seen)
        );
        let fitted = whole.seen.iter().filter(|&&seen| seen).count();
        let tested: usize = whole.tested.iter().map(ExactSizeIterator::len).sum();
        assert!(
            fitted > 3 * tested && tested > whole.seen.len() / 8,
            "{fitted} {tested}"
        );
    }
}
