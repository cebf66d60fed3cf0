//! Frames by choice: which fields, of which box; what reads them says what is missing.

use crate::cli::{ran, small_case};
use seixo::output::particles::Particles;
use seixo::output::replay::{frames, particles};
use std::path::{Path, PathBuf};

fn run(folder: &Path, name: &str, more: &[&str]) -> PathBuf {
    let root = folder.join(name);
    let (case, shown) = (small_case(folder), root.display().to_string());
    let done =
        ran(&[&["run", &case, "-o", &shown, "--backend", "cpu", "--threads", "1", "-q"], more].concat());
    assert_eq!(done.code, 0, "{}", done.err);
    root
}

fn last(root: &Path) -> (PathBuf, PathBuf) {
    let last = frames(root, "small").unwrap().pop().unwrap();
    (last.fluid.unwrap(), last.solids.unwrap())
}

fn names(path: &Path) -> Vec<String> {
    let bytes = std::fs::read(path).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let head = text.split("<AppendedData").next().unwrap();
    head.split("Name=\"").skip(1).map(|rest| rest.split('"').next().unwrap().to_owned()).collect()
}

#[test]
fn frames_hold_the_fields_that_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let all = run(folder.path(), "all", &[]);
    // In another order it is the same file.
    let listed = "output.fields=[\"id\",\"body\",\"kind\",\"number_density\",\"pressure\",\"velocity\"]";
    let same = run(folder.path(), "same", &["--set", listed]);
    assert_eq!(std::fs::read(last(&all).0).unwrap(), std::fs::read(last(&same).0).unwrap());

    let few = run(folder.path(), "few", &["--set", "output.fields=[\"pressure\"]"]);
    let cells = ["Points", "connectivity", "offsets", "types"].map(String::from);
    assert_eq!(names(&last(&few).0)[..2], ["TimeValue", "Pressure"].map(String::from));
    assert_eq!(names(&last(&few).0)[2..], cells);
    assert_eq!(names(&last(&few).1)[1..4], ["Pressure", "Body", "Id"].map(String::from));
    let (whole, part) = (particles(&last(&all).0).unwrap(), particles(&last(&few).0).unwrap());
    assert_eq!((&whole.position, &whole.pressure), (&part.position, &part.pressure));
    assert!(part.velocity.is_empty() && part.id.is_empty() && whole.pressure.iter().any(|&p| p > 100.0));

    // What reads them: the pictures by what there is, and words for what there is not.
    let shown = few.display().to_string();
    let drawn = ran(&["render", &shown, "-q", "--size", "320x160"]);
    assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
    let out = folder.path().join("by-pressure").display().to_string();
    let draw =
        ["render", &all.display().to_string(), "-q", "--size", "320x160", "--field", "pressure", "-o", &out];
    assert_eq!(ran(&draw).code, 0);
    let picture = |root: &Path| std::fs::read(root.join("frame_0002.png")).unwrap();
    assert!(
        picture(&few.join("pictures")) == picture(Path::new(&out)),
        "the picture is that of the pressure"
    );
    let wrong = ran(&["render", &shown, "-q", "--field", "vx"]);
    assert!(wrong.code == 2 && wrong.err.contains("hold no `Velocity`: output.fields"), "{}", wrong.err);
    assert!(wrong.err.contains("--field can be: pressure"), "{}", wrong.err);
    let read = ran(&["measure", &shown, "--point", "0.2,0,0.1", "--times", "0.04"]);
    assert!(read.code == 0 && read.err.contains("note: no velocity: output.fields"), "{}", read.err);
    let row: Vec<&str> = read.out.lines().nth(1).unwrap().split(',').collect();
    assert!(row[4..7] == [""; 3] && row[7].parse::<f64>().unwrap() > 100.0, "{row:?}");
    assert_eq!(ran(&["report", &shown, "-q", "--size", "320x160"]).code, 0);

    let none = run(folder.path(), "none", &["--set", "output.fields=[]"]).display().to_string();
    assert_eq!(particles(&last(Path::new(&none)).0).unwrap().position, whole.position);
    let wrong = ran(&["render", &none, "-q"]);
    assert!(wrong.code == 2 && wrong.err.contains("no field to colour the water by"), "{}", wrong.err);
    let wrong = ran(&["measure", &none, "--point", "0.2,0,0.1"]);
    assert!(wrong.code == 2 && wrong.err.contains("neither velocity nor pressure"), "{}", wrong.err);
    assert_eq!(ran(&["report", &none, "-q"]).code, 0);
    let page = std::fs::read_to_string(Path::new(&none).join("report.html")).unwrap();
    assert!(!page.contains(">Pictures<") && page.contains(">Gauges<"));
}

