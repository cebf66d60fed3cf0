//! Draws a [`Chart`] as SVG, with text as text and the legend beside the plot. The only file that knows the
//! plotting library.

use crate::plot::{Axis, Chart, Mark, Series, Stroke};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

/// Size on the page [pixels].
const SIZE: (u32, u32) = (900, 520);
/// The library rounds to whole pixels: drawn on a finer grid, curves stay smooth.
const FINE: u32 = 4;
const FONT: &str = "Helvetica, Arial, sans-serif";
/// Letters a line in the legend and in the title.
const LEGEND_LETTERS: usize = 27;
const TITLE_LETTERS: usize = 80;
/// Width of a letter over the size of its font, on average.
const LETTER: f64 = 0.56;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn px(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

/// Text of `pixels` in `color`; the library takes the font's box, 1.24 times its size.
fn font(pixels: f64, color: RGBColor, at: Pos) -> TextStyle<'static> {
    let style = TextStyle::from((FONT, pixels * 1.24 * f64::from(FINE)).into_font());
    TextStyle { color: color.to_backend_color(), ..style }.pos(at)
}

const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const FAINT: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);
const FAINTER: RGBColor = RGBColor(0xf3, 0xf3, 0xf3);

/// `#rrggbb`, or black.
fn color(hex: &str) -> RGBColor {
    let part = |k: usize| hex.get(k..k + 2).and_then(|h| u8::from_str_radix(h, 16).ok()).unwrap_or(0);
    RGBColor(part(1), part(3), part(5))
}

