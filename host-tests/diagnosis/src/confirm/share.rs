//! Share of one recording in a confirmed set, as the recording reports it.

use rlg_signal::streams::Triad;

use super::{Confirmed, ConfirmedSet};
use crate::confirm::goodness::Misfit;
use crate::confirm::sharing::{Sharing, with_noise_of};
use crate::confirm::together::Together;
use crate::rows::data::Data;
use crate::search::structure::left_by;

/// Members that a recording reports: its own, and common ones if it is the first that has them.
pub struct Share {
    pub(crate) set: ConfirmedSet,
    /// Recording in which each named member acts, of several; `None` if in all.
    pub(crate) recordings: Vec<Option<String>>,
    /// Residual of the fit of all members \[rad\].
    pub(crate) left_rad: Triad,
    /// Octaves in which the residual departs from the fitted noise.
    pub(crate) misfits: Vec<Misfit>,
}

impl Confirmed {
    /// Share of one recording; its candidates become those reported.
    pub(crate) fn share(&self, together: &mut Together, data: &Data, recording: usize) -> Share {
        let Together { shared, found, .. } = together;
        let count = found.len();
        let found = &mut found[recording];
        let set = &self.set;
        let fit = with_noise_of(&set.fit, recording);
        let left_rad = left_by(found, &fit);
        let is_named_here = |place: &usize| {
            let one = &shared[set.headlines[*place]];
            // Effects found in sums alone are reported with the first of the stretches.
            let first = one.first_recording().filter(|&first| first < count);
            match one.sharing {
                Sharing::Apart if one.own[recording].is_some() => true,
                _ => first.unwrap_or(0) == recording,
            }
        };
        let named: Vec<usize> = (0..set.named.len()).filter(is_named_here).collect();
        let judged = &found.judged;
        let is_here = |place: &usize| shared[judged[*place].hypothesis].own[recording].is_some();
        let here = |places: &[usize]| places.iter().copied().filter(is_here).collect();
        let mut own = fit.clone();
        own.members = at(&named, &fit.members);
        own.ranks = at(&named, &fit.ranks);
        own.squared_sizes = at(&named, &fit.squared_sizes);
        let (unconfirmed, reenacted_away) = (here(&set.unconfirmed), here(&set.reenacted_away));
        let impossible = here(&set.impossible);
        own.blocks = Vec::with_capacity(named.len());
        for &place in &named {
            let headline = set.headlines[place];
            let of_recording = &together.candidates[recording];
            let (alone, first) = shared[headline].alone_in(recording, of_recording);
            let begin = fit.blocks[place].start + first;
            own.blocks.push(begin..begin + alone.names.len());
            found.candidates[headline] = alone;
        }
        let name = &data.streams.piece.recording;
        let of = |place: &usize| match shared[set.headlines[*place]].sharing {
            Sharing::Common => None,
            Sharing::Apart | Sharing::Only(_) => Some(name.clone()),
        };
        Share {
            recordings: named.iter().map(of).collect(),
            left_rad,
            misfits: self.misfits[recording].clone(),
            set: ConfirmedSet {
                named: at(&named, &set.named),
                headlines: at(&named, &set.headlines),
                predictions: set.predictions.clone(),
                unconfirmed,
                reenacted_away,
                // Common to all recordings, reported once.
                shown_anyway: match recording {
                    0 => set.shown_anyway.clone(),
                    _ => Vec::new(),
                },
                impossible,
                reenactments: at(&named, &set.reenactments),
                instant_std_rows: at(&named, &set.instant_std_rows),
                fit: own,
                supported: at(&named, &set.supported),
            },
        }
    }
}

/// Values at some places.
fn at<T: Copy>(places: &[usize], all: &[T]) -> Vec<T> {
    places.iter().map(|&place| all[place]).collect()
}
