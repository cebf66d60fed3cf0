//! Fixed walls as what bodies press on: the force of contact on each.

use crate::body::Wrench;
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::periodic::Periodic;
use crate::scene::Scene;
use glam::DVec3;

/// What the solids that move have pressed on each of [`Scene::walls`].
pub(crate) struct FixedWalls {
    names: Vec<String>,
    /// Where torques count about [m].
    middle: Vec<DVec3>,
    periodic: Periodic,
    /// Impulse and its moment in this step [N s, N m s].
    touched: Vec<Wrench>,
    /// Mean over the last step.
    mean: Vec<Wrench>,
}

impl FixedWalls {
    /// Those of `scene`, untouched.
    pub fn new(scene: &Scene) -> Self {
        let none = vec![Wrench::default(); scene.walls.len()];
        let middle = scene.walls.iter().map(|wall| wall.middle).collect();
        let names = scene.walls.iter().map(|wall| wall.name.clone()).collect();
        Self { names, middle, periodic: scene.periodic, touched: none.clone(), mean: none }
    }

    /// Name of wall `k`, as in the case.
    pub fn name(&self, k: usize) -> &str {
        &self.names[k]
    }

    /// Wall `k` has got the `impulse` [N s] at the place `at` [m] and the moment `twist` [N m s] beside.
    pub fn touch(&mut self, k: usize, impulse: DVec3, at: DVec3, twist: DVec3) {
        let arm = self.periodic.nearest(at - self.middle[k]);
        self.touched[k] += Wrench { force: impulse, torque: arm.cross(impulse) + twist };
    }

    /// A step begins.
    pub fn begin(&mut self) {
        self.touched.fill(Wrench::default());
    }

    /// It has ended after `dt` [s].
    pub fn end(&mut self, dt: f64) {
        self.mean.iter_mut().zip(&self.touched).for_each(|(mean, &touched)| *mean = touched / dt);
    }

    /// Save the means of the last step, or take them over.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let mut numbers: Vec<[DVec3; 2]> = self.mean.iter().map(|w| [w.force, w.torque]).collect();
        archive.array("solids.fixed", &mut numbers, true)?;
        self.mean = numbers.into_iter().map(|[force, torque]| Wrench { force, torque }).collect();
        Ok(())
    }

    /// Mean force and torque of the last step, one a wall [N, N m].
    pub fn mean(&self) -> &[Wrench] {
        &self.mean
    }
}
