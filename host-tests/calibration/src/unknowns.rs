//! Lists which numbers a calibration estimates, and the place of each in the joint vector.
//!
//! For a number of recordings, [`Unknowns`] has six K shared by all recordings; bias, scale, installation, delay,
//! pickoff gain and the Earth's rotation for each recording alone, because they change from one switching-on, one
//! mounting and one clock to the next by more than a recording's own precision, and cost K next to nothing. The elastic
//! rate W, a rival that coning confuses with K, stands behind them; it is weighed, never fitted.
//!
//! Priors are zero-mean and wide: they decide only what no recording shows.

use rlg_catalogue::Entry;
use rlg_catalogue::entries;
use rlg_model::catalogue::Kind;

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

/// Gyro and axis of each K, in the order of the contract's names.
pub const PAIRS: [(usize, usize); COEFFICIENTS] = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];

/// One unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unknown {
    /// The contract's kind.
    pub kind: &'static str,
    /// The contract's name of the parameter.
    pub name: &'static str,
    /// The recording it belongs to; `None`: all.
    pub recording: Option<usize>,
}

impl Unknown {
    /// Width of its prior around zero (one standard deviation), in the parameter's unit.
    pub fn prior_width(&self) -> f64 {
        OWN.iter()
            .find(|(kind, _)| *kind == self.kind)
            .map_or_else(|| self.largest(), |(_, width)| *width)
    }

    /// The largest value that such an instrument can have.
    pub fn largest(&self) -> f64 {
        entry(self.kind).size.largest
    }

    /// Its unit.
    pub fn unit(&self) -> &'static str {
        entry(self.kind).unit
    }
}

/// What the catalogue says of a kind that this package names.
pub fn entry(kind: &str) -> &'static Entry {
    entries::find(kind).expect("the kinds of this package stand in the catalogue")
}

/// The contract's names of a kind's numbers.
pub fn names(kind: &str) -> &'static [&'static str] {
    Kind::named(kind)
        .and_then(|kind| kind.groups.first())
        .expect("the kinds of this package have numbers")
        .names
}

/// All unknowns in one order; the six K are first.
pub struct Unknowns {
    list: Vec<Unknown>,
    rivals_from: usize,
}

impl Unknowns {
    /// Numbers the unknowns of `recordings` recordings.
    pub fn of(recordings: usize) -> Self {
        let all = |kind: &'static str, recording: Option<usize>| {
            names(kind).iter().map(move |name| Unknown {
                kind,
                name,
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

    /// The place of a parameter, of the first recording where each has its own.
    pub fn place(&self, kind: &str, name: &str) -> Option<usize> {
        let is = |unknown: &Unknown| unknown.kind == kind && unknown.name == name;
        self.list.iter().position(is)
    }

    /// The indices that are fitted.
    pub fn fitted(&self) -> std::ops::Range<usize> {
        0..self.rivals_from
    }

    /// The indices of the rival.
    pub fn rivals(&self) -> std::ops::Range<usize> {
        self.rivals_from..self.list.len()
    }

    /// The indices that concern `recording`, in the order of a single one's unknowns.
    pub fn of_recording(&self, recording: usize) -> Vec<usize> {
        (0..self.list.len())
            .filter(|&index| self.list[index].recording.is_none_or(|of| of == recording))
            .collect()
    }

    /// The kinds that are fitted, the Earth's rotation only where it is unknown.
    pub fn fitted_kinds(earth: bool) -> Vec<&'static str> {
        std::iter::once(FLEXURE)
            .chain(OWN.iter().map(|(kind, _)| *kind))
            .filter(|kind| earth || *kind != EARTH)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{COEFFICIENTS, FLEXURE, PAIRS, Unknowns, names};

    #[test]
    fn pairs_are_those_that_names_say() {
        let axes = ["x", "y", "z"];
        for (k, (gyro, axis)) in PAIRS.into_iter().enumerate() {
            assert_eq!(names(FLEXURE)[k], format!("{}{}", axes[gyro], axes[axis]));
        }
    }

    #[test]
    fn of_several_recordings_each_has_the_order_of_a_single_one() {
        let single = Unknowns::of(1);
        let several = Unknowns::of(3);
        assert_eq!(
            several.count(),
            single.count() + 2 * (single.fitted().len() - COEFFICIENTS)
        );
        for recording in 0..3 {
            let places = several.of_recording(recording);
            assert_eq!(places.len(), single.count());
            for (own, joint) in places.into_iter().enumerate() {
                let (own, joint) = (single.get(own), several.get(joint));
                assert_eq!((own.kind, own.name), (joint.kind, joint.name));
            }
        }
    }
}
