//! The catalogue expanded for the search: hypotheses over a pool of columns, each with its price.

use rlg_inference::{Columns, Fixed, Hypothesis, Term};

use crate::column::Column;
use crate::entries::{CATALOGUE, SLIP, STEP};
use crate::entry::{Entry, Law, tilt};
use crate::expression::Expression;
use crate::sensed::Sensed;
use crate::signals::{AXES, Signals};
use crate::stiffness;

/// Subset of an entry's parameters in a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Variant {
    /// All parameters.
    Whole,
    /// One axis alone.
    Axis(usize),
    /// xx, yy and zz alone.
    Diagonal,
    /// One value for all three axes.
    Common,
    /// First-order low pass on each gyro that has one.
    LowPass,
    /// Event at one row of one gyro.
    Event {
        /// Gyro.
        axis: usize,
        /// Row.
        row: usize,
    },
    /// Harmonic of the table's angle about an axis.
    Harmonic {
        /// Axis of the table.
        axis: usize,
        /// Order: periods per turn.
        order: u32,
    },
    /// An expression on one gyro.
    Expression {
        /// Gyro.
        axis: usize,
        /// Expression.
        expression: Expression,
    },
}

/// Hypothesis with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The contract's kind.
    pub kind: &'static str,
    /// Subset of its parameters.
    pub variant: Variant,
    /// Names of its parameters, as in the contract.
    pub names: Vec<String>,
    /// Linearisation point of its columns: a parameter is this plus the estimate. 0 for linear effects.
    pub base: Vec<f64>,
    /// Hypothesis for the search.
    pub hypothesis: Hypothesis,
}

impl Candidate {
    /// True if another candidate is the same effect linearised at the same point, in any pool.
    pub fn is_made_as(&self, other: &Self) -> bool {
        self.kind == other.kind && self.variant == other.variant && self.base == other.base
    }

    /// Gyro on which it acts once; `None` if it acts throughout the record.
    pub fn event_gyro(&self) -> Option<usize> {
        match self.variant {
            Variant::Event { axis, .. } => Some(axis),
            Variant::Expression { axis, expression } => expression.is_window().then_some(axis),
            _ => None,
        }
    }
}

/// Columns by place, without duplicates.
#[derive(Debug, Clone, Default)]
pub struct Pool {
    /// Columns.
    pub columns: Vec<Sensed>,
}

/// Columns of a pool from a place on, evaluated on signals.
pub struct PoolColumns<'a> {
    /// Columns.
    pub columns: &'a [Sensed],
    /// Signals.
    pub signals: &'a Signals,
}

impl Columns for PoolColumns<'_> {
    fn count(&self) -> usize {
        self.columns.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        self.columns[place].values(self.signals)
    }
}

/// Kinds with one value for all three gyros: a coincidence except for a cause in front of all of them.
const COMMON_KINDS: [&str; 1] = ["gyro_delay"];

impl Pool {
    /// Place of a column as a candidate effect on a gyro, added if new.
    pub fn tried(&mut self, column: Column, gyro: usize, signals: &Signals) -> usize {
        self.place(Sensed::tried(column, gyro, signals))
    }

    /// Place of a column, added if new.
    pub fn place(&mut self, column: Sensed) -> usize {
        match self.columns.iter().position(|other| *other == column) {
            Some(place) => place,
            None => {
                self.columns.push(column);
                self.columns.len() - 1
            }
        }
    }

    /// All candidates of the catalogue that are observable in the signals, except kinds in `left_out`.
    ///
    /// # Inputs
    /// `is_moving`: axes with motion above the reference's noise.
    pub fn candidates(
        &mut self,
        signals: &Signals,
        is_moving: [bool; 3],
        left_out: &[&str],
    ) -> Vec<Candidate> {
        CATALOGUE
            .iter()
            .filter(|entry| !left_out.contains(&entry.kind))
            .flat_map(|entry| self.of_entry(entry, signals, is_moving))
            .collect()
    }

