//! Integration of gyro increments from one attitude sample to the next, and of the design columns with them.
//!
//! A [`Chain`] holds the steps between samples without a gap: growth of the attitude error over each, its noise, and the
//! attitude in every row. Navigation frame throughout.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rlg_signal::axes::Triad;

use super::noise::DeclaredNoise;
use super::whiten::Whitener;

/// Noise of gyros and reference.
pub struct StepNoise {
    /// Noise of each gyro.
    pub gyros: [DeclaredNoise; 3],
    /// Noise of the reference.
    pub reference: DeclaredNoise,
}

impl StepNoise {
    /// White angle noise of the gyros \[rad²\].
    fn white_rad2(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::from(self.gyros.map(|gyro| gyro.white_rad2)))
    }

    /// White noise of an attitude sample, plus that of the gyros \[rad²\].
    fn of_sample(&self, navigation_from_body: &UnitQuaternion<f64>) -> Matrix3<f64> {
        let c = navigation_from_body.to_rotation_matrix();
        let own = self.white_rad2();
        c.matrix() * own * c.matrix().transpose() + Matrix3::identity() * self.reference.white_rad2
    }

    /// Random walk of a row in the navigation frame \[rad²\].
    fn of_row(
        &self,
        middle: &UnitQuaternion<f64>,
        turn: &Vector3<f64>,
        period_s: f64,
    ) -> Matrix3<f64> {
        let c = middle.to_rotation_matrix();
        let walk_rad2_s = Vector3::from(self.gyros.map(|gyro| gyro.walk_rad2_s));
        let own = Matrix3::from_diagonal(&walk_rad2_s) * period_s;
        // White angle noise does not telescope if the axes rotate between samples.
        let cross = turn.cross_matrix();
        let turned = cross * self.white_rad2() * cross.transpose();
        c.matrix() * (own + turned) * c.matrix().transpose()
    }
}

/// Attitude sample at a place in rows and fractions of rows.
#[derive(Clone, Copy)]
pub struct Sample {
    /// Place in rows and fractions of rows.
    pub place: f64,
    /// Attitude measured by the reference.
    pub navigation_from_body: UnitQuaternion<f64>,
}

/// Step between two attitude samples.
struct Step {
    /// Growth of the attitude error \[rad\].
    growth: Vector3<f64>,
    /// Random walk over the step \[rad²\].
    walk: Matrix3<f64>,
    /// White noise at its end \[rad²\].
    end: Matrix3<f64>,
}

/// Steps without a gap between them, with their rows.
pub struct Chain {
    steps: Vec<Step>,
    /// White noise at the start \[rad²\].
    begin: Matrix3<f64>,
    /// Start and end of the steps, in rows and fractions of rows.
    bounds: Vec<f64>,
    /// Attitude at the middle of each row from `first_row` on.
    attitude: Vec<UnitQuaternion<f64>>,
    first_row: usize,
}

impl Chain {
    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.attitude.len()
    }

    /// Whitening transform of vectors of the steps.
    pub fn whitener(&self) -> Whitener {
        Whitener::new(
            &self.begin,
            self.steps.iter().map(|step| (step.walk, step.end)),
        )
    }

    /// Growth of the attitude error over each step \[rad\].
    pub fn growth(&self) -> Vec<Vector3<f64>> {
        self.steps.iter().map(|step| step.growth).collect()
    }

    /// Length of each step in rows.
    pub fn lengths(&self) -> impl Iterator<Item = f64> {
        self.bounds.windows(2).map(|pair| pair[1] - pair[0])
    }

    /// ∫ C · (a vector of each row, in the body frame) over every step.
    pub fn carried(&self, of_row: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let over = |pair: &[f64]| {
            let mut sum = Vector3::zeros();
            for_rows(pair[0], pair[1], |row, share| {
                sum += self.attitude[row - self.first_row] * of_row(row) * share;
            });
            sum
        };
        self.bounds.windows(2).map(over).collect()
    }
}

