//! Several like solids from one table: at places that are written down, in rows, or by chance.
//!
//! They are laid out as a table for each before anything else looks at the case. [`Written`] leads from the key of
//! one of them back to the table that it came from, for messages and overrides.

use super::check::Checker;
use super::scatter::{Scatter, Standing, scattered};
use super::{AXES, Body, Case, Form, Obstacle, Turn, Vector};
use crate::error::{CaseError, Problem, Result};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Most solids that one table stands for.
pub(super) const MOST: u32 = 20_000;

/// Like solids in rows.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Array {
    /// How many along x, y and z, 1 or more each.
    #[cfg_attr(test, schemars(transform = super::bounds::each_counted))]
    pub count: [u32; 3],
    /// From one to the next along x, y and z [m].
    pub step: Vector,
}

/// Where the solids of a case that stand in tables for several were written.
#[derive(Clone, Debug, Default)]
pub struct Written {
    body: Vec<Origin>,
    obstacle: Vec<Origin>,
    /// The tables themselves, if any stands for several.
    typed: Option<Box<Typed>>,
}

/// Tables as they were written.
#[derive(Clone, Debug, Default)]
struct Typed {
    body: Vec<Body>,
    obstacle: Vec<Obstacle>,
}

/// Where one solid was written.
#[derive(Clone, Debug)]
struct Origin {
    /// Number of the table.
    table: usize,
    /// Which of its solids it is, from 0, and the key that puts it there; of a table for one: none.
    copy: Option<(usize, &'static str)>,
}

impl Written {
    /// The key as it was written of `key`, that of a solid that was laid out: `body.0.density` for `body.17.density`,
    /// and what puts a solid where it is for its place.
    pub(crate) fn key(&self, key: &str) -> String {
        let of = solid_of(key);
        let Some(origin) = self.origin(of) else { return key.to_owned() };
        let table = of.split('.').next().unwrap_or_default();
        let own = |rest: &str| format!("{table}.{}{rest}", origin.table);
        let rest = &key[of.len()..];
        let word = rest.split('.').nth(1);
        let of_place =
            [None, Some("center"), Some("position"), Some("min"), Some("max"), Some("orientation")];
        match origin.copy {
            Some((copy, by)) if of_place.contains(&word) => match (by, copy.checked_sub(1)) {
                ("copies", Some(further)) => own(&format!(".copies.{further}")),
                // The first one stands where the table says.
                ("copies", None) => own(rest),
                ("array", None) if word.is_some() => own(rest),
                _ => own(&format!(".{by}")),
            },
            _ => own(rest),
        }
    }

    /// `problems` under the keys as they were written; what all copies of a table have alike is told of the first.
    pub(super) fn problems(&self, problems: Vec<Problem>) -> Vec<Problem> {
        let mut told: HashMap<String, String> = HashMap::new();
        let kept = problems.into_iter().filter_map(|problem| {
            let (key, of) = (self.key(&problem.key), solid_of(&problem.key));
            // The place of each is its own.
            let shared = self.origin(of).is_some_and(|origin| origin.copy.is_some()) && !is_place(&key);
            if shared && told.entry(key.clone()).or_insert_with(|| of.to_owned()) != of {
                return None;
            }
            let message = match problem.message.strip_prefix(&problem.key) {
                Some(rest) => format!("{key}{rest}"),
                None => problem.message.clone(),
            };
            Some(Problem { key, message, ..problem })
        });
        kept.collect()
    }

