//! Validation figures on held-out stamps, and data of the report's plots.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rlg_diagnosis::residual::relative_residual::{self, Rows};
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::result::{FiguresEntry, ResidualEntry};
use rlg_findings::sentences::DEG_H;
use rlg_inference::Dct;
use rlg_plan::{AttitudeHeldOutPlan, AttitudeNoisePlan, CoherencePlan, InStepPlan};
use rlg_signal::axes::{Triad, add_triad, mapped};
use rlg_signal::in_step::{self, Block, InStep};
use rlg_signal::transforms::mean_periodogram;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fits::report_inputs::Said;
use crate::likelihood::equations::Band;
use crate::likelihood::noise::{Levels, NoiseTerms};
use crate::rows::alignment::{Alignment, orthogonal};
use crate::rows::gyro_motion::Place;
use crate::rows::increments::Stamps;
use crate::rows::linearised_rows::About;

/// Validation figures before and after the diagnosis.
pub(crate) struct HeldOut {
    pub(crate) span_s: [f64; 2],
    pub(crate) band_hz: [f64; 2],
    pub(crate) before: [FiguresEntry; 3],
    pub(crate) after: [FiguresEntry; 3],
    /// Residual power relative to the noise model, mean of all axes \[1\].
    pub(crate) power_after: f64,
    /// Part of the residual of all sound stamps proportional to the motion; `None` if not significant.
    pub(crate) in_step: Option<InStep>,
    /// Residual relative to the motion over all sound stamps.
    pub(crate) residual: Option<ResidualEntry>,
    pub(crate) pictures: Pictures,
}

impl HeldOut {
    /// Returns one sentence on the drift before and after.
    pub(crate) fn sentence(&self, plan: &AttitudeHeldOutPlan) -> String {
        let of = |figures: &[FiguresEntry; 3]| {
            let each: Vec<String> = figures
                .iter()
                .map(|one| format!("{:.2}", one.drift_rad_s * DEG_H))
                .collect();
            each.join(", ")
        };
        let size = |figures: &[FiguresEntry; 3]| -> f64 {
            figures.iter().map(|one| one.drift_rad_s.powi(2)).sum()
        };
        let std = self.after.each_ref().map(|one| one.drift_std_rad_s * DEG_H);
        let moved = match size(&self.after) / size(&self.before) {
            ratio if ratio < plan.same_drift[0] => "falls",
            ratio if ratio > plan.same_drift[1] => "rises",
            _ => "stays",
        };
        let drift = format!(
            "Held-out time: drift of gyros x, y, z {moved} from {} to {} °/h (± {:.2}, {:.2}, {:.2}).",
            of(&self.before),
            of(&self.after),
            std[0],
            std[1],
            std[2]
        );
        match self.level(plan) {
            Some(level) => format!("{drift} {level}"),
            None => drift,
        }
    }

    /// Level of the noise on held-out time, where it is another than on the fitted.
    fn level(&self, plan: &AttitudeHeldOutPlan) -> Option<String> {
        let power = self.power_after;
        let words = match power {
            power if power < plan.same_level[0] => "quieter",
            power if power > plan.same_level[1] => "louder",
            _ => return None,
        };
        Some(format!(
            "It is {words} than the fitted time, with {power:.3} of the noise's mean power: the noise is not stationary, and the fit weights rows by its level in time."
        ))
    }
}

/// Residuals of the held-out stamps, or of all, about an alignment; by row, free rows at 0.
struct Residual {
    /// In the navigation frame \[rad\].
    left_rad: Triad,
    /// Of each gyro as recorded \[rad\].
    body_rad: Triad,
    /// Turn between stamps, of the motion without noise common to the residual \[rad\].
    turned_rad: Triad,
    times_s: Vec<f64>,
    period_s: f64,
    free: Vec<usize>,
    /// Axes and signs of the gyros as recorded, from those of the case.
    recorded_from_case: Matrix3<f64>,
}

impl Residual {
    fn rows(&self) -> usize {
        self.times_s.len() - 1
    }

    fn is_used(&self, row: usize) -> bool {
        self.free.binary_search(&row).is_err()
    }
}

