//! Cost of each optional term in a sample: images with one term each, beside the image without any.
//!
//! All play the same motion with accelerometers, so that every term acts. That each term gives the host's bits is what
//! `tests/target/terms.rs` shows.

use rlg::error::InputError;
use rlg::target::records::records_of;
use rlg::target::{Image, Platform, SlotImages, TargetCore, emulator};
use trueaxis::run_report::CostRecord;
use trueaxis::{AccelerometerParameters, CrossAxis, Parameters, Sample, TermKind};

use super::{SAMPLES_PER_OUTPUT, parameters, samples};

/// Records of a term: kinds with their values.
type Records = &'static [(TermKind, &'static [f64])];

/// Terms in the order of `AllTerms`, each with the records by which it acts.
const TERMS: [(&str, Records); 12] = [
    (
        "by temperature: bias, its rate, scale, installation",
        &[
            (
                TermKind::GyroBiasTemperature,
                &[293.0, 293.0, 293.0, 1e-8, 2e-8, 3e-8, 0.0, 0.0, 0.0],
            ),
            (TermKind::GyroBiasTemperatureRate, &[1e-6, 2e-6, 3e-6]),
            (
                TermKind::GyroScaleTemperature,
                &[293.0, 293.0, 293.0, 1e-6, 2e-6, 3e-6, 0.0, 0.0, 0.0],
            ),
        ],
    ),
    (
        "bias by magnetic field",
        &[(TermKind::GyroBiasMagnetic, &[1e-4; 9])],
    ),
    (
        "dither crosstalk, cubic",
        &[
            (TermKind::DitherCubic, &[2000.0, -3000.0, 1500.0]),
            (
                TermKind::DitherCrosstalk,
                &[1e-3, -2e-3, 1e-3, 3e-3, -1e-3, 2e-3],
            ),
        ],
    ),
    (
        "gyro delay, bandwidth",
        &[
            (TermKind::GyroDelay, &[20e-6, -10e-6, 15e-6]),
            (TermKind::GyroBandwidth, &[1e-9, 2e-9, 3e-9]),
        ],
    ),
    (
        "scale asymmetry, quadratic, cubic",
        &[
            (TermKind::GyroScaleAsymmetry, &[1e-5, -2e-5, 3e-5]),
            (TermKind::GyroScaleQuadratic, &[1e-5, -2e-5, 1.5e-5]),
            (TermKind::GyroScaleCubic, &[2e-6, 1e-6, -3e-6]),
        ],
    ),
    ("bias by force", &[(TermKind::GyroGBias, &[5e-8; 9])]),
    (
        "tilt by force, bias by force squared",
        &[
            (
                TermKind::AxisTiltByForce,
                &[2e-7, -1e-7, 3e-7, 1e-7, -2e-7, 2e-7],
            ),
            (TermKind::GyroG2Bias, &[1e-9, -2e-9, 1.5e-9]),
        ],
    ),
    (
        "elastic rate by force and by jerk",
        &[
            (TermKind::ElasticRateByForce, &[1e-7; 9]),
            (TermKind::ElasticRateByJerk, &[1e-9; 9]),
        ],
    ),
    (
        "cubic flexure",
        &[(TermKind::AxisFlexureCubic, &[3e-13; 6])],
    ),
    (
        "resonant flexure",
        &[(
            TermKind::AxisFlexureMode,
            &[6e-8, 7e-8, 7.5e-8, 6.5e-8, 8e-8, 7e-8, 150.0, 0.03],
        )],
    ),
    (
        "accelerometer delay",
        &[(TermKind::AccelDelay, &[-15e-6, 25e-6, 40e-6])],
    ),
    (
        "accelerometer quadratic",
        &[(TermKind::AccelQuadratic, &[2e-6, -1e-6, 3e-6])],
    ),
];

/// Velocity of one code \[m/s\]; a g is 400 codes a sample.
const CODE_M_S: f64 = 6.1e-6;

/// The chain of the other table, with accelerometers.
fn with_accelerometers() -> Parameters {
    parameters().with(|p| {
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [CODE_M_S; 3],
            bias_m_s2: [3.1e-3, -4.7e-3, 2.2e-3],
            scale_error: [2.1e-4, -3.4e-4, 1.6e-4],
            misalignment_rad: CrossAxis::from_array([2e-4, -1e-4, -3e-4, 2e-4, 3e-4, -2e-4]),
            lever_arm_m: [
                [0.045, 0.012, -0.018],
                [-0.011, 0.05, 0.016],
                [-0.021, 0.014, 0.038],
            ],
        });
    })
}

/// The other table's motion on a unit that weighs 1 g along z.
fn motion(parameters: &Parameters) -> Vec<Sample> {
    let mut played = samples(parameters);
    for (at, sample) in played.iter_mut().enumerate() {
        let sway = (at % 16) as i32;
        sample.accelerometer_codes = [sway, -sway, 400 + sway];
    }
    played
}

/// Mean instructions of one image: of samples between outputs, of samples that complete one.
fn cost(image: &Image, parameters: &Parameters) -> Result<[f64; 2], InputError> {
    let records = records_of(motion(parameters));
    let slots = SlotImages::both(parameters);
    let report = emulator::run(&image.path, &slots, &records, &mut |_| {})?.report;
    if report.periods as usize != records.len() {
        return Err(InputError::new(&image.path, "did not play every sample"));
    }
    let mean = |cost: &CostRecord| cost.sum as f64 / f64::from(cost.count.max(1));
    Ok([mean(&report.between_outputs), mean(&report.with_output)])
}

/// The table.
pub fn table() -> Result<String, InputError> {
    let known = with_accelerometers();
    let mut lines = vec![
        "| term, alone in the image | f32, between outputs | with one | a sample | fixed, between outputs | with one | a sample |".to_owned(),
        "|---|---|---|---|---|---|---|".to_owned(),
    ];
    let cores = [TargetCore::F32, TargetCore::Fixed];
    let share = 1.0 / f64::from(SAMPLES_PER_OUTPUT);
    let a_sample = |[between, with]: [f64; 2]| between + share * (with - between);
    let mut bare = Vec::new();
    for core in cores {
        bare.push(cost(&Image::build(Platform::Emulator, core)?, &known)?);
    }
    let of = |costs: &[[f64; 2]]| -> String {
        let cells = costs
            .iter()
            .map(|one| format!("{:.1} | {:.1} | {:.1}", one[0], one[1], a_sample(*one)));
        cells.collect::<Vec<_>>().join(" | ")
    };
    lines.push(format!("| none | {} |", of(&bare)));
    for (place, (name, records)) in TERMS.iter().enumerate() {
        let mut parameters = known;
        for (kind, values) in *records {
            parameters.terms.push(*kind, values).map_err(|error| {
                InputError::new("stages", format!("has a record that does not fit: {error}"))
            })?;
        }
        let mut added = Vec::new();
        for (core, bare) in cores.into_iter().zip(&bare) {
            let image = Image::build_with_term(core, place)?;
            let [between, with] = cost(&image, &parameters)?;
            added.push([between - bare[0], with - bare[1]]);
        }
        eprintln!("{name}: {added:.1?}");
        lines.push(format!("| + {name} | {} |", of(&added)));
    }
    Ok(lines.join("\n") + "\n")
}
