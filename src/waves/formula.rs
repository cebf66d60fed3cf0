//! A way over time as a formula: sums of sines that begin gently, and the stroke that makes a solitary wave.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One sine, amplitude sin(frequency t + phase).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// Amplitude [m] or [rad].
    pub amplitude: f64,
    /// Angular frequency [rad/s].
    pub frequency: f64,
    /// Phase [rad].
    pub phase: f64,
}

/// A way [m] or an angle [rad] over time; 0 up to t = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Formula(Form);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Form {
    Sines(Sines),
    Stroke(Stroke),
}

/// R(t) sum a_k sin(w_k t + p_k) with R = s^3 (10 - 15 s + 6 s^2), s = t / ramp, up to 1: its second derivative is
/// continuous.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Sines {
    components: Vec<Component>,
    /// Time over which the sines grow to their size [s]; 0: they are whole at once.
    ramp: f64,
    /// Largest sum, and largest of its first and second derivative.
    most: [f64; 3],
    /// Times that show its extremes.
    looks: Looks,
}

/// Even times from 0 to the repetition of a sum of sines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Looks {
    /// Intervals between them.
    count: usize,
    /// When the sum repeats [s].
    repeat: f64,
}

/// w(t) = A (tanh th + tanh th_0) with c (t - t_0) = th / k + A tanh th: the way of the water at the piston under a wave
/// eta = H / cosh^2 k (c t - w), which is where w' = c eta / (d + eta) leads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Stroke {
    /// A = H / (k d) [m].
    half: f64,
    /// k [1/m].
    number: f64,
    /// c [m/s].
    celerity: f64,
    /// th_0: where the stroke begins and ends [-].
    end: f64,
}

/// Largest first and second derivative of the ramp, times its length and the square of that.
const RAMP_MOST: [f64; 2] = [1.875, 5.773_502_691_896_258];
/// Looks a period of the fastest sine, and what an extreme may be missed by between two of them.
const LOOKS: f64 = 40.0;
const MISSED: f64 = 1.01;

impl Formula {
    /// Sines that grow over `ramp` [s] and repeat after `repeat` [s] as a whole.
    pub fn sines(components: Vec<Component>, ramp: f64, repeat: f64) -> Self {
        let fastest = components.iter().map(|c| c.frequency).fold(0.0, f64::max);
        let looks = Looks { count: (LOOKS * repeat * fastest / TAU).ceil().max(1.0) as usize, repeat };
        let sum = |order: i32| -> f64 {
            components.iter().map(|c| c.amplitude.abs() * c.frequency.powi(order)).sum()
        };
        let mut most = [0, 1, 2].map(sum);
        if components.len() > 1 {
            let mut seen = [0.0_f64; 3];
            for at in looks.sums(&components) {
                seen.iter_mut().zip(at).for_each(|(most, x)| *most = most.max(x.abs()));
            }
            most.iter_mut().zip(seen).for_each(|(most, seen)| *most = most.min(MISSED * seen));
        }
        Self(Form::Sines(Sines { components, ramp, most, looks }))
    }

    /// The stroke that makes a solitary wave `eta = H / cosh^2 (number (celerity t - w))` in water of `depth` [m].
    pub fn solitary(height: f64, depth: f64, number: f64, celerity: f64) -> Self {
        // The ends that are left off are 1e-3 as high as the crest.
        let end = 1000.0_f64.sqrt().acosh();
        Self(Form::Stroke(Stroke { half: height / (number * depth), number, celerity, end }))
    }

    /// Whether it is 0 for ever.
    pub fn is_still(&self) -> bool {
        self.reach() == [0.0; 2]
    }

    /// Way at time `t` [s].
    pub fn value(&self, t: f64) -> f64 {
        match &self.0 {
            _ if t <= 0.0 => 0.0,
            Form::Sines(s) => s.ramp_at(t)[0] * sum_at(&s.components, t)[0],
            Form::Stroke(s) => s.half * (s.angle(t).tanh() + s.end.tanh()),
        }
    }

    /// Its derivative just after `t` [s].
    pub fn rate(&self, t: f64) -> f64 {
        match &self.0 {
            _ if t < 0.0 => 0.0,
            Form::Sines(s) => {
                let ([r, slope, _], [x, v, _]) = (s.ramp_at(t), sum_at(&s.components, t));
                r * v + slope * x
            }
            Form::Stroke(s) if t >= s.duration() => 0.0,
            Form::Stroke(s) => s.rate(s.angle(t)),
        }
    }

