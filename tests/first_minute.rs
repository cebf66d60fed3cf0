//! The first minute with the program: a case to begin with, one from a pipe, completions, no word that is not its own.

use crate::cli::{json, ran, seixo};

const STARTERS: [&str; 4] = ["dam-break", "floating-body", "sliding-block", "flume"];

#[test]
fn every_case_to_begin_with_fits_its_lattice_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    for name in STARTERS {
        let run = |args: &[&str]| {
            let output = seixo().current_dir(folder.path()).args(args).output().unwrap();
            let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
            (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
        };
        let file = format!("{name}.toml");
        let (code, out, err) = run(&["init", name]);
        assert!(code == 0 && out.contains(&format!("`seixo run {file}`")), "{out}{err}");
        let again = run(&["init", name]);
        assert!(again.0 == 2 && again.2.contains("is there already"), "{}", again.2);
        // No length is rounded and nothing is warned of.
        let (code, _, err) = run(&["plan", &file]);
        assert!(code == 0 && !err.contains("becomes") && !err.contains("warning"), "{name}: {err}");
        let (code, out, err) = run(&["run", &file, "--backend", "cpu", "--steps", "40", "--json", "-q"]);
        assert_eq!((code, err.as_str()), (0, ""), "{name}");
        assert_eq!(json(&out)["verdict"]["grade"], "fine", "{name}: {out}");
        assert!(folder.path().join("out").join(name).join("case.toml").exists());
    }
    assert_eq!(ran(&["init", "dambreak"]).code, 2);
}

#[test]
fn many_bodies_are_not_told_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut text =
        "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\ngravity = [0, 0, -10]\n[contact]\nspring = 1e4\n\
                    [[obstacle]]\nname = \"ground\"\nmin = [0, 0, -0.1]\nmax = [1, 0.5, 0]\n"
            .to_owned();
    for k in 0..25 {
        let center = [0.1 * f64::from(k % 5) + 0.1, 0.1 * f64::from(k / 5) + 0.05, 0.1];
        text += &format!(
            "[[body]]\nname = \"wedge {k}\"\nshape = \"wedge\"\nsize = [0.08, 0.03, 0.06]\ncenter = {center:?}\n\
             density = {}\n",
            500 + k
        );
    }
    std::fs::write(folder.path().join("heap.toml"), text).unwrap();
    let args = ["run", "heap.toml", "--backend", "cpu", "--steps", "1"];
    let output = seixo().current_dir(folder.path()).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{err}");
    assert_eq!(err.matches("less than two particles").count(), 3, "{err}");
    assert!(err.contains("note: 22 more like these"), "{err}");
    assert_eq!(out.matches(": at (").count(), 20, "{out}");
    assert!(out.contains("5 more bodies: in result.json"), "{out}");
}

#[test]
fn of_many_problems_the_first_are_told() {
    let mut text = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 1\n[contact]\nspring = 1e4\n\
                    [[obstacle]]\nname = \"ground\"\nmin = [0, 0, -0.1]\nmax = [4, 0.5, 0]\n"
        .to_owned();
    for k in 0..30 {
        let x = 0.1 + 0.1 * f64::from(k);
        text += &format!(
            "[[body]]\nname = \"sunk {k}\"\nsize = [0.06, 0.06, 0.06]\ncenter = [{x}, 0.2, 0.02]\ndensity = 500\n"
        );
    }
    let Err(error) = text.parse::<seixo::Case>().and_then(|case| seixo::scene::Scene::build(&case)) else {
        panic!("they are in the ground");
    };
    let seixo::Error::Case(found) = &error else { panic!("{error}") };
    assert_eq!(found.problems.len(), 30);
    assert!(
        error.to_string().starts_with("30 problems at t = 0:") && error.to_string().ends_with("and 10 more"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sunk.toml"), text).unwrap();
    let output = seixo().current_dir(folder.path()).args(["plan", "sunk.toml"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), said.matches("overlaps wall").count()), (Some(2), 20), "{said}");
    assert!(said.contains("and 10 more"), "{said}");
}

#[test]
fn a_case_comes_from_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let text = ran(&["init", "dam-break", "-"]).out;
    let run = |text: &[u8]| {
        let args = ["run", "-", "--backend", "cpu", "--steps", "2", "-q", "--spacing", "0.02"];
        let output =
            seixo().current_dir(folder.path()).args(args).write_stdin(text.to_vec()).output().unwrap();
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(run(text.as_bytes()), (0, String::new()));
    assert!(folder.path().join("out/stdin/stdin.pvd").exists());
    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    // Its text is there once, also where a coarser scene stands for it.
    for spacing in ["0.02", "0.00007"] {
        let args = ["plan", "-", "--json", "--spacing", spacing];
        let output = seixo().args(args).write_stdin(text.clone()).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "");
        assert_eq!(json(&String::from_utf8_lossy(&output.stdout))["spacing_m"].to_string(), spacing);
    }
    let (code, err) = run(text.replace("spacing", "spacin").as_bytes());
    assert!(code == 2 && err.contains("--> standard input:"), "{err}");
    let (code, err) = run(b"\xff\xfe");
    assert!(code == 2 && err.contains("UTF-8"), "{err}");
}

#[test]
fn shells_and_man_know_the_program() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = ran(&["completions", shell]);
        assert!(script.code == 0 && script.out.contains("max-wall"), "{shell}");
    }
    assert!(ran(&["man"]).out.contains(".TH seixo 1"));
    let folder = tempfile::tempdir().unwrap();
    let pages = ran(&["man", "--out", &folder.path().display().to_string()]);
    assert_eq!(pages.code, 0, "{}", pages.err);
    let page = std::fs::read_to_string(folder.path().join("seixo-run.1")).unwrap();
    assert!(page.contains("max\\-wall"), "{page}");
}

/// Where no desktop session runs, a layer of Mesa's speaks up on its own.
#[cfg(target_os = "linux")]
#[test]
fn nobody_else_speaks_on_stderr() {
    let mut command = seixo();
    let output = command.env_remove("XDG_RUNTIME_DIR").args(["adapters", "--json"]).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    json(&String::from_utf8_lossy(&output.stdout));
}

#[test]
fn a_run_says_what_plan_says_where_there_is_something_to_change() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out").display().to_string();
    let run = |step: &str| {
        let set = format!("run.time_step={step}");
        let more = ["--set", "run.adaptive=false", "--set", &set, "--spacing", "0.02", "--steps", "1"];
        let args = ["run", "cases/dam_break_2d.toml", "-o", &out, "--backend", "cpu", "--force"];
        ran(&[&args[..], &more].concat()).err
    };
    assert!(
        run("8e-3").contains("the fixed time step is above that; set run.time_step ="),
        "{}",
        run("8e-3")
    );
    assert!(!run("1e-3").contains("time step"), "{}", run("1e-3"));
}

#[test]
fn bench_without_a_case_says_what_to_time() {
    let folder = tempfile::tempdir().unwrap();
    let told = seixo().current_dir(folder.path()).arg("bench").output().unwrap();
    let err = String::from_utf8_lossy(&told.stderr);
    let words = ["name the case to time, `seixo bench CASE", "seixo init"];
    assert!(told.status.code() == Some(2) && words.iter().all(|w| err.contains(w)), "{err}");
}
