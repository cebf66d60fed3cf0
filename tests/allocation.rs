//! A step reuses its buffers: what it allocates does not grow with the particles. A run that is gone on with holds no
//! more than it did before.

use crate::common;

use seixo::run::resume::{Standing, standing};
use seixo::run::{Options, Progress, Start, run};
use seixo::stop::Stop;
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

struct Counting;

static BYTES: AtomicUsize = AtomicUsize::new(0);

/// Bytes that are held.
static HELD: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        BYTES.fetch_add(layout.size(), Relaxed);
        HELD.fetch_add(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(p, layout) }
    }
    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        BYTES.fetch_add(size, Relaxed);
        HELD.fetch_add(size, Relaxed);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.realloc(p, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Bytes allocated a step by still water, after the buffers have found their sizes, and the particles.
fn bytes_per_step(spacing: f64, preconditioner: &str) -> (usize, usize) {
    let fluid = format!("sound_speed = 3\nsolver = {{ preconditioner = \"{preconditioner}\" }}");
    let case = common::hydrostatic(spacing, 2e-4, &fluid);
    let mut sim = common::simulation(&case);
    for _ in 0..20 {
        sim.step().expect("still water is no trouble");
    }
    let before = BYTES.load(Relaxed);
    for _ in 0..20 {
        sim.step().expect("still water is no trouble");
    }
    ((BYTES.load(Relaxed) - before) / 20, sim.groups.total())
}

/// Set in the process that measures.
const ALONE: &str = "SEIXO_TEST_ALLOCATION";

/// Whether this process is to measure. The counters are the process's: if not, `name` is run in one of its own, where
/// no other test runs, and must say `said`.
fn is_alone(name: &str, said: &str) -> bool {
    if std::env::var_os(ALONE).is_some() {
        return true;
    }
    let output = std::process::Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", &format!("allocation::{name}"), "--nocapture"])
        .env(ALONE, "1")
        .output()
        .expect("a process of its own");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains(said), "{text}");
    false
}

#[test]
fn a_step_allocates_nothing_that_grows() {
    if !is_alone("a_step_allocates_nothing_that_grows", "multigrid:") {
        return;
    }
    for preconditioner in ["jacobi", "multigrid"] {
        let (bytes, particles) = bytes_per_step(0.0125, preconditioner);
        println!("{preconditioner}: {bytes} bytes a step, {particles} particles");
        // One array of the fluid's positions would be 390 kB; the monitors' histograms take some kilobytes.
        assert!(
            particles > 30_000 && bytes < 60_000,
            "{preconditioner}: {bytes} bytes, {particles} particles"
        );
    }
}

/// Still water that saves its state at the end.
const STILL: &str = "[run]\nspacing = 0.0125\ntime_step = 2e-4\nend = 1.0\ngravity = [0, 0, -9.81]\n\
    checkpoint = { every = 1.0 }\n\
    [fluid]\nsound_speed = 3\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.5]\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.25, 0.25, 0.7]\nopen = [\"z_max\"]\n";

/// Bytes that a run in `out` holds after step `steps`, to which it goes on from where it is, and bytes of its state.
fn held(out: &Path, steps: u64) -> (usize, usize) {
    let before = HELD.load(Relaxed);
    let case = common::case(STILL);
    let mut state = 0;
    let start = match standing(out, &case).expect("it stands") {
        Standing::Nothing => Start::New,
        Standing::Stopped(found) => {
            state = found.archive.sections.values().map(|s| s.bytes.len()).sum();
            Start::Resume(found)
        }
        other => panic!("{other:?}"),
    };
    let mut simulation = common::simulation(&case);
    let scene = simulation.scene.clone();
    let options =
        Options { name: "still".into(), out: out.into(), start, steps: Some(steps), ..Options::default() };
    let mut holds = 0;
    let mut look = |_: &Progress| holds = HELD.load(Relaxed) - before;
    let ended = run(&mut simulation, &scene, STILL, options, &Stop::default(), &mut look).expect("it begins");
    assert!(ended.error.is_none(), "{:?}", ended.error);
    (holds, state)
}

#[test]
fn a_run_that_is_gone_on_with_holds_its_state_once() {
    if !is_alone("a_run_that_is_gone_on_with_holds_its_state_once", "state:") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("still");
    let (fresh, _) = held(&out, 20);
    let (on, state) = held(&out, 40);
    println!("state: {state} bytes; {fresh} bytes held, gone on with {on}");
    assert!(
        state > 3_000_000 && on < fresh + state / 4,
        "{fresh} bytes held, gone on with {on}, state {state}"
    );
}
