//! The heap of balls that stays on a tray when the walls round it sink: its angle of repose against the coefficient of friction.

use super::Study;
use super::contact_checks::{Random, none};
use super::definition::Setup;
use super::dry::GRAVITY;
use super::engine::Job;
use super::report::{Report, short};
use super::row::{Measured, Row, Timing, Work};
use crate::plot::{Axis, COLORS, Chart, Mark, Series, Stroke};
use glam::DVec3;
use rayon::prelude::*;
use seixo::case::Case;
use seixo::contact::Solids;
use seixo::error::Result;
use seixo::scene::Scene;
use std::fmt::Write;
use std::time::Instant;

/// Diameter of a ball [m]; the rim of the tray is as high.
const GRAIN: f64 = 0.02;
/// Balls along an edge of the tray, and layers of them.
const ROW: i32 = 10;
const LAYERS: i32 = 5;
/// Distances between the balls at the start over the diameter, across and up, and by how much chance moves them.
const PITCH: (f64, f64, f64) = (1.06, 1.08, 0.02);
/// Half of the tray's edge [m], a multiple of the spacing: what rolls off a heap falls off the tray, so that no run-out makes it flatter.
const TRAY: f64 = 0.11;
/// Half of the edge of the floor, below all that the walls ever are, that catches what falls off [m].
const FLOOR: f64 = 2.0;
/// Time step [s].
const STEP: f64 = 1e-3;
/// Places of the envelope across the tray.
const PLACES: i32 = 80;
/// Distances from the nearest edge over half of the tray within which the slope is fitted.
const FITTED: (f64, f64) = (0.2, 0.8);
/// When the walls begin to sink [s], their speed [m/s], and the time after they stand that the heap is measured [s].
const SINK: (f64, f64, f64) = (0.35, 0.15, 2.0);

const ANGLE: &str = "angle of repose [degrees]";
const SCATTER: &str = "its standard deviation over the seeds [degrees]";
const KEPT: &str = "balls that stay [-]";
const SPEED: &str = "fastest of these at the end [m/s]";

/// The balls over a tray between walls that sink, and when these have come down to its rim [s].
fn text(mu: f64, seed: u64) -> (String, f64) {
    let high = 1.1 * f64::from(LAYERS) * GRAIN + 0.02;
    let gone = SINK.0 + (high - GRAIN) / SINK.1;
    let outer = TRAY + 0.5 * GRAIN;
    let mut text = format!(
        "[run]\nspacing = {:?}\ntime_step = {STEP}\nend = 99\ngravity = [0, 0, -{GRAVITY}]\n[[obstacle]]\nname = \"tray\"\n\
         min = [-{outer:?}, -{outer:?}, -0.04]\nmax = [{outer:?}, {outer:?}, 0]\n[[obstacle]]\nname = \"floor\"\n\
         min = [-{FLOOR}, -{FLOOR}, {:?}]\nmax = [{FLOOR}, {FLOOR}, {:?}]\n[contact]\nspring = 5e3\nrestitution = 0.2\n\
         friction = {mu:?}\n",
        0.25 * GRAIN,
        -high - 0.32,
        -high - 0.3
    );
    for (name, from, to) in [
        ("west", [-outer, -outer], [-TRAY, outer]),
        ("east", [TRAY, -outer], [outer, outer]),
        ("south", [-TRAY, -outer], [TRAY, -TRAY]),
        ("north", [-TRAY, TRAY], [TRAY, outer]),
    ] {
        // writing to a string cannot fail
        let _ = write!(
            text,
            "[[moving_wall]]\nname = \"{name}\"\nmin = [{:?}, {:?}, {:?}]\nmax = [{:?}, {:?}, {high:?}]\n\
             motion = [[0, 0, 0, 0], [{}, 0, 0, 0], [{gone:?}, 0, 0, {:?}]]\n",
            from[0],
            from[1],
            -high,
            to[0],
            to[1],
            SINK.0,
            GRAIN - high
        );
    }
    let mut random = Random::new(seed);
    for k in 0..ROW * ROW * LAYERS {
        let across = |n: i32| PITCH.0 * (f64::from(n % ROW) - 0.5 * f64::from(ROW - 1));
        let mut near = || PITCH.2 * (random.draw() - 0.5);
        let up = 0.55 + PITCH.1 * f64::from(k / (ROW * ROW));
        let center = GRAIN * DVec3::new(across(k) + near(), across(k / ROW) + near(), up);
        let _ = write!(
            text,
            "[[body]]\nname = \"ball {k}\"\nshape = \"sphere\"\nradius = {:?}\ncenter = {:?}\ndensity = 2500\n",
            0.5 * GRAIN,
            center.to_array()
        );
    }
    (text, gone)
}

