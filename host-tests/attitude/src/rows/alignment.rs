//! Registration parameters of boresight, timing and gyro errors: twenty in eight groups, and their values.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rlg_model::Model;
use rlg_signal::still::ROTATION_RAD_S;

/// A group of registration parameters.
pub struct Group {
    /// Kind as named in the contract.
    pub kind: &'static str,
    /// Names of its parameters.
    pub names: &'static [&'static str],
    /// Unit of its parameters.
    pub unit: &'static str,
    /// Standard deviation of the weak prior on each parameter, centred on the model's value.
    pub prior_std: f64,
}

const XYZ: &[&str] = &["x", "y", "z"];

/// All groups, in the order of the columns.
pub static GROUPS: [Group; 8] = [
    Group {
        kind: "gyro_bias",
        names: XYZ,
        unit: "rad/s",
        prior_std: 0.05,
    },
    Group {
        kind: "reference_misalignment",
        names: XYZ,
        unit: "rad",
        prior_std: 0.3,
    },
    Group {
        kind: "reference_delay",
        names: &["all"],
        unit: "s",
        prior_std: 0.1,
    },
    Group {
        kind: "reference_clock_rate",
        names: &["all"],
        unit: "1",
        prior_std: 1e-4,
    },
    Group {
        kind: "earth_rate",
        names: XYZ,
        unit: "rad/s",
        prior_std: ROTATION_RAD_S,
    },
    Group {
        kind: "gyro_bandwidth",
        names: XYZ,
        unit: "s^2",
        prior_std: 2e-3,
    },
    Group {
        kind: "gyro_scale",
        names: XYZ,
        unit: "1",
        prior_std: 0.1,
    },
    Group {
        kind: "installation",
        names: &["xy", "xz", "yz"],
        unit: "rad",
        prior_std: 0.1,
    },
];

/// Column indices of a group's parameters.
pub fn places(kind: &str) -> std::ops::Range<usize> {
    let mut begin = 0;
    for group in &GROUPS {
        let end = begin + group.names.len();
        if group.kind == kind {
            return begin..end;
        }
        begin = end;
    }
    begin..begin
}

/// Kind of the registration parameter at a column index, and its number within the group.
pub(crate) fn parameter_at(place: usize) -> (&'static str, usize) {
    let mut own = GROUPS.iter().map(|group| (group.kind, places(group.kind)));
    let found = own.find(|(_, places)| places.contains(&place));
    found.map_or(("", 0), |(kind, places)| (kind, place - places.start))
}

/// Returns the group with these column indices.
pub fn group_at(columns: &[usize]) -> Option<&'static Group> {
    let is_there = |group: &&Group| places(group.kind).eq(columns.iter().copied());
    GROUPS.iter().find(is_there)
}

/// Estimated groups; the others are fixed at the model's values. Two groups not distinguishable by the motion would cancel
/// each other far outside the linear range.
pub type Free = Vec<&'static str>;

/// Sorts groups in the order of their columns.
pub(crate) fn in_order(kinds: impl Iterator<Item = &'static str>) -> Free {
    let kinds: Vec<&str> = kinds.collect();
    let groups = GROUPS.iter().map(|group| group.kind);
    groups.filter(|kind| kinds.contains(kind)).collect()
}

/// Number of registration parameters.
pub const COUNT: usize = 20;

/// Axis pairs of the non-orthogonality.
pub(crate) const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Linearisation point of a registration.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Gyro bias, that of the model's effects included \[rad/s\].
    pub bias_rad_s: Vector3<f64>,
    /// Map from the reference body's rate to the sensed rate.
    pub sensed_from_body: Matrix3<f64>,
    /// Delay of the reference's stamps \[s\].
    pub delay_s: f64,
    /// Relative rate error of the reference's clock, positive if fast \[1\].
    pub clock_rate: f64,
    /// Time constants of a first-order low pass on each gyro \[s\]; `None` if the smoothing is small enough for its second
    /// order, a variance.
    pub low_pass_s: Option<Vector3<f64>>,
    /// Rotation from the reference's axes to the case's, by the model.
    pub turn: Rotation3<f64>,
}

impl Alignment {
    /// Returns the rotation from the body's to the sensed axes, without scale and non-orthogonality.
    pub(crate) fn sensed_by_turn(&self) -> Rotation3<f64> {
        Rotation3::from_scaled_axis(turn_and_stretch(&self.sensed_from_body).0)
    }

    /// Returns the alignment stated by a model's effects.
    pub fn of_model(model: &Model) -> Self {
        let number = |kind: &str, name: &str| -> f64 {
            let of_kind = model.effects.iter().filter(|effect| effect.kind == kind);
            of_kind.map(|effect| effect.number(name)).sum()
        };
        let axes = |kind: &str| Vector3::from_fn(|axis, _| number(kind, XYZ[axis]));
        let scale = axes("gyro_scale") - axes("reference_scale");
        let mut map = Matrix3::identity() + Matrix3::from_diagonal(&scale);
        for gyro in 0..3 {
            for about in (0..3).filter(|about| *about != gyro) {
                let (sign, senses) = rlg_catalogue::entry::tilt(gyro, about);
                let name = format!("{}{}", XYZ[gyro], XYZ[about]);
                map[(gyro, senses)] += sign * number("installation", &name);
            }
        }
        // A turned reference reads ω − r × ω to first order; of any size it is a rotation.
        let turn = Rotation3::from_scaled_axis(axes("reference_misalignment"));
        let low_pass_s =
            Vector3::from_fn(|axis, _| number("gyro_bandwidth", &format!("{}_pole_s", XYZ[axis])));
        Self {
            low_pass_s: (low_pass_s != Vector3::zeros()).then_some(low_pass_s),
            bias_rad_s: axes("gyro_bias"),
            sensed_from_body: turn.into_inner() * map,
            turn,
            delay_s: number("reference_delay", "all"),
            clock_rate: number("reference_clock_rate", "all"),
        }
    }

