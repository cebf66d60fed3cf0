//! The curves of a run: what its tables hold, under names that other runs share.

use crate::report::table::Table;
use glam::{DQuat, DVec3};
use seixo::case::file::load;
use seixo::error::{Error, FolderError, Result};
use seixo::output::folder::case_name;
use seixo::output::slice::per_metre;
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// A quantity of a run over time.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// The table that it is from.
    pub table: &'static str,
    /// The column with its unit, after the name of the solid if it is of one.
    pub name: String,
    /// Time [s] and value.
    pub points: Vec<[f64; 2]>,
}

/// A run.
#[derive(Debug)]
pub struct Run {
    /// What it is called beside the others.
    pub name: String,
    /// What it did; nothing while it goes on.
    pub result: Value,
    /// Its case, keys as dotted paths.
    pub keys: Vec<(String, String)>,
    /// Its curves, in the order gauges, solids, monitors.
    pub curves: Vec<Quantity>,
    /// Where they are among these, by table and name.
    places: HashMap<&'static str, HashMap<String, usize>>,
    /// Seconds that each step took.
    pub pace: Vec<[f64; 2]>,
    /// Its spacing [m].
    pub spacing: f64,
    /// Whether it is in two dimensions: what it holds is of a slice one spacing wide.
    pub flat: bool,
}

impl Run {
    /// The run in `root`, to be called `name`.
    ///
    /// # Errors
    /// A folder without a run, or a table that cannot be read.
    pub fn read(root: &Path, name: String) -> Result<Self> {
        case_name(root)?.filter(|n| !n.is_empty()).ok_or_else(|| FolderError::NoRun(root.to_path_buf()))?;
        let path = root.join("case.toml");
        let case = load(&path, None, &[])?.case;
        // As it stands there: a mesh is named by what it holds.
        let text = std::fs::read_to_string(&path).map_err(Error::io(&path))?;
        let mut keys = Vec::new();
        if let Ok(case) = text.parse::<toml::Table>() {
            flatten("", &toml::Value::Table(case), &mut keys);
        }
        let result = std::fs::read_to_string(root.join("result.json")).ok();
        let monitors = Table::read(&root.join("monitors.csv"))?;
        let mut curves = columns("gauges", "", &Table::read(&root.join("gauges.csv"))?);
        for (solid, table) in Table::read_by(&root.join("bodies.csv"), "body")? {
            let before = format!("{solid}: ");
            let mut of_solid = columns("bodies", &before, &table);
            let place = of_solid.iter().take_while(|q| q.name.ends_with("[m]")).count();
            of_solid.splice(place..place, turns(&before, &table));
            curves.append(&mut of_solid);
        }
        curves.append(&mut columns("monitors", "", &monitors));
        let result = result.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
        let (spacing, flat) = (case.run.spacing, case.run.dimensions == 2);
        let places = places(&curves);
        Ok(Self { name, result, keys, curves, places, pace: pace(&monitors), spacing, flat })
    }

    /// Energies, forces, momenta and volumes of the slice for each metre across, which slices of other widths share.
    pub fn per_metre(&mut self) {
        for quantity in &mut self.curves {
            if let Some(name) = per_metre(&quantity.name) {
                quantity.name = name;
                quantity.points.iter_mut().for_each(|p| p[1] /= self.spacing);
            }
        }
        self.places = places(&self.curves);
    }

    /// The curve that is called as `of` is, of the same table.
    pub fn curve(&self, of: &Quantity) -> Option<&Quantity> {
        self.places.get(of.table)?.get(&of.name).map(|&k| &self.curves[k])
    }
}

/// Where the `curves` are, by table and name: a run of many bodies has tens of thousands.
fn places(curves: &[Quantity]) -> HashMap<&'static str, HashMap<String, usize>> {
    let mut places: HashMap<&'static str, HashMap<String, usize>> = HashMap::new();
    for (k, quantity) in curves.iter().enumerate() {
        places.entry(quantity.table).or_default().entry(quantity.name.clone()).or_insert(k);
    }
    places
}

