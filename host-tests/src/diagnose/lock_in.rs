//! Lock-in told from other angle random walk by the beat's phase at each turnaround of the dither.
//!
//! dψ/dt = SΩ − SΩ_L sin ψ, S = 2π per pulse (physics §5). Where the sensed rate Ω passes zero the angle shown jumps by
//! −Ω_L √(2π/(S|Ω'|)) sin(ψ + sign(Ω') π/4); all jumps together are a random walk of Ω_L/√(S Ω_D), Ω_D the dither's peak
//! rate. Noise of the photons has the same spectrum, but its steps know nothing of ψ, and ψ is known: it is the
//! angle shown, to a small part of a pulse. So both quadratures of the predicted jumps are fitted to what is left
//! of the residual; their origin of phase is free.
//!
//! Enters: excess random walk, bench, left-over bins. Leaves: for each gyro the threshold \[rad/s\] and the chance of so
//! good a fit; the threshold's size comes from the excess, because the error of ψ weakens the fitted jumps.
//!
//! Needs counts with pickoff. Deliberately not here: dead bands of a gyro without dither.

use nalgebra::{DMatrix, DVector};
use realfft::num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

use super::excess::Excess;
use super::information::stable_inverse;
use super::noise::Declared;
use super::portion::{Bins, inner};
use super::regressor::Regressor;
use super::scene::Scene;
use super::streams::{AXES, Streams};
use super::workbench::Workbench;
use crate::model::{EffectValue, Model};

/// The contract's kind.
pub const KIND: &str = "lock_in";

/// Chance below which jumps that go with the phase are lock-in.
const SIGNIFICANT: f64 = 1e-4;

/// Rows over which the pulses' rounding is averaged out of the angle shown: 65 rows leave a quarter of a radian of
/// phase, and the walk within them is less.
const SMOOTH_ROWS: usize = 65;

/// The dither is read within this share of its frequency, and not beyond twice as much: its amplitude wanders
/// slowly, and noise outside would only blur the phase.
const DITHER_BAND: f64 = 0.1;

/// Frequency \[Hz\] and peak rate \[rad/s\] of a gyro's dither, from the pickoff's own angle and increments.
pub fn dither_of(streams: &Streams, axis: usize) -> Option<(f64, f64)> {
    let angle = &streams.pickoff_rad.as_ref()?[axis];
    let mean = angle.iter().sum::<f64>() / angle.len() as f64;
    let square: f64 = angle.iter().map(|angle| (angle - mean).powi(2)).sum();
    let difference: f64 = angle
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).powi(2))
        .sum();
    // A sine's increments are 2 sin(πf/fs) of the sine.
    let share = 0.5 * (difference / square).sqrt();
    if !(share > 0.0 && share < 1.0) {
        return None;
    }
    let frequency_hz = streams.rate_hz / PI * share.asin();
    let peak_rad = (2.0 * square / angle.len() as f64).sqrt();
    Some((frequency_hz, TAU * frequency_hz * peak_rad))
}

/// Random walk of angle, as rad²/s, that a threshold leaves on a dithered gyro.
pub fn walk_rad2_s(streams: &Streams, axis: usize, threshold_rad_s: f64) -> Option<f64> {
    let pulse_rad = streams.pulse_rad[axis];
    let (_, peak_rad_s) = dither_of(streams, axis)?;
    (pulse_rad > 0.0).then(|| threshold_rad_s.powi(2) * pulse_rad / (TAU * peak_rad_s))
}

/// Adds the random walk of thresholds that the model has to what it declares.
pub fn declare(model: &Model, streams: &Streams, declared: &mut [Declared; 3]) {
    for effect in model.effects.iter().filter(|effect| effect.kind == KIND) {
        for (axis, declared) in declared.iter_mut().enumerate() {
            let Some(EffectValue::Number(threshold_rad_s)) = effect.parameters.get(AXES[axis])
            else {
                continue;
            };
            let walk = walk_rad2_s(streams, axis, *threshold_rad_s).unwrap_or(0.0);
            if let Some(level) = &mut declared.random_walk {
                *level += walk / streams.rate_hz;
            }
        }
    }
}

