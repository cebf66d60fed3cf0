//! Friction and restitution of two solids: those of the scene, or what `[[contact.pair]]` says of them.

use super::stiffness::{Damping, damping_ratio};
use crate::case::{Contact, stands_for};
use crate::error::{Error, Result};
use crate::scene::Scene;

/// What a free solid touches.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Against {
    /// A solid of [`Scene::solids`].
    Solid(usize),
    /// A fixed wall of [`Scene::walls`].
    Wall(usize),
}

/// Friction and damping of a contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between {
    /// Coulomb coefficient [-].
    pub friction: f64,
    pub damping: Damping,
}

/// The solids and fixed walls that one end of a row of `[[contact.pair]]` names.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    solids: Vec<bool>,
    walls: Vec<bool>,
}

impl Named {
    fn has(&self, one: Against) -> bool {
        match one {
            Against::Solid(k) => self.solids[k],
            Against::Wall(k) => self.walls[k],
        }
    }
}

/// A row of `[[contact.pair]]`.
#[derive(Clone, Debug)]
struct Row {
    ends: [Named; 2],
    friction: Option<f64>,
    damping: Option<Damping>,
}

/// What any two solids have between them.
#[derive(Clone, Debug)]
pub(crate) struct Betweens {
    /// What no row says anything else of.
    pub usual: Between,
    rows: Vec<Row>,
}

impl Betweens {
    /// What `contact` says of the solids of `scene`, of which the lightest free one has `lightest` [kg].
    ///
    /// # Errors
    /// [`Error::Case`] if the numbers contradict each other, or if a row names nothing that can touch.
    pub fn new(contact: Option<&Contact>, scene: &Scene, lightest: f64) -> Result<Self> {
        let Some(contact) = contact else {
            let usual = Between { friction: 0.0, damping: Damping::Coefficient(0.0) };
            return Ok(Self { usual, rows: vec![] });
        };
        let usual = Between { friction: contact.friction, damping: Damping::new(contact, lightest)? };
        let mut rows = Vec::with_capacity(contact.pair.len());
        for (k, pair) in contact.pair.iter().enumerate() {
            let key = format!("contact.pair.{k}.between");
            let [first, second] = &pair.between;
            let ends = [named(scene, first, &key)?, named(scene, second, &key)?];
            if !can_touch(scene, &ends) {
                let why = if first == second {
                    "they are one solid"
                } else {
                    "no body that forces move is one of them"
                };
                let message = format!("{key}: `{first}` and `{second}` cannot touch: {why}");
                return Err(Error::key(
                    key,
                    message,
                    "name a body that is free to move, and what it touches",
                ));
            }
            let damping = pair.restitution.map(|e| Damping::Ratio(damping_ratio(e)));
            rows.push(Row { ends, friction: pair.friction, damping });
        }
        Ok(Self { usual, rows })
    }

    /// What the free solid `a` has against `b`: of rows that name both the last one counts, for each of its numbers.
    pub fn of(&self, a: usize, b: Against) -> Between {
        let (a, mut out) = (Against::Solid(a), self.usual);
        for Row { ends: [first, second], friction, damping } in &self.rows {
            if first.has(a) && second.has(b) || first.has(b) && second.has(a) {
                out.friction = friction.unwrap_or(out.friction);
                out.damping = damping.unwrap_or(out.damping);
            }
        }
        out
    }

    /// Every damping that a contact may have.
    pub fn dampings(&self) -> impl Iterator<Item = Damping> {
        let others = self.rows.iter().filter_map(|row| row.damping);
        std::iter::once(self.usual.damping).chain(others)
    }
}

/// What `name` stands for: a solid, a fixed wall, `tank` for all its faces, or with `*` for any letters as many as there are.
fn named(scene: &Scene, name: &str, key: &str) -> Result<Named> {
    let out = Named {
        solids: scene.solids.iter().map(|s| stands_for(name, &s.name)).collect(),
        walls: scene.walls.iter().map(|w| stands_for(name, &w.name)).collect(),
    };
    if out.solids.iter().chain(&out.walls).any(|&one| one) {
        return Ok(out);
    }
    let mut names: Vec<&str> = scene.names().collect();
    let more = names.len().saturating_sub(MOST_NAMES);
    names.truncate(MOST_NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let remedy = format!("there are: {}{more}", names.join(", "));
    Err(Error::key(key, format!("{key}: nothing is called `{name}`"), remedy))
}

/// Most names that a message lists.
const MOST_NAMES: usize = 20;

/// Whether forces move something of one end that can touch something of the other.
fn can_touch(scene: &Scene, ends: &[Named; 2]) -> bool {
    let free = |k: usize| scene.solids[k].gives_way();
    let moves = |end: &Named| end.solids.iter().enumerate().any(|(k, &is)| is && free(k));
    let all = |end: &Named| end.solids.iter().chain(&end.walls).filter(|is| **is).count();
    // a body does not touch itself
    let [first, second] = ends;
    let alone = all(first) == 1 && first == second;
    !alone && ends.iter().any(moves)
}
