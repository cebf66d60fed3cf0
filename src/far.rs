//! Things out of all proportion: one length that is far too large makes an empty room that takes all memory there is. It
//! shows in the numbers of a case, before anything is built.

use crate::case::{AXES, Case};
use crate::error::{CaseError, Problem, Result};
use crate::estimate::{Estimate, bytes};
use crate::extents::{self, Bounds, Extent, Of};

/// Times all else that one thing may make a scene longer before it is told of, and before it can be a slip.
const FAR: f64 = 100.0;
const FARTHEST: f64 = 1000.0;
/// Times more that several of a kind may: they are less likely a slip.
const MANY: f64 = 10.0;
/// Memory of an empty room that is not worth a word [bytes].
const LITTLE: f64 = 5e7;
/// The further out, the less memory makes it a slip: a thousand times all else for 2 GB, ten thousand for 200 MB [bytes].
const SLIP: f64 = 2e12;

/// A thing that reaches far beyond all others along an axis.
struct Outlier {
    /// The key that takes it there.
    key: String,
    axis: usize,
    /// Where it ends [m].
    end: f64,
    /// Length of all over that of all others, but for those of its kind that are as far out.
    times: f64,
}

/// A thing as a whole.
struct Item<'a> {
    /// Path of its table, e.g. `body.0`.
    name: &'a str,
    bounds: Bounds,
}

impl Item<'_> {
    /// Its table, e.g. `body`.
    fn kind(&self) -> &str {
        match self.name.rsplit_once('.') {
            Some((kind, number)) if number.bytes().all(|c| c.is_ascii_digit()) => kind,
            _ => self.name,
        }
    }

    /// How far it reaches out of `rest` along `axis` [m].
    fn beyond(&self, rest: Bounds, axis: usize) -> f64 {
        (self.bounds.hi[axis] - rest.hi[axis]).max(rest.lo[axis] - self.bounds.lo[axis])
    }
}

fn around<'a>(items: impl Iterator<Item = &'a Item<'a>>) -> Bounds {
    items.fold(Bounds::NONE, |all, item| all.union(item.bounds))
}

/// Things that make the scene more than [`FAR`] times as long along one of `axes`, the worst first.
fn outliers(case: &Case, extents: &[Extent], axes: &[usize]) -> Vec<Outlier> {
    let mut items: Vec<Item> = vec![];
    for extent in extents {
        let own = if extent.of == Of::Wall(false) { Bounds::NONE } else { extent.bounds };
        match items.last_mut().filter(|last| last.name == extent.item) {
            Some(last) => last.bounds = last.bounds.union(own),
            None => items.push(Item { name: &extent.item, bounds: own }),
        }
    }
    items.extend(case.run.domain.map(|[lo, hi]| Item { name: "run.domain", bounds: Bounds::new(lo, hi) }));
    let whole = around(items.iter());
    let mut found: Vec<Outlier> = vec![];
    for kind in items.chunk_by(|a, b| a.kind() == b.kind()).map(|same| same[0].kind()) {
        let others = around(items.iter().filter(|i| i.kind() != kind));
        let alone = others.lo.x > others.hi.x;
        for (k, item) in items.iter().enumerate().filter(|(_, i)| i.kind() == kind) {
            for &axis in axes {
                let beyond = item.beyond(others, axis);
                // Most things can be passed over without a look at all the others.
                let (low, high) = (item.bounds.lo[axis], item.bounds.hi[axis]);
                let is_near = if alone {
                    low > whole.lo[axis] && high < whole.hi[axis]
                } else {
                    1.0 + 2.0 * beyond / others.size(axis).max(case.run.spacing) <= FAR
                };
                if is_near {
                    continue;
                }
                let is_peer = |i: &Item| !alone && i.kind() == kind && i.beyond(others, axis) > 0.5 * beyond;
                let different = items.iter().enumerate().filter(|(j, i)| *j != k && !is_peer(i));
                let (peers, rest) =
                    (items.len() - 1 - different.clone().count(), around(different.map(|d| d.1)));
                if rest.lo.x > rest.hi.x {
                    continue;
                }
                let times = item.bounds.union(rest).size(axis) / rest.size(axis).max(case.run.spacing);
                let most = if peers > 0 { MANY * FAR } else { FAR };
                if times.is_nan() || times <= most {
                    continue;
                }
                found.push(outlier(extents, item, rest, axis, times));
            }
        }
    }
    found.sort_by(|a, b| b.times.total_cmp(&a.times));
    found
}

fn outlier(extents: &[Extent], item: &Item, rest: Bounds, axis: usize, times: f64) -> Outlier {
    let Item { name, bounds } = *item;
    let below = rest.lo[axis] - bounds.lo[axis] > bounds.hi[axis] - rest.hi[axis];
    let end = if below { bounds.lo[axis] } else { bounds.hi[axis] };
    let reaches = |e: &&Extent| if below { e.bounds.lo[axis] <= end } else { e.bounds.hi[axis] >= end };
    // Where a thing stands comes before where its motions take it.
    let key = extents.iter().filter(|e| e.item == name).find(reaches).map(|e| match e.key {
        "max" if below => format!("{name}.min"),
        key => format!("{name}.{key}"),
    });
    Outlier { key: key.unwrap_or_else(|| name.to_owned()), axis, end, times }
}

/// What reaches far beyond all else in `case`, which has passed its check: problems, and warnings where it may be meant.
fn problems(case: &Case) -> Vec<Problem> {
    let axes = if case.run.dimensions == 2 { &[0, 2][..] } else { &[0, 1, 2] };
    let mut far = outliers(case, &extents::all(case), axes);
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
            AXES[axis],
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
