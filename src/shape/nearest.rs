//! The nearest of many points, however far it is: a k-d tree.

use rayon::prelude::*;

/// Points of which no more are looked through one by one.
const FEW: usize = 8;
/// Places that a thread looks up in a row.
const IN_ROW: usize = 256;

/// Points of `D` coordinates.
pub struct Nearest<const D: usize> {
    points: Vec<[f64; D]>,
    /// Their numbers: the middle one of a stretch of them divides the others along its axis.
    order: Vec<usize>,
    axes: Vec<usize>,
}

impl<const D: usize> Nearest<D> {
    pub fn new(points: Vec<[f64; D]>) -> Self {
        let mut order: Vec<usize> = (0..points.len()).collect();
        let mut axes = vec![0; points.len()];
        divide(&points, &mut order, &mut axes);
        Self { points, order, axes }
    }

    /// The number of the nearest to `x`, the first of those that are as near; `None` if there is none at all. One that may be it, as that of a
    /// place beside `x` is, leaves little to look through.
    pub fn to(&self, x: [f64; D], guess: Option<usize>) -> Option<usize> {
        let mut found = (f64::INFINITY, usize::MAX);
        guess.into_iter().for_each(|k| self.compare(x, k, &mut found));
        self.look(x, 0, self.order.len(), &mut found);
        (found.1 < self.points.len()).then_some(found.1)
    }

    /// The numbers of those that are the nearest to each of `places` or farther from it by no more than `slack`. Most of these lie beside the one
    /// before them.
    pub fn to_each<T: Sync>(
        &self,
        places: &[T],
        at: impl Fn(&T) -> [f64; D] + Sync,
        slack: f64,
    ) -> Vec<Vec<usize>> {
        let of_some = |some: &[T]| {
            let mut last = None;
            let next = |place| {
                let x = at(place);
                last = self.to(x, last);
                let mut found = vec![];
                if let Some(k) = last {
                    let reach = self.square(x, k).sqrt() + slack;
                    self.visit(x, reach * reach, (0, self.order.len()), &mut |k| found.push(k));
                }
                found
            };
            some.iter().map(next).collect::<Vec<_>>()
        };
        places.par_chunks(IN_ROW).flat_map_iter(of_some).collect()
    }

    /// Calls `visit` with each of a stretch of them no farther from `x` than the root of `square`.
    fn visit(&self, x: [f64; D], square: f64, (from, to): (usize, usize), visit: &mut impl FnMut(usize)) {
        if to - from <= FEW {
            self.order[from..to].iter().filter(|&&k| self.square(x, k) <= square).for_each(|&k| visit(k));
            return;
        }
        let middle = from + (to - from) / 2;
        let k = self.order[middle];
        let beyond = x[self.axes[middle]] - self.points[k][self.axes[middle]];
        if self.square(x, k) <= square {
            visit(k);
        }
        if beyond < 0.0 || beyond * beyond <= square {
            self.visit(x, square, (from, middle), visit);
        }
        if beyond >= 0.0 || beyond * beyond <= square {
            self.visit(x, square, (middle + 1, to), visit);
        }
    }

    fn look(&self, x: [f64; D], from: usize, to: usize, found: &mut (f64, usize)) {
        if to - from <= FEW {
            self.order[from..to].iter().for_each(|&k| self.compare(x, k, found));
            return;
        }
        let middle = from + (to - from) / 2;
        let axis = self.axes[middle];
        let beyond = x[axis] - self.points[self.order[middle]][axis];
        let (near, far) = if beyond < 0.0 {
            ((from, middle), (middle + 1, to))
        } else {
            ((middle + 1, to), (from, middle))
        };
        self.look(x, near.0, near.1, found);
        if beyond * beyond <= found.0 {
            self.compare(x, self.order[middle], found);
            self.look(x, far.0, far.1, found);
        }
    }

    /// Whether any of them is nearer to `x` than `reach`.
    pub fn has_within(&self, x: [f64; D], reach: f64) -> bool {
        reach > 0.0 && self.has(x, reach * reach, 0, self.order.len())
    }

    fn has(&self, x: [f64; D], square: f64, from: usize, to: usize) -> bool {
        let is_near = |k: usize| self.square(x, k) < square;
        if to - from <= FEW {
            return self.order[from..to].iter().any(|&k| is_near(k));
        }
        let middle = from + (to - from) / 2;
        let beyond = x[self.axes[middle]] - self.points[self.order[middle]][self.axes[middle]];
        let [low, high] = [(from, middle), (middle + 1, to)];
        let (near, far) = if beyond < 0.0 { (low, high) } else { (high, low) };
        is_near(self.order[middle])
            || self.has(x, square, near.0, near.1)
            || beyond * beyond < square && self.has(x, square, far.0, far.1)
    }

    /// Square of the distance of `x` from one of them.
    fn square(&self, x: [f64; D], k: usize) -> f64 {
        x.iter().zip(&self.points[k]).map(|(x, p)| (x - p) * (x - p)).sum()
    }

    fn compare(&self, x: [f64; D], k: usize, found: &mut (f64, usize)) {
        let off = self.square(x, k);
        if (off, k) < *found {
            *found = (off, k);
        }
    }
}

/// Puts a stretch of numbers in order, halved along the axis along which its points reach farthest.
fn divide<const D: usize>(points: &[[f64; D]], order: &mut [usize], axes: &mut [usize]) {
    if order.len() <= FEW {
        return;
    }
    let reach = |axis: usize| {
        let ends = order.iter().map(|&k| points[k][axis]);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    };
    let axis = (0..D).max_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or_default();
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| points[a][axis].total_cmp(&points[b][axis]));
    axes[middle] = axis;
    let (low, high) = order.split_at_mut(middle);
    let (low_axes, high_axes) = axes.split_at_mut(middle);
    divide(points, low, low_axes);
    divide(points, &mut high[1..], &mut high_axes[1..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_nearest_of_all() {
        let place = |k: usize| [0.618_034, 0.754_877, 0.569_84].map(|n| (n * k as f64).fract());
        let points: Vec<[f64; 3]> = (0..700).map(place).collect();
        let tree = Nearest::new(points.clone());
        for k in 1000..1300 {
            // Among them, and far off.
            let x = place(k).map(|c| if k % 2 == 0 { c } else { 100.0 * c });
            let off = |p: &[f64; 3]| p.iter().zip(x).map(|(p, x)| (p - x).powi(2)).sum::<f64>();
            let nearest = (0..points.len()).min_by(|&a, &b| off(&points[a]).total_cmp(&off(&points[b])));
            for guess in [None, Some(k % points.len()), nearest] {
                assert_eq!(tree.to(x, guess), nearest, "{x:?}");
            }
            let least = nearest.map_or(f64::NAN, |k| off(&points[k]).sqrt());
            assert!(tree.has_within(x, 1.000_001 * least) && !tree.has_within(x, 0.999_999 * least), "{x:?}");
        }
        // Half-way between two of a row.
        let row = Nearest::new((0..40).map(|k| [0.1 * f64::from(k)]).collect());
        let mut both = row.to_each(&[0.75, 0.76], |x| [*x], 1e-6);
        both.iter_mut().for_each(|numbers| numbers.sort_unstable());
        assert_eq!(both, [vec![7, 8], vec![8]]);
        assert_eq!(Nearest::<3>::new(vec![]).to([0.0; 3], None), None);
    }
}
