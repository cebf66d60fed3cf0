//! Charts as SVG and PNG. The only file that knows the plotting library.

use super::write_whole;
use crate::error::{Error, Result};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::plot::{LegendPosition, LinePlot, LineStyle};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use std::path::{Path, PathBuf};

/// An axis.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Label with unit.
    pub label: String,
    /// Logarithmic; values that are not positive are left out.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), log: false }
    }

    /// A logarithmic axis.
    pub fn log(label: &str) -> Self {
        Self { label: label.into(), log: true }
    }

    fn takes(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }
}

/// Shape of the marks of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A filled disc.
    Circle,
    /// A filled square.
    Square,
    /// A filled triangle.
    Triangle,
    /// A diagonal cross.
    Cross,
    /// A star.
    Star,
}

/// How the points of a series are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// A drawn line.
    Solid,
    /// A dashed line.
    Dashed,
}

/// Points of one kind.
#[derive(Clone, Debug)]
pub struct Series {
    /// Entry in the legend.
    pub name: String,
    /// Colour, `#rrggbb`.
    pub color: String,
    /// The points.
    pub points: Vec<[f64; 2]>,
    /// Lower and upper end of a bar along x, for each point; empty for none.
    pub spread: Vec<[f64; 2]>,
    /// Line through the points, in their order.
    pub stroke: Option<Stroke>,
    /// Mark on every point, and its size [pixels].
    pub mark: Option<(Mark, f64)>,
}

impl Series {
    /// A line.
    pub fn line(name: &str, color: &str, stroke: Stroke, points: Vec<[f64; 2]>) -> Self {
        Self {
            name: name.into(),
            color: color.into(),
            points,
            spread: Vec::new(),
            stroke: Some(stroke),
            mark: None,
        }
    }

    /// Marks.
    pub fn marks(name: &str, color: &str, mark: Mark, size: f64, points: Vec<[f64; 2]>) -> Self {
        Self {
            name: name.into(),
            color: color.into(),
            points,
            spread: Vec::new(),
            stroke: None,
            mark: Some((mark, size)),
        }
    }
}

/// Colours that readers with any colour vision can tell apart (Okabe and Ito).
pub const COLORS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#666666"];

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// First line.
    pub title: String,
    /// Second line, smaller: machine, adapter.
    pub subtitle: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, in order.
    pub series: Vec<Series>,
}

impl Chart {
    fn plots(&self) -> Vec<Plot> {
        let mut plots = Vec::new();
        for s in &self.series {
            let shown: Vec<usize> = (0..s.points.len())
                .filter(|&k| self.x.takes(s.points[k][0]) && self.y.takes(s.points[k][1]))
                .collect();
            if shown.is_empty() {
                continue;
            }
            let data: Vec<(f64, f64)> = shown.iter().map(|&k| (s.points[k][0], s.points[k][1])).collect();
            let mut named = false;
            if let Some(stroke) = s.stroke.filter(|_| data.len() > 1) {
                let style = match stroke {
                    Stroke::Solid => LineStyle::Solid,
                    Stroke::Dashed => LineStyle::Dashed,
                };
                let mut line = LinePlot::new()
                    .with_data(data.clone())
                    .with_color(s.color.as_str())
                    .with_stroke_width(1.8)
                    .with_line_style(style);
                if s.mark.is_none() {
                    line = line.with_legend(s.name.as_str());
                    named = true;
                }
                plots.push(Plot::Line(line));
            }
            if let Some((mark, size)) = s.mark {
                let shape = match mark {
                    Mark::Circle => MarkerShape::Circle,
                    Mark::Square => MarkerShape::Square,
                    Mark::Triangle => MarkerShape::Triangle,
                    Mark::Cross => MarkerShape::Cross,
                    Mark::Star => MarkerShape::Star,
                };
                let mut scatter = ScatterPlot::new()
                    .with_data(data)
                    .with_color(s.color.as_str())
                    .with_size(size)
                    .with_marker(shape);
                if s.spread.len() == s.points.len() {
                    let bars = shown
                        .iter()
                        .map(|&k| (s.points[k][0] - s.spread[k][0], s.spread[k][1] - s.points[k][0]));
                    scatter = scatter.with_x_err_asymmetric(bars.collect::<Vec<_>>());
                }
                if !named {
                    scatter = scatter.with_legend(s.name.as_str());
                }
                plots.push(Plot::Scatter(scatter));
            }
        }
        plots
    }

