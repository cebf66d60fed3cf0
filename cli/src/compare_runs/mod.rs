//! `seixo compare-runs`: finished runs laid over each other, and how far they are apart.

mod curves;
mod difference;

use super::report::chart::{Chart, Curve};
use super::report::page::{MARK, charts, html, section, table};
use super::{Exit, finite};
use curves::{Quantity, Run};
use difference::Difference;
use seixo::console::{remark, say_json, tell};
use seixo::error::{Error, Result};
use seixo::output::spare::spare;
use seixo::output::write_whole;
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct CompareRunsArgs {
    /// Folders of runs, two to six; the first is what the others are held against.
    #[arg(required = true, num_args = 2..=6)]
    dirs: Vec<PathBuf>,
    /// The page; the table of differences is written beside it as CSV.
    #[arg(short, long, value_name = "FILE", default_value = "compare-runs.html")]
    out: PathBuf,
    /// Compare from this time on [s].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    from: Option<f64>,
    /// Compare until this time [s].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    until: Option<f64>,
    /// Only quantities whose name holds this; may be repeated.
    #[arg(long, value_name = "WORD")]
    only: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A quantity that two runs share.
#[derive(Serialize)]
struct Row {
    run: String,
    table: &'static str,
    quantity: String,
    #[serde(flatten)]
    difference: Difference,
    rms_over_range: Option<f64>,
    largest_over_range: Option<f64>,
}

#[derive(Serialize)]
struct Answer {
    reference: String,
    /// What stands above the rows of each run.
    #[serde(skip)]
    headings: Vec<String>,
    differences: Vec<Row>,
    remarks: Vec<String>,
    page: PathBuf,
    csv: PathBuf,
}

pub fn compare_runs(args: &CompareRunsArgs) -> Exit {
    let csv = args.out.with_extension("csv");
    if csv == args.out {
        return Err(Error::usage("--out", "--out names the page: give it another extension than .csv"));
    }
    spare(&args.out, MARK)?;
    spare(&csv, &(COLUMNS.join(",") + "\n"))?;
    let window = [args.from.unwrap_or(f64::NEG_INFINITY), args.until.unwrap_or(f64::INFINITY)];
    if window[0] > window[1] {
        return Err(Error::usage("--from", "--from is after --until: nothing lies between"));
    }
    let mut runs = read(&args.dirs)?;
    let slices = slices(&mut runs);
    let (reference, others) = runs.split_first().ok_or_else(|| Error::usage("DIRS", "name two runs"))?;
    let asked = asked(reference, others, &args.only)?;
    let mut answer = Answer {
        reference: reference.name.clone(),
        headings: Vec::new(),
        differences: Vec::new(),
        remarks: slices.into_iter().collect(),
        page: args.out.clone(),
        csv,
    };
    for other in others {
        hold(&mut answer, reference, other, &asked, window)?;
    }
    write_whole(&answer.page, page(&runs, &asked, &answer, window).as_bytes())?;
    write_whole(&answer.csv, &listed(&answer)?)?;
    if args.json {
        say_json(&answer);
    } else {
        answer.remarks.iter().for_each(|r| remark(&format!("note: {r}")));
        tell(&words(&answer));
    }
    Ok(0)
}

/// The runs, each called by the last part of its folder, or by the whole path where two would be called the same.
fn read(dirs: &[PathBuf]) -> Result<Vec<Run>> {
    for (k, dir) in dirs.iter().enumerate() {
        let real = |d: &Path| d.canonicalize().ok();
        if real(dir).is_some() && dirs[..k].iter().any(|d| real(d) == real(dir)) {
            let text = format!("{} is named twice: name the folders of different runs", dir.display());
            return Err(Error::usage("DIRS", text));
        }
    }
    let last = |d: &PathBuf| d.file_name().map(|n| n.to_string_lossy().into_owned());
    let called = |d: &PathBuf| {
        let alone = dirs.iter().filter(|other| last(other) == last(d)).count() == 1;
        last(d).filter(|_| alone).unwrap_or_else(|| d.display().to_string())
    };
    dirs.iter().map(|d| Run::read(d, called(d))).collect()
}

/// Makes slices of different widths alike, runs in two dimensions that have other spacings; says so.
fn slices(runs: &mut [Run]) -> Option<String> {
    let widths = || runs.iter().map(|r| r.spacing);
    if runs.iter().all(|r| !r.flat) || widths().all(|l0| Some(l0) == widths().next()) {
        return None;
    }
    if !runs.iter().all(|r| r.flat) {
        let text = "some runs are in two dimensions: their energies, forces, momenta and volumes are those of a slice one \
                    spacing wide";
        return Some(text.into());
    }
    runs.iter_mut().for_each(Run::per_metre);
    let text = "the runs are slices of different widths, one spacing each: energies, forces, momenta and volumes are \
                given for each metre across";
    Some(text.into())
}

/// What is compared: what the reference and another run both have, but for what is zero in all of them.
fn asked(reference: &Run, others: &[Run], only: &[String]) -> Result<Vec<Quantity>> {
    let shared = |q: &&Quantity| others.iter().any(|o| o.curve(q).is_some());
    let shared: Vec<&Quantity> = reference.curves.iter().filter(shared).collect();
    if shared.is_empty() {
        let none = |r: &Run| format!("{} has {}", r.name, first_of(r.curves.iter().map(|q| &q.name)));
        let all: Vec<String> = std::iter::once(reference).chain(others).map(none).collect();
        let text = format!("the runs have no column in common: {}", all.join("; "));
        return Err(Error::usage("DIRS", text));
    }
    let still = |q: &Quantity| {
        let all = std::iter::once(q).chain(others.iter().filter_map(|o| o.curve(q)));
        all.flat_map(|q| &q.points).all(|p| p[1] == 0.0 || !p[1].is_finite())
    };
    let meant = |q: &Quantity| only.is_empty() || only.iter().any(|word| q.name.contains(word.as_str()));
    let asked: Vec<Quantity> =
        shared.iter().filter(|q| meant(q) && !(only.is_empty() && still(q))).map(|q| (*q).clone()).collect();
    if asked.is_empty() && !only.is_empty() {
        let known = first_of(shared.iter().map(|q| &q.name));
        let text =
            format!("--only {}: no quantity of these runs is called so; there are {known}", only.join(" "));
        return Err(Error::usage("--only", text));
    }
    Ok(asked)
}

/// Names that are told in an error.
const MOST_NAMES: usize = 30;

fn first_of<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let all: Vec<&str> = names.map(String::as_str).collect();
    match all.len() {
        0 => "none".into(),
        n if n > MOST_NAMES => format!("{} and {} more", all[..MOST_NAMES].join(", "), n - MOST_NAMES),
        _ => all.join(", "),
    }
}

