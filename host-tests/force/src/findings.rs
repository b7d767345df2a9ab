//! Accelerometer findings in the terms of `diagnosis.json`, together with those of the gyros. µg in text.

use std::ops::Range;

use rlg_catalogue::accelerometers::{KINDS, Kind};
use rlg_diagnosis::Outcome;
use rlg_diagnosis::rows::entries_of_rows;
use rlg_diagnosis::rows::noise_levels::reported;
use rlg_diagnosis::self_test::{FoundSet, Row, add_other_self_test, self_test_on};
use rlg_diagnosis::tiles::held_out_figures::{Validation, drift_chance, validate};
use rlg_diagnosis::tiles::locate::{self, Location};
use rlg_diagnosis::tiles::noise_spectrum::Noise;
use rlg_findings::entries::unlisted;
use rlg_findings::result::{
    ChannelEntry, EffectEntry, ForceNoiseEntry, LocationEntry, RunnerUp, Tested, UNLISTED, Verdict,
};
use rlg_findings::sentences::{REJECTED, effect_lines};
use rlg_findings::updated_model::switch_on;
use rlg_inference::{Columns, Drift};
use rlg_recording::units::MICRO_G_PER_M_S2 as MICRO_G;
use rlg_signal::accelerometer_rows::channel_name;
use rlg_signal::axes::{AXES, Triad, add};

use crate::candidates::{Candidate, Variant};
use crate::diagnose::Diagnosed;
use crate::effects::kind_of;
use crate::search::{Found, of_verticals};

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
        diagnosis.conclude(verdict);
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
        add_other_self_test(diagnosis, tested);
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
                    "Residual of accelerometer {axis}{of} between {from_s:.1} and {to_s:.1} s at {low_hz:.1} to {high_hz:.0} Hz: not explained by any effect of the catalogue."
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
        lines.extend(
            effects
                .iter()
                .flat_map(|one| effect_lines(one, &self.plan.findings)),
        );
        for &place in &self.confirmed.unconfirmed {
            let member = self.found.fit.members[place];
            lines.push(format!(
                "{REJECTED}{}: fails blocked cross-validation.",
                self.found.candidates[member].kind
            ));
        }
        for &place in &self.confirmed.undescribed {
            let member = self.found.fit.members[place];
            lines.push(format!(
                "{REJECTED}{}: within the remainder that an expression found with it may leave of its cause.",
                self.found.candidates[member].kind
            ));
        }
        for one in &shown.validations {
            let falls = one.after.drift_rad_s.abs()
                < self.plan.force.improved * one.before.drift_rad_s.abs();
            if falls && drift_chance(&one.before) < self.plan.judgement.unexplained {
                lines.push(format!(
                    "Held-out time: mean error of accelerometer {} falls from {:.2} to {:.2} ± {:.2} µg.",
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
                "Drift: accelerometer {} by {micro_g:.2} µg (1 σ) over the recording, above the model's noise; it conceals a bias of that size.",
                AXES[axis],
            ));
        }
        for (axis, declared) in self.declared_white.iter().enumerate() {
            let ratio = declared.map_or(0.0, |declared| shown.noise[axis].theta[0] / declared);
            if ratio > self.plan.judgement.excess_ratio {
                lines.push(format!(
                    "Noise of accelerometer {} is {:.2} times the model's.",
                    AXES[axis],
                    ratio.sqrt()
                ));
            }
        }
        lines.extend(self.carried_s.iter().map(|(name, [from_s, to_s])| {
            let of = name.as_ref().map_or_else(String::new, |name| format!(" of {name}"));
            format!("Accelerometers{of} compared between {from_s:.1} and {to_s:.1} s only: beyond, the reference was lost and with it the attitude.")
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
            (snr < self.plan.findings.needed_snr).then(|| {
                format!(
                    "{}: at its typical size ({:.0e} {}) its SNR here is {snr:.1}",
                    kind.kind, kind.typical, kind.unit
                )
            })
        });
        let shaken = (!self.shaken.is_empty()).then(|| {
            format!(
                "accelerometer effects in {}: forces predicted neither by gravity nor by rotation (linear vibration of the case); these stretches were excluded, and effects correlated with such a force are not distinguishable from it",
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
    Some(Row::new(one.kind, &one.hypothesis, Some(kind.into())))
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
    Verdict::of(explained || found, all_clean && clean)
}
