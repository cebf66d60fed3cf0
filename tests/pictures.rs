//! Pictures of scenes: what is seen of them, wherever they lie and from wherever one looks.

use glam::{DQuat, DVec3, Vec3};
use seixo::case::Case;
use seixo::fields::Fields;
use seixo::output::picture::{Painter, Style, drops};
use seixo::output::render::{Camera, Canvas, Layers, View};
use seixo::params::Params;
use seixo::scene::Scene;
use seixo::shape::{Disc, Polygon, Shape};

/// Single precision would hold the depths of a scene at the coordinates of a site to half a metre.
#[test]
fn a_scene_at_the_coordinates_of_a_site_looks_as_one_at_the_origin() {
    let picture = |at: DVec3, view: (f64, f64)| {
        let place = |x: f64, y: f64, z: f64| (at + DVec3::new(x, y, z)).to_array();
        let case: Case = toml::from_str(&format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\n\
             [tank]\nmin = {:?}\nmax = {:?}\nopen = [\"z_max\"]\n\
             [fluid]\n[[fluid.block]]\nmin = {:?}\nmax = {:?}\n\
             [[obstacle]]\nname = \"post\"\nmin = {:?}\nmax = {:?}\n\
             [[body]]\nname = \"cube\"\nsize = [0.25, 0.25, 0.25]\ncenter = {:?}\ndensity = 500\n\
             [contact]\nspring = 1e4\n",
            at.to_array(),
            place(1.0, 0.5, 0.5),
            at.to_array(),
            place(0.5, 0.5, 0.25),
            place(0.7, 0.0, 0.0),
            place(0.85, 0.25, 0.5),
            place(0.25, 0.25, 0.4),
        ))
        .unwrap();
        let scene = Scene::build(&case).unwrap();
        let params = Params::new(&case, &scene).unwrap();
        let mut style = Style::of(3);
        (style.view.size, style.view.azimuth, style.view.elevation) = ([240, 160], view.0, view.1);
        let poses: Vec<_> = scene.solids.iter().map(|s| Some((s.position, s.orientation))).collect();
        let water = Fields::new(&scene);
        Painter::new(&scene, &style, &params).paint(&scene, 0.0, &poses, drops(&scene, Some(&water))).bytes
    };
    for view in [(0.38, 0.42), (0.0, 0.0)] {
        let pictures = [DVec3::ZERO, DVec3::new(500_000.0, 4_200_000.0, 100.0)].map(|at| picture(at, view));
        let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 2;
        let differing = pictures[0].iter().zip(&pictures[1]).filter(|pair| far(*pair)).count();
        assert!(differing < pictures[0].len() / 500, "{view:?}: {differing} of {}", pictures[0].len());
    }
}

/// Samples that are drawn show as much of a slice of two dimensions as there is of it.
#[test]
fn a_slice_of_two_dimensions_is_seen_with_its_ends() {
    let (radius, width) = (0.3, 0.1);
    let corners = [[-0.3, -0.2], [0.3, -0.2], [0.1, 0.3]];
    let disc = Shape::Disc(Disc { radius, width });
    let roof = Shape::Polygon(Polygon::new(&corners, width));
    for (azimuth, elevation) in [(0.0, 0.0), (0.35, 0.35), (-1.2, 0.1)] {
        let view = View { size: [200, 200], azimuth, elevation, zoom: 1.0, target: None };
        let camera = Camera::new(&view, DVec3::splat(-0.4), DVec3::splat(0.4));
        let drawn = |draw: &dyn Fn(&mut Canvas)| {
            let [mut bodies, water, walls] = [(); 3].map(|()| Canvas::new(&camera));
            draw(&mut bodies);
            let pixels = Layers { water: &water, bodies: &bodies, walls: &walls }.pixels(1.0);
            pixels.chunks_exact(3).filter(|p| p[0] < 200).count() as f64
        };
        let black = |_: DVec3| Vec3::ZERO;
        let pixels = drawn(&|canvas| canvas.ball(&camera, DVec3::ZERO, radius, Vec3::ZERO));
        let area = pixels / (std::f64::consts::PI * radius * radius);
        let pose = (DVec3::ZERO, DQuat::IDENTITY);
        // Both faces along the view, and the rim across it: as wide as the section is seen in its plane.
        let way = camera.forward * DVec3::new(1.0, 0.0, 1.0);
        let across = DVec3::new(-way.z, 0.0, way.x);
        let breadth = |shape: &Shape| shape.reach(across) + shape.reach(-across);
        for shape in [&disc, &roof] {
            let seen = shape.volume() / width * camera.forward.y.abs() + width * breadth(shape);
            let found = drawn(&|canvas| canvas.solid(&camera, (shape, Some(width)), pose, black)) / area;
            assert!((found / seen - 1.0).abs() < 0.03, "{shape:?} at {azimuth}: {found} of {seen} m2");
        }
    }
}

/// Where nothing falls what starts or is driven tells how fast the water may be: one colour was all of it.
#[test]
fn colours_reach_as_far_as_what_moves_where_nothing_falls() {
    for (moves, range) in [
        ("[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\nvelocity = [2, 0, 0]\n", 2.0),
        (
            "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\n[[body]]\nname = \"disc\"\nshape = \"cylinder\"\nradius = 0.1\n\
             axis = [0, 1, 0]\ncenter = [0.5, 0, 0.7]\ndensity = 500\nvelocity = [0, 0, -1.5]\n[contact]\nspring = 1e4\n",
            1.5,
        ),
        (
            "[[fluid.block]]\nmin = [0, 0, 0]\nmax = [1, 0, 0.5]\n[[moving_wall]]\nname = \"wall\"\nmin = [0.4, 0, 0.6]\n\
             max = [0.6, 0, 0.8]\nmotion = [[0, 0, 0, 0], [1, 0, 0, 0.5]]\n",
            0.5,
        ),
    ] {
        let case: Case = toml::from_str(&format!(
            "[run]\nspacing = 0.05\ntime_step = 1e-3\nend = 1.0\ndimensions = 2\ngravity = [0, 0, 0]\n\
             [tank]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\nopen = [\"z_max\"]\n[fluid]\n{moves}"
        ))
        .unwrap();
        let scene = Scene::build(&case).unwrap();
        let params = Params::new(&case, &scene).unwrap();
        let poses: Vec<_> = scene.solids.iter().map(|s| Some((s.position, s.orientation))).collect();
        let water = Fields::new(&scene);
        let painted = |range: Option<[f64; 2]>| {
            let style = Style { range, ..Style::of(2) };
            Painter::new(&scene, &style, &params)
                .paint(&scene, 0.0, &poses, drops(&scene, Some(&water)))
                .bytes
        };
        assert!(painted(None) == painted(Some([0.0, range])), "{moves}");
        assert!(painted(None) != painted(Some([0.0, 2.0 * range])), "{moves}");
    }
}
