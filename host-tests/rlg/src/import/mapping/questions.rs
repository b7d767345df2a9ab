//! Questions on what neither a file nor its data decide, asked all at once with a command line to paste.

use std::fmt::Write as _;
use std::path::Path;

use crate::error::InputError;

/// A question with the answer that the data suggest.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The columns, and the question as a clause.
    pub asks: String,
    /// Option and values of the guess; with a word in capitals where nothing suggests one.
    pub answer: (&'static str, Vec<String>),
    /// True if the answer is a guess that `--yes` takes.
    pub is_guess: bool,
    /// Evidence for the guess.
    pub evidence: String,
}

impl Question {
    /// Returns the guess as on a command line.
    pub fn guess(&self) -> String {
        let (option, values) = &self.answer;
        let values: Vec<String> = values.iter().map(|value| quoted(value)).collect();
        format!("{option} {}", values.join(" "))
    }
}

/// Remark that an option takes all guesses.
const BY_OPTION: &str = " (--yes takes them)";
/// Beginning of the line with the command to paste.
const COMMAND: &str = "\n    ";

/// Returns a message of [`ask`] for callers without a command line: without the command to paste and its option.
pub fn without_command(message: &str) -> String {
    let (before, after) = message.split_once(COMMAND).unwrap_or((message, ""));
    let (_, questions) = after.split_once('\n').unwrap_or(("", after));
    let separator = if questions.is_empty() { "" } else { "\n" };
    format!("{}{separator}{questions}", before.replace(BY_OPTION, ""))
}

/// Makes the one message of all questions; `command` is the command line so far, words unquoted.
pub fn ask(file: &Path, questions: &[Question], command: &[String]) -> InputError {
    let mut words: Vec<String> = command.to_vec();
    for question in questions {
        words.push(question.answer.0.to_owned());
        words.extend(question.answer.1.iter().cloned());
    }
    let all_guessed = questions.iter().all(|question| question.is_guess);
    let count = match questions.len() {
        1 => "one answer".to_owned(),
        more => format!("{more} answers"),
    };
    let how = match all_guessed {
        true => BY_OPTION,
        false => ", and a value for each word in capitals",
    };
    let mut text = format!(
        "these guesses, or others in their place{how}:{COMMAND}{}",
        line(&words)
    );
    for question in questions {
        // Writing to a String cannot fail.
        let (asks, evidence) = (&question.asks, &question.evidence);
        let _ = write!(text, "\n  {asks}: {}: {evidence}", question.guess());
    }
    InputError::new(file, format!("needs {count}")).expected(text)
}

/// Returns a command line to paste.
pub fn line(words: &[String]) -> String {
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    words.join(" ")
}

/// Quotes a word for a shell, if needed.
fn quoted(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./:=,+@%^*".contains(letter);
    let is_bare = !word.is_empty() && word.chars().all(|letter| is_plain(letter) && letter != '*');
    match is_bare {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
