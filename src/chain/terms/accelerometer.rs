//! Corrects the quadratic error of accelerometers, in proportion to the square of the force along their axis.
//!
//! It takes every sample's velocity increments V, body frame, and the output period's velocity \[fine units\], and takes
//! (q_i/T) V_i² off both: the share of the period's velocity is summed like tilts, rounded products of small numbers.
//!
//! The square is that of a sample's mean: an oscillation lacks x²/12 of its rectified part (x = ΩT), 0.08 % at 61 Hz
//! and 4 kHz. Codes of w m/s add w²/6T² to the mean of f²: 0.03 % of 1 g for 1e-4 m/s and 250 µs. Misalignments times q
//! are left out.

use crate::chain::design_parameters::{SCALE_ERROR_LIMIT, SLOPE_LIMIT, VELOCITY_LIMIT_M_S};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::VELOCITY_UNIT_M_S;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{Term, TermKind, TermKinds};
use crate::chain::triad::Triad;

/// Configuration: −q/T, per velocity increment.
#[derive(Debug, Clone, Copy)]
pub struct AccelerometerQuadratic<N: NumberSystem>([N::Slope; 3]);

/// Sum of the corrections of the output period's velocity increments.
#[derive(Debug, Clone, Copy, Default)]
pub struct AccelerometerQuadraticState<N: NumberSystem> {
    gained: [N::Tilted; 3],
}

impl<N: NumberSystem> Term<N> for AccelerometerQuadratic<N> {
    type State = AccelerometerQuadraticState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AccelQuadratic]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let kind = TermKind::AccelQuadratic;
        let per_force =
            VELOCITY_UNIT_M_S * parameters.increment_unit_rad() * parameters.sample_rate_hz;
        let mut slopes = parameters.terms.values::<3>(kind);
        scale(&mut slopes, -per_force);
        let most = largest(&slopes);
        let reach = VELOCITY_LIMIT_M_S / VELOCITY_UNIT_M_S;
        // Written so that NaN fails.
        if most * reach <= SCALE_ERROR_LIMIT && most <= SLOPE_LIMIT {
            Ok(Self(slopes.map(N::slope)))
        } else {
            Err(ParameterError::Term(kind))
        }
    }

    #[inline(always)]
    fn velocities(
        &self,
        state: &mut AccelerometerQuadraticState<N>,
        velocities: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let mut corrected = velocities.to_array();
        for (axis, corrected) in corrected.iter_mut().enumerate() {
            let v = *corrected;
            let none = N::Tilt::default();
            let gain = N::tilted(N::sloped(self.0[axis], v), v, none, v);
            *corrected = N::turn(v, gain);
            state.gained[axis] = N::add_tilted(state.gained[axis], gain);
        }
        Triad::from_array(corrected)
    }

    #[inline(always)]
    fn felt(
        &self,
        state: &mut AccelerometerQuadraticState<N>,
        unit_log2: u32,
        mut velocity: [i64; 3],
    ) -> [i64; 3] {
        let gained = core::mem::take(&mut state.gained);
        for (velocity, gained) in velocity.iter_mut().zip(gained) {
            let gained = N::fine(gained, N::Cross::default()) << unit_log2;
            *velocity = velocity.wrapping_add(gained);
        }
        velocity
    }
}
