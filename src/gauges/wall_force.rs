//! Force of the fluid on a fixed wall, as on a solid that moves: pressure on the surface ([`crate::kernels::wall_excess`]) times area over its wall layer, and the reactions of
//! viscosity ([`crate::kernels::viscosity`]), of the friction of unresolved boundary layers ([`crate::kernels::wall_friction`]) and of collisions
//! ([`crate::kernels::collision`]). Faces behind solids see no water; under a body that stands on the wall the water of the slot presses ([`crate::slots`]).

use crate::body::{Pose, Wrench};
use crate::contact::broad::PointGrid;
use crate::cover::{self, CELL, SLACK, Standing, Tiles};
use crate::kernels::body_force::RowPressure;
use crate::params::Params;
use crate::scene::Scene;
use crate::shape::PointCells;
use crate::slots::{AGAINST, BEFORE, Opposite, Push};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A face of a row, of the size of a particle.
#[derive(Clone, Debug)]
struct Face {
    /// None of one before which something stands that never moves: slots alone press there.
    row: Option<usize>,
    /// Its middle [m].
    center: DVec3,
    /// Into the free space, of length 1.
    normal: DVec3,
    /// What never moves and may reach before it.
    still: Vec<usize>,
    /// Part before which nothing stands that never moves [-].
    bare: f64,
}

/// A wall's particle no farther from the place one spacing before a face than this, over l0, stands before it.
const AHEAD: f64 = 0.45;

/// Places on the way from a push to a face, over that, at which a solid stands between.
const BETWEEN: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// The wall layer of a fixed wall.
#[derive(Clone, Debug, Default)]
pub struct FixedWall {
    /// Index into [`Scene::walls`].
    shape: usize,
    /// Slots of its wall particles that face the fluid.
    pub slots: Vec<usize>,
    position: Vec<DVec3>,
    /// From a particle's centre to the true surface, one a slot [m].
    to_surface: Vec<DVec3>,
    faces: Vec<Face>,
    /// The faces by where they are.
    centers: PointGrid,
    /// What stands before the faces and never moves.
    still: Vec<Standing>,
    tiles: Tiles,
    /// Torque counts about this point, the middle of the wall: of a face of the tank or a plane that of its surface, else of its box [m].
    about: DVec3,
}

impl FixedWall {
    /// The fixed wall `name`: an obstacle, a plane or a face of the tank (`tank.z_min`); `None` if there is none.
    pub fn find(scene: &Scene, name: &str) -> Option<Self> {
        let shape = scene.walls.iter().position(|w| w.name == name)?;
        let on_lattice = scene.walls[shape].axes == DMat3::IDENTITY;
        let l0 = scene.spacing;
        let tiles = Tiles::new(scene);
        let (about, still) = (scene.walls[shape].middle, cover::still(scene, Some(shape)));
        let mut out = Self { shape, about, still, tiles, ..Self::default() };
        // A face with another wall before it sees no water: under a pillar, where two faces of the tank meet.
        let mut solid = PointCells::new(l0);
        scene.position[scene.groups.static_range()].iter().for_each(|x| solid.add(scene.periodic.wrap(*x)));
        let mut rows: Vec<(usize, DVec3, Vec<DVec3>)> = vec![];
        for (k, slot) in scene.groups.static_wall_range().enumerate() {
            let (normal, x) = (scene.static_wall_normal[k], scene.position[slot]);
            if scene.static_wall_shape[k] as usize != shape {
                continue;
            }
            // Particles on an edge of a box belong to all of its faces there, whole.
            let open = |axis: usize| {
                let face = DVec3::AXES[axis] * normal[axis].signum();
                let ahead = || solid.is_near(scene.periodic.wrap(x + l0 * face), AHEAD * l0);
                (normal[axis].abs() > 1e-6 && !ahead()).then_some(face)
            };
            let normals: Vec<DVec3> =
                if on_lattice { (0..3).filter_map(open).collect() } else { vec![normal] };
            rows.push((slot, x, normals));
        }
        let centers: Vec<DVec3> =
            rows.iter().flat_map(|(_, x, normals)| normals.iter().map(move |n| *x + 0.5 * l0 * *n)).collect();
        let count = centers.len();
        let mut reached =
            tiles.reached((&PointGrid::new(centers, CELL * l0), count), None, &out.still).into_iter();
        for (slot, x, normals) in rows {
            let to_surface = normals.iter().sum::<DVec3>() * 0.5 * l0;
            let face = |(normal, still): (DVec3, Vec<usize>)| {
                let center = x + 0.5 * l0 * normal;
                let near: Vec<&Standing> = still.iter().map(|&k| &out.still[k]).collect();
                let bare = tiles.bare((center, l0), normal, &near);
                Face { row: (bare > 0.0).then_some(out.slots.len()), center, normal, still, bare }
            };
            let faces: Vec<Face> = normals.into_iter().zip(reached.by_ref()).map(face).collect();
            let any_bare = faces.iter().any(|face| face.row.is_some());
            out.faces.extend(faces);
            if !any_bare {
                continue;
            }
            out.slots.push(slot);
            out.position.push(x);
            out.to_surface.push(to_surface);
        }
        out.centers = PointGrid::new(out.faces.iter().map(|face| face.center).collect(), CELL * l0);
        Some(out)
    }

