//! Solids without water, in the form of all studies: error against run time, with the paper's numbers drawn in.

use super::definition::Setup;
use super::engine::Job;
use super::incline::{PAPER_ETA, Slide, calibrate, travel_time};
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use super::spring_drop::{CASES, Drop, HEIGHT, Offset, ideal_spring};
use super::spring_static::{
    DAMPING_RATIOS, PAPER_LARGEST, PAPER_LIMIT, SPRINGS, amplitude, oscillation, oscillation_error,
};
use super::{Study, work_precision};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use seixo::case::Law;
use seixo::error::Result;
use std::time::Instant;

/// Runs of a point for its time. Set-up is in it, which takes microseconds.
const REPETITIONS: usize = 3;

/// Times `work`, which takes `steps` steps, and keeps what it puts.
fn timed(steps: f64, mut work: impl FnMut(&mut Measured) -> Result<()>) -> Result<Measured> {
    let mut out = Measured { machine: "CPU, 1 thread, f64".into(), ..Measured::default() };
    let mut times = Vec::new();
    for _ in 0..REPETITIONS {
        let clock = Instant::now();
        work(&mut out)?;
        times.push(clock.elapsed().as_secs_f64());
    }
    out.timing = Timing::of(times);
    out.work = Work { steps: steps as u64, particle_steps: steps as u64, ..Work::default() };
    Ok(out)
}

fn time_steps(full: bool) -> Vec<f64> {
    let mut list = vec![2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4];
    if full {
        list.extend([5e-5, 2e-5]);
    }
    list
}

fn law_name(law: Law) -> &'static str {
    match law {
        Law::Paper => "paper's law, one sub-step",
        Law::Smooth => "smooth law, sub-steps as needed",
        _ => "collision model",
    }
}

fn finished(name: &'static str, title: &'static str, errors: &'static [&'static str]) -> super::Finish {
    Box::new(move |rows: &mut [Row], wanted| {
        let errors: Vec<String> = errors.iter().map(|e| (*e).to_string()).collect();
        let mut report = work_precision::report((name, title), rows, &errors, &Default::default(), wanted);
        // Particle-steps mean nothing here: one body.
        report.charts.retain(|(file, _)| !file.ends_with("-work"));
        Ok(report)
    })
}

/// Height of return after an elastic bounce, over eight entry phases.
pub fn free_fall(setup: &Setup) -> Study {
    const PHASES: usize = 8;
    let mut jobs = Vec::new();
    for law in [Law::Paper, Law::Smooth] {
        for dt in time_steps(setup.full) {
            let parameters = [("dt", format!("{dt:e}"))];
            jobs.push(Job::new(law_name(law), &parameters, 1.0 / dt, move |_| {
                let case = CASES[2];
                let step_of_fall = dt * (2.0 * 9.80665 * HEIGHT).sqrt();
                let mut out = timed(PHASES as f64 * 1.4 / dt, |out| {
                    let mut square = 0.0;
                    for phase in 0..PHASES {
                        let height = HEIGHT + step_of_fall * phase as f64 / PHASES as f64;
                        let drop = Drop::new(case, 6.9 * case.smallest_spring());
                        let row = Drop { law, time_step: dt, height, ..drop }.run(false)?;
                        square += (row.height_ratio - 1.0).powi(2);
                    }
                    out.put("height error [-]", (square / PHASES as f64).sqrt());
                    Ok(())
                })?;
                // Eq. (17): within three spacings of the height of the fall.
                out.limit("height error [-]", 3.0 * case.spacing / HEIGHT);
                Ok(out)
            }));
        }
    }
    Study {
        name: "free-fall".into(),
        title: "Fall and elastic bounce of a cube".into(),
        question: "Case CD03 of the paper with K = 6.9 K_min, undamped: rms error of the height of return over the height \
                   of the fall, for eight entry phases. Degraded is what misses Eq. (17)."
            .into(),
        jobs,
        finish: finished("free-fall", "Fall and elastic bounce of a cube", &["height error [-]"]),
    }
}

