use super::path_length::mean_path_length;

/// Grown trees of an [`IsolationForest`](crate::IsolationForest), over rows of `D` columns.
///
/// Every tree is stored as a full binary tree of the same height: a node's children are found without
/// pointers, and each row takes the same number of steps, without a branch to predict. A leaf further up has
/// nodes below it that send every row to the left.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IsolationTrees<const D: usize> {
    /// Cuts on the way to a leaf.
    pub(super) height: u32,
    /// 2^height nodes for each tree, of which the first is not used; node i has the children 2 i and 2 i + 1.
    pub(super) nodes: Vec<Node>,
    /// The path lengths of the 2^height leaves of each tree.
    pub(super) paths: Vec<f32>,
    /// c of the sample's size.
    pub(super) mean_path: f64,
}

/// A cut, or a node that sends all rows to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Rows with a greater key go to the right.
    key: u32,
    column: u32,
}

impl Node {
    /// Sends all to the left.
    const PASS: Self = Self { key: u32::MAX, column: 0 };

    /// Sends rows with more than `threshold` in the column to the right.
    pub(super) fn cut(column: usize, threshold: f32) -> Self {
        Self { key: key(threshold), column: column as u32 }
    }

    /// 1 when the row goes to the right, else 0.
    #[inline]
    fn side<const D: usize>(self, keys: &[u32; D]) -> usize {
        usize::from(keys[self.column as usize] > self.key)
    }
}

/// A number whose order is that of the finite numbers: integers take fewer instructions to compare.
#[inline]
fn key(x: f32) -> u32 {
    // Makes -0 the equal 0.
    let bits = (x + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | (1 << 31) }
}

/// Number of rows that descend at once: their steps do not wait for one another.
const ROWS_AT_ONCE: usize = 8;

/// Every tree has at least this many steps, which is fast for samples up to the default size: the number of
/// steps is known at compile time.
const COMMON_HEIGHT: u32 = 8;
const COMMON_SIZE: usize = 1 << COMMON_HEIGHT;

impl<const D: usize> IsolationTrees<D> {
    /// The score of a row, 0 to 1; see [`IsolationForest`](crate::IsolationForest).
    pub fn score(&self, row: &[f32; D]) -> f64 {
        let mut sum = [0.0];
        for tree in self.trees() {
            tree.add_paths(&[row.map(key)], &mut sum);
        }
        self.score_of(row, sum[0])
    }

    /// The score of each row.
    pub fn scores(&self, rows: &[[f32; D]]) -> Vec<f64> {
        let mut scores = Vec::new();
        self.scores_into(rows, &mut scores);
        scores
    }

    /// The score of each row into a caller's buffer, whose content does not matter. Allocates nothing else.
    pub fn scores_into(&self, rows: &[[f32; D]], scores: &mut Vec<f64>) {
        // This many groups of rows and their sums stay in the fastest cache while all trees are evaluated.
        const BLOCK: usize = 32;
        scores.clear();
        scores.resize(rows.len(), 0.0);
        for (rows, sums) in rows.chunks(BLOCK * ROWS_AT_ONCE).zip(scores.chunks_mut(BLOCK * ROWS_AT_ONCE)) {
            let mut keys = [[[0; D]; ROWS_AT_ONCE]; BLOCK];
            for (keys, row) in keys.as_flattened_mut().iter_mut().zip(rows) {
                *keys = row.map(key);
            }
            let (sums_of_eights, sums_of_rest) = sums.as_chunks_mut();
            let (keys_of_eights, keys_of_rest) = keys.split_at(sums_of_eights.len());
            for tree in self.trees() {
                for (keys, sums) in keys_of_eights.iter().zip(&mut *sums_of_eights) {
                    tree.add_paths(keys, sums);
                }
                for (keys, sum) in keys_of_rest.as_flattened().iter().zip(&mut *sums_of_rest) {
                    tree.add_paths(&[*keys], std::array::from_mut(sum));
                }
            }
            for (row, sum) in rows.iter().zip(sums) {
                *sum = self.score_of(row, *sum);
            }
        }
    }

