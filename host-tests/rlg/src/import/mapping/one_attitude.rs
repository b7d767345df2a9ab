//! Keeps one attitude of a file that states it more than once: the caller's, else a quaternion, a matrix, Euler angles.

use super::known_forms::Form;
use super::mapped::{Mapped, Plan};
use super::targets::Target;
use crate::import::files::columns::{Block, Column};
use crate::recording::Quantity;

/// Attitudes by preference: those without a convention of their own first.
const BY_PREFERENCE: [Target; 4] = [
    Target::Stored(Quantity::ReferenceAttitude),
    Target::AttitudeInverse,
    Target::Matrix,
    Target::Euler,
];

/// Leaves out all guessed attitudes but the preferred one that is whole.
pub fn keep(blocks: &[Block], plan: &mut Plan) {
    let is_whole = |target: &Target| {
        let has = |part: &&str| {
            let mut mapped = plan.mapped.iter();
            mapped.any(|one| one.target == *target && one.axis.as_deref() == Some(part))
        };
        target.parts().iter().all(has)
    };
    let given = plan
        .mapped
        .iter()
        .find(|mapped| mapped.is_given && mapped.target.is_attitude());
    let kept = match given {
        Some(given) => Some(given.target.clone()),
        None => BY_PREFERENCE.into_iter().find(is_whole),
    };
    let name = |mapped: &Mapped| blocks[mapped.block].columns[mapped.column].name.clone();
    let source: Vec<String> = plan
        .mapped
        .iter()
        .filter(|mapped| Some(&mapped.target) == kept.as_ref())
        .map(name)
        .collect();
    let is_dropped = |mapped: &Mapped| {
        mapped.target.is_attitude() && !mapped.is_given && Some(&mapped.target) != kept.as_ref()
    };
    let (dropped, rest): (Vec<Mapped>, Vec<Mapped>) = plan.mapped.drain(..).partition(is_dropped);
    plan.mapped = rest;
    for mapped in dropped {
        let reason = match kept {
            Some(_) => format!("the attitude is taken from {}", source.join(", ")),
            None => match mapped.target {
                Target::Euler => "an attitude needs three angles".to_owned(),
                Target::Matrix => "an attitude needs all nine elements".to_owned(),
                _ => "a quaternion needs w, x, y and z".to_owned(),
            },
        };
        plan.left_out.push((name(&mapped), reason));
        if kept.is_none() {
            plan.telling.push((mapped.block, mapped.column));
        }
    }
}

/// Reason of an orientation left out by [`empty_orientation`].
pub const EMPTY: &str = "it never changes, as of a sensor_msgs/Imu without an orientation";

/// Returns the orientation of a `sensor_msgs/Imu` that never changes: its driver has none. Another attitude may then take its
/// place.
pub fn empty_orientation(block: &Block) -> Vec<usize> {
    let is_imu = Form::of(block)
        .into_iter()
        .any(|form| form.name == "ROS sensor_msgs/Imu");
    let structure = |column: &Column| {
        let (before, _) = column.name.rsplit_once('.')?;
        before.ends_with("orientation").then(|| before.to_owned())
    };
    let columns = block.columns.iter().enumerate();
    let of_orientation = columns.filter_map(|(place, column)| Some((place, structure(column)?)));
    let of_orientation: Vec<(usize, String)> = of_orientation.filter(|_| is_imu).collect();
    let is_constant = |place: usize| {
        let values = &block.columns[place].values;
        values.windows(2).all(|pair| pair[0] == pair[1])
    };
    let is_empty = |name: &String| {
        let mut own = of_orientation.iter().filter(|(_, other)| other == name);
        own.all(|(place, _)| is_constant(*place))
    };
    let empty = of_orientation.iter().filter(|(_, name)| is_empty(name));
    empty.map(|(place, _)| *place).collect()
}
