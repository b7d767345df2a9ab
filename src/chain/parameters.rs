//! Holds the parameters as a calibration engineer writes them: f64, SI units.
//!
//! Nothing here runs per sample: [`Chain::new`](crate::Chain::new) checks them and turns them into the
//! number system's coefficients once, at boot.

use crate::chain::design_parameters as design;
use crate::chain::dither_phase::DitherPhase;
use crate::chain::health_limits::HealthLimits;
use crate::chain::identity::Identity;
use crate::chain::output_format::OutputFormat;
pub use crate::chain::parameter_error::ParameterError;
use crate::chain::terms::records::TermRecords;
use crate::chain::triad::CrossAxis;

/// Response of a block's tilt to the angular acceleration of the case.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlexureResponse {
    /// At once, whatever the frequency.
    Static,
    /// As a mode at Ω₀ = 1/√K_ij, which K = J/k implies, for each pair.
    Mode {
        /// ζ \[1\], 0.002 to 0.99.
        damping: f64,
    },
}

impl FlexureResponse {
    /// ζ \[1\]; `None` of a static response.
    pub const fn damping(self) -> Option<f64> {
        match self {
            Self::Static => None,
            Self::Mode { damping } => Some(damping),
        }
    }
}

impl Default for FlexureResponse {
    fn default() -> Self {
        Self::Mode {
            damping: design::FLEXURE_DAMPING,
        }
    }
}

/// Parameters of the gyro triad. Axes x, y, z of the body frame.
///
/// ```
/// # use trueaxis::Parameters;
/// let parameters = Parameters::default().with(|p| p.bias_rad_s = [1e-6, 0.0, -2e-6]);
/// assert_eq!(parameters.check(), Ok(()));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Parameters {
    /// Angle of one pulse \[rad\]: 2⁻³⁴ (5.8e-11, resampled recordings) to 1e-4.
    pub pulse_weight_rad: [f64; 3],
    /// Bias b_i \[rad/s\], within ±0.01.
    pub bias_rad_s: [f64; 3],
    /// Scale error s_i of Eq. (7) \[1\], within ±1/128.
    pub scale_error: [f64; 3],
    /// ε_ij0 of Eq. (7) \[rad\], within ±1/128: ε_xy multiplies the **z** rate in gyro x, and so on.
    pub installation_rad: CrossAxis<f64>,
    /// K_ij \[s²\]: the tilt is δ_ij = −K_ij α_j; |K_ij|·rate² within 8 (5e-7 s² at 4 kHz),
    /// below 1 kHz within 4.
    pub flexure_s2: CrossAxis<f64>,
    /// Response of the blocks of `flexure_s2` to the acceleration.
    pub flexure_response: FlexureResponse,
    /// Block angle over pickoff angle \[1\], 0 to 2; 0 for gyros without dither.
    pub pickoff_gain: [f64; 3],
    /// Angle of one pickoff code \[rad\], 2⁻³⁵ (2.9e-11) to 1e-4.
    pub pickoff_weight_rad: f64,
    /// 1/T \[Hz\], 500 to 8000.
    pub sample_rate_hz: f64,
    /// Samples in one output period \[samples\], 1 to 40, and no more than the sums of a period can hold at the limit
    /// of its readings: some 12 ms, 6 at 500 Hz, 24 at 2 kHz.
    pub samples_per_output: u16,
    /// The pickoff shows the block this much late \[s\], within ±1e-4 (`dither_delay` of the contract).
    pub pickoff_delay_s: [f64; 3],
    /// Nominal dither frequency \[Hz\], 1 to 4000; 0.04 to 0.4 of the sample rate where it is used: with a
    /// delay, an amplitude or an adaptation time.
    pub dither_frequency_hz: [f64; 3],
    /// Nominal dither amplitude, as the pickoff shows it \[rad\], 0 to 0.01; 0: not dithered, neither watched
    /// nor tracked.
    pub dither_amplitude_rad: [f64; 3],
    /// Time in which the strip follows a change of pickoff gain or delay \[s\], 0.1 to 1000; 0: frozen. 20 is the
    /// choice of `stages/adaptation.rs`.
    pub adaptation_time_s: f64,
    /// The accelerometers, where there are any.
    pub accelerometers: Option<AccelerometerParameters>,
    /// Limits of the unit's health, where there are any.
    pub limits: Option<HealthLimits>,
    /// Unit and calibration, where they are known.
    pub identity: Option<Identity>,
    /// Form of the output.
    pub output: OutputFormat,
    /// Numbers of optional terms, which [`Chain::with_terms`](crate::Chain::with_terms) checks.
    pub terms: TermRecords,
}