/// A range that is so small a part of the values is their rounding.
const ROUNDING: f64 = 1e-9;

/// What the range of `quantity` is held against, by table and name: of a component the whole vector.
fn whole(quantity: &Quantity) -> (&'static str, (&str, &str)) {
    (quantity.table, vector_of(&quantity.name).unwrap_or((&quantity.name, "")))
}

/// The smallest range that says anything, of each of these of a run.
fn least(reference: &Run) -> HashMap<(&'static str, (&str, &str)), f64> {
    let mut least = HashMap::new();
    for quantity in &reference.curves {
        let most = least.entry(whole(quantity)).or_insert(0.0_f64);
        *most = quantity.points.iter().map(|p| ROUNDING * p[1].abs()).fold(*most, f64::max);
    }
    least
}

/// The name of a component (`box: velocity_x [m/s]`) without its axis, in two parts; nothing of what is none.
fn vector_of(name: &str) -> Option<(&str, &str)> {
    let (head, unit) = name.rsplit_once(" [")?;
    let bare = head.strip_suffix(['x', 'y', 'z'])?;
    (bare.is_empty() || bare.ends_with(['_', ' '])).then_some((bare, unit))
}

/// Adds what `other` differs by.
fn hold(
    answer: &mut Answer,
    reference: &Run,
    other: &Run,
    asked: &[Quantity],
    window: [f64; 2],
) -> Result<()> {
    let before = answer.differences.len();
    let spacings = match [other.spacing, reference.spacing] {
        [one, two] if one == two => String::new(),
        [one, two] => format!(" (spacing {one} m against {two} m)"),
    };
    answer.headings.push(format!("{} against {}{spacings}", other.name, reference.name));
    let mut met = false;
    let mut apart = Vec::new();
    let least = least(reference);
    for quantity in asked {
        let Some(theirs) = other.curve(quantity) else { continue };
        met = true;
        match Difference::of(&quantity.points, &theirs.points, window) {
            Some(difference) => {
                let least = least.get(&whole(quantity)).copied().unwrap_or(0.0);
                let relative = |value: f64| difference.relative(value).filter(|_| difference.range > least);
                answer.differences.push(Row {
                    run: other.name.clone(),
                    table: quantity.table,
                    quantity: quantity.name.clone(),
                    difference,
                    rms_over_range: relative(difference.rms),
                    largest_over_range: relative(difference.largest),
                });
            }
            None => apart.push(&quantity.name),
        }
    }
    let found = &answer.differences[before..];
    if found.is_empty() {
        let text = if met {
            let of = |r: &Run| {
                let times = || r.curves.iter().flat_map(|q| &q.points).map(|p| p[0]);
                let (first, last) =
                    (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
                format!("{} from {} to {} s", r.name, rounded(first), rounded(last))
            };
            let asked = if window[0].is_finite() || window[1].is_finite() {
                " within --from and --until"
            } else {
                ""
            };
            format!("the runs have no time in common{asked}: {}, {}", of(reference), of(other))
        } else {
            format!("{} has none of the quantities that are compared", other.name)
        };
        return Err(Error::usage("DIRS", text));
    }
    let mut say = |text: String| answer.remarks.push(text);
    if found.iter().any(|r| r.difference.interpolated) {
        say(format!(
            "rows of {} and {} are at different times: {} is interpolated linearly at the times of {}",
            other.name, reference.name, other.name, reference.name
        ));
    }
    for (one, two) in [(reference, other), (other, reference)] {
        let alone: Vec<&String> =
            one.curves.iter().filter(|q| two.curve(q).is_none()).map(|q| &q.name).collect();
        if !alone.is_empty() {
            say(format!("in {} but not in {}: {}", one.name, two.name, first_of(alone.into_iter())));
        }
    }
    if !apart.is_empty() {
        say(format!(
            "no moment at which both {} and {} have a value: {}",
            reference.name,
            other.name,
            first_of(apart.into_iter())
        ));
    }
    Ok(())
}

/// A time without the digits that sums of steps leave.
fn rounded(t: f64) -> f64 {
    (t * 1e9).round() / 1e9
}

/// A share in percent.
fn percent(share: Option<f64>) -> String {
    match share {
        Some(x) if x == 0.0 || (1e-4..10.0).contains(&x) => format!("{:.2} %", 100.0 * x),
        Some(x) => format!("{:.1e} %", 100.0 * x),
        None => "-".into(),
    }
}

/// The columns of a difference, as they are printed.
const HEAD: [&str; 6] = ["quantity", "rms", "largest", "at [s]", "rms/range", "largest/range"];

fn cells(row: &Row) -> [String; 6] {
    let d = &row.difference;
    [
        row.quantity.clone(),
        format!("{:.3e}", d.rms),
        format!("{:.3e}", d.largest),
        format!("{:.4}", d.at),
        percent(row.rms_over_range),
        percent(row.largest_over_range),
    ]
}

/// The rows of each run that is held against the reference, and what stands above them.
fn by_run(answer: &Answer) -> impl Iterator<Item = (&str, &[Row])> {
    let headings = answer.headings.iter().map(String::as_str);
    headings.zip(answer.differences.chunk_by(|a, b| a.run == b.run))
}

fn words(answer: &Answer) -> String {
    let mut lines = Vec::new();
    for (heading, rows) in by_run(answer) {
        let cells: Vec<[String; 6]> = rows.iter().map(cells).collect();
        let wide = cells.iter().map(|c| c[0].chars().count()).max().unwrap_or(0).max(HEAD[0].len());
        let line = |c: [&str; 6]| {
            format!("  {:<wide$}{:>11}{:>11}{:>9}{:>10}{:>14}", c[0], c[1], c[2], c[3], c[4], c[5])
        };
        lines.push(heading.to_owned());
        lines.push(line(HEAD));
        lines.extend(cells.iter().map(|c| line(c.each_ref().map(String::as_str))));
        lines.push(String::new());
    }
    lines.push(format!("{}, {}", answer.page.display(), answer.csv.display()));
    lines.join("\n")
}

/// Columns of the table of differences.
const COLUMNS: [&str; 12] = [
    "reference",
    "run",
    "table",
    "quantity",
    "points [-]",
    "rms",
    "largest",
    "at [s]",
    "range",
    "rms_over_range [-]",
    "largest_over_range [-]",
    "interpolated",
];

fn listed(answer: &Answer) -> Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let unwritten = |e: csv::Error| Error::io(&answer.csv)(e.into());
    table.write_record(COLUMNS).map_err(unwritten)?;
    for row in &answer.differences {
        let d = &row.difference;
        let share = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
        let cells = [
            answer.reference.clone(),
            row.run.clone(),
            row.table.to_owned(),
            row.quantity.clone(),
            d.points.to_string(),
            d.rms.to_string(),
            d.largest.to_string(),
            d.at.to_string(),
            d.range.to_string(),
            share(row.rms_over_range),
            share(row.largest_over_range),
            d.interpolated.to_string(),
        ];
        table.write_record(cells).map_err(unwritten)?;
    }
    table.into_inner().map_err(|e| Error::io(&answer.csv)(e.into_error()))
}