#[test]
fn frames_hold_the_water_and_the_walls_of_a_region_and_solids_whole() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = "output.kinds=[\"fluid\",\"body\",\"wall\",\"dummy\"]";
    let all = run(folder.path(), "all", &["--set", kinds]);
    // In two dimensions y does not count.
    let region = "output.region={min=[-0.5,3,0.1],max=[0.3,4,0.4]}";
    let part = run(folder.path(), "part", &["--set", kinds, "--set", region]);
    let ids = |p: &Particles| p.id.clone();
    let inside = |p: &Particles| -> Vec<u32> {
        let within = |x: &[f64; 3]| (-0.5..=0.3).contains(&x[0]) && (0.1..=0.4).contains(&x[2]);
        p.position.iter().zip(&p.id).filter(|(x, _)| within(x)).map(|(_, &id)| id).collect()
    };
    let (whole, cut) = (particles(&last(&all).0).unwrap(), particles(&last(&part).0).unwrap());
    assert!(ids(&cut) == inside(&whole) && cut.len() > 20 && cut.len() < whole.len() / 2, "{}", cut.len());
    let walls = |root: &Path| particles(&root.join("vtu/walls.vtu")).unwrap();
    let (whole, cut) = (walls(&all), walls(&part));
    assert!(ids(&cut) == inside(&whole) && !cut.is_empty() && cut.len() < whole.len());
    assert_eq!(std::fs::read(last(&all).1).unwrap(), std::fs::read(last(&part).1).unwrap());
    // A region that the water never reaches: files without particles.
    let dry = run(folder.path(), "dry", &["--set", "output.region={min=[1.5,0,0.5],max=[1.8,0,0.9]}"]);
    assert!(particles(&last(&dry).0).unwrap().is_empty());
    let drawn = ran(&["render", &dry.display().to_string(), "-q", "--size", "320x160"]);
    assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
}

#[test]
fn what_is_wrong_with_the_choice_names_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let wrong = |set: &str| {
        let told = ran(&["plan", &case, "--set", set]);
        assert_eq!(told.code, 2, "{}", told.out);
        told.err
    };
    let err = wrong("output.fields=[\"presure\"]");
    assert!(err.contains("presure") && err.contains("pressure") && err.contains("number_density"), "{err}");
    assert!(wrong("output.fields=[\"id\",\"id\"]").contains("named twice"));
    let err = wrong("output.region={min=[0,0,0.5],max=[1,0,0.5]}");
    assert!(err.contains("empty along z"), "{err}");
    let err = wrong("output.region={min=[2.5,0,0],max=[3,0,1]}");
    assert!(err.contains("outside of the tank along x") && err.contains("0 to 2 m"), "{err}");
    assert!(wrong("output.region={min=[0,0,0]}").contains("missing field `max`"));
}

const SERIES: &str = "output.series=[{name=\"corner\",every=0.005,kinds=[\"fluid\"],fields=[\"velocity\"],region={min=[0,0,0],\
                      max=[0.2,0,0.2]}},{name=\"gate\",every=0.01,kinds=[\"body\"],fields=[]}]";

