use std::ops::RangeInclusive;

use dymlm_core::{Error, Frame, Mask, Point, Pose};

use crate::nearest::Neighbors;
use crate::voxel_key::{VoxelKey, VoxelMap};

/// Distance within which a point of the map stands for a reading, metres: the benchmark's.
const TOLERANCE: f32 = 0.05;
/// Side of the voxels that readings of one label are gathered in, metres. Smaller ones ask for each reading
/// more exactly and take more memory; at this side the shares are off by less than 2 %.
const VOXEL_SIZE: f64 = 0.02;

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
    static_readings: VoxelMap<Readings>,
    dynamic_readings: VoxelMap<Readings>,
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

/// The readings in a voxel.
#[derive(Debug, Clone, Copy, Default)]
struct Readings {
    sum: [f64; 3],
    count: u64,
}

impl DynamicMapScorer {
    /// A scorer without readings, for those within `depths`, metres: as far as maps use the sensor.
    pub fn new(depths: RangeInclusive<f32>) -> Self {
        Self { depths, static_readings: VoxelMap::default(), dynamic_readings: VoxelMap::default() }
    }

    /// Adds the readings of a frame within range; `movers` is `true` where a pixel shows a mover.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the mask is of another size; nothing is added.
    pub fn add_frame(&mut self, frame: &Frame, movers: &Mask, world_from_camera: &Pose) -> Result<(), Error> {
        let (camera, depth) = (frame.camera(), frame.depth());
        camera.check_size("the mask of the movers", movers.width(), movers.height())?;
        // Neighbouring pixels often share a voxel: each run of them is looked up once.
        let mut run = Run::default();
        for (pixel, (&z, mover)) in depth.data().iter().zip(movers.pixels()).enumerate() {
            if !(z > 0.0 && self.depths.contains(&z)) {
                continue;
            }
            let (u, v) = (pixel % depth.width(), pixel / depth.width());
            let point = camera.back_project([u as f64, v as f64], z.into());
            let point = world_from_camera.transform_point(point);
            let voxel = VoxelKey::of(point.map(|c| c as f32), (1.0 / VOXEL_SIZE) as f32);
            if (voxel, mover) != (run.voxel, run.mover) {
                self.add_run(&run);
                run = Run { voxel, mover, readings: Readings::default() };
            }
            run.readings.add(&Readings { sum: point, count: 1 });
        }
        self.add_run(&run);
        Ok(())
    }

    /// Scores the points of a map in the world: of a cloud, or the centres of an octree's occupied cells.
    /// Points that are not finite are passed over; their order and number do not matter.
    pub fn score(&self, map: &[Point]) -> DynamicMapScore {
        let map: Vec<Point> =
            map.iter().copied().filter(|point| point.iter().all(|c| c.is_finite())).collect();
        let map = Neighbors::of(&map, TOLERANCE);
        let [statics, dynamics] =
            [&self.static_readings, &self.dynamic_readings].map(|readings| Kept::count(readings, &map));

        let static_accuracy = share(statics.kept, statics.total);
        let dynamic_accuracy = share(dynamics.total - dynamics.kept, dynamics.total);
        let both = static_accuracy.zip(dynamic_accuracy);
        DynamicMapScore {
            static_accuracy,
            dynamic_accuracy,
            associated_accuracy: both.map(|(sa, da)| (sa * da).sqrt()),
            harmonic_accuracy: both
                .map(|(sa, da)| if sa + da > 0.0 { 2.0 * sa * da / (sa + da) } else { 0.0 }),
            static_readings: statics.total,
            dynamic_readings: dynamics.total,
        }
    }

    fn add_run(&mut self, run: &Run) {
        let Some(voxel) = run.voxel else { return };
        let of_label = if run.mover { &mut self.dynamic_readings } else { &mut self.static_readings };
        of_label.entry(voxel).or_default().add(&run.readings);
    }
}

/// Readings of successive pixels with one label in one voxel.
#[derive(Default)]
struct Run {
    voxel: Option<VoxelKey>,
    mover: bool,
    readings: Readings,
}

impl Readings {
    fn add(&mut self, other: &Self) {
        (0..3).for_each(|axis| self.sum[axis] += other.sum[axis]);
        self.count += other.count;
    }

    fn mean(&self) -> Point {
        self.sum.map(|sum| (sum / self.count.max(1) as f64) as f32)
    }
}

/// Of how many readings, how many a map keeps.
struct Kept {
    kept: u64,
    total: u64,
}

impl Kept {
    fn count(readings: &VoxelMap<Readings>, map: &Neighbors) -> Self {
        // In the order of the lattice: searches that follow each other go the same way through the tree.
        let mut in_order: Vec<(VoxelKey, Readings)> =
            readings.iter().map(|(&voxel, &r)| (voxel, r)).collect();
        in_order.sort_unstable_by_key(|&(voxel, _)| voxel);
        let mut sum = Self { kept: 0, total: 0 };
        for (_, readings) in in_order {
            sum.total += readings.count;
            sum.kept += if map.reach(readings.mean()) { readings.count } else { 0 };
        }
        sum
    }
}

fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
