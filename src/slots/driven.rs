//! What slots press on solids that no force moves, in place of what the rows of these tell there, as on fixed walls: laid on their faces by points, and what is
//! pressed on and bare at once counts once.

use super::{Held, Opposite, Push, Slots};
use crate::body::{Pose, Wrench};
use crate::cover::driven::Covered;
use crate::error::Result;
use crate::kernels::body_force::RowPressure;
use crate::params::Params;
use crate::shape::Face;
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Which face of which row of which solid.
type Of = (usize, usize, usize);

/// A face that looks back at a push less than this is not pressed on (cosine of the angle).
pub(crate) const AGAINST: f64 = 0.5;
/// Least and largest distance of a push from a face that it is on, over l0: that of the widest slot, and half a spacing for where the two lean, or of the widest room.
pub(crate) const BEFORE: (f64, f64) = (-0.6, 1.6);
/// A face this much deeper than another before which the same point lies, over l0, is hidden by that.
const HIDDEN: f64 = 0.5;
/// Faces that are as near but for this, over l0, have a part each.
const AS_NEAR: f64 = 1e-2;

/// How much of a push is on a face [-], and the way to it [m].
struct Laid {
    of: Of,
    share: f64,
    way: DVec3,
}

/// A face near a push, world axes.
struct Near {
    of: Of,
    /// In the frame of its solid, with the turn from that.
    face: Face,
    turn: DQuat,
    /// From its middle to the push [m].
    from: DVec3,
    normal: DVec3,
    /// Direction along which what is before it comes to it.
    along: DVec3,
    bends: bool,
    /// Square of half its edge [m2].
    half: f64,
}

impl Near {
    /// How far before its plane `x` of the push lies [m].
    fn above(&self, x: DVec3) -> f64 {
        (self.from + x).dot(self.normal)
    }

    /// The way from there to where it comes to the plane [m].
    fn way(&self, x: DVec3) -> DVec3 {
        -self.above(x) / self.along.dot(self.normal) * self.along
    }
}

