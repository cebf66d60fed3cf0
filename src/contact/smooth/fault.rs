//! What the smooth law cannot be trusted with, found before it becomes a force: solids that go through each other
//! between two sub-steps, come out on the wrong side, or are driven into each other.

use super::frame::Frame;
use super::pair::{Other, Pair};
use super::walls::WallBox;
use super::{STOP_DEPTH, Smooth};
use crate::body::Body;
use crate::contact::advice::{CARRIED, SIZABLE};
use crate::contact::candidates::reduced_mass;
use crate::contact::law::{Fault, Now};
use crate::contact::substeps::{Cut, Limits, MOST_SUBSTEPS};
use crate::shape::{Faces, Surface};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Depth over half of a solid's thickness from which its other side may soon be the nearer one.
pub(super) const THROUGH: f64 = 0.8;
/// Depth over the spacing that a driven solid is not pressed beyond: its stop would have held by then.
pub(super) const DRIVEN: f64 = 1.0;
/// Way of a sub-step over half of the thickness of what is hit, at most: one sub-step at least sees it inside.
const WAY: f64 = 0.5;
/// Way of a sub-step over the depth of the stop, at most, into what has not been touched yet.
const UNSEEN: f64 = 0.5;
/// Depth of a body in one solid over that in another from which it counts as squeezed between the two.
const SQUEEZED: f64 = 0.3;
/// Depth over half of a solid's thickness that says nothing of two whose middles are in each other.
const UNTOLD: f64 = 1e-3;
/// Ways of a sub-step that are looked ahead for the stop: forces may add to the speed.
const AHEAD: f64 = 1.5;

/// Depth [m] at which a point in each solid and in each wall reaches the middle between two faces.
#[derive(Debug)]
pub(super) struct Middles {
    solids: Vec<f64>,
    walls: Vec<f64>,
}

impl Middles {
    pub fn new(bodies: &[Body], surfaces: &[Arc<Surface>], walls: &[WallBox]) -> Self {
        let thinnest = |half: DVec3, faces: Faces| {
            let open = |axis: usize| (faces >> (2 * axis) & 3).count_ones();
            let of = |axis: usize| match open(axis) {
                2 => half[axis],
                1 => 2.0 * half[axis],
                _ => f64::INFINITY,
            };
            (0..3).map(of).fold(f64::INFINITY, f64::min)
        };
        // of a ball there is one face, all round
        let of = |(b, s): (&Body, &Arc<Surface>)| {
            s.ball.unwrap_or_else(|| thinnest(b.shape.extent(DMat3::IDENTITY), s.all_faces))
        };
        Self {
            solids: bodies.iter().zip(surfaces).map(of).collect(),
            walls: walls.iter().map(|w| thinnest(w.half, w.faces)).collect(),
        }
    }

    /// Those of the pair's first and second solid.
    pub fn of(&self, pair: &Pair) -> [f64; 2] {
        let b = match pair.b {
            Other::Solid(b) => self.solids[b],
            Other::Wall(w) => self.walls[w],
        };
        [self.solids[pair.a], b]
    }

    /// The least of all.
    pub fn least(&self) -> f64 {
        self.solids.iter().chain(&self.walls).copied().fold(f64::INFINITY, f64::min)
    }

    /// The least of solid `a` and of solid `b`, or of any wall.
    pub fn between(&self, a: usize, b: Option<usize>) -> f64 {
        let other = match b {
            Some(b) => self.solids[b],
            None => self.walls.iter().copied().fold(f64::INFINITY, f64::min),
        };
        self.solids[a].min(other)
    }
}

impl Smooth {
    /// Largest speed of any point of the pair's solids against one of the other [m/s].
    fn closing(pair: &Pair, now: &Now) -> f64 {
        let of = |k: usize| now.bodies[k].pose.angular_velocity.length() * now.bodies[k].radius();
        let b = pair.b.solid();
        let between =
            now.bodies[pair.a].pose.velocity - b.map_or(DVec3::ZERO, |b| now.bodies[b].pose.velocity);
        between.length() + of(pair.a) + b.map_or(0.0, of)
    }

