//! Charts: what is drawn. How it is drawn is in `plot_svg.rs`, the only file that knows the plotting library.

use crate::plot_svg;
use seixo::error::Result;
use seixo::output::write_whole;
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

    /// Whether the axis can show `value`.
    pub fn takes(&self, value: f64) -> bool {
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

/// Points of a curve; more would not be seen.
const POINTS: usize = 600;

/// As many points of a curve as are seen: of each stretch the lowest and the highest. Points that are no numbers are left out.
pub fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let points: Vec<[f64; 2]> =
        points.iter().copied().filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
    if points.len() <= POINTS {
        return points;
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    let ends = points.chunks(stretch).flat_map(|part| {
        let by = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let (low, high) = (part.iter().min_by(by), part.iter().max_by(by));
        let mut both: Vec<[f64; 2]> = low.into_iter().chain(high).copied().collect();
        both.sort_by(|a, b| a[0].total_cmp(&b[0]));
        both
    });
    ends.collect()
}

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
    /// Indices of the points of `series` that both axes can show.
    pub fn shown(&self, series: &Series) -> Vec<usize> {
        let takes = |p: &[f64; 2]| self.x.takes(p[0]) && self.y.takes(p[1]);
        (0..series.points.len()).filter(|&k| takes(&series.points[k])).collect()
    }

    /// The chart as SVG; `None` if there is no point to draw.
    pub fn svg(&self) -> Option<String> {
        self.series.iter().any(|s| !self.shown(s).is_empty()).then(|| plot_svg::draw(self))
    }

    /// Write `STEM.svg`. A chart without a point writes nothing; returns whether it wrote.
    ///
    /// # Errors
    /// [`seixo::error::Error::Io`].
    pub fn write(&self, stem: &Path) -> Result<bool> {
        let Some(svg) = self.svg() else { return Ok(false) };
        // Names may have dots in them, so that the extension is added, not replaced.
        write_whole(&PathBuf::from(format!("{}.svg", stem.display())), svg.as_bytes())?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, Chart, Mark, POINTS, Series, thinned};

    #[test]
    fn peaks_survive_the_thinning() {
        let mut points: Vec<[f64; 2]> = (0..100_000).map(|k| [f64::from(k), 0.0]).collect();
        points[54_321][1] = 9.0;
        let thin = thinned(&points);
        assert!(thin.len() <= POINTS + 2 && thin.contains(&[54_321.0, 9.0]), "{}", thin.len());
    }

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
