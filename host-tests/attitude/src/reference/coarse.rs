//! Initial delay and rotation of the registration by a global search, before linearisation.

use nalgebra::{Matrix3, Vector3};
use rlg_plan::CoarseAttitudePlan;
use rlg_signal::attitude_samples::SlowSample;

use crate::rows::alignment::{Alignment, Free};
use crate::rows::gyro_motion::GyroMotion;
use crate::rows::linearised_rows::Gyros;

/// Turns of the reference, with the gyros' motion.
struct Compared {
    plan: CoarseAttitudePlan,
    motion: GyroMotion,
    turns: Vec<Turn>,
    /// Delay of highest correlation of the rates' magnitudes, or the model's if that is nearly as good \[s\].
    delay_s: f64,
}

impl Compared {
    /// Estimates the delay by a grid search; `None` if turns are too few.
    fn new(
        gyros: &Gyros,
        samples: &[SlowSample],
        tested: &[bool],
        of_model: &Alignment,
    ) -> Option<Self> {
        let plan = &gyros.plan.coarse;
        let motion = gyros.motion(gyros.sensed_rad.clone());
        let turns = turns(samples, tested, plan);
        if turns.len() < plan.least_turns {
            return None;
        }
        let delay_s = best_delay_s(&motion, &turns, of_model.delay_s, plan);
        Some(Self {
            plan: *plan,
            motion,
            turns,
            delay_s,
        })
    }

    fn left(&self, map: &Matrix3<f64>) -> f64 {
        left(&self.motion, &self.turns, self.delay_s, map)
    }

    fn rotation(&self) -> Matrix3<f64> {
        rotation(&self.motion, &self.turns, self.delay_s)
    }

    /// Returns the fitted rotation if it is far from the model's and fits better, else the model's.
    fn rotation_from(&self, model: &Matrix3<f64>) -> Matrix3<f64> {
        let map = self.rotation();
        let inverse = model.try_inverse().unwrap_or_default();
        let away = nalgebra::Rotation3::from_matrix_unchecked(map * inverse);
        let away_rad = nalgebra::UnitQuaternion::from_rotation_matrix(&away).angle();
        let is_better = self.left(&map) < self.plan.better_rotation * self.left(model);
        match away_rad > self.plan.far_rad && is_better {
            true => map,
            false => *model,
        }
    }
}

/// Agreement of attitudes with the gyros at the best delays and rotation.
pub struct Likeness {
    /// Residual share of the turns' sum of squares under the rotation \[1\].
    pub left: f64,
    /// Residual share under the linear map of least squares: channels reversed, exchanged or in another unit \[1\].
    pub left_by_any_map: f64,
    /// Angle of the rotation \[rad\].
    pub turned_rad: f64,
    /// Rotation from the reference's body axes to the gyros'.
    pub map: Matrix3<f64>,
    /// Beginning of each piece and its delay \[s\].
    delays_s: Vec<[f64; 2]>,
}

impl Likeness {
    /// Number of pieces with a delay of their own.
    pub fn pieces(&self) -> usize {
        self.delays_s.len()
    }

    /// Index of the piece at a time, and its delay \[s\].
    pub fn delay_s(&self, time_s: f64) -> (usize, f64) {
        let begun = self.delays_s[1..].partition_point(|[begin_s, _]| *begin_s <= time_s);
        (begun, self.delays_s[begun][1])
    }
}

/// Compares attitudes with the gyros under one rotation, with a delay for each piece of the record, since lost rows shift the
/// later ones; `None` if turns are too few.
pub fn likeness(
    gyros: &Gyros,
    samples: &[SlowSample],
    tested: &[bool],
    of_model: &Alignment,
) -> Option<Likeness> {
    let plan = &gyros.plan.coarse;
    let motion = gyros.motion(gyros.sensed_rad.clone());
    let turns = turns(samples, tested, plan);
    if turns.len() < plan.least_turns {
        return None;
    }
    let count = (turns.len() / plan.least_turns_of_a_piece).clamp(1, plan.most_pieces);
    let pieces: Vec<(&[Turn], f64)> = turns
        .chunks(turns.len().div_ceil(count))
        .map(|piece| (piece, best_delay_s(&motion, piece, of_model.delay_s, plan)))
        .collect();
    let sums = pieces
        .iter()
        .map(|(piece, delay_s)| products(&motion, piece, *delay_s));
    let sums = sums.fold(Products::default(), Products::with);
    let map = nearest_rotation(sums.of_both_rad2);
    let left = |map: &Matrix3<f64>| -> f64 {
        let each = pieces.iter();
        each.map(|(piece, delay_s)| left(&motion, piece, *delay_s, map))
            .sum()
    };
    let turn = nalgebra::Rotation3::from_matrix_unchecked(map);
    let whole_rad2 = left(&Matrix3::zeros());
    Some(Likeness {
        left: left(&map) / whole_rad2,
        left_by_any_map: left(&sums.least_squares()) / whole_rad2,
        turned_rad: nalgebra::UnitQuaternion::from_rotation_matrix(&turn).angle(),
        delays_s: pieces
            .iter()
            .map(|(piece, delay_s)| [piece[0].start_s, *delay_s])
            .collect(),
        map,
    })
}

