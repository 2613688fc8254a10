use dymlm_core::{ConfigError, Frame, Point, Pose, check_range};

use crate::nearest::{MATCHED, OFF_SURFACE, share_within};
use crate::voxel_means::{Voxel, VoxelMeans, readings};

/// All frames of a recording without movers, stitched together as they are. A map of the same place with
/// movers is compared with it when there is no exact truth.
///
/// All shares are counted in voxels of one lattice (with a corner at the world's origin). A voxel's place is
/// the mean of the points in it: the reference's readings or the map's points.
/// - residue: share of the map's voxels further than 6 cm from every voxel of the reference,
/// - completeness: share of the reference's voxels hit by at least three frames that have a voxel of the map
///   within 5 cm.
///
/// Adding a frame of n pixels costs O(n), scoring O(m log m) in the number of voxels.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm_metrics::ReferenceCloud;
///
/// let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5)?;
/// let wall = Frame::new(0.0, camera, DepthImage::new(64, 48, vec![2.0; 64 * 48])?, None)?;
/// let mut reference = ReferenceCloud::new(0.02)?;
/// for _ in 0..3 {
///     reference.add_frame(&wall, &Pose::identity(), 0.3, 4.0);
/// }
/// let map: Vec<[f32; 3]> = vec![[0.0, 0.0, 2.01], [0.0, 0.0, 1.0]];
/// assert_eq!(reference.score(&map).residue, 0.5);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ReferenceCloud {
    voxel_size: f64,
    voxels: VoxelMeans,
}

/// Number of frames that must hit a voxel of the reference before a map is asked for it.
const MIN_FRAMES: u32 = 3;

/// The result of [`ReferenceCloud::score`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ReferenceScore {
    /// Share of the map's voxels further than 6 cm from every voxel of the reference, 0..=1; 0 for an empty
    /// map.
    pub residue: f64,
    /// Share of the reference's voxels hit by at least three frames that have a map voxel within 5 cm, 0..=1;
    /// 1 when there are no such reference voxels.
    pub completeness: f64,
    /// Number of voxels of the map.
    pub map_voxels: usize,
    /// Number of voxels of the reference hit by at least three frames.
    pub reference_voxels: usize,
}

impl ReferenceCloud {
    /// An empty reference with voxels of `voxel_size` metres, 0.002..=1.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when the size is outside its range.
    pub fn new(voxel_size: f64) -> Result<Self, ConfigError> {
        check_range("reference.voxel_size", voxel_size, 0.002..=1.0)?;
        Ok(Self { voxel_size, voxels: VoxelMeans::new(voxel_size) })
    }

    /// Adds every reading of a frame within `min_depth..=max_depth` metres.
    pub fn add_frame(&mut self, frame: &Frame, world_from_camera: &Pose, min_depth: f32, max_depth: f32) {
        let readings = readings(frame, world_from_camera, min_depth..=max_depth);
        self.voxels.add_frame(readings.map(|(_, point)| point));
    }

    /// Number of voxels hit by any frame.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether no voxel was hit.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Scores the points of a map in the world frame. Points that are not finite are ignored.
    pub fn score(&self, map: &[Point]) -> ReferenceScore {
        let mut gathered = VoxelMeans::new(self.voxel_size);
        gathered.add_frame(map.iter().map(|point| point.map(f64::from)));
        let map = means(&gathered, 1);
        let (reference, asked_for) = (means(&self.voxels, 1), means(&self.voxels, MIN_FRAMES));
        ReferenceScore {
            residue: 1.0 - share_within(&map, &reference, OFF_SURFACE).unwrap_or(1.0),
            completeness: share_within(&asked_for, &map, MATCHED).unwrap_or(1.0),
            map_voxels: map.len(),
            reference_voxels: asked_for.len(),
        }
    }
}

/// Means of the voxels hit by at least `min_frames` frames.
fn means(voxels: &VoxelMeans, min_frames: u32) -> Vec<Point> {
    voxels.voxels().iter().filter(|voxel| voxel.frames >= min_frames).map(Voxel::mean).collect()
}
