//! Reads the frames of a run back, from the VTU files that [`super::vtu`] wrote.

use super::particles::{Particles, name};
use super::vtu::BLOCK;
use crate::case::OutputField;
use crate::error::{Error, Result};
use bytemuck::Pod;
use flate2::read::ZlibDecoder;
use rayon::prelude::*;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A frame of a run: where its files are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Time [s].
    pub time: f64,
    /// The water, if it was written.
    pub fluid: Option<PathBuf>,
    /// Bodies and moving walls, if they were.
    pub solids: Option<PathBuf>,
}

/// The frames that the run in the folder `root` wrote for the case `name`, in the order of time.
///
/// # Errors
/// [`Error::Io`] if the list of them cannot be read. Where there is no list, there are no frames.
pub fn frames(root: &Path, name: &str) -> Result<Vec<Frame>> {
    let path = root.join(format!("{name}.pvd"));
    let text = match std::fs::read_to_string(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        read => read.map_err(Error::io(&path))?,
    };
    let mut frames: Vec<Frame> = Vec::new();
    for line in text.lines().filter(|line| line.contains("<DataSet ")) {
        let (Some(time), Some(part), Some(file)) =
            (attribute(line, "timestep"), attribute(line, "name"), attribute(line, "file"))
        else {
            continue;
        };
        let Ok(time) = time.parse::<f64>() else { continue };
        if frames.last().is_none_or(|f| f.time != time) {
            frames.push(Frame { time, ..Frame::default() });
        }
        // A list that somebody changed leads nowhere else.
        if let Some(frame) = frames.last_mut().filter(|_| is_inside(Path::new(file))) {
            match part {
                "fluid" => frame.fluid = Some(root.join(file)),
                "solids" => frame.solids = Some(root.join(file)),
                _ => {}
            }
        }
    }
    Ok(frames)
}

/// The particles of a file, or of all pieces that a PVTU file names.
///
/// # Errors
/// [`Error::Io`], also for a file that is damaged or that another program wrote.
pub fn particles(path: &Path) -> Result<Particles> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let wrong = |why: String| Error::io(path)(std::io::Error::new(std::io::ErrorKind::InvalidData, why));
    if path.extension().is_none_or(|end| end != "pvtu") {
        return parse(&bytes).map_err(wrong);
    }
    let text = String::from_utf8(bytes).map_err(|_| wrong("it is no text".into()))?;
    if !text.trim_end().ends_with("</VTKFile>") {
        return Err(wrong("it is cut off".into()));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let sources = text.lines().filter(|line| line.contains("<Piece "));
    let pieces: Vec<Particles> = sources
        .map(|line| {
            let source = attribute(line, "Source").map(Path::new);
            // A list that somebody changed leads nowhere else, and to no other list.
            let file = source.filter(|file| file.components().count() == 1 && is_inside(file));
            let file = file.filter(|file| file.extension().is_some_and(|end| end == "vtu"));
            particles(&folder.join(file.ok_or_else(|| wrong("it names a file that is no piece".into()))?))
        })
        .collect::<Result<_>>()?;
    let fields = |of: &Particles| OutputField::ALL.map(|field| of.has(field));
    let mut filled = pieces.iter().filter(|piece| !piece.is_empty()).map(fields);
    if let Some(first) = filled.next()
        && filled.any(|other| other != first)
    {
        return Err(wrong("its pieces hold different fields".into()));
    }
    let mut all = Particles::default();
    pieces.into_iter().for_each(|piece| all.append(piece));
    Ok(all)
}

