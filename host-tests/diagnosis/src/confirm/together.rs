//! Found set of all recordings, with the share of each; one recording is several with n = 1.

use rlg_catalogue::Candidate;
use rlg_findings::result::Tested;
use rlg_inference::{Fit, Hypothesis, JointLikelihood, NormalEquations};
use rlg_plan::Plan;

use crate::confirm::sharing::{Shared, Sharing};
use crate::rows::data::Data;
use crate::search::structure::{Found, Searched};
use crate::self_test::{FoundSet, Row, self_test_on};

/// A found set over all recordings, and each recording's share of it.
pub struct Together {
    /// All candidates, indexed as in `fit`.
    pub(crate) shared: Vec<Shared>,
    /// Candidates of each recording, over its own columns.
    pub(crate) candidates: Vec<Vec<Candidate>>,
    /// Fit of the best set.
    pub(crate) fit: Fit,
    /// The set by recording: the same members, places as in `shared`, over the recording's own columns.
    pub(crate) found: Vec<Found>,
    /// Number of evaluated sets.
    pub(crate) tried: usize,
}

impl Together {
    /// Set of a single recording, whose effects are not distinguishable from those of the unit.
    pub(crate) fn of_one(found: Found) -> Self {
        let shared = |(place, one): (usize, &Candidate)| Shared {
            candidate: one.clone(),
            sharing: Sharing::Common,
            own: vec![Some((place, (0..one.hypothesis.parameters).collect()))],
        };
        Self {
            shared: found.candidates.iter().enumerate().map(shared).collect(),
            candidates: vec![found.candidates.clone()],
            fit: found.fit.clone(),
            tried: found.tried,
            found: vec![found],
        }
    }

    /// A recording with its share of the set.
    pub(crate) fn of<'a>(&'a self, data: &'a Data<'a>, recording: usize) -> Searched<'a> {
        Searched {
            data,
            found: &self.found[recording],
        }
    }

    /// Runs the Monte Carlo self-test of the search on all recordings.
    pub(crate) fn self_test(
        &self,
        sums: Option<&NormalEquations>,
        plan: &Plan,
        seed: u64,
    ) -> Option<Tested> {
        let parts = self.found.iter().map(|own| &own.equations);
        let data = JointLikelihood::new(parts.chain(sums).collect());
        let members = self.fit.members.iter();
        let members = members.map(|&place| &self.shared[place].candidate.hypothesis);
        let members: Vec<&Hypothesis> = members.collect();
        let of = |one| {
            let Shared {
                candidate, sharing, ..
            }: &Shared = one;
            let row = Row::of(candidate)?;
            Some(match sharing {
                Sharing::Common => row,
                Sharing::Apart | Sharing::Only(_) => row.only_tried(),
            })
        };
        let rows: Vec<Row> = self.shared.iter().filter_map(of).collect();
        let set = FoundSet {
            levels: &self.fit.levels,
            members: &members,
        };
        self_test_on(&data, set, &rows, plan, seed)
    }

    /// Frees the spectra of the columns, most of the memory, once the set is final.
    pub(crate) fn release(&mut self) {
        self.found
            .iter_mut()
            .for_each(|own| own.equations.truncate(0));
    }
}
