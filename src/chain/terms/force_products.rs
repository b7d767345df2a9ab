//! Corrects the gyros' errors in proportion to products of the force: with the rate (tilts) and with itself.
//!
//! It takes every sample's velocity increments V, body frame, and increments D about the sensing axes. It gives corrected
//! increments and, once per output period, corrected angles \[fine units\]. With δ_ij = τ_ij f_k, k the third axis, and
//! the signs of [`installation`](crate::chain::stages::installation), the gyros read more
//!
//! ```text
//! x: τ_xz f_y ω_y − τ_xy f_z ω_z + g_x f_x²      y: τ_yx f_z ω_z − τ_yz f_x ω_x + g_y f_y²
//! z: τ_zy f_x ω_x − τ_zx f_y ω_y + g_z f_z²
//! ```
//!
//! Products of one sample's means lack x²/12 of an oscillation's rectified part (x = ΩT): 0.08 % at 61 Hz and 4 kHz, 3
//! % at 400 Hz. Codes of w m/s add w²/6T² to the mean of f²: 0.03 % of 1 g for 1e-4 m/s and 250 µs.
//!
//! The force is that at the accelerometers' places. Their size effect is left out: for a tilt an arm r is a flexure of
//! τ r, 5e-9 s² for 1e-7 rad per m/s² and 5 cm.
//!
//! While increments contain dither (a failed pickoff) tilts are off, as the flexure is.

use crate::chain::design_parameters::{
    FORCE_SQUARED_LIMIT_RAD, INCREMENT_LIMIT_RAD, RESPONSE_LIMIT_RAD, SLOPE_LIMIT,
    TILT_BY_FORCE_LIMIT_RAD, VELOCITY_LIMIT_M_S,
};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::VELOCITY_UNIT_M_S;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds, add_tilted};
use crate::chain::triad::{CrossAxis, Triad};

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct ForceProducts<N: NumberSystem> {
    /// Factors of V_k and D_k, with the sign of the correction.
    tilts: CrossAxis<N::Slope>,
    /// −g, per square of a velocity increment.
    squares: [N::Slope; 3],
    /// Largest correction of one increment.
    largest: f64,
}

/// The sample's velocity increments, and the sum of the corrections of the output period's increments.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForceProductsState<N: NumberSystem> {
    velocity: Triad<N::Increment>,
    gained: [N::Tilted; 3],
    /// True if increments contain dither.
    unknown: bool,
}

/// Largest velocity increment \[units\], after scale errors, misalignments and squares of 1/128 and the correction of a
/// delay.
pub(super) const LARGEST_VELOCITY: f64 =
    1.04 * VELOCITY_LIMIT_M_S / VELOCITY_UNIT_M_S + RESPONSE_LIMIT_RAD;

/// Scales a record's values; the largest magnitude times `reach` must be within `limit`, or the error names the kind.
fn slopes(
    parameters: &Parameters,
    kind: TermKind,
    values: &mut [f64],
    factor: f64,
    (reach, limit): (f64, f64),
) -> Result<f64, ParameterError> {
    scale(values, factor);
    let most = largest(values);
    // Written so that NaN fails.
    if !(most * reach <= limit && most <= SLOPE_LIMIT) {
        return Err(ParameterError::Term(kind));
    }
    if most != 0.0 && parameters.accelerometers.is_none() {
        return Err(ParameterError::TermNeedsAccelerometers(kind));
    }
    Ok(most * reach)
}

impl<N: NumberSystem> Term<N> for ForceProducts<N> {
    type State = ForceProductsState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AxisTiltByForce, TermKind::GyroG2Bias]);
    const FOLLOWS_FORCE: bool = true;

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let unit = parameters.increment_unit_rad();
        // A velocity increment of 1 as a force, in increment units.
        let per_force = VELOCITY_UNIT_M_S * unit * parameters.sample_rate_hz;
        let kind = TermKind::AxisTiltByForce;
        let mut tilts = parameters.terms.values::<6>(kind);
        let reach = (LARGEST_VELOCITY, TILT_BY_FORCE_LIMIT_RAD);
        let tilt = slopes(parameters, kind, &mut tilts, per_force, reach)?;
        let [xy, xz, yx, yz, zx, zy] = tilts;
        let kind = TermKind::GyroG2Bias;
        let mut squares = parameters.terms.values::<3>(kind);
        let reach = (LARGEST_VELOCITY * LARGEST_VELOCITY, FORCE_SQUARED_LIMIT_RAD);
        let per_square = -VELOCITY_UNIT_M_S * per_force;
        let square = slopes(parameters, kind, &mut squares, per_square, reach)?;
        Ok(Self {
            tilts: CrossAxis::from_array([xy, -xz, -yx, yz, zx, -zy]).map(N::slope),
            squares: squares.map(N::slope),
            largest: 2.0 * tilt * INCREMENT_LIMIT_RAD + square,
        })
    }

    fn largest_addition(&self) -> f64 {
        self.largest
    }

    #[inline(always)]
    fn force(&self, state: &mut ForceProductsState<N>, velocities: Triad<N::Increment>) {
        state.velocity = velocities;
    }

    #[inline(always)]
    fn increments(
        &self,
        state: &mut ForceProductsState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let (v, t) = (state.velocity, &self.tilts);
        let mut gains = [N::Tilted::default(); 3];
        if !state.unknown {
            let d = increments;
            let tilt = |slope, force| N::sloped(slope, force);
            gains = [
                N::tilted(tilt(t.xz, v.y), d.y, tilt(t.xy, v.z), d.z),
                N::tilted(tilt(t.yx, v.z), d.z, tilt(t.yz, v.x), d.x),
                N::tilted(tilt(t.zy, v.x), d.x, tilt(t.zx, v.y), d.y),
            ];
        }
        let mut corrected = increments.to_array();
        for (axis, v) in v.to_array().into_iter().enumerate() {
            let none = N::Tilt::default();
            let square = N::tilted(N::sloped(self.squares[axis], v), v, none, v);
            let gain = N::add_tilted(gains[axis], square);
            corrected[axis] = N::turn(corrected[axis], gain);
            state.gained[axis] = N::add_tilted(state.gained[axis], gain);
        }
        Triad::from_array(corrected)
    }

    #[inline(always)]
    fn angles(
        &self,
        state: &mut ForceProductsState<N>,
        sums: &PeriodSums,
        angles: [i64; 3],
    ) -> [i64; 3] {
        add_tilted::<N>(&mut state.gained, sums.unit_log2, angles)
    }

    fn degrade(&self, state: &mut ForceProductsState<N>, rates_known: bool) {
        state.unknown = !rates_known;
    }
}
