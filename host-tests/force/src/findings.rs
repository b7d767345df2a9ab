//! Accelerometer findings in the terms of `diagnosis.json`, together with those of the gyros. µg in text.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rlg_diagnosis::locate::{self, Location};
use rlg_diagnosis::noise_levels::reported;
use rlg_diagnosis::noise_spectrum::Noise;
use rlg_diagnosis::self_test::{FoundSet, Reach, Row, self_test_on, tell_also};
use rlg_diagnosis::validate::{Validation, drift_chance, validate};
use rlg_diagnosis::{Outcome, entries_of_rows};
use rlg_findings::combinations::{Number, Written, identifiable, written};
use rlg_findings::entries::unlisted;
use rlg_findings::result::{
    ChannelEntry, EffectEntry, EvidenceEntry, ForceNoiseEntry, LocationEntry, ParameterEntry,
    RunnerUp, Tested, UNLISTED, Verdict,
};
use rlg_findings::sentences::{NEEDED_SNR, effect_lines, opening};
use rlg_findings::updated_model::{say_choice, switch_on};
use rlg_inference::{Columns, Drift};
use rlg_model::{EffectValue, ModelEffect};
use rlg_plan::ForcePlan;
use rlg_signal::axes::{AXES, Triad, add};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::candidates::{Candidate, Variant};
use crate::diagnose::Diagnosed;
use crate::kinds::{self, DELAY, KINDS, Kind};
use crate::prediction::channel_name;
use crate::search::{Found, of_verticals};

/// m/s² to millionths of standard gravity.
pub(crate) const MICRO_G: f64 = 1e6 / rlg_recording::units::STANDARD_GRAVITY_M_S2;

/// Entry of an equivalence class for accelerometer drift (IEEE 1293).
pub(crate) const DRIFT: &str = "acceleration_random_walk";

/// States why no accelerometer effect was searched for.
pub fn say_why_not(reason: &str, outcome: &mut Outcome) {
    let kinds = KINDS.iter().map(|kind| format!("{}: {reason}", kind.kind));
    outcome.diagnosis.not_excluded.extend(kinds);
}

/// Locations and figures of a diagnosis.
struct Shown {
    noise: [Noise; 3],
    locations: Vec<Location>,
    left: Vec<Location>,
    validations: Vec<Validation>,
}

/// True if the values of three accelerometers are equal within their uncertainty.
pub(crate) fn are_equal(values: &[f64], covariance: &DMatrix<f64>, plan: &ForcePlan) -> bool {
    values.len() == 3
        && (0..3).all(|a| {
            let b = (a + 1) % 3;
            let variance = covariance[(a, a)] + covariance[(b, b)] - 2.0 * covariance[(a, b)];
            (values[a] - values[b]).abs() <= plan.same_deviations * variance.max(0.0).sqrt()
        })
}

impl Diagnosed {
    /// Adds the accelerometer findings to the gyros' outcome.
    pub fn add_to(&self, outcome: &mut Outcome) {
        let shown = self.shown();
        let mut effects: Vec<EffectEntry> = (0..self.confirmed.named.len())
            .map(|place| self.effect(place))
            .collect();
        let is_found = effects.iter().any(|one| one.kind != UNLISTED);
        let followed = effects.iter().any(|one| one.kind == UNLISTED);
        effects.extend(shown.left.iter().map(|location| self.unexplained(location)));
        let is_clean = !followed && shown.left.is_empty() && self.confirmed.unconfirmed.is_empty();
        let diagnosis = &mut outcome.diagnosis;
        let verdict = joined(diagnosis.verdict, is_found, is_clean);
        if diagnosis.verdict != verdict {
            diagnosis.verdict = verdict;
            if let Some(first) = diagnosis.summary.first_mut() {
                *first = opening(verdict).to_string();
            }
        }
        diagnosis.summary.extend(self.sentences(&shown, &effects));
        let locations = shown.locations.iter();
        diagnosis
            .locations
            .extend(locations.map(|one| self.location(one)));
        diagnosis.effects.extend(effects);
        let validations = shown.validations.iter();
        diagnosis
            .fit
            .channels
            .extend(validations.map(|validation| ChannelEntry {
                channel: channel_name(validation.axis),
                unit: Some("m/s^2"),
                ..entries_of_rows::channel(validation)
            }));
        let rate_hz = self.streams.rate_hz;
        let noise = |axis: usize| ForceNoiseEntry {
            channel: channel_name(axis),
            noise_m_s2_sqrt_hz: (2.0 * rate_hz * shown.noise[axis].theta[0]).sqrt(),
            velocity_noise_m_s: shown.noise[axis].theta[1].sqrt(),
            terms: None,
        };
        diagnosis.accelerometer_noise = (0..3).map(noise).collect();
        diagnosis.trials += self.found.tried;
        diagnosis.runners_up.extend(self.runners_up());
        diagnosis.not_excluded.extend(self.not_excluded());
        let tested = self.self_test(diagnosis.seed);
        tell_also(diagnosis, tested);
        let confused = (0..self.confirmed.named.len())
            .find(|&place| !self.alike(place).is_empty() && self.candidate(place).kind != UNLISTED);
        if let Some(kind) = confused.and_then(|place| kind_of(self.candidate(place))) {
            diagnosis.next_experiment =
                format!("{} {}", diagnosis.next_experiment, kind.experiment);
        }
        for place in 0..self.confirmed.named.len() {
            if self.candidate(place).kind != UNLISTED {
                switch_on(&mut outcome.model, self.effect_of(place));
            }
        }
    }

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
    fn candidate(&self, place: usize) -> &Candidate {
        &self.found.candidates[self.confirmed.headlines[place]]
    }