    /// Largest size of the derivative between `from` and `to` [s], or a little more.
    pub fn fastest(&self, from: f64, to: f64) -> f64 {
        if to <= 0.0 {
            return 0.0;
        }
        let (most, bend) = match &self.0 {
            Form::Sines(s) => {
                let [x, v, a] = s.most;
                let [slope, bend] = if s.ramp > 0.0 {
                    [RAMP_MOST[0] / s.ramp, RAMP_MOST[1] / s.ramp.powi(2)]
                } else {
                    [0.0; 2]
                };
                (v + slope * x, a + 2.0 * slope * v + bend * x)
            }
            Form::Stroke(s) => {
                let most = s.rate(0.0);
                // w'' = th' dw'/dth with th' < k c, and |dw'/dth| stays below twice w' of the crest
                (most, 2.0 * most * s.number * s.celerity)
            }
        };
        let from = from.max(0.0);
        let near = if to.is_finite() { self.rate(from).abs() + bend * (to - from) } else { f64::INFINITY };
        near.min(most)
    }

    /// How far it goes below 0 and above.
    pub fn reach(&self) -> [f64; 2] {
        match &self.0 {
            Form::Sines(s) => [-s.most[0], s.most[0]],
            Form::Stroke(s) => [0.0, 2.0 * s.half * s.end.tanh()],
        }
    }

    /// Ways that between them show all of where it comes to.
    pub fn samples(&self) -> Vec<f64> {
        match &self.0 {
            Form::Sines(s) => {
                let within = s.looks.sums(&s.components).into_iter().map(|at| at[0]);
                within.chain(self.reach()).chain([0.0]).collect()
            }
            Form::Stroke(_) => self.reach().to_vec(),
        }
    }
}

impl Sines {
    /// The ramp and its first derivative at `t` > 0.
    fn ramp_at(&self, t: f64) -> [f64; 3] {
        if t >= self.ramp {
            return [1.0, 0.0, 0.0];
        }
        let s = t / self.ramp;
        let rest = 1.0 - s;
        [
            s * s * s * (10.0 - 15.0 * s + 6.0 * s * s),
            30.0 * s * s * rest * rest / self.ramp,
            60.0 * s * rest * (rest - s) / self.ramp.powi(2),
        ]
    }
}

/// The sum of sines and its first two derivatives.
fn sum_at(components: &[Component], t: f64) -> [f64; 3] {
    components.iter().fold([0.0; 3], |[x, v, a], c| {
        let (sin, cos) = (c.frequency * t + c.phase).sin_cos();
        let w = c.frequency;
        [x + c.amplitude * sin, v + c.amplitude * w * cos, a - c.amplitude * w * w * sin]
    })
}

/// Looks that are taken from one sine and cosine at the first of them.
const BLOCK: usize = 128;

impl Looks {
    fn time(self, k: usize) -> f64 {
        self.repeat * k as f64 / self.count as f64
    }

    /// [`sum_at`] every one of the times, to round-off. An irregular sea has 320 sines and 15,000 looks: the sine and cosine of each
    /// at each look would be all that reading a case takes, so they follow from those at the first of a block and
    /// those of the way from there.
    fn sums(self, components: &[Component]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.count + 1];
        for c in components {
            let w = c.frequency;
            let way: [(f64, f64); BLOCK] = std::array::from_fn(|k| (w * self.time(k)).sin_cos());
            for (block, sums) in sums.chunks_mut(BLOCK).enumerate() {
                let (sin, cos) = (w * self.time(block * BLOCK) + c.phase).sin_cos();
                for ([x, v, a], (s, k)) in sums.iter_mut().zip(way) {
                    let (sin, cos) = (sin * k + cos * s, cos * k - sin * s);
                    *x += c.amplitude * sin;
                    *v += c.amplitude * w * cos;
                    *a -= c.amplitude * w * w * sin;
                }
            }
        }
        sums
    }
}

impl Stroke {
    /// When it ends [s].
    fn duration(&self) -> f64 {
        2.0 * (self.end / self.number + self.half * self.end.tanh()) / self.celerity
    }

