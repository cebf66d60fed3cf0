//! Prisms, in space and as sections in the plane: the water around them, the force on them, their contact, what is wrong with them.

use crate::common::dry::{Dry, G};
use crate::common::{case, cpu_simulation, mean_and_deviation, processors};
use glam::DVec3;
use seixo::error::Error;
use seixo::scene::{Kind, Scene};
use seixo::shape::Shape;
use seixo::simulation::Simulation;

const L0: f64 = 0.02;
/// A breakwater with a berm and a slot: not convex.
const SECTION: &str =
    "[[0, 0], [0.5, 0], [0.42, 0.1], [0.34, 0.1], [0.34, 0.03], [0.24, 0.03], [0.24, 0.18], [0.18, 0.18]]";
/// Its area [m2].
const AREA: f64 = 0.042;

/// Still water 0.8 m long and 0.24 m deep, in the plane or 0.16 m wide, with `solids` in it.
fn still(dimensions: u32, solids: &str) -> String {
    format!(
        "[run]\nspacing = {L0}\ntime_step = 1e-3\nend = 1\ndimensions = {dimensions}\n\
         [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0.16, 0.24]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.16, 0.34]\nopen = [\"z_max\"]\n{solids}"
    )
}

fn breakwater(orientation: &str) -> String {
    format!(
        "[[obstacle]]\nname = \"it\"\nshape = \"prism\"\nsection = {SECTION}\nheight = 0.16\nposition = [0.15, 0, 0]\n{orientation}"
    )
}

#[test]
fn water_stands_still_around_a_section_that_is_not_convex_and_fills_the_rest() {
    for dimensions in [2, 3] {
        let case = case(&still(dimensions, &breakwater("")));
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{e}"));
        let width = if dimensions == 2 { L0 } else { 0.16 };
        let solid = &scene.solids[0];
        assert!((solid.shape.volume() / (AREA * width) - 1.0).abs() < 1e-9, "{}", solid.shape.volume());
        let mut sim = cpu_simulation(&case, scene);
        let water = |sim: &Simulation| sim.scene.position[..sim.scene.groups.fluid].to_vec();
        let filled = water(&sim).len() as f64 * L0 * L0 * L0 + AREA * width;
        println!("{dimensions}D: water and solid {filled:.6} m3 for {:.6}", 0.192 * width);
        assert!((filled / (0.192 * width) - 1.0).abs() < 5e-3, "{filled}");
        let mut nearest = f64::INFINITY;
        let solid = &sim.scene.solids[0];
        for slot in solid.wall_slots.clone().chain(solid.dummy_slots.clone()) {
            let at = sim.scene.position[slot];
            let inside = solid.shape.distance(solid.orientation.inverse() * (at - solid.position)).0;
            // Along a mesh's edges they stand where there is room.
            assert!(
                inside < if dimensions == 2 { -0.45 * L0 } else { 0.0 },
                "a particle {inside} m from the surface at {at}"
            );
            nearest = water(&sim).iter().map(|f| f.distance(at)).fold(nearest, f64::min);
        }
        assert!(nearest > 0.5 * L0, "{nearest} m between water and solid");
        for _ in 0..250 {
            sim.step().expect("still water is no trouble");
        }
        let kinetic = sim.backend.monitor().expect("it reads").kinetic;
        // Over its weight times its depth; from its surface, as without the obstacle (9e-4 J in the plane after 2 s).
        let scale = 1000.0 * G * (0.192 - AREA) * width * 0.24;
        println!(
            "{dimensions}D: kinetic energy {kinetic:.2e} J, {:.1e} of the weight times the depth",
            kinetic / scale
        );
        assert!(kinetic < 1.5e-4 * scale, "{kinetic} J");
    }
}

