//! Whitening of attitude errors read at any times: the innovations of their own Kalman filter.
//!
//! Enters: the geometry of each step between two stamps and the levels of the noise. Leaves: series of vectors, one
//! a stamp \[rad, start frame\], turned into ones of unit variance in the body frame, and ln det of their
//! covariance. Linear in the number of stamps, whatever their spacing.
//!
//! State: error angle a and drift b of the gyros. Over a step a grows by G b (G = ∫ C dt) and by the random walk of
//! gyros and reference; b walks, each gyro's with its level, and where it relaxes (a stand-in for flicker) comes back to
//! nothing with one time constant. A stamp reads a with white noise of reference and gyros.
//! A run of stamps begins with an unknown angle: its first stamp sets it and says nothing else. The symmetric root
//! of the innovation's covariance, turned into the body frame, keeps each gyro's part with that gyro.

use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// One step, to a stamp from the one before.
#[derive(Debug, Clone)]
pub struct Step {
    /// Time since the stamp before \[s\].
    pub seconds: f64,
    /// ∫ c cᵀ dt for the axis c of each gyro \[s\].
    pub walk_s: [Matrix3<f64>; 3],
    /// White noise of angle that walks because the axes turn between rows \[rad²\].
    pub turned_rad2: Matrix3<f64>,
    /// What a rate of each gyro adds to the angle over the step \[s\].
    pub angle_from_rate_s: Matrix3<f64>,
    /// Body to start frame at the stamp.
    pub start_from_body: Matrix3<f64>,
}

/// Levels of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Random walk of each gyro and the reference together \[rad²/s\].
    pub walk_rad2_s: [f64; 3],
    /// White noise of angle of each gyro \[rad²\].
    pub gyro_white_rad2: [f64; 3],
    /// White noise of angle of the reference \[rad²\].
    pub reference_white_rad2: f64,
    /// Random walk of each gyro's rate \[rad²/s³\].
    pub drift_rad2_s3: [f64; 3],
    /// Time in which a drift comes back to 1/e of itself \[s\]; infinite where it walks.
    pub drift_relaxes_s: f64,
}

impl Levels {
    /// How many gyros drift.
    pub fn drifting(&self) -> usize {
        self.drift_rad2_s3
            .iter()
            .filter(|drift| **drift > 0.0)
            .count()
    }

    /// Numbers that describe the drift.
    pub fn drift_numbers(&self) -> usize {
        self.drifting() + usize::from(self.drift_relaxes_s.is_finite() && self.drifting() > 0)
    }

    /// Variance of the drifts when nothing has been read: none where they walk, from a known beginning.
    fn drift_at_first(&self) -> Matrix3<f64> {
        match self.drift_relaxes_s.is_finite() {
            true => self.drift_matrix() * (0.5 * self.drift_relaxes_s),
            false => Matrix3::zeros(),
        }
    }

    fn drift_matrix(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::from(self.drift_rad2_s3))
    }

    /// What becomes of the drifts in a time.
    fn relaxed(&self, seconds: f64) -> Relaxed {
        let times = seconds / self.drift_relaxes_s;
        if times == 0.0 {
            return Relaxed {
                kept: 1.0,
                mean: 1.0,
                fresh: self.drift_matrix() * seconds,
            };
        }
        let kept = (-times).exp();
        Relaxed {
            kept,
            mean: -(-times).exp_m1() / times,
            fresh: self.drift_matrix() * (-0.5 * self.drift_relaxes_s * (-2.0 * times).exp_m1()),
        }
    }
}

/// What becomes of a drift in a time.
struct Relaxed {
    /// The part that is left at its end.
    kept: f64,
    /// The part that acts on average.
    mean: f64,
    /// Variance that comes in.
    fresh: Matrix3<f64>,
}

/// See the page above.
pub struct Whitener {
    readings: Vec<Reading>,
    /// ln det of the innovations' covariance.
    pub log_det: f64,
}

struct Reading {
    stamp: usize,
    begins: bool,
    drift_kept: f64,
    angle_from_drift: Matrix3<f64>,
    angle_gain: Matrix3<f64>,
    drift_gain: Matrix3<f64>,
    body_root: Matrix3<f64>,
}

