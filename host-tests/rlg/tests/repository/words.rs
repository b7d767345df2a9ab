//! The rule of words of CONTRIBUTING.md over comments and over sentences of a report: the subject is a named quantity, not a
//! clause.

use std::path::Path;

use super::pages::root;

/// Beginnings of a clause where a quantity should stand.
const CLAUSES: [&str; 7] = ["What", "Where", "Whether", "How", "Which", "Who", "When"];

/// Verbs of persons.
const PERSONAL: [&str; 3] = ["told", "tells", "says"];

/// Comments that break the rule, with their lines.
fn broken(text: &str) -> Vec<(usize, String)> {
    let mut is_code = false;
    let mut found = Vec::new();
    for (row, line) in text.lines().enumerate() {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            is_code = false;
            continue;
        };
        let comment = comment.trim_start_matches(['/', '!']).trim();
        if comment.starts_with("```") {
            is_code = !is_code;
        }
        let mut words = comment.split(|letter: char| !letter.is_alphabetic());
        let is_clause = words.next().is_some_and(|first| CLAUSES.contains(&first));
        if !is_code && (is_clause || words.any(|word| PERSONAL.contains(&word))) {
            found.push((row + 1, comment.to_owned()));
        }
    }
    found
}

fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder of the repository");
    for entry in entries {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Help texts of the command are written for a terminal, and those of Python's classes for Python.
fn is_help(path: &Path) -> bool {
    let folders = ["host-tests/rlg/src/command", "host-tests/python"];
    folders
        .iter()
        .any(|folder| path.starts_with(root().join(folder)))
}

#[test]
fn comments_name_quantities() {
    let mut files = Vec::new();
    for folder in ["src", "host-tests"] {
        sources(&root().join(folder), &mut files);
    }
    let is_own = |path: &std::path::PathBuf| {
        let mut parts = path.components();
        !parts.any(|part| part.as_os_str() == "target") && !is_help(path)
    };
    files.retain(is_own);
    assert!(files.len() > 500, "{}", files.len());
    let mut all = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("UTF-8");
        let lines = broken(&text).into_iter();
        all.extend(lines.map(|(row, comment)| format!("{}:{row}: {comment}", file.display())));
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

/// Packages with the sentences of a diagnosis and of its report.
const SENTENCES: [&str; 11] = [
    "attitude",
    "calibration",
    "catalogue",
    "diagnosis",
    "findings",
    "flow",
    "force",
    "inference",
    "plan",
    "report",
    "signal",
];

/// Sentences in a source, its unit tests apart, that break the rule.
fn broken_sentences(text: &str) -> Vec<(usize, String)> {
    let is_word = |letter: char| !letter.is_alphabetic();
    let mut found = Vec::new();
    let rows = text.lines().enumerate();
    for (row, line) in rows.take_while(|(_, line)| !line.starts_with("#[cfg(test)]")) {
        if line.trim_start().starts_with("//") {
            continue;
        }
        for quoted in line.split('"').skip(1).step_by(2) {
            let mut words = quoted.split(is_word);
            if quoted.contains(' ') && words.any(|word| PERSONAL.contains(&word)) {
                found.push((row + 1, quoted.to_owned()));
            }
        }
    }
    found
}

#[test]
fn sentences_of_a_report_name_quantities() {
    let mut all = Vec::new();
    for package in SENTENCES {
        let mut files = Vec::new();
        let folder = root().join("host-tests").join(package).join("src");
        sources(&folder, &mut files);
        assert!(!files.is_empty(), "{package}");
        for file in files {
            let text = std::fs::read_to_string(&file).expect("UTF-8");
            let broken = broken_sentences(&text).into_iter();
            all.extend(broken.map(|(row, said)| format!("{}:{row}: {said}", file.display())));
        }
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn a_clause_and_a_person_are_found() {
    let text = "/// What is left.\n//! A test says so.\nlet x = 1; // Whether\n/// ```\n/// // What\n/// ```\n/// Residual.";
    let rows: Vec<usize> = broken(text).into_iter().map(|(row, _)| row).collect();
    assert_eq!(rows, [1, 2]);
    let code = "let told = \"told\"; // says\nlet line = \"gravity tells them apart\";\n#[cfg(test)]\n\"it says so\"";
    let rows: Vec<usize> = broken_sentences(code)
        .into_iter()
        .map(|(row, _)| row)
        .collect();
    assert_eq!(rows, [2]);
}
