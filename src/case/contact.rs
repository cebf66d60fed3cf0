//! The law by which solids touch, and its coefficients.

use serde::{Deserialize, Serialize};

/// Contact law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Eqs. (10) to (14) over particle pairs, averaged over the pairs.
    Paper,
    /// True surfaces, constant weights, Coulomb friction with a static branch; conservative.
    Smooth,
    /// The paper's baseline: no contact law, solids are kept apart by the collision model, Eq. (18).
    Pressure,
}

/// Where contact searches and presses its pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ContactDevice {
    /// On the GPU backend by the number of surface points: few on the host, many on the GPU.
    #[default]
    Auto,
    /// On the host, in f64.
    Host,
    /// On the GPU (laws "smooth" and "paper"); needs the GPU backend.
    Gpu,
}

/// Contact between solids.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Contact law.
    #[serde(default = "Contact::default_law")]
    pub law: Law,
    /// Spring coefficient K [N/m], Eq. (10); law "pressure" has none, law "paper" wants it. If absent it stops the heaviest body, fallen as far as it
    /// can or as fast as it starts, within a tenth of a spacing and carries its weight, as far as the sub-steps carry it; `seixo plan` tells it.
    #[cfg_attr(test, schemars(range(min = 1e-9, max = 1e18)))]
    pub spring: Option<f64>,
    /// Damping coefficient C [kg/s], Eq. (11). Give this, `damping_ratio` or `restitution`.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub damping: Option<f64>,
    /// Damping over the critical one of the lightest body, C / (2 sqrt(K m)) [-], Eq. (15).
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub damping_ratio: Option<f64>,
    /// Normal restitution e of a free impact of two solids [-] (law "smooth"): 1 elastic, 0 plastic (as 0.01); what presses a much lighter body
    /// against a third solid comes back with more. 0.5 if none of the three is given with law "smooth"; law "paper" is then undamped.
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub restitution: Option<f64>,
    /// Numerical friction eta of Eq. (12) [kg/s]: over particle pairs (law "paper") or over the true
    /// surfaces, where it adds to `friction` (law "smooth").
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub viscous_friction: f64,
    /// Coulomb coefficient mu [-], static and kinetic (law "smooth").
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub friction: f64,
    /// Let contact forces turn bodies (law "paper"; Eq. (14) says nothing of torque).
    #[serde(default = "Contact::default_torque")]
    pub torque: bool,
    /// Force this many contact sub-steps a step instead of as many as stability asks for.
    #[cfg_attr(test, schemars(range(min = 1, max = 100_000)))]
    pub substeps: Option<u32>,
    /// Pairs of solids with friction or restitution of their own (law "smooth").
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pair: Vec<ContactPair>,
    /// Where pairs are searched and pressed. Sums, friction and motion are the host's, in f64, either way.
    #[serde(default)]
    pub device: ContactDevice,
}

/// Two solids, or two kinds of them, that touch otherwise than all others.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ContactPair {
    /// Names of the two: bodies, moving walls, obstacles, planes, faces of the tank such as `tank.z_min`, or `tank` for all of
    /// these. `*` stands for any letters: `"rock*"`. Of pairs that name the same two solids the last one that gives
    /// a number counts for it.
    pub between: [String; 2],
    /// Coulomb coefficient mu between them [-], static and kinetic; that of an earlier pair or of `[contact]` if absent.
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub friction: Option<f64>,
    /// Normal restitution e between them [-]; that of an earlier pair or of `[contact]` if absent.
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub restitution: Option<f64>,
}

impl Contact {
    fn default_law() -> Law {
        Law::Smooth
    }
    fn default_torque() -> bool {
        true
    }
}
