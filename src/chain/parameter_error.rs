//! Field of the parameters that cannot be used, as an error.

use core::fmt;

use crate::chain::terms::records::{RecordError, TermKind};

/// The field that cannot be used: not finite, or outside its documented range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ParameterError {
    /// `pulse_weight_rad`.
    PulseWeight,
    /// `bias_rad_s`.
    Bias,
    /// `scale_error`.
    ScaleError,
    /// `installation_rad`.
    Installation,
    /// `flexure_s2`.
    Flexure,
    /// `pickoff_gain`.
    PickoffGain,
    /// `pickoff_weight_rad`.
    PickoffWeight,
    /// `sample_rate_hz`.
    SampleRate,
    /// `samples_per_output`.
    SamplesPerOutput,
    /// `samples_per_output` with `sample_rate_hz` and the pickoff's taps.
    OutputPeriod,
    /// `flexure_response.damping`.
    FlexureDamping,
    /// Frequency of `axis_flexure_mode`.
    ModeFrequency,
    /// Damping of `axis_flexure_mode`.
    ModeDamping,
    /// `pickoff_delay_s`.
    PickoffDelay,
    /// `dither_frequency_hz`.
    DitherFrequency,
    /// `dither_amplitude_rad`.
    DitherAmplitude,
    /// `adaptation_time_s`.
    AdaptationTime,
    /// `accelerometers.weight_m_s`.
    AccelerometerWeight,
    /// `accelerometers.bias_m_s2`.
    AccelerometerBias,
    /// `accelerometers.scale_error`.
    AccelerometerScale,
    /// `accelerometers.misalignment_rad`.
    AccelerometerMisalignment,
    /// `accelerometers.lever_arm_m`.
    LeverArm,
    /// `limits.temperature_k`.
    TemperatureLimits,
    /// `limits.intensity_least`.
    IntensityLimit,
    /// `limits.path_length_step`.
    PathLengthStep,
    /// `limits.dither_drive`.
    DitherDriveLimits,
    /// `limits.dither_amplitude`.
    DitherAmplitudeLimits,
    /// `limits.pulse_silence_s`.
    PulseSilence,
    /// `identity.calibrated`.
    CalibrationDate,
    /// A value of this term.
    Term(TermKind),
    /// This term needs accelerometers, and there are none.
    TermNeedsAccelerometers(TermKind),
    /// The build has no term of this kind.
    TermAbsent(TermKind),
    /// The additions of the terms leave an increment no room.
    TermsTooLarge,
    /// The records cannot be used.
    Records(RecordError),
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self {
            Self::PulseWeight => "pulse_weight_rad must be 5.9e-11 (2^-34) to 1e-4 rad",
            Self::Bias => "bias_rad_s must be within +-0.01 rad/s",
            Self::ScaleError => "scale_error must be within +-1/128",
            Self::Installation => "installation_rad must be within +-1/128 rad",
            Self::Flexure => {
                "flexure_s2 times the square of the sample rate must be within +-8, below 1 kHz within +-4"
            }
            Self::PickoffGain => "pickoff_gain must be 0 to 2",
            Self::PickoffWeight => "pickoff_weight_rad must be 2.92e-11 (2^-35) to 1e-4 rad",
            Self::SampleRate => "sample_rate_hz must be 500 to 8000 Hz",
            Self::SamplesPerOutput => "samples_per_output must be 1 to 40",
            Self::OutputPeriod => {
                "samples_per_output is too many at this sample_rate_hz: what the samples of one output period may \
                 turn by, at the limit of their readings, must stay within 0.1767 rad (some 12 ms), and \
                 their pulses within an i32"
            }
            Self::FlexureDamping => "damping of axis_flexure must be 0.002 to 0.99",
            Self::ModeFrequency => {
                "frequency_hz of axis_flexure_mode must be 0.01 to 0.5 of the sample rate (40 to 2000 Hz at 4 kHz)"
            }
            Self::ModeDamping => "damping of axis_flexure_mode must be 0.002 to 0.99",
            Self::PickoffDelay => "pickoff_delay_s must be within +-1e-4 s",
            Self::DitherFrequency => {
                "dither_frequency_hz must be 1 to 4000 Hz, and 0.04 to 0.4 of the sample rate where \
                 it is used"
            }
            Self::DitherAmplitude => "dither_amplitude_rad must be 0 to 0.01 rad",
            Self::AdaptationTime => "adaptation_time_s must be 0 (frozen) or 0.1 to 1000 s",
            Self::AccelerometerWeight => "weight_m_s must be 1e-9 to 1e-2 m/s",
            Self::AccelerometerBias => "bias_m_s2 must be within +-1 m/s^2",
            Self::AccelerometerScale => "scale_error of the accelerometers must be within +-1/128",
            Self::AccelerometerMisalignment => "misalignment_rad must be within +-1/128 rad",
            Self::LeverArm => {
                "lever_arm_m must be within +-0.5 m, and swing by 20 m/s at most at the largest increment"
            }
            Self::TemperatureLimits => {
                "limits.temperature_k must be two rising values of 150 to 450 K"
            }
            Self::IntensityLimit => "limits.intensity_least must be 0.01 to 1 of nominal",
            Self::PathLengthStep => {
                "limits.path_length_step must be 0.001 to 1 of the control's range"
            }
            Self::DitherDriveLimits => {
                "limits.dither_drive must be two rising values of 0 to 2 of nominal"
            }
            Self::DitherAmplitudeLimits => {
                "limits.dither_amplitude must be 0.2 to below 1 and above 1 to 1.9 of nominal"
            }
            Self::PulseSilence => "limits.pulse_silence_s must be 1.001 to 1.04 s",
            Self::CalibrationDate => {
                "identity.calibrated must be a date, year x 10000 + month x 100 + day, or 0"
            }
            Self::Term(kind) => {
                return write!(f, "a value of {kind} is beyond what its term can hold");
            }
            Self::TermNeedsAccelerometers(kind) => {
                return write!(f, "{kind} needs accelerometers, and there are none");
            }
            Self::TermAbsent(kind) => {
                return write!(f, "this firmware has no term for {kind}");
            }
            Self::TermsTooLarge => {
                "what the terms may add to one increment at its limit must stay within 0.0078 rad with it"
            }
            Self::Records(error) => return error.fmt(f),
        };
        f.write_str(words)
    }
}

impl core::error::Error for ParameterError {}
