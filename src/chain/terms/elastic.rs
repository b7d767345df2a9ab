//! Corrects elastic turns of the gyros' blocks: angles in proportion to the force and to the angular acceleration.
//!
//! It takes every sample's velocity increments V, body frame, and increments D about the sensing axes. It gives corrected
//! increments and, once per output period, corrected angles \[fine units\]. A gyro that reads Σ_j U_ij df_j/dt +
//! W_ij d²ω_j/dt² more shows at a sample's end the angle Σ_j U_ij f_j + W_ij α_j too much. Force and acceleration there
//! follow from the polynomial through the last five integrals (backward differentiation, to fourth order):
//!
//! ```text
//! T f_k  = V + ½ ∇V + ⅓ ∇²V + ¼ ∇³V        T² α_k = ∇D + ∇²D + 11/12 ∇³D
//! ```
//!
//! The angle E = −(U f + W α) telescopes ([`ends`](crate::chain::terms::ends)). Its noise is bounded and does not drift:
//! 4 W/T² pulses of the gyros and 2.6 U/T codes of the accelerometers, rms over √12.
//!
//! The force is that at the accelerometers' places; the acceleration is taken about the sensing axes, and held within
//! the chain's range. W_ii is half a gyro's bandwidth variance ([`response`](crate::chain::terms::response)).

use crate::chain::design_parameters::{
    ACCELERATION_LIMIT_RAD, FILTER_TERMS, RESPONSE_LIMIT_RAD, SLOPE_LIMIT,
};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::VELOCITY_UNIT_M_S;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::ends::{Ends, LARGEST_AHEAD};
use crate::chain::terms::force_products::LARGEST_VELOCITY;
use crate::chain::terms::records::scale;
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds};
use crate::chain::triad::Triad;

/// ½ T f in terms of V_k … V_{k−3}: within a filter coefficient's range.
const HALF_FORCE: [f64; FILTER_TERMS] = [25.0 / 24.0, -23.0 / 24.0, 13.0 / 24.0, -1.0 / 8.0];

/// Largest T f \[velocity units\]: twice the sum of the coefficients' magnitudes.
const LARGEST_FORCE: f64 = 16.0 / 3.0 * LARGEST_VELOCITY;

/// ⅛ T² α in terms of D_k … D_{k−3}: within an increment's range.
const EIGHTH_ACCELERATION: [f64; FILTER_TERMS] =
    [35.0 / 96.0, -69.0 / 96.0, 45.0 / 96.0, -11.0 / 96.0];

/// Configuration: −U and −W by gyro, in the units of the filters' results.
#[derive(Debug, Clone, Copy)]
pub struct ElasticRate<N: NumberSystem> {
    force: [N::FilterCoefficient; FILTER_TERMS],
    acceleration: [N::FilterCoefficient; FILTER_TERMS],
    by_force: [[N::Slope; 3]; 3],
    by_acceleration: [[N::Slope; 3]; 3],
    largest_acceleration: N::Increment,
    limit: N::Increment,
    acts: bool,
}

/// The last increments of both kinds, and E.
#[derive(Debug, Clone, Copy, Default)]
pub struct ElasticRateState<N: NumberSystem> {
    /// V_k.
    velocity: [N::Increment; 3],
    /// V_{k−1}, V_{k−2}, V_{k−3}, by axis.
    velocities: [[N::Increment; FILTER_TERMS - 1]; 3],
    /// D_{k−1}, D_{k−2}, D_{k−3}, by axis.
    increments: [[N::Increment; FILTER_TERMS - 1]; 3],
    ends: Ends<N>,
}

/// Rows of nine values times −`factor`, if each row's sum times `reach` fits half of E; the error names the kind.
#[inline(never)]
fn rows(
    parameters: &Parameters,
    kind: TermKind,
    factor: f64,
    reach: f64,
) -> Result<[[f64; 3]; 3], ParameterError> {
    let mut values = parameters.terms.values::<9>(kind);
    scale(&mut values, -factor);
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = values;
    let rows = [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]];
    for row in &rows {
        let mut sum = 0.0;
        for value in row {
            sum += value.abs();
        }
        // Written so that NaN fails; the row's limit holds for each value.
        if !(sum * reach <= 0.5 * LARGEST_AHEAD && sum <= SLOPE_LIMIT / 8.0) {
            return Err(ParameterError::Term(kind));
        }
    }
    Ok(rows)
}

