//! `rlg import` of files made new after the headers that loggers, applications and toolboxes publish: each goes in without an
//! option, in the right unit, with its reference; and what must be asked is asked once.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use rlg::recording::{Clock, Quantity, Recording};
use tempfile::TempDir;

pub(crate) const G_M_S2: f64 = 9.806_65;
pub(crate) const RATE_HZ: f64 = 100.0;
pub(crate) const ROWS: usize = 600;
/// Second since 1970 at which the logs begin.
const START_S: u64 = 1_640_995_200;

/// The truth at a row's end, rates and forces as means over it.
#[derive(Clone, Copy)]
pub(crate) struct Truth {
    pub(crate) rate_rad_s: [f64; 3],
    force_m_s2: [f64; 3],
    quaternion: [f64; 4],
    matrix: [[f64; 3]; 3],
}

fn product([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

fn matrix([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// A unit turned by hand; with `table` about z alone.
pub(crate) fn truth(table: bool) -> Vec<Truth> {
    let mut quaternion = [1.0, 0.0, 0.0, 0.0];
    let step = |row: usize| {
        let t = (row as f64 + 0.5) / RATE_HZ;
        let z = 0.9 * (0.7 * t + 1.0).sin();
        let rate_rad_s = match table {
            true => [0.0, 0.0, z],
            false => [0.8 * (1.3 * t).sin(), 0.6 * (0.9 * t + 0.3).cos(), z],
        };
        let half = rate_rad_s.map(|rate| rate / RATE_HZ / 2.0);
        let angle = half.iter().map(|part| part * part).sum::<f64>().sqrt();
        let [x, y, z] = half.map(|part| part * angle.sin() / angle);
        quaternion = product(quaternion, [angle.cos(), x, y, z]);
        let matrix = matrix(quaternion);
        Truth {
            rate_rad_s,
            force_m_s2: matrix[2].map(|part| part * G_M_S2),
            quaternion,
            matrix,
        }
    };
    (0..ROWS).map(step).collect()
}

/// Returns the cell that a word stands for: `t.ns` a stamp, `wx` a rate, `fx` a force, `qw`, `r11`, `ex` an Euler angle, with
/// a unit behind a point; `n` a counter; any other word is itself.
fn cell(truth: &[Truth], row: usize, word: &str) -> String {
    let here = truth[row];
    let (name, unit) = word.split_once('.').unwrap_or((word, ""));
    let ms = 10 * (row as u64 + 1);
    let axis = |letter: char| "xyz".find(letter);
    let letters: Vec<char> = name.chars().collect();
    let number = |value: f64| format!("{value:.7}");
    match (&letters[..], unit) {
        (['t'], "ns") => format!("{}", (START_S * 1000 + ms) * 1_000_000),
        (['t'], "us") => format!("{}", 12_345_000 + ms * 1000),
        (['t'], "ms") => format!("{ms}"),
        (['t'], "epoch") => format!("{}.{:03}", START_S + ms / 1000, ms % 1000),
        (['t'], "sec") => format!("{}", START_S + ms / 1000),
        (['t'], "nanosec") => format!("{}", ms % 1000 * 1_000_000),
        (['t'], "matlab") => format!("01-Jan-2022 12:00:{:02}.{:03}", ms / 1000, ms % 1000),
        (['t'], "late") => format!("{}", (START_S * 1000 + ms + 1 + row as u64 % 7) * 1_000_000),
        (['t'], "iso") => format!("2022-01-01T12:00:{:02}.{:03}+01:00", ms / 1000, ms % 1000),
        (['t'], "date") => format!("2022-01-01 12:00:{:02}.{:03}", ms / 1000, ms % 1000),
        (['t'], _) => format!("{:.4}", ms as f64 / 1000.0),
        (['n'], _) => format!("{}", 27_626 + row),
        (['w', letter @ ('x' | 'y' | 'z')], unit) => {
            let rate = here.rate_rad_s[axis(*letter).expect("an axis")];
            match unit {
                "deg" => number(rate.to_degrees()),
                "whole" => format!("{}", rate.to_degrees().round()),
                "reversed" => number(-rate.to_degrees()),
                _ => number(rate),
            }
        }
        (['f', letter @ ('x' | 'y' | 'z')], unit) => {
            let force = here.force_m_s2[axis(*letter).expect("an axis")];
            match unit {
                "g" => number(force / G_M_S2),
                "count" => format!("{}", (force / G_M_S2 * 2048.0).round()),
                "down" => number(-force),
                _ => number(force),
            }
        }
        (['q', letter @ ('w' | 'x' | 'y' | 'z')], _) => {
            number(here.quaternion["wxyz".find(*letter).expect("a part")])
        }
        (['r', i @ '1'..='3', j @ '1'..='3'], _) => {
            let place = |digit: &char| *digit as usize - '1' as usize;
            number(here.matrix[place(i)][place(j)])
        }
        (['e', letter @ ('x' | 'y' | 'z')], unit) => {
            let m = here.matrix;
            let angle = match letter {
                'x' => m[2][1].atan2(m[2][2]),
                'y' => -m[2][0].asin(),
                _ => m[1][0].atan2(m[0][0]),
            };
            number(if unit == "deg" {
                angle.to_degrees()
            } else {
                angle
            })
        }
        (['a'], _) => {
            let angle: f64 = truth[..=row]
                .iter()
                .map(|one| one.rate_rad_s[2] / RATE_HZ)
                .sum();
            number(angle.to_degrees())
        }
        _ => word.to_owned(),
    }
}

/// A file of a form.
pub(crate) struct Log {
    name: &'static str,
    /// Lines above the rows.
    pub(crate) head: &'static str,
    delimiter: &'static str,
    /// A word for each cell; see [`cell`].
    row: &'static str,
    /// Every how many rows it has one.
    every: usize,
}

/// A form: its publisher, its files, true if it has an attitude.
pub(crate) struct Published {
    pub(crate) by: &'static str,
    pub(crate) logs: &'static [Log],
    pub(crate) has_attitude: bool,
}

pub(crate) const fn log(
    name: &'static str,
    head: &'static str,
    delimiter: &'static str,
    row: &'static str,
) -> Log {
    Log {
        name,
        head,
        delimiter,
        row,
        every: 1,
    }
}

pub(crate) const fn slow(every: usize, log: Log) -> Log {
    Log { every, ..log }
}

pub(crate) const fn published(
    by: &'static str,
    has_attitude: bool,
    logs: &'static [Log],
) -> Published {
    Published {
        by,
        logs,
        has_attitude,
    }
}

const EUROC: Log = log(
    "data.csv",
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
    ",",
    "t.ns wx wy wz fx fy fz",
);

const NGIMU: Log = log(
    "sensors.csv",
    "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),\
     Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)",
    ",",
    "t wx.deg wy.deg wz.deg fx.g fy.g fz.g 20 1 -40 1003.2",
);

const MT: &str = "// Update Rate: 100.0Hz\n// Firmware Version: 4.0.2\n";

const MT_ROW: &str = "n  fx fy fz wx wy wz";

/// The forms, each with the place where its header is published.
const FORMS: &[Published] = &[
    published("EuRoC MAV, imu0/data.csv", false, &[EUROC]),
    published(
        "EuRoC MAV, state_groundtruth_estimate0",
        true,
        &[
            EUROC,
            slow(
                2,
                log(
                    "groundtruth.csv",
                    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], \
                 v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], \
                 b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]",
                    ",",
                    "t.ns 0 0 0 qw qx qy qz 0 0 0 0.1 0.2 0.3 0.1 0.2 0.3",
                ),
            ),
        ],
    ),
    published(
        "TUM-VI, mocap0/data.csv",
        true,
        &[
            EUROC,
            slow(
                3,
                log(
                    "mocap.csv",
                    "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []",
                    ",",
                    "t.ns 0 0 0 qw qx qy qz",
                ),
            ),
        ],
    ),
    published(
        "TUM RGB-D, trajectory",
        true,
        &[
            EUROC,
            slow(
                3,
                log(
                    "trajectory.txt",
                    "# timestamp tx ty tz qx qy qz qw",
                    " ",
                    "t.epoch 0 0 0 qx qy qz qw",
                ),
            ),
        ],
    ),
    published(
        "ROS, rostopic echo -p of sensor_msgs/Imu",
        true,
        &[log(
            "imu.csv",
            "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,\
             field.orientation.z,field.orientation.w,field.orientation_covariance0,field.angular_velocity.x,\
             field.angular_velocity.y,field.angular_velocity.z,field.angular_velocity_covariance0,\
             field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z,field.linear_acceleration_covariance0",
            ",",
            "t.ns n t.ns imu qx qy qz qw 0 wx wy wz 0 fx fy fz 0",
        )],
    ),
    published(
        "ROS, sensor_msgs/Imu in columns with signs between the words",
        true,
        &[log(
            "imu_data.csv",
            "Timestamp,Orientation_x,Orientation_y,Orientation_z,Orientation_w,Angular_velocity_x,Angular_velocity_y,\
             Angular_velocity_z,Linear_acceleration_x,Linear_acceleration_y,Linear_acceleration_z",
            ",",
            "t.epoch qx qy qz qw wx wy wz fx fy fz",
        )],
    ),
    published(
        "phyphox, Gyroscope.csv",
        false,
        &[log(
            "Gyroscope.csv",
            "\"Time (s)\",\"X (rad/s)\",\"Y (rad/s)\",\"Z (rad/s)\"",
            ",",
            "t wx wy wz",
        )],
    ),
    published(
        "phyphox, two files",
        false,
        &[
            log(
                "Gyroscope.csv",
                "\"Time (s)\",\"Gyroscope x (rad/s)\",\"Gyroscope y (rad/s)\",\"Gyroscope z (rad/s)\",\"Absolute (rad/s)\"",
                ",",
                "t wx wy wz 1",
            ),
            log(
                "Accelerometer.csv",
                "\"Time (s)\",\"Acceleration x (m/s^2)\",\"Acceleration y (m/s^2)\",\"Acceleration z (m/s^2)\",\"Absolute acceleration (m/s^2)\"",
                ",",
                "t fx fy fz 9.8",
            ),
        ],
    ),
    published(
        "x-io NGIMU, quaternion.csv",
        true,
        &[
            NGIMU,
            slow(
                2,
                log("quaternion.csv", "Time (s),W,X,Y,Z", ",", "t qw qx qy qz"),
            ),
        ],
    ),
    published(
        "x-io NGIMU, matrix.csv",
        true,
        &[
            NGIMU,
            slow(
                2,
                log(
                    "matrix.csv",
                    "Time (s),XX,XY,XZ,YX,YY,YZ,ZX,ZY,ZZ",
                    ",",
                    "t r11 r12 r13 r21 r22 r23 r31 r32 r33",
                ),
            ),
        ],
    ),
    published(
        "x-io NGIMU, euler.csv",
        true,
        &[
            NGIMU,
            slow(
                2,
                log(
                    "euler.csv",
                    "Time (s),Roll (deg),Pitch (deg),Yaw (deg)",
                    ",",
                    "t ex.deg ey.deg ez.deg",
                ),
            ),
        ],
    ),
    published(
        "x-io x-IMU3",
        true,
        &[
            log(
                "Inertial.csv",
                "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)",
                ",",
                "t.us wx.deg wy.deg wz.deg fx.g fy.g fz.g",
            ),
            log(
                "Quaternion.csv",
                "Timestamp (us),W,X,Y,Z",
                ",",
                "t.us qw qx qy qz",
            ),
        ],
    ),
    published(
        "Movella DOT",
        true,
        &[log(
            "dot.csv",
            "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z",
            ",",
            "n t.us qw qx qy qz fx fy fz wx.deg wy.deg wz.deg",
        )],
    ),
    published(
        "WitMotion, chs.py",
        true,
        &[log(
            "wit.txt",
            "Chiptime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tAngleY(deg)\tAngleZ(deg)\tT(°)\tmagx\tmagy\t\
             magz\tlon\tlat\tYaw\tSpeed\tq1\tq2\tq3\tq4",
            "\t",
            "t.date fx.g fy.g fz.g wx.deg wy.deg wz.deg ex.deg ey.deg ez.deg 31.2 100 -20 300 0 0 0 0 qw qx qy qz",
        )],
    ),
    published(
        "WitMotion, application",
        true,
        &[log(
            "record.csv",
            "Time,Device name,Chip Time(),Acceleration X(g),Acceleration Y(g),Acceleration Z(g),Angular velocity X(°/s),\
             Angular velocity Y(°/s),Angular velocity Z(°/s),Angle X(°),Angle Y(°),Angle Z(°),Temperature(°C),Quaternions 0(),\
             Quaternions 1(),Quaternions 2(),Quaternions 3()",
            ",",
            "t.date WT901 t.date fx.g fy.g fz.g wx.deg wy.deg wz.deg ex.deg ey.deg ez.deg 31.2 qw qx qy qz",
        )],
    ),
    published(
        "Sensor Logger",
        true,
        &[
            log(
                "Gyroscope.csv",
                "time,seconds_elapsed,z,y,x",
                ",",
                "t.ns t wz wy wx",
            ),
            log(
                "Orientation.csv",
                "time,seconds_elapsed,qz,qy,qx,qw,roll,pitch,yaw",
                ",",
                "t.ns t qz qy qx qw ex ey ez",
            ),
        ],
    ),
    published(
        "Betaflight, blackbox_decode",
        false,
        &[log(
            "LOG00001.01.csv",
            "loopIteration, time (us), axisP[0], setpoint[0], vbatLatest (V), rssi, gyroADC[0], gyroADC[1], gyroADC[2], accSmooth[0], \
             accSmooth[1], accSmooth[2], debug[0], motor[0], flightModeFlags (flags)",
            ", ",
            "n t.us 0 0 15.9 0 wx.whole wy.whole wz.whole fx.count fy.count fz.count 0 0 0",
        )],
    ),
    published(
        "ArduPilot, IMU and ATT",
        true,
        &[
            log(
                "IMU.csv",
                "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
                ",",
                "t.us 0 wx wy wz fx.down fy.down fz.down 0 0 41.5 1 1 1000 1000",
            ),
            slow(
                4,
                log(
                    "ATT.csv",
                    "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF",
                    ",",
                    "t.us 0 ex.deg 0 ey.deg 0 ez.deg 0.1 0.1 3",
                ),
            ),
        ],
    ),
    published(
        "PX4, sensor_combined and vehicle_attitude by ulog2csv",
        true,
        &[
            log(
                "log_sensor_combined_0.csv",
                "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,\
                 accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt",
                ",",
                "t.us wx wy wz 10000 0 fx.down fy.down fz.down 10000",
            ),
            slow(
                2,
                log(
                    "log_vehicle_attitude_0.csv",
                    "timestamp,timestamp_sample,q[0],q[1],q[2],q[3],delta_q_reset[0],delta_q_reset[1],delta_q_reset[2],\
                 delta_q_reset[3],quat_reset_counter",
                    ",",
                    "t.us t.us qw qx qy qz 1 0 0 0 0",
                ),
            ),
        ],
    ),
    published(
        "LP-Research LPMS",
        true,
        &[log(
            "lpms.csv",
            "SensorId, TimeStamp (s), FrameNumber, AccX (g), AccY (g), AccZ (g), GyroX (deg/s), GyroY (deg/s), GyroZ (deg/s), \
             EulerX (deg), EulerY (deg), EulerZ (deg), QuatW, QuatX, QuatY, QuatZ, LinAccX (g), Temperature (degC)",
            ", ",
            "1 t n fx.g fy.g fz.g wx.deg wy.deg wz.deg ex.deg ey.deg ez.deg qw qx qy qz 0 31.5",
        )],
    ),
    published(
        "SensorLog for iOS",
        true,
        &[log(
            "sensorlog.csv",
            "loggingTime(txt),loggingSample(N),accelerometerAccelerationX(G),accelerometerAccelerationY(G),\
             accelerometerAccelerationZ(G),gyroRotationX(rad/s),gyroRotationY(rad/s),gyroRotationZ(rad/s),motionYaw(rad),\
             motionRoll(rad),motionPitch(rad),motionQuaternionX(R),motionQuaternionY(R),motionQuaternionZ(R),motionQuaternionW(R)",
            ",",
            "t.iso n fx.g fy.g fz.g wx wy wz ez ex ey qx qy qz qw",
        )],
    ),
    published(
        "Physics Toolbox Sensor Suite",
        false,
        &[log(
            "multi.csv",
            "time,gFx,gFy,gFz,wx,wy,wz,Bx,By,Bz",
            ",",
            "t fx.g fy.g fz.g wx wy wz 20.1 1.2 -40.3",
        )],
    ),
    published(
        "Android, SensorEvent by type",
        false,
        &[log(
            "log.csv",
            "TimeStamp,TYPE_ACCELEROMETER_X,TYPE_ACCELEROMETER_Y,TYPE_ACCELEROMETER_Z,TYPE_GYROSCOPE_X,TYPE_GYROSCOPE_Y,TYPE_GYROSCOPE_Z",
            ",",
            "t.ms fx fy fz wx wy wz",
        )],
    ),
    published(
        "pandas, two levels of columns",
        false,
        &[log(
            "log.csv",
            "sensor,gyro,gyro,gyro,acc,acc,acc\naxis,x,y,z,x,y,z\ntime,,,,,,",
            ",",
            "t wx wy wz fx fy fz",
        )],
    ),
    published(
        "names with units behind signs",
        true,
        &[log(
            "log.csv",
            "timestamp_ms,gx_deg_s,gy_deg_s,gz_deg_s,roll_deg,pitch_deg,yaw_deg",
            ",",
            "t.ms wx.deg wy.deg wz.deg ex.deg ey.deg ez.deg",
        )],
    ),
    published(
        "names without units, the gyros told by the quaternion",
        true,
        &[log(
            "log.csv",
            "time,ax,ay,az,gx,gy,gz,qw,qx,qy,qz,roll,pitch,yaw",
            ",",
            "t fx fy fz wx.deg wy.deg wz.deg qw qx qy qz ex ey ez",
        )],
    ),
    published(
        "names without units, the gyros told by gravity",
        false,
        &[log(
            "log.csv",
            "timestamp_us,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z",
            ",",
            "t.us wx.deg wy.deg wz.deg fx.g fy.g fz.g",
        )],
    ),
    published(
        "rotation matrix R11 to R33",
        true,
        &[log(
            "log.csv",
            "t [s],gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s],R11,R12,R13,R21,R22,R23,R31,R32,R33",
            ",",
            "t wx wy wz r11 r12 r13 r21 r22 r23 r31 r32 r33",
        )],
    ),
    published(
        "quaternion q1 to q4 with the scalar last, told by the gyros",
        true,
        &[log(
            "log.csv",
            "t (s),gx (rad/s),gy (rad/s),gz (rad/s),q1,q2,q3,q4",
            ",",
            "t wx wy wz qx qy qz qw",
        )],
    ),
];

/// A folder with the files of a form.
pub(crate) struct Bench(pub(crate) TempDir);

impl Bench {
    pub(crate) fn of(logs: &[Log], truth: &[Truth]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for log in logs {
            let words: Vec<&str> = log.row.split(' ').collect();
            let mut text = match log.head {
                "" => String::new(),
                head => format!("{head}\n"),
            };
            for row in (0..truth.len()).step_by(log.every) {
                let cells: Vec<String> = words.iter().map(|word| cell(truth, row, word)).collect();
                text.push_str(&cells.join(log.delimiter));
                text.push('\n');
            }
            fs::write(folder.path().join(log.name), text).expect("a file");
        }
        Self(folder)
    }

    fn file(&self, name: &str) -> String {
        fs::read_to_string(self.0.path().join(name)).expect("a text")
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.current_dir(self.0.path()).args(arguments);
        command.output().expect("it runs")
    }

    pub(crate) fn import(&self, logs: &[Log], more: &[&str]) -> Output {
        let mut arguments = vec!["import", "--json"];
        arguments.extend(logs.iter().map(|log| log.name));
        arguments.extend(more);
        arguments.extend(["--out", "out"]);
        self.run(&arguments)
    }

    pub(crate) fn recording(&self) -> Recording {
        Recording::read(self.0.path().join("out")).expect("a recording")
    }
}

pub(crate) fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the channel's value in a row.
pub(crate) fn value(
    recording: &Recording,
    quantity: &Quantity,
    axis: &str,
    row: usize,
) -> Option<f64> {
    let (_, channel) = recording.channel(quantity, axis)?;
    channel.values.get(row).copied()
}

/// Checks units, axes and the reference of what a form became.
pub(crate) fn check(by: &str, recording: &Recording, truth: &[Truth], has_attitude: bool) {
    let row = ROWS / 2;
    for (axis, expected) in ["x", "y", "z"].into_iter().zip(truth[row].rate_rad_s) {
        let found = value(recording, &Quantity::GyroRate, axis, row).unwrap_or(f64::NAN);
        // Betaflight writes whole degrees a second.
        assert!(
            (found - expected).abs() < 0.01,
            "{by}: gyro {axis} {found}, not {expected}"
        );
        if let Some(found) = value(recording, &Quantity::SpecificForce, axis, row) {
            let place = "xyz".find(axis).expect("an axis");
            let expected = truth[row].force_m_s2[place];
            assert!(
                (found.abs() - expected.abs()).abs() < 0.02,
                "{by}: force {axis} {found}, not {expected}"
            );
        }
    }
    let found = recording.channel(&Quantity::ReferenceAttitude, "w");
    assert_eq!(found.is_some(), has_attitude, "{by}: an attitude");
    let Some((table, _)) = found else { return };
    let every = ROWS / table.rows;
    let of = |axis: &str| {
        value(recording, &Quantity::ReferenceAttitude, axis, row / every).unwrap_or(f64::NAN)
    };
    let found = ["w", "x", "y", "z"].map(of);
    let expected = truth[row / every * every].quaternion;
    let dot: f64 = found.iter().zip(expected).map(|(a, b)| a * b).sum();
    assert!(
        dot.abs() > 0.999_99,
        "{by}: attitude {found:?}, not {expected:?}"
    );
}

#[test]
fn published_headers_go_in_without_an_option() {
    let truth = truth(false);
    let mut failed = Vec::new();
    for form in FORMS {
        let bench = Bench::of(form.logs, &truth);
        let output = bench.import(form.logs, &[]);
        if output.status.code() != Some(0) {
            failed.push(format!("{}: {}", form.by, words(&output)));
            continue;
        }
        check(form.by, &bench.recording(), &truth, form.has_attitude);
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let left = result["left_out"].as_array().expect("a list").iter();
        let without_reason = left.filter(|left| left["reason"].as_str().is_none_or(str::is_empty));
        assert_eq!(without_reason.count(), 0, "{}", form.by);
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn xsens_text_goes_in_with_each_attitude() {
    let truth = truth(false);
    let names = "PacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z";
    let attitudes = [
        ("Quat_q0\tQuat_q1\tQuat_q2\tQuat_q3", "qw qx qy qz"),
        (
            "Mat[1][1]\tMat[2][1]\tMat[3][1]\tMat[1][2]\tMat[2][2]\tMat[3][2]\tMat[1][3]\tMat[2][3]\tMat[3][3]",
            "r11 r21 r31 r12 r22 r32 r13 r23 r33",
        ),
        ("Roll\tPitch\tYaw", "ex.deg ey.deg ez.deg"),
    ];
    for (columns, row) in attitudes {
        let head = format!("{MT}{names}\t{columns}").leak();
        let logs = [log("MT.txt", head, "\t", format!("{MT_ROW} {row}").leak())];
        let bench = Bench::of(&logs, &truth);
        let output = bench.import(&logs, &[]);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{columns}: {}",
            words(&output)
        );
        check(columns, &bench.recording(), &truth, true);
    }
}

/// Returns the command line that a question offers, without `rlg`.
pub(crate) fn pasted(words: &str) -> Vec<String> {
    let line = words
        .lines()
        .map(str::trim)
        .find_map(|line| line.strip_prefix("rlg "));
    let line = line.unwrap_or_else(|| panic!("no command in: {words}"));
    let mut parts = vec![String::new()];
    let mut inside = false;
    for letter in line.chars() {
        match (letter, inside) {
            ('\'', _) => inside = !inside,
            (' ', false) => parts.push(String::new()),
            _ => parts.last_mut().expect("a part").push(letter),
        }
    }
    parts
}

#[test]
fn all_questions_come_at_once_with_a_command_to_paste() {
    let truth = truth(false);
    let logs = [
        log(
            "LoggedData_CalInertialAndMag.csv",
            "Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s)",
            ",",
            "n wx.deg wy.deg wz.deg",
        ),
        log(
            "LoggedData_Quaternion.csv",
            "Packet number,Element 1, Element 2, Element 3, Element 4",
            ",",
            "n qw qx qy qz",
        ),
    ];
    let bench = Bench::of(&logs, &truth);
    let asked = words(&bench.import(&logs, &[]));
    assert!(
        asked.contains("--rate") && asked.contains("the gyros turn as far"),
        "{asked}"
    );
    let command = pasted(&asked);
    let output = bench.run(&command.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let recording = bench.recording();
    check("x-IMU", &recording, &truth, true);
    let Clock::Uniform { rate_hz, .. } = recording.tables[0].clock else {
        panic!("a rate");
    };
    assert!((rate_hz / RATE_HZ - 1.0).abs() < 1e-3, "{rate_hz}");
    let plain = [log(
        "plain.csv",
        "t,gx,gy,gz,temp",
        ",",
        "n wx.deg wy.deg wz.deg 25",
    )];
    let bench = Bench::of(&plain, &truth);
    let asked = words(&bench.import(&plain, &[]));
    for part in ["needs 2 answers", "--time t:", "--unit gyro_rate:"] {
        assert!(asked.contains(part), "no {part:?} in {asked}");
    }
    assert!(!bench.0.path().join("out").exists());
    let output = bench.import(&plain, &["--yes"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(
        words(&output).contains("is a guess that --yes takes"),
        "{}",
        words(&output)
    );
}

#[test]
fn a_column_that_may_be_an_angle_is_not_left_out_without_a_word() {
    let truth = truth(false);
    let logs = [log(
        "log.csv",
        "t (s),gx (rad/s),gy (rad/s),gz (rad/s),stick angle left [°]",
        ",",
        "t wx wy wz 3",
    )];
    let bench = Bench::of(&logs, &truth);
    let asked = words(&bench.import(&logs, &[]));
    assert!(asked.contains("stick angle left [°]=none"), "{asked}");
    let output = bench.import(&logs, &["--map", "stick angle left [°]=none"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
}

#[test]
fn columns_without_names_come_as_one_command_to_paste() {
    let truth = truth(false);
    for (name, delimiter, row, has_attitude) in [
        ("seven.csv", ",", "t wx wy wz fx fy fz", false),
        ("seven.txt", " ", "t fx.g fy.g fz.g wx wy wz", false),
        (
            "deg.csv",
            ";",
            "n t.ms wx.deg wy.deg wz.deg fx fy fz 24.5",
            false,
        ),
        (
            "field.csv",
            ",",
            "t.us wx wy wz fx fy fz r11 r21 r31",
            false,
        ),
        ("first.csv", ",", "t qw qx qy qz wx wy wz", true),
        ("last.csv", ",", "wx wy wz fx fy fz qx qy qz qw t", true),
    ] {
        let logs = [log(name, "", delimiter, row)];
        let bench = Bench::of(&logs, &truth);
        let asked = bench.import(&logs, &[]);
        assert_eq!(asked.status.code(), Some(2), "{name}: {}", words(&asked));
        let command = pasted(&words(&asked));
        let output = bench.run(&command.iter().map(String::as_str).collect::<Vec<_>>());
        let said = words(&output);
        assert_eq!(output.status.code(), Some(0), "{name}: {command:?}: {said}");
        check(name, &bench.recording(), &truth, has_attitude);
    }
    let logs = [log("six.csv", "", ",", "1 2 3 4 5 6")];
    let refused = words(&Bench::of(&logs, &truth).import(&logs, &[]));
    assert!(
        refused.contains("has no column that is known as a gyro's"),
        "{refused}"
    );
}

#[test]
fn a_reversed_gyro_does_not_hide_the_order_of_an_attitude() {
    let truth = truth(false);
    let names = "t (s),gx [°/s],gy [°/s],gz [°/s]";
    for (columns, row) in [
        ("roll [°],pitch [°],yaw [°]", "ex.deg ey.deg ez.deg"),
        ("q1,q2,q3,q4", "qw qx qy qz"),
        ("q1,q2,q3,q4", "qx qy qz qw"),
    ] {
        let head = format!("{names},{columns}").leak();
        let row = format!("t wx.deg wy.deg wz.reversed {row}").leak();
        let logs = [log("log.csv", head, ",", row)];
        let bench = Bench::of(&logs, &truth);
        let output = bench.import(&logs, &[]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(0), "{row}: {said}");
        assert!(!said.contains("conjugates"), "{row}: {said}");
        let recording = bench.recording();
        let reversed = value(&recording, &Quantity::GyroRate, "z", ROWS / 2).expect("a rate");
        assert!((reversed + truth[ROWS / 2].rate_rad_s[2]).abs() < 1e-6);
        let part = |axis| value(&recording, &Quantity::ReferenceAttitude, axis, ROWS / 2);
        let found = ["w", "x", "y", "z"].map(|axis| part(axis).expect("an attitude"));
        let pairs = found.iter().zip(truth[ROWS / 2].quaternion);
        let dot: f64 = pairs.map(|(a, b)| a * b).sum();
        assert!(dot.abs() > 0.999_99, "{row}: {found:?}");
    }
}

#[test]
fn a_turntable_log_goes_in_with_its_axis_and_its_missing_rows() {
    let truth = truth(true);
    let logs = [log(
        "run.csv",
        "# Turntable 7\nTime;Gyro X [°/s];Gyro Y [°/s];Gyro Z [°/s];Acc X [g];Acc Y [g];Acc Z [g];Table angle [°];Temperature [°C]",
        ";",
        "t.iso wx.deg wy.deg wz.reversed fx.g fy.g fz.g a 24.5",
    )];
    let bench = Bench::of(&logs, &truth);
    let text = bench.file("run.csv");
    let head = 2;
    let lost = |line: usize| {
        (head + 100..head + 112).contains(&line) || (head + 300..head + 328).contains(&line)
    };
    let kept = text.lines().enumerate().filter(|(line, _)| !lost(*line));
    let kept: Vec<&str> = kept.map(|(_, line)| line).collect();
    fs::write(bench.0.path().join("run.csv"), kept.join("\n") + "\n").expect("a file");
    let output = bench.import(&logs, &[]);
    let words = words(&output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    assert!(
        words.contains("Table angle [°] is taken about z") && words.contains("the other sign"),
        "{words}"
    );
    assert!(words.contains("40 of 600 rows are missing"), "{words}");
    let recording = bench.recording();
    let turned = value(&recording, &Quantity::ReferenceIncrement, "z", 50).expect("an angle");
    assert!(
        (turned * RATE_HZ - truth[50].rate_rad_s[2]).abs() < 1e-4,
        "{turned}"
    );
}

#[test]
fn repeated_rows_are_dropped_and_counted_and_small_jitter_is_even() {
    let truth = truth(false);
    let logs = [log(
        "log.csv",
        "t (s),gx (rad/s),gy (rad/s),gz (rad/s),qw,qx,qy,qz",
        ",",
        "t wx wy wz qw qx qy qz",
    )];
    let bench = Bench::of(&logs, &truth);
    let text = bench.file("log.csv");
    let repeated: Vec<&str> = text
        .lines()
        .enumerate()
        .flat_map(|(place, line)| vec![line; if place > 0 && place % 7 == 0 { 2 } else { 1 }])
        .collect();
    let file = Path::new("log.csv");
    fs::write(bench.0.path().join(file), repeated.join("\n") + "\n").expect("a file");
    let output = bench.import(&logs, &[]);
    let said = words(&output);
    assert!(said.contains("85 rows that repeat the stamp"), "{said}");
    assert_eq!(bench.recording().tables[0].rows, ROWS);
    let jittered = text
        .lines()
        .enumerate()
        .map(|(place, line)| match line.split_once(',') {
            Some((stamp, rest)) if place > 0 => {
                let stamp: f64 = stamp.parse().expect("a stamp");
                // 0.3 ms, without a pattern of the rows.
                let off = ((place * 7919) % 101) as f64 / 100.0 - 0.5;
                format!("{:.6},{rest}", stamp + 6e-4 * off)
            }
            _ => line.to_owned(),
        });
    let jittered: Vec<String> = jittered.collect();
    fs::write(bench.0.path().join(file), jittered.join("\n") + "\n").expect("a file");
    let said = words(&bench.import(&logs, &[]));
    assert!(said.contains("the stamps jitter by 0.1"), "{said}");
    let recording = bench.recording();
    assert_eq!(
        recording.tables.len(),
        1,
        "gyros and attitude stay in one table"
    );
    assert_eq!(
        value(&recording, &Quantity::GyroRate, "x", 300).map(|rate| (rate * 1e6).round()),
        Some((truth[300].rate_rad_s[0] * 1e6).round())
    );
}
