//! Ranks: that many of them compute what one computes, to the last bit twice, whatever crosses the cuts between them.

use crate::common;
use crate::openings_covered::{lifted, pond};
use common::*;
use glam::DVec3;
use seixo::Error;
use seixo::backend::{Counters, Processor};
use seixo::case::{Case, OutputField};
use seixo::checkpoint::Archive;
use seixo::fields::Fields;
use seixo::ledger::{Entry, Ledger};
use seixo::monitor::FluidMonitor;
use seixo::on_ranks::{serve, serve_on};
use seixo::output::folder::series_in;
use seixo::output::particles::Particles;
use seixo::output::replay::{Frame, frames, particles};
use seixo::output::result::Status;
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::ranks::Standing;
use seixo::ranks::threads::team;
use seixo::run::resume::{Standing as Left, standing};
use seixo::run::{Finished, Options, Start, run};
use seixo::scene::Scene;
use seixo::share::Outlook;
use seixo::simulation::Simulation;
use seixo::stop::Stop;
use std::path::Path;
use std::sync::Arc;

/// What `of` says of a simulation of `case` on `ranks` threads, and how these stand then.
pub(crate) fn on_ranks<T: Send>(
    case: &Case,
    ranks: usize,
    of: impl FnOnce(&mut Simulation) -> T + Send,
) -> (T, Vec<Standing>) {
    on_ranks_of(case, ranks, &Processor::Cpu, of)
}

/// The same, each on its `processor`.
pub(crate) fn on_ranks_of<T: Send>(
    case: &Case,
    ranks: usize,
    processor: &Processor,
    of: impl FnOnce(&mut Simulation) -> T + Send,
) -> (T, Vec<Standing>) {
    let scene = Arc::new(Scene::build(case).expect("the scene builds"));
    let mut team = team(ranks).into_iter();
    let first = team.next().expect("a rank");
    std::thread::scope(|scope| {
        for rank in team {
            scope.spawn(move || {
                alone();
                let set_up = || Ok(case.clone());
                serve_on(&rank, processor, set_up).expect("it serves").expect("they begin");
            });
        }
        let lead = scope.spawn(move || {
            alone();
            let mut simulation = Simulation::on_ranks_of(case, scene, &first, processor).expect("it starts");
            let out = of(&mut simulation);
            (out, simulation.backend.ranks().expect("they stand"))
        });
        lead.join().expect("the first rank ends well")
    })
}

pub(crate) fn shipped(name: &str, changes: &[&str]) -> Case {
    let sets: Vec<String> = changes.iter().map(|s| (*s).to_string()).collect();
    let path = format!("{ROOT}/cases/{name}.toml");
    seixo::case::file::load(path.as_ref(), None, &sets).expect("it loads").case
}

pub(crate) fn steps(simulation: &mut Simulation, n: u64) -> Fields {
    for _ in 0..n {
        simulation.step().expect("a step");
    }
    simulation.fields().expect("the fields")
}

/// Largest differences of the water's positions [m], velocities [m/s] and pressures [Pa], particle by particle.
pub(crate) fn apart(a: &Fields, b: &Fields) -> [f64; 3] {
    let place = |f: &Fields| {
        let mut at = vec![usize::MAX; f.id.len()];
        f.id.iter().enumerate().for_each(|(i, &id)| at[id as usize] = i);
        at
    };
    let (a_at, b_at) = (place(a), place(b));
    let mut out = [0.0_f64; 3];
    for (&i, &j) in a_at.iter().zip(&b_at) {
        assert_eq!(a.kind[i], b.kind[j]);
        out[0] = out[0].max(a.position[i].distance(b.position[j]));
        out[1] = out[1].max(a.velocity[i].distance(b.velocity[j]));
        out[2] = out[2].max((a.pressure[i] - b.pressure[j]).abs());
    }
    for i in a.id.len()..a.pressure.len() {
        out[2] = out[2].max((a.pressure[i] - b.pressure[i]).abs());
    }
    out
}

/// A flume round periodic y: viscous water, a sill, a gate that rises, a ball under water, an absorber, a body that floats and one that sinks
/// across the tank, friction, gauges, and the ledger.
pub(crate) fn flume(more: &str) -> Case {
    case(&flume_text(more))
}

pub(crate) fn flume_text(more: &str) -> String {
    format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0.5, -9.81]\n\
         [fluid]\nviscosity = 1e-3\nsound_speed = 5\njitter = 0.1\n{more}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0.6, 0.4]\n\
         [[absorber]]\nmin = [0.0, 0, 0]\nmax = [0.3, 0.6, 1.0]\ntowards = \"x_min\"\nrate = 5\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2.0, 0.6, 1.0]\nopen = [\"z_max\"]\nperiodic = [\"y\"]\n\
         [[obstacle]]\nname = \"sill\"\nmin = [1.2, 0, 0]\nmax = [1.3, 0.6, 0.1]\n\
         [[moving_wall]]\nname = \"gate\"\nmin = [0.8, 0, 0.05]\nmax = [0.9, 0.6, 0.6]\n\
         motion = [[0, 0, 0, 0], [1, 0, 0, 2]]\n\
         [[body]]\nname = \"floats\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.5, 0.3, 0.55]\ndensity = 500\nvelocity = [2, 0, 0]\n\
         [[body]]\nname = \"sinks\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.2, 0.3, 0.7]\ndensity = 3000\nvelocity = [1, 0, -1]\n\
         [contact]\nspring = 1e5\nfriction = 0.3\n\
         [gauge]\nevery = 0.01\n[[gauge.force]]\nname = \"sill\"\non = \"sill\"\n\
         [[gauge.level]]\nname = \"level\"\nat = [0.4, 0.3]\n[[gauge.pressure]]\nname = \"floor\"\npoint = [0.3, 0.3, 0]\n\
         [output]\nledger = true\n"
    )
}

