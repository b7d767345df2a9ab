//! Results of all stages, from which findings and figures are formed.

use rlg_catalogue::{Candidate, Pool};
use rlg_plan::Plan;
use rlg_signal::axes::Triad;

use crate::gyros::physics::Gyro;
use crate::gyros::scanned::Step;
use crate::registration::gauss_newton::Registration;
use crate::registration::observed::Observed;
use crate::rows::alignment::{Alignment, COUNT};
use crate::rows::linearised_rows::About;
use crate::selection::group_selection::{Candidates, Named};
use crate::selection::search::Found;

/// Data of few attitudes.
pub(crate) struct Few {
    /// Duration at rest \[s\].
    pub(crate) rest_s: f64,
}

/// A registration and the findings of the search.
pub(crate) struct Fitted {
    pub(crate) registered: Registration,
    pub(crate) gyro: Gyro,
    pub(crate) pool: Pool,
    pub(crate) candidates: Candidates,
    pub(crate) found: Found,
    pub(crate) few: Option<Few>,
}

/// Results of all stages of a diagnosis.
pub(crate) struct Said<'a> {
    pub(crate) observed: &'a Observed<'a>,
    pub(crate) of_model: &'a Alignment,
    pub(crate) registered: &'a Registration,
    pub(crate) gyro: &'a Gyro,
    pub(crate) pool: &'a Pool,
    pub(crate) candidates: &'a Candidates,
    pub(crate) beyond: &'a [f64; COUNT],
    pub(crate) found: &'a Found,
    /// Present if attitudes are too few to estimate their noise.
    pub(crate) few: Option<&'a Few>,
    pub(crate) plan: &'a Plan,
    pub(crate) seed: u64,
}

impl Said<'_> {
    /// Columns of a physical effect about given rows.
    pub(crate) fn columns(&self, named: &Named, about: &About) -> Vec<Triad> {
        match self.candidate(named) {
            Some(candidate) => self.gyro.columns(self.pool, candidate, about),
            None => match named.scanned {
                Some(scanned) => scanned.columns(about, self.gyro),
                None => Vec::new(),
            },
        }
    }

    /// Contribution of each parameter of a physical effect to the gyros, in the case's axes \[rad by row\].
    pub(crate) fn in_case_rad(&self, named: &Named) -> Vec<Triad> {
        if let Some(candidate) = self.candidate(named) {
            return self.gyro.in_case_rad(self.pool, candidate).collect();
        }
        match named.scanned {
            Some(scanned) => scanned.in_case_rad(self.gyro),
            None => Vec::new(),
        }
    }

    fn candidate(&self, named: &Named) -> Option<&Candidate> {
        let mut effects = self.candidates.effects.iter();
        let own = effects.find(|(_, places)| *places == named.places);
        own.filter(|_| named.scanned.is_none())
            .map(|(candidate, _)| candidate)
    }

    /// Start time of a step \[s\].
    pub(crate) fn begins_s(&self, step: Step) -> f64 {
        self.observed.streams.begin_s(step.row)
    }
}
