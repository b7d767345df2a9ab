//! `rlg import` of tables of text: units, usual names, stamps, attitudes and encoders, and each refusal in one sentence.

use std::f64::consts::PI;
use std::fs;
use std::path::PathBuf;
use std::process::Output;

use assert_cmd::Command;
use rlg::model::{Model, MotionSource};
use rlg::recording::{Clock, Quantity, Recording, Table};
use tempfile::TempDir;

const DEG: f64 = PI / 180.0;

/// A folder with foreign files and the recording imported from one.
pub(super) struct Bench {
    folder: TempDir,
    name: String,
}

impl Bench {
    pub(super) fn new(name: &str, content: impl AsRef<[u8]>) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join(name), content).expect("a file");
        Self {
            folder,
            name: name.to_owned(),
        }
    }
    fn csv(content: impl AsRef<str>) -> Self {
        Self::new("log.csv", content.as_ref().as_bytes())
    }
    pub(super) fn file(&self) -> PathBuf {
        self.folder.path().join(&self.name)
    }
    pub(super) fn out(&self) -> PathBuf {
        self.folder.path().join("recording")
    }
    /// Diagnoses the import with the model written with it.
    pub(super) fn diagnosis(&self) -> serde_json::Value {
        let results = self.folder.path().join("results");
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.arg("diagnose").arg(self.out());
        command.arg("--model").arg(self.out().join("model.toml"));
        command.arg("--out").arg(&results);
        let output = command.output().expect("it runs");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let text = fs::read_to_string(results.join("diagnosis.json")).expect("a diagnosis");
        serde_json::from_str(&text).expect("JSON")
    }
    pub(super) fn import(&self, more: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(["import", "--json"]).arg(self.file());
        command.args(more).arg("--out").arg(self.out());
        command.output().expect("the command runs")
    }
    pub(super) fn imported(&self, more: &[&str]) -> (serde_json::Value, Recording) {
        let output = self.import(more);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words}");
        let result = serde_json::from_slice(&output.stdout).expect("JSON");
        (result, Recording::read(self.out()).expect("a recording"))
    }
    fn table(&self, more: &[&str]) -> Table {
        self.imported(more).1.tables.remove(0)
    }
    pub(super) fn is_refused(&self, more: &[&str], parts: &[&str]) {
        let output = self.import(more);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(words.starts_with("error: "), "{words}");
        if !words.contains("these guesses") {
            // One sentence, and the command that goes on where there is one.
            let is_command =
                |line: &str| line.starts_with("    rlg import") && line.ends_with(" --anyway");
            let [_, commands @ ..] = &words.lines().collect::<Vec<_>>()[..] else {
                panic!("nothing is said");
            };
            assert_eq!(
                commands.len(),
                usize::from(words.contains("; --anyway ")),
                "{words}"
            );
            assert!(commands.iter().all(|line| is_command(line)), "{words}");
        }
        for part in parts {
            assert!(words.contains(part), "no {part:?} in: {words}");
        }
        assert!(output.stdout.is_empty());
        assert!(!self.out().exists(), "something was left behind");
    }
}

pub(super) fn values<'a>(table: &'a Table, quantity: &Quantity, axis: &str) -> &'a [f64] {
    let channel = table.channel(quantity, axis);
    &channel
        .unwrap_or_else(|| panic!("no {} {axis}", quantity.name()))
        .values
}

fn close(found: f64, expected: f64) {
    let off = (found - expected).abs();
    assert!(
        off <= 1e-12 * expected.abs().max(1e-9),
        "{found} for {expected}"
    );
}

/// Makes a log at 100 Hz with gyros in deg/s and these additional columns, whose cells are the same in every row.
fn log(more: &str, cells: &str) -> String {
    let mut text = format!("t (s),gx (deg/s),gy (deg/s),gz (deg/s){more}\n");
    for row in 1..=4 {
        text.push_str(&format!(
            "{},{row},0,-{row}{cells}\n",
            f64::from(row) / 100.0
        ));
    }
    text
}

