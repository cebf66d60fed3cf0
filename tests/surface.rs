//! `seixo surface`: meshes of the water of a run.

use crate::cli::seixo;

const STILL: &str = r#"
[run]
spacing = 0.02
time_step = 1e-3
end = 0.004
[tank]
min = [0, 0, 0]
max = [0.4, 0.3, 0.3]
open = ["z_max"]
[fluid]
[[fluid.block]]
min = [0, 0, 0]
max = [0.4, 0.3, 0.2]
[output]
every = 0.004
"#;

#[test]
fn a_mesh_of_each_frame_holds_the_volume_of_the_water() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("still.toml"), STILL).unwrap();
    let run = |args: &[&str]| seixo().current_dir(folder.path()).args(args).output().unwrap();
    assert!(run(&["run", "still.toml", "-o", "out", "--backend", "cpu", "-q"]).status.success());
    let made = run(&["surface", "out"]);
    let err = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success(), "{err}");
    for line in err.lines() {
        let volume = line.split(" around ").nth(1).unwrap().trim_end_matches(" m3").parse::<f64>().unwrap();
        println!("{line}");
        // Edges and corners are round, and the surface of the particles at walls lies half a spacing outside of them.
        assert!((volume / 0.024 - 1.0).abs() < 0.05, "{line}");
    }
    assert_eq!(err.lines().count(), 2);
    let ply = std::fs::read(folder.path().join("out/surface/surface_0001.ply")).unwrap();
    assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
    let obj =
        run(&["surface", "out", "--times", "0", "--format", "obj", "--cell", "1", "-o", "coarse", "-q"]);
    assert!(obj.status.success() && obj.stdout.is_empty());
    let text = std::fs::read_to_string(folder.path().join("coarse/surface_0000.obj")).unwrap();
    assert!(text.lines().filter(|l| l.starts_with("f ")).count() > 1000);
    // What cannot be done is told.
    let flat =
        run(&["run", "still.toml", "-o", "flat", "--set", "run.dimensions=2", "--backend", "cpu", "-q"]);
    assert!(flat.status.success());
    let refused = run(&["surface", "flat"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("two dimensions"));
    assert_eq!(run(&["surface", "out", "--cell", "0"]).status.code(), Some(2));
}
