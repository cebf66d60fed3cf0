//! Checks of every WGSL file, with no device.

use crate::common::moving as common;

use seixo::backend::gpu::hierarchy::{Hierarchy, Operation};
use seixo::backend::gpu::layout::{
    AbsorberZone, Coefficients, Constants, Emission, FreeBody, MonitorSum, Outlet, Pose, Solve, WallParticle,
    counter,
};
use seixo::backend::gpu::parts::{Division, Parts, Split};
use seixo::backend::gpu::{Gpu, buffers, kernels, shader};
use seixo::compute::{Host, Program};
use seixo::contact::device::paper::{self, PaperBlock, PaperLaw, PaperPair, PaperPose};
use seixo::contact::device::smooth::{self, SmoothPair, SmoothPose};
use seixo::params::Params;
use seixo::plan::{ContactPlan, ParticleStage, Plan};
use seixo::pressure::Settings;
use seixo::scheme::Preconditioner;
use std::collections::BTreeSet;
use std::mem::offset_of;

/// Names of the files in `folder` that end in `extension`, but for `except`.
fn files(folder: &str, extension: &str, except: &str) -> BTreeSet<String> {
    let root = crate::common::ROOT;
    std::fs::read_dir(format!("{root}/{folder}"))
        .expect("the folder exists")
        .filter_map(|e| Some(e.ok()?.file_name().to_str()?.strip_suffix(extension)?.to_owned()))
        .filter(|name| name != except)
        .collect()
}

#[test]
fn every_shader_has_a_twin_and_every_twin_a_shader() {
    let shaders = files("shaders", ".wgsl", "common");
    // The twins of contact's shaders are the laws themselves.
    let twin = |name: &str| match name.strip_prefix("contact_") {
        Some(law) => format!("src/contact/{law}/mod.rs"),
        None if name == "halo" => "src/share/border.rs".into(),
        None => format!("src/kernels/{name}.rs"),
    };
    let of_particles: BTreeSet<String> =
        shaders.iter().filter(|s| !s.starts_with("contact_") && *s != "halo").cloned().collect();
    assert_eq!(of_particles, files("src/kernels", ".rs", "mod"));
    let listed: BTreeSet<String> = kernels::programs().map(|p| p.name.to_owned()).collect();
    assert_eq!(shaders, listed);
    let without: Vec<_> = ParticleStage::ALL.iter().filter(|stage| kernels::of(**stage).is_none()).collect();
    assert_eq!(without, [&ParticleStage::CellList], "stages without a kernel over particles");
    for Program { name, text, .. } in kernels::programs() {
        let path = twin(name);
        assert!(text.contains(&format!("// Twin: {path}")), "{name}: head comment names no twin");
        assert!(text.starts_with("// "), "{name}: no head comment");
        let twin = std::fs::read_to_string(format!("{}/{path}", crate::common::ROOT));
        assert!(twin.is_ok_and(|t| t.starts_with("//! ")), "{name}: the twin has no head comment");
    }
}

/// The switches that a file asks for.
fn asked(text: &str) -> Vec<&'static str> {
    shader::SWITCHES
        .iter()
        .map(|(name, _)| *name)
        .filter(|s| text.contains(&format!("//#if {s}\n")))
        .collect()
}

/// Every combination of the switches that a file asks for.
fn combinations(text: &str) -> impl Iterator<Item = Vec<&'static str>> {
    let names = asked(text);
    (0..1_u32 << names.len())
        .map(move |k| names.iter().enumerate().filter(|(i, _)| k >> i & 1 == 1).map(|(_, &n)| n).collect())
}

/// The text of a shader.
fn text(name: &str) -> &'static str {
    kernels::programs().find(|p| p.name == name).expect("listed").text
}

