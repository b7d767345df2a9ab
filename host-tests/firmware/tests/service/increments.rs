//! Increments of single samples against the frames that hold their sums.

use trueaxis::sample_source::Reading;
use trueaxis::{
    AccelerometerParameters, CrossAxis, F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE,
    OUTPUT_RAD_PER_CODE, Parameters, Processor, Sample, SampleIncrement, Timing,
};

const PULSE_RAD: f64 = 3.9e-6;

/// A turn about one axis, so that there is no coning, with bias, scale and a steady force.
fn parameters() -> Parameters {
    Parameters::default().with(|known| {
        known.pulse_weight_rad = [PULSE_RAD; 3];
        known.bias_rad_s = [0.004, 0.0, 0.0];
        known.scale_error = [1e-3, 0.0, 0.0];
        known.samples_per_output = 20;
        known.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [1e-5; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
    })
}

fn sums_are_those_of_the_frame<N: NumberSystem>() {
    let boot = trueaxis::BootReport::default();
    let mut processor = Processor::<N>::new(&parameters(), boot).expect("in range");
    let mut sums = [[0.0_f64; 3]; 2];
    let mut frames = 0;
    for period in 0..200 {
        let sample = Sample {
            pulse_counts: [100 + period % 7, 0, 0],
            pickoff_codes: [0; 3],
            accelerometer_codes: [245, -3, period % 5],
        };
        let frame = processor.period(Reading::new(Some(sample), 1, None), Timing::default());
        let SampleIncrement {
            dtheta_rad,
            dvel_m_s,
            ..
        } = processor.increment();
        // The stream's first sample is none.
        assert_eq!(period < 1, dtheta_rad == [0.0; 3], "period {period}");
        for axis in 0..3 {
            sums[0][axis] += f64::from(dtheta_rad[axis]);
            sums[1][axis] += f64::from(dvel_m_s[axis]);
        }
        let Some(frame) = frame else { continue };
        let [angles, velocities] = std::mem::take(&mut sums);
        for axis in 0..3 {
            let angle = f64::from(frame.output.dtheta_codes[axis]) * OUTPUT_RAD_PER_CODE;
            let velocity = f64::from(frame.output.dvel_codes[axis]) * OUTPUT_M_S_PER_CODE;
            // Twenty roundings of a 24-bit number of 4e-4 rad, and of the fixed point's 2⁻³⁴; the frame's own code.
            assert!(
                (angles[axis] - angle).abs() < 2e-9,
                "{} {angle}",
                angles[axis]
            );
            // A turn of 8 mrad in the period turns the force: of second order, 4e-3 of its 49 mm/s.
            let turned = 5e-3 * 0.05;
            assert!(
                (velocities[axis] - velocity).abs() < turned,
                "{} {velocity}",
                velocities[axis]
            );
        }
        frames += 1;
    }
    assert_eq!(frames, 10);
    let lost = Reading::without_sample(trueaxis::sample_source::SourceFault::Bus);
    let _ = processor.period(lost, Timing::default());
    assert_eq!(processor.increment(), SampleIncrement::default());
}

#[test]
fn sums_of_single_increments_are_those_of_the_frame() {
    sums_are_those_of_the_frame::<F32>();
    sums_are_those_of_the_frame::<Fixed>();
}
