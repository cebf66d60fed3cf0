//! What contact costs a step: many bodies at rest, on the host and on a device.

use crate::case::{Case, Contact, ContactDevice};
use crate::error::{Error, Result};
use crate::params::Params;
use crate::plan::Plan;
use crate::pressure::Settings;
use crate::scene::Scene;

/// A backend for the contact of a dry scene built by hand; `make` is given what [`crate::simulation::Simulation`]
/// gives it. On a device the pairs run there, however few they are.
///
/// # Errors
/// What `make` says.
pub fn backend<B>(
    scene: &Scene,
    contact: &Contact,
    make: impl FnOnce(&Scene, &Params, &Plan, Settings) -> Result<B>,
) -> Result<B> {
    let l0 = scene.spacing;
    let text =
        format!("[run]\nspacing = {l0:?}\ntime_step = 1e-3\nend = 1.0\ndimensions = {}\n", scene.dimensions);
    let mut case: Case = toml::from_str(&text).map_err(|e| Error::Case(e.to_string()))?;
    case.contact = Some(Contact { device: ContactDevice::Gpu, ..contact.clone() });
    let params = Params::new(&case, scene)?;
    let plan = Plan::new(&case, scene, &params);
    let settings = Settings { tolerance: 1e-3, max_iterations: 1, warm_start: false };
    make(scene, &params, &plan, settings)
}
