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
use crate::slots::{Opposite, Push};
use glam::{DMat3, DVec3};
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

/// A face that looks back at a push less than this is not pressed on (cosine of the angle).
const BACK: f64 = 0.5;

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
        scene: &Scene,
        params: &Params,
    ) -> Wrench {
        let mut sum = Wrench::default();
        // Of each row and face the direction, and what of it is pressed on [m2].
        let mut pressed: BTreeMap<(usize, [i32; 3]), (DVec3, f64)> = BTreeMap::new();
        for push in pushes.iter().filter(|push| matches!(push.on, Opposite::Wall(_))) {
            let mut on = DVec3::ZERO;
            for (face, share) in self.shares(push, scene) {
                let area = share * push.area_on(face.normal);
                let way = (1e3 * face.normal).round().as_ivec3().to_array();
                on += area;
                if let Some(row) = face.row {
                    pressed.entry((row, way)).or_insert((face.normal, 0.0)).1 += area.length();
                }
            }
            let (force, arm) = (push.pressure * on, scene.periodic.nearest(push.at - self.about));
            sum += Wrench { force, torque: arm.cross(force) };
        }
        // What is pressed on and counts as bare at once counts once: beside a body half of a face may be the one, half the other.
        let whole = params.spacing * params.spacing;
        for ((row, _), (normal, pressed)) in pressed {
            let bare = areas[row].dot(normal).clamp(0.0, whole);
            let twice = (bare + pressed - whole).clamp(0.0, bare.min(pressed));
            let force = twice * told[row].in_force(self.to_surface[row], params) * normal;
            let arm = scene.periodic.nearest(self.position[row] + self.to_surface[row] - self.about);
            sum += Wrench { force, torque: arm.cross(force) };
        }
        sum
    }

    /// Faces before which a `push` lies, and how much of it [-], by the points by which what stands before faces is told; those on a line between faces have a part
    /// of each. What lies before none is not on this wall: beside its edge there is open water.
    fn shares(&self, push: &Push, scene: &Scene) -> Vec<(&Face, f64)> {
        let l0 = self.tiles.spacing;
        let (edge, way) = (self.tiles.edge(push.area.length()), push.area.normalize_or_zero());
        let reach = edge + 1.5 * l0;
        // Faces, and the way from their middles.
        let mut near: Vec<(&Face, DVec3)> = vec![];
        for image in scene.periodic.images(scene.periodic.wrap(push.at), reach) {
            self.centers.near(image, reach, |k| {
                let face = &self.faces[k as usize];
                near.extend((face.normal.dot(way) < -BACK).then_some((face, image - face.center)));
            });
        }
        // Of an edge that looks at it with two faces the one that does so more.
        let most = near.iter().map(|(face, _)| -face.normal.dot(way)).fold(0.0, f64::max);
        near.retain(|(face, _)| -face.normal.dot(way) > most - SLACK);
        let points: Vec<DVec3> = self.tiles.points((DVec3::ZERO, edge), way).collect();
        let to_wall = scene.walls[self.shape].axes.transpose();
        let mut shares = vec![];
        for x in &points {
            let before = |(face, way): &(&Face, DVec3)| {
                let way = *way + *x;
                let along = to_wall * (way - way.dot(face.normal) * face.normal);
                along.abs().max_element() <= (0.5 + SLACK) * l0
            };
            let on: Vec<&Face> = near.iter().filter(|of| before(of)).map(|of| of.0).collect();
            let share = 1.0 / (on.len() * points.len()) as f64;
            shares.extend(on.into_iter().map(|face| (face, share)));
        }
        shares
    }
}
