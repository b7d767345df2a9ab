//! Findings in the words of the contract and of people (diagnosis road, steps 10 and 11).
//!
//! Enters: everything the stages found. Leaves: `diagnosis.json` and its verdict. One effect's entry is made in
//! entries.rs, what makes a name doubtful in doubt.rs, the sentences in sentences.rs, the model with the found effects in
//! explained_model.rs.

use super::blocks::Blocks;
use super::declare::FAMILY_SIGNIFICANCE;
use super::doubt::Doubt;
use super::entries::{fault_entry, listed, noise, of_one_effect, regimes, term, unlisted};
use super::excess::Excess;
use super::figures::{channel, runners_up, self_test_entry, sensitivity};
use super::hunt::{Catch, FoundTerm};
use super::hypotheses::CATALOGUE;
use super::lattice::Lattice;
use super::locate::Location;
use super::long::NOT_TRIED;
use super::noise::Noise;
use super::products::Products;
use super::qualify::Fault;
use super::result::*;
use super::scene::Scene;
use super::self_test::SelfTest;
use super::signals;
use super::split::Split;
use super::streams::AXES;
use super::validate::{Validation, drift_chance};
pub use rlg_findings::sentences::{DEG_H, NEEDED_SNR, combination};

/// Everything the stages found.
pub struct Findings<'a> {
    /// Name of the recording, or names of several.
    pub recording: &'a str,
    /// The seed, for the file.
    pub seed: u64,
    /// Channels and motion.
    pub scene: &'a Scene,
    /// How time was cut.
    pub split: &'a Split,
    /// Noise of each gyro.
    pub noise: &'a [Noise; 3],
    /// Effects and terms.
    pub catch: &'a Catch,
    /// Noise beyond the model's.
    pub excess: &'a [Excess],
    /// Faults of the data that the model does not know.
    pub faults: &'a [Fault],
    /// Where model and recording differed.
    pub locations: &'a [Location],
    /// Where they still do.
    pub left: &'a [Location],
    /// Before and after.
    pub validations: &'a [Validation],
    /// Effects that were tried.
    pub candidates: &'a [usize],
    /// By how much each gyro wanders beyond the model's noise \[rad/s\], where it does.
    pub wandering_rad_s: [Option<f64>; 3],
    /// What was fitted and held out of each recording, where there are several.
    pub by_recording: &'a [RecordingEntry],
    /// Of a recording longer than memory, of which the rows are stretches, the blocks with their held-out figures.
    pub whole: Option<(&'a Blocks, &'a [Validation])>,
    /// What the rows themselves show.
    /// What the gyros count in.
    pub lattice: &'a Lattice,
    /// Whether the held-out part took a name back.
    pub contradicted: bool,
    /// Time slides and injections; `None` against attitudes, which have no rows to slide.
    pub self_test: Option<&'a SelfTest>,
}

/// Says how each location goes with the motion: the product of channels that follows it best.
pub fn name_regimes(locations: &mut [Location], catch: &Catch, products: &Products) {
    let everything: Vec<usize> = catch.values.iter().map(|(index, _)| *index).collect();
    for location in locations {
        if let Some(best) = catch
            .survey
            .best(location.axis, &everything)
            .filter(|best| best.p_value < FAMILY_SIGNIFICANCE)
        {
            location.regime = format!("grows as {}", products.names[best.product]);
        }
    }
}

