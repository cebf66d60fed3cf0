//! Neighbour lists of the CPU path, kept in chunks of rows.
//!
//! Row i holds the particles within the effective radius of particle i: first those that carry
//! pressure, then the dummies. A chunk owns the rows of `CHUNK` particles; threads work on chunks, and
//! sums over particles are made per chunk and then in chunk order, so results do not depend on the
//! number of threads.

/// Rows of a chunk.
pub(crate) const CHUNK: usize = 512;

/// Neighbours that a row holds at most, `lattice` those of a full lattice: twice as many, 64 for the usual 32. Healthy
/// runs stay below 1.6 times; more means that the fluid has collapsed onto itself, and ends the run on every backend.
/// Where solids are driven they may move into each other: rows of two lattices in one place, and some water.
pub fn capacity(lattice: u32, driven: bool) -> usize {
    let overlaid = if driven { OVERLAID } else { 0 };
    (2 * lattice as usize + overlaid).next_multiple_of(8).max(24)
}

/// Neighbours that a row of two lattices in one place has beyond twice those of one: its twin, and water before it.
const OVERLAID: usize = 5;

/// The largest [`capacity`]: of the largest effective radius that a case may ask for, 4.1 spacings.
pub(crate) const CAPACITY: usize = 520;

/// Rows of `CHUNK` particles.
#[derive(Clone, Default, Debug)]
pub struct Chunk {
    /// Start of each row in `neighbour`, and the end of the last one.
    pub start: Vec<u32>,
    /// Where each row's dummies begin.
    pub dummies: Vec<u32>,
    /// Slots of the neighbours.
    pub neighbour: Vec<u32>,
    /// Weight of each pair, Eq. (3), once positions are final ([`crate::kernels::number_density`]).
    pub weight: Vec<f64>,
    /// Rows with a pair closer than the collision distance.
    pub close: Vec<bool>,
    /// Rows with a wall among those that carry pressure.
    pub walls: Vec<bool>,
}

/// A row: neighbours and their weights.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    /// Slots of the neighbours.
    pub neighbour: &'a [u32],
    /// Weights, Eq. (3).
    pub weight: &'a [f64],
}

impl Row<'_> {
    /// Neighbours with their weights.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.neighbour.iter().zip(self.weight).map(|(&j, &w)| (j as usize, w))
    }
}

impl Chunk {
    /// All neighbours of row `k` of this chunk.
    #[inline(always)]
    pub fn all(&self, k: usize) -> Row<'_> {
        self.slice(self.start[k] as usize, self.start[k + 1] as usize)
    }

    /// Those neighbours of row `k` that carry pressure.
    #[inline(always)]
    pub fn pressure(&self, k: usize) -> Row<'_> {
        self.slice(self.start[k] as usize, self.dummies[k] as usize)
    }

    /// All neighbours of row `k`, and how many of them carry pressure; they come first.
    #[inline(always)]
    pub fn parts(&self, k: usize) -> (Row<'_>, usize) {
        (self.all(k), (self.dummies[k] - self.start[k]) as usize)
    }

    /// The range of row `k` in `neighbour` and `weight`.
    #[inline(always)]
    pub fn range(&self, k: usize) -> std::ops::Range<usize> {
        self.start[k] as usize..self.start[k + 1] as usize
    }

    #[inline(always)]
    fn slice(&self, a: usize, b: usize) -> Row<'_> {
        Row { neighbour: &self.neighbour[a..b], weight: self.weight.get(a..b).unwrap_or(&[]) }
    }

    /// Whether no row has a neighbour: dry walls.
    #[inline(always)]
    pub(crate) fn is_dry(&self) -> bool {
        self.neighbour.is_empty()
    }

    /// Rows of this chunk.
    pub fn rows(&self) -> usize {
        self.dummies.len()
    }
}

/// Neighbour lists of all pressure-carrying particles.
#[derive(Clone, Default, Debug)]
pub struct Neighbours {
    /// Chunks, in slot order.
    pub chunks: Vec<Chunk>,
}

impl Neighbours {
    /// Empty lists for `rows` particles.
    pub fn new(rows: usize) -> Self {
        let chunk = |c: usize| {
            let rows = CHUNK.min(rows - c * CHUNK);
            Chunk {
                start: vec![0; rows + 1],
                dummies: vec![0; rows],
                close: vec![false; rows],
                walls: vec![false; rows],
                ..Chunk::default()
            }
        };
        Self { chunks: (0..rows.div_ceil(CHUNK)).map(chunk).collect() }
    }

    /// All neighbours of particle `i`.
    pub fn all(&self, i: usize) -> Row<'_> {
        self.chunks[i / CHUNK].all(i % CHUNK)
    }

    /// All neighbours of particle `i`, and how many of them carry pressure; they come first.
    pub fn parts(&self, i: usize) -> (Row<'_>, usize) {
        self.chunks[i / CHUNK].parts(i % CHUNK)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.chunks.iter().map(Chunk::rows).sum()
    }

    /// Those neighbours of particle `i` that carry pressure.
    pub fn pressure(&self, i: usize) -> Row<'_> {
        self.chunks[i / CHUNK].pressure(i % CHUNK)
    }

    /// Number of pairs listed.
    pub fn pairs(&self) -> usize {
        self.chunks.iter().map(|c| c.neighbour.len()).sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.chunks
            .iter()
            .map(|c| {
                c.neighbour.capacity() * 4 + c.weight.capacity() * 8 + c.start.len() * 8 + c.close.len() * 2
            })
            .sum()
    }
}
