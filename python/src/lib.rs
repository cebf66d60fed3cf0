//! The module `seixo._native`: the program's command line, and a simulation that is advanced from Python. Arrays go over as bytes in the
//! machine's order, and become arrays of numpy there.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use seixo::case::file::{load, load_text};
use seixo::gauges::Gauges;
use seixo::scene::Kind;
use seixo::{Error, Options, Processor};
use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An error of the library as the package's exception of its exit code.
fn told(py: Python<'_>, error: &Error) -> PyErr {
    let exception = py
        .import("seixo._errors")
        .and_then(|module| module.getattr("error"))
        .and_then(|make| make.call1((error.to_string(), error.exit_code())));
    exception.map_or_else(|e| e, PyErr::from_value)
}

fn bytes<'py>(py: Python<'py>, values: impl ExactSizeIterator<Item = f64>) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, values.len() * 8, |room| {
        for (place, value) in room.chunks_exact_mut(8).zip(values) {
            place.copy_from_slice(&value.to_ne_bytes());
        }
        Ok(())
    })
}

/// Runs the program with `words` as its command line, its name first; returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| seixo_cli::main(words))
}

/// Name, whether it is a body, then position, orientation (w, x, y, z), velocity, angular velocity, force and torque of the water.
type Solid = (String, bool, [f64; 3], [f64; 4], [f64; 3], [f64; 3], [f64; 3], [f64; 3]);

/// Position, velocity, pressure, number density and number of the particles of water, as bytes.
type Water<'py> = [Bound<'py, PyBytes>; 5];

/// A case in motion.
#[pyclass(module = "seixo._native", frozen)]
struct Simulation {
    inner: Mutex<seixo::Simulation>,
    /// Once somebody has asked what they read.
    gauges: Mutex<Option<Gauges>>,
    #[pyo3(get)]
    warnings: Vec<String>,
}

impl Simulation {
    fn lock(&self) -> PyResult<MutexGuard<'_, seixo::Simulation>> {
        let wrong = |_| pyo3::exceptions::PyRuntimeError::new_err("the simulation panicked; open it anew");
        self.inner.lock().map_err(wrong)
    }

    /// Does `work` without Python's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut seixo::Simulation) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| self.lock().map(|mut inner| work(&mut inner)))?;
        done.map_err(|e| told(py, &e))
    }
}

