//! `rlg import` of further files of loggers, viewers and evaluation boards, made new after their headers: preambles, spellings of
//! units and names, stamps in two columns, quaternions under any name.

use crate::import_headers::{
    Bench, Log, Published, ROWS, check, log, pasted, published, slow, truth, value, words,
};
use rlg::recording::Quantity;

const IMU_OF_ROS: &str = "%time,field.header.stamp,field.orientation.x,field.orientation.y,field.orientation.z,field.orientation.w,\
     field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,field.linear_acceleration.x,\
     field.linear_acceleration.y,field.linear_acceleration.z";

/// Files that go in without an option.
const FORMS: &[Published] = &[
    published(
        "Movella DOT, preamble and Euler angles",
        true,
        &[log(
            "dot.csv",
            "sep=,\nDeviceTag:,1\nFirmwareVersion:,2.0.0\n\nPacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,Acc_X,Acc_Y,Acc_Z,\
             Gyr_X,Gyr_Y,Gyr_Z",
            ",",
            "n t.us ex.deg ey.deg ez.deg fx fy fz wx.deg wy.deg wz.deg",
        )],
    ),
    published(
        "rostopic echo -p: an orientation that is empty beside a pose, stamps of the measurement",
        true,
        &[
            log(
                "imu.csv",
                IMU_OF_ROS,
                ",",
                "t.late t.ns 0 0 0 1 wx wy wz fx fy fz",
            ),
            log(
                "pose.csv",
                "%time,field.header.stamp,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,\
                 field.pose.orientation.w",
                ",",
                "t.late t.ns qx qy qz qw",
            ),
        ],
    ),
    published(
        "ROS geometry_msgs/TransformStamped: a rotation with w is a quaternion",
        true,
        &[
            log(
                "imu.csv",
                "t [s],gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s]",
                ",",
                "t wx wy wz",
            ),
            slow(
                2,
                log(
                    "vicon.csv",
                    "t [s],transform.rotation.x,transform.rotation.y,transform.rotation.z,transform.rotation.w",
                    ",",
                    "t qx qy qz qw",
                ),
            ),
        ],
    ),
    published(
        "ROS 2: stamps of seconds and nanoseconds",
        true,
        &[log(
            "imu.csv",
            "stamp.sec,stamp.nanosec,orientation.x,orientation.y,orientation.z,orientation.w,angular_velocity.x,angular_velocity.y,\
             angular_velocity.z,linear_acceleration.x,linear_acceleration.y,linear_acceleration.z",
            ",",
            "t.sec t.nanosec qx qy qz qw wx wy wz fx fy fz",
        )],
    ),
    published(
        "q0 to q3 with the scalar last, told by the gyros",
        true,
        &[log(
            "log.csv",
            "t (s),gx (rad/s),gy (rad/s),gz (rad/s),q0,q1,q2,q3",
            ",",
            "t wx wy wz qx qy qz qw",
        )],
    ),
    published(
        "OxIOD, attitude_roll(radians)",
        true,
        &[log(
            "imu.csv",
            "Time (s),attitude_roll(radians),attitude_pitch(radians),attitude_yaw(radians),gyro_x(radians/s),gyro_y(radians/s),\
             gyro_z(radians/s)",
            ",",
            "t ex ey ez wx wy wz",
        )],
    ),
    published(
        "Analog Devices evaluation, MATLAB's date-times",
        false,
        &[log(
            "data.csv",
            "Time,X_GYRO_OUT (deg/s),Y_GYRO_OUT (deg/s),Z_GYRO_OUT (deg/s),X_ACCL_OUT (g),Y_ACCL_OUT (g),Z_ACCL_OUT (g)",
            ",",
            "t.matlab wx.deg wy.deg wz.deg fx.g fy.g fz.g",
        )],
    ),
    published(
        "an acronym before the time, spellings of units",
        false,
        &[log(
            "log.csv",
            "GPSTime (sec),GyroX (degrees/second),GyroY (d/s),GyroZ (˚/s),AccX (m/s**2),AccY (meters/second^2),AccZ (m.s-2)",
            ",",
            "t wx.deg wy.deg wz.deg fx fy fz",
        )],
    ),
    published(
        "a column in ms that grows, raw before calibrated",
        false,
        &[log(
            "log.csv",
            "Laufzeit [ms],RawGyroX [deg/s],RawGyroY [deg/s],RawGyroZ [deg/s],GyroX [deg/s],GyroY [deg/s],GyroZ [deg/s]",
            ",",
            "t.ms 1 2 3 wx.deg wy.deg wz.deg",
        )],
    ),
    published(
        "Arduino: Micros, a footer",
        false,
        &[log(
            "log.csv",
            "Device,IMU 7\nSerial,4711\n\nMicros,GyroX (deg/s),GyroY (deg/s),GyroZ (deg/s)",
            ",",
            "t.us wx.deg wy.deg wz.deg",
        )],
    ),
    published(
        "a publisher's unit against gravity: Movella DOT without an orientation",
        false,
        &[log(
            "dot.csv",
            "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z",
            ",",
            "n t.us fx fy fz wx.deg wy.deg wz.deg",
        )],
    ),
];

