use std::ops::RangeInclusive;

use dymlm_core::{Error, Frame, Mask, Point, Pose};
use dymlm_geometry::PointTree;

use crate::nearest::{CELL, MATCHED};
use crate::share::share;
use crate::voxel_means::{VoxelMeans, readings};

/// Scores which readings a cleaned map keeps: static and dynamic accuracy as defined by the `DynamicMap`
/// benchmark (Zhang, Duberg, Geng, Jia, Wang, Jensfelt: "A Dynamic Points Removal Benchmark in Point Cloud
/// Maps", ITSC 2023).
///
/// The readings of all frames, in the world, are the ground truth. The frame's exact mask labels each as
/// static or dynamic. The map keeps a reading if one of its points is within the tolerance; otherwise it has
/// removed it:
///
/// - SA = static readings kept / static readings,
/// - DA = dynamic readings removed / dynamic readings,
/// - AA = sqrt(SA DA), the associated accuracy,
/// - HA = 2 SA DA / (SA + DA), the harmonic accuracy.
///
/// The benchmark compares each reading by itself. Here, the readings of one label in a voxel are compared
/// together, at their mean, and count by their number, so that memory does not grow with the number of
/// frames. As in the benchmark, a mover's reading within the tolerance of a static surface, such as a foot's,
/// counts as kept.
///
/// Adding a frame of n pixels costs O(n), scoring O(m log m) in the numbers of voxels and points of the map.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, Mask, PinholeCamera, Pose};
/// use dymlm_metrics::DynamicMapScorer;
///
/// // A wall, and somebody in front of its right half.
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

/// The result of [`DynamicMapScorer::score`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DynamicMapScore {
    /// SA: share of the static readings that the map keeps, 0..=1; `None` when there are none.
    pub static_accuracy: Option<f64>,
    /// DA: share of the dynamic readings that the map has removed, 0..=1; `None` when there are none.
    pub dynamic_accuracy: Option<f64>,
    /// AA: geometric mean of SA and DA; `None` when one of them is `None`.
    pub associated_accuracy: Option<f64>,
    /// HA: harmonic mean of SA and DA, 0 when both are 0; `None` when one of them is `None`.
    pub harmonic_accuracy: Option<f64>,
    /// Number of static readings.
    pub static_readings: u64,
    /// Number of dynamic readings.
    pub dynamic_readings: u64,
}

impl DynamicMapScorer {
    /// A scorer without readings. It will use readings within `depths`, metres: the range that maps use.
    pub fn new(depths: RangeInclusive<f32>) -> Self {
        let none = VoxelMeans::new(CELL);
        Self { depths, static_readings: none.clone(), dynamic_readings: none }
    }

    /// Adds the readings of a frame within the range; `movers` is `true` where a pixel shows a mover.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the mask has another size; nothing is added.
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

    /// Scores the points of a map in the world: those of a cloud, or the centres of an octree's occupied
    /// cells. Points that are not finite are ignored; the points' order and repetition do not matter.
    pub fn score(&self, map: &[Point]) -> DynamicMapScore {
        let map = PointTree::new(map);
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

/// The number of readings, and the number of them that a map keeps.
fn count_kept(readings: &VoxelMeans, map: &PointTree) -> (u64, u64) {
    // In lattice order, successive searches take similar paths through the tree.
    readings.voxels().iter().fold((0, 0), |(all, kept), voxel| {
        let is_kept = map.nearest_within(voxel.mean(), MATCHED).is_some();
        (all + voxel.points, kept + if is_kept { voxel.points } else { 0 })
    })
}
