//! What serde cannot judge: ranges, keys that exclude or need each other, lengths against the spacing.
//!
//! Everything is listed at once; `file` adds line and column from the dotted path of each problem.

use super::{AXES, Case, Choice, Face, Fluid, Vector};
use crate::error::{CaseError, Problem, Result};
use crate::scheme::{Gradient, Source};

/// Most iterations of a solve: beyond, a step would not come to its end.
const MOST_ITERATIONS: u32 = 1_000_000;
/// With the consistent gradient and collisions from nearer than this, over l0, columns that collapse came to ten times their energy.
const COLLISION_LEAST: f64 = 0.7;

/// All problems and warnings of a case.
pub fn check(case: &Case) -> Vec<Problem> {
    let mut c = Checker { case, problems: Vec::new() };
    c.finite();
    c.run();
    c.fluid();
    c.walls();
    c.absorbers();
    c.openings();
    c.names();
    for (k, body) in case.body.iter().enumerate() {
        c.body(k, body);
    }
    c.contact();
    c.gauges();
    c.output();
    c.slips();
    c.problems
}

/// Refuses a case with problems; for callers that have no file to point at.
///
/// # Errors
/// [`crate::error::Error::Case`] with all problems.
pub fn refuse(case: &Case) -> Result<()> {
    if let Some(key) = case.several() {
        let message = format!("{key} stands for several solids that are not laid out yet");
        return Err(
            CaseError::from(Problem::new(key, message, "take what `Case::laid_out` makes of it")).into()
        );
    }
    let wrong: Vec<CaseError> = check(case).into_iter().filter(|p| !p.warning).map(CaseError::from).collect();
    if wrong.is_empty() { Ok(()) } else { Err(CaseError::all(wrong).into()) }
}

/// Collects problems.
pub(super) struct Checker<'a> {
    pub(super) case: &'a Case,
    pub(super) problems: Vec<Problem>,
}

