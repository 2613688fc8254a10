use dymlm_core::PointCloud;
use dymlm_geometry::{VoxelGrid, VoxelGridConfig, VoxelGridScratch};

use crate::Failure;
use crate::inputs::Inputs;
use crate::request::Request;
use crate::results::write_points;
use crate::timing::{Timing, timed};

/// Memory for `buffers=kept`, as in a program that downsamples one cloud after another.
#[derive(Default)]
pub(crate) struct Buffers {
    scratch: VoxelGridScratch,
    downsampled: PointCloud,
}

/// `voxel_grid input= voxel_size= buffers=kept|fresh`
pub(crate) fn run(request: &Request, inputs: &mut Inputs, kept: &mut Buffers) -> Result<Timing, Failure> {
    let mut config = VoxelGridConfig::default();
    config.voxel_size = request.number("voxel_size")?;
    let engine = VoxelGrid::new(config)?;
    let cloud = PointCloud::new(inputs.points(request.text("input")?)?.to_vec());

    let mut fresh = Buffers::default();
    let buffers = if request.keeps_buffers()? { kept } else { &mut fresh };
    let Buffers { scratch, downsampled } = buffers;
    let ((), timing) = timed(|| engine.downsample_into(&cloud, scratch, downsampled));
    if let Some(path) = request.result() {
        write_points(path, downsampled.points())?;
    }
    Ok(timing)
}
