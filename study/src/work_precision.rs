//! Error against wall time and against particle-steps: charts, Pareto front, recommendation in words.

use super::pareto::{Candidate, Recommendation, front, recommend};
use super::report::{Report, short};
use super::row::{Class, Row};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use std::collections::BTreeSet;

/// What is on the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Median wall-clock time of the solver [s].
    WallTime,
    /// Particles times steps; the same on every machine.
    ParticleSteps,
    /// Products with the fine matrix of the pressure equation.
    Products,
}

impl Cost {
    fn of(self, row: &Row) -> Option<f64> {
        match self {
            Self::WallTime => row.measured.timing.map(|t| t.median_s),
            Self::ParticleSteps => Some(row.measured.work.particle_steps as f64),
            Self::Products => Some(row.measured.work.products),
        }
        .filter(|c| *c > 0.0)
    }

    fn label(self) -> &'static str {
        match self {
            Self::WallTime => "wall time of the solver [s]",
            Self::ParticleSteps => "particles x steps [-]",
            Self::Products => "products with the fine matrix [-]",
        }
    }

    fn file(self) -> &'static str {
        match self {
            Self::WallTime => "time",
            Self::ParticleSteps => "work",
            Self::Products => "products",
        }
    }
}

/// Names of the front in a chart, and of its points.
const FRONT: [&str; 2] = ["Pareto front", "on the front"];

/// Points that ended well enough to be compared.
fn candidates(rows: &[Row], error: &str, cost: Cost) -> Vec<Candidate> {
    let usable = rows.iter().enumerate().filter(|(_, r)| r.measured.class <= Class::Degraded);
    usable
        .filter_map(|(row, r)| Some(Candidate { row, cost: cost.of(r)?, error: r.measured.value(error)? }))
        .collect()
}

/// Name of the file of a chart: the error's name without units and signs.
pub fn file_name(study: &str, error: &str, what: &str) -> String {
    let plain = error.split('[').next().unwrap_or(error).trim();
    let plain: String = plain.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    let plain = plain.to_lowercase();
    let parts: Vec<&str> = plain.split('_').filter(|p| !p.is_empty()).collect();
    format!("{study}-{}-{what}", parts.join("_"))
}

/// Processors of `rows`, for the second line of a chart.
pub fn machines(rows: &[Row]) -> String {
    let mut names: Vec<&str> =
        rows.iter().map(|r| r.measured.machine.as_str()).filter(|m| !m.is_empty()).collect();
    names.sort_unstable();
    names.dedup();
    names.join("; ")
}

/// Methods in the order of their first row.
fn methods(rows: &[Row]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.method.as_str()) {
            names.push(&row.method);
        }
    }
    names
}

/// The chart of `error` against `cost`, with one line for each method; `None` without a point.
pub fn chart(title: &str, rows: &[Row], error: &str, cost: Cost) -> Option<Chart> {
    let all = candidates(rows, error, cost);
    if all.is_empty() {
        return None;
    }
    let mut series = Vec::new();
    let best: Vec<[f64; 2]> = front(&all).iter().map(|c| [c.cost, c.error]).collect();
    series.push(Series::line(FRONT[0], "#bbbbbb", Stroke::Dashed, best.clone()));
    let marks = [Mark::Circle, Mark::Square, Mark::Triangle];
    for (k, method) in methods(rows).into_iter().enumerate() {
        let mut own: Vec<&Candidate> = all.iter().filter(|c| rows[c.row].method == method).collect();
        own.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let spread =
            own.iter().filter_map(|c| rows[c.row].measured.timing).map(|t| [t.shortest_s, t.longest_s]);
        series.push(Series {
            name: method.into(),
            color: COLORS[k % COLORS.len()].into(),
            points: own.iter().map(|c| [c.cost, c.error]).collect(),
            spread: if cost == Cost::WallTime { spread.collect() } else { Vec::new() },
            stroke: Some(Stroke::Solid),
            mark: Some((marks[k / COLORS.len() % marks.len()], 4.5)),
        });
    }
    series.push(Series::marks(FRONT[1], "#000000", Mark::Cross, 6.0, best));
    Some(Chart {
        title: format!("{title}: {error}"),
        subtitle: machines(rows),
        x: Axis::log(cost.label()),
        y: Axis::log(error),
        series,
    })
}

