//! The catalogue: one file per effect, one list here.
//!
//! A hypothesis says what its physics would add to what each gyro senses. Its regressors are formed from
//! the measured motion and pass through the same row means and dither as the data; all axes belong to one
//! hypothesis. Adding an effect means one file and one line in [`CATALOGUE`].

use std::collections::HashMap;
use std::ops::Range;

use super::portion::Bins;
use super::scene::Scene;
use super::streams::{AXES, Triad, add};
use super::workbench::Workbench;

mod gyro_bias;

mod gyro_bias_temperature;

mod gyro_bias_temperature_rate;

mod gyro_bias_magnetic;

mod gyro_g_bias;

mod gyro_g2_bias;

mod gyro_scale;

mod gyro_scale_asymmetry;

mod gyro_scale_quadratic;

mod gyro_scale_cubic;

mod installation;

mod installation_temperature;

mod axis_flexure;

mod axis_flexure_cubic;

mod axis_flexure_mode;

mod axis_tilt_by_force;

mod elastic_rate_by_force;

mod elastic_rate_by_jerk;

mod gyro_delay;

mod dither_gain;

mod dither_delay;

mod dither_cubic;

mod dither_crosstalk;

mod reference_misalignment;

mod reference_delay;

mod reference_scale;

pub mod reference_harmonic;

mod isolator_mode;

pub mod earth_rate;

/// Which parameters an effect has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// x, y, z.
    Axes,
    /// xy, xz, yx, yz, zx, zy: gyro, other axis.
    Six,
    /// xx, xy, ..., zz: gyro, axis.
    Nine,
    /// One value for all gyros.
    All,
    /// Only the card's own named parameters.
    Named,
}

/// A parameter with a name, unit and range of its own: a frequency, a damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Named {
    /// The contract's name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// A value met in real instruments.
    pub typical: f64,
    /// Least and largest credible value.
    pub range: [f64; 2],
}

/// The six pairs (gyro, axis) in the order of the contract.
pub const SIX: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];

impl Shape {
    /// Number of parameters.
    pub fn count(self) -> usize {
        match self {
            Shape::Axes => 3,
            Shape::Six => 6,
            Shape::Nine => 9,
            Shape::All => 1,
            Shape::Named => 0,
        }
    }

    /// (gyro, axis) of a parameter; the same index twice for [`Shape::Axes`], meaningless for [`Shape::All`].
    pub fn pair(self, parameter: usize) -> (usize, usize) {
        match self {
            Shape::Axes => (parameter, parameter),
            Shape::Six => SIX[parameter],
            Shape::Nine => (parameter / 3, parameter % 3),
            Shape::All | Shape::Named => (0, 0),
        }
    }

    /// The second index of a parameter of gyro `gyro`; none where the parameter belongs to another gyro.
    pub fn second(self, parameter: usize, gyro: usize) -> Option<usize> {
        let (of, second) = self.pair(parameter);
        (of == gyro).then_some(second)
    }

    /// The contract's name of a parameter.
    pub fn name(self, parameter: usize) -> String {
        match self {
            Shape::Axes => AXES[parameter].to_string(),
            Shape::All => "all".to_string(),
            Shape::Named => String::new(),
            Shape::Six | Shape::Nine => {
                let (gyro, axis) = self.pair(parameter);
                format!("{}{}", AXES[gyro], AXES[axis])
            }
        }
    }
}

/// What stands in the catalogue about an effect.
pub struct Card {
    /// The contract's kind.
    pub kind: &'static str,
    /// Its equation, one line.
    pub equation: &'static str,
    /// Its parameters of one kind, which come first.
    pub shape: Shape,
    /// Unit of the shape's parameters, as results print it.
    pub unit: &'static str,
    /// A size met in real instruments: the width of the prior that evidence is weighed with.
    pub typical: f64,
    /// Beyond this the effect is not credible physics for this kind of instrument.
    pub largest: f64,
    /// Whether physics allows only values above zero.
    pub positive: bool,
    /// Parameters after the shape's, each with its own unit.
    pub others: &'static [Named],
    /// ln of the odds against plain effects (a bias, a linear flexure) before looking at the data: a cubic law
    /// without a linear one, or a rare cause, must explain a little more to be named first.
    pub log_prior_odds: f64,
    /// Kinds that contain this one exactly: no recording of this form tells it from them.
    pub special_case_of: &'static [&'static str],
    /// Kinds of the contract that this version does not test and that look like this one below their resonance.
    pub resembles_untested: &'static [&'static str],
    /// What was left out of the model, for a navigation engineer, in a sentence or two.
    pub left_out: &'static str,
    /// The motion or record that shows or separates it.
    pub next_experiment: &'static str,
}

