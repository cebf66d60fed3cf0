//! Openings over time: how far the walls in them have gone, and which water comes in and goes out in a step.
//!
//! The wall layer of an inflow moves in with the water's velocity. When it has gone one spacing it becomes water where it is, and
//! the wall goes on from where it began: what is in front of it feels no difference, as the particles stay where they are. The wall
//! of an outflow draws back; when it has gone one spacing, the water that has followed it out of the tank is swallowed and the
//! wall stands in the face again. A hole swallows what has gone through the room behind it, in which its jet
//! contracts.

use crate::body::Pose;
use crate::checkpoint::Archive;
use crate::cover::{SLACK, Standing};
use crate::error::Result;
use crate::kernels::openings::{Emission, Outlet};
use crate::scene::{INFLOW_ROOM, Opening, Passes, Scene};
use glam::DVec3;
use std::borrow::Cow;
use std::ops::Range;

/// Part of the volume that an outflow of given discharge is behind its table which it makes up for while its wall goes the next
/// spacing [-].
const MADE_UP: f64 = 0.5;

/// An opening and where its wall is.
#[derive(Clone, Debug)]
struct Gate {
    opening: Opening,
    /// Slots of its wall layer.
    wall: Range<usize>,
    /// How far the wall has gone [m], less than a spacing.
    travel: f64,
    /// Speed of the wall [m/s].
    speed: f64,
    /// Layers that have become water, and the particles of these that a solid held back.
    layers: u64,
    held: u64,
    /// Where the particles of an inflow's layer become water [m].
    places: Vec<DVec3>,
    /// Discharge over this area is the speed of a wall that follows a discharge [m2].
    area: f64,
    /// Particles that it had swallowed when they were last counted.
    taken: u64,
    /// Volume that its discharge has asked for so far [m3], without what was missed: the discharge may have been another before `run.from`.
    /// 0 of walls that follow none.
    asked: f64,
    /// Volume that its discharge has asked for where no water was, and that is not made up for [m3].
    missed: f64,
}

/// The openings of a scene.
#[derive(Clone, Debug, Default)]
pub struct Openings {
    gates: Vec<Gate>,
    spacing: f64,
    /// Until when the walls have gone [s]: where the water of the last step found its forces.
    reached: f64,
}

/// What passes the openings in a step.
#[derive(Clone, Debug, Default)]
pub struct Passage {
    /// Parts of layers that become water.
    pub emissions: Vec<Emission>,
    /// Where water is swallowed, one an outflow.
    pub outlets: Vec<Outlet>,
    /// Whether an outflow must know what it has swallowed.
    pub counts: bool,
}

impl Openings {
    /// Those of `scene` at t = 0.
    pub fn new(scene: &Scene) -> Self {
        let gate = |opening: &Opening| Gate {
            wall: opening.solid.map_or(0..0, |k| scene.solids[k].wall_slots.clone()),
            travel: 0.0,
            speed: 0.0,
            layers: 0,
            held: 0,
            places: opening.places(scene),
            area: opening.area * (opening.wet.max(1) as f64 / opening.layer as f64).max(0.25),
            taken: 0,
            asked: 0.0,
            missed: 0.0,
            opening: opening.clone(),
        };
        Self { gates: scene.openings.iter().map(gate).collect(), spacing: scene.spacing, reached: 0.0 }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.gates.is_empty()
    }

    /// Largest speed of a wall between the times `from` and `to` [m/s].
    pub fn fastest(&self, from: f64, to: f64) -> f64 {
        self.gates.iter().map(|g| g.opening.fastest(from, to)).fold(0.0, f64::max)
    }