    /// The point that its torque counts about [m].
    pub fn about(&self) -> DVec3 {
        self.about
    }

    /// Its number in [`Scene::walls`].
    pub fn shape(&self) -> usize {
        self.shape
    }

    /// Area with its direction into the free space, one a slot, where solids do not stand before it [m2]; those of `scene` that move are at their `poses`.
    pub fn areas(&self, scene: &Scene, poses: &[Pose]) -> Vec<DVec3> {
        let l0 = self.tiles.spacing;
        let moving = cover::moving(scene, poses);
        let mut areas = vec![DVec3::ZERO; self.slots.len()];
        let reached = self.tiles.reached((&self.centers, self.faces.len()), None, &moving);
        for (face, reached) in self.faces.iter().zip(reached) {
            let Some(row) = face.row else { continue };
            let bare = if reached.is_empty() {
                face.bare
            } else {
                let near = reached.iter().map(|&k| &moving[k]);
                let all: Vec<&Standing> = near.chain(face.still.iter().map(|&k| &self.still[k])).collect();
                self.tiles.bare((face.center, l0), face.normal, &all)
            };
            areas[row] += bare * l0 * l0 * face.normal;
        }
        areas
    }

    /// Force and torque of what its slots tell: pressures on their bare `areas`, and reactions [N, N m].
    pub fn force(&self, told: &[RowPressure], areas: &[DVec3], params: &Params) -> Wrench {
        let mut sum = Wrench::default();
        for (k, (row, area)) in told.iter().zip(areas).enumerate() {
            let force = row.reaction - row.on_surface(self.to_surface[k], params) * *area;
            sum.force += force;
            sum.torque += (self.position[k] + self.to_surface[k] - self.about).cross(force);
        }
        sum
    }

    /// Force and torque of the `pushes` of slots that are on it [N, N m], in place of what its slots have `told` there of their bare `areas`.
    pub fn slot_force(
        &self,
        pushes: &[Push],
        (told, areas): (&[RowPressure], &[DVec3]),
        (scene, poses): (&Scene, &[Pose]),
        params: &Params,
    ) -> Wrench {
        let mut sum = Wrench::default();
        // Of each row and face the direction, and what of it is pressed on [m2].
        let mut pressed: BTreeMap<(usize, [i32; 3]), (DVec3, f64)> = BTreeMap::new();
        // Over the joint of a wall and another one, or a solid, a push is on both.
        let is_on_body = |push: &Push| matches!(push.on, Opposite::Solid(k, _) if scene.solids[k].is_free());
        let shares = |push: &Push| if is_on_body(push) { vec![] } else { self.shares(push, scene, poses) };
        let laid: Vec<_> = pushes.par_iter().with_min_len(64).map(shares).collect();
        for (push, on) in pushes.iter().zip(laid).filter(|(_, on)| !on.is_empty()) {
            let mut force = DVec3::ZERO;
            for (face, share, above) in on {
                let area = share * push.area_on(face.normal);
                let way = (1e3 * face.normal).round().as_ivec3().to_array();
                force += push.pressure_at(-above * face.normal, params) * area;
                if let Some(row) = face.row {
                    pressed.entry((row, way)).or_insert((face.normal, 0.0)).1 += area.length();
                }
            }
            let arm = scene.periodic.nearest(push.at - self.about);
            sum += Wrench { force, torque: arm.cross(force) };
        }
        // What is pressed on and counts as bare at once counts once: beside a body half of a face may be the one, half the other.
        let whole = params.spacing * params.spacing;
        for ((row, _), (normal, pressed)) in pressed {
            let bare = areas[row].dot(normal).clamp(0.0, whole);
            let twice = (bare + pressed - whole).clamp(0.0, bare.min(pressed));
            let force = twice * told[row].on_surface(self.to_surface[row], params) * normal;
            let arm = scene.periodic.nearest(self.position[row] + self.to_surface[row] - self.about);
            sum += Wrench { force, torque: arm.cross(force) };
        }
        sum
    }

