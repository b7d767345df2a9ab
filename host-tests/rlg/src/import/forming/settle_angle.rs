//! Angles with no more in their name, which follow a gyro.

use super::evidence;
use super::settle::{ALIKE, Settled};
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::mapping::mapped::Plan;
use crate::import::mapping::questions::Question;

/// Largest number of columns that are compared with the gyros.
const MOST_TRIED: usize = 8;

impl Settled {
    /// Asks for a column that may be the angle of a table, where no reference is known and a gyro follows it: it may as well
    /// be the unit's own sum.
    pub(super) fn ask_followed(
        &mut self,
        blocks: &mut Vec<Block>,
        first: &Plan,
        lacks_rate: bool,
    ) -> Result<(), InputError> {
        let has_reference = first.mapped.iter().any(|one| one.target.is_reference());
        if has_reference || first.unordered.len() == 4 {
            return Ok(());
        }
        let name_of =
            |(block, column): &(usize, usize)| blocks[*block].columns[*column].name.clone();
        let names: Vec<String> = first.telling.iter().map(name_of).collect();
        let angles = names
            .iter()
            .filter(|name| !name.to_lowercase().contains("temp"));
        let mut followed: Option<(&String, &str, f64)> = None;
        for name in angles.take(MOST_TRIED) {
            let mut tried = self.clone();
            tried.maps.push(format!("{name}=reference_angle:z"));
            let Ok(plan) = tried.plan(blocks) else {
                continue;
            };
            let assembled = tried.provisional(blocks, &plan, lacks_rate)?;
            let found = evidence::axis_of_reference(&assembled.tables);
            let found = found.filter(|(_, found)| found.abs() > ALIKE);
            if let Some((axis, found)) = found
                && followed.is_none_or(|(.., before)| found.abs() > before.abs())
            {
                followed = Some((name, axis, found));
            }
        }
        if let Some((name, axis, found)) = followed {
            let sign = match found < 0.0 {
                true => ", which reads it with the other sign",
                false => "",
            };
            let map = format!("{name}=reference_angle:{axis}");
            self.questions.push(Question {
                asks: format!("{name}: may be the angle of a table, or the unit's own sum"),
                answer: ("--map", vec![map.clone()]),
                is_guess: true,
                evidence: format!("it follows gyro {axis} (correlation {found:.3}){sign}"),
            });
            self.maps.push(map);
        }
        Ok(())
    }
}
