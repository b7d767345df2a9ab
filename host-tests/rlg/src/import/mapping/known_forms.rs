//! Lists forms of files with units documented by their publishers, so that no column needs `--map`.

use crate::import::files::columns::Block;

/// Form of a file, identified by its columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Its name.
    pub name: &'static str,
    /// Columns required, all of them.
    columns: &'static [&'static str],
    /// Target, and the unit of its columns.
    units: &'static [(&'static str, &'static str)],
}

/// The known forms.
const FORMS: [Form; 3] = [
    // Szczęsna et al. 2016, doi 10.1007/978-3-319-46418-3_45; its magnetometer is normalised.
    Form {
        name: "RepoIMU",
        columns: &[
            "Time (s)",
            "Vicon Orientation W",
            "IMU Acceleration X",
            "IMU Gyroscope X",
        ],
        units: &[("gyro_rate", "rad/s"), ("specific_force", "m/s^2")],
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
    },
];

impl Form {
    /// Returns the form of a file with these columns.
    pub fn of(block: &Block) -> Option<&'static Self> {
        let has = |name: &&str| block.columns.iter().any(|column| column.name == **name);
        FORMS.iter().find(|form| form.columns.iter().all(has))
    }

    /// Returns the unit of its columns of `target`; `time` is a target here.
    pub fn unit(&self, target: &str) -> Option<&'static str> {
        let found = self.units.iter().find(|(name, _)| *name == target);
        found.map(|(_, unit)| *unit)
    }
}
