//! Workflow of a diagnosis against attitudes.

use rlg_diagnosis::Settings;

use nalgebra::Vector3;
use rlg_catalogue::Pool;
use rlg_catalogue::entries::PULL;
use rlg_diagnosis::Outcome;
use rlg_diagnosis::put_right::{self, PutRight, Stopped};
use rlg_model::{DeclaredModel, Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording};
use rlg_signal::attitude_samples::has_attitude;
use rlg_signal::axes::Triad;
use rlg_signal::channels::SAME_ROW;
use rlg_signal::streams::Streams;

use crate::about::{About, Gyros};
use crate::alignment::{Alignment, Free, places};
use crate::case_motion;
use crate::channels;
use crate::choice::{Candidates, Named};
use crate::coarse::Start;
use crate::equations::ParameterColumn;
use crate::few::{AtRest, FewRows, NoiseBelief};
use crate::few_search::{self, FewFound};
use crate::findings;
use crate::fitting::priced;
use crate::growth::Growth;
use crate::gyro_times;
use crate::late_gyros;
use crate::observed::{Observed, observe};
use crate::own_lines;
use crate::physics::{self, Gyro};
use crate::registration::{self, Registration};
use crate::rest::{self, Rest};
use crate::said::{Few, Said};
use crate::search::{Found, Physics, Registered, called_for, search};
use crate::zeroing;

/// A diagnosis and the corrected motion.
pub struct Diagnosed {
    /// Findings on the gyros.
    pub outcome: Outcome,
    /// Channels with the case's motion measured by the gyros, less their identified errors; else the reason of its absence.
    pub corrected: Result<Streams, String>,
}

/// True if the reference of a recording gives attitudes, or increments on other rows than the gyros'.
pub fn serves(recording: &Recording, model: &Model) -> bool {
    if model.motion != MotionSource::Reference {
        return false;
    }
    let mut gyros = Quantity::GYROS.iter();
    let gyro = gyros.find_map(|quantity| recording.channel(quantity, "x"));
    let reference = recording.channel(&Quantity::ReferenceIncrement, "x");
    let clocks = gyro.zip(reference).map(|((gyro, _), (reference, _))| {
        let clocks = (&gyro.clock, &reference.clock);
        (clocks, gyro.rows)
    });
    let Some((
        (
            Clock::Uniform { rate_hz, start_s },
            Clock::Uniform {
                rate_hz: own_hz,
                start_s: own_s,
            },
        ),
        rows,
    )) = clocks
    else {
        return has_attitude(recording);
    };
    let drift_rows = (own_hz - rate_hz) / rate_hz * rows as f64;
    let offset_rows = (own_s - start_s) * rate_hz;
    drift_rows.abs() >= SAME_ROW || (offset_rows - offset_rows.round()).abs() >= SAME_ROW
}

/// Diagnoses a recording; `None` if fewer than two attitudes lie within the gyros' record.
///
/// # Errors
/// The recording lacks a channel or its attitudes are invalid; the model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    recording: &Recording,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Option<Diagnosed>, InputError> {
    let model = of.model;
    progress("aligning the channels");
    let Some(mut observed) = observe(recording, of, &settings.plan)? else {
        return Ok(None);
    };
    let of_model = Alignment::of_model(model);
    let mut put_right = None;
    if !observed.is_few {
        observed.take_settling(&of_model, &settings.plan);
        put_right = match check_channels(settings, &mut observed, of) {
            Err(Stopped::Apart(why, _)) => {
                let outcome =
                    put_right::of_two_motions(&recording.name, settings.seed, &why, model);
                return Ok(Some(Diagnosed {
                    outcome,
                    corrected: Err(why),
                }));
            }
            checked => checked?,
        };
    }
    if !observed.is_few {
        let rows = channels::reference_rows(
            &observed.sound_samples(),
            &observed.streams,
            &settings.plan.attitude.rows,
        );
        let seen = observed.fitted_rows(&rows.doubtful);
        let reference = (&rows.increments_rad, &seen[..]);
        observed.zeroed =
            zeroing::find(&observed.gyros, reference, &settings.plan.attitude.zeroing);
        zeroing::undo(&mut observed.gyros, zeroing::high_passes(&observed.zeroed));
        let lines = own_lines::of(&observed, reference, &settings.plan.signal.own_lines);
        observed.take_lines(lines);
    }
    let fit = if observed.is_few { of_few } else { of_many };
    let Some(fitted) = fit(settings, &mut observed, &of_model, progress)? else {
        return Ok(None);
    };
    progress("writing the findings");
    let said = Said {
        observed: &observed,
        of_model: &of_model,
        registered: &fitted.registered,
        gyro: &fitted.gyro,
        pool: &fitted.pool,
        candidates: &fitted.candidates,
        beyond: &fitted.registered.alignment.beyond(&of_model),
        found: &fitted.found,
        few: fitted.few.as_ref(),
        plan: &settings.plan,
        seed: settings.seed,
    };
    let mut outcome = findings::outcome(&said);
    let corrected_rad = case_motion::corrected_rad(&said);
    if let Some(put_right) = put_right {
        put_right.report(&mut outcome);
    }
    let mut streams = observed.streams;
    let corrected = corrected_rad.map(|case_rad| {
        streams.case_rad = case_rad;
        streams
    });
    Ok(Some(Diagnosed { outcome, corrected }))
}