/// A point in words: its setting, error and cost.
fn told(row: &Row, c: &Candidate) -> String {
    let time = row.measured.timing.map_or_else(String::new, |t| {
        format!(
            "; {} s (median of {}, {} to {} s)",
            short(t.median_s),
            t.repetitions,
            short(t.shortest_s),
            short(t.longest_s)
        )
    });
    let degraded = if row.measured.class == Class::Degraded {
        format!(" (degraded: {})", row.measured.reason)
    } else {
        String::new()
    };
    format!(
        "{}: error {}{time}, {} particle-steps, on {}{degraded}",
        row.label(),
        short(c.error),
        short(row.measured.work.particle_steps as f64),
        row.measured.machine
    )
}

/// The setting to take for a wanted error, in words.
pub fn words(rows: &[Row], error: &str, wanted: f64) -> String {
    let all = candidates(rows, error, Cost::WallTime);
    let tell = |c: &Candidate| told(&rows[c.row], c);
    match recommend(&all, wanted) {
        Recommendation::Meets(c) => {
            format!("For a {error} of at most {} take {}.", short(wanted), tell(&c))
        }
        Recommendation::Closest(c) => {
            format!("No setting tried reaches a {error} of {}. The closest is {}.", short(wanted), tell(&c))
        }
        Recommendation::Nothing => {
            let values = rows.iter().flat_map(|r| r.measured.values.keys());
            let curves = rows.iter().flat_map(|r| r.measured.curves.keys());
            let measured: BTreeSet<&String> = values.chain(curves).collect();
            let measured: Vec<&str> = measured.into_iter().map(String::as_str).collect();
            let measured = if measured.is_empty() { "nothing".to_owned() } else { measured.join(", ") };
            format!("No point of this study has a {error} and a run time; measured is {measured}.")
        }
    }
}

/// The rows of each scene, with what it has on the axes `scenes` in words, in the order of their first rows; all rows if there are no such axes.
fn by_scene(rows: &[Row], scenes: &BTreeSet<&str>) -> Vec<(String, Vec<Row>)> {
    let mut groups: Vec<(String, Vec<Row>)> = Vec::new();
    for row in rows {
        let of_scene = row.parameters.iter().filter(|(axis, _)| scenes.contains(axis.as_str()));
        let parts: Vec<String> = of_scene.map(|(axis, value)| format!("{axis} = {value}")).collect();
        let name = parts.join(", ");
        match groups.iter_mut().find(|(known, _)| *known == name) {
            Some((_, own)) => own.push(row.clone()),
            None => groups.push((name, vec![row.clone()])),
        }
    }
    groups
}

/// The middle of the decades from the least to the largest error of `all`.
fn middle(all: &[Candidate]) -> Option<f64> {
    let errors = all.iter().map(|c| c.error).filter(|e| *e > 0.0);
    let (least, most) = errors.fold((f64::INFINITY, 0.0_f64), |(a, b), e| (a.min(e), b.max(e)));
    (most > 0.0).then(|| (least * most).sqrt())
}

