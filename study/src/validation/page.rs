//! The page of a validation: tables of result, reference, error and cost, and charts, in Markdown.

use super::check::{Check, Reference};
use super::groups::{Group, Spread};
use super::reduce::{Curve, told};
use super::{Suite, Validation, error_name};
use crate::engine::first_line;
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke, thinned};
use crate::report::{short, versions};
use crate::row::Row;
use crate::work_precision::{self, Cost};
use seixo::error::{Error, Result};
use seixo::output::write_whole;
use std::fmt::Write;
use std::path::Path;

/// How the page begins, and nobody else's.
pub(super) const MARK: &str = "# Validation

Runs held against experiments and analytic solutions. This page is written by `seixo validate`;";

const HEAD: &str = " a validation is a file
in `cases/validation` with its reference in `cases/reference`, and any of these lines can be run again:

```
seixo validate                       # all but the costly ones; results in validation/
seixo validate --full --runs 8       # everything, each point from eight starts that differ by chance
seixo validate list                  # names
seixo validate spheric-2 -o DIR      # one of them
```

The error is the difference over the size of the reference, or over what the check states; `within` says whether it is
below the tolerance that was written down with the check. Run times are those of the time steps alone. Where a setting
ran from several starts, results are mean and standard deviation of a run, and `1 of 3` says that the others have no number:
then the check is not met.
";

/// Writes the page to `path`, its charts into `img` beside it.
///
/// # Errors
/// [`Error::Io`].
pub fn write(path: &Path, suite: &Suite, rows: &[Row]) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let images = folder.join("img");
    std::fs::create_dir_all(&images).map_err(Error::io(&images))?;
    let mut text = format!("{MARK}{HEAD}");
    let machines = work_precision::machines(rows);
    let _ = writeln!(text, "\n{}; computed on: {machines}.\n", versions(rows));
    let missing = suite.len() - rows.len();
    if missing > 0 {
        let _ = writeln!(text, "{missing} of {} points are still to be computed.\n", suite.len());
    }
    summary(&mut text, suite, rows);
    for validation in &suite.validations {
        section(&mut text, validation, rows, &images)?;
    }
    write_whole(path, text.as_bytes())
}

/// Every check at the finest setting of each method.
fn summary(text: &mut String, suite: &Suite, rows: &[Row]) {
    text.push_str("## At a glance\n\nThe finest run of each scheme.\n\n");
    text.push_str("| case | check | scheme | setting | error | tolerance | within | run time [s] |\n");
    text.push_str("|---|---|---|---|---|---|---|---|\n");
    for validation in &suite.validations {
        let name = &validation.definition.name;
        for check in &validation.definition.check {
            let groups = Group::of(validation, rows).into_iter().filter(|g| g.takes(check));
            for group in finest(groups.collect()) {
                let cells = [
                    format!("[{name}](#{name})"),
                    check.name.clone(),
                    group.method.into(),
                    group.setting.clone(),
                    percent(group.error(&check.name)),
                    format!("{} %", short(100.0 * check.tolerance)),
                    within(group.error(&check.name), check).into(),
                    group.seconds().map(short).unwrap_or_default(),
                ];
                line(text, &cells);
            }
        }
    }
}

/// A line for each check and setting, for the terminal.
pub fn lines(validation: &Validation, rows: &[Row]) -> Vec<String> {
    let d = &validation.definition;
    let groups = Group::of(validation, rows);
    let of = |check: &Check, group: &Group| {
        let error = group.error(&check.name);
        let sign = if within(error, check) == "yes" { "ok    " } else { "BEYOND" };
        let missing = || {
            let without = group.rows.iter().find(|r| r.measured.value(&error_name(&check.name)).is_none());
            without.map_or(String::new(), |r| check.missing(&r.measured))
        };
        let error = match error {
            Some(e) if e.whole() => percent(error),
            Some(_) => format!("{}, else none ({})", percent(error), missing()),
            None => format!("none ({})", missing()),
        };
        let most = short(100.0 * check.tolerance);
        let who = format!("{} {}", group.method, group.setting);
        format!("{sign} {}: {}, {}: error {error}, tolerance {most} %", d.name, check.name, who.trim())
    };
    let with = |check| groups.iter().filter(move |g| g.takes(check)).map(move |group| of(check, group));
    d.check.iter().flat_map(with).collect()
}