/// Height [m] at which the upright line through `x`, `y` [m] leaves the ball about `center`, if it meets it.
fn top(center: DVec3, x: f64, y: f64) -> Option<f64> {
    let rest = 0.25 * GRAIN * GRAIN - (center.x - x).powi(2) - (center.y - y).powi(2);
    (rest > 0.0).then(|| center.z + rest.sqrt())
}

/// Angle [degrees] of the surface over the balls at `places`: the heights of their envelope rise by its tangent with the
/// distance from the nearest edge of the tray. Least squares.
fn slope(places: &[DVec3]) -> f64 {
    let mut sums = [0.0; 5];
    for i in 0..PLACES {
        for j in 0..PLACES {
            let at = |k: i32| TRAY * ((2.0 * f64::from(k) + 1.0) / f64::from(PLACES) - 1.0);
            let (x, y) = (at(i), at(j));
            let distance = TRAY - x.abs().max(y.abs());
            if distance < FITTED.0 * TRAY || distance > FITTED.1 * TRAY {
                continue;
            }
            let tops = places.iter().filter_map(|c| top(*c, x, y));
            let height = tops.fold(0.0, f64::max);
            let terms = [1.0, distance, height, distance * distance, distance * height];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
    }
    let [n, d, h, dd, dh] = sums;
    ((dh - d * h / n) / (dd - d * d / n)).atan().to_degrees()
}

/// Angle [degrees] of the heap of `seed`, how many balls stay, the fastest of them [m/s], and the steps.
fn heap(mu: f64, seed: u64) -> Result<(f64, usize, f64, u64)> {
    let (text, gone) = text(mu, seed);
    let case: Case = text.parse()?;
    let scene = Scene::build(&case)?;
    let mut solids = Solids::new(&scene, case.contact.as_ref())?;
    let still = none(solids.poses().len());
    let steps = ((gone + SINK.2) / STEP) as u32;
    for step in 0..steps {
        solids.advance(f64::from(step) * STEP, STEP, &still)?;
    }
    let poses = solids.poses();
    let kept = (0..poses.len()).filter(|&k| solids.is_free(k) && poses[k].position.z > 0.0).map(|k| poses[k]);
    let kept: Vec<_> = kept.collect();
    let fastest = kept.iter().map(|p| p.velocity.length()).fold(0.0, f64::max);
    let places: Vec<_> = kept.iter().map(|p| p.position).collect();
    Ok((slope(&places), kept.len(), fastest, u64::from(steps)))
}

fn measure(mu: f64, seeds: u64) -> Result<Measured> {
    let mut out = Measured { machine: "CPU, f64".into(), ..Measured::default() };
    let clock = Instant::now();
    let heaps: Result<Vec<_>> = (0..seeds).into_par_iter().map(|seed| heap(mu, seed)).collect();
    let heaps = heaps?;
    let n = heaps.len() as f64;
    let mean = heaps.iter().map(|h| h.0).sum::<f64>() / n;
    let square = heaps.iter().map(|h| (h.0 - mean).powi(2)).sum::<f64>();
    out.put(ANGLE, mean);
    out.put(SCATTER, (square / (n - 1.0)).sqrt());
    out.put(KEPT, heaps.iter().map(|h| h.1 as f64).sum::<f64>() / n);
    out.put(SPEED, heaps.iter().map(|h| h.2).fold(0.0, f64::max));
    out.timing = Timing::of(vec![clock.elapsed().as_secs_f64()]);
    out.work = Work { steps: heaps.iter().map(|h| h.3).sum(), ..Work::default() };
    Ok(out)
}

fn finish(rows: &mut [Row], _: Option<f64>) -> Result<Report> {
    let mut report = Report::default();
    let mut points: Vec<[f64; 2]> =
        rows.iter().filter_map(|r| Some([r.number("mu")?, r.measured.value(ANGLE)?])).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(report) };
    report.findings.push(format!(
        "{} degrees at mu = {}, {} at mu = {}.",
        short(first[1]),
        first[0],
        short(last[1]),
        last[0]
    ));
    let mut line = Series::line("balls", COLORS[0], Stroke::Solid, points);
    line.mark = Some((Mark::Circle, 4.5));
    let slide = (0..=16).map(|k| 0.05 * f64::from(k)).map(|mu: f64| [mu, mu.atan().to_degrees()]).collect();
    let block = Series::line("atan mu: a block on a slope", "#000000", Stroke::Dashed, slide);
    let chart = Chart {
        title: "Angle of repose".into(),
        subtitle: "500 balls of 20 mm on a tray of 220 mm".into(),
        x: Axis::linear("mu [-]"),
        y: Axis::linear("angle of the heap [degrees]"),
        series: vec![line, block],
    };
    report.charts.push(("contact-repose".into(), chart));
    Ok(report)
}