fn page(runs: &[Run], asked: &[Quantity], answer: &Answer, window: [f64; 2]) -> String {
    let names: Vec<&str> = runs.iter().map(|r| r.name.as_str()).collect();
    let notes: String =
        answer.remarks.iter().map(|r| format!("<li>{}</li>", super::report::page::escape(r))).collect();
    let notes = if notes.is_empty() { notes } else { format!("<ul>{notes}</ul>\n") };
    let differences: String = by_run(answer)
        .map(|(heading, rows)| {
            let mut lines = vec![HEAD.map(str::to_owned).to_vec()];
            lines.extend(rows.iter().map(|r| cells(r).to_vec()));
            format!("<h3>{}</h3>\n{}", super::report::page::escape(heading), table(&lines))
        })
        .collect();
    let drawn = |from: &str, seen: &dyn Fn(&str) -> bool| {
        let quantities = asked.iter().filter(|q| q.table == from && seen(&q.name)).take(MOST_CHARTS);
        let all: Vec<Chart> = quantities.map(|q| overlay(runs, q, window)).collect();
        charts(&all)
    };
    let energy = |name: &str| name.ends_with("[J]");
    let pace = Chart {
        title: "seconds a step [s]".into(),
        curves: runs.iter().map(|r| curve(&r.name, &r.pace, window)).collect(),
        dashed: true,
    };
    let sections = [
        section("runs", "Runs", &table(&facts(runs))),
        section("case", "Where the cases differ", &table(&keys(runs))),
        section("differences", "Differences", &(notes + &differences)),
        section("gauges", "Gauges", &drawn("gauges", &|_| true)),
        section("bodies", "Bodies and moving walls", &drawn("bodies", &|_| true)),
        section("energy", "Energies", &drawn("monitors", &energy)),
        section("steps", "Steps", &(drawn("monitors", &|name| !energy(name)) + &charts(&[pace]))),
    ];
    html(&names.join(" / "), "", &sections, "")
}

