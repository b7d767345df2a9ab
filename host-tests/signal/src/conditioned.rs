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

/// Noise power that is left in the conditioned input.
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
    /// Below this share of the residual's noise nothing is known of the input's.
    const FLOOR: f64 = 1e-6;
    /// Standard deviations of the input's noise that count as left.
    const DEVIATIONS: f64 = 3.0;
    (0..input_noise.len())
        .map(|k| {
            let left = input_noise[k] * (1.0 - weights[k]);
            left.max(DEVIATIONS * uncertain[k])
                .max(FLOOR * residual_noise[k])
        })
        .collect()
}
