//! A heap of cubes or balls from under a tube that is lifted: its angle of repose against the coefficient of friction.

use super::Study;
use super::contact_checks::{Random, none};
use super::definition::Setup;
use super::dry::GRAVITY;
use super::engine::Job;
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use glam::DVec3;
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::scene::Scene;
use std::fmt::Write;
use std::time::Instant;

/// Edge of a cube, diameter of a ball [m].
const GRAIN: f64 = 0.02;
/// Half of the tube's inner width [m]; three grains lie side by side, whichever way they are turned.
const TUBE: f64 = 0.055;
/// When the tube rises [s], and how fast [m/s].
const LIFT: (f64, f64) = (0.8, 0.3);
/// Time step [s].
const STEP: f64 = 1e-3;
/// Distance over the mean one beyond which a grain has rolled away: a cone reaches to twice its mean.
const AWAY: f64 = 2.2;

const ANGLE: &str = "angle of repose [degrees]";
const SLOPE: &str = "its tangent over mu [-]";
const AWAY_SHARE: &str = "grains that rolled away [-]";
const SPEED: &str = "mean speed at the end [m/s]";
const OVERLAP: &str = "deepest contact over l0 [-]";

/// `count` grains in a tube on a floor, all with the friction `mu`, and the time at which the tube has left them [s].
fn text(balls: bool, mu: f64, count: u32) -> (String, f64) {
    let layers = count.div_ceil(9);
    let height = 0.036 * f64::from(layers + 1);
    // by then the grains have come down to less than half of the height
    let gone = LIFT.0 + 0.5 * height / LIFT.1;
    let rise = LIFT.1 * (gone - LIFT.0);
    let mut text = format!(
        "[run]\nspacing = {}\ntime_step = {STEP}\nend = 9\ngravity = [0, 0, -{GRAVITY}]\n[[obstacle]]\nname = \"floor\"\n\
         min = [-1, -1, -0.1]\nmax = [1, 1, 0]\n[contact]\nspring = 1e4\nrestitution = 0.2\nfriction = {mu:?}\n",
        0.5 * GRAIN
    );
    let (inner, outer) = (TUBE, TUBE + 2.0 * GRAIN);
    for (name, low, high) in [
        ("west", [-outer, -outer], [-inner, outer]),
        ("east", [inner, -outer], [outer, outer]),
        ("south", [-inner, -outer], [inner, -inner]),
        ("north", [-inner, inner], [inner, outer]),
    ] {
        // writing to a string cannot fail
        let _ = write!(
            text,
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{}, {}, 0.001]\nmax = [{}, {}, {height}]\n\
             motion = [[0, 0, 0, 0], [{}, 0, 0, 0], [{gone}, 0, 0, {rise}], [9, 0, 0, {rise}]]\n",
            low[0], low[1], high[0], high[1], LIFT.0
        );
    }
    let mut random = Random::new(11);
    for k in 0..count {
        let place = |n: u32| 0.0362 * (f64::from(n) - 1.0);
        let center = [place(k % 3), place(k / 3 % 3), 0.02 + 0.036 * f64::from(k / 9)];
        let (axis, angle) = random.orientation().to_axis_angle();
        let shape = if balls {
            format!("shape = \"sphere\"\nradius = {}", 0.5 * GRAIN)
        } else {
            format!("size = [{GRAIN}, {GRAIN}, {GRAIN}]")
        };
        let _ = write!(
            text,
            "[[body]]\nname = \"grain {k}\"\n{shape}\ncenter = {center:?}\ndensity = 1000\n\
             orientation = {{ axis = {:?}, angle_deg = {:?} }}\n",
            axis.to_array(),
            angle.to_degrees()
        );
    }
    (text, gone)
}

/// Angle [degrees] of the even cone with the mean height and the mean distance from the axis of the grains at `places` [m], and how
/// many of them are left out because they have rolled away.
fn cone(places: &[DVec3]) -> (f64, usize) {
    let mut kept = places.to_vec();
    loop {
        let n = kept.len() as f64;
        let middle = kept.iter().sum::<DVec3>() / n;
        let far = |x: &DVec3| (x - middle).truncate().length();
        let distance = kept.iter().map(far).sum::<f64>() / n;
        let before = kept.len();
        kept.retain(|x| far(x) <= AWAY * distance);
        if kept.len() == before {
            // of a cone H / 4 and R / 2
            return ((2.0 * middle.z / distance).atan().to_degrees(), places.len() - before);
        }
    }
}