/// Charts of a section; more would be no page.
const MOST_CHARTS: usize = 72;

fn curve(name: &str, points: &[[f64; 2]], window: [f64; 2]) -> Curve {
    let within = |p: &&[f64; 2]| p[0] >= window[0] && p[0] <= window[1];
    Curve { name: name.to_owned(), points: points.iter().filter(within).copied().collect() }
}

/// A quantity of all runs that have it. A run keeps its colour from chart to chart.
fn overlay(runs: &[Run], quantity: &Quantity, window: [f64; 2]) -> Chart {
    let of = |r: &Run| curve(&r.name, r.curve(quantity).map_or(&[][..], |q| &q.points), window);
    Chart { title: quantity.name.clone(), curves: runs.iter().map(of).collect(), dashed: true }
}

/// What is known of each run: a column each.
fn facts(runs: &[Run]) -> Vec<Vec<String>> {
    let line = |title: &str, of: &dyn Fn(&Run) -> Option<String>| -> Vec<String> {
        let all = runs.iter().map(|r| of(r).unwrap_or_else(|| "-".into()));
        std::iter::once(title.to_owned()).chain(all).collect()
    };
    let number = |r: &Run, key: &str| r.result[key].as_f64();
    vec![
        line("", &|r| Some(r.name.clone())),
        line("Verdict", &|r| r.result["verdict"]["grade"].as_str().map(str::to_owned)),
        line("Spacing [m]", &|r| Some(r.spacing.to_string())),
        line("Particles", &|r| r.result["particles"]["total"].as_u64().map(|n| n.to_string())),
        line("Steps", &|r| r.result["steps"].as_u64().map(|n| n.to_string())),
        line("Time reached [s]", &|r| number(r, "time_s").map(|t| format!("{t:.4}"))),
        line("Run time [s]", &|r| number(r, "wall_s").map(|t| format!("{t:.1}"))),
        line("Mean of seconds a step", &|r| {
            let mean = r.pace.iter().map(|p| p[1]).sum::<f64>() / r.pace.len() as f64;
            mean.is_finite().then(|| format!("{mean:.3e}"))
        }),
        line("Iterations a solve", &|r| {
            r.result["pressure"]["iterations_mean"].as_f64().map(|n| format!("{n:.1}"))
        }),
        line("Processor", &|r| {
            let adapter = r.result["adapter"].as_str()?;
            Some(format!("{adapter}, {}", r.result["precision"].as_str().unwrap_or("")))
        }),
        line("Program", &|r| r.result["version"].as_str().map(|v| format!("seixo {v}"))),
    ]
}