/// What shows at the ends of a file of a frame, or of a piece of it, that cannot be read; what lies between is not looked at.
pub fn flaw(path: &Path) -> Option<String> {
    let end = |path: &Path| -> std::io::Result<(u64, Vec<u8>)> {
        let mut file = std::fs::File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(END)))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok((length, bytes))
    };
    let of = |path: &Path| match end(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Some(format!("{} is gone", path.display())),
        Err(e) => Some(format!("{}: {e}", path.display())),
        Ok((0, _)) => Some(format!("{} is empty", path.display())),
        Ok((_, bytes)) if !bytes.trim_ascii_end().ends_with(b"</VTKFile>") => {
            Some(format!("{} is cut off", path.display()))
        }
        Ok(_) => None,
    };
    of(path).or_else(|| {
        let text =
            path.extension().filter(|end| *end == "pvtu").and_then(|_| std::fs::read_to_string(path).ok())?;
        let pieces = text.lines().filter(|l| l.contains("<Piece ")).filter_map(|l| attribute(l, "Source"));
        pieces.map(|piece| path.with_file_name(piece)).find_map(|piece| of(&piece))
    })
}

/// Bytes at the end of a file that hold its last tag.
const END: u64 = 64;

/// Whether a file lies below the folder that its name is relative to.
fn is_inside(file: &Path) -> bool {
    file.components().all(|c| matches!(c, std::path::Component::Normal(_)))
}

fn attribute<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let start = line.find(&format!(" {name}=\""))? + name.len() + 3;
    line[start..].split('"').next()
}

/// Where the appended arrays begin, and how they are written.
struct Appended<'a> {
    head: &'a str,
    data: &'a [u8],
    raw: bool,
    compressed: bool,
}

fn parse(bytes: &[u8]) -> std::result::Result<Particles, String> {
    let mark = b"<AppendedData encoding=\"";
    let at = bytes.windows(mark.len()).position(|w| w == mark).ok_or("it holds no appended data")?;
    let head = std::str::from_utf8(&bytes[..at]).map_err(|_| "its head is no text")?;
    let rest = &bytes[at + mark.len()..];
    let start = rest.iter().position(|&b| b == b'_').ok_or("it is cut off")?;
    if !head.contains(if cfg!(target_endian = "little") { "\"LittleEndian\"" } else { "\"BigEndian\"" }) {
        return Err("its byte order is that of another machine".into());
    }
    let file = Appended {
        head,
        data: &rest[start + 1..],
        raw: rest.starts_with(b"raw"),
        compressed: head.contains(" compressor=\"vtkZLibDataCompressor\""),
    };
    let position = if file.line("Points").is_some_and(|l| attribute(l, "type") == Some("Float64")) {
        file.array("Points")?
    } else {
        file.array::<[f32; 3]>("Points")?.into_iter().map(|x| x.map(f64::from)).collect()
    };
    let out = Particles {
        velocity: file.field(OutputField::Velocity)?,
        pressure: file.field(OutputField::Pressure)?,
        number_density: file.field(OutputField::NumberDensity)?,
        kind: file.field(OutputField::Kind)?,
        body: file.field(OutputField::Body)?,
        id: file.field(OutputField::Id)?,
        position,
    };
    if OutputField::ALL.into_iter().any(|field| file.holds(name(field)) && !out.has(field)) {
        return Err("its arrays differ in length".into());
    }
    Ok(out)
}

