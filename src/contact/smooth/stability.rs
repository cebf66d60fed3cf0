//! How stiff the smooth law's contacts are, and what of a case's numbers the sub-steps carry.

use super::constants::Constants;
use super::{EXPONENT, STOP_DEPTH, Smooth};
use crate::body::Body;
use crate::contact::between::Between;
use crate::contact::candidates::reduced_mass;
use crate::contact::stiffness::{Damping, Lambda};
use crate::contact::substeps::{DAMPING_STEP, Limits, MOST_SUBSTEPS, STOP_OMEGA_STEP, TAKEN_STEP, Worst};
use crate::shape::Surface;
use glam::DVec3;

/// Eigenvalues of the smooth law. Zero for prescribed solids.
pub(super) fn lambda(body: &Body, surface: &Surface) -> Lambda {
    if !body.is_free() {
        return Lambda::default();
    }
    let share = |sum: f64| sum.powf(2.0 / EXPONENT);
    let mass = body.inverse_mass.max_element();
    let turns = body.locked_rotation != [true; 3];
    let mut lambda = Lambda { spring: mass, damping: mass };
    let mut take = |spring: f64, damping: f64| {
        lambda.spring = lambda.spring.max(spring);
        lambda.damping = lambda.damping.max(damping);
    };
    if !turns {
        return lambda;
    }
    // Arms are those from what the body turns about.
    let from = body.shape_offset;
    let samples: Vec<_> = surface.samples().into_iter().map(|(p, w, faces)| (from + p, w, faces)).collect();
    if surface.is_round() {
        let give = mass + turning(from, body.principal);
        take(give, give);
    }
    for (p, w, _) in &samples {
        let give = mass + turning(*p, body.principal);
        take(share(*w) * give, share(*w).sqrt() * give);
    }
    // of a ring little more than a point may touch
    for ring in &surface.rings {
        let farthest = ring.point(from.y.atan2(from.x)).0;
        let give = mass + turning(from + farthest, body.principal);
        take(share(ring.weight) * give, share(ring.weight).sqrt() * give);
    }
    for face in 0..6_u8 {
        let on = |other: u8| {
            let both = 1 << face | 1 << other;
            samples.iter().filter(move |s| s.2 & both == both).map(|s| (s.0, s.1))
        };
        for other in 0..6_u8 {
            // `face` alone when both are the same, else the edge between them
            let sum: f64 = on(other).map(|(_, w)| w).sum();
            if sum == 0.0 {
                continue;
            }
            let center = on(other).map(|(p, w)| p * w).sum::<DVec3>() / sum;
            let arm = if other == face { 0.0 } else { turning(center, body.principal) };
            let spread =
                |axis: usize| on(other).map(|(p, w)| w * (p[axis] - center[axis]).powi(2)).sum::<f64>();
            let (u, v) = ((usize::from(face / 2) + 1) % 3, (usize::from(face / 2) + 2) % 3);
            let rocking = (spread(u) / body.principal[v]).max(spread(v) / body.principal[u]) / sum;
            let bounce = mass + arm;
            take(share(sum) * bounce, share(sum).sqrt() * bounce);
            take(share(sum) * (EXPONENT - 1.0) * rocking, share(sum).sqrt() * rocking);
        }
    }
    lambda
}

/// What a unit force at `p` [m] moves that point by through turning the body, in the worst direction [1/kg]: the
/// largest eigenvalue of (p x)^T I^-1 (p x). One is zero, since a force along p turns nothing; the other two have
/// the sum and the product below.
fn turning(p: DVec3, principal: DVec3) -> f64 {
    let (i, square) = (principal.recip(), p * p);
    let sum = i.dot(DVec3::splat(square.element_sum()) - square);
    let product = square.element_sum() * square.dot(DVec3::new(i.y * i.z, i.z * i.x, i.x * i.y));
    0.5 * (sum + (sum * sum - 4.0 * product).max(0.0).sqrt())
}

