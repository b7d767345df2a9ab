//! Arithmetic of intervals of integers that do not wrap, and bounds of a filter of second order.
//!
//! Part of [`interval`](crate::chain::numbers::interval).

use core::cell::RefCell;
use std::thread_local;
use std::vec::Vec;

use super::fixed::FILTER;

/// Every integer from `low` to `high`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Span {
    /// Lowest value.
    pub low: i128,
    /// Highest value.
    pub high: i128,
}

impl Span {
    /// One value.
    pub fn point(value: impl Into<i128>) -> Self {
        let value = value.into();
        Self {
            low: value,
            high: value,
        }
    }

    /// Every value from −`limit` to `limit`.
    pub fn within(limit: impl Into<i128>) -> Self {
        let limit = limit.into();
        Self {
            low: -limit,
            high: limit,
        }
    }

    /// True if the value lies inside.
    pub fn contains(self, value: impl Into<i128>) -> bool {
        (self.low..=self.high).contains(&value.into())
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            low: self.low + other.low,
            high: self.high + other.high,
        }
    }

    pub(super) fn negative(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }

    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(other.negative())
    }

    pub(super) fn times(self, other: Self) -> Self {
        // The product is monotonic in either factor, so that its extremes stand at the ends.
        let corners = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        corners
            .iter()
            .fold(Self::point(corners[0]), |span, &c| Self {
                low: span.low.min(c),
                high: span.high.max(c),
            })
    }

    pub(super) fn up(self, bits: u32) -> Self {
        Self {
            low: self.low << bits,
            high: self.high << bits,
        }
    }

    /// Rounds down, as a shift of a word does.
    pub(super) fn down(self, bits: u32) -> Self {
        Self {
            low: self.low >> bits,
            high: self.high >> bits,
        }
    }

    /// The upper word of a product of two words, which always fits.
    pub(super) fn upper(self, other: Self) -> Self {
        self.times(other).down(32)
    }

    /// The same to nearest.
    pub(super) fn upper_nearest(self, other: Self) -> Self {
        self.times(other).plus(Self::point(1u32 << 31)).down(32)
    }
}

/// ℓ¹ norms of the impulse responses of a section with these factors, and of its poles alone \[1\], from above.
pub(super) fn norms(factors: [i32; 5]) -> [f64; 2] {
    thread_local! {
        static KNOWN: RefCell<Vec<([i32; 5], [f64; 2])>> = const { RefCell::new(Vec::new()) };
    }
    let known = KNOWN.with_borrow(|all| all.iter().find(|(of, _)| *of == factors).copied());
    if let Some((_, norms)) = known {
        return norms;
    }
    let [b0, b1, b2, c1, c2] = factors.map(|f| libm::ldexp(f64::from(f), -(FILTER as i32)));
    let radius = libm::sqrt(-c2).min(1.0);
    let (mut sums, mut poles) = ([0.0; 2], [0.0; 2]);
    let mut now = 1.0;
    let mut envelope = 1.0;
    while envelope > 1e-20 {
        let pole = now + c1 * poles[0] + c2 * poles[1];
        sums[0] += (b0 * pole + b1 * poles[0] + b2 * poles[1]).abs();
        sums[1] += pole.abs();
        poles = [pole, poles[0]];
        now = 0.0;
        envelope *= radius;
    }
    // The remaining terms are below 1e-20 of an envelope that sums to 1/(1 − r)².
    let rest = 1e-9;
    let norms = sums.map(|sum| sum * (1.0 + rest) + rest);
    KNOWN.with_borrow_mut(|all| all.push((factors, norms)));
    norms
}
