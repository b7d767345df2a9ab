//! Lists the configurations of the proof: corners of the parameter ranges.

use std::fmt;

use trueaxis::design_parameters::{
    FLEXURE_LIMIT, INSTALLATION_LIMIT_RAD, LEVER_ARM_LIMIT_M, SCALED_FLEXURE_LIMIT,
    SWING_LIMIT_M_S, increment_unit_log2,
};
use trueaxis::{AccelerometerParameters, CrossAxis, FlexureResponse, Parameters};

/// A corner of the parameter ranges, or a point on the way to it.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    pub samples_per_output: u16,
    pub sample_rate_hz: f64,
    pub response: FlexureResponse,
    /// Dither frequency \[cycles per sample\].
    pub cycles: f64,
    pub delay_s: f64,
    pub adapts: bool,
    /// Pickoff gain \[1\].
    pub gain: f64,
    /// All signed parameters over their limits.
    pub signed: f64,
    /// Angles of a pulse and of a pickoff code \[rad\] and velocity of an accelerometer code \[m/s\].
    pub weights: (f64, f64, f64),
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "n {}, {} Hz, {:?}, {:.3} cycles, {:.0} us, {}, gain {}, {:.2} of the angles, weights {:.1e} rad {:.0e} rad {:.0e} m/s",
            self.samples_per_output,
            self.sample_rate_hz,
            self.response,
            self.cycles,
            self.delay_s * 1e6,
            if self.adapts { "adapts" } else { "frozen" },
            self.gain,
            self.signed,
            self.weights.0,
            self.weights.1,
            self.weights.2,
        )
    }
}

impl Corner {
    /// The parameters at this corner.
    pub fn parameters(&self) -> Parameters {
        let signed = self.signed;
        let angles_rad = signed * INSTALLATION_LIMIT_RAD;
        let unit = f64::from(1u8 << increment_unit_log2(self.sample_rate_hz));
        let flexure = signed * FLEXURE_LIMIT.min(SCALED_FLEXURE_LIMIT / unit);
        let mut parameters = Parameters::default().with(|p| {
            p.pulse_weight_rad = [self.weights.0; 3];
            p.bias_rad_s = [0.01; 3];
            // The reading is multiplied by 1 − s.
            p.scale_error = [-signed.abs() / 128.0; 3];
            p.installation_rad = CrossAxis::from_array([angles_rad; 6]);
            p.flexure_s2 =
                CrossAxis::from_array([flexure / (self.sample_rate_hz * self.sample_rate_hz); 6]);
            p.pickoff_gain = [self.gain; 3];
            p.pickoff_weight_rad = self.weights.1;
            p.sample_rate_hz = self.sample_rate_hz;
            p.samples_per_output = self.samples_per_output;
            p.flexure_response = self.response;
            p.pickoff_delay_s = [self.delay_s; 3];
            p.dither_frequency_hz = [self.cycles * self.sample_rate_hz; 3];
            p.dither_amplitude_rad = [if self.adapts { 0.01 } else { 0.0 }; 3];
            p.adaptation_time_s = if self.adapts { 0.1 } else { 0.0 };
            p.accelerometers = None;
        });
        let arm_m = farthest_arms_m(&parameters) / 2.0 * 0.999_999;
        parameters.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [self.weights.2; 3],
            bias_m_s2: [1.0; 3],
            scale_error: [-signed.abs() / 128.0; 3],
            misalignment_rad: CrossAxis::from_array([angles_rad; 6]),
            lever_arm_m: [
                [0.0, -arm_m, arm_m],
                [-arm_m, 0.0, -arm_m],
                [arm_m, -arm_m, 0.0],
            ],
        });
        parameters
    }

    /// The corner itself, or the last point before it that the check accepts.
    pub fn accepted(self) -> Option<Self> {
        if self.parameters().check().is_ok() {
            return Some(self);
        }
        // No delay, a quarter of a cycle, where adaptation's quadrature does least, and no angles.
        let towards = |share: f64| Self {
            cycles: 0.25 + share * (self.cycles - 0.25),
            delay_s: share * self.delay_s,
            signed: share * self.signed,
            ..self
        };
        let fits = |share| towards(share).parameters().check().is_ok();
        let (mut low, mut high) = (0.0, 1.0);
        if !fits(low) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(towards(low))
    }
}

/// Sum of the two coordinates by which an accelerometer may be off its axis \[m\].
pub fn farthest_arms_m(parameters: &Parameters) -> f64 {
    let fastest_rad_s = 2.0 * parameters.largest_increment_rad() * parameters.sample_rate_hz;
    (2.0 * LEVER_ARM_LIMIT_M).min(SWING_LIMIT_M_S / fastest_rad_s)
}

/// Finest, ordinary and coarsest pulses, pickoff codes and accelerometer codes \[rad, rad, m/s\].
pub const WEIGHTS: [(f64, f64, f64); 3] = [
    (1.0 / (1u64 << 34) as f64, 1.0 / (1u64 << 35) as f64, 1e-9),
    (1e-6, 1e-10, 1e-6),
    (1e-4, 1e-4, 1e-2),
];

/// Sample rates at both ends of every increment unit \[Hz\].
const RATES_HZ: [f64; 8] = [500.0, 999.0, 1000.0, 1999.0, 2000.0, 3999.0, 4000.0, 8000.0];

/// All lengths of the output period at the corners of the parameters that sums depend on.
pub fn corners() -> Vec<Corner> {
    let base = Corner {
        samples_per_output: 1,
        sample_rate_hz: 4000.0,
        response: FlexureResponse::Mode { damping: 0.002 },
        cycles: 0.25,
        delay_s: 0.0,
        adapts: false,
        gain: 2.0,
        signed: 1.0,
        weights: WEIGHTS[1],
    };
    let mut corners: Vec<Corner> = Vec::new();
    // Some change one stage alone, so that not every corner needs all of them.
    let mut add = |corner: Corner| {
        let turn = corners.len();
        corners.push(Corner {
            signed: [1.0, -1.0, 1.0, 0.0][turn / 7 % 4],
            response: [
                FlexureResponse::Static,
                FlexureResponse::Mode { damping: 0.002 },
                FlexureResponse::Mode { damping: 0.99 },
            ][turn / 5 % 3],
            ..corner
        });
    };
    for samples_per_output in 1..=40 {
        for sample_rate_hz in RATES_HZ {
            let base = Corner {
                samples_per_output,
                sample_rate_hz,
                ..base
            };
            for weights in WEIGHTS {
                add(Corner {
                    gain: 0.0,
                    weights,
                    ..base
                });
                for cycles in [0.04, 0.25, 0.4] {
                    for delay_s in [-1e-4, 0.0, 1e-4] {
                        add(Corner {
                            cycles,
                            delay_s,
                            weights,
                            ..base
                        });
                    }
                }
            }
            // Windows of 0.03 s cost more samples.
            for (cycles, delay_s) in [(0.04, -1e-4), (0.04, 1e-4), (0.4, 1e-4)] {
                add(Corner {
                    cycles,
                    delay_s,
                    adapts: true,
                    ..base
                });
            }
        }
    }
    corners
}
