//! What tables tell of contact: the force on a solid is that of the solids that touch it, whatever holds or drives it.

use crate::common::dry::Dry;
use glam::DVec3;
use seixo::body::{Pose, Wrench};

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
