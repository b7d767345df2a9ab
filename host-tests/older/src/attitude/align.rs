//! How a reference's clock and frame lie when they lie far off: the coarse search.
//!
//! Enters: the gyros' path and the samples. Leaves: [`Lie`], or nothing where the reference lies close enough for
//! the hypotheses `reference_delay` and `reference_misalignment` to find it as any other effect.
//!
//! Between two samples the gyros turn by φ and the reference by φ_ref = Rᵀ φ, R the reference's turn: for every
//! delay on a grid Σ |φ_ref − Rᵀφ|² is formed, with R nothing or, where that never fits, the best rotation (Wahba's
//! problem, by singular values). Gauss–Newton refines from there. A single attitude before and after has no clock.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

use super::path::Path;
use super::record::Lie;
use super::samples::SlowSample;

/// The farthest clock that is looked for \[s\].
pub const FARTHEST_S: f64 = 0.6;

/// Closer than this a delay is linear enough for the catalogue's own search.
const NEAR_S: f64 = 2e-3;

/// The same for a turn.
const NEAR_RAD: f64 = 0.01;

/// Pairs of samples that are compared; more would not find it better than Gauss–Newton does.
const MOST_PAIRS: usize = 600;
const LEAST_PAIRS: usize = 30;

/// Samples further apart than this say more of drift than of the clock \[s\].
const LONGEST_STEP_S: f64 = 3.0;

/// What is left at the best delay, against what is left where the stamps are believed.
const BETTER: f64 = 0.5;

/// Variances by which the best delay must win.
const CLEAR: f64 = 50.0;

/// Searches.
pub fn coarse(
    path: &Path,
    samples: &[SlowSample],
    usable: &[bool],
    rate_hz: f64,
    edge_hz: f64,
) -> Option<Lie> {
    let inside = |sample: &SlowSample| {
        let margin = FARTHEST_S * rate_hz;
        let place = path.place(sample.time_s);
        path.reaches(place - margin) && path.reaches(place + margin)
    };
    let pairs: Vec<(f64, f64, Vector3<f64>)> = samples
        .windows(2)
        .filter(|pair| !pair[1].after_gap && inside(&pair[0]) && inside(&pair[1]))
        .filter(|pair| pair[1].time_s - pair[0].time_s < LONGEST_STEP_S)
        .filter(|pair| pair[1].time_s > pair[0].time_s)
        .filter(|pair| {
            let (from, to) = (path.place(pair[0].time_s), path.place(pair[1].time_s));
            !usable[from.floor() as usize..(to.ceil() as usize).min(usable.len())].contains(&false)
        })
        .map(|pair| {
            (
                path.place(pair[0].time_s),
                path.place(pair[1].time_s),
                pair[0].shown.turn_to(&pair[1].shown),
            )
        })
        .collect();
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let every = pairs.len().div_ceil(MOST_PAIRS);
    let pairs: Vec<_> = pairs.into_iter().step_by(every).collect();
    let looks = |delay_s: f64| Look::at(path, &pairs, delay_s * rate_hz);
    let step_s = (0.1 / edge_hz).min(NEAR_S);
    let count = (FARTHEST_S / step_s).ceil() as i64;
    let search = |left: &(dyn Fn(&Look) -> f64 + Sync)| -> (f64, f64) {
        let grid: Vec<(f64, f64)> = (-count..=count)
            .into_par_iter()
            .map(|k| {
                let delay_s = k as f64 * step_s;
                (delay_s, left(&looks(delay_s)))
            })
            .collect();
        grid.into_iter()
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.abs().total_cmp(&b.0.abs())))
            .expect("the grid holds zero")
    };
    let mut best = search(&Look::left_unturned);
    let mut turned = false;
    /// A share of the motion that no instrument error leaves.
    const MISFIT: f64 = 0.05;
    if best.1 > MISFIT * looks(best.0).energy {
        let free = search(&Look::left_turned);
        if free.1 < BETTER * best.1 {
            (best, turned) = (free, true);
        }
    }
    let look = looks(best.0);
    let as_stamped = looks(0.0);
    let there = if turned {
        as_stamped.left_turned()
    } else {
        as_stamped.left_unturned()
    };
    let variance = best.1 / (3.0 * pairs.len() as f64);
    let clear = there - best.1 > CLEAR * variance && best.1 < BETTER * there;
    let delay_s = if clear && best.0.abs() >= NEAR_S {
        best.0
    } else {
        0.0
    };
    let look = if delay_s == 0.0 { as_stamped } else { look };
    let turn_rad = look.turn().filter(|turn| {
        turn.norm() > NEAR_RAD
            && look.left_turned() < BETTER * look.left_unturned()
            && look.left_unturned() - look.left_turned() > CLEAR * variance
    });
    (delay_s != 0.0 || turn_rad.is_some()).then(|| Lie {
        delay_s,
        turn_rad: turn_rad.unwrap_or_else(Vector3::zeros),
    })
}

/// Sums over the pairs at one delay.
struct Look {
    energy: f64,
    /// Σ φ φ_refᵀ.
    moment: Matrix3<f64>,
}

impl Look {
    fn at(path: &Path, pairs: &[(f64, f64, Vector3<f64>)], delay_rows: f64) -> Self {
        let mut look = Self {
            energy: 0.0,
            moment: Matrix3::zeros(),
        };
        for (from, to, reference) in pairs {
            let own = path
                .shown(from - delay_rows)
                .turn_to(&path.shown(to - delay_rows));
            look.energy += own.norm_squared() + reference.norm_squared();
            look.moment += own * reference.transpose();
        }
        look
    }

    fn left_unturned(&self) -> f64 {
        (self.energy - 2.0 * self.moment.trace()).max(0.0)
    }

    fn left_turned(&self) -> f64 {
        let rotation = self
            .rotation()
            .map_or_else(Matrix3::identity, |r| *r.matrix());
        (self.energy - 2.0 * (rotation.transpose() * self.moment).trace()).max(0.0)
    }

    /// φ = R φ_ref, where turns about two axes fix it.
    fn rotation(&self) -> Option<Rotation3<f64>> {
        /// Second singular value over the first below which the motion is about one axis only.
        const ONE_AXIS: f64 = 1e-3;
        let svd = self.moment.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        if svd.singular_values[1] < ONE_AXIS * svd.singular_values[0] {
            return None;
        }
        let handed = (u * v_t).determinant().signum();
        let matrix = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handed)) * v_t;
        Some(Rotation3::from_matrix_unchecked(matrix))
    }

    fn turn(&self) -> Option<Vector3<f64>> {
        self.rotation().map(|rotation| rotation.scaled_axis())
    }
}
