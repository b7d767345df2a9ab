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
    Diagnosis, EffectEntry, FORMAT, FitEntry, LocationEntry, NoiseEntry, Verdict,
};
use rlg_findings::updated_model::switch_on;
use rlg_inference::events::scan;
use rlg_inference::transform::Transform;
use rlg_inference::{Drift, Fit, NoiseLevels};
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::fault::Fault;
use rlg_signal::in_step::{self, in_step};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Streams, Triad, add_triad};
use statrs::distribution::{ContinuousCDF, Normal};

use super::confirm::Share;
use super::data::Data;
use super::entries_of_findings::{effect_of, entry};
use super::entries_of_rows::{channel, fault_effect, fault_entry};
use super::excess_noise::excess;
use super::finding::{Finding, card, findings};
use super::left::unexplained;
use super::locate::{self, Location, Tile};
use super::lock_in::behind_walk;
use super::next_experiment::next_experiment;
use super::noise_levels::reported;
use super::noise_spectrum::Noise;
use super::outcome::Outcome;
use super::own_lines;
use super::pictures;
use super::regimes::{Regime, regimes_of};
use super::relative_residual::{self, Rows};
use super::search::{Found, Searched};
use super::summary::{not_excluded, runners_up, summary, unlike_noise};
use super::validate::{Validation, validate};

/// Writes the outcome of a confirmed set.
pub fn outcome(of: Searched, share: &Share, faults: &[Fault], seed: u64, plan: &Plan) -> Outcome {
    written(of, share, faults, seed, plan).0
}

/// Writes the outcome of a confirmed set, with the effects added to its model.
///
/// # Returns
/// The outcome, and the effects added to its model, named ones first.
pub(super) fn written(
    of: Searched,
    share: &Share,
    faults: &[Fault],
    seed: u64,
    plan: &Plan,
) -> (Outcome, Vec<ModelEffect>) {
    let Searched { data, found } = of;
    let streams = data.streams;
    let Share {
        set: confirmed,
        left_rad,
        misfits,
        ..
    } = share;
    let fit = &confirmed.fit;
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
    // No noise level is defined where the residual is not noise.
    let unlike: BTreeSet<usize> = misfits.iter().map(|one| one.gyro).collect();
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

    let mut effects: Vec<EffectEntry> = findings.iter().map(|one| entry(one, fit, of)).collect();
    effects.extend(noise_found.iter().map(|one| {
        let mut entry = noise_entry(one);
        let lock_in = (one.kind == WALK.kind).then(|| behind_walk(one.values, data));
        entry.what_was_left_out.extend(lock_in.flatten());
        entry
    }));
    let own = own_lines::entries(&data.own_lines, streams.rows, streams.rate_hz, data.model);
    effects.extend(own.iter().map(|(entry, _)| entry.clone()));
    effects.extend(unexplained(&places.left, streams));
    // A fit to some rows and not to others explains nothing.
    let is_consistent = confirmed.unconfirmed.is_empty()
        && confirmed.impossible.is_empty()
        && places.left.is_empty()
        && misfits.is_empty()
        && !has_event(data, fit, left_rad, plan);
    let is_explained =
        !findings.is_empty() || !own.is_empty() || !noise_found.is_empty() || !faults.is_empty();
    let verdict = verdict(is_explained, is_consistent);
    effects.extend(faults.iter().map(|fault| fault_entry(streams, fault)));
    let span =
        |rows: &std::ops::Range<usize>| [streams.begin_s(rows.start), streams.begin_s(rows.end)];
    let next = next_experiment(of, confirmed, &findings, plan);
    let motion_rad = &found.motion.signals.independent.case_rad;
    let is_used = data.rows_of(&[Use::Fit, Use::Test]);
    let rows = Rows {
        residual_rad: &seen.after_rad,
        motion_rad,
        is_used: &|row| is_used[row],
        period_s: 1.0 / streams.rate_hz,
    };
    // A unit at rest has no motion.
    let beside_motion = match streams.at_rest {
        Some(_) => Vec::new(),
        None => in_step::blocks(
            rows.residual_rad,
            motion_rad,
            rows.is_used,
            rows.period_s,
            &plan.signal.in_step,
        ),
    };
    let relative_residual = relative_residual::entry(&rows, &beside_motion, &plan.signal.coherence);
    let mut diagnosis = Diagnosis {
        format: FORMAT,
        recording: streams.piece.recording.clone(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        seed,
        verdict,
        summary: summary(verdict, &findings, confirmed, found)
            .into_iter()
            .chain(own.iter().map(|(entry, _)| own_lines::sentence(entry)))
            .chain(
                unlike
                    .iter()
                    .filter_map(|&gyro| unlike_noise(gyro, misfits, streams.rate_hz)),
            )
            .chain(
                relative_residual
                    .iter()
                    .map(|one| absolute::beside_motion(one.share_of_motion)),
            )
            .collect(),
        locations: places
            .locations
            .iter()
            .map(|one| location_entry(one, streams))
            .collect(),
        effects,
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
        residual: relative_residual.clone(),
        noise: noise_entries(fit, &seen.noise, streams.span_s()),
        accelerometer_noise: Vec::new(),
        trials: found.tried,
        runners_up: runners_up(found),
        sensitivity: Vec::new(),
        control: None,
        self_test: None,
        plan: Vec::new(),
    };
    if let Some(found) = in_step(&beside_motion, &plan.signal.in_step) {
        diagnosis.is_left(vec![absolute::in_step(
            found.share,
            found.moving_over_still,
        )]);
    }
    let mut model = data.model.clone();
    let mut added = added(of, fit, &findings, &noise_found, faults);
    added.extend(own.into_iter().map(|(_, effect)| effect));
    for effect in &added {
        switch_on(&mut model, effect.clone());
    }
    let pictures = pictures::draw(
        streams,
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

fn verdict(is_explained: bool, is_consistent: bool) -> Verdict {
    match (is_explained, is_consistent) {
        (false, true) => Verdict::Matches,
        (false, false) => Verdict::Unexplained,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
    }
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

/// Effects added to the model, named ones first.
fn added(
    of: Searched,
    fit: &Fit,
    findings: &[Finding],
    noise_found: &[Excess],
    faults: &[Fault],
) -> Vec<ModelEffect> {
    let of_findings = findings.iter().map(|one| effect_of(one, fit, of));
    let of_faults = faults
        .iter()
        .map(|fault| fault_effect(fault, of.data.streams));
    of_findings
        .chain(noise_found.iter().map(noise_effect))
        .chain(of_faults)
        .collect()
}

/// True if a step or a slip is significant in any row, rows to test included: too late for a name, but the
/// residual is then not the fitted noise.
fn has_event(data: &Data, fit: &Fit, after_rad: &Triad, plan: &Plan) -> bool {
    let Some(observations) = data.observed(&data.rows_of(&[Use::Fit, Use::Test])) else {
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
