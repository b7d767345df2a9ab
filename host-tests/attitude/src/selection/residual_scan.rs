//! Scans of the residual of a fit for effects on one gyro: statistics, and the rival of slow ones.

use rlg_plan::Plan;
use rlg_signal::axes::Triad;

use crate::gyros::physics::Gyro;
use crate::gyros::scanned::Scanned;
use crate::likelihood::block_sums::Statistic;
use crate::rows::alignment::COUNT;
use crate::rows::blocks::Blocks;
use crate::rows::linearised_rows::About;

/// A fit in whose residual a scan searches.
#[derive(Clone, Copy)]
pub(crate) struct Given<'a> {
    pub(crate) blocks: &'a Blocks<'a>,
    pub(crate) about: &'a About,
    pub(crate) gyro: &'a Gyro,
    /// Linearisation point of the registration's parameters, relative to the model.
    pub(crate) beyond: &'a [f64; COUNT],
    /// Column indices of the fitted parameters.
    pub(crate) set: &'a [usize],
    pub(crate) plan: &'a Plan,
}

impl Given<'_> {
    /// Statistic of a smooth drift of a gyro's bias, cosine terms over the record: the rival of slow effects.
    pub(crate) fn drift(&self, axis: usize) -> Statistic {
        let waves = self.plan.attitude.blocks.drift_waves;
        let stamps = self.about.increments.places();
        let (first, last) = (stamps[0].row, stamps[stamps.len() - 1].row);
        let columns = (1..=waves).map(|wave| {
            let of_row = |row: usize| {
                let share = (row.clamp(first, last) - first) as f64 / (last - first) as f64;
                (std::f64::consts::PI * wave as f64 * share).cos()
            };
            let about = self.about;
            about.carried(|row| self.gyro.sensed_along(axis, of_row(row)))
        });
        self.statistic(&columns.collect::<Vec<Triad>>())
    }

    /// True if an effect explains more than a smooth drift of its gyro.
    pub(crate) fn is_beyond_drift(&self, sought: &Sought) -> bool {
        let plan = &self.plan.attitude.blocks;
        let drift = self.drift(sought.scanned.axis()).compared(1, plan);
        sought.statistic.compared(sought.places, plan) > drift
    }

    /// Statistic of additional columns given the set.
    pub(crate) fn statistic(&self, columns: &[Triad]) -> Statistic {
        let first = self.blocks.sums.parameters();
        let places: Vec<usize> = (first..first + columns.len()).collect();
        let wide = self.blocks.sums_with(columns, self.beyond);
        wide.statistic(self.set, &places)
    }
}

/// The strongest effect of a scan.
pub(crate) struct Sought {
    pub(crate) scanned: Scanned,
    /// Column of each parameter.
    pub(crate) columns: Vec<Triad>,
    /// Test statistic from the blocks.
    pub(crate) statistic: Statistic,
    /// Number of places searched, over all gyros.
    pub(crate) places: usize,
}
