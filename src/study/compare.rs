//! Errors of curves: against an experiment, or against the finest run of the study.

use super::definition::{Definition, ErrorMeasure, Files};
use super::row::{Class, Row};
use crate::error::{Error, Result};

impl ErrorMeasure {
    /// Name of the error, as in the tables.
    pub fn name(&self) -> String {
        match (&self.name, &self.value, &self.curve, &self.against) {
            (Some(name), ..) => name.clone(),
            (None, Some(value), ..) => value.clone(),
            (None, None, Some(curve), Some(against)) => format!("{curve} against {against} [-]"),
            _ => "error [-]".into(),
        }
    }
}

/// Two columns of numbers from a CSV text; lines that begin with `#` and the header are passed over.
///
/// # Errors
/// [`Error::Case`] if there are fewer than two rows.
pub fn table(name: &str, text: &str) -> Result<Vec<[f64; 2]>> {
    let rows: Vec<[f64; 2]> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .filter_map(|l| {
            let mut cells = l.split(',').map(|c| c.trim().parse::<f64>());
            Some([cells.next()?.ok()?, cells.next()?.ok()?])
        })
        .collect();
    if rows.len() < 2 {
        return Err(Error::Case(format!("{name}: expected two columns of numbers")));
    }
    Ok(rows)
}

/// `curve` at `x`, linear between its points; `None` outside.
fn at(curve: &[[f64; 2]], x: f64) -> Option<f64> {
    let k = curve.iter().position(|p| p[0] >= x)?;
    if k == 0 {
        return (curve[0][0] == x).then_some(curve[0][1]);
    }
    let ([x0, y0], [x1, y1]) = (curve[k - 1], curve[k]);
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
}

/// Rms difference of `curve` from `reference` at the points of `reference` that `curve` covers. `None` if they
/// share fewer than two points.
pub fn difference(curve: &[[f64; 2]], reference: &[[f64; 2]]) -> Option<f64> {
    let squares: Vec<f64> =
        reference.iter().filter_map(|r| at(curve, r[0]).map(|y| (y - r[1]).powi(2))).collect();
    (squares.len() > 1).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// The row to compare with: the one with the most particles, and of those the most steps, that has `curve`.
pub fn finest<'a>(rows: &'a [Row], curve: &str) -> Option<&'a Row> {
    let usable = |r: &&Row| r.measured.class <= Class::Degraded && r.measured.curves.contains_key(curve);
    let key = |r: &Row| (r.measured.work.particles, r.measured.work.steps);
    rows.iter().filter(usable).max_by_key(|r| key(r))
}

/// Put the errors of all curves into `rows`.
///
/// # Errors
/// A reference file that cannot be read.
pub fn curves(study: &Definition, rows: &mut [Row], files: &Files) -> Result<()> {
    for error in &study.error {
        let (Some(curve), Some(against)) = (&error.curve, &error.against) else { continue };
        let name = error.name();
        let (reference, own) = if against == "finest" {
            let Some(row) = finest(rows, curve) else { continue };
            (row.measured.curves[curve].clone(), Some(row.index))
        } else {
            (table(against, &files(against)?)?, None)
        };
        let range = reference.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
        for row in rows.iter_mut().filter(|r| Some(r.index) != own) {
            let Some(points) = row.measured.curves.get(curve) else { continue };
            // The experiment's tank may be longer: what lies beyond the run's last wall is not compared.
            let most = points.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
            let inside: Vec<[f64; 2]> =
                reference.iter().copied().filter(|r| own.is_some() || r[1] <= most).collect();
            if let Some(rms) = difference(points, &inside) {
                row.measured.put(&name, rms / range);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{difference, table};

    #[test]
    fn curves_are_compared_where_both_are_known() {
        let curve = [[0.0, 0.0], [2.0, 4.0]];
        assert_eq!(difference(&curve, &[[0.5, 1.0], [1.0, 2.0], [9.0, 100.0]]), Some(0.0));
        assert_eq!(difference(&curve, &[[0.0, 1.0], [1.0, 3.0]]), Some(1.0));
        assert_eq!(difference(&curve, &[[5.0, 1.0], [1.0, 3.0]]), None);
    }

    #[test]
    fn a_table_has_a_source_a_header_and_numbers() {
        assert_eq!(table("t", "# source\nt,x\n0,1\n1, 2.5\n").unwrap(), [[0.0, 1.0], [1.0, 2.5]]);
        assert!(table("t", "t,x\n0,1\n").is_err());
    }
}
