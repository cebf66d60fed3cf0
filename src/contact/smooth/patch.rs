//! Points in contact, and what those that one face presses come to.

use crate::body::Wrench;
use glam::{DMat3, DVec3};

/// Cosine between the force of an edge and a face's normal from which the edge counts to that face, and between those of two points
/// from which a face of a mesh or a prism is one to both.
pub(super) const ALONG_NORMAL: f64 = 0.95;

/// First number of the patches of [`part_by_direction`]: no solid has so many edges.
const DIRECTIONS: u32 = 1 << 30;

/// One point in contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Where, world [m].
    pub at: DVec3,
    /// Direction of the force on the pair's first solid: minus the gradient of the depth, of length 1
    /// except near edges.
    pub normal: DVec3,
    pub depth: f64,
    pub weight: f64,
    /// Minus the rate of change of the depth [m/s].
    pub speed: f64,
    /// Deviation of the place of the force that it stands for, along an edge, world [m].
    pub stretch: DVec3,
    pub force: f64,
    /// Part of a face that it stands for over that which its weight says [-].
    pub part: f64,
    /// The patch that it belongs to: the face that presses, 8 more for one of the first solid; or an edge, see
    /// [`edge_key`]; or a direction, see [`part_by_direction`].
    pub patch: u32,
}

/// Number of the patch of an edge that crosses another one: of the `second` solid of the pair, or of the first. A
/// wall's edges may be many, where others cover parts of them.
pub(super) fn edge_key(edge: u32, second: bool) -> u32 {
    32 + 2 * edge + u32::from(second)
}

/// Makes patches of what looks one way, of the points that the first and the second solid press where `faceted` says that it is a mesh or
/// a prism. Those call by the number of a face all that looks more along one axis than along the others: both flanks of a groove, whose
/// normal forces friction goes by one by one.
pub(super) fn part_by_direction(contacts: &mut [Contact], faceted: [bool; 2]) {
    let mut found: Vec<(DVec3, bool)> = vec![];
    for c in contacts {
        let Some(second) = c.face().map(|face| face < 6).filter(|&second| faceted[usize::from(second)])
        else {
            continue;
        };
        let normal = c.normal.normalize_or_zero();
        let same = |&(other, of): &(DVec3, bool)| of == second && other.dot(normal) > ALONG_NORMAL;
        let place = found.iter().position(same).unwrap_or(found.len());
        if place == found.len() {
            found.push((normal, second));
        }
        c.patch = edge_key(DIRECTIONS + place as u32, !second);
    }
}

impl Contact {
    /// A point that is yet to be pressed; `patch` is the face that presses, 8 more for one of the first solid.
    pub fn new(at: DVec3, normal: DVec3, depth: f64, weight: f64, speed: f64, patch: u8) -> Self {
        let patch = patch.into();
        Self { at, normal, depth, weight, speed, stretch: DVec3::ZERO, force: 0.0, part: 1.0, patch }
    }

    /// The face that presses: 0 to 5 of the pair's second solid, 6 to 11 of the first; `None` where two edges
    /// cross.
    pub fn face(&self) -> Option<u8> {
        match self.patch {
            patch @ 0..6 => Some(patch as u8),
            patch @ 8..14 => Some(patch as u8 - 2),
            _ => None,
        }
    }

    /// s_i of a point in a contact of effective depth `depth` [m].
    #[inline]
    pub fn share(&self, depth: f64) -> f64 {
        let x = self.depth * depth.recip();
        self.weight * (x * x) * (x * x) * (x * x)
    }
}

/// What a device sums over the points of a pair and the contacts given to it, world frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeviceSums {
    /// Points and given ones in contact.
    pub count: usize,
    /// Effective depth D of all contacts [m].
    pub depth: f64,
    /// Deepest of all contacts [m].
    pub deepest: f64,
    /// Sum of the s_i of all contacts, over the share of the mass that answers.
    pub shares: f64,
    /// Wrenches on the two solids, of these.
    pub wrench: [Wrench; 2],
    /// Patches of these.
    pub patches: Vec<Patch>,
}

/// All points pressed by one face: where friction acts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Which face or edge, of which of the two solids; as [`Contact::patch`].
    pub key: u32,
    /// Direction of the normal force on the first solid.
    pub normal: DVec3,
    /// Centre of the normal force [m].
    pub at: DVec3,
    /// Normal force [N].
    pub force: f64,
    /// Sum of the points' forces [N].
    pub pressing: f64,
    /// The same, each times the part of the face that the point stands for [N].
    pub weighed: f64,
    /// Second moments of the normal force about its centre [m2], world axes.
    pub spread: DMat3,
}

impl Patch {
    /// A patch from its force [N] on the first solid, the sum of its points' forces [N], the centre and the
    /// second moments about it [m2].
    pub fn new(key: u32, force: DVec3, pressing: f64, at: DVec3, spread: DMat3) -> Self {
        Self {
            key,
            normal: force.normalize_or_zero(),
            at,
            force: force.length(),
            pressing,
            weighed: pressing,
            spread,
        }
    }
}

/// Place of the patch `key`. Contacts of one mostly follow each other: that at `last` is looked at first.
pub(super) fn place(patches: &[Patch], key: u32, last: usize) -> Option<usize> {
    let same = patches.get(last).is_some_and(|p| p.key == key);
    if same { Some(last) } else { patches.iter().position(|p| p.key == key) }
}

/// `share` times the products of the parts of `arm` [m].
pub(super) fn square(arm: DVec3, share: f64) -> DMat3 {
    let weighed = share * arm;
    let (xy, xz, yz) = (weighed.x * arm.y, weighed.x * arm.z, weighed.y * arm.z);
    DMat3::from_cols(
        DVec3::new(weighed.x * arm.x, xy, xz),
        DVec3::new(xy, weighed.y * arm.y, yz),
        DVec3::new(xz, yz, weighed.z * arm.z),
    )
}
