//! Errors as a program sees them: by variant and field, without reading their text.

use seixo::case::file;
use seixo::error::{CaseError, FolderError, GpuError};
use seixo::output::folder::{Folder, Mode};
use seixo::{Case, Error, Options, Processor, Simulation};

const SOUND: &str = r#"
[run]
spacing = 0.05
time_step = 1e-3
end = 0.1
[tank]
min = [0, 0, 0]
max = [0.5, 0.5, 0.5]
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.5, 0.5, 0.2]
"#;

fn refusal(text: &str) -> CaseError {
    let opened = file::parse("my.toml", text.to_owned(), &[])
        .and_then(|(case, ..)| Simulation::open(&case, &Options::default()).map(|_| ()));
    match opened {
        Err(Error::Case(why)) => why,
        other => panic!("expected a refused case, got {other:?}"),
    }
}

#[test]
fn each_problem_of_a_case_has_its_file_line_and_key() {
    let why = refusal(&SOUND.replace("0.05", "-0.05").replace("end = 0.1", "end = inf"));
    let mut found: Vec<_> =
        why.problems.iter().map(|p| (p.key.as_str(), p.file.as_deref(), p.line, p.column)).collect();
    found.sort();
    assert_eq!(
        found,
        [("run.end", Some("my.toml"), Some(5), Some(1)), ("run.spacing", Some("my.toml"), Some(3), Some(1))]
    );
    assert!(why.problems.iter().all(|p| !p.warning && !p.remedy.is_empty()), "{:?}", why.problems);
}

#[test]
fn what_the_reader_of_the_file_finds_has_its_line_as_well() {
    let unknown = refusal(&SOUND.replace("time_step", "time_stop"));
    assert_eq!((unknown.problems[0].key.as_str(), unknown.problems[0].line), ("run.time_stop", Some(4)));
    assert!(unknown.problems[0].remedy.contains("time_step"), "{:?}", unknown.problems);
    let broken = refusal(&SOUND.replace("[tank]", "[tank"));
    assert_eq!((broken.problems[0].key.as_str(), broken.problems[0].line), ("", Some(6)));
}

#[test]
fn what_is_wrong_at_the_start_names_its_key() {
    let why = refusal(&SOUND.replace("max = [0.5, 0.5, 0.5]", "max = [0.5, 0.5, 0.5]\nopen = [\"x_max\"]"));
    assert_eq!(why.problems[0].key, "tank.open");
    let body = "[[body]]\nname = \"cube\"\nsize = [0.2, 0.2, 0.2]\ncenter = [0.25, 0.25, 0.15]\ndensity = 500\n\
                [contact]\nlaw = \"paper\"\nspring = 1e3\n";
    let why = refusal(&format!("{SOUND}{body}"));
    assert_eq!(why.problems[0].key, "body.0.displaces_fluid");
    let forced =
        body.replace("1e3", "1e9\nsubsteps = 1").replace("density", "displaces_fluid = true\ndensity");
    let why = refusal(&format!("{SOUND}{forced}"));
    assert_eq!(why.problems[0].key, "contact.substeps");
}

#[test]
fn an_adapter_that_is_not_there_is_told_from_one_that_failed() {
    let case: Case = SOUND.parse().expect("sound");
    let processor = Processor::Gpu { adapter: Some("no adapter has this name".into()) };
    let opened = Simulation::open(&case, &Options { processor, ..Options::default() });
    assert!(matches!(opened, Err(Error::Gpu(GpuError::NoAdapter(_)))), "{:?}", opened.err());
}

#[test]
fn a_folder_that_cannot_be_used_says_which_and_why() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("letter.txt"), "dear").expect("written");
    let of = |mode| Folder::open(folder.path(), "x", mode, &[]).expect_err("refused");
    let root = folder.path().to_path_buf();
    // No mode would take it, so none is advised.
    for mode in [Mode::New, Mode::Replace] {
        assert!(matches!(of(mode), Error::Folder(FolderError::Foreign { folder, .. }) if folder == root));
    }
    std::fs::write(folder.path().join(".seixo"), "{}").expect("written");
    assert!(matches!(of(Mode::New), Error::Folder(FolderError::NotEmpty(at)) if at == root));
}
