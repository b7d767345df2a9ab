//! Parses `[[effect]]` entries into coefficients.
//!
//! Takes one entry, its `concealed` already removed, and returns it in the form of a model; its coefficients are added to
//! [`Effects`]. A kind must be in the catalogue; a kind without a channel to act on is refused.

use super::expression::Expression;
use super::faults::{Failure, FaultEntry};
use super::{Effects, FlexureMode, Harmonic, Jump};
use crate::entry::Entry;
use nalgebra::{Matrix3, Vector3};
use rlg_model::catalogue::Kind;
use rlg_model::{EffectValue, ModelEffect};
use rlg_recording::error::InputError;
use std::collections::BTreeMap;

/// Longest delay \[s\]: four hundred rows at 4 kHz; a larger difference of two clocks is no mere delay.
const LONGEST_DELAY_S: f64 = 0.1;

/// Facts of the scenario that effects depend on.
#[derive(Debug, Clone)]
pub struct EffectContext {
    /// Start of the recording \[s\].
    pub start_s: f64,
    /// Names of the recorded channels.
    pub channels: Vec<String>,
    /// Blocks are dithered.
    pub dithered: bool,
    /// There is a reference.
    pub referenced: bool,
    /// There are accelerometers.
    pub accelerometers: bool,
    /// The blocks have a temperature.
    pub thermal: bool,
    /// There is a magnetic field.
    pub magnetic: bool,
}

const LETTERS: [&str; 3] = ["x", "y", "z"];

type Parameters = BTreeMap<String, EffectValue>;

impl Effects {
    /// Adds one entry and returns it in the form of a model.
    pub fn add(
        &mut self,
        mut entry: Entry,
        context: &EffectContext,
    ) -> Result<ModelEffect, InputError> {
        let kind = entry.text("kind")?;
        needs(&kind, &entry, context)?;
        let mut parameters = Parameters::new();
        let mut with = Reader {
            entry: &mut entry,
            parameters: &mut parameters,
        };
        match kind.as_str() {
            "gyro_bias" => self.bias_rad_s += with.xyz()?,
            "gyro_bias_step" => self.bias_steps.push(with.jump()?),
            "counter_slip" => self.slips.push(with.jump()?),
            "gyro_bias_temperature" => self.bias_temperature += with.xyz()?,
            "gyro_bias_temperature_rate" => self.bias_temperature_rate += with.xyz()?,
            "gyro_bias_magnetic" => self.bias_magnetic += with.nine()?,
            "gyro_g_bias" => self.g_bias += with.nine()?,
            "gyro_g2_bias" => self.g2_bias += with.xyz()?,
            "gyro_scale" => self.scale += with.xyz()?,
            "gyro_scale_asymmetry" => self.scale_asymmetry += with.xyz()?,
            "gyro_scale_quadratic" => self.scale_quadratic += with.xyz()?,
            "gyro_scale_cubic" => self.scale_cubic += with.xyz()?,
            "installation" => self.tilt_rad += with.six()?,
            "installation_temperature" => self.tilt_temperature += with.six()?,
            "axis_flexure" => self.flexure_s2 += with.six()?,
            "axis_flexure_cubic" => self.flexure_cubic += with.six()?,
            "axis_flexure_mode" => {
                let mode = FlexureMode {
                    flexure_s2: with.six()?,
                    frequency_hz: with.positive("frequency_hz")?,
                    damping: with.not_negative("damping")?,
                };
                self.flexure_modes.push(mode);
            }
            "axis_tilt_by_force" => self.tilt_by_force += with.six()?,
            "elastic_rate_by_force" => self.rate_by_force += with.nine()?,
            "elastic_rate_by_jerk" => self.rate_by_jerk += with.nine()?,
            // The diagonal of the elastic rate by jerk, W_ii = v_i/2.
            "gyro_bandwidth" => {
                let variance_s2 = with.not_negatives()?;
                self.rate_by_jerk += Matrix3::from_diagonal(&(0.5 * variance_s2));
            }
            "gyro_delay" => self.delay_s += with.delays()?,
            "dither_gain" => self.dither_gain += with.xyz()?,
            "dither_delay" => self.dither_delay_s += with.delays()?,
            "dither_cubic" => self.dither_cubic += with.xyz()?,
            "dither_crosstalk" => self.dither_crosstalk += with.six()?,
            "gyro_high_pass" => self.high_pass_s += with.not_negatives()?,
            "lock_in" => self.lock_in_rad_s += with.not_negatives()?,
            "angle_random_walk" => {
                let walk = with.not_negatives()?;
                self.angle_random_walk = self.angle_random_walk.zip_map(&walk, f64::hypot);
            }
            "pulse_quantisation" => self.converter_rad += with.not_negatives()?,
            "lost_samples" => self.faults.push(with.fault(Failure::Lost, context)?),
            "stuck_channel" => self.faults.push(with.fault(Failure::Stuck, context)?),
            "saturation" => self
                .faults
                .push(with.fault(Failure::Saturated(None), context)?),
            "reference_misalignment" => self.reference_misalignment_rad += with.xyz()?,
            "reference_delay" => self.reference_delay_s += with.delay("all")?,
            "reference_scale" => self.reference_scale += with.xyz()?,
            "reference_harmonic" => {
                let harmonic = Harmonic {
                    axis: with.axis()?,
                    order: with.positive("order")?,
                    cos: with.optional("cos")?,
                    sin: with.optional("sin")?,
                };
                self.harmonics.push(harmonic);
            }
            "isolator_mode" => {
                for (axis, letter) in LETTERS.into_iter().enumerate() {
                    let frequency = format!("{letter}_frequency_hz");
                    if with.entry.has(&frequency) {
                        let frequency_hz = with.positive(&frequency)?;
                        let damping = with.not_negative(&format!("{letter}_damping"))?;
                        self.isolator[axis] = Some((frequency_hz, damping));
                    }
                }
            }
            "earth_rate" => self.earth_rate_rad_s += with.xyz()?,
            "accel_bias" => self.accel_bias += with.xyz()?,
            "accel_scale" => self.accel_scale += with.xyz()?,
            "accel_misalignment" => self.accel_tilt_rad += with.six()?,
            "accel_quadratic" => self.accel_quadratic += with.xyz()?,
            "accel_delay" => self.accel_delay_s += with.delays()?,
            "size_effect" => self.lever_arm_m += with.nine()?,
            "unlisted" => {
                let expression = with.expression(context)?;
                self.expressions.push(expression);
            }
            other => {
                return Err(entry
                    .error("kind", "is no effect of the catalogue")
                    .value(other)
                    .expected(format!("a kind such as {}", Kind::nearest(other))));
            }
        }
        entry.finish()?;
        Ok(ModelEffect { kind, parameters })
    }
}

