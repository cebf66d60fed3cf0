//! Constants of a pair of solids for one length of sub-step.

/// Constants of a pair for one length of sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Constants {
    /// Stiffness of the whole contact [N/m].
    pub spring: f64,
    /// Stiffness beyond `stop_depth` [N/m]; not below `spring`.
    pub stop: f64,
    /// Depth at which the second spring joins [m].
    pub stop_depth: f64,
    /// Damping of the whole contact [kg/s].
    pub damping: f64,
    /// Length of a sub-step [s].
    pub step: f64,
    /// Coulomb coefficient [-].
    pub friction: f64,
    /// Reduced mass that the damping is for [kg], if the case asks for a restitution; else 0.
    pub mass: f64,
}

impl Constants {
    /// Secant stiffness [N/m] and energy [J] of a contact of effective depth `depth` [m].
    pub fn stored(&self, depth: f64) -> (f64, f64) {
        let beyond = (depth - self.stop_depth).max(0.0);
        let more = self.stop - self.spring;
        let energy = 0.5 * self.spring * depth * depth + 0.5 * more * beyond * beyond;
        (self.spring + more * beyond / depth, energy)
    }

    /// What the dashpot is at the effective depth `depth` [m], over that of the first spring [-].
    ///
    /// With y = sqrt(2 E / K) of the energy E that is stored, m v dv/dy = -K y - C v wherever the dashpot is C dy/dx: the
    /// line of the linear oscillator, so that both springs part with the restitution of the first at any depth. It
    /// grows from 1 to sqrt(stop / spring) without a step and is never beyond.
    pub fn grown(&self, depth: f64) -> f64 {
        let beyond = (depth - self.stop_depth).max(0.0);
        let more = self.stop / self.spring - 1.0;
        (depth + more * beyond) / (depth * depth + more * beyond * beyond).sqrt()
    }

    /// Constants that make sub-steps of `h` [s] follow the damped oscillator of mass `mass` [kg].
    ///
    /// The explicit dashpot takes C h / m of the speed where the exact one takes 1 - exp(-C h / m); it is
    /// set to the latter. With `frequency` the spring too is set to that of the exact oscillator (the
    /// step sees a damped spring up to exp(C h / 2 m) too stiff): right for a restitution, but K is then
    /// no longer the K of a body at rest.
    pub fn discretise(&mut self, mass: f64, h: f64, frequency: bool) {
        self.step = h;
        let a = 0.5 * self.damping * h / mass;
        self.damping = -mass / h * (-2.0 * a).exp_m1();
        if frequency {
            let square = self.spring * h * h / mass;
            let turn = square - a * a;
            let cosine = if turn >= 0.0 { turn.sqrt().cos() } else { (-turn).sqrt().cosh() };
            let ratio = 2.0 * (-a).exp() * (a.cosh() - cosine) / square;
            self.spring *= ratio;
            self.stop *= ratio;
        }
    }
}

/// Share of the dashpot that a point feels which entered `steps` sub-steps ago, at its speed.
///
/// A force acts from the middle of the last sub-step to the middle of this one, so a point that entered
/// s < 1 sub-steps ago is due s + 1/2 of it, spread over two sub-steps: s/h + 3/2 is the sum of both
/// values of this hat, whatever the phase, and the hat is continuous. Without it a restitution scatters
/// by C h / 2 m with the phase of the impact.
pub(super) fn felt(steps: f64) -> f64 {
    if steps < 1.0 { 1.5 * steps } else { (2.0 - 0.5 * steps).max(1.0) }
}
