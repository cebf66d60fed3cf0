//! Where bodies start: lifting a standing body off what it touches, and refusing overlaps.
//!
//! What counts as contact depends on the law. With "paper" two wall-layer particles touch when they are
//! closer than d_c = sqrt(1.5) l0 (section 3 of the paper); otherwise two solids touch when their true
//! surfaces meet.

use super::near::Near;
use super::oriented::Placed;
use super::walls::Fixed;
use super::{Solid, WallShape};
use crate::case::Law;
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// Contact distance over the spacing, d_c / l0, section 3 of the paper.
pub(crate) const CONTACT_DISTANCE: f64 = 1.224_744_871_391_589;

/// Overlap that is no more than a touch, over the spacing [-].
const TOUCHING: f64 = 1e-4;

/// What a body may hang above the next solid and stand on it all the same, over the spacing [-].
const HANGING: f64 = 1e-3;
/// The same where one of two is a prism or a mesh: they meet by points there, off the place where round ones touch.
const HANGING_BY_POINTS: f64 = 0.1;

/// Most steps on the way down to what a body hangs above.
const MOST_STEPS: f64 = 2000.0;

/// What a remedy asks for more than what just does, over the spacing [-].
const MARGIN: f64 = 1e-6;

/// Shortest ways out of what it overlaps that are taken one after the other, at most.
const WAYS_OUT: usize = 8;

/// What a body may meet at t = 0: fixed walls, and the solids placed before it.
pub(super) struct Surroundings<'a> {
    pub fixed: &'a Fixed,
    /// Moving walls, then bodies; numbered so in `near`.
    pub earlier: [&'a [Solid]; 2],
    pub near: &'a Near,
    pub law: Law,
    pub spacing: f64,
    /// Whether everything lies in the plane y = 0.
    pub plane: bool,
    /// Corners of the tank [m].
    pub tank: Option<(DVec3, DVec3)>,
    /// Against gravity; `None` without gravity.
    pub up: Option<DVec3>,
}

/// A contact of a body at t = 0.
struct Contact {
    with: String,
    overlap: f64,
    /// The shortest way out, if it is a straight one.
    out: Option<DVec3>,
}

