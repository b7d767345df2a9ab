//! Change point of a gyro's bias: the instant of the step of largest statistic, over all gyros.

use rlg_plan::AttitudeBlockPlan;
use rlg_signal::axes::Triad;

use crate::about::About;
use crate::alignment::COUNT;
use crate::block_sums::Statistic;
use crate::blocks::Blocks;
use crate::physics::Gyro;

/// A step of one gyro's bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Index of the gyro.
    pub axis: usize,
    /// First row of the step.
    pub row: usize,
}

impl Step {
    /// Column of a step of 1 rad/s.
    pub(crate) fn column(&self, about: &About, gyro: &Gyro) -> Triad {
        about.carried(|row| gyro.sensed_along(self.axis, if row >= self.row { 1.0 } else { 0.0 }))
    }
}

/// Step of largest statistic.
pub struct Sought {
    /// The step.
    pub step: Step,
    /// Its column.
    pub column: Triad,
    /// Test statistic from the blocks.
    pub statistic: Statistic,
    /// Number of instants searched, over all gyros.
    pub places: usize,
}

/// Instants of the first grid, and of each refinement to either side of the best.
const FIRST: usize = 40;
const AROUND: usize = 4;

/// Finds the step of largest statistic given a set; `None` if a smooth drift of that gyro explains as much.
pub fn seek(
    blocks: &Blocks,
    about: &About,
    gyro: &Gyro,
    beyond: &[f64; COUNT],
    set: &[usize],
    plan: &AttitudeBlockPlan,
) -> Option<Sought> {
    let times = &about.increments.places();
    let (first, last) = (times[0].row, times[times.len() - 1].row);
    let column = |step: Step| step.column(about, gyro);
    let statistics = |steps: &[Step]| -> Vec<(Step, Statistic)> {
        let wide = blocks.with(steps.iter().map(|step| column(*step)), beyond);
        let place = blocks.sums.parameters();
        let each = steps.iter().enumerate();
        each.map(|(k, step)| (*step, wide.sums.statistic(set, &[place + k])))
            .collect()
    };
    let best = |tried: Vec<(Step, Statistic)>| {
        tried
            .into_iter()
            .max_by(|a, b| a.1.squared_size.total_cmp(&b.1.squared_size))
    };
    let mut stride = ((last - first) / FIRST).max(1);
    let grid: Vec<Step> = (0..3)
        .flat_map(|axis| {
            let rows = (first + stride..last).step_by(stride);
            rows.map(move |row| Step { axis, row })
        })
        .collect();
    let mut found = best(statistics(&grid))?;
    while stride > 1 {
        stride = (stride / AROUND).max(1);
        let around: Vec<Step> = (0..=2 * AROUND)
            .map(|k| Step {
                axis: found.0.axis,
                row: (found.0.row + k * stride)
                    .saturating_sub(AROUND * stride)
                    .clamp(first + 1, last - 1),
            })
            .collect();
        found = best(statistics(&around))?;
    }
    let waves = (1..=plan.drift_waves).map(|wave| {
        let of_row = |row: usize| {
            let share = (row.clamp(first, last) - first) as f64 / (last - first) as f64;
            (std::f64::consts::PI * wave as f64 * share).cos()
        };
        about.carried(|row| gyro.sensed_along(found.0.axis, of_row(row)))
    });
    let places: Vec<usize> = (0..plan.drift_waves)
        .map(|wave| blocks.sums.parameters() + wave)
        .collect();
    let drift = blocks.with(waves, beyond).sums.statistic(set, &places);
    let instants = 3 * about.increments.rows();
    let is_step = found.1.compared(instants, plan) > drift.compared(1, plan);
    is_step.then(|| Sought {
        column: column(found.0),
        step: found.0,
        statistic: found.1,
        places: instants,
    })
}
