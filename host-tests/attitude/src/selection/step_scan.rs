//! Change point of a gyro's bias: the instant of the step of largest statistic, over all gyros.

use crate::gyros::scanned::{Scanned, Step};
use crate::likelihood::block_sums::Statistic;
use crate::selection::residual_scan::{Given, Sought};

/// Instants of each refinement to either side of the best.
const AROUND: usize = 4;

/// Finds the step of largest statistic given a set; `None` if a smooth drift of that gyro explains as much.
pub(crate) fn seek(given: Given) -> Option<Sought> {
    strongest(given).filter(|sought| given.is_beyond_drift(sought))
}

/// Finds the step of largest statistic given a set.
pub(crate) fn strongest(given: Given) -> Option<Sought> {
    let Given {
        about, gyro, plan, ..
    } = given;
    let times = &about.increments.places();
    let (first, last) = (times[0].row, times[times.len() - 1].row);
    let column = |step: Step| step.column(about, gyro);
    let statistics = |steps: &[Step]| -> Vec<(Step, Statistic)> {
        let each = steps.iter();
        each.map(|step| (*step, given.statistic(&[column(*step)])))
            .collect()
    };
    let best = |tried: Vec<(Step, Statistic)>| {
        tried
            .into_iter()
            .max_by(|a, b| a.1.squared_size.total_cmp(&b.1.squared_size))
    };
    let mut stride = ((last - first) / plan.attitude.blocks.step_instants).max(1);
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
    Some(Sought {
        columns: vec![column(found.0)],
        scanned: Scanned::Step(found.0),
        statistic: found.1,
        places: 3 * about.increments.rows(),
    })
}
