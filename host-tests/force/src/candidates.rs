//! Candidate hypotheses of the search: the kinds over a pool of columns, and expressions outside the catalogue, each with
//! its prior.

use rlg_catalogue::accelerometers::{DELAY, KINDS, Kind, Law, REFERENCE_KINDS};
use rlg_findings::result::UNLISTED;
use rlg_inference::{Bound, Columns, Fixed, Hypothesis, Term};
use rlg_plan::{OddsPlan, Plan};

use crate::column::{Column, columns};
use crate::prediction::Prediction;

/// Part of a kind that a candidate fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Variant {
    /// All its parameters.
    Whole,
    /// Those of one accelerometer.
    Axis(usize),
    /// Common values for all three accelerometers.
    Common,
    /// An expression on one accelerometer.
    Expression(usize, Column),
}

/// A hypothesis with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The contract's kind.
    pub kind: &'static str,
    /// Part of the kind.
    pub variant: Variant,
    /// Names that each parameter has in the contract.
    pub names: Vec<Vec<String>>,
    /// Hypothesis of the structure search.
    pub hypothesis: Hypothesis,
}

impl Candidate {
    /// True if another candidate is the same effect, linearised at another point.
    pub fn is_same(&self, other: &Self) -> bool {
        self.kind == other.kind && self.variant == other.variant
    }
}

/// Pool of design columns; each column occurs once.
#[derive(Debug, Clone, Default)]
pub struct Pool {
    /// Columns.
    pub columns: Vec<Column>,
}

/// Design columns evaluated on a prediction.
pub struct PoolColumns<'a> {
    /// Columns.
    pub columns: &'a [Column],
    /// Prediction that the columns are evaluated on.
    pub made_of: &'a Prediction,
}

impl Columns for PoolColumns<'_> {
    fn count(&self) -> usize {
        self.columns.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        self.columns[place].values(self.made_of)
    }
}

/// Columns with factors for a parameter of `size` on accelerometer `axis`, exact in the size also for a delay (nonlinear).
pub fn terms_of(kind: &Kind, name: &str, axis: usize, size: f64) -> Vec<(Column, f64)> {
    if kind.kind == DELAY {
        return vec![
            (Column::Late(axis, size), 1.0),
            (Column::Slope(axis, size), -size),
        ];
    }
    let of_one = columns(kind, name, axis, 0.0).into_iter();
    of_one
        .map(|(column, factor)| (column, factor * size))
        .collect()
}

/// Thresholds of a search, and the kinds in it.
#[derive(Clone, Copy)]
pub struct Scope<'a> {
    /// Thresholds.
    pub plan: &'a Plan,
    /// Kinds excluded from the catalogue.
    pub left_out: &'a [&'a str],
    /// Kinds of reference errors that are also tested.
    pub open: &'a [&'a str],
}

impl Pool {
    /// Returns the place of a column, adding it if new.
    pub fn place(&mut self, column: Column) -> usize {
        let known = self.columns.iter().position(|other| *other == column);
        known.unwrap_or_else(|| {
            self.columns.push(column);
            self.columns.len() - 1
        })
    }

    /// Lists the candidates, kinds in `left_out` excepted.
    ///
    /// # Inputs
    /// `delay_s`: estimated delay of each accelerometer, the linearisation point of its delay column.
    pub fn candidates(
        &mut self,
        made_of: &Prediction,
        delay_s: [f64; 3],
        scope: Scope,
    ) -> Vec<Candidate> {
        let Scope {
            plan,
            left_out,
            open,
        } = scope;
        let odds = &plan.catalogue.odds;
        let of_reference = REFERENCE_KINDS.iter();
        let sought: Vec<&Kind> = KINDS
            .iter()
            .chain(of_reference.filter(|kind| open.contains(&kind.kind)))
            .filter(|kind| !left_out.contains(&kind.kind))
            .collect();
        let mut found: Vec<Candidate> = Vec::new();
        for kind in &sought {
            let everyday = if kind.everyday { odds.everyday } else { 1.0 };
            for (variant, places) in variants(kind, odds) {
                let price = (places * everyday).ln();
                found.push(self.of_kind(kind, variant, price, made_of, delay_s));
            }
        }
        if !left_out.contains(&UNLISTED) {
            found.extend(self.expressions(&sought, made_of));
        }
        found
    }