/// Longest value of a key that is shown whole; tables of motion are longer.
const LONG_VALUE: usize = 60;

/// Keys that are not the same in all cases.
fn keys(runs: &[Run]) -> Vec<Vec<String>> {
    let mut seen = HashSet::new();
    let names = runs.iter().flat_map(|r| &r.keys).map(|(key, _)| key).filter(|key| seen.insert(*key));
    let of = |r: &Run| r.keys.iter().cloned().collect::<HashMap<String, String>>();
    let all: Vec<HashMap<String, String>> = runs.iter().map(of).collect();
    let mut rows = vec![std::iter::once(String::new()).chain(runs.iter().map(|r| r.name.clone())).collect()];
    for key in names {
        let values: Vec<Option<String>> = all.iter().map(|keys| keys.get(key).cloned()).collect();
        if values.iter().any(|v| *v != values[0]) {
            let shown = values.into_iter().map(|v| match v {
                Some(v) if v.chars().count() > LONG_VALUE => {
                    format!("{} ...", v.chars().take(LONG_VALUE).collect::<String>())
                }
                Some(v) => v,
                None => "not given".into(),
            });
            rows.push(std::iter::once(key.clone()).chain(shown).collect());
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::vector_of;

    #[test]
    fn components_are_told_from_other_names() {
        assert_eq!(vector_of("box: velocity_x [m/s]"), vector_of("box: velocity_z [m/s]"));
        assert_eq!(vector_of("box: x [m]"), Some(("box: ", "m]")));
        assert_ne!(vector_of("box: x [m]"), vector_of("ball: x [m]"));
        for other in ["flux [m3/s]", "energy [J]", "outcome", "qx [-]"] {
            assert_eq!(vector_of(other), None, "{other}");
        }
    }
}
