//! Collects a model's effects that optional terms of the chain correct, as records of the parameter block.
//!
//! Values are the catalogue's, and add up where a kind stands several times. A model's temperatures count from those at
//! the start, encoded as a reference of 0 K. Values without a parameter in the catalogue (second order in temperature)
//! are 0.

use rlg_model::ModelEffect;
use rlg_model::catalogue::{NINE, SIX, XYZ};
use trueaxis::{ParameterError, TermKind, TermRecords};

/// Reference temperatures \[K\] that stand for those at the start.
const FROM_THE_START: [f64; 3] = [0.0; 3];

/// Sums of the effects, by kind.
#[derive(Debug, Default)]
pub struct TermSums(Vec<(TermKind, Vec<f64>)>);

/// Parameters of a suspension's mode.
const MODE: &[&str] = &[
    "xy",
    "xz",
    "yx",
    "yz",
    "zx",
    "zy",
    "frequency_hz",
    "damping",
];

/// The kind of record for an effect's kind, and the names of its parameters.
fn record_of(kind: &str) -> Option<(TermKind, &'static [&'static str])> {
    let known = TermKind::ALL.iter().find(|known| known.name() == kind)?;
    Some(match known {
        TermKind::AxisFlexureMode => (*known, MODE),
        TermKind::InstallationTemperature
        | TermKind::AxisFlexureCubic
        | TermKind::AxisTiltByForce
        | TermKind::DitherCrosstalk => (*known, SIX),
        TermKind::GyroGBias
        | TermKind::GyroBiasMagnetic
        | TermKind::ElasticRateByForce
        | TermKind::ElasticRateByJerk => (*known, NINE),
        // In no model: the catalogue has no such kind.
        TermKind::GyroScaleTemperature => return None,
        _ => (*known, XYZ),
    })
}

impl TermSums {
    /// Adds an effect, if a term corrects it.
    pub fn take(&mut self, effect: &ModelEffect, has_accelerometers: bool, dithered: bool) -> bool {
        let Some((kind, names)) = record_of(&effect.kind) else {
            return false;
        };
        let of_force = matches!(
            kind,
            TermKind::GyroGBias
                | TermKind::AccelDelay
                | TermKind::AxisTiltByForce
                | TermKind::GyroG2Bias
                | TermKind::ElasticRateByForce
                | TermKind::AccelQuadratic
        );
        if of_force && !has_accelerometers {
            return false;
        }
        let of_dither = matches!(kind, TermKind::DitherCubic | TermKind::DitherCrosstalk);
        if of_dither && !dithered {
            // Blocks at rest show nothing of it.
            return true;
        }
        // The term smooths to second order; a low pass of first order also delays.
        let poles = ["x_pole_s", "y_pole_s", "z_pole_s"];
        if kind == TermKind::GyroBandwidth && poles.iter().any(|name| effect.number(name) != 0.0) {
            return false;
        }
        if kind == TermKind::AxisFlexureMode {
            return self.take_mode(names.iter().map(|name| effect.number(name)).collect());
        }
        let at = self.0.iter().position(|(known, _)| *known == kind);
        let at = at.unwrap_or_else(|| {
            self.0.push((kind, vec![0.0; names.len()]));
            self.0.len() - 1
        });
        for (sum, name) in self.0[at].1.iter_mut().zip(names) {
            *sum += effect.number(name);
        }
        true
    }

    /// Adds a mode. The chain has one: a second is taken only if it is the same mode of other pairs.
    fn take_mode(&mut self, mode: Vec<f64>) -> bool {
        let kind = TermKind::AxisFlexureMode;
        let Some((_, sum)) = self.0.iter_mut().find(|(known, _)| *known == kind) else {
            self.0.push((kind, mode));
            return true;
        };
        let (flexure, shape) = sum.split_at_mut(SIX.len());
        if *shape != mode[SIX.len()..] {
            return false;
        }
        for (sum, value) in flexure.iter_mut().zip(mode) {
            *sum += value;
        }
        true
    }

    /// The records. `stretch` is the divisor of a gyro's reading by the chain's scale error.
    pub fn records(self, stretch: [f64; 3]) -> Result<TermRecords, ParameterError> {
        let mut records = TermRecords::NONE;
        for (kind, mut values) in self.0 {
            match kind {
                // Rates added to the sensed one.
                TermKind::GyroBiasTemperature
                | TermKind::GyroBiasTemperatureRate
                | TermKind::GyroG2Bias => {
                    divide(&mut values, stretch, 1);
                }
                TermKind::DitherCrosstalk => divide(&mut values, stretch, 2),
                TermKind::GyroGBias
                | TermKind::GyroBiasMagnetic
                | TermKind::ElasticRateByForce
                | TermKind::ElasticRateByJerk => divide(&mut values, stretch, 3),
                _ => {}
            }
            if matches!(
                kind,
                TermKind::GyroBiasTemperature | TermKind::InstallationTemperature
            ) {
                let second = vec![0.0; values.len()];
                values = [FROM_THE_START.to_vec(), values, second].concat();
            }
            records
                .push(kind, &values)
                .map_err(ParameterError::Records)?;
        }
        Ok(records)
    }
}

/// Divides the values of each gyro, of which there are `each`.
fn divide(values: &mut [f64], stretch: [f64; 3], each: usize) {
    for (values, stretch) in values.chunks_exact_mut(each).zip(stretch) {
        for value in values {
            *value /= stretch;
        }
    }
}
