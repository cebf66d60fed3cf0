//! Openings of the tank: walls that emit water at a given velocity or discharge, and walls or holes that swallow it.

use super::check::{Checker, face};
use super::{AXES, Case, Face, TANK_FACES, Tank, Vector};
use serde::{Deserialize, Serialize};

/// Outflows of a case at most: a device counts what each swallows.
pub const OUTFLOWS_MAX: usize = 8;

/// A quantity over time: a number, or rows of time [s] and value with straight lines between them; before the first row the
/// first value holds, after the last one the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or rows of time [s] and value")]
pub enum Rate {
    /// The same at all times.
    Constant(f64),
    /// Rows of time [s] and value.
    Table(Vec<[f64; 2]>),
}

#[cfg(test)]
impl schemars::JsonSchema for Rate {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Rate".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": ["number", "array"],
            "minimum": 0,
            "minItems": 1,
            "items": { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 },
        })
    }
}

impl Rate {
    /// Rows of time and value; a single one for a number.
    pub(crate) fn rows(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Constant(value) => vec![[0.0, *value]],
            Self::Table(rows) => rows.clone(),
        }
    }

    /// Integral over time from 0 to `end` [s], or a little more.
    pub(crate) fn total(&self, end: f64) -> f64 {
        let rows = self.rows();
        let mut sum = rows.first().map_or(0.0, |r| r[1] * r[0].clamp(0.0, end));
        for w in rows.windows(2) {
            sum += 0.5 * (w[0][1] + w[1][1]) * (w[1][0].clamp(0.0, end) - w[0][0].clamp(0.0, end));
        }
        sum + rows.last().map_or(0.0, |r| r[1] * (end - r[0].clamp(0.0, end)))
    }
}

/// A rectangle of the tank's wall through which water comes in: a layer of wall particles moves in with the water's velocity,
/// becomes water when it has gone one spacing, and the next one follows.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Inflow {
    /// Name, for messages and tables.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Face of the tank that it is in.
    pub face: Face,
    /// Lower corner of a box [m]: the opening is the part of the face that lies in it. The whole face if absent.
    pub min: Option<Vector>,
    /// Upper corner of that box [m].
    pub max: Option<Vector>,
    /// Velocity of the water, into the tank [m/s]: a number, or rows of time [s] and velocity. Give this or `discharge`.
    pub velocity: Option<Rate>,
    /// Discharge [m3/s]; in two dimensions of each metre across [m2/s]: a number, or rows of time [s] and discharge.
    pub discharge: Option<Rate>,
}

/// A rectangle of the tank's wall through which water goes out. With `velocity` or `discharge` a wall that draws back and
/// swallows the water that has followed it by a spacing; with neither a hole, out of
/// which water falls freely: it is gone half the hole's width outside.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Outflow {
    /// Name, for messages and tables.
    #[cfg_attr(test, schemars(length(min = 1, max = 80)))]
    pub name: String,
    /// Face of the tank that it is in.
    pub face: Face,
    /// Lower corner of a box [m]: the opening is the part of the face that lies in it. The whole face if absent.
    pub min: Option<Vector>,
    /// Upper corner of that box [m].
    pub max: Option<Vector>,
    /// Velocity of the water, out of the tank [m/s]: a number, or rows of time [s] and velocity. What goes out follows from the
    /// part of the opening that is under water.
    pub velocity: Option<Rate>,
    /// Discharge [m3/s]; in two dimensions of each metre across [m2/s]: a number, or rows of time [s] and discharge. The velocity
    /// follows from the part of the opening that was under water, up to four times that of a full opening.
    pub discharge: Option<Rate>,
}

/// The keys that both have.
#[derive(Clone, Copy)]
pub(crate) struct OpeningKeys<'a> {
    /// Dotted path of its table.
    pub key: &'static str,
    /// Its number in the array of tables.
    pub number: usize,
    pub name: &'a str,
    pub face: Face,
    pub corners: [Option<Vector>; 2],
    pub velocity: Option<&'a Rate>,
    pub discharge: Option<&'a Rate>,
}

/// Room for the jet behind a hole, in its width [-]. A slot in the floor passes 0.64 of b sqrt(2 g h) with this much and with
/// twice as much room, 0.69 to 0.73 without.
const ROOM: f64 = 0.5;

/// How deep the room for a jet behind a hole is, and how much wider than the hole [m]. Of each of the hole's `sides`: its length [m], whether it
/// reaches from wall to wall, and gravity along it. The jet is as thick as the smaller one that does not, as walls guide the water; the
/// upright one if all of the face is open.
pub(crate) fn room_behind(sides: impl Iterator<Item = (f64, bool, f64)> + Clone, l0: f64) -> (f64, f64) {
    let least = sides.clone().filter(|side| !side.1).map(|side| side.0).reduce(f64::min);
    let upright = sides.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs())).map_or(0.0, |side| side.0);
    let deep = (ROOM * least.unwrap_or(upright)).max(l0);
    (deep, (0.5 * deep).max(l0))
}

