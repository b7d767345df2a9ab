//! The same coefficients in every regime, or the name is vetoed (diagnosis road, step 7).
//!
//! Enters: the chosen effects' values and covariance, the noise, the regimes. Leaves: for each effect its
//! amplitude λ in each regime (1 = as fitted on all of them) and the chance of such a scatter if the
//! physics were right. A wrong name fits its own regime and fails in the next.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::declare::REGRESSOR_FIDELITY;
use super::hypotheses::CATALOGUE;
use super::noise::Noise;
use super::portion::{Bins, Portion, inner};
use super::scene::Scene;
use super::select::Chosen;
use super::split::{Regime, intersect};
use super::streams::{Triad, add, add_triad};
use super::workbench::{Parameters, Workbench};

/// An effect with less than this matched-filter SNR in a regime says nothing about itself there.
pub(super) const LEAST_SNR: f64 = 3.0;

/// A regime in which the effect has less than this share of its power elsewhere shows only what the noise of
/// the reference puts into the regressor.
const LEAST_SHARE: f64 = 1e-2;

/// Amplitudes may differ by what imperfect regressors and the covariance of the joint fit leave.
pub(super) const SYSTEMATIC: f64 = 10.0 * REGRESSOR_FIDELITY;

/// The amplitude of one effect in one regime.
#[derive(Debug, Clone)]
pub struct Amplitude {
    /// The regime's name.
    pub regime: String,
    /// λ.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// What the regimes say about one effect.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// One entry per regime that shows the effect.
    pub amplitudes: Vec<Amplitude>,
    /// Chance of the scatter under constant physics.
    pub p_value: f64,
}

/// Tests every chosen effect. `values` are all fitted (parameter index, value).
pub fn test(
    bench: &Workbench,
    parameters: &Parameters,
    chosen: &[Chosen],
    values: &[(usize, f64)],
    regimes: &[Regime],
) -> Vec<Verdict> {
    let scene: &Scene = bench.scene();
    // The full fit, effect by effect, in time.
    let predictions: Vec<Triad> = chosen
        .iter()
        .map(|one| CATALOGUE[one.effect].prediction(scene, one.values.as_slice()))
        .collect();
    let mut left: Triad = bench.residual_rad().clone();
    for prediction in &predictions {
        add_triad(&mut left, prediction, -1.0);
    }
    for (place, term) in bench.terms().iter().enumerate() {
        let index = parameters.count() + place;
        let size = values
            .iter()
            .find(|(known, _)| *known == index)
            .map_or(0.0, |(_, size)| *size);
        if let Ok(column) = term.column(scene) {
            add(&mut left[term.axis], &column, -size);
        }
    }
    let whole: Vec<Regime> = whole_recordings(scene);
    chosen
        .iter()
        .zip(&predictions)
        .map(|(one, prediction)| {
            let of = |regimes: &[Regime]| scatter(bench, prediction, &left, regimes);
            let mut verdict = of(regimes);
            if let Some(beside) = bench.beside() {
                let own = parameters.of(one.effect);
                let (slowly, everywhere) = beside.amplitudes(&bench.noise, values, &own);
                let rows = bench.portion.ranges.clone();
                let rows = amplitude_in(bench, prediction, &left, rows, "the stretches");
                // Rows and blocks measure one size; neither is dropped for being the weaker.
                let both = [rows.map(|(_, amplitude)| amplitude), everywhere];
                let both = both.into_iter().flatten().map(|amplitude| (1.0, amplitude));
                // Three tests of one question.
                for further in [self::verdict(slowly), self::verdict(both.collect())] {
                    verdict.p_value = verdict.p_value.min(further.p_value);
                    verdict.amplitudes.extend(further.amplitudes);
                }
                verdict.p_value = (3.0 * verdict.p_value).min(1.0);
            }
            if scene.streams.is_joined() {
                // The same effect must have the same size in each recording; two tests of one question.
                let between = of(&whole);
                verdict.p_value = (2.0 * verdict.p_value.min(between.p_value)).min(1.0);
                verdict.amplitudes.extend(between.amplitudes);
            }
            verdict
        })
        .collect()
}

