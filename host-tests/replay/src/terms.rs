//! Converts the records of the core's optional terms to the reference's calibration.

use rlg_reference::Six;
use rlg_reference::flexure::{FlexureCalibration, ModeCalibration};
use rlg_reference::terms::{ByTemperature, TermCalibration};
use trueaxis::{CrossAxis, Parameters, TermKind, TermRecords};

/// Converts the records, each kind in the order of values documented in [`TermKind`].
pub fn term_calibration(records: &TermRecords) -> TermCalibration {
    let installation: [f64; 15] = records.values(TermKind::InstallationTemperature);
    let [t0, t1, t2, xy, xz, yx, yz, zx, zy, second @ ..] = installation;
    let nine = |kind: TermKind| {
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = records.values(kind);
        [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]
    };
    TermCalibration {
        bias_temperature: triads(records.values(TermKind::GyroBiasTemperature)),
        bias_temperature_rate: records.values(TermKind::GyroBiasTemperatureRate),
        scale_temperature: triads(records.values(TermKind::GyroScaleTemperature)),
        installation_temperature: ByTemperature {
            reference_k: [t0, t1, t2],
            first: six([xy, xz, yx, yz, zx, zy]),
            second: six(second),
        },
        gyro_delay_s: records.values(TermKind::GyroDelay),
        gyro_variance_s2: records.values(TermKind::GyroBandwidth),
        asymmetry: records.values(TermKind::GyroScaleAsymmetry),
        quadratic_s: records.values(TermKind::GyroScaleQuadratic),
        cubic_s2: records.values(TermKind::GyroScaleCubic),
        bias_by_force: nine(TermKind::GyroGBias),
        elastic_by_force: nine(TermKind::ElasticRateByForce),
        elastic_by_jerk: nine(TermKind::ElasticRateByJerk),
        tilt_by_force: six(records.values(TermKind::AxisTiltByForce)),
        bias_by_force_squared: records.values(TermKind::GyroG2Bias),
        bias_magnetic: nine(TermKind::GyroBiasMagnetic),
        dither_cubic: records.values(TermKind::DitherCubic),
        dither_crosstalk: six(records.values(TermKind::DitherCrosstalk)),
        accelerometer_quadratic: records.values(TermKind::AccelQuadratic),
        accelerometer_delay_s: records.values(TermKind::AccelDelay),
    }
}

/// Flexure in all its forms.
pub fn flexure_calibration(parameters: &Parameters) -> FlexureCalibration {
    let records = &parameters.terms;
    let [k @ .., frequency_hz, damping] = records.values::<8>(TermKind::AxisFlexureMode);
    FlexureCalibration {
        linear_s2: crate::six(&parameters.flexure_s2),
        damping: parameters.flexure_response.damping(),
        cubic: six(records.values(TermKind::AxisFlexureCubic)),
        mode: ModeCalibration {
            flexure_s2: six(k),
            frequency_hz,
            damping,
        },
        pulse_rad: parameters.pulse_weight_rad,
    }
}

fn six(pairs: [f64; 6]) -> Six {
    crate::six(&CrossAxis::from_array(pairs))
}

fn triads([t0, t1, t2, x, y, z, xx, yy, zz]: [f64; 9]) -> ByTemperature<[f64; 3]> {
    ByTemperature {
        reference_k: [t0, t1, t2],
        first: [x, y, z],
        second: [xx, yy, zz],
    }
}
