//! Structure of the workspace: allowed dependencies between packages, and no import cycle between the modules of a package.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Package, and the packages of this workspace that it may depend on.
const MAY_DEPEND_ON: [(&str, &[&str]); 29] = [
    ("trueaxis", &[]),
    ("strapdown", &[]),
    ("rlg-recording", &[]),
    ("rlg-model", &["rlg-recording"]),
    ("rlg-plan", &[]),
    ("rlg-parameters", &["rlg-model", "trueaxis"]),
    (
        "rlg-signal",
        &["rlg-plan", "rlg-recording", "rlg-model", "strapdown"],
    ),
    ("rlg-inference", &["rlg-plan"]),
    (
        "rlg-catalogue",
        &["rlg-plan", "rlg-signal", "rlg-inference"],
    ),
    ("rlg-findings", &["rlg-plan", "rlg-recording", "rlg-model"]),
    (
        "rlg-diagnosis",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-model",
            "rlg-signal",
            "rlg-inference",
            "rlg-catalogue",
            "rlg-findings",
        ],
    ),
    (
        "rlg-attitude",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-model",
            "rlg-signal",
            "rlg-inference",
            "rlg-catalogue",
            "rlg-findings",
            "rlg-diagnosis",
        ],
    ),
    (
        "rlg-force",
        &[
            "rlg-plan",
            "strapdown",
            "rlg-recording",
            "rlg-model",
            "rlg-signal",
            "rlg-inference",
            "rlg-catalogue",
            "rlg-findings",
            "rlg-diagnosis",
        ],
    ),
    (
        "rlg-flow",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-model",
            "rlg-signal",
            "rlg-findings",
            "rlg-diagnosis",
            "rlg-attitude",
            "rlg-calibration",
            "rlg-force",
        ],
    ),
    (
        "rlg-calibration",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-model",
            "rlg-signal",
            "rlg-inference",
            "rlg-catalogue",
            "rlg-findings",
            "rlg-diagnosis",
        ],
    ),
    ("rlg-reference", &[]),
    ("rlg-simulator", &["rlg-recording", "rlg-model"]),
    (
        "rlg-replay",
        &[
            "rlg-recording",
            "rlg-model",
            "rlg-parameters",
            "rlg-reference",
            "strapdown",
            "trueaxis",
        ],
    ),
    ("rlg-target", &["rlg-recording", "trueaxis"]),
    (
        "rlg-challenge",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-model",
            "rlg-simulator",
            "rlg-findings",
            "rlg-flow",
        ],
    ),
    (
        "rlg-report",
        &[
            "rlg-plan",
            "rlg-recording",
            "rlg-findings",
            "rlg-diagnosis",
            "rlg-calibration",
            "rlg-challenge",
            "rlg-replay",
        ],
    ),
    (
        "rlg",
        &[
            "rlg-plan",
            "trueaxis",
            "strapdown",
            "rlg-recording",
            "rlg-model",
            "rlg-parameters",
            "rlg-signal",
            "rlg-findings",
            "rlg-diagnosis",
            "rlg-attitude",
            "rlg-flow",
            "rlg-calibration",
            "rlg-reference",
            "rlg-simulator",
            "rlg-replay",
            "rlg-target",
            "rlg-challenge",
            "rlg-report",
        ],
    ),
    ("rlg-python", &["rlg"]),
    ("firmware-tests", &["trueaxis"]),
    ("interrupt-link", &["trueaxis"]),
    ("firmware-fuzz", &["trueaxis"]),
    ("unit-tests", &[]),
    ("unit-tests-above", &[]),
    ("verify", &[]),
];

/// Packages that hold the answer, or derive from it: the diagnosis may not reach them, even indirectly.
const OUT_OF_REACH: [&str; 4] = ["trueaxis", "rlg-simulator", "rlg-reference", "rlg-replay"];

/// Folders of the firmware library, and the imports allowed to each: so the chain alone can be taken, and every feature of
/// the crate is a folder or a file that nothing below it needs.
const FIRMWARE_MAY_IMPORT: [(&str, &[&str]); 5] = [
    ("chain", &[]),
    ("store", &["chain"]),
    ("unit", &["chain"]),
    ("wire", &["chain", "unit"]),
    ("service", &["chain", "store", "wire"]),
];

/// Content of the workspace's manifests.
struct Workspace {
    /// Package, and the packages of this workspace that its code depends on, tests apart.
    dependencies: BTreeMap<String, BTreeSet<String>>,
    /// Package, and its folder.
    folders: BTreeMap<String, PathBuf>,
    /// Roots of the crates that are compiled with their tests.
    tested: Vec<PathBuf>,
    /// Package, and the roots of its library and its programs.
    roots: BTreeMap<String, Vec<PathBuf>>,
}

