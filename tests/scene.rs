//! The scene: particle counts, geometry of solids, checks at t = 0.

use glam::DVec3;
use seixo::case::{Case, file};
use seixo::scene::{Drive, Kind, Scene};
use std::f64::consts::PI;
use std::path::Path;

fn case(name: &str, sets: &[&str]) -> Case {
    let path = Path::new(crate::common::ROOT).join("cases").join(name).with_extension("toml");
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    file::load(&path, None, &sets).unwrap_or_else(|e| panic!("{e}")).case
}

fn build(text: &str) -> Result<Scene, String> {
    let (case, _, _) = file::parse("test.toml", text.to_owned(), &[]).unwrap_or_else(|e| panic!("{e}"));
    Scene::build(&case).map_err(|e| e.to_string())
}

fn count(scene: &Scene, kind: Kind) -> usize {
    scene.kind.iter().filter(|&&k| k == kind).count()
}

/// The counts of case 4.3 at four spacings; 0.0075 m is the paper's "about 580 thousand".
#[test]
fn counts_of_the_dam_break() {
    // spacing, fluid, static wall, static dummy, gate
    let rows = [
        ("0.03", 3_468, 7_429, 16_188, 221),
        ("0.02", 11_250, 16_279, 34_454, 1_000),
        ("0.015", 25_047, 28_289, 59_074, 2_673),
    ];
    for (spacing, fluid, wall, dummy, gate) in rows {
        let scene = Scene::build(&case("dam_break_transport", &[&format!("run.spacing={spacing}")])).unwrap();
        let g = scene.groups;
        assert_eq!((g.fluid, g.static_wall, g.static_dummy), (fluid, wall, dummy), "l0 = {spacing}");
        let s = &scene.solids[1];
        assert_eq!(s.wall_slots.len() + s.dummy_slots.len(), gate, "gate at l0 = {spacing}");
    }
}

#[test]
fn counts_of_the_dam_break_at_the_papers_spacing() {
    let start = std::time::Instant::now();
    let scene = Scene::build(&case("dam_break_transport", &[])).unwrap();
    println!("built in {:?}", start.elapsed());
    for note in &scene.notes {
        println!("{note}");
    }
    let g = scene.groups;
    assert_eq!(g.fluid, 210_983);
    assert_eq!(g.total(), 577_084);
    assert_eq!(count(&scene, Kind::BodyWall) + count(&scene, Kind::BodyDummy), 343);
    assert_eq!(count(&scene, Kind::Wall), 121_873);
    assert_eq!(count(&scene, Kind::Dummy), 243_885);
    assert_eq!(scene.position.len(), g.total());
    // 47 layers of 0.0075 m.
    assert!((scene.depth - 0.3525).abs() < 1e-12);
    // The gate moves from the first step on.
    let gate = &scene.solids[1];
    assert!(scene.velocity[gate.wall_slots.start].distance(DVec3::new(0.0, 0.0, 0.11)) < 1e-12);
}

#[test]
fn a_driven_body_that_is_taken_through_a_wall_is_told_of() {
    let text = |motion: &str, open: &str| {
        format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n{open}\n\
             [[body]]\nname = \"ram\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.5, 0.5, 0.5]\n{motion}\n[contact]\nspring = 1e4\n"
        )
    };
    let told = |motion: &str, open: &str| {
        let scene = build(&text(motion, open)).unwrap_or_else(|e| panic!("{e}"));
        scene.notes.into_iter().filter(|n| n.contains("`ram`")).collect::<Vec<_>>()
    };
    let ahead = "motion = [[0, 0, 0, 0], [1, 0.6, 0, 0]]";
    assert_eq!(
        told(ahead, ""),
        ["body `ram`: its motion takes it 0.2000 m into the wall `tank.x_max`, which does not stop it"]
    );
    assert!(told(ahead, "open = [\"x_max\"]").is_empty());
    assert!(told("motion = [[0, 0, 0, 0], [1, 0.4, 0, 0]]", "").is_empty());
    let turned = "rotation = [[0, 0, 0, 0], [1, 90, 0, 0]]\nmotion = [[0, 0, 0, 0], [1, 0, 0, 0.39]]";
    assert!(told(turned, "").is_empty());
}

