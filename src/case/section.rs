//! Sections of prisms: whether a line through given corners encloses something.

use crate::shape::signed_area;
use glam::DVec2;

/// Lengths below this share of the section's size are none.
const NOTHING: f64 = 1e-9;

/// What is wrong with a section, and what to do about it.
pub(super) struct Flaw {
    /// The corner at which it is.
    pub corner: Option<usize>,
    pub message: String,
    pub remedy: &'static str,
}

/// What keeps the closed line through the corners of `section` [m] from enclosing something once.
pub(super) fn flaw(section: &[[f64; 2]]) -> Option<Flaw> {
    let at = |corner, message: String, remedy| Some(Flaw { corner, message, remedy });
    let n = section.len();
    if n < 3 {
        let message = format!("a section of {n} corners encloses nothing");
        return at(None, message, "give three corners or more, each as [x, z]");
    }
    let corners: Vec<DVec2> = section.iter().map(|&corner| corner.into()).collect();
    let corner = |k: usize| corners[k % n];
    if let Some(k) = (0..n).find(|&k| !corner(k).is_finite()) {
        return at(Some(k), "a corner that is no place".into(), "give finite numbers");
    }
    let size = (0..n).map(|k| corner(k).distance(corner(0))).fold(0.0, f64::max);
    for k in 0..n {
        let (way, next) = (corner(k + 1) - corner(k), corner(k + 2) - corner(k + 1));
        if way.length() <= NOTHING * size {
            let message = format!("corners {k} and {} are one place", (k + 1) % n);
            return at(
                Some(k),
                message,
                "remove one of them; the last corner leads back to the first by itself",
            );
        }
        if way.angle_to(next).abs() > std::f64::consts::PI - NOTHING {
            let message = format!("the line turns back at corner {}", (k + 1) % n);
            return at(Some((k + 1) % n), message, "correct the order of the corners");
        }
    }
    // Which side of the line through a and b the corner c lies on.
    let side = |[a, b]: [DVec2; 2], c: DVec2| {
        let across = (b - a).normalize().perp_dot(c - a);
        if across.abs() <= NOTHING * size { 0.0 } else { across.signum() }
    };
    for i in 0..n {
        for j in i + 2..n {
            if (j + 1) % n == i {
                continue;
            }
            let (one, other) = ([corner(i), corner(i + 1)], [corner(j), corner(j + 1)]);
            let (low, high) = (one[0].min(one[1]), one[0].max(one[1]));
            let near = other[0].max(other[1]).cmpge(low).all() && other[0].min(other[1]).cmple(high).all();
            let apart = |line: [DVec2; 2], of: [DVec2; 2]| side(line, of[0]) * side(line, of[1]) > 0.0;
            if near && !apart(one, other) && !apart(other, one) {
                let message = format!("the side after corner {i} meets the one after corner {j}");
                return at(
                    Some(j),
                    message,
                    "correct the order of the corners: the line may not meet itself",
                );
            }
        }
    }
    (2.0 * signed_area(&corners).abs() <= NOTHING * size * size).then(|| Flaw {
        corner: None,
        message: "the section encloses no area".into(),
        remedy: "give corners that do not lie on a line",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_encloses_something_once() {
        let message = |section: &[[f64; 2]]| flaw(section).map_or(String::new(), |f| f.message);
        assert_eq!(message(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]]), "");
        // A notch, and the same the other way round.
        let notched = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.2], [0.0, 1.0]];
        assert_eq!(message(&notched), "");
        let mut turned = notched;
        turned.reverse();
        assert_eq!(message(&turned), "");
        assert!(message(&[[0.0, 0.0], [1.0, 0.0]]).contains("2 corners"));
        assert!(message(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]).contains("3 and 0"));
        assert!(message(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).contains("after corner 0 meets"));
        assert!(message(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).contains("turns back"));
        // A corner on another side.
        assert!(message(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).contains("meets"));
        assert!(message(&[[0.0, 0.0], [f64::NAN, 0.0], [2.0, 1.0]]).contains("no place"));
    }
}
