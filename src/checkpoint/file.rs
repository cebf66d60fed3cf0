//! Checkpoint files: a header in JSON, then the arrays, each byte-shuffled, compressed and with a checksum.
//!
//! | bytes | hold |
//! |---|---|
//! | 16 | `seixo checkpoint` |
//! | 4, 8 | format, length of the header (little endian) |
//! | | the header, `Header` as JSON |
//! | 4 | CRC-32 of all that |
//! | | the arrays, where the header says |
//!
//! A file appears by rename, after it and its folder have reached the disk; the newest two are kept.

use super::archive::{Archive, Section};
use crate::error::{Error, Result};
use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 16] = b"seixo checkpoint";
/// Format of the file; others are refused.
const FORMAT: u32 = 4;
/// Longest header and most bytes of an array: what is larger is damage.
const LONGEST_HEADER: u64 = 1 << 28;
const LARGEST: u64 = 1 << 40;
/// Files that are kept.
pub(super) const KEPT: usize = 2;

/// What a state belongs to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of the program.
    pub version: String,
    /// Name of the case.
    pub name: String,
    /// The case as TOML, overrides applied.
    pub case: String,
    /// The processor's precision, `f64` or `f32`: states go on where they were made.
    pub precision: String,
    /// Steps done.
    pub step: u64,
    /// Time [s].
    pub time: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    name: String,
    /// Bytes of an element.
    width: usize,
    /// Bytes of the array.
    bytes: u64,
    /// Where it lies behind the header, compressed, and how long it is there.
    at: u64,
    stored: u64,
    /// CRC-32 of the stored bytes.
    crc32: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct Header {
    origin: Origin,
    numbers: BTreeMap<String, u64>,
    sections: Vec<Entry>,
}

/// First all first bytes of the elements, then all second ones and so on: alike bytes lie together.
fn shuffle(bytes: &[u8], width: usize) -> Vec<u8> {
    let count = bytes.len() / width.max(1);
    (0..width).flat_map(|k| (0..count).map(move |i| bytes[i * width + k])).collect()
}

fn unshuffle(bytes: &[u8], width: usize) -> Vec<u8> {
    let count = bytes.len() / width.max(1);
    let mut out = vec![0; bytes.len()];
    for k in 0..width {
        for i in 0..count {
            out[i * width + k] = bytes[k * count + i];
        }
    }
    out
}

/// The bytes of a checkpoint file.
///
/// # Errors
/// [`Error::Io`] if an array cannot be compressed.
pub fn encode(origin: &Origin, archive: &Archive) -> Result<Vec<u8>> {
    let sections: Vec<(&String, &Section)> = archive.sections.iter().collect();
    let compress = |(_, s): &(&String, &Section)| {
        let mut out = Vec::new();
        ZlibEncoder::new(&*shuffle(&s.bytes, s.width), Compression::fast()).read_to_end(&mut out).map(|_| out)
    };
    let stored: std::io::Result<Vec<Vec<u8>>> = sections.par_iter().map(compress).collect();
    let stored = stored.map_err(Error::io("checkpoint"))?;
    let mut at = 0;
    let entries = sections.iter().zip(&stored).map(|((name, s), stored)| {
        let entry = Entry {
            name: (*name).clone(),
            width: s.width,
            bytes: s.bytes.len() as u64,
            at,
            stored: stored.len() as u64,
            crc32: crc32fast::hash(stored),
        };
        at += entry.stored;
        entry
    });
    let header =
        Header { origin: origin.clone(), numbers: archive.numbers.clone(), sections: entries.collect() };
    let header =
        serde_json::to_vec(&header).map_err(|e| Error::io("checkpoint")(std::io::Error::other(e)))?;
    let mut out = MAGIC.to_vec();
    out.extend(FORMAT.to_le_bytes());
    out.extend((header.len() as u64).to_le_bytes());
    out.extend(header);
    out.extend(crc32fast::hash(&out).to_le_bytes());
    stored.iter().for_each(|s| out.extend(s));
    Ok(out)
}

