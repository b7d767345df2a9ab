//! Length of the specific force in each position, less gravity: one record, with noise within and between positions.
//!
//! The attitudes are unknown, so of a position's three measured components only the component along the force is
//! informative: a rotation changes the other two (Shin and El-Sheimy 2002; IEEE 1293, multi-position test). To first order
//! of an error e, |f + e| − g = u·e with u the direction of the force.
//!
//! Noise by position: the variance of its mean from the scatter of its rows; a scatter between positions that is not
//! visible within them (placing of the unit, hysteresis of a rotation); and a bias random walk of each accelerometer from
//! the first position on. In the generalised eigenbasis of the walk all three are diagonal; the first two only nearly if
//! dwells differ in length.

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use rlg_inference::{Hypothesis, Likelihood, NoiseBasis, NoiseLevels, Term};
use rlg_plan::PositionPlan;
use rlg_signal::quantiles::median;
use std::ops::Range;

use super::still::Position;

/// Means of the positions, with their variances.
#[derive(Debug, Clone)]
pub struct Readings {
    /// Mean force \[m/s²\].
    pub mean_m_s2: Vec<Vector3<f64>>,
    /// Variance of the mean from the scatter of the rows \[m²/s⁴\], x y z.
    pub variance_m2_s4: Vec<Vector3<f64>>,
    /// Time of the position's middle since the first's \[s\].
    pub time_s: Vec<f64>,
    /// Mean square of the drift within positions \[m²/s⁴\].
    pub slow_m2_s4: f64,
    /// Degrees of freedom of the variances.
    pub freedom: f64,
}

impl Readings {
    /// Computes the means of all positions; the variance per block is common and estimated from the `fitted` ones alone.
    pub fn new(
        positions: &[Position],
        fitted: &[usize],
        rate_hz: f64,
        plan: &PositionPlan,
    ) -> Self {
        let count = |one: &Position| one.blocks_m_s2.len() as f64;
        let fitted = || fitted.iter().map(|&place| &positions[place]);
        let freedom: f64 = fitted().map(|one| count(one) - 1.0).sum();
        let scatter: Vector3<f64> = fitted().map(Position::scatter_m2_s4).sum();
        let block = scatter.map(|sum| sum.max(plan.least_sum_m2_s4) / freedom.max(1.0));
        let middle_s = |one: &Position| 0.5 * (one.rows.start + one.rows.end) as f64 / rate_hz;
        let squares = fitted().map(|one| one.half_difference_m_s2().powi(2));
        let first_s = positions.first().map_or(0.0, middle_s);
        Self {
            mean_m_s2: positions.iter().map(Position::mean_m_s2).collect(),
            variance_m2_s4: positions.iter().map(|one| block / count(one)).collect(),
            time_s: positions
                .iter()
                .map(|one| middle_s(one) - first_s)
                .collect(),
            slow_m2_s4: squares.sum::<f64>() / fitted().count().max(1) as f64,
            freedom: 3.0 * freedom,
        }
    }
}

/// Record in physical units.
#[derive(Debug, Clone)]
pub struct Record {
    /// Length of the force less gravity, linearised: the first-order effect of the corrected errors is added back \[m/s²\].
    pub length_m_s2: Vec<f64>,
    /// Columns: effect of size 1 \[m/s² per unit of the effect\].
    pub columns: Vec<Vec<f64>>,
    /// Direction of the force.
    pub along: Vec<Vector3<f64>>,
    /// Variance of the mean within a position \[m²/s⁴\].
    pub within_m2_s4: Vec<f64>,
    /// Time since the first \[s\].
    pub time_s: Vec<f64>,
    /// Degrees of freedom of `within_m2_s4`.
    pub freedom: f64,
    /// Prior of the variance between positions \[m²/s⁴\].
    pub scatter_m2_s4: f64,
    /// Standard deviation of gravity \[m/s²\]; 0 if known.
    pub gravity_std_m_s2: f64,
}

/// Sums of a record. Powers are in units of `unit_m_s2` squared.
pub struct Lengths {
    /// Standard deviation of a position's mean from the scatter of its rows \[m/s²\]: the unit of powers.
    pub unit_m_s2: f64,
    basis: NoiseBasis,
    energy: Vec<f64>,
    values: Vec<f64>,
    /// Columns at unit power.
    columns: Vec<Vec<f64>>,
    scale: Vec<f64>,
    free: Vec<Hypothesis>,
}

