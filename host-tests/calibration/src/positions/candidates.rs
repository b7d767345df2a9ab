//! Errors observable in still positions: the accelerometer kinds, by their effect on the length of the specific force.

use nalgebra::Vector3;
use rlg_catalogue::accelerometers::{KINDS, Kind};
use rlg_findings::result::UNLISTED;
use rlg_inference::{Bound, Hypothesis, Term};
use rlg_model::{EffectValue, ModelEffect};
use rlg_plan::OddsPlan;
use rlg_signal::axes::AXES;

/// Design column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column {
    /// u_i: a bias.
    Bias(usize),
    /// u_i f_i: a scale error.
    Scale(usize),
    /// u_i f_j: non-orthogonality of axes i and j.
    Skew(usize, usize),
    /// u_i f_i²: a quadratic error.
    Quadratic(usize),
    /// u_i |f_i|: an asymmetric scale error.
    Size(usize),
    /// u_i f_i |f_i|.
    Signed(usize),
    /// u_i f_i³: a cubic error.
    Cube(usize),
    /// u_i t: a bias that drifts linearly in time.
    Time(usize),
    /// u_i ΔT: a bias linear in temperature.
    Warming(usize),
    /// 1 in one position, 0 in the others.
    Position(usize),
}

/// Regressors of the columns, by position.
pub struct MadeOf<'a> {
    /// Force \[m/s²\].
    pub force_m_s2: &'a [Vector3<f64>],
    /// Time since the first \[s\].
    pub time_s: &'a [f64],
    /// Warming of each block since the first \[K\].
    pub warming_k: Option<&'a [Vector3<f64>]>,
}

impl Column {
    /// Values by position \[m/s² per unit of the effect\].
    pub fn values(self, made_of: &MadeOf) -> Vec<f64> {
        let places = 0..made_of.force_m_s2.len();
        let value = |place: usize| {
            let f = &made_of.force_m_s2[place];
            let u = f.normalize();
            match self {
                Self::Bias(i) => u[i],
                Self::Scale(i) => u[i] * f[i],
                Self::Skew(i, j) => u[i] * f[j],
                Self::Quadratic(i) => u[i] * f[i] * f[i],
                Self::Size(i) => u[i] * f[i].abs(),
                Self::Signed(i) => u[i] * f[i] * f[i].abs(),
                Self::Cube(i) => u[i] * f[i].powi(3),
                Self::Time(i) => u[i] * made_of.time_s[place],
                Self::Warming(i) => u[i] * made_of.warming_k.map_or(0.0, |warm| warm[place][i]),
                Self::Position(own) => f64::from(u8::from(own == place)),
            }
        };
        places.map(value).collect()
    }

    /// Name in expressions, and the accelerometer of the column.
    pub fn expression(self) -> Option<(usize, String)> {
        let of = |i: usize| AXES[i];
        match self {
            Self::Size(i) => Some((i, format!("abs(force_{})", of(i)))),
            Self::Signed(i) => Some((i, format!("force_{0}*abs(force_{0})", of(i)))),
            Self::Cube(i) => Some((i, format!("force_{0}*force_{0}*force_{0}", of(i)))),
            Self::Time(i) => Some((i, "time".to_string())),
            Self::Warming(i) => Some((i, format!("temperature_{}", of(i)))),
            _ => None,
        }
    }
}

/// A hypothesis with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The contract's kind.
    pub kind: &'static str,
    /// Column of each parameter.
    pub columns: Vec<Column>,
    /// Hypothesis of the structure search.
    pub hypothesis: Hypothesis,
}

impl Candidate {
    /// Row of the kind; `None` for an unlisted one.
    pub fn row(&self) -> Option<&'static Kind> {
        KINDS.iter().find(|kind| kind.kind == self.kind)
    }

    /// Position, if the candidate is an offset of one position.
    pub fn position(&self) -> Option<usize> {
        match self.columns[..] {
            [Column::Position(place)] => Some(place),
            _ => None,
        }
    }

    /// Contract parameters for these sizes: names with values.
    ///
    /// The length is sensitive only to the difference of two tilts, δ_ik − δ_jk with (i, j, k) cyclic, which is split into
    /// equal parts.
    pub fn numbers(&self, sizes: &[f64]) -> Vec<(String, f64)> {
        let each = self.columns.iter().zip(sizes);
        each.flat_map(|(column, size)| {
            let shares = names(*column).into_iter();
            let count = shares.len() as f64;
            shares.map(move |(name, sign)| (name, sign * size / count))
        })
        .collect()
    }

    /// Model effect with these sizes.
    pub fn effect(&self, sizes: &[f64]) -> ModelEffect {
        let numbers = self.numbers(sizes).into_iter();
        ModelEffect {
            kind: self.kind.to_string(),
            parameters: numbers
                .map(|(name, value)| (name, EffectValue::Number(value)))
                .collect(),
        }
    }
}

