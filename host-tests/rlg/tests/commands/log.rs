//! `rlg diagnose` of a log, and its picture of characters.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::answer::{recording, rlg, text};

/// Rows as a file of each form: the answer is that of the import and the diagnosis, and nothing stays behind.
#[test]
fn a_log_is_diagnosed_as_it_is_where_the_import_asks_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let [temporary, logs] = ["tmp", "logs"].map(|name| folder.path().join(name));
    fs::create_dir(&temporary).expect("a folder");
    fs::create_dir(&logs).expect("a folder");
    let run = |arguments: &[&str], paths: &[&Path]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rlg"));
        command
            .args(arguments)
            .args(paths)
            .env("TMPDIR", &temporary);
        command.output().expect("it runs")
    };
    let left = |folder: &Path| fs::read_dir(folder).expect("a folder").count();
    let out = |name: &str| folder.path().join(name);
    for (place, form) in ["csv", "mat", "parquet"].into_iter().enumerate() {
        let log = logs.join(format!("bench.{form}"));
        let done = run(&["-q", "export", "--out"], &[&log, &bench]);
        assert!(done.status.success(), "{done:?}");
        let imported = out(form).join("bench");
        let done = run(&["-q", "import", "--out"], &[&imported, &log]);
        assert!(done.status.success(), "{done:?}");
        let [direct, by_hand] =
            [&log, &imported].map(|given| run(&["diagnose", "--json"], &[given]));
        assert_eq!(direct.status.code(), Some(0), "{}", text(&direct.stderr));
        assert!(
            direct.stdout == by_hand.stdout,
            "{form}: {}",
            text(&direct.stderr)
        );
        let said = text(&direct.stderr);
        assert!(
            said.contains(&format!(
                "bench.{form}: 2000 rows at 100 Hz: gyro_rate x y z, reference"
            )),
            "{said}"
        );
        assert!(said.contains("gyro scale x"), "{said}");
        assert_eq!(
            (left(&temporary), left(&logs)),
            (0, place + 1),
            "nothing stays behind"
        );
    }
    // The page names the file and its sum, as no recording is left.
    let log = logs.join("bench.csv");
    let page = out("page");
    let done = run(&["-q", "diagnose", "-o"], &[&page, &log]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let page = fs::read_to_string(page.join("report.html")).expect("the page");
    assert!(page.contains("bench.csv") && !page.contains("samples.parquet"));
}

#[test]
fn a_log_that_the_import_asks_about_is_asked_about() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    // No unit stands anywhere.
    let log = folder.path().join("log.csv");
    fs::copy(bench.join("rows.csv"), &log).expect("a file");
    let imported = rlg(
        &["import", "-q", "--out"],
        &[&folder.path().join("out"), &log],
    );
    let diagnosed = rlg(&["diagnose"], &[&log]);
    assert_eq!(imported.status.code(), Some(2));
    assert_eq!(diagnosed.status.code(), Some(2));
    assert_eq!(text(&diagnosed.stdout), "");
    // Equal questions and commands but for the folder, which the import has and the diagnosis has not.
    let out = folder.path().join("out").display().to_string();
    let (asked, said) = (text(&imported.stderr), text(&diagnosed.stderr));
    let asked = asked.replace(&out, "DIR");
    assert_eq!(said, asked);
    let way = format!("rlg import {} --out DIR", log.display());
    assert!(said.contains(&way), "{said}");
    let quiet = rlg(&["diagnose", "-q"], &[&log]);
    assert_eq!(text(&quiet.stderr), asked);
}

#[test]
fn the_picture_stands_behind_the_answer_and_fits_eighty_columns() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let plain = text(&rlg(&["diagnose"], &[&bench]).stdout);
    let drawn = text(&rlg(&["diagnose", "--plot"], &[&bench]).stdout);
    let added: Vec<&str> = drawn.lines().filter(|line| !plain.contains(line)).collect();
    assert!(
        added[0].starts_with("gyro x: integrated residual ["),
        "{drawn}"
    );
    assert!(
        added.iter().any(|line| line.contains("before ┤")),
        "{drawn}"
    );
    let widest = added.iter().map(|line| line.chars().count()).max();
    assert!(
        widest.is_some_and(|widest| (60..=80).contains(&widest)),
        "{drawn}"
    );
    let kept: Vec<&str> = drawn.lines().filter(|line| plain.contains(line)).collect();
    assert_eq!(kept, plain.lines().collect::<Vec<_>>());
}
