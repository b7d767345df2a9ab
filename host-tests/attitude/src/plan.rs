//! Numbers that decide what is named. Calibrated by `cargo test -p rlg --test diagnose attitude` and on rotated blocks of
//! real recordings (inference.md, B6).

use rlg_signal::own_lines::OwnLinesPlan;

/// See the page above.
#[derive(Debug, Clone, Copy)]
pub struct AttitudePlan {
    /// Least stamps of which this likelihood makes anything: below, the model must state the noise.
    pub least_stamps: usize,
    /// White noise of an attitude reference that the model does not describe and that too few rows show, the median
    /// \[rad\]: optical tracking has 1e-4 to 1e-3, a camera 2e-3, a table or corner by hand up to 1e-2.
    pub undeclared_attitude_noise_rad: f64,
    /// Standard deviation of the logarithm of a noise that few rows have and the model does not declare.
    pub undeclared_log_std: f64,
    /// Share of the stamps at the end that serve the last test alone.
    pub tested_share: f64,
    /// Least gain in log likelihood, deflated by what blocks disagree and less the price of the search.
    pub least_gain: f64,
    /// Least log likelihood that an effect of physics gains in blocks that it was not estimated from.
    pub least_predicted: f64,
    /// A kind whose gain is this near the winner's cannot be told from it.
    pub alike_within: f64,
    /// Share of the best gain from which a group of the registration is grown from, too.
    pub nearly: f64,
    /// Most effects of physics.
    pub most_effects: usize,
    /// What is left is not explained where its power on unseen rows exceeds what the noise predicts so many times.
    pub most_power: f64,
    /// Search for lines of the gyros alone.
    pub lines: OwnLinesPlan,
}

impl Default for AttitudePlan {
    fn default() -> Self {
        Self {
            least_stamps: 40,
            undeclared_attitude_noise_rad: 1e-3,
            undeclared_log_std: 1.15,
            tested_share: 0.2,
            least_gain: 4.0,
            least_predicted: 4.0,
            alike_within: 5.0,
            nearly: 0.5,
            most_effects: 6,
            most_power: 10.0,
            lines: OwnLinesPlan::default(),
        }
    }
}
