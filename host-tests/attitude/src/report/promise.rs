//! Separation of flexure and elastic rate expected of the proposed experiment, in standard deviations, if the two are
//! confused.
//!
//! The programme: spin at one turn a second about one axis, both senses, oscillation at the same frequency about another,
//! phases 0 and 90°, all six pairs. The separation is |(I − P) effect|, P the projection on the rival and on plain errors of
//! gyros, under the same noise.
//!
//! The attitude must be measured during the motion. Between two rests ∫ C W dα/dt dt = −∫ C (ω × W α) dt by parts, a flexure
//! with K_ij = K_kj = W_jj: the two are not distinguishable by attitudes before and after, whatever the motion. During the
//! motion the elastic rate appears in the attitude as W α, which a flexure never produces.

use nalgebra::{DMatrix, DVector, Vector3};
use rlg_catalogue::experiment::Experiment;
use rlg_catalogue::moves::increments_rad;
use rlg_catalogue::{Candidate, Pool};
use rlg_diagnosis::report::experiment_words::move_entry;
use rlg_findings::result::{ExperimentEntry, SeparationEntry};
use rlg_inference::Information;
use rlg_inference::linear::invert;
use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::Triad;
use rlg_signal::streams::Streams;

use crate::fits::report_inputs::Said;
use crate::gyros::physics::Gyro;
use crate::likelihood::equations::ParameterColumn;
use crate::rows::alignment::{Alignment, places};
use crate::rows::fitting::priced;
use crate::rows::gyro_motion::Reads;
use crate::rows::increments::{Increments, Stamps};
use crate::rows::linearised_rows::{About, Gyros};
use crate::selection::group_selection::Named;

/// Errors of any gyro, nuisance parameters of the separation.
const PLAIN: [&str; 4] = [
    "gyro_bias",
    "reference_misalignment",
    "gyro_scale",
    "installation",
];

const CONFUSED: [&str; 2] = ["axis_flexure", "elastic_rate_by_jerk"];

/// Noise of rows: random walk \[rad/√s\] and white noise of the attitude \[rad\].
#[derive(Clone, Copy)]
struct RowNoise {
    walk_rad_sqrt_s: f64,
    angle_rad: f64,
}

impl RowNoise {
    /// Whitens rows of three axes by the Cholesky root of their covariance, which has two diagonals.
    fn whiten(self, increments: &Increments, values: &Triad) -> DVector<f64> {
        let (walk, angle) = (self.walk_rad_sqrt_s.powi(2), self.angle_rad.powi(2));
        let times = &increments.times_s;
        let white = values.iter().flat_map(|values| {
            let (mut root, mut before) = (f64::INFINITY, 0.0);
            let rows = values.iter().zip(times.windows(2));
            rows.map(|(value, time)| {
                let below = -angle / root;
                root = (walk * (time[1] - time[0]) + 2.0 * angle - below * below).sqrt();
                before = (value - below * before) / root;
                before
            })
            .collect::<Vec<f64>>()
        });
        DVector::from_vec(white.collect())
    }
}