impl Record {
    /// Covariance between positions of a random walk with variance 1 at the last position.
    fn walk(&self) -> DMatrix<f64> {
        let count = self.time_s.len();
        let last_s = self.time_s[count - 1].max(f64::MIN_POSITIVE);
        DMatrix::from_fn(count, count, |a, b| {
            let alike = self.along[a].dot(&self.along[b]);
            // The small diagonal term keeps the walk's variance positive at its origin.
            alike * (self.time_s[a].min(self.time_s[b]) / last_s + 1e-6 * f64::from(a == b))
        })
    }

    /// Covariance of the noise \[m²/s⁴\].
    pub fn covariance(&self, levels: NoiseLevels, unit_m_s2: f64) -> DMatrix<f64> {
        let unit = unit_m_s2 * unit_m_s2;
        let mut all = self.walk() * (levels.walk * unit);
        for (place, within) in self.within_m2_s4.iter().enumerate() {
            all[(place, place)] += levels.white * within + levels.angle * unit;
        }
        all
    }

    /// Unit of powers \[m/s²\].
    pub fn unit_m_s2(&self) -> f64 {
        usual_m2_s4(&self.within_m2_s4).sqrt()
    }
}

/// Median variance of a position's mean \[m²/s⁴\].
pub(super) fn usual_m2_s4(within_m2_s4: &[f64]) -> f64 {
    median(within_m2_s4.iter().copied()).unwrap_or(0.0)
}

/// Generalised eigenbasis of the walk's covariance and of the noise within and between positions.
struct Turn {
    /// Square root of the noise variance without the walk, by position, in units of `unit_m_s2`.
    root: Vec<f64>,
    unit_m_s2: f64,
    /// The coordinates, a column each.
    directions: DMatrix<f64>,
    /// Power of the walk along each.
    walks: Vec<f64>,
}

impl Turn {
    fn new(record: &Record, levels: NoiseLevels, unit_m_s2: f64) -> Self {
        let within = record.within_m2_s4.iter();
        let root: Vec<f64> = within
            .map(|within| (within / unit_m_s2.powi(2) * levels.white + levels.angle).sqrt())
            .collect();
        let (count, walk) = (root.len(), record.walk());
        let whitened = DMatrix::from_fn(count, count, |a, b| walk[(a, b)] / (root[a] * root[b]));
        let eigen = SymmetricEigen::new(whitened);
        Self {
            root,
            unit_m_s2,
            directions: eigen.eigenvectors,
            // Eigenvalues at rounding level get a floor.
            walks: eigen.eigenvalues.iter().map(|one| one.max(1e-9)).collect(),
        }
    }

    /// Transforms values by position to these coordinates, in units of the noise without the walk.
    fn turned(&self, values: &[f64]) -> Vec<f64> {
        let scaled = values.iter().zip(&self.root);
        let scaled = scaled.map(|(value, root)| value / (root * self.unit_m_s2));
        let scaled = DVector::from_iterator(values.len(), scaled);
        self.directions.tr_mul(&scaled).iter().copied().collect()
    }

    /// Power along each coordinate of noise that is independent between positions.
    fn diagonal(&self, power: impl Fn(usize) -> f64) -> Vec<f64> {
        let along = |direction: nalgebra::DVectorView<f64>| -> f64 {
            let parts = direction.iter().enumerate();
            parts
                .map(|(at, part)| part * part * power(at) / self.root[at].powi(2))
                .sum()
        };
        self.directions.column_iter().map(along).collect()
    }
}

