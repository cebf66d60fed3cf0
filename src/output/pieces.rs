//! Water that many ranks write: each a VTU file of its own, a piece, and the first one the PVTU file that names them.

use super::particles::{Particles, Region, name};
use super::vtu::Values;
use super::write_whole;
use crate::case::{Encoding, OutputField};
use crate::error::{Error, Result};
use crate::whole::remove;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time that a file of another rank has to appear on a shared disk.
const APPEARS: Duration = Duration::from_secs(10);

/// The piece of a rank numbered `rank`: `fluid_0007_2.vtu` of `fluid_0007`, a path without its ending.
pub fn piece(stem: &Path, rank: usize) -> PathBuf {
    with_end(stem, &format!("_{rank}.vtu"))
}

/// The file that names the pieces: `fluid_0007.pvtu` of `fluid_0007`.
pub fn list(stem: &Path) -> PathBuf {
    with_end(stem, ".pvtu")
}

fn with_end(stem: &Path, end: &str) -> PathBuf {
    let mut path = stem.as_os_str().to_owned();
    path.push(end);
    path.into()
}

/// What each rank is to write of its water.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Pieces {
    /// Path of the pieces, without number and ending. (The system's text: a path need not be Unicode.)
    stem: OsString,
    /// Time [s].
    time: f64,
    encoding: Encoding,
    fields: Vec<OutputField>,
    region: Option<Region>,
    /// Whether places are in double precision.
    double: bool,
}

impl Pieces {
    /// Pieces of `stem` at `time` [s], of the water in `region`, with places that are `double` or single.
    pub fn new(
        stem: &Path,
        time: f64,
        encoding: Encoding,
        fields: &[OutputField],
        region: Option<Region>,
        double: bool,
    ) -> Self {
        Self { stem: stem.into(), time, encoding, fields: fields.to_vec(), region, double }
    }

    /// Writes the piece of the rank numbered `rank`, which has this `water`; returns its bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, rank: usize, water: Particles) -> Result<u64> {
        let water = match &self.region {
            Some(region) => water.within(region),
            None => water,
        };
        let file = water.vtu(self.time, self.encoding, &self.fields, self.double);
        write_whole(&piece(self.stem.as_ref(), rank), &file)?;
        Ok(file.len() as u64)
    }

    /// Asks whether all pieces, of so many `bytes`, are where this rank sees them: other machines may have a folder of this name on a
    /// disk of their own.
    ///
    /// # Errors
    /// [`Error::Io`] if one is not.
    pub fn are_seen(&self, bytes: &[u64]) -> Result<()> {
        let start = Instant::now();
        for (rank, &bytes) in bytes.iter().enumerate() {
            let path = piece(self.stem.as_ref(), rank);
            // What is opened is looked for on the server of a shared disk, which may take a while to tell.
            let seen =
                || std::fs::File::open(&path).and_then(|f| f.metadata()).is_ok_and(|m| m.len() == bytes);
            while !seen() {
                if start.elapsed() > APPEARS {
                    let why = format!(
                        "rank {rank} has written it where the first rank does not see it: the folder of the results must be on a disk \
                         that all ranks share"
                    );
                    return Err(Error::io(&path)(std::io::Error::other(why)));
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        }
        Ok(())
    }

    /// Writes the file that names the pieces of so many `ranks`. Files that an earlier part of the run left of this moment, as one rank or
    /// more of them, are removed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_list(&self, ranks: usize) -> Result<()> {
        let stem = Path::new(&self.stem);
        remove(&with_end(stem, ".vtu"))?;
        clear(stem, ranks)?;
        write_whole(&list(stem), self.pvtu(stem, ranks).as_bytes())
    }

    /// The file that names the pieces of `ranks` ranks.
    fn pvtu(&self, stem: &Path, ranks: usize) -> String {
        let nothing = Particles::default();
        let array = |name: &str, values: Values| {
            let (of, components) = (values.type_name(), values.components());
            format!("      <PDataArray type=\"{of}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>\n")
        };
        let asked = OutputField::ALL.into_iter().filter(|field| self.fields.contains(field));
        let lines: String = asked.map(|field| array(name(field), nothing.values(field))).collect();
        let points = array("Points", if self.double { Values::Place(&[]) } else { Values::Vector(&[]) });
        let byte_order = if cfg!(target_endian = "little") { "LittleEndian" } else { "BigEndian" };
        let compressor =
            if self.encoding == Encoding::Raw { "" } else { " compressor=\"vtkZLibDataCompressor\"" };
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"{byte_order}\" \
             header_type=\"UInt64\"{compressor}>\n  <PUnstructuredGrid GhostLevel=\"0\">\n    <PPointData>\n{lines}    </PPointData>\n    \
             <PPoints>\n{points}    </PPoints>\n"
        );
        for rank in 0..ranks {
            let path = piece(stem, rank);
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            writeln!(text, "    <Piece Source=\"{file}\"/>").expect("a String takes everything");
        }
        text.push_str("  </PUnstructuredGrid>\n</VTKFile>\n");
        text
    }
}

/// Removes what many ranks wrote of `stem`, if they did: the water is now in one file.
///
/// # Errors
/// [`Error::Io`].
pub fn replace(stem: &Path) -> Result<()> {
    remove(&list(stem))?;
    clear(stem, 0)
}

/// Removes the pieces from that of rank `from` on.
fn clear(stem: &Path, from: usize) -> Result<()> {
    for rank in from.. {
        if !remove(&piece(stem, rank))? {
            break;
        }
    }
    Ok(())
}

/// What a rank has to say of its piece: its bytes, or what kept it from writing them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Told {
    /// Bytes of the file.
    Written(u64),
    /// Its path, the system's number of the error if it has one, and the error in words.
    Failed(String, Option<i32>, String),
}

impl Told {
    /// Of what [`Pieces::write`] returned.
    pub fn new(written: Result<u64>) -> Self {
        match written {
            Ok(bytes) => Self::Written(bytes),
            Err(Error::Io { path, source }) => Self::Failed(path, source.raw_os_error(), source.to_string()),
            Err(other) => Self::Failed("piece".into(), None, other.to_string()),
        }
    }

    /// The bytes.
    ///
    /// # Errors
    /// The rank's error, as it would be had this one met it.
    pub fn bytes(self) -> Result<u64> {
        match self {
            Self::Written(bytes) => Ok(bytes),
            Self::Failed(path, number, words) => {
                let source = match number {
                    Some(number) => std::io::Error::from_raw_os_error(number),
                    None => std::io::Error::other(words),
                };
                Err(Error::Io { path, source })
            }
        }
    }
}
