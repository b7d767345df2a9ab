//! Settling of an attitude filter: an initial error of the reference that decays as e(t) = e₀ exp(−t/τ) in the navigation frame.
//!
//! It is found and removed before anything else is aligned, since the first seconds of such a reference agree with no gyro.
//! In blocks of a quarter of τ, the turn by which the reference exceeds the gyros is fitted with a free map and bias of the
//! gyros and a free delay of each piece of the record, whose first alignment is a grid's, with and without the decay; τ is that
//! of least squares, then all four numbers are refined together.
//! A bias of the gyros that decays is its rival: it follows the body instead.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rlg_findings::entries::{uncorrelated, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_inference::linear::pseudo_inverse;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_plan::SettlingPlan;
use rlg_signal::attitude_samples::{Shown, SlowSample};
use rlg_signal::axes::AXES;

use crate::reference::cards::{SETTLING, card};
use crate::reference::coarse::Likeness;
use crate::rows::alignment::Alignment;
use crate::rows::gyro_motion::GyroMotion;
use crate::rows::linearised_rows::Gyros;

/// Number of free parameters besides the decay and the delays: a map and a bias of the gyros.
const ALIGNING: usize = 12;

/// Decaying error of a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Settling {
    /// Error at the first sample, in the navigation frame \[rad\].
    pub(crate) angle_rad: Vector3<f64>,
    /// Time constant \[s\].
    pub(crate) time_s: f64,
    /// Standard deviations of the three angles \[rad\] and of the time constant \[s\].
    stds: [f64; 4],
    /// A decaying bias of the gyros fits as well.
    may_be_bias: bool,
}

impl Settling {
    /// No error yet, with a time constant to begin with \[s\].
    fn none(time_s: f64) -> Self {
        Self {
            angle_rad: Vector3::zeros(),
            time_s,
            stds: [0.0; 4],
            may_be_bias: false,
        }
    }

    /// First settling of a model; `None` without any.
    pub(crate) fn of_model(model: &Model) -> Option<Self> {
        let mut of_kind = model.effects.iter().filter(|one| one.kind == SETTLING);
        let effect = of_kind.next()?;
        Some(Self {
            angle_rad: Vector3::from(AXES.map(|axis| effect.number(axis))),
            ..Self::none(effect.number("time_constant_s"))
        })
    }

    /// Error a time after the first sample \[rad\].
    fn after(&self, time_s: f64) -> Vector3<f64> {
        self.angle_rad * (-time_s / self.time_s).exp()
    }

    /// Removes the error from attitudes.
    pub(crate) fn undo(&self, samples: &mut [SlowSample]) {
        let Some(begin_s) = samples.first().map(|sample| sample.time_s) else {
            return;
        };
        for sample in samples {
            if let Shown::Attitude(attitude) = sample.shown {
                let error = UnitQuaternion::from_scaled_axis(self.after(sample.time_s - begin_s));
                sample.shown = Shown::Attitude(error.inverse() * attitude);
            }
        }
    }

    /// The entry, and its effect.
    pub(crate) fn entry(&self) -> (EffectEntry, ModelEffect) {
        let card = card(SETTLING);
        let also = match self.may_be_bias {
            true => {
                " Not distinguishable in this motion from a gyro bias that decays with the same time constant."
            }
            false => "",
        };
        let named = AXES.map(|axis| (axis, "rad"));
        let named = named.into_iter().chain([("time_constant_s", "s")]);
        let values = self.angle_rad.iter().copied().chain([self.time_s]);
        let all = || named.clone().zip(values.clone()).zip(self.stds);
        let parameters = all()
            .map(|(((name, unit), value), std)| ParameterEntry::number(name, value, std, unit));
        let entry = EffectEntry {
            kind: SETTLING.to_string(),
            parameters: parameters.collect(),
            covariance: uncorrelated(&self.stds),
            ..unlisted(card.equation.to_string(), format!("{}{also}", card.meaning))
        };
        let effect = ModelEffect {
            kind: SETTLING.to_string(),
            parameters: all()
                .map(|(((name, _), value), _)| (name.to_string(), EffectValue::Number(value)))
                .collect(),
        };
        (entry, effect)
    }
}

