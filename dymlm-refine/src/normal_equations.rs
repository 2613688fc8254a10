use faer::dyn_stack::{MemBuffer, MemStack};

use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use nalgebra::SMatrix;

use crate::Error;

/// Symmetric equations in blocks, of which only those that some factor couples are stored. What depends on
/// the pattern alone is made once: the order of elimination and the places of the numbers.
///
/// Factorized number by number, not by dense blocks: faer chooses its code for those by the processor that it
/// finds, and the bits would depend on it.
#[derive(Debug)]
pub(crate) struct NormalEquations {
    /// Where the unknowns of each block begin, and the end of the last.
    starts: Vec<usize>,
    /// For each block column the block rows on and below the diagonal, ascending, each with the place of its
    /// first row in the column.
    columns: Vec<Vec<(usize, usize)>>,
    column_starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
    right: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
}

impl NormalEquations {
    /// Of blocks of these sizes, with the pairs that are coupled.
    pub(crate) fn new(
        sizes: impl IntoIterator<Item = usize>,
        coupled: impl IntoIterator<Item = (usize, usize)>,
    ) -> Result<Self, Error> {
        let mut starts = vec![0];
        starts.extend(sizes.into_iter().scan(0, |end, size| {
            *end += size;
            Some(*end)
        }));
        let blocks = starts.len() - 1;
        let mut below: Vec<Vec<usize>> = (0..blocks).map(|block| vec![block]).collect();
        for (a, b) in coupled {
            below[a.min(b)].push(a.max(b));
        }
        let (mut columns, mut column_starts, mut rows) = (Vec::with_capacity(blocks), vec![0], Vec::new());
        for (block, mut below) in below.into_iter().enumerate() {
            below.sort_unstable();
            below.dedup();
            for column in starts[block]..starts[block + 1] {
                // Of the diagonal block the lower triangle.
                let own = below.iter().flat_map(|&row| starts[row]..starts[row + 1]);
                rows.extend(own.filter(|&row| row >= column));
                column_starts.push(rows.len());
            }
            let place = below.iter().scan(0, |next, &row| {
                let place = *next;
                *next += starts[row + 1] - starts[row];
                Some((row, place))
            });
            columns.push(place.collect());
        }
        let unknowns = starts.last().copied().unwrap_or(0);
        let pattern = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &column_starts, None, &rows);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, params);
        let symbolic = symbolic.map_err(|_| Error::Singular)?;
        let (values, right) = (vec![0.0; rows.len()], vec![0.0; unknowns]);
        Ok(Self { starts, columns, column_starts, rows, values, right, symbolic })
    }

    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
        self.right.fill(0.0);
    }

    /// Adds the products of a factor's Jacobian for two blocks: `a` times `b` transposed belongs there where
    /// the rows of `a` and the columns of `b` meet.
    pub(crate) fn add<const R: usize, const C: usize>(
        &mut self,
        [row, column]: [usize; 2],
        product: &SMatrix<f64, R, C>,
    ) {
        if row < column {
            return self.add([column, row], &product.transpose());
        }
        let Ok(found) = self.columns[column].binary_search_by_key(&row, |(row, _)| *row) else { return };
        let place = self.columns[column][found].1;
        for c in 0..C {
            // The triangle lacks what lies above the diagonal: as many numbers as columns have passed.
            let begin = self.column_starts[self.starts[column] + c];
            for r in if row == column { c } else { 0 }..R {
                self.values[begin + place + r - c] += product[(r, c)];
            }
        }
    }

    /// Subtracts from the right-hand side.
    pub(crate) fn subtract<const R: usize>(&mut self, block: usize, gradient: &SMatrix<f64, R, 1>) {
        for (right, g) in self.right[self.starts[block]..].iter_mut().zip(gradient.iter()) {
            *right -= g;
        }
    }

    /// Greatest element of the gradient.
    pub(crate) fn steepness(&self) -> f64 {
        self.right.iter().fold(0.0, |most, g| g.abs().max(most))
    }

    /// The solution with each diagonal element made greater by a share of itself (Marquardt), and how much
    /// the quadratic model promises to lower the cost. `None` when it is not positive definite.
    pub(crate) fn solve(&self, damping: f64) -> Option<(Vec<f64>, f64)> {
        let mut values = self.values.clone();
        for &diagonal in &self.column_starts[..self.column_starts.len() - 1] {
            // What no factor holds stays where it is.
            values[diagonal] += damping * values[diagonal] + f64::MIN_POSITIVE.sqrt();
        }
        let unknowns = self.right.len();
        let pattern =
            SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &self.column_starts, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, &values);
        let mut factor = vec![0.0; self.symbolic.len_val()];
        let scratch = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let factorized = self.symbolic.factorize_numeric_llt(
            &mut factor,
            matrix,
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Spec::default(),
        );
        let factorized = factorized.ok()?;
        let mut step = self.right.clone();
        let scratch = factorized.solve_in_place_scratch::<f64>(1, Par::Seq);
        factorized.solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut step, unknowns, 1),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
        if !step.iter().all(|x| x.is_finite()) {
            return None;
        }
        // (H + D) step = right: the model lowers the cost by step . right - step . H step / 2.
        let own = step.iter().zip(&self.right).map(|(x, g)| x * g).sum::<f64>();
        let damped = step.iter().zip(&self.column_starts).map(|(x, &at)| damping * self.values[at] * x * x);
        Some((step.clone(), 0.5 * (own + damped.sum::<f64>())))
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
    }
}
