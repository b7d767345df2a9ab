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
use std::path::Path;

use proptest::prelude::*;
use trueaxis::numbers::Interval;
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
    /// Angle of a pulse \[rad\] and velocity of an accelerometer code \[m/s\].
    weights: (f64, f64),
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
            pickoff_weight_rad: 1e-10,
            sample_rate_hz: self.sample_rate_hz,
            samples_per_output: self.samples_per_output,
            acceleration_order: self.acceleration_order,
            pickoff_delay_s: [self.delay_s; 3],
            dither_frequency_hz: [self.cycles * self.sample_rate_hz; 3],
            dither_amplitude_rad: [if self.adapts { 0.01 } else { 0.0 }; 3],
            adaptation_time_s: if self.adapts { 0.1 } else { 0.0 },
            accelerometers: Some(AccelerometerParameters {
                weight_m_s: [self.weights.1; 3],
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

/// Finest, ordinary and coarsest pulses and accelerometer codes \[rad, m/s\].
const WEIGHTS: [(f64, f64); 3] = [
    (1.0 / (1u64 << 34) as f64, 1e-9),
    (1e-6, 1e-6),
    (1e-4, 1e-2),
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
    let mut proved = 0;
    for corner in corners() {
        let Some(corner) = corner.accepted() else {
            continue;
        };
        proved += 1;
        for bound in prove(&corner.parameters(), still) {
            let entry = worst
                .entry((bound.operation, stage(&bound)))
                .or_insert((bound, corner));
            if bound.headroom() < entry.0.headroom() {
                *entry = (bound, corner);
            }
        }
    }
    println!("{proved} configurations");
    println!("| operation | stage | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|---|");
    for ((operation, stage), (bound, corner)) in &worst {
        println!(
            "| {operation:?} | {stage} | i{} | {:.6e} | {:.3} | n {}, {} Hz, order {}, {:.3} cycles, {:.0} us, {} |",
            bound.bits,
            bound.value(),
            bound.headroom(),
            corner.samples_per_output,
            corner.sample_rate_hz,
            corner.acceleration_order,
            corner.cycles,
            corner.delay_s * 1e6,
            if corner.adapts { "adapts" } else { "frozen" },
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