/// Finds a settling; `None` where attitudes are few or nothing decays.
pub(crate) fn find(
    gyros: &Gyros,
    samples: &[SlowSample],
    of_model: &Alignment,
    plan: &SettlingPlan,
) -> Option<Settling> {
    let likeness =
        crate::reference::coarse::likeness(gyros, samples, &vec![false; samples.len()], of_model)?;
    let motion = gyros.motion(gyros.sensed_rad.clone());
    let rows = Rows::new(&motion, samples, &likeness)?;
    let longest_s = rows.lasts_s() / plan.least_lengths;
    let mut time_s = plan.least_samples * rows.period_s();
    let mut best: Option<([f64; 2], f64)> = None;
    while time_s < longest_s {
        if let Some(gains) = rows.gains(time_s)
            && best.is_none_or(|(most, _)| gains[0] > most[0])
        {
            best = Some((gains, time_s));
        }
        time_s *= plan.step;
    }
    let ([over_none, over_bias], time_s) = best?;
    if over_none < plan.least_gain || over_bias < -plan.apart {
        return None;
    }
    let rough = refined(
        (&motion, samples),
        (&likeness, Settling::none(time_s)),
        longest_s,
    )?;
    let mut without = samples.to_vec();
    rough.undo(&mut without);
    // A fast settling hides the delay and the rotation of the first seconds.
    let left_out = vec![false; samples.len()];
    let likeness = crate::reference::coarse::likeness(gyros, &without, &left_out, of_model)?;
    let refined = refined((&motion, samples), (&likeness, rough), longest_s)?;
    without.copy_from_slice(samples);
    refined.undo(&mut without);
    let rows = Rows::new(&motion, samples, &likeness)?;
    // An error of the first alignment is no settling.
    if rows.gains(refined.time_s)?[0] < plan.least_gain {
        return None;
    }
    let after = Rows::new(&motion, &without, &likeness)?;
    let shares = [&rows, &after].map(|rows| rows.left_early(refined.time_s));
    let [before, left] = [shares[0]?, shares[1]?];
    (left < plan.left * before).then_some(Settling {
        may_be_bias: over_bias < plan.apart,
        ..refined
    })
}

/// Refines size and time constant from `now` by Gauss–Newton about the error already removed.
fn refined(
    (motion, samples): (&GyroMotion, &[SlowSample]),
    (likeness, mut now): (&Likeness, Settling),
    longest_s: f64,
) -> Option<Settling> {
    const PASSES: usize = 8;
    /// Largest change of the logarithm of the time constant in a pass.
    const LONGEST_STEP: f64 = 0.5;
    for pass in 0..PASSES {
        let mut without = samples.to_vec();
        now.undo(&mut without);
        let rows = Rows::new(motion, &without, likeness)?;
        let with_time = pass > 0;
        let fit = rows.fit(now.time_s, Decay::Of(now, with_time))?;
        let step = Vector3::new(fit.values[0], fit.values[1], fit.values[2]);
        let longer = match with_time {
            true => (fit.values[3] / now.time_s).clamp(-LONGEST_STEP, LONGEST_STEP),
            false => 0.0,
        };
        now.angle_rad += step;
        now.time_s *= longer.exp();
        now.stds = std::array::from_fn(|k| fit.stds.get(k).copied().unwrap_or(0.0));
        if now.time_s > longest_s || !now.angle_rad.norm().is_finite() {
            return None;
        }
    }
    Some(now)
}

/// Additional columns of a fit.
#[derive(Debug, Clone, Copy)]
enum Decay {
    /// None.
    No,
    /// Of the reference, in the navigation frame; true with a change of the time constant.
    Of(Settling, bool),
    /// Of the gyros' bias, in the body's axes.
    OfBias(f64),
}

