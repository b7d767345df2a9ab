//! Settings for the map between two instruments.

/// Settings of the estimate.
#[derive(Debug, Clone, Copy)]
pub struct MapPlan {
    /// Largest delay of the search on either side \[s\]: the largest seen between two recorders of one experiment.
    pub most_delay_s: f64,
    /// Largest delay that is likelier than reversed or exchanged channels \[s\]: some periods of a slow instrument. At one
    /// frequency a delay of half a period is equivalent to a sign.
    pub likely_delay_s: f64,
    /// Largest loss of explained power of an equivalent delay, as a share \[1\].
    pub as_well: f64,
    /// Share of an axis in its own gyro below which other delays are tried \[1\]: 0.3 rad of tilt leave more.
    pub own: f64,
    /// Relative width of a band \[1\], as the noise is binned elsewhere.
    pub band: f64,
    /// Least frequencies in a band: three coefficients are fitted, and the residual needs some degrees of freedom.
    pub least_bins: usize,
    /// Largest standard deviation of a judged coefficient, as a share of its axis's column \[1\].
    pub known: f64,
    /// Least attenuation factor by noise of the reference \[1\]: below it the coefficient is dominated by noise.
    pub kept: f64,
    /// Least squared coherence of a band in the comparison of gains \[1\].
    pub coherent: f64,
    /// Least rows for a regression.
    pub least_rows: usize,
}

impl Default for MapPlan {
    fn default() -> Self {
        Self {
            most_delay_s: 0.5,
            likely_delay_s: 0.05,
            as_well: 0.1,
            own: 0.9,
            band: 0.08,
            least_bins: 8,
            known: 0.05,
            kept: 0.8,
            coherent: 0.9,
            least_rows: 100,
        }
    }
}
