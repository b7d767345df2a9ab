//! Design columns of the accelerometers: velocity increment of each row per unit of an effect.

use nalgebra::Vector3;
use rlg_catalogue::accelerometers::{DELAY, Kind, Law};
use rlg_catalogue::entry::tilt;
use rlg_signal::axes::AXES;

use crate::prediction::Prediction;
use crate::readings::Piece;

/// Error of the reference, by the rotation rate of the case less the rate measured by the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// e_j × ω: the reference is misaligned about axis j.
    Misaligned(usize),
    /// −ω_j: scale error of the reference about axis j (it measures too much).
    Scaled(usize),
    /// α: the reference is delayed.
    Late,
}

/// Specific force \[m/s² per unit of the effect\]; a row's column is its integral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column {
    /// 1.
    Constant,
    /// f_j.
    Force(usize),
    /// f_i f_j.
    ForceProduct(usize, usize),
    /// |f_j|.
    ForceSize(usize),
    /// f_j |f_j|.
    ForceSigned(usize),
    /// f_j³.
    ForceCube(usize),
    /// df_j/dt delayed by the given seconds.
    Slope(usize, f64),
    /// f_j delayed by d seconds, less f_j, plus d times the delayed slope: the terms of a delay beyond its linearisation.
    Late(usize, f64),
    /// (α × e_j + ω × (ω × e_j))_i.
    Arm(usize, usize),
    /// ω_j.
    Rate(usize),
    /// α_j.
    Acceleration(usize),
    /// ω_i f_j.
    RateForce(usize, usize),
    /// ω_i ω_j.
    RateProduct(usize, usize),
    /// Warming of block j.
    Warming(usize),
    /// Warming of block j times f_j.
    WarmingForce(usize),
    /// Seconds since the start of the row's recording.
    Time,
    /// (−φ × f)_i, φ the attitude error caused by an error of the reference.
    Turned(Turn, usize),
}

impl Column {
    /// Integral over each row \[m/s per unit of the effect\].
    pub fn values(self, made_of: &Prediction) -> Vec<f64> {
        let carried = &made_of.carried;
        let force = |axis: usize| made_of.force_m_s2[axis].iter();
        let means: Vec<f64> = match self {
            Self::Arm(i, j) => return carried.lever_m_s(i, j),
            Self::Acceleration(j) => return carried.turned_rad_s[j].clone(),
            Self::RateProduct(i, j) => return carried.squared_rad2_s[i][j].clone(),
            Self::Rate(j) => return carried.angle_rad[j].clone(),
            Self::RateForce(i, j) => {
                let angles = carried.angle_rad[i].iter();
                return angles.zip(force(j)).map(|(a, f)| a * f).collect();
            }
            Self::Constant => vec![1.0; made_of.rows.count],
            Self::Force(j) => force(j).copied().collect(),
            Self::ForceProduct(i, j) => force(i).zip(force(j)).map(|(a, b)| a * b).collect(),
            Self::ForceSize(j) => force(j).map(|f| f.abs()).collect(),
            Self::ForceSigned(j) => force(j).map(|f| f * f.abs()).collect(),
            Self::ForceCube(j) => force(j).map(|f| f.powi(3)).collect(),
            Self::Slope(j, before_s) => made_of.slope_before(j, before_s),
            Self::Late(j, delay_s) => {
                let slope = made_of.slope_before(j, delay_s);
                let late = made_of.force_before(j, delay_s);
                let rows = late.iter().zip(force(j)).zip(slope);
                rows.map(|((late, now), slope)| late - now + delay_s * slope)
                    .collect()
            }
            Self::Warming(j) => warming(made_of, j),
            Self::WarmingForce(j) => {
                let warming = warming(made_of, j);
                warming.iter().zip(force(j)).map(|(k, f)| k * f).collect()
            }
            Self::Turned(turn, axis) => turned(made_of, turn, axis),
            Self::Time => {
                let rows = &made_of.rows;
                let since_s = |piece: &Piece| {
                    let own = piece.rows.clone();
                    own.map(|row| rows.since_start_s(piece, row))
                        .collect::<Vec<f64>>()
                };
                rows.pieces.iter().flat_map(since_s).collect()
            }
        };
        let period_s = made_of.rows.period_s();
        means.into_iter().map(|value| value * period_s).collect()
    }

