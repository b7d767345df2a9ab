//! Statistics of a fleet: robust location and scale, and trends.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF as _, Normal, StudentsT};

/// The median absolute deviation times this is the standard deviation of a normal law (Rousseeuw & Croux 1993, eq. 1.2).
const NORMAL: f64 = 1.4826;

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// A slope with its standard deviation, scatter about the fit included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Slope.
    pub measured: Measured,
    /// Degrees of freedom of the scatter.
    pub freedom: usize,
}

impl Slope {
    /// Computes the two-sided chance of such a slope in noise alone.
    pub fn chance(&self) -> f64 {
        student_chance(self.measured.value / self.measured.std, self.freedom)
    }
}

/// Computes the two-sided chance of a deviation of `z` standard deviations in normal noise.
pub fn normal_chance(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// Computes the two-sided chance of Student's `t`; 1 without a degree of freedom.
pub fn student_chance(t: f64, freedom: usize) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom as f64) {
        Ok(law) if t.is_finite() => 2.0 * law.sf(t.abs()),
        _ => 1.0,
    }
}

/// Location and spread of a fleet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fleet {
    /// Median.
    pub median: f64,
    /// Median absolute deviation, scaled to a normal law's standard deviation.
    pub spread: f64,
}

/// Computes the median; `None` for no values.
fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        count if count % 2 == 1 => Some(sorted[middle]),
        _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
    }
}

/// Place of an instrument among the others.
pub(super) struct Place {
    /// Middle and spread it is compared with.
    pub(super) fleet: Fleet,
    /// Distance from the middle.
    pub(super) z: f64,
    /// True if it stands out.
    pub(super) is_outlier: bool,
}

impl Fleet {
    /// Computes both from one value an instrument.
    pub fn of(values: &[f64]) -> Option<Self> {
        let middle = median(values)?;
        let deviations: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
        Some(Self {
            median: middle,
            spread: NORMAL * median(&deviations)?,
        })
    }

    /// Computes the robust z: the deviation over the root sum of squares of the fleet's spread and its own standard
    /// deviation.
    ///
    /// The latter prevents a fleet in which most have no such effect, hence no spread, from making an outlier of noise.
    pub fn z(&self, one: Measured) -> f64 {
        (one.value - self.median) / self.spread.hypot(one.std)
    }
}

/// Computes the mean of an instrument's runs.
pub fn mean(of: &[Measured]) -> Option<Measured> {
    let count = of.len() as f64;
    (!of.is_empty()).then(|| Measured {
        value: of.iter().map(|one| one.value).sum::<f64>() / count,
        std: of.iter().map(|one| one.std * one.std).sum::<f64>().sqrt() / count,
    })
}

