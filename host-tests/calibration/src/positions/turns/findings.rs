//! Findings on the gyros of a tumbled unit, in the terms of `diagnosis.json`, added to those on its accelerometers.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector3};
use rlg_diagnosis::Outcome;
use rlg_findings::entries::{correlated, unlisted};
use rlg_findings::numbers::{ARCSEC_PER_RAD, DEG_H};
use rlg_findings::result::{
    EffectEntry, Identifiable, NoiseEntry, ParameterEntry, UNLISTED, Verdict,
};
use rlg_findings::sentences::effect_lines;
use rlg_findings::updated_model::switch_on;
use rlg_model::{EffectValue, ModelEffect};
use rlg_plan::Plan;
use rlg_recording::Recording;
use rlg_signal::axes::AXES;
use rlg_signal::still::ROTATION_RAD_S;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::super::diagnose::Diagnosed;
use super::super::few_positions::three_sigma_factor;
use super::fit::{Fitted, Known, fit};
use super::prediction::{KINDS, OWN, Sizes, is_predicted, of_model, places};
use super::readings::Gyros;
use crate::unknowns::{entry, names};

/// Gyros of a tumbled unit, fitted.
pub struct Turned {
    gyros: Gyros,
    fitted: Fitted,
    start: Sizes,
    prior: Sizes,
    plan: Plan,
}

impl Diagnosed {
    /// Fits the gyros of a recording whose accelerometers are diagnosed.
    ///
    /// # Errors
    /// The reason why the gyros are not compared.
    pub(in crate::positions) fn turned(&self, recording: &Recording) -> Result<Turned, String> {
        let (plan, model) = (&self.plan, &self.model);
        if let Some(other) = model.effects.iter().find(|effect| !is_predicted(effect)) {
            return Err(format!(
                "the model holds {}, which only a reference shows",
                other.kind
            ));
        }
        let positions = (&self.rows, self.positions.as_slice());
        let gyros = Gyros::new(recording, model, positions, plan)?;
        if gyros.turns.is_empty() {
            return Err("in every turn rows are not measured, or faulty".to_string());
        }
        let (up, direction_rad2) = directions(self);
        let mut prior = Sizes::zeros();
        for kind in KINDS {
            places(kind).for_each(|at| prior[at] = entry(kind).size.largest);
        }
        // The Earth's rotation: without a site of any direction, else with its part along the vertical.
        let mut start = of_model(&model.effects);
        let spread = match recording.site {
            Some(site) => {
                let vertical = ROTATION_RAD_S * site.latitude_rad.sin() * up[0];
                (0..3).for_each(|axis| start[OWN + axis] = vertical[axis]);
                site.latitude_rad.cos() / 2.0_f64.sqrt()
            }
            None => 1.0 / 3.0_f64.sqrt(),
        };
        (OWN..OWN + 3).for_each(|at| prior[at] = ROTATION_RAD_S * spread);
        let known = Known {
            up: &up,
            direction_rad2: &direction_rad2,
            start,
            prior,
            scatter_known: plan.positions.scatter_known,
        };
        let fitted = fit(&gyros, &known).ok_or("rests and turns have no least squares")?;
        Ok(Turned {
            gyros,
            fitted,
            start,
            prior,
            plan: *plan,
        })
    }
}

/// Directions of the corrected force, and the variance of each across it \[rad²\].
fn directions(diagnosed: &Diagnosed) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let observed = &diagnosed.observed;
    let errors = observed.known.plus(&diagnosed.found.named_errors);
    let [gravity, _] = observed.gravity_m_s2;
    let levels = diagnosed.found.named_fit.levels[0];
    let between = diagnosed.found.lengths.unit_m_s2.powi(2) * levels.angle;
    let read = observed.readings.mean_m_s2.iter();
    let up = read.map(|read| errors.undone_m_s2(read, observed.scale_error).normalize());
    let variance = observed.readings.variance_m2_s4.iter();
    let variance = variance.map(|one| (one.sum() / 3.0 + between) / gravity.powi(2));
    (up.collect(), variance.collect())
}

