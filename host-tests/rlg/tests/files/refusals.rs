//! `docs/refusals.md`: each mistake listed in the page is made here, and gets the page's sentence.
//!
//!     RLG_WRITE_TABLES=1 cargo test --release -p rlg --test files refusals

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

/// If this is set, the table is written into the page instead of compared.
const WRITE: &str = "RLG_WRITE_TABLES";

const ROWS: usize = 6000;
const RATE_HZ: f64 = 100.0;
const G_M_S2: f64 = 9.806_65;

/// The Earth's rotation \[rad/s\].
const EARTH_RAD_S: f64 = 7.292_115e-5;

/// A logger's file: names of columns, and cells row by row.
#[derive(Clone)]
struct Log {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

/// Angle of the table about z \[rad\].
fn angle_rad(time_s: f64) -> f64 {
    1.5 * (1.0 - (0.7 * time_s).cos()) + 0.2 * (5.1 * time_s).sin()
}

/// A minute on a table that rotates to and fro about z: stamps in s, gyros in rad/s, forces in m/s², the table's angle in
/// rad.
fn log() -> Log {
    let mut chance = ChaCha8Rng::seed_from_u64(7);
    let mut normal = |std: f64| {
        Normal::new(0.0, std)
            .expect("a deviation")
            .sample(&mut chance)
    };
    let names = ["t", "gx", "gy", "gz", "ax", "ay", "az", "encoder_z"];
    let units = [
        "s", "rad/s", "rad/s", "rad/s", "m/s^2", "m/s^2", "m/s^2", "rad",
    ];
    let mut columns = vec![Vec::new(); names.len()];
    for row in 0..ROWS {
        let time_s = (row + 1) as f64 / RATE_HZ;
        let turned = (angle_rad(time_s) - angle_rad(time_s - 1.0 / RATE_HZ)) * RATE_HZ;
        let cells = [
            time_s,
            normal(4e-5),
            normal(4e-5),
            normal(4e-5) + turned,
            normal(2e-3),
            normal(2e-3),
            normal(2e-3) + G_M_S2,
            angle_rad(time_s) + normal(2e-6),
        ];
        for (column, cell) in columns.iter_mut().zip(cells) {
            column.push(cell);
        }
    }
    let names = names.iter().zip(units);
    Log {
        names: names
            .map(|(name, unit)| format!("{name} ({unit})"))
            .collect(),
        columns,
    }
}

impl Log {
    fn place(&self, stem: &str) -> usize {
        let mut names = self.names.iter();
        names
            .position(|name| name.starts_with(&format!("{stem} ")))
            .expect("the column")
    }

    /// Multiplies the values of columns.
    fn times(mut self, stems: &[&str], factor: f64) -> Self {
        for stem in stems {
            let place = self.place(stem);
            self.columns[place]
                .iter_mut()
                .for_each(|value| *value *= factor);
        }
        self
    }

    /// Renames a column.
    fn named(mut self, stem: &str, name: &str) -> Self {
        let place = self.place(stem);
        self.names[place] = name.to_owned();
        self
    }

    fn without(mut self, stems: &[&str]) -> Self {
        for stem in stems {
            let place = self.place(stem);
            self.names.remove(place);
            self.columns.remove(place);
        }
        self
    }

    /// Replaces the values of a column.
    fn with(mut self, stem: &str, value: impl Fn(usize, f64) -> f64) -> Self {
        let place = self.place(stem);
        let column = &mut self.columns[place];
        for (row, cell) in column.iter_mut().enumerate() {
            *cell = value(row, *cell);
        }
        self
    }

    fn exchanged(mut self, one: &str, other: &str) -> Self {
        let (one, other) = (self.place(one), self.place(other));
        self.columns.swap(one, other);
        self
    }

