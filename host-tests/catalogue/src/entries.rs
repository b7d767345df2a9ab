//! The catalogue: one row per effect.

use crate::column::Column;
use crate::entry::{Entry, Law, Size};

/// Every kind observable in increments on the gyros' rows, in the order of the contract's table.
pub static CATALOGUE: &[Entry] = &[
    Entry {
        kind: "gyro_bias",
        equation: "omega_i += b_i",
        unit: "rad/s",
        size: Size::of(5e-7, 0.05),
        law: Law::Axes(|_| vec![(Column::Constant, 1.0)]),
        everyday: true,
        meaning: "The model lacks a constant rate on the gyro: a bias, present at rest and in motion alike.",
        experiment: "A still record of some minutes at two opposite attitudes separates bias from Earth rate and g-sensitivity.",
    },
    Entry {
        kind: "gyro_bias_temperature",
        equation: "omega_i += c_i (T_i - T_i(start))",
        unit: "rad/s/K",
        size: Size::of(1e-6, 0.001),
        law: Law::Axes(|i| vec![(Column::Warming(i), 1.0)]),
        everyday: true,
        meaning: "The gyro bias depends on the temperature of its block; the model keeps it constant.",
        experiment: "Cycle the temperature up and down: a bias that retraces its path is temperature, one that does not is time or gradient.",
    },
    Entry {
        kind: "gyro_bias_temperature_rate",
        equation: "omega_i += c_i dT_i/dt",
        unit: "rad/K",
        size: Size::of(1e-5, 0.1),
        law: Law::Axes(|i| vec![(Column::WarmingRate(i), 1.0)]),
        everyday: false,
        meaning: "The gyro bias follows the rate of temperature change (a gradient across the block) and the model has no such term.",
        experiment: "Hold, ramp and hold the temperature: the bias then steps with the ramp rate and returns.",
    },
    Entry {
        kind: "gyro_bias_magnetic",
        equation: "omega_i += sum_j c_ij B_j",
        unit: "rad/s/T",
        size: Size::of(1e-3, 10.0),
        law: Law::Nine(Column::Magnetic),
        everyday: false,
        meaning: "The gyro output depends on the magnetic field at the block; the model has no such term.",
        experiment: "Turn a known field (a coil) on and off on each axis with the case at rest.",
    },
    Entry {
        kind: "gyro_g_bias",
        equation: "omega_i += sum_j G_ij f_j",
        unit: "rad/s per m/s^2",
        size: Size::of(1e-7, 0.001),
        law: Law::Nine(Column::Force),
        everyday: false,
        meaning: "The gyro output depends on the specific force (g-sensitivity); the model has no such term.",
        experiment: "Tumble the case through six attitudes: gravity then changes sign on each axis and a bias does not.",
    },
    Entry {
        kind: "gyro_g2_bias",
        equation: "omega_i += g_i f_i^2",
        unit: "rad/s per (m/s^2)^2",
        size: Size::of(1e-8, 0.0001),
        law: Law::Axes(|i| vec![(Column::ForceSquare(i), 1.0)]),
        everyday: false,
        meaning: "The gyro responds to the square of the force along its axis, so vibration rectifies into a drift.",
        experiment: "Vibrate linearly along each axis at two levels: the drift of this effect grows as the square of the level.",
    },
    Entry {
        kind: "gyro_scale",
        equation: "omega_i += s_i (omega_i + dither rate_i)",
        unit: "1",
        size: Size::of(1e-5, 0.1),
        law: Law::Axes(|i| vec![(Column::Increment(i), 1.0), (Column::Dither(i), 1.0)]),
        everyday: true,
        meaning: "The gyro's scale differs from the model's: the laser senses case motion and dither alike with a scale error.",
        experiment: "A slew of whole turns about each axis shows the scale against the turntable.",
    },
    Entry {
        kind: "gyro_scale_asymmetry",
        equation: "omega_i += a_i |omega_i|",
        unit: "1",
        size: Size::of(1e-5, 0.05),
        law: Law::Axes(|i| vec![(Column::Magnitude(i), 1.0)]),
        everyday: false,
        meaning: "The gyro has a different scale for positive and negative rotation, so an oscillation leaves a drift.",
        experiment: "Equal slews forward and back: the difference of the two angles is this effect.",
    },
    Entry {
        kind: "gyro_scale_quadratic",
        equation: "omega_i += q_i omega_i^2",
        unit: "s/rad",
        size: Size::of(1e-5, 0.1),
        law: Law::Axes(|i| vec![(Column::Square(i), 1.0)]),
        everyday: false,
        meaning: "The gyro has a small term in the square of its rate, so an oscillation leaves a drift that grows as its square.",
        experiment: "Slews at several rates, both senses: this effect is even in the rate and grows as its square.",
    },
    Entry {
        kind: "gyro_scale_cubic",
        equation: "omega_i += q_i omega_i^3",
        unit: "s^2/rad^2",
        size: Size::of(1e-5, 0.1),
        law: Law::Axes(|i| vec![(Column::Cube(i), 1.0)]),
        everyday: false,
        meaning: "The scale of the gyro changes with the square of its rate.",
        experiment: "Slews at several rates: the scale error of this effect grows as the square of the rate.",
    },
    Entry {
        kind: "installation",
        equation: "delta_ij constant",
        unit: "rad",
        size: Size::of(3e-5, 0.3),
        law: Law::Tilts(|_, _, senses| Column::Increment(senses), 1.0),
        everyday: true,
        meaning: "The sensing axes differ from the installation matrix of the model, so each gyro senses a share of the rates across it.",
        experiment: "A slew about each axis shows the angles; none of them leaves a drift under vibration.",
    },
    Entry {
        kind: "installation_temperature",
        equation: "delta_ij = c_ij (T_i - T_i(start))",
        unit: "rad/K",
        size: Size::of(1e-5, 0.01),
        law: Law::Tilts(
            |gyro, _, senses| Column::WarmingTimesIncrement(gyro, senses),
            1.0,
        ),
        everyday: false,
        meaning: "The sensing axes rotate with the temperature of the block; the model keeps the installation constant.",
        experiment: "Repeat the same slew at two temperatures.",
    },
    Entry {
        kind: "axis_flexure",
        equation: "delta_ij = -K_ij alpha_j",
        unit: "s^2",
        size: Size::of(1e-7, 1e-5),
        law: Law::Tilts(|_, about, senses| Column::Flexure(about, senses), -1.0),
        everyday: false,
        meaning: "The dither suspension is not stiff: under angular acceleration each laser block lags its case, its sensing axis tilts by K times the acceleration, and the tilt times the cross rate rectifies into drift under coning motion.",
        experiment: "Spin at a steady rate about one axis while oscillating at the same frequency about a second (spin-synchronous oscillation), both spin senses and two phases for every pair of axes: this separates the single coefficients of a pair, which coning and vibration never do.",
    },
    Entry {
        kind: "axis_flexure_cubic",
        equation: "delta_ij = -Q_ij alpha_j^3",
        unit: "s^6/rad^2",
        size: Size::of(1e-12, 1e-8),
        law: Law::Tilts(|_, about, senses| Column::CubicFlexure(about, senses), -1.0),
        everyday: false,
        meaning: "The dither suspension bends more than in proportion: the tilt has a term in the cube of the angular acceleration.",
        experiment: "The same coning at two amplitudes: the drift of this effect grows as the fourth power, that of linear flexure as the square.",
    },
    Entry {
        kind: "axis_tilt_by_force",
        equation: "delta_ij = tau_ij f_k",
        unit: "rad per m/s^2",
        size: Size::of(1e-7, 0.001),
        law: Law::Tilts(|_, _, senses| Column::ForceTimesIncrement(senses), 1.0),
        everyday: false,
        meaning: "The block bends under specific force, so its sensing axis tilts with gravity and vibration.",
        experiment: "Slew about one axis with gravity along each of the others in turn.",
    },
    Entry {
        kind: "elastic_rate_by_force",
        equation: "omega_i += sum_j U_ij df_j/dt",
        unit: "rad per m/s^2",
        size: Size::of(1e-7, 0.001),
        law: Law::Nine(Column::ForceRate),
        everyday: false,
        meaning: "The block rotates elastically with the force on it; the gyro reports that rotation as a rate of the case.",
        experiment: "Linear vibration along each axis without rotation.",
    },
    Entry {
        kind: "elastic_rate_by_jerk",
        equation: "omega_i += sum_j W_ij d2omega_j/dt2",
        unit: "s^2",
        size: Size::of(1e-7, 0.001),
        law: Law::Nine(Column::Jerk),
        everyday: false,
        meaning: "The block rotates elastically about its sensing axis under angular acceleration, so the gyro reports a rate the case does not have.",
        experiment: "Reverse the spin of a spin-synchronous oscillation: flexure changes sign, this effect does not.",
    },
    Entry {
        kind: "gyro_bandwidth",
        equation: "omega_i += (v_i/2) d2omega_i/dt2",
        unit: "s^2",
        size: Size::positive(1e-7, 0.002),
        law: Law::Axes(|i| vec![(Column::Jerk(i), 0.5)]),
        everyday: false,
        meaning: "A filter in the gyro's path smooths its rate; the model has none.",
        experiment: "Oscillate at two frequencies: the loss of a filter grows as the square of the frequency.",
    },
    Entry {
        kind: "gyro_delay",
        equation: "omega_i(t - d_i) instead of omega_i(t)",
        unit: "s",
        size: Size::of(2e-5, 0.1),
        law: Law::Axes(|i| vec![(Column::Delay(i), -1.0)]),
        everyday: true,
        meaning: "The gyro channel is late (or early) against the reference by a fixed time that the model does not contain.",
        experiment: "Any vigorous oscillation; two frequencies separate a delay from a phase.",
    },
    Entry {
        kind: "dither_gain",
        equation: "block rate_i = (1 + g_i) pickoff rate_i",
        unit: "1",
        size: Size::of(1e-4, 0.2),
        law: Law::Axes(|i| vec![(Column::Dither(i), 1.0)]),
        everyday: true,
        meaning: "The dither pickoff reads the block motion with a wrong gain, so stripping leaves a residue of the dither in the increments.",
        experiment: "None needed: the dither itself shows it at rest.",
    },
    Entry {
        kind: LATE_PICKOFF,
        equation: "block_i(t) = pickoff_i(t + d_i)",
        unit: "s",
        size: Size::of(1e-6, 0.001),
        law: Law::Axes(|i| vec![(Column::DitherDelay(i, 0.0), 1.0)]),
        everyday: false,
        meaning: "The dither pickoff is sampled late against the pulse counter, so stripping leaves a residue in quadrature with the dither.",
        experiment: "None needed: the dither itself shows it at rest.",
    },
    Entry {
        kind: "dither_cubic",
        equation: "block angle_i += c_i pickoff_i^3",
        unit: "1/rad^2",
        size: Size::of(1e2, 1e6),
        law: Law::Axes(|i| vec![(Column::DitherCube(i), 1.0)]),
        everyday: false,
        meaning: "The dither pickoff is not linear: a cubic term leaves lines at one and three times the dither frequency after stripping.",
        experiment: "None needed: the dither itself shows it at rest.",
    },
    Entry {
        kind: "dither_crosstalk",
        equation: "omega_i += c_ij dither rate_j",
        unit: "1",
        size: Size::of(1e-4, 0.1),
        law: Law::Across(Column::Dither),
        everyday: false,
        meaning: "The gyro senses a share of the dither of a neighbouring block, through the structure or the electronics.",
        experiment: "Switch the dithers off one at a time.",
    },
    Entry {
        kind: "reference_misalignment",
        equation: "reference reads R(r)^T omega, omega - r x omega for small r",
        unit: "rad",
        size: Size::of(1e-4, 0.3),
        law: Law::Body(|parameter, axis| {
            // (r × ω)_axis = Σ ε_{axis, parameter, k} ω_k.
            if parameter == axis {
                return Vec::new();
            }
            let k = 3 - parameter - axis;
            let sign = if (axis + 1) % 3 == parameter {
                1.0
            } else {
                -1.0
            };
            vec![(Column::Increment(k), sign)]
        }),
        everyday: false,
        meaning: "The reference is misaligned to the case: all three gyros show the same small rotation against it.",
        experiment: "Remount the reference: a turned reference changes, the installation of the gyros does not.",
    },
    Entry {
        kind: "reference_delay",
        equation: "reference(t) = case(t - d)",
        unit: "s",
        size: Size::of(2e-5, 0.1),
        law: Law::Common(|i| vec![(Column::Delay(i), 1.0)]),
        everyday: true,
        meaning: "The clock of the reference and the clock of the gyros differ by a fixed time.",
        experiment: "A second reference, or an event marked on both clocks, separates a late reference from late gyros.",
    },
    Entry {
        kind: "reference_scale",
        equation: "reference_i = (1 + r_i) case_i",
        unit: "1",
        size: Size::of(1e-5, 0.1),
        law: Law::Body(|parameter, axis| {
            if parameter == axis {
                vec![(Column::Increment(axis), -1.0)]
            } else {
                Vec::new()
            }
        }),
        everyday: true,
        meaning: "The reference itself has a scale error; the gyro and its dither agree with each other and not with it.",
        experiment: "Whole turns of the table against an optical mark calibrate the reference.",
    },
    Entry {
        kind: "reference_bandwidth",
        equation: "reference_i = omega_i + (v_i/2) d2omega_i/dt2",
        unit: "s^2",
        size: Size::positive(1e-7, 0.002),
        law: Law::Body(|parameter, axis| {
            if parameter == axis {
                vec![(Column::Jerk(axis), -0.5)]
            } else {
                Vec::new()
            }
        }),
        everyday: false,
        meaning: "A filter in the reference's path smooths its rate; the model has none.",
        experiment: "Oscillate at two frequencies against a reference of known bandwidth.",
    },
    Entry {
        kind: PULL,
        equation: "reference rate += k (f/|f| x up)",
        unit: "1/s",
        size: Size::positive(1e-2, 10.0),
        law: Law::Common(|i| vec![(Column::OffVertical(i), -1.0)]),
        everyday: true,
        meaning: "The reference is an attitude filter that is pulled towards the specific force of the accelerometers, which is vertical only while the unit does not accelerate. An attitude computed from these gyros cannot reveal their errors.",
        experiment: "Swing the unit about a level axis through its accelerometers and beside them: only a force that swings with it pulls the filter.",
    },
    Entry {
        kind: "earth_rate",
        equation: "omega += C(t)^T omega_earth(start)",
        unit: "rad/s",
        size: Size::of(5e-5, 7.3e-5),
        law: Law::Body(|parameter, axis| vec![(Column::SpaceVector(parameter, axis), 1.0)]),
        everyday: false,
        meaning: "The reference reports motion against the Earth and the gyros against space: the rotation of the Earth is missing from the prediction.",
        experiment: "A still record at two attitudes separates the rotation of the Earth from bias.",
    },
];

