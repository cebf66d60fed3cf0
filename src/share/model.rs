//! What a step of ranks would take on CPUs: a model of latency and bandwidth over counted work (docs/scaling.md).

use super::outlook::{Outlook, Taken};
use serde::Serialize;

/// Time of a particle of water that a rank computes, and of a copy [s].
const OWN: f64 = 1.9e-6;
const COPY: f64 = 0.9e-6;
/// Time of a message; a round takes twice that for each doubling of the ranks [s].
const MESSAGE: f64 = 2e-6;
/// Bytes that a rank hands over in a second.
const BANDWIDTH: f64 = 1e10;
/// Iterations of the pressure solver that are reckoned with.
const ITERATIONS: f64 = 5.0;

/// Time of a step on the slowest rank [s], and of what it is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Model {
    /// Its water.
    pub own_s: f64,
    /// Copies of others'.
    pub copies_s: f64,
    /// Messages, and the rounds of all.
    pub messages_s: f64,
    /// How many times as fast as one rank.
    pub speed_up: f64,
}

impl Model {
    /// Of ranks of which `told` says what they have and say.
    pub(super) fn new(told: &Outlook) -> Self {
        let ranks = told.parts.len() as f64;
        let of = |part: &Taken| [OWN * part.water as f64, COPY * part.copies as f64];
        let slowest = |a: &[f64; 2], b: &[f64; 2]| (a[0] + a[1]).total_cmp(&(b[0] + b[1]));
        let [own_s, copies_s] = told.parts.iter().map(of).max_by(slowest).unwrap_or_default();
        let said = |[step, iteration]: [u64; 2]| step as f64 + ITERATIONS * iteration as f64;
        let handed = 2.0 * (MESSAGE * said(told.messages) + said(told.message_bytes) / BANDWIDTH);
        let rounds = 2.0 * ranks.log2() * MESSAGE * said(told.rounds) + said(told.round_bytes) / BANDWIDTH;
        let messages_s = if ranks > 1.0 { handed + rounds } else { 0.0 };
        let one = OWN * told.parts.iter().map(|part| part.water as f64).sum::<f64>();
        Self { own_s, copies_s, messages_s, speed_up: one / (own_s + copies_s + messages_s) }
    }

    /// Time of a step [s].
    pub fn step_s(&self) -> f64 {
        self.own_s + self.copies_s + self.messages_s
    }
}
