//! Increments removed before the search: explained beforehand, or too narrow for the terms of the noise.

use rlg_signal::streams::{Triad, add_triad};

/// Increments removed from a residual \[rad\]; empty if none.
#[derive(Debug, Clone, Default)]
pub struct Aside {
    /// Explained increments.
    pub explained_rad: Triad,
    /// Unexplained increments.
    pub unexplained_rad: Triad,
}

impl Aside {
    /// Adds the unexplained increments to the residual of a search.
    pub fn with_unexplained(&self, left_rad: &Triad) -> Triad {
        let mut whole = left_rad.clone();
        add_triad(&mut whole, &self.unexplained_rad, 1.0);
        whole
    }

    /// Adds all increments to the initial residual of a search.
    pub fn with_all(&self, residual_rad: &Triad) -> Triad {
        let mut whole = self.with_unexplained(residual_rad);
        add_triad(&mut whole, &self.explained_rad, 1.0);
        whole
    }
}
