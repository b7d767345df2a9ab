//! Case motion measured by the gyros, less their identified errors, for the transport of gravity to the accelerometers.

use nalgebra::{Rotation3, Vector3};
use rlg_signal::axes::{Triad, add_triad};

use crate::about::{About, Gyros};
use crate::alignment::places;
use crate::choice::{Named, always_alike};
use crate::said::Said;

/// True for an error of the reference.
fn is_of_reference(kind: &str) -> bool {
    kind.starts_with("reference_")
}

/// Computes the case's increments by row \[rad\], in the axes of the gyros' case.
///
/// # Errors
/// The motion is ambiguous: a finding may belong to the gyros or to the reference, or acts unobserved between attitudes.
pub(crate) fn corrected_rad(said: &Said) -> Result<Triad, String> {
    let named = || said.found.registration.iter().chain(&said.found.physics);
    // Kinds never distinguishable by attitudes are reported under the first of their names.
    let rivals = |one: &Named| {
        let always = always_alike(one.kind);
        let alike = one.alike.iter().copied();
        alike
            .filter(|kind| !always.contains(kind))
            .collect::<Vec<_>>()
    };
    let is_undecided = |one: &Named| {
        let of_reference = is_of_reference(one.kind);
        rivals(one)
            .iter()
            .any(|kind| is_of_reference(kind) != of_reference)
    };
    if named().any(is_undecided) {
        return Err("effects of gyros and of the reference are not distinguished, and one of them would transport gravity wrongly".to_string());
    }
    let samples = &said.observed.samples;
    let gaps_s = samples
        .windows(2)
        .map(|pair| pair[1].time_s - pair[0].time_s);
    let longest_s = gaps_s.fold(0.0, f64::max);
    if longest_s > said.plan.attitude.unwatched_s && named().any(|one| !rivals(one).is_empty()) {
        return Err(format!(
            "no attitude for {longest_s:.0} s, over which the kinds of a class transport gravity differently"
        ));
    }
    let step = said.found.step_from(said.beyond).estimate;
    let groups = said.found.groups();
    let alignment = said
        .registered
        .alignment
        .with(&groups, said.of_model)
        .moved(&step);
    let errors = physics_rad(said);
    let of = &said.observed.gyros;
    let sensed_rad = of.sensed_rad.iter().enumerate();
    let gyros = Gyros {
        sensed_rad: sensed_rad
            .map(|(row, sensed)| sensed - Vector3::from_fn(|axis, _| errors[axis][row]))
            .collect(),
        lost_before: of.lost_before.clone(),
        dither: of.dither.clone(),
        ..*of
    };
    let about = About::new(&gyros, samples, &said.observed.known, &alignment)
        .ok_or("fewer than two attitudes lie within the gyros' record")?;
    // The reference's axes are rotated relative to the case's by its own misalignment.
    let turn_rad = Vector3::from_column_slice(
        &alignment.beyond(said.of_model)[places("reference_misalignment")],
    );
    let turn = Rotation3::from_scaled_axis(turn_rad) * said.of_model.turn;
    Ok([0, 1, 2].map(|axis| {
        let rows = about.motion.increments_rad().iter();
        rows.map(|row| (turn * row)[axis]).collect()
    }))
}

/// Sums the contributions of the accepted physical effects to the gyros, in the case's axes \[rad by row\].
fn physics_rad(said: &Said) -> Triad {
    let mut all: Triad = std::array::from_fn(|_| vec![0.0; said.gyro.signals.rows]);
    for one in &said.found.physics {
        let value = |place: &usize| {
            let at = said.found.named_set.iter().position(|own| own == place);
            at.map_or(0.0, |at| said.found.of_named.values[at])
        };
        let mut values: Vec<f64> = one.places.iter().map(value).collect();
        if one.kind == "gyro_delay" {
            // The common delay belongs to the reference.
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter_mut().for_each(|value| *value -= mean);
        }
        for (column, value) in said.in_case_rad(one).iter().zip(values) {
            add_triad(&mut all, column, value);
        }
    }
    all
}
