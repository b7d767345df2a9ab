//! Standard deviations of few degrees of freedom.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Factor of a standard deviation of `freedom` degrees of freedom so that ± 3 σ has Gaussian coverage (Student's t).
pub(super) fn three_sigma_factor(freedom: f64) -> f64 {
    /// P(z < 3).
    const THREE: f64 = 0.998_650_101_968_37;
    /// Above this number of degrees of freedom Student's t equals the Gaussian.
    const MANY: f64 = 1e4;
    match StudentsT::new(0.0, 1.0, freedom.min(MANY)) {
        Ok(law) if freedom < MANY => law.inverse_cdf(THREE) / 3.0,
        _ => 1.0,
    }
}