#[test]
fn series_are_frames_of_their_own_choice_and_interval() {
    let folder = tempfile::tempdir().unwrap();
    let plain = run(folder.path(), "plain", &[]);
    let root = run(folder.path(), "series", &["--set", SERIES]);
    assert!(!plain.join("series").exists());
    // Those of the case itself are what they are without.
    for (a, b) in frames(&plain, "small").unwrap().iter().zip(frames(&root, "small").unwrap()) {
        let bytes = |path: &Option<PathBuf>| std::fs::read(path.as_ref().unwrap()).unwrap();
        assert!(bytes(&a.fluid) == bytes(&b.fluid) && bytes(&a.solids) == bytes(&b.solids));
    }
    let list = |name: &str| frames(&root.join("series").join(name), name).unwrap();
    let (corner, gate) = (list("corner"), list("gate"));
    // 0, then every 5 or 10 ms to 50 ms.
    let near = |times: Vec<f64>, every: f64| {
        times.iter().enumerate().all(|(k, t)| (t - every * k as f64).abs() < 1.1e-3)
    };
    assert_eq!((corner.len(), gate.len()), (11, 6));
    assert!(near(corner.iter().map(|f| f.time).collect(), 0.005));
    assert!(near(gate.iter().map(|f| f.time).collect(), 0.01));
    let result: serde_json::Value =
        serde_json::from_slice(&std::fs::read(root.join("result.json")).unwrap()).unwrap();
    let counts = [&result["frames"], &result["series"]["corner"], &result["series"]["gate"]];
    assert_eq!(counts.map(|n| n.as_u64()), [Some(4), Some(11), Some(6)]);
    let shown = particles(corner[10].fluid.as_ref().unwrap()).unwrap();
    let whole = particles(&last(&root).0).unwrap();
    let inside = |x: &&[f64; 3]| x[0] >= 0.0 && x[0] <= 0.2 && (0.0..=0.2).contains(&x[2]);
    let expected: Vec<[f64; 3]> = whole.position.iter().filter(inside).copied().collect();
    assert!(shown.position == expected && expected.len() > 10, "{} {}", shown.len(), expected.len());
    assert!(corner[10].solids.is_none() && shown.pressure.is_empty() && !shown.velocity.is_empty());
    let (there, here) = (gate[5].solids.as_ref().unwrap(), last(&root).1);
    assert_eq!(particles(there).unwrap().position, particles(&here).unwrap().position);
    assert!(gate[5].fluid.is_none() && !root.join("series/gate/vtu/walls.vtu").exists());

    // What reads frames takes a name.
    let dir = root.display().to_string();
    let drawn = ran(&["render", &dir, "--series", "corner", "--times", "0.05", "-q", "--size", "160x80"]);
    assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
    assert!(root.join("series/corner/pictures/frame_0010.png").exists());
    // The gate alone, which takes no colour of the water's.
    let drawn = ran(&["render", &dir, "--series", "gate", "--times", "0.05", "-q", "--size", "160x80"]);
    assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
    let rows = ran(&["measure", &dir, "--series", "corner", "--point", "0.1,0,0.1"]);
    assert_eq!((rows.code, rows.out.lines().count()), (0, 12));
    assert!(rows.err.contains("note: no pressure"), "{}", rows.err);
    let wrong = ran(&["measure", &dir, "--series", "gat", "--point", "0.1,0,0.1"]);
    assert!(wrong.code == 2 && wrong.err.contains("no output.series called `gat`; there are: corner, gate"));
    let wrong = ran(&["surface", &plain.display().to_string(), "--series", "x"]);
    assert!(wrong.code == 2 && wrong.err.contains("there are: none"), "{}", wrong.err);

    // Results that take their place leave none of them, and of a stranger's file its folder.
    std::fs::write(root.join("series/gate/notes.txt"), "mine").unwrap();
    run(folder.path(), "series", &["--force"]);
    assert!(!root.join("series/corner/vtu").exists() && !root.join("series/gate/gate.pvd").exists());
    assert!(root.join("series/gate/notes.txt").exists());
}

#[test]
fn series_count_on_the_disk() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let plan = |set: &str| {
        let told = ran(&["plan", &case, "--json", "--set", set]);
        assert_eq!(told.code, 0, "{}", told.err);
        serde_json::from_str::<serde_json::Value>(&told.out).unwrap()["estimate"].clone()
    };
    let (few, many) = (plan("output.every=0"), plan(SERIES));
    assert!(few["series"].is_null());
    // 16 of 100 particles, 33 of 50 bytes, by what all of them take.
    let all = many["frame_bytes"].as_f64().unwrap();
    let corner = &many["series"][0];
    assert_eq!((&corner["name"], &corner["frames"]), (&"corner".into(), &12.0.into()));
    assert!((corner["frame_bytes"].as_f64().unwrap() / all - 0.16 * 33.0 / 50.0).abs() < 1e-9, "{many}");
    let told = ran(&["plan", &case, "--set", SERIES]);
    assert!(told.out.contains("series `corner`: 12 frames of"), "{}", told.out);
    let far = SERIES.replace("every=0.01", "every=1e-14").replace("\"body\"", "\"fluid\"");
    let out = folder.path().join("far").display().to_string();
    // A frame a step, of many steps.
    let steps = ["--set", "run.time_step=1e-10", "--spacing", "0.005"];
    let run = ["run", &case, "-o", &out, "--backend", "cpu", "-q", "--set", &far];
    let refused = ran(&[&run[..], &steps].concat());
    assert!(
        refused.code == 2 && refused.err.contains("raise output.every (or that of a series)"),
        "{}",
        refused.err
    );
}

