//! A scenario: what the simulator is asked to build.
//!
//! Enters: a TOML file (SI units, keys as below). Leaves: [`Scenario`], checked: every number finite and
//! physically possible, every key known. An unknown key is an error that names its line, since a misspelt
//! key would otherwise simulate something else without a word.
//!
//! Deliberately not here: defaults for the instrument. A scenario says what it simulates.

use super::effects::Effects;
use super::entry::Entry;
use super::motion::Profile;
use crate::error::InputError;
use crate::model::{Installation, ModelEffect};
use serde::Deserialize;
use std::path::Path;

/// A scenario, checked.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// Name of the recording.
    pub name: String,
    /// Sample rate of all channels \[Hz\].
    pub rate_hz: f64,
    /// Begin of the first row \[s\].
    pub start_s: f64,
    /// Where on Earth; `None`: no Earth rate, no gravity, no accelerometers.
    pub site: Option<SiteEntry>,
    /// Initial attitude, body to navigation (north, west, up) frame, w x y z.
    pub attitude_wxyz: [f64; 4],
    /// The gyros.
    pub gyro: GyroEntry,
    /// The dithers; `None`: undithered gyros, no pickoff channel.
    pub dither: Option<DitherEntry>,
    /// The reference; `None`: no reference channel.
    pub reference: Option<ReferenceEntry>,
    /// The accelerometers; `None`: no such channel.
    pub accelerometer: Option<AccelerometerEntry>,
    /// The motion, segment after segment.
    pub segments: Vec<SegmentEntry>,
    /// Effects that the model admits.
    pub known_effects: Vec<ModelEffect>,
    /// Effects that only the truth file tells.
    pub concealed_effects: Vec<ModelEffect>,
    /// The sum of both, as the simulator applies it.
    pub effects: Effects,
}

/// `[site]`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteEntry {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// \[m/s²\].
    pub gravity_m_s2: f64,
    /// Whether the Earth turns; the reference then contains its rotation too.
    #[serde(default = "yes")]
    pub earth_rate: bool,
}

fn yes() -> bool {
    true
}

/// `[gyro]`, x y z: the truth that the model also states.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GyroEntry {
    /// \[rad\].
    pub pulse_weight_rad: [f64; 3],
    /// \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// \[1\].
    pub scale_error: [f64; 3],
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: [f64; 3],
    /// ε_ij0 \[rad\].
    pub installation_rad: InstallationEntry,
}

/// `installation_rad`, the six of Eq. (7); absent ones are 0 \[rad\].
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs)]
pub struct InstallationEntry {
    pub xy: f64,
    pub xz: f64,
    pub yx: f64,
    pub yz: f64,
    pub zx: f64,
    pub zy: f64,
}

impl From<InstallationEntry> for Installation {
    fn from(entry: InstallationEntry) -> Self {
        let InstallationEntry {
            xy,
            xz,
            yx,
            yz,
            zx,
            zy,
        } = entry;
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

/// `[dither]`, x y z.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DitherEntry {
    /// \[Hz\].
    pub frequency_hz: [f64; 3],
    /// Mean amplitude of the pickoff angle \[rad\].
    pub amplitude_rad: [f64; 3],
    /// Rms deviation of the amplitude over its mean \[1\].
    pub amplitude_spread: f64,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// White noise of one reading \[rad\].
    pub pickoff_noise_rad: [f64; 3],
    /// Resolution of a reading \[rad\].
    pub pickoff_weight_rad: f64,
}

/// `[reference]`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceEntry {
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Resolution of the angle \[rad\].
    pub weight_rad: f64,
}

/// `[accelerometer]`, x y z.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccelerometerEntry {
    /// \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// \[1\].
    pub scale_error: [f64; 3],
    /// One-sided density \[m/s²/√Hz\].
    pub noise_m_s2_sqrt_hz: f64,
    /// Resolution of a reading \[m/s²\].
    pub weight_m_s2: f64,
}

/// One `[[motion]]`.
#[derive(Debug, Clone)]
pub struct SegmentEntry {
    /// Its name in the recording.
    pub name: String,
    /// Its kind in the recording.
    pub kind: String,
    /// Its length in rows.
    pub rows: usize,
    /// How it moves.
    pub profile: Profile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    format: u32,
    name: String,
    rate_hz: f64,
    #[serde(default)]
    start_s: f64,
    #[serde(default = "identity")]
    attitude_wxyz: [f64; 4],
    site: Option<SiteEntry>,
    gyro: GyroEntry,
    dither: Option<DitherEntry>,
    reference: Option<ReferenceEntry>,
    accelerometer: Option<AccelerometerEntry>,
    motion: Vec<toml::Spanned<toml::Table>>,
    #[serde(default)]
    effect: Vec<toml::Spanned<toml::Table>>,
}

fn identity() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// Rows a recording may have: an hour and a half at 4 kHz; beyond it the channels no longer fit in 3 GB.
const MOST_ROWS: usize = 22_000_000;

