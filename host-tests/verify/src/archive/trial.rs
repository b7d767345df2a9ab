//! Trial of an archive: unpacked and installed in an empty folder, by programs that find no compiler, and used.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::{empty, make, output_of, remove, write};
use crate::step::{root, run};

/// Longest time from the archive to the results \[s\].
const MOST_S: f64 = 60.0;

/// All programs on the path of the trial.
const PROGRAMS: [&str; 3] = ["tar", "gzip", "sha256sum"];

/// First words of variables by which pip reaches its packages; no other variable is passed on.
const NETWORK: [&str; 9] = [
    "PIP_",
    "SSL_CERT",
    "REQUESTS_CA",
    "HTTP_PROXY",
    "HTTPS_PROXY",
    "NO_PROXY",
    "http_proxy",
    "https_proxy",
    "no_proxy",
];

/// Twenty seconds of a unit without a dither, one gyro of which has a wrong scale.
const SCENARIO: &str = "\
format = 1
name = \"log\"
rate_hz = 200.0

[site]
latitude_rad = 0.6
gravity_m_s2 = 9.8
earth_rate = false

[gyro]
output = \"increment\"
pulse_weight_rad = [1e-9, 1e-9, 1e-9]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [1e-5, 1e-5, 1e-5]
installation_rad = { xy = 0.0, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }

[reference]
angle_noise_rad = 0.0
angle_random_walk_rad_sqrt_s = 1e-5
weight_rad = 1e-9

[[motion]]
kind = \"tumble\"
rate_rad_s = [0.5, 0.5, 0.5]
duration_s = 20.0
frequency_hz = [0.7, 1.3, 1.9]
phase_rad = [0.0, 1.0, 2.0]
ramp_s = 1.0

[[effect]]
kind = \"gyro_scale\"
concealed = true
x = 0.0
y = 1e-3
z = 0.0
";

/// Folder of the trial.
struct Trial {
    folder: PathBuf,
    begin: Instant,
}

/// Installs the archive in `part`, uses it and prints the seconds of each step; fails beyond [`MOST_S`].
pub fn tried(part: &Path, version: &str) -> Result<(), String> {
    let python = real_python()?;
    let trial = Trial {
        folder: root().join("target").join("archive-trial"),
        begin: Instant::now(),
    };
    empty(&trial.folder)?;
    for folder in ["path", "home", "work"] {
        make(&trial.folder.join(folder))?;
    }
    for program in PROGRAMS {
        trial.link(program)?;
    }
    let command = trial.unpacked(part, version)?;
    trial.demonstrated(&command)?;
    trial.logged(&command)?;
    let python = trial.with_package(part, &python)?;
    trial.six_lines(&python, version)?;
    trial.same_answer(&command)?;
    let all_s = trial.begin.elapsed().as_secs_f64();
    println!("{all_s:7.1} s  in all; at most {MOST_S:.0}");
    if all_s > MOST_S {
        return Err(format!(
            "installed and used in {all_s:.1} s, at most {MOST_S:.0}"
        ));
    }
    remove(&trial.folder)
}

