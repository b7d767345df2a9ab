//! Sums pulse counts or accelerometer codes over an output period, as integers.

/// Σn since the output period's start, of axes x, y, z.
#[derive(Debug, Clone, Copy, Default)]
pub struct CodeSum([i32; 3]);

impl CodeSum {
    /// Adds one sample's counts or codes.
    #[inline(always)]
    pub fn add(&mut self, codes: [i32; 3]) {
        for (sum, codes) in self.0.iter_mut().zip(codes) {
            *sum = sum.wrapping_add(codes);
        }
    }

    /// The sum so far.
    #[inline(always)]
    pub fn get(&self) -> [i32; 3] {
        self.0
    }

    /// Returns the sum of one axis so far and sets it to zero.
    #[inline(always)]
    pub fn take_axis(&mut self, axis: usize) -> i32 {
        core::mem::take(&mut self.0[axis])
    }

    /// Returns the sum so far and sets it to zero.
    #[inline(always)]
    pub fn take(&mut self) -> [i32; 3] {
        core::mem::take(&mut self.0)
    }

    /// True if the sum has room for `more`, and then for `reserve` in either direction, within an `i32` on each axis.
    pub fn has_room(&self, more: [i32; 3], reserve: [i32; 3]) -> bool {
        let mut axes = self.0.iter().zip(more).zip(reserve);
        axes.all(|((sum, more), reserve)| {
            let whole = i64::from(*sum).wrapping_add(i64::from(more));
            whole.abs() <= i64::from(i32::MAX.wrapping_sub(reserve))
        })
    }
}
