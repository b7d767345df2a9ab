//! Checks an image against `firmware-budgets.toml`, the limits of the firmware's cost.
//!
//! Each budget that an image or the figures of a run exceed gives one sentence.

use std::path::Path;

use serde::Deserialize;

use super::TargetCore;
use super::image::{self, Image};
use super::stack::{StackBound, StackError};
use rlg_recording::error::InputError;

/// The file, at the workspace's root.
const FILE: &str = "firmware-budgets.toml";

/// One budget. It has a reason, or the file is refused.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// The limit, in the unit of the field's name.
    pub at_most: f64,
    /// The reason for the figure.
    pub reason: String,
}

impl Budget {
    /// A sentence if `found`, of the quantity `name`, exceeds it.
    pub fn exceeded_by(&self, name: &str, found: f64) -> Option<String> {
        // Written so that NaN exceeds.
        let kept = found <= self.at_most;
        (!kept).then(|| {
            let reason: Vec<&str> = self.reason.split_whitespace().collect();
            format!(
                "{name} is {found:.3}, at most {}: {}",
                self.at_most,
                reason.join(" ")
            )
        })
    }
}

/// Budgets of the chain of one number system.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChainBudgets {
    /// Mean over all samples.
    pub instructions_mean: Budget,
    /// Most over least, between outputs.
    pub between_outputs_ratio: Budget,
}

/// Budgets of the chains of both number systems.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BothChains {
    /// Single precision.
    pub f32: ChainBudgets,
    /// Fixed point.
    pub fixed: ChainBudgets,
}

/// The whole file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budgets {
    /// Version of the file: 1.
    pub format: u32,
    /// Code, constants, initial values.
    pub flash_bytes: Budget,
    /// Static variables.
    pub ram_bytes: Budget,
    /// Computed worst case.
    pub stack_bytes: Budget,
    /// Single precision, gyros alone.
    pub f32: ChainBudgets,
    /// Fixed point, gyros alone.
    pub fixed: ChainBudgets,
    /// Gyros and accelerometers.
    pub with_accelerometers: BothChains,
}

impl Budgets {
    /// Budgets of the chain of `core`, with or without accelerometers.
    pub fn chain(&self, core: TargetCore, accelerometers: bool) -> &ChainBudgets {
        match (core, accelerometers) {
            (TargetCore::F32, false) => &self.f32,
            (TargetCore::Fixed, false) => &self.fixed,
            (TargetCore::F32, true) => &self.with_accelerometers.f32,
            (TargetCore::Fixed, true) => &self.with_accelerometers.fixed,
        }
    }

    /// The file of the workspace that this tool was compiled from.
    pub fn of_workspace() -> Result<Self, InputError> {
        Self::read(&image::workspace().join(FILE))
    }

    /// Reads a file; every budget must be there, positive and have a reason.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| InputError::new(path, format!("cannot be read ({error})")))?;
        let budgets: Self = toml::from_str(&text)
            .map_err(|error| InputError::new(path, format!("is no budget file ({error})")))?;
        if budgets.format != 1 {
            return Err(
                InputError::new(path, format!("has format {}", budgets.format))
                    .expected("format 1"),
            );
        }
        for (name, budget) in budgets.all() {
            if !(budget.at_most > 0.0 && budget.at_most.is_finite()) {
                return Err(InputError::new(
                    path,
                    format!("{name} is not a positive number"),
                ));
            }
            if budget.reason.trim().is_empty() {
                return Err(InputError::new(path, format!("{name} has no reason")));
            }
        }
        Ok(budgets)
    }

    /// Every budget with its name in the file.
    fn all(&self) -> Vec<(String, &Budget)> {
        let mut all = vec![
            ("flash_bytes".to_owned(), &self.flash_bytes),
            ("ram_bytes".to_owned(), &self.ram_bytes),
            ("stack_bytes".to_owned(), &self.stack_bytes),
        ];
        for (part, accelerometers) in [("", false), ("with_accelerometers.", true)] {
            for core in [TargetCore::F32, TargetCore::Fixed] {
                let chain = self.chain(core, accelerometers);
                for (name, budget) in [
                    ("instructions_mean", &chain.instructions_mean),
                    ("between_outputs_ratio", &chain.between_outputs_ratio),
                ] {
                    all.push((format!("{part}{}.{name}", core.name()), budget));
                }
            }
        }
        all
    }

    /// Returns a sentence for each budget that an image's memory exceeds, also for a stack beyond the room of `memory.x`.
    pub fn exceeded_by_image(&self, image: &Image) -> Result<Vec<String>, StackError> {
        let stack = StackBound::of(&image.elf)?;
        let mut exceeded: Vec<String> = [
            self.flash_bytes
                .exceeded_by("flash_bytes", image.flash_bytes as f64),
            self.ram_bytes
                .exceeded_by("ram_bytes", image.ram_bytes as f64),
            self.stack_bytes
                .exceeded_by("stack_bytes", f64::from(stack.worst_bytes)),
        ]
        .into_iter()
        .flatten()
        .collect();
        if stack.worst_bytes > stack.available_bytes {
            exceeded.push(format!(
                "the stack may take {} bytes, memory.x leaves it {}",
                stack.worst_bytes, stack.available_bytes
            ));
        }
        Ok(exceeded)
    }
}
