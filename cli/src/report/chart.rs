//! Curves over time and bars as SVG that takes the colours of the page.

use super::page::escape;
use seixo_study::plot::thinned;
use std::fmt::Write;

/// Size of a chart and what is left free around it [pixels].
const SIZE: [f64; 2] = [480.0, 240.0];
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 38.0;
/// Colours of the page.
const COLORS: usize = 6;

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// What it is, for the key.
    pub name: String,
    /// Time [s] and value.
    pub points: Vec<[f64; 2]>,
}

/// Curves that share their axes.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// What is seen, with its unit.
    pub title: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Whether they are told apart by their dashes too, where one may cover another.
    pub dashed: bool,
}

/// Dashes of curves that may cover each other: the first shows between those of the others.
const DASHES: [&str; COLORS] = ["none", "9 5", "3 4", "12 4 3 4", "6 8", "1 5"];

/// Places of round numbers in a range, about `count` of them.
fn ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let rough = (high - low) / count;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough);
    let step = step.unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last.min(first + 20)).map(|k| k as f64 * step).collect()
}

/// What stands at the `ticks` of an axis: as many digits as tell them apart.
fn labels(ticks: &[f64]) -> Vec<String> {
    let most = ticks.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
    let step = ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    // Steps are 1, 2 or 5 times a power of ten, but for what rounding leaves.
    let power = |x: f64| (x.log10() + 1e-6).floor() as i32;
    if !step.is_finite() || most == 0.0 {
        return ticks.iter().map(|&t| short(t)).collect();
    }
    let (decimals, digits) = ((-power(step)).max(0) as usize, (power(most) - power(step)).max(0) as usize);
    let plain = |t: f64| {
        let text = format!("{t:.decimals$}");
        if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    };
    let label = |&t: &f64| match t {
        // Sums of steps may miss it.
        _ if t.abs() < 1e-6 * step => "0".to_owned(),
        _ if most < 1e5 && step > 1e-5 => plain(t),
        _ => format!("{t:.digits$e}"),
    };
    ticks.iter().map(label).collect()
}

/// A number as words have it.
fn short(x: f64) -> String {
    let x = if x.abs() < 1e-300 { 0.0 } else { x };
    if x == 0.0 || (1e-3..1e5).contains(&x.abs()) {
        let text = format!("{x:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{x:.1e}")
}

impl Chart {
    /// The chart as a figure of the page; nothing if there is nothing to see.
    pub fn figure(&self) -> String {
        let curves: Vec<(usize, &Curve, Vec<[f64; 2]>)> =
            self.curves.iter().enumerate().map(|(k, c)| (k, c, thinned(&c.points))).collect();
        let all = || curves.iter().flat_map(|(_, _, points)| points);
        if all().count() < 2 {
            return String::new();
        }
        let range = |k: usize| {
            let (low, high) =
                all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
            // What never changes is a line in the middle.
            let room = if high - low > 1e-12 * high.abs().max(low.abs()) {
                0.0
            } else if high == 0.0 {
                0.5
            } else {
                0.5 * high.abs()
            };
            (low - room, high + room)
        };
        let ((t0, t1), (y0, y1)) = (range(0), range(1));
        let (levels, times) = (ticks(y0, y1, 4.0), ticks(t0, t1, 5.0));
        let named = labels(&levels);
        let left = named.iter().map(|l| 6.5 * l.len() as f64 + 14.0).fold(LEFT, f64::max);
        let x = |t: f64| left + (t - t0) / (t1 - t0) * (SIZE[0] - left - RIGHT);
        let y = |v: f64| SIZE[1] - BOTTOM - (v - y0) / (y1 - y0) * (SIZE[1] - TOP - BOTTOM);
        let mut svg = String::new();
        for (v, label) in levels.into_iter().zip(named) {
            let at = y(v);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{left}\" x2=\"{}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                SIZE[0] - RIGHT,
                left - 6.0,
                at + 4.0
            );
        }
        for (&t, label) in times.iter().zip(labels(&times)) {
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
                x(t),
                SIZE[1] - BOTTOM + 17.0
            );
        }
        let _ = write!(
            svg,
            "<line class=\"axis\" x1=\"{left}\" x2=\"{}\" y1=\"{1}\" y2=\"{1}\"/>\
             <text x=\"{2}\" y=\"{3}\" text-anchor=\"middle\">t [s]</text>",
            SIZE[0] - RIGHT,
            SIZE[1] - BOTTOM,
            0.5 * (left + SIZE[0] - RIGHT),
            SIZE[1] - 4.0
        );
        let mut key = String::new();
        for (k, curve, points) in &curves {
            let color = format!("var(--c{})", k % COLORS);
            let dash = if self.dashed && *k > 0 {
                format!(";stroke-dasharray:{}", DASHES[k % COLORS])
            } else {
                String::new()
            };
            let line: Vec<String> = points.iter().map(|p| format!("{:.1},{:.1}", x(p[0]), y(p[1]))).collect();
            let _ = write!(
                svg,
                "<polyline class=\"curve\" style=\"stroke:{color}{dash}\" points=\"{}\"/>",
                line.join(" ")
            );
            if curves.len() > 1 {
                let name = escape(&curve.name);
                // One that is told by its dashes shows them.
                let mark = if dash.is_empty() {
                    format!("<i style=\"background:{color}\"></i>")
                } else {
                    let line = format!(
                        "<line x1=\"0\" x2=\"32\" y1=\"2\" y2=\"2\" class=\"curve\" style=\"stroke:{color}{dash}\"/>"
                    );
                    format!("<svg viewBox=\"0 0 32 4\" aria-hidden=\"true\">{line}</svg>")
                };
                let _ = write!(key, "<span class=\"key\">{mark}{name}</span>");
            }
        }
        let said = self.said(&curves);
        format!(
            "<figure><h3>{}</h3><svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">{svg}</svg>\
             <figcaption>{key}</figcaption></figure>\n",
            escape(&self.title),
            SIZE[0],
            SIZE[1],
            escape(&said)
        )
    }

    /// The chart in words, for those who hear it.
    fn said(&self, curves: &[(usize, &Curve, Vec<[f64; 2]>)]) -> String {
        let curve = |(_, curve, points): &(usize, &Curve, Vec<[f64; 2]>)| {
            let (Some(first), Some(last)) = (points.first(), points.last()) else { return String::new() };
            let low = points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
            let high = points.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
            let [a, b, low, high] = [first[1], last[1], low, high].map(short);
            format!("{}: from {a} to {b}, between {low} and {high}", curve.name)
        };
        let words: Vec<String> = curves.iter().map(curve).filter(|w| !w.is_empty()).collect();
        format!("{} over time. {}.", self.title, words.join("; "))
    }
}

