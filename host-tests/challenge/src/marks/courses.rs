//! Motions of the marks' trials, drawn: rate tables, ships, vehicles, aircraft, slow cones, and weak motion.

use std::f64::consts::PI;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::motion::{Motion, Term};
use super::setting::{MotionKind, Setting, log_uniform, one_of, sign};

/// Number of lines that approximate a continuous spectrum.
const LINES: usize = 24;

/// Draws the motion of a setting.
pub fn draw(setting: &Setting, rng: &mut ChaCha8Rng) -> Motion {
    match setting.motion {
        MotionKind::SineOneAxis => table_sine(1, setting, rng),
        MotionKind::SineTwoAxes => table_sine(2, setting, rng),
        MotionKind::SineThreeAxes => table_sine(3, setting, rng),
        MotionKind::Steps => steps(setting, rng),
        MotionKind::Sweep => sweep(setting, rng),
        MotionKind::Ship => ship(rng),
        MotionKind::Vehicle => vehicle((setting.rate_hz, setting.length_s()), rng),
        MotionKind::Aircraft => aircraft(setting.length_s(), rng),
        MotionKind::SlowConing => slow_coning(rng),
        MotionKind::Weak => weak(setting, rng),
    }
}

fn phase(rng: &mut ChaCha8Rng) -> f64 {
    2.0 * PI * rng.random::<f64>()
}

/// Sine of random phase.
pub fn sine(amplitude_rad: f64, frequency_hz: f64, rng: &mut ChaCha8Rng) -> Term {
    Term::Sine {
        amplitude_rad,
        angular_frequency_rad_s: 2.0 * PI * frequency_hz,
        phase_rad: phase(rng),
    }
}

/// Some axes in random order.
fn axes(count: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let first = rng.random_range(0..3);
    let turn = if rng.random_bool(0.5) { 1 } else { 2 };
    (0..count).map(|place| (first + turn * place) % 3).collect()
}

fn table_sine(count: usize, setting: &Setting, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    for axis in axes(count, rng) {
        let frequency_hz = log_uniform(rng, 0.05, (setting.rate_hz / 20.0).min(2.0));
        let rate_rad_s = log_uniform(rng, 0.03, 1.0);
        let amplitude_rad = (rate_rad_s / (2.0 * PI * frequency_hz)).min(0.5);
        motion.terms[axis].push(sine(amplitude_rad, frequency_hz, rng));
    }
    motion
}

fn steps(setting: &Setting, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let used_count = rng.random_range(1..=3);
    let used = axes(used_count, rng);
    let mut time_s = log_uniform(rng, 1.0, 4.0);
    while time_s < setting.length_s() {
        let duration_s = log_uniform(rng, 1.0, 3.0);
        motion.terms[one_of(rng, &used)].push(Term::Turn {
            start_s: time_s,
            duration_s,
            angle_rad: sign(rng) * log_uniform(rng, 0.15, 1.5),
        });
        time_s += duration_s + log_uniform(rng, 2.0, 8.0);
    }
    motion
}

fn sweep(setting: &Setting, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let count = rng.random_range(1..=3);
    for axis in axes(count, rng) {
        let first_hz = log_uniform(rng, 0.05, 0.3);
        let last_hz = log_uniform(rng, 1.0, (setting.rate_hz / 15.0).clamp(2.0, 12.0));
        let peak_rad_s = log_uniform(rng, 0.1, 0.6);
        motion.terms[axis].push(Term::Chirp {
            amplitude_rad: peak_rad_s / (2.0 * PI * last_hz),
            angular_frequency_rad_s: 2.0 * PI * first_hz,
            sweep_rad_s2: 2.0 * PI * (last_hz - first_hz) / setting.length_s(),
            phase_rad: phase(rng),
        });
    }
    motion
}

fn ship(rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    // roll, pitch, yaw: periods \[s\] and amplitudes \[rad\]
    let seaway = [
        ([8.0, 12.0], [0.08, 0.25]),
        ([5.0, 8.0], [0.02, 0.08]),
        ([9.0, 16.0], [0.01, 0.05]),
    ];
    for (axis, (periods_s, amplitudes_rad)) in seaway.into_iter().enumerate() {
        let middle_hz = 1.0 / log_uniform(rng, periods_s[0], periods_s[1]);
        let amplitude_rad = log_uniform(rng, amplitudes_rad[0], amplitudes_rad[1]);
        const WAVES: usize = 6;
        for _ in 0..WAVES {
            let share = log_uniform(rng, 0.3, 1.0) / (WAVES as f64).sqrt();
            let frequency_hz = middle_hz * log_uniform(rng, 0.75, 1.3);
            motion.terms[axis].push(sine(amplitude_rad * share, frequency_hz, rng));
        }
    }
    motion
}