    /// Where the solid at the key `of` was written, `body.17` say.
    fn origin(&self, of: &str) -> Option<&Origin> {
        let (table, number) = of.split_once('.')?;
        let origins = match table {
            Body::TABLE => &self.body,
            Obstacle::TABLE => &self.obstacle,
            _ => return None,
        };
        origins.get(number.parse::<usize>().ok()?)
    }
}

/// The table and number that a key begins with: `body.17` of `body.17.density`.
fn solid_of(key: &str) -> &str {
    let end = key.match_indices('.').nth(1).map_or(key.len(), |(at, _)| at);
    &key[..end]
}

/// Whether a key is one that puts solids where they are.
fn is_place(key: &str) -> bool {
    key.split('.').nth(2).is_some_and(|word| ["copies", "array", "scatter"].contains(&word))
}

/// What a table that may stand for several says.
trait Several: Clone {
    /// Name of such tables.
    const TABLE: &'static str;
    fn name(&mut self) -> &mut String;
    fn copies(&self) -> &[Vector];
    fn array(&self) -> Option<&Array>;
    fn scatter(&self) -> Option<&Scatter>;
    /// The point that `copies` puts somewhere else, and the key that says where it is.
    fn place(&self) -> (&'static str, Vector);
    fn form(&self) -> Form<'_>;
    fn orientation(&mut self) -> &mut Option<Turn>;
    /// Takes out what makes it several.
    fn make_one(&mut self);
    /// Moves it, with all that is said of places.
    fn shift(&mut self, way: Vector);

    /// The keys that make it several.
    fn by(&self) -> [(&'static str, bool); 3] {
        [
            ("copies", !self.copies().is_empty()),
            ("array", self.array().is_some()),
            ("scatter", self.scatter().is_some()),
        ]
    }
}

/// Adds `way` to a place, if it is given.
fn add(place: &mut Option<Vector>, way: Vector) {
    place.iter_mut().for_each(|place| *place = sum(*place, way));
}

fn sum(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// What bodies and obstacles have alike.
macro_rules! several {
    ($table:literal) => {
        const TABLE: &'static str = $table;
        fn name(&mut self) -> &mut String {
            &mut self.name
        }
        fn copies(&self) -> &[Vector] {
            &self.copies
        }
        fn array(&self) -> Option<&Array> {
            self.array.as_ref()
        }
        fn scatter(&self) -> Option<&Scatter> {
            self.scatter.as_ref()
        }
        fn orientation(&mut self) -> &mut Option<Turn> {
            &mut self.orientation
        }
        fn make_one(&mut self) {
            (self.copies, self.array, self.scatter) = (vec![], None, None);
        }
    };
}

impl Several for Body {
    several!("body");
    fn place(&self) -> (&'static str, Vector) {
        ("center", self.center)
    }
    fn form(&self) -> Form<'_> {
        self.form()
    }
    fn shift(&mut self, way: Vector) {
        self.center = sum(self.center, way);
        add(&mut self.pivot, way);
        if let Some(hinge) = &mut self.hinge {
            (0..3).for_each(|k| hinge.at[k] += way[k]);
        }
    }
}

impl Several for Obstacle {
    several!("obstacle");
    fn place(&self) -> (&'static str, Vector) {
        match (self.min, self.center) {
            (Some(min), _) => ("min", min),
            (None, Some(center)) => ("center", center),
            _ => ("position", self.position.unwrap_or_default()),
        }
    }
    fn form(&self) -> Form<'_> {
        self.form(None)
    }
    fn shift(&mut self, way: Vector) {
        let from_file = self.min.is_none() && self.center.is_none();
        if from_file {
            self.position = Some(sum(self.position.unwrap_or_default(), way));
        }
        add(&mut self.min, way);
        add(&mut self.max, way);
        add(&mut self.center, way);
    }
}

impl Case {
    /// The case with a table for each solid, as one from a file is: for those that are made in Rust.
    ///
    /// # Errors
    /// [`crate::error::Error::Case`] if there is no room for what is scattered, or what says where it stands is wrong.
    pub fn laid_out(mut self) -> Result<Self> {
        let wrong = lay_out(&mut self);
        let wrong: Vec<CaseError> = wrong.into_iter().map(CaseError::from).collect();
        if wrong.is_empty() { Ok(self) } else { Err(CaseError::all(wrong).into()) }
    }

    /// The case as it was written, with tables that stand for several: what can be held against another one key by
    /// key. As it is, where it was changed since.
    pub(crate) fn as_written(&self) -> Self {
        let Some(typed) = &self.written.typed else { return self.clone() };
        let Typed { body, obstacle } = (**typed).clone();
        let written = Self { body, obstacle, written: Written::default(), ..self.clone() };
        let table = |case: &Self| toml::Value::try_from(case).ok();
        let again = written.clone().laid_out();
        if again.is_ok_and(|again| table(&again) == table(self)) { written } else { self.clone() }
    }

