//! Effects found before a pass, and the residual left to explain.

use rlg_catalogue::entries::LATE_PICKOFF;
use rlg_catalogue::low_pass;
use rlg_catalogue::{Candidate, Column, Pool, Sensed, Signals};
use rlg_inference::Fit;

use super::path::is_same;
use crate::alignment::coarse::Coarse;
use crate::rows::data::Data;
use rlg_signal::streams::{Triad, add, add_triad};

/// Effects found before a pass.
pub(crate) enum Before {
    /// Gross departures, by global regressions.
    Coarse(Coarse),
    /// Fitted set, over the candidates of the previous pass.
    Pass(Fit, Vec<Candidate>),
}

impl Before {
    /// Delay of the pickoffs estimated with the set \[s\].
    pub(crate) fn late_pickoff_s(&self) -> [f64; 3] {
        let mut late_s = [0.0; 3];
        if let Self::Pass(fit, members) = self {
            for (&place, block) in fit.members.iter().zip(&fit.blocks) {
                if members[place].kind == LATE_PICKOFF {
                    for term in &members[place].hypothesis.terms {
                        late_s[term.record] = fit.estimate[block.start + term.parameter];
                    }
                }
            }
        }
        late_s
    }

    /// Linear effects found: gyro, column, size. Columns are computed from the gated motion; the part of an effect that the
    /// gate suppresses would resemble another effect.
    ///
    /// # Inputs
    /// `candidates`: candidates of this pass over `pool`, the set's members among them, linearised about their estimates.
    pub(crate) fn linear(
        &self,
        candidates: &[Candidate],
        pool: &Pool,
        signals: &Signals,
    ) -> Vec<(usize, Sensed, f64)> {
        let mut parts = Vec::new();
        match self {
            Self::Coarse(far) => {
                for gyro in 0..3 {
                    let sensed = 1.0 / (1.0 - signals.scale_error[gyro]);
                    if far.path.delay_s[gyro] != 0.0 {
                        let late = Column::Late(gyro, far.path.delay_s[gyro]);
                        parts.push((gyro, Sensed::independent(late), sensed));
                    }
                    if let Some(low_pass) = far.path.low_pass[gyro] {
                        let passed = Column::LowPass(gyro, low_pass, low_pass::Part::Response);
                        parts.push((gyro, Sensed::independent(passed), sensed));
                    }
                    for (axis, size) in far.sensed[gyro].iter().enumerate() {
                        let sensed = Sensed::tried(Column::Increment(axis), gyro, signals);
                        parts.push((gyro, sensed, *size));
                    }
                }
            }
            Self::Pass(fit, members) => {
                for (&place, block) in fit.members.iter().zip(&fit.blocks) {
                    let is_member = |one: &&Candidate| is_same(one, &members[place]);
                    let Some(now) = candidates.iter().find(is_member) else {
                        continue;
                    };
                    let hypothesis = &now.hypothesis;
                    parts.extend(
                        hypothesis
                            .fixed
                            .iter()
                            .map(|one| (one.record, pool.columns[one.column], one.size)),
                    );
                    let before = &members[place];
                    parts.extend(hypothesis.terms.iter().filter_map(|term| {
                        let name = &now.names[term.parameter];
                        let at = before.names.iter().position(|other| other == name)?;
                        let size = term.coefficient * fit.estimate[block.start + at];
                        Some((term.record, pool.columns[term.column], size))
                    }));
                }
            }
        }
        parts.retain(|(.., size)| *size != 0.0);
        parts
    }
}

/// Residual of the model with its effects, the reference's noise as before the model's filters \[rad\].
pub(crate) fn left_behind_known(data: &mut Data, signals: &Signals) -> Triad {
    if !data.model.effects.is_empty() {
        data.set_known(signals);
    }
    let mut residual_rad = without_known(data, signals);
    // The model's filters have filtered the reference's noise, too; before them it is white.
    if let Some(noise_rad) = data.passed_noise_rad(signals) {
        add_triad(&mut residual_rad, &noise_rad, 1.0);
    }
    residual_rad
}

/// Subtracts the part of the found effects that the gate suppresses in their columns: gyro, column, size.
pub(crate) fn take_out_hidden(
    residual_rad: &mut Triad,
    parts: &[(usize, Sensed, f64)],
    signals: &Signals,
) {
    for (gyro, column, size) in parts {
        if let Some(hidden) = column.hidden(signals) {
            add(&mut residual_rad[*gyro], &hidden, -size);
        }
    }
}

/// Residual without the model's effects \[rad\].
pub(crate) fn without_known(data: &Data, signals: &Signals) -> Triad {
    let mut residual_rad = data.residual_rad.clone();
    if !data.known.is_empty() {
        add_triad(&mut residual_rad, &data.known_rad(signals), -1.0);
    }
    residual_rad
}
