//! What the host adds to a pair whose points a device presses.

use super::super::answer::Mode;
use super::super::patch::{DeviceSums, square};
use super::super::walls::WallBox;
use super::{LEAST, Pair};
use crate::body::Body;
use crate::shape::Surface;
use std::sync::Arc;

impl Pair {
    /// Finds the contacts that a device does not look for, those of edges and of walls' corners. Those pressed
    /// by a face in `open` (bits 0 to 5: of `b`, 6 to 11: of `a`) are to be given to the device; of the
    /// others, their deepest depth d [m], and their sums over it.
    pub fn find_beside_device(
        &mut self,
        bodies: &[Body],
        surfaces: &[Arc<Surface>],
        walls: &[WallBox],
        spacing: f64,
        open: u32,
    ) -> (f64, Mode) {
        self.contacts.clear();
        self.given.clear();
        self.points = 0;
        if self.is_empty() {
            return (0.0, Mode::default());
        }
        // its lists of points are empty
        self.find(bodies, surfaces, walls);
        self.points = self.contacts.len();
        self.find_edges(bodies, surfaces, walls, spacing, LEAST);
        let given = &mut self.given;
        self.contacts.retain(|c| {
            let on_face = c.face().is_some_and(|face| open >> face & 1 == 1);
            if on_face {
                given.push(*c);
            }
            !on_face
        });
        let deepest = self.contacts.iter().fold(0.0_f64, |m, c| m.max(c.depth));
        (deepest, Mode::of(&self.contacts, deepest, bodies[self.a].pose.position))
    }

    /// Joins the contacts kept beside the device with what it sums over its own and those it was given.
    pub fn join(&mut self, sums: &DeviceSums, bodies: &[Body]) {
        self.patches.clear();
        self.wrench = sums.wrench;
        self.before = self.depth;
        (self.energy, self.depth) = (0.0, sums.deepest);
        self.points += sums.count - self.given.len();
        self.count = sums.count + self.contacts.len();
        if sums.count == 0 {
            if !self.contacts.is_empty() {
                self.press(bodies);
                self.sum(bodies);
            }
            return;
        }
        self.push(sums.depth, sums.shares);
        self.sum(bodies);
        self.patches.extend(&sums.patches);
        // the device takes those that it was given for points
        std::mem::swap(&mut self.contacts, &mut self.given);
        self.push(sums.depth, sums.shares);
        for c in &self.contacts {
            if let Some(patch) = self.patches.iter_mut().find(|p| p.key == c.patch) {
                patch.spread += square(c.stretch, c.force / patch.pressing);
            }
        }
        std::mem::swap(&mut self.contacts, &mut self.given);
    }
}
