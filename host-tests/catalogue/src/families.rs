//! Effects with a nonlinear parameter (order, natural frequency, time constant, product of channels), searched on a
//! grid; each point is one place in the price of a selection.

use rlg_inference::{Columns, Hypothesis, Term};

use crate::candidates::{Candidate, Pool};
use crate::column::Column;
use crate::expression::{Expression, Factor};
use crate::high_pass::{self, HighPass};
use crate::low_pass::{self, LowPass};
use crate::resonance::{PARTS, Resonance};
use crate::resonance_basis::on_every_gyro;
use crate::signals::Signals;
use crate::vocabulary::vocabulary;

/// Candidates over a pool of their own, in groups that share columns.
pub struct Family {
    /// Columns.
    pub pool: Pool,
    /// Candidates.
    pub groups: Vec<Vec<Candidate>>,
}

/// Every order of every axis about which the table's angle spans enough of that order.
pub fn harmonics(signals: &Signals, is_moving: [bool; 3]) -> Family {
    let mut pool = Pool::default();
    let mut groups = Vec::new();
    let highest = signals.plan.grids.highest_order as u32;
    let places = 3.0 * f64::from(highest);
    for axis in (0..3).filter(|&axis| is_moving[axis]) {
        let mut angle: f64 = 0.0;
        let (mut least, mut most) = (0.0_f64, 0.0_f64);
        for increment in &signals.measured_rad[axis] {
            angle += increment;
            (least, most) = (least.min(angle), most.max(angle));
        }
        let least_rad = signals.plan.excitation.least_angle_rad;
        let is_spanned = |order: &u32| f64::from(*order) * (most - least) > least_rad;
        let orders = (1..=highest).filter(is_spanned);
        for order in orders {
            groups.push(vec![pool.harmonic(axis, order, places, signals)]);
        }
    }
    Family { pool, groups }
}

/// Sine and cosine on one gyro at frequencies around `hz`, `step` inverse record lengths apart.
///
/// A group's first member is the sine, its second the cosine.
pub fn lines_about(hz: f64, step: f64, gyro: usize, signals: &Signals) -> Family {
    const STEPS: std::ops::RangeInclusive<i32> = -12..=12;
    let mut pool = Pool::default();
    let span_s = signals.rows as f64 * signals.period_s();
    let places = 3.0 * signals.rows as f64;
    let groups = STEPS
        .map(|place| hz + step * f64::from(place) / span_s)
        .filter(|hz| *hz > 0.0)
        .map(|hz| {
            // Rounded to a hundredth of the step, well within the resolution of the data.
            let digit = 10_f64.powf((1e2 * span_s / step).log10().ceil());
            let hz = (hz * digit).round() / digit;
            [Factor::Sine(hz), Factor::Cosine(hz)]
                .map(|wave| pool.expression(gyro, Expression::of(&[wave]), places, signals))
                .to_vec()
        })
        .collect();
    Family { pool, groups }
}

/// Every expression on every gyro without a listed effect of the same column.
///
/// # Inputs
/// `listed`: candidates of the catalogue over `pool`.
pub fn expressions(
    signals: &Signals,
    is_moving: [bool; 3],
    listed: &[Candidate],
    pool: &Pool,
) -> Family {
    let is_listed = |gyro: usize, expression: Expression| {
        Column::of(expression).is_some_and(|column| {
            let mut terms = listed.iter().flat_map(|one| &one.hypothesis.terms);
            terms.any(|term| term.record == gyro && pool.columns[term.column].column == column)
        })
    };
    let all = vocabulary(signals, is_moving);
    let places = 3.0 * all.len() as f64;
    let mut own = Pool::default();
    let groups = all
        .into_iter()
        .map(|expression| {
            (0..3)
                .filter(|&gyro| !is_listed(gyro, expression))
                .map(|gyro| own.expression(gyro, expression, places, signals))
                .collect()
        })
        .collect();
    Family { pool: own, groups }
}

/// Lag or decay with other time constants, an octave or less from its own.
pub fn time_constants_about(expression: Expression, gyro: usize, signals: &Signals) -> Family {
    const EIGHTHS: std::ops::RangeInclusive<i32> = -8..=8;
    let mut pool = Pool::default();
    let groups = expression
        .time_constant_s()
        .map(|constant_s| {
            let other = |step: f64| {
                // Rounded to four digits: for legibility, and beyond the precision of the data.
                let seconds = constant_s * step.exp2();
                let digit = 10_f64.powi(3 - seconds.log10().floor() as i32);
                expression.with_time_constant((seconds * digit).round() / digit)
            };
            EIGHTHS
                .filter_map(|eighths| other(0.125 * f64::from(eighths)))
                .map(|other| vec![pool.expression(gyro, other, 1.0, signals)])
                .collect()
        })
        .unwrap_or_default();
    Family { pool, groups }
}

/// One mount by its exact columns: complete response, and derivatives with respect to frequency and damping.
pub struct ExactMount<'a> {
    /// Resonance.
    pub resonance: Resonance,
    /// Motion.
    pub signals: &'a Signals,
    /// Axis of the mount.
    pub axis: usize,
}

impl Columns for ExactMount<'_> {
    fn count(&self) -> usize {
        PARTS.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        Column::Mount(self.axis, self.resonance, PARTS[place]).values(self.signals)
    }
}

impl ExactMount<'_> {
    /// Hypothesis of one parameter per column, on every gyro.
    pub fn hypothesis(&self) -> Hypothesis {
        on_every_gyro(self.count(), self.axis, self.signals)
    }
}

/// One filter on a gyro's path by its exact columns: complete response, and derivative with respect to the time constant.
pub struct ExactFilter<'a> {
    columns: [Column; 2],
    signals: &'a Signals,
    gyro: usize,
}

impl Columns for ExactFilter<'_> {
    fn count(&self) -> usize {
        self.columns.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        self.columns[place].values(self.signals)
    }
}

impl<'a> ExactFilter<'a> {
    /// Low pass of a time constant \[s\].
    pub fn low_pass(gyro: usize, time_s: f64, signals: &'a Signals) -> Self {
        Self {
            columns: low_pass::PARTS.map(|part| Column::LowPass(gyro, LowPass { time_s }, part)),
            signals,
            gyro,
        }
    }

    /// High pass of a time constant \[s\].
    pub fn high_pass(gyro: usize, time_s: f64, signals: &'a Signals) -> Self {
        let parts = [high_pass::Part::Response, high_pass::Part::ByTime];
        Self {
            columns: parts.map(|part| Column::HighPass(gyro, HighPass { time_s }, part)),
            signals,
            gyro,
        }
    }

    /// Hypothesis of one parameter per column, on the gyro.
    pub fn hypothesis(&self) -> Hypothesis {
        self.of_first(self.count())
    }

    /// Hypothesis of the response alone.
    pub fn of_response(&self) -> Hypothesis {
        self.of_first(1)
    }

    fn of_first(&self, count: usize) -> Hypothesis {
        let terms = (0..count).map(|column| Term {
            parameter: column,
            record: self.gyro,
            column,
            coefficient: 1.0 / (1.0 - self.signals.scale_error[self.gyro]),
        });
        Hypothesis::of_terms(count, terms.collect())
    }
}
