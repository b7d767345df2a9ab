//! Sentences and entries of `calibration.json` for an estimate.
//!
//! [`Findings`] become a [`Calibration`] with a summary of at most twenty lines. A value is printed only if identifiable
//! from the recordings; intervals are ± one standard deviation.

use std::collections::BTreeMap;

use nalgebra::DVector;
use rlg_catalogue::entries::{Card, card};
use rlg_findings::entries::rows;

use super::combinations::{self, Known, Pair, symbol};
use super::estimate::{Estimate, at_unit_diagonal, condition_number, directions};
use super::record::RecordInformation;
use super::result::{
    Calibration, DirectionEntry, NAMES, NuisanceEntry, RecordingEntry, UnfixedEntry,
};
use super::unknowns::{COEFFICIENTS, FLEXURE, RIVAL, Unknowns, flexure_std_s2};
use rlg_findings::result::{EffectEntry, NoiseEntry, ParameterEntry, PlanEntry, RegimeEntry};
use rlg_plan::CalibrationPlan;
use rlg_recording::Recording;
use rlg_signal::streams::AXES;

/// Factor from s² to the unit of K in text, 1e-8 s².
pub const E8: f64 = 1e8;

/// Number of recordings and unidentifiable combinations above which the summary only counts them.
const LINES: usize = 5;

/// Input of a calibration's result.
pub struct Findings<'a> {
    /// The recordings.
    pub recordings: &'a [Recording],
    /// The information of each recording.
    pub records: &'a [RecordInformation],
    /// The method of each recording: rates or attitude.
    pub methods: Vec<&'static str>,
    /// The estimate of each recording alone.
    pub own: &'a [(Unknowns, Estimate)],
    /// The joint unknowns.
    pub unknowns: &'a Unknowns,
    /// The joint estimate.
    pub joint: &'a Estimate,
    /// Identifiable part of each gyro's pair.
    pub pairs: &'a [Pair; 3],
    /// An elastic rate explains them as well.
    pub confused: bool,
    /// Thresholds.
    pub plan: &'a CalibrationPlan,
    /// Thresholds other than the defaults.
    pub changed: &'a [PlanEntry],
}

