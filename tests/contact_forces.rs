//! What tables tell of contact: the force on a solid is that of the solids that touch it, whatever holds or drives it.

use crate::common::dry::Dry;
use glam::DVec3;
use seixo::body::{Pose, Wrench};
use seixo::scene::WallShape;

const G: f64 = 9.806_65;

/// Moment of a wrench on the solid at `pose`, about the origin [N m].
fn about_origin(pose: &Pose, wrench: &Wrench) -> DVec3 {
    wrench.torque + pose.position.cross(wrench.force)
}

/// A block of 1 kg on a belt that follows a table and slips under it.
fn on_a_belt(contact: &str) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1\ngravity = [0, 0, -{G}]\n\
         [[body]]\nname = \"block\"\nsize = [0.1, 0.1, 0.05]\ncenter = [0.2, 0.05, 0.025]\nmass = 1\nstanding = true\n\
         [[moving_wall]]\nname = \"belt\"\nmin = [-0.5, -0.2, -0.1]\nmax = [0.5, 0.2, 0]\nmotion = [[0, 0, 0, 0], [1, 2, 0, 0]]\n\
         [contact]\n{contact}\n"
    ))
}

#[test]
fn a_driven_solid_is_told_to_feel_what_it_does_to_others() {
    let coulomb = "spring = 1e5\nrestitution = 0.3\nfriction = 0.5";
    let paper = "law = \"paper\"\nspring = 1e5\ndamping_ratio = 0.5\nviscous_friction = 2";
    for contact in [coulomb, paper] {
        let mut dry = on_a_belt(contact);
        let mut given = DVec3::ZERO;
        while dry.time() < 0.1 {
            dry.step();
            let (poses, wrenches) = (dry.solids.poses(), dry.solids.contact_wrenches());
            let (block, belt) = (wrenches[0], wrenches[1]);
            assert!((block.force + belt.force).length() <= 1e-9 * block.force.length());
            // torques are about the centres as they lay within the step, in which the belt goes on by a millimetre
            let moments = about_origin(&poses[0], &block) + about_origin(&poses[1], &belt);
            assert!(moments.length() <= 1.2e-3 * block.force.length(), "{moments}");
            given -= dry.dt * belt.force;
        }
        // what the belt gave is what the block has, and what carried it
        let moving = dry.solids.poses()[0].velocity;
        println!("{contact}\n{given} to {moving}");
        assert!(moving.x > 0.01);
        assert!((given - moving - 0.1 * G * DVec3::Z).length() < 1e-9, "{given} to {moving}");
    }
    let mut dry = on_a_belt(coulomb);
    dry.run(0.1);
    let belt = dry.solids.contact_wrenches()[1];
    assert!((belt.force - DVec3::new(-0.5 * G, 0.0, -G)).length() < 1e-3 * G, "{belt:?}");
}

#[test]
fn the_baseline_law_tells_both_of_an_impulse() {
    let mut dry = Dry::new(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, 0]\n\
         [[body]]\nname = \"block\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.1, 0, 0]\nmass = 1\n\
         [[body]]\nname = \"piston\"\nsize = [0.1, 0.1, 0.1]\ncenter = [-0.05, 0, 0]\ndensity = 1000\nmotion = [[0, 0, 0, 0], [1, 1, 0, 0]]\n\
         [contact]\nlaw = \"pressure\"\n",
    );
    let (mut pushed, mut felt) = (0.0, 0.0);
    while dry.time() < 0.2 {
        dry.step();
        let wrenches = dry.solids.contact_wrenches();
        pushed += dry.dt * wrenches[0].force.x;
        felt += dry.dt * wrenches[1].force.x;
    }
    let moving = dry.solids.poses()[0].velocity.x;
    assert!(
        moving > 0.9 && (pushed - moving).abs() < 1e-9 && (felt + moving).abs() < 1e-9,
        "{moving} {felt}"
    );
}