    fn csv(&self) -> String {
        let mut text = self.names.join(",") + "\n";
        for row in 0..self.columns[0].len() {
            let cells = self.columns.iter().map(|column| match column[row] {
                cell if cell.is_nan() => String::new(),
                cell => format!("{cell:.9}"),
            });
            let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join(","));
        }
        text
    }
}

/// A user's mistake, and the place of its sentence.
struct Mistake {
    /// Description of the mistake.
    what: &'static str,
    /// Files to import, with their content.
    files: Vec<(&'static str, String)>,
    /// More arguments of `rlg import`.
    import: &'static [&'static str],
    /// Text of `recording.toml` replaced by another before `rlg diagnose`.
    edit: Option<(&'static str, &'static str)>,
    /// Command that reports it.
    said: Said,
}

/// Command that reports a mistake, and the form of the report.
#[derive(Clone, Copy, PartialEq)]
enum Said {
    /// Refused by the import.
    Import,
    /// Refused by the diagnosis.
    Diagnose,
    /// A line of the answer with these words: the work goes on.
    Answer(&'static str),
    /// A warning of the import with these words.
    Note(&'static str),
}

fn mistake(what: &'static str, log: &Log, said: Said) -> Mistake {
    Mistake {
        what,
        files: vec![("log.csv", log.csv())],
        import: &[],
        edit: None,
        said,
    }
}

const GYROS: [&str; 3] = ["gx", "gy", "gz"];
const FORCES: [&str; 3] = ["ax", "ay", "az"];

/// Mistakes of units and clocks.
fn of_units() -> Vec<Mistake> {
    let log = log();
    let degrees = 1_f64.to_degrees();
    let at_import = |what, log: Log| mistake(what, &log, Said::Import);
    let at_diagnosis = |what, log: Log| mistake(what, &log, Said::Diagnose);
    vec![
        at_import(
            "a unit stands nowhere, and nothing turns",
            log.clone().without(&["encoder_z"]).named("gx", "gx"),
        ),
        at_import(
            "stamps in milliseconds under a header that says s",
            log.clone().times(&["t"], 1e3),
        ),
        at_import(
            "accelerometers in g under a header that says m/s²",
            log.clone().times(&FORCES, 1.0 / G_M_S2),
        ),
        at_import(
            "accelerometers in mg",
            log.clone().times(&FORCES, 1e3 / G_M_S2),
        ),
        at_import(
            "accelerometers converted from g twice",
            log.clone().times(&FORCES, G_M_S2),
        ),
        at_import(
            "accelerometers without gravity",
            log.clone().with("az", |_, value| value - G_M_S2),
        ),
        at_diagnosis(
            "gyros in °/s under a header that says rad/s (57.3)",
            log.clone().times(&GYROS, degrees),
        ),
        mistake(
            "a unit at rest, its gyros in °/s under a header that says rad/s",
            &at_rest(log.clone()).times(&GYROS, degrees),
            Said::Note("times the earth's"),
        ),
        at_import("gyros in mrad/s (1000)", log.clone().times(&GYROS, 1e3)),
        at_diagnosis(
            "a table in degrees under a header that says arcseconds (3600)",
            log.clone()
                .times(&["encoder_z"], degrees)
                .named("encoder_z", "encoder_z (arcsec)"),
        ),
    ]
}

/// Mistakes of axes and motion.
fn of_motion() -> Vec<Mistake> {
    let log = log();
    vec![
        mistake(
            "a gyro reversed",
            &log.clone().times(&["gz"], -1.0),
            Said::Diagnose,
        ),
        mistake(
            "two gyros exchanged",
            &log.clone().exchanged("gy", "gz"),
            Said::Answer("channel order"),
        ),
        mistake(
            "a unit that moves, and no reference",
            &log.clone().without(&["encoder_z"]),
            Said::Answer("errors of the gyros"),
        ),
    ]
}

/// Stamps and rows that are misleading.
fn of_rows() -> Vec<Mistake> {
    let log = log();
    let bursts = log.clone().with("t", |row, _| {
        ((row / 5 + 1) * 5) as f64 / RATE_HZ + (row % 5) as f64 * 1e-4
    });
    let jitter = log
        .clone()
        .with("t", |row, time_s| time_s + 2e-3 * (row as f64 * 2.4).sin());
    let back = log.clone().with(
        "t",
        |row, time_s| if row == 3000 { time_s - 1.0 } else { time_s },
    );
    let gap = log.clone().with(
        "t",
        |row, time_s| if row >= 3000 { time_s + 0.5 } else { time_s },
    );
    let held_of = log.clone();
    let held = log
        .clone()
        .with("gz", |row, _| held_of.columns[3][row / 5 * 5]);
    let mut repeated = log.clone();
    for column in &mut repeated.columns[1..7] {
        column.copy_within(2000..2300, 3000);
    }
    let apart = |stamp: fn(f64) -> f64| {
        let table = log.clone().without(&["gx", "gy", "gz", "ax", "ay", "az"]);
        vec![
            ("log.csv", log.clone().without(&["encoder_z"]).csv()),
            (
                "table.csv",
                table.with("t", |_, time_s| stamp(time_s)).csv(),
            ),
        ]
    };
    vec![
        mistake("rows that came in bursts", &bursts, Said::Import),
        mistake("a stamp that goes back", &back, Said::Import),
        mistake("stamps that jitter", &jitter, Said::Note("uneven")),
        mistake("rows that are missing", &gap, Said::Note("missing")),
        mistake(
            "stamps less than half a row apart",
            &log.clone().with("t", |row, time_s| match row % 10 {
                5 => time_s - 0.006,
                _ => time_s,
            }),
            Said::Import,
        ),
        Mistake {
            files: vec![("log.csv", dated(&log.csv()))],
            ..mistake("date-times whose day could be a month", &log, Said::Import)
        },
        Mistake {
            import: &["--rate", "1000"],
            ..mistake("a rate ten times that of the stamps", &log, Said::Import)
        },
        Mistake {
            import: &["--rate", "80"],
            ..mistake("a rate that the stamps do not have", &log, Said::Import)
        },
        mistake(
            "a channel that holds each reading for five rows",
            &held,
            Said::Answer("held"),
        ),
        mistake("a block of rows twice", &repeated, Said::Answer("repeat")),
        Mistake {
            files: apart(|time_s| time_s + 5000.0),
            ..mistake(
                "two clocks: the table's begins elsewhere",
                &log,
                Said::Import,
            )
        },
        Mistake {
            files: apart(|time_s| time_s + 1.772e9),
            ..mistake("two clocks: one counts from 1970", &log, Said::Import)
        },
    ]
}

/// Makes the log of a table at rest: the Earth's rate at 53° about x and z, a tenth of the noise, and no encoder.
fn at_rest(log: Log) -> Log {
    let noise = log.columns[1].clone();
    log.with("gx", |_, rate| 0.6 * EARTH_RAD_S + 0.1 * rate)
        .with("gy", |_, rate| 0.1 * rate)
        .with("gz", |row, _| {
            0.8 * EARTH_RAD_S + 0.1 * noise[noise.len() - 1 - row]
        })
        .without(&["encoder_z"])
}

/// Replaces the log's seconds by date-times of the form month/day/year.
fn dated(csv: &str) -> String {
    let of = |line: &str| {
        let (time, rest) = line.split_once(',').expect("two columns");
        match time.parse::<f64>() {
            Ok(time_s) => format!(
                "03/01/2026 12:{:02}:{:09.6},{rest}\n",
                time_s as u32 / 60,
                time_s % 60.0
            ),
            Err(_) => format!("time,{rest}\n"),
        }
    };
    csv.lines().map(of).collect()
}

/// Typing errors in `recording.toml`.
fn of_manifests() -> Vec<Mistake> {
    let log = log();
    let edited = |what, edit| Mistake {
        edit: Some(edit),
        ..mistake(what, &log, Said::Diagnose)
    };
    vec![
        edited("a key misspelt", ("\nrate_hz = ", "\nrate = ")),
        edited("a quantity misspelt", ("\"gyro_rate\"", "\"gyro_rates\"")),
        edited(
            "a unit of another quantity",
            ("axis = \"x\"", "axis = \"x\"\n  unit = \"deg\""),
        ),
    ]
}

fn rlg(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let output = command
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

impl Mistake {
    /// Returns its sentence.
    fn sentence(&self) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        let mut arguments = vec!["import"];
        for (name, content) in &self.files {
            fs::write(folder.join(name), content).expect("a file");
            arguments.push(name);
        }
        arguments.extend(["--out", "log"]);
        arguments.extend(self.import);
        let (code, _, words) = rlg(folder, &arguments);
        let refused = |code, words: &str| {
            assert_eq!(code, Some(2), "{}: not refused: {words}", self.what);
            let line = words.lines().find_map(|line| line.strip_prefix("error: "));
            line.unwrap_or_else(|| panic!("{}: {words}", self.what))
                .to_owned()
        };
        let holding = |text: &str, part: &str| {
            let mut lines = text.lines();
            let line = lines.find(|line| line.to_lowercase().contains(part));
            let line = line.unwrap_or_else(|| panic!("{}: no {part:?} in\n{text}", self.what));
            line.trim_start_matches("warning: ").to_owned()
        };
        match self.said {
            Said::Import => {
                assert!(
                    !folder.join("log").exists(),
                    "{}: something is left",
                    self.what
                );
                return refused(code, &words);
            }
            _ => assert_eq!(code, Some(0), "{}: {words}", self.what),
        }
        if let Said::Note(part) = self.said {
            return holding(&words, part);
        }
        if let Some((from, to)) = self.edit {
            let file = folder.join("log/recording.toml");
            let text = fs::read_to_string(&file).expect("a manifest");
            assert!(text.contains(from), "{text}");
            fs::write(&file, text.replacen(from, to, 1)).expect("a manifest");
        }
        let (code, answer, words) = rlg(folder, &["diagnose", "log", "--out", "found"]);
        match self.said {
            Said::Answer(part) => {
                assert_eq!(code, Some(0), "{}: {words}", self.what);
                holding(&answer, part)
            }
            _ => {
                assert!(
                    !folder.join("found").exists(),
                    "{}: something is left",
                    self.what
                );
                refused(code, &words)
            }
        }
    }
}

#[test]
fn refusals_are_those_of_the_page() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/refusals.md");
    let text = fs::read_to_string(&page).expect("the page");
    let mut table = String::from("\n| mistake | who says it | sentence |\n|---|---|---|\n");
    let mut failed = Vec::new();
    for mistake in [of_units(), of_motion(), of_rows(), of_manifests()]
        .into_iter()
        .flatten()
    {
        let sentence =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| mistake.sentence()));
        let Ok(sentence) = sentence else {
            failed.push(mistake.what);
            continue;
        };
        let who = match mistake.said {
            Said::Import => "import",
            Said::Note(_) => "import, which goes on",
            Said::Diagnose => "diagnose",
            Said::Answer(_) => "diagnose, which goes on",
        };
        let _ = writeln!(
            table,
            "| {} | {who} | {} |",
            mistake.what,
            sentence.replace('|', "\\|")
        );
    }
    assert!(failed.is_empty(), "{failed:?}\n{table}");
    let (begin, end) = ("<!-- made by the commands: refusals -->", "<!-- end -->");
    let (head, rest) = text.split_once(begin).expect("the mark");
    let (shown, tail) = rest.split_once(end).expect("the end");
    if std::env::var_os(WRITE).is_some() {
        fs::write(&page, format!("{head}{begin}{table}{end}{tail}")).expect("the page");
        return;
    }
    assert_eq!(shown, table, "RLG_WRITE_TABLES=1 writes it anew");
}
