//! Counts the cost of each stage of the chain, in instructions that the emulator executed.
//!
//! From the unchanged image and the addresses that it executed in the sampling interrupt it gives [`StageCosts`]:
//! instructions a sample for each source file of the chain, and one ordinary sample's instructions in order, for
//! [`cycles`](super::cycles).
//!
//! An instruction belongs to the stage whose source it came from. The compiler records its source with all inlined
//! calls (DWARF 3.3.8); the outermost file of `src/chain/stages/` in that list is the stage. A function called by a
//! stage counts as the stage (memory copies, rounding). `chain.rs` and `discontinuity.rs` count as the chain itself:
//! counting samples, status, start and gaps.
//!
//! The measured code has no probe in it, so it is the image that the other figures describe. Where the optimiser merged
//! the work of two stages into one instruction, it counts as the stage that the compiler names.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use super::code::Code;
use super::lines::Lines;

/// The interrupt, and the function of the image that holds the processor and the chain.
const INTERRUPT: &str = "TIM2";
const PROCESSOR: &str = "sampling::advance";

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Row {
    /// A file of `src/chain/stages/`, by its stem, in the order of the data.
    Stage(&'static str),
    /// `chain.rs` and `discontinuity.rs`.
    Chain,
    /// The code around the chain: health, telemetry frame.
    Processor,
    /// Reading the timer for the figures of the run's report.
    Measuring,
}

/// The stages in the order of the data; files that are not in the chain have no instructions.
const STAGES: [&str; 13] = [
    "limits",
    "adaptation",
    "counts",
    "dither",
    "compensation",
    "acceleration",
    "installation",
    "coning",
    "velocity",
    "sculling",
    "size_effect",
    "turning",
    "frame",
];

impl Row {
    /// The row's name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stage(name) => name,
            Self::Chain => "chain",
            Self::Processor => "processor",
            Self::Measuring => "measuring",
        }
    }

    /// True if the row is part of the chain.
    pub fn is_chain(self) -> bool {
        matches!(self, Self::Stage(_) | Self::Chain)
    }

    fn of_file(path: &str) -> Option<Self> {
        let path = path.replace('\\', "/");
        if let Some((_, file)) = path.rsplit_once("src/chain/stages/") {
            let stem = file.strip_suffix(".rs")?;
            return STAGES
                .into_iter()
                .find(|stage| *stage == stem)
                .map(Self::Stage);
        }
        let is = |file: &str| path.ends_with(file);
        if is("src/chain.rs") || is("src/chain/discontinuity.rs") {
            Some(Self::Chain)
        } else if is("src/unit/processor.rs") || is("src/unit/health.rs") {
            Some(Self::Processor)
        } else if path.contains("src/hardware/") {
            Some(Self::Measuring)
        } else {
            None
        }
    }
}

/// Reason that instructions cannot be attributed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageError(pub &'static str);

impl std::fmt::Display for StageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl std::error::Error for StageError {}

/// Address ranges of the interrupt's instructions: itself and everything it calls.
pub fn interrupt_ranges(code: &Code) -> Option<Vec<Range<u64>>> {
    let interrupt = code.find(INTERRUPT)?;
    let reached = code.reachable(interrupt);
    Some(
        reached
            .into_iter()
            .filter_map(|begin| Some(begin..begin + code.functions.get(&begin)?.size))
            .collect(),
    )
}

/// Instructions of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageCosts {
    /// Number of samples, without the stream's first [`SETTLING_SAMPLES`].
    pub samples: u32,
    /// Number of these samples that completed an output.
    pub with_output: u32,
    /// Instructions of samples that complete no output, by row.
    pub between_outputs: BTreeMap<Row, u64>,
    /// Instructions of samples that complete one, by row.
    pub at_outputs: BTreeMap<Row, u64>,
    /// Addresses of the chain's instructions in one sample between outputs, in order.
    pub ordinary_sample: Vec<u64>,
}

/// Samples at the stream's begin that are left out: the first fill the memory of the stages.
pub const SETTLING_SAMPLES: usize = 8;

impl StageCosts {
    /// Sorts `executed`, the addresses of a run with an output every `samples_per_output` samples.
    pub fn of(
        elf: &[u8],
        code: &Code,
        executed: &[u64],
        samples_per_output: usize,
    ) -> Result<Self, StageError> {
        let processor = code
            .functions
            .iter()
            .find(|(_, function)| function.name.ends_with(PROCESSOR))
            .map(|(begin, _)| *begin)
            .ok_or(StageError("has no function that holds the chain"))?;
        let interrupt = code
            .find(INTERRUPT)
            .and_then(|begin| Some(begin..begin + code.functions.get(&begin)?.size))
            .ok_or(StageError("has no sampling interrupt"))?;
        let mut rows = Rows::of(elf)?;

        let mut costs = Self::default();
        let mut sample: Vec<(u64, Row)> = Vec::new();
        let mut inside = false;
        let mut at = 0;
        for address in executed {
            if *address == processor {
                inside = true;
                sample.clear();
            } else if inside && interrupt.contains(address) {
                inside = false;
                costs.add(at, samples_per_output, &sample);
                at += 1;
            }
            if inside {
                // An instruction without a row of its own belongs to the row before it, or is called from it.
                let before = sample.last().map_or(Row::Processor, |(_, row)| *row);
                sample.push((*address, rows.row(*address).unwrap_or(before)));
            }
        }
        if costs.samples == 0 {
            return Err(StageError("executed no sample"));
        }
        Ok(costs)
    }

