//! Walls that never move: a rank has those near its slab, wherever the cuts go, and computes with them what one rank computes with all of them.

use crate::common::{case, simulation};
use crate::ranks::{Seen, on_ranks};
use seixo::case::Case;
use seixo::params::Params;
use seixo::ranks::Standing;
use seixo::scene::Scene;
use std::ops::Range;

/// A block of water that shoots along a flume over steps and past a post, with a log before it, gauges on all of it; round periodic x if `ring`.
fn shot(ring: bool, more: &str) -> Case {
    let periodic = if ring { "periodic = [\"x\"]\n" } else { "" };
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
         [fluid]\nsound_speed = 8\njitter = 0.1\nviscosity = 1e-3\nwall_friction = 0.1\n{more}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.3, 0.4]\nvelocity = [8, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [3.0, 0.3, 0.6]\nopen = [\"z_max\"]\n{periodic}\
         [[obstacle]]\nname = \"step\"\nmin = [1.0, 0, 0]\nmax = [1.1, 0.3, 0.1]\n\
         [[obstacle]]\nname = \"post\"\nmin = [1.5, 0.1, 0]\nmax = [1.6, 0.2, 0.6]\n\
         [[body]]\nname = \"log\"\nsize = [0.1, 0.2, 0.1]\ncenter = [0.75, 0.15, 0.06]\ndensity = 600\nstanding = true\n\
         [contact]\nspring = 1e5\nfriction = 0.3\n\
         [gauge]\nevery = 0.01\n[[gauge.force]]\nname = \"step\"\non = \"step\"\n[[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n\
         [[gauge.pressure]]\nname = \"bed\"\npoint = [0.7, 0.15, 0]\n\
         [output]\nledger = true\n"
    ))
}

/// How many particles that never move stand in `columns` and in two more on either side.
fn near(case: &Case, columns: Range<i64>, ring: bool) -> usize {
    let scene = Scene::build(case).expect("it builds");
    let params = Params::new(case, &scene).expect("constants");
    let length = params.domain_max.x - params.domain_min.x;
    let count = if ring {
        (length / params.effective_radius * (1.0 + 1e-12)).floor()
    } else {
        (length / params.effective_radius).floor() + 1.0
    };
    let width = if ring { length / count } else { params.effective_radius };
    let column = |x: f64| {
        let c = ((x - params.domain_min.x) / width).floor() as i64;
        if ring { c.rem_euclid(count as i64) } else { c.clamp(0, count as i64 - 1) }
    };
    let is_near = |c: i64| {
        let way = |to: i64| if ring { (c - to).rem_euclid(count as i64) } else { (c - to).abs() };
        columns
            .clone()
            .any(|to| way(to).min(if ring { way(to).abs_diff(count as i64) as i64 } else { way(to) }) <= 2)
    };
    scene.position[scene.groups.static_range()].iter().filter(|x| is_near(column(x.x))).count()
}

#[test]
fn a_rank_has_the_walls_near_its_slab_and_computes_with_them_what_one_computes_with_all() {
    // Solved further than what is compared: a solve that ends an iteration earlier is no other run.
    let alone = "solver = { tolerance = 1e-10 }";
    let multigrid = "solver = { tolerance = 1e-10, preconditioner = \"multigrid\" }";
    for (ring, more, ranks, tolerance) in [
        (false, alone, 3, 1e-9),
        (false, alone, 9, 1e-9),
        (false, multigrid, 4, 1e-5),
        (true, alone, 2, 1e-9),
        (true, alone, 6, 1e-9),
    ] {
        let case = shot(ring, more);
        let steps = 64;
        let one = Seen::after(&mut simulation(&case), steps).0;
        let ((first, many), last): ((Vec<Standing>, Seen), _) = on_ranks(&case, ranks, |s| {
            s.step().expect("a step");
            let first = s.backend.ranks().expect("they stand");
            let mut seen = Seen::after(s, steps - 1).0;
            seen.iterations.insert(0, one.iterations[0]);
            (first, seen)
        });
        let cuts = |of: &[Standing]| of.iter().map(|r| r.columns[0]).collect::<Vec<_>>();
        println!("{ranks} ranks, ring {ring}: cuts {:?}, then {:?}", cuts(&first), cuts(&last));
        assert_ne!(cuts(&first), cuts(&last), "the tank is cut anew");
        one.assert_near(&many, tolerance, &format!("{ranks} ranks, ring {ring}"));
        for rank in first.iter().chain(&last) {
            let [from, to] = rank.columns.map(i64::from);
            assert_eq!(rank.still, near(&case, from..to, ring), "{rank:?}");
        }
        let all = simulation(&case).scene.groups.static_range().len();
        // The last one has the dry end of the tank.
        assert!(ranks < 6 || last[..ranks - 1].iter().all(|r| 2 * r.still < all), "{all}: {last:?}");
    }
}
