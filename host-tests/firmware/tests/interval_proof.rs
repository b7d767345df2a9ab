//! Proves by interval arithmetic that no word of the fixed-point chain wraps, whatever samples enter.
//!
//! [`Interval`] runs the chain's own text on the intervals of all values that a word of `Fixed` can hold:
//! counts and pickoff steps stand for all within their limits, taps for all that adaptation can reach. What
//! the chain remembers from sample to sample grows to a fixed point, and [`prove`] shows that it has reached
//! it: so the bounds hold for a stream of any length. Held samples and lost ones only leave words at zero that
//! are otherwise intervals around it.
//!
//! # Parameters
//! Every interval grows with the magnitude of a parameter. So the corners of the ranges bound what is inside
//! them; where `Parameters::check` refuses a corner, the point of its boundary on the way to the corner stands
//! for it. Rates on both sides of every change of the increment unit, all lengths of the output period and all
//! filter orders are gone through.
//!
//! The exact sums (`i64` of fine units) are not behind the number system; their bounds are derived here from
//! the same limits in `i128`, for output periods of ordinary samples alone and for such with readings that cover
//! several periods.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::OnceLock;

use proptest::prelude::*;
use trueaxis::design_parameters::{
    ACCELEROMETER_SUM_CODES, BIAS_PERIODS, DITHER_LIMIT_RAD, FINE_PER_CODE_LOG2, FLEXURE_LIMIT,
    GAP_IN_FRAME_RAD, INSTALLATION_LIMIT_RAD, LEVER_ARM_LIMIT_M, PICKOFF_REACH_RAD,
    SCALED_FLEXURE_LIMIT, SENSED_LIMIT_RAD, SWING_LIMIT_M_S, VELOCITY_GAP_IN_FRAME_M_S,
    VELOCITY_LIMIT_M_S, increment_unit_log2,
};
use trueaxis::numbers::Interval;
use trueaxis::numbers::exact::{ExactCoefficient, ExactLever, ExactWeight, VELOCITY_UNIT_M_S};
use trueaxis::numbers::interval::{Bound, Operation, Span, Summed, take_bounds};
use trueaxis::{
    AccelerometerParameters, Chain, ChainState, CrossAxis, Fixed, NumberSystem, Parameters, Sample,
};

// ---- Configurations

/// A corner of the parameter ranges, or a point on the way to it.
#[derive(Debug, Clone, Copy)]
struct Corner {
    samples_per_output: u16,
    sample_rate_hz: f64,
    acceleration_order: u8,
    /// Dither frequency \[cycles per sample\].
    cycles: f64,
    delay_s: f64,
    adapts: bool,
    /// Pickoff gain \[1\].
    gain: f64,
    /// All signed parameters over their limits.
    signed: f64,
    /// Angles of a pulse and of a pickoff code \[rad\] and velocity of an accelerometer code \[m/s\].
    weights: (f64, f64, f64),
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "n {}, {} Hz, order {}, {:.3} cycles, {:.0} us, {}, gain {}, {:.2} of the angles, weights {:.1e} rad {:.0e} rad {:.0e} m/s",
            self.samples_per_output,
            self.sample_rate_hz,
            self.acceleration_order,
            self.cycles,
            self.delay_s * 1e6,
            if self.adapts { "adapts" } else { "frozen" },
            self.gain,
            self.signed,
            self.weights.0,
            self.weights.1,
            self.weights.2,
        )
    }
}

impl Corner {
    fn parameters(&self) -> Parameters {
        let signed = self.signed;
        let angles_rad = signed * INSTALLATION_LIMIT_RAD;
        let unit = f64::from(1u8 << increment_unit_log2(self.sample_rate_hz));
        let flexure = signed * FLEXURE_LIMIT.min(SCALED_FLEXURE_LIMIT / unit);
        let mut parameters = Parameters {
            pulse_weight_rad: [self.weights.0; 3],
            bias_rad_s: [0.01; 3],
            // The reading is multiplied by 1 − s.
            scale_error: [-signed.abs() / 128.0; 3],
            installation_rad: CrossAxis::from_array([angles_rad; 6]),
            flexure_s2: CrossAxis::from_array(
                [flexure / (self.sample_rate_hz * self.sample_rate_hz); 6],
            ),
            pickoff_gain: [self.gain; 3],
            pickoff_weight_rad: self.weights.1,
            sample_rate_hz: self.sample_rate_hz,
            samples_per_output: self.samples_per_output,
            acceleration_order: self.acceleration_order,
            pickoff_delay_s: [self.delay_s; 3],
            dither_frequency_hz: [self.cycles * self.sample_rate_hz; 3],
            dither_amplitude_rad: [if self.adapts { 0.01 } else { 0.0 }; 3],
            adaptation_time_s: if self.adapts { 0.1 } else { 0.0 },
            accelerometers: None,
        };
        let arm_m = farthest_arms_m(&parameters) / 2.0 * 0.999_999;
        parameters.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [self.weights.2; 3],
            bias_m_s2: [1.0; 3],
            scale_error: [-signed.abs() / 128.0; 3],
            misalignment_rad: CrossAxis::from_array([angles_rad; 6]),
            lever_arm_m: [
                [0.0, -arm_m, arm_m],
                [-arm_m, 0.0, -arm_m],
                [arm_m, -arm_m, 0.0],
            ],
        });
        parameters
    }

    /// The corner itself, or the last point before it that the check accepts.
    fn accepted(self) -> Option<Self> {
        if self.parameters().check().is_ok() {
            return Some(self);
        }
        // No delay, a quarter of a cycle, where adaptation's quadrature does least, and no angles.
        let towards = |share: f64| Self {
            cycles: 0.25 + share * (self.cycles - 0.25),
            delay_s: share * self.delay_s,
            signed: share * self.signed,
            ..self
        };
        let fits = |share| towards(share).parameters().check().is_ok();
        let (mut low, mut high) = (0.0, 1.0);
        if !fits(low) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(towards(low))
    }
}

