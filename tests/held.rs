//! Bodies that are held: in all of their freedoms, in some, or on a hinge.

use crate::common::case;
use crate::common::dry::Dry;
use glam::DVec3;
use seixo::contact::Solids;
use seixo::scene::Scene;

/// How fast a heavy ball leaves what lies under it, `off` its middle [m], over how fast it came; with how fast what lies there moves then
/// where it was hit.
fn bounce(under: &str, off: f64, asked: f64) -> f64 {
    let mut dry = Dry::new(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-4\nend = 1\ngravity = [0, 0, 0]\n\
         [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [{off}, 0, 0.1005]\ndensity = 8000\nvelocity = [0, 0, -1]\n\
         [[body]]\nname = \"under\"\nsize = [0.4, 0.1, 0.1]\ncenter = [0, 0, 0]\ndensity = 200\n{under}\n\
         [contact]\nspring = 1e6\nrestitution = {asked}\n"
    ));
    let place = DVec3::new(off, 0.0, 0.05);
    let apart = |dry: &Dry| {
        let poses = dry.solids.poses();
        (poses[0].velocity - poses[1].velocity_at(place)).z
    };
    let (mut touched, mut touches) = (false, true);
    while touches || !touched {
        touches = dry.try_step().unwrap().pairs > 0;
        touched |= touches;
        assert!(dry.time() < 0.1, "they do not part");
    }
    apart(&dry)
}

#[test]
fn what_hits_a_light_body_that_cannot_give_way_bounces_as_asked() {
    let all = "locked = [\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]";
    let rail = "locked = [\"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\"]";
    let hinge = "hinge = { at = [-0.2, 0, 0], axis = \"y\" }";
    for asked in [0.2, 0.5, 0.8] {
        for (name, under, off) in [
            ("held", all, 0.0),
            ("on a rail", rail, 0.1),
            ("on a hinge", hinge, 0.15),
            ("on a hinge", hinge, -0.1),
        ] {
            let measured = bounce(under, off, asked);
            println!("{name}, {off} m off: {measured:.4} for {asked}");
            assert!((measured - asked).abs() < 0.03, "{name}, {off} m off: {measured} for {asked}");
        }
    }
}

#[test]
fn what_is_held_in_all_it_could_do_needs_no_contact_and_no_mass() {
    let held = |dimensions: u32, locked: &str| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = {dimensions}\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0.2, 0.4]\nopen = [\"z_max\"]\n\
             [fluid]\nsound_speed = 10\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0.2, 0.2]\n\
             [[body]]\nname = \"pile\"\nsize = [0.12, 0.08, 0.4]\ncenter = [0.5, 0.1, 0.2]\ndisplaces_fluid = true\nlocked = [{locked}]\n"
        );
        text.parse::<seixo::Case>()
    };
    for (dimensions, locked) in [
        (2, "\"x\", \"z\", \"rotation_y\""),
        (3, "\"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\", \"rotation_z\""),
    ] {
        let case = held(dimensions, locked).expect("nothing is missing");
        let scene = Scene::build(&case).expect("builds");
        assert!(!scene.solids[0].gives_way());
        let solids = Solids::new(&scene, None).expect("nothing is free");
        assert!(!solids.is_free(0));
    }
    let free = held(3, "\"x\", \"z\", \"rotation_y\"").expect_err("it moves along y").to_string();
    assert!(free.contains("neither mass nor density") && free.contains("there is no [contact]"), "{free}");
}

#[test]
fn ballast_is_turned_by_orientation_and_not_by_axis() {
    let mass = |more: &str| {
        let scene = Scene::build(&case(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[contact]\nspring = 1e5\n\
             [[body]]\nname = \"drum\"\nshape = \"cylinder\"\nradius = 0.1\nheight = 0.3\ncenter = [1, 2, 3]\ndensity = 500\n\
             mass_offset = [0, 0, -0.03]\n{more}\n"
        )))
        .expect("builds");
        scene.solids[0].position - DVec3::new(1.0, 2.0, 3.0)
    };
    let turned = "orientation = { axis = [1, 0, 0], angle_deg = 90 }\n";
    for (more, at) in [
        ("".to_owned(), DVec3::new(0.0, 0.0, -0.03)),
        ("axis = [0, 1, 0]\n".into(), DVec3::new(0.0, 0.0, -0.03)),
        (turned.into(), DVec3::new(0.0, 0.03, 0.0)),
        (format!("axis = [1, 1, 0]\n{turned}"), DVec3::new(0.0, 0.03, 0.0)),
    ] {
        assert!((mass(&more) - at).length() < 1e-12, "{more}: {}", mass(&more));
    }
}

#[test]
fn a_cylinder_turns_by_the_third_of_its_moments_in_the_plane_too() {
    for (dimensions, height) in [(2, "height = 0.02"), (3, "height = 0.02\naxis = [0, 1, 0]")] {
        let mut dry = Dry::new(&format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ndimensions = {dimensions}\ngravity = [0, 0, 0]\n\
             [[body]]\nname = \"disc\"\nshape = \"cylinder\"\nradius = 0.1\n{height}\ncenter = [0, 0, 0.5]\nmass = 3\n\
             inertia = [0.01, 0.01, 0.015]\nangular_velocity = [0, 2, 0]\n[contact]\nspring = 1e5\n"
        ));
        let energy = dry.solids.energy().kinetic;
        assert!((energy - 0.03).abs() < 1e-12, "{dimensions}: {energy}");
    }
}