/// What can be seen of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Seen {
    fields: Vec<u8>,
    pub(crate) water: FluidMonitor,
    pub(crate) counters: Counters,
    pub(crate) ledger: Option<Ledger>,
    pub(crate) gauges: Vec<(String, u64)>,
    pub(crate) solids: Vec<[DVec3; 3]>,
    pub(crate) iterations: Vec<u32>,
}

impl Seen {
    /// After `n` steps more.
    pub(crate) fn after(simulation: &mut Simulation, n: u64) -> (Self, Fields) {
        let iterations = (0..n).map(|_| simulation.step().expect("a step").pressure.iterations).collect();
        let (water, counters) = simulation.observe().expect("seen");
        let ledger = simulation.ledger().expect("kept");
        let gauges =
            simulation.gauges().expect("read").into_iter().map(|(name, v)| (name, v.to_bits())).collect();
        let of = |s: seixo::SolidState| [s.pose.position, s.pose.velocity, s.fluid.force];
        let solids = simulation.solids().map(of).collect();
        let fields = simulation.fields().expect("the fields");
        let mut bytes = bytemuck::cast_slice(&fields.position).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&fields.velocity));
        bytes.extend_from_slice(bytemuck::cast_slice(&fields.pressure));
        bytes.extend_from_slice(bytemuck::cast_slice(&fields.id));
        (Self { fields: bytes, water, counters, ledger, gauges, solids, iterations }, fields)
    }

    /// Asserts that another run came to the same, but for `tolerance` of each number's size.
    pub(crate) fn assert_near(&self, other: &Self, tolerance: f64, what: &str) {
        let near =
            |a: f64, b: f64, scale: f64| (a - b).abs() <= tolerance * scale || a.is_nan() && b.is_nan();
        let [a, b] = [&self.water, &other.water];
        assert_eq!((a.particles, a.inner), (b.particles, b.inner), "{what}");
        assert!(
            near(a.kinetic, b.kinetic, a.kinetic) && near(a.potential, b.potential, a.potential.abs()),
            "{what}: {a:?} {b:?}"
        );
        assert!(
            near(a.density_error_max, b.density_error_max, 1.0)
                && near(a.speed_max, b.speed_max, a.speed_max),
            "{what}"
        );
        assert!((0..3).all(|k| near(a.extent_max[k], b.extent_max[k], 1.0)), "{what}");
        let same = |c: &Counters| (c.lost, c.displacement_clamps, c.neighbours_max, c.swallowed.clone());
        assert_eq!(same(&self.counters), same(&other.counters), "{what}");
        assert_eq!(self.iterations.len(), other.iterations.len());
        let differ = self.iterations.iter().zip(&other.iterations).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(differ <= Some(1), "{what}: {:?} {:?}", self.iterations, other.iterations);
        let first = self.iterations.iter().zip(&other.iterations).position(|(a, b)| a != b);
        println!(
            "{what}: a solve takes another number of iterations in step {first:?} of {}",
            self.iterations.len()
        );
        assert_eq!(self.ledger.is_some(), other.ledger.is_some());
        if let (Some(a), Some(b)) = (&self.ledger, &other.ledger) {
            let size = Entry::ALL.iter().map(|&e| a.get(e).abs()).fold(0.0, f64::max);
            assert!(Entry::ALL.iter().all(|&e| near(a.get(e), b.get(e), size)), "{what}: {a:?} {b:?}");
        }
        for ((name, a), (_, b)) in self.gauges.iter().zip(&other.gauges) {
            let (a, b) = (f64::from_bits(*a), f64::from_bits(*b));
            assert!(near(a, b, a.abs().max(1.0)), "{what}: {name} {a} {b}");
        }
        for (a, b) in self.solids.iter().zip(&other.solids) {
            assert!(
                (0..3).all(|k| a[k].distance(b[k]) <= tolerance * a[k].length().max(1.0)),
                "{what}: {a:?} {b:?}"
            );
        }
    }
}

/// A scene, how many steps of it are computed, on how many ranks, and how far positions may be off [m].
type Tried<'a> = (&'a str, Case, u64, &'a [usize], f64);

