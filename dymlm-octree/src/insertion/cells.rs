use dymlm_core::{ColorImage, Frame, Mask, PinholeCamera, Point, Pose, Rgb, SensorModel};

use super::cell_colors::CellColors;
use super::ray::RayOrigin;
use super::scan_scratch::{RayEnds, ScanScratch};
use crate::lattice::{Key, Lattice, OUTSIDE};
use crate::{InsertReport, OctreeConfig, RayMode};

/// What is inserted.
pub(crate) enum Readings<'a> {
    Points {
        points: &'a [Point],
        colors: Option<&'a [Rgb]>,
    },
    /// All images of the camera's size.
    Depth {
        frame: &'a Frame,
        sensor: &'a SensorModel,
        static_mask: Option<&'a Mask>,
        color: Option<&'a ColorImage>,
        world_from_camera: &'a Pose,
    },
}

/// A box of cells, from and to including.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    min: Key,
    max: Key,
}

impl Bounds {
    /// The part that rays can reach, `reach` cells far.
    pub(crate) fn within_reach(&self, origin: Key, reach: f64) -> ([i32; 3], [i32; 3]) {
        let reach = reach.min(65536.0).ceil() as i32 + 2;
        let origin = origin.map(i32::from);
        (
            std::array::from_fn(|axis| i32::from(self.min[axis]).max(origin[axis] - reach)),
            std::array::from_fn(|axis| i32::from(self.max[axis]).min(origin[axis] + reach)),
        )
    }
}

/// Index along x of a pixel without a reading; far from all that [`Lattice::indices`] finds, inside the map
/// and outside.
const NO_READING: u32 = 1 << 31;

/// Some readings side by side: a row of a depth image, or a stretch of a cloud. An array for each of x, y, z,
/// so that the compiler makes vector code of the loops over them.
#[derive(Debug, Default)]
pub(crate) struct Row {
    /// Direction of each column's pixel on the camera's horizon, in the world. (Depth images only.)
    rays: [Vec<f32>; 3],
    /// Points in the world, metres.
    world: [Vec<f32>; 3],
    /// Their cells; x is [`NO_READING`] where there is none.
    indices: [Vec<u32>; 3],
    /// Not 0 where the cell differs from the one before, or `is_cut` does.
    changes: Vec<u32>,
    /// 1 where the reading is beyond the sensor's range, and the point was set to the end of the range on its
    /// ray; else 0.
    is_cut: Vec<u32>,
}

/// What a row holds.
struct RowSummary {
    readings: usize,
    /// Whether some lie outside the map or are not finite.
    some_outside: bool,
}

/// Points of a cloud that are looked at together.
const STRETCH: usize = 512;

/// Finds the cells of readings: fills `hits` and `cut` of the scratch, and sums up colours. Returns the box
/// around the cells and the origin.
pub(crate) fn find_cells(
    readings: &Readings<'_>,
    origin: &RayOrigin,
    lattice: &Lattice,
    config: &OctreeConfig,
    scratch: &mut ScanScratch,
    report: &mut InsertReport,
) -> Bounds {
    scratch.hits.clear();
    scratch.cut.clear();
    let mut cells = CellList {
        origin,
        lattice,
        config,
        hits: &mut scratch.hits,
        cut: &mut scratch.cut,
        colors: &mut scratch.colors,
        bounds: Bounds { min: origin.key, max: origin.key },
        report,
    };
    match *readings {
        Readings::Points { points, colors } => {
            for start in (0..points.len()).step_by(STRETCH) {
                let stretch = start..(start + STRETCH).min(points.len());
                scratch.row.copy_points(&points[stretch.clone()]);
                scratch.row.find_indices(lattice);
                cells.add_row(&mut scratch.row, colors.map(|colors| &colors[stretch]));
            }
        }
        Readings::Depth { frame, sensor, static_mask, color, world_from_camera } => {
            let camera = frame.camera();
            scratch.row.prepare(camera, world_from_camera);
            for v in 0..camera.height() {
                let pixels = v * camera.width()..(v + 1) * camera.width();
                let depths = &frame.depth().data()[pixels.clone()];
                scratch.row.back_project(camera, sensor, world_from_camera, v, depths);
                scratch.row.find_indices(lattice);
                scratch.row.drop_pixels(sensor, depths, v, static_mask);
                let colors = color.map(|color| &color.data()[pixels.clone()]);
                cells.add_row(&mut scratch.row, colors);
            }
        }
    }
    cells.bounds
}

