//! The flow of a diagnosis of several recordings.

use rlg_plan::Plan;

use rlg_catalogue::signals::Path as SignalPath;
use rlg_findings::result::RecordingEntry;
use rlg_inference::TooFewRows;
use rlg_model::DeclaredModel;
use rlg_signal::fault::Fault;
use rlg_signal::partition::Use;
use rlg_signal::streams::{Streams, Triad};

use super::report::{Beside, HeldOut, outcome, powers};
use super::search::find;
use crate::alignment::case_motion::estimate;
use crate::confirm::sharing::{Shared, Sharing, with_noise_of};
use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::confirm::{ConfirmedSet, confirmed, fallen, until_none_falls};
use crate::iteration::pass::subtract;
use crate::iteration::state::without_known;
use crate::outcome::Outcome;
use crate::rows::data::Data;
use crate::rows::entries_of_rows::channel;
use crate::rows::noise_levels::reported;
use crate::search::structure::Found;
use crate::settings::{Scope, Settings};
use crate::tiles::held_out_figures::validate;
use crate::unfit::Unfit;

/// Diagnoses aligned and qualified recordings of one unit together, using up their sensed increments.
///
/// # Inputs
/// `all`: each with the faults of its data; recordings with a held-out piece only test.
///
/// # Returns
/// The findings, and the result of `also` for each fitted recording.
///
/// # Errors
/// The model's installation matrix has no inverse, or too few rows of a recording can be fitted.
pub fn diagnose_also<T>(
    settings: &Settings,
    all: &mut [(Streams, Vec<Fault>)],
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
    also: impl Fn(&Found) -> T,
) -> Result<(Outcome, Vec<T>), Unfit> {
    let DeclaredModel { model, file } = of;
    let Settings {
        left_out,
        ref plan,
        seed,
        ..
    } = *settings;
    let (mut fitted, mut faults, mut tested) = (Vec::new(), Vec::new(), Vec::new());
    for (streams, of_data) in all {
        let is_held_out = streams.piece.held_out;
        let mut data = Data::new(streams, model, plan, file)?;
        if is_held_out {
            data.partition.uses.fill(Use::Test);
            tested.push(data);
        } else {
            fitted.push(data);
            faults.push(std::mem::take(of_data));
        }
    }
    let searched = until_none_falls(left_out, progress, |without| -> Result<_, TooFewRows> {
        let mut together = find(
            &mut fitted,
            Scope {
                plan,
                left_out: without,
            },
            progress,
        )?;
        progress("self-test on these recordings");
        let tested_on = together.self_test(None, plan, seed);
        progress("confirming the findings");
        together.release();
        let recordings = Recordings {
            each: &fitted,
            sums: None,
        };
        let confirmed = confirmed(recordings, &mut together, plan)?;
        let fallen = fallen(&confirmed.set.reenacted_away, &together.found[0]);
        Ok(((together, confirmed, tested_on), fallen))
    })?;
    let ((mut together, mut confirmed, tested_on), shown_anyway) = searched;
    confirmed.set.shown_anyway = shown_anyway;
    progress("writing the findings");
    let held_out: Vec<HeldOut> = tested
        .iter_mut()
        .map(|data| of_held_out(data, &together, &confirmed.set, plan))
        .collect();
    let mut outcome = outcome(
        &fitted,
        &mut together,
        &confirmed,
        &faults,
        Beside::HeldOut(held_out),
        settings,
    );
    outcome.diagnosis.add_self_test(tested_on);
    Ok((outcome, together.found.iter().map(also).collect()))
}

/// Figures of a held-out recording: the common effects, predicted from its own reference. None of its rows is used before.
fn of_held_out(
    data: &mut Data,
    together: &Together,
    confirmed: &ConfirmedSet,
    plan: &Plan,
) -> HeldOut {
    let streams = data.streams;
    let first = &together.found[0];
    let rows = streams.rows;
    let levels: Vec<_> = confirmed.fit.levels[..3].to_vec();
    let path = first.motion.signals.path;
    let is_common = |place: &usize| together.shared[*place].sharing == Sharing::Common;
    let common: Vec<&Shared> = confirmed
        .headlines
        .iter()
        .filter(|place| is_common(place))
        .map(|&place| &together.shared[place])
        .collect();
    let delayed = common.iter().any(|one| {
        let kind = one.candidate.kind;
        rlg_catalogue::candidates::is_delay(kind) || one.candidate.base.iter().any(|b| *b != 0.0)
    });
    let path = if delayed { path } else { SignalPath::default() };
    let nothing: Triad = std::array::from_fn(|_| vec![0.0; rows]);
    let usable = streams.usable.clone();
    let motion = estimate(data, &nothing, &levels, &usable, path, plan);
    data.set_known(&motion.signals);
    let before_rad = without_known(data, &motion.signals);
    let mut after_rad = before_rad.clone();
    let mut of_common = with_noise_of(&confirmed.fit, 0);
    let all = of_common.members.iter().zip(&of_common.blocks);
    let kept = all.filter(|(place, _)| is_common(place));
    let kept = kept.map(|(&place, block)| (place, block.clone()));
    (of_common.members, of_common.blocks) = kept.unzip();
    // The columns can be formed along any motion.
    let of_first = (&first.candidates, &first.pool);
    subtract(
        &mut after_rad,
        &of_common,
        of_first.0,
        of_first.1,
        &motion.signals,
    );
    let test_rows = data.ranges_of(&[Use::Test]);
    let noise = std::array::from_fn(|axis| reported(levels[axis], rows, streams.rate_hz));
    let validations = validate(
        &before_rad,
        &after_rad,
        &noise,
        (&test_rows, streams.band_hz(&plan.long)),
        &[],
        streams.rate_hz,
        &plan.judgement.held_out,
    );
    let channels: Vec<_> = validations.iter().map(channel).collect();
    HeldOut {
        entry: RecordingEntry {
            recording: streams.piece.recording.clone(),
            held_out_whole: true,
            fitted_on: Vec::new(),
            held_out: test_rows.iter().map(|rows| streams.span_of(rows)).collect(),
            normalised_power: powers(&channels),
        },
        channels,
    }
}
