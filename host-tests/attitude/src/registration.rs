//! Registration: what aligns two instruments before any physics is thought of.
//!
//! Twenty numbers at once, always beside everything else, linear about the last values until those stand still: bias,
//! rotation, delay, clock rate, rotation of the navigation frame, bandwidth, scale and non-orthogonality
//! (inference.md, B4).

use nalgebra::{Matrix3, Vector3};
use rlg_model::Model;
use rlg_signal::attitude_samples::AttitudeSample;
use rlg_signal::axes::Triad;

use crate::conditioned::conditioned;
use crate::equations::{Band, Equations, Fit, ParameterColumn};
use crate::gyro_motion::GyroMotion;
use crate::increments::{Increments, ReferenceClock};
use crate::noise::NoiseTerms;
use crate::reference_faults;

/// A group of numbers of the registration.
pub struct Group {
    /// The contract's kind.
    pub kind: &'static str,
    /// Names of its numbers.
    pub names: &'static [&'static str],
    /// Unit.
    pub unit: &'static str,
    /// Standard deviation of a weak prior on each, about what the model says.
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
        prior_std: 7.292e-5,
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

/// Places of a group's numbers among all.
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

/// The group whose numbers stand at some places.
pub fn group_at(columns: &[usize]) -> Option<&'static Group> {
    let is_there = |group: &&Group| places(group.kind).eq(columns.iter().copied());
    GROUPS.iter().find(is_there)
}

/// Groups that are moved; the others stay as the model has them. Two that a motion cannot tell apart cancel each other far
/// from where any of this is linear.
pub type Free = Vec<&'static str>;

/// Number of all.
pub const COUNT: usize = 20;

/// Pairs of axes of the non-orthogonality.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Values that a registration is linear about.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Bias of the gyros beyond the model \[rad/s\].
    pub bias_rad_s: Vector3<f64>,
    /// What the gyros sense of the reference body's rate.
    pub sensed_from_body: Matrix3<f64>,
    /// How late the reference's stamps are \[s\].
    pub delay_s: f64,
    /// By which share the reference's clock is faster \[1\].
    pub clock_rate: f64,
    /// Time constants of a low pass of first order on each gyro \[s\]; `None` where smoothing stands for it, which is small
    /// enough for its second order.
    pub low_pass_s: Option<Vector3<f64>>,
}

/// What a low pass is believed to be, about what the model says \[s\].
const LOW_PASS_STD_S: f64 = 0.05;

impl Alignment {
    /// What a model's effects say of it.
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
                let (sign, senses) = rlg_catalogue::entries::tilt(gyro, about);
                let name = format!("{}{}", XYZ[gyro], XYZ[about]);
                map[(gyro, senses)] += sign * number("installation", &name);
            }
        }
        // A turned reference reads ω − r × ω to first order; of any size it is a rotation.
        let turn = nalgebra::Rotation3::from_scaled_axis(axes("reference_misalignment"));
        let low_pass_s =
            Vector3::from_fn(|axis, _| number("gyro_bandwidth", &format!("{}_pole_s", XYZ[axis])));
        Self {
            low_pass_s: (low_pass_s != Vector3::zeros()).then_some(low_pass_s),
            bias_rad_s: axes("gyro_bias"),
            sensed_from_body: turn.into_inner() * map,
            delay_s: number("reference_delay", "all"),
            clock_rate: number("reference_clock_rate", "all"),
        }
    }

    /// What it is beyond another, in the order of the columns; what is no part of it is 0.
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

    /// The same with all groups but some as a model has them.
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

    /// Moved by an estimate about it.
    pub fn moved(&self, by: &[f64]) -> Self {
        let triple = |kind: &str| Vector3::from_column_slice(&by[places(kind)]);
        let mut step = Matrix3::identity() + Matrix3::from_diagonal(&triple("gyro_scale"));
        for (pair, value) in PAIRS.iter().zip(&by[places("installation")]) {
            step[*pair] += value;
            step[(pair.1, pair.0)] += value;
        }
        let turn = nalgebra::Rotation3::from_scaled_axis(triple("reference_misalignment"));
        Self {
            bias_rad_s: self.bias_rad_s + triple("gyro_bias"),
            sensed_from_body: turn.into_inner() * step * self.sensed_from_body,
            delay_s: self.delay_s + by[places("reference_delay").start],
            clock_rate: self.clock_rate + by[places("reference_clock_rate").start],
            low_pass_s: self
                .low_pass_s
                .map(|low_pass_s| low_pass_s + triple("gyro_bandwidth")),
        }
    }
}

