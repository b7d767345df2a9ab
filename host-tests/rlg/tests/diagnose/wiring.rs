//! Channels reversed, exchanged or of another scale than in the model: refused with a sentence, at once. And effects that
//! only resemble it.

use std::path::Path;

use rlg::diagnose::diagnose;
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::{Channel, Quantity, Recording};
use rlg::simulate::Simulation;

use super::attitude::{coning, dithered, made, slews, still, tumble};

fn moved() -> Simulation {
    let text = format!(
        "{}{}{}{}",
        dithered(1000.0),
        still(3.0),
        slews(),
        tumble(12.0)
    );
    made(&text, 5)
}

/// Returns the refusal of a recording after a change.
fn said(simulation: &Simulation, change: impl Fn(&mut Recording, &mut Model)) -> Option<String> {
    let mut recording = simulation.recording.clone();
    let mut model = simulation.model.clone();
    change(&mut recording, &mut model);
    let outcome = diagnose(&recording, &model, Path::new("model.toml"), 0, &|_| {});
    outcome.err().map(|error: InputError| error.to_string())
}

fn channel<'a>(recording: &'a mut Recording, quantity: &Quantity, axis: &str) -> &'a mut Channel {
    let mut channels = recording.tables[0].channels.iter_mut();
    channels
        .find(|one| one.quantity == *quantity && one.axis.as_deref() == Some(axis))
        .expect("a channel")
}

fn reverse(recording: &mut Recording, quantity: &Quantity, axis: &str) {
    let values = &mut channel(recording, quantity, axis).values;
    values.iter_mut().for_each(|value| *value = -*value);
}

fn exchange(recording: &mut Recording, quantity: &Quantity, a: &str, b: &str) {
    let of_a = std::mem::take(&mut channel(recording, quantity, a).values);
    let of_b = std::mem::replace(&mut channel(recording, quantity, b).values, of_a);
    channel(recording, quantity, a).values = of_b;
}

/// Checks that it is refused, and these words are in the sentence.
fn is_refused(said: Option<String>, words: &[&str]) {
    let said = said.expect("an error");
    for word in words {
        assert!(said.contains(word), "{word} in: {said}");
    }
}

#[test]
fn reversed_channels_are_told_by_whose_they_are() {
    let simulation = moved();
    let gyro = said(&simulation, |r, _| reverse(r, &Quantity::GyroCount, "y"));
    is_refused(
        gyro,
        &[
            "gyro y reads -1.00 times",
            "the gyro's own channel has the wrong sign",
        ],
    );
    let reference = said(&simulation, |r, _| {
        reverse(r, &Quantity::ReferenceIncrement, "z");
    });
    is_refused(
        reference,
        &[
            "gyro z reads -1.00 times",
            "either the reference's",
            "wrong sign",
        ],
    );
    let pickoff = said(&simulation, |r, _| reverse(r, &Quantity::DitherAngle, "x"));
    is_refused(
        pickoff,
        &[
            "gyro x reads -1.00 times",
            "the pickoff's channel has the wrong sign",
        ],
    );
}

/// Pulses of 2.1 counted as pulses of 1.9 are 1.105 times as much.
#[test]
fn exchanged_channels_are_told_with_both_axes() {
    let simulation = moved();
    let gyros = said(&simulation, |r, _| {
        exchange(r, &Quantity::GyroCount, "x", "y")
    });
    is_refused(
        gyros,
        &[
            "gyro x reads 1.105",
            "the reference on y",
            "exchanged with another axis",
        ],
    );
    let reference = said(&simulation, |r, _| {
        exchange(r, &Quantity::ReferenceIncrement, "y", "z");
    });
    is_refused(reference, &["gyro z reads 1.000 times the reference on y"]);
}

#[test]
fn a_pulse_weight_of_twice_the_size_is_told() {
    let simulation = moved();
    let said = said(&simulation, |_, model| {
        model.gyro.pulse_weight_rad = model.gyro.pulse_weight_rad.map(|weight| 2.0 * weight);
    });
    is_refused(
        said,
        &["all three read 2.000 times", "another pulse weight"],
    );
}

/// Half a period's delay of a tone is a sign, a reference of noise hides a rate: neither is a wrong axis.
#[test]
fn what_a_delay_or_noise_could_do_is_not_refused() {
    let text = format!(
        "{}{}{}",
        dithered(1000.0),
        still(2.0),
        coning("z", 50.0, 2e-3, 4.0)
    );
    let late_rows = 10;
    let late = said(&made(&text, 6), |recording, _| {
        for axis in ["x", "y", "z"] {
            let values = &mut channel(recording, &Quantity::ReferenceIncrement, axis).values;
            values.rotate_right(late_rows);
        }
    });
    assert_eq!(late, None);
    let noisy = said(
        &made(&format!("{}{}", dithered(1000.0), still(4.0)), 7),
        |recording, _| {
            for axis in ["x", "y", "z"] {
                let values = &mut channel(recording, &Quantity::ReferenceIncrement, axis).values;
                values.iter_mut().for_each(|value| *value *= 30.0);
            }
        },
    );
    assert_eq!(noisy, None);
}
