//! Findings in the terms of `diagnosis.json`, the report and the updated model.

use rlg_plan::Plan;
use std::collections::BTreeSet;
use std::ops::Range;

use rlg_catalogue::Column;
use rlg_catalogue::signals::AXES;
use rlg_findings::absolute;
use rlg_findings::entries::noise as noise_entry;
use rlg_findings::excess::{Excess, WALK};
use rlg_findings::result::{
    Diagnosis, EffectEntry, FORMAT, FitEntry, LocationEntry, NoiseEntry, ResidualEntry, Verdict,
};
use rlg_findings::updated_model::switch_on;
use rlg_inference::events::scan;
use rlg_inference::transform::Transform;
use rlg_inference::{Drift, Fit, NoiseLevels};
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::fault::Fault;
use rlg_signal::in_step::{self, Block, in_step};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Streams, Triad, add_triad};
use statrs::distribution::{ContinuousCDF, Normal};

use super::entries_of_findings::{effect_of, entry};
use super::finding::{Finding, card, findings};
use super::own_lines;
use super::summary::{not_excluded, runners_up, summary, unlike_noise};
use crate::candidates::lock_in::behind_walk;
use crate::confirm::Share;
use crate::outcome::Outcome;
use crate::report::next_experiment::next_experiment;
use crate::residual::excess_noise::excess;
use crate::residual::relative_residual::{self, Rows};
use crate::residual::unexplained::unexplained;
use crate::rows::data::Data;
use crate::rows::entries_of_rows::{channel, fault_effect, fault_entry};
use crate::rows::noise_levels::reported;
use crate::search::structure::{Found, Searched};
use crate::tiles::held_out_figures::{Validation, validate};
use crate::tiles::locate::{self, Location, Tile};
use crate::tiles::noise_spectrum::Noise;
use crate::tiles::pictures;
use crate::tiles::regimes::{Regime, regimes_of};

/// Writes the outcome of a confirmed set.
pub fn outcome(of: Searched, share: &Share, faults: &[Fault], seed: u64, plan: &Plan) -> Outcome {
    written(of, share, faults, seed, plan).0
}

/// Writes the outcome of a confirmed set, with the effects added to its model.
///
/// # Returns
/// The outcome, and the effects added to its model, named ones first.
pub(crate) fn written(
    of: Searched,
    share: &Share,
    faults: &[Fault],
    seed: u64,
    plan: &Plan,
) -> (Outcome, Vec<ModelEffect>) {
    let results = Results::new(of, share, faults, plan);
    let diagnosis = results.diagnosis(seed);
    let added = results.added();
    let mut model = of.data.model.clone();
    for effect in &added {
        switch_on(&mut model, effect.clone());
    }
    let Results { seen, places, .. } = results;
    let pictures = pictures::draw(
        of.data.streams,
        &seen.before_rad,
        &seen.after_rad,
        &seen.noise,
        (places.tiles, &plan.judgement.tiles),
        &places.test_rows,
    );
    let outcome = Outcome {
        diagnosis,
        model,
        pictures: Some(pictures),
    };
    (outcome, added)
}

/// Results of a confirmed set.
struct Results<'a> {
    of: Searched<'a>,
    share: &'a Share,
    /// Faults of the data.
    faults: &'a [Fault],
    plan: &'a Plan,
    seen: Seen,
    findings: Vec<Finding<'a>>,
    places: Places,
    /// Gyros whose residual is not noise: no noise level is defined there.
    unlike: BTreeSet<usize>,
    /// Noise in excess of its known level.
    noise_found: Vec<Excess>,
    /// Lines of the gyros alone, as entries and as effects of the model.
    own_lines: Vec<(EffectEntry, ModelEffect)>,
}

/// Residual beside the motion; without blocks at rest, where there is none.
struct BesideMotion {
    /// Powers of both by blocks of time.
    blocks: Vec<Block>,
    residual: Option<ResidualEntry>,
}

