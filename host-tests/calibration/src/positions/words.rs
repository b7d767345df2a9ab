//! Sentences on the findings of still positions, and on the effects that they cannot show.

use nalgebra::DMatrix;
use rlg_catalogue::accelerometers::{KINDS, Kind};
use rlg_findings::entries::are_equal;
use rlg_findings::result::{ChannelEntry, EffectEntry, UNLISTED, Verdict};
use rlg_findings::sentences::{combination, effect_lines, opening};
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_recording::units::MICRO_G_PER_M_S2 as MICRO_G;
use rlg_signal::axes::AXES;

use super::candidates::{Column, names, shows};
use super::diagnose::Diagnosed;
use super::too_few::next_experiment;

/// Reason why some kinds are not observable.
const STILL: &str = "needs motion; the unit was at rest wherever it was compared with gravity";

impl Diagnosed {
    /// Meaning of a finding, and the ambiguities that remain with gravity alone.
    pub(super) fn left_out(
        &self,
        place: usize,
        values: &[f64],
        covariance: &DMatrix<f64>,
    ) -> String {
        let one = self.candidate(place);
        let Some(kind) = one.row() else {
            return match (one.position(), one.columns[0].expression()) {
                (Some(own), _) => self.off(own, self.sizes(place)[0]),
                (None, Some((axis, text))) => format!(
                    "Accelerometer {} follows {text}, outside the catalogue: an expression found by search.",
                    AXES[axis]
                ),
                (None, None) => String::new(),
            };
        };
        let is_equal = are_equal(values, covariance, self.plan.findings.equal_deviations);
        let also = match kind.kind {
            "accel_scale" if is_equal => {
                " All three are equal within their σ: confounded with local g."
            }
            "accel_misalignment" => {
                " The magnitude of gravity determines the angles between the sensing axes, each a difference of two tilts; their common rotation against the case is not identifiable, and the model splits each difference equally."
            }
            _ => "",
        };
        format!("{}{also}", kind.meaning)
    }

    /// Sentence for one position that does not fit the others; `own` counts the fitted ones.
    fn off(&self, own: usize, size_m_s2: f64) -> String {
        let [from_s, to_s] = self.span_s(self.fitted[own]);
        format!(
            "The position between {from_s:.1} and {to_s:.1} s deviates by {:+.1} µg from all others, unlike any error of the catalogue: the unit was touched, shaken, or set down differently.",
            size_m_s2 * MICRO_G
        )
    }

    /// Standard deviation of each parameter of a kind, fitted alone with the estimated noise \[its unit\].
    fn stds(&self, kind: &Kind) -> Vec<(Column, f64)> {
        let found = &self.found;
        let whole = found.candidates.iter().find(|one| one.kind == kind.kind);
        let Some(one) = whole else {
            return Vec::new();
        };
        let fit = &found.named_fit;
        let alone = evaluate(
            &found.lengths,
            &[&one.hypothesis],
            &fit.levels,
            &fit.drift,
            Effort::QUICK,
            &self.plan.inference.search,
        );
        let std = |at: usize| alone.covariance[(at, at)].max(0.0).sqrt();
        let each = one.columns.iter().enumerate();
        each.map(|(at, column)| (*column, std(at))).collect()
    }

    pub(super) fn not_excluded(&self) -> Vec<String> {
        let mut all = Vec::new();
        let is_found = |kind: &Kind| {
            (0..self.found.named.len()).any(|place| self.candidate(place).kind == kind.kind)
        };
        for kind in KINDS {
            if self.left_out.iter().any(|out| out == kind.kind) {
                all.push(format!("{}: not tried", kind.kind));
            } else if !shows(kind) {
                all.push(format!("{}: {STILL}", kind.kind));
            } else if !is_found(kind) {
                all.extend(self.too_small(kind));
            }
        }
        all.push("accel_misalignment of the three accelerometers as one against the case: it changes no length of gravity".to_string());
        all
    }

