//! Kinds that are not distinguishable from a constant rate at rest in one attitude.

use nalgebra::Vector3;
use rlg_catalogue::entries;
use rlg_signal::still::ROTATION_RAD_S;

/// Kinds that make a constant rate of this size \[rad/s\], within the priors of their own sizes.
///
/// # Inputs
/// `gravity_m_s2`: at the site; `deviations`: of the prior on a size, up to which it explains the rate.
pub(super) fn alike(bias_rad_s: Vector3<f64>, gravity_m_s2: f64, deviations: f64) -> Vec<String> {
    let size_rad_s = bias_rad_s.norm();
    let mut kinds = Vec::new();
    // A change of direction of the same rotation is twice its size at most.
    if size_rad_s <= 2.0 * ROTATION_RAD_S {
        kinds.push("earth_rate".to_string());
    }
    let of_input = [
        ("gyro_scale", ROTATION_RAD_S),
        ("installation", ROTATION_RAD_S),
        ("gyro_g_bias", gravity_m_s2),
    ];
    kinds.extend(
        of_input
            .into_iter()
            .filter(|(kind, input)| {
                let largest = entries::find(kind).map_or(0.0, |entry| entry.size.largest);
                size_rad_s <= deviations * largest * input
            })
            .map(|(kind, _)| kind.to_string()),
    );
    kinds
}
