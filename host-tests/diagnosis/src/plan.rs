//! Numbers of a diagnosis against a reference on the gyros' rows, fixed before the data are seen.

use std::ops::Range;

use rlg_inference::SearchPlan;
use rlg_signal::own_lines::OwnLinesPlan;
use rlg_signal::partition::PartitionPlan;
use rlg_signal::shrinkage::Gate;

/// Criteria of the coarse search for effects far from the model.
#[derive(Debug, Clone, Copy)]
pub struct CoarsePlan {
    /// Longest delay that is sought \[s\].
    pub longest_delay_s: f64,
    /// Longest time constant of a low pass, here and in the search \[s\]; a longer one is no bandwidth.
    pub longest_low_pass_s: f64,
    /// Least share of the residual's power that a coarse effect explains \[1\].
    pub explained: f64,
    /// Alternative criterion: its gain in blocks of rows, over their scatter \[σ\].
    pub far_deviations: f64,
    /// Difference in log likelihood within which lags are tied: for a periodic motion the lag nearest to zero counts.
    pub tie: f64,
    /// Number of rows above which sums of rows are used \[rows\].
    pub most_rows: usize,
}

impl Default for CoarsePlan {
    fn default() -> Self {
        Self {
            longest_delay_s: 0.5,
            longest_low_pass_s: 0.5,
            explained: 0.5,
            far_deviations: 6.0,
            tie: 10.0,
            most_rows: 60_000,
        }
    }
}

/// Blocks of rows for the cross-validation of an effect.
#[derive(Debug, Clone, Copy)]
pub struct BlockPlan {
    /// Length of a block \[s\].
    pub length_s: f64,
    /// Least number of blocks, however short.
    pub least: usize,
    /// Largest number of blocks, however long.
    pub most: usize,
}

impl Default for BlockPlan {
    fn default() -> Self {
        Self {
            length_s: 6.0,
            least: 16,
            most: 64,
        }
    }
}

impl BlockPlan {
    /// Cuts the `seen` rows into contiguous blocks of about equal numbers of them; a block may span unseen rows.
    pub fn of(&self, seen: &[bool], rate_hz: f64) -> Vec<Range<usize>> {
        let count = seen.iter().filter(|&&seen| seen).count();
        let wished = (count as f64 / (self.length_s * rate_hz)).round() as usize;
        let blocks = wished.clamp(self.least, self.most).min(count.max(1));
        let mut cuts = vec![0];
        let mut before = 0;
        for (row, _) in seen.iter().enumerate().filter(|(_, seen)| **seen) {
            before += 1;
            if before * blocks >= cuts.len() * count {
                cuts.push(row + 1);
            }
        }
        cuts.windows(2).map(|pair| pair[0]..pair[1]).collect()
    }
}

/// Criteria for lines of a unit at rest.
#[derive(Debug, Clone, Copy)]
pub struct LinePlan {
    /// False-alarm probability of a line, all frequencies counted.
    pub chance: f64,
    /// Least share of a line's power explained by one phase \[1\]: below a half, its prediction adds power.
    pub coherence: f64,
    /// Number of pieces of the record whose phases are compared.
    pub pieces: usize,
    /// Highest degree of the phase polynomial: frequency, its drift, and faster wander.
    pub most_degrees: usize,
    /// Half-width of a line in resolutions of the record.
    pub own_resolutions: f64,
    /// Largest number of lines: beyond it a spectrum is no set of lines.
    pub most: usize,
}

impl Default for LinePlan {
    fn default() -> Self {
        Self {
            chance: 1e-4,
            coherence: 0.5,
            pieces: 8,
            most_degrees: 10,
            own_resolutions: 2.0,
            most: 48,
        }
    }
}

/// Criteria for bands of noise of a unit at rest.
#[derive(Debug, Clone, Copy)]
pub struct BandPlan {
    /// False-alarm probability of a band, all places and widths counted.
    pub chance: f64,
    /// Least half-width of a window \[quarters of the record's resolution\]: narrower features are lines.
    pub least_half_width: usize,
    /// Least ratio of frequency to width \[1\]: broader excess belongs to the noise terms.
    pub least_quality: f64,
    /// Least gain in log likelihood of a band on one gyro.
    pub naming: f64,
    /// Largest number of bands.
    pub most: usize,
}