/// Returns a kind's parameter from the coefficient of its columns, and the derivative with respect to the coefficient.
///
/// Columns are computed from the reference's output: a reference of output (1 + r) times the case's rate leaves −r/(1 +
/// r) times that output. For every other kind the parameter is the coefficient.
pub fn value_of(kind: &str, coefficient: f64) -> (f64, f64) {
    if kind == "reference_scale" {
        let left = 1.0 - coefficient;
        (coefficient / left, 1.0 / (left * left))
    } else {
        (coefficient, 1.0)
    }
}

/// Returns the coefficient of a kind's columns from its parameter: the inverse of [`value_of`].
pub fn coefficient_of(kind: &str, value: f64) -> f64 {
    if kind == "reference_scale" {
        value / (1.0 + value)
    } else {
        value
    }
}

/// The entry of a kind.
pub fn find(kind: &str) -> Option<&'static Entry> {
    CATALOGUE.iter().find(|entry| entry.kind == kind)
}

/// Description of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// The contract's kind.
    pub kind: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// Unit of its parameters, except those with a unit in their name.
    pub unit: &'static str,
    /// Meaning, for a navigation engineer.
    pub meaning: &'static str,
    /// Motion that makes it most observable.
    pub experiment: &'static str,
}

/// Change point of one gyro's bias, located by a scan over rows.
pub const STEP: &str = "gyro_bias_step";