impl Appended<'_> {
    fn line(&self, name: &str) -> Option<&str> {
        let of = format!("Name=\"{name}\"");
        self.head.lines().find(|l| l.contains("<DataArray") && l.contains(&of))
    }

    fn holds(&self, name: &str) -> bool {
        self.line(name).is_some()
    }

    /// A field; nothing if it was not asked for (`output.fields`).
    fn field<T: Pod>(&self, field: OutputField) -> std::result::Result<Vec<T>, String> {
        if self.holds(name(field)) { self.array(name(field)) } else { Ok(Vec::new()) }
    }

    fn array<T: Pod>(&self, name: &str) -> std::result::Result<Vec<T>, String> {
        let offset =
            self.line(name).and_then(|l| attribute(l, "offset")).and_then(|o| o.parse::<usize>().ok());
        let offset = offset.ok_or_else(|| format!("it holds no `{name}`"))?;
        let from = self.data.get(offset..).ok_or("it is cut off")?;
        let bytes = if self.compressed { self.inflate(from) } else { self.plain(from) }?;
        if bytes.len() % size_of::<T>() != 0 {
            return Err(format!("its `{name}` is damaged"));
        }
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// `count` bytes of `from`, as they are or from base64.
    fn take(&self, from: &[u8], count: usize) -> std::result::Result<Vec<u8>, String> {
        let stored = if self.raw { count } else { digits(count) };
        let stored = from.get(..stored).ok_or("it is cut off")?;
        if self.raw { Ok(stored.to_vec()) } else { base64(stored, count) }
    }

    fn plain(&self, from: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let length = number(&self.take(from, 8)?);
        let whole = length.checked_add(8).filter(|&n| n <= from.len()).ok_or("it is cut off")?;
        Ok(self.take(from, whole)?.split_off(8))
    }

    fn inflate(&self, from: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let blocks = number(&self.take(from, 8)?);
        let head = blocks.checked_add(3).and_then(|n| n.checked_mul(8)).filter(|&n| n <= from.len());
        let head = head.ok_or("it is cut off")?;
        let sizes = self.take(from, head)?;
        let sizes: Vec<usize> = sizes.chunks_exact(8).skip(3).map(number).collect();
        let total = sizes.iter().try_fold(0_usize, |sum, &n| sum.checked_add(n));
        let total = total.filter(|&n| n <= from.len()).ok_or("it is cut off")?;
        let stored = self.take(from.get(digits(head)..).ok_or("it is cut off")?, total)?;
        let mut parts = Vec::new();
        let mut rest = &stored[..];
        for size in sizes {
            let (part, others) = rest.split_at(size);
            parts.push(part);
            rest = others;
        }
        let block = |part: &[u8]| {
            let mut out = Vec::new();
            // A block that is larger than it may be is damage, not memory to be had.
            let read = ZlibDecoder::new(part).take(BLOCK as u64 + 1).read_to_end(&mut out);
            read.ok().filter(|&n| n <= BLOCK).map(|_| out).ok_or_else(|| "a block is damaged".to_owned())
        };
        let blocks: std::result::Result<Vec<Vec<u8>>, String> = parts.into_par_iter().map(block).collect();
        Ok(blocks?.concat())
    }
}

fn number(bytes: &[u8]) -> usize {
    let bytes: [u8; 8] = bytes[..8].try_into().unwrap_or_default();
    usize::try_from(u64::from_ne_bytes(bytes)).unwrap_or(usize::MAX)
}

/// Digits of base64 for so many bytes.
fn digits(bytes: usize) -> usize {
    bytes.div_ceil(3).saturating_mul(4)
}

