//! Forms the installation matrix of each sample from the angular acceleration, Eq. (6).
//!
//! It takes α̂ T² of the case \[increment units per sample²\], body frame, and gives ε_ij − ε_ij0 \[rad\], what the
//! acceleration adds to the six small angles of Eq. (7).
//!
//! A tilt δ_ij = −K_ij α_j turns gyro i's sensing axis about body axis j, and gyro x then senses
//! δ_xz ω_y − δ_xy ω_z more (y: δ_yx ω_z − δ_yz ω_x, z: δ_zy ω_x − δ_zx ω_y). Eq. (7) undoes this with ε_xy on the z rate, so
//! ε_xy = +δ_xy, ε_xz = −δ_xz, ε_yz = +δ_yz, ε_yx = −δ_yx, ε_zx = +δ_zx, ε_zy = −δ_zy, each added to ε_ij0.
//!
//! Eq. (6) as printed has ε_ij = ε_ij0 − K_ij α_j for all six. Read literally, coning of 0.367° at 15 Hz with
//! the paper's Table 3 would drift by 0.007 °/h; the paper measured 0.5 °/h, and these signs give 0.495
//! (`host-tests/firmware/tests/core_chain/signs.rs` shows both).
//!
//! # Assumptions
//! The block follows the acceleration quasi-statically: its suspension's modes are far above the motion.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactCoefficient;
use crate::chain::parameters::Parameters;
use crate::chain::triad::{CrossAxis, Triad};

/// K_ij/T², each with the sign with which its tilt enters Eq. (7).
pub type SignedFlexure<N> = CrossAxis<<N as NumberSystem>::Flexure>;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Installation<N: NumberSystem> {
    at_rest: CrossAxis<N::Coefficient>,
    exact_at_rest: CrossAxis<ExactCoefficient>,
    flexure: SignedFlexure<N>,
}

impl<N: NumberSystem> Installation<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let rate = parameters.sample_rate_hz;
        // Accelerations are counted in increment units, tilts in rad.
        let per_s2 = rate * rate * parameters.increment_unit_rad();
        let k = &parameters.flexure_s2;
        let signed = CrossAxis {
            xy: -k.xy,
            xz: k.xz,
            yx: k.yx,
            yz: -k.yz,
            zx: -k.zx,
            zy: k.zy,
        };
        Self {
            at_rest: parameters.installation_rad.map(N::coefficient),
            exact_at_rest: parameters.installation_rad.map(ExactCoefficient::of),
            flexure: signed.map(|k| N::flexure(k * per_s2)),
        }
    }

    /// ε_ij0: the matrix without acceleration, for products.
    #[inline(always)]
    pub fn at_rest(&self) -> &CrossAxis<N::Coefficient> {
        &self.at_rest
    }

    /// ε_ij0 for the exact sums.
    #[inline(always)]
    pub fn exact_at_rest(&self) -> &CrossAxis<ExactCoefficient> {
        &self.exact_at_rest
    }

    /// The flexure that follows from the parameters.
    pub fn flexure(&self) -> &SignedFlexure<N> {
        &self.flexure
    }
}

/// Forms the tilts ε_ij − ε_ij0 \[rad\] under this acceleration.
#[inline(always)]
pub fn process<N: NumberSystem>(
    flexure: &SignedFlexure<N>,
    acceleration: Triad<N::Acceleration>,
) -> CrossAxis<N::Tilt> {
    let (k, a) = (flexure, acceleration);
    CrossAxis {
        xy: N::tilt(k.xy, a.y),
        xz: N::tilt(k.xz, a.z),
        yx: N::tilt(k.yx, a.x),
        yz: N::tilt(k.yz, a.z),
        zx: N::tilt(k.zx, a.x),
        zy: N::tilt(k.zy, a.y),
    }
}
