//! `seixo report`: a page that holds everything, for eyes, ears and phones.

use crate::cli::{json, ran, small_case};
use std::path::{Path, PathBuf};

/// The report of the small case with a body whose name looks like markup.
fn page(folder: &Path, more: &[&str]) -> (PathBuf, String) {
    let case = small_case(folder);
    let root = folder.join("results");
    let shown = root.display().to_string();
    let body = "body=[{name=\"a <b> & c\",size=[0.15,0.05,0.1],center=[1.2,0,0.6],density=500}]";
    let sets = ["--set", body, "--set", "contact={spring=1e5}", "--set", "output.every=0.005"];
    let run = ran(&[&["run", &case, "-o", &shown, "--backend", "cpu", "-q"], &sets[..], more].concat());
    assert!(run.code == 0 || run.code == 4, "{}", run.err);
    let told = ran(&["report", &shown, "--size", "480x240", "--pictures", "5"]);
    assert!(told.code == 0 && told.out.contains("report.html"), "{} {}", told.out, told.err);
    let path = root.join("report.html");
    let text = std::fs::read_to_string(&path).unwrap();
    (path, text)
}

#[test]
fn a_report_holds_everything_and_fetches_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (_, text) = page(folder.path(), &[]);
    for word in [
        "<html lang=\"en\">",
        "default-src 'none'",
        "name=\"viewport\"",
        "prefers-color-scheme: dark",
        "<strong>Fine</strong>",
        "p floor [Pa]",
        "on gate_force [N]",
        "a &lt;b&gt; &amp; c: place [m]",
        "gate: place [m]",
        "of motion",
        "conjugate gradient",
        "The time step was set by run.time_step (100 %)",
        "spacing = 0.05",
        "max=\"4\"",
    ] {
        assert!(text.contains(word), "{word}");
    }
    // In two dimensions nothing acts along y.
    assert!(!text.contains("on gate_force_y [N]") && !text.contains("on gate_torque_x"));
    // Any three letters may stand next to each other in a picture.
    let words: String =
        text.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect();
    let words =
        words.split("id=\"frames\">").next().unwrap().to_owned() + words.split("</script>").nth(1).unwrap();
    for word in ["http://", "https://", "src=\"/", "@import", "url(", "a <b> & c: place", "NaN"] {
        assert!(!words.contains(word), "{word}");
    }
    assert!(
        words.len() > 10_000 && words.contains(">Gauges<") && words.contains("spacing = 0.05"),
        "{}",
        words.len()
    );
    // Every picture and chart has words; the pictures are the frames, the last one shown without a script.
    assert_eq!(text.matches("<img ").count(), text.matches("<img id=\"picture\" alt=\"The scene at").count());
    assert!(!words.contains("Water in and out"));
    assert_eq!(text.matches("<svg ").count(), text.matches("role=\"img\" aria-label=\"").count());
    let frames = text.split("id=\"frames\">").nth(1).unwrap().split("</script>").next().unwrap();
    let frames = json(frames);
    let times: Vec<&str> = frames.as_array().unwrap().iter().map(|f| f["time"].as_str().unwrap()).collect();
    assert_eq!((times.len(), times[0], times[4]), (5, "0.000", "0.050"));
    assert!(text.len() < 1_500_000, "{} bytes", text.len());
}

#[test]
fn a_report_of_a_run_in_parts_says_whose_times_the_stages_have() {
    let folder = tempfile::tempdir().unwrap();
    let (path, text) = page(folder.path(), &["--steps", "20"]);
    assert!(text.contains("<h3>seconds of each stage</h3>"), "{text}");
    let shown = path.parent().unwrap().display().to_string();
    assert_eq!(ran(&["run", "--resume", &shown, "--backend", "cpu", "-q"]).code, 0);
    assert_eq!(ran(&["report", &shown, "-q"]).code, 0);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("resumed 1 time")
            && text.contains("<h3>seconds of each stage, since it was last resumed</h3>")
    );
}

