//! Ranks that have a device each: many devices compute what one computes, and what a CPU does, to what f32 resolves.

use crate::common::{case, simulation};
use crate::ranks::*;
use seixo::backend::Processor;
use seixo::case::Case;
use seixo::cells::Grid;
use seixo::checkpoint::Archive;
use seixo::fields::Fields;
use seixo::output::replay::particles;
use seixo::params::Params;
use seixo::plan::Plan;
use seixo::ranks::Standing;
use seixo::run::{Finished, Options, run};
use seixo::scene::{Kind, Scene};
use seixo::share::Outlook;
use seixo::simulation::Simulation;
use seixo::stop::Stop;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

const DEVICE: Processor = Processor::Gpu { adapter: None };

/// Whether there is a device; loud if there is none, and a failure where one is expected.
fn device() -> bool {
    crate::common::there_is_a_device("ranks that have a device each are not tested")
}

fn on_device(case: &Case) -> Simulation {
    Simulation::on(case, Scene::build(case).expect("the scene builds"), &DEVICE).expect("it starts")
}

fn on_devices<T: Send>(
    case: &Case,
    ranks: usize,
    of: impl FnOnce(&mut Simulation) -> T + Send,
) -> (T, Vec<Standing>) {
    on_ranks_of(case, ranks, &DEVICE, of)
}

/// Places of the water by number.
fn places(fields: &Fields) -> BTreeMap<u32, f64> {
    fields.id.iter().zip(&fields.position).map(|(&id, x)| (id, x.x)).collect()
}

/// Particles that were on one side of a cut between `ranks` at the start and are on another at the end.
fn migrants(case: &Case, ranks: &[Standing], start: &Fields, end: &Fields) -> usize {
    let scene = Scene::build(case).expect("it builds");
    let grid = Grid::new(&Params::new(case, &scene).expect("valid")).expect("a grid");
    let rank_of = |x: f64| {
        let column = ((x - grid.origin.x) / grid.width.x) as u32;
        ranks.iter().position(|r| (r.columns[0]..r.columns[1]).contains(&column))
    };
    let end = places(end);
    places(start).iter().filter(|(id, x)| rank_of(**x) != rank_of(end[id])).count()
}

/// A scene, how many steps of it are computed, on how many ranks, and how far positions may be off [m]. f32 resolves them to 1e-7 m.
type Tried<'a> = (&'a str, Case, u64, usize, f64);

#[test]
fn many_devices_compute_what_one_device_computes() {
    compare([("plane", shipped("dam_break_2d", &[]), 5, 3, 5e-7), ("flume", flume(""), 4, 2, 5e-7)]);
}

#[test]
fn many_devices_compute_what_one_device_computes_round_a_tank_and_in_a_full_one() {
    let multigrid = "jitter = 0.1\nsolver = { preconditioner = \"multigrid\", tolerance = 1e-5 }";
    // Fast, so that they cross the side between the last and the first rank in few steps.
    let bodies = over().replace("[-2, 0, -0.5]", "[-10, 0, -0.5]").replace("[2, 0, 0]", "[10, 0, 0]");
    compare([
        ("ring of bodies, multigrid", ring(6.0, multigrid, &bodies), 5, 2, 2e-6),
        ("full", full(""), 2, 2, 5e-7),
        ("full, multigrid", full("solver = { preconditioner = \"multigrid\" }"), 2, 3, 5e-7),
    ]);
}

