//! Estimates the motion from which columns are computed, independent of the residual's noise.

use rlg_plan::{CataloguePlan, Plan};
use std::sync::Arc;

use nalgebra::Matrix3;
use rlg_catalogue::Signals;
use rlg_catalogue::signals::{CaseMotion, Motions, Path};
use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::conditioned::{noise_expected, noise_left, weights};
use rlg_signal::reference_noise::{MeasuredShare, NoiseTerm, measure};
use rlg_signal::shrinkage::{Powers, Shrunk, shrink};

use crate::rows::data::Data;
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
    /// Power of its white angle noise per row \[rad²\], likewise.
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
    let rate_hz = streams.rate_hz;
    let reference = data.model.reference.clone().unwrap_or_default();
    let walk = reference.angle_random_walk_rad_sqrt_s.unwrap_or(0.0);
    let reading_from_sensed = data.shared().try_inverse();
    let estimator = Estimator {
        basis: NoiseBasis::new(&Observations::separate(&vec![true; streams.rows], 1)),
        dct: Dct::new(streams.rows),
        declared: NoiseLevels {
            white: walk.powi(2) / rate_hz,
            angle: reference.angle_noise_rad.unwrap_or(0.0).powi(2),
            ..NoiseLevels::default()
        },
        reading_from_sensed: reading_from_sensed.unwrap_or_else(Matrix3::identity),
        measured: &measured,
        data,
        clean_rad,
        levels,
        seen,
        path,
        plan,
    };
    let axes = each_axis(|axis| estimator.on_axis(axis));
    drop(estimator);
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

/// Estimates on one axis.
struct OfAxis {
    shrunk: Shrunk,
    walk: Level,
    angle: Level,
    dither: Option<Vec<f64>>,
}

/// Noise on an axis, by DCT-II coefficient \[rad²\].
struct AxisNoise {
    /// Shares of the reference's noise terms.
    shares: Vec<MeasuredShare>,
    /// Reference.
    of_reference: Vec<f64>,
    /// Standard deviation of it.
    uncertain: Vec<f64>,
    /// Residual, by its fitted levels.
    residual: Vec<f64>,
    /// Residual, the reference's noise in it after the path.
    own: Vec<f64>,
}

/// Estimates of the motion axis by axis.
struct Estimator<'a> {
    data: &'a Data<'a>,
    measured: &'a Measured<'a>,
    clean_rad: &'a Triad,
    levels: &'a [NoiseLevels],
    seen: &'a [bool],
    path: Path,
    plan: &'a Plan,
    basis: NoiseBasis,
    dct: Dct,
    /// Declared noise of the reference, per row \[rad²\]; a noise that is not declared, or declared 0, is unknown.
    declared: NoiseLevels,
    /// Each residual holds the reference's noise as its gyro senses it; noise on an axis of the reference follows from all
    /// three.
    reading_from_sensed: Matrix3<f64>,
}

