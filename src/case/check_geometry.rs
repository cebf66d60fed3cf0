//! The part of the check that judges shapes: edges, lengths against the spacing, motion, names.

use super::check::{Checker, face, length};
use super::names::{is_pattern, stands_for};
use super::shape::ShapeKey;
use super::{AXES, BodyShape, Face, Form, Tank, Vector};
use crate::periodic::CELLS_MIN;
use std::collections::HashMap;

/// More cells than this are a slip of the pen; what a machine can hold is asked before anything is built.
const MOST_CELLS: f64 = 1e11;
/// Cells that a place may lie away from the origin: they are numbered in 32 bits.
const FARTHEST: f64 = 1e9;

/// The keys of a wall beside those of its shape.
pub(super) struct WallKeys<'a> {
    pub corners: [Option<Vector>; 2],
    pub open: &'a [Face],
    /// `center` and `position`.
    pub places: [Option<Vector>; 2],
}

impl Checker<'_> {
    /// Axes that exist: no y in two dimensions.
    pub(super) fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        let flat = self.flat();
        (0..3).filter(move |&k| !(flat && k == 1))
    }

    /// What is said beside the remedy of a length along axis `k` that is too short.
    fn or_flat(&self, k: usize) -> &'static str {
        if k == 1 { "; for a case in the plane x, z set run.dimensions = 2" } else { "" }
    }

    /// `min` below `max` along every axis; returns whether that holds. `at` is the key to point at.
    pub(super) fn box_edges(&mut self, path: &str, at: &str, min: &Vector, max: &Vector) -> bool {
        let bad: Vec<usize> =
            self.axes().filter(|&k| min[k].is_finite() && max[k].is_finite() && min[k] >= max[k]).collect();
        for &k in &bad {
            let message =
                format!("{path} is empty along {}: min {} is not below max {}", AXES[k], min[k], max[k]);
            self.add(
                at,
                message,
                format!("min must be smaller than max along every axis{}", self.or_flat(k)),
            );
        }
        bad.is_empty() && min.iter().chain(max).all(|x| x.is_finite())
    }

    /// At least one particle across along every axis, and no more cells than fit into memory.
    pub(super) fn fits(&mut self, path: &str, what: &str, min: &Vector, max: &Vector) {
        let Some(l0) = self.spacing() else { return };
        let Some(k) = self.axes().min_by(|&a, &b| (max[a] - min[a]).total_cmp(&(max[b] - min[b]))) else {
            return;
        };
        let cells: f64 = self.axes().map(|k| (max[k] - min[k]) / l0).product();
        let far = self.axes().map(|k| min[k].abs().max(max[k].abs()) / l0).fold(0.0, f64::max);
        if cells > MOST_CELLS || far > FARTHEST {
            let message = format!("{what} takes up or lies beyond {:.1e} cells of {l0} m", cells.max(far));
            self.add(path, message, "use a larger run.spacing, or correct a length that is far too large");
            return;
        }
        let across = max[k] - min[k];
        if across < l0 * (1.0 - 1e-6) {
            let message =
                format!("{what} is {across:.4} m across along {}, less than one particle of {l0} m", AXES[k]);
            let finer = format!("use run.spacing = {} or less{}", round_down(across), self.or_flat(k));
            self.add(path, message, finer);
        }
    }

    /// A place that can be numbered in cells.
    pub(super) fn place(&mut self, path: &str, at: &[f64]) {
        let Some(l0) = self.spacing() else { return };
        let far = at.iter().map(|x| x.abs() / l0).fold(0.0, f64::max);
        if far.is_finite() && far > FARTHEST {
            let message = format!("{far:.1e} cells of {l0} m away from the origin");
            self.add(path, message, "use a larger run.spacing, or correct a length that is far too large");
        }
    }

    fn open(&mut self, path: &str, open: &[Face]) {
        for (i, &f) in open.iter().enumerate() {
            if open[..i].contains(&f) {
                self.add(
                    format!("{path}.open.{i}"),
                    format!("`{}` is listed twice", face(f)),
                    "remove one of them",
                );
            }
        }
        if open.len() >= 6 {
            self.add(
                format!("{path}.open"),
                "every face is open, so that nothing is left",
                "close at least one face",
            );
        }
    }

    /// Sides that the water goes on across: each once, no walls' business, and of a length that the search can go round.
    fn periodic(&mut self, tank: &Tank) {
        let case = self.case;
        for (i, &axis) in tank.periodic.iter().enumerate() {
            let (k, path) = (axis as usize, format!("tank.periodic.{i}"));
            let name = AXES[k];
            if tank.periodic[..i].contains(&axis) {
                self.add(path, format!("\"{name}\" is listed twice"), "remove one of them");
                continue;
            }
            if self.flat() && k == 1 {
                let message = "in two dimensions there is nothing along y";
                self.add(path, message, "remove \"y\", or set run.dimensions = 3");
                continue;
            }
            let of_axis =
                |f: &&Face| super::TANK_FACES.iter().position(|t| t.0 == **f).is_some_and(|n| n / 2 == k);
            if let Some(&open) = tank.open.iter().find(of_axis) {
                let message = format!("the tank is periodic along {name} and open at `{}`", face(open));
                self.add("tank.open", message, format!("remove `{}`: the side has no wall", face(open)));
            }
            let (Some(l0), length) = (self.spacing(), tank.max[k] - tank.min[k]) else { continue };
            let cells = length / l0;
            if !(cells.is_finite() && cells > 0.0 && cells < 1e9) {
                continue;
            }
            let least = (f64::from(CELLS_MIN) * case.run.effective_radius - 1e-6).ceil();
            let end = |n: f64| tank.min[k] + n * l0;
            if (cells - cells.round()).abs() > 1e-6 * cells.clamp(1.0, 1e3) {
                let (short, long) = (cells.floor().max(least), cells.ceil().max(least));
                let message = format!(
                    "the tank is {length} m long along {name}, {cells:.3} spacings of {l0} m: round a periodic axis the \
                     lattice must close"
                );
                let remedy = format!(
                    "use {} m or {} m (tank.max.{k} = {} or {})",
                    digits(short * l0),
                    digits(long * l0),
                    digits(end(short)),
                    digits(end(long))
                );
                self.add(format!("tank.max.{k}"), message, remedy);
            } else if cells.round() < least {
                let message = format!(
                    "the tank is {length} m long along {name}, less than {CELLS_MIN} effective radii of {} m: a particle \
                     would meet another one and its image at once",
                    digits(case.run.effective_radius * l0)
                );
                let remedy = format!(
                    "use {} m or more (tank.max.{k} = {}), or run.spacing = {} or less",
                    digits(least * l0),
                    digits(end(least)),
                    round_down(length / least)
                );
                self.add(format!("tank.max.{k}"), message, remedy);
            }
        }
    }

    pub(super) fn walls(&mut self) {
        let case = self.case;
        if let Some(tank) = &case.tank {
            if self.box_edges("tank", "tank.max", &tank.min, &tank.max) {
                self.fits("tank", "the tank", &tank.min, &tank.max);
            }
            self.open("tank", &tank.open);
            self.periodic(tank);
        }
        let tank = case.tank.as_ref();
        for (k, o) in case.obstacle.iter().enumerate() {
            let label = format!("obstacle `{}`", o.name);
            let keys = WallKeys { corners: [o.min, o.max], open: &o.open, places: [o.center, o.position] };
            self.wall(&format!("obstacle.{k}"), &label, &keys, &o.form(tank));
        }
        for (k, w) in case.moving_wall.iter().enumerate() {
            let path = format!("moving_wall.{k}");
            let label = format!("moving wall `{}`", w.name);
            let keys = WallKeys { corners: [w.min, w.max], open: &w.open, places: [w.center, w.position] };
            self.wall(&path, &label, &keys, &w.form(tank));
            if w.shape == BodyShape::Terrain {
                let message = format!("{label}: a terrain is ground, which does not move");
                self.add(
                    format!("{path}.shape"),
                    message,
                    "make it an [[obstacle]], or set shape = \"mesh\"",
                );
            }
            self.wall_guided(&path, w);
        }
        for (k, plane) in case.plane.iter().enumerate() {
            self.plane(&format!("plane.{k}"), plane);
        }
    }

    /// A wall is a box with two corners, or any other shape at its place.
    pub(super) fn wall(&mut self, path: &str, label: &str, keys: &WallKeys, form: &Form) {
        let key = |key: &str| format!("{path}.{key}");
        let [min, max] = keys.corners;
        if min.or(max).is_none() && self.forgotten(path, label, form) {
            return;
        }
        if form.shape == BodyShape::Box && form.size.is_none() {
            match (min, max) {
                (Some(min), Some(max)) => {
                    if self.box_edges(path, &key("max"), &min, &max) {
                        self.fits(path, label, &min, &max);
                    }
                }
                (None, None) => self.add(
                    path,
                    format!("{label} has neither corners nor a `size`"),
                    "add `min` and `max`, or another `shape` with its keys",
                ),
                (given, _) => {
                    let (missing, other) = if given.is_some() { ("max", "min") } else { ("min", "max") };
                    let message = format!("{label} has `{other}` but no `{missing}`");
                    self.add(path, message, format!("add `{missing}`, the other corner [m]"));
                }
            }
            self.open(path, keys.open);
            for ShapeKey { name, of, .. } in form.shape_keys().into_iter().filter(|key| key.given) {
                let message = format!("{label} is a box: `{name}` does not belong to it");
                self.add(key(name), message, format!("remove `{name}`, or set shape = \"{of}\""));
            }
            let of_shapes = [
                ("center", keys.places[0].is_some()),
                ("position", keys.places[1].is_some()),
                ("axis", form.axis.is_some()),
                ("scale", form.scale.is_some()),
                ("orientation", form.orientation.is_some()),
            ];
            for (name, _) in of_shapes.into_iter().filter(|f| f.1) {
                let message = format!("{label} stands where its corners are: `{name}` has no effect");
                self.add(
                    key(name),
                    message,
                    format!("remove `{name}`, or give `size` and `center`, without corners"),
                );
            }
            return;
        }
        let (name, _) = form.shape.keys();
        for (corner, _) in [("min", min), ("max", max)].into_iter().filter(|c| c.1.is_some()) {
            let message =
                format!("{label} is a {name} with a place of its own: `{corner}` does not belong to it");
            let remedy = format!("remove `{corner}`, or its shape and `size` for a box from `min` to `max`");
            self.add(key(corner), message, remedy);
        }
        if !keys.open.is_empty() {
            let message = format!("{label}: only a box from `min` to `max` has faces to leave open");
            self.add(key("open"), message, "remove `open`");
        }
        let (own, other) = if form.shape.has_origin() { (1, 0) } else { (0, 1) };
        let names = ["center", "position"];
        if keys.places[other].is_some() {
            let message = format!("{label} is a {name}: `{}` does not belong to it", names[other]);
            self.add(key(names[other]), message, format!("use `{}`", names[own]));
        }
        if own == 0 && keys.places[0].is_none() {
            let message = format!("{label} is a {name} without `center`");
            self.add(path, message, "add `center`, where its centroid is [m]");
        }
        if let Some(at) = keys.places[own] {
            self.place(&key(names[own]), &at);
        }
        self.form(path, label, form);
    }

    /// Cells of a plane's surface, one across in two dimensions; infinite if it lies too far off.
    fn plane_cells(&self, plane: &super::Plane, l0: f64) -> f64 {
        let across = if self.flat() { 1.0 } else { (plane.size[1] / l0).max(1.0) };
        let far = plane.center.iter().map(|x| x.abs() / l0).fold(0.0, f64::max);
        let cells = (plane.size[0] / l0).max(1.0) * across;
        if far > FARTHEST { f64::INFINITY } else { cells }
    }

    fn plane(&mut self, path: &str, plane: &super::Plane) {
        let (n, a) = (plane.normal, plane.along);
        let cross = [n[1] * a[2] - n[2] * a[1], n[2] * a[0] - n[0] * a[2], n[0] * a[1] - n[1] * a[0]];
        if length(&n) == 0.0 {
            self.add(
                format!("{path}.normal"),
                "the normal has no length",
                "give a direction, e.g. [0, 0, 1]",
            );
        } else if length(&cross) <= 1e-6 * length(&n) * length(&a) {
            self.add(
                format!("{path}.along"),
                "`along` has no length or is parallel to the normal",
                "give a direction in the plane",
            );
        } else if self.flat() && (n[1] != 0.0 || a[1] != 0.0) {
            self.add(
                format!("{path}.normal"),
                "in two dimensions a plane stands upright on x, z",
                "set the y components of `normal` and `along` to 0",
            );
        }
        if let Some(l0) = self.spacing()
            && self.plane_cells(plane, l0) > MOST_CELLS
        {
            self.add(
                format!("{path}.size"),
                "more particles than fit into memory",
                "use a larger run.spacing",
            );
        }
        let sizes = if self.flat() { 1 } else { 2 };
        for (i, &size) in plane.size.iter().enumerate().take(sizes) {
            let path = format!("{path}.size.{i}");
            self.positive(&path, size, "m");
            if let Some(l0) = self.spacing().filter(|&l0| size > 0.0 && size < l0 * (1.0 - 1e-6)) {
                let message =
                    format!("plane `{}` is {size:.4} m across, less than one particle of {l0} m", plane.name);
                self.add(path, message, format!("use run.spacing = {} or less", round_down(size)));
            }
        }
    }

    /// Names of everything that messages and gauges refer to.
    pub(super) fn names(&mut self) {
        let case = self.case;
        let names: Vec<(String, String)> = (case.obstacle.iter().enumerate())
            .map(|(k, o)| (format!("obstacle.{k}.name"), o.name.clone()))
            .chain(case.plane.iter().enumerate().map(|(k, p)| (format!("plane.{k}.name"), p.name.clone())))
            .chain(
                case.moving_wall
                    .iter()
                    .enumerate()
                    .map(|(k, w)| (format!("moving_wall.{k}.name"), w.name.clone())),
            )
            .chain(case.body.iter().enumerate().map(|(k, b)| (format!("body.{k}.name"), b.name.clone())))
            .chain(case.openings().map(|o| (format!("{}.name", o.path()), o.name.to_owned())))
            .collect();
        self.unique(&names, "solid");
        for (path, name) in names.iter().filter(|(_, name)| is_pattern(name) || stands_for("tank", name)) {
            let why = "stands for the tank, or for several solids, wherever a case names one";
            let remedy = "choose another name, without `*` and none of `tank` and `tank. ...`";
            self.add(path.clone(), format!("the name `{name}` {why}"), remedy);
        }
    }

    /// Names given as (path, name) must be there and differ.
    pub(super) fn unique(&mut self, names: &[(String, String)], what: &str) {
        let mut taken: HashMap<&str, &str> = HashMap::new();
        for (path, name) in names {
            let first = taken.get(name.as_str()).copied();
            taken.entry(name).or_insert(path);
            if name.trim().is_empty() {
                self.add(path.clone(), "the name is empty", "give it a name");
            } else if let Some(why) = unfit(name) {
                self.add(
                    path.clone(),
                    format!("the name `{}` {why}", name.escape_debug()),
                    "names stand in tables and on terminals: use letters, digits, spaces, _ and -",
                );
            } else if let Some(first) = first {
                self.add(
                    path.clone(),
                    format!(
                        "the name `{name}` is taken by {}",
                        self.case.written.key(first.trim_end_matches(".name"))
                    ),
                    format!("give each {what} its own name"),
                );
            }
        }
    }
}

/// Longest name.
const LONGEST_NAME: usize = 80;

/// Why a name cannot stand in a table or on a terminal.
fn unfit(name: &str) -> Option<String> {
    if name.chars().any(|c| c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'))
    {
        return Some("holds control characters".into());
    }
    if name.chars().count() > LONGEST_NAME {
        return Some(format!("is longer than {LONGEST_NAME} characters"));
    }
    // Spreadsheets take such a cell for a formula.
    name.trim_start().starts_with(['=', '+', '-', '@']).then(|| "begins like a formula".into())
}

/// A length as somebody would write it.
fn digits(x: f64) -> String {
    format!("{:.9}", x).trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A length rounded down to three digits, for a remedy that works when it is copied.
fn round_down(x: f64) -> f64 {
    let digit = 10f64.powi(x.log10().floor() as i32 - 2);
    let rounded = (x / digit + 1e-9).floor() * digit;
    format!("{rounded:.3e}").parse().unwrap_or(rounded)
}
