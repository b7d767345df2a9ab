//! The motion that columns are made of, independent of the residual's noise (inference.md, A2).

use rlg_catalogue::Signals;
use rlg_catalogue::signals::Path;
use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::conditioned::{noise_left, weights};
use rlg_signal::reference_noise::{NoiseTerm, measure};
use rlg_signal::shrinkage::{Powers, shrink};

use super::data::Data;
use super::plan::AnalysisPlan;
use rlg_signal::streams::{Triad, each_axis};

/// Motion with what was learnt of the reference on the way.
pub struct Motion {
    /// What columns are made of.
    pub signals: Signals,
    /// Whether each axis moves beyond the reference's noise.
    pub is_moving: [bool; 3],
    /// Standard deviation of the noise that is left in each axis' rate, where it moves \[rad/s\].
    pub rate_noise_rad_s: [f64; 3],
    /// Power of the reference's white rate noise per row \[rad²\], measured beside what is declared, with its standard
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
    plan: &AnalysisPlan,
) -> Motion {
    let measured = Measured {
        case_rad: &data.streams.case_rad,
        dither_rad: data.dither_rad.as_ref(),
    };
    estimate_from(data, measured, clean_rad, levels, seen, path, plan)
}

/// What was measured of the motion.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Increments of the case by the reference \[rad\].
    pub case_rad: &'a Triad,
    /// Increments of the blocks against the case by the pickoffs \[rad\].
    pub dither_rad: Option<&'a Triad>,
}

/// Estimates the motion.
///
/// # Inputs
/// `measured`: of the recording or of one that is re-enacted; `clean_rad`: the residual less everything that is explained, bridged where it may not be looked at; `levels`: its
/// noise; `seen`: rows of it that may be looked at; `path`: what is known to lie between the reference and each gyro.
pub fn estimate_from(
    data: &Data,
    measured: Measured,
    clean_rad: &Triad,
    levels: &[NoiseLevels],
    seen: &[bool],
    path: Path,
    plan: &AnalysisPlan,
) -> Motion {
    let streams = data.streams;
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
    let of_axis = |axis: usize| {
        let noise = shape(levels[axis]);
        // A noise that is left out, or 0, is unknown: its shape has a power of 1 rad² a row.
        let power = |declared: f64| if declared > 0.0 { declared } else { 1.0 };
        let terms = [
            NoiseTerm {
                shape: shape(NoiseLevels {
                    white: power(walk),
                    ..NoiseLevels::default()
                }),
                is_declared: walk > 0.0,
            },
            NoiseTerm {
                shape: shape(NoiseLevels {
                    angle: power(angle),
                    ..NoiseLevels::default()
                }),
                is_declared: angle > 0.0,
            },
        ];
        let m = &measured.case_rad[axis];
        let shares = measure(
            m,
            &clean_rad[axis],
            &terms,
            &noise,
            seen,
            rate_hz,
            plan.reference_std,
        );
        let mut of_reference = vec![0.0; rows];
        let mut uncertain = vec![0.0; rows];
        // The residual's own levels come from as many rows.
        let of_fit = (2.0 / rows as f64).sqrt();
        for (term, share) in terms.iter().zip(&shares) {
            let sums = of_reference.iter_mut().zip(&mut uncertain);
            for ((sum, uncertain), power) in sums.zip(&term.shape) {
                *sum += share.share * power;
                *uncertain += (share.std + share.share * of_fit) * power;
            }
        }
        drop(terms);
        // The residual holds the reference's noise: there is no more of it than that.
        for ((sum, uncertain), noise) in of_reference.iter_mut().zip(&mut uncertain).zip(&noise) {
            *sum = sum.min(*noise);
            *uncertain = uncertain.min(*noise);
        }
        let toward = weights(&of_reference, &noise);
        let conditioned = add_filtered(m, &clean_rad[axis], &toward, &dct);
        let left = noise_left(&of_reference, &uncertain, &toward, &noise);
        drop((of_reference, toward));
        let powers = Powers {
            left: &left,
            uncertain: &uncertain,
            residual: &noise,
        };
        let shrunk = shrink(&conditioned, &powers, rate_hz, &plan.gate);
        drop((conditioned, left, uncertain));
        let level = |term: usize, power: f64, own: f64| Level {
            value: (shares[term].share * power).min(own),
            std: (shares[term].std * power).min(own),
        };
        let dither = measured.dither_rad.map(|dither| {
            let pickoff = NoiseLevels {
                angle: data.model.pickoff_white_rad2(axis),
                ..NoiseLevels::default()
            };
            let toward = weights(&shape(pickoff), &noise);
            add_filtered(&dither[axis], &clean_rad[axis], &toward, &dct)
        });
        (
            shrunk,
            level(0, power(walk), levels[axis].white),
            level(1, power(angle), levels[axis].angle),
            dither,
        )
    };
    let axes = each_axis(of_axis);
    drop(dct);
    let is_moving = std::array::from_fn(|axis| axes[axis].0.kept >= plan.least_cells);
    let rate_noise_rad_s = std::array::from_fn(|axis| axes[axis].0.noise.sqrt() * rate_hz);
    let reference_walk = std::array::from_fn(|axis| axes[axis].1);
    let reference_angle = std::array::from_fn(|axis| axes[axis].2);
    let [x, y, z] = axes.map(|(shrunk, _, _, dither)| (shrunk.values, dither));
    Motion {
        is_moving,
        rate_noise_rad_s,
        reference_walk,
        reference_angle,
        signals: Signals::new(
            rate_hz,
            [x.0, y.0, z.0],
            match (x.1, y.1, z.1) {
                (Some(x), Some(y), Some(z)) => Some([x, y, z]),
                _ => None,
            },
            data.inputs(),
            path,
            data.model.gyro.scale_error,
            data.sensing_from_body,
        ),
    }
}

/// `values` plus `residual` behind a filter given by DCT-II coefficient.
fn add_filtered(values: &[f64], residual: &[f64], filter: &[f64], dct: &Dct) -> Vec<f64> {
    let mut filtered = residual.to_vec();
    dct.forward(&mut filtered);
    for (value, weight) in filtered.iter_mut().zip(filter) {
        *value *= weight;
    }
    dct.inverse(&mut filtered);
    values.iter().zip(&filtered).map(|(a, b)| a + b).collect()
}
