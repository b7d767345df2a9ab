//! Lists forms of files with units and columns documented by their publishers, so that no column needs `--map`.

use crate::import::files::columns::{Block, Column};

/// Form of a file, identified by its columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Its name.
    pub name: &'static str,
    /// Columns required, all of them, or the ends of their names.
    columns: &'static [&'static str],
    /// Columns that must be absent.
    without: &'static [&'static str],
    /// Columns whose names are not enough: as in `--map`.
    takes: &'static [&'static str],
    /// Target, and the unit of its columns.
    units: &'static [(&'static str, &'static str)],
    /// Order of the rotations of its Euler angles.
    euler: Option<&'static str>,
}

/// A form in which nothing is said; each form names what differs.
const NONE: Form = Form {
    name: "",
    columns: &[],
    without: &[],
    takes: &[],
    units: &[],
    euler: None,
};

/// Units of SI.
const SI: &[(&str, &str)] = &[("gyro_rate", "rad/s"), ("specific_force", "m/s^2")];

/// The known forms.
const FORMS: &[Form] = &[
    // Szczęsna et al. 2016, doi 10.1007/978-3-319-46418-3_45; its magnetometer is normalised.
    Form {
        name: "RepoIMU",
        columns: &[
            "Time (s)",
            "Vicon Orientation W",
            "IMU Acceleration X",
            "IMU Gyroscope X",
        ],
        units: SI,
        ..NONE
    },
    // Laidig et al. 2021, doi 10.3390/data6070072: quaternions w x y z, sensor to ENU.
    Form {
        name: "BROAD",
        columns: &["imu_gyr[2]", "imu_acc[2]", "imu_mag[2]", "opt_quat[3]"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("magnetic_field", "uT"),
        ],
        ..NONE
    },
    // uORB message sensor_combined as written by pyulog's ulog2csv.
    Form {
        name: "PX4 sensor_combined",
        columns: &["timestamp", "gyro_rad[2]", "accelerometer_m_s2[2]"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("time", "us"),
        ],
        ..NONE
    },
    // uORB message vehicle_attitude: Hamilton, FRD body to NED.
    Form {
        name: "PX4 vehicle_attitude",
        columns: &["timestamp", "q[0]", "q[3]", "delta_q_reset[0]"],
        units: &[("time", "us")],
        ..NONE
    },
    // ROS sensor_msgs/Imu, with units of REP 103; its time is in nanoseconds by `rostopic echo -p`.
    Form {
        name: "ROS sensor_msgs/Imu",
        columns: &[
            "angular_velocity.x",
            "linear_acceleration.x",
            "orientation.w",
        ],
        units: SI,
        ..NONE
    },
    // ArduPilot LogStructure.h: IMU has units "sEEEooo--O--zz": rad/s, m/s^2, °C.
    Form {
        name: "ArduPilot IMU",
        columns: &["TimeUS", "GyrX", "AccX", "EG", "T"],
        takes: &["T=temperature:-:C"],
        units: SI,
        ..NONE
    },
    // ArduPilot LogStructure.h: ATT has its angles in deg; yaw, pitch, roll from NED to the body.
    Form {
        name: "ArduPilot ATT",
        columns: &["TimeUS", "DesRoll", "Roll", "Pitch", "Yaw"],
        units: &[("reference_euler", "deg")],
        euler: Some("zyx"),
        ..NONE
    },
    // Betaflight blackbox-tools: gyroADC in deg/s after decoding, the acceleration in counts of acc_1G.
    Form {
        name: "Betaflight blackbox",
        columns: &["loopIteration", "gyroADC[0]"],
        units: &[("gyro_rate", "deg/s")],
        ..NONE
    },
    // Movella DOT data export: the quaternion before the inertial columns, gyros in deg/s, stamps in us.
    Form {
        name: "Movella DOT",
        columns: &["SampleTimeFine", "Quat_W", "Acc_X", "Gyr_X"],
        units: &[
            ("gyro_rate", "deg/s"),
            ("specific_force", "m/s^2"),
            ("time", "us"),
        ],
        ..NONE
    },
    // Movella DOT data export with Euler angles.
    Form {
        name: "Movella DOT",
        columns: &["SampleTimeFine", "Euler_X", "Acc_X", "Gyr_X"],
        units: &[
            ("gyro_rate", "deg/s"),
            ("specific_force", "m/s^2"),
            ("reference_euler", "deg"),
            ("time", "us"),
        ],
        euler: Some("zyx"),
        ..NONE
    },
    // Xsens, MT Low Level Communication Protocol: SampleTimeFine counts ticks of 10 kHz. The quaternion's names tell it from a
    // Movella DOT's export, whose stamps are in us.
    Form {
        name: "Xsens MT clock",
        columns: &["PacketCounter", "SampleTimeFine", "Acc_X", "Quat_q0"],
        units: &[("time", "0.1*ms")],
        ..NONE
    },
    Form {
        name: "Xsens MT clock",
        columns: &["PacketCounter", "SampleTimeFine", "Acc_X", "Mat[1][1]"],
        units: &[("time", "0.1*ms")],
        ..NONE
    },
    // Xsens MT Manager, text export: Acc in m/s^2, Gyr in rad/s, Roll, Pitch, Yaw in deg.
    Form {
        name: "Xsens MT text",
        columns: &["PacketCounter", "Acc_X", "Gyr_X"],
        without: &["Quat_W", "Euler_X"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("reference_euler", "deg"),
        ],
        euler: Some("zyx"),
        ..NONE
    },
    // Sensor Logger (tszheichoi.com/sensorlogger): iOS and Android in SI, `time` in ns since 1970, angles in rad.
    Form {
        name: "Sensor Logger",
        columns: &["time", "seconds_elapsed"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("magnetic_field", "uT"),
            ("reference_euler", "rad"),
            ("time", "ns"),
        ],
        ..NONE
    },
    // Android SensorEvent.values by sensor type: rad/s, m/s^2, uT.
    Form {
        name: "Android SensorEvent",
        columns: &["TYPE_GYROSCOPE_X"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("magnetic_field", "uT"),
        ],
        ..NONE
    },
    // Physics Toolbox Sensor Suite: g, rad/s, uT.
    Form {
        name: "Physics Toolbox",
        columns: &["gFx", "gFy", "gFz", "wx"],
        takes: &[
            "Bx=magnetic_field:x:uT",
            "By=magnetic_field:y:uT",
            "Bz=magnetic_field:z:uT",
            "time=time:-:s",
        ],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "g"),
            ("time", "s"),
        ],
        ..NONE
    },
    // EuRoC MAV, state_groundtruth_estimate0: a header of `#timestamp` alone, in ns.
    Form {
        name: "EuRoC ground truth",
        columns: &["timestamp", "p_RS_R_x", "q_RS_w"],
        units: &[("time", "ns")],
        ..NONE
    },
    // Kalibr, bag creator: omega in rad/s and alpha, the specific force, in m/s^2; stamps in ns.
    Form {
        name: "Kalibr imu0.csv",
        columns: &["timestamp", "omega_x", "alpha_x"],
        takes: &[
            "alpha_x=specific_force:x:m/s^2",
            "alpha_y=specific_force:y:m/s^2",
            "alpha_z=specific_force:z:m/s^2",
        ],
        units: &[("gyro_rate", "rad/s"), ("time", "ns")],
        ..NONE
    },
    // x-IMU GUI, CSVfileWriter: `Element 1` to `Element 4` are w x y z.
    Form {
        name: "x-IMU quaternion",
        columns: &["Element 1", "Element 2", "Element 3", "Element 4"],
        takes: &[
            "Element 1=reference_attitude:w",
            "Element 2=reference_attitude:x",
            "Element 3=reference_attitude:y",
            "Element 4=reference_attitude:z",
        ],
        ..NONE
    },
    // x-IMU GUI, CSVfileWriter: Euler angles `Roll | Phi | X (degrees)`.
    Form {
        name: "x-IMU Euler angles",
        columns: &["Roll | Phi | X", "Pitch | Theta | Y", "Yaw | Psi | Z"],
        takes: &[
            "Roll | Phi | X=reference_euler:x:deg",
            "Pitch | Theta | Y=reference_euler:y:deg",
            "Yaw | Psi | Z=reference_euler:z:deg",
        ],
        euler: Some("zyx"),
        ..NONE
    },
    // x-io NGIMU and x-IMU3: quaternion.csv is Time (s) or Timestamp (us), W, X, Y, Z.
    Form {
        name: "x-io quaternion",
        columns: &["W", "X", "Y", "Z"],
        takes: &[
            "W=reference_attitude:w",
            "X=reference_attitude:x",
            "Y=reference_attitude:y",
            "Z=reference_attitude:z",
        ],
        ..NONE
    },
    // x-io NGIMU: matrix.csv.
    Form {
        name: "x-io matrix",
        columns: &["XX", "XY", "XZ", "YX", "YY", "YZ", "ZX", "ZY", "ZZ"],
        takes: &[
            "XX=reference_matrix:11",
            "XY=reference_matrix:12",
            "XZ=reference_matrix:13",
            "YX=reference_matrix:21",
            "YY=reference_matrix:22",
            "YZ=reference_matrix:23",
            "ZX=reference_matrix:31",
            "ZY=reference_matrix:32",
            "ZZ=reference_matrix:33",
        ],
        ..NONE
    },
    // WitMotion's chip time, T(°) beside angles about x, y, z; q1 to q4 are its q0 to q3, the scalar first.
    Form {
        name: "WitMotion text",
        columns: &["ax", "wx", "AngleX", "q1", "q4"],
        takes: &[
            "q1=reference_attitude:w",
            "q2=reference_attitude:x",
            "q3=reference_attitude:y",
            "q4=reference_attitude:z",
            "T=temperature:-:C",
        ],
        units: &[("reference_euler", "deg")],
        euler: Some("zyx"),
        ..NONE
    },
    // TUM RGB-D trajectories: timestamp tx ty tz qx qy qz qw, seconds since 1970.
    Form {
        name: "TUM trajectory",
        columns: &["tx", "ty", "tz", "qx", "qy", "qz", "qw"],
        units: &[("time", "s")],
        ..NONE
    },
    // PSINS (Gongmin Yan): imu = [wm vm t], increments in rad and m/s.
    Form {
        name: "PSINS imu",
        columns: &["imu[0]", "imu[6]"],
        without: &["imu[7]"],
        takes: &[
            "imu[0]=gyro_increment:x:rad",
            "imu[1]=gyro_increment:y:rad",
            "imu[2]=gyro_increment:z:rad",
            "imu[3]=velocity_increment:x:m/s",
            "imu[4]=velocity_increment:y:m/s",
            "imu[5]=velocity_increment:z:m/s",
            "imu[6]=time:-:s",
        ],
        ..NONE
    },
    // PSINS: avp = [att vn pos t]; att is pitch about x, roll about y, yaw about z, turned about z, x, y (a2mat).
    Form {
        name: "PSINS avp",
        columns: &["avp[0]", "avp[9]"],
        without: &["avp[10]"],
        takes: &[
            "avp[0]=reference_euler:x:rad",
            "avp[1]=reference_euler:y:rad",
            "avp[2]=reference_euler:z:rad",
            "avp[9]=time:-:s",
        ],
        euler: Some("zxy"),
        ..NONE
    },
    // NaveGo (R. Gonzalez): imu.wb rad/s, imu.fb m/s^2, t in s; ref.roll, pitch, yaw in rad, yaw first.
    Form {
        name: "NaveGo",
        columns: &["imu.t", "imu.fb[0]", "imu.wb[0]"],
        units: &[
            ("gyro_rate", "rad/s"),
            ("specific_force", "m/s^2"),
            ("time", "s"),
            ("reference_euler", "rad"),
        ],
        euler: Some("zyx"),
        ..NONE
    },
    // NaveGo's reference, of another length than the IMU's.
    Form {
        name: "NaveGo reference",
        columns: &["ref.t", "ref.roll", "ref.pitch", "ref.yaw"],
        units: &[("time", "s"), ("reference_euler", "rad")],
        euler: Some("zyx"),
        ..NONE
    },
];