/// Groups, slots and offsets agree with each other.
#[test]
fn slots_hold_their_solids() {
    let scene = Scene::build(&case("dam_break_transport", &["run.spacing=0.03"])).unwrap();
    for (k, solid) in scene.solids.iter().enumerate() {
        let wall = solid.wall_slots.clone().zip(&solid.wall_offset);
        for (slot, &offset) in wall.chain(solid.dummy_slots.clone().zip(&solid.dummy_offset)) {
            assert_eq!(scene.solid[slot], k as u32 + 1);
            assert!(scene.position[slot].distance(solid.position + solid.orientation * offset) < 1e-12);
        }
        assert!(scene.groups.moving_wall_range().contains(&solid.wall_slots.start));
        assert_eq!(solid.wall_area.len(), solid.wall_offset.len());
        assert_eq!(solid.wall_to_surface.len(), solid.wall_offset.len());
    }
    assert_eq!(scene.static_wall_normal.len(), scene.groups.static_wall);
    for (slot, normal) in scene.groups.static_wall_range().zip(&scene.static_wall_normal) {
        assert_eq!(scene.kind[slot], Kind::Wall);
        assert!((normal.length() - 1.0).abs() < 1e-12 || *normal == DVec3::ZERO);
    }
    // No two particles of the lattice in one place.
    let mut keys: Vec<[i64; 3]> = scene.position[..scene.groups.fluid]
        .iter()
        .chain(&scene.position[scene.groups.static_range()])
        .map(|p| p.to_array().map(|x| (x / 0.03 * 100.0).round() as i64))
        .collect();
    let all = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), all);
}

/// A cube's faces: area vectors close and sum to the true faces, corners point to the true corners.
#[test]
fn area_and_surface_of_a_cube() {
    let scene = Scene::build(&case("resting_cube", &[])).unwrap();
    let cube = &scene.solids[0];
    assert_eq!((cube.wall_offset.len(), cube.dummy_offset.len()), (296, 208)); // 8^3 - 2^3 hollow
    let total: DVec3 = cube.wall_area.iter().copied().sum();
    assert!(total.length() < 1e-14);
    let up: f64 = cube.wall_area.iter().map(|a| a.z.max(0.0)).sum();
    assert!((up - 0.04).abs() < 1e-12);
    let half = cube.shape.as_cuboid().unwrap().half;
    for (&offset, &to) in cube.wall_offset.iter().zip(&cube.wall_to_surface) {
        let on = (offset + to).abs();
        assert!((on - half).abs().min_element() < 1e-12 && (on - half).max_element() < 1e-12);
    }
    let Drive::Free(free) = &cube.drive else { panic!("a cube is free") };
    assert!((free.mass - 21.28).abs() < 1e-12);
    assert!((free.inertia - DVec3::splat(21.28 * 0.04 / 6.0)).length() < 1e-12);
}

/// `standing` with the law "paper": aligned lattices end exactly d_c apart.
#[test]
fn a_standing_cube_starts_at_the_contact_distance() {
    let scene = Scene::build(&case("resting_cube", &[])).unwrap();
    let d_c = 1.5f64.sqrt() * 0.025;
    let lowest =
        scene.solids[0].wall_slots.clone().map(|i| scene.position[i].z).fold(f64::INFINITY, f64::min);
    // The floor's wall layer lies at -l0/2.
    assert!((lowest + 0.0125 - d_c).abs() < 1e-14, "{lowest}");
    assert!(scene.notes.iter().any(|n| n.contains("lifted by 0.00561")), "{:?}", scene.notes);
}