#[test]
fn a_section_held_under_water_is_lifted_by_what_it_displaces_on_both_processors() {
    // A rhomb and a wedge, which is what a prism of its three corners is.
    let rhomb = "shape = \"prism\"\nsection = [[0, 0.08], [0.12, 0], [0.24, 0.08], [0.12, 0.16]]\nheight = 0.16\nposition = [0.3, 0, 0.04]";
    let wedge = "shape = \"wedge\"\nsize = [0.24, 0.16, 0.12]\ncenter = [0.4, 0.08, 0.1]";
    let same = "shape = \"prism\"\nsection = [[-0.16, -0.04], [0.08, -0.04], [0.08, 0.08]]\nheight = 0.16\nposition = [0.4, 0, 0.1]";
    let processors = processors("the lift of still prisms and wedges");
    let mut of_wedges = vec![];
    // That a wedge is a prism is told by one.
    for (keys, area, processors) in
        [(rhomb, 0.0192, &processors[..]), (wedge, 0.0144, &processors[..]), (same, 0.0144, &processors[..1])]
    {
        let case = case(&still(
            2,
            &format!("[[obstacle]]\nname = \"it\"\n{keys}\n[[gauge.force]]\nname = \"f\"\non = \"it\"\n"),
        ));
        let exact = 1000.0 * G * area * L0;
        let (mut lifts, mut scatters) = (vec![], vec![]);
        for processor in processors {
            let mut sim =
                Simulation::on(&case, Scene::build(&case).expect("builds"), processor).expect("starts");
            let mut forces = vec![];
            for step in 0..150 {
                sim.step().expect("still water is no trouble");
                if step >= 60 {
                    forces.push(sim.fluid_force[0].force.z);
                }
            }
            let (mean, scatter) = mean_and_deviation(&forces);
            scatters.push(scatter / mean);
            lifts.push(mean);
        }
        println!("{keys}: lift {lifts:.4?} N for {exact:.4} N, scatter {scatters:.4?}");
        // Water below a sharp tip that is taken for surface makes it jump by more than all of it.
        assert!(scatters.iter().all(|s| *s < 0.03), "{keys}: {scatters:?}");
        assert!(lifts.iter().all(|l| (l / exact - 1.0).abs() < 0.04), "{keys}: {lifts:?} N for {exact} N");
        assert!(lifts.iter().all(|l| (l / lifts[0] - 1.0).abs() < 1e-2), "{lifts:?}");
        if area < 0.015 {
            of_wedges.push(lifts[0]);
        }
    }
    assert!((of_wedges[0] / of_wedges[1] - 1.0).abs() < 1e-6, "{of_wedges:?}");
}

#[test]
fn a_section_slides_down_a_slope_by_coulombs_law_and_lands_on_its_tip() {
    let (slope, friction) = (0.75_f64.atan(), 0.3);
    for (law, mu) in [("smooth", friction), ("smooth", 0.0)] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\n\
             [[obstacle]]\nname = \"slope\"\nshape = \"prism\"\nsection = [[0, 0], [2, 0], [0, 1.5]]\nheight = 1\n\
             [[body]]\nname = \"it\"\nshape = \"prism\"\nsection = [[0, 0], [0.4, -0.3], [0.4, 0]]\nheight = 1\n\
             density = 2000\ncenter = [0.5667, 0, 1.3]\nstanding = true\n\
             [contact]\nlaw = \"{law}\"\nspring = 1e7\nrestitution = 0.1\nfriction = {mu}\n"
        ));
        let start = dry.run(0.2)[0];
        let end = dry.run(0.6)[0];
        // 0.4 s later: `run` goes to a time.
        let gained = (end.velocity - start.velocity).length() / 0.4;
        let exact = G * (slope.sin() - mu * slope.cos());
        println!("mu {mu}: {gained:.4} m/s2 for {exact:.4}");
        assert!((gained / exact - 1.0).abs() < 5e-3, "mu {mu}: {gained} for {exact}");
        assert!((end.velocity.z / end.velocity.x + 0.75).abs() < 1e-3, "{end:?}");
    }
    // The same body falls onto a floor, tip first, turns over and lies on its long side.
    let mut dry = Dry::new(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 2\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [3, 0, 2]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"it\"\nshape = \"prism\"\nsection = [[0, 0], [0.4, -0.3], [0.4, 0]]\nheight = 1\n\
         density = 2000\ncenter = [1.5, 0, 0.6]\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e6\nrestitution = 0.2\nfriction = 0.3\n",
    );
    let end = dry.run(2.0)[0];
    // Of a right triangle the centroid lies a third of the height above a side.
    let height = 0.4 * 0.3 / 0.5 / 3.0;
    println!("lies at {:.5} m for {height:.5}", end.position.z);
    assert!((end.position.z - height).abs() < 1e-3 && end.velocity.length() < 1e-3, "{end:?}");
}