fn measure(balls: bool, mu: f64, count: u32) -> Result<Measured> {
    let (text, gone) = text(balls, mu, count);
    let case: Case = text.parse()?;
    let scene = Scene::build(&case)?;
    let mut solids = Solids::new(&scene, case.contact.as_ref())?;
    let still = none(solids.poses().len());
    let clock = Instant::now();
    let (steps, mut depth) = (((gone + 0.6) / STEP) as u32, 0.0_f64);
    for step in 0..steps {
        let report = solids.advance(f64::from(step) * STEP, STEP, &still)?;
        depth = depth.max(report.penetration_max_over_l0);
    }
    let grains: Vec<usize> = (0..still.len()).filter(|&k| solids.is_free(k)).collect();
    let places: Vec<DVec3> = grains.iter().map(|&k| solids.poses()[k].position).collect();
    let (angle, away) = cone(&places);
    let speed = grains.iter().map(|&k| solids.poses()[k].velocity.length()).sum::<f64>();
    let mut out = Measured { machine: "CPU, f64".into(), ..Measured::default() };
    out.put(ANGLE, angle);
    out.put(SLOPE, angle.to_radians().tan() / mu);
    out.put(AWAY_SHARE, away as f64 / places.len() as f64);
    out.put(SPEED, speed / places.len() as f64);
    out.put(OVERLAP, depth);
    out.timing = Timing::of(vec![clock.elapsed().as_secs_f64()]);
    out.work = Work { steps: u64::from(steps), ..Work::default() };
    Ok(out)
}

/// Exponent of the growth of the angle with mu, by least squares.
fn exponent(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k].ln()).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let of = |p: &[f64; 2]| (p[0].ln() - x, p[1].ln() - y);
    points.iter().map(|p| of(p).0 * of(p).1).sum::<f64>()
        / points.iter().map(|p| of(p).0.powi(2)).sum::<f64>()
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    let mut series = vec![];
    for (k, name) in [CUBES, BALLS].into_iter().enumerate() {
        let own = rows.iter().filter(|r| r.method == name);
        let mut points: Vec<[f64; 2]> =
            own.filter_map(|r| Some([r.number("mu")?, r.measured.value(ANGLE)?])).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
        let growth = exponent(&points);
        report.findings.push(format!(
            "{name}: {} degrees at mu = {}, {} at mu = {}; the angle grows as mu^{}.",
            short(first[1]),
            first[0],
            short(last[1]),
            last[0],
            short(growth)
        ));
        let mut line = Series::line(name, COLORS[k], Stroke::Solid, points);
        line.mark = Some((Mark::Circle, 4.5));
        series.push(line);
    }
    let slide = (1..=16).map(|k| 0.05 * f64::from(k)).map(|mu: f64| [mu, mu.atan().to_degrees()]).collect();
    series.push(Series::line("atan mu: a block on a slope", "#000000", Stroke::Dashed, slide));
    let chart = Chart {
        title: "Angle of repose".into(),
        subtitle: "grains of 20 mm from under a tube that is lifted".into(),
        x: Axis::linear("mu [-]"),
        y: Axis::linear("angle of the heap [degrees]"),
        series,
    };
    report.charts.push(("contact-repose".into(), chart));
    Ok(report)
}

const CUBES: &str = "cubes";
const BALLS: &str = "balls";

/// The study: 54 cubes at two coefficients, or 126 cubes and balls at six.
pub fn study(setup: &Setup) -> Study {
    let (count, all): (u32, &[f64]) =
        if setup.full { (126, &[0.1, 0.2, 0.3, 0.45, 0.6, 0.8]) } else { (54, &[0.2, 0.6]) };
    let mut jobs = Vec::new();
    for balls in [false, true].into_iter().filter(|b| setup.full || !b) {
        for &mu in all {
            let parameters = [("mu", mu.to_string()), ("grains", count.to_string())];
            let name = if balls { BALLS } else { CUBES };
            let weight = if balls { 1.0 } else { 5.0 };
            jobs.push(Job::new(name, &parameters, weight, move |_| measure(balls, mu, count)));
        }
    }
    Study {
        name: "contact-repose".into(),
        title: "Angle of repose".into(),
        question: "Grains of 20 mm fall into a tube of 110 mm that is then lifted at 0.3 m/s: the angle of the even cone with the \
                   heap's mean height and mean distance from its axis, against the coefficient of friction between the grains \
                   and with the floor. There is no friction of rolling but what the shape gives."
            .into(),
        jobs,
        finish: Box::new(finish),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_of_an_even_cone_is_its_own() {
        let (height, radius) = (0.1, 0.2);
        let mut places = vec![];
        for i in -40..=40 {
            for j in -40..=40 {
                for k in 0..40 {
                    let x = DVec3::new(f64::from(i), f64::from(j), f64::from(k) + 0.5) / 40.0;
                    if x.truncate().length() < 1.0 - x.z {
                        places.push(x * DVec3::new(radius, radius, height));
                    }
                }
            }
        }
        places.push(DVec3::new(3.0, 0.0, 0.0));
        let (angle, away) = cone(&places);
        assert!((angle - (height / radius).atan().to_degrees()).abs() < 0.3, "{angle}");
        assert_eq!(away, 1);
    }
}
