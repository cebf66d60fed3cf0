//! Several like solids from one table: `copies`, `array`, `scatter`.

use crate::cli::{json, ran};
use seixo::case::{Case, file};
use seixo::error::Error;
use seixo::scene::Scene;

/// A tank with `more` in it.
fn text(more: &str) -> String {
    format!(
        "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.02\n\
         [tank]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\nopen = [\"z_max\"]\n[contact]\nspring = 1e5\n{more}"
    )
}

fn case(more: &str) -> Case {
    text(more).parse().unwrap_or_else(|e: Error| panic!("{e}"))
}

/// What is told of a wrong case.
fn told(more: &str) -> String {
    match file::load_text("test.toml".as_ref(), text(more), None, &[]) {
        Err(error) => error.to_string(),
        Ok(loaded) => Scene::build(&loaded.case).map_err(|e| loaded.placed(e)).expect_err(more).to_string(),
    }
}

const CUBE: &str =
    "[[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.2, 0.5, 0.05]\ndensity = 500\n";

#[test]
fn a_table_stands_for_solids_at_places_and_in_rows() {
    let case = case(&format!(
        "{CUBE}array = {{ count = [2, 1, 2], step = [0.3, 0, 0.1001] }}\n\
         [[obstacle]]\nname = \"pile\"\nmin = [1, 0.2, 0]\nmax = [1.1, 0.3, 0.5]\n\
         copies = [[1, 0.6, 0], [1.3, 0.6, 0]]\n\
         [[obstacle]]\nname = \"post\"\nshape = \"prism\"\nsection = [[0, 0], [0.1, 0], [0, 0.1]]\nheight = 0.2\n\
         array = {{ count = [1, 2, 1], step = [0, 0.4, 0] }}\nposition = [1.6, 0.1, 0]\n\
         [[contact.pair]]\nbetween = [\"cube_*\", \"pile_*\"]\nfriction = 0.1\n\
         [[gauge.force]]\nname = \"on pile\"\non = \"pile_2\"\n"
    ));
    let cubes: Vec<(&str, [f64; 3])> = case.body.iter().map(|b| (b.name.as_str(), b.center)).collect();
    let high = 0.05 + 0.1001;
    assert_eq!(
        cubes,
        [
            ("cube_1", [0.2, 0.5, 0.05]),
            ("cube_2", [0.5, 0.5, 0.05]),
            ("cube_3", [0.2, 0.5, high]),
            ("cube_4", [0.5, 0.5, high])
        ]
    );
    let piles: Vec<_> = case.obstacle.iter().map(|o| (o.name.as_str(), o.max, o.position)).collect();
    let near =
        |a: Option<[f64; 3]>, b: [f64; 3]| a.is_some_and(|a| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-12));
    assert_eq!(
        piles.iter().map(|p| p.0).collect::<Vec<_>>(),
        ["pile_1", "pile_2", "pile_3", "post_1", "post_2"]
    );
    assert!(near(piles[1].1, [1.1, 0.7, 0.5]) && near(piles[2].1, [1.4, 0.7, 0.5]), "{piles:?}");
    assert!(near(piles[3].2, [1.6, 0.1, 0.0]) && near(piles[4].2, [1.6, 0.5, 0.0]), "{piles:?}");
    let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.solids.iter().filter(|s| s.is_body).count(), 4);
}

