use std::collections::HashSet;
use std::hash::BuildHasherDefault;

use dymlm_core::{Frame, Point, Pose, SensorModel};

use super::cells::{Readings, find_cells};
use super::marks::Marks;
use super::ray::RayOrigin;
use super::scan_scratch::ScanScratch;
use super::sparse_marks::{IntegerHasher, SparseMarks};
use crate::lattice::{Lattice, pack};
use crate::{Error, InsertReport, Octree, RayMode};

/// Cells along each side of a block.
const SIDE: f64 = 8.0;
/// Number of rays between two counts of the blocks.
const RAYS: usize = 64;

/// Checks how much of the map a scan touches, before anything is changed or allocated for it.
impl Octree {
    /// Greatest number of blocks of 8x8x8 cells, about, that the rays of one scan may pass: 0.7 GB of map. A
    /// depth camera before a wall at 3 m stays below it with cells of 5 mm, and a laser on a car between
    /// houses with cells of 10 cm.
    pub const MAX_SCAN_BLOCKS: usize = 1 << 20;

    /// Checks whether a frame would be accepted, and changes nothing. The limit here is half of
    /// [`Self::MAX_SCAN_BLOCKS`], so that an accepted frame can also be [inserted](Self::insert_depth) from
    /// other poses, where its rays pass somewhat more cells.
    ///
    /// Costs next to nothing where all cells in reach are within the limit, else an eighth of an insertion.
    ///
    /// # Errors
    ///
    /// [`Error::ScanSize`].
    pub fn check_depth(
        &self,
        frame: &Frame,
        sensor: &SensorModel,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let camera = frame.camera();
        let (right, bottom) = (camera.width() as f64 - 1.0, camera.height() as f64 - 1.0);
        let corners = [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]];
        let length = |pixel| {
            let [x, y, z] = camera.back_project(pixel, sensor.max_depth.into());
            (x * x + y * y + z * z).sqrt()
        };
        let reach = corners.map(length).into_iter().fold(0.0, f64::max);
        let readings = Readings::Depth { frame, sensor, static_mask: None, color: None, world_from_camera };
        self.check_readings(world_from_camera.translation(), reach, &readings)
    }

    /// As [`Self::check_depth`] for a [scan](Self::insert_scan).
    ///
    /// # Errors
    ///
    /// [`Error::ScanSize`].
    pub fn check_scan(&self, origin: [f64; 3], points: &[Point]) -> Result<(), Error> {
        self.check_readings(origin, f64::INFINITY, &Readings::Points { points, colors: None })
    }

    fn check_readings(&self, origin: [f64; 3], reach: f64, readings: &Readings<'_>) -> Result<(), Error> {
        let most = Self::MAX_SCAN_BLOCKS / 2;
        let side = 2.0 * reach.min(self.config().max_range) / (SIDE * self.resolution()) + 3.0;
        // A sensor outside the map inserts nothing.
        let (false, Ok(origin)) = (side.powi(3) <= most as f64, self.ray_origin(origin)) else {
            return Ok(());
        };
        let (mut scratch, mut report) = (ScanScratch::default(), InsertReport::default());
        find_cells(readings, &origin, &self.lattice, self.config(), &mut scratch, &mut report);
        self.check_blocks(&origin, &scratch, most)
    }

    /// Refuses rays that pass more than `most` blocks. Rays are followed from block to block, one ray for
    /// each block that holds ends.
    pub(super) fn check_blocks(
        &self,
        origin: &RayOrigin,
        scratch: &ScanScratch,
        most: usize,
    ) -> Result<(), Error> {
        let blocks = Lattice::new(SIDE * self.resolution());
        let range = self.config().max_range;
        let Some(key) = blocks.key_f32(origin.point) else { return Ok(()) };
        let from = RayOrigin::new(origin.point, key, &blocks);
        let mut marks = SparseMarks::default();
        let mut known: HashSet<u64, BuildHasherDefault<IntegerHasher>> = HashSet::default();
        for ends in [&scratch.hits, &scratch.cut] {
            for (i, &key) in ends.keys.iter().enumerate() {
                if !known.insert(pack(key.map(|index| index / SIDE as u16))) {
                    continue;
                }
                let end = match self.config().rays {
                    RayMode::PerCell => self.lattice.center_f32(key),
                    RayMode::PerPoint => ends.points.get(i).copied().unwrap_or(origin.point),
                };
                let end = if origin.distance(end) <= range { end } else { origin.cut(end, range) };
                let Some(key) = blocks.key_f32(end) else { continue };
                marks.hit(key);
                from.pass_to(end, key, &mut marks);
                if known.len().is_multiple_of(RAYS) && marks.count() > most {
                    return Err(Error::ScanSize { most });
                }
            }
        }
        if marks.count() > most { Err(Error::ScanSize { most }) } else { Ok(()) }
    }
}