/// The rotation in a map, by polar decomposition, and what is left of the map: R, P of P R.
fn turn_and_stretch(map: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let svd = map.svd(true, true);
    let (Some(left), Some(right)) = (svd.u, svd.v_t) else {
        return (Vector3::zeros(), *map);
    };
    // By its quaternion: the angle of a matrix that rounding left just beyond a rotation by nothing is no number.
    let turn = nalgebra::Rotation3::from_matrix_unchecked(left * right);
    let turn = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
    let stretch = left * Matrix3::from_diagonal(&svd.singular_values) * left.transpose();
    (turn.scaled_axis(), stretch)
}

/// What the gyros sensed.
pub struct Gyros {
    /// When the first row begins \[s\].
    pub start_s: f64,
    /// Rows a second \[Hz\].
    pub rate_hz: f64,
    /// Increments that the gyros sensed, in the case's axes by the model, less what the model's other effects add \[rad\].
    pub sensed_rad: Vec<Vector3<f64>>,
    /// Unmeasured rows before each row boundary.
    pub lost_before: Vec<usize>,
}

/// Rows and motion about an alignment.
pub struct About {
    /// Attitude of the gyros' own.
    pub motion: GyroMotion,
    /// Rows.
    pub increments: Increments,
    /// Motion in the gyros' axes that columns are made of \[rad\].
    pub conditioned_rad: Triad,
    /// Rate of change of what the gyros sensed, where a low pass was undone \[rad by row and second\].
    growth_rad_s: Option<Vec<Vector3<f64>>>,
    body_from_sensed: Matrix3<f64>,
    clock: ReferenceClock,
}

impl About {
    /// Forms rows about an alignment; `None` where fewer than two stamps lie within the gyros' record.
    pub fn new(
        gyros: &Gyros,
        samples: &[AttitudeSample],
        left_out: &[bool],
        alignment: &Alignment,
    ) -> Option<Self> {
        let body_from_sensed = alignment.sensed_from_body.try_inverse()?;
        let bias_rad = alignment.bias_rad_s / gyros.rate_hz;
        let mut unbiased: Vec<Vector3<f64>> =
            gyros.sensed_rad.iter().map(|row| row - bias_rad).collect();
        let growth_rad_s = alignment.low_pass_s.map(|low_pass_s| {
            let growth = growth(&unbiased, gyros.rate_hz);
            for (row, growth) in unbiased.iter_mut().zip(&growth) {
                *row += low_pass_s.component_mul(growth);
            }
            growth
        });
        let body = unbiased.iter().map(|row| body_from_sensed * row).collect();
        let motion = GyroMotion::new(gyros.start_s, gyros.rate_hz, body);
        let times = |sample: &AttitudeSample| sample.time_s;
        let clock = ReferenceClock {
            delay_s: alignment.delay_s,
            rate: alignment.clock_rate,
            middle_s: 0.5 * (samples.first().map(times)? + samples.last().map(times)?),
        };
        let increments = Increments::new(&motion, samples, left_out, &clock, &gyros.lost_before)?;
        Some(Self {
            conditioned_rad: conditioned(&unbiased, gyros.rate_hz),
            motion,
            increments,
            growth_rad_s,
            body_from_sensed,
            clock,
        })
    }

    /// The column of increments that the gyros would sense besides \[rad by row\].
    pub fn carried(&self, sensed_rad: impl Fn(usize) -> Vector3<f64>) -> Triad {
        let sums = self
            .motion
            .carried_sum(|row| -(self.body_from_sensed * sensed_rad(row)));
        self.increments.carry(&sums)
    }

