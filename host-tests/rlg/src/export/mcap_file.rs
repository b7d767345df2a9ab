//! Writes MCAP: a topic a table, a JSON object a row, with a JSON schema. Foxglove and the `mcap` command open it.
//!
//! Chunks are not compressed (the library's codec is C code of another version than the one that Parquet brings);
//! `mcap compress` does it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Seek, Write};

use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions};
use serde_json::{Map, Value, json};

use super::sheet::{STAMPS, Sheet};

/// Nanoseconds in a second.
const SECOND_NS: f64 = 1e9;

/// Writes `sheets`; stamp 0 is `start_s` after 1970, or the file's zero if that is unknown.
///
/// Times of the format are whole nanoseconds from 1970 on and not negative; every row also holds its stamp unchanged.
pub fn write(sheets: &[Sheet], start_s: Option<f64>, file: impl Write + Seek) -> McapResult<()> {
    let options = WriteOptions::new()
        .compression(None)
        .library(concat!("rlg ", env!("CARGO_PKG_VERSION")));
    let mut writer = options.create(file)?;
    let zero_ns = start_s.map_or_else(|| zero_ns(sheets), |start_s| (start_s * SECOND_NS) as i128);
    for sheet in sheets {
        let schema = schema(sheet).to_string();
        let schema = writer.add_schema(&sheet.name, "jsonschema", schema.as_bytes())?;
        let topic = format!("/{}", sheet.name);
        let channel_id = writer.add_channel(schema, &topic, "json", &BTreeMap::new())?;
        for row in 0..sheet.rows() {
            let since_zero_ns = (sheet.columns[0].1[row] * SECOND_NS).round() as i128;
            let time_ns = u64::try_from(zero_ns + since_zero_ns).unwrap_or(0);
            let header = MessageHeader {
                channel_id,
                sequence: row as u32,
                log_time: time_ns,
                publish_time: time_ns,
            };
            writer.write_to_known_channel(&header, message(sheet, row).as_bytes())?;
        }
    }
    writer.finish()?;
    Ok(())
}

/// Returns the time of stamp 0 if some stamps are negative and no date is known: a whole second that makes all times
/// non-negative \[ns\].
fn zero_ns(sheets: &[Sheet]) -> i128 {
    let stamps_s = sheets.iter().filter_map(|sheet| sheet.columns[0].1.first());
    let least_s = stamps_s.fold(0.0_f64, |least, stamp_s| least.min(*stamp_s));
    (-least_s).ceil() as i128 * SECOND_NS as i128
}

fn schema(sheet: &Sheet) -> Value {
    let property = |(name, _): &(String, Vec<f64>)| {
        let kind = match name.as_str() {
            STAMPS => json!("number"),
            _ => json!(["number", "null"]),
        };
        (name.clone(), json!({ "type": kind }))
    };
    let properties: Map<String, Value> = sheet.columns.iter().map(property).collect();
    json!({ "type": "object", "title": sheet.name, "properties": properties })
}

/// Formats a row as JSON; missing values are null.
fn message(sheet: &Sheet, row: usize) -> String {
    let mut text = String::from("{");
    for (name, values) in &sheet.columns {
        let comma = if text.len() > 1 { "," } else { "" };
        // Names are letters, digits and `_`; writing to a String cannot fail.
        let _ = match values[row] {
            value if value.is_finite() => write!(text, "{comma}\"{name}\":{value:?}"),
            _ => write!(text, "{comma}\"{name}\":null"),
        };
    }
    text.push('}');
    text
}