impl Turned {
    /// Adds the findings to those on the accelerometers.
    pub fn add_to(&self, outcome: &mut Outcome) {
        let effects: Vec<EffectEntry> = KINDS.iter().filter_map(|kind| self.effect(kind)).collect();
        for effect in &effects {
            let numbers = effect.parameters.iter().filter_map(|one| match one {
                ParameterEntry::Number { name, value, .. } => {
                    Some((name.clone(), EffectValue::Number(*value)))
                }
                ParameterEntry::Text { .. } => None,
            });
            let parameters: BTreeMap<_, _> = numbers.collect();
            let kind = effect.kind.clone();
            switch_on(&mut outcome.model, ModelEffect { kind, parameters });
        }
        let diagnosis = &mut outcome.diagnosis;
        let is_left = self.is_scatter_incredible();
        let lines = self.sentences(&effects, is_left);
        let is_consistent = diagnosis.verdict.is_consistent() && !is_left;
        diagnosis.effects.extend(effects);
        let is_listed = |one: &EffectEntry| one.kind != UNLISTED;
        let is_found = diagnosis.effects.iter().any(is_listed);
        diagnosis.conclude(Verdict::of(is_found, is_consistent));
        diagnosis.summary.extend(lines);
        diagnosis.noise = AXES
            .iter()
            .zip(self.gyros.walk_rad_sqrt_s.iter())
            .map(|(axis, walk)| NoiseEntry {
                channel: format!("gyro_{axis}"),
                angle_random_walk_rad_sqrt_s: *walk,
                angle_noise_rad: 0.0,
                wandering_rad_s: None,
                terms: None,
            })
            .collect();
        diagnosis
            .not_excluded
            .extend(self.not_excluded(&diagnosis.effects));
    }

    /// Difference from the model, and covariance, of a kind's parameters.
    fn sizes(&self, kind: &str) -> (DVector<f64>, DMatrix<f64>) {
        let own = places(kind);
        let off = self.fitted.sizes - self.start;
        let block = self
            .fitted
            .covariance
            .view((own.start, own.start), (own.len(), own.len()));
        (off.as_slice()[own].to_vec().into(), block.into_owned())
    }

    /// Degrees of freedom of the scatter that a kind is judged by: biases by the rests, all else by the turns.
    fn freedom(&self, kind: &str) -> f64 {
        self.fitted.freedom[usize::from(kind != KINDS[0])]
    }

    /// Gain of ln evidence by a kind: the ratio of posterior and prior density at the model's sizes (Savage and Dickey, with
    /// Student's t for the posterior), and the p-value of Fisher's F, both for three kinds tried.
    fn evidence(&self, kind: &str) -> Option<(f64, f64)> {
        let (off, covariance) = self.sizes(kind);
        let (count, freedom) = (off.len() as f64, self.freedom(kind));
        let cholesky = covariance.cholesky()?;
        let squares = off.dot(&cholesky.solve(&off));
        let volume: f64 = cholesky.l().diagonal().iter().map(|one| one.ln()).sum();
        let prior: f64 = places(kind).map(|at| self.prior[at].ln()).sum();
        let tried = KINDS.len() as f64;
        let gain = 0.5 * (freedom + count) * (squares / freedom).ln_1p() + volume - prior;
        let tail = FisherSnedecor::new(count, freedom).map_or(1.0, |law| law.sf(squares / count));
        Some((gain - tried.ln(), (tried * tail).min(1.0)))
    }

    /// Entry of a kind beyond the threshold of a name.
    fn effect(&self, kind: &str) -> Option<EffectEntry> {
        let entry = entry(kind);
        let (gain, p_value) = self.evidence(kind)?;
        // Evidence from turns that noise does not explain rests on a wrong law.
        let judgement = &self.plan.judgement;
        let is_sound = kind == KINDS[0] || !self.is_scatter_incredible();
        if gain <= judgement.naming || !(is_sound || p_value < judgement.unexplained) {
            return None;
        }
        let (off, covariance) = self.sizes(kind);
        let covariance = covariance * three_sigma_factor(self.freedom(kind)).powi(2);
        let std = |at: usize| covariance[(at, at)].max(0.0).sqrt();
        let names = names(kind);
        let each = names.iter().zip(off.iter()).enumerate();
        let (parameters, rows) = correlated(names, off.as_slice(), &covariance, entry.unit);
        let also = match kind {
            "installation" => {
                " The axes are those of the accelerometers: how both triads as one are turned against the case, gravity does not tell."
            }
            _ => "",
        };
        Some(EffectEntry {
            kind: kind.to_string(),
            equation: entry.equation.to_string(),
            parameters,
            covariance: rows,
            identifiable: each
                .map(|(at, (name, value))| Identifiable {
                    combination: std::iter::once(((*name).to_string(), 1.0)).collect(),
                    value: *value,
                    std: std(at),
                })
                .collect(),
            log_evidence_gain: gain,
            p_value,
            what_was_left_out: format!("{}{also}", entry.meaning),
            ..unlisted(String::new(), String::new())
        })
    }

