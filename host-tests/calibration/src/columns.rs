//! Design columns of one recording's unknowns, from the catalogue.
//!
//! The unknowns of [`Unknowns::of`] one recording are the parameters of one [`Hypothesis`], in that order, over the columns
//! of one [`Pool`]: effect of a unit of each on each gyro \[rad by row\].

use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::{Pool, Signals, entries};
use rlg_inference::{Hypothesis, Term};
use rlg_model::Model;
use rlg_signal::axes::{Triad, add};

use super::unknowns::{Unknowns, entry};

/// Unknowns of a recording over design columns of its signals.
pub struct DesignColumns {
    pool: Pool,
    hypothesis: Hypothesis,
}

impl DesignColumns {
    /// Builds the columns of `kinds`; unknowns of other kinds, and of missing channels, have none.
    pub fn new(signals: &Signals, kinds: &[&str]) -> Self {
        let unknowns = Unknowns::of(1);
        let mut pool = Pool::default();
        let mut terms: Vec<Term> = Vec::new();
        for kind in kinds {
            for (name, own) in pool.whole(entry(kind), signals) {
                let parameter = unknowns
                    .place(kind, &name)
                    .expect("the catalogue's names are the contract's");
                terms.extend(own.into_iter().map(|term| Term { parameter, ..term }));
            }
        }
        Self {
            pool,
            hypothesis: Hypothesis::of_terms(unknowns.count(), terms),
        }
    }

    /// All unknowns as parameters.
    pub fn hypothesis(&self) -> &Hypothesis {
        &self.hypothesis
    }

    /// Fitted unknowns, without the rival.
    pub fn fitted(&self) -> Hypothesis {
        let count = Unknowns::of(1).fitted().len();
        let terms = self.hypothesis.terms.iter().copied();
        Hypothesis::of_terms(count, terms.filter(|term| term.parameter < count).collect())
    }

    /// Columns evaluated on signals.
    pub fn made_of<'a>(&'a self, signals: &'a Signals) -> PoolColumns<'a> {
        PoolColumns {
            columns: &self.pool.columns,
            signals,
        }
    }

    /// Effect of a unit of one unknown on each gyro \[rad by row\]; `None` if it has none.
    pub fn unit_rad(&self, signals: &Signals, parameter: usize) -> Option<[Option<Vec<f64>>; 3]> {
        let mut sensed: [Option<Vec<f64>>; 3] = [None, None, None];
        let terms = self.hypothesis.terms.iter();
        for term in terms.filter(|term| term.parameter == parameter) {
            let values = self.pool.columns[term.column].values(signals);
            let sum = sensed[term.record].get_or_insert_with(|| vec![0.0; values.len()]);
            add(sum, &values, term.coefficient);
        }
        sensed.iter().any(Option::is_some).then_some(sensed)
    }

    /// Effect of unknowns of given values on each gyro \[rad by row\].
    pub fn sensed_rad(&self, signals: &Signals, values: &[f64]) -> Triad {
        let mut sensed: Triad = std::array::from_fn(|_| vec![0.0; signals.rows]);
        for (place, column) in self.pool.columns.iter().enumerate() {
            let terms = self.hypothesis.terms.iter();
            let sizes: Vec<(usize, f64)> = terms
                .filter(|term| term.column == place)
                .filter_map(|term| {
                    let value = values.get(term.parameter)?;
                    Some((term.record, value * term.coefficient))
                })
                .filter(|(_, size)| *size != 0.0)
                .collect();
            if !sizes.is_empty() {
                let column = column.values(signals);
                for (gyro, size) in sizes {
                    add(&mut sensed[gyro], &column, size);
                }
            }
        }
        sensed
    }
}

/// Effect of the linear effects of a model on each gyro \[rad by row\].
pub fn known_rad(model: &Model, signals: &Signals) -> Triad {
    let mut sensed: Triad = std::array::from_fn(|_| vec![0.0; signals.rows]);
    for effect in &model.effects {
        let Some(entry) = entries::find(&effect.kind) else {
            continue;
        };
        let mut pool = Pool::default();
        for (name, terms) in pool.whole(entry, signals) {
            let value = entries::coefficient_of(entry.kind, effect.number(&name));
            for term in terms.iter().filter(|_| value != 0.0) {
                let column = pool.columns[term.column].values(signals);
                add(&mut sensed[term.record], &column, value * term.coefficient);
            }
        }
    }
    sensed
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Matrix3;
    use rlg_catalogue::Signals;
    use rlg_catalogue::signals::Inputs;
    use rlg_plan::CataloguePlan;

    use super::DesignColumns;
    use crate::unknowns::{EARTH, FLEXURE, Unknowns};

    const RATE_HZ: f64 = 200.0;
    const ROWS: usize = 2000;

    /// ω_y = sin 2πt and ω_z = cos 2πt: a cone about x of one turn a second \[rad/s\].
    fn cone() -> Signals {
        let angle = |axis: usize, time_s: f64| match axis {
            1 => -(TAU * time_s).cos() / TAU,
            2 => (TAU * time_s).sin() / TAU,
            _ => 0.0,
        };
        let case_rad = [0, 1, 2].map(|axis: usize| {
            let at = |row: usize| angle(axis, row as f64 / RATE_HZ);
            (0..ROWS)
                .map(|row| at(row + 1) - at(row))
                .collect::<Vec<f64>>()
        });
        let (motion, inputs) = ((case_rad, None), Inputs::default());
        let (axes, plan) = (Matrix3::identity(), CataloguePlan::default());
        Signals::of_known(motion, inputs, RATE_HZ, [0.0; 3], axes, &plan)
    }

    #[test]
    fn a_coned_gyro_drifts_by_half_of_each_of_its_two_coefficients() {
        let signals = cone();
        let columns = DesignColumns::new(&signals, &Unknowns::fitted_kinds(false));
        let unknowns = Unknowns::of(1);
        // x: −δ_xy ω_z + δ_xz ω_y with δ = −K α (physics §1): K_xy α_y ω_z = K_xy 2π cos²(2πt), and K_xz alike.
        let [xy, xz] = ["xy", "xz"].map(|name| unknowns.place(FLEXURE, name).expect("a K"));
        let mut values = vec![0.0; unknowns.count()];
        (values[xy], values[xz]) = (2e-3, -3e-3);
        let sensed = columns.sensed_rad(&signals, &values);
        for (row, sensed_rad) in sensed[0].iter().enumerate().skip(200).take(ROWS - 400) {
            let phase = TAU * (row as f64 + 0.5) / RATE_HZ;
            let expected = TAU * (2e-3 * phase.cos().powi(2) - 3e-3 * phase.sin().powi(2));
            assert!(
                (sensed_rad * RATE_HZ - expected).abs() < 2e-3 * 2e-3 * TAU,
                "{row}"
            );
        }
        assert!(
            sensed[1]
                .iter()
                .chain(&sensed[2])
                .all(|value| *value == 0.0)
        );
    }

    #[test]
    fn kinds_that_are_not_asked_for_have_no_columns() {
        let signals = cone();
        let columns = DesignColumns::new(&signals, &Unknowns::fitted_kinds(false));
        let unknowns = Unknowns::of(1);
        let of = |kind: &str, name: &str| {
            let place = unknowns.place(kind, name).expect("an unknown");
            columns.unit_rad(&signals, place)
        };
        assert!(of(EARTH, "x").is_none() && of("dither_gain", "x").is_none());
        let delay = of("gyro_delay", "y").expect("a moving gyro");
        assert!(delay[1].is_some() && delay[0].is_none());
    }
}