/// A registration and the findings of the search.
struct Fitted {
    registered: Registration,
    gyro: Gyro,
    pool: Pool,
    candidates: Candidates,
    found: Found,
    few: Option<Few>,
}

/// Fits attitudes whose noise is estimated from their own residuals; once more where single gyros are late, after their rows are
/// moved.
fn of_many(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    /// Most moves: each leaves the square of what it is wrong by.
    const MOVES: usize = 3;
    let Some(mut fitted) = fit_many(settings, observed, of_model, progress)? else {
        return Ok(None);
    };
    for _ in 0..MOVES {
        let shown = settings.plan.attitude.late_gyro;
        let Some(late) = late_gyros::of(&fitted.found, &fitted.registered, shown) else {
            break;
        };
        progress("once more with the rows of late gyros moved");
        let before = (observed.gyros.clone(), observed.late);
        gyro_times::advance(&mut observed.gyros, late.values_s);
        observed.late.add(&late);
        let moved = fit_many(settings, observed, of_model, progress)?;
        // By row: what looked like faults of the reference has fewer.
        let by_row = |one: &Fitted| {
            let registered = &one.registered;
            registered.log_likelihood / registered.about.increments.rows() as f64
        };
        let least = by_row(&fitted);
        match moved.filter(|moved| by_row(moved) > least) {
            Some(moved) => fitted = moved,
            // A filter, and no delay.
            None => {
                (observed.gyros, observed.late) = before;
                break;
            }
        }
    }
    Ok(Some(fitted))
}

/// One fit of them.
fn fit_many(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    let start = Start::new(
        &observed.gyros,
        &observed.samples,
        &observed.stamps.left_out,
        of_model,
    );
    let called_for = |observed: &Observed, registered: &Registration| {
        let beyond = registered.alignment.beyond(of_model);
        let of = Registered::new(&observed.gyros, registered, of_model, &beyond);
        called_for(of, &settings.plan)
    };
    let grown = |observed: &Observed| {
        let growth = Growth {
            of: observed.records(),
            model: of_model,
            start: &start,
            called_for: &|registered| called_for(observed, registered),
            alike_within: settings.plan.attitude.alike_within,
            progress,
        };
        growth.grow()
    };
    let Some((mut registered, mut free)) = grown(observed) else {
        return Ok(None);
    };
    let mut gyro = observed.gyro(&registered.about)?;
    if !observed.is_without_known && observed.take_out(&gyro.known_rad(observed.model)) {
        progress("once more without what the model knows");
        let Some(again) = grown(observed) else {
            return Ok(None);
        };
        (registered, free) = again;
        gyro = observed.gyro(&registered.about)?;
    }
    observed.is_without_known = true;
    let (pool, effects) = gyro.candidates(settings.left_out);
    let candidates = Candidates::new(effects);
    let mut plan = settings.plan;
    let mut known = observed.model.effects.iter();
    if known.any(|effect| effect.kind == PULL) {
        // Computed from these gyros, the reference is no independent evidence of further effects.
        plan.attitude.most_effects = 0;
    }
    let searched = |registered: Registration, gyro: &Gyro, observed: &Observed| {
        progress("searching for physics");
        let physics = Physics {
            gyro,
            pool: &pool,
            candidates: &candidates,
        };
        let search = |of: Registered| search(of, physics, &plan, settings.seed);
        searched(&observed.gyros, registered, of_model, physics, search)
    };
    let mut found;
    (registered, found) = searched(registered, &gyro, observed);
    // Relinearise about the groups selected given physics: the remaining error is then within the linear range.
    let now = found.groups();
    if now != free {
        let start = registered.alignment.with(&now, of_model);
        let again = registration::settle(observed.records(), of_model, start, &now, true, progress);
        if let Some(again) = again {
            let rivals = std::mem::take(&mut registered.rivals);
            registered = again.weighed(&observed.gyros, of_model);
            registered.rivals = rivals;
            gyro = observed.gyro(&registered.about)?;
            (registered, found) = searched(registered, &gyro, observed);
        }
    }
    Ok(Some(Fitted {
        registered,
        gyro,
        pool,
        candidates,
        found,
        few: None,
    }))
}