#[test]
fn many_ranks_compute_what_one_computes() {
    let transport =
        |more: &str| shipped("dam_break_transport", &["run.spacing=0.03", "output.ledger=true", more]);
    // With multigrid in f32 the order of its cells is seen in what it leaves to the iterations.
    compare(&[
        ("transport", transport("fluid.jitter=0.05"), 12, &[2, 5], 1e-11),
        ("transport, multigrid", transport("fluid.solver.preconditioner=\"multigrid\""), 12, &[8], 1e-7),
        ("transport, paper", transport("fluid.preset=\"paper\""), 6, &[4], 1e-11),
        ("plane", shipped("dam_break_2d", &["fluid.solver.tolerance=1e-9"]), 20, &[4], 1e-11),
        ("flume", flume(""), 45, &[2, 4], 1e-11),
        ("flume, multigrid", flume("solver = { preconditioner = \"multigrid\" }"), 45, &[3], 1e-7),
        ("full", full("solver = { tolerance = 1e-9 }"), 20, &[3], 1e-9),
    ]);
}

#[test]
fn many_ranks_round_a_tank_compute_what_one_computes() {
    let multigrid = "jitter = 0.1\nsolver = { preconditioner = \"multigrid\" }";
    let fast =
        |bodies: &str| bodies.replace("[-2, 0, -0.5]", "[-4, 0, -1]").replace("[2, 0, 0]", "[4, 0, 0]");
    // The first and the last rank are neighbours: two on both sides, more with a column each at least.
    compare(&[
        ("ring", ring(3.0, "jitter = 0.1", DRIVEN), 25, &[2, 5], 1e-11),
        ("ring, multigrid", ring(3.0, multigrid, DRIVEN), 25, &[4], 1e-7),
        ("ring of bodies", ring(3.0, "jitter = 0.1", &fast(FREE)), 30, &[2], 1e-11),
        ("bodies over the seam of a ring", ring(3.0, "jitter = 0.1", &fast(&over())), 30, &[3], 1e-11),
        ("ring, narrow", narrow(), 30, &[4], 1e-11),
    ]);
}

#[test]
fn many_ranks_with_openings_compute_what_one_computes() {
    compare(&[
        ("channel", shipped("channel", &["run.spacing=0.04"]), 90, &[3], 1e-8),
        ("holes", holes(), 100, &[3], 1e-8),
        // Beams before the inflow hold back parts of its layers.
        ("beams", case(&pond("velocity = 0.4", &lifted([0.0, 0.06]))), 100, &[2], 1e-6),
    ]);
}

/// Holds ranks against one.
fn compare(tried: &[Tried]) {
    for &(name, ref case, steps, ranks, tolerance) in tried {
        let (one, one_fields) = Seen::after(&mut simulation(case), steps);
        for &ranks in ranks {
            let ((many, fields), said) = on_ranks(case, ranks, |s| Seen::after(s, steps));
            // Water that comes in gets other numbers.
            if one.counters.swallowed.is_empty() {
                let [x, v, p] = apart(&one_fields, &fields);
                println!(
                    "{name}: {ranks} ranks are {x:.1e} m, {v:.1e} m/s, {p:.1e} Pa from one; {:?}",
                    said[0]
                );
                assert!(
                    x < tolerance && v < 1e2 * tolerance && p < 1e6 * tolerance,
                    "{name} on {ranks}: {x} {v} {p}"
                );
            }
            one.assert_near(&many, tolerance, &format!("{name} on {ranks}"));
        }
        let opened = name == "channel" || name == "holes";
        assert!(!opened || one.counters.swallowed.iter().all(|&n| n > 0), "water has gone out");
    }
}

/// A tank that runs empty through its floor and an end, with room for the jets outside.
fn holes() -> Case {
    case(
        "[run]\nspacing = 0.02\ntime_step = 2e-3\nend = 1.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\nsound_speed = 5\nsolver = { tolerance = 1e-9 }\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.4]\nvelocity = [0.5, 0, 0]\n\
         [[outflow]]\nname = \"floor\"\nface = \"z_min\"\nmin = [0.2, 0, 0]\nmax = [0.32, 0, 0]\n\
         [[outflow]]\nname = \"end\"\nface = \"x_max\"\nmin = [1, 0, 0.1]\nmax = [1, 0, 0.22]\n",
    )
}

/// Water round periodic x: viscous, over a sill, with `velocity` [m/s] across the seam, and `more`.
pub(crate) fn ring(velocity: f64, fluid: &str, more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0.5, 0, -9.81]\n\
         [fluid]\nviscosity = 1e-3\nsound_speed = 5\n{fluid}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [2.0, 0.6, 0.4]\nvelocity = [{velocity}, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2.0, 0.6, 1.0]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n\
         [[obstacle]]\nname = \"sill\"\nmin = [1.2, 0, 0]\nmax = [1.3, 0.6, 0.1]\n{more}\
         [gauge]\nevery = 0.01\n[[gauge.force]]\nname = \"sill\"\non = \"sill\"\n\
         [[gauge.level]]\nname = \"level\"\nat = [0.0, 0.3]\n[[gauge.pressure]]\nname = \"floor\"\npoint = [2.0, 0.3, 0]\n\
         [output]\nledger = true\n"
    ))
}

/// A block that is driven through the water across the seam.
pub(crate) const DRIVEN: &str = "[[moving_wall]]\nname = \"plunger\"\nmin = [0.05, 0.2, 0.1]\nmax = [0.25, 0.4, 0.3]\nmotion = [[0, 0, 0, 0], [1, -3, 0, 0]]\n";

