//! Round bodies: rolling, bouncing, resting, turning over, against analytic results; what a case may ask of them.

use crate::common::case;
use crate::common::dry::{Dry, G};
use glam::DVec3;
use seixo::case::file;
use seixo::scene::Scene;

/// The shape keys of a sphere and of a cylinder lying along y.
const ROUND: [(&str, f64, &str); 2] = [
    ("sphere", 5.0 / 7.0, "shape = \"sphere\"\nradius = 0.1"),
    ("cylinder", 2.0 / 3.0, "shape = \"cylinder\"\nradius = 0.1\nheight = 0.15\naxis = [0, 2, 0]"),
];

#[test]
fn a_sphere_and_a_cylinder_roll_down_a_slope_with_their_share_of_gravity() {
    for (name, share, keys) in ROUND {
        for spacing in [0.05, 0.02] {
            for slope in [0.1_f64, 0.5] {
                let (along, down) = (G * slope.sin(), G * slope.cos());
                let mut dry = Dry::new(&format!(
                    "[run]\nspacing = {spacing}\ntime_step = 1e-3\nend = 1\ngravity = [{along}, 0, -{down}]\n\
                     [[plane]]\nname = \"slope\"\ncenter = [1, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [4, 1]\n\
                     [[body]]\nname = \"it\"\n{keys}\ncenter = [0, 0, 0.1]\ndensity = 800\n\
                     [contact]\nspring = 1e6\nrestitution = 0.5\nfriction = 0.4\n"
                ));
                let pose = dry.run(0.6)[0];
                let acceleration = pose.velocity.x / 0.6;
                let error = acceleration / (share * along) - 1.0;
                assert!(error.abs() < 1e-3, "{name} at {spacing} on {slope}: {error:e}");
                let slip = pose.velocity.x - 0.1 * pose.angular_velocity.y;
                assert!(slip.abs() < 1e-4 * pose.velocity.x, "{name}: slips at {slip}");
                assert!(pose.position.y.abs() < 1e-9 && (pose.position.z - 0.1).abs() < 1e-4, "{pose:?}");
            }
        }
    }
}

#[test]
fn a_sphere_that_slides_comes_to_roll_with_five_sevenths_of_its_speed() {
    let mut dry = Dry::new(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -9.80665]\n\
         [[plane]]\nname = \"floor\"\ncenter = [1, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [4, 1]\n\
         [[body]]\nname = \"it\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0, 0, 0.1]\nmass = 3\nvelocity = [1.4, 0, 0]\n\
         [contact]\nspring = 1e6\nrestitution = 0.5\nfriction = 0.2\n",
    );
    let pose = dry.run(0.8)[0];
    assert!((pose.velocity.x - 1.0).abs() < 1e-3, "{pose:?}");
}

#[test]
fn a_body_in_a_corner_rests_at_its_size_from_each_wall() {
    let cylinder = "shape = \"cylinder\"\nradius = 0.1\nheight = 0.3\naxis = [0, 1, 0]";
    for law in ["smooth", "paper"] {
        for (keys, half) in [(ROUND[0].2, DVec3::splat(0.1)), (cylinder, DVec3::new(0.1, 0.15, 0.1))] {
            for spacing in [0.05, 0.025] {
                let friction = if law == "smooth" { "friction = 0.05" } else { "" };
                let mut dry = Dry::new(&format!(
                    "[run]\nspacing = {spacing}\ntime_step = 1e-3\nend = 1\ngravity = [-2, -1, -9]\n\
                     [tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\nopen = [\"z_max\"]\n\
                     [[body]]\nname = \"it\"\n{keys}\ncenter = [0.25, 0.3, 0.3]\ndensity = 700\n\
                     [contact]\nlaw = \"{law}\"\nspring = 2e6\ndamping_ratio = 1\n{friction}\n"
                ));
                let pose = dry.run(4.0)[0];
                let off = (pose.position - half) / spacing;
                // the paper's law holds particles d_c apart, in the lattice's hollows
                let (least, most) = if law == "smooth" { (-1e-2, 1e-3) } else { (-0.5, 0.5) };
                assert!(off.min_element() > least && off.max_element() < most, "{law} {half}: {off} l0");
                // the paper's average keeps no energy once a body turns, and it has no friction: it may go on spinning
                let still = law == "paper" || pose.velocity.length() < 1e-6;
                assert!(still, "{law} {half} at {spacing}: {pose:?}");
            }
        }
    }
}