/// Splits an excess of random walk: what goes with the phase is `lock_in`, the rest keeps both names.
pub fn name(bench: &Workbench, left: &[Bins; 3], excess: &Excess) -> Vec<Excess> {
    let streams = &bench.scene().streams;
    let mut locked = Excess {
        kind: KIND,
        indistinguishable_from: &[],
        equation: "dpsi/dt = S omega - S omega_L sin(psi), S = 2 pi per pulse: random walk omega_L/sqrt(S omega_D)",
        unit: "rad/s",
        values: [0.0; 3],
        stds: [0.0; 3],
        p_value: 1.0,
        log_likelihood_gain: 0.0,
        left_out: "At each turnaround of its dither the gyro locks for an instant, and its angle jumps as the phase of its beat then stands: backscatter that the model does not have. The jumps add up to angle random walk.",
    };
    let mut rest = excess.clone();
    for (axis, left) in left.iter().enumerate() {
        let walk = excess.values[axis];
        if walk == 0.0 {
            continue;
        }
        let (Some(ratio), Some(per_square)) = (
            jumps_ratio(bench, left, axis),
            walk_rad2_s(streams, axis, 1.0),
        ) else {
            continue;
        };
        let chance = 3.0 * ChiSquared::new(2.0).map_or(1.0, |law| law.sf(ratio));
        if chance < SIGNIFICANT {
            locked.values[axis] = walk / per_square.sqrt();
            locked.stds[axis] = excess.stds[axis] / per_square.sqrt();
            locked.p_value = locked.p_value.min(chance);
            locked.log_likelihood_gain += 0.5 * ratio;
            rest.values[axis] = 0.0;
            rest.stds[axis] = 0.0;
        }
    }
    [locked, rest]
        .into_iter()
        .filter(|one| one.values.iter().any(|value| *value > 0.0))
        .collect()
}

/// 2 Δ ln L of both quadratures of the jumps on one gyro.
fn jumps_ratio(bench: &Workbench, left: &Bins, axis: usize) -> Option<f64> {
    let portion = &bench.portion;
    let quadratures = jumps(bench.scene(), axis)?.map(|rows| portion.transform(&rows));
    let weights = bench.noise[axis].weights(portion);
    let joints = bench.joints().iter().map(Regressor::to_bins);
    let columns: Vec<Bins> = joints.chain(quadratures).collect();
    let gain = |columns: &[Bins]| {
        let scale: Vec<f64> = columns
            .iter()
            .map(|bins| {
                inner(bins, bins, &weights)
                    .max(f64::MIN_POSITIVE)
                    .sqrt()
                    .recip()
            })
            .collect();
        let gram = DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
            inner(&columns[a], &columns[b], &weights) * scale[a] * scale[b]
        });
        let right = DVector::from_fn(columns.len(), |a, _| {
            inner(&columns[a], left, &weights) * scale[a]
        });
        right.dot(&(stable_inverse(&gram) * &right))
    };
    Some(gain(&columns) - gain(&columns[..columns.len() - 2]))
}

