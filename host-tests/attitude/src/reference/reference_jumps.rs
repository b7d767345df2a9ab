//! Jumps of the reference: permanent changes of its attitude between two stamps, not sensed by the gyros.
//!
//! A jump is an outlier of one row of the increments. The error of a single stamp also appears in the next row with opposite
//! sign, and is no jump.

use rlg_plan::AttitudePlan;
use rlg_signal::axes::Triad;

use crate::likelihood::block_sums::Statistic;
use crate::likelihood::outliers::{MEDIAN_CHI_SQUARED, Weighted};
use crate::reference::reference_faults::running_median;
use crate::rows::fitting::Fitting;
use crate::rows::increments::Stamps;
use crate::rows::linearised_rows::About;

/// A jump of the reference.
#[derive(Debug, Clone, Copy)]
pub struct Jump {
    /// First stamp after the jump.
    pub stamp: usize,
    /// Row that contains the jump.
    pub row: usize,
    /// Size in the navigation frame \[rad\].
    pub size_rad: [f64; 3],
    /// Standard deviation of each component \[rad\].
    pub std_rad: [f64; 3],
}

/// Marks rows in which the reference jumped; true if there are any.
///
/// # Inputs
/// `left_rad`: residuals of the fit.
pub fn find(
    about: &About,
    (fitting, left_rad): (&Fitting, &Triad),
    known: &mut Stamps,
    plan: &AttitudePlan,
) -> bool {
    let plan = &plan.reference_jumps;
    let increments = &about.increments;
    let mut left_rad = left_rad.clone();
    increments.silence_free(&mut left_rad, |_| true);
    let rough = roughness(&fitting.weighted(&left_rad, increments), plan.around_rows);
    let mut seen: Vec<(usize, f64)> = Vec::new();
    for _ in 0..=plan.most {
        let weighted = fitting.weighted(&left_rad, increments);
        let deflated = |row: usize| weighted.of_jump(row) / rough[row];
        let rows = (0..increments.rows()).filter(|row| !increments.is_free(*row));
        let Some(row) = rows.max_by(|a, b| deflated(*a).total_cmp(&deflated(*b))) else {
            break;
        };
        let size = weighted.of_jump(row);
        let is_one_stamp = [row, row + 1]
            .into_iter()
            .any(|stamp| weighted.of_stamp(stamp) > size);
        seen.push((row, deflated(row)));
        let statistic = Statistic {
            squared_size: size,
            design_effect: rough[row],
            degrees: f64::INFINITY,
            count: 3,
        };
        let gain = statistic.gained(true) - (increments.rows() as f64).ln();
        if is_one_stamp || gain < plan.least_gain {
            break;
        }
        let jump_rad = weighted.jump_rad(row);
        for (left, jump) in left_rad.iter_mut().zip(jump_rad) {
            left[row] -= jump;
        }
    }
    // Statistics that continue into the noise's own tail are noise.
    let apart = seen
        .windows(2)
        .rposition(|pair| pair[0].1 > plan.apart * pair[1].1);
    let count = apart.map_or(0, |last| last + 1);
    for (row, _) in &seen[..count] {
        known.jumped[increments.stamps[row + 1]] = true;
    }
    count > 0
}

/// Estimates the sizes of marked jumps from the fit's residuals in their rows.
pub fn sizes(about: &About, (fitting, left_rad): (&Fitting, &Triad), known: &Stamps) -> Vec<Jump> {
    let increments = &about.increments;
    let pairs = increments.stamps.windows(2).enumerate();
    let jumped = pairs.filter(|(_, pair)| known.jumped[pair[0] + 1..=pair[1]].contains(&true));
    jumped
        .map(|(row, pair)| {
            let mut alone = left_rad.clone();
            increments.silence_free(&mut alone, |free| free != row);
            let mut unit: Triad = std::array::from_fn(|_| vec![0.0; increments.rows()]);
            unit.iter_mut().for_each(|values| values[row] = 1.0);
            let unit = fitting.weighted(&unit, increments);
            let sizes = fitting
                .weighted(&alone, increments)
                .exact_jump_rad(&unit, row);
            Jump {
                stamp: pair[1],
                row,
                size_rad: sizes.map(|[size_rad, _]| size_rad),
                std_rad: sizes.map(|[_, std_rad]| std_rad),
            }
        })
        .collect()
}

/// Local median of the jump statistic about each row, relative to that of noise; at least 1.
fn roughness(weighted: &Weighted, around_rows: usize) -> Vec<f64> {
    let rows = weighted.rows();
    let all: Vec<f64> = (0..rows).map(|row| weighted.of_jump(row)).collect();
    let medians = running_median(&all, around_rows).into_iter();
    medians
        .map(|median| (median / MEDIAN_CHI_SQUARED).max(1.0))
        .collect()
}