/// `standing` with the law "smooth": surfaces touch, also on an incline.
#[test]
fn a_standing_block_touches_the_incline() {
    let scene = Scene::build(&case("sliding_block", &["body.0.center=[-0.68, 0.0, 0.70]"])).unwrap();
    let n = DVec3::new(1.0, 0.0, 1.0).normalize();
    let block = &scene.solids[0];
    assert!((block.position.dot(n) - 0.05).abs() < 1e-9);
    assert!((block.position.x + 0.68).abs() < 1e-12, "lifted against gravity only");
    let wall = &scene.walls[0];
    assert!((wall.axes.z_axis - n).length() < 1e-12);
    assert!(
        ((wall.center + wall.axes.z_axis * wall.half.z).dot(n)).abs() < 1e-12,
        "surface through the origin"
    );
    for (slot, normal) in scene.groups.static_wall_range().zip(&scene.static_wall_normal) {
        assert!((scene.position[slot].dot(n) + 0.0125).abs() < 1e-12);
        assert!((*normal - n).length() < 1e-12);
    }
}

/// One that is to stand and hangs is told of, with the way down to what is under it; a later body may be that.
#[test]
fn a_standing_body_that_hangs_is_told_of() {
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[[plane]]\nname = \"slope\"\ncenter = [0, 0, 0]\n\
                normal = [0.6, 0, 0.8]\nalong = [0.8, 0, -0.6]\nsize = [3, 1.2]\n[contact]\nspring = 1e5\n";
    let body = |name: &str, shape: &str, z: f64, standing: bool| {
        format!(
            "[[body]]\nname = \"{name}\"\n{shape}\ncenter = [0, 0, {z}]\ndensity = 1000\nstanding = {standing}\n"
        )
    };
    let told = |bodies: &[String], law: &str| {
        let scene = build(&format!("{text}law = \"{law}\"\n{}", bodies.concat())).unwrap();
        scene.notes.into_iter().filter(|n| n.contains("stands on nothing")).collect::<Vec<_>>()
    };
    // A ball of radius r touches the slope r / 0.8 above it, a cube of half edge h 1.4 h / 0.8.
    for (shape, touches) in
        [("shape = \"sphere\"\nradius = 0.06", 0.075), ("size = [0.12, 0.12, 0.12]", 0.105)]
    {
        let [high, low] = [0.03, -0.01].map(|off| body("b", shape, touches + off, true));
        let notes = told(&[high], "smooth");
        assert!(notes.len() == 1 && notes[0].contains("wall `slope` 0.0300"), "{notes:?}");
        assert_eq!(told(&[low], "smooth"), [""; 0]);
        assert_eq!(told(&[body("b", shape, touches + 0.03, false)], "smooth"), [""; 0]);
        assert_eq!(told(&[body("b", shape, touches + 0.03, true)], "paper").len(), 1);
    }
    let cube = |name: &str, z: f64, standing: bool| body(name, "size = [0.12, 0.12, 0.12]", z, standing);
    assert_eq!(told(&[cube("upper", 0.25, true), cube("lower", 0.13, true)], "smooth").len(), 1);
}

#[test]
fn tank_faces_as_boxes() {
    let scene = Scene::build(&case("hydrostatic", &[])).unwrap();
    let names: Vec<&str> = scene.walls.iter().map(|w| w.name.as_str()).collect();
    assert_eq!(names, ["tank.x_min", "tank.x_max", "tank.y_min", "tank.y_max", "tank.z_min"]);
    let floor = &scene.walls[4];
    assert!((floor.center + floor.half - DVec3::new(0.325, 0.325, 0.0)).length() < 1e-12);
    assert!((floor.center - floor.half - DVec3::new(-0.075, -0.075, -0.075)).length() < 1e-12);
    assert_eq!(scene.groups.fluid, 2000);
    assert!((scene.depth - 0.5).abs() < 1e-12);
    // Headroom of four depths over the rim.
    assert!(scene.domain.1.z > 2.5);
}

#[test]
fn two_dimensions_lie_in_one_plane() {
    let scene = Scene::build(&case("dam_break_2d", &[])).unwrap();
    assert!(scene.position.iter().all(|p| p.y == 0.0));
    assert_eq!(scene.groups.fluid, 20 * 40);
    // Floor and two sides, one layer: 80 + 2 + 2 x 80.
    assert_eq!(scene.groups.static_wall, 242);
}

