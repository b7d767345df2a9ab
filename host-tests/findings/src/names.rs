//! Plain words for kinds, parameters and channels of the contract.

/// Capitalises the first letter.
pub fn capital(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Kinds and their words, for kinds whose words are not their name.
const KINDS: &[(&str, &str)] = &[
    ("gyro_bias_temperature", "gyro bias by temperature"),
    (
        "gyro_bias_temperature_rate",
        "gyro bias by rate of temperature",
    ),
    ("gyro_bias_magnetic", "gyro bias by magnetic field"),
    ("gyro_g_bias", "gyro g-sensitivity"),
    ("gyro_g2_bias", "gyro g²-sensitivity"),
    ("gyro_scale_quadratic", "gyro scale by rate"),
    ("gyro_scale_cubic", "gyro scale by squared rate"),
    ("installation", "gyro axis misalignment"),
    (
        "installation_temperature",
        "gyro axis misalignment by temperature",
    ),
    ("axis_flexure_cubic", "cubic axis flexure"),
    ("axis_flexure_mode", "axis flexure with a resonance"),
    ("gyro_bandwidth", "gyro low pass"),
    ("gyro_high_pass", "gyro high pass"),
    ("dither_gain", "dither pickoff gain"),
    ("dither_cubic", "cubic dither pickoff"),
    ("lock_in", "lock-in"),
    ("lost_samples", "lost rows"),
    ("held_values", "held readings"),
    ("saturation", "saturated rows"),
    ("reference_misalignment", "reference turned"),
    ("reference_bandwidth", "reference low pass"),
    ("reference_settling", "settling attitude filter"),
    ("reference_pull", "attitude filter as reference"),
    ("isolator_mode", "isolator resonance"),
    ("earth_rate", "Earth rate"),
    ("accel_bias", "accelerometer bias"),
    ("accel_scale", "accelerometer scale"),
    ("accel_misalignment", "accelerometer misalignment"),
    ("accel_quadratic", "accelerometer scale by force"),
    ("size_effect", "accelerometer lever arms"),
    ("accel_delay", "accelerometer delay"),
    ("dither_delay", "dither pickoff delay"),
    ("unlisted", "physics outside the catalogue"),
];

/// Kinds with words for their sign: late if positive, early if negative.
const DELAYS: &[(&str, &str)] = &[
    ("gyro_delay", "gyro"),
    ("dither_delay", "dither pickoff"),
    ("reference_delay", "reference"),
    ("accel_delay", "accelerometer"),
];

/// Returns the words of a kind: those of the table, or its name with spaces.
pub fn plain(kind: &str) -> String {
    let known = KINDS.iter().find(|(name, ..)| *name == kind);
    known.map_or_else(|| spaced(kind), |(_, words)| (*words).to_owned())
}

/// Returns the words of a kind at these sizes: a delay is late or early if all sizes have one sign.
///
/// # Returns
/// The words, and the factor that gives the sizes their sign in these words.
pub fn plain_at(kind: &str, sizes: &[f64]) -> (String, f64) {
    let delay = DELAYS.iter().find(|(name, _)| *name == kind);
    match delay {
        Some((_, of)) if sizes.iter().all(|size| *size >= 0.0) => (format!("{of} late"), 1.0),
        Some((_, of)) if sizes.iter().all(|size| *size <= 0.0) => (format!("{of} early"), -1.0),
        _ => (plain(kind), 1.0),
    }
}

/// Replaces underscores by spaces: "gyro_x" as "gyro x".
pub fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

#[cfg(test)]
mod tests {
    use rlg_model::catalogue::CATALOGUE;

    use super::*;

    #[test]
    fn every_named_kind_is_one_of_the_catalogue_and_no_two_sound_alike() {
        for (kind, _) in KINDS.iter().chain(DELAYS) {
            assert!(CATALOGUE.iter().any(|known| known.name == *kind), "{kind}");
        }
        let mut words: Vec<String> = CATALOGUE.iter().map(|kind| plain(kind.name)).collect();
        let count = words.len();
        words.sort();
        words.dedup();
        assert_eq!(words.len(), count);
    }

    #[test]
    fn a_delay_is_late_or_early_where_its_sizes_agree() {
        let at = |sizes: &[f64]| plain_at("reference_delay", sizes);
        assert_eq!(at(&[2e-3]), ("reference late".to_owned(), 1.0));
        assert_eq!(at(&[-2e-3]), ("reference early".to_owned(), -1.0));
        let mixed = plain_at("gyro_delay", &[-1e-3, 1e-3]);
        assert_eq!(mixed, ("gyro delay".to_owned(), 1.0));
        assert_eq!(plain_at("gyro_bias", &[-1e-3]).0, "gyro bias");
    }
}
