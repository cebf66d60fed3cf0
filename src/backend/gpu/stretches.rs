//! Single places of an array in stretches: a copy each, instead of one a place.

/// Gaps up to so many places are read too: a copy costs more than they do.
const GAP: usize = 64;

/// Stretches of an array that hold certain places.
pub(super) struct Stretches {
    /// First place, how many, and how many are in the stretches before.
    stretches: Vec<(usize, usize, usize)>,
}

impl Stretches {
    /// With all of `places`, in any order.
    pub fn of(places: &[usize]) -> Self {
        let mut sorted = places.to_vec();
        sorted.sort_unstable();
        let mut stretches: Vec<(usize, usize, usize)> = Vec::new();
        for place in sorted {
            match stretches.last_mut() {
                Some((first, count, _)) if place < *first + *count + GAP => {
                    *count = (*count).max(place - *first + 1);
                }
                last => {
                    let before = last.map_or(0, |(_, count, before)| *before + *count);
                    stretches.push((place, 1, before));
                }
            }
        }
        Self { stretches }
    }

    /// First place and length of each.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.stretches.iter().map(|&(first, count, _)| (first, count))
    }

    /// Places in all of them.
    pub fn len(&self) -> usize {
        self.stretches.last().map_or(0, |(_, count, before)| count + before)
    }

    /// Where `place`, one of those they were made for, is in the stretches one after the other.
    pub fn place(&self, place: usize) -> usize {
        let k = self.stretches.partition_point(|&(first, ..)| first <= place) - 1;
        let (first, _, before) = self.stretches[k];
        before + place - first
    }
}

#[cfg(test)]
mod tests {
    use super::Stretches;

    #[test]
    fn every_place_is_found_in_few_stretches() {
        let places = [900, 3, 5, 4, 5, 60, 200, 201, 899, 1100];
        let stretches = Stretches::of(&places);
        assert_eq!(stretches.iter().collect::<Vec<_>>(), [(3, 58), (200, 2), (899, 2), (1100, 1)]);
        let read: Vec<usize> = stretches.iter().flat_map(|(first, count)| first..first + count).collect();
        assert_eq!(read.len(), stretches.len());
        places.iter().for_each(|&place| assert_eq!(read[stretches.place(place)], place));
        assert_eq!(Stretches::of(&[]).len(), 0);
    }
}