#[test]
fn what_holds_a_body_is_no_contact() {
    let held = |center: f64, locked: &str, plane: &str| {
        let mut dry = Dry::new(&format!(
            "[run]\ndimensions = 2\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
             [[plane]]\nname = \"plane\"\ncenter = [0, 0, 0]\n{plane}\nsize = [4, 4]\n\
             [[body]]\nname = \"block\"\nsize = [0.1, 1, 0.1]\ncenter = [0, 0, {center}]\ndensity = 1000\nlocked = [{locked}]\n\
             orientation = {{ axis = [0, 1, 0], angle_deg = 30 }}\n\
             [contact]\nspring = 1e6\nrestitution = 0.2\n"
        ));
        dry.run(0.5);
        dry.solids.contact_wrenches()[0]
    };
    let slope = "normal = [0.5, 0, 0.866025403784]\nalong = [0.866025403784, 0, -0.5]";
    // in the air
    let alone = held(1.0, "\"x\", \"z\", \"rotation_y\"", slope);
    assert_eq!(alone, Wrench::default());
    // on a slope, kept from going down it: the slope carries its weight and pushes it aside
    let weight = 0.1 * 0.1 * 0.02 * 1000.0 * G;
    let standing = held(0.05 / 0.866_025_403_784 + 1e-5, "\"x\"", slope);
    let exact = weight * DVec3::new(0.5 / 0.866_025_403_784, 0.0, 1.0);
    println!("{standing:?} for {exact}");
    assert!((standing.force - exact).length() < 1e-3 * weight, "{standing:?} for {exact}");
}

/// A spinning cube that is thrown into the corner of a tank, against the step that stands there.
fn into_a_corner(contact: &str, tank: &str) -> Dry {
    Dry::new(&format!(
        "[run]\nspacing = 0.025\ntime_step = 5e-4\nend = 1\ngravity = [0, 0, -{G}]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0.5, 0.6]\n{tank}\n\
         [[obstacle]]\nname = \"step\"\nmin = [0.8, 0, 0]\nmax = [1, 0.5, 0.1]\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.5, 0.36, 0.2]\nmass = 1\n\
         velocity = [3, 1.5, -1]\nangular_velocity = [2, 5, -3]\n\
         [contact]\n{contact}\n"
    ))
}

#[test]
fn fixed_walls_are_told_what_bodies_press_on_them() {
    let smooth = "spring = 1e5\nrestitution = 0.5\nfriction = 0.4\nviscous_friction = 1";
    let paper = "law = \"paper\"\nspring = 1e5\ndamping_ratio = 0.3\nviscous_friction = 2";
    let pressure = "law = \"pressure\"";
    for (contact, tank) in [
        (smooth, "open = [\"z_max\"]"),
        (paper, "open = [\"z_max\"]"),
        (pressure, "open = [\"z_max\"]"),
        (smooth, "open = [\"z_max\"]\nperiodic = [\"y\"]"),
    ] {
        let mut dry = into_a_corner(contact, tank);
        let walls = dry.walls.clone();
        let mut touched = vec![0.0; walls.len()];
        while dry.time() < 0.8 {
            let before = dry.solids.poses()[0];
            dry.step();
            let cube = dry.solids.contact_wrenches()[0];
            let felt = dry.solids.wall_contact_wrenches().expect("a body moves");
            let scale = cube.force.length();
            let on_walls: DVec3 = felt.iter().map(|w| w.force).sum();
            assert!((cube.force + on_walls).length() <= 1e-9 * scale, "{contact}: {cube:?} {felt:?}");
            // moments about the cube, which goes on within the step; a lever may be a length of the tank off where it is periodic
            if !tank.contains("periodic") {
                let moment = |(w, wall): (&Wrench, &WallShape)| {
                    w.torque + (wall.middle - before.position).cross(w.force)
                };
                let moments: DVec3 = felt.iter().zip(&walls).map(moment).sum();
                let way = dry.dt * (before.velocity.length() + 1.0);
                let off = (cube.torque + moments).length();
                assert!(off <= way * scale, "{contact}: {off} of {scale}");
            }
            for (sum, (wrench, wall)) in touched.iter_mut().zip(felt.iter().zip(&walls)) {
                *sum += dry.dt * wrench.force.length();
                // a face of the tank is pressed outwards
                let outward = match wall.name.as_str() {
                    "tank.x_max" => DVec3::X,
                    "tank.y_max" => DVec3::Y,
                    "tank.z_min" => -DVec3::Z,
                    _ => continue,
                };
                let pulled = -wrench.force.dot(outward);
                assert!(pulled <= 1e-9 * scale || contact == paper, "{contact}: {} {wrench:?}", wall.name);
            }
        }
        let hit: Vec<&str> =
            walls.iter().zip(&touched).filter(|(_, sum)| **sum > 0.1).map(|(w, _)| w.name.as_str()).collect();
        println!("{contact}: {hit:?}");
        let side = if tank.contains("periodic") { "step" } else { "tank.y_max" };
        for name in ["tank.z_min", "step", side] {
            assert!(hit.contains(&name), "{contact}: {name} in {hit:?}");
        }
    }
}

