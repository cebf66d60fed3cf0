//! The guide is true: its cases are planned, its commands run (each run for three steps), its links lead somewhere.

use crate::cli::seixo;
use crate::common::ROOT;
use seixo::case::Case;
use seixo_study::definition::Definition;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Where the fragments of the guide stand in: water 0.3 m deep in an open tank of 1 x 0.4 x 0.6 m.
const AROUND: &str = r#"
[run]
spacing = 0.02
time_step = 1e-3
adaptive = true
end = 1.0
[tank]
min = [0.0, 0.0, 0.0]
max = [1.0, 0.4, 0.6]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0.14, 0.0, 0.0]
max = [1.0, 0.4, 0.3]
[contact]
spring = 2e4
"#;

/// What a validation needs beside what the guide shows of one.
const STUDY: &str = "name = \"some\"\ntitle = \"\"\ncase = \"some.toml\"\nmethod = \"\"\n";

/// A block of a page: its language, its text, the line that it begins in.
struct Block {
    language: String,
    text: String,
    line: usize,
}

fn docs() -> PathBuf {
    Path::new(ROOT).join("docs")
}

/// The pages of the book.
fn pages() -> Vec<String> {
    let summary = std::fs::read_to_string(docs().join("SUMMARY.md")).expect("readable");
    let names = summary.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    names.map(str::to_owned).collect()
}

fn read(page: &str) -> String {
    std::fs::read_to_string(docs().join(page)).unwrap_or_else(|e| panic!("{page}: {e}"))
}