impl Lengths {
    /// Computes the sums of a record; all noise terms are diagonal given the scatter of `levels`.
    pub fn new(record: &Record, levels: NoiseLevels, plan: &PositionPlan) -> Self {
        let unit_m_s2 = record.unit_m_s2();
        let unit = unit_m_s2 * unit_m_s2;
        let count = record.length_m_s2.len();
        let turn = Turn::new(record, levels, unit_m_s2);
        // Prior observations: the noise within positions, gravity, and the scatter between positions.
        let beside = |is_within: f64| [is_within, is_within, 1.0 - is_within];
        let with = |mut own: Vec<f64>, is_within: f64| {
            own.extend(beside(is_within));
            own
        };
        let within = |place: usize| record.within_m2_s4[place] / unit;
        let power = [
            with(turn.diagonal(within), 1.0),
            with(turn.diagonal(|_| 1.0), 0.0),
            // Intermediate term between white noise and a random walk.
            with(turn.walks.iter().map(|one| one.sqrt()).collect(), 0.0),
            with(turn.walks.clone(), 0.0),
        ];
        let values = turn.turned(&record.length_m_s2);
        let mut energy: Vec<f64> = values.iter().map(|value| value * value).collect();
        let known = plan.scatter_known;
        let of_gravity = f64::from(u8::from(record.gravity_std_m_s2 == 0.0));
        energy.extend([
            record.freedom,
            of_gravity,
            known * record.scatter_m2_s4 / unit,
        ]);
        let mut counts = vec![1.0; count];
        counts.extend([record.freedom, 1.0, known]);
        let mut sums = Self {
            unit_m_s2,
            basis: NoiseBasis::of_values(power, counts),
            energy,
            values,
            columns: Vec::new(),
            scale: Vec::new(),
            free: Vec::new(),
        };
        for column in &record.columns {
            sums.push(turn.turned(column));
        }
        if record.gravity_std_m_s2 > 0.0 {
            // An error of gravity in the prediction shortens every length; its standard deviation is one more observation.
            let mut column = turn.turned(&vec![-1.0; count]);
            column.extend([0.0, 1.0 / record.gravity_std_m_s2]);
            sums.push(column);
            let term = Term {
                parameter: 0,
                record: 0,
                column: record.columns.len(),
                coefficient: 1.0,
            };
            sums.free = vec![
                Hypothesis::of_terms(0, Vec::new()),
                Hypothesis::of_terms(1, vec![term]),
            ];
        }
        sums
    }

    fn push(&mut self, mut column: Vec<f64>) {
        let power: f64 = column.iter().map(|value| value * value).sum();
        let scale = if power > 0.0 { 1.0 / power.sqrt() } else { 0.0 };
        column.iter_mut().for_each(|value| *value *= scale);
        column.resize(self.energy.len(), 0.0);
        self.columns.push(column);
        self.scale.push(scale);
    }
}

impl Likelihood for Lengths {
    fn record_count(&self) -> usize {
        1
    }

    fn basis(&self, _: usize) -> &NoiseBasis {
        &self.basis
    }

    fn energy(&self, _: usize) -> &[f64] {
        &self.energy
    }

    fn moment(&self, _: usize, bin: usize, column: usize) -> f64 {
        let value = self.values.get(bin).copied().unwrap_or(0.0);
        value * self.columns[column][bin]
    }

    fn product(&self, _: usize, bin: usize, a: usize, b: usize) -> f64 {
        self.columns[a][bin] * self.columns[b][bin]
    }

    fn scale(&self, _: usize, column: usize) -> f64 {
        self.scale[column]
    }

    fn free(&self) -> &[Hypothesis] {
        &self.free
    }

    fn sisters(&self) -> Vec<Range<usize>> {
        std::iter::once(0..1).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rlg_inference::NoiseLevels;
    use rlg_inference::laws::broken_laws;
    use rlg_plan::{PositionPlan, SearchPlan};

    use super::{Lengths, Record};

    #[test]
    fn lengths_of_the_force_keep_the_laws_of_a_likelihood() {
        const POSITIONS: usize = 14;
        let turn = |place: usize| place as f64 * 0.7;
        let along = |place| Vector3::new(turn(place).cos(), turn(place).sin(), 0.3).normalize();
        for gravity_std_m_s2 in [0.0, 0.02] {
            let record = Record {
                length_m_s2: (0..POSITIONS)
                    .map(|place| 1e-4 * turn(place).sin())
                    .collect(),
                columns: [0, 1]
                    .map(|axis| (0..POSITIONS).map(|place| along(place)[axis]).collect())
                    .to_vec(),
                along: (0..POSITIONS).map(along).collect(),
                within_m2_s4: (0..POSITIONS)
                    .map(|place| 1e-10 * (1.0 + turn(place)))
                    .collect(),
                time_s: (0..POSITIONS).map(|place| 30.0 * place as f64).collect(),
                freedom: 120.0,
                scatter_m2_s4: 4e-10,
                gravity_std_m_s2,
            };
            let levels = NoiseLevels {
                white: 1.0,
                angle: 0.5,
                flicker: 0.0,
                walk: 0.2,
            };
            let lengths = Lengths::new(&record, levels, &PositionPlan::default());
            let columns = 2 + usize::from(gravity_std_m_s2 > 0.0);
            let broken = broken_laws(&lengths, columns, &[levels], &SearchPlan::default());
            assert!(broken.is_empty(), "{broken:?}");
        }
    }
}