/// A cube on its contact spring against the analytic oscillator.
pub fn oscillator(setup: &Setup) -> Study {
    let mut jobs = Vec::new();
    for law in [Law::Paper, Law::Smooth] {
        for dt in time_steps(setup.full) {
            let parameters = [("dt", format!("{dt:e}"))];
            jobs.push(Job::new(law_name(law), &parameters, 1.0 / dt, move |_| {
                timed(DAMPING_RATIOS.len() as f64 / dt, |out| {
                    let mut worst = 0.0_f64;
                    for ratio in DAMPING_RATIOS {
                        let error = oscillation_error(&oscillation(law, 1e5, ratio, dt, 1.0)?, 1e5);
                        out.put(&format!("error at C = {ratio} C_crit [-]"), error);
                        worst = worst.max(error);
                    }
                    out.put("largest error over amplitude [-]", worst);
                    Ok(())
                })
            }));
        }
    }
    Study {
        name: "oscillator".into(),
        title: "A cube on its contact spring".into(),
        question: "K = 1e5 N/m, one second: largest difference from the analytic damped oscillator over the amplitude at \
                   the start, the worst of C = 1, 0.5, 0.1 and 0.01 C_crit."
            .into(),
        jobs,
        finish: finished("oscillator", "A cube on its contact spring", &["largest error over amplitude [-]"]),
    }
}

/// A block on a slope: travel time, and eta(mu) of the paper's law.
pub fn incline(setup: &Setup) -> Study {
    let mut jobs = Vec::new();
    for dt in time_steps(setup.full) {
        jobs.push(Job::new(law_name(Law::Smooth), &[("dt", format!("{dt:e}"))], 4.0 / dt, move |_| {
            timed(4.0 / dt, |out| {
                let mut worst = 0.0_f64;
                for friction in [0.0, 0.3, 0.6, 0.9] {
                    let exact = travel_time(std::f64::consts::FRAC_PI_4, friction, 2.0);
                    let slide = Slide { friction, time_step: dt, ..Slide::new(Law::Smooth) };
                    let error = slide.run(1.5 * exact)?.error.abs();
                    out.put(&format!("error at mu = {friction} [-]"), error);
                    worst = worst.max(error);
                }
                out.put("travel time error [-]", worst);
                Ok(())
            })
        }));
    }
    for tenth in 1..10 {
        let friction = f64::from(tenth) / 10.0;
        jobs.push(Job::new(ETA, &[("mu", friction.to_string())], 2e4, move |_| {
            let mut out = Measured { machine: "CPU, 1 thread, f64".into(), ..Measured::default() };
            let row = calibrate(Slide::new(Law::Paper), friction)?;
            out.put("eta [kg/s]", row.viscous_friction);
            out.put("duty [-]", row.duty);
            Ok(out)
        }));
    }
    let base = finished("incline", "A block on a slope", &["travel time error [-]"]);
    Study {
        name: "incline".into(),
        title: "A block on a slope of 45 degrees".into(),
        question: "Travel time over 2 m against Eq. (21), the worst of mu = 0, 0.3, 0.6 and 0.9; and the eta that the paper's law needs for the same time, \
                   with the paper's 9.1 kg/s at mu = 0.3 beside it."
            .into(),
        jobs,
        finish: Box::new(move |rows: &mut [Row], wanted| {
            let mut report = base(rows, wanted)?;
            let points: Vec<[f64; 2]> = rows
                .iter()
                .filter(|r| r.method == ETA)
                .filter_map(|r| Some([r.number("mu")?, r.measured.value("eta [kg/s]")?]))
                .collect();
            if let Some(own) = points.iter().find(|p| p[0] == PAPER_ETA.0) {
                report.findings.push(format!(
                    "The paper's law takes the time of mu = {} with eta = {} kg/s (the paper: {}); aligned lattices, \
                     no torque.",
                    PAPER_ETA.0,
                    short(own[1]),
                    PAPER_ETA.1
                ));
            }
            report.charts.push(("incline-eta".into(), eta_chart(points)));
            Ok(report)
        }),
    }
}

const ETA: &str = "paper's law, calibrated";

fn eta_chart(points: Vec<[f64; 2]>) -> Chart {
    let mut own = Series::line("own, aligned lattices", COLORS[0], Stroke::Solid, points);
    own.mark = Some((Mark::Circle, 4.5));
    let paper =
        Series::marks("paper: 9.1 kg/s", COLORS[1], Mark::Star, 8.0, vec![[PAPER_ETA.0, PAPER_ETA.1]]);
    Chart {
        title: "Viscous friction of the paper's law that gives the travel time of Coulomb friction".into(),
        subtitle: "slope of 45 degrees, dt = 1 ms".into(),
        x: Axis::linear("mu [-]"),
        y: Axis::linear("eta [kg/s]"),
        series: vec![own, paper],
    }
}