    /// Motion in the gyros' axes \[rad\].
    fn sensed(&self, row: usize) -> Vector3<f64> {
        let last = self.motion.rows() - 1;
        Vector3::from_fn(|axis, _| self.conditioned_rad[axis][row.min(last)])
    }

    /// The column of a filter on one gyro: half a variance times the second derivative of its rate, over a row; or a longer
    /// time constant of its low pass.
    fn filtered(&self, axis: usize, rate_hz: f64) -> Triad {
        let along = Vector3::ith(axis, 1.0);
        if let Some(growth_rad_s) = &self.growth_rad_s {
            return self.carried(|row| -along * growth_rad_s[row][axis]);
        }
        self.carried(|row| {
            let [before, now, after] =
                [row.saturating_sub(1), row, row + 1].map(|row| self.sensed(row)[axis]);
            along * (0.5 * rate_hz * rate_hz * (before - 2.0 * now + after))
        })
    }

    /// Columns of the registration, in the order of [`GROUPS`].
    pub fn columns(&self, rate_hz: f64) -> Vec<Triad> {
        let period_s = 1.0 / rate_hz;
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut columns: Vec<Triad> = Vec::with_capacity(COUNT);
        columns.extend(axes.map(|axis| self.carried(|_| axis * period_s)));
        columns.extend(axes.map(|axis| self.carried(|row| axis.cross(&self.sensed(row)))));
        let body = |row: usize| self.body_from_sensed * self.sensed(row);
        let rate =
            |boundary: usize| 0.5 * rate_hz * (body(boundary.saturating_sub(1)) + body(boundary));
        let [start_s, _] = self.motion.span_s();
        let late = self.motion.carried(|boundary| -rate(boundary));
        columns.push(self.increments.carry(&late));
        let since_middle =
            |boundary: usize| start_s + boundary as f64 * period_s - self.clock.middle_s;
        let drifted: Vec<Vector3<f64>> = late
            .iter()
            .enumerate()
            .map(|(boundary, late)| late * since_middle(boundary))
            .collect();
        columns.push(self.increments.carry(&drifted));
        columns.extend(axes.map(|axis| {
            let boundaries = 0..=self.motion.rows();
            let turned: Vec<Vector3<f64>> = boundaries
                .map(|boundary| axis * (-(boundary as f64) * period_s))
                .collect();
            self.increments.carry_in_navigation(&turned)
        }));
        columns.extend([0, 1, 2].map(|axis: usize| self.filtered(axis, rate_hz)));
        columns.extend(
            [0, 1, 2].map(|axis: usize| self.carried(|row| axes[axis] * self.sensed(row)[axis])),
        );
        columns.extend(PAIRS.map(|(a, b)| {
            self.carried(|row| axes[a] * self.sensed(row)[b] + axes[b] * self.sensed(row)[a])
        }));
        columns
    }
}

/// Rate of change of increments \[rad by row and second\], by central differences.
fn growth(increments_rad: &[Vector3<f64>], rate_hz: f64) -> Vec<Vector3<f64>> {
    let last = increments_rad.len() - 1;
    (0..=last)
        .map(|row| {
            let (from, to) = (row.saturating_sub(1), (row + 1).min(last));
            (increments_rad[to] - increments_rad[from]) * (rate_hz / (to - from) as f64)
        })
        .collect()
}

/// A registration that stands.
pub struct Registration {
    /// About what.
    pub alignment: Alignment,
    /// Levels of the noise terms.
    pub levels: Vec<f64>,
    /// Rows about it.
    pub about: About,
    /// Stamps without a usable reference.
    pub left_out: Vec<bool>,
    /// Log likelihood.
    pub log_likelihood: f64,
    /// Whether a low pass of the gyros explains as much as their delay.
    pub may_be_low_pass: bool,
    /// Standard deviation of the delay \[s\].
    delay_std_s: f64,
    /// Smoothing variances beside it \[s²\], and their standard deviations.
    smoothing_s2: [(f64, f64); 3],
    /// What outliers of single stamps were taken to be, in excess of what noise makes of them: subtracted from the rows.
    pub corrected_rad: Triad,
}

