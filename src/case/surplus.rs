//! Arrays that hold more than is read of them: serde takes the elements that it needs and passes over the rest,
//! so that `gravity = [0, 0, 0, -9.81]` would run weightless.

use super::Case;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// An array that is too long.
pub(super) struct Surplus {
    /// Dotted path.
    pub path: String,
    /// Elements that are written.
    pub written: usize,
    /// Elements that are read.
    pub read: usize,
}

/// All arrays of `table` that are longer than what `case`, which was read from it, holds of them.
pub(super) fn surplus(table: &DeTable<'_>, case: &Case) -> Vec<Surplus> {
    let mut found = Vec::new();
    if let Ok(toml::Value::Table(read)) = toml::Value::try_from(case) {
        tables(table, &read, "", &mut found);
    }
    found
}

fn tables(written: &DeTable<'_>, read: &toml::Table, path: &str, found: &mut Vec<Surplus>) {
    for (key, value) in written {
        if let Some(other) = read.get(key.get_ref().as_ref()) {
            let path =
                if path.is_empty() { key.get_ref().to_string() } else { format!("{path}.{}", key.get_ref()) };
            values(value, other, path, found);
        }
    }
}

fn values(written: &Spanned<DeValue<'_>>, read: &toml::Value, path: String, found: &mut Vec<Surplus>) {
    match (written.get_ref(), read) {
        (DeValue::Table(written), toml::Value::Table(read)) => tables(written, read, &path, found),
        (DeValue::Array(written), toml::Value::Array(read)) => {
            for (k, (written, read)) in written.iter().zip(read).enumerate() {
                values(written, read, format!("{path}.{k}"), found);
            }
            if written.len() > read.len() {
                found.push(Surplus { path, written: written.len(), read: read.len() });
            }
        }
        _ => {}
    }
}