/// Returns lines between two frequencies with a total rate of `rms_rad_s`; a line's rate is proportional to f^`slope`.
pub fn band(
    low_hz: f64,
    high_hz: f64,
    slope: f64,
    rms_rad_s: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Term> {
    let lines: Vec<(f64, f64)> = (0..LINES)
        .map(|place| {
            let share = (place as f64 + rng.random::<f64>()) / LINES as f64;
            let frequency_hz = low_hz * (high_hz / low_hz).powf(share);
            (frequency_hz, frequency_hz.powf(slope))
        })
        .collect();
    let power: f64 = lines.iter().map(|(_, rate)| 0.5 * rate * rate).sum();
    lines
        .into_iter()
        .map(|(frequency_hz, rate)| {
            let rate_rad_s = rms_rad_s * rate / power.sqrt();
            sine(rate_rad_s / (2.0 * PI * frequency_hz), frequency_hz, rng)
        })
        .collect()
}

/// Returns successive rotations about an axis.
pub fn turns(
    length_s: f64,
    durations_s: [f64; 2],
    pauses_s: [f64; 2],
    angles_rad: [f64; 2],
    rng: &mut ChaCha8Rng,
) -> Vec<Term> {
    let mut list = Vec::new();
    let mut time_s = pauses_s[0] * rng.random::<f64>();
    while time_s < length_s {
        let duration_s = log_uniform(rng, durations_s[0], durations_s[1]);
        list.push(Term::Turn {
            start_s: time_s,
            duration_s,
            angle_rad: sign(rng) * log_uniform(rng, angles_rad[0], angles_rad[1]),
        });
        time_s += duration_s + log_uniform(rng, pauses_s[0], pauses_s[1]);
    }
    list
}

/// Turns, slopes and the vibration of a road, for recorders of a rate \[Hz\].
pub fn vehicle((rate_hz, length_s): (f64, f64), rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    motion.terms[2] = turns(length_s, [4.0, 10.0], [2.0, 12.0], [0.3, 1.6], rng);
    // the slope of the road
    motion.terms[1] = turns(length_s, [2.0, 6.0], [3.0, 15.0], [0.02, 0.1], rng);
    let high_hz = (rate_hz / 6.0).min(40.0);
    for axis in 0..3 {
        let rms_rad_s = log_uniform(rng, 0.01, 0.1);
        let road = band(1.0, high_hz, 0.0, rms_rad_s, rng);
        motion.terms[axis].extend(road);
    }
    motion
}

/// Slow turns in turbulence.
pub fn aircraft(length_s: f64, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    motion.terms[2] = turns(length_s, [15.0, 40.0], [10.0, 40.0], [0.3, 1.6], rng);
    motion.terms[0] = turns(length_s, [2.0, 5.0], [10.0, 30.0], [0.1, 0.5], rng);
    for axis in 0..3 {
        let rms_rad_s = log_uniform(rng, 0.005, 0.05);
        let turbulence = band(0.05, 5.0, -0.3, rms_rad_s, rng);
        motion.terms[axis].extend(turbulence);
    }
    motion
}

fn slow_coning(rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let about = rng.random_range(0..3);
    let angular_frequency_rad_s = 2.0 * PI * log_uniform(rng, 0.1, 1.0);
    let amplitude_rad = log_uniform(rng, 0.01, 0.1);
    let phase_rad = phase(rng);
    let turn = sign(rng);
    for (place, ahead_rad) in [(1, 0.0), (2, turn * PI / 2.0)] {
        motion.terms[(about + place) % 3].push(Term::Sine {
            amplitude_rad,
            angular_frequency_rad_s,
            phase_rad: phase_rad + ahead_rad,
        });
    }
    // The cone's axis rotates in the body at ½ A² Ω, with the sign of the cone's sense.
    motion.terms[about].push(Term::Spin {
        rate_rad_s: turn * 0.5 * amplitude_rad * amplitude_rad * angular_frequency_rad_s,
    });
    motion
}

/// Lines over a wide band with a density of a few times the reference's noise.
fn weak(setting: &Setting, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let low_hz = 0.05;
    let high_hz = (setting.rate_hz / 8.0).min(8.0);
    let over_noise = log_uniform(rng, 2.0, 8.0);
    for axis in 0..3 {
        let width_hz = (high_hz - low_hz) / LINES as f64;
        for line in 0..LINES {
            let frequency_hz = low_hz + (line as f64 + rng.random::<f64>()) * width_hz;
            // half of a line's power is at the negative frequency
            let density = over_noise * setting.reference_rate_density(frequency_hz);
            let rate_rad_s = 2.0 * (density * width_hz).sqrt();
            let amplitude_rad = rate_rad_s / (2.0 * PI * frequency_hz);
            motion.terms[axis].push(sine(amplitude_rad, frequency_hz, rng));
        }
    }
    motion
}