#[test]
fn what_is_scattered_is_in_its_box_apart_and_the_same_each_time() {
    let bricks = |seed: u32, turned: &str, more: &str| {
        case(&format!(
            "{more}[[body]]\nname = \"brick\"\nsize = [0.3, 0.06, 0.1]\ncenter = [1, 0.5, 0.5]\ndensity = 500\n\
             scatter = {{ count = 40, size = [1.9, 0.9, 0.9], seed = {seed}, turned = \"{turned}\" }}\n"
        ))
    };
    let free = bricks(1, "freely", "");
    let places = |case: &Case| case.body.iter().map(|b| b.center).collect::<Vec<_>>();
    assert_eq!(places(&free), places(&bricks(1, "freely", "")));
    assert_ne!(places(&free), places(&bricks(2, "freely", "")));
    // That none overlaps another one, or a wall, is what the scene looks at.
    let scene = Scene::build(&free).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.solids.len(), 40);
    let spread = |axis: usize| {
        let along = scene.solids.iter().map(|s| s.position[axis]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    assert!(spread(0) > 1.2 && spread(1) > 0.4 && spread(2) > 0.4, "all of the box is used");
    let tilted = |case: &Case| {
        let scene = Scene::build(case).unwrap_or_else(|e| panic!("{e}"));
        let up = scene.solids.iter().map(|s| (s.orientation * glam::DVec3::Z).z.abs());
        up.filter(|up| *up < 0.999_999).count()
    };
    assert!(
        tilted(&free) > 30 && tilted(&bricks(1, "about_z", "")) == 0 && tilted(&bricks(1, "no", "")) == 0
    );
    // They keep clear of what stands there already, bodies as well as walls.
    let column = "[[obstacle]]\nname = \"column\"\nmin = [0.8, 0.3, 0]\nmax = [1.2, 0.7, 1]\n\
                  [[body]]\nname = \"drum\"\nshape = \"cylinder\"\nradius = 0.2\nheight = 0.4\n\
                  center = [0.3, 0.5, 0.5]\nmass = 1\n";
    let beside = bricks(1, "freely", column);
    assert!(Scene::build(&beside).is_ok() && places(&beside)[1..] != places(&free)[..]);
}

#[test]
fn in_two_dimensions_they_are_scattered_in_the_plane() {
    let text = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\ndimensions = 2\n\
                [tank]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\n\
                [contact]\nspring = 1e5\n[[body]]\nname = \"it\"\nsize = [0.2, 0.1, 0.1]\n\
                center = [1, 0, 0.5]\ndensity = 500\n\
                scatter = { count = 12, size = [1.9, 1, 0.9] }\n";
    let case: Case = text.parse().unwrap_or_else(|e: Error| panic!("{e}"));
    let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.solids.len(), 12);
    assert!(scene.solids.iter().all(|s| (s.orientation * glam::DVec3::Y).y > 1.0 - 1e-9));
}

#[test]
fn what_is_scattered_keeps_clear_of_slopes_and_grounds() {
    // Half of the box for them is in the ground: a prism in the plane, a wedge in space, which is a mesh as files are.
    for (dimensions, ground) in [
        (2, "shape = \"prism\"\nsection = [[0.2, 0], [1.9, 0], [1.9, 0.9]]\n"),
        (3, "shape = \"wedge\"\nsize = [1.7, 1, 0.9]\ncenter = [1.333, 0.5, 0.3]\n"),
        (3, "shape = \"prism\"\nheight = 1\nsection = [[0.2, 0], [1.9, 0], [1.9, 0.9]]\n"),
    ] {
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\ndimensions = {dimensions}\n\
             [tank]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\n[contact]\nspring = 1e5\n\
             [[obstacle]]\nname = \"ground\"\n{ground}\
             [[body]]\nname = \"it\"\nsize = [0.2, 0.1, 0.1]\ncenter = [1, 0.5, 0.5]\ndensity = 500\n\
             scatter = {{ count = 10, size = [1.9, 0.9, 0.9], gap = 0.01 }}\n"
        );
        let case: Case = text.parse().unwrap_or_else(|e: Error| panic!("{e}"));
        // That none overlaps the ground is what the scene looks at.
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{dimensions}: {e}"));
        let above = |b: &seixo::case::Body| b.center[2] > 0.9 * (b.center[0] - 0.2) / 1.7;
        assert!(case.body.iter().all(above) && scene.solids.iter().filter(|s| s.is_body).count() == 10);
        // The corner under which there is nothing is in the box of the ground, and used.
        assert!(case.body.iter().any(|b| b.center[0] > 0.3 && b.center[2] < 0.9), "{:?}", case.body);
    }
}