#[test]
fn a_slice_and_the_prism_in_space_have_the_same_shape() {
    let scene = |dimensions| Scene::build(&case(&still(dimensions, &breakwater("")))).expect("builds");
    let (flat, deep) = (scene(2), scene(3));
    let (slice, prism) = (&flat.solids[0], &deep.solids[0]);
    assert!(matches!(slice.shape, Shape::Polygon(_)) && matches!(prism.shape, Shape::Mesh(_)));
    let centers = (slice.position - prism.position) * DVec3::new(1.0, 0.0, 1.0);
    assert!(centers.length() < 1e-12 && (prism.position.y - 0.08).abs() < 1e-12, "{centers}");
    for k in 0..2000 {
        let at = DVec3::new(0.1 + f64::from(k % 50) * 0.014, 0.0, -0.04 + f64::from(k / 50) * 0.007);
        let own = |solid: &seixo::scene::Solid, x: DVec3| {
            let (d, outward) = solid.shape.distance(solid.orientation.inverse() * (x - solid.position));
            (d, solid.orientation * outward)
        };
        let ((d, n), (e, m)) = (own(slice, at), own(prism, at + 0.08 * DVec3::Y));
        // In the middle between its ends the prism's sides are the nearest as far as 0.08 m.
        if d > -0.079 {
            assert!((d - e).abs() < 1e-9, "{at}: {d} {e}");
            assert!((n - m).length() < 1e-6 || d.abs() < 1e-6 || d.abs() > 0.02, "{at}: {n} {m}");
        }
    }
}

#[test]
fn water_takes_the_form_of_a_section() {
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\n\
                [fluid]\n[[fluid.shape]]\nshape = \"prism\"\nsection = [[0, 0], [0.6, 0], [0.2, 0.4], [0, 0.4]]\nheight = 1\n";
    let scene = Scene::build(&case(text)).expect("builds");
    let water: Vec<DVec3> = (0..scene.groups.fluid)
        .filter(|&i| scene.kind[i] == Kind::Fluid)
        .map(|i| scene.position[i])
        .collect();
    assert!((water.len() as f64 * L0 * L0 / 0.16 - 1.0).abs() < 0.03, "{}", water.len());
    assert!(water.iter().all(|x| x.x + x.z < 0.6 + 1e-9 && x.z < 0.4));
}

/// A file from a drawing has its slopes in many pieces, and the first of them are as near to the toe as one likes.
#[test]
fn a_tip_is_no_plate_however_its_sides_are_divided() {
    let scene = |dimensions: u32, section: &str| {
        let keys =
            format!("shape = \"prism\"\nsection = {section}\nheight = 0.16\nposition = [0.2, 0, 0.04]");
        Scene::build(&case(&still(dimensions, &format!("[[obstacle]]\nname = \"it\"\n{keys}\n"))))
    };
    for dimensions in [2, 3] {
        let count = |section: &str| {
            let scene = scene(dimensions, section).unwrap_or_else(|e| panic!("{section}: {e}"));
            scene.solids[0].wall_offset.len() as f64
        };
        let whole = count("[[0, 0], [0.4, 0], [0.4, 0.2]]");
        let divided = count(
            "[[0, 0], [0.004, 0], [0.01, 0], [0.05, 0], [0.4, 0], [0.4, 0.2], [0.03, 0.015], [0.01, 0.005]]",
        );
        assert!((divided / whole - 1.0).abs() < 0.03, "{dimensions}D: {divided} {whole}");
        // Nothing but tips, 14 mm at the end of 0.42 m.
        let thin = scene(dimensions, "[[0, 0], [0.3, 0.29], [0.29, 0.3]]").expect_err("too thin").to_string();
        assert!(thin.contains("e-3 m thin at") && thin.contains("less than one particle"), "{thin}");
    }
}