/// Checks that the scenario has the channel that the effect acts on: without it the effect would change nothing.
fn needs(kind: &str, entry: &Entry, context: &EffectContext) -> Result<(), InputError> {
    let (section, there) = if kind.starts_with("dither_") {
        ("[dither]", context.dithered)
    } else if kind.starts_with("reference_") || kind == "isolator_mode" {
        (
            "[reference], [fibre_optic] or [encoder]",
            context.referenced,
        )
    } else if kind.starts_with("accel_") || kind == "size_effect" {
        ("[accelerometer]", context.accelerometers)
    } else if kind.contains("temperature") {
        ("[thermal]", context.thermal)
    } else if kind == "gyro_bias_magnetic" {
        ("[magnetic]", context.magnetic)
    } else {
        return Ok(());
    };
    if there {
        return Ok(());
    }
    Err(entry
        .error("kind", "has nothing to act on")
        .value(kind)
        .expected(format!("a scenario with {section}")))
}

/// Reads an entry's parameters and notes them for the model.
struct Reader<'e, 'a> {
    entry: &'e mut Entry<'a>,
    parameters: &'e mut Parameters,
}

impl Reader<'_, '_> {
    fn note(&mut self, name: &str, value: f64) -> f64 {
        self.parameters
            .insert(name.to_owned(), EffectValue::Number(value));
        value
    }

    fn number(&mut self, name: &str) -> Result<f64, InputError> {
        let value = self.entry.number(name)?;
        Ok(self.note(name, value))
    }

    fn positive(&mut self, name: &str) -> Result<f64, InputError> {
        let value = self.entry.positive(name)?;
        Ok(self.note(name, value))
    }

    fn not_negative(&mut self, name: &str) -> Result<f64, InputError> {
        let value = self.number(name)?;
        if value >= 0.0 {
            return Ok(value);
        }
        Err(self
            .entry
            .error(name, "is negative")
            .value(value)
            .expected("a number of at least 0"))
    }

