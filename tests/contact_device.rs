//! Contact's shaders against their twins, the f64 laws of the host: the same candidates, the same forces to
//! f32's last digits wherever the bodies are, and scenes that must come to rest.

use glam::{DMat3, DQuat, DVec3};
use seixo::backend::gpu::{self, Gpu};
use seixo::backend::{Backend, Processor};
use seixo::body::Wrench;
use seixo::case::{Case, Contact, Law};
use seixo::contact::{Probe, Solids, standing_gap};
use seixo::params::Params;
use seixo::plan::{Plan, Stage};
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use seixo_study::contact_checks::{DAM_BREAK_CUBE, Random, smooth};
use seixo_study::contact_cost::backend;
use seixo_study::contact_rest::{dam_break_contact, drops_together, rest, stack_scene};
use seixo_study::dry::{DryScene, FreeBox, GRAVITY};

/// Whether there is a device to test; loud if not, and a failure where one is expected.
fn device() -> bool {
    crate::common::there_is_a_device(
        "contact's shaders are not compared with their twins (libvulkan1 and \
                mesa-vulkan-drivers give a software one)",
    )
}

fn compute(scene: &Scene, contact: &Contact) -> Gpu {
    backend(scene, contact, |s, p, plan, settings| Gpu::new(s, p, plan, settings, None)).expect("a device")
}

/// What host and device find in `scene` before anything moves.
fn both(scene: &Scene, contact: &Contact) -> (Probe, Probe) {
    let mut gpu = compute(scene, contact);
    let dt = 1e-4;
    let mut solids = Solids::new(scene, Some(contact)).expect("valid");
    let host = solids.probe(None, dt).expect("the host can");
    let device = solids.probe(gpu.compute(), dt).expect("the device can");
    (host, device)
}

/// Largest difference of forces and of torques, over the largest force and over it times the largest arm.
fn error(host: &Probe, device: &Probe, arm: f64) -> f64 {
    let force = host.wrenches.iter().map(|w| w.force.length()).fold(0.0, f64::max);
    assert!(force > 0.0, "nothing touches");
    let worst = |(a, b): (&Wrench, &Wrench)| {
        ((a.force - b.force).length() / force).max((a.torque - b.torque).length() / (force * arm))
    };
    host.wrenches.iter().zip(&device.wrenches).map(worst).fold(0.0, f64::max)
}

/// Boxes at random that overlap each other, a floor and a step.
fn heap(seed: u64, law: Law, flat: bool) -> Scene {
    let l0 = 0.02;
    let mut random = Random::new(seed);
    let mut dry = DryScene::new(l0, DVec3::splat(-1.0), DVec3::splat(1.0)).floor();
    if law == Law::Paper {
        dry = dry.particle_floor((-0.5, -0.5), (0.5, 0.5));
    } else {
        let axes = DMat3::from_rotation_z(0.4);
        dry = dry.wall(DVec3::new(0.2, 0.0, 0.0), DVec3::new(0.1, 0.4, 0.08), axes);
    }
    for k in 0..12 {
        let mut draw = || 2.0 * random.draw() - 1.0;
        let edge = 0.1 + 0.02 * draw();
        let at = DVec3::new(0.25 * draw(), 0.25 * draw(), 0.06 + 0.06 * draw());
        let size = DVec3::new(edge, if k % 3 == 0 { 2.0 * edge } else { edge }, edge);
        let mut body = FreeBox::new(size, 800.0, at);
        body.velocity = DVec3::new(draw(), draw(), draw());
        body.angular_velocity = 3.0 * DVec3::new(draw(), draw(), draw());
        body.orientation = random.orientation();
        if flat || k % 4 == 0 {
            body.orientation = DQuat::IDENTITY;
        }
        dry = dry.body(&body);
    }
    dry.build()
}

fn contact(law: Law) -> Contact {
    let viscous_friction = if law == Law::Paper { 4.0 } else { 0.0 };
    Contact { law, viscous_friction, ..smooth(1e6, 30.0, 0.0) }
}

/// Friction acts at the same patches. What adds less than a millionth is left out on the host alone.
fn friction_acts_alike(law: Law, host: &Probe, device: &Probe) {
    let most = host.patches.iter().map(|p| p.force).fold(0.0, f64::max);
    for (these, others) in [(&host.patches, &device.patches), (&device.patches, &host.patches)] {
        for h in these.iter().filter(|h| h.force > 1e-3 * most) {
            let same = others.iter().any(|d| {
                h.solids == d.solids
                    && (h.normal - d.normal).length() < 1e-3
                    && (h.at - d.at).length() < 1e-5
                    && (h.force - d.force).abs() < 1e-5 * most
                    && (h.radius - d.radius).abs() < 1e-3 * h.radius + 1e-7
            });
            assert!(same, "{law:?}: {h:?} in {others:?}");
        }
    }
}

