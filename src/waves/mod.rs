//! Waves on water of even depth by theory, and the motion of a piston that makes them.
//!
//! A regular wave is made by linear theory (Biesel & Suquet 1951) with the second-order term that keeps a free wave of
//! twice the frequency away (Madsen 1971); a solitary one by following the water under it (Goring 1978); an irregular
//! sea as a sum of regular waves with the energies of a JONSWAP spectrum (Hasselmann et al. 1973).

mod formula;

pub use formula::{Component, Formula};

use crate::chance::mixed;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// What wave a piston makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum WaveKind {
    /// Waves of one height and period, after Biesel & Suquet (1951) and Madsen (1971).
    Regular,
    /// One crest, after Goring (1978).
    Solitary,
    /// An irregular sea with a JONSWAP spectrum, the same for the same `seed`.
    Jonswap,
}

impl WaveKind {
    /// Name, as in a case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Regular => "regular",
            Self::Solitary => "solitary",
            Self::Jonswap => "jonswap",
        }
    }
}

/// Which theory's shape a solitary wave has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Boussinesq's, k^2 = 3 H / (4 d^3), as Goring used it.
    #[default]
    Boussinesq,
    /// Rayleigh's, k^2 = 3 H / (4 d^2 (d + H)), which sheds less behind a high wave (Guizien & Barthelemy 2002).
    Rayleigh,
}

/// What is asked of a piston.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// Kind.
    pub kind: WaveKind,
    /// Height from trough to crest [m]; significant height 4 sqrt(m_0) of an irregular sea.
    pub height: f64,
    /// Period [s]; that of the spectrum's peak; not of a solitary wave.
    pub period: f64,
    /// Depth of the still water [m].
    pub depth: f64,
    /// Gravity [m/s2].
    pub gravity: f64,
    /// Time over which the motion grows [s].
    pub ramp: f64,
    /// Which of the irregular seas.
    pub seed: u32,
    /// gamma of the JONSWAP spectrum [-].
    pub peak_enhancement: f64,
    /// Shape of a solitary wave.
    pub profile: Profile,
}

/// A wave, and how a piston makes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// What was asked.
    pub wanted: Wanted,
    /// Wave length [m]; of the peak's period; 2 pi / k of a solitary wave.
    pub length: f64,
    /// Speed of the crest [m/s].
    pub celerity: f64,
    /// The piston's way from end to end [m].
    pub stroke: f64,
    /// The piston's way over time [m], towards the water.
    pub formula: Formula,
}

/// Wave number k [1/m] of w^2 = g k tanh k d for the angular frequency w [rad/s].
pub fn wave_number(frequency: f64, depth: f64, gravity: f64) -> f64 {
    // Newton's steps for x tanh x = y, x = k d, from a start that is never off by more than 5 %
    let y = frequency * frequency * depth / gravity;
    let mut x = y / (y.powf(0.75)).tanh().powf(2.0 / 3.0);
    for _ in 0..20 {
        let tanh = x.tanh();
        let step = (x * tanh - y) / (tanh + x * (1.0 - tanh * tanh));
        x -= step;
        if step.abs() <= 1e-15 * x {
            break;
        }
    }
    x / depth
}

/// Wave height over stroke of a piston, H / S = 2 (cosh 2 k d - 1) / (sinh 2 k d + 2 k d) (Biesel & Suquet 1951) [-].
pub fn biesel(kd: f64) -> f64 {
    // Times exp(-2 k d), so that deep water does not overflow.
    let e = (-2.0 * kd).exp();
    2.0 * (1.0 + e * e - 2.0 * e) / (1.0 - e * e + 4.0 * kd * e)
}

/// The highest regular wave, 0.142 L tanh k d (Miche 1944) [m].
pub fn miche(length: f64, depth: f64) -> f64 {
    0.142 * length * (TAU * depth / length).tanh()
}

/// Highest solitary wave over the depth (McCowan 1894) [-].
pub const MCCOWAN: f64 = 0.78;
/// H L^2 / d^3 above which second order does not describe a regular wave (Madsen 1971) [-].
pub const SECOND_ORDER: f64 = 8.0 * PI * PI / 3.0;

/// Frequencies of an irregular sea over that of the peak: below the first and above the last there is about 1 %
/// of the energy.
const BAND: [f64; 2] = [0.5, 3.0];
/// Periods of the peak after which an irregular sea repeats.
const REPEAT: f64 = 128.0;