/// Most passes.
const PASSES: usize = 10;

/// Passes with plain noise: a bad start is not called wandering.
const PLAIN_PASSES: usize = 2;

/// A step of this many standard deviations is none.
const SETTLED: f64 = 0.1;

/// Aligns the reference with the gyros; a filter that is too long for its second order is tried as a low pass.
///
/// # Inputs
/// `tested`: stamps that serve the last test alone; `model`: what the model says.
pub fn register(
    gyros: &Gyros,
    samples: &[AttitudeSample],
    tested: &[bool],
    (model, start, free): (&Alignment, Alignment, &Free),
    progress: &dyn Fn(&str),
) -> Option<Registration> {
    let mut found = settle(gyros, samples, tested, (model, start, free), progress)?;
    let Some(time_s) = found.low_pass_s(model, free.len() < GROUPS.len()) else {
        return Some(found);
    };
    let start = Alignment {
        low_pass_s: Some(Vector3::repeat(time_s)),
        delay_s: found.alignment.delay_s + time_s,
        ..found.alignment.clone()
    };
    let mut free = free.clone();
    if !free.contains(&"gyro_bandwidth") {
        free.push("gyro_bandwidth");
    }
    let about = (model, start, &free);
    let Some(behind) = settle(gyros, samples, tested, about, progress) else {
        return Some(found);
    };
    let gain = behind.log_likelihood - found.log_likelihood;
    if gain > LOW_PASS_GAIN {
        return Some(behind);
    }
    found.may_be_low_pass = gain > -LOW_PASS_GAIN;
    Some(found)
}

impl Registration {
    /// Of rows that are too few for passes over their noise and faults.
    pub(crate) fn of_few(
        alignment: Alignment,
        about: About,
        (walk_rad_sqrt_s, angle_rad): (f64, f64),
        left_out: &[bool],
    ) -> Self {
        let rows = about.increments.rows();
        Self {
            levels: vec![
                walk_rad_sqrt_s.powi(2) * about.increments.period_s,
                angle_rad.powi(2),
            ],
            alignment,
            left_out: left_out.to_vec(),
            log_likelihood: 0.0,
            may_be_low_pass: false,
            delay_std_s: f64::INFINITY,
            smoothing_s2: [(0.0, f64::INFINITY); 3],
            corrected_rad: std::array::from_fn(|_| vec![0.0; rows]),
            about,
        }
    }
}

/// Gain in log likelihood of a low pass over a delay beside a small smoothing.
const LOW_PASS_GAIN: f64 = 5.0;

impl Registration {
    /// Time constant of a low pass that would smooth as much \[s\], where something is smoothed; or, once it is known what is
    /// called for, that would be as late.
    fn low_pass_s(&self, model: &Alignment, is_known: bool) -> Option<f64> {
        /// Standard deviations of what is worth a second look.
        const SEEN: f64 = 5.0;
        if self.alignment.low_pass_s.is_some() {
            return None;
        }
        let late_s = model.delay_s - self.alignment.delay_s;
        let is_smoothed = self
            .smoothing_s2
            .iter()
            .any(|(variance, std)| *variance > SEEN * std);
        let weights = self.smoothing_s2.map(|(_, std)| std.powi(-2));
        let sums = self.smoothing_s2.iter().zip(weights);
        let mean = sums
            .map(|((variance, _), weight)| variance * weight)
            .sum::<f64>()
            / weights.iter().sum::<f64>();
        let time_s = match is_smoothed && mean > 0.0 {
            true => mean.sqrt(),
            false if is_known => late_s,
            false => return None,
        };
        // A low pass is late, too: one that would need a delay against it is none.
        let is_late = late_s > SEEN * self.delay_std_s && (late_s - time_s).abs() < late_s;
        is_late.then_some(time_s)
    }
}

