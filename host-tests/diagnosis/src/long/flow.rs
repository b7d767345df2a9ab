//! The flow of a diagnosis of a recording longer than memory.

use rlg_plan::{JudgementPlan, Plan};
use std::ops::Range;

use nalgebra::UnitQuaternion;
use rlg_catalogue::signals::start_temperature_k;
use rlg_findings::result::{LocationEntry, WholeEntry};
use rlg_inference::observations::runs;
use rlg_inference::{Drift, Fit};
use rlg_model::DeclaredModel;
use rlg_recording::Segment;
use rlg_recording::error::InputError;
use rlg_signal::fault::Fault;
use rlg_signal::piece::{Origin, Piece};
use rlg_signal::qualify;
use rlg_signal::streams::{Streams, Triad};

use super::cut::Long;
use super::forming::{About, form};
use crate::confirm::sharing::{Grouping, in_recording, with_noise_of};
use crate::confirm::sums::{Recordings, Summed, Sums};
use crate::confirm::together::Together;
use crate::confirm::{Confirmed, confirmed};
use crate::outcome::Outcome;
use crate::report::findings::location_entry;
use crate::report::summary::unlike_noise;
use crate::rows::channel_correction::{ChannelCorrection, correct_channels};
use crate::rows::data::Data;
use crate::rows::data_words;
use crate::rows::entries_of_rows::channel;
use crate::rows::noise_levels::{drift_prior, reported};
use crate::search::structure::Found;
use crate::settings::{Scope, Settings};
use crate::several::report::{Beside, Whole, outcome};
use crate::several::search::{Shown, stand};
use crate::tiles::held_out_figures::validate;
use crate::tiles::locate;
use crate::tiles::noise_spectrum::Noise;
use crate::tiles::pictures::{self, Pictures};
use crate::tiles::regimes::regimes_of;
use crate::unfit::Unfit;

/// Kind that a stretch cannot show: it needs an attitude since the recording's beginning.
const OF_ATTITUDE: &str = "earth_rate";

/// Findings, and each stretch with a result derived from it.
pub type WithStretches<T> = (Outcome, Vec<(Streams, T)>);

/// Diagnoses a recording of which `most_rows` may be in memory at once.
///
/// # Returns
/// The findings, and the stretches with the result of `also` for each.
///
/// # Errors
/// Rows cannot be read; axes are reversed or exchanged; the model's installation matrix has no inverse; or too few rows can be
/// fitted.
pub fn diagnose_also<T>(
    settings: &Settings,
    (long, most_rows): (&Long, usize),
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
    also: impl Fn(&Found) -> T,
) -> Result<WithStretches<T>, Unfit> {
    let Settings {
        left_out,
        ref plan,
        seed,
        ..
    } = *settings;
    let cut = long.blocks(plan);
    let rows = long.stretches(most_rows, &plan.long);
    let origin = Origin {
        start_s: long.start_s,
        temperature_k: start_of(long, plan)?,
        start_from_body: UnitQuaternion::identity(),
        seconds: long.seconds(),
    };
    progress("reading the stretches");
    let (mut all, turned) = stretches(settings, (long, &rows), &origin, of)?;
    let (mut fitted, mut faults) = (Vec::new(), Vec::new());
    for (streams, of_data) in &mut all {
        fitted.push(Data::new(streams, of.model, plan, of.file)?);
        faults.push(std::mem::take(of_data));
    }
    let without: Vec<&str> = left_out.iter().copied().chain([OF_ATTITUDE]).collect();
    let scope = Scope {
        plan,
        left_out: &without,
    };
    let standing = stand(&mut fitted, Grouping::Stretches, scope, progress)?;
    let about = About {
        long,
        cut: &cut,
        model: of,
        left_out,
        plan,
        origin,
        turned: turned.as_ref(),
        stretches: &rows,
    };
    let mut sums = sums_of(about, standing.shown(), progress)?;
    progress("search with the sums");
    let mut together = standing.judged(Some(sums.side()), plan);
    progress("self-test on this recording");
    let tested_on = together.self_test(Some(sums.side().equations), plan, seed);
    progress("confirming the findings");
    together.release();
    sums.release();
    let recordings = Recordings {
        each: &fitted,
        sums: Some(&sums),
    };
    let confirmed = confirmed(recordings, &mut together, plan)?;
    progress("writing the findings");
    let of = Searched {
        fitted: &fitted,
        faults: &faults,
        sums: &sums,
        confirmed: &confirmed,
    };
    let mut outcome = written(of, &mut together, (long, &rows), settings);
    outcome.diagnosis.add_self_test(tested_on);
    if let Some(turned) = turned {
        turned.report(&mut outcome);
    }
    let beside: Vec<T> = together.found.iter().map(also).collect();
    drop((fitted, together));
    let streams = all.into_iter().map(|(streams, _)| streams);
    Ok((outcome, streams.zip(beside).collect()))
}

