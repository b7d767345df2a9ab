//! Recordings of increments with a reference of increments: a setting, and concealed effects at a matched-filter SNR.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::case::{Case, Unit, Warming};
use super::courses;
use super::effects::{Effect, Strong};
use super::family::Family;
use super::kinds::KindRow;
use super::motion::Motion;
use super::noise::{Weighting, dct, product};
use super::setting::{Limits, MOTIONS, Setting, draw_strength};
use crate::bounds::beside;

/// Least share of an effect's SNR in a pair that must remain given the other kind: below it a recording shows one effect,
/// not two.
const LEAST_BESIDE: f64 = 0.8;

/// Number of settings drawn before another kind is taken, if none can show the first.
const ATTEMPTS: usize = 20;

/// Drawn recording of increments.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Instruments and length.
    pub setting: Setting,
    /// Motion of the case.
    pub motion: Motion,
    /// Motion of the reference's case, if unrelated.
    pub of_another_case: Option<Motion>,
    /// Warming of the blocks, if thermometers are recorded.
    pub warming: Option<[Warming; 3]>,
    /// Constants known to the model.
    pub unit: Unit,
    /// Concealed effects.
    pub effects: Vec<Strong>,
}

impl Rows {
    /// Draws a setting and its concealed effects.
    pub fn draw(family: Family, limits: &Limits, rng: &mut ChaCha8Rng) -> Self {
        let limits = family.limits(limits);
        loop {
            let kinds = family.kinds(rng);
            for _ in 0..ATTEMPTS {
                if let Some(drawn) = Self::attempt(family, &limits, &kinds, rng) {
                    return drawn;
                }
            }
        }
    }

    /// Draws one setting; `None` if it cannot show the kinds at the drawn strengths.
    pub fn attempt(
        family: Family,
        limits: &Limits,
        kinds: &[KindRow],
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let motions: Vec<_> = MOTIONS
            .into_iter()
            .filter(|motion| kinds.iter().all(|kind| kind.motions().contains(motion)))
            .collect();
        let drift = family.drift(rng);
        let mut setting = Setting::draw(rng, limits, drift, &motions);
        for kind in kinds {
            kind.equip(&mut setting);
        }
        let motion = courses::draw(&setting, rng);
        let warming = setting.has_temperature.then(|| {
            let length_s = setting.length_s();
            std::array::from_fn(|_| Warming::draw(length_s, rng))
        });
        let mut drawn = Self {
            of_another_case: (family == Family::Unrelated).then(|| courses::draw(&setting, rng)),
            setting,
            motion,
            warming,
            unit: Unit::draw(rng),
            effects: Vec::new(),
        };
        if kinds.is_empty() {
            return Some(drawn);
        }
        let case = drawn.case();
        let weightings = drawn.weightings();
        for kind in kinds {
            let pattern = kind.draw(&drawn.setting, &drawn.motion, rng)?;
            let strong = drawn.scale(
                &pattern,
                kind.largest,
                (&case, &weightings),
                draw_strength(rng),
            )?;
            drawn.effects.push(strong);
        }
        for (own, other) in [(0, 1), (1, 0)] {
            if let (Some(strong), Some(rival)) = (drawn.effects.get(own), kinds.get(other)) {
                let left = drawn.rho_beside(strong, rival, &drawn.effects[other], &case);
                if left < LEAST_BESIDE * strong.rho {
                    return None;
                }
            }
        }
        Some(drawn)
    }

    /// Returns the remaining SNR given every effect of another kind.
    fn rho_beside(&self, strong: &Strong, rival: &KindRow, drawn: &Strong, case: &Case) -> f64 {
        let weightings = self.weightings();
        let own = self.shape(&strong.effect, case);
        let columns: Vec<[Vec<f64>; 3]> = rival
            .columns(&drawn.effect)
            .iter()
            .map(|column| self.shape(column, case))
            .collect();
        let count = columns.len();
        let gram = DMatrix::from_fn(count, count, |a, b| {
            product(&weightings, &columns[a], &columns[b])
        });
        let against = DVector::from_fn(count, |a, _| product(&weightings, &own, &columns[a]));
        // A column that is not excited by the motion has no power.
        let shown: Vec<usize> = (0..count).filter(|&a| gram[(a, a)] > 0.0).collect();
        beside(&gram, strong.rho.powi(2), &against, &shown).sqrt()
    }

    /// Returns the input of the instruments.
    pub fn case(&self) -> Case {
        Case::new(&self.setting, &self.motion, self.warming)
    }

    /// Returns the case of the reference, if unrelated.
    pub fn other_case(&self) -> Option<Case> {
        let motion = self.of_another_case.as_ref()?;
        Some(Case::new(&self.setting, motion, None))
    }

    /// Returns the DCTs of an effect in the three residuals.
    pub fn shape(&self, effect: &Effect, case: &Case) -> [Vec<f64>; 3] {
        let sensing_from_body = self.unit.sensing_from_body();
        let added = effect.perturbation(case, &sensing_from_body);
        std::array::from_fn(|axis| dct(&added.residual_rad(axis, &sensing_from_body)))
    }

    /// Returns the inverse covariances of the added noise, by gyro.
    pub fn weightings(&self) -> [Weighting; 3] {
        let (rows, period_s) = (self.setting.rows, self.setting.period_s());
        std::array::from_fn(|axis| {
            Weighting::new(&self.setting.residual_levels(axis), rows, period_s)
        })
    }

    /// Scales an effect to a strength; `None` if its size is not credible for an instrument.
    fn scale(
        &self,
        pattern: &Effect,
        largest: f64,
        (case, weightings): (&Case, &[Weighting; 3]),
        rho: f64,
    ) -> Option<Strong> {
        // Delays are nonlinear in their size: a small one first.
        const SMALL: f64 = 1e-3;
        let mut effect = pattern.scaled(SMALL * largest);
        let mut shape = self.shape(&effect, case);
        for _ in 0..2 {
            let now = product(weightings, &shape, &shape).sqrt();
            if now <= 0.0 {
                return None;
            }
            effect = effect.scaled(rho / now);
            if effect.largest() > largest {
                return None;
            }
            shape = self.shape(&effect, case);
        }
        let rho = product(weightings, &shape, &shape).sqrt();
        Some(Strong { effect, rho })
    }
}
