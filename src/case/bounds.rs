//! Bounds that attributes of a field cannot say, for the schema. `check` has the last word; a test holds the one against the
//! other. Here the committed schema is held against the structs.

use super::Case;
use super::motion_file::allow_files;
use schemars::Schema;
use serde_json::Value;

/// Each number of a list is more than 0.
pub(super) fn each_positive(schema: &mut Schema) {
    if let Some(items) = schema.get_mut("items").and_then(Value::as_object_mut) {
        items.insert("exclusiveMinimum".into(), 0.into());
    }
}

/// Nothing stands in a list twice.
pub(super) fn each_once(schema: &mut Schema) {
    schema.insert("uniqueItems".into(), true.into());
}

/// Each number of a list is 1 or more.
pub(super) fn each_counted(schema: &mut Schema) {
    if let Some(items) = schema.get_mut("items").and_then(Value::as_object_mut) {
        items.insert("minimum".into(), 1.into());
    }
}

#[test]
fn the_committed_schema_is_current() {
    let mut schema = schemars::schema_for!(Case).to_value();
    allow_files(&mut schema);
    let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
    if std::env::var_os("SEIXO_WRITE_SCHEMA").is_some() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/schema/case.schema.json");
        return std::fs::write(file, text).unwrap();
    }
    assert!(text == Case::schema(), "schema/case.schema.json is out of date: .ci/schema");
}
