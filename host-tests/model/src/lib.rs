//! Defines a model: what the simulation of a recording already contains, and what the firmware compensates.
//!
//! `model.toml` gives a checked [`Model`]: finite, in range, known kinds with their own parameter names. Units are SI;
//! the meaning of every name is fixed by the project's contract.

use std::collections::BTreeMap;

mod bounds;
pub mod catalogue;
mod file;
pub mod keys;

pub mod kinds;
mod text;

/// Where the case's motion comes from.
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

/// `[gyro]`, each x, y, z. The default names nothing and corrects nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gyro {
    /// Angle of one pulse \[rad\], positive; 0 on all axes where the model names none ([`Gyro::names_pulse_weights`]).
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

/// `[dither]`, each x, y, z. Absent in models of undithered gyros; pickoffs that were recorded all the same are taken at
/// their word ([`Model::pickoff_gain`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Dither {
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// Noise of one pickoff reading \[rad\].
    pub pickoff_noise_rad: [f64; 3],
}

/// `[reference]`. What is absent is unknown, not zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reference {
    /// White noise of the reference's angle \[rad\].
    pub angle_noise_rad: Option<f64>,
    /// Its angle random walk \[rad/√s\].
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

/// One `[[effect]]`: physics that is switched on.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEffect {
    /// Its kind in the contract's catalogue.
    pub kind: String,
    /// Its parameters by the contract's names; absent six/nine/xyz entries count as 0.
    pub parameters: BTreeMap<String, EffectValue>,
}

/// Natural frequency of the block that a flexure K = J/k \[s²\] implies \[Hz\], f0 = 1/(2π√K); `None` where K is not positive.
pub fn implied_hz(flexure_s2: f64) -> Option<f64> {
    (flexure_s2 > 0.0).then(|| 1.0 / (std::f64::consts::TAU * flexure_s2.sqrt()))
}

/// How the firmware compensates a block's static flexure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Response {
    /// With the block's own mode, f0 = 1/(2π√K), that its K implies.
    #[default]
    Mode,
    /// As a spring without inertia, as predictions and simulations of `axis_flexure` are.
    Static,
}

/// A model in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Where the motion comes from.
    pub motion: MotionSource,
    /// Whether the reference motion already contains the Earth's rotation.
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

/// The names that the reader of `model.toml` takes, by section.
pub fn read_names() -> [(&'static str, &'static [&'static str]); 6] {
    file::read_names()
}

impl Model {
    /// Block angle over a recorded pickoff's angle; 1 where the model says nothing of a dither.
    pub fn pickoff_gain(&self, axis: usize) -> f64 {
        let dither = self.dither.as_ref();
        dither.map_or(1.0, |dither| dither.pickoff_gain[axis])
    }

    /// Noise of one reading of each recorded pickoff \[rad\]; 0 where the model says nothing of a dither.
    pub fn pickoff_noise_rad(&self) -> [f64; 3] {
        let dither = self.dither.as_ref();
        dither.map_or([0.0; 3], |dither| dither.pickoff_noise_rad)
    }

    /// White noise of a block's angle as its pickoff says it \[rad²\].
    pub fn pickoff_white_rad2(&self, axis: usize) -> f64 {
        (self.pickoff_gain(axis) * self.pickoff_noise_rad()[axis]).powi(2)
    }
}

impl Gyro {
    /// Whether the model says what a pulse is: only gyros that count need it.
    pub fn names_pulse_weights(&self) -> bool {
        self.pulse_weight_rad != [0.0; 3]
    }
}

impl Installation {
    /// In the order xy, xz, yx, yz, zx, zy \[rad\].
    pub fn to_array(self) -> [f64; 6] {
        [self.xy, self.xz, self.yx, self.yz, self.zx, self.zy]
    }

    /// From the order xy, xz, yx, yz, zx, zy \[rad\].
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
    /// A parameter that is a number; absent ones count as 0.
    pub fn number(&self, name: &str) -> f64 {
        match self.parameters.get(name) {
            Some(EffectValue::Number(value)) => *value,
            _ => 0.0,
        }
    }

    /// A parameter that is text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.parameters.get(name) {
            Some(EffectValue::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// How the firmware compensates it; said of `axis_flexure` only.
    pub fn response(&self) -> Response {
        match self.text("response") {
            Some(catalogue::STATIC) => Response::Static,
            _ => Response::Mode,
        }
    }

    /// The damping ratio \[1\], where the model says one; of `axis_flexure`, that of the mode that its K implies.
    pub fn damping(&self) -> Option<f64> {
        let given = self.parameters.contains_key("damping");
        given.then(|| self.number("damping"))
    }

    /// Numbers that no recording fixes, with what was written for them; `None` where all are known.
    pub fn choice(&self) -> Option<&str> {
        self.text(catalogue::CHOICE_KEY)
    }
}
