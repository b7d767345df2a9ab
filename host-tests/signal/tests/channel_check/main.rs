//! Gyros that follow a reference in another order, sign or unit, against simulated motion and noise.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rlg_plan::ChannelPlan;
use rlg_signal::channel_check::{Crossing, check};

mod same_motion;

const RATE_HZ: f64 = 100.0;
const ROWS: usize = 4000;

/// Evenly distributed with unit variance, by a congruential generator.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 12.0_f64.sqrt()
    }
}

/// A simulated pair of instruments.
struct Pair {
    /// Gyros over reference.
    map: Matrix3<f64>,
    /// Rates \[rad/s\] of each axis.
    size: [f64; 3],
    /// Delay of the gyros \[s\].
    delay_s: f64,
    /// Noise of a row's rate \[rad/s\].
    gyro_noise: f64,
    /// Noise of the reference's angle \[rad\].
    reference_noise: f64,
    /// One frequency an axis, or several.
    tones: usize,
    /// The lowest \[Hz\].
    lowest_hz: f64,
}

impl Default for Pair {
    fn default() -> Self {
        Self {
            map: Matrix3::identity(),
            size: [1.0; 3],
            delay_s: 0.0,
            gyro_noise: 1e-3,
            reference_noise: 1e-5,
            tones: 5,
            lowest_hz: 0.31,
        }
    }
}

impl Pair {
    fn angle(&self, axis: usize, time_s: f64) -> f64 {
        (0..self.tones)
            .map(|tone| {
                let hz = self.lowest_hz * (1.0 + axis as f64 * 0.37) * (1.0 + tone as f64 * 1.618);
                let turn = std::f64::consts::TAU * hz;
                self.size[axis] / turn * (turn * time_s + axis as f64 + tone as f64).sin()
            })
            .sum()
    }

    fn crossing(&self) -> Option<Crossing> {
        self.crossing_behind(|gyros| gyros)
    }

    /// The same with gyros that something comes before.
    fn crossing_behind(&self, before: impl Fn(Vec<f64>) -> Vec<f64>) -> Option<Crossing> {
        let mut noise = noise(7);
        let mut errors: Vec<[f64; 3]> = (0..=ROWS)
            .map(|_| [0, 1, 2].map(|_| self.reference_noise * noise()))
            .collect();
        errors[0] = [0.0; 3];
        let turned = |row: usize, late_s: f64| {
            let at = |row: usize| row as f64 / RATE_HZ - late_s;
            Vector3::from_fn(|axis, _| self.angle(axis, at(row + 1)) - self.angle(axis, at(row)))
        };
        let mut gyros: [Vec<f64>; 3] = Default::default();
        let mut reference: [Vec<f64>; 3] = Default::default();
        for row in 0..ROWS {
            let seen = turned(row, 0.0);
            let sensed = self.map * turned(row, self.delay_s);
            for axis in 0..3 {
                let error = errors[row + 1][axis] - errors[row][axis];
                reference[axis].push(seen[axis] + error);
                gyros[axis].push(sensed[axis] + self.gyro_noise / RATE_HZ * noise());
            }
        }
        let gyros = gyros.map(before);
        let seen = vec![true; ROWS];
        check(
            [0, 1, 2].map(|axis| &gyros[axis][..]),
            [0, 1, 2].map(|axis| &reference[axis][..]),
            [1.0; 3],
            (&seen, RATE_HZ),
            &ChannelPlan::default(),
        )
    }
}

#[test]
fn ordinary_errors_are_none() {
    let tilt = Rotation3::from_euler_angles(0.1, -0.2, 0.2).into_inner();
    let scale = Matrix3::from_diagonal(&Vector3::new(0.872, 1.3, 0.7));
    for (which, map) in [Matrix3::identity(), tilt, scale, scale * tilt]
        .iter()
        .enumerate()
    {
        for delay_s in [0.0, 0.007, -0.032, 0.3, -0.48] {
            let pair = Pair {
                map: *map,
                delay_s,
                ..Pair::default()
            };
            assert!(pair.crossing().is_none(), "{which} {delay_s}");
        }
    }
}

#[test]
fn a_sign_on_one_axis_is_improper_at_any_delay_and_noise() {
    for delay_s in [0.0, 0.0068, 0.4] {
        for reference_noise in [1e-6, 1e-3] {
            let pair = Pair {
                map: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -0.97)),
                delay_s,
                reference_noise,
                ..Pair::default()
            };
            let found = pair.crossing().expect("a crossing");
            assert!(found.is_improper() && !found.has_factor());
            assert_eq!(found.order(), Some([(0, 1.0), (1, 1.0), (2, -1.0)]));
            assert!((found.measured.delay_s - delay_s).abs() < 2e-3, "{delay_s}");
        }
    }
}