/// The device lists the host's candidates and gives its forces.
fn agree(contact: &Contact, bound: f64) {
    let law = contact.law;
    if !device() {
        return;
    }
    let mut on_edges = 0;
    for seed in 0..8 {
        for flat in [false, true] {
            let mut scene = heap(seed, law, flat);
            if seed % 4 == 3 {
                scene.dimensions = 2; // faces across y cannot be touched
            }
            let (host, device) = both(&scene, contact);
            assert!(host.candidates.len() > 500 && host.touching > 50, "{law:?} {seed}: {}", host.touching);
            // The device takes in what f32 cannot tell from the skin.
            let missing = host.candidates.iter().filter(|c| device.candidates.binary_search(c).is_err());
            let (missing, more) =
                (missing.count(), device.candidates.len() as f64 - host.candidates.len() as f64);
            let e = error(&host, &device, 0.1);
            println!(
                "{law:?} {seed} {flat}: {} candidates, {} missing, {} more, {} touching, error {e:.1e}, energy {:.1e}",
                host.candidates.len(),
                missing,
                more,
                host.touching,
                device.energy / host.energy - 1.0
            );
            assert!(e < bound, "{law:?} {seed}: {e:e}");
            assert!((device.energy / host.energy - 1.0).abs() < bound);
            assert_eq!(missing, 0);
            assert!(more <= 2.0, "{law:?} {seed}: {more} candidates more");
            assert_eq!(host.touching, device.touching);
            friction_acts_alike(law, &host, &device);
            // Edges of the step, which the host integrates for the device.
            on_edges += host.candidates.iter().filter(|c| c[1] > u64::MAX / 2 && c[2] == 3).count();
        }
    }
    assert!(law == Law::Paper || on_edges > 40, "{on_edges} edges of walls");
}

#[test]
fn contact_smooth() {
    agree(&contact(Law::Smooth), 2e-6);
    // what answers each contact of it is found on the device as well
    agree(&Contact { damping: None, restitution: Some(0.3), ..contact(Law::Smooth) }, 2e-6);
}

#[test]
fn contact_paper() {
    agree(&contact(Law::Paper), 2e-6);
}

/// Two cubes of 9128 surface points, one upon the other, a little turned.
fn large(law: Law) -> Scene {
    let (l0, wide) = (0.02, 40.0);
    let size = DVec3::splat(wide * l0);
    let mut below = FreeBox::new(size, 800.0, DVec3::ZERO);
    below.velocity = DVec3::new(0.1, 0.2, -0.3);
    let height = size.z + standing_gap(law, l0) - 0.05 * l0;
    let mut above = FreeBox::new(size, 800.0, DVec3::new(0.31 * l0, 0.12 * l0, height));
    above.orientation = DQuat::from_rotation_z(0.2) * DQuat::from_rotation_x(1e-3);
    DryScene::new(l0, DVec3::splat(-1.0), DVec3::splat(2.0)).body(&below).body(&above).build()
}

#[test]
fn large_bodies_are_searched_and_pressed_in_many_blocks_as_on_the_host() {
    if !device() {
        return;
    }
    for law in [Law::Smooth, Law::Paper] {
        let scene = large(law);
        let (host, device) = both(&scene, &contact(law));
        let e = error(&host, &device, 0.5);
        println!("{law:?}: {} candidates, {} touching, error {e:.1e}", host.candidates.len(), host.touching);
        // The paper's law has blocks of 64 particles in the search, and of this many candidates for its forces; the smooth
        // law a wider workgroup from as many points on.
        assert!(host.candidates.len() > 2048 && host.touching > 256, "{law:?}");
        let missing = host.candidates.iter().filter(|c| device.candidates.binary_search(c).is_err());
        assert_eq!(missing.count(), 0, "{law:?}");
        assert!(device.candidates.len() <= host.candidates.len() + 2, "{law:?}");
        assert_eq!(host.touching, device.touching);
        assert!(e < 2e-6, "{law:?}: {e:e}");
        assert!((device.energy / host.energy - 1.0).abs() < 2e-6, "{law:?}");
        assert!(law == Law::Paper || !host.patches.is_empty());
        friction_acts_alike(law, &host, &device);
        let (_, again) = both(&scene, &contact(law));
        assert_eq!(device.wrenches, again.wrenches, "{law:?}");
    }
}

