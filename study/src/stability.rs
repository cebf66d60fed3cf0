//! Maps of stability over dimensionless numbers, with the limits of theory drawn in.
//!
//! Each point is classed: stable, degraded (a measure is out of its limit) or failed (a guard stopped it). The
//! theory is derived in docs/numerics.md and docs/numerics-contact.md.

use super::definition::Setup;
use super::report::{Report, short};
use super::row::{Class, Row};
use super::work_precision::machines;
use super::{Study, stability_contact, stability_fluid};
use crate::plot::{Axis, Chart, Mark, Series, Stroke};
use seixo::error::Result;

/// A map: rows of one method prefix over two parameters.
pub struct Map {
    /// Method of its rows.
    pub method: &'static str,
    /// Name of its files.
    pub file: &'static str,
    /// First line of the chart.
    pub title: &'static str,
    /// Parameter along x, with label.
    pub x: (&'static str, &'static str),
    /// Parameter along y, with label.
    pub y: (&'static str, &'static str),
    /// Lines of theory and of the guards: name and points.
    pub limits: Vec<(&'static str, Vec<[f64; 2]>)>,
}

/// A line x = `x` over the range of y.
pub fn vertical(x: f64, y: (f64, f64)) -> Vec<[f64; 2]> {
    vec![[x, y.0], [x, y.1]]
}

/// A line y = `y` over the range of x.
pub fn horizontal(x: (f64, f64), y: f64) -> Vec<[f64; 2]> {
    vec![[x.0, y], [x.1, y]]
}

const CLASSES: [(Class, &str, &str, Mark); 3] = [
    (Class::Ok, "stable", "#009e73", Mark::Circle),
    (Class::Degraded, "degraded", "#e69f00", Mark::Triangle),
    (Class::Failed, "failed or refused", "#d55e00", Mark::Cross),
];
const LINES: [(&str, Stroke); 4] = [
    ("#000000", Stroke::Solid),
    ("#0072b2", Stroke::Dashed),
    ("#666666", Stroke::Dashed),
    ("#cc79a7", Stroke::Dashed),
];

impl Map {
    /// The chart of the map's rows.
    pub fn chart(&self, rows: &[&Row]) -> Chart {
        let mut series = Vec::new();
        for (k, (name, points)) in self.limits.iter().enumerate() {
            let (color, stroke) = LINES[k % LINES.len()];
            series.push(Series::line(name, color, stroke, points.clone()));
        }
        for (class, name, color, mark) in CLASSES {
            let own = rows.iter().filter(|r| r.measured.class == class);
            let points: Vec<[f64; 2]> =
                own.filter_map(|r| Some([r.number(self.x.0)?, r.number(self.y.0)?])).collect();
            if !points.is_empty() {
                series.push(Series::marks(name, color, mark, 7.0, points));
            }
        }
        let owned: Vec<Row> = rows.iter().map(|r| (*r).clone()).collect();
        Chart {
            title: self.title.into(),
            subtitle: machines(&owned),
            x: Axis::log(self.x.1),
            y: Axis::log(self.y.1),
            series,
        }
    }