#[test]
fn files_of_strangers_go_in_without_an_option() {
    let truth = truth(false);
    let mut failed = Vec::new();
    for form in FORMS {
        let bench = Bench::of(form.logs, &truth);
        let output = bench.import(form.logs, &[]);
        match output.status.code() {
            Some(0) => check(form.by, &bench.recording(), &truth, form.has_attitude),
            _ => failed.push(format!("{}: {}", form.by, words(&output))),
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// Imports by the command that a refusal offers.
fn by_paste(logs: &[Log], has_attitude: bool) {
    let truth = truth(false);
    let bench = Bench::of(logs, &truth);
    let asked = words(&bench.import(logs, &[]));
    let command = pasted(&asked);
    let output = bench.run(&command.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{asked}{}", words(&output));
    check(logs[0].head, &bench.recording(), &truth, has_attitude);
}

#[test]
fn unknown_names_come_with_a_command_that_works() {
    by_paste(
        &[log(
            "gyro.csv",
            "elapsed (s),x-axis (deg/s),y-axis (deg/s),z-axis (deg/s)",
            ",",
            "t wx.deg wy.deg wz.deg",
        )],
        false,
    );
    by_paste(
        &[log(
            "pqr.csv",
            "uhr,p (deg/s),q (deg/s),r (deg/s)",
            ",",
            "t wx.deg wy.deg wz.deg",
        )],
        false,
    );
}

#[test]
fn an_angle_of_an_unknown_name_that_follows_a_gyro_is_asked_for_with_its_axis() {
    let truth = truth(true);
    let logs = [log(
        "run.csv",
        "t [s],Gyro X [°/s],Gyro Y [°/s],Gyro Z [°/s],Position [deg],Winkel 2 [deg]",
        ",",
        "t wx.deg wy.deg wz.deg a 3.5",
    )];
    let bench = Bench::of(&logs, &truth);
    let command = pasted(&words(&bench.import(&logs, &[])));
    let output = bench.run(&command.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let recording = bench.recording();
    let turned = value(&recording, &Quantity::ReferenceIncrement, "z", ROWS / 2).expect("an angle");
    assert!(
        (turned * 100.0 - truth[ROWS / 2].rate_rad_s[2]).abs() < 1e-4,
        "{turned}"
    );
}

#[test]
fn utf_16_and_unused_ends_of_files_are_read() {
    let truth = truth(false);
    let logs = [log(
        "log.csv",
        "t (s)\tgx (°/s)\tgy (°/s)\tgz (°/s)",
        "\t",
        "t wx.deg wy.deg wz.deg",
    )];
    let bench = Bench::of(&logs, &truth);
    let file = bench.0.path().join("log.csv");
    let text = std::fs::read_to_string(&file).expect("a text");
    let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
    let wide: Vec<u8> = units.flat_map(u16::to_le_bytes).collect();
    let mut padded = text.clone().into_bytes();
    padded.resize(padded.len() + 5000, 0);
    for bytes in [wide, padded] {
        std::fs::write(&file, bytes).expect("a file");
        let output = bench.import(&logs, &[]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let recording = bench.recording();
        assert_eq!(recording.tables[0].rows, ROWS);
        check("log", &recording, &truth, false);
        std::fs::remove_dir_all(bench.0.path().join("out")).expect("a folder");
    }
}