    /// The first pair of the last evaluation that has left what the law can be trusted with.
    pub(super) fn first_fault(&self, now: &Now) -> Option<Fault> {
        // few pairs are ever deep, or much deeper than before
        let little = 1e-3 * self.spacing;
        let deep = |p: &&Pair| p.depth > p.before + little || p.depth > self.harmless;
        // what goes on from one solid to the next is as deep in that at once as it was in the first; looked for among all pairs
        // only where a pair's own depth does not do
        let before_beside = |pair: &Pair| {
            let holds = |p: &Pair, k: usize| p.a == k || p.b.solid() == Some(k);
            let beside = |p: &&Pair| holds(p, pair.a) || pair.b.solid().is_some_and(|b| holds(p, b));
            let others = self.evaluated().iter().filter(beside).map(|p| p.before).filter(|d| d.is_finite());
            others.fold(pair.before, f64::max)
        };
        let too_deep = self.evaluated().iter().filter(deep).find_map(|pair| {
            let [middle_a, middle_b] = self.middles.of(pair);
            let (in_a, in_b) = pair.deepest();
            let closing = Self::closing(pair, now);
            let driven = pair.b.solid().is_some_and(|b| now.bodies[b].is_driven());
            let fault = |what: String| Fault { a: pair.a, b: self.against(pair.b), what };
            let grown = 2.0 * closing * now.substep + little;
            if pair.depth > pair.before + grown {
                let before = before_beside(pair);
                if pair.depth > before + grown {
                    return Some(fault(format!(
                        "is suddenly {:.3e} m deep, after {:.3e} m: it came in where contact does not look; use a \
                         smaller run.time_step or a thicker wall",
                        pair.depth, before
                    )));
                }
            }
            let unknown = self.on_device && pair.depth > THROUGH * middle_a.max(middle_b);
            if in_a > THROUGH * middle_a || in_b > THROUGH * middle_b || unknown {
                let remedy = if self.is_squeezed(pair, now) {
                    "it is squeezed by what follows a motion, which no spring stops: change that motion or make room".into()
                } else {
                    format!("use {} or a thicker solid", self.stiff_enough(pair, now))
                };
                return Some(fault(format!(
                    "is {:.3e} m deep, almost halfway through, at {closing:.3} m/s: contact would push it out on the \
                     other side; {remedy}",
                    pair.depth,
                )));
            }
            (driven && pair.depth > DRIVEN * self.spacing).then(|| {
                fault(format!(
                    "is driven {:.3e} m deep into it: the solid that follows a table cannot move on; change its \
                     motion or make room",
                    pair.depth
                ))
            })
        });
        too_deep.or_else(|| self.first_unseen(now))
    }

    /// The first pair of which one solid has its middle in the other, [m] below its surface, while no point of either tells of it: no
    /// force would ever part them.
    fn first_unseen(&self, now: &Now) -> Option<Fault> {
        let depth = |from: &Frame, to: &Frame| {
            let inside = to.shape.depth(to.local(from.center), to.faces)?;
            // of a ring there is nothing in the middle
            from.shape.depth(DVec3::ZERO, from.faces).map(|_| inside.depth)
        };
        self.evaluated().iter().find_map(|pair| {
            let [middle_a, middle_b] = self.middles.of(pair);
            if pair.depth > UNTOLD * middle_a.min(middle_b) {
                return None;
            }
            let own = Frame::body(&now.bodies[pair.a], self.surfaces[pair.a].all_faces);
            let other = pair.other(now.bodies, &self.surfaces, &self.walls);
            // most are but neighbours
            if own.center.distance(other.center) > own.shape.radius().max(other.shape.radius()) {
                return None;
            }
            let depth = depth(&own, &other).or_else(|| depth(&other, &own))?;
            let what = format!(
                "is in it with its middle, {depth:.3e} m deep, where no point of their surfaces tells: contact would leave \
                 them so; use {}",
                self.weight_needs(pair, now).unwrap_or_else(|| {
                    "a smaller run.spacing, for more points, or a smaller run.time_step".into()
                })
            );
            Some(Fault { a: pair.a, b: self.against(pair.b), what })
        })
    }

