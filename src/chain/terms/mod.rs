//! Defines compensations that a build may contain beyond the stages, and their composition.
//!
//! A [`Term`] is a configuration that is checked once, a state, and hooks into the chain, each of which is the identity
//! unless the term documents otherwise. Terms are composed as tuples, `(Temperature, GyroResponse<N>)`, whose members
//! act in this order; `()` has no term, and its hooks compile to nothing. A build names its terms as the second
//! parameter of [`Chain`](crate::Chain); the parameter block brings the numbers as records ([`records`]).
//!
//! # Corrected quantities
//! Errors of gyros act about the sensing axes, before Eq. (7). Two values pass there:
//! - increments of one sample, rounded, factors of products ([`Term::increments`]);
//! - exact angles of the output period \[fine units\], shown by frames ([`Term::angles`]).
//!
//! A term whose angle over a period follows from the period's ends or sums costs nothing per sample.
//!
//! # Identity
//! A hook that does nothing returns its input. It does not add zero: in `f32`, −0.0 + 0.0 is +0.0.

pub mod acceleration;

pub mod accelerometer;

pub mod dither;

pub mod elastic;

pub mod ends;

pub mod flexure;

pub mod force;

pub mod force_products;

pub mod magnetic;

pub mod records;

pub mod response;

pub mod scale;

pub mod selection;

pub mod temperature;

pub use accelerometer::AccelerometerQuadratic;
pub use dither::DitherErrors;
pub use elastic::ElasticRate;
pub use flexure::{CubicFlexure, ResonantFlexure};
pub use force::BiasByForce;
pub use force_products::ForceProducts;
pub use magnetic::MagneticBias;
pub use records::{RecordError, TermKind, TermKinds, TermRecords};
pub use response::{AccelerometerDelay, GyroResponse};
pub use scale::ScaleByRate;
pub use selection::{Select, place};
pub use temperature::Temperature;

use core::fmt::Debug;

use crate::chain::design_parameters::TEMPERATURE_RANGE_K;
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::triad::Triad;

/// Every term of this library, in the order in which they act.
pub type AllTerms<N> = (
    Temperature,
    MagneticBias,
    DitherErrors<N>,
    GyroResponse<N>,
    ScaleByRate<N>,
    BiasByForce,
    ForceProducts<N>,
    ElasticRate<N>,
    CubicFlexure<N>,
    ResonantFlexure<N>,
    AccelerometerDelay<N>,
    AccelerometerQuadratic<N>,
);

/// Slowly changing readings, from the main loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SlowReadings {
    /// Temperature of gyros x, y, z \[K\].
    pub temperature_k: [f32; 3],
    /// Its derivative \[K/s\].
    pub temperature_rate_k_s: [f32; 3],
    /// Magnetic flux density, body frame \[T\].
    pub magnetic_field_t: [f32; 3],
}

impl SlowReadings {
    /// True if all three temperatures are within the range that the terms use.
    pub(crate) fn are_temperatures(&self) -> bool {
        let (low, high) = TEMPERATURE_RANGE_K;
        let usable = |kelvin: &f32| (low..=high).contains(kelvin);
        self.temperature_k.iter().all(usable)
    }
}

/// The terms in the main loop: turns slow readings into an update for the interrupt, with nothing shared.
#[derive(Debug, Clone)]
pub struct SlowTerms<N: NumberSystem, T: Term<N>> {
    terms: T,
    state: T::State,
}

/// Corrections that [`SlowTerms`] prepared; the interrupt takes them by a copy
/// ([`Processor::take_slow`](crate::Processor::take_slow)).
#[derive(Debug, Clone, Copy)]
pub struct SlowUpdate<N: NumberSystem, T: Term<N>> {
    pub(crate) prepared: T::State,
    /// True if the temperatures are those of a thermometer of the firmware's own, not of the bank.
    pub(crate) own_thermometer: bool,
}

impl<N: NumberSystem, T: Term<N>> SlowTerms<N, T> {
    /// Terms before their first readings, as [`Chain::checked_terms`](crate::Chain::checked_terms) gives them.
    pub fn new(terms: T) -> Self {
        Self {
            terms,
            state: T::State::default(),
        }
    }

    /// Prepares the corrections by temperatures that the bank sent.
    #[must_use = "the terms use readings that the interrupt takes"]
    pub fn prepare(&mut self, readings: &SlowReadings) -> SlowUpdate<N, T> {
        self.terms.slow(&mut self.state, readings);
        SlowUpdate {
            prepared: self.state,
            own_thermometer: false,
        }
    }

    /// Prepares the corrections by temperatures of the firmware's own thermometer, which then is missed if it falls
    /// silent; the same as [`prepare`](Self::prepare) where one is not a temperature.
    #[must_use = "the terms use readings that the interrupt takes"]
    pub fn prepare_measured(&mut self, readings: &SlowReadings) -> SlowUpdate<N, T> {
        SlowUpdate {
            own_thermometer: readings.are_temperatures(),
            ..self.prepare(readings)
        }
    }
}