#[test]
fn each_unit_comes_out_in_si() {
    let gyro = |unit: &str, si: f64| {
        let text = "gx,gy,gz\n1,2,3\n4,5,6\n";
        let unit = format!("gyro_rate:{unit}");
        let table = Bench::csv(text).table(&["--rate", "10", "--unit", &unit]);
        close(values(&table, &Quantity::GyroRate, "y")[1], 5.0 * si);
    };
    gyro("deg/s", DEG);
    gyro("°/s", DEG);
    gyro("dps", DEG);
    gyro("deg/h", DEG / 3600.0);
    gyro("rad/s", 1.0);
    gyro("mrad/s", 1e-3);
    gyro("0.061*deg/s", 0.061 * DEG);
    let other = |column: &str, quantity: Quantity, unit: &str, axis: &str, si: f64| {
        let map = format!("{column}={}:{axis}:{unit}", quantity.name());
        let table = Bench::csv(log(&format!(",{column}"), ",2")).table(&["--map", &map]);
        let axis = (axis != "-").then_some(axis);
        let mut channels = table.channels.iter();
        let channel = channels
            .find(|channel| channel.quantity == quantity && channel.axis.as_deref() == axis);
        close(channel.expect("the channel").values[3], si);
    };
    let force = |unit: &str, si: f64| other("f", Quantity::SpecificForce, unit, "x", si);
    force("m/s^2", 2.0);
    force("m/s²", 2.0);
    force("g", 2.0 * 9.806_65);
    force("mg", 2e-3 * 9.806_65);
}

#[test]
fn fields_angles_and_temperatures_have_their_units_too() {
    let map = |column: &str, text: &str, cell: &str| {
        let bench = Bench::csv(log(&format!(",{column}"), &format!(",{cell}")));
        bench.table(&["--map", &format!("{column}={text}")])
    };
    let field = |unit: &str| {
        let table = map("b1", &format!("magnetic_field:z:{unit}"), "0.5");
        values(&table, &Quantity::MagneticField, "z")[0]
    };
    close(field("gauss"), 0.5e-4);
    close(field("G"), 0.5e-4);
    close(field("uT"), 0.5e-6);
    close(field("µT"), 0.5e-6);
    close(field("T"), 0.5);
    let kelvin = |unit: &str, cell: &str| {
        let table = map("heat", &format!("temperature:x:{unit}"), cell);
        values(&table, &Quantity::Temperature, "x")[0]
    };
    close(kelvin("F", "68"), 293.15);
    close(kelvin("C", "20"), 293.15);
    close(kelvin("K", "293.15"), 293.15);
    let angle = |unit: &str| {
        let table = map("r1", &format!("reference_increment:x:{unit}"), "0.01");
        values(&table, &Quantity::ReferenceIncrement, "x")[0]
    };
    close(angle("deg"), 0.01 * DEG);
    close(angle("rad"), 0.01);
    close(angle("mrad"), 1e-5);
    close(angle("arcsec"), 0.01 * DEG / 3600.0);
    close(angle("0.932*arcsec"), 0.01 * 0.932 * DEG / 3600.0);
}

#[test]
fn stamps_in_each_unit_of_time_are_one_clock() {
    for (unit, per_second) in [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        let mut text = format!("time_{unit},gx_dps,gy_dps,gz_dps\n");
        for row in 0..50 {
            text.push_str(&format!(
                "{},1,2,3\n",
                (7.0 + f64::from(row) * 0.004) * per_second
            ));
        }
        let Clock::Uniform { rate_hz, start_s } = Bench::csv(text).table(&[]).clock else {
            panic!("a uniform clock");
        };
        assert_eq!(rate_hz, 250.0, "{unit}");
        // The stamp is the end of row 0.
        assert!((start_s - 6.996).abs() < 1e-9, "{unit}: {start_s}");
    }
}