/// The columns of a table that tell what the water and the solids do, those alone.
fn columns(from: &'static str, before: &str, table: &Table) -> Vec<Quantity> {
    let told = |c: &&String| {
        let (clock, count) = (c.starts_with("wall_"), ["time [s]", "step [-]"].contains(&c.as_str()));
        // Components of a quaternion say little one by one: `turns` stand for them.
        let text = ["body", "outcome"].contains(&c.as_str()) || (from == "bodies" && c.starts_with('q'));
        !(from == "monitors" && clock || count || text)
    };
    let curve = |c: &String| {
        let points = table.curve(c)?;
        Some(Quantity { table: from, name: format!("{before}{c}"), points })
    };
    table.columns().iter().filter(told).filter_map(curve).collect()
}

/// The angles about the axes of space by which a solid has turned since its first row: the rotations from row to row, summed, which
/// is the integral of its angular velocity. Full turns count; between two rows it is taken to turn by less than half of one.
fn turns(before: &str, table: &Table) -> Vec<Quantity> {
    let Some(way) = way_turned(table) else { return Vec::new() };
    let about = |(axis, letter): (usize, &str)| Quantity {
        table: "bodies",
        name: format!("{before}turn_{letter} [degrees]"),
        points: way.iter().map(|(t, turn)| [*t, turn[axis].to_degrees()]).collect(),
    };
    ["x", "y", "z"].into_iter().enumerate().map(about).collect()
}

/// Times [s] and the sum of the rotations from row to row until then [rad].
fn way_turned(table: &Table) -> Option<Vec<(f64, DVec3)>> {
    let [w, x, y, z] = ["qw [-]", "qx [-]", "qy [-]", "qz [-]"].map(|c| table.curve(c));
    let (w, x, y, z) = (w?, x?, y?, z?);
    let q = |k: usize| DQuat::from_xyzw(x[k][1], y[k][1], z[k][1], w[k][1]).normalize();
    let mut sum = DVec3::ZERO;
    let until = |k: usize| {
        if k > 0 {
            // q and -q are one orientation: the one that is less than half a turn away.
            let step = q(k) * q(k - 1).conjugate();
            sum += if step.w < 0.0 { -step } else { step }.to_scaled_axis();
        }
        (w[k][0], sum)
    };
    Some((0..w.len()).map(until).collect())
}

/// Seconds a step, from the sum over all stages and the steps between two rows.
fn pace(monitors: &Table) -> Vec<[f64; 2]> {
    let stages = monitors.columns().iter().filter(|c| c.starts_with("wall_"));
    let stages: Vec<Vec<[f64; 2]>> = stages.filter_map(|c| monitors.curve(c)).collect();
    let Some(steps) = monitors.curve("step [-]").filter(|_| !stages.is_empty()) else { return Vec::new() };
    let each = (1..steps.len()).filter_map(|k| {
        let told: Vec<f64> = stages.iter().map(|s| s[k][1]).filter(|s| s.is_finite()).collect();
        let count = steps[k][1] - steps[k - 1][1];
        (count > 0.0 && !told.is_empty()).then(|| [steps[k][0], told.iter().sum::<f64>() / count])
    });
    each.collect()
}

/// Keys and values of a case.
fn flatten(at: &str, value: &toml::Value, out: &mut Vec<(String, String)>) {
    let below = |key: &str| if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
    match value {
        toml::Value::Table(table) => table.iter().for_each(|(k, v)| flatten(&below(k), v, out)),
        toml::Value::Array(all) if all.iter().any(toml::Value::is_table) => {
            all.iter().enumerate().for_each(|(k, v)| flatten(&below(&k.to_string()), v, out));
        }
        other => out.push((at.to_owned(), other.to_string())),
    }
}
