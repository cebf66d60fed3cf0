//! The VTU files, read back byte for byte by a reader written for the test, and the list of frames.

use glam::DQuat;
use seixo::case::{Case, Encoding};
use seixo::fields::Fields;
use seixo::output::folder::{Folder, Mode};
use seixo::output::picture::{Painter, Style, drops, placed};
use seixo::output::pvd::Pvd;
use seixo::output::table::{Cell, Table};
use seixo::output::vtu::{BLOCK, Values, vtu};
use seixo::params::Params;
use seixo::scene::Scene;
use std::io::Read;

/// An array of a VTU file: declared type, name and bytes.
struct Array {
    type_name: String,
    name: String,
    bytes: Vec<u8>,
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let start =
        tag.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name} in {tag}")) + name.len() + 3;
    &tag[start..start + tag[start..].find('"').unwrap()]
}

/// Base64 without line breaks; stops at the padding.
fn decode(text: &[u8]) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("{c} is no base64"),
    };
    let (mut out, mut word, mut bits) = (Vec::new(), 0_u32, 0);
    for &c in text.iter().take_while(|&&c| c != b'=') {
        (word, bits) = (word << 6 | u32::from(digit(c)), bits + 6);
        if bits >= 8 {
            bits -= 8;
            out.push((word >> bits) as u8);
            word &= (1 << bits) - 1;
        }
    }
    out
}

fn numbers(bytes: &[u8]) -> Vec<usize> {
    bytes.chunks_exact(8).map(|b| u64::from_ne_bytes(b.try_into().unwrap()) as usize).collect()
}

/// `bytes` of data as base64 text take this many characters.
fn characters(bytes: usize) -> usize {
    bytes.div_ceil(3) * 4
}

/// One array from the appended data; a compressed one also tells its header.
fn array_at(data: &[u8], raw: bool, compressed: bool) -> (Vec<u8>, Vec<usize>) {
    if raw {
        let n = numbers(&data[..8])[0];
        return (data[8..8 + n].to_vec(), vec![]);
    }
    if !compressed {
        let n = numbers(&decode(&data[..characters(8)])[..8])[0];
        return (decode(&data[..characters(8 + n)])[8..].to_vec(), vec![]);
    }
    // Enough characters for three numbers; 32 hold 24 bytes.
    let blocks = numbers(&decode(&data[..32]))[0];
    let length = characters(8 * (3 + blocks));
    let header = numbers(&decode(&data[..length]));
    let packed: usize = header[3..].iter().sum();
    let packed = decode(&data[length..length + characters(packed)]);
    let (mut bytes, mut at) = (Vec::new(), 0);
    for (k, size) in header[3..].iter().enumerate() {
        let before = bytes.len();
        flate2::read::ZlibDecoder::new(&packed[at..at + size]).read_to_end(&mut bytes).unwrap();
        let expected = if k + 1 == blocks { header[2] } else { header[1] };
        assert_eq!(bytes.len() - before, expected, "block {k}");
        at += size;
    }
    (bytes, header)
}

/// All arrays of a file, in the order of the tags, and the headers of the compressed ones.
fn read(file: &[u8]) -> (String, Vec<Array>, Vec<Vec<usize>>) {
    let mark = file.windows(20).position(|w| w.starts_with(b"<AppendedData")).unwrap();
    let head = std::str::from_utf8(&file[..mark]).unwrap().to_string();
    let data = mark + file[mark..].iter().position(|&c| c == b'_').unwrap() + 1;
    let raw = file[mark..data].windows(14).any(|w| w == b"encoding=\"raw\"");
    let compressed = head.contains("vtkZLibDataCompressor");
    assert_eq!(attribute(&head, "header_type"), "UInt64");
    let mut arrays = Vec::new();
    let mut headers = Vec::new();
    for tag in head.split('<').filter(|t| t.starts_with("DataArray") && t.contains("appended")) {
        let offset: usize = attribute(tag, "offset").parse().unwrap();
        let (bytes, header) = array_at(&file[data + offset..], raw, compressed);
        let (type_name, name) = (attribute(tag, "type").to_string(), attribute(tag, "Name").to_string());
        arrays.push(Array { type_name, name, bytes });
        headers.push(header);
    }
    (head, arrays, headers)
}