#[test]
fn scattered_bodies_keep_clear_of_scattered_obstacles() {
    for seed in 0..5 {
        let text = format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1\n[tank]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\n\
             [contact]\nspring = 1e5\n\
             [[obstacle]]\nname = \"pile\"\nshape = \"cylinder\"\nradius = 0.1\nheight = 0.9\ncenter = [1, 0.5, 0.5]\n\
             scatter = {{ count = 6, size = [1.9, 0.9, 0.9], seed = {seed}, turned = \"no\" }}\n\
             [[body]]\nname = \"rock\"\nsize = [0.2, 0.1, 0.1]\ncenter = [1, 0.5, 0.5]\ndensity = 500\n\
             scatter = {{ count = 30, size = [1.9, 0.9, 0.9], seed = {seed} }}\n"
        );
        let case: Case = text.parse().unwrap_or_else(|e: Error| panic!("{e}"));
        // That none overlaps another is what the scene looks at.
        let scene = Scene::build(&case).unwrap_or_else(|e| panic!("{seed}: {e}"));
        assert_eq!(scene.solids.len(), 36);
    }
}

#[test]
fn what_is_wrong_with_many_is_told_where_it_was_written() {
    let six = "array = { count = [3, 1, 2], step = [0.3, 0, 0.1001] }\n";
    let thrice = |text: &str, part: &str| assert_eq!(text.matches(part).count(), 1, "{text}");
    let wrong = told(&format!("{}{six}", CUBE.replace("500", "-5")));
    thrice(&wrong, "body.0.density");
    assert!(wrong.contains("test.toml:15:1"), "{wrong}");
    let near = told(&format!("{CUBE}{}", six.replace("0.3", "0.08")));
    assert!(
        near.contains("body.0.array: body `cube_2` overlaps body `cube_1`")
            && near.contains("test.toml:16:1"),
        "{near}"
    );
    let copies = told(&format!("{CUBE}copies = [[0.6, 0.5, 0.05], [0.65, 0.5, 0.05]]\n"));
    assert!(copies.contains("body.0.copies.1: body `cube_3` overlaps body `cube_2`"), "{copies}");
    let first =
        told(&format!("{}copies = [[0.6, 0.5, 0.05]]\n", CUBE.replace("0.2, 0.5, 0.05", "0, 0.5, 0.05")));
    assert!(first.contains("body.0") && first.contains("`cube_1` overlaps wall `tank.x_min`"), "{first}");
    for (more, parts) in [
        (
            "array = { count = [0, 1, 1], step = [1, 1, 1] }\n",
            &["body.0.array.count", "1 or more along each axis"][..],
        ),
        (
            "array = { count = [2, 1, 1], step = [0, 1, 1] }\n",
            &["body.0.array.step", "2 along x would all stand in one"],
        ),
        ("array = { count = [900, 900, 1], step = [1, 1, 1] }\n", &["body.0.array.count", "20000 in all"]),
        (
            "scatter = { count = 500, size = [0.5, 0.5, 0.5] }\n",
            &["body.0.scatter.count", " of 500 find room in a box of 0.5 x"],
        ),
        ("scatter = { count = 2, size = [0.5, 0.05, 0.5] }\n", &["is too small for one of them"]),
        ("scatter = { count = 2 }\n", &["body.0.scatter", "missing field `size`"]),
        (
            "copies = [[0, 0, 0]]\narray = { count = [1, 1, 1], step = [1, 1, 1] }\n",
            &["`copies` and `array` exclude each other"],
        ),
        (
            "array = { count = [2, 1, 1], step = [1, 1, 1] }\n[[body]]\nname = \"cube_2\"\nsize = [0.1, 0.1, 0.1]\n\
             center = [1, 0.5, 0.5]\ndensity = 5\n",
            &["body.1.name", "`cube_2` is taken by body.0"],
        ),
        (
            "array = { count = [2, 1, 1], step = [0.3, 1, 1] }\n[[gauge.force]]\nname = \"f\"\non = \"cube\"\n",
            &["nothing solid is called `cube`", "did you mean `cube_1`"],
        ),
    ] {
        let wrong = told(&format!("{CUBE}{more}"));
        assert!(parts.iter().all(|part| wrong.contains(part)), "{wrong}");
    }
    let lattice = "[[obstacle]]\nname = \"o\"\nmin = [1, 0, 0]\nmax = [1.2, 0.2, 0.2]\n\
                   scatter = { count = 2, size = [1, 1, 1] }\n";
    assert!(
        told(lattice).contains("obstacle.0.scatter: what is scattered needs a `center`"),
        "{}",
        told(lattice)
    );
    // Read by serde alone, nothing is laid out.
    let typed: Case = toml::from_str(&text(&format!("{CUBE}{six}"))).unwrap();
    let refused = Scene::build(&typed).expect_err("not laid out").to_string();
    assert!(refused.contains("body.0 stands for several solids"), "{refused}");
    assert_eq!(typed.laid_out().unwrap().body.len(), 6);
}

