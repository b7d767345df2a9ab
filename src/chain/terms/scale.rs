//! Corrects scale errors of the gyros that depend on the rate: asymmetric, quadratic, cubic.
//!
//! It takes increments about the sensing axes of every sample, and the output period's angles \[fine units\]. A gyro
//! that reads ω + a |ω| + q ω² + c ω³ has sensed the increment
//!
//! ```text
//! D + a |D| + (q/T) D² + (c/T²) D³
//! ```
//!
//! The quadratic and cubic parts are subtracted from every sample's increment, and summed like tilts: rounded products
//! of small numbers. They are taken of the case's rate, not of the block's, as the catalogue has it.
//!
//! The asymmetry is subtracted from the period's angle: of one sample it would rectify the pulse's quantisation, σ a
//! √(2/π)/T, 0.008 °/h for 10 ppm and 0.8″. Where the rate changes its sign within an output period T_o, the mean lacks
//! (Ω T_o)²/24 of an oscillation's asymmetry: 0.2 % at 15 Hz and 2.5 ms.

use crate::chain::design_parameters::{SCALE_ERROR_LIMIT, SENSED_LIMIT_RAD, SLOPE_LIMIT};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactCoefficient;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds};
use crate::chain::triad::Triad;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct ScaleByRate<N: NumberSystem> {
    /// −q/T.
    quadratic: [N::Slope; 3],
    /// −c/T².
    cubic: [N::Slope; 3],
    /// −a.
    asymmetry: [ExactCoefficient; 3],
    /// Largest correction of one increment.
    largest: f64,
}

/// Sum of the corrections of the output period's increments.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScaleByRateState<N: NumberSystem> {
    gained: Triad<N::Tilted>,
}

/// Largest increment at which the correction must stay within [`SCALE_ERROR_LIMIT`] \[increment units\]: the reach of
/// the counts alone, with a margin for the strip.
const LARGEST_INCREMENT: f64 = 2.0 * SENSED_LIMIT_RAD;

impl<N: NumberSystem> Term<N> for ScaleByRate<N> {
    type State = ScaleByRateState<N>;
    const KINDS: TermKinds = TermKinds::of(&[
        TermKind::GyroScaleAsymmetry,
        TermKind::GyroScaleQuadratic,
        TermKind::GyroScaleCubic,
    ]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        use TermKind as K;
        let per_sample = parameters.sample_rate_hz * parameters.increment_unit_rad();
        let read = |kind: K, factor: f64, reach: f64| {
            let mut values = parameters.terms.values::<3>(kind);
            scale(&mut values, -factor);
            let most = largest(&values);
            // Half the limit each; written so that NaN fails.
            if most * reach <= 0.5 * SCALE_ERROR_LIMIT && most <= SLOPE_LIMIT {
                Ok((values, most))
            } else {
                Err(ParameterError::Term(kind))
            }
        };
        let (quadratic, most_quadratic) =
            read(K::GyroScaleQuadratic, per_sample, LARGEST_INCREMENT)?;
        let square = LARGEST_INCREMENT * LARGEST_INCREMENT;
        let (cubic, most_cubic) = read(K::GyroScaleCubic, per_sample * per_sample, square)?;
        let (asymmetry, _) = read(K::GyroScaleAsymmetry, 1.0, 1.0)?;
        Ok(Self {
            quadratic: quadratic.map(N::slope),
            cubic: cubic.map(N::slope),
            asymmetry: asymmetry.map(ExactCoefficient::of),
            largest: (most_quadratic + most_cubic * LARGEST_INCREMENT) * square,
        })
    }

    fn largest_addition(&self) -> f64 {
        self.largest
    }

    #[inline(always)]
    fn increments(
        &self,
        state: &mut ScaleByRateState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let mut corrected = increments.to_array();
        let mut gained = state.gained.to_array();
        for axis in 0..3 {
            let d = corrected[axis];
            let linear = N::sloped(self.quadratic[axis], d);
            let square = N::sloped_twice(self.cubic[axis], d);
            let none = N::Tilt::default();
            let gain = N::tilted(N::add_tilt(linear, square), d, none, d);
            corrected[axis] = N::turn(d, gain);
            gained[axis] = N::add_tilted(gained[axis], gain);
        }
        state.gained = Triad::from_array(gained);
        Triad::from_array(corrected)
    }

    #[inline(always)]
    fn angles(
        &self,
        state: &mut ScaleByRateState<N>,
        sums: &PeriodSums,
        mut angles: [i64; 3],
    ) -> [i64; 3] {
        let gained = core::mem::take(&mut state.gained).to_array();
        for axis in 0..3 {
            let of_asymmetry = self.asymmetry[axis].times(angles[axis].wrapping_abs());
            let of_samples = N::fine(gained[axis], N::Cross::default()) << sums.unit_log2;
            let sum = angles[axis].wrapping_add(of_asymmetry);
            angles[axis] = sum.wrapping_add(of_samples);
        }
        angles
    }
}
