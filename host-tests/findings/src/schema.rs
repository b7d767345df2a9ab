//! JSON Schema of `diagnosis.json`, made from its types.

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};

use crate::result::Diagnosis;

/// Name of the schema in its own text.
const TITLE: &str = "diagnosis.json of rlg";

/// Makes the schema (draft 2020-12), each field with its description and unit.
///
/// Fields that it does not list are permitted: a reader passes over what a later version adds
/// ([`FORMAT`](crate::result::FORMAT)).
pub fn diagnosis() -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<Diagnosis>();
    schema.insert("title".to_owned(), TITLE.into());
    RecursiveTransform(plain_description).transform(&mut schema);
    schema
}

/// Removes the signs of Rust's documentation from a description.
fn plain_description(schema: &mut Schema) {
    let Some(text) = schema.get("description").and_then(|text| text.as_str()) else {
        return;
    };
    let plain = text.replace(['\\', '`'], "").replace('\n', " ");
    schema.insert("description".to_owned(), plain.into());
}
