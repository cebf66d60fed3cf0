//! Mutated cases and states: whatever is in them, nothing but a result or an error that says what to do.
//!
//! Mutants follow from a seed and know the structure of a case. A few hundred are tried in every test run, and the
//! corpus of past failures (`tests/corpus`) is replayed. A campaign against the program, in a process each:
//! `SEIXO_FUZZ_SEED=7 SEIXO_FUZZ_COUNT=5000 cargo test --release --test seixo fuzz::campaign -- --ignored --nocapture`.
//! What fails is written to `target/fuzz`; once it is mended, it goes into the corpus.

/// The bodies of the `cargo fuzz` targets, which are built by hand alone.
#[path = "../fuzz/src/lib.rs"]
mod targets;

use crate::cli::seixo;
use crate::common::ROOT;
use seixo::case::file::parse;
use seixo::checkpoint::Archive;
use seixo::estimate::Estimate;
use seixo::scene::Scene;
use seixo::simulation::Simulation;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};
use toml::Value;

/// A stream of numbers that follows from its seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = self.0 ^ (self.0 >> 33);
        x.wrapping_mul(0xff51_afd7_ed55_8ccd) >> 11
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Cases to begin with: every part of the format, small enough to run.
fn seeds() -> Vec<Value> {
    let wet = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.01\ndimensions = 2\n[tank]\nmin = [0, 0, 0]\nmax = [2, 0.1, 1]\n\
        open = [\"z_max\"]\n[fluid]\nsound_speed = 5.0\nviscosity = 1e-3\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 0.1, 0.5]\n\
        [fluid.solver]\ntolerance = 1e-3\nmax_iterations = 100\n\
        [[moving_wall]]\nname = \"gate\"\nmin = [0.6, 0, 0]\nmax = [0.8, 0.1, 0.8]\nmotion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]\n\
        [[obstacle]]\nname = \"step\"\nmin = [1.0, 0, 0]\nmax = [1.2, 0.1, 0.2]\n\
        [[gauge.pressure]]\nname = \"p\"\npoint = [0.2, 0, 0]\n[[gauge.level]]\nname = \"h\"\nat = [0.2, 0]\n\
        [[gauge.force]]\nname = \"f\"\non = \"gate\"\n[output]\nevery = 0.005\ntable_every = 0.002\n";
    let dry = "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 0.01\n[tank]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
        [[plane]]\nname = \"ramp\"\ncenter = [0.5, 0.5, 0.2]\nnormal = [0.3, 0, 1]\nsize = [0.5, 0.5]\nalong = [1, 0, 0]\n\
        [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.5, 0.5, 0.7]\ndensity = 500.0\nvelocity = [0, 0, -1]\n\
        orientation = { axis = [1, 1, 0], angle_deg = 20 }\nlocked = [\"y\"]\n\
        [[body]]\nname = \"ball\"\nshape = \"sphere\"\nradius = 0.1\ncenter = [0.2, 0.2, 0.8]\nmass = 2.0\n\
        [contact]\nlaw = \"smooth\"\nspring = 1e4\nrestitution = 0.4\nfriction = 0.3\n";
    let both = "[run]\nspacing = 0.05\ntime_step = 2e-3\nadaptive = true\nend = 0.01\ngravity = [0, 0, -9.81]\n\
        [tank]\nmin = [0, 0, 0]\nmax = [0.6, 0.4, 0.6]\nopen = [\"z_max\"]\n\
        [fluid]\npreset = \"paper\"\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.6, 0.4, 0.2]\n\
        [[body]]\nname = \"float\"\nsize = [0.2, 0.2, 0.1]\ncenter = [0.3, 0.2, 0.2]\ndensity = 500.0\ndisplaces_fluid = true\n\
        [contact]\nlaw = \"paper\"\nspring = 1e4\ndamping = 10.0\n";
    [wet, dry, both].map(|text| Value::Table(toml::from_str(text).unwrap())).to_vec()
}

/// Numbers that break things.
fn number(random: &mut Random, old: f64) -> f64 {
    const ODD: [f64; 22] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        5e-324,
        f64::MIN_POSITIVE,
        f64::MAX,
        -f64::MAX,
        1e-12,
        1e-6,
        1e6,
        1e9,
        1e12,
        1e19,
        1e300,
        -1e9,
        4_294_967_296.0,
        2_147_483_648.0,
        0.5,
    ];
    match random.below(4) {
        0 => old * 10f64.powi(random.below(13) as i32 - 6),
        1 => -old,
        2 => old * (0.5 + random.below(1000) as f64 / 1000.0),
        _ => ODD[random.below(ODD.len())],
    }
}

/// Places of a tree, to change one.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Table(table) => table.values().map(count).sum(),
        Value::Array(items) => items.iter().map(count).sum(),
        _ => 0,
    }
}

