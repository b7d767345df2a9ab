//! Angular acceleration → the installation matrix of this sample, Eq. (6).
//!
//! Enters: α̂ T² \[rad per sample²\] of the case, body frame. Leaves: ε_ij \[rad\], the six small angles of
//! Eq. (7).
//!
//! A tilt δ_ij = −K_ij α_j turns gyro i's sensing axis about body axis j, and gyro x then senses
//! δ_xz ω_y − δ_xy ω_z more (y: δ_yx ω_z − δ_yz ω_x, z: δ_zy ω_x − δ_zx ω_y). Eq. (7) undoes this with ε_xy on the z rate, so
//! ε_xy = +δ_xy, ε_xz = −δ_xz, ε_yz = +δ_yz, ε_yx = −δ_yx, ε_zx = +δ_zx, ε_zy = −δ_zy, each added to ε_ij0.
//!
//! Eq. (6) as printed has ε_ij = ε_ij0 − K_ij α_j for all six. Read literally, coning of 0.367° at 15 Hz with
//! the paper's Table 3 would drift by 0.007 °/h; the paper measured 0.5 °/h, and these signs give 0.495
//! (`host-tests/tests/core_chain/signs.rs` shows both).
//!
//! It assumes that the block follows quasi-statically (suspension modes far above the motion).

use crate::numbers::NumberSystem;
use crate::parameters::Parameters;
use crate::triad::{CrossAxis, Triad};

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Installation<N: NumberSystem> {
    at_rest: CrossAxis<N::Coefficient>,
    /// K_ij / T².
    flexure: CrossAxis<N::Flexure>,
}

impl<N: NumberSystem> Installation<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let rate_squared = parameters.sample_rate_hz * parameters.sample_rate_hz;
        Self {
            at_rest: parameters.installation_rad.map(N::coefficient),
            flexure: parameters.flexure_s2.map(|k| N::flexure(k * rate_squared)),
        }
    }

    /// ε_ij0: the matrix without acceleration.
    #[inline(always)]
    pub fn at_rest(&self) -> &CrossAxis<N::Coefficient> {
        &self.at_rest
    }

    /// ε_ij under this acceleration.
    #[inline(always)]
    pub fn process(&self, acceleration: Triad<N::Acceleration>) -> CrossAxis<N::Coefficient> {
        let (rest, k) = (&self.at_rest, &self.flexure);
        CrossAxis {
            xy: rest.xy - N::tilt(k.xy, acceleration.y),
            xz: rest.xz + N::tilt(k.xz, acceleration.z),
            yx: rest.yx + N::tilt(k.yx, acceleration.x),
            yz: rest.yz - N::tilt(k.yz, acceleration.z),
            zx: rest.zx - N::tilt(k.zx, acceleration.x),
            zy: rest.zy + N::tilt(k.zy, acceleration.y),
        }
    }
}
