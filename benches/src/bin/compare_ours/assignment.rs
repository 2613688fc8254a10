use std::collections::BTreeMap;

use dymlm_geometry::Assignment;

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// Integer weights by path, and the engine with its buffers.
#[derive(Default)]
pub(crate) struct Assignments {
    weights: BTreeMap<String, Vec<i64>>,
    engine: Assignment,
}

/// `assignment input= size=`: pairs rows with columns in each of the file's matrices of `size` x `size` whole
/// numbers, so that the sum is the greatest.
pub(crate) fn run(request: &Request, inputs: &mut Inputs, kept: &mut Assignments) -> Result<Timing, Failure> {
    let path = request.text("input")?;
    if !kept.weights.contains_key(path) {
        let weights = inputs.floats(path)?.iter().map(|&weight| weight as i64).collect();
        kept.weights.insert(path.to_owned(), weights);
    }
    let weights = kept.weights.get(path).map_or(&[][..], Vec::as_slice);
    let size: usize = request.number("size")?;
    if size == 0 {
        return Err("size=0 is no matrix".into());
    }

    let (engine, matrices) = (&mut kept.engine, weights.chunks_exact(size * size));
    let mut sums = Vec::with_capacity(matrices.len());
    let ((), timing) = timed(|| {
        for matrix in matrices {
            let partners = engine.solve(size, size, |row, column| matrix[row * size + column]);
            let paired = partners.iter().enumerate();
            let sum: i64 =
                paired.filter_map(|(row, column)| column.map(|column| matrix[row * size + column])).sum();
            sums.push(sum as f64);
        }
    });
    if let Some(path) = request.result() {
        write_numbers(path, &sums)?;
    }
    Ok(timing)
}