/// Parameters of the accelerometers. Axes x, y, z of the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AccelerometerParameters {
    /// Velocity of one code \[m/s\]: of a pulse; or, of a converter, one code's force times the period;
    /// 1e-9 to 1e-2.
    pub weight_m_s: [f64; 3],
    /// Bias \[m/s²\], within ±1.
    pub bias_m_s2: [f64; 3],
    /// Scale error \[1\], within ±1/128: reading × (1 − scale error) is the specific force.
    pub scale_error: [f64; 3],
    /// Small angles of the pattern of Eq. (7) \[rad\], within ±1/128: xy multiplies the **z** force in
    /// accelerometer x, and so on.
    pub misalignment_rad: CrossAxis<f64>,
    /// Row i: the position of accelerometer i in the body frame \[m\], within ±0.5 each, and so that it swings by 20 m/s
    /// at most at the largest increment that readings within their limits can form (0.5 m in all across at 4 kHz).
    pub lever_arm_m: [[f64; 3]; 3],
}

impl Parameters {
    /// Returns these parameters after `change`; the way to write ones that differ from [`Parameters::default`] outside
    /// this crate.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

impl Default for Parameters {
    /// A perfect 4 kHz triad: pulses of 2⁻¹⁸ rad (0.79″), pickoff codes of 2⁻³² rad, nothing to correct,
    /// 200 frames a second.
    fn default() -> Self {
        Self {
            pulse_weight_rad: [1.0 / (1u64 << 18) as f64; 3],
            bias_rad_s: [0.0; 3],
            scale_error: [0.0; 3],
            installation_rad: CrossAxis::default(),
            flexure_s2: CrossAxis::default(),
            pickoff_gain: [1.0; 3],
            pickoff_weight_rad: 1.0 / (1u64 << 32) as f64,
            sample_rate_hz: design::DESIGN_SAMPLE_RATE_HZ,
            samples_per_output: 20,
            flexure_response: FlexureResponse::default(),
            pickoff_delay_s: [0.0; 3],
            dither_frequency_hz: [400.0; 3],
            dither_amplitude_rad: [0.0; 3],
            adaptation_time_s: 0.0,
            accelerometers: None,
            limits: None,
            identity: None,
            output: OutputFormat::Frames,
            terms: TermRecords::NONE,
        }
    }
}

impl Parameters {
    /// Checks that each field is finite and in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), ParameterError> {
        use ParameterError as E;
        let all = |values: &[f64], (low, high): (f64, f64), error: E| {
            // Written so that NaN fails.
            let fits = values.iter().all(|v| (low..=high).contains(v));
            if fits { Ok(()) } else { Err(error) }
        };
        let within = |limit: f64| (-limit, limit);

        all(
            &[self.sample_rate_hz],
            design::SAMPLE_RATE_RANGE_HZ,
            E::SampleRate,
        )?;
        let rate_squared = self.sample_rate_hz * self.sample_rate_hz;

