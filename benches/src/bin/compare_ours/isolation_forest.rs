use dymlm_geometry::{IsolationForest, IsolationForestConfig, IsolationForestScratch, IsolationTrees};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// Memory for `buffers=kept`, as in a program that scores one cloud after another.
#[derive(Default)]
pub(crate) struct Buffers {
    scratch: IsolationForestScratch<3>,
    trees: IsolationTrees<3>,
    scores: Vec<f64>,
}

/// `isolation_forest_fit input= trees= sample_size= buffers=kept|fresh`
pub(crate) fn fit(request: &Request, inputs: &mut Inputs, kept: &mut Buffers) -> Result<Timing, Failure> {
    run(request, inputs, kept, Timed::Fit)
}

/// `isolation_forest_scores input= trees= sample_size= buffers=kept|fresh`: scores of the points on which the
/// trees were grown.
pub(crate) fn scores(request: &Request, inputs: &mut Inputs, kept: &mut Buffers) -> Result<Timing, Failure> {
    run(request, inputs, kept, Timed::Scores)
}

#[derive(Clone, Copy)]
enum Timed {
    Fit,
    Scores,
}

fn run(request: &Request, inputs: &mut Inputs, kept: &mut Buffers, what: Timed) -> Result<Timing, Failure> {
    let mut config = IsolationForestConfig::default();
    config.trees = request.number("trees")?;
    config.sample_size = request.number("sample_size")?;
    let engine = IsolationForest::new(config)?;
    let points = inputs.points(request.text("input")?)?;

    let mut fresh = Buffers::default();
    let buffers = if request.keeps_buffers()? { kept } else { &mut fresh };
    let Buffers { scratch, trees, scores } = buffers;
    let ((), growing) = timed(|| engine.fit_into(points, scratch, trees));
    let ((), scoring) = timed(|| trees.scores_into(points, scores));
    if let Some(path) = request.result() {
        write_numbers(path, scores)?;
    }
    Ok(match what {
        Timed::Fit => growing,
        Timed::Scores => scoring,
    })
}