/// The study: three seeds for each coefficient, or five and more coefficients.
pub fn study(setup: &Setup) -> Study {
    let (seeds, all): (u64, &[f64]) =
        if setup.full { (5, &[0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8]) } else { (3, &[0.0, 0.1, 0.3, 0.8]) };
    let job = |&mu: &f64| {
        let parameters = [("mu", mu.to_string()), ("seeds", seeds.to_string())];
        Job::new("balls", &parameters, seeds as f64, move |_| measure(mu, seeds))
    };
    Study {
        name: "contact-repose".into(),
        title: "Angle of repose".into(),
        question: "500 balls of 20 mm lie on a tray of 220 mm, its rim a ball high, between walls that then sink to the rim at 0.15 m/s: what is not \
                   held rolls off the tray. Two seconds later the slope of the heap that stays is fitted by least squares to the heights of its \
                   envelope over the distance from the nearest edge, between 20 and 80 % of half of the tray, against the coefficient of \
                   friction of all contacts. Nothing hinders a ball from rolling."
            .into(),
        jobs: all.iter().map(job).collect(),
        finish: Box::new(finish),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_heap_is_its_own_and_that_of_a_layer_none() {
        // balls anywhere below a surface that rises by `tangent` from the edges, or below an even one
        let filled = |tangent: f64, height: f64| {
            let mut random = Random::new(7);
            let mut draw = || 2.0 * random.draw() - 1.0;
            let all = (0..40_000).map(|_| DVec3::new(TRAY * draw(), TRAY * draw(), 0.1 * (1.0 + draw())));
            let below = |at: &DVec3| at.z < height + tangent * (TRAY - at.x.abs().max(at.y.abs()));
            all.filter(below).collect::<Vec<_>>()
        };
        for angle in [10.0_f64, 20.0, 30.0] {
            let found = slope(&filled(angle.to_radians().tan(), 0.0));
            assert!((found - angle).abs() < 1.5, "{angle}: {found}");
        }
        let flat = slope(&filled(0.0, 0.06));
        assert!(flat.abs() < 1.0, "{flat}");
    }

    #[test]
    fn an_upright_line_leaves_a_ball_at_its_top() {
        let center = DVec3::new(0.03, 0.01, 0.05);
        assert_eq!(top(center, 0.03, 0.01), Some(center.z + 0.5 * GRAIN));
        assert_eq!(top(center, 0.041, 0.01), None);
        let found = top(center, 0.03 + 0.3 * GRAIN, 0.01).unwrap();
        assert!((found - center.z - 0.4 * GRAIN).abs() < 1e-12, "{found}");
    }
}