impl Scenario {
    /// Reads and checks a scenario file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|error| InputError::new(path, format!("cannot be read: {error}")))?;
        Self::parse(&text, path)
    }

    /// Parses a scenario; `path` is for messages.
    pub fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let file: ScenarioFile = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(text, span.start));
            InputError::new(path, format!("line {line}: {}", error.message()))
        })?;
        if file.format != 1 {
            return Err(InputError::new(path, "is of another format number")
                .channel("format")
                .value(file.format)
                .expected("1"));
        }
        check_numbers(&file, path)?;
        let mut segments = Vec::new();
        for table in &file.motion {
            let entry = Entry::new(path, text, table.span().start, table.get_ref());
            segments.push(segment(entry, file.rate_hz)?);
        }
        let rows: usize = segments.iter().map(|segment| segment.rows).sum();
        if rows == 0 || rows > MOST_ROWS {
            return Err(InputError::new(path, "has no usable length")
                .channel("motion")
                .value(format!("{rows} rows"))
                .expected(format!("1 to {MOST_ROWS} rows")));
        }
        let mut effects = Effects::default();
        let (mut known_effects, mut concealed_effects) = (Vec::new(), Vec::new());
        for table in &file.effect {
            let mut entry = Entry::new(path, text, table.span().start, table.get_ref());
            let concealed = entry.flag("concealed", true)?;
            let effect = effects.add(entry)?;
            if concealed {
                concealed_effects.push(effect);
            } else {
                known_effects.push(effect);
            }
        }
        Ok(Self {
            name: file.name,
            rate_hz: file.rate_hz,
            start_s: file.start_s,
            site: file.site,
            attitude_wxyz: file.attitude_wxyz,
            gyro: file.gyro,
            dither: file.dither,
            reference: file.reference,
            accelerometer: file.accelerometer,
            segments,
            known_effects,
            concealed_effects,
            effects,
        })
    }

    /// Rows of the recording.
    pub fn rows(&self) -> usize {
        self.segments.iter().map(|segment| segment.rows).sum()
    }
}

pub(super) fn line_of(text: &str, byte: usize) -> usize {
    1 + text[..byte.min(text.len())].matches('\n').count()
}

fn segment(mut entry: Entry, rate_hz: f64) -> Result<SegmentEntry, InputError> {
    let kind = entry.text("kind")?;
    let duration_s = entry.positive("duration_s")?;
    let rows = (duration_s * rate_hz).round();
    if (rows - duration_s * rate_hz).abs() > 1e-6 * rows.max(1.0) {
        return Err(entry
            .error("duration_s", "is not a whole number of sample periods")
            .value(duration_s));
    }
    let ramp = |entry: &mut Entry| -> Result<f64, InputError> {
        let ramp_s = entry.positive("ramp_s")?;
        if 2.0 * ramp_s > duration_s {
            return Err(entry
                .error("ramp_s", "is longer than half the segment")
                .value(ramp_s));
        }
        Ok(ramp_s)
    };
    let below_nyquist = |entry: &Entry, key: &str, frequency_hz: f64| {
        if frequency_hz.abs() < 0.5 * rate_hz {
            return Ok(());
        }
        Err(entry
            .error(key, "is not below half the sample rate")
            .value(frequency_hz)
            .expected(format!("less than {} Hz", 0.5 * rate_hz)))
    };
    let (profile, suffix) = match kind.as_str() {
        "still" => (Profile::Still, String::new()),
        "coning" => {
            let (axis, letter) = entry.axis("axis")?;
            let frequency_hz = entry.number("frequency_hz")?;
            below_nyquist(&entry, "frequency_hz", frequency_hz)?;
            let profile = Profile::Coning {
                axis,
                frequency_hz,
                angle_rad: entry.number("angle_rad")?,
                ramp_s: ramp(&mut entry)?,
            };
            (profile, format!("-{letter}"))
        }
        "slew" => {
            let (axis, letter) = entry.axis("axis")?;
            let angle_rad = entry.number("angle_rad")?;
            (Profile::Slew { axis, angle_rad }, format!("-{letter}"))
        }
        "spin" => {
            let (axis, letter) = entry.axis("axis")?;
            let oscillating = entry.has("oscillation_axis");
            let profile = Profile::Spin {
                axis,
                rate_rad_s: entry.number("rate_rad_s")?,
                ramp_s: ramp(&mut entry)?,
                oscillation_axis: if oscillating {
                    entry.axis("oscillation_axis")?.0
                } else {
                    axis
                },
                oscillation_frequency_hz: entry
                    .number_if("oscillation_frequency_hz", oscillating)?,
                oscillation_angle_rad: entry.number_if("oscillation_angle_rad", oscillating)?,
                oscillation_phase_rad: entry.number_if("oscillation_phase_rad", oscillating)?,
            };
            (profile, format!("-{letter}"))
        }
        "vibration" => {
            let (low_hz, high_hz) = (entry.positive("low_hz")?, entry.positive("high_hz")?);
            if high_hz <= low_hz {
                return Err(entry.error("high_hz", "is not above low_hz").value(high_hz));
            }
            below_nyquist(&entry, "high_hz", high_hz)?;
            let axis_phase_rad = if entry.has("axis_phase_rad") {
                Some(entry.triple("axis_phase_rad")?)
            } else {
                None
            };
            let profile = Profile::Vibration {
                low_hz,
                high_hz,
                rate_rms_rad_s: entry.triple("rate_rms_rad_s")?,
                axis_phase_rad,
                ramp_s: ramp(&mut entry)?,
            };
            (profile, String::new())
        }
        other => {
            return Err(entry
                .error("kind", "is no motion of this simulator")
                .value(other)
                .expected("still, coning, slew, spin or vibration"));
        }
    };
    let name = if entry.has("name") {
        entry.text("name")?
    } else {
        format!("{kind}{suffix}")
    };
    entry.finish()?;
    Ok(SegmentEntry {
        name,
        kind,
        rows: rows as usize,
        profile,
    })
}

