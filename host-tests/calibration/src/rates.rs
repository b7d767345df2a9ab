//! Information of a recording with a rate reference: generalised least squares in the DCT-II, with the noise terms of IEEE
//! 952 estimated from the residual.
//!
//! The recording's `reference_increment` lies on the gyros' rows. Columns are computed from a motion whose noise is
//! independent of the residual; estimates of motion, noise and parameters alternate.
//!
//! The whole recording is fitted: no model is selected, so none needs held-out data.

use rlg_catalogue::Signals;
use rlg_catalogue::signals::Path as SignalPath;
use rlg_diagnosis::alignment::case_motion::estimate;
use rlg_diagnosis::rows::data::{Data, bridged};
use rlg_diagnosis::rows::model_effects::is_predictable;
use rlg_diagnosis::rows::noise_levels::{drift_prior, first_levels};
use rlg_inference::{Information, NoiseLevels, NormalEquations, Observations, Search};
use rlg_model::DeclaredModel;
use rlg_plan::Plan;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::axes::{Triad, add_triad};
use rlg_signal::partition::Use;
use rlg_signal::qualify;
use rlg_signal::streams::Streams;

use super::columns::DesignColumns;
use super::record::{RecordInformation, greatest, too_short};
use super::unknowns::{RIVAL, Unknowns};

/// Alternations of motion and fit: the first motion is conditioned on the residual of a model without its flexure, the
/// second on the residual of the fit. A third changes K in its seventh digit.
const PASSES: usize = 2;

/// Computes the information of `recording`. `model` must not contain flexure, which the prediction would subtract.
pub fn record_information(
    recording: &Recording,
    DeclaredModel { model, file }: DeclaredModel<'_>,
    plan: &Plan,
) -> Result<RecordInformation, InputError> {
    is_predictable(model, file)?;
    let mut streams = Streams::align(recording, model, &plan.signal.align)?;
    qualify::qualify(&mut streams, &plan.signal.faults);
    let rate_hz = streams.rate_hz;
    let seconds = seconds_of(&streams.usable, rate_hz);
    let own = &plan.calibration;
    if seconds < own.least_s {
        return Err(too_short(recording, seconds, own));
    }
    let mut data = Data::new(&mut streams, model, plan, file)?;
    let seen = data.rows_of(&[Use::Fit, Use::Test]);
    let observations = Observations::bridged(&seen)
        .map_err(|_| too_short(recording, seconds_of(&seen, rate_hz), own))?;
    let fitted = observations.clone().to_fast_length();
    let mut kinds = Unknowns::fitted_kinds(!model.earth_rate_in_reference);
    kinds.push(RIVAL);
    let mut levels = first_levels(&data.residual_rad, &fitted);
    let mut clean_rad = bridged(&data.residual_rad, &observations);
    let mut pass = 1;
    loop {
        let direct = SignalPath::default();
        let motion = estimate(&data, &clean_rad, &levels, &seen, direct, plan);
        let signals = &motion.signals;
        data.set_known(signals);
        let mut residual_rad = residual_rad(&data, signals);
        let columns = DesignColumns::new(signals, &kinds);
        let equations = NormalEquations::new(
            fitted.clone(),
            &residual_rad,
            &columns.made_of(signals),
            NoiseLevels::mean(&levels),
        );
        // One certain hypothesis: no model prior, and no parameter prior but the wide one of its own information.
        let certain = [columns.fitted()];
        let drift = drift_prior(&model.gyro);
        let fit = Search::new(
            &equations,
            &certain,
            1,
            &plan.inference.search,
            &drift,
            levels,
        )
        .fit(&[0], None);
        if pass == PASSES {
            let levels = levels_of(&fit.levels);
            let of_gyro = |levels: &NoiseLevels| {
                let counts = equations.basis_beside_gaps(*levels).counts;
                counts.iter().sum::<f64>()
            };
            return Ok(RecordInformation {
                information: Information::of(&equations, &[columns.hypothesis()], &levels),
                levels,
                seconds: observed_rows(&fitted) as f64 / rate_hz,
                degrees: levels.iter().map(of_gyro).sum(),
                rate_hz,
                acceleration_rad_s2: greatest(&signals.independent),
            });
        }
        pass += 1;
        let values = &fit.estimate.as_slice()[fit.blocks[0].clone()];
        add_triad(
            &mut residual_rad,
            &columns.sensed_rad(signals, values),
            -1.0,
        );
        clean_rad = bridged(&residual_rad, &observations);
        levels = fit.levels;
    }
}

/// Residual of the model with its effects \[rad by row\]; noise of the reference that passes its filters is left as before
/// them.
fn residual_rad(data: &Data, signals: &Signals) -> Triad {
    let mut residual_rad = data.residual_rad.clone();
    add_triad(&mut residual_rad, &data.known_rad(signals), -1.0);
    if let Some(noise) = data.passed_noise_rad(signals) {
        add_triad(&mut residual_rad, &noise, 1.0);
    }
    residual_rad
}

fn seconds_of(rows: &[bool], rate_hz: f64) -> f64 {
    rows.iter().filter(|&&row| row).count() as f64 / rate_hz
}

/// Number of observed rows.
fn observed_rows(observations: &Observations) -> usize {
    let gaps = observations.spans.iter().flat_map(|span| &span.gaps);
    observations.rows() - gaps.map(ExactSizeIterator::len).sum::<usize>()
}

fn levels_of(levels: &[NoiseLevels]) -> [NoiseLevels; 3] {
    std::array::from_fn(|gyro| levels[gyro])
}
