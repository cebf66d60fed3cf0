//! A wall of 100 cubes hit by a cube 270 times as heavy: overlap during the hit and at rest against K.

use super::Study;
use super::contact_checks::DAM_BREAK_CUBE;
use super::contact_rest::{RAM, demolish};
use super::definition::Setup;
use super::engine::Job;
use super::report::{Report, short};
use super::row::{Measured, Row, Timing};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};

const PEAK: &str = "largest overlap during the hit, over l0 [-]";
const REST: &str = "largest overlap in the last second, over l0 [-]";
const ESTIMATE: &str = "v sqrt(m / K) of the heavy cube, over l0 [-]";

/// The study.
pub fn study(setup: &Setup) -> Study {
    let dt = DAM_BREAK_CUBE.6;
    let mut runs: Vec<(f64, f64)> = vec![(5.6e5, dt), (5.6e6, dt)];
    if setup.full {
        // the most that 64 sub-steps of 0.9 ms carry on the light cubes, and what Eq. (16) asks for
        runs.extend([(2.3e7, dt), (3.2e8, 2.4e-4)]);
    }
    let jobs = runs.into_iter().map(|(spring, dt)| {
        let parameters = [("K", format!("{spring:e}")), ("dt", format!("{dt:e}"))];
        Job::new("wall of 100 cubes", &parameters, spring.sqrt() / dt * 1e-4, move |_| {
            let mut out = Measured { machine: "CPU, f64".into(), ..Measured::default() };
            let row = demolish(10, spring, dt, 6.0)?;
            out.put(PEAK, row.penetration);
            out.put(REST, row.penetration_end);
            out.put(ESTIMATE, RAM.1 * (RAM.0 / spring).sqrt() / DAM_BREAK_CUBE.2);
            out.put("fastest body at the end [m/s]", row.speed);
            out.put("sub-steps [-]", f64::from(row.substeps));
            out.timing = Timing::of(vec![row.step_us * 1e-6 * 6.0 / dt]);
            out.limit(REST, 0.1);
            Ok(out)
        })
    });
    Study {
        name: "wall-of-cubes".into(),
        title: "A wall of 100 cubes hit by a heavy one".into(),
        question: "10 x 10 cubes of 54 mm and 73 g, hit by one of 20 kg at 3 m/s, l0 = 7.5 mm: overlap during the hit and \
                   6 s later. A cube between the heavy one and the floor is pressed with K = m v^2 / d^2 for a depth d, \
                   Eq. (16); degraded is more than 0.1 l0 at rest."
            .into(),
        jobs: jobs.collect(),
        finish: Box::new(|rows: &mut [Row], _| Ok(report(rows))),
    }
}

fn report(rows: &[Row]) -> Report {
    let points = |value: &str| -> Vec<[f64; 2]> {
        rows.iter().filter_map(|r| Some([r.number("K")?, r.measured.value(value)?])).collect()
    };
    let marked = |name: &str, k: usize, value: &str| {
        let mut line = Series::line(name, COLORS[k], Stroke::Solid, points(value));
        line.mark = Some((Mark::Circle, 4.5));
        line
    };
    let energy = Series::line("v sqrt(m / K), Eq. (16)", "#000000", Stroke::Dashed, points(ESTIMATE));
    let chart = Chart {
        title: "A wall of 100 cubes hit by a heavy one".into(),
        subtitle: "20 kg at 3 m/s on 73 g each, l0 = 7.5 mm".into(),
        x: Axis::log("K [N/m]"),
        y: Axis::log("overlap over l0 [-]"),
        series: vec![marked("during the hit", 0, PEAK), marked("at rest", 1, REST), energy],
    };
    let asked = RAM.0 * (RAM.1 / (0.1 * DAM_BREAK_CUBE.2)).powi(2);
    let findings = vec![format!(
        "To stop the heavy cube within 0.1 l0 takes K = m v^2 / (0.1 l0)^2 = {} N/m; 64 sub-steps of 0.9 ms carry about \
         2.3e7 N/m on a cube of 73 g, so that takes a smaller time step as well.",
        short(asked)
    )];
    Report { charts: vec![("wall-of-cubes".into(), chart)], findings }
}