/// Numbers that make no solid are told as they are without `scatter`, and at once.
#[test]
fn what_is_scattered_among_wrong_numbers_is_told_them() {
    let ball = |keys: &str| {
        format!(
            "[[body]]\nname = \"s\"\nshape = \"cylinder\"\nheight = 0.1\n{keys}\ndensity = 900\ncenter = [0.6, 0.5, 0.5]\n\
             scatter = {{ count = 3, size = [0.5, 0.4, 0.2] }}\n"
        )
    };
    let slope = "[[obstacle]]\nname = \"p\"\nshape = \"prism\"\nsection = [[0.4, 0.3], [0.8, 0.3], [0.8, 0.6]]\nheight = 0.6\n";
    let wrong = told(&format!("{}{slope}", ball("radius = -0.1")));
    assert!(wrong.contains("body.0.radius"), "{wrong}");
    let endless = "[[obstacle]]\nname = \"o\"\nmin = [0.5, 0, 0]\nmax = [inf, 0.6, 0.1]\n";
    let wrong = told(&format!("{}{endless}", ball("radius = 0.05")));
    assert!(wrong.contains("obstacle.0.max"), "{wrong}");
}

/// The case beside the results stays as it was written, its mesh under another name; what changed of it is told by
/// its keys.
#[test]
fn a_run_of_scattered_meshes_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let corners = [[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let triangles = faces.iter().map(|face| face.map(|k: usize| glam::DVec3::from(corners[k]))).collect();
    std::fs::write(path("rock.stl"), crate::meshes::stl(&triangles)).unwrap();
    let rocks = "[[body]]\nname = \"rock\"\nshape = \"mesh\"\nfile = \"rock.stl\"\n\
                 center = [1, 0.5, 0.5]\ndensity = 2500\n\
                 scatter = { count = 14, size = [1.6, 0.8, 0.8] }\n";
    std::fs::write(path("rocks.toml"), text(rocks)).unwrap();
    let run = |more: &[&str]| {
        let out = path("out");
        let fixed = ["run", "--backend", "cpu", "-q", "--json"];
        ran(&[&fixed[..], &[&path("rocks.toml"), "-o", &out], more].concat())
    };
    let part = run(&["--steps", "5"]);
    assert_eq!(json(&part.out)["bodies"].as_array().map(Vec::len), Some(14), "{}", part.err);
    let kept = std::fs::read_to_string(path("out/case.toml")).unwrap();
    assert!(kept.matches("[[body]]").count() == 1 && kept.contains("meshes/rock-"), "{kept}");
    let other = run(&["--resume", "--set", "body.0.scatter.seed=3"]);
    assert!(other.code != 0 && other.err.contains("body.0.scatter.seed was"), "{}", other.err);
    let rest = ran(&["run", "--resume", &path("out"), "--backend", "cpu", "-q", "--json"]);
    assert_eq!((rest.code, json(&rest.out)["status"].as_str()), (0, Some("done")), "{}", rest.err);
    // A page has room for twelve, and says so.
    let told = ran(&["report", &path("out"), "-o", &path("page.html")]);
    let page = std::fs::read_to_string(path("page.html")).unwrap_or_else(|e| panic!("{e}: {}", told.err));
    assert!(page.contains("rock_12: place [m]") && page.contains("2 more in bodies.csv"), "{}", told.err);
}
