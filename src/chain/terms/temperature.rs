//! Corrects bias, scale and installation of the gyros by their temperatures.
//!
//! It takes slow readings \[K, K/s\]. It gives bias \[fine units per sample\] and, once per output period, angles about
//! the sensing axes \[fine units\]. With ΔT_i = T_i − T₀_i:
//!
//! ```text
//! b_i = c_i ΔT_i + c₂_i ΔT_i² + r_i dT_i/dt        s_i = s1_i ΔT_i + s2_i ΔT_i²        δ_ij = c_ij ΔT_i + c₂_ij ΔT_i²
//! ```
//!
//! The angles are linear in all of these, so the output period's exact sums take them: a sample costs nothing, and
//! nothing is rounded per sample. Products of samples see neither: a scale error of 1e-4 changes coning by 2e-4 of it.
//!
//! Tilts act on the sensed angles, before Eq. (7): the residual is ε0 δ, 1e-3 of the correction.
//!
//! Numbers are f32 here: a bias of 1e-6 rad/s is right to 1e-13.

use crate::chain::design_parameters::{
    BIAS_LIMIT_RAD_S, INSTALLATION_LIMIT_RAD, SCALE_ERROR_LIMIT, TEMPERATURE_RANGE_K,
};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{ExactCoefficient, fine_of_f32};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::{PeriodSums, SlowReadings, Term, TermKind, TermKinds};
use crate::chain::triad::CrossAxis;

/// T₀, and factors of ΔT and ΔT², of as many values as there are.
#[derive(Debug, Clone, Copy)]
struct Polynomial<const COUNT: usize> {
    reference_k: [f32; 3],
    first: [f32; COUNT],
    second: [f32; COUNT],
}

/// Configuration: bias, scale and installation by temperature.
#[derive(Debug, Clone, Copy)]
pub struct Temperature {
    bias: Polynomial<3>,
    /// r \[rad/K\].
    bias_by_rate: [f32; 3],
    scale: Polynomial<3>,
    installation: Polynomial<6>,
    period_s: f32,
}

/// The corrections in force.
#[derive(Debug, Clone, Copy, Default)]
pub struct TemperatureState {
    /// The first temperatures after start \[K\], 0 before.
    first_k: [f32; 3],
    /// b T \[fine units\].
    bias: [i64; 3],
    /// −s.
    scale: [ExactCoefficient; 3],
    /// Factors of the angle about the third axis and about j, in the pattern of Eq. (7).
    installation: CrossAxis<ExactCoefficient>,
}

/// Gyro of each of the six pairs.
const GYRO_OF_PAIR: [usize; 6] = [0, 0, 1, 1, 2, 2];

impl<const COUNT: usize> Polynomial<COUNT> {
    /// From three reference temperatures and twice `COUNT` factors.
    ///
    /// # Errors
    /// A reference that is neither 0 nor a temperature, or factors whose effect at 100 K is more than `limit`.
    fn new(values: &[f64], kind: TermKind, limit: f64) -> Result<Self, ParameterError> {
        let (references, factors) = values.split_at_checked(3).unwrap_or((values, &[]));
        let (low, high) = TEMPERATURE_RANGE_K;
        let known = |&t: &f64| t == 0.0 || (f64::from(low)..=f64::from(high)).contains(&t);
        let (first, second) = factors.split_at_checked(COUNT).unwrap_or((factors, &[]));
        let small = |factors: &[f64], span: f64| factors.iter().all(|c| (c * span).abs() <= limit);
        // Written so that NaN fails.
        let fits = references.iter().all(known) && small(first, 100.0) && small(second, 1e4);
        if !fits {
            return Err(ParameterError::Term(kind));
        }
        let of = |values: &[f64], at: usize| values.get(at).copied().unwrap_or_default() as f32;
        Ok(Self {
            reference_k: core::array::from_fn(|axis| of(references, axis)),
            first: core::array::from_fn(|at| of(first, at)),
            second: core::array::from_fn(|at| of(second, at)),
        })
    }

    /// The value of index `at`, which belongs to `gyro`, held within ±`limit`.
    fn value(
        &self,
        at: usize,
        gyro: usize,
        state: &TemperatureState,
        now_k: f32,
        limit: f32,
    ) -> f32 {
        let given = self.reference_k[gyro];
        let reference = if given == 0.0 {
            state.first_k[gyro]
        } else {
            given
        };
        let difference = now_k - reference;
        let value = (self.first[at] + self.second[at] * difference) * difference;
        value.clamp(-limit, limit)
    }
}

