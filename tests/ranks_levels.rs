//! Coarse levels of the multigrid that ranks share: a solve takes as many iterations as on one, and comes to the
//! same pressures. Scenes are flat, large and short: levels of fewer rows are not shared. Levels alone are tested
//! beside them, in `src/pressure/multigrid/tests.rs`.

use crate::common::*;
use crate::ranks::{Seen, apart, on_ranks};
use seixo::case::Case;
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::scene::Scene;
use seixo::share::Outlook;

/// Water 1.62 m deep that is let go in a tank that is dry behind it.
pub(crate) fn pool() -> Case {
    case(
        "[run]\nspacing = 0.01\ntime_step = 2e-4\nend = 1.0\ndimensions = 2\n\
         [fluid]\nsound_speed = 20\n\
         solver = { preconditioner = \"multigrid\", tolerance = 1e-7 }\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [3.98, 0, 1.62]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [5, 0, 1.8]\nopen = [\"z_max\"]\n",
    )
}

/// The same water round a tank, an odd number of columns long, with a velocity [m/s].
pub(crate) fn round(velocity: f64) -> Case {
    case(&format!(
        "[run]\nspacing = 0.01\ntime_step = 2e-4\nend = 1.0\ndimensions = 2\n\
         [fluid]\nsound_speed = 20\n\
         solver = {{ preconditioner = \"multigrid\", tolerance = 1e-7 }}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [4.02, 0, 1.62]\nvelocity = [{velocity}, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [4.02, 0, 1.8]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [[obstacle]]\nname = \"sill\"\nmin = [1, 0, 0]\nmax = [1.2, 0, 0.2]\n"
    ))
}

#[test]
fn shared_levels_take_as_many_iterations_to_the_same_pressures() {
    for (name, case, ranks) in [("pool", pool(), [2, 5]), ("round", round(0.1), [3, 8])] {
        let scene = Scene::build(&case).expect("it builds");
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        let (one, one_fields) = Seen::after(&mut simulation(&case), 4);
        // A pressure that is cut would be the same whatever it was.
        assert_eq!(one.counters.pressure_clamps, 0);
        let (mut cuts, mut most) = (Vec::new(), 0.0_f64);
        for ranks in ranks {
            let ((many, fields), stand) = on_ranks(&case, ranks, |s| Seen::after(s, 4));
            let [x, v, p] = apart(&one_fields, &fields);
            println!("{name} on {ranks}: {x:.1e} m, {v:.1e} m/s, {p:.1e} Pa; {:?}", many.iterations);
            assert!(x < 1e-12 && v < 1e-9 && p < 1e-4, "{name} on {ranks}: {x} {v} {p}");
            one.assert_near(&many, 1e-7, &format!("{name} on {ranks}"));
            most = fields.pressure.iter().fold(most, |m, p| m.max(*p));
            cuts.extend(stand[1..].iter().map(|r| r.columns[0]));
            let told = Outlook::new(ranks, &scene, &params, &plan).expect("told");
            // The particles twice, the first level four times, each further one six times if a pair of columns is
            // cut. From five ranks on three levels are shared, two before.
            let messages = 6 + 4 * (1 + u64::from(ranks >= 5));
            assert!(told.messages[1] >= messages, "{name} on {ranks}: {:?}", told.messages);
        }
        assert!(cuts.iter().any(|c| c % 2 == 1) && most > 1e3, "{cuts:?}, at most {most} Pa");
    }
}

#[test]
fn shared_levels_repeat_to_the_last_bit() {
    for (case, ranks) in [(pool(), 5), (round(0.1), 2)] {
        let run = || on_ranks(&case, ranks, |s| Seen::after(s, 2)).0.0;
        assert!(run() == run());
    }
}

/// Water in three of twenty columns of cells.
fn heap() -> Case {
    case(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
         [fluid]\nsound_speed = 5\njitter = 0.1\n\
         solver = { preconditioner = \"multigrid\", tolerance = 1e-9 }\n\
         [[fluid.block]]\nmin = [0.8, 0, 0]\nmax = [1.1, 0.6, 0.5]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2, 0.6, 1]\nopen = [\"z_max\"]\n",
    )
}

#[test]
fn ranks_without_water_take_as_many_iterations() {
    let case = heap();
    let (one, one_fields) = Seen::after(&mut simulation(&case), 10);
    for (ranks, dry) in [(3, false), (5, true), (8, true)] {
        let ((many, fields), stand) = on_ranks(&case, ranks, |s| Seen::after(s, 10));
        assert_eq!(stand.iter().any(|r| r.water == 0), dry, "{stand:?}");
        // A preconditioner that breaks down is left for the diagonal, with three times as many.
        one.assert_near(&many, 1e-7, &format!("heap on {ranks}"));
        let [x, v, p] = apart(&one_fields, &fields);
        assert!(x < 1e-8 && v < 1e-6 && p < 0.1, "{ranks}: {x} {v} {p}");
    }
}