fn residual(
    said: &Said,
    known: &Stamps,
    alignment: &Alignment,
    with_effects: bool,
) -> Option<Residual> {
    let observed = said.observed;
    let gyros = match with_effects {
        true => Cow::Borrowed(&observed.gyros),
        false => observed.gyros_as_read(),
    };
    let about = About::new(&gyros, &observed.samples, known, alignment)?;
    let mut left_rad = about.increments.rows_rad.clone();
    if with_effects {
        let physics = said.found.physics.iter();
        let physics = physics.flat_map(|named| said.columns(named, &about));
        // Columns follow the order of all parameters; unnamed ones are at the model's values.
        let found = said.found;
        for (column, place) in about.columns().chain(physics).zip(&found.set) {
            let named = found.named_set.iter().position(|one| one == place);
            let total = named.map_or(0.0, |at| found.of_named.values[at]);
            let size = total - said.beyond.get(*place).copied().unwrap_or(0.0);
            add_triad(&mut left_rad, &column, -size);
        }
    }
    about.increments.silence_free(&mut left_rad, |_| true);
    let recorded_from_case = orthogonal(&observed.recorded_from_case);
    Some(Residual {
        body_rad: mapped(&body_rows(&about, &left_rad), &recorded_from_case),
        left_rad,
        turned_rad: turned_rad(&about),
        recorded_from_case,
        times_s: about.increments.times_s,
        period_s: about.increments.period_s,
        free: about.increments.free,
    })
}

/// Computes the figures; `None` if too few stamps are held out.
pub(crate) fn held_out(said: &Said) -> Option<HeldOut> {
    let plan = &said.plan.attitude;
    let known = &said.registered.known;
    let is_tested = &said.observed.tested;
    let with = |left_out: Vec<bool>| Stamps {
        left_out,
        jumped: known.jumped.clone(),
    };
    let tested = with(is_tested.iter().map(|tested| !tested).collect());
    // All stamps except known and detected faults.
    let pairs = known.left_out.iter().zip(is_tested);
    let sound = with(
        pairs
            .map(|(left_out, tested)| *left_out && !tested)
            .collect(),
    );
    let now = &said.registered.alignment;
    let before = residual(said, &tested, said.of_model, false)?;
    let after = residual(said, &tested, now, true)?;
    if after.rows() < plan.held_out.least_rows {
        return None;
    }
    let levels = &said.registered.levels;
    let fitted_period_s = said.registered.about.increments.period_s;
    let figures = |one: &Residual| figures(one, (levels, fitted_period_s), &plan.noise);
    let (before_figures, _) = figures(&before);
    let (after_figures, power_after) = figures(&after);
    let (times, period_s) = (&after.times_s, after.period_s);
    let span_s = [times[0], times[times.len() - 1]];
    drop((before, after));
    // Of the residual before, the pictures show that in the body's axes.
    let all_before_rad = residual(said, &sound, said.of_model, false)?.body_rad;
    let all_after = residual(said, &sound, now, true)?;
    let plan = &said.plan.signal;
    let left = blocks(&all_after, &plan.in_step);
    Some(HeldOut {
        span_s,
        band_hz: [0.0, 0.5 / period_s],
        before: before_figures,
        after: after_figures,
        power_after,
        in_step: in_step::in_step(&left, &plan.in_step),
        residual: residual_entry(&all_after, &left, &plan.coherence),
        pictures: pictures(said, &all_before_rad, &all_after, span_s),
    })
}

/// Powers of residual and motion, by blocks of time.
fn blocks(one: &Residual, plan: &InStepPlan) -> Vec<Block> {
    let is_used = |row: usize| one.is_used(row);
    in_step::blocks(&one.left_rad, &one.turned_rad, is_used, one.period_s, plan)
}

/// Residual relative to the motion, in the axes of the gyros.
fn residual_entry(one: &Residual, blocks: &[Block], plan: &CoherencePlan) -> Option<ResidualEntry> {
    let rows = Rows {
        residual_rad: &one.body_rad,
        motion_rad: &mapped(&one.turned_rad, &one.recorded_from_case),
        is_used: &|row| one.is_used(row),
        period_s: one.period_s,
    };
    relative_residual::entry(&rows, blocks, plan)
}

/// Turn between stamps, of the motion without noise common to the residual \[rad\].
fn turned_rad(about: &About) -> Triad {
    about.conditioned_rad.each_ref().map(|motion_rad| {
        let begun = |place: &Place| place.share * motion_rad.get(place.row).unwrap_or(&0.0);
        let pairs = about.increments.places().windows(2);
        pairs
            .map(|pair| {
                let whole_rows: f64 = motion_rad[pair[0].row..pair[1].row].iter().sum();
                whole_rows - begun(&pair[0]) + begun(&pair[1])
            })
            .collect()
    })
}

