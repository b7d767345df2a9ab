//! Lock-in of a gyro that is not dithered: angle lost in slow rotation.
//!
//! Adler's equation dψ/dt = S ω − S Ω_L sin ψ, S = 2π per pulse (Aronowitz, "The laser gyro", 1971, §V), for a rate
//! that changes little in 1/(S Ω_L): an angular acceleration well below S Ω_L². Below the threshold Ω_L the beat
//! frequency is zero; above it the mean beat rate is sgn(ω) √(ω² − Ω_L²). The phase at which the beat stops within a
//! cycle is random: each pass through rest leaves an error of up to half a pulse either way. A dither turns these
//! errors into an angle random walk.

use rlg_plan::GridPlan;

use crate::signals::{CaseMotion, Signals};

/// Lost angle or its derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Angle lost, as an addition to the increment \[rad\].
    Missing,
    /// Derivative with respect to the threshold \[s\].
    ByThreshold,
}

/// A lock-in threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Ω_L \[rad/s\], above 0.
    pub rad_s: f64,
}

impl Threshold {
    /// Grid of thresholds from `least_rad_s` to `most_rad_s`.
    pub fn grid(least_rad_s: f64, most_rad_s: f64, plan: &GridPlan) -> Vec<Self> {
        std::iter::successors(Some(least_rad_s), |rate| Some(rate * plan.lock_in_ratio))
            .take_while(|rate| *rate <= most_rad_s)
            .map(|rad_s| Self { rad_s })
            .collect()
    }

    /// Computes the effect of lock-in on a gyro's increments by row \[rad\], or its derivative \[s\].
    ///
    /// # Assumptions
    /// The rate changes linearly within a row.
    pub fn increments(
        self,
        gyro: usize,
        part: Part,
        signals: &Signals,
        motion: &CaseMotion,
    ) -> Vec<f64> {
        let period_s = signals.period_s();
        let rates_rad_s = [0, 1, 2].map(|axis| motion.rate_rad_s(axis));
        let changes_rad_s2 = [0, 1, 2].map(|axis| motion.acceleration_rad_s2(axis));
        (0..signals.rows)
            .map(|row| {
                let rate = along(rates_rad_s, gyro, row, signals);
                let change = along(changes_rad_s2, gyro, row, signals) * period_s;
                self.mean(rate, change, part) * period_s
            })
            .collect()
    }

    /// Rows in which a gyro enters its dead band: each leaves an angle error of up to half a pulse either way.
    pub fn stops(self, gyro: usize, signals: &Signals) -> Vec<usize> {
        let rates_rad_s = [0, 1, 2].map(|axis| signals.independent.rate_rad_s(axis));
        let rate = |row: usize| along(rates_rad_s, gyro, row, signals);
        let is_stop = |&row: &usize| {
            let (before, now) = (rate(row - 1), rate(row));
            before.abs() > self.rad_s && (now.abs() <= self.rad_s || now * before < 0.0)
        };
        (1..signals.rows).filter(is_stop).collect()
    }

    /// Mean over a row of the lost rate \[rad/s\], or its derivative, at a middle rate `rate` that changes by `change`
    /// within the row \[rad/s\].
    fn mean(self, rate: f64, change: f64, part: Part) -> f64 {
        /// Rates beyond this many thresholds use the middle rate for the whole row.
        const FAR: f64 = 8.0;
        /// Spread of a steady rate, as a share of the threshold: the derivative has a pole there.
        const SPREAD: f64 = 1e-3;
        let half = 0.5 * change.abs().max(SPREAD * self.rad_s);
        let size = rate.abs();
        if size - half > FAR * self.rad_s {
            let beat = (size * size - self.rad_s * self.rad_s).sqrt();
            return -rate.signum()
                * match part {
                    Part::Missing => self.rad_s * self.rad_s / (size + beat),
                    Part::ByThreshold => self.rad_s / beat,
                };
        }
        let integral = self.integral(rate + half, part) - self.integral(rate - half, part);
        let mean = integral / (2.0 * half);
        match part {
            Part::Missing => mean - rate,
            Part::ByThreshold => mean,
        }
    }

    /// Integral by rate, from 0, of the beat rate sgn(ω) √(ω² − Ω_L²), or of its derivative with respect to Ω_L.
    fn integral(self, rate: f64, part: Part) -> f64 {
        let size = rate.abs();
        if size <= self.rad_s {
            return 0.0;
        }
        let beat = (size * size - self.rad_s * self.rad_s).sqrt();
        let log = ((size + beat) / self.rad_s).ln();
        match part {
            Part::Missing => 0.5 * (size * beat - self.rad_s * self.rad_s * log),
            Part::ByThreshold => -self.rad_s * log,
        }
    }
}

/// Component of a triad along a gyro's sensing axis in the middle of a row.
fn along(triad: [&[f64]; 3], gyro: usize, row: usize, signals: &Signals) -> f64 {
    (0..3)
        .map(|axis| signals.sensing_from_body[(gyro, axis)] * triad[axis][row])
        .sum()
}

#[cfg(test)]
mod tests {
    use rlg_plan::GridPlan;

    use super::{Part, Threshold};

    /// Mean of the law over a row, by ten thousand steps.
    fn stepped(rad_s: f64, rate: f64, change: f64) -> f64 {
        const STEPS: usize = 10_000;
        let at = |step: usize| {
            let rate = rate + change * ((step as f64 + 0.5) / STEPS as f64 - 0.5);
            let beat = (rate * rate - rad_s * rad_s).max(0.0).sqrt();
            beat.copysign(rate) - rate
        };
        (0..STEPS).map(at).sum::<f64>() / STEPS as f64
    }

    #[test]
    fn a_row_misses_the_mean_of_the_law_and_changes_with_the_threshold_as_it_says() {
        let threshold = Threshold { rad_s: 5e-4 };
        for rate in [0.0, 3e-4, -4.9e-4, 6e-4, -2e-3, 0.1] {
            for change in [0.0, 1e-5, 4e-4, -3e-3] {
                let mean = threshold.mean(rate, change, Part::Missing);
                let expected = stepped(5e-4, rate, change);
                assert!(
                    (mean - expected).abs() < 5e-8,
                    "{rate} {change}: {mean} {expected}"
                );
                let moved = |rad_s: f64| Threshold { rad_s }.mean(rate, change, Part::Missing);
                let numeric = (moved(5.0001e-4) - moved(4.9999e-4)) / 2e-8;
                let exact = threshold.mean(rate, change, Part::ByThreshold);
                assert!(
                    (numeric - exact).abs() < 0.01,
                    "{rate} {change}: {exact} {numeric}"
                );
            }
        }
    }

    #[test]
    fn thresholds_are_a_quarter_apart() {
        let grid = Threshold::grid(1e-5, 1e-3, &GridPlan::default());
        assert_eq!(grid.len(), 21);
        assert!(grid[20].rad_s <= 1e-3 && grid[20].rad_s * 1.25 > 1e-3);
    }
}