impl<'a> Results<'a> {
    fn new(of: Searched<'a>, share: &'a Share, faults: &'a [Fault], plan: &'a Plan) -> Self {
        let Searched { data, found } = of;
        let streams = data.streams;
        let (fit, left_rad) = (&share.set.fit, &share.left_rad);
        let seen = Seen {
            before_rad: data.aside.with_all(&found.residual_rad),
            after_rad: data.aside.with_unexplained(left_rad),
            noise: std::array::from_fn(|axis| {
                reported(fit.levels[axis], streams.rows, streams.rate_hz)
            }),
            regimes: regimes_of(streams, &plan.judgement.regimes),
        };
        let findings = findings(of, share, &seen.regimes, plan);
        let places = seen.places(data, &findings, plan);
        let unlike: BTreeSet<usize> = share.misfits.iter().map(|one| one.gyro).collect();
        let locks_in = lock_ins(&findings, data, found);
        let mut explained_rad = Triad::clone(&found.residual_rad);
        add_triad(&mut explained_rad, left_rad, -1.0);
        let noise_found = excess(
            data,
            fit,
            &found.motion,
            (&unlike, &locks_in),
            &explained_rad,
            plan,
        );
        Self {
            of,
            share,
            faults,
            plan,
            seen,
            findings,
            places,
            unlike,
            noise_found,
            own_lines: own_lines::entries(
                &data.own_lines,
                streams.rows,
                streams.rate_hz,
                data.model,
            ),
        }
    }

    /// Entries of effects, of noise, of unexplained power and of faults.
    fn effects(&self) -> Vec<EffectEntry> {
        let data = self.of.data;
        let streams = data.streams;
        let findings = self.findings.iter();
        let of_noise = |one: &Excess| {
            let mut entry = noise_entry(one);
            let lock_in = (one.kind == WALK.kind).then(|| behind_walk(one.values, data));
            entry.what_was_left_out.extend(lock_in.flatten());
            entry
        };
        findings
            .map(|one| entry(one, &self.share.set.fit, self.of))
            .chain(self.noise_found.iter().map(of_noise))
            .chain(self.own_lines.iter().map(|(entry, _)| entry.clone()))
            .chain(unexplained(&self.places.left, streams))
            .chain(self.faults.iter().map(|fault| fault_entry(streams, fault)))
            .collect()
    }

    fn verdict(&self) -> Verdict {
        let set = &self.share.set;
        // A fit to some rows and not to others explains nothing.
        let is_consistent = set.unconfirmed.is_empty()
            && set.impossible.is_empty()
            && self.places.left.is_empty()
            && self.share.misfits.is_empty()
            && !has_event(self.of.data, &set.fit, &self.share.left_rad, self.plan);
        let is_explained = !self.findings.is_empty()
            || !self.own_lines.is_empty()
            || !self.noise_found.is_empty()
            || !self.faults.is_empty();
        Verdict::of(is_explained, is_consistent)
    }

    fn beside_motion(&self) -> BesideMotion {
        let Searched { data, found } = self.of;
        let is_used = data.rows_of(&[Use::Fit, Use::Test]);
        let rows = Rows {
            residual_rad: &self.seen.after_rad,
            motion_rad: &found.motion.signals.independent.case_rad,
            is_used: &|row| is_used[row],
            period_s: 1.0 / data.streams.rate_hz,
        };
        let plan = &self.plan.signal;
        let blocks = match data.streams.at_rest {
            Some(_) => Vec::new(),
            None => in_step::blocks(
                rows.residual_rad,
                rows.motion_rad,
                rows.is_used,
                rows.period_s,
                &plan.in_step,
            ),
        };
        let residual = relative_residual::entry(&rows, &blocks, &plan.coherence);
        BesideMotion { blocks, residual }
    }

    fn summary(&self, verdict: Verdict, residual: Option<&ResidualEntry>) -> Vec<String> {
        let rate_hz = self.of.data.streams.rate_hz;
        let own_lines = self.own_lines.iter();
        let unlike = self.unlike.iter();
        summary(verdict, &self.findings, &self.share.set, self.of.found)
            .into_iter()
            .chain(own_lines.map(|(entry, _)| own_lines::sentence(entry)))
            .chain(unlike.filter_map(|&gyro| unlike_noise(gyro, &self.share.misfits, rate_hz)))
            .chain(residual.map(|one| absolute::beside_motion(one.share_of_motion)))
            .collect()
    }

