//! A scene as it fits a device: what is divided, the shaders, the limits to ask for. Nothing is allocated yet.

use super::adapter::{self, AdapterInfo, Caps};
use super::hierarchy::Levels;
use super::kernels;
use super::layout::FLUID_MAX;
use super::memory::{Memory, Sizes};
use super::parts::Division;
use super::set_up::grid;
use super::shader::{self, Shader};
use crate::cells::Grid;
use crate::compute::Program;
use crate::error::{GpuError, Result};
use crate::params::Params;
use crate::plan::{Arrays, Plan};
use crate::scene::{Groups, Scene};

/// A scene as it fits a device.
pub(super) struct Fitted {
    pub grid: Grid,
    pub sizes: Sizes,
    pub memory: Memory,
    pub division: Division,
    pub shaders: Vec<Shader>,
    /// Of multigrid, where it is planned.
    pub levels: Option<Levels>,
    /// Bytes of a buffer at most.
    pub most: u64,
    /// To ask for.
    pub limits: wgpu::Limits,
}

impl Fitted {
    /// `scene` on a device `info` with limits `have`, lowered to `caps`; of one of many ranks, which have `all` these particles together, or alone.
    pub fn new(
        scene: &Scene,
        params: &Params,
        plan: &Plan,
        info: &AdapterInfo,
        have: wgpu::Limits,
        caps: Caps,
        all: Option<Groups>,
    ) -> Result<Self> {
        let ranks = all.is_some();
        let fluid = scene.groups.fluid;
        if fluid > FLUID_MAX {
            let text = format!(
                "{fluid} fluid particles are more than the GPU path numbers ({FLUID_MAX}); use a larger run.spacing or \
                 --backend cpu"
            );
            let (needs, has) = (fluid as u64, Some(FLUID_MAX as u64));
            return Err(GpuError::TooSmall { limit: "fluid particles", needs, has, text }.into());
        }
        let grid = grid(params, plan)?;
        let mut sizes = Sizes::new(scene, params, &grid, plan);
        sizes.pressure_of_all = all.map_or(0, |all| all.pressure() as u64);
        if info.device_type == "cpu" {
            sizes.rows_per_thread = 4;
        }
        let mut memory = Memory::new(&sizes, plan);
        if ranks {
            memory = memory.with(&kernels::HALO);
        }
        let have = caps.lower(have);
        let most = adapter::buffer_most(&have);
        let width = adapter::width(&have);
        let division = Division::new(&memory, most, width);
        let mut switches = shader::switches(params, plan);
        switches.extend(ranks.then_some("RANKS"));
        // The pairs of solids that come close may become any number.
        let of_pairs = Division { fold: Some(width), ..division.clone() };
        let of_contact = |p: &&Program| plan.contact.program.is_some_and(|c| c.name == p.name);
        let particles = kernels::planned(plan).filter(|p| !of_contact(p));
        let mut shaders = Shader::all(particles, &switches, &division)?;
        shaders.extend(Shader::all(ranks.then_some(&kernels::HALO).into_iter(), &switches, &division)?);
        shaders.extend(Shader::all(plan.contact.program.into_iter(), &switches, &of_pairs)?);
        let levels = plan.needs(Arrays::Multigrid).then(|| Levels::new(&sizes).split(caps.large_levels));
        if let Some(levels) = &levels {
            shaders.iter_mut().for_each(|shader| shader.leave_out(&levels.idle()));
        }
        let grows = plan.contact.program.is_some();
        let limits = adapter::limits(&memory, grows, Shader::bindings(&shaders), &have, &info.name)?;
        Ok(Self { grid, sizes, memory, division, shaders, levels, most, limits })
    }
}