#[test]
fn usual_names_are_known_and_the_rest_is_named_as_left_out() {
    let headers = [
        "t (s),gx (deg/s),gy (deg/s),gz (deg/s)",
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s)",
        "timestamp [s],gyro_x [°/s],gyro_y [°/s],gyro_z [°/s]",
        "time_s,gyr_x_dps,gyr_y_dps,gyr_z_dps",
        "t_s,wx_deg_s,wy_deg_s,wz_deg_s",
        "Time[s],omega_x[deg/s],omega_y[deg/s],omega_z[deg/s]",
        "time (s),imu_gyr[0] (deg/s),imu_gyr[1] (deg/s),imu_gyr[2] (deg/s)",
        "time (s),gyro1 (deg/s),gyro2 (deg/s),gyro3 (deg/s)",
        "time (s),angularVelocityX (deg/s),angularVelocityY (deg/s),angularVelocityZ (deg/s)",
        "stamp_s,imu.angular_velocity.x (deg/s),imu.angular_velocity.y (deg/s),imu.angular_velocity.z (deg/s)",
    ];
    let rows = "0.01,1,2,3\n0.02,1,2,3\n0.03,1,2,3\n";
    for header in headers {
        let table = Bench::csv(format!("{header}\n{rows}")).table(&[]);
        let z = values(&table, &Quantity::GyroRate, "z");
        close(z[2], 3.0 * DEG);
        assert_eq!(table.rows, 3, "{header}");
    }
    let more =
        ",accX (g),accY (g),accZ (g),temp (°C),mag_x_uT,mag_y_uT,mag_z_uT,qw,qx,qy,qz,battery,note";
    let bench = Bench::csv(log(more, ",0,0,1,20,1,2,3,1,0,0,0,3.7,ok"));
    let (result, recording) = bench.imported(&[]);
    let table = &recording.tables[0];
    close(values(table, &Quantity::SpecificForce, "z")[0], 9.806_65);
    close(values(table, &Quantity::MagneticField, "y")[0], 2e-6);
    close(values(table, &Quantity::ReferenceAttitude, "w")[0], 1.0);
    let temperature = table
        .channels
        .iter()
        .find(|channel| channel.quantity == Quantity::Temperature);
    close(temperature.expect("a temperature").values[0], 293.15);
    let left: Vec<&str> = result["left_out"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|left| left["column"].as_str())
        .collect();
    assert_eq!(left, ["battery", "note"]);
    let manifest = fs::read_to_string(bench.out().join("recording.toml")).expect("a text");
    assert!(
        manifest.contains("#   az: specific_force z <- accZ (g) [g]"),
        "{manifest}"
    );
    assert!(manifest.contains("left out: battery"), "{manifest}");
}

#[test]
fn a_capital_t_may_be_a_temperature() {
    let rows = "0.01,20,1,2,3\n0.02,21,4,5,6\n";
    let table = Bench::csv(format!("time (s),T (°C),gx_dps,gy_dps,gz_dps\n{rows}")).table(&[]);
    let mut channels = table.channels.iter();
    let temperature = channels.find(|channel| channel.quantity == Quantity::Temperature);
    close(temperature.expect("a temperature").values[1], 294.15);
}

#[test]
fn delimiters_comments_decimal_commas_and_lines_of_units_are_read() {
    let forms = [
        "# a logger\n# Rate: 100.0 Hz\ngx;gy;gz\ndeg/s;deg/s;deg/s\n1,5;2;3\n1,5;;3\n",
        "// Update Rate: 100.0Hz\r\ngx (dps)\tgy (dps)\tgz (dps)\r\n1,5\t2\t3\r\n1.5\tnan\t3\r\n",
        "% rate 100 Hz\ngx_dps gy_dps gz_dps\n  1.5  2   3\n 1.5 NaN 3\n",
        "device,XY\n\n# sampling: 100 Hz\n\"gx (deg/s)\",\"gy (deg/s)\",\"gz (deg/s)\"\n\"1.5\",\"2\",3,\n1.5,-nan(ind),3,\n",
        "# rate: 100 Hz\nGyro;;;\nx (deg/s);y (deg/s);z (deg/s);\n1,5;2;3;\n1,5;N/A;3;\n",
        "# sampled at 100 Hz\n# gx_dps,gy_dps,gz_dps\n1.5,2,3\n1.5,null,3\n",
    ];
    for text in forms {
        let table = Bench::csv(text).table(&[]);
        let clock = Clock::Uniform {
            rate_hz: 100.0,
            start_s: 0.0,
        };
        assert_eq!((table.rows, &table.clock), (2, &clock), "{text}");
        close(values(&table, &Quantity::GyroRate, "x")[0], 1.5 * DEG);
        let y = values(&table, &Quantity::GyroRate, "y");
        assert!(!y[0].is_nan() && y[1].is_nan(), "{text}");
    }
    // A degree sign of Latin-1, which is not UTF-8.
    let mut latin = b"gx (\xB0/s),gy (\xB0/s),gz (\xB0/s)\n1,2,3\n4,5,6\n".to_vec();
    let table = Bench::new("log.csv", &latin).table(&["--rate", "10"]);
    close(values(&table, &Quantity::GyroRate, "z")[1], 6.0 * DEG);
    latin.extend(b"7,8");
    let (result, recording) = Bench::new("log.csv", &latin).imported(&["--rate-hz", "10"]);
    assert_eq!(recording.tables[0].rows, 2);
    assert!(
        result["notes"][0]
            .as_str()
            .expect("a note")
            .contains("line 4, cut short")
    );
}

