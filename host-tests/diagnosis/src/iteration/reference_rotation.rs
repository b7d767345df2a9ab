//! Rotation of the reference, where its second order in small angles exceeds the noise.

use nalgebra::{Matrix3, Vector3};
use rlg_catalogue::candidates::along;
use rlg_catalogue::signals::AXES;
use rlg_catalogue::turned::{TURNED, nearest, turn};
use rlg_catalogue::{Candidate, Pool, Signals};
use rlg_inference::NoiseLevels;

use super::state::Before;
use crate::rows::data::Data;
use crate::rows::model_effects::known_by_axis;

/// Rotation vectors \[rad\], body axes.
pub(crate) struct Turned {
    /// Rotation by the model.
    known_rad: Vector3<f64>,
    /// Further rotation by the found set.
    found_rad: Vector3<f64>,
}

impl Turned {
    /// Rotation by the model and by the set before a pass.
    pub(crate) fn said(data: &Data, before: &Before) -> Self {
        Self {
            known_rad: known_by_axis(TURNED, data.model, data.streams).into(),
            found_rad: said_by(before).unwrap_or_default(),
        }
    }

    /// All found errors of axes and scales approximated by one rotation; `None` if a rotation was found.
    ///
    /// A rotation that is taken for a small one looks like such errors.
    pub(crate) fn tried(data: &Data, before: &Before) -> Option<Self> {
        if said_by(before).is_some() {
            return None;
        }
        let known_rad: Vector3<f64> = known_by_axis(TURNED, data.model, data.streams).into();
        Some(Self {
            known_rad,
            found_rad: nearest(&data.turned_by_all()) - known_rad,
        })
    }

    /// True if products of its small angles, with each other and with scale errors, exceed `settled` \[σ\].
    pub(crate) fn is_seen(
        &self,
        data: &Data,
        signals: &Signals,
        levels: &[NoiseLevels],
        settled: f64,
    ) -> bool {
        let others = data.turned_by_all() - Matrix3::identity();
        let products = turn(self.known_rad + self.found_rad) * others;
        let powers: Vec<f64> = signals
            .independent
            .case_rad
            .iter()
            .map(|turned_rad| turned_rad.iter().map(|angle| angle * angle).sum())
            .collect();
        let mut squared = 0.0;
        for (gyro, levels) in levels.iter().enumerate() {
            for (axis, power) in powers.iter().enumerate() {
                let sensed = (0..3).map(|body| along(signals, gyro, body) * products[(body, axis)]);
                squared += sensed.sum::<f64>().powi(2) * power / (levels.white + levels.angle);
            }
        }
        squared > settled * settled
    }

    /// Forms the catalogue's columns over the rotated reference.
    pub(crate) fn carry(&self, candidates: &mut [Candidate], pool: &mut Pool, signals: &Signals) {
        for one in candidates {
            if one.kind == TURNED {
                pool.about_turn(one, (self.known_rad, self.found_rad), signals);
            } else {
                let terms = std::mem::take(&mut one.hypothesis.terms);
                let turned_rad = self.known_rad + self.found_rad;
                one.hypothesis.terms = pool.carried((one.kind, terms), turned_rad, signals);
            }
        }
    }
}

/// Rotation in a set, if it holds one \[rad\].
fn said_by(before: &Before) -> Option<Vector3<f64>> {
    let Before::Pass(fit, members) = before else {
        return None;
    };
    let mut all = fit.members.iter().zip(&fit.blocks);
    let (&place, block) = all.find(|(place, _)| members[**place].kind == TURNED)?;
    let mut turned_rad = Vector3::zeros();
    for (name, at) in members[place].names.iter().zip(block.clone()) {
        let axis = AXES.iter().position(|axis| axis == name);
        turned_rad[axis.expect("a rotation's parameters are axes")] = fit.estimate[at];
    }
    Some(turned_rad)
}
