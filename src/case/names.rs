//! Names that stand for several solids.

/// Whether `name` may stand for several: it has a `*`, or is that of the whole tank.
pub(crate) fn is_pattern(name: &str) -> bool {
    name.contains('*') || name == "tank"
}

/// Whether `name` stands for `known`: the same, with `*` for any letters, or `tank` for each of its faces.
pub(crate) fn stands_for(name: &str, known: &str) -> bool {
    fits(name, known) || name == "tank" && known.starts_with("tank.")
}

fn fits(pattern: &str, known: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return pattern == known };
    let Some(left) = known.strip_prefix(start) else { return false };
    let mut places = left.char_indices().map(|(at, _)| at).chain([left.len()]);
    places.any(|at| fits(rest, &left[at..]))
}

#[cfg(test)]
mod tests {
    use super::stands_for;

    #[test]
    fn a_star_stands_for_any_letters_and_tank_for_its_faces() {
        for (name, known, yes) in [
            ("pile_*", "pile_12", true),
            ("pile_*", "pile", false),
            ("*e_1", "pile_1", true),
            ("*_*_*", "pile_1", false),
            ("rock 1", "rock 1", true),
            ("rock 1", "rock 12", false),
            ("rock*", "rock 12", true),
            ("rock*", "a rock", false),
            ("*.z_min", "tank.z_min", true),
            ("*", "x", true),
            ("*", "", true),
            ("a*b*c", "aXbYbZc", true),
            ("a*b*c", "aXbYbZ", false),
            ("*ä*", "Trägheit", true),
            ("tank", "tank.z_min", true),
            ("tank.z*", "tank.z_min", true),
            ("tank", "tanker", false),
            ("pile", "pile_1", false),
        ] {
            assert_eq!(stands_for(name, known), yes, "{name} {known}");
        }
    }
}
