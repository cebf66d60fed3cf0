//! The studies that come with the program.

use super::definition::{Definition, Files, Setup};
use super::{
    Study, cases, compare, contact_cost, contact_hard, contact_random, contact_repose, dry_studies, gallery,
    needs, pressure_size, pressure_solve, stability, wall_of_cubes, work_precision,
};
use seixo::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// A built-in study: name, what it asks, in one line.
pub struct Entry {
    /// Name on the command line.
    pub name: &'static str,
    /// What it asks.
    pub about: &'static str,
    make: Maker,
}

enum Maker {
    /// A study file of the program's cases.
    File(&'static str),
    /// A function.
    Function(fn(&Setup) -> Study),
}

/// All built-in studies.
pub const ENTRIES: &[Entry] = &[
    Entry {
        name: "hydrostatic",
        about: "water at rest: pressure, sensor noise, spurious motion, volume against run time",
        make: Maker::File("hydrostatic.toml"),
    },
    Entry {
        name: "dam-break",
        about: "front and energy of a dam break over spacing, preset, tolerance and sound speed",
        make: Maker::File("dam_break.toml"),
    },
    Entry {
        name: "dam-break-2d",
        about: "front of a dam break in two dimensions against three experiments",
        make: Maker::File("dam_break_2d.toml"),
    },
    Entry {
        name: "floating-cube",
        about: "draft of a floating cube against Archimedes' law",
        make: Maker::File("floating_cube.toml"),
    },
    Entry { name: "precision", about: "GPU in f32 against CPU in f64", make: Maker::File("precision.toml") },
    Entry {
        name: "pressure-solve",
        about: "the pressure equation alone: residual and pressure error against iterations and time",
        make: Maker::Function(pressure_solve::study),
    },
    Entry {
        name: "pressure-size",
        about: "the pressure equation over its size: iterations and time of both preconditioners, what f32 reaches",
        make: Maker::Function(pressure_size::study),
    },
    Entry {
        name: "stability",
        about: "maps of what is stable: gamma x CFL, contact stiffness x damping, alpha, density ratio, tolerance",
        make: Maker::Function(stability::study),
    },
    Entry {
        name: "gallery",
        about: "extreme scenes: what must happen and what does",
        make: Maker::Function(gallery::study),
    },
    Entry {
        name: "needs",
        about: "what a scene does not need: stages left out, bytes and time saved, identical results",
        make: Maker::Function(needs::study),
    },
    Entry {
        name: "free-fall",
        about: "a cube falls and bounces: height of return against the time step",
        make: Maker::Function(dry_studies::free_fall),
    },
    Entry {
        name: "oscillator",
        about: "a cube on its contact spring against the damped oscillator",
        make: Maker::Function(dry_studies::oscillator),
    },
    Entry {
        name: "incline",
        about: "a block on a slope against Eq. (21); eta(mu) of the paper's law",
        make: Maker::Function(dry_studies::incline),
    },
    Entry {
        name: "spring-static",
        about: "section 4.1: amplitude of a resting cube against K",
        make: Maker::Function(dry_studies::spring_static),
    },
    Entry {
        name: "wall-of-cubes",
        about: "100 cubes hit by a heavy one: overlap during the hit and at rest against K",
        make: Maker::Function(wall_of_cubes::study),
    },
    Entry {
        name: "spring-drop",
        about: "section 4.1: K_ideal of Table 1, and the three models of Fig. 6",
        make: Maker::Function(dry_studies::spring_drop),
    },
    Entry {
        name: "contact-cost",
        about: "what contact costs a step for 1 to 1000 bodies, on the host and on a device",
        make: Maker::Function(contact_cost::study),
    },
    Entry {
        name: "contact-hard",
        about: "contact where it was wrong: each fault against its analytic answer, on the host and on a device",
        make: Maker::Function(contact_hard::study),
    },
    Entry {
        name: "contact-random",
        about: "random scenes of solids: energy never rises, nothing goes through a wall, the same bits twice",
        make: Maker::Function(contact_random::study),
    },
    Entry {
        name: "contact-repose",
        about: "the angle of repose of 500 balls against the coefficient of friction",
        make: Maker::Function(contact_repose::study),
    },
];

/// The built-in study `name`; with what the command line adds.
///
/// # Errors
/// [`Error::Usage`] if there is none of that name, or for an override that fits nothing.
pub fn find(name: &str, setup: &Setup) -> Result<Study> {
    let Some(entry) = ENTRIES.iter().find(|e| e.name == name) else {
        let mut names: Vec<&str> = ENTRIES.iter().map(|e| e.name).collect();
        names.sort_by_key(|n| std::cmp::Reverse((strsim::jaro_winkler(n, name) * 1e6) as u64));
        let hint = names.first().filter(|n| strsim::jaro_winkler(n, name) > 0.8);
        let hint = hint.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
        names.sort_unstable();
        let names = names.join(", ");
        let text = format!("no study file and no built-in study is called `{name}`{hint}\nbuilt in: {names}");
        return Err(Error::usage("study", text));
    };
    match entry.make {
        Maker::File(file) => {
            let files = |file: &str| cases::text("study", file);
            from_file(name, &cases::text("study", file)?, &files, Path::new(""), setup)
        }
        Maker::Function(make) if setup.sets.is_empty() => Ok(make(setup)),
        Maker::Function(_) => {
            Err(Error::usage("--set", format!("`{name}` sets up its own scenes: --set does not apply")))
        }
    }
}

/// A study from the text of a file that lies in `folder`.
///
/// # Errors
/// [`Error::Case`] for what is wrong with it.
pub fn from_file(name: &str, text: &str, files: &Files, folder: &Path, setup: &Setup) -> Result<Study> {
    let definition = Definition::parse(name, text)?;
    let jobs = definition.jobs(files, folder, setup)?;
    // References are read before anything runs: a sweep must not end in a missing file.
    let references = references(&definition, files)?;
    Ok(Study { jobs, ..of_points(definition, references) })
}

/// The texts of the files that a study is held against, by name.
///
/// # Errors
/// Those of `files`.
pub fn references(definition: &Definition, files: &Files) -> Result<BTreeMap<String, String>> {
    let named = definition.error.iter().filter_map(|e| e.against.as_ref()).filter(|a| *a != "finest");
    named.map(|against| Ok((against.clone(), files(against)?))).collect()
}

/// What `definition` makes of points that are there: a study with none to compute.
pub fn of_points(definition: Definition, references: BTreeMap<String, String>) -> Study {
    let (name, title, question) =
        (definition.name.clone(), definition.title.clone(), definition.question.clone());
    let finish = Box::new(move |rows: &mut [super::row::Row], wanted| {
        let read = |file: &str| {
            references
                .get(file)
                .cloned()
                .ok_or_else(|| Error::key("error.against", format!("no reference `{file}`"), ""))
        };
        compare::curves(&definition, rows, &read)?;
        // A point has held what it measured against them; the errors of its curves are new.
        rows.iter_mut().for_each(|row| definition.hold(&mut row.measured));
        let errors: Vec<String> = definition.error.iter().map(|e| e.name()).collect();
        let scenes = definition.scene_axes();
        let mut report =
            work_precision::report((&definition.name, &definition.title), rows, &errors, &scenes, wanted);
        report.charts.extend(compare::charts(&definition, rows, &read)?);
        report.findings.extend(definition.idle_errors(rows.iter()));
        report.findings.extend(definition.idle_limits(rows.iter()));
        report.findings.extend(definition.idle_results(rows.iter()));
        Ok(report)
    });
    Study { name, title, question, jobs: Vec::new(), finish }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Row;

    #[test]
    fn each_scene_has_a_finest_row_of_its_own() {
        let text = "name = 's'\ntitle = 't'\nmethod = 'm'\ntext = ''\n[measure]\nof = []\n\
                    [[axis]]\nname = 'h'\nscene = true\nchoices = [{ name = 'low', set = [] }, { name = 'high', set = [] }]\n\
                    [[error]]\ncurve = 'c'\nagainst = 'finest'\n";
        let study = of_points(Definition::parse("s", text).unwrap(), BTreeMap::new());
        // Low water comes to 1, high water to 10 with more particles; the coarse ones are a tenth off.
        let mut rows = [("low", 1.1, 10), ("low", 1.0, 20), ("high", 11.0, 40), ("high", 10.0, 80)].map(
            |(h, level, particles)| {
                let mut row = Row { index: particles, method: "m".into(), ..Row::default() };
                row.parameters.insert("h".into(), h.into());
                row.measured.curves.insert("c".into(), vec![[0.0, level], [1.0, level]]);
                row.measured.work.particles = particles as u64;
                row
            },
        );
        (study.finish)(&mut rows, None).unwrap();
        let errors = rows.each_ref().map(|row| row.measured.values.get("c against finest [-]").copied());
        assert!(errors[0].is_some_and(|e| (e - 0.1).abs() < 1e-12), "{errors:?}");
        assert!(errors[2].is_some_and(|e| (e - 0.1).abs() < 1e-12), "{errors:?}");
        assert_eq!((errors[1], errors[3]), (None, None));
    }

    #[test]
    fn limits_are_of_errors_of_curves_too_and_one_of_nothing_is_told() {
        let text = "name = 's'\ntitle = 't'\nmethod = 'm'\ntext = ''\n[measure]\nof = []\n\
                    [[error]]\ncurve = 'c'\nagainst = 'finest'\n[[error]]\ncurve = 'd'\nagainst = 'finest'\n\
                    [limit]\n'c against finest [-]' = 0.1\n'v [-]' = 1\n'w [-]' = 1\n";
        let study = of_points(Definition::parse("s", text).unwrap(), BTreeMap::new());
        let mut rows = [0, 1].map(|index| {
            let mut row = Row { index, method: "m".into(), ..Row::default() };
            let rise = index as f64;
            row.measured.curves.insert("c".into(), vec![[0.0, 1.0], [1.0, 1.0 + rise]]);
            row.measured.put("v [-]", 2.0);
            row.measured.limit("v [-]", 1.0);
            row.measured.work.particles = index as u64;
            row
        });
        let report = (study.finish)(&mut rows, None).unwrap();
        let told = rows.each_ref().map(|row| row.measured.reason.as_str());
        // The finest is held against nothing, and what the point told is told once.
        assert_eq!(told[1], "v [-] = 2.000e0 > 1.000e0");
        assert!(
            told[0].contains("c against finest [-] = ") && told[0].matches("v [-]").count() == 1,
            "{told:?}"
        );
        let idle: Vec<&String> = report.findings.iter().filter(|f| f.starts_with("[limit]")).collect();
        let none = "[[error]] `d`: no finished point has this curve; there are c.";
        assert!(report.findings.iter().any(|f| f == none), "{:?}", report.findings);
        assert!(idle.len() == 1 && idle[0].contains("`w [-]`") && idle[0].contains("v [-]"), "{idle:?}");
    }

    #[test]
    fn every_built_in_study_can_be_set_up_quick_and_full() {
        for entry in ENTRIES {
            for full in [false, true] {
                let study = find(entry.name, &Setup { full, ..Setup::default() })
                    .unwrap_or_else(|e| panic!("{}: {e}", entry.name));
                assert!(!study.jobs.is_empty(), "{}", entry.name);
                let mut hashes: Vec<String> = study.jobs.iter().map(|j| j.hash(entry.name)).collect();
                hashes.sort();
                hashes.dedup();
                assert_eq!(hashes.len(), study.jobs.len(), "{}: points that are the same", entry.name);
            }
        }
        let error = find("hydrostatics", &Setup::default()).err().unwrap().to_string();
        assert!(error.contains("did you mean `hydrostatic`"), "{error}");
    }
}
