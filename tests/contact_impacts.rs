//! Impacts aside of the centre of mass: the points that meet part with the restitution of the case.

use crate::common::dry::Dry;
use glam::DVec3;

/// Runs until two solids have touched and parted, and returns how fast the point of the first that is at `at` from its
/// centre [m], turned as it was at the start, goes along z against the second solid, if there is one, and how fast it came.
fn parting(dry: &mut Dry, at: DVec3) -> f64 {
    let speed = |dry: &Dry| {
        let poses = dry.solids.poses();
        let place = poses[0].position + at;
        let other = poses.get(1).map_or(DVec3::ZERO, |b| b.velocity_at(place));
        (poses[0].velocity_at(place) - other).z
    };
    let came = speed(dry);
    let (mut touched, mut touches) = (false, true);
    while touches || !touched {
        touches = dry.try_step().unwrap().pairs > 0;
        touched |= touches;
        assert!(dry.time() < 0.1, "they do not part");
    }
    -speed(dry) / came
}

/// Corner of a box of `size` [m], turned, that is lowest.
fn lowest(dry: &Dry, size: [f64; 3]) -> DVec3 {
    let turn = dry.solids.poses()[0].orientation;
    let corners = (0..8).map(|k| {
        let side = |axis: usize| if k >> axis & 1 == 1 { 0.5 } else { -0.5 };
        turn * (DVec3::from(size) * DVec3::new(side(0), side(1), side(2)))
    });
    corners.min_by(|a, b| a.z.total_cmp(&b.z)).unwrap()
}

#[test]
fn what_lands_on_an_edge_or_a_corner_bounces_as_asked() {
    for size in [[0.1, 0.1, 0.1], [0.4, 0.04, 0.04], [0.3, 0.3, 0.04]] {
        for (axis, angle) in [("[0, 1, 0]", 20.0), ("[0, 1, 0]", 70.0), ("[1, 1, 0.3]", 30.0)] {
            for asked in [0.2, 0.5, 0.8] {
                for (spring, dt) in [(1e7, 2e-4), (1e8, 1e-4)] {
                    let mut dry = Dry::new(&format!(
                        "[run]\nspacing = 0.02\ntime_step = {dt:e}\nend = 1\ngravity = [0, 0, 0]\n\
                         [[plane]]\nname = \"plane\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [2, 2]\n\
                         [[body]]\nname = \"box\"\nsize = {size:?}\ncenter = [0, 0, 0.6]\ndensity = 1000\nvelocity = [0, 0, -1]\n\
                         orientation = {{ axis = {axis}, angle_deg = {angle} }}\n\
                         [contact]\nspring = {spring:e}\nrestitution = {asked}\n"
                    ));
                    let corner = lowest(&dry, size);
                    // a millimetre above the plane
                    let mut states = dry.solids.states();
                    states[0].pose.position.z = 1e-3 - corner.z;
                    dry.solids.restore(&states).unwrap();
                    let measured = parting(&mut dry, corner);
                    println!("{size:?} {axis} {angle} K {spring:e}: {measured:.4} for {asked}");
                    let off = (measured - asked).abs();
                    assert!(off < 0.02, "{size:?} {axis} {angle} K {spring:e}: {measured} for {asked}");
                }
            }
        }
    }
}

#[test]
fn a_ball_that_strikes_a_bar_at_its_end_leaves_it_as_asked() {
    for off in [0.0, 0.1, 0.18] {
        for asked in [0.2, 0.5, 0.8] {
            let mut dry = Dry::new(&format!(
                "[run]\nspacing = 0.02\ntime_step = 1e-4\nend = 1\ngravity = [0, 0, 0]\n\
                 [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.03\ncenter = [{off}, 0, 0.051]\ndensity = 2000\n\
                 velocity = [0, 0, -1]\n\
                 [[body]]\nname = \"bar\"\nsize = [0.4, 0.04, 0.04]\ncenter = [0, 0, 0]\ndensity = 1000\n\
                 [contact]\nspring = 1e6\nrestitution = {asked}\n"
            ));
            let measured = parting(&mut dry, DVec3::NEG_Z * 0.03);
            println!("{off} m off the middle: {measured:.4} for {asked}");
            assert!((measured - asked).abs() < 0.02, "{off}: {measured} for {asked}");
        }
    }
}