    fn of_entry(
        &mut self,
        entry: &Entry,
        signals: &Signals,
        is_moving: [bool; 3],
    ) -> Vec<Candidate> {
        let odds = &signals.plan.odds;
        let whole = Expanded {
            entry,
            parameters: self.terms(entry, signals, is_moving),
            everyday: if entry.everyday { odds.everyday } else { 1.0 },
            largest: stiffness::largest(entry.kind, signals),
        };
        let mut found: Vec<Candidate> = Vec::new();
        match entry.law {
            Law::Axes(_) => {
                for axis in 0..3 {
                    let is_it = |place: usize| place == axis;
                    found.extend(whole.part(Variant::Axis(axis), is_it, odds.one_axis));
                }
                let shown = whole.shown(|_| true).len();
                if shown > 1 {
                    found.extend(whole.all(odds.shared));
                }
                if shown == 3 && COMMON_KINDS.contains(&entry.kind) {
                    found.push(whole.common(odds.common));
                }
            }
            Law::Nine(_) => {
                let is_diagonal = |place: usize| place / 3 == place % 3;
                found.extend(whole.part(Variant::Diagonal, is_diagonal, odds.shared));
                found.extend(whole.all(odds.shared));
            }
            Law::Body(_)
                if entry.kind != "reference_misalignment" && entry.kind != "earth_rate" =>
            {
                found.extend(whole.all(odds.of_reference));
            }
            Law::Body(_) | Law::Common(_) | Law::Tilts(..) | Law::Across(_) => {
                found.extend(whole.all(1.0));
            }
        }
        if is_delay(entry.kind) && signals.path.delay_s != [0.0; 3] {
            for one in &mut found {
                self.about_delays(one, signals);
            }
        }
        found
    }

    /// Linearises a delay about the delays on the path.
    fn about_delays(&mut self, candidate: &mut Candidate, signals: &Signals) {
        let hypothesis = &mut candidate.hypothesis;
        for (parameter, base) in candidate.base.iter_mut().enumerate() {
            let terms = hypothesis.terms.iter();
            let gyros: Vec<usize> = terms
                .filter(|term| term.parameter == parameter)
                .map(|term| term.record)
                .collect();
            // Linearisation point of a shared delay: the mean of the gyros' delays.
            let mean_s = gyros
                .iter()
                .map(|&gyro| signals.path.delay_s[gyro])
                .sum::<f64>()
                / gyros.len().max(1) as f64;
            if mean_s == 0.0 {
                continue;
            }
            for gyro in gyros {
                let sensed = 1.0 / (1.0 - signals.scale_error[gyro]);
                hypothesis.fixed.push(Fixed {
                    record: gyro,
                    column: self.place(Sensed::independent(Column::Late(gyro, mean_s))),
                    size: sensed,
                });
            }
            *base = delay_sign(candidate.kind) * mean_s;
            hypothesis.bounds[parameter] = hypothesis.bounds[parameter].about(*base);
        }
    }

    /// All parameters of an entry with their terms, with motion assumed on all axes.
    pub fn whole(&mut self, entry: &Entry, signals: &Signals) -> Vec<(String, Vec<Term>)> {
        self.terms(entry, signals, [true; 3])
            .into_iter()
            .map(|named| (named.name, named.terms))
            .collect()
    }