/// Sums of an output period when [`Term::angles`] is called.
#[derive(Debug, Clone, Copy)]
pub struct PeriodSums {
    /// Sampling periods that the angles cover.
    pub periods: u32,
    /// Exponent of the increment unit.
    pub unit_log2: u32,
    /// ∫ f dt over the period, body frame \[fine units of velocity\]; zeros unless the terms' `NEEDS_FORCE`.
    pub velocity: [i64; 3],
}

/// A compensation that a build may contain. `()` contains none and compiles to nothing.
pub trait Term<N: NumberSystem>: Debug + Clone + Copy {
    /// State of the term between samples.
    type State: Debug + Clone + Copy + Default;

    /// Kinds of records that configure the term.
    const KINDS: TermKinds;

    /// True if [`PeriodSums::velocity`] is used.
    const NEEDS_FORCE: bool = false;

    /// True if [`force`](Self::force) is used.
    const FOLLOWS_FORCE: bool = false;

    /// Checks the records of [`KINDS`](Self::KINDS) among `parameters.terms` and converts them. Runs at boot. A term
    /// without a record corrects nothing.
    fn new(parameters: &Parameters) -> Result<Self, ParameterError>;

    /// Largest addition of the term to an increment of the case \[increment units per sample\]. The chain's limits of
    /// increment and output period include it.
    fn largest_addition(&self) -> f64 {
        0.0
    }

    /// Takes one sample's velocity increments, body frame, as [`velocities`](Self::velocities) has corrected them. Called
    /// before the sample's other hooks, where there are accelerometers, if `FOLLOWS_FORCE`.
    #[inline(always)]
    fn force(&self, _: &mut Self::State, _: Triad<N::Increment>) {}

    /// Takes the previous and this sample's pickoff readings \[codes\], before the sample's increments.
    #[inline(always)]
    fn pickoffs(&self, _: &mut Self::State, _previous: &[i32; 3], _codes: &[i32; 3]) {}

    /// Starts from these increments about the sensing axes, at the stream's start or after lost samples.
    fn begin(&self, _: &mut Self::State, _: Triad<N::Increment>) {}

    /// Corrects one sample's increments about the sensing axes, free of dither.
    #[inline(always)]
    fn increments(
        &self,
        _: &mut Self::State,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        increments
    }

    /// Takes one sample's increments of the case, body frame; returns the status bits of held values.
    #[inline(always)]
    fn case(&self, _: &mut Self::State, _: Triad<N::Increment>) -> Status {
        Status::default()
    }

    /// Corrects one sample's velocity increments, body frame.
    #[inline(always)]
    fn velocities(
        &self,
        _: &mut Self::State,
        velocities: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        velocities
    }

    /// Bias over one sampling period about the sensing axes \[fine units\], beyond that of the parameters.
    #[inline(always)]
    fn bias(&self, _: &Self::State) -> [i64; 3] {
        [0; 3]
    }

    /// Corrects the output period's angles about the sensing axes \[fine units\].
    #[inline(always)]
    fn angles(&self, _: &mut Self::State, _: &PeriodSums, angles: [i64; 3]) -> [i64; 3] {
        angles
    }

    /// Corrects the angles of a reading that covers several periods and is not part of an output period's angles
    /// \[fine units\].
    #[inline(always)]
    fn angles_wide(&self, _: &Self::State, angles: [i128; 3]) -> [i128; 3] {
        angles
    }

    /// Corrects the output period's velocity that accelerometers sensed \[fine units of velocity\], body frame;
    /// `unit_log2` is the increment unit's exponent.
    #[inline(always)]
    fn felt(&self, _: &mut Self::State, _unit_log2: u32, velocity: [i64; 3]) -> [i64; 3] {
        velocity
    }

    /// Takes slow readings; they hold until the next ones.
    #[inline(always)]
    fn slow(&self, _: &mut Self::State, _: &SlowReadings) {}

    /// Takes the part of `prepared` that [`slow`](Self::slow) forms of its readings: a copy.
    #[inline(always)]
    fn take_slow(&self, _: &mut Self::State, _prepared: &Self::State) {}

    /// Records that the next increments do not follow the last ones: samples were lost, or the source restarted.
    #[inline(always)]
    fn discontinue(&self, _: &mut Self::State) {}

    /// Receives the state of the increments: `_rates_known` while they are free of dither. Else (a failed pickoff)
    /// rates are unknown.
    #[inline(always)]
    fn degrade(&self, _: &mut Self::State, _rates_known: bool) {}
}

