//! Licences of the crates of others in the program and in the Python package.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::{TARGET, output_of};
use crate::step::{cargo_command, root};

/// First words of the names of files that hold a licence or its copyright lines.
const NAMES: [&str; 6] = [
    "LICENSE",
    "LICENCE",
    "COPYING",
    "COPYRIGHT",
    "NOTICE",
    "UNLICENSE",
];

/// Parts that are no crates, with their licences.
const BESIDE_CRATES: &str = "\
The program and the Python package hold code of others, listed here with its licences.

Rust's standard library: MIT OR Apache-2.0, the Rust Project Developers.
The program rlg alone: the GNU C Library, linked statically: LGPL-2.1-or-later, the Free Software Foundation. The source
package beside the program and `cargo verify archive` link it again, with another version of that library, too.
";

/// Crate of others, of a version, with its licence as its manifest has it.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Crate {
    name: String,
    version: String,
    licence: String,
}

impl Crate {
    /// Parses a line such as `half v2.7.1;MIT OR Apache-2.0`; `None` for a crate of the workspace.
    fn parse(line: &str) -> Option<Self> {
        let (package, licence) = line.split_once(';')?;
        let mut words = package.split(' ');
        let name = words.next()?.to_owned();
        let version = words.next()?.strip_prefix('v')?.to_owned();
        // A folder follows: it was not downloaded.
        if words.any(|word| word.starts_with("(/")) {
            return None;
        }
        let licence = licence.to_owned();
        Some(Self {
            name,
            version,
            licence,
        })
    }

    /// Returns the folder of its sources.
    fn folder(&self, registries: &[PathBuf]) -> Result<PathBuf, String> {
        let own = format!("{}-{}", self.name, self.version);
        let mut places = registries.iter().map(|registry| registry.join(&own));
        places
            .find(|place| place.is_dir())
            .ok_or_else(|| format!("{own}: its sources are in no folder of cargo's registry"))
    }
}

/// Lists the crates, then every different text of a licence with the crates that have it.
pub fn text() -> Result<String, String> {
    let registries = registries()?;
    let mut text = BESIDE_CRATES.to_owned();
    let mut crates_by_text: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let add = |own: &mut BTreeMap<String, BTreeSet<String>>, folder: &Path, name: &str| {
        for file in licence_files(folder) {
            let read = fs::read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
            let read = String::from_utf8_lossy(&read).replace("\r\n", "\n");
            let crates = own.entry(read.trim().to_owned()).or_default();
            crates.insert(name.to_owned());
        }
        Ok::<(), String>(())
    };
    for one in crates()? {
        let name = format!("{} {}", one.name, one.version);
        text += &format!("{name}: {}\n", one.licence);
        add(&mut crates_by_text, &one.folder(&registries)?, &name)?;
    }
    let vendored = root().join("host-tests/report/vendor/uplot");
    text += "uPlot, in the page: MIT\n";
    add(&mut crates_by_text, &vendored, "uPlot")?;
    for (licence, crates) in crates_by_text {
        let crates: Vec<String> = crates.into_iter().collect();
        text += &format!(
            "\n{}\n{}\n\n{licence}\n",
            "=".repeat(100),
            crates.join(", ")
        );
    }
    Ok(text)
}

/// Lists the crates whose code is in the program or in the Python package.
fn crates() -> Result<BTreeSet<Crate>, String> {
    let mut command = cargo_command(&["tree", "--locked", "--edges", "normal", "--prefix", "none"]);
    command.args([
        "--package",
        "rlg",
        "--package",
        "rlg-python",
        "--target",
        TARGET,
    ]);
    command.args(["--format", "{p};{l}"]);
    let lines = output_of(command)?;
    Ok(lines.lines().filter_map(Crate::parse).collect())
}

/// Lists the folders of cargo's registries.
fn registries() -> Result<Vec<PathBuf>, String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
    let folder = home
        .ok_or("neither CARGO_HOME nor HOME is set")?
        .join("registry/src");
    let entries =
        fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(entries.flatten().map(|entry| entry.path()).collect())
}

/// Lists the files with licences of a crate and of the folders in it: foreign code in it has its own.
fn licence_files(folder: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| -> Vec<PathBuf> {
        let found = fs::read_dir(folder).into_iter().flatten().flatten();
        found.map(|entry| entry.path()).collect()
    };
    let is_licence = |file: &PathBuf| {
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .to_uppercase();
        file.is_file() && NAMES.iter().any(|first| name.starts_with(first))
    };
    let own = entries(folder);
    let inner = own
        .iter()
        .filter(|path| path.is_dir())
        .flat_map(|path| entries(path));
    let mut all: Vec<PathBuf> = own
        .iter()
        .cloned()
        .chain(inner)
        .filter(is_licence)
        .collect();
    all.sort();
    all
}

#[cfg(test)]
mod tests {
    use super::Crate;

    #[test]
    fn a_crate_of_others_is_read_and_one_of_the_workspace_is_not() {
        let found = Crate::parse("half v2.7.1;MIT OR Apache-2.0").expect("a crate");
        assert_eq!((&*found.name, &*found.version), ("half", "2.7.1"));
        assert_eq!(found.licence, "MIT OR Apache-2.0");
        assert!(Crate::parse("serde_derive v1.0.0 (proc-macro);MIT").is_some());
        assert_eq!(Crate::parse("rlg v0.1.0 (/a/host-tests/rlg);MIT"), None);
        assert_eq!(Crate::parse(""), None);
    }
}
