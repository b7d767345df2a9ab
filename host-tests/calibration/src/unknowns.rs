//! Parameters estimated in a calibration, and the place of each in the joint vector.
//!
//! [`Unknowns`] has six K shared by all recordings; bias, scale, installation, delay, pickoff gain and the Earth's rotation
//! for each recording alone, because they change from one turn-on, mounting and clock to the next by more than a
//! recording's own precision, and hardly reduce the precision of K. The elastic rate W, which coning confounds with K,
//! follows as the rival; it is compared, never fitted.
//!
//! Priors are zero-mean and wide: they matter only for parameters that no recording shows.

use rlg_catalogue::Entry;
use rlg_catalogue::entries;
use rlg_model::catalogue::Kind;
use rlg_plan::NuisancePlan;

/// Kind of the coefficients to calibrate.
pub const FLEXURE: &str = "axis_flexure";

/// Rival effect, also proportional to Ω³A² in coning (physics §3).
pub const RIVAL: &str = "elastic_rate_by_jerk";

/// Earth's rotation, if the reference does not contain it.
pub const EARTH: &str = "earth_rate";

/// Nuisance parameters of every recording.
const OWN: [&str; 6] = [
    "gyro_bias",
    "gyro_scale",
    "installation",
    "gyro_delay",
    "dither_gain",
    EARTH,
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
    /// Recording of the unknown; `None`: all.
    pub recording: Option<usize>,
}

impl Unknown {
    /// Prior standard deviation about zero, in the parameter's unit.
    pub fn prior_std(&self, plan: &NuisancePlan) -> f64 {
        match self.kind {
            "gyro_bias" => plan.gyro_bias_rad_s,
            "gyro_scale" => plan.gyro_scale,
            "installation" => plan.installation_rad,
            "gyro_delay" => plan.gyro_delay_s,
            "dither_gain" => plan.dither_gain,
            EARTH => plan.earth_rate_rad_s,
            _ => self.largest(),
        }
    }

    /// Largest value credible for such an instrument.
    pub fn largest(&self) -> f64 {
        entry(self.kind).size.largest
    }

    /// Its unit.
    pub fn unit(&self) -> &'static str {
        entry(self.kind).unit
    }
}

/// Catalogue entry of a kind used in this package.
pub fn entry(kind: &str) -> &'static Entry {
    entries::find(kind).expect("the kinds of this package stand in the catalogue")
}

/// Prior standard deviation of each K about zero \[s²\].
pub fn flexure_std_s2() -> f64 {
    entry(FLEXURE).size.largest
}

/// Contract names of a kind's parameters.
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
    /// Lists the unknowns of `recordings` recordings.
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
            list.extend(OWN.iter().flat_map(|kind| all(kind, Some(recording))));
        }
        let rivals_from = list.len();
        list.extend(all(RIVAL, None));
        Self { list, rivals_from }
    }

    /// Number of unknowns, rivals included.
    pub fn count(&self) -> usize {
        self.list.len()
    }

    /// Unknown at an index.
    pub fn get(&self, index: usize) -> Unknown {
        self.list[index]
    }

    /// Place of a parameter; of the first recording if each has its own.
    pub fn place(&self, kind: &str, name: &str) -> Option<usize> {
        let is = |unknown: &Unknown| unknown.kind == kind && unknown.name == name;
        self.list.iter().position(is)
    }

    /// Indices that are fitted.
    pub fn fitted(&self) -> std::ops::Range<usize> {
        0..self.rivals_from
    }

    /// Indices of the rival.
    pub fn rivals(&self) -> std::ops::Range<usize> {
        self.rivals_from..self.list.len()
    }

    /// Indices of the unknowns of `recording`, in the order of a single recording's.
    pub fn of_recording(&self, recording: usize) -> Vec<usize> {
        (0..self.list.len())
            .filter(|&index| self.list[index].recording.is_none_or(|of| of == recording))
            .collect()
    }

    /// Kinds that are fitted; the Earth's rotation only if unknown.
    pub fn fitted_kinds(earth: bool) -> Vec<&'static str> {
        std::iter::once(FLEXURE)
            .chain(OWN)
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