/// Values without a pattern that a compressor or a shifted reader could hide.
fn scrambled(n: usize) -> (Vec<[f32; 3]>, Vec<f32>, Vec<u8>, Vec<u32>) {
    let mut state = 0x2545_f491_u32;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    };
    let mut real = || next() as f32 / u32::MAX as f32 - 0.5;
    let points = (0..n).map(|_| [real(), real(), real()]).collect();
    let scalars = (0..n).map(|_| real()).collect();
    let kinds = (0..n).map(|k| (k * 7 % 5) as u8).collect();
    let ids = (0..n as u32).map(|k| k.wrapping_mul(2_654_435_761)).collect();
    (points, scalars, kinds, ids)
}

fn round_trip(n: usize, encoding: Encoding) -> Vec<Vec<usize>> {
    let (points, scalars, kinds, ids) = scrambled(n);
    let fields = [
        ("Velocity", Values::Vector(&points)),
        ("Pressure", Values::Scalar(&scalars)),
        ("Kind", Values::Byte(&kinds)),
        ("Id", Values::Number(&ids)),
    ];
    let file = vtu(Values::Vector(&points), &fields, 0.125, encoding);
    let (head, arrays, headers) = read(&file);
    assert!(head.contains("Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.125<"), "{head}");
    assert!(head.contains(&format!("NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\"")), "{head}");
    let connectivity: Vec<i32> = (0..n as i32).collect();
    let offsets: Vec<i32> = (1..=n as i32).collect();
    let expected: [(&str, &str, &[u8]); 8] = [
        ("Float32", "Velocity", bytemuck::cast_slice(&points)),
        ("Float32", "Pressure", bytemuck::cast_slice(&scalars)),
        ("UInt8", "Kind", &kinds),
        ("UInt32", "Id", bytemuck::cast_slice(&ids)),
        ("Float32", "Points", bytemuck::cast_slice(&points)),
        ("Int32", "connectivity", bytemuck::cast_slice(&connectivity)),
        ("Int32", "offsets", bytemuck::cast_slice(&offsets)),
        ("UInt8", "types", &vec![1; n]),
    ];
    assert_eq!(arrays.len(), expected.len());
    for (array, (type_name, name, bytes)) in arrays.iter().zip(expected) {
        assert_eq!((array.type_name.as_str(), array.name.as_str()), (type_name, name));
        assert!(array.bytes == bytes, "{name}: {} bytes read, {} written", array.bytes.len(), bytes.len());
    }
    headers
}

#[test]
fn every_array_comes_back_bit_for_bit() {
    for encoding in [Encoding::Base64, Encoding::Raw] {
        for n in [1, 2, 3, 1000, 16_384, 70_001] {
            round_trip(n, encoding);
        }
    }
}

/// Some readers take the format's "0: the last block is full" for an empty block.
#[test]
fn a_full_last_block_says_its_size() {
    let headers = round_trip(65_536, Encoding::Base64);
    let sizes: Vec<usize> = headers.iter().map(|h| h[0] * BLOCK).collect();
    assert_eq!(sizes, [12, 4, 1, 4, 12, 4, 4, 1].map(|bytes| bytes * 65_536), "all arrays fill their blocks");
    assert!(headers.iter().all(|h| h[1] == BLOCK && h[2] == BLOCK), "{headers:?}");
}

/// Readers stumble over compressed arrays without blocks.
#[test]
fn a_file_without_points_is_not_compressed() {
    for encoding in [Encoding::Base64, Encoding::Raw] {
        round_trip(0, encoding);
        let file = vtu(Values::Vector(&[]), &[("Pressure", Values::Scalar(&[]))], 0.0, encoding);
        assert!(!String::from_utf8_lossy(&file).contains("compressor"));
    }
}

#[test]
fn the_list_of_frames_is_whole_after_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.pvd");
    let mut pvd = Pvd::new(path.clone());
    for (k, time) in [0.0, 0.05, 0.1].into_iter().enumerate() {
        let parts = [("walls", "vtu/walls.vtu".to_string()), ("fluid", format!("vtu/fluid_{k:04}.vtu"))];
        pvd.push(time, &parts).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches("<DataSet ").count(), 2 * (k + 1));
        assert!(text.ends_with("</VTKFile>\n") && text.contains("type=\"Collection\""));
    }
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains(r#"timestep="0.05" group="" part="1" name="fluid" file="vtu/fluid_0001.vtu""#),
        "{text}"
    );
    assert_eq!(text.matches("vtu/walls.vtu").count(), 3, "unchanged parts are named in every frame");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays behind");
}