/// Delay of highest correlation of the rates' magnitudes, or the model's if that is nearly as good \[s\].
fn best_delay_s(
    motion: &GyroMotion,
    turns: &[Turn],
    of_model_s: f64,
    plan: &CoarseAttitudePlan,
) -> f64 {
    let lasts_s = turns.iter().map(|turn| turn.end_s - turn.start_s);
    let step_s = 0.1 * lasts_s.sum::<f64>() / turns.len() as f64;
    let step_s = step_s.clamp(1e-3, 0.01);
    let count = (plan.reach_s / step_s) as i64;
    let best = (-count..=count)
        .map(|k| {
            let delay_s = of_model_s + k as f64 * step_s;
            (correlation(motion, turns, delay_s), delay_s)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let here = correlation(motion, turns, of_model_s);
    match best {
        Some((value, delay_s)) if 1.0 - value < plan.better_delay * (1.0 - here) => delay_s,
        _ => of_model_s,
    }
}

/// Initial delay and rotation of the registration.
pub struct Start {
    /// Delay, and the rotation at that delay.
    both: (f64, Matrix3<f64>),
    /// Rotation at the model's delay.
    turn: Matrix3<f64>,
}

impl Start {
    /// Estimates delay and rotation; the model's values if turns are too few.
    pub fn new(
        gyros: &Gyros,
        samples: &[SlowSample],
        tested: &[bool],
        of_model: &Alignment,
    ) -> Self {
        let map = of_model.sensed_from_body;
        let Some(mut compared) = Compared::new(gyros, samples, tested, of_model) else {
            return Self {
                both: (of_model.delay_s, map),
                turn: map,
            };
        };
        let both = (compared.delay_s, compared.rotation_from(&map));
        compared.delay_s = of_model.delay_s;
        Self {
            both,
            turn: compared.rotation_from(&map),
        }
    }

    /// Returns the initial alignment of the `free` groups; the others are at the model's values.
    pub fn of(&self, free: &Free, of_model: &Alignment) -> Alignment {
        let is_free = |kind: &str| free.contains(&kind);
        let mut begun = of_model.clone();
        match (
            is_free("reference_delay"),
            is_free("reference_misalignment"),
        ) {
            (true, true) => (begun.delay_s, begun.sensed_from_body) = self.both,
            (true, false) => begun.delay_s = self.both.0,
            (false, true) => begun.sensed_from_body = self.turn,
            (false, false) => (),
        }
        begun
    }
}

/// A turn of the reference between two stamps.
struct Turn {
    start_s: f64,
    end_s: f64,
    /// Rotation vector in body axes \[rad\].
    angle_rad: Vector3<f64>,
}

fn turns(samples: &[SlowSample], tested: &[bool], plan: &CoarseAttitudePlan) -> Vec<Turn> {
    let used: Vec<&SlowSample> = samples
        .iter()
        .zip(tested)
        .filter(|(_, is_tested)| !**is_tested)
        .map(|(sample, _)| sample)
        .collect();
    let mut turns = Vec::new();
    let mut from = 0;
    let mut is_broken = false;
    for to in 1..used.len() {
        is_broken |= used[to].after_gap;
        let lasts_s = used[to].time_s - used[from].time_s;
        if lasts_s < plan.shortest_turn_s {
            continue;
        }
        if lasts_s < plan.longest_turn_s && !is_broken {
            turns.push(Turn {
                start_s: used[from].time_s,
                end_s: used[to].time_s,
                angle_rad: used[from].shown.turn_to(&used[to].shown),
            });
        }
        is_broken = false;
        from = to;
    }
    let each = turns.len().div_ceil(plan.most_turns).max(1);
    turns.into_iter().step_by(each).collect()
}

/// Rotation measured by the gyros over a turn, the reference delayed by `delay_s`.
fn of_gyros(motion: &GyroMotion, turn: &Turn, delay_s: f64) -> Option<Vector3<f64>> {
    let at = |time_s: f64| {
        let place = motion.place(time_s - delay_s);
        place.map(|place| motion.shown(place))
    };
    Some(at(turn.start_s)?.turn_to(&at(turn.end_s)?))
}

/// Correlation coefficient of the rates' magnitudes of gyros and reference, independent of their axes.
fn correlation(motion: &GyroMotion, turns: &[Turn], delay_s: f64) -> f64 {
    let mut sums = [0.0; 6];
    for turn in turns {
        let Some(own) = of_gyros(motion, turn, delay_s) else {
            continue;
        };
        let lasts_s = turn.end_s - turn.start_s;
        let (a, b) = (own.norm() / lasts_s, turn.angle_rad.norm() / lasts_s);
        for (sum, value) in sums.iter_mut().zip([1.0, a, b, a * a, b * b, a * b]) {
            *sum += value;
        }
    }
    let [count, a, b, aa, bb, ab] = sums;
    // A delay is rejected if half of the turns lie outside the gyros' record.
    if 2.0 * count < turns.len() as f64 {
        return -1.0;
    }
    let variance = |sum: f64, square: f64| (square - sum * sum / count).max(f64::MIN_POSITIVE);
    (ab - a * b / count) / (variance(a, aa) * variance(b, bb)).sqrt()
}

/// Fits the rotation from the reference's turns to the gyros' by least squares.
fn rotation(motion: &GyroMotion, turns: &[Turn], delay_s: f64) -> Matrix3<f64> {
    nearest_rotation(products(motion, turns, delay_s).of_both_rad2)
}

/// Sums of products of turns.
#[derive(Clone, Copy, Default)]
struct Products {
    /// Of the gyros' and the reference's \[rad²\].
    of_both_rad2: Matrix3<f64>,
    /// Of the reference's alone \[rad²\].
    of_reference_rad2: Matrix3<f64>,
}

impl Products {
    fn with(self, other: Self) -> Self {
        Self {
            of_both_rad2: self.of_both_rad2 + other.of_both_rad2,
            of_reference_rad2: self.of_reference_rad2 + other.of_reference_rad2,
        }
    }

    /// Map from the reference's turns to the gyros'; zero on axes about which nothing turned.
    fn least_squares(&self) -> Matrix3<f64> {
        let least = self.of_reference_rad2.trace() * f64::EPSILON;
        let inverse = self.of_reference_rad2.pseudo_inverse(least);
        inverse.map_or_else(|_| Matrix3::zeros(), |inverse| self.of_both_rad2 * inverse)
    }
}

fn products(motion: &GyroMotion, turns: &[Turn], delay_s: f64) -> Products {
    let each = turns.iter().filter_map(|turn| {
        let own = of_gyros(motion, turn, delay_s)?;
        Some(Products {
            of_both_rad2: own * turn.angle_rad.transpose(),
            of_reference_rad2: turn.angle_rad * turn.angle_rad.transpose(),
        })
    });
    each.fold(Products::default(), Products::with)
}

/// Rotation of the largest inner product with a matrix (Kabsch).
fn nearest_rotation(products: Matrix3<f64>) -> Matrix3<f64> {
    let svd = products.svd(true, true);
    let (Some(left), Some(right)) = (svd.u, svd.v_t) else {
        return Matrix3::identity();
    };
    let mut keep = Matrix3::identity();
    keep[(2, 2)] = (left * right).determinant().signum();
    left * keep * right
}

/// Sum of squared residuals of the turns under a map \[rad²\].
fn left(motion: &GyroMotion, turns: &[Turn], delay_s: f64, map: &Matrix3<f64>) -> f64 {
    let of_turn = |turn: &Turn| {
        let own = of_gyros(motion, turn, delay_s)?;
        Some((own - map * turn.angle_rad).norm_squared())
    };
    turns.iter().filter_map(of_turn).sum()
}
