//! Folder of a recording of counted pulses, as imports of the unit's raw stream and of a counter bank's frames write and report it.

use std::path::Path;

use crate::error::InputError;
use crate::import::still::{self, WITHOUT_SITE};
use crate::output::OutputFolder;
use crate::recording::{Quantity, Recording, Site};
use crate::terminal::Terminal;

/// Largest number of gaps printed one by one; the result holds all.
const GAPS_SAID: usize = 10;

/// Destination of an import.
pub(super) struct Destination<'a> {
    pub site: Option<Site>,
    /// Folder of the recording.
    pub target: &'a Path,
    /// Name of the model's file in it.
    pub model: &'a str,
}

impl Destination<'_> {
    /// Writes recording and ideal model into `out`, which becomes the folder; weights in radians a pulse.
    pub fn write(
        &self,
        recording: &Recording,
        pulse_weight_rad: [f64; 3],
        mut out: OutputFolder,
    ) -> Result<(), InputError> {
        recording.write_into(&mut out)?;
        let model = still::ideal(pulse_weight_rad, &[Quantity::GyroCount]);
        model.check(&self.target.join(self.model))?;
        out.write(self.model, model.to_toml().as_bytes())?;
        out.commit()
    }

    /// Prints the first gaps by `words`, an absent site, and the next command.
    pub fn report<Gap>(&self, gaps: &[Gap], words: impl Fn(&Gap) -> String, terminal: &Terminal) {
        for gap in gaps.iter().take(GAPS_SAID) {
            terminal.warn(words(gap));
        }
        let more = gaps.len().saturating_sub(GAPS_SAID);
        if more > 0 {
            terminal.warn(format!("{more} more gaps; --json lists them"));
        }
        if self.site.is_none() {
            terminal.warn(WITHOUT_SITE);
        }
        terminal.say(format!(
            "To diagnose: rlg diagnose {0} --model {0}/{1} --out DIR",
            self.target.display(),
            self.model
        ));
    }
}
