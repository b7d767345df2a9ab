//! The words of column names: each with the publisher whose files write it so.
//!
//! A name is split into words; words without information are dropped, an axis is taken off, and what is left stands here.
//! Files whose columns need more than a word (units that their publisher documents, a column for each target) are in
//! `known_forms`.

use super::targets::Target;
use crate::recording::Quantity;

/// Meaning of a name without axis and unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    GyroRate,
    GyroIncrement,
    GyroCount,
    Force,
    VelocityIncrement,
    Field,
    Temperature,
    Attitude,
    Dither,
    Encoder,
    Euler,
    Matrix,
}

/// Names, joined in lower case, their meaning, and who writes them.
const NAMES: &[(&[&str], Meaning, &str)] = &[
    (
        &[
            "gyro",
            "gyr",
            "gyros",
            "gyroscope",
            "gyrorate",
            "gyroscopes",
        ],
        Meaning::GyroRate,
        "ArduPilot IMU, BROAD, Xsens MT Manager, x-io, phyphox, Android TYPE_GYROSCOPE",
    ),
    (
        &["gyroadc", "gyrounfilt"],
        Meaning::GyroRate,
        "Betaflight blackbox_decode",
    ),
    (&["gyrorad"], Meaning::GyroRate, "PX4 sensor_combined"),
    (
        &["g", "w", "omega", "wb", "angvel", "angrate", "omg"],
        Meaning::GyroRate,
        "Physics Toolbox, WitMotion, EuRoC (w_RS_S), NaveGo (imu.wb), textbooks",
    ),
    (
        &[
            "angularvelocity",
            "angularrate",
            "angularvel",
            "angvelocity",
            "gyroout",
            "drehrate",
            "kreisel",
            "gyroskop",
        ],
        Meaning::GyroRate,
        "ROS sensor_msgs/Imu, WitMotion, Analog Devices (X_GYRO_OUT), loggers in German",
    ),
    (
        &[
            "rate",
            "rates",
            "rotationrate",
            "rotrate",
            "turnrate",
            "gyrorotation",
            "rotation",
        ],
        Meaning::GyroRate,
        "SensorLog (iOS CoreMotion rotationRate, gyroRotation)",
    ),
    (
        &[
            "dtheta",
            "deltatheta",
            "deltaangle",
            "dangle",
            "dang",
            "gyroincrement",
            "angleincrement",
            "wm",
        ],
        Meaning::GyroIncrement,
        "PX4 vehicle_imu (delta_angle), PSINS (wm)",
    ),
    (
        &[
            "gyrocount",
            "gyrocounts",
            "gyropulses",
            "pulse",
            "pulses",
            "count",
            "counts",
        ],
        Meaning::GyroCount,
        "counters of ring-laser gyros",
    ),
    (
        &[
            "acc",
            "accel",
            "accelerometer",
            "accelerometers",
            "acceleration",
            "a",
            "accelerometeracceleration",
            "acce",
            "linacc",
            "acclout",
            "beschleunigung",
        ],
        Meaning::Force,
        "ArduPilot IMU, Xsens, x-io, phyphox, WitMotion, SensorLog, RIDI (acce), UZH-FPV (lin_acc), Analog Devices",
    ),
    (
        &["accsmooth", "accadc"],
        Meaning::Force,
        "Betaflight blackbox_decode",
    ),
    (
        &[
            "f",
            "sf",
            "specificforce",
            "fb",
            "gf",
            "gforce",
            "totalacceleration",
        ],
        Meaning::Force,
        "NaveGo (imu.fb), Physics Toolbox (gFx), RaceBox (GForceX), Sensor Logger",
    ),
    (
        &["linearacceleration"],
        Meaning::Force,
        "ROS sensor_msgs/Imu, where it holds gravity",
    ),
    (
        &[
            "dvel",
            "deltav",
            "deltavel",
            "deltavelocity",
            "dv",
            "velocityincrement",
            "vm",
        ],
        Meaning::VelocityIncrement,
        "PX4 vehicle_imu (delta_velocity), PSINS (vm)",
    ),
    (
        &[
            "mag",
            "magnetometer",
            "magneticfield",
            "magfield",
            "magnetic",
            "m",
        ],
        Meaning::Field,
        "x-io, Xsens, WitMotion, Android TYPE_MAGNETIC_FIELD",
    ),
    (
        &["temp", "temperature", "temps", "temperatures"],
        Meaning::Temperature,
        "WitMotion, LPMS",
    ),
    (
        &[
            "q",
            "quat",
            "quaternion",
            "quaternions",
            "quatq",
            "orientationq",
            "orientation",
            "attitude",
            "att",
        ],
        Meaning::Attitude,
        "EuRoC (q_RS), Xsens (Quat_q0), WitMotion, ROS, PX4 vehicle_attitude",
    ),
    (
        &["dither", "pickoff", "ditherangle"],
        Meaning::Dither,
        "pickoffs of dithered gyros",
    ),
    (
        &[
            "encoder",
            "enc",
            "encoderangle",
            "tableangle",
            "tableencoder",
            "turntableangle",
        ],
        Meaning::Encoder,
        "turntables",
    ),
    (
        &["angle", "euler", "eulerangle", "eulerangles", "ori"],
        Meaning::Euler,
        "WitMotion (AngleX), Xsens (Euler_X), LPMS (EulerX)",
    ),
    (
        &[
            "mat",
            "matrix",
            "rotmat",
            "rotationmatrix",
            "dcm",
            "r",
            "cnb",
            "element",
        ],
        Meaning::Matrix,
        "Xsens (Mat[1][1]), x-IMU (Element 11), textbooks (R11, C_nb)",
    ),
];

