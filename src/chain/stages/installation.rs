//! Holds the installation matrix at rest, ε_ij0 of Eq. (7), in both forms in which it is used.
//!
//! Its change by the acceleration, Eq. (6), is [`flexure`](crate::chain::stages::flexure)'s.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactCoefficient;
use crate::chain::parameters::Parameters;
use crate::chain::triad::CrossAxis;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Installation<N: NumberSystem> {
    at_rest: CrossAxis<N::Coefficient>,
    exact_at_rest: CrossAxis<ExactCoefficient>,
}

impl<N: NumberSystem> Installation<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self {
            at_rest: parameters.installation_rad.map(N::coefficient),
            exact_at_rest: parameters.installation_rad.map(ExactCoefficient::of),
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
}