/// What the worst contact asks of the step `dt` [s], softened as it will be.
pub(super) fn worst(law: &Smooth, limits: &Limits, bodies: &[Body], dt: f64) -> Worst {
    let mut worst = Worst { softest: limits.spring, ..Worst::default() };
    for (a, b) in limits.extremes(bodies) {
        let (spring, damped) = limits.lambda_of(a, b);
        let reach = law.spacing.min(law.middles.between(a, b));
        let weight = law.lightest_touch(a, b, bodies);
        for damping in limits.between.dampings() {
            limits.ask(&mut worst, bodies, (a, b), damping, dt, 0.0);
            let between = Between { damping, ..limits.between.usual };
            let c = limits.constants(bodies, a, b, between, weight, reach);
            let stopping = c.damping * (c.stop / c.spring).sqrt();
            let most_damping = most_damping(damping, reduced_mass(bodies, a, b), damped);
            let for_spring = dt * (c.spring * spring).sqrt() / limits.omega_step();
            let for_stop = dt * (c.stop * spring).sqrt() / limits.omega_step().max(STOP_OMEGA_STEP);
            worst.wanted = worst.wanted.max(for_spring).max(dt * c.damping / most_damping);
            worst.hardest = worst.hardest.max(for_stop).max(dt * stopping / most_damping);
            worst.softest = worst.softest.min(c.spring);
        }
    }
    worst
}

/// Largest C dt [kg] of a sub-step on a pair of the reduced mass `mass` [kg] and the eigenvalue `damped` [1/kg]. That of a
/// restitution takes 1 - exp(-C dt / m) of the speed (`Constants::discretise`).
fn most_damping(damping: Damping, mass: f64, damped: f64) -> f64 {
    let most = DAMPING_STEP / damped;
    match damping {
        Damping::Ratio(_) => most.max(-mass * (-TAKEN_STEP).ln_1p()),
        Damping::Coefficient(_) => most,
    }
}

impl Limits {
    /// Constants of the contact of `a` with `b`, with the friction and damping that are `between` them, as the smooth law uses them: what the case asks for, as
    /// far as the sub-steps of the longest step so far can carry it. Within `reach` [m] the second spring stops
    /// the fastest body.
    pub fn constants(
        &self,
        bodies: &[Body],
        a: usize,
        b: Option<usize>,
        between: Between,
        weight: f64,
        reach: f64,
    ) -> Constants {
        let mass = reduced_mass(bodies, a, b);
        let both = |of: fn(&Lambda) -> f64| of(&self.lambda[a]) + b.map_or(0.0, |b| of(&self.lambda[b]));
        let shortest = self.longest_step / f64::from(self.forced.unwrap_or(MOST_SUBSTEPS));
        let carried = |omega_step: f64| (omega_step / shortest).powi(2) / both(|l| l.spring);
        let carried_damping = most_damping(between.damping, mass, both(|l| l.damping)) / shortest;
        // a dashpot that does not fit would be a weaker one, and the restitution another
        let fits = match between.damping {
            Damping::Ratio(ratio) => (0.5 * carried_damping / ratio).powi(2) / mass,
            Damping::Coefficient(_) => f64::INFINITY,
        };
        let spring = if self.forced.is_some() {
            self.spring
        } else {
            self.spring.min(carried(self.omega_step())).min(fits)
        };
        let closing = if b.is_some() { 2.0 } else { 1.0 } * self.fastest;
        let corner = weight.powf(2.0 / EXPONENT);
        let stop = mass * (2.0 * closing / reach).powi(2) / corner;
        let damping = between.damping.coefficient(spring, self.spring, mass);
        let damping = if self.forced.is_some() { damping } else { damping.min(carried_damping) };
        // the stop's dashpot is as much stronger as the root of its spring
        let stop_fits = spring * (carried_damping / damping).powi(2);
        Constants {
            spring,
            stop: stop.min(carried(self.stop_carried_at())).min(stop_fits).max(spring),
            stop_depth: STOP_DEPTH * reach,
            step: shortest,
            damping,
            friction: between.friction,
            mass: if between.damping.is_ratio() { mass } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_turn_is_that_of_the_worst_direction() {
        for (p, principal) in [
            (DVec3::new(0.5, 0.01, 0.01), DVec3::new(1e-4, 0.1, 0.1)),
            (DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.3, 0.2, 0.4)),
            (DVec3::new(0.0, 0.0, 0.2), DVec3::splat(0.3)),
        ] {
            let mut worst = 0.0_f64;
            for k in 0..200_000_u32 {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 2e5;
                let (sin, cos) = (2.399_963_2 * f64::from(k)).sin_cos();
                let n = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let turn = p.cross(n);
                worst = worst.max(turn.dot(turn / principal));
            }
            let sharp = turning(p, principal);
            assert!(worst <= sharp * (1.0 + 1e-12) && worst > 0.999 * sharp, "{p}: {worst} {sharp}");
        }
    }
}