#[test]
fn only_what_moves_is_judged() {
    let alone = |z: f64| Pair {
        map: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, z)),
        size: [0.0, 0.0, 5.0],
        ..Pair::default()
    };
    assert!(alone(0.97).crossing().is_none());
    let found = alone(-0.97).crossing().expect("a crossing");
    assert_eq!(found.measured.moves, [false, false, true]);
    assert!(found.is_improper());
    let still = Pair {
        size: [0.0; 3],
        ..Pair::default()
    };
    assert!(still.crossing().is_none());
    // A reference whose noise hides the motion does not test its axes.
    let hidden = Pair {
        map: -Matrix3::identity(),
        size: [1e-3; 3],
        reference_noise: 1.0,
        ..Pair::default()
    };
    assert!(hidden.crossing().is_none());
}

#[test]
fn proper_rotations_are_registration_and_exchanges_are_not() {
    let cyclic = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let side = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let half = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let tilt = Rotation3::from_euler_angles(0.05, -0.1, 0.1).into_inner();
    for proper in [cyclic, side, half] {
        let pair = Pair {
            map: proper * tilt,
            ..Pair::default()
        };
        let found = pair.crossing().expect("a crossing");
        assert!(found.is_registration());
        assert_eq!(found.axes, proper);
    }
    let skew = Rotation3::from_euler_angles(0.7, -0.4, 1.1).into_inner();
    let pair = Pair {
        map: skew,
        ..Pair::default()
    };
    let found = pair.crossing().expect("a crossing");
    assert!(found.is_registration() && found.order().is_none());
    assert!((found.axes - skew).amax() < 1e-3);
    let exchanged = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    for size in [[1.0; 3], [1.0, 1.0, 0.0]] {
        let pair = Pair {
            map: exchanged,
            size,
            ..Pair::default()
        };
        let found = pair.crossing().expect("a crossing");
        assert!(found.is_improper());
        assert_eq!(found.axes, exchanged);
    }
}

#[test]
fn gross_factors_are_found_with_their_size() {
    for factor in [2.0, 57.295_779_5, 1.0 / 57.295_779_5, 3600.0, 0.5] {
        let pair = Pair {
            map: factor * Matrix3::identity(),
            gyro_noise: 1e-3 * factor,
            ..Pair::default()
        };
        let found = pair.crossing().expect("a crossing");
        assert!(!found.is_improper() && !found.is_turned());
        for found in found.factors {
            assert!((found / factor - 1.0).abs() < 1e-3, "{found} {factor}");
        }
    }
    // Of slow motion a delay takes next to nothing.
    let slow = Pair {
        map: 2.0 * Matrix3::identity(),
        lowest_hz: 0.05,
        ..Pair::default()
    };
    assert!(slow.crossing().is_some_and(|found| found.has_factor()));
    // One gyro alone, with tilts: its row is stretched, not the columns.
    let tilt = Rotation3::from_euler_angles(0.05, -0.1, 0.1).into_inner();
    let pair = Pair {
        map: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 57.3)) * tilt,
        ..Pair::default()
    };
    let found = pair.crossing().expect("a crossing");
    assert_eq!(found.factors[..2], [1.0, 1.0]);
    assert!((found.factors[2] / 57.3 - 1.0).abs() < 1e-2 && !found.is_turned());
}

#[test]
fn at_one_frequency_a_likely_delay_is_no_sign() {
    let late_by_half_a_period = |lowest_hz: f64| Pair {
        delay_s: 0.5 / lowest_hz,
        lowest_hz,
        tones: 1,
        size: [1.0, 0.0, 0.0],
        ..Pair::default()
    };
    assert!(late_by_half_a_period(20.0).crossing().is_none());
    // Half a period is beyond any delay that is sought.
    let slow = late_by_half_a_period(0.31).crossing();
    assert!(slow.is_some_and(|found| found.is_improper()));
}

#[test]
fn a_filter_that_takes_most_of_the_motion_is_no_factor() {
    // One pole at a tenth of a hertz, below all motion.
    let share = 1.0 - (-std::f64::consts::TAU * 0.1 / RATE_HZ).exp();
    let filtered = |values: Vec<f64>| {
        let mut state = 0.0;
        let pass = |value: f64| {
            state += share * (value - state);
            state
        };
        values.into_iter().map(pass).collect()
    };
    let pair = Pair {
        gyro_noise: 1e-5,
        ..Pair::default()
    };
    let found = pair.crossing_behind(filtered);
    assert!(found.is_none(), "{found:?}");
}