impl Surroundings<'_> {
    /// Lifts a standing body; returns a note on how far.
    ///
    /// # Errors
    /// What is wrong, with the body, what it overlaps and by how much; and what to do.
    pub fn place(&self, body: &mut Solid, standing: bool) -> Result<Option<String>, (String, String)> {
        let overlaps = self.overlaps(body);
        if overlaps.is_empty() {
            return Ok(None);
        }
        // A lift over the rim of a wall is not what anyone means by standing.
        let over = self.up.map(|up| (self.lift(body, up), up));
        let lift = over.filter(|(lift, up)| *lift <= body.placed().reach(*up).max(2.0 * self.spacing));
        let mut all: Vec<String> =
            overlaps.iter().take(3).map(|c| format!("{} by {} m", c.with, metres(c.overlap))).collect();
        if overlaps.len() > all.len() {
            all.push(format!("{} more", overlaps.len() - all.len()));
        }
        let says = format!("body `{}` overlaps {} at t = 0", body.name, all.join(" and "));
        let margin = MARGIN * self.spacing;
        let Some((lift, up)) = lift else {
            let first = &overlaps[0];
            let straight = first.out.map(|n| (first.overlap + margin) * n);
            // Out of the tank is no way to anywhere.
            let center = body.shape_center();
            let inside = |by: &DVec3| {
                self.tank.is_none_or(|(low, high)| {
                    let at = center + *by;
                    (0..3).all(|k| self.plane && k == 1 || at[k] >= low[k] && at[k] <= high[k])
                })
            };
            let frees = |by: &DVec3| {
                let mut moved = body.clone();
                moved.position += *by;
                inside(by) && self.deepest(&moved).is_none()
            };
            let ways = [self.away(body), straight, over.map(|(lift, up)| (lift + margin) * up)];
            let way = ways.into_iter().flatten().find(frees);
            let away = match way {
                None => "there is no room for it beside that: make it smaller, or move it away".into(),
                Some(by) if straight.is_some_and(|way| way.distance(by) < margin) => {
                    let far = at_least(first.overlap + margin);
                    format!("move it away, its center by {far} m along {}", point(by.normalize()))
                }
                Some(by) => {
                    let [x, y, z] = by.to_array().map(|x| match x.abs() {
                        small if small < margin => "0".into(),
                        far => format!("{}{}", if x < 0.0 { "-" } else { "" }, at_least(far)),
                    });
                    format!("move it away, its center by ({x}, {y}, {z}) m")
                }
            };
            let lifts = way.zip(self.up).is_some_and(|(way, up)| way.dot(up) > 0.9 * way.length());
            let why = if self.up.is_some() && !lifts {
                ", lifting it would take more than half its height"
            } else {
                ""
            };
            return Err((says, away + why));
        };
        if !standing {
            let more = at_least(lift + margin);
            let remedy = format!("set `standing = true`, or raise its center by {more} m against gravity");
            return Err((says, remedy));
        }
        let lifted = metres(lift);
        let from = body.shape_center();
        body.position += lift * up;
        if let Some(Contact { with, .. }) = self.deepest(body) {
            return Err((says, format!("move it away, lifted by {lifted} m it would still overlap {with}")));
        }
        Ok(Some(format!(
            "body `{}`: lifted by {lifted} m to stand free of contact, center {} becomes {}",
            body.name,
            point(from),
            point(body.shape_center())
        )))
    }

    /// Where a body is free of contact, from where it is [m], by the shortest ways out one after the other; `None` where they lead nowhere.
    fn away(&self, body: &Solid) -> Option<DVec3> {
        let mut moved = body.clone();
        for _ in 0..WAYS_OUT {
            let Some(contact) = self.deepest(&moved) else { return Some(moved.position - body.position) };
            moved.position += (contact.overlap + MARGIN * self.spacing) * contact.out?;
        }
        None
    }

    /// Says so where a standing body has nothing under it, once all that was asked for is placed.
    pub fn hangs(&self, body: &Solid) -> Option<String> {
        let up = self.up.filter(|_| body.gives_way())?;
        let mut lower = body.clone();
        let mut met = |way: f64| {
            lower.position = body.position - way * up;
            self.deepest(&lower).map(|contact| contact.with)
        };
        let reach = HANGING_BY_POINTS * self.spacing;
        let near = self.obstructions(body, -up, reach);
        let by_points = !body.shape.is_convex() || near.iter().any(|b| !b.placed.shape.is_convex());
        let least = if by_points { reach } else { HANGING * self.spacing };
        if met(least).is_some() {
            return None;
        }
        // Far enough to be below everything.
        let all = self.obstructions(body, -up, f64::MAX.sqrt());
        let lowest =
            all.iter().map(|b| b.placed.center.dot(up) - b.placed.reach(-up)).fold(f64::INFINITY, f64::min);
        let own = body.placed();
        let most = own.center.dot(up) + own.reach(up) - lowest;
        let step = (0.25 * self.spacing).max(most / MOST_STEPS);
        let mut ways = (1..).map(|k| least + f64::from(k) * step).take_while(|way| *way < most);
        let says =
            format!("body `{}`: stands on nothing, `standing` lifts it and never lowers it", body.name);
        let Some((mut way, mut with)) = ways.find_map(|way| Some((way, met(way)?))) else {
            return Some(format!("{says}: there is no solid below it; leave `standing` out"));
        };
        let mut free = way - step;
        for _ in 0..20 {
            let middle = 0.5 * (free + way);
            match met(middle) {
                Some(other) => (way, with) = (middle, other),
                None => free = middle,
            }
        }
        Some(format!(
            "{says}: it would meet {with} {} m further down; lower its `center` by that, or leave `standing` out",
            metres(free)
        ))
    }

    /// The earlier solid of that number.
    fn solid(&self, k: usize) -> &Solid {
        let [walls, bodies] = self.earlier;
        if k < walls.len() { &walls[k] } else { &bodies[k - walls.len()] }
    }

    /// Earlier solids that may be in the way of `body` on its way by `most` [m] along `up`, and a `margin` [m] beside
    /// it, by their numbers; never itself. Prescribed bodies may reach into what does not move under forces: a table of motion is
    /// the user's word.
    fn near(&self, body: &Solid, up: DVec3, most: f64, margin: f64) -> impl Iterator<Item = (usize, &Solid)> {
        let (low, high) = way(body, up, most, margin);
        let free = body.is_free();
        let found = self.near.meeting(low, high).into_iter().map(|k| (k, self.solid(k)));
        found.filter(move |(_, solid)| (free || solid.is_free()) && solid.name != body.name)
    }

    /// The fixed walls, and the earlier solids near the way of `body` by `most` [m] along `up`.
    fn obstructions(&self, body: &Solid, up: DVec3, most: f64) -> Vec<Obstruction<'_>> {
        let mut all = Vec::new();
        if body.is_free() {
            let wall = |w: &WallShape| Obstruction {
                name: format!("wall `{}`", w.name),
                placed: w.into(),
                solid: None,
            };
            all.extend(self.fixed.shapes.iter().map(wall));
        }
        let solids = self.near(body, up, most, 0.0).map(|(_, s)| s);
        all.extend(solids.map(|s| Obstruction { name: solid_name(s), placed: s.placed(), solid: Some(s) }));
        all
    }

    fn deepest(&self, body: &Solid) -> Option<Contact> {
        self.overlaps(body).into_iter().next()
    }

    /// What a body overlaps, the deepest first; of pairs of particles the deepest alone.
    fn overlaps(&self, body: &Solid) -> Vec<Contact> {
        let own = body.placed();
        // Lattices need not be in register, so that "paper" lets true surfaces overlap a little. Otherwise what touches is written with as many
        // digits as anyone writes: K gives no body more than sqrt(K / m) times this.
        let tolerance = if self.law == Law::Paper { 0.5 } else { TOUCHING } * self.spacing;
        let overlap = |b: Obstruction<'_>| {
            let (overlap, out) = b.way_out(&own, body, tolerance, self.plane);
            (overlap > tolerance).then_some(Contact { with: b.name, overlap, out: Some(out) })
        };
        let mut all: Vec<Contact> =
            self.obstructions(body, DVec3::ZERO, 0.0).into_iter().filter_map(overlap).collect();
        all.sort_unstable_by(|a, b| b.overlap.total_cmp(&a.overlap));
        if !all.is_empty() || self.law != Law::Paper {
            return all;
        }
        let d_c = CONTACT_DISTANCE * self.spacing;
        let up = self.up.unwrap_or(DVec3::Z);
        self.pairs(body, up, 0.0)
            .into_iter()
            .map(|p| (d_c - p.from.length(), p.with))
            .filter(|(overlap, _)| *overlap > 1e-9 * d_c)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(overlap, with)| Contact {
                with: format!("{} (particles closer than d_c = {} m)", self.pair_name(with), metres(d_c)),
                overlap,
                out: None,
            })
            .into_iter()
            .collect()
    }

    /// Least distance >= 0 along `up` that ends all contact [m].
    fn lift(&self, body: &Solid, up: DVec3) -> f64 {
        if self.law == Law::Paper { self.lift_pairs(body, up) } else { self.lift_surfaces(body, up) }
    }

    fn lift_surfaces(&self, body: &Solid, up: DVec3) -> f64 {
        let start = body.placed();
        let most = 2.0 * start.reach(up).max(2.0 * self.spacing);
        let all = self.obstructions(body, up, most);
        let mut total = 0.0;
        // Each round clears at least one shape for good, if they are convex: `up` never leads back into one.
        for _ in 0..MOST_LIFTS.max(all.len() + 1) {
            let own = Placed { center: start.center + total * up, ..start };
            let lifts = all.iter().map(|b| b.lift(&own, body, up, self));
            let lift = lifts.fold(0.0, f64::max);
            if lift == 0.0 || total > most {
                break;
            }
            total += lift;
        }
        total
    }

    /// Each pair forbids an interval of lifts; the answer is the end of the chain of intervals that holds 0.
    fn lift_pairs(&self, body: &Solid, up: DVec3) -> f64 {
        let d_c = CONTACT_DISTANCE * self.spacing;
        let most = body.placed().reach(up) * 2.0 + 2.0 * self.spacing;
        let mut forbidden: Vec<(f64, f64)> = self
            .pairs(body, up, most)
            .into_iter()
            .filter_map(|pair| {
                let along = pair.from.dot(up);
                let half2 = d_c * d_c - (pair.from.length_squared() - along * along);
                (half2 > 0.0).then(|| (-along - half2.sqrt(), -along + half2.sqrt()))
            })
            .collect();
        forbidden.sort_by(|a, b| a.0.total_cmp(&b.0));
        let tolerance = 1e-9 * d_c;
        let mut lift = 0.0;
        for (from, to) in forbidden {
            if from >= lift - tolerance {
                break;
            }
            if to > lift + tolerance {
                lift = to;
            }
        }
        lift
    }

    /// Pairs of wall-layer particles that come closer than d_c while the body rises by `most`.
    fn pairs(&self, body: &Solid, up: DVec3, most: f64) -> Vec<Pair> {
        let d_c = CONTACT_DISTANCE * self.spacing;
        let own = body.placed();
        let (lo, hi) = way(body, up, most, d_c);
        let near = |p: &DVec3| p.cmpge(lo).all() && p.cmple(hi).all();
        let mut others: Vec<(DVec3, Partner)> = Vec::new();
        if body.is_free() {
            let walls = self.fixed.wall.iter().zip(&self.fixed.shape_of);
            others.extend(walls.filter(|(p, _)| near(p)).map(|(&p, &of)| (p, Partner::Wall(of))));
        }
        for (k, solid) in self.near(body, up, most, d_c) {
            others.extend(solid.wall_positions().filter(|p| near(p)).map(|p| (p, Partner::Solid(k))));
        }
        // Columns along `up`, d_c wide: only neighbouring ones can hold pairs.
        let across = DMat3::from_cols(up.any_orthonormal_vector(), up.cross(up.any_orthonormal_vector()), up);
        let column = |p: DVec3| {
            let q = (across.transpose() * (p - own.center)) / d_c;
            (q.x.floor() as i32, q.y.floor() as i32)
        };
        let mut columns: HashMap<(i32, i32), Vec<usize>> = HashMap::new();
        for (index, (p, _)) in others.iter().enumerate() {
            columns.entry(column(*p)).or_default().push(index);
        }
        let mut pairs = Vec::new();
        for p in body.wall_positions() {
            let (a, b) = column(p);
            for key in (a - 1..=a + 1).flat_map(|a| (b - 1..=b + 1).map(move |b| (a, b))) {
                for &index in columns.get(&key).into_iter().flatten() {
                    let (q, with) = others[index];
                    pairs.push(Pair { from: p - q, with });
                }
            }
        }
        pairs
    }

    fn pair_name(&self, with: Partner) -> String {
        match with {
            Partner::Wall(of) => {
                self.fixed.shapes.get(of as usize).map_or("a wall".into(), |w| format!("wall `{}`", w.name))
            }
            Partner::Solid(k) => solid_name(self.solid(k)),
        }
    }
}