/// A body in the water and one on it, which cross the cut between two ranks in both directions.
pub(crate) const FREE: &str = "[[body]]\nname = \"floats\"\nsize = [0.2, 0.2, 0.2]\ncenter = [1.2, 0.2, 0.52]\ndensity = 500\nvelocity = [-2, 0, -0.5]\n\
                    [[body]]\nname = \"sinks\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.9, 0.45, 0.2]\ndensity = 3000\nvelocity = [2, 0, 0]\n\
                    displaces_fluid = true\n[contact]\nspring = 1e5\nfriction = 0.3\n";

/// The same, which cross the side where the first and the last rank are neighbours.
pub(crate) fn over() -> String {
    FREE.replace("[1.2, 0.2, 0.52]", "[0.11, 0.2, 0.52]").replace("[0.9, 0.45, 0.2]", "[1.89, 0.45, 0.2]")
}

/// A ring of four columns of cells.
fn narrow() -> Case {
    case(
        "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\n[fluid]\nsound_speed = 5\njitter = 0.2\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.9, 1, 0.5]\nvelocity = [-2, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.9, 1, 1]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n",
    )
}

/// A closed tank full of water round a body that is heavier: no free surface.
pub(crate) fn full(more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ngravity = [0, 0, -10]\n\
         [fluid]\nsound_speed = 5\n{more}\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 0.4, 0.5]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.4, 0.5]\nopen = []\n\
         [[body]]\nname = \"cube\"\nsize = [0.15, 0.15, 0.15]\ncenter = [0.4, 0.2, 0.3]\ndensity = 2000\nvelocity = [1, 0, 0]\ndisplaces_fluid = true\n[contact]\nspring = 1e5\n"
    ))
}

#[test]
fn a_run_repeats_to_the_last_bit_whatever_the_threads_of_its_ranks() {
    let around = ring(1.5, "jitter = 0.1\nsolver = { preconditioner = \"multigrid\" }", DRIVEN);
    let two = || on_ranks(&around, 2, |s| Seen::after(s, 30)).0.0;
    assert_eq!(two(), two());
    let case = flume("solver = { preconditioner = \"multigrid\" }");
    let run = || on_ranks(&case, 3, |s| Seen::after(s, 30)).0.0;
    let first = run();
    assert_eq!(first, run());
    // A rank computes on the pool that it stands in.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    let scene = Arc::new(Scene::build(&case).expect("the scene builds"));
    let mut ends = team(3).into_iter();
    let lead = ends.next().expect("a rank");
    let threaded = std::thread::scope(|scope| {
        for rank in ends {
            let case = &case;
            scope.spawn(move || {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
                pool.install(|| serve(&rank, || Ok(case.clone())).map(drop).expect("it serves"));
            });
        }
        pool.install(|| {
            let mut simulation = Simulation::on_ranks(&case, scene.clone(), &lead).expect("it starts");
            Seen::after(&mut simulation, 30).0
        })
    });
    assert_eq!(first, threaded);
}

#[test]
fn the_cuts_follow_the_water() {
    let case = shipped("dam_break_2d", &[]);
    let water = Scene::build(&case).expect("it builds").water();
    let ((front, first), last) = on_ranks(&case, 4, |simulation| {
        simulation.step().expect("a step");
        let first = simulation.backend.ranks().expect("they stand");
        while simulation.time < 0.4 {
            simulation.step().expect("a step");
        }
        (simulation.observe().expect("seen").0.extent_max[0], first)
    });
    println!("front {front} m\n{first:?}\n{last:?}");
    assert!(front > 0.45, "{front}");
    for (ranks, late) in [(&first, false), (&last, true)] {
        assert_eq!(ranks.iter().map(|r| r.water).sum::<usize>(), water, "none is lost or twice there");
        assert!(ranks.windows(2).all(|r| r[0].columns[1] == r[1].columns[0]));
        // The water began in the first fourteen columns.
        assert_eq!(ranks[3].columns[0] > 20, late, "{ranks:?}");
        let most = ranks.iter().map(|r| r.water).max().expect("ranks");
        // A column is a tenth of the water at first.
        assert!(4 * most < water + water / 2, "{most} of {water}: {ranks:?}");
        assert!(ranks.iter().all(|r| r.copies > 0 && r.walls > 0));
    }
}

/// Water that runs fast along the floor of a tank, and what a gauge tells of that after each of the first steps, in which the tank is cut anew twice.
pub(crate) fn felt_by_a_floor(simulation: &mut Simulation) -> Vec<Vec<f64>> {
    let told = |s: &mut Simulation| s.gauges().expect("read").into_iter().map(|(_, value)| value).collect();
    let step = |_| {
        simulation.step().expect("a step");
        told(simulation)
    };
    (0..45).map(step).collect()
}

