//! Mean drifts of flexing gyros by formula, independent of the simulator's grid.

use std::f64::consts::TAU;

use firmware_tests::sensing_block::measure::DEG_H;
use firmware_tests::sensing_block::{Flexure, Motion};

/// Real and imaginary part.
type Complex = [f64; 2];

fn product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// Excess mean rate of each gyro by the tilts under the motion's oscillations \[°/h\].
///
/// A rate Re W e^{iΩt} gives the tilt Re −K G iΩ W_j e^{iΩt} with G = 1/(1 − r² + 2iζr), r = f/f0, and the mean
/// ½ Re tilt · conj W_k.
pub fn drift_deg_h(flexure: &Flexure, motion: &Motion) -> [f64; 3] {
    // (pair, gyro, axis of the tilt, axis whose rate it brings in, sign), pairs in the order xy, xz, yx, yz, zx, zy.
    const PAIRS: [(usize, usize, usize, usize, f64); 6] = [
        (0, 0, 1, 2, -1.0),
        (1, 0, 2, 1, 1.0),
        (2, 1, 0, 2, 1.0),
        (3, 1, 2, 0, -1.0),
        (4, 2, 0, 1, -1.0),
        (5, 2, 1, 0, 1.0),
    ];
    let mut drift = [0.0; 3];
    for tone in &motion.tones {
        let omega = TAU * tone.frequency_hz;
        let rate = |axis: usize| [tone.cosine[axis], -tone.sine[axis]];
        for (pair, gyro, tilted_about, of, sign) in PAIRS {
            let k_s2 = flexure.s2.to_array()[pair];
            let response = match &flexure.mode {
                None => [1.0, 0.0],
                Some(mode) => {
                    let ratio = tone.frequency_hz / mode.frequency_hz.to_array()[pair];
                    let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * mode.damping * ratio);
                    let square = real * real + imaginary * imaginary;
                    [real / square, -imaginary / square]
                }
            };
            let acceleration = product([0.0, omega], rate(tilted_about));
            let tilt = product([-k_s2, 0.0], product(response, acceleration));
            let [real, imaginary] = rate(of);
            drift[gyro] += sign * 0.5 * product(tilt, [real, -imaginary])[0] / DEG_H;
        }
    }
    drift
}