/// Passes until the alignment no longer changes.
fn settle(
    gyros: &Gyros,
    samples: &[AttitudeSample],
    tested: &[bool],
    (model, start, free): (&Alignment, Alignment, &Free),
    progress: &dyn Fn(&str),
) -> Option<Registration> {
    let kept: Vec<usize> = free.iter().flat_map(|kind| places(kind)).collect();
    let mut alignment = start;
    let mut levels: Option<Vec<f64>> = None;
    let mut pass = 0;
    loop {
        progress("aligning the reference");
        let is_plain = pass < PLAIN_PASSES;
        if pass == PLAIN_PASSES {
            levels = None;
        }
        let fitted = |left_out: &[bool], levels: Option<Vec<f64>>| {
            let about = About::new(gyros, samples, left_out, &alignment)?;
            let all = priced(about.columns(gyros.rate_hz), &alignment, model);
            let own = all.into_iter().enumerate();
            let own = own.filter(|(place, _)| kept.contains(place));
            let columns = own.map(|(_, column)| column).collect();
            let fitting = Fitting::new(&about.increments, columns, is_plain, levels);
            Some((about, fitting))
        };
        // What the last pass left out is looked at anew: far off, an error of the gyros looks like one of the reference.
        let mut left_out = tested.to_vec();
        let (mut about, mut fitting) = fitted(&left_out, levels.take())?;
        if pass > 0 && leave_out(&about, &fitting, &mut left_out) {
            let levels = fitting.fit.levels.clone();
            (about, fitting) = fitted(&left_out, Some(levels))?;
        }
        let mut corrected_rad: Triad = std::array::from_fn(|_| vec![0.0; about.increments.rows()]);
        if pass > 0 {
            for _ in 0..2 {
                fitting.shrink_outliers(&about.increments, &mut corrected_rad);
            }
        }
        let steps = Steps::new(&kept, &fitting.fit.estimate, &fitting.fit.std);
        pass += 1;
        if (pass > PLAIN_PASSES + 1 && steps.largest() < SETTLED) || pass == PASSES {
            return Some(Registration {
                log_likelihood: fitting.fit.log_likelihood,
                smoothing_s2: steps.smoothing_s2(),
                delay_std_s: steps.std[places("reference_delay").start],
                may_be_low_pass: false,
                alignment,
                levels: fitting.fit.levels,
                about,
                left_out,
                corrected_rad,
            });
        }
        alignment = alignment.moved(&steps.estimate);
        levels = Some(fitting.fit.levels);
    }
}

/// Leaves out stamps at which the reference is wrong; whether there are any.
fn leave_out(about: &About, fitting: &Fitting, left_out: &mut [bool]) -> bool {
    let left_rad = fitting.left_rad(&about.increments.rows_rad);
    let faulty = reference_faults::find(&about.increments, &left_rad, &about.motion);
    let stamps = about.increments.stamps.iter().zip(&faulty);
    for (stamp, _) in stamps.filter(|(_, is_faulty)| **is_faulty) {
        left_out[*stamp] = true;
    }
    faulty.contains(&true)
}

/// Estimates of all numbers, those that stay at 0.
pub(crate) struct Steps {
    /// By place.
    pub(crate) estimate: [f64; COUNT],
    std: [f64; COUNT],
}

impl Steps {
    /// # Inputs
    /// `kept`: places that are moved, with their estimates and standard deviations.
    pub(crate) fn new(kept: &[usize], estimate: &[f64], std: &[f64]) -> Self {
        let mut steps = Self {
            estimate: [0.0; COUNT],
            std: [f64::INFINITY; COUNT],
        };
        for (place, (estimate, std)) in kept.iter().zip(estimate.iter().zip(std)) {
            steps.estimate[*place] = *estimate;
            steps.std[*place] = *std;
        }
        steps
    }

