//! Fields between host (f64, absolute) and device (f32, relative to the middle of the domain).

use super::layout::{Remainder, counter, number_of, word_of};
use super::{Gpu, buffers};
use crate::cells::Grid;
use crate::error::{Error, Result};
use crate::fields::{Fields, State};
use crate::kernels::cell_list::counting_sort;
use crate::kernels::pressure_source::laplacian_coefficient;
use crate::plan::Arrays;
use crate::scene::Kind;
use glam::{DVec3, Vec3};

/// Vectors with a fourth component.
pub(super) fn packed(values: &[DVec3], fourth: impl Fn(usize) -> f32) -> Vec<[f32; 4]> {
    values
        .iter()
        .enumerate()
        .map(|(i, &v)| {
            let v = v.as_vec3();
            [v.x, v.y, v.z, fourth(i)]
        })
        .collect()
}

/// Places of particles as a device keeps them, relative to `middle`.
pub(super) fn packed_places(fields: &Fields, middle: DVec3, remainder: Remainder) -> Vec<[f32; 4]> {
    let place = |(&x, &kind): (&DVec3, &Kind)| {
        let [x, y, z, rest] = remainder.pack(x - middle);
        [x, y, z, if kind == Kind::Fluid { rest } else { f32::from(kind as u8) }]
    };
    fields.position.iter().zip(&fields.kind).map(place).collect()
}