#[test]
fn a_report_tells_of_runs_that_failed_and_of_those_that_have_not_ended() {
    let folder = tempfile::tempdir().unwrap();
    let none = ["--set", "fluid.solver.max_iterations=1", "--set", "fluid.solver.tolerance=1e-9"];
    let (path, text) = page(folder.path(), &none);
    assert!(text.contains("<strong>Failed</strong>") && text.contains("pressure solves missed"), "{text}");
    let root = path.parent().unwrap();
    std::fs::remove_file(root.join("result.json")).unwrap();
    // The last row of a run in progress may be half a row.
    let table = root.join("monitors.csv");
    let mut rows = std::fs::read_to_string(&table).unwrap();
    rows.truncate(rows.len() - 40);
    std::fs::write(&table, rows).unwrap();
    let shown = root.display().to_string();
    assert_eq!(ran(&["report", &shown, "-q"]).code, 0);
    assert!(std::fs::read_to_string(&path).unwrap().contains("<strong>Not finished</strong>"));
    let nothing = ran(&["report", &folder.path().display().to_string()]);
    assert!(nothing.code == 2 && nothing.err.contains("holds no run"), "{}", nothing.err);
    // A run without frames and gauges has a page without them.
    let dry = root.parent().unwrap().join("dry").display().to_string();
    let run = ["run", "cases/sliding_block.toml", "-o", &dry, "--backend", "cpu", "-q", "--steps", "20"];
    assert_eq!(ran(&[&run[..], &["--set", "output.every=0"]].concat()).code, 0);
    assert_eq!(ran(&["report", &dry, "-q"]).code, 0);
    let text = std::fs::read_to_string(Path::new(&dry).join("report.html")).unwrap();
    assert!(
        !text.contains("id=\"moment\" type")
            && !text.contains(">Gauges<")
            && text.contains("block: place [m]")
    );
}

/// In a browser: no complaint on the console, and the slider and the button change the picture.
#[test]
#[ignore = "needs chromium: cargo test --release --test seixo -- --ignored browser"]
fn a_report_works_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    let (path, text) = page(folder.path(), &[]);
    let probe = "<script>
        const first = picture.src, told = [picture.alt];
        moment.value = '0'; moment.dispatchEvent(new Event('input'));
        told.push(picture.alt, said.value, String(picture.src !== first), String(play.hidden));
        play.click(); told.push(play.textContent); play.click(); told.push(play.textContent);
        setTimeout(() => { told.push(String(picture.naturalWidth)); document.title = told.join('|'); }, 300);
        </script></body>";
    let probed = path.with_file_name("probed.html");
    std::fs::write(&probed, text.replace("</body>", probe)).unwrap();
    let flags = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        "--virtual-time-budget=3000",
    ];
    let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
    let output = std::process::Command::new("chromium")
        .args(flags)
        .args([&profile, "--dump-dom", &format!("file://{}", probed.display())])
        .output()
        .expect("chromium starts");
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let title = dom.split("<title>").nth(1).and_then(|t| t.split("</title>").next()).unwrap_or_default();
    let expected = "The scene at t = 0.050 s|The scene at t = 0.000 s|t = 0.000 s|true|false|Pause|Play|480";
    assert_eq!(title, expected, "{log}");
    assert!(!log.contains("CONSOLE"), "{log}");
}

#[test]
fn a_table_that_no_run_wrote_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let case = small_case(folder.path());
    let root = folder.path().join("out");
    let out = root.display().to_string();
    assert_eq!(ran(&["run", &case, "-o", &out, "--backend", "cpu", "-q", "--steps", "3"]).code, 0);
    let other = folder.path().join("other").display().to_string();
    assert_eq!(ran(&["run", &case, "-o", &other, "--backend", "cpu", "-q", "--steps", "3"]).code, 0);
    let page = folder.path().join("page.html").display().to_string();
    for (name, held, words) in [
        ("gauges.csv", &b"a;b\n1;2\n"[..], "line 1: it has no column `time [s]`"),
        ("bodies.csv", b"time [s],x\n1,2\n", "line 1: it has no column `body`"),
        ("monitors.csv", b"time [s],x\n0,1\n1,2,3\n2,3\n", "line 3: it has 3 values, the line of names 2"),
        ("monitors.csv", b"time [s],x\n0,1\nsoon,3\n2,3\n", "line 3: its `time [s]` is no number"),
        ("monitors.csv", b"time [s],\xff\n", "line 1: it is no text in UTF-8"),
        ("gauges.csv", b"time [s],x\n0,1\n1,\xff\n2,1\n", "line 3: it is no text in UTF-8"),
    ] {
        let file = root.join(name);
        let own = std::fs::read(&file).ok();
        std::fs::write(&file, held).unwrap();
        for args in
            [&["report", &out, "-q", "--pictures", "0"][..], &["compare-runs", &other, &out, "-o", &page]]
        {
            let told = ran(args);
            let words = [&format!("{name}: {words}"), "move it away"];
            assert!(told.code == 5 && words.iter().all(|w| told.err.contains(*w)), "{args:?}: {}", told.err);
        }
        match own {
            Some(own) => std::fs::write(&file, own).unwrap(),
            None => std::fs::remove_file(&file).unwrap(),
        }
    }
    // A run in progress may be in the middle of its last row.
    let file = root.join("monitors.csv");
    let own = std::fs::read(&file).unwrap();
    std::fs::write(&file, &own[..own.len() - 9]).unwrap();
    assert_eq!(ran(&["report", &out, "-q", "--pictures", "0"]).code, 0);
}
