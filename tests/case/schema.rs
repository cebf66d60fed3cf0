//! The schema of case files refuses what the check refuses: each bound is tried on the check, and no number that the check
//! wants positive is without one.

use seixo::case::{Case, file};
use seixo::error::Error;
use serde_json::Value;

/// Solids of every shape, gauges of every kind: each key of a number has a place.
const BASE: &str = r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 1.0

[tank]
min = [0, 0, 0]
max = [2, 2, 1]

[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [1, 1, 0.3]

[[fluid.shape]]
size = [0.2, 0.2, 0.2]
center = [1.5, 0.5, 0.5]

[[fluid.shape]]
shape = "cylinder"
radius = 0.2
height = 0.3
center = [1.5, 1.5, 0.5]

[[fluid.shape]]
shape = "mesh"
file = "pool.stl"

[[fluid.fill]]
seed = [0.5, 0.5, 0.1]
level = 0.3

[[absorber]]
min = [0, 0, 0]
max = [1, 1, 1]
towards = "x_min"

[[inflow]]
name = "in"
face = "x_min"
velocity = 1

[[inflow]]
name = "in by discharge"
face = "y_min"
discharge = 1

[[outflow]]
name = "out"
face = "x_max"
discharge = 1

[[outflow]]
name = "out by velocity"
face = "y_max"
velocity = 1

[[plane]]
name = "plane"
center = [1, 1, 0.9]
normal = [0, 0, 1]
along = [1, 0, 0]
size = [0.5, 0.5]

[[obstacle]]
name = "obstacle box"
size = [0.2, 0.2, 0.2]
center = [1.5, 0.5, 0.5]
array = { count = [1, 1, 1], step = [0.1, 0.1, 0.1] }

[[obstacle]]
name = "obstacle drum"
shape = "cylinder"
radius = 0.2
height = 0.3
center = [1.5, 1.5, 0.5]
scatter = { count = 1, size = [1, 1, 1] }

[[obstacle]]
name = "obstacle hull"
shape = "mesh"
file = "hull.stl"

[[moving_wall]]
name = "moving wall box"
size = [0.2, 0.2, 0.2]
center = [1.5, 0.5, 0.5]
wave = { kind = "jonswap", height = 0.02, period = 1, depth = 0.3 }

[[moving_wall]]
name = "moving wall drum"
shape = "cylinder"
radius = 0.2
height = 0.3
center = [1.5, 1.5, 0.5]
sine = { axis = [1, 0, 0], amplitude = 0.01, period = 1 }
swing = { axis = [1, 0, 0], amplitude_deg = 1, period = 1 }

[[moving_wall]]
name = "moving wall hull"
shape = "mesh"
file = "hull.stl"
motion = [[0, 0, 0, 0]]

[[body]]
name = "box"
size = [0.2, 0.2, 0.2]
center = [1.5, 0.5, 0.5]
density = 500

[[body]]
name = "drum"
shape = "cylinder"
radius = 0.2
height = 0.3
center = [1.5, 1.5, 0.5]
mass = 2.0
inertia = [0.04, 0.04, 0.04]
scatter = { count = 1, size = [2, 2, 2] }

[[body]]
name = "hull"
shape = "mesh"
file = "hull.stl"
center = [1.5, 1.5, 0.5]
density = 500
array = { count = [1, 1, 1], step = [0.1, 0.1, 0.1] }
sine = { axis = [1, 0, 0], amplitude = 0.01, period = 1 }
swing = { axis = [1, 0, 0], amplitude_deg = 1, period = 1 }

[contact]
spring = 1e6

[[contact.pair]]
between = ["box", "tank"]

[[gauge.force]]
name = "force"
on = "box"

[[output.series]]
name = "near"
every = 0.1
"#;

/// Bounds of a number, and the keys it is under: a path with `*` for the number of a table or an element.
struct Bounded {
    path: String,
    least: Option<(f64, bool)>,
    most: Option<(f64, bool)>,
}

fn number(schema: &Value) -> bool {
    let is = |t: &Value| t == "number" || t == "integer";
    is(&schema["type"]) || schema["type"].as_array().is_some_and(|t| t.iter().any(is))
}

/// Every number of the schema.
fn numbers(root: &Value, schema: &Value, path: &str, found: &mut Vec<Bounded>) {
    let options = schema["anyOf"].as_array();
    let schema = options.and_then(|o| o.iter().find(|v| v["type"] != "null")).unwrap_or(schema);
    let reference = schema["$ref"].as_str().and_then(|r| root.pointer(r.strip_prefix('#')?));
    let schema = reference.unwrap_or(schema);
    for (name, value) in schema["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        numbers(root, value, &path, found);
    }
    if schema["items"].is_object() {
        numbers(root, &schema["items"], &format!("{path}.*"), found);
    }
    if number(schema) {
        let side = |closed: &str, open: &str| {
            let open = schema[open].as_f64().map(|x| (x, true));
            open.or(schema[closed].as_f64().map(|x| (x, false)))
        };
        found.push(Bounded {
            path: path.to_owned(),
            least: side("minimum", "exclusiveMinimum"),
            most: side("maximum", "exclusiveMaximum"),
        });
    }
}

/// Whether the check, or the reader, has something against `value` at `path` itself.
fn refused(path: &str, value: f64) -> bool {
    let value =
        if value.fract() == 0.0 && value.abs() < 1e9 { format!("{value:.0}") } else { format!("{value:e}") };
    match file::parse("base.toml", BASE.into(), &[format!("{path}={value}")]) {
        Ok(_) => false,
        Err(Error::Case(found)) => {
            found.problems.iter().any(|p| path == p.key || path.starts_with(&format!("{}.", p.key)))
        }
        Err(other) => panic!("{path} = {value}: {other}"),
    }
}

/// The first place of `path` in the base case at which one of `inside` is taken.
fn place(path: &str, inside: &[f64]) -> Option<String> {
    let places = match path.matches('*').count() {
        0 => vec![path.to_owned()],
        _ => (0..9)
            .map(|k| path.replacen('*', &(k / 3).to_string(), 1).replace('*', &(k % 3).to_string()))
            .collect(),
    };
    places.into_iter().find(|p| inside.iter().any(|&x| !refused(p, x)))
}

fn all() -> Vec<Bounded> {
    let schema: Value = serde_json::from_str(Case::schema()).unwrap();
    let mut found = Vec::new();
    numbers(&schema, &schema, "", &mut found);
    assert!(found.len() > 60, "{}", found.len());
    found
}

/// Values that most keys take.
const USUAL: [f64; 7] = [1e-3, 0.02, 0.3, 1.0, 2.0, 3.0, 1e6];

#[test]
fn bounds_of_the_schema_are_those_of_the_check() {
    let mut tried = 0;
    for key in all().into_iter().filter(|key| key.least.is_some() || key.most.is_some()) {
        let inside = |x: &f64| key.least.is_none_or(|(b, _)| *x > b) && key.most.is_none_or(|(b, _)| *x < b);
        let inside: Vec<f64> = USUAL.iter().copied().filter(inside).collect();
        let Some(path) = place(&key.path, &inside) else { panic!("{} is taken nowhere", key.path) };
        let beyond = [(key.least, -1.0), (key.most, 1.0)];
        for ((bound, open), side) in beyond.into_iter().filter_map(|(b, side)| Some((b?, side))) {
            let past = if open { bound } else { bound + side * f64::max(1.0, bound.abs()) };
            assert!(refused(&path, past), "{path}: the schema refuses {past}, the check takes it");
            tried += 1;
        }
    }
    assert!(tried > 40, "{tried}");
}

#[test]
fn numbers_that_the_check_wants_positive_have_a_bound_in_the_schema() {
    // Of lists, each has its own words: a place may be anywhere, a size not.
    let free = |key: &&Bounded| key.least.is_none() && !key.path.ends_with('*');
    for key in all().iter().filter(free) {
        if let Some(path) = place(&key.path, &USUAL) {
            assert!(
                !refused(&path, -0.013),
                "{path} = -0.013 is refused, but the schema takes it: give it a bound"
            );
        }
    }
}