/// The cells found so far.
struct CellList<'a> {
    origin: &'a RayOrigin,
    lattice: &'a Lattice,
    config: &'a OctreeConfig,
    hits: &'a mut RayEnds,
    cut: &'a mut RayEnds,
    colors: &'a mut CellColors,
    bounds: Bounds,
    report: &'a mut InsertReport,
}

impl CellList<'_> {
    fn add_row(&mut self, row: &mut Row, colors: Option<&[Rgb]>) {
        let summary = row.compare_neighbors();
        self.report.readings += summary.readings;
        if self.config.rays == RayMode::PerCell && colors.is_none() && !summary.some_outside {
            self.add_changes(row);
        } else {
            let count = row.world[0].len();
            for i in (0..count).filter(|&i| row.indices[0][i] != NO_READING) {
                self.add(row.cell(i), row.point(i), row.is_cut[i] != 0, colors.map(|colors| colors[i]));
            }
        }
    }

    /// The common case, a ray a cell: neighbouring pixels mostly share theirs.
    fn add_changes(&mut self, row: &Row) {
        for (i, &change) in row.changes.iter().enumerate() {
            if change != 0 && row.indices[0][i] != NO_READING {
                self.add_key(row.cell(i).map(|index| index as u16), row.is_cut[i] != 0);
            }
        }
    }

    fn add(&mut self, cell: [u32; 3], point: Point, is_cut: bool, color: Option<Rgb>) {
        if cell.iter().any(|&index| index >= OUTSIDE) {
            self.skip(point);
            return;
        }
        let key = cell.map(|index| index as u16);
        if let Some(color) = color.filter(|_| !is_cut) {
            self.add_color(key, point, color);
        }
        let ends = if is_cut { &mut *self.cut } else { &mut *self.hits };
        if self.config.rays == RayMode::PerPoint {
            ends.points.push(point);
        } else if ends.keys.last() == Some(&key) {
            return;
        }
        self.add_key(key, is_cut);
    }

    #[inline]
    fn add_key(&mut self, key: Key, is_cut: bool) {
        let ends = if is_cut { &mut *self.cut } else { &mut *self.hits };
        ends.keys.push(key);
        for ((min, max), index) in self.bounds.min.iter_mut().zip(&mut self.bounds.max).zip(key) {
            *min = index.min(*min);
            *max = index.max(*max);
        }
    }

    fn skip(&mut self, point: Point) {
        if point.iter().all(|coordinate| coordinate.is_finite()) {
            self.report.outside += 1;
        } else {
            self.report.not_finite += 1;
        }
    }

    fn add_color(&mut self, key: Key, point: Point, color: Rgb) {
        let end = match self.config.rays {
            RayMode::PerCell => self.lattice.center_f32(key),
            RayMode::PerPoint => point,
        };
        if self.origin.distance(end) <= self.config.max_range {
            self.colors.add(key, color);
        }
    }
}

impl Row {
    fn cell(&self, i: usize) -> [u32; 3] {
        [self.indices[0][i], self.indices[1][i], self.indices[2][i]]
    }

    fn point(&self, i: usize) -> Point {
        [self.world[0][i], self.world[1][i], self.world[2][i]]
    }

