//! Sag of a mount between reference and unit under force: the unit then turns about an axis across the force, so that
//! `elastic_rate_by_force` is antisymmetric.

use rlg_model::catalogue::NINE;

/// Standard gravity \[m/s²\].
const GRAVITY_M_S2: f64 = 9.806_65;

/// Returns a sentence on the sag of a mount that explains most of a turn by force; `None` if the symmetric part is as large.
///
/// # Inputs
/// `numbers`: names and values of `elastic_rate_by_force` \[rad per m/s²\].
pub(crate) fn sags(numbers: &[(&str, f64)]) -> Option<String> {
    let of = |gyro: usize, axis: usize| -> f64 {
        let name = NINE[3 * gyro + axis];
        let own = numbers.iter().filter(|(known, _)| *known == name);
        own.map(|(_, value)| value).sum()
    };
    let mut across = 0.0;
    let mut other = 0.0;
    for gyro in 0..3 {
        other += of(gyro, gyro).powi(2);
        for axis in 0..gyro {
            let (one, turned) = (of(gyro, axis), of(axis, gyro));
            across += 0.5 * (one - turned).powi(2);
            other += 0.5 * (one + turned).powi(2);
        }
    }
    // Both entries of a pair are the same sag.
    let mrad_per_g = (0.5 * across).sqrt() * GRAVITY_M_S2 * 1e3;
    (across > other).then(|| {
        format!("Most of it is antisymmetric (yz = −zy): the mount between reference and unit sags, by {mrad_per_g:.2} mrad per g.")
    })
}

#[cfg(test)]
mod tests {
    use super::sags;

    #[test]
    fn a_sagging_mount_is_said_and_a_twisting_block_is_not() {
        // 150 µrad per m/s²: 1.47 mrad per g.
        let mount = [("yz", 1.5e-4), ("zy", -1.45e-4), ("xx", 1e-5)];
        let said = sags(&mount).expect("antisymmetric");
        assert!(said.contains("1.45 mrad per g"), "{said}");
        assert_eq!(sags(&[("xx", 1.5e-4), ("yz", 2e-5)]), None);
        assert_eq!(sags(&[("yz", 1.5e-4), ("zy", 1.5e-4)]), None);
    }
}