#[test]
fn what_is_wrong_with_a_series_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let text = std::fs::read_to_string(&case).unwrap();
    for (rows, what) in [
        ("name = \"../up\"\nevery = 0.1", "`../up` is the name of a folder"),
        ("name = \"a\"\nevery = 0.0", "0 is out of range"),
        ("name = \"a\"", "missing field `every`"),
        ("name = \"a\"\nevery = 0.1\nkinds = []", "would hold nothing"),
        ("name = \"a\"\nevery = 0.1\nfields = [\"id\", \"id\"]", "named twice"),
        ("name = \"a\"\nevery = 0.1\n[[output.series]]\nname = \"A\"\nevery = 1.0", "two series are called"),
        ("name = \"a\"\nevery = 0.1\nregion = {min=[3,0,0],max=[4,0,1]}", "outside of the tank along x"),
        ("name = \"a\"\nevery = 0.1\nencoding = \"raw\"", "encoding"),
    ] {
        std::fs::write(&case, format!("{text}\n[[output.series]]\n{rows}\n")).unwrap();
        let told = ran(&["plan", &case]);
        assert!(told.code == 2 && told.err.contains(what), "{rows}: {}{}", told.out, told.err);
        // The line in question.
        assert!(told.err.contains("small.toml:"), "{}", told.err);
    }
}

#[test]
fn frames_at_coordinates_of_a_site_tell_their_particles_apart() {
    let folder = tempfile::tempdir().unwrap();
    let write = |at: f64| {
        let text = format!(
            "[run]\nspacing = 0.5\ntime_step = 0.01\nend = 0.02\ndimensions = 2\n\
             [tank]\nmin = [{at}, 0, 0]\nmax = [{}, 5, 8]\nopen = [\"z_max\"]\n\
             [fluid]\nsound_speed = 20\n[[fluid.block]]\nmin = [{at}, 0, 0]\nmax = [{}, 5, 5]\n\
             [output]\nregion = {{ min = [{}, 0, 0], max = [{}, 5, 5] }}\n",
            at + 10.0,
            at + 10.0,
            at + 2.1,
            at + 4.1
        );
        let (case, out) = (folder.path().join("site.toml"), folder.path().join(format!("{at}")));
        std::fs::write(&case, text).unwrap();
        let (case, out) = (case.display().to_string(), out.display().to_string());
        let ran = ran(&["run", &case, "-o", &out, "--backend", "cpu", "-q"]);
        assert_eq!(ran.code, 0, "{}", ran.err);
        let file = frames(Path::new(&out), "site").unwrap().pop().unwrap().fluid.unwrap();
        let head = String::from_utf8_lossy(&std::fs::read(&file).unwrap()).into_owned();
        (particles(&file).unwrap(), head.contains("type=\"Float64\" Name=\"Points\""), out)
    };
    let ((near, small, _), (far, double, out)) = (write(0.0), write(4.5e6));
    assert!(double && !small && near.len() == 4 * 10 && far.id == near.id, "{} {}", near.len(), far.len());
    for (a, b) in near.position.iter().zip(&far.position) {
        assert!((b[0] - 4.5e6 - a[0]).abs() < 1e-3 && (b[2] - a[2]).abs() < 1e-3, "{a:?} {b:?}");
    }
    let rows = ran(&["measure", &out, "--point", "4500003.1,0,2.1", "--times", "0.02"]);
    assert!(rows.code == 0 && !rows.out.lines().last().unwrap().ends_with(','), "{} {}", rows.out, rows.err);
}
