//! Finished points as files, `points/HASH.json`: read back, told of, gathered from several folders.

use super::row::{Class, FORMAT, Row};
use seixo::console::remark;
use seixo::error::{Error, Result};
use seixo::output::write_whole;
use std::path::{Path, PathBuf};

/// The version of the program, as rows have it.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The file of a point.
pub(crate) fn point(folder: &Path, hash: &str) -> PathBuf {
    folder.join(format!("{hash}.json"))
}

/// A finished point; what is not whole or of another format is computed again.
pub(crate) fn read(path: &Path, hash: &str) -> Option<Row> {
    let row: Row = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    // Without a GPU a point is skipped, which another machine may change.
    let kept = row.measured.class != Class::Skipped;
    (row.format == FORMAT && row.hash == hash && kept).then_some(row)
}

/// A row as it is kept.
pub(crate) fn json(row: &Row) -> String {
    // Only finite numbers are kept in rows, so that this cannot fail.
    serde_json::to_string_pretty(row).unwrap_or_default() + "\n"
}

/// Says how many of `all` points are `kept`, and which of them are not what a new one would be.
pub(crate) fn told_of_kept(study: &str, all: usize, kept: &[&Row], repetitions: u32) {
    if !kept.is_empty() {
        remark(&format!("{study}: {} of {all} points are finished already", kept.len()));
    }
    let another = kept.iter().filter(|row| row.version != VERSION).count();
    if another > 0 {
        remark(&format!(
            "note: {another} of them are of another version of seixo, as the report says: remove points/ to compute them again"
        ));
    }
    let fewer = |row: &&&Row| row.measured.timing.is_some_and(|t| t.repetitions < repetitions);
    let fewer = kept.iter().filter(fewer).count();
    if fewer > 0 {
        remark(&format!(
            "note: {fewer} of them were timed over fewer runs than --repetitions {repetitions}: remove points/ to time them again"
        ));
    }
}

/// Rows of the points with these `hashes` that are finished in the folder `out` or in `others`, in this order; those of the others
/// are copied to `out`.
///
/// # Errors
/// [`Error::Usage`] if none of them is, before anything is written; [`Error::Io`].
pub fn gather(hashes: &[String], out: &Path, others: &[PathBuf]) -> Result<Vec<Row>> {
    let places: Vec<&Path> = std::iter::once(out).chain(others.iter().map(PathBuf::as_path)).collect();
    let find = |hash: &String| {
        let rows =
            places.iter().enumerate().map(|(k, place)| (k, read(&point(&place.join("points"), hash), hash)));
        let mut rows: Vec<(usize, Row)> = rows.filter_map(|(k, row)| Some((k, row?))).collect();
        // One that was refused in one part may be whole in another.
        rows.sort_by_key(|(k, row)| (row.measured.refused, *k));
        rows.into_iter().next()
    };
    let found: Vec<Option<(usize, Row)>> = hashes.iter().map(find).collect();
    if found.iter().all(Option::is_none) {
        let names: Vec<String> = others.iter().map(|o| o.display().to_string()).collect();
        let text = format!(
            "none of the {} points of this study is finished in {}: nothing is joined, and what {} holds stays as it is",
            hashes.len(),
            names.join(", "),
            out.display()
        );
        return Err(Error::usage("collect", text));
    }
    let folder = out.join("points");
    std::fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
    for (_, row) in found.iter().flatten().filter(|(place, _)| *place > 0) {
        write_whole(&point(&folder, &row.hash), json(row).as_bytes())?;
    }
    let numbered = found.into_iter().enumerate();
    Ok(numbered.filter_map(|(k, row)| row.map(|(_, row)| Row { index: k, ..row })).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_written_where_nothing_is_found() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let [a, out] = folders.each_ref().map(|f| f.path().to_path_buf());
        let error = gather(&["0".into()], &out, &[a]).unwrap_err().to_string();
        assert!(error.contains("none of the 1 points") && !out.join("points").exists(), "{error}");
    }
}
