//! The particle arrays of a run.
//!
//! Slots follow [`crate::scene::Groups`]. Fluid slots are kept in cell order and so change from step to
//! step (`id` tells who is who); all other slots stay.

use crate::periodic::Periodic;
use crate::scene::{Groups, Kind, Scene};
use glam::DVec3;

/// Part of a particle in the pressure Poisson equation.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(u8)]
pub enum State {
    /// Takes no part: a dry wall, a ghost.
    #[default]
    Inactive = 0,
    /// On the free surface: P is known.
    Surface = 1,
    /// An unknown.
    Inner = 2,
}

impl State {
    /// The state of a number, as `state as u8` gives it.
    pub(crate) fn from_code(code: u8) -> Option<Self> {
        [Self::Inactive, Self::Surface, Self::Inner].into_iter().find(|&s| s as u8 == code)
    }
}

/// `more` times `value` from place `at` on.
pub(crate) fn insert<T: Clone>(values: &mut Vec<T>, at: usize, more: usize, value: T) {
    values.splice(at..at, std::iter::repeat_n(value, more));
}

/// State of all particles. Arrays marked P hold the pressure-carrying slots only, F the fluid slots only.
#[derive(Clone, Default, Debug)]
pub struct Fields {
    /// Position [m].
    pub position: Vec<DVec3>,
    /// Velocity [m/s].
    pub velocity: Vec<DVec3>,
    /// What the particle is.
    pub kind: Vec<Kind>,
    /// Number of the particle in the scene, F.
    pub id: Vec<u32>,
    /// Pressure [Pa], P.
    pub pressure: Vec<f64>,
    /// Number density n, Eq. (4) [-], P.
    pub number_density: Vec<f64>,
    /// Pressure on the free surface, 0 elsewhere [Pa], P; empty where the plan leaves it out.
    pub surface_pressure: Vec<f64>,
    /// Part in the PPE, P.
    pub state: Vec<State>,
    /// Right side of the PPE, Eq. (8), times -1 [Pa/m2], P.
    pub source: Vec<f64>,
    /// Diagonal of the PPE [1/m2], P.
    pub diagonal: Vec<f64>,
    /// Acceleration of the stage in progress (viscosity, collision, pressure gradient) [m/s2], F.
    pub acceleration: Vec<DVec3>,
    /// Force of viscosity, friction and collisions of the last step on walls [N], moving-wall slots and, where a gauge asks, those that never move;
    /// empty where the plan leaves it out.
    pub reaction: Vec<DVec3>,
    /// What the last step left of the excess of free bodies' rows beside what their equations told ([`crate::kernels::wall_excess`]) [Pa],
    /// moving-wall slots; empty where the plan leaves it out.
    pub inertia_head: Vec<f64>,
}

impl Fields {
    /// The state at t = 0, without the arrays that a plan may leave out.
    pub fn new(scene: &Scene) -> Self {
        let g = scene.groups;
        let p = g.pressure();
        Self {
            position: scene.position.clone(),
            velocity: scene.velocity.clone(),
            kind: scene.kind.clone(),
            id: (0..g.fluid as u32).collect(),
            pressure: vec![0.0; p],
            number_density: vec![0.0; p],
            surface_pressure: Vec::new(),
            state: vec![State::Inactive; p],
            source: vec![0.0; p],
            diagonal: vec![1.0; p],
            acceleration: vec![DVec3::ZERO; g.fluid],
            reaction: Vec::new(),
            inertia_head: Vec::new(),
        }
    }

    /// More slots of water, parked at `corner`, from slot `at` on, the first of the solids: these move up.
    pub(crate) fn widen(&mut self, at: usize, more: usize, corner: DVec3) {
        let Self {
            position,
            velocity,
            kind,
            id,
            pressure,
            number_density,
            surface_pressure,
            state,
            source,
            diagonal,
            acceleration,
            // Of solids alone.
            reaction: _,
            inertia_head: _,
        } = self;
        insert(position, at, more, corner);
        insert(velocity, at, more, DVec3::ZERO);
        insert(kind, at, more, Kind::Ghost);
        insert(id, at, more, 0);
        for values in [pressure, number_density, source] {
            insert(values, at, more, 0.0);
        }
        if !surface_pressure.is_empty() {
            insert(surface_pressure, at, more, 0.0);
        }
        insert(diagonal, at, more, 1.0);
        insert(state, at, more, State::Inactive);
        insert(acceleration, at, more, DVec3::ZERO);
    }

    /// Other particles that never move in the place of those of `groups`: walls at `walls`, with these pressures, and dummies at `dummies`.
    pub(crate) fn lay_still(&mut self, groups: &Groups, walls: &[(DVec3, f64)], dummies: &[DVec3]) {
        let Self {
            position,
            velocity,
            kind,
            pressure,
            number_density,
            surface_pressure,
            state,
            source,
            diagonal,
            // Of water, or of solids that move; the backend knows whether it keeps it of others.
            id: _,
            acceleration: _,
            reaction: _,
            inertia_head: _,
        } = self;
        let (all, carriers) = (groups.static_range(), groups.static_wall_range());
        let count = walls.len() + dummies.len();
        position.splice(all.clone(), walls.iter().map(|w| w.0).chain(dummies.iter().copied()));
        velocity.splice(all.clone(), std::iter::repeat_n(DVec3::ZERO, count));
        let kinds = std::iter::repeat_n(Kind::Wall, walls.len());
        kind.splice(all, kinds.chain(std::iter::repeat_n(Kind::Dummy, dummies.len())));
        pressure.splice(carriers.clone(), walls.iter().map(|w| w.1));
        for values in [number_density, source] {
            values.splice(carriers.clone(), std::iter::repeat_n(0.0, walls.len()));
        }
        if !surface_pressure.is_empty() {
            surface_pressure.splice(carriers.clone(), std::iter::repeat_n(0.0, walls.len()));
        }
        diagonal.splice(carriers.clone(), std::iter::repeat_n(1.0, walls.len()));
        state.splice(carriers, std::iter::repeat_n(State::Inactive, walls.len()));
    }

    /// Bring the fluid back between the sides where these are periodic: since the last search it may have left them.
    pub(crate) fn wrap(&mut self, groups: &Groups, periodic: &Periodic) {
        if periodic.is_any() {
            self.position[..groups.fluid].iter_mut().for_each(|x| *x = periodic.wrap(*x));
        }
    }
}