        all(
            &self.pulse_weight_rad,
            design::PULSE_WEIGHT_RANGE_RAD,
            E::PulseWeight,
        )?;
        all(&self.bias_rad_s, within(design::BIAS_LIMIT_RAD_S), E::Bias)?;
        all(
            &self.scale_error,
            within(design::SCALE_ERROR_LIMIT),
            E::ScaleError,
        )?;
        all(
            &self.installation_rad.to_array(),
            within(design::INSTALLATION_LIMIT_RAD),
            E::Installation,
        )?;
        all(
            &self.flexure_s2.to_array(),
            within(
                design::FLEXURE_LIMIT.min(design::SCALED_FLEXURE_LIMIT / self.increment_unit_rad())
                    / rate_squared,
            ),
            E::Flexure,
        )?;
        all(
            &self.pickoff_gain,
            design::PICKOFF_GAIN_RANGE,
            E::PickoffGain,
        )?;
        all(
            &[self.pickoff_weight_rad],
            design::PICKOFF_WEIGHT_RANGE_RAD,
            E::PickoffWeight,
        )?;
        if !(1..=design::MAX_SAMPLES_PER_OUTPUT).contains(&self.samples_per_output) {
            return Err(E::SamplesPerOutput);
        }
        if let Some(damping) = self.flexure_response.damping() {
            all(&[damping], design::MODE_DAMPING_RANGE, E::FlexureDamping)?;
        }
        all(
            &self.pickoff_delay_s,
            within(design::PICKOFF_DELAY_LIMIT_S),
            E::PickoffDelay,
        )?;
        all(
            &self.dither_amplitude_rad,
            (0.0, design::DITHER_AMPLITUDE_LIMIT_RAD),
            E::DitherAmplitude,
        )?;
        if self.adaptation_time_s != 0.0 {
            all(
                &[self.adaptation_time_s],
                design::ADAPTATION_TIME_RANGE_S,
                E::AdaptationTime,
            )?;
        }
        for axis in 0..3 {
            let used = self.pickoff_delay_s[axis] != 0.0
                || self.dither_amplitude_rad[axis] != 0.0
                || self.adaptation_time_s != 0.0;
            let (low, high) = design::DITHER_CYCLES_RANGE;
            let range_hz = if used {
                (low * self.sample_rate_hz, high * self.sample_rate_hz)
            } else {
                design::DITHER_FREQUENCY_RANGE_HZ
            };
            all(
                &[self.dither_frequency_hz[axis]],
                range_hz,
                E::DitherFrequency,
            )?;
        }
        if self.samples_per_output > self.most_samples_per_output() {
            return Err(E::OutputPeriod);
        }
        if let Some(limits) = &self.limits {
            limits.check()?;
        }
        if self.identity.is_some_and(|known| !known.has_date()) {
            return Err(E::CalibrationDate);
        }
        let Some(accelerometers) = &self.accelerometers else {
            return Ok(());
        };
        all(
            &accelerometers.weight_m_s,
            design::ACCELEROMETER_WEIGHT_RANGE_M_S,
            E::AccelerometerWeight,
        )?;
        all(
            &accelerometers.bias_m_s2,
            within(design::ACCELEROMETER_BIAS_LIMIT_M_S2),
            E::AccelerometerBias,
        )?;
        all(
            &accelerometers.scale_error,
            within(design::SCALE_ERROR_LIMIT),
            E::AccelerometerScale,
        )?;
        all(
            &accelerometers.misalignment_rad.to_array(),
            within(design::INSTALLATION_LIMIT_RAD),
            E::AccelerometerMisalignment,
        )?;
        all(
            accelerometers.lever_arm_m.as_flattened(),
            within(design::LEVER_ARM_LIMIT_M),
            E::LeverArm,
        )?;
        // ω extrapolated to a sample's end is at most twice the largest mean.
        let fastest_rad_s = 2.0 * self.largest_increment_rad() * self.sample_rate_hz;
        let swings_m_s = [0, 1, 2].map(|axis: usize| {
            let arm = accelerometers.lever_arm_m[axis];
            fastest_rad_s * (arm[(axis + 1) % 3].abs() + arm[(axis + 2) % 3].abs())
        });
        all(&swings_m_s, (0.0, design::SWING_LIMIT_M_S), E::LeverArm)
    }

    /// Checks that increments have room for the largest additions of terms \[increment units per sample\].
    pub(crate) fn check_addition(&self, addition: f64) -> Result<(), ParameterError> {
        if addition == 0.0 {
            return Ok(());
        }
        let largest = self.largest_increment_rad() / self.increment_unit_rad() + addition;
        let period = largest * self.increment_unit_rad() * f64::from(self.samples_per_output);
        if largest > design::INCREMENT_LIMIT_RAD {
            Err(ParameterError::TermsTooLarge)
        } else if period > design::OUTPUT_PERIOD_LIMIT_RAD {
            Err(ParameterError::OutputPeriod)
        } else {
            Ok(())
        }
    }

    /// Exponent of the unit in which increments are counted at this sample rate.
    pub(crate) fn increment_unit_log2(&self) -> u32 {
        design::increment_unit_log2(self.sample_rate_hz)
    }

