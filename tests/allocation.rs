//! A step reuses its buffers: what it allocates does not grow with the particles.

use crate::common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

struct Counting;

static BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        BYTES.fetch_add(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(p, layout) }
    }
    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        BYTES.fetch_add(size, Relaxed);
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

#[test]
fn a_step_allocates_nothing_that_grows() {
    // The counter is the process's: measured where no other test runs.
    if std::env::var_os(ALONE).is_none() {
        let output = std::process::Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "allocation::a_step_allocates_nothing_that_grows", "--nocapture"])
            .env(ALONE, "1")
            .output()
            .expect("a process of its own");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("multigrid:"), "{text}");
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
