//! STL and OBJ files: vertices and triangles, and whether they enclose a body.

use super::{Unfit, cut};
use glam::DVec3;
use std::collections::HashMap;
use std::io::{Cursor, Read};

/// Vertices [the file's length], each once.
pub(super) type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

/// Most bytes of a mesh: 20 million triangles of a binary STL file.
const LONGEST: u64 = 1 << 30;

/// What is in the file `path`, which may be a pipe or a device that never ends.
pub(super) fn bytes(path: &str) -> std::io::Result<Vec<u8>> {
    let (mut file, mut bytes) = (std::fs::File::open(path)?, vec![]);
    let known = file.metadata()?;
    if known.len() <= LONGEST && (&mut file).take(LONGEST + 1).read_to_end(&mut bytes)? as u64 <= LONGEST {
        return Ok(bytes);
    }
    Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, "longer than 1 GB, which no mesh is"))
}

/// Vertices and triangles of `bytes`; `path` says by its end what they are.
pub(super) fn soup(path: &str, bytes: &[u8]) -> Result<Soup, Unfit> {
    let end = std::path::Path::new(path).extension().unwrap_or_default();
    let end = end.to_string_lossy().to_ascii_lowercase();
    let corners = match end.as_str() {
        "stl" => stl(path, bytes)?,
        "obj" => obj(path, bytes)?,
        _ => {
            let ends =
                if end.is_empty() { "without an ending".into() } else { format!("that ends in `.{end}`") };
            let message = format!("{path}: a file {ends} is not read");
            return Err(Unfit::new(message, "give an STL or OBJ file: other programs export both"));
        }
    };
    let (mut known, mut vertices): (HashMap<[u64; 3], u32>, Vec<DVec3>) = Default::default();
    let mut triangles = vec![];
    for triangle in corners {
        // Adding zero makes -0 the same place as 0.
        let index = triangle.map(|v| {
            let v = v + DVec3::ZERO;
            *known.entry(v.to_array().map(f64::to_bits)).or_insert_with(|| {
                vertices.push(v);
                vertices.len() as u32 - 1
            })
        });
        // What has no area bounds nothing.
        if index[0] != index[1] && index[1] != index[2] && index[2] != index[0] {
            triangles.push(index);
        }
    }
    Ok((vertices, triangles))
}

/// Whether the file holds numbers in single precision, as binary STL does.
pub(super) fn is_single(path: &str, bytes: &[u8]) -> bool {
    let end = std::path::Path::new(path).extension().unwrap_or_default();
    end.eq_ignore_ascii_case("stl") && text(bytes).is_none()
}

/// Steps between numbers in single precision as large as the largest coordinate, and that [m].
pub(super) fn steps(vertices: &[DVec3]) -> (f64, f64) {
    let largest = vertices.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
    (largest * f64::from(f32::EPSILON), largest)
}

fn stl(path: &str, bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, Unfit> {
    let repair = "save it again as binary STL";
    let wrong = |e: std::io::Error| Unfit::new(format!("{path}: no STL file: {e}"), repair);
    let mut out = vec![];
    for solid in solids(bytes) {
        let (mut cursor, mut triangles) = (Cursor::new(&solid), vec![]);
        for triangle in stl_io::create_stl_reader(&mut cursor).map_err(wrong)? {
            let number = out.len() + triangles.len() + 1;
            let triangle =
                triangle.map_err(|e| Unfit::new(format!("{path}: triangle {number}: {e}"), repair))?;
            triangles.push(triangle.vertices.map(|v| DVec3::from_array(v.0.map(f64::from))));
        }
        // The reader knows single precision alone, and text has more digits.
        let written = text(&solid).map(written).unwrap_or_default();
        if written.len() == 3 * triangles.len() {
            triangles = written.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        }
        for corners in triangles {
            finite(path, out.len(), &corners)?;
            out.push(corners);
        }
    }
    Ok(out)
}

/// The corners that an STL file in text states.
fn written(text: &str) -> Vec<DVec3> {
    let corner = |line: &str| {
        let mut words = line.split_whitespace();
        let is_one = words.next()? == "vertex";
        let numbers = words.map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?;
        is_one.then(|| <[f64; 3]>::try_from(numbers).ok().map(DVec3::from))?
    };
    text.lines().filter_map(corner).collect()
}

/// An STL file in text: not a binary one, even if its header looks like text.
fn text(bytes: &[u8]) -> Option<&str> {
    const HEADER: usize = 84;
    const TRIANGLE: usize = 50;
    let count =
        bytes.get(HEADER - 4..HEADER).map(|n| n.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b)));
    let text = std::str::from_utf8(bytes).ok().map(|t| t.trim_start_matches('\u{feff}').trim_start());
    text.filter(|_| count.is_none_or(|n| bytes.len() != HEADER + n * TRIANGLE))
}

/// The parts of an STL file that are read each by itself: the whole of a binary one, without a header that looks like text;
/// each solid of one in text, of which there may be many, with or without names and a byte order mark, in small letters
/// or large ones.
fn solids(bytes: &[u8]) -> Vec<Vec<u8>> {
    let Some(text) = text(bytes) else {
        let mut binary = bytes.to_vec();
        binary.iter_mut().take(5).for_each(|b| *b = 0);
        return vec![binary];
    };
    let mut solids: Vec<Vec<u8>> = vec![];
    for line in text.lines().map(str::trim) {
        if line.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("solid")) {
            solids.push(b"solid of-many\n".to_vec());
        } else if let Some(solid) = solids.last_mut() {
            solid.extend(line.to_ascii_lowercase().bytes().chain(*b"\n"));
        }
    }
    // No STL file: to be told by whoever reads it.
    if solids.is_empty() { vec![bytes.to_vec()] } else { solids }
}