    /// Returns the alignment of the gyros once a map of their channels is inverted on them.
    pub(crate) fn without(self, recorded_from_case: &Matrix3<f64>) -> Self {
        let Some(inverse) = recorded_from_case.try_inverse() else {
            return self;
        };
        if inverse == Matrix3::identity() {
            return self;
        }
        let axes = orthogonal(recorded_from_case);
        let back = axes.transpose();
        Self {
            bias_rad_s: inverse * self.bias_rad_s,
            sensed_from_body: back * self.sensed_from_body * axes,
            low_pass_s: self.low_pass_s.map(|low_pass_s| back.abs() * low_pass_s),
            turn: Rotation3::from_matrix_unchecked(back * self.turn.matrix() * axes),
            ..self
        }
    }

    /// Scale error of each gyro \[1\].
    pub fn scale_error(&self) -> Vector3<f64> {
        let (_, stretch) = turn_and_stretch(&self.sensed_from_body);
        stretch.diagonal().add_scalar(-1.0)
    }

    /// Returns the difference to another alignment, in the order of the columns; 0 for parameters not part of it.
    pub fn beyond(&self, other: &Self) -> [f64; COUNT] {
        let mut values = [0.0; COUNT];
        let mut set = |kind: &str, of: &[f64]| values[places(kind)].copy_from_slice(of);
        set("gyro_bias", (self.bias_rad_s - other.bias_rad_s).as_slice());
        set("reference_delay", &[self.delay_s - other.delay_s]);
        set(
            "reference_clock_rate",
            &[self.clock_rate - other.clock_rate],
        );
        if let Some(low_pass_s) = self.low_pass_s {
            let beyond = low_pass_s - other.low_pass_s.unwrap_or_default();
            set("gyro_bandwidth", beyond.as_slice());
        }
        let inverse = other.sensed_from_body.try_inverse().unwrap_or_default();
        let (turn_rad, stretch) = turn_and_stretch(&(self.sensed_from_body * inverse));
        set("reference_misalignment", turn_rad.as_slice());
        set(
            "gyro_scale",
            (stretch.diagonal().add_scalar(-1.0)).as_slice(),
        );
        set("installation", &PAIRS.map(|pair| stretch[pair]));
        values
    }

    /// Returns the alignment with all groups except the `free` ones at a model's values.
    pub fn with(&self, free: &Free, model: &Self) -> Self {
        let mut beyond = self.beyond(model);
        for group in GROUPS.iter().filter(|group| !free.contains(&group.kind)) {
            beyond[places(group.kind)].fill(0.0);
        }
        let is_filtered = free.contains(&"gyro_bandwidth") || model.low_pass_s.is_some();
        let begun = Self {
            low_pass_s: self
                .low_pass_s
                .filter(|_| is_filtered)
                .map(|_| model.low_pass_s.unwrap_or_default()),
            ..model.clone()
        };
        begun.moved(&beyond)
    }

    /// Returns the alignment moved by an estimated step.
    pub fn moved(&self, by: &[f64]) -> Self {
        let triple = |kind: &str| Vector3::from_column_slice(&by[places(kind)]);
        let mut step = Matrix3::identity() + Matrix3::from_diagonal(&triple("gyro_scale"));
        for (pair, value) in PAIRS.iter().zip(&by[places("installation")]) {
            step[*pair] += value;
            step[(pair.1, pair.0)] += value;
        }
        let turn = Rotation3::from_scaled_axis(triple("reference_misalignment"));
        Self {
            bias_rad_s: self.bias_rad_s + triple("gyro_bias"),
            sensed_from_body: turn.into_inner() * step * self.sensed_from_body,
            delay_s: self.delay_s + by[places("reference_delay").start],
            clock_rate: self.clock_rate + by[places("reference_clock_rate").start],
            low_pass_s: self
                .low_pass_s
                .map(|low_pass_s| low_pass_s + triple("gyro_bandwidth")),
            turn: self.turn,
        }
    }
}

/// Orthogonal matrix nearest to a map: its axes and signs without its factors.
pub(crate) fn orthogonal(map: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = map.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(left), Some(right)) if *map != Matrix3::identity() => left * right,
        _ => Matrix3::identity(),
    }
}

/// Polar decomposition P R of a map: the rotation vector of R, and the stretch P.
fn turn_and_stretch(map: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let svd = map.svd(true, true);
    let (Some(left), Some(right)) = (svd.u, svd.v_t) else {
        return (Vector3::zeros(), *map);
    };
    // By the quaternion: rounding can bring the trace of a rotation by nothing above 3, and the angle of such a matrix is
    // NaN.
    let turn = Rotation3::from_matrix_unchecked(left * right);
    let turn = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
    let stretch = left * Matrix3::from_diagonal(&svd.singular_values) * left.transpose();
    (turn.scaled_axis(), stretch)
}
