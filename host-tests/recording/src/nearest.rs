//! Finds the known name nearest to a misspelt one.

/// Largest edit distance of a misspelt word: letters wrong, missing, added or exchanged.
const MISSPELT: usize = 2;

/// Smallest length of a word that is accepted as an abbreviation of a longer one: `rate` for `rate_hz`.
const SHORTEST: usize = 4;

/// Returns the name among `known` that `word` is a misspelling of; `None` if no name is similar.
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
