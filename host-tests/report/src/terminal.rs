//! Prints the diagnosis on a terminal: the same facts in at most twenty lines.
//!
//! The summary of a [`Diagnosis`] has one sentence a line. Those that fit are printed in their order; the last line
//! counts what is left out. Every kind of sentence keeps its first, so that many sentences of one kind hide no other
//! kind.

use rlg_findings::result::Diagnosis;

/// Lines that a terminal shows at once, less the one that names the report.
pub const MOST_LINES: usize = 19;

/// How long a line may be: two rows of a terminal of eighty columns.
const MOST_LETTERS: usize = 160;

/// Kinds of sentences by their beginning, those that matter most first. A number that belongs to the finding
/// above it begins with spaces.
const KINDS: [&str; 10] = [
    "What:",
    "Drift:",
    "Proof:",
    "Self-test:",
    "Where:",
    "At rest:",
    "Control:",
    "Not named:",
    "Next:",
    "  ",
];

/// Chooses and shortens the lines.
pub fn lines(diagnosis: &Diagnosis) -> Vec<String> {
    let mut all: Vec<&str> = diagnosis.summary.iter().map(String::as_str).collect();
    let next = format!("Next: {}", diagnosis.next_experiment);
    if !diagnosis.next_experiment.is_empty() {
        all.push(&next);
    }
    let kept = if all.len() <= MOST_LINES {
        (0..all.len()).collect()
    } else {
        chosen(&all, MOST_LINES - 1)
    };
    let mut shown: Vec<String> = kept.iter().map(|&place| shortened(all[place])).collect();
    let hidden = all.len() - kept.len();
    if hidden > 0 {
        shown.push(format!(
            "And {hidden} more findings, in report.html and diagnosis.json."
        ));
    }
    shown
}

/// The places of `most` lines: the first, then in turn the next of every kind.
fn chosen(all: &[&str], most: usize) -> Vec<usize> {
    let kind = |line: &str| KINDS.iter().position(|begin| line.starts_with(begin));
    let mut waiting: Vec<Vec<usize>> = vec![Vec::new(); KINDS.len() + 1];
    for (place, line) in all.iter().enumerate().rev() {
        waiting[kind(line).map_or(0, |kind| kind + 1)].push(place);
    }
    let mut kept = Vec::new();
    while kept.len() < most && waiting.iter().any(|places| !places.is_empty()) {
        for places in &mut waiting {
            if kept.len() < most {
                kept.extend(places.pop());
            }
        }
    }
    kept.sort_unstable();
    kept
}

/// The line, cut at a word where it is too long.
fn shortened(line: &str) -> String {
    if line.chars().count() <= MOST_LETTERS {
        return line.to_owned();
    }
    let cut: String = line.chars().take(MOST_LETTERS).collect();
    let whole = cut.rfind(' ').map_or(cut.as_str(), |space| &cut[..space]);
    format!("{whole} …")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_lines_every_kind_keeps_its_first_and_order_is_kept() {
        let many: Vec<String> = std::iter::once("The recording differs.".to_owned())
            .chain((0..30).map(|k| format!("Where: place {k}")))
            .chain((0..30).map(|k| format!("What: effect {k}")))
            .chain(["Proof: it falls.".to_owned(), "Self-test: none.".to_owned()])
            .collect();
        let all: Vec<&str> = many.iter().map(String::as_str).collect();
        let kept = chosen(&all, 12);
        assert_eq!(kept.len(), 12);
        assert!(kept.is_sorted());
        for first in [0, 1, 31, 61, 62] {
            assert!(kept.contains(&first), "{first} of {kept:?}");
        }
    }

    #[test]
    fn a_long_line_is_cut_between_words() {
        let long = "word ".repeat(60);
        let short = shortened(&long);
        assert!(short.ends_with("word …") && short.chars().count() <= MOST_LETTERS + 2);
    }
}