/// The group with the most particles of each method.
fn finest(groups: Vec<Group>) -> Vec<Group> {
    let mut best: Vec<Group> = Vec::new();
    for group in groups {
        match best.iter_mut().find(|g| g.method == group.method) {
            Some(other) if other.particles() >= group.particles() => {}
            Some(other) => *other = group,
            None => best.push(group),
        }
    }
    best
}

fn line(text: &mut String, cells: &[String]) {
    let cells: Vec<String> = cells.iter().map(|c| c.replace('|', "/")).collect();
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

fn number(spread: Option<Spread>) -> String {
    match spread {
        None => "-".into(),
        Some(s) if s.runs == 1 => short(s.mean),
        Some(s) if s.count == 1 => format!("{} ({})", short(s.mean), s.told()),
        Some(s) => format!("{} ± {} ({})", short(s.mean), short(s.deviation), s.told()),
    }
}

fn percent(error: Option<Spread>) -> String {
    let scaled = |s: Spread| Spread { mean: 100.0 * s.mean, deviation: 100.0 * s.deviation, ..s };
    error.map_or("-".into(), |e| {
        let e = scaled(e);
        let of = |x: f64| if x < 10.0 { format!("{x:.2}") } else { format!("{x:.0}") };
        let told = if e.whole() { String::new() } else { format!(" ({})", e.told()) };
        if e.count == 1 {
            format!("{} %{told}", of(e.mean))
        } else {
            format!("{} ± {} %{told}", of(e.mean), of(e.deviation))
        }
    })
}

/// Whether the mean is within the tolerance, of runs that all have a number: one that failed meets nothing.
fn within(error: Option<Spread>, check: &Check) -> &'static str {
    match error {
        Some(e) if e.whole() && e.mean <= check.tolerance => "yes",
        _ => "**no**",
    }
}

fn section(text: &mut String, validation: &Validation, rows: &[Row], images: &Path) -> Result<()> {
    let d = &validation.definition;
    let _ = writeln!(text, "\n<a id=\"{}\"></a>\n\n## {}\n", d.name, d.title);
    if !d.question.is_empty() {
        let _ = writeln!(text, "{}\n", d.question.trim());
    }
    let _ = writeln!(text, "Reference: {}\n", d.source.trim());
    let groups = Group::of(validation, rows);
    for (file, chart) in charts(validation, &groups, rows) {
        if chart.write(&images.join(&file))? {
            let _ = writeln!(text, "![{}](img/{file}.svg)\n", chart.title);
        }
    }
    text.push_str("| check | scheme | setting | result | reference | error | tolerance | within |\n");
    text.push_str("|---|---|---|---|---|---|---|---|\n");
    for (check, reference) in d.check.iter().zip(&validation.references) {
        // The reference's own number, from whichever run has been judged.
        let expected = expected(check, reference, &groups);
        for group in groups.iter().filter(|g| g.takes(check)) {
            let error = group.error(&check.name);
            line(
                text,
                &[
                    check.name.clone(),
                    group.method.into(),
                    group.setting.clone(),
                    number(group.result(&check.name)),
                    expected.clone(),
                    percent(error),
                    format!("{} %", short(100.0 * check.tolerance)),
                    within(error, check).into(),
                ],
            );
        }
        for (k, peer) in check.peers.iter().enumerate() {
            let Some(verdict) = check.judge_peer(k, reference) else { continue };
            let error = Spread::of([Some(verdict.error)].into_iter());
            let cells = [
                check.name.clone(),
                peer.name.clone(),
                String::new(),
                short(verdict.result),
                expected.clone(),
            ];
            let rest = [percent(error), String::new(), within(error, check).into()];
            line(text, &[cells.to_vec(), rest.to_vec()].concat());
        }
    }
    for note in validation.notes(rows) {
        let _ = writeln!(text, "\n{note}");
    }
    text.push_str(
        "\n| scheme | setting | particles | steps | run time [s] | remarks |\n|---|---|---|---|---|---|\n",
    );
    for group in &groups {
        let remarks: Vec<&str> = group.remarks().iter().map(|r| first_line(r)).collect();
        let cells = [
            group.method.into(),
            group.setting.clone(),
            group.particles().to_string(),
            group.steps().to_string(),
            group.seconds().map(short).unwrap_or_default(),
            remarks.join("; "),
        ];
        line(text, &cells);
    }
    Ok(())
}

