use dymlm_core::{ConfigError, Point, PointCloud, Rgb, check_range};

use crate::lattice::{CellNumbers, CellRecords, CubicLattice, Record};

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
/// O(n): a hash table finds the voxels, sums are taken point by point, and a radix sort puts the voxels in
/// order; of a large cloud with too many voxels for a processor's caches, a radix sort puts the points in order. On
/// one thread, with feature `parallel` too.
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
    voxels: CellNumbers,
    sums: Sums,
    /// Of large, scattered clouds.
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
        let VoxelGridScratch { voxels, sums, records } = scratch;
        let (mut points, colors) = std::mem::take(downsampled).into_parts();
        let mut colors = colors.unwrap_or_default();
        points.clear();
        colors.clear();
        let (all_colors, is_colored) = (cloud.colors().unwrap_or_default(), cloud.colors().is_some());
        let is_done = records.visit_if_scattered(self.lattice, cloud.points(), all_colors, |voxel| {
            // Most voxels of a scattered cloud hold one point. A sum is never -0.
            let only = if let [only] = voxel { Some(only) } else { None };
            let mean = || centroid(sum(voxel, |record| record.point));
            points.push(only.map_or_else(mean, |only| only.point.map(|c| c + 0.0)));
            if is_colored {
                let mean = || mean_color(sum(voxel, |record| record.color));
                colors.push(only.map_or_else(mean, |only| only.color));
            }
        });
        if !is_done {
            voxels.find(self.lattice, cloud.points());
            sums.take(voxels, cloud.points());
            sums.write(voxels, &mut points, centroid);
            if is_colored {
                sums.take(voxels, all_colors);
                sums.write(voxels, &mut colors, mean_color);
            }
        }
        *downsampled = match cloud.colors() {
            None => PointCloud::new(points),
            // One point and one colour per voxel, so that the counts agree.
            Some(_) => PointCloud::with_colors(points, colors).unwrap_or_default(),
        };
    }
}

/// Sums over the points of a voxel, in the order of the cloud.
#[inline]
fn sum<N: Copy + Into<f64>>(voxel: &[Record], value: impl Fn(&Record) -> [N; 3]) -> [f64; 4] {
    voxel.iter().fold([0.0; 4], |sum, record| add(sum, value(record)))
}

/// Adds one value.
#[inline]
fn add<N: Copy + Into<f64>>(sum: [f64; 4], value: [N; 3]) -> [f64; 4] {
    let [x, y, z] = value.map(Into::into);
    [sum[0] + x, sum[1] + y, sum[2] + z, sum[3] + 1.0]
}

/// Sums of three values, and the number of summands, by the voxel's number.
#[derive(Debug, Default)]
struct Sums(Vec<[f64; 4]>);

impl Sums {
    /// Sums over the points of each voxel, in the order of the cloud.
    fn take<T: Copy + Into<f64>>(&mut self, voxels: &CellNumbers, values: &[[T; 3]]) {
        self.0.clear();
        self.0.resize(voxels.end(), [0.0; 4]);
        for (&number, value) in voxels.of_points().iter().zip(values) {
            let sum = &mut self.0[number as usize];
            *sum = add(*sum, *value);
        }
    }

    /// Writes one average per voxel.
    fn write<T>(&self, voxels: &CellNumbers, averages: &mut Vec<T>, of: impl Fn([f64; 4]) -> T) {
        averages.clear();
        averages.extend(voxels.ascending().map(|number| of(self.0[number])));
    }
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
