//! VTU files: points with fields, each a vertex cell.
//!
//! Arrays are appended, as base64 of zlib blocks or raw; headers are 64 bits wide. Two departures from the
//! letter of the format make the files readable by more programs: a last block that is full says its size
//! instead of 0, and a file without points is written without compression.

use crate::case::Encoding;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use std::io::Write;

/// Bytes of a compression block.
pub const BLOCK: usize = 1 << 16;

/// Values of a field.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Vectors.
    Vector(&'a [[f32; 3]]),
    /// Places that single precision does not tell apart.
    Place(&'a [[f64; 3]]),
    /// Scalars.
    Scalar(&'a [f32]),
    /// Small numbers.
    Byte(&'a [u8]),
    /// Numbers.
    Number(&'a [u32]),
    /// Signed numbers (cells; VTK wants them signed).
    Index(&'a [i32]),
}

impl Values<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Vector(v) => bytemuck::cast_slice(v),
            Self::Place(v) => bytemuck::cast_slice(v),
            Self::Scalar(v) => bytemuck::cast_slice(v),
            Self::Byte(v) => v,
            Self::Number(v) => bytemuck::cast_slice(v),
            Self::Index(v) => bytemuck::cast_slice(v),
        }
    }

    /// Number of values.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Vector(v) => v.len(),
            Self::Place(v) => v.len(),
            Self::Scalar(v) => v.len(),
            Self::Byte(v) => v.len(),
            Self::Number(v) => v.len(),
            Self::Index(v) => v.len(),
        }
    }

    /// The type of a component, as the format calls it.
    pub(super) fn type_name(&self) -> &'static str {
        match self {
            Self::Vector(_) | Self::Scalar(_) => "Float32",
            Self::Place(_) => "Float64",
            Self::Byte(_) => "UInt8",
            Self::Number(_) => "UInt32",
            Self::Index(_) => "Int32",
        }
    }

    /// Components of a value.
    pub(super) fn components(&self) -> usize {
        if matches!(self, Self::Vector(_) | Self::Place(_)) { 3 } else { 1 }
    }
}

/// The file: `points` [m] with `fields` (name and one value a point) at `time` [s].
pub fn vtu(points: Values, fields: &[(&str, Values)], time: f64, encoding: Encoding) -> Vec<u8> {
    let n = points.len();
    let connectivity: Vec<i32> = (0..n as i32).collect();
    let offsets: Vec<i32> = (1..=n as i32).collect();
    let types = vec![1_u8; n];
    let raw = encoding == Encoding::Raw;
    let compressed = !raw && n > 0;
    let mut appended = Vec::new();
    let mut array = |name: &str, values: Values| {
        let line = format!(
            "        <DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{}\" format=\"appended\" \
             offset=\"{}\"/>\n",
            values.type_name(),
            values.components(),
            appended.len()
        );
        append(&mut appended, values.bytes(), raw, compressed);
        line
    };
    let lines: String = fields.iter().map(|(name, values)| array(name, *values)).collect();
    let position = array("Points", points);
    let cells = array("connectivity", Values::Index(&connectivity))
        + &array("offsets", Values::Index(&offsets))
        + &array("types", Values::Byte(&types));
    let byte_order = if cfg!(target_endian = "little") { "LittleEndian" } else { "BigEndian" };
    let compressor = if compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let appended_encoding = if raw { "raw" } else { "base64" };
    let head = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{byte_order}\" \
         header_type=\"UInt64\"{compressor}>\n  <UnstructuredGrid>\n    <FieldData>\n      \
         <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time}</DataArray>\n    \
         </FieldData>\n    <Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n      <PointData>\n{lines}      \
         </PointData>\n      <Points>\n{position}      </Points>\n      <Cells>\n{cells}      </Cells>\n    </Piece>\n  \
         </UnstructuredGrid>\n  <AppendedData encoding=\"{appended_encoding}\">\n   _"
    );
    let mut file = head.into_bytes();
    file.append(&mut appended);
    file.extend_from_slice(b"\n  </AppendedData>\n</VTKFile>\n");
    file
}

fn append(out: &mut Vec<u8>, bytes: &[u8], raw: bool, compressed: bool) {
    if !compressed {
        let mut data = (bytes.len() as u64).to_ne_bytes().to_vec();
        data.extend_from_slice(bytes);
        if raw {
            out.append(&mut data);
        } else {
            base64(out, &data);
        }
        return;
    }
    let blocks: Vec<Vec<u8>> = bytes.par_chunks(BLOCK).map(deflate).collect();
    // The format allows 0 for "the last block is full", but not every reader knows that.
    let last = bytes.chunks(BLOCK).next_back().map_or(0, <[u8]>::len);
    let mut header = Vec::with_capacity(8 * (3 + blocks.len()));
    for number in [blocks.len(), BLOCK, last].into_iter().chain(blocks.iter().map(Vec::len)) {
        header.extend_from_slice(&(number as u64).to_ne_bytes());
    }
    base64(out, &header);
    base64(out, &blocks.concat());
}

fn deflate(block: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(block.len() / 2), Compression::fast());
    encoder.write_all(block).and_then(|()| encoder.finish()).expect("a Vec takes everything")
}

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

fn base64(out: &mut Vec<u8>, bytes: &[u8]) {
    out.reserve(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = u32::from_be_bytes([
            0,
            group[0],
            group.get(1).copied().unwrap_or(0),
            group.get(2).copied().unwrap_or(0),
        ]);
        for k in 0..4 {
            let digit = ALPHABET[(word >> (18 - 6 * k) & 63) as usize];
            out.push(if k <= group.len() { digit } else { b'=' });
        }
    }
}
