//! Experiments on a rate table or a bench, and their predicted information on hypotheses.
//!
//! From moves and the noise of a row follows the [`Information`] on hypotheses: the Cramér–Rao bound of that motion
//! (Kay, *Estimation Theory*, 1993, ch. 3).
//!
//! # Assumptions
//! The motion is known: its noise is in the observations and not in the columns.

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix3;
use rlg_inference::{Hypothesis, Information, NoiseLevels, NormalEquations, Observations};
use rlg_plan::{CataloguePlan, RateTablePlan};
use rlg_signal::axes::Triad;

use crate::candidates::PoolColumns;
use crate::moves::{Kind, Move, increments_rad};
use crate::sensed::Sensed;
use crate::signals::{Inputs, Signals};

/// Standard gravity \[m/s²\].
const GRAVITY_M_S2: f64 = 9.806_65;

/// Consecutive moves, with a description and the sampling of the columns.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Description for the reader.
    pub text: String,
    /// The moves.
    pub moves: Vec<Move>,
    /// Row rate of the columns \[Hz\]: forty rows or more in a period of the fastest oscillation.
    pub rows_hz: f64,
    /// Number of temperature cycles; 0: constant temperature.
    pub cycles: usize,
}

fn spin(
    table: &RateTablePlan,
    axis: usize,
    rate_rad_s: f64,
    across: usize,
    (hz, angle_rad, phase_rad): (f64, f64, f64),
) -> Move {
    Move {
        kind: Kind::Spin {
            axis,
            rate_rad_s,
            across,
            frequency_hz: hz,
            angle_rad,
            phase_rad,
        },
        duration_s: table.move_s,
        ramp_s: table.ramp_s,
    }
}

impl Experiment {
    /// All experiments, the shortest first.
    pub fn all(table: &RateTablePlan) -> Vec<Self> {
        vec![
            Self::oscillations(table),
            Self::cones(table),
            Self::slews(table),
            Self::spins(table),
            Self::tumble(table),
            Self::warming(table),
        ]
    }

    /// Rest in six attitudes: gravity and the Earth's rotation along both senses of each axis.
    fn tumble(table: &RateTablePlan) -> Self {
        let (rest_s, slow_rad_s) = (table.rest_s, table.tumble_share * table.turn_rad_s);
        let rest = Move {
            kind: Kind::Still,
            duration_s: rest_s,
            ramp_s: 0.0,
        };
        // A rotation by Ω (T − ramp) is a quarter turn.
        let quarter = |axis: usize| Move {
            duration_s: 0.5 * PI / slow_rad_s + table.ramp_s,
            ..spin(table, axis, slow_rad_s, axis, (0.0, 0.0, 0.0))
        };
        // From z up: y, −z, −y up about x; then x and −x about z.
        let turns = [vec![0], vec![0], vec![0], vec![2], vec![2, 2]];
        let mut moves = vec![rest];
        for turn in turns {
            moves.extend(turn.into_iter().map(quarter));
            moves.push(rest);
        }
        Self {
            text: format!("six still attitudes of {rest_s:.0} s, each axis up and down once"),
            moves,
            rows_hz: 20.0,
            cycles: 0,
        }
    }

    /// Steady rotation about each axis, both senses.
    fn slews(table: &RateTablePlan) -> Self {
        let rates = table.slew_shares.map(|share| share * table.turn_rad_s);
        let mut moves = Vec::new();
        for axis in 0..3 {
            for rate in rates {
                let both = [rate, -rate];
                moves.extend(both.map(|rate| spin(table, axis, rate, axis, (0.0, 0.0, 0.0))));
            }
        }
        Self {
            text: format!(
                "slews about each axis at {:.2}, {:.2} and {:.2} rad/s, both senses, {} moves of {:.0} s",
                rates[0],
                rates[1],
                rates[2],
                moves.len(),
                table.move_s
            ),
            moves,
            rows_hz: 20.0,
            cycles: 0,
        }
    }