impl OpeningKeys<'_> {
    /// Dotted path.
    pub fn path(&self) -> String {
        format!("{}.{}", self.key, self.number)
    }

    /// Whether water comes in through it.
    pub fn is_inflow(&self) -> bool {
        self.key == "inflow"
    }

    /// Whether it is a hole, with no wall that moves.
    pub fn is_hole(&self) -> bool {
        self.velocity.is_none() && self.discharge.is_none()
    }

    /// Area [m2] of it in the `tank`; in two dimensions its length [m].
    pub fn area(&self, tank: &Tank, flat: bool) -> f64 {
        let across = |k: usize| {
            let (from, to) = match self.corners {
                [Some(min), Some(max)] => (min[k].max(tank.min[k]), max[k].min(tank.max[k])),
                _ => (tank.min[k], tank.max[k]),
            };
            (to - from).max(0.0)
        };
        let axis = self.side().0;
        (0..3).filter(|&k| k != axis && !(flat && k == 1)).map(across).product()
    }

    /// Axis across the face, and whether it is the larger end.
    pub fn side(&self) -> (usize, usize) {
        let number = TANK_FACES.iter().position(|t| t.0 == self.face).unwrap_or(0);
        (number / 2, number % 2)
    }
}

impl Case {
    /// All openings: inflows, then outflows.
    pub(crate) fn openings(&self) -> impl Iterator<Item = OpeningKeys<'_>> {
        let inflows = self.inflow.iter().enumerate().map(|(number, o)| OpeningKeys {
            key: "inflow",
            number,
            name: &o.name,
            face: o.face,
            corners: [o.min, o.max],
            velocity: o.velocity.as_ref(),
            discharge: o.discharge.as_ref(),
        });
        let outflows = self.outflow.iter().enumerate().map(|(number, o)| OpeningKeys {
            key: "outflow",
            number,
            name: &o.name,
            face: o.face,
            corners: [o.min, o.max],
            velocity: o.velocity.as_ref(),
            discharge: o.discharge.as_ref(),
        });
        inflows.chain(outflows)
    }
}

