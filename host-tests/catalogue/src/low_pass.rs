//! First-order low passes on the gyros' paths.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_plan::GridPlan;

/// H = 1/(1 + iωτ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Time constant τ \[s\].
    pub time_s: f64,
}

/// Response or its derivative with respect to the time constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// H − 1.
    Response,
    /// Derivative with respect to the time constant \[1/s\].
    ByTime,
}

/// All parts, the response first.
pub const PARTS: [Part; 2] = [Part::Response, Part::ByTime];

impl LowPass {
    /// Complete response H at a frequency \[Hz\].
    pub fn whole(self, hz: f64) -> Complex64 {
        1.0 + self.beyond(hz, Part::Response)
    }

    /// Additive part of the response at a frequency \[Hz\]: H − 1 = −iωτ/(1 + iωτ), or its derivative.
    pub fn beyond(self, hz: f64, part: Part) -> Complex64 {
        let omega = Complex64::new(0.0, TAU * hz);
        let below = 1.0 + omega * self.time_s;
        match part {
            Part::Response => -omega * self.time_s / below,
            Part::ByTime => -omega / (below * below),
        }
    }
}

/// Time constants from one row to `longest_s`.
pub fn grid(period_s: f64, longest_s: f64, plan: &GridPlan) -> Vec<LowPass> {
    let ratio = plan.low_pass_ratio;
    std::iter::successors(Some(period_s), |time_s| Some(time_s * ratio))
        .take_while(|time_s| *time_s <= longest_s)
        .map(|time_s| LowPass { time_s })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{LowPass, Part};

    #[test]
    fn the_derivative_is_that_of_the_response_and_slow_motion_passes_late() {
        let (at, step) = (LowPass { time_s: 0.033 }, 1e-7);
        for hz in [0.5, 5.0, 60.0] {
            let moved = |by: f64| LowPass {
                time_s: at.time_s + by,
            };
            let difference =
                moved(step).beyond(hz, Part::Response) - moved(-step).beyond(hz, Part::Response);
            let exact = at.beyond(hz, Part::ByTime);
            assert!((difference / (2.0 * step) - exact).norm() < 1e-4 * exact.norm());
        }
        let slow = 1.0 + at.beyond(0.01, Part::Response);
        let late = -slow.arg() / (std::f64::consts::TAU * 0.01);
        assert!((late / 0.033 - 1.0).abs() < 1e-4, "{late}");
    }
}
