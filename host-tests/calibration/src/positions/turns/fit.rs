//! Weighted least squares of rests and turns, with a scatter of each beyond what their rows show.
//!
//! Gauss–Newton steps from the model's sizes. The scatter is the moment estimate of Paule and Mandel (1982): the weighted
//! squares of a group equal its degrees of freedom. As for the accelerometers, a prior of few degrees of freedom, centred on
//! the known noise, keeps it finite where a group has hardly more observations than parameters.

use nalgebra::{DMatrix, DVector, Vector3};

use super::prediction::{ALL, Sizes, predict};
use super::readings::Gyros;
use crate::estimate::at_unit_diagonal;

/// Steps of Gauss and Newton: from errors of a tenth the third changes no printed digit.
const STEPS: usize = 5;
/// Bisections of a scatter, over twelve decades.
const BISECTIONS: usize = 60;

/// Observations besides the gyros' own rows.
pub struct Known<'a> {
    /// Direction of the corrected force at each position.
    pub up: &'a [Vector3<f64>],
    /// Variance of that direction, along each axis across it \[rad²\].
    pub direction_rad2: &'a [f64],
    /// Sizes of the model's effects; its Earth rate is that of the site.
    pub start: Sizes,
    /// Standard deviation of each parameter about `start` without the recording.
    pub prior: Sizes,
    /// Degrees of freedom of the scatter's prior.
    pub scatter_known: f64,
}

/// Group of observations.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Group {
    Rest,
    Turn,
}

/// Observation, one number.
struct Observation {
    group: Group,
    left: f64,
    derivatives: DVector<f64>,
    /// Variance from the rows \[its unit squared\].
    known: f64,
    /// Factor of the rests' variance in it: the square of a turn's duration.
    of_rests: f64,
}

/// Result.
pub struct Fitted {
    /// Sizes of all parameters.
    pub sizes: Sizes,
    /// Their covariance, with few degrees of freedom taken into account as a factor beside 3 σ.
    pub covariance: DMatrix<f64>,
    /// Scatter of rests \[rad/s\] and of turns \[rad\] beyond what the rows show.
    pub scatter: [f64; 2],
    /// Square sum of the turns' residuals over their known variance, and its degrees of freedom.
    pub turns_known: [f64; 2],
    /// Degrees of freedom of the scatter of turns, and of rests, with the prior.
    pub freedom: [f64; 2],
    /// Residual of each turn \[rad\].
    pub turns_rad: Vec<f64>,
}

/// Fits all parameters.
pub fn fit(gyros: &Gyros, known: &Known) -> Option<Fitted> {
    let mut sizes = known.start;
    let mut scatter = [0.0; 2];
    let mut last = None;
    for _ in 0..STEPS {
        let observations = observations(gyros, known, &sizes);
        let step = Step::new(&observations, known, &sizes, &mut scatter)?;
        sizes += Sizes::from_column_slice(step.change.as_slice());
        last = Some(step);
    }
    let step = last?;
    let observations = observations(gyros, known, &sizes);
    let own = |group: Group| observations.iter().filter(move |one| one.group == group);
    let squares = own(Group::Turn).map(|one| one.left.powi(2) / one.variance([scatter[0], 0.0]));
    let pairs: Vec<f64> = own(Group::Turn).map(|one| one.left).collect();
    Some(Fitted {
        sizes,
        covariance: step.covariance,
        scatter,
        turns_known: [squares.sum(), step.freedom[1]],
        freedom: step.freedom.map(|own| own + known.scatter_known),
        turns_rad: pairs.chunks(2).map(|two| two[0].hypot(two[1])).collect(),
    })
}

impl Observation {
    fn variance(&self, [rests, turns]: [f64; 2]) -> f64 {
        self.known
            + match self.group {
                Group::Rest => rests * rests,
                Group::Turn => turns * turns + self.of_rests * rests * rests,
            }
    }
}