/// Named amounts as bars, the largest first.
pub fn bars(title: &str, unit: &str, amounts: &[(String, f64)]) -> String {
    let mut amounts = amounts.to_vec();
    amounts.sort_by(|a, b| b.1.total_cmp(&a.1));
    let most = amounts.first().map_or(0.0, |a| a.1);
    if most <= 0.0 {
        return String::new();
    }
    let total: f64 = amounts.iter().map(|a| a.1).sum();
    let (row, left) = (20.0, 165.0);
    let height = row * amounts.len() as f64 + 6.0;
    let mut svg = String::new();
    for (k, (name, amount)) in amounts.iter().enumerate() {
        let y = row * k as f64;
        let width = amount / most * 210.0;
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <rect class=\"bar\" x=\"{left}\" y=\"{:.1}\" width=\"{width:.1}\" height=\"{}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\">{} {unit}, {:.0} %</text>",
            left - 6.0,
            y + 15.0,
            escape(name),
            y + 4.0,
            row - 6.0,
            left + width + 6.0,
            y + 15.0,
            short((amount * 1e3).round() / 1e3),
            100.0 * amount / total
        );
    }
    let said: Vec<String> = amounts.iter().map(|(name, x)| format!("{name} {} {unit}", short(*x))).collect();
    format!(
        "<figure><h3>{}</h3><svg viewBox=\"0 0 {} {height}\" role=\"img\" aria-label=\"{}\">{svg}</svg></figure>\n",
        escape(title),
        SIZE[0],
        escape(&format!("{title}: {}", said.join(", ")))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_axes_are_round_and_few() {
        assert_eq!(ticks(0.0, 1.0, 4.0), [0.0, 0.5, 1.0]);
        assert_eq!(ticks(-3.0, 7.0, 5.0).len(), 5);
        for (x, text) in [(0.5, "0.5"), (1000.0, "1000"), (2e6, "2.0e6"), (-0.02, "-0.02")] {
            assert_eq!(short(x), text);
        }
    }

    #[test]
    fn labels_of_an_axis_are_told_apart() {
        for (low, high, expected) in [
            (0.0, 1.0, vec!["0", "0.5", "1"]),
            (613.12, 613.13, vec!["613.12", "613.125", "613.13"]),
            (0.0, 2e-5, vec!["0", "1e-5", "2e-5"]),
            (101_325.0, 101_325.45, vec!["1.013250e5", "1.013252e5", "1.013254e5"]),
            (-0.0021, 0.0021, vec!["-0.002", "0", "0.002"]),
            (0.0, 4e6, vec!["0", "1e6", "2e6", "3e6", "4e6"]),
        ] {
            assert_eq!(labels(&ticks(low, high, 4.0)), expected);
        }
        for exponent in -12..12 {
            for offset in [0.0, 1.0, 123.0, -7.5e4] {
                let unit = 10_f64.powi(exponent);
                let mut told = labels(&ticks(offset * unit * 1e3, offset * unit * 1e3 + unit, 4.0));
                let count = told.len();
                told.dedup();
                assert!(told.len() == count && count > 1, "{offset} {exponent}: {told:?}");
            }
        }
    }

    #[test]
    fn a_chart_of_nothing_is_none_and_a_constant_is_a_line() {
        assert_eq!(Chart::default().figure(), "");
        let curve = Curve { name: "a<b".into(), points: vec![[0.0, 2.0], [1.0, 2.0], [2.0, f64::NAN]] };
        let figure = Chart { title: "x [m]".into(), curves: vec![curve], dashed: false }.figure();
        assert!(
            figure.contains("<polyline") && !figure.contains("NaN") && figure.contains("a&lt;b"),
            "{figure}"
        );
    }
}
