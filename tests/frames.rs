//! Frames of a run as `render`, `report`, `measure` and `surface` choose and read them.

use crate::cli::ran;
use std::path::Path;

const STILL: &str = r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 0.03
[tank]
min = [0, 0, 0]
max = [0.4, 0.3, 0.3]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.4, 0.3, 0.2]
[output]
every = 0.01
"#;

fn run(folder: &Path, encoding: &str) -> String {
    let (case, out) = (folder.join("still.toml"), folder.join(encoding).display().to_string());
    std::fs::write(&case, STILL).unwrap();
    let set = format!("output.encoding=\"{encoding}\"");
    let done =
        ran(&["run", &case.display().to_string(), "-o", &out, "--backend", "cpu", "-q", "--set", &set]);
    assert_eq!(done.code, 0, "{}", done.err);
    out
}

/// The four who read frames.
fn readers<'a>(out: &'a str, more: &[&'a str]) -> Vec<Vec<&'a str>> {
    let all = [
        &["render", out, "--size", "160x90"][..],
        &["measure", out, "--point", "0.2,0.1,0.1"],
        &["surface", out],
        &["report", out, "--pictures", "4", "--size", "160x90"],
    ];
    all.map(|args| if args[0] == "report" { args.to_vec() } else { [args, more].concat() }).to_vec()
}

#[test]
fn what_is_damaged_inside_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in ["base64", "raw"] {
        let out = run(folder.path(), encoding);
        let file = |k: usize| Path::new(&out).join(format!("vtu/fluid_{k:04}.vtu"));
        let whole = std::fs::read(file(2)).unwrap();
        let half = whole.len() / 2;
        let start = whole.windows(14).position(|w| w == b"<AppendedData ").unwrap() + 40;
        let flipped = |mut bytes: Vec<u8>, from: usize, count: usize| {
            bytes[from..from + count].iter_mut().for_each(|b| *b ^= 0x15);
            bytes
        };
        let mut wrongs = vec![
            [&whole[..half], b"\n  </AppendedData>\n</VTKFile>\n"].concat(),
            [&whole[..start], b"\n  </AppendedData>\n</VTKFile>\n"].concat(),
            flipped(whole.clone(), start, 40),
        ];
        if encoding == "base64" {
            wrongs.push(flipped(whole.clone(), start + 200, 3));
        }
        for (k, wrong) in wrongs.iter().enumerate() {
            std::fs::write(file(2), wrong).unwrap();
            for args in readers(&out, &[]) {
                let told = ran(&args);
                let words = "warning: frame 2 is left out: ";
                assert!(told.code == 0 && told.err.matches(words).count() == 1, "{k} {args:?}: {}", told.err);
                assert!(told.err.contains("fluid_0002.vtu: "), "{k} {args:?}: {}", told.err);
                let three = match args[0] {
                    "measure" => told.out.lines().count() == 1 + 3,
                    "report" => true,
                    _ => told.out.starts_with("3 "),
                };
                assert!(three, "{k} {args:?}: {}", told.out);
            }
            for args in readers(&out, &["--times", "0.02"]).iter().filter(|args| args[0] != "report") {
                let told = ran(args);
                let words = "still.pvd names cannot be read any more";
                assert!(told.code == 2 && told.err.contains(words), "{k} {args:?}: {}", told.err);
            }
        }
    }
}

#[test]
fn a_time_that_is_far_from_all_frames_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), "base64");
    for args in readers(&out, &["--times", "0.02,5,0.014"]).iter().filter(|args| args[0] != "report") {
        let told = ran(args);
        let words = "note: no frame is at 5, 0.014 s (--times): the nearest is taken, at 0.03, 0.01 s";
        assert!(told.code == 0 && told.err.contains(words), "{args:?}: {}", told.err);
    }
    let told = ran(&["measure", &out, "--point", "0.2,0.1,0.1", "--times", "-1,0"]);
    assert!(told.code == 0 && told.err.contains("no frame is at -1 s (--times)"), "{}", told.err);
    let told = ran(&["measure", &out, "--point", "0.2,0.1,0.1", "--times", "0,0.0101,0.02"]);
    assert_eq!((told.code, told.err.as_str()), (0, ""));
    // A frame that is asked for twice is read once.
    let told = ran(&["measure", &out, "--point", "0.2,0.1,0.1", "--times", "0.02,0.01,0.0101,0.02"]);
    assert_eq!((told.code, told.out.lines().count()), (0, 1 + 2), "{}", told.out);
}