    /// Name of the column in expressions.
    pub fn text(self) -> String {
        let [x, y, z] = AXES;
        let of = |axis: usize| [x, y, z][axis];
        match self {
            Self::Constant => "1".to_string(),
            Self::Force(j) => format!("force_{}", of(j)),
            Self::ForceProduct(i, j) => format!("force_{}*force_{}", of(i), of(j)),
            Self::ForceSize(j) => format!("abs(force_{})", of(j)),
            Self::ForceSigned(j) => format!("force_{0}*abs(force_{0})", of(j)),
            Self::ForceCube(j) => format!("force_{0}*force_{0}*force_{0}", of(j)),
            Self::Slope(j, _) | Self::Late(j, _) => format!("dforce_{}", of(j)),
            Self::Arm(i, j) => format!("arm_{}{}", of(i), of(j)),
            Self::Rate(j) => format!("omega_{}", of(j)),
            Self::Acceleration(j) => format!("alpha_{}", of(j)),
            Self::RateForce(i, j) => format!("omega_{}*force_{}", of(i), of(j)),
            Self::RateProduct(i, j) => format!("omega_{}*omega_{}", of(i), of(j)),
            Self::Warming(j) => format!("temperature_{}", of(j)),
            Self::WarmingForce(j) => format!("temperature_{0}*force_{0}", of(j)),
            Self::Time => "time".to_string(),
            Self::Turned(..) => "attitude".to_string(),
        }
    }
}

/// Change of the force along `axis` for an attitude error caused by an error of the reference.
fn turned(made_of: &Prediction, turn: Turn, axis: usize) -> Vec<f64> {
    let beyond =
        made_of
            .carried
            .turned_beyond_rad(&made_of.rows.pieces, |angle, turned| match turn {
                Turn::Misaligned(about) => Vector3::ith(about, 1.0).cross(angle),
                Turn::Scaled(about) => Vector3::ith(about, -angle[about]),
                Turn::Late => *turned,
            });
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let (along_j, along_k) = (&made_of.force_m_s2[j], &made_of.force_m_s2[k]);
    let rows = beyond.iter().zip(along_j.iter().zip(along_k));
    rows.map(|(by, (at_j, at_k))| by[k] * at_j - by[j] * at_k)
        .collect()
}

fn warming(made_of: &Prediction, axis: usize) -> Vec<f64> {
    match &made_of.warming_k {
        Some(warming_k) => warming_k[axis].clone(),
        None => vec![0.0; made_of.rows.count],
    }
}

/// Column of an error of the reference about the axis that the parameter is named after.
fn on_body(turn: impl Fn(usize) -> Turn, name: &str, axis: usize) -> Vec<(Column, f64)> {
    let about = AXES.iter().position(|other| name == *other);
    let column = about.map(|about| (Column::Turned(turn(about), axis), 1.0));
    column.into_iter().collect()
}

/// Columns of a unit parameter on accelerometer `axis`; a delay is linearised at `delay_s`.
pub fn columns(kind: &Kind, name: &str, axis: usize, delay_s: f64) -> Vec<(Column, f64)> {
    let second = || AXES.iter().position(|other| name.ends_with(other));
    match (kind.kind, kind.law) {
        ("accel_bias", _) => vec![(Column::Constant, 1.0)],
        ("accel_scale", _) => vec![(Column::Force(axis), 1.0)],
        ("accel_quadratic", _) => vec![(Column::ForceProduct(axis, axis), 1.0)],
        (DELAY, _) => vec![(Column::Slope(axis, delay_s), -1.0)],
        (_, Law::Tilts) => {
            let about = second().filter(|about| *about != axis);
            let tilted = about.map(|about| {
                // x: + δ_xz f_y − δ_xy f_z, and cyclic.
                let (sign, along) = tilt(axis, about);
                (Column::Force(along), sign)
            });
            tilted.into_iter().collect()
        }
        (_, Law::Arms) => second()
            .map(|along| (Column::Arm(axis, along), 1.0))
            .into_iter()
            .collect(),
        ("reference_misalignment", _) => on_body(Turn::Misaligned, name, axis),
        ("reference_delay", _) => vec![(Column::Turned(Turn::Late, axis), 1.0)],
        ("reference_scale", _) => on_body(Turn::Scaled, name, axis),
        (_, Law::Axes | Law::Body | Law::All) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use rlg_catalogue::accelerometers::{KINDS, REFERENCE_KINDS};
    use rlg_model::catalogue::Kind;

    use super::columns;

    #[test]
    fn every_parameter_of_every_kind_acts_on_the_accelerometers_that_it_names() {
        for kind in KINDS.iter().chain(REFERENCE_KINDS) {
            for (name, on) in kind.law.parameters() {
                for axis in 0..3 {
                    let acts = !columns(kind, &name, axis, 0.0).is_empty();
                    let own = on.contains(&axis);
                    assert!(acts || !own, "{} {name} on {axis}", kind.kind);
                }
            }
        }
    }

    #[test]
    fn parameters_have_the_contracts_names() {
        for kind in KINDS.iter().chain(REFERENCE_KINDS) {
            let known = Kind::named(kind.kind).expect("a kind of the contract");
            let names: Vec<&str> = known.parameter_names().collect();
            let own = kind.law.parameters();
            assert_eq!(names, own.iter().map(|(name, _)| name).collect::<Vec<_>>());
            assert_eq!(known.unit_of(names[0]), Some(kind.unit), "{}", kind.kind);
        }
    }
}
