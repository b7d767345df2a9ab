//! The README and the pages under `docs/`: short enough, every link leads somewhere, every command exists.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of lines for a first reader.
const MOST_README_LINES: usize = 120;

/// Greek letters of the glossary under the name by which they are sorted.
const LETTERS: [(&str, &str); 4] = [("α", "alpha"), ("ρ", "rho"), ("σ", "sigma"), ("ω", "omega")];

pub(super) fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package
        .ancestors()
        .nth(2)
        .expect("a workspace")
        .to_path_buf()
}

fn read(page: &Path) -> String {
    fs::read_to_string(page).unwrap_or_else(|error| panic!("{}: {error}", page.display()))
}

/// README.md, the scenarios' README.md and every page of `docs/`.
fn pages() -> Vec<PathBuf> {
    let docs = fs::read_dir(root().join("docs")).expect("docs");
    let mut pages: Vec<PathBuf> = docs
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    pages.push(root().join("README.md"));
    pages.push(root().join("host-tests/scenarios/README.md"));
    pages
}

/// Targets of `[text](target)` and `![text](target)`.
fn links(text: &str) -> Vec<&str> {
    let starts = text.split("](").skip(1);
    starts
        .filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
        .collect()
}

/// Returns GitHub's anchor of a heading.
fn anchor(heading: &str) -> String {
    let letters = heading.trim().to_lowercase();
    let letters = letters.chars().filter_map(|letter| match letter {
        ' ' => Some('-'),
        '-' | '_' => Some(letter),
        other => other.is_alphanumeric().then_some(other),
    });
    letters.collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| anchor(line.trim_start_matches('#')))
        .collect()
}

/// Commands in indented and fenced blocks, and in code within a line.
fn commands(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in text.lines() {
        let block = line.trim_start();
        if block.starts_with("rlg ") {
            found.push(block.to_owned());
        }
        let inline = line.split('`').skip(1).step_by(2);
        found.extend(
            inline
                .filter(|code| code.starts_with("rlg "))
                .map(str::to_owned),
        );
    }
    found
}

#[test]
fn the_readme_is_short() {
    let lines = read(&root().join("README.md")).lines().count();
    assert!(lines <= MOST_README_LINES, "{lines} lines");
}

#[test]
fn every_link_of_a_page_leads_to_a_file_and_a_heading_that_exist() {
    let mut checked = 0;
    for page in pages() {
        let text = read(&page);
        for link in links(&text) {
            if link.contains("://") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => page.clone(),
                file => page.parent().expect("a folder").join(file),
            };
            assert!(target.exists(), "{}: no {link}", page.display());
            if !heading.is_empty() {
                let known = anchors(&read(&target));
                assert!(known.contains(heading), "{}: no {link}", page.display());
            }
            checked += 1;
        }
    }
    assert!(checked > 30, "only {checked} links were seen");
}

#[test]
fn every_command_on_a_page_is_one_of_the_tool() {
    let help = assert_cmd::Command::cargo_bin("rlg")
        .expect("the command is built")
        .arg("--help")
        .output()
        .expect("it runs");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    let (_, list) = help.split_once("Commands:\n").expect("a list of commands");
    let (list, _) = list.split_once("\n\n").expect("its end");
    // A name is indented by two columns; the lines that continue a description by more.
    let named = list.lines().filter_map(|line| line.strip_prefix("  "));
    let known: BTreeSet<&str> = named
        .filter(|line| !line.starts_with(' '))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(known.contains("diagnose"), "{known:?}");
    let mut checked = 0;
    for page in pages() {
        for command in commands(&read(&page)) {
            let name = command.split_whitespace().nth(1).unwrap_or_default();
            let name = name.trim_end_matches(';');
            let general = name.starts_with('-') || name == "COMMAND";
            assert!(
                general || known.contains(name),
                "{}: {command}",
                page.display()
            );
            checked += 1;
        }
    }
    assert!(checked > 30, "only {checked} commands were seen");
}

#[test]
fn the_glossary_is_alphabetic_and_has_every_term_once() {
    let text = read(&root().join("docs/glossary.md"));
    let rows = text.lines().skip_while(|line| !line.starts_with("|---"));
    let terms = rows.skip(1).filter_map(|line| line.split('|').nth(1));
    let terms: Vec<String> = terms
        .map(|term| {
            let term = term.trim().to_lowercase();
            LETTERS
                .iter()
                .fold(term, |term, (letter, name)| term.replace(letter, name))
        })
        .collect();
    assert!(terms.len() > 50, "only {} terms", terms.len());
    for pair in terms.windows(2) {
        assert!(pair[0] < pair[1], "{} before {}", pair[0], pair[1]);
    }
}