fn blocks(text: &str) -> Vec<Block> {
    let (mut blocks, mut open) = (Vec::new(), None::<Block>);
    for (k, line) in text.lines().enumerate() {
        match (line.trim_start().strip_prefix("```"), open.take()) {
            (Some(language), None) => {
                open = Some(Block { language: language.trim().to_owned(), text: String::new(), line: k + 1 });
            }
            (Some(_), Some(block)) => blocks.push(block),
            (None, Some(mut block)) => {
                block.text += line;
                block.text.push('\n');
                open = Some(block);
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block does not end");
    blocks
}

/// The name of the file that a block says it is: `# ball.toml` in its first lines.
fn file_name(block: &Block) -> Option<&str> {
    let comments = block.text.lines().take(2).filter_map(|line| line.strip_prefix("# "));
    comments.filter_map(|c| c.split([' ', ':']).next()).find(|name| {
        let extension = Path::new(name).extension().and_then(|e| e.to_str());
        extension.is_some_and(|e| ["toml", "csv"].contains(&e))
    })
}

/// The words of a command, as a shell sees them: quotes, comments; `$X`, also in braces, is 1.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        match (c, quote) {
            ('#', None) if word.is_none() => break,
            (' ' | '\t', None) => words.extend(word.take()),
            ('\'' | '"', None) => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (c, Some(q)) if c == q => quote = None,
            ('$', None | Some('"')) => {
                while chars.next_if(|&c| c.is_ascii_alphanumeric() || "_{}[]".contains(c)).is_some() {}
                word.get_or_insert_default().push('1');
            }
            (c, _) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// The commands of the program in a block, without its name.
fn commands(text: &str) -> Vec<Vec<String>> {
    let joined = text.replace("\\\n", " ");
    let launched =
        |line: &'_ str| ["mpirun ", "srun "].into_iter().any(|launcher| line.starts_with(launcher));
    let plain = joined.lines().map(|line| line.trim_start().trim_start_matches("$ ").to_owned());
    let lines = plain.map(|line| match line.find(" seixo ") {
        Some(at) if launched(&line) => line[at + 1..].to_owned(),
        _ => line,
    });
    let own = lines.filter(|line| line.starts_with("seixo "));
    own.map(|line| words(&line).split_off(1)).collect()
}

/// What a case that a page shows needs beside it.
fn lay_out(folder: &Path) {
    // A cube of 100 mm.
    let at = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 100.0 } else { 0.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = String::from("solid cube\n");
    for [a, b, c, d] in faces {
        for corners in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in corners.map(at) {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
    }
    std::fs::write(folder.join("hull.stl"), text + "endsolid cube\n").expect("writable");
}

/// Puts the values of `over` into `under`.
fn merge(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

fn run_in(folder: &Path, args: &[String], at: &str) {
    let output = seixo().current_dir(folder).args(args).output().expect("the program starts");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{at}: seixo {}\n{out}\n{err}", args.join(" "));
}

fn check_toml(folder: &Path, block: &Block, at: &str) {
    let table: toml::Table = block.text.parse().unwrap_or_else(|e| panic!("{at}: {e}"));
    if ["measure", "axis", "check"].iter().any(|key| table.contains_key(*key)) {
        let mut whole: toml::Table = STUDY.parse().expect("sound");
        merge(&mut whole, table);
        let text = toml::to_string(&whole).expect("TOML");
        Definition::parse(at, &text).unwrap_or_else(|e| panic!("{at}: {e}"));
        return;
    }
    let text = if table.contains_key("run") && table.contains_key("output") {
        block.text.clone()
    } else {
        let mut whole: toml::Table = AROUND.parse().expect("sound");
        merge(&mut whole, table);
        toml::to_string(&whole).expect("TOML")
    };
    let file = folder.join("shown.toml");
    std::fs::write(&file, text).expect("writable");
    run_in(folder, &["plan".into(), "shown.toml".into()], at);
}

/// The program understands `args`, which are not carried out: what comes before `--help` has been read when it is met.
fn understood(args: &[String], at: &str) {
    let asked: Vec<String> = args.iter().cloned().chain(["--help".into()]).collect();
    run_in(Path::new(ROOT), &asked, at);
}

/// Tries a page; commands of `sh` are run, those of other languages read.
fn try_page(page: &str) -> (usize, usize) {
    let folder = tempfile::tempdir().expect("a folder");
    lay_out(folder.path());
    let (mut cases, mut tried) = (0, 0);
    for block in blocks(&read(page)) {
        let at = format!("docs/{page}:{}", block.line);
        if let Some(name) = file_name(&block) {
            std::fs::write(folder.path().join(name), &block.text).expect("writable");
        }
        match block.language.as_str() {
            "toml" => {
                check_toml(folder.path(), &block, &at);
                cases += 1;
            }
            "sh" => {
                for mut args in commands(&block.text) {
                    if args[0] == "run" {
                        args.extend(["--steps", "3", "--quiet"].map(str::to_owned));
                    }
                    run_in(folder.path(), &args, &at);
                    tried += 1;
                }
            }
            _ => {
                for args in commands(&block.text) {
                    understood(&args, &at);
                    tried += 1;
                }
            }
        }
    }
    (cases, tried)
}

macro_rules! pages {
    ($($name:ident $page:literal $cases:literal $commands:literal;)*) => {
        $(#[test] fn $name() {
            let (cases, commands) = try_page($page);
            let enough = cases.checked_sub($cases).is_some() && commands.checked_sub($commands).is_some();
            assert!(enough, "{cases} cases, {commands} commands");
        })*

        #[test]
        fn every_page_is_tried() {
            let tried: BTreeSet<&str> = [$($page),*].into();
            for page in pages() {
                let holds = blocks(&read(&page)).iter().any(|b| b.language == "toml" || !commands(&b.text).is_empty());
                assert!(!holds || tried.contains(page.as_str()), "{page} is not tried");
            }
        }
    };
}

pages! {
    the_tutorial "tutorial.md" 1 12;
    how_to_measure "howto-gauges.md" 1 4;
    how_to_put_in_bodies "howto-bodies.md" 3 3;
    how_to_make_waves "howto-waves.md" 5 0;
    how_to_let_water_in "howto-inflow.md" 3 0;
    how_to_restart "howto-restart.md" 1 5;
    how_to_sweep "howto-cluster.md" 1 5;
    how_to_use_ranks "howto-ranks.md" 0 8;
    how_to_look "howto-look.md" 1 6;
    from_dualsphysics "dualsphysics.md" 1 0;
    the_shapes "shapes.md" 1 0;
    the_studies "studies.md" 2 6;
    the_validation "validation.md" 0 4;
}

#[test]
fn the_commands_of_the_readme_are_understood() {
    let text = std::fs::read_to_string(Path::new(ROOT).join("README.md")).expect("readable");
    let all: Vec<Vec<String>> = blocks(&text).iter().flat_map(|b| commands(&b.text)).collect();
    assert!(all.len() >= 4, "{all:?}");
    all.iter().for_each(|args| understood(args, "README.md"));
}

#[test]
fn pages_of_the_book_are_there_and_links_lead_somewhere() {
    let listed: BTreeSet<String> = pages().into_iter().collect();
    assert!(listed.len() > 12, "{listed:?}");
    for page in &listed {
        for link in read(page).split("](").skip(1).filter_map(|rest| rest.split([')', ' ']).next()) {
            let file = link.split('#').next().unwrap_or_default();
            let outside = link.contains("://");
            assert!(outside || file.is_empty() || docs().join(file).exists(), "{page}: nothing at {link}");
            let (within, place) = (if file.is_empty() { page } else { file }, link.split('#').nth(1));
            if let Some(place) = place.filter(|_| !outside && within.ends_with(".md")) {
                let marked = read(within).contains(&format!("id=\"{place}\""));
                assert!(marked || headings(within).contains(place), "{page}: no heading for {link}");
            }
        }
    }
}

/// Names of the headings of a page, as links call them.
fn headings(page: &str) -> BTreeSet<String> {
    let text = read(page);
    let titles =
        text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    titles.map(|t| t.chars().filter(kept).collect::<String>().to_lowercase().replace(' ', "-")).collect()
}

#[test]
fn keys_of_the_table_for_dualsphysics_exist() {
    let schema: serde_json::Value = serde_json::from_str(Case::schema()).expect("JSON");
    let text = schema.to_string();
    let mut tried = 0;
    for line in read("dualsphysics.md").lines().filter(|line| line.starts_with("| ")).skip(1) {
        let ours = line.split('|').nth(2).unwrap_or_default();
        for key in ours
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|code| !code.starts_with("seixo "))
            .flat_map(|code| code.split([' ', '.', '[', ']', '=', '"', ',']))
        {
            let word = !key.is_empty() && key.chars().all(|c| c.is_ascii_lowercase() || c == '_');
            if word && !["csv", "true"].contains(&key) && !ours.contains(&format!("{key}.csv")) {
                assert!(text.contains(&format!("\"{key}\"")), "{line}: no key or name `{key}`");
                tried += 1;
            }
        }
    }
    assert!(tried > 40, "{tried}");
}

#[test]
fn words_are_those_of_a_shell() {
    let found = words(r#"run "a b" --set 'x=[1, 2]' -o "out/$X" --n ${Y[2]}  # that is all"#);
    assert_eq!(found, ["run", "a b", "--set", "x=[1, 2]", "-o", "out/1", "--n", "1"]);
    assert_eq!(commands("$ seixo plan a\nsrun seixo run \\\n  b # c\necho seixo\n").len(), 2);
}
