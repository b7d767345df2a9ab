//! Reading of a scenario file: sections and effects, checked against each other and against the recorded tables.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use rlg_model::{EffectValue, ModelEffect};
use rlg_recording::error::InputError;

use super::attitude::{Attitude, Ground};
use super::dither::AMPLITUDE_LIMIT_SPREADS;
use super::effects::{EffectContext, Effects};
use super::entry::Entry;
use super::layout;
use super::scenario::source::{SECTIONS, Source, instrument_of, text_of};
use super::scenario::{
    AccelerometerEntry, DitherEntry, EncoderEntry, FibreOpticEntry, GyroEntry, GyroOutput,
    ReferenceEntry, Scenario, SiteEntry, environment, health, segment,
};
use super::unit_faults::UnitFaults;

/// Largest number of rows of a recording: two days at 4 kHz.
const MOST_ROWS: usize = 700_000_000;

impl Scenario {
    /// Reads and checks a scenario file and its instrument.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::parse(&text_of(path)?, path)
    }

    /// Parses a scenario; `path` is for messages, and for the folder of the instrument's file.
    pub fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let own = Source::parse(text, path)?;
        let instrument = instrument_of(&own)?;
        let sources: Vec<&Source> = std::iter::once(&own).chain(&instrument).collect();
        let rate_hz = top(
            &own,
            "rate_hz",
            own.file.rate_hz.as_ref().map(|rate| *rate.get_ref()),
        )?;
        range(&own, "rate_hz", rate_hz, [1.0, 1e5])?;
        let start_s = own.file.start_s.unwrap_or(0.0);
        range(&own, "start_s", start_s, [-1e9, 1e9])?;
        let attitude_wxyz = own.file.attitude_wxyz.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let length = attitude_wxyz.iter().map(|q| q * q).sum::<f64>().sqrt();
        range(&own, "attitude_wxyz", length, [0.999, 1.001])?;
        let site = own.file.site.as_ref().map(|table| site(own.entry(table)));

        let section = |name: &str| {
            let (_, find) = SECTIONS.iter().find(|(known, _)| *known == name)?;
            sources
                .iter()
                .find_map(|source| Some(source.entry(find(&source.file)?)))
        };
        let gyro = section("gyro").ok_or_else(|| own.error("gyro", "is missing"))?;
        let gyro_entry = gyro.clone();
        let mut scenario = Self {
            name: top(&own, "name", own.file.name.clone())?,
            rate_hz,
            start_s,
            site: site.transpose()?,
            attitude_wxyz,
            gyro: GyroEntry::read(gyro)?,
            dither: section("dither")
                .map(|entry| DitherEntry::read(entry, rate_hz))
                .transpose()?,
            reference: section("reference").map(ReferenceEntry::read).transpose()?,
            fibre_optic: section("fibre_optic")
                .map(FibreOpticEntry::read)
                .transpose()?,
            encoder: section("encoder").map(EncoderEntry::read).transpose()?,
            accelerometer: section("accelerometer")
                .map(AccelerometerEntry::read)
                .transpose()?,
            thermal: section("thermal")
                .map(|entry| environment::thermal(entry, rate_hz))
                .transpose()?,
            magnetic: section("magnetic")
                .map(|entry| environment::magnetic(entry, rate_hz))
                .transpose()?,
            slow_channels: section("slow_channels")
                .map(|entry| health::slow_channels(entry, rate_hz))
                .transpose()?,
            unit_faults: UnitFaults::default(),
            segments: Vec::new(),
            known_effects: Vec::new(),
            concealed_effects: Vec::new(),
            effects: Effects::default(),
            mounts: section("isolator").map(environment::isolator).transpose()?,
        };
        if scenario.dither.is_some() && scenario.gyro.output == GyroOutput::Increment {
            return Err(gyro_entry
                .error("output", "has no room for a dither")
                .value("increment")
                .expected("\"count\", or no [dither]"));
        }
        scenario.read_motion(&own)?;
        scenario.read_unit_faults(&own)?;
        let peak_dither_rad = scenario.check_dither(section("dither"))?;
        scenario.check_motion(&own, peak_dither_rad)?;
        scenario.read_effects(&sources, section("isolator"))?;
        Ok(scenario)
    }

    /// Largest dither angle of a row of each gyro \[rad\]; an error if beyond the counter.
    fn check_dither(&self, entry: Option<Entry>) -> Result<[f64; 3], InputError> {
        let Some((dither, entry)) = self.dither.as_ref().zip(entry) else {
            return Ok([0.0; 3]);
        };
        let mut peaks_rad = [0.0; 3];
        for (axis, peak) in peaks_rad.iter_mut().enumerate() {
            let swing = 2.0 * (PI * dither.frequency_hz[axis] / self.rate_hz).sin();
            let largest = 1.0 + AMPLITUDE_LIMIT_SPREADS * dither.amplitude_spread;
            let amplitude_rad =
                dither.amplitude_rad[axis] * self.unit_faults.largest_dither_factor(axis);
            let peak_rad = swing * largest * amplitude_rad * dither.pickoff_gain[axis];
            let capacity_rad = self.gyro.counter_capacity_rad(axis);
            if peak_rad > capacity_rad {
                let weight_rad = self.gyro.pulse_weight_rad[axis];
                return Err(entry
                    .error("amplitude_rad", "is beyond the counter")
                    .value(format!("{:.0} pulses a row", peak_rad / weight_rad))
                    .expected(format!(
                        "at most {:.0}, what gyro.counter_bits can count",
                        capacity_rad / weight_rad
                    )));
            }
            *peak = peak_rad;
        }
        Ok(peaks_rad)
    }

    fn read_motion(&mut self, own: &Source) -> Result<(), InputError> {
        for table in &own.file.motion {
            let segment = segment::segment(own.entry(table), self.rate_hz)?;
            self.segments.push(segment);
        }
        let rows = self.rows();
        if rows == 0 || rows > MOST_ROWS {
            return Err(own
                .error("motion", "gives no usable length")
                .value(format!("{rows} rows"))
                .expected(format!("1 to {MOST_ROWS} rows")));
        }
        Ok(())
    }

    /// Refuses a motion beyond the counters, of which the dither takes a part.
    fn check_motion(&self, own: &Source, peak_dither_rad: [f64; 3]) -> Result<(), InputError> {
        for (segment, table) in self.segments.iter().zip(&own.file.motion) {
            let at = own.entry(table);
            let duration_s = segment.rows as f64 / self.rate_hz;
            let peak_rad = segment.profile.peak_rate_rad_s(duration_s) / self.rate_hz;
            for (axis, dither_rad) in peak_dither_rad.into_iter().enumerate() {
                let capacity_rad = self.gyro.counter_capacity_rad(axis);
                if peak_rad + dither_rad > capacity_rad {
                    return Err(at
                        .error("kind", "is a motion beyond the counter")
                        .value(format!("{} rad/s", peak_rad * self.rate_hz))
                        .expected(format!(
                            "at most {} rad/s beside the dither, what gyro.counter_bits can count",
                            (capacity_rad - dither_rad) * self.rate_hz
                        )));
                }
            }
        }
        Ok(())
    }

    fn read_unit_faults(&mut self, own: &Source) -> Result<(), InputError> {
        let length_s = self.rows() as f64 / self.rate_hz;
        let mut sections = vec!["gyro"];
        sections.extend(self.dither.as_ref().map(|_| "dither"));
        sections.extend(self.thermal.map(|_| "thermal"));
        sections.extend(self.slow_channels.map(|_| "slow_channels"));
        let setting = health::Setting {
            span_s: [self.start_s, self.start_s + length_s],
            sections: &sections,
            has_pulse: self
                .slow_channels
                .is_some_and(|known| known.pulse.is_some()),
        };
        for table in &own.file.fault {
            let fault = health::fault(own.entry(table), &setting)?;
            self.unit_faults.0.push(fault);
        }
        Ok(())
    }

    fn read_effects(
        &mut self,
        sources: &[&Source],
        isolator: Option<Entry>,
    ) -> Result<(), InputError> {
        let context = EffectContext {
            start_s: self.start_s,
            channels: layout::fault_channels(self),
            dithered: self.dither.is_some(),
            referenced: layout::references(self).next().is_some(),
            accelerometers: self.accelerometer.is_some(),
            thermal: self.thermal.is_some(),
            magnetic: self.magnetic.is_some(),
        };
        for source in sources {
            for table in &source.file.effect {
                let mut entry = source.entry(table);
                let concealed = entry.flag("concealed", true)?;
                let effect = self.effects.add(entry, &context)?;
                if concealed {
                    self.concealed_effects.push(effect);
                } else {
                    self.known_effects.push(effect);
                }
            }
        }
        if let Some(entry) = isolator.filter(|_| self.effects.isolator().is_some()) {
            return Err(entry
                .error("isolator", "stands beside the effect isolator_mode")
                .expected("one of them"));
        }
        self.admit_what_sections_imply();
        Ok(())
    }

    /// Adds the known effects that follow from the sections.
    fn admit_what_sections_imply(&mut self) {
        let number = |(name, value): (&str, f64)| (name.to_owned(), EffectValue::Number(value));
        if let Some(thermal) = &self.thermal {
            self.effects.set_scale_temperature(thermal.scale_error_k);
            for (axis, coefficient) in ["x", "y", "z"].into_iter().zip(thermal.scale_error_k) {
                if coefficient == 0.0 {
                    continue;
                }
                let expression = format!("temperature_{axis}*omega_{axis}");
                self.concealed_effects.push(ModelEffect {
                    kind: "unlisted".to_owned(),
                    parameters: BTreeMap::from([
                        ("axis".to_owned(), EffectValue::Text(axis.to_owned())),
                        number(("coefficient", coefficient)),
                        ("expression".to_owned(), EffectValue::Text(expression)),
                    ]),
                });
            }
        }
        // an encoder does not measure the Earth's rotation, so the model must contain it
        let blind = layout::references(self).next() == Some(layout::ReferenceKind::Encoder);
        if let Some(site) = self.site.filter(|site| site.earth_rate && blind) {
            let ground = Ground::at(site.latitude_rad, site.gravity_m_s2, true);
            let start = Attitude::new(self.attitude_wxyz).navigation_from_body;
            let rate = start.inverse() * ground.earth_rate_rad_s;
            self.known_effects.push(ModelEffect {
                kind: "earth_rate".to_owned(),
                parameters: [("x", rate.x), ("y", rate.y), ("z", rate.z)]
                    .map(number)
                    .into(),
            });
        }
    }
}

fn top<T>(own: &Source, key: &str, value: Option<T>) -> Result<T, InputError> {
    value.ok_or_else(|| own.error(key, "is missing"))
}

fn range(own: &Source, key: &str, value: f64, [low, high]: [f64; 2]) -> Result<(), InputError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(own
        .error(key, "is out of range")
        .value(value)
        .expected(format!("{low} to {high}")))
}

fn site(mut entry: Entry) -> Result<SiteEntry, InputError> {
    let site = SiteEntry {
        latitude_rad: entry.within("latitude_rad", [-1.571, 1.571], "rad")?,
        gravity_m_s2: entry.within("gravity_m_s2", [0.0, 100.0], "m/s^2")?,
        earth_rate: entry.flag("earth_rate", true)?,
    };
    entry.finish()?;
    Ok(site)
}