    /// The largest step of what the rows are linear about \[σ\].
    pub(crate) fn largest(&self) -> f64 {
        let is_linear = |k: &usize| {
            let kinds = ["reference_clock_rate", "earth_rate", "gyro_bandwidth"];
            kinds.iter().any(|kind| places(kind).contains(k))
        };
        let moved = (0..COUNT).filter(|k| !is_linear(k));
        moved
            .map(|k| self.estimate[k].abs() / self.std[k])
            .fold(0.0, f64::max)
    }

    fn smoothing_s2(&self) -> [(f64, f64); 3] {
        let first = places("gyro_bandwidth").start;
        std::array::from_fn(|axis| (self.estimate[first + axis], self.std[first + axis]))
    }
}

/// Columns about an alignment with the priors of their groups, about what the model says.
pub fn priced(
    columns: Vec<Triad>,
    alignment: &Alignment,
    model: &Alignment,
) -> Vec<ParameterColumn> {
    let beyond = alignment.beyond(model);
    let stds = GROUPS.iter().flat_map(|group| {
        let std = match (group.kind, alignment.low_pass_s) {
            ("gyro_bandwidth", Some(_)) => LOW_PASS_STD_S,
            _ => group.prior_std,
        };
        group.names.iter().map(move |_| std)
    });
    columns
        .into_iter()
        .zip(stds)
        .zip(beyond)
        .map(|((values, prior_std), beyond)| ParameterColumn {
            values,
            prior_std,
            prior_mean: -beyond,
        })
        .collect()
}

/// All columns fitted to some rows.
pub struct Fitting {
    band: Band,
    terms: NoiseTerms,
    equations: Equations,
    columns: Vec<ParameterColumn>,
    free: Vec<usize>,
    /// The fit.
    pub fit: Fit,
}

impl Fitting {
    /// Fits columns to rows, the noise from `levels`.
    pub fn new(
        increments: &Increments,
        columns: Vec<ParameterColumn>,
        is_plain: bool,
        levels: Option<Vec<f64>>,
    ) -> Self {
        let band = Band::new(increments.rows(), increments.period_s);
        let terms = NoiseTerms::new(increments.rows(), increments.period_s, band.cut, is_plain);
        let rows_rad = &increments.rows_rad;
        let equations = Equations::new(&band, &terms, rows_rad, &columns, &increments.free);
        let start = levels
            .filter(|levels| levels.len() == terms.count())
            .unwrap_or_else(|| terms.start(equations.energy()));
        let fit = equations.fit(&terms, &start);
        Self {
            band,
            terms,
            equations,
            columns,
            free: increments.free.clone(),
            fit,
        }
    }

    /// Rows less the fitted columns \[rad\].
    pub fn left_rad(&self, rows_rad: &Triad) -> Triad {
        let mut left = rows_rad.clone();
        for (column, size) in self.columns.iter().zip(&self.fit.estimate) {
            for (left, values) in left.iter_mut().zip(&column.values) {
                rlg_signal::axes::add(left, values, -size);
            }
        }
        left
    }

    /// Shrinks the errors of single stamps beyond what noise makes, adds them to `corrected_rad`, and fits again.
    pub fn shrink_outliers(&mut self, increments: &Increments, corrected_rad: &mut Triad) {
        let mut rows_rad = increments.rows_rad.clone();
        rlg_signal::axes::add_triad(&mut rows_rad, corrected_rad, -1.0);
        let mut left = self.left_rad(&rows_rad);
        for &row in &self.free {
            left.iter_mut().for_each(|left| left[row] = 0.0);
        }
        let powers = self.terms.of_coefficients(&self.fit.levels);
        let errors = reference_faults::outliers(&self.band, &self.terms, &left, &powers);
        for (rows, (corrected, errors)) in rows_rad
            .iter_mut()
            .zip(corrected_rad.iter_mut().zip(&errors))
        {
            for row in 0..rows.len() {
                let grown = errors[row + 1] - errors[row];
                rows[row] -= grown;
                corrected[row] += grown;
            }
        }
        self.equations
            .set_records(&self.band, &self.terms, &rows_rad);
        self.fit = self.equations.fit(&self.terms, &self.fit.levels);
    }
}