/// Sum of the two coordinates by which an accelerometer may stand beside its axis \[m\].
fn farthest_arms_m(parameters: &Parameters) -> f64 {
    let fastest_rad_s = 2.0 * parameters.largest_increment_rad() * parameters.sample_rate_hz;
    (2.0 * LEVER_ARM_LIMIT_M).min(SWING_LIMIT_M_S / fastest_rad_s)
}

/// Finest, ordinary and coarsest pulses, pickoff codes and accelerometer codes \[rad, rad, m/s\].
const WEIGHTS: [(f64, f64, f64); 3] = [
    (1.0 / (1u64 << 34) as f64, 1.0 / (1u64 << 35) as f64, 1e-9),
    (1e-6, 1e-10, 1e-6),
    (1e-4, 1e-4, 1e-2),
];

/// Sample rates at both ends of every increment unit \[Hz\].
const RATES_HZ: [f64; 8] = [500.0, 999.0, 1000.0, 1999.0, 2000.0, 3999.0, 4000.0, 8000.0];

/// All lengths of the output period at the corners of what sums depend on.
fn corners() -> Vec<Corner> {
    let base = Corner {
        samples_per_output: 1,
        sample_rate_hz: 4000.0,
        acceleration_order: 4,
        cycles: 0.25,
        delay_s: 0.0,
        adapts: false,
        gain: 2.0,
        signed: 1.0,
        weights: WEIGHTS[1],
    };
    let mut corners: Vec<Corner> = Vec::new();
    // Some change one stage alone, so that not every corner needs all of them.
    let mut add = |corner: Corner| {
        let turn = corners.len();
        corners.push(Corner {
            signed: [1.0, -1.0, 1.0, 0.0][turn / 7 % 4],
            acceleration_order: 1 + (turn / 5 % 4) as u8,
            ..corner
        });
    };
    for samples_per_output in 1..=40 {
        for sample_rate_hz in RATES_HZ {
            let base = Corner {
                samples_per_output,
                sample_rate_hz,
                ..base
            };
            for weights in WEIGHTS {
                add(Corner {
                    gain: 0.0,
                    weights,
                    ..base
                });
                for cycles in [0.04, 0.25, 0.4] {
                    for delay_s in [-1e-4, 0.0, 1e-4] {
                        add(Corner {
                            cycles,
                            delay_s,
                            weights,
                            ..base
                        });
                    }
                }
            }
            // Windows of 0.03 s cost more samples.
            for (cycles, delay_s) in [(0.04, -1e-4), (0.04, 1e-4), (0.4, 1e-4)] {
                add(Corner {
                    cycles,
                    delay_s,
                    adapts: true,
                    ..base
                });
            }
        }
    }
    corners
}

// ---- The proof of one configuration

/// The bounds of every word over every stream of samples.
///
/// # Panics
/// If what the chain remembers does not come to a fixed point.
fn prove(parameters: &Parameters, sample: impl Fn(u32) -> Sample) -> Vec<Bound> {
    let chain = Chain::<Interval>::new(parameters).expect("parameters in range");
    let mut state = ChainState::new();
    // Whole windows, so that blocks end alike; thrice, because windows look at one gyro a sample; and longer
    // than the chain's memory of samples.
    let block = 3 * chain.samples_per_window();
    let block = block * 12u32.div_ceil(block);
    let mut bounds = Vec::new();
    let mut words = Vec::new();
    for k in 0..3 * block {
        chain.process(&mut state, &sample(k));
        chain.widen_taps(&mut state);
        if (k + 1) % block == 0 {
            words.push(format!("{:?}", state.words()));
            merge(&mut bounds, take_bounds());
        }
    }
    assert_eq!(words[1], words[2], "no fixed point: {parameters:?}");
    bounds
}

/// The corners that stand, each with its bounds: found once for all tests.
fn proofs() -> &'static [(Corner, Vec<Bound>)] {
    static PROOFS: OnceLock<Vec<(Corner, Vec<Bound>)>> = OnceLock::new();
    PROOFS.get_or_init(|| {
        let standing = corners().into_iter().filter_map(Corner::accepted);
        standing
            .map(|corner| (corner, prove(&corner.parameters(), still)))
            .collect()
    })
}

/// Widens bounds by others.
fn merge(bounds: &mut Vec<Bound>, others: Vec<Bound>) {
    for other in others {
        let same =
            |bound: &&mut Bound| (bound.operation, bound.file) == (other.operation, other.file);
        match bounds.iter_mut().find(same) {
            Some(bound) => {
                bound.span.low = bound.span.low.min(other.span.low);
                bound.span.high = bound.span.high.max(other.span.high);
            }
            None => bounds.push(other),
        }
    }
}

fn still(_: u32) -> Sample {
    Sample::default()
}

fn stage(bound: &Bound) -> &'static str {
    let stem = Path::new(bound.file).file_stem().and_then(|s| s.to_str());
    // What `map` calls is called from the core library.
    stem.filter(|_| bound.file.starts_with("src"))
        .unwrap_or("-")
}