#[test]
fn a_ball_bounces_with_its_restitution_off_a_floor_and_off_another_ball() {
    for asked in [0.3, 0.7, 1.0] {
        for spacing in [0.05, 0.02] {
            let mut dry = Dry::new(&format!(
                "[run]\nspacing = {spacing}\ntime_step = 5e-4\nend = 1\ngravity = [0, 0, 0]\n\
                 [[plane]]\nname = \"floor\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [2, 2]\n\
                 [[body]]\nname = \"falls\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0, 0, 0.113]\nmass = 2\n\
                 velocity = [0, 0, -2]\n\
                 [[body]]\nname = \"first\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [-0.3, 0, 0.7]\nmass = 2\n\
                 velocity = [2, 0, 0]\n\
                 [[body]]\nname = \"second\"\nshape = \"sphere\"\nradius = 0.15\ncenter = [0, 0, 0.7]\nmass = 5\n\
                 [contact]\nspring = 1e6\nrestitution = {asked}\n"
            ));
            let poses = dry.run(0.2);
            let off_floor = poses[0].velocity.z / 2.0;
            assert!((off_floor / asked - 1.0).abs() < 0.03, "{off_floor} for {asked}");
            let apart = (poses[2].velocity.x - poses[1].velocity.x) / 2.0;
            assert!((apart / asked - 1.0).abs() < 0.03, "{apart} for {asked}");
            let momentum = 2.0 * poses[1].velocity.x + 5.0 * poses[2].velocity.x;
            assert!((momentum - 4.0).abs() < 1e-12);
        }
    }
}

#[test]
fn elastic_round_bodies_keep_energy_and_momentum_however_they_meet() {
    for spacing in [0.05, 0.025] {
        for k in 0..6 {
            let angle = 17.0 * f64::from(k);
            let mut dry = Dry::new(&format!(
                "[run]\nspacing = {spacing}\ntime_step = 2e-4\nend = 1\ngravity = [0, 0, 0]\n\
                 [[body]]\nname = \"can\"\nshape = \"cylinder\"\nradius = 0.1\nheight = 0.25\ncenter = [0, 0, 0]\n\
                 density = 800\norientation = {{ axis = [1, 2, 0.5], angle_deg = {angle} }}\nangular_velocity = [3, 5, 0]\n\
                 [[body]]\nname = \"box\"\nsize = [0.2, 0.3, 0.2]\ncenter = [0.5, 0.03, 0.02]\ndensity = 500\n\
                 velocity = [-2, 0, 0]\nangular_velocity = [0, 0, 4]\n\
                 [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [-0.5, 0.04, 0.03]\ndensity = 900\n\
                 velocity = [2, 0, 0]\n\
                 [[body]]\nname = \"roll\"\nshape = \"cylinder\"\nradius = 0.08\nheight = 0.3\naxis = [0, 1, 0.2]\n\
                 center = [0.02, 0.01, 0.6]\ndensity = 800\nvelocity = [0, 0, -2]\n\
                 [contact]\nspring = 2e6\nrestitution = 1\n"
            ));
            let (start, (momentum, angular)) = (dry.solids.energy().total(), dry.solids.momentum());
            dry.run(0.5);
            // within a contact the energy of symplectic Euler swings by half of w dt of what the spring holds
            let now = dry.solids.energy();
            let worst = (now.total() / start - 1.0).abs();
            assert!(now.contact < 1e-3 * start, "{now:?}");
            let (now, turn) = dry.solids.momentum();
            assert!((now - momentum).length() < 1e-10 && (turn - angular).length() < 1e-10);
            assert!(turn.is_finite() && dry.solids.poses()[0].velocity.length() > 0.1, "they met");
            assert!(worst > 0.0 && worst < 5e-3, "{k} at {spacing}: energy off by {worst:e}");
        }
    }
}

#[test]
fn a_cylinder_on_its_end_and_a_box_on_a_cylinder_stand() {
    let mut dry = Dry::new(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 1\ngravity = [0.5, 0, -9.8]\n\
         [tank]\nmin = [-1, -1, 0]\nmax = [1, 1, 1]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"can\"\nshape = \"cylinder\"\nradius = 0.1\nheight = 0.2\ncenter = [0, 0, 0.1]\ndensity = 800\n\
         [[body]]\nname = \"box\"\nsize = [0.3, 0.3, 0.1]\ncenter = [0.01, 0.02, 0.25]\ndensity = 500\n\
         [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.05\ncenter = [0.5, 0, 0.3]\ndensity = 500\n\
         [contact]\nspring = 1e6\ndamping_ratio = 1\nfriction = 0.5\n",
    );
    let poses = dry.run(3.0).to_vec();
    assert!((poses[0].position - DVec3::new(0.0, 0.0, 0.1)).length() < 1e-4, "{:?}", poses[0]);
    assert!((poses[1].position - DVec3::new(0.01, 0.02, 0.25)).length() < 2e-4, "{:?}", poses[1]);
    for pose in &poses[..2] {
        assert!(pose.velocity.length() < 1e-4 && pose.angular_velocity.length() < 1e-3, "{pose:?}");
        println!("{pose:?}");
    }
}