/// The dam-break cube of the paper at rest on a floor at `height`, turned by `turn` about z and a little about x: as
/// deep as its weight presses it.
fn resting(law: Law, height: f64, turn: f64) -> (Scene, Contact) {
    let (edge, mass, l0, spring, damping, ..) = DAM_BREAK_CUBE;
    let contact = Contact { law, ..smooth(spring, damping, 0.0) };
    let scene = |gap: f64| {
        let at = DVec3::new(3.1 + 0.3 * l0, 0.2 * l0, height + 0.5 * edge + gap);
        let mut cube = FreeBox::new(DVec3::splat(edge), mass / edge.powi(3), at);
        cube.orientation = DQuat::from_rotation_z(turn) * DQuat::from_rotation_x(1e-6);
        let mut scene = DryScene::new(l0, DVec3::splat(-4.0), DVec3::splat(5.0))
            .wall(DVec3::new(3.0, 0.0, height - 1.0), DVec3::new(2.0, 2.0, 1.0), DMat3::IDENTITY)
            .particle_floor((3.0, -0.1), (3.2, 0.1))
            .body(&cube)
            .build();
        scene.position.iter_mut().for_each(|x| x.z += height);
        scene
    };
    let (mut low, mut high) = (-0.3 * l0, 0.3 * l0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let mut solids = Solids::new(&scene(middle), Some(&contact)).expect("valid");
        let force = solids.probe(None, 1e-4).expect("the host can").wrenches[0].force.z;
        if force > mass * GRAVITY { low = middle } else { high = middle }
    }
    (scene(low), contact)
}

#[test]
fn forces_at_rest_carry_no_noise_wherever_the_body_stands() {
    if !device() {
        return;
    }
    let (edge, mass, ..) = DAM_BREAK_CUBE;
    for law in [Law::Smooth, Law::Paper] {
        for height in [0.0, 1.0, 3.5] {
            for turn in [0.0, 0.3, 0.7] {
                let (scene, contact) = resting(law, height, turn);
                let (host, device) = both(&scene, &contact);
                let e = error(&host, &device, 0.5 * edge);
                let force = host.wrenches[0].force.z / (mass * GRAVITY);
                println!("{law:?} z {height} turn {turn}: force over weight {force}, error {e:.1e}");
                assert!((force - 1.0).abs() < 0.02, "at rest: {force}");
                assert!(e < 5e-6, "{law:?} z = {height}, turn {turn}: {e:e}");
            }
        }
    }
}

#[test]
fn random_drops_of_the_dam_break_cube_end_flat_and_still() {
    if !device() {
        return;
    }
    // Those of the host drop forty.
    let row = drops_together(6, 0.75, |s, c| Ok(Some(compute(s, c)))).expect("it runs");
    println!("{row:?}");
    assert_eq!((row.flat, row.at_rest, row.kept), (6, 6, 6), "{row:?}");
    assert!(row.rise < 0.0 && row.energy_gain < 0.0 && row.penetration < 0.1, "{row:?}");
}

#[test]
fn a_stack_of_cubes_and_a_block_on_a_slope_stand() {
    if !device() {
        return;
    }
    let (scene, contact) = (stack_scene(5), dam_break_contact());
    let mut solids = Solids::new(&scene, Some(&contact)).expect("valid");
    let mut gpu = compute(&scene, &contact);
    let row = rest(&mut solids, gpu.compute(), 0.25, DAM_BREAK_CUBE.6).expect("it runs");
    println!("{row:?} {:?}", solids.traffic());
    assert!(row.drift < 1e-4, "{row:?}");
    let mut on_host = Solids::new(&scene, Some(&contact)).expect("valid");
    let host = rest(&mut on_host, None, 0.25, DAM_BREAK_CUBE.6).expect("it runs");
    println!("{host:?}");
    let apart = on_host.poses().iter().zip(solids.poses()).map(|(a, b)| (a.position - b.position).length());
    assert!(apart.fold(0.0, f64::max) < 1e-9, "{row:?} {host:?}");

    let block = FreeBox::new(DVec3::new(0.2, 0.2, 0.1), 780.0, DVec3::new(0.0, 0.0, 0.05));
    let dry = DryScene::new(0.025, DVec3::splat(-2.0), DVec3::splat(2.0));
    let scene = dry.slope(0.5).floor().body(&block).build();
    let contact = smooth(9e5, 3.35e3, 0.6);
    let mut solids = Solids::new(&scene, Some(&contact)).expect("valid");
    let mut gpu = compute(&scene, &contact);
    let row = rest(&mut solids, gpu.compute(), 0.5, 1e-3).expect("it runs");
    println!("{row:?}");
    assert!(0.5_f64.tan() < 0.6 && row.drift < 1e-4 && row.speed < 1e-6, "{row:?}");
}

