//! Frequency and amplitude of the dither, estimated from the pickoff channels.
//!
//! Pickoff angles \[rad\], one channel a gyro, give [`DitherMotion`] \[Hz, rad\], with amplitude 0 if there is no
//! oscillation that the strip could follow.
//!
//! A tone satisfies p_{k+1} + p_{k−1} = 2 cos Ω p_k. Least squares over all k, mean removed, gives cos Ω = Σ p_k (p_{k+1} +
//! p_{k−1}) / 2 Σ p_k². An amplitude step at a zero crossing (as a block's drive makes it) has nearly no weight; white
//! noise of 1/3000 of the amplitude shifts cos Ω by 1e-7. The amplitude is √2 times the rms.
//!
//! One frequency is estimated for the whole recording: changes with time are not followed.

use rlg_parameters::DitherMotion;
use trueaxis::design_parameters::DITHER_CYCLES_RANGE;

/// Least ratio of the amplitude to the pickoff noise; below it the channel is noise and not dither.
const LEAST_AMPLITUDE_OVER_NOISE: f64 = 10.0;

/// Measures the dither from the pickoff angles of three gyros, row by row.
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
        // NaN (no samples, or all equal) is outside
        let tone = (low..=high).contains(&cycles_per_sample)
            && amplitude_rad > LEAST_AMPLITUDE_OVER_NOISE * noise_rad[axis];
        if tone {
            motion.frequency_hz[axis] = cycles_per_sample * rate_hz;
            motion.amplitude_rad[axis] = amplitude_rad;
        }
    }
    motion
}
