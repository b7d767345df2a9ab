//! Findings of still positions in the terms of `diagnosis.json`. µg in text.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::DMatrix;
use rlg_catalogue::accelerometers::DRIFT;
use rlg_diagnosis::Outcome;
use rlg_diagnosis::self_test::{FoundSet, Row, self_test_on};
use rlg_findings::combinations::choice;
use rlg_findings::entries::{correlated, unlisted};
use rlg_findings::result::{
    ChannelEntry, Diagnosis, EffectEntry, EvidenceEntry, FiguresEntry, FitEntry, ForceNoiseEntry,
    Identifiable, LocationEntry, ParameterEntry, RunnerUp, Tested, UNLISTED, Verdict,
};
use rlg_findings::updated_model::{set_choice, switch_on};
use rlg_inference::judgement::chance_in_noise;
use rlg_signal::accelerometer_rows::channel_name;
use rlg_signal::axes::AXES;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::candidates::{Candidate, Column, names};
use super::diagnose::Diagnosed;
use super::errors::Errors;
use super::few_positions::three_sigma_factor;

/// Channel of the force's length, which is compared with gravity.
const LENGTH: &str = "force_length";

impl Diagnosed {
    /// All findings, as entries, in words and in the model.
    pub fn outcome(&self) -> Outcome {
        let places = 0..self.found.named.len();
        let effects: Vec<EffectEntry> = places.map(|place| self.effect(place)).collect();
        let lengths_m_s2 = self.lengths_m_s2();
        let channel = self.channel(&lengths_m_s2);
        let is_listed = |one: &&EffectEntry| one.kind != UNLISTED;
        let found = effects.iter().filter(is_listed).count();
        let left = effects.len() - found + usize::from(self.is_scatter_incredible());
        let verdict = Verdict::of(found > 0, left == 0);
        let mut model = self.model.clone();
        for place in 0..self.found.named.len() {
            let one = self.candidate(place);
            if one.kind != UNLISTED {
                let mut effect = one.effect(self.sizes(place));
                let (names, ..) = self.numbers(place);
                let names = names.iter().map(String::as_str);
                set_choice(&mut effect, choice(names, &self.identifiable(place)));
                switch_on(&mut model, effect);
            }
        }
        let summary = self.summary(verdict, &effects, channel.as_ref());
        let mut diagnosis = Diagnosis {
            verdict,
            summary,
            effects,
            locations: self.locations(&lengths_m_s2),
            registration: Vec::new(),
            fit: FitEntry {
                fitted_on: self.fitted.iter().map(|&one| self.span_s(one)).collect(),
                held_out: self.tested.iter().map(|&one| self.span_s(one)).collect(),
                recordings: Vec::new(),
                whole: None,
                channels: channel.into_iter().collect(),
            },
            not_excluded: self.not_excluded(),
            next_experiment: self.next_experiment(),
            accelerometer_noise: self.noise(),
            trials: self.found.tried,
            runners_up: self.runners_up(),
            ..Diagnosis::unusable(&self.recording, self.seed, "")
        };
        diagnosis.add_self_test(self.self_test());
        Outcome {
            diagnosis,
            model,
            pictures: None,
        }
    }

    /// Candidate that a finding is named after.
    pub(super) fn candidate(&self, place: usize) -> &Candidate {
        &self.found.candidates[self.found.headlines[place]]
    }

    /// Its parameters in the final fit.
    fn block(&self, place: usize) -> Range<usize> {
        let fit = &self.found.named_fit;
        let headline = self.found.headlines[place];
        let own = fit.members.iter().position(|member| *member == headline);
        own.map_or(0..0, |own| fit.blocks[own].clone())
    }

    pub(super) fn sizes(&self, place: usize) -> &[f64] {
        &self.found.named_fit.estimate.as_slice()[self.block(place)]
    }

    /// True if the residual scatter between positions is implausibly large against its prior, an inverse χ² centred on the
    /// drift within positions with `scatter_known` degrees of freedom.
    pub(super) fn is_scatter_incredible(&self) -> bool {
        let found = &self.found;
        let scatter_m2_s4 = found.named_fit.levels[0].angle * found.lengths.unit_m_s2.powi(2);
        let known = self.plan.positions.scatter_known;
        let ratio = known * found.record.scatter_m2_s4 / scatter_m2_s4.max(f64::MIN_POSITIVE);
        let chance = ChiSquared::new(known).map_or(1.0, |law| law.cdf(ratio));
        chance < self.plan.judgement.unexplained
    }

