//! How a reference lies that lies far off: the coarse search (align.rs) and Gauss–Newton from there.
//!
//! Enters: [`Prepared`] and the record under the model's clock and frame. Leaves: [`Lie`], or nothing where the reference
//! lies close enough for the catalogue's own hypotheses.

use nalgebra::{UnitQuaternion, Vector3};

use super::bench::{AttitudeBench, Behind};
use super::prepare::Prepared;
use super::record::{Lie, Record};
use super::samples::SlowSample;
use super::{align, cut, hunt, levels};
use crate::hypotheses;
use crate::split;
use crate::workbench::Parameters;
use rlg_model::Model;

/// How a reference lies that lies far off: searched coarsely, then by Gauss–Newton with the gyros' plain errors free.
pub(super) fn settle(
    prepared: &Prepared,
    before: &Record,
    model: &Model,
    parameters: &Parameters,
) -> Option<Lie> {
    /// Gauss–Newton steps; the coarse search ends within a few milliseconds, from which three suffice.
    const STEPS: usize = 4;
    let streams = &prepared.scene.streams;
    let body_from_reference = UnitQuaternion::from_scaled_axis(prepared.lie.turn_rad);
    let as_modelled: Vec<SlowSample> = prepared
        .samples
        .iter()
        .map(|sample| SlowSample {
            time_s: sample.time_s - prepared.lie.delay_s,
            shown: sample.shown.turned_back(&body_from_reference),
            ..*sample
        })
        .collect();
    let found = align::coarse(
        &before.path,
        &as_modelled,
        &streams.usable,
        streams.rate_hz,
        prepared.scene.motion_edge_hz,
    )?;
    let far_turn = found.turn_rad != Vector3::zeros();
    let far_delay = found.delay_s != 0.0;
    // The reference reads C R; the model's turn was undone on its right, so what was found stands on its left.
    let compose = |more: &Vector3<f64>, base: &Vector3<f64>| {
        (UnitQuaternion::from_scaled_axis(*more) * UnitQuaternion::from_scaled_axis(*base))
            .scaled_axis()
    };
    let mut lie = prepared.lie;
    lie.delay_s += found.delay_s;
    if far_turn {
        lie.turn_rad = compose(&found.turn_rad, &lie.turn_rad);
    }
    let plain: Vec<usize> = ["gyro_bias", "gyro_scale", "installation"]
        .iter()
        .filter_map(|kind| hypotheses::find(kind).map(|(effect, _)| effect))
        .collect();
    for _ in 0..STEPS {
        let record = prepared.record(model, &lie);
        let whole = cut::cut(
            &record,
            split::split(streams, split::Part::End).regimes,
            &cut::last_part,
        )
        .fitted;
        if whole.is_empty() {
            return None;
        }
        let levels = prepared.declared.plain();
        let mut bench =
            AttitudeBench::new(&prepared.scene, &record, parameters, whole, levels, &plain);
        bench.levels = levels::first(&prepared.declared, &bench);
        if far_delay {
            bench.stand_behind(Behind::Delay).ok()?;
        }
        if far_turn {
            for axis in 0..3 {
                bench.stand_behind(Behind::Turn(axis)).ok()?;
            }
        }
        let (values, _) = hunt::fit(&bench, parameters, &plain);
        let mut more = Vector3::zeros();
        for (behind, (_, value)) in bench.behind().zip(
            values
                .iter()
                .filter(|(index, _)| *index >= parameters.count()),
        ) {
            match behind {
                Behind::Delay => lie.delay_s += value,
                Behind::Turn(axis) => more[*axis] = *value,
                Behind::Term(_) => {}
            }
        }
        if far_turn {
            lie.turn_rad = compose(&more, &lie.turn_rad);
        }
    }
    Some(lie)
}
