//! Each error at a realistic size, as the catalogue writes it: the gyro's excess, from the motion itself.

use trueaxis::TermKind as K;

use crate::unit::{Error, acceleration, field_t, motion, true_forces, true_rates};

/// Temperatures over those at the start \[K\], as the records' reference of 0 has it.
fn warmed(t: f64) -> [f64; 3] {
    let (now, start) = (motion(t).temperature_k, motion(0.0).temperature_k);
    [0, 1, 2].map(|axis| now[axis] - start[axis])
}

/// Adds to the true rates.
fn more(t: f64, of: impl Fn(usize) -> f64) -> [f64; 3] {
    let rates = true_rates(t);
    [0, 1, 2].map(|axis| rates[axis] + of(axis))
}

/// 0.05 °/h per K, and a hundredth of it per K².
const BIAS: [f64; 3] = [2.4e-7, -1.9e-7, 3.1e-7];
const BIAS_SECOND: [f64; 3] = [2e-9, 3e-9, -4e-9];
const BIAS_RATE: [f64; 3] = [4e-7, -3e-7, 5e-7];
/// 3 ppm per K.
const SCALE: [f64; 3] = [3e-6, -2e-6, 4e-6];
const TILT: [f64; 6] = [1e-6, -2e-6, 1.5e-6, 0.5e-6, -1e-6, 2e-6];
pub const DELAY: [f64; 3] = [20e-6, -10e-6, 35e-6];
pub const VARIANCE: [f64; 3] = [1e-8, 0.4e-8, 2e-8];
const ASYMMETRY: [f64; 3] = [1e-5, -2e-5, 3e-5];
const QUADRATIC: [f64; 3] = [1e-5, -2e-5, 1.5e-5];
const CUBIC: [f64; 3] = [2e-6, 1e-6, -3e-6];
/// 0.1 °/h per g.
const FORCE: [[f64; 3]; 3] = [
    [5e-8, -2e-8, 3e-8],
    [1e-8, 6e-8, -4e-8],
    [-3e-8, 2e-8, 5e-8],
];

/// 1 µrad per m/s², 2″ per g, at most.
const TILT_BY_FORCE: [f64; 6] = [2e-7, -3e-7, 1.5e-7, 4e-7, -2e-7, 3e-7];
/// 0.02 °/h per g².
const FORCE_SQUARED: [f64; 3] = [1e-9, -2e-9, 1.5e-9];
/// Up to 0.2″ per g.
const ELASTIC_BY_FORCE: [[f64; 3]; 3] = [
    [1e-7, -4e-8, 3e-8],
    [2e-8, 8e-8, -5e-8],
    [-3e-8, 6e-8, 1e-7],
];
const ELASTIC_BY_JERK: [[f64; 3]; 3] = [
    [5e-9, -1e-8, 2e-8],
    [1e-8, 4e-9, -2e-8],
    [2e-8, 1e-8, -3e-9],
];
/// 0.1 °/h per Gauss.
const MAGNETIC: [[f64; 3]; 3] = [[5e-3, -2e-3, 1e-3], [1e-3, 4e-3, 3e-3], [-3e-3, 2e-3, 5e-3]];
/// A hundredth of a suspension's flexure at 100 rad/s².
const CUBIC_FLEXURE: [f64; 6] = [1e-13, -5e-14, 8e-14, 1e-13, -9e-14, 7e-14];
/// A suspension whose mode is in the motion's reach.
const MODE: [f64; 8] = [6e-8, 7e-8, 7.5e-8, 6.5e-8, 8e-8, 7e-8, 150.0, 0.03];
/// 0.1 % at the dither's amplitude.
const DITHER_CUBIC: [f64; 3] = [2000.0, -3000.0, 1500.0];
const CROSSTALK: [f64; 6] = [1e-3, -2e-3, 1e-3, 3e-3, -1e-3, 2e-3];
/// 20 µg per g².
const ACCEL_QUADRATIC: [f64; 3] = [2e-6, -1.5e-6, 2.5e-6];

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn by_temperature(values: &[f64], second: &[f64]) -> Vec<f64> {
    [&[0.0; 3], values, second].concat()
}

/// Gyros that are late: each shows the rate at another time.
fn late(t: f64, delays: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| true_rates(t - delays[axis])[axis])
}

/// Adds the effect of tilts \[xy, xz, yx, yz, zx, zy\] to the true rates.
fn tilted(t: f64, [xy, xz, yx, yz, zx, zy]: [f64; 6]) -> [f64; 3] {
    let [x, y, z] = true_rates(t);
    [
        x + xz * y - xy * z,
        y + yx * z - yz * x,
        z + zy * x - zx * y,
    ]
}