impl Findings<'_> {
    /// `calibration.json`.
    pub fn calibration(&self) -> Calibration {
        let recordings = self.recordings();
        let unfixed = combinations::unfixed(self.joint, self.pairs);
        let next_experiment = self.next_experiment(&unfixed);
        Calibration {
            format: 1,
            version: env!("CARGO_PKG_VERSION").to_string(),
            effects: vec![self.effect()],
            condition_number: condition_number(&self.joint.covariance, self.plan),
            directions: directions(&self.joint.covariance)
                .iter()
                .map(|direction| DirectionEntry {
                    combination: direction
                        .weights
                        .iter()
                        .enumerate()
                        .map(|(k, weight)| (NAMES[k].to_owned(), *weight))
                        .collect(),
                    std: direction.std,
                })
                .collect(),
            not_identifiable: unfixed
                .iter()
                .map(|unfixed| UnfixedEntry {
                    combination: combinations::names(&unfixed.weights),
                    std: unfixed.std,
                    motion: unfixed.motion.clone(),
                })
                .collect(),
            in_model: combinations::for_model(self.joint, self.pairs)
                .iter()
                .enumerate()
                .map(|(k, value)| (NAMES[k].to_owned(), *value))
                .collect::<BTreeMap<_, _>>(),
            nuisances: self.nuisances(),
            summary: self.summary(&recordings, &unfixed, &next_experiment),
            plan: self.changed.to_vec(),
            next_experiment,
            recordings,
        }
    }

    fn effect(&self) -> EffectEntry {
        let card: Card = card(FLEXURE).expect("flexure stands in the catalogue");
        let joint = self.joint;
        EffectEntry {
            evidence: None,
            gravity_speaks_against: Vec::new(),
            kind: card.kind.to_owned(),
            indistinguishable_from: if self.confused {
                vec![RIVAL.to_owned()]
            } else {
                Vec::new()
            },
            equation: card.equation.to_owned(),
            parameters: (0..COEFFICIENTS)
                .map(|k| {
                    let (value, std) = (joint.values[k], joint.covariance[(k, k)].sqrt());
                    ParameterEntry::number(NAMES[k], value, std, card.unit)
                })
                .collect(),
            covariance: rows(&joint.covariance),
            identifiable: combinations::identifiable(joint, self.pairs),
            log_evidence_gain: joint.log_evidence_gain,
            p_value: joint.p_value,
            what_was_left_out: card.meaning.to_owned(),
            expression: None,
            regimes: self
                .recordings
                .iter()
                .zip(self.own)
                .map(|(recording, (_, own))| self.regime(recording, own))
                .collect(),
        }
    }

    /// Amplitude λ of the joint flexure λK in one recording alone, by generalised least squares.
    fn regime(&self, recording: &Recording, own: &Estimate) -> RegimeEntry {
        let weight = self.weighted(own);
        let length = self.dot(&weight);
        let along: f64 = weight.iter().zip(&own.values).map(|(w, k)| w * k).sum();
        RegimeEntry {
            name: recording.name.clone(),
            amplitude: along / length,
            std: length.sqrt().recip(),
        }
    }

    /// C⁻¹K with the covariance of one recording and the joint K.
    fn weighted(&self, own: &Estimate) -> Vec<f64> {
        let k = DVector::from_column_slice(&self.joint.values[..COEFFICIENTS]);
        let (root, scale) = at_unit_diagonal(&own.covariance);
        let solved = root.map(|root| root.solve(&k.component_mul(&scale)));
        solved.map_or_else(
            || vec![0.0; COEFFICIENTS],
            |solved| solved.component_mul(&scale).as_slice().to_vec(),
        )
    }

    fn dot(&self, weight: &[f64]) -> f64 {
        weight
            .iter()
            .zip(&self.joint.values)
            .map(|(weight, k)| weight * k)
            .sum()
    }

    fn recordings(&self) -> Vec<RecordingEntry> {
        let left = |place: usize, values: &[f64]| {
            let own = self.unknowns.of_recording(place).into_iter();
            let own = DVector::from_vec(own.map(|index| values[index]).collect());
            let part = &self.records[place];
            part.information.power_left(&own) / part.degrees
        };
        let mut without = self.joint.values.clone();
        without[..COEFFICIENTS].fill(0.0);
        self.recordings
            .iter()
            .zip(self.records)
            .enumerate()
            .map(|(place, (recording, part))| RecordingEntry {
                recording: recording.name.clone(),
                method: self.methods[place],
                seconds: part.seconds,
                greatest_acceleration_rad_s2: part.acceleration_rad_s2,
                normalised_power_before: left(place, &without),
                normalised_power_after: left(place, &self.joint.values),
                snr: self.dot(&self.weighted(&self.own[place].1)).max(0.0).sqrt(),
                covariance: rows(&self.own[place].1.covariance),
                noise: (0..3)
                    .map(|axis| NoiseEntry {
                        channel: format!("gyro_{}", AXES[axis]),
                        angle_random_walk_rad_sqrt_s: (part.levels[axis].white * part.rate_hz)
                            .sqrt(),
                        angle_noise_rad: part.levels[axis].angle.sqrt(),
                        wandering_rad_s: None,
                        terms: None,
                    })
                    .collect(),
            })
            .collect()
    }

    fn nuisances(&self) -> Vec<NuisanceEntry> {
        self.unknowns
            .fitted()
            .skip(COEFFICIENTS)
            .filter_map(|index| {
                let unknown = self.unknowns.get(index);
                let place = unknown.recording?;
                // A parameter that the recording does not determine keeps its prior and gets no line.
                let learnt = self.joint.stds[index]
                    < self.plan.uninformed_share * unknown.prior_std(&self.plan.prior);
                learnt.then(|| NuisanceEntry {
                    recording: self.recordings[place].name.clone(),
                    kind: unknown.kind,
                    name: unknown.name,
                    value: self.joint.values[index],
                    std: self.joint.stds[index],
                    unit: unknown.unit(),
                })
            })
            .collect()
    }

    fn next_experiment(&self, unfixed: &[combinations::Unfixed]) -> String {
        let mut sentences: Vec<String> = unfixed
            .iter()
            .map(|unfixed| format!("{}: {}.", symbol(&unfixed.weights), unfixed.motion))
            .collect();
        if self.confused {
            sentences.push(
                "To separate an elastic rate: spin in both senses with an oscillation across, against a rate reference; flexure changes sign with the spin, an elastic rate does not."
                    .to_owned(),
            );
        }
        if sentences.is_empty() {
            "Nothing is left to separate; twice the table time gives spreads 0.7 times these."
                .to_owned()
        } else {
            sentences
                .push("`rlg calibrate --propose LIMITS.toml` proposes the programme.".to_owned());
            sentences.join(" ")
        }
    }

    fn summary(
        &self,
        recordings: &[RecordingEntry],
        unfixed: &[combinations::Unfixed],
        next_experiment: &str,
    ) -> Vec<String> {
        let mut lines: Vec<String> = PlanEntry::sentence(self.changed).into_iter().collect();
        for entry in recordings.iter().take(LINES) {
            let [x, y, z] = entry.greatest_acceleration_rad_s2;
            lines.push(format!(
                "{}: {:.0} s by {}, up to {:.1} rad/s^2, flexure at SNR {:.1}",
                entry.recording,
                entry.seconds,
                entry.method,
                x.max(y).max(z),
                entry.snr
            ));
        }
        if recordings.len() > LINES {
            lines.push(format!("and {} more recordings", recordings.len() - LINES));
        }
        for pair in self.pairs {
            lines.push(self.gyro_line(pair));
        }
        for unfixed in unfixed.iter().take(LINES) {
            let seen = if unfixed.std < self.plan.uninformed_share * flexure_std_s2() {
                format!("known to ± {:.1}e-8 s^2 only", unfixed.std * E8)
            } else {
                "not seen at all".to_owned()
            };
            lines.push(format!(
                "not identifiable: {} ({seen})",
                symbol(&unfixed.weights)
            ));
        }
        match condition_number(&self.joint.covariance, self.plan) {
            Some(number) => lines.push(format!("condition number of the six: {number:.1}")),
            None => lines.push("condition number of the six: infinite".to_owned()),
        }
        let each = recordings.iter().zip(self.records);
        let beyond_noise = each.filter(|(entry, part)| {
            entry.normalised_power_after
                > self.plan.most_power + self.plan.power_deviations * (2.0 / part.degrees).sqrt()
        });
        for (entry, _) in beyond_noise {
            lines.push(format!(
                "{}: the residual has {:.1} times the noise's power; run `rlg diagnose` before trusting this",
                entry.recording, entry.normalised_power_after
            ));
        }
        if self.confused {
            lines.push(
                "an elastic rate of the blocks would explain these recordings as well".to_owned(),
            );
        }
        lines.push(format!("next: {next_experiment}"));
        lines
    }

    fn gyro_line(&self, pair: &Pair) -> String {
        let (a, b) = (2 * pair.gyro, 2 * pair.gyro + 1);
        let value = |weights: &[(usize, f64)]| {
            let (value, std) = self.joint.combination(weights);
            format!(
                "{} = {:.3} ± {:.3} e-8 s^2",
                symbol(weights),
                value * E8,
                std * E8
            )
        };
        let sum = value(&[(a, 1.0), (b, 1.0)]);
        let text = match pair.known {
            Known::Both => {
                format!("{}, {}, {sum}", value(&[(a, 1.0)]), value(&[(b, 1.0)]))
            }
            Known::One(which) => {
                format!(
                    "{}; the model takes it for both",
                    value(&[(a + which, 1.0)])
                )
            }
            Known::Sum => format!("{sum}; the model takes half for each"),
            Known::Nothing => "nothing fixed; the model leaves its flexure off".to_owned(),
        };
        format!("gyro {}: {text}", AXES[pair.gyro])
    }
}