fn body_rows(about: &About, left_rad: &Triad) -> Triad {
    let mut rows: Triad = std::array::from_fn(|_| Vec::with_capacity(left_rad[0].len()));
    // An excess of the gyros appears in the reference's error with opposite sign.
    let body = |row: usize| {
        let value = Vector3::from_fn(|axis, _| left_rad[axis][row]);
        -about.increments.in_body(&about.motion, row, value)
    };
    for body in (0..about.increments.rows()).map(body) {
        for (rows, value) in rows.iter_mut().zip(body.iter()) {
            rows.push(*value);
        }
    }
    rows
}

/// # Inputs
/// `levels`, `period_s`: noise levels and period of the fitted rows.
fn figures(
    one: &Residual,
    (levels, period_s): (&Levels, f64),
    plan: &AttitudeNoisePlan,
) -> ([FiguresEntry; 3], f64) {
    let rows = one.rows();
    let band = Band::new(rows, period_s, &plan.band);
    let terms = NoiseTerms::new(rows, period_s, band.cut, false, plan);
    let powers = [0, 1, 2].map(|axis| terms.of_coefficients(levels.of(axis)));
    let drift = |axis: usize| {
        let noise = (levels.of(axis), &powers[axis][..]);
        drift(&one.body_rad[axis], &one.free, noise).map(|by_row| by_row / one.period_s)
    };
    let drifts = [0, 1, 2].map(drift);
    let count = (band.cut.max(one.free.len() + 2) - 1 - one.free.len()) as f64;
    let ratios = [0, 1, 2].map(|axis: usize| {
        let rows = (&one.left_rad[axis][..], &powers[axis][..]);
        let power = power_beside_free(&band, rows, &one.free);
        power / count
    });
    let entry = |axis: usize| FiguresEntry {
        drift_rad_s: drifts[axis][0],
        drift_std_rad_s: drifts[axis][1],
        normalised_power: ratios[axis],
        normalised_power_all: ratios[axis],
        white_p_value: ChiSquared::new(count).map_or(1.0, |law| law.sf(ratios[axis] * count)),
    };
    (
        [entry(0), entry(1), entry(2)],
        ratios.iter().sum::<f64>() / 3.0,
    )
}

/// Mean of rows and its standard deviation by generalised least squares: under white noise of an attitude, whose differences the
/// rows are, the slope of its error and no difference of two ends.
///
/// # Inputs
/// `free`: rows without a value; `levels`, `powers`: of the noise's terms, and of every coefficient.
fn drift(rows: &[f64], free: &[usize], (levels, powers): (&[f64], &[f64])) -> [f64; 2] {
    let is_free = |row: usize| free.binary_search(&row).is_ok();
    // Weights of a random walk and white noise of the angle, whose covariance is tridiagonal: correlated noise counts as white.
    let (walk, angle) = (levels[0], levels[1..].iter().sum::<f64>());
    let own = (walk + 2.0 * angle).max(f64::MIN_POSITIVE);
    /// Variance of a row without a value over that of others.
    const UNKNOWN: f64 = 1e12;
    let variance = |row: usize| if is_free(row) { UNKNOWN * own } else { own };
    let mut weights: Vec<f64> = (0..rows.len())
        .map(|row| f64::from(!is_free(row)))
        .collect();
    // Thomas' algorithm.
    let mut ahead = vec![0.0; rows.len()];
    for row in 0..rows.len() {
        let (before, carried) = match row {
            0 => (0.0, 0.0),
            _ => (weights[row - 1], ahead[row - 1]),
        };
        let pivot = variance(row) + angle * carried;
        ahead[row] = -angle / pivot;
        weights[row] = (weights[row] + angle * before) / pivot;
    }
    for row in (1..rows.len()).rev() {
        weights[row - 1] -= ahead[row - 1] * weights[row];
    }
    let used = || (0..rows.len()).filter(|row| !is_free(*row));
    let sum: f64 = used().map(|row| weights[row]).sum();
    let mean = used().map(|row| weights[row] * rows[row]).sum::<f64>() / sum;
    let mut spectrum = weights;
    Dct::new(rows.len()).forward(&mut spectrum);
    let variance = spectrum
        .iter()
        .zip(powers)
        .map(|(value, power)| value * value * power);
    [mean, variance.sum::<f64>().sqrt() / sum]
}

/// Power of rows over that of their noise, summed over the coefficients beyond the mean, with the free rows at their best: an
/// angle that is differenced keeps that of its two ends, which silence does not take away.
fn power_beside_free(band: &Band, (rows, powers): (&[f64], &[f64]), free: &[usize]) -> f64 {
    let white = |spectrum: Vec<f64>| -> DVector<f64> {
        let pairs = spectrum.into_iter().zip(powers).skip(1);
        let each: Vec<f64> = pairs.map(|(value, power)| value / power.sqrt()).collect();
        each.into()
    };
    let values = white(band.spectrum(rows));
    let columns: Vec<DVector<f64>> = free.iter().map(|row| white(band.of_row(*row))).collect();
    let gram = DMatrix::from_fn(free.len(), free.len(), |a, b| columns[a].dot(&columns[b]));
    let moments = DVector::from_fn(free.len(), |a, _| columns[a].dot(&values));
    let explained = moments.dot(&(rlg_inference::linear::pseudo_inverse(&gram) * &moments));
    values.norm_squared() - explained
}

