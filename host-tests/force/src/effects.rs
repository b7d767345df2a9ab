//! Accelerometer effects as entries of `diagnosis.json` and as effects of the updated model.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::accelerometers::{self, DELAY, DRIFT, Kind};
use rlg_findings::combinations::{Number, Written, identifiable, written};
use rlg_findings::entries::{are_equal, correlated, unlisted};
use rlg_findings::result::{EffectEntry, EvidenceEntry, ParameterEntry, UNLISTED};
use rlg_findings::updated_model::set_choice;
use rlg_inference::judgement::chance_in_noise;
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::accelerometer_rows::channel_name;
use rlg_signal::axes::AXES;

use crate::candidates::{Candidate, Variant};
use crate::diagnose::Diagnosed;

impl Diagnosed {
    /// Estimate of an error of the reference from the accelerometers, with its covariance.
    pub(crate) fn reference_error(&self, kind: &str) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let named = 0..self.confirmed.named.len();
        let place = named
            .into_iter()
            .find(|&place| self.candidate(place).kind == kind)?;
        let (_, values, covariance) = self.numbers(place);
        Some((DVector::from_vec(values), covariance))
    }

    /// Candidate of a named member.
    pub(crate) fn candidate(&self, place: usize) -> &Candidate {
        &self.found.candidates[self.confirmed.headlines[place]]
    }

    /// Place of a named member in the final fit.
    pub(crate) fn in_fit(&self, place: usize) -> usize {
        let headline = self.confirmed.headlines[place];
        let members = &self.confirmed.fit.members;
        members
            .iter()
            .position(|&other| other == headline)
            .expect("the final fit is of what is named")
    }

    pub(crate) fn equation(&self, place: usize) -> String {
        let one = self.candidate(place);
        match (one.variant, kind_of(one)) {
            (Variant::Expression(axis, column), _) => {
                format!("f_{} += c {}", AXES[axis], column.text())
            }
            (_, Some(kind)) => kind.equation.to_string(),
            (_, None) => String::new(),
        }
    }

    /// Names, rounded values and covariance of a named member; linear combinations that are not identifiable are set by
    /// choice.
    fn written(&self, place: usize) -> (Vec<String>, Written, DMatrix<f64>) {
        let (names, values, covariance) = self.numbers(place);
        let known = self.known(place, &names, &values);
        let combinations = &self.plan.findings.combinations;
        let written = written(&known, &identifiable(&known, &covariance, combinations));
        (names, written, covariance)
    }

    /// Values with their prior standard deviations.
    fn known(&self, place: usize, names: &[String], values: &[f64]) -> Vec<Number> {
        let one = self.candidate(place);
        let known = names.iter().zip(values).enumerate();
        let known = known.map(|(k, (name, value))| Number {
            prior_std: one.hypothesis.bound(k).std,
            ..Number::free(name, *value)
        });
        known.collect()
    }

    fn numbers(&self, place: usize) -> (Vec<String>, Vec<f64>, DMatrix<f64>) {
        let one = self.candidate(place);
        let fit = &self.confirmed.fit;
        let first = fit.blocks[self.in_fit(place)].start;
        let mut of: Vec<(String, usize)> = one
            .names
            .iter()
            .enumerate()
            .flat_map(|(parameter, names)| {
                names
                    .iter()
                    .map(move |name| (name.clone(), first + parameter))
            })
            .collect();
        of.sort();
        let values = of.iter().map(|(_, at)| fit.estimate[*at]).collect();
        let covariance = DMatrix::from_fn(of.len(), of.len(), |a, b| {
            fit.covariance[(of[a].1, of[b].1)]
        });
        (
            of.into_iter().map(|(name, _)| name).collect(),
            values,
            covariance,
        )
    }

    /// Kinds that are not distinguishable from a named member in this recording, drift included.
    pub(crate) fn alike(&self, place: usize) -> Vec<String> {
        let member = self.confirmed.named[place];
        let own = self.candidate(place).kind;
        let rivals = self.found.judged[member]
            .rivals
            .iter()
            .map(|(rival, _)| *rival);
        let all = rivals
            .chain(self.found.spanned_by[member].iter().copied())
            .chain([self.found.fit.members[member]]);
        let kinds: BTreeSet<&str> = all
            .map(|rival| self.found.candidates[rival].kind)
            .filter(|kind| *kind != own)
            .collect();
        kinds.into_iter().map(str::to_string).collect()
    }

    pub(crate) fn effect(&self, place: usize) -> EffectEntry {
        let one = self.candidate(place);
        let member = self.confirmed.named[place];
        let (judged, said) = (
            &self.found.judged[member],
            self.confirmed.confirmations[member],
        );
        let (names, Written { values, .. }, covariance) = self.written(place);
        let unit = kind_of(one).map_or("", |kind| kind.unit);
        let (mut parameters, rows) = correlated(&names, &values, &covariance, unit);
        let mut alike = self.alike(place);
        let mut what_was_left_out = self.left_out(place, &values, &covariance);
        if judged.cost_against_drift < self.plan.judgement.drift_within {
            alike.push(DRIFT.to_string());
            what_was_left_out.push_str(
                " Not distinguishable from accelerometer drift: a longer record, or a second cycle of its cause, would decide.",
            );
        }
        let mut expression = None;
        if let Variant::Expression(axis, column) = one.variant {
            parameters.push(ParameterEntry::text("axis", &channel_name(axis)));
            parameters.push(ParameterEntry::text("expression", &column.text()));
            expression = Some(column.text());
        } else if alike.iter().any(|kind| kind == UNLISTED) {
            expression = self.rival_expression(member);
        }
        let squared_size =
            2.0 * (self.found.fit.log_likelihood - self.found.without[member].log_likelihood);
        let known = self.known(place, &names, &values);
        EffectEntry {
            kind: one.kind.to_string(),
            equation: self.equation(place),
            parameters,
            covariance: rows,
            identifiable: identifiable(&known, &covariance, &self.plan.findings.combinations),
            log_evidence_gain: judged.cost_without,
            p_value: chance_in_noise(
                squared_size,
                self.found.fit.ranks[member],
                one.hypothesis.price,
            ),
            what_was_left_out,
            expression,
            evidence: Some(EvidenceEntry {
                label: if alike.is_empty() { "named" } else { "class" },
                confirmed_gain: said.gain,
                share: self.share(place),
                reenactments: 0,
                inflation: said.design_effect,
            }),
            indistinguishable_from: alike,
            ..unlisted(String::new(), String::new())
        }
    }

    /// Nearest expression that rivals a member.
    fn rival_expression(&self, member: usize) -> Option<String> {
        let rivals = self.found.judged[member].rivals.iter();
        let own = self.found.fit.members[member];
        let all = [own].into_iter().chain(rivals.map(|(rival, _)| *rival));
        let mut variants = all.map(|rival| self.found.candidates[rival].variant);
        variants.find_map(|variant| match variant {
            Variant::Expression(_, column) => Some(column.text()),
            _ => None,
        })
    }

    /// Share of the residual's power explained by a named member given the others, on the fitted rows.
    fn share(&self, place: usize) -> f64 {
        let fit = &self.confirmed.fit;
        let effect = self
            .found
            .effect_m_s(&self.made_of, fit, self.in_fit(place));
        let left = self.found.left_m_s(&self.made_of, fit);
        let (mut explained, mut power) = (0.0, 0.0);
        for row in self.fitted.iter().cloned().flatten() {
            for axis in 0..3 {
                let (effect, left) = (effect[axis][row], left[axis][row]);
                explained += effect * (effect + 2.0 * left);
                power += self.found.residual_m_s[axis][row].powi(2);
            }
        }
        (explained / power.max(f64::MIN_POSITIVE)).max(0.0)
    }

    /// Meaning of a kind, and the alternative cause where three equal values have one that no accelerometer shows.
    fn left_out(&self, place: usize, values: &[f64], covariance: &DMatrix<f64>) -> String {
        let one = self.candidate(place);
        let Some(kind) = kind_of(one) else {
            let Variant::Expression(axis, column) = one.variant else {
                return String::new();
            };
            return format!(
                "Accelerometer {} follows {}, outside the catalogue: an expression in measured channels, found by search.",
                AXES[axis],
                column.text()
            );
        };
        let is_equal = are_equal(values, covariance, self.plan.findings.equal_deviations);
        let also = match kind.kind {
            "accel_scale" if is_equal => {
                " All three are equal within their σ: confounded with local g."
            }
            DELAY if is_equal => {
                " All three are equal within their σ: confounded with a reference and gyros that are early by the same time."
            }
            _ => "",
        };
        format!("{}{also}", kind.meaning)
    }

    pub(crate) fn effect_of(&self, place: usize) -> ModelEffect {
        let (names, Written { values, choice }, _) = self.written(place);
        let numbers = names
            .into_iter()
            .zip(values.into_iter().map(EffectValue::Number));
        let mut effect = ModelEffect {
            kind: self.candidate(place).kind.to_string(),
            parameters: numbers.collect(),
        };
        set_choice(&mut effect, choice);
        effect
    }
}

/// Kind of a candidate; `None` for expressions.
pub(crate) fn kind_of(one: &Candidate) -> Option<&'static Kind> {
    accelerometers::find(one.kind)
}
