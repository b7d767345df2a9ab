//! A measured input made independent of the residual that holds its noise.
//!
//! With û = u − Cov(n_u, e)/Var(e) · e, û is independent of e where nothing is left out of the model, so any column made of û,
//! however nonlinear, has a score of zero mean.

/// Weights of the residual by DCT-II coefficient: input noise power over residual noise power, at most 1.
pub fn weights(input_noise: &[f64], residual_noise: &[f64]) -> Vec<f64> {
    input_noise
        .iter()
        .zip(residual_noise)
        .map(|(input, residual)| (input / residual).min(1.0))
        .collect()
}

/// Below this share of the residual's noise nothing is known of the input's.
const FLOOR: f64 = 1e-6;

/// Noise power that is expected to be left in the conditioned input.
pub fn noise_expected(input_noise: &[f64], weights: &[f64], residual_noise: &[f64]) -> Vec<f64> {
    (0..input_noise.len())
        .map(|k| (input_noise[k] * (1.0 - weights[k])).max(FLOOR * residual_noise[k]))
        .collect()
}

/// Noise power that may be left in the conditioned input.
///
/// # Inputs
/// `uncertain`: standard deviation of `input_noise` by coefficient. Where the residual's noise is almost all the input's,
/// what is left is their small difference, known no better than this.
pub fn noise_left(
    input_noise: &[f64],
    uncertain: &[f64],
    weights: &[f64],
    residual_noise: &[f64],
) -> Vec<f64> {
    /// Standard deviations of the input's noise that count as left.
    const DEVIATIONS: f64 = 3.0;
    noise_expected(input_noise, weights, residual_noise)
        .into_iter()
        .zip(uncertain)
        .map(|(left, uncertain)| left.max(DEVIATIONS * uncertain))
        .collect()
}