#[test]
fn no_word_of_the_fixed_point_chain_wraps() {
    let mut worst: BTreeMap<(Operation, &str), (Bound, Corner)> = BTreeMap::new();
    for (corner, bounds) in proofs() {
        for bound in bounds {
            let entry = worst
                .entry((bound.operation, stage(bound)))
                .or_insert((*bound, *corner));
            if bound.headroom() < entry.0.headroom() {
                *entry = (*bound, *corner);
            }
        }
    }
    println!("{} configurations", proofs().len());
    println!("| operation | stage | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|---|");
    for ((operation, stage), (bound, corner)) in &worst {
        println!(
            "| {operation:?} | {stage} | i{} | {:.6e} | {:.3} | {corner} |",
            bound.bits,
            bound.value(),
            bound.headroom(),
        );
    }
    let wraps: Vec<_> = worst.iter().filter(|(_, (b, _))| !b.fits()).collect();
    assert!(wraps.is_empty(), "{wraps:?}");
}

/// Bounds are those of all samples: the sample at hand does not matter, nor what was held or lost.
#[test]
fn the_bounds_do_not_depend_on_the_samples() {
    let corner = Corner {
        samples_per_output: 7,
        sample_rate_hz: 4000.0,
        acceleration_order: 4,
        cycles: 0.1,
        delay_s: 1e-5,
        adapts: true,
        gain: 2.0,
        signed: 1.0,
        weights: WEIGHTS[1],
    };
    let parameters = corner.parameters();
    let expected = prove(&parameters, still);
    // Any 32 bits: most of them are held.
    let bits = |k: u32| k.wrapping_mul(2_654_435_761).rotate_left(k % 32) as i32;
    let any = prove(&parameters, |k| Sample {
        pulse_counts: [bits(k), bits(k + 1), bits(k + 2) % 1000],
        pickoff_codes: [bits(k + 3), bits(k + 4) % 1_000_000, bits(k + 5)],
        accelerometer_codes: [bits(k + 6), bits(k + 7), bits(k + 8)],
    });
    assert_eq!(any, expected);

    // A lost sample in every third output period.
    let chain = Chain::<Interval>::new(&parameters).expect("parameters in range");
    let mut state = ChainState::new();
    for k in 0..10_000 {
        if k % 21 == 3 {
            chain.process_lost(&mut state, 1);
        } else {
            chain.process(&mut state, &Sample::default());
        }
        chain.widen_taps(&mut state);
    }
    for bound in take_bounds() {
        let same = |b: &&Bound| (b.operation, b.file) == (bound.operation, bound.file);
        let known = expected.iter().find(same);
        assert!(
            known.is_some_and(|known| {
                known.span.low <= bound.span.low && bound.span.high <= known.span.high
            }),
            "{bound:?}, {known:?}"
        );
    }
}

// ---- The intervals are those of `Fixed`

fn span(limit: i32) -> impl Strategy<Value = (Span, i32)> {
    (-limit..=limit, -limit..=limit, 0.0..=1.0f64).prop_map(|(one, other, share)| {
        let (low, high) = (one.min(other), one.max(other));
        let inside = f64::from(low) + share * (f64::from(high) - f64::from(low));
        let span = Span {
            low: low.into(),
            high: high.into(),
        };
        (span, (inside as i32).clamp(low, high))
    })
}

fn long_span(limit: i64) -> impl Strategy<Value = (Span, i64)> {
    (-limit..=limit, -limit..=limit, any::<bool>()).prop_map(|(one, other, at_high)| {
        let (low, high) = (one.min(other), one.max(other));
        let span = Span {
            low: low.into(),
            high: high.into(),
        };
        (span, if at_high { high } else { low })
    })
}