/// Returns the files of a package's targets selected by `is_one`.
fn targets(package: &Value, is_one: impl Fn(&Value) -> bool) -> Vec<PathBuf> {
    let targets = package["targets"].as_array().expect("targets").iter();
    targets
        .filter(|target| is_one(target))
        .map(|target| PathBuf::from(target["src_path"].as_str().expect("a path")))
        .map(|path| path.canonicalize().expect("a file"))
        .collect()
}

fn workspace() -> Workspace {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{output:?}");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let text = |value: &Value| value.as_str().expect("a string").to_owned();
    let folders: BTreeMap<String, PathBuf> = packages
        .iter()
        .map(|package| {
            let manifest = PathBuf::from(text(&package["manifest_path"]));
            let folder = manifest.parent().expect("a folder").to_path_buf();
            (text(&package["name"]), folder)
        })
        .collect();
    let dependencies = packages
        .iter()
        .map(|package| {
            let on = package["dependencies"].as_array().expect("dependencies");
            let on = on
                .iter()
                .filter(|one| one["kind"].is_null())
                .map(|one| text(&one["name"]))
                .filter(|name| folders.contains_key(name))
                .collect();
            (text(&package["name"]), on)
        })
        .collect();
    let is_tested = |target: &Value| target["test"] == true;
    let tested = packages.iter().flat_map(|one| targets(one, is_tested));
    let is_root = |target: &Value| {
        let kinds = target["kind"].as_array().expect("kinds").iter();
        kinds
            .filter_map(Value::as_str)
            .any(|kind| !matches!(kind, "test" | "bench" | "example" | "custom-build"))
    };
    let roots = packages
        .iter()
        .map(|package| (text(&package["name"]), targets(package, is_root)));
    Workspace {
        dependencies,
        folders,
        tested: tested.collect(),
        roots: roots.collect(),
    }
}

#[test]
fn every_package_depends_only_on_what_it_may_know() {
    let workspace = workspace();
    let allowed: BTreeMap<_, _> = MAY_DEPEND_ON.into_iter().collect();
    for (package, dependencies) in &workspace.dependencies {
        let allowed = allowed
            .get(package.as_str())
            .unwrap_or_else(|| panic!("{package} has no row in the table"));
        for dependency in dependencies {
            assert!(
                allowed.contains(&dependency.as_str()),
                "{package} may not depend on {dependency}"
            );
        }
    }
}

/// Returns a package and all that it reaches.
fn closure(workspace: &Workspace, package: &str) -> BTreeSet<String> {
    let mut reached = BTreeSet::from([package.to_owned()]);
    let mut open = vec![package.to_owned()];
    while let Some(package) = open.pop() {
        for dependency in &workspace.dependencies[&package] {
            if reached.insert(dependency.clone()) {
                open.push(dependency.clone());
            }
        }
    }
    reached
}

#[test]
fn diagnosis_and_calibration_reach_neither_simulator_nor_chain_nor_truth() {
    let workspace = workspace();
    for package in ["rlg-diagnosis", "rlg-flow", "rlg-calibration"] {
        let reached = closure(&workspace, package);
        for forbidden in OUT_OF_REACH {
            assert!(
                !reached.contains(forbidden),
                "{package} reaches {forbidden}"
            );
        }
    }
}

#[test]
fn the_three_implementations_know_nothing_of_each_other() {
    let workspace = workspace();
    let implementations = ["trueaxis", "rlg-reference", "rlg-simulator"];
    for one in implementations {
        let reached = closure(&workspace, one);
        for other in implementations {
            assert!(
                one == other || !reached.contains(other),
                "{one} reaches {other}"
            );
        }
    }
}

/// Returns every module of a package, by its path in the crate, with its source.
fn modules(folder: &Path) -> BTreeMap<Vec<String>, String> {
    let root = folder.join("src");
    let mut found = BTreeMap::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            if path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let relative = path
                .strip_prefix(&root)
                .expect("below it")
                .with_extension("");
            let mut name: Vec<String> = relative
                .iter()
                .map(|part| part.to_string_lossy().into_owned())
                .collect();
            if matches!(
                name.last().map(String::as_str),
                Some("mod" | "lib" | "main")
            ) {
                name.pop();
            }
            found.insert(name, fs::read_to_string(&path).expect("a source file"));
        }
    }
    found
}

/// Returns the modules of the same crate named in a source by `crate::`, `super::` or `self::`; the crate's root apart.
fn imports(
    name: &[String],
    source: &str,
    all: &BTreeMap<Vec<String>, String>,
) -> BTreeSet<Vec<String>> {
    // The unit tests at a file's end import the file itself by `super`.
    let code: String = source
        .split("#[cfg(test)]\nmod ")
        .next()
        .unwrap_or_default()
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| [line, "\n"])
        .collect();
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
    let mut imports = BTreeSet::new();
    for path in code.split(|letter| !is_word(letter)) {
        let parts: Vec<&str> = path.split("::").collect();
        let supers = parts.iter().take_while(|part| **part == "super").count();
        let (base, rest) = match parts.first() {
            Some(&"crate") => (&name[..0], &parts[1..]),
            Some(&"self") => (name, &parts[1..]),
            Some(&"super") if supers <= name.len() => {
                (&name[..name.len() - supers], &parts[supers..])
            }
            _ => continue,
        };
        let mut target = base.to_vec();
        target.extend(rest.iter().map(|part| (*part).to_owned()));
        while !target.is_empty() && !all.contains_key(&target) {
            target.pop();
        }
        if !target.is_empty() && target != name {
            imports.insert(target);
        }
    }
    imports
}

