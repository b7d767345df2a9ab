//! Test of a search's residual against its noise, and the terms of that noise.

use rlg_findings::result::NoiseTermsEntry;
use rlg_inference::Hypothesis;
use rlg_inference::evaluate::residual_power;
use rlg_plan::FindingsPlan;
use rlg_signal::streams::{AXES, Streams};

use super::allan_terms;
use crate::confirm::goodness::{Misfit, misfits};
use crate::iteration::pass::left_on;
use crate::report::summary;
use crate::rows::data::Data;
use crate::search::structure::Found;
use crate::settings::Settings;

/// True if the residual of a gyro agrees with its noise.
pub(super) fn is_noise(gyro: usize, unlike: &[Misfit]) -> bool {
    unlike.iter().all(|one| one.gyro != gyro)
}

/// Sentences on the noise of each gyro, or on the deviation of its residual from noise.
pub(super) fn noise_lines(
    noise: &[Option<NoiseTermsEntry>],
    unlike: &[Misfit],
    streams: &Streams,
    plan: &FindingsPlan,
) -> Vec<String> {
    let of_gyro = |(gyro, terms): (usize, &Option<NoiseTermsEntry>)| match is_noise(gyro, unlike) {
        true => terms
            .as_ref()
            .map(|terms| allan_terms::sentence(AXES[gyro], terms, plan)),
        false => summary::unlike_noise(gyro, unlike, streams.rate_hz),
    };
    noise.iter().enumerate().filter_map(of_gyro).collect()
}

/// Octaves in which the residual of a gyro deviates from the fitted noise by more than pulse quantisation hides.
pub(super) fn unlike_noise(data: &Data, found: &Found, settings: &Settings) -> Vec<Misfit> {
    let of_gyro = |gyro: usize| {
        let levels = found.fit.levels[gyro];
        let basis = found.equations.basis_beside_gaps(levels);
        let left = left_on(&found.equations, &found.fit, &found.candidates, gyro);
        misfits(&basis, &left, levels, gyro, &settings.plan)
    };
    let is_shown = |one: &Misfit| !data.lattice.hides_angle(one.gyro, one.angle_rms_rad);
    (0..3).flat_map(of_gyro).filter(is_shown).collect()
}

/// Noise terms of each gyro given the found set; `None` if a record does not separate them.
pub(super) fn noise_terms(data: &Data, found: &Found) -> [Option<NoiseTermsEntry>; 3] {
    let record = (data.streams.rows, data.streams.rate_hz);
    let member = |&place: &usize| &found.candidates[place].hypothesis;
    let set: Vec<&Hypothesis> = found.fit.members.iter().map(member).collect();
    let power = residual_power(&found.equations, &set, &found.fit);
    std::array::from_fn(|gyro| allan_terms::of_gyro(&found.equations.basis, &power[gyro], record))
}