/// Holds devices of ranks against one device and a CPU.
fn compare<'a>(tried: impl IntoIterator<Item = Tried<'a>>) {
    if !device() {
        return;
    }
    for (name, case, steps, ranks, bound) in tried {
        let (cpu, cpu_fields) = Seen::after(&mut simulation(&case), steps);
        let (one, one_fields) = Seen::after(&mut on_device(&case), steps);
        let f32_is_off = apart(&cpu_fields, &one_fields)[0];
        let ((start, many, fields, first), last) = on_devices(&case, ranks, |s| {
            let start = s.fields().expect("the fields");
            s.step().expect("a step");
            let first = s.backend.ranks().expect("they stand");
            let (mut seen, fields) = Seen::after(s, steps - 1);
            seen.iterations.insert(0, 0);
            (start, seen, fields, first)
        });
        let [x, v, p] = apart(&one_fields, &fields);
        let of_cpu = apart(&cpu_fields, &fields)[0];
        let migrants = migrants(&case, &last, &start, &fields);
        println!(
            "{name}: {ranks} devices are {x:.1e} m, {v:.1e} m/s, {p:.1e} Pa from one, {of_cpu:.1e} m from a CPU (one device: \
                 {f32_is_off:.1e}); {migrants} particles have changed rank; iterations {:?}, one {:?}",
            many.iterations, one.iterations
        );
        assert!(x < bound && of_cpu < 2.0 * f32_is_off + bound, "{name} on {ranks}: {x} {of_cpu}");
        assert!(p > 0.0, "{name}: other sums leave other roundings");
        // None is lost, or twice there.
        assert_eq!(last.iter().map(|r| r.water as u64).sum::<u64>(), one.water.particles, "{name}");
        assert_eq!((many.water.particles, many.water.inner), (one.water.particles, one.water.inner));
        assert_eq!(many.counters.lost, 0);
        assert_eq!(places(&fields).len(), places(&one_fields).len());
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-4 * scale;
        assert!(near(many.water.kinetic, one.water.kinetic, one.water.kinetic), "{name}");
        for ((gauge, a), (_, b)) in many.gauges.iter().zip(&one.gauges) {
            let (a, b) = (f64::from_bits(*a), f64::from_bits(*b));
            assert!(near(a, b, b.abs().max(10.0)) || a.is_nan() && b.is_nan(), "{name}: {gauge} {a} {b}");
        }
        assert_eq!(many.ledger.is_some(), cpu.ledger.is_some());
        if let (Some(a), Some(b)) = (&many.ledger, &one.ledger) {
            use seixo::ledger::Entry;
            let size = Entry::ALL.iter().map(|&e| b.get(e).abs()).fold(0.0, f64::max);
            assert!(Entry::ALL.iter().all(|&e| near(a.get(e), b.get(e), size)), "{name}: {a:?} {b:?}");
        }
        for (a, b) in many.solids.iter().zip(&one.solids) {
            assert!(a[0].distance(b[0]) < bound && a[1].distance(b[1]) < 1e3 * bound, "{name}: {a:?} {b:?}");
        }
        if name.starts_with("ring") {
            assert!(migrants > 10, "{name}: water has gone from rank to rank: {migrants}");
            // Wall layers of bodies that have crossed a cut have changed hands.
            let walls = |of: &[Standing]| of.iter().map(|r| r.walls).collect::<Vec<_>>();
            assert_ne!(walls(&first), walls(&last), "{name}: a body has crossed a cut");
        }
    }
}

/// The paper's dam break, coarse, from the start.
fn dam_break() -> Case {
    shipped("dam_break_transport", &["run.spacing=0.03", "fluid.solver.preconditioner=\"multigrid\""])
}

#[test]
fn multigrid_of_many_devices_takes_the_iterations_of_one() {
    if !device() {
        return;
    }
    let case = dam_break();
    // Mean iterations, the largest true residual, and the water after some steps.
    let of = |s: &mut Simulation| {
        let solves: Vec<_> = (0..3).map(|_| s.step().expect("a step").pressure).collect();
        let mean = solves.iter().map(|solve| f64::from(solve.iterations)).sum::<f64>() / solves.len() as f64;
        (mean, solves.iter().map(|solve| solve.residual).fold(0.0, f64::max), s.fields().expect("the fields"))
    };
    let (one, one_left, one_fields) = of(&mut on_device(&case));
    for ranks in [1, 3] {
        let ((many, left, fields), _) = on_devices(&case, ranks, of);
        let x = apart(&one_fields, &fields)[0];
        println!(
            "{ranks} devices: {many:.2} iterations to {left:.2e}, one {one:.2} to {one_left:.2e}; {x:.1e} m from it"
        );
        assert!((many - one).abs() <= 1.0, "{ranks}: {many} {one}");
        assert!(left < 1.05 * one_left, "{ranks}: {left} {one_left}");
        assert!(x < 5e-7, "{ranks}: {x}");
    }
}

#[test]
fn devices_of_ranks_leave_the_same_bits_twice() {
    if !device() {
        return;
    }
    let case = flume("solver = { preconditioner = \"multigrid\" }");
    let run = || on_devices(&case, 2, |s| Seen::after(s, 3)).0.0;
    assert_eq!(run(), run());
}

/// Water that falls to the right over a dry floor, in the plane: shares do not stay even.
fn bore(more: &str) -> Case {
    case(&format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\n[fluid]\nsound_speed = 20\njitter = 0.1\n{more}\n\
         [[fluid.block]]\nmin = [0, 0, 0]\nmax = [1.2, 0, 0.6]\nvelocity = [6, 0, 0]\n\
         [tank]\nmin = [0, 0, 0]\nmax = [3, 0, 1]\nopen = [\"z_max\"]\n"
    ))
}