impl Checker<'_> {
    pub(super) fn openings(&mut self) {
        let case: &Case = self.case;
        if case.outflow.len() > OUTFLOWS_MAX {
            let message = format!("{} outflows are more than are counted apart", case.outflow.len());
            self.add("outflow", message, format!("use {OUTFLOWS_MAX} or fewer"));
        }
        if case.output.ledger && (!case.inflow.is_empty() || !case.outflow.is_empty()) {
            let message = "the energy ledger does not follow water that comes in or goes out";
            self.add("output.ledger", message, "set output.ledger = false, or remove inflow and outflow");
        }
        for opening in case.openings() {
            self.opening(&opening);
        }
    }

    fn opening(&mut self, opening: &OpeningKeys) {
        let case: &Case = self.case;
        let path = opening.path();
        let key = |key: &str| format!("{path}.{key}");
        let what = opening.key;
        if case.fluid.is_none() {
            let message = format!("there is no [fluid] for the {what}");
            self.add(path.clone(), message, format!("add [fluid], or remove the {what}"));
        }
        let (axis, side) = opening.side();
        let Some(tank) = &case.tank else {
            let message = format!("an {what} is in a wall of the tank, and there is none");
            self.add(path.clone(), message, "add [tank]");
            return;
        };
        let name = face(opening.face);
        if self.flat() && axis == 1 {
            let message = format!("there is no `{name}` in two dimensions");
            self.add(key("face"), message, "allowed: x_min, x_max, z_min, z_max");
            return;
        }
        if tank.without_wall().contains(&opening.face) {
            let periodic = tank.periodic()[axis];
            let message = format!("the tank has no wall at `{name}` for the {what} to be in");
            let list = if periodic { "tank.periodic" } else { "tank.open" };
            self.add(key("face"), message, format!("take it out of {list}, or choose another face"));
        }
        let given = [("velocity", opening.velocity.is_some()), ("discharge", opening.discharge.is_some())];
        if self.one_of(&path, &given) == 0 && opening.is_inflow() {
            self.add(
                path.clone(),
                "an inflow without `velocity` or `discharge` brings no water",
                "add `velocity` [m/s] or `discharge` [m3/s]",
            );
        }
        self.opening_box(opening, &tank.min, &tank.max, axis, side);
        let area = opening.area(tank, self.flat());
        for (key, rate, unit) in
            [("velocity", opening.velocity, "m/s"), ("discharge", opening.discharge, "m3/s")]
        {
            let Some(rate) = rate else { continue };
            let path = format!("{path}.{key}");
            if !self.rate(&path, rate, unit) {
                continue;
            }
            let most = rate.rows().iter().map(|r| r[1]).fold(0.0, f64::max);
            if most == 0.0 {
                self.warn(&path, format!("no water ever passes this {what}"), "give a value above 0");
            }
            let full = if key == "velocity" { most } else { most / area };
            // A wall that swallows hurries where it is not all under water.
            let hurry = if key == "discharge" && !opening.is_inflow() { HURRY } else { 1.0 };
            self.crosses(&path, full, hurry);
            // One without area is told of already.
            if full.is_finite() {
                self.speed(&path, full, self.most_speed());
            }
        }
    }

    /// The corners of an opening: both or none, and a box that meets the face.
    fn opening_box(&mut self, opening: &OpeningKeys, low: &Vector, high: &Vector, axis: usize, side: usize) {
        let path = opening.path();
        let (min, max) = match opening.corners {
            [Some(min), Some(max)] => (min, max),
            [None, None] => return,
            [min, _] => {
                let (missing, other) = if min.is_some() { ("max", "min") } else { ("min", "max") };
                let message = format!("the {} has `{other}` but no `{missing}`", opening.key);
                self.add(path, message, format!("add `{missing}`, the other corner [m], or remove both"));
                return;
            }
        };
        if !min.iter().chain(&max).all(|x| x.is_finite()) {
            return;
        }
        for k in self.axes().collect::<Vec<_>>() {
            let wrong = if k == axis { min[k] > max[k] } else { min[k] >= max[k] };
            if wrong {
                let message = format!(
                    "the opening is empty along {}: min {} is not below max {}",
                    AXES[k], min[k], max[k]
                );
                self.add(format!("{path}.max"), message, "min must be smaller than max along the face");
                return;
            }
        }
        let Some(l0) = self.spacing() else { return };
        let at = if side == 0 { low[axis] } else { high[axis] };
        if min[axis] > at + 0.5 * l0 || max[axis] < at - 0.5 * l0 {
            let message = format!(
                "the box from {} = {} to {} m does not meet `{}`, which lies at {at} m",
                AXES[axis],
                min[axis],
                max[axis],
                face(opening.face)
            );
            self.add(format!("{path}.min"), message, format!("let it hold {} = {at}", AXES[axis]));
        }
        for k in self.axes().filter(|&k| k != axis).collect::<Vec<_>>() {
            let across = max[k].min(high[k]) - min[k].max(low[k]);
            if across < l0 * (1.0 - 1e-6) {
                let message = format!(
                    "of the opening {:.4} m along {} lie in the face, less than one particle of {l0} m",
                    across.max(0.0),
                    AXES[k]
                );
                let remedy = format!(
                    "let it reach into {} = {} to {} m, or use a smaller run.spacing",
                    AXES[k], low[k], high[k]
                );
                self.add(format!("{path}.min"), message, remedy);
            }
        }
    }

    /// Rows of time and value; whether they can be used.
    fn rate(&mut self, path: &str, rate: &Rate, unit: &str) -> bool {
        let before = self.problems.len();
        match rate {
            Rate::Constant(value) => self.not_negative(path, *value, unit),
            Rate::Table(rows) => {
                if rows.is_empty() {
                    let remedy = format!("give a number [{unit}], or rows of time [s] and value [{unit}]");
                    self.add(path, "the table has no rows", remedy);
                }
                for (k, row) in rows.iter().enumerate() {
                    self.not_negative(&format!("{path}.{k}.1"), row[1], unit);
                    if k > 0 && row[0] <= rows[k - 1][0] {
                        let message = format!("time {} does not come after {}", row[0], rows[k - 1][0]);
                        self.add(format!("{path}.{k}.0"), message, "let time rise from row to row");
                    }
                }
            }
        }
        self.problems.len() == before && rate.rows().iter().flatten().all(|x| x.is_finite())
    }

    /// A layer is emitted or swallowed once a step at most.
    fn crosses(&mut self, path: &str, speed: f64, hurry: f64) {
        let run = &self.case.run;
        let Some(l0) = self.spacing().filter(|_| !run.adaptive && run.time_step > 0.0) else { return };
        let way = hurry * speed * run.time_step;
        if way.is_finite() && way > 0.5 * l0 {
            let message = format!(
                "at {:.3} m/s water passes up to {:.2} particles far in a step of {} s",
                hurry * speed,
                way / l0,
                run.time_step
            );
            let remedy = format!(
                "use run.time_step = {:.1e} or less, or run.adaptive = true",
                0.35 * l0 / (hurry * speed)
            );
            self.add(path, message, remedy);
        }
    }
}

/// Largest velocity of an outflow of given discharge over that of a full opening.
pub(crate) const HURRY: f64 = 4.0;