/// Linearises all observations.
fn observations(gyros: &Gyros, known: &Known, sizes: &Sizes) -> Vec<Observation> {
    let predicted = predict(gyros, known.up, sizes);
    let mut all = Vec::new();
    for (rest, (mean, derivatives)) in gyros.rests.iter().zip(&predicted.rests) {
        let Some(rest) = rest else { continue };
        for axis in 0..3 {
            all.push(Observation {
                group: Group::Rest,
                left: rest.mean_rad_s[axis] - mean[axis],
                derivatives: derivatives.row(axis).transpose().as_slice().to_vec().into(),
                known: gyros.walk_rad_sqrt_s[axis].powi(2) / rest.length_s,
                of_rests: 0.0,
            });
        }
    }
    let walk_rad2_s = gyros.walk_rad_sqrt_s.norm_squared() / 3.0;
    for (turn, (direction, derivatives)) in gyros.turns.iter().zip(&predicted.turns) {
        let up = &known.up[turn.from + 1];
        let length_s = turn.span_s[1] - turn.span_s[0];
        let ends = known.direction_rad2[turn.from] + known.direction_rad2[turn.from + 1];
        let first = up.cross(&Vector3::ith(up.iamin(), 1.0)).normalize();
        for across in [first, up.cross(&first)] {
            all.push(Observation {
                group: Group::Turn,
                left: across.dot(&(up - direction)),
                derivatives: (across.transpose() * derivatives)
                    .as_slice()
                    .to_vec()
                    .into(),
                known: walk_rad2_s * length_s + ends,
                of_rests: length_s * length_s,
            });
        }
    }
    all
}

/// One step.
struct Step {
    change: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Degrees of freedom of rests and turns.
    freedom: [f64; 2],
}

impl Step {
    /// Solves for the sizes, and for the scatter of both groups in turn.
    fn new(
        observations: &[Observation],
        known: &Known,
        sizes: &Sizes,
        scatter: &mut [f64; 2],
    ) -> Option<Self> {
        /// Rounds of scatter and sizes: each changes the other by a second-order amount.
        const ROUNDS: usize = 8;
        let mut step = Self::solve(observations, known, sizes, *scatter)?;
        for _ in 0..ROUNDS {
            for (at, group) in [Group::Rest, Group::Turn].into_iter().enumerate() {
                let own = observations.iter().filter(|one| one.group == group);
                let left: Vec<(f64, &Observation)> = own
                    .map(|one| (one.left - one.derivatives.dot(&step.change), one))
                    .collect();
                let freedom = step.freedom[at];
                scatter[at] = scattered(&left, freedom, known.scatter_known, |of| match at {
                    0 => [of, scatter[1]],
                    _ => [scatter[0], of],
                });
            }
            step = Self::solve(observations, known, sizes, *scatter)?;
        }
        Some(step)
    }

    fn solve(
        observations: &[Observation],
        known: &Known,
        sizes: &Sizes,
        scatter: [f64; 2],
    ) -> Option<Self> {
        let mut information = DMatrix::zeros(ALL, ALL);
        let mut moment = DVector::zeros(ALL);
        for at in 0..ALL {
            let weight = known.prior[at].powi(-2);
            information[(at, at)] += weight;
            moment[at] += weight * (known.start[at] - sizes[at]);
        }
        for one in observations {
            let weight = 1.0 / one.variance(scatter);
            information.ger(weight, &one.derivatives, &one.derivatives, 1.0);
            moment.axpy(weight * one.left, &one.derivatives, 1.0);
        }
        let (root, unit) = at_unit_diagonal(&information);
        let inverse = root?.inverse();
        let covariance = DMatrix::from_fn(ALL, ALL, |a, b| inverse[(a, b)] * unit[a] * unit[b]);
        let mut freedom = [0.0; 2];
        for one in observations {
            let used = (&covariance * &one.derivatives).dot(&one.derivatives);
            freedom[usize::from(one.group == Group::Turn)] += 1.0 - used / one.variance(scatter);
        }
        Some(Self {
            change: &covariance * moment,
            covariance,
            freedom,
        })
    }
}

/// Scatter at which the weighted squares of a group and of its prior are their degrees of freedom.
fn scattered(
    left: &[(f64, &Observation)],
    freedom: f64,
    prior: f64,
    with: impl Fn(f64) -> [f64; 2],
) -> f64 {
    if left.is_empty() {
        return 0.0;
    }
    let known = left.iter().map(|(_, one)| one.known).sum::<f64>() / left.len() as f64;
    let excess = |scatter: f64| {
        let squares = left
            .iter()
            .map(|(left, one)| left * left / one.variance(with(scatter)));
        let centred = prior * known / (known + scatter * scatter);
        squares.sum::<f64>() + centred - freedom - prior
    };
    if excess(0.0) <= 0.0 {
        return 0.0;
    }
    let largest = left
        .iter()
        .fold(0.0_f64, |most, (left, _)| most.max(left.abs()));
    let (mut low, mut high) = (known.sqrt() * 1e-6, largest.max(known.sqrt()) * 1e3);
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        match excess(middle) > 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    high
}
