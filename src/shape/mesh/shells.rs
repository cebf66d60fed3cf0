//! Whether parts of a surface lie in each other, so that what they enclose counts twice.

use super::Unfit;
use glam::{DVec2, DVec3};

/// Lines along z that look, along each of the other axes.
const LINES: usize = 128;
/// Where a line lies in its cell: off the places that people choose.
const OFF: DVec2 = DVec2::new(0.513_87, 0.483_19);
/// Part of the volume that may count twice, or less than nothing.
const BEARABLE: f64 = 1e-3;

/// Refuses closed `triangles`, most of which are turned outwards, of which some lie inside of others: their volume would count twice, and what lies near
/// the inner ones be taken for outside.
pub(super) fn check(path: &str, vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), Unfit> {
    let (all, twice, inside_out) = volumes(vertices, triangles);
    if twice > BEARABLE * all {
        let message = format!(
            "{path}: parts of its surface lie in each other: it encloses {all:.2e} m3, of which {twice:.2e} m3 count twice"
        );
        return Err(Unfit::new(
            message,
            "unite them to one surface in the program that made it (a Boolean union), or turn that of a cavity inside out",
        ));
    }
    if inside_out > BEARABLE * all {
        let message =
            format!("{path}: parts of its surface that enclose {inside_out:.2e} m3 are turned inside out");
        return Err(Unfit::new(
            message,
            "let the program that made it turn all normals outwards and save it again",
        ));
    }
    Ok(())
}

/// What the surface goes round once or more, what of it more than once (as often as too often), and what it goes round the wrong way [m3], as
/// lines along z see it.
fn volumes(vertices: &[DVec3], triangles: &[[u32; 3]]) -> (f64, f64, f64) {
    let around = vertices.iter().fold((DVec3::MAX, DVec3::MIN), |(a, b), &v| (a.min(v), b.max(v)));
    let (low, step) = (around.0.truncate(), (around.1 - around.0).truncate() / LINES as f64);
    // Height of each crossing, and whether the line enters there.
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![vec![]; LINES * LINES];
    for triangle in triangles {
        let corners = triangle.map(|k| vertices[k as usize]);
        let [a, b, c] = corners.map(DVec3::truncate);
        let area = (b - a).perp_dot(c - a);
        let cell = |x: DVec2| ((x - low) / step - OFF).to_array();
        let (first, last) = (cell(a.min(b).min(c)), cell(a.max(b).max(c)));
        let lines = |k: usize| {
            let end = (last[k].floor() + 1.0).clamp(0.0, LINES as f64) as usize;
            first[k].ceil().max(0.0) as usize..end
        };
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        for i in lines(0) {
            for j in lines(1) {
                let x = low + (DVec2::new(i as f64, j as f64) + OFF) * step;
                let shares = [(b, c), (c, a), (a, b)].map(|(from, to)| (from - x).perp_dot(to - x) / area);
                if shares.iter().all(|share| *share >= 0.0) {
                    let z = corners.iter().zip(shares).map(|(v, share)| share * v.z).sum();
                    crossings[i * LINES + j].push((z, if area < 0.0 { 1 } else { -1 }));
                }
            }
        }
    }
    let mut lengths = [0.0; 3];
    for mut line in crossings {
        // One that has met an edge tells nothing.
        if line.iter().map(|c| c.1).sum::<i32>() != 0 {
            continue;
        }
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut times = 0;
        for pair in line.windows(2) {
            times += pair[0].1;
            let length = pair[1].0 - pair[0].0;
            lengths[0] += if times > 0 { length } else { 0.0 };
            lengths[1] += f64::from((times - 1).max(0)) * length;
            lengths[2] += f64::from((-times).max(0)) * length;
        }
    }
    let [all, twice, inside_out] = lengths.map(|length| length * step.x * step.y);
    (all, twice, inside_out)
}
