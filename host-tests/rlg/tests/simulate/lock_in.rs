//! Lock-in: the fast scheme compared with fine integration, and with known results on dithered lasers.

use super::support::*;
use rlg::recording::Quantity;
use rlg::simulate::dither::BlockDither;
use rlg::simulate::instrument::{Stream, stream};
use rlg::simulate::lock_in::{BeatPhase, sub_steps};
use std::f64::consts::TAU;

const PULSE_RAD: f64 = 2e-6;
const S: f64 = TAU / PULSE_RAD;

fn locked(threshold_rad_s: f64) -> String {
    format!("[[effect]]\nkind = \"lock_in\"\nx = {threshold_rad_s}\n")
}

fn biased(rate_rad_s: f64) -> String {
    PERFECT
        .replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6")
        .replace("bias_rad_s = [0.0", &format!("bias_rad_s = [{rate_rad_s}"))
}

/// Computes the mean rate of gyro x from `from` to `to` seconds.
fn mean_rate_rad_s(simulation: &rlg::simulate::Simulation, from: f64, to: f64) -> f64 {
    let rows = (from * 4000.0) as usize..(to * 4000.0) as usize;
    sensed_rad(simulation, 0)[rows].iter().sum::<f64>() / (to - from)
}

#[test]
fn undithered_laser_shows_nothing_below_the_threshold_and_adlers_rate_above() {
    const THRESHOLD: f64 = 1e-3;
    for over in [-0.9, 0.5, 0.99, 1.01, 1.5, -3.0, 20.0] {
        let rate = over * THRESHOLD;
        let text =
            biased(rate) + &locked(THRESHOLD) + "[[motion]]\nkind = \"still\"\nduration_s = 12.0\n";
        let shown = mean_rate_rad_s(&run(&text, 1), 2.0, 12.0);
        let expected = if f64::abs(over) < 1.0 {
            0.0
        } else {
            rate.signum() * (rate * rate - THRESHOLD * THRESHOLD).sqrt()
        };
        // the beat's phase at either end: one pulse, and one for the counter
        let allowed = 2.0 * PULSE_RAD / 10.0;
        assert!(
            (shown - expected).abs() < allowed,
            "{over}: {shown:e}, {expected:e}"
        );
    }
}

/// Computes the angle of the cavity since 0: a rate and a dither with a new amplitude each half-cycle.
fn cavity_rad(t: f64, rate_rad_s: f64, amplitudes_rad: &[f64], frequency_hz: f64) -> f64 {
    let half_cycle = (2.0 * frequency_hz * t).floor() as usize;
    rate_rad_s * t + amplitudes_rad[half_cycle] * (TAU * frequency_hz * t).sin()
}

#[test]
fn fast_scheme_follows_runge_kutta_in_fiftieths_of_a_pulse() {
    const PERIOD_S: f64 = 2.5e-4;
    let (frequency_hz, threshold, phase_rad) = (400.0, 2e-3, 0.7);
    let amplitudes: Vec<f64> = (0..40)
        .map(|n| 3e-4 + 1e-5 * f64::sin(7.3 * n as f64))
        .collect();
    let omega = TAU * frequency_hz;
    for rate_rad_s in [0.0, 3e-4, -2e-3] {
        let angle = |t| cavity_rad(t, rate_rad_s, &amplitudes, frequency_hz);
        let steps = sub_steps(3.1e-4 * omega * omega + 200.0, PULSE_RAD, PERIOD_S);
        let mut beat = BeatPhase::new(PULSE_RAD, threshold, phase_rad);
        let mut shown_rad = 0.0;
        // psi = S (angle + e), e' = -threshold sin(S (angle + e) + phase): only the slow part is integrated, in steps in
        // which the fastest dither moves by a fiftieth of a pulse
        let fine_s = PULSE_RAD / 50.0 / (3.1e-4 * omega);
        let slope = |t: f64, e: f64| -threshold * (S * (angle(t) + e) + phase_rad).sin();
        let (mut t, mut e) = (0.0, 0.0);
        let mut worst: f64 = 0.0;
        for row in 0..160 {
            let begin_s = f64::from(row) * PERIOD_S;
            let h = PERIOD_S / steps as f64;
            for step in 0..steps {
                let at = begin_s + step as f64 * h;
                shown_rad += beat.step(angle(at + h) - angle(at), h);
            }
            let end_s = begin_s + PERIOD_S;
            while t < end_s - 1e-12 {
                let h = fine_s.min(end_s - t);
                let k1 = slope(t, e);
                let k2 = slope(t + 0.5 * h, e + 0.5 * h * k1);
                let k3 = slope(t + 0.5 * h, e + 0.5 * h * k2);
                let k4 = slope(t + h, e + h * k3);
                e += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                t += h;
            }
            worst = worst.max((shown_rad - (angle(end_s) + e)).abs());
        }
        // effect of lock-in over these 32 turnarounds: kicks of threshold √(2π/(S α)), here a random walk of 32
        let kick = threshold * (TAU / (S * 3e-4 * omega * omega)).sqrt();
        let done = (angle(t) - (angle(t) + e)).abs();
        // 3 % of a kick a turnaround, of random sign; the end points' ripple is threshold/(S · dither rate)
        let allowed = 0.03 * kick * 32.0_f64.sqrt() * 4.0;
        assert!(
            worst < allowed,
            "{rate_rad_s}: {worst:e} of {kick:e}, {allowed:e}"
        );
        println!(
            "rate {rate_rad_s} rad/s: lock-in moved {done:.2e} rad, kick {kick:.2e}, scheme off by {worst:.1e}"
        );
    }
}