    /// Factor of a standard deviation so that ±3σ has Gaussian coverage although the scatter between positions is estimated
    /// from few of them (Student's t with the effective degrees of freedom of Welch and Satterthwaite).
    fn few_positions(&self) -> f64 {
        let found = &self.found;
        let levels = found.named_fit.levels[0];
        let numbers: usize = found.named_fit.ranks.iter().sum();
        let record = &found.record;
        let all = record.covariance(levels, found.lengths.unit_m_s2);
        let within = record.within_m2_s4.iter().enumerate();
        let shares = within.map(|(at, within)| 1.0 - levels.white * within / all[(at, at)]);
        let count = record.within_m2_s4.len() as f64;
        let share = shares.sum::<f64>() / count;
        let known = self.plan.positions.scatter_known;
        let freedom = (count - numbers as f64).max(0.0) + known;
        three_sigma_factor(freedom / share.powi(2).max(f64::MIN_POSITIVE))
    }

    /// Names, values and covariance of a finding in the contract's numbers.
    fn numbers(&self, place: usize) -> (Vec<String>, Vec<f64>, DMatrix<f64>) {
        let one = self.candidate(place);
        let mut numbers = one.numbers(self.sizes(place));
        let mut from: Vec<(usize, f64)> = Vec::new();
        for (parameter, column) in one.columns.iter().enumerate() {
            let shares = names(*column);
            let count = shares.len() as f64;
            from.extend(shares.iter().map(|(_, sign)| (parameter, sign / count)));
        }
        let mut order: Vec<usize> = (0..numbers.len()).collect();
        order.sort_by(|a, b| numbers[*a].0.cmp(&numbers[*b].0));
        let own = self.covariance(place);
        let largest = one.row().map_or(0.0, |kind| kind.largest);
        let covariance = DMatrix::from_fn(order.len(), order.len(), |a, b| {
            let ((p, w), (q, v)) = (from[order[a]], from[order[b]]);
            let pair = from.iter().filter(|(parameter, _)| *parameter == p).count() > 1;
            // The sum of two tilts that share a skew is not observable: it has the prior variance.
            let unseen = if pair && p == q {
                0.5 * largest * largest
            } else {
                0.0
            };
            w * v * own[(p, q)] + unseen
        });
        let sorted: Vec<(String, f64)> = order
            .iter()
            .map(|&at| std::mem::take(&mut numbers[at]))
            .collect();
        let (names, values) = sorted.into_iter().unzip();
        (names, values, covariance)
    }

    /// Covariance of a finding's parameters.
    fn covariance(&self, place: usize) -> DMatrix<f64> {
        let block = self.block(place);
        let factor = self.few_positions().powi(2);
        let fit = &self.found.named_fit;
        DMatrix::from_fn(block.len(), block.len(), |a, b| {
            factor * fit.covariance[(block.start + a, block.start + b)]
        })
    }

    fn identifiable(&self, place: usize) -> Vec<Identifiable> {
        let (one, sizes) = (self.candidate(place), self.sizes(place));
        let covariance = self.covariance(place);
        let each = one.columns.iter().enumerate();
        each.map(|(at, column)| Identifiable {
            combination: names(*column).into_iter().collect::<BTreeMap<_, _>>(),
            value: sizes[at],
            std: covariance[(at, at)].max(0.0).sqrt(),
        })
        .filter(|one| !one.combination.is_empty())
        .collect()
    }

    /// Kinds that are not distinguishable from a finding in these positions.
    pub(super) fn alike(&self, place: usize) -> Vec<String> {
        let found = &self.found;
        let member = found.named[place];
        let judged = &found.judged.members[member];
        let own = self.candidate(place).kind;
        let rivals = judged.rivals.iter().map(|(rival, _)| *rival);
        let all = rivals
            .chain(found.judged.spanned_by[member].iter().copied())
            .chain([found.fit.members[member]]);
        let kinds: BTreeSet<&str> = all
            .map(|rival| found.candidates[rival].kind)
            .filter(|kind| *kind != own)
            .collect();
        let mut kinds: Vec<String> = kinds.into_iter().map(str::to_string).collect();
        if judged.cost_against_drift < self.plan.judgement.drift_within {
            kinds.push(DRIFT.to_string());
        }
        kinds
    }

