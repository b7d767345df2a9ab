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
//! for it. Rates, lengths of the output period and filter orders are gone through.
//!
//! The exact sums (`i64` of fine units) are not behind the number system; their bounds are derived here from
//! the same limits in `i128`.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt;
use std::path::Path;
use std::sync::OnceLock;

use proptest::prelude::*;
use trueaxis::design_parameters::{
    ACCELERATION_LIMIT_RAD, ACCELEROMETER_SUM_CODES, ADAPTATION_RANGE, DITHER_LIMIT_RAD,
    FINE_PER_CODE_LOG2, GAP_LIMIT_RAD, LARGEST_CARRY_CODES, LEVER_ARM_LIMIT_M, SENSED_LIMIT_RAD,
    VELOCITY_GAP_LIMIT_M_S, VELOCITY_LIMIT_M_S,
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
    /// Sign of all signed parameters.
    sign: f64,
    /// Angles of a pulse and of a pickoff code \[rad\] and velocity of an accelerometer code \[m/s\].
    weights: (f64, f64, f64),
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "n {}, {} Hz, order {}, {:.3} cycles, {:.0} us, {}, weights {:.1e} rad {:.0e} rad {:.0e} m/s",
            self.samples_per_output,
            self.sample_rate_hz,
            self.acceleration_order,
            self.cycles,
            self.delay_s * 1e6,
            if self.adapts { "adapts" } else { "frozen" },
            self.weights.0,
            self.weights.1,
            self.weights.2,
        )
    }
}

impl Corner {
    fn parameters(&self) -> Parameters {
        let sign = self.sign;
        let limit = sign / 128.0;
        Parameters {
            pulse_weight_rad: [self.weights.0; 3],
            bias_rad_s: [0.01 * sign; 3],
            // The reading is multiplied by 1 − s.
            scale_error: [-1.0 / 128.0; 3],
            installation_rad: CrossAxis::from_array([limit; 6]),
            flexure_s2: CrossAxis::from_array(
                [8.0 * sign / (self.sample_rate_hz * self.sample_rate_hz); 6],
            ),
            pickoff_gain: [2.0; 3],
            pickoff_weight_rad: self.weights.1,
            sample_rate_hz: self.sample_rate_hz,
            samples_per_output: self.samples_per_output,
            acceleration_order: self.acceleration_order,
            pickoff_delay_s: [self.delay_s; 3],
            dither_frequency_hz: [self.cycles * self.sample_rate_hz; 3],
            dither_amplitude_rad: [if self.adapts { 0.01 } else { 0.0 }; 3],
            adaptation_time_s: if self.adapts { 0.1 } else { 0.0 },
            accelerometers: Some(AccelerometerParameters {
                weight_m_s: [self.weights.2; 3],
                bias_m_s2: [sign; 3],
                scale_error: [-1.0 / 128.0; 3],
                misalignment_rad: CrossAxis::from_array([limit; 6]),
                lever_arm_m: [
                    [0.5 * sign, -0.5, 0.5],
                    [-0.5, 0.5 * sign, -0.5],
                    [0.5, -0.5, 0.5 * sign],
                ],
            }),
        }
    }

