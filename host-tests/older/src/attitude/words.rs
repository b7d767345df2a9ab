//! What a search on attitudes found, in the result types of the diagnosis.
//!
//! Enters: records before and after, the bench, the [`Catch`]. Leaves: [`Outcome`]. Residual angles are drawn gyro by
//! gyro: the growth of the attitude error between stamps, turned into the body frame and summed up.

use nalgebra::{DMatrix, DVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::bench::{AttitudeBench, Behind};
use super::cut::Cut;
use super::judge;
use super::path::Axes;
use super::prepare::Prepared;
use super::promise;
use super::record::{Lie, Record};
use crate::Outcome;
use crate::bench::Bench as _;
use crate::declare::REGRESSOR_FIDELITY;
use crate::excess::{Excess, LEAST_EXCESS};
use crate::explain::{self, Findings};
use crate::hunt::Catch;
use crate::hypotheses;
use crate::lattice::Lattice;
use crate::locate::Tile;
use crate::motion::mean_periodogram;
use crate::noise::Noise;
use crate::pictures::Pictures;
use crate::products::Products;
use crate::result::PromiseEntry;
use crate::rows_found::RowsFound;
use crate::select::Chosen;
use crate::split::Split;
use crate::streams::Triad;
use crate::weigh::prior_width;
use crate::workbench::Parameters;
use rlg_model::Model;
use rlg_recording::Recording;

/// Everything the words are made of.
pub struct Told<'a> {
    pub recording: &'a Recording,
    pub model: &'a Model,
    pub seed: u64,
    pub prepared: &'a Prepared,
    pub before: (&'a Record, &'a Cut),
    pub after: (&'a Record, &'a Cut),
    pub lie: Option<&'a Lie>,
    pub bench: &'a AttitudeBench<'a>,
    pub parameters: &'a Parameters,
    pub candidates: &'a [usize],
    pub products: &'a Products<'a>,
}