#[test]
fn a_skip_in_the_stamps_is_rows_that_were_not_measured() {
    let mut text = "t_ms,gx_dps,gy_dps,gz_dps\n".to_owned();
    // 300 Hz in whole milliseconds: steps of 3 and 4.
    for row in (0..300_u32).filter(|row| !(100..103).contains(row)) {
        text.push_str(&format!("{},{row},0,0\n", (f64::from(row) / 0.3).round()));
    }
    let table = Bench::csv(text).table(&[]);
    let Clock::Uniform { rate_hz, .. } = table.clock else {
        panic!("a uniform clock");
    };
    assert!((rate_hz - 300.0).abs() < 0.5, "{rate_hz}");
    assert_eq!(table.rows, 300);
    let x = values(&table, &Quantity::GyroRate, "x");
    assert!(x[100..103].iter().all(|rate| rate.is_nan()));
    close(x[103], 103.0 * DEG);
}

#[test]
fn uneven_stamps_of_gyros_are_refused_and_a_rate_is_the_way_out() {
    let text = |jitter: f64| {
        let mut text = "t (s),gx (deg/s),gy (deg/s),gz (deg/s),qw,qx,qy,qz\n".to_owned();
        for row in 0..100 {
            let late = if row == 37 { jitter } else { 0.0 };
            let stamp = f64::from(row) * 0.01 + late;
            text.push_str(&format!("{stamp:.5},{row},0,0,1,0,0,0\n"));
        }
        text
    };
    let bench = Bench::csv(text(0.0071));
    bench.is_refused(
        &[],
        &["log.csv, t (s), row 37", "0.3771 s, 0.71 rows", "--rate HZ"],
    );
    let table = bench.table(&["--rate", "100"]);
    assert_eq!(table.rows, 100);
    let wrong = ["--rate", "90"];
    Bench::csv(text(0.0071)).is_refused(&wrong, &["does not fit --rate", "usual step is 0.0"]);
}

#[test]
fn a_fill_value_is_a_row_without_a_measurement() {
    let mut text = "t (s),gx (deg/s),gy (deg/s),gz (deg/s)\n".to_owned();
    for row in 0..200 {
        let gx = if row % 40 == 7 {
            -9999.0
        } else {
            30.0 * (0.1 * f64::from(row)).sin()
        };
        text.push_str(&format!(
            "{:.2},{gx:.4},0.{row},-0.{row}\n",
            f64::from(row) * 0.01
        ));
    }
    let (result, recording) = Bench::csv(text).imported(&[]);
    let note = result["notes"][0].as_str().expect("a note");
    assert!(
        note.contains("gx (deg/s): -9999 in 5 rows is a fill value"),
        "{note}"
    );
    let rates = values(&recording.tables[0], &Quantity::GyroRate, "x");
    assert_eq!(rates.iter().filter(|value| value.is_nan()).count(), 5);
    assert!(
        rates
            .iter()
            .all(|value| value.is_nan() || value.abs() < 1.0)
    );
}

#[test]
fn gyros_by_uneven_stamps_are_read_off_the_even_clock() {
    let mut text =
        "t (s),gx (deg/s),gy (deg/s),gz (deg/s),dvx (m/s),temp (C),qw,qx,qy,qz\n".to_owned();
    let stamp = |row: u32| f64::from(row) * 0.01 + 0.003 * f64::from(row * row % 7) / 7.0;
    let mut turned_deg = 0.0;
    // A gap of five rows, and means over rows of a rate that grows with time.
    for row in (1..=300_u32).filter(|row| !(150..155).contains(row)) {
        let (from, to) = (stamp(row - 1), stamp(row));
        let mean = 5.0 * (from + to);
        turned_deg += mean * (to - from);
        text.push_str(&format!(
            "{to:.6},3,{mean:.9},0,{:.9},25,1,0,0,0\n",
            2.0 * (to - from)
        ));
    }
    let bench = Bench::csv(text);
    let (result, recording) = bench.imported(&[]);
    let note = result["notes"][0].as_str().expect("a note");
    assert!(
        note.contains("t (s) are uneven") && note.contains("--rate HZ"),
        "{note}"
    );
    let table = &recording.tables[0];
    let period_s = table.clock.period_s(table.rows);
    assert!(
        (period_s - 0.01).abs() < 1e-5 && table.rows == 300,
        "{period_s}, {}",
        table.rows
    );
    let x = values(table, &Quantity::GyroRate, "x");
    let missing = x.iter().filter(|rate| rate.is_nan()).count();
    assert!((5..=6).contains(&missing), "{missing}");
    for rate in x.iter().filter(|rate| !rate.is_nan()) {
        close(*rate, 3.0 * DEG);
    }
    for (row, dv) in values(table, &Quantity::VelocityIncrement, "x")
        .iter()
        .enumerate()
        .skip(1)
    {
        assert!(
            dv.is_nan() || row == 154 || (dv / period_s - 2.0).abs() < 1e-3,
            "{row}: {dv}"
        );
    }
    let y = values(table, &Quantity::GyroRate, "y");
    let sum: f64 = y.iter().filter(|rate| !rate.is_nan()).sum::<f64>() * period_s;
    // In the rows left out at the gap the rotation is at 15 deg/s for less than 0.02 s.
    assert!((sum / DEG - turned_deg).abs() < 0.4, "{sum} {turned_deg}");
    assert!(matches!(recording.tables[1].clock, Clock::Stamped { .. }));
    assert_eq!(recording.tables[1].rows, 295);
    let pulses = Bench::csv("t (s),px,py,pz\n0,1,1,1\n0.01,1,1,1\n0.023,1,1,1\n0.03,1,1,1\n");
    let maps = [
        "--map",
        "px=gyro_count:x:arcsec",
        "py=gyro_count:y:arcsec",
        "pz=gyro_count:z:arcsec",
    ];
    pulses.is_refused(&maps, &["counts pulses over uneven rows", "gyro_increment"]);
}

