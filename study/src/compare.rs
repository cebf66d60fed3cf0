//! Errors of curves: against an experiment, or against the finest run of the study.

use super::definition::{Definition, ErrorMeasure, Files};
use super::row::{Class, Row};
use super::validation::reduce::distance;
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use seixo::error::{Error, Result};
use std::collections::BTreeMap;

impl ErrorMeasure {
    /// Name of the error, as in the tables.
    pub fn name(&self) -> String {
        match (&self.name, &self.value, &self.curve, &self.against) {
            (Some(name), ..) => name.clone(),
            (None, Some(value), ..) => value.clone(),
            (None, None, Some(curve), Some(against)) => format!("{curve} against {against} [-]"),
            _ => "error [-]".into(),
        }
    }
}

/// Two columns of numbers from a CSV text; lines that begin with `#` and the header are passed over.
///
/// # Errors
/// [`Error::Case`] if there are fewer than two rows.
pub fn table(name: &str, text: &str) -> Result<Vec<[f64; 2]>> {
    let rows: Vec<[f64; 2]> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .filter_map(|l| {
            let mut cells = l.split(',').map(|c| c.trim().parse::<f64>());
            Some([cells.next()?.ok()?, cells.next()?.ok()?])
        })
        .collect();
    if rows.len() < 2 {
        return Err(Error::file(name, "", format!("{name}: expected two columns of numbers")));
    }
    Ok(rows)
}

/// Rms difference of `curve` from `reference` at the points of `reference` that `curve` covers. `None` if they
/// share fewer than two points. In gaps of either there is nothing to compare.
pub fn difference(curve: &[[f64; 2]], reference: &[[f64; 2]]) -> Option<f64> {
    distance(curve, reference).map(|(rms, _)| rms)
}

/// The row to compare with: the one of `rows` with the most particles, and of those the most steps, that has `curve`.
pub fn finest<'a>(rows: &[&'a Row], curve: &str) -> Option<&'a Row> {
    let usable = |r: &&'a Row| r.measured.class <= Class::Degraded && r.measured.curves.contains_key(curve);
    let key = |r: &Row| (r.measured.work.particles, r.measured.work.steps);
    rows.iter().copied().filter(usable).max_by_key(|r| key(r))
}

/// Points of a reference of the curve `name` that a run with `curve` could come to: an experiment's tank may be longer than
/// that of a case, whose front ends at its last wall. Of every other curve all of them.
pub fn within(name: &str, reference: &[[f64; 2]], curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let most = curve.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
    reference.iter().copied().filter(|r| !name.starts_with("front") || r[1] <= most).collect()
}

/// A chart of the curves themselves for each one that is compared, with everything it is compared with.
///
/// # Errors
/// A reference file that cannot be read.
pub fn charts(study: &Definition, rows: &[Row], files: &Files) -> Result<Vec<(String, Chart)>> {
    let mut charts: Vec<(String, Chart)> = Vec::new();
    let mut names: Vec<&String> = study.error.iter().filter_map(|e| e.curve.as_ref()).collect();
    names.dedup();
    for name in names {
        let with = rows.iter().filter(|r| r.measured.class <= Class::Degraded);
        let with: Vec<&Row> = with.filter(|r| r.measured.curves.contains_key(name)).collect();
        let mut series = Vec::new();
        for (k, row) in with.iter().enumerate() {
            let label = row.label();
            let stroke = if k < COLORS.len() { Stroke::Solid } else { Stroke::Dashed };
            let points = row.measured.curves[name].clone();
            series.push(Series::line(&label, COLORS[k % COLORS.len()], stroke, points));
        }
        let marks = [Mark::Circle, Mark::Square, Mark::Triangle, Mark::Star];
        let references = study.error.iter().filter(|e| e.curve.as_ref() == Some(name));
        let references =
            references.filter_map(|e| e.against.as_ref().filter(|a| *a != "finest").map(|a| (e, a)));
        for (k, (error, against)) in references.enumerate() {
            let most =
                with.iter().flat_map(|r| r.measured.curves[name].last()).map(|p| p[0]).fold(0.0, f64::max);
            let all: Vec<[f64; 2]> = with.iter().flat_map(|r| r.measured.curves[name].clone()).collect();
            let mut points = within(name, &table(against, &files(against)?)?, &all);
            points.retain(|p| p[0] <= most);
            let label = error.name().replace("front against ", "experiment: ").replace(" [-]", "");
            series.push(Series::marks(&label, "#000000", marks[k % marks.len()], 4.5, points));
        }
        let (x, y) = match name.as_str() {
            "front scaled" => ("T = t sqrt(2 g / L) [-]", "Z = x / L [-]"),
            "front" => ("time [s]", "front, x of the foremost water [m]"),
            "energy" => ("time [s]", "energy over its start [-]"),
            _ => ("time [s]", name.as_str()),
        };
        let owned: Vec<Row> = with.iter().map(|r| (*r).clone()).collect();
        charts.push((
            super::work_precision::file_name(&study.name, name, "curve"),
            Chart {
                title: format!("{}: {name}", study.title),
                subtitle: super::work_precision::machines(&owned),
                x: Axis::linear(x),
                y: Axis::linear(y),
                series,
            },
        ));
    }
    Ok(charts)
}

