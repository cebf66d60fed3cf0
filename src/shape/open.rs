//! Shapes of which others cover some sides: depths inside count to the sides that are left.

use std::sync::Mutex;

/// Places across a side at which it is looked at, over the spacing, and the most of them.
const LOOKS: f64 = 2.0;
const MOST_LOOKS: f64 = 40.0;

/// Shapes with some of their sides left out: the one that each is made of, which sides are left, and itself. They are
/// made once, and kept as those are.
pub(super) type Made<T> = Mutex<Vec<(usize, Vec<bool>, &'static T)>>;

/// What `make` gives for `shape` with the sides `open`; `None` if that is all of them or none.
pub(super) fn made<T>(
    known: &Made<T>,
    shape: &T,
    open: Vec<bool>,
    make: impl FnOnce(&[bool]) -> T,
) -> Option<&'static T> {
    if open.iter().all(|&o| o) || !open.contains(&true) {
        return None;
    }
    let key = std::ptr::from_ref(shape).addr();
    let mut known = known.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(found) = known.iter().find(|(of, sides, _)| *of == key && *sides == open) {
        return Some(found.2);
    }
    let shape: &'static T = Box::leak(Box::new(make(&open)));
    known.push((key, open, shape));
    Some(shape)
}

/// Number of places across `length` [m] at which a side is looked at.
pub(super) fn looks(length: f64, spacing: f64) -> u32 {
    (LOOKS * length / spacing).ceil().clamp(2.0, MOST_LOOKS) as u32
}
