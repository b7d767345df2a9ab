//! The simulator's statistics equal those of its instrument file: Allan variance, densities, pulses.

use super::support::*;
use rlg::recording::Quantity;

/// Computes the overlapping Allan variance of rates, from a running angle and `m` rows \[(rad/s)²\].
fn allan_variance(angle_rad: &[f64], m: usize, period_s: f64) -> f64 {
    let tau = m as f64 * period_s;
    let differences = (0..angle_rad.len() - 2 * m)
        .map(|k| angle_rad[k + 2 * m] - 2.0 * angle_rad[k + m] + angle_rad[k]);
    let count = (angle_rad.len() - 2 * m) as f64;
    differences.map(|d| d * d).sum::<f64>() / (2.0 * tau * tau * count)
}

fn running(increments: impl Iterator<Item = f64>) -> Vec<f64> {
    std::iter::once(0.0)
        .chain(increments.scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        }))
        .collect()
}

/// Returns four relative standard deviations of an Allan variance of white or walking rate from `rows` rows in spans of `m`:
/// two spans are one degree of freedom, and more than that if they overlap.
fn allowed(rows: usize, m: usize) -> f64 {
    4.0 * (2.0 * m as f64 / rows as f64).sqrt()
}

fn standing(seconds: f64) -> String {
    format!("[[motion]]\nkind = \"still\"\nduration_s = {seconds}\n")
}

#[test]
fn allan_curve_of_a_dithered_gyro_is_its_walk_its_pulses_and_its_pickoff() {
    const WALK: f64 = 5.8e-7;
    const PULSE: f64 = 2e-6;
    const PICKOFF: f64 = 6e-7;
    let text = PERFECT
        .replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6")
        .replace(
            "angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]",
            "angle_random_walk_rad_sqrt_s = [5.8e-7, 5.8e-7, 5.8e-7]",
        )
        + &DITHER.replace("[0.0, 0.0, 0.0]", "[6e-7, 6e-7, 6e-7]")
        + &standing(120.0);
    let simulation = run(&text, 7);
    for (axis, gain) in [1.0, 1.01, 0.99].into_iter().enumerate() {
        let pickoff = channel(&simulation.recording, Quantity::DitherAngle, axis);
        let sensed = sensed_rad(&simulation, axis);
        let angle =
            running((1..sensed.len()).map(|k| sensed[k] - gain * (pickoff[k] - pickoff[k - 1])));
        for m in [1, 10, 100, 1000, 8000] {
            let tau = m as f64 / 4000.0;
            let white_angle = PULSE.powi(2) / 12.0 + (gain * PICKOFF).powi(2);
            let expected = WALK.powi(2) / tau + 3.0 * white_angle / tau.powi(2);
            let measured = allan_variance(&angle, m, 1.0 / 4000.0);
            let ratio = measured / expected;
            println!(
                "gyro {axis}, {tau} s: Allan deviation {:.3e} rad/s, {ratio:.3} of it in square",
                measured.sqrt()
            );
            assert!((ratio - 1.0).abs() < allowed(angle.len(), m), "{ratio}");
        }
    }
}

#[test]
fn allan_curves_of_undithered_gyros_show_walk_and_wander_of_the_bias() {
    // two hours at 100 Hz: only the long spans matter
    let text = PERFECT
        .replace("rate_hz = 4000.0", "rate_hz = 100.0")
        .replace(
            "[gyro]",
            "[gyro]\noutput = \"increment\"\nrate_random_walk_rad_s_sqrt_s = [2e-7, 2e-7, 2e-7]",
        )
        .replace(
            "angle_random_walk_rad_sqrt_s = [0.0, 0.0, 0.0]",
            "angle_random_walk_rad_sqrt_s = [1e-6, 1e-6, 1e-6]",
        )
        + "[fibre_optic]\nangle_random_walk_rad_sqrt_s = 2e-6\nrate_random_walk_rad_s_sqrt_s = 3e-7\n\
           angle_noise_rad = 1e-6\nweight_rad = 1e-9\n"
        + &standing(7200.0);
    let simulation = run(&text, 3);
    let ours: Vec<&[f64]> = (0..3)
        .map(|axis| channel(&simulation.recording, Quantity::GyroIncrement, axis))
        .collect();
    let fibre = &simulation.recording.tables[1].channels;
    let fibre: Vec<&[f64]> = fibre.iter().map(|c| &c.values[..]).collect();
    for (triad, walk, wander, white_angle) in [
        (ours, 1e-6_f64, 2e-7_f64, 0.0_f64),
        (fibre, 2e-6, 3e-7, 1e-6),
    ] {
        let angles: Vec<_> = triad
            .iter()
            .map(|values| running(values.iter().copied()))
            .collect();
        for m in [1_usize, 10, 100, 1000, 10_000] {
            let tau = m as f64 / 100.0;
            let expected = walk.powi(2) / tau
                + wander.powi(2) * tau / 3.0
                + 3.0 * white_angle.powi(2) / (tau * tau);
            let variances = angles.iter().map(|angle| allan_variance(angle, m, 0.01));
            let ratio = variances.sum::<f64>() / 3.0 / expected;
            println!("{tau} s: {ratio:.3} of the Allan variance stated");
            let allowed = allowed(3 * angles[0].len(), m);
            assert!((ratio - 1.0).abs() < allowed, "{tau} s: {ratio}, {allowed}");
        }
    }
}