/// The words of `text` in lines of at most `letters`.
fn lines(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// An axis on paper: what it spans, labelled ticks, unlabelled ones; of the logarithm on a logarithmic axis.
#[derive(Clone, Debug, PartialEq)]
struct Scale {
    log: bool,
    range: Range<f64>,
    labelled: Vec<f64>,
    between: Vec<f64>,
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let log = axis.log;
        let on_paper = values.map(|v| if log { v.log10() } else { v });
        let (low, high) = on_paper.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        // A little air, so that no mark is cut by the frame; a single value gets a range of its own size.
        let least = if log || high == 0.0 { 0.1 } else { 0.1 * high.abs() };
        let margin = if high > low { 0.05 * (high - low) } else { least };
        let margin = if log { margin.max(0.06) } else { margin };
        let range = low - margin..high + margin;
        let (labelled, between) = if log { log_ticks(&range) } else { linear_ticks(&range) };
        Self { log, range, labelled, between }
    }

    fn on_paper(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    fn value(&self, on_paper: f64) -> f64 {
        if self.log { 10f64.powf(on_paper) } else { on_paper }
    }

    /// Smallest distance of two labelled ticks.
    fn step(&self) -> f64 {
        self.labelled.windows(2).map(|w| self.value(w[1]) - self.value(w[0])).fold(f64::INFINITY, f64::min)
    }

    /// The text of a tick.
    fn label(&self, at: f64) -> String {
        if self.log {
            // Ticks of a logarithmic axis have two digits, or what tells them apart.
            let step = self.step().min(0.1 * 10f64.powf(at));
            return number(10f64.powf(at), step);
        }
        let largest = self.labelled.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        // Zero is never a rounding error, and has no sign.
        let at = if at.abs() < 1e-9 * largest { 0.0 } else { at };
        number(at, self.step().min(largest))
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let part = (self.on_paper(*value) - self.range.start) / (self.range.end - self.range.start);
        limit.0 + (part * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let ticks = if hint.weight().allow_light_points() { &self.between } else { &self.labelled };
        ticks.iter().map(|t| self.value(*t)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.value(self.range.start)..self.value(self.range.end)
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        self.label(self.on_paper(*value))
    }
}

/// `value` to the last digit of `step`, with an exponent where it is far from one.
fn number(value: f64, step: f64) -> String {
    let places = |step: f64| (-(step.log10() + 1e-6).floor()).clamp(0.0, 12.0) as usize;
    let exponent = (value.abs().log10() + 1e-9).floor();
    let text = |v: f64, step: f64| {
        let text = format!("{v:.*}", places(step));
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    };
    if value == 0.0 {
        "0".into()
    } else if (-3.0..5.0).contains(&exponent) {
        text(value, step)
    } else {
        let unit = 10f64.powf(exponent);
        format!("{}e{exponent}", text(value / unit, step / unit))
    }
}

/// Five to ten steps of 1, 2 or 5 times a power of ten, and the halves between.
fn linear_ticks(range: &Range<f64>) -> (Vec<f64>, Vec<f64>) {
    let span = range.end - range.start;
    let power = 10f64.powf((span / 10.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| span / s <= 8.0);
    let step = step.unwrap_or(10.0 * power);
    let multiples = |step: f64| -> Vec<f64> {
        let (first, last) = ((range.start / step).ceil(), (range.end / step).floor());
        (0..=(last - first).max(0.0) as usize).map(|k| (first + k as f64) * step).collect()
    };
    (multiples(step), multiples(0.5 * step))
}

/// Powers of ten; with few of them in range also 2 and 5 times these, with none the ticks of a linear axis.
fn log_ticks(range: &Range<f64>) -> (Vec<f64>, Vec<f64>) {
    let span = range.end - range.start;
    if span < 0.7 {
        let (labelled, between) = linear_ticks(&(10f64.powf(range.start)..10f64.powf(range.end)));
        let on_paper = |ticks: Vec<f64>| ticks.into_iter().map(f64::log10).collect();
        return (on_paper(labelled), on_paper(between));
    }
    let wanted: &[f64] = if span < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    // Decades that would stand too close are thinned out.
    let every = (span / 9.0).ceil().max(1.0) as i32;
    let (mut labelled, mut between) = (Vec::new(), Vec::new());
    for decade in range.start.floor() as i32..=range.end.ceil() as i32 {
        for m in 1..=9 {
            let m = f64::from(m);
            let at = f64::from(decade) + f64::log10(m);
            if range.contains(&at) {
                let named = wanted.contains(&m) && decade.rem_euclid(every) == 0;
                if named { &mut labelled } else { &mut between }.push(at);
            }
        }
    }
    if span > 2.5 {
        between.retain(|at| span < 8.0 || (at - at.round()).abs() < 1e-9);
    }
    (labelled, between)
}

/// The line of a series through `points`, on paper.
fn draw_line(area: &Area, points: Vec<(i32, i32)>, stroke: Stroke, ink: RGBColor) -> Drawn {
    let style = ink.stroke_width(px(1.8) as u32);
    match stroke {
        Stroke::Solid => area.draw(&PathElement::new(points, style)),
        Stroke::Dashed => area.draw(&DashedPathElement::new(points, px(6.0), px(4.0), style)),
    }
}

/// A mark of radius `size` [pixels] at `at`, on paper.
fn draw_mark(area: &Area, at: (i32, i32), mark: Mark, size: f64, ink: RGBColor) -> Drawn {
    let place = |[x, y]: [f64; 2]| (at.0 + px(size * x), at.1 + px(size * y));
    let polygon = |corners: &[[f64; 2]]| {
        area.draw(&Polygon::new(corners.iter().map(|c| place(*c)).collect::<Vec<_>>(), ink.filled()))
    };
    match mark {
        Mark::Circle => area.draw(&Circle::new(at, px(size), ink.filled())),
        Mark::Square => polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
        Mark::Triangle => polygon(&[[-1.1, 0.8], [1.1, 0.8], [0.0, -1.1]]),
        Mark::Cross => {
            let style = ink.stroke_width(px(1.5) as u32);
            area.draw(&PathElement::new([place([-0.8, -0.8]), place([0.8, 0.8])], style))?;
            area.draw(&PathElement::new([place([-0.8, 0.8]), place([0.8, -0.8])], style))
        }
        Mark::Star => {
            let corner = |k: u32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 5.0).sin_cos();
                let r = if k.is_multiple_of(2) { 1.4 } else { 0.6 };
                [r * sin, -r * cos]
            };
            polygon(&(0..10).map(corner).collect::<Vec<_>>())
        }
    }
}

/// Line, bars and marks of `series`; `place` brings values on paper.
fn draw_series(area: &Area, chart: &Chart, series: &Series, place: &dyn Fn([f64; 2]) -> (i32, i32)) -> Drawn {
    let shown = chart.shown(series);
    let at = |k: usize| place(series.points[k]);
    let ink = color(&series.color);
    if let Some(stroke) = series.stroke.filter(|_| shown.len() > 1) {
        draw_line(area, shown.iter().map(|&k| at(k)).collect(), stroke, ink)?;
    }
    let Some((mark, size)) = series.mark else { return Ok(()) };
    for &k in &shown {
        if let Some(&[low, high]) = series.spread.get(k).filter(|s| s.iter().all(|v| chart.x.takes(*v))) {
            let y = series.points[k][1];
            let (low, high) = (place([low, y]), place([high, y]));
            let thin = ink.stroke_width(px(1.0) as u32);
            area.draw(&PathElement::new([low, high], thin))?;
            for end in [low, high] {
                area.draw(&PathElement::new([(end.0, end.1 - px(3.0)), (end.0, end.1 + px(3.0))], thin))?;
            }
        }
        draw_mark(area, at(k), mark, size, ink)?;
    }
    Ok(())
}

/// Names of the series with their strokes and marks, below each other from `top` on.
fn draw_legend(area: &Area, named: &[&Series], left: f64, top: f64) -> Drawn {
    let mut y = top;
    for series in named {
        let ink = color(&series.color);
        if let Some(stroke) = series.stroke {
            draw_line(area, vec![(px(left), px(y)), (px(left + 24.0), px(y))], stroke, ink)?;
        }
        if let Some((mark, size)) = series.mark {
            draw_mark(area, (px(left + 12.0), px(y)), mark, size, ink)?;
        }
        for line in lines(&series.name, LEGEND_LETTERS) {
            let style = font(12.0, INK, Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(line, (px(left + 31.0), px(y)), style))?;
            y += 15.0;
        }
        y += 6.0;
    }
    Ok(())
}

/// Title and subtitle; returns the height that they take [pixels].
fn draw_titles(area: &Area, chart: &Chart) -> Result<f64, DrawingAreaErrorKind<std::io::Error>> {
    let mut y = 12.0;
    let middle = px(0.5 * f64::from(SIZE.0));
    let rows =
        [(&chart.title, 16.0, INK, TITLE_LETTERS), (&chart.subtitle, 12.0, RGBColor(0x66, 0x66, 0x66), 120)];
    for (text, size, ink, letters) in rows {
        for line in lines(text, letters) {
            area.draw(&Text::new(line, (middle, px(y)), font(size, ink, Pos::new(HPos::Center, VPos::Top))))?;
            y += 1.3 * size;
        }
    }
    Ok(y)
}

fn draw_on(area: &Area, chart: &Chart) -> Drawn {
    area.fill(&WHITE)?;
    let top = draw_titles(area, chart)? + 8.0;
    let named: Vec<&Series> =
        chart.series.iter().filter(|s| !s.name.is_empty() && !chart.shown(s).is_empty()).collect();
    let longest = named.iter().flat_map(|s| lines(&s.name, LEGEND_LETTERS)).map(|l| l.chars().count()).max();
    let legend = longest.map_or(0.0, |letters| 46.0 + 12.0 * LETTER * letters as f64);

    let points = || chart.series.iter().flat_map(|s| chart.shown(s).into_iter().map(|k| s.points[k]));
    let x = Scale::new(&chart.x, points().map(|p| p[0]));
    let y = Scale::new(&chart.y, points().map(|p| p[1]));
    let widest = y.labelled.iter().map(|t| y.label(*t).chars().count()).max().unwrap_or(0);
    let width = |pixels: f64| px(pixels) as u32;
    let mut context = ChartBuilder::on(area)
        .margin_top(width(top))
        .margin_left(width(26.0))
        .margin_right(width(18.0 + legend))
        .margin_bottom(width(26.0))
        .x_label_area_size(width(24.0))
        .y_label_area_size(width(14.0 + 12.0 * 0.6 * widest as f64))
        .build_cartesian_2d(x, y)?;
    context
        .configure_mesh()
        .bold_line_style(FAINT.stroke_width(width(1.0)))
        .light_line_style(FAINTER.stroke_width(width(1.0)))
        .axis_style(INK.stroke_width(width(1.0)))
        .set_all_tick_mark_size(width(4.0))
        .label_style(font(12.0, INK, Pos::new(HPos::Left, VPos::Top)))
        .draw()?;
    let (across, down) = context.plotting_area().get_pixel_range();
    let middle = |r: &Range<i32>| (r.start + r.end) / 2;
    let centred = Pos::new(HPos::Center, VPos::Center);
    let below = (middle(&across), px(f64::from(SIZE.1) - 16.0));
    area.draw(&Text::new(chart.x.label.clone(), below, font(13.0, INK, centred)))?;
    let turned = font(13.0, INK, centred).transform(FontTransform::Rotate270);
    area.draw(&Text::new(chart.y.label.clone(), (px(16.0), middle(&down)), turned))?;
    let place = |p: [f64; 2]| context.backend_coord(&(p[0], p[1]));
    for series in &chart.series {
        draw_series(area, chart, series, &place)?;
    }
    draw_legend(area, &named, f64::from(SIZE.0) - legend, top + 8.0)
}

/// `chart` as SVG; it has a point to draw.
pub fn draw(chart: &Chart) -> String {
    let mut text = String::new();
    let fine = (SIZE.0 * FINE, SIZE.1 * FINE);
    {
        let area = SVGBackend::with_string(&mut text, fine).into_drawing_area();
        // Text goes to memory: there is nothing that could fail.
        let _ = draw_on(&area, chart).and_then(|()| area.present());
    }
    // Drawn on a grid of its own, shown at the size of the page.
    let on_grid = format!("width=\"{}\" height=\"{}\"", fine.0, fine.1);
    text.replacen(&on_grid, &format!("width=\"{}\" height=\"{}\"", SIZE.0, SIZE.1), 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::COLORS;

    fn scale(log: bool, low: f64, high: f64) -> (Vec<String>, Scale) {
        let scale = Scale::new(&Axis { log, ..Axis::default() }, [low, high].into_iter());
        (scale.labelled.iter().map(|t| scale.label(*t)).collect(), scale)
    }

    #[test]
    fn ticks_are_round_and_no_two_have_the_same_text() {
        assert_eq!(scale(false, 0.0, 1.0).0, ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(scale(false, -0.1, 0.1).0, ["-0.1", "-0.05", "0", "0.05", "0.1"]);
        assert_eq!(scale(true, 0.01, 100.0).0, ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(scale(true, 1.0, 30.0).0, ["1", "2", "5", "10", "20"]);
        assert_eq!(scale(false, 0.0, 3e6).0, ["0", "5e5", "1e6", "1.5e6", "2e6", "2.5e6", "3e6"]);
        for (log, low, high) in [
            (false, 0.99931, 0.99937),
            (false, -3e-7, 2e-7),
            (false, 5.0, 5.0),
            (false, 0.0, 0.0),
            (true, 2.1, 2.2),
            (true, 1e-16, 1e3),
            (true, 7.0, 7.0),
        ] {
            let (labels, scale) = scale(log, low, high);
            assert!((2..=12).contains(&labels.len()), "{low} to {high}: {labels:?}");
            let mut all = labels.clone();
            all.dedup();
            assert_eq!(all, labels, "{low} to {high}");
            let (start, end) = (scale.range.start, scale.range.end);
            let slack = 1e-9 * (end - start);
            assert!(scale.labelled.iter().all(|t| *t >= start - slack && *t <= end + slack), "{scale:?}");
        }
    }

    #[test]
    fn text_stays_text_and_is_escaped() {
        let mut chart =
            Chart { x: Axis::log("time [s]"), y: Axis::linear("p < 1 & more [Pa]"), ..Chart::default() };
        chart.title =
            "a title that is long enough to need more than one line of a chart, for it goes on and on".into();
        chart.series.push(Series::line("ours", COLORS[0], Stroke::Dashed, vec![[1.0, 2.0], [10.0, 3.0]]));
        chart.series.push(Series::marks("nothing to show", COLORS[1], Mark::Star, 4.0, vec![[-1.0, 2.0]]));
        let svg = chart.svg().unwrap_or_default();
        assert!(
            svg.contains("ours") && svg.contains("p &lt; 1 &amp; more [Pa]") && svg.ends_with("</svg>\n")
        );
        assert!(!svg.contains("nothing to show"), "a series without a point is not in the legend");
        assert!(
            svg.starts_with("<svg width=\"900\" height=\"520\" viewBox=\"0 0 3600 2080\""),
            "{}",
            &svg[..80]
        );
    }
}
