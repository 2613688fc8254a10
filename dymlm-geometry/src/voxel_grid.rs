use dymlm_core::{ConfigError, Point, PointCloud, Rgb, check_range};

use crate::lattice::{CellRecords, CubicLattice, Record};

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

/// Downsampling to one point per voxel: the centroid of the points in it, with their mean colour.
///
/// Point p lies in voxel floor(p / `voxel_size`), axis by axis: the lattice is anchored at the origin, so
/// that clouds in one frame share their voxels. The quotient is evaluated in f64 as p * (1 / `voxel_size`).
/// Further than 2^26 voxels from the origin, where one step of an f32 spans several voxels, voxels are as
/// large as that step.
///
/// Voxels come in ascending order of x, then y, then z. Sums are taken in f64, in the order of the cloud, and
/// rounded to f32 once, so that a centroid is off by half a unit in the last place at most, plus 2^-53 per
/// point; mean colours are rounded to the nearest, halves up. Points that are not finite are left out.
///
/// O(n): a radix sort puts the points in the order of their voxels. On one thread, with feature `parallel` too.
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
    records: CellRecords,
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
        self.downsample_into(cloud, &mut VoxelGridScratch::default(), &mut downsampled);
        downsampled
    }

    /// Downsamples a cloud into a caller's cloud, whose content does not matter. Allocates nothing once the
    /// buffers have grown to the size of the clouds.
    pub fn downsample_into(
        &self,
        cloud: &PointCloud,
        scratch: &mut VoxelGridScratch,
        downsampled: &mut PointCloud,
    ) {
        let VoxelGridScratch { records } = scratch;
        records.sort(self.lattice, cloud.points(), cloud.colors().unwrap_or_default());

        let (mut points, mut colors) = std::mem::take(downsampled).into_parts();
        points.clear();
        if cloud.colors().is_some() {
            colors.get_or_insert_default().clear();
        } else {
            colors = None;
        }
        for voxel in records.cells() {
            points.push(centroid(sums(voxel, |record| record.point.map(f64::from))));
            if let Some(colors) = &mut colors {
                colors.push(mean_color(sums(voxel, |record| record.color.map(f64::from))));
            }
        }
        *downsampled = match colors {
            None => PointCloud::new(points),
            // One point and one colour per voxel, so that the counts agree.
            Some(colors) => PointCloud::with_colors(points, colors).unwrap_or_default(),
        };
    }
}

/// The sums of three values over a voxel's points, in the order of the cloud, and the number of points.
#[inline]
fn sums(voxel: &[Record], values: impl Fn(&Record) -> [f64; 3]) -> [f64; 4] {
    voxel.iter().fold([0.0; 4], |sum, record| {
        let [x, y, z] = values(record);
        [sum[0] + x, sum[1] + y, sum[2] + z, sum[3] + 1.0]
    })
}

#[inline]
fn centroid([x, y, z, count]: [f64; 4]) -> Point {
    [x, y, z].map(|sum| (sum / count) as f32)
}

/// Rounds to the nearest, halves up; in integers, since the sums are integers.
#[inline]
fn mean_color([r, g, b, count]: [f64; 4]) -> Rgb {
    let count = count as u64;
    [r, g, b].map(|sum| ((2 * sum as u64 + count) / (2 * count).max(1)) as u8)
}