#[test]
fn two_posts_share_what_a_beam_carries_by_the_lever() {
    let corners = |low: f64| format!("min = [{low}, 0, 0]\nmax = [{}, 0.2, 0.2]", low + 0.1);
    // a solid that stands still: pressed as walls are, and told among the solids
    let centre = |low: f64| format!("size = [0.1, 0.2, 0.2]\ncenter = [{}, 0.1, 0.1]", low + 0.05);
    for [left, right] in [[corners(0.0), corners(0.8)], [centre(0.0), centre(0.8)]] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -{G}]\n\
             [[obstacle]]\nname = \"left\"\n{left}\n[[obstacle]]\nname = \"right\"\n{right}\n\
             [[body]]\nname = \"beam\"\nsize = [0.98, 0.1, 0.04]\ncenter = [0.5, 0.1, 0.22]\nmass = 2\n\
             [[body]]\nname = \"load\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.3, 0.1, 0.29]\nmass = 3\n\
             [contact]\nspring = 1e6\nrestitution = 0.1\nfriction = 0.3\n"
        ));
        dry.run(1.0);
        let on_walls = dry.solids.wall_contact_wrenches().expect("bodies move");
        let felt = if on_walls.is_empty() { &dry.solids.contact_wrenches()[2..] } else { on_walls };
        let (left, right) = (felt[0], felt[1]);
        println!("{left:?} {right:?}");
        assert!((left.force.z + right.force.z + 5.0 * G).abs() < 1e-3 * 5.0 * G);
        // where the posts press is told by their torque: it lies on their tops
        let at = |w: &Wrench, middle: f64| middle - w.torque.y / w.force.z;
        let (a, b) = (at(&left, 0.05), at(&right, 0.85));
        assert!((-1e-3..0.101).contains(&a) && (0.799..0.901).contains(&b), "{a} {b}");
        let moment = left.force.z * a + right.force.z * b + G * (2.0 * 0.5 + 3.0 * 0.3);
        assert!(moment.abs() < 2e-3 * 5.0 * G, "{moment}");
    }
}

#[test]
fn torque_on_a_plane_counts_about_its_centre_at_any_spacing() {
    for (spacing, dimensions) in [(0.04, 3), (0.02, 3), (0.02, 2)] {
        let (sin, cos) = 20_f64.to_radians().sin_cos();
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = {spacing}\ntime_step = 1e-3\nend = 1\ndimensions = {dimensions}\ngravity = [0, 0, -{G}]\n\
             [[plane]]\nname = \"plane\"\ncenter = [0.1, 0, 0.2]\nnormal = [{sin}, 0, {cos}]\nalong = [{cos}, 0, -{sin}]\nsize = [1.2, 0.4]\n\
             [[body]]\nname = \"block\"\nsize = [0.12, 0.12, 0.08]\ncenter = [{}, 0, {}]\nstanding = true\nmass = 1\n\
             orientation = {{ axis = [0, 1, 0], angle_deg = 20 }}\n\
             [contact]\nspring = 1e5\nrestitution = 0.2\nfriction = 0.6\n",
            0.1 - 0.3 * cos + 0.04 * sin,
            0.2 + 0.3 * sin + 0.04 * cos,
        ));
        let at = dry.run(0.3)[0].position;
        let on_plane = dry.solids.wall_contact_wrenches().unwrap()[0];
        let exact = (at - DVec3::new(0.1, 0.0, 0.2)).cross(on_plane.force);
        println!("{spacing}: {} for {exact}", on_plane.torque);
        assert!(
            (on_plane.torque - exact).length() < 1e-3 * exact.length(),
            "{spacing}: {on_plane:?} for {exact}"
        );
    }
}

