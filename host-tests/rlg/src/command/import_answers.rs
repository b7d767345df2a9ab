//! Questions of an import, asked one by one where a person sits at the terminal.

use std::path::Path;

use console::Term;
use dialoguer::Input;

use crate::error::InputError;
use crate::import::mapping::questions::Question;

/// Option with its value, as on a command line.
pub(super) type Answer = (&'static str, String);

/// Asks; the guess is the answer that Enter gives.
///
/// # Errors
/// The terminal gives no answer, as at its end.
pub(super) fn ask(
    term: &Term,
    file: &Path,
    questions: &[Question],
) -> Result<Vec<Answer>, InputError> {
    let unanswered = |error: dialoguer::Error| {
        InputError::new(file, format!("has a question without an answer ({error})"))
            .expected("an answer, or --yes, which takes the guesses")
    };
    let mut answers = Vec::new();
    for question in questions {
        let (option, values) = &question.answer;
        let told = format!("{}: {}", question.asks, question.evidence);
        term.write_line(&told)
            .map_err(|error| unanswered(error.into()))?;
        for guess in values {
            let mut input = Input::<String>::new().with_prompt(format!("  {option}"));
            if question.is_guess {
                input = input.default(guess.clone());
            }
            let typed = input.interact_text_on(term).map_err(unanswered)?;
            answers.push((*option, completed(typed.trim(), guess)));
        }
    }
    Ok(answers)
}

/// Completes an answer that gives only the last part of a guess: `rad/s` for `gyro_rate:deg/s`, `temperature` for `t=none`.
fn completed(typed: &str, guess: &str) -> String {
    match (guess.rsplit_once('='), guess.rsplit_once(':')) {
        (Some((column, _)), _) if !typed.contains('=') => format!("{column}={typed}"),
        (None, Some((before, _))) if !typed.contains(':') => format!("{before}:{typed}"),
        _ => typed.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::completed;

    #[test]
    fn a_short_answer_takes_the_rest_from_the_guess() {
        assert_eq!(completed("rad/s", "gyro_rate:deg/s"), "gyro_rate:rad/s");
        assert_eq!(completed("force:g", "gyro_rate:deg/s"), "force:g");
        assert_eq!(
            completed("reference_angle:z", "a=none"),
            "a=reference_angle:z"
        );
        assert_eq!(completed("b=none", "a=none"), "b=none");
        assert_eq!(completed("100", "HZ"), "100");
        assert_eq!(completed("zyx", "xyz"), "zyx");
    }
}