    /// Parameters of an entry with their terms; without terms if the recording cannot show them.
    fn terms(&mut self, entry: &Entry, signals: &Signals, is_moving: [bool; 3]) -> Vec<Named> {
        let sensed = |gyro: usize| 1.0 / (1.0 - signals.scale_error[gyro]);
        let mut add = |named: &mut Named, gyro: usize, column: Column, factor: f64| {
            if factor != 0.0 && column.is_available(signals) && moves(column, is_moving) {
                named.terms.push(Term {
                    parameter: 0,
                    record: gyro,
                    column: self.tried(column, gyro, signals),
                    coefficient: factor * sensed(gyro),
                });
            }
        };
        let pair = |gyro: usize, other: usize| format!("{}{}", AXES[gyro], AXES[other]);
        let mut all = Vec::new();
        match entry.law {
            Law::Axes(columns) => {
                for (axis, name) in AXES.iter().enumerate() {
                    let mut named = Named::new((*name).to_string());
                    for (column, factor) in columns(axis) {
                        add(&mut named, axis, column, factor);
                    }
                    all.push(named);
                }
            }
            Law::Common(columns) => {
                let mut named = Named::new("all".to_string());
                for axis in 0..3 {
                    for (column, factor) in columns(axis) {
                        add(&mut named, axis, column, factor);
                    }
                }
                all.push(named);
            }
            Law::Tilts(column, factor) => {
                for gyro in 0..3 {
                    for about in (0..3).filter(|about| *about != gyro) {
                        let (sign, senses) = tilt(gyro, about);
                        let mut named = Named::new(pair(gyro, about));
                        add(&mut named, gyro, column(gyro, about, senses), factor * sign);
                        all.push(named);
                    }
                }
            }
            Law::Nine(column) => {
                for gyro in 0..3 {
                    for other in 0..3 {
                        let mut named = Named::new(pair(gyro, other));
                        add(&mut named, gyro, column(other), 1.0);
                        all.push(named);
                    }
                }
            }
            Law::Across(column) => {
                for gyro in 0..3 {
                    for other in (0..3).filter(|other| *other != gyro) {
                        let mut named = Named::new(pair(gyro, other));
                        add(&mut named, gyro, column(other), 1.0);
                        all.push(named);
                    }
                }
            }
            Law::Body(columns) => {
                for (parameter, name) in AXES.iter().enumerate() {
                    let mut named = Named::new((*name).to_string());
                    for gyro in 0..3 {
                        for axis in 0..3 {
                            let along = signals.sensing_from_body[(gyro, axis)];
                            for (column, factor) in columns(parameter, axis) {
                                add(&mut named, gyro, column, factor * along);
                            }
                        }
                    }
                    all.push(named);
                }
            }
        }
        all
    }

    /// Step (`STEP`) or slip (`SLIP`) of one gyro at a row, selected from `places`.
    pub fn event(
        &mut self,
        kind: &'static str,
        axis: usize,
        row: usize,
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        debug_assert!(kind == STEP || kind == SLIP);
        let (column, coefficient) = if kind == STEP {
            (Column::Step(row), 1.0 / (1.0 - signals.scale_error[axis]))
        } else {
            (Column::Impulse(row), 1.0)
        };
        let term = Term {
            parameter: 0,
            record: axis,
            column: self.tried(column, axis, signals),
            coefficient,
        };
        of_one_term(kind, Variant::Event { axis, row }, "size", term, places)
    }
}

/// True if a kind is a delay of gyros or reference.
pub fn is_delay(kind: &str) -> bool {
    kind == "gyro_delay" || kind == "reference_delay"
}

/// Sign of a gyro's delay for a positive value of the kind: a late reference makes the gyro early.
pub fn delay_sign(kind: &str) -> f64 {
    if kind == "reference_delay" { -1.0 } else { 1.0 }
}

/// Candidate of one parameter and one term, selected from `places`.
pub(crate) fn of_one_term(
    kind: &'static str,
    variant: Variant,
    name: &str,
    term: Term,
    places: f64,
) -> Candidate {
    Candidate {
        kind,
        variant,
        names: vec![name.to_string()],
        base: vec![0.0],
        hypothesis: Hypothesis {
            price: places.ln(),
            ..Hypothesis::of_terms(1, vec![term])
        },
    }
}

/// Sensed increment of a gyro for a unit rate of the case about `axis`.
pub fn along(signals: &Signals, gyro: usize, axis: usize) -> f64 {
    signals.sensing_from_body[(gyro, axis)] / (1.0 - signals.scale_error[gyro])
}

/// One parameter of an entry.
struct Named {
    name: String,
    terms: Vec<Term>,
}

