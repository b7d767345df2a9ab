//! Steady lines of a unit at rest, and the control by shuffled rows.
//!
//! Enters: the bench with its noise fitted, the split, the model. Leaves: [`RowsFound`]; the lines that the same rows
//! shuffled do not show stay in the bench as terms.

use super::control::{self, Control};
use super::lines;
use super::noise::Declared;
use super::split::Split;
use super::streams::Triad;
use super::workbench::{Parameters, Workbench};

/// What the rows of a unit at rest show of their own making.
#[derive(Default)]
pub struct RowsFound {
    /// The same search on shuffled rows.
    pub control: Option<Control>,
    /// Root mean square rate of the held-out rows about the model, before and after \[rad/s\].
    pub held_out_rad_s: [[f64; 3]; 2],
    /// What was dropped because the control shows as much.
    pub dropped: usize,
}

/// What a search of the rows is given.
pub(super) struct Given<'a> {
    pub parameters: &'a Parameters,
    pub candidates: &'a [usize],
    pub declared: &'a [Declared; 3],
    pub split: &'a Split,
    pub seed: u64,
}

/// Searches; with what was found, ratio and chance of each term that stays in the bench.
pub(super) fn search(
    bench: &mut Workbench,
    given: &Given,
    progress: &dyn Fn(&str),
) -> Result<(RowsFound, Vec<(f64, f64)>), String> {
    let mut found = RowsFound::default();
    let (scene, residual_rad) = (bench.scene(), bench.residual_rad());
    let split = given.split;
    progress("taking out steady lines");
    let lines = lines::search(bench, given.parameters, given.candidates, given.declared)?;
    progress("searching the same rows shuffled");
    let control = control::shuffled(
        scene,
        residual_rad,
        given.parameters,
        given.candidates,
        given.declared,
        split,
        given.seed,
    )?;
    // Two terms a line, in its order.
    for (place, line) in lines.iter().enumerate().rev() {
        if line.ratio <= control.strongest {
            bench.remove_term(2 * place + 1);
            bench.remove_term(2 * place);
            found.dropped += 1;
        }
    }
    let kept = lines.iter().filter(|line| line.ratio > control.strongest);
    let entered = kept
        .flat_map(|line| [(line.ratio, line.p_value); 2])
        .collect();
    found.control = Some(control);
    Ok((found, entered))
}

/// Root mean square rate of some rows, gyro by gyro \[rad/s\].
pub(super) fn scatter_rad_s(
    residual_rad: &Triad,
    rows: &[std::ops::Range<usize>],
    rate_hz: f64,
) -> [f64; 3] {
    [0, 1, 2].map(|axis: usize| {
        let rows = rows.iter().flat_map(Clone::clone);
        let (sum, count) = rows.fold((0.0, 0.0), |(sum, count), row| {
            (sum + residual_rad[axis][row].powi(2), count + 1.0)
        });
        f64::sqrt(sum / f64::max(count, 1.0)) * rate_hz
    })
}
