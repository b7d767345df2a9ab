//! Plans of real Fourier transforms.
//!
//! A plan's twiddles cost as much as several transforms: a length is planned once and shared as long as anybody holds it,
//! and forgotten after, so that a campaign over recordings of many lengths does not keep them all.

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::sync::{Arc, Mutex, PoisonError, Weak};

type Shared<T> = Mutex<Vec<(usize, Weak<T>)>>;

static FORWARD: Shared<dyn RealToComplex<f64>> = Mutex::new(Vec::new());
static INVERSE: Shared<dyn ComplexToReal<f64>> = Mutex::new(Vec::new());

/// The transform of `length` rows.
pub fn forward(length: usize) -> Arc<dyn RealToComplex<f64>> {
    shared(&FORWARD, length, |planner| planner.plan_fft_forward(length))
}

/// The way back to `length` rows.
pub fn inverse(length: usize) -> Arc<dyn ComplexToReal<f64>> {
    shared(&INVERSE, length, |planner| planner.plan_fft_inverse(length))
}

fn shared<T: ?Sized>(
    plans: &Shared<T>,
    length: usize,
    plan: impl FnOnce(&mut RealFftPlanner<f64>) -> Arc<T>,
) -> Arc<T> {
    // A plan is whole or not there: one that panicked left nothing behind.
    let mut plans = plans.lock().unwrap_or_else(PoisonError::into_inner);
    plans.retain(|(_, held)| held.strong_count() > 0);
    let known = plans.iter().find(|(known, _)| *known == length);
    if let Some(known) = known.and_then(|(_, held)| held.upgrade()) {
        return known;
    }
    let fresh = plan(&mut RealFftPlanner::new());
    plans.push((length, Arc::downgrade(&fresh)));
    fresh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_shared_while_it_is_held() {
        const ROWS: usize = 2 * 3 * 5 * 7 * 11;
        let first = forward(ROWS);
        assert!(Arc::ptr_eq(&first, &forward(ROWS)));
        let mut values = first.make_input_vec();
        values[1] = 1.0;
        let mut bins = first.make_output_vec();
        first
            .process(&mut values, &mut bins)
            .expect("lengths of the plan");
        let back = inverse(ROWS);
        let mut again = back.make_output_vec();
        back.process(&mut bins, &mut again)
            .expect("lengths of the plan");
        assert!((again[1] / ROWS as f64 - 1.0).abs() < 1e-12 && again[0].abs() < 1e-9);
    }
}
