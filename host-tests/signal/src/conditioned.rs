//! A measured input made independent of the residual, which holds the input's noise.
//!
//! With û = u − Cov(n_u, e)/Var(e) · e, û is independent of e under a complete model, so any column made of û, however
//! nonlinear, has a score of zero mean.

use rlg_plan::GatePlan;

/// Regression weights of the residual by DCT-II coefficient: input noise power over residual noise power, at most 1.
pub fn weights(input_noise: &[f64], residual_noise: &[f64]) -> Vec<f64> {
    input_noise
        .iter()
        .zip(residual_noise)
        .map(|(input, residual)| (input / residual).min(1.0))
        .collect()
}

/// Expected noise power of the conditioned input.
pub fn noise_expected(
    input_noise: &[f64],
    weights: &[f64],
    residual_noise: &[f64],
    plan: &GatePlan,
) -> Vec<f64> {
    (0..input_noise.len())
        .map(|k| (input_noise[k] * (1.0 - weights[k])).max(plan.least_noise * residual_noise[k]))
        .collect()
}

/// Upper bound of the noise power of the conditioned input.
///
/// # Inputs
/// `uncertain`: standard deviation of `input_noise` by coefficient. Where the residual's noise is almost all the input's,
/// the remainder is their small difference, uncertain by this.
pub fn noise_left(
    input_noise: &[f64],
    uncertain: &[f64],
    weights: &[f64],
    residual_noise: &[f64],
    plan: &GatePlan,
) -> Vec<f64> {
    noise_expected(input_noise, weights, residual_noise, plan)
        .into_iter()
        .zip(uncertain)
        .map(|(left, uncertain)| left.max(plan.deviations * uncertain))
        .collect()
}