impl Wave {
    /// The wave that is `wanted`; all of its numbers are finite and positive.
    pub fn new(wanted: Wanted) -> Self {
        match wanted.kind {
            WaveKind::Regular => Self::regular(wanted),
            WaveKind::Solitary => Self::solitary(wanted),
            WaveKind::Jonswap => Self::jonswap(wanted),
        }
    }

    fn regular(wanted: Wanted) -> Self {
        let Wanted { height, period, depth, gravity, ramp, .. } = wanted;
        let frequency = TAU / period;
        let number = wave_number(frequency, depth, gravity);
        let kd = number * depth;
        let transfer = biesel(kd);
        let stroke = height / transfer;
        // 3 cosh / sinh^3 without an overflow in deep water
        let e = (-2.0 * kd).exp();
        let bound = 12.0 * e * (1.0 + e) / (1.0 - e).powi(3);
        let second = height * height / (32.0 * depth) * (bound - 2.0 / transfer);
        let components = vec![
            Component { amplitude: 0.5 * stroke, frequency, phase: 0.0 },
            Component { amplitude: second, frequency: 2.0 * frequency, phase: 0.0 },
        ];
        let formula = Formula::sines(components, ramp, period);
        Self { wanted, length: TAU / number, celerity: frequency / number, stroke, formula }
    }

    fn solitary(wanted: Wanted) -> Self {
        let Wanted { height, depth, gravity, .. } = wanted;
        let under = match wanted.profile {
            Profile::Boussinesq => depth.powi(3),
            Profile::Rayleigh => depth * depth * (depth + height),
        };
        let number = (0.75 * height / under).sqrt();
        let celerity = (gravity * (depth + height)).sqrt();
        let formula = Formula::solitary(height, depth, number, celerity);
        Self { wanted, length: TAU / number, celerity, stroke: formula.reach()[1], formula }
    }

    fn jonswap(wanted: Wanted) -> Self {
        let Wanted { height, period, depth, gravity, ramp, seed, .. } = wanted;
        let repeat = REPEAT * period;
        let lines = (BAND[0] * REPEAT) as u32..=(BAND[1] * REPEAT) as u32;
        let shape: Vec<(f64, f64)> = lines
            .map(|k| f64::from(k) / REPEAT)
            .map(|over_peak| (over_peak, spectrum(over_peak, wanted.peak_enhancement)))
            .collect();
        let sum: f64 = shape.iter().map(|s| s.1).sum();
        let mut state = mixed(u64::from(seed));
        let components = shape.iter().map(|&(over_peak, share)| {
            let frequency = TAU * over_peak / period;
            // m_0 = (H / 4)^2, and a sine of amplitude a has a^2 / 2 of it
            let surface = 0.25 * height * (2.0 * share / sum).sqrt();
            state = mixed(state);
            let phase = TAU * (state >> 11) as f64 / (1_u64 << 53) as f64;
            let transfer = biesel(wave_number(frequency, depth, gravity) * depth);
            Component { amplitude: surface / transfer, frequency, phase }
        });
        let formula = Formula::sines(components.collect(), ramp, repeat);
        let number = wave_number(TAU / period, depth, gravity);
        let celerity = TAU / period / number;
        let [low, high] = formula.reach();
        Self { wanted, length: TAU / number, celerity, stroke: high - low, formula }
    }
}

