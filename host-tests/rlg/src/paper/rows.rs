//! Compares Tables 4 and 5 with ours, row by row, and identifies the limit of the residual error.
//!
//! [`Vibration`]s become [`Compared`] rows, in ° and m/s as printed.

use serde::Serialize;
use serde_json::{Value, json};

use super::lengths::Lengths;
use super::printed::{Row, TABLE_4, TABLE_5};
use super::sins::Sins;
use super::unit::{ANGLE_RANDOM_WALK_RAD_SQRT_S, GRAVITY_M_S2, RESIDUAL_BIAS_RAD_S, REST_S};
use super::vibration::Vibration;

/// Standard deviations within which a residual error is attributed to noise.
const STANDARD_DEVIATIONS: f64 = 3.0;

/// Limit of the residual error after compensation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// Angle random walk of the gyros and the residual bias of their calibration.
    RandomWalkAndBias,
    /// Unknown; the residual error exceeds that.
    Unknown,
}

impl Limit {
    /// Returns the limit as part of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::RandomWalkAndBias => {
                "what the gyros' angle random walk and residual bias make without any flexure"
            }
            Self::Unknown => "more than the gyros' noise explains",
        }
    }
}

/// One row, ours and the paper's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// "pitch", "east".
    pub name: &'static str,
    /// Direction of the vibration.
    pub along: &'static str,
    /// ° or m/s.
    pub unit: &'static str,
    /// A system of the paper's class, Eq. (7) alone.
    pub before: f64,
    /// With the dynamic terms.
    pub after: f64,
    /// Reduction by compensation \[%\].
    pub reduction_percent: f64,
    /// Reduction that the paper prints \[%\].
    pub paper_reduction_percent: f64,
    /// Reduction if flexure is the only unmodelled effect \[%\].
    pub alone_percent: f64,
    /// Residual share with Eq. (6) as printed \[%\].
    pub left_by_literal_signs_percent: f64,
    /// Standard deviation of such a row due to the gyros' random walk and residual bias alone.
    pub noise: f64,
    /// Limit of the residual error.
    pub limited_by: Limit,
    #[serde(skip)]
    printed: Row,
}

impl Compared {
    /// Computes the rows of Table 4 and Table 5.
    pub fn tables(vibrations: &[Vibration; 2], lengths: &Lengths) -> [Vec<Self>; 2] {
        let moving_s = lengths.vibration_s;
        let whole_s = moving_s + 0.5 * REST_S;
        let noise_deg = (ANGLE_RANDOM_WALK_RAD_SQRT_S * whole_s.sqrt())
            .hypot(RESIDUAL_BIAS_RAD_S * whole_s)
            .to_degrees();
        // a random walk of tilt, integrated twice: g N √(T³/3), and g b T²/2
        let noise_m_s = GRAVITY_M_S2
            * (ANGLE_RANDOM_WALK_RAD_SQRT_S * (moving_s.powi(3) / 3.0).sqrt())
                .hypot(RESIDUAL_BIAS_RAD_S * moving_s.powi(2) / 2.0);
        let rows = |printed: &[&[Row]; 2], unit, noise, of: &dyn Fn(&Sins, usize) -> f64| {
            let mut rows = Vec::new();
            for (index, vibration) in vibrations.iter().enumerate() {
                for (place, printed) in printed[index].iter().enumerate() {
                    let left = |after: &Sins, before: &Sins| {
                        100.0 * (of(after, place) / of(before, place)).abs()
                    };
                    let after = of(&vibration.after, place);
                    let [alone_before, alone_after, _] = &vibration.alone;
                    rows.push(Self {
                        name: printed.name,
                        along: ["x", "y"][index],
                        unit,
                        before: of(&vibration.before, place),
                        after,
                        reduction_percent: 100.0 - left(&vibration.after, &vibration.before),
                        paper_reduction_percent: printed.reduction_percent,
                        alone_percent: 100.0 - left(alone_after, alone_before),
                        left_by_literal_signs_percent: left(&vibration.literal, &vibration.before),
                        noise,
                        limited_by: if after.abs() <= STANDARD_DEVIATIONS * noise {
                            Limit::RandomWalkAndBias
                        } else {
                            Limit::Unknown
                        },
                        printed: *printed,
                    });
                }
            }
            rows
        };
        [
            rows(
                &[&TABLE_4[0], &TABLE_4[1]],
                "°",
                noise_deg,
                &|sins, axis| sins.after_deg[axis],
            ),
            rows(
                &[&TABLE_5[0], &TABLE_5[1]],
                "m/s",
                noise_m_s,
                &|sins, axis| sins.largest_m_s[axis],
            ),
        ]
    }

    /// Returns the paper's row.
    pub fn printed(&self) -> Value {
        json!({
            "name": self.name,
            "along": self.along,
            "before": self.printed.before,
            "after": self.printed.after,
            "reduction_percent": self.printed.reduction_percent,
        })
    }

    /// Returns before and after as printed in the paper.
    pub fn printed_pair(&self) -> [f64; 2] {
        [self.printed.before, self.printed.after]
    }
}
