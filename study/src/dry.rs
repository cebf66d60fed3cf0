//! Dry scenes built by hand: boxes on the lattice, floors and walls, no fluid and no case file.

use glam::{DMat3, DQuat, DVec3};
use seixo::scene::{Drive, Edges, FreeBody, Groups, Kind, Motion, Scene, Shape, Solid, WallShape};

/// Standard gravity [m/s2]; Table 1 of the paper follows from it.
pub const GRAVITY: f64 = 9.80665;

/// A scene in the making.
#[derive(Clone, Debug)]
pub struct DryScene {
    scene: Scene,
}

/// A free box.
#[derive(Clone, Debug)]
pub struct FreeBox {
    /// Edge lengths [m].
    pub size: DVec3,
    /// Density [kg/m3].
    pub density: f64,
    /// Centre [m].
    pub center: DVec3,
    /// Orientation.
    pub orientation: DQuat,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
}

impl FreeBox {
    /// A box at rest.
    pub fn new(size: DVec3, density: f64, center: DVec3) -> Self {
        let (velocity, angular_velocity) = (DVec3::ZERO, DVec3::ZERO);
        Self { size, density, center, orientation: DQuat::IDENTITY, velocity, angular_velocity }
    }

    /// Mass [kg].
    pub fn mass(&self) -> f64 {
        self.density * self.size.element_product()
    }
}

impl DryScene {
    /// An empty scene of spacing `spacing` [m] in the box `low`..`high` [m], gravity along -z.
    pub fn new(spacing: f64, low: DVec3, high: DVec3) -> Self {
        let scene = Scene {
            dimensions: 3,
            spacing,
            node: DVec3::ZERO,
            gravity: DVec3::new(0.0, 0.0, -GRAVITY),
            position: vec![],
            velocity: vec![],
            kind: vec![],
            solid: vec![],
            groups: Groups::default(),
            reserve: 0,
            openings: vec![],
            solids: vec![],
            walls: vec![],
            static_wall_normal: vec![],
            static_wall_shape: vec![],
            domain: (low, high),
            periodic: Default::default(),
            depth: 0.0,
            filled: false,
            full: None,
            uneven: false,
            notes: vec![],
        };
        Self { scene }
    }

    /// Turns gravity to that of a slope of `angle` [rad] that falls towards +x.
    pub fn slope(mut self, angle: f64) -> Self {
        self.scene.gravity = GRAVITY * DVec3::new(angle.sin(), 0.0, -angle.cos());
        self
    }

    /// Sets the gravity [m/s2].
    pub fn gravity(mut self, gravity: DVec3) -> Self {
        self.scene.gravity = gravity;
        self
    }

    /// A fixed box without particles (enough for the smooth law).
    pub fn wall(mut self, center: DVec3, half: DVec3, axes: DMat3) -> Self {
        let name = format!("wall {}", self.scene.walls.len());
        self.scene.walls.push(WallShape { name, center, half, axes, middle: center });
        self
    }

    /// A floor whose surface is z = 0, thick and as wide as the domain.
    pub fn floor(self) -> Self {
        let (low, high) = self.scene.domain;
        let center = DVec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), -1.0);
        let half = DVec3::new(0.5 * (high.x - low.x), 0.5 * (high.y - low.y), 1.0);
        self.wall(center, half, DMat3::IDENTITY)
    }

    /// One layer of wall particles for the paper's law, centres at z = -l0 / 2 (surface z = 0) and at
    /// x, y = whole multiples of the spacing, between the corners; of the first wall of the scene, which is made if there is none.
    pub fn particle_floor(mut self, low: (f64, f64), high: (f64, f64)) -> Self {
        if self.scene.walls.is_empty() {
            self = self.floor();
        }
        let l0 = self.scene.spacing;
        let cell = |x: f64| (x / l0).round() as i64;
        for i in cell(low.0)..=cell(high.0) {
            for j in cell(low.1)..=cell(high.1) {
                let x = DVec3::new(i as f64 * l0, j as f64 * l0, -0.5 * l0);
                self.scene.position.push(x);
                self.scene.static_wall_normal.push(DVec3::Z);
                self.scene.static_wall_shape.push(0);
                self.scene.groups.static_wall += 1;
            }
        }
        self
    }

    /// A free box on its lattice.
    pub fn body(mut self, body: &FreeBox) -> Self {
        let mass = body.mass();
        let s = body.size * body.size;
        let inertia = mass / 12.0 * DVec3::new(s.y + s.z, s.z + s.x, s.x + s.y);
        let free = FreeBody {
            mass,
            inertia,
            weight_arm: DVec3::ZERO,
            velocity: body.velocity,
            angular_velocity: body.angular_velocity,
            locked_translation: [false; 3],
            locked_rotation: [false; 3],
        };
        let solid = lattice_box(
            self.scene.spacing,
            body.size,
            body.center,
            body.orientation,
            Drive::Free(free),
            format!("body {}", self.scene.solids.len()),
        );
        self.scene.solids.push(solid);
        self
    }

    /// A box that follows a table.
    pub fn moving_box(mut self, size: DVec3, center: DVec3, motion: Motion) -> Self {
        let name = format!("moving wall {}", self.scene.solids.len());
        let drive = Drive::Prescribed(motion);
        let solid = lattice_box(self.scene.spacing, size, center, DQuat::IDENTITY, drive, name);
        self.scene.solids.push(solid);
        self
    }

    /// The scene.
    pub fn build(mut self) -> Scene {
        let n = self.scene.position.len();
        self.scene.velocity = vec![DVec3::ZERO; n];
        self.scene.kind = vec![Kind::Wall; n];
        self.scene.solid = vec![0; n];
        self.scene
    }
}

/// A box of lattice particles: only its wall layer.
fn lattice_box(
    l0: f64,
    size: DVec3,
    position: DVec3,
    orientation: DQuat,
    drive: Drive,
    name: String,
) -> Solid {
    let count = (size / l0).round().max(DVec3::ONE);
    let step = size / count;
    let (mut offsets, mut areas, mut to_surface) = (vec![], vec![], vec![]);
    let n = count.as_i64vec3();
    for i in 0..n.x {
        for j in 0..n.y {
            for k in 0..n.z {
                let at = glam::I64Vec3::new(i, j, k);
                let mut outward = DVec3::ZERO;
                for axis in 0..3 {
                    if at[axis] == 0 {
                        outward[axis] -= 1.0;
                    }
                    if at[axis] == n[axis] - 1 {
                        outward[axis] += 1.0;
                    }
                }
                if outward != DVec3::ZERO {
                    offsets.push((at.as_dvec3() + 0.5) * step - 0.5 * size);
                    areas.push(outward * step.element_product() / step);
                    to_surface.push(outward * 0.5 * step);
                }
            }
        }
    }
    Solid {
        name,
        is_body: matches!(drive, Drive::Free(_)),
        shape: Shape::cuboid(size),
        position,
        orientation,
        frame: DQuat::IDENTITY,
        drive,
        wall_slots: 0..offsets.len(),
        dummy_slots: 0..0,
        shape_offset: DVec3::ZERO,
        wall_offset: offsets,
        dummy_offset: vec![],
        wall_edges: Edges::of_box(&areas, &to_surface),
        wall_area: areas,
        wall_to_surface: to_surface,
    }
}