/// Turns by which the reference exceeds the gyros from sample to sample.
struct Rows {
    /// Times from the first sample \[s\].
    from_s: Vec<f64>,
    to_s: Vec<f64>,
    /// In the navigation frame \[rad\].
    excess_rad: Vec<Vector3<f64>>,
    /// The gyros' turn in the reference's axes \[rad\], and the rotation of these to the navigation frame.
    turn_rad: Vec<Vector3<f64>>,
    navigation_from_body: Vec<UnitQuaternion<f64>>,
    /// Change of that turn with the delay \[rad/s\], and the piece of the record with a delay of its own.
    by_delay_rad_s: Vec<Vector3<f64>>,
    piece: Vec<usize>,
    /// Number of free parameters of the alignment.
    aligning: usize,
}

/// Result of a fit.
struct Fit {
    /// Of the additional columns.
    values: Vec<f64>,
    stds: Vec<f64>,
    /// Residuals by block, and the sum of their squares \[rad²\].
    left: DVector<f64>,
    squares: f64,
}

impl Rows {
    fn new(motion: &GyroMotion, samples: &[SlowSample], likeness: &Likeness) -> Option<Self> {
        let begin_s = samples.first()?.time_s;
        let mut rows = Self {
            from_s: Vec::new(),
            to_s: Vec::new(),
            excess_rad: Vec::new(),
            turn_rad: Vec::new(),
            navigation_from_body: Vec::new(),
            by_delay_rad_s: Vec::new(),
            piece: Vec::new(),
            aligning: ALIGNING + likeness.pieces(),
        };
        let half_row_s = 0.5 / motion.rate_hz();
        let back = likeness.map.transpose();
        for pair in samples.windows(2) {
            let [Shown::Attitude(from), Shown::Attitude(to)] = [pair[0].shown, pair[1].shown]
            else {
                return None;
            };
            let (piece, delay_s) = likeness.delay_s(pair[0].time_s);
            let turn_rad = |delay_s: f64| {
                let at = |sample: &SlowSample| {
                    let place = motion.place(sample.time_s - delay_s)?;
                    Some(motion.shown(place))
                };
                Some(back * at(&pair[0])?.turn_to(&at(&pair[1])?))
            };
            let [less, now, more] =
                [-half_row_s, 0.0, half_row_s].map(|by_s| turn_rad(delay_s + by_s));
            let (Some(less), Some(turn_rad), Some(more)) = (less, now, more) else {
                continue;
            };
            let predicted = from * UnitQuaternion::from_scaled_axis(turn_rad);
            rows.from_s.push(pair[0].time_s - begin_s);
            rows.to_s.push(pair[1].time_s - begin_s);
            rows.excess_rad
                .push((to * predicted.inverse()).scaled_axis());
            rows.turn_rad.push(turn_rad);
            rows.navigation_from_body.push(from);
            rows.by_delay_rad_s.push((more - less) / (2.0 * half_row_s));
            rows.piece.push(piece);
        }
        (rows.excess_rad.len() > 2 * rows.aligning).then_some(rows)
    }

    fn lasts_s(&self) -> f64 {
        self.to_s.last().copied().unwrap_or(0.0)
    }

    fn period_s(&self) -> f64 {
        self.lasts_s() / self.to_s.len() as f64
    }

    /// Numbers of the block of each row: a quarter of the time constant.
    fn blocks(&self, time_s: f64) -> Vec<usize> {
        let length_s = (0.25 * time_s).max(self.period_s());
        let each = self.from_s.iter();
        each.map(|from_s| (from_s / length_s) as usize).collect()
    }

    /// Gains in 2 ln L of a decay over none, and over that of a bias.
    fn gains(&self, time_s: f64) -> Option<[f64; 2]> {
        let decays = [
            Decay::No,
            Decay::OfBias(time_s),
            Decay::Of(Settling::none(time_s), false),
        ];
        let fits = decays.map(|decay| self.fit(time_s, decay));
        let [Some(none), Some(of_bias), Some(own)] = fits else {
            return None;
        };
        let count = own.left.len() as f64;
        let over = |other: &Fit| count * (other.squares / own.squares.max(f64::MIN_POSITIVE)).ln();
        Some([over(&none), over(&of_bias)])
    }