/// Jump of one gyro's angle, located by a scan over rows.
pub const SLIP: &str = "counter_slip";

/// Error of the reference that is periodic in the table's angle.
pub const HARMONIC: &str = "reference_harmonic";

/// Flexure of a resonant suspension.
pub const MODE: &str = "axis_flexure_mode";

/// Soft mount between reference and case.
pub const MOUNT: &str = "isolator_mode";

/// Filter on a gyro's path.
pub const BANDWIDTH: &str = "gyro_bandwidth";

/// Delayed sampling of a pickoff.
pub const LATE_PICKOFF: &str = "dither_delay";

/// Attitude filter as reference, pulled towards the measured specific force.
pub const PULL: &str = "reference_pull";

/// Dead band about rest, of gyros without dither.
pub const LOCK_IN: &str = "lock_in";

/// First-order high pass behind a gyro: automatic zeroing.
pub const HIGH_PASS: &str = "gyro_high_pass";

/// Effect outside the catalogue, as an expression in measured channels.
pub const UNLISTED: &str = "unlisted";

/// Kinds located by a scan over rows, orders, frequencies or expressions.
pub static SCANNED: [Card; 8] = [
    Card {
        kind: STEP,
        equation: "omega_i += size from time_s on",
        unit: "rad/s",
        meaning: "The bias of the gyro jumps once and stays there.",
        experiment: "A second recording shows whether the bias jumps again, and when.",
    },
    Card {
        kind: SLIP,
        equation: "angle_i += size at time_s",
        unit: "rad",
        meaning: "The angle of the gyro jumps once, as when its counter loses or gains pulses.",
        experiment: "A second recording shows whether the counter slips again, and when.",
    },
    Card {
        kind: HARMONIC,
        equation: "reference angle += cos cos(order theta) + sin sin(order theta)",
        unit: "rad",
        meaning: "The error is the reference's: the encoder of the turntable has an error periodic in the table's angle, as by eccentricity, pole pairs or the lines of a scale.",
        experiment: "Turn the table through whole turns at two speeds: an error periodic in its angle is the encoder's.",
    },
    Card {
        kind: MODE,
        equation: "delta_ij'' + 2 z w0 delta_ij' + w0^2 delta_ij = -w0^2 K_ij alpha_j",
        unit: "s^2",
        meaning: "The dither suspension is not stiff and resonates within reach of the motion: each laser block lags its case through a mode, its sensing axis tilts most near the resonance, and tilt times cross rate rectifies into drift.",
        experiment: "A sweep of coning, or vibration about two axes at once, across the suspension's resonance and well below it.",
    },
    Card {
        kind: MOUNT,
        equation: "case = (w0^2 + 2 z w0 s)/(s^2 + 2 z w0 s + w0^2) reference, by axis",
        unit: "1",
        meaning: "The case does not follow the reference: it stands on a soft mount that amplifies vibration near its resonance and attenuates it above.",
        experiment: "A sine sweep through the mount's resonance on each axis: amplitude and phase of gyro over reference draw the mount's response.",
    },
    Card {
        kind: HIGH_PASS,
        equation: "omega_i -= l_i, then l_i += T/tau (omega_i - l_i), l_i = 0 at the start",
        unit: "s",
        meaning: "A constant rate decays in the gyro's output with this time constant: automatic zeroing, or AC coupling.",
        experiment: "Turn at one constant rate for several time constants, then stop: the reading decays, and comes back with the other sign.",
    },
    Card {
        kind: LOCK_IN,
        equation: "beat_i = sign(omega_i) sqrt(omega_i^2 - Omega_i^2), 0 below Omega_i",
        unit: "rad/s",
        meaning: "The two beams lock: slow rates are not sensed, faster ones lose a share, and no dither prevents it.",
        experiment: "Turn slowly through rest about each axis, with the dither on and off: a dead band that a dither removes is lock-in.",
    },
    Card {
        kind: UNLISTED,
        equation: "omega_i += coefficient * expression",
        unit: "rad/s per unit of the expression",
        meaning: "The gyro follows an expression in measured channels, outside the catalogue, found by search.",
        experiment: "Repeat the motion with the expression's channels varied one at a time.",
    },
];

/// Returns the description of a kind.
pub fn card(kind: &str) -> Option<Card> {
    let of_entry = |entry: &Entry| Card {
        kind: entry.kind,
        equation: entry.equation,
        unit: entry.unit,
        meaning: entry.meaning,
        experiment: entry.experiment,
    };
    let scanned = SCANNED.iter().find(|card| card.kind == kind).copied();
    scanned.or_else(|| find(kind).map(of_entry))
}