    /// Parameters of a kind that would not show at its typical size.
    fn too_small(&self, kind: &Kind) -> Option<String> {
        let snr = |std: f64| kind.typical / std.max(f64::MIN_POSITIVE);
        let stds = self.stds(kind);
        let small: Vec<String> = stds
            .iter()
            .filter(|(_, std)| snr(*std) < self.plan.findings.needed_snr)
            .map(|(column, std)| {
                let signs = names(*column).into_iter().collect();
                format!("{} at an SNR of {:.1}", combination(&signs), snr(*std))
            })
            .collect();
        (!small.is_empty()).then(|| {
            format!(
                "{}: at its typical size ({:.0e} {}) here {}",
                kind.kind,
                kind.typical,
                kind.unit,
                small.join(", ")
            )
        })
    }

    pub(super) fn next_experiment(&self) -> String {
        let confused = (0..self.found.named.len())
            .find(|&place| !self.alike(place).is_empty() && self.candidate(place).kind != UNLISTED);
        let kind = confused.and_then(|place| self.candidate(place).row());
        let next = next_experiment(&self.plan.positions);
        match kind {
            Some(kind) => format!("{next} {}", kind.experiment),
            None => next,
        }
    }

    pub(super) fn summary(
        &self,
        verdict: Verdict,
        effects: &[EffectEntry],
        channel: Option<&ChannelEntry>,
    ) -> Vec<String> {
        let mut lines = vec![opening(verdict).to_string()];
        let lengths_s = self
            .positions
            .iter()
            .map(|one| one.rows.len() as f64 / self.rows.rate_hz);
        let [shortest_s, longest_s, all_s] = lengths_s
            .fold([f64::INFINITY, 0.0, 0.0], |[least, most, sum], one: f64| {
                [least.min(one), most.max(one), sum + one]
            });
        lines.push(format!(
            "Still positions: {} in {} attitudes, {shortest_s:.1} to {longest_s:.1} s each; {:.1} s between them are left out.",
            self.positions.len(),
            self.attitudes,
            self.rows.count as f64 / self.rows.rate_hz - all_s
        ));
        for one in &self.restless {
            let [from_s, to_s] = self.span_of_rows_s(one);
            lines.push(format!(
                "Left out: between {from_s:.1} and {to_s:.1} s the unit was held, but not still."
            ));
        }
        lines.push(match self.observed.gravity_m_s2 {
            [gravity, 0.0] => format!("Compared with the site's gravity, {gravity:.6} m/s²."),
            [gravity, std] => format!(
                "Compared with standard gravity, {gravity:.5} ± {std:.2} m/s²: a [site] with its gravity would determine a common scale error better than to {:.1} per mille.",
                1e3 * std / gravity
            ),
        });
        lines.extend(
            effects
                .iter()
                .flat_map(|one| effect_lines(one, &self.plan.findings)),
        );
        let (levels, unit) = (self.found.named_fit.levels[0], self.found.lengths.unit_m_s2);
        lines.push(format!(
            "Noise: {:.2} µg of a position's mean from its rows, {:.2} µg between positions (1 σ).",
            unit * levels.white.sqrt() * MICRO_G,
            unit * levels.angle.sqrt() * MICRO_G
        ));
        if self.is_scatter_incredible() {
            lines.push("Not explained: the scatter between positions is far above that within them; more positions would show its cause.".to_string());
        }
        if let Some(channel) = channel {
            let [before, after] = [&channel.held_out_before, &channel.held_out_after];
            lines.push(format!(
                "Held out: on {} positions the squared difference from gravity falls from {:.3e} to {:.2} of the noise's prediction.",
                self.tested.len(),
                before.normalised_power,
                after.normalised_power
            ));
        } else {
            lines.push(format!(
                "No position is held out: of fewer than {} all are needed.",
                self.plan.positions.least_to_hold_out
            ));
        }
        lines
    }
}
