//! Corrects the gyros' bias by the magnetic field: Σ_j c_ij B_j.
//!
//! It takes slow readings \[T\] and gives bias \[fine units per sample\], so that a sample costs nothing. The field of a
//! reading holds until the next one: where the unit turns in it, the readings' rate must follow.

use crate::chain::design_parameters::{BIAS_LIMIT_RAD_S, MAGNETIC_FIELD_LIMIT_T};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::fine_of_f32;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::scale;
use crate::chain::terms::{SlowReadings, Term, TermKind, TermKinds};

/// Configuration: c T, rows by gyro \[rad/T\].
#[derive(Debug, Clone, Copy)]
pub struct MagneticBias([[f32; 3]; 3]);

/// Bias by the latest reading \[fine units per sample\].
#[derive(Debug, Clone, Copy, Default)]
pub struct MagneticBiasState([i64; 3]);

impl<N: NumberSystem> Term<N> for MagneticBias {
    type State = MagneticBiasState;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::GyroBiasMagnetic]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let kind = TermKind::GyroBiasMagnetic;
        let mut values = parameters.terms.values::<9>(kind);
        // Three of them act on a gyro. Written so that NaN fails.
        let fits = values.chunks_exact(3).all(|row| {
            let most: f64 = row.iter().map(|value| value.abs()).sum();
            most * f64::from(MAGNETIC_FIELD_LIMIT_T) <= BIAS_LIMIT_RAD_S
        });
        if !fits {
            return Err(ParameterError::Term(kind));
        }
        scale(&mut values, 1.0 / parameters.sample_rate_hz);
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = values.map(|c| c as f32);
        Ok(Self([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]))
    }

    #[inline(always)]
    fn bias(&self, state: &MagneticBiasState) -> [i64; 3] {
        state.0
    }

    #[inline(always)]
    fn take_slow(&self, state: &mut MagneticBiasState, prepared: &MagneticBiasState) {
        *state = *prepared;
    }

    /// Takes slow readings; one beyond [`MAGNETIC_FIELD_LIMIT_T`] leaves the correction as it is.
    fn slow(&self, state: &mut MagneticBiasState, readings: &SlowReadings) {
        let field = readings.magnetic_field_t;
        // Written so that NaN fails.
        if !field.iter().all(|b| b.abs() <= MAGNETIC_FIELD_LIMIT_T) {
            return;
        }
        for (bias, [x, y, z]) in state.0.iter_mut().zip(self.0) {
            *bias = fine_of_f32(x * field[0] + y * field[1] + z * field[2]);
        }
    }
}