impl Named {
    fn new(name: String) -> Self {
        Self {
            name,
            terms: Vec::new(),
        }
    }
}

/// An entry with its parameters on a recording.
struct Expanded<'a> {
    entry: &'a Entry,
    parameters: Vec<Named>,
    /// Prior odds of the entry against others.
    everyday: f64,
    /// Largest stiffness by axis, see [`stiffness::largest`].
    largest: Option<[f64; 3]>,
}

impl Expanded<'_> {
    /// Parameters that the recording can show, of the selected places.
    fn shown(&self, keep: impl Fn(usize) -> bool) -> Vec<&Named> {
        let each = self.parameters.iter().enumerate();
        each.filter(|(place, named)| !named.terms.is_empty() && keep(*place))
            .map(|(_, named)| named)
            .collect()
    }

    /// Candidate of all parameters; `None` if the recording shows none.
    fn all(&self, places: f64) -> Option<Candidate> {
        self.part(Variant::Whole, |_| true, places)
    }

    /// Candidate of the parameters at some places, selected from `places`; `None` if the recording shows none of them.
    fn part(
        &self,
        variant: Variant,
        keep: impl Fn(usize) -> bool,
        places: f64,
    ) -> Option<Candidate> {
        let kept = self.shown(keep);
        let terms = kept.iter().enumerate().flat_map(|(parameter, named)| {
            let terms = named.terms.iter();
            terms.map(move |term| Term { parameter, ..*term })
        });
        let bound = self.entry.size.bound();
        let bounds = kept
            .iter()
            .map(|named| stiffness::within(bound, &named.name, self.largest));
        (!kept.is_empty()).then(|| Candidate {
            kind: self.entry.kind,
            variant,
            names: kept.iter().map(|named| named.name.clone()).collect(),
            base: vec![0.0; kept.len()],
            hypothesis: Hypothesis {
                bounds: bounds.collect(),
                price: (places * self.everyday).ln(),
                ..Hypothesis::of_terms(kept.len(), terms.collect())
            },
        })
    }

    /// Candidate of one value for all gyros, selected from `places`.
    fn common(&self, places: f64) -> Candidate {
        let terms = self.parameters.iter().flat_map(|named| named.terms.clone());
        Candidate {
            kind: self.entry.kind,
            variant: Variant::Common,
            names: vec!["all".to_string()],
            base: vec![0.0],
            hypothesis: Hypothesis {
                bounds: vec![self.entry.size.bound()],
                price: (places * self.everyday).ln(),
                ..Hypothesis::of_terms(1, terms.collect())
            },
        }
    }
}

/// True if the motion in a column is above the reference's noise.
fn moves(column: Column, is_moving: [bool; 3]) -> bool {
    use Column::{
        Cube, CubicFlexure, Delay, Flexure, ForceTimesIncrement, HighPass, Increment, Jerk,
        LowPass, Magnitude, Square, WarmingTimesIncrement,
    };
    match column {
        Increment(axis)
        | LowPass(axis, ..)
        | HighPass(axis, ..)
        | Delay(axis)
        | Jerk(axis)
        | Magnitude(axis)
        | Square(axis)
        | Cube(axis)
        | ForceTimesIncrement(axis)
        | WarmingTimesIncrement(_, axis) => is_moving[axis],
        Flexure(about, senses) | CubicFlexure(about, senses) => {
            is_moving[about] && is_moving[senses]
        }
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::tilt;

    #[test]
    fn tilts_have_the_signs_of_the_physics_page() {
        let (x, y, z) = (0, 1, 2);
        assert_eq!(tilt(x, z), (1.0, y));
        assert_eq!(tilt(x, y), (-1.0, z));
        assert_eq!(tilt(y, x), (1.0, z));
        assert_eq!(tilt(y, z), (-1.0, x));
        assert_eq!(tilt(z, y), (1.0, x));
        assert_eq!(tilt(z, x), (-1.0, y));
    }
}
