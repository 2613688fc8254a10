use dymlm_core::{ConfigError, Frame, Point, Pose, check_range};

use crate::nearest::share_within;
use crate::voxel_key::{VoxelKey, VoxelMap};

/// All frames of a recording without movers stitched together as they are: what a map of the same recording
/// with movers is compared with when there is no exact truth.
///
/// Everything is counted in voxels of one lattice (corner at the world's origin); a voxel stands at the mean
/// of the points in it, of the reference's readings or of the map's points:
/// - residue: share of the map's voxels further than 6 cm from every voxel of the reference,
/// - completeness: share of the reference's voxels that at least three frames hit and that have a voxel of
///   the map within 5 cm.
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
    voxel_size: f32,
    frames: u32,
    voxels: VoxelMap<Voxel>,
}

/// The points in a voxel, how many frames hit it, and which did so last (counted from 1).
#[derive(Debug, Clone, Copy, Default)]
struct Voxel {
    sum: [f64; 3],
    points: u32,
    frames: u32,
    last_frame: u32,
}

impl Voxel {
    fn add(&mut self, other: &Self) {
        (0..3).for_each(|axis| self.sum[axis] += other.sum[axis]);
        self.points = self.points.saturating_add(other.points);
    }

    fn mean(&self) -> Point {
        self.sum.map(|sum| (sum / f64::from(self.points.max(1))) as f32)
    }
}

/// Distance beyond which a map's voxel has no counterpart in the reference, metres.
const RESIDUE_DISTANCE: f32 = 0.06;
/// Distance within which a voxel of the reference is mapped, metres.
const MAPPED_DISTANCE: f32 = 0.05;
/// Frames that must hit a voxel of the reference before it is asked for.
const MIN_FRAMES: u32 = 3;

/// What [`ReferenceCloud::score`] finds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ReferenceScore {
    /// Share of the map's voxels further than 6 cm from every voxel of the reference, 0..=1; 0 for an empty
    /// map.
    pub residue: f64,
    /// Share of the reference's voxels hit by at least three frames with a map voxel within 5 cm, 0..=1; 1
    /// when there are no such voxels.
    pub completeness: f64,
    /// Number of voxels of the map.
    pub map_voxels: usize,
    /// Number of voxels of the reference that at least three frames hit.
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
        Ok(Self { voxel_size: voxel_size as f32, frames: 0, voxels: VoxelMap::default() })
    }

    /// Adds every reading of a frame within `min_depth..=max_depth` metres.
    pub fn add_frame(&mut self, frame: &Frame, world_from_camera: &Pose, min_depth: f32, max_depth: f32) {
        self.frames += 1;
        let voxels_per_metre = 1.0 / self.voxel_size;
        let (camera, depth) = (frame.camera(), frame.depth());
        // Neighbouring pixels often share a voxel: each run of them is looked up once.
        let mut run = (None, Voxel::default());
        for v in 0..depth.height() {
            for (u, &z) in depth.row(v).iter().enumerate() {
                if !(z > 0.0 && z >= min_depth && z <= max_depth) {
                    continue;
                }
                let point = camera.back_project([u as f64, v as f64], z.into());
                let point = world_from_camera.transform_point(point);
                let key = VoxelKey::of(point.map(|c| c as f32), voxels_per_metre);
                if key != run.0 {
                    self.add_run(run);
                    run = (key, Voxel::default());
                }
                run.1.add(&Voxel { sum: point, points: 1, ..Voxel::default() });
            }
        }
        self.add_run(run);
    }

    fn add_run(&mut self, (key, run): (Option<VoxelKey>, Voxel)) {
        if let Some(key) = key {
            let voxel = self.voxels.entry(key).or_default();
            voxel.add(&run);
            voxel.frames += u32::from(voxel.last_frame != self.frames);
            voxel.last_frame = self.frames;
        }
    }

    /// Number of voxels that any frame hit.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether no frame hit anything.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// Scores the points of a map in the world frame. Points that are not finite are passed over.
    pub fn score(&self, map: &[Point]) -> ReferenceScore {
        let mut map_voxels: VoxelMap<Voxel> = VoxelMap::default();
        for &point in map {
            if let Some(key) = VoxelKey::of(point, 1.0 / self.voxel_size) {
                let point = Voxel { sum: point.map(f64::from), points: 1, ..Voxel::default() };
                map_voxels.entry(key).or_default().add(&point);
            }
        }
        let map = means(map_voxels.iter());
        let reference = means(self.voxels.iter());
        let asked_for = means(self.voxels.iter().filter(|(_, voxel)| voxel.frames >= MIN_FRAMES));
        ReferenceScore {
            residue: 1.0 - share_within(&map, &reference, RESIDUE_DISTANCE).unwrap_or(1.0),
            completeness: share_within(&asked_for, &map, MAPPED_DISTANCE).unwrap_or(1.0),
            map_voxels: map.len(),
            reference_voxels: asked_for.len(),
        }
    }
}

/// The voxels' means in the order of the lattice, so that the order of a hash table shows nowhere.
fn means<'a>(voxels: impl Iterator<Item = (&'a VoxelKey, &'a Voxel)>) -> Vec<Point> {
    let mut voxels: Vec<(VoxelKey, Point)> = voxels.map(|(&key, voxel)| (key, voxel.mean())).collect();
    voxels.sort_unstable_by_key(|&(key, _)| key);
    voxels.into_iter().map(|(_, mean)| mean).collect()
}