/// Words of a name without information: who measured, and in which frame.
const FILLERS: &[&str] = &[
    "imu",
    "ins",
    "sensor",
    "sensors",
    "raw",
    "cal",
    "calibrated",
    "data",
    "device",
    "motion",
    "body",
    "b",
    "mean",
    "measured",
    "meas",
    "value",
    "values",
    "field",
    "type",
    "rs",
    "unit",
    "un",
    "comp",
    "scaled",
    "est",
    "estimated",
];

/// Words of a measurement by another instrument.
const REFERENCE_WORDS: &[&str] = &[
    "ref",
    "reference",
    "truth",
    "true",
    "gt",
    "groundtruth",
    "vicon",
    "opt",
    "optical",
    "mocap",
    "optitrack",
    "table",
    "turntable",
];

/// Words of a column that is about a measurement and is none itself.
const NO_MEASUREMENT: &[(&str, &str)] = &[
    ("covariance", "a covariance"),
    ("convariance", "a covariance"),
    ("bias", "a bias and no measurement"),
    ("des", "a demand and no measurement"),
    ("setpoint", "a demand and no measurement"),
    ("target", "a demand and no measurement"),
    ("err", "an error and no measurement"),
    ("reset", "a reset and no measurement"),
    (
        "absolute",
        "the length of a vector whose components are there",
    ),
    ("norm", "the length of a vector whose components are there"),
    (
        "magnitude",
        "the length of a vector whose components are there",
    ),
    ("counter", "a counter of rows"),
    ("packet", "a counter of rows"),
    ("seq", "a counter of rows"),
    ("frame", "a counter of rows, or a name"),
    ("relative", "an offset of stamps"),
];

/// Words that a column of an attitude, an angle or a temperature has.
const TELLING: &[&str] = &[
    "angle",
    "angles",
    "roll",
    "pitch",
    "yaw",
    "heading",
    "azimuth",
    "euler",
    "quat",
    "quaternion",
    "quaternions",
    "q",
    "attitude",
    "orientation",
    "encoder",
    "temp",
    "temperature",
    "mat",
    "dcm",
];

/// Returns the target of a name, its words joined in lower case.
pub fn target(stem: &str) -> Option<Target> {
    let (_, meaning, _) = NAMES.iter().find(|(names, ..)| names.contains(&stem))?;
    let quantity = match meaning {
        Meaning::GyroRate => Quantity::GyroRate,
        Meaning::GyroIncrement => Quantity::GyroIncrement,
        Meaning::GyroCount => Quantity::GyroCount,
        Meaning::Force => Quantity::SpecificForce,
        Meaning::VelocityIncrement => Quantity::VelocityIncrement,
        Meaning::Field => Quantity::MagneticField,
        Meaning::Temperature => Quantity::Temperature,
        Meaning::Attitude => Quantity::ReferenceAttitude,
        Meaning::Dither => Quantity::DitherAngle,
        Meaning::Encoder => return Some(Target::ReferenceAngle),
        Meaning::Euler => return Some(Target::Euler),
        Meaning::Matrix => return Some(Target::Matrix),
    };
    Some(Target::Stored(quantity))
}

/// True if a word names another instrument.
pub fn is_reference(word: &str) -> bool {
    REFERENCE_WORDS.contains(&word)
}

/// True if a word in lower case has no information.
pub fn is_filler(word: &str) -> bool {
    let name = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
    is_reference(word) || (FILLERS.contains(&name) && (name != "b" || word == "b"))
}

/// Returns the reason for which words in lower case are of no measurement.
pub fn no_measurement(words: &[String]) -> Option<&'static str> {
    // EuRoC writes the biases of its filter as b_w_RS_S_x and b_a_RS_S_x.
    if words.first().is_some_and(|word| word == "b") && words.iter().any(|word| word == "rs") {
        return Some("a bias and no measurement");
    }
    let is = |word: &String, name: &str| word.trim_end_matches(char::is_numeric) == name;
    let of = |name: &str| words.iter().any(|word| is(word, name));
    let found = NO_MEASUREMENT.iter().find(|(name, _)| of(name));
    found.map(|(_, reason)| *reason)
}

/// True if words in lower case are those of an attitude, an angle or a temperature.
pub fn is_telling(words: &[String]) -> bool {
    let is = |word: &String| TELLING.contains(&word.trim_end_matches(char::is_numeric));
    words.iter().any(is)
}

/// Returns the dimensionless or physical meaning of a bare axis in a file of this name: `Gyroscope.csv` of phyphox and
/// Sensor Logger has the columns x, y, z.
pub fn of_file(words: &[String]) -> Option<Target> {
    let joined = std::iter::once(words.concat());
    let mut each = joined.chain(words.iter().cloned());
    each.find_map(|word| match target(&word)? {
        found @ Target::Stored(_) if word.len() > 2 => Some(found),
        _ => None,
    })
}