#[test]
fn two_runs_give_the_same_bits_and_two_solids_exchange_momentum_exactly() {
    if !device() {
        return;
    }
    for law in [Law::Smooth, Law::Paper] {
        let size = DVec3::splat(0.2);
        let mut first = FreeBox::new(size, 800.0, DVec3::new(-0.14, 0.03, -0.02));
        first.velocity = DVec3::X;
        let mut second = FreeBox::new(size, 2000.0, DVec3::new(0.14, -0.04, 0.05));
        second.orientation = Random::new(3).orientation();
        let dry = DryScene::new(0.025, DVec3::splat(-1.0), DVec3::splat(1.0)).gravity(DVec3::ZERO);
        let scene = dry.body(&first).body(&second).build();
        let contact = Contact { law, ..smooth(2e6, 100.0, 0.0) };
        let mut gpu = compute(&scene, &contact);
        let mut run = || {
            let mut solids = Solids::new(&scene, Some(&contact)).expect("valid");
            let before = solids.momentum();
            let mut pairs = 0;
            for step in 0..300 {
                let t = f64::from(step) * 1e-3;
                let report = solids.advance_on(gpu.compute(), t, 1e-3, &[Wrench::default(); 2]);
                pairs = pairs.max(report.expect("it runs").pairs);
            }
            assert!(pairs > 0, "they must meet");
            let after = solids.momentum();
            let scale = first.mass();
            assert!((after.0 - before.0).length() < 1e-12 * scale, "{law:?}");
            assert!((after.1 - before.1).length() < 1e-12 * scale, "{law:?}");
            solids.states()
        };
        assert_eq!(run(), run());
    }
}

/// A dry case of `count` cubes of 0.1 m (152 surface points) with `line` in its contact section.
fn cubes(count: usize, line: &str) -> (Case, Scene) {
    let case: Case = toml::from_str(&cubes_text(count, line)).expect("valid");
    let scene = Scene::build(&case).expect("it builds");
    (case, scene)
}

/// The same as a file.
fn cubes_text(count: usize, line: &str) -> String {
    let mut text = format!(
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1.0\n[tank]\nmin = [0, 0, 0]\nmax = [{}, 0.2, 0.3]\n\
         [contact]\nspring = 1e5\n{line}\n",
        0.2 * count as f64
    );
    for k in 0..count {
        let x = 0.2 * k as f64 + 0.1;
        text += &format!(
            "[[body]]\nname = \"cube {k}\"\nsize = [0.1, 0.1, 0.1]\ncenter = [{x:.3}, 0.1, 0.05]\ndensity = 500\n"
        );
    }
    text
}

#[test]
fn the_plan_leaves_few_points_to_the_host_and_many_to_the_device() {
    for (count, line, kernel, words) in [
        (1, "", None, "98 surface points, below 20000"),
        (210, "", Some("contact_smooth"), "20580 surface points, 20000 or more"),
        (210, "law = \"paper\"", Some("contact_paper"), "20580 surface points"),
        (210, "law = \"pressure\"", None, "law \"pressure\""),
        (210, "device = \"host\"", None, "contact.device = \"host\""),
        (1, "device = \"gpu\"", Some("contact_smooth"), "contact.device = \"gpu\""),
    ] {
        let (case, scene) = cubes(count, line);
        let params = Params::new(&case, &scene).expect("valid");
        let plan = Plan::new(&case, &scene, &params);
        assert_eq!(plan.contact.program.map(|p| p.name), kernel, "{count} {line}");
        assert!(plan.contact.reason.contains(words), "{}", plan.contact.reason);
        // What is not planned takes nothing.
        let bytes = gpu::memory(&scene, &params, &plan).expect("it can be counted").total();
        assert_eq!(bytes > 0, kernel.is_some(), "{count} {line}: {bytes} bytes");
        assert_eq!(gpu::kernels::planned(&plan).map(|p| p.name).collect::<Vec<_>>(), Vec::from_iter(kernel));
    }
}