    /// Moves the walls on until `to` [s]; water that comes in takes the last of `slots` fluid slots. None comes in where one of
    /// the solids of `scene` stands, in their `poses`.
    pub fn advance(&mut self, to: f64, slots: usize, scene: &Scene, poses: &[Pose]) -> Passage {
        let (l0, from) = (self.spacing, self.reached);
        self.reached = to;
        let mut out = Passage::default();
        for gate in &mut self.gates {
            let way = match &gate.opening.passes {
                Passes::In(speed) | Passes::Out(speed) => {
                    gate.speed = speed.value(to);
                    speed.integral(from, to)
                }
                Passes::Drawn(discharge) => {
                    gate.speed = discharge.value(to) / gate.area;
                    let volume = discharge.integral(from, to);
                    gate.asked += volume;
                    volume / gate.area
                }
                Passes::Free => 0.0,
            };
            gate.travel += way;
            // A time step is far too short for two.
            let crosses = gate.travel >= l0;
            if crosses {
                gate.travel -= l0;
            }
            let outward = gate.opening.outward;
            if gate.opening.is_inflow() {
                if crosses {
                    gate.layers += 1;
                    let first = gate.wall.start;
                    gate.held += gate.wall.len() as u64;
                    for part in free(&held_back(scene, &gate.opening, &gate.places, poses)) {
                        gate.held -= part.len() as u64;
                        out.emissions.push(Emission {
                            wall: first + part.start..first + part.end,
                            to: 0,
                            shift: -outward * way,
                            velocity: -outward * gate.speed,
                        });
                    }
                }
                continue;
            }
            out.counts |= crosses && matches!(gate.opening.passes, Passes::Drawn(_));
            out.outlets.push(if crosses || gate.opening.passes == Passes::Free {
                gate.opening.outlet(gate.travel)
            } else {
                Outlet::CLOSED
            });
        }
        let mut first = slots;
        for emission in out.emissions.iter_mut().rev() {
            first -= emission.wall.len();
            emission.to = first;
        }
        out
    }

    /// Takes in what the outflows have swallowed since the start: walls that follow a discharge hurry or wait.
    pub fn count(&mut self, passage: &Passage, swallowed: &[u64]) {
        let l0 = self.spacing;
        let outflows = self.gates.iter_mut().filter(|g| !g.opening.is_inflow());
        for ((gate, outlet), &total) in outflows.zip(&passage.outlets).zip(swallowed) {
            if !matches!(gate.opening.passes, Passes::Drawn(_)) || outlet.is_closed() {
                continue;
            }
            let full = gate.opening.area;
            let wet = (total - gate.taken) as f64 * l0 * l0;
            gate.taken = total;
            let behind = gate.asked - total as f64 * l0.powi(3);
            // A pump that has run dry owes no more than a full layer.
            let beyond = (behind - full * l0).max(0.0);
            gate.missed += beyond;
            gate.asked -= beyond;
            let behind = behind - beyond;
            // A wall that has met no water goes on as if there were.
            let wet = if wet > 0.0 { wet } else { full };
            gate.area =
                (wet - MADE_UP * behind / l0).clamp(full / crate::case::HURRY, full * crate::case::HURRY);
        }
    }

    /// Takes in what outflows have `swallowed` in the run before `run.from`. One that follows a discharge from now on, and had none there, owes
    /// nothing for that time: of what it is asked for it has all but the layer that its wall has begun.
    pub(crate) fn begin(&mut self, swallowed: &[u64]) {
        let l0 = self.spacing;
        let outflows = self.gates.iter_mut().filter(|g| !g.opening.is_inflow());
        for (gate, &total) in outflows.zip(swallowed) {
            if !matches!(gate.opening.passes, Passes::Drawn(_)) {
                gate.asked = 0.0;
            } else if gate.asked == 0.0 {
                gate.taken = total;
                gate.asked = total as f64 * l0.powi(3) + gate.travel * gate.area;
            }
        }
    }

