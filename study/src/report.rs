//! What a study leaves: results.csv, results.json, report.md, and its charts as SVG.

use super::kept::VERSION;
use super::row::{Class, Row, told};
use crate::plot::Chart;
use seixo::error::{Error, Result};
use seixo::output::table::{Cell, Table};
use seixo::output::write_whole;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// What a study found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Charts and the names of their files.
    pub charts: Vec<(String, Chart)>,
    /// Findings, a paragraph each.
    pub findings: Vec<String>,
}

#[derive(Serialize)]
struct Json<'a> {
    study: &'a str,
    title: &'a str,
    version: &'static str,
    findings: &'a [String],
    rows: &'a [Row],
}

/// Columns of the table: parameters and values that any of the rows has.
fn columns(rows: &[Row]) -> (BTreeSet<&str>, BTreeSet<&str>) {
    let parameters = rows.iter().flat_map(|r| r.parameters.keys().map(String::as_str)).collect();
    let values = rows.iter().flat_map(|r| r.measured.values.keys().map(String::as_str)).collect();
    (parameters, values)
}

/// Write results.csv.
///
/// # Errors
/// [`Error::Io`].
pub fn write_table(path: &Path, rows: &[Row]) -> Result<()> {
    let (parameters, values) = columns(rows);
    let head = ["study", "index", "method"].into_iter().chain(parameters.iter().copied());
    let head = head.chain(["class", "reason"]).chain(values.iter().copied()).chain([
        "particles",
        "steps",
        "particle steps",
        "iterations",
        "matrix products",
        "wall median [s]",
        "wall shortest [s]",
        "wall longest [s]",
        "repetitions",
        "machine",
        "version",
        "hash",
    ]);
    let head: Vec<String> = head.map(str::to_owned).collect();
    // By rename, like every whole file: a reader never sees half a table.
    let draft = path.with_extension("csv.writing");
    let mut table = Table::create(&draft, &head)?;
    for row in rows {
        let (m, w) = (&row.measured, &row.measured.work);
        let mut cells: Vec<Cell> =
            vec![row.study.as_str().into(), (row.index as u64).into(), row.method.as_str().into()];
        cells
            .extend(parameters.iter().map(|p| Cell::from(row.parameters.get(*p).map_or("", String::as_str))));
        cells.extend([m.class.name().into(), Cell::from(m.reason.replace('\n', " ").as_str())]);
        cells.extend(values.iter().map(|v| Cell::from(m.value(v).unwrap_or(f64::NAN))));
        cells.extend([w.particles, w.steps, w.particle_steps, w.iterations].map(Cell::from));
        cells.push(w.products.into());
        let time = m.timing.map_or([f64::NAN; 3], |t| [t.median_s, t.shortest_s, t.longest_s]);
        cells.extend(time.map(Cell::from));
        cells.push(m.timing.map_or(0, |t| u64::from(t.repetitions)).into());
        cells.extend([m.machine.as_str(), row.version.as_str(), row.hash.as_str()].map(Cell::from));
        table.row(&cells)?;
    }
    table.flush()?;
    drop(table);
    std::fs::rename(&draft, path).map_err(Error::io(path))
}

/// A number for people: four digits.
pub fn short(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&x.abs()) {
        let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{x:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    } else {
        format!("{x:.3e}")
    }
}