#[test]
fn sensors_have_the_density_that_the_instrument_states_in_every_octave() {
    let text = PERFECT.to_owned()
        + "[accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
           noise_m_s2_sqrt_hz = 4.5e-5\nweight_m_s2 = 1e-9\n"
        + &standing(60.0);
    let simulation = run(&text, 3);
    for axis in 0..3 {
        let values = channel(&simulation.recording, Quantity::SpecificForce, axis);
        // means over 2m rows less means of their halves: a band of an octave, of n² fs/(4m) if white
        for m in [1_usize, 4, 16, 64, 256] {
            let means: Vec<f64> = values
                .chunks_exact(m)
                .map(|rows| rows.iter().sum::<f64>() / m as f64)
                .collect();
            let pairs = means
                .chunks_exact(2)
                .map(|pair| (0.5 * (pair[1] - pair[0])).powi(2));
            let count = pairs.len() as f64;
            let expected = 4.5e-5_f64.powi(2) * 2000.0 / (2.0 * m as f64);
            let ratio = pairs.sum::<f64>() / count / expected;
            assert!(
                (ratio - 1.0).abs() < 4.0 * (2.0 / count).sqrt(),
                "{m}: {ratio}"
            );
        }
    }
}

#[test]
fn pulses_of_a_steady_rate_come_in_two_neighbouring_counts_in_the_right_proportion() {
    // 3.3 pulses a row
    let rate = 3.3 * 2e-6 * 4000.0;
    let text = PERFECT
        .replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6")
        .replace("bias_rad_s = [0.0", &format!("bias_rad_s = [{rate}"))
        + &standing(10.0);
    let simulation = run(&text, 1);
    let counts = channel(&simulation.recording, Quantity::GyroCount, 0);
    let fours = counts.iter().filter(|count| **count == 4.0).count() as f64;
    let threes = counts.iter().filter(|count| **count == 3.0).count() as f64;
    assert_eq!(fours + threes, 40_000.0);
    // the sum is the angle to a pulse
    assert!((fours - 0.3 * 40_000.0).abs() <= 1.0, "{fours}");
}

#[test]
fn pulses_of_a_dithered_gyro_err_as_the_difference_of_two_uniform_remainders() {
    let text =
        PERFECT.replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6") + DITHER + &standing(20.0);
    let simulation = run(&text, 5);
    let pickoff = channel(&simulation.recording, Quantity::DitherAngle, 0);
    let counts = channel(&simulation.recording, Quantity::GyroCount, 0);
    let errors: Vec<f64> = (1..counts.len())
        .map(|row| counts[row] - (pickoff[row] - pickoff[row - 1]) / 2e-6)
        .collect();
    let count = errors.len() as f64;
    let moment = |power: i32| errors.iter().map(|e| e.powi(power)).sum::<f64>() / count;
    assert!(errors.iter().all(|error| error.abs() < 1.0));
    // a triangle from −1 to 1: 1/6, and 1/15 in the fourth moment. Neighbours share a remainder, which telescopes
    // in the mean and widens the others' deviations by less than √2: 4·√2·√(7/180 / count)
    assert!((moment(2) - 1.0 / 6.0).abs() < 4.0 * (2.0 * 7.0 / 180.0 / count).sqrt());
    assert!((moment(4) - 1.0 / 15.0).abs() < 4.0 * (2.0 * 1.0 / 45.0 / count).sqrt());
    assert!(moment(1).abs() < 1.0 / count);
    // white in angle: neighbouring errors are correlated by −½
    let lag = errors.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / count;
    assert!((lag / moment(2) + 0.5).abs() < 4.0 / count.sqrt(), "{lag}");
}
