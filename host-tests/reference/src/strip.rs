//! Computes a block's rotation from its delayed pickoff: the dither strip.
//!
//! From pickoff angles p_k at the ends of periods \[rad\] it forms the block's increments \[rad\].
//!
//! With a pickoff that shows the block d late, the block at time t is the pickoff at t + d. The block swings at one
//! frequency F, Ω = 2πFT per period, so that the later angle follows from two readings:
//!
//! ```text
//! block_k = g (a p_k + b u_k)      u_k = (cos Ω p_k − p_{k−1}) / sin Ω, a quarter turn ahead of p_k
//!         = h₀ p_k + h₁ p_{k−1}    a = cos 2πFd, b = sin 2πFd
//! ```
//!
//! exact for a pure tone. Where the amplitude changes at a zero crossing, u is wrong for that one reading; in *angle*,
//! so that the error does not last.
//!
//! The block's angle since the first reading depends on the taps: [`Strip::turn_taps`] gives its step when they change,
//! so that the sum of all increments is always that of the latest taps from the first reading on, whatever they were
//! before.
//!
//! Before the first period there is one reading only; the one before it is taken as equal, which is one
//! constant angle. A period after lost ones is treated likewise: the reading before the latest was lost.

use nalgebra::Vector3;

/// In phase and a quarter turn ahead, each gyro \[1\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phasor {
    /// a.
    pub in_phase: Vector3<f64>,
    /// b.
    pub ahead: Vector3<f64>,
}

impl Phasor {
    /// cos and sin of 2πFd.
    pub fn of_delay(delay_s: [f64; 3], frequency_hz: [f64; 3]) -> Self {
        let turn = Vector3::from(delay_s).component_mul(&Vector3::from(frequency_hz))
            * std::f64::consts::TAU;
        Self {
            in_phase: turn.map(f64::cos),
            ahead: turn.map(f64::sin),
        }
    }
}

/// The strip and the readings it remembers.
#[derive(Debug, Clone)]
pub struct Strip {
    gain: Vector3<f64>,
    /// Ω \[rad\].
    turn_per_period_rad: Vector3<f64>,
    phasor: Phasor,
    /// p_k, p_{k−1}, p_0 \[rad\].
    readings_rad: Option<[Vector3<f64>; 3]>,
}

impl Strip {
    /// `frequency_hz` matters only where there is a delay.
    pub fn new(gain: [f64; 3], delay_s: [f64; 3], frequency_hz: [f64; 3], period_s: f64) -> Self {
        Self {
            gain: gain.into(),
            turn_per_period_rad: Vector3::from(frequency_hz) * (std::f64::consts::TAU * period_s),
            phasor: Phasor::of_delay(delay_s, frequency_hz),
            readings_rad: None,
        }
    }

    /// The block's increment since the last reading \[rad\]; `None` at the first.
    pub fn add(&mut self, pickoff_rad: Vector3<f64>) -> Option<Vector3<f64>> {
        let Some([last, before, first]) = self.readings_rad else {
            self.readings_rad = Some([pickoff_rad; 3]);
            return None;
        };
        let block = self.block_rad(pickoff_rad, last) - self.block_rad(last, before);
        self.readings_rad = Some([pickoff_rad, last, first]);
        Some(block)
    }

    /// The block's increment after lost periods \[rad\]: the reading before this one is not known.
    pub fn add_after_gap(&mut self, pickoff_rad: Vector3<f64>) -> Option<Vector3<f64>> {
        let [last, before, first] = self.readings_rad?;
        self.readings_rad = Some([pickoff_rad, pickoff_rad, first]);
        Some(self.block_rad(pickoff_rad, pickoff_rad) - self.block_rad(last, before))
    }

    /// The block's angle by the latest two readings \[rad\]; 0 before the first.
    pub fn angle(&self) -> Vector3<f64> {
        let [last, before, _] = self.readings_rad.unwrap_or_default();
        self.block_rad(last, before)
    }

    /// The present a and b.
    pub fn phasor(&self) -> Phasor {
        self.phasor
    }

    /// Sets a and b; gives the change of the block's angle since the first reading that they cause \[rad\].
    pub fn turn_taps(&mut self, phasor: Phasor) -> Vector3<f64> {
        let [last, before, first] = self.readings_rad.unwrap_or_default();
        let (last, before) = (last - first, before - first);
        let old = self.block_rad(last, before);
        self.phasor = phasor;
        self.block_rad(last, before) - old
    }

    fn block_rad(&self, pickoff: Vector3<f64>, before: Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let (sin, cos) = self.turn_per_period_rad[i].sin_cos();
            let ahead = self.phasor.ahead[i];
            // without a delay the frequency need not be one that two samples resolve
            let quarter = if ahead == 0.0 {
                0.0
            } else {
                (cos * pickoff[i] - before[i]) / sin
            };
            self.gain[i] * (self.phasor.in_phase[i] * pickoff[i] + ahead * quarter)
        })
    }
}
