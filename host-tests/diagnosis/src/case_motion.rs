//! Estimates the motion from which columns are computed, independent of the residual's noise.

use rlg_plan::{CataloguePlan, Plan};
use std::sync::Arc;

use nalgebra::Matrix3;
use rlg_catalogue::Signals;
use rlg_catalogue::signals::{CaseMotion, Motions, Path};
use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::conditioned::{noise_expected, noise_left, weights};
use rlg_signal::reference_noise::{NoiseTerm, measure};
use rlg_signal::shrinkage::{Powers, Shrunk, shrink};

use super::data::Data;
use rlg_signal::streams::{Triad, each_axis, weighted_sum};

/// Estimated motion, and the noise of the reference estimated with it.
pub struct Motion {
    /// Signals from which columns are computed.
    pub signals: Signals,
    /// True for axes that move beyond the reference's noise.
    pub is_moving: [bool; 3],
    /// Standard deviation of the residual noise in each axis' rate, if it moves \[rad/s\].
    pub rate_noise_rad_s: [f64; 3],
    /// Power of the reference's white rate noise per row \[rad²\], estimated given its declaration, with its standard
    /// deviation.
    pub reference_walk: [Level; 3],
    /// The same of its white angle noise \[rad²\].
    pub reference_angle: [Level; 3],
}

/// A noise power.
#[derive(Debug, Clone, Copy, Default)]
pub struct Level {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Estimates the motion of the recording, see [`estimate_from`].
pub fn estimate(
    data: &Data,
    clean_rad: &Triad,
    levels: &[NoiseLevels],
    seen: &[bool],
    path: Path,
    plan: &Plan,
) -> Motion {
    let measured = Measured {
        reference_rad: Arc::clone(&data.reference_rad),
        dither_rad: data.dither_rad.as_ref(),
    };
    estimate_from(data, measured, clean_rad, levels, seen, path, plan)
}

/// Measured motion.
#[derive(Debug, Clone)]
pub struct Measured<'a> {
    /// Increments of the case by the reference \[rad\], after the path of the model.
    pub reference_rad: Arc<Triad>,
    /// Increments of the blocks against the case by the pickoffs \[rad\].
    pub dither_rad: Option<&'a Triad>,
}