#[test]
fn the_cuts_between_devices_follow_the_water() {
    if !device() {
        return;
    }
    let case = bore("solver = { preconditioner = \"multigrid\" }");
    let (one, fields) = Seen::after(&mut on_device(&case), 22);
    let ((first, many, fields_of_many), last) = on_devices(&case, 3, |s| {
        s.step().expect("a step");
        let first = s.backend.ranks().expect("they stand");
        let (many, fields) = Seen::after(s, 21);
        (first, many, fields)
    });
    let off = apart(&fields, &fields_of_many)[0];
    println!("{off:.1e} m from one after 22 steps\n{first:?}\n{last:?}");
    assert!(first[1].columns != last[1].columns, "the tank was cut anew");
    assert_eq!(last.iter().map(|r| r.water as u64).sum::<u64>(), one.water.particles);
    assert_eq!((many.counters.lost, one.counters.lost), (0, 0));
    assert!(off < 1e-4, "{off}");
}

#[test]
fn a_gauge_on_a_fixed_wall_knows_all_of_the_step_in_which_devices_share_anew() {
    if !device() {
        return;
    }
    let case = fast_over_a_floor(1e-6);
    let one = felt_by_a_floor(&mut on_device(&case));
    let (many, said) = on_devices(&case, 2, felt_by_a_floor);
    assert_felt(&one, &many, &said, 1e-2);
}

#[test]
fn plan_tells_what_devices_of_ranks_say() {
    if !device() {
        return;
    }
    for case in [shipped("dam_break_2d", &[]), ring(0.0, "solver = { preconditioner = \"multigrid\" }", FREE)]
    {
        let scene = Scene::build(&case).expect("it builds");
        let around = scene.periodic.is_along(0);
        let params = Params::new(&case, &scene).expect("valid");
        let told =
            Outlook::new(3, &scene, &params, &Plan::new(&case, &scene, &params)).expect("told").on_devices;
        let ((first, iterations), last) = on_devices(&case, 3, |s| {
            s.step().expect("a step");
            let first = s.backend.ranks().expect("they stand");
            let more = (0..3).map(|_| u64::from(s.step().expect("a step").pressure.iterations));
            (first, more.sum::<u64>())
        });
        for (k, (a, b)) in first.iter().zip(&last).enumerate() {
            let beside = u64::from(k > 0 || around) + u64::from(k < 2 || around);
            let messages = 3 * told.messages[0] + iterations * told.messages[1];
            assert_eq!(b.messages - a.messages, beside * messages, "{told:?}");
            assert_eq!(b.rounds - a.rounds, 3 * told.rounds[0] + iterations * told.rounds[1] + 1, "{told:?}");
        }
        let bytes: u64 = last.iter().zip(&first).map(|(b, a)| b.message_bytes - a.message_bytes).sum();
        let most =
            2 * (3 - u64::from(!around)) * (3 * told.message_bytes[0] + iterations * told.message_bytes[1]);
        // Of the largest border; of what all gather the cells of multigrid.
        let most = most + 3 * told.round_bytes[0] + iterations * told.round_bytes[1];
        assert!((0.6..1.2).contains(&(bytes as f64 / most as f64)), "{bytes} said, at most {most} told");
    }
}

fn save(s: &mut Simulation) -> Archive {
    let mut archive = Archive::new();
    s.exchange(&mut archive).expect("saved");
    archive
}

#[test]
fn a_state_goes_on_on_any_number_of_devices() {
    if !device() {
        return;
    }
    let case = flume("");
    let undisturbed = Seen::after(&mut on_device(&case), 8);
    let (of_many, _) = on_devices(&case, 2, |s| {
        steps(s, 4);
        // Kept in memory by each rank, and gathered later: the same state.
        let mut kept = Archive::in_memory();
        s.exchange(&mut kept).expect("kept");
        let saved = save(s);
        steps(s, 1);
        s.backend.lead().expect("many").complete(&mut kept).expect("gathered");
        assert_eq!(kept.sections.keys().collect::<Vec<_>>(), saved.sections.keys().collect::<Vec<_>>());
        assert!(saved.sections.iter().all(|(name, section)| kept.sections[name] == *section));
        saved
    });
    let go_on = |s: &mut Simulation, state: &Archive| {
        s.exchange(&mut state.to_restore()).expect("restored");
        assert_eq!(s.steps, 4);
        Seen::after(s, 4)
    };
    let same = |(seen, fields): (Seen, Fields), what: &str| {
        let [x, ..] = apart(&undisturbed.1, &fields);
        println!("{what}: {x:.1e} m");
        // Viscosity finds its neighbours anew where the particles are.
        assert!(x < 1e-5, "{what}: {x}");
        assert_eq!(seen.counters, undisturbed.0.counters, "{what}");
        let total = |seen: &Seen| seen.ledger.as_ref().expect("kept").total();
        let (a, b) = (total(&seen), total(&undisturbed.0));
        assert!((a - b).abs() < 1e-3 * b.abs().max(1.0), "{what}: {a} {b}");
    };
    same(go_on(&mut on_device(&case), &of_many), "of two, on one");
    same(on_devices(&case, 3, |s| go_on(s, &of_many)).0, "of two, on three");
}