impl Whitener {
    /// `steps[i]` leads to stamp i; `runs` are stamps that follow each other without a gap, in order.
    pub fn new(steps: &[Step], runs: &[Range<usize>], levels: &Levels) -> Self {
        let mut readings = Vec::new();
        let mut log_det = 0.0;
        let mut angle = Matrix3::zeros();
        let mut cross = Matrix3::zeros();
        let mut drift = levels.drift_at_first();
        let mut known_to = None;
        for run in runs {
            for stamp in run.clone() {
                let step = &steps[stamp];
                let c = &step.start_from_body;
                let white = Matrix3::from_diagonal(&Vector3::from(levels.gyro_white_rad2));
                let read =
                    c * white * c.transpose() + Matrix3::identity() * levels.reference_white_rad2;
                if stamp == run.start {
                    // The drift goes on while the angle is not followed.
                    let since: f64 = (known_to.unwrap_or(stamp)..stamp)
                        .map(|passed| steps[passed + 1].seconds)
                        .sum();
                    let Relaxed { kept, fresh, .. } = levels.relaxed(since);
                    drift = drift * (kept * kept) + fresh;
                    (angle, cross) = (read, Matrix3::zeros());
                    readings.push(Reading {
                        stamp,
                        begins: true,
                        drift_kept: kept,
                        angle_from_drift: Matrix3::zeros(),
                        angle_gain: Matrix3::identity(),
                        drift_gain: Matrix3::zeros(),
                        body_root: Matrix3::zeros(),
                    });
                    continue;
                }
                let Relaxed { kept, mean, fresh } = levels.relaxed(step.seconds);
                let g = &step.angle_from_rate_s;
                let from_drift = g * mean;
                let mut walk = step.turned_rad2;
                for (axis, level) in levels.walk_rad2_s.iter().enumerate() {
                    walk += step.walk_s[axis] * *level;
                }
                angle += from_drift * cross.transpose()
                    + cross * from_drift.transpose()
                    + from_drift * drift * from_drift.transpose()
                    + g * (fresh / 3.0) * g.transpose()
                    + walk;
                cross = (cross + from_drift * drift) * kept + g * (fresh / 2.0);
                drift = drift * (kept * kept) + fresh;
                let covariance = (angle + read).symmetric_eigen();
                /// A share of the largest, so that a direction without noise stays finite.
                const LEAST: f64 = 1e-12;
                let largest = covariance.eigenvalues.max();
                let values = covariance
                    .eigenvalues
                    .map(|value| value.max(LEAST * largest).max(f64::MIN_POSITIVE));
                log_det += values.map(f64::ln).sum();
                let vectors = &covariance.eigenvectors;
                let of = |power: f64| {
                    let raised = values.map(|value| value.powf(power));
                    vectors * Matrix3::from_diagonal(&raised) * vectors.transpose()
                };
                let inverse = of(-1.0);
                let angle_gain = angle * inverse;
                let drift_gain = cross.transpose() * inverse;
                readings.push(Reading {
                    stamp,
                    begins: false,
                    drift_kept: kept,
                    angle_from_drift: from_drift,
                    angle_gain,
                    drift_gain,
                    body_root: c.transpose() * of(-0.5),
                });
                let (full_angle, full_cross) = (angle, cross);
                angle -= angle_gain * full_angle;
                angle = (angle + angle.transpose()) * 0.5;
                cross -= angle_gain * full_cross;
                drift -= drift_gain * full_cross;
                drift = (drift + drift.transpose()) * 0.5;
            }
            known_to = Some(run.end - 1);
        }
        Self { readings, log_det }
    }

    /// A series by stamp, whitened: three values a step, in the order of the runs.
    pub fn whiten(&self, by_stamp: &[Vector3<f64>]) -> Vec<f64> {
        let mut whitened = Vec::with_capacity(3 * self.readings.len());
        let (mut angle, mut drift) = (Vector3::zeros(), Vector3::zeros());
        for reading in &self.readings {
            let value = by_stamp[reading.stamp];
            let ahead = angle + reading.angle_from_drift * drift;
            drift *= reading.drift_kept;
            if reading.begins {
                angle = value;
                continue;
            }
            let fresh = value - ahead;
            angle = ahead + reading.angle_gain * fresh;
            drift += reading.drift_gain * fresh;
            whitened.extend_from_slice((reading.body_root * fresh).as_slice());
        }
        whitened
    }

    /// The stamps whose steps are whitened, in that order.
    pub fn stamps(&self) -> Vec<usize> {
        self.readings
            .iter()
            .filter(|reading| !reading.begins)
            .map(|reading| reading.stamp)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, Rotation3};

    #[test]
    fn whitened_series_have_the_weight_of_the_whole_inverse_covariance() {
        for drift_relaxes_s in [f64::INFINITY, 1.3] {
            has_the_weight_of_the_whole(drift_relaxes_s);
        }
    }

