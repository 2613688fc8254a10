use super::config::IsolationForestConfig;
use super::path_length::mean_path_length;
use super::trees::{IsolationTrees, Node, height_limit};
use dymlm_core::SplitMix64;

/// Working memory of [`IsolationForest::fit_into`](crate::IsolationForest::fit_into); kept between calls, it
/// saves all allocation.
#[derive(Debug, Clone, Default)]
pub struct IsolationForestScratch<const D: usize> {
    /// Rows to draw from.
    finite: Vec<u32>,
    sample: Vec<[f32; D]>,
}

/// Grows all trees.
pub(super) fn grow<const D: usize>(
    config: &IsolationForestConfig,
    rows: &[[f32; D]],
    scratch: &mut IsolationForestScratch<D>,
    trees: &mut IsolationTrees<D>,
) {
    let IsolationForestScratch { finite, sample } = scratch;
    finite.clear();
    finite.extend((0..=u32::MAX).zip(rows).filter(|(_, row)| is_finite(row)).map(|(index, _)| index));
    let sample_size = config.sample_size.min(finite.len());
    trees.reset(config.trees, sample_size);
    let size = 1_usize << trees.height;
    let mut random = SplitMix64::new(config.seed);
    for (nodes, paths) in trees.nodes.chunks_exact_mut(size).zip(trees.paths.chunks_exact_mut(size)) {
        draw(rows, finite, sample_size, &mut random, sample);
        let (height, limit) = (trees.height, height_limit(sample_size));
        GrowingTree { nodes, paths, height, limit, random: &mut random }.grow(1, 0, sample);
    }
}

fn is_finite<const D: usize>(row: &[f32; D]) -> bool {
    row.iter().all(|x| x.is_finite())
}

/// Draws rows without replacement: the first steps of a Fisher-Yates shuffle.
fn draw<const D: usize>(
    rows: &[[f32; D]],
    finite: &mut [u32],
    count: usize,
    random: &mut SplitMix64,
    sample: &mut Vec<[f32; D]>,
) {
    sample.clear();
    for place in 0..count {
        finite.swap(place, place + random.below(finite.len() - place));
        sample.push(rows[finite[place] as usize]);
    }
}

/// Rows with more than the threshold in the column go to the right.
#[derive(Clone, Copy)]
struct Cut {
    column: usize,
    threshold: f32,
}

struct GrowingTree<'a> {
    nodes: &'a mut [Node],
    paths: &'a mut [f32],
    /// Height of the stored tree.
    height: u32,
    /// Depth at which no more cuts are made.
    limit: u32,
    random: &'a mut SplitMix64,
}

impl GrowingTree<'_> {
    /// Grows the tree below a node for its rows, which are put into the order of the leaves.
    fn grow<const D: usize>(&mut self, node: usize, depth: u32, rows: &mut [[f32; D]]) {
        if rows.len() > 1
            && depth < self.limit
            && let Some(cut) = self.choose_cut(rows)
        {
            self.nodes[node] = Node::cut(cut.column, cut.threshold);
            let middle = partition(rows, cut);
            let (left, right) = rows.split_at_mut(middle);
            self.grow(2 * node, depth + 1, left);
            self.grow(2 * node + 1, depth + 1, right);
        } else {
            // Every row that comes here goes on to the left.
            let leaf = (node << (self.height - depth)) - self.paths.len();
            self.paths[leaf] = (f64::from(depth) + mean_path_length(rows.len())) as f32;
        }
    }

    /// A cut that leaves rows on both sides; `None` when all rows are equal.
    fn choose_cut<const D: usize>(&mut self, rows: &[[f32; D]]) -> Option<Cut> {
        let mut columns: [usize; D] = std::array::from_fn(|column| column);
        for untried in (1..=D).rev() {
            let chosen = self.random.below(untried);
            let column = columns[chosen];
            let (min, max) = range(rows, column);
            if min < max {
                let fraction = self.random.fraction();
                let between = f64::from(min) + fraction * (f64::from(max) - f64::from(min));
                // Rounding must not leave the right side empty.
                let threshold = if (between as f32) < max { between as f32 } else { min };
                return Some(Cut { column, threshold });
            }
            columns.swap(chosen, untried - 1);
        }
        None
    }
}

/// Least and greatest number of a column.
fn range<const D: usize>(rows: &[[f32; D]], column: usize) -> (f32, f32) {
    rows.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), row| {
        let x = row[column];
        (if x < min { x } else { min }, if x > max { x } else { max })
    })
}

/// Puts the rows that go to the left first, and returns their number.
fn partition<const D: usize>(rows: &mut [[f32; D]], cut: Cut) -> usize {
    let mut left = 0;
    for place in 0..rows.len() {
        let goes_left = rows[place][cut.column] <= cut.threshold;
        rows.swap(place, left);
        left += usize::from(goes_left);
    }
    left
}