/// A run of `text` on `ranks` devices into the folder `out`, of `steps`.
fn run_on(text: &str, ranks: usize, out: &Path, steps: u64) -> Finished {
    let case = case(text);
    let options = Options { name: "flume".into(), out: out.into(), steps: Some(steps), ..Options::default() };
    on_devices(&case, ranks, |s| {
        let scene = s.scene.clone();
        run(s, &scene, text, options, &Stop::default(), &mut |_| ()).expect("it begins")
    })
    .0
}

#[test]
fn devices_of_ranks_write_pieces_and_say_what_solved_the_pressure() {
    if !device() {
        return;
    }
    let text = flume_text("solver = { preconditioner = \"multigrid\" }") + "every = 0.002\n";
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let finished = run_on(&text, 2, &out, 4);
    assert!(finished.error.is_none(), "{:?}", finished.error);
    let summary = &finished.summary;
    assert_eq!(summary.pressure.preconditioner, Some("multigrid"));
    assert!(summary.adapter.starts_with("2 ranks on "), "{}", summary.adapter);
    let of = |name: &str| particles(&out.join("vtu").join(name)).expect("it is read");
    let all = of("fluid_0002.pvtu");
    let pieces = [of("fluid_0002_0.vtu"), of("fluid_0002_1.vtu")];
    assert!(pieces.iter().all(|piece| piece.len() > 100));
    assert_eq!(all.len(), pieces.iter().map(|piece| piece.len()).sum::<usize>());
    let mut ids = all.id.clone();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all.len());
    assert!(all.pressure.iter().any(|&p| p > 1e3));
}

#[test]
fn what_devices_of_ranks_do_not_compute_is_refused() {
    if !device() {
        return;
    }
    let refusal = |case: &Case, processor: &Processor| {
        let scene = Arc::new(Scene::build(case).expect("it builds"));
        let first = seixo::ranks::threads::team(1).remove(0);
        Simulation::on_ranks_of(case, scene, &first, processor).err().expect("refused").to_string()
    };
    let contact = shipped("dam_break_transport", &["run.spacing=0.03", "contact.device=\"gpu\""]);
    let contact = refusal(&contact, &DEVICE);
    assert!(contact.contains("on many ranks contact is on the host"), "{contact}");
    let none = refusal(&flume(""), &Processor::Gpu { adapter: Some("no such device".into()) });
    assert!(none.contains("no adapter is called"), "{none}");
}

#[test]
fn water_comes_in_and_goes_out_over_devices() {
    if !device() {
        return;
    }
    // Three times as fast as it is shipped: a layer of particles comes in sooner.
    let case = shipped(
        "channel",
        &[
            "run.spacing=0.05",
            "fluid.solver.preconditioner=\"multigrid\"",
            "fluid.block.0.velocity=[1.5,0,0]",
            "inflow.0.discharge=0.12",
            "outflow.0.velocity=1.5",
        ],
    );
    let steps = 25;
    let (one, _) = Seen::after(&mut on_device(&case), steps);
    let ((many, fields), ranks) = on_devices(&case, 2, |s| Seen::after(s, steps));
    let scene = Scene::build(&case).expect("it builds");
    let came = many.water.particles + many.counters.swallowed.iter().sum::<u64>() - scene.water() as u64;
    println!("{came} came in, {:?} went out; {:?} {:?}", many.counters, many.water, one.water);
    assert!(came > 0, "water has come in");
    assert_eq!(many.water.particles, one.water.particles);
    assert_eq!((&many.counters.swallowed, many.counters.lost), (&one.counters.swallowed, one.counters.lost));
    assert_eq!(ranks.iter().map(|r| r.water as u64).sum::<u64>(), many.water.particles);
    // Each has a number of its own.
    let mut ids: Vec<u32> =
        fields.id.iter().zip(&fields.kind).filter(|(_, k)| **k == Kind::Fluid).map(|(&id, _)| id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len() as u64, many.water.particles);
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b.abs();
    assert!(near(many.water.kinetic, one.water.kinetic) && near(many.water.potential, one.water.potential));
}