#[test]
fn attitudes_may_keep_stamps_of_their_own() {
    let mut text = "t (s),gx (deg/s),gy (deg/s),gz (deg/s),t_ref,qw,qx,qy,qz\n".to_owned();
    for row in 0..100 {
        let stamp = f64::from(row) * 0.01;
        let late = 0.5 + stamp + 0.004 * f64::from(row * row % 7) / 7.0;
        text.push_str(&format!("{stamp},{row},0,0,{late:.6},0,1,0,0\n"));
    }
    let bench = Bench::csv(text);
    let times = ["--time", "t (s):s", "t_ref:s:reference_attitude"];
    let (_, recording) = bench.imported(&times);
    assert_eq!(recording.tables.len(), 2);
    let Clock::Stamped { stamps_s, .. } = &recording.tables[1].clock else {
        panic!("stamps");
    };
    assert!((stamps_s[0] - 0.5).abs() < 1e-9);
    close(
        values(&recording.tables[1], &Quantity::ReferenceAttitude, "x")[5],
        1.0,
    );
}

#[test]
fn gyros_and_reference_may_come_in_two_files() {
    let bench = Bench::csv(log("", ""));
    let other = bench.file().with_file_name("reference.csv");
    let rows = "0.02,1,0,0,0\n0.04,1,0,0,0\n0.06,1,0,0,0\n";
    fs::write(&other, format!("time (s),q0,q1,q2,q3\n{rows}")).expect("a file");
    let other = other.to_string_lossy().into_owned();
    let (_, recording) = bench.imported(&[&other]);
    let rates: Vec<_> = recording
        .tables
        .iter()
        .map(|table| table.clock.period_s(table.rows))
        .collect();
    assert_eq!(rates, [0.01, 0.02]);
    let model = Model::read(bench.out().join("model.toml")).expect("a model");
    assert_eq!(model.motion, MotionSource::Reference);
}

#[test]
fn quaternions_come_in_any_order_and_sense_and_as_euler_angles() {
    let half = (30.0 * DEG / 2.0).sin_cos();
    let cells = format!(",0,0,{},{}", half.0, half.1);
    let bench = Bench::csv(log(",a0,b0,c0,d0", &cells));
    let map = |quantity: &str| {
        let letters = ["a0", "b0", "c0", "d0"].iter().zip(["x", "y", "z", "w"]);
        letters
            .map(|(column, axis)| format!("{column}={quantity}:{axis}"))
            .collect::<Vec<_>>()
    };
    let read = |quantity: &str| {
        let map = map(quantity);
        let mut more = vec!["--map"];
        more.extend(map.iter().map(String::as_str));
        let table = bench.table(&more);
        ["w", "x", "y", "z"].map(|axis| values(&table, &Quantity::ReferenceAttitude, axis)[1])
    };
    let [w, _, _, z] = read("reference_attitude");
    close(w, half.1);
    close(z, half.0);
    let [w, _, _, z] = read("reference_attitude_inverse");
    close(w, half.1);
    close(z, -half.0);
    let bench = Bench::csv(log(",roll,pitch,yaw", ",0,0,30"));
    let angles = [
        "roll=reference_euler:x:deg",
        "pitch=reference_euler:y:deg",
        "yaw=reference_euler:z:deg",
    ];
    let more = [&["--map"][..], &angles[..]].concat();
    bench.is_refused(&more, &["Euler angles of an unknown sequence", "--euler"]);
    let table = bench.table(&[&more[..], &["--euler", "zyx"]].concat());
    close(values(&table, &Quantity::ReferenceAttitude, "z")[1], half.0);
    Bench::csv(log(",qw,qx,qy,qz", ",1,1,0,0"))
        .is_refused(&[], &["qw, qx, qy, qz, row 0", "no unit quaternion"]);
    let table = Bench::csv(log(",qw,qx,qy,qz", ",0,0,0,0").replacen(",0,0,0,0\n", ",1,0,0,0\n", 1))
        .table(&[]);
    let w = values(&table, &Quantity::ReferenceAttitude, "w");
    assert!(w[0] == 1.0 && w[1].is_nan(), "zeros are not measured");
}

