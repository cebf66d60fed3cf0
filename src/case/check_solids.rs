//! The part of the check that judges bodies and their contact.

use super::check::{Checker, length};
use super::{Body, ContactDevice, Law};

impl Checker<'_> {
    pub(super) fn body(&mut self, k: usize, body: &Body) {
        let path = |key: &str| format!("body.{k}.{key}");
        for (axis, &length) in body.size.iter().enumerate() {
            self.positive(&path(&format!("size.{axis}")), length, "m");
        }
        if body.size.iter().all(|&l| l > 0.0) {
            self.fits(&path("size"), &format!("body `{}`", body.name), &[0.0; 3], &body.size);
        }
        let given = self.one_of(
            &format!("body.{k}"),
            &[("mass", body.mass.is_some()), ("density", body.density.is_some())],
        );
        if given == 0 && body.motion.is_none() {
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
        if let Some(inertia) = body.inertia {
            let [a, b, c] = inertia;
            if inertia.iter().any(|&i| i.is_finite() && i <= 0.0) {
                self.add(path("inertia"), "a principal moment is not positive", "allowed: more than 0 kg m2");
            } else if a > (b + c) * 1.000_001 || b > (c + a) * 1.000_001 || c > (a + b) * 1.000_001 {
                self.add(
                    path("inertia"),
                    "one moment exceeds the sum of the other two, no mass has that",
                    "correct it or leave it out for a uniform box",
                );
            }
        }
        if let Some(turn) = &body.orientation
            && length(&turn.axis) == 0.0
        {
            self.add(path("orientation.axis"), "the axis has no length", "give a direction, e.g. [0, 1, 0]");
        }
        for (i, freedom) in body.locked.iter().enumerate() {
            if body.locked[..i].contains(freedom) {
                self.add(path(&format!("locked.{i}")), "listed twice", "remove one of them");
            }
        }
        if let Some(rows) = &body.motion {
            self.motion(&path("motion"), rows);
            for (key, given) in [("locked", !body.locked.is_empty()), ("standing", body.standing)] {
                if given {
                    self.add(
                        path(key),
                        format!("body `{}` follows a table: `{key}` has no effect", body.name),
                        format!("remove `{key}` or `motion`"),
                    );
                }
            }
            for (key, v) in [("velocity", &body.velocity), ("angular_velocity", &body.angular_velocity)] {
                if length(v) > 0.0 {
                    self.add(
                        path(key),
                        format!("body `{}` follows a table: `{key}` has no effect", body.name),
                        format!("remove `{key}` or `motion`"),
                    );
                }
            }
        }
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

    pub(super) fn contact(&mut self) {
        let moves = |b: &&Body| b.motion.is_none() && b.locked.len() < 6;
        let Some(contact) = &self.case.contact else {
            if let Some(body) = self.case.body.iter().find(moves) {
                let message = format!("body `{}` can move, but there is no [contact]", body.name);
                self.add(
                    "contact",
                    message,
                    "add [contact] with `spring` [N/m], or lock all six of the body's freedoms",
                );
            }
            return;
        };
        self.positive("contact.spring", contact.spring, "N/m");
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
            self.range("contact.restitution", e, e > 0.0 && e <= 1.0, "more than 0, at most 1");
        }
        self.not_negative("contact.viscous_friction", contact.viscous_friction, "kg/s");
        self.not_negative("contact.friction", contact.friction, "");
        if contact.substeps == Some(0) {
            self.add("contact.substeps", "0 sub-steps", "allowed: 1 or more, or leave it out");
        }
        if contact.device == ContactDevice::Gpu && contact.law == Law::Pressure {
            let remedy = "leave `device` out or set law = \"smooth\" or \"paper\"";
            self.add("contact.device", "law = \"pressure\" runs on the host only", remedy);
        }
        if contact.viscous_friction != 0.0 && contact.law == Law::Pressure {
            let message = "`viscous_friction` belongs to law = \"paper\" or \"smooth\"";
            self.add("contact.viscous_friction", message, "remove it or set one of these laws");
        }
        let only = |key: &str, law: &str| {
            (format!("`{key}` belongs to law = \"{law}\""), format!("remove `{key}` or set law = \"{law}\""))
        };
        for (key, given, law, name) in [
            ("torque", !contact.torque, Law::Paper, "paper"),
            ("friction", contact.friction != 0.0, Law::Smooth, "smooth"),
            ("restitution", contact.restitution.is_some(), Law::Smooth, "smooth"),
        ] {
            if given && contact.law != law {
                let (message, remedy) = only(key, name);
                self.add(format!("contact.{key}"), message, remedy);
            }
        }
    }
}