/// The case at `path`, or of `text`, ready to go.
fn open(
    path: Option<PathBuf>,
    text: Option<String>,
    spacing: Option<f64>,
    sets: &[String],
    options: &Options,
) -> Result<(seixo::Simulation, Vec<String>), Error> {
    let loaded = match (path, text) {
        (Some(path), None) => load(&path, spacing, sets)?,
        // Paths count from the working directory.
        (_, text) => load_text(Path::new("the case"), text.unwrap_or_default(), spacing, sets)?,
    };
    let remedy = "leave it out, or run the case with `seixo.run`";
    seixo::run::from::refuse(&loaded, "a simulation that is stepped", remedy)?;
    Ok((seixo::Simulation::open(&loaded.case, options)?, loaded.warnings))
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (path, text, spacing, sets, backend, adapter, threads))]
    fn new(
        py: Python<'_>,
        path: Option<PathBuf>,
        text: Option<String>,
        spacing: Option<f64>,
        sets: Vec<String>,
        backend: &str,
        adapter: Option<String>,
        threads: Option<NonZeroUsize>,
    ) -> PyResult<Self> {
        let processor = match (backend, adapter) {
            ("cpu", Some(_)) => {
                let why = "adapter chooses a GPU; it does not go with backend=\"cpu\"";
                return Err(told(py, &Error::usage("adapter", why)));
            }
            ("cpu", None) => Processor::Cpu,
            ("auto", None) => Processor::Auto,
            ("gpu" | "auto", adapter) => Processor::Gpu { adapter },
            (other, _) => {
                let why = format!("backend = {other:?}: it is \"auto\", \"gpu\" or \"cpu\"");
                return Err(told(py, &Error::usage("backend", why)));
            }
        };
        let options = Options { processor, threads };
        let opened = py.detach(|| open(path, text, spacing, &sets, &options));
        let (inner, warnings) = opened.map_err(|e| told(py, &e))?;
        Ok(Self { inner: Mutex::new(inner), gauges: Mutex::default(), warnings })
    }

    /// Time [s].
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.lock()?.time)
    }

    /// Steps done.
    #[getter]
    fn steps(&self) -> PyResult<u64> {
        Ok(self.lock()?.steps)
    }

    /// The processor, and its precision.
    #[getter]
    fn processor(&self) -> PyResult<(String, &'static str)> {
        let inner = self.lock()?;
        Ok((inner.backend.description(), inner.backend.precision()))
    }

    /// `run.end`, the end of the case [s], and `run.time_step` [s].
    #[getter]
    fn clock(&self) -> PyResult<(f64, f64)> {
        let inner = self.lock()?;
        Ok((inner.case.run.end, inner.case.run.time_step))
    }

    /// One step: its length [s], iterations and residual of the pressure solver, whether that met its tolerance, sub-steps of contact.
    fn step(&self, py: Python<'_>) -> PyResult<(f64, u32, f64, bool, u32)> {
        self.with(py, |s| {
            let report = s.step()?;
            let (pressure, solved) = (report.pressure, seixo::run::tables::solved(report.pressure.outcome));
            Ok((report.dt, pressure.iterations, pressure.residual, solved, report.contact.substeps))
        })
    }

    /// The water as it is now.
    fn water<'py>(&self, py: Python<'py>) -> PyResult<Water<'py>> {
        let (fields, fluid) = self.with(py, |s| Ok((s.fields()?, s.groups.fluid)))?;
        let live: Vec<usize> =
            (0..fluid.min(fields.kind.len())).filter(|&i| fields.kind[i] == Kind::Fluid).collect();
        let vectors =
            |of: &[glam::DVec3]| -> Vec<f64> { live.iter().flat_map(|&i| of[i].to_array()).collect() };
        let numbers = |of: &[f64]| -> Vec<f64> { live.iter().map(|&i| of[i]).collect() };
        let id: Vec<f64> = live.iter().map(|&i| f64::from(fields.id[i])).collect();
        Ok([
            bytes(py, vectors(&fields.position).into_iter())?,
            bytes(py, vectors(&fields.velocity).into_iter())?,
            bytes(py, numbers(&fields.pressure).into_iter())?,
            bytes(py, numbers(&fields.number_density).into_iter())?,
            bytes(py, id.into_iter())?,
        ])
    }

    /// Bodies and moving walls as they are now.
    fn solids(&self) -> PyResult<Vec<Solid>> {
        let inner = self.lock()?;
        let solid = |s: seixo::SolidState<'_>| {
            let (pose, q) = (s.pose, s.turn);
            (
                s.name.to_owned(),
                s.is_body,
                pose.position.to_array(),
                [q.w, q.x, q.y, q.z],
                pose.velocity.to_array(),
                pose.angular_velocity.to_array(),
                s.fluid.force.to_array(),
                s.fluid.torque.to_array(),
            )
        };
        Ok(inner.solids().map(solid).collect())
    }

    /// What the gauges read now, by the columns of gauges.csv.
    fn gauges(&self, py: Python<'_>) -> PyResult<Vec<(String, f64)>> {
        self.with(py, |simulation| {
            let mut found = self.gauges.lock().unwrap_or_else(PoisonError::into_inner);
            let gauges = match found.take() {
                Some(gauges) => gauges,
                None => Gauges::new(&simulation.case, &simulation.scene)?,
            };
            simulation.read(found.insert(gauges))
        })
    }

    /// Energies and guards now, by the columns of monitors.csv.
    fn monitor(&self, py: Python<'_>) -> PyResult<Vec<(String, f64)>> {
        self.with(py, |s| {
            let (fluid, counters) = s.observe()?;
            let bodies = s.solids.energy();
            let known = [
                ("speed_max", fluid.speed_max),
                ("density_error_mean", fluid.density_error_mean),
                ("density_error_max", fluid.density_error_max),
                ("kinetic", fluid.kinetic),
                ("potential", fluid.potential),
                ("body_kinetic", bodies.kinetic),
                ("body_potential", bodies.gravity),
                ("body_contact", bodies.contact),
                ("energy", fluid.kinetic + fluid.potential + bodies.total()),
                ("fluid_lost", counters.lost as f64),
            ];
            let known = known.map(|(name, value)| (name.to_owned(), value));
            Ok(known.into_iter().chain(s.volumes(&fluid, &counters)).collect())
        })
    }
}

/// What is compiled of the package `seixo`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_class::<Simulation>()
}