#[test]
fn attitudes_of_the_other_sense_are_pointed_out() {
    let text = |sense: f64| {
        let mut text = "t (s),gx (rad/s),gy (rad/s),gz (rad/s),qw,qx,qy,qz\n".to_owned();
        for row in 0..200 {
            let t = f64::from(row) / 100.0;
            let (sine, cosine) = (t * t / 2.0).sin_cos();
            let rate = 2.0 * (t - 0.005);
            text.push_str(&format!("{t},0,0,{rate},{cosine},0,0,{}\n", sense * sine));
        }
        text
    };
    let notes = |sense: f64| Bench::csv(text(sense)).imported(&[]).0["notes"].clone();
    assert_eq!(notes(1.0).as_array().map(Vec::len), Some(0));
    let note = notes(-1.0)[0].as_str().expect("a note").to_owned();
    assert!(note.contains("reference_attitude_inverse"), "{note}");
}

#[test]
fn an_encoder_is_unwrapped_and_differenced() {
    let mut text = "t (s),gx (deg/s),gy (deg/s),gz (deg/s),encoder_z (deg)\n".to_owned();
    for (row, angle) in [350.0, 355.0, 0.0, 5.0, 3.0].iter().enumerate() {
        text.push_str(&format!("{},0,0,0,{angle}\n", row as f64 / 100.0));
    }
    let bench = Bench::csv(text);
    let (result, recording) = bench.imported(&[]);
    let turned = values(&recording.tables[0], &Quantity::ReferenceIncrement, "z");
    assert!(turned[0].is_nan(), "no angle before the first row");
    for (found, expected) in turned[1..].iter().zip([5.0, 5.0, 5.0, -2.0]) {
        assert!((found - expected * DEG).abs() < 1e-12, "{found}");
    }
    let still = values(&recording.tables[0], &Quantity::ReferenceIncrement, "x");
    assert_eq!(still[1], 0.0);
    assert!(
        result["notes"][0]
            .as_str()
            .expect("a note")
            .contains("only one encoder")
    );
}

#[test]
fn pulses_keep_their_count_and_their_weight_goes_to_the_model() {
    let text = "px,py,pz,ref_rate_x (deg/s),ref_rate_y (deg/s),ref_rate_z (deg/s)\n1,2,3,0,0,1\n4,5,6,0,0,1\n";
    let bench = Bench::csv(text);
    let maps = [
        "px=gyro_count:x:0.9*arcsec",
        "py=gyro_count:y:0.9*arcsec",
        "pz=gyro_count:z:0.9*arcsec",
    ];
    let more = [&["--rate", "50", "--map"][..], &maps[..]].concat();
    let table = bench.table(&more);
    assert_eq!(values(&table, &Quantity::GyroCount, "z"), [3.0, 6.0]);
    close(
        values(&table, &Quantity::ReferenceIncrement, "z")[0],
        DEG / 50.0,
    );
    let model = Model::read(bench.out().join("model.toml")).expect("a model");
    close(model.gyro.pulse_weight_rad[2], 0.9 * DEG / 3600.0);
    let broken = Bench::csv(text.replace("\n4,", "\n4.5,"));
    broken.is_refused(
        &more,
        &["log.csv, px, row 1", "whole number of pulses", "found 4.5"],
    );
}

