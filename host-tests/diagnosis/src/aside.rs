//! What is not before the search: found beforehand, or too narrow for the terms of the noise.

use rlg_signal::streams::{Triad, add_triad};

/// Increments that were taken out of a residual \[rad\]; empty where nothing was.
#[derive(Debug, Clone, Default)]
pub struct Aside {
    /// What is explained.
    pub explained_rad: Triad,
    /// What is not.
    pub unexplained_rad: Triad,
}

impl Aside {
    /// Adds what is not explained to what a search leaves.
    pub fn with_unexplained(&self, left_rad: &Triad) -> Triad {
        let mut whole = left_rad.clone();
        add_triad(&mut whole, &self.unexplained_rad, 1.0);
        whole
    }

    /// Adds everything to what a search begins with.
    pub fn with_all(&self, residual_rad: &Triad) -> Triad {
        let mut whole = self.with_unexplained(residual_rad);
        add_triad(&mut whole, &self.explained_rad, 1.0);
        whole
    }
}