impl Trial {
    /// Prepares a program that finds nothing but [`PROGRAMS`], in the trial's folder `work`.
    fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new(program.as_ref());
        let kept = std::env::vars_os().filter(|(name, _)| {
            let name = name.to_string_lossy();
            NETWORK.iter().any(|first| name.starts_with(first))
        });
        command.env_clear().envs(kept.collect::<Vec<_>>());
        command.env("PATH", self.folder.join("path"));
        command.env("HOME", self.folder.join("home"));
        // Figures are drawn into files.
        command.env("MPLBACKEND", "Agg");
        command.current_dir(self.folder.join("work"));
        command
    }

    /// Links a program of this machine into the path.
    fn link(&self, program: &str) -> Result<(), String> {
        let places = std::env::var_os("PATH").unwrap_or_default();
        let mut found = std::env::split_paths(&places).map(|folder| folder.join(program));
        let found = found.find(|path| path.is_file());
        let found = found.ok_or_else(|| format!("{program}: is on no path"))?;
        let link = self.folder.join("path").join(program);
        std::os::unix::fs::symlink(found, &link)
            .map_err(|error| format!("{}: {error}", link.display()))
    }

    fn said(&self, words: &str) {
        println!("{:7.1} s  {words}", self.begin.elapsed().as_secs_f64());
    }

    /// Checks the sums and unpacks the program.
    ///
    /// # Returns
    /// The program's path.
    fn unpacked(&self, part: &Path, version: &str) -> Result<PathBuf, String> {
        let mut sums = self.command(self.folder.join("path/sha256sum"));
        sums.args(["--check", "--quiet", "SHA256SUMS"])
            .current_dir(part);
        run(sums)?;
        let name = format!("rlg-{version}-x86_64-linux");
        let mut unpack = self.command(self.folder.join("path/tar"));
        unpack.arg("-xzf").arg(part.join(format!("{name}.tar.gz")));
        run(unpack)?;
        let place = self.folder.join("work").join(name);
        let command = place.join("bin/rlg");
        let mut asked = self.command(&command);
        asked.arg("--version");
        let said = output_of(asked)?;
        if said.trim() != format!("rlg {version}") {
            return Err(format!("{}: says {said:?}", command.display()));
        }
        let beside = [
            "share/man/man1/rlg-diagnose.1",
            "share/bash-completion/completions/rlg",
            "LICENSE-MIT",
            "LICENSES-OTHERS",
            "docs/python.md",
            "host-tests/scenarios/vibration.toml",
        ];
        if let Some(missing) = beside.iter().find(|file| !place.join(file).is_file()) {
            return Err(format!("{}: has no {missing}", place.display()));
        }
        self.said("unpacked");
        Ok(command)
    }

    /// Runs the demonstration, which ends with an error if it does not find what it conceals.
    fn demonstrated(&self, command: &Path) -> Result<(), String> {
        let mut demo = self.command(command);
        demo.arg("demo");
        run(demo)?;
        self.said("rlg demo");
        Ok(())
    }

    /// Makes `log.csv`.
    fn logged(&self, command: &Path) -> Result<(), String> {
        write(&self.folder.join("work/log.toml"), SCENARIO)?;
        let steps: [&[&str]; 2] = [
            &["simulate", "--quiet", "log.toml", "--out", "logged"],
            &["export", "--quiet", "logged", "--out", "log.csv"],
        ];
        for arguments in steps {
            let mut step = self.command(command);
            step.args(arguments);
            run(step)?;
        }
        self.said("log.csv");
        Ok(())
    }

    /// Installs the Python package into an environment of its own, with the figures' package and without building any.
    ///
    /// # Returns
    /// That environment's Python.
    fn with_package(&self, part: &Path, python: &Path) -> Result<PathBuf, String> {
        let environment = self.folder.join("environment");
        let mut make = self.command(python);
        make.args(["-m", "venv"]).arg(&environment);
        run(make)?;
        let python = environment.join("bin/python");
        let mut names = super::files(part)?.into_iter().map(|(name, _)| name);
        let wheel = names.find(|name| name.ends_with(".whl"));
        let wheel = part.join(wheel.ok_or("no Python package was made")?);
        let mut install = self.command(&python);
        install.args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
        ]);
        install.args(["--only-binary", ":all:"]);
        install.arg(format!("{}[plots]", wheel.display()));
        run(install)?;
        self.said("pip install");
        Ok(python)
    }

    /// Runs the first Python of the archive's own `docs/python.md` on `log.csv`.
    fn six_lines(&self, python: &Path, version: &str) -> Result<(), String> {
        let work = self.folder.join("work");
        let page = work.join(format!("rlg-{version}-x86_64-linux/docs/python.md"));
        let text =
            fs::read_to_string(&page).map_err(|error| format!("{}: {error}", page.display()))?;
        let code = first_python(&text).ok_or_else(|| format!("{}: no Python", page.display()))?;
        let checked = format!("{code}\nassert rlg.__version__ == {version:?}, rlg.__version__\n");
        write(&work.join("six_lines.py"), &checked)?;
        let mut lines = self.command(python);
        lines.arg("six_lines.py");
        run(lines)?;
        self.said("docs/python.md");
        Ok(())
    }

    /// Checks that the command and the package give `log.csv` the same answer.
    fn same_answer(&self, command: &Path) -> Result<(), String> {
        let mut diagnose = self.command(command);
        diagnose.args(["diagnose", "--quiet", "log.csv", "--out", "by-command"]);
        run(diagnose)?;
        let read = |folder: &str| {
            let file = self.folder.join("work").join(folder).join("model.toml");
            fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))
        };
        let (one, other) = (read("by-command")?, read("results")?);
        if !one.contains("gyro_scale") || one != other {
            return Err(format!(
                "log.csv: the command found\n{one}\nand the package\n{other}"
            ));
        }
        self.said("rlg diagnose log.csv: the same model, with the scale error");
        Ok(())
    }
}

/// Returns Python itself: a version manager's `python3` is a script.
fn real_python() -> Result<PathBuf, String> {
    let mut python = Command::new("python3");
    python.args(["-c", "import sys; print(sys.executable)"]);
    Ok(PathBuf::from(output_of(python)?.trim()))
}

/// Returns the first block of Python of a page.
fn first_python(page: &str) -> Option<&str> {
    let (_, from) = page.split_once("```python\n")?;
    from.split_once("```").map(|(code, _)| code)
}

#[cfg(test)]
mod tests {
    use super::{first_python, tried};
    use crate::step::root;

    #[test]
    #[ignore = "tries target/archive again, which cargo verify archive makes and tries"]
    fn the_last_archive_installs_without_a_compiler() {
        let outcome = tried(&root().join("target/archive"), env!("CARGO_PKG_VERSION"));
        assert_eq!(outcome, Ok(()));
    }

    #[test]
    fn the_first_python_of_a_page_is_found() {
        let page = "words\n```sh\nls\n```\n```python\nimport rlg\n```\n```python\nlater\n```\n";
        assert_eq!(first_python(page), Some("import rlg\n"));
        assert_eq!(first_python("words"), None);
    }
}