#[test]
fn in_two_dimensions_a_disc_rolls_like_a_cylinder() {
    let mut dry = Dry::new(
        "[run]\ndimensions = 2\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [1, 0, -9.8]\n\
         [tank]\nmin = [-0.2, 0, 0]\nmax = [2, 1, 1]\nopen = [\"z_max\"]\n\
         [[body]]\nname = \"disc\"\nshape = \"cylinder\"\nradius = 0.1\nheight = 1\ncenter = [0, 0, 0.1]\ndensity = 800\n\
         [contact]\nspring = 1e6\nrestitution = 0.5\nfriction = 0.3\n",
    );
    let pose = dry.run(0.5)[0];
    assert!((pose.velocity.x / 0.5 / (2.0 / 3.0) - 1.0).abs() < 1e-3, "{pose:?}");
}

#[test]
fn round_bodies_start_where_they_stand_and_overlap_only_with_what_they_touch() {
    let scene = |center: &str, standing: bool| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -9.8]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\nopen = [\"z_max\"]\n\
             [[body]]\nname = \"first\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.5, 0.5, 0.1]\ndensity = 800\n\
             [[body]]\nname = \"second\"\nshape = \"sphere\"\nradius = 0.1\ncenter = {center}\ndensity = 800\n\
             standing = {standing}\n[contact]\nspring = 1e6\n"
        );
        Scene::build(&case(&text)).map(|s| s.solids[1].position).map_err(|e| e.to_string())
    };
    // the boxes around them overlap, they do not
    assert!(scene("[0.65, 0.65, 0.1]", false).is_ok());
    let error = scene("[0.5, 0.6, 0.1]", false).unwrap_err();
    assert!(error.contains("overlaps body `first` by 0.1"), "{error}");
    let lifted = scene("[0.5, 0.55, 0.2]", true).unwrap();
    let exact = 0.1 + (0.04_f64 - 0.0025).sqrt();
    assert!((lifted.z - exact).abs() < 1e-6, "{lifted} {exact}");
}

#[test]
fn a_case_says_what_a_shape_needs() {
    let refused = |keys: &str, head: &str| {
        let text = format!(
            "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n{head}\n[[body]]\nname = \"it\"\ncenter = [0, 0, 1]\n\
             density = 500\n{keys}\n[contact]\nspring = 1e5\n"
        );
        file::parse("test.toml", text, &[]).map(|_| ()).unwrap_err().to_string()
    };
    for (keys, head, says) in [
        ("", "", "is a box without `size`"),
        ("shape = \"sphere\"", "", "add `radius = 0.1`"),
        ("shape = \"sphere\"\nradius = 0.1\nheight = 1", "", "`height` does not belong to it"),
        ("shape = \"sphere\"\nradius = -0.1", "", "body.0.radius"),
        ("shape = \"sphere\"\nradius = 0.005", "", "less than one particle"),
        ("shape = \"cylinder\"\nradius = 0.1", "", "without `height`"),
        ("shape = \"cylinder\"\nradius = 0.1\nheight = 1\naxis = [0, 0, 0]", "", "the axis has no length"),
        ("size = [1, 1, 1]\naxis = [0, 0, 1]", "", "it has no `axis`"),
        ("shape = \"sphere\"\nradius = 0.1", "dimensions = 2", "no spheres in two dimensions"),
        ("shape = \"cone\"", "", "cone"),
        ("size = [1, 1, 1]\nvelocity = [0, 1, 0]", "dimensions = 2", "1 along y: in two dimensions"),
        ("size = [1, 1, 1]\nangular_velocity = [1, 0, 0]", "dimensions = 2", "turns about y alone"),
        (
            "size = [1, 1, 1]\norientation = { axis = [1, 0, 0], angle_deg = 30 }",
            "dimensions = 2",
            "turns about y alone",
        ),
        (
            "size = [1, 1, 1]\nmotion = [[0, 0, 0, 0], [1, 0, 1, 0]]",
            "dimensions = 2",
            "1 along y: in two dimensions",
        ),
        ("size = [1, 1, 1]", "dimensions = 2\ngravity = [0, -9.81, 0]", "run.gravity"),
    ] {
        let error = refused(keys, head);
        assert!(error.contains(says), "{keys}: {error}");
    }
}
