//! Error against cost: the Pareto front, and the setting to take for a wanted error.

/// A setting with its cost and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Place in the table.
    pub row: usize,
    /// Wall time [s] or work.
    pub cost: f64,
    /// Error, zero or more.
    pub error: f64,
}

/// The candidates that no other one beats in cost and error at once, cheapest first. Of equals the first
/// counts. What is not finite is left out.
pub fn front(candidates: &[Candidate]) -> Vec<Candidate> {
    let mut sorted: Vec<&Candidate> =
        candidates.iter().filter(|c| c.cost.is_finite() && c.error.is_finite()).collect();
    sorted.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    let mut front = Vec::new();
    for c in sorted {
        if c.error < best {
            best = c.error;
            front.push(c.clone());
        }
    }
    front
}

/// What to take for a wanted error.
#[derive(Clone, Debug, PartialEq)]
pub enum Recommendation {
    /// The cheapest setting that meets it.
    Meets(Candidate),
    /// None does; this one comes closest.
    Closest(Candidate),
    /// There is nothing to choose from.
    Nothing,
}

/// The cheapest of `candidates` with an error of at most `wanted`.
pub fn recommend(candidates: &[Candidate], wanted: f64) -> Recommendation {
    let front = front(candidates);
    // On the front, cost rises as error falls: the first that meets it is the cheapest.
    match (front.iter().find(|c| c.error <= wanted), front.last()) {
        (Some(c), _) => Recommendation::Meets(c.clone()),
        (None, Some(c)) => Recommendation::Closest(c.clone()),
        (None, None) => Recommendation::Nothing,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(list: &[(f64, f64)]) -> Vec<Candidate> {
        list.iter().enumerate().map(|(row, &(cost, error))| Candidate { row, cost, error }).collect()
    }

    fn rows(front: &[Candidate]) -> Vec<usize> {
        front.iter().map(|c| c.row).collect()
    }

    #[test]
    fn nothing_on_the_front_is_beaten_and_everything_else_is() {
        let all = candidates(&[(1.0, 0.5), (2.0, 0.6), (3.0, 0.1), (3.0, 0.2), (10.0, 0.1), (0.5, 0.9)]);
        let front = front(&all);
        assert_eq!(rows(&front), [5, 0, 2]);
        for c in &all {
            let beaten = front.iter().any(|f| f.cost <= c.cost && f.error <= c.error);
            assert!(beaten, "{c:?} should be on the front or beaten by it");
        }
    }

    #[test]
    fn equals_count_once_and_what_is_no_number_does_not_count() {
        let all =
            candidates(&[(1.0, 0.5), (1.0, 0.5), (f64::NAN, 0.1), (0.1, f64::NAN), (2.0, f64::INFINITY)]);
        assert_eq!(rows(&front(&all)), [0]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn the_cheapest_that_meets_the_wanted_error_is_recommended() {
        let all = candidates(&[(1.0, 0.5), (4.0, 0.04), (2.0, 0.05), (9.0, 0.001)]);
        assert_eq!(recommend(&all, 0.05), Recommendation::Meets(all[2].clone()));
        assert_eq!(recommend(&all, 0.045), Recommendation::Meets(all[1].clone()));
        assert_eq!(recommend(&all, 1e-6), Recommendation::Closest(all[3].clone()));
        assert_eq!(recommend(&[], 0.1), Recommendation::Nothing);
    }
}