/// Places in `rows` of those of the same scene, by the values of the axes that make one.
fn by_scene(study: &Definition, rows: &[Row]) -> Vec<Vec<usize>> {
    let axes = study.scene_axes();
    let mut scenes: BTreeMap<Vec<Option<&String>>, Vec<usize>> = BTreeMap::new();
    for (k, row) in rows.iter().enumerate() {
        scenes.entry(axes.iter().map(|axis| row.parameters.get(*axis)).collect()).or_default().push(k);
    }
    scenes.into_values().collect()
}

/// Put the errors of all curves into `rows`.
///
/// # Errors
/// A reference file that cannot be read.
pub fn curves(study: &Definition, rows: &mut [Row], files: &Files) -> Result<()> {
    for error in &study.error {
        let (Some(curve), Some(against)) = (&error.curve, &error.against) else { continue };
        let name = error.name();
        let table = if against == "finest" { None } else { Some(table(against, &files(against)?)?) };
        // A scene is held against its own finest row.
        for scene in by_scene(study, rows) {
            let own: Vec<&Row> = scene.iter().map(|&k| &rows[k]).collect();
            let (reference, finest) = match (&table, finest(&own, curve)) {
                (Some(table), _) => (table.clone(), None),
                (None, Some(row)) => (row.measured.curve(curve).unwrap_or_default(), Some(row.index)),
                (None, None) => continue,
            };
            let range = reference.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
            for k in scene {
                let row = &mut rows[k];
                let Some(points) = row.measured.curve(curve).filter(|_| Some(row.index) != finest) else {
                    continue;
                };
                let inside =
                    if finest.is_some() { reference.clone() } else { within(curve, &reference, &points) };
                if let Some(rms) = difference(&points, &inside) {
                    row.measured.put(&name, rms / range);
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{difference, table, within};

    #[test]
    fn curves_are_compared_where_both_are_known() {
        let curve = [[0.0, 0.0], [2.0, 4.0]];
        assert_eq!(difference(&curve, &[[0.5, 1.0], [1.0, 2.0], [9.0, 100.0]]), Some(0.0));
        assert_eq!(difference(&curve, &[[0.0, 1.0], [1.0, 3.0]]), Some(1.0));
        assert_eq!(difference(&curve, &[[5.0, 1.0], [1.0, 3.0]]), None);
        let gap = [[0.0, 0.0], [1.0, f64::NAN], [2.0, 4.0], [3.0, 4.0]];
        assert_eq!(difference(&gap, &[[0.0, 0.0], [1.5, 9.0], [2.5, 4.0], [3.0, f64::NAN]]), Some(0.0));
    }

    #[test]
    fn a_peak_that_a_run_does_not_reach_is_compared_but_a_front_beyond_its_tank_is_not() {
        let (run, reference) = ([[0.0, 0.0], [2.0, 1.0]], [[0.0, 0.0], [1.0, 3.0], [2.0, 1.0]]);
        assert_eq!(within("H2 [m]", &reference, &run), reference);
        assert_eq!(within("front scaled", &reference, &run), [[0.0, 0.0], [2.0, 1.0]]);
    }

    #[test]
    fn a_table_has_a_source_a_header_and_numbers() {
        assert_eq!(table("t", "# source\nt,x\n0,1\n1, 2.5\n").unwrap(), [[0.0, 1.0], [1.0, 2.5]]);
        assert!(table("t", "t,x\n0,1\n").is_err());
    }
}
