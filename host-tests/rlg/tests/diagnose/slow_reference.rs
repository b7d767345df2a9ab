//! Slow references that sum up increments, and complications of the gyros with a slow reference: wrongly compensated
//! dithers, noise that the model omits or overstates.

use std::ops::RangeInclusive;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rlg::recording::{Quantity, Recording};
use rlg::simulate::Simulation;

use super::attitude::{
    coning, dithered, instrument, made, put_beside, slews, slow, still, take, told, tumble,
};
use super::support::{concealed, kinds, names_nothing, sizes_are};

/// Keeps the sums of `every` rows of the reference's increments, in a table that begins `late_s` late.
fn sums(simulation: &Simulation, every: usize, late_s: f64) -> Recording {
    let mut recording = simulation.recording.clone();
    take(&mut recording, &Quantity::ReferenceAttitude);
    let mut channels = take(&mut recording, &Quantity::ReferenceIncrement);
    for channel in &mut channels {
        let rows = channel.values.chunks_exact(every);
        channel.values = rows.map(|rows| rows.iter().sum()).collect();
    }
    put_beside(&mut recording, channels, every, late_s);
    recording
}

/// Scenario of rest, rotations about each axis, and tumbling.
fn moved(instrument: &str) -> String {
    format!("{instrument}{}{}{}", still(3.0), slews(), tumble(20.0))
}

/// Gyros with negligible pulses: without a dither coarse ones read a sawtooth while they hardly rotate, which walks and
/// jumps.
fn fine_gyros(rate_hz: f64) -> String {
    instrument(rate_hz).replace("[2.1e-6, 1.9e-6, 2.0e-6]", "[2.1e-9, 1.9e-9, 2.0e-9]")
}

#[test]
fn increments_of_a_reference_at_a_rate_of_its_own_are_summed_up() {
    let truth = [("x", 1.5e-6), ("y", -2e-6), ("z", 1e-6)];
    let text = moved(&instrument(200.0)) + &concealed("gyro_bias", &truth);
    let simulation = made(&text, 4);
    let diagnosis = told(&sums(&simulation, 4, 0.0), &simulation);
    assert_eq!(kinds(&diagnosis), ["gyro_bias"], "{:#?}", diagnosis.summary);
    sizes_are(&diagnosis.effects[0], &truth);
}

/// A table's encoder has its noise about its own axis; about the others the reference is a known zero rate.
#[test]
fn the_noise_of_an_encoder_is_about_its_own_axis() {
    const ENCODER_RAD: f64 = 3e-5;
    let simulation = made(&moved(&fine_gyros(200.0)), 7);
    let mut recording = sums(&simulation, 4, 0.0);
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut last_rad = 0.0;
    for value in &mut recording.tables[1].channels[2].values {
        let normal: f64 = StandardNormal.sample(&mut random);
        *value += ENCODER_RAD * normal - last_rad;
        last_rad = ENCODER_RAD * normal;
    }
    let diagnosis = told(&recording, &simulation);
    names_nothing(&diagnosis, "an encoder about z");
    let [x, y, z] = [0, 1, 2].map(|axis| &diagnosis.noise[axis]);
    assert!((z.angle_noise_rad / ENCODER_RAD - 1.0).abs() < 0.1, "{z:?}");
    assert!(
        x.angle_noise_rad.max(y.angle_noise_rad) < 0.1 * ENCODER_RAD,
        "{x:?} {y:?}"
    );
    // Up to 10 Hz a fifth of the record has some 190 numbers an axis: 0.1 is one standard deviation of their mean square.
    for channel in &diagnosis.fit.channels {
        let power = channel.held_out_after.normalised_power;
        assert!((power - 1.0).abs() < 0.4, "{}: {power}", channel.channel);
    }
}

/// An attitude integrated from increments at 100 Hz lacks the drift of cones of 90 Hz: 2 degrees an hour.
#[test]
fn a_cone_faster_than_the_reference_is_in_the_sums_of_both() {
    fast_cones_are_in_the_sums(1..=1);
}

#[test]
#[ignore = "many seeds: --test diagnose -- --ignored in_full"]
fn a_cone_faster_than_the_reference_is_in_the_sums_of_both_in_full() {
    fast_cones_are_in_the_sums(1..=3);
}

fn fast_cones_are_in_the_sums(seeds: RangeInclusive<u64>) {
    let text = format!(
        "{}{}{}{}{}",
        fine_gyros(1000.0),
        still(3.0),
        slews(),
        coning("x", 90.0, 2e-4, 8.0),
        coning("z", 73.0, 2e-4, 8.0)
    );
    for seed in seeds {
        let simulation = made(&text, seed);
        names_nothing(
            &told(&sums(&simulation, 10, 0.0), &simulation),
            format!("seed {seed}"),
        );
    }
}

#[test]
fn sums_of_a_reference_that_is_turned_or_late_say_so() {
    let simulation = made(&moved(&fine_gyros(200.0)), 5);
    for turn_rad in [4e-4_f64, 0.08] {
        let mut recording = sums(&simulation, 4, 0.0);
        let channels = &mut recording.tables[1].channels;
        for row in 0..channels[0].values.len() {
            let (x, y) = (channels[0].values[row], channels[1].values[row]);
            channels[0].values[row] = x * turn_rad.cos() + y * turn_rad.sin();
            channels[1].values[row] = y * turn_rad.cos() - x * turn_rad.sin();
        }
        let diagnosis = told(&recording, &simulation);
        let expected = ["reference_misalignment"];
        assert_eq!(kinds(&diagnosis), expected, "{:#?}", diagnosis.summary);
        sizes_are(&diagnosis.effects[0], &[("z", turn_rad)]);
    }
    for late_s in [0.001, 0.137] {
        let diagnosis = told(&sums(&simulation, 4, late_s), &simulation);
        let expected = ["reference_delay"];
        assert_eq!(kinds(&diagnosis), expected, "{:#?}", diagnosis.summary);
        sizes_are(&diagnosis.effects[0], &[("all", late_s)]);
    }
}

