//! The scenes of the gallery.

use glam::DVec3;
use seixo::fields::Fields;
use seixo::scene::Groups;

/// What must happen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expect {
    /// It ends right: with at most so many particles lost, and none faster than this [m/s].
    Finish {
        /// Particles.
        lost: u64,
        /// Speed at the end [m/s].
        speed: f64,
    },
    /// A guard must stop it.
    Guard,
    /// It ends, or a guard stops it: nobody can say what is right.
    FinishOrGuard,
    /// The case must be refused.
    Refuse,
}

impl Expect {
    /// In words.
    pub fn words(self) -> String {
        match self {
            Self::Finish { lost: 0, .. } => "finish with all particles".into(),
            Self::Finish { lost, .. } => format!("finish with at most {lost} particles lost"),
            Self::Guard => "be stopped by a guard".into(),
            Self::FinishOrGuard => "finish or be stopped by a guard".into(),
            Self::Refuse => "be refused".into(),
        }
    }
}

/// Changes the state before the first step.
pub type Change = fn(&mut Fields, &Groups);

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name.
    pub name: &'static str,
    /// Case.
    pub text: String,
    /// Overrides.
    pub sets: Vec<String>,
    /// Steps.
    pub steps: u64,
    /// What must happen.
    pub expect: Expect,
    /// What is done to the state before the first step.
    pub change: Option<Change>,
}

impl Scene {
    fn new(name: &'static str, text: String, steps: u64, expect: Expect) -> Self {
        Self { name, text, sets: Vec::new(), steps, expect, change: None }
    }

    fn set(mut self, sets: &[&str]) -> Self {
        self.sets.extend(sets.iter().map(|s| (*s).to_string()));
        self
    }

    fn change(self, change: Change) -> Self {
        Self { change: Some(change), ..self }
    }
}

/// Still water `n` particles wide and deep, in two dimensions, at `l0` [m], with the time step dt of
/// gamma = 0.04 and air above; `at` is its lower corner.
fn pool(n: [u32; 2], l0: f64, at: [f64; 2]) -> String {
    let (width, depth) = (f64::from(n[0]) * l0, f64::from(n[1]) * l0);
    let speed = (100.0 * 9.80665 * l0).sqrt().max(2.5 * (9.80665 * depth).sqrt());
    let [x, z] = at;
    format!(
        "[run]\nspacing = {l0:?}\ntime_step = {dt:?}\nend = 10\ndimensions = 2\n\
         [tank]\nmin = [{x:?}, 0, {z:?}]\nmax = [{right:?}, {l0:?}, {top:?}]\nopen = [\"z_max\"]\n\
         [fluid]\n[[fluid.block]]\nmin = [{x:?}, 0, {z:?}]\nmax = [{right:?}, {l0:?}, {surface:?}]\n\
         [output]\nevery = 0\n",
        dt = 0.2 * l0 / speed,
        right = x + width,
        top = z + 2.0 * depth,
        surface = z + depth,
    )
}

/// Water that fills a box to the lid, n particles along each edge.
fn full_box(n: u32, dimensions: u32) -> String {
    let (l0, a) = (0.025, 0.025 * f64::from(n));
    format!(
        "[run]\nspacing = {l0}\ntime_step = 5e-4\nend = 10\ndimensions = {dimensions}\n\
         [tank]\nmin = [0, 0, 0]\nmax = [{a}, {a}, {a}]\n\
         [fluid]\nrelaxation = 0.01\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [{a}, {a}, {a}]\n[output]\nevery = 0\n"
    )
}

/// A dry cube of 0.1 m above a floor.
fn cube(height: f64, contact: &str) -> String {
    format!(
        "[run]\nspacing = 0.025\ntime_step = 1e-3\nend = 10\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.8, 0.8, 2.0]\n\
         [[body]]\nname = \"cube\"\nsize = [0.1, 0.1, 0.1]\ncenter = [0.4, 0.4, {}]\ndensity = 1000.0\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e6\nrestitution = 0.3\nfriction = 0.3\n{contact}[output]\nevery = 0\n",
        height + 0.05
    )
}

