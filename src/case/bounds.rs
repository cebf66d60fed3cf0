//! Bounds that attributes of a field cannot say, for the schema. `check` has the last word; a test holds the one against the
//! other.

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