impl Checker<'_> {
    pub(super) fn add(
        &mut self,
        path: impl Into<String>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.problems.push(Problem::new(path, message, remedy));
    }
    pub(super) fn warn(&mut self, path: &str, message: String, remedy: &str) {
        self.add(path, message, remedy);
        if let Some(last) = self.problems.last_mut() {
            last.warning = true;
        }
    }
    /// Finite numbers outside of a range; what is not finite has been reported already.
    pub(super) fn range(&mut self, path: &str, value: f64, fits: bool, allowed: &str) {
        if value.is_finite() && !fits {
            // Nobody counts three hundred digits.
            let plain = value == 0.0 || (1e-6..1e9).contains(&value.abs());
            let shown = if plain { value.to_string() } else { format!("{value:e}") };
            self.add(path, format!("{shown} is out of range"), format!("allowed: {allowed}"));
        }
    }
    pub(super) fn positive(&mut self, path: &str, value: f64, unit: &str) {
        self.range(path, value, value > 0.0, &format!("more than 0 {unit}"));
    }
    pub(super) fn not_negative(&mut self, path: &str, value: f64, unit: &str) {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        self.range(path, value, value >= 0.0, &format!("0{unit} or more"));
    }
    /// At most one of some optional keys; returns how many are given.
    pub(super) fn one_of(&mut self, table: &str, given: &[(&str, bool)]) -> usize {
        let names: Vec<String> = given.iter().filter(|g| g.1).map(|g| format!("`{}`", g.0)).collect();
        if names.len() > 1 {
            let last = given.iter().rfind(|g| g.1).map_or("", |g| g.0);
            self.add(
                format!("{table}.{last}"),
                format!("{} exclude each other", names.join(" and ")),
                "keep one of them",
            );
        }
        names.len()
    }
    /// In two dimensions nothing moves along y, or turns about another axis.
    pub(super) fn in_plane(&mut self, path: &str, along: &Vector) {
        if self.flat() && along[1] != 0.0 {
            let message = format!("{} along y: in two dimensions there are x and z alone", along[1]);
            self.add(path, message, "set the second number to 0 (z is up), or run.dimensions = 3");
        }
    }
    /// See [`Self::in_plane`].
    pub(super) fn about_y(&mut self, path: &str, axis: &Vector) {
        if self.flat() && (axis[0] != 0.0 || axis[2] != 0.0) {
            self.add(
                path,
                "in two dimensions a solid turns about y alone",
                "set the first and the third number to 0",
            );
        }
    }
    pub(super) fn flat(&self) -> bool {
        self.case.run.dimensions == 2
    }
    /// The spacing, where it can be used to judge lengths.
    pub(super) fn spacing(&self) -> Option<f64> {
        let l0 = self.case.run.spacing;
        (l0.is_finite() && l0 > 0.0).then_some(l0)
    }

    /// Every float of the case, wherever it stands.
    fn finite(&mut self) {
        if let Ok(value) = toml::Value::try_from(self.case) {
            let mut found = Vec::new();
            not_finite(&value, String::new(), &mut found);
            for (path, x) in found {
                self.add(path, format!("{x} is not a finite number"), "write a finite number");
            }
        }
    }

    fn run(&mut self) {
        let run = &self.case.run;
        self.positive("run.spacing", run.spacing, "m");
        // NaN stands for none, and is no number that a case is written with.
        if run.time_step.is_nan() {
            self.add("run.time_step", "it is not a finite number", "give it in seconds, or leave it out");
        }
        self.positive("run.time_step", run.time_step, "s");
        self.positive("run.end", run.end, "s");
        self.in_plane("run.gravity", &run.gravity);
        let re = run.effective_radius;
        self.range("run.effective_radius", re, (1.5..=4.1).contains(&re), "1.5 to 4.1 (2.1 in the paper)");
        if !matches!(run.dimensions, 2 | 3) {
            self.add(
                "run.dimensions",
                format!("{} is not a number of dimensions", run.dimensions),
                "allowed: 2, 3",
            );
        }
        self.not_negative("run.checkpoint.wall", run.checkpoint.wall, "s (0: no checkpoints by the clock)");
        if let Some(every) = run.checkpoint.every {
            self.positive("run.checkpoint.every", every, "s");
        }
        if let Some([min, max]) = &run.domain {
            self.box_edges("run.domain", "run.domain", min, max);
            self.place("run.domain", min);
            self.place("run.domain", max);
        }
        if run.spacing > 0.0 && run.time_step > 0.0 && run.end.is_finite() && run.end / run.time_step > 1e9 {
            let message = format!("{:.1e} steps of {:e} s", run.end / run.time_step, run.time_step);
            self.add("run.time_step", message, "shorten run.end or use a larger run.time_step");
        }
        if run.from.as_deref() == Some("") {
            self.add("run.from", "it names nothing", "name the folder of a run, or leave it out");
        }
        if run.time_step > run.end && run.end > 0.0 && run.time_step.is_finite() {
            let message =
                format!("a step of {} s is longer than the whole run of {} s", run.time_step, run.end);
            self.add("run.time_step", message, "use a smaller run.time_step or a larger run.end");
        }
    }

    fn fluid(&mut self) {
        let Some(fluid) = &self.case.fluid else { return };
        self.positive("fluid.density", fluid.density, "kg/m3");
        self.not_negative("fluid.viscosity", fluid.viscosity, "m2/s");
        self.viscosity(fluid);
        if let Some(friction) = fluid.wall_friction {
            let what = "0 to 1 (0.0025 for smooth walls, 0 for none)";
            self.range("fluid.wall_friction", friction, (0.0..=1.0).contains(&friction), what);
        }
        if fluid.suction && (fluid.source() != Source::Mixed || fluid.gradient() != Gradient::Consistent) {
            let message = "the paper's source and gradient know no pressures below zero";
            self.add("fluid.suction", message, "remove `suction`, or use preset = \"accurate\"");
        }
        let beta = fluid.free_surface_threshold;
        self.range(
            "fluid.free_surface_threshold",
            beta,
            beta > 0.0 && beta < 1.0,
            "between 0 and 1 (0.97 in most work)",
        );
        let a = fluid.collision_distance;
        self.range("fluid.collision_distance", a, (0.0..=1.0).contains(&a), "0 to 1 (0.8 in the paper)");
        if fluid.gradient() == Gradient::Consistent && (0.0..COLLISION_LEAST).contains(&a) {
            let message =
                format!("with {a} water that falls or collapses may gain energy until the run ends");
            self.warn(
                "fluid.collision_distance",
                message,
                "leave it at 0.8, but for waves that do not break",
            );
        }
        let b = fluid.collision_restitution;
        self.range("fluid.collision_restitution", b, (0.0..=1.0).contains(&b), "0 to 1 (0.2 in the paper)");
        if let Some(alpha) = fluid.compressibility {
            self.range(
                "fluid.compressibility",
                alpha,
                alpha >= 1e-14,
                "1e-14 1/Pa or more: 0 makes closed cavities singular",
            );
        }
        self.one_of(
            "fluid",
            &[("relaxation", fluid.relaxation.is_some()), ("sound_speed", fluid.sound_speed.is_some())],
        );
        if let Some(gamma) = fluid.relaxation {
            self.relaxation("fluid.relaxation", gamma);
        }
        if let Some(speed) = fluid.sound_speed {
            self.positive("fluid.sound_speed", speed, "m/s");
            // With an adaptive step c_s dt stays below 0.7 l0 and gamma below 0.5.
            if let Some(l0) = self.spacing().filter(|_| !self.case.run.adaptive && speed > 0.0) {
                self.relaxation("fluid.sound_speed", (speed * self.case.run.time_step / l0).powi(2));
            }
        }
        let jitter = fluid.jitter;
        self.range("fluid.jitter", jitter, (0.0..=0.3).contains(&jitter), "0 to 0.3 of the spacing");
        self.water(&fluid.shape, &fluid.fill);
        let none = fluid.block.is_empty() && fluid.shape.is_empty() && fluid.fill.is_empty();
        if none && self.case.inflow.is_empty() {
            self.add(
                "fluid",
                "no water at t = 0",
                "add a [[fluid.block]], [[fluid.shape]], [[fluid.fill]] or [[inflow]], or leave [fluid] out for a dry scene",
            );
        }
        if let Some(most) = fluid.max_volume {
            self.positive("fluid.max_volume", most, "m3");
            if self.case.inflow.is_empty() {
                let message = "without an inflow there is never more water than at t = 0";
                self.add("fluid.max_volume", message, "remove it, or add an [[inflow]]");
            }
        }
        for (k, block) in fluid.block.iter().enumerate() {
            let path = format!("fluid.block.{k}");
            self.gradient(&path, block.velocity_gradient.as_ref());
            self.in_plane(&format!("{path}.velocity"), &block.velocity);
            if self.box_edges(&path, &format!("{path}.max"), &block.min, &block.max) {
                self.fits(&path, "the block", &block.min, &block.max);
            }
        }
        let tolerance = fluid.solver.tolerance;
        self.range(
            "fluid.solver.tolerance",
            tolerance,
            tolerance > 0.0 && tolerance < 1.0,
            "between 0 and 1 (1e-3 is enough)",
        );
        if fluid.solver.max_iterations == 0 {
            self.add("fluid.solver.max_iterations", "0 iterations solve nothing", "allowed: 1 or more");
        } else if fluid.solver.max_iterations > MOST_ITERATIONS {
            let message = format!("{} iterations in a step never end", fluid.solver.max_iterations);
            self.add("fluid.solver.max_iterations", message, format!("allowed: 1 to {MOST_ITERATIONS}"));
        }
    }

    /// Viscosity is explicit: beyond a number of diffusion it grows instead of damping. An adaptive step keeps off.
    fn viscosity(&mut self, fluid: &Fluid) {
        let run = &self.case.run;
        let fits = matches!(run.dimensions, 2 | 3) && (1.5..=4.1).contains(&run.effective_radius);
        let Some(l0) = self.spacing().filter(|_| fits && !run.adaptive && run.time_step > 0.0) else {
            return;
        };
        let limit = fluid.shear(run.dimensions, run.effective_radius).limit;
        let number = fluid.viscosity * run.time_step / (l0 * l0);
        if number > limit {
            let dt = 0.5 * limit * l0 * l0 / fluid.viscosity;
            self.add(
                "fluid.viscosity",
                format!("nu dt / l0^2 = {number:.3e} is unstable, the limit is {limit:.3}"),
                format!("use run.time_step = {dt:.1e} or less, or run.adaptive = true"),
            );
        }
    }

    /// gamma of Eq. (8): the density error oscillates at sqrt(gamma) / dt and grows from 4 on.
    fn relaxation(&mut self, path: &str, gamma: f64) {
        if gamma >= 4.0 {
            self.add(
                path,
                format!("relaxation gamma = {gamma:.3} is unstable"),
                "allowed: more than 0, less than 4; 0.5 or less is wise",
            );
        } else if gamma > 0.5 {
            self.warn(
                path,
                format!("relaxation gamma = {gamma:.3} makes the pressure noisy"),
                "use 0.5 or less: a smaller run.time_step or sound_speed, or run.adaptive = true",
            );
        } else {
            self.range(path, gamma, gamma > 0.0, "more than 0, at most 0.5");
        }
    }

    /// Warns of what lies wholly behind a wall of the tank, from `low` to `high` along x and y [m].
    pub(super) fn in_tank(&mut self, path: &str, [low, high]: [[f64; 2]; 2], what: &str) {
        let Some(tank) = &self.case.tank else { return };
        let bare = tank.without_wall();
        let axes = self.axes().filter(|&k| k < 2);
        let behind = axes.flat_map(|k| [(2 * k, high[k] < tank.min[k]), (2 * k + 1, low[k] > tank.max[k])]);
        let walled = |side: &usize| !bare.contains(&super::TANK_FACES[*side].0);
        let sides: Vec<usize> = behind.filter(|b| b.1).map(|b| b.0).filter(walled).collect();
        for side in sides {
            let message =
                format!("{what} lies behind the wall `{}`, where no water comes", super::TANK_FACES[side].1);
            self.warn(path, message, "move it into the tank");
        }
    }

    fn output(&mut self) {
        let output = &self.case.output;
        self.not_negative("output.every", output.every, "s (0 writes no frames)");
        if let Some(every) = output.table_every {
            self.positive("output.table_every", every, "s");
        }
        self.frames("output", output.choice());
        for (k, series) in output.series.iter().enumerate() {
            let path = format!("output.series.{k}");
            let allowed = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
            if series.name.is_empty() || series.name.chars().count() > 80 || !series.name.chars().all(allowed)
            {
                let message = format!("`{}` is the name of a folder", series.name);
                self.add(format!("{path}.name"), message, "write 1 to 80 letters, digits, `-` or `_`");
            }
            // There are systems to which a and A are the same.
            let lower = series.name.to_lowercase();
            if output.series[..k].iter().any(|other| other.name.to_lowercase() == lower) {
                let message = format!("two series are called `{}`", series.name);
                self.add(format!("{path}.name"), message, "give each a name of its own");
            }
            self.positive(&format!("{path}.every"), series.every, "s");
            if series.kinds.is_empty() {
                let message = "no kind of particle is asked for: the series would hold nothing";
                self.add(format!("{path}.kinds"), message, "name some, or leave out the series");
            }
            self.frames(&path, series.choice());
        }
    }

    /// Fields and region of a series of frames, whose keys begin with `path`.
    fn frames(&mut self, path: &str, Choice { fields, region, .. }: Choice<'_>) {
        if let Some(k) = (1..fields.len()).find(|&k| fields[..k].contains(&fields[k])) {
            self.add(format!("{path}.fields.{k}"), "a field is named twice", "name each field once");
        }
        let Some(region) = region else { return };
        let key = format!("{path}.region");
        if !self.box_edges(&key, &format!("{key}.max"), &region.min, &region.max) {
            return;
        }
        let Some(tank) = &self.case.tank else { return };
        // Along a periodic axis it holds the images of what is in the tank.
        let periodic = tank.periodic();
        let apart =
            |k: &usize| !periodic[*k] && (region.max[*k] <= tank.min[*k] || region.min[*k] >= tank.max[*k]);
        if let Some(k) = self.axes().find(apart) {
            let axis = AXES[k];
            self.add(
                key,
                format!("{path}.region lies outside of the tank along {axis}: its frames would hold nothing"),
                format!("let it reach into {} to {} m", tank.min[k], tank.max[k]),
            );
        }
    }
}

/// Paths of floats that are infinite or not a number.
fn not_finite(value: &toml::Value, path: String, found: &mut Vec<(String, f64)>) {
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        toml::Value::Float(x) if !x.is_finite() => found.push((path, *x)),
        toml::Value::Array(items) => {
            for (k, item) in items.iter().enumerate() {
                not_finite(item, join(&k.to_string()), found);
            }
        }
        toml::Value::Table(table) => {
            for (key, item) in table {
                not_finite(item, join(key), found);
            }
        }
        _ => {}
    }
}

/// Length of a vector.
pub(super) fn length(v: &Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Name of a face as it is written.
pub(crate) fn face(face: Face) -> &'static str {
    match face {
        Face::XMin => "x_min",
        Face::XMax => "x_max",
        Face::YMin => "y_min",
        Face::YMax => "y_max",
        Face::ZMin => "z_min",
        Face::ZMax => "z_max",
    }
}