impl Estimator<'_> {
    fn on_axis(&self, axis: usize) -> OfAxis {
        let gate = &self.plan.signal.gate;
        let rate_hz = self.data.streams.rate_hz;
        let weights_of = [0, 1, 2].map(|gyro| self.reading_from_sensed[(axis, gyro)]);
        let clean_on_axis_rad = weighted_sum(weights_of, self.clean_rad);
        let levels = levels_of(weights_of, self.levels);
        let reference_rad = &self.measured.reference_rad[axis];
        let reference_rad = self.path.along(axis, reference_rad, rate_hz);
        let AxisNoise {
            shares,
            of_reference,
            uncertain,
            residual,
            own,
        } = self.noise_on(axis, &reference_rad, &clean_on_axis_rad, levels);
        let toward = weights(&of_reference, &own);
        let conditioned = add_filtered(&reference_rad, &clean_on_axis_rad, &toward, &self.dct);
        drop(reference_rad);
        let left = noise_left(&of_reference, &uncertain, &toward, &own, gate);
        let expected = noise_expected(&of_reference, &toward, &own, gate);
        drop((toward, own));
        let powers = Powers {
            left: &left,
            expected: &expected,
            before: &of_reference,
            uncertain: &uncertain,
            residual: &residual,
        };
        let shrunk = shrink(&conditioned, &powers, self.seen, rate_hz, gate);
        drop((conditioned, left, expected, of_reference, uncertain));
        let level = |term: usize, declared: f64, own: f64| Level {
            value: (shares[term].share * unit_power(declared)).min(own),
            std: (shares[term].std * unit_power(declared)).min(own),
        };
        OfAxis {
            shrunk,
            walk: level(0, self.declared.white, levels.white),
            angle: level(1, self.declared.angle, levels.angle),
            dither: self.dither(axis),
        }
    }

    /// Terms of the reference's noise after the path, which filters it as it filters the motion.
    fn terms(&self, passed: Option<&[f64]>) -> [NoiseTerm; 2] {
        let term = |levels: NoiseLevels, declared: f64| {
            let mut shape = self.basis.by_coefficient(levels);
            for (power, passed) in shape.iter_mut().zip(passed.into_iter().flatten()) {
                *power *= passed;
            }
            NoiseTerm {
                shape,
                is_declared: declared > 0.0,
            }
        };
        let NoiseLevels { white, angle, .. } = self.declared;
        let walk = NoiseLevels {
            white: unit_power(white),
            ..NoiseLevels::default()
        };
        let of_angle = NoiseLevels {
            angle: unit_power(angle),
            ..NoiseLevels::default()
        };
        [term(walk, white), term(of_angle, angle)]
    }

    /// Measures the reference's noise on an axis.
    ///
    /// # Inputs
    /// Increments of the reference after the path, and the residual on this axis \[rad\] with its fitted levels.
    fn noise_on(
        &self,
        axis: usize,
        reference_rad: &[f64],
        residual_rad: &[f64],
        levels: NoiseLevels,
    ) -> AxisNoise {
        let streams = self.data.streams;
        let (rows, rate_hz) = (streams.rows, streams.rate_hz);
        let residual = self.basis.by_coefficient(levels);
        let passed: Option<Vec<f64>> = (!self.path.is_direct(axis)).then(|| {
            let hz = |k: usize| 0.5 * rate_hz * k as f64 / rows as f64;
            (0..rows)
                .map(|k| self.path.response(axis, hz(k)).norm_sqr())
                .collect()
        });
        let terms = self.terms(passed.as_deref());
        let plan = &self.plan.signal;
        let shares = measure(
            (reference_rad, residual_rad),
            &terms,
            &residual,
            self.seen,
            rate_hz,
            self.plan.judgement.reference_std,
            (&plan.reference_noise, &plan.gate.frames),
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
        let mut own = residual.clone();
        for (term, share) in terms.iter().zip(&shares) {
            let powers = own.iter_mut().zip(&term.shape);
            for ((own, power), passed) in powers.zip(passed.iter().flatten()) {
                *own -= share.share * power * (1.0 / passed.max(f64::MIN_POSITIVE) - 1.0);
            }
        }
        // The residual holds the reference's noise, which cannot exceed it.
        for k in 0..rows {
            own[k] = own[k].max(of_reference[k].min(residual[k]));
            of_reference[k] = of_reference[k].min(own[k]);
            uncertain[k] = uncertain[k].min(own[k]);
        }
        AxisNoise {
            shares,
            of_reference,
            uncertain,
            residual,
            own,
        }
    }

    /// Increments of a block against the case, conditioned by the gyro's residual \[rad\]; `None` without a pickoff.
    fn dither(&self, axis: usize) -> Option<Vec<f64>> {
        let dither = self.measured.dither_rad?;
        let pickoff = NoiseLevels {
            angle: self.data.model.pickoff_white_rad2(axis),
            ..NoiseLevels::default()
        };
        let shape = |levels: NoiseLevels| self.basis.by_coefficient(levels);
        let toward = weights(&shape(pickoff), &shape(self.levels[axis]));
        Some(add_filtered(
            &dither[axis],
            &self.clean_rad[axis],
            &toward,
            &self.dct,
        ))
    }
}

/// Power of the shape of a noise \[rad²\]: as declared, or 1 for an unknown one.
fn unit_power(declared: f64) -> f64 {
    if declared > 0.0 { declared } else { 1.0 }
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
