//! What friction held at the end of a sub-step, for the next one to start from.
//!
//! The sweeps of [`super::friction`] come to an end before all digits are settled. From nothing, what is left of a heap's weight at their
//! end is left in every sub-step, and the heap creeps: 30 boxes of 0.1 m by 2.4 um/s on average. From the impulses of the sub-step before
//! there is next to nothing left to do in what stands.

use super::pair::Other;
use crate::checkpoint::Archive;
use crate::error::Result;
use glam::DVec3;
use std::collections::HashMap;

/// A patch: the pair of solids, the bits of the way to the second one's image, and the face or edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Touch {
    pub a: usize,
    pub b: Other,
    pub image: [u64; 3],
    pub patch: u32,
}

/// Numbers of a [`Touch`].
const TOUCH: usize = 7;

impl Touch {
    fn numbers(&self) -> [u64; TOUCH] {
        let (kind, b) = match self.b {
            Other::Solid(b) => (0, b),
            Other::Wall(w) => (1, w),
        };
        let [x, y, z] = self.image;
        [self.a as u64, kind, b as u64, x, y, z, self.patch.into()]
    }

    fn of([a, kind, b, x, y, z, patch]: [u64; TOUCH]) -> Self {
        let b = if kind == 0 { Other::Solid(b as usize) } else { Other::Wall(b as usize) };
        Self { a: a as usize, b, image: [x, y, z], patch: patch as u32 }
    }
}

/// Friction of one patch on its first solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    /// World frame [N].
    pub force: DVec3,
    /// About the patch's normal [N m].
    pub torque: f64,
}

/// Friction of all patches of the last sub-step.
#[derive(Clone, Debug, Default)]
pub(super) struct Held(HashMap<Touch, Hold>);

impl Held {
    /// What `touch` held; `None` if it is new.
    pub fn of(&self, touch: &Touch) -> Option<Hold> {
        self.0.get(touch).copied()
    }

    /// Keeps what the patches of this sub-step hold, and no others.
    pub fn keep(&mut self, all: impl Iterator<Item = (Touch, Hold)>) {
        self.0.clear();
        self.0.extend(all);
    }

    /// The solids have been put elsewhere.
    pub fn forget(&mut self) {
        self.0.clear();
    }

    /// Saves it, or takes it over; states of older versions have none.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        const TOUCHES: &str = "solids.touches";
        const HOLDS: &str = "solids.holds";
        // in an order of its own: a map has another one in every run
        let mut all: Vec<(Touch, Hold)> = self.0.iter().map(|(&touch, &hold)| (touch, hold)).collect();
        all.sort_unstable_by_key(|(touch, _)| *touch);
        let mut touches: Vec<[u64; TOUCH]> = all.iter().map(|(touch, _)| touch.numbers()).collect();
        let mut holds: Vec<[f64; 4]> = all.iter().map(|(_, h)| h.force.extend(h.torque).to_array()).collect();
        if archive.is_saving() || archive.holds(TOUCHES) {
            archive.array(TOUCHES, &mut touches, false)?;
            archive.array(HOLDS, &mut holds, false)?;
        } else {
            (touches, holds) = (vec![], vec![]);
        }
        let hold = |[x, y, z, torque]: [f64; 4]| Hold { force: DVec3::new(x, y, z), torque };
        self.keep(touches.into_iter().map(Touch::of).zip(holds.into_iter().map(hold)));
        Ok(())
    }
}
