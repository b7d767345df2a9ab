//! Parses `[[motion]]` entries into profiles.
//!
//! From one entry and the sample rate in Hz, a [`SegmentEntry`]: its length in whole rows, every frequency below half the
//! sample rate; and the largest rate of its motion, for the check against the counter.

use crate::entry::Entry;
use crate::motion::Profile;
use crate::motion::rotation_vector::ConingTone;
use crate::motion::vibration::Spectrum;
use rlg_recording::error::InputError;
use std::f64::consts::{PI, TAU};

/// One `[[motion]]`.
#[derive(Debug, Clone)]
pub struct SegmentEntry {
    /// Name in the recording.
    pub name: String,
    /// Kind in the recording.
    pub kind: String,
    /// Length in rows.
    pub rows: usize,
    /// Motion of the segment.
    pub profile: Profile,
}

/// Names of the motions.
const KINDS: &str = "still, coning, multi_coning, slew, spin, spin_synchronous, tumble, vibration or \
                     random_vibration";

/// Reads one entry.
pub fn segment(mut entry: Entry, rate_hz: f64) -> Result<SegmentEntry, InputError> {
    let kind = entry.text("kind")?;
    let duration_s = entry.positive("duration_s")?;
    let rows = (duration_s * rate_hz).round();
    if (rows - duration_s * rate_hz).abs() > 1e-6 * rows.max(1.0) {
        return Err(entry
            .error("duration_s", "is not a whole number of sample periods")
            .value(duration_s));
    }
    let limits = Limits {
        duration_s,
        rate_hz,
    };
    let (profile, suffix) = match kind.as_str() {
        "still" => (Profile::Still, String::new()),
        "coning" => limits.coning(&mut entry)?,
        "multi_coning" => limits.multi_coning(&mut entry)?,
        "slew" => {
            let (axis, letter) = entry.axis("axis")?;
            let angle_rad = entry.number("angle_rad")?;
            (Profile::Slew { axis, angle_rad }, format!("-{letter}"))
        }
        "spin" => limits.spin(&mut entry)?,
        "spin_synchronous" => limits.spin_synchronous(&mut entry)?,
        "tumble" => limits.tumble(&mut entry)?,
        "vibration" => limits.vibration(&mut entry)?,
        "random_vibration" => limits.random_vibration(&mut entry)?,
        other => {
            return Err(entry
                .error("kind", "is no motion of this simulator")
                .value(other)
                .expected(KINDS));
        }
    };
    let name = if entry.has("name") {
        entry.text("name")?
    } else {
        format!("{kind}{suffix}")
    };
    entry.finish()?;
    // kinds of the recording, used by its readers to select segments
    let kind = match kind.as_str() {
        "multi_coning" => "coning",
        "spin_synchronous" => "spin",
        "random_vibration" => "vibration",
        same => same,
    };
    Ok(SegmentEntry {
        name,
        kind: kind.to_owned(),
        rows: rows as usize,
        profile,
    })
}

/// Limits of every motion of a segment.
struct Limits {
    duration_s: f64,
    rate_hz: f64,
}

type Read = Result<(Profile, String), InputError>;

impl Limits {
    fn ramp(&self, entry: &mut Entry) -> Result<f64, InputError> {
        let ramp_s = entry.positive("ramp_s")?;
        if 2.0 * ramp_s > self.duration_s {
            return Err(entry
                .error("ramp_s", "is longer than half the segment")
                .value(ramp_s));
        }
        Ok(ramp_s)
    }

    fn below_nyquist(&self, entry: &Entry, key: &str, frequency_hz: f64) -> Result<(), InputError> {
        if frequency_hz.abs() < 0.5 * self.rate_hz {
            return Ok(());
        }
        Err(entry
            .error(key, "is not below half the sample rate")
            .value(frequency_hz)
            .expected(format!("less than {} Hz", 0.5 * self.rate_hz)))
    }

    fn coning(&self, entry: &mut Entry) -> Read {
        let (axis, letter) = entry.axis("axis")?;
        let frequency_hz = entry.number("frequency_hz")?;
        self.below_nyquist(entry, "frequency_hz", frequency_hz)?;
        let angle_rad = entry.number("angle_rad")?;
        let profile = if entry.has("across_angle_rad") {
            let tone = ConingTone {
                frequency_hz,
                angle_rad,
                across_angle_rad: entry.number("across_angle_rad")?,
                phase_rad: 0.0,
            };
            self.elliptic(entry, "angle_rad", axis, vec![tone])?
        } else {
            Profile::Coning {
                axis,
                frequency_hz,
                angle_rad,
                ramp_s: self.ramp(entry)?,
            }
        };
        Ok((profile, format!("-{letter}")))
    }

    fn multi_coning(&self, entry: &mut Entry) -> Read {
        let (axis, letter) = entry.axis("axis")?;
        let frequencies_hz = entry.list("frequency_hz")?;
        let count = frequencies_hz.len();
        let mut lists: Vec<Vec<f64>> = Vec::new();
        for (key, needed) in [
            ("angle_rad", true),
            ("across_angle_rad", false),
            ("phase_rad", false),
        ] {
            let list = if needed || entry.has(key) {
                entry.list(key)?
            } else if key == "phase_rad" {
                vec![0.0; count]
            } else {
                // circular by default
                lists[0].clone()
            };
            if list.len() != count {
                return Err(entry
                    .error(key, "is not as long as frequency_hz")
                    .value(format!("{} numbers", list.len()))
                    .expected(format!("{count}")));
            }
            lists.push(list);
        }
        let mut tones = Vec::new();
        for (tone, frequency_hz) in frequencies_hz.into_iter().enumerate() {
            self.below_nyquist(entry, "frequency_hz", frequency_hz)?;
            tones.push(ConingTone {
                frequency_hz,
                angle_rad: lists[0][tone],
                across_angle_rad: lists[1][tone],
                phase_rad: lists[2][tone],
            });
        }
        let profile = self.elliptic(entry, "angle_rad", axis, tones)?;
        Ok((profile, format!("-{letter}")))
    }