    /// The covariance written out as a whole, inverted, with the unknown first angle projected away.
    fn has_the_weight_of_the_whole(drift_relaxes_s: f64) {
        let count = 6;
        let levels = Levels {
            walk_rad2_s: [1.0, 2.0, 0.5],
            gyro_white_rad2: [0.3, 0.1, 0.2],
            reference_white_rad2: 0.4,
            drift_rad2_s3: [0.7, 0.2, 0.0],
            drift_relaxes_s,
        };
        let turn =
            |k: usize| *Rotation3::from_euler_angles(0.3 * k as f64, 0.2, -0.1 * k as f64).matrix();
        let seconds = |k: usize| 0.5 + 0.1 * k as f64;
        let steps: Vec<Step> = (0..count)
            .map(|k| {
                let c = turn(k);
                Step {
                    seconds: seconds(k),
                    walk_s: [0, 1, 2].map(|axis: usize| {
                        c.column(axis) * c.column(axis).transpose() * seconds(k)
                    }),
                    turned_rad2: Matrix3::identity() * 0.05,
                    angle_from_rate_s: c * seconds(k),
                    start_from_body: c,
                }
            })
            .collect();
        // Sources: walk and turned noise of each step, drift (piecewise: its mean and end over a step), readings.
        let whole = {
            let mut total = DMatrix::<f64>::zeros(3 * count, 3 * count);
            for m in 1..count {
                for n in 1..count {
                    let mut block = Matrix3::zeros();
                    for step in &steps[1..=m.min(n)] {
                        block += step.turned_rad2;
                        for axis in 0..3 {
                            block += step.walk_s[axis] * levels.walk_rad2_s[axis];
                        }
                    }
                    // a_m = Σ_k G_k (mean b_{k−1} + part), with a fresh drift of every step s: in its own step it acts
                    // with variance 1/3 and correlation 1/2 to its end, in later ones as far as it has not relaxed.
                    let since = |from: usize, to: usize| -> f64 {
                        let times: f64 = (from + 1..to).map(seconds).sum();
                        (-times / drift_relaxes_s).exp()
                    };
                    let later = |s: usize, m: usize| -> Matrix3<f64> {
                        let each = (s + 1..=m).map(|k| {
                            let mean = levels.relaxed(seconds(k)).mean;
                            steps[k].angle_from_rate_s * mean * since(s, k)
                        });
                        each.sum()
                    };
                    let (far, near) = (later(0, m), later(0, n));
                    block += far * levels.drift_at_first() * near.transpose();
                    for (s, step) in steps.iter().enumerate().take(m.max(n) + 1).skip(1) {
                        let fresh = levels.relaxed(seconds(s)).fresh;
                        let own = |m: usize| -> Matrix3<f64> {
                            if s <= m {
                                step.angle_from_rate_s
                            } else {
                                Matrix3::zeros()
                            }
                        };
                        block += own(m) * (fresh / 3.0) * own(n).transpose()
                            + own(m) * (fresh / 2.0) * later(s, n).transpose()
                            + later(s, m) * (fresh / 2.0) * own(n).transpose()
                            + later(s, m) * fresh * later(s, n).transpose();
                    }
                    total.fixed_view_mut::<3, 3>(3 * m, 3 * n).copy_from(&block);
                }
            }
            for (m, step) in steps.iter().enumerate().take(count) {
                let c = step.start_from_body;
                let white = c
                    * Matrix3::from_diagonal(&Vector3::from(levels.gyro_white_rad2))
                    * c.transpose()
                    + Matrix3::identity() * levels.reference_white_rad2;
                let mut view = total.fixed_view_mut::<3, 3>(3 * m, 3 * m);
                view += white;
            }
            total
        };
        let inverse = whole.try_inverse().expect("positive definite");
        let series: Vec<Vector3<f64>> = (0..count)
            .map(|k| Vector3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3 - k as f64))
            .collect();
        let stacked =
            DVector::from_iterator(3 * count, series.iter().flat_map(|v| v.iter().copied()));
        let mut constant = DMatrix::zeros(3 * count, 3);
        for m in 0..count {
            constant
                .fixed_view_mut::<3, 3>(3 * m, 0)
                .copy_from(&Matrix3::identity());
        }
        let gram = constant.tr_mul(&(&inverse * &constant));
        let right = constant.tr_mul(&(&inverse * &stacked));
        let free = stacked.dot(&(&inverse * &stacked))
            - right.dot(&(gram.try_inverse().expect("three angles") * &right));
        let whitener = Whitener::new(&steps, std::slice::from_ref(&(0..count)), &levels);
        let whitened: f64 = whitener.whiten(&series).iter().map(|v| v * v).sum();
        assert!((whitened - free).abs() < 1e-9 * free, "{whitened} {free}");
    }
}
