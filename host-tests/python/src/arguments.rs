//! Sentences of the command in the words of Python's functions: `--unit gyro_rate:deg/s` is `unit={"gyro_rate": "deg/s"}`.

/// Form of an argument's value.
#[derive(Clone, Copy)]
enum Takes {
    /// Nothing: a flag.
    Nothing,
    /// A number or a file.
    Number,
    /// A text: a name in capitals, or one of these words.
    Text(&'static [&'static str]),
    /// Key and text with this character between them, or one of these words.
    Keyed(char, &'static [&'static str]),
}

/// Full name of the option `--rate`, which the parser's messages use.
const FULL_RATE: &str = "rate-hz";

/// Options of the command that are arguments of Python's functions. Others are named as the command names them.
const ARGUMENTS: [(&str, Takes); 23] = [
    ("adapt-s", Takes::Number),
    ("anyway", Takes::Nothing),
    ("at-rest", Takes::Nothing),
    ("core", Takes::Text(&["f32", "fixed", "reference"])),
    ("euler", Takes::Text(&["none"])),
    (
        "format",
        Takes::Text(&["csv", "mat", "hdf5", "parquet", "mcap"]),
    ),
    ("grade", Takes::Text(&["rlg", "fog", "mems", "consumer"])),
    ("gravity", Takes::Number),
    ("hold-out", Takes::Number),
    ("instrument", Takes::Text(&[])),
    ("latitude-deg", Takes::Number),
    ("map", Takes::Keyed('=', &[])),
    ("model", Takes::Number),
    ("most-rows", Takes::Number),
    ("out", Takes::Number),
    ("output-every", Takes::Number),
    ("rate", Takes::Number),
    (FULL_RATE, Takes::Number),
    ("sampling", Takes::Text(&["mean", "instant"])),
    ("start", Takes::Text(&[])),
    ("threads", Takes::Number),
    ("time", Takes::Keyed(':', &["none"])),
    ("unit", Takes::Keyed(':', &[])),
];

/// Returns a sentence with Python's arguments in place of the command's options.
pub(crate) fn in_python(sentence: &str) -> String {
    let mut text = String::new();
    let mut rest = sentence;
    while let Some((before, after)) = rest.split_once("--") {
        text.push_str(before);
        let is_name = |letter: char| letter.is_ascii_lowercase() || letter == '-';
        let end = after.find(|letter| !is_name(letter));
        let (name, tail) = after.split_at(end.unwrap_or(after.len()));
        let known = ARGUMENTS.iter().find(|(option, _)| *option == name);
        rest = match known {
            Some((_, takes)) => {
                let (value, tail) = value(*takes, tail);
                let name = if name == FULL_RATE { "rate" } else { name };
                text.push_str(&format!("{}={value}", name.replace('-', "_")));
                tail
            }
            None => {
                text.push_str("--");
                text.push_str(name);
                tail
            }
        };
    }
    text + rest
}

/// Splits the value after an option off, in Python's form; nothing if the sentence goes on without one.
fn value(takes: Takes, tail: &str) -> (String, &str) {
    let nothing = (String::new(), tail);
    let Some(begun) = tail.strip_prefix([' ', '=']) else {
        return match takes {
            Takes::Nothing => ("True".to_owned(), tail),
            _ => nothing,
        };
    };
    // A message of the parser names its own placeholder.
    if let Some((_, tail)) = begun
        .strip_prefix('<')
        .and_then(|rest| rest.split_once('>'))
    {
        return (String::new(), tail);
    }
    let (word, after) = word(begun);
    match takes {
        Takes::Nothing => ("True".to_owned(), tail),
        Takes::Number if stands_for_value(word) => (word.to_owned(), after),
        Takes::Text(words) if words.contains(&word) || stands_for_value(word) => {
            (format!("{word:?}"), after)
        }
        Takes::Keyed(_, words) if words.contains(&word) => (format!("{word:?}"), after),
        Takes::Keyed(between, _) => keyed(between, begun).unwrap_or(nothing),
        Takes::Number | Takes::Text(_) => nothing,
    }
}

/// Splits the first word off, without the punctuation of the sentence.
fn word(text: &str) -> (&str, &str) {
    let end = text.find(|letter: char| letter.is_whitespace() || ",;)'".contains(letter));
    let (word, _) = text.split_at(end.unwrap_or(text.len()));
    let word = word.trim_end_matches(['.', ':']);
    text.split_at(word.len())
}

/// True for a number, a name in capitals that stands for a value, and a list of words.
fn stands_for_value(word: &str) -> bool {
    let is_name = |letter: char| letter.is_ascii_uppercase() || letter == '_';
    !word.is_empty()
        && (word.parse::<f64>().is_ok()
            || word.chars().all(is_name)
            || word.contains(['|', ':', '/']))
}

/// Splits `KEY:TEXT` off. A key is the name of a column and may have blanks, and quotes around the whole.
fn keyed(between: char, begun: &str) -> Option<(String, &str)> {
    let quote = begun
        .chars()
        .next()
        .filter(|first| ['\'', '"'].contains(first));
    let (sentence, after) = match quote {
        Some(quote) => begun[1..].split_once(quote)?,
        None => (begun, ""),
    };
    let end = match quote {
        Some(_) => sentence.len(),
        None => sentence
            .find("--")
            .or(sentence.find(';'))
            .unwrap_or(sentence.len()),
    };
    let (key, text) = sentence[..end].split_once(between)?;
    if text.is_empty() || text.starts_with(char::is_whitespace) {
        return None;
    }
    let (text, after) = match quote {
        Some(_) => (text, after),
        None => {
            let (text, _) = word(text);
            (text, &begun[key.len() + between.len_utf8() + text.len()..])
        }
    };
    Some((format!("{{{key:?}: {text:?}}}"), after))
}