impl Slots {
    /// What the `pushes` do to driven solids and obstacles at `poses`, which others cover in part [N, N m]. Of solids that are `held` rows with a slot of their own
    /// have what presses there from those. `read` tells what slots of particles have.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn on_driven(
        &self,
        poses: &[Pose],
        (covered, held): (&[Covered], Option<&Held>),
        pushes: &[Push],
        params: &Params,
        read: impl FnOnce(&[usize]) -> Result<Vec<RowPressure>>,
    ) -> Result<Vec<(usize, Wrench)>> {
        let laid = self.laid(poses, held, pushes);
        if laid.is_empty() {
            return Ok(vec![]);
        }
        let mut out = vec![];
        let mut pressed: BTreeMap<Of, f64> = BTreeMap::new();
        for (push, on) in pushes.iter().zip(laid) {
            for Laid { of, share, way } in on {
                let (k, turn) = (of.0, poses[of.0].orientation);
                let normal = turn * self.face(of).area.normalize_or_zero();
                let area = share * push.area_on(normal);
                *pressed.entry(of).or_default() += area.length();
                out.push((k, self.on(push, push.pressure_at(way, params) * area, &poses[k])));
            }
        }
        let mut taken: HashMap<Of, f64> = HashMap::new();
        covered.iter().for_each(|c| *taken.entry((c.solid, c.row, c.face)).or_default() += c.area.length());
        let rows: Vec<usize> = pressed.keys().map(|&(k, row, _)| self.layers[k].first + row).collect();
        for ((of, pressed), told) in pressed.into_iter().zip(read(&rows)?) {
            let (k, row, _) = of;
            let (face, turn) = (self.face(of), poses[k].orientation);
            let (whole, normal) = (face.area.length(), turn * face.area.normalize_or_zero());
            let bare = (whole - taken.get(&of).copied().unwrap_or_default()).clamp(0.0, whole);
            let twice = (bare + pressed - whole).clamp(0.0, bare.min(pressed));
            let force = twice * told.in_force(turn * face.way, params) * normal;
            let arm = turn * (self.layers[k].offset[row] + face.way);
            out.push((k, Wrench { force, torque: arm.cross(force) }));
        }
        Ok(out)
    }

    /// What the free bodies of the `pushes` press on driven solids and obstacles at `poses` as they come nearer or go, besides: what is `pressed` on
    /// their rows, by solid and row [Pa].
    pub fn pressed_on_driven(
        &self,
        poses: &[Pose],
        pushes: &[Push],
        pressed: &HashMap<(usize, usize), f64>,
    ) -> Vec<(usize, Wrench)> {
        let of = |push: &Push| Some(Push { pressure: *pressed.get(&(push.by, push.row))?, ..*push });
        let pushes: Vec<Push> = pushes.iter().filter_map(of).collect();
        let mut out = vec![];
        for (push, on) in pushes.iter().zip(self.laid(poses, None, &pushes)) {
            for Laid { of, share, .. } in on {
                let normal = poses[of.0].orientation * self.face(of).area.normalize_or_zero();
                out.push((of.0, self.on(push, push.pressure * share * push.area_on(normal), &poses[of.0])));
            }
        }
        out
    }

    /// A `force` where a push is [N], on a solid at `pose`.
    fn on(&self, push: &Push, force: DVec3, pose: &Pose) -> Wrench {
        Wrench { force, torque: self.periodic.nearest(push.at - pose.position).cross(force) }
    }

    /// How the `pushes` lie on faces of driven solids and obstacles, one list a push; none where nothing presses on such. Rows with a slot of their own, of `held`,
    /// have from those what slots of such solids press there.
    fn laid(&self, poses: &[Pose], held: Option<&Held>, pushes: &[Push]) -> Vec<Vec<Laid>> {
        // Of each solid that presses those that it presses on: a push over the joint of two of them is on both.
        let mut targets: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for push in pushes {
            if let Opposite::Solid(k, _) = push.on
                && self.layers[k].is_pressed()
            {
                targets.entry(push.by).or_default().insert(k);
            }
        }
        if targets.is_empty() {
            return vec![];
        }
        let own: HashSet<(usize, usize)> = held.map(Held::pressed).unwrap_or_default();
        let of = |push: &Push| {
            let is_on_body = matches!(push.on, Opposite::Solid(k, _) if self.layers[k].free);
            let of = targets.get(&push.by).filter(|_| !is_on_body);
            let mut on = of.map_or(vec![], |of| self.faces_before(push, of, poses));
            if !self.layers[push.by].free {
                on.retain(|laid| !own.contains(&(laid.of.0, laid.of.1)));
            }
            on
        };
        pushes.par_iter().with_min_len(16).map(of).collect()
    }

    fn face(&self, (k, row, number): Of) -> Face {
        self.layers[k].own_faces(row).nth(number).unwrap_or_default()
    }

    /// Faces of the `solids` at `poses` that lie before a `push`. One that none looks back at is all on the row that it is on.
    fn faces_before(&self, push: &Push, solids: &BTreeSet<usize>, poses: &[Pose]) -> Vec<Laid> {
        let l0 = self.spacing;
        let (edge, way) = (self.tiles.edge(push.area.length()), push.area.normalize_or_zero());
        let mut near: Vec<Near> = vec![];
        for &k in solids {
            let (layer, pose) = (&self.layers[k], &poses[k]);
            let (turn, to_frame) = (pose.orientation, pose.orientation.inverse());
            let (origin, reach) = (self.periodic.wrap(pose.position), super::FACING.1 * l0 + edge);
            for image in self.periodic.images(self.periodic.wrap(push.at), reach + layer.radius) {
                let at = to_frame * (image - origin);
                layer.grid.near(at, reach, |n| {
                    let row = n as usize;
                    for (number, face) in self.layers[k].own_faces(row).enumerate() {
                        let normal = turn * face.area.normalize_or_zero();
                        if -normal.dot(way) > AGAINST {
                            let bends = layer.bends.at(row, number);
                            near.push(Near {
                                of: (k, row, number),
                                face,
                                turn,
                                from: turn * (at - layer.offset[row] - face.way),
                                normal,
                                // From the flat one of the two to the other.
                                along: if bends { way } else { normal },
                                bends,
                                half: 0.25 * self.tiles.edge(face.area.length()).powi(2),
                            });
                        }
                    }
                });
            }
        }
        if near.is_empty() {
            return match push.on {
                Opposite::Solid(k, row) if solids.contains(&k) => {
                    let way = poses[k].orientation.inverse() * push.area;
                    let looks = |face: &Face| -face.area.normalize_or_zero().dot(way);
                    let faces = self.layers[k].own_faces(row).enumerate();
                    let most = faces.max_by(|a, b| looks(&a.1).total_cmp(&looks(&b.1)));
                    vec![Laid { of: (k, row, most.map_or(0, |face| face.0)), share: 1.0, way: DVec3::ZERO }]
                }
                _ => vec![],
            };
        }
        let points: Vec<DVec3> = self.tiles.points((DVec3::ZERO, edge), way).collect();
        let mut shares = vec![];
        for &x in &points {
            // Squares of how far from the middle of each a point comes to its plane, less that of half its edge: 0 where two of them meet.
            let far = |of: &Near| {
                let (above, foot) = (of.above(x), of.from + x + of.way(x));
                let square = foot.length_squared();
                // A flat face ends with its edge, at a corner of a square one; before what bends points fan out.
                let most = if self.flat { (1.0 + AS_NEAR).powi(2) } else { 2.0 } * of.half;
                let is_before =
                    above > BEFORE.0 * l0 && above < BEFORE.1 * l0 && (of.bends || square <= most);
                if is_before && !self.is_beyond(of, foot) { square - of.half } else { f64::INFINITY }
            };
            let mut far: Vec<f64> = near.iter().map(far).collect();
            // One that lies deeper than another before which the point is, too, is hidden by that.
            let over = near.iter().zip(&far).filter(|(_, far)| **far <= 0.0).map(|(of, _)| of.above(x));
            let deepest = over.fold(f64::INFINITY, f64::min) + HIDDEN * l0;
            for (_, far) in near.iter().zip(&mut far).filter(|(of, _)| of.above(x) > deepest) {
                *far = f64::INFINITY;
            }
            let least = far.iter().copied().fold(f64::INFINITY, f64::min);
            if least == f64::INFINITY {
                continue;
            }
            let as_near = |far: f64| far <= least + AS_NEAR * l0 * l0;
            let on: Vec<&Near> =
                near.iter().zip(&far).filter(|(_, far)| as_near(**far)).map(|(of, _)| of).collect();
            let share = 1.0 / (on.len() * points.len()) as f64;
            shares.extend(on.into_iter().map(|of| Laid { of: of.of, share, way: of.way(x) }));
        }
        shares
    }

    /// Whether a place in the plane of a face, `foot` from its middle, lies past its edge, where another of its row begins: beside the solid.
    fn is_beyond(&self, near: &Near, foot: DVec3) -> bool {
        let (k, row, _) = near.of;
        let slack = AS_NEAR * self.spacing;
        let at = near.face.way + near.turn.inverse() * foot;
        self.layers[k].own_faces(row).any(|other| {
            let normal = other.area.normalize_or_zero();
            (near.face.way - other.way).dot(normal) < -slack && (at - other.way).dot(normal) > slack
        })
    }
}
