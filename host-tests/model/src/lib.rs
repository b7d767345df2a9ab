//! Model of a unit: known effects in the simulation of a recording, and their compensation by the firmware.
//!
//! `model.toml` is read into a checked [`Model`]: finite numbers in range, known kinds with their own parameter names.
//! Units are SI; the meaning of every name is fixed by the project's contract.

use std::collections::BTreeMap;
use std::path::Path;

mod bounds;
pub mod catalogue;
mod file;
pub mod keys;

pub mod kinds;
mod text;

/// Source of the case's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionSource {
    /// From the recording's reference channels.
    Reference,
    /// At rest on the Earth, at the recording's site.
    Static,
}

/// The six small angles ε_ij0 of Eq. (7) \[rad\]: ε_xy multiplies the **z** rate in gyro x, and so on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Installation {
    /// Gyro x about y: multiplies ω_z.
    pub xy: f64,
    /// Gyro x about z: multiplies ω_y.
    pub xz: f64,
    /// Gyro y about x: multiplies ω_z.
    pub yx: f64,
    /// Gyro y about z: multiplies ω_x.
    pub yz: f64,
    /// Gyro z about x: multiplies ω_y.
    pub zx: f64,
    /// Gyro z about y: multiplies ω_x.
    pub zy: f64,
}

/// `[gyro]`, each x, y, z. The default has no pulse weights and zero corrections.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gyro {
    /// Angle of one pulse \[rad\], positive; 0 on all axes without pulse weights in the model
    /// ([`Gyro::names_pulse_weights`]).
    pub pulse_weight_rad: [f64; 3],
    /// Bias \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// Scale error δk of Eq. (7) \[1\].
    pub scale_error: [f64; 3],
    /// Angle random walk \[rad/√s\]; absent: estimated from the recording.
    pub angle_random_walk_rad_sqrt_s: Option<[f64; 3]>,
    /// Rate random walk K of IEEE 952 \[rad/s/√s\]; absent, with B absent too: unknown, drift is possible.
    pub rate_random_walk_rad_s_sqrt_s: Option<[f64; 3]>,
    /// Flicker rate noise, the bias instability B of IEEE 952 \[rad/s\]; absent as K.
    pub flicker_rad_s: Option<[f64; 3]>,
    /// ε_ij0 \[rad\].
    pub installation_rad: Installation,
}

/// `[dither]`, each x, y, z. Absent in models of undithered gyros; recorded pickoffs then have gain 1 and no noise
/// ([`Model::pickoff_gain`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Dither {
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// Noise of one pickoff sample \[rad\].
    pub pickoff_noise_rad: [f64; 3],
}

/// `[reference]`. An absent value is unknown, not zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reference {
    /// White noise of the reference's angle \[rad\].
    pub angle_noise_rad: Option<f64>,
    /// Angle random walk of the reference \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: Option<f64>,
}

/// `[accelerometer]`, optional.
#[derive(Debug, Clone, PartialEq)]
pub struct Accelerometer {
    /// Bias \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// Scale error \[1\].
    pub scale_error: [f64; 3],
    /// White noise \[m/s²/√Hz\]; 0: estimated from the recording.
    pub noise_m_s2_sqrt_hz: [f64; 3],
}

/// The value of one parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub enum EffectValue {
    /// A number in the unit of the contract's table.
    Number(f64),
    /// `axis`, `channel`, `expression`.
    Text(String),
}

/// One `[[effect]]` of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEffect {
    /// Kind in the contract's catalogue.
    pub kind: String,
    /// Parameters by the contract's names; absent six/nine/xyz entries count as 0.
    pub parameters: BTreeMap<String, EffectValue>,
}

/// Computes the natural frequency of a block \[Hz\] from its flexure K = J/k \[s²\], f0 = 1/(2π√K); `None` if K is not
/// positive.
pub fn implied_hz(flexure_s2: f64) -> Option<f64> {
    (flexure_s2 > 0.0).then(|| 1.0 / (std::f64::consts::TAU * flexure_s2.sqrt()))
}

/// Compensation of a block's static flexure by the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Response {
    /// With the block's mode implied by its K, f0 = 1/(2π√K).
    #[default]
    Mode,
    /// As a spring without inertia, like predictions and simulations of `axis_flexure`.
    Static,
}