fn obj(path: &str, bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, Unfit> {
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let none = |_: &std::path::Path| Ok(Default::default());
    let load = |bytes: &[u8]| tobj::load_obj_buf(&mut Cursor::new(bytes), &options, none);
    let (models, _) = load(bytes).map_err(|e| {
        let message =
            format!("{path}: line {}: no OBJ file: {e}", broken_line(bytes, |part| load(part).is_ok()));
        Unfit::new(message, "save it again as OBJ")
    })?;
    let (mut out, mut number) = (vec![], 0);
    for tobj::Model { mesh, .. } in models {
        let at = |&k: &u32| {
            let p = mesh.positions.get(3 * k as usize..3 * k as usize + 3);
            p.map_or(DVec3::NAN, DVec3::from_slice)
        };
        let mut left = mesh.indices.as_slice();
        // There are no counts of corners where all have three.
        let mut counts = mesh.face_arities.iter();
        while !left.is_empty() {
            let count = counts.next().map_or(3, |&n| n as usize).min(left.len());
            let (own, rest) = left.split_at(count);
            let corners: Vec<DVec3> = own.iter().map(at).collect();
            finite(path, out.len(), &corners)?;
            number += 1;
            let cut = cut::face(&corners).ok_or_else(|| {
                let message =
                    format!("{path}: face {number} of {count} corners at {} m crosses itself", corners[0]);
                Unfit::new(message, "let the program that made it cut faces into triangles and save it again")
            })?;
            out.extend(cut.into_iter().map(|t| t.map(|k| corners[k as usize])));
            left = rest;
        }
    }
    Ok(out)
}

/// The first line, from 1, up to which a file does not read: halved.
fn broken_line(bytes: &[u8], reads: impl Fn(&[u8]) -> bool) -> usize {
    let ends: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k] == b'\n').chain([bytes.len()]).collect();
    ends.partition_point(|&end| reads(&bytes[..end])) + 1
}

fn finite(path: &str, k: usize, corners: &[DVec3]) -> Result<(), Unfit> {
    if corners.iter().all(|c| c.is_finite()) {
        return Ok(());
    }
    let message = format!("{path}: triangle {}: a corner is not a finite place", k + 1);
    Err(Unfit::new(message, "save the file again"))
}

/// The edges of triangles that turn the same way round, each with the triangle that it is of.
pub(super) fn directed(
    path: &str,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
) -> Result<HashMap<(u32, u32), usize>, Unfit> {
    if triangles.is_empty() {
        let message = format!("{path}: there is no triangle in it");
        return Err(Unfit::new(message, "give a file that holds a solid"));
    }
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for (k, t) in triangles.iter().enumerate() {
        for e in 0..3 {
            let edge = (t[e], t[(e + 1) % 3]);
            if let Some(other) = edges.insert(edge, k) {
                return Err(clash(path, vertices, triangles, edge, [other, k]));
            }
        }
    }
    Ok(edges)
}

/// What is wrong with two triangles that go along an `edge` the same way: one stands twice, parts meet there, or one of them is turned.
fn clash(
    path: &str,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    edge: (u32, u32),
    pair: [usize; 2],
) -> Unfit {
    let at = vertices[edge.0 as usize];
    let meet: Vec<usize> = (0..triangles.len())
        .filter(|&k| triangles[k].contains(&edge.0) && triangles[k].contains(&edge.1))
        .collect();
    let sorted = |k: usize| {
        let mut corners = triangles[k];
        corners.sort_unstable();
        corners
    };
    let twin = |&k: &usize| meet.iter().find(|&&j| j > k && sorted(j) == sorted(k)).map(|&j| [k, j]);
    let remedy = "remove the duplicate, or unite the parts that meet there in the program that made it (a Boolean union)";
    let named = |[a, b]: [usize; 2]| format!("{path}: triangles {} and {} at {at} m", a + 1, b + 1);
    if let Some(twins) = meet.iter().find_map(twin) {
        return Unfit::new(format!("{} have the same corners", named(twins)), remedy);
    }
    if meet.len() > 2 {
        return Unfit::new(format!("{} are of {} that meet in one edge", named(pair), meet.len()), remedy);
    }
    let remedy = "let the program that made it turn all normals outwards and save it again";
    Unfit::new(format!("{} turn opposite ways", named(pair)), remedy)
}

/// A solid's surface has no border, and its triangles turn the same way round.
pub(super) fn check(path: &str, vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), Unfit> {
    let edges = directed(path, vertices, triangles)?;
    let mut open: Vec<_> = edges.iter().filter(|((a, b), _)| !edges.contains_key(&(*b, *a))).collect();
    open.sort_by_key(|((a, _), k)| (**k, *a));
    if let Some(((a, _), k)) = open.first() {
        let message = format!(
            "{path}: the surface is open: {} edges have a triangle on one side alone, the first of triangle {} at {} m",
            open.len(),
            *k + 1,
            vertices[*a as usize]
        );
        return Err(Unfit::new(
            message,
            "close the holes: a solid needs a watertight surface; an open ground is shape = \"terrain\"",
        ));
    }
    Ok(())
}
