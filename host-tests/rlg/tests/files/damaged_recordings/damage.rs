//! Makes small recordings, and damages their files.
//!
//! Any bytes select a recording and its damage: [`Files`] with `recording.toml`, `model.toml` and tables, to be written into
//! a folder. The same bytes give the same files. Shared by the test in this folder and by the fuzz target of
//! `host-tests/fuzz`.
//!
//! Out of scope: judgement. A recording may stay intact.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use rlg::recording::Recording;

/// A folder's files by name.
pub type Files = Vec<(String, Vec<u8>)>;

/// Rows per second, and rows: five seconds, of which three and a half are fitted.
const RATE_HZ: f64 = 200.0;
const ROWS: usize = 1000;

/// One pulse [rad].
const PULSE_RAD: f64 = 2e-6;

/// Rows per second of attitude and temperature.
const SLOW_HZ: f64 = 10.0;

/// Critical numbers: signs, limits of f64 and of a counter, no number, another row's rate.
const NUMBERS: [&str; 20] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e300",
    "-1e300",
    "1e-300",
    "5e-324",
    "1e18",
    "4294967296",
    "2147483647",
    "199.99",
    "0.5",
    "1e9",
    "1e-9",
    "",
    "3.5",
];

/// Returns the undamaged recordings and models.
pub fn whole() -> &'static [Files] {
    static WHOLE: OnceLock<Vec<Files>> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let moving = with_reference();
        let packed = packed(&moving);
        vec![moving, packed, at_rest(), with_attitude()]
    })
}

/// Writes the files into `folder`.
pub fn write(files: &Files, folder: &Path) {
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes).expect("a temporary folder takes files");
    }
}

/// Returns files damaged by `data`: the first byte selects the recording, then each damage takes a few bytes.
pub fn damaged(data: &[u8]) -> Files {
    let mut bytes = Bytes(data);
    let mut files = whole()[bytes.below(whole().len())].clone();
    while !bytes.0.is_empty() {
        // Two damages of three are in the tables, which hold most of the data.
        let file = match bytes.below(6) {
            0 => 0,
            1 => 1,
            other => other.min(files.len() - 1).max(2),
        };
        let kind = bytes.below(16);
        let (name, content) = &mut files[file];
        let text = !name.ends_with(".parquet");
        let table = name.ends_with(".csv");
        match kind {
            8.. if table => change_column(content, &mut bytes),
            7.. if text => keep_rows(content, &mut bytes),
            6 if text => swap_words(content, &mut bytes),
            4.. if text => change_number(content, &mut bytes),
            3 => {
                let at = bytes.below(content.len() + 1);
                let copy = content[at..(at + bytes.below(64)).min(content.len())].to_vec();
                let to = bytes.below(content.len() + 1);
                content.splice(to..to, copy);
            }
            2 => {
                let at = bytes.below(content.len() + 1);
                let end = (at + bytes.below(64)).min(content.len());
                content.drain(at..end);
            }
            1 => content.truncate(bytes.below(content.len() + 1)),
            _ => {
                let at = bytes.below(content.len().max(1));
                let new = bytes.one();
                if let Some(byte) = content.get_mut(at) {
                    *byte = new;
                }
            }
        }
    }
    files
}

/// Bytes taken one after the other; zero once they are used up.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn one(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    /// Returns a number below `count`, from as many bytes as it needs.
    fn below(&mut self, count: usize) -> usize {
        let mut number = usize::from(self.one());
        let mut most = 256;
        while most < count {
            number = number << 8 | usize::from(self.one());
            most <<= 8;
        }
        number % count
    }

    fn number(&mut self) -> &'static str {
        NUMBERS[self.below(NUMBERS.len())]
    }
}

/// Returns begin and end of the runs of bytes accepted by `is`.
fn runs(content: &[u8], is: impl Fn(u8) -> bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut begin = None;
    for (at, byte) in content.iter().copied().chain([b'\n']).enumerate() {
        match (begin, is(byte) && at < content.len()) {
            (None, true) => begin = Some(at),
            (Some(from), false) => {
                found.push((from, at));
                begin = None;
            }
            _ => {}
        }
    }
    found
}