    /// The `poses` of the solids with the walls in the openings where they are.
    pub fn place<'a>(&self, poses: &'a [Pose]) -> Cow<'a, [Pose]> {
        let mut poses = Cow::Borrowed(poses);
        for gate in &self.gates {
            if let Some(k) = gate.opening.solid {
                let way = if gate.opening.is_inflow() { -gate.opening.outward } else { gate.opening.outward };
                let pose = &mut poses.to_mut()[k];
                pose.position += gate.travel * way;
                pose.velocity = gate.speed * way;
            }
        }
        poses
    }

    /// Columns of what is told of the water's volumes, without units; none without openings.
    pub(crate) fn columns(&self) -> Vec<String> {
        if self.is_empty() {
            return Vec::new();
        }
        let emitted = self.emitted().map(|(name, _)| format!("inflow_{name}"));
        let swallowed = self.outflows().map(|name| format!("outflow_{name}"));
        std::iter::once("water_volume".to_owned()).chain(emitted).chain(swallowed).collect()
    }

    /// Particles that have come in, one an inflow.
    pub fn emitted(&self) -> impl Iterator<Item = (&str, u64)> {
        let inflows = self.gates.iter().filter(|g| g.opening.is_inflow());
        inflows.map(|g| (g.opening.name.as_str(), g.layers * g.wall.len() as u64 - g.held))
    }

    /// All particles that have come in.
    pub fn total_emitted(&self) -> u64 {
        self.emitted().map(|(_, n)| n).sum()
    }

    /// Names of the outflows.
    pub fn outflows(&self) -> impl Iterator<Item = &str> {
        self.gates.iter().filter(|g| !g.opening.is_inflow()).map(|g| g.opening.name.as_str())
    }

    /// Volume that each inflow was to let in and did not, as a solid stood there [m3].
    pub(crate) fn held_back(&self) -> impl Iterator<Item = f64> {
        let inflows = self.gates.iter().filter(|g| g.opening.is_inflow());
        inflows.map(|g| g.held as f64 * self.spacing.powi(3))
    }

    /// Volume that each outflow has missed of its discharge for good [m3], of those that follow one.
    pub(crate) fn missed(&self) -> impl Iterator<Item = Option<f64>> {
        let outflows = self.gates.iter().filter(|g| !g.opening.is_inflow());
        outflows.map(|g| matches!(g.opening.passes, Passes::Drawn(_)).then_some(g.missed))
    }

    /// Save where the walls are, or take it over.
    ///
    /// # Errors
    /// [`crate::error::Error::Checkpoint`] if the state has none.
    pub(crate) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        for (k, gate) in self.gates.iter_mut().enumerate() {
            let Gate {
                opening: _,
                wall: _,
                places: _,
                travel,
                speed,
                layers,
                held,
                area,
                taken,
                asked,
                missed,
            } = gate;
            archive.number(&format!("openings.{k}.travel"), travel)?;
            archive.number(&format!("openings.{k}.speed"), speed)?;
            archive.number(&format!("openings.{k}.area"), area)?;
            archive.number(&format!("openings.{k}.asked"), asked)?;
            archive.number_of_late(&format!("openings.{k}.missed"), missed)?;
            archive.count(&format!("openings.{k}.layers"), layers)?;
            archive.count_of_late(&format!("openings.{k}.held"), held)?;
            archive.count(&format!("openings.{k}.taken"), taken)?;
        }
        if !self.gates.is_empty() {
            archive.number("openings.reached", &mut self.reached)?;
        }
        Ok(())
    }
}

/// Which of the `places` [m] where the layer of an inflow of `scene` becomes water solids in these `poses` hold back: they stand there or
/// [`INFLOW_ROOM`] further.
fn held_back(scene: &Scene, opening: &Opening, places: &[DVec3], poses: &[Pose]) -> Vec<bool> {
    let (spacing, periodic) = (scene.spacing, &scene.periodic);
    let further = -INFLOW_ROOM * spacing * opening.outward;
    let ends = places.iter().map(|&x| (x, x)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (low, high) = ends.unwrap_or_default();
    let (middle, reach) = (0.5 * (low + high + further), 0.5 * (high - low + further.abs()).length());
    let solids = opening.passing.iter().map(|&k| Standing::of(k, &scene.solids[k], &poses[k]));
    let near: Vec<Standing> = solids.filter(|s| s.may_reach(middle, reach, periodic)).collect();
    let holds = |x: DVec3| near.iter().any(|s| s.outside(x, 0.0, periodic) < -SLACK * spacing);
    places.iter().map(|&x| holds(x) || holds(x + further)).collect()
}

/// Runs of the places that are not `held`.
fn free(held: &[bool]) -> impl Iterator<Item = Range<usize>> {
    let parts = held.chunk_by(|a, b| a == b).scan(0, |from, part| {
        let first = *from;
        *from += part.len();
        Some((part[0], first..*from))
    });
    parts.filter(|(held, _)| !held).map(|(_, part)| part)
}

impl Opening {
    /// Where the particles of its wall layer become water, if it is an inflow [m].
    fn places(&self, scene: &Scene) -> Vec<DVec3> {
        let Some(solid) = self.solid.filter(|_| self.is_inflow()).map(|k| &scene.solids[k]) else {
            return vec![];
        };
        solid
            .wall_offset
            .iter()
            .map(|offset| solid.position + offset - scene.spacing * self.outward)
            .collect()
    }

    /// The box behind the wall in it, which has gone so far from the face [m], or behind a hole.
    fn outlet(&self, travel: f64) -> Outlet {
        let (low, high) = self.behind;
        match self.room {
            Some((room_low, room_high)) => Outlet { low, high, room_low, room_high },
            None => {
                let shift = travel * self.outward;
                Outlet::all((low + shift.max(DVec3::ZERO), high + shift.min(DVec3::ZERO)))
            }
        }
    }
}