    /// Mean square by block, in the first two time constants, of the fit without a decay \[rad²\].
    fn left_early(&self, time_s: f64) -> Option<f64> {
        let fit = self.fit(time_s, Decay::No)?;
        let early = 3 * 8.min(fit.left.len() / 3);
        Some(fit.left.rows(0, early).norm_squared() / early as f64)
    }

    /// Least squares in blocks of a quarter of the time constant.
    fn fit(&self, time_s: f64, decay: Decay) -> Option<Fit> {
        let of_block = self.blocks(time_s);
        let blocks = of_block.last()? + 1;
        let more = match decay {
            Decay::No => 0,
            Decay::Of(_, false) | Decay::OfBias(_) => 3,
            Decay::Of(_, true) => 4,
        };
        let columns = self.aligning + more;
        let mut design = DMatrix::zeros(3 * blocks, columns);
        let mut values = DVector::zeros(3 * blocks);
        for (row, block) in of_block.iter().enumerate() {
            let mut take = |column: usize, value: Vector3<f64>| {
                for axis in 0..3 {
                    design[(3 * block + axis, column)] += value[axis];
                }
            };
            self.align(row, &mut take);
            self.decay(row, decay, &mut take);
            for axis in 0..3 {
                values[3 * block + axis] += self.excess_rad[row][axis];
            }
        }
        // Blocks without rows.
        let count = (0..blocks)
            .filter(|block| of_block.binary_search(block).is_ok())
            .count();
        if 3 * count <= 2 * columns {
            return None;
        }
        let inverse = pseudo_inverse(&design.tr_mul(&design));
        let sizes = &inverse * design.tr_mul(&values);
        let left = values - &design * &sizes;
        let squares = left.norm_squared();
        let variance = squares / (3 * count - columns) as f64;
        let own = self.aligning..columns;
        Some(Fit {
            values: own.clone().map(|k| sizes[k]).collect(),
            stds: own
                .map(|k| (variance * inverse[(k, k)]).max(0.0).sqrt())
                .collect(),
            left,
            squares,
        })
    }

    /// Columns of the alignment in one row.
    fn align(&self, row: usize, take: &mut impl FnMut(usize, Vector3<f64>)) {
        let to_navigation = self.navigation_from_body[row];
        let turn_rad = self.turn_rad[row];
        let lasts_s = self.to_s[row] - self.from_s[row];
        for axis in 0..3 {
            let along = to_navigation * Vector3::ith(axis, 1.0);
            for by in 0..3 {
                take(3 * axis + by, along * turn_rad[by]);
            }
            take(9 + axis, along * lasts_s);
        }
        take(
            ALIGNING + self.piece[row],
            to_navigation * self.by_delay_rad_s[row],
        );
    }

    /// Columns of a decay in one row.
    fn decay(&self, row: usize, decay: Decay, take: &mut impl FnMut(usize, Vector3<f64>)) {
        let [from_s, to_s] = [self.from_s[row], self.to_s[row]];
        let falls = |time_s: f64| (-to_s / time_s).exp() - (-from_s / time_s).exp();
        match decay {
            Decay::No => {}
            Decay::OfBias(time_s) => {
                let to_navigation = self.navigation_from_body[row];
                for axis in 0..3 {
                    let along = to_navigation * Vector3::ith(axis, 1.0);
                    take(self.aligning + axis, along * falls(time_s));
                }
            }
            Decay::Of(now, with_time) => {
                for axis in 0..3 {
                    take(self.aligning + axis, Vector3::ith(axis, falls(now.time_s)));
                }
                if with_time {
                    let slope = |at_s: f64| now.after(at_s) * at_s / now.time_s.powi(2);
                    take(self.aligning + 3, slope(to_s) - slope(from_s));
                }
            }
        }
    }
}
