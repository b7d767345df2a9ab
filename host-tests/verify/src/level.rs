//! Level of verification.

use std::time::{SystemTime, UNIX_EPOCH};

/// Level of verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Formatting, lints and tests of seconds.
    Quick,
    /// Every check that a change could break.
    Full,
    /// The same, and the longer searches.
    Nightly,
    /// Files that install the command and the Python package without a compiler, made and tried.
    Archive,
}

impl Level {
    /// Parses the command's arguments; `full` if there are none.
    ///
    /// # Errors
    /// The argument given instead.
    pub fn of(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let level = match arguments.next().as_deref() {
            None | Some("full") => Self::Full,
            Some("quick") => Self::Quick,
            Some("nightly") => Self::Nightly,
            Some("archive") => Self::Archive,
            Some(other) => {
                return Err(format!("{other}: expected quick, full, nightly or archive"));
            }
        };
        match arguments.next() {
            None => Ok(level),
            Some(more) => Err(format!("{more}: expected one argument")),
        }
    }
}

/// Returns a seed that changes every day.
pub fn days_since_1970() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs() / 86_400)
}

#[cfg(test)]
mod tests {
    use super::Level;

    #[test]
    fn a_level_is_read_and_another_word_is_refused() {
        let of = |words: &[&str]| Level::of(words.iter().map(|word| (*word).to_owned()));
        assert_eq!(of(&[]), Ok(Level::Full));
        assert_eq!(of(&["nightly"]), Ok(Level::Nightly));
        assert_eq!(of(&["quick"]), Ok(Level::Quick));
        assert_eq!(of(&["archive"]), Ok(Level::Archive));
        assert!(of(&["fast"]).is_err_and(|problem| problem.contains("nightly or archive")));
        assert!(of(&["full", "full"]).is_err());
    }
}