    /// Oscillation about one axis at a time, at two frequencies.
    fn oscillations(table: &RateTablePlan) -> Self {
        let lines = [
            (1.0, table.oscillation_rad),
            (table.fast_hz, table.fast_rad),
        ];
        let of_axis =
            |axis: usize| lines.map(|(hz, angle)| spin(table, axis, 0.0, axis, (hz, angle, 0.0)));
        let moves: Vec<Move> = (0..3).flat_map(of_axis).collect();
        Self {
            text: format!(
                "oscillation about each axis by itself, {} rad at {} Hz and {} rad at {} Hz, {} moves of {:.0} s",
                lines[0].1,
                lines[0].0,
                lines[1].1,
                lines[1].0,
                moves.len(),
                table.move_s
            ),
            moves,
            rows_hz: 200.0,
            cycles: 0,
        }
    }

    /// Cones about each axis, both senses.
    fn cones(table: &RateTablePlan) -> Self {
        let (cone_hz, cone_rad) = (table.cone_hz, table.cone_rad);
        let cone = |axis: usize, sense: f64| Move {
            kind: Kind::Coning {
                axis,
                frequency_hz: sense * cone_hz,
                angle_rad: cone_rad,
            },
            duration_s: table.move_s,
            ramp_s: 2.0 * table.ramp_s,
        };
        let moves: Vec<Move> = (0..3)
            .flat_map(|axis| [1.0, -1.0].map(|sense| cone(axis, sense)))
            .collect();
        Self {
            text: format!(
                "coning about each axis, {cone_rad} rad at {cone_hz} Hz, both senses, {} moves of {:.0} s",
                moves.len(),
                table.move_s
            ),
            moves,
            rows_hz: 200.0,
            cycles: 0,
        }
    }

    /// Spin-synchronous oscillation of every pair of axes.
    pub fn spins(table: &RateTablePlan) -> Self {
        let (turn_rad_s, angle_rad) = (table.turn_rad_s, table.oscillation_rad);
        let mut moves = Vec::new();
        for axis in 0..3 {
            for across in [(axis + 1) % 3, (axis + 2) % 3] {
                for sense in [1.0, -1.0] {
                    for phase_rad in [0.0, TAU / 4.0] {
                        let line = (turn_rad_s / TAU, angle_rad, phase_rad);
                        moves.push(spin(table, axis, sense * turn_rad_s, across, line));
                    }
                }
            }
        }
        Self {
            text: format!(
                "spin-synchronous oscillation, {} moves of {:.0} s (spin {turn_rad_s:.2} rad/s about one axis in both senses, {angle_rad} rad at {:.2} Hz about another, phases 0 and 90\u{b0}, all six pairs)",
                moves.len(),
                table.move_s,
                turn_rad_s / TAU
            ),
            moves,
            rows_hz: 100.0,
            cycles: 0,
        }
    }

    /// Temperature up and down at rest.
    fn warming(table: &RateTablePlan) -> Self {
        let RateTablePlan {
            cycles,
            cycle_s,
            warming_k,
            ..
        } = *table;
        Self {
            text: format!(
                "{cycles} cycles of the temperature by {warming_k:.0} K at rest, {cycle_s:.0} s each"
            ),
            moves: vec![Move {
                kind: Kind::Still,
                duration_s: cycles as f64 * cycle_s,
                ramp_s: 0.0,
            }],
            rows_hz: 1.0,
            cycles,
        }
    }

    /// Total duration \[s\].
    pub fn duration_s(&self) -> f64 {
        self.moves.iter().map(|one| one.duration_s).sum()
    }

