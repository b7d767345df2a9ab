//! First-order high passes behind the gyros: automatic zeroing forgets a constant rate.
//!
//! The logic subtracts from each sample g the mean l of those before: it reads g − l, then l grows by (T/τ)(g − l), from 0 where
//! the record begins. A coupling that passes no constant differs from it by half of T/τ, as a scale error does.

use rlg_plan::GridPlan;

/// H = iωτ/(1 + iωτ), well below the row rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HighPass {
    /// Time constant τ \[s\].
    pub time_s: f64,
}

/// A response, or its derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// H − 1.
    Response,
    /// Its derivative by the time constant \[1/s\].
    ByTime,
}

impl HighPass {
    /// Computes the increment that the high pass adds to each sensed increment \[rad\], or its derivative \[rad/s\].
    pub fn beyond(self, sensed_rad: &[f64], period_s: f64, part: Part) -> Vec<f64> {
        /// Relative step of the central difference by τ.
        const STEP: f64 = 1e-4;
        match part {
            Part::Response => self.forgotten(sensed_rad, period_s),
            Part::ByTime => {
                let by = STEP * self.time_s;
                let moved = |by: f64| {
                    let time_s = self.time_s + by;
                    Self { time_s }.forgotten(sensed_rad, period_s)
                };
                let pairs = moved(by).into_iter().zip(moved(-by));
                pairs
                    .map(|(more, less)| (more - less) / (2.0 * by))
                    .collect()
            }
        }
    }

    /// Replaces read increments by the sensed ones \[rad\].
    pub fn undo(self, read_rad: &mut [f64], period_s: f64) {
        let learnt = period_s / self.time_s;
        let mut mean_rad = 0.0;
        for value in read_rad {
            let apart_rad = *value;
            *value += mean_rad;
            mean_rad += learnt * apart_rad;
        }
    }

    /// −l T of every row.
    fn forgotten(self, sensed_rad: &[f64], period_s: f64) -> Vec<f64> {
        let learnt = period_s / self.time_s;
        let mut mean_rad = 0.0;
        let row = |sensed_rad: &f64| {
            let before_rad = mean_rad;
            mean_rad += learnt * (sensed_rad - before_rad);
            -before_rad
        };
        sensed_rad.iter().map(row).collect()
    }
}

/// Time constants from some rows to a share of the record.
pub fn grid(period_s: f64, rows: usize, plan: &GridPlan) -> Vec<HighPass> {
    let least_s = plan.high_pass_least_rows * period_s;
    let longest_s = plan.high_pass_longest_share * rows as f64 * period_s;
    let ratio = plan.high_pass_ratio;
    std::iter::successors(Some(least_s), |time_s| Some(time_s * ratio))
        .take_while(|time_s| *time_s <= longest_s)
        .map(|time_s| HighPass { time_s })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{HighPass, Part};

    #[test]
    fn a_constant_rate_is_forgotten_with_the_time_constant() {
        let (period_s, at) = (0.01, HighPass { time_s: 3.0 });
        let beyond = at.beyond(&[0.02; 2000], period_s, Part::Response);
        let mut angle_rad = 0.0;
        for (row, beyond) in beyond.iter().enumerate() {
            angle_rad += 0.02 + beyond;
            // A rate r reads r e^(−t/τ): the angle is r τ (1 − e^(−t/τ)), but for half of T/τ.
            let time_s = (row + 1) as f64 * period_s;
            let exact = 2.0 * 3.0 * -(-time_s / 3.0_f64).exp_m1();
            assert!(
                (angle_rad / exact - 1.0).abs() < 0.01 / 3.0,
                "{row}: {angle_rad} {exact}"
            );
        }
    }

    #[test]
    fn undone_the_increments_are_what_was_sensed() {
        let sensed: Vec<f64> = (0..500).map(|row| (0.1 * f64::from(row)).cos()).collect();
        let at = HighPass { time_s: 0.7 };
        let beyond = at.beyond(&sensed, 0.01, Part::Response);
        let mut read: Vec<f64> = sensed.iter().zip(&beyond).map(|(a, b)| a + b).collect();
        at.undo(&mut read, 0.01);
        for (undone, sensed) in read.iter().zip(&sensed) {
            assert!((undone - sensed).abs() < 1e-12);
        }
    }

    #[test]
    fn the_derivative_is_that_of_the_response() {
        let sensed: Vec<f64> = (0..3000)
            .map(|row| (0.003 * f64::from(row * row % 997)).sin())
            .collect();
        let of = |time_s: f64| HighPass { time_s }.beyond(&sensed, 0.01, Part::Response);
        let slope = HighPass { time_s: 2.0 }.beyond(&sensed, 0.01, Part::ByTime);
        for ((more, less), slope) in of(2.01).iter().zip(of(1.99)).zip(slope) {
            assert!(
                ((more - less) / 0.02 - slope).abs() < 1e-4,
                "{more} {less} {slope}"
            );
        }
    }
}