impl<N: NumberSystem> ElasticRate<N> {
    /// E from the latest increments and those before them.
    #[inline(always)]
    fn ahead(
        &self,
        state: &ElasticRateState<N>,
        increments: [N::Increment; 3],
    ) -> [N::Increment; 3] {
        let (mut force, mut acceleration) =
            ([N::Increment::default(); 3], [N::Increment::default(); 3]);
        for axis in 0..3 {
            let [one, two, three] = state.velocities[axis];
            let last = [state.velocity[axis], one, two, three];
            force[axis] = N::filtered(N::filter(&self.force, last));
            let [one, two, three] = state.increments[axis];
            let last = [increments[axis], one, two, three];
            let eighth = N::filtered(N::filter(&self.acceleration, last));
            let none = N::Increment::default();
            acceleration[axis] = N::difference_within(eighth, none, self.largest_acceleration);
        }
        let mut ahead = [N::Increment::default(); 3];
        for (gyro, ahead) in ahead.iter_mut().enumerate() {
            for axis in 0..3 {
                *ahead = N::add_scaled(*ahead, self.by_force[gyro][axis], force[axis]);
                let factor = self.by_acceleration[gyro][axis];
                *ahead = N::add_scaled(*ahead, factor, acceleration[axis]);
            }
        }
        ahead
    }
}

impl<N: NumberSystem> Term<N> for ElasticRate<N> {
    type State = ElasticRateState<N>;
    const KINDS: TermKinds =
        TermKinds::of(&[TermKind::ElasticRateByForce, TermKind::ElasticRateByJerk]);
    const FOLLOWS_FORCE: bool = true;

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        use TermKind as K;
        let rate = parameters.sample_rate_hz;
        let kind = K::ElasticRateByForce;
        let by_force = rows(parameters, kind, VELOCITY_UNIT_M_S * rate, LARGEST_FORCE)?;
        if by_force != [[0.0; 3]; 3] && parameters.accelerometers.is_none() {
            return Err(ParameterError::TermNeedsAccelerometers(kind));
        }
        let kind = K::ElasticRateByJerk;
        let by_acceleration = rows(parameters, kind, rate * rate, ACCELERATION_LIMIT_RAD)?;
        let acts = by_force != [[0.0; 3]; 3] || by_acceleration != [[0.0; 3]; 3];
        Ok(Self {
            force: HALF_FORCE.map(N::filter_coefficient),
            acceleration: EIGHTH_ACCELERATION.map(N::filter_coefficient),
            by_force: by_force.map(|row| row.map(|u| N::slope(2.0 * u))),
            by_acceleration: by_acceleration.map(|row| row.map(|w| N::slope(8.0 * w))),
            largest_acceleration: N::increment(ACCELERATION_LIMIT_RAD / 8.0),
            limit: N::increment(RESPONSE_LIMIT_RAD),
            acts,
        })
    }

    fn largest_addition(&self) -> f64 {
        if self.acts { RESPONSE_LIMIT_RAD } else { 0.0 }
    }

    #[inline(always)]
    fn force(&self, state: &mut ElasticRateState<N>, velocities: Triad<N::Increment>) {
        state.velocity = velocities.to_array();
    }

    fn begin(&self, state: &mut ElasticRateState<N>, increments: Triad<N::Increment>) {
        let increments = increments.to_array();
        state.velocities = state.velocity.map(|now| [now; FILTER_TERMS - 1]);
        state.increments = increments.map(|now| [now; FILTER_TERMS - 1]);
        let ahead = self.ahead(state, increments);
        state.ends.begin(ahead);
    }

    #[inline(always)]
    fn increments(
        &self,
        state: &mut ElasticRateState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let mut corrected = increments.to_array();
        let ahead = self.ahead(state, corrected);
        for axis in 0..3 {
            let now = corrected[axis];
            corrected[axis] = N::add(now, state.ends.gain(axis, ahead[axis], self.limit));
            let [one, two, _] = state.velocities[axis];
            state.velocities[axis] = [state.velocity[axis], one, two];
            let [one, two, _] = state.increments[axis];
            state.increments[axis] = [now, one, two];
        }
        Triad::from_array(corrected)
    }

    #[inline(always)]
    fn angles(
        &self,
        state: &mut ElasticRateState<N>,
        sums: &PeriodSums,
        angles: [i64; 3],
    ) -> [i64; 3] {
        state.ends.sum(sums.unit_log2, angles)
    }

    fn discontinue(&self, state: &mut ElasticRateState<N>) {
        state.ends.current = false;
    }

    fn degrade(&self, state: &mut ElasticRateState<N>, rates_known: bool) {
        state.ends.unknown = !rates_known;
    }
}
