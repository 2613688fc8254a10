use dymlm_core::{Frame, Mask, Point, Pose, Rgb, SensorModel};

use super::ScanScratch;
use super::cells::{Readings, find_cells};
use super::marks::Marks;
use super::ray::RayOrigin;
use super::reading_row::is_reading;
use crate::lattice::pack;
use crate::{Error, Octree, RayMode};

/// What the insertion of a scan did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct InsertReport {
    /// Readings given: points, or pixels in the mask with a depth that is not too near.
    pub readings: usize,
    /// Readings skipped because a coordinate is NaN or infinite.
    pub not_finite: usize,
    /// Readings skipped because they lie outside the map of 65536 cells along each axis.
    pub outside: usize,
    /// Rays followed.
    pub rays: usize,
    /// Of these, rays cut at the maximum range or the sensor's farthest depth; they hit nothing.
    pub cut_rays: usize,
    /// Cells hit, each counted once.
    pub hit_cells: usize,
    /// Cells passed and not hit, each counted once.
    pub missed_cells: usize,
}

/// Inserting scans.
impl Octree {
    /// Inserts a scan: the cell of every reading within the range is hit once, every cell that a ray from the
    /// origin to a reading passes before its end is missed once, and hits win over misses. Readings beyond
    /// the range miss the cells up to it.
    ///
    /// `origin` (the sensor) and `points` are in the world, metres. Both are in single precision, as in
    /// OctoMap: the origin is rounded to it. The leaves afterwards are those of OctoMap's
    /// `insertPointCloud(points, origin, max_range, lazy_eval = false, discretize)`, bit by bit, with
    /// `discretize` true for [`RayMode::PerCell`] and false for [`RayMode::PerPoint`]. Points that are not
    /// finite or outside the map are skipped and counted (`OctoMap` wraps them round to the other side).
    ///
    /// Costs O(points + cells passed by rays + v / 64), where v is the number of cells in the box around the
    /// scan, and allocates nothing once its buffers have grown. Above 2^27 cells v does not count: marks go to
    /// hash maps of that scan instead, and a first pass finds the blocks that it may add.
    ///
    /// # Errors
    ///
    /// [`Error::Origin`]; [`Error::ScanSize`].
    ///
    /// ```
    /// use dymlm_octree::{CellState, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// let report = map.insert_scan([0.0, 0.0, 0.0], &[[2.0, 0.0, 0.0], [f32::NAN; 3]])?;
    /// assert_eq!((report.hit_cells, report.not_finite), (1, 1));
    /// assert_eq!(map.state([2.0, 0.0, 0.0]), CellState::Occupied);
    /// assert_eq!(map.state([1.0, 0.0, 0.0]), CellState::Free);
    /// assert_eq!(map.state([3.0, 0.0, 0.0]), CellState::Unknown);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn insert_scan(&mut self, origin: [f64; 3], points: &[Point]) -> Result<InsertReport, Error> {
        let origin = self.ray_origin(origin)?;
        self.insert(&origin, &Readings::Points { points, colors: None })
    }

    /// [`Self::insert_scan`] with a colour for each point. Without
    /// [`OctreeConfig::color`](crate::OctreeConfig::color) the colours are ignored.
    ///
    /// # Errors
    ///
    /// [`Error::Origin`]; [`Error::ScanSize`]; [`Error::Core`] when points and colours differ in number.
    pub fn insert_scan_colored(
        &mut self,
        origin: [f64; 3],
        points: &[Point],
        colors: &[Rgb],
    ) -> Result<InsertReport, Error> {
        let origin = self.ray_origin(origin)?;
        if points.len() != colors.len() {
            return Err(dymlm_core::Error::ColorCount { points: points.len(), colors: colors.len() }.into());
        }
        let colors = Some(colors).filter(|_| self.config().color);
        self.insert(&origin, &Readings::Points { points, colors })
    }

    /// Inserts a depth frame. The back-projected readings within the sensor's range are inserted exactly as
    /// by [`Self::insert_scan`]; readings beyond [`max_depth`](SensorModel::max_depth) are cut there: their
    /// rays free cells and hit nothing.
    ///
    /// A reading is a pixel with a depth of at least [`min_depth`](SensorModel::min_depth) that is `true` in
    /// `static_mask` (without a mask, every pixel is); any other pixel changes nothing, neither at its
    /// surface nor in the space before it. Back-projection is in single precision: within 1e-5 m of exact in
    /// a room. A frame taken from outside the map changes nothing: its readings are counted as
    /// [outside](InsertReport::outside).
    ///
    /// # Errors
    ///
    /// [`Error::Core`] when the mask is of another size than the frame; [`Error::ScanSize`].
    #[doc(alias = "insertPointCloud")]
    pub fn insert_depth(
        &mut self,
        frame: &Frame,
        sensor: &SensorModel,
        static_mask: Option<&Mask>,
        world_from_camera: &Pose,
    ) -> Result<InsertReport, Error> {
        if let Some(mask) = static_mask {
            frame.camera().check_size("the static mask", mask.width(), mask.height())?;
        }
        let Ok(origin) = self.ray_origin(world_from_camera.translation()) else {
            let readings = count_readings(frame, sensor, static_mask);
            return Ok(InsertReport { readings, outside: readings, ..InsertReport::default() });
        };
        let color = frame.color().filter(|_| self.config().color);
        let readings = Readings::Depth { frame, sensor, static_mask, color, world_from_camera };
        self.insert(&origin, &readings)
    }

    pub(super) fn ray_origin(&self, origin: [f64; 3]) -> Result<RayOrigin, Error> {
        // OctoMap's coordinates are single precision.
        let point = origin.map(|coordinate| coordinate as f32);
        match self.lattice.key_f32(point) {
            Some(key) => Ok(RayOrigin::new(point, key, &self.lattice)),
            None => Err(Error::Origin { origin, half_extent: self.lattice.half_extent() }),
        }
    }

    /// The steps of an insertion: cells of the readings, marks along their rays, update of the marked cells.
    fn insert(&mut self, origin: &RayOrigin, readings: &Readings<'_>) -> Result<InsertReport, Error> {
        let mut scratch = std::mem::take(&mut self.scratch);
        let mut report = InsertReport::default();
        let bounds = find_cells(readings, origin, &self.lattice, self.config(), &mut scratch, &mut report);
        let (min, max) = bounds.within_reach(origin.key(), self.config().max_range / self.resolution());
        let mut window = std::mem::take(&mut scratch.window);
        let fits_window = window.lay(min, max);
        if !fits_window && let Err(refused) = self.check_blocks(origin, &scratch, Self::MAX_SCAN_BLOCKS) {
            scratch.window = window;
            scratch.colors.drain(|_, _| ());
            self.scratch = scratch;
            return Err(refused);
        }
        let mut sparse = std::mem::take(&mut scratch.sparse);
        if fits_window {
            self.mark_rays(origin, &mut scratch, &mut window, &mut report);
            self.apply_marks(&mut window, &mut report);
        } else {
            self.mark_rays(origin, &mut scratch, &mut sparse, &mut report);
            self.apply_marks(&mut sparse, &mut report);
        }
        (scratch.window, scratch.sparse) = (window, sparse);
        scratch.colors.drain(|key, color| self.tree.blend_color(key, color));
        self.scratch = scratch;
        Ok(report)
    }

    /// Marks the hits, and the cells that their rays pass.
    fn mark_rays<M: Marks>(
        &self,
        origin: &RayOrigin,
        scratch: &mut ScanScratch,
        marks: &mut M,
        report: &mut InsertReport,
    ) {
        let per_cell = self.config().rays == RayMode::PerCell;
        let range = self.config().max_range;
        for (i, &key) in scratch.hits.keys.iter().enumerate() {
            // Most readings are in a cell that has its ray already.
            if per_cell && marks.is_hit(key) {
                continue;
            }
            let end = if per_cell { self.lattice.center_f32(key) } else { scratch.hits.points[i] };
            if origin.distance(end) <= range {
                report.hit_cells += usize::from(marks.hit(key));
                origin.pass_to(end, key, marks);
                report.rays += 1;
            } else if !per_cell || scratch.far.insert(pack(key)) {
                self.mark_cut_ray(origin, origin.cut(end, range), marks, report);
            }
        }
        for (i, &key) in scratch.cut.keys.iter().enumerate() {
            let end = if per_cell { self.lattice.center_f32(key) } else { scratch.cut.points[i] };
            if !per_cell || scratch.far.insert(pack(key)) {
                let end = if origin.distance(end) <= range { end } else { origin.cut(end, range) };
                self.mark_cut_ray(origin, end, marks, report);
            }
        }
        scratch.far.clear();
    }

    /// Marks the cells passed by a ray that hits nothing.
    fn mark_cut_ray<M: Marks>(
        &self,
        origin: &RayOrigin,
        end: Point,
        marks: &mut M,
        report: &mut InsertReport,
    ) {
        if let Some(key) = self.lattice.key_f32(end) {
            origin.pass_to(end, key, marks);
            report.rays += 1;
            report.cut_rays += 1;
        }
    }

    fn apply_marks<M: Marks>(&mut self, marks: &mut M, report: &mut InsertReport) {
        marks.drain(|corner, misses, hits| {
            report.missed_cells += misses.iter().map(|word| word.count_ones() as usize).sum::<usize>();
            self.tree.observe(corner, misses, hits, &self.model);
        });
        self.tree.settle();
    }
}

/// Number of readings of a frame.
fn count_readings(frame: &Frame, sensor: &SensorModel, static_mask: Option<&Mask>) -> usize {
    let depth = frame.depth();
    let counts = |u: usize, v: usize| {
        is_reading(depth.at(u, v), sensor) && static_mask.is_none_or(|mask| mask.at(u, v))
    };
    let row = |v: usize| (0..depth.width()).filter(|&u| counts(u, v)).count();
    (0..depth.height()).map(row).sum()
}