    fn diagnosis(&self, seed: u64) -> Diagnosis {
        let Searched { data, found } = self.of;
        let streams = data.streams;
        let places = &self.places;
        let span = |rows: &Range<usize>| [streams.begin_s(rows.start), streams.begin_s(rows.end)];
        let locations = places.locations.iter();
        let set = &self.share.set;
        let next = next_experiment(self.of, set, &self.findings, self.plan);
        let BesideMotion { blocks, residual } = self.beside_motion();
        let verdict = self.verdict();
        let mut diagnosis = Diagnosis {
            format: FORMAT,
            recording: streams.piece.recording.clone(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            seed,
            verdict,
            summary: self.summary(verdict, residual.as_ref()),
            locations: locations.map(|one| location_entry(one, streams)).collect(),
            effects: self.effects(),
            fit: FitEntry {
                fitted_on: places.fitted_rows.iter().map(span).collect(),
                held_out: places.test_rows.iter().map(span).collect(),
                recordings: Vec::new(),
                whole: None,
                channels: places.validations.iter().map(channel).collect(),
            },
            not_excluded: not_excluded(found, streams),
            next_experiment: next.sentence,
            registration: Vec::new(),
            experiment: next.entry,
            residual,
            noise: noise_entries(&set.fit, &self.seen.noise, streams.span_s()),
            accelerometer_noise: Vec::new(),
            trials: found.tried,
            runners_up: runners_up(found),
            sensitivity: Vec::new(),
            control: None,
            self_test: None,
            plan: Vec::new(),
        };
        if let Some(found) = in_step(&blocks, &self.plan.signal.in_step) {
            diagnosis.mark_unexplained(vec![absolute::in_step(
                found.share,
                found.moving_over_still,
            )]);
        }
        diagnosis
    }

    /// Effects added to the model, named ones first.
    fn added(&self) -> Vec<ModelEffect> {
        let fit = &self.share.set.fit;
        let streams = self.of.data.streams;
        let findings = self.findings.iter();
        findings
            .map(|one| effect_of(one, fit, self.of))
            .chain(self.noise_found.iter().map(noise_effect))
            .chain(self.faults.iter().map(|fault| fault_effect(fault, streams)))
            .chain(self.own_lines.iter().map(|(_, effect)| effect.clone()))
            .collect()
    }
}

/// Residuals and noise of a set.
struct Seen {
    /// Residuals of the model and of the set \[rad\].
    before_rad: Triad,
    after_rad: Triad,
    noise: [Noise; 3],
    regimes: Vec<Regime>,
}

/// Locations of a residual beyond its noise, and figures of a set on held-out rows.
struct Places {
    fitted_rows: Vec<Range<usize>>,
    test_rows: Vec<Range<usize>>,
    /// Tiles before and after the set.
    tiles: (Vec<Tile>, Vec<Tile>),
    locations: Vec<Location>,
    /// Locations in the residual of the set.
    left: Vec<Location>,
    validations: Vec<Validation>,
}

impl Seen {
    fn places(&self, data: &Data, findings: &[Finding], plan: &Plan) -> Places {
        let streams = data.streams;
        let tile_plan = &plan.judgement.tiles;
        let (noise, regimes) = (&self.noise, &self.regimes);
        let all_rows = data.ranges_of(&[Use::Fit, Use::Test]);
        let fitted_rows = data.ranges_of(&[Use::Fit]);
        let test_rows = data.ranges_of(&[Use::Test]);
        let tiles_of = |residual_rad: &Triad, rows: &[Range<usize>]| {
            locate::tiles(streams, residual_rad, noise, regimes, rows, tile_plan)
        };
        let before = tiles_of(&self.before_rad, &all_rows);
        let mut locations = locate::join(&before, regimes, &all_rows, tile_plan);
        // The residual is tested on the fitted rows: test rows change no finding.
        let after_fitted = tiles_of(&self.after_rad, &fitted_rows);
        let mut left = locate::join(&after_fitted, regimes, &fitted_rows, tile_plan);
        left.retain(|one| !data.lattice.hides_location(one, streams.rate_hz));
        name_regimes(&mut locations, findings);
        Places {
            tiles: (before, tiles_of(&self.after_rad, &all_rows)),
            validations: validate(
                &self.before_rad,
                &self.after_rad,
                noise,
                (&test_rows, streams.band_hz(&plan.long)),
                &locations,
                streams.rate_hz,
                &plan.judgement.held_out,
            ),
            fitted_rows,
            test_rows,
            locations,
            left,
        }
    }
}

/// Gyros with lock-in, by the model or by the findings.
fn lock_ins(findings: &[Finding], data: &Data, found: &Found) -> BTreeSet<usize> {
    let columns_found = findings.iter().flat_map(|one| {
        let fixed = one.candidate.hypothesis.fixed.iter();
        fixed.map(|one| found.pool.columns[one.column].column)
    });
    let columns = data.known.iter().map(|(_, sensed, _)| sensed.column);
    columns
        .chain(columns_found)
        .filter_map(|column| match column {
            Column::LockIn(gyro, ..) => Some(gyro),
            _ => None,
        })
        .collect()
}

fn noise_entries(fit: &Fit, noise: &[Noise; 3], span_s: f64) -> Vec<NoiseEntry> {
    let of = |axis: usize| NoiseEntry {
        channel: format!("gyro_{}", AXES[axis]),
        angle_random_walk_rad_sqrt_s: noise[axis].angle_random_walk_rad_sqrt_s(),
        angle_noise_rad: noise[axis].angle_noise_rad(),
        wandering_rad_s: (fit.drift[axis] != Drift::None).then(|| noise[axis].wander_rad_s(span_s)),
        terms: None,
    };
    (0..3).map(of).collect()
}

/// True if a step or a slip is significant in any row, rows to test included: too late for a name, but the
/// residual is then not the fitted noise.
fn has_event(data: &Data, fit: &Fit, after_rad: &Triad, plan: &Plan) -> bool {
    let Ok(observations) = data.observed(&data.rows_of(&[Use::Fit, Use::Test])) else {
        return false;
    };
    let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(&fit.levels));
    (0..3).any(|gyro| {
        let spectrum = transform.spectrum(&after_rad[gyro]);
        let events = scan(
            &transform,
            &basis,
            &spectrum,
            fit.levels[gyro],
            &plan.inference.events,
        );
        events.iter().any(|event| {
            let places = 3.0 * data.streams.rows as f64;
            let chance = 2.0 * places * Normal::standard().sf(event.size.abs());
            chance < plan.judgement.unexplained && !data.lattice.hides_event(gyro, event)
        })
    })
}