    /// True if turns scatter by more than the rows and the accelerometers let expect.
    fn is_scatter_incredible(&self) -> bool {
        let [squares, freedom] = self.fitted.turns_known;
        let chance = ChiSquared::new(freedom).map_or(1.0, |law| law.sf(squares));
        chance < self.plan.judgement.unexplained
    }

    fn sentences(&self, effects: &[EffectEntry], is_left: bool) -> Vec<String> {
        let lengths_s = || {
            self.gyros
                .turns
                .iter()
                .map(|turn| turn.span_s[1] - turn.span_s[0])
        };
        let mut lines = vec![format!(
            "Turns: over {} of them, {:.1} to {:.1} s each, the gyros carry the direction of gravity from one position to the next.",
            self.gyros.turns.len(),
            lengths_s().fold(f64::INFINITY, f64::min),
            lengths_s().fold(0.0, f64::max),
        )];
        for [from_s, to_s] in &self.gyros.lost_s {
            lines.push(format!(
                "Left out: the turn between {from_s:.1} and {to_s:.1} s, in which rows are not measured, or faulty."
            ));
        }
        lines.extend(
            effects
                .iter()
                .flat_map(|one| effect_lines(one, &self.plan.findings)),
        );
        let walk = self.gyros.walk_rad_sqrt_s.map(|one| one * DEG_H / 60.0);
        let [rests, turns] = self.fitted.scatter;
        lines.push(format!(
            "Noise of the gyros at rest: N x {:.3e}, y {:.3e}, z {:.3e} °/√h; their means scatter between positions by {:.2e} °/h besides, turns by {:.1}″ besides (one standard deviation).",
            walk.x, walk.y, walk.z, rests * DEG_H, turns * ARCSEC_PER_RAD
        ));
        if is_left {
            let turns = self.gyros.turns.iter().zip(&self.fitted.turns_rad);
            let worst = turns.max_by(|a, b| a.1.total_cmp(b.1));
            let at = worst.map_or(String::new(), |(turn, left)| {
                let [from_s, to_s] = turn.span_s;
                format!(
                    ": most between {from_s:.1} and {to_s:.1} s, {:.0}″",
                    left * ARCSEC_PER_RAD
                )
            });
            lines.push(format!(
                "Left: the gyros miss the direction of gravity behind the turns by more than the noise of gyros and accelerometers{at}."
            ));
        }
        lines
    }

    /// Kinds that would not show at their typical size, and all that rests and turns never show.
    fn not_excluded(&self, effects: &[EffectEntry]) -> Vec<String> {
        let mut all = Vec::new();
        for kind in KINDS {
            if effects.iter().any(|effect| effect.kind == kind) {
                continue;
            }
            let (entry, (_, covariance)) = (entry(kind), self.sizes(kind));
            let snr = |at: usize| {
                entry.size.typical
                    / covariance[(at, at)].sqrt()
                    / three_sigma_factor(self.freedom(kind))
            };
            let names = names(kind);
            let small = names
                .iter()
                .enumerate()
                .filter(|(at, _)| snr(*at) < self.plan.findings.needed_snr);
            let small: Vec<String> = small
                .map(|(at, name)| format!("{name} at an SNR of {:.1}", snr(at)))
                .collect();
            if !small.is_empty() {
                all.push(format!(
                    "{kind}: of typical size ({:.0e} {}) these rests and turns would show {}",
                    entry.size.typical,
                    entry.unit,
                    small.join(", ")
                ));
            }
        }
        all.push("every other kind of the gyros: rests and turns by hand show bias, scale and misalignment alone".to_string());
        all
    }
}
