//! What a selection needs of the data, whatever they are compared with: increments row by row
//! ([`super::workbench::Workbench`]) or specific force.
//!
//! Enters: effects and where they are linearised. Leaves: [`Information`] over all parameters of the catalogue,
//! the sizes of found terms behind them. Deliberately not here: rows, bins, stamps, shapes of noise.

use super::hypotheses::Sought;
use super::information::Information;

/// Data under a noise model, linearised at some values of the effects.
pub trait Bench {
    /// What the model declares of the noise.
    type Declared: ?Sized;

    /// Information about all parameters whose columns are here.
    fn information(&self) -> Information;

    /// The same about the given parameters only; what it says of others is nothing.
    fn information_about(&self, _indices: &[usize]) -> Information {
        self.information()
    }

    /// The values at which each effect of the catalogue is linearised; none where that never moves.
    fn at(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Moves the point at which a nonlinear effect is linearised.
    fn relinearise(&mut self, effect: usize, at: &[f64]);

    /// Puts every nonlinear effect back to being linearised at nothing.
    fn linearise_at_nothing(&mut self) {
        for effect in 0..self.at().len() {
            let at = &self.at()[effect];
            if at.iter().any(|value| *value != 0.0) {
                let nothing = vec![0.0; at.len()];
                self.relinearise(effect, &nothing);
            }
        }
    }

    /// Refits the noise to what `effects` leave, from where it is.
    fn refit_noise(&mut self, effects: &[usize], declared: &Self::Declared);

    /// Where to begin with an effect that must be sought, in what `values` leave; nowhere by default.
    fn seek(&self, _effect: usize, _values: &[(usize, f64)]) -> Option<Sought> {
        None
    }
}