    /// Range of axis `k` with a margin; `None` without points.
    fn range(&self, k: usize) -> Option<(f64, f64)> {
        let shown = self.series.iter().flat_map(|s| &s.points);
        let shown = shown.filter(|p| self.x.takes(p[0]) && self.y.takes(p[1])).map(|p| p[k]);
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let log = if k == 0 { self.x.log } else { self.y.log };
        if low > high {
            None
        } else if log {
            let margin = (high / low).powf(0.06).max(1.25);
            Some((low / margin, high * margin))
        } else {
            let margin = (0.05 * (high - low)).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
            Some((low - margin, high + margin))
        }
    }

    fn layout(&self, plots: &[Plot]) -> Layout {
        let mut layout = Layout::auto_from_plots(plots)
            .with_width(900.0)
            .with_height(520.0)
            .with_title(self.title.as_str())
            .with_title_size(17)
            .with_title_wrap(64)
            .with_subtitle(self.subtitle.as_str())
            .with_x_label(self.x.label.as_str())
            .with_y_label(self.y.label.as_str())
            .with_legend_position(LegendPosition::OutsideRightTop);
        // A little air, so that no mark is cut by the frame.
        if let Some((low, high)) = self.range(0) {
            layout = layout.with_x_axis_min(low).with_x_axis_max(high);
        }
        if let Some((low, high)) = self.range(1) {
            layout = layout.with_y_axis_min(low).with_y_axis_max(high);
        }
        if self.x.log {
            layout = layout.with_log_x();
        }
        if self.y.log {
            layout = layout.with_log_y();
        }
        layout
    }

    /// The chart as SVG; `None` if there is no point to draw.
    pub fn svg(&self) -> Option<String> {
        let plots = self.plots();
        (!plots.is_empty()).then(|| {
            let layout = self.layout(&plots);
            kuva::render_to_svg(plots, layout)
        })
    }

    /// Write `STEM.svg` and `STEM.png`. A chart without a point writes nothing; returns whether it wrote.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, stem: &Path) -> Result<bool> {
        let Some(svg) = self.svg() else { return Ok(false) };
        // Names may have dots in them, so that the extension is added, not replaced.
        let with = |extension: &str| PathBuf::from(format!("{}.{extension}", stem.display()));
        write_whole(&with("svg"), svg.as_bytes())?;
        let plots = self.plots();
        let layout = self.layout(&plots);
        let path = with("png");
        let png = kuva::render_to_png(plots, layout, 1.5)
            .map_err(|e| Error::io(&path)(std::io::Error::other(e.to_string())))?;
        write_whole(&path, &png)?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, Chart, Mark, Series};

    #[test]
    fn what_a_logarithmic_axis_cannot_show_is_left_out_and_an_empty_chart_is_none() {
        let points = vec![[0.0, 1.0], [-1.0, 2.0], [f64::NAN, 1.0]];
        let mut chart = Chart { x: Axis::log("time [s]"), y: Axis::log("error [-]"), ..Chart::default() };
        chart.series.push(Series::marks("a", "#000000", Mark::Circle, 4.0, points));
        assert!(chart.svg().is_none());
        chart.series[0].points.push([10.0, 1e-3]);
        let svg = chart.svg().unwrap_or_default();
        assert!(svg.contains("time [s]") && svg.contains("error [-]"));
    }
}