/// Replaces one number of a text by a critical one.
fn change_number(content: &mut Vec<u8>, bytes: &mut Bytes) {
    let numbers = runs(content, |byte| {
        byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+' | b'e')
    });
    if let Some(&(begin, end)) = numbers.get(bytes.below(numbers.len().max(1))) {
        content.splice(begin..end, bytes.number().bytes());
    }
}

/// Replaces one word of a text by another: channels, axes, quantities, files are exchanged.
fn swap_words(content: &mut Vec<u8>, bytes: &mut Bytes) {
    let words = runs(content, |byte| byte.is_ascii_alphabetic() || byte == b'_');
    let from = bytes.below(words.len().max(1));
    let to = bytes.below(words.len().max(1));
    if let (Some(&(a, b)), Some(&(c, d))) = (words.get(from), words.get(to)) {
        let word = content[a..b].to_vec();
        content.splice(c..d, word);
    }
}

/// Changes one column of a table of text: all its rows or a stretch of them.
fn change_column(content: &mut Vec<u8>, bytes: &mut Bytes) {
    let Ok(text) = std::str::from_utf8(content) else {
        return;
    };
    let mut rows: Vec<Vec<String>> = text
        .lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    let column = bytes.below(rows[0].len());
    let (number, how) = (bytes.number(), bytes.below(4));
    let begin = 1 + bytes.below(rows.len());
    let end = if how == 0 {
        rows.len()
    } else {
        begin + bytes.below(300)
    };
    for (place, row) in rows
        .iter_mut()
        .enumerate()
        .skip(if how == 0 { 1 } else { begin })
    {
        if place >= end {
            break;
        }
        if let Some(cell) = row.get_mut(column) {
            *cell = match how {
                // Twice the same sign and size: a value stuck, dead or missing.
                0 | 1 => number.to_owned(),
                2 => format!("{}", place % 7),
                _ => format!("-{cell}"),
            };
        }
    }
    let text: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    *content = (text.join("\n") + "\n").into_bytes();
}

/// Keeps the first lines of a text.
fn keep_rows(content: &mut Vec<u8>, bytes: &mut Bytes) {
    let keep = bytes.below(ROWS + 1);
    let end = content
        .iter()
        .enumerate()
        .filter(|(_, byte)| **byte == b'\n')
        .nth(keep)
        .map_or(content.len(), |(at, _)| at + 1);
    content.truncate(end);
}

