//! Contact: the acceptance numbers of the paper's law and of the smooth law, against analytic results.

use seixo::case::Law;
use seixo::study::incline::{Slide, coulomb_curve, travel_time};
use seixo::study::spring_drop::{CASES, Drop, Offset};
use seixo::study::spring_static::{amplitude, oscillation, oscillation_error};

#[test]
fn a1_the_resting_cube_swings_by_twice_its_sag() {
    for (spring, expected) in [(1e5, 16.70), (1e6, 1.67), (1e7, 0.17)] {
        let row = amplitude(Law::Paper, spring, 0.0, 5e-4, 10.0).unwrap();
        let percent = 100.0 * row.amplitude_over_l0;
        assert!((percent - expected).abs() < 0.05, "K = {spring:e}: {percent} % of l0");
    }
}

#[test]
fn a2_the_stiffest_cube_stays_when_it_starts_at_the_standing_distance() {
    let row = amplitude(Law::Paper, 5e7, 0.0, 5e-4, 10.0).unwrap();
    assert!(row.amplitude_over_l0 < 1e-3, "{row:?}");
}

#[test]
fn a3_the_critically_damped_cube_settles_by_its_sag() {
    for (spring, expected) in [(1e5, 8.35), (1e6, 0.83), (1e7, 0.083)] {
        let row = amplitude(Law::Paper, spring, 1.0, 5e-4, 10.0).unwrap();
        let percent = 100.0 * row.sag_over_l0;
        assert!((percent - expected).abs() < 0.01, "K = {spring:e}: {percent} % of l0");
    }
}

#[test]
fn a4_damping_curves_follow_the_oscillator() {
    for ratio in [1.0, 0.5, 0.1, 0.01] {
        let rows = oscillation(Law::Paper, 1e5, ratio, 5e-4, 1.0).unwrap();
        let error = oscillation_error(&rows, 1e5);
        assert!(error < 0.03, "C / C_crit = {ratio}: {error}");
    }
}

#[test]
fn a6_the_floor_holds_from_the_measured_threshold() {
    let case = CASES[2];
    for (offset, through, held) in
        [(Offset::Aligned, 2.5, 3.0), (Offset::StaggeredX, 4.1, 4.4), (Offset::StaggeredXy, 5.5, 5.8)]
    {
        for (factor, expected) in [(through, false), (held, true)] {
            let drop = Drop::new(case, factor * case.smallest_spring());
            let row = Drop { offset, time_step: 5e-5, ..drop }.run(false).unwrap();
            assert_eq!(row.held, expected, "{offset:?} at {factor} K_min");
        }
    }
}

#[test]
fn a9_without_friction_the_block_falls_freely_along_the_plane() {
    let row = Slide::new(Law::Paper).run(2.0).unwrap();
    assert!((row.time - 0.7590).abs() < 5e-4, "{row:?}");
}

#[test]
fn a12_coulomb_friction_takes_the_time_of_eq_21() {
    for row in coulomb_curve(Slide::new(Law::Smooth)).unwrap() {
        assert!(row.error.abs() < 1e-3, "{row:?}");
    }
    assert!((travel_time(45_f64.to_radians(), 0.3, 2.0) - 0.9078).abs() < 1e-4);
}

#[test]
fn a13_the_block_sticks_on_a_slope_below_the_angle_of_friction() {
    for friction in [1.05, 1.2] {
        let row = Slide { friction, ..Slide::new(Law::Smooth) }.run(10.0).unwrap();
        assert!(row.distance.abs() < 1e-4, "{row:?}");
    }
}
