//! Keys of `recording.toml`, with their description in `docs/files.md`, and the form of such a list.

use serde::de::{DeserializeOwned, Deserializer, Error as _, Visitor, value::Error};
use serde::forward_to_deserialize_any;

use super::manifest::{ChannelEntry, Manifest, SegmentEntry, SiteEntry, TableEntry};

/// Key of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// Section of the key, as TOML writes it inside the outer brackets; empty at the top, `[table]` if there may be
    /// several.
    pub section: &'static str,
    /// Name.
    pub name: &'static str,
    /// Unit of the value; empty without a unit.
    pub unit: &'static str,
    /// Meaning of an absent key.
    pub default: &'static str,
    /// Meaning of the key.
    pub meaning: &'static str,
}

impl Key {
    /// Returns the top-level key that contains it.
    pub fn top(&self) -> &'static str {
        let bare = self.section.trim_matches(['[', ']']);
        match bare.split('.').next() {
            Some("") | None => self.name,
            Some(first) => first,
        }
    }
}

/// All keys of `recording.toml`, in the order of the file.
#[rustfmt::skip]
pub const KEYS: &[Key] = &[
    key("", "format", "", "must be there", "1: the form that this page describes"),
    key("", "name", "", "the folder's name", "name of the recording"),
    key("", "instrument", "", "unknown", "the instrument, as its findings shall be put beside those of others"),
    key("", "start", "", "unknown", "when time 0 of the recording was: date, time and zone, such as `2026-03-01T12:00:00Z`"),
    key("site", "latitude_rad", "rad", "must be there", "geographic latitude, north positive; the section may be left out"),
    key("site", "gravity_m_s2", "m/s²", "must be there", "magnitude of gravity"),
    key("[table]", "file", "", "must be there", "a Parquet file, or CSV with a header row, in the same folder"),
    key("[table]", "rate_hz", "Hz", "`time` is there", "rows a second: row k covers start + k/rate to start + (k+1)/rate"),
    key("[table]", "time", "", "`rate_hz` is there", "the column with the time of each row in seconds, rising"),
    key("[table]", "start_s", "s", "0", "beginning of row 0, beside `rate_hz`"),
    key("[table.channel]", "column", "", "must be there", "the column's name in the file"),
    key("[table.channel]", "quantity", "", "must be there", "what it measures, of the list below; others are kept for the search"),
    key("[table.channel]", "axis", "", "the quantity has none", "body axis `x`, `y` or `z`; of an attitude `w`, `x`, `y`, `z`"),
    key("[table.channel]", "unit", "", "the quantity's", "unit of what is stored × scale + offset: `deg/s`, `g`, `degC`, ...; turned into the quantity's own"),
    key("[table.channel]", "sampling", "", "`mean`", "`mean` over the row, or `instant`: the value at the row's end, of a logger that asks for a rate or force (of `reference_increment`: that rate times the period)"),
    key("[table.channel]", "scale", "unit / stored", "1", "value = stored × scale + offset"),
    key("[table.channel]", "offset", "unit", "0", "see `scale`"),
    key("[segment]", "name", "", "must be there", "name of a stretch of time"),
    key("[segment]", "kind", "", "must be there", "`still`, `coning`, `vibration`, `slew`, `spin`, or free text"),
    key("[segment]", "start_s", "s", "must be there", "its beginning"),
    key("[segment]", "end_s", "s", "must be there", "its end"),
];

/// Key of a section, with its unit, default and meaning.
pub const fn key(
    section: &'static str,
    name: &'static str,
    unit: &'static str,
    default: &'static str,
    meaning: &'static str,
) -> Key {
    Key {
        section,
        name,
        unit,
        default,
        meaning,
    }
}

/// Names accepted by the reader, by section.
pub fn read_names() -> [(&'static str, &'static [&'static str]); 5] {
    [
        ("", names::<Manifest>()),
        ("site", names::<SiteEntry>()),
        ("[table]", names::<TableEntry>()),
        ("[table.channel]", names::<ChannelEntry>()),
        ("[segment]", names::<SegmentEntry>()),
    ]
}

/// Names of the fields from which `T` is deserialised.
pub fn names<T: DeserializeOwned>() -> &'static [&'static str] {
    let mut names: &[&str] = &[];
    // The error is expected: the fields are recorded before it.
    drop(T::deserialize(Names(&mut names)));
    names
}

/// Deserialiser that records the fields requested by a type.
struct Names<'a>(&'a mut &'static [&'static str]);

impl<'de> Deserializer<'de> for Names<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(Error::custom("no value"))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        *self.0 = fields;
        self.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}