    /// Whether the pair's body is squeezed: between two solids that give way to nothing, one of which moves. No spring stops that.
    fn is_squeezed(&self, pair: &Pair, now: &Now) -> bool {
        let driven = |p: &Pair| p.b.solid().filter(|&b| now.bodies[b].is_driven());
        let holds = |p: &Pair| p.b.solid().is_none() || driven(p).is_some();
        let moves = |p: &Pair| driven(p).is_some_and(|b| now.bodies[b].speed() > 0.0);
        let beside = self.evaluated().iter().filter(|p| p.a == pair.a && p.b != pair.b);
        let mut deep = beside.filter(|p| p.depth > SQUEEZED * pair.depth);
        holds(pair) && deep.any(|p| holds(p) && (moves(pair) || moves(p)))
    }

    /// Masses [kg] of what touches either of the pair's solids, and a third.
    fn leaning<'a>(&'a self, pair: &'a Pair, now: &'a Now) -> impl Iterator<Item = f64> + 'a {
        let mine = |k: usize| k == pair.a || pair.b.solid() == Some(k);
        let touching = self.evaluated().iter().filter(|p| p.contact_count() > 0);
        let leaning = touching.filter_map(move |p| match p.b {
            Other::Solid(b) if mine(p.a) != mine(b) => Some(if mine(b) { p.a } else { b }),
            _ => None,
        });
        leaning.map(|k| now.bodies[k].mass).filter(|m| m.is_finite())
    }

    /// What carries the heaviest of the pair's solids and of those that touch them, if its weight alone presses it in by a
    /// sizable part of the spacing or of the thinner solid.
    fn weight_needs(&self, pair: &Pair, now: &Now) -> Option<String> {
        let own = [Some(pair.a), pair.b.solid()].into_iter().flatten().map(|k| now.bodies[k].mass);
        let heaviest = own.filter(|m| m.is_finite()).chain(self.leaning(pair, now)).fold(0.0, f64::max);
        let weight = heaviest * now.limits.gravity;
        let [middle_a, middle_b] = self.middles.of(pair);
        let reach = self.spacing.min(middle_a).min(middle_b);
        let carried = |limits: &Limits| self.constants_of(pair, limits, now.bodies).spring;
        let sinks = weight / carried(now.limits);
        if sinks <= SIZABLE * reach {
            return None;
        }
        let spring = weight / (CARRIED * reach);
        let softened = carried(&Limits { spring, ..now.limits.clone() });
        let step = now.limits.longest_step * (softened / spring).sqrt();
        let step = if softened < 0.99 * spring {
            format!(" with run.time_step = {step:.1e} or less")
        } else {
            String::new()
        };
        Some(format!(
            "contact.spring = {spring:.1e} or more{step}: a weight of {weight:.1e} N presses {sinks:.1e} m deep"
        ))
    }

    /// What stops the pair's solids a little before the middle of the thinner one.
    fn stiff_enough(&self, pair: &Pair, now: &Now) -> String {
        let [middle_a, middle_b] = self.middles.of(pair);
        let wanted = 0.5 * middle_a.min(middle_b);
        // what leans on either of both presses as well
        let leaning: f64 = self.leaning(pair, now).sum();
        let mass = reduced_mass(now.bodies, pair.a, pair.b.solid()) + leaning;
        let energy = pair.energy + 0.5 * mass * pair.approach().powi(2);
        // the energy goes as the square of the depth, or faster
        let stiffer = energy / (pair.energy * (wanted / pair.depth).powi(2));
        let any_step = Limits { longest_step: 1e-3 * now.limits.longest_step, ..now.limits.clone() };
        let full = self.constants_of(pair, &any_step, now.bodies);
        let step = now.limits.longest_step / stiffer.sqrt();
        if full.spring >= 0.99 * stiffer * pair.constants.spring
            || full.stop >= 0.99 * stiffer * pair.constants.stop
        {
            return format!("run.time_step = {step:.1e} or less, which carries a stiffer contact,");
        }
        let spring = stiffer * pair.constants.spring;
        format!("contact.spring = {spring:.1e} or more with run.time_step = {step:.1e} or less")
    }

    /// Whether a contact may reach its stop before the next evaluation.
    pub(super) fn is_near_stop(&self, now: &Now) -> bool {
        self.evaluated().iter().filter(|p| p.depth > 0.0).any(|pair| {
            let most = pair.constants.stop_depth;
            // most are nowhere near it, and the speed takes longer to find
            pair.depth >= most || pair.depth + AHEAD * Self::closing(pair, now) * now.substep >= most
        })
    }

    /// How a step of `dt` [s] is cut, of `cut` as planned, so that no solid can go through another between two sub-steps, or
    /// reach its stop unseen.
    ///
    /// Most scenes are slow enough to be passed over at once: only pairs that may meet within the step count.
    pub(super) fn cut_of_way(&self, now: &Now, dt: f64, mut cut: Cut) -> Result<Cut, Fault> {
        let fastest = now.bodies.iter().map(Body::speed).fold(0.0, f64::max);
        // two solids close at twice the speed of the faster one at most; a lattice body is two spacings thick
        let unseen = |reach: f64| UNSEEN * STOP_DEPTH * reach * f64::from(cut.substeps);
        let thinnest = self.spacing.min(self.middles.least());
        let stops = cut.parts == 1 || 2.0 * fastest * dt <= unseen(thinnest);
        if 2.0 * fastest * dt <= WAY * 0.5 * self.spacing && stops {
            return Ok(cut);
        }
        let mut most = 1.0_f64;
        let mut all = false;
        for (pair, _) in self.close(now.candidates, now.bodies) {
            let [middle_a, middle_b] = self.middles.of(&pair);
            let way = Self::closing(&pair, now) * dt;
            let wanted = way / (WAY * middle_a.min(middle_b));
            let stops = cut.parts > 1 && way > unseen(self.spacing.min(middle_a).min(middle_b));
            if wanted <= most && (all || !stops) || !self.meets(&pair, now, dt) {
                continue;
            }
            all |= stops;
            if wanted > f64::from(MOST_SUBSTEPS) {
                let what = format!(
                    "may go through it within a step: {:.3e} m of way in {MOST_SUBSTEPS} sub-steps, {:.3e} m from a \
                     face to the middle; use run.time_step = {:.1e} or less",
                    way,
                    middle_a.min(middle_b),
                    dt * f64::from(MOST_SUBSTEPS) / wanted
                );
                return Err(Fault { a: pair.a, b: self.against(pair.b), what });
            }
            most = most.max(wanted);
        }
        cut.all = all;
        Ok(cut.at_least(most.ceil() as u32))
    }

    /// Whether the first solid, on its way of the step, may come to touch the second.
    fn meets(&self, pair: &Pair, now: &Now, dt: f64) -> bool {
        let a = &now.bodies[pair.a];
        let other = pair.other(now.bodies, &self.surfaces, &self.walls);
        let b = pair.b.solid().map(|b| &now.bodies[b]);
        let way = dt * (a.pose.velocity - b.map_or(DVec3::ZERO, |b| b.pose.velocity));
        let turned = dt * b.map_or(0.0, |b| b.pose.angular_velocity.length()) * b.map_or(0.0, |b| b.radius());
        let along = other.axes.transpose() * way.normalize_or(DVec3::X);
        other.shape.line_is_near(other.local(a.shape_center()), along, way.length(), a.radius() + turned)
    }
}