/// Each recording as one stretch.
fn whole_recordings(scene: &Scene) -> Vec<Regime> {
    let pieces = scene.streams.pieces.iter();
    pieces
        .map(|piece| Regime {
            name: piece.recording.clone(),
            rows: piece.rows.clone(),
        })
        .collect()
}

/// Amplitudes of one effect in some regimes, and the chance that they scatter so.
fn scatter(bench: &Workbench, prediction: &Triad, left: &Triad, regimes: &[Regime]) -> Verdict {
    let measured: Vec<(f64, Amplitude)> = regimes
        .iter()
        .filter_map(|regime| {
            let rows = intersect(std::slice::from_ref(&regime.rows), &bench.portion.ranges);
            amplitude_in(bench, prediction, left, rows, &regime.name)
        })
        .collect();
    verdict(measured)
}

/// The amplitude in some rows of the bench, with its information per second.
fn amplitude_in(
    bench: &Workbench,
    prediction: &Triad,
    left: &Triad,
    rows: Vec<std::ops::Range<usize>>,
    name: &str,
) -> Option<(f64, Amplitude)> {
    let rate_hz = bench.scene().streams.rate_hz;
    let portion = Portion::new(rows, rate_hz)?.within(bench.portion.band_hz);
    let amplitude = amplitude(&bench.noise, &portion, prediction, left, name)?;
    Some((amplitude.std.powi(-2) / portion.seconds(), amplitude))
}

/// The scatter of amplitudes, each with its information per second.
pub(super) fn verdict(measured: Vec<(f64, Amplitude)>) -> Verdict {
    let strongest = measured
        .iter()
        .map(|(density, _)| *density)
        .fold(0.0, f64::max);
    let amplitudes: Vec<Amplitude> = measured
        .into_iter()
        .filter(|(density, _)| *density > LEAST_SHARE * strongest)
        .map(|(_, amplitude)| amplitude)
        .collect();
    let scatter: f64 = amplitudes
        .iter()
        .map(|a| (a.value - 1.0).powi(2) / (a.std * a.std + SYSTEMATIC * SYSTEMATIC))
        .sum();
    let degrees = (amplitudes.len() as f64 - 1.0).max(1.0);
    let p_value = if amplitudes.len() < 2 {
        1.0
    } else {
        ChiSquared::new(degrees).map_or(1.0, |law| law.sf(scatter))
    };
    Verdict {
        amplitudes,
        p_value,
    }
}

/// λ − 1 is what the prediction still finds in what is left, with joints and a free mean rate fitted away.
pub(super) fn amplitude(
    noise: &[Noise; 3],
    portion: &Portion,
    prediction: &Triad,
    left: &Triad,
    name: &str,
) -> Option<Amplitude> {
    let joints = portion.joints();
    let (mut own, mut found) = (0.0, 0.0);
    for axis in 0..3 {
        if prediction[axis].iter().all(|value| *value == 0.0) {
            continue;
        }
        let weights = noise[axis].weights(portion);
        let effect = portion.transform(&prediction[axis]);
        let rest = portion.transform(&left[axis]);
        let project = |bins: &Bins| -> Vec<f64> {
            joints
                .iter()
                .map(|joint| inner(joint, bins, &weights))
                .collect()
        };
        let (of_effect, of_rest) = (project(&effect), project(&rest));
        // Joints of one regime are far apart and nearly orthogonal: one by one is enough here.
        let norms: Vec<f64> = joints
            .iter()
            .map(|joint| inner(joint, joint, &weights))
            .collect();
        let minus = |a: &[f64], b: &[f64]| -> f64 {
            a.iter()
                .zip(b)
                .zip(&norms)
                .map(|((a, b), norm)| a * b / norm)
                .sum()
        };
        own += inner(&effect, &effect, &weights) - minus(&of_effect, &of_effect);
        found += inner(&effect, &rest, &weights) - minus(&of_effect, &of_rest);
    }
    (own > LEAST_SNR * LEAST_SNR).then(|| Amplitude {
        regime: name.to_string(),
        value: 1.0 + found / own,
        std: own.sqrt().recip(),
    })
}
