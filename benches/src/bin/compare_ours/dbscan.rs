use dymlm_geometry::{Clusters, Dbscan, DbscanConfig, DbscanScratch};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_labels;
use crate::timing::{Timing, timed};

/// Memory for `buffers=kept`, as in a program that clusters one cloud after another.
#[derive(Default)]
pub(crate) struct Buffers {
    scratch: DbscanScratch,
    clusters: Clusters,
}

/// `dbscan input= eps= min_points= buffers=kept|fresh`
pub(crate) fn run(request: &Request, inputs: &mut Inputs, kept: &mut Buffers) -> Result<Timing, Failure> {
    let mut config = DbscanConfig::default();
    config.eps = request.number("eps")?;
    config.min_points = request.number("min_points")?;
    let engine = Dbscan::new(config)?;
    let points = inputs.points(request.text("input")?)?;

    let mut fresh = Buffers::default();
    let buffers = if request.keeps_buffers()? { kept } else { &mut fresh };
    let Buffers { scratch, clusters } = buffers;
    let ((), timing) = timed(|| engine.cluster_into(points, scratch, clusters));
    if let Some(path) = request.result() {
        write_labels(path, clusters)?;
    }
    Ok(timing)
}
