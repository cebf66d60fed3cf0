//! A small scene that uses every kernel: water in a box with an obstacle, a gate that moves, a body that
//! moves and turns under water. Built by hand, so that a fault of the scene builder cannot hide one here.
#![allow(dead_code)] // each test file uses a part

use glam::{DQuat, DVec3};
use seixo::body::Pose;
use seixo::case::Case;
use seixo::plan::Stage;
use seixo::scene::{Curve, Drive, Edges, FreeBody, Groups, Kind, Motion, Scene, Shape, Solid};

/// Spacing of the scene [m].
pub const SPACING: f64 = 0.02;

/// Numbers in -1..1 that depend on `k` alone.
pub fn noise(k: usize) -> f64 {
    let x = (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03;
    let x = (x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((x ^ (x >> 32)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A vector of such numbers; y is 0 in two dimensions.
pub fn noise_vector(k: usize, dimensions: u32) -> DVec3 {
    DVec3::new(noise(3 * k), if dimensions == 2 { 0.0 } else { noise(3 * k + 1) }, noise(3 * k + 2))
}

/// The case of [`scene`], with further lines for `[fluid]`.
pub fn case(dimensions: u32, fluid: &str) -> Case {
    let viscosity = if fluid.contains("viscosity") { "" } else { "viscosity = 1e-3\n" };
    let text = format!(
        "[run]\nspacing = {SPACING}\ntime_step = 1e-3\nend = 1.0\ndimensions = {dimensions}\n\
         [fluid]\n{viscosity}solver = {{ tolerance = 1e-4, preconditioner = \"jacobi\" }}\n{fluid}\n"
    );
    toml::from_str(&text).expect("the case of the tests is valid")
}

/// A box of lattice cells, upper corner excluded.
#[derive(Clone, Copy)]
struct Cells {
    min: [i32; 3],
    max: [i32; 3],
}

impl Cells {
    fn contains(&self, c: [i32; 3]) -> bool {
        (0..3).all(|k| c[k] >= self.min[k] && c[k] < self.max[k])
    }
    fn all(&self) -> impl Iterator<Item = [i32; 3]> + use<> {
        let (a, b) = (self.min, self.max);
        (a[0]..b[0]).flat_map(move |x| (a[1]..b[1]).flat_map(move |y| (a[2]..b[2]).map(move |z| [x, y, z])))
    }
    /// Outward normals of the faces that the cell touches, summed.
    fn normals(&self, c: [i32; 3], dimensions: u32) -> DVec3 {
        let along = |k: usize| f64::from(i32::from(c[k] == self.max[k] - 1) - i32::from(c[k] == self.min[k]));
        DVec3::new(along(0), if dimensions == 2 { 0.0 } else { along(1) }, along(2))
    }
    /// Whether the cell belongs to the outermost layer.
    fn outermost(&self, c: [i32; 3], dimensions: u32) -> bool {
        [0, 1, 2]
            .into_iter()
            .any(|k| (k != 1 || dimensions == 3) && (c[k] == self.min[k] || c[k] == self.max[k] - 1))
    }
}

/// The scene, `scale` times 16 cells long. The tank is open at the top.
pub fn scene(dimensions: u32, scale: i32) -> Scene {
    let d3 = dimensions == 3;
    let (nx, ny, nz) = (16 * scale, if d3 { 9 * scale } else { 1 }, 10 * scale);
    let layers = 3;
    let y = |a: i32, b: i32| if d3 { (a, b) } else { (0, 1) };
    let block =
        |x: (i32, i32), y: (i32, i32), z: (i32, i32)| Cells { min: [x.0, y.0, z.0], max: [x.1, y.1, z.1] };
    let tank = block((0, nx), (0, ny), (0, nz));
    let water = block((0, 9 * scale), (0, ny), (0, 7 * scale));
    let obstacle = block((nx - 4, nx - 1), y(2, 7), (0, 5));
    let gate = block((9 * scale, 9 * scale + 1), y(0, ny), (0, 8 * scale));
    let body = block((3, 6), y(3, 6), (2, 5));
    let center = |c: [i32; 3]| {
        let at = |k: usize| (f64::from(c[k]) + 0.5) * SPACING;
        DVec3::new(at(0), if d3 { at(1) } else { 0.0 }, at(2))
    };
    let (mut fluid, mut wall, mut dummy) = (Vec::new(), Vec::new(), Vec::new());
    let around = |c: i32, n: i32| (-c).max(c - n + 1).max(0);
    let (from, to) = if d3 { (-layers, ny + layers) } else { (0, 1) };
    for c in block((-layers, nx + layers), (from, to), (-layers, nz)).all() {
        let depth = around(c[0], nx).max(if d3 { around(c[1], ny) } else { 0 }).max((-c[2]).max(0));
        if depth == 1 {
            wall.push(center(c));
        } else if depth > 1 {
            dummy.push(center(c));
        } else if obstacle.contains(c) {
            if obstacle.outermost(c, dimensions) { wall.push(center(c)) } else { dummy.push(center(c)) }
        } else if water.contains(c) && !body.contains(c) {
            fluid.push(center(c));
        }
    }
    assert!(tank.contains([0, 0, 0]) && !fluid.is_empty());

    let (mut solids, mut moving_wall, mut moving_dummy) = (Vec::new(), Vec::new(), Vec::new());
    for (cells, is_body) in [(gate, false), (body, true)] {
        let (low, high) = (center(cells.min), center(cells.max.map(|m| m - 1)));
        let middle = 0.5 * (low + high);
        let start = (fluid.len() + moving_wall.len(), moving_dummy.len());
        let (mut wall_offset, mut dummy_offset) = (Vec::new(), Vec::new());
        let (mut wall_area, mut wall_to_surface) = (Vec::new(), Vec::new());
        for c in cells.all() {
            if cells.outermost(c, dimensions) {
                let normals = cells.normals(c, dimensions);
                moving_wall.push(center(c));
                wall_offset.push(center(c) - middle);
                wall_area.push(SPACING * SPACING * normals);
                wall_to_surface.push(0.5 * SPACING * normals);
            } else {
                moving_dummy.push(center(c));
                dummy_offset.push(center(c) - middle);
            }
        }
        let drive = if is_body {
            Drive::Free(FreeBody {
                mass: 0.1,
                inertia: DVec3::splat(1e-4),
                weight_arm: DVec3::ZERO,
                velocity: DVec3::ZERO,
                angular_velocity: DVec3::ZERO,
                locked_translation: [false; 3],
                locked_rotation: [false; 3],
            })
        } else {
            Drive::Prescribed(Motion::shift(Curve::new(vec![0.0, 1.0], vec![DVec3::ZERO, DVec3::Z])))
        };
        solids.push(Solid {
            name: if is_body { "body" } else { "gate" }.into(),
            is_body,
            shape: Shape::cuboid(high - low + SPACING),
            position: middle,
            shape_offset: DVec3::ZERO,
            orientation: DQuat::IDENTITY,
            frame: DQuat::IDENTITY,
            drive,
            wall_slots: start.0..fluid.len() + moving_wall.len(),
            // Moved behind the other groups below.
            dummy_slots: start.1..moving_dummy.len(),
            wall_offset,
            dummy_offset,
            wall_edges: Edges::of_box(&wall_area, &wall_to_surface),
            wall_area,
            wall_to_surface,
        });
    }
    let groups = Groups {
        fluid: fluid.len(),
        moving_wall: moving_wall.len(),
        static_wall: wall.len(),
        static_dummy: dummy.len(),
        moving_dummy: moving_dummy.len(),
    };
    let first = groups.moving_dummy_range().start;
    for s in &mut solids {
        s.dummy_slots = s.dummy_slots.start + first..s.dummy_slots.end + first;
    }
    let mut kind = Vec::new();
    let mut solid = Vec::new();
    for i in 0..groups.total() {
        let of = solids.iter().position(|s| s.wall_slots.contains(&i) || s.dummy_slots.contains(&i));
        let is_body = of.is_some_and(|k| solids[k].is_body);
        kind.push(match (i < groups.fluid, i < groups.pressure(), is_body) {
            (true, ..) => Kind::Fluid,
            (_, true, true) => Kind::BodyWall,
            (_, true, false) => Kind::Wall,
            (_, false, true) => Kind::BodyDummy,
            (_, false, false) => Kind::Dummy,
        });
        solid.push(of.map_or(0, |k| k as u32 + 1));
    }
    let margin = f64::from(layers) * SPACING;
    let inner = DVec3::new(f64::from(nx), f64::from(ny), f64::from(2 * nz)) * SPACING;
    let low = DVec3::new(-margin, if d3 { -margin } else { -0.5 * SPACING }, -margin);
    let high = inner + DVec3::new(margin, if d3 { margin } else { 0.0 }, 0.0);
    let normal = DVec3::Z;
    let position = [fluid, moving_wall, wall, dummy, moving_dummy].concat();
    Scene {
        dimensions,
        spacing: SPACING,
        node: 0.5 * DVec3::new(SPACING, if d3 { SPACING } else { 0.0 }, SPACING),
        gravity: DVec3::new(0.0, 0.0, -9.806_65),
        velocity: vec![DVec3::ZERO; position.len()],
        position,
        kind,
        solid,
        static_wall_normal: vec![normal; groups.static_wall],
        static_wall_shape: vec![0; groups.static_wall],
        groups,
        reserve: 0,
        openings: Vec::new(),
        solids,
        walls: Vec::new(),
        domain: (low, high),
        periodic: Default::default(),
        depth: f64::from(7 * scale) * SPACING,
        filled: false,
        full: None,
        uneven: false,
        notes: Vec::new(),
    }
}

/// Poses of the two solids at time `t`: the gate rises, the body drifts and turns.
pub fn poses(scene: &Scene, t: f64) -> Vec<Pose> {
    let d3 = scene.dimensions == 3;
    let spin = if d3 { DVec3::new(0.5, 1.0, -0.7) } else { DVec3::Y };
    scene
        .solids
        .iter()
        .map(|s| {
            let velocity = if s.is_body { DVec3::new(0.3, 0.0, 0.15) } else { DVec3::Z };
            let angular_velocity = if s.is_body { 3.0 * spin } else { DVec3::ZERO };
            let turn = angular_velocity * t;
            Pose {
                position: s.position + velocity * t,
                orientation: DQuat::from_scaled_axis(turn),
                velocity,
                angular_velocity,
            }
        })
        .collect()
}

/// The same with the body 0.3 spacings above the floor, where it catches a layer of the water at `position`; what else
/// of it the body meets is put into the air.
pub fn on_the_floor(scene: &Scene, position: &mut [DVec3]) -> Vec<Pose> {
    let (mut poses, l0) = (poses(scene, 0.0), scene.spacing);
    poses[1].position.z = (1.5 + 0.3) * l0;
    let at = poses[1].position;
    for x in &mut position[..scene.groups.fluid] {
        if (*x - at).abs().max_element() < 1.8 * l0 {
            x.z = if x.z < l0 { 0.15 * l0 } else { x.z + 0.6 * (scene.domain.1 - scene.domain.0).z };
        }
    }
    poses
}

/// The stages of a step up to, and not including, `end`, in order.
pub fn stages_before(end: Stage) -> impl Iterator<Item = Stage> {
    Stage::ALL.into_iter().take_while(move |&s| s != end)
}
