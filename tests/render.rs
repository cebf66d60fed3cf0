//! `seixo render`: pictures of what a run left.

use crate::cli::{json, ran, small_case};
use std::path::Path;

/// Width, height, frames and pixels of a PNG.
fn read(path: &Path) -> (u32, u32, u32, Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let frames = reader.info().animation_control().map_or(1, |a| a.num_frames);
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width, info.height, frames, bytes)
}

fn differing(a: &[u8], b: &[u8]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 2).count()
}

#[test]
fn frames_less_than_a_millisecond_apart_have_times_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("a").display().to_string();
    let sets =
        ["run.time_step=1e-4", "run.end=1.2e-3", "output.every=4e-4"].map(|set| ["--set", set]).concat();
    let run = ran(&[&["run", &case, "-o", &root, "--backend", "cpu"][..], &sets].concat());
    assert!(run.code == 0 && run.out.contains("to t = 0.0012 s"), "{} {}", run.out, run.err);
    let drawn = ran(&["render", &root, "--size", "64x48"]);
    for time in ["t = 0.0000 s", "t = 0.0004 s", "t = 0.0008 s", "t = 0.0012 s"] {
        assert!(drawn.err.contains(time), "{time}: {}", drawn.err);
    }
    let told = ran(&["report", &root, "--pictures", "4", "--size", "64x48"]);
    let page = std::fs::read_to_string(folder.path().join("a/report.html")).unwrap();
    assert!(told.code == 0 && page.contains("\"time\":\"0.0004\""), "{}", told.err);
}

#[test]
fn frames_become_pictures_as_the_run_itself_draws_them() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let body =
        "body=[{name=\"b\",size=[0.15,0.05,0.1],center=[1.2,0,0.6],density=500,angular_velocity=[0,20,0]}]";
    let sets = ["--set", body, "--set", "contact={spring=1e5}"];
    for encoding in ["base64", "raw"] {
        let root = folder.path().join(encoding);
        let shown = root.display().to_string();
        let set = format!("output.encoding=\"{encoding}\"");
        let run = ["run", &case, "-o", &shown, "--backend", "cpu", "-q", "--picture", "--set", &set];
        let run = ran(&[&run[..], &sets].concat());
        assert_eq!(run.code, 0, "{}", run.err);
        let out = folder.path().join(format!("{encoding}-again"));
        let again = out.display().to_string();
        // The run itself cannot know what is to come, and takes the speed of a fall.
        let drawn = ran(&["render", &shown, "-o", &again, "-q", "--range", "0,3.131560"]);
        assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
        for frame in 0..4 {
            let name = format!("frame_{frame:04}.png");
            let ((w, h, _, own), (_, _, _, new)) =
                (read(&root.join("pictures").join(&name)), read(&out.join(name)));
            assert_eq!((w, h), (960, 480));
            // Files hold single precision: an edge may fall on the next sample.
            assert!(differing(&own, &new) < own.len() / 500, "{encoding} {frame}: {}", differing(&own, &new));
        }
    }
    let root = folder.path().join("raw").display().to_string();
    let draw = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let args =
            ["render", &root, "-q", "-o", &out.display().to_string(), "--size", "320x200"].map(String::from);
        let args: Vec<&str> = args.iter().map(String::as_str).chain(more.iter().copied()).collect();
        let drawn = ran(&args);
        assert_eq!((drawn.code, drawn.err.as_str()), (0, ""), "{more:?}");
        out
    };
    let sheet = read(&draw("sheet", &["--times", "0,0.02,0.04", "--sheet", "2"]).join("sheet.png"));
    assert_eq!((sheet.0, sheet.1), (640, 400));
    let animation = read(&draw("animation", &["--animation", "10"]).join("animation.png"));
    assert_eq!((animation.0, animation.1, animation.2), (320, 200, 4));
    let plain = read(&draw("plain", &["--times", "0.04"]).join("frame_0002.png")).3;
    for (name, more) in [
        ("zoom", &["--zoom", "2", "--target", "0.2,0,0.2"][..]),
        ("pressure", &["--field", "pressure"]),
        ("range", &["--range", "0,0.1"]),
        ("slice", &["--slice", "x=0.2"]),
        ("angle", &["--azimuth", "-30", "--elevation", "20"]),
        ("top", &["--view", "top"]),
        ("bare", &["--no-labels"]),
    ] {
        let other = read(&draw(name, &[&["--times", "0.04"], more].concat()).join("frame_0002.png")).3;
        assert!(differing(&plain, &other) > 500, "{name} changes nothing");
    }
}

/// A colour bar tells nothing where nothing is coloured: frames of bodies alone look alike whatever its range.
#[test]
fn pictures_without_water_have_no_colour_bar() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let shown = folder.path().join("a").display().to_string();
    let series = "output.series=[{name=\"wet\",every=0.02,kinds=[\"fluid\"]}]";
    let sets = ["--set", "output.kinds=[\"body\"]", "--set", series];
    let run =
        ran(&[&["run", &case, "-o", &shown, "--backend", "cpu", "-q", "--steps", "1"][..], &sets].concat());
    assert_eq!(run.code, 0, "{}", run.err);
    let draw = |range: &str, more: &[&str]| {
        let out = folder.path().join(range).display().to_string();
        let args =
            ["render", &shown, "-q", "-o", &out, "--size", "320x200", "--times", "0", "--range", range];
        let drawn = ran(&[&args[..], more].concat());
        assert_eq!((drawn.code, drawn.err.as_str()), (0, ""));
        read(&Path::new(&out).join("frame_0000.png")).3
    };
    assert!(draw("0,1", &[]) == draw("0,2", &[]));
    assert!(differing(&draw("0,1", &["--series", "wet"]), &draw("0,2", &["--series", "wet"])) > 20);
}