    fn add(&mut self, at: usize, samples_per_output: usize, sample: &[(u64, Row)]) {
        if at < SETTLING_SAMPLES {
            return;
        }
        self.samples += 1;
        let completes = (at + 1).is_multiple_of(samples_per_output);
        self.with_output += u32::from(completes);
        let sums = if completes {
            &mut self.at_outputs
        } else {
            &mut self.between_outputs
        };
        for (_, row) in sample {
            *sums.entry(*row).or_default() += 1;
        }
        if !completes {
            self.ordinary_sample = sample
                .iter()
                .filter(|(_, row)| row.is_chain())
                .map(|(address, _)| *address)
                .collect();
        }
    }

    /// Mean instructions a sample: between outputs, at outputs, over all.
    pub fn means(&self, row: Row) -> [f64; 3] {
        let between = self.between_outputs.get(&row).copied().unwrap_or(0) as f64;
        let at_outputs = self.at_outputs.get(&row).copied().unwrap_or(0) as f64;
        let all = f64::from(self.samples);
        let with_output = f64::from(self.with_output);
        [
            between / (all - with_output),
            at_outputs / with_output,
            (between + at_outputs) / all,
        ]
    }

    /// The rows that have instructions: stages in the order of the data, then the rows around them.
    pub fn rows(&self) -> Vec<Row> {
        STAGES
            .into_iter()
            .map(Row::Stage)
            .chain([Row::Chain, Row::Processor, Row::Measuring])
            .filter(|row| {
                self.between_outputs.contains_key(row) || self.at_outputs.contains_key(row)
            })
            .collect()
    }

    /// Mean instructions a sample of the whole chain.
    pub fn chain_mean(&self) -> f64 {
        self.rows()
            .into_iter()
            .filter(|row| row.is_chain())
            .map(|row| self.means(row)[2])
            .sum()
    }
}

/// Finds the row of an address by the image's debug information.
struct Rows<'a> {
    lines: Lines<'a>,
    known: HashMap<u64, Option<Row>>,
}

impl<'a> Rows<'a> {
    fn of(elf: &'a [u8]) -> Result<Self, StageError> {
        Ok(Self {
            lines: Lines::of(elf).map_err(|_| StageError("has no debug information"))?,
            known: HashMap::new(),
        })
    }

    /// The outermost stage that the instruction was inlined into, or another row of the chain.
    fn row(&mut self, address: u64) -> Option<Row> {
        if let Some(row) = self.known.get(&address) {
            return *row;
        }
        let row = self.look_up(address);
        self.known.insert(address, row);
        row
    }

    fn look_up(&self, address: u64) -> Option<Row> {
        let mut found = None;
        // From the innermost outwards.
        for place in self.lines.places(address) {
            let row = Row::of_file(&place.file);
            found = match (found, row) {
                // A stage in a stage: the outer one called it.
                (_, Some(Row::Stage(stage))) => Some(Row::Stage(stage)),
                (None, row) => row,
                (found, _) => found,
            };
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::{Row, StageCosts};

    #[test]
    fn a_file_is_the_row_it_is_named_after() {
        let row = |path| Row::of_file(path);
        assert_eq!(
            row("src/chain/stages/coning.rs"),
            Some(Row::Stage("coning"))
        );
        assert_eq!(row("/home/x/src/chain.rs"), Some(Row::Chain));
        assert_eq!(row("src/unit/processor.rs"), Some(Row::Processor));
        assert_eq!(row("src/hardware/sample_timer.rs"), Some(Row::Measuring));
        // Number systems and the core library are part of whatever stage used them.
        assert_eq!(row("src/chain/numbers/fixed.rs"), None);
        assert_eq!(row("/rustc/1/library/core/src/num/mod.rs"), None);
    }

    #[test]
    fn means_are_taken_over_the_samples_that_they_are_of() {
        let mut costs = StageCosts::default();
        let coning = Row::Stage("coning");
        for at in 0..28 {
            // Every tenth sample completes an output and costs three instructions instead of two.
            let cost = if (at + 1) % 10 == 0 { 3 } else { 2 };
            costs.add(at, 10, &vec![(0x100, coning); cost]);
        }
        // 20 samples are left after the first 8, two of them with an output.
        assert_eq!((costs.samples, costs.with_output), (20, 2));
        assert_eq!(costs.means(coning), [2.0, 3.0, 2.1]);
        assert_eq!(costs.chain_mean(), 2.1);
    }
}