    /// Place of a named member in the final fit.
    fn in_fit(&self, place: usize) -> usize {
        let headline = self.confirmed.headlines[place];
        let members = &self.confirmed.fit.members;
        members
            .iter()
            .position(|&other| other == headline)
            .expect("the final fit is of what is named")
    }

    fn shown(&self) -> Shown {
        let (made_of, fit) = (&self.made_of, &self.confirmed.fit);
        let after = self.found.left_m_s(made_of, fit);
        let mut before: Triad = after.clone();
        for member in 0..fit.members.len() {
            let effect = self.found.effect_m_s(made_of, fit, member);
            for (before, effect) in before.iter_mut().zip(&effect) {
                add(before, effect, 1.0);
            }
        }
        let rows = self.streams.rows;
        let noise: [Noise; 3] =
            [0, 1, 2].map(|axis: usize| reported(fit.levels[axis], rows, self.streams.rate_hz));
        let all_rows: Vec<_> = self.fitted.iter().chain(&self.tested).cloned().collect();
        let judgement = &self.plan.judgement;
        let of = |residual: &Triad, rows: &[std::ops::Range<usize>]| {
            let plan = &judgement.tiles;
            let tiles = locate::tiles(&self.streams, residual, &noise, &self.regimes, rows, plan);
            locate::join(&tiles, &self.regimes, rows, plan)
        };
        let mut locations = of(&before, &all_rows);
        for location in &mut locations {
            let axis = location.axis;
            let acts = |place: &usize| {
                let mut terms = self.candidate(*place).hypothesis.terms.iter();
                terms.any(|term| term.record == axis)
            };
            let size = |place: usize| fit.squared_sizes[self.in_fit(place)];
            let strongest = (0..self.confirmed.named.len())
                .filter(acts)
                .max_by(|&a, &b| size(a).total_cmp(&size(b)));
            if let Some(place) = strongest {
                location.regime = format!("follows {}", self.equation(place));
            }
        }
        let mut validations = validate(
            &before,
            &after,
            &noise,
            (&self.tested, [0.0, f64::INFINITY]),
            &locations,
            self.streams.rate_hz,
            &judgement.held_out,
        );
        for one in &mut validations {
            let variance = self.vertical_variance(one.axis);
            for figures in [&mut one.before, &mut one.after] {
                figures.drift_std_rad_s = figures.drift_std_rad_s.hypot(variance.sqrt());
            }
        }
        Shown {
            validations,
            // Held-out rows change no finding.
            left: of(&after, &self.fitted),
            locations,
            noise,
        }
    }

