//! Motions of trials with an attitude reference, drawn: rates about body axes in closed form.

use std::f64::consts::PI;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::marks::courses::{aircraft, band, sine, turns, vehicle};
use crate::marks::motion::{Motion, Term};
use crate::marks::setting::{log_uniform, name_of, one_of, sign};

/// Motion of the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// Moved in the hand.
    Hand,
    /// Rate table oscillating about one axis, tilting slowly about the others.
    Table,
    /// Turns and slopes, vibration of the road.
    Vehicle,
    /// Cone of some hertz, with a slow rotation.
    Coning,
    /// Successive rotations about x, y and z, at rest between them.
    Slews,
    /// Slow oscillation about three axes.
    Tumble,
    /// Moved by hand for two fifths of the time, then still.
    Burst,
    /// Slow turns in turbulence.
    Flight,
}

/// All motions.
pub const COURSES: [Course; 8] = [
    Course::Hand,
    Course::Table,
    Course::Vehicle,
    Course::Coning,
    Course::Slews,
    Course::Tumble,
    Course::Burst,
    Course::Flight,
];

impl Course {
    /// Draws the rotation of a recording.
    pub fn draw(self, (rate_hz, length_s): (f64, f64), rng: &mut ChaCha8Rng) -> Motion {
        match self {
            Self::Hand => hand(rng),
            Self::Table => table(length_s, rng),
            Self::Vehicle => vehicle((rate_hz, length_s), rng),
            Self::Coning => coning(rng),
            Self::Slews => slews(length_s, rng),
            Self::Tumble => tumble(rng),
            Self::Burst => burst(length_s, rng),
            Self::Flight => aircraft(length_s, rng),
        }
    }

    /// Draws the acceleration of the case, along body axes, as the rate of a [`Motion`] \[m/s² for rad/s\].
    pub fn acceleration(self, rng: &mut ChaCha8Rng) -> Motion {
        let [low_hz, high_hz, least, most] = match self {
            Self::Hand => [0.3, 3.0, 0.3, 3.0],
            Self::Vehicle => [0.3, 8.0, 0.2, 1.0],
            Self::Flight => [0.05, 5.0, 0.2, 2.0],
            _ => return Motion::default(),
        };
        let mut motion = Motion::default();
        for axis in 0..3 {
            let rms_m_s2 = log_uniform(rng, least, most);
            motion.terms[axis] = band(low_hz, high_hz, 0.0, rms_m_s2, rng);
        }
        motion
    }

    /// Returns the name in files.
    pub fn name(self) -> String {
        name_of(&self)
    }
}

fn hand(rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    for axis in 0..3 {
        let high_hz = log_uniform(rng, 1.0, 3.0);
        let rms_rad_s = log_uniform(rng, 0.3, 1.5);
        motion.terms[axis] = band(0.1, high_hz, 0.0, rms_rad_s, rng);
    }
    motion
}

fn table(length_s: f64, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let axis = rng.random_range(0..3);
    motion.terms[axis] = turns(length_s, [2.0, 6.0], [0.5, 3.0], [1.0, 4.0], rng);
    for other in [1, 2] {
        let frequency_hz = log_uniform(rng, 0.05, 0.3);
        let rate_rad_s = log_uniform(rng, 0.05, 0.3);
        let tilting = sine(rate_rad_s / (2.0 * PI * frequency_hz), frequency_hz, rng);
        motion.terms[(axis + other) % 3].push(tilting);
    }
    motion
}

fn coning(rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let about = rng.random_range(0..3);
    let angular_frequency_rad_s = 2.0 * PI * log_uniform(rng, 1.0, 6.0);
    let amplitude_rad = log_uniform(rng, 0.02, 0.1);
    let phase_rad = 2.0 * PI * rng.random::<f64>();
    let quarter = sign(rng) * PI / 2.0;
    for (place, ahead_rad) in [(1, 0.0), (2, quarter)] {
        motion.terms[(about + place) % 3].push(Term::Sine {
            amplitude_rad,
            angular_frequency_rad_s,
            phase_rad: phase_rad + ahead_rad,
        });
    }
    let slow_hz = log_uniform(rng, 0.05, 0.2);
    let slow_rad = log_uniform(rng, 0.1, 0.5) / (2.0 * PI * slow_hz);
    motion.terms[about].push(sine(slow_rad, slow_hz, rng));
    motion
}

fn slews(length_s: f64, rng: &mut ChaCha8Rng) -> Motion {
    const TURNS: usize = 12;
    let mut motion = Motion::default();
    let every_s = length_s / TURNS as f64;
    for place in 0..TURNS {
        let back = if (place / 3) % 2 == 0 { 1.0 } else { -1.0 };
        motion.terms[place % 3].push(Term::Turn {
            start_s: (place as f64 + 0.2) * every_s,
            duration_s: 0.6 * every_s,
            angle_rad: back * log_uniform(rng, 0.5, 2.0),
        });
    }
    motion
}

fn tumble(rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    for axis in 0..3 {
        let frequency_hz = log_uniform(rng, 0.1, 0.5);
        let rate_rad_s = log_uniform(rng, 0.3, 0.8);
        motion.terms[axis].push(sine(
            rate_rad_s / (2.0 * PI * frequency_hz),
            frequency_hz,
            rng,
        ));
    }
    motion
}

fn burst(length_s: f64, rng: &mut ChaCha8Rng) -> Motion {
    let mut motion = Motion::default();
    let mut time_s = 0.1 * length_s;
    while time_s < 0.5 * length_s {
        let duration_s = log_uniform(rng, 0.2, 0.8);
        motion.terms[one_of(rng, &[0, 1, 2])].push(Term::Turn {
            start_s: time_s,
            duration_s,
            angle_rad: sign(rng) * log_uniform(rng, 0.1, 0.8),
        });
        time_s += 0.4 * duration_s;
    }
    motion
}