/// Contract parameters, with signs, whose sum is a column's size; for an unlisted column its size.
pub fn names(column: Column) -> Vec<(String, f64)> {
    match column {
        Column::Skew(i, j) => {
            let k = 3 - i - j;
            let of = |axis: usize| format!("{}{}", AXES[axis], AXES[k]);
            vec![(of(i), 1.0), (of(j), -1.0)]
        }
        Column::Bias(i) | Column::Scale(i) | Column::Quadratic(i) => {
            vec![(AXES[i].to_string(), 1.0)]
        }
        _ => vec![("size".to_string(), 1.0)],
    }
}

/// Columns of a kind in still positions; empty for a kind that needs motion.
fn columns_of(kind: &str) -> Vec<Column> {
    match kind {
        "accel_bias" => (0..3).map(Column::Bias).collect(),
        "accel_scale" => (0..3).map(Column::Scale).collect(),
        "accel_misalignment" => (0..3).map(|i| Column::Skew(i, (i + 1) % 3)).collect(),
        "accel_quadratic" => (0..3).map(Column::Quadratic).collect(),
        _ => Vec::new(),
    }
}

/// True if a kind is observable in still positions.
pub fn shows(kind: &Kind) -> bool {
    !columns_of(kind.kind).is_empty()
}

/// Lists the candidates, kinds in `left_out` excepted, and collects their columns in `columns`.
pub fn candidates(
    (positions, is_warmed): (usize, bool),
    left_out: &[&str],
    columns: &mut Vec<Column>,
    odds: &OddsPlan,
) -> Vec<Candidate> {
    let mut found = Vec::new();
    for kind in KINDS.iter().filter(|kind| !left_out.contains(&kind.kind)) {
        let all = columns_of(kind.kind);
        if all.is_empty() {
            continue;
        }
        // A skew is the difference of two tilts.
        let std = match kind.kind {
            "accel_misalignment" => kind.largest * 2_f64.sqrt(),
            _ => kind.largest,
        };
        let everyday = if kind.everyday { odds.everyday } else { 1.0 };
        let alone = all.iter().map(|column| (vec![*column], odds.one_axis));
        for (own, places) in std::iter::once((all.clone(), odds.shared)).chain(alone) {
            found.push(candidate(
                kind.kind,
                own,
                (places * everyday).ln(),
                std,
                columns,
            ));
        }
    }
    if !left_out.contains(&UNLISTED) {
        let mut others: Vec<Column> = Vec::new();
        for i in 0..3 {
            others.extend([
                Column::Size(i),
                Column::Signed(i),
                Column::Cube(i),
                Column::Time(i),
            ]);
            others.extend(is_warmed.then_some(Column::Warming(i)));
        }
        let price = (others.len() as f64).ln();
        for column in others {
            found.push(candidate(
                UNLISTED,
                vec![column],
                price,
                f64::INFINITY,
                columns,
            ));
        }
        let price = (positions as f64).ln();
        for place in 0..positions {
            let own = vec![Column::Position(place)];
            found.push(candidate(UNLISTED, own, price, f64::INFINITY, columns));
        }
    }
    found
}

fn candidate(
    kind: &'static str,
    own: Vec<Column>,
    price: f64,
    std: f64,
    columns: &mut Vec<Column>,
) -> Candidate {
    let mut terms = Vec::with_capacity(own.len());
    for (parameter, column) in own.iter().enumerate() {
        let known = columns.iter().position(|other| other == column);
        let place = known.unwrap_or_else(|| {
            columns.push(*column);
            columns.len() - 1
        });
        terms.push(Term {
            parameter,
            record: 0,
            column: place,
            coefficient: 1.0,
        });
    }
    let bound = Bound { std, ..Bound::NONE };
    Candidate {
        kind,
        hypothesis: Hypothesis {
            bounds: vec![bound; own.len()],
            price,
            ..Hypothesis::of_terms(own.len(), terms)
        },
        columns: own,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::positions::errors::Errors;

    /// |f + e| − |f| of the contract's equations against columns times sizes, for each parameter alone.
    #[test]
    fn columns_are_what_errors_add_to_the_length() {
        let force = [Vector3::new(3.0, -8.0, 4.5), Vector3::new(-6.0, 2.0, 7.0)];
        let made_of = MadeOf {
            force_m_s2: &force,
            time_s: &[0.0, 1.0],
            warming_k: None,
        };
        let mut columns = Vec::new();
        let all = candidates((2, false), &[], &mut columns, &OddsPlan::default());
        for one in all.iter().filter(|one| one.row().is_some()) {
            for (place, column) in one.columns.iter().enumerate() {
                let mut sizes = vec![0.0; one.columns.len()];
                sizes[place] = 1e-7;
                let mut errors = Errors::default();
                errors.add(&one.effect(&sizes));
                for (at, value) in column.values(&made_of).into_iter().enumerate() {
                    let f = force[at];
                    let longer = (f + errors.added_m_s2(&f)).norm() - f.norm();
                    let off = longer - 1e-7 * value;
                    assert!(off.abs() < 1e-11, "{} {column:?}: {off}", one.kind);
                    assert!(value != 0.0);
                }
            }
        }
    }
}