/// Pulse \[rad\], dither amplitude \[rad\] and frequency \[Hz\], threshold \[rad/s\].
const SETTINGS: [(f64, f64, f64, f64); 6] = [
    (2.0e-6, 7.3e-4, 392.6, 1.0e-3),
    (1.9e-6, 5.0e-4, 430.1, 2.4e-3),
    (4.0e-6, 9.0e-4, 474.8, 5.0e-4),
    (4.8e-6, 6.0e-4, 361.0, 1.5e-3),
    (2.4e-6, 9.7e-4, 350.3, 2.0e-3),
    (3.0e-6, 4.0e-4, 498.2, 8.0e-4),
];

/// Ω_L/√(S Ω_D) \[rad/√s\].
fn expected_walk((pulse, amplitude, frequency_hz, threshold): (f64, f64, f64, f64)) -> f64 {
    threshold / (TAU / pulse * TAU * frequency_hz * amplitude).sqrt()
}

#[test]
fn random_walk_of_the_beat_is_the_threshold_over_the_root_of_s_times_the_dither_rate() {
    const SECONDS: f64 = 60.0;
    const SPAN_S: f64 = 0.05;
    for setting in SETTINGS {
        let (pulse, amplitude, frequency_hz, threshold) = setting;
        let mut rng = stream(9, Stream::Dither, 0);
        let mut dither = BlockDither::new(frequency_hz, amplitude, 0.15, 0.0, SECONDS, &mut rng);
        let mut beat = BeatPhase::new(pulse, threshold, 1.0);
        let acceleration = 1.15 * amplitude * (TAU * frequency_hz).powi(2);
        let steps = 200 * sub_steps(acceleration, pulse, SPAN_S / 200.0);
        let h = SPAN_S / steps as f64;
        let spans = (SECONDS / SPAN_S) as usize;
        let mut square = 0.0;
        for span in 0..spans {
            let begin_s = span as f64 * SPAN_S;
            dither.reach(begin_s + SPAN_S);
            let mut before = dither.angle_rad(begin_s);
            let mut error = 0.0;
            for step in 1..=steps {
                let angle = dither.angle_rad(begin_s + step as f64 * h);
                error += beat.step(angle - before, h) - (angle - before);
                before = angle;
            }
            square += error * error;
        }
        let walk = (square / (spans as f64 * SPAN_S)).sqrt();
        let ratio = walk / expected_walk(setting);
        println!(
            "pulse {pulse:e} rad, {amplitude:e} rad at {frequency_hz} Hz, threshold {threshold:e} rad/s: \
             {walk:.3e} rad/sqrt(s), {ratio:.3} of the formula"
        );
        // the stated accuracy; the estimate from 1200 spans has a standard deviation of 2 %
        assert!((ratio - 1.0).abs() < 0.10, "{ratio}");
    }
}