/// Particles on an edge of a box, or of a plate one particle thick, are of several faces: the one that looks towards the other particle presses.
#[test]
fn by_the_papers_law_each_face_presses_along_its_own_normal() {
    let dry = |text: &str| {
        Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 2e-4\nend = 2\ndimensions = 2\ngravity = [0, 0, -{G}]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [2, 0, 1.2]\nopen = [\"z_max\"]\n\
             [contact]\nlaw = \"paper\"\nspring = 1e5\ndamping_ratio = 0.5\n{text}"
        ))
    };
    let block = |center: &str, more: &str| {
        format!(
            "[[body]]\nname = \"block\"\nsize = [0.2, 0.2, 0.1]\ncenter = {center}\ndensity = 1000\nstanding = true\n{more}"
        )
    };
    let wall = |kind: &str, name: &str, min: &str, max: &str, more: &str| {
        format!("[[{kind}]]\nname = \"{name}\"\nmin = {min}\nmax = {max}\n{more}")
    };
    // A shelf and a gate of one particle.
    for (kind, more) in [("obstacle", ""), ("moving_wall", "motion = [[0, 0, 0, 0], [9, 0, 0, 0]]\n")] {
        let plate = wall(kind, "plate", "[0.6, 0, 0.3]", "[1.4, 0, 0.32]", more);
        let mut dry = dry(&(plate + &block("[1.0, 0, 0.45]", "").replace("standing = true\n", "")));
        dry.run(0.6);
        let z = dry.solids.poses()[0].position.z;
        assert!((z - 0.37).abs() < 0.01, "{kind}: {z}");
    }
    // A body of one particle, which counts from its centre of mass.
    let held = "mass_offset = [0, 0, -0.006]\nlocked = [\"x\", \"z\", \"rotation_y\"]\n";
    let plate = "[[body]]\nname = \"plate\"\nsize = [0.8, 0.2, 0.02]\ncenter = [1, 0, 0.31]\ndensity = 1000\n"
        .to_owned() + held;
    let mut on_body = dry(&(block("[1.0, 0, 0.45]", "").replace("standing = true\n", "") + &plate));
    on_body.run(0.6);
    let z = on_body.solids.poses()[0].position.z;
    assert!((z - 0.37).abs() < 0.01, "{z}");
    // Over the joint of two boxes.
    let two = wall("obstacle", "first", "[0, 0, 0]", "[1, 0, 0.2]", "")
        + &wall("obstacle", "second", "[1, 0, 0]", "[2, 0, 0.2]", "");
    let mut over = dry(&(two + &block("[0.8, 0, 0.2549]", "velocity = [0.5, 0, 0]\n")));
    over.run(0.8);
    let pose = over.solids.poses()[0];
    assert!((pose.velocity.x - 0.5).abs() < 5e-3 && pose.position.x > 1.15, "{pose:?}");
    // Across an edge, with its centre of mass on the ledge.
    let ledge = wall("obstacle", "ledge", "[0, 0, 0]", "[1, 0, 0.2]", "");
    let mut across = dry(&(ledge + &block("[0.95, 0, 0.2549]", "")));
    across.run(0.6);
    let x = across.solids.poses()[0].position.x;
    assert!((x - 0.95).abs() < 1e-3, "{x}");
}
