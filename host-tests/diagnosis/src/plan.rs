//! The numbers of a diagnosis against a reference on the gyros' rows, decided before looking.

use std::ops::Range;

use rlg_inference::SearchPlan;
use rlg_signal::own_lines::OwnLinesPlan;
use rlg_signal::partition::PartitionPlan;
use rlg_signal::shrinkage::Gate;

/// How what is far from the model is recognised.
#[derive(Debug, Clone, Copy)]
pub struct CoarsePlan {
    /// Longest delay that is sought \[s\].
    pub longest_delay_s: f64,
    /// Longest time constant of a low pass that is sought, here and by the search \[s\]: beyond it nobody calls it a bandwidth.
    pub longest_low_pass_s: f64,
    /// Share of what is left that something far off must explain \[1\].
    pub explained: f64,
    /// Or by how much its gain in blocks of rows must stand above their scatter \[σ\].
    pub far_deviations: f64,
    /// Lags within this in log likelihood are one: of a motion that repeats itself the nearest to zero counts.
    pub tie: f64,
    /// Sums of rows stand for rows where there are more \[rows\].
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

/// Blocks of rows that an effect must hold in.
#[derive(Debug, Clone, Copy)]
pub struct BlockPlan {
    /// Length of a block \[s\].
    pub length_s: f64,
    /// Blocks at least, however short.
    pub least: usize,
    /// Blocks at most, however long.
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
    /// Cuts the rows that are `seen` into contiguous blocks of about as many of them; a block may span rows that are not.
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

/// How lines of a unit at rest are recognised.
#[derive(Debug, Clone, Copy)]
pub struct LinePlan {
    /// Chance of a line by noise below which it is one, all frequencies counted.
    pub chance: f64,
    /// Share of a line's power that one phase must explain \[1\]: below a half, predicting it adds power.
    pub coherence: f64,
    /// Pieces of the record whose phases are compared.
    pub pieces: usize,
    /// Highest degree of a phase: its frequency, the drift of that, and what wanders faster.
    pub most_degrees: usize,
    /// Resolutions of the record on either side that belong to a line.
    pub own_resolutions: f64,
    /// Lines at most: beyond this a spectrum is no set of lines.
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

/// Prices of how recordings share an effect, in log posterior: six of ten are common, two of ten have another size in
/// each recording, two of ten are in one alone.
#[derive(Debug, Clone, Copy)]
pub struct SeveralPlan {
    /// One size in all recordings.
    pub common: f64,
    /// A size of its own in each.
    pub apart: f64,
    /// In one recording, ln of their number not counted.
    pub only: f64,
    /// How far delays of two recordings may part and still be made about one \[σ\].
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

/// How a recording longer than memory is cut.
#[derive(Debug, Clone, Copy)]
pub struct LongPlan {
    /// Stretches that are looked at row by row, at most.
    pub stretches: usize,
    /// Share of the rows that may be held at once that they have together \[1\]: the rest is for what is made of them.
    pub of_rows: f64,
    /// Ends of a stretch that only feed its spectra \[s\]: a motion that is cut off leaves its filtered rate wrong there.
    pub ends_s: f64,
    /// A stretch has this many times the length of its two ends at least.
    pub least_of_ends: f64,
    /// Rows of a stretch at least: in a few hundred a filter can pass for their noise.
    pub least_rows: usize,
    /// Blocks per second into which all rows are summed \[Hz\].
    pub blocks_hz: f64,
    /// Blocks at most: of a longer recording they are longer.
    pub most_blocks: usize,
    /// Length of what is read at once \[s\].
    pub chunk_s: f64,
    /// What is read besides on either side \[s\]: temperature, the slowest, is smoothed over two seconds.
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
/// `rlg challenge --marks` shows what they give on seeds that they were not chosen on, and with `--vary` what other
/// values of one of them would.
#[derive(Debug, Clone, Copy)]
pub struct AnalysisPlan {
    /// Rows fitted, confirmed, tested.
    pub partition: PartitionPlan,
    /// Blocks that an effect must hold in.
    pub blocks: BlockPlan,
    /// What is far from the model.
    pub coarse: CoarsePlan,
    /// Lines of a unit at rest.
    pub lines: LinePlan,
    /// Search for lines of the gyros alone.
    pub own_lines: OwnLinesPlan,
    /// Prices of the search.
    pub search: SearchPlan,
    /// Prices of how recordings share effects.
    pub several: SeveralPlan,
    /// How a recording longer than memory is cut.
    pub long: LongPlan,
    /// Log posterior that a named effect must cost to do without.
    pub naming: f64,
    /// A rival that comes within this in log posterior stands in the effect's class.
    pub class_within: f64,
    /// A rival whose columns leave less of the effect than this \[σ\] stands in its class.
    pub separation: f64,
    /// How often the recording is re-enacted without an effect at most.
    pub reenactments: usize,
    /// Chance below which what re-enactments show is no chance: an effect is deflated, or more of them cannot take its name.
    pub reenactment_chance: f64,
    /// Share of the residual's power below which an effect that turns no gyro further than its noise has no practical size.
    pub practical_share: f64,
    /// An effect that drift explains to within this, drift unpriced, may be drift.
    pub drift_within: f64,
    /// Standard deviation of the logarithm of the reference's noise power about its declaration \[1\]: 1 is a factor of 1.6
    /// in the noise itself.
    pub reference_std: f64,
    /// Where the reference shows motion.
    pub gate: Gate,
    /// Cells of time and frequency above the gate below which an axis shows no motion: some neighbourhoods of nine.
    pub least_cells: usize,
    /// Size of an event below which it is not tried \[σ\].
    pub event: f64,
    /// Chance of a band's power below which the fit leaves something there, all bands counted.
    pub unexplained: f64,
    /// Excess of a noise level over what is declared and measured below which it is no finding \[σ\].
    pub excess_noise: f64,
    /// The same as a ratio of powers.
    pub excess_ratio: f64,
    /// Ratio of powers up to which two octaves hold the same white noise of angle: flat noise differs by four.
    pub same_angle_ratio: f64,
    /// Most passes between motion, columns and search.
    pub passes: usize,
}

impl Default for AnalysisPlan {
    fn default() -> Self {
        Self {
            partition: PartitionPlan::default(),
            blocks: BlockPlan::default(),
            coarse: CoarsePlan::default(),
            lines: LinePlan::default(),
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

/// A number of the plan.
type Number = fn(&mut AnalysisPlan) -> &mut f64;

/// Numbers that can be varied: all that are no shares of rows and no counts.
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
    /// The plan with one number times `factor`, and the number's value then; `None` where there is no such number.
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