/// Searches for physical effects and, if any is found, again with the noise re-estimated given them, as it contained them.
fn searched(
    gyros: &Gyros,
    mut registered: Registration,
    of_model: &Alignment,
    physics: Physics,
    search: impl Fn(Registered) -> Found,
) -> (Registration, Found) {
    let beyond = registered.alignment.beyond(of_model);
    let found = search(Registered::new(gyros, &registered, of_model, &beyond));
    if found.physics.is_empty() {
        return (registered, found);
    }
    let own = found.physics.iter();
    let columns = own.flat_map(|named| named_columns(named, physics, &registered));
    let columns = columns.collect();
    registered = registered.weighed_beside(gyros, of_model, columns);
    let found = search(Registered::new(gyros, &registered, of_model, &beyond));
    (registered, found)
}

/// Columns of an accepted effect.
fn named_columns(
    named: &Named,
    Physics {
        gyro,
        pool,
        candidates,
    }: Physics,
    registered: &Registration,
) -> Vec<ParameterColumn> {
    let about = &registered.about;
    let priced = |(values, prior_std)| ParameterColumn {
        values,
        prior_std,
        prior_mean: 0.0,
    };
    if let Some(step) = named.step {
        return vec![priced((step.column(about, gyro), f64::INFINITY))];
    }
    let mut effects = candidates.effects.iter();
    let Some((candidate, _)) = effects.find(|(_, places)| *places == named.places) else {
        return Vec::new();
    };
    let values = gyro.columns(pool, candidate, about).into_iter().enumerate();
    let std = |k: usize| candidate.hypothesis.bound(k).std;
    values.map(|(k, values)| priced((values, std(k)))).collect()
}

/// Fits attitudes too few to estimate their noise, under a prior of it.
fn of_few(
    settings: &Settings,
    observed: &mut Observed,
    of_model: &Alignment,
    progress: &dyn Fn(&str),
) -> Result<Option<Fitted>, InputError> {
    /// Most passes, and the step of the alignment at convergence, in standard deviations.
    const PASSES: usize = 8;
    const SETTLED: f64 = 0.1;
    let about_at = |observed: &Observed, alignment: &Alignment| {
        let Observed {
            gyros,
            samples,
            stamps,
            ..
        } = observed;
        About::new(gyros, samples, stamps, alignment)
    };
    let Some(about) = about_at(observed, of_model) else {
        return Ok(None);
    };
    let known_rad = observed.gyro(&about)?.known_rad(observed.model);
    observed.take_out(&known_rad);
    let belief = NoiseBelief::new(observed.model, &observed.gyros, &settings.plan);
    let rest = rest::find(&observed.gyros);
    let mut alignment = of_model.clone();
    let mut free: Free = Vec::new();
    let mut pass = 0;
    // Physics after convergence of the registration, its linearisation point.
    let mut is_registered = false;
    loop {
        progress("weighing what few attitudes call for");
        let Some(about) = about_at(observed, &alignment) else {
            return Ok(None);
        };
        let gyro = observed.gyro(&about)?;
        let (pool, effects) = match is_registered {
            true => gyro.candidates(settings.left_out),
            false => Default::default(),
        };
        let candidates = Candidates::new(effects);
        let (columns, at_rest) = few_columns(
            observed,
            &about,
            &alignment,
            of_model,
            Physics {
                gyro: &gyro,
                pool: &pool,
                candidates: &candidates,
            },
            rest.as_ref(),
        );
        let rows = FewRows::new(
            &about.increments,
            &columns,
            at_rest.as_ref(),
            &belief,
            &settings.plan.attitude.few,
        );
        let beyond = alignment.beyond(of_model);
        let FewFound {
            found,
            noise,
            is_turning,
        } = few_search::search(&rows, &candidates, &settings.plan);
        let now = found.groups();
        let step = found.step_from(&beyond);
        pass += 1;
        let is_settled = pass % PASSES == 0 || (now == free && step.largest() < SETTLED);
        if is_settled && is_registered {
            return Ok(Some(Fitted {
                registered: Registration::of_few(
                    alignment,
                    about,
                    noise.0,
                    noise.1,
                    observed.stamps.clone(),
                ),
                gyro,
                pool,
                candidates,
                found,
                few: Some(Few {
                    rest_s: match rest {
                        Some(rest) if !is_turning => rest.lasts_s,
                        _ => 0.0,
                    },
                }),
            }));
        }
        is_registered |= is_settled;
        alignment = alignment.with(&now, of_model).moved(&step.estimate);
        free = now;
    }
}

