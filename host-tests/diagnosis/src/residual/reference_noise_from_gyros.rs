//! Noise of the reference by the gyros, for payloads carried by both.

use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::conditioned::weights;
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, each_axis, weighted_sum};

use crate::alignment::case_motion::{add_filtered, levels_of};
use crate::rows::data::{Data, bridged};
use crate::search::structure::{Found, left_by};

/// Estimates the noise of the reference's increments from the gyros \[rad by row\]: added to the reference, it gives the
/// motion with the least noise by both, however small the motion. Unseen rows are bridged, or zero outside the spans.
pub fn read_by_gyros(data: &Data, found: &Found) -> Option<Triad> {
    let rows = data.streams.rows;
    let looked_at = data.observed(&data.rows_of(&[Use::Fit])).ok()?;
    let left_rad = bridged(&left_by(found, &found.fit), &looked_at);
    let basis = NoiseBasis::new(&Observations::separate(&vec![true; rows], 1));
    let dct = Dct::new(rows);
    let reading_from_sensed = data.shared().try_inverse()?;
    let motion = &found.motion;
    Some(each_axis(|axis| {
        let weights_of = [0, 1, 2].map(|gyro| reading_from_sensed[(axis, gyro)]);
        let own = levels_of(weights_of, &found.fit.levels);
        let reference = NoiseLevels {
            white: motion.reference_walk[axis].value,
            angle: motion.reference_angle[axis].value,
            ..NoiseLevels::default()
        };
        let toward = weights(&basis.by_coefficient(reference), &basis.by_coefficient(own));
        let nothing = vec![0.0; rows];
        add_filtered(
            &nothing,
            &weighted_sum(weights_of, &left_rad),
            &toward,
            &dct,
        )
    }))
}