pub fn errors() -> Vec<Error> {
    let of_gyros = |name, records, gyros| Error {
        name,
        records,
        gyros,
        accelerometers: true_forces,
        blocks: |pickoff| pickoff,
    };
    let of_blocks = |name, records, blocks| Error {
        name,
        records,
        gyros: true_rates,
        accelerometers: true_forces,
        blocks,
    };
    let of_accelerometers = |name, records, accelerometers| Error {
        name,
        records,
        gyros: true_rates,
        accelerometers,
        blocks: |pickoff| pickoff,
    };
    vec![
        of_gyros(
            "bias by temperature",
            vec![(K::GyroBiasTemperature, by_temperature(&BIAS, &BIAS_SECOND))],
            |t| {
                let w = warmed(t);
                more(t, |i| BIAS[i] * w[i] + BIAS_SECOND[i] * w[i].powi(2))
            },
        ),
        of_gyros(
            "bias by temperature rate",
            vec![(K::GyroBiasTemperatureRate, BIAS_RATE.to_vec())],
            |t| more(t, |i| BIAS_RATE[i] * motion(t).temperature_rate_k_s[i]),
        ),
        of_gyros(
            "scale by temperature",
            vec![(K::GyroScaleTemperature, by_temperature(&SCALE, &[0.0; 3]))],
            |t| more(t, |i| SCALE[i] * warmed(t)[i] * true_rates(t)[i]),
        ),
        of_gyros(
            "installation by temperature",
            vec![(K::InstallationTemperature, by_temperature(&TILT, &[0.0; 6]))],
            |t| {
                let [x, y, z] = warmed(t);
                let by = [x, x, y, y, z, z];
                tilted(t, [0, 1, 2, 3, 4, 5].map(|at| TILT[at] * by[at]))
            },
        ),
        of_gyros("gyro delay", vec![(K::GyroDelay, DELAY.to_vec())], |t| {
            late(t, DELAY)
        }),
        of_gyros(
            "gyro bandwidth",
            vec![(K::GyroBandwidth, VARIANCE.to_vec())],
            |t| more(t, |i| 0.5 * VARIANCE[i] * motion(t).rate_second[i]),
        ),
        of_gyros(
            "scale asymmetry",
            vec![(K::GyroScaleAsymmetry, ASYMMETRY.to_vec())],
            |t| more(t, |i| ASYMMETRY[i] * true_rates(t)[i].abs()),
        ),
        of_gyros(
            "scale, quadratic",
            vec![(K::GyroScaleQuadratic, QUADRATIC.to_vec())],
            |t| more(t, |i| QUADRATIC[i] * true_rates(t)[i].powi(2)),
        ),
        of_gyros(
            "scale, cubic",
            vec![(K::GyroScaleCubic, CUBIC.to_vec())],
            |t| more(t, |i| CUBIC[i] * true_rates(t)[i].powi(3)),
        ),
        of_gyros("bias by force", vec![(K::GyroGBias, FORCE.concat())], |t| {
            more(t, |i| dot(FORCE[i], true_forces(t)))
        }),
        of_gyros(
            "tilt by force",
            vec![(K::AxisTiltByForce, TILT_BY_FORCE.to_vec())],
            |t| {
                let [x, y, z] = true_forces(t);
                let third = [z, y, z, x, y, x];
                tilted(
                    t,
                    [0, 1, 2, 3, 4, 5].map(|at| TILT_BY_FORCE[at] * third[at]),
                )
            },
        ),
        of_gyros(
            "bias by force squared",
            vec![(K::GyroG2Bias, FORCE_SQUARED.to_vec())],
            |t| more(t, |i| FORCE_SQUARED[i] * true_forces(t)[i].powi(2)),
        ),
        of_gyros(
            "elastic rate by force",
            vec![(K::ElasticRateByForce, ELASTIC_BY_FORCE.concat())],
            |t| more(t, |i| dot(ELASTIC_BY_FORCE[i], motion(t).force_rate_m_s3)),
        ),
        of_gyros(
            "elastic rate by jerk",
            vec![(K::ElasticRateByJerk, ELASTIC_BY_JERK.concat())],
            |t| more(t, |i| dot(ELASTIC_BY_JERK[i], motion(t).rate_second)),
        ),
        of_gyros(
            "bias by magnetic field",
            vec![(K::GyroBiasMagnetic, MAGNETIC.concat())],
            |t| more(t, |i| dot(MAGNETIC[i], field_t(t))),
        ),
        of_gyros(
            "flexure, cubic",
            vec![(K::AxisFlexureCubic, CUBIC_FLEXURE.to_vec())],
            |t| {
                let [x, y, z] = acceleration(t, None);
                let about = [y, z, x, z, x, y];
                tilted(
                    t,
                    [0, 1, 2, 3, 4, 5].map(|at| -CUBIC_FLEXURE[at] * about[at].powi(3)),
                )
            },
        ),
        of_gyros(
            "flexure, resonant",
            vec![(K::AxisFlexureMode, MODE.to_vec())],
            |t| {
                let [x, y, z] = acceleration(t, Some((MODE[6], MODE[7])));
                let about = [y, z, x, z, x, y];
                tilted(t, [0, 1, 2, 3, 4, 5].map(|at| -MODE[at] * about[at]))
            },
        ),
        of_blocks(
            "pickoff, cubic",
            vec![(K::DitherCubic, DITHER_CUBIC.to_vec())],
            |p| [0, 1, 2].map(|i| p[i] + DITHER_CUBIC[i] * p[i].powi(3)),
        ),
        of_blocks(
            "dither crosstalk",
            vec![(K::DitherCrosstalk, CROSSTALK.to_vec())],
            |[x, y, z]| {
                let [xy, xz, yx, yz, zx, zy] = CROSSTALK;
                [
                    x + xy * y + xz * z,
                    y + yx * x + yz * z,
                    z + zx * x + zy * y,
                ]
            },
        ),
        of_accelerometers(
            "accelerometer, quadratic",
            vec![(K::AccelQuadratic, ACCEL_QUADRATIC.to_vec())],
            |t| {
                let f = true_forces(t);
                [0, 1, 2].map(|i| f[i] + ACCEL_QUADRATIC[i] * f[i].powi(2))
            },
        ),
        of_accelerometers(
            "accelerometer delay",
            vec![(K::AccelDelay, DELAY.to_vec())],
            |t| [0, 1, 2].map(|axis| true_forces(t - DELAY[axis])[axis]),
        ),
    ]
}