impl<N: NumberSystem> Term<N> for Temperature {
    type State = TemperatureState;
    const KINDS: TermKinds = TermKinds::of(&[
        TermKind::GyroBiasTemperature,
        TermKind::GyroBiasTemperatureRate,
        TermKind::GyroScaleTemperature,
        TermKind::InstallationTemperature,
    ]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        use TermKind as K;
        let records = &parameters.terms;
        let (bias, scale) = (K::GyroBiasTemperature, K::GyroScaleTemperature);
        let installation = K::InstallationTemperature;
        let rate = records.values::<3>(K::GyroBiasTemperatureRate);
        // 0.1 K/s is a drop into a bath.
        if !rate.iter().all(|r| (r * 0.1).abs() <= BIAS_LIMIT_RAD_S) {
            return Err(ParameterError::Term(K::GyroBiasTemperatureRate));
        }
        Ok(Self {
            bias: Polynomial::new(&records.values::<9>(bias), bias, BIAS_LIMIT_RAD_S)?,
            bias_by_rate: rate.map(|r| r as f32),
            scale: Polynomial::new(&records.values::<9>(scale), scale, SCALE_ERROR_LIMIT)?,
            installation: Polynomial::new(
                &records.values::<15>(installation),
                installation,
                INSTALLATION_LIMIT_RAD,
            )?,
            period_s: (1.0 / parameters.sample_rate_hz) as f32,
        })
    }

    #[inline(always)]
    fn bias(&self, state: &TemperatureState) -> [i64; 3] {
        state.bias
    }

    #[inline(always)]
    fn angles(&self, state: &mut TemperatureState, _: &PeriodSums, angles: [i64; 3]) -> [i64; 3] {
        let [x, y, z] = angles;
        let (s, e) = (&state.scale, &state.installation);
        let add = |to: i64, own: i64, a: i64, b: i64| {
            to.wrapping_add(own).wrapping_add(a).wrapping_add(b)
        };
        [
            add(x, s[0].times(x), e.xy.times(z), e.xz.times(y)),
            add(y, s[1].times(y), e.yz.times(x), e.yx.times(z)),
            add(z, s[2].times(z), e.zx.times(y), e.zy.times(x)),
        ]
    }

    fn angles_wide(&self, state: &TemperatureState, angles: [i128; 3]) -> [i128; 3] {
        let [x, y, z] = angles;
        let (s, e) = (&state.scale, &state.installation);
        let add = |to: i128, own: i128, a: i128, b: i128| {
            to.wrapping_add(own).wrapping_add(a).wrapping_add(b)
        };
        [
            add(
                x,
                s[0].times_wide(x),
                e.xy.times_wide(z),
                e.xz.times_wide(y),
            ),
            add(
                y,
                s[1].times_wide(y),
                e.yz.times_wide(x),
                e.yx.times_wide(z),
            ),
            add(
                z,
                s[2].times_wide(z),
                e.zx.times_wide(y),
                e.zy.times_wide(x),
            ),
        ]
    }

    /// Readings of a gyro whose temperature is not within [`TEMPERATURE_RANGE_K`], or whose rate is not finite, leave
    /// that gyro's corrections as they are.
    fn slow(&self, state: &mut TemperatureState, readings: &SlowReadings) {
        let (low, high) = TEMPERATURE_RANGE_K;
        let mut tilts = state.installation.to_array();
        for gyro in 0..3 {
            let now_k = readings.temperature_k[gyro];
            let rate = readings.temperature_rate_k_s[gyro];
            if !((low..=high).contains(&now_k) && rate.is_finite()) {
                continue;
            }
            if state.first_k[gyro] == 0.0 {
                state.first_k[gyro] = now_k;
            }
            let limit = BIAS_LIMIT_RAD_S as f32;
            let by_rate = (self.bias_by_rate[gyro] * rate).clamp(-limit, limit);
            let bias = self.bias.value(gyro, gyro, state, now_k, limit) + by_rate;
            state.bias[gyro] = fine_of_f32(bias * self.period_s);
            let limit = SCALE_ERROR_LIMIT as f32;
            let scale = self.scale.value(gyro, gyro, state, now_k, limit);
            state.scale[gyro] = ExactCoefficient::of_f32(-scale);
            let limit = INSTALLATION_LIMIT_RAD as f32;
            for (at, tilt) in tilts.iter_mut().enumerate() {
                if GYRO_OF_PAIR[at] == gyro {
                    let delta = self.installation.value(at, gyro, state, now_k, limit);
                    *tilt = ExactCoefficient::of_f32(SIGN_OF_PAIR[at] * delta);
                }
            }
        }
        state.installation = CrossAxis::from_array(tilts);
    }

    #[inline(always)]
    fn take_slow(&self, state: &mut TemperatureState, prepared: &TemperatureState) {
        *state = *prepared;
    }
}

/// Sign with which δ_ij enters Eq. (7), in the order of [`CrossAxis::to_array`] (see
/// [`installation`](crate::chain::stages::installation)).
const SIGN_OF_PAIR: [f32; 6] = [1.0, -1.0, -1.0, 1.0, 1.0, -1.0];