#[test]
fn random_walk_stands_in_the_counts_too() {
    const WINDOW: usize = 1000;
    let list = |pick: fn(&(f64, f64, f64, f64)) -> f64| {
        let values: Vec<String> = SETTINGS[..3]
            .iter()
            .map(|s| format!("{:e}", pick(s)))
            .collect();
        format!("[{}]", values.join(", "))
    };
    let text = PERFECT.replace("[1e-13, 1e-13, 1e-13]", &list(|s| s.0))
        + &format!(
            "[dither]\nfrequency_hz = {}\namplitude_rad = {}\namplitude_spread = 0.15\n\
             pickoff_gain = [1.0, 1.0, 1.0]\npickoff_noise_rad = [0.0, 0.0, 0.0]\n\
             pickoff_weight_rad = 1e-13\n",
            list(|s| s.2),
            list(|s| s.1)
        )
        + "[[motion]]\nkind = \"still\"\nduration_s = 60.0\n[[effect]]\nkind = \"lock_in\"\n"
        + &format!(
            "x = {:e}\ny = {:e}\nz = {:e}\n",
            SETTINGS[0].3, SETTINGS[1].3, SETTINGS[2].3
        );
    let simulation = run(&text, 5);
    for (axis, setting) in SETTINGS[..3].iter().enumerate() {
        let pickoff = channel(&simulation.recording, Quantity::DitherAngle, axis);
        let sensed = sensed_rad(&simulation, axis);
        let mut angle = 0.0;
        let angles: Vec<f64> = (1..sensed.len())
            .map(|row| {
                angle += sensed[row] - (pickoff[row] - pickoff[row - 1]);
                angle
            })
            .collect();
        // means over windows, which average the counter's q²/12 out; neighbouring means of a walk σ√t differ by (2/3) σ² of
        // the window's length
        let means: Vec<f64> = angles
            .chunks_exact(WINDOW)
            .map(|window| window.iter().sum::<f64>() / WINDOW as f64)
            .collect();
        let differences = means.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        let variance = differences.sum::<f64>() / (means.len() - 1) as f64;
        let counter = setting.0.powi(2) / 6.0 / WINDOW as f64;
        let walk = ((variance - counter) / (2.0 / 3.0 * WINDOW as f64 / 4000.0)).sqrt();
        let ratio = walk / expected_walk(*setting);
        println!("gyro {axis}: {ratio:.3} of the formula in the counts");
        // four deviations: 239 differences, neighbours correlated by a quarter, ½√(2.25/239)
        assert!((ratio - 1.0).abs() < 0.20, "{ratio}");
    }
}

/// Computes the mean rate with a dither of `spread`, driven at `rate`.
fn dithered_rate(rate_rad_s: f64, spread: f64, threshold: f64) -> f64 {
    let dither = DITHER
        .replace("392.6", "400.0")
        .replace("7.3e-4", &format!("{BAND_AMPLITUDE_RAD}"))
        .replace(
            "amplitude_spread = 0.15",
            &format!("amplitude_spread = {spread}"),
        );
    let text = biased(rate_rad_s)
        + &dither
        + &locked(threshold)
        + "[[motion]]\nkind = \"still\"\nduration_s = 12.0\n";
    let simulation = run(&text, 3);
    let pickoff = channel(&simulation.recording, Quantity::DitherAngle, 0);
    let (from, to) = (8000, 48_000);
    let sensed = &sensed_rad(&simulation, 0)[from..to];
    (sensed.iter().sum::<f64>() - (pickoff[to - 1] - pickoff[from - 1])) / 10.0
}

/// S a = 1010.5 π: J_n(S a) of order 0 and 1 is √(1/(π S a)) for both, at π/4 from its maxima.
const BAND_AMPLITUDE_RAD: f64 = 1010.5 * PULSE_RAD / 2.0;

#[test]
fn dynamic_bands_lock_without_randomisation_and_vanish_with_it() {
    const THRESHOLD: f64 = 2e-3;
    // band n is at n pulses a dither cycle; its half-width is the threshold times |J_n(S a)|
    let sa = S * BAND_AMPLITUDE_RAD;
    let half_width = THRESHOLD * (1.0 / (std::f64::consts::PI * sa)).sqrt();
    for order in [0.0, 1.0] {
        let centre = order * 400.0 * PULSE_RAD;
        for share in [0.5, -0.5] {
            let driven = centre + share * half_width;
            let shown = dithered_rate(driven, 0.0, THRESHOLD);
            // locked: whole pulses a cycle, within a pulse at either end
            assert!(
                (shown - centre).abs() < 2.0 * PULSE_RAD / 10.0,
                "order {order}: {shown:e} for {driven:e}"
            );
        }
        let outside = centre + 2.0 * half_width;
        let shown = dithered_rate(outside, 0.0, THRESHOLD);
        let pulled = centre + 3.0_f64.sqrt() * half_width;
        // √(2² − 1²) of the half-width; the asymptotic J_n is accurate to 1/(8 S a), the neighbours pull by half²/spacing
        assert!(
            (shown - pulled).abs() < 0.02 * half_width + 2.0 * PULSE_RAD / 10.0,
            "{shown:e} against {pulled:e}"
        );
        let walk = THRESHOLD / (S * TAU * 400.0 * BAND_AMPLITUDE_RAD).sqrt();
        let driven = centre + 0.5 * half_width;
        let free = dithered_rate(driven, 0.15, THRESHOLD);
        let noise = walk / 10.0_f64.sqrt();
        println!(
            "band {order}: half-width {half_width:.2e} rad/s; randomised, driven {driven:.3e}, shown {free:.3e} +- {noise:.1e}"
        );
        // four deviations of the random walk of the band
        assert!(
            (free - driven).abs() < 4.0 * noise,
            "{free:e} for {driven:e}"
        );
    }
}
