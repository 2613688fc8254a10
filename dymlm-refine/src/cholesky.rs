use crate::elimination::Elimination;
use crate::front::Front;

/// The Cholesky factor of symmetric equations, by dense fronts. Its memory is used again for the next factor.
#[derive(Debug, Default)]
pub(crate) struct Cholesky {
    /// The columns of each supernode, one after the other.
    factor: Vec<f64>,
    /// Updates that supernodes leave to their parents: the last on top.
    waiting: Vec<f64>,
    front: Front,
}

impl Cholesky {
    /// Factorizes the equations. `assemble` adds the numbers in the columns of a supernode, given its index,
    /// to its front. `false` when the equations are not positive definite.
    pub(crate) fn factorize(
        &mut self,
        elimination: &Elimination,
        mut assemble: impl FnMut(usize, &mut Front),
    ) -> bool {
        self.factor.clear();
        self.waiting.clear();
        for (index, node) in elimination.supernodes.iter().enumerate() {
            self.front.clear(node.size);
            assemble(index, &mut self.front);
            for &child in node.children.iter().rev() {
                let child = &elimination.supernodes[child];
                let size = child.size - child.columns;
                let begin = self.waiting.len() - size * size;
                self.front.add(&self.waiting[begin..], size, &child.into_parent);
                self.waiting.truncate(begin);
            }
            if !self.front.eliminate(node.columns) {
                return false;
            }
            self.factor.extend_from_slice(self.front.columns(node.columns));
            for column in self.front.rest(node.columns) {
                self.waiting.extend_from_slice(column);
            }
        }
        true
    }

    /// Solves in place: the right-hand side becomes the solution, both in the order of elimination.
    pub(crate) fn solve(&self, elimination: &Elimination, right: &mut [f64]) {
        let mut begin = 0;
        for node in &elimination.supernodes {
            let first = elimination.starts[node.positions.start];
            let (own, rest) = right[first..].split_at_mut(node.columns);
            for (j, column) in self.factor[begin..].chunks_exact(node.size).take(node.columns).enumerate() {
                let value = own[j] / column[j];
                own[j] = value;
                for (number, factor) in own[j + 1..].iter_mut().zip(&column[j + 1..]) {
                    *number -= factor * value;
                }
                let mut below = &column[node.columns..];
                for rows in &node.below {
                    let to = &mut rest[rows.start - first - node.columns..];
                    for (number, factor) in to.iter_mut().zip(&below[..rows.len()]) {
                        *number -= factor * value;
                    }
                    below = &below[rows.len()..];
                }
            }
            begin += node.columns * node.size;
        }
        for node in elimination.supernodes.iter().rev() {
            begin -= node.columns * node.size;
            let first = elimination.starts[node.positions.start];
            let (own, rest) = right[first..].split_at_mut(node.columns);
            let columns = self.factor[begin..].chunks_exact(node.size).take(node.columns);
            for (j, column) in columns.enumerate().rev() {
                let mut value = own[j];
                for (number, factor) in own[j + 1..].iter().zip(&column[j + 1..]) {
                    value -= factor * number;
                }
                let mut below = &column[node.columns..];
                for rows in &node.below {
                    let from = &rest[rows.start - first - node.columns..];
                    for (number, factor) in from.iter().zip(&below[..rows.len()]) {
                        value -= factor * number;
                    }
                    below = &below[rows.len()..];
                }
                own[j] = value / column[j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Patterns of blocks: a chain, a chain with loops, a star whose middle comes first, one dense block of
    /// everything, and two parts that are not coupled.
    fn patterns() -> Vec<Vec<Vec<usize>>> {
        let blocks = 40;
        let chain = |block: usize| if block + 1 < blocks { vec![block + 1] } else { Vec::new() };
        let looped = |block: usize| [1, 7, 19].map(|far| block + far).into_iter().filter(|b| *b < blocks);
        let star = |block: usize| if block == 0 { (1..blocks).collect() } else { Vec::new() };
        vec![
            (0..blocks).map(chain).collect(),
            (0..blocks).map(|block| looped(block).collect()).collect(),
            (0..blocks).map(star).collect(),
            (0..blocks).map(|block| (block + 1..blocks).collect()).collect(),
            (0..blocks).map(|block| chain(block).into_iter().filter(|b| *b != 20).collect()).collect(),
        ]
    }

    /// A matrix with that pattern, in the order of elimination.
    fn matrix(elimination: &Elimination, below: &[Vec<usize>], diagonal: f64) -> DMatrix<f64> {
        let starts = &elimination.starts;
        let unknowns = starts[below.len()];
        let mut random = SplitMix64::new(5);
        let mut dense = DMatrix::from_diagonal_element(unknowns, unknowns, diagonal);
        for (block, rows) in below.iter().enumerate() {
            for &row in rows.iter().chain([&block]) {
                let [a, b] = [block, row].map(|block| elimination.positions[block]);
                for r in starts[a]..starts[a + 1] {
                    for c in starts[b]..starts[b + 1] {
                        let number = random.fraction() - 0.5;
                        dense[(r, c)] += number;
                        dense[(c, r)] += number;
                    }
                }
            }
        }
        dense
    }

    fn factorize(cholesky: &mut Cholesky, elimination: &Elimination, dense: &DMatrix<f64>) -> bool {
        cholesky.factorize(elimination, |index, front| {
            let node = &elimination.supernodes[index];
            let first = elimination.starts[node.positions.start];
            let below: Vec<usize> = node.below.iter().flat_map(Clone::clone).collect();
            for k in 0..node.columns {
                let rows = (first + k..first + node.columns).chain(below.iter().copied());
                for (number, row) in front.column_mut(k, k).iter_mut().zip(rows) {
                    *number = dense[(row, first + k)];
                }
            }
        })
    }

    #[test]
    fn solves_what_dense_code_solves() {
        let sizes: Vec<usize> = (0..40).map(|block| [6, 3, 6, 1][block % 4]).collect();
        // The memory of one factor is used for the next.
        let mut cholesky = Cholesky::default();
        for below in patterns() {
            let elimination = Elimination::new(&sizes, &below).unwrap();
            let dense = matrix(&elimination, &below, 120.0);
            assert!(factorize(&mut cholesky, &elimination, &dense));
            let right = DVector::from_fn(dense.nrows(), |row, _| (row % 7) as f64 - 2.0);
            let mut solution = right.clone();
            cholesky.solve(&elimination, solution.as_mut_slice());
            assert!((&dense * &solution - &right).amax() < 1e-12);
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let sizes = [6; 40];
        for below in patterns() {
            let elimination = Elimination::new(&sizes, &below).unwrap();
            let last = elimination.starts[40] - 1;
            for bad in [-1.0, 0.0, f64::NAN] {
                let mut dense = matrix(&elimination, &below, 240.0);
                dense[(last, last)] = bad;
                assert!(!factorize(&mut Cholesky::default(), &elimination, &dense));
            }
        }
    }
}