/// The number that `check` expects, in words.
fn expected(check: &Check, reference: &Reference, groups: &[Group]) -> String {
    if check.take == super::reduce::Take::Distance && check.curve.is_some() {
        return "0".into();
    }
    if let Some(number) = check.reference {
        return short(number);
    }
    let rows = groups.iter().flat_map(|g| &g.rows);
    let verdict = rows.filter_map(|r| check.judge(&r.measured, reference)).next();
    verdict.map_or("-".into(), |v| short(v.reference))
}

/// A chart of every curve that is compared, and of the first check's error against run time.
fn charts(validation: &Validation, groups: &[Group], rows: &[Row]) -> Vec<(String, Chart)> {
    let d = &validation.definition;
    let mut charts: Vec<(String, Chart)> = Vec::new();
    let mut drawn: Vec<String> = Vec::new();
    for (check, reference) in d.check.iter().zip(&validation.references) {
        let Some(curve) = &check.curve else { continue };
        let which: Vec<&str> = check.only.values().map(String::as_str).collect();
        let what = format!("{curve} {}", which.join(" "));
        if drawn.contains(&what) {
            continue;
        }
        let name = format!("{} {}", curve.split(" [").next().unwrap_or_default(), which.join(" "));
        let file = work_precision::file_name(&format!("validation-{}", d.name), &name, "curve");
        drawn.push(what);
        charts.push((file, curves(d.title.as_str(), check, reference, groups)));
    }
    let own: Vec<Row> = rows.iter().filter(|r| validation.points.contains(&r.index)).cloned().collect();
    let mut sizes: Vec<u64> = own.iter().map(|r| r.measured.work.particles).collect();
    sizes.sort_unstable();
    sizes.dedup();
    if let Some(check) = d.check.first().filter(|_| sizes.len() > 1) {
        let error = error_name(&check.name);
        if let Some(chart) = work_precision::chart(&d.title, &own, &error, Cost::WallTime) {
            charts.push((format!("validation-{}-time", d.name), chart));
        }
    }
    charts
}

/// The curve of `check`: of every run, the reference's and the peers'.
fn curves(title: &str, check: &Check, reference: &Reference, groups: &[Group]) -> Chart {
    let mut methods: Vec<&str> = groups.iter().map(|g| g.method).collect();
    methods.dedup();
    let mut series = Vec::new();
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for group in groups.iter().filter(|g| g.takes(check)) {
        let color = methods.iter().position(|m| *m == group.method).unwrap_or(0);
        // Coarser runs of a method are dashed: the finest is the one to look at.
        let same = groups.iter().filter(|g| g.method == group.method);
        let finest = same.map(Group::particles).max() == Some(group.particles());
        let stroke = if finest { Stroke::Solid } else { Stroke::Dashed };
        for (k, row) in group.rows.iter().enumerate() {
            let Some((curve, _)) = check.prepared(&row.measured) else { continue };
            let curve = told(&curve);
            least = curve.first().map_or(least, |p| least.min(p[0]));
            most = curve.last().map_or(most, |p| most.max(p[0]));
            let name = if k == 0 { format!("{} {}", group.method, group.setting) } else { String::new() };
            series.push(Series::line(name.trim(), COLORS[color % COLORS.len()], stroke, thinned(&curve)));
        }
    }
    let shown = |curve: &Curve| -> Curve {
        thinned(&curve.iter().copied().filter(|p| p[0] >= least && p[0] <= most).collect::<Vec<_>>())
    };
    for (k, (peer, curve)) in check.peers.iter().zip(&reference.peers).enumerate() {
        if let Some(curve) = curve {
            let color = COLORS[(methods.len() + k) % COLORS.len()];
            series.push(Series::line(&peer.name, color, Stroke::Dashed, shown(curve)));
        }
    }
    if let Some(curve) = &reference.curve {
        let curve = shown(curve);
        if curve.len() > 60 {
            series.push(Series::line("reference", "#000000", Stroke::Solid, curve));
        } else {
            series.push(Series::marks("reference", "#000000", Mark::Circle, 3.5, curve));
        }
    } else if let (Some(value), true) = (check.reference.filter(|_| level(check)), least < most) {
        series.push(Series::line(
            "reference",
            "#000000",
            Stroke::Dashed,
            vec![[least, value], [most, value]],
        ));
    }
    // Shifted or scaled, the curve has the unit of what is taken from it.
    let curve = check.curve.clone().unwrap_or_default();
    let label = match (curve.split_once(" ["), check.name.rsplit_once(" [")) {
        (Some((what, _)), Some((_, unit))) if check.times != 1.0 => format!("{what} [{unit}"),
        _ => curve,
    };
    let which: Vec<String> = check.only.iter().map(|(axis, value)| format!(", {axis} {value}")).collect();
    let title = format!("{title}: {}{}", label.split(" [").next().unwrap_or_default(), which.concat());
    Chart { title, subtitle: String::new(), x: Axis::linear(&check.axis), y: Axis::linear(&label), series }
}

