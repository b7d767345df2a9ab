//! Physics outside the catalogue (`unlisted`): a coefficient times a product of measured inputs of the case.
//!
//! A text such as `omega_x*force_z` is evaluated at a quadrature node. The names are those of `diagnosis.json`:
//! `omega_x` \[rad/s\], `alpha_x` \[rad/s²\], `force_x` \[m/s²\] (with `abs_` before them, their magnitude),
//! `temperature_x` \[K since the start\], `temperature_rate_x` \[K/s\], `field_x` \[T\], `dither_angle_x` \[rad\],
//! `dither_rate_x` \[rad/s\], `time` \[s since the start\], `window(a,b)` (1 from a to b s), `sine(f)`, `cosine(f)`
//! \[Hz\], `decay(s)` (exp(−t/s)).

use super::Exposure;
use std::f64::consts::TAU;

/// Factor of a product.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Factor {
    Rate(usize),
    AbsoluteRate(usize),
    Acceleration(usize),
    AbsoluteAcceleration(usize),
    Force(usize),
    AbsoluteForce(usize),
    Warming(usize),
    WarmingRate(usize),
    Field(usize),
    BlockAngle(usize),
    BlockRate(usize),
    Time,
    Window(f64, f64),
    Sine(f64),
    Cosine(f64),
    Decay(f64),
}

/// Product of factors, added to one gyro's rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Index of the gyro.
    pub axis: usize,
    /// Coefficient \[rad/s per unit of the product\].
    pub coefficient: f64,
    factors: Vec<Factor>,
}

impl Expression {
    /// Parses the product; the error is the unknown factor.
    pub fn parse(axis: usize, coefficient: f64, text: &str, start_s: f64) -> Result<Self, String> {
        let factors = text
            .split('*')
            .map(str::trim)
            .map(|name| factor(name, start_s).ok_or_else(|| name.to_owned()))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            axis,
            coefficient,
            factors,
        })
    }

    /// Rate added by the expression \[rad/s\].
    pub fn rate_rad_s(&self, exposure: &Exposure) -> f64 {
        let t = exposure.since_start_s;
        self.factors
            .iter()
            .map(|factor| match *factor {
                Factor::Rate(i) => exposure.motion.rate_rad_s[i],
                Factor::AbsoluteRate(i) => exposure.motion.rate_rad_s[i].abs(),
                Factor::Acceleration(i) => exposure.motion.acceleration_rad_s2[i],
                Factor::AbsoluteAcceleration(i) => exposure.motion.acceleration_rad_s2[i].abs(),
                Factor::Force(i) => exposure.force_m_s2[i],
                Factor::AbsoluteForce(i) => exposure.force_m_s2[i].abs(),
                Factor::Warming(i) => exposure.warming_k[i],
                Factor::WarmingRate(i) => exposure.warming_rate_k_s[i],
                Factor::Field(i) => exposure.field_t[i],
                Factor::BlockAngle(i) => exposure.block_rad[i][0],
                Factor::BlockRate(i) => exposure.block_rad[i][1],
                Factor::Time => t,
                Factor::Window(from, to) => f64::from(u8::from(from <= t && t < to)),
                Factor::Sine(hz) => (TAU * hz * t).sin(),
                Factor::Cosine(hz) => (TAU * hz * t).cos(),
                Factor::Decay(constant_s) => (-t / constant_s).exp(),
            })
            .fold(self.coefficient, |product, value| product * value)
    }
}

fn factor(name: &str, start_s: f64) -> Option<Factor> {
    if name == "time" {
        return Some(Factor::Time);
    }
    if let Some((function, rest)) = name.split_once('(') {
        let inside = rest.strip_suffix(')')?;
        let number = |text: &str| -> Option<f64> {
            text.trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
        };
        return match function {
            "window" => {
                let (from, to) = inside.split_once(',')?;
                Some(Factor::Window(
                    number(from)? - start_s,
                    number(to)? - start_s,
                ))
            }
            "sine" => number(inside).map(Factor::Sine),
            "cosine" => number(inside).map(Factor::Cosine),
            "decay" => number(inside)
                .filter(|constant_s| *constant_s > 0.0)
                .map(Factor::Decay),
            _ => None,
        };
    }
    let (stem, letter) = name.rsplit_once('_')?;
    let axis = ["x", "y", "z"].iter().position(|known| *known == letter)?;
    Some(match stem {
        "omega" => Factor::Rate(axis),
        "abs_omega" => Factor::AbsoluteRate(axis),
        "alpha" => Factor::Acceleration(axis),
        "abs_alpha" => Factor::AbsoluteAcceleration(axis),
        "force" => Factor::Force(axis),
        "abs_force" => Factor::AbsoluteForce(axis),
        "temperature" => Factor::Warming(axis),
        "temperature_rate" => Factor::WarmingRate(axis),
        "field" => Factor::Field(axis),
        "dither_angle" => Factor::BlockAngle(axis),
        "dither_rate" => Factor::BlockRate(axis),
        _ => return None,
    })
}