/// An increment, within the largest that the chain knows.
fn increment() -> impl Strategy<Value = (Span, i32)> {
    span(1 << 30)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Each operation of `Fixed` on values inside intervals gives a value inside the interval's result, and on
    /// points the result itself.
    #[test]
    fn an_interval_holds_what_fixed_point_makes_of_its_values(
        (a, x) in increment(),
        (b, y) in increment(),
        (c, z) in increment(),
        (d, w) in increment(),
        (t, k) in span(1 << 30),
        (long, sum) in long_span(1 << 60),
        (tilts, tilted) in long_span(1 << 62),
    ) {
        type I = Interval;
        type F = Fixed;
        let point = |value: i32| Span::point(value);
        let (pa, pb, pc, pd, pt) = (point(x), point(y), point(z), point(w), point(k));
        let p_long = Span::point(sum);
        let p_tilts = Span::point(tilted);
        // Of intervals, of points, of fixed point.
        let mut cases: Vec<(Span, Span, i64)> = Vec::new();
        let mut case = |interval: Span, point: Span, fixed: i64| cases.push((interval, point, fixed));

        case(I::strip(a, t, b), I::strip(pa, pt, pb), F::strip(x, k, y).into());
        case(I::add_product(a, t, b), I::add_product(pa, pt, pb), F::add_product(x, k, y).into());
        case(I::difference(a, b), I::difference(pa, pb), F::difference(x, y).into());
        let filter = I::filter(&[t, t, t, t], [a, b, c, d]);
        let of_points = I::filter(&[pt, pt, pt, pt], [pa, pb, pc, pd]);
        case(filter, of_points, F::filter(&[k; 4], [x, y, z, w]));
        let held = |sum: i64| if F::beyond(sum) { F::held(sum) } else { sum };
        let (i_held, p_held) = (I::held(long), I::held(p_long));
        prop_assert!(i_held.contains(held(sum)) && p_held.contains(held(sum)));
        case(I::acceleration(i_held), I::acceleration(Span::point(held(sum))),
            F::acceleration(held(sum)).into());
        prop_assert!(!F::beyond(sum) || I::beyond(long));
        case(I::tilt(t, a), I::tilt(pt, pa), F::tilt(k, x).into());
        case(I::tilted(t, a, b, c), I::tilted(pt, pa, pb, pc), F::tilted(k, x, y, z));
        case(I::add_tilted(long, long), I::add_tilted(p_long, p_long), F::add_tilted(sum, sum));
        case(I::turn(a, tilts), I::turn(pa, p_tilts), F::turn(x, tilted).into());
        case(I::add_cross(long, a, b, c, d), I::add_cross(p_long, pa, pb, pc, pd),
            F::add_cross(sum, x, y, z, w));
        case(I::add_product_of(long, a, b), I::add_product_of(p_long, pa, pb),
            F::add_product_of(sum, x, y));
        case(I::within_sample(a), I::within_sample(pa), F::within_sample(x).into());
        case(I::increment_factor(a), I::increment_factor(pa), F::increment_factor(x).into());
        case(I::step_factor(a), I::step_factor(pa), F::step_factor(x).into());
        case(I::add_correlation(long, a, b), I::add_correlation(p_long, pa, pb),
            F::add_correlation(sum, x, y));
        // An angle at the period's start, and one sample on.
        let zero = Summed::default();
        let lever = I::lever(I::advance(zero, a), b, c);
        let fixed = F::lever(F::advance(Default::default(), x), y, z);
        case(lever, lever, fixed.into());

        for (index, (interval, point, fixed)) in cases.into_iter().enumerate() {
            prop_assert!(interval.contains(fixed), "case {index}: {interval:?} {fixed}");
            prop_assert!(
                point == Span::point(fixed) || point == interval,
                "case {index}: {point:?} {fixed}"
            );
        }

        // What leaves the words returns nothing and is recorded.
        take_bounds();
        I::fine(tilts, long);
        I::at_end(a, b);
        for bound in take_bounds() {
            let fixed = match bound.operation {
                Operation::Fine => F::fine(tilted, sum),
                Operation::FineTilted => F::fine(tilted, 0),
                Operation::FineCross => F::fine(0, sum),
                _ => F::at_end(x, y),
            };
            prop_assert!(bound.span.contains(fixed));
        }
    }

    /// The same of what boot converts: weights with their counts, taps with their steps.
    #[test]
    fn an_interval_holds_what_boot_makes_of_a_weight(
        limit in 1..i32::MAX,
        share in 0.0..=1.0f64,
        angle_rad in 1e-9..0.0024f64,
        up in 1..=4i64,
    ) {
        let value = (f64::from(limit) * share) as i32;
        let weight = angle_rad / f64::from(limit);
        let interval = Interval::pulse_weight(weight, limit);
        let fixed = Fixed::pulse_weight(weight, limit);
        for counts in [value, -value, limit, -limit] {
            prop_assert!(Interval::pulses(interval, 0).contains(Fixed::pulses(fixed, counts)));
        }
        // A tap of up to four thirds of a gain.
        let tap = (weight * 2f64.powi(64)) as i64 / 3 * up;
        let (scale, scale_fixed) = (Interval::step_scale(limit), Fixed::step_scale(limit));
        prop_assert_eq!(Interval::codes_per_factor(scale), Fixed::codes_per_factor(scale_fixed));
        prop_assert_eq!(
            Interval::tap(tap, scale),
            Span::point(Fixed::tap(tap, scale_fixed))
        );
        prop_assert!(Interval::step(scale, 0).contains(Fixed::step(scale_fixed, value)));
        for small in [share / 64.0, -share / 64.0] {
            prop_assert_eq!(Interval::coefficient(small), Span::point(Fixed::coefficient(small)));
            prop_assert_eq!(
                Interval::filter_coefficient(64.0 * small),
                Span::point(Fixed::filter_coefficient(64.0 * small))
            );
            prop_assert_eq!(
                Interval::flexure(512.0 * small),
                Span::point(Fixed::flexure(512.0 * small))
            );
        }
    }
}

// ---- The exact sums

/// A magnitude that an exact sum reaches, and its word.
#[derive(Debug, Clone, Copy)]
struct Sum {
    name: &'static str,
    magnitude: i128,
    bits: u32,
    /// LSB as an exponent of two, and its unit.
    unit: (i32, &'static str),
}

impl Sum {
    fn headroom(&self) -> f64 {
        2f64.powi(self.bits as i32 - 1) / self.magnitude as f64
    }

