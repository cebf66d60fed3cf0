//! Things out of all proportion: one length that is far too large makes an empty room that takes all memory there is. It
//! shows in the numbers of a case, before anything is built.

use crate::case::Case;
use crate::error::{CaseError, Problem, Result};
use crate::estimate::{Estimate, bytes};
use crate::extents::{self, Outlier};

/// Times all else that one thing may make a scene longer before it is told of, and before it can be a slip.
const FAR: f64 = 100.0;
const FARTHEST: f64 = 1000.0;
/// Memory of an empty room that is not worth a word [bytes].
const LITTLE: f64 = 5e7;
/// The further out, the less memory makes it a slip: a thousand times all else for 2 GB, ten thousand for 200 MB [bytes].
const SLIP: f64 = 2e12;

/// What reaches far beyond all else in `case`, which has passed its check: problems, and warnings where it may be meant.
fn problems(case: &Case) -> Vec<Problem> {
    let axes = if case.run.dimensions == 2 { &[0, 2][..] } else { &[0, 1, 2] };
    let mut far = extents::outliers(case, &extents::all(case), axes, FAR);
    if far.is_empty() {
        return vec![];
    }
    let estimate = Estimate::new(case);
    let mut told: Vec<String> = vec![];
    far.retain(|one| {
        !told.contains(&one.key) && {
            told.push(one.key.clone());
            true
        }
    });
    let number = |x: f64| if x.abs() < 1e6 { format!("{x:.1}") } else { format!("{x:.1e}") };
    let problem = |Outlier { key, axis, end, times }: Outlier| {
        let message = format!(
            "{key}: it reaches to {} = {} m and makes the scene {} times as long as all else does: {:.1e} particles and \
             {:.1e} cells of search would take {} of memory",
            ["x", "y", "z"][axis],
            number(end),
            number(times),
            estimate.particles,
            estimate.cells,
            bytes(estimate.memory_beside_device)
        );
        let slip = times > FARTHEST && times * estimate.memory_beside_device > SLIP;
        let remedy = "lengths are metres: correct it, or take it nearer to the rest";
        (slip || estimate.room > LITTLE)
            .then(|| Problem { warning: !slip, ..Problem::new(key, message, remedy) })
    };
    far.into_iter().filter_map(problem).collect()
}

/// Refuses a case with a length that can only be a slip; otherwise returns what a user should know of those that may be
/// meant.
///
/// # Errors
/// [`crate::error::Error::Case`] with the keys that take things too far.
pub fn refuse(case: &Case) -> Result<Vec<String>> {
    let (warnings, wrong): (Vec<Problem>, Vec<Problem>) = problems(case).into_iter().partition(|p| p.warning);
    if wrong.is_empty() {
        return Ok(warnings.into_iter().map(|p| format!("{}; {}", p.message, p.remedy)).collect());
    }
    let wrong = wrong.into_iter().map(|p| CaseError::of(p.key, p.message, p.remedy));
    Err(CaseError::all(wrong.collect()).into())
}