#[test]
fn a_device_that_is_asked_for_and_has_no_kernel_is_refused() {
    for (line, more, why) in [
        ("law = \"pressure\"", "", "law \"pressure\""),
        (
            "",
            "[[obstacle]]\nname = \"post\"\nshape = \"cylinder\"\nradius = 0.05\nheight = 0.1\ncenter = [0.3, 0.1, 0.2]\n",
            "no boxes",
        ),
        (
            "",
            "[[body]]\nname = \"keel\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.3, 0.1, 0.2]\ndensity = 500\nmass_offset = [0, 0, -0.02]\n",
            "mass_offset",
        ),
    ] {
        let text = format!("{}{more}", cubes_text(2, &format!("device = \"gpu\"\n{line}")));
        let case: Case = toml::from_str(&text).expect("valid");
        let scene = Scene::build(&case).expect("builds");
        let told = Simulation::on(&case, scene, &Processor::Cpu).err().expect("refused").to_string();
        assert!(told.contains("contact.device") && told.contains(why), "{told}");
        assert!(!told.contains("--backend gpu"), "{told}");
    }
}

#[test]
fn a_dry_case_runs_with_its_contact_on_the_gpu_and_is_refused_on_the_cpu() {
    let (case, scene) = cubes(2, "device = \"gpu\"");
    let on_cpu = Simulation::on(&case, scene.clone(), &Processor::Cpu);
    let text = on_cpu.err().expect("refused").to_string();
    assert!(text.contains("contact.device") && text.contains("--backend gpu"), "{text}");
    if !device() {
        return;
    }
    let mut simulation = Simulation::on(&case, scene, &Processor::Gpu { adapter: None }).expect("it starts");
    for _ in 0..20 {
        simulation.step().expect("it runs");
    }
    let commands = simulation.backend.commands();
    assert!(commands.by_stage[&Stage::Contact] > 20, "{commands:?}");
    let force = simulation.solids.contact_wrenches()[1].force.z / (0.5 * 9.806_65);
    assert!(force > 0.1, "the floor carries the cube: {force}");
}

#[test]
fn walls_are_told_the_same_by_the_device() {
    if !device() {
        return;
    }
    for law in [Law::Smooth, Law::Paper] {
        let mut dry = DryScene::new(0.02, DVec3::splat(-1.0), DVec3::splat(1.0)).floor();
        if law == Law::Paper {
            dry = dry.particle_floor((-0.5, -0.5), (0.5, 0.5));
        } else {
            // its face lies at x = 0.05, turned a little
            dry =
                dry.wall(DVec3::new(0.15, 0.0, 0.1), DVec3::new(0.1, 0.4, 0.3), DMat3::from_rotation_z(0.01));
        }
        let mut body = FreeBox::new(DVec3::splat(0.1), 800.0, DVec3::new(0.0, 0.0, 0.049));
        body.velocity = DVec3::new(1.0, 0.3, -0.2);
        body.angular_velocity = DVec3::new(0.0, 1.0, 0.5);
        let scene = dry.body(&body).build();
        let friction = if law == Law::Paper { 0.0 } else { 0.3 };
        let contact = Contact { friction, ..contact(law) };
        let mut gpu = compute(&scene, &contact);
        let made = || Solids::new(&scene, Some(&contact)).expect("valid");
        let (mut on_host, mut on_device) = (made(), made());
        let water = vec![Wrench::default(); 1];
        for step in 0..3 {
            let t = f64::from(step) * 1e-4;
            on_host.advance(t, 1e-4, &water).expect("the host can");
            on_device.advance_on(gpu.compute(), t, 1e-4, &water).expect("the device can");
        }
        let host = on_host.wall_contact_wrenches().expect("the host knows");
        let Some(device) = on_device.wall_contact_wrenches() else {
            // all walls are one to this law on a device
            assert_eq!(law, Law::Paper);
            assert!(host[0].force.z < -1.0, "{host:?}");
            continue;
        };
        assert_eq!(law, Law::Smooth);
        let most = host.iter().map(|w| w.force.length()).fold(0.0, f64::max);
        for (h, d) in host.iter().zip(device) {
            let off = (h.force - d.force).length().max((h.torque - d.torque).length());
            println!("{law:?}: {h:?}, off by {off:e}");
            assert!(off < 1e-4 * most && h.force.length() > 1e-2 * most, "{h:?} {d:?}");
        }
    }
}
