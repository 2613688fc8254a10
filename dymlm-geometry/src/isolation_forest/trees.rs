use super::path_length::mean_path_length;

/// Grown trees of an [`IsolationForest`](crate::IsolationForest), over rows of `D` columns.
///
/// Every tree is stored as a full binary tree of the same height: a node's children are found without pointers, and
/// each row takes the same number of steps, without a branch to predict. A leaf further up has nodes below it that
/// send every row to the left.
#[derive(Debug, Clone, PartialEq)]
pub struct IsolationTrees<const D: usize> {
    /// Cuts on the way to a leaf.
    pub(super) height: u32,
    /// By tree 2^height nodes, of which the first is not used; the children of node i are 2 i and 2 i + 1.
    pub(super) nodes: Vec<Node>,
    /// By tree the path lengths of its 2^height leaves.
    pub(super) paths: Vec<f32>,
    /// c of the sample's size.
    pub(super) mean_path: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Rows with more than this go to the right.
    pub(super) threshold: f32,
    pub(super) column: u32,
}

impl Node {
    /// Sends all to the left.
    pub(super) const PASS: Self = Self { threshold: f32::INFINITY, column: 0 };
}

/// Rows on their way at once: their steps do not wait for one another.
const ROWS_AT_ONCE: usize = 8;

impl<const D: usize> IsolationTrees<D> {
    /// No trees: every row scores 0.5.
    pub fn new() -> Self {
        Self { height: 0, nodes: Vec::new(), paths: Vec::new(), mean_path: 0.0 }
    }

    /// The score of a row, 0 to 1; see [`IsolationForest`](crate::IsolationForest).
    pub fn score(&self, row: &[f32; D]) -> f64 {
        let mut sum = [0.0];
        for tree in self.trees() {
            tree.add_paths(self.height, &[*row], &mut sum);
        }
        self.score_of(row, sum[0])
    }

    /// The score of each row.
    pub fn scores(&self, rows: &[[f32; D]]) -> Vec<f64> {
        let mut scores = Vec::new();
        self.scores_into(rows, &mut scores);
        scores
    }

    /// The score of each row into a caller's buffer, whose content does not matter.
    pub fn scores_into(&self, rows: &[[f32; D]], scores: &mut Vec<f64>) {
        // So many rows and their sums stay in the fastest cache while all trees pass by.
        const BLOCK: usize = 512;
        scores.clear();
        scores.resize(rows.len(), 0.0);
        for (rows, sums) in rows.chunks(BLOCK).zip(scores.chunks_mut(BLOCK)) {
            for tree in self.trees() {
                let (eights, rest) = rows.as_chunks::<ROWS_AT_ONCE>();
                let (sums_of_eights, sums_of_rest) = sums.as_chunks_mut();
                for (rows, sums) in eights.iter().zip(sums_of_eights) {
                    tree.add_paths(self.height, rows, sums);
                }
                for (row, sum) in rest.iter().zip(sums_of_rest) {
                    tree.add_paths(self.height, &[*row], std::array::from_mut(sum));
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
        trees.map(|(nodes, paths)| Tree { nodes, paths })
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

impl<const D: usize> Default for IsolationTrees<D> {
    fn default() -> Self {
        Self::new()
    }
}

struct Tree<'a> {
    nodes: &'a [Node],
    paths: &'a [f32],
}

impl Tree<'_> {
    /// Adds to each sum the length of its row's path. Path lengths are multiples of 2^-23, or nearly so (f32 of 1 and
    /// more, or 0), so that the sums in f64 are exact and the order of rows and trees does not matter.
    #[inline]
    fn add_paths<const D: usize, const N: usize>(
        &self,
        height: u32,
        rows: &[[f32; D]; N],
        sums: &mut [f64; N],
    ) {
        let mut places = [1; N];
        for _ in 0..height {
            for (place, row) in places.iter_mut().zip(rows) {
                let Node { threshold, column } = self.nodes[*place];
                *place = 2 * *place + usize::from(row[column as usize] > threshold);
            }
        }
        for (place, sum) in places.into_iter().zip(sums) {
            *sum += f64::from(self.paths[place - self.paths.len()]);
        }
    }
}

/// Height of a balanced tree over `rows`.
pub(super) fn height_limit(rows: usize) -> u32 {
    rows.max(1).next_power_of_two().trailing_zeros()
}

impl<const D: usize> IsolationTrees<D> {
    /// Room for `trees` trees over samples of `rows` rows, in which every row goes to the left.
    pub(super) fn reset(&mut self, trees: usize, rows: usize) {
        // Rows without columns are all equal.
        self.height = if D == 0 { 0 } else { height_limit(rows) };
        self.mean_path = mean_path_length(rows);
        let size = trees << self.height;
        self.nodes.clear();
        self.nodes.resize(size, Node::PASS);
        self.paths.clear();
        self.paths.resize(size, 0.0);
    }
}