/// The origin of a checkpoint file and where its arrays begin, without them.
fn head(file: &[u8]) -> std::result::Result<(Header, usize), String> {
    let take = |at: usize, n: usize| file.get(at..at.checked_add(n)?);
    let short = || "it is cut off".to_owned();
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0_u64, |n, &b| n << 8 | u64::from(b));
    if take(0, 16).ok_or_else(short)? != MAGIC {
        return Err("it is no checkpoint".into());
    }
    let format = number(take(16, 4).ok_or_else(short)?);
    if format != u64::from(FORMAT) {
        return Err(format!("its format is {format}, this program knows {FORMAT}"));
    }
    let length = number(take(20, 8).ok_or_else(short)?);
    if length > LONGEST_HEADER {
        return Err("its header is damaged".into());
    }
    let end = 28 + length as usize;
    let crc = number(take(end, 4).ok_or_else(short)?);
    if u64::from(crc32fast::hash(&file[..end])) != crc {
        return Err("its header is damaged".into());
    }
    let header = serde_json::from_slice(&file[28..end]).map_err(|e| format!("its header is damaged: {e}"))?;
    Ok((header, end + 4))
}

/// Reads the bytes of a checkpoint file. Whatever they are, nothing but an error comes of damage.
///
/// # Errors
/// What is wrong, in words that go on from the file's name.
pub fn decode(file: &[u8]) -> std::result::Result<(Origin, Archive), String> {
    let (header, start) = head(file)?;
    let section = |e: &Entry| -> std::result::Result<(String, Section), String> {
        let wrong = || format!("`{}` is damaged", e.name);
        let from = usize::try_from(e.at).ok().and_then(|at| start.checked_add(at)).ok_or_else(wrong)?;
        let to = usize::try_from(e.stored).ok().and_then(|n| from.checked_add(n)).ok_or_else(wrong)?;
        let stored = file.get(from..to).ok_or_else(|| "it is cut off".to_owned())?;
        if crc32fast::hash(stored) != e.crc32 || ![1, 4, 8].contains(&e.width) || e.bytes > LARGEST {
            return Err(wrong());
        }
        // Read as it comes: a length that is a lie costs no memory.
        let mut bytes = Vec::new();
        ZlibDecoder::new(stored).take(e.bytes + 1).read_to_end(&mut bytes).map_err(|_| wrong())?;
        if bytes.len() as u64 != e.bytes || bytes.len() % e.width != 0 {
            return Err(wrong());
        }
        Ok((e.name.clone(), Section { width: e.width, bytes: unshuffle(&bytes, e.width) }))
    };
    let sections: std::result::Result<_, String> = header.sections.par_iter().map(section).collect();
    Ok((header.origin, Archive::read(header.numbers, sections?)))
}

/// Checkpoint files of `folder`, the newest first; nothing if there is no such folder.
///
/// # Errors
/// [`Error::Io`].
pub fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::io(folder)(e)),
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(Error::io(folder))?;
        if entry.file_name().to_str().is_some_and(is_checkpoint) {
            found.push(entry.path());
        }
    }
    found.sort();
    found.reverse();
    Ok(found)
}

/// Whether a file has the name of a checkpoint.
pub(crate) fn is_checkpoint(name: &str) -> bool {
    let step = name.strip_prefix("step_").and_then(|n| n.strip_suffix(".seixo"));
    step.is_some_and(|n| n.len() >= 10 && n.bytes().all(|b| b.is_ascii_digit()))
}

/// Writes the state into `folder` and removes all but the newest two; returns the file and its bytes.
///
/// # Errors
/// [`Error::Io`]; earlier files are then still there.
pub fn write(folder: &Path, origin: &Origin, archive: &Archive) -> Result<(PathBuf, u64)> {
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let bytes = encode(origin, archive)?;
    let path = folder.join(format!("step_{:010}.seixo", origin.step));
    let mut file = crate::whole::beside(folder).map_err(Error::io(&path))?;
    file.write_all(&bytes).and_then(|()| file.as_file().sync_all()).map_err(Error::io(&path))?;
    file.persist(&path).map_err(|e| Error::io(&path)(e.error))?;
    // The name, too, has to be on the disk; where folders cannot be opened, the system sees to it.
    if let Ok(opened) = std::fs::File::open(folder) {
        opened.sync_all().map_err(Error::io(folder))?;
    }
    for old in files(folder)?.into_iter().filter(|p| *p != path).skip(KEPT - 1) {
        std::fs::remove_file(&old).map_err(Error::io(&old))?;
    }
    Ok((path, bytes.len() as u64))
}

