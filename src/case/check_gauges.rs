//! The part of the check that judges gauges.

use super::check::Checker;
use super::names::{is_pattern, stands_for};

impl Checker<'_> {
    pub(super) fn gauges(&mut self) {
        let case = self.case;
        let gauges = &case.gauge;
        if let Some(every) = gauges.every {
            self.positive("gauge.every", every, "s");
        }
        let kinds = gauges.names();
        let moves = case.body.iter().any(|b| b.can_move(self.flat()));
        for (kind, names) in &kinds {
            // what bodies press there is without water, too
            let known = case.fluid.is_some() || *kind == "force" && moves;
            if !names.is_empty() && !known {
                let key = format!("gauge.{kind}");
                self.add(key, "there is no [fluid] to measure", "remove the gauge or add [fluid]");
            }
        }
        let named = |kind: &str, names: &[&str]| -> Vec<(String, String)> {
            let key = |(k, name): (usize, &&str)| (format!("gauge.{kind}.{k}.name"), (*name).to_owned());
            names.iter().enumerate().map(key).collect()
        };
        let names: Vec<_> = kinds.iter().flat_map(|(kind, names)| named(kind, names)).collect();
        self.unique(&names, "gauge");
        for (k, gauge) in gauges.level.iter().enumerate() {
            self.in_tank(&format!("gauge.level.{k}.at"), [gauge.at, gauge.at], "the line");
        }
        for (k, gauge) in gauges.velocity.iter().enumerate() {
            let at = [gauge.point[0], gauge.point[1]];
            self.in_tank(&format!("gauge.velocity.{k}.point"), [at, at], "the point");
        }
        for (k, gauge) in gauges.volume.iter().enumerate() {
            let path = format!("gauge.volume.{k}");
            if self.box_edges(&path, &format!("{path}.max"), &gauge.min, &gauge.max) {
                let of = |v: &super::Vector| [v[0], v[1]];
                self.in_tank(&path, [of(&gauge.min), of(&gauge.max)], "the box");
            }
        }
        self.force_gauges();
    }

    fn force_gauges(&mut self) {
        let case = self.case;
        let mut solid: Vec<&str> = (case.body.iter().map(|b| b.name.as_str()))
            .chain(case.moving_wall.iter().map(|w| w.name.as_str()))
            .chain(case.obstacle.iter().map(|o| o.name.as_str()))
            .chain(case.plane.iter().map(|p| p.name.as_str()))
            .chain(case.openings().filter(|o| !o.is_hole()).map(|o| o.name))
            .collect();
        if let Some(tank) = &case.tank {
            let bare = tank.without_wall();
            let sides = self.axes().flat_map(|k| [2 * k, 2 * k + 1]);
            let walls = sides.map(|side| super::TANK_FACES[side]).filter(|(face, _)| !bare.contains(face));
            solid.extend(walls.map(|(_, name)| name));
        }
        for (k, gauge) in case.gauge.force.iter().enumerate() {
            if is_pattern(&gauge.on) && solid.iter().any(|name| stands_for(&gauge.on, name)) {
                continue;
            }
            let face = case.tank.is_some() && super::TANK_FACES.iter().any(|(_, name)| *name == gauge.on);
            if face && !solid.contains(&gauge.on.as_str()) {
                let message = format!("`{}` has no wall to measure on", gauge.on);
                let remedy = if self.flat() && gauge.on.starts_with("tank.y_") {
                    "in two dimensions the tank has walls along x and z alone: name one of these"
                } else {
                    "name another face, or take it out of tank.open or tank.periodic"
                };
                self.add(format!("gauge.force.{k}.on"), message, remedy);
            } else if !solid.contains(&gauge.on.as_str()) {
                let is_hole = case.openings().any(|o| o.is_hole() && o.name == gauge.on);
                let message = match is_hole {
                    true => format!("outflow `{}` is a hole: nothing stands in it to measure on", gauge.on),
                    false => format!("nothing solid is called `{}`", gauge.on),
                };
                let remedy = match super::report::closest(&gauge.on, &solid) {
                    _ if is_hole => "name the face of the tank around it, or remove the gauge".to_owned(),
                    Some(name) => format!("did you mean `{name}`?"),
                    None if solid.is_empty() => "remove the gauge".to_owned(),
                    None => format!("allowed: {}", solid.join(", ")),
                };
                self.add(format!("gauge.force.{k}.on"), message, remedy);
            }
        }
    }
}