const POOL: &str = "
[run]
spacing = 0.1
time_step = 1e-3
end = 1.0
[tank]
min = [0, 0, 0]
max = [1, 1, 1]
OPEN
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [1, 1, 0.5]
[contact]
spring = 1e4
";

fn pool(open: &str, more: &str) -> Result<Scene, String> {
    build(&(POOL.replace("OPEN", &format!("open = {open}")) + more))
}

#[test]
fn problems_at_the_start_name_who_and_what_to_do() {
    let body = |center: &str, more: &str| {
        format!("[[body]]\nname = \"b\"\nsize = [0.3, 0.3, 0.3]\ndensity = 500\ncenter = {center}\n{more}\n")
    };
    let two = body("[0.5, 0.5, 0.75]", "") + &body("[0.6, 0.5, 1.0]", "").replace("\"b\"", "\"c\"");
    let table = [
        (
            pool("[\"z_max\"]", &body("[0.5, 0.5, 0.5]", "")),
            &["body `b`", "32 fluid particles", "displaces_fluid = true"][..],
        ),
        (pool("[\"z_max\"]", &body("[0.1, 0.5, 0.8]", "")), &["body `b` overlaps wall `tank.x_min` by 0.05"]),
        (
            pool("[\"z_max\"]", &body("[0.1, 0.12, 0.8]", "")),
            &[
                "overlaps wall `tank.x_min` by 0.050000 m and wall `tank.y_min` by 0.030000 m",
                "its center by (0.050001, 0.030001, 0) m",
            ],
        ),
        (
            pool("[\"z_max\"]", &two),
            &["body `c` overlaps body `b` by 0.05", "standing = true", "raise its center by 0.05"],
        ),
        (pool("[\"z_max\"]", &body("[0.5, 0.5, 9.0]", "")), &[]),
        (pool("[\"z_max\"]", &body("[0.1, 0.5, 0.8]", "standing = true")), &["`tank.x_min`", "move it away"]),
        (
            pool("[\"z_max\"]", "[[gauge.pressure]]\nname = \"p\"\npoint = [0.5, 0.5, 0.5]"),
            &["gauge.pressure `p`", "nearest stands at"],
        ),
        (pool("[\"x_max\"]", ""), &["water can leave through tank.x_max"]),
        (pool("[\"z_min\"]", ""), &["water can leave through tank.z_min"]),
        (
            build(
                &POOL.replace("max = [1, 1, 0.5]", "max = [1, 1, 1.5]").replace("OPEN", "open = [\"z_max\"]"),
            ),
            &["outside of the tank"],
        ),
    ];
    for (result, words) in table {
        match result {
            Ok(_) => assert!(words.is_empty(), "no error with {words:?}"),
            Err(message) => {
                assert!(!words.is_empty(), "{message}");
                for word in words {
                    assert!(message.contains(word), "`{word}` is not in: {message}");
                }
            }
        }
    }
}

#[test]
fn without_gravity_nobody_is_told_of_a_lift_and_a_small_overlap_is_told_as_such() {
    let with = |gravity: f64, l0: f64| {
        let (edge, low) = (5.0 * l0, 2.45 * l0);
        let text = format!(
            "[run]\nspacing = {l0:e}\ntime_step = 1e-6\nend = 1e-3\ngravity = [0, 0, {gravity}]\n[contact]\nspring = 1\n\
             [tank]\nmin = [0, 0, 0]\nmax = [{0:e}, {0:e}, {0:e}]\n[[body]]\nname = \"b\"\nsize = [{edge:e}, {edge:e}, {edge:e}]\n\
             center = [{edge:e}, {edge:e}, {low:e}]\ndensity = 2000\n",
            10.0 * l0
        );
        build(&text).unwrap_err()
    };
    let weightless = with(0.0, 0.02);
    assert!(weightless.contains("its center by 0.00100") && !weightless.contains("lifting"), "{weightless}");
    let tiny = with(-9.81, 2e-7);
    assert!(tiny.contains("raise its center by 1.01e-8 m"), "{tiny}");
}