/// Estimates the motion.
///
/// # Inputs
/// `measured`: motion of the recording or of a parametric bootstrap; `clean_rad`: residual without all that is explained,
/// bridged over rows that may not be used; `levels`: its noise; `seen`: its rows that may be used; `path`: estimated path
/// between the reference and each gyro.
pub fn estimate_from(
    data: &Data,
    measured: Measured,
    clean_rad: &Triad,
    levels: &[NoiseLevels],
    seen: &[bool],
    path: Path,
    plan: &Plan,
) -> Motion {
    let streams = data.streams;
    if streams.at_rest.is_some() {
        return of_the_earth(data, measured, path, &plan.catalogue);
    }
    let rows = streams.rows;
    let rate_hz = streams.rate_hz;
    let whole = Observations::separate(&vec![true; rows], 1);
    let basis = NoiseBasis::new(&whole);
    let dct = Dct::new(rows);
    let shape = |levels: NoiseLevels| basis.by_coefficient(levels);
    let reference = data.model.reference.clone().unwrap_or_default();
    let walk = reference
        .angle_random_walk_rad_sqrt_s
        .unwrap_or(0.0)
        .powi(2)
        / rate_hz;
    let angle = reference.angle_noise_rad.unwrap_or(0.0).powi(2);
    // Each residual holds the reference's noise as its gyro senses it; noise on an axis of the reference follows from all
    // three.
    let reading_from_sensed = data.shared().try_inverse();
    let reading_from_sensed = reading_from_sensed.unwrap_or_else(Matrix3::identity);
    let gate = &plan.signal.gate;
    let of_axis = |axis: usize| {
        let weights_of = [0, 1, 2].map(|gyro| reading_from_sensed[(axis, gyro)]);
        let clean_on_axis_rad = weighted_sum(weights_of, clean_rad);
        let levels_on_axis = levels_of(weights_of, levels);
        let noise = shape(levels_on_axis);
        // A noise not declared, or declared 0, is unknown: its shape has a power of 1 rad² a row.
        let power = |declared: f64| if declared > 0.0 { declared } else { 1.0 };
        // The path filters the reference's noise as it filters the motion.
        let passed: Option<Vec<f64>> = (!path.is_direct(axis)).then(|| {
            let hz = |k: usize| 0.5 * rate_hz * k as f64 / rows as f64;
            (0..rows)
                .map(|k| path.response(axis, hz(k)).norm_sqr())
                .collect()
        });
        let behind = |levels: NoiseLevels| {
            let mut shape = basis.by_coefficient(levels);
            for (power, passed) in shape.iter_mut().zip(passed.iter().flatten()) {
                *power *= passed;
            }
            shape
        };
        let terms = [
            NoiseTerm {
                shape: behind(NoiseLevels {
                    white: power(walk),
                    ..NoiseLevels::default()
                }),
                is_declared: walk > 0.0,
            },
            NoiseTerm {
                shape: behind(NoiseLevels {
                    angle: power(angle),
                    ..NoiseLevels::default()
                }),
                is_declared: angle > 0.0,
            },
        ];
        let m = path.along(axis, &measured.reference_rad[axis], rate_hz);
        let shares = measure(
            (&m, &clean_on_axis_rad),
            &terms,
            &noise,
            seen,
            rate_hz,
            plan.judgement.reference_std,
            (&plan.signal.reference_noise, &gate.frames),
        );
        let mut of_reference = vec![0.0; rows];
        let mut uncertain = vec![0.0; rows];
        // Relative standard deviation of the residual's own levels, from as many rows.
        let of_fit = (2.0 / rows as f64).sqrt();
        for (term, share) in terms.iter().zip(&shares) {
            let sums = of_reference.iter_mut().zip(&mut uncertain);
            for ((sum, uncertain), power) in sums.zip(&term.shape) {
                *sum += share.share * power;
                *uncertain += (share.std + share.share * of_fit) * power;
            }
        }
        // The residual used for conditioning holds the reference's noise after the path, the fitted levels hold it before.
        let mut own = noise.clone();
        for (term, share) in terms.iter().zip(&shares) {
            let powers = own.iter_mut().zip(&term.shape);
            for ((own, power), passed) in powers.zip(passed.iter().flatten()) {
                *own -= share.share * power * (1.0 / passed.max(f64::MIN_POSITIVE) - 1.0);
            }
        }
        drop(terms);
        // The residual holds the reference's noise, which cannot exceed it.
        for k in 0..rows {
            own[k] = own[k].max(of_reference[k].min(noise[k]));
            of_reference[k] = of_reference[k].min(own[k]);
            uncertain[k] = uncertain[k].min(own[k]);
        }
        let toward = weights(&of_reference, &own);
        let conditioned = add_filtered(&m, &clean_on_axis_rad, &toward, &dct);
        drop(m);
        let left = noise_left(&of_reference, &uncertain, &toward, &own, gate);
        let expected = noise_expected(&of_reference, &toward, &own, gate);
        drop((toward, own));
        let powers = Powers {
            left: &left,
            expected: &expected,
            before: &of_reference,
            uncertain: &uncertain,
            residual: &noise,
        };
        let shrunk = shrink(&conditioned, &powers, seen, rate_hz, gate);
        drop((conditioned, left, expected, of_reference, uncertain));
        let level = |term: usize, power: f64, own: f64| Level {
            value: (shares[term].share * power).min(own),
            std: (shares[term].std * power).min(own),
        };
        let dither = measured.dither_rad.map(|dither| {
            let pickoff = NoiseLevels {
                angle: data.model.pickoff_white_rad2(axis),
                ..NoiseLevels::default()
            };
            let toward = weights(&shape(pickoff), &shape(levels[axis]));
            add_filtered(&dither[axis], &clean_rad[axis], &toward, &dct)
        });
        OfAxis {
            shrunk,
            walk: level(0, power(walk), levels_on_axis.white),
            angle: level(1, power(angle), levels_on_axis.angle),
            dither,
        }
    };
    let axes = each_axis(of_axis);
    drop(dct);
    let is_moving = std::array::from_fn(|axis| {
        let shrunk = &axes[axis].shrunk;
        shrunk.kept >= plan.judgement.least_cells
            && !data.lattice.hides_motion(axis, &shrunk.values)
    });
    let rate_noise_rad_s = std::array::from_fn(|axis| axes[axis].shrunk.noise.sqrt() * rate_hz);
    let reference_walk = std::array::from_fn(|axis| axes[axis].walk);
    let reference_angle = std::array::from_fn(|axis| axes[axis].angle);
    let [x, y, z] = axes;
    let motions = Motions {
        measured_rad: measured.reference_rad,
        independent: CaseMotion::new([x.shrunk.values, y.shrunk.values, z.shrunk.values], rate_hz),
        likeliest: CaseMotion::new(
            [x.shrunk.likeliest, y.shrunk.likeliest, z.shrunk.likeliest],
            rate_hz,
        ),
        dither_rad: match (x.dither, y.dither, z.dither) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        },
    };
    Motion {
        is_moving,
        rate_noise_rad_s,
        reference_walk,
        reference_angle,
        signals: signals(data, motions, path, &plan.catalogue),
    }
}