/// Reads all rows and sums over them.
fn sums_of(about: About, shown: Shown, progress: &dyn Fn(&str)) -> Result<Sums, Unfit> {
    let seconds = about.long.seconds();
    let drift = drift_prior(&about.model.model.gyro);
    let summed = form(about, shown, &|done| {
        progress(&format!("reading {:.0} of {seconds:.0} s", done * seconds));
    })?;
    Ok(Sums::new(summed, drift)?)
}

/// Stretches and sums of a recording, with their confirmed set.
struct Searched<'a> {
    fitted: &'a [Data<'a>],
    /// Faults of the data of each stretch.
    faults: &'a [Vec<Fault>],
    sums: &'a Sums,
    confirmed: &'a Confirmed,
}

/// Writes the outcome, with the figures of the blocks and the faults of all stretches.
fn written(
    of: Searched,
    together: &mut Together,
    (long, rows): (&Long, &[Range<usize>]),
    settings: &Settings,
) -> Outcome {
    let Searched {
        fitted,
        faults,
        sums,
        confirmed,
    } = of;
    for (place, own) in together.found.iter_mut().enumerate() {
        without_level(own, &with_noise_of(&confirmed.set.fit, place));
    }
    let judgement = &settings.plan.judgement;
    let whole = whole(sums, (together, confirmed), (long, rows), judgement);
    let mut outcome = outcome(
        fitted,
        together,
        confirmed,
        faults,
        Beside::Whole(Box::new(whole)),
        settings,
    );
    let lines = fitted.iter().zip(faults);
    let lines = lines.flat_map(|(data, faults)| data_words::lines(data.streams, faults));
    outcome.diagnosis.summary.extend(lines);
    outcome
}

/// Temperature of each block at the recording's beginning \[K\]; `None` without thermometers.
fn start_of(long: &Long, plan: &Plan) -> Result<Option<[f64; 3]>, InputError> {
    let rows = (2.0 * plan.long.around_s * long.rate_hz) as usize;
    let first = (long.read)(0..rows.min(long.rows))?;
    let temperature_k = first.temperature_k.as_ref();
    Ok(temperature_k.map(|triad| start_temperature_k(triad, long.rate_hz, &plan.catalogue)))
}

/// Stretches with the faults of their data.
type Stretches = Vec<(Streams, Vec<Fault>)>;

/// Reads the stretches, and corrects the channels of all of them if one requires it.
fn stretches(
    settings: &Settings,
    (long, rows): (&Long, &[Range<usize>]),
    origin: &Origin,
    of: DeclaredModel<'_>,
) -> Result<(Stretches, Option<ChannelCorrection>), InputError> {
    let DeclaredModel { model, file } = of;
    let mut all = rows
        .iter()
        .map(|rows| (long.read)(rows.clone()))
        .collect::<Result<Vec<Streams>, InputError>>()?;
    let mut turned = None;
    let mut first = 0;
    while turned.is_none() && first < all.len() {
        turned = correct_channels(settings, &mut all[first], model, file)?;
        first += 1;
    }
    if let Some(turned) = &turned {
        let others = all.iter_mut().enumerate();
        let others = others.filter(|(place, _)| place + 1 != first);
        others.for_each(|(_, streams)| turned.apply(streams));
    }
    let ends = (settings.plan.long.ends_s * long.rate_hz) as usize;
    let each = all.into_iter().zip(rows).map(|(mut streams, rows)| {
        let last = streams.rows.saturating_sub(ends);
        streams.usable[..ends.min(last)].fill(false);
        streams.usable[last..].fill(false);
        let faults =
            qualify::unknown_faults(&mut streams, &model.effects, &settings.plan.signal.faults);
        let piece = &mut streams.piece;
        piece.origin = Some(origin.clone());
        // One stretch, one motion.
        piece.segments = vec![Segment {
            name: long.name_of(rows),
            kind: String::new(),
            start_s: long.at_s(rows.start),
            end_s: long.at_s(rows.end),
        }];
        (streams, faults)
    });
    Ok((each.collect(), turned))
}

