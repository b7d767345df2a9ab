//! Questions of `rlg import` on a terminal: a pseudo-terminal, driven as a person would.

use std::fs::{self, File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

/// Two columns of unknown meaning: gyros without a unit, stamps without one.
fn log(folder: &Path) {
    let mut text = "t,gx,gy,gz\n".to_owned();
    for row in 0..400 {
        let at = f64::from(row);
        let rate = 40.0 * (at * 0.05).sin();
        text += &format!("{row},{rate:.4},{:.4},{:.4}\n", 0.3 * rate, 0.1 + at * 1e-4);
    }
    fs::write(folder.join("log.csv"), text).expect("a file");
}

/// Runs the command on a terminal, and types each answer once its prompt is there.
///
/// # Returns
/// Exit code and everything on the terminal.
fn typed(folder: &Path, arguments: &[&str], answers: &[(&str, &str)]) -> (Option<i32>, String) {
    let own = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&own).expect("granted");
    unlockpt(&own).expect("unlocked");
    let name = ptsname(&own, Vec::new()).expect("a name");
    let name = name.to_str().expect("UTF-8").to_owned();
    let other = || -> Stdio {
        let file = OpenOptions::new().read(true).write(true).open(&name);
        file.expect("the other side").into()
    };
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("rlg"));
    command.current_dir(folder).args(arguments);
    command.stdin(other()).stdout(other()).stderr(other());
    let mut child = command.spawn().expect("it starts");
    drop(command);
    let mut own = File::from(own);
    let mut reader = own.try_clone().expect("a second handle");
    let (sender, heard) = std::sync::mpsc::channel();
    // Reading ends with an error once nobody holds the other side.
    let listening = std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = reader.read(&mut bytes) {
            let text = String::from_utf8_lossy(&bytes[..count]).into_owned();
            if sender.send(text).is_err() {
                break;
            }
        }
    });
    let mut all = String::new();
    for (prompt, answer) in answers {
        let begin = all.len();
        while !all[begin..].contains(prompt) {
            let more = heard.recv_timeout(Duration::from_secs(60));
            all += &more.unwrap_or_else(|_| panic!("no {prompt:?} in {all:?}"));
        }
        own.write_all(format!("{answer}\r").as_bytes())
            .expect("typed");
    }
    let code = child.wait().expect("it ends").code();
    while let Ok(more) = heard.recv_timeout(Duration::from_millis(500)) {
        all += &more;
    }
    drop(own);
    drop(heard);
    drop(listening);
    (code, all)
}

fn table(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name).join("samples.parquet")).expect("a table")
}

#[test]
fn enter_takes_each_guess_and_the_same_comes_without_questions() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    log(folder);
    let arguments = ["import", "log.csv", "--out", "asked"];
    let (code, said) = typed(folder, &arguments, &[("--time", ""), ("--unit", "")]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("stands nowhere"), "{said}");
    assert!(
        said.contains("The same without questions: rlg import log.csv"),
        "{said}"
    );
    let (code, said) = typed(
        folder,
        &["import", "log.csv", "--yes", "--out", "taken"],
        &[],
    );
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("is a guess that --yes takes"), "{said}");
    assert_eq!(table(folder, "asked"), table(folder, "taken"));
}

#[test]
fn another_answer_is_taken_and_a_wrong_one_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    log(folder);
    let arguments = ["import", "log.csv", "--out", "asked"];
    // Enter for the time; of the unit only what differs from the guess.
    let (code, said) = typed(folder, &arguments, &[("--time", ""), ("--unit", "deg/h")]);
    assert_eq!(code, Some(0), "{said}");
    let told = fs::read_to_string(folder.join("asked/recording.toml")).expect("a text");
    assert!(told.contains("gx [deg/h]"), "{told}");
    let arguments = ["import", "log.csv", "--out", "wrong"];
    let (code, said) = typed(
        folder,
        &arguments,
        &[("--time", ""), ("--unit", "furlongs")],
    );
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("furlongs") && !folder.join("wrong").exists(),
        "{said}"
    );
}

#[test]
fn nobody_is_asked_quietly_or_without_a_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    log(folder);
    let (code, said) = typed(folder, &["-q", "import", "log.csv", "--out", "quiet"], &[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("needs 2 answers"), "{said}");
    let mut piped = assert_cmd::Command::cargo_bin("rlg").expect("the command is built");
    piped
        .current_dir(folder)
        .args(["import", "log.csv", "--out", "piped"]);
    let said = piped.write_stdin("\n\n").output().expect("it runs");
    let told = String::from_utf8_lossy(&said.stderr);
    assert_eq!(said.status.code(), Some(2), "{told}");
    assert!(told.contains("needs 2 answers"), "{told}");
}
