//! What has been placed so far, by where it stands: a body is held against what is near it alone, however many there
//! are.

use glam::{DVec3, IVec3};
use std::collections::{BTreeMap, HashMap};

/// Boxes of any size. Each lies in one cell of a grid whose cells are as wide as it or up to twice as wide.
#[derive(Default, Debug)]
pub(super) struct Near {
    boxes: Vec<(DVec3, DVec3)>,
    grids: BTreeMap<i32, Grid>,
}

/// Boxes of about one size, by the cells that their lower corners lie in.
#[derive(Default, Debug)]
struct Grid {
    cells: HashMap<IVec3, Vec<usize>>,
    all: Vec<usize>,
}

impl Near {
    /// Adds the box from `low` to `high` [m]; its number counts from 0.
    pub fn add(&mut self, low: DVec3, high: DVec3) {
        let number = self.boxes.len();
        self.boxes.push((low, high));
        let size = (high - low).max_element().log2().ceil().clamp(-500.0, 500.0) as i32;
        let grid = self.grids.entry(size).or_default();
        grid.cells.entry(cell(low, size)).or_default().push(number);
        grid.all.push(number);
    }

    /// Numbers of the boxes that meet the one from `low` to `high` [m], in order.
    pub fn meeting(&self, low: DVec3, high: DVec3) -> Vec<usize> {
        let mut found = vec![];
        let mut look = |numbers: &[usize]| {
            let meets = |&&k: &&usize| {
                let (from, to) = self.boxes[k];
                from.cmple(high).all() && low.cmple(to).all()
            };
            found.extend(numbers.iter().filter(meets));
        };
        for (&size, grid) in &self.grids {
            let (from, to) = (cell(low - width(size), size), cell(high, size));
            let across = (to.as_dvec3() - from.as_dvec3() + 1.0).element_product();
            if across > grid.cells.len() as f64 {
                look(&grid.all);
                continue;
            }
            for x in from.x..=to.x {
                for y in from.y..=to.y {
                    for z in from.z..=to.z {
                        grid.cells.get(&IVec3::new(x, y, z)).into_iter().for_each(|cell| look(cell));
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }
}

/// Width of the cells for boxes of a size [m].
fn width(size: i32) -> f64 {
    f64::from(size).exp2()
}

fn cell(x: DVec3, size: i32) -> IVec3 {
    (x / width(size)).floor().as_ivec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_any_size_are_found_and_no_others() {
        let place = |k: usize, n: f64| (k as f64 * n).fract();
        let boxes: Vec<(DVec3, DVec3)> = (0..600)
            .map(|k| {
                let low = 4.0 * DVec3::new(place(k, 0.618), place(k, 0.755), place(k, 0.57)) - 2.0;
                let size = [0.03, 0.3, 2.5][k % 3] * (0.5 + place(k, 0.33));
                (low, low + size * DVec3::new(1.0, place(k, 0.27), place(k, 0.43)))
            })
            .collect();
        let mut near = Near::default();
        boxes.iter().for_each(|b| near.add(b.0, b.1));
        let mut pairs = 0;
        for (low, high) in &boxes {
            let meets = |k: &usize| boxes[*k].0.cmple(*high).all() && low.cmple(boxes[*k].1).all();
            let all: Vec<usize> = (0..boxes.len()).filter(meets).collect();
            assert_eq!(near.meeting(*low, *high), all);
            pairs += all.len();
        }
        assert!(pairs > 4000, "{pairs}");
        assert!(near.meeting(DVec3::splat(9.0), DVec3::splat(10.0)).is_empty());
    }

    #[test]
    fn of_a_heap_few_are_looked_at() {
        let mut near = Near::default();
        for k in 0..8000 {
            let low = DVec3::new(f64::from(k % 20), f64::from(k / 20 % 20), f64::from(k / 400));
            near.add(low, low + 0.9);
        }
        let cells = near.grids.values().map(|grid| grid.cells.len()).sum::<usize>();
        let most = near.grids.values().flat_map(|grid| grid.cells.values()).map(Vec::len).max();
        assert!(cells == 8000 && most == Some(1), "{cells}, {most:?}");
    }
}
