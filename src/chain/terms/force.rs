//! Corrects the gyros' bias by specific force: the excess rate under a force along any axis.
//!
//! It takes the velocity that accelerometers sensed over the output period \[fine units of velocity\], body frame, and
//! gives the period's angles about the sensing axes \[fine units\] less Σ_j G_ij ∫ f_j dt. The bias is linear in the
//! force, so the exact sums take it: a sample costs nothing, and vibration rectifies nothing.
//!
//! The force is that at the accelerometers' places; their size effect times G is left out (1e-8 of a rate).

use crate::chain::design_parameters::BIAS_BY_FORCE_LIMIT;
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{ExactCoefficient, VELOCITY_UNIT_M_S};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds};

/// Configuration: −G, rows by gyro \[rad per unit of velocity\].
#[derive(Debug, Clone, Copy)]
pub struct BiasByForce([[ExactCoefficient; 3]; 3]);

impl<N: NumberSystem> Term<N> for BiasByForce {
    type State = ();
    const KINDS: TermKinds = TermKinds::of(&[TermKind::GyroGBias]);
    const NEEDS_FORCE: bool = true;

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let kind = TermKind::GyroGBias;
        let mut values = parameters.terms.values::<9>(kind);
        let most = largest(&values);
        // Written so that NaN fails.
        if !(0.0..=BIAS_BY_FORCE_LIMIT).contains(&most) {
            return Err(ParameterError::Term(kind));
        }
        if most != 0.0 && parameters.accelerometers.is_none() {
            return Err(ParameterError::TermNeedsAccelerometers(kind));
        }
        scale(&mut values, -VELOCITY_UNIT_M_S);
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = values.map(ExactCoefficient::of);
        Ok(Self([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]))
    }

    #[inline(always)]
    fn angles(&self, (): &mut (), sums: &PeriodSums, mut angles: [i64; 3]) -> [i64; 3] {
        for (angle, row) in angles.iter_mut().zip(&self.0) {
            for (factor, velocity) in row.iter().zip(sums.velocity) {
                *angle = angle.wrapping_add(factor.times(velocity));
            }
        }
        angles
    }
}
