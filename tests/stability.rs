//! Extreme scenes: none hangs, panics, keeps a number that is none, or loses particles uncounted.

use seixo_study::definition::Setup;
use seixo_study::engine::{Context, Options, cpu_only};
use seixo_study::row::{Class, Row};
use seixo_study::{builtin, stability_contact};

fn rows(name: &str, keep: impl Fn(&str) -> bool) -> Vec<Row> {
    crate::common::alone();
    let mut study = builtin::find(name, &Setup::default()).expect("the study is built in");
    study.jobs.retain(|job| keep(&job.method));
    assert!(!study.jobs.is_empty());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = Options { out: folder.path().into(), quiet: true, ..Options::default() };
    let context = Context { repetitions: 1, ..Context::new(&cpu_only) };
    let (rows, _) = study.run(&options, &context, None).expect("the study runs");
    assert_eq!(rows.len(), study.jobs.len());
    rows
}

#[test]
fn every_extreme_scene_ends_as_it_must() {
    let rows = rows("gallery", |_| true);
    let wrong: Vec<String> = rows
        .iter()
        .filter(|r| r.measured.class != Class::Ok)
        .map(|r| format!("{}: {}", r.method, r.measured.reason))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(rows.len() >= 40);
}

#[test]
fn what_a_scene_leaves_out_changes_no_bit() {
    for row in rows("needs", |_| true) {
        assert_eq!(row.measured.class, Class::Ok, "{}: {}", row.method, row.measured.reason);
        assert!(row.measured.value("numbers compared [-]").is_some_and(|n| n > 0.0), "{}", row.method);
    }
}

#[test]
fn the_bare_contact_step_ends_where_theory_says() {
    for row in rows("stability", |method| method == "bare contact step") {
        let (limit, theory) = (row.measured.value("limit [-]"), row.measured.value("theory [-]"));
        let (limit, theory) = (limit.expect("a limit"), theory.expect("a theory"));
        assert!((limit / theory - 1.0).abs() < 2e-3, "{}: {limit} for {theory}", row.setting());
    }
    assert!((stability_contact::theory(0.0) - 2.0).abs() < 1e-12);
}

#[test]
fn a_contact_step_is_stable_or_refused() {
    for row in rows("stability", |method| method == "contact") {
        let (omega_dt, zeta) =
            (row.number("omega_dt").expect("a number"), row.number("zeta").expect("a number"));
        let allowed = omega_dt <= 1.0 && omega_dt < stability_contact::theory(zeta);
        let expected = if allowed { Class::Ok } else { Class::Failed };
        assert_eq!(row.measured.class, expected, "{}: {}", row.setting(), row.measured.reason);
    }
}

#[test]
fn viscosity_is_refused_before_it_grows() {
    for row in rows("stability", |method| method == "largest nu dt / l0^2") {
        let (limit, theory) = (row.measured.value("limit [-]"), row.measured.value("theory [-]"));
        let (limit, theory) = (limit.expect("a limit"), theory.expect("a theory"));
        assert!(limit >= theory, "{}: grows from {limit} on, refused from {theory} on", row.setting());
    }
}
