//! Scenario of a unit at rest with slow channels, and of its faults.

use rlg::recording::{Quantity, Recording};

use super::bench::Bench;

/// A dithered unit at rest, whose slow channels have no noise; three seconds.
pub const UNIT: &str = r#"
format = 1
name = "health"
rate_hz = 4000.0
[site]
latitude_rad = 0.6
gravity_m_s2 = 9.8
[gyro]
pulse_weight_rad = [3.9e-6, 3.9e-6, 3.9e-6]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [4e-7, 4e-7, 4e-7]
installation_rad = {}
[dither]
frequency_hz = [390.0, 410.0, 430.0]
amplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]
amplitude_spread = 0.05
pickoff_gain = [1.0, 1.0, 1.0]
pickoff_noise_rad = [2e-7, 2e-7, 2e-7]
pickoff_weight_rad = 1e-8
[thermal]
start_k = 300.0
self_heating_k = [8.0, 8.0, 8.0]
time_constant_s = [4.0, 4.0, 4.0]
sensor_noise_k = 0.0
sensor_weight_k = 0.015625
rate_hz = 250.0
[slow_channels]
rate_hz = 250.0
intensity = [1.0, 0.9, 0.8]
path_length_drive = [0.0, 0.1, 0.2]
path_length_drive_k = [0.01, 0.0, 0.0]
dither_drive = [1.0, 0.95, 1.1]
pulse_per_second = true
first_pulse_s = 0.25
clock_error = 3e-5
[[motion]]
kind = "still"
duration_s = 3.0
"#;

/// All faults, one after another and on one axis each.
pub const FAULTS: &str = r#"
[[fault]]
kind = "dying_laser"
axis = "x"
time_s = 0.5
time_constant_s = 0.1
[[fault]]
kind = "mode_hop"
axis = "y"
time_s = 0.802
size = -0.3
[[fault]]
kind = "path_length_reset"
axis = "z"
time_s = 1.002
[[fault]]
kind = "dither_drive"
axis = "x"
start_s = 1.202
end_s = 1.402
level = 1.8
[[fault]]
kind = "silent_thermometer"
axis = "y"
start_s = 1.602
end_s = 1.802
[[fault]]
kind = "pulse_lost"
start_s = 2.2
end_s = 2.3
[[fault]]
kind = "dither_amplitude"
axis = "z"
start_s = 2.4
end_s = 2.6
factor = 0.2
[[fault]]
kind = "stuck_counter"
axis = "y"
start_s = 2.7001
end_s = 2.9001
"#;

/// Simulates a scenario as `run`.
pub fn simulated(bench: &Bench, text: &str) -> Recording {
    bench.write("scenario.toml", text);
    bench.json(&["simulate", "scenario.toml", "--out", "run", "--seed", "3"]);
    Recording::read(bench.at("run")).expect("a recording")
}

/// Values of a channel.
pub fn values<'a>(recording: &'a Recording, quantity: &Quantity, axis: &str) -> &'a [f64] {
    &recording
        .channel(quantity, axis)
        .expect("a channel")
        .1
        .values
}