#[test]
fn every_shader_is_valid_with_every_switch_and_agrees_with_the_tables() {
    let allowed = wgpu::Limits::default().max_storage_buffers_per_shader_stage as usize;
    let mut bound = BTreeSet::new();
    for program in kernels::programs() {
        let Program { name, text, .. } = program;
        let directives = text.lines().filter(|l| l.trim().starts_with("//#if ")).count();
        let known = asked(text).iter().map(|s| text.matches(&format!("//#if {s}\n")).count()).sum::<usize>();
        assert_eq!(directives, known, "{name}: a switch is not in the list");
        let table = || buffers::TABLE.iter().map(|row| row.spec).chain(program.buffers.iter().copied());
        let mut seen = BTreeSet::new();
        for switches in combinations(text) {
            let source = shader::source(text, &switches);
            // A line is itself or left out, so that messages name the file's lines; what is added stands behind.
            let lines = text.lines().chain(shader::COMMON.lines());
            assert!(lines.zip(source.lines()).all(|(file, line)| line.is_empty() || line == file), "{name}");
            let entries =
                shader::entries(name, &source).unwrap_or_else(|e| panic!("{name} {switches:?}: {e}"));
            assert!(!entries.is_empty(), "{name} {switches:?}: no entry point");
            for entry in entries {
                let of = format!("{name}.{}", entry.name);
                let kernel = program.kernels.iter().find(|k| k.entry == entry.name);
                let kernel = kernel.unwrap_or_else(|| panic!("{of} is in no list"));
                assert_eq!((kernel.file, entry.workgroup), (*name, [kernel.width, 1, 1]), "{of}");
                let storage = entry.bindings.iter().filter(|b| b.storage).count();
                assert!(storage <= allowed, "{of}: {storage} storage buffers");
                for binding in &entry.bindings {
                    let spec = table().find(|s| s.id.name() == binding.name);
                    let spec = spec.unwrap_or_else(|| panic!("{of}: {} is in no table", binding.name));
                    assert_eq!(binding.element, spec.element, "{of}: elements of {}", binding.name);
                    assert_eq!(binding.storage, spec.host != Host::Uniform, "{of}: {}", binding.name);
                    bound.insert(binding.name.clone());
                }
                seen.insert(entry.name);
            }
        }
        let listed: BTreeSet<String> = program.kernels.iter().map(|k| k.entry.to_owned()).collect();
        assert_eq!(seen, listed, "{name}: kernels");
    }
    let of_contact = kernels::programs().flat_map(|p| p.buffers);
    let listed = buffers::TABLE.iter().map(|row| &row.spec).chain(of_contact).map(|s| s.id.name().to_owned());
    assert_eq!(bound, listed.collect(), "buffers that no shader binds, or the other way");
}

/// Where buffers and dispatches are divided the same kernels bind the same buffers, with all their parts.
#[test]
fn every_shader_is_valid_on_a_device_that_divides() {
    let divided = buffers::TABLE.iter().filter(|row| !matches!(row.split, Split::Whole));
    // A power of two is a number of planes, too.
    let parts = |(k, row): (usize, &buffers::Row)| Parts {
        buffer: row.spec.id.name(),
        count: 2 + (k % 3) as u64,
        each: 8,
    };
    let division = Division { parts: divided.enumerate().map(parts).collect(), fold: Some(7) };
    assert!(division.parts.len() >= 8, "{division:?}");
    let mut used = BTreeSet::new();
    for Program { name, text, .. } in kernels::programs() {
        for switches in combinations(text) {
            let whole = shader::entries(name, &shader::source(text, &switches)).expect("valid");
            let source = shader::divided(text, &switches, &division);
            let entries =
                shader::entries(name, &source).unwrap_or_else(|e| panic!("{name} {switches:?}: {e}"));
            for (whole, entry) in whole.iter().zip(&entries) {
                let mut bound: Vec<_> = entry.bindings.iter().map(|b| (b.name.clone(), b.part)).collect();
                let mut wanted = Vec::new();
                for binding in &whole.bindings {
                    let count = division.of(&binding.name).map_or(1, |p| p.count as usize);
                    wanted.extend((0..count).map(|part| (binding.name.clone(), part)));
                    used.extend((count > 1).then(|| binding.name.clone()));
                }
                bound.sort();
                wanted.sort();
                assert_eq!(bound, wanted, "{name}.{}", entry.name);
                let numbers: BTreeSet<u32> = entry.bindings.iter().map(|b| b.number).collect();
                assert_eq!(numbers.len(), entry.bindings.len(), "{name}.{}", entry.name);
            }
        }
    }
    assert_eq!(used, division.parts.iter().map(|p| p.buffer.to_owned()).collect());
}

