//! The part of the check that judges bodies and their contact.

use super::check::{Checker, length};
use super::section::flaw;
use super::shape::ShapeKey;
use super::{AXES, Axis, Body, BodyShape, Contact, Form, Freedom, Law};
use glam::DMat3;

/// Most sub-steps of a step that a case can ask for.
const MOST_SUBSTEPS: u32 = 100_000;
/// Springs outside of this range overflow, or vanish in rounding [N/m].
const SPRING_LEAST: f64 = 1e-9;
const SPRING_MOST: f64 = 1e18;

impl Checker<'_> {
    pub(super) fn body(&mut self, k: usize, body: &Body) {
        let path = |key: &str| format!("body.{k}.{key}");
        let label = format!("body `{}`", body.name);
        self.form(&format!("body.{k}"), &label, &body.form());
        let (name, needed) = body.shape.keys();
        let of_all = [("mass", body.mass.is_some()), ("inertia", body.inertia.is_some())];
        if let Some((key, _)) = of_all.into_iter().find(|(_, given)| *given)
            && (self.flat() && body.height.is_none() && needed.contains(&"height"))
        {
            let message =
                format!("{label} is a {name} whose `{key}` is that of all its length along y, not told");
            self.add(path(key), message, "add `height` [m], or give a `density` alone");
        }
        if body.shape == BodyShape::Terrain {
            let message = format!("{label}: a terrain is ground, which does not move");
            self.add(path("shape"), message, "make it an [[obstacle]], or set shape = \"mesh\"");
        }
        let given = self.one_of(
            &format!("body.{k}"),
            &[("mass", body.mass.is_some()), ("density", body.density.is_some())],
        );
        if given == 0 && body.can_move(self.flat()) {
            self.add(
                format!("body.{k}"),
                format!("body `{}` has neither mass nor density", body.name),
                "add `density` [kg/m3] or `mass` [kg]",
            );
        }
        for (key, value, unit) in [("mass", body.mass, "kg"), ("density", body.density, "kg/m3")] {
            if let Some(value) = value {
                self.positive(&path(key), value, unit);
            }
        }
        self.place(&path("center"), &body.center);
        if let Some(inertia) = body.inertia {
            let [a, b, c] = inertia;
            if inertia.iter().any(|&i| i.is_finite() && i <= 0.0) {
                self.add(path("inertia"), "a principal moment is not positive", "allowed: more than 0 kg m2");
            } else if a > (b + c) * 1.000_001 || b > (c + a) * 1.000_001 || c > (a + b) * 1.000_001 {
                self.add(
                    path("inertia"),
                    "one moment exceeds the sum of the other two, no mass has that",
                    "correct it or leave it out for a uniform body",
                );
            }
        }
        for (i, freedom) in body.locked.iter().enumerate() {
            if body.locked[..i].contains(freedom) {
                self.add(path(&format!("locked.{i}")), "listed twice", "remove one of them");
            }
        }
        let far = body.form().reach();
        self.guided(&format!("body.{k}"), &body.guide(), false, (far, body.center));
        self.held(&format!("body.{k}"), body);
        if body.is_driven() {
            let unheard = [
                ("locked", !body.locked.is_empty(), false),
                ("standing", body.standing, false),
                ("hinge", body.hinge.is_some(), false),
                ("mass_offset", body.mass_offset.is_some(), false),
                ("velocity", length(&body.velocity) > 0.0, false),
                ("angular_velocity", length(&body.angular_velocity) > 0.0, false),
                // What it is made of contradicts no motion: it is told alone.
                ("density", body.density.is_some(), true),
                ("mass", body.mass.is_some(), true),
                ("inertia", body.inertia.is_some(), true),
            ];
            for (key, _, harmless) in unheard.into_iter().filter(|u| u.1) {
                let message = format!("body `{}` follows a given motion: `{key}` has no effect", body.name);
                let remedy = format!("remove `{key}`, or what moves the body");
                if harmless {
                    self.warn(&path(key), message, &remedy);
                } else {
                    self.add(path(key), message, remedy);
                }
            }
        }
        self.unmoved(&format!("body.{k}"), body);
        self.in_plane(&path("velocity"), &body.velocity);
        self.about_y(&path("angular_velocity"), &body.angular_velocity);
        if body.standing && length(&self.case.run.gravity) == 0.0 {
            self.add(
                path("standing"),
                "without gravity there is no way up",
                "remove `standing` and give the exact `center`",
            );
        }
        if body.displaces_fluid && self.case.fluid.is_none() {
            self.add(path("displaces_fluid"), "there is no [fluid]", "remove `displaces_fluid`");
        }
    }

    /// What it starts with along freedoms that it has not.
    fn unmoved(&mut self, path: &str, body: &Body) {
        // A state says how it moves, and may be of a run in which it was free.
        if self.case.run.from.is_some() {
            return;
        }
        let hinged = body.hinge.as_ref().map(|hinge| hinge.axis as usize);
        let turns = [Freedom::RotationX, Freedom::RotationY, Freedom::RotationZ];
        let held = |axis: usize, freedom: Freedom, turns: bool| match hinged {
            Some(free) => !turns || axis != free,
            None => body.locked.contains(&freedom),
        };
        let speeds = [
            ("velocity", [Freedom::X, Freedom::Y, Freedom::Z], body.velocity, false),
            ("angular_velocity", turns, body.angular_velocity, true),
        ];
        for (key, freedoms, speed, turns) in speeds {
            if let Some(axis) = (0..3).find(|&k| speed[k] != 0.0 && held(k, freedoms[k], turns)) {
                let (what, axis) = (if hinged.is_some() { "its hinge" } else { "`locked`" }, AXES[axis]);
                let message =
                    format!("{what} holds body `{}`: it cannot have `{key}` along {axis}", body.name);
                self.add(format!("{path}.{key}"), message, "set that number to 0, or let it go");
            }
        }
    }

    /// Where its mass is, and a hinge.
    fn held(&mut self, path: &str, body: &Body) {
        let key = |key: &str| format!("{path}.{key}");
        if let Some(offset) = &body.mass_offset {
            self.in_plane(&key("mass_offset"), offset);
            let shape = self.spacing().and_then(|l0| body.form().shape(l0, self.flat()).ok());
            let (far, reach) = (length(offset), shape.map_or(f64::INFINITY, |(shape, _)| shape.radius()));
            if far > reach {
                let message = format!(
                    "the centre of mass would be {far} m from the centre, beyond all of the body ({reach:.4} m)"
                );
                self.add(key("mass_offset"), message, "give the way from `center` to it [m], not its place");
            }
        }
        let Some(hinge) = &body.hinge else { return };
        self.place(&key("hinge.at"), &hinge.at);
        if self.flat() && hinge.axis != Axis::Y {
            self.add(key("hinge.axis"), "in two dimensions a solid turns about y alone", "set axis = \"y\"");
        }
        for (other, given) in [("locked", !body.locked.is_empty()), ("standing", body.standing)] {
            if given {
                let message = format!("a hinge holds body `{}` already: `{other}` has no effect", body.name);
                self.add(key(other), message, format!("remove `{other}`, or the hinge"));
            }
        }
    }

    /// A spring that a body's own weight presses through is none.
    fn spring(&mut self, spring: f64, law: Law) {
        let run = &self.case.run;
        if spring.is_nan() || spring <= 0.0 {
            self.positive("contact.spring", spring, "N/m");
            return;
        }
        if !(SPRING_LEAST..=SPRING_MOST).contains(&spring) {
            let allowed = format!("{SPRING_LEAST:e} to {SPRING_MOST:e} N/m");
            self.range("contact.spring", spring, false, &allowed);
            return;
        }
        if law == Law::Pressure {
            return;
        }
        let (spacing, flat) = (run.spacing, self.flat());
        let weight = |body: &Body| {
            let Ok((shape, share)) = body.form().shape(spacing, flat) else { return 0.0 };
            let mass = body.mass.map(|m| m * share).or(body.density.map(|d| d * shape.volume()));
            mass.unwrap_or(0.0) * length(&run.gravity)
        };
        let smallest = |body: &Body| {
            let Ok((shape, _)) = body.form().shape(spacing, flat) else { return f64::INFINITY };
            let [x, y, z] = (2.0 * shape.extent(DMat3::IDENTITY)).to_array();
            // what is missing is reported elsewhere
            let lengths = [x, if flat { x } else { y }, z].map(|l| if l > 0.0 { l } else { f64::INFINITY });
            lengths.into_iter().fold(f64::INFINITY, f64::min)
        };
        let free = self.case.body.iter().filter(|b| b.can_move(flat));
        let sinks = |b: &&Body| weight(b) / spring > smallest(b);
        let found = free.filter(sinks).max_by(|a, b| weight(a).total_cmp(&weight(b)));
        if let Some((name, weight, edge)) = found.map(|b| (b.name.clone(), weight(b), smallest(b))) {
            let message = format!(
                "the weight of body `{name}`, {weight:.3e} N, presses a spring of {spring:e} N/m {:.3e} m deep, more \
                 than the body's {edge} m",
                weight / spring
            );
            self.add("contact.spring", message, format!("use {:.1e} N/m or more", 100.0 * weight / edge));
        }
    }

    /// Whether `label` in the table `at` has a key of another shape than a box and no `shape`: that alone is told then.
    pub(super) fn forgotten(&mut self, at: &str, label: &str, form: &Form) -> bool {
        let Some((key, shape)) = form.forgotten(self.flat()) else { return false };
        let message = format!("{label} has a `{key}` and no `shape`, or the one of a box without its `size`");
        self.add(format!("{at}.{key}"), message, format!("add shape = \"{shape}\""));
        true
    }

    /// The keys that the shape of `label` in the table `at` needs, no others, and a particle across at least.
    pub(super) fn form(&mut self, at: &str, label: &str, form: &Form) {
        if self.forgotten(at, label, form) {
            return;
        }
        let path = |key: &str| format!("{at}.{key}");
        let (name, needed) = form.shape.keys();
        let flat = self.flat();
        let mut complete = true;
        for ShapeKey { name: key, given, of, example, what } in form.shape_keys() {
            // A slice is as wide as the spacing, whatever the solid's length.
            if needed.contains(&key) && !given && !(flat && key == "height") {
                complete = false;
                let message = format!("{label} is a {name} without `{key}`");
                self.add(at, message, format!("add `{key} = {example}`, {what}"));
            } else if given && !needed.contains(&key) {
                self.add(
                    path(key),
                    format!("{label} is a {name}: `{key}` does not belong to it"),
                    format!("remove `{key}`, or set shape = \"{of}\""),
                );
            }
        }
        if form.file == Some("") {
            complete = false;
            self.add(path("file"), "it names nothing", "name an STL or OBJ file, relative to the case");
        }
        for (axis, &length) in form.size.iter().flatten().enumerate() {
            self.positive(&path(&format!("size.{axis}")), length, "m");
        }
        for (key, length) in [("radius", form.radius), ("height", form.height)] {
            if let Some(length) = length {
                self.positive(&path(key), length, "m");
            }
        }
        if let Some(flaw) = form.section.and_then(flaw) {
            complete = false;
            let corner = flaw.corner.map_or(String::new(), |k| format!(".{k}"));
            self.add(path(&format!("section{corner}")), format!("{label}: {}", flaw.message), flaw.remedy);
        }
        if flat && form.shape.needs_space() {
            let message = format!("{label}: there are no {name}s in two dimensions");
            let remedy = "set shape = \"prism\" with a `section`, or \"cylinder\": it lies along y";
            self.add(path("shape"), message, remedy);
        }
        if let Some(axis) = form.axis {
            if !form.shape.has_axis() {
                let message = format!("{label} is a {name}: it has no `axis`");
                self.add(path("axis"), message, "remove `axis`; `orientation` turns a solid");
            } else if length(&axis) == 0.0 {
                self.add(path("axis"), "the axis has no length", "give a direction, e.g. [0, 1, 0]");
            } else if flat && (axis[0] != 0.0 || axis[2] != 0.0) {
                let message = "in two dimensions a cylinder lies along y";
                self.add(path("axis"), message, "set axis = [0, 1, 0], or leave it out");
            }
        }
        if let Some(turn) = form.orientation {
            if length(&turn.axis) == 0.0 {
                self.add(
                    path("orientation.axis"),
                    "the axis has no length",
                    "give a direction, e.g. [0, 1, 0]",
                );
            }
            self.about_y(&path("orientation.axis"), &turn.axis);
        }
        if let Some(scale) = form.scale {
            self.positive(&path("scale"), scale, "m");
            if !form.shape.is_file() {
                let message = format!("{label} is a {name}: it has no `scale`");
                self.add(path("scale"), message, "remove `scale`");
            }
        }
        let (key, size) = form.across(flat);
        if complete && size.iter().all(|&l| l > 0.0) {
            self.fits(&path(key), label, &[0.0; 3], &size);
        }
    }

    pub(super) fn contact(&mut self) {
        let Some(contact) = &self.case.contact else {
            let flat = self.flat();
            if let Some(body) = self.case.body.iter().find(|b| b.can_move(flat)) {
                let message = format!("body `{}` can move, but there is no [contact]", body.name);
                self.add(
                    "contact",
                    message,
                    "add a table [contact], with `friction = 0.4` or whatever it is, or lock all of the body's freedoms",
                );
            }
            return;
        };
        match contact.spring {
            Some(spring) => self.spring(spring, contact.law),
            None if contact.law == Law::Paper => {
                let message = "the paper's law has no spring but the one that is given";
                self.add(
                    "contact.spring",
                    message,
                    "add `spring` [N/m], e.g. 1e5; `seixo plan` then tells what the bodies ask for",
                );
            }
            None => {}
        }
        self.one_of(
            "contact",
            &[
                ("damping", contact.damping.is_some()),
                ("damping_ratio", contact.damping_ratio.is_some()),
                ("restitution", contact.restitution.is_some()),
            ],
        );
        if let Some(damping) = contact.damping {
            self.not_negative("contact.damping", damping, "kg/s");
        }
        if let Some(ratio) = contact.damping_ratio {
            self.not_negative("contact.damping_ratio", ratio, "");
        }
        if let Some(e) = contact.restitution {
            self.range("contact.restitution", e, (0.0..=1.0).contains(&e), "0 (plastic) to 1 (elastic)");
        }
        self.not_negative("contact.viscous_friction", contact.viscous_friction, "kg/s");
        self.not_negative("contact.friction", contact.friction, "");
        match contact.substeps {
            Some(0) => self.add("contact.substeps", "0 sub-steps", "allowed: 1 or more, or leave it out"),
            Some(n) if n > MOST_SUBSTEPS => self.add(
                "contact.substeps",
                format!("{n} sub-steps a step never end"),
                format!("allowed: 1 to {MOST_SUBSTEPS}, or leave it out for as many as stability asks for"),
            ),
            _ => {}
        }
        if contact.viscous_friction != 0.0 && contact.law == Law::Pressure {
            let message = "`viscous_friction` belongs to law = \"paper\" or \"smooth\"";
            self.add("contact.viscous_friction", message, "remove it or set one of these laws");
        }
        self.contact_pairs(contact);
        let only = |key: &str, law: &str| {
            (format!("`{key}` belongs to law = \"{law}\""), format!("remove `{key}` or set law = \"{law}\""))
        };
        for (key, given, law, name) in [
            ("torque", !contact.torque, Law::Paper, "paper"),
            ("friction", contact.friction != 0.0, Law::Smooth, "smooth"),
            ("restitution", contact.restitution.is_some(), Law::Smooth, "smooth"),
            ("pair", !contact.pair.is_empty(), Law::Smooth, "smooth"),
        ] {
            if given && contact.law != law {
                let (message, remedy) = only(key, name);
                self.add(format!("contact.{key}"), message, remedy);
            }
        }
    }

    fn contact_pairs(&mut self, contact: &Contact) {
        let damped = [("damping", contact.damping), ("damping_ratio", contact.damping_ratio)];
        let damped = damped.iter().find(|(_, given)| given.is_some()).map(|(key, _)| *key);
        for (k, pair) in contact.pair.iter().enumerate() {
            let path = format!("contact.pair.{k}");
            if pair.friction.is_none() && pair.restitution.is_none() {
                self.add(&path, "a pair without numbers of its own", "give it `friction` or `restitution`");
            }
            if let Some(friction) = pair.friction {
                self.not_negative(&format!("{path}.friction"), friction, "");
            }
            if let Some(e) = pair.restitution {
                let key = format!("{path}.restitution");
                self.range(&key, e, (0.0..=1.0).contains(&e), "0 (plastic) to 1 (elastic)");
                if let Some(damping) = damped {
                    let message =
                        format!("`restitution` of a pair and `contact.{damping}` exclude each other");
                    self.add(key, message, "give `contact.restitution` instead of it");
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::case::check::check;

    #[test]
    fn what_a_driven_body_is_made_of_is_told_to_have_no_effect() {
        let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[contact]\nspring = 1e5\n[[body]]\nname = \"d\"\n\
                    size = [0.1, 0.1, 0.1]\ncenter = [0, 0, 0]\nmass = 5\ninertia = [0.01, 0.01, 0.01]\n";
        let told = |more: &str| {
            let problems = check(&format!("{text}{more}").parse().unwrap());
            problems.into_iter().map(|p| (p.key, p.warning)).collect::<Vec<_>>()
        };
        let heard = ["body.0.mass", "body.0.inertia"].map(|key| (key.to_owned(), true));
        let driven = told("motion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]\n");
        assert!(heard.iter().all(|h| driven.contains(h)), "{driven:?}");
        assert!(told("").iter().all(|t| !heard.contains(t)));
    }
}