/// A section has the coordinates of the case: it turns about what is near it there, not about their origin.
#[test]
fn a_wall_far_from_the_origin_turns_as_fast_as_it_does_near_it() {
    let flap = |dimensions: u32, keys: &str| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.02\ndimensions = {dimensions}\n\
             [tank]\nmin = [20, 0, 0]\nmax = [21, 0.1, 0.6]\nopen = [\"z_max\"]\n\
             [[body]]\nname = \"b\"\nsize = [0.06, 0.06, 0.06]\ncenter = [20.1, 0.05, 0.25]\ndensity = 500\n\
             [contact]\nspring = 1e5\n\
             [[moving_wall]]\nname = \"flap\"\nshape = \"prism\"\nheight = 0.08\nposition = [0, 0.01, 0]\n\
             section = [[20.45, 0.1], [20.55, 0.1], [20.55, 0.5], [20.45, 0.5]]\n{keys}\n"
        );
        text.parse::<seixo::Case>().map_err(|e| e.to_string())
    };
    for dimensions in [2, 3] {
        let near = flap(dimensions, "pivot = [20.5, 0.05, 0.1]\nrotation = [[0, 0, 0, 0], [1, 0, 60, 0]]");
        near.unwrap_or_else(|e| panic!("{e}"));
        let far = flap(dimensions, "pivot = [0, 0, 0]\nrotation = [[0, 0, 0, 0], [0.05, 0, 45, 0]]");
        assert!(far.as_ref().is_err_and(|e| e.contains("the solid would jump")), "{far:?}");
    }
}

#[test]
fn what_is_wrong_with_a_section_is_said_with_its_key() {
    let prism = |rest: &str| format!("shape = \"prism\"\n{rest}");
    for (keys, key, part) in [
        (prism("height = 0.2"), "obstacle.0", "without `section`"),
        (prism("section = [[0, 0], [0.2, 0]]\nheight = 0.1"), "obstacle.0.section", "2 corners"),
        (
            prism("section = [[0, 0], [0.2, 0.2], [0.2, 0], [0, 0.2]]\nheight = 0.1"),
            "obstacle.0.section.2",
            "after corner 0 meets",
        ),
        (
            prism("section = [[0, 0], [0.2, 0], [0.2, 0.2]]\nheight = 0.1\ncenter = [0, 0, 0]"),
            "obstacle.0.center",
            "use `position`",
        ),
        (
            prism("section = [[0, 0], [0.2, 0], [0.2, 0.01], [0, 0.01]]\nheight = 0.1"),
            "obstacle.0.section",
            "less than one particle",
        ),
        (
            prism("section = [[0, 0], [0.2, 0], [0.2, 0.2], [0.19, 0.2], [0.19, 0.05], [0, 0.05]]\nheight = 0.1"),
            "obstacle.0.shape",
            "thin at (0.1",
        ),
        ("min = [0, 0, 0]\nmax = [0.1, 0.1, 0.1]\nsection = [[0, 0], [1, 0], [1, 1]]".into(), "obstacle.0.section", "prism"),
        ("shape = \"cylinder\"\nradius = 0.1\nheight = 0.1\ncenter = [0.2, 0, 0.1]\nsection = [[0, 0], [1, 0], [1, 1]]".into(),
         "obstacle.0.section", "prism"),
    ] {
        let text = still(2, &format!("[[obstacle]]\nname = \"it\"\n{keys}\n"));
        match Scene::build(&case(&text)) {
            Err(Error::Case(why)) => {
                let problem = &why.problems[0];
                let said = format!("{why} {}", problem.remedy);
                assert_eq!(problem.key, key, "{keys}: {said}");
                assert!(said.contains(part) && !problem.remedy.is_empty(), "{keys}: {said}");
            }
            other => panic!("{keys}: expected a refusal, got {:?}", other.map(|_| ())),
        }
    }
}

