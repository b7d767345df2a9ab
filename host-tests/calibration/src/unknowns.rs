//! Lists which numbers a calibration estimates, and the place of each in the joint vector.
//!
//! For a number of recordings, [`Unknowns`] has six K shared by all recordings; bias, scale, installation, delay,
//! pickoff gain and the Earth's rotation for each recording alone, because they change from one switching-on, one
//! mounting and one clock to the next by more than a recording's own precision, and cost K next to nothing. The elastic
//! rate W, a rival that coning confuses with K, stands behind them; it is weighed, never fitted.
//!
//! Priors are zero-mean and wide: they decide only what no recording shows.

use rlg_older::hypotheses::{self, CATALOGUE};
use rlg_older::information::Information;
use rlg_older::workbench::Parameters;

/// The coefficients to calibrate.
pub const FLEXURE: &str = "axis_flexure";

/// The rival effect, which also obeys Ω³A² in coning (physics §3).
pub const RIVAL: &str = "elastic_rate_by_jerk";

/// The Earth's rotation, where the reference does not show it.
pub const EARTH: &str = "earth_rate";

/// What every recording has of its own, and how far from the model it may credibly be (prior, one standard
/// deviation). Wide against instruments (physics §5), because only what no recording shows keeps it: attitude
/// before and after coning knows neither scale nor delay unless the body also turns in between.
const OWN: [(&str, f64); 6] = [
    // 20 °/h
    ("gyro_bias", 1e-4),
    // a thousand ppm
    ("gyro_scale", 1e-3),
    // half a degree
    ("installation", 1e-2),
    // gyros of one clock are read within a fraction of a row of each other
    ("gyro_delay", 1e-4),
    ("dither_gain", 1e-2),
    // the Earth's whole rate
    (EARTH, 7.3e-5),
];

/// Number of K.
pub const COEFFICIENTS: usize = 6;

/// One unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unknown {
    /// Index into the catalogue.
    pub effect: usize,
    /// Which of the effect's parameters.
    pub parameter: usize,
    /// The recording it belongs to; `None`: all.
    pub recording: Option<usize>,
}

impl Unknown {
    /// The contract's kind.
    pub fn kind(&self) -> &'static str {
        CATALOGUE[self.effect].card().kind
    }

    /// The contract's name of the parameter.
    pub fn name(&self) -> String {
        CATALOGUE[self.effect].card().name(self.parameter)
    }

    /// Width of its prior around zero (one standard deviation), in the parameter's unit.
    pub fn prior_width(&self) -> f64 {
        OWN.iter()
            .find(|(kind, _)| *kind == self.kind())
            .map_or(CATALOGUE[self.effect].card().largest, |(_, width)| *width)
    }

    /// The largest value that such an instrument can have.
    pub fn largest(&self) -> f64 {
        CATALOGUE[self.effect].card().largest
    }
}

/// All unknowns in one order; the six K are first.
pub struct Unknowns {
    list: Vec<Unknown>,
    rivals_from: usize,
}

/// The catalogue's index of a kind that this folder names.
pub fn effect(kind: &str) -> usize {
    hypotheses::find(kind)
        .expect("the kinds of this folder stand in the catalogue")
        .0
}

impl Unknowns {
    /// Numbers the unknowns of `recordings` recordings.
    pub fn of(recordings: usize) -> Self {
        let all = |kind: &str, recording: Option<usize>| {
            let effect = effect(kind);
            (0..CATALOGUE[effect].card().count()).map(move |parameter| Unknown {
                effect,
                parameter,
                recording,
            })
        };
        let mut list: Vec<Unknown> = all(FLEXURE, None).collect();
        for recording in 0..recordings {
            list.extend(OWN.iter().flat_map(|(kind, _)| all(kind, Some(recording))));
        }
        let rivals_from = list.len();
        list.extend(all(RIVAL, None));
        Self { list, rivals_from }
    }

    /// How many there are, rivals included.
    pub fn count(&self) -> usize {
        self.list.len()
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Unknown {
        self.list[index]
    }

    /// The indices that are fitted.
    pub fn fitted(&self) -> std::ops::Range<usize> {
        0..self.rivals_from
    }

    /// The indices of the rival.
    pub fn rivals(&self) -> std::ops::Range<usize> {
        self.rivals_from..self.list.len()
    }

    /// The indices that concern `recording`.
    pub fn of_recording(&self, recording: usize) -> Vec<usize> {
        (0..self.list.len())
            .filter(|&index| self.list[index].recording.is_none_or(|of| of == recording))
            .collect()
    }

    /// The catalogue's effects that are fitted, the Earth's rotation only where it is unknown.
    pub fn nuisances_and_flexure(earth: bool) -> Vec<usize> {
        std::iter::once(FLEXURE)
            .chain(OWN.iter().map(|(kind, _)| *kind))
            .filter(|kind| earth || *kind != EARTH)
            .map(effect)
            .collect()
    }

    /// Puts what one recording says of the catalogue's parameters into the joint order.
    pub fn adopt(
        &self,
        catalogue: &Parameters,
        part: &Information,
        recording: usize,
    ) -> Information {
        let indices = self.of_recording(recording);
        let place: Vec<usize> = indices
            .iter()
            .map(|&index| {
                let unknown = self.list[index];
                catalogue.of(unknown.effect).start + unknown.parameter
            })
            .collect();
        let mut joint = Information::empty(self.count());
        joint.power = part.power;
        for (a, &to_a) in indices.iter().enumerate() {
            joint.right[to_a] = part.right[place[a]];
            for (b, &to_b) in indices.iter().enumerate() {
                joint.fisher[(to_a, to_b)] = part.fisher[(place[a], place[b])];
            }
        }
        joint
    }
}