/// Signals from which columns are computed, of the estimated motion.
pub(crate) fn signals(data: &Data, motions: Motions, path: Path, plan: &CataloguePlan) -> Signals {
    Signals::new(
        data.streams.rate_hz,
        motions,
        data.inputs(),
        path,
        data.model.gyro.scale_error,
        (data.sensing_from_body, data.shared()),
        plan,
    )
}

/// Motion of a unit at rest: the Earth's rotation, noise-free, with no moving axis.
fn of_the_earth(data: &Data, measured: Measured, path: Path, plan: &CataloguePlan) -> Motion {
    let rate_hz = data.streams.rate_hz;
    let dither_rad = measured.dither_rad.cloned();
    let motions = Motions::of_one(measured.reference_rad, dither_rad, rate_hz);
    Motion {
        is_moving: [false; 3],
        rate_noise_rad_s: [0.0; 3],
        reference_walk: [Level::default(); 3],
        reference_angle: [Level::default(); 3],
        signals: signals(data, motions, path, plan),
    }
}

/// Noise levels of a weighted sum of gyros.
pub(crate) fn levels_of(weights: [f64; 3], levels: &[NoiseLevels]) -> NoiseLevels {
    NoiseLevels::from_array(std::array::from_fn(|term| {
        let each = weights.iter().zip(levels);
        each.map(|(weight, levels)| weight * weight * levels.as_array()[term])
            .sum()
    }))
}

/// Estimates on one axis.
struct OfAxis {
    shrunk: Shrunk,
    walk: Level,
    angle: Level,
    dither: Option<Vec<f64>>,
}

/// Computes `values` plus `residual` through a filter given by DCT-II coefficient.
pub(crate) fn add_filtered(
    values: &[f64],
    residual: &[f64],
    filter: &[f64],
    dct: &Dct,
) -> Vec<f64> {
    let mut filtered = residual.to_vec();
    dct.forward(&mut filtered);
    for (value, weight) in filtered.iter_mut().zip(filter) {
        *value *= weight;
    }
    dct.inverse(&mut filtered);
    values.iter().zip(&filtered).map(|(a, b)| a + b).collect()
}