/// Charts and words for every one of `errors` of the study with that name and title. `wanted` is the error that the user asks for; the middle of
/// those that the points have if absent. Points of different scenes, apart on the axes `scenes`, are not weighed against each other.
pub fn report(
    (name, title): (&str, &str),
    rows: &[Row],
    errors: &[String],
    scenes: &BTreeSet<&str>,
    wanted: Option<f64>,
) -> Report {
    let mut report = Report::default();
    let groups = by_scene(rows, scenes);
    for error in errors {
        for cost in [Cost::WallTime, Cost::ParticleSteps] {
            if let Some(mut chart) = chart(title, rows, error, cost) {
                if groups.len() > 1 {
                    chart.series.retain(|series| !FRONT.contains(&series.name.as_str()));
                }
                report.charts.push((file_name(name, error, cost.file()), chart));
            }
        }
        for (scene, own) in &groups {
            let at = if scene.is_empty() { String::new() } else { format!("At {scene}: ") };
            let all = candidates(own, error, Cost::WallTime);
            if let ([only], false, None) = (all.as_slice(), scene.is_empty(), wanted) {
                report.findings.push(format!("{at}one setting for {error}, {}.", told(&own[only.row], only)));
                continue;
            }
            let bound = wanted.or_else(|| middle(&all));
            let mut finding = at.clone() + &words(own, error, bound.unwrap_or(0.0));
            if let (None, Some(bound)) = (wanted, bound) {
                let bound = short(bound);
                finding += &format!(
                    " {bound} is midway, in decades, between the least and the largest error of these points; --error X asks for yours."
                );
            }
            report.findings.push(finding);
            let best: Vec<String> = front(&all).iter().map(|c| own[c.row].label()).collect();
            if best.len() > 1 {
                report
                    .findings
                    .push(format!("{at}Pareto front of {error}, cheapest first: {}.", best.join(" -> ")));
            }
        }
    }
    if groups.len() > 1 && !report.findings.is_empty() {
        let axes: Vec<&str> = scenes.iter().copied().collect();
        report.findings.push(format!(
            "Scenes that differ in {} are not weighed against each other; `scene = false` in an [[axis]] makes its values settings to choose from.",
            axes.join(", ")
        ));
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::{Measured, Timing};

    fn rows() -> Vec<Row> {
        let row = |method: &str, l0: &str, time: f64, error: f64, class: Class| Row {
            method: method.into(),
            parameters: [("spacing".to_string(), l0.to_string())].into(),
            measured: Measured {
                class,
                values: [("e [-]".to_string(), error)].into(),
                timing: Timing::of(vec![time]),
                machine: "CPU".into(),
                ..Measured::default()
            },
            ..Row::default()
        };
        vec![
            row("paper", "0.05", 1.0, 0.2, Class::Ok),
            row("paper", "0.025", 8.0, 0.1, Class::Ok),
            row("accurate", "0.05", 1.1, 0.05, Class::Ok),
            row("accurate", "0.025", 9.0, 0.01, Class::Ok),
            row("accurate", "0.1", 0.1, 0.001, Class::Failed),
        ]
    }

    #[test]
    fn the_recommendation_names_setting_error_and_time_and_passes_over_what_failed() {
        let rows = rows();
        let text = words(&rows, "e [-]", 0.06);
        assert!(
            text.starts_with("For a e [-] of at most 0.06 take accurate, spacing = 0.05: error 0.05; 1.1 s"),
            "{text}"
        );
        assert!(words(&rows, "e [-]", 1e-9).contains("closest is accurate, spacing = 0.025"));
        assert!(words(&rows, "f [-]", 0.1).starts_with("No point"));
    }

    #[test]
    fn a_chart_has_one_line_a_method_and_the_front() {
        let rows = rows();
        let chart = chart("t", &rows, "e [-]", Cost::WallTime).unwrap();
        let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["Pareto front", "paper", "accurate", "on the front"]);
        // 0.2 at 1 s, 0.05 at 1.1 s, 0.01 at 9 s; the paper's fine run is beaten.
        assert_eq!(chart.series[0].points, [[1.0, 0.2], [1.1, 0.05], [9.0, 0.01]]);
        assert_eq!(file_name("s", "pressure error [-]", "time"), "s-pressure_error-time");
    }

    fn findings(rows: &[Row], scenes: &[&str], wanted: Option<f64>) -> (Vec<String>, usize) {
        let scenes = scenes.iter().copied().collect();
        let report = report(("s", "t"), rows, &["e [-]".to_owned()], &scenes, wanted);
        (report.findings, report.charts[0].1.series.len())
    }

    #[test]
    fn a_bound_that_nobody_gave_says_where_it_comes_from() {
        let (told, _) = findings(&rows(), &[], None);
        assert!(
            told[0].contains("at most 0.04472")
                && told[0].contains("between the least and the largest error"),
            "{told:?}"
        );
        let (told, _) = findings(&rows(), &[], Some(0.06));
        assert!(told[0].contains("at most 0.06") && !told[0].contains("between"), "{told:?}");
    }

    #[test]
    fn scenes_are_not_weighed_against_each_other() {
        let mut rows = rows();
        for row in &mut rows {
            let density = if row.method == "paper" { "300" } else { "700" };
            row.parameters.insert("density".into(), density.into());
        }
        let (told, lines) = findings(&rows, &["density"], Some(0.15));
        assert!(
            told[0].starts_with(
                "At density = 300: For a e [-] of at most 0.15 take paper, density = 300, spacing = 0.025"
            ),
            "{told:?}"
        );
        assert!(
            told[2].starts_with(
                "At density = 700: For a e [-] of at most 0.15 take accurate, density = 700, spacing = 0.05"
            ),
            "{told:?}"
        );
        assert!(
            told.last().unwrap().starts_with("Scenes that differ in density are not weighed"),
            "{told:?}"
        );
        assert_eq!(lines, 2, "the methods, and no front");
        let both =
            report(("s", "t"), &rows, &["e [-]".into(), "e [-]".into()], &["density"].into(), None).findings;
        assert_eq!(both.iter().filter(|told| told.starts_with("Scenes that differ")).count(), 1, "{both:?}");
        // One point each: nothing to choose from, and nothing is recommended.
        let (told, _) = findings(&rows, &["density", "spacing"], None);
        assert!(
            told[..4].iter().all(|t| t.contains(": one setting for ") && !t.contains("take")),
            "{told:?}"
        );
    }
}