#[test]
fn water_without_walls_needs_weightlessness() {
    let text = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\nGRAVITY\n[fluid]\n[[fluid.block]]\nmin = [0,0,0]\nmax = [1,1,1]\n";
    let message = build(&text.replace("GRAVITY", "")).unwrap_err();
    assert!(message.contains("nothing that holds it"), "{message}");
    let drop = build(&text.replace("GRAVITY", "gravity = [0, 0, 0]")).unwrap();
    assert_eq!(drop.groups.fluid, 1000);
}

#[test]
fn a_floating_body_makes_room() {
    let scene = Scene::build(&case("floating_cube", &[])).unwrap();
    // 30 x 30 x 15 less three layers of 6 x 6.
    assert_eq!(scene.groups.fluid, 13_500 - 108);
    assert!(scene.notes.iter().any(|n| n.contains("displaces 108")), "{:?}", scene.notes);
}

#[test]
fn a_beach_gives_way_to_the_tank() {
    let beach = "[[plane]]\nname = \"beach\"\ncenter = [0.9, 0.5, 0.1]\nnormal = [-1, 0, 1]\nalong = [1, 0, 1]\nsize = [0.6, 1.0]\n";
    let scene = pool("[\"z_max\"]", beach).unwrap();
    assert!(
        scene.notes.iter().any(|n| n.starts_with("plane `beach`") && n.contains("left out")),
        "{:?}",
        scene.notes
    );
    assert!(scene.groups.fluid < 500);
    // Nothing stands closer than half a spacing to anything else.
    for (i, p) in scene.position.iter().enumerate() {
        for q in &scene.position[..i] {
            assert!(p.distance(*q) > 0.049, "{p} and {q}");
        }
    }
    // However far it goes on beyond the tank, its rows end at the tank's walls.
    let wider = pool("[\"z_max\"]", &beach.replace("[0.6, 1.0]", "[1.0, 1.4]")).unwrap();
    let sorted = |scene: &Scene| {
        let near = scene
            .position
            .iter()
            .filter(|p| p.cmpgt(DVec3::splat(-0.3)).all() && p.cmplt(DVec3::splat(1.3)).all());
        let mut rows: Vec<String> = near.map(|p| format!("{p:.6}")).collect();
        rows.sort();
        rows
    };
    let here = sorted(&pool("[\"z_max\"]", &beach.replace("[0.6, 1.0]", "[0.8, 1.2]")).unwrap());
    assert!(sorted(&wider) == here, "{} and {}", wider.position.len(), here.len());
}

#[test]
fn user_domains_must_hold_everything() {
    let domain = POOL
        .replace("OPEN", "open = [\"z_max\"]")
        .replace("end = 1.0", "end = 1.0\ndomain = [[0, 0, 0], [1, 1, 2]]");
    let message = build(&domain).unwrap_err();
    assert!(message.contains("run.domain: wall `tank.x_min` reaches from x = -0.3"), "{message}");
}

#[test]
fn rounded_lengths_are_noted() {
    let scene = Scene::build(&case("dam_break_transport", &[])).unwrap();
    assert!(
        scene.notes.iter().any(
            |n| n.contains("tank: length x 3.5000 m becomes 3.5025 m") && n.contains("at spacing 0.0075")
        ),
        "{:?}",
        scene.notes
    );
}