    /// The first table that stands for several.
    pub(super) fn several(&self) -> Option<String> {
        fn first<T: Several>(tables: &[T]) -> Option<String> {
            let found = tables.iter().position(|one| one.by().iter().any(|by| by.1));
            found.map(|k| format!("{}.{k}", T::TABLE))
        }
        first(&self.body).or_else(|| first(&self.obstacle))
    }
}

/// Lays out the tables of `case` that stand for several; or else what is wrong with what they say of that.
pub(super) fn lay_out(case: &mut Case) -> Vec<Problem> {
    if case.several().is_none() {
        return vec![];
    }
    let mut checker = Checker { case, problems: vec![] };
    checker.copies();
    let mut problems = checker.problems;
    if !problems.is_empty() {
        return problems;
    }
    let run = &case.run;
    let nothing = || Standing::new(run.spacing, run.dimensions == 2);
    // Scattered obstacles keep clear of each other; other ones may well be the ground that they stand in.
    let obstacle = rows(&case.obstacle, &mut nothing(), &mut problems);
    let mut room = nothing();
    if case.body.iter().any(|body| body.scatter.is_some()) {
        // What is written down stands before what finds itself a place, and walls before bodies.
        case.body.iter().flat_map(placed).for_each(|one| room.add(&one.form(), one.center));
        let tank = case.tank.as_ref();
        let walls = case.moving_wall.iter().map(|wall| wall.wall(tank));
        walls.chain(obstacle.iter().map(|(_, one)| one.wall(tank))).for_each(|wall| room.add_wall(&wall));
    }
    let body = rows(&case.body, &mut room, &mut problems);
    if problems.is_empty() {
        let mut typed = Typed::default();
        (case.written.body, typed.body) = body.into_iter().unzip();
        (case.written.obstacle, typed.obstacle) = obstacle.into_iter().unzip();
        std::mem::swap(&mut case.body, &mut typed.body);
        std::mem::swap(&mut case.obstacle, &mut typed.obstacle);
        case.written.typed = Some(Box::new(typed));
    }
    problems
}

/// A table for each solid of `tables`; `room` knows what stands already, and learns what is scattered.
fn rows<T: Several>(tables: &[T], room: &mut Standing, problems: &mut Vec<Problem>) -> Vec<(Origin, T)> {
    let mut all = vec![];
    for (table, one) in tables.iter().enumerate() {
        let by = one.by().into_iter().find(|by| by.1).map(|by| by.0);
        let laid = match one.scatter() {
            None => placed(one),
            Some(scatter) => match scattered(scatter, &one.form(), one.place().1, room) {
                Err((message, remedy)) => {
                    let key = format!("{}.{table}.scatter.count", T::TABLE);
                    problems.push(Problem::new(key, format!("`{}`: {message}", one.clone().name()), remedy));
                    continue;
                }
                Ok(places) => {
                    let put = |(center, turn): (Vector, Option<Turn>)| {
                        let (mut copy, from) = (one.clone(), one.place().1);
                        copy.shift([0, 1, 2].map(|k| center[k] - from[k]));
                        if turn.is_some() {
                            *copy.orientation() = turn;
                        }
                        copy
                    };
                    places.into_iter().map(put).collect()
                }
            },
        };
        for (number, mut copy) in laid.into_iter().enumerate() {
            copy.make_one();
            if by.is_some() {
                let name = format!("{}_{}", copy.name(), number + 1);
                *copy.name() = name;
            }
            all.push((Origin { table, copy: by.map(|by| (number, by)) }, copy));
        }
    }
    all
}

/// The solids of a table that says where each stands; none of one that is scattered.
fn placed<T: Several>(one: &T) -> Vec<T> {
    let at = |way: Vector| {
        let mut copy = one.clone();
        copy.shift(way);
        copy
    };
    if one.scatter().is_some() {
        return vec![];
    }
    if let Some(Array { count: [x, y, z], step }) = one.array() {
        let numbers = (0..*z).flat_map(|k| (0..*y).flat_map(move |j| (0..*x).map(move |i| [i, j, k])));
        return numbers.map(|n| at([0, 1, 2].map(|k| f64::from(n[k]) * step[k]))).collect();
    }
    let from = one.place().1;
    let further = one.copies().iter().map(|place| at([0, 1, 2].map(|k| place[k] - from[k])));
    std::iter::once(one.clone()).chain(further).collect()
}

impl Checker<'_> {
    /// What makes a table stand for several.
    fn copies(&mut self) {
        let case = self.case;
        case.body.iter().enumerate().for_each(|(k, body)| self.copies_of(k, body));
        case.obstacle.iter().enumerate().for_each(|(k, obstacle)| self.copies_of(k, obstacle));
    }

    fn copies_of<T: Several>(&mut self, k: usize, one: &T) {
        let path = format!("{}.{k}", T::TABLE);
        self.one_of(&path, &one.by());
        let whole = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        for (n, place) in one.copies().iter().enumerate() {
            if !whole(place) {
                let message = "this is no place";
                self.add(format!("{path}.copies.{n}"), message, "write three finite numbers [m]");
            }
        }
        if let Some(Array { count, step }) = one.array() {
            let at = format!("{path}.array.count");
            let all = count.iter().try_fold(1_u32, |n, &c| n.checked_mul(c)).unwrap_or(u32::MAX);
            if all == 0 || all > MOST {
                let message = if all == 0 { "0 along an axis" } else { "too many" };
                self.add(&at, message, format!("allowed: 1 or more along each axis, {MOST} in all"));
            }
            if self.flat() && count[1] > 1 {
                let message = "in two dimensions there is one along y";
                self.add(&at, message, "set the second number to 1, or run.dimensions = 3");
            }
            for axis in 0..3 {
                let name = AXES[axis];
                if !step[axis].is_finite() || count[axis] > 1 && step[axis] == 0.0 {
                    let message = format!("{} along {name} would all stand in one place", count[axis]);
                    self.add(format!("{path}.array.step"), message, "give the way from one to the next [m]");
                }
            }
        }
        if let Some(scatter) = one.scatter() {
            self.scatter(&format!("{path}.scatter"), scatter);
            let (key, _) = one.place();
            if key != "center" || one.form().shape.has_origin() && T::TABLE == "obstacle" {
                let message = "what is scattered needs a `center`, the middle of the box for it";
                let remedy =
                    "give `size` and `center`, or make it a [[body]] with all of its freedoms locked";
                self.add(format!("{path}.scatter"), message, remedy);
            }
        }
    }
}