    fn effect(&self, place: usize) -> EffectEntry {
        let one = self.candidate(place);
        let found = &self.found;
        let member = found.named[place];
        let (names, values, covariance) = self.numbers(place);
        let unit = match (one.row(), one.position()) {
            (Some(kind), _) => kind.unit,
            (None, Some(_)) => "m/s^2",
            (None, None) => "",
        };
        let (mut parameters, rows) = correlated(&names, &values, &covariance, unit);
        let alike = self.alike(place);
        let mut expression = one.columns[0].expression();
        if let Some((axis, text)) = &expression {
            parameters.push(ParameterEntry::text("axis", &channel_name(*axis)));
            parameters.push(ParameterEntry::text("expression", text));
        }
        if expression.is_none() && alike.iter().any(|kind| kind == UNLISTED) {
            let rivals = found.judged.members[member].rivals.iter();
            let mut all = rivals.map(|(rival, _)| &found.candidates[*rival]);
            expression = all.find_map(|rival| rival.columns[0].expression());
        }
        let squared_size =
            2.0 * (found.fit.log_likelihood - found.judged.without[member].log_likelihood);
        EffectEntry {
            kind: one.kind.to_string(),
            equation: self.equation(one),
            parameters,
            covariance: rows,
            identifiable: self.identifiable(place),
            log_evidence_gain: found.judged.members[member].cost_without,
            p_value: chance_in_noise(squared_size, found.fit.ranks[member], one.hypothesis.price),
            what_was_left_out: self.left_out(place, &values, &covariance),
            expression: expression.map(|(_, text)| text),
            evidence: Some(EvidenceEntry {
                label: if alike.is_empty() { "named" } else { "class" },
                confirmed_gain: self.found.confirmed_gain[member],
                share: self.share(place),
                reenactments: 0,
                inflation: 1.0,
            }),
            indistinguishable_from: alike,
            ..unlisted(String::new(), String::new())
        }
    }

    pub(super) fn equation(&self, one: &Candidate) -> String {
        match (one.row(), one.columns[0].expression()) {
            (Some(kind), _) => kind.equation.to_string(),
            (None, Some((axis, text))) => format!("f_{} += c {text}", AXES[axis]),
            (None, None) => String::new(),
        }
    }

