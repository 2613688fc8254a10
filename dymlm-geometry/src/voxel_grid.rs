use dymlm_core::{ConfigError, Point, PointCloud, Rgb, check_range};

use crate::lattice::{CellSort, CubicLattice};
use crate::parallel::{for_each, task_size};

/// How coarse a downsampled cloud is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct VoxelGridConfig {
    /// Side of a voxel, metres; 1e-5 to 1e5. Default 0.01: the voxels of the cloud map.
    pub voxel_size: f64,
}

impl Default for VoxelGridConfig {
    fn default() -> Self {
        Self { voxel_size: 0.01 }
    }
}

/// Downsampling to one point a voxel: the centroid of the points in it, with their mean colour.
///
/// Point p lies in voxel floor(p / `voxel_size`), axis by axis: the lattice is anchored at the origin, so
/// that clouds in one frame share their voxels. The quotient is evaluated in f64 as p * (1 / `voxel_size`).
/// Further than 2^26 voxels from the origin, where one step of an f32 spans several voxels, voxels are as
/// large as that step.
///
/// Voxels come in ascending order of x, then y, then z. Sums are taken in f64, in the order of the cloud, and
/// rounded to f32 once, so that a centroid is off by half a unit in the last place at most, give or take
/// 2^-53 a point; mean colours are rounded to the nearest, halves up. Points that are not finite are left
/// out.
///
/// O(n): a radix sort by voxel. The same bits come out with feature `parallel`, on any number of threads.
///
/// Same meaning as PCL's `VoxelGrid`; Rusu, Cousins: "3D is here: Point Cloud Library (PCL)", ICRA 2011.
///
/// ```
/// use dymlm_core::PointCloud;
/// use dymlm_geometry::{VoxelGrid, VoxelGridConfig};
///
/// let mut config = VoxelGridConfig::default();
/// config.voxel_size = 0.5;
/// let cloud = PointCloud::new(vec![[0.75, 0.0, 0.0], [-0.1, 0.2, 0.0], [0.25, 0.0, 0.0], [0.0, 0.25, 0.0]]);
///
/// let small = VoxelGrid::new(config)?.downsample(&cloud);
/// assert_eq!(small.points(), [[-0.1, 0.2, 0.0], [0.125, 0.125, 0.0], [0.75, 0.0, 0.0]]);
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoxelGrid {
    lattice: CubicLattice,
}

/// Working memory of [`VoxelGrid::downsample_into`]; kept between calls, it saves all allocation.
#[derive(Debug, Default)]
pub struct VoxelGridScratch {
    voxels: CellSort,
}

impl VoxelGridScratch {
    /// Empty working memory.
    pub fn new() -> Self {
        Self::default()
    }
}

impl VoxelGrid {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its documented range.
    pub fn new(config: VoxelGridConfig) -> Result<Self, ConfigError> {
        check_range("voxel_grid.voxel_size", config.voxel_size, 1e-5..=1e5)?;
        Ok(Self { lattice: CubicLattice::new(config.voxel_size) })
    }

    /// Downsamples a cloud; with colours if it has them.
    pub fn downsample(&self, cloud: &PointCloud) -> PointCloud {
        let mut downsampled = PointCloud::default();
        self.downsample_into(cloud, &mut VoxelGridScratch::new(), &mut downsampled);
        downsampled
    }

    /// Downsamples a cloud into a caller's, whose content does not matter. Allocates nothing once the buffers
    /// have grown to the size of the clouds (feature `parallel` allocates its lists of tasks).
    pub fn downsample_into(
        &self,
        cloud: &PointCloud,
        scratch: &mut VoxelGridScratch,
        downsampled: &mut PointCloud,
    ) {
        let VoxelGridScratch { voxels } = scratch;
        voxels.sort(self.lattice, cloud.points());

        let (mut points, colors) = std::mem::take(downsampled).into_parts();
        average(voxels, &mut points, |voxels, voxel| centroid(cloud.points(), voxels, voxel));
        *downsampled = match cloud.colors() {
            None => PointCloud::new(points),
            Some(all_colors) => {
                let mut colors = colors.unwrap_or_default();
                average(voxels, &mut colors, |voxels, voxel| mean_color(all_colors, voxels, voxel));
                // One of each a voxel, so that the counts agree.
                PointCloud::with_colors(points, colors).unwrap_or_default()
            }
        };
    }
}

/// Computes one value a voxel from the ranges of its points.
fn average<T: Copy + Default + Send>(
    voxels: &CellSort,
    averages: &mut Vec<T>,
    of: impl Fn(&CellSort, usize) -> T + Send + Sync,
) {
    averages.resize(voxels.cell_count(), T::default());
    let share = task_size(averages.len());
    for_each(averages.chunks_mut(share).enumerate(), |(task, averages)| {
        for (voxel, average) in (task * share..).zip(averages) {
            *average = of(voxels, voxel);
        }
    });
}

/// Mean of the points of a voxel.
#[inline]
fn centroid(points: &[Point], voxels: &CellSort, voxel: usize) -> Point {
    let mut sum = [0.0_f64; 3];
    let mut count = 0;
    for run in voxels.runs_of_cell(voxel) {
        count += run.len();
        for point in &points[run] {
            for axis in 0..3 {
                sum[axis] += f64::from(point[axis]);
            }
        }
    }
    sum.map(|sum| (sum / count as f64) as f32)
}

/// Mean colour of a voxel, to the nearest, halves up.
#[inline]
fn mean_color(colors: &[Rgb], voxels: &CellSort, voxel: usize) -> Rgb {
    let mut sum = [0_u64; 3];
    let mut count = 0;
    for run in voxels.runs_of_cell(voxel) {
        count += run.len() as u64;
        for color in &colors[run] {
            for channel in 0..3 {
                sum[channel] += u64::from(color[channel]);
            }
        }
    }
    sum.map(|sum| ((2 * sum + count) / (2 * count).max(1)) as u8)
}
