//! What a run in two dimensions tells of its slice, which is one spacing wide: two of other spacings can be compared for each metre across.

/// Units of what a slice has in proportion to its width.
const OF_SLICE: [&str; 6] = ["J", "N", "N m", "m3", "m3/s", "kg m/s"];

/// What the column `name` is called for each metre across: `energy [J/m]` for `energy [J]`. `None` for what does not depend on the
/// width.
pub fn per_metre(name: &str) -> Option<String> {
    let (what, unit) = name.strip_suffix(']')?.rsplit_once(" [")?;
    OF_SLICE.contains(&unit).then(|| format!("{what} [{unit}/m]"))
}

#[cfg(test)]
mod tests {
    use super::per_metre;

    #[test]
    fn what_grows_with_the_width_is_told_for_each_metre() {
        let told = per_metre("wall_torque_y [N m]");
        assert_eq!(told.as_deref(), Some("wall_torque_y [N m/m]"));
        for other in ["P1 [Pa]", "box x [m]", "energy [J/m]", "energy", "[N]"] {
            assert_eq!(per_metre(other), None, "{other}");
        }
    }
}