/// Sampled at 40 Hz a dither of 0.7 mrad does not average out of an attitude known to 1 urad, and the residual of a wrongly
/// compensated one is no motion whose derivatives could explain it.
#[test]
fn a_dither_that_was_taken_out_wrongly_shows_in_attitudes() {
    let gains = [("x", 3e-3), ("y", -2e-3), ("z", 2e-3)];
    let delays = [("x", 3e-6), ("y", 3e-6), ("z", -2e-6)];
    let text = format!(
        "{}{}{}{}{}{}",
        dithered(1000.0),
        still(3.0),
        slews(),
        tumble(15.0),
        concealed("dither_gain", &gains),
        concealed("dither_delay", &delays)
    );
    let simulation = made(&text, 6);
    let diagnosis = told(&slow(&simulation, 25, 0), &simulation);
    // The stronger first.
    let expected = ["dither_delay", "dither_gain"];
    assert_eq!(kinds(&diagnosis), expected, "{:#?}", diagnosis.summary);
    sizes_are(&diagnosis.effects[0], &delays);
    sizes_are(&diagnosis.effects[1], &gains);
}

/// Rates that vary within a second or two are no random walk of angle: it would have to be three times the declared one in a
/// third of the band of the attitudes.
#[test]
fn drift_of_one_gyro_that_the_model_does_not_state_is_no_random_walk_of_angle() {
    drift_is_no_walk(1..=1);
}

#[test]
#[ignore = "many seeds: --test diagnose -- --ignored in_full"]
fn drift_of_one_gyro_that_the_model_does_not_state_is_no_random_walk_of_angle_in_full() {
    drift_is_no_walk(1..=3);
}

fn drift_is_no_walk(seeds: RangeInclusive<u64>) {
    const SIZE_RAD_S: f64 = 1e-6;
    const RELAXES_S: f64 = 1.5;
    const ROW_S: f64 = 5e-3;
    for seed in seeds {
        let simulation = made(&moved(&instrument(1.0 / ROW_S)), seed);
        let mut recording = slow(&simulation, 10, 0);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let kept = (-ROW_S / RELAXES_S).exp();
        let mut drift_rad_s = 0.0;
        let mut gyros = recording.tables[0].channels.iter_mut();
        let gyro = gyros.find(|channel| {
            channel.quantity == Quantity::GyroIncrement && channel.axis.as_deref() == Some("y")
        });
        for value in &mut gyro.expect("a gyro about y").values {
            let fresh: f64 = StandardNormal.sample(&mut random);
            drift_rad_s = kept * drift_rad_s + SIZE_RAD_S * (1.0 - kept * kept).sqrt() * fresh;
            *value += ROW_S * drift_rad_s;
        }
        names_nothing(&told(&recording, &simulation), format!("seed {seed}"));
    }
}

/// A model may state pulses that a recorder of increments never wrote.
#[test]
fn gyros_without_the_pulses_that_the_model_states_match_it() {
    stated_pulses_may_be_absent(1..=1);
}

#[test]
#[ignore = "many seeds: --test diagnose -- --ignored in_full"]
fn gyros_without_the_pulses_that_the_model_states_match_it_in_full() {
    stated_pulses_may_be_absent(1..=2);
}

fn stated_pulses_may_be_absent(seeds: RangeInclusive<u64>) {
    let fine = fine_gyros(200.0).replace("angle_noise_rad = 1.0e-6", "angle_noise_rad = 1.0e-9");
    for seed in seeds {
        let mut simulation = made(&moved(&fine), seed);
        simulation.model.gyro.pulse_weight_rad = [2.1e-6, 1.9e-6, 2.0e-6];
        names_nothing(
            &told(&sums(&simulation, 2, 0.0), &simulation),
            format!("seed {seed}"),
        );
        let mut recording = simulation.recording.clone();
        take(&mut recording, &Quantity::ReferenceAttitude);
        names_nothing(&told(&recording, &simulation), format!("seed {seed}"));
    }
}

/// A few seconds of attitudes before and after a motion do not determine a random walk; the one step between them is then no
/// physics.
#[test]
fn a_walk_that_nobody_states_is_as_large_as_the_attitudes_allow() {
    a_walk_is_as_large_as_allowed(1..=1);
}

#[test]
#[ignore = "many seeds: --test diagnose -- --ignored in_full"]
fn a_walk_that_nobody_states_is_as_large_as_the_attitudes_allow_in_full() {
    a_walk_is_as_large_as_allowed(1..=4);
}

fn a_walk_is_as_large_as_allowed(seeds: RangeInclusive<u64>) {
    let text = format!(
        "{}{}{}{}",
        fine_gyros(200.0),
        still(3.0),
        slews(),
        still(4.0)
    );
    for seed in seeds {
        let mut simulation = made(&text, seed);
        simulation.model.gyro.angle_random_walk_rad_sqrt_s = None;
        let mut recording = slow(&simulation, 10, 0);
        for channel in &mut recording.tables[1].channels {
            channel.values[3 * 20..27 * 20].fill(f64::NAN);
        }
        names_nothing(&told(&recording, &simulation), format!("seed {seed}"));
    }
}
