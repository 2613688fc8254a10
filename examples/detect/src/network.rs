use std::fs;
use std::path::Path;

use tract_onnx::prelude::*;
use tract_onnx::tract_hir::internal::{DimLike, Factoid};

use crate::Error;
use crate::output_grid::OutputGrid;

/// Most pixels of a network's input, 4096x4096, so that a damaged file cannot request more memory than there
/// is.
const MAX_INPUT_PIXELS: usize = 1 << 24;

/// A YOLOX network, read from its file and optimized for this machine.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    plan: Arc<TypedRunnableModel>,
    size: [usize; 2],
    grid: OutputGrid,
}

impl Network {
    /// Reads an ONNX file with one input, `1 x 3 x height x width` floats, and one output, `1 x rows x columns`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], [`Error::Unreadable`], [`Error::NotYolox`].
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
        let not_yolox = |reason| Error::NotYolox { path: path.to_path_buf(), reason };
        let unreadable =
            |error: TractError| Error::Unreadable { path: path.to_path_buf(), reason: reason(&error) };

        let model = tract_onnx::onnx().model_for_read(&mut &*bytes).map_err(unreadable)?;
        let size = input_size(&model).map_err(not_yolox)?;
        let plan = runnable(model, size).map_err(unreadable)?;
        let grid = OutputGrid::new(size, output_size(&plan).map_err(not_yolox)?).map_err(not_yolox)?;
        Ok(Self { plan, size, grid })
    }

    /// Width and height of its input, pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// How to read its output.
    pub(crate) fn grid(&self) -> &OutputGrid {
        &self.grid
    }

    /// Runs the network on three planes of the input's size; returns the output row by row.
    ///
    /// # Errors
    ///
    /// [`Error::Run`].
    pub(crate) fn run(&self, planes: &[f32]) -> Result<Vec<f32>, Error> {
        let [width, height] = self.size;
        let output = || -> TractResult<Vec<f32>> {
            let input = Tensor::from_shape(&[1, 3, height, width], planes)?;
            let outputs = self.plan.run(tvec![input.into_tvalue()])?;
            let output = outputs.first().ok_or_else(|| TractError::msg("no output"))?;
            Ok(output.try_as_plain_ram()?.as_slice::<f32>()?.to_vec())
        };
        output().map_err(|error| Error::Run { reason: reason(&error) })
    }
}

/// Width and height of a network's only input, which must be an image of three channels; else a description
/// of what it is instead.
fn input_size(model: &InferenceModel) -> Result<[usize; 2], String> {
    let &[input] = model.inputs.as_slice() else {
        return Err(format!("{} inputs instead of one", model.inputs.len()));
    };
    let fact = model.outlet_fact(input).map_err(|error| reason(&error))?;
    let is_float = fact.datum_type().is_some_and(|kind| kind == f32::datum_type());
    let sides: Vec<Option<usize>> =
        fact.shape.dims().map(|side| side.concretize().and_then(|side| side.to_usize().ok())).collect();
    match *sides.as_slice() {
        // Networks that accept several images at once leave their number open.
        [Some(1) | None, Some(3), Some(height), Some(width)]
            if is_float && width.checked_mul(height).is_some_and(|pixels| pixels <= MAX_INPUT_PIXELS) =>
        {
            Ok([width, height])
        }
        _ => Err(format!("an input of {fact:?} instead of floats, 1 x 3 x height x width")),
    }
}

/// Rows and columns of a network's only output; else a description of what it is instead.
fn output_size(plan: &TypedRunnableModel) -> Result<[usize; 2], String> {
    let model = plan.model();
    let &[output] = model.outputs.as_slice() else {
        return Err(format!("{} outputs instead of one", model.outputs.len()));
    };
    let fact = model.outlet_fact(output).map_err(|error| reason(&error))?;
    match fact.shape.as_concrete() {
        Some(&[1, rows, columns]) if fact.datum_type == f32::datum_type() => Ok([rows, columns]),
        _ => Err(format!("an output of {fact:?} instead of floats, 1 x rows x columns")),
    }
}

/// A network for one image at a time, ready to run.
fn runnable(model: InferenceModel, [width, height]: [usize; 2]) -> TractResult<Arc<TypedRunnableModel>> {
    let fact = InferenceFact::dt_shape(f32::datum_type(), [1, 3, height, width]);
    model.with_input_fact(0, fact)?.into_optimized()?.into_runnable()
}

/// tract's error with all its causes.
fn reason(error: &TractError) -> String {
    format!("{error:#}")
}
