//! Window of periods around the recorded row, for instruments with a positive or negative delay.
//!
//! Takes the input of the case, a period at a time, and gives integrals over a row shifted by any delay, whole rows and
//! fractions.
//!
//! Equation: ∫ over \[kT − d, (k+1)T − d\) = the tail of period k − n − 1 and the head of period k − n, d = (n + f)T; parts
//! of a period by the polynomial through its nodes, as in all integrals of the simulator.
//!
//! Before the first row all inputs have their values at its first instant.

use super::attitude::Quadrature;
use super::case::Period;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Delay as weights on the nodes of two periods.
#[derive(Debug, Clone, Copy)]
pub struct Shift {
    /// n, of d = (n + f)T.
    whole_rows: i64,
    tail: [f64; 4],
    head: [f64; 4],
}

impl Shift {
    /// `delay_s`: negative for an early instrument.
    pub fn new(delay_s: f64, quadrature: &Quadrature, period_s: f64) -> Self {
        let rows = delay_s / period_s;
        let part = rows - rows.floor();
        let head = quadrature.weights_until(1.0 - part);
        Self {
            whole_rows: rows.floor() as i64,
            tail: std::array::from_fn(|j| (quadrature.weights[j] - head[j]) * period_s),
            head: head.map(|weight| weight * period_s),
        }
    }

    /// Number of rows needed before the recorded one, and after it.
    pub fn reach(&self) -> (usize, usize) {
        let behind = (self.whole_rows + 1).max(0) as usize;
        (behind, (-self.whole_rows).max(0) as usize)
    }
}

/// Periods before, at and after the recorded row.
#[derive(Debug, Clone)]
pub struct Window {
    periods: VecDeque<Period>,
    behind: usize,
    ahead: usize,
}

impl Window {
    /// Window of `behind` rows before and `ahead` after.
    pub fn new(behind: usize, ahead: usize) -> Self {
        Self {
            periods: VecDeque::with_capacity(behind + ahead + 1),
            behind,
            ahead,
        }
    }

    /// Adds the next period; true if the row `ahead` periods earlier is complete for recording.
    pub fn push(&mut self, period: Period) -> bool {
        if self.periods.is_empty() {
            let before = period.held_at_begin();
            self.periods
                .extend(std::iter::repeat_n(before, self.behind));
        }
        if self.periods.len() > self.behind + self.ahead {
            self.periods.pop_front();
        }
        self.periods.push_back(period);
        self.periods.len() > self.behind + self.ahead
    }

    /// Period of the recorded row.
    pub fn now(&self) -> &Period {
        &self.periods[self.behind]
    }

    /// Integral over the shifted row of the quantity that `nodes` selects from a period.
    pub fn shifted(
        &self,
        shift: &Shift,
        nodes: impl Fn(&Period) -> [Vector3<f64>; 4],
    ) -> Vector3<f64> {
        let later = self.behind as i64 - shift.whole_rows;
        let part = |index: i64, weights: &[f64; 4]| -> Vector3<f64> {
            // reach() made the window long enough for both
            let values = nodes(&self.periods[index as usize]);
            (0..4).map(|j| values[j] * weights[j]).sum()
        };
        let head = part(later, &shift.head);
        if shift.tail == [0.0; 4] {
            return head;
        }
        head + part(later - 1, &shift.tail)
    }
}