/// Whether the pointer `at` leads to a component of a vector in a storage buffer that is chosen while the shader runs.
fn is_chosen_component(
    module: &naga::Module,
    function: &naga::Function,
    at: naga::Handle<naga::Expression>,
) -> bool {
    use naga::{Expression, TypeInner};
    let Expression::Access { base, .. } = function.expressions[at] else { return false };
    // Down to the buffer, through the places that lead to it.
    let mut path = vec![];
    let mut below = base;
    let global = loop {
        match function.expressions[below] {
            Expression::Access { base, .. } => (below, path) = (base, [path, vec![None]].concat()),
            Expression::AccessIndex { base, index } => {
                (below, path) = (base, [path, vec![Some(index)]].concat())
            }
            Expression::GlobalVariable(global) => break global,
            _ => return false,
        }
    };
    let variable = &module.global_variables[global];
    let mut ty = variable.ty;
    for index in path.iter().rev() {
        ty = match (&module.types[ty].inner, index) {
            (TypeInner::Array { base, .. }, _) => *base,
            (TypeInner::Struct { members, .. }, Some(index)) => members[*index as usize].ty,
            _ => return false,
        };
    }
    let storage = matches!(variable.space, naga::AddressSpace::Storage { .. });
    storage && matches!(module.types[ty].inner, TypeInner::Vector { .. })
}

/// Stores of `block` and the blocks in it.
fn stores(block: &naga::Block, out: &mut Vec<naga::Handle<naga::Expression>>) {
    for statement in block.iter() {
        match statement {
            naga::Statement::Store { pointer, .. } => out.push(*pointer),
            naga::Statement::Block(inner) => stores(inner, out),
            naga::Statement::If { accept, reject, .. } => {
                [accept, reject].into_iter().for_each(|b| stores(b, out))
            }
            naga::Statement::Loop { body, continuing, .. } => {
                [body, continuing].into_iter().for_each(|b| stores(b, out))
            }
            naga::Statement::Switch { cases, .. } => cases.iter().for_each(|c| stores(&c.body, out)),
            _ => {}
        }
    }
}

/// A vector is one memory location: invocations that each write a component of it race. A component chosen while the
/// shader runs is one that another invocation may be writing beside.
#[test]
fn no_invocation_writes_a_part_of_a_vector_that_another_may_write() {
    let chosen = |source: &str| -> Vec<String> {
        let module = naga::front::wgsl::parse_str(source).expect("valid");
        let entries = module.entry_points.iter().map(|e| (&e.name, &e.function));
        let functions = module.functions.iter().filter_map(|(_, f)| Some((f.name.as_ref()?, f)));
        let is_wrong = |(_, function): &(_, &naga::Function)| {
            let mut pointers = vec![];
            stores(&function.body, &mut pointers);
            pointers.into_iter().any(|p| is_chosen_component(&module, function, p))
        };
        entries.chain(functions).filter(is_wrong).map(|(name, _)| name.clone()).collect()
    };
    for Program { name, text, .. } in kernels::programs() {
        for switches in combinations(text) {
            let found = chosen(&shader::source(text, &switches));
            assert!(found.is_empty(), "{name} {switches:?}: {found:?}");
        }
    }
    // What it looks for, it finds.
    let race = "@group(0) @binding(0) var<storage, read_write> a: array<vec4f>;
                @compute @workgroup_size(4) fn f(@builtin(local_invocation_index) t: u32) { a[t / 4u][t % 4u] = 1.0; }";
    assert_eq!(chosen(race), ["f"]);
}

/// Name and offset of the members of a struct of a shader, and its size.
fn members(text: &str, name: &str) -> (Vec<(String, usize)>, usize) {
    let module = naga::front::wgsl::parse_str(&shader::source(text, &[])).expect("valid");
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
    let (_, ty) = found.unwrap_or_else(|| panic!("no struct {name}"));
    let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
    let list = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize)).collect();
    (list, *span as usize)
}

macro_rules! same_layout {
    ($file:literal, $rust:ident { $($field:ident),* $(,)? }) => {{
        let rust = vec![$((stringify!($field).to_owned(), offset_of!($rust, $field))),*];
        let (wgsl, span) = members(text($file), stringify!($rust));
        assert_eq!(wgsl, rust);
        assert_eq!(span, size_of::<$rust>());
    }};
}