#[test]
fn flat_faces_of_any_shape_slow_a_spin_by_the_mean_distance_of_an_even_pressure() {
    // moment of inertia over mass, and mean distance from the middle of the face
    let (square, round) = ((0.04 / 6.0, 0.2 * 0.382_597_858), (0.3 * 0.01, 2.0 / 3.0 * 0.1));
    let prism = "shape = \"prism\"\nsection = [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1]]\nheight = 0.2\ncenter = [0, 0, 0.05]";
    let cone = "shape = \"cone\"\nradius = 0.1\nheight = 0.16\ncenter = [0, 0, 0.04]";
    for (keys, (moment, arm), spacing, allowed) in [
        (prism, square, 0.04, 0.1),
        (prism, square, 0.02, 0.04),
        (prism, square, 0.01, 0.03),
        (cone, round, 0.02, 0.03),
        (cone, round, 0.01, 0.03),
    ] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = {spacing}\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
             [[plane]]\nname = \"plane\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [1, 1]\n\
             [[body]]\nname = \"it\"\n{keys}\ndensity = 1000\nangular_velocity = [0, 0, 10]\n\
             [contact]\nspring = 1e6\nrestitution = 0.3\nfriction = 0.3\n"
        ));
        let [start, end] = [0.05, 0.15].map(|time| dry.run(time)[0].angular_velocity.z);
        let (slowed, exact) = ((start - end) / 0.1, 0.3 * G * arm / moment);
        println!("{keys} at {spacing}: {slowed:.3} rad/s2 for {exact:.3}: {:.3}", slowed / exact);
        assert!((slowed / exact - 1.0).abs() < allowed, "{keys} at {spacing}: {slowed} for {exact}");
    }
}

#[test]
fn plates_of_any_thickness_feel_still_water() {
    // Tilted by 10 degrees. With a hollow in the middle rows were taken for surface: 0.5 of the force and twice as much scatter.
    for thick in [2.3, 2.34, 2.4, 2.5, 2.75, 3.0, 3.5] {
        let up = thick * L0 / 10f64.to_radians().cos();
        let slope = 0.4 * 10f64.to_radians().tan();
        let section = format!("[[0, 0], [0.4, {slope}], [0.4, {}], [0, {up}]]", slope + up);
        let plate = format!(
            "[[obstacle]]\nname = \"it\"\nshape = \"prism\"\nsection = {section}\nheight = 0.16\nposition = [0.2, 0, 0.06]\n\
             [[gauge.force]]\nname = \"f\"\non = \"it\"\n"
        );
        let text = still(2, &plate).replace("0.16, 0.24]", "0.16, 0.3]").replace("0.34]", "0.4]");
        let case = case(&text);
        let mut sim = cpu_simulation(&case, Scene::build(&case).expect("it builds"));
        let mut forces = vec![];
        for step in 0..400 {
            sim.step().expect("still water is no trouble");
            if step >= 200 {
                forces.push(sim.fluid_force[0].force.z);
            }
        }
        let exact = 1000.0 * G * 0.4 * up * L0;
        let (mean, scatter) = mean_and_deviation(&forces);
        println!("{thick} spacings: {:.3} of its displacement, scatter {:.3}", mean / exact, scatter / exact);
        assert!(
            (mean / exact - 1.0).abs() < 0.05 && scatter < 0.1 * exact,
            "{thick}: {mean} {scatter} {exact}"
        );
    }
}

/// The floor is seen through a groove that comes down to it in one line, between the places at which it is looked at whether it is covered.
#[test]
fn a_corner_stands_in_a_groove_that_ends_on_the_floor() {
    for (spacing, apex) in [(0.02, 0.0), (0.01, 0.0), (0.01, 1e-5)] {
        let side = 0.15;
        let low = 0.5 * side * 2.0_f64.sqrt() + apex + 5e-4;
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = {spacing}\ntime_step = 1e-3\nend = 1\ndimensions = 2\ngravity = [0, 0, -9.81]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1.2, 0.1, 0.8]\nopen = [\"z_max\"]\n\
             [[obstacle]]\nname = \"v\"\nshape = \"prism\"\n\
             section = [[0, -0.04], [1.2, -0.04], [1.2, 0.4], [1.0, 0.4], [0.6, {apex}], [0.2, 0.4], [0, 0.4]]\n\
             [[body]]\nname = \"square\"\nsize = [{side}, 0.1, {side}]\norientation = {{ axis = [0, 1, 0], angle_deg = 45 }}\n\
             center = [0.6, 0, {low}]\ndensity = 2000\n\
             [contact]\nspring = 2e5\nrestitution = 0.3\nfriction = 0\n"
        ));
        dry.run(0.8);
        let weight = 2000.0 * side * side * spacing * 9.81;
        let held = dry.solids.contact_wrenches()[0].force.z / weight;
        println!("{spacing} m: held by {held:.4} of its weight");
        assert!((held - 1.0).abs() < 1e-2, "{held}");
    }
}

