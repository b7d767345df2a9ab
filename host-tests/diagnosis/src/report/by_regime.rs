//! Size of a finding in each regime of motion: the same in all if its name is right.

use rlg_findings::result::RegimeEntry;
use rlg_plan::RegimePlan;

use crate::confirm::whitened::Whitener;
use crate::tiles::regimes::Regime;
use rlg_signal::streams::Triad;

/// Estimates the amplitude of an effect, relative to its fitted size, in each of `regimes` that determines it, the rest of
/// the set held fixed.
///
/// # Inputs
/// `effect_rad`: increments of the effect alone \[rad\]; `left_sigma`: whitened residual of the set \[σ\].
pub(crate) fn sizes(
    whitener: &Whitener,
    effect_rad: &Triad,
    left_sigma: &Triad,
    regimes: &[Regime],
    plan: &RegimePlan,
) -> Vec<RegimeEntry> {
    let acts = (0..3).filter(|&gyro| effect_rad[gyro].iter().any(|value| *value != 0.0));
    let columns: Vec<(usize, Vec<f64>)> = acts
        .map(|gyro| (gyro, whitener.rows(gyro, &effect_rad[gyro])))
        .collect();
    let measured: Vec<(f64, RegimeEntry)> = regimes
        .iter()
        .filter_map(|regime| {
            let (mut own, mut rest) = (0.0, 0.0);
            for (gyro, column) in &columns {
                for row in regime.rows.clone() {
                    own += column[row] * column[row];
                    rest += column[row] * left_sigma[*gyro][row];
                }
            }
            let seen = whitener.seen[regime.rows.clone()].iter();
            let seen = seen.filter(|seen| **seen).count();
            (own > plan.least_snr * plan.least_snr).then(|| {
                let entry = RegimeEntry {
                    name: regime.name.clone(),
                    amplitude: 1.0 + rest / own,
                    std: own.sqrt().recip(),
                };
                (own / seen as f64, entry)
            })
        })
        .collect();
    let densities = measured.iter().map(|(density, _)| *density);
    let strongest = densities.fold(0.0, f64::max);
    measured
        .into_iter()
        .filter(|(density, _)| *density > plan.least_share * strongest)
        .map(|(_, entry)| entry)
        .collect()
}
