//! Rings of particles that fill a circle.

use std::f64::consts::PI;

/// Particles at one distance from the middle of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ring {
    /// That distance [m]: 0 for one particle in the middle.
    pub radius: f64,
    /// Area of the ring [m2].
    pub area: f64,
    /// Number of particles.
    pub count: usize,
}

/// Rings that fill a circle of `radius` [m], from the rim inwards, and their width [m]. The width is that of `spacing` [m] nearest to which
/// whole rings fill the circle, or all but one particle in the middle of half a ring's radius: whole ones alone would be a quarter too narrow
/// where the radius is 1.5 spacings, and water off the lattice would settle where they leave it room. A ring has a particle for each square of
/// the spacing, and three at least.
pub(super) fn rings(radius: f64, spacing: f64) -> (f64, Vec<Ring>) {
    let halves = (2.0 * radius / spacing + 0.5 + 1e-6).floor().max(2.0) as i32;
    let width = 2.0 * radius / f64::from(halves);
    let ring = |i: i32| {
        if 2 * i + 1 == halves {
            return Ring { radius: 0.0, area: PI * (0.5 * width).powi(2), count: 1 };
        }
        let middle = radius - (f64::from(i) + 0.5) * width;
        let area = PI * ((middle + 0.5 * width).powi(2) - (middle - 0.5 * width).powi(2));
        Ring { radius: middle, area, count: (area / (spacing * spacing)).round().max(3.0) as usize }
    };
    (width, (0..(halves + 1) / 2).map(ring).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use std::f64::consts::TAU;

    /// Places of the particles in a circle of `radius`, over the spacing.
    fn places(radius: f64) -> Vec<DVec2> {
        let of = |(i, ring): (usize, Ring)| {
            let turn = move |k: usize| TAU * (k as f64 + 0.5 * (i % 2) as f64) / ring.count as f64;
            (0..ring.count).map(move |k| ring.radius * DVec2::from_angle(turn(k)))
        };
        rings(radius, 1.0).1.into_iter().enumerate().flat_map(of).collect()
    }

    #[test]
    fn a_circle_of_any_radius_is_filled_evenly() {
        for tenths in 10..=60 {
            let radius = 0.1 * f64::from(tenths);
            let (width, rings) = rings(radius, 1.0);
            let places = places(radius);
            let density = places.len() as f64 / (PI * radius * radius);
            let crowd = |x: &DVec2| places.iter().map(|y| (1.0 - x.distance(*y)).max(0.0)).sum::<f64>() - 1.0;
            let most = places.iter().map(crowd).fold(0.0, f64::max);
            let total: f64 = rings.iter().map(|r| r.area).sum();
            println!("{radius:.1}: width {width:.3}, density {density:.3}, crowding {most:.2}");
            assert!((total / (PI * radius * radius) - 1.0).abs() < 1e-12);
            // Few particles cannot always be as many as there should be.
            let (off, crowded) = if radius < 1.95 { (0.14, 0.7) } else { (0.07, 0.5) };
            assert!((density - 1.0).abs() < off && most < crowded, "{radius}: {density}, {most}");
            assert!((width - 1.0).abs() < 0.26 / radius, "{radius}: {width}");
            for ring in rings.iter().filter(|r| r.radius > 0.0) {
                let each = ring.area / ring.count as f64;
                assert!((0.84..1.16).contains(&each), "{radius}: {each} of {ring:?}");
            }
        }
    }
}