/// Reproducible scatter of about one.
fn scatter(row: usize, channel: usize) -> f64 {
    let mut state = (row as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (channel as u64) << 32;
    state = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    state = (state ^ state >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    3.4 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
}

fn rate_rad_s(axis: usize, time_s: f64) -> f64 {
    0.05 * (TAU * (0.7 + 0.2 * axis as f64) * time_s + axis as f64).sin()
}

fn channels(list: &[(&str, &str, &str)]) -> String {
    let mut text = String::new();
    for (column, quantity, axis) in list {
        let _ = writeln!(
            text,
            "  [[table.channel]]\n  column = \"{column}\"\n  quantity = \"{quantity}\""
        );
        if !axis.is_empty() {
            let _ = writeln!(text, "  axis = \"{axis}\"");
        }
    }
    text
}

const XYZ: [&str; 3] = ["x", "y", "z"];

fn triad(stem: &'static str, quantity: &'static str) -> String {
    let columns = XYZ.map(|axis| format!("{stem}{axis}"));
    let list: Vec<(&str, &str, &str)> = columns
        .iter()
        .zip(XYZ)
        .map(|(column, axis)| (column.as_str(), quantity, axis))
        .collect();
    channels(&list)
}

/// Columns of the gyros' table with dither: counts, pickoff, reference, force.
fn gyro_table(reference: bool) -> String {
    let mut header = "gx,gy,gz,dx,dy,dz".to_owned();
    if reference {
        header += ",rx,ry,rz,fx,fy,fz";
    }
    let dither = |axis: usize, row: usize| {
        5e-5 * (TAU * (47.3 + 5.1 * axis as f64) * row as f64 / RATE_HZ).sin()
    };
    let mut text = header + "\n";
    let mut pulses = [0.0_f64; 3];
    let mut angle = [0.0_f64; 3];
    for row in 1..=ROWS {
        let time_s = (row as f64 - 0.5) / RATE_HZ;
        let increment = [0, 1, 2].map(|axis| rate_rad_s(axis, time_s) / RATE_HZ);
        let mut cells: Vec<String> = (0..3)
            .map(|axis| {
                angle[axis] += increment[axis] + 1e-8 * scatter(row, axis);
                let now = ((angle[axis] + dither(axis, row)) / PULSE_RAD).floor();
                let count = now - pulses[axis];
                pulses[axis] = now;
                format!("{count}")
            })
            .collect();
        cells.extend((0..3).map(|axis| format!("{:e}", dither(axis, row))));
        if reference {
            cells.extend(
                (0..3).map(|axis| format!("{:e}", increment[axis] + 1e-9 * scatter(row, 3 + axis))),
            );
            cells.extend((0..3).map(|axis| {
                format!(
                    "{:.6}",
                    if axis == 2 { 9.81 } else { 0.0 } + 0.01 * scatter(row, 6 + axis)
                )
            }));
        }
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

const DITHERED_MODEL: &str = r#"format = 1
[motion]
source = "reference"
earth_rate = true
[gyro]
pulse_weight_rad = [2e-6, 2e-6, 2e-6]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [4e-7, 4e-7, 4e-7]
installation_rad = { xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }
[dither]
pickoff_gain = [1.0, 1.0, 1.0]
pickoff_noise_rad = [2e-7, 2e-7, 2e-7]
[reference]
angle_noise_rad = 2e-8
angle_random_walk_rad_sqrt_s = 1e-8
[[effect]]
kind = "axis_flexure"
xy = 6.9e-8
xz = 0.0
yx = 0.0
yz = 0.0
zx = 0.0
zy = 0.0
"#;

fn with_reference() -> Files {
    let manifest = [
        "format = 1\nname = \"moving\"\n[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.8\n",
        "[[table]]\nfile = \"samples.csv\"\nrate_hz = 200.0\nstart_s = 0.0\n",
        &triad("g", "gyro_count"),
        &triad("d", "dither_angle"),
        &triad("r", "reference_increment"),
        &triad("f", "specific_force"),
        "[[table]]\nfile = \"slow.csv\"\ntime = \"t\"\n",
        &channels(&[("k", "temperature", ""), ("p", "pressure", "")]),
        "[[segment]]\nname = \"first\"\nkind = \"coning\"\nstart_s = 0.0\nend_s = 2.5\n",
        "[[segment]]\nname = \"second\"\nkind = \"slew\"\nstart_s = 2.5\nend_s = 5.0\n",
    ]
    .concat();
    let mut slow = "t,k,p\n".to_owned();
    for row in 0..(SLOW_HZ * ROWS as f64 / RATE_HZ) as usize {
        let time_s = row as f64 / SLOW_HZ;
        let _ = writeln!(
            slow,
            "{time_s},{:.4},{:.1}",
            293.0 + 0.01 * time_s,
            101e3 + scatter(row, 9)
        );
    }
    vec![
        ("recording.toml".to_owned(), manifest.into_bytes()),
        ("model.toml".to_owned(), DITHERED_MODEL.as_bytes().to_vec()),
        ("samples.csv".to_owned(), gyro_table(true).into_bytes()),
        ("slow.csv".to_owned(), slow.into_bytes()),
    ]
}

/// Returns the same with its tables as Parquet.
fn packed(files: &Files) -> Files {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(files, folder.path());
    let mut recording = Recording::read(folder.path()).expect("the recording is whole");
    for table in &mut recording.tables {
        table.file = table.file.replace(".csv", ".parquet");
    }
    let out = folder.path().join("packed");
    recording
        .write_to(&out)
        .expect("a temporary folder takes files");
    let read = |name: &str| {
        (
            name.to_owned(),
            fs::read(out.join(name)).expect("just written"),
        )
    };
    vec![
        read("recording.toml"),
        files[1].clone(),
        read("samples.parquet"),
        read("slow.parquet"),
    ]
}

fn at_rest() -> Files {
    let manifest = [
        "format = 1\nname = \"at rest\"\n[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.81\n",
        "[[table]]\nfile = \"samples.csv\"\nrate_hz = 200.0\n",
        &triad("g", "gyro_increment"),
        &triad("v", "velocity_increment"),
    ]
    .concat();
    let mut text = "gx,gy,gz,vx,vy,vz\n".to_owned();
    for row in 0..ROWS {
        let earth = [6.0e-5, 4.1e-5, 0.0];
        let mut cells: Vec<String> = (0..3)
            .map(|axis| {
                format!(
                    "{:e}",
                    earth[axis] / RATE_HZ + 2e-7 * (scatter(row + 1, axis) - scatter(row, axis))
                )
            })
            .collect();
        cells.extend((0..3).map(|axis| {
            let up = [9.81, 0.0, 0.0][axis];
            format!("{:e}", (up + 1e-3 * scatter(row, 6 + axis)) / RATE_HZ)
        }));
        text += &cells.join(",");
        text.push('\n');
    }
    let model = "format = 1\n[motion]\nsource = \"static\"\nearth_rate = false\n[gyro]\npulse_weight_rad = [2e-9, 2e-9, 2e-9]\n\
        bias_rad_s = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
        installation_rad = { xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }\n";
    vec![
        ("recording.toml".to_owned(), manifest.into_bytes()),
        ("model.toml".to_owned(), model.as_bytes().to_vec()),
        ("samples.csv".to_owned(), text.into_bytes()),
    ]
}

/// Makes counts and dither with another unit's attitude ten times a second.
fn with_attitude() -> Files {
    let attitude: Vec<(String, &str)> = ["w", "x", "y", "z"]
        .map(|axis| (format!("q{axis}"), axis))
        .into();
    let list: Vec<(&str, &str, &str)> = attitude
        .iter()
        .map(|(column, axis)| (column.as_str(), "reference_attitude", *axis))
        .collect();
    let manifest = [
        "format = 1\nname = \"attitude\"\n[site]\nlatitude_rad = 0.6\ngravity_m_s2 = 9.81\n",
        "[[table]]\nfile = \"samples.csv\"\nrate_hz = 200.0\n",
        &triad("g", "gyro_count"),
        &triad("d", "dither_angle"),
        "[[table]]\nfile = \"attitude.csv\"\nrate_hz = 10.0\nstart_s = 0.0\n",
        &channels(&list),
    ]
    .concat();
    let mut text = "qw,qx,qy,qz\n".to_owned();
    for row in 1..=(SLOW_HZ * ROWS as f64 / RATE_HZ) as usize {
        // About one axis only: the others' motion is small compared with the attitude's noise.
        let angle = 0.02 * (TAU * 0.7 * row as f64 / SLOW_HZ).sin();
        let _ = writeln!(
            text,
            "{:.9},{:.9},0,0",
            (0.5 * angle).cos(),
            (0.5 * angle).sin()
        );
    }
    vec![
        ("recording.toml".to_owned(), manifest.into_bytes()),
        ("model.toml".to_owned(), DITHERED_MODEL.as_bytes().to_vec()),
        ("samples.csv".to_owned(), gyro_table(false).into_bytes()),
        ("attitude.csv".to_owned(), text.into_bytes()),
    ]
}