/// With the law "paper" a cube set down naturally, one spacing above the floor's particles, would be thrown up.
#[test]
fn contact_at_the_start_is_refused() {
    let message = Scene::build(&case("resting_cube", &["body.0.standing=false"])).unwrap_err().to_string();
    for word in [
        "body `cube` overlaps wall `tank.z_min`",
        "closer than d_c",
        "by 0.005619 m",
        "standing = true",
        "raise its center by 0.005619 m",
    ] {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    let raised = case("resting_cube", &["body.0.standing=false", "body.0.center=[0.4, 0.4, 0.105619]"]);
    assert!(Scene::build(&raised).is_ok());
}

/// Bodies stand on bodies, whatever the law.
#[test]
fn bodies_stand_on_bodies() {
    let second = "[[body]]\nname = \"upper\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.4, 0.4, 0.3]\ndensity = 1000\nstanding = true\n";
    for (law, gap) in [("paper", 1.5f64.sqrt() * 0.025 - 0.025), ("smooth", 0.0)] {
        let text =
            std::fs::read_to_string(Path::new(crate::common::ROOT).join("cases/resting_cube.toml")).unwrap();
        let text = text
            .replace("law = \"paper\"", &format!("law = \"{law}\""))
            .replace("[contact]", &format!("{second}\n[contact]"));
        let scene = build(&text).unwrap_or_else(|e| panic!("{law}: {e}"));
        let z = [scene.solids[0].position.z, scene.solids[1].position.z];
        assert!((z[0] - 0.1 - gap).abs() < 1e-9 && (z[1] - 0.3 - 2.0 * gap).abs() < 1e-9, "{law}: {z:?}");
    }
}

/// A cone's base is a quarter of its height below its centroid, and its tip three: a domain holds the cone and not what it would be about its middle.
#[test]
fn a_cone_fits_a_domain_that_ends_below_its_base() {
    let within = |floor: f64| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.02\ndomain = [[-0.2, -0.2, {floor}], [0.8, 0.5, 1.0]]\n\
             [[body]]\nname = \"cone\"\nshape = \"cone\"\nradius = 0.1\nheight = 0.4\ncenter = [0.3, 0.15, 0.101]\ndensity = 500\n\
             [contact]\nspring = 1e5\n"
        );
        build(&text).map(|_| ())
    };
    assert_eq!(within(-0.1), Ok(()));
    let cut = within(0.01);
    assert!(cut.as_ref().is_err_and(|e| e.contains("from z = 0.0010 to 0.4010 m")), "{cut:?}");
}

#[test]
fn where_ballast_and_hinges_are_changes_nothing_of_where_a_body_is_found_to_be() {
    // In a trough clear of its sides, and a cylinder that stands on its bottom: the points of the surface were counted from the centre of mass.
    let trough = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\n[contact]\nspring = 2e4\n\
                  [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.6, 0.6]\nopen = [\"z_max\"]\n\
                  [[obstacle]]\nname = \"u\"\nshape = \"prism\"\nheight = 0.4\nposition = [0, 0.1, 0]\n\
                  section = [[0.1, 0], [0.5, 0], [0.5, 0.4], [0.44, 0.4], [0.44, 0.06], [0.16, 0.06], [0.16, 0.4], [0.1, 0.4]]\n";
    let boxed =
        "[[body]]\nname = \"b\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.27, 0.3, 0.165]\ndensity = 500\n";
    let round = "[[body]]\nname = \"b\"\nshape = \"cylinder\"\nradius = 0.08\nheight = 0.2\naxis = [0, 1, 0]\n\
                 center = [0.3, 0.3, 0.12]\ndensity = 500\nstanding = true\n";
    for more in ["", "mass_offset = [0.04, 0, 0]\n", "hinge = { at = [0.27, 0.3, 0.26], axis = \"y\" }\n"] {
        let found = build(&format!("{trough}{boxed}{more}"));
        assert!(found.is_ok(), "{more}: {:?}", found.err());
    }
    let height = |more: &str| {
        let scene = build(&format!("{trough}{round}{more}")).expect("it builds");
        let solid = scene.solids.iter().find(|s| s.name == "b").expect("the cylinder");
        solid.shape_center().z
    };
    let exact = height("");
    for more in ["mass_offset = [0, 0, 0.05]\n", "mass_offset = [0, 0, -0.05]\n"] {
        assert!((height(more) - exact).abs() < 1e-3, "{more}: {} for {exact}", height(more));
    }
}

#[test]
fn bodies_displace_their_volume_wherever_they_lie() {
    let water = |body: &str| {
        let body = body.to_owned()
            + if body.is_empty() { "" } else { "name = \"b\"\ndensity = 500\ndisplaces_fluid = true\n" };
        let scene = build(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\n[contact]\nspring = 2e4\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\n{body}"
        ))
        .expect("it builds");
        scene.water() as f64
    };
    let full = water("");
    for (form, volume) in [
        ("size = [0.08, 0.06, 0.06]", 0.08 * 0.06 * 0.06),
        ("shape = \"sphere\"\nradius = 0.04", 4.0 / 3.0 * PI * 0.04_f64.powi(3)),
        ("shape = \"cylinder\"\nradius = 0.035\nheight = 0.07", PI * 0.035 * 0.035 * 0.07),
    ] {
        let (mut sum, mut places) = (0.0, 0.0);
        for (off, angle) in
            [(0.0, 0.0), (0.003, 0.0), (0.005, 0.0), (0.01, 0.0), (0.004, 15.0), (0.008, 40.0)]
        {
            let x = 0.2 + off;
            let displaced = full
                - water(&format!(
                    "[[body]]\n{form}\ncenter = [{x}, {x}, 0.2]\n\
                     orientation = {{ axis = [0.3, 0.2, 1], angle_deg = {angle} }}\n"
                ));
            println!("{form}, {off} m off, {angle}: {:.3}", displaced * 8e-6 / volume);
            // Of some 35 particles, of which those that mirror each other go together: 4.5 % of a ball in the middle of cells.
            assert!((displaced * 8e-6 / volume - 1.0).abs() < 0.05, "{form}, {off}, {angle}: {displaced}");
            sum += displaced * 8e-6 / volume;
            places += 1.0;
        }
        // The box had 1.08, when an edge counted as a plane through its cells.
        assert!((sum / places - 1.0).abs() < 0.02, "{form}: {}", sum / places);
    }
}