    fn elliptic(
        &self,
        entry: &mut Entry,
        key: &str,
        axis: usize,
        tones: Vec<ConingTone>,
    ) -> Result<Profile, InputError> {
        let largest: f64 = tones.iter().map(ConingTone::semi_axis_rad).sum();
        entry.check(key, largest, [0.0, PI], "rad in all")?;
        Ok(Profile::EllipticConing {
            axis,
            tones,
            ramp_s: self.ramp(entry)?,
        })
    }

    fn spin(&self, entry: &mut Entry) -> Read {
        let (axis, letter) = entry.axis("axis")?;
        let oscillating = entry.has("oscillation_axis");
        let profile = Profile::Spin {
            axis,
            rate_rad_s: entry.number("rate_rad_s")?,
            ramp_s: self.ramp(entry)?,
            oscillation_axis: if oscillating {
                entry.axis("oscillation_axis")?.0
            } else {
                axis
            },
            oscillation_frequency_hz: {
                let hz = entry.number_if("oscillation_frequency_hz", oscillating)?;
                self.below_nyquist(entry, "oscillation_frequency_hz", hz)?;
                hz
            },
            oscillation_angle_rad: entry.number_if("oscillation_angle_rad", oscillating)?,
            oscillation_phase_rad: entry.number_if("oscillation_phase_rad", oscillating)?,
        };
        Ok((profile, format!("-{letter}")))
    }

    /// Spin with an oscillation at the spin's own frequency, which separates the six K_ij.
    fn spin_synchronous(&self, entry: &mut Entry) -> Read {
        let (axis, letter) = entry.axis("axis")?;
        let rate_rad_s = entry.number("rate_rad_s")?;
        let oscillation_axis = entry.axis("oscillation_axis")?.0;
        if oscillation_axis == axis {
            return Err(entry
                .error("oscillation_axis", "is the spin's own axis")
                .expected("another axis"));
        }
        let profile = Profile::Spin {
            axis,
            rate_rad_s,
            ramp_s: self.ramp(entry)?,
            oscillation_axis,
            oscillation_frequency_hz: rate_rad_s.abs() / TAU,
            oscillation_angle_rad: entry.number("oscillation_angle_rad")?,
            oscillation_phase_rad: entry.number_or_zero("oscillation_phase_rad")?,
        };
        Ok((profile, format!("-{letter}")))
    }

    fn tumble(&self, entry: &mut Entry) -> Read {
        let frequency_hz = entry.triple("frequency_hz")?;
        for hz in frequency_hz {
            self.below_nyquist(entry, "frequency_hz", hz)?;
        }
        let profile = Profile::Tumble {
            rate_rad_s: entry.triple("rate_rad_s")?,
            frequency_hz,
            phase_rad: if entry.has("phase_rad") {
                entry.triple("phase_rad")?
            } else {
                [0.0; 3]
            },
            ramp_s: self.ramp(entry)?,
        };
        Ok((profile, String::new()))
    }

    fn vibration(&self, entry: &mut Entry) -> Read {
        let (low_hz, high_hz) = (entry.positive("low_hz")?, entry.positive("high_hz")?);
        if high_hz <= low_hz {
            return Err(entry.error("high_hz", "is not above low_hz").value(high_hz));
        }
        self.below_nyquist(entry, "high_hz", high_hz)?;
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
            ramp_s: self.ramp(entry)?,
        };
        Ok((profile, String::new()))
    }

    fn random_vibration(&self, entry: &mut Entry) -> Read {
        let profile = Profile::RandomVibration {
            angular: self.spectra(entry, "angular_psd_rad2_s2_hz")?,
            linear: self.spectra(entry, "linear_psd_m2_s4_hz")?,
            ramp_s: self.ramp(entry)?,
        };
        Ok((profile, String::new()))
    }

    /// `{ x = [[Hz, density], ...], y = ..., z = ... }`.
    fn spectra(&self, entry: &mut Entry, key: &str) -> Result<[Spectrum; 3], InputError> {
        let mut spectra = [(); 3].map(|()| Spectrum(Vec::new()));
        let Some(mut axes) = entry.inner(key)? else {
            return Ok(spectra);
        };
        for (spectrum, letter) in spectra.iter_mut().zip(["x", "y", "z"]) {
            let table = axes.pairs(letter)?;
            if table.len() == 1 {
                return Err(entry
                    .error(key, "has a table of one point")
                    .expected("at least two points: [[Hz, density], [Hz, density]]"));
            }
            for pair in table.windows(2) {
                if pair[1][0] <= pair[0][0] {
                    return Err(entry
                        .error(key, "has frequencies that do not rise")
                        .value(pair[1][0]));
                }
            }
            for [hz, density] in &table {
                if *hz <= 0.0 || *density <= 0.0 {
                    return Err(entry
                        .error(key, "is not positive")
                        .value(format!("[{hz}, {density}]"))
                        .expected("frequencies and densities above 0"));
                }
                self.below_nyquist(entry, key, *hz)?;
            }
            *spectrum = Spectrum(table);
        }
        axes.finish()?;
        Ok(spectra)
    }
}