    /// For each y: the largest x up to which every point is stable, and the smallest x that fails.
    pub fn edges(&self, rows: &[&Row]) -> Vec<(f64, Option<f64>, Option<f64>)> {
        let mut points: Vec<(f64, f64, Class)> = rows
            .iter()
            .filter_map(|r| Some((r.number(self.y.0)?, r.number(self.x.0)?, r.measured.class)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut edges: Vec<(f64, Option<f64>, Option<f64>)> = Vec::new();
        let mut open = true;
        for (y, x, class) in points {
            if edges.last().is_none_or(|e| e.0 != y) {
                edges.push((y, None, None));
                open = true;
            }
            let Some(edge) = edges.last_mut() else { continue };
            open &= class == Class::Ok;
            if open {
                edge.1 = Some(x);
            }
            if class == Class::Failed && edge.2.is_none() {
                edge.2 = Some(x);
            }
        }
        edges
    }
}

/// "measured 3.98, theory 4: -0.5 %".
pub fn distance(what: &str, measured: f64, theory: f64) -> String {
    format!(
        "{what}: measured {}, theory {}, distance {:+.1} %.",
        short(measured),
        short(theory),
        100.0 * (measured / theory - 1.0)
    )
}

fn finish(rows: &mut [Row], maps: &[Map]) -> Report {
    let mut report = Report::default();
    for map in maps {
        let own: Vec<&Row> = rows.iter().filter(|r| r.method == map.method).collect();
        if own.is_empty() {
            continue;
        }
        report.charts.push((format!("stability-{}", map.file), map.chart(&own)));
        let count = |class| own.iter().filter(|r| r.measured.class == class).count();
        let (ok, degraded, failed) = (count(Class::Ok), count(Class::Degraded), count(Class::Failed));
        let failing: Vec<f64> = map.edges(&own).iter().filter_map(|e| e.2).collect();
        let least = failing.iter().copied().reduce(f64::min);
        report.findings.push(format!(
            "{}: {ok} stable, {degraded} degraded, {failed} failed{}.",
            map.title,
            least.map_or(String::new(), |x| format!("; the smallest {} that fails is {}", map.x.0, short(x)))
        ));
    }
    // Limits found by bisection stand beside the theory's.
    for row in rows.iter() {
        let (value, theory) = (row.measured.value("limit [-]"), row.measured.value("theory [-]"));
        if let (Some(value), Some(theory)) = (value, theory) {
            report.findings.push(distance(&format!("{} ({})", row.method, row.setting()), value, theory));
        }
    }
    report
}

/// The study.
pub fn study(setup: &Setup) -> Study {
    let mut maps = stability_fluid::maps();
    maps.extend(stability_contact::maps());
    let mut jobs = stability_fluid::jobs(setup.full);
    jobs.extend(stability_contact::jobs(setup.full));
    Study {
        name: "stability".into(),
        title: "What is stable".into(),
        question: "Where over the dimensionless numbers of the scheme does a run stay right, degrade, or fail, and how \
                   far is that from theory?"
            .into(),
        jobs,
        finish: Box::new(move |rows: &mut [Row], _| Ok(finish(rows, &maps))),
    }
}

/// Bisects for the largest x in `low..high` that `stable` accepts, on a logarithmic scale, to 0.1 %.
///
/// # Errors
/// Those of `stable`.
pub fn bisect(low: f64, high: f64, mut stable: impl FnMut(f64) -> Result<bool>) -> Result<f64> {
    let (mut low, mut high) = (low, high);
    while high / low > 1.001 {
        let middle = (low * high).sqrt();
        if stable(middle)? { low = middle } else { high = middle }
    }
    Ok((low * high).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Measured;

    #[test]
    fn a_map_tells_where_it_ends() {
        let row = |x: f64, y: f64, class| Row {
            method: "m".into(),
            parameters: [("x".to_string(), x.to_string()), ("y".to_string(), y.to_string())].into(),
            measured: Measured { class, ..Measured::default() },
            ..Row::default()
        };
        let rows = [
            row(1.0, 0.1, Class::Ok),
            row(2.0, 0.1, Class::Degraded),
            row(4.0, 0.1, Class::Failed),
            row(3.0, 0.1, Class::Ok),
            row(1.0, 0.2, Class::Failed),
        ];
        let map = Map {
            method: "m",
            file: "m",
            title: "t",
            x: ("x", "x [-]"),
            y: ("y", "y [-]"),
            limits: vec![("theory", vertical(3.5, (0.1, 0.2)))],
        };
        let all: Vec<&Row> = rows.iter().collect();
        assert_eq!(map.edges(&all), [(0.1, Some(1.0), Some(4.0)), (0.2, None, Some(1.0))]);
        let chart = map.chart(&all);
        assert_eq!(chart.series.len(), 4);
        assert!(chart.svg().unwrap_or_default().contains("theory"));
        assert!((bisect(0.1, 10.0, |x| Ok(x < 2.0)).unwrap() - 2.0).abs() < 0.002);
    }
}