    /// Computes the signals of the experiment, with gravity along z at the beginning.
    ///
    /// # Inputs
    /// `scale_error`, `sensing_from_body`: of the model.
    pub fn signals(
        &self,
        scale_error: [f64; 3],
        sensing_from_body: Matrix3<f64>,
        plan: &CataloguePlan,
    ) -> Signals {
        let motion = (increments_rad(&self.moves, self.rows_hz), None);
        let inputs = Inputs::default();
        let mut signals = Signals::of_known(
            motion,
            inputs,
            self.rows_hz,
            scale_error,
            sensing_from_body,
            plan,
        );
        let force = |axis: usize| -> Vec<f64> {
            let vertical = signals.space_vector(2, axis).into_iter();
            vertical.map(|along| GRAVITY_M_S2 * along).collect()
        };
        signals.force_m_s2 = Some([0, 1, 2].map(force));
        if self.cycles > 0 {
            let rows = signals.rows as f64;
            let warming: Vec<f64> = (0..signals.rows)
                .map(|row| {
                    let cycle = (self.cycles as f64 * (row as f64 + 0.5) / rows).fract();
                    plan.table.warming_k * (1.0 - (2.0 * cycle - 1.0).abs())
                })
                .collect();
            let warming_k: Triad = [0, 1, 2].map(|_| warming.clone());
            signals.warming_k = Some(warming_k);
        }
        signals
    }
}

/// Predicts the information of unrecorded rows on hypotheses; `None` if the rows are too few for the transform.
///
/// # Inputs
/// `columns`: of the set; `levels`: noise of each gyro by these rows.
pub fn information(
    signals: &Signals,
    columns: &[Sensed],
    set: &[&Hypothesis],
    levels: &[NoiseLevels],
) -> Option<Information> {
    let rows = signals.rows;
    let observations = Observations::bridged(&vec![true; rows])
        .ok()?
        .to_fast_length();
    let nothing = [0, 1, 2].map(|_| vec![0.0; rows]);
    let columns = PoolColumns { columns, signals };
    let equations =
        NormalEquations::new(observations, &nothing, &columns, NoiseLevels::mean(levels));
    Some(Information::of(&equations, set, levels))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use rlg_inference::{Hypothesis, NoiseLevels};
    use rlg_plan::{CataloguePlan, RateTablePlan};

    use super::{Experiment, GRAVITY_M_S2, information};
    use crate::candidates::Pool;
    use crate::entries;

    #[test]
    fn a_tumble_shows_gravity_along_both_senses_of_each_axis() {
        let plan = CataloguePlan::default();
        let tumble = Experiment::tumble(&plan.table);
        let signals = tumble.signals([0.0; 3], Matrix3::identity(), &plan);
        let force = signals.force_m_s2.as_ref().expect("gravity");
        for axis in force {
            let most = axis.iter().copied().fold(f64::MIN, f64::max);
            let least = axis.iter().copied().fold(f64::MAX, f64::min);
            assert!((most - GRAVITY_M_S2).abs() < 1e-3 && (least + GRAVITY_M_S2).abs() < 1e-3);
        }
    }

    #[test]
    fn no_experiment_asks_more_than_a_table_does() {
        for one in Experiment::all(&RateTablePlan::default()) {
            for one in &one.moves {
                let (rate_rad_s, acceleration_rad_s2) = one.greatest();
                assert!(rate_rad_s < 6.5 && acceleration_rad_s2 < 60.0, "{one:?}");
            }
        }
    }

    #[test]
    fn a_bias_at_rest_is_known_to_the_noise_over_the_root_of_time() {
        let plan = CataloguePlan::default();
        let one = Experiment::tumble(&plan.table);
        let signals = one.signals([0.0; 3], Matrix3::identity(), &plan);
        let mut pool = Pool::default();
        let bias = pool.whole(entries::find("gyro_bias").expect("listed"), &signals);
        let bias = Hypothesis::of_terms(1, bias[0].1.clone());
        let white = 1e-12;
        let levels = [NoiseLevels {
            white,
            ..NoiseLevels::default()
        }; 3];
        let known = information(&signals, &pool.columns, &[&bias], &levels).expect("rows");
        // n rows of variance N², each with b T: 1/σ² = n T²/N².
        let expected = signals.rows as f64 / (one.rows_hz * one.rows_hz * white);
        assert!((known.fisher[(0, 0)] / expected - 1.0).abs() < 0.01);
    }
}