#[test]
fn structs_lie_the_same_on_both_sides() {
    same_layout!(
        "predict",
        Constants {
            gravity,
            spacing,
            lower,
            effective_radius,
            upper,
            collision_distance,
            cells,
            cell_total,
            fluid,
            moving_wall,
            moving,
            moving_dummy,
            pressure_slots,
            capacity,
            reduction_groups,
            max_iterations,
            number_density,
            surface_below,
            restitution,
            viscosity,
            particle_mass,
            gradient_scale,
            density,
            tolerance_squared,
            smooth_density,
            surface_head,
            wall_shear,
            wall_friction,
            period,
            wall_contact,
            inverse_period,
            body_wall,
            cell_width,
            zero,
            drive,
            dynamic_viscosity,
            wall_room,
            wall_depth,
            reacting,
            shear_scale,
        }
    );
    same_layout!(
        "predict",
        Coefficients {
            dt,
            source_density,
            source_divergence,
            compressibility,
            pressure_max,
            pressure_min,
            speed_per_bin,
            shift_speed,
            ahead,
        }
    );
    same_layout!("multigrid_levels", Hierarchy { level, operation, levels, capacity, cells, operations });
    same_layout!("multigrid", Hierarchy { level, operation, levels, capacity, cells, operations });
    same_layout!("halo", Hierarchy { level, operation, levels, capacity, cells, operations });
    same_layout!("move_solids", Pose { position, orientation, velocity, angular_velocity });
    same_layout!("body_force", WallParticle { area, arm, to_surface, faces });
    same_layout!("openings", Emission { wall, count, to, pad, shift, velocity });
    same_layout!("openings", Outlet { low, high, room_low, room_high });
    same_layout!("absorber", AbsorberZone { low, high, start, ramp });
    same_layout!("coupling", FreeBody { moves, crosses, turns, force, torque, first, count, solid, bodies });
    same_layout!(
        "conjugate_gradient",
        Solve {
            done,
            outcome,
            iterations,
            unknowns,
            source_squared,
            residual_squared,
            true_residual_squared,
            rz,
            rz_old,
        }
    );
    same_layout!(
        "contact_smooth",
        SmoothPair {
            low_a,
            spring,
            high_a,
            stop,
            low_b,
            stop_depth,
            high_b,
            damping,
            half_a,
            step,
            first,
            count,
            near,
            faces,
            list,
            sum,
            share,
            skin,
            open,
            pairs,
            mass,
            pad,
        }
    );
    same_layout!(
        "contact_smooth",
        SmoothPose {
            row_x,
            row_y,
            row_z,
            spin,
            below_b,
            above_b,
            below_a,
            above_a,
            found,
            found_push,
            found_moment,
            gives,
            turns_a,
            turns_b,
            given,
        }
    );
    same_layout!("contact_paper", PaperPair { first, near, count });
    same_layout!("contact_paper", PaperBlock { pair, first, count, list, blocks });
    same_layout!(
        "contact_paper",
        PaperPose { high_x, high_y, high_z, low_x, low_y, low_z, velocity, spin, spin_b }
    );
    same_layout!(
        "contact_paper",
        PaperLaw { spring, damping, viscous_friction, distance, scale, whole, fraction, pad }
    );
    same_layout!(
        "monitor",
        MonitorSum {
            momentum,
            kinetic,
            position,
            density_error,
            extent_max,
            density_error_max,
            particles,
            inner,
            speed_squared_max,
            pad,
        }
    );
}

/// Value of a constant of the shaders.
fn constant(text: &str, name: &str) -> f64 {
    let line = text.lines().find(|l| l.starts_with(&format!("const {name}:"))).expect("the constant exists");
    let value = line.split('=').nth(1).expect("it has a value").trim().trim_end_matches(';');
    value.trim_end_matches('u').parse().expect("it is a number")
}

/// A pair of numbers in the text of a shader.
fn pair(text: &str, name: &str) -> (f64, f64) {
    let line =
        text.lines().find(|l| l.starts_with(&format!("const {name} = vec2f("))).expect("the pair exists");
    let inside = line.split(['(', ')']).nth(1).expect("it has values");
    let mut values = inside.split(", ").map(|value| value.parse().expect("it is a number"));
    (values.next().expect("a first"), values.next().expect("a second"))
}

