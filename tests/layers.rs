//! The imports between the solver's modules are those that docs/architecture.md draws: each sees lower layers only, so
//! that there are no circles.

use crate::common::ROOT;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("src is readable").map(|e| e.expect("an entry").path()) {
        if entry.is_dir() {
            sources(&entry, out);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            out.push(entry);
        }
    }
}

/// Modules that `text` imports: what follows `crate::`, outside of comments and of the unit tests at the file's end.
fn imports(text: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code: Vec<&str> = lines.collect();
    let code = code.join("\n");
    let word = |s: &str| s.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect::<String>();
    let mut out = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            // `use crate::{a, b::c}`
            Some(list) => {
                let list = list.split('}').next().unwrap_or_default();
                out.extend(list.split(',').map(|item| word(item.trim())));
            }
            None => _ = out.insert(word(rest)),
        }
    }
    out.remove("");
    out
}

/// What each module of the solver imports.
fn graph() -> BTreeMap<String, BTreeSet<String>> {
    let root = Path::new(ROOT).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in files {
        let inside = file.strip_prefix(&root).expect("a file of src");
        let first = inside.components().next().expect("a name").as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs").to_string();
        if module != "lib" {
            let text = std::fs::read_to_string(&file).expect("readable");
            graph
                .entry(module.clone())
                .or_default()
                .extend(imports(&text).into_iter().filter(|m| *m != module));
        }
    }
    graph
}

#[test]
fn modules_import_lower_layers_only() {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/architecture.md")).expect("readable");
    let block = text.split("```layers\n").nth(1).and_then(|rest| rest.split("```").next());
    let block = block.expect("docs/architecture.md has a block of layers");
    // Topmost first: the name of a layer, then its modules.
    let mut layer = BTreeMap::new();
    for (k, line) in block.lines().enumerate() {
        let modules = line.split_once(':').expect("layer: modules").1;
        for module in modules.split_whitespace() {
            assert!(layer.insert(module.to_string(), k).is_none(), "{module} stands in two layers");
        }
    }
    let graph = graph();
    assert!(graph.len() > 20, "the modules were found: {graph:?}");
    let mut wrong = Vec::new();
    for (module, imports) in &graph {
        let Some(&own) = layer.get(module) else {
            wrong.push(format!("{module} stands in no layer"));
            continue;
        };
        for import in imports {
            match layer.get(import) {
                None if graph.contains_key(import) => wrong.push(format!("{import} stands in no layer")),
                Some(&other) if other <= own => wrong.push(format!("{module} imports {import}")),
                _ => {}
            }
        }
    }
    for module in layer.keys().filter(|m| !graph.contains_key(*m)) {
        wrong.push(format!("docs/architecture.md draws {module}, which src does not have"));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_files_to_touch_exist() {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/architecture.md")).expect("readable");
    let rows = text.split("## To add").nth(1).expect("docs/architecture.md says what to touch");
    let named = rows.split('`').skip(1).step_by(2).filter(|word| word.contains(['/', '.']));
    let missing: Vec<&str> = named
        .filter(|path| !path.contains(char::is_uppercase) && !path.contains('*'))
        .filter(|path| !["", "src"].iter().any(|folder| Path::new(ROOT).join(folder).join(path).exists()))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn imports_are_found_in_every_form() {
    let text = "use crate::case::Case;\nuse crate::{body, scene::Scene};\n// crate::comment\nlet x = crate::plan::Plan;\n\
                #[cfg(test)]\nmod tests { use crate::unit; }\n";
    let found: Vec<String> = imports(text).into_iter().collect();
    assert_eq!(found, ["body", "case", "plan", "scene"]);
}