fn noise_effect(excess: &Excess) -> ModelEffect {
    let values = AXES.iter().zip(excess.values);
    ModelEffect {
        kind: excess.kind.to_string(),
        parameters: values
            .map(|(axis, value)| ((*axis).to_string(), EffectValue::Number(value)))
            .collect(),
    }
}

/// Names the regime of every location by the finding of the largest size on its gyro.
fn name_regimes(locations: &mut [Location], findings: &[Finding]) {
    for location in locations {
        let acts = |one: &&Finding| {
            let mut terms = one.candidate.hypothesis.terms.iter();
            terms.any(|term| term.record == location.axis)
        };
        let strongest = findings
            .iter()
            .filter(acts)
            .max_by(|a, b| a.squared_size.total_cmp(&b.squared_size));
        if let Some(one) = strongest {
            location.regime = format!("follows {}", card(one.candidate.kind).equation);
        }
    }
}

pub(crate) fn location_entry(location: &Location, streams: &Streams) -> LocationEntry {
    let [start_s, end_s] = streams.span_of(&location.rows);
    LocationEntry {
        channel: format!("gyro_{}", AXES[location.axis]),
        recording: None,
        start_s,
        end_s,
        low_hz: location.band_hz.0,
        high_hz: location.band_hz.1,
        regime: location.regime.clone(),
        size: location.size_rad_s,
        unit: "rad/s".to_string(),
        p_value: location.p_value,
        coherent_with: Vec::new(),
    }
}
