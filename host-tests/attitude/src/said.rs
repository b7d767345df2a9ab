//! Everything that findings and figures are made of.

use nalgebra::Vector3;
use rlg_catalogue::Pool;
use rlg_signal::axes::Triad;

use crate::about::About;
use crate::alignment::{Alignment, COUNT};
use crate::gyro_motion::GyroMotion;
use crate::increments::Increments;
use crate::observed::Observed;
use crate::physics::Gyro;
use crate::plan::AttitudePlan;
use crate::registration::Registration;
use crate::search::{Candidates, Found, Named};
use crate::steps::Step;

/// What few attitudes carry.
pub(crate) struct Few {
    /// Time at rest \[s\].
    pub(crate) rest_s: f64,
}

/// Everything that is said of.
pub(crate) struct Said<'a> {
    pub(crate) observed: &'a Observed<'a>,
    pub(crate) of_model: &'a Alignment,
    pub(crate) registered: &'a Registration,
    pub(crate) gyro: &'a Gyro,
    pub(crate) pool: &'a Pool,
    pub(crate) candidates: &'a Candidates,
    pub(crate) beyond: &'a [f64; COUNT],
    pub(crate) found: &'a Found,
    /// Of attitudes too few to show their noise.
    pub(crate) few: Option<&'a Few>,
    pub(crate) plan: &'a AttitudePlan,
    pub(crate) seed: u64,
}

impl Said<'_> {
    /// Columns of an effect of physics about some rows.
    pub(crate) fn columns(&self, named: &Named, about: &About) -> Vec<Triad> {
        if let Some(step) = named.step {
            let after = |row: usize| if row >= step.row { 1.0 } else { 0.0 };
            return vec![about.carried(|row| self.gyro.sensed_along(step.axis, after(row)))];
        }
        let mut effects = self.candidates.effects.iter();
        let own = effects.find(|(_, places)| *places == named.places);
        own.map_or_else(Vec::new, |(candidate, _)| {
            self.gyro.columns(self.pool, candidate, about)
        })
    }

    /// When a step begins \[s\].
    pub(crate) fn begins_s(&self, step: Step) -> f64 {
        self.observed.streams.begin_s(step.row)
    }
}

/// A vector of a row in the body's axes.
pub(crate) fn in_body(
    increments: &Increments,
    motion: &GyroMotion,
    row: usize,
    value: Vector3<f64>,
) -> Vector3<f64> {
    let start = increments.navigation_from_start[row].transpose() * value;
    motion.at(increments.places()[row]).inverse() * start
}