    /// Magnitudes alone, so that the word's lowest value counts as beyond.
    fn fits(&self) -> bool {
        self.magnitude <= i128::MAX >> (128 - self.bits)
    }
}

/// Sums as they are met, each one compared with its word; gives the magnitude on.
#[derive(Default)]
struct Sums(Vec<Sum>);

impl Sums {
    fn keep(
        &mut self,
        name: &'static str,
        magnitude: i128,
        bits: u32,
        unit: (i32, &'static str),
    ) -> i128 {
        match self.0.iter_mut().find(|known| known.name == name) {
            Some(known) => known.magnitude = known.magnitude.max(magnitude),
            None => self.0.push(Sum {
                name,
                magnitude,
                bits,
                unit,
            }),
        }
        magnitude
    }

    fn angle(&mut self, name: &'static str, magnitude: i128) -> i128 {
        self.keep(name, magnitude, 64, (-64, "rad"))
    }

    fn velocity(&mut self, name: &'static str, magnitude: i128) -> i128 {
        self.keep(name, magnitude, 64, (-56, "m/s"))
    }

    /// Angle words × vector words, as `turning::cross` forms them, for any unit of the vector.
    fn crossed(&mut self, angle: i128, vector: i128) -> i128 {
        let words = |fine: i128| (fine + (1 << 31)) >> 32;
        self.keep("turning: angle word", words(angle), 32, (-32, "rad"));
        self.keep("turning: vector word", words(vector), 32, (-24, "m/s"));
        self.velocity("turning: product", 2 * words(angle) * words(vector))
    }
}

fn up(value: f64, exponent: i32) -> i128 {
    (value.abs() * 2f64.powi(exponent)).ceil() as i128
}

/// What an output period holds beside its ordinary samples.
#[derive(Debug, Clone, Copy)]
enum Readings {
    /// Ordinary samples alone.
    Ordinary,
    /// A reading after lost samples, however many were lost before the output period, and more of them that cover so
    /// many sampling periods of this one: at least two each.
    AfterLost {
        /// Sampling periods that the readings after the first one cover.
        later: i128,
    },
}

/// The largest magnitudes of the integer sums between the fixed-point words and the frame, in the order of the data.
///
/// `bounds` are those of [`prove`] for the same parameters.
fn exact_sums(parameters: &Parameters, bounds: &[Bound]) -> Vec<Sum> {
    let chain = Chain::<Interval>::new(parameters).expect("parameters in range");
    let ranges = chain.tap_ranges();
    take_bounds();
    let n = i128::from(parameters.samples_per_output);
    let mut largest = exact_sums_of(parameters, bounds, &ranges, Readings::Ordinary);
    for later in 0..n {
        let sums = exact_sums_of(parameters, bounds, &ranges, Readings::AfterLost { later });
        for (known, sum) in largest.iter_mut().zip(sums) {
            assert_eq!(known.name, sum.name);
            known.magnitude = known.magnitude.max(sum.magnitude);
        }
    }
    largest
}

fn exact_sums_of(
    parameters: &Parameters,
    bounds: &[Bound],
    ranges: &[[(i64, i64); 2]; 3],
    readings: Readings,
) -> Vec<Sum> {
    let mut sums = Sums::default();
    let axes = [0, 1, 2];
    let most = |values: [i128; 3]| values.into_iter().fold(0, i128::max);
    let n = i128::from(parameters.samples_per_output);
    let rate = parameters.sample_rate_hz;
    let unit_log2 = increment_unit_log2(rate);
    let unit = f64::from(1u8 << unit_log2);
    // Samples that are ordinary, readings that are not, and whether there are any of these.
    let (ordinary, later, gaps) = match readings {
        Readings::Ordinary => (n, 0, 0),
        Readings::AfterLost { later } => (n - 1 - later, later, 1),
    };
    // More than BIAS_PERIODS at once are settled beside the sums; an output period may have begun before.
    let periods = n + gaps * (i128::from(BIAS_PERIODS) - 1);
    let leaving = |operation: Operation, file: &str| {
        let same = |b: &&Bound| b.operation == operation && stage(b) == file;
        bounds.iter().find(same).map_or(0, Bound::magnitude)
    };
    let word = 1i128 << 32;

    // counts.rs: what a gap's reading may add leaves room for a whole period's ordinary samples.
    let scaled = axes.map(|i| parameters.pulse_weight_rad[i] * (1.0 - parameters.scale_error[i]));
    let one =
        axes.map(|i| i128::from((SENSED_LIMIT_RAD * unit / parameters.pulse_weight_rad[i]) as i32));
    sums.keep("counts: sum", n * most(one), 32, (0, "counts"));
    let angle_of = |counts: i128, i: usize| up(scaled[i], 64) * counts + counts;
    let sensed_one = most(axes.map(|i| angle_of(one[i], i)));
    let all_counts = i128::from(i32::MAX);
    let of_gap = most(axes.map(|i| angle_of(all_counts, i)));
    sums.keep("counts: weight x a gap's counts", of_gap, 128, (-64, "rad"));
    let bias_one = most(parameters.bias_rad_s.map(|bias| up(bias / rate, 64)));
    let bias = sums.angle("counts: bias", bias_one * periods);

    // dither.rs: a step a period, of a gap four at most, and one before the output period.
    let gain = axes.map(|i| {
        parameters.pickoff_gain[i]
            * parameters.pickoff_weight_rad
            * (1.0 - parameters.scale_error[i])
    });
    let fits = i32::MAX / (2 * i32::from(parameters.samples_per_output) + 4);
    let limit = |gain: f64| i128::from(((DITHER_LIMIT_RAD * unit / gain) as i32).min(fits));
    let steps = n + 4 * gaps;
    let codes = steps * most(gain.map(limit));
    sums.keep("dither: difference of codes", codes, 32, (0, "codes"));
    let largest = |(low, high): (i64, i64)| i128::from(low.unsigned_abs().max(high.unsigned_abs()));
    let strips = |tap: usize| most(axes.map(|i| largest(ranges[i][tap]) * limit(gain[i])));
    let (strip_now, strip_past) = (strips(0), strips(1));
    let strip = strip_now + strip_past;
    let stripped = sums.angle("dither: taps x difference", strip * steps);

    // The matrix.
    let terms = parameters.installation_rad.to_array();
    let term = |terms: [f64; 6]| {
        terms
            .map(|term| up(term, 37))
            .into_iter()
            .fold(0, i128::max)
    };
    let matrix = sums.keep("compensation: coefficient", term(terms), 32, (-37, ""));
    let through = |angle: i128, term: i128| angle + 2 * (((angle * term) >> 37) + 2);

    // gap.rs: all readings of gaps within the frame, to the words in which they are summed; on the sensing axes; and
    // their magnitudes.
    let within = |largest: i128| gaps * (largest + 21 * (word >> 1));
    let gap = within(up(GAP_IN_FRAME_RAD, 64));
    let sensing = |gap: i128, term: i128| (gap << 37) / ((1 << 37) - 2 * term - 16) + 8;
    let of_later = through(
        later * (sensed_one + strip) + later / 2 * strip_past,
        matrix,
    );
    let gap_path = gap + of_later;

    // adaptation.rs: one step of gain and quadrature over the farthest that the block may be, and a sample's step.
    let moved = most(axes.map(|i| {
        // What is no dithered axis does not move.
        let reach = ((PICKOFF_REACH_RAD / gain[i]) as u32).min(1 << 30);
        let travelled = i128::from(reach) + limit(gain[i]);
        sums.keep(
            "adaptation: codes since the start",
            travelled,
            32,
            (0, "codes"),
        );
        // Of ±ADAPTATION_RANGE, one ADAPTATION_STEP_LIMIT, and the rounding of single precision.
        let step = |(low, high): (i64, i64)| match i128::from(high) - i128::from(low) {
            0 => 0,
            span => span / 40 + (span >> 18) + 1,
        };
        ranges[i].map(step).iter().sum::<i128>() * travelled
    }));
    let moved = sums.angle("adaptation: moved taps x codes", moved);

    // compensation.rs: over the period's angle.
    let of_samples = ordinary * (sensed_one + strip);
    let on_axes = of_samples + sensing(gap, matrix);
    let sensed = on_axes + stripped + bias;
    sums.angle("counts: weight x sum", sensed);
    sums.angle("compensation: sensing axes", on_axes + moved + bias);
    let before = sums.angle("gap: angle before", through(of_samples, matrix) + gap);
    let at_rest = through(of_samples + moved + bias, matrix) + gap;
    let at_rest = sums.angle("compensation: at rest", at_rest);

    // coning.rs
    let tilted = leaving(Operation::FineTilted, "coning") << unit_log2;
    let crossed = leaving(Operation::FineCross, "coning") << (2 * unit_log2);
    let beside = sums.angle("coning: beside the sum", tilted + crossed);
    let rotation = sums.angle("chain: rotation", at_rest + beside);

    // gap.rs: before × reading, less half of what gaps have with each other; the period's at its end.
    sums.keep("gap: angle word", gap / word + 1, 32, (-32, "rad"));
    let crossed = |a: i128, b: i128| 2 * (a / word + 1) * (b / word + 1);
    let of_gaps = crossed(before, gap_path) + crossed(gap, gap_path) / 2 + n * word;
    let of_gaps = gaps * sums.angle("gap: coning before", of_gaps);
    let with_later = gaps * crossed(gap, rotation) / 2;
    let of_gaps = sums.angle("gap: coning", of_gaps + with_later);
    let rotation = sums.angle("chain: rotation with gaps", rotation + of_gaps);

    // frame.rs: a part of a code and a half are carried.
    let carry = (1i128 << FINE_PER_CODE_LOG2) - 1;
    sums.angle("frame: rotation with carry", rotation + carry);
    let lost = i128::from(u32::MAX);
    let owed = through(of_gap + all_counts * strip + bias_one * lost, matrix);
    let code = |fine: i128| fine >> FINE_PER_CODE_LOG2;
    sums.keep(
        "frame: codes owed at once",
        code(owed) + 1,
        64,
        (-35, "rad"),
    );

    let Some(known) = &parameters.accelerometers else {
        return sums.0;
    };
    // velocity.rs
    let weight = known.weight_m_s;
    let scaled = axes.map(|i| weight[i] * (1.0 - known.scale_error[i]));
    let share = i128::from(ACCELEROMETER_SUM_CODES) / n;
    let one = axes.map(|i| i128::from((VELOCITY_LIMIT_M_S * unit / weight[i]) as i32).min(share));
    // A gap's codes leave room for a whole period's.
    let with_gap = i128::from(i32::MAX - ACCELEROMETER_SUM_CODES);
    let codes = n * most(one) + gaps * with_gap;
    sums.keep("velocity: sum of codes", codes, 32, (0, "codes"));
    let velocity_of = |codes: i128, i: usize| up(scaled[i], 56) * codes + codes;
    let one = most(axes.map(|i| velocity_of(one[i], i)));
    let misaligned = term(known.misalignment_rad.to_array());
    sums.keep("velocity: coefficient", misaligned, 32, (-37, ""));
    let bias_one = most(known.bias_m_s2.map(|bias| up(bias / rate, 56)));
    let bias = bias_one * periods;
    let of_samples = ordinary * one;
    let gap_velocity = within(up(VELOCITY_GAP_IN_FRAME_M_S, 56));
    let sensed = of_samples + sensing(gap_velocity, misaligned) + bias;
    sums.velocity("velocity: sensed", sensed);
    let gap_velocity_path = gap_velocity + through(later * one, misaligned);
    let velocity_before = through(of_samples, misaligned) + gap_velocity;
    let velocity_before = sums.velocity("gap: velocity before", velocity_before);
    let felt = through(of_samples + bias, misaligned) + gap_velocity;
    let felt = sums.velocity("velocity: felt", felt);
    let of_gap = most(axes.map(|i| velocity_of(all_counts, i)));
    let owed = through(of_gap + bias_one * lost, misaligned);
    sums.keep(
        "frame: velocity owed at once",
        code(owed) + 1,
        64,
        (-27, "m/s"),
    );

    // sculling.rs, gap.rs
    let rectified = leaving(Operation::FineCross, "sculling") << (2 * unit_log2);
    let rectified = sums.velocity("sculling: of samples", rectified);
    sums.keep(
        "gap: velocity word",
        gap_velocity / word + 1,
        32,
        (-24, "m/s"),
    );
    let across = crossed(before, gap_velocity_path) + crossed(gap_path, velocity_before);
    let among = crossed(gap, gap_velocity_path) + crossed(gap_path, gap_velocity);
    let of_gaps = sums.velocity("gap: sculling before", across + among / 2 + n * word);
    let with_later = (crossed(gap, felt) + crossed(rotation, gap_velocity)) / 2;
    let of_gaps = sums.velocity("gap: sculling", gaps * (of_gaps + with_later));
    let rectified = sums.velocity("chain: rectified", rectified + of_gaps);

    // size_effect.rs: levers of the arms, and of twice their differences.
    let lever = |arm_m: f64| up(arm_m * rate / VELOCITY_UNIT_M_S, 25) + 1;
    let arms_m = farthest_arms_m(parameters);
    let of_square = lever(4.0 * LEVER_ARM_LIMIT_M);
    sums.keep(
        "size effect: lever of a rate",
        lever(LEVER_ARM_LIMIT_M),
        32,
        (-25, "x 256 m/s"),
    );
    sums.keep(
        "size effect: lever of a square",
        of_square,
        32,
        (-25, "x 256 m/s"),
    );
    let times = |lever: i128, value: i128| ((lever * value) >> 25) + 70;
    let at_end = leaving(Operation::AtEnd, "size_effect") << unit_log2;
    sums.angle("size effect: rate", at_end);
    let swing = sums.velocity("size effect: swing", times(lever(arms_m), at_end));
    let square = leaving(Operation::FineCross, "size_effect") << (2 * unit_log2);
    sums.angle("size effect: squares", square);
    // The four differences together: two coordinates beside its axis of each accelerometer, and twice the one along it.
    let differences_m = 3.0 * arms_m + 2.0 * LEVER_ARM_LIMIT_M;
    let gathered = times(lever(2.0 * differences_m) + 3, square);
    let gathered = sums.velocity("size effect: gathered", gathered);

    // turning.rs: what gathered evenly, and the swing at the end; then the difference of both.
    let evenly = sums.velocity("chain: gathered evenly", felt + rectified + gathered);
    let third = sums.crossed(rotation, evenly) >> 2;
    let second = sums.crossed(rotation, evenly + third) / 3 + word;
    let turned = sums.crossed(rotation, evenly + second) >> 1;
    let gathered = sums.velocity("turning: gathered", evenly + turned);
    let third = sums.crossed(rotation, swing) / 3 + word;
    let second = sums.crossed(rotation, swing + third) >> 1;
    let swung = swing + sums.crossed(rotation, swing + second);
    let swung = sums.velocity("turning: at the end", swung);
    let owed = sums.velocity("chain: swing of the period", swung + swing);
    let velocity = sums.velocity("chain: velocity", gathered + owed);
    sums.velocity("frame: velocity with carry", velocity + carry);
    sums.0
}

#[test]
fn no_exact_sum_wraps() {
    let mut worst: Vec<(Sum, Corner)> = Vec::new();
    for (corner, bounds) in proofs() {
        let sums = exact_sums(&corner.parameters(), bounds);
        worst.resize(worst.len().max(sums.len()), (sums[0], *corner));
        for (known, sum) in worst.iter_mut().zip(sums) {
            if known.0.name != sum.name || sum.headroom() < known.0.headroom() {
                *known = (sum, *corner);
            }
        }
    }
    println!("| sum | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|");
    for (sum, corner) in &worst {
        let (exponent, unit) = sum.unit;
        println!(
            "| {} | i{} | {:.5e} {unit} | {:.3} | {corner} |",
            sum.name,
            sum.bits,
            sum.magnitude as f64 * 2f64.powi(exponent),
            sum.headroom(),
        );
    }
    let wraps: Vec<&(Sum, Corner)> = worst.iter().filter(|(sum, _)| !sum.fits()).collect();
    assert!(wraps.is_empty(), "{wraps:?}");
}

proptest! {
    /// The products of the exact sums are those that the bounds take them for, at the ends of their words too.
    #[test]
    fn exact_products_are_those_of_whole_numbers(
        exponent in -34.0..-13.3f64,
        counts in any::<i32>(),
        share in -1.0..=1.0f64,
        value in -(1i64 << 62)..1i64 << 62,
        small in -(1i64 << 57)..1i64 << 57,
    ) {
        let weight = exponent.exp2();
        // Half a radian of them.
        let most = (0.5 / weight) as i128;
        let counts = i128::from(counts).clamp(-most, most) as i32;
        let product = ExactWeight::of(weight, 64).times(counts);
        let per_count = weight * 2f64.powi(64);
        let exact = ((per_count * 2048.0) as i128 * i128::from(counts)) >> 11;
        prop_assert!((i128::from(product) - exact).abs() <= 1 + i128::from(counts).abs());

        let coefficient = share / 64.0 * 0.999;
        let whole = (coefficient * 2f64.powi(37)).round_ties_even() as i128;
        let product = ExactCoefficient::of(coefficient).times(value);
        let exact = (whole * i128::from(value)) >> 37;
        prop_assert!((i128::from(product) - exact).abs() <= 2);

        let lever = share * 62.5;
        let whole = (lever * 2f64.powi(25)).round_ties_even() as i128;
        let product = ExactLever::of(lever * VELOCITY_UNIT_M_S).times(small);
        let exact = (whole * i128::from(small)) >> 25;
        // The lowest bit of the value is left out.
        prop_assert!((i128::from(product) - exact).abs() <= 66, "{product} {exact}");
    }
}

// ---- The largest increment

/// The check's own bound of an increment is that of the words, to their rounding.
#[test]
fn the_largest_increment_is_that_of_the_check() {
    let mut largest = (0.0, String::new());
    for (corner, bounds) in proofs() {
        let parameters = corner.parameters();
        let of_words = case_increment_rad(&parameters, bounds);
        let of_check = parameters.largest_increment_rad();
        assert!(
            of_words < of_check + rounding_rad(&parameters),
            "{corner}: {of_words} {of_check}"
        );
        // From below, limits are whole counts and codes: close where those are fine. The finest codes have a limit of
        // their own.
        let fine = corner.weights == WEIGHTS[1];
        assert!(
            !fine || of_words > 0.999 * of_check,
            "{corner}: {of_words} {of_check}"
        );
        if of_check > largest.0 {
            largest = (of_check, corner.to_string());
        }
    }
    println!("{} rad: {}", largest.0, largest.1);
}

/// Ten LSBs of an increment \[rad\].
fn rounding_rad(parameters: &Parameters) -> f64 {
    let unit_log2 = increment_unit_log2(parameters.sample_rate_hz) as i32;
    10.0 * 2f64.powi(unit_log2 - 37)
}

fn case_increment_rad(parameters: &Parameters, bounds: &[Bound]) -> f64 {
    let is_turn = |b: &&Bound| b.operation == Operation::Turn;
    let in_units = bounds.iter().find(is_turn).expect("a turn").value();
    in_units * f64::from(1u8 << increment_unit_log2(parameters.sample_rate_hz))
}

// ---- Inside the corners

fn six(limit: f64) -> impl Strategy<Value = CrossAxis<f64>> {
    prop::array::uniform6(-limit..=limit).prop_map(CrossAxis::from_array)
}

/// Anywhere in the ranges, every axis on its own.
fn parameters() -> impl Strategy<Value = Parameters> {
    use prop::array::uniform3 as three;
    let limit = 1.0 / 128.0;
    let gyros = (
        three((-34.0..-13.4f64).prop_map(f64::exp2)),
        three(-limit..=limit),
        six(limit),
        six(8.0),
        three(prop_oneof![Just(0.0), 0.0..=2.0f64]),
        (-35.0..-13.4f64).prop_map(f64::exp2),
        three(-1e-4..=1e-4f64),
        three(0.04..0.4f64),
        three(prop_oneof![Just(0.0), 1e-5..0.01f64]),
        prop_oneof![Just(0.0), 0.1..1000.0f64],
    );
    let accelerometers = (
        three((-29.8..-6.7f64).prop_map(f64::exp2)),
        three(-1.0..=1.0f64),
        three(-limit..=limit),
        six(limit),
        three(three(-0.5..=0.5f64)),
    );
    (gyros, accelerometers, 500.0..=8000.0f64, 1..=40u16, 1..=4u8).prop_map(
        |(gyros, accelerometers, rate, samples_per_output, acceleration_order)| {
            let (pulse_weight_rad, scale_error, installation_rad, flexure, gain, code, ..) = gyros;
            let (.., pickoff_delay_s, cycles, dither_amplitude_rad, adaptation_time_s) = gyros;
            let (weight_m_s, bias_m_s2, scale, misalignment_rad, lever_arm_m) = accelerometers;
            let unit = f64::from(1u8 << increment_unit_log2(rate));
            let flexure_share = (4.0 / unit).min(1.0) / (rate * rate);
            let mut parameters = Parameters {
                pulse_weight_rad,
                bias_rad_s: [0.01; 3],
                scale_error,
                installation_rad,
                flexure_s2: flexure.map(|k| k * flexure_share),
                pickoff_gain: gain,
                pickoff_weight_rad: code,
                sample_rate_hz: rate,
                samples_per_output,
                acceleration_order,
                pickoff_delay_s,
                dither_frequency_hz: cycles.map(|cycles| cycles * rate),
                dither_amplitude_rad,
                adaptation_time_s,
                accelerometers: None,
            };
            parameters.samples_per_output =
                samples_per_output.min(parameters.most_samples_per_output());
            let arms = farthest_arms_m(&parameters);
            parameters.accelerometers = Some(AccelerometerParameters {
                weight_m_s,
                bias_m_s2,
                scale_error: scale,
                misalignment_rad,
                lever_arm_m: lever_arm_m.map(|arm| arm.map(|m| m * arms)),
            });
            parameters
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// The corners bound what is inside them.
    #[test]
    fn no_word_wraps_inside_the_corners(parameters in parameters()) {
        prop_assume!(parameters.check().is_ok());
        let bounds = prove(&parameters, still);
        for bound in &bounds {
            prop_assert!(bound.fits(), "{bound:?}");
        }
        let of_check = parameters.largest_increment_rad() + rounding_rad(&parameters);
        prop_assert!(case_increment_rad(&parameters, &bounds) < of_check);
        for sum in exact_sums(&parameters, &bounds) {
            prop_assert!(sum.fits(), "{sum:?}");
        }
    }
}