/// Along a groove both flanks rub with their own forces, whose sum is more than what they hold up.
#[test]
fn a_plank_slides_down_the_groove_of_one_prism_by_the_forces_of_both_flanks() {
    let (slope, mu) = (30_f64.to_radians(), 0.2);
    for flank in [25_f64, 40.0] {
        let rise = flank.to_radians().tan();
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, {}, {}]\n\
             [[obstacle]]\nname = \"groove\"\nshape = \"prism\"\nheight = 1\nposition = [0, -0.3, 0]\n\
             section = [[-0.3, -0.1], [0.3, -0.1], [0.3, {top}], [0.2, {top}], [0, 0], [-0.2, {top}], [-0.3, {top}]]\n\
             [[body]]\nname = \"plank\"\nsize = [0.2, 0.1, 0.04]\ndensity = 1000\ncenter = [0, 0, {}]\nstanding = true\n\
             [contact]\nspring = 1e6\nrestitution = 0.3\nfriction = {mu}\n",
            G * slope.sin(),
            -G * slope.cos(),
            0.1 * rise + 0.02,
            top = 0.2 * rise,
        ));
        let speed = dry.run(0.2)[0].velocity.y;
        let exact = 0.2 * G * (slope.sin() - mu * slope.cos() / flank.to_radians().cos());
        println!("flanks of {flank}: {speed:.4} m/s for {exact:.4}");
        assert!((speed / exact - 1.0).abs() < 1e-2, "flanks of {flank}: {speed} for {exact}");
    }
}

#[test]
fn what_is_left_out_beyond_the_tank_is_told_with_where_the_prism_stands() {
    // Its `position` is not its middle along y.
    let block = "[[obstacle]]\nname = \"it\"\nshape = \"prism\"\nsection = [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]\nheight = 0.16\n";
    for (y, told) in [(0.0, false), (0.08, true)] {
        let case = case(&still(3, &format!("{block}position = [0.3, {y}, 0]\n")));
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{e}"));
        let note = "beyond the tank's, it reaches from y = 0.0800 to 0.2400 m";
        assert_eq!(scene.notes.iter().any(|n| n.ends_with(note)), told, "{:?}", scene.notes);
    }
}

/// Height of a square of 0.1 m that has fallen flat into water at 1 m/s, 0.3 s later [m], by the keys of its shape.
fn fallen(shape: &str, cells: u32) -> f64 {
    let case = case(&format!(
        "[run]\nspacing = {}\ntime_step = 1.5e-3\nadaptive = true\nend = 0.3\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 0.7]\nopen = [\"z_max\"]\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.4]\n\
         [[body]]\nname = \"b\"\n{shape}\ncenter = [0.5, 0, 0.46]\ndensity = 2000\nvelocity = [0, 0, -1]\n[contact]\nspring = 1e5\n",
        0.1 / f64::from(cells)
    ));
    let mut sim = cpu_simulation(&case, Scene::build(&case).expect("builds"));
    while sim.time < 0.3 {
        sim.step().expect("it falls into water");
    }
    sim.solids.poses()[0].position.z
}

/// The rows at its edges have a part of each face there. Given to the rows beside them, the edges' part was pressed by more than there is:
/// the square stood 28 mm higher than the box.
#[test]
fn a_square_section_falls_into_water_as_a_box_does() {
    let section = "shape = \"prism\"\nsection = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]";
    // Of the box, which goes on from 0.1407 over 0.1426 to 0.1444 m at 5, 10 and 20 cells, 0.146.
    let [section, block] = [section, "size = [0.1, 0.1, 0.1]"].map(|shape| fallen(shape, 5));
    println!("{section:.4} m, a box {block:.4} m");
    assert!((section - 0.146).abs() < 0.004, "{section}");
    assert!((section - block).abs() < 0.005, "{section} and {block}");
}