#[test]
fn what_rows_undo_is_the_same_on_both_sides() {
    use seixo::kernels::pressure_source::{CAUGHT, LEAK, ONE_SIDED, SLOT, THICK};
    let source = text("pressure_source");
    assert_eq!(pair(shader::COMMON, "CAUGHT"), CAUGHT);
    assert_eq!(pair(source, "SLOT"), SLOT);
    assert_eq!(pair(source, "THICK"), THICK);
    assert_eq!(constant(source, "LEAK"), LEAK);
    assert_eq!(constant(source, "ONE_SIDED"), ONE_SIDED);
}

#[test]
fn constants_are_the_same_on_both_sides() {
    use seixo::backend::gpu::layout::{GHOST_BLOCK, MONITOR_WIDTH, WORKGROUP};
    use seixo::fields::State;
    use seixo::kernels::{
        number_density::CLOSEST, predict::DISPLACEMENT_MAX, shift::SHIFT, shift::SHIFT_MAX,
    };
    use seixo::neighbourhood::EIGENVALUE_MIN;
    use seixo::pressure::Outcome;
    use seixo::scene::Kind;
    let common = |name: &str| constant(shader::COMMON, name);
    assert_eq!(common("WORKGROUP"), WORKGROUP as f64);
    assert_eq!(common("GHOST_BLOCK"), GHOST_BLOCK as f64);
    assert_eq!(common("FLUID"), f64::from(Kind::Fluid as u8));
    assert_eq!(common("GHOST"), f64::from(Kind::Ghost as u8));
    // No kind of the scene, and the same in both files.
    assert!(common("FOREIGN") > f64::from(Kind::Ghost as u8));
    assert_eq!(common("FOREIGN"), constant(text("halo"), "COPY"));
    assert_eq!(constant(text("halo"), "WALL"), f64::from(Kind::Wall as u8));
    assert_eq!(common("INACTIVE"), f64::from(State::Inactive as u8));
    assert_eq!(common("SURFACE"), f64::from(State::Surface as u8));
    assert_eq!(common("INNER"), f64::from(State::Inner as u8));
    assert_eq!(common("DISPLACEMENT_MAX"), DISPLACEMENT_MAX);
    assert_eq!(common("CLOSEST"), CLOSEST);
    assert_eq!(common("EIGENVALUE_MIN"), EIGENVALUE_MIN);
    assert_eq!(constant(text("viscosity"), "FIT_MIN"), seixo::kernels::viscosity::FIT_MIN);
    for (name, place) in [
        ("LOST", counter::LOST),
        ("DISPLACEMENT_CLAMPS", counter::DISPLACEMENT_CLAMPS),
        ("PRESSURE_CLAMPS", counter::PRESSURE_CLAMPS),
        ("NEGATIVE_PRESSURES", counter::NEGATIVE_PRESSURES),
        ("NEIGHBOURS_MAX", counter::NEIGHBOURS_MAX),
        ("NON_FINITE", counter::NON_FINITE),
        ("OVERFLOW", counter::OVERFLOW),
        ("SWALLOWED", counter::SWALLOWED),
    ] {
        assert_eq!(common(name), place as f64, "{name}");
    }
    assert_eq!(constant(text("monitor"), "WIDTH"), MONITOR_WIDTH as f64);
    assert_eq!(constant(text("monitor"), "SPEED_BINS"), seixo::monitor::SPEED_BINS as f64);
    use seixo::backend::gpu::layout::LEDGER_WIDTH;
    use seixo::ledger::Entry;
    assert_eq!(constant(text("ledger"), "LEDGER_WIDTH"), LEDGER_WIDTH as f64);
    for (name, entry) in [
        ("ABSORBED", Entry::Absorber),
        ("GRAVITY", Entry::Gravity),
        ("VISCOSITY", Entry::Viscosity),
        ("FRICTION", Entry::Friction),
        ("COLLISION", Entry::Collision),
        ("PRESSURE", Entry::Pressure),
        ("CLIP", Entry::Clip),
        ("CLAMPS", Entry::Clamps),
        ("SHIFTED", Entry::Shift),
        ("TAKEN_OUT", Entry::Lost),
    ] {
        assert_eq!(constant(text("ledger"), name), f64::from(entry as u8), "{name}");
    }
    let first_word = format!("const FIRST_WORD: u32 = {:#x}u;", seixo::backend::gpu::layout::FIRST_WORD);
    assert!(shader::COMMON.contains(&first_word));
    let on_wall = format!("const ON_WALL: u32 = {:#x}u;", seixo::contact::device::paper::ON_WALL);
    assert!(text("contact_paper").contains(&on_wall));
    let many_points = constant(text("contact_smooth"), "MANY_POINTS");
    assert_eq!(many_points, f64::from(seixo::contact::device::smooth::MANY_POINTS));
    use seixo::kernels::multigrid::{DAMPING, OVER_CORRECTION};
    // Written alike, hence read alike.
    let short = |x: f32| x.to_string().parse::<f64>().expect("a number");
    assert_eq!(constant(text("multigrid"), "DAMPING"), short(DAMPING));
    assert_eq!(constant(text("halo"), "DAMPING"), short(DAMPING));
    assert_eq!(constant(text("multigrid"), "OVER_CORRECTION"), short(OVER_CORRECTION));
    let with_multigrid = shader::source(text("conjugate_gradient"), &["MULTIGRID"]);
    assert_eq!(constant(&with_multigrid, "DAMPING"), short(DAMPING));
    for (name, operation) in [
        ("DOWN", Operation::Down),
        ("UP", Operation::Up),
        ("FORTH", Operation::Forth),
        ("BACK", Operation::Back),
    ] {
        assert_eq!(constant(text("multigrid"), name), f64::from(operation as u32), "{name}");
    }
    for (name, value) in [("SHIFT", SHIFT), ("SHIFT_MAX", SHIFT_MAX)] {
        assert_eq!(common(name), value, "{name}");
    }
    for (name, outcome) in [
        ("CONVERGED", Outcome::Converged),
        ("ZERO_SOURCE", Outcome::ZeroSource),
        ("MAX_ITERATIONS", Outcome::MaxIterations),
        ("BREAKDOWN", Outcome::Breakdown),
        ("NOT_FINITE", Outcome::NonFinite),
    ] {
        assert_eq!(constant(text("conjugate_gradient"), name), f64::from(outcome as u8), "{name}");
    }
}