/// Amplitude of a resting cube against K.
pub fn spring_static(setup: &Setup) -> Study {
    let mut jobs = Vec::new();
    let steps: &[f64] = if setup.full { &[1e-3, 5e-4, 1e-4] } else { &[5e-4, 1e-4] };
    for &dt in steps {
        for ratio in [0.0, 1.0] {
            for spring in SPRINGS {
                let method = format!("C = {ratio} C_crit, dt = {dt:e} s");
                let parameters = [("K", format!("{spring:e}")), ("dt", format!("{dt:e}"))];
                jobs.push(Job::new(&method, &parameters, 1.0 / dt, move |_| {
                    let mut out = Measured { machine: "CPU, 1 thread, f64".into(), ..Measured::default() };
                    let row = amplitude(Law::Paper, spring, ratio, dt, 10.0)?;
                    out.put("amplitude over l0 [-]", row.amplitude_over_l0);
                    out.put("analytic over l0 [-]", row.analytic_over_l0);
                    out.put(
                        "amplitude error over l0 [-]",
                        (row.amplitude_over_l0 - row.analytic_over_l0).abs(),
                    );
                    out.put("dt sqrt(K / m) [-]", row.omega_dt);
                    out.timing = Timing::of(vec![row.wall_time]);
                    out.limit("amplitude over l0 [-]", PAPER_LIMIT);
                    Ok(out)
                }));
            }
        }
    }
    Study {
        name: "spring-static".into(),
        title: "A cube at rest: amplitude against K".into(),
        question: "Section 4.1, Fig. 3: the paper asks for less than 20 % of l0 and prints 17.4 % as the largest, at \
                   K = 5e7 N/m (which rounding decides)."
            .into(),
        jobs,
        finish: Box::new(|rows: &mut [Row], _| {
            let mut methods: Vec<&str> = rows.iter().map(|r| r.method.as_str()).collect();
            methods.dedup();
            let mut series = Vec::new();
            let point = |r: &Row, value: &str| Some([r.number("K")?, r.measured.value(value)?]);
            for (k, method) in methods.iter().enumerate() {
                let own = rows.iter().filter(|r| r.method == *method);
                let points = own.filter_map(|r| point(r, "amplitude over l0 [-]")).collect();
                let mut line = Series::line(method, COLORS[k % COLORS.len()], Stroke::Solid, points);
                line.mark = Some((Mark::Circle, 4.5));
                series.push(line);
            }
            let undamped = rows.iter().filter(|r| r.method.starts_with("C = 0 "));
            let mut exact: Vec<[f64; 2]> =
                undamped.filter_map(|r| point(r, "analytic over l0 [-]")).collect();
            exact.sort_by(|a, b| a[0].total_cmp(&b[0]));
            series.push(Series::line("2 m g / (K l0)", "#000000", Stroke::Dashed, exact));
            series.push(Series::line("the paper's limit", "#666666", Stroke::Dashed, vec![[1e5, PAPER_LIMIT], [5e7, PAPER_LIMIT]]));
            series.push(Series::marks("paper: 17.4 %", COLORS[1], Mark::Star, 8.0, vec![[5e7, PAPER_LARGEST]]));
            let chart = Chart {
                title: "A cube at rest: amplitude against K".into(),
                subtitle: "section 4.1, l0 = 0.025 m, 10 s".into(),
                x: Axis::log("K [N/m]"),
                y: Axis::log("largest minus smallest height over l0 [-]"),
                series,
            };
            let worst = rows.iter().filter_map(|r| r.measured.value("amplitude error over l0 [-]")).fold(0.0, f64::max);
            Ok(Report {
                charts: vec![("spring-static".into(), chart)],
                findings: vec![format!("Largest difference from the analytic amplitude: {} l0.", short(worst))],
            })
        }),
    }
}