/// Proposes the experiment for flexure and elastic rate if they are confused, with the expected separation for either truth.
pub(crate) fn promised(said: &Said) -> Option<ExperimentEntry> {
    let named = said.found.physics.iter().chain(&said.found.registration);
    let is_confused = |one: &&Named| {
        let is_in = |kind: &&str| *kind == one.kind || one.alike.contains(kind);
        CONFUSED.iter().all(is_in)
    };
    let one = named.clone().find(is_confused)?;
    let registered = said.registered;
    let period_s = registered.about.increments.period_s;
    let noise = RowNoise {
        walk_rad_sqrt_s: (registered.levels.mean(0) / period_s).sqrt(),
        angle_rad: registered.levels.mean(1).sqrt(),
    };
    let spins = Experiment::spins(&said.plan.catalogue.table);
    let longest_s = said.plan.attitude.proposed_every_s;
    let spacing_s = period_s.clamp(1.0 / spins.rows_hz, longest_s);
    let experiment = Spins::new(said, &spins, spacing_s)?;
    let [flexure, elastic] = CONFUSED;
    let orders = [(flexure, elastic), (elastic, flexure)];
    let apart = orders.into_iter().filter_map(|(truth, rival)| {
        let values = values(said, noise, one, truth)?;
        Some(SeparationEntry {
            truth: truth.to_string(),
            rival: rival.to_string(),
            here_sigma: None,
            promised_sigma: experiment.separation(noise, (truth, &values), rival)?,
        })
    });
    let separations: Vec<SeparationEntry> = apart.collect();
    (!separations.is_empty()).then(|| ExperimentEntry {
        programme: spins.text.clone(),
        moves: spins.moves.iter().map(move_entry).collect(),
        repeats: 1,
        attitude_every_s: Some(spacing_s),
        separations,
        precisions: Vec::new(),
    })
}

/// Returns an effect of the catalogue with all its parameters.
fn whole(gyro: &Gyro, kind: &str) -> Option<(Pool, Candidate)> {
    let (pool, effects) = gyro.whole(&[]);
    let mut effects = effects.into_iter();
    effects.find(|one| one.kind == kind).map(|one| (pool, one))
}

/// Estimates the parameters of an effect in the place of the named one, by ridge regression with the prior width of most
/// evidence: undetermined parameters stay small.
fn values(said: &Said, noise: RowNoise, instead_of: &Named, kind: &str) -> Option<Vec<f64>> {
    /// Iterations of the prior width.
    const TURNS: usize = 8;
    let about = &said.registered.about;
    let (pool, candidate) = whole(said.gyro, kind)?;
    let own = said.gyro.columns(&pool, &candidate, about);
    let count = own.len();
    let rate_hz = said.observed.gyros.rate_hz;
    let alignment = &said.registered.alignment;
    let registration = priced(
        about.columns(rate_hz),
        alignment,
        said.of_model,
        &said.plan.attitude.registration,
    );
    let others = said
        .found
        .registration
        .iter()
        .filter(|one| one.places != instead_of.places);
    let others: Vec<usize> = others.flat_map(|one| one.places.clone()).collect();
    let white = |values: &Triad| noise.whiten(&about.increments, values);
    let columns = own
        .iter()
        .chain(others.iter().map(|k| &registration[*k].values));
    let columns: Vec<DVector<f64>> = columns.map(white).collect();
    let rows = DMatrix::from_columns(&columns);
    let gram = rows.tr_mul(&rows);
    let moments = rows.tr_mul(&white(&about.increments.rows_rad));
    let widest = candidate.hypothesis.bound(0).std;
    let mut width = widest;
    let mut estimate = DVector::zeros(columns.len());
    for _ in 0..TURNS {
        let precision = DVector::from_fn(columns.len(), |k, _| match k < count {
            true => width.powi(-2),
            false => registration[others[k - count]].prior_std.powi(-2),
        });
        let covariance = invert(&(&gram + DMatrix::from_diagonal(&precision))).0;
        estimate = &covariance * &moments;
        let squares = (0..count).map(|k| estimate[k].powi(2));
        let fixed = (0..count).map(|k| 1.0 - covariance[(k, k)] / width.powi(2));
        let fixed = fixed.sum::<f64>().max(f64::MIN_POSITIVE);
        width = (squares.sum::<f64>() / fixed).sqrt().min(widest);
    }
    Some(estimate.iter().take(count).copied().collect())
}

/// Simulated attitudes of the proposed motion.
struct Spins {
    gyro: Gyro,
    about: About,
    plain: Vec<ParameterColumn>,
}

