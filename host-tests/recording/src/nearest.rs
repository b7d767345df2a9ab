//! Finds the known name that a misspelt one was meant to be.

/// Letters that a misspelt word has wrong, left out, more or exchanged.
const MISSPELT: usize = 2;

/// Shortest word of which a longer one is taken for the same: `rate` for `rate_hz`.
const SHORTEST: usize = 4;

/// The name among `known` that `word` was meant to be; `None` where it is like none of them.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |name: &&str| strsim::damerau_levenshtein(name, word);
    let is_near = |name: &&str| {
        let (short, long) = match name.len() < word.len() {
            true => (*name, word),
            false => (word, *name),
        };
        let is_part = short.len() >= SHORTEST && long.starts_with(short);
        is_part || (short.len() > MISSPELT && distance(name) <= MISSPELT)
    };
    known.into_iter().filter(is_near).min_by_key(distance)
}
