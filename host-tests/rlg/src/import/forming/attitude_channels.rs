//! Forms `reference_attitude` of a table from quaternions, matrices or Euler angles.

use std::path::Path;

use super::assemble::Builder;
use super::attitudes::{EulerOrder, of_euler, of_matrix, unit};
use super::clocks::Said;
use crate::error::InputError;
use crate::import::mapping::known_forms::Form;
use crate::import::mapping::mapped::Mapped;
use crate::import::mapping::targets::Target;
use crate::recording::Quantity;

impl Builder<'_> {
    /// Forms `reference_attitude` from quaternions of either sense, or from Euler angles.
    pub(super) fn attitudes(&mut self, columns: &[&Mapped], said: &Said) -> Result<(), InputError> {
        let attitudes = columns.iter().filter(|mapped| mapped.target.is_attitude());
        let attitudes: Vec<&&Mapped> = attitudes.collect();
        let Some(first) = attitudes.first() else {
            return Ok(());
        };
        let file = self.file(first).to_path_buf();
        let labels = first.target.parts();
        let mut found = Vec::new();
        for label in labels {
            let component = attitudes.iter().find(|mapped| {
                mapped.axis.as_deref() == Some(label) && mapped.target == first.target
            });
            found.push(component.ok_or_else(|| {
                InputError::new(&file, "has an attitude that is not whole")
                    .channel(format!("{} {label}", first.target.name()))
                    .expected(format!("a column each for {}", labels.join(", ")))
            })?);
        }
        let mut values: Vec<Vec<f64>> = Vec::with_capacity(found.len());
        for mapped in &found {
            values.push(self.values(mapped));
        }
        let mut next = || match values.is_empty() {
            true => Vec::new(),
            false => values.remove(0),
        };
        let names =
            [0, 1, 2, 3].map(|part: usize| found.get(part).map_or("", |one| self.source(one)));
        let components = match first.target {
            Target::Euler => {
                let order = self.euler_order(first, &file, said)?;
                of_euler(order, [next(), next(), next()])
            }
            Target::Matrix => of_matrix(&file, names, &values)?,
            _ => {
                let is_inverse = first.target == Target::AttitudeInverse;
                unit(&file, names, [next(), next(), next(), next()], is_inverse)?
            }
        };
        let origins: Vec<String> = found
            .iter()
            .map(|mapped| self.source(mapped).to_owned())
            .collect();
        for (place, (axis, values)) in ["w", "x", "y", "z"].into_iter().zip(components).enumerate()
        {
            let origin = match first.target {
                Target::Euler => format!("{} as Euler angles", origins.join(", ")),
                Target::Matrix => format!("{} as a rotation matrix", origins.join(", ")),
                Target::AttitudeInverse => format!("{}, conjugate", origins[place]),
                _ => format!("{}, body to navigation", origins[place]),
            };
            self.add(
                Quantity::ReferenceAttitude,
                Some(axis),
                (1.0, 0.0),
                values,
                origin,
            );
        }
        Ok(())
    }

    /// Returns the order of the rotations: as said, as the file's publisher documents it, or, for angles that are named roll,
    /// pitch and yaw, yaw first as in aviation.
    fn euler_order(
        &mut self,
        first: &Mapped,
        file: &Path,
        said: &Said,
    ) -> Result<EulerOrder, InputError> {
        if let Some(order) = said.euler {
            return Ok(order);
        }
        let documented = Form::euler(&self.blocks[first.block]);
        let usual = (!first.is_given).then_some("zyx");
        if let Some(order) = documented.or(usual)
            && let Some(parsed) = EulerOrder::parse(order)
        {
            if documented.is_none() {
                let note = format!(
                    "the Euler angles are taken as {order}: yaw, then pitch, then roll; --euler says another order"
                );
                self.assembled.notes.push(note);
            }
            return Ok(parsed);
        }
        Err(
            InputError::new(file, "has Euler angles of an unknown sequence")
                .channel(first.target.name())
                .expected("--euler with the axes in the order of the rotations, such as zyx for yaw, pitch, roll"),
        )
    }
}