/// Shape of the JONSWAP spectrum over f / f_p, without a scale (Hasselmann et al. 1973).
fn spectrum(f: f64, peak_enhancement: f64) -> f64 {
    let width = if f <= 1.0 { 0.07 } else { 0.09 };
    let peak = (-0.5 * ((f - 1.0) / width).powi(2)).exp();
    f.powi(-5) * (-1.25 * f.powi(-4)).exp() * peak_enhancement.powf(peak)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(kind: WaveKind) -> Wanted {
        Wanted {
            kind,
            height: 0.06,
            period: 1.2,
            depth: 0.3,
            gravity: 9.81,
            ramp: 2.4,
            seed: 1,
            peak_enhancement: 3.3,
            profile: Profile::Boussinesq,
        }
    }

    #[test]
    fn the_wave_number_solves_the_dispersion_relation() {
        for exponent in -40..40 {
            let frequency = 10_f64.powf(0.1 * f64::from(exponent));
            let k = wave_number(frequency, 0.5, 9.81);
            let back = (9.81 * k * (0.5 * k).tanh()).sqrt();
            assert!((back / frequency - 1.0).abs() < 1e-12, "{frequency}: {back}");
        }
        // shallow: c = sqrt(g d); deep: L = g T^2 / (2 pi)
        assert!((1e-3 / wave_number(1e-3, 1.0, 9.81) / 9.81_f64.sqrt() - 1.0).abs() < 1e-6);
        assert!((TAU / wave_number(TAU, 100.0, 9.81) / (9.81 / TAU) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_transfer_function_has_its_limits() {
        // shallow: k d; deep: 2; and as it is usually written between
        assert!((biesel(1e-3) / 1e-3 - 1.0).abs() < 1e-5 && (biesel(500.0) - 2.0).abs() < 1e-12);
        let x = 2.0 * 1.06_f64;
        let usual = 2.0 * (x.cosh() - 1.0) / (x.sinh() + x);
        assert!((biesel(1.06) / usual - 1.0).abs() < 1e-13);
    }

    /// Depth-averaged continuity at the piston to second order in long waves: X'(d + eta) is the Stokes wave's flux
    /// c eta, which fixes the term of twice the frequency.
    #[test]
    fn the_second_order_is_that_of_long_waves() {
        let mut w = wanted(WaveKind::Regular);
        (w.depth, w.period, w.height) = (0.1, 6.0, 1e-4);
        let wave = Wave::new(w);
        let (a, kd) = (0.5 * w.height, TAU / wave.length * w.depth);
        assert!(kd < 0.12);
        let sample = |t: f64| wave.formula.value(w.ramp + t);
        let frequency = TAU / w.period;
        // projection onto sin 2 w t over a period
        let n = 400;
        let second = (0..n).map(|k| {
            let t = w.period * f64::from(k) / f64::from(n);
            2.0 / f64::from(n) * sample(t) * (2.0 * frequency * (w.ramp + t)).sin()
        });
        let second: f64 = second.sum();
        let bound = 0.75 * a * a / (kd * kd * w.depth) + 0.5 * a * a / w.depth;
        let wanted = (bound - a * a / w.depth) / (2.0 * kd);
        assert!((second / wanted - 1.0).abs() < 0.01, "{second} {wanted}");
    }

    #[test]
    fn an_irregular_sea_has_its_height_its_peak_and_its_seed() {
        let sea = Wave::new(wanted(WaveKind::Jonswap));
        // m_0 of the surface, brought back from the piston's sines
        let surface = |wave: &Wave| {
            let of = |t: f64| wave.formula.value(wave.wanted.ramp + t);
            let n = 4096;
            let repeat = REPEAT * wave.wanted.period;
            let x: Vec<f64> = (0..n).map(|k| of(repeat * f64::from(k) / f64::from(n))).collect();
            x.iter().map(|x| x * x).sum::<f64>() / f64::from(n)
        };
        let lines = (BAND[0] * REPEAT) as u32..=(BAND[1] * REPEAT) as u32;
        let shape: Vec<(f64, f64)> =
            lines.map(|k| f64::from(k) / REPEAT).map(|f| (f, spectrum(f, 3.3))).collect();
        let sum: f64 = shape.iter().map(|s| s.1).sum();
        let expected: f64 = shape
            .iter()
            .map(|(f, share)| {
                let kd = wave_number(TAU * f / 1.2, 0.3, 9.81) * 0.3;
                share / sum * (0.06_f64 / 4.0).powi(2) / biesel(kd).powi(2)
            })
            .sum();
        assert!((surface(&sea) / expected - 1.0).abs() < 1e-6);
        let highest = shape.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((highest.0 - 1.0).abs() < 0.02);
        // Goda (1985): m_0 of the shape is 0.2 / (1 - 0.287 ln gamma), of which 1 / 324 lies above 3 f_p
        let whole = 0.2 / (1.0 - 0.287 * 3.3_f64.ln());
        assert!((sum / REPEAT - (whole - 1.0 / 324.0)).abs() < 0.004, "{}", sum / REPEAT);
        assert_eq!(sea, Wave::new(wanted(WaveKind::Jonswap)));
        let other = Wave::new(Wanted { seed: 2, ..wanted(WaveKind::Jonswap) });
        assert!((surface(&other) / expected - 1.0).abs() < 1e-6);
        assert!((other.formula.value(5.0) - sea.formula.value(5.0)).abs() > 1e-4);
    }
}
