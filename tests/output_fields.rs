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
        let within = |x: &[f32; 3]| (-0.5..=0.3).contains(&x[0]) && (0.1..=0.4).contains(&x[2]);
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