    /// Variance \[m²/s⁴\] of an accelerometer's mean over the held-out rows, from the uncertainty of the vertical.
    fn vertical_variance(&self, axis: usize) -> f64 {
        let fit = &self.confirmed.fit;
        let columns = self.made_of.vertical_columns(&self.found.recordings);
        let rows: usize = self.tested.iter().map(std::ops::Range::len).sum();
        let mean = |place: usize| {
            let column = columns.column(place);
            let tested = self.tested.iter().flat_map(|rows| &column[rows.clone()]);
            tested.sum::<f64>() / rows.max(1) as f64 * self.streams.rate_hz
        };
        let own = (axis..columns.count()).step_by(3);
        let means: Vec<(usize, f64)> = of_verticals(fit).zip(own.map(mean)).collect();
        let products = means.iter().flat_map(|(a, x)| {
            let with = means.iter();
            with.map(move |(b, y)| x * y * fit.covariance[(*a, *b)])
        });
        products.sum::<f64>().max(0.0)
    }

    fn equation(&self, place: usize) -> String {
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
    fn alike(&self, place: usize) -> Vec<String> {
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

    fn effect(&self, place: usize) -> EffectEntry {
        let one = self.candidate(place);
        let member = self.confirmed.named[place];
        let (judged, said) = (
            &self.found.judged[member],
            self.confirmed.confirmations[member],
        );
        let (names, Written { values, .. }, covariance) = self.written(place);
        let unit = kind_of(one).map_or("", |kind| kind.unit);
        let mut parameters: Vec<ParameterEntry> = names
            .iter()
            .enumerate()
            .map(|(k, name)| ParameterEntry::Number {
                name: name.clone(),
                value: values[k],
                std: covariance[(k, k)].max(0.0).sqrt(),
                unit: unit.to_string(),
            })
            .collect();
        let mut alike = self.alike(place);
        let mut what_was_left_out = self.left_out(place, &values, &covariance);
        if judged.cost_against_drift < self.plan.judgement.drift_within {
            alike.push(DRIFT.to_string());
            what_was_left_out.push_str(
                " A drifting accelerometer explains it as well: a longer record, or a second cycle of what drives it, would decide.",
            );
        }
        let mut expression = None;
        if let Variant::Expression(axis, column) = one.variant {
            let text = |name: &str, value: &str| ParameterEntry::Text {
                name: name.to_string(),
                value: value.to_string(),
            };
            parameters.push(text("axis", &channel_name(axis)));
            parameters.push(text("expression", &column.text()));
            expression = Some(column.text());
        } else if alike.iter().any(|kind| kind == UNLISTED) {
            expression = self.rival_expression(member);
        }
        let ratio = 2.0
            * (self.found.fit.log_likelihood - self.found.without[member].log_likelihood).max(0.0);
        let rank = self.found.fit.ranks[member].max(1) as f64;
        let known = self.known(place, &names, &values);
        let tail = ChiSquared::new(rank).map_or(1.0, |law| law.sf(ratio));
        EffectEntry {
            kind: one.kind.to_string(),
            equation: self.equation(place),
            parameters,
            covariance: (0..values.len())
                .map(|a| (0..values.len()).map(|b| covariance[(a, b)]).collect())
                .collect(),
            identifiable: identifiable(&known, &covariance, &self.plan.findings.combinations),
            log_evidence_gain: judged.cost_without,
            p_value: (tail * one.hypothesis.price.exp().max(1.0)).min(1.0),
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
                "Accelerometer {} follows {}, which is no effect of the catalogue: an expression in measured channels, found by search.",
                AXES[axis],
                column.text()
            );
        };
        let is_equal = are_equal(values, covariance, &self.plan.force);
        let also = match kind.kind {
            "accel_scale" if is_equal => {
                " All three are the same within their spread: a wrong gravity of the site would look like this too."
            }
            DELAY if is_equal => {
                " All three are the same within their spread: a reference that is early, with gyros as early, would look like this too."
            }
            _ => "",
        };
        format!("{}{also}", kind.meaning)
    }

    fn effect_of(&self, place: usize) -> ModelEffect {
        let (names, Written { values, choice }, _) = self.written(place);
        let numbers = names
            .into_iter()
            .zip(values.into_iter().map(EffectValue::Number));
        let mut effect = ModelEffect {
            kind: self.candidate(place).kind.to_string(),
            parameters: numbers.collect(),
        };
        say_choice(&mut effect, choice);
        effect
    }

    /// Unexplained power, reported by its location only.
    fn unexplained(&self, location: &Location) -> EffectEntry {
        let axis = AXES[location.axis];
        let [from_s, to_s] = self.made_of.rows.span_s(&location.rows);
        let of = self.of(&location.rows);
        let (low_hz, high_hz) = location.band_hz;
        EffectEntry {
            p_value: location.p_value,
            ..unlisted(
                String::new(),
                format!(
                    "Accelerometer {axis}{of} shows more than its noise between {from_s:.1} and {to_s:.1} s, {low_hz:.1} to {high_hz:.0} Hz, and no entry of the catalogue explains it."
                ),
            )
        }
    }

    /// Recording of some rows, for a sentence, if there are several.
    fn of(&self, rows: &Range<usize>) -> String {
        let name = self.made_of.rows.recording_of(rows.start);
        name.map_or_else(String::new, |name| format!(" of {name}"))
    }

    fn location(&self, location: &Location) -> LocationEntry {
        let readings = &self.made_of.rows;
        let [start_s, end_s] = readings.span_s(&location.rows);
        let recording = readings.recording_of(location.rows.start);
        LocationEntry {
            recording: recording.map(ToString::to_string),
            channel: channel_name(location.axis),
            start_s,
            end_s,
            low_hz: location.band_hz.0,
            high_hz: location.band_hz.1,
            regime: location.regime.clone(),
            size: location.size_rad_s,
            unit: "m/s^2".to_string(),
            coherent_with: Vec::new(),
            p_value: location.p_value,
        }
    }

    fn runners_up(&self) -> Vec<RunnerUp> {
        let rivals = self.found.judged.iter().flat_map(|judged| &judged.rivals);
        let candidates = &self.found.candidates;
        RunnerUp::nearest(rivals.map(|(rival, behind)| (candidates[*rival].kind, *behind)))
    }

    fn sentences(&self, shown: &Shown, effects: &[EffectEntry]) -> Vec<String> {
        let mut lines = Vec::new();
        for location in &shown.locations {
            let [from_s, to_s] = self.made_of.rows.span_s(&location.rows);
            lines.push(format!(
                "Where: accelerometer {}{} between {from_s:.1} and {to_s:.1} s, {:.0} to {:.0} Hz, {:.1} µg.",
                AXES[location.axis],
                self.of(&location.rows),
                location.band_hz.0,
                location.band_hz.1,
                location.size_rad_s * MICRO_G,
            ));
        }
        lines.extend(effects.iter().flat_map(effect_lines));
        for &place in &self.confirmed.unconfirmed {
            let member = self.found.fit.members[place];
            lines.push(format!(
                "Not named: {}: it does not hold in every stretch of the rows.",
                self.found.candidates[member].kind
            ));
        }
        for &place in &self.confirmed.undescribed {
            let member = self.found.fit.members[place];
            lines.push(format!(
                "Not named: {}: it is no more than what an expression beside it, which only describes, may leave of its cause.",
                self.found.candidates[member].kind
            ));
        }
        for one in &shown.validations {
            let falls = one.after.drift_rad_s.abs()
                < self.plan.force.improved * one.before.drift_rad_s.abs();
            if falls && drift_chance(&one.before) < self.plan.judgement.unexplained {
                lines.push(format!(
                    "Proof: on held-out time the mean error of accelerometer {} falls from {:.2} to {:.2} ± {:.2} µg.",
                    AXES[one.axis],
                    one.before.drift_rad_s * MICRO_G,
                    one.after.drift_rad_s * MICRO_G,
                    one.after.drift_std_rad_s * MICRO_G
                ));
            }
        }
        let fit = &self.confirmed.fit;
        let wandering = (0..3).filter(|&axis| fit.drift[axis] != Drift::None);
        let wander_m_s2 = |axis: usize| shown.noise[axis].wander_rad_s(self.streams.span_s());
        // Far below the least that is printed, a walk is not reported.
        for (axis, micro_g) in wandering
            .map(|axis| (axis, wander_m_s2(axis) * MICRO_G))
            .filter(|(_, micro_g)| *micro_g >= 0.005)
        {
            lines.push(format!(
                "Drift: accelerometer {} wanders by {micro_g:.2} µg (one standard deviation) over the recording, which the model's noise does not; a bias of that size would hide in it.",
                AXES[axis],
            ));
        }
        for (axis, declared) in self.declared_white.iter().enumerate() {
            let ratio = declared.map_or(0.0, |declared| shown.noise[axis].theta[0] / declared);
            if ratio > self.plan.judgement.excess_ratio {
                lines.push(format!(
                    "Accelerometer {} is {:.2} times as noisy as the model says.",
                    AXES[axis],
                    ratio.sqrt()
                ));
            }
        }
        lines.extend(self.carried_s.iter().map(|(name, [from_s, to_s])| {
            let of = name.as_ref().map_or_else(String::new, |name| format!(" of {name}"));
            format!("The accelerometers{of} are compared between {from_s:.1} and {to_s:.1} s: beyond, the reference was lost and the attitude with it.")
        }));
        lines
    }

    /// Self-test: response of the search to noise and to injected effects on these rows.
    fn self_test(&self, seed: u64) -> Option<Tested> {
        let Found {
            candidates,
            fit,
            equations,
            ..
        } = &self.found;
        let members = fit
            .members
            .iter()
            .map(|&place| &candidates[place].hypothesis);
        let rows: Vec<Row> = candidates.iter().filter_map(row_of).collect();
        let set = FoundSet {
            levels: &fit.levels,
            members: &members.collect::<Vec<_>>(),
        };
        self_test_on(equations, set, &rows, &self.plan, seed)
    }

    fn not_excluded(&self) -> Vec<String> {
        let is_found = |kind: &Kind| {
            (0..self.confirmed.named.len()).any(|place| self.candidate(place).kind == kind.kind)
        };
        let kinds = KINDS.iter().filter(|kind| !is_found(kind));
        let reasons = kinds.filter_map(|kind| {
            if self.left_out.iter().any(|out| out == kind.kind) {
                return Some(format!("{}: not tried", kind.kind));
            }
            let snr = self.shows(kind);
            (snr < NEEDED_SNR).then(|| {
                format!(
                    "{}: of typical size ({:.0e} {}) it would show here at an SNR of {snr:.1}",
                    kind.kind, kind.typical, kind.unit
                )
            })
        });
        let shaken = (!self.shaken.is_empty()).then(|| {
            format!(
                "accelerometer effects in {}: these stretches show forces that neither gravity nor rotation predicts (the case was shaken along a line); they were left out, and what goes with such a force cannot be told from it",
                self.shaken.join(", ")
            )
        });
        reasons.chain(shaken).collect()
    }

    /// Matched-filter SNR of the strongest parameter of a kind of typical size, given the vertical.
    fn shows(&self, kind: &Kind) -> f64 {
        let whole = self
            .found
            .candidates
            .iter()
            .find(|one| one.kind == kind.kind && one.variant == Variant::Whole);
        let Some(one) = whole else {
            return 0.0;
        };
        let fit = rlg_inference::evaluate::evaluate(
            &self.found.equations,
            &[&one.hypothesis],
            &self.confirmed.fit.levels,
            &self.confirmed.fit.drift,
            rlg_inference::evaluate::Effort::QUICK,
            &self.plan.inference.search,
        );
        let stds = (0..one.hypothesis.parameters).map(|k| fit.covariance[(k, k)].sqrt());
        kind.typical / stds.fold(f64::INFINITY, f64::min)
    }
}

/// Row of a candidate in the self-test; `None` for expressions.
fn row_of(one: &Candidate) -> Option<Row<'_>> {
    let kind = kind_of(one)?;
    let reach = Reach {
        unit: kind.unit,
        typical: kind.typical,
        largest: kind.largest,
    };
    Some(Row::new(one.kind, &one.hypothesis, Some(reach)))
}

fn kind_of(one: &Candidate) -> Option<&'static Kind> {
    kinds::find(one.kind)
}

/// Combines the gyros' verdict with that of the accelerometers.
fn joined(gyros: Verdict, found: bool, clean: bool) -> Verdict {
    let (explained, all_clean) = match gyros {
        Verdict::Matches => (false, true),
        Verdict::Explained => (true, true),
        Verdict::PartlyExplained => (true, false),
        Verdict::Unexplained => (false, false),
        Verdict::Unusable => return Verdict::Unusable,
    };
    match (explained || found, all_clean && clean) {
        (false, true) => Verdict::Matches,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
        (false, false) => Verdict::Unexplained,
    }
}