    /// That unit \[rad\].
    pub(crate) fn increment_unit_rad(&self) -> f64 {
        f64::from(1u8 << self.increment_unit_log2())
    }

    /// Fastest rate about a sensing axis that every sample can hold, the block's dither included \[rad/s\].
    pub fn sensed_range_rad_s(&self) -> f64 {
        design::SENSED_LIMIT_RAD * self.increment_unit_rad() * self.sample_rate_hz
    }

    /// Fastest steady rate of the case about a body axis that every frame can show \[rad/s\]. The excess of a faster
    /// one is shown by later frames, flagged, and must not last.
    pub fn frame_range_rad_s(&self) -> f64 {
        let frame_rad = f64::from(i32::MAX) * design::OUTPUT_RAD_PER_CODE;
        frame_rad * self.sample_rate_hz / f64::from(self.samples_per_output)
    }

    /// Most samples of one output period whose sums fit at the limit of their readings \[samples\]. The other fields are
    /// in their ranges.
    pub fn most_samples_per_output(&self) -> u16 {
        let of_angle = design::OUTPUT_PERIOD_LIMIT_RAD / self.largest_increment_rad();
        let finest_rad = self.pulse_weight_rad.into_iter().fold(1.0, f64::min);
        let sensed_rad = design::SENSED_LIMIT_RAD * self.increment_unit_rad();
        let of_counts = f64::from(i32::MAX) * finest_rad / sensed_rad;
        // A float's conversion holds at the ends.
        let most = of_angle.min(of_counts) as u16;
        most.min(design::MAX_SAMPLES_PER_OUTPUT)
    }

    /// Largest increment of the case over one sample that readings within their limits can form \[rad\]: counts at
    /// their limit, pickoff steps at theirs through both taps, wherever adaptation may move them, turned by the matrix,
    /// plus the flexure. The other fields are in their ranges.
    pub fn largest_increment_rad(&self) -> f64 {
        let unit_rad = self.increment_unit_rad();
        let sensed = [0, 1, 2].map(|axis| {
            let strip = design::DITHER_LIMIT_RAD * self.largest_taps(axis);
            design::SENSED_LIMIT_RAD * (1.0 - self.scale_error[axis]) + strip
        });
        let [x, y, z] = sensed;
        let e = self.installation_rad.map(f64::abs);
        let case = [
            x + e.xy * z + e.xz * y,
            y + e.yz * x + e.yx * z,
            z + e.zx * y + e.zy * x,
        ];
        let rigid = self.flexure_s2 == CrossAxis::default();
        let bent = if rigid { 0.0 } else { design::BENT_LIMIT_RAD };
        (case.into_iter().fold(0.0, f64::max) + bent) * unit_rad
    }

    /// |h₀| + |h₁| over the pickoff's gain, at most; 0 where nothing is stripped.
    fn largest_taps(&self, axis: usize) -> f64 {
        if self.pickoff_gain[axis] == 0.0 {
            return 0.0;
        }
        let [now, past] = self.relative_taps(axis).map(f64::abs);
        let moves = self.adaptation_time_s != 0.0 && self.dither_amplitude_rad[axis] != 0.0;
        let moved = if moves {
            let phase = self.dither_phase(axis);
            f64::from(design::ADAPTATION_RANGE) * (1.0 + phase.cot().abs() + phase.cosec().abs())
        } else {
            0.0
        };
        now + past + moved
    }

    /// The phase of a gyro's dither over one sample.
    pub(crate) fn dither_phase(&self, axis: usize) -> DitherPhase {
        DitherPhase::of(self.dither_frequency_hz[axis] / self.sample_rate_hz)
    }

    /// The strip's taps over the pickoff's gain.
    pub(crate) fn relative_taps(&self, axis: usize) -> [f64; 2] {
        let delay_samples = self.pickoff_delay_s[axis] * self.sample_rate_hz;
        self.dither_phase(axis).relative_taps(delay_samples)
    }

    /// Pickoff gain in the unit of the sensed angle after scale correction \[rad per code\].
    pub(crate) fn strip_rad_per_code(&self, axis: usize) -> f64 {
        self.pickoff_gain[axis] * self.pickoff_weight_rad * (1.0 - self.scale_error[axis])
    }
}
