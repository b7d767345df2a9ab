//! Effects that the challenge can conceal: the simulator's effects, with sizes typical of instruments.
//!
//! [`Linear`] entries (prediction proportional to the parameters) by kind, and expressions of physics outside any
//! catalogue. SI units as in the contract's table.
//!
//! The sizes are the examiner's own, not those of the diagnosis' cards: they only set the mix of parameters, since every
//! effect is scaled to the drawn strength. An effect larger than `largest` is not credible for an instrument, and the draw
//! is repeated.

use rlg_model::catalogue::Kind;

/// Sensors that an effect requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Gyros and reference alone.
    Nothing,
    /// Thermometers.
    Thermal,
    /// Magnetometers.
    Magnetic,
    /// Dithered blocks.
    Dither,
}

/// Gyros on which one parameter acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// The gyro of the parameter's first letter.
    Own,
    /// All gyros.
    All,
}

/// Kind with a prediction proportional to its parameters (delays: if short).
#[derive(Debug, Clone, Copy)]
pub struct Linear {
    /// The contract's kind.
    pub kind: &'static str,
    /// Typical size in instruments, in the kind's unit.
    pub typical: f64,
    /// Largest credible size in an instrument.
    pub largest: f64,
    /// Required sensors.
    pub needs: Needs,
    /// Gyros on which one parameter acts.
    pub reach: Reach,
}

const fn own(kind: &'static str, typical: f64, largest: f64, needs: Needs) -> Linear {
    Linear {
        kind,
        typical,
        largest,
        needs,
        reach: Reach::Own,
    }
}

const fn all(kind: &'static str, typical: f64, largest: f64) -> Linear {
    Linear {
        kind,
        typical,
        largest,
        needs: Needs::Nothing,
        reach: Reach::All,
    }
}

/// All linear kinds, in the contract's order.
pub const LINEAR: &[Linear] = &[
    own("gyro_bias", 5e-7, 1e-3, Needs::Nothing),
    own("gyro_bias_temperature", 1e-6, 1e-3, Needs::Thermal),
    own("gyro_bias_temperature_rate", 1e-5, 1e-1, Needs::Thermal),
    own("gyro_bias_magnetic", 1e-3, 10.0, Needs::Magnetic),
    own("gyro_g_bias", 1e-7, 1e-4, Needs::Nothing),
    own("gyro_g2_bias", 1e-8, 1e-5, Needs::Nothing),
    own("gyro_scale", 1e-5, 0.02, Needs::Nothing),
    own("gyro_scale_asymmetry", 1e-5, 0.02, Needs::Nothing),
    own("gyro_scale_quadratic", 1e-5, 0.05, Needs::Nothing),
    own("gyro_scale_cubic", 1e-5, 0.05, Needs::Nothing),
    own("installation", 3e-5, 0.01, Needs::Nothing),
    own("installation_temperature", 1e-5, 5e-3, Needs::Thermal),
    own("axis_flexure", 1e-7, 1e-6, Needs::Nothing),
    own("axis_flexure_cubic", 1e-12, 1e-8, Needs::Nothing),
    own("axis_tilt_by_force", 1e-7, 5e-4, Needs::Nothing),
    own("elastic_rate_by_force", 1e-7, 5e-4, Needs::Nothing),
    own("elastic_rate_by_jerk", 1e-7, 5e-5, Needs::Nothing),
    // A millisecond is short against the motion's fastest period, so the prediction is linear.
    own("gyro_delay", 2e-5, 1e-3, Needs::Nothing),
    own("dither_gain", 1e-4, 0.1, Needs::Dither),
    own("dither_delay", 1e-6, 2e-5, Needs::Dither),
    own("dither_cubic", 1e2, 1e6, Needs::Dither),
    own("dither_crosstalk", 1e-4, 0.05, Needs::Dither),
    all("reference_misalignment", 1e-4, 0.02),
    all("reference_delay", 2e-5, 1e-3),
    all("reference_scale", 1e-5, 0.02),
];

/// Kinds whose prediction must be simulated for each trial: an instant, an order or a mode is drawn too.
pub const DRAWN: &[&str] = &[
    "gyro_bias_step",
    "counter_slip",
    "axis_flexure_mode",
    "reference_harmonic",
];

/// Kinds that only raise the noise.
pub const NOISY: &[&str] = &["angle_random_walk", "pulse_quantisation"];

/// Physics outside the catalogue: gyro, expression in the simulator's syntax, required sensors, a size \[rad/s per unit of
/// the product\].
pub const UNLISTED: &[(&str, &str, Needs)] = &[
    ("z", "omega_x*omega_y", Needs::Nothing),
    ("x", "alpha_y*alpha_z", Needs::Nothing),
    ("y", "omega_x*omega_x", Needs::Nothing),
    ("z", "alpha_x*force_y", Needs::Nothing),
    ("x", "omega_y*omega_z*omega_x", Needs::Nothing),
    ("y", "abs_omega_z*force_x", Needs::Nothing),
    ("x", "temperature_x*omega_x", Needs::Thermal),
    ("z", "temperature_rate_z*omega_y", Needs::Thermal),
    ("y", "field_x*omega_y", Needs::Magnetic),
    ("x", "field_z*field_z", Needs::Magnetic),
    ("z", "sine(0.7)", Needs::Nothing),
    ("x", "cosine(17.3)", Needs::Nothing),
    ("y", "decay(6)", Needs::Nothing),
    ("z", "window(11,17)", Needs::Nothing),
    ("y", "dither_rate_x*dither_rate_y", Needs::Dither),
];

impl Linear {
    /// Entry of a kind.
    pub fn of(kind: &str) -> Option<&'static Self> {
        LINEAR.iter().find(|entry| entry.kind == kind)
    }

    /// Names of the parameters, in the contract's order.
    pub fn names(&self) -> Vec<&'static str> {
        Kind::named(self.kind)
            .map(|kind| kind.parameter_names().collect())
            .unwrap_or_default()
    }

    /// Parameters in groups that one simulation can predict together: one of each gyro.
    pub fn groups(&self) -> Vec<Vec<&'static str>> {
        let names = self.names();
        if self.reach == Reach::All {
            return names.into_iter().map(|name| vec![name]).collect();
        }
        let each = names.len() / 3;
        (0..each)
            .map(|place| (0..3).map(|gyro| names[gyro * each + place]).collect())
            .collect()
    }

    /// True if physics allows one sign only: a suspension's compliance J/k.
    pub fn is_positive(&self) -> bool {
        self.kind == "axis_flexure"
    }

    /// True if the prediction is not quite proportional to the size, so that a central difference is taken.
    pub fn is_delay(&self) -> bool {
        self.kind.ends_with("_delay")
    }
}

/// Gyro of a parameter's first letter.
pub fn gyro_of(parameter: &str) -> Option<usize> {
    ["x", "y", "z"]
        .iter()
        .position(|axis| parameter.starts_with(axis))
}
