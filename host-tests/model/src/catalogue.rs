//! The catalogue: every kind of effect with the names and units of its parameters, as in the contract.
//!
//! Names and meanings are the contract's and stay as they are. "ij" = gyro i, axis j.

/// Type of a parameter's value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Any finite number.
    Number,
    /// A number above 0: a frequency.
    Positive,
    /// A number of at least 0: a noise, a threshold, a damping ratio.
    NotNegative,
    /// "x", "y" or "z".
    Axis,
    /// The name of a channel.
    Channel,
    /// The name of a recording.
    Recording,
    /// One of these words; the first if absent.
    OneOf(&'static [&'static str]),
    /// Number within a closed interval, and its default.
    Between([f64; 2], f64),
    /// Remark for the reader, without effect on the model.
    Remark,
}

/// Parameters of one kind that share a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Names of the parameters in files.
    pub names: &'static [&'static str],
    /// Unit of the parameters; empty for text.
    pub unit: &'static str,
    /// Type of the values.
    pub value: Value,
    /// All parameters are required; otherwise an absent one counts as 0.
    pub required: bool,
}

/// One kind of effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kind {
    /// Its name in files.
    pub name: &'static str,
    /// Its parameters; empty: free parameters (`unlisted`).
    pub groups: &'static [Group],
    /// Optional parameters of its compensation by the firmware; no prediction depends on them.
    pub compensation: &'static [Group],
}

/// The body axes.
pub const XYZ: &[&str] = &["x", "y", "z"];
/// The six pairs ij with i ≠ j.
pub const SIX: &[&str] = &["xy", "xz", "yx", "yz", "zx", "zy"];
/// The nine pairs ij.
pub const NINE: &[&str] = &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

const fn of(names: &'static [&'static str], unit: &'static str) -> Group {
    Group {
        names,
        unit,
        value: Value::Number,
        required: false,
    }
}

const fn bounded(names: &'static [&'static str], unit: &'static str, value: Value) -> Group {
    Group {
        names,
        unit,
        value,
        required: false,
    }
}

const fn needed(names: &'static [&'static str], unit: &'static str, value: Value) -> Group {
    Group {
        names,
        unit,
        value,
        required: true,
    }
}

const AXIS: Group = needed(&["axis"], "", Value::Axis);
const CHANNEL: Group = needed(&["channel"], "", Value::Channel);
const TIME: Group = needed(&["time_s"], "s", Value::Number);
const SPAN: Group = needed(&["start_s", "end_s"], "s", Value::Number);
/// The one of several recordings with an effect, of any kind; absent: all, and for an event any recording running at
/// that time.
const RECORDING: Group = bounded(&["recording"], "", Value::Recording);
/// Combinations of an effect's parameters that no recording can estimate, and the values chosen for them, of any kind.
const CHOICE: Group = bounded(&[CHOICE_KEY], "", Value::Remark);
const FAULT: &[Group] = &[CHANNEL, SPAN, RECORDING];
/// Gyro i senses Σ_j ij times the rotation of the reference about j; `channel = "dither"`: times that of the pickoffs.
const MAP: &[Group] = &[
    needed(NINE, "1", Value::Number),
    bounded(&["channel"], "", Value::Channel),
];
/// Number of faults and of faulty rows in a span, or of rows per sample.
const ROWS: Group = bounded(&["count", "rows", "row_count"], "1", Value::Positive);
/// Span of faults, with their number.
const LISTED: &[Group] = &[CHANNEL, SPAN, RECORDING, ROWS];
/// One event of the reference.
const JUMP: &[Group] = &[
    AXIS,
    TIME,
    needed(&["size"], "rad", Value::Number),
    RECORDING,
];

/// Name of the remark on parameters that no recording can estimate.
pub const CHOICE_KEY: &str = "choice";

/// Words for [`Response`](super::Response): mode implied by K, or spring without inertia.
pub(super) const RESPONSES: &[&str] = &["mode", STATIC];
/// Word for [`Response::Static`](super::Response::Static).
pub(super) const STATIC: &str = "static";