#[test]
fn what_a_body_half_a_spacing_off_the_lattice_displaces_has_its_symmetries() {
    // Its faces run through the middles of cells, of which half go: which ones a number of their places alone said.
    for (dimensions, size) in [(2, 0.1), (2, 0.14), (3, 0.06), (3, 0.1)] {
        let scene = build(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.2\ndimensions = {dimensions}\n[contact]\nspring = 2e4\n\
             [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\n\
             [[body]]\nname = \"b\"\nsize = [{size}, {size}, {size}]\ncenter = [0.2, 0.2, 0.2]\ndensity = 500\n\
             displaces_fluid = true\n"
        ))
        .expect("it builds");
        let water = &scene.position[..scene.water()];
        let mean = water.iter().map(|x| *x - 0.2).sum::<DVec3>() / water.len() as f64;
        println!("{dimensions} dimensions, {size} m: {} particles, mean {mean}", water.len());
        assert!(mean.x.abs() < 1e-12, "{mean}");
        assert!(dimensions == 2 || mean.y.abs() < 1e-12, "{mean}");
    }
}

#[test]
fn water_does_not_run_into_an_open_face_without_a_word() {
    let scene = |min: &str, max: &str, more: &str| {
        build(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.2, 0.6]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.2, 0.3]\n\
             [[obstacle]]\nname = \"bar\"\nmin = {min}\nmax = {max}\n{more}"
        ))
    };
    let told = |min: &str, max: &str, more: &str| scene(min, max, more).expect("it builds").notes.join("; ");
    let below = "open = [\"z_min\"]";
    // In the water, on the floor, and in the air.
    let why = scene("[0.2, 0, 0.1]", "[0.4, 0.2, 0.2]", below).expect_err("water stands below it");
    assert!(why.contains("obstacle `bar`: water stands before 100 cells of its open face z_min"), "{why}");
    assert!(!told("[0.2, 0, 0]", "[0.4, 0.2, 0.1]", below).contains("open face"));
    let note = told("[0.6, 0, 0.1]", "[0.8, 0.2, 0.2]", below);
    assert!(note.contains("obstacle `bar`: nothing covers its open face z_min"), "{note}");
    // Its sides lie against the tank's.
    assert!(!told("[0.2, 0, 0]", "[0.4, 0.2, 0.1]", "open = [\"y_min\", \"y_max\"]").contains("open face"));
    // One box on the other covers it.
    let on = "open = [\"z_max\"]\n[[obstacle]]\nname = \"top\"\nmin = [0.2, 0, 0.1]\nmax = [0.4, 0.2, 0.2]\n";
    assert!(!told("[0.2, 0, 0]", "[0.4, 0.2, 0.1]", on).contains("open face"));
    let wall = "[[moving_wall]]\nname = \"gate\"\nmin = [0.5, 0, 0]\nmax = [0.54, 0.2, 0.4]\nopen = [\"x_min\"]\n\
                motion = [[0, 0, 0, 0], [1, 0, 0, 0.3]]\n";
    let why = scene("[0.8, 0, 0]", "[0.9, 0.2, 0.1]", wall).expect_err("water stands beside it");
    assert!(
        why.contains("moving wall `gate`: water stands before 150 cells of its open face x_min"),
        "{why}"
    );
}