fn at<'a>(value: &'a mut Value, place: &mut usize) -> Option<&'a mut Value> {
    if *place == 0 {
        return Some(value);
    }
    *place -= 1;
    match value {
        Value::Table(table) => table.iter_mut().find_map(|(_, v)| at(v, place)),
        Value::Array(items) => items.iter_mut().find_map(|v| at(v, place)),
        _ => None,
    }
}

fn change(random: &mut Random, value: &mut Value) {
    const WORDS: [&str; 8] = ["", "paper", "x_min", "\u{1b}[2J", "=1+1", "gate", "../../x", "\u{202e}abc\n"];
    match value {
        Value::Float(x) => *x = number(random, *x),
        Value::Integer(n) if random.below(2) == 0 => *value = Value::Float(number(random, *n as f64)),
        Value::Integer(n) => {
            *n =
                [0, -1, 1, i64::MAX, i64::MIN, 4_294_967_295, 1_000_000, n.wrapping_mul(10)][random.below(8)];
        }
        Value::String(s) => *s = WORDS[random.below(WORDS.len())].to_owned(),
        Value::Boolean(b) => *b = !*b,
        Value::Array(items) => match random.below(5) {
            0 => items.clear(),
            1 => drop(items.pop()),
            2 => items.extend(items.clone().into_iter().take(1)),
            3 => items.reverse(),
            _ => items.push(Value::Float(number(random, 1.0))),
        },
        Value::Table(table) => {
            let keys: Vec<String> = table.keys().cloned().collect();
            if let Some(key) = keys.get(random.below(keys.len())) {
                let old = table.remove(key);
                if random.below(3) == 0
                    && let Some(old) = old
                {
                    table.insert(["end", "every", "min", "density", "from"][random.below(5)].to_owned(), old);
                }
            }
        }
        Value::Datetime(_) => {}
    }
}

