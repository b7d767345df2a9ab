//! Predictions of the whole catalogue in one scene, from noise-free simulations.
//!
//! For a [`Scene`], [`PredictionProducts`] holds the inner products (Fisher information) of all parameters' unit effects on
//! the residual, whitened by the true noise over the fitted rows, the held-out rows and the whole recording.
//!
//! A prediction is the difference of two noise-free simulations, one with the effect; the residual is the contract's: gyro
//! − \[M⁻¹ case/(1 − s)\] − gain · pickoff difference. The diagnosis' own columns are not used.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::kinds::{LINEAR, Linear, Reach, gyro_of};
use super::scene::{Scene, split};
use super::whiten::{Variances, Whitener};
use rlg_recording::error::InputError;
use rlg_recording::{Quantity, Recording};
use rlg_simulator::{Seeds, simulate};

/// Parts of the rows over which strengths are computed: fitted, held out, all.
pub const PARTS: usize = 3;

/// Prediction on one gyro, whitened over each part.
type Share = (usize, [Vec<f64>; PARTS]);

/// Effect of a unit of one parameter on the residual, by gyro.
#[derive(Debug, Clone, Default)]
pub struct Prediction(Vec<Share>);

impl Prediction {
    /// Inner product over a part.
    pub fn dot(&self, other: &Self, part: usize) -> f64 {
        let mut sum = 0.0;
        for (axis, mine) in &self.0 {
            for (_, its) in other.0.iter().filter(|(its, _)| its == axis) {
                sum += mine[part]
                    .iter()
                    .zip(&its[part])
                    .map(|(a, b)| a * b)
                    .sum::<f64>();
            }
        }
        sum
    }
}

/// Parameter of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// Index into [`LINEAR`].
    pub entry: usize,
    /// The contract's name.
    pub parameter: &'static str,
}

/// Inner products of all predictions over each part.
#[derive(Debug, Clone)]
pub struct PredictionProducts {
    /// Parameters, in order.
    pub names: Vec<Name>,
    /// Inner products.
    pub gram: [DMatrix<f64>; PARTS],
}

/// Prepared scene: its whiteners, its residual without effects, and the catalogue's predictions.
pub struct ScenePredictions<'a> {
    scene: &'a Scene,
    whiteners: [[Whitener; 3]; PARTS],
    nothing: [Vec<f64>; 3],
    predictions: Vec<Prediction>,
    /// Names and inner products.
    pub products: PredictionProducts,
}

impl<'a> ScenePredictions<'a> {
    /// Simulates the catalogue.
    pub fn open(scene: &'a Scene) -> Result<Self, InputError> {
        let scenario = scene.scenario(false, "")?;
        let [fitted, held_out] = split(&scenario);
        // The first row of a dithered recording lacks the previous pickoff sample: it is a joint in every part.
        let all = std::iter::once(0..scenario.rows()).collect();
        let whiteners = [fitted, held_out, all].map(|ranges: Vec<_>| {
            [0, 1, 2].map(|axis| Whitener::new(Variances::of(scene, axis), &ranges))
        });
        let nothing = residual(scene, "")?;
        let mut scene_predictions = Self {
            scene,
            whiteners,
            nothing,
            predictions: Vec::new(),
            products: PredictionProducts {
                names: Vec::new(),
                gram: [(); PARTS].map(|()| DMatrix::zeros(0, 0)),
            },
        };
        let groups: Vec<(usize, Vec<&'static str>)> = LINEAR
            .iter()
            .enumerate()
            .filter(|(_, entry)| scene.has(entry.needs))
            .flat_map(|(index, entry)| entry.groups().into_iter().map(move |group| (index, group)))
            .collect();
        let found: Vec<Vec<(Name, Prediction)>> = groups
            .par_iter()
            .map(|(index, group)| scene_predictions.of_group(*index, group))
            .collect::<Result<_, InputError>>()?;
        let mut named: Vec<(Name, Prediction)> = found.into_iter().flatten().collect();
        let place = |name: &Name| {
            let names = LINEAR[name.entry].names();
            (
                name.entry,
                names.iter().position(|known| *known == name.parameter),
            )
        };
        named.sort_by_key(|(name, _)| place(name));
        (
            scene_predictions.products.names,
            scene_predictions.predictions,
        ) = named.into_iter().unzip();
        let count = scene_predictions.predictions.len();
        for part in 0..PARTS {
            scene_predictions.products.gram[part] = DMatrix::from_fn(count, count, |a, b| {
                if b > a {
                    0.0
                } else {
                    scene_predictions.predictions[a].dot(&scene_predictions.predictions[b], part)
                }
            });
            scene_predictions.products.gram[part].fill_upper_triangle_with_lower_triangle();
        }
        Ok(scene_predictions)
    }

    fn of_group(
        &self,
        index: usize,
        group: &[&'static str],
    ) -> Result<Vec<(Name, Prediction)>, InputError> {
        let entry = &LINEAR[index];
        let size = entry.typical;
        let at = |size: f64| {
            let values: String = group
                .iter()
                .map(|name| format!("{name} = {size:e}\n"))
                .collect();
            residual(self.scene, &effect(entry.kind, &values))
        };
        let above = at(size)?;
        let (below, step) = if entry.is_delay() {
            (at(-size)?, 2.0 * size)
        } else {
            (self.nothing.clone(), size)
        };
        let slope = |axis: usize| -> Vec<f64> {
            let pairs = above[axis].iter().zip(&below[axis]);
            pairs.map(|(above, below)| (above - below) / step).collect()
        };
        Ok(group
            .iter()
            .map(|parameter| {
                let name = Name {
                    entry: index,
                    parameter,
                };
                let prediction = match (entry.reach, gyro_of(parameter)) {
                    (Reach::Own, Some(axis)) => self.whitened([(axis, slope(axis))]),
                    _ => self.whitened([0, 1, 2].map(|axis| (axis, slope(axis)))),
                };
                (name, prediction)
            })
            .collect())
    }

    fn whitened(&self, shares: impl IntoIterator<Item = (usize, Vec<f64>)>) -> Prediction {
        let one = |(axis, series): (usize, Vec<f64>)| {
            (
                axis,
                [0, 1, 2].map(|part: usize| self.whiteners[part][axis].whiten(&series)),
            )
        };
        Prediction(
            shares
                .into_iter()
                .map(one)
                .filter(|(_, parts): &Share| parts[2].iter().any(|value| *value != 0.0))
                .collect(),
        )
    }

    /// Predicts an effect of any kind, given as TOML.
    pub fn prediction(&self, effect: &str) -> Result<Prediction, InputError> {
        let with = residual(self.scene, effect)?;
        Ok(self.whitened([0, 1, 2].map(|axis: usize| {
            let pairs = with[axis].iter().zip(&self.nothing[axis]);
            (axis, pairs.map(|(with, without)| with - without).collect())
        })))
    }

    /// Inner products of a prediction with the catalogue's over the fitted rows.
    pub fn against(&self, prediction: &Prediction) -> DVector<f64> {
        let products = self
            .predictions
            .iter()
            .map(|known| known.dot(prediction, 0));
        DVector::from_iterator(self.predictions.len(), products)
    }
}

impl PredictionProducts {
    /// Indices of the parameters of a kind.
    pub fn of(&self, kind: &str) -> Vec<usize> {
        let places = self.names.iter().enumerate();
        places
            .filter(|(_, name)| LINEAR[name.entry].kind == kind)
            .map(|(place, _)| place)
            .collect()
    }

    /// Kinds that have parameters in this scene.
    pub fn kinds(&self) -> Vec<&'static Linear> {
        let mut entries: Vec<usize> = self.names.iter().map(|name| name.entry).collect();
        entries.dedup();
        entries.into_iter().map(|entry| &LINEAR[entry]).collect()
    }

    /// Values by name as a vector over the whole catalogue; `None` if a kind is not in it.
    pub fn vector<'k>(
        &self,
        effects: impl IntoIterator<Item = (&'k str, &'k BTreeMap<String, f64>)>,
    ) -> Option<DVector<f64>> {
        let mut vector = DVector::zeros(self.names.len());
        for (kind, values) in effects {
            let places = self.of(kind);
            if places.is_empty() {
                return None;
            }
            for place in places {
                vector[place] += values
                    .get(self.names[place].parameter)
                    .copied()
                    .unwrap_or(0.0);
            }
        }
        Some(vector)
    }