impl Spins {
    fn new(said: &Said, spins: &Experiment, spacing_s: f64) -> Option<Self> {
        let mut model = said.observed.model.clone();
        model.effects.clear();
        let rate_hz = spins.rows_hz;
        let case_rad = increments_rad(&spins.moves, rate_hz);
        let rows = case_rad[0].len();
        let streams = Streams::of_motion(rate_hz, case_rad.clone());
        let gyro = Gyro::new(&streams, &model, (&case_rad, None), &said.plan.catalogue)?;
        let gyros = Gyros {
            start_s: 0.0,
            rate_hz,
            sensed_rad: (0..rows)
                .map(|row| Vector3::from_fn(|axis, _| case_rad[axis][row]))
                .collect(),
            white_noise_rad2: [0.0; 3],
            lost_before: vec![0; rows + 1],
            reads: Reads::Attitudes,
            plan: said.plan.attitude,
            declared_walk_rad_sqrt_s: None,
            dither: None,
        };
        let motion = gyros.motion(gyros.sensed_rad.clone());
        let stamps = (0..).map(|k| f64::from(k) * spacing_s);
        let samples: Vec<SlowSample> = stamps
            .map_while(|time_s| {
                Some(SlowSample {
                    time_s,
                    shown: motion.shown(motion.place(time_s)?),
                    after_gap: false,
                })
            })
            .collect();
        let alignment = Alignment::of_model(&model);
        let known = Stamps::without(&vec![false; samples.len()]);
        let about = About::new(&gyros, &samples, &known, &alignment)?;
        let all = priced(
            about.columns(rate_hz),
            &alignment,
            &alignment,
            &gyros.plan.registration,
        )
        .into_iter();
        let is_plain: Vec<usize> = PLAIN.iter().flat_map(|kind| places(kind)).collect();
        let plain = all.enumerate().filter(|(k, _)| is_plain.contains(k));
        Some(Self {
            gyro,
            plain: plain.map(|(_, column)| column).collect(),
            about,
        })
    }

    /// Separation of an effect from its rival and plain gyro errors, in standard deviations.
    fn separation(&self, noise: RowNoise, truth: (&str, &[f64]), rival: &str) -> Option<f64> {
        let increments = &self.about.increments;
        let columns = |kind: &str| {
            let (pool, candidate) = whole(&self.gyro, kind)?;
            let columns = self.gyro.columns(&pool, &candidate, &self.about);
            Some((columns, candidate.hypothesis.bound(0).std))
        };
        let (own, own_std) = columns(truth.0)?;
        let (of_rival, rival_std) = columns(rival)?;
        let count = own.len();
        let own = own.into_iter().map(|values| (values, own_std));
        let of_rival = of_rival.into_iter().map(|values| (values, rival_std));
        let plain = self.plain.iter();
        let plain = plain.map(|one| (one.values.clone(), one.prior_std));
        let (white, stds): (Vec<DVector<f64>>, Vec<f64>) = own
            .chain(of_rival)
            .chain(plain)
            .map(|(values, std)| (noise.whiten(increments, &values), std))
            .unzip();
        let rows = DMatrix::from_columns(&white);
        let information = Information {
            fisher: rows.tr_mul(&rows),
            ..Information::none(0)
        };
        let beside: Vec<(usize, f64)> = stds.into_iter().enumerate().skip(count).collect();
        Some(information.separation(0..count, truth.1, &beside))
    }
}

/// Returns a sentence on the expected separation.
pub(crate) fn sentence(experiment: &ExperimentEntry) -> String {
    let each = experiment.separations.iter().map(|one| {
        format!(
            "if it is {}, by {:.0} standard deviations from {}",
            one.truth, one.promised_sigma, one.rival
        )
    });
    let each: Vec<String> = each.collect();
    let every_s = experiment.attitude_every_s.unwrap_or_default();
    format!(
        "Predicted: {}, with attitudes as accurate as here every {every_s:.2} s during the motion (those before and after it do not contribute), separates them {}.",
        experiment.programme,
        each.join("; ")
    )
}