/// Adds to the output period's angles \[fine units\] the sum of its samples' tilt corrections, and starts the next sum.
#[inline(always)]
fn add_tilted<N: NumberSystem>(
    sums: &mut [N::Tilted; 3],
    unit_log2: u32,
    mut angles: [i64; 3],
) -> [i64; 3] {
    let sums = core::mem::take(sums);
    for (angle, sum) in angles.iter_mut().zip(sums) {
        let fine = N::fine(sum, N::Cross::default()) << unit_log2;
        *angle = angle.wrapping_add(fine);
    }
    angles
}

impl<N: NumberSystem> Term<N> for () {
    type State = ();
    const KINDS: TermKinds = TermKinds::NONE;

    fn new(_: &Parameters) -> Result<Self, ParameterError> {
        Ok(())
    }
}

/// Implements [`Term`] for a tuple of terms.
macro_rules! tuple_of_terms {
    ($($term:ident $at:tt),+) => {
        impl<N: NumberSystem, $($term: Term<N>),+> Term<N> for ($($term,)+) {
            type State = ($($term::State,)+);
            const KINDS: TermKinds = TermKinds::NONE$(.union($term::KINDS))+;
            const NEEDS_FORCE: bool = false $(|| $term::NEEDS_FORCE)+;
            const FOLLOWS_FORCE: bool = false $(|| $term::FOLLOWS_FORCE)+;

            fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
                Ok(($($term::new(parameters)?,)+))
            }
            fn largest_addition(&self) -> f64 {
                0.0 $(+ self.$at.largest_addition())+
            }
            #[inline(always)]
            fn force(&self, state: &mut Self::State, velocities: Triad<N::Increment>) {
                $(self.$at.force(&mut state.$at, velocities);)+
            }
            #[inline(always)]
            fn pickoffs(&self, state: &mut Self::State, previous: &[i32; 3], codes: &[i32; 3]) {
                $(self.$at.pickoffs(&mut state.$at, previous, codes);)+
            }
            fn begin(&self, state: &mut Self::State, increments: Triad<N::Increment>) {
                $(self.$at.begin(&mut state.$at, increments);)+
            }
            #[inline(always)]
            fn increments(
                &self,
                state: &mut Self::State,
                increments: Triad<N::Increment>,
            ) -> Triad<N::Increment> {
                $(let increments = self.$at.increments(&mut state.$at, increments);)+
                increments
            }
            #[inline(always)]
            fn case(&self, state: &mut Self::State, increments: Triad<N::Increment>) -> Status {
                Status::default()$(.union(self.$at.case(&mut state.$at, increments)))+
            }
            #[inline(always)]
            fn velocities(
                &self,
                state: &mut Self::State,
                velocities: Triad<N::Increment>,
            ) -> Triad<N::Increment> {
                $(let velocities = self.$at.velocities(&mut state.$at, velocities);)+
                velocities
            }
            #[inline(always)]
            fn bias(&self, state: &Self::State) -> [i64; 3] {
                let mut sum = [0i64; 3];
                $(
                    let bias = self.$at.bias(&state.$at);
                    for axis in 0..3 {
                        sum[axis] = sum[axis].wrapping_add(bias[axis]);
                    }
                )+
                sum
            }
            #[inline(always)]
            fn angles(
                &self,
                state: &mut Self::State,
                sums: &PeriodSums,
                angles: [i64; 3],
            ) -> [i64; 3] {
                $(let angles = self.$at.angles(&mut state.$at, sums, angles);)+
                angles
            }
            #[inline(always)]
            fn angles_wide(&self, state: &Self::State, angles: [i128; 3]) -> [i128; 3] {
                $(let angles = self.$at.angles_wide(&state.$at, angles);)+
                angles
            }
            #[inline(always)]
            fn felt(
                &self,
                state: &mut Self::State,
                unit_log2: u32,
                velocity: [i64; 3],
            ) -> [i64; 3] {
                $(let velocity = self.$at.felt(&mut state.$at, unit_log2, velocity);)+
                velocity
            }
            fn slow(&self, state: &mut Self::State, readings: &SlowReadings) {
                $(self.$at.slow(&mut state.$at, readings);)+
            }
            #[inline(always)]
            fn take_slow(&self, state: &mut Self::State, prepared: &Self::State) {
                $(self.$at.take_slow(&mut state.$at, &prepared.$at);)+
            }
            fn discontinue(&self, state: &mut Self::State) {
                $(self.$at.discontinue(&mut state.$at);)+
            }
            fn degrade(&self, state: &mut Self::State, rates_known: bool) {
                $(self.$at.degrade(&mut state.$at, rates_known);)+
            }
        }
    };
}

tuple_of_terms!(A 0);
tuple_of_terms!(A 0, B 1);
tuple_of_terms!(A 0, B 1, C 2);
tuple_of_terms!(A 0, B 1, C 2, D 3);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10);
tuple_of_terms!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11);