impl Card {
    /// Number of parameters.
    pub fn count(&self) -> usize {
        self.shape.count() + self.others.len()
    }

    fn other(&self, parameter: usize) -> Option<&'static Named> {
        self.others.get(parameter.checked_sub(self.shape.count())?)
    }

    /// The contract's name of a parameter.
    pub fn name(&self, parameter: usize) -> String {
        match self.other(parameter) {
            Some(named) => named.name.to_string(),
            None => self.shape.name(parameter),
        }
    }

    /// Its unit.
    pub fn unit_of(&self, parameter: usize) -> &'static str {
        self.other(parameter).map_or(self.unit, |named| named.unit)
    }

    /// A size met in real instruments.
    pub fn typical_of(&self, parameter: usize) -> f64 {
        self.other(parameter)
            .map_or(self.typical, |named| named.typical)
    }

    /// Least and largest credible value.
    pub fn range(&self, parameter: usize) -> [f64; 2] {
        let least = if self.positive { 0.0 } else { -self.largest };
        self.other(parameter)
            .map_or([least, self.largest], |named| named.range)
    }
}

/// Where a search over a nonlinear effect's parameters begins.
pub struct Sought {
    /// Parameters.
    pub at: Vec<f64>,
    /// Points of the grid looked at, which count as trials.
    pub trials: usize,
    /// Whether parameters that this recording would show explain it as well as the effect's limits do.
    pub within_reach: bool,
}

/// One entry of the catalogue.
pub trait Hypothesis: Sync {
    /// Its card.
    fn card(&self) -> &'static Card;

    /// d(sensed increment of gyro `axis`)/d(parameter) \[rad per parameter unit\], one a row, at the parameter
    /// values `at`. `None` where this parameter does not touch this gyro, or a channel is missing.
    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>>;

    /// Every column there is at `at`, as (parameter, axis, rows), of an effect whose columns share most of their work.
    fn columns_at_once(
        &self,
        _scene: &Scene,
        _at: &[f64],
    ) -> Option<Vec<(usize, usize, Vec<f64>)>> {
        None
    }

    /// Parameters that the prediction of a nonlinear effect is proportional to: it is their columns times their values.
    fn proportional_to(&self) -> Range<usize> {
        0..0
    }

    /// The product of channels that a parameter of one gyro adds to its rate, as expressions name it: what is found in
    /// the data and reads so is this effect.
    fn expression(&self, _parameter: usize, _axis: usize) -> Option<String> {
        None
    }

    /// What the effect adds to the sensed increments \[rad\]. Linear effects need only their columns.
    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        sum_of_columns(scene.streams.rows, at, &|parameter, axis| {
            self.column(scene, at, parameter, axis)
        })
    }

    /// Whether `column` depends on `at`.
    fn is_linear(&self) -> bool {
        true
    }

    /// Whether a parameter stands for something at these values: an axis without a mode has no frequency.
    fn has(&self, _at: &[f64], _parameter: usize) -> bool {
        true
    }

    /// Kinds that this one contains as a limit or that take its place in a first look. Not empty: the effect has no
    /// value at which its columns mean anything, and is looked for with [`Hypothesis::seek`] where one of
    /// them, or anything else, was found.
    fn stands_behind(&self) -> &'static [&'static str] {
        &[]
    }

    /// A point to start from, in what other effects leave on the bench.
    fn seek(&self, _bench: &Workbench, _left: &[Bins; 3]) -> Option<Sought> {
        None
    }

    /// The plainer kind that this one differs from only by how it goes with amplitude, frequency or temperature. It is
    /// a candidate only beside it: where the plainer law was not asked about, a fit of its refinement proves neither.
    fn refines(&self) -> Option<&'static str> {
        None
    }

    /// Why this recording cannot show the effect, if a needed channel is missing.
    fn missing(&self, _scene: &Scene) -> Option<&'static str> {
        None
    }
}

