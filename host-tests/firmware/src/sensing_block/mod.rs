//! Simulates the sensing block of a dithered triad whose sensing axes tilt under angular acceleration, with the true
//! attitude: the reference for the chain's flexure compensation.
//!
//! The motion is known in closed form ([`Motion`]: sums of sines, a steady rate, a smooth start). Every sampling period is
//! cut into [`SUBSTEPS`] substeps with three Gauss–Legendre nodes each. On them
//! - the true rotation of the body is integrated by a Magnus expansion of sixth order ([`mod@attitude`]),
//! - each tilt follows its equation of motion ([`mod@tilt`]), and
//! - the rate about each tilted axis is integrated to the angle that its pulses count ([`mod@block`]).
//!
//! The equations are written from the physics, not from the chain: nothing here estimates an angular acceleration from
//! increments, and no increment of one gyro multiplies that of another.
//!
//! [`measure`] composes the chain's output frames to an attitude and gives its drift from the true one.
//!
//! ```text
//! let motion = Motion::coning(0, 100.0, 0.6);
//! let unit = Unit::fine().with(|u| u.flexure = Flexure::rigid([70e-9; 6]));
//! let recording = Recording::new(&motion, &[unit], 4000.0, 40_000);
//! let error = measure::attitude_error::<Fixed>(&unit.chain_parameters(&unit.flexure), &recording, 0);
//! println!("{:?} deg/h", error.drift(1.0, motion.period_s()).mean_deg_h);
//! ```

pub mod attitude;
pub mod block;
pub mod known;
pub mod measure;
pub mod motion;
pub mod tilt;

pub use attitude::Quaternion;
pub use block::{BlockDither, SensingBlock, Unit};
pub use measure::{AttitudeError, Drift};
pub use motion::{Motion, Phases, Tone};
pub use tilt::{Flexure, Mode};

use trueaxis::Sample;

use motion::Grid;

/// Three components along body axes x, y, z.
pub type Vector = [f64; 3];

/// Substeps of a sampling period.
pub const SUBSTEPS: usize = 16;

/// Gauss–Legendre nodes of a substep, as shares of it, and their weights: exact for polynomials of degree 5.
pub const NODES: [f64; 3] = [0.112_701_665_379_258_31, 0.5, 0.887_298_334_620_741_7];
/// Weights of [`NODES`].
pub const WEIGHTS: [f64; 3] = [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0];

/// Rate and angular acceleration of the body at the nodes of one substep, body axes \[rad/s, rad/s²\].
#[derive(Debug, Clone, Copy, Default)]
pub struct Substep {
    /// Body rate ω at the nodes \[rad/s\].
    pub rate: [Vector; 3],
    /// Its derivative α at the nodes \[rad/s²\].
    pub acceleration: [Vector; 3],
}

/// A motion as several units saw it.
pub struct Recording {
    /// Sampling period \[s\].
    pub period_s: f64,
    /// True rotation of the body over each sampling period, in body axes at its start.
    pub rotations: Vec<Quaternion>,
    /// Samples of each unit, in the order in which the units were given.
    pub samples: Vec<Vec<Sample>>,
}

impl Recording {
    /// Moves the units through `count` sampling periods of the motion, which starts at rest at time 0.
    pub fn new(motion: &Motion, units: &[Unit], sample_rate_hz: f64, count: usize) -> Self {
        let period_s = 1.0 / sample_rate_hz;
        let step_s = period_s / SUBSTEPS as f64;
        let mut grid = Grid::new(motion, period_s);
        let mut blocks: Vec<_> = units
            .iter()
            .map(|unit| SensingBlock::new(unit, step_s))
            .collect();
        let mut samples: Vec<_> = units.iter().map(|_| Vec::with_capacity(count)).collect();
        let mut rotations = Vec::with_capacity(count);
        for _ in 0..count {
            let substeps = grid.next_period();
            let mut rotation = Quaternion::IDENTITY;
            for substep in substeps {
                let step = attitude::magnus(&substep.rate, step_s);
                rotation = rotation.times(Quaternion::from_rotation_vector(step));
            }
            rotations.push(rotation);
            for (block, samples) in blocks.iter_mut().zip(&mut samples) {
                samples.push(block.sense(substeps));
            }
        }
        Self {
            period_s,
            rotations,
            samples,
        }
    }
}