/// Jumps by row of a gyro with a threshold of 1 rad/s, for a phase origin of 0 and of a quarter turn \[rad\].
fn jumps(scene: &Scene, axis: usize) -> Option<[Vec<f64>; 2]> {
    let streams = &scene.streams;
    let (rows, period_s) = (streams.rows, 1.0 / streams.rate_hz);
    let pulse_rad = streams.pulse_rad[axis];
    // Joined recordings have no common count of pulses.
    if pulse_rad <= 0.0 || streams.is_joined() {
        return None;
    }
    let phase_per_angle = TAU / pulse_rad;
    let (dither_hz, _) = dither_of(streams, axis)?;
    let band = |frequency_hz: f64| {
        let off = (frequency_hz / dither_hz - 1.0).abs() / DITHER_BAND;
        let pass = match off {
            off if off <= 1.0 => 1.0,
            off if off < 2.0 => 0.5 + 0.5 * (PI * (off - 1.0)).cos(),
            _ => 0.0,
        };
        Complex64::new(pass, 0.0)
    };
    // Block angle, rate and acceleration at row ends, the first being the end of the row before.
    let [block, rate, acceleration] =
        [0, 1, 2].map(|derivative| scene.dither_through(axis, derivative, &band));
    let (block, rate, acceleration) = (block?, rate?, acceleration?);
    let case_rad = scene.case_ahead_rad(axis, 0, 0.0);

    // The angle shown: what the smooth motion says, moved to where the pulses are on average.
    let mut smooth = Vec::with_capacity(rows + 1);
    let mut off_sum = Vec::with_capacity(rows + 2);
    let (mut case, mut sensed) = (0.0, 0.0);
    off_sum.push(0.0);
    for end in 0..=rows {
        if end > 0 {
            case += case_rad[end - 1] / (1.0 - scene.scale_error[axis]);
            sensed += streams.sensed_rad[axis][end - 1];
        }
        let angle = case + block[end];
        smooth.push(angle);
        off_sum.push(off_sum[end] + sensed - angle);
    }
    let off = |end: usize| {
        let from = end.saturating_sub(SMOOTH_ROWS / 2);
        let to = (end + SMOOTH_ROWS / 2 + 1).min(rows + 1);
        (off_sum[to] - off_sum[from]) / (to - from) as f64
    };

    let mut quadratures = [vec![0.0; rows], vec![0.0; rows]];
    let case_rate = &scene.rate_rad_s[axis];
    for row in 0..rows {
        // The case's rate hardly changes within a row; the dither's does.
        let (begin, end) = (rate[row] + case_rate[row], rate[row + 1] + case_rate[row]);
        if begin.signum() == end.signum() {
            continue;
        }
        let curve = Cubic::through(
            [begin, end],
            [
                acceleration[row] * period_s,
                acceleration[row + 1] * period_s,
            ],
        );
        let share = curve.zero();
        let slope = curve.slope(share) / period_s;
        if slope == 0.0 {
            continue;
        }
        let angle = smooth[row] + off(row) + curve.integral(share) * period_s;
        let phase = (phase_per_angle * angle) % TAU + slope.signum() * FRAC_PI_4;
        let size = -(TAU / (phase_per_angle * slope.abs())).sqrt();
        quadratures[0][row] = size * phase.sin();
        quadratures[1][row] = size * phase.cos();
    }
    Some(quadratures)
}

/// A cubic on 0..1 through two values with two slopes (Hermite).
struct Cubic([f64; 4]);

impl Cubic {
    fn through(values: [f64; 2], slopes: [f64; 2]) -> Self {
        let rise = values[1] - values[0];
        Self([
            values[0],
            slopes[0],
            3.0 * rise - 2.0 * slopes[0] - slopes[1],
            slopes[0] + slopes[1] - 2.0 * rise,
        ])
    }

    fn value(&self, x: f64) -> f64 {
        let [a, b, c, d] = self.0;
        a + x * (b + x * (c + x * d))
    }

    fn slope(&self, x: f64) -> f64 {
        let [_, b, c, d] = self.0;
        b + x * (2.0 * c + x * 3.0 * d)
    }

    fn integral(&self, x: f64) -> f64 {
        let [a, b, c, d] = self.0;
        x * (a + x * (b / 2.0 + x * (c / 3.0 + x * d / 4.0)))
    }

    /// Where it passes zero, its ends being of opposite sign: by halving, to 1e-9 of a row.
    fn zero(&self) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        let rises = self.value(0.0) < 0.0;
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if (self.value(middle) < 0.0) == rises {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::Cubic;

    #[test]
    fn a_cubic_is_met_at_its_ends_and_its_zero() {
        // x³ − 2x + 0.5 on 0..1.
        let cubic = Cubic::through([0.5, -0.5], [-2.0, 1.0]);
        assert!((cubic.value(0.3) - (0.027 - 0.6 + 0.5)).abs() < 1e-15);
        assert!((cubic.integral(1.0) - (0.25 - 1.0 + 0.5)).abs() < 1e-15);
        let zero = cubic.zero();
        assert!((zero.powi(3) - 2.0 * zero + 0.5).abs() < 1e-8);
    }
}