    /// The corner itself, or the last point before it that the check accepts.
    fn accepted(self) -> Option<Self> {
        if self.parameters().check().is_ok() {
            return Some(self);
        }
        // No delay, and a quarter of a cycle, where adaptation's quadrature does least.
        let towards = |share: f64| Self {
            cycles: 0.25 + share * (self.cycles - 0.25),
            delay_s: share * self.delay_s,
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

/// Finest, ordinary and coarsest pulses, pickoff codes and accelerometer codes \[rad, rad, m/s\].
const WEIGHTS: [(f64, f64, f64); 3] = [
    (1.0 / (1u64 << 34) as f64, 1e-12, 1e-9),
    (1e-6, 1e-10, 1e-6),
    (1e-4, 1e-4, 1e-2),
];

/// All lengths of the output period at the corners of what sums depend on.
fn corners() -> Vec<Corner> {
    let base = Corner {
        samples_per_output: 1,
        sample_rate_hz: 4000.0,
        acceleration_order: 4,
        cycles: 0.25,
        delay_s: 0.0,
        adapts: false,
        sign: 1.0,
        weights: WEIGHTS[1],
    };
    let mut corners = Vec::new();
    for samples_per_output in 1..=40 {
        for sample_rate_hz in [500.0, 1999.0, 3999.0, 8000.0] {
            for cycles in [0.04, 0.25, 0.4] {
                for delay_s in [-1e-4, 0.0, 1e-4] {
                    for weights in WEIGHTS {
                        corners.push(Corner {
                            samples_per_output,
                            sample_rate_hz,
                            cycles,
                            delay_s,
                            // Both change one stage alone, so that not every corner needs all of them.
                            sign: [1.0, -1.0][corners.len() % 2],
                            acceleration_order: 1 + (corners.len() / 2 % 4) as u8,
                            weights,
                            ..base
                        });
                    }
                }
            }
        }
        // Windows of 0.03 s cost more samples.
        for (sample_rate_hz, cycles) in [
            (500.0, 0.04),
            (2000.0, 0.04),
            (3999.0, 0.04),
            (4000.0, 0.04),
            (8000.0, 0.04),
            (8000.0, 0.4),
        ] {
            for delay_s in [-1e-4, 1e-4] {
                corners.push(Corner {
                    samples_per_output,
                    sample_rate_hz,
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

/// Words that wrap for some stream of samples: operation and stage.
///
/// To be emptied: an output period of 40 samples at the largest increments holds more than the formats of the
/// coning stage (an angle of 0.276 rad in ±0.25, products of 0.076 in ±2⁻⁷).
const WRAPS: &[(Operation, &str)] = &[
    (Operation::AddTilted, "coning"),
    (Operation::Advance, "coning"),
    (Operation::Lever, "coning"),
    (Operation::Lever, "sculling"),
    (Operation::AddCross, "coning"),
    (Operation::AddCross, "sculling"),
];

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
    let wraps: Vec<(Operation, &str)> = worst
        .iter()
        .filter(|(_, (bound, _))| !bound.fits())
        .map(|(key, _)| *key)
        .collect();
    assert_eq!(wraps, WRAPS);
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
        sign: 1.0,
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
        // Levers that an angle of a gap turned are no part of the expected ones.
        let turned = TURNED_BY_GAPS.contains(&bound.operation);
        assert!(
            turned
                || known.is_some_and(|known| {
                    known.span.low <= bound.span.low && bound.span.high <= known.span.high
                }),
            "{bound:?}, {known:?}"
        );
    }
}

/// Words that the angle of a reading after lost samples enters, where they may wrap.
///
/// To be emptied with [`WRAPS`].
const TURNED_BY_GAPS: &[Operation] = &[
    Operation::Turned,
    Operation::Advance,
    Operation::Lever,
    Operation::AddCross,
    Operation::Fine,
];

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

/// Longest gap of the proof \[s\]: the bias over a gap grows with it and has no limit of its own.
const LONGEST_GAP_S: f64 = 1.0;

/// Farthest that a pickoff is from its first reading \[rad\]: the largest dither amplitude, twice, and half as
/// much again. Readings of which the chain takes steps alone have no limit of their own.
const LONGEST_SWING_RAD: f64 = 0.03;

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
        self.magnitude < 1 << (self.bits - 1)
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
        self.0.push(Sum {
            name,
            magnitude,
            bits,
            unit,
        });
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

/// The largest magnitudes of the integer sums between the fixed-point words and the frame, in the order of the
/// data: of an output period of ordinary samples, or `across_gap` of one in which a reading follows lost ones.
///
/// `bounds` are those of [`prove`] for the same parameters.
fn exact_sums(parameters: &Parameters, bounds: &[Bound], across_gap: bool) -> Vec<Sum> {
    let chain = Chain::<Interval>::new(parameters).expect("parameters in range");
    let ranges = chain.tap_ranges();
    take_bounds();
    let mut sums = Sums::default();
    let n = i128::from(parameters.samples_per_output);
    let rate = parameters.sample_rate_hz;
    let lost = up(LONGEST_GAP_S * rate, 0);
    let periods = if across_gap { lost + n } else { n };
    let leaving = |operation: Operation, file: &str| {
        let same = |b: &&Bound| b.operation == operation && stage(b) == file;
        bounds.iter().find(same).map_or(0, Bound::magnitude)
    };

    // counts.rs: without the gap, n samples; with it, its reading for one of them.
    let weight = parameters.pulse_weight_rad[0];
    let scaled = weight * (1.0 - parameters.scale_error[0]);
    let one = i128::from((SENSED_LIMIT_RAD / weight) as i32);
    let gap = if across_gap {
        i128::from((GAP_LIMIT_RAD / weight) as i32)
    } else {
        0
    };
    let counts = (n * one).max((n - 1) * one + gap);
    sums.keep("counts: sum", counts, 32, (0, "counts"));
    let angle_of = |counts: i128| up(scaled, 64) * counts + counts;
    let sensed = sums.angle("counts: weight x sum", angle_of(counts));
    let bias = up(parameters.bias_rad_s[0] / rate, 64) * periods;
    let sensed = sums.angle("counts: with bias", sensed + bias);

    // dither.rs: n steps, one of them after lost samples of up to four.
    let gain = parameters.pickoff_gain[0]
        * parameters.pickoff_weight_rad
        * (1.0 - parameters.scale_error[0]);
    let step = i128::from((DITHER_LIMIT_RAD / gain) as i32);
    let phases = if across_gap { 4 } else { 1 };
    let steps = (n - 1) * step + phases * step;
    sums.keep("dither: difference of codes", steps, 32, (0, "codes"));
    let largest = |(low, high): (i64, i64)| i128::from(low.unsigned_abs().max(high.unsigned_abs()));
    let [tap_now, tap_past] = ranges[0].map(largest);
    let stripped = sums.angle("dither: taps x difference", (tap_now + tap_past) * steps);

    // adaptation.rs: a hundredth of gain and of quadrature a window, over all codes since the start.
    let span = |(low, high): (i64, i64)| i128::from(high) - i128::from(low);
    let swing_codes = up(LONGEST_SWING_RAD / parameters.pickoff_weight_rad, 0).min(1 << 31);
    // Of ±ADAPTATION_RANGE, one step of ADAPTATION_STEP_LIMIT.
    let moved = ranges[0]
        .map(span)
        .iter()
        .map(|span| (span / 40 + 1) * swing_codes)
        .sum();
    let moved = sums.angle("adaptation: moved taps x codes", moved);

    // compensation.rs: the matrix over the period's angle, and over a gap's alone.
    let term = up(parameters.installation_rad.xy, 37);
    sums.keep("compensation: coefficient", term, 32, (-37, ""));
    let through_matrix = |angle: i128| angle + 2 * (((angle * term) >> 37) + 2);
    let axes = sums.angle("compensation: sensing axes", sensed + stripped + moved);
    let case = sums.angle("compensation: at rest", through_matrix(axes));

    // coning.rs: across a gap, ½ before × angle, the words' products and their difference.
    let taps = tap_now + tap_past;
    let before = through_matrix(angle_of((n - 1) * one) + taps * (n - 1) * step);
    let of_gap = through_matrix(angle_of(gap) + taps * phases * step);
    sums.angle("coning: angle of a gap", of_gap);
    let across = 2 * ((before >> 32) + 1) * ((of_gap >> 32) + 1);
    let across = if across_gap { across } else { 0 };
    sums.angle("coning: across a gap", across);
    let beside = sums.angle("coning: beside the sum", leaving(Operation::Fine, "coning"));
    let rotation = sums.angle("chain: rotation vector", case + beside);

    // frame.rs: as much again may be carried.
    let carry = (LARGEST_CARRY_CODES as i128) << FINE_PER_CODE_LOG2;
    let whole = rotation + (across >> 1) + carry + (1 << (FINE_PER_CODE_LOG2 - 1));
    sums.angle("frame: rotation with carry", whole);

    let Some(accelerometers) = &parameters.accelerometers else {
        return sums.0;
    };
    // velocity.rs
    let weight = accelerometers.weight_m_s[0];
    let scaled = weight * (1.0 - accelerometers.scale_error[0]);
    let codes = |limit: f64| i128::from((limit / weight) as i32);
    let most = i128::from(ACCELEROMETER_SUM_CODES);
    let one = codes(VELOCITY_LIMIT_M_S).min(most / n);
    let gap = if across_gap {
        codes(VELOCITY_GAP_LIMIT_M_S).min(most)
    } else {
        0
    };
    let total = (n * one).max((n - 1) * one + gap);
    sums.keep("velocity: sum of codes", total, 32, (0, "codes"));
    let bias = |periods: i128| up(accelerometers.bias_m_s2[0] / rate, 56) * periods;
    let of_codes = |codes: i128| up(scaled, 56) * codes + codes;
    let gained = through_matrix(of_codes(gap) + bias(periods));
    let felt = through_matrix(of_codes(total) + bias(periods));
    let felt = sums.velocity("velocity: felt", felt);

    // sculling.rs: across a gap θ × v + v × θ; then what rectified.
    let gained_before = through_matrix(of_codes((n - 1) * one));
    let twice = sums.crossed(before, gained) + sums.crossed(of_gap, gained_before);
    let twice = if across_gap { twice } else { 0 };
    let twice = sums.velocity("sculling: twice across a gap", twice);
    let rectified = leaving(Operation::Fine, "sculling");
    let rectified = sums.velocity("sculling: rectified", rectified + (twice >> 1));

    // size_effect.rs: levers of the arms, and of twice their differences.
    let lever = |arm_m: f64| up(arm_m * rate / 256.0, 25);
    let (of_rate, of_square) = (lever(LEVER_ARM_LIMIT_M), lever(4.0 * LEVER_ARM_LIMIT_M));
    sums.keep(
        "size effect: lever of a rate",
        of_rate,
        32,
        (-25, "x 256 m/s"),
    );
    sums.keep(
        "size effect: lever of a square",
        of_square,
        32,
        (-25, "x 256 m/s"),
    );
    let times = |lever: i128, value: i128| ((lever * value) >> 25) + 2;
    let at_end = leaving(Operation::AtEnd, "size_effect");
    let swing = sums.velocity("size effect: arms x rate", 2 * times(of_rate, at_end));
    let square = leaving(Operation::Fine, "size_effect");
    let gathered = sums.velocity("size effect: gathered", 4 * times(of_square, square));

    // turning.rs: what gathered evenly, and the swing at the end; then the difference of both.
    let evenly = sums.velocity("chain: gathered evenly", felt + rectified + gathered);
    let third = sums.crossed(rotation, evenly) >> 2;
    let second = sums.crossed(rotation, evenly + third) / 3 + (1 << 32);
    let turned = sums.crossed(rotation, evenly + second) >> 1;
    let gathered = sums.velocity("turning: gathered", evenly + turned);
    let third = sums.crossed(rotation, swing) / 3 + (1 << 32);
    let second = sums.crossed(rotation, swing + third) >> 1;
    let swung = swing + sums.crossed(rotation, swing + second);
    let swung = sums.velocity("turning: at the end", swung);
    let owed = sums.velocity("chain: swing of the period", swung + swing);
    let velocity = sums.velocity("chain: velocity", gathered + owed);
    let whole = velocity + carry + (1 << (FINE_PER_CODE_LOG2 - 1));
    sums.velocity("frame: velocity with carry", whole);
    sums.0
}

/// Exact sums that wrap for some stream of samples: across a gap, and what.
///
/// To be emptied: the `i32` of counts is too short for the finest pulses after a gap, that of pickoff codes for
/// codes below 2e-11 rad of the block and 40 steps at the limit; 40 of the largest
/// increments with a gap and a carry leave ±0.5 rad; arms of 0.5 m at 8 kHz leave ±128 m/s.
const EXACT_WRAPS: &[(bool, &str)] = &[
    (false, "dither: difference of codes"),
    (false, "turning: vector word"),
    (false, "turning: gathered"),
    (false, "turning: at the end"),
    (false, "chain: swing of the period"),
    (false, "chain: velocity"),
    (false, "frame: velocity with carry"),
    (true, "counts: sum"),
    (true, "dither: difference of codes"),
    (true, "compensation: sensing axes"),
    (true, "compensation: at rest"),
    (true, "chain: rotation vector"),
    (true, "frame: rotation with carry"),
    (true, "turning: angle word"),
    (true, "turning: vector word"),
    (true, "turning: product"),
    (true, "chain: gathered evenly"),
    (true, "turning: gathered"),
    (true, "turning: at the end"),
    (true, "chain: swing of the period"),
    (true, "chain: velocity"),
    (true, "frame: velocity with carry"),
];

#[test]
fn no_exact_sum_wraps() {
    let mut worst: Vec<(bool, Sum, Corner)> = Vec::new();
    for (corner, bounds) in proofs() {
        let parameters = corner.parameters();
        for across_gap in [false, true] {
            for sum in exact_sums(&parameters, bounds, across_gap) {
                let same = |known: &&mut (bool, Sum, Corner)| {
                    (known.0, known.1.name) == (across_gap, sum.name)
                };
                match worst.iter_mut().find(same) {
                    Some(known) if sum.headroom() < known.1.headroom() => {
                        *known = (across_gap, sum, *corner);
                    }
                    Some(_) => {}
                    None => worst.push((across_gap, sum, *corner)),
                }
            }
        }
    }
    worst.sort_by_key(|(across_gap, ..)| *across_gap);
    println!("| gap | sum | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|---|");
    for (across_gap, sum, corner) in &worst {
        let (exponent, unit) = sum.unit;
        println!(
            "| {} | {} | i{} | {:.5e} {unit} | {:.3} | {corner} |",
            if *across_gap { "gap" } else { "-" },
            sum.name,
            sum.bits,
            sum.magnitude as f64 * 2f64.powi(exponent),
            sum.headroom(),
        );
    }
    let wraps: Vec<(bool, &str)> = worst
        .iter()
        .filter(|(_, sum, _)| !sum.fits())
        .map(|(across_gap, sum, _)| (*across_gap, sum.name))
        .collect();
    assert_eq!(wraps, EXACT_WRAPS);
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

/// Largest magnitude of a case increment \[rad\], and largest |h₀| + |h₁| over the gain \[1\], in closed form.
fn largest_increment(parameters: &Parameters) -> ([f64; 3], [f64; 3]) {
    let rate = parameters.sample_rate_hz;
    let strips = [0, 1, 2].map(|axis| {
        let omega = TAU * parameters.dither_frequency_hz[axis] / rate;
        let lag = omega * parameters.pickoff_delay_s[axis] * rate;
        let (cot, cosec) = if omega.sin().abs() < 1e-3 {
            (0.0, 0.0)
        } else {
            (1.0 / omega.tan(), 1.0 / omega.sin())
        };
        let adapts = parameters.adaptation_time_s > 0.0
            && parameters.dither_amplitude_rad[axis] > 0.0
            && parameters.pickoff_gain[axis] > 0.0;
        let range = if adapts {
            f64::from(ADAPTATION_RANGE)
        } else {
            0.0
        };
        let now = (lag.cos() + lag.sin() * cot).abs() + range * (1.0 + cot.abs());
        let past = (lag.sin().abs() + range) * cosec.abs();
        now + past
    });
    let stripped = [0, 1, 2].map(|axis| {
        SENSED_LIMIT_RAD * (1.0 - parameters.scale_error[axis]) + DITHER_LIMIT_RAD * strips[axis]
    });
    let [x, y, z] = stripped;
    let e = parameters.installation_rad.map(f64::abs);
    // K/T² times the largest acceleration.
    let tilt = |k: f64| (k * rate * rate).abs() * ACCELERATION_LIMIT_RAD;
    let t = parameters.flexure_s2.map(tilt);
    let increments = [
        x + (e.xy + t.xy) * z + (e.xz + t.xz) * y,
        y + (e.yz + t.yz) * x + (e.yx + t.yx) * z,
        z + (e.zx + t.zx) * y + (e.zy + t.zy) * x,
    ];
    (increments, strips)
}

/// The closed form that may stand in a check of parameters is the bound of the words, to their rounding.
#[test]
fn the_largest_increment_has_a_closed_form() {
    let mut largest = (0.0, String::new());
    for (corner, bounds) in proofs() {
        let parameters = corner.parameters();
        let of_words = case_increment(bounds);
        let (increments, strips) = largest_increment(&parameters);
        let closed = increments.into_iter().fold(0.0, f64::max);
        // Ten LSBs from above. From below, limits are whole counts and codes: close where those are fine.
        assert!(of_words < closed + 10.0 * INCREMENT_LSB_RAD, "{corner}");
        let fine = corner.weights != WEIGHTS[2];
        assert!(
            !fine || of_words > 0.999 * closed,
            "{corner}: {of_words} {closed}"
        );
        if closed > largest.0 {
            largest = (closed, format!("{corner}, taps {}", strips[0]));
        }
    }
    println!("{} rad: {}", largest.0, largest.1);
}

const INCREMENT_LSB_RAD: f64 = 1.0 / (1u64 << 37) as f64;

fn case_increment(bounds: &[Bound]) -> f64 {
    let is_turn = |b: &&Bound| b.operation == Operation::Turn;
    bounds.iter().find(is_turn).expect("a turn").value()
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
        (-39.8..-13.4f64).prop_map(f64::exp2),
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
            Parameters {
                pulse_weight_rad,
                bias_rad_s: [0.01; 3],
                scale_error,
                installation_rad,
                flexure_s2: flexure.map(|k| k / (rate * rate)),
                pickoff_gain: gain,
                pickoff_weight_rad: code,
                sample_rate_hz: rate,
                samples_per_output,
                acceleration_order,
                pickoff_delay_s,
                dither_frequency_hz: cycles.map(|cycles| cycles * rate),
                dither_amplitude_rad,
                adaptation_time_s,
                accelerometers: Some(AccelerometerParameters {
                    weight_m_s,
                    bias_m_s2,
                    scale_error: scale,
                    misalignment_rad,
                    lever_arm_m,
                }),
            }
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
            let known = WRAPS.contains(&(bound.operation, stage(bound)));
            prop_assert!(known || bound.fits(), "{bound:?}");
        }
        let closed = largest_increment(&parameters).0.into_iter().fold(0.0, f64::max);
        prop_assert!(case_increment(&bounds) < closed + 10.0 * INCREMENT_LSB_RAD);
    }
}