/// K_ideal of Table 1, and the three models of Fig. 6.
pub fn spring_drop(setup: &Setup) -> Study {
    let mut jobs = Vec::new();
    let factors: Vec<f64> = (0..31).map(|k| 3.0 + 0.2 * f64::from(k)).collect();
    let offsets: &[Offset] = if setup.full {
        &[Offset::Aligned, Offset::StaggeredX, Offset::StaggeredXy]
    } else {
        &[Offset::Aligned]
    };
    for &offset in offsets {
        for case in CASES {
            let factors = factors.clone();
            let parameters = [
                ("case", case.name.to_string()),
                ("weight [N]", format!("{:.2}", case.mass() * 9.80665)),
                ("spacing", case.spacing.to_string()),
            ];
            jobs.push(Job::new(&format!("K_ideal, {offset:?}"), &parameters, 100.0, move |_| {
                let mut out = Measured { machine: "CPU, f64".into(), ..Measured::default() };
                let row = ideal_spring(case, offset, super::spring_drop::TIME_STEP, &factors, 8)?;
                out.put("K_min [N/m]", row.smallest_spring);
                out.put("holds from, over K_min [-]", row.holds_from);
                out.put("argmin, over K_min [-]", row.argmin_over_smallest);
                // None of the springs may do, e.g. for CL01: dt sqrt(K / m) is too large there.
                if row.ideal_spring.is_finite() {
                    out.put("K_ideal over K_min [-]", row.ideal_over_smallest);
                    out.put("K_ideal [N/m]", row.ideal_spring);
                } else {
                    out.degrade("no K of the sweep meets Eq. (17) for every entry phase");
                }
                Ok(out)
            }));
        }
    }
    jobs.extend(super::drop_rows::jobs(setup.full));
    Study {
        name: "spring-drop".into(),
        title: "K_ideal of Table 1".into(),
        question: "The smallest K that meets Eq. (17) for every entry phase, and the paper's argmin beside it: linear in \
                   the weight, and in 1 / l0^2. Also Eq. (17) at the paper's K for every case, the energy error of \
                   an elastic bounce against the step, and the three models of Fig. 6."
            .into(),
        jobs,
        finish: Box::new(|rows: &mut [Row], _| Ok(ideal_report(rows))),
    }
}

fn ideal_report(rows: &[Row]) -> Report {
    let mut series = Vec::new();
    let mut findings = Vec::new();
    for (k, (prefix, name)) in [("CD", "CD: density varied"), ("CL", "CL: spacing varied")].iter().enumerate()
    {
        let own = rows.iter().filter(|r| r.parameters.get("case").is_some_and(|c| c.starts_with(prefix)));
        let points: Vec<[f64; 2]> = own
            .filter_map(|r| {
                let l0 = r.number("spacing")?;
                Some([r.number("weight [N]")? / (l0 * l0), r.measured.value("K_ideal [N/m]")?])
            })
            .collect();
        // Least squares through the origin, and how much it explains.
        let (xy, xx): (f64, f64) =
            points.iter().fold((0.0, 0.0), |s, p| (s.0 + p[0] * p[1], s.1 + p[0] * p[0]));
        if points.len() > 1 {
            let slope = xy / xx;
            let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
            let rest: f64 = points.iter().map(|p| (p[1] - slope * p[0]).powi(2)).sum();
            let all: f64 = points.iter().map(|p| (p[1] - mean).powi(2)).sum();
            findings.push(format!(
                "{name}: K_ideal = {} W / l0^2, R2 = {:.5} over {} cases.",
                short(slope),
                1.0 - rest / all,
                points.len()
            ));
            let ends = points.iter().fold((f64::MAX, 0.0_f64), |e, p| (e.0.min(p[0]), e.1.max(p[0])));
            series.push(Series::line(
                &format!("{name}, fit"),
                COLORS[k],
                Stroke::Dashed,
                vec![[ends.0, slope * ends.0], [ends.1, slope * ends.1]],
            ));
        }
        series.push(Series::marks(name, COLORS[k], Mark::Circle, 5.0, points));
    }
    series.push(Series::marks(
        "paper: block of section 4.2, 9e5 N/m",
        COLORS[2],
        Mark::Star,
        8.0,
        vec![[48955.0, 9e5]],
    ));
    let chart = Chart {
        title: "K_ideal against W / l0^2".into(),
        subtitle: "fall of 2 m, dt = 0.5 ms, eight entry phases".into(),
        x: Axis::log("weight over l0^2 [N/m2]"),
        y: Axis::log("K_ideal [N/m]"),
        series,
    };
    findings.extend(super::drop_rows::findings(rows));
    Report { charts: vec![("spring-drop".into(), chart)], findings }
}