#[test]
fn what_is_not_known_is_asked_for() {
    let plain = "gx,gy,gz\n1,2,3\n4,5,6\n";
    Bench::csv(plain).is_refused(
        &["--rate", "10"],
        &[
            "log.csv: needs one answer",
            "gx, gy, gz: is taken for gyro_rate, but its unit stands nowhere",
            "--unit gyro_rate:rad/s",
            "the greatest is 6",
        ],
    );
    Bench::csv(plain).is_refused(
        &["--unit", "gyro_rate:deg/s"],
        &["when its rows were taken", "--rate HZ"],
    );
    let timed = "t,gx_dps,gy_dps,gz_dps\n1,1,2,3\n2,4,5,6\n";
    Bench::csv(timed).is_refused(&[], &["t: is a time whose unit", "--time t:ms"]);
    let bare = "1,2,3\n4,5,6\n";
    Bench::csv(bare).is_refused(
        &["--rate", "10"],
        &["gyro x, y, z", "--map COLUMN=gyro_rate", "1, 2, 3"],
    );
    Bench::new("log.bin", bare)
        .is_refused(&[], &["extension that tells no format", "--format csv"]);
    let table = Bench::csv(bare).table(&[
        "--rate",
        "10",
        "--map",
        "1=gyro_rate:x:deg/s",
        "2=gyro_rate:y:deg/s",
        "3=gyro_rate:z:deg/s",
    ]);
    close(values(&table, &Quantity::GyroRate, "y")[0], 2.0 * DEG);
}

#[test]
fn a_map_that_cannot_be_is_refused() {
    let refuse = |map: &str, parts: &[&str]| {
        Bench::csv(log(",extra", ",1")).is_refused(&["--map", map], parts);
    };
    refuse(
        "extra",
        &["--map", "\"extra\"", "COLUMN=QUANTITY:AXIS:UNIT"],
    );
    refuse(
        "other=gyro_rate:x:deg/s",
        &["--map other", "no such column", "extra"],
    );
    refuse(
        "extra=gyro_rate:q:deg/s",
        &["gyro_rate cannot have this axis", "x, y or z"],
    );
    refuse(
        "extra=specific_force:x:deg/s",
        &["log.csv, extra", "no unit of specific_force", "m/s^2"],
    );
    refuse("extra=specific_force:x", &["extra", "unit stands nowhere"]);
    refuse(
        "extra=reference_attitude:w",
        &["an attitude that is not whole", "reference_attitude x"],
    );
    let twice = [
        "--map",
        "extra=specific_force:x:g",
        "gz (deg/s)=specific_force:x:g",
    ];
    Bench::csv(log(",extra", ",1"))
        .is_refused(&twice, &["another column is mapped to", "of extra"]);
    let unit = ["--unit", "gyro_rate"];
    Bench::csv(log("", "")).is_refused(&unit, &["--unit", "QUANTITY:UNIT"]);
    let time = ["--time", "extra:deg/s"];
    Bench::csv(log(",extra", ",1")).is_refused(&time, &["no unit of time", "s, ms, us, ns"]);
    let euler = ["--euler", "zzx"];
    Bench::csv(log("", "")).is_refused(&euler, &["--euler", "x, y and z once each"]);
    let frames = ["--format", "frames", "--map", "a=gyro_rate:x:deg/s"];
    Bench::csv(log("", "")).is_refused(&frames, &["no columns with names"]);
}

#[test]
fn damage_is_named_with_its_row() {
    let text = log("", "");
    let refuse = |from: &str, to: &str, parts: &[&str]| {
        Bench::csv(text.replacen(from, to, 1)).is_refused(&[], parts);
    };
    refuse(
        "0.03,3,0,-3",
        "0.03,three,0,-3",
        &["log.csv, gx (deg/s), row 2", "\"three\"", "a number"],
    );
    refuse(
        "0.03,3,0,-3",
        "0.03,inf,0,-3",
        &["gx (deg/s), row 2", "infinite"],
    );
    refuse(
        "0.03,3,0,-3",
        "0.03,3,0",
        &["line 4, row 2", "3 cells", "4 cells"],
    );
    refuse(
        "0.03,3,0,-3",
        "0.02,3,0,-3",
        &["t (s), row 2", "does not go on", "after 0.02 s"],
    );
    refuse("0.03,3,0,-3", ",3,0,-3", &["t (s), row 2", "no time"]);
    refuse("0.03,3,0,-3", "\n0.03,3,0,-3", &["line 4", "blank line"]);
    refuse("gx (deg/s)", "gx (g)", &["gx (g)", "unit stands nowhere"]);
    Bench::csv("").is_refused(&[], &["no row of numbers"]);
    Bench::csv("a,b\nc,d\n").is_refused(&[], &["no row of numbers", "2 lines"]);
    Bench::new("log.csv", b"a\0b").is_refused(&[], &["zero bytes", "--format mat|hdf5|parquet"]);
    let fast = text.replace("deg/s", "rad/s").replace(",-", ",-90");
    Bench::csv(fast).is_refused(&[], &["cannot be in rad/s", "ten revolutions"]);
}