    /// th at time `t` [s]: the root of a function that is steeper than th / k and flatter than th (1 / k + A).
    fn angle(&self, t: f64) -> f64 {
        if t >= self.duration() {
            return self.end;
        }
        let way = self.celerity * (t - 0.5 * self.duration());
        let (mut low, mut high) = (-self.end, self.end);
        let mut angle = (way / (1.0 / self.number + self.half)).clamp(low, high);
        // Newton's steps, halved where they leave what is known to hold the root.
        for _ in 0..60 {
            let tanh = angle.tanh();
            let off = angle / self.number + self.half * tanh - way;
            if off > 0.0 {
                high = angle
            } else {
                low = angle
            }
            let next = angle - off / (1.0 / self.number + self.half * (1.0 - tanh * tanh));
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - angle).abs() < 1e-15 * self.end {
                return next;
            }
            angle = next;
        }
        angle
    }

    /// w' at the angle th: c eta / (d + eta), eta / d = A k / cosh^2 th.
    fn rate(&self, angle: f64) -> f64 {
        let over_depth = self.half * self.number / angle.cosh().powi(2);
        self.celerity * over_depth / (1.0 + over_depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(amplitude: f64, period: f64, phase: f64, ramp: f64) -> Formula {
        Formula::sines(vec![Component { amplitude, frequency: TAU / period, phase }], ramp, period)
    }

    /// The rate is the slope of the value, is continuous and stays below the bound of each interval.
    fn holds_together(f: &Formula, end: f64) {
        let h = 1e-6;
        assert_eq!((f.value(-1.0), f.value(0.0), f.rate(-1e-9)), (0.0, 0.0, 0.0));
        let (mut most, mut highest) = (0.0_f64, 0.0_f64);
        for k in 0..4000 {
            let t = end * (f64::from(k) + 0.37) / 4000.0;
            let slope = (f.value(t + h) - f.value(t - h)) / (2.0 * h);
            assert!((slope - f.rate(t)).abs() < 1e-6, "{t}: {slope} {}", f.rate(t));
            for dt in [1e-4, 1e-2, 1.0] {
                let bound = f.fastest(t, t + dt);
                let inside = (0..=10).map(|j| f.rate(t + 0.1 * dt * f64::from(j)).abs()).fold(0.0, f64::max);
                assert!(inside <= bound * (1.0 + 1e-9), "{t} {dt}: {inside} {bound}");
            }
            most = most.max(f.rate(t).abs());
            highest = highest.max(f.value(t).abs());
        }
        let all = f.fastest(f64::NEG_INFINITY, f64::INFINITY);
        assert!(most <= all && all < 3.0 * most, "{most} {all}");
        let reach = f.reach().map(f64::abs);
        assert!(highest <= reach[0].max(reach[1]) * (1.0 + 1e-12));
        assert!(f.samples().iter().any(|x| (x.abs() - highest).abs() < 0.02 * highest));
    }

    #[test]
    fn a_sine_is_a_sine_after_its_ramp() {
        let f = sine(0.1, 1.5, 0.4, 2.0);
        holds_together(&f, 8.0);
        for t in [2.0, 3.3, 7.9] {
            assert!((f.value(t) - 0.1 * (TAU * t / 1.5 + 0.4).sin()).abs() < 1e-14);
        }
        let at_once = sine(0.1, 1.5, 0.0, 0.0);
        assert!((at_once.rate(0.0) - 0.1 * TAU / 1.5).abs() < 1e-14);
        assert!(sine(0.0, 1.0, 0.0, 0.0).is_still() && !f.is_still());
    }

    /// Eight sines that repeat after 4 s.
    fn eight() -> Vec<Component> {
        let of = |k: u32| Component {
            amplitude: 0.02 / f64::from(k),
            frequency: f64::from(k) * TAU / 4.0,
            phase: f64::from(k * k),
        };
        (1..9).map(of).collect()
    }

    #[test]
    fn many_sines_hold_together() {
        holds_together(&Formula::sines(eight(), 1.0, 4.0), 12.0);
    }

    #[test]
    fn looks_at_all_times_at_once_are_those_at_each() {
        let components = eight();
        let looks = Looks { count: 3 * BLOCK + 5, repeat: 4.0 };
        let sums = looks.sums(&components);
        assert_eq!(sums.len(), looks.count + 1);
        for (k, sum) in sums.iter().enumerate() {
            let one = sum_at(&components, looks.time(k));
            assert!((0..3).all(|n| (sum[n] - one[n]).abs() < 1e-13), "{k}: {sum:?} {one:?}");
        }
    }

    #[test]
    fn the_stroke_follows_the_water_under_a_solitary_wave() {
        let (height, depth) = (0.1_f64, 0.3_f64);
        let number = (0.75 * height / depth.powi(3)).sqrt();
        let celerity = (9.81 * (depth + height)).sqrt();
        let f = Formula::solitary(height, depth, number, celerity);
        holds_together(&f, 3.0);
        let Form::Stroke(stroke) = &f.0 else { unreachable!() };
        let middle = 0.5 * stroke.duration();
        // w' = c eta / (d + eta) with eta where the piston is
        for k in 0..100 {
            let t = 0.02 * f64::from(k);
            let crest = number * (celerity * (t - middle) - (f.value(t) - stroke.half * stroke.end.tanh()));
            let eta = height / crest.cosh().powi(2);
            let wanted = celerity * eta / (depth + eta);
            assert!((f.rate(t) - wanted).abs() < 2e-3 * celerity, "{t}: {} {wanted}", f.rate(t));
        }
        // Goring (1978): the whole stroke is sqrt(16 H d / 3)
        let whole = (16.0 * height * depth / 3.0).sqrt();
        assert!((f.value(100.0) / whole - 1.0).abs() < 2e-3 && f.rate(100.0) == 0.0);
    }
}
