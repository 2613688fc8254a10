use std::ops::RangeInclusive;

use dymlm_core::{Error, Frame, Mask, Point, Pose};

use crate::nearest::{CELL, MATCHED, Neighbors};
use crate::share::share;
use crate::voxel_means::{VoxelMeans, readings};

/// Which of all readings a cleaned map keeps: static and dynamic accuracy as the `DynamicMap` benchmark has
/// them (Zhang, Duberg, Geng, Jia, Wang, Jensfelt: "A Dynamic Points Removal Benchmark in Point Cloud Maps",
/// ITSC 2023).
///
/// The readings of all frames, in the world, are the ground truth, each labelled static or dynamic by the
/// frame's exact mask. The map keeps a reading when one of its points lies within the tolerance, and
/// otherwise has removed it:
///
/// - SA = static readings kept / static readings,
/// - DA = dynamic readings removed / dynamic readings,
/// - AA = sqrt(SA DA), the associated accuracy,
/// - HA = 2 SA DA / (SA + DA), the harmonic accuracy.
///
/// The benchmark asks for each reading by itself. Here those of one label in a voxel are asked for together,
/// at their mean, and count as many as they are; so memory does not grow with the frames. A mover's reading
/// within the tolerance of a static surface, such as a foot's, counts as kept, there as here.
///
/// Adding a frame of n pixels costs O(n), scoring O(m log m) in the numbers of voxels and points of the map.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, Mask, PinholeCamera, Pose};
/// use dymlm_metrics::DynamicMapScorer;
///
/// // A wall, and somebody before the right half of it.
/// let camera = PinholeCamera::new(2, 1, 1.0, 1.0, 0.5, 0.0)?;
/// let frame = Frame::new(0.0, camera, DepthImage::new(2, 1, vec![2.0, 1.0])?, None)?;
/// let movers = Mask::new(2, 1, vec![false, true])?;
/// let mut scorer = DynamicMapScorer::new(0.5..=4.0);
/// scorer.add_frame(&frame, &movers, &Pose::identity())?;
///
/// let raw = scorer.score(&[[-1.0, 0.0, 2.0], [0.5, 0.0, 1.0]]);
/// assert_eq!((raw.static_accuracy, raw.dynamic_accuracy), (Some(1.0), Some(0.0)));
/// let clean = scorer.score(&[[-1.0, 0.0, 2.0]]);
/// assert_eq!(clean.harmonic_accuracy, Some(1.0));
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct DynamicMapScorer {
    depths: RangeInclusive<f32>,
    static_readings: VoxelMeans,
    dynamic_readings: VoxelMeans,
}

/// What [`DynamicMapScorer::score`] finds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DynamicMapScore {
    /// SA: share of the static readings that the map keeps, 0..=1; `None` when there are none.
    pub static_accuracy: Option<f64>,
    /// DA: share of the dynamic readings that the map has removed, 0..=1; `None` when there are none.
    pub dynamic_accuracy: Option<f64>,
    /// AA: geometric mean of SA and DA; `None` when one of them is.
    pub associated_accuracy: Option<f64>,
    /// HA: harmonic mean of SA and DA, 0 when both are; `None` when one of them is.
    pub harmonic_accuracy: Option<f64>,
    /// Number of static readings.
    pub static_readings: u64,
    /// Number of dynamic readings.
    pub dynamic_readings: u64,
}

impl DynamicMapScorer {
    /// A scorer without readings, for those within `depths`, metres: as far as maps use the sensor.
    pub fn new(depths: RangeInclusive<f32>) -> Self {
        let none = VoxelMeans::new(CELL);
        Self { depths, static_readings: none.clone(), dynamic_readings: none }
    }

    /// Adds the readings of a frame within range; `movers` is `true` where a pixel shows a mover.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the mask is of another size; nothing is added.
    pub fn add_frame(&mut self, frame: &Frame, movers: &Mask, world_from_camera: &Pose) -> Result<(), Error> {
        frame.camera().check_size("the mask of the movers", movers.width(), movers.height())?;
        let width = movers.width();
        for (voxels, moves) in [(&mut self.static_readings, false), (&mut self.dynamic_readings, true)] {
            let readings = readings(frame, world_from_camera, self.depths.clone());
            let labelled = readings.filter(|(pixel, _)| movers.at(pixel % width, pixel / width) == moves);
            voxels.add_frame(labelled.map(|(_, point)| point));
        }
        Ok(())
    }

    /// Scores the points of a map in the world: of a cloud, or the centres of an octree's occupied cells.
    /// Points that are not finite are passed over; their order and number do not matter.
    pub fn score(&self, map: &[Point]) -> DynamicMapScore {
        let map = Neighbors::of(map);
        let [(statics, kept_statics), (dynamics, kept_dynamics)] =
            [&self.static_readings, &self.dynamic_readings].map(|readings| count_kept(readings, &map));

        let static_accuracy = share(kept_statics, statics);
        let dynamic_accuracy = share(dynamics - kept_dynamics, dynamics);
        let both = static_accuracy.zip(dynamic_accuracy);
        DynamicMapScore {
            static_accuracy,
            dynamic_accuracy,
            associated_accuracy: both.map(|(sa, da)| (sa * da).sqrt()),
            harmonic_accuracy: both
                .map(|(sa, da)| if sa + da > 0.0 { 2.0 * sa * da / (sa + da) } else { 0.0 }),
            static_readings: statics,
            dynamic_readings: dynamics,
        }
    }
}

/// How many readings there are, and how many of them a map keeps.
fn count_kept(readings: &VoxelMeans, map: &Neighbors) -> (u64, u64) {
    // In the order of the lattice: searches that follow each other go the same way through the tree.
    readings.voxels().iter().fold((0, 0), |(all, kept), voxel| {
        let is_kept = map.reach(voxel.mean(), MATCHED);
        (all + voxel.points, kept + if is_kept { voxel.points } else { 0 })
    })
}