/// The box around the way of `body` by `most` [m] along `up`, and a `margin` [m] beside it.
fn way(body: &Solid, up: DVec3, most: f64, margin: f64) -> (DVec3, DVec3) {
    let own = body.placed();
    let (from, to) = (own.center, own.center + most * up);
    let reach = own.bounds() + margin;
    (from.min(to) - reach, from.max(to) + reach)
}

/// Most rounds of a lift out of shapes that are not convex.
const MOST_LIFTS: usize = 500;

/// What a body may be in the way of at t = 0.
struct Obstruction<'a> {
    name: String,
    placed: Placed,
    /// `None` for a wall of the lattice or a plane.
    solid: Option<&'a Solid>,
}

impl Obstruction<'_> {
    /// How deep `body`, placed as `own`, reaches into it [m], and the way out; what is convex is told apart by planes.
    fn way_out(&self, own: &Placed, body: &Solid, tolerance: f64, plane: bool) -> (f64, DVec3) {
        // most of a heap
        let (gap, axis) = own.apart(&self.placed);
        if gap > 0.0 {
            return (-gap, axis);
        }
        let (overlap, out) = own.way_out(&self.placed, plane);
        if overlap <= tolerance || own.is_convex() && self.placed.is_convex() {
            return (overlap, out);
        }
        let mut deepest = (f64::NEG_INFINITY, out);
        let mut press = |points: &mut dyn Iterator<Item = DVec3>, into: &Placed, side: f64| {
            for point in points {
                let (distance, outward) = into.shape.distance(into.axes.transpose() * (point - into.center));
                if -distance > deepest.0 {
                    deepest = (-distance, side * (into.axes * outward));
                }
            }
        };
        press(&mut surface_points(own, Some(body)), &self.placed, 1.0);
        press(&mut surface_points(&self.placed, self.solid), own, -1.0);
        deepest
    }

    /// Way along `up` that `body`, placed as `own`, has to go to leave it, or a part of that way [m].
    fn lift(&self, own: &Placed, body: &Solid, up: DVec3, around: &Surroundings) -> f64 {
        let spacing = around.spacing;
        let (overlap, _) = self.way_out(own, body, 1e-9 * spacing, around.plane);
        if overlap <= 1e-9 * spacing {
            return 0.0;
        }
        if own.is_convex() && self.placed.is_convex() {
            return own.lift(&self.placed, up);
        }
        overlap.max(1e-4 * spacing)
    }
}

