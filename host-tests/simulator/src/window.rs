//! Keeps a window of periods around the row that is being recorded, for instruments that are late or early.
//!
//! It takes what the case is exposed to, a period at a time, and gives integrals over a row that is shifted in time by
//! any delay, whole rows and parts of one.
//!
//! Equation: ∫ over \[kT − d, (k+1)T − d\) = the tail of period k − n − 1 and the head of period k − n, d = (n + f)T;
//! parts of a period by the polynomial through its nodes, as the simulator integrates everywhere.
//!
//! Before the first row everything stands as at its first instant.

use super::attitude::Quadrature;
use super::case::Period;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A delay as weights on the nodes of two periods.
#[derive(Debug, Clone, Copy)]
pub struct Shift {
    /// n, of d = (n + f)T.
    whole_rows: i64,
    tail: [f64; 4],
    head: [f64; 4],
}

impl Shift {
    /// `delay_s` may be negative: early.
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

    /// Rows that must be known before the one recorded, and after it.
    pub fn reach(&self) -> (usize, usize) {
        let behind = (self.whole_rows + 1).max(0) as usize;
        (behind, (-self.whole_rows).max(0) as usize)
    }
}

/// Periods before, at and after the row that is recorded.
#[derive(Debug, Clone)]
pub struct Window {
    periods: VecDeque<Period>,
    behind: usize,
    ahead: usize,
}

impl Window {
    /// With room for `behind` rows before and `ahead` after.
    pub fn new(behind: usize, ahead: usize) -> Self {
        Self {
            periods: VecDeque::with_capacity(behind + ahead + 1),
            behind,
            ahead,
        }
    }

    /// Takes the next period; whether the row `ahead` periods earlier can now be recorded.
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

    /// The row that is recorded.
    pub fn now(&self) -> &Period {
        &self.periods[self.behind]
    }

    /// The integral over the row, shifted, of what `nodes` takes from a period.
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