#[test]
fn a_folder_with_something_in_it_is_refused_and_force_removes_only_what_a_run_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("a/b");
    let first = Folder::open(&root, "case", Mode::New, &[]).unwrap();
    std::fs::create_dir(first.pictures()).unwrap();
    for ours in [first.vtu().join("fluid_0007.vtu"), first.pictures().join("frame_0000.png"), first.pvd()] {
        std::fs::write(ours, "old").unwrap();
    }
    let strangers =
        [first.file("notes.txt"), first.vtu().join("fluid.vtu"), first.pictures().join("holiday.png")];
    for stranger in &strangers {
        std::fs::write(stranger, "mine").unwrap();
    }
    for mode in [Mode::New, Mode::Replace] {
        let busy = Folder::open(&root, "case", mode, &[]).unwrap_err().to_string();
        assert!(busy.contains(if mode == Mode::New { "not empty" } else { "is in use" }), "{busy}");
    }
    let (vtu, pvd) = (first.vtu(), first.pvd());
    drop(first);
    let second = Folder::open(&root, "other", Mode::Replace, &[]).unwrap();
    assert!(
        !vtu.join("fluid_0007.vtu").exists() && !pvd.exists(),
        "the list of the earlier case goes as well"
    );
    assert!(!second.pictures().join("frame_0000.png").exists());
    assert!(strangers.iter().all(|s| std::fs::read_to_string(s).unwrap() == "mine"), "{strangers:?}");
}

#[test]
fn force_touches_nothing_in_a_folder_that_is_not_marked_and_never_an_input() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let files = ["case.toml", "result.json", "pictures/frame_0000.png", "vtu/fluid_0000.vtu"];
    for file in files {
        std::fs::create_dir_all(root.join(file).parent().unwrap()).unwrap();
        std::fs::write(root.join(file), "mine").unwrap();
    }
    let input = [root.join("case.toml")];
    for (inputs, word) in [(&[][..], "no folder of results"), (&input[..], "would be overwritten")] {
        let error = Folder::open(root, "case", Mode::Replace, inputs).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(word), "{error}");
    }
    assert!(files.iter().all(|f| std::fs::read_to_string(root.join(f)).unwrap() == "mine"));
    // Marked or not: an input stays.
    let marked = root.join("marked");
    drop(Folder::open(&marked, "case", Mode::New, &[]).unwrap());
    std::fs::write(marked.join("case.toml"), "mine").unwrap();
    let error = Folder::open(&marked, "case", Mode::Replace, &[marked.join("case.toml")]).unwrap_err();
    assert!(error.to_string().contains("would be overwritten"), "{error}");
    assert_eq!(std::fs::read_to_string(marked.join("case.toml")).unwrap(), "mine");
}

#[test]
fn the_list_of_frames_grows_at_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.pvd");
    let mut pvd = Pvd::new(path.clone());
    let mut inode = None;
    for k in 0..3 {
        pvd.push(0.5 * f64::from(k), &[("fluid", format!("vtu/fluid_{k:04}.vtu"))]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("<?xml") && text.ends_with("  </Collection>\n</VTKFile>\n"), "{text}");
        assert_eq!(text.matches("<DataSet").count(), k as usize + 1);
        #[cfg(unix)]
        {
            let now = std::os::unix::fs::MetadataExt::ino(&std::fs::metadata(&path).unwrap());
            assert_eq!(*inode.get_or_insert(now), now, "the file is not written anew");
        }
    }
}