    fn optional(&mut self, name: &str) -> Result<f64, InputError> {
        if self.entry.has(name) {
            self.number(name)
        } else {
            Ok(0.0)
        }
    }

    fn xyz(&mut self) -> Result<Vector3<f64>, InputError> {
        let [x, y, z] = LETTERS.map(|name| self.optional(name));
        Ok(Vector3::new(x?, y?, z?))
    }

    fn not_negatives(&mut self) -> Result<Vector3<f64>, InputError> {
        let mut vector = Vector3::zeros();
        for (i, name) in LETTERS.into_iter().enumerate() {
            if self.entry.has(name) {
                vector[i] = self.not_negative(name)?;
            }
        }
        Ok(vector)
    }

    fn delay(&mut self, name: &str) -> Result<f64, InputError> {
        let delay_s = self.number(name)?;
        if delay_s.abs() <= LONGEST_DELAY_S {
            return Ok(delay_s);
        }
        Err(self
            .entry
            .error(name, "is a delay too long for this simulator")
            .value(delay_s)
            .expected(format!("at most {LONGEST_DELAY_S} s")))
    }

    fn delays(&mut self) -> Result<Vector3<f64>, InputError> {
        let mut vector = Vector3::zeros();
        for (i, name) in LETTERS.into_iter().enumerate() {
            if self.entry.has(name) {
                vector[i] = self.delay(name)?;
            }
        }
        Ok(vector)
    }

    fn six(&mut self) -> Result<Matrix3<f64>, InputError> {
        self.matrix(false)
    }

    fn nine(&mut self) -> Result<Matrix3<f64>, InputError> {
        self.matrix(true)
    }

    fn matrix(&mut self, diagonal: bool) -> Result<Matrix3<f64>, InputError> {
        let mut matrix = Matrix3::zeros();
        for (i, gyro) in LETTERS.iter().enumerate() {
            for (j, axis) in LETTERS.iter().enumerate() {
                if diagonal || i != j {
                    matrix[(i, j)] = self.optional(&format!("{gyro}{axis}"))?;
                }
            }
        }
        Ok(matrix)
    }

    fn axis(&mut self) -> Result<usize, InputError> {
        let (axis, letter) = self.entry.axis("axis")?;
        self.parameters
            .insert("axis".to_owned(), EffectValue::Text(letter));
        Ok(axis)
    }

    fn jump(&mut self) -> Result<Jump, InputError> {
        Ok(Jump {
            axis: self.axis()?,
            time_s: self.number("time_s")?,
            size: self.number("size")?,
        })
    }

    fn fault(
        &mut self,
        failure: Failure,
        context: &EffectContext,
    ) -> Result<FaultEntry, InputError> {
        let channel = self.entry.text("channel")?;
        if !context.channels.contains(&channel) {
            return Err(self
                .entry
                .error("channel", "is not recorded")
                .value(channel)
                .expected(context.channels.join(", ")));
        }
        self.parameters
            .insert("channel".to_owned(), EffectValue::Text(channel.clone()));
        let (start_s, end_s) = (self.number("start_s")?, self.number("end_s")?);
        if end_s <= start_s {
            return Err(self
                .entry
                .error("end_s", "is not after start_s")
                .value(end_s));
        }
        let failure = match failure {
            Failure::Saturated(_) if self.entry.has("level") => {
                Failure::Saturated(Some(self.entry.positive("level")?))
            }
            Failure::Saturated(_) if start_s <= context.start_s => {
                return Err(self
                    .entry
                    .error("level", "is missing")
                    .expected("a limit in the channel's unit: no reading before tells one"));
            }
            other => other,
        };
        Ok(FaultEntry {
            channel,
            start_s,
            end_s,
            failure,
        })
    }

    fn expression(&mut self, context: &EffectContext) -> Result<Expression, InputError> {
        let axis = self.axis()?;
        let coefficient = self.number("coefficient")?;
        let text = self.entry.text("expression")?;
        let parsed = Expression::parse(axis, coefficient, &text, context.start_s);
        self.parameters
            .insert("expression".to_owned(), EffectValue::Text(text));
        parsed.map_err(|factor| {
            self.entry
                .error("expression", "has a factor that is not known")
                .value(factor)
                .expected("a product such as omega_x*force_z")
        })
    }
}
