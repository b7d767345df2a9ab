//! Describes the unit under test: a scenario's instrument, of the class of the paper's system (0.8 nmile/h).
//!
//! From a [`Grade`] and the block's coefficients it writes the scenario's sections as TOML, SI units, body axes x right, y
//! forward, z up; at the site the body begins with x to the north, so that a drift about x (pitch) drives the east velocity,
//! as in the paper's Fig. 6 and 7.
//!
//! The paper states the class and the 4 kHz, nothing else: pulse, dither and random walk are usual values of a dithered
//! block, biases give 0.8 nmile/h.

use trueaxis::CrossAxis;

/// The paper's sample rate \[Hz\].
pub const RATE_HZ: f64 = 4000.0;

/// Site Xi'an, where the authors work: geodetic latitude \[rad\] and gravity \[m/s²\].
pub const LATITUDE_RAD: f64 = 0.598;
/// See [`LATITUDE_RAD`].
pub const GRAVITY_M_S2: f64 = 9.7944;

/// Quality of the gyros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grade {
    /// Of a 0.8 nmile/h system: 0.0015 °/√h.
    Navigation,
    /// Without noise and with pulses a hundredth as large, so that flexure is the only unmodelled effect; dither and pickoff
    /// stay.
    Noiseless,
}

/// Angle random walk \[rad/√s\] of both kinds of gyro: "of the same precision". 0.0015 °/√h.
pub const ANGLE_RANDOM_WALK_RAD_SQRT_S: f64 = 4.4e-7;

/// Frequency of the suspension's lateral mode \[Hz\]. An inertia J on a stiffness k lags by K = J/k and has its mode at
/// √(k/J): one number gives both, 1/(2π√K) with Table 3's mean, 7.2e-8 s². The chain's static K deviates from it by (f/f₀)²:
/// 1 % at 60 Hz.
pub const MODE_HZ: f64 = 593.0;

/// Damping of a metal spring with glued joints \[1\].
pub const MODE_DAMPING: f64 = 0.02;

/// Formats `[gyro]`, `[dither]`, the second gyro triad, accelerometers, and the flexure.
pub fn sections(name: &str, grade: Grade, flexure_s2: &CrossAxis<f64>) -> String {
    let (walk, pickoff_noise, force_noise, fine) = match grade {
        // 0.05″ of pickoff noise; 5 µg/√Hz
        Grade::Navigation => (ANGLE_RANDOM_WALK_RAD_SQRT_S, 2.4e-7, 4.5e-5, 1.0),
        Grade::Noiseless => (0.0, 0.0, 0.0, 0.01),
    };
    let [px, py, pz] = [2.1e-6, 1.9e-6, 2.0e-6].map(|pulse_rad: f64| fine * pulse_rad);
    let [xy, xz, yx, yz, zx, zy] = flexure_s2.to_array();
    format!(
        r#"format = 1
name = "{name}"
rate_hz = {RATE_HZ:.1}

[site]
latitude_rad = {LATITUDE_RAD}
gravity_m_s2 = {GRAVITY_M_S2}
earth_rate = true

[gyro]
pulse_weight_rad = [{px:e}, {py:e}, {pz:e}]
bias_rad_s = [2.4e-8, -3.9e-8, 1.5e-8]
scale_error = [8.0e-6, -5.0e-6, 3.0e-6]
angle_random_walk_rad_sqrt_s = [{walk:e}, {walk:e}, {walk:e}]
installation_rad = {{ xy = -1.7e-4, xz = 1.8e-4, yx = 1.1e-4, yz = -2.0e-5, zx = -2.8e-4, zy = 2.4e-4 }}

[dither]
frequency_hz = [392.6, 430.1, 474.8]
amplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]
amplitude_spread = 0.15
pickoff_gain = [1.0, 1.0, 1.0]
pickoff_noise_rad = [{pickoff_noise:e}, {pickoff_noise:e}, {pickoff_noise:e}]
pickoff_weight_rad = 9.7e-9

[fibre_optic]
angle_noise_rad = {pickoff_noise:e}
angle_random_walk_rad_sqrt_s = {walk:e}
weight_rad = 4.8e-9

[accelerometer]
bias_m_s2 = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
noise_m_s2_sqrt_hz = {force_noise:e}
weight_m_s2 = 1.0e-5

[[effect]]
kind = "axis_flexure_mode"
frequency_hz = {MODE_HZ:.1}
damping = {MODE_DAMPING}
xy = {xy:e}
xz = {xz:e}
yx = {yx:e}
yz = {yz:e}
zx = {zx:e}
zy = {zy:e}
"#
    )
}

/// Residual bias of a calibration: 0.004 °/h a gyro, two of which make 0.8 nmile/h. The chain does not correct it.
pub const RESIDUAL_BIAS_RAD_S: f64 = 2.0e-8;

/// Formats the `[[effect]]` of [`RESIDUAL_BIAS_RAD_S`].
pub fn residual_bias() -> String {
    let b = RESIDUAL_BIAS_RAD_S;
    format!(
        "\n[[effect]]\nkind = \"gyro_bias\"\nx = {b:e}\ny = {:e}\nz = {b:e}\n",
        -b
    )
}

/// Rest before and after the motion of a system \[s\]: enough for levelling.
pub const REST_S: f64 = 60.0;

/// Formats a `[[motion]]` at rest.
pub fn still(duration_s: f64) -> String {
    format!("\n[[motion]]\nkind = \"still\"\nduration_s = {duration_s:.4}\n")
}

/// Formats a `[[motion]]` of coning about `axis`.
pub fn coning(axis: &str, frequency_hz: f64, angle_deg: f64, duration_s: f64) -> String {
    let angle_rad = angle_deg.to_radians();
    format!(
        "\n[[motion]]\nkind = \"coning\"\naxis = \"{axis}\"\nfrequency_hz = {frequency_hz:.4}\n\
         angle_rad = {angle_rad:e}\nduration_s = {duration_s:.4}\nramp_s = {RAMP_S:.1}\n"
    )
}

/// Length of each taper \[s\]: it need not be long relative to a cycle of 1 Hz, only give a jerk-free start.
pub const RAMP_S: f64 = 1.0;
