//! A perfect instrument, and quantities computed by the tests from a simulation.

use nalgebra::Vector3;
use rlg::recording::{Quantity, Recording};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::{Simulation, simulate};
use std::f64::consts::PI;
use std::path::Path;

pub const DEG_H_PER_RAD_S: f64 = 180.0 / PI * 3600.0;

/// Perfect instruments: the residual is the physics. The weights are far below every effect under test.
pub const PERFECT: &str = r#"
format = 1
name = "perfect"
rate_hz = 4000.0
[gyro]
pulse_weight_rad = [1e-13, 1e-13, 1e-13]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]
installation_rad = {}
"#;

pub const TABLE_3: &str = r#"
[[effect]]
kind = "axis_flexure"
xy = 6.9e-8
xz = 7.1e-8
yx = 7.5e-8
yz = 7.3e-8
zx = 6.7e-8
zy = 7.6e-8
"#;

pub const DITHER: &str = r#"
[dither]
frequency_hz = [392.6, 430.1, 474.8]
amplitude_rad = [7.3e-4, 6.0e-4, 8.0e-4]
amplitude_spread = 0.15
pickoff_gain = [1.0, 1.01, 0.99]
pickoff_noise_rad = [0.0, 0.0, 0.0]
pickoff_weight_rad = 1e-13
"#;

pub fn run(text: &str, seed: u64) -> Simulation {
    let scenario = Scenario::parse(text, Path::new("test.toml")).unwrap();
    simulate(&scenario, seed, |_| {})
}

pub fn channel(recording: &Recording, quantity: Quantity, axis: usize) -> &[f64] {
    let letter = ["x", "y", "z"][axis];
    let mut channels = recording.tables[0].channels.iter();
    &channels
        .find(|c| c.quantity == quantity && c.axis.as_deref() == Some(letter))
        .unwrap()
        .values
}

pub fn sensed_rad(simulation: &Simulation, axis: usize) -> Vec<f64> {
    let weight_rad = simulation.model.gyro.pulse_weight_rad[axis];
    let counts = channel(&simulation.recording, Quantity::GyroCount, axis);
    counts.iter().map(|count| count * weight_rad).collect()
}

pub fn coning(frequency_hz: f64, angle_rad: f64, seconds: f64) -> String {
    format!(
        "[[motion]]\nkind = \"coning\"\naxis = \"x\"\nfrequency_hz = {frequency_hz}\n\
         angle_rad = {angle_rad}\nduration_s = {seconds}\nramp_s = 1.0\n"
    )
}

/// Mean of sensed − case over \[2 s, 6 s), whole cycles of full amplitude \[°/h\].
pub fn drift_deg_h(simulation: &Simulation, axis: usize) -> f64 {
    let sensed = sensed_rad(simulation, axis);
    let error: f64 = (8000..24000)
        .map(|row| sensed[row] - simulation.case_increments_rad[row][axis])
        .sum();
    error / 4.0 * DEG_H_PER_RAD_S
}

/// A row \[s\].
pub const T: f64 = 1.0 / 4000.0;
pub const SITE: &str = "[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\n";
pub const TUMBLE: &str = "[[motion]]\nkind = \"tumble\"\nrate_rad_s = [1.0, -0.8, 0.6]\n\
    frequency_hz = [0.31, 0.23, 0.17]\nramp_s = 0.5\nduration_s = 3.0\n";
pub const STILL: &str = "[[motion]]\nkind = \"still\"\nduration_s = 2.0\n";
pub const REFERENCE: &str = "[reference]\nangle_noise_rad = 0.0\nangle_random_walk_rad_sqrt_s = 0.0\n\
    weight_rad = 1e-13\n";

/// `parameters` separated by commas.
pub fn effect(kind: &str, parameters: &str) -> String {
    format!(
        "[[effect]]\nkind = \"{kind}\"\n{}\n",
        parameters.replace(", ", "\n")
    )
}

/// The three channels of a quantity, by row.
pub fn triad(recording: &Recording, quantity: Quantity) -> impl Fn(usize) -> Vector3<f64> + '_ {
    move |row| Vector3::from_fn(|axis, _| channel(recording, quantity.clone(), axis)[row])
}