impl Findings<'_> {
    /// `diagnosis.json`.
    pub fn diagnosis(&self) -> Diagnosis {
        let effects = self.effects();
        let verdict = self.verdict(&effects);
        let streams = &self.scene.streams;
        let times = |rows: &[std::ops::Range<usize>]| {
            let of = |rows: &std::ops::Range<usize>| match self.whole {
                Some(_) => streams.own_span(rows).1,
                None => [streams.begin_s(rows.start), streams.begin_s(rows.end)],
            };
            rows.iter().map(of).collect()
        };
        Diagnosis {
            format: 1,
            recording: self.recording.to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            seed: self.seed,
            verdict,
            summary: self.summary(verdict, &effects),
            locations: self
                .locations
                .iter()
                .map(|location| self.location(location))
                .collect(),
            not_excluded: self.not_excluded(),
            next_experiment: self.next_experiment(),
            registration: Vec::new(),
            promises: Vec::new(),
            fit: FitEntry {
                fitted_on: times(&self.split.fitted),
                held_out: times(&self.split.held_out),
                recordings: self.by_recording.to_vec(),
                whole: self.whole.map(|(blocks, figures)| blocks.entry(figures)),
                channels: self.validations.iter().map(channel).collect(),
            },
            noise: (0..3)
                .map(|axis| NoiseEntry {
                    channel: format!("gyro_{}", AXES[axis]),
                    angle_random_walk_rad_sqrt_s: self.noise[axis].angle_random_walk_rad_sqrt_s(),
                    angle_noise_rad: self.noise[axis].angle_noise_rad(),
                    wandering_rad_s: self.wandering_rad_s[axis],
                    terms: None,
                })
                .collect(),
            accelerometer_noise: Vec::new(),
            trials: self.catch.trials,
            runners_up: runners_up(&self.catch.choice).collect(),
            sensitivity: sensitivity(&self.catch.choice).collect(),
            control: None,
            self_test: self.self_test.map(self_test_entry),
            effects,
        }
    }

    /// "3.0 and 5.0 s", with the recording's name where there are several.
    pub(super) fn between(&self, rows: &std::ops::Range<usize>) -> String {
        let streams = &self.scene.streams;
        let (recording, [start_s, end_s]) = streams.own_span(rows);
        let of = match streams.is_joined() {
            true => format!(" of {recording}"),
            false => String::new(),
        };
        format!("{start_s:.1} and {end_s:.1} s{of}")
    }

    fn location(&self, location: &Location) -> LocationEntry {
        let streams = &self.scene.streams;
        let (recording, [start_s, end_s]) = streams.own_span(&location.rows);
        LocationEntry {
            channel: format!("gyro_{}", AXES[location.axis]),
            recording: streams.is_joined().then(|| recording.to_string()),
            start_s,
            end_s,
            low_hz: location.band_hz.0,
            high_hz: location.band_hz.1,
            regime: location.regime.clone(),
            size: location.size_rad_s,
            unit: "rad/s".to_string(),
            p_value: location.p_value,
            coherent_with: location
                .companions
                .iter()
                .map(|companion| CoherentEntry {
                    channel: format!("gyro_{}", AXES[location.axis]),
                    with: companion.with.clone(),
                    lag_s: companion.lag_s,
                    coherence: companion.coherence,
                    p_value: companion.p_value,
                })
                .collect(),
        }
    }

    /// Gyros whose held-out rows are not the noise that was fitted. Of one at rest that counts coarse pulses they cannot be:
    /// what counting makes is bounded, not white.
    pub(super) fn restless(&self) -> impl Iterator<Item = &Validation> {
        /// Chance below which they are not: of a hundred recordings that the model explains none came below 1e-4.
        const NOT_NOISE: f64 = 1e-6;
        let counts = |gyro: usize| {
            self.scene.streams.at_rest.is_some() && self.lattice.pulse_rad[gyro] > 0.0
        };
        let is_restless =
            move |one: &&Validation| one.after.white_p_value < NOT_NOISE && !counts(one.axis);
        self.validations.iter().filter(is_restless)
    }

    /// The self-test, where it finds names at any time: what is left has a pattern that no time slide takes away.
    pub(super) fn named_at_any_time(&self) -> Option<&SelfTest> {
        /// Of all time slides; where only noise is left it is one in a hundred.
        const SHARE: f64 = 0.1;
        let test = self.self_test?;
        (test.false_names as f64 > SHARE * test.slides as f64).then_some(test)
    }

    /// Effects that fitted in part, where nothing came in their place and no gyro drifts: what is there is neither noise nor
    /// known.
    pub(super) fn uneven(&self) -> impl Iterator<Item = &str> {
        let drifts = self.wandering_rad_s.iter().any(Option::is_some);
        let uneven = self.catch.uneven.iter().filter(move |_| !drifts);
        uneven.map(|&effect| CATALOGUE[effect].card().kind)
    }

    fn verdict(&self, effects: &[EffectEntry]) -> Verdict {
        let describe = descriptions(effects);
        let explained = describe.contains(&false);
        let clean = self.left.is_empty()
            && self.drifting().is_empty()
            && !self.contradicted
            && self.restless().next().is_none()
            && self.named_at_any_time().is_none()
            && self.uneven().next().is_none()
            && !describe.contains(&true);
        match (explained, clean) {
            (false, true) => Verdict::Matches,
            (false, false) => Verdict::Unexplained,
            (true, true) => Verdict::Explained,
            (true, false) => Verdict::PartlyExplained,
        }
    }

    /// Gyros whose held-out blocks still drift, of a recording longer than memory.
    pub(super) fn drifting(&self) -> Vec<&Validation> {
        let figures = self.whole.map_or(&[][..], |(_, figures)| figures);
        let drifts = |one: &&Validation| drift_chance(&one.after) < FAMILY_SIGNIFICANCE;
        figures.iter().filter(drifts).collect()
    }

    fn effects(&self) -> Vec<EffectEntry> {
        let doubt = Doubt::of(self.catch);
        let named = self
            .catch
            .choice
            .chosen
            .iter()
            .zip(&self.catch.regimes)
            .map(|(one, verdict)| {
                let mut entry = listed(one);
                if self.whole.is_some() {
                    let alike = NOT_TRIED.iter();
                    let alike = alike.filter(|(_, like)| like.contains(&&*entry.kind));
                    let alike: Vec<String> = alike.map(|(kind, _)| (*kind).to_string()).collect();
                    entry.indistinguishable_from.extend(alike);
                }
                entry.regimes = regimes(verdict);
                doubt.of_effect(self.scene, one, entry)
            });
        let unexplained = self.left.iter().map(|location| self.unexplained(location));
        let terms: Vec<&FoundTerm> = self.catch.terms.iter().collect();
        named
            .chain(
                of_one_effect(&terms)
                    .into_iter()
                    .map(|halves| doubt.of_term(halves[0], term(halves, &self.scene.streams))),
            )
            .chain(self.excess.iter().map(noise))
            .chain(
                self.faults
                    .iter()
                    .map(|fault| fault_entry(&self.scene.streams, fault)),
            )
            .chain(unexplained)
            .collect()
    }

    /// Physics without a name or an expression: only its location.
    fn unexplained(&self, location: &Location) -> EffectEntry {
        let axis = AXES[location.axis];
        EffectEntry {
            p_value: location.p_value,
            ..unlisted(
                String::new(),
                format!(
                    "Gyro {axis} shows more than its noise between {}, {:.1} to {:.0} Hz, and no measured channel explains it.",
                    self.between(&location.rows),
                    location.band_hz.0,
                    location.band_hz.1
                ),
            )
        }
    }
}

/// Of each effect whether it only describes: a constant over a stretch of time does, and a product of another size in
/// each; neither explains.
pub(super) fn descriptions(effects: &[EffectEntry]) -> Vec<bool> {
    let confined: Vec<(&str, &str)> = effects.iter().filter_map(confined).collect();
    let describes = |effect: &EffectEntry| {
        let within = self::confined(effect);
        let alike = confined.iter().filter(|other| within == Some(**other));
        effect.parameters.is_empty()
            || effect.expression.as_deref().is_some_and(signals::is_window)
            || alike.count() > 1
    };
    effects.iter().map(describes).collect()
}

/// The gyro and the product of an expression that acts in a stretch of time only.
fn confined(effect: &EffectEntry) -> Option<(&str, &str)> {
    let (product, _) = effect.expression.as_deref()?.split_once("*window(")?;
    Some((effect.text("axis")?, product))
}