#[test]
fn a_unit_at_rest_takes_its_site() {
    let bench = Bench::csv(log("", ""));
    let words = String::from_utf8_lossy(&bench.import(&[]).stderr).into_owned();
    assert!(words.contains("no reference and no [site]"), "{words}");
    let (_, recording) = bench.imported(&["--latitude-deg", "48", "--gravity", "9.81"]);
    assert!(recording.site.is_some());
    let model = Model::read(bench.out().join("model.toml")).expect("a model");
    assert_eq!(model.motion, MotionSource::Static);
}

#[test]
fn a_parquet_table_is_read_by_its_names_and_the_same_file_gives_the_same_bytes() {
    let bench = Bench::csv(log("", ""));
    bench.imported(&["--map", "gx (deg/s)=gyro_rate:x:deg/s"]);
    let table = fs::read(bench.out().join("samples.parquet")).expect("a table");
    let again = Bench::new("table.parquet", &table);
    let more = ["--rate", "100", "--unit", "gyro_rate:rad/s"];
    let (result, _) = again.imported(&more);
    assert_eq!(result["channels"].as_array().expect("a list").len(), 3);
    let read = || {
        ["recording.toml", "model.toml", "samples.parquet"]
            .map(|name| fs::read(again.out().join(name)).expect("a file"))
    };
    let first = read();
    again.imported(&more);
    assert_eq!(read(), first);
    Bench::new("table.parquet", &table[..table.len() / 2])
        .is_refused(&more, &["truncated or damaged"]);
}

#[test]
fn rlg_diagnose_runs_on_what_was_imported() {
    let mut text = "t (s),gx (deg/s),gy (deg/s),gz (deg/s),ref_rate_x (deg/s),ref_rate_y (deg/s),ref_rate_z (deg/s)\n".to_owned();
    let mut noise = 1_u64;
    let mut next = || {
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (noise >> 40) as f64 / 16_777_216.0 - 0.5
    };
    for row in 0..2000 {
        let t = f64::from(row) / 100.0;
        let rate = [0.7, 1.1, 1.7].map(|hz: f64| 20.0 * (2.0 * PI * hz * t).sin());
        text.push_str(&format!("{t:.2}"));
        rate.iter()
            .for_each(|rate| text.push_str(&format!(",{:.4}", rate + 0.1 * next())));
        rate.iter()
            .for_each(|rate| text.push_str(&format!(",{rate:.4}")));
        text.push('\n');
    }
    let bench = Bench::csv(text);
    bench.imported(&[]);
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command
        .arg("diagnose")
        .arg(bench.out())
        .arg("--model")
        .arg(bench.out().join("model.toml"));
    let output = command
        .arg("--out")
        .arg(bench.folder.path().join("found"))
        .output()
        .expect("it runs");
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Returns the lines of a page that import files with columns, or export recordings.
fn imports(page: &str) -> Vec<String> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(page);
    let text = fs::read_to_string(path).expect("a page");
    let code = text.split('`').flat_map(str::lines).map(str::trim);
    let is_command = |line: &&str| {
        let names = ["rlg import ", "rlg export "];
        names.iter().any(|name| line.starts_with(name)) && !line.contains("FILE")
    };
    let lines = code.filter(is_command);
    lines
        .map(|line| {
            line.split(" #")
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        })
        .collect()
}

#[test]
fn the_imports_on_the_pages_run() {
    let bench = Bench::csv(log("", ""));
    let folder = bench.folder.path();
    fs::write(
        folder.join("plain.csv"),
        "t,gx,gy,gz\n10,1,2,3\n20,4,5,6\n30,7,8,9\n",
    )
    .expect("a file");
    fs::write(
        folder.join("reference.csv"),
        "t (s),qw,qx,qy,qz\n0.01,1,0,0,0\n0.03,1,0,0,0\n",
    )
    .expect("a file");
    fs::write(folder.join("run.mat"), super::import_matrices::run()).expect("a file");
    let lines: Vec<String> = ["README.md", "docs/import.md"]
        .into_iter()
        .flat_map(imports)
        .collect();
    assert_eq!(lines.len(), 7, "{lines:?}");
    for line in lines {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command
            .args(line.split_whitespace().skip(1))
            .current_dir(folder);
        let output = command.output().expect("it runs");
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}: {words}");
    }
}