    /// Faces before which a `push` lies, how much of it [-], and how far before [m], by the points by which what stands before faces is told; those on a line between faces have a part
    /// of each. What lies before none is not on this wall: beside its edge there is open water.
    fn shares(&self, push: &Push, scene: &Scene, poses: &[Pose]) -> Vec<(&Face, f64, f64)> {
        let l0 = self.tiles.spacing;
        let (edge, way) = (self.tiles.edge(push.area.length()), push.area.normalize_or_zero());
        let reach = edge + 1.5 * l0;
        let wall = &scene.walls[self.shape];
        let to_wall = wall.axes.transpose();
        let off = to_wall * scene.periodic.nearest(push.at - wall.center);
        if (off.abs() - wall.half).max_element() > reach {
            return vec![];
        }
        // Faces, and the way from their middles.
        let mut near: Vec<(&Face, DVec3)> = vec![];
        for image in scene.periodic.images(scene.periodic.wrap(push.at), reach) {
            self.centers.near(image, reach, |k| {
                let face = &self.faces[k as usize];
                near.extend((face.normal.dot(way) < -AGAINST).then_some((face, image - face.center)));
            });
        }
        // Of an edge that looks at it with two faces the one that does so more.
        let most = near.iter().map(|(face, _)| -face.normal.dot(way)).fold(0.0, f64::max);
        near.retain(|(face, _)| -face.normal.dot(way) > most - SLACK);
        let points: Vec<DVec3> = self.tiles.points((DVec3::ZERO, edge), way).collect();
        let between = match push.on {
            Opposite::Solid(k, _) => Some(Standing::of(k, &scene.solids[k], &poses[k])),
            Opposite::Wall(wall) => {
                let other = scene.static_wall_shape[wall] as usize;
                (other != self.shape).then(|| Standing::wall(&scene.walls[other]))
            }
        };
        let mut shares = vec![];
        for x in &points {
            let before = |(face, way): &(&Face, DVec3), above: f64| {
                let way = *way + *x;
                let along = to_wall * (way - above * face.normal);
                let is_near = above > BEFORE.0 * l0 && above < BEFORE.1 * l0;
                // What it is on, if that is not this wall, may stand between.
                let at = |part: f64| face.center + way - part * above * face.normal;
                let is_free = |s: &Standing| {
                    BETWEEN.iter().all(|&part| s.outside(at(part), l0, &scene.periodic) > SLACK * l0)
                };
                is_near
                    && along.abs().max_element() <= (0.5 + SLACK) * l0
                    && between.as_ref().is_none_or(is_free)
            };
            let above = |(face, way): &(&Face, DVec3)| (*way + *x).dot(face.normal);
            let on: Vec<(&Face, f64)> = near
                .iter()
                .map(|of| (of, above(of)))
                .filter(|(of, above)| before(of, *above))
                .map(|(of, above)| (of.0, above))
                .collect();
            let share = 1.0 / (on.len() * points.len()) as f64;
            shares.extend(on.into_iter().map(|(face, above)| (face, share, above)));
        }
        shares
    }
}