/// Mutant `k` of `seed`.
fn mutant(seed: u64, k: u64) -> String {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ k);
    let seeds = seeds();
    let mut value = seeds[random.below(seeds.len())].clone();
    for _ in 0..=random.below(3) {
        let mut place = random.below(count(&value) - 1) + 1;
        if let Some(found) = at(&mut value, &mut place) {
            change(&mut random, found);
        }
    }
    let mut text = toml::to_string(&value).unwrap_or_default();
    if random.below(12) == 0 && !text.is_empty() {
        // And some that are no TOML.
        let cut = (0..=random.below(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        text.truncate(cut);
    }
    text
}

/// Runs a case for two steps, as far as it comes.
fn play(text: String) -> Result<(), seixo::error::Error> {
    let (case, ..) = parse("mutant.toml", text, &[])?;
    // What the program refuses for its size.
    if Estimate::new(&case).memory_cpu > 200e6 {
        return Ok(());
    }
    let scene = Scene::build(&case)?;
    let mut simulation = on_cpu(&case, scene)?;
    for _ in 0..2 {
        simulation.step()?;
    }
    Ok(())
}

fn on_cpu(case: &seixo::case::Case, scene: Scene) -> Result<Simulation, seixo::error::Error> {
    Simulation::with_backend(case, scene, |s, p, plan, settings| {
        Ok(Box::new(seixo::backend::cpu::Cpu::new(s, p, plan, settings)?))
    })
}

#[test]
fn mutants_end_in_a_result_or_an_error_that_says_something() {
    let (mut right, mut wrong) = (0, 0);
    for k in 0..400 {
        let text = mutant(1, k);
        let clock = Instant::now();
        match play(text.clone()) {
            Ok(()) => right += 1,
            Err(error) => {
                wrong += 1;
                assert!(error.to_string().len() > 10, "{k}: {error}");
            }
        }
        assert!(clock.elapsed() < Duration::from_secs(30), "mutant {k} took {:?}:\n{text}", clock.elapsed());
    }
    assert!(right > 40 && wrong > 100, "{right} ran, {wrong} were refused: no test of either");
}

#[test]
fn the_corpus_of_past_failures_is_refused() {
    let mut files = 0;
    for entry in std::fs::read_dir(Path::new(ROOT).join("tests/corpus")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        // The first line says what the message must hold.
        let word = text.lines().next().and_then(|l| l.strip_prefix("# ")).unwrap_or_default().to_owned();
        let clock = Instant::now();
        let folder = tempfile::tempdir().unwrap();
        let output = seixo()
            .args(["run", "--backend", "cpu", "--steps", "2", "-q", "-o"])
            .arg(folder.path().join("out"))
            .arg(&path)
            .output()
            .unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{}: {err}", path.display());
        assert!(!word.is_empty() && err.contains(&word), "{}: `{word}` is not in {err}", path.display());
        assert!(clock.elapsed() < Duration::from_secs(20), "{}", path.display());
        assert!(!folder.path().join("out").exists());
        files += 1;
    }
    assert!(files >= 10, "{files}");
}

/// Whole states with something else in them: refused, or gone on with, but never a fault of the program.
#[test]
fn mutated_states_are_refused_or_run() {
    let mut refused = 0;
    for seed in seeds() {
        let text = toml::to_string(&seed).unwrap();
        let (case, ..) = parse("seed.toml", text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let scene = Scene::build(&case).unwrap();
        let mut first = on_cpu(&case, scene.clone()).unwrap();
        first.step().unwrap();
        let mut state = Archive::new();
        first.exchange(&mut state).unwrap();
        for k in 0..60 {
            let mut random = Random(k);
            let mut wrong = state.to_restore();
            if random.below(4) == 0 {
                let names: Vec<String> = wrong.numbers.keys().cloned().collect();
                wrong.numbers.insert(names[random.below(names.len())].clone(), random.next());
            } else {
                let names: Vec<String> = wrong.sections.keys().cloned().collect();
                let name = &names[random.below(names.len())];
                let section = wrong.sections.get_mut(name).unwrap();
                let n = section.bytes.len();
                match random.below(4) {
                    0 => drop(wrong.sections.remove(name)),
                    1 => section.bytes.truncate(random.below(n + 1)),
                    2 => section.bytes.extend([0; 8]),
                    _ => (0..8).for_each(|_| {
                        if n > 0 {
                            section.bytes[random.below(n)] = random.next() as u8;
                        }
                    }),
                }
            }
            let mut second = on_cpu(&case, scene.clone()).unwrap();
            refused += u32::from(second.exchange(&mut wrong).and_then(|()| second.step()).is_err());
        }
    }
    assert!(refused > 40, "{refused}");
}

#[test]
fn the_readers_of_the_fuzz_targets_take_any_bytes() {
    let mut state = Archive::new();
    let (mut values, mut count) = (vec![1.5_f64; 200], 7);
    state.array("values", &mut values, true).unwrap();
    state.count("count", &mut count).unwrap();
    let whole = seixo::checkpoint::file::encode(&Default::default(), &state).unwrap();
    let curve = b"# time, height\nt,h\n0,1\n0.5,1.25\n1,nan\n".to_vec();
    targets::checkpoint(&whole);
    targets::curve(&curve);
    for k in 0..300 {
        let mut random = Random(k);
        let mut damaged = |bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            for _ in 0..random.below(6) {
                let at = random.below(bytes.len());
                match random.below(3) {
                    0 => bytes.truncate(at + 1),
                    1 => bytes.insert(at, random.next() as u8),
                    _ => bytes[at] = random.next() as u8,
                }
            }
            bytes
        };
        targets::case(&damaged(mutant(3, k).as_bytes()));
        targets::checkpoint(&damaged(&whole));
        targets::curve(&damaged(&curve));
    }
}

/// By hand: see the head of this file.
#[test]
#[ignore = "a campaign takes minutes to hours: cargo test --release --test seixo -- --ignored fuzz"]
fn campaign() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(default);
    let (seed, count) = (number("SEIXO_FUZZ_SEED", 1), number("SEIXO_FUZZ_COUNT", 500));
    let kept = Path::new(ROOT).join("target/fuzz");
    std::fs::create_dir_all(&kept).unwrap();
    let (mut codes, mut failures) = (BTreeMap::new(), 0);
    for k in 0..count {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mutant.toml");
        std::fs::write(&path, mutant(seed, k)).unwrap();
        let run = |more: &[&str]| {
            let clock = Instant::now();
            let output = seixo()
                .args(["run", "--backend", "cpu", "--memory-limit", "2G", "-q", "-o"])
                .arg(folder.path().join("out"))
                .arg(&path)
                .args(more)
                .timeout(Duration::from_secs(60))
                .output()
                .unwrap();
            (output.status.code(), clock.elapsed(), String::from_utf8_lossy(&output.stderr).into_owned())
        };
        let mut ended = run(&["--steps", "2"]);
        let first = ended.0;
        if first == Some(0) {
            // A state with a byte changed is noticed, and the older one taken or said to be missing.
            if let Some(file) =
                std::fs::read_dir(folder.path().join("out/checkpoint")).ok().and_then(|mut d| d.next())
            {
                let file = file.unwrap().path();
                let mut bytes = std::fs::read(&file).unwrap();
                let at = Random(seed ^ k).below(bytes.len());
                bytes[at] ^= 0x55;
                std::fs::write(&file, bytes).unwrap();
            }
            ended = run(&["--steps", "4", "--resume"]);
        }
        let (code, wall, err) = ended;
        *codes.entry((first, code)).or_insert(0) += 1;
        let expected = [0, 2, 4, 5].map(Some);
        if !expected.contains(&code) || wall > Duration::from_secs(20) || err.contains("panicked") {
            failures += 1;
            eprintln!(
                "seed {seed}, mutant {k}: {code:?} after {wall:?}: {}",
                err.lines().next().unwrap_or("")
            );
            std::fs::copy(&path, kept.join(format!("{seed}-{k}.toml"))).unwrap();
        }
    }
    eprintln!(
        "seed {seed}: {count} mutants, by exit codes (run, gone on with) {codes:?}, {failures} failures in {}",
        kept.display()
    );
    assert_eq!(failures, 0);
}