fn base64(text: &[u8], count: usize) -> std::result::Result<Vec<u8>, String> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => Ok(c - b'A'),
        b'a'..=b'z' => Ok(c - b'a' + 26),
        b'0'..=b'9' => Ok(c - b'0' + 52),
        b'+' => Ok(62),
        b'/' => Ok(63),
        b'=' => Ok(0),
        _ => Err("its base64 is damaged".to_owned()),
    };
    let mut out = Vec::with_capacity(digits(count) / 4 * 3);
    for group in text.chunks(4) {
        let mut word = 0_u32;
        for &c in group {
            word = word << 6 | u32::from(value(c)?);
        }
        out.extend_from_slice(&word.to_be_bytes()[1..]);
    }
    out.truncate(count);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Encoding;

    fn some(n: usize) -> Particles {
        let number = |k: usize| (k as f32).sqrt();
        Particles {
            position: (0..n).map(|k| [number(k), -1.0, number(k + 3)].map(f64::from)).collect(),
            velocity: (0..n).map(|k| [0.0, number(k), 1.0]).collect(),
            pressure: (0..n).map(number).collect(),
            number_density: (0..n).map(|k| 1.0 / (1.0 + number(k))).collect(),
            kind: (0..n).map(|k| (k % 5) as u8).collect(),
            body: (0..n).map(|k| (k % 3) as u32).collect(),
            id: (0..n as u32).rev().collect(),
        }
    }

    #[test]
    fn what_was_written_is_read_back_to_the_last_bit() {
        // None, one, a whole block and a part of one more, blocks that end with the array.
        for n in [0, 1, 7, 6000, BLOCK / 12, BLOCK / 4, BLOCK] {
            for (encoding, double) in [
                (Encoding::Base64, false),
                (Encoding::Raw, false),
                (Encoding::Base64, true),
                (Encoding::Raw, true),
            ] {
                let mut written = some(n);
                if double {
                    written.position.iter_mut().for_each(|x| x[2] += 4.5e6);
                }
                let read = parse(&written.vtu(0.5, encoding, &OutputField::ALL, double))
                    .unwrap_or_else(|e| panic!("{n}: {e}"));
                assert_eq!(format!("{read:?}"), format!("{written:?}"));
            }
        }
    }

    #[test]
    fn fields_that_were_not_asked_for_are_empty() {
        for encoding in [Encoding::Base64, Encoding::Raw] {
            let bytes = some(9).vtu(0.5, encoding, &[OutputField::Id, OutputField::Pressure], false);
            let read = parse(&bytes).expect("sound");
            let whole = some(9);
            assert_eq!(
                (&read.position, &read.pressure, &read.id),
                (&whole.position, &whole.pressure, &whole.id)
            );
            assert!(read.velocity.is_empty() && read.kind.is_empty() && !read.has(OutputField::Velocity));
            assert!(read.has(OutputField::Pressure) && Particles::default().has(OutputField::Velocity));
        }
    }

    #[test]
    fn a_list_of_pieces_leads_to_them_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let put =
            |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
        let bytes = |n: usize, fields: &[OutputField]| some(n).vtu(0.5, Encoding::Base64, fields, false);
        put("a_0.vtu", &bytes(3, &OutputField::ALL));
        put("a_1.vtu", &bytes(0, &OutputField::ALL));
        put("a_2.vtu", &bytes(4, &OutputField::ALL));
        put("a_3.vtu", &bytes(4, &[OutputField::Id]));
        let read = |sources: &[&str], end: &str| {
            let lines: String = sources.iter().map(|s| format!("    <Piece Source=\"{s}\"/>\n")).collect();
            put("a.pvtu", format!("{lines}{end}").as_bytes());
            particles(&folder.path().join("a.pvtu"))
        };
        let all = read(&["a_0.vtu", "a_1.vtu", "a_2.vtu"], "</VTKFile>\n").expect("sound");
        assert_eq!(all.position, [some(3).position, some(4).position].concat());
        assert_eq!((all.velocity.len(), all.kind.len(), all.body.len()), (7, 7, 7));
        for (sources, end, why) in [
            (&["a_0.vtu"][..], "", "cut off"),
            (&["a_0.vtu", "../a_2.vtu"], "</VTKFile>", "no piece"),
            (&["/a_0.vtu"], "</VTKFile>", "no piece"),
            (&["a.pvtu"], "</VTKFile>", "no piece"),
            (&["a_0.vtu", "a_3.vtu"], "</VTKFile>", "different fields"),
            (&["a_0.vtu", "a_4.vtu"], "</VTKFile>", "a_4.vtu: "),
        ] {
            let error = read(sources, end).expect_err("refused").to_string();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn damage_is_an_error() {
        for encoding in [Encoding::Base64, Encoding::Raw] {
            let bytes = some(40).vtu(0.5, encoding, &OutputField::ALL, false);
            // The last third holds cells, which are not read.
            for cut in (0..bytes.len() / 2).step_by(7) {
                assert!(parse(&bytes[..cut]).is_err(), "cut at {cut} of {}", bytes.len());
            }
            for at in (0..bytes.len()).step_by(11) {
                let mut wrong = bytes.clone();
                wrong[at] ^= 0x55;
                // Whatever comes of it, it is no panic.
                let _ = parse(&wrong);
            }
        }
    }
}