fn pictures(said: &Said, body_before: &Triad, after: &Residual, held_out_s: [f64; 2]) -> Pictures {
    /// Most points of a plot.
    const POINTS: usize = 2000;
    let times = &after.times_s;
    let rows = after.rows().min(body_before[0].len());
    let each = rows.div_ceil(POINTS).max(1);
    let body_after = &after.body_rad;
    let angles = |body: &Triad| {
        body.each_ref().map(|values| {
            let mut sum = 0.0;
            let sums = values.iter().take(rows).map(|value| {
                sum += value;
                sum
            });
            sums.step_by(each).collect::<Vec<f64>>()
        })
    };
    let period_s = after.period_s;
    let piece = (rows / 4).clamp(2, 2048) & !1;
    // One-sided density of a rate from the power of increments by row.
    let density = 2.0 / period_s;
    let spectrum = |body: &Triad| {
        body.each_ref().map(|values| {
            let power = mean_periodogram(values, piece);
            power[1..]
                .iter()
                .map(|power| power * density)
                .collect::<Vec<f64>>()
        })
    };
    let frequency_hz: Vec<f64> = (1..=piece / 2)
        .map(|bin| bin as f64 / (piece as f64 * period_s))
        .collect();
    let fitted_period_s = said.registered.about.increments.period_s;
    let plan = &said.plan.attitude.noise;
    let terms = NoiseTerms::new(piece, fitted_period_s, piece, false, plan);
    let noise = [0, 1, 2].map(|axis| {
        let powers = terms.of_coefficients(said.registered.levels.of(axis));
        let bins = 0..frequency_hz.len();
        bins.map(|bin| density * powers[(2 * (bin + 1)).min(piece - 1)])
            .collect()
    });
    let streams = &said.observed.streams;
    Pictures {
        time_s: times[1..=rows].iter().step_by(each).copied().collect(),
        angle_before_rad: angles(body_before),
        angle_after_rad: angles(body_after),
        power_before: spectrum(body_before),
        power_after: spectrum(body_after),
        power_noise: noise,
        frequency_hz,
        tiles_before: Vec::new(),
        tiles_after: Vec::new(),
        significance: said.plan.judgement.tiles.significance,
        held_out_s: vec![held_out_s],
        rate_hz: streams.rate_hz,
        start_s: streams.start_s,
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};
    use rlg_plan::AttitudeNoisePlan;

    use super::drift;
    use crate::likelihood::noise::NoiseTerms;

    #[test]
    fn the_drift_beside_white_angle_noise_is_a_slope_with_its_standard_deviation() {
        const ROWS: usize = 600;
        const SLOPE: f64 = 2e-3;
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let plan = AttitudeNoisePlan::default();
        let terms = NoiseTerms::new(ROWS, 0.02, ROWS, false, &plan);
        let mut levels = vec![0.0; terms.count()];
        // The walk is far below the angle's noise of 1.
        (levels[0], levels[1]) = (1e-8, 1.0);
        let powers = terms.of_coefficients(&levels);
        let free = [300];
        let trials: Vec<f64> = (0..200)
            .map(|_| {
                let angles: Vec<f64> = (0..=ROWS).map(|_| normal()).collect();
                let mut rows: Vec<f64> = angles
                    .windows(2)
                    .map(|pair| pair[1] - pair[0] + SLOPE)
                    .collect();
                rows[300] = 0.0;
                let [mean, std] = drift(&rows, &free, (&levels, &powers));
                (mean - SLOPE) / std
            })
            .collect();
        let square = trials.iter().map(|one| one * one).sum::<f64>() / trials.len() as f64;
        assert!((0.8..1.25).contains(&square), "{square}");
        // A least-squares line of each half: sigma sqrt(12 / n^3) / sqrt 2.
        let rows = vec![SLOPE; ROWS];
        let [_, std] = drift(&rows, &free, (&levels, &powers));
        let of_lines = (12.0 / 300_f64.powi(3)).sqrt() / 2_f64.sqrt();
        assert!((std / of_lines - 1.0).abs() < 0.05, "{std} {of_lines}");
    }
}