/// Points of the surface of a shape, in the world: those above its wall layer and its corners.
fn surface_points<'a>(at: &'a Placed, solid: Option<&'a Solid>) -> Box<dyn Iterator<Item = DVec3> + 'a> {
    let of = |s: &'a Solid| {
        s.wall_offset.iter().zip(&s.wall_to_surface).map(|(x, way)| *x - s.shape_offset + *way)
    };
    let layer = solid.into_iter().flat_map(of);
    Box::new(at.shape.corners().into_iter().chain(layer).map(|q| at.center + at.axes * q))
}

/// A pair of wall-layer particles: from the other one to the body's.
struct Pair {
    from: DVec3,
    with: Partner,
}

#[derive(Clone, Copy)]
enum Partner {
    Wall(u32),
    Solid(usize),
}

fn solid_name(solid: &Solid) -> String {
    format!("{} `{}`", solid.what(), solid.name)
}

/// A length for a message.
fn metres(length: f64) -> String {
    if length < 1e-3 { format!("{length:.2e}") } else { format!("{length:.6}") }
}

/// The same, but rounded up: whoever goes that far has gone far enough.
fn at_least(length: f64) -> String {
    let unit = if length < 1e-3 { 10_f64.powi(length.log10().floor() as i32 - 2) } else { 1e-6 };
    // What is a whole number of units but for rounding is none more.
    metres((length / unit - 1e-6).ceil() * unit)
}