/// Reduces a name to its letters and digits without a unit in brackets, in lower case; `[0]` is a place and stays.
fn reduced(name: &str) -> String {
    let bare = name.split(['(', '[']).next().unwrap_or_default();
    let is_place = name.ends_with(']') && name.contains(|letter: char| letter.is_ascii_digit());
    let text = if is_place { name } else { bare };
    let letters = text.chars().filter(|letter| letter.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

/// True if a reduced name is the one of a form: wholly, or by its end behind the name of a message or structure.
fn is_column(found: &str, wanted: &str) -> bool {
    let wanted = reduced(wanted);
    found == wanted || (wanted.len() > 8 && found.ends_with(&wanted))
}

impl Form {
    /// Returns the forms of a file with these columns: a table joined of two files has both.
    pub fn of(block: &Block) -> Vec<&'static Self> {
        let names: Vec<String> = block
            .columns
            .iter()
            .map(|column| reduced(&column.name))
            .collect();
        let has = |name: &&str| names.iter().any(|found| is_column(found, name));
        let is = |form: &&Self| form.columns.iter().all(&has) && !form.without.iter().any(&has);
        FORMS.iter().filter(is).collect()
    }

    /// Returns the unit of a file's columns of `target`, with the form's name; `time` is a target here.
    pub fn unit_in(block: &Block, target: &str) -> Option<(&'static str, &'static str)> {
        Self::of(block).into_iter().find_map(|form| {
            let found = form.units.iter().find(|(name, _)| *name == target);
            found.map(|(_, unit)| (*unit, form.name))
        })
    }

    /// Returns the meaning that a form gives to a column, `QUANTITY:AXIS:UNIT`.
    pub fn takes(block: &Block, column: &Column) -> Option<&'static str> {
        let mut takes = Self::of(block).into_iter().flat_map(|form| form.takes);
        takes.find_map(|take| {
            let (name, meaning) = take.rsplit_once('=')?;
            (reduced(name) == reduced(&column.name)).then_some(meaning)
        })
    }

    /// Returns the order of the rotations of a file's Euler angles.
    pub fn euler(block: &Block) -> Option<&'static str> {
        Self::of(block).into_iter().find_map(|form| form.euler)
    }
}