#[test]
fn tables_hold_numbers_that_come_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    let header = ["time [s]", "body", "count [-]"].map(String::from);
    let mut table = Table::create(&path, &header).unwrap();
    let values = [0.0, -0.1, 1.0 / 3.0, 6.02e23, 1e-9, 123_456.789, f64::MIN_POSITIVE];
    for x in values {
        table.row(&[Cell::from(x), Cell::from("a, \"b\""), Cell::from(7_u64)]).unwrap();
    }
    table.row(&[Cell::from(f64::NAN), Cell::from(""), Cell::from(0_u64)]).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 1, "rows wait for the flush");
    table.flush().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let rows: Vec<&str> = text.lines().skip(1).collect();
    for (row, x) in rows.iter().zip(values) {
        let (number, rest) = row.split_once(',').unwrap();
        assert_eq!(number.parse::<f64>().unwrap(), x);
        assert_eq!(rest, "\"a, \"\"b\"\"\",7");
    }
    assert_eq!(*rows.last().unwrap(), ",,0", "what is not finite is an empty cell");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_input_output_error_that_names_the_file() {
    let error = Table::create(std::path::Path::new("/dev/full"), &["time [s]".to_string()]).unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert!(error.to_string().starts_with("/dev/full: "), "{error}");
}

/// Pixels of a picture whose colour fits.
fn pixels(file: &[u8], fits: impl Fn([u8; 3]) -> bool) -> usize {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (960, 480, png::ColorType::Rgb));
    bytes.chunks_exact(3).filter(|p| fits([p[0], p[1], p[2]])).count()
}

#[test]
fn a_picture_shows_water_bodies_and_what_stands_behind_walls() {
    let scene = |obstacle: &str| {
        let case: Case = toml::from_str(&format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
             [tank]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\nopen = [\"z_max\"]\n{obstacle}\
             [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.5, 1, 0.5]\n\
             [[body]]\nname = \"cube\"\nsize = [0.2, 0.2, 0.2]\ncenter = [1.2, 0.5, 0.5]\ndensity = 500\n\
             [contact]\nspring = 1e4\n"
        ))
        .unwrap();
        (Scene::build(&case).unwrap(), case)
    };
    let orange = |[r, g, b]: [u8; 3]| r > 150 && i32::from(r) - i32::from(b) > 60 && g < r;
    let blue = |[r, g, b]: [u8; 3]| b > r && b > g && b - g > 20;
    let turned = |(scene, case): &(Scene, Case), turn: DQuat| {
        let solids = seixo::contact::Solids::new(scene, Some(&contact())).unwrap();
        let poses: Vec<_> =
            placed(solids.poses()).into_iter().map(|pose| pose.map(|(x, q)| (x, turn * q))).collect();
        let params = Params::new(case, scene).unwrap();
        let painter = Painter::new(scene, &Style::of(3), &params);
        painter.paint(scene, 0.0, &poses, drops(scene, Some(&Fields::new(scene)))).png()
    };
    let draw = |seen: &(Scene, Case)| turned(seen, DQuat::IDENTITY);
    let open = scene("");
    let picture = draw(&open);
    assert_eq!(picture, draw(&open), "the same state gives the same picture");
    let (cube, water) = (pixels(&picture, orange), pixels(&picture, blue));
    assert!((1000..20_000).contains(&cube) && (10_000..200_000).contains(&water), "{cube} {water}");
    // A quarter turn brings the cube's faces onto each other, but not its pattern.
    assert!(turned(&open, DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) != picture);
    // An obstacle in front of the cube tints it but does not hide it.
    let hidden = scene("[[obstacle]]\nname = \"o\"\nmin = [0.9, 0.1, 0]\nmax = [1.6, 0.3, 1]\n");
    let tinted = pixels(&draw(&hidden), |[r, _, b]| r > b.saturating_add(25));
    assert!(tinted > cube / 2, "{tinted} of {cube}");
}

fn contact() -> seixo::case::Contact {
    toml::from_str("spring = 1e4").unwrap()
}

/// A run that is killed while it marks its folder leaves a marker without words: the folder is seixo's all the same.
#[test]
fn a_marker_that_was_cut_off_marks_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let marker = folder.path().join(".seixo");
    for left in ["", "{\"seixo\":\"0."] {
        std::fs::write(&marker, left).unwrap();
        assert_eq!(seixo::output::folder::case_name(folder.path()).unwrap().as_deref(), Some(""));
        drop(Folder::open(folder.path(), "case", Mode::Replace, &[]).unwrap());
        assert_eq!(seixo::output::folder::case_name(folder.path()).unwrap().as_deref(), Some("case"));
    }
}