impl Told<'_> {
    /// The outcome.
    pub fn outcome(self, mut catch: Catch) -> Outcome {
        let (record, cut) = self.after;
        let levels = &self.bench.levels;
        let scene = &self.prepared.scene;
        let left_rad = self.bench.left_over(&catch.values);
        self.name_the_lie(&mut catch);
        self.name_scales(&mut catch);
        let tiles_before = judge::tiles(
            self.before.0,
            self.before.1,
            levels,
            &self.before.0.error_rad,
        );
        let tiles_after = judge::tiles(record, cut, levels, &left_rad);
        let mut locations = judge::locate(&tiles_before);
        explain::name_regimes(&mut locations, &catch, self.products);
        let left = judge::locate(&tiles_after);
        let validations = self.validations(&left_rad, &locations);
        let split = Split {
            regimes: cut.regimes.clone(),
            fitted: Cut::rows(record, &cut.fitted),
            held_out: Cut::rows(record, &cut.held_out),
        };
        let noise = self.noise();
        let excess = self.excess(&catch, &left_rad);
        let pictures = self.pictures(&left_rad, tiles_before, tiles_after);
        let rows_found = RowsFound::default();
        let lattice = Lattice::default();
        let findings = Findings {
            whole: None,
            wandering_rad_s: [None; 3],
            recording: &self.recording.name,
            seed: self.seed,
            scene,
            split: &split,
            noise: &noise,
            catch: &catch,
            excess: &excess,
            faults: &self.prepared.faults,
            locations: &locations,
            left: &left,
            validations: &validations,
            candidates: self.candidates,
            by_recording: &[],
            rows_found: &rows_found,
            lattice: &lattice,
            contradicted: false,
            self_test: None,
        };
        let mut diagnosis = findings.diagnosis();
        diagnosis.summary.insert(1, self.about_the_reference());
        diagnosis.promises = self.promises(&catch);
        if let Some(sentence) = promise::sentence(&diagnosis.promises) {
            diagnosis.next_experiment = format!("{} {sentence}", diagnosis.next_experiment);
        }
        Outcome {
            model: findings.explained_model(self.model),
            diagnosis,
            pictures: Some(pictures),
        }
    }

    /// One sentence on what was compared.
    fn about_the_reference(&self) -> String {
        let (record, cut) = self.after;
        let held = match cut.held_out.is_empty() {
            true => "too few to hold any out: the fit is not proved on unseen time",
            false => "the last part of every stretch held out",
        };
        let step_s = judge::median_step_s(record);
        format!(
            "Reference: {} {}, one every {step_s:.3} s, read with {:.2e} rad of white noise; {held}.",
            record.stamps(),
            match record.path.axes() {
                Axes::Start => "attitudes",
                Axes::Body => "sums of increments",
            },
            self.bench.levels.reference_white_rad2.sqrt()
        )
    }

    /// What the spin programme is worth, for flexure and elastic rate where they are confused, either way round.
    fn promises(&self, catch: &Catch) -> Vec<PromiseEntry> {
        const CONFUSED: [&str; 2] = ["axis_flexure", "elastic_rate_by_jerk"];
        let of = |kind: &str| hypotheses::find(kind).map(|(effect, _)| effect);
        let [Some(flexure), Some(elastic)] = CONFUSED.map(of) else {
            return Vec::new();
        };
        let levels = &self.bench.levels;
        let step_s = judge::median_step_s(self.after.0);
        let mut promises = Vec::new();
        for one in &catch.choice.chosen {
            let Some(rival) = [(flexure, elastic), (elastic, flexure)]
                .into_iter()
                .find(|(own, _)| *own == one.effect)
                .map(|(_, rival)| rival)
                .filter(|rival| one.indistinguishable_from.contains(rival))
            else {
                continue;
            };
            let mut rest = catch.choice.effects();
            rest.retain(|effect| *effect != one.effect && self.candidates.contains(effect));
            for (truth, rival) in [(one.effect, rival), (rival, one.effect)] {
                let values = self.typical_fit(&rest, truth);
                promises.extend(promise::promise((truth, &values), rival, levels, step_s));
            }
        }
        promises
    }

    /// An effect's values beside the rest, with a prior of its typical size: what the recording does not fix stays
    /// small, where a wide prior would let it wander and promise too much.
    fn typical_fit(&self, rest: &[usize], effect: usize) -> Vec<f64> {
        let information = self.bench.information();
        let own = self.parameters.of(effect);
        let mut set = self.parameters.of_all(rest);
        set.extend(own.clone());
        set.extend(self.parameters.count()..information.right.len());
        let typical = hypotheses::CATALOGUE[effect].card().typical;
        let solution = information.solve(&set, &|index| match own.contains(&index) {
            true => typical,
            false => prior_width(self.parameters, &information, index),
        });
        let values = set.iter().zip(solution.values.iter());
        values
            .filter(|(index, _)| own.contains(index))
            .map(|(_, value)| *value)
            .collect()
    }

    /// A clock or frame far off stands behind every fit; here it takes its name.
    fn name_the_lie(&self, catch: &mut Catch) {
        let Some(lie) = self.lie else { return };
        let information = self.bench.information();
        let set = catch.choice.effects();
        let (values, covariance) = super::hunt::fit(self.bench, self.parameters, &set);
        let first = self.parameters.count();
        let at = |place: usize| {
            values
                .iter()
                .position(|(index, _)| *index == first + place)
                .expect("always fitted")
        };
        let places = |wanted: &dyn Fn(&Behind) -> bool| -> Vec<usize> {
            let behind = self.bench.behind().enumerate();
            behind
                .filter(|(_, behind)| wanted(behind))
                .map(|(place, _)| place)
                .collect()
        };
        let known = &self.prepared.lie;
        let delay = places(&|behind| matches!(behind, Behind::Delay));
        let turn = places(&|behind| matches!(behind, Behind::Turn(_)));
        let turned = lie.turn_rad - known.turn_rad;
        for (kind, places, found) in [
            ("reference_delay", delay, vec![lie.delay_s - known.delay_s]),
            (
                "reference_misalignment",
                turn,
                vec![turned.x, turned.y, turned.z],
            ),
        ] {
            let Some((effect, entry)) = hypotheses::find(kind) else {
                continue;
            };
            if places.is_empty() {
                continue;
            }
            let rest: Vec<f64> = places.iter().map(|place| values[at(*place)].1).collect();
            let values = DVector::from_fn(places.len(), |k, _| found[k] + rest[k]);
            let covariance = DMatrix::from_fn(places.len(), places.len(), |a, b| {
                covariance[(at(places[a]), at(places[b]))]
            });
            // What nothing there would cost: the whole of it against its own information.
            let gain = 0.5
                * (0..places.len())
                    .map(|k| {
                        let index = first + places[k];
                        values[k].powi(2) * information.fisher[(index, index)]
                    })
                    .sum::<f64>();
            let indistinguishable_from = entry
                .card()
                .special_case_of
                .iter()
                .filter_map(|kind| hypotheses::find(kind).map(|(effect, _)| effect))
                .collect();
            catch.choice.chosen.push(Chosen {
                effect,
                values,
                covariance,
                log_evidence_gain: gain,
                p_value: 0.0,
                indistinguishable_from,
                unlisted_rival: None,
                harmonic_rival: false,
                gravity_speaks_against: Vec::new(),
            });
            catch.regimes.push(crate::invariance::Verdict {
                amplitudes: Vec::new(),
                p_value: 1.0,
            });
        }
    }

    /// An attitude reference that reads too much is the gyros that read too little.
    fn name_scales(&self, catch: &mut Catch) {
        let of = |kind: &str| hypotheses::find(kind).map(|(effect, _)| effect);
        let (Some(gyro), Some(reference)) = (of("gyro_scale"), of("reference_scale")) else {
            return;
        };
        for one in &mut catch.choice.chosen {
            if one.effect == gyro {
                one.indistinguishable_from.push(reference);
            }
        }
    }

    fn validations(
        &self,
        left_rad: &[Vector3<f64>],
        locations: &[crate::locate::Location],
    ) -> Vec<crate::validate::Validation> {
        let (record, cut) = self.after;
        let levels = &self.bench.levels;
        let after = judge::validate(record, cut, levels, [left_rad, left_rad], locations);
        let (record, cut) = self.before;
        let error_rad = &record.error_rad;
        let before = judge::validate(record, cut, levels, [error_rad, error_rad], locations);
        let pairs = before.into_iter().zip(after);
        pairs
            .map(|(before, after)| crate::validate::Validation {
                before: before.before,
                ..after
            })
            .collect()
    }

    /// The levels as noise of the gyros' rows.
    fn noise(&self) -> [Noise; 3] {
        let levels = &self.bench.levels;
        let rate_hz = self.prepared.scene.streams.rate_hz;
        [0, 1, 2].map(|axis: usize| Noise {
            theta: [
                levels.walk_rad2_s[axis] / rate_hz,
                levels.gyro_white_rad2[axis] + levels.reference_white_rad2,
                0.0,
                0.0,
            ],
            rate_hz,
        })
    }

    /// Random walk beyond the declared one, which the levels' fit keeps unless it is contradicted.
    fn excess(&self, catch: &Catch, left_rad: &[Vector3<f64>]) -> Vec<Excess> {
        let levels = &self.bench.levels;
        let declared = &self.prepared.declared;
        let more = [0, 1, 2].map(|axis: usize| {
            declared.walk_rad2_s[axis]
                .filter(|walk| levels.walk_rad2_s[axis] > LEAST_EXCESS * walk)
                .map_or(0.0, |walk| levels.walk_rad2_s[axis] - walk)
        });
        if more == [0.0; 3] {
            return Vec::new();
        }
        // 2 Δ ln L over the same with the declared walk of one gyro.
        let scored = self.bench.scorer(&catch.choice.effects(), levels);
        let best = self.bench.score(levels, &scored);
        let ratios = [0, 1, 2].map(|axis: usize| {
            let walk = declared.walk_rad2_s[axis].filter(|_| more[axis] > 0.0);
            walk.map_or(0.0, |walk| {
                let mut held = *levels;
                held.walk_rad2_s[axis] = walk;
                2.0 * (best - self.bench.score(&held, &scored)).max(0.0)
            })
        });
        // Known from n steps a level is r times too high with 2 Δ ln L = n (r − 1 − ln r), and scatters by √(2/n) of
        // itself; d√x = dx/(2√x).
        let stds = [0, 1, 2].map(|axis: usize| {
            let (walk, of_declared) = (levels.walk_rad2_s[axis], more[axis]);
            if of_declared == 0.0 {
                return 0.0;
            }
            let times = walk / (walk - of_declared);
            let steps = (ratios[axis] / (times - 1.0 - times.ln())).max(1.0);
            0.5 * walk * (2.0 / steps).sqrt() / of_declared.sqrt()
        });
        let strongest = ratios.into_iter().fold(0.0, f64::max);
        // What the imperfect columns of strong effects leave looks like a walk.
        if ratios.iter().sum::<f64>() < REGRESSOR_FIDELITY.powi(2) * self.explained(left_rad) {
            return Vec::new();
        }
        let chance = 0.5 * ChiSquared::new(1.0).map_or(1.0, |law| law.sf(strongest));
        vec![Excess {
            p_value: (3.0 * chance).min(1.0),
            log_likelihood_gain: 0.5 * ratios.iter().sum::<f64>(),
            kind: "angle_random_walk",
            indistinguishable_from: &["lock_in"],
            equation: "angle random walk beyond the model's, added in square",
            unit: "rad/sqrt(s)",
            values: more.map(f64::sqrt),
            stds,
            left_out: "The attitudes drift apart at random faster than the model's random walks of gyros and reference allow.",
        }]
    }

    /// Whitened power of what was found, by what it leaves.
    fn explained(&self, left_rad: &[Vector3<f64>]) -> f64 {
        let pairs = self.bench.error_rad().iter().zip(left_rad);
        let found: Vec<Vector3<f64>> = pairs.map(|(all, left)| all - left).collect();
        let whitened = self.bench.whitener().whiten(&found);
        whitened.iter().map(|value| value * value).sum()
    }

    fn pictures(
        &self,
        left_rad: &[Vector3<f64>],
        tiles_before: Vec<Tile>,
        tiles_after: Vec<Tile>,
    ) -> Pictures {
        let (record, cut) = self.after;
        let (angle_before, growth_before) = by_gyro(self.before.0, &self.before.0.error_rad);
        let (angle_after, growth_after) = by_gyro(record, left_rad);
        let step_s = judge::median_step_s(record);
        /// Steps alike to this share have a spectrum.
        const ALIKE: f64 = 0.01;
        let alike = record
            .steps
            .iter()
            .skip(1)
            .all(|step| (step.seconds / step_s - 1.0).abs() < ALIKE);
        let rate_hz = 1.0 / step_s;
        let piece = (record.stamps() / 4).clamp(2, 512) & !1;
        // One-sided density of a rate: increments' power per step × 2 / fs × fs².
        let density = 2.0 * rate_hz;
        let spectrum = |growth: &Triad| {
            [0, 1, 2].map(|axis: usize| match alike {
                true => mean_periodogram(&growth[axis], piece)[1..]
                    .iter()
                    .map(|power| density * power)
                    .collect(),
                false => Vec::new(),
            })
        };
        let (power_before, power_after) = (spectrum(&growth_before), spectrum(&growth_after));
        let frequency_hz: Vec<f64> = (0..power_after[0].len())
            .map(|bin| (bin + 1) as f64 * rate_hz / piece as f64)
            .collect();
        let levels = &self.bench.levels;
        let streams = &self.prepared.scene.streams;
        Pictures {
            time_s: record.times_s.clone(),
            angle_before_rad: angle_before.map(|angle| resized(angle, record.stamps())),
            angle_after_rad: angle_after,
            power_noise: [0, 1, 2].map(|axis: usize| {
                let noise = Noise {
                    theta: [
                        levels.walk_rad2_s[axis] / rate_hz,
                        levels.gyro_white_rad2[axis] + levels.reference_white_rad2,
                        0.0,
                        levels.drift_rad2_s3[axis] * step_s.powi(3),
                    ],
                    rate_hz,
                };
                let lowest = frequency_hz.first().copied().unwrap_or(rate_hz);
                frequency_hz
                    .iter()
                    .map(|f| density * noise.at(*f, lowest))
                    .collect()
            }),
            frequency_hz,
            power_before,
            power_after,
            tiles_before,
            tiles_after,
            held_out_s: Cut::rows(record, &cut.held_out)
                .into_iter()
                .map(|rows| [rows.start, rows.end].map(|row| streams.begin_s(row)))
                .collect(),
            rate_hz: streams.rate_hz,
            start_s: streams.start_s,
        }
    }
}

/// The growth of the error in the body frame, and its sum.
fn by_gyro(record: &Record, error_rad: &[Vector3<f64>]) -> (Triad, Triad) {
    let mut sum = Vector3::zeros();
    let (mut angle, mut growth): (Triad, Triad) = Default::default();
    for stamp in 0..record.stamps() {
        let step = if record.broken[stamp] {
            Vector3::zeros()
        } else {
            let grown = error_rad[stamp] - error_rad[stamp - 1];
            record.steps[stamp].start_from_body.transpose() * grown
        };
        sum += step;
        for axis in 0..3 {
            angle[axis].push(sum[axis]);
            growth[axis].push(step[axis]);
        }
    }
    (angle, growth)
}

/// A clock that moved may have lost or gained a stamp at the end.
fn resized(mut values: Vec<f64>, length: usize) -> Vec<f64> {
    let last = values.last().copied().unwrap_or(0.0);
    values.resize(length, last);
    values
}
