//! The numbers by which the map between two instruments is measured.

/// Numbers of the measurement.
#[derive(Debug, Clone, Copy)]
pub struct MapPlan {
    /// Delays that are searched on either side \[s\]: the largest that two recorders of one experiment were seen to have.
    pub most_delay_s: f64,
    /// Delays up to which one is likelier than channels that are reversed or exchanged \[s\]: some periods of a slow
    /// instrument. At one frequency half a period's delay is a sign.
    pub likely_delay_s: f64,
    /// Share of the explained power that another delay may miss and still explain the recording as well \[1\].
    pub as_well: f64,
    /// Share of an axis that its own gyro shows below which other delays are looked at \[1\]: 0.3 rad of tilt leave more.
    pub own: f64,
    /// Relative width of a band \[1\], as the noise is binned elsewhere.
    pub band: f64,
    /// Least frequencies in a band: three coefficients are fitted, and some are needed to say what is left.
    pub least_bins: usize,
    /// Largest standard deviation of a coefficient that is judged, as a share of what its axis shows \[1\].
    pub known: f64,
    /// Least share of a coefficient that noise in the reference leaves \[1\]: below it the coefficient is the noise's.
    pub kept: f64,
    /// Least squared coherence of a band whose gain is compared with the others' \[1\].
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
