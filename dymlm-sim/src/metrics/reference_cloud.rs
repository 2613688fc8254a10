use dymlm_core::{ConfigError, Frame, Point, Pose, check_range};

use super::voxel_key::{VoxelKey, VoxelMap, ball};

/// All frames of a recording without movers stitched together as they are: what a map of the same recording with
/// movers is compared with when there is no exact truth.
///
/// Everything is counted in voxels of one lattice (corner at the world's origin), and distances are those between
/// voxel centres:
/// - residue: share of the map's voxels further than 6 cm from every voxel of the reference,
/// - completeness: share of the reference's voxels that at least three frames hit and that have a voxel of the
///   map within 5 cm.
///
/// Adding a frame of n pixels costs O(n); scoring costs up to 123 look-ups a voxel of 2 cm, one when it is right.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm_sim::ReferenceCloud;
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
    voxels: VoxelMap<Hits>,
}

/// How many frames hit a voxel, and which did so last (counted from 1).
#[derive(Debug, Clone, Copy, Default)]
struct Hits {
    frames: u32,
    last_frame: u32,
}

/// Distance beyond which a map's voxel has no counterpart in the reference, metres.
const RESIDUE_DISTANCE: f32 = 0.06;
/// Distance within which a voxel of the reference is mapped, metres.
const MAPPED_DISTANCE: f32 = 0.05;
/// Frames that must hit a voxel of the reference before it is asked for.
const MIN_FRAMES: u32 = 3;

/// What [`ReferenceCloud::score`] finds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ReferenceScore {
    /// Share of the map's voxels further than 6 cm from every voxel of the reference, 0..=1; 0 for an empty map.
    pub residue: f64,
    /// Share of the reference's voxels hit by at least three frames with a map voxel within 5 cm, 0..=1; 1 when
    /// there are no such voxels.
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
        let mut last = None;
        for v in 0..depth.height() {
            for (u, &z) in depth.row(v).iter().enumerate() {
                if !(z > 0.0 && z >= min_depth && z <= max_depth) {
                    continue;
                }
                let point = camera.back_project([u as f64, v as f64], z.into());
                let point = world_from_camera.transform_point(point).map(|c| c as f32);
                let key = VoxelKey::of(point, voxels_per_metre);
                // Neighbouring pixels often share a voxel.
                if key == last {
                    continue;
                }
                last = key;
                if let Some(key) = key {
                    let hits = self.voxels.entry(key).or_default();
                    hits.frames += u32::from(hits.last_frame != self.frames);
                    hits.last_frame = self.frames;
                }
            }
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
        let map_voxels: VoxelMap<()> =
            map.iter().filter_map(|&p| VoxelKey::of(p, 1.0 / self.voxel_size)).map(|key| (key, ())).collect();

        // Counting does not depend on the order of a hash table.
        let near = ball_within(RESIDUE_DISTANCE, self.voxel_size);
        let residue = map_voxels
            .keys()
            .filter(|key| !near.iter().any(|&offset| self.voxels.contains_key(&key.offset(offset))))
            .count();

        let mapped = ball_within(MAPPED_DISTANCE, self.voxel_size);
        let asked_for = || self.voxels.iter().filter(|(_, hits)| hits.frames >= MIN_FRAMES);
        let reference_voxels = asked_for().count();
        let complete = asked_for()
            .filter(|(key, _)| mapped.iter().any(|&offset| map_voxels.contains_key(&key.offset(offset))))
            .count();

        ReferenceScore {
            residue: residue as f64 / map_voxels.len().max(1) as f64,
            completeness: if reference_voxels == 0 { 1.0 } else { complete as f64 / reference_voxels as f64 },
            map_voxels: map_voxels.len(),
            reference_voxels,
        }
    }
}

/// Voxel offsets within `distance` metres, with a margin against rounding: 6 cm are three voxels of 2 cm.
fn ball_within(distance: f32, voxel_size: f32) -> Vec<[i32; 3]> {
    ball(distance / voxel_size + 1e-3)
}
