//! The findings of a unit at rest, in the words of the contract and of people.
//!
//! Enters: [`Findings`] of several records, or of a model that the new engine cannot predict. Leaves: entries; sentences for the terminal.

use strapdown::earth::ROTATION_RAD_S;

use super::entries::unlisted;
use super::explain::{DEG_H, Findings};
use super::result::EffectEntry;
use super::still::AtRest;
use super::streams::AXES;

impl Findings<'_> {
    /// A constant rate at rest has many names.
    pub(super) fn confused_at_rest(&self, mut entry: EffectEntry) -> EffectEntry {
        if entry.kind == "gyro_bias" {
            for kind in ["earth_rate", "gyro_scale", "gyro_g_bias", "installation"] {
                if !entry
                    .indistinguishable_from
                    .iter()
                    .any(|known| known == kind)
                {
                    entry.indistinguishable_from.push(kind.to_string());
                }
            }
            entry.what_was_left_out = "The mean rates are not the Earth's at this site: a bias, a wrong scale or pulse weight, or another site; at rest in one attitude these look the same.".to_string();
        }
        entry
    }

    /// What is left on each gyro, as one entry: at rest its places have no motion to tell them apart.
    pub(super) fn unexplained_at_rest(&self) -> Vec<EffectEntry> {
        (0..3)
            .filter_map(|axis| {
                let here: Vec<_> = self.left.iter().filter(|place| place.axis == axis).collect();
                let first = here.first()?;
                let low_hz = here.iter().map(|p| p.band_hz.0).fold(f64::INFINITY, f64::min);
                let high_hz = here.iter().map(|p| p.band_hz.1).fold(0.0, f64::max);
                let end = here.iter().map(|place| place.rows.end).max()?;
                Some(EffectEntry {
                    p_value: here.iter().map(|place| place.p_value).fold(1.0, f64::min),
                    ..unlisted(
                        String::new(),
                        format!(
                            "Gyro {} shows more than its noise in {} places between {:.1} and {:.1} s, {low_hz:.0} to {high_hz:.0} Hz, and nothing measured explains it: located only.",
                            AXES[axis],
                            here.len(),
                            self.scene.streams.begin_s(first.rows.start),
                            self.scene.streams.begin_s(end),
                        ),
                    )
                })
            })
            .collect()
    }

    /// The Earth, the control and the held-out power in sentences.
    pub(super) fn still_summary(&self, rest: &AtRest) -> Vec<String> {
        let lines = vec![match &rest.up {
            Some(up) => format!(
                "At rest: the mean rate is {:.3} °/h, {:.4} of the Earth's; its vertical part {:.4} of what latitude {:.4}° gives. The mean force is {:.5} of the site's gravity. The azimuth was fitted.",
                rest.mean_rad_s.norm() * DEG_H,
                rest.mean_rad_s.norm() / ROTATION_RAD_S,
                rest.mean_rad_s.dot(up) / (ROTATION_RAD_S * rest.latitude_rad.sin()),
                rest.latitude_rad.to_degrees(),
                rest.force_over_gravity.unwrap_or(f64::NAN),
            ),
            None => format!(
                "At rest: the mean rate is {:.3} °/h, {:.4} of the Earth's; without accelerometers its direction was fitted.",
                rest.mean_rad_s.norm() * DEG_H,
                rest.mean_rad_s.norm() / ROTATION_RAD_S,
            ),
        }];
        lines
    }
}