/// Whether the number that `check` expects is a height in the chart of its curve.
fn level(check: &Check) -> bool {
    use super::reduce::Take;
    matches!(check.take, Take::Mean | Take::Largest | Take::Smallest | Take::At)
}

#[cfg(test)]
mod tests {
    use super::{Validation, lines, section, summary};
    use crate::definition::Definition;
    use crate::row::{Class, Row};
    use crate::validation::Suite;

    /// A validation of one setting from three starts, in which the first `good` end well.
    fn ran(good: usize) -> (Suite, Vec<Row>) {
        let text = "name = 'tiny'\ntitle = 'tiny'\nmethod = 'own'\ntext = ''\n[measure]\nof = []\nfrom = 0\nevery = 1\n\
                    [[check]]\nname = 'level [m]'\nvalue = 'H [m]'\nreference = 0.1\ntolerance = 0.1\n";
        let definition = Definition::parse("tiny", text).unwrap();
        let references = vec![Default::default()];
        let validation = Validation { definition, references, points: 0..3, idle: Vec::new() };
        let row = |index: usize| {
            let mut row = Row { index, method: "own".into(), ..Row::default() };
            row.parameters.insert("run".into(), index.to_string());
            row.measured.put("H [m]", 0.1 + 0.001 * index as f64);
            if index >= good {
                row.measured.class = Class::Failed;
                row.measured.reason = "it blew up".into();
            }
            validation.judge(&mut row);
            row
        };
        let rows = (0..3).map(row).collect();
        (Suite { validations: vec![validation], ..Suite::default() }, rows)
    }

    #[test]
    fn a_setting_of_which_a_run_failed_does_not_meet_its_check() {
        for (good, line, result) in [
            (3, "ok     tiny: level [m], own: error 1.00 ± 1.00 %, tolerance", "(3) | 0.1 | 1.00 ± 1.00 % |"),
            (
                2,
                "BEYOND tiny: level [m], own: error 0.50 ± 0.71 % (2 of 3), else none (it blew up)",
                "(2 of 3) | 0.1 | 0.50 ± 0.71 % (2 of 3) |",
            ),
            (
                1,
                "BEYOND tiny: level [m], own: error 0.00 % (1 of 3), else none (it blew up)",
                "| 0.1 (1 of 3) | 0.1 | 0.00 % (1 of 3) |",
            ),
            (0, "BEYOND tiny: level [m], own: error none (it blew up)", "| - | 0.1 | - |"),
        ] {
            let (suite, rows) = ran(good);
            let told = lines(&suite.validations[0], &rows).concat();
            assert!(told.starts_with(line), "{told}");
            let mut page = String::new();
            summary(&mut page, &suite, &rows);
            // There are no charts to write.
            section(&mut page, &suite.validations[0], &rows, "".as_ref()).unwrap();
            let within = if good == 3 { "| yes |" } else { "| **no** |" };
            assert!(page.contains(result) && page.matches(within).count() == 2, "{good}: {page}");
        }
    }
}
