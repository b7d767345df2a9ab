//! Scenes drawn from a seed: an instrument, its noise and a motion, shared by many trials.
//!
//! From the challenge's seed and the scene's number, a [`Scene`]: a scenario of the simulator with or without noise (SI
//! units), and the true noise of its residual.
//!
//! Trials of one scene differ in their noise and in the concealed effects; with a common motion the predictions of the
//! whole catalogue are simulated once. Two kinds of recordings: 40 s of increments at 200 to 500 Hz, and 20 s of dithered
//! counts at 1 or 4 kHz.

use std::fmt::Write as _;
use std::ops::Range;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::kinds::Needs;
use rlg_recording::error::InputError;
use rlg_simulator::scenario::Scenario;
use std::path::Path;

/// Setting of a scene; each is a family of effect-free records too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Setting {
    /// White noise: angle random walk, and white angle noise of the reference.
    White,
    /// Coarse pulses, counted at 1 kHz, with dither.
    Quantised,
    /// Rate random walk of the biases.
    Drifting,
    /// A unit that warms up.
    Thermal,
    /// Vibration throughout.
    Vibration,
    /// Dithered counts at 4 kHz with the dither's reaction on the case.
    DitherLines,
    /// At rest, warming steadily: kinds that are confounded by design.
    Resting,
}

/// Share held out at the end of each stretch of like motion; it does not count in a trial's strength.
const HELD_OUT_SHARE: f64 = 0.3;

/// Stretches shorter than this are fitted entirely \[s\].
const SHORTEST_SPLIT_S: f64 = 2.0;

/// Order of the settings in the pool, run through twice; 4 kHz takes ten times the work of the others, so it occurs once.
const ORDER: [Setting; 12] = {
    use Setting::{DitherLines, Drifting, Quantised, Thermal, Vibration, White};
    [
        White,
        Quantised,
        Drifting,
        Thermal,
        Vibration,
        White,
        Drifting,
        Quantised,
        Thermal,
        Vibration,
        Drifting,
        DitherLines,
    ]
};

/// Number of scenes in the pool, each with its own motion.
pub const POOL: usize = 24;

/// Number of the scene at rest, beyond the pool.
pub const RESTING: usize = POOL;

impl Setting {
    /// The setting of scene `number`.
    pub fn of(number: usize) -> Self {
        if number == RESTING {
            Self::Resting
        } else {
            ORDER[number % ORDER.len()]
        }
    }

    /// True if blocks are dithered and pulses counted.
    pub fn is_dithered(self) -> bool {
        matches!(self, Self::Quantised | Self::DitherLines)
    }
}

/// First ChaCha stream of the scenes; trials use the streams below.
const STREAMS: u64 = 1 << 40;

/// Negligible pulse weight, resolution or noise \[rad\].
const NOTHING_RAD: f64 = 1e-14;

/// True noise, x y z.
#[derive(Debug, Clone, Copy)]
pub struct Levels {
    /// Pulse weight \[rad\].
    pub pulse_rad: [f64; 3],
    /// Angle random walk \[rad/√s\].
    pub walk_rad_sqrt_s: [f64; 3],
    /// Rate random walk \[rad/s/√s\].
    pub rate_walk_rad_s_sqrt_s: [f64; 3],
    /// White noise of the pickoff \[rad\].
    pub pickoff_rad: f64,
    /// White angle noise of the reference \[rad\].
    pub reference_rad: f64,
    /// Angle random walk of the reference \[rad/√s\].
    pub reference_walk_rad_sqrt_s: f64,
}

/// One scene.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Number of the scene.
    pub number: usize,
    /// Setting of the scene.
    pub setting: Setting,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Seed of the motion.
    pub motion_seed: u64,
    /// True noise.
    pub levels: Levels,
    /// There are thermometers.
    pub thermal: bool,
    /// There are magnetometers.
    pub magnetic: bool,
    surroundings: String,
    motion: String,
    reaction: f64,
}

/// Scale errors and installation of every unit, known to the model; the predictions apply them.
const SCALE_ERROR: [f64; 3] = [8.0e-6, -5.0e-6, 3.0e-6];
/// xy, xz, yx, yz, zx, zy \[rad\].
const INSTALLATION: [f64; 6] = [-1.7e-4, 1.8e-4, 1.1e-4, -2.0e-5, -2.8e-4, 2.4e-4];