    fn resize(&mut self, count: usize) {
        self.world.iter_mut().for_each(|world| world.resize(count, 0.0));
        self.indices.iter_mut().for_each(|indices| indices.resize(count, 0));
        self.changes.resize(count, 0);
        self.is_cut.clear();
        self.is_cut.resize(count, 0);
    }

    fn copy_points(&mut self, points: &[Point]) {
        self.resize(points.len());
        for (axis, world) in self.world.iter_mut().enumerate() {
            for (world, point) in world.iter_mut().zip(points) {
                *world = point[axis];
            }
        }
    }

    /// Turns the rays of a camera's columns into the world.
    fn prepare(&mut self, camera: &PinholeCamera, world_from_camera: &Pose) {
        let rotation = world_from_camera.rotation_matrix();
        for (rays, [x, _, z]) in self.rays.iter_mut().zip(rotation) {
            rays.clear();
            rays.extend((0..camera.width()).map(|u| ((u as f64 - camera.cx()) / camera.fx() * x + z) as f32));
        }
        self.resize(camera.width());
    }

    /// Row v of a depth image: (ray of the column + what the row adds) * depth + camera centre.
    fn back_project(
        &mut self,
        camera: &PinholeCamera,
        sensor: &SensorModel,
        world_from_camera: &Pose,
        v: usize,
        depths: &[f32],
    ) {
        let farthest = sensor.max_depth;
        for (is_cut, &depth) in self.is_cut.iter_mut().zip(depths) {
            *is_cut = u32::from(depth > farthest);
        }
        let rotation = world_from_camera.rotation_matrix();
        let translation = world_from_camera.translation();
        let ray_y = (v as f64 - camera.cy()) / camera.fy();
        for axis in 0..3 {
            let (row, center) = ((ray_y * rotation[axis][1]) as f32, translation[axis] as f32);
            for ((world, &ray), &depth) in self.world[axis].iter_mut().zip(&self.rays[axis]).zip(depths) {
                *world = (ray + row) * if depth > farthest { farthest } else { depth } + center;
            }
        }
    }

    fn find_indices(&mut self, lattice: &Lattice) {
        for (indices, world) in self.indices.iter_mut().zip(&self.world) {
            lattice.indices(world, indices);
        }
    }

    /// Pixels without a depth, too near or outside the mask are no readings.
    fn drop_pixels(&mut self, sensor: &SensorModel, depths: &[f32], v: usize, mask: Option<&Mask>) {
        for (index, &depth) in self.indices[0].iter_mut().zip(depths) {
            *index = if depth > 0.0 && depth >= sensor.min_depth && depth < f32::INFINITY {
                *index
            } else {
                NO_READING
            };
        }
        if let Some(mask) = mask {
            mask.overwrite_outside(v, &mut self.indices[0], NO_READING);
        }
    }

    /// Fills `changes`.
    fn compare_neighbors(&mut self) -> RowSummary {
        let [x, y, z] = &self.indices;
        let mut readings = 0;
        let mut outside = 0;
        for ((&x, &y), &z) in x.iter().zip(y).zip(z) {
            let reading = u32::from(x != NO_READING);
            readings += reading;
            outside |= reading & u32::from((x | y | z) >= OUTSIDE);
        }
        for (axis, indices) in self.indices.iter().enumerate() {
            let pairs = indices.iter().zip(indices.iter().skip(1));
            for (change, (&before, &here)) in self.changes.iter_mut().skip(1).zip(pairs) {
                let difference = before ^ here;
                *change = if axis == 0 { difference } else { *change | difference };
            }
        }
        for (change, pair) in self.changes.iter_mut().skip(1).zip(self.is_cut.windows(2)) {
            *change |= pair[0] ^ pair[1];
        }
        if let Some(first) = self.changes.first_mut() {
            *first = 1;
        }
        RowSummary { readings: readings as usize, some_outside: outside != 0 }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<f32>() * (3 * self.rays[0].capacity() + 8 * self.changes.capacity())
    }
}
