//! Contact.
use crate::body::{Pose, Wrench};
use crate::error::Result;
use crate::scene::{Drive, Scene};
use glam::DVec3;

/// What the contact did in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactReport {
    /// Sub-steps.
    pub substeps: u32,
    /// omega dt of a sub-step [-].
    pub omega_dt: f64,
    /// Deepest penetration over l0 [-].
    pub penetration_max_over_l0: f64,
}

/// The moving solids.
pub struct Solids {
    poses: Vec<Pose>,
    guess: Vec<Pose>,
    scene: Scene,
}
impl Solids {
    /// From a scene.
    pub fn new(scene: &Scene, _: Option<&crate::case::Contact>) -> Result<Self> {
        let poses: Vec<Pose> = scene
            .solids
            .iter()
            .map(|s| Pose {
                position: s.position,
                orientation: s.orientation,
                velocity: match &s.drive {
                    Drive::Free(b) => b.velocity,
                    _ => DVec3::ZERO,
                },
                angular_velocity: DVec3::ZERO,
            })
            .collect();
        Ok(Self { guess: poses.clone(), poses, scene: scene.clone() })
    }
    /// Poses.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }
    /// Name.
    pub fn name(&self, k: usize) -> &str {
        &self.scene.solids[k].name
    }
    /// Predict.
    pub fn predict(&mut self, t: f64, dt: f64) -> &[Pose] {
        self.guess = self.poses.clone();
        self.go(t, dt, None);
        std::mem::swap(&mut self.guess, &mut self.poses);
        &self.guess
    }
    fn go(&mut self, t: f64, dt: f64, f: Option<&[Wrench]>) {
        for (k, s) in self.scene.solids.iter().enumerate() {
            let p = &mut self.poses[k];
            match &s.drive {
                Drive::Prescribed(m) => {
                    let (a, b) = (m.displacement(t), m.displacement(t + dt));
                    p.position = s.position + b;
                    p.velocity = (b - a) / dt;
                }
                Drive::Free(b) => {
                    let a = self.scene.gravity + f.map_or(DVec3::ZERO, |f| f[k].force / b.mass);
                    p.velocity += dt * a;
                    p.position += dt * p.velocity;
                }
            }
        }
    }
    /// Advance.
    pub fn advance(&mut self, t: f64, dt: f64, f: &[Wrench]) -> Result<ContactReport> {
        self.go(t, dt, Some(f));
        Ok(ContactReport::default())
    }
}