/// Subtracts the fitted level from a stretch's residual: a free parameter, determined by all of the recording only.
fn without_level(own: &mut Found, fit: &Fit) {
    for (residual, free) in own.residual_rad.iter_mut().zip(&fit.gaps) {
        // The level is the last of the free parameters of a span.
        let level_rad = free.clone().last().map_or(0.0, |at| fit.estimate[at]);
        residual.iter_mut().for_each(|value| *value -= level_rad);
    }
}

/// Validates the fit on the blocks outside the `stretches`.
fn whole(
    sums: &Sums,
    (together, confirmed): (&Together, &Confirmed),
    (long, stretches): (&Long, &[Range<usize>]),
    plan: &JudgementPlan,
) -> Whole {
    let summed = &sums.summed;
    // The records of the sums follow those of the stretches.
    let count = stretches.len();
    let fit = with_noise_of(&confirmed.set.fit, count);
    let after_rad = sums.left_by(&fit, &in_recording(&together.shared, count));
    let blocks = summed.seen.len();
    let noise = [0, 1, 2].map(|axis| reported(fit.levels[axis], blocks, summed.rate_hz));
    let figures = validate(
        &summed.residual_rad,
        &after_rad,
        &noise,
        (&summed.tested, [0.0, f64::INFINITY]),
        &[],
        summed.rate_hz,
        &plan.held_out,
    );
    let (locations, pictures) = drawn(summed, &after_rad, &noise, long, plan);
    let seconds = |blocks: usize| blocks as f64 / summed.rate_hz;
    let count_of = |flags: &[bool], of: bool| flags.iter().filter(|&&flag| flag == of).count();
    let wandering = |axis: usize| {
        let wanders = fit.drift[axis] != Drift::None;
        wanders.then(|| noise[axis].wander_rad_s(long.seconds()))
    };
    let misfits = confirmed.misfits.get(count).into_iter().flatten();
    let misfits: Vec<_> = misfits.copied().collect();
    Whole {
        recording: long.name.clone(),
        entry: WholeEntry {
            blocks_per_s: summed.rate_hz,
            stretches_s: stretches
                .iter()
                .map(|rows| [rows.start, rows.end].map(|row| long.at_s(row)))
                .collect(),
            fitted_blocks_s: seconds(count_of(&summed.seen, true)),
            held_out_blocks_s: seconds(summed.tested.iter().map(ExactSizeIterator::len).sum()),
            unusable_s: seconds(count_of(&summed.measured, false)),
            channels: figures.iter().map(channel).collect(),
        },
        wandering_rad_s: [0, 1, 2].map(wandering),
        locations,
        pictures,
        unlike: (0..3)
            .filter_map(|gyro| unlike_noise(gyro, &misfits, summed.rate_hz))
            .collect(),
    }
}

/// Locates the blocks' deviations from the model, and draws their residual before and after.
fn drawn(
    summed: &Summed,
    after_rad: &Triad,
    noise: &[Noise; 3],
    long: &Long,
    plan: &JudgementPlan,
) -> (Vec<LocationEntry>, Pictures) {
    let of = Piece {
        origin: None,
        recording: long.name.clone(),
        segments: long.segments.clone(),
        held_out: false,
    };
    let bare = Streams::bare(summed.rate_hz, long.start_s, summed.measured.clone(), &of);
    let regimes = regimes_of(&bare, &plan.regimes);
    let rows = runs(&summed.measured, true);
    let before_rad = &summed.residual_rad;
    let tiles = [before_rad, after_rad]
        .map(|left_rad| locate::tiles(&bare, left_rad, noise, &regimes, &rows, &plan.tiles));
    let locations = locate::join(&tiles[0], &regimes, &rows, &plan.tiles);
    let locations = locations.iter().map(|one| location_entry(one, &bare));
    let locations = locations.collect();
    let [before, after] = tiles;
    let pictures = pictures::draw(
        &bare,
        before_rad,
        after_rad,
        noise,
        ((before, after), &plan.tiles),
        &summed.tested,
    );
    (locations, pictures)
}
