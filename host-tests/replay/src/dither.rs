//! Finds the dither's frequency and amplitude from the pickoff channels.
//!
//! From pickoff angles \[rad\], one channel a gyro, it gives [`DitherMotion`] \[Hz, rad\], with amplitude 0 where there
//! is no oscillation that the strip could follow.
//!
//! A tone obeys p_{k+1} + p_{k−1} = 2 cos Ω p_k. Least squares over all k, mean off, gives
//! cos Ω = Σ p_k (p_{k+1} + p_{k−1}) / 2 Σ p_k². An amplitude that is changed where the angle is zero (as the
//! drive of a block does) has next to no weight in it; white noise of 1/3000 of the amplitude shifts cos Ω by
//! 1e-7. The amplitude is √2 times the rms.
//!
//! One frequency holds for the whole recording: changes with time are not followed.

use rlg_parameters::DitherMotion;
use trueaxis::design_parameters::DITHER_CYCLES_RANGE;

/// Least amplitude over the rms of the second difference's noise, taken as the pickoff's: below, the channel
/// is noise and not a dither.
const LEAST_AMPLITUDE_OVER_NOISE: f64 = 10.0;

/// Of the readings of three gyros, row by row.
pub fn measure(pickoff_rad: &[[f64; 3]], noise_rad: [f64; 3], rate_hz: f64) -> DitherMotion {
    let mut motion = DitherMotion::default();
    for axis in 0..3 {
        let rows = pickoff_rad.len() as f64;
        let mean = pickoff_rad.iter().map(|row| row[axis]).sum::<f64>() / rows;
        let (mut square, mut neighbours) = (0.0, 0.0);
        for three in pickoff_rad.windows(3) {
            let [before, now, after] = [0, 1, 2].map(|at| three[at][axis] - mean);
            square += now * now;
            neighbours += now * (before + after);
        }
        let amplitude_rad = (2.0 * square / rows).sqrt();
        let cycles_per_sample = (neighbours / (2.0 * square)).acos() / std::f64::consts::TAU;
        let (low, high) = DITHER_CYCLES_RANGE;
        // NaN (no readings, or all equal) is outside
        let tone = (low..=high).contains(&cycles_per_sample)
            && amplitude_rad > LEAST_AMPLITUDE_OVER_NOISE * noise_rad[axis];
        if tone {
            motion.frequency_hz[axis] = cycles_per_sample * rate_hz;
            motion.amplitude_rad[axis] = amplitude_rad;
        }
    }
    motion
}