/// The rows as a table in Markdown: parameters, class, values, time.
fn markdown(rows: &[Row]) -> String {
    let (parameters, values) = columns(rows);
    let mut head = vec!["method"];
    head.extend(&parameters);
    head.push("ended");
    head.extend(&values);
    let timed = rows.iter().any(|r| r.measured.timing.is_some());
    if timed {
        head.push("wall median (shortest to longest) [s]");
    }
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in rows {
        let mut cells = vec![row.method.clone()];
        cells.extend(parameters.iter().map(|p| row.parameters.get(*p).cloned().unwrap_or_default()));
        cells.push(row.measured.class.name().into());
        cells.extend(values.iter().map(|v| row.measured.value(v).map(short).unwrap_or_default()));
        if timed {
            cells.push(row.measured.timing.map_or_else(String::new, |t| {
                format!("{} ({} to {})", short(t.median_s), short(t.shortest_s), short(t.longest_s))
            }));
        }
        let cells: Vec<String> = cells.iter().map(|c| c.replace('|', "/")).collect();
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text
}

/// The versions of the program that computed `rows`, with what each one did where there are several.
pub(crate) fn versions(rows: &[Row]) -> String {
    if rows.is_empty() {
        return format!("seixo {VERSION}");
    }
    let mut points: BTreeMap<&str, usize> = BTreeMap::new();
    rows.iter().for_each(|row| *points.entry(row.version.as_str()).or_default() += 1);
    let several = points.len() > 1;
    let told = points.iter().map(|(version, count)| {
        let count = if several { format!(" ({count} of {} points)", rows.len()) } else { String::new() };
        format!("seixo {version}{count}")
    });
    told.collect::<Vec<_>>().join(", ")
}

/// Write everything into `out`. Returns the findings and what did not end well, for the terminal.
///
/// # Errors
/// [`Error::Io`].
pub fn write(
    out: &Path,
    name: &str,
    title: &str,
    question: &str,
    rows: &[Row],
    report: &Report,
) -> Result<String> {
    write_table(&out.join("results.csv"), rows)?;
    let json = Json { study: name, title, version: VERSION, findings: &report.findings, rows };
    let json = serde_json::to_string_pretty(&json).unwrap_or_default() + "\n";
    write_whole(&out.join("results.json"), json.as_bytes())?;
    let mut text = format!("# {title}\n\n");
    if !question.is_empty() {
        let _ = writeln!(text, "{}\n", question.trim());
    }
    for finding in &report.findings {
        let _ = writeln!(text, "- {finding}");
    }
    let mut machines: Vec<&str> = rows.iter().map(|r| r.measured.machine.as_str()).collect();
    machines.retain(|m| !m.is_empty());
    machines.sort_unstable();
    machines.dedup();
    let _ = writeln!(text, "\n{}; computed on: {}.\n", versions(rows), machines.join("; "));
    for (file, chart) in &report.charts {
        if chart.write(&out.join(file))? {
            let _ = writeln!(text, "![{}]({file}.svg)\n", chart.title);
        }
    }
    text.push_str(&markdown(rows));
    let bad: Vec<&Row> = rows.iter().filter(|r| r.measured.class != Class::Ok).collect();
    if !bad.is_empty() {
        text.push_str("\nNot ok:\n\n");
        for row in &bad {
            let (class, reason) = (row.measured.class.name(), &row.measured.reason);
            let _ = writeln!(
                text,
                "- {}: {class}: {}",
                told(&row.method, &row.setting()),
                reason.replace('\n', " ")
            );
        }
    }
    write_whole(&out.join("report.md"), text.as_bytes())?;
    Ok(report.findings.iter().fold(String::new(), |t, f| t + f + "\n"))
}

#[cfg(test)]
mod tests {
    use super::{short, versions};
    use crate::row::Row;

    #[test]
    fn points_of_several_versions_are_told_apart() {
        let row = |version: &str| Row { version: version.into(), ..Row::default() };
        assert_eq!(versions(&[row("0.1.0"), row("0.1.0")]), "seixo 0.1.0");
        assert!(versions(&[]).starts_with("seixo "));
        let told = versions(&[row("0.2.0"), row("0.1.0"), row("0.2.0")]);
        assert_eq!(told, "seixo 0.1.0 (1 of 3 points), seixo 0.2.0 (2 of 3 points)");
    }

    #[test]
    fn four_digits_are_enough_for_people() {
        assert_eq!(short(0.012345678), "0.01235");
        assert_eq!(short(1234.5678), "1235");
        assert_eq!(short(2.0), "2");
        assert_eq!(short(1.23456e-7), "1.235e-7");
        assert_eq!(short(1000.0), "1000");
    }
}