/// Each number finite and where physics allows it; the first that is not is named by its key.
fn check_numbers(file: &ScenarioFile, path: &Path) -> Result<(), InputError> {
    let mut checks: Vec<(&str, f64, f64, f64)> = vec![
        ("rate_hz", file.rate_hz, 1.0, 1e5),
        ("start_s", file.start_s, -1e9, 1e9),
    ];
    let mut each = |key: &'static str, values: &[f64], low: f64, high: f64| {
        checks.extend(values.iter().map(|value| (key, *value, low, high)));
    };
    let tiny = f64::MIN_POSITIVE;
    let gyro = &file.gyro;
    each("gyro.pulse_weight_rad", &gyro.pulse_weight_rad, tiny, 1e-2);
    each("gyro.bias_rad_s", &gyro.bias_rad_s, -0.1, 0.1);
    each("gyro.scale_error", &gyro.scale_error, -0.1, 0.1);
    each(
        "gyro.angle_random_walk_rad_sqrt_s",
        &gyro.angle_random_walk_rad_sqrt_s,
        0.0,
        1.0,
    );
    let eps = &gyro.installation_rad;
    each(
        "gyro.installation_rad",
        &[eps.xy, eps.xz, eps.yx, eps.yz, eps.zx, eps.zy],
        -0.1,
        0.1,
    );
    let length = file.attitude_wxyz.iter().map(|q| q * q).sum::<f64>().sqrt();
    each("attitude_wxyz", &[length], 0.999, 1.001);
    if let Some(site) = &file.site {
        each("site.latitude_rad", &[site.latitude_rad], -1.571, 1.571);
        each("site.gravity_m_s2", &[site.gravity_m_s2], 0.0, 100.0);
    }
    if let Some(dither) = &file.dither {
        let half_rate_hz = 0.5 * file.rate_hz;
        each(
            "dither.frequency_hz",
            &dither.frequency_hz,
            tiny,
            half_rate_hz,
        );
        each("dither.amplitude_rad", &dither.amplitude_rad, 0.0, 0.1);
        // a spread of 0.3 already lets the amplitude come down to a tenth of its mean (3 spreads)
        each(
            "dither.amplitude_spread",
            &[dither.amplitude_spread],
            0.0,
            0.3,
        );
        each("dither.pickoff_gain", &dither.pickoff_gain, 0.1, 10.0);
        each(
            "dither.pickoff_noise_rad",
            &dither.pickoff_noise_rad,
            0.0,
            0.1,
        );
        each(
            "dither.pickoff_weight_rad",
            &[dither.pickoff_weight_rad],
            tiny,
            0.1,
        );
    }
    if let Some(reference) = &file.reference {
        each(
            "reference.angle_noise_rad",
            &[reference.angle_noise_rad],
            0.0,
            0.1,
        );
        each(
            "reference.angle_random_walk_rad_sqrt_s",
            &[reference.angle_random_walk_rad_sqrt_s],
            0.0,
            1.0,
        );
        each("reference.weight_rad", &[reference.weight_rad], tiny, 0.1);
    }
    if let Some(accelerometer) = &file.accelerometer {
        each(
            "accelerometer.bias_m_s2",
            &accelerometer.bias_m_s2,
            -1.0,
            1.0,
        );
        each(
            "accelerometer.scale_error",
            &accelerometer.scale_error,
            -0.1,
            0.1,
        );
        each(
            "accelerometer.noise_m_s2_sqrt_hz",
            &[accelerometer.noise_m_s2_sqrt_hz],
            0.0,
            1.0,
        );
        each(
            "accelerometer.weight_m_s2",
            &[accelerometer.weight_m_s2],
            tiny,
            1.0,
        );
    }
    for (key, value, low, high) in checks {
        if !(low..=high).contains(&value) {
            return Err(InputError::new(path, "is out of range")
                .channel(key)
                .value(value)
                .expected(if low == tiny {
                    format!("above 0 and at most {high}")
                } else {
                    format!("{low} to {high}")
                }));
        }
    }
    Ok(())
}