impl Default for BandPlan {
    fn default() -> Self {
        Self {
            chance: 1e-4,
            least_half_width: 8,
            least_quality: 5.0,
            naming: 8.0,
            most: 16,
        }
    }
}

/// Prices in log posterior of the sharing of an effect between recordings: six of ten are common, two of ten have another
/// size in each recording, two of ten are in one alone.
#[derive(Debug, Clone, Copy)]
pub struct SeveralPlan {
    /// One size in all recordings.
    pub common: f64,
    /// A size of its own in each.
    pub apart: f64,
    /// One recording only, besides ln of the number of recordings.
    pub only: f64,
    /// Largest distance of a recording's delay from the joint delay for a common linearisation \[σ\].
    pub same_delay: f64,
}

impl Default for SeveralPlan {
    fn default() -> Self {
        Self {
            common: 0.5,
            apart: 1.6,
            only: 1.6,
            same_delay: 5.0,
        }
    }
}

/// Division of a recording longer than memory.
#[derive(Debug, Clone, Copy)]
pub struct LongPlan {
    /// Largest number of stretches analysed row by row.
    pub stretches: usize,
    /// Share of the stretches in the rows that may be held at once \[1\]; the rest is for series derived from them.
    pub of_rows: f64,
    /// Ends of a stretch that only feed its spectra \[s\]: the filtered rate of a truncated motion is wrong there.
    pub ends_s: f64,
    /// Least length of a stretch over that of its two ends \[1\].
    pub least_of_ends: f64,
    /// Least number of rows of a stretch: in a few hundred a filter can pass for their noise.
    pub least_rows: usize,
    /// Blocks per second into which all rows are summed \[Hz\].
    pub blocks_hz: f64,
    /// Largest number of blocks: a longer recording has longer blocks.
    pub most_blocks: usize,
    /// Length of a chunk read at once \[s\].
    pub chunk_s: f64,
    /// Margin read on either side of a chunk \[s\]: temperature, the slowest channel, is smoothed over two seconds.
    pub around_s: f64,
}

impl Default for LongPlan {
    fn default() -> Self {
        Self {
            stretches: 12,
            of_rows: 0.5,
            ends_s: 0.5,
            least_of_ends: 4.0,
            least_rows: 2000,
            blocks_hz: 20.0,
            most_blocks: 72_000,
            chunk_s: 30.0,
            around_s: 4.0,
        }
    }
}

/// All thresholds of this engine.
///
/// `rlg challenge --marks` evaluates them on seeds other than those of their selection, and with `--vary` evaluates other
/// values of one of them.
#[derive(Debug, Clone, Copy)]
pub struct AnalysisPlan {
    /// Partition of the rows: fitted, confirmed, tested.
    pub partition: PartitionPlan,
    /// Blocks for the cross-validation of an effect.
    pub blocks: BlockPlan,
    /// Criteria of the coarse search.
    pub coarse: CoarsePlan,
    /// Lines of a unit at rest.
    pub lines: LinePlan,
    /// Bands of noise of a unit at rest.
    pub bands: BandPlan,
    /// Search for lines of the gyros alone.
    pub own_lines: OwnLinesPlan,
    /// Prices of the search.
    pub search: SearchPlan,
    /// Prices of the sharing of effects between recordings.
    pub several: SeveralPlan,
    /// Division of a recording longer than memory.
    pub long: LongPlan,
    /// Least cost in log posterior of omitting a named effect.
    pub naming: f64,
    /// Largest deficit in log posterior of a rival in the effect's class.
    pub class_within: f64,
    /// Residual of the effect after projection on a rival's columns, below which the rival is in the effect's class \[σ\].
    pub separation: f64,
    /// Largest number of bootstrap draws of the recording without an effect.
    pub reenactments: usize,
    /// Significance level of the bootstrap: an effect is deflated, or no further draws can take its name.
    pub reenactment_chance: f64,
    /// Share of the residual's power below which an effect has no practical size, if it turns no gyro further than its
    /// noise.
    pub practical_share: f64,
    /// Log posterior within which unpriced drift explains an effect, so that it may be drift.
    pub drift_within: f64,
    /// Standard deviation of the logarithm of the reference's noise power about its declaration \[1\]: 1 is a factor of 1.6
    /// in the noise itself.
    pub reference_std: f64,
    /// Gate of the reference's motion.
    pub gate: Gate,
    /// Least number of time–frequency cells above the gate for an axis in motion: some neighbourhoods of nine.
    pub least_cells: usize,
    /// Least size of an event that is tried \[σ\].
    pub event: f64,
    /// Significance level of a band's residual power, all bands counted.
    pub unexplained: f64,
    /// Least excess of a noise level over the declared and measured noise for a finding \[σ\].
    pub excess_noise: f64,
    /// Least ratio of powers for the same.
    pub excess_ratio: f64,
    /// Largest ratio of powers of two octaves with the same white noise of angle: flat noise differs by four.
    pub same_angle_ratio: f64,
    /// Largest number of passes of motion, columns and search.
    pub passes: usize,
}

