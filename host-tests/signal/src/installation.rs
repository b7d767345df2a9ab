//! Orientation of the sensing axes in the body.

use nalgebra::Matrix3;
use rlg_model::Installation;

/// The matrix of Eq. (7): body rates from the rates along the sensing axes.
pub fn body_from_sensing(installation: &Installation) -> Matrix3<f64> {
    let e = installation;
    Matrix3::new(1.0, e.xz, e.xy, e.yz, 1.0, e.yx, e.zy, e.zx, 1.0)
}