/// Fits a constant and slopes along `axes` jointly to values by weighted least squares.
///
/// # Inputs
/// `axes`: abscissas of the values, per axis; one that does not vary has no slope.
///
/// # Returns
/// A slope an axis, with a standard deviation that includes the scatter about the fit; none if fewer than `spare` degrees of
/// freedom remain, or if the axes are collinear.
pub fn slopes(values: &[Measured], axes: &[Vec<f64>], spare: usize) -> Vec<Option<Slope>> {
    let varies = |axis: &Vec<f64>| axis.iter().any(|at| *at != axis[0]);
    let used: Vec<usize> = (0..axes.len()).filter(|k| varies(&axes[*k])).collect();
    let mut slopes = vec![None; axes.len()];
    let unknowns = 1 + used.len();
    if used.is_empty() || values.len() < unknowns + spare {
        return slopes;
    }
    // Centred and scaled, so that the rank does not depend on the units.
    let centre = |axis: &[f64]| axis.iter().sum::<f64>() / axis.len() as f64;
    let extent = |axis: &[f64]| {
        let middle = centre(axis);
        axis.iter()
            .map(|at| (at - middle).abs())
            .fold(0.0, f64::max)
    };
    let column = |row: usize, k: usize| match k {
        0 => 1.0,
        k => {
            let axis = &axes[used[k - 1]];
            (axis[row] - centre(axis)) / extent(axis)
        }
    };
    let weighted = DMatrix::from_fn(values.len(), unknowns, |row, k| {
        column(row, k) / values[row].std
    });
    let target = DVector::from_fn(values.len(), |row, _| values[row].value / values[row].std);
    let normal = weighted.tr_mul(&weighted);
    // In f64 a singular matrix is invertible by rounding.
    let singular = normal.clone().symmetric_eigenvalues();
    if singular.min() <= singular.max() * f64::EPSILON * unknowns as f64 {
        return slopes;
    }
    let Some(covariance) = normal.try_inverse() else {
        return slopes;
    };
    let found = &covariance * weighted.tr_mul(&target);
    let left = (target - weighted * &found).norm_squared();
    let freedom = values.len() - unknowns;
    let scatter = (left / freedom as f64).max(1.0);
    for (k, axis) in used.iter().enumerate() {
        let unit = extent(&axes[*axis]);
        let measured = Measured {
            value: found[k + 1] / unit,
            std: (covariance[(k + 1, k + 1)] * scatter).sqrt() / unit,
        };
        slopes[*axis] = Some(Slope { measured, freedom });
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(values: &[f64], std: f64) -> Vec<Measured> {
        let one = |value: &f64| Measured { value: *value, std };
        values.iter().map(one).collect()
    }

    #[test]
    fn one_that_is_off_moves_neither_median_nor_spread() {
        let fleet = Fleet::of(&[1.0, 2.0, 3.0, 4.0, 1e6]).expect("values");
        assert_eq!((fleet.median, fleet.spread), (3.0, NORMAL));
        let off = Measured {
            value: 1e6,
            std: 0.0,
        };
        assert!(fleet.z(off) > 1e5);
        let none = Fleet::of(&[0.0; 6]).expect("values");
        let noise = Measured {
            value: 2.0,
            std: 1.0,
        };
        assert_eq!(none.z(noise), 2.0);
    }

    #[test]
    fn time_and_temperature_are_fitted_together() {
        let days = vec![0.0, 10.0, 20.0, 30.0, 40.0, 50.0];
        let kelvin = vec![293.0, 313.0, 294.0, 312.0, 295.0, 311.0];
        let of = |k: usize| 5.0 + 0.3 * days[k] - 2.0 * kelvin[k];
        let values = measured(&(0..6).map(of).collect::<Vec<_>>(), 0.1);
        let found = slopes(&values, &[days.clone(), kelvin], 1);
        let slope = |k: usize| found[k].expect("a slope").measured.value;
        assert!((slope(0) - 0.3).abs() < 1e-9 && (slope(1) + 2.0).abs() < 1e-9);
        // Sum of squares of the days about their mean is 1750.
        let alone = slopes(&values, &[days], 1)[0].expect("a slope").measured;
        assert!(
            alone.std > 0.1 / 1750f64.sqrt(),
            "the scatter counts: {}",
            alone.std
        );
    }

    #[test]
    fn axes_that_go_together_have_no_slopes_and_one_that_stands_still_has_none() {
        let values = measured(&[1.0, 2.0, 3.0, 4.0, 5.0], 0.1);
        let days = vec![0.0, 1.0, 2.0, 3.0, 4.0];
        let warmer: Vec<f64> = days.iter().map(|day| 290.0 + 3.0 * day).collect();
        assert_eq!(slopes(&values, &[days.clone(), warmer], 1), [None, None]);
        let found = slopes(&values, &[days.clone(), vec![290.0; 5]], 1);
        let slope = found[0].expect("a slope").measured;
        assert!((slope.value - 1.0).abs() < 1e-12 && found[1].is_none());
        assert!((slope.std - 0.1 / 10f64.sqrt()).abs() < 1e-12);
        assert_eq!(slopes(&values[..2], &[days[..2].to_vec()], 1), [None]);
    }
}
