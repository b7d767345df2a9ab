//! Maps channels into the gyros' axes by the model: order, sign and factor of the reference, or of the pickoffs.

use nalgebra::{Matrix3, Vector3};
use rlg_model::ModelEffect;
use rlg_model::catalogue::NINE;

use super::axes::Triad;

/// Kinds of model effects that correct channels.
pub const KINDS: [&str; 3] = ["channel_order", "channel_sign", "channel_factor"];

/// Corrects channels by the model's effects, in their order.
pub fn apply(case_rad: &mut Triad, pickoff_rad: &mut Option<Triad>, effects: &[ModelEffect]) {
    let known = effects
        .iter()
        .filter(|effect| KINDS.contains(&effect.kind.as_str()));
    for effect in known {
        let map = Matrix3::from_fn(|gyro, axis| effect.number(NINE[3 * gyro + axis]));
        match effect.text("channel") {
            Some("dither") => {
                if let Some(pickoff_rad) = pickoff_rad {
                    turn(pickoff_rad, &map);
                }
            }
            _ => turn(case_rad, &map),
        }
    }
}

/// Maps three channels into other axes, row by row.
fn turn(channels: &mut Triad, map: &Matrix3<f64>) {
    for row in 0..channels[0].len() {
        let turned = map * Vector3::from_fn(|axis, _| channels[axis][row]);
        for (axis, channel) in channels.iter_mut().enumerate() {
            channel[row] = turned[axis];
        }
    }
}