/// Range of the damping ratio of a block on its suspension: metal springs have 0.001 to 0.01, and beyond critical
/// damping there is no mode.
pub const FLEXURE_DAMPING: [f64; 2] = [0.002, 0.99];
/// Default damping ratio of a block on its suspension.
pub const USUAL_FLEXURE_DAMPING: f64 = 0.005;

/// Compensation of the static flexure by the firmware.
const FLEXURE_COMPENSATION: &[Group] = &[
    bounded(&["response"], "", Value::OneOf(RESPONSES)),
    bounded(
        &["damping"],
        "1",
        Value::Between(FLEXURE_DAMPING, USUAL_FLEXURE_DAMPING),
    ),
];

const fn kind(name: &'static str, groups: &'static [Group]) -> Kind {
    Kind {
        name,
        groups,
        compensation: &[],
    }
}

/// Every kind, in the contract's order.
pub const CATALOGUE: &[Kind] = &[
    kind("gyro_bias", &[of(XYZ, "rad/s")]),
    kind(
        "gyro_bias_step",
        &[
            AXIS,
            TIME,
            needed(&["size"], "rad/s", Value::Number),
            RECORDING,
        ],
    ),
    kind("gyro_bias_temperature", &[of(XYZ, "rad/s/K")]),
    kind("gyro_bias_temperature_rate", &[of(XYZ, "rad/K")]),
    kind("gyro_bias_magnetic", &[of(NINE, "rad/s/T")]),
    kind("gyro_g_bias", &[of(NINE, "rad/s per m/s^2")]),
    kind("gyro_g2_bias", &[of(XYZ, "rad/s per (m/s^2)^2")]),
    kind("gyro_scale", &[of(XYZ, "1")]),
    kind("gyro_scale_asymmetry", &[of(XYZ, "1")]),
    kind("gyro_scale_quadratic", &[of(XYZ, "s/rad")]),
    kind("gyro_scale_cubic", &[of(XYZ, "s^2/rad^2")]),
    kind("installation", &[of(SIX, "rad")]),
    kind("installation_temperature", &[of(SIX, "rad/K")]),
    Kind {
        compensation: FLEXURE_COMPENSATION,
        ..kind("axis_flexure", &[of(SIX, "s^2")])
    },
    kind("axis_flexure_cubic", &[of(SIX, "s^6/rad^2")]),
    kind(
        "axis_flexure_mode",
        &[
            of(SIX, "s^2"),
            needed(&["frequency_hz"], "Hz", Value::Positive),
            needed(&["damping"], "1", Value::NotNegative),
        ],
    ),
    kind("axis_tilt_by_force", &[of(SIX, "rad per m/s^2")]),
    kind("elastic_rate_by_force", &[of(NINE, "rad per m/s^2")]),
    kind("elastic_rate_by_jerk", &[of(NINE, "s^2")]),
    kind("gyro_delay", &[of(XYZ, "s")]),
    kind("dither_gain", &[of(XYZ, "1")]),
    kind("dither_delay", &[of(XYZ, "s")]),
    kind("dither_cubic", &[of(XYZ, "1/rad^2")]),
    kind("dither_crosstalk", &[of(SIX, "1")]),
    kind("lock_in", &[bounded(XYZ, "rad/s", Value::NotNegative)]),
    kind(
        "angle_random_walk",
        &[bounded(XYZ, "rad/sqrt(s)", Value::NotNegative)],
    ),
    kind(
        "pulse_quantisation",
        &[bounded(XYZ, "unit of the channel", Value::NotNegative)],
    ),
    kind(
        "counter_slip",
        &[
            AXIS,
            TIME,
            needed(&["size"], "rad", Value::Number),
            RECORDING,
        ],
    ),
    kind("lost_samples", LISTED),
    kind("stuck_channel", FAULT),
    kind("saturation", LISTED),
    kind("held_values", LISTED),
    kind("repeated_rows", LISTED),
    kind("spikes", LISTED),
    kind("channel_order", MAP),
    kind("channel_sign", MAP),
    kind("channel_factor", MAP),
    kind("reference_misalignment", &[of(XYZ, "rad")]),
    kind("reference_delay", &[needed(&["all"], "s", Value::Number)]),
    kind("reference_scale", &[of(XYZ, "1")]),
    // Pull of an attitude filter towards the measured specific force.
    kind(
        "reference_pull",
        &[needed(&["all"], "1/s", Value::NotNegative)],
    ),
    kind(
        "reference_harmonic",
        &[
            AXIS,
            needed(&["order"], "1", Value::Positive),
            of(&["cos", "sin"], "rad"),
        ],
    ),
    kind("reference_bandwidth", &[of(XYZ, "s^2")]),
    // Smoothing, by its second-order term, or a first-order low pass with this time constant.
    kind(
        "gyro_bandwidth",
        &[
            of(XYZ, "s^2"),
            bounded(
                &["x_pole_s", "y_pole_s", "z_pole_s"],
                "s",
                Value::NotNegative,
            ),
        ],
    ),
    // Error at the reference's first sample, navigation frame.
    kind(
        "reference_settling",
        &[
            of(XYZ, "rad"),
            needed(&["time_constant_s"], "s", Value::Positive),
        ],
    ),
    kind("gyro_high_pass", &[bounded(XYZ, "s", Value::NotNegative)]),
    kind(
        "reference_clock_rate",
        &[needed(&["all"], "1", Value::Number)],
    ),
    kind("reference_jump", JUMP),
    kind("reference_spike", JUMP),
    kind(
        "reference_dropout",
        &[bounded(&["axis"], "", Value::Axis), SPAN, RECORDING],
    ),
    kind(
        "isolator_mode",
        &[
            bounded(
                &["x_frequency_hz", "y_frequency_hz", "z_frequency_hz"],
                "Hz",
                Value::Positive,
            ),
            bounded(
                &["x_damping", "y_damping", "z_damping"],
                "1",
                Value::NotNegative,
            ),
        ],
    ),
    kind("earth_rate", &[of(XYZ, "rad/s")]),
    kind("accel_bias", &[of(XYZ, "m/s^2")]),
    kind("accel_scale", &[of(XYZ, "1")]),
    kind("accel_misalignment", &[of(SIX, "rad")]),
    kind("accel_quadratic", &[of(XYZ, "s^2/m")]),
    kind("accel_delay", &[of(XYZ, "s")]),
    kind("size_effect", &[of(NINE, "m")]),
    kind("unlisted", &[]),
];

impl Kind {
    /// Returns the kind of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|kind| kind.name == name)
    }

    /// Returns the listed name most similar to `name` (Damerau–Levenshtein distance).
    pub fn nearest(name: &str) -> &'static str {
        CATALOGUE
            .iter()
            .min_by_key(|kind| strsim::damerau_levenshtein(kind.name, name))
            .map_or("", |kind| kind.name)
    }

    /// True if any parameter is allowed.
    pub fn is_free(&self) -> bool {
        self.groups.is_empty()
    }

    /// Names of its parameters in the contract's order.
    pub fn parameter_names(&self) -> impl Iterator<Item = &'static str> {
        self.groups
            .iter()
            .flat_map(|group| group.names.iter().copied())
    }

    /// Returns the group of a parameter.
    pub fn group_of(&self, parameter: &str) -> Option<&'static Group> {
        self.groups
            .iter()
            .chain(self.compensation)
            .chain([&RECORDING, &CHOICE])
            .find(|group| group.names.contains(&parameter))
    }

    /// Returns the unit of a parameter.
    pub fn unit_of(&self, parameter: &str) -> Option<&'static str> {
        self.group_of(parameter).map(|group| group.unit)
    }
}