#[test]
fn tables_that_begin_or_stop_with_a_jump_are_told_of() {
    let told = |rows: &str, more: &str| {
        let scene = build(&format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 3.0\n\
             [tank]\nmin = [0, 0, 0]\nmax = [2, 0.5, 0.6]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0.5, 0, 0]\nmax = [2, 0.5, 0.3]\n\
             [[moving_wall]]\nname = \"paddle\"\nmin = [0.4, 0, 0]\nmax = [0.5, 0.5, 0.5]\nmotion = [{rows}]\n{more}"
        ));
        scene.expect("it builds").notes.into_iter().filter(|n| n.contains("its table")).collect::<Vec<_>>()
    };
    let stops = told("[0,0,0,0],[0.5,0.02,0,0],[1,0.08,0,0],[1.5,0.2,0,0]", "");
    assert_eq!(stops.len(), 1, "{stops:?}");
    assert!(stops[0].starts_with("moving wall `paddle`: its table stops from 0.3"), "{stops:?}");
    assert!(stops[0].contains("at t = 1.5 s within a step (it goes at up to 0.3"), "{stops:?}");
    // Two rows are a constant velocity, as they say; two of one place at either end are rest.
    assert!(told("[0,0,0,0],[1,0.1,0,0]", "").is_empty());
    assert!(told("[0,0,0,0],[0.5,0,0,0],[1,0.05,0,0],[1.5,0.1,0,0],[2,0.1,0,0]", "").is_empty());
    // What happens after the end does not happen.
    assert!(told("[0,0,0,0],[1,0,0,0],[2,0.1,0,0],[3,0.2,0,0],[4,0.3,0,0]", "").is_empty());
    let turns = told("[0,0,0,0],[9,0,0,0]", "rotation = [[0,0,0,0],[0.5,0,0,0],[1,0,1,0],[1.5,0,2,0]]\n");
    assert!(turns.len() == 1 && turns[0].contains("stops from 1.333 degrees/s"), "{turns:?}");
}

#[test]
fn a_velocity_gauge_inside_a_solid_is_told_of() {
    let told = |at: &str| {
        let scene = build(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.2, 0.6]\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.2, 0.3]\n\
             [[obstacle]]\nname = \"bar\"\nmin = [0.4, 0, 0.1]\nmax = [0.6, 0.2, 0.2]\n\
             [[obstacle]]\nname = \"pipe\"\nshape = \"cylinder\"\nradius = 0.06\nheight = 0.2\ncenter = [0.8, 0.1, 0.15]\n\
             [[gauge.velocity]]\nname = \"v\"\npoint = {at}\n"
        ));
        scene
            .expect("it builds")
            .notes
            .into_iter()
            .filter(|n| n.contains("gauge.velocity"))
            .collect::<Vec<_>>()
    };
    let inside = told("[0.5, 0.1, 0.15]");
    assert!(inside.len() == 1 && inside[0].contains("`v`: it lies inside `bar`"), "{inside:?}");
    assert!(told("[0.8, 0.1, 0.15]").iter().any(|n| n.contains("inside `pipe`")));
    for at in ["[0.5, 0.1, 0.25]", "[0.5, 0.1, 0.2]", "[0.2, 0.1, 0.0]", "[0.2, 0.1, 0.5]"] {
        assert!(told(at).is_empty(), "{at}: {:?}", told(at));
    }
}
