//! Kinds of effects observable on accelerometers: one row each (contract; Groves 2013, sec. 4.4.1; IEEE 1293).

use rlg_signal::axes::AXES;

/// Action of a kind's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Parameter i acts on accelerometer i.
    Axes,
    /// Parameter ij rotates the sensing axis of accelerometer i about body axis j.
    Tilts,
    /// Parameter ij is the position of accelerometer i along body axis j.
    Arms,
    /// Parameter i is the reference's error about body axis i, which rotates gravity through all accelerometers.
    Body,
    /// One parameter of the reference.
    All,
}

impl Law {
    /// Names of the parameters in the contract's order, with the accelerometers that each acts on.
    pub fn parameters(self) -> Vec<(String, Vec<usize>)> {
        let pairs = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        let named = |(i, j): (usize, usize)| (format!("{}{}", AXES[i], AXES[j]), vec![i]);
        match self {
            Self::Axes => (0..3)
                .map(|axis| (AXES[axis].to_string(), vec![axis]))
                .collect(),
            Self::Tilts => pairs.filter(|(i, j)| i != j).map(named).collect(),
            Self::Arms => pairs.map(named).collect(),
            Self::Body => AXES.map(|axis| (axis.to_string(), vec![0, 1, 2])).to_vec(),
            Self::All => vec![("all".to_string(), vec![0, 1, 2])],
        }
    }
}

/// One kind.
pub struct Kind {
    /// The contract's name.
    pub kind: &'static str,
    /// Equation of the kind.
    pub equation: &'static str,
    /// Unit of its parameters.
    pub unit: &'static str,
    /// Action of its parameters.
    pub law: Law,
    /// Standard deviation of the zero-mean prior, in the kind's unit: hardly exceeded by any unit under test.
    pub largest: f64,
    /// Size in a unit of some quality, for the sensitivity of a recording.
    pub typical: f64,
    /// An everyday error, three times likelier than others a priori.
    pub everyday: bool,
    /// Meaning for a navigation engineer.
    pub meaning: &'static str,
    /// Motion that would show it best.
    pub experiment: &'static str,
}

/// The kind that is not linear in its parameters.
pub const DELAY: &str = "accel_delay";

/// Drift of an accelerometer as a member of an equivalence class (IEEE 1293).
pub const DRIFT: &str = "acceleration_random_walk";

/// Every kind, in the order of the contract's table.
pub static KINDS: &[Kind] = &[
    Kind {
        kind: "accel_bias",
        equation: "f_i += b_i",
        unit: "m/s^2",
        law: Law::Axes,
        largest: 0.5,
        typical: 1e-3,
        everyday: true,
        meaning: "The model lacks a constant on the accelerometer: a bias, the same in every attitude.",
        experiment: "Stand still in six attitudes: a bias keeps its sign when gravity changes its own.",
    },
    Kind {
        kind: "accel_scale",
        equation: "f_i *= 1 + s_i",
        unit: "1",
        law: Law::Axes,
        largest: 0.05,
        typical: 1e-4,
        everyday: true,
        meaning: "The accelerometer has a scale error: its reading is off by a fixed share of the force.",
        experiment: "Turn each axis from up to down: a scale error then changes its sign and a bias does not.",
    },
    Kind {
        kind: "accel_misalignment",
        equation: "f_i += delta_ik f_j - delta_ij f_k, (i, j, k) cyclic",
        unit: "rad",
        law: Law::Tilts,
        largest: 0.05,
        typical: 1e-4,
        everyday: true,
        meaning: "The accelerometers are misaligned against the model: each senses a small share of the forces along the other axes.",
        experiment: "Roll the unit about two axes through full turns: each accelerometer must then show gravity along both others.",
    },
    Kind {
        kind: "accel_quadratic",
        equation: "f_i += q_i f_i^2",
        unit: "s^2/m",
        law: Law::Axes,
        largest: 1e-3,
        typical: 1e-6,
        everyday: false,
        meaning: "The accelerometer is not linear: its error grows with the square of the force, upwards and downwards alike.",
        experiment: "Turn each axis slowly from up over level to down: three forces separate the square from bias and scale.",
    },
    Kind {
        kind: DELAY,
        equation: "f_i(t - d_i) instead of f_i(t)",
        unit: "s",
        law: Law::Axes,
        largest: 0.1,
        typical: 1e-3,
        everyday: true,
        meaning: "The accelerometer channel is late (or early) against the motion by a fixed time that the model does not contain.",
        experiment: "Rock or tumble the unit at two speeds, so that gravity moves through its axes: a delay shows in proportion.",
    },
    Kind {
        kind: "size_effect",
        equation: "f_i += (alpha x r_i + omega x (omega x r_i))_i",
        unit: "m",
        law: Law::Arms,
        largest: 1.0,
        typical: 0.03,
        everyday: true,
        meaning: "The accelerometers are away from the centre of rotation and sense the rotation of the case: the model places all three in one point. Arms common to all three are the distance of the unit from its axes of rotation.",
        experiment: "Oscillate about each axis in turn, and spin about each: angular acceleration shows the arms across an axis, spinning those towards it.",
    },
];

/// Errors of the reference, which rotate gravity through the accelerometers; the gyros' rows show them too.
pub static REFERENCE_KINDS: &[Kind] = &[
    Kind {
        kind: "reference_misalignment",
        equation: "reference reads R(r)^T omega, omega - r x omega for small r",
        unit: "rad",
        law: Law::Body,
        largest: 0.3,
        typical: 1e-4,
        everyday: true,
        meaning: "The reference is rotated against the unit by small angles that the model does not contain.",
        experiment: "Turn the case about each axis through full turns, up and down: gravity then separates the reference's axes from the gyros'.",
    },
    Kind {
        kind: "reference_delay",
        equation: "reference shows omega(t - d)",
        unit: "s",
        law: Law::All,
        largest: 0.1,
        typical: 1e-4,
        everyday: true,
        meaning: "The reference's rows are late against the unit by a fixed time that the model does not contain.",
        experiment: "Oscillate at several frequencies: the error of a delay grows with the rate of change.",
    },
    Kind {
        kind: "reference_scale",
        equation: "reference reads (1 + r_i) omega_i",
        unit: "1",
        law: Law::Body,
        largest: 0.1,
        typical: 1e-5,
        everyday: true,
        meaning: "The reference has a scale error: its reading is off by a fixed share of the case's rotation.",
        experiment: "Turn the case about each axis through many full turns: gravity then returns, and counts them.",
    },
];

/// Row of a kind, of the accelerometers or of the reference.
pub fn find(kind: &str) -> Option<&'static Kind> {
    KINDS
        .iter()
        .chain(REFERENCE_KINDS)
        .find(|one| one.kind == kind)
}