    fn of_kind(
        &mut self,
        kind: &Kind,
        variant: Variant,
        price: f64,
        made_of: &Prediction,
        delay_s: [f64; 3],
    ) -> Candidate {
        let parameters = kind.law.parameters();
        let mut names: Vec<Vec<String>> = Vec::new();
        let (mut terms, mut fixed) = (Vec::new(), Vec::new());
        for (place, (name, on)) in parameters.iter().enumerate() {
            if matches!(variant, Variant::Axis(axis) if !on.contains(&axis)) {
                continue;
            }
            // One shared value of three accelerometers is one parameter for each second letter.
            let parameter = match (variant, kind.law) {
                (Variant::Common, Law::Axes) => 0,
                (Variant::Common, _) => place % 3,
                _ => names.len(),
            };
            names.resize_with(names.len().max(parameter + 1), Vec::new);
            names[parameter].push(name.clone());
            for &axis in on {
                let sensed = 1.0 / (1.0 - made_of.scale_error[axis]);
                for (column, factor) in columns(kind, name, axis, delay_s[axis]) {
                    terms.push(Term {
                        parameter,
                        record: axis,
                        column: self.place(column),
                        coefficient: factor * sensed,
                    });
                }
                if kind.kind == DELAY && delay_s[axis] != 0.0 {
                    fixed.push(Fixed {
                        record: axis,
                        column: self.place(Column::Late(axis, delay_s[axis])),
                        size: sensed,
                    });
                }
            }
        }
        let bound = Bound {
            std: kind.largest,
            ..Bound::NONE
        };
        Candidate {
            kind: kind.kind,
            variant,
            hypothesis: Hypothesis {
                parameters: names.len(),
                terms,
                fixed,
                requires: None,
                bounds: vec![bound; names.len()],
                price,
            },
            names,
        }
    }

    /// Expressions outside the catalogue on each accelerometer: alternatives without which a missing true term would select
    /// the nearest kind. Columns of the sought kinds themselves are excluded.
    fn expressions(&mut self, sought: &[&Kind], made_of: &Prediction) -> Vec<Candidate> {
        let said = |axis: usize| -> Vec<Column> {
            let named = sought.iter().flat_map(|kind| {
                let parameters = kind.law.parameters().into_iter();
                parameters.flat_map(move |(name, _)| columns(kind, &name, axis, 0.0))
            });
            named.map(|(column, _)| column).collect()
        };
        let all = expressions(made_of.warming_k.is_some());
        let price = (3.0 * all.len() as f64).ln();
        let mut found = Vec::new();
        for axis in 0..3 {
            let said = said(axis);
            for &column in all.iter().filter(|column| !said.contains(column)) {
                let coefficient = 1.0 / (1.0 - made_of.scale_error[axis]);
                let place = self.place(column);
                found.push(Candidate {
                    kind: UNLISTED,
                    variant: Variant::Expression(axis, column),
                    names: vec![vec!["size".to_string()]],
                    hypothesis: Hypothesis {
                        price,
                        ..Hypothesis::of_terms(
                            1,
                            vec![Term {
                                parameter: 0,
                                record: axis,
                                column: place,
                                coefficient,
                            }],
                        )
                    },
                });
            }
        }
        found
    }
}

/// Variants of a kind that are tested, with the log prior of each.
fn variants(kind: &Kind, odds: &OddsPlan) -> Vec<(Variant, f64)> {
    // An error of the reference has one variant, for all axes together.
    if matches!(kind.law, Law::Body | Law::All) {
        return vec![(Variant::Whole, 1.0)];
    }
    let mut all = vec![(Variant::Whole, odds.shared)];
    all.extend((0..3).map(|axis| (Variant::Axis(axis), odds.one_axis)));
    // Equal delays of three channels, and equal lever arms, have one cause.
    if kind.kind == DELAY || kind.law == Law::Arms {
        all.push((Variant::Common, odds.shared));
    }
    all
}

/// All expressions, as columns.
fn expressions(with_temperature: bool) -> Vec<Column> {
    let mut all = vec![Column::Constant, Column::Time];
    for i in 0..3 {
        all.extend([
            Column::Force(i),
            Column::ForceSize(i),
            Column::ForceSigned(i),
            Column::ForceCube(i),
            Column::Slope(i, 0.0),
            Column::Rate(i),
            Column::Acceleration(i),
        ]);
        for j in 0..3 {
            all.push(Column::RateForce(i, j));
            if j >= i {
                all.extend([Column::ForceProduct(i, j), Column::RateProduct(i, j)]);
            }
        }
        if with_temperature {
            all.extend([Column::Warming(i), Column::WarmingForce(i)]);
        }
    }
    all
}
