//! Terms found in the data rather than in the list of linear physics: steps of bias, slips of a counter,
//! and unlisted physics written as a product of measured channels.
//!
//! Enters: a term and the scene. Leaves: its column \[rad per unit of its size\], one a row, on one gyro, and
//! its form in a model file, so that the next run of the tool predicts it.

use std::collections::BTreeMap;
use std::ops::Range;

use super::hypotheses::reference_harmonic;
use super::scene::Scene;
use super::signals;
use super::streams::{AXES, Streams, Triad, add};
use rlg_model::{EffectValue, ModelEffect};

/// What kind of term.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// `gyro_bias_step`: + size \[rad/s\] from a time on.
    Step {
        /// When \[s\].
        time_s: f64,
    },
    /// `counter_slip`: one jump in angle \[rad\].
    Slip {
        /// When \[s\].
        time_s: f64,
    },
    /// `reference_harmonic`: half of an encoder's error \[rad\] at a harmonic of the table angle.
    Harmonic {
        /// Periods a turn.
        order: u32,
        /// The cosine, or the sine.
        cosine: bool,
    },
    /// `unlisted`: coefficient × a product of channels, as a rate.
    Product {
        /// The product, as [`signals::evaluate`] reads it.
        expression: String,
    },
}

/// The contract's kinds of what happens once.
pub(super) const STEP: &str = "gyro_bias_step";
pub(super) const SLIP: &str = "counter_slip";

/// A term on one gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Which gyro.
    pub axis: usize,
    /// What it is.
    pub form: Form,
}

impl Term {
    /// Whether it is a counter's slip.
    pub fn is_slip(&self) -> bool {
        matches!(self.form, Form::Slip { .. })
    }

    /// The contract's kind.
    pub fn kind(&self) -> &'static str {
        match self.form {
            Form::Step { .. } => STEP,
            Form::Slip { .. } => SLIP,
            Form::Harmonic { .. } => reference_harmonic::KIND,
            Form::Product { .. } => "unlisted",
        }
    }

    /// Its equation.
    pub fn equation(&self) -> String {
        let axis = AXES[self.axis];
        match &self.form {
            Form::Step { time_s } => format!("omega_{axis} += size from t = {time_s:.3} s on"),
            Form::Slip { time_s } => {
                format!("angle of gyro {axis} jumps by size at t = {time_s:.4} s")
            }
            Form::Harmonic { order, .. } => {
                format!("reference angle {axis} += cos cos({order} theta) + sin sin({order} theta)")
            }
            Form::Product { expression } => format!("omega_{axis} += coefficient * {expression}"),
        }
    }

    /// Name and unit of its size.
    pub fn size(&self) -> (&'static str, &'static str) {
        match self.form {
            Form::Step { .. } => ("size", "rad/s"),
            Form::Slip { .. } => ("size", "rad"),
            Form::Harmonic { cosine: true, .. } => ("cos", "rad"),
            Form::Harmonic { cosine: false, .. } => ("sin", "rad"),
            Form::Product { .. } => ("coefficient", "rad/s per unit of the expression"),
        }
    }

    /// Its column on its gyro.
    pub fn column(&self, scene: &Scene) -> Result<Vec<f64>, String> {
        let rows = scene.streams.rows;
        match &self.form {
            Form::Step { time_s } => {
                let first = scene.streams.row_at(*time_s);
                // The next recording starts with a bias of its own.
                let after = first..scene.streams.end_of_recording(first);
                Ok(scene.sensed_from_rate(
                    self.axis,
                    (0..rows).map(|row| f64::from(u8::from(after.contains(&row)))),
                ))
            }
            Form::Slip { time_s } => {
                let mut column = vec![0.0; rows];
                let row = ((time_s - scene.streams.start_s) * scene.streams.rate_hz)
                    .floor()
                    .max(0.0);
                if let Some(slot) = column.get_mut(row as usize) {
                    *slot = 1.0;
                }
                Ok(column)
            }
            Form::Harmonic { order, cosine } => Ok(reference_harmonic::column(
                scene, self.axis, *order, *cosine,
            )),
            Form::Product { expression } => {
                let values = signals::evaluate(scene, expression)?;
                Ok(scene.sensed_from_rate(self.axis, values.into_iter()))
            }
        }
    }

    /// The term in a model file.
    pub fn to_effect(&self, size: f64, streams: &Streams) -> ModelEffect {
        let mut parameters = BTreeMap::new();
        parameters.insert(
            "axis".to_string(),
            EffectValue::Text(AXES[self.axis].to_string()),
        );
        parameters.insert(self.size().0.to_string(), EffectValue::Number(size));
        match &self.form {
            Form::Step { time_s } | Form::Slip { time_s } => {
                let (recording, own_s) = streams.own_time(*time_s);
                parameters.insert("time_s".to_string(), EffectValue::Number(own_s));
                if streams.is_joined() {
                    let name = EffectValue::Text(recording.to_string());
                    parameters.insert("recording".to_string(), name);
                }
            }
            Form::Harmonic { order, .. } => {
                parameters.insert("order".to_string(), EffectValue::Number(f64::from(*order)));
            }
            Form::Product { expression } => {
                parameters.insert(
                    "expression".to_string(),
                    EffectValue::Text(expression.clone()),
                );
            }
        }
        ModelEffect {
            kind: self.kind().to_string(),
            parameters,
        }
    }
}

