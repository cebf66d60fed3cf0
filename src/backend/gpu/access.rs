//! The functions by which the shaders reach the elements of buffers that may be divided; see [`super::shader::divided`].

use super::buffers::{Row, TABLE};
use super::parts::{Division, Parts, Split};
use crate::compute::Spec;

/// Those for the buffers that `text` declares.
pub(super) fn functions(text: &str, division: &Division) -> String {
    let mut next = FIRST_PART;
    text.lines().filter_map(|line| Some(Access::new(line, division)?.text(&mut next))).collect()
}

/// First number of the bindings of further parts; the files number their own below.
const FIRST_PART: u32 = 32;
/// Between the name of a buffer and the number of a further part.
pub(super) const PART: &str = "_part";

/// Access to a buffer that may be divided, as a file declares it.
struct Access<'a> {
    row: &'static Row,
    writes: bool,
    /// In the array's brackets.
    held: &'a str,
    parts: Option<&'a Parts>,
}

impl<'a> Access<'a> {
    /// That of a line, if it declares such a buffer.
    fn new(line: &'a str, division: &'a Division) -> Option<Self> {
        let (access, rest) =
            line.strip_prefix("@group(0) ")?.split_once("var<storage, ")?.1.split_once("> ")?;
        let (name, rest) = rest.split_once(": array<")?;
        let row = TABLE.iter().find(|r| r.spec.id.name() == name && !matches!(r.split, Split::Whole))?;
        let held = rest.split_once(">;")?.0;
        Some(Self { row, writes: access == "read_write", held, parts: division.of(name) })
    }

    /// Declarations of the further parts, numbered from `next` on, and the functions.
    fn text(&self, next: &mut u32) -> String {
        let Spec { id, element, .. } = self.row.spec;
        let name = id.name();
        let atomic = self.held.starts_with("atomic");
        let access = if self.writes { "read_write" } else { "read" };
        let mut out = String::new();
        for part in 1..self.parts.map_or(1, |p| p.count) {
            let held = self.held;
            out += &format!(
                "@group(0) @binding({next}) var<storage, {access}> {name}{PART}{part}: array<{held}>;\n"
            );
            *next += 1;
        }
        let at = self.arguments();
        let read =
            |b: &str| if atomic { format!("return atomicLoad(&{b});") } else { format!("return {b};") };
        out += &format!("fn {name}_at({at}) -> {element} {{\n{}}}\n", self.body(read));
        if self.writes {
            let set =
                |b: &str| if atomic { format!("atomicStore(&{b}, value);") } else { format!("{b} = value;") };
            out += &format!("fn set_{name}({at}, value: {element}) {{\n{}}}\n", self.body(set));
        }
        if atomic {
            let add = |b: &str| format!("return atomicAdd(&{b}, value);");
            out += &format!("fn add_{name}({at}, value: {element}) -> {element} {{\n{}}}\n", self.body(add));
        }
        out
    }

    fn arguments(&self) -> &'static str {
        if matches!(self.row.split, Split::Planes { .. }) { "plane: u32, place: u32" } else { "place: u32" }
    }

    /// What is `done` to an element of the buffer: of the one that there is, or of the part that the element lies in.
    fn body(&self, done: impl Fn(&str) -> String) -> String {
        let name = self.row.spec.id.name();
        let pitch = if let Split::Planes { pitch, .. } = self.row.split { Some(pitch) } else { None };
        let Some(parts) = self.parts else {
            let at = pitch.map_or("place".into(), |pitch| format!("plane * {pitch} + place"));
            return format!("    {}\n", done(&format!("{name}[{at}]")));
        };
        let each = parts.each;
        let (at, part) = match pitch {
            Some(pitch) => (format!("plane % {each}u * {pitch} + place"), format!("plane / {each}u")),
            // A power of two.
            None => (format!("place & {}u", each - 1), format!("place >> {}u", each.ilog2())),
        };
        let mut out = format!("    let at = {at};\n    switch {part} {{\n");
        for part in 0..parts.count {
            let case = if part + 1 < parts.count { format!("case {part}u:") } else { "default:".into() };
            let buffer = if part == 0 { name.to_owned() } else { format!("{name}{PART}{part}") };
            out += &format!("        {case} {{ {} }}\n", done(&format!("{buffer}[at]")));
        }
        out + "    }\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::gpu::shader::{COMMON, divided, entries};

    const TEXT: &str = "@group(0) @binding(2) var<storage, read_write> cell_count: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(4) var<storage, read> position: array<vec4f>;
";

    /// What stands behind the text and what is common.
    fn added(division: &Division) -> String {
        let whole = divided(TEXT, &[], division);
        let lines: Vec<&str> =
            whole.lines().skip(TEXT.lines().count() + COMMON.lines().count()).map(str::trim).collect();
        lines.join(" ")
    }

    #[test]
    fn elements_of_a_buffer_in_one_part_are_reached_by_the_plain_index() {
        let expected = "fn cell_count_at(place: u32) -> u32 { return atomicLoad(&cell_count[place]); } \
                        fn set_cell_count(place: u32, value: u32) { atomicStore(&cell_count[place], value); } \
                        fn add_cell_count(place: u32, value: u32) -> u32 { return atomicAdd(&cell_count[place], value); } \
                        fn neighbour_list_at(plane: u32, place: u32) -> u32 { \
                        return neighbour_list[plane * params.pressure_slots + place]; }";
        assert_eq!(added(&Division::default()), expected);
    }

    #[test]
    fn elements_of_a_divided_buffer_are_sought_in_their_part() {
        let of = |buffer, count, each| Parts { buffer, count, each };
        let division =
            Division { parts: vec![of("cell_count", 2, 8), of("neighbour_list", 3, 6)], fold: Some(128) };
        let text = added(&division);
        for part in [
            "const DISPATCH_WIDTH: u32 = 128u; @group(0) @binding(32) var<storage, read_write> cell_count_part1: \
             array<atomic<u32>>;",
            "fn cell_count_at(place: u32) -> u32 { let at = place & 7u; switch place >> 3u { case 0u: { return \
             atomicLoad(&cell_count[at]); } default: { return atomicLoad(&cell_count_part1[at]); } } }",
            "@group(0) @binding(33) var<storage, read> neighbour_list_part1: array<u32>; @group(0) @binding(34)",
            "let at = plane % 6u * params.pressure_slots + place; switch plane / 6u { case 0u: { return \
             neighbour_list[at]; } case 1u: { return neighbour_list_part1[at]; } default: { return \
             neighbour_list_part2[at]; } }",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        let [entry] =
            &entries("text", &divided(&format!("{TEXT}{KERNEL}"), &[], &division)).expect("valid")[..]
        else {
            panic!("one entry point")
        };
        let mut bound: Vec<_> = entry.bindings.iter().map(|b| (b.number, b.name.as_str(), b.part)).collect();
        bound.sort_unstable();
        let list = |number, part| (number, "neighbour_list", part);
        let count = |number, part| (number, "cell_count", part);
        assert_eq!(
            bound,
            [(0, "params", 0), count(2, 0), list(3, 0), count(32, 1), list(33, 1), list(34, 2)]
        );
    }

    const KERNEL: &str = "@compute @workgroup_size(WORKGROUP)
fn kernel(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    set_cell_count(k, neighbour_list_at(0u, k));
}
";
}