/// Integrates `increments` \[rad, body frame\] and compares with every sample; steps over rows that are not usable are left
/// out.
///
/// # Inputs `samples`: ascending, within the rows; `earth_rad_s`: rotation rate of the navigation frame.
pub fn chains(
    increments: &Triad,
    usable: &[bool],
    period_s: f64,
    samples: &[Sample],
    noise: &StepNoise,
    earth_rad_s: &Vector3<f64>,
) -> Vec<Chain> {
    let mut chains: Vec<Chain> = Vec::new();
    let mut open: Option<Integration> = None;
    for pair in samples.windows(2) {
        let (from, to) = (pair[0].place, pair[1].place);
        let rows = from.floor() as usize..(to.ceil() as usize).min(usable.len());
        if usable[rows].contains(&false) {
            chains.extend(open.take().map(|open| open.chain));
            continue;
        }
        let mut integration = open.take().unwrap_or_else(|| {
            let begin = noise.of_sample(&pair[0].navigation_from_body);
            Integration::new(&pair[0], begin)
        });
        let mut walk = Matrix3::identity() * (noise.reference.walk_rad2_s * (to - from) * period_s);
        integration.advance(increments, to, |middle, turn, share| {
            walk += noise.of_row(middle, turn, period_s) * share;
        });
        let since_s = (to - integration.chain.bounds[0]) * period_s;
        let turned = UnitQuaternion::from_scaled_axis(-earth_rad_s * since_s);
        let computed = turned * integration.now;
        let error = (computed * pair[1].navigation_from_body.inverse()).scaled_axis();
        integration.chain.steps.push(Step {
            growth: error - integration.error,
            walk,
            end: noise.of_sample(&pair[1].navigation_from_body),
        });
        integration.chain.bounds.push(to);
        integration.error = error;
        open = Some(integration);
    }
    chains.extend(open.map(|open| open.chain));
    chains
}

/// Calls `each` with every row between two places and the share of it between them.
fn for_rows(from: f64, to: f64, mut each: impl FnMut(usize, f64)) {
    /// Stamps are rounded: a smaller share of a row counts as zero.
    const NOTHING: f64 = 1e-6;
    let mut row = from.floor() as usize;
    while (row as f64) < to - NOTHING {
        let share = to.min(row as f64 + 1.0) - from.max(row as f64);
        if share > NOTHING {
            each(row, share);
        }
        row += 1;
    }
}

/// Chain of steps under construction.
struct Integration {
    chain: Chain,
    now: UnitQuaternion<f64>,
    error: Vector3<f64>,
    before: Vector3<f64>,
}

impl Integration {
    fn new(from: &Sample, begin: Matrix3<f64>) -> Self {
        Self {
            chain: Chain {
                steps: Vec::new(),
                begin,
                bounds: vec![from.place],
                attitude: Vec::new(),
                first_row: from.place.floor() as usize,
            },
            now: from.navigation_from_body,
            error: Vector3::zeros(),
            before: Vector3::zeros(),
        }
    }

    /// Integrates the attitude up to the place `to`; calls `each` with the attitude at each row's middle, the row's
    /// rotation and the share.
    fn advance(
        &mut self,
        increments: &Triad,
        to: f64,
        mut each: impl FnMut(&UnitQuaternion<f64>, &Vector3<f64>, f64),
    ) {
        let from = *self.chain.bounds.last().expect("a chain has a beginning");
        let (now, before, chain) = (&mut self.now, &mut self.before, &mut self.chain);
        for_rows(from, to, |row, share| {
            let turn = Vector3::from_fn(|axis, _| increments[axis][row]);
            // Coning within a row: second-order term of two neighbouring increments.
            let vector = (turn + before.cross(&turn) / 12.0) * share;
            let middle = *now * UnitQuaternion::from_scaled_axis(vector * 0.5);
            *now *= UnitQuaternion::from_scaled_axis(vector);
            *before = turn;
            if chain.attitude.len() + chain.first_row == row {
                chain.attitude.push(middle);
            }
            each(&middle, &turn, share);
        });
    }
}