/// Columns of the parameters on each axis times their values, over so many rows.
pub fn sum_of_columns(
    rows: usize,
    values: &[f64],
    column: &dyn Fn(usize, usize) -> Option<Vec<f64>>,
) -> Triad {
    let mut total: Triad = [0, 1, 2].map(|_| vec![0.0; rows]);
    for (axis, sum) in total.iter_mut().enumerate() {
        for (parameter, value) in values
            .iter()
            .enumerate()
            .filter(|(_, value)| **value != 0.0)
        {
            if let Some(column) = column(parameter, axis) {
                add(sum, &column, *value);
            }
        }
    }
    total
}

/// Every effect the search considers, in the order of the contract's table.
pub const CATALOGUE: &[&dyn Hypothesis] = &[
    &gyro_bias::GyroBias,
    &gyro_bias_temperature::GyroBiasTemperature,
    &gyro_bias_temperature_rate::GyroBiasTemperatureRate,
    &gyro_bias_magnetic::GyroBiasMagnetic,
    &gyro_g_bias::GyroGBias,
    &gyro_g2_bias::GyroG2Bias,
    &gyro_scale::GyroScale,
    &gyro_scale_asymmetry::GyroScaleAsymmetry,
    &gyro_scale_quadratic::GyroScaleQuadratic,
    &gyro_scale_cubic::GyroScaleCubic,
    &installation::Installation,
    &installation_temperature::InstallationTemperature,
    &axis_flexure::AxisFlexure,
    &axis_flexure_cubic::AxisFlexureCubic,
    &axis_flexure_mode::AxisFlexureMode,
    &axis_tilt_by_force::AxisTiltByForce,
    &elastic_rate_by_force::ElasticRateByForce,
    &elastic_rate_by_jerk::ElasticRateByJerk,
    &gyro_delay::GyroDelay,
    &dither_gain::DitherGain,
    &dither_delay::DitherDelay,
    &dither_cubic::DitherCubic,
    &dither_crosstalk::DitherCrosstalk,
    &reference_misalignment::ReferenceMisalignment,
    &reference_delay::ReferenceDelay,
    &reference_scale::ReferenceScale,
    &isolator_mode::IsolatorMode,
    &earth_rate::EarthRate,
];

/// Parameters of every entry at which it has no effect.
pub fn no_effects() -> Vec<Vec<f64>> {
    CATALOGUE
        .iter()
        .map(|entry| vec![0.0; entry.card().count()])
        .collect()
}

/// Whether an effect may be looked for where some kinds are taken out: neither it nor what it refines is among them.
pub fn is_left(effect: usize, left_out: &[&str]) -> bool {
    let entry = CATALOGUE[effect];
    let kinds = std::iter::once(entry.card().kind).chain(entry.refines());
    kinds.into_iter().all(|kind| !left_out.contains(&kind))
}

/// The entry of a kind, with its place in [`CATALOGUE`].
pub fn find(kind: &str) -> Option<(usize, &'static dyn Hypothesis)> {
    CATALOGUE
        .iter()
        .position(|entry| entry.card().kind == kind)
        .map(|index| (index, CATALOGUE[index]))
}

/// Which effects of the catalogue add an expression to a gyro's rate, by gyro and expression.
pub fn by_expression() -> HashMap<(usize, String), Vec<usize>> {
    let mut effects: HashMap<(usize, String), Vec<usize>> = HashMap::new();
    for (effect, entry) in CATALOGUE.iter().enumerate() {
        for parameter in 0..entry.card().count() {
            for axis in 0..AXES.len() {
                if let Some(expression) = entry.expression(parameter, axis) {
                    effects.entry((axis, expression)).or_default().push(effect);
                }
            }
        }
    }
    effects
}

/// Kinds of the contract that are weighed as excess noise only, as `not_excluded` says.
pub const AS_NOISE: &[&str] = &["lock_in"];