type Graph = BTreeMap<Vec<String>, BTreeSet<Vec<String>>>;

/// Returns the imports of every module.
fn graph_of(all: &BTreeMap<Vec<String>, String>) -> Graph {
    all.iter()
        .map(|(name, source)| (name.clone(), imports(name, source, all)))
        .collect()
}

/// Joins the modules of each folder of a crate's root to one.
fn by_folder(graph: &Graph) -> Graph {
    let top = |name: &Vec<String>| name.iter().take(1).cloned().collect::<Vec<_>>();
    let mut folders = Graph::new();
    for (name, imports) in graph {
        let from = top(name);
        let to: Vec<_> = imports.iter().map(top).filter(|to| *to != from).collect();
        folders.entry(from).or_default().extend(to);
    }
    folders
}

/// Returns the modules that reach themselves through others.
fn in_cycles(graph: &Graph) -> BTreeSet<Vec<String>> {
    let reaches_itself = |start: &Vec<String>| {
        let mut reached = BTreeSet::new();
        let mut open: Vec<_> = graph[start].iter().collect();
        while let Some(next) = open.pop() {
            if next == start {
                return true;
            }
            if reached.insert(next) {
                open.extend(&graph[next]);
            }
        }
        false
    };
    graph
        .keys()
        .filter(|name| !name.is_empty() && reaches_itself(name))
        .cloned()
        .collect()
}

/// With `--nocapture` it prints the count by package.
#[test]
fn no_module_imports_itself_through_others() {
    for (package, folder) in workspace().folders {
        let all = modules(&folder);
        let graph = graph_of(&all);
        let folders = by_folder(&graph);
        for (graph, of) in [(graph, "modules"), (folders, "folders")] {
            let circular = in_cycles(&graph);
            println!(
                "{package}: {} of {} {of} in cycles",
                circular.len(),
                graph.len()
            );
            let names: Vec<String> = circular.iter().map(|name| name.join("::")).collect();
            assert!(names.is_empty(), "{package}: {}", names.join(", "));
        }
    }
}

/// A crate without unit tests is not compiled again for none, and every unit test has a harness.
#[test]
fn unit_tests_are_built_once_and_only_where_there_are_any() {
    let workspace = workspace();
    let mut with_tests = 0;
    for (package, roots) in &workspace.roots {
        let all = modules(&workspace.folders[package]);
        let has_tests = all.values().any(|source| {
            let mut lines = source.lines();
            lines.any(|line| line.trim() == "#[test]")
        });
        with_tests += usize::from(has_tests);
        let built = workspace.tested.iter().filter(|path| roots.contains(path));
        assert_eq!(built.count(), usize::from(has_tests), "{package}");
    }
    assert!(
        with_tests > 10,
        "only {with_tests} packages with unit tests"
    );
}

#[test]
fn folders_of_the_firmware_library_import_in_one_direction() {
    let workspace = workspace();
    let all = modules(&workspace.folders["trueaxis"]);
    let mut imported = 0;
    for (folder, allowed) in FIRMWARE_MAY_IMPORT {
        let of_folder = all
            .iter()
            .filter(|(name, _)| name.first().is_some_and(|first| first == folder));
        for (name, source) in of_folder {
            // Through the crate's root a module could import from any folder undetected.
            let by_root = source
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"))
                .find(|line| {
                    let path = line.split("crate::").nth(1).unwrap_or_default();
                    path.starts_with(|letter: char| letter.is_uppercase() || letter == '{')
                });
            assert_eq!(by_root, None, "{} names the root", name.join("::"));
            for target in imports(name, source, &all) {
                imported += 1;
                assert!(
                    target[0] == folder || allowed.contains(&target[0].as_str()),
                    "{} may not import {}",
                    name.join("::"),
                    target.join("::")
                );
            }
        }
    }
    assert!(imported > 50, "only {imported} imports were looked at");
}

#[test]
fn a_cycle_between_modules_is_found() {
    let module = |name: &str, source: &str| (vec![name.to_owned()], source.to_owned());
    let all = BTreeMap::from([
        module("one", "use super::two::Two;"),
        module("two", "use crate::three::Three;"),
        module("three", "// use super::one::One;\nfn three() {}"),
    ]);
    assert!(in_cycles(&graph_of(&all)).is_empty());
    let mut circular = all.clone();
    circular.extend([module("three", "fn three() { super::one::one() }")]);
    assert_eq!(in_cycles(&graph_of(&circular)).len(), 3);
}