/// Columns of registration and physics about an alignment, and the gyros' mean rates at rest.
fn few_columns(
    observed: &Observed,
    about: &About,
    alignment: &Alignment,
    of_model: &Alignment,
    Physics {
        gyro,
        pool,
        candidates,
    }: Physics,
    rest: Option<&Rest>,
) -> (Vec<ParameterColumn>, Option<AtRest>) {
    let rate_hz = observed.gyros.rate_hz;
    let mut columns = priced(about.columns(rate_hz), alignment, of_model);
    // At rest only the bias of the registration is sensed.
    let bias = places("gyro_bias");
    let mut sensed: Vec<Vector3<f64>> = (0..columns.len())
        .map(|k| match bias.contains(&k) {
            true => Vector3::ith(k - bias.start, 1.0),
            false => Vector3::zeros(),
        })
        .collect();
    for (candidate, _) in &candidates.effects {
        let in_case_rad: Vec<Triad> = gyro.in_case_rad(pool, candidate).collect();
        sensed.extend(rest.iter().flat_map(|rest| {
            let each = in_case_rad.iter();
            each.map(|case| rate_hz * rest.mean(|row| Vector3::from_fn(|axis, _| case[axis][row])))
        }));
        let values = physics::carried(candidate, in_case_rad.into_iter(), about);
        columns.extend(
            values
                .into_iter()
                .enumerate()
                .map(|(k, values)| ParameterColumn {
                    values,
                    prior_std: candidate.hypothesis.bound(k).std,
                    prior_mean: 0.0,
                }),
        );
    }
    let at_rest = rest.map(|rest| AtRest {
        lasts_s: rest.lasts_s,
        reading_rad_s: rate_hz * rest.mean(|row| observed.gyros.sensed_rad[row])
            - alignment.bias_rad_s,
        columns: sensed,
    });
    (columns, at_rest)
}

/// Transforms gyros and reference to the same axes if they differ.
///
/// # Errors
/// As in [`put_right::put_right`].
fn check_channels(
    settings: &Settings,
    observed: &mut Observed,
    of: DeclaredModel<'_>,
) -> Result<Option<PutRight>, Stopped> {
    let DeclaredModel { model, file } = of;
    let samples = observed.sound_samples();
    let reference_hz = channels::readings_hz(&observed.samples);
    let streams = &mut observed.streams;
    let mut rows = channels::reference_rows(&samples, streams, &settings.plan.attitude.rows);
    channels::map_increments(&model.effects, &mut rows.increments_rad);
    let own_rad = std::mem::replace(&mut streams.case_rad, rows.increments_rad);
    let usable = streams.usable.clone();
    for (usable, doubtful) in streams.usable.iter_mut().zip(rows.doubtful) {
        *usable &= !doubtful;
    }
    (streams.own_motion, streams.reference_hz) = (false, reference_hz);
    let checked = put_right::put_right(settings, streams, model, file);
    (streams.own_motion, streams.reference_hz) = (true, None);
    streams.case_rad = own_rad;
    streams.usable = usable;
    // A pure rotation of any size is left to the registration, which uses attitudes as they are.
    let found = checked?.filter(|found| !found.is_turn_alone());
    if let Some(found) = &found {
        let map = channels::map(&found.effects());
        channels::put_right(&map, &mut observed.samples, &mut observed.gyros.sensed_rad);
    }
    Ok(found)
}