/// A point for messages: four decimals, and as many more as its largest coordinate needs.
pub(crate) fn point(p: DVec3) -> String {
    let largest = p.abs().max_element();
    let zeros = if largest > 0.0 { (-largest.log10()).floor().clamp(0.0, 300.0) as usize } else { 0 };
    let digits = 4 + zeros;
    // What is told as zero has no sign.
    let tidy = |x: f64| if x.abs() < 0.5 * 0.1_f64.powi(digits as i32) { 0.0 } else { x };
    format!("({:.digits$}, {:.digits$}, {:.digits$})", tidy(p.x), tidy(p.y), tidy(p.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn what_stands_on_another_does_so_in_any_order() {
        let case = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\n\
                    [contact]\nspring = 1e5\n";
        let body = |name: &str, z: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nsize = [0.1, 0.1, 0.04]\ncenter = [0.2, 0.2, {z}]\ndensity = 500\nstanding = true\n"
            )
        };
        let (top, low) = (body("top", 0.055), body("low", 0.015));
        let heights = |bodies: String| {
            let scene = Scene::build(&format!("{case}{bodies}").parse().unwrap()).unwrap();
            scene.solids.iter().map(|s| (s.name.clone(), (s.position.z * 1e6).round())).collect::<Vec<_>>()
        };
        let expected = [("top".to_owned(), 60_000.0), ("low".to_owned(), 20_000.0)];
        assert_eq!(heights(format!("{top}{low}")), expected);
        assert_eq!(heights(format!("{low}{top}")), [expected[1].clone(), expected[0].clone()]);
    }

    #[test]
    fn lengths_and_points_are_told_at_any_scale() {
        let lengths =
            [(0.0100002, "0.010001"), (0.00561, "0.005610"), (5.001e-8, "5.01e-8"), (9.999e-4, "0.001000")];
        for (length, told) in lengths {
            let told_length: f64 = at_least(length).parse().expect("a number");
            assert!(at_least(length) == told && told_length >= length, "{length}: {}", at_least(length));
        }
        assert_eq!(point(DVec3::new(0.3, -12.0, 1e-9)), "(0.3000, -12.0000, 0.0000)");
        assert_eq!(point(DVec3::new(3e-6, 2e-6, 4.5e-7)), "(0.000003000, 0.000002000, 0.000000450)");
        assert_eq!(point(DVec3::ZERO), "(0.0000, 0.0000, 0.0000)");
        assert_eq!(point(DVec3::new(-1e-17, -0.0, -1.0)), "(0.0000, 0.0000, -1.0000)");
    }
}
