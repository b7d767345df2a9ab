//! Strength of an effect in a recording with an attitude reference: matched-filter SNR given the alignment parameters of
//! the two instruments.
//!
//! The signal of an effect is the growth, from stamp to stamp, of the gyros' attitude less that of the reference; in the
//! navigation frame its noise is the same about all axes, random walk of the gyros and white noise of the stamps.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use super::path::Path;
use crate::bounds::beside;
use crate::marks::case::Case;
use crate::marks::effects::{AXES, Effect};
use crate::marks::kinds::find;
use crate::marks::noise::{Levels, Weighting, dct, product};

/// Kinds that align gyros and reference: nuisance parameters of every diagnosis.
const ALIGNMENT: [&str; 4] = ["gyro_bias", "gyro_scale", "installation", "reference_delay"];

/// The gyros' filters, of which all six flexures alike cannot be distinguished beside attitudes; and a small one \[s²\].
const BANDWIDTH: &str = "gyro_bandwidth";
const SMALL_S2: f64 = 1e-6;

/// Stamps of a reference with a case.
pub struct Stamped<'a> {
    path: &'a Path<'a>,
    case: &'a Case,
    stamps_s: &'a [f64],
    attitudes: Vec<UnitQuaternion<f64>>,
    weightings: [Weighting; 3],
}

impl<'a> Stamped<'a> {
    /// Prepares the stamps of a reference with noise of `levels`.
    pub fn new((path, case): (&'a Path, &'a Case), stamps_s: &'a [f64], levels: &Levels) -> Self {
        let rows = stamps_s.len() - 1;
        let period_s = (stamps_s[rows] - stamps_s[0]) / rows as f64;
        let weighting = Weighting::new(levels, rows, period_s);
        Self {
            path,
            case,
            stamps_s,
            attitudes: stamps_s.iter().map(|time_s| path.at(*time_s)).collect(),
            weightings: std::array::from_fn(|_| weighting.clone()),
        }
    }

    /// Returns the SNR of an effect given the alignment parameters of the two instruments.
    ///
    /// # Inputs `added_rad`: contribution of an effect to the gyros' increments, by row.
    pub fn rho(&self, effect: &Effect, added_rad: &dyn Fn(&Effect) -> [Vec<f64>; 3]) -> f64 {
        let shape = |effect: &Effect| self.shape(effect, added_rad);
        let own = shape(effect);
        // A misalignment of the reference is equivalent to an installation error.
        let is_own = |kind: &str| {
            kind == effect.kind
                || (kind == "installation" && effect.kind == "reference_misalignment")
        };
        let others = ALIGNMENT
            .into_iter()
            .filter(|kind| !is_own(kind))
            .filter_map(find);
        let smoothed = AXES
            .iter()
            .filter(|_| !is_own(BANDWIDTH))
            .map(|axis| Effect {
                kind: BANDWIDTH,
                axis: None,
                values: BTreeMap::from([((*axis).to_owned(), SMALL_S2)]),
            });
        let columns: Vec<[Vec<f64>; 3]> = others
            .flat_map(|kind| kind.columns(effect))
            .chain(smoothed)
            .map(|column| shape(&column))
            .collect();
        let inner = |a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]| product(&self.weightings, a, b);
        let count = columns.len();
        let gram = DMatrix::from_fn(count, count, |a, b| inner(&columns[a], &columns[b]));
        let against = DVector::from_fn(count, |a, _| inner(&own, &columns[a]));
        // A column that is not excited by the motion has no power.
        let shown: Vec<usize> = (0..count).filter(|&a| gram[(a, a)] > 0.0).collect();
        beside(&gram, inner(&own, &own), &against, &shown).sqrt()
    }

    /// Returns the DCTs of the growth of the attitude's error from stamp to stamp \[rad\].
    fn shape(
        &self,
        effect: &Effect,
        added_rad: &dyn Fn(&Effect) -> [Vec<f64>; 3],
    ) -> [Vec<f64>; 3] {
        let errors = match effect.kind {
            "reference_delay" => {
                self.by_reference(&|time_s| self.path.rate_rad_s(time_s) * -effect.value("all"))
            }
            "reference_misalignment" => self.by_reference(&|_| effect.by_axis()),
            _ => self.by_gyros(&added_rad(effect)),
        };
        std::array::from_fn(|axis| {
            let grown: Vec<f64> = errors
                .windows(2)
                .map(|pair| pair[1][axis] - pair[0][axis])
                .collect();
            dct(&grown)
        })
    }

    /// Attitude errors of a reference, given as small angles in the body.
    fn by_reference(&self, in_body: &dyn Fn(f64) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let pairs = self.attitudes.iter().zip(self.stamps_s);
        pairs
            .map(|(attitude, time_s)| attitude * in_body(*time_s))
            .collect()
    }

    /// Attitude errors of gyros with added increments.
    fn by_gyros(&self, added_rad: &[Vec<f64>; 3]) -> Vec<Vector3<f64>> {
        let attitudes = self.path.at_ends(0.0, self.case.rows);
        let mut error = Vector3::zeros();
        let mut at_ends = vec![error];
        for row in 0..self.case.rows {
            error += attitudes[row] * Vector3::from_fn(|axis, _| added_rad[axis][row]);
            at_ends.push(error);
        }
        let at = |time_s: &f64| {
            let place = (time_s / self.case.period_s).clamp(0.0, self.case.rows as f64 - 1e-9);
            let row = place as usize;
            let share = place - row as f64;
            at_ends[row] * (1.0 - share) + at_ends[row + 1] * share
        };
        self.stamps_s.iter().map(at).collect()
    }
}