    fn trees(&self) -> impl Iterator<Item = Tree<'_>> {
        let size = 1_usize << self.height;
        let trees = self.nodes.chunks_exact(size).zip(self.paths.chunks_exact(size));
        trees.map(|(nodes, paths)| Tree { height: self.height, nodes, paths })
    }

    /// 2^(-E/c), from the sum of the row's path lengths.
    fn score_of(&self, row: &[f32; D], sum: f64) -> f64 {
        if row.iter().any(|x| !x.is_finite()) {
            return 1.0;
        }
        let trees = (self.paths.len() >> self.height) as f64;
        let normal = trees * self.mean_path;
        if normal > 0.0 { (-sum / normal).exp2() } else { 0.5 }
    }
}

struct Tree<'a> {
    height: u32,
    nodes: &'a [Node],
    paths: &'a [f32],
}

impl Tree<'_> {
    /// Adds to each sum the length of its row's path. Lengths are f32 of 1 and more, or 0: multiples of
    /// 2^-23, so that the sums in f64 are exact and the order of trees does not matter.
    #[inline]
    fn add_paths<const D: usize, const N: usize>(&self, keys: &[[u32; D]; N], sums: &mut [f64; N]) {
        let places = match self.nodes.first_chunk::<COMMON_SIZE>() {
            Some(nodes) if nodes.len() == self.nodes.len() => common_descent(nodes, keys),
            _ => descent(self.nodes, self.height, keys),
        };
        for (place, sum) in places.into_iter().zip(sums) {
            *sum += self.paths.get(place - self.paths.len()).copied().map_or(0.0, f64::from);
        }
    }
}

/// Descends from the root to below the last nodes.
#[inline]
fn common_descent<const D: usize, const N: usize>(
    nodes: &[Node; COMMON_SIZE],
    keys: &[[u32; D]; N],
) -> [usize; N] {
    let mut places = [1_usize; N];
    for _ in 0..COMMON_HEIGHT {
        for (place, keys) in places.iter_mut().zip(keys) {
            // The place is below the size anyway; so the compiler knows it too.
            *place = 2 * *place + nodes[*place % COMMON_SIZE].side(keys);
        }
    }
    places
}

/// [`common_descent`] in larger trees.
#[inline]
fn descent<const D: usize, const N: usize>(nodes: &[Node], height: u32, keys: &[[u32; D]; N]) -> [usize; N] {
    let mut places = [1_usize; N];
    for _ in 0..height {
        for (place, keys) in places.iter_mut().zip(keys) {
            *place = 2 * *place + nodes[*place].side(keys);
        }
    }
    places
}

impl<const D: usize> IsolationTrees<D> {
    /// Makes room for `trees` trees over samples of `rows` rows; every row goes to the left at first.
    pub(super) fn reset(&mut self, trees: usize, rows: usize) {
        // Rows without columns are all equal.
        self.height = if D == 0 { 0 } else { height_limit(rows).max(COMMON_HEIGHT) };
        // As exact as the paths of the leaves: rows that no cut parts then score just 0.5.
        self.mean_path = f64::from(mean_path_length(rows) as f32);
        let size = trees << self.height;
        self.nodes.clear();
        self.nodes.resize(size, Node::PASS);
        self.paths.clear();
        self.paths.resize(size, 0.0);
    }
}

/// Height of a balanced tree over `rows`.
pub(super) fn height_limit(rows: usize) -> u32 {
    rows.max(1).next_power_of_two().trailing_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_in_the_order_of_the_numbers() {
        let ascending = [-f32::MAX, -1.5, -1.0, -f32::MIN_POSITIVE, -1e-45, 0.0, 1e-45, 1.0, 1.5, f32::MAX];
        assert!(ascending.map(key).is_sorted_by(|a, b| a < b));
        assert_eq!(key(-0.0), key(0.0));
        assert!(key(f32::MAX) < Node::PASS.key);
    }
}