impl Scene {
    /// Draws scene `number`.
    pub fn draw(seed: u64, number: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAMS + number as u64);
        let setting = Setting::of(number);
        let dithered = setting.is_dithered();
        let rate_hz = match setting {
            Setting::DitherLines => 4000.0,
            // twice the frequency of the fastest dither
            Setting::Quantised => 1000.0,
            _ => [200.0, 250.0, 400.0, 500.0][rng.random_range(0..4)],
        };
        let level = |rng: &mut ChaCha8Rng, low: f64, high: f64| log_uniform(rng, low, high);
        let three = |rng: &mut ChaCha8Rng, low: f64, high: f64| {
            std::array::from_fn(|_| log_uniform(rng, low, high))
        };
        let levels = Levels {
            // 0.2 to 0.6 arcsec, or the resolution of an interpolating readout
            pulse_rad: if dithered {
                three(&mut rng, 1e-6, 3e-6)
            } else {
                [1e-9; 3]
            },
            // 0.001 to 0.004 deg/sqrt(h)
            walk_rad_sqrt_s: three(&mut rng, 3e-7, 1.2e-6),
            // between a tenth of the noise of a mean over 40 s and its double
            rate_walk_rad_s_sqrt_s: if setting == Setting::Drifting {
                three(&mut rng, 1e-8, 3e-7)
            } else {
                [0.0; 3]
            },
            pickoff_rad: 2.4e-7,
            reference_rad: level(&mut rng, 1e-7, 4e-7),
            reference_walk_rad_sqrt_s: 8.7e-8,
        };
        let thermal = match setting {
            Setting::Thermal | Setting::Resting => true,
            _ => rng.random_bool(0.3),
        };
        let magnetic = setting != Setting::Resting && rng.random_bool(0.4);
        let mut scene = Self {
            number,
            setting,
            rate_hz,
            motion_seed: rng.random(),
            levels,
            thermal,
            magnetic,
            surroundings: String::new(),
            motion: String::new(),
            reaction: if setting == Setting::DitherLines {
                level(&mut rng, 1e-5, 1e-4)
            } else {
                0.0
            },
        };
        scene.surroundings = scene.draw_surroundings(&mut rng);
        scene.motion = scene.draw_motion(&mut rng);
        scene
    }

    /// True if the scene has the required sensors of an effect.
    pub fn has(&self, needs: Needs) -> bool {
        match needs {
            Needs::Nothing => true,
            Needs::Thermal => self.thermal,
            Needs::Magnetic => self.magnetic,
            Needs::Dither => self.is_dithered(),
        }
    }

    /// True if blocks are dithered and pulses counted.
    pub fn is_dithered(&self) -> bool {
        self.setting.is_dithered()
    }

    /// Scenario of the scene for the simulator, with noise if `noisy`; `effects` as further TOML.
    pub fn scenario(&self, noisy: bool, effects: &str) -> Result<Scenario, InputError> {
        let text = self.text(noisy, effects);
        Scenario::parse(&text, Path::new("challenge.toml"))
    }

    fn text(&self, noisy: bool, effects: &str) -> String {
        let levels = &self.levels;
        let of = |values: [f64; 3]| if noisy { values } else { [0.0; 3] };
        let pulse = if noisy {
            levels.pulse_rad
        } else {
            [NOTHING_RAD; 3]
        };
        let weight = |rad: f64| if noisy { rad } else { NOTHING_RAD };
        let share = f64::from(u8::from(noisy));
        let names = rlg_model::catalogue::SIX;
        let angles: Vec<String> = names
            .iter()
            .zip(INSTALLATION)
            .map(|(name, angle)| format!("{name} = {angle:e}"))
            .collect();
        let mut text = format!(
            "format = 1\nname = \"challenge-{}\"\nrate_hz = {:e}\n\
             [site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.80665\n\
             [gyro]\npulse_weight_rad = {}\nbias_rad_s = [2.4e-8, -3.9e-8, 1.5e-8]\nscale_error = {}\n\
             angle_random_walk_rad_sqrt_s = {}\nrate_random_walk_rad_s_sqrt_s = {}\n\
             installation_rad = {{ {} }}\noutput = \"{}\"\n\
             [reference]\nangle_noise_rad = {:e}\nangle_random_walk_rad_sqrt_s = {:e}\nweight_rad = {:e}\n\
             [accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
             noise_m_s2_sqrt_hz = {:e}\nweight_m_s2 = {:e}\n",
            self.number,
            self.rate_hz,
            list(pulse),
            list(SCALE_ERROR),
            list(of(levels.walk_rad_sqrt_s)),
            list(of(levels.rate_walk_rad_s_sqrt_s)),
            angles.join(", "),
            if self.is_dithered() {
                "count"
            } else {
                "increment"
            },
            share * levels.reference_rad,
            share * levels.reference_walk_rad_sqrt_s,
            weight(4.8e-9),
            share * 4.5e-5,
            if noisy { 5e-4 } else { 1e-12 },
        );
        if self.is_dithered() {
            let _ = write!(
                text,
                "[dither]\nfrequency_hz = [392.6, 430.1, 474.8]\namplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]\n\
                 amplitude_spread = 0.15\npickoff_gain = [1.0, 1.0, 1.0]\npickoff_noise_rad = {}\n\
                 pickoff_weight_rad = {:e}\nreaction_ratio = {}\n",
                list(of([levels.pickoff_rad; 3])),
                weight(9.7e-9),
                list([self.reaction; 3]),
            );
        }
        text + &self.surroundings + &self.motion + effects
    }

    fn draw_surroundings(&self, rng: &mut ChaCha8Rng) -> String {
        let mut text = String::new();
        if self.thermal {
            let resting = self.setting == Setting::Resting;
            let heating: [f64; 3] = std::array::from_fn(|_| {
                if resting {
                    0.0
                } else {
                    log_uniform(rng, 2.0, 8.0)
                }
            });
            let constants: [f64; 3] = std::array::from_fn(|_| log_uniform(rng, 8.0, 60.0));
            let _ = write!(
                text,
                "[thermal]\nstart_k = 293.0\nself_heating_k = {}\ntime_constant_s = {}\n\
                 ambient_rate_k_s = {:e}\nsensor_noise_k = 2e-3\nsensor_weight_k = 1e-3\nrate_hz = 10.0\n",
                list(heating),
                list(constants),
                if resting { 0.1 } else { 0.02 },
            );
        }
        if self.magnetic {
            let coil: [f64; 3] = std::array::from_fn(|_| log_uniform(rng, 2e-5, 1e-4));
            let _ = write!(
                text,
                "[magnetic]\nnavigation_field_t = [2e-5, 3e-6, -4e-5]\ncoil_field_t = {}\n\
                 coil_frequency_hz = {:e}\nsensor_noise_t = 1e-8\nsensor_weight_t = 1e-9\nrate_hz = 50.0\n",
                list(coil),
                log_uniform(rng, 0.1, 1.0),
            );
        }
        text
    }

    fn draw_motion(&self, rng: &mut ChaCha8Rng) -> String {
        let mut text = String::new();
        let moves = 4;
        // 40 s, or 20 s of dithered counts
        let unit_s = if self.is_dithered() { 1.0 } else { 2.0 };
        let mut add = |lines: String, seconds: f64| {
            let _ = write!(text, "[[motion]]\n{lines}duration_s = {seconds:e}\n");
        };
        if self.setting == Setting::Resting {
            add("kind = \"still\"\n".to_owned(), 20.0 * unit_s);
            return text;
        }
        add("kind = \"still\"\n".to_owned(), 2.0 * unit_s);
        for _ in 0..moves {
            let seconds = 4.0 * unit_s;
            let axis = rng.random_range(0..3);
            let other = (axis + rng.random_range(1..3)) % 3;
            let [axis, other] = [axis, other].map(|axis| ["x", "y", "z"][axis]);
            let choice = if self.setting == Setting::Vibration {
                6 + rng.random_range(0..2)
            } else {
                rng.random_range(0..8)
            };
            match choice {
                0 => {
                    let angle = log_uniform(rng, 0.3, 1.2);
                    for angle in [angle, -angle] {
                        let lines =
                            format!("kind = \"slew\"\naxis = \"{axis}\"\nangle_rad = {angle:e}\n");
                        add(lines, seconds / 2.0);
                    }
                }
                1 | 2 => add(
                    format!(
                        "kind = \"coning\"\naxis = \"{axis}\"\nfrequency_hz = {:e}\nangle_rad = {:e}\nramp_s = 0.5\n",
                        log_uniform(rng, 1.0, 14.0),
                        log_uniform(rng, 0.003, 0.012)
                    ),
                    seconds,
                ),
                3 => add(
                    format!(
                        "kind = \"spin_synchronous\"\naxis = \"{axis}\"\nrate_rad_s = {:e}\nramp_s = 0.5\n\
                         oscillation_axis = \"{other}\"\noscillation_angle_rad = {:e}\noscillation_phase_rad = {:e}\n",
                        log_uniform(rng, 1.0, 3.0),
                        log_uniform(rng, 0.03, 0.2),
                        rng.random::<f64>() * 6.0
                    ),
                    seconds,
                ),
                4 => add(
                    format!(
                        "kind = \"spin\"\naxis = \"{axis}\"\nrate_rad_s = {:e}\nramp_s = 0.5\n",
                        log_uniform(rng, 0.3, 1.5)
                    ),
                    seconds,
                ),
                5 => add(
                    format!(
                        "kind = \"tumble\"\nrate_rad_s = {}\nfrequency_hz = {}\nramp_s = 0.5\n",
                        list(std::array::from_fn(|_| log_uniform(rng, 0.1, 0.6))),
                        list(std::array::from_fn(|_| log_uniform(rng, 0.1, 1.0)))
                    ),
                    seconds,
                ),
                6 => add(
                    format!(
                        "kind = \"vibration\"\nlow_hz = 5.0\nhigh_hz = {:e}\nrate_rms_rad_s = {}\nramp_s = 0.5\n",
                        (0.3 * self.rate_hz).min(120.0),
                        list(std::array::from_fn(|_| log_uniform(rng, 0.05, 0.2)))
                    ),
                    seconds,
                ),
                _ => {
                    let top = (0.25 * self.rate_hz).min(100.0);
                    let mut spectra = |low: f64, high: f64| {
                        let axes = ["x", "y", "z"].map(|axis| {
                            let density = log_uniform(rng, low, high);
                            format!("{axis} = [[4.0, {density:e}], [{top:e}, {density:e}]]")
                        });
                        format!("{{ {} }}", axes.join(", "))
                    };
                    let lines = format!(
                        "kind = \"random_vibration\"\nangular_psd_rad2_s2_hz = {}\nlinear_psd_m2_s4_hz = {}\nramp_s = 0.5\n",
                        spectra(2e-5, 2e-4),
                        spectra(3e-3, 3e-2)
                    );
                    add(lines, seconds);
                }
            }
        }
        add("kind = \"still\"\n".to_owned(), 2.0 * unit_s);
        text
    }

    /// Approximate number of fitted rows.
    pub fn fitted_rows(&self) -> usize {
        let seconds = if self.is_dithered() { 20.0 } else { 40.0 };
        ((1.0 - HELD_OUT_SHARE) * seconds * self.rate_hz) as usize
    }

    /// Scale error of a gyro in the model.
    pub fn scale_error(axis: usize) -> f64 {
        SCALE_ERROR[axis]
    }

    /// ε_ij of Eq. (7) in the model: xy, xz, yx, yz, zx, zy \[rad\].
    pub fn installation() -> [f64; 6] {
        INSTALLATION
    }
}

/// Fitted rows as declared by the diagnosis, and its held-out rows: the end of each segment.
pub fn split(scenario: &Scenario) -> [Vec<Range<usize>>; 2] {
    let mut first = 0;
    let (mut fitted, mut held_out): (Vec<Range<usize>>, Vec<_>) = (Vec::new(), Vec::new());
    for segment in &scenario.segments {
        let end = first + segment.rows;
        let long = segment.rows as f64 >= SHORTEST_SPLIT_S * scenario.rate_hz;
        let kept = if long {
            (segment.rows as f64 * HELD_OUT_SHARE) as usize
        } else {
            0
        };
        let cut = end - kept;
        match fitted.last_mut() {
            Some(last) if last.end == first => last.end = cut,
            _ => fitted.push(first..cut),
        }
        if kept > 0 {
            held_out.push(cut..end);
        }
        first = end;
    }
    [fitted, held_out]
}

/// Draws from a log-uniform distribution.
pub fn log_uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

fn list(values: [f64; 3]) -> String {
    format!("[{:e}, {:e}, {:e}]", values[0], values[1], values[2])
}
