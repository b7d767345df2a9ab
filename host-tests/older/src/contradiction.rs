//! Names that the held-out part contradicts (diagnosis road, step 9).
//!
//! Enters: what was found, and what it leaves of the held-out rows. Leaves: the effects whose parameters, measured on
//! those rows alone, are not what was fitted on the others; and what was found, with such an effect's name taken back.
//!
//! Held out, g = Jᵀ S⁻¹ r scatters about nothing with the covariance F + F C F: its own noise, and the error C of the
//! fit seen through the held-out information F. Only a name can be lost here; no name or size comes of it. Left out:
//! gyros at rest, recordings longer than memory and attitudes, whose own validation says what drifts.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use std::ops::Range;

use super::empirical::{Form, Term};
use super::hunt::{self, Alike, Catch, FoundTerm};
use super::hypotheses::{CATALOGUE, no_effects};
use super::information::scaled_inverse;
use super::invariance::{LEAST_SNR, SYSTEMATIC};
use super::portion::Portion;
use super::pulses;
use super::scene::Scene;
use super::select::Chosen;
use super::streams::{AXES, Triad};
use super::workbench::{Parameters, Workbench};

/// Chance below which the held-out rows contradict a name.
const CONTRADICTED: f64 = 1e-3;

/// What a weak effect that is not in the fit may take of a strong one's numbers, each by itself, without making its name
/// wrong: a cubic scale of SNR 100 is no other physics for the quadratic one of SNR 10 beside it.
const OF_ANOTHER: f64 = 0.05;

/// What the held-out rows say of one chosen effect.
#[derive(Clone, Copy)]
pub(super) struct HeldOut {
    /// Its size there over the fitted one.
    amplitude: f64,
    /// Standard deviation of that, the fit's own share within.
    std: f64,
    /// Chance of parameters this far from the fitted ones.
    p_value: f64,
}

impl HeldOut {
    /// Of an effect with these `values`: Fisher information on the held-out rows, what they show beyond the values, and
    /// how that scatters. `None` where those rows hardly show the effect.
    pub(super) fn of(
        values: &DVector<f64>,
        fisher: &DMatrix<f64>,
        found: &DVector<f64>,
        spread: &DMatrix<f64>,
    ) -> Option<Self> {
        let pattern = fisher * values;
        let power = values.dot(&pattern);
        if power < LEAST_SNR * LEAST_SNR {
            return None;
        }
        let mut imperfect = &pattern * pattern.transpose() * SYSTEMATIC * SYSTEMATIC;
        for (value, column) in values.iter().zip(fisher.column_iter()) {
            let of_one = column * (*value * OF_ANOTHER);
            imperfect += &of_one * of_one.transpose();
        }
        let spread = spread + imperfect;
        let distance = found.dot(&(scaled_inverse(&spread) * found));
        let law = ChiSquared::new(values.len() as f64).ok()?;
        let amplitude = 1.0 + values.dot(found) / power;
        let std = values.dot(&(&spread * values)).sqrt() / power;
        let of_size = 2.0 * Normal::standard().sf((amplitude - 1.0).abs() / std);
        // Two tests of one question: all its parameters, and its size as a whole.
        let p_value = (2.0 * law.sf(distance).min(of_size)).min(1.0);
        Some(Self {
            amplitude,
            std,
            p_value,
        })
    }

    /// Why the name is taken back, where it is.
    pub(super) fn contradicts(&self) -> Option<String> {
        (self.p_value < CONTRADICTED).then(|| {
            format!(
                "on held-out time it is {:.2} ± {:.2} of the fitted size (chance {:.1e})",
                self.amplitude, self.std, self.p_value
            )
        })
    }
}