impl Default for AnalysisPlan {
    fn default() -> Self {
        Self {
            partition: PartitionPlan::default(),
            blocks: BlockPlan::default(),
            coarse: CoarsePlan::default(),
            lines: LinePlan::default(),
            bands: BandPlan::default(),
            own_lines: OwnLinesPlan::default(),
            search: SearchPlan::default(),
            several: SeveralPlan::default(),
            long: LongPlan::default(),
            naming: 4.0,
            class_within: 3.0,
            separation: 5.0,
            reenactments: 8,
            reenactment_chance: 1e-3,
            practical_share: 0.01,
            drift_within: 6.0,
            reference_std: 1.0,
            gate: Gate::default(),
            least_cells: 27,
            event: 3.5,
            unexplained: 1e-4,
            excess_noise: 6.0,
            excess_ratio: 1.1,
            same_angle_ratio: 1.2,
            passes: 8,
        }
    }
}

/// Accessor of a number of the plan.
type Number = fn(&mut AnalysisPlan) -> &mut f64;

/// Numbers that can be varied: all but shares of rows and counts.
pub const NUMBERS: [(&str, Number); 18] = [
    ("naming", |plan| &mut plan.naming),
    ("class_within", |plan| &mut plan.class_within),
    ("separation", |plan| &mut plan.separation),
    ("reenactment_chance", |plan| &mut plan.reenactment_chance),
    ("practical_share", |plan| &mut plan.practical_share),
    ("drift_within", |plan| &mut plan.drift_within),
    ("reference_std", |plan| &mut plan.reference_std),
    ("gate.ratio", |plan| &mut plan.gate.ratio),
    ("gate.bias", |plan| &mut plan.gate.bias),
    ("event", |plan| &mut plan.event),
    ("unexplained", |plan| &mut plan.unexplained),
    ("excess_noise", |plan| &mut plan.excess_noise),
    ("excess_ratio", |plan| &mut plan.excess_ratio),
    ("search.expected_effects", |plan| {
        &mut plan.search.expected_effects
    }),
    ("search.drift_term", |plan| &mut plan.search.drift_term),
    ("search.drift_any", |plan| &mut plan.search.drift_any),
    ("search.drift_odd", |plan| &mut plan.search.drift_odd),
    ("search.screening", |plan| &mut plan.search.screening),
];

impl AnalysisPlan {
    /// Scales one number by `factor`; returns the plan and the new value, or `None` for an unknown name.
    pub fn scaled(mut self, name: &str, factor: f64) -> Option<(Self, f64)> {
        let (_, number) = NUMBERS.iter().find(|(known, _)| *known == name)?;
        let value = number(&mut self);
        *value *= factor;
        let value = *value;
        Some((self, value))
    }
}

#[cfg(test)]
mod tests {
    use super::{AnalysisPlan, NUMBERS};

    #[test]
    fn every_number_is_scaled_alone() {
        let numbers = |mut plan: AnalysisPlan| NUMBERS.map(|(_, number)| *number(&mut plan));
        let before = numbers(AnalysisPlan::default());
        for (place, (name, _)) in NUMBERS.iter().enumerate() {
            let (plan, value) = AnalysisPlan::default().scaled(name, 2.0).expect("known");
            assert_eq!(value, 2.0 * before[place], "{name}");
            let mut expected = before;
            expected[place] = value;
            assert_eq!(numbers(plan), expected, "{name}");
        }
        assert!(AnalysisPlan::default().scaled("no number", 2.0).is_none());
    }
}