#[cfg(test)]
mod tests {
    use crate::body::Wrench;
    use crate::case::Case;
    use crate::contact::Solids;
    use crate::scene::Scene;

    #[test]
    fn a_body_that_is_suddenly_deep_is_one_in_the_first_sub_step_too() {
        let text = "[run]\nspacing = 0.02\ntime_step = 1e-4\nend = 1\ngravity = [0, 0, -9.81]\n\
                    [contact]\nspring = 1e3\nsubsteps = 1\n\
                    [[obstacle]]\nname = \"floor\"\nmin = [0, 0, -0.1]\nmax = [0.4, 0.4, 0]\n\
                    [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.2, 0.2, 0.05]\n\
                    density = 1000\nstanding = true\n";
        let case: Case = toml::from_str(text).expect("a case");
        let scene = Scene::build(&case).expect("a scene");
        for watched in [false, true] {
            let mut solids = Solids::new(&scene, case.contact.as_ref()).expect("a cube");
            let mut step = |jump: f64| {
                solids.bodies[0].pose.position.z += jump;
                if watched {
                    solids.energy();
                }
                solids.advance(0.0, 1e-4, &[Wrench::default()])
            };
            assert!(step(0.0).is_ok() && step(0.0).is_ok());
            let told = step(-0.002).expect_err("it is 2 mm deep").to_string();
            assert!(told.contains("suddenly"), "{told}");
        }
    }
}