    /// vᵀ G v over a part.
    pub fn power(&self, vector: &DVector<f64>, part: usize) -> f64 {
        (vector.transpose() * &self.gram[part] * vector)[0].max(0.0)
    }
}

/// Formats one effect as TOML.
pub fn effect(kind: &str, lines: &str) -> String {
    format!("[[effect]]\nkind = \"{kind}\"\nconcealed = true\n{lines}")
}

/// Residual of a noise-free simulation \[rad\], without its constant part: biases cancel in every difference.
fn residual(scene: &Scene, effects: &str) -> Result<[Vec<f64>; 3], InputError> {
    let scenario = scene.scenario(false, effects)?;
    let seeds = Seeds {
        motion: scene.motion_seed,
        noise: 0,
    };
    let simulation = simulate(&scenario, seeds, |_| {});
    Ok(residual_of(
        scene,
        &simulation.recording,
        scenario.gyro.pulse_weight_rad,
    ))
}

fn residual_of(scene: &Scene, recording: &Recording, pulse_rad: [f64; 3]) -> [Vec<f64>; 3] {
    let series = |quantity: &Quantity, axis: usize| -> &[f64] {
        let channel = recording.channel(quantity, ["x", "y", "z"][axis]);
        channel.map_or(&[], |(_, channel)| &channel.values)
    };
    let case = [0, 1, 2].map(|axis| series(&Quantity::ReferenceIncrement, axis));
    let [xy, xz, yx, yz, zx, zy] = Scene::installation();
    let body_from_gyro = Matrix3::new(1.0, xz, xy, yz, 1.0, yx, zy, zx, 1.0);
    // angles of 1e-4: diagonally dominant
    let gyro_from_body = body_from_gyro
        .try_inverse()
        .unwrap_or_else(Matrix3::identity);
    [0, 1, 2].map(|axis: usize| {
        let (gyro, unit) = if scene.is_dithered() {
            (series(&Quantity::GyroCount, axis), pulse_rad[axis])
        } else {
            (series(&Quantity::GyroIncrement, axis), 1.0)
        };
        let pickoff = series(&Quantity::DitherAngle, axis);
        let keep = 1.0 - Scene::scale_error(axis);
        gyro.iter()
            .enumerate()
            .map(|(row, reading)| {
                let turned = Vector3::new(case[0][row], case[1][row], case[2][row]);
                let sensed = (gyro_from_body * turned)[axis] / keep;
                let block = match (pickoff.get(row), row.checked_sub(1)) {
                    (Some(now), Some(before)) => now - pickoff[before],
                    _ => 0.0,
                };
                reading * unit - sensed - block
            })
            .collect()
    })
}