pub(super) fn vector(v: &[f32; 4]) -> DVec3 {
    DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

pub(super) fn kind(code: f32) -> Kind {
    match code as u8 {
        0 => Kind::Fluid,
        1 => Kind::Wall,
        2 => Kind::Dummy,
        3 => Kind::BodyWall,
        4 => Kind::BodyDummy,
        _ => Kind::Ghost,
    }
}

/// Start of each cell and particles in cell order, as bits of x, y, z and the slot. Cells are found in f32
/// as the shaders find them; what never moves stands between the sides where these are periodic.
fn index(
    grid: &Grid,
    lower: Vec3,
    width: Vec3,
    first: usize,
    position: &[[f32; 4]],
) -> (Vec<u32>, Vec<[u32; 4]>) {
    let cell = |x: &[f32; 4]| {
        let c = ((Vec3::new(x[0], x[1], x[2]) - lower) / width).max(Vec3::ZERO);
        let along = |c: f32, count: u32| (c as u32).min(count - 1);
        grid.index([along(c.x, grid.count[0]), along(c.y, grid.count[1]), along(c.z, grid.count[2])]) as u32
    };
    let cells: Vec<u32> = position.iter().map(cell).collect();
    let (mut start, mut order) = (Vec::new(), Vec::new());
    counting_sort(&cells, grid.total(), &mut start, &mut order);
    let entry = |&k: &u32| {
        let x = position[k as usize];
        [x[0].to_bits(), x[1].to_bits(), x[2].to_bits(), first as u32 + k]
    };
    (start, order.iter().map(entry).collect())
}

impl Gpu {
    /// Overwrite all fields on the device. The neighbour lists, made for the old slots, are emptied.
    pub(super) fn write_fields(&mut self, fields: &Fields) -> Result<()> {
        let g = self.groups;
        if fields.position.len() != g.total() || fields.pressure.len() != g.pressure() {
            return Err(Error::gpu("the fields are those of another scene"));
        }
        let position = packed_places(fields, self.middle, Remainder::new(&self.params));
        // Moving solids stay where they are, and face there.
        let moving = g.moving_wall_range();
        let facing = if self.plan.needs(Arrays::Solids) {
            self.context.download_parts(buffers::velocity, &[(moving.start, moving.len())])?
        } else {
            vec![]
        };
        let number = |i: usize| match fields.id.get(i) {
            Some(&id) => word_of(id),
            None => facing.get(i - moving.start).map_or(0.0, |v| v[3]),
        };
        let velocity = packed(&fields.velocity, number);
        let c = laplacian_coefficient(&self.params);
        let equation = |i: usize| {
            let inner = fields.state[i] == State::Inner;
            [(fields.source[i] / c) as f32, if inner { (fields.diagonal[i] / c) as f32 } else { 0.0 }]
        };
        let equations: Vec<[f32; 2]> = (0..g.pressure()).map(equation).collect();
        let scalar = |v: &[f64]| v.iter().map(|&x| x as f32).collect::<Vec<f32>>();
        let state: Vec<u32> = fields.state.iter().map(|&s| s as u32).collect();
        let fixed = g.static_range();
        let context = &mut self.context;
        if !fixed.is_empty() {
            let lower = (self.params.domain_min - self.middle).as_vec3();
            let width = self.grid.width.as_vec3();
            let (start, particle) = index(&self.grid, lower, width, fixed.start, &position[fixed.clone()]);
            context.upload(buffers::static_start, &start)?;
            context.upload(buffers::static_particle, &particle)?;
        }
        context.upload(buffers::position, &position)?;
        context.upload(buffers::velocity, &velocity)?;
        context.upload(buffers::pressure, &scalar(&fields.pressure))?;
        context.upload(buffers::number_density, &scalar(&fields.number_density))?;
        context.upload(buffers::state, &state)?;
        context.upload(buffers::source_diagonal, &equations)?;
        context.upload(buffers::acceleration, &packed(&fields.acceleration, |_| 0.0))?;
        if self.plan.needs(Arrays::SurfacePressure) {
            context.upload(buffers::surface_pressure, &scalar(&fields.surface_pressure))?;
        }
        if self.sizes.reacting > 0 && !fields.reaction.is_empty() {
            context.upload(buffers::reaction, &packed(&fields.reaction, |_| 0.0))?;
        }
        if self.plan.needs(Arrays::Coupling) {
            context.upload(buffers::inertia_head, &scalar(&fields.inertia_head))?;
        }
        context.upload(buffers::counters, &counter::START)?;
        context.clear(buffers::neighbour_count)
    }

    /// The neighbour lists: of each pressure-carrying slot those that carry pressure, and dummies.
    pub fn neighbours(&mut self) -> Result<Vec<(Vec<u32>, Vec<u32>)>> {
        let rows = self.groups.pressure();
        let capacity = self.sizes.capacity as usize;
        let count = self.context.download(buffers::neighbour_count, rows)?;
        let list = self.context.download(buffers::neighbour_list, capacity * rows)?;
        let row = |i: usize| {
            let (near, dummies) = ((count[i] & 0xfff) as usize, (count[i] >> 12 & 0xfff) as usize);
            let at = |k: usize| list[k * rows + i];
            ((0..near).map(at).collect(), (0..dummies).map(|k| at(capacity - 1 - k)).collect())
        };
        Ok((0..rows).map(row).collect())
    }

    /// All fields of the device.
    pub(super) fn read_fields(&mut self) -> Result<Fields> {
        let g = self.groups;
        let context = &mut self.context;
        let position = context.download(buffers::position, g.total())?;
        let velocity = context.download(buffers::velocity, g.total())?;
        let equations = context.download(buffers::source_diagonal, g.pressure())?;
        let state: Vec<State> = context
            .download(buffers::state, g.pressure())?
            .into_iter()
            .map(|s| match s {
                0 => State::Inactive,
                1 => State::Surface,
                _ => State::Inner,
            })
            .collect();
        let wide = |v: Vec<f32>| v.into_iter().map(f64::from).collect::<Vec<f64>>();
        let pressure = wide(context.download(buffers::pressure, g.pressure())?);
        let number_density = wide(context.download(buffers::number_density, g.pressure())?);
        let acceleration = context.download(buffers::acceleration, g.fluid)?;
        let known = if self.plan.needs(Arrays::SurfacePressure) { g.pressure() } else { 0 };
        let surface_pressure =
            wide(if known > 0 { context.download(buffers::surface_pressure, known)? } else { Vec::new() });
        let felt = self.sizes.reacting as usize;
        let reaction = if felt > 0 { context.download(buffers::reaction, felt)? } else { Vec::new() };
        let heads = if self.plan.needs(Arrays::Coupling) { g.moving_wall } else { 0 };
        let inertia_head =
            wide(if heads > 0 { context.download(buffers::inertia_head, heads)? } else { Vec::new() });
        let c = laplacian_coefficient(&self.params);
        let diagonal = |e: &[f32; 2]| if e[1] > 0.0 { f64::from(e[1]) * c } else { 1.0 };
        let remainder = Remainder::new(&self.params);
        let mut fields = Fields {
            kind: position.iter().map(|x| kind(x[3])).collect(),
            position: position.iter().map(|x| remainder.place(x) + self.middle).collect(),
            id: velocity[..g.fluid].iter().map(|v| number_of(v[3])).collect(),
            velocity: velocity.iter().map(vector).collect(),
            pressure,
            number_density,
            surface_pressure,
            state,
            source: equations.iter().map(|e| f64::from(e[0]) * c).collect(),
            diagonal: equations.iter().map(diagonal).collect(),
            acceleration: acceleration.iter().map(vector).collect(),
            reaction: reaction.iter().map(vector).collect(),
            inertia_head,
        };
        fields.wrap(&g, &self.params.periodic);
        Ok(fields)
    }
}