/// Places of the terms that stand and fall with the one at `place`: the halves of a harmonic or of a line are one wave, and
/// behind one another.
pub fn together(terms: &[Term], place: usize) -> Range<usize> {
    let is_other_half = |other: usize| {
        let (one, other) = (&terms[place], &terms[other]);
        let is_half = match (&one.form, &other.form) {
            (Form::Harmonic { order, .. }, Form::Harmonic { order: same, .. }) => order == same,
            (Form::Product { expression }, Form::Product { expression: same }) => {
                tone(expression).is_some() && tone(expression) == tone(same)
            }
            _ => false,
        };
        is_half && one.axis == other.axis
    };
    let first = (0..place).find(|&other| is_other_half(other));
    let last = (place + 1..terms.len()).find(|&other| is_other_half(other));
    first.unwrap_or(place)..last.unwrap_or(place) + 1
}

/// A line's frequency as its sine and its cosine write it.
fn tone(expression: &str) -> Option<&str> {
    let sine = expression.strip_prefix("co").unwrap_or(expression);
    sine.strip_prefix("sine(")
}

/// What an empirical effect of a model adds \[rad\]; `None` where the effect is of another kind.
pub fn prediction(scene: &Scene, effect: &ModelEffect) -> Option<Result<Triad, String>> {
    let text = |name: &str| match effect.parameters.get(name) {
        Some(EffectValue::Text(text)) => Ok(text.clone()),
        _ => Err(format!("`{name}` is missing")),
    };
    let number = |name: &str| match effect.parameters.get(name) {
        Some(EffectValue::Number(value)) => Ok(*value),
        _ => Err(format!("`{name}` is missing")),
    };
    let build = || -> Result<Triad, String> {
        let axis_name = text("axis")?;
        let axis = AXES
            .iter()
            .position(|axis| *axis == axis_name)
            .ok_or_else(|| format!("axis `{axis_name}` is not x, y or z"))?;
        // Where no recording is named, the event is in each that was running at that time.
        let recording = text("recording").ok();
        let recording = recording.as_deref();
        let streams = &scene.streams;
        let forms: Vec<(Form, f64)> = match effect.kind.as_str() {
            "gyro_bias_step" => {
                let size = number("size")?;
                let times = streams.joined_times_from(recording, number("time_s")?);
                let steps = times.into_iter().map(|time_s| Form::Step { time_s });
                steps.map(|form| (form, size)).collect()
            }
            "counter_slip" => {
                let size = number("size")?;
                let times = streams.joined_times(recording, number("time_s")?);
                let slips = times.into_iter().map(|time_s| Form::Slip { time_s });
                slips.map(|form| (form, size)).collect()
            }
            reference_harmonic::KIND => {
                let order = number("order")?;
                if order.fract() != 0.0 || !(1.0..=f64::from(u32::MAX)).contains(&order) {
                    return Err(format!(
                        "order {order} is not a whole number of periods a turn"
                    ));
                }
                let halves = [("cos", true), ("sin", false)].map(|(name, cosine)| {
                    let order = order as u32;
                    // An absent half counts as zero (contract).
                    (
                        Form::Harmonic { order, cosine },
                        number(name).unwrap_or(0.0),
                    )
                });
                halves.to_vec()
            }
            _ => {
                let expression = text("expression")?;
                vec![(Form::Product { expression }, number("coefficient")?)]
            }
        };
        let mut part: Triad = [0, 1, 2].map(|_| vec![0.0; scene.streams.rows]);
        for (form, size) in forms {
            let column = Term { axis, form }.column(scene)?;
            add(&mut part[axis], &column, size);
        }
        Ok(part)
    };
    matches!(
        effect.kind.as_str(),
        "gyro_bias_step" | "counter_slip" | "unlisted" | reference_harmonic::KIND
    )
    .then(build)
}