/// Removes all states in `folder`, and nothing else.
///
/// # Errors
/// [`Error::Io`].
pub fn remove(folder: &Path) -> Result<()> {
    files(folder)?.iter().try_for_each(|path| std::fs::remove_file(path).map_err(Error::io(path)))
}

/// A state that was found, and what was wrong with newer ones.
#[derive(Debug)]
pub struct Found {
    /// The file.
    pub path: PathBuf,
    /// What it belongs to.
    pub origin: Origin,
    /// The state.
    pub archive: Archive,
    /// Newer files that could not be used, each with the reason.
    pub damaged: Vec<String>,
}

/// The newest state of `folder` that is whole; `None` if there is no file.
///
/// # Errors
/// [`Error::Checkpoint`] if there are files and none is whole, [`Error::Io`].
pub fn newest(folder: &Path) -> Result<Option<Found>> {
    let mut damaged = Vec::new();
    for path in files(folder)? {
        let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
        match decode(&bytes) {
            Ok((origin, archive)) => return Ok(Some(Found { path, origin, archive, damaged })),
            Err(why) => damaged.push(format!("{}: {why}", path.display())),
        }
    }
    if damaged.is_empty() { Ok(None) } else { Err(Error::damaged(damaged.join("\n"))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> (Origin, Archive) {
        let mut archive = Archive::new();
        archive.number("time", &mut f64::NAN.clone()).unwrap();
        let mut x: Vec<f64> = (0..1000).map(|k| f64::from(k).sqrt()).collect();
        archive.array("x", &mut x, false).unwrap();
        archive.array("kind", &mut vec![1_u8, 2, 3], false).unwrap();
        archive.array("none", &mut Vec::<f32>::new(), false).unwrap();
        (Origin { name: "a".into(), step: 7, ..Origin::default() }, archive)
    }

    #[test]
    fn a_state_comes_back_to_the_last_bit() {
        let (origin, archive) = state();
        let bytes = encode(&origin, &archive).unwrap();
        let (read_origin, read) = decode(&bytes).unwrap();
        assert_eq!(
            (read_origin, &read.numbers, &read.sections),
            (origin, &archive.numbers, &archive.sections)
        );
        assert!(bytes.len() < 8000, "{}", bytes.len());
    }

    #[test]
    fn every_damaged_byte_and_every_cut_is_noticed() {
        let (origin, archive) = state();
        let bytes = encode(&origin, &archive).unwrap();
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0x20;
            assert!(decode(&wrong).is_err(), "byte {at} of {}", bytes.len());
            assert!(decode(&bytes[..at]).is_err(), "cut at {at}");
        }
    }

    #[test]
    fn two_files_are_kept_and_the_older_one_stands_in_for_a_damaged_one() {
        let folder = tempfile::tempdir().unwrap();
        let (origin, archive) = state();
        for step in [7, 12, 9_999_999_999, 20] {
            write(folder.path(), &Origin { step, ..origin.clone() }, &archive).unwrap();
        }
        let names: Vec<_> = files(folder.path()).unwrap();
        assert_eq!(names.len(), 2);
        let newest_file = newest(folder.path()).unwrap().unwrap();
        assert!(newest_file.damaged.is_empty() && newest_file.origin.step == 9_999_999_999);
        std::fs::write(&names[0], b"seixo checkpoint").unwrap();
        let found = newest(folder.path()).unwrap().unwrap();
        assert_eq!((found.origin.step, found.damaged.len()), (20, 1), "{:?}", found.damaged);
        std::fs::write(&names[1], b"").unwrap();
        assert!(newest(folder.path()).unwrap_err().to_string().contains("cut off"));
    }
}