#[test]
fn pipelines_and_bindings_fit_together_for_every_kind_of_scene() {
    for dimensions in [2, 3] {
        for (preset, viscosity, collision) in
            [("paper", 1e-3, 0.8), ("accurate", 1e-3, 0.8), ("accurate", 0.0, 0.8), ("accurate", 0.0, 0.0)]
        {
            let mut case = common::case(dimensions, &format!("preset = \"{preset}\""));
            let fluid = case.fluid.as_mut().expect("it has fluid");
            (fluid.viscosity, fluid.collision_distance) = (viscosity, collision);
            for moving in [true, false] {
                let mut scene = common::scene(dimensions, 1);
                if !moving {
                    let g = scene.groups;
                    let solid =
                        |i: &usize| g.moving_wall_range().contains(i) || g.moving_dummy_range().contains(i);
                    let stay: Vec<usize> = (0..g.total()).filter(|i| !solid(i)).collect();
                    scene.position = stay.iter().map(|&i| scene.position[i]).collect();
                    scene.velocity = stay.iter().map(|&i| scene.velocity[i]).collect();
                    scene.kind = stay.iter().map(|&i| scene.kind[i]).collect();
                    (scene.groups.moving_wall, scene.groups.moving_dummy) = (0, 0);
                    scene.solids.clear();
                }
                let params = Params::new(&case, &scene).expect("valid");
                let settings = Settings { tolerance: 1e-3, max_iterations: 100, warm_start: true };
                for (preconditioner, program) in [
                    (Preconditioner::Jacobi, None),
                    (Preconditioner::Jacobi, Some(&paper::PROGRAM)),
                    (Preconditioner::Multigrid, Some(&smooth::PROGRAM)),
                ] {
                    let contact = ContactPlan { program, reason: String::new() };
                    let plan = Plan { preconditioner, contact, ..Plan::new(&case, &scene, &params) };
                    let built = Gpu::dry_run(&scene, &params, &plan, settings);
                    if let Err(e) = built {
                        panic!("{dimensions}D, {preset}, {viscosity}, {collision}, moving {moving}: {e}");
                    }
                }
            }
        }
    }
}