pub(crate) fn fast_over_a_floor(tolerance: f64) -> Case {
    case(&format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\n\
         [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\nopen = [\"z_max\"]\n\
         [fluid]\nviscosity = 1e-2\nsolver = {{ tolerance = {tolerance} }}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0, 0.3]\nvelocity = [2, 0, 0]\n\
         [[gauge.force]]\nname = \"floor\"\non = \"tank.z_min\"\n"
    ))
}

/// Asserts that many ranks, which stand so at the end, told the same as one after every step, to a `part` of the largest of each number.
pub(crate) fn assert_felt(one: &[Vec<f64>], many: &[Vec<f64>], said: &[Standing], part: f64) {
    // They began with the ten columns of the water.
    assert!(said[said.len() - 1].columns[0] > 5, "cut anew: {said:?}");
    for k in 0..one[0].len() {
        let most = one.iter().map(|told| told[k].abs()).fold(0.0, f64::max);
        for (step, (a, b)) in one.iter().zip(many).enumerate() {
            assert!((a[k] - b[k]).abs() <= part * most, "number {k}, step {step}: {} {} {most}", a[k], b[k]);
        }
    }
}

/// What viscosity has done to a fixed wall in the step in which the tank is cut anew goes with it to the rank whose it is then.
#[test]
fn a_gauge_on_a_fixed_wall_knows_all_of_the_step_in_which_the_tank_is_cut_anew() {
    let case = fast_over_a_floor(1e-11);
    let one = felt_by_a_floor(&mut simulation(&case));
    for ranks in [2, 3] {
        let (many, said) = on_ranks(&case, ranks, felt_by_a_floor);
        assert_felt(&one, &many, &said, 1e-6);
    }
}

#[test]
fn plan_tells_what_ranks_have_and_say() {
    for (case, ranks) in [
        (
            shipped(
                "dam_break_transport",
                &["run.spacing=0.02", "fluid.solver.preconditioner=\"multigrid\""],
            ),
            3,
        ),
        (shipped("dam_break_2d", &[]), 4),
        (ring(0.0, "solver = { preconditioner = \"multigrid\" }", FREE), 3),
        (crate::ranks_levels::pool(), 5),
        (crate::ranks_levels::round(0.0), 3),
    ] {
        let scene = Scene::build(&case).expect("it builds");
        let around = scene.periodic.is_along(0);
        let params = Params::new(&case, &scene).expect("valid");
        let told = Outlook::new(ranks, &scene, &params, &Plan::new(&case, &scene, &params)).expect("told");
        let stand = |steps| {
            on_ranks(&case, ranks, |s| {
                (0..steps).map(|_| u64::from(s.step().expect("a step").pressure.iterations)).sum::<u64>()
            })
        };
        // The first step looks at the water, which is not a part of every step.
        let ((before, first), (all, second)) = (stand(1), stand(4));
        let iterations: u64 = all - before;
        for (k, part) in told.parts.iter().enumerate() {
            let (a, b) = (&first[k], &second[k]);
            assert_eq!(
                (part.columns, part.water, part.copies, part.walls),
                (a.columns, a.water, a.copies, a.walls)
            );
            let beside = u64::from(k > 0 || around) + u64::from(k + 1 < ranks || around);
            assert_eq!(
                b.messages - a.messages,
                beside * (3 * told.messages[0] + iterations * told.messages[1])
            );
            assert_eq!(b.rounds - a.rounds, 3 * told.rounds[0] + iterations * told.rounds[1]);
        }
        let bytes: u64 = second.iter().zip(&first).map(|(b, a)| b.message_bytes - a.message_bytes).sum();
        let sides = 2 * (ranks as u64 - u64::from(!around));
        let most = sides * (3 * told.message_bytes[0] + iterations * told.message_bytes[1])
            + 3 * told.round_bytes[0]
            + iterations * told.round_bytes[1];
        // The largest border stands for all of them; numbers that are summed and cells of walls are not counted.
        assert!((0.7..1.1).contains(&(bytes as f64 / most as f64)), "{bytes} said, at most {most} told");
    }
}

#[test]
fn memory_is_shared() {
    let case = shipped("dam_break_transport", &["run.spacing=0.0125"]);
    let of = |ranks| on_ranks(&case, ranks, |s| drop(steps(s, 2))).1;
    let (one, four) = (of(1), of(4));
    println!("{one:?}\n{four:?}");
    // The last one has the dry end of the tank.
    assert!(four.iter().all(|r| r.bytes < one[0].bytes * 3 / 5), "{four:?}");
    assert!(four[..3].iter().all(|r| r.bytes < one[0].bytes / 3), "{four:?}");
    assert!(four[..3].iter().all(|r| 3 * r.still < one[0].still), "{four:?}");
    assert_eq!(four.iter().map(|r| r.water).sum::<usize>(), one[0].water);
}

#[test]
fn a_state_goes_on_on_any_number_of_ranks() {
    for (case, tolerance) in [
        (shipped("dam_break_transport", &["run.spacing=0.03"]), 1e-9),
        (flume(""), 1e-4),
        (ring(1.5, "jitter = 0.1", FREE), 1e-4),
    ] {
        let save = |s: &mut Simulation| {
            let mut archive = Archive::new();
            s.exchange(&mut archive).expect("saved");
            archive.to_restore()
        };
        let undisturbed = Seen::after(&mut simulation(&case), 20).0;
        let (of_many, _) = on_ranks(&case, 3, |s| {
            steps(s, 10);
            save(s)
        });
        let of_one = {
            let mut s = simulation(&case);
            steps(&mut s, 10);
            save(&mut s)
        };
        let go_on = |s: &mut Simulation, state: &Archive| {
            s.exchange(&mut state.to_restore()).expect("restored");
            assert_eq!(s.steps, 10);
            let mut seen = Seen::after(s, 10).0;
            seen.iterations = undisturbed.iterations.clone();
            seen
        };
        for (what, state) in [("of three", &of_many), ("of one", &of_one)] {
            if what == "of three" {
                undisturbed.assert_near(&go_on(&mut simulation(&case), state), tolerance, "of three, on one");
            }
            for &ranks in if what == "of three" { &[2, 4][..] } else { &[4][..] } {
                let (seen, _) = on_ranks(&case, ranks, |s| go_on(s, state));
                undisturbed.assert_near(&seen, tolerance, &format!("{what}, on {ranks}"));
            }
        }
    }
}

#[test]
fn what_ranks_keep_in_memory_is_the_state_of_that_moment() {
    for case in [flume(""), ring(1.5, "jitter = 0.1", DRIVEN)] {
        let ((kept, saved, later), _) = on_ranks(&case, 3, |s| {
            let state = |s: &mut Simulation, mut archive: Archive| {
                s.exchange(&mut archive).expect("saved");
                archive
            };
            steps(s, 10);
            // Another one before it, which it takes the place of.
            state(s, Archive::in_memory());
            steps(s, 15);
            let (mut kept, saved) = (state(s, Archive::in_memory()), state(s, Archive::new()));
            assert!(!kept.sections.contains_key("position") && saved.sections.contains_key("position"));
            // Cut anew meanwhile, if the water is.
            steps(s, 20);
            s.backend.lead().expect("many").complete(&mut kept).expect("gathered");
            (kept, saved, state(s, Archive::new()))
        });
        assert_eq!(kept.numbers, saved.numbers);
        for (name, section) in &saved.sections {
            assert!(kept.sections.get(name) == Some(section), "{name}");
        }
        assert_eq!(kept.sections.len(), saved.sections.len());
        assert!(later.sections["position"] != kept.sections["position"]);
    }
}

#[test]
fn ranks_that_diverge_leave_the_last_good_state_and_that_in_which_it_was_found() {
    let text = flume_text("")
        .replace("max = [0.8, 0.6, 0.4]", "max = [0.8, 0.6, 0.4]\nvelocity = [0, 0, 400]")
        + "every = 0.001\n";
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let finished = run_on(&text, 3, &out, 1000);
    let (error, reason) = (finished.error.expect("it diverges"), finished.summary.exit_reason);
    assert!(finished.summary.status == Status::Diverged && error.exit_code() == 4, "{error}");
    assert!(reason.contains("is in checkpoint/") && reason.contains("vtu/last_*.vtu"), "{reason}");
    let last = particles(&out.join("vtu/last_fluid.pvtu")).expect("it is read");
    assert!(!last.is_empty() && out.join("vtu/last_fluid_2.vtu").exists());
    let found = seixo::checkpoint::file::newest(&out.join("checkpoint")).expect("read").expect("a state");
    let mut one = simulation(&case(&text));
    one.exchange(&mut found.archive.to_restore()).expect("it fits");
    assert_eq!(one.steps, found.origin.step);
}

/// What the first of `ranks` that cannot begin says of `case`; one of them, `lacks`, cannot set it up.
fn refusal(case: &Case, ranks: usize, lacks: Option<usize>) -> String {
    let scene = Arc::new(Scene::build(case).expect("it builds"));
    let mut ends = team(ranks).into_iter();
    let lead = ends.next().expect("a rank");
    std::thread::scope(|scope| {
        for rank in ends {
            let case = case.clone();
            scope.spawn(move || {
                alone();
                let set_up = || match Some(rank.rank()) == lacks {
                    true => Err(Error::Senseless("hull.stl: no such file".into())),
                    false => Ok(case),
                };
                assert!(serve(&rank, set_up).expect("no fault of its own").is_none());
            });
        }
        Simulation::on_ranks(case, scene.clone(), &lead).err().expect("refused").to_string()
    })
}

#[test]
fn what_ranks_cannot_compute_is_refused_by_all_of_them() {
    let dry = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\n[[body]]\nname = \"cube\"\nsize = [1, 1, 1]\ncenter = [0, 0, 2]\nmass = 1\n\
               [contact]\nspring = 1e5\n[[obstacle]]\nname = \"floor\"\nmin = [-2, -2, -0.5]\nmax = [2, 2, 0]\n";
    let periodic = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.7, 1, 0.5]\n\
                    [tank]\nmin = [0, 0, 0]\nmax = [0.7, 1, 1]\nopen = [\"z_max\"]\nperiodic = [\"x\"]\n";
    let short = "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 1.0\n[fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.2]\n\
                 [tank]\nmin = [0, 0, 0]\nmax = [0.4, 0.4, 0.4]\nopen = [\"z_max\"]\n";
    let near = short
        .replace("[run]", "[run]\neffective_radius = 1.5")
        .replace("[fluid]", "[fluid]\ncollision_distance = 0.9");
    for (text, ranks, words) in [
        (dry, 2, "there is no water"),
        (
            periodic,
            2,
            "only 3 columns of cells along x, of which each rank takes two or more where they meet at both ends",
        ),
        (periodic, 4, "4 ranks, but only 3 columns"),
        (short, 30, "30 ranks, but only"),
        (&near, 2, "more than half of run.effective_radius"),
    ] {
        let error = refusal(&case(text), ranks, None);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn what_one_rank_cannot_set_up_ends_all() {
    assert_eq!(refusal(&flume(""), 3, Some(2)), "rank 2 of 3: hull.stl: no such file");
}

#[test]
fn a_program_without_mpi_does_not_compute_a_case_many_times() {
    let out = program()
        .args(["run", &format!("{ROOT}/cases/dam_break_2d.toml"), "-o", "/nonexistent"])
        .env("OMPI_COMM_WORLD_SIZE", "4")
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(said.contains("one of 4 processes, but this seixo was built without MPI"), "{said}");
}

/// A run of the case `text` on `ranks` threads, to step `steps`, from where the folder `out` has it.
fn run_on(text: &str, ranks: usize, out: &Path, steps: u64) -> Finished {
    let case = case(text);
    let start = match standing(out, &case).expect("it stands") {
        Left::Nothing => Start::New,
        Left::Stopped(found) => Start::Resume(found),
        other => panic!("{other:?}"),
    };
    let (name, out) = ("flume".into(), out.into());
    let options = Options { name, out, start, steps: Some(steps), ..Options::default() };
    let go = |simulation: &mut Simulation| {
        let scene = simulation.scene.clone();
        run(simulation, &scene, text, options, &Stop::default(), &mut |_| ()).expect("it begins")
    };
    if ranks == 1 { go(&mut simulation(&case)) } else { on_ranks(&case, ranks, go).0 }
}

#[test]
fn ranks_go_on_from_a_state_with_room_for_less_water() {
    let text =
        crate::openings::channel("velocity = 0.25").replace("velocity = 0.25\n[[o", "velocity = 0.5\n[[o");
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("first");
    run_on(&text.replace("end = 6.0", "end = 0.04"), 1, &first, u64::MAX);
    let more = format!("end = 0.1\nfrom = \"{}\"", first.display());
    let water = |ranks: usize| {
        let done =
            run_on(&text.replace("end = 6.0", &more), ranks, &folder.path().join(ranks.to_string()), 60);
        done.summary.water.expect("openings")
    };
    let (one, two) = (water(1), water(2));
    assert!(one.inflow[0].particles > 10 && one.particles_end > 800, "{one:?}");
    assert_eq!(format!("{one:?}"), format!("{two:?}"));
}

/// The water of a frame, and the places of its particles in the order of their numbers.
fn water(frame: &Frame) -> (Particles, Vec<usize>) {
    let water = particles(frame.fluid.as_deref().expect("a frame with water")).expect("it is read");
    let mut order: Vec<usize> = (0..water.len()).collect();
    order.sort_by_key(|&i| water.id[i]);
    (water, order)
}

fn near(a: &[f32], b: &[f32], scale: f32) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * scale)
}

#[test]
fn ranks_write_pieces_that_are_read_as_the_frame_of_one() {
    let text = flume_text("")
        + "every = 0.005\n[[output.series]]\nname = \"corner\"\nevery = 0.01\nkinds = [\"fluid\"]\nfields = [\"id\", \"pressure\"]\n\
           region = { min = [0, 0, 0], max = [0.3, 0.3, 1] }\n";
    let folder = tempfile::tempdir().unwrap();
    let [one, many] = ["one", "many"].map(|name| folder.path().join(name));
    for (ranks, out) in [(1, &one), (3, &many)] {
        let finished = run_on(&text, ranks, out, 12);
        assert!(finished.error.is_none() && finished.summary.frames == 4, "{:?}", finished.error);
    }
    let bytes = |file: &str| [&one, &many].map(|root| std::fs::read(root.join("vtu").join(file)).unwrap());
    let [a, b] = bytes("walls.vtu");
    assert_eq!(a, b);
    for (series, count) in [(None, 4), (Some("corner"), 3)] {
        let list = |root: &Path| match series {
            None => frames(root, "flume").unwrap(),
            Some(name) => frames(&series_in(root, name), name).unwrap(),
        };
        let (of_one, of_many) = (list(&one), list(&many));
        assert_eq!((of_one.len(), of_many.len()), (count, count));
        for (number, (a, b)) in of_one.iter().zip(&of_many).enumerate() {
            assert_eq!(a.time, b.time);
            let path = b.fluid.as_deref().unwrap();
            assert!(path.ends_with(format!("fluid_{number:04}.pvtu")), "{path:?}");
            assert!(!path.with_extension("vtu").exists());
            let stem = path.with_extension("").display().to_string();
            let pieces =
                [0, 1, 2].map(|rank| particles(format!("{stem}_{rank}.vtu").as_ref()).unwrap().len());
            // The corner is the first rank's, and the second one's in part.
            assert_eq!(pieces.map(|n| n > 0), [true, true, series.is_none()], "{pieces:?}");
            let ((a, a_order), (b, b_order)) = (water(a), water(b));
            assert_eq!(a.len(), pieces.iter().sum::<usize>());
            let ids = |of: &Particles, order: &[usize]| order.iter().map(|&i| of.id[i]).collect::<Vec<_>>();
            assert_eq!(ids(&a, &a_order), ids(&b, &b_order));
            let pressure =
                |of: &Particles, order: &[usize]| order.iter().map(|&i| of.pressure[i]).collect::<Vec<_>>();
            assert!(near(&pressure(&a, &a_order), &pressure(&b, &b_order), 5e3));
            assert!(number == 0 || pressure(&a, &a_order).iter().any(|&p| p > 1e3));
            for (&i, &j) in a_order.iter().zip(&b_order) {
                assert!(
                    near(&a.position[i].map(|x| x as f32), &b.position[j].map(|x| x as f32), 1.0),
                    "{i} {j}"
                );
            }
            assert_eq!(b.has(OutputField::Velocity), series.is_none());
            assert_eq!(a.has(OutputField::NumberDensity), b.has(OutputField::NumberDensity));
        }
        let both = of_one.iter().zip(&of_many).enumerate();
        let mut pressed = vec![];
        for (_, (a, b)) in both.filter(|_| series.is_none()) {
            let [a, b] = [a, b].map(|frame| particles(frame.solids.as_deref().unwrap()).unwrap());
            assert_eq!((&a.id, &a.body), (&b.id, &b.body));
            assert!(near(&a.pressure, &b.pressure, 5e3) && near(&a.number_density, &b.number_density, 1.0));
            pressed.push(b.pressure.iter().any(|&p| p > 0.0));
        }
        // On the gate, but not before the first step.
        assert!(pressed.first().is_none_or(|&first| !first) && (series.is_some() || pressed.contains(&true)));
    }
}

#[test]
fn a_run_goes_on_with_frames_of_another_number_of_ranks() {
    let text = flume_text("") + "every = 0.003\n";
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let has = |name: &str| out.join("vtu").join(name).exists();
    run_on(&text, 4, &out, 7);
    // Of the end, where the next part writes one of its own.
    assert!(has("fluid_0003.pvtu") && has("fluid_0003_3.vtu") && !has("fluid_0003_4.vtu"));
    run_on(&text, 1, &out, 13);
    assert!(
        has("fluid_0003.vtu")
            && !has("fluid_0003.pvtu")
            && !has("fluid_0003_0.vtu")
            && !has("fluid_0003_3.vtu")
    );
    assert!(has("fluid_0002.pvtu") && has("fluid_0005.vtu"));
    run_on(&text, 3, &out, 16);
    assert!(has("fluid_0005.pvtu") && !has("fluid_0005.vtu") && has("fluid_0006_2.vtu"));
    run_on(&text, 2, &out, 20);
    assert!(has("fluid_0006_1.vtu") && !has("fluid_0006_2.vtu"));
    let frames = frames(&out, "flume").unwrap();
    let times: Vec<f64> = frames.iter().map(|f| (f.time * 1e3).round()).collect();
    assert_eq!(times, [0., 3., 6., 9., 12., 15., 18., 20.]);
    let all: Vec<_> = frames.iter().map(water).collect();
    let ids =
        |(water, order): &(Particles, Vec<usize>)| order.iter().map(|&i| water.id[i]).collect::<Vec<_>>();
    assert!(!all[0].0.is_empty() && all.iter().all(|frame| ids(frame) == ids(&all[0])));
    // A new run in their place leaves nothing of them.
    let options = Options {
        name: "flume".into(),
        out: out.clone(),
        start: Start::Replace,
        steps: Some(1),
        ..Options::default()
    };
    let mut again = simulation(&case(&text));
    let scene = again.scene.clone();
    run(&mut again, &scene, &text, options, &Stop::default(), &mut |_| ()).unwrap();
    let left =
        std::fs::read_dir(out.join("vtu")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    assert!(left.into_iter().all(|name| !name.ends_with(".pvtu") && name.matches('_').count() < 2));
}

#[test]
fn a_rank_that_cannot_write_ends_the_run_on_all() {
    let text = flume_text("") + "every = 0.003\n";
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    run_on(&text, 3, &out, 2);
    // A folder in the place of the piece: a rank that may not write there, also as a superuser.
    let piece = out.join("vtu/fluid_0002_1.vtu");
    std::fs::create_dir(&piece).unwrap();
    let finished = run_on(&text, 3, &out, 10);
    let error = finished.error.expect("it cannot write");
    assert_eq!(error.to_string(), format!("{}: Is a directory (os error 21)", piece.display()));
    assert_eq!((error.exit_code(), finished.summary.status, finished.summary.steps), (5, Status::Failed, 6));
    assert_eq!(frames(&out, "flume").unwrap().len(), 2, "a frame is listed when it is whole");
    std::fs::remove_dir(&piece).unwrap();
    assert!(run_on(&text, 3, &out, 7).error.is_none());
    assert_eq!(frames(&out, "flume").unwrap().len(), 4);
}
