use nalgebra::SMatrix;

use crate::Error;
use crate::cholesky::Cholesky;
use crate::elimination::Elimination;

/// By how much the variance of an unknown may exceed what it would be if all others were known: beyond this,
/// rounding decides the figure.
const MAX_VARIANCE_INFLATION: f64 = 0.01 / f64::EPSILON;

/// Symmetric equations in blocks; only blocks that some factor couples are stored. What depends on the
/// pattern alone is computed once: the order of elimination and the places of the numbers.
#[derive(Debug)]
pub(crate) struct NormalEquations {
    /// Where the unknowns of each block begin, and the end of the last.
    starts: Vec<usize>,
    elimination: Elimination,
    /// For each position in the order of elimination, the blocks on and below its diagonal, ascending.
    columns: Vec<Vec<Entry>>,
    /// The numbers of the blocks, each block column by column.
    values: Vec<f64>,
    right: Vec<f64>,
    cholesky: Cholesky,
}

/// A block that is stored.
#[derive(Debug)]
struct Entry {
    /// Position of its rows.
    row: usize,
    /// Where its numbers begin.
    place: usize,
    /// Where its rows begin in the front of its column's supernode.
    row_in_front: usize,
}

impl NormalEquations {
    /// Equations for blocks of these sizes, with the pairs that are coupled.
    pub(crate) fn new(
        sizes: impl IntoIterator<Item = usize>,
        coupled: impl IntoIterator<Item = (usize, usize)>,
    ) -> Result<Self, Error> {
        let sizes: Vec<usize> = sizes.into_iter().collect();
        let mut starts = vec![0];
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); sizes.len()];
        for (block, size) in sizes.iter().enumerate() {
            starts.push(starts[block] + size);
        }
        for (a, b) in coupled {
            below[a.min(b)].push(a.max(b));
        }
        for rows in &mut below {
            rows.sort_unstable();
            rows.dedup();
        }
        let elimination = Elimination::new(&sizes, &below)?;

        let mut rows: Vec<Vec<usize>> = (0..sizes.len()).map(|position| vec![position]).collect();
        for (block, below) in below.iter().enumerate() {
            for &other in below {
                let [a, b] = [block, other].map(|block| elimination.positions[block]);
                rows[a.min(b)].push(a.max(b));
            }
        }
        let (mut columns, mut numbers) = (Vec::with_capacity(sizes.len()), 0);
        let size = |position: usize| elimination.starts[position + 1] - elimination.starts[position];
        for node in &elimination.supernodes {
            for column in node.positions.clone() {
                rows[column].sort_unstable();
                let entry = |&row: &usize| {
                    let place = numbers;
                    numbers += size(row) * size(column);
                    Entry { row, place, row_in_front: node.place(&elimination.starts, row) }
                };
                columns.push(rows[column].iter().map(entry).collect());
            }
        }
        let (values, right) = (vec![0.0; numbers], vec![0.0; starts.last().copied().unwrap_or(0)]);
        Ok(Self { starts, elimination, columns, values, right, cholesky: Cholesky::default() })
    }

    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
        self.right.fill(0.0);
    }

    /// Adds a product of a factor's Jacobians for two blocks: to the rows of the first block and the columns
    /// of the second.
    pub(crate) fn add<const R: usize, const C: usize>(
        &mut self,
        blocks: [usize; 2],
        product: &SMatrix<f64, R, C>,
    ) {
        let [row, column] = blocks.map(|block| self.elimination.positions[block]);
        if row < column {
            self.add_below([column, row], &product.transpose());
        } else {
            self.add_below([row, column], product);
        }
    }

    /// The same by positions, on or below the diagonal.
    fn add_below<const R: usize, const C: usize>(
        &mut self,
        [row, column]: [usize; 2],
        product: &SMatrix<f64, R, C>,
    ) {
        let Ok(found) = self.columns[column].binary_search_by_key(&row, |entry| entry.row) else { return };
        let place = self.columns[column][found].place;
        for (value, number) in self.values[place..].iter_mut().zip(product.iter()) {
            *value += number;
        }
    }

    /// Subtracts a gradient from the right-hand side.
    pub(crate) fn subtract<const R: usize>(&mut self, block: usize, gradient: &SMatrix<f64, R, 1>) {
        for (right, g) in self.right[self.starts[block]..].iter_mut().zip(gradient.iter()) {
            *right -= g;
        }
    }

    /// Greatest magnitude in the gradient.
    pub(crate) fn steepness(&self) -> f64 {
        self.right.iter().fold(0.0, |most, g| g.abs().max(most))
    }

    /// The solution with each diagonal element enlarged by the share `damping` of itself (Marquardt), and how
    /// much the quadratic model promises to lower the cost. `None` when the equations are not positive
    /// definite.
    pub(crate) fn solve(&mut self, damping: f64) -> Option<(Vec<f64>, f64)> {
        self.factorize(damping)?;
        let step = self.solve_factorized(&self.right);
        // (H + D) step = right: the model lowers the cost by step . right - step . H step / 2.
        let (mut own, mut damped) = (0.0, 0.0);
        for (block, unknowns) in self.starts.windows(2).enumerate() {
            let unknowns = unknowns[0]..unknowns[1];
            let right = &self.right[unknowns.clone()];
            for ((x, g), diagonal) in step[unknowns].iter().zip(right).zip(self.diagonal(block)) {
                own += x * g;
                damped += damping * diagonal * x * x;
            }
        }
        step.iter().all(|x| x.is_finite()).then_some((step, 0.5 * (own + damped)))
    }

    /// The blocks on the diagonal of the inverse, column by column. `None` when the equations do not determine
    /// one of the unknowns of these blocks.
    pub(crate) fn inverses(&mut self, blocks: &[usize]) -> Option<Vec<Vec<f64>>> {
        self.factorize(0.0)?;
        let inverse = |&block: &usize| {
            let (unknowns, mut right) = (self.starts[block]..self.starts[block + 1], self.right.clone());
            let mut columns = Vec::with_capacity(unknowns.len() * unknowns.len());
            for (unknown, information) in unknowns.clone().zip(self.diagonal(block)) {
                right.fill(0.0);
                right[unknown] = 1.0;
                let solution = self.solve_factorized(&right);
                // By how much the other unknowns enlarge the variance of this one.
                let inflation = solution[unknown] * information;
                let is_determined = *information > 0.0 && inflation < MAX_VARIANCE_INFLATION;
                columns.extend_from_slice(is_determined.then_some(&solution[unknowns.clone()])?);
            }
            columns.iter().all(|x| x.is_finite()).then_some(columns)
        };
        blocks.iter().map(inverse).collect()
    }

    /// The diagonal of a block.
    fn diagonal(&self, block: usize) -> impl Iterator<Item = &f64> {
        let size = self.starts[block + 1] - self.starts[block];
        let first = self.columns[self.elimination.positions[block]][0].place;
        self.values[first..].iter().step_by(size + 1).take(size)
    }

    /// Factorizes with each diagonal element enlarged by a share of itself. `None` when not positive
    /// definite.
    fn factorize(&mut self, damping: f64) -> Option<()> {
        let Self { elimination, columns, values, cholesky, .. } = self;
        let size = |position: usize| elimination.starts[position + 1] - elimination.starts[position];
        let is_definite = cholesky.factorize(elimination, |supernode, front| {
            let node = &elimination.supernodes[supernode];
            for position in node.positions.clone() {
                let first = node.place(&elimination.starts, position);
                for entry in &columns[position] {
                    let rows = size(entry.row);
                    let numbers = values[entry.place..][..rows * size(position)].chunks_exact(rows);
                    for (k, numbers) in numbers.enumerate() {
                        front.column_mut(first + k, entry.row_in_front)[..rows].copy_from_slice(numbers);
                    }
                }
                for unknown in first..first + size(position) {
                    let diagonal = &mut front.column_mut(unknown, unknown)[0];
                    // Unknowns that no factor holds stay where they are.
                    *diagonal += damping * *diagonal + f64::MIN_POSITIVE.sqrt();
                }
            }
        });
        is_definite.then_some(())
    }

    /// The solution for a right-hand side, by the last factorization.
    fn solve_factorized(&self, right: &[f64]) -> Vec<f64> {
        let Self { starts, elimination, cholesky, .. } = self;
        let mut ordered = vec![0.0; right.len()];
        let mut solution = ordered.clone();
        for (block, &position) in elimination.positions.iter().enumerate() {
            let right = &right[starts[block]..starts[block + 1]];
            ordered[elimination.starts[position]..][..right.len()].copy_from_slice(right);
        }
        cholesky.solve(elimination, &mut ordered);
        for (block, &position) in elimination.positions.iter().enumerate() {
            let slots = &mut solution[starts[block]..starts[block + 1]];
            slots.copy_from_slice(&ordered[elimination.starts[position]..][..slots.len()]);
        }
        solution
    }

    /// The part of a solution that belongs to a block.
    pub(crate) fn of_block<'a>(&self, step: &'a [f64], block: usize) -> &'a [f64] {
        &step[self.starts[block]..self.starts[block + 1]]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Matrix3x2, Matrix6x3};

    use super::*;

    #[test]
    fn solves_what_dense_equations_say() {
        let sizes = [3, 2, 6, 3];
        let coupled = [(0, 1), (2, 0), (2, 3), (3, 2)];
        let mut equations = NormalEquations::new(sizes, coupled).unwrap();
        let mut random = dymlm_core::SplitMix64::new(3);
        let mut number = move || random.fraction() - 0.5;
        let mut dense = DMatrix::zeros(14, 14);
        let mut add = |at: [usize; 2], [row, column]: [usize; 2], matrix: DMatrix<f64>| {
            let mut view = dense.view_mut((row, column), matrix.shape());
            view += &matrix;
            if at[0] != at[1] {
                let mut view = dense.view_mut((column, row), (matrix.ncols(), matrix.nrows()));
                view += matrix.transpose();
            }
        };
        let a = Matrix3x2::from_fn(|_, _| number());
        equations.add([0, 1], &a);
        add([0, 1], [0, 3], DMatrix::from_iterator(3, 2, a.iter().copied()));
        let b = Matrix6x3::from_fn(|_, _| number());
        for at in [[2, 0], [2, 3]] {
            equations.add(at, &b);
            add(at, [5, [0, 3, 5, 11][at[1]]], DMatrix::from_iterator(6, 3, b.iter().copied()));
        }
        for (block, (size, start)) in sizes.into_iter().zip([0, 3, 5, 11]).enumerate() {
            let own = DMatrix::from_fn(size, size, |r, c| if r == c { 9.0 } else { 0.1 * (r + c) as f64 });
            match size {
                2 => equations.add([block; 2], &nalgebra::Matrix2::from_iterator(own.iter().copied())),
                3 => equations.add([block; 2], &nalgebra::Matrix3::from_iterator(own.iter().copied())),
                _ => equations.add([block; 2], &nalgebra::Matrix6::from_iterator(own.iter().copied())),
            }
            add([block; 2], [start; 2], own);
        }
        let right = nalgebra::Vector6::from_fn(|k, _| 1.0 + k as f64);
        equations.subtract(2, &-right);
        let mut all = DVector::zeros(14);
        all.rows_mut(5, 6).copy_from(&right);
        let (found, gain) = equations.solve(0.0).unwrap();
        let expected = dense.clone().cholesky().unwrap().solve(&all);
        let found = DVector::from_vec(found);
        assert!((&found - &expected).norm() < 1e-12, "{found} {expected}");
        assert!((gain - 0.5 * expected.dot(&all)).abs() < 1e-12);
        assert_eq!(equations.of_block(found.as_slice(), 1).len(), 2);
        let inverse = dense.cholesky().unwrap().inverse();
        let [own, other] = equations.inverses(&[2, 1]).unwrap().try_into().unwrap();
        assert!((DMatrix::from_vec(6, 6, own) - inverse.view((5, 5), (6, 6))).norm() < 1e-12);
        assert!((DMatrix::from_vec(2, 2, other) - inverse.view((3, 3), (2, 2))).norm() < 1e-12);
    }
}
