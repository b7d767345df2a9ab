//! Bounds the exact sums: the integers between the fixed-point words and the output frame.
//!
//! They are not behind the number system, so their bounds are derived here, in `i128`, from the limits of readings and
//! parameters and from the bounds of the words that enter them.

use trueaxis::design_parameters::{
    ACCELEROMETER_SUM_CODES, BIAS_PERIODS, DITHER_LIMIT_RAD, FINE_PER_CODE_LOG2, FLEXURE_LIMIT,
    GAP_IN_FRAME_RAD, LEVER_ARM_LIMIT_M, PICKOFF_REACH_RAD, SENSED_LIMIT_RAD,
    VELOCITY_GAP_IN_FRAME_M_S, VELOCITY_LIMIT_M_S, increment_unit_log2,
};
use trueaxis::numbers::Interval;
use trueaxis::numbers::exact::VELOCITY_UNIT_M_S;
use trueaxis::numbers::interval::{Bound, Operation, take_bounds};
use trueaxis::{Chain, Parameters};

use crate::bounds::stage;
use crate::corners::farthest_arms_m;

/// A magnitude that an exact sum reaches, and its word.
#[derive(Debug, Clone, Copy)]
pub struct Sum {
    pub name: &'static str,
    pub magnitude: i128,
    pub bits: u32,
    /// LSB as an exponent of two, and its unit.
    pub unit: (i32, &'static str),
}

impl Sum {
    /// Range of the word over the magnitude \[1\]: below 1, the sum wraps.
    pub fn headroom(&self) -> f64 {
        2f64.powi(self.bits as i32 - 1) / self.magnitude as f64
    }

    /// Magnitudes alone, so that the word's lowest value counts as beyond.
    pub fn fits(&self) -> bool {
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

/// Readings of an output period in addition to its ordinary samples.
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
pub fn exact_sums(parameters: &Parameters, bounds: &[Bound]) -> Vec<Sum> {
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
    // More than BIAS_PERIODS at once are settled outside the sums; an output period may have begun before.
    let periods = n + gaps * (i128::from(BIAS_PERIODS) - 1);
    let leaving = |operation: Operation, file: &str| {
        let same = |b: &&Bound| b.operation == operation && stage(b) == file;
        bounds.iter().find(same).map_or(0, Bound::magnitude)
    };
    let word = 1i128 << 32;

    // counts.rs: a gap's reading leaves room for a whole period's ordinary samples.
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
        // An axis without dither does not move.
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
    let rectified = leaving(Operation::Rectified, "flexure") << unit_log2;
    let ahead = leaving(Operation::Ahead, "flexure") << unit_log2;
    sums.angle("flexure: rate", ahead);
    let words = (ahead >> 32) + 1;
    sums.angle("flexure: rate x rate", words * words);
    // ½ (K_ij − K_ik)/T², at the period's end less its start.
    let of_pair = up(FLEXURE_LIMIT, 25);
    sums.keep("flexure: factor", of_pair, 32, (-25, ""));
    let bracket = ((of_pair * words * words) >> 25) + 70;
    let bent = sums.angle("flexure: correction", rectified + 2 * bracket);
    let on_axes = of_samples + sensing(gap, matrix) + bent;
    let sensed = on_axes + stripped + bias;
    sums.angle("counts: weight x sum", sensed);
    sums.angle("compensation: sensing axes", on_axes + moved + bias);
    let before = sums.angle("gap: angle before", through(of_samples, matrix) + gap);
    let at_rest = through(of_samples + moved + bias + bent, matrix) + gap;
    let at_rest = sums.angle("compensation: at rest", at_rest);

    // coning.rs
    let crossed = leaving(Operation::FineCross, "coning") << (2 * unit_log2);
    let beside = sums.angle("coning: beside the sum", crossed);
    let rotation = sums.angle("chain: rotation", at_rest + beside);

    // gap.rs: before × reading, less half of the gaps' products with each other; the period's at its end.
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
    let deferred = through(of_gap + all_counts * strip + bias_one * lost, matrix);
    let code = |fine: i128| fine >> FINE_PER_CODE_LOG2;
    sums.keep(
        "frame: codes deferred at once",
        code(deferred) + 1,
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
    let deferred = through(of_gap + bias_one * lost, misaligned);
    sums.keep(
        "frame: velocity deferred at once",
        code(deferred) + 1,
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
    // The four differences together: two coordinates across the axis of each accelerometer, and twice the one along it.
    let differences_m = 3.0 * arms_m + 2.0 * LEVER_ARM_LIMIT_M;
    let gathered = times(lever(2.0 * differences_m) + 3, square);
    let gathered = sums.velocity("size effect: gathered", gathered);

    // turning.rs: the part that gathered evenly, and the swing at the end; then the difference of both.
    let evenly = sums.velocity("chain: gathered evenly", felt + rectified + gathered);
    let third = sums.crossed(rotation, evenly) >> 2;
    let second = sums.crossed(rotation, evenly + third) / 3 + word;
    let turned = sums.crossed(rotation, evenly + second) >> 1;
    let gathered = sums.velocity("turning: gathered", evenly + turned);
    let third = sums.crossed(rotation, swing) / 3 + word;
    let second = sums.crossed(rotation, swing + third) >> 1;
    let swung = swing + sums.crossed(rotation, swing + second);
    let swung = sums.velocity("turning: at the end", swung);
    let swing_change = sums.velocity("chain: swing of the period", swung + swing);
    let velocity = sums.velocity("chain: velocity", gathered + swing_change);
    sums.velocity("frame: velocity with carry", velocity + carry);
    sums.0
}