/// A model in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Source of the motion.
    pub motion: MotionSource,
    /// The reference motion already contains the Earth's rotation.
    pub earth_rate_in_reference: bool,
    /// The gyros.
    pub gyro: Gyro,
    /// The dither and its pickoff.
    pub dither: Option<Dither>,
    /// The reference's noise.
    pub reference: Option<Reference>,
    /// The accelerometers.
    pub accelerometer: Option<Accelerometer>,
    /// The effects switched on.
    pub effects: Vec<ModelEffect>,
}

/// A model, and the file that declares it, named in messages.
#[derive(Debug, Clone, Copy)]
pub struct DeclaredModel<'a> {
    /// The model.
    pub model: &'a Model,
    /// Its file.
    pub file: &'a Path,
}

impl<'a> DeclaredModel<'a> {
    /// A model as declared by a file.
    pub fn new(model: &'a Model, file: &'a Path) -> Self {
        Self { model, file }
    }
}

/// Returns the names accepted by the reader of `model.toml`, by section.
pub fn read_names() -> [(&'static str, &'static [&'static str]); 6] {
    file::read_names()
}

impl Model {
    /// Gain from a recorded pickoff's angle to the block's angle \[1\]; 1 without a dither in the model.
    pub fn pickoff_gain(&self, axis: usize) -> f64 {
        let dither = self.dither.as_ref();
        dither.map_or(1.0, |dither| dither.pickoff_gain[axis])
    }

    /// Noise of one sample of each recorded pickoff \[rad\]; 0 without a dither in the model.
    pub fn pickoff_noise_rad(&self) -> [f64; 3] {
        let dither = self.dither.as_ref();
        dither.map_or([0.0; 3], |dither| dither.pickoff_noise_rad)
    }

    /// White noise of a block's angle measured by its pickoff \[rad²\].
    pub fn pickoff_white_rad2(&self, axis: usize) -> f64 {
        (self.pickoff_gain(axis) * self.pickoff_noise_rad()[axis]).powi(2)
    }

    /// White noise of a gyro's angle: rounding to pulses, and pickoff \[rad²\].
    pub fn gyro_white_rad2(&self, axis: usize) -> f64 {
        self.gyro.pulse_weight_rad[axis].powi(2) / 12.0 + self.pickoff_white_rad2(axis)
    }
}

impl Gyro {
    /// True if the model has pulse weights, which only gyros with pulse counts need.
    pub fn names_pulse_weights(&self) -> bool {
        self.pulse_weight_rad != [0.0; 3]
    }
}

impl Installation {
    /// Angles in the order xy, xz, yx, yz, zx, zy \[rad\].
    pub fn to_array(self) -> [f64; 6] {
        [self.xy, self.xz, self.yx, self.yz, self.zx, self.zy]
    }

    /// Angles from the order xy, xz, yx, yz, zx, zy \[rad\].
    pub fn from_array([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> Self {
        Self {
            xy,
            xz,
            yx,
            yz,
            zx,
            zy,
        }
    }
}

impl ModelEffect {
    /// Value of a numeric parameter; 0 if absent.
    pub fn number(&self, name: &str) -> f64 {
        match self.parameters.get(name) {
            Some(EffectValue::Number(value)) => *value,
            _ => 0.0,
        }
    }

    /// Value of a text parameter.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.parameters.get(name) {
            Some(EffectValue::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// Compensation by the firmware; for `axis_flexure` only.
    pub fn response(&self) -> Response {
        match self.text("response") {
            Some(catalogue::STATIC) => Response::Static,
            _ => Response::Mode,
        }
    }

    /// Damping ratio \[1\], if given; for `axis_flexure`, that of the mode implied by its K.
    pub fn damping(&self) -> Option<f64> {
        let given = self.parameters.contains_key("damping");
        given.then(|| self.number("damping"))
    }

    /// Text on parameters that no recording can estimate, with the values chosen for them; `None` if all are estimable.
    pub fn choice(&self) -> Option<&str> {
        self.text(catalogue::CHOICE_KEY)
    }
}