    /// Share of the squared length residuals explained by a finding.
    fn share(&self, place: usize) -> f64 {
        let found = &self.found;
        let one = self.candidate(place);
        let columns = one
            .hypothesis
            .terms
            .iter()
            .map(|term| &found.record.columns[term.column]);
        let mut effect = vec![0.0; found.record.length_m_s2.len()];
        for (column, size) in columns.zip(self.sizes(place)) {
            effect
                .iter_mut()
                .zip(column)
                .for_each(|(sum, value)| *sum += size * value);
        }
        let all: f64 = found.record.length_m_s2.iter().map(|one| one * one).sum();
        let own: f64 = effect.iter().map(|one| one * one).sum();
        (own / all.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Begin and end of a position \[s\].
    pub(super) fn span_s(&self, place: usize) -> [f64; 2] {
        self.span_of_rows_s(&self.positions[place].rows)
    }

    pub(super) fn span_of_rows_s(&self, rows: &Range<usize>) -> [f64; 2] {
        [rows.start, rows.end].map(|row| self.rows.start_s + row as f64 / self.rows.rate_hz)
    }

    /// Length residual (force less gravity) of all positions, before and after the findings, and its standard deviation
    /// \[m/s²\]: noise and uncertainty of the sizes.
    fn lengths_m_s2(&self) -> Vec<[f64; 3]> {
        let found = &self.found;
        let fit = &found.named_fit;
        let own = &self.plan.positions;
        let before = self.observed.record(&Errors::default(), &[], &[], own);
        let members = fit.members.iter().zip(&fit.blocks);
        let columns: Vec<(usize, Column)> = members
            .flat_map(|(&member, block)| {
                let all = found.candidates[member].columns.iter();
                all.enumerate()
                    .map(|(at, column)| (block.start + at, *column))
            })
            .collect();
        let fitted: Vec<Column> = columns.iter().map(|(_, column)| *column).collect();
        let made = self.observed.record(&found.named_errors, &fitted, &[], own);
        let spread = made.covariance(fit.levels[0], found.lengths.unit_m_s2);
        let factor = self.few_positions().powi(2);
        let lengths = before.length_m_s2.iter().zip(&made.length_m_s2);
        lengths
            .enumerate()
            .map(|(place, (before, after))| {
                let mut variance = spread[(place, place)];
                for (a, (of_a, _)) in columns.iter().enumerate() {
                    for (b, (of_b, _)) in columns.iter().enumerate() {
                        let pair = [a, b].map(|own| made.columns[own][place]);
                        variance += factor * pair[0] * pair[1] * fit.covariance[(*of_a, *of_b)];
                    }
                }
                [*before, *after, variance.sqrt()]
            })
            .collect()
    }

    /// Positions that differ from gravity, if there is any finding.
    fn locations(&self, lengths_m_s2: &[[f64; 3]]) -> Vec<LocationEntry> {
        let mut all = Vec::new();
        if self.found.named.is_empty() {
            return all;
        }
        for (place, [before, _, std]) in lengths_m_s2.iter().enumerate() {
            let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf((before / std).powi(2)));
            let p_value = (chance * self.positions.len() as f64).min(1.0);
            if p_value > self.plan.judgement.unexplained {
                continue;
            }
            let [start_s, end_s] = self.span_s(place);
            all.push(LocationEntry {
                channel: LENGTH.to_string(),
                recording: None,
                start_s,
                end_s,
                low_hz: 0.0,
                high_hz: 1.0 / (end_s - start_s),
                regime: format!("position {}", place + 1),
                size: before.abs(),
                unit: "m/s^2".to_string(),
                p_value,
                coherent_with: Vec::new(),
            });
        }
        all
    }

    /// Held-out positions before and after; `None` if all are fitted.
    fn channel(&self, lengths_m_s2: &[[f64; 3]]) -> Option<ChannelEntry> {
        let count = self.tested.len() as f64;
        let figures = |which: usize| {
            let own = || self.tested.iter().map(|&place| lengths_m_s2[place]);
            let power: f64 = own().map(|one| (one[which] / one[2]).powi(2)).sum();
            let variance: f64 = own().map(|one| one[2].powi(2)).sum();
            FiguresEntry {
                drift_rad_s: own().map(|one| one[which]).sum::<f64>() / count,
                drift_std_rad_s: variance.sqrt() / count,
                normalised_power: power / count,
                normalised_power_all: power / count,
                white_p_value: ChiSquared::new(count).map_or(1.0, |law| law.sf(power)),
            }
        };
        (count > 0.0).then(|| ChannelEntry {
            channel: LENGTH.to_string(),
            unit: Some("m/s^2"),
            band_hz: [0.0, 0.5 * self.rows.rate_hz],
            held_out_before: figures(0),
            held_out_after: figures(1),
        })
    }

    /// White noise within positions.
    fn noise(&self) -> Vec<ForceNoiseEntry> {
        let positions = || self.positions.iter();
        let freedom: f64 = positions()
            .map(|one| one.blocks_m_s2.len() as f64 - 1.0)
            .sum();
        let block_s = self.block_rows as f64 / self.rows.rate_hz;
        let of = |axis: usize| {
            let squares: f64 = positions().map(|one| one.scatter_m2_s4()[axis]).sum();
            ForceNoiseEntry {
                channel: channel_name(axis),
                noise_m_s2_sqrt_hz: (2.0 * block_s * squares / freedom.max(1.0)).sqrt(),
                velocity_noise_m_s: 0.0,
                terms: None,
            }
        };
        (0..3).map(of).collect()
    }

    fn runners_up(&self) -> Vec<RunnerUp> {
        let rivals = self
            .found
            .judged
            .members
            .iter()
            .flat_map(|judged| &judged.rivals);
        let candidates = &self.found.candidates;
        RunnerUp::nearest(rivals.map(|(rival, behind)| (candidates[*rival].kind, *behind)))
    }

    /// Self-test: response of the search to noise and to injected effects in these positions.
    fn self_test(&self) -> Option<Tested> {
        let found = &self.found;
        let members = found.fit.members.iter();
        let members: Vec<_> = members
            .map(|&one| &found.candidates[one].hypothesis)
            .collect();
        let rows = found.candidates.iter().filter_map(|one| {
            let reach = one.row()?.into();
            Some(Row::new(one.kind, &one.hypothesis, Some(reach)))
        });
        let rows: Vec<Row> = rows.collect();
        let set = FoundSet {
            levels: &found.fit.levels,
            members: &members,
        };
        self_test_on(&found.lengths, set, &rows, &self.plan, self.seed)
    }
}