/// `count` cubes of 0.05 m in layers of 5 x 5, half a cube apart, that fall into a heap.
fn heap(count: u32) -> String {
    let mut text = String::from(
        "[run]\nspacing = 0.0125\ntime_step = 1e-3\nend = 10\n\
         [tank]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 6.0]\nopen = [\"z_max\"]\n\
         [contact]\nlaw = \"smooth\"\nspring = 1e5\nrestitution = 0.2\nfriction = 0.3\n[output]\nevery = 0\n",
    );
    for k in 0..count {
        let (x, y, z) = (k % 5, k / 5 % 5, k / 25);
        let place = |i: u32| 0.075 + 0.085 * f64::from(i);
        // Each layer is shifted a little, so that cubes do not land flat on each other.
        let shift = 0.01 * f64::from(z % 3);
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nsize = [0.05, 0.05, 0.05]\ncenter = [{:?}, {:?}, {:?}]\ndensity = 800.0\n",
            place(x) + shift,
            place(y) - shift,
            0.05 + 0.07 * f64::from(z)
        );
    }
    text
}

/// A gate that comes down onto standing water and reaches the floor.
const GATE: &str = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 10\ndimensions = 2\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.8, 1, 0.8]\nopen = [\"z_max\"]\n\
    [[moving_wall]]\nname = \"gate\"\nmin = [0.36, 0, 0.3]\nmax = [0.44, 1, 0.7]\nmotion = [[0, 0, 0, 0], [0.5, 0, 0, -0.3]]\n\
    [fluid]\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.8, 1, 0.2]\n[output]\nevery = 0\n";

/// The dam break of the paper's tank, coarse and in two dimensions.
const COLLAPSE: &str = "[run]\nspacing = 0.02\ntime_step = 1e-3\nend = 10\ndimensions = 2\n\
    [tank]\nmin = [0, 0, 0]\nmax = [0.8, 1, 0.6]\nopen = [\"z_max\"]\n\
    [fluid]\nsound_speed = 6.0\n[[fluid.block]]\nmin = [0, 0, 0]\nmax = [0.2, 1, 0.4]\n[output]\nevery = 0\n";

fn middle(fields: &mut Fields, groups: &Groups) -> usize {
    // The particle nearest to the middle of the water.
    let n = groups.fluid;
    let mean = fields.position[..n].iter().sum::<DVec3>() / n as f64;
    let distance = |i: &usize| fields.position[*i].distance_squared(mean);
    (0..n).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

fn squeeze(fields: &mut Fields, groups: &Groups, part: f64) {
    fields.position[..groups.fluid].iter_mut().for_each(|x| x.z *= part);
}

/// All scenes; `full` has the large ones as well.
pub fn scenes(full: bool) -> Vec<Scene> {
    let still = |speed| Expect::Finish { lost: 0, speed };
    let shot = |speed: f64| {
        let block = format!(
            "[[fluid.block]]\nmin = [0.2, 0, 0.5]\nmax = [0.22, 0.02, 0.52]\nvelocity = [0, 0, -{speed:?}]\n"
        );
        pool([20, 15], 0.02, [0.0, 0.0])
            .replace("max = [0.4, 0.02, 0.6]", "max = [0.4, 0.02, 1.0]")
            // With a lid: what splashes over the rim is lost by right.
            .replace("open = [\"z_max\"]", "open = []")
            .replace("[output]", &format!("{block}[output]"))
    };
    let mut all = vec![
        Scene::new("a column 10 m deep", pool([5, 100], 0.1, [0.0; 2]), 600, still(14.0)),
        Scene::new("a column 100 m deep", pool([5, 100], 1.0, [0.0; 2]), 600, still(44.0)),
        Scene::new("a drop at 50 m/s", shot(50.0), 300, Expect::Finish { lost: 2, speed: 50.0 }),
        Scene::new("a drop at 500 m/s", shot(500.0), 300, Expect::Finish { lost: 2, speed: 500.0 }),
        Scene::new(
            "a velocity that is not a number",
            pool([20, 10], 0.02, [0.0; 2]),
            100,
            Expect::FinishOrGuard,
        )
        .change(|f, g| {
            let i = middle(f, g);
            f.velocity[i].x = f64::NAN;
        }),
        Scene::new("an infinite velocity", pool([20, 10], 0.02, [0.0; 2]), 100, Expect::FinishOrGuard)
            .change(|f, g| {
                let i = middle(f, g);
                f.velocity[i].z = f64::INFINITY;
            }),
        Scene::new(
            "a position that is not a number",
            pool([20, 10], 0.02, [0.0; 2]),
            100,
            Expect::Finish { lost: 1, speed: 3.0 },
        )
        .change(|f, g| {
            let i = middle(f, g);
            f.position[i].x = f64::NAN;
        }),
        Scene::new(
            "an infinite position",
            pool([20, 10], 0.02, [0.0; 2]),
            100,
            Expect::Finish { lost: 1, speed: 3.0 },
        )
        .change(|f, g| {
            let i = middle(f, g);
            f.position[i].z = f64::INFINITY;
        }),
        Scene::new("two particles in one place", pool([20, 10], 0.02, [0.0; 2]), 100, still(3.0)).change(
            |f, g| {
                let i = middle(f, g);
                let j = if i == 0 { 1 } else { 0 };
                f.position[j] = f.position[i];
            },
        ),
        Scene::new("water squeezed to 0.9", pool([20, 10], 0.02, [0.0; 2]), 200, Expect::FinishOrGuard)
            .change(|f, g| squeeze(f, g, 0.9)),
        Scene::new("water squeezed to 0.7", pool([20, 10], 0.02, [0.0; 2]), 200, Expect::FinishOrGuard)
            .change(|f, g| squeeze(f, g, 0.7)),
        Scene::new("water squeezed to 0.3", pool([20, 10], 0.02, [0.0; 2]), 200, Expect::FinishOrGuard)
            .change(|f, g| squeeze(f, g, 0.3)),
        Scene::new("water squeezed to nothing", pool([20, 10], 0.02, [0.0; 2]), 200, Expect::FinishOrGuard)
            .change(|f, g| squeeze(f, g, 0.0)),
        Scene::new("a closed box full to the lid", full_box(8, 3), 200, still(1.0)),
        Scene::new("a pocket without a free surface", full_box(4, 2), 400, still(1.0))
            .set(&["fluid.compressibility=1e-10"]),
        Scene::new("one particle", pool([1, 1], 0.02, [0.0; 2]), 300, still(2.0)),
        Scene::new(
            "an empty scene",
            "[run]\nspacing = 0.1\ntime_step = 1e-3\nend = 10\n".into(),
            10,
            still(0.0),
        ),
        Scene::new("l0 of 10 micrometres", pool([20, 10], 1e-5, [0.0; 2]), 300, still(1.0)),
        Scene::new("l0 of 100 m", pool([20, 10], 100.0, [0.0; 2]), 300, still(200.0)),
        Scene::new("1 km from the origin", pool([20, 10], 0.02, [1000.0, 1000.0]), 300, still(3.0)),
        Scene::new("no gravity", pool([20, 10], 0.02, [0.0; 2]), 300, still(0.1))
            .set(&["run.gravity=[0,0,0]"]),
        Scene::new("gravity sideways", pool([20, 10], 0.02, [0.0; 2]), 300, still(5.0))
            .set(&["run.gravity=[9.81,0,0]", "tank.open=[]"]),
        Scene::new("gravity upwards, out of the tank", pool([20, 10], 0.02, [0.0; 2]), 10, Expect::Refuse)
            .set(&["run.gravity=[0,0,9.81]"]),
        Scene::new("viscosity 1e-6", COLLAPSE.into(), 300, still(5.0)).set(&["fluid.viscosity=1e-6"]),
        Scene::new("viscosity 1e-2", COLLAPSE.into(), 300, still(5.0)).set(&["fluid.viscosity=1e-2"]),
        Scene::new("viscosity 1", COLLAPSE.into(), 300, Expect::Refuse).set(&["fluid.viscosity=1"]),
        Scene::new("viscosity 10", COLLAPSE.into(), 300, Expect::Refuse).set(&["fluid.viscosity=10"]),
        Scene::new("viscosity 10, with the step adapted", COLLAPSE.into(), 300, still(5.0))
            .set(&["fluid.viscosity=10", "run.adaptive=true"]),
        Scene::new("a wall is missing and a body falls out", cube(0.2, ""), 3000, Expect::Guard)
            .set(&["tank.open=[\"z_min\"]"]),
        Scene::new("spring 1e4 N/m", cube(0.2, ""), 1000, still(0.0)).set(&["contact.spring=1e4"]),
        Scene::new("spring 1e9 N/m", cube(0.2, ""), 1000, still(0.0)).set(&["contact.spring=1e9"]),
        Scene::new("a body of 1 g", cube(0.2, ""), 1000, still(0.0)).set(&["body.0.density=1.0"]),
        Scene::new("a body of 100 t", cube(0.2, ""), 1000, still(0.0))
            .set(&["body.0.density=1e8", "contact.spring=1e11"]),
        Scene::new("a body that spins at 1000 rad/s", cube(0.0, ""), 1000, Expect::FinishOrGuard)
            .set(&["body.0.angular_velocity=[1000,300,0]", "body.0.center=[0.4,0.4,0.3]"]),
        Scene::new("a heap of 100 bodies", heap(100), 500, still(0.0)),
        Scene::new("a gate that shuts onto water", GATE.into(), 700, Expect::FinishOrGuard),
        Scene::new("a time step ten times too long", COLLAPSE.into(), 200, Expect::FinishOrGuard)
            .set(&["run.time_step=1e-2", "fluid.sound_speed=2"]),
        Scene::new("the same, with the step adapted", COLLAPSE.into(), 300, still(5.0))
            .set(&["run.time_step=1e-2", "run.adaptive=true"]),
        Scene::new(
            "gamma of 4.5",
            COLLAPSE.replace("sound_speed = 6.0", "relaxation = 4.5"),
            10,
            Expect::Refuse,
        ),
        Scene::new("a spacing that is not a number", COLLAPSE.into(), 10, Expect::Refuse)
            .set(&["run.spacing=nan"]),
        Scene::new("a tank of 1e12 cells", COLLAPSE.into(), 10, Expect::Refuse)
            .set(&["tank.max=[2e4,1,2e4]"]),
        Scene::new("a body in the water that does not displace it", COLLAPSE.into(), 10, Expect::Refuse)
            .set(&[]),
    ];
    if let Some(last) = all.last_mut() {
        last.text += "[[body]]\nname = \"b\"\nsize = [0.1, 0.02, 0.1]\ncenter = [0.1, 0, 0.1]\ndensity = 500.0\n\
                      [contact]\nlaw = \"smooth\"\nspring = 1e4\n";
    }
    all.extend(mistakes());
    if full {
        all.push(Scene::new("a heap of 1000 bodies", heap(1000), 500, still(0.0)));
        all.push(Scene::new(
            "a closed box full to the lid, 8000 particles",
            full_box(20, 3),
            400,
            still(1.0),
        ));
    }
    all
}

/// What users do by mistake: refused where it cannot be meant, and computed where it can.
fn mistakes() -> Vec<Scene> {
    let refused = |name, text: String| Scene::new(name, text, 10, Expect::Refuse);
    let with = |more: &str| COLLAPSE.to_owned() + more;
    let body = |center: &str, more: &str| {
        with(&format!(
            "[[body]]\nname = \"b\"\nsize = [0.1, 0.02, 0.1]\ncenter = {center}\ndensity = 500.0\n\
             [contact]\nlaw = \"smooth\"\nspring = 1e4\n{more}"
        ))
    };
    let gate = |motion: &str| {
        with(&format!(
            "[[moving_wall]]\nname = \"gate\"\nmin = [0.24, 0, 0]\nmax = [0.32, 1, 0.5]\nmotion = {motion}\n"
        ))
    };
    let still = |speed| Expect::Finish { lost: 0, speed };
    vec![
        refused("gravity with four numbers", COLLAPSE.into()).set(&["run.gravity=[0,0,0,-9.81]"]),
        refused("lengths in millimetres", COLLAPSE.into())
            .set(&["tank.max=[800,1000,600]", "run.spacing=2e-5"]),
        refused("corners the wrong way round", COLLAPSE.into()).set(&["tank.max=[-0.8,1,0.6]"]),
        refused("water higher than its tank", COLLAPSE.into()).set(&["fluid.block.0.max=[0.2,1,0.8]"]),
        refused("a tank without a floor", COLLAPSE.into()).set(&["tank.open=[\"z_min\",\"z_max\"]"]),
        refused("a step longer than the run", COLLAPSE.into()).set(&["run.time_step=20"]),
        refused("a step in milliseconds", COLLAPSE.into()).set(&["run.time_step=1"]),
        refused("compressibility of 1", COLLAPSE.into()).set(&["fluid.compressibility=1"]),
        refused("a gate whose table starts elsewhere", gate("[[0, 0, 0, 0.3], [1, 0, 0, 0.6]]")),
        refused("a gate that is open at once", gate("[[0, 0, 0, 0], [1e-6, 0, 0, 0.5]]")),
        refused("a gate at 50 m/s in fixed steps", gate("[[0, 0, 0, 0], [0.01, 0, 0, 0.5]]")),
        Scene::new(
            "a gate at 50 m/s, with the step adapted",
            gate("[[0, 0, 0, 0], [0.01, 0, 0, 0.5]]"),
            300,
            still(8.0),
        )
        .set(&["run.adaptive=true"]),
        refused("a gate that leaves for kilometres", gate("[[0, 0, 0, 0], [1e9, 0, 0, 1e12]]")),
        refused("a body beside the tank", body("[1.2, 0, 0.3]", "")),
        refused("a body below the tank", body("[0.5, 0, -0.6]", "")),
        Scene::new("a body above the tank falls into it", body("[0.6, 0, 0.9]", ""), 300, still(5.0)),
        refused("a body in the floor", body("[0.6, 0, 0.02]", "")),
        refused("a spring that is none", body("[0.6, 0, 0.3]", "")).set(&["contact.spring=5e-324"]),
        refused("a spring in kN/mm", body("[0.6, 0, 0.3]", "")).set(&["contact.spring=1e-3"]),
        refused("sub-steps without end", body("[0.6, 0, 0.3]", "substeps = 4294967295\n")),
        refused("one sub-step for a stiff spring", body("[0.6, 0, 0.3]", "substeps = 1\n"))
            .set(&["contact.spring=1e9"]),
        refused("a body that is called like a formula", body("[0.6, 0, 0.3]", ""))
            .set(&["body.0.name=\"=1+1\""]),
        Scene::new("a density in g/cm3", COLLAPSE.into(), 300, still(5.0)).set(&["fluid.density=1.0"]),
        Scene::new("an angle in radians", body("[0.6, 0, 0.3]", ""), 300, still(5.0))
            .set(&["body.0.orientation={axis=[0,1,0],angle_deg=0.785}"]),
        Scene::new("one iteration a solve", COLLAPSE.into(), 100, Expect::FinishOrGuard)
            .set(&["fluid.solver.max_iterations=1"]),
    ]
}