/// Takes back every name that the held-out rows contradict, and says whether there was any. `rows` are what everything
/// found leaves of the recording, and which are held out. What had such a name stays modelled, as expressions in measured
/// channels, where its columns are such.
pub fn take_back(
    bench: &Workbench,
    parameters: &Parameters,
    catch: &mut Catch,
    rows: (&Triad, &[Range<usize>]),
) -> bool {
    let said = ask(bench, parameters, catch, rows);
    let before = said.len();
    // From the last, so that the places before stay.
    for (place, said) in said.into_iter().enumerate().rev() {
        let Some(why) = said.and_then(|said| said.contradicts()) else {
            continue;
        };
        let one = catch.choice.chosen.remove(place);
        catch.regimes.remove(place);
        catch.vetoed.push((one.effect, why));
        catch.terms.extend(as_terms(bench.scene(), &one));
    }
    catch.choice.chosen.len() < before
}

/// An effect as expressions in measured channels: what of it says something.
fn as_terms(scene: &Scene, one: &Chosen) -> Vec<FoundTerm> {
    let effect = CATALOGUE[one.effect];
    let values = one.values.as_slice();
    let mut terms = Vec::new();
    for (parameter, &value) in values.iter().enumerate() {
        let std = one.covariance[(parameter, parameter)].sqrt();
        if value.abs() < LEAST_SNR * std {
            continue;
        }
        for axis in 0..AXES.len() {
            let Some(expression) = effect.expression(parameter, axis) else {
                continue;
            };
            let form = Form::Product { expression };
            let term = Term { axis, form };
            let both = effect
                .column(scene, values, parameter, axis)
                .zip(term.column(scene).ok());
            let Some((own, column)) = both else { continue };
            let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
            let per_unit = dot(&own, &column) / dot(&column, &column);
            terms.push(FoundTerm {
                term,
                size: value * per_unit,
                std: std * per_unit.abs(),
                with_next: 0.0,
                alike: Alike::default(),
                ratio: (value / std).powi(2),
                p_value: one.p_value,
            });
        }
    }
    terms
}

/// Asks the held-out rows about every chosen effect; `None` where they do not show it. `left_rad` is what everything
/// found leaves of the recording, `bench` the one it was fitted on.
fn ask(
    bench: &Workbench,
    parameters: &Parameters,
    catch: &Catch,
    (left_rad, held_out): (&Triad, &[Range<usize>]),
) -> Vec<Option<HeldOut>> {
    let chosen = &catch.choice.chosen;
    let nothing = || vec![None; chosen.len()];
    let Some(portion) = Portion::new(held_out.to_vec(), bench.scene().streams.rate_hz) else {
        return nothing();
    };
    let portion = portion.within(bench.portion.band_hz);
    let set: Vec<usize> = chosen.iter().map(|one| one.effect).collect();
    let mut at = no_effects();
    for one in chosen {
        at[one.effect] = one.values.iter().copied().collect();
    }
    let mut there = Workbench::new(
        bench.scene(),
        left_rad,
        parameters,
        portion,
        bench.noise,
        &set,
        &at,
    );
    let in_step = pulses::in_step(&there, parameters);
    there.allow_for(in_step);
    let said = there.own_information();
    let indices = parameters.of_all(&set);
    let terms = catch.information.parameters - parameters.count();
    let (_, fitted) = hunt::fit(parameters, &catch.information, &set, terms);
    let count = indices.len();
    let fisher = DMatrix::from_fn(count, count, |a, b| said.fisher[(indices[a], indices[b])]);
    let found = DVector::from_fn(count, |a, _| said.right[indices[a]]);
    let of_fit = fitted.covariance.view((0, 0), (count, count)).into_owned();
    let spread = &fisher + &fisher * of_fit * &fisher;
    chosen
        .iter()
        .map(|one| {
            let start = parameters.of(one.effect).start;
            let first = indices.iter().position(|&index| index == start)?;
            let own = one.values.len();
            HeldOut::of(
                &one.values,
                &fisher.view((first, first), (own, own)).into_owned(),
                &found.rows(first, own).into_owned(),
                &spread.view((first, first), (own, own)).into_owned(),
            )
        })
        .collect()
}