#[test]
fn what_cannot_be_drawn_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("results");
    let shown = root.display().to_string();
    assert_eq!(ran(&["run", &case, "-o", &shown, "--backend", "cpu", "-q", "--steps", "1"]).code, 0);
    for (args, word) in [
        (vec!["render", "no/such"], "there is no folder no/such; name the folder"),
        (vec!["render", &case], "small.toml is a file; name the folder"),
        (vec!["render", &shown, "--size", "0x7"], "width and height in pixels"),
        (vec!["render", &shown, "--size", "100000x100000"], "width and height in pixels"),
        (vec!["render", &shown, "--slice", "w=1"], "an axis and a place"),
        (vec!["render", &shown, "--range", "2,1"], "is to be larger"),
        (vec!["render", &shown, "--zoom", "nan"], "--zoom"),
        (vec!["render", &shown, "--zoom", "-1"], "write a number from 0.01 to 1000"),
        (vec!["surface", &shown, "--cell", "-1"], "write a number from 0.1 to 2"),
        (vec!["render", &shown, "--times", "-1,x"], "not a number"),
        (vec!["render", &shown, "--elevation", "100"], "-90 to 90"),
    ] {
        let drawn = ran(&args);
        assert!(drawn.code == 2 && drawn.err.contains(word), "{args:?}: {} {}", drawn.code, drawn.err);
    }
    // A frame that is damaged inside is left out and named.
    let frame = root.join("vtu/fluid_0000.vtu");
    let mut bytes = std::fs::read(&frame).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 40].fill(b'!');
    std::fs::write(&frame, bytes).unwrap();
    let drawn = ran(&["render", &shown]);
    let words = ["frame 0 is left out", "fluid_0000.vtu: "];
    assert!(drawn.code == 0 && words.iter().all(|w| drawn.err.contains(w)), "{} {}", drawn.code, drawn.err);
    let none = ran(&[
        "run",
        &case,
        "-o",
        &shown,
        "--backend",
        "cpu",
        "-q",
        "--force",
        "--set",
        "output.every=0",
        "--json",
    ]);
    assert_eq!(json(&none.out)["frames"], 0);
    let drawn = ran(&["render", &shown]);
    assert!(drawn.code == 2 && drawn.err.contains("the case has output.every = 0"), "{}", drawn.err);
    // A list of frames that is gone, or no list.
    let again = ran(&["run", &case, "-o", &shown, "--backend", "cpu", "-q", "--force", "--steps", "1"]);
    assert_eq!(again.code, 0, "{}", again.err);
    for text in [Some("<VTKFile>"), None] {
        let list = root.join("small.pvd");
        text.map_or_else(|| std::fs::remove_file(&list), |text| std::fs::write(&list, text)).unwrap();
        let drawn = ran(&["measure", &shown, "--point", "0.1,0,0.1"]);
        assert!(drawn.code == 2 && drawn.err.contains("small.pvd, is gone or names none"), "{}", drawn.err);
    }
}

/// What is drawn by its triangles looks as what is drawn by its distances.
#[test]
fn a_box_of_triangles_looks_as_a_box() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wall.toml");
    let text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 0.001\n[output]\nevery = 0.001\n[tank]\nmin = [0, 0, 0]\n\
                max = [0.6, 0.4, 0.4]\nopen = [\"z_max\"]\n[[moving_wall]]\nname = \"wall\"\n\
                orientation = { axis = [0, 1, 0], angle_deg = 15 }\nmotion = [[0, 0, 0, 0], [1, 0.1, 0, 0]]\n";
    let draw = |name: &str, keys: &str| {
        std::fs::write(&path, format!("{text}{keys}\n")).unwrap();
        let (case, out) = (path.display().to_string(), folder.path().join(name).display().to_string());
        let done = ran(&["run", &case, "-o", &out, "--backend", "cpu", "-q"]);
        assert_eq!(done.code, 0, "{}", done.err);
        let drawn = ran(&["render", &out, "-q", "--size", "320x240", "--times", "0"]);
        assert_eq!(drawn.code, 0, "{}", drawn.err);
        read(&Path::new(&out).join("pictures/frame_0000.png")).3
    };
    let plain = draw("box", "size = [0.2, 0.1, 0.14]\ncenter = [0.3, 0.2, 0.2]");
    let section = "section = [[-0.1, -0.07], [0.1, -0.07], [0.1, 0.07], [-0.1, 0.07]]";
    // It reaches from y = 0 to its height.
    let prism = format!("shape = \"prism\"\n{section}\nheight = 0.1\nposition = [0.3, 0.15, 0.2]");
    let faces = draw("prism", &prism);
    let nothing = draw("nothing", "size = [0.04, 0.04, 0.04]\ncenter = [0.3, 0.2, 0.1]");
    let (off, all) = (differing(&plain, &faces), differing(&plain, &nothing));
    assert!(all > 10_000 && off < all / 40, "{off} of {all}");
}
